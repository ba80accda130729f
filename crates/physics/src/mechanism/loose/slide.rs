//! A block in a guide: each corner touches its own walls (Flores et al. 2008, J. Comput. Nonlinear Dynam. 3, 011007, for the plane).

use super::{Anchor, Compiled, Division, Frame, JointKind, LooseJoint, Pair, Part, Rows, Shape, Site, Stiffness, Wall};
use crate::machine::Slide;

pub(super) fn compile(slide: &Slide, joint: usize, frames: &[Frame; 2], [across, second]: [bool; 2]) -> Compiled {
    let pair = Pair::of_frames(JointKind::Prismatic, frames);
    let [guide, block] = frames;
    let [x, y, z] = [slide.half_length, slide.half_width, slide.half_height.unwrap_or(0.0)];
    // In a plane two corners are one.
    let heights = if slide.half_height.is_some() { vec![-1.0, 1.0] } else { vec![0.0] };
    let mut sites = Vec::new();
    for (corner, (sx, sy)) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)].into_iter().enumerate() {
        for (upper, &sz) in heights.iter().enumerate() {
            let offset = block.axes[0] * (sx * x) + block.axes[1] * (sy * y) + block.axes[2] * (sz * z);
            let carried = Anchor { offset: block.origin.offset + offset, ..block.origin };
            for (play, side, axis, half) in [(0, sy, 1, y), (1, sz, 2, z)] {
                let normal = guide.axes[axis] * side;
                if [across, second][play] && side != 0.0 {
                    sites.push(Site {
                        joint,
                        carrier: Anchor { offset: guide.origin.offset + normal * half, ..guide.origin },
                        carried,
                        wall: Wall::Plane(normal),
                        play,
                        stiffness: Stiffness::Corner(slide.corner_radius),
                        is_reversed: false,
                        place: (heights.len() * (heights.len() * corner + upper) + play) as u8,
                    });
                }
            }
        }
    }
    // Without one play, its pair of walls holds the block across them and against yaw or pitch, and against roll.
    let [child_x, child_y, _] = pair.child_axes;
    let held = [(!across, 1), (!second, 2)].into_iter().filter_map(|(held, axis)| held.then_some(axis));
    let held: Vec<usize> = held.collect();
    let parallel = |axis: usize| Rows::Perpendicular { child: child_x, parent: pair.axes[axis] };
    let roll = Rows::Perpendicular { child: child_y, parent: pair.axes[2] };
    let mut orientations: Vec<Rows> = held.iter().map(|axis| parallel(*axis)).collect();
    orientations.extend((!held.is_empty()).then_some(roll));
    let positions = held.iter().map(|axis| pair.along(*axis)).collect();
    Compiled { closed: pair.cut(), lasting: pair.keeping(positions, orientations), sites }
}

/// The walls beside the block, which takes the cells along the guide with it: of each wall a part for each of the corners there.
pub(super) fn division(slide: &Slide, joint: &LooseJoint) -> Division {
    let [x, y, z] = [slide.half_length, slide.half_width, slide.seat_half_height()];
    // In a plane two corners are one.
    let areas = [x * z * if slide.half_height.is_some() { 1.0 } else { 2.0 }, x * y];
    let plays = joint.contact.clearances();
    let parts = (0..joint.kind.site_names().len() as u8).filter_map(|place| {
        let across = joint.kind.play_of(place);
        (plays[across] > 0.0).then(|| Part { place, shape: Shape::Whole, area: areas[across] })
    });
    Division::along_axes(&joint.frames[0], parts.collect())
}
