//! The page of the documents, its diagrams and the record of the presets, measured on the built-in scenes.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

use super::picture::{is_yardstick, picture};
use super::words::{cost_ratios, end, error, reference, times, value};
use crate::analysis::presets::{Measured, Record, choose, limit};
use crate::analysis::{PartCost, Point, Setting, WorkPrecision};
use crate::cli::{Failure, machine};
use crate::files::{Target, appear};
use crate::scene::{BUILT_IN, Preset};

/// Where its parts lie under the source folder.
const PAGE: &str = "docs/tradeoff.md";
const RECORD: &str = "assets/presets.json";

const TITLE: &str = "# Speed for accuracy";
const METHOD: &str = "## How it is measured";
const PRESETS: &str = "## Presets";
const MODEL: &str = "## What each part of the model costs";
const CHOICE_TABLE: &str = "| Preset | Setting | Limit of peak errors | Chosen by this run |";
const PRESET_TABLE: &str = "| Scene | Preset | Ratio, impacts | Peak error | Position error (m) | Energy error | Ratio, settled | Force error | Held |";
const POINT_TABLE: &str = "| Method | Setting | Ratio, impacts | Peak error | Position error (m) | Energy error | Ratio, settled | Force error | Front |";
const MODEL_TABLE: &str = "| Scene | With | An evaluation | A simulated second |";

/// How ratios are meant.
pub const RATIO_NOTE: &str = "Ratios are speeds over that of Runge-Kutta 4 at 10 us on the same span, measured in the same run";

fn scene_heading(name: &str) -> String {
    format!("## Scene `{name}`")
}

/// Headings and heads of tables of the page, in order: what a test finds in it.
pub fn headings() -> Vec<String> {
    let mut all: Vec<String> = [TITLE, METHOD, PRESETS, CHOICE_TABLE, PRESET_TABLE]
        .map(str::to_owned)
        .to_vec();
    for name in BUILT_IN {
        all.push(scene_heading(name));
        all.push(POINT_TABLE.to_owned());
    }
    all.extend([MODEL, MODEL_TABLE].map(str::to_owned));
    all
}

/// All files, claimed before the measuring begins.
pub(super) struct Targets {
    page: Target,
    record: Target,
    diagrams: Vec<Target>,
}

impl Targets {
    /// # Errors
    /// A folder that is not the program's source, or cannot be written.
    pub(super) fn claim(root: &Path) -> Result<Self, Failure> {
        let claim = |name: &str| Ok::<_, Failure>(Target::claim(&root.join(name), true)?);
        let diagrams = BUILT_IN
            .iter()
            .map(|name| claim(&format!("docs/{}", diagram(name))));
        Ok(Self {
            page: claim(PAGE)?,
            record: claim(RECORD)?,
            diagrams: diagrams.collect::<Result<_, _>>()?,
        })
    }

    /// Writes everything; all texts are made before the first file changes.
    pub(super) fn write(self, found: &[WorkPrecision], costs: &[PartCost]) -> Result<(), Failure> {
        let machine = machine::name();
        let page = page(found, costs, &machine);
        let record = serde_json::to_string_pretty(&record(found, &machine))
            .map_err(|error| Failure::io(error.to_string()))?;
        let mut drawn = Vec::with_capacity(found.len());
        for found in found {
            let svg = picture(found, true, &machine).svg();
            drawn.push(svg.map_err(|error| Failure::io(error.to_string()))?);
        }
        let put = |target: Target, text: &str| target.fill(|file| file.write_all(text.as_bytes()));
        let diagrams = self.diagrams.into_iter().zip(&drawn);
        let mut files = diagrams
            .map(|(target, svg)| put(target, svg))
            .collect::<Result<Vec<_>, _>>()?;
        files.push(put(self.page, &page)?);
        files.push(put(self.record, &format!("{record}\n"))?);
        Ok(appear(files)?)
    }
}

/// File name of a scene's diagram.
fn diagram(name: &str) -> String {
    format!("tradeoff-{name}.svg")
}

fn record(found: &[WorkPrecision], machine: &str) -> Record {
    let mut record = Record {
        machine: machine.to_owned(),
        ..Record::default()
    };
    for found in found {
        let mut measured = BTreeMap::new();
        for preset in Preset::ALL {
            if let Some(point) = found.preset(preset) {
                measured.insert(preset.word().to_owned(), Measured::of(point));
                let setting = (
                    point.setting.method.word().to_owned(),
                    point.setting.value(),
                );
                record.points.insert(preset.word().to_owned(), setting);
            }
        }
        record
            .scenes
            .insert(found.reference.scene().name.clone(), measured);
    }
    record
}

/// The page itself.
fn page(found: &[WorkPrecision], costs: &[PartCost], machine: &str) -> String {
    let mut out = String::new();
    let mut line = |text: &str| {
        out.push_str(text);
        out.push('\n');
    };
    line(TITLE);
    line("");
    line(
        "What every method costs on the built-in scenes and how wrong it is. `jointplay tradeoff --all --write .` measures all of it",
    );
    line(
        "and writes this page with its diagrams, and what the program says about its presets. Other scenes: `jointplay tradeoff SCENE`.",
    );
    line("");
    line(&format!(
        "Measured on: {machine}. {RATIO_NOTE}: other machines come to other speeds, but to much the same ratios."
    ));
    line("");
    line(METHOD);
    line("");
    for text in METHOD_TEXT {
        line(text);
    }
    line("");
    line(PRESETS);
    line("");
    line(
        "A preset is for every scene, so it must hold its limit in each of these: the peak forces of the first impacts err by no more.",
    );
    line(
        "*Chosen by this run*: of the settings that do, the one with the largest product of its ratios, over the impacts and in settled",
    );
    line(
        "motion of every scene. *Held* says whether the preset, as it stands in the program, holds its limit in a scene.",
    );
    line("");
    line(CHOICE_TABLE);
    line(&rule(CHOICE_TABLE));
    for preset in Preset::ALL {
        line(&choice_row(found, preset));
    }
    line("");
    line(PRESET_TABLE);
    line(&rule(PRESET_TABLE));
    for found in found {
        for preset in Preset::ALL {
            if let Some(point) = found.preset(preset) {
                line(&preset_row(found, point, preset));
            }
        }
    }
    for found in found {
        let name = &found.reference.scene().name;
        line("");
        line(&scene_heading(name));
        line("");
        for (label, value) in reference(&found.reference) {
            line(&format!("- {label}: {value}"));
        }
        line("");
        line(&format!(
            "![Error against time of every method, {name}]({})",
            diagram(name)
        ));
        line("");
        for text in reading(found) {
            line(&format!("- {text}"));
        }
        line("");
        line(POINT_TABLE);
        line(&rule(POINT_TABLE));
        for point in found.points.iter().filter(|point| is_told(point)) {
            line(&point_row(found, point));
        }
    }
    line("");
    line(MODEL);
    line("");
    line(
        "Time of one evaluation of the equations with the contacts under load, and of a simulated second with the preset `accurate`",
    );
    line("(`spcmm`: the first 0.4 s; `chain`: the first 10 ms), the first row being 1.");
    line("");
    line(MODEL_TABLE);
    line(&rule(MODEL_TABLE));
    for (cost, (evaluation, second)) in costs.iter().zip(cost_ratios(costs)) {
        let part = &cost.part;
        line(&format!(
            "| {} | {} | {} | {} |",
            part.scene,
            part.label,
            times(Some(evaluation)),
            times(Some(second))
        ));
    }
    out
}

const METHOD_TEXT: [&str; 13] = [
    "Every method runs over its steps or tolerances, twice: over the first impacts, from the start; and over 0.2 s of settled",
    "motion, all from the same state. For after some tens of impacts two good runs have parted, and only statistics can be compared.",
    "",
    "- **Peak error**: the largest relative error among the peak forces of the first six impacts, each within its own span of time",
    "  (half-way to the same joint's contacts before and after). Peaks are those of continuous time.",
    "- **Position error**: of the output body at the instant of the third impact.",
    "- **Energy error**: residual of the energy balance over the first impacts, of the energy exchanged (`docs/numerics.md`).",
    "- **Force error**: the largest relative error among the joints' mean contact forces in settled motion.",
    "- **Front**: nothing else is both faster and more accurate, over the impacts (i) or in settled motion (s).",
    "- Errors are against the same scene at a tolerance at which halving it changes no more than is said with each scene; what is",
    "  smaller than that change reads `<`. A run that reaches the cap on work, or that the divergence guard stops, says so.",
    "- Time is processor time of stepping alone, on one core, of the shortest of repeated runs: nothing else that the machine does",
    "  counts. It repeats to some per cent; a difference smaller than that is none.",
];

fn rule(head: &str) -> String {
    "|---".repeat(head.matches('|').count() - 1) + "|"
}

/// What a preset is, what it is to hold, and what this run would choose.
fn choice_row(found: &[WorkPrecision], preset: Preset) -> String {
    let words = |setting: &Setting| format!("{} {}", setting.method, value(setting));
    let own = found.first().and_then(|found| found.preset(preset));
    let own = own.map_or_else(|| "-".to_owned(), |point| words(&point.setting));
    let chosen = choose(found, limit(preset));
    let chosen = chosen.map_or_else(|| "nothing".to_owned(), |setting| words(&setting));
    format!(
        "| {} | {own} | {:e} | {chosen} |",
        preset.word(),
        limit(preset)
    )
}

fn preset_row(found: &WorkPrecision, point: &Point, preset: Preset) -> String {
    let held = match point.errors.peak {
        Some(error) if error <= limit(preset) => "yes",
        Some(_) => "no",
        None => "-",
    };
    format!(
        "| {} | {} | {} | {held} |",
        found.reference.scene().name,
        preset.word(),
        figures(found, point)
    )
}

/// Ratios and errors of a point as cells.
fn figures(found: &WorkPrecision, point: &Point) -> String {
    let floor = &found.reference.floor;
    let ratio = |ended: &str, ratio| {
        if ended.is_empty() {
            times(ratio)
        } else {
            ended.to_owned()
        }
    };
    let settled = point.settled.as_ref();
    format!(
        "{} | {} | {} | {} | {} | {}",
        ratio(end(&point.impacts), point.impacts.ratio),
        error(point.errors.peak, floor.peak),
        error(point.errors.position_m, floor.position_m),
        error(point.errors.energy, None),
        settled.map_or_else(|| "-".to_owned(), |phase| ratio(end(phase), phase.ratio)),
        error(point.errors.settled, floor.settled),
    )
}

/// Points that the page names: on a front, a preset, or what the others are divided by.
fn is_told(point: &Point) -> bool {
    let front = point.impacts.front || point.settled.as_ref().is_some_and(|phase| phase.front);
    front || point.preset.is_some() || is_yardstick(point)
}

fn point_row(found: &WorkPrecision, point: &Point) -> String {
    let settled = point.settled.as_ref().is_some_and(|phase| phase.front);
    let front = match (point.impacts.front, settled) {
        (true, true) => "i s",
        (true, false) => "i",
        (false, true) => "s",
        (false, false) => "",
    };
    let name = point
        .preset
        .map_or_else(String::new, |preset| format!(" ({})", preset.word()));
    format!(
        "| {} | {}{name} | {} | {front} |",
        point.setting.method,
        value(&point.setting),
        figures(found, point)
    )
}

/// What the numbers say, in words.
fn reading(found: &WorkPrecision) -> Vec<String> {
    let mut told = Vec::new();
    let setting =
        |point: &Point| format!("`{}` at {}", point.setting.method, value(&point.setting));
    for limit in [0.05, 0.01, 1e-4, 1e-6] {
        let words = match found.fastest_within(limit) {
            Some(point) => format!("{}, ratio {}", setting(point), times(point.impacts.ratio)),
            None => "nothing".to_owned(),
        };
        told.push(format!("Peaks within {limit:e}, fastest: {words}."));
    }
    if let Some(point) = found.fastest_settled_within(0.01) {
        let ratio = point.settled.as_ref().and_then(|phase| phase.ratio);
        told.push(format!(
            "Settled forces within 1e-2, fastest: {}, ratio {}.",
            setting(point),
            times(ratio)
        ));
    }
    let stopped = found
        .points
        .iter()
        .filter(|point| end(&point.impacts) == "stopped");
    let stopped: Vec<String> = stopped.map(setting).collect();
    if !stopped.is_empty() {
        told.push(format!(
            "Stopped by the divergence guard, or refused: {}.",
            stopped.join(", ")
        ));
    }
    told
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_has_the_headings_that_it_promises() {
        let text = page(&[], &[], "a machine");
        let mut written = structure(&text);
        let mut promised = headings();
        let scenes: Vec<String> = BUILT_IN.iter().map(|name| scene_heading(name)).collect();
        promised.retain(|head| !scenes.contains(head) && head != POINT_TABLE);
        written.sort();
        promised.sort();
        assert_eq!(written, promised);
        assert_eq!(rule(MODEL_TABLE), "|---|---|---|---|");
    }

    /// Headings and heads of tables of a page.
    fn structure(text: &str) -> Vec<String> {
        let lines: Vec<&str> = text.lines().collect();
        let head = |n: &usize| {
            lines[*n].starts_with('#')
                || lines
                    .get(n + 1)
                    .is_some_and(|next| next.starts_with("|---"))
        };
        (0..lines.len())
            .filter(head)
            .map(|n| lines[n].to_owned())
            .collect()
    }
}
