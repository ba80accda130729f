//! The paper's mechanism: trajectory (59), accompanying motion and slider laws (39), all with exact derivatives.
//!
//! An imaginary square root means that a rod is too short for the trajectory.

use super::MechanismError;
use super::closed_form::{ClosedForm, ClosedMotion};
use crate::jet::Jet;
use crate::machine::{Spcmm, Vec3};
use nalgebra::Matrix3;

/// A trajectory that a rod cannot follow.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "slider {slider}: rod too short at t = {time:.4} s: needs {needs:.digits$} m, has {has:.digits$} m",
    digits = self.digits()
)]
pub struct Unreachable {
    /// 1, 2 or 3.
    pub slider: u8,
    /// Time, s.
    pub time: f64,
    /// Required rod length, m.
    pub needs: f64,
    /// Actual rod length L2, m.
    pub has: f64,
}

impl Unreachable {
    /// Decimals needed to tell the two lengths apart, at least four.
    fn digits(&self) -> usize {
        let missing = libm::log10((self.needs - self.has).max(1e-12));
        (1.0 - missing.floor()).clamp(4.0, 12.0) as usize
    }
}

/// Quantities that depend on the parameters alone.
#[derive(Clone, Copy, Debug)]
pub struct SliderTrajectory {
    p: Spcmm,
    cos_gamma: f64,
    sin_gamma: f64,
    tan_gamma: f64,
    socket_plane: f64,
}

impl SliderTrajectory {
    /// From dimensions and amplitudes.
    pub fn new(parameters: &Spcmm) -> Self {
        let (sin_gamma, cos_gamma) = libm::sincos(parameters.gamma);
        Self {
            p: *parameters,
            cos_gamma,
            sin_gamma,
            tan_gamma: sin_gamma / cos_gamma,
            socket_plane: parameters.slider_plane + parameters.driving_rod,
        }
    }

    /// Period of the drive, s; infinite if nothing moves.
    pub fn period(&self) -> f64 {
        1.0 / self.p.frequency
    }

    /// For each of the three rods, L2^2 minus the squared offset transverse to its slider direction, m^2 (for the third, a
    /// quarter of the discriminant), with intermediate results. Negative if the rod is too short.
    fn evaluate(&self, t: f64) -> ([Jet; 3], Parts) {
        let p = &self.p;
        let omega = std::f64::consts::TAU * p.frequency;
        let phase = Jet::new(omega * t, omega, 0.0).sin_cos().0;
        let x_relative = Jet::constant(p.mean_x - self.socket_plane) + p.amplitude_x * phase;
        let beta = p.amplitude_beta * phase;
        let (sb, cb) = beta.sin_cos();
        let b = p.hinge_radius;

        let y = x_relative * sb * cb.recip();
        let (a_, c_) = (y + b * cb, self.tan_gamma * sb);
        let d_ = -(c_ * y + self.tan_gamma * (x_relative * cb));
        let across = x_relative - b * sb;
        let rod2 = Jet::constant(p.driven_rod * p.driven_rod);
        // (C^2 + 1) f^2 + (2 C D - 2 A) f + A^2 - B + D^2 = 0 with B = L2^2 - across^2: quarter of the discriminant.
        let lead = c_ * c_ + Jet::constant(1.0);
        let half = a_ - c_ * d_;
        let b_ = rod2 - across * across;
        let quarter = half * half - lead * (a_ * a_ - b_ + d_ * d_);

        // w = (cos b sin g, sin b sin g, cos g), third column of R at alpha = 0.
        let (wx, wy, wz) = (self.sin_gamma * cb, self.sin_gamma * sb, self.cos_gamma);
        let (x1, y1) = (x_relative + b * wx, y + b * wy);
        let (x2, y2) = (x_relative - b * wx, y - b * wy);
        let left = [rod2 - x1 * x1 - y1 * y1, rod2 - x2 * x2 - y2 * y2, quarter];
        (left, Parts { x_relative, y, sb, cb, beta, c_, lead, half, wz })
    }
}

impl ClosedForm for SliderTrajectory {
    /// Sliders f1, f2, f3, positive outward. The platform orientation is R = Rx(0) Rz(beta) Ry(gamma) with constant gamma, so
    /// that its angular velocity is the rate of beta about Z. NaN if a rod is too short.
    fn at(&self, t: f64) -> ClosedMotion {
        let (left, parts) = self.evaluate(t);
        let Parts { x_relative, y, sb, cb, beta, c_, lead, half, wz } = parts;
        let f3 = (half + left[2].sqrt()) * lead.recip();
        let z = c_ * (f3 - y) - self.tan_gamma * (x_relative * cb);
        let along = Jet::constant(self.p.hinge_radius * wz);
        let f1 = along + z + left[0].sqrt();
        let f2 = along - z + left[1].sqrt();
        let (cg, sg) = (self.cos_gamma, self.sin_gamma);
        let (s, c) = (sb.value, cb.value);
        ClosedMotion {
            driven: [f1, f2, f3],
            position: [x_relative + Jet::constant(self.socket_plane), y, z],
            rotation: Matrix3::new(c * cg, -s, c * sg, s * cg, c, s * sg, -sg, 0.0, cg),
            angular_velocity: Vec3::new(0.0, 0.0, beta.rate),
            angular_acceleration: Vec3::new(0.0, 0.0, beta.acceleration),
        }
    }

    /// Samples one whole period and reports the rod with the largest shortfall, if any is too short.
    fn check(&self) -> Result<(), MechanismError> {
        const SAMPLES: u32 = 4000;
        let period = if self.p.frequency > 0.0 { self.period() } else { 0.0 };
        let has = self.p.driven_rod;
        let mut worst: Option<Unreachable> = None;
        for n in 0..=SAMPLES {
            let time = period * f64::from(n) / f64::from(SAMPLES);
            let (left, parts) = self.evaluate(time);
            for (i, square) in left.iter().enumerate() {
                if square.value > 0.0 {
                    continue;
                }
                // Slider 3 meets a slanted line: its quarter discriminant is `lead` times the missing square.
                let missing = if i == 2 { square.value / parts.lead.value } else { square.value };
                let needs = (has * has - missing).sqrt();
                if worst.is_none_or(|w| needs > w.needs) {
                    let slider = i as u8 + 1;
                    worst = Some(Unreachable { slider, time, needs, has });
                }
            }
        }
        worst.map_or(Ok(()), |worst| Err(worst.into()))
    }
}

struct Parts {
    x_relative: Jet,
    y: Jet,
    sb: Jet,
    cb: Jet,
    beta: Jet,
    c_: Jet,
    lead: Jet,
    half: Jet,
    wz: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paper() -> Spcmm {
        Spcmm {
            slider_plane: 0.032,
            amplitude_x: 0.025,
            amplitude_beta: 0.025,
            frequency: 0.5,
            mean_x: 0.203,
            gamma: std::f64::consts::PI / 12.0,
            hinge_radius: 0.052,
            driving_rod: 0.028,
            driven_rod: 0.2,
        }
    }

    #[test]
    fn anchors_of_the_contract_hold() {
        let ideal = SliderTrajectory::new(&paper()).at(0.0);
        let expected = [
            (0.1364935480, -0.11575599, -0.13201567),
            (0.2409227735, -0.04964883, -0.0671871),
            (0.1864724056, -0.07282449, -0.08487076),
        ];
        for (f, (value, rate, acceleration)) in ideal.driven.iter().zip(expected) {
            assert!((f.value - value).abs() < 1e-10, "{f:?}");
            assert!((f.rate - rate).abs() < 1e-8, "{f:?}");
            assert!((f.acceleration - acceleration).abs() < 1e-8, "{f:?}");
        }
        // The reference trajectories' first row; 0.143 m tan(pi / 12).
        assert!((ideal.position[2].value + 0.0383167345177).abs() < 1e-12);
        let half = SliderTrajectory::new(&paper()).at(0.5);
        for (f, value) in half.driven.iter().zip([0.0902403840, 0.2210909323, 0.1575618239]) {
            assert!((f.value - value).abs() < 1e-10, "{f:?}");
        }
    }

    #[test]
    fn square_roots_stay_real_in_the_range_the_contract_gives() {
        for (socket_plane, reachable) in [(0.041518, true), (0.041516, false), (0.364482, true), (0.364484, false)] {
            let p = Spcmm { slider_plane: socket_plane - 0.028, ..paper() };
            assert_eq!(SliderTrajectory::new(&p).check().is_ok(), reachable, "x_s = {socket_plane}");
        }
    }

    #[test]
    fn names_the_slider_whose_rod_is_too_short() {
        let p = Spcmm { slider_plane: 0.0, ..paper() };
        let Err(MechanismError::Unreachable(error)) = SliderTrajectory::new(&p).check() else {
            panic!("the rod is long enough");
        };
        assert_eq!(error.slider, 1);
        let near = Unreachable { needs: 0.200_000_3, ..error };
        assert!(near.to_string().ends_with("needs 0.20000030 m, has 0.20000000 m"), "{near}");
        assert!(error.needs > 0.2, "{error}");
    }
}
