//! Springs as coils between the current positions of their two points.

use std::f32::consts::TAU;

use glam::Vec3;

use super::{Colour, Line};

/// Fraction of the length that is straight at each end.
const STRAIGHT: f32 = 0.12;
const TURNS: f32 = 9.0;
const SEGMENTS: u16 = 96;

/// Adds a coil of `radius` (m) from `from` to `to` in lines of `width` pixels.
pub(super) fn push_coil(from: Vec3, to: Vec3, radius: f32, width: f32, colour: Colour, lines: &mut Vec<Line>) {
    let Some(along) = (to - from).try_normalize() else {
        return;
    };
    let side = along.any_orthonormal_vector();
    let other = along.cross(side);
    let point = |fraction: f32| {
        let inside = ((fraction - STRAIGHT) / (1.0 - 2.0 * STRAIGHT)).clamp(0.0, 1.0);
        let (sin, cos) = (TAU * TURNS * inside).sin_cos();
        // The wire reaches its full radius within a turn.
        let out = radius * (TURNS * inside.min(1.0 - inside)).min(1.0);
        from + (to - from) * fraction + (side * cos + other * sin) * out
    };
    let at = |k: u16| point(f32::from(k) / f32::from(SEGMENTS));
    lines.extend((0..SEGMENTS).map(|k| Line::new(at(k), at(k + 1), width, [colour; 2])));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coil_runs_from_end_to_end_within_its_radius() {
        let (from, to) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.5, 3.0));
        let mut lines = Vec::new();
        push_coil(from, to, 0.02, 2.0, Colour([1.0; 4]), &mut lines);
        let first = Vec3::from(lines[0].from);
        let last = Vec3::from(lines.last().expect("has lines").to);
        assert!(first.distance(from) < 1e-6 && last.distance(to) < 1e-6);
        let mut widest: f32 = 0.0;
        for line in &lines {
            let p = Vec3::from(line.from);
            let distance = (p - from).reject_from(Vec3::Y).length();
            widest = widest.max(distance);
            assert!(distance < 0.0201 && p.y >= 1.999 && p.y <= 2.501, "{p}");
        }
        assert!(widest > 0.0199);
        push_coil(from, from, 0.02, 2.0, Colour([1.0; 4]), &mut lines);
        assert_eq!(lines.len(), usize::from(SEGMENTS), "no coil between equal points");
    }
}
