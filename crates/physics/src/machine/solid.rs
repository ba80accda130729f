//! Mass properties of shapes of uniform density.

use super::{Geometry, Mat3, Mesh, Shape, Vec3};
use std::f64::consts::PI;

/// Volume and its first two moments.
#[derive(Clone, Copy, Debug)]
pub struct Solid {
    /// m^3.
    pub volume: f64,
    /// Centroid, m.
    pub centre: Vec3,
    /// Integral of r r' over the volume, r from the centroid, m^5.
    second: Mat3,
}

impl Solid {
    /// Volume and moments of one shape.
    pub fn of(geometry: &Geometry) -> Self {
        match geometry {
            Geometry::Sphere { centre, radius } => {
                let volume = 4.0 / 3.0 * PI * radius * radius * radius;
                let second = Mat3::identity() * (volume * radius * radius / 5.0);
                Self::new(volume, *centre, second)
            }
            Geometry::Box { centre, size } => {
                let volume = size.x * size.y * size.z;
                let second = Mat3::from_diagonal(&size.component_mul(size)) * (volume / 12.0);
                Self::new(volume, *centre, second)
            }
            Geometry::Cylinder { from, to, radius } => Self::cylinder(from, to, *radius),
            Geometry::Cone { from, to, radius } => {
                let (axis, height) = direction(from, to);
                let volume = PI * radius * radius * height / 3.0;
                let square = [0.15 * radius * radius, 0.0375 * height * height];
                let centre = from + axis * (0.25 * height);
                Self::new(volume, centre, moments_of_revolution(&axis, square) * volume)
            }
            Geometry::Capsule { from, to, radius } => {
                let (axis, _) = direction(from, to);
                let volume = 2.0 / 3.0 * PI * radius * radius * radius;
                // The centroid of half a ball lies 3/8 of the radius from its flat side.
                let out = axis * (0.375 * radius);
                let fifth = radius * radius / 5.0;
                let square = [fifth, fifth - 0.140_625 * radius * radius];
                let cap = |centre| Self::new(volume, centre, moments_of_revolution(&axis, square) * volume);
                let ends = [cap(from - out), cap(to + out)];
                let bar = (from != to).then(|| Self::cylinder(from, to, *radius));
                Self::sum(ends.into_iter().chain(bar))
            }
            Geometry::Plate { corners, triangles, thickness } => Self::plate(corners, triangles, *thickness),
            Geometry::Mesh { mesh, unit, position, rotation } => {
                let Self { volume, centre, second } = Self::of_mesh(mesh);
                let turn = rotation.to_rotation_matrix().into_inner();
                let area = unit * unit;
                Self::new(
                    volume * area * unit,
                    position + turn * centre * *unit,
                    turn * second * turn.transpose() * (area * area * unit),
                )
            }
        }
    }

    /// Sum of several solids; overlapping volume counts twice.
    pub fn sum(parts: impl IntoIterator<Item = Self>) -> Self {
        let (mut volume, mut first, mut second) = (0.0, Vec3::zeros(), Mat3::zeros());
        for part in parts {
            volume += part.volume;
            first += part.centre * part.volume;
            second += part.second + part.centre * part.centre.transpose() * part.volume;
        }
        let centre = if volume > 0.0 { first / volume } else { first };
        Self::new(volume, centre, second - centre * centre.transpose() * volume)
    }

    /// Sum over all shapes of a body.
    pub fn of_shapes(shapes: &[Shape]) -> Self {
        Self::sum(shapes.iter().map(|shape| Self::of(&shape.geometry)))
    }

    /// Inertia about the centroid at unit density, m^5.
    pub fn inertia(&self) -> Mat3 {
        Mat3::identity() * self.second.trace() - self.second
    }

    /// Approximate extent from the origin, m: distance of the centroid plus radius of gyration about it.
    pub fn reach(&self) -> f64 {
        self.centre.norm() + (self.second.trace() / self.volume).sqrt()
    }

    fn new(volume: f64, centre: Vec3, second: Mat3) -> Self {
        Self { volume, centre, second }
    }

    fn cylinder(from: &Vec3, to: &Vec3, radius: f64) -> Self {
        let (axis, height) = direction(from, to);
        let volume = PI * radius * radius * height;
        let square = [0.25 * radius * radius, height * height / 12.0];
        Self::new(volume, 0.5 * (from + to), moments_of_revolution(&axis, square) * volume)
    }

    /// Interior of a closed mesh: tetrahedra with a common vertex and signed volumes.
    fn of_mesh(mesh: &Mesh) -> Self {
        let origin = mesh.middle();
        Self::of_tetrahedra(mesh.tetrahedra(origin)).moved(Vec3::from(origin.map(f64::from)))
    }

    /// The same, displaced by `by`, m.
    fn moved(self, by: Vec3) -> Self {
        Self { centre: self.centre + by, ..self }
    }

    /// Tetrahedra between the origin and each of these triangles, m, with signed volumes: for the triangles of a closed surface,
    /// seen counter-clockwise from outside, the solid that it encloses, by the divergence theorem. Over a tetrahedron, the mean of
    /// r is s / 4 and that of r r' is (sum of v v' + s s') / 20, with s the sum of its corners v.
    fn of_tetrahedra(triangles: impl Iterator<Item = [Vec3; 3]>) -> Self {
        let (mut volume, mut first, mut second) = (0.0, Vec3::zeros(), Mat3::zeros());
        for [a, b, c] in triangles {
            let part = a.dot(&b.cross(&c)) / 6.0;
            let sum = a + b + c;
            let squares = a * a.transpose() + b * b.transpose() + c * c.transpose();
            volume += part;
            first += sum * (part / 4.0);
            second += (squares + sum * sum.transpose()) * (part / 20.0);
        }
        let centre = if volume > 0.0 { first / volume } else { first };
        second -= centre * centre.transpose() * volume;
        Self::new(volume, centre, second)
    }

    /// Extruded polygon, given by its triangulation.
    fn plate(corners: &[Vec3], triangles: &[[usize; 3]], thickness: f64) -> Self {
        let triangles = triangles.iter().map(|&[i, j, k]| {
            let origin = corners[i];
            let (a, b) = (corners[j] - origin, corners[k] - origin);
            let normal = a.cross(&b);
            let area = 0.5 * normal.norm();
            let volume = area * thickness;
            let centre = (a + b) / 3.0;
            let sum = a + b;
            let flat =
                (a * a.transpose() + b * b.transpose() + sum * sum.transpose()) / 12.0 - centre * centre.transpose();
            let across = normal * normal.transpose() / normal.norm_squared();
            let square = if area > 0.0 { flat + across * (thickness * thickness / 12.0) } else { Mat3::zeros() };
            Self::new(volume, origin + centre, square * volume)
        });
        Self::sum(triangles)
    }
}

/// Unit vector from one point to the other, x if they coincide, and their distance, m.
fn direction(from: &Vec3, to: &Vec3) -> (Vec3, f64) {
    let length = (to - from).norm();
    if length > 0.0 { ((to - from) / length, length) } else { (Vec3::x(), 0.0) }
}

/// Mean of r r' of a solid of revolution, from its mean squares across and along the axis, m^2.
fn moments_of_revolution(axis: &Vec3, [across, along]: [f64; 2]) -> Mat3 {
    let axial = axis * axis.transpose();
    (Mat3::identity() - axial) * across + axial * along
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether `point` lies in the shape, from the shape's definition.
    fn contains(geometry: &Geometry, point: &Vec3) -> bool {
        let on_axis = |from: &Vec3, to: &Vec3| {
            let (axis, length) = direction(from, to);
            let along = (point - from).dot(&axis);
            (along / length, (point - from - axis * along).norm())
        };
        match geometry {
            Geometry::Sphere { centre, radius } => (point - centre).norm() <= *radius,
            Geometry::Box { centre, size } => {
                (point - centre).abs().zip_map(size, |x, s| x <= 0.5 * s) == nalgebra::Vector3::repeat(true)
            }
            Geometry::Cylinder { from, to, radius } => {
                let (along, across) = on_axis(from, to);
                (0.0..=1.0).contains(&along) && across <= *radius
            }
            Geometry::Cone { from, to, radius } => {
                let (along, across) = on_axis(from, to);
                (0.0..=1.0).contains(&along) && across <= radius * (1.0 - along)
            }
            Geometry::Capsule { from, to, radius } => {
                let (along, _) = on_axis(from, to);
                let near = from + (to - from) * along.clamp(0.0, 1.0);
                (point - near).norm() <= *radius
            }
            Geometry::Plate { corners, thickness, .. } => {
                let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).normalize();
                let of_mesh = |i: usize| {
                    let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
                    normal.dot(&(b - a).cross(&(point - a))) >= 0.0
                };
                (point - corners[0]).dot(&normal).abs() <= 0.5 * thickness && (0..corners.len()).all(of_mesh)
            }
            Geometry::Mesh { .. } => unreachable!("tested against forms"),
        }
    }

    #[test]
    fn moments_agree_with_sums_over_interior_points() {
        let (a, b) = (Vec3::new(-0.3, 0.1, -0.2), Vec3::new(0.4, 0.3, 0.25));
        let forms = [
            Geometry::Sphere { centre: a, radius: 0.4 },
            Geometry::Box { centre: b, size: Vec3::new(0.3, 0.7, 0.5) },
            Geometry::Cylinder { from: a, to: b, radius: 0.3 },
            Geometry::Cone { from: a, to: b, radius: 0.5 },
            Geometry::Capsule { from: a, to: b, radius: 0.25 },
            Geometry::Plate {
                corners: vec![
                    Vec3::new(-0.6, -0.3, 0.1),
                    Vec3::new(0.5, -0.5, 0.0),
                    Vec3::new(0.7, 0.2, 0.1),
                    Vec3::new(0.0, 0.6, 0.207_407_407_407_407_4),
                ],
                triangles: vec![[0, 1, 2], [0, 2, 3]],
                thickness: 0.2,
            },
        ];
        // Midpoint rule.
        const CELLS: i32 = 120;
        let size = 2.0 / f64::from(CELLS);
        let at = |i: i32| (f64::from(i) + 0.5) * size - 1.0;
        for form in &forms {
            let (mut volume, mut first, mut second) = (0.0, Vec3::zeros(), Mat3::zeros());
            for i in 0..CELLS {
                for j in 0..CELLS {
                    for k in 0..CELLS {
                        let point = Vec3::new(at(i), at(j), at(k));
                        if contains(form, &point) {
                            volume += size.powi(3);
                            first += point * size.powi(3);
                            second += point * point.transpose() * size.powi(3);
                        }
                    }
                }
            }
            let centre = first / volume;
            second -= centre * centre.transpose() * volume;
            let inertia = Mat3::identity() * second.trace() - second;
            let solid = Solid::of(form);
            assert!((solid.volume / volume - 1.0).abs() < 0.01, "{form:?}: {} {volume}", solid.volume);
            assert!((solid.centre - centre).norm() < 0.003, "{form:?}: {} {centre}", solid.centre);
            let off = (solid.inertia() - inertia).amax() / inertia.amax();
            assert!(off < 0.02, "{form:?}: {} {inertia}", solid.inertia());
        }
    }

    #[test]
    fn a_capsule_without_length_is_a_ball_and_parts_add_up() {
        let centre = Vec3::new(0.1, 0.2, 0.3);
        let ball = Solid::of(&Geometry::Sphere { centre, radius: 0.2 });
        let capsule = Solid::of(&Geometry::Capsule { from: centre, to: centre, radius: 0.2 });
        assert!((ball.volume - capsule.volume).abs() < 1e-15);
        assert!((ball.inertia() - capsule.inertia()).amax() < 1e-15);
        let half = |x: f64| {
            let size = Vec3::new(0.1, 0.3, 0.4);
            Solid::of(&Geometry::Box { centre: Vec3::new(x, 0.0, 0.0), size })
        };
        let whole = Solid::of(&Geometry::Box { centre: Vec3::zeros(), size: Vec3::new(0.2, 0.3, 0.4) });
        let both = Solid::sum([half(-0.05), half(0.05)]);
        assert!((whole.inertia() - both.inertia()).amax() < 1e-16 && both.centre.norm() < 1e-16);
    }
}
