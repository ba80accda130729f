//! `tradeoff`: cost and error of every method on scenes, as tables, a CSV file and the record of the presets.

use std::io::Write as _;

use serde_json::{Value as Json, json};

use super::args::{SceneArguments, TradeoffArguments};
use super::tables::{self, Table, number};
use super::{Failure, interrupt, load, machine, measuring, print, provenance, warn};
use crate::analysis::presets::{Record, limit, pace};
use crate::analysis::{Grid, Row, Tradeoff};
use crate::files::{Folder, OutputFile};
use crate::integrate::StepControl;
use crate::machine::Preset;
use crate::scene::Scene;
use crate::units::format_quantity;
use crate::units::significant;

/// Runs `tradeoff`.
///
/// # Errors
/// Bad input, before measuring starts; later a scene without a reference, Ctrl-C or the file system.
pub fn tradeoff(arguments: &TradeoffArguments) -> Result<(), Failure> {
    let load = |name: &std::ffi::OsString| {
        load(&SceneArguments { scene: Some(name.clone()), changes: arguments.changes.clone(), link: None })
    };
    let scenes: Vec<Scene> = arguments.scenes.iter().map(load).collect::<Result<_, _>>()?;
    // From here on there is a temporary folder, which an interrupted run removes.
    interrupt::listen();
    let folder = arguments.out.as_ref().map(|path| Folder::claim(path, arguments.force)).transpose()?;
    let record_file = arguments.presets.as_ref().map(|path| OutputFile::claim(path, arguments.force)).transpose()?;
    let grid = if arguments.quick { Grid::QUICK } else { Grid::FULL };
    let mut record = Record { machine: machine::name(), ..Record::default() };
    let (mut heads, mut rows) = (String::new(), Vec::new());
    for scene in &scenes {
        // Warnings about the solver do not matter here: all methods are run.
        for warning in scene.machine.warnings().iter().filter(|w| !arguments.quiet && !w.is_about_solver()) {
            warn(&warning.to_string());
        }
        let is_recorded = record_file.is_some() && scene.source.file.is_none();
        let (results, pace) = measuring::measure(arguments.quiet, Some(scene), |context| {
            let results = Tradeoff::measure(scene, &grid, context)?;
            Ok((results, if is_recorded { Some(pace(scene, context)?) } else { None }))
        })?;
        print(&text(scene, &results))?;
        for row in &results.rows {
            let values = row.values();
            heads = ["scene"].into_iter().chain(values.iter().map(|(name, _)| *name)).collect::<Vec<_>>().join(" | ");
            rows.push([vec![scene.name.clone()], values.iter().map(|(_, value)| cell(value)).collect()].concat());
        }
        if let Some(pace) = pace {
            record.add(&scene.name, &results, pace);
        }
    }
    if let Some(folder) = folder {
        folder.write("tradeoff.csv", Table::new(&heads, rows).csv().as_bytes())?;
        let mut manifest = provenance::meta(&scenes[0]);
        // All methods were run, on all scenes.
        for key in ["scene", "method", "step_s", "tolerance"] {
            manifest.shift_remove(key);
        }
        manifest.insert("scenes".into(), json!(scenes.iter().map(|scene| &scene.name).collect::<Vec<_>>()));
        manifest.insert("machine".into(), json!(machine::name()));
        let path = folder.path().to_owned();
        folder.finish(manifest)?;
        print(&format!("Written             {}\n", path.display()))?;
    }
    if let Some(file) = record_file {
        let record = serde_json::to_string_pretty(&record).map_err(|error| Failure::io(error.to_string()))?;
        file.write(|to| writeln!(to, "{record}"))?;
    }
    Ok(())
}

/// A value in CSV; empty if there is none.
fn cell(value: &Json) -> String {
    match value {
        Json::Null => String::new(),
        Json::String(word) => word.clone(),
        value => number(value.as_f64()),
    }
}

/// A step with its unit, a tolerance, or a number of steps per impact.
fn value(row: &Row) -> String {
    match row.setting.method.control() {
        StepControl::Fixed => format_quantity(row.setting.step_s, "us"),
        StepControl::Error => format!("{:e}", row.setting.tolerance),
        StepControl::PerImpact => row.setting.steps_per_impact.to_string(),
    }
}

/// The measurements of a scene for a terminal.
fn text(scene: &Scene, results: &Tradeoff) -> String {
    let reference = &results.reference;
    let compared = match reference.impacts {
        0 => "no impact; the largest reactions".to_owned(),
        impacts => format!("the first {impacts} impacts"),
    };
    let presets = Preset::ALL.map(|preset| {
        let kept = match results.preset(preset).and_then(|row| row.keeps(limit(preset))) {
            Some(true) => "",
            Some(false) => " (exceeded)",
            None => " (not reached)",
        };
        format!("{} {:e}{kept}", preset.word(), limit(preset))
    });
    let mut out = tables::lines([
        ("Scene", scene.name.clone()),
        ("Machine", machine::name()),
        ("Compared", format!("{compared} within {}", format_quantity(reference.span_s, "ms"))),
        ("Limits of peaks", presets.join(", ")),
        ("ratio", "speed over that of rk4 at 10 us".to_owned()),
        ("cost", "counted, in evaluations of the equations: the same on every computer".to_owned()),
    ]);
    let digits = |value: Option<f64>, digits| value.map_or_else(|| "-".to_owned(), |value| significant(value, digits));
    let error = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.1e}"));
    let row = |row: &Row| {
        let mut cells = vec![row.setting.method.to_string(), value(row)];
        cells.push(row.preset.map_or("", Preset::word).to_owned());
        cells.extend([digits(row.ratio, 3), digits(row.cost, 4), row.statistics.steps.to_string()]);
        let errors = &row.errors;
        cells.extend([errors.peak, errors.position_m, errors.energy, errors.force].map(error));
        cells.push(if row.time_s.is_some() { String::new() } else { row.end.word().to_owned() });
        cells
    };
    let heads = "method | value | preset | ratio | cost | steps | peak error | position error (m) | energy error | force error | ";
    out += &format!("\n{}", Table::new(heads, results.rows.iter().map(row)).text());
    for row in &results.rows {
        if let Some(why) = row.end.fault() {
            out += &format!("{} {}: {why}\n", row.setting.method, value(row));
        }
    }
    out + "\n"
}
