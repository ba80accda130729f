//! A block in a guide, in a plane: each corner touches its own wall (Flores et al. 2008, J. Comput. Nonlinear Dynam. 3, 011007).

use super::{Anchor, Compiled, Frame, JointKind, Pair, Rows, Site, Stiffness, Wall};
use crate::machine::Slide;

pub(super) fn compile(slide: &Slide, joint: usize, frames: &[Frame; 2]) -> Compiled {
    let pair = Pair::of_frames(JointKind::Prismatic, frames);
    let [guide, block] = frames;
    let sites = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)].map(|(x, y)| {
        let corner = block.axes[0] * (x * slide.half_length) + block.axes[1] * (y * slide.half_width);
        let on_wall = guide.axes[1] * (y * slide.half_width);
        Site {
            joint,
            carrier: Anchor { offset: guide.origin.offset + on_wall, ..guide.origin },
            carried: Anchor { offset: block.origin.offset + corner, ..block.origin },
            wall: Wall::Plane(guide.axes[1] * y),
            stiffness: Stiffness::Corner(slide.corner_radius),
            is_reversed: false,
        }
    });
    let [x, y, _] = pair.axes;
    let across = pair.child_axes[2];
    let in_plane = [x, y].map(|parent| Rows::Perpendicular { child: across, parent });
    Compiled {
        closed: pair.cut(),
        lasting: pair.keeping(vec![pair.along(2)], in_plane.to_vec()),
        sites: sites.to_vec(),
    }
}
