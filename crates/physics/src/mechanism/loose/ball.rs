//! A ball in a socket: one contact, at the centres, which coincide without play.

use std::f64::consts::PI;

use super::{Compiled, Cut, Division, Frame, Grid, LooseJoint, Part, Shape, Site, Stiffness, Wall};

pub(super) fn compile(joint: usize, frames: &[Frame; 2]) -> Compiled {
    let [carrier, carried] = frames.map(|frame| frame.origin);
    let (wall, stiffness) = (Wall::Socket, Stiffness::Joint(1.0));
    Compiled {
        closed: Cut::point(carried, carrier),
        lasting: None,
        sites: vec![Site { joint, carrier, carried, wall, play: 0, stiffness, is_reversed: false, place: 0 }],
    }
}

/// The inner face of the socket.
pub(super) fn division(joint: &LooseJoint) -> Division {
    let part = (!joint.contact.is_ideal()).then(|| {
        let grid = Grid::of_sockets();
        let radius = joint.contact.ball_radius + joint.contact.clearance;
        let area = 4.0 * PI * radius * radius / grid.cells() as f64;
        Part { place: 0, shape: Shape::Sphere { grid }, area }
    });
    Division::about_opening(&joint.opening, part.into_iter().collect())
}
