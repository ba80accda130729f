//! `run --wear`: one row per cell of each socket's inner face, with its contacts, impulse and friction work.

use serde_json::{Map, Value as Json, json};

use super::Failure;
use super::output::{RowsFile, Table};
use crate::files::PendingFile;
use crate::machine::LooseKind;
use crate::scene::Scene;
use crate::simulate::{Edges, Wear};

const COLUMNS: [&str; 12] = [
    "joint",
    "cell",
    "polar_from_rad",
    "polar_to_rad",
    "azimuth_from_rad",
    "azimuth_to_rad",
    "area_m2",
    "contacts",
    "impulse_N_s",
    "friction_work_J",
    "impulse_N_s_m2",
    "friction_work_J_m2",
];

/// The joints with play that have no wear map, in words; `None` if all have one.
///
/// # Errors
/// Usage, if none has one.
pub fn without_map(option: &str, scene: &Scene) -> Result<Option<String>, Failure> {
    let loose = || scene.machine.loose_joints.iter().filter(|joint| !joint.contact.is_ideal());
    let others = loose().filter(|joint| joint.kind != LooseKind::Ball);
    let names: Vec<String> = others.map(|joint| format!("{} ({})", joint.name, joint.kind.word())).collect();
    if names.is_empty() {
        return Ok(None);
    }
    let words = format!("{option}: only ball joints have a wear map, not {}", names.join(", "));
    if names.len() == loose().count() { Err(Failure::usage(words)) } else { Ok(Some(words)) }
}

/// Writes `map` to `file` with its provenance `meta`, under temporary names. Also returns the number of rows.
///
/// # Errors
/// As [`RowsFile::fill`].
pub fn fill(
    file: RowsFile,
    map: &Wear,
    scene: &Scene,
    mut meta: Map<String, Json>,
) -> Result<(usize, Vec<PendingFile>), Failure> {
    let mut rows = Vec::new();
    let mut axes = Map::new();
    for (j, joint) in scene.machine.loose_joints.iter().enumerate() {
        let area = map.area(j);
        for (cell, totals) in map.cells(j).iter().enumerate() {
            let Edges { polar, azimuth } = map.grid().edges(cell);
            rows.push([
                j as f64,
                cell as f64,
                polar[0],
                polar[1],
                azimuth[0],
                azimuth[1],
                area,
                totals.contacts as f64,
                totals.impulse,
                totals.friction_work,
                totals.impulse / area,
                totals.friction_work / area,
            ]);
        }
        let grid = map.grid_from_body(j);
        let axis = |i: usize| [0, 1, 2].map(|k| grid[(i, k)]);
        let body = joint.carrier().body.map(|b| scene.machine.bodies[b].name.as_str());
        axes.insert(joint.name.clone(), json!({"body": body, "x": axis(0), "y": axis(1), "z": axis(2)}));
    }
    let names: Vec<&str> = scene.machine.loose_joints.iter().map(|j| j.name.as_str()).collect();
    meta.insert("rows".into(), json!(rows.len()));
    // Indices in the column `joint`, from 0.
    meta.insert("ball_joints".into(), json!(names));
    // Axes of the polar angles and azimuths: those of the socket's body; `null` is the world.
    meta.insert("socket_axes".into(), Json::Object(axes));
    let count = rows.len();
    let table = Table::of_rows(COLUMNS, rows.into_iter());
    let files = file.fill(&table, meta)?;
    Ok((count, files))
}
