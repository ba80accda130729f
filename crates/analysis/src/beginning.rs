//! The beginning of a run: how hard its balls first touch their sockets.

use jointplay_physics::simulate::{Peak, Simulation};

/// How long is looked at, s.
pub const LENGTH: f64 = 0.05;
/// Evaluations times ball joints after which it is enough.
const MOST_EVALUATIONS: u64 = 2_000_000;

/// Largest contact forces of the beginning of a run.
pub struct Beginning {
    /// Until when, s: [`LENGTH`], or less where that costs too much or the run stops.
    pub until: f64,
    /// Of each ball joint.
    pub peaks: Vec<Peak>,
}

impl Beginning {
    /// Of `simulation`, which is at its start and is run on.
    pub fn of(simulation: &mut Simulation) -> Self {
        let joints = simulation.machine().ball_joints.len().max(1) as u64;
        while simulation.time() < LENGTH && simulation.statistics().evaluations < MOST_EVALUATIONS / joints {
            // Where it stops a run says why.
            if simulation.step_until(LENGTH).is_err() {
                break;
            }
        }
        let mut peaks = Vec::new();
        simulation.take_peaks(&mut peaks);
        Self { until: simulation.time(), peaks }
    }
}
