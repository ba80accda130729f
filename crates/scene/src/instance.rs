//! Groups of parts with names and a place of their own: a copy of a pattern, an included file, the whole scene.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Arc;

use jointplay_physics::machine::{Quat, Vec3};

/// Prefix of a reference to a body or a joint of the previous copy.
pub(super) const PREVIOUS: &str = "previous.";

/// A group of parts: its names, and the transform of its attachments to the outside. Coordinates in the frame of the world, or of
/// a body outside the group, turn and shift with it.
#[derive(Clone, Debug)]
pub(super) struct Instance<'d> {
    pub group: Group,
    pub placement: Placement,
    /// The group that this one is a part of.
    pub outer: Option<&'d Instance<'d>>,
}

/// Which parts belong to a group, and how their names begin or end.
#[derive(Clone, Debug)]
pub(super) enum Group {
    /// A copy of a pattern: its one-based index, the suffix of its names.
    Copy { number: u32, names: Arc<Names> },
    /// An included file: the prefix of its names.
    File { prefix: String, names: Arc<Names> },
    /// Everything but the world.
    Scene,
}

/// Names in a group, as written in its text.
#[derive(Clone, Debug, Default)]
pub(super) struct Names {
    pub bodies: BTreeSet<String>,
    pub joints: BTreeSet<String>,
    /// Bodies and joints of the patterns in an included file, without numbers.
    pub repeated: BTreeSet<String>,
}

/// Rotation `turn` about the point `centre`, m, then the translation `shift`, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    pub centre: Vec3,
    pub turn: Quat,
    pub shift: Vec3,
}

impl Placement {
    /// No rotation and no translation.
    pub const fn identity() -> Self {
        Self {
            centre: Vec3::new(0.0, 0.0, 0.0),
            turn: Quat::new_unchecked(QUATERNION_ONE),
            shift: Vec3::new(0.0, 0.0, 0.0),
        }
    }
}

const QUATERNION_ONE: nalgebra::Quaternion<f64> = nalgebra::Quaternion::new(1.0, 0.0, 0.0, 0.0);

impl Names {
    /// Whether a name of an included file is among `own`, or is that of a copy.
    fn has(&self, own: &BTreeSet<String>, name: &str) -> bool {
        let mut numbered = name.char_indices().rev().take_while(|(_, c)| c.is_ascii_digit());
        own.contains(name) || numbered.any(|(at, _)| self.repeated.contains(&name[..at]))
    }
}

impl Instance<'_> {
    /// Prefix of the names in an included file; empty elsewhere.
    pub fn prefix(&self) -> &str {
        match &self.group {
            Group::File { prefix, .. } => prefix,
            Group::Copy { .. } | Group::Scene => self.outer.map_or("", Instance::prefix),
        }
    }

    /// Number of the copy, if the group is a copy of a pattern.
    pub fn number(&self) -> Option<u32> {
        match self.group {
            Group::Copy { number, .. } => Some(number),
            Group::File { .. } | Group::Scene => None,
        }
    }

    /// Full name of a part that the text of the group calls `name`.
    pub fn name(&self, name: &str) -> String {
        let own = match &self.group {
            Group::Copy { number, .. } => format!("{name}{number}"),
            Group::File { .. } | Group::Scene => name.to_owned(),
        };
        format!("{}{own}", self.prefix())
    }

    /// Full name of the body that the text of the group calls `name`: one of the group, or of a group around it. A name after
    /// [`PREVIOUS`] is that of the previous copy.
    pub fn body<'a>(&self, name: &'a str) -> Cow<'a, str> {
        self.resolve(name, |names| &names.bodies)
    }

    /// Full name of a joint, like [`Self::body`].
    pub fn joint<'a>(&self, name: &'a str) -> Cow<'a, str> {
        self.resolve(name, |names| &names.joints)
    }

    fn resolve<'a>(&self, name: &'a str, of: fn(&Names) -> &BTreeSet<String>) -> Cow<'a, str> {
        match &self.group {
            Group::Copy { number, names } => match name.strip_prefix(PREVIOUS) {
                Some(own) if of(names).contains(own) => Cow::Owned(format!("{}{own}{}", self.prefix(), number - 1)),
                None if of(names).contains(name) => Cow::Owned(self.name(name)),
                _ => self.outer.map_or(Cow::Borrowed(name), |outer| outer.resolve(name, of)),
            },
            Group::File { prefix, names } if !prefix.is_empty() && names.has(of(names), name) => {
                Cow::Owned(self.name(name))
            }
            Group::File { .. } | Group::Scene => Cow::Borrowed(name),
        }
    }

    /// Whether the body with this full name, `None` for the world, belongs to the group, or to the previous copy.
    fn contains(&self, body: Option<&str>) -> bool {
        let own = body.and_then(|body| body.strip_prefix(self.prefix()));
        own.is_some_and(|own| match &self.group {
            Group::Copy { number, names } => {
                let copy = |number: u32| own.strip_suffix(&number.to_string());
                [*number, number - 1].into_iter().filter_map(copy).any(|own| names.bodies.contains(own))
            }
            Group::File { names, .. } => names.has(&names.bodies, own),
            Group::Scene => true,
        })
    }

    /// Placements that apply to attachments on `body`, a full name or `None` for the world: those of the groups, from this one
    /// outwards, that do not contain the body.
    fn placements(&self, body: Option<&str>) -> impl Iterator<Item = &Placement> {
        let groups = std::iter::successors(Some(self), |group| group.outer);
        groups.take_while(move |group| !group.contains(body)).map(|group| &group.placement)
    }

    /// Transforms a point in the frame of `body`, m.
    pub fn point(&self, body: Option<&str>, point: Vec3) -> Vec3 {
        self.placements(body)
            .fold(point, |point, Placement { centre, turn, shift }| centre + turn * (point - centre) + shift)
    }

    /// Transforms a direction in the frame of `body`.
    pub fn direction(&self, body: Option<&str>, direction: Vec3) -> Vec3 {
        self.placements(body).fold(direction, |direction, placement| placement.turn * direction)
    }

    /// Transforms an orientation in the frame of `body`.
    pub fn rotation(&self, body: Option<&str>, rotation: Quat) -> Quat {
        self.placements(body).fold(rotation, |rotation, placement| placement.turn * rotation)
    }

    /// Transforms the orientation of the frame of `body` relative to another one.
    pub fn rotation_of(&self, body: Option<&str>, rotation: Quat) -> Quat {
        self.placements(body).fold(rotation, |rotation, placement| rotation * placement.turn.inverse())
    }

    /// Whether attachments on the world are only translated, so that boxes stay parallel to the axes.
    pub fn preserves_axes(&self) -> bool {
        self.placements(None).all(|placement| placement.turn.angle() == 0.0)
    }
}
