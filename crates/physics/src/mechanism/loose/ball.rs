//! A ball in a socket: one contact, at the centres, which coincide without play.

use super::{Anchor, Cut, Kind};

pub(super) struct Ball;

impl Kind for Ball {
    fn closed(&self, [carrier, carried]: [Anchor; 2]) -> Cut {
        Cut::point(carried, carrier)
    }

    fn sites(&self, frames: [Anchor; 2]) -> Vec<[Anchor; 2]> {
        vec![frames]
    }
}
