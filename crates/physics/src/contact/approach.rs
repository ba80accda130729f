//! The approach speed in the damping term, as a function of the contact state and the current rate.
//!
//! With `approach_speed = "largest"` it is the running maximum of the penetration rate. While the rate is at its maximum, the
//! damping term is chi itself; once the rate falls, the maximum stays. A step across this corner is only first-order accurate, so
//! a stepper that locates corners stays on one branch for a whole step.

use serde::{Deserialize, Serialize};

use super::Coefficients;

/// Active branch of the approach-speed rule.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ApproachBranch {
    /// The full rule: for `approach_speed = "start"`, and for steppers that do not locate corners.
    #[default]
    Unfrozen,
    /// The rate is below its maximum so far, which is the approach speed.
    Held,
    /// The rate is the largest so far: the term is chi.
    Rising,
}

impl Coefficients {
    /// Approach speed in the damping term without a contact state, m/s: `rate`, but not below the floor.
    #[inline]
    pub(crate) fn with_floor(&self, rate: f64) -> f64 {
        self.yielded(rate.max(self.speed_floor))
    }

    /// Speed in the damping term for the approach speed `speed`, m/s: lower where the parts yield.
    #[inline]
    pub(crate) fn yielded(&self, speed: f64) -> f64 {
        if speed > self.yield_speed { self.yielding(speed) } else { speed }
    }

    /// Speed in the damping term, m/s, for a stored value `stored` (m/s) and the penetration rate `rate` (m/s).
    #[inline]
    pub(super) fn approach(&self, branch: ApproachBranch, stored: f64, rate: f64) -> f64 {
        match branch {
            ApproachBranch::Unfrozen if self.uses_largest_rate => stored.max(rate),
            ApproachBranch::Unfrozen | ApproachBranch::Held => self.yielded(stored),
            ApproachBranch::Rising => self.with_floor(rate),
        }
    }

    /// Whether that speed is the rate itself, so that the damping term does not depend on it.
    pub(super) fn approach_follows_rate(&self, branch: ApproachBranch, stored: f64, rate: f64) -> bool {
        match branch {
            ApproachBranch::Unfrozen => self.uses_largest_rate && rate > stored,
            ApproachBranch::Held => false,
            ApproachBranch::Rising => rate > self.speed_floor,
        }
    }

    /// Active branch for a stored approach speed `stored` and the penetration rate `rate`, m/s.
    pub(super) fn approach_branch_at(&self, stored: f64, rate: f64) -> ApproachBranch {
        if !self.uses_largest_rate {
            ApproachBranch::Unfrozen
        } else if rate >= stored {
            ApproachBranch::Rising
        } else {
            ApproachBranch::Held
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{ApproachSpeed, Parameters};

    #[test]
    fn branches_equal_the_rule_and_the_damping_term_is_at_most_chi() {
        let parameters = Parameters { approach_speed: ApproachSpeed::Largest, ..Parameters::default() };
        let c = Coefficients::new(&parameters, 3e-4);
        let stored = 0.05;
        for rate in [-0.2, 0.0, 0.01, 0.05, 0.0501, 0.4] {
            let full = c.approach(ApproachBranch::Unfrozen, stored, rate);
            let branch = c.approach_branch_at(stored, rate);
            assert_eq!(c.approach(branch, stored, rate), full, "{rate}");
            assert!(c.damping * rate / full <= c.damping * (1.0 + 1e-15));
            let elastic = c.elastic.stiffness * libm::pow(1e-6, 1.5);
            let force = c.normal_force(1e-6, rate, full);
            assert!(force <= elastic * (1.0 + c.damping) * (1.0 + 1e-12));
        }
        let start = Coefficients::new(&Parameters::default(), 3e-4);
        assert_eq!(start.approach_branch_at(stored, 0.4), ApproachBranch::Unfrozen);
        assert_eq!(start.approach(ApproachBranch::Unfrozen, stored, 0.4), stored);
    }
}
