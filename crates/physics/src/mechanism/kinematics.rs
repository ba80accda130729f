//! Motion of bodies: from coordinates to poses, velocities and accelerations of the centroids. World axes.

use super::closed_form::{ClosedMotion, Values};
use super::model::{Body, BodyIndex, Model, Motion};
use super::path::Path;
use crate::jet::Jet;
use crate::machine::{Mat3, Quat, Vec3};

/// Motion of a body's centroid frame. For the world everything is zero.
#[derive(Clone, Copy, Debug)]
pub struct Kinematics {
    /// Body axes as columns.
    pub rotation: Mat3,
    /// Centroid, m.
    pub position: Vec3,
    /// Velocity of the centroid, m/s.
    pub velocity: Vec3,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vec3,
    /// Acceleration of the centroid, m/s^2.
    pub acceleration: Vec3,
    /// Angular acceleration, rad/s^2.
    pub angular_acceleration: Vec3,
    /// Joint axis.
    pub axis: Vec3,
    /// Centroid from the joint point, m.
    pub arm: Vec3,
}

impl Kinematics {
    /// A body at rest at the origin.
    pub fn rest() -> Self {
        let zero = Vec3::zeros();
        Self {
            rotation: Mat3::identity(),
            position: zero,
            velocity: zero,
            angular_velocity: zero,
            acceleration: zero,
            angular_acceleration: zero,
            axis: zero,
            arm: zero,
        }
    }

    /// Sets pose and velocity of a free body from its coordinates: centroid, quaternion (w, x, y, z); velocity, angular velocity.
    #[inline]
    pub(crate) fn move_freely(&mut self, [x, y, z, turn @ ..]: &[f64; 7], &[vx, vy, vz, wx, wy, wz]: &[f64; 6]) {
        self.rotation = rotation_of(turn);
        self.position = Vec3::new(*x, *y, *z);
        self.velocity = Vec3::new(vx, vy, vz);
        self.angular_velocity = Vec3::new(wx, wy, wz);
    }

    /// Velocity of the body-fixed point at `arm` (world axes) from the centroid, m/s.
    #[inline]
    pub(crate) fn point_velocity(&self, arm: &Vec3) -> Vec3 {
        self.velocity + self.angular_velocity.cross(arm)
    }

    /// Acceleration of that point, m/s^2.
    #[inline]
    pub fn point_acceleration(&self, arm: &Vec3) -> Vec3 {
        self.acceleration
            + self.angular_acceleration.cross(arm)
            + self.angular_velocity.cross(&self.angular_velocity.cross(arm))
    }
}

/// Components `at..at + N` of a state, with a single bounds check.
#[inline(always)]
pub fn part<const N: usize>(of: &[f64], at: usize) -> &[f64; N] {
    let Some(part) = of[at..].first_chunk() else {
        unreachable!("coordinates lie within the state");
    };
    part
}

/// omega = 2 vec(q' q*) for a quaternion of about unit length, rad/s.
pub fn angular_velocity_of(q: &[f64], d: &[f64]) -> [f64; 3] {
    let (w, x, y, z) = (q[0], q[1], q[2], q[3]);
    [
        2.0 * (-d[0] * x + d[1] * w - d[2] * z + d[3] * y),
        2.0 * (-d[0] * y + d[1] * z + d[2] * w - d[3] * x),
        2.0 * (-d[0] * z - d[1] * y + d[2] * x + d[3] * w),
    ]
}

/// Force and torque about a body's centroid.
#[derive(Clone, Copy, Debug)]
pub struct Wrench {
    /// Force, N.
    pub force: Vec3,
    /// Torque, N m.
    pub torque: Vec3,
}

impl Wrench {
    /// No load.
    pub fn zero() -> Self {
        Self { force: Vec3::zeros(), torque: Vec3::zeros() }
    }
}

/// Rotation matrix of a quaternion (w, x, y, z) of any length.
#[inline]
pub fn rotation_of(&[w, x, y, z]: &[f64; 4]) -> Mat3 {
    let s = 2.0 / (w * w + x * x + y * y + z * z);
    let (xs, ys, zs) = (x * s, y * s, z * s);
    let (wx, wy, wz) = (w * xs, w * ys, w * zs);
    let (xx, xy, xz) = (x * xs, x * ys, x * zs);
    let (yy, yz, zz) = (y * ys, y * zs, z * zs);
    Mat3::new(1.0 - (yy + zz), xy - wz, xz + wy, xy + wz, 1.0 - (xx + zz), yz - wx, xz - wy, yz + wx, 1.0 - (xx + yy))
}

/// Position rates of a free body: those of its centroid, and dq/dt = 1/2 omega q for its world angular velocity.
#[inline]
pub fn free_rate(&[.., w, x, y, z]: &[f64; 7], &[vx, vy, vz, wx, wy, wz]: &[f64; 6]) -> [f64; 7] {
    let (a, b, c) = (0.5 * wx, 0.5 * wy, 0.5 * wz);
    [vx, vy, vz, -a * x - b * y - c * z, a * w + b * z - c * y, b * w + c * x - a * z, c * w + a * y - b * x]
}

/// Rotates the quaternion `q` by the small world rotation vector `turn` and normalises it.
pub fn rotate_quaternion(q: &mut [f64], turn: &Vec3) {
    let angle = turn.norm();
    let (s, c) = libm::sincos(0.5 * angle);
    let k = if angle > 1e-9 { s / angle } else { 0.5 };
    let step = nalgebra::Quaternion::new(c, k * turn.x, k * turn.y, k * turn.z);
    let new = step * nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]);
    let norm = new.norm();
    (q[0], q[1], q[2], q[3]) = (new.w / norm, new.i / norm, new.j / norm, new.k / norm);
}

/// Scales the quaternion `q` to length 1.
#[inline]
pub fn normalise_quaternion(q: &mut [f64]) {
    let s = 1.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
    for c in &mut q[..4] {
        *c *= s;
    }
}

/// Angle of a rotation, 0 to pi, rad.
pub(crate) fn angle_of(turn: &Mat3) -> f64 {
    // From sine and cosine: the cosine alone does not resolve small angles.
    let sine = Vec3::new(turn[(2, 1)] - turn[(1, 2)], turn[(0, 2)] - turn[(2, 0)], turn[(1, 0)] - turn[(0, 1)]);
    libm::atan2(sine.norm(), turn.trace() - 1.0)
}

/// Unit quaternion of a rotation matrix.
pub fn quaternion_of(rotation: &Mat3) -> Quat {
    Quat::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(*rotation))
}

/// Sets the motion of body `b` from that of its parent and its joint coordinate `q`, which is an angle if `revolute`.
#[inline]
pub fn move_child(motion: &mut [Kinematics], b: BodyIndex, body: &Body, revolute: bool, q: Jet) {
    let Ok([child, parent]) = motion.get_disjoint_mut([b, body.parent]) else {
        unreachable!("a body hangs from another body or from the world");
    };
    let (q, rate, acceleration) = (q.value, q.rate, q.acceleration);
    let from_parent = parent.rotation * body.from_parent;
    let axis = parent.rotation * body.axis;
    let wp = parent.angular_velocity;
    child.axis = axis;
    if revolute {
        let (s, c) = libm::sincos(q);
        let rotation = parent.rotation * (body.fixed + body.cosine * c + body.sine * s);
        let arm = rotation * body.to_centroid;
        let spin = axis * rate;
        let omega = wp + spin;
        let alpha = parent.angular_acceleration + wp.cross(&spin) + axis * acceleration;
        child.rotation = rotation;
        child.position = parent.position + from_parent + arm;
        child.velocity = parent.velocity + wp.cross(&from_parent) + omega.cross(&arm);
        child.angular_velocity = omega;
        child.acceleration =
            parent.point_acceleration(&from_parent) + alpha.cross(&arm) + omega.cross(&omega.cross(&arm));
        child.angular_acceleration = alpha;
        child.arm = arm;
    } else {
        let rotation = parent.rotation * body.fixed;
        let slide = axis * q;
        let to_centroid = rotation * body.to_centroid;
        let arm = slide + to_centroid;
        let offset = from_parent + arm;
        let velocity = axis * rate;
        child.rotation = rotation;
        child.position = parent.position + offset;
        child.velocity = parent.point_velocity(&offset) + velocity;
        child.angular_velocity = wp;
        child.acceleration = parent.point_acceleration(&offset) + 2.0 * wp.cross(&velocity) + axis * acceleration;
        child.angular_acceleration = parent.angular_acceleration;
        child.arm = arm;
    }
}

/// Completes a body's acceleration from its own joint acceleration and its parent's full acceleration.
#[inline]
pub fn accelerate(child: &mut Kinematics, parent: &Kinematics, revolute: bool, rate: f64, acceleration: f64) {
    let offset = child.position - parent.position;
    let wp = parent.angular_velocity;
    if revolute {
        let from_parent = offset - child.arm;
        let omega = child.angular_velocity;
        let alpha = parent.angular_acceleration + wp.cross(&(child.axis * rate)) + child.axis * acceleration;
        child.angular_acceleration = alpha;
        child.acceleration =
            parent.point_acceleration(&from_parent) + alpha.cross(&child.arm) + omega.cross(&omega.cross(&child.arm));
    } else {
        child.angular_acceleration = parent.angular_acceleration;
        child.acceleration =
            parent.point_acceleration(&offset) + 2.0 * wp.cross(&(child.axis * rate)) + child.axis * acceleration;
    }
}

/// Distance of the probe's tip in `motion`, or of the output body's origin if there is no probe, from that of `ideal`, m.
pub fn distance_from(ideal: &ClosedMotion, model: &Model, motion: &[Kinematics]) -> f64 {
    let (origin, body) = (model.bodies[model.output_body].origin, &motion[model.output_body]);
    let tip = model.probe.unwrap_or(origin);
    let ideal_tip = Vec3::from_fn(|i, _| ideal.position[i].value) + ideal.rotation * (tip - origin);
    (body.position + body.rotation * tip - ideal_tip).norm()
}

/// Motion prescribed by time alone, computed once per instant.
pub struct Driven {
    time: Option<f64>,
    /// Time, coordinates, motion of the bodies and functions at the previous instant, to which the end of a step often returns.
    previous: (Option<f64>, Vec<Jet>, Vec<Kinematics>, Vec<Jet>),
    /// Driven coordinates.
    pub coordinates: Vec<Jet>,
    /// Values of the closed form.
    pub functions: Values,
    /// Bodies that depend on time alone, parents before children.
    bodies: Vec<usize>,
}

impl Driven {
    /// For `model`; nothing is computed yet.
    pub fn new(model: &Model) -> Self {
        let bodies: Vec<usize> = model.order.iter().copied().filter(|&b| model.bodies[b].driven_only).collect();
        let coordinates = vec![Jet::default(); model.drives.len()];
        let functions = Values::new(model);
        Self {
            time: None,
            previous: (None, coordinates.clone(), vec![Kinematics::rest(); bodies.len()], functions.latest.clone()),
            coordinates,
            functions,
            bodies,
        }
    }

    /// Driven coordinate `drive` and its rate at the latest instant.
    pub fn coordinate(&self, drive: usize) -> [f64; 2] {
        let Jet { value, rate, .. } = self.coordinates[drive];
        [value, rate]
    }

    /// Excludes bodies from all further updates, because their motion is part of the state.
    pub fn exclude_bodies(&mut self) {
        self.bodies.clear();
        self.previous.2.clear();
    }

    /// Moves the bodies that depend on time alone to `t`.
    #[inline]
    pub fn update(&mut self, model: &Model, t: f64, motion: &mut [Kinematics]) {
        if self.time == Some(t) {
            return;
        }
        if self.time.is_some() {
            self.exchange(t, motion);
            if self.time == Some(t) {
                return;
            }
        }
        self.time = Some(t);
        self.functions.evaluate(model, t);
        for i in 0..self.coordinates.len() {
            self.coordinates[i] = model.drive(i, t, &self.functions.latest);
        }
        for &b in &self.bodies {
            self.move_body(model, b, motion);
        }
    }

    /// Swaps the latest instant with the previous one if that is `t`; otherwise stores the latest as the previous.
    fn exchange(&mut self, t: f64, motion: &mut [Kinematics]) {
        let (time, coordinates, bodies, functions) = &mut self.previous;
        let is_previous = *time == Some(t);
        std::mem::swap(&mut self.functions.latest, functions);
        std::mem::swap(&mut self.time, time);
        std::mem::swap(&mut self.coordinates, coordinates);
        for (&b, body) in self.bodies.iter().zip(bodies) {
            match is_previous {
                true => std::mem::swap(&mut motion[b], body),
                false => *body = motion[b],
            }
        }
    }

    /// Evaluates the closed form at `times`, s, ahead of the evaluations at these instants.
    pub fn prepare(&mut self, model: &Model, times: &[f64]) {
        self.functions.prepare(model, times);
    }

    /// The same for the bodies on `path` alone.
    pub fn update_along(&mut self, model: &Model, t: f64, path: &Path, motion: &mut [Kinematics]) {
        if self.time == Some(t) || path.drives.is_empty() {
            return;
        }
        // Only some of the coordinates belong to this instant now.
        self.time = None;
        self.functions.evaluate(model, t);
        for &i in &path.drives {
            self.coordinates[i] = model.drive(i, t, &self.functions.latest);
        }
        for &b in &path.driven {
            self.move_body(model, b, motion);
        }
    }

    #[inline]
    fn move_body(&self, model: &Model, b: BodyIndex, motion: &mut [Kinematics]) {
        let body = &model.bodies[b];
        match body.motion {
            // A slider on the world moves along its line only.
            Motion::Driven { drive, revolute: false } if body.parent == model.world() => {
                let q = self.coordinates[drive];
                let arm = body.axis * q.value + body.fixed * body.to_centroid;
                let child = &mut motion[b];
                child.rotation = body.fixed;
                child.position = body.from_parent + arm;
                child.velocity = body.axis * q.rate;
                child.acceleration = body.axis * q.acceleration;
                child.axis = body.axis;
                child.arm = arm;
            }
            Motion::Driven { drive, revolute } => {
                move_child(motion, b, body, revolute, self.coordinates[drive]);
            }
            _ => move_child(motion, b, body, false, Jet::default()),
        }
    }
}
