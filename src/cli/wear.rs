//! `run --wear`: one row per cell of the walls of each joint with play, with its contacts, impulse, friction work and worn depth.

use serde_json::{Map, Value as Json, json};

use super::Failure;
use super::output::{RowsFile, Table};
use crate::files::PendingFile;
use crate::scene::Scene;
use crate::simulate::{Frame, Wear};

const COLUMNS: [&str; 14] = [
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
    "site",
    "worn_depth_m",
];

/// Writes `map`, and the worn depths of `frame`, to `file` with its provenance `meta`, under temporary names. Also returns the number
/// of rows.
///
/// # Errors
/// As [`RowsFile::fill`].
pub fn fill(
    file: RowsFile,
    (map, frame): (&Wear, &Frame),
    scene: &Scene,
    mut meta: Map<String, Json>,
) -> Result<(usize, Vec<PendingFile>), Failure> {
    let mut rows = Vec::new();
    let mut axes = Map::new();
    for (j, joint) in scene.machine.loose_joints.iter().enumerate() {
        let cells = map.division(j).each().zip(map.cells(j)).enumerate();
        for (number, ((part, cell), totals)) in cells {
            let edges = part.edges(cell);
            // A wall is not divided by all angles.
            let [polar, azimuth] = [edges.polar, edges.azimuth].map(|edges| edges.unwrap_or([f64::NAN; 2]));
            rows.push([
                j as f64,
                number as f64,
                polar[0],
                polar[1],
                azimuth[0],
                azimuth[1],
                part.area,
                totals.contacts as f64,
                totals.impulse,
                totals.friction_work,
                totals.impulse / part.area,
                totals.friction_work / part.area,
                f64::from(part.place),
                frame.worn_depth(j, &joint.kind, map.division(j), (part, cell)),
            ]);
        }
        let grid = map.division(j).axes();
        let axis = |i: usize| [0, 1, 2].map(|k| grid[(i, k)]);
        let body = joint.carrier().body.map(|b| scene.machine.bodies[b].name.as_str());
        axes.insert(joint.name.clone(), json!({"body": body, "x": axis(0), "y": axis(1), "z": axis(2)}));
    }
    let names: Vec<&str> = scene.machine.loose_joints.iter().map(|j| j.name.as_str()).collect();
    meta.insert("rows".into(), json!(rows.len()));
    // Indices in the column `joint`, from 0.
    meta.insert("ball_joints".into(), json!(names));
    // By joint, the names of the indices in the column `site`.
    meta.insert("sites".into(), scene.machine.loose_joints.iter().map(|joint| json!(joint.sites())).collect());
    // Axes of the polar angles and azimuths, in those of the carrier's body; `null` is the world.
    meta.insert("socket_axes".into(), Json::Object(axes));
    let count = rows.len();
    let table = Table::of_rows(COLUMNS, rows.into_iter());
    let files = file.fill(&table, meta)?;
    Ok((count, files))
}
