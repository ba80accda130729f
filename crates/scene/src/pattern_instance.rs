//! One copy of a pattern: what its names become, and where it lies.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Arc;

use jointplay_physics::machine::{Quat, Vec3};

/// One copy of a pattern: what its names become, and where what it leaves to the outside lies.
#[derive(Clone, Debug)]
pub(super) struct PatternInstance {
    /// Counted from 1.
    pub number: u32,
    /// A point on the axis, m, about which copies are turned.
    pub centre: Vec3,
    pub turn: Quat,
    pub shift: Vec3,
    /// Names of the bodies and of the joints that the pattern has.
    pub bodies: Arc<BTreeSet<String>>,
    pub joints: Arc<BTreeSet<String>>,
}

impl PatternInstance {
    /// `name` of something that the pattern has.
    pub fn name(&self, name: &str) -> String {
        format!("{name}{}", self.number)
    }

    /// Which body `name` is: that of the copy, or one outside.
    pub fn body<'a>(&self, name: &'a str) -> Cow<'a, str> {
        self.own(&self.bodies, name)
    }

    /// Which joint `name` is: that of the copy, or one outside.
    pub fn joint<'a>(&self, name: &'a str) -> Cow<'a, str> {
        self.own(&self.joints, name)
    }

    fn own<'a>(&self, names: &BTreeSet<String>, name: &'a str) -> Cow<'a, str> {
        if names.contains(name) { Cow::Owned(self.name(name)) } else { Cow::Borrowed(name) }
    }

    /// Whether `name` is that of a body in this copy.
    pub fn made(&self, name: &str) -> bool {
        let own = name.strip_suffix(&self.number.to_string());
        own.is_some_and(|own| self.bodies.contains(own))
    }

    /// Where a point of the first copy lies in this one, m.
    pub fn point(&self, point: Vec3) -> Vec3 {
        self.centre + self.turn * (point - self.centre) + self.shift
    }

    /// Where a direction of the first copy points in this one.
    pub fn direction(&self, direction: Vec3) -> Vec3 {
        self.turn * direction
    }

    /// How an orientation of the first copy is turned in this one.
    pub fn rotation(&self, rotation: Quat) -> Quat {
        self.turn * rotation
    }

    /// Whether the copy is only shifted: a box, whose edges keep to the axes, can follow.
    pub fn keeps_axes(&self) -> bool {
        self.turn.angle() == 0.0
    }
}
