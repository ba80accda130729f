//! The documentation page, its diagrams and the record of the presets, measured on the built-in scenes.

use std::io::Write as _;
use std::path::Path;

use super::picture::{is_baseline, picture};
use super::points::{costs as cost_table, end, errors, facts, times, value};
use crate::analysis::presets::{Measured, Record, choose, limit};
use crate::analysis::{CaseCost, Phase, Point, Setting, WorkPrecision};
use crate::cli::tables::{Table, fill, yes_or_no};
use crate::cli::{Failure, machine};
use crate::files::{OutputFile, publish};
use crate::machine::Preset;

/// Scenes whose diagrams the page shows: the default one, and one in which the methods differ most.
const DRAWN: [&str; 2] = ["spcmm", "chain"];
/// Files written under the source folder: the diagrams of these scenes, the page, and the record of the presets.
const FILES: [&str; 4] =
    ["docs/tradeoff-spcmm.svg", "docs/tradeoff-chain.svg", "docs/tradeoff.md", "assets/presets.json"];
/// Headings common to all tables of points.
const OF_POINT: &str = "Ratio, impacts | Peak error | Position error (m) | Energy error | Ratio, settled | Force error";

/// Claims all files before measuring starts.
///
/// # Errors
/// A folder that is not the program's source, or cannot be written.
pub(super) fn claim(root: &Path) -> Result<Vec<OutputFile>, Failure> {
    FILES.iter().map(|name| Ok(OutputFile::claim(&root.join(name), true)?)).collect()
}

/// Writes all files; every text is composed before the first file changes.
pub(super) fn write(
    files: Vec<OutputFile>,
    all_results: &[WorkPrecision],
    paces: &[(&str, f64)],
    costs: &[CaseCost],
) -> Result<(), Failure> {
    let machine = machine::name();
    let failed = |error: &dyn std::fmt::Display| Failure::io(error.to_string());
    let mut texts = Vec::with_capacity(FILES.len());
    for name in DRAWN {
        let results = all_results.iter().find(|results| results.reference.scene().name == name);
        let sheet = picture(results.expect("every built-in scene is measured"), true, &machine);
        texts.push(sheet.svg().map_err(|e| failed(&e))?);
    }
    let scenes = all_results.iter().map(|results| section(&results.reference.scene().name, Some(results)));
    texts.push(page(&machine, all_results, paces, scenes.collect(), costs));
    let record = serde_json::to_string_pretty(&record(all_results, paces, &machine)).map_err(|e| failed(&e))?;
    texts.push(record + "\n");
    let written = files.into_iter().zip(&texts).map(|(file, text)| file.fill(|to| to.write_all(text.as_bytes())));
    Ok(publish(written.collect::<Result<Vec<_>, _>>()?)?)
}

fn record(all_results: &[WorkPrecision], paces: &[(&str, f64)], machine: &str) -> Record {
    let pace = paces.iter().map(|(scene, pace)| ((*scene).to_owned(), *pace)).collect();
    let mut record = Record { machine: machine.to_owned(), pace, ..Record::default() };
    for results in all_results {
        let scene = &results.reference.scene().name;
        for (preset, point) in presets(results) {
            let preset = preset.word().to_owned();
            let setting = (point.setting.method.word().to_owned(), point.setting.value());
            record.scenes.entry(scene.clone()).or_default().insert(preset.clone(), Measured::of(point));
            record.points.entry(scene.clone()).or_default().insert(preset, setting);
        }
    }
    record
}

fn presets(results: &WorkPrecision) -> impl Iterator<Item = (Preset, &Point)> {
    Preset::ALL.into_iter().filter_map(|preset| Some((preset, results.preset(preset)?)))
}

/// The page on `scenes` with its headings, diagrams and table heads, but without measurements.
pub fn skeleton(scenes: &[&str]) -> String {
    page("", &[], &[], scenes.iter().map(|name| section(name, None)).collect(), &[])
}

fn page(
    machine: &str,
    all_results: &[WorkPrecision],
    paces: &[(&str, f64)],
    scenes: String,
    costs: &[CaseCost],
) -> String {
    let choices = Preset::ALL.map(|preset| {
        [false, true].map(|many| {
            let is_in_group = |results: &&WorkPrecision| {
                many == (results.reference.scene().machine.joints_with_clearance() >= Preset::MANY_JOINTS)
            };
            let in_group: Vec<&WorkPrecision> = all_results.iter().filter(is_in_group).collect();
            let words = |setting: &Setting| format!("{} {}", setting.method, value(setting));
            let own = in_group.first().and_then(|results| results.preset(preset)).map(|point| words(&point.setting));
            let chosen = choose(&in_group, limit(preset)).map(|setting| words(&setting));
            let [own, chosen] = [own, chosen].map(|setting| setting.unwrap_or_else(|| "-".to_owned()));
            let balls = if many { "8 or more" } else { "fewer than 8" };
            vec![preset.word().to_owned(), balls.to_owned(), own, format!("{:e}", limit(preset)), chosen]
        })
    });
    let preset_rows = all_results.iter().flat_map(|results| {
        presets(results).map(move |(preset, point)| {
            let held = point.errors.peak.map_or_else(|| "-".to_owned(), |error| yes_or_no(error <= limit(preset)));
            row([&results.reference.scene().name, preset.word()], results, point, held)
        })
    });
    let paces =
        paces.iter().map(|(scene, pace)| vec![(*scene).to_owned(), times(Some(*pace)), yes_or_no(*pace >= 1.0)]);
    let choices = Table::new(
        "Preset | Loose balls | Setting | Limit of peak errors | Chosen by this run",
        choices.into_iter().flatten(),
    );
    let gaps = [
        ("machine", machine.to_owned()),
        ("choices", choices.markdown()),
        ("presets", Table::new(&format!("Scene | Preset | {OF_POINT} | Held"), preset_rows).markdown()),
        ("paces", Table::new("Scene | Speed | Keeps up", paces).markdown()),
        ("scenes", scenes),
        ("costs", cost_table(costs).markdown()),
    ];
    fill(include_str!("page.md"), &gaps)
}

/// Section of a scene: reference, diagram if the scene is among `DRAWN`, fastest settings, and named points.
fn section(name: &str, results: Option<&WorkPrecision>) -> String {
    let facts = results.into_iter().flat_map(facts).map(|(label, value)| format!("- {label}: {value}\n"));
    let picture = if DRAWN.contains(&name) {
        format!("![Error against time of every method, {name}](tradeoff-{name}.svg)\n\n")
    } else {
        String::new()
    };
    let points = results.into_iter().flat_map(|results| {
        let named = results.points.iter().filter(|point| is_named(point));
        named.map(|point| point_row(results, point))
    });
    format!(
        "## Scene `{name}`\n\n{}\n{picture}{}\n{}\n",
        facts.collect::<String>(),
        Table::new("Error | At most | Fastest | Ratio", results.into_iter().flat_map(fastest)).markdown(),
        Table::new(&format!("Method | Setting | {OF_POINT} | Front"), points).markdown()
    )
}

/// The fastest setting for each error limit.
fn fastest(results: &WorkPrecision) -> Vec<Vec<String>> {
    let row = |of: &str, limit: f64, point: Option<&Point>, ratio: Option<f64>| {
        let setting = point.map(|point| format!("{} {}", point.setting.method, value(&point.setting)));
        vec![of.to_owned(), format!("{limit:e}"), setting.unwrap_or_else(|| "-".to_owned()), times(ratio)]
    };
    let mut rows = [0.05, 0.01, 1e-4, 1e-6].map(|limit| {
        let point = results.fastest_within(limit);
        row("peaks", limit, point, point.and_then(|point| point.impacts.ratio))
    });
    let settled = results.fastest_settled_within(0.01);
    let ratio = settled.and_then(|point| point.settled.as_ref()?.ratio);
    [&mut rows[..], &mut [row("settled forces", 0.01, settled, ratio)]].concat()
}

/// Whether a point is on a front, a preset, or the baseline.
fn is_named(point: &Point) -> bool {
    on_fronts(point) != [false; 2] || point.preset.is_some() || is_baseline(point)
}

fn on_fronts(point: &Point) -> [bool; 2] {
    [point.impacts.front, point.settled.as_ref().is_some_and(|phase| phase.front)]
}

fn point_row(results: &WorkPrecision, point: &Point) -> Vec<String> {
    let front = match on_fronts(point) {
        [true, true] => "i s",
        [true, false] => "i",
        [false, true] => "s",
        [false, false] => "",
    };
    let preset = point.preset.map_or_else(String::new, |preset| format!(" ({})", preset.word()));
    let setting = value(&point.setting) + &preset;
    row([point.setting.method.word(), &setting], results, point, front.to_owned())
}

/// Ratios and errors of a point, between its names and a last cell.
fn row(names: [&str; 2], results: &WorkPrecision, point: &Point, last: String) -> Vec<String> {
    let ratio = |phase: &Phase| match end(phase) {
        "" => times(phase.ratio),
        ended => ended.to_owned(),
    };
    let settled = point.settled.as_ref().map_or_else(|| "-".to_owned(), ratio);
    let [peak, position, energy, force] = errors(results, point);
    let [a, b] = names.map(str::to_owned);
    vec![a, b, ratio(&point.impacts), peak, position, energy, settled, force, last]
}
