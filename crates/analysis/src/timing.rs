//! Stepping over a time span under a work cap, timed in pieces.

use std::fmt::Display;

use serde::{Serialize, Serializer};

use super::{AnalysisError, RunContext};
use jointplay_physics::simulate::{Simulation, StartError, Stopped};
use jointplay_scene::Scene;

/// Steps between two checks of the clock, the cap and cancellation.
const STEPS_PER_PIECE: u32 = 32;
/// Least number of timed runs of one setting.
const MIN_RUNS: usize = 3;
/// Largest number of timed runs of one setting.
const MAX_RUNS: usize = 40;
/// Multiple of [`WorkBudget::measured`] after which two runs suffice.
const LONG_MEASUREMENT: f64 = 4.0;

/// Limits on the work of an analysis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkBudget {
    /// Cap on the evaluations of the equations in a run.
    pub evaluations: u64,
    /// Cap on the clock seconds of a run, because evaluations do not include the linear algebra of implicit methods.
    pub seconds: f64,
    /// Total clock seconds to measure for each run, by repeating it.
    pub measured: f64,
    /// Step sizes of the fixed-step methods, s.
    pub steps: &'static [f64],
    /// Tolerances of the adaptive methods.
    pub tolerances: &'static [f64],
    /// Steps per impact of the discrete-gradient method.
    pub steps_per_impact: &'static [f64],
}

impl WorkBudget {
    /// A coarse grid that takes seconds.
    pub const QUICK: Self = Self {
        evaluations: 400_000,
        seconds: 0.5,
        measured: 0.02,
        steps: &[50e-6, 20e-6, 10e-6, 5e-6, 2e-6],
        tolerances: &[1e-3, 1e-4, 1e-6, 1e-8],
        steps_per_impact: &[4.0, 8.0, 16.0],
    };
    /// The whole grid, which takes minutes.
    pub const FULL: Self = Self {
        evaluations: 4_000_000,
        seconds: 2.0,
        measured: 0.1,
        steps: &[1e-3, 500e-6, 200e-6, 100e-6, 50e-6, 20e-6, 10e-6, 5e-6, 2e-6, 1e-6, 0.5e-6],
        tolerances: &[1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11],
        steps_per_impact: &[2.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0, 64.0],
    };
    /// Largest number of loose joints for which the full budget applies.
    const MANY_JOINTS: usize = 8;

    /// Budget for `scene`. Runs with many loose joints are capped earlier, at the same settings.
    #[must_use]
    pub fn of(self, scene: &Scene) -> Self {
        if scene.machine.joints_with_clearance() <= Self::MANY_JOINTS {
            return self;
        }
        Self {
            evaluations: self.evaluations.min(Self::QUICK.evaluations),
            seconds: self.seconds.min(1.5),
            measured: self.measured.min(Self::QUICK.measured),
            ..self
        }
    }

    /// Budget of reference runs, on which all other results depend.
    pub(super) const REFERENCE: Self = Self { evaluations: 40_000_000, seconds: f64::INFINITY, ..Self::FULL };
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum End {
    /// The run reached its end.
    Reached,
    /// The run reached the work cap.
    Capped,
    /// The divergence guard stopped the run.
    #[serde(serialize_with = "as_words")]
    Stopped(Stopped),
    /// The method rejected the scene, for example as too large for its matrices; files list this as stopped, too.
    #[serde(rename = "stopped", serialize_with = "as_words")]
    Refused(StartError),
}

impl End {
    /// Reason why the run was stopped or rejected, if it was.
    pub fn fault(&self) -> Option<&dyn Display> {
        match self {
            Self::Reached | Self::Capped => None,
            Self::Stopped(why) => Some(why),
            Self::Refused(why) => Some(why),
        }
    }
}

fn as_words<S: Serializer>(fault: &impl Display, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(fault)
}

/// Steps `simulation` to exactly `end`; `after_step` is called after every step and returns true to stop.
pub(super) fn advance_capped(
    simulation: &mut Simulation,
    end: f64,
    budget: &WorkBudget,
    context: &mut RunContext,
    mut after_step: impl FnMut(&mut Simulation) -> bool,
) -> Result<End, AnalysisError> {
    run_until_timed(simulation, end, budget, context, &mut Vec::new(), &mut after_step)
}

/// As [`advance_capped`], with timing; `pieces` holds the shortest time of each piece so far, s.
fn run_until_timed(
    simulation: &mut Simulation,
    end: f64,
    budget: &WorkBudget,
    context: &mut RunContext,
    pieces: &mut Vec<f64>,
    after_step: &mut impl FnMut(&mut Simulation) -> bool,
) -> Result<End, AnalysisError> {
    let max_evaluations = simulation.statistics().evaluations + budget.evaluations;
    let deadline = context.now() + budget.seconds;
    for piece in 0.. {
        let before = context.now();
        let outcome = take_steps(simulation, end, after_step);
        let now = context.now();
        match pieces.get_mut(piece) {
            Some(shortest) => *shortest = shortest.min(now - before),
            None => pieces.push(now - before),
        }
        match outcome {
            Ok(true) => return Ok(End::Reached),
            Ok(false) => {}
            Err(stopped) => return Ok(End::Stopped(stopped)),
        }
        context.report_progress(0.0)?;
        if simulation.statistics().evaluations > max_evaluations || now > deadline {
            return Ok(End::Capped);
        }
    }
    unreachable!("the loop over pieces has no end")
}

/// Takes the steps of one piece; returns whether `end` is reached or `after_step` has returned true.
fn take_steps(
    simulation: &mut Simulation,
    end: f64,
    after_step: &mut impl FnMut(&mut Simulation) -> bool,
) -> Result<bool, Stopped> {
    for _ in 0..STEPS_PER_PIECE {
        if simulation.time() >= end {
            return Ok(true);
        }
        simulation.step_until(end)?;
        if after_step(simulation) {
            return Ok(true);
        }
    }
    Ok(simulation.time() >= end)
}

/// Clock seconds to step to `end`: the sum of the shortest times of all pieces, which minimises the effect of other load on the
/// machine. Every run starts from the result of `start`, whose time does not count.
pub(super) fn clock_time_to(
    end: f64,
    budget: &WorkBudget,
    context: &mut RunContext,
    mut start: impl FnMut(&mut RunContext) -> Result<Simulation, AnalysisError>,
) -> Result<f64, AnalysisError> {
    let mut pieces = Vec::new();
    let mut measured = 0.0;
    for run in 0..MAX_RUNS {
        let mut simulation = start(context)?;
        let before = context.now();
        run_until_timed(&mut simulation, end, budget, context, &mut pieces, &mut |_| false)?;
        measured += context.now() - before;
        let is_long = measured >= LONG_MEASUREMENT * budget.measured && run > 0;
        if is_long || (measured >= budget.measured && run + 1 >= MIN_RUNS) {
            break;
        }
    }
    Ok(pieces.iter().sum())
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use jointplay_scene::Scene;

    #[test]
    fn work_is_capped_and_can_be_cancelled() {
        let scene = Scene::load("spcmm", &[]).expect("built in");
        let small = WorkBudget { evaluations: 500, ..WorkBudget::QUICK };
        let mut clock = || 0.0;
        let mut simulation = Simulation::new(&scene.machine).expect("starts");
        let mut progress = |_: f64| ControlFlow::Continue(());
        let mut context = RunContext::new(&mut clock, &mut progress);
        let end = advance_capped(&mut simulation, 1.0, &small, &mut context, |_| false);
        assert_eq!(end, Ok(End::Capped));
        let evaluations = simulation.statistics().evaluations;
        assert!((501..1500).contains(&evaluations), "{evaluations}");

        let mut calls = 0;
        let mut stop = |_: f64| {
            calls += 1;
            if calls > 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let mut context = RunContext::new(&mut clock, &mut stop);
        let end = advance_capped(&mut simulation, 1.0, &WorkBudget::FULL, &mut context, |_| false);
        assert_eq!(end, Err(AnalysisError::Cancelled));
    }

    #[test]
    fn the_time_of_a_run_is_the_sum_of_its_shortest_pieces() {
        let scene = Scene::load("pendulum", &[]).expect("built in");
        // A clock that advances by 1 s per reading, but by 100 s if the reading falls on a busy moment.
        let (mut time, mut reading) = (0.0, 0);
        let mut clock = || {
            reading += 1;
            time += if reading % 17 == 0 { 100.0 } else { 1.0 };
            time
        };
        let mut progress = |_: f64| ControlFlow::Continue(());
        let mut context = RunContext::new(&mut clock, &mut progress);
        let budget = WorkBudget { measured: 1e6, seconds: 1e9, ..WorkBudget::QUICK };
        let mut steps = 0;
        let seconds = clock_time_to(5e-3, &budget, &mut context, |_| {
            let mut simulation = Simulation::new(&scene.machine)?;
            while simulation.step_until(5e-3).is_ok() && simulation.time() < 5e-3 {}
            steps = simulation.statistics().steps;
            Ok(Simulation::new(&scene.machine)?)
        })
        .expect("runs");
        assert_eq!(seconds, (steps as f64 / f64::from(STEPS_PER_PIECE)).ceil());
    }
}
