//! The space that a machine moves through, as few spheres: those farthest in each of many directions.

use glam::Vec3;

/// Number of directions: at 96, a sphere between two of them is missed by less than 3 % of its distance from the middle.
const DIRECTIONS: usize = 96;

/// Spheres (centre, radius), m, whose convex hull nearly contains all that were added.
#[derive(Clone, Debug, Default)]
pub struct Swept {
    farthest: Vec<(Vec3, f32)>,
}

/// Direction `k` of a spiral that covers the sphere evenly.
fn direction(k: usize) -> Vec3 {
    const GOLDEN_ANGLE: f32 = 2.399_963;
    let z = 1.0 - (2 * k + 1) as f32 / DIRECTIONS as f32;
    let (sin, cos) = (GOLDEN_ANGLE * k as f32).sin_cos();
    let across = (1.0 - z * z).sqrt();
    Vec3::new(across * cos, across * sin, z)
}

impl Swept {
    /// Adds spheres.
    pub fn add(&mut self, spheres: impl IntoIterator<Item = (Vec3, f32)>) {
        for sphere in spheres {
            if !(sphere.0.is_finite() && sphere.1.is_finite()) {
                continue;
            }
            if self.farthest.is_empty() {
                self.farthest = vec![sphere; DIRECTIONS];
            }
            for (k, farthest) in self.farthest.iter_mut().enumerate() {
                let direction = direction(k);
                let reach = |(centre, radius): (Vec3, f32)| centre.dot(direction) + radius;
                if reach(sphere) > reach(*farthest) {
                    *farthest = sphere;
                }
            }
        }
    }

    /// The spheres.
    pub fn spheres(&self) -> &[(Vec3, f32)] {
        &self.farthest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_reaches_as_far_as_what_was_added_in_any_direction() {
        let mut swept = Swept::default();
        let ring = (0..200).map(|k| {
            let (sin, cos) = (0.0314 * k as f32).sin_cos();
            (Vec3::new(2.0 * cos, sin, 0.3 * cos * sin), 0.1)
        });
        let ring: Vec<_> = ring.collect();
        swept.add(ring.iter().copied());
        swept.add([(Vec3::NAN, 1.0)]);
        for k in 0..500 {
            let (a, b) = (k as f32 * 0.7, k as f32 * 0.31);
            let out = Vec3::new(a.cos() * b.sin(), a.sin() * b.sin(), b.cos());
            let reach =
                |spheres: &[(Vec3, f32)]| spheres.iter().map(|(p, r)| p.dot(out) + r).fold(f32::NEG_INFINITY, f32::max);
            assert!(reach(swept.spheres()) > reach(&ring) - 0.03 * 2.1, "{out}");
        }
    }
}
