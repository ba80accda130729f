//! Results of one scene as a folder: points as CSV and JSON, diagrams as SVG and PNG, and their provenance.

use serde_json::{Map, Value as Json, json};

use super::picture::picture;
use crate::analysis::{End, Phase, Point, WorkPrecision};
use crate::cli::tables::{self, number};
use crate::cli::{Failure, machine, provenance};
use crate::files::Folder;
use crate::scene::Scene;

/// PNG pixels per diagram pixel.
const PNG_SCALE: f32 = 2.0;

/// Columns of the CSV file of one phase, each after its name.
const OF_PHASE: [&str; 8] = ["end", "simulated_s", "wall_s", "ratio", "steps", "evaluations", "rejected", "front"];

/// Writes all files into `folder`; returns their provenance.
pub(super) fn fill(folder: &Folder, found: &WorkPrecision, scene: &Scene) -> Result<Map<String, Json>, Failure> {
    let sheet = picture(found, false, &machine::name());
    let drawing = |error: crate::chart::SheetError| Failure::io(error.to_string());
    let mut meta = provenance::meta(scene);
    // All methods were run, whatever the scene asks for.
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

/// The reference.
fn reference(found: &WorkPrecision) -> Result<Json, Failure> {
    let reference = &found.reference;
    let names: Vec<&str> = reference.scene().machine.ball_joints.iter().map(|j| j.name.as_str()).collect();
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

fn cells(phase: &Phase) -> [String; OF_PHASE.len()] {
    let end = match phase.end {
        End::Reached => "reached",
        End::Capped => "capped",
        End::Stopped(_) | End::Refused(_) => "stopped",
    };
    [
        end.to_owned(),
        number(phase.simulated_s),
        number(phase.wall_s),
        number(phase.ratio),
        phase.steps.to_string(),
        phase.evaluations.to_string(),
        phase.rejected.to_string(),
        u8::from(phase.front).to_string(),
    ]
}

fn csv(found: &WorkPrecision) -> String {
    let [impacts, settled] =
        ["impacts", "settled"].map(|phase| OF_PHASE.map(|name| format!("{phase}_{name}")).join(","));
    let head = format!(
        "method,step_s,tolerance,preset,{impacts},peak_error,position_error_m,energy_error,{settled},settled_error"
    );
    let row = |point: &Point| {
        let (setting, errors) = (&point.setting, &point.errors);
        let mut row = vec![
            setting.method.word().to_owned(),
            number(setting.step_s),
            number(setting.adaptive.then_some(setting.tolerance)),
            point.preset.map_or("", |preset| preset.word()).to_owned(),
        ];
        row.extend(cells(&point.impacts));
        row.extend([errors.peak, errors.position_m, errors.energy].map(number));
        row.extend(point.settled.as_ref().map(cells).unwrap_or_default());
        row.push(number(errors.settled));
        row
    };
    tables::csv(&head, found.points.iter().map(row))
}
