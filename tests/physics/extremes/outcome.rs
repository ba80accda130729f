//! One cell of the table: a run and its outcome.

use jointplay_physics::simulate::{Frame, Simulation};

use super::pace::Pacer;
use super::rows::Row;
use crate::common::frame_now;
use crate::common::invariants::{finite, violation};

/// Requested time scale. Work is counted, not timed, so that a busy computer does not fail the test.
const REQUESTED_SCALE: f64 = 0.1;
/// Duration of a frame, s.
const FRAME: f64 = 1.0 / 60.0;
/// Speed of the assumed computer.
const EVALUATIONS_PER_SECOND: f64 = 50_000.0;
/// Multiple of the expected number of frames after which a slow run is ended.
const FRAME_LIMIT: f64 = 1.5;
/// Limit of evaluations in a single step.
const MAX_STEP_EVALUATIONS: u64 = 2000;
/// Allowed gain of energy of a passive scene, relative to that exchanged.
const ALLOWED_GAIN: f64 = 0.02;

/// Words of the outcomes that are not wrong.
pub const WORDS: [&str; 5] = ["runs", "slow", "doubtful", "stopped", "refused"];

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// The run reached its end and satisfies every invariant.
    Ran,
    /// The same, but slower than requested, as reported by the pacer.
    Slow,
    /// The program raised doubts about the result, one per line.
    Doubtful(String),
    /// The divergence guard stopped the run at its last good state.
    Stopped(String),
    /// The run was refused at the start.
    Refused(String),
    /// A wrong behaviour.
    Wrong(String),
}

impl Outcome {
    pub fn word(&self) -> &'static str {
        match self {
            Self::Ran => "runs",
            Self::Slow => "slow",
            Self::Doubtful(_) => "doubtful",
            Self::Stopped(_) => "stopped",
            Self::Refused(_) => "refused",
            Self::Wrong(_) => "WRONG",
        }
    }

    pub fn reason(&self) -> &str {
        match self {
            Self::Stopped(why) | Self::Doubtful(why) | Self::Refused(why) | Self::Wrong(why) => why,
            _ => "",
        }
    }
}

/// Energy of a run without drives.
struct Balance {
    start: f64,
    created: f64,
    exchanged: f64,
}

impl Balance {
    fn new(frame: &Frame) -> Self {
        Self { start: frame.kinetic + frame.potential, created: 0.0, exchanged: frame.kinetic + frame.elastic }
    }

    fn watch(&mut self, frame: &Frame) {
        let created = frame.kinetic + frame.potential - self.start;
        self.created = self.created.max(created);
        self.exchanged = self.exchanged.max(frame.kinetic + frame.elastic);
    }

    /// Energy created, relative to the energy exchanged.
    fn gain(&self) -> f64 {
        self.created / self.exchanged.max(1e-12)
    }
}

/// Runs one cell of the table as the window would, frame by frame with a pacer.
pub fn run(row: &Row, form: &str, column: &str) -> Outcome {
    let scene = match row.load(form, column) {
        Ok(scene) => scene,
        Err(reason) => return Outcome::Refused(reason),
    };
    let mut simulation = match Simulation::new(&scene.machine) {
        Ok(simulation) => simulation,
        Err(error) => return Outcome::Refused(error.to_string()),
    };
    let mut frame = frame_now(&mut simulation);
    if let Some(violation) = violation(&frame, &scene.machine, form) {
        return Outcome::Wrong(format!("{violation}, at the start"));
    }
    let mut balance = Balance::new(&frame);
    // `lagrange` has the coordinates of all bodies, so an evaluation costs more.
    let rate = EVALUATIONS_PER_SECOND * if form == "tree" { 1.0 } else { 0.5 };
    let expected = (row.duration / (REQUESTED_SCALE * FRAME)).ceil();
    let mut pacer = Pacer::default();
    pacer.set_scale(REQUESTED_SCALE);
    let (mut frames, mut reported_slow, mut steps) = (0.0, false, 0_u64);
    while simulation.time() < row.duration && frames < FRAME_LIMIT * expected {
        let target = pacer.begin(FRAME);
        let mut spent = 0.0;
        while simulation.time() < target.min(row.duration) && pacer.may_step(spent) {
            let before = simulation.statistics().evaluations;
            if let Err(stopped) = simulation.step_until(row.duration) {
                let hash = simulation.state_hash();
                frame = frame_now(&mut simulation);
                if let Some(violation) = violation(&frame, &scene.machine, form) {
                    return Outcome::Wrong(format!("stopped ({}) too late: {violation}", stopped.fault));
                }
                if stopped.time != simulation.time() || simulation.state_hash() != hash {
                    return Outcome::Wrong("stopped, but not at the last good state".to_owned());
                }
                return Outcome::Stopped(stopped.to_string());
            }
            let evaluations = simulation.statistics().evaluations - before;
            if evaluations > MAX_STEP_EVALUATIONS {
                return Outcome::Wrong(format!("a step took {evaluations} evaluations"));
            }
            steps += 1;
            // A purely kinematic step evaluates outside the stepper.
            spent += evaluations.max(1) as f64 / rate;
            if steps < 200 || steps.is_multiple_of(16) || simulation.time() >= row.duration {
                let middle = 0.5 * (simulation.step_start() + simulation.time());
                simulation.sample(middle, &mut frame);
                if !finite(&frame) {
                    return Outcome::Wrong(format!("not finite inside a step, t = {middle:e} s"));
                }
                frame = frame_now(&mut simulation);
                if let Some(violation) = violation(&frame, &scene.machine, form) {
                    return Outcome::Wrong(violation);
                }
                balance.watch(&frame);
            }
        }
        let target = target.min(row.duration);
        pacer.end(FRAME, target, simulation.time(), spent);
        let reached = pacer.reached_scale();
        reported_slow |= reached.is_some_and(|reached| reached < (1.0 - 1e-6) * REQUESTED_SCALE);
        frames += 1.0;
    }
    let doubts = simulation.doubts();
    let mut doubts: Vec<String> = doubts.iter().map(ToString::to_string).collect();
    if row.passive && balance.gain() > ALLOWED_GAIN {
        let message = format!("{:.3} of the energy created", balance.gain());
        if doubts.is_empty() {
            return Outcome::Wrong(message);
        }
        doubts.push(message);
    }
    let late = simulation.time() < row.duration || frames > expected + 1.0;
    if late && !reported_slow {
        return Outcome::Wrong("slower than requested without reporting it".to_owned());
    }
    if !doubts.is_empty() {
        Outcome::Doubtful(doubts.join("\n"))
    } else if late {
        Outcome::Slow
    } else {
        Outcome::Ran
    }
}
