//! The ground under a tyre, drawn as a ring with a cross.

use std::f32::consts::TAU;

use glam::Vec3;

use super::{Colour, Line};

const SEGMENTS: u16 = 48;

/// Adds a ring of `radius` (m) about `centre`, across `up`, with two diameters, in lines of `width` pixels.
pub(super) fn push_ground(centre: Vec3, up: Vec3, radius: f32, width: f32, colour: Colour, lines: &mut Vec<Line>) {
    let side = up.any_orthonormal_vector();
    let other = up.cross(side);
    let at = |k: u16| {
        let (sin, cos) = (TAU * f32::from(k) / f32::from(SEGMENTS)).sin_cos();
        centre + (side * cos + other * sin) * radius
    };
    let ring = (0..SEGMENTS).map(|k| (at(k), at(k + 1)));
    let across = [0, SEGMENTS / 4].map(|k| (at(k), at(k + SEGMENTS / 2)));
    let all = ring.chain(across);
    lines.extend(all.map(|(from, to)| Line::new(from, to, width, [colour; 2])));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ring_lies_on_the_ground() {
        let (centre, up) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.6, 0.0, 0.8));
        let mut lines = Vec::new();
        push_ground(centre, up, 0.2, 2.0, Colour([1.0; 4]), &mut lines);
        assert_eq!(lines.len(), usize::from(SEGMENTS) + 2);
        for end in lines.iter().flat_map(|line| [line.from, line.to]) {
            let offset = Vec3::from(end) - centre;
            assert!(offset.dot(up).abs() < 1e-6 && (offset.length() - 0.2).abs() < 1e-6);
        }
    }
}
