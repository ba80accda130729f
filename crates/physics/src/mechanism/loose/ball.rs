//! A ball in a socket: one contact, at the centres, which coincide without play.

use super::{Compiled, Cut, Frame, Site, Stiffness, Wall};

pub(super) fn compile(joint: usize, frames: &[Frame; 2]) -> Compiled {
    let [carrier, carried] = frames.map(|frame| frame.origin);
    let (wall, stiffness) = (Wall::Socket, Stiffness::Joint(1.0));
    Compiled {
        closed: Cut::point(carried, carrier),
        lasting: None,
        sites: vec![Site { joint, carrier, carried, wall, play: 0, stiffness, is_reversed: false, place: 0 }],
    }
}
