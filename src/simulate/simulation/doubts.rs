//! What speaks against a result: what the scene asks for, and what the run met.

use super::Simulation;
use crate::contact::settled_penetration;

/// Fewer fixed steps than this do not resolve an impact.
pub(super) const LEAST_STEPS: u64 = 5;
/// Part of a joint's contacts that may be slower than the floor.
const MOST_FLOORED: f64 = 0.5;
/// Contact patch over ball radius beyond which Hertz's theory, which takes the ball for a half-space, is far off.
const LARGEST_PATCH: f64 = 1.0 / 3.0;
/// Constraints that are off by more than this part of the least clearance move what the clearance does.
const DRIFT_OF_CLEARANCE: f64 = 0.1;
/// The same where every ball joint is ideal, m.
const DRIFT: f64 = 1e-4;

impl Simulation {
    /// Why what was computed since the last reset is not to be trusted, a sentence each; empty where nothing speaks
    /// against it. Begins with [`crate::scene::Scene::doubts`] of the scene as it runs.
    pub fn doubts(&self) -> Vec<String> {
        let mut doubts = self.running.doubts();
        let statistics = self.statistics();
        let part = |part: &[u64], j: usize| part[j] as f64 / statistics.impacts[j].max(1) as f64;
        doubts.extend(self.worst(0.0, |j| part(&statistics.coarse, j)).map(|(joints, j)| {
            format!(
                "{joints}: {} of {} contacts lasted fewer than {LEAST_STEPS} steps: their forces are not resolved.",
                statistics.coarse[j], statistics.impacts[j]
            )
        }));
        doubts.extend(self.worst(MOST_FLOORED, |j| part(&statistics.floored, j)).map(|(joints, j)| {
            format!(
                "{joints}: {} of {} contacts began slower than impact_speed_floor or existed at the start: they rebound \
                 higher than asked.",
                statistics.floored[j], statistics.impacts[j]
            )
        }));
        doubts.extend(self.worst(LARGEST_PATCH, |j| self.largest_patch(j)).map(|(joints, j)| {
            format!(
                "{joints}: the contact patch reached {:.2} ball radii: Hertz's theory wants it small.",
                self.largest_patch(j)
            )
        }));
        let clearances = self.running.ball_joints.iter().map(|j| j.contact.clearance);
        let least = clearances.filter(|c| *c > 0.0).reduce(f64::min);
        let drift = statistics.constraint_drift;
        if drift > least.map_or(DRIFT, |c| DRIFT.min(DRIFT_OF_CLEARANCE * c)) {
            doubts.push(format!(
                "formulation lagrange: its constraints were off by {drift:.1e} m; formulation = tree keeps them."
            ));
        }
        doubts
    }

    /// The joint of which `measure` is largest and beyond `limit`, and words for all that are beyond it.
    fn worst(&self, limit: f64, measure: impl Fn(usize) -> f64) -> Option<(String, usize)> {
        let joints = &self.running.ball_joints;
        let beyond = || (0..joints.len()).filter(|&j| measure(j) > limit);
        let worst = beyond().max_by(|&a, &b| measure(a).total_cmp(&measure(b)))?;
        let words = match beyond().count() {
            1 => joints[worst].name.clone(),
            more => format!("{} (and {} more)", joints[worst].name, more - 1),
        };
        Some((words, worst))
    }

    /// Radius of the contact patch at the largest force so far, in ball radii; 0 for an ideal joint.
    fn largest_patch(&self, j: usize) -> f64 {
        if !self.mechanism.contacts.has_clearance(j) {
            return 0.0;
        }
        let c = self.mechanism.contacts.coefficients(j);
        let (radius, clearance) = (c.ball_radius, self.mechanism.contacts.clearance(j));
        let depth = settled_penetration(c.stiffness, self.statistics().peak_normal[j]);
        // Hertz: a^2 = delta R r / (R - r).
        (depth * (radius + clearance) / (clearance * radius)).sqrt()
    }
}
