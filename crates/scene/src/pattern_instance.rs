//! One copy of a pattern: numbered names and placement.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Arc;

use jointplay_physics::machine::{Quat, Vec3};

/// Begins a reference to a body or a joint of the previous copy.
pub(super) const PREVIOUS: &str = "previous.";

/// One copy of a pattern: its numbered names, and the transform of its attachments to the outside.
#[derive(Clone, Debug)]
pub(super) struct PatternInstance {
    /// One-based index of the copy.
    pub number: u32,
    /// A point on the axis of rotation, m.
    pub centre: Vec3,
    pub turn: Quat,
    pub shift: Vec3,
    /// Names of the pattern's bodies and joints, without numbers.
    pub bodies: Arc<BTreeSet<String>>,
    pub joints: Arc<BTreeSet<String>>,
}

impl PatternInstance {
    /// Appends the copy's number to the `name` of an item of the pattern.
    pub fn name(&self, name: &str) -> String {
        format!("{name}{}", self.number)
    }

    /// Resolves a body name: numbered if the pattern has the body, otherwise unchanged. A name after [`PREVIOUS`] gets the number of
    /// the previous copy.
    pub fn body<'a>(&self, name: &'a str) -> Cow<'a, str> {
        self.own(&self.bodies, name)
    }

    /// Resolves a joint name: numbered if the pattern has the joint, otherwise unchanged.
    pub fn joint<'a>(&self, name: &'a str) -> Cow<'a, str> {
        self.own(&self.joints, name)
    }

    fn own<'a>(&self, names: &BTreeSet<String>, name: &'a str) -> Cow<'a, str> {
        match name.strip_prefix(PREVIOUS) {
            Some(own) if names.contains(own) => Cow::Owned(format!("{own}{}", self.number - 1)),
            None if names.contains(name) => Cow::Owned(self.name(name)),
            _ => Cow::Borrowed(name),
        }
    }

    /// Whether `name` is a body of this copy or of the previous one.
    pub fn made(&self, name: &str) -> bool {
        let own = |number: u32| name.strip_suffix(&number.to_string());
        [self.number, self.number - 1].into_iter().filter_map(own).any(|own| self.bodies.contains(own))
    }

    /// Transforms a point of the first copy to this one, m.
    pub fn point(&self, point: Vec3) -> Vec3 {
        self.centre + self.turn * (point - self.centre) + self.shift
    }

    pub fn direction(&self, direction: Vec3) -> Vec3 {
        self.turn * direction
    }

    /// Transforms an orientation of the first copy to this one.
    pub fn rotation(&self, rotation: Quat) -> Quat {
        self.turn * rotation
    }

    /// Whether the copy is only translated, so that axis-aligned boxes can follow.
    pub fn keeps_axes(&self) -> bool {
        self.turn.angle() == 0.0
    }
}
