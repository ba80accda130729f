//! Kinds of joints with play, one file each.

mod ball;
mod division;
mod implied;
mod pin;
mod profile;
mod slide;
mod sphere;
mod wall;

pub use division::{Division, Edges, Part, Shape, Spot};
pub use implied::drop_implied;
pub use profile::{Bumps, Profile, WornWall};
pub use sphere::Grid;
pub use wall::{Edge, Stiffness, Wall};

use super::model::{Anchor, Frame, Pair, Site};
use super::pairs::{Cut, Rows};
use crate::machine::{JointKind, LooseJoint, LooseKind};

/// What distinguishes one kind of joint from another.
pub struct Compiled {
    /// The joint without play.
    pub closed: Cut,
    /// What it does not leave free with play.
    pub lasting: Option<Cut>,
    /// Where its bodies can touch with play.
    pub sites: Vec<Site>,
}

impl LooseKind {
    /// A joint of this kind between the frames of the carrier and of the carried part, with these of its plays; `joint` is its index.
    pub(super) fn compile(&self, joint: usize, frames: &[Frame; 2], plays: [bool; 2]) -> Compiled {
        match self {
            Self::Ball => ball::compile(joint, frames),
            Self::Pin(pin) => pin::compile(pin, joint, frames, plays),
            Self::Slide(slide) => slide::compile(slide, joint, frames, plays),
        }
    }
}

impl LooseJoint {
    /// Division of its surfaces into the cells of its wear map; without cells if it has no play.
    pub fn division(&self) -> Division {
        match &self.kind {
            LooseKind::Ball => ball::division(self),
            LooseKind::Pin(pin) => pin::division(pin, self),
            LooseKind::Slide(slide) => slide::division(slide, self),
        }
    }
}
