//! Stepping over a time span under a cap on its counted cost.

use std::fmt::Display;

use super::{AnalysisError, RunContext};
use jointplay_physics::simulate::{Simulation, StartError, Stopped};

/// Steps between two checks of the cap and of cancellation.
const STEPS_PER_PIECE: u32 = 32;

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// The run reached its end.
    Reached,
    /// The run reached the cap on its cost.
    Capped,
    /// The divergence guard stopped the run.
    Stopped(Stopped),
    /// The method rejected the scene, for example as too large for its matrices.
    Refused(StartError),
}

impl End {
    /// The word for it in files.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Reached => "reached",
            Self::Capped => "capped",
            Self::Stopped(_) | Self::Refused(_) => "stopped",
        }
    }

    /// Reason why the run was stopped or rejected, if it was.
    pub fn fault(&self) -> Option<&dyn Display> {
        match self {
            Self::Reached | Self::Capped => None,
            Self::Stopped(why) => Some(why),
            Self::Refused(why) => Some(why),
        }
    }
}

/// Steps `simulation` to exactly `end`, unless that costs more than `max_cost`; `after_step` is called after every step and
/// returns true to stop.
pub(super) fn advance_capped(
    simulation: &mut Simulation,
    end: f64,
    max_cost: f64,
    context: &mut RunContext,
    mut after_step: impl FnMut(&mut Simulation) -> bool,
) -> Result<End, AnalysisError> {
    let max_cost = simulation.counted_cost() + max_cost;
    let begin = simulation.time();
    while simulation.counted_cost() <= max_cost {
        for _ in 0..STEPS_PER_PIECE {
            if simulation.time() >= end {
                return Ok(End::Reached);
            }
            if let Err(stopped) = simulation.step_until(end) {
                return Ok(End::Stopped(stopped));
            }
            if after_step(simulation) {
                return Ok(End::Reached);
            }
        }
        context.report_progress((simulation.time() - begin) / (end - begin))?;
    }
    Ok(End::Capped)
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use jointplay_scene::Scene;

    #[test]
    fn the_cost_of_a_run_is_capped_and_it_can_be_cancelled() {
        let scene = Scene::load("spcmm", &[]).expect("built in");
        let mut clock = || 0.0;
        let mut simulation = Simulation::new(&scene.machine).expect("starts");
        let mut progress = |_: f64| ControlFlow::Continue(());
        let mut context = RunContext::new(&mut clock, &mut progress);
        let end = advance_capped(&mut simulation, 1.0, 1000.0, &mut context, |_| false);
        assert_eq!(end, Ok(End::Capped));
        let cost = simulation.counted_cost();
        // At most one piece too much, of 32 steps of some 20 evaluations.
        assert!((1000.0..2500.0).contains(&cost), "{cost}");
        let mut calls = 0;
        let mut stop = |_: f64| {
            calls += 1;
            if calls > 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let mut context = RunContext::new(&mut clock, &mut stop);
        let end = advance_capped(&mut simulation, 1.0, f64::INFINITY, &mut context, |_| false);
        assert_eq!(end, Err(AnalysisError::Cancelled));
    }
}
