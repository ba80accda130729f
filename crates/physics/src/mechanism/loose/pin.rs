//! A pin in a bearing: contacts at both ends of the shorter part, or one in the middle of a joint that does not tilt, and those of its
//! collars (Ambrosio & Pombo 2018, Multibody System Dynamics 42, for the unified joint; the ends share the stiffness of the joint).

use std::f64::consts::{PI, TAU};

use super::{
    Anchor, Compiled, Division, Edge, Frame, JointKind, LooseJoint, LooseKind, Pair, Part, Shape, Site, Stiffness, Wall,
};
use crate::machine::{EndsOn, Pin};

pub(super) fn compile(pin: &Pin, joint: usize, frames: &[Frame; 2], [radial, axial]: [bool; 2]) -> Compiled {
    let kind = if pin.kept { JointKind::Revolute } else { JointKind::Cylindrical };
    let pair = Pair::of_frames(kind, frames);
    let mut sites = Vec::new();
    if radial {
        sites.extend(ends(pin, joint, frames));
    }
    if axial {
        sites.extend(faces(pin, joint, frames));
    }
    // Across the axis: two lines coincide, or the axes of a pin that does not tilt stay parallel.
    let mut positions = if radial { Vec::new() } else { vec![pair.along(1), pair.along(2)] };
    positions.extend((pin.kept && !axial).then(|| pair.along(0)));
    let orientations = if radial && pin.length.is_some() { Vec::new() } else { pair.parallel() };
    Compiled { closed: pair.cut(), lasting: pair.keeping(positions, orientations), sites }
}

/// Where pin and bearing touch across the axis.
fn ends(pin: &Pin, joint: usize, [bearing, carried]: &[Frame; 2]) -> Vec<Site> {
    // The wall belongs to the part that is longer.
    let (wall, edge, at_edge, is_reversed) = match pin.ends {
        EndsOn::Bearing if pin.length.is_some() => (carried, bearing, Edge::Bearing, true),
        EndsOn::Pin | EndsOn::Bearing => (bearing, carried, Edge::Pin, false),
    };
    let offsets = pin.length.map_or(vec![0.0], |length| vec![-0.5 * length, 0.5 * length]);
    let share = LooseKind::Pin(*pin).share();
    let site = |(place, offset): (usize, f64)| Site {
        joint,
        carrier: wall.origin,
        carried: Anchor { offset: edge.origin.offset + edge.axes[0] * offset, ..edge.origin },
        wall: Wall::Bore(wall.axes[0], at_edge),
        play: 0,
        stiffness: Stiffness::Joint(share),
        is_reversed,
        place: place as u8,
    };
    offsets.into_iter().enumerate().map(site).collect()
}

/// Places of the front and of the back face among the names of the sites.
const FACES: [u8; 2] = [2, 3];

/// Where the collars touch the faces of the bearing: on the axis, or at four points on the rim of each, which belong to the bearing, so
/// that a spin moves none of them. The back comes first.
fn faces(pin: &Pin, joint: usize, [bearing, carried]: &[Frame; 2]) -> Vec<Site> {
    let [x, y, z] = bearing.axes;
    match pin.face_radius {
        None => [(-1.0, FACES[1]), (1.0, FACES[0])]
            .map(|(side, place)| Site {
                joint,
                carrier: bearing.origin,
                carried: carried.origin,
                wall: Wall::Plane(x * side),
                play: 1,
                stiffness: Stiffness::Face(1.0),
                is_reversed: false,
                place,
            })
            .to_vec(),
        Some(radius) => {
            let rim = [y, z, -y, -z].map(|direction| bearing.origin.offset + direction * radius);
            // Seen from the pin, whose axis the directions follow, the bearing moves the other way.
            let of_side = |(side, place): (f64, u8)| {
                rim.map(move |offset| Site {
                    joint,
                    carrier: carried.origin,
                    carried: Anchor { offset, ..bearing.origin },
                    wall: Wall::Plane(carried.axes[0] * -side),
                    play: 1,
                    stiffness: Stiffness::Face(0.25),
                    is_reversed: true,
                    place,
                })
            };
            [(-1.0, FACES[1]), (1.0, FACES[0])].into_iter().flat_map(of_side).collect()
        }
    }
}

/// Sectors of the wall of a bearing, 5 degrees each, and those of a face that touches at four points.
const SECTORS: u16 = 72;
const POINTS: u16 = 4;

/// The wall of the bearing, half of the length of the shorter part for each end, and its faces. A pin shorter than its bearing takes
/// these cells along the axis with it.
pub(super) fn division(pin: &Pin, joint: &LooseJoint) -> Division {
    let [radial, axial] = joint.contact.clearances().map(|play| play > 0.0);
    let (radius, bore) = (joint.contact.ball_radius, joint.contact.ball_radius + joint.contact.clearance);
    let mut parts = Vec::new();
    if radial {
        let places = if pin.length.is_some() { 2 } else { 1 };
        let area = bore * (TAU / f64::from(SECTORS)) * pin.seat_length(radius) / f64::from(places);
        parts.extend((0..places).map(|place| Part { place, shape: Shape::Ring { sectors: SECTORS }, area }));
    }
    if axial {
        let outer = pin.collar_radius(radius);
        let inner = if bore < outer { bore } else { 0.0 };
        let area = PI * (outer * outer - inner * inner);
        let (shape, area) = match pin.face_radius {
            Some(_) => (Shape::Ring { sectors: POINTS }, area / f64::from(POINTS)),
            None => (Shape::Whole, area),
        };
        parts.extend(FACES.map(|place| Part { place, shape: shape.clone(), area }));
    }
    Division::about_axis(&joint.frames[0], parts)
}
