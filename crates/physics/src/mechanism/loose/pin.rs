//! A pin in a bearing: contacts at both ends of the shorter part, or one in the middle of a joint that does not tilt (Ambrosio &
//! Pombo 2018, Multibody System Dynamics 42, for the unified joint; the ends share the stiffness of the joint).

use super::{Anchor, Compiled, Edge, Frame, JointKind, Pair, Site, Stiffness, Wall};
use crate::machine::{EndsOn, Pin};

pub(super) fn compile(pin: &Pin, joint: usize, frames: &[Frame; 2]) -> Compiled {
    let kind = if pin.held { JointKind::Revolute } else { JointKind::Cylindrical };
    let pair = Pair::of_frames(kind, frames);
    let [bearing, carried] = frames;
    // The wall belongs to the part that is longer.
    let (wall, edge, at_edge, is_reversed) = match pin.ends {
        EndsOn::Pin => (bearing, carried, Edge::Pin, false),
        EndsOn::Bearing if pin.length.is_some() => (carried, bearing, Edge::Bearing, true),
        EndsOn::Bearing => (bearing, carried, Edge::Pin, false),
    };
    let (offsets, share) = match pin.length {
        Some(length) => (vec![-0.5 * length, 0.5 * length], 0.5),
        None => (vec![0.0], 1.0),
    };
    let site = |offset: f64| {
        let end = Anchor { offset: edge.origin.offset + edge.axes[0] * offset, ..edge.origin };
        let wall_of = Wall::Bore(wall.axes[0], at_edge);
        Site {
            joint,
            carrier: wall.origin,
            carried: end,
            wall: wall_of,
            stiffness: Stiffness::Sphere(share),
            is_reversed,
        }
    };
    let axial = pin.held.then(|| pair.along(0));
    let tilts = pin.length.is_none().then(|| pair.parallel());
    Compiled {
        closed: pair.cut(),
        lasting: pair.keeping(axial.into_iter().collect(), tilts.into_iter().flatten().collect()),
        sites: offsets.into_iter().map(site).collect(),
    }
}
