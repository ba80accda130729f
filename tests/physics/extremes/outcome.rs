//! One cell of the table: a run, and how it ends.

use jointplay::simulate::{Frame, Pacer, Simulation};

use super::rows::Row;
use crate::common::frame_now;
use crate::common::invariants::{finite, violation};

/// What is asked for: simulated seconds a second, in frames of so many seconds, of a machine that does so many evaluations
/// of the equations a second. Work is counted, not timed, so that a busy machine fails nothing.
const ASKED: f64 = 0.1;
const FRAME: f64 = 1.0 / 60.0;
const EVALUATIONS_PER_SECOND: f64 = 50_000.0;
/// Frames, of those that the run should take, after which a slow run has done enough.
const PATIENCE: f64 = 1.5;
/// Evaluations that no single step may take.
const MOST_IN_A_STEP: u64 = 2000;
/// Energy that a passive scene may gain, of that exchanged: a method of order 1 with ten steps in an impact, and the others.
const CREATED: [f64; 2] = [0.06, 0.02];

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// To the end, with every invariant.
    Ran,
    /// With every invariant, and slower than asked: the pacer, from which the window has it, says so.
    Slow,
    /// Marked by the program as not to be trusted: why.
    Doubtful(String),
    /// By the divergence guard, which says why; the last good state is kept.
    Stopped(String),
    /// Before it began, with a reason.
    Refused(String),
    /// What must not be.
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

/// Energy of a run that nothing drives.
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

    /// What part of the energy exchanged came from nowhere.
    fn gain(&self) -> f64 {
        self.created / self.exchanged.max(1e-12)
    }
}

/// Runs one cell of the table as the window would: frame by frame, behind its pacer.
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
    if let Some(what) = violation(&frame, &scene.machine, form) {
        return Outcome::Wrong(format!("{what}, at the start"));
    }
    let mut balance = Balance::new(&frame);
    // The other form has all bodies' coordinates: an evaluation costs more.
    let rate = EVALUATIONS_PER_SECOND * if form == "tree" { 1.0 } else { 0.5 };
    let expected = (row.duration / (ASKED * FRAME)).ceil();
    let mut pacer = Pacer::default();
    pacer.set_scale(ASKED);
    let (mut frames, mut said_slow, mut steps) = (0.0, false, 0_u64);
    while simulation.time() < row.duration && frames < PATIENCE * expected {
        let target = pacer.begin(FRAME);
        let mut spent = 0.0;
        while simulation.time() < target.min(row.duration) && pacer.may_step(spent) {
            let before = simulation.statistics().evaluations;
            if let Err(stopped) = simulation.step_until(row.duration) {
                let hash = simulation.state_hash();
                frame = frame_now(&mut simulation);
                if let Some(what) = violation(&frame, &scene.machine, form) {
                    return Outcome::Wrong(format!("stopped ({}) too late: {what}", stopped.fault));
                }
                if stopped.time != simulation.time() || simulation.state_hash() != hash {
                    return Outcome::Wrong("stopped, but not at the last good state".to_owned());
                }
                return Outcome::Stopped(stopped.to_string());
            }
            let evaluations = simulation.statistics().evaluations - before;
            if evaluations > MOST_IN_A_STEP {
                return Outcome::Wrong(format!("a step took {evaluations} evaluations"));
            }
            steps += 1;
            // A step of a scene that is a function of time alone evaluates outside the stepper.
            spent += evaluations.max(1) as f64 / rate;
            if steps < 200 || steps.is_multiple_of(16) || simulation.time() >= row.duration {
                let middle = 0.5 * (simulation.step_start() + simulation.time());
                simulation.sample(middle, &mut frame);
                if !finite(&frame) {
                    return Outcome::Wrong(format!("not finite inside a step, t = {middle:e} s"));
                }
                frame = frame_now(&mut simulation);
                if let Some(what) = violation(&frame, &scene.machine, form) {
                    return Outcome::Wrong(what);
                }
                balance.watch(&frame);
            }
        }
        let target = target.min(row.duration);
        pacer.end(FRAME, target, simulation.time(), spent);
        let reached = pacer.reached_scale();
        said_slow |= reached.is_some_and(|reached| reached < (1.0 - 1e-6) * ASKED);
        frames += 1.0;
    }
    let doubts = simulation.doubts();
    let mut doubts: Vec<String> = doubts.iter().map(ToString::to_string).collect();
    let euler = scene.machine.solver.method == jointplay::integrate::Method::SemiImplicitEuler;
    if row.passive && balance.gain() > CREATED[usize::from(!euler)] {
        let what = format!("{:.3} of the energy created", balance.gain());
        if doubts.is_empty() {
            return Outcome::Wrong(what);
        }
        doubts.push(what);
    }
    let late = simulation.time() < row.duration || frames > expected + 1.0;
    if late && !said_slow {
        return Outcome::Wrong("slower than asked, and does not say so".to_owned());
    }
    if !doubts.is_empty() {
        Outcome::Doubtful(doubts.join(" "))
    } else if late {
        Outcome::Slow
    } else {
        Outcome::Ran
    }
}
