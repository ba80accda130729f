//! Results of one scene as a folder: points as CSV and JSON, diagrams as SVG and PNG, and what made them.

use std::fmt::Write as _;

use serde_json::{Map, Value as Json, json};

use super::picture::picture;
use crate::analysis::{End, Phase, WorkPrecision};
use crate::cli::output::significant;
use crate::cli::{Failure, machine, provenance};
use crate::files::Folder;
use crate::scene::Scene;

/// Pixels of the PNG for one of the diagram.
const PNG_SCALE: f32 = 2.0;

/// Columns of the CSV file.
const COLUMNS: [&str; 24] = [
    "method",
    "step_s",
    "tolerance",
    "preset",
    "impacts_end",
    "impacts_simulated_s",
    "impacts_wall_s",
    "impacts_ratio",
    "impacts_steps",
    "impacts_evaluations",
    "impacts_rejected",
    "impacts_front",
    "peak_error",
    "position_error_m",
    "energy_error",
    "settled_end",
    "settled_simulated_s",
    "settled_wall_s",
    "settled_ratio",
    "settled_steps",
    "settled_evaluations",
    "settled_rejected",
    "settled_front",
    "settled_error",
];

/// Writes all files into `folder`; what made them.
pub(super) fn fill(
    folder: &Folder,
    found: &WorkPrecision,
    scene: &Scene,
) -> Result<Map<String, Json>, Failure> {
    let sheet = picture(found, false, &machine::name());
    let drawing = |error: crate::chart::SheetError| Failure::io(error.to_string());
    let mut meta = provenance::meta(scene);
    // Every method had its turn, whatever the scene asks for.
    for key in ["method", "step_s", "tolerance"] {
        meta.shift_remove(key);
    }
    meta.insert("machine".into(), json!(machine::name()));
    let points = serde_json::to_value(&found.points).map_err(|e| Failure::io(e.to_string()))?;
    let whole = json!({
        "meta": meta,
        "reference": reference(found)?,
        "points": points,
    });
    let files: [(&str, Vec<u8>); 4] = [
        ("tradeoff.csv", csv(found).into_bytes()),
        ("tradeoff.json", format!("{whole:#}\n").into_bytes()),
        ("tradeoff.svg", sheet.svg().map_err(drawing)?.into_bytes()),
        ("tradeoff.png", sheet.png(PNG_SCALE).map_err(drawing)?),
    ];
    for (name, content) in files {
        folder.write(name, &content)?;
    }
    Ok(meta)
}

/// What the points are measured against.
fn reference(found: &WorkPrecision) -> Result<Json, Failure> {
    let reference = &found.reference;
    let names: Vec<&str> = reference
        .scene()
        .ball_joints
        .iter()
        .map(|j| j.name.as_str())
        .collect();
    let slots: Vec<Json> = reference
        .slots
        .iter()
        .map(|slot| {
            json!({
                "joint": names[slot.joint], "begin_s": slot.begin_s, "from_s": slot.from_s, "to_s": slot.to_s,
                "peak_normal_N": slot.peak_n,
            })
        })
        .collect();
    let settled = reference.settled.as_ref().map(|span| {
        let means = names.iter().zip(&span.means);
        let means = means.map(|(name, mean)| ((*name).to_owned(), json!(mean)));
        json!({"from_s": span.from, "to_s": span.to, "mean_force_N": Json::Object(means.collect())})
    });
    let floor = serde_json::to_value(reference.floor).map_err(|e| Failure::io(e.to_string()))?;
    Ok(json!({
        "method": reference.setting.method,
        "tolerance": reference.setting.tolerance,
        "change_at_half_the_tolerance": floor,
        "impacts": reference.impacts,
        "impacts_span_s": reference.span,
        "peaks": slots,
        "position_at_s": reference.instant,
        "settled": settled,
    }))
}

fn end(phase: &Phase) -> &'static str {
    match phase.end {
        End::Reached => "reached",
        End::Capped => "capped",
        End::Stopped(_) => "stopped",
    }
}

fn csv(found: &WorkPrecision) -> String {
    let mut out = COLUMNS.join(",");
    out.push('\n');
    // An empty cell where there is no value.
    let number = |value: Option<f64>| value.map_or_else(String::new, |v| significant(v, 12));
    for point in &found.points {
        let (setting, impacts, errors) = (&point.setting, &point.impacts, &point.errors);
        let settled = point.settled.as_ref();
        let cells: [String; COLUMNS.len()] = [
            setting.method.word().to_owned(),
            significant(setting.step_s, 12),
            if setting.adaptive {
                significant(setting.tolerance, 12)
            } else {
                String::new()
            },
            point.preset.map_or("", |preset| preset.word()).to_owned(),
            end(impacts).to_owned(),
            significant(impacts.simulated_s, 12),
            number(impacts.wall_s),
            number(impacts.ratio),
            impacts.steps.to_string(),
            impacts.evaluations.to_string(),
            impacts.rejected.to_string(),
            u8::from(impacts.front).to_string(),
            number(errors.peak),
            number(errors.position_m),
            number(errors.energy),
            settled.map_or("", end).to_owned(),
            number(settled.map(|phase| phase.simulated_s)),
            number(settled.and_then(|phase| phase.wall_s)),
            number(settled.and_then(|phase| phase.ratio)),
            settled.map_or_else(String::new, |phase| phase.steps.to_string()),
            settled.map_or_else(String::new, |phase| phase.evaluations.to_string()),
            settled.map_or_else(String::new, |phase| phase.rejected.to_string()),
            settled.map_or_else(String::new, |phase| u8::from(phase.front).to_string()),
            number(errors.settled),
        ];
        // Writing to a String cannot fail.
        let _ = writeln!(out, "{}", cells.join(","));
    }
    out
}
