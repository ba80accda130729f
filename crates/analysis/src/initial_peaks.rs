//! Largest contact forces in the first instants of a run.

use jointplay_physics::simulate::{Peak, Simulation};

/// Simulated time to examine, s.
pub const LENGTH: f64 = 0.05;

/// Largest contact forces in the first instants of a run.
pub struct InitialPeaks {
    /// End of the examined time, s: [`LENGTH`], or less if the run stops or is cut short.
    pub until: f64,
    /// Whether `may_continue` cut the run short.
    pub is_cut: bool,
    /// Peaks of the joints with play.
    pub peaks: Vec<Peak>,
}

impl InitialPeaks {
    /// Advances `simulation`, which must be at its start, and collects its peaks. `may_continue` is asked between steps: the
    /// cost of a step grows with the scene, and only the caller knows what it may cost.
    pub fn of(simulation: &mut Simulation, mut may_continue: impl FnMut() -> bool) -> Self {
        let mut is_cut = false;
        while simulation.time() < LENGTH && !is_cut {
            // The run itself will report why it stops.
            if simulation.step_until(LENGTH).is_err() {
                break;
            }
            is_cut = simulation.time() < LENGTH && !may_continue();
        }
        let mut peaks = Vec::new();
        simulation.take_peaks(&mut peaks);
        Self { until: simulation.time(), is_cut, peaks }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jointplay_scene::Scene;

    #[test]
    fn a_run_that_may_not_continue_is_cut_short_after_a_step() {
        let scene = Scene::load("pendulum", &[]).expect("built in");
        let mut simulation = Simulation::new(&scene.machine).expect("starts");
        let mut left = 10;
        let cut = InitialPeaks::of(&mut simulation, || {
            left -= 1;
            left > 0
        });
        assert!(cut.is_cut && cut.until == simulation.time() && cut.until < LENGTH);
        assert_eq!(simulation.statistics().steps, 10);
        let mut simulation = Simulation::new(&scene.machine).expect("starts");
        let whole = InitialPeaks::of(&mut simulation, || true);
        assert!(!whole.is_cut && whole.until == LENGTH);
    }
}
