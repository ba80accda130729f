//! A map as a NumPy archive, and as points for ParaView.

use super::results::Results;
use super::vtk::Points;
use crate::cli::output::{Column, axis_column, fill_archive};
use crate::files::{FileError, OutputFile, PendingFile};
use crate::machine::Vec3;

/// Codes of `status`.
const NO_POSE: i64 = 1;
const NO_REST: i64 = 2;

/// Writes all arrays and `meta`.
///
/// # Errors
/// Input/output.
pub fn npz(results: &Results, target: OutputFile) -> Result<PendingFile, FileError> {
    let shape = results.map.design().shape();
    let shape_with = |more: &[usize]| [&shape[..], more].concat();
    let points = || 0..results.points.len();
    let vectors = |of: &dyn Fn(usize) -> Vec3| -> Vec<f64> {
        points().flat_map(|p| of(p).iter().copied().collect::<Vec<_>>()).collect()
    };
    let directions = results.directions();
    // A point with fewer directions than others has NaN in their place.
    let of_directions = |length: usize, of: &dyn Fn(&crate::mechanism::Farthest) -> Vec<f64>| -> Vec<f64> {
        let of_point = |point: usize| {
            let farthest = results.points[point].as_ref().map_or(&[][..], |at_point| &at_point.farthest);
            let mut values: Vec<f64> = farthest.iter().flat_map(of).collect();
            values.resize(directions * length, f64::NAN);
            values
        };
        points().flat_map(of_point).collect()
    };
    let parts = |v: &Vec3| v.iter().copied().collect::<Vec<f64>>();
    let unknown = || vec![f64::NAN; 3];
    let status = |point: usize| match &results.points[point] {
        Err(_) => NO_POSE,
        Ok(at_point) if at_point.settled.is_err() => NO_REST,
        Ok(_) => 0,
    };
    let unbounded = points().map(|point| results.unbounded(point).len() as i64);
    let joint = points().map(|point| results.largest_joint(point).map_or(-1, |joint| joint as i64));
    let joints = results.map.scene().machine.loose_joints.len();
    let axes = results.map.design().axes().iter().map(|axis| axis_column(axis, axis.key(), 0..axis.count()));
    let mut columns: Vec<Column> = axes.collect();
    columns.push(Column::whole("status", points().map(status).collect()).shaped(shape.clone()));
    columns.push(Column::whole("unbounded", unbounded.collect()).shaped(shape.clone()));
    for (name, of) in [
        ("ideal_tip_m", &(|p| results.ideal_tip(p)) as &dyn Fn(usize) -> Vec3),
        ("settled_error_m", &|p| results.settled(p)),
        ("largest_error_m", &|p| results.largest(p)),
        ("largest_direction", &|p| results.largest_direction(p)),
    ] {
        columns.push(Column::numbers(name, vectors(of)).shaped(shape_with(&[3])));
    }
    columns.push(Column::whole("largest_joint", joint.collect()).shaped(shape.clone()));
    let shares = points().flat_map(|point| results.shares(point)).collect();
    columns.push(Column::numbers("share_m", shares).shaped(shape_with(&[joints])));
    let direction = of_directions(3, &|farthest| parts(&farthest.direction));
    columns.push(Column::numbers("direction", direction).shaped(shape_with(&[directions, 3])));
    let support = of_directions(1, &|farthest| vec![farthest.support]);
    columns.push(Column::numbers("support_m", support).shaped(shape_with(&[directions])));
    let error = of_directions(3, &|farthest| farthest.error.as_ref().map_or_else(unknown, parts));
    columns.push(Column::numbers("error_m", error).shaped(shape_with(&[directions, 3])));
    fill_archive(target, columns.into_iter(), &results.meta())
}

/// Writes the points that have a pose, with their errors.
///
/// # Errors
/// Input/output.
pub fn vtk(results: &Results, target: OutputFile) -> Result<PendingFile, FileError> {
    let posed: Vec<usize> = (0..results.points.len()).filter(|&point| results.points[point].is_ok()).collect();
    let vectors = |of: &dyn Fn(usize) -> Vec3| posed.iter().map(|&point| of(point)).collect::<Vec<Vec3>>();
    let numbers = |of: &dyn Fn(usize) -> f64| posed.iter().map(|&point| of(point)).collect::<Vec<f64>>();
    let mut scalars = vec![
        ("settled_error_size_m".to_owned(), numbers(&|p| results.settled(p).norm())),
        ("largest_error_size_m".to_owned(), numbers(&|p| results.largest(p).norm())),
        ("largest_joint".to_owned(), numbers(&|p| results.largest_joint(p).map_or(-1.0, |joint| joint as f64))),
        ("unbounded".to_owned(), numbers(&|p| results.unbounded(p).len() as f64)),
    ];
    for (a, axis) in results.map.design().axes().iter().enumerate() {
        let value = |point: usize| axis.number(results.map.design().indices(point)[a]);
        scalars.push((axis.key().to_owned(), numbers(&value)));
    }
    let title =
        format!("jointplay map of {}: reachable errors ignore contact between bodies", results.map.scene().name);
    let content = Points {
        title: &title,
        points: vectors(&|p| results.ideal_tip(p)),
        vectors: vec![
            ("settled_error_m", vectors(&|p| results.settled(p))),
            ("largest_error_m", vectors(&|p| results.largest(p))),
        ],
        scalars,
    };
    target.fill(|file| content.write(file))
}
