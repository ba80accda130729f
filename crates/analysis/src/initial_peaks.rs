//! Largest contact forces in the first instants of a run.

use jointplay_physics::simulate::{Peak, Simulation};

/// Simulated time to examine, s.
pub const LENGTH: f64 = 0.05;
/// Work limit: evaluations times ball joints.
const MAX_EVALUATIONS: u64 = 2_000_000;

/// Largest contact forces in the first instants of a run.
pub struct InitialPeaks {
    /// End of the examined time, s: [`LENGTH`], or less if the work limit is reached or the run stops.
    pub until: f64,
    /// Peaks of the ball joints.
    pub peaks: Vec<Peak>,
}

impl InitialPeaks {
    /// Advances `simulation`, which must be at its start, and collects its peaks.
    pub fn of(simulation: &mut Simulation) -> Self {
        let joints = simulation.machine().ball_joints.len().max(1) as u64;
        while simulation.time() < LENGTH && simulation.statistics().evaluations < MAX_EVALUATIONS / joints {
            // The run itself will report why it stops.
            if simulation.step_until(LENGTH).is_err() {
                break;
            }
        }
        let mut peaks = Vec::new();
        simulation.take_peaks(&mut peaks);
        Self { until: simulation.time(), peaks }
    }
}
