//! Angles of the output body, R = Rx(alpha) Rz(beta) Ry(gamma), with their first and second derivatives.

use super::Pose;
use super::frame::BodyMotion;
use crate::machine::{Mat3, Vec3};

/// Closer to beta = +-pi/2 than this (in cos beta), alpha is set to 0 and gamma represents the remaining rotation.
const NEAR_SINGULAR: f64 = 1e-9;

/// (alpha, beta, gamma) of a rotation, rad.
pub fn angles_of(r: &Mat3) -> Vec3 {
    let beta = libm::asin((-r.m12).clamp(-1.0, 1.0));
    if libm::cos(beta) < NEAR_SINGULAR {
        return Vec3::new(0.0, beta, libm::atan2(-r.m31, r.m33));
    }
    Vec3::new(libm::atan2(r.m32, r.m22), beta, libm::atan2(r.m13, r.m11))
}

/// Pose, velocity and acceleration of a body in (x, y, z, alpha, beta, gamma).
pub(super) fn pose_of(body: &BodyMotion) -> Pose {
    let angles = angles_of(&body.rotation);
    let (sa, ca) = libm::sincos(angles.x);
    let (sb, cb) = libm::sincos(angles.y);
    // Axes of the three rotations: x, Rx z, Rx Rz y; omega = alpha' e1 + beta' e2 + gamma' e3.
    let (e1, e2, e3) = (Vec3::x(), Vec3::new(0.0, -sa, ca), Vec3::new(-sb, ca * cb, sa * cb));
    let solve = |w: &Vec3| {
        // e2 is perpendicular to e1 and e3; e1 . e3 = -sin beta.
        let beta = w.dot(&e2);
        if cb < NEAR_SINGULAR {
            return Vec3::new(0.0, beta, w.dot(&e3));
        }
        let (w1, w3) = (w.dot(&e1), w.dot(&e3));
        let alpha = (w1 + sb * w3) / (cb * cb);
        Vec3::new(alpha, beta, w3 + sb * alpha)
    };
    let rates = solve(&body.angular_velocity);
    let e2_rate = e1.cross(&e2) * rates.x;
    let e3_rate = (e1 * rates.x + e2 * rates.y).cross(&e3);
    let accelerations = solve(&(body.angular_acceleration - e2_rate * rates.y - e3_rate * rates.z));
    Pose {
        position: body.position,
        angles,
        velocity: body.velocity,
        angle_rates: rates,
        acceleration: body.acceleration,
        angle_accelerations: accelerations,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    fn rotation(a: &Vec3) -> Mat3 {
        (Rotation3::from_axis_angle(&Vec3::x_axis(), a.x)
            * Rotation3::from_axis_angle(&Vec3::z_axis(), a.y)
            * Rotation3::from_axis_angle(&Vec3::y_axis(), a.z))
        .into_inner()
    }

    #[test]
    fn angles_survive_conversion_to_a_matrix_and_back() {
        for a in [Vec3::new(0.1, -0.4, 0.26), Vec3::new(-3.0, 1.5, 3.1), Vec3::new(0.0, 0.0, 0.0)] {
            assert!((angles_of(&rotation(&a)) - a).norm() < 1e-13, "{a}");
        }
        let at_end = Vec3::new(0.0, std::f64::consts::FRAC_PI_2, 0.7);
        assert!((angles_of(&rotation(&at_end)) - at_end).norm() < 1e-7);
    }

    #[test]
    fn rates_and_accelerations_are_derivatives_of_the_angles() {
        // A body spinning with omega = w + t w1; angles at t = -h, 0, h from integrating R' = [omega]x R accurately enough.
        let (a, w, w1) = (Vec3::new(0.3, -0.5, 0.8), Vec3::new(1.0, -2.0, 0.5), Vec3::new(-0.7, 0.2, 1.1));
        let r = rotation(&a);
        let h = 1e-4;
        let at = |t: f64| {
            let mut r = r;
            let n = 200;
            let dt = t / f64::from(n);
            for i in 0..n {
                let omega = w + w1 * (dt * (f64::from(i) + 0.5));
                r = Rotation3::from_scaled_axis(omega * dt).into_inner() * r;
            }
            angles_of(&r)
        };
        let (before, after) = (at(-h), at(h));
        let pose = pose_of(&BodyMotion {
            rotation: r,
            angular_velocity: w,
            angular_acceleration: w1,
            ..BodyMotion::default()
        });
        assert!((pose.angle_rates - (after - before) / (2.0 * h)).norm() < 1e-6);
        let second = (after - 2.0 * a + before) / (h * h);
        assert!((pose.angle_accelerations - second).norm() < 1e-5);
    }
}
