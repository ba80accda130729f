//! Bushing between two bodies: three linear and three torsional spring-dampers on axes fixed in the first.
//!
//! Let x be the second point relative to the first in those axes, and theta the rotation vector of the second body from its rest
//! orientation in the first. The stored energy is (x' K x + theta' L theta) / 2, from which force and torque follow exactly for
//! rotations up to half a turn. Both forces act at the second point, and the torque is -J^-T L theta, where J maps the rate of
//! theta to the relative angular velocity. About one axis that is -L theta.

use super::{At, Coupling, ElementReport, ForceElement, Loads, TorqueDerivatives, push};
use crate::machine::{self, Mat3, Vec3};
use crate::mechanism::Powers;
use crate::mechanism::kinematics::{Kinematics, quaternion_of};
use crate::mechanism::model::Anchor;

pub(super) struct Bushing {
    bushing: machine::Bushing,
    ends: [Anchor; 2],
    /// Bushing axes as columns, and rest orientation of the second body, both in the axes of the first.
    axes: Mat3,
    rest: Mat3,
}

/// State at one instant, along the bushing axes unless stated otherwise.
struct State {
    /// In world axes.
    axes: Mat3,
    points: [Vec3; 2],
    /// Second point from both centroids, world axes.
    arms: [Vec3; 2],
    /// x, m, and its rate.
    offset: Vec3,
    rate: Vec3,
    /// theta, rad, and relative angular velocity.
    turn: Vec3,
    spin: Vec3,
}

/// Rotation vector of a rotation matrix.
pub(super) fn rotation_vector(rotation: &Mat3) -> Vec3 {
    let q = quaternion_of(rotation);
    let (sign, vector) = (q.w.signum(), q.imag());
    let (sin, cos) = (vector.norm(), q.w.abs());
    let factor = if sin > 1e-9 { 2.0 * libm::atan2(sin, cos) / sin } else { 2.0 };
    vector * (sign * factor)
}

/// J^-T: maps the derivatives of an energy with respect to the components of the rotation vector `turn` to the torque.
fn torque_matrix(turn: &Vec3) -> Mat3 {
    let square = turn.norm_squared();
    // (1 - h cot h) / 4 h^2, where h is half the angle.
    let factor = if square < 1e-3 {
        1.0 / 12.0 + square * (1.0 / 720.0 + square * (1.0 / 30240.0 + square / 1_209_600.0))
    } else {
        let half = 0.5 * square.sqrt();
        (1.0 - half / libm::tan(half)) / square
    };
    let cross = turn.cross_matrix();
    Mat3::identity() + cross * 0.5 + cross * cross * factor
}

impl Bushing {
    pub fn new(bushing: &machine::Bushing, ends: [Anchor; 2]) -> Self {
        let [axes, rest] = [bushing.axes, bushing.rotation].map(|rotation| rotation.to_rotation_matrix().into_inner());
        Self { bushing: *bushing, ends, axes, rest }
    }

    fn state(&self, motion: &[Kinematics]) -> State {
        let [from, to] = &self.ends;
        let (first, second) = (&motion[from.body], &motion[to.body]);
        let axes = first.rotation * self.axes;
        let from = first.position + first.rotation * from.offset;
        let arm = second.rotation * to.offset;
        let to = second.position + arm;
        let arms = [to - first.position, arm];
        let relative = first.rotation.tr_mul(&second.rotation) * self.rest.transpose();
        State {
            axes,
            points: [from, to],
            offset: axes.tr_mul(&(to - from)),
            rate: axes.tr_mul(&(second.point_velocity(&arms[1]) - first.point_velocity(&arms[0]))),
            turn: self.axes.tr_mul(&rotation_vector(&relative)),
            spin: axes.tr_mul(&(second.angular_velocity - first.angular_velocity)),
            arms,
        }
    }

    /// Force on the second point and torque on its body, world axes.
    fn loads(&self, s: &State) -> [Vec3; 2] {
        let force = self.bushing.stiffness.component_mul(&s.offset) + self.bushing.damping.component_mul(&s.rate);
        let torque = torque_matrix(&s.turn) * self.bushing.turning_stiffness.component_mul(&s.turn)
            + self.bushing.turning_damping.component_mul(&s.spin);
        [force, torque].map(|along| s.axes * -along)
    }

    fn ends_in(&self, s: &State, motion: &[Kinematics]) -> [Anchor; 2] {
        let [Anchor { body, .. }, to] = self.ends;
        [Anchor { body, offset: motion[body].rotation.tr_mul(&s.arms[0]) }, to]
    }
}

impl ForceElement for Bushing {
    fn load(&mut self, at: &At<'_>, loads: &mut Loads<'_>) {
        let s = self.state(at.motion);
        let [force, torque] = self.loads(&s);
        let first = &mut loads.wrench[self.ends[0].body];
        push(first, &s.arms[0], &-force);
        first.torque -= torque;
        let second = &mut loads.wrench[self.ends[1].body];
        push(second, &s.arms[1], &force);
        second.torque += torque;
    }

    fn ends(&self, motion: &[Kinematics]) -> Option<[Anchor; 2]> {
        Some(self.ends_in(&self.state(motion), motion))
    }

    fn coupling(&self, at: &At<'_>) -> Option<Coupling> {
        let s = self.state(at.motion);
        let world = |along: Mat3| s.axes * -along * s.axes.transpose();
        let across = |diagonal: &Vec3| world(Mat3::from_diagonal(diagonal));
        let to_torque = torque_matrix(&s.turn);
        let torque_derivatives = TorqueDerivatives {
            by_rotation: world(
                to_torque * Mat3::from_diagonal(&self.bushing.turning_stiffness) * to_torque.transpose(),
            ),
            by_angular_velocity: across(&self.bushing.turning_damping),
            mixed: None,
        };
        let along = [across(&self.bushing.stiffness), across(&self.bushing.damping)];
        let ends = self.ends_in(&s, at.motion);
        Some(Coupling::at_one_point(ends, along, torque_derivatives))
    }

    fn stored(&self, _: f64, motion: &[Kinematics]) -> f64 {
        let s = self.state(motion);
        let twice = |stiffness: &Vec3, x: &Vec3| stiffness.component_mul(x).dot(x);
        0.5 * (twice(&self.bushing.stiffness, &s.offset) + twice(&self.bushing.turning_stiffness, &s.turn))
    }

    fn add_powers(&self, _: f64, motion: &[Kinematics], powers: &mut Powers) {
        let s = self.state(motion);
        powers.damping += self.bushing.damping.component_mul(&s.rate).dot(&s.rate)
            + self.bushing.turning_damping.component_mul(&s.spin).dot(&s.spin);
    }

    fn report(&self, _: f64, motion: &[Kinematics]) -> ElementReport {
        let s = self.state(motion);
        let [force, torque] = self.loads(&s);
        ElementReport { points: s.points, force, torque: Some(torque), ..ElementReport::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    #[test]
    fn rotation_vectors_survive_conversion_to_a_matrix_and_back() {
        for turn in
            [Vec3::new(0.3, -0.2, 0.9), Vec3::new(1e-11, 2e-11, -1e-11), Vec3::new(0.0, -3.1, 0.1), Vec3::zeros()]
        {
            let back = rotation_vector(Rotation3::new(turn).matrix());
            assert!((back - turn).norm() < 1e-14 * (1.0 + turn.norm()), "{back}");
        }
    }

    #[test]
    fn the_torque_is_the_gradient_of_the_energy() {
        let stiffness = Vec3::new(3.0, 7.0, 20.0);
        let energy = |rotation: &Rotation3<f64>| {
            let turn = rotation_vector(rotation.matrix());
            0.5 * stiffness.component_mul(&turn).dot(&turn)
        };
        for turn in [Vec3::new(0.4, -1.1, 0.7), Vec3::new(0.02, 0.01, -0.015), Vec3::new(0.0, 0.0, 2.9)] {
            let at = Rotation3::new(turn);
            let torque = torque_matrix(&turn) * stiffness.component_mul(&turn);
            for i in 0..3 {
                let moved = |by: f64| energy(&(Rotation3::new(Vec3::ith(i, by)) * at));
                let slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                assert!((torque[i] - slope).abs() < 1e-7, "{turn} {i}: {} {slope}", torque[i]);
            }
        }
    }
}
