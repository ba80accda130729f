//! Kinds of joints with play, one file each.

mod ball;

use super::kinematics::Kinematics;
use super::model::{Anchor, LooseJoint};
use super::pairs::{Cut, separation};
use crate::machine::{LooseKind, Vec3};

/// What distinguishes one kind from another. Anchors are the origins of the frames of the carrier and of the carried part.
trait Kind: Sync {
    /// The joint without play.
    fn closed(&self, frames: [Anchor; 2]) -> Cut;

    /// Where its bodies can touch: for each contact, a point of the carrier and one of the carried part.
    fn sites(&self, frames: [Anchor; 2]) -> Vec<[Anchor; 2]>;
}

/// The file of each kind.
fn kind_of(kind: LooseKind) -> &'static dyn Kind {
    match kind {
        LooseKind::Ball => &ball::Ball,
    }
}

impl LooseKind {
    /// Where the bodies of a joint of this kind can touch, given the origins of the frames of the carrier and of the carried part:
    /// for each contact, a point of either.
    pub(super) fn sites(self, frames: [Anchor; 2]) -> impl Iterator<Item = [Anchor; 2]> {
        kind_of(self).sites(frames).into_iter()
    }
}

impl LooseJoint {
    /// The joint without play.
    pub fn closed(&self) -> Cut {
        kind_of(self.kind).closed([self.carrier, self.carried])
    }

    /// Origin of the carried part's frame from that of the carrier's, e = Z_j - Z_i, m (5), or a derivative of this order.
    pub fn opening(&self, motion: &[Kinematics], order: usize) -> Vec3 {
        separation([&self.carried, &self.carrier], motion, order)
    }
}
