//! The documentation page, its diagrams and the record of the presets, measured on the built-in scenes.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

use super::picture::{is_baseline, picture};
use super::words::{cost_rows, end, error, reference, times, value};
use crate::analysis::presets::{Measured, Record, choose, limit};
use crate::analysis::{CaseCost, Phase, Point, Setting, WorkPrecision};
use crate::cli::tables::{fill, markdown};
use crate::cli::{Failure, machine};
use crate::files::{OutputFile, publish};
use crate::machine::Preset;

/// Paths under the source folder.
const PAGE: &str = "docs/tradeoff.md";
const RECORD: &str = "assets/presets.json";
/// Scenes whose diagrams the page shows: the default one, and one in which the methods differ most.
const DRAWN: [&str; 2] = ["spcmm", "chain"];

/// All files, claimed before the measuring begins.
pub(super) struct Targets {
    page: OutputFile,
    record: OutputFile,
    diagrams: Vec<OutputFile>,
}

impl Targets {
    /// # Errors
    /// A folder that is not the program's source, or cannot be written.
    pub(super) fn claim(root: &Path) -> Result<Self, Failure> {
        let claim = |name: &str| Ok::<_, Failure>(OutputFile::claim(&root.join(name), true)?);
        let diagrams = DRAWN.iter().map(|name| claim(&format!("docs/{}", diagram(name))));
        Ok(Self { page: claim(PAGE)?, record: claim(RECORD)?, diagrams: diagrams.collect::<Result<_, _>>()? })
    }

    /// Writes everything; all texts are made before the first file changes.
    pub(super) fn write(
        self,
        found: &[WorkPrecision],
        paces: &[(&str, f64)],
        costs: &[CaseCost],
    ) -> Result<(), Failure> {
        let machine = machine::name();
        let scenes: String = found.iter().map(measured_scene).collect();
        let page = page(&machine, found, paces, &scenes, costs);
        let record = serde_json::to_string_pretty(&record(found, paces, &machine))
            .map_err(|error| Failure::io(error.to_string()))?;
        let mut drawn = Vec::with_capacity(DRAWN.len());
        for name in DRAWN {
            let found = found.iter().find(|found| found.reference.scene().name == name);
            let svg = picture(found.expect("every built-in scene is measured"), true, &machine).svg();
            drawn.push(svg.map_err(|error| Failure::io(error.to_string()))?);
        }
        let put = |target: OutputFile, text: &str| target.fill(|file| file.write_all(text.as_bytes()));
        let diagrams = self.diagrams.into_iter().zip(&drawn);
        let mut files = diagrams.map(|(target, svg)| put(target, svg)).collect::<Result<Vec<_>, _>>()?;
        files.push(put(self.page, &page)?);
        files.push(put(self.record, &format!("{record}\n"))?);
        Ok(publish(files)?)
    }
}

/// File name of a scene's diagram.
fn diagram(name: &str) -> String {
    format!("tradeoff-{name}.svg")
}

fn record(found: &[WorkPrecision], paces: &[(&str, f64)], machine: &str) -> Record {
    let paces = paces.iter();
    let mut record = Record {
        machine: machine.to_owned(),
        pace: paces.map(|(scene, pace)| ((*scene).to_owned(), *pace)).collect(),
        ..Record::default()
    };
    for found in found {
        let mut measured = BTreeMap::new();
        for preset in Preset::ALL {
            if let Some(point) = found.preset(preset) {
                measured.insert(preset.word().to_owned(), Measured::of(point));
                let setting = (point.setting.method.word().to_owned(), point.setting.value());
                record.points.insert(preset.word().to_owned(), setting);
            }
        }
        record.scenes.insert(found.reference.scene().name.clone(), measured);
    }
    record
}

/// The page on `scenes` with its headings, diagrams and table heads, but nothing measured.
pub fn skeleton(scenes: &[&str]) -> String {
    let scenes: String = scenes.iter().map(|name| scene(name, &[], &[], Vec::new())).collect();
    page("", &[], &[], &scenes, &[])
}

fn page(machine: &str, found: &[WorkPrecision], paces: &[(&str, f64)], scenes: &str, costs: &[CaseCost]) -> String {
    let rows = found.iter().flat_map(|found| {
        let presets = Preset::ALL.into_iter();
        presets.filter_map(|preset| Some(preset_row(found, found.preset(preset)?, preset)))
    });
    fill(
        include_str!("page.md"),
        &[
            ("machine", machine.to_owned()),
            (
                "choices",
                markdown(
                    "Preset | Setting | Limit of peak errors | Chosen by this run",
                    Preset::ALL.map(|preset| choice_row(found, preset)),
                ),
            ),
            (
                "presets",
                markdown(
                    "Scene | Preset | Ratio, impacts | Peak error | Position error (m) | Energy error | Ratio, settled | Force error | Held",
                    rows,
                ),
            ),
            ("paces", markdown("Scene | Speed | Keeps up", paces.iter().map(|(scene, pace)| pace_row(scene, *pace)))),
            ("scenes", scenes.to_owned()),
            ("costs", markdown("Scene | With | An evaluation | A simulated second", cost_rows(costs))),
        ],
    )
}

/// Section of a scene: its reference, its diagram if it is among those drawn, what was found, and the points that the page names.
fn scene(name: &str, against: &[String], reading: &[String], rows: Vec<Vec<String>>) -> String {
    let list = |lines: &[String]| -> String { lines.iter().map(|l| format!("- {l}\n")).collect() };
    let picture = if DRAWN.contains(&name) {
        format!("![Error against time of every method, {name}]({})\n\n", diagram(name))
    } else {
        String::new()
    };
    format!(
        "## Scene `{name}`\n\n{}\n{picture}{}\n{}\n",
        list(against),
        list(reading),
        markdown(
            "Method | Setting | Ratio, impacts | Peak error | Position error (m) | Energy error | Ratio, settled | Force error | Front",
            rows
        )
    )
}

fn measured_scene(found: &WorkPrecision) -> String {
    let against = reference(&found.reference).into_iter();
    let against: Vec<String> = against.map(|(label, value)| format!("{label}: {value}")).collect();
    let told = found.points.iter().filter(|point| is_told(point));
    let rows = told.map(|point| point_row(found, point)).collect();
    scene(&found.reference.scene().name, &against, &reading(found), rows)
}

/// Whether the preset `real-time` keeps up with a scene.
fn pace_row(scene: &str, pace: f64) -> Vec<String> {
    let keeps = if pace >= 1.0 { "yes" } else { "no" };
    vec![scene.to_owned(), times(Some(pace)), keeps.to_owned()]
}

/// What a preset is, the limit it must keep, and what this run would choose.
fn choice_row(found: &[WorkPrecision], preset: Preset) -> Vec<String> {
    let words = |setting: &Setting| format!("{} {}", setting.method, value(setting));
    let own = found.first().and_then(|found| found.preset(preset));
    let chosen = choose(found, limit(preset));
    vec![
        preset.word().to_owned(),
        own.map_or_else(|| "-".to_owned(), |point| words(&point.setting)),
        format!("{:e}", limit(preset)),
        chosen.map_or_else(|| "nothing".to_owned(), |setting| words(&setting)),
    ]
}

fn preset_row(found: &WorkPrecision, point: &Point, preset: Preset) -> Vec<String> {
    let held = match point.errors.peak {
        Some(error) if error <= limit(preset) => "yes",
        Some(_) => "no",
        None => "-",
    };
    let name = found.reference.scene().name.clone();
    row([name, preset.word().to_owned()], found, point, held)
}

/// Ratios and errors of a point, between its names and a last cell.
fn row(names: [String; 2], found: &WorkPrecision, point: &Point, last: &str) -> Vec<String> {
    let floor = &found.reference.floor;
    let ratio = |phase: &Phase| match end(phase) {
        "" => times(phase.ratio),
        ended => ended.to_owned(),
    };
    let settled = point.settled.as_ref();
    let mut row = names.to_vec();
    row.extend([
        ratio(&point.impacts),
        error(point.errors.peak, floor.peak),
        error(point.errors.position_m, floor.position_m),
        error(point.errors.energy, None),
        settled.map_or_else(|| "-".to_owned(), ratio),
        error(point.errors.settled, floor.settled),
        last.to_owned(),
    ]);
    row
}

/// Points that the page names: on a front, a preset, or the baseline.
fn is_told(point: &Point) -> bool {
    let front = point.impacts.front || point.settled.as_ref().is_some_and(|phase| phase.front);
    front || point.preset.is_some() || is_baseline(point)
}

fn point_row(found: &WorkPrecision, point: &Point) -> Vec<String> {
    let settled = point.settled.as_ref().is_some_and(|phase| phase.front);
    let front = match (point.impacts.front, settled) {
        (true, true) => "i s",
        (true, false) => "i",
        (false, true) => "s",
        (false, false) => "",
    };
    let setting = match point.preset {
        Some(preset) => format!("{} ({})", value(&point.setting), preset.word()),
        None => value(&point.setting),
    };
    let method = point.setting.method.to_string();
    row([method, setting], found, point, front)
}

/// What the numbers show, in words.
fn reading(found: &WorkPrecision) -> Vec<String> {
    let mut told = Vec::new();
    let setting = |point: &Point| format!("`{}` at {}", point.setting.method, value(&point.setting));
    for limit in [0.05, 0.01, 1e-4, 1e-6] {
        let words = match found.fastest_within(limit) {
            Some(point) => format!("{}, ratio {}", setting(point), times(point.impacts.ratio)),
            None => "nothing".to_owned(),
        };
        told.push(format!("Peaks within {limit:e}, fastest: {words}."));
    }
    if let Some(point) = found.fastest_settled_within(0.01) {
        let ratio = point.settled.as_ref().and_then(|phase| phase.ratio);
        told.push(format!("Settled forces within 1e-2, fastest: {}, ratio {}.", setting(point), times(ratio)));
    }
    let stopped = found.points.iter().filter(|point| point.impacts.end.fault().is_some());
    let stopped: Vec<String> = stopped.map(setting).collect();
    if !stopped.is_empty() {
        told.push(format!("Stopped by the divergence guard, or refused: {}.", stopped.join(", ")));
    }
    told
}
