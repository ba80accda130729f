//! Drawn shapes of a scene as numbers.

use jointplay_physics::machine::{Geometry, Vec3};
use jointplay_scene::{Scene, sticks};
use numpy::PyArray2;
use numpy::ndarray::Array2;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Body (`None` for the world), kind, and dimensions by name, m, in body axes.
pub type DrawnShape<'py, 's> = (Option<&'s str>, &'static str, Bound<'py, PyDict>);

/// Shapes of the world, then of each body; bars to its joints for a body without shapes.
pub fn shapes<'py, 's>(py: Python<'py>, scene: &'s Scene) -> PyResult<Vec<DrawnShape<'py, 's>>> {
    let (machine, sticks) = (&scene.machine, sticks(scene));
    let mut all = Vec::new();
    for shape in &machine.fixed_shapes {
        let (kind, dimensions) = numbers(py, &shape.geometry)?;
        all.push((None, kind, dimensions));
    }
    for (b, body) in machine.bodies.iter().enumerate() {
        for shape in sticks.get(&b).unwrap_or(&body.shapes) {
            let (kind, dimensions) = numbers(py, &shape.geometry)?;
            all.push((Some(&body.name[..]), kind, dimensions));
        }
    }
    Ok(all)
}

fn numbers<'py>(py: Python<'py>, geometry: &Geometry) -> PyResult<(&'static str, Bound<'py, PyDict>)> {
    let all = PyDict::new(py);
    let vector = |name, v: &Vec3| all.set_item(name, [v.x, v.y, v.z]);
    let bar = |from, to, radius: &f64| {
        vector("from", from)?;
        vector("to", to)?;
        all.set_item("radius", radius)
    };
    let kind = match geometry {
        Geometry::Capsule { from, to, radius } => bar(from, to, radius).map(|()| "capsule"),
        Geometry::Cylinder { from, to, radius } => bar(from, to, radius).map(|()| "cylinder"),
        Geometry::Cone { from, to, radius } => bar(from, to, radius).map(|()| "cone"),
        Geometry::Box { centre, size } => {
            vector("centre", centre)?;
            vector("size", size).map(|()| "box")
        }
        Geometry::Sphere { centre, radius } => {
            vector("centre", centre)?;
            all.set_item("radius", radius).map(|()| "sphere")
        }
        Geometry::Plate { corners, triangles, thickness } => {
            all.set_item("corners", table(py, corners, |corner, i| corner[i]))?;
            all.set_item("triangles", table(py, triangles, |triangle, i| triangle[i] as i64))?;
            all.set_item("thickness", thickness).map(|()| "plate")
        }
        Geometry::Mesh { mesh, unit, position, rotation } => {
            let placed = |v: &[f32; 3]| position + rotation * (Vec3::from(v.map(f64::from)) * *unit);
            let vertices: Vec<Vec3> = mesh.vertices().iter().map(placed).collect();
            all.set_item("vertices", table(py, &vertices, |vertex, i| vertex[i]))?;
            all.set_item("faces", table(py, mesh.triangles(), |face, i| i64::from(face[i]))).map(|()| "mesh")
        }
    };
    Ok((kind?, all))
}

/// An array with three columns.
fn table<'py, R, T: numpy::Element>(
    py: Python<'py>,
    rows: &[R],
    entry: impl Fn(&R, usize) -> T,
) -> Bound<'py, PyArray2<T>> {
    PyArray2::from_owned_array(py, Array2::from_shape_fn((rows.len(), 3), |(row, i)| entry(&rows[row], i)))
}
