//! Independently derived equations of the pendulum.

use std::cell::RefCell;

use crate::integrate::Equations;

/// The pendulum derived from the built-in scene's description alone: it starts at rest in the XZ plane and stays in it.
/// State: x, z of the centroid, angle about +Y, and their rates; the ball is 0.1 m up the rod from the centroid.
#[derive(Default)]
pub struct Pendulum {
    approach: RefCell<Option<f64>>,
}

impl Pendulum {
    const MASS: f64 = 0.384;
    const INERTIA: f64 = 1.92e-3;
    const ARM: f64 = 0.1;
    const RADIUS: f64 = 0.010;
    const CLEARANCE: f64 = 0.3e-3;

    /// Eccentricity e, its rate, n, and the arm from centroid to ball centre.
    fn ball(y: &[f64]) -> ([f64; 2], [f64; 2], [f64; 2], [f64; 2]) {
        let arm = [Self::ARM * y[2].sin(), Self::ARM * y[2].cos()];
        let e = [y[0] + arm[0], y[1] + arm[1]];
        let rate = [y[3] + y[5] * arm[1], y[4] - y[5] * arm[0]];
        let size = e[0].hypot(e[1]);
        let n = if size > 0.0 { [e[0] / size, e[1] / size] } else { [0.0; 2] };
        (e, rate, n, arm)
    }

    fn normal_force(&self, y: &[f64]) -> f64 {
        let Some(approach) = *self.approach.borrow() else {
            return 0.0;
        };
        let (e, rate, n, _) = Self::ball(y);
        let depth = e[0].hypot(e[1]) - Self::CLEARANCE;
        if depth <= 0.0 {
            return 0.0;
        }
        let (young, poisson, restitution) = (206e9, 0.3, 0.9);
        let s = (1.0 - poisson * poisson) / young;
        let socket = Self::RADIUS + Self::CLEARANCE;
        let k = 4.0 / (3.0 * (s + s)) * (socket * Self::RADIUS / Self::CLEARANCE).sqrt();
        let rate_along_normal = n[0] * rate[0] + n[1] * rate[1];
        let damping = 1.0 + 3.0 * (1.0 - restitution * restitution) / 4.0 * rate_along_normal / approach;
        (k * depth.powf(1.5) * damping).max(0.0)
    }
}

impl Equations for Pendulum {
    fn start(&self) -> Vec<f64> {
        let angle = -30.0_f64.to_radians();
        vec![-Self::ARM * angle.sin(), -Self::ARM * angle.cos(), angle, 0.0, 0.0, 0.0]
    }

    fn derivative(&self, _: f64, y: &[f64], dy: &mut [f64]) {
        let (_, rate, n, arm) = Self::ball(y);
        let normal_force = self.normal_force(y);
        // Velocity of the ball's contact point relative to the fixed socket.
        let (angular_velocity, r) = (y[5], Self::RADIUS);
        let slip = [rate[0] + angular_velocity * r * n[1], rate[1] - angular_velocity * r * n[0]];
        let along = slip[0] * n[0] + slip[1] * n[1];
        let slip = [slip[0] - along * n[0], slip[1] - along * n[1]];
        let speed = slip[0].hypot(slip[1]);
        let (low, high) = (1e-6, 1e-4);
        let correction = ((speed - low) / (high - low)).clamp(0.0, 1.0);
        let friction = if speed > 0.0 { -0.15 * correction * normal_force / speed } else { 0.0 };
        let force = [-normal_force * n[0] + friction * slip[0], -normal_force * n[1] + friction * slip[1]];
        let at = [arm[0] + r * n[0], arm[1] + r * n[1]];
        dy[..3].copy_from_slice(&y[3..]);
        dy[3] = force[0] / Self::MASS;
        dy[4] = force[1] / Self::MASS - 9.81;
        dy[5] = (at[1] * force[0] - at[0] * force[1]) / Self::INERTIA;
    }

    fn gaps(&self, _: f64, y: &[f64]) -> Vec<(f64, f64)> {
        let (e, rate, n, _) = Self::ball(y);
        vec![(e[0].hypot(e[1]) - Self::CLEARANCE, n[0] * rate[0] + n[1] * rate[1])]
    }

    fn forces(&self, _: f64, y: &[f64]) -> Vec<f64> {
        vec![self.normal_force(y)]
    }

    fn speed_floor(&self) -> f64 {
        1e-3
    }

    fn set_contacts(&self, contacts: &[Option<f64>]) {
        *self.approach.borrow_mut() = contacts[0];
    }
}
