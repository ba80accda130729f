//! Branches of the friction law between its corners, each continued smoothly beyond them.
//!
//! A step across a corner is only first-order accurate. A stepper that locates corners stays on one branch for a whole step,
//! finds where the sliding speed leaves it, and continues from there on the next.

use serde::{Deserialize, Serialize};

use super::Coefficients;

/// Active branch of the friction law (21).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum FrictionBranch {
    /// The full law, corners included: for steppers that do not locate them.
    #[default]
    Unfrozen,
    /// Below v_a: no friction.
    DeadBand,
    /// Between v_a and v_theta: friction rises with the speed.
    Ramp,
    /// Above v_theta: full friction.
    Full,
    /// Bristles below their limit.
    Sticking,
    /// Bristles at their limit.
    Sliding,
}

impl Coefficients {
    /// Branch at a sliding speed (m/s).
    pub(crate) fn friction_branch_at(&self, speed: f64) -> FrictionBranch {
        if speed >= self.slip_high {
            FrictionBranch::Full
        } else if speed > self.slip_low || self.slip_low == 0.0 {
            FrictionBranch::Ramp
        } else {
            FrictionBranch::DeadBand
        }
    }

    /// Distance of a sliding speed beyond the corners of `branch`, m/s; negative inside.
    pub fn excess_over_branch(&self, branch: FrictionBranch, speed: f64) -> f64 {
        match branch {
            FrictionBranch::Unfrozen | FrictionBranch::Sticking | FrictionBranch::Sliding => f64::NEG_INFINITY,
            FrictionBranch::DeadBand => speed - self.slip_low,
            // Without a dead band the ramp is smooth through zero speed.
            FrictionBranch::Ramp if self.slip_low == 0.0 => speed - self.slip_high,
            FrictionBranch::Ramp => (speed - self.slip_high).max(self.slip_low - speed),
            FrictionBranch::Full => self.slip_high - speed,
        }
    }

    /// Friction force divided by normal force and sliding velocity, s/m, for a branch continued beyond its corners: twice
    /// continuously differentiable, even through zero velocity.
    pub(crate) fn friction_per_speed(&self, branch: FrictionBranch, speed: f64) -> f64 {
        match branch {
            FrictionBranch::Unfrozen => {
                let ratio = self.friction_ratio(speed);
                if ratio > 0.0 { ratio / speed } else { 0.0 }
            }
            FrictionBranch::DeadBand | FrictionBranch::Sticking | FrictionBranch::Sliding => 0.0,
            FrictionBranch::Ramp => {
                let low = self.slip_low;
                let start = if low > 0.0 { low * inverse(speed, low).0 } else { 0.0 };
                self.friction / (self.slip_high - low) * (1.0 - start)
            }
            FrictionBranch::Full => self.friction * inverse(speed, self.slip_high).0,
        }
    }

    /// Derivative of [`Self::friction_per_speed`] with respect to the sliding speed, s^2/m^2.
    pub(crate) fn friction_per_speed_slope(&self, branch: FrictionBranch, speed: f64) -> f64 {
        match branch {
            FrictionBranch::Unfrozen => {
                let (ratio, slope) = (self.friction_ratio(speed), self.friction_slope(speed));
                if speed > 0.0 { (slope - ratio / speed) / speed } else { 0.0 }
            }
            FrictionBranch::DeadBand | FrictionBranch::Sticking | FrictionBranch::Sliding => 0.0,
            FrictionBranch::Ramp => {
                let low = self.slip_low;
                let start = if low > 0.0 { low * inverse(speed, low).1 } else { 0.0 };
                -self.friction / (self.slip_high - low) * start
            }
            FrictionBranch::Full => self.friction * inverse(speed, self.slip_high).1,
        }
    }
}

/// 1 / speed and its derivative; below half the `corner`, the polynomial in the squared speed that joins it with two
/// continuous derivatives.
fn inverse(speed: f64, corner: f64) -> (f64, f64) {
    let join = 0.5 * corner;
    if speed >= join {
        return (1.0 / speed, -1.0 / (speed * speed));
    }
    let x = speed / join;
    let u = x * x;
    ((1.875 - 1.25 * u + 0.375 * u * u) / join, (-2.5 + 1.5 * u) * x / (join * join))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Parameters;

    fn coefficients() -> Coefficients {
        Coefficients::new(&Parameters::default(), 3e-4)
    }

    #[test]
    fn branches_equal_the_law_between_their_corners_and_meet_there() {
        let c = coefficients();
        for speed in [1e-7, 1e-6, 2e-6, 5e-5, 9.99e-5, 1e-4, 3e-4, 1.0] {
            let branch = c.friction_branch_at(speed);
            let got = c.friction_per_speed(branch, speed) * speed;
            let want = c.friction_ratio(speed);
            assert!((got - want).abs() < 1e-15, "{speed}: {got} {want}");
            assert!(c.excess_over_branch(branch, speed) <= 0.0, "{speed}");
        }
        for (below, above, corner) in [
            (FrictionBranch::DeadBand, FrictionBranch::Ramp, c.slip_low),
            (FrictionBranch::Ramp, FrictionBranch::Full, c.slip_high),
        ] {
            let force = |branch| c.friction_per_speed(branch, corner) * corner;
            assert!((force(below) - force(above)).abs() < 1e-15);
            assert!(
                c.excess_over_branch(below, 1.01 * corner) > 0.0 && c.excess_over_branch(above, 0.99 * corner) > 0.0
            );
        }
    }

    #[test]
    fn slopes_of_continued_branches_match_differences() {
        let c = coefficients();
        for branch in [FrictionBranch::Ramp, FrictionBranch::Full] {
            for n in 1..400 {
                let speed = f64::from(n) * 0.5e-6;
                let d = 1e-4 * speed;
                let difference =
                    (c.friction_per_speed(branch, speed + d) - c.friction_per_speed(branch, speed - d)) / (2.0 * d);
                let slope = c.friction_per_speed_slope(branch, speed);
                assert!(
                    (slope - difference).abs() <= 1e-3 * slope.abs() + 1.0,
                    "{branch:?} {speed}: {slope} {difference}"
                );
            }
        }
    }

    #[test]
    fn without_a_dead_band_the_ramp_includes_zero_speed() {
        let c = Coefficients { slip_low: 0.0, ..coefficients() };
        assert_eq!(c.friction_branch_at(0.0), FrictionBranch::Ramp);
        assert!(c.excess_over_branch(FrictionBranch::Ramp, 0.0) < 0.0);
        assert!(c.friction_per_speed(FrictionBranch::Ramp, 0.0).is_finite());
    }
}
