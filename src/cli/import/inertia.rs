//! Mass, centroid and inertia of solids, and of bodies that are made of several.

use std::f64::consts::PI;

use crate::machine::{self, Geometry, Mat3, Vec3};
use crate::units::format_quantity;

/// Mass and its distribution, in the axes of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertial {
    /// Mass, kg.
    pub mass: f64,
    /// Centroid, m.
    pub centre: Vec3,
    /// Inertia about the centroid, kg m^2.
    pub inertia: Mat3,
}

/// Relative slack in the triangle inequality, as in a scene.
const TRIANGLE_SLACK: f64 = 1e-9;

/// A solid with its centre at the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Solid {
    /// Half axes along x, y and z, m.
    Ellipsoid([f64; 3]),
    /// Half edges along x, y and z, m.
    Box([f64; 3]),
    /// Radius and half length along z, m.
    Cylinder(f64, f64),
    /// Radius and half length of the cylinder along z, between two hemispheres, m.
    Capsule(f64, f64),
}

impl Solid {
    /// Volume, m^3, and principal inertias about its centre over its mass, m^2.
    fn volume_and_gyration(self) -> (f64, Vec3) {
        let ends = |half: f64| [-half, half].map(|z| Vec3::new(0.0, 0.0, z));
        let geometry = match self {
            Self::Ellipsoid([a, b, c]) => {
                let gyration = 0.2 * Vec3::new(b * b + c * c, a * a + c * c, a * a + b * b);
                return (4.0 / 3.0 * PI * a * b * c, gyration);
            }
            Self::Box(half) => Geometry::Box { centre: Vec3::zeros(), size: 2.0 * Vec3::from(half) },
            Self::Cylinder(radius, half) => {
                let [from, to] = ends(half);
                Geometry::Cylinder { from, to, radius }
            }
            Self::Capsule(radius, half) => {
                let [from, to] = ends(half);
                Geometry::Capsule { from, to, radius }
            }
        };
        let solid = machine::Solid::of(&geometry);
        (solid.volume, solid.inertia().diagonal() / solid.volume)
    }

    /// Volume, m^3.
    pub fn volume(self) -> f64 {
        self.volume_and_gyration().0
    }
}

impl Inertial {
    /// A solid of `mass` with its centre at `centre` and its axes turned by `rotation`.
    pub fn of_solid(solid: Solid, mass: f64, centre: Vec3, rotation: Mat3) -> Self {
        let own = Mat3::from_diagonal(&(mass * solid.volume_and_gyration().1));
        Self { mass, centre, inertia: rotation * own * rotation.transpose() }
    }

    /// A solid of `density`, kg/m^3, or a shell of `density`, kg/m^2.
    pub fn of_density(solid: &machine::Solid, density: f64) -> Self {
        Self { mass: density * solid.volume, centre: solid.centre, inertia: solid.inertia() * density }
    }

    /// Error message if no part of a body can have this mass and inertia. A point mass has an inertia of 0.
    pub fn error_message(&self) -> Option<String> {
        if self.mass < 0.0 {
            return Some(format!("the mass is {} kg; allowed from 0 kg", self.mass));
        }
        let mut principal: Vec<f64> = self.inertia.symmetric_eigenvalues().iter().copied().collect();
        principal.sort_by(f64::total_cmp);
        let [small, middle, large] =
            [principal[0], principal[1], principal[2]].map(|moment| format_quantity(moment, "kg m^2"));
        if principal[0] < -TRIANGLE_SLACK * principal[2].abs() {
            return Some(format!("no body has this inertia: its smallest principal moment is {small}; allowed from 0"));
        }
        let excess = principal[2] > (principal[0] + principal[1]) * (1.0 + TRIANGLE_SLACK);
        excess.then(|| {
            format!(
                "no body has this inertia: its largest principal moment, {large}, exceeds the sum of the other two, {small} and {middle}"
            )
        })
    }

    /// Mass and inertia of both together; `other` is given in the same axes.
    pub fn combined_with(self, other: Self) -> Self {
        let mass = self.mass + other.mass;
        if mass == 0.0 {
            return self;
        }
        let centre = (self.mass * self.centre + other.mass * other.centre) / mass;
        let about = |one: &Self| {
            let d = one.centre - centre;
            one.inertia + one.mass * (Mat3::identity() * d.norm_squared() - d * d.transpose())
        };
        Self { mass, centre, inertia: about(&self) + about(&other) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares volume and second moments of a solid with those of the grid points inside it.
    fn assert_moments_match_grid(solid: Solid, inside: impl Fn(Vec3) -> bool, reach: [f64; 3]) {
        const N: i32 = 80;
        let mut sums = [0.0; 4];
        let coordinate = |i: i32, reach: f64| reach * (2.0 * (f64::from(i) + 0.5) / f64::from(N) - 1.0);
        for (i, j, k) in (0..N).flat_map(|i| (0..N).flat_map(move |j| (0..N).map(move |k| (i, j, k)))) {
            let p = Vec3::new(coordinate(i, reach[0]), coordinate(j, reach[1]), coordinate(k, reach[2]));
            if inside(p) {
                let squares = p.component_mul(&p);
                let total = squares.sum();
                for (sum, part) in sums.iter_mut().zip([1.0, total - squares.x, total - squares.y, total - squares.z]) {
                    *sum += part;
                }
            }
        }
        let cell = 8.0 * reach[0] * reach[1] * reach[2] / f64::from(N).powi(3);
        assert!((sums[0] * cell / solid.volume() - 1.0).abs() < 1e-2);
        let gyration = Vec3::new(sums[1], sums[2], sums[3]) / sums[0];
        let own = solid.volume_and_gyration().1;
        let error = (gyration - own).component_div(&own);
        assert!(error.amax() < 1e-2, "{solid:?}: {error}");
    }

    #[test]
    fn solids_have_the_moments_of_their_volume() {
        let [a, b, c] = [0.3, 0.2, 0.5];
        assert_moments_match_grid(Solid::Box([a, b, c]), |_| true, [a, b, c]);
        assert_moments_match_grid(
            Solid::Ellipsoid([a, b, c]),
            |p| p.component_div(&Vec3::new(a, b, c)).norm() < 1.0,
            [a, b, c],
        );
        assert_moments_match_grid(Solid::Cylinder(a, c), |p| p.x.hypot(p.y) < a, [a, a, c]);
        let capsule = |p: Vec3| Vec3::new(p.x, p.y, p.z - p.z.clamp(-c, c)).norm() < a;
        assert_moments_match_grid(Solid::Capsule(a, c), capsule, [a, a, a + c]);
    }

    #[test]
    fn two_halves_combine_to_the_whole() {
        let half = |side: f64| {
            let centre = Vec3::new(1.0, 0.25 * side, -2.0);
            Inertial::of_solid(Solid::Box([0.1, 0.25, 0.3]), 2.0, centre, Mat3::identity())
        };
        let whole = half(1.0).combined_with(half(-1.0));
        let expected =
            Inertial::of_solid(Solid::Box([0.1, 0.5, 0.3]), 4.0, Vec3::new(1.0, 0.0, -2.0), Mat3::identity());
        assert!((whole.inertia - expected.inertia).amax() < 1e-12 && (whole.centre - expected.centre).amax() < 1e-15);
    }
}
