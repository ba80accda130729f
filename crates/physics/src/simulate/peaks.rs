//! Peaks in continuous time: the largest force between two steps, from the cubic through penetration and rate at both ends.

use serde::{Deserialize, Serialize};

use crate::contact::{Coefficients, ContactState};

/// Penetration and its rate at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Approach {
    pub penetration: f64,
    pub rate: f64,
    /// |de/dt|, m/s.
    pub speed: f64,
}

impl Approach {
    /// Whether the ball is exactly at the wall and moving into it.
    pub(super) fn is_arriving(&self) -> bool {
        self.penetration == 0.0 && self.rate > 0.0
    }
}

/// Shortest interval between two instants over the next or the one before, for a parabola through the three: rounding errors of the
/// values decide the slope over a shorter one, such as a step between two events.
const MIN_PART: f64 = 1e-4;

/// A quantity at the latest two instants.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Recent {
    /// (time, value), the older first; a value of 0 means none yet.
    before: [(f64, f64); 2],
}

impl Recent {
    /// Its values at `start` and `end`, if those are the latest two instants.
    pub(super) fn ends(&self, start: f64, end: f64) -> Option<(f64, f64)> {
        let [(t0, f0), (t1, f1)] = self.before;
        (t0 == start && t1 == end && f0 > 0.0).then_some((f0, f1))
    }

    /// Adds the value at a new instant; returns the largest value since the previous one, from the parabola through three.
    pub(super) fn push_and_find_peak(&mut self, time: f64, value: f64) -> f64 {
        let [(t0, f0), (t1, f1)] = self.before;
        self.before = [(t1, f1), (time, value)];
        if f0 <= 0.0 || !(f1 >= f0 && f1 >= value) || t1 <= t0 || time <= t1 {
            return value;
        }
        let (a, b) = (t1 - t0, time - t1);
        if a.min(b) < MIN_PART * a.max(b) {
            return f1;
        }
        let (left, right) = ((f1 - f0) / a, (value - f1) / b);
        let curvature = (right - left) / (a + b);
        if curvature >= 0.0 {
            return f1;
        }
        // Slope at t1 of that parabola, then its vertex.
        let slope = left + curvature * a;
        f1 - slope * slope / (4.0 * curvature)
    }
}

/// Cubic Hermite polynomial of the penetration over one step; over a step so short that its rise is known better from the rates
/// than from the penetrations, the parabola of the rates.
#[derive(Clone, Copy, Debug)]
pub(super) struct PenetrationCubic {
    start: Approach,
    end: Approach,
    /// Change of the penetration over the step, m.
    rise: f64,
    h: f64,
}

impl PenetrationCubic {
    /// The cubic of a step of `h` seconds, for penetrations known to within `rounding`, m. A step between two events may last
    /// 1e-15 s: the difference of its penetrations is then rounding error, and its slope arbitrary.
    pub(super) fn new(start: Approach, end: Approach, h: f64, rounding: f64) -> Self {
        let rise = end.penetration - start.penetration;
        let rise_of_rates = 0.5 * h * (start.rate + end.rate);
        let rise = if (rise - rise_of_rates).abs() > rounding { rise } else { rise_of_rates };
        Self { start, end, rise, h }
    }

    /// Penetration, rate and second derivative at `theta` in 0..=1.
    pub(super) fn at(&self, theta: f64) -> (f64, f64, f64) {
        let p0 = self.start.penetration;
        let (m0, m1) = (self.h * self.start.rate, self.h * self.end.rate);
        // p0 + m0 s + a s^2 + b s^3
        let d = self.rise;
        let (a, b) = (3.0 * d - 2.0 * m0 - m1, m0 + m1 - 2.0 * d);
        let s = theta;
        (
            p0 + s * (m0 + s * (a + s * b)),
            (m0 + s * (2.0 * a + 3.0 * b * s)) / self.h,
            (2.0 * a + 6.0 * b * s) / (self.h * self.h),
        )
    }

    /// Step fraction at which the penetration passes zero, given that it changes sign over the step.
    pub(super) fn crossing(&self) -> f64 {
        let end_sign = self.end.penetration > 0.0;
        let [_, after] = bisect(60, |theta| (self.at(theta).0 > 0.0) != end_sign);
        after
    }

    /// Deepest penetration over the step, m.
    pub(super) fn deepest(&self) -> f64 {
        let ends = self.start.penetration.max(self.end.penetration);
        if !(self.start.rate > 0.0 && self.end.rate < 0.0) {
            return ends;
        }
        let [before, after] = bisect(30, |theta| self.at(theta).1 > 0.0);
        self.at(0.5 * (before + after)).0.max(ends)
    }

    /// Largest penetration rate from `from` to the end of the step, and where: (m/s, theta).
    pub(super) fn fastest(&self, from: f64) -> (f64, f64) {
        let start = if from > 0.0 { self.at(from).1 } else { self.start.rate };
        let ends = if self.end.rate > start { (self.end.rate, 1.0) } else { (start, from) };
        let d = self.rise;
        let (m0, m1) = (self.h * self.start.rate, self.h * self.end.rate);
        let (a, b) = (3.0 * d - 2.0 * m0 - m1, m0 + m1 - 2.0 * d);
        let vertex = -a / (3.0 * b);
        if b < 0.0 && vertex > from && vertex < 1.0 {
            let inside = self.at(vertex).1;
            if inside > ends.0 {
                return (inside, vertex);
            }
        }
        ends
    }

    /// Largest ratio of damping to elastic force from `from` to the end of the step, and where. It grows with the rate.
    pub(super) fn most_damped(&self, c: &Coefficients, contact_state: &ContactState, from: f64) -> (f64, f64) {
        let (rate, theta) = self.fastest(from);
        (c.damping * rate / contact_state.approach(c, rate), theta)
    }

    /// The larger of the normal forces at both ends, and where: (N, theta).
    pub(super) fn stronger_end(&self, c: &Coefficients, contact_state: &ContactState) -> (f64, f64) {
        let force = |at: &Approach| c.normal_force(at.penetration, at.rate, contact_state.approach(c, at.rate));
        let (f0, f1) = (force(&self.start), force(&self.end));
        if f1 >= f0 { (f1, 1.0) } else { (f0, 0.0) }
    }

    /// Upper bound on the normal force over the step of a contact in the state `contact_state`, N. Penetration and rate stay below
    /// the largest of their Bernstein coefficients, and the force grows with both.
    pub(super) fn force_bound(&self, c: &Coefficients, contact_state: &ContactState) -> f64 {
        let (p0, p1) = (self.start.penetration, self.end.penetration);
        let (v0, v1) = (self.start.rate, self.end.rate);
        let third = self.h / 3.0;
        let penetration = p0.max(p1).max(p0 + v0 * third).max(p1 - v1 * third);
        let rate = v0.max(v1).max(self.rise / third - v0 - v1);
        c.normal_force(penetration, rate, contact_state.approach(c, rate))
    }

    /// Largest normal force over the step of a contact in the state `contact_state`, and where: (N, theta).
    pub(super) fn strongest(&self, c: &Coefficients, contact_state: &ContactState) -> (f64, f64) {
        let force = |theta: f64| {
            let (p, v, _) = self.at(theta);
            c.normal_force(p, v, contact_state.approach(c, v))
        };
        // Sign of dF/dt, F = f(p) (1 + chi v / v0), f ~ p^n there: n v (1 + chi v / v0) + p chi a / v0; where v0 is v, the sign of v.
        let slope = |theta: f64| {
            let (p, v, a) = self.at(theta);
            if p <= 0.0 || contact_state.approach_follows_rate(c, v) {
                return v;
            }
            let chi = c.damping / contact_state.approach(c, v);
            c.elastic.exponent(p) * v * (1.0 + chi * v) + p * chi * a
        };
        let (f0, f1) = (force(0.0), force(1.0));
        let ends = if f1 >= f0 { (f1, 1.0) } else { (f0, 0.0) };
        if !(slope(0.0) > 0.0 && slope(1.0) < 0.0) {
            return ends;
        }
        let [before, after] = bisect(30, |theta| slope(theta) > 0.0);
        let theta = 0.5 * (before + after);
        let inside = force(theta);
        if inside > ends.0 { (inside, theta) } else { ends }
    }
}

/// Bounds of the step fraction up to which `is_before` holds, halved `rounds` times.
fn bisect(rounds: u32, is_before: impl Fn(f64) -> bool) -> [f64; 2] {
    let [mut low, mut high] = [0.0, 1.0];
    for _ in 0..rounds {
        let middle = 0.5 * (low + high);
        *if is_before(middle) { &mut low } else { &mut high } = middle;
    }
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{ApproachSpeed, Parameters};

    #[test]
    fn the_peak_of_a_parabola_between_samples_is_found() {
        let f = |t: f64| 7.0 - 3.0 * (t - 0.42) * (t - 0.42);
        let mut recent = Recent::default();
        let peak = [0.1, 0.35, 0.7].map(|t| recent.push_and_find_peak(t, f(t)))[2];
        assert!((peak - 7.0).abs() < 1e-14, "{peak}");
    }

    #[test]
    fn instants_in_quick_succession_make_no_peak_of_rounding_errors() {
        let mut recent = Recent::default();
        let values = [(1.0, 7.0 - 1e-14), (1.0 + 1e-15, 7.0), (1.0 + 1e-3, 6.9)];
        let peak = values.map(|(t, value)| recent.push_and_find_peak(t, value))[2];
        assert_eq!(peak, 7.0);
    }

    #[test]
    fn no_force_within_a_step_exceeds_its_bound() {
        let end = |penetration, rate| Approach { penetration, rate, speed: 0.0 };
        let ends = [end(-1e-6, 0.1), end(2e-6, 0.05), end(3e-6, 0.0), end(2e-6, -0.08), end(-1e-6, -0.1)];
        for approach_speed in ApproachSpeed::ALL {
            let c = Coefficients::new(&Parameters { approach_speed, ..Parameters::default() }, 3e-4);
            let state = ContactState::at_onset(&c, 0.06);
            for (start, end) in ends.iter().flat_map(|start| ends.iter().map(move |end| (*start, *end))) {
                for h in [1e-6, 2e-5, 2e-4] {
                    let cubic = PenetrationCubic::new(start, end, h, 0.0);
                    let bound = cubic.force_bound(&c, &state);
                    for theta in (0..=100).map(|i| 0.01 * f64::from(i)) {
                        let (p, v, _) = cubic.at(theta);
                        let force = c.normal_force(p, v, state.approach(&c, v));
                        assert!(force <= bound * (1.0 + 1e-12), "{approach_speed} {h} {theta}: {force} {bound}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_peak_of_an_impact_between_coarse_samples_is_found() {
        // penetration = a sin(pi t / T): undamped peak at T / 2.
        let c = Coefficients { damping: 0.0, ..Coefficients::new(&Parameters::default(), 3e-4) };
        let (a, t_end) = (4e-6, 1e-4);
        let at = |t: f64| {
            let (s, k) = libm::sincos(std::f64::consts::PI * t / t_end);
            Approach { penetration: a * s, rate: a * std::f64::consts::PI / t_end * k, speed: 0.0 }
        };
        let (start, end) = (0.43e-4, 0.53e-4);
        let (force, theta) =
            PenetrationCubic::new(at(start), at(end), end - start, 0.0).strongest(&c, &ContactState::at_onset(&c, 0.1));
        let exact = c.normal_force(a, 0.0, 0.1);
        // The Hermite interpolation error of the penetration, (pi h / T)^4 / 384 = 2.5e-5, enters the force to the power
        // 1.5.
        assert!((force / exact - 1.0).abs() < 3.8e-5, "{force} {exact}");
        assert!((start + theta * (end - start) - 0.5e-4).abs() < 1e-8);
    }
}
