//! Meshes in an implausible unit: millimetres read as metres, or the reverse.

use super::solid::Solid;
use super::*;

/// A mesh that extends this many times as far as the rest of the machine has the wrong unit: attachment points so close together
/// are rare, and the error is a factor of 1000.
const MAX_RELATIVE_EXTENT: f64 = 30.0;

/// Smallest plausible extent of a mesh, as a fraction of the extent of the rest of its body.
const MIN_EXTENT_ON_BODY: f64 = 0.01;
/// The same as a fraction of the extent of the machine, which may have screws.
const MIN_EXTENT_IN_MACHINE: f64 = 0.001;

/// Likely units of a file: value of the key `unit`, and length in m.
const UNITS: [(&str, f64); 2] = [("mm", 1e-3), ("m", 1.0)];

impl Machine {
    /// Warning about the mesh with the least plausible unit, if another unit would fit.
    pub(super) fn mesh_unit_warning(&self) -> Option<Warning> {
        let is_mesh = |shape: &Shape| matches!(shape.geometry, Geometry::Mesh { .. });
        if !self.bodies.iter().any(|body| body.shapes.iter().any(is_mesh)) {
            return None;
        }
        let bodies = self.extents_without_meshes();
        let machine = bodies.iter().copied().fold(self.span_of_world_points(), f64::max);
        let mut implausible = Vec::new();
        for (body, own) in self.bodies.iter().zip(bodies) {
            for (index, shape) in body.shapes.iter().enumerate() {
                let Geometry::Mesh { mesh, unit, .. } = &shape.geometry else { continue };
                let corner = mesh.bounds().map(|corner| corner.map(|x| f64::from(x).abs()));
                let corner = [0, 1, 2].map(|i| corner[0][i].max(corner[1][i]));
                let of_unit = Vec3::from(corner).norm();
                let fault = |unit: f64| {
                    let reach = of_unit * unit;
                    let large = reach / (MAX_RELATIVE_EXTENT * machine);
                    let small = (MIN_EXTENT_ON_BODY * own / reach).max(MIN_EXTENT_IN_MACHINE * machine / reach);
                    large.max(small)
                };
                let suggested_unit = UNITS.into_iter().find(|(_, other)| other != unit && fault(*other) <= 1.0);
                if let (true, Some((suggested_unit, other))) = (machine > 0.0 && fault(*unit) > 1.0, suggested_unit) {
                    let shape = format!("body.{}.shapes[{index}]", body.name);
                    let rest = if of_unit * unit < MIN_EXTENT_ON_BODY * own { own } else { machine };
                    implausible.push((
                        fault(*unit),
                        shape,
                        [of_unit * unit, of_unit * other, rest],
                        *unit,
                        suggested_unit,
                    ));
                }
            }
        }
        let others = implausible.len().saturating_sub(1);
        let worst = implausible.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        worst.map(|(_, shape, [reach, suggested_reach, rest], unit, suggested_unit)| Warning::MeshUnit {
            shape,
            others,
            unit,
            reach,
            rest,
            suggested_unit,
            suggested_reach,
        })
    }

    /// Largest distance from each body's origin, m, of its attachment points, its shapes other than meshes, and its mass if the
    /// file gives that.
    fn extents_without_meshes(&self) -> Vec<f64> {
        let mut reaches: Vec<f64> = vec![0.0; self.bodies.len()];
        for point in self.points() {
            if let Some(body) = point.body {
                reaches[body] = reaches[body].max(point.point.norm());
            }
        }
        for (reach, body) in reaches.iter_mut().zip(&self.bodies) {
            let forms = body.shapes.iter().map(|shape| &shape.geometry);
            let forms = forms.filter(|form| !matches!(form, Geometry::Mesh { .. }));
            *reach = forms.map(|form| Solid::of(form).reach()).fold(*reach, f64::max);
            if body.density.is_none() && body.mass > 0.0 {
                let gyration = (0.5 * body.inertia.trace() / body.mass).sqrt();
                *reach = reach.max(body.centre.norm() + gyration);
            }
        }
        reaches
    }

    /// Diagonal of the bounding box of the world points of joints and elements, m.
    fn span_of_world_points(&self) -> f64 {
        let mut points = self.points().filter(|point| point.body.is_none()).map(|point| point.point);
        let Some(first) = points.next() else { return 0.0 };
        let (low, high) = points.fold((first, first), |(low, high), point| (low.inf(&point), high.sup(&point)));
        (high - low).norm()
    }

    /// Attachment points of all joints and force elements.
    pub(crate) fn points(&self) -> impl Iterator<Item = Attachment> {
        let joints = self.joints.iter().chain(&self.closing_joints).flat_map(Joint::points);
        let balls = self.loose_joints.iter().flat_map(|joint| [joint.carrier(), joint.carried()]);
        let elements = self.elements.iter().flat_map(|element| element.points(self));
        joints.chain(balls).chain(elements)
    }
}
