//! Summary of a run, as text or as JSON.

use std::fmt::Write;
use std::path::Path;

use serde_json::{Map, Value as Json, json};

use super::impacts::Restitution;
use super::peaks::{self, parts};
use super::provenance;
use crate::analysis::assembly::StartReport;
use crate::machine::Preset;
use crate::scene::LiveScene;
use crate::scene::Scene;
use crate::simulate::{Impact, WornWall};
use crate::units::significant;
use crate::words::words;

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// It reached its duration.
    Done,
    /// Ctrl-C.
    Interrupted,
    /// The divergence guard stopped it.
    Diverged,
}

words! { Status { Done => "done", Interrupted => "interrupted", Diverged => "diverged" } }

/// Start and cost of the stepping.
#[derive(Clone, Copy, Debug)]
pub struct Stepping {
    /// Simulated time at which it began, s.
    pub from: f64,
    /// Wall-clock time, s.
    pub wall: f64,
}

impl Stepping {
    /// Simulated seconds per second up to the simulated time `time`; `None` if no time was spent.
    fn ratio(self, time: f64) -> Option<f64> {
        (self.wall > 0.0).then(|| (time - self.from) / self.wall)
    }
}

/// The summary as JSON: provenance, then results; `impacts` if all of them were collected.
pub fn json(
    simulation: &LiveScene,
    status: Status,
    stepping: Stepping,
    impacts: Option<&[Impact]>,
) -> Map<String, Json> {
    let scene = simulation.pending();
    let statistics = simulation.statistics();
    let time = simulation.time();
    let by_joint = |value: &dyn Fn(usize) -> Json| -> Json {
        let entries = scene.machine.loose_joints.iter().enumerate();
        Json::Object(entries.map(|(i, joint)| (joint.name.clone(), value(i))).collect())
    };
    let mut summary = provenance::meta(scene);
    let own = json!({
        "status": status.word(),
        "time_s": time,
        "steps": statistics.steps,
        "evaluations": statistics.evaluations,
        "rejected": statistics.rejected,
        "impacts": by_joint(&|i| json!(statistics.joints[i].impacts)),
        "floored": by_joint(&|i| json!(statistics.joints[i].below_speed_floor)),
        "peak_normal_N": by_joint(&|i| json!(simulation.peak(i).0)),
        "peak_time_s": by_joint(&|i| json!(simulation.peak(i).1)),
        "constraint_drift_m": statistics.constraint_drift,
        "doubts": simulation.doubts().iter().map(ToString::to_string).collect::<Vec<_>>(),
        "wall_s": stepping.wall,
        "ratio": stepping.ratio(time),
        "slower_than_asked": misses_real_time(scene, stepping.ratio(time)),
        "state_hash": hash_text(simulation.state_hash()),
    });
    if let Json::Object(own) = own {
        summary.extend(own);
    }
    peaks::describe(simulation, &mut summary);
    let worn: Map<String, Json> = worn_joints(simulation)
        .map(|Worn { joint, plays, deepest }| {
            let [depths, volumes] = [0, 1].map(|i| plays.iter().map(|play| play[i]).collect::<Vec<_>>());
            let mut own = json!({"depth_m": depths, "volume_m3": volumes});
            if let Some(deepest) = deepest {
                own["deepest_m"] = json!(deepest);
            }
            (joint.to_owned(), own)
        })
        .collect();
    if !worn.is_empty() {
        summary.insert("worn".into(), Json::Object(worn));
    }
    if let Some(ledger) = simulation.ledger() {
        let terms = ledger.terms().map(|(name, value)| (name.to_owned(), json!(value)));
        summary.insert("energy_J".into(), Json::Object(terms.into_iter().collect()));
    }
    if let Some(impacts) = impacts {
        let entry = |i: usize| Restitution::of(impacts, i).json();
        summary.insert("restitution".into(), by_joint(&entry));
    }
    summary
}

/// What has worn off a joint so far.
struct Worn<'a> {
    joint: &'a str,
    /// Of each of its plays, depth, m, and volume, m^3.
    plays: Vec<[f64; 2]>,
    /// Of a joint that wears by direction, the largest depth, m; that of its first play is the mean.
    deepest: Option<f64>,
}

/// Joints that wear.
fn worn_joints(simulation: &LiveScene) -> impl Iterator<Item = Worn<'_>> {
    let (state, joints) = (simulation.state(), &simulation.pending().machine.loose_joints);
    joints.iter().enumerate().filter_map(move |(j, joint)| {
        let contact = &state.conditions().joints[j];
        let (worn, volumes) = (state.worn(j), state.worn_volumes(simulation.machine(), j));
        let plays = (0..2).filter(|&play| contact.clearances()[play] > 0.0).map(|play| [worn[play], volumes[play]]);
        let plays: Vec<_> = plays.collect();
        let walls = state.worn_walls(simulation.machine(), j);
        let deepest = walls.iter().map(WornWall::deepest).reduce(f64::max);
        let wears = contact.wear_coefficient > 0.0 || worn != [0.0; 2];
        (wears && !plays.is_empty()).then_some(Worn { joint: &joint.name, plays, deepest })
    })
}

/// The summary as text; `impacts` if all of them were collected.
pub fn text(simulation: &LiveScene, status: Status, stepping: Stepping, impacts: Option<&[Impact]>) -> String {
    let scene = simulation.pending();
    let statistics = simulation.statistics();
    let time = simulation.time();
    let mut out = String::new();
    let mut line = |label: &str, value: String| {
        // Writing to a String cannot fail.
        let _ = writeln!(out, "{label:<17} {value}");
    };
    line("Scene", scene.name.clone());
    for (key, value) in &scene.changes {
        line("  changed", format!("{key} = {value}"));
    }
    line("Status", status.word().to_owned());
    line("Simulated time", format!("{} s", significant(time, 9)));
    let method = scene.machine.solver.method;
    let formulation = scene.machine.formulation;
    line("Method", format!("{method}, {formulation} formulation"));
    line(
        "Steps",
        format!("{} ({} rejected), {} evaluations", statistics.steps, statistics.rejected, statistics.evaluations),
    );
    for (i, joint) in scene.machine.loose_joints.iter().enumerate() {
        let (force, at) = simulation.peak(i);
        let peak = format!("peak {} N at {} s", significant(force, 6), significant(at, 6));
        let description = if joint.contact.is_ideal() {
            format!("ideal, {peak}")
        } else if force == 0.0 {
            "no contact".to_owned()
        } else {
            let impacts = count(statistics.joints[i].impacts, "impact");
            match statistics.joints[i].below_speed_floor {
                0 => format!("{impacts}, {peak}"),
                // Below the floor the damping term divides by the floor, so these rebound higher than requested.
                slow => format!("{impacts} ({slow} slower than impact_speed_floor), {peak}"),
            }
        };
        line(&format!("Joint {}", joint.name), description);
        let check = impacts.map(|impacts| Restitution::of(impacts, i));
        if let Some(check) = check.filter(|check| check.impacts > 0) {
            let undisturbed = count(check.undisturbed as u64, "undisturbed impact");
            let description = match check.median_excess {
                Some(excess) => format!(
                    "{} {} than requested, median of {undisturbed}",
                    significant(excess.abs(), 3),
                    if excess < 0.0 { "less" } else { "more" }
                ),
                None => undisturbed,
            };
            line("  restitution", description);
        }
    }
    for Worn { joint, plays, deepest } in worn_joints(simulation) {
        // Of the first play, which alone can wear by direction.
        let mut most = deepest.map_or_else(String::new, |deepest| {
            format!(" on average and at most {} um", significant(1e6 * deepest, 6))
        });
        let plays = plays.iter().map(|&[depth, volume]| {
            let most = std::mem::take(&mut most);
            format!("{} um{most}, {} mm^3", significant(1e6 * depth, 6), significant(1e9 * volume, 6))
        });
        line("  worn", format!("{joint}: {}", plays.collect::<Vec<_>>().join("; ")));
    }
    for part in parts(simulation) {
        line(&part.label, part.description());
    }
    if let Some(ledger) = simulation.ledger() {
        let joules = |value: f64| significant(value, 4);
        line(
            "Energy",
            format!(
                "drives {} J, gravity {} J, lost by restitution {} J, by friction {} J",
                joules(ledger.drive_work),
                joules(ledger.gravity_work),
                joules(ledger.restitution_loss),
                joules(ledger.friction_loss)
            ),
        );
        if !scene.machine.elements.is_empty() {
            let (supplied, lost) = (joules(ledger.external_work), joules(ledger.damping_loss));
            let description = format!("loads from outside {supplied} J, lost in dampers {lost} J");
            line("  elements", description);
        }
        line(
            "  residual",
            format!(
                "{} J, {} of the energy exchanged",
                joules(ledger.residual()),
                significant(ledger.relative_residual(), 2)
            ),
        );
    }
    for doubt in simulation.doubts() {
        line("Not trusted", doubt.to_string());
    }
    let ratio = stepping.ratio(time);
    let mut speed = format!("{:.3} s of stepping", stepping.wall);
    if let Some(ratio) = ratio {
        speed += &format!(", {} times real time", significant(ratio, 3));
    }
    if misses_real_time(scene, ratio) {
        speed += ": slower than the preset real-time requires";
    }
    line("Wall time", speed);
    line("State hash", hash_text(simulation.state_hash()));
    line("Version", format!("jointplay {}", crate::VERSION));
    out
}

/// Adds a line to a summary.
pub fn line(text: &mut String, label: &str, words: &str) {
    // Writing to a String cannot fail.
    let _ = writeln!(text, "{label:<17} {words}");
}

/// Adds the report about the start to the summary of a run.
pub fn start(facts: &mut Map<String, Json>, text: &mut String, report: &StartReport) {
    facts.insert("assembly".into(), report.assembly.clone());
    let indeterminate = json!({"reactions": report.reactions, "actuators": report.actuators});
    facts.insert("not_unique".into(), indeterminate);
    let indeterminate = report.indeterminate_forces().map(|words| ("Not unique".to_owned(), words));
    for (label, words) in report.lines.iter().chain(&indeterminate) {
        line(text, label, words);
    }
}

/// Adds a line about a written file to a summary.
pub fn written(text: &mut String, rows: usize, what: &str, path: &Path) {
    let rows = count(rows as u64, what);
    line(text, "Written", &format!("{rows} to {}", path.display()));
}

/// A count with its noun: `1 row`, `2 rows`.
pub fn count(number: u64, what: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{number} {what}{plural}")
}

/// Whether the real-time preset was chosen but not reached.
fn misses_real_time(scene: &Scene, ratio: Option<f64>) -> bool {
    scene.machine.solver.preset == Some(Preset::RealTime) && ratio.is_some_and(|ratio| ratio < 1.0)
}

/// A hash as outputs write it: 16 hexadecimal digits (JSON numbers do not hold 64 bits).
pub fn hash_text(hash: u64) -> String {
    format!("{hash:016x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_preset_real_time_requires_real_time() {
        for (preset, slow) in [("real-time", true), ("accurate", false)] {
            let change = ("solver.preset".to_owned(), preset.to_owned());
            let scene = Scene::load("pendulum", &[change]).unwrap();
            assert_eq!(misses_real_time(&scene, Some(0.9)), slow, "{preset}");
            assert!(!misses_real_time(&scene, Some(1.1)), "{preset}");
            assert!(!misses_real_time(&scene, None), "{preset}");
            let mut simulation = LiveScene::new(&scene).unwrap();
            simulation.advance_to(1e-3).unwrap();
            for (wall, reported) in [(1.0, slow), (1e-9, false)] {
                let stepping = Stepping { from: 0.0, wall };
                let text = text(&simulation, Status::Done, stepping, None);
                assert_eq!(text.contains("slower than"), reported, "{text}");
                let facts = json(&simulation, Status::Done, stepping, None);
                assert_eq!(facts["slower_than_asked"], reported);
            }
        }
    }
}
