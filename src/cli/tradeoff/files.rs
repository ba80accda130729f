//! Results of one scene as a folder: points as CSV and JSON, diagrams as SVG and PNG, and their provenance.

use serde_json::{Map, Value as Json, json};

use super::picture::picture;
use super::points::end;
use crate::analysis::{Phase, Point, WorkPrecision};
use crate::cli::tables::{Table, number};
use crate::cli::{Failure, machine, provenance};
use crate::files::Folder;
use crate::integrate::StepControl;
use crate::scene::Scene;

/// PNG pixels per diagram pixel.
const PNG_SCALE: f32 = 2.0;

/// CSV columns of one phase, prefixed with its name.
const OF_PHASE: [&str; 8] = ["end", "simulated_s", "wall_s", "ratio", "steps", "evaluations", "rejected", "front"];

/// Writes all files into `folder`; returns their provenance.
pub(super) fn fill(folder: &Folder, results: &WorkPrecision, scene: &Scene) -> Result<Map<String, Json>, Failure> {
    let sheet = picture(results, false, &machine::name());
    let drawing = |error: crate::chart::SheetError| Failure::io(error.to_string());
    let mut meta = provenance::meta(scene);
    // All methods were run, not only that of the scene.
    for key in ["method", "step_s", "tolerance"] {
        meta.shift_remove(key);
    }
    meta.insert("machine".into(), json!(machine::name()));
    let whole = json!({"meta": meta, "reference": reference(results), "points": results.points});
    let files: [(&str, Vec<u8>); 4] = [
        ("tradeoff.csv", points(results).csv().into_bytes()),
        ("tradeoff.json", format!("{whole:#}\n").into_bytes()),
        ("tradeoff.svg", sheet.svg().map_err(drawing)?.into_bytes()),
        ("tradeoff.png", sheet.png(PNG_SCALE).map_err(drawing)?),
    ];
    for (name, content) in files {
        folder.write(name, &content)?;
    }
    Ok(meta)
}

fn reference(results: &WorkPrecision) -> Json {
    let reference = &results.reference;
    let names: Vec<&str> = reference.scene().machine.ball_joints.iter().map(|j| j.name.as_str()).collect();
    let peaks = reference.slots.iter().map(|slot| {
        json!({
            "joint": names[slot.joint], "begin_s": slot.begin_s, "from_s": slot.from_s, "to_s": slot.to_s,
            "peak_normal_N": slot.peak_n,
        })
    });
    let settled = reference.settled.as_ref().map(|span| {
        let means = names.iter().zip(&span.means).map(|(name, mean)| ((*name).to_owned(), json!(mean)));
        json!({"from_s": span.from, "to_s": span.to, "mean_force_N": means.collect::<Map<_, _>>()})
    });
    json!({
        "method": reference.setting.method,
        "tolerance": reference.setting.tolerance,
        "change_at_half_the_tolerance": reference.floor,
        "impacts": reference.impacts,
        "impacts_span_s": reference.span,
        "peaks": peaks.collect::<Vec<_>>(),
        "position_at_s": reference.instant,
        "settled": settled,
    })
}

fn cells(phase: &Phase) -> [String; OF_PHASE.len()] {
    let end = if end(phase).is_empty() { "reached" } else { end(phase) };
    let [simulated, wall, ratio] = [Some(phase.simulated_s), phase.wall_s, phase.ratio].map(number);
    let counts = [phase.steps, phase.evaluations, phase.rejected, u64::from(phase.front)];
    let [steps, evaluations, rejected, front] = counts.map(|count| count.to_string());
    [end.to_owned(), simulated, wall, ratio, steps, evaluations, rejected, front]
}

fn points(results: &WorkPrecision) -> Table {
    let [impacts, settled] =
        ["impacts", "settled"].map(|phase| OF_PHASE.map(|name| format!("{phase}_{name}")).join(" | "));
    let heads = format!(
        "method | step_s | tolerance | steps_per_impact | preset | {impacts} | peak_error | position_error_m | energy_error | {settled} | settled_error"
    );
    let row = |point: &Point| {
        let (setting, errors) = (&point.setting, &point.errors);
        let mut row = vec![setting.method.word().to_owned(), number(setting.step_s)];
        let control = setting.method.control();
        row.push(number((control == StepControl::Error).then_some(setting.tolerance)));
        row.push(number((control == StepControl::PerImpact).then_some(f64::from(setting.steps_per_impact))));
        row.push(point.preset.map_or("", |preset| preset.word()).to_owned());
        row.extend(cells(&point.impacts));
        row.extend([errors.peak, errors.position_m, errors.energy].map(number));
        row.extend(point.settled.as_ref().map(cells).unwrap_or_default());
        row.push(number(errors.settled));
        row
    };
    Table::new(&heads, results.points.iter().map(row))
}
