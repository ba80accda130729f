//! Motion of bodies: from coordinates to poses, velocities and accelerations of the centroids. World axes.

use super::model::{Anchor, BallJoint, Body, Model, Motion};
use super::spcmm::Ideal;
use crate::scene::{Mat3, Quat, Vec3};

/// Motion of a body's centroid frame. The world is one with everything zero.
#[derive(Clone, Copy, Debug)]
pub struct Kinematics {
    /// Body axes as columns.
    pub rotation: Mat3,
    /// Centroid, m.
    pub position: Vec3,
    /// Of the centroid, m/s.
    pub velocity: Vec3,
    /// rad/s.
    pub angular_velocity: Vec3,
    /// Of the centroid, m/s^2.
    pub acceleration: Vec3,
    /// rad/s^2.
    pub angular_acceleration: Vec3,
    /// Joint axis.
    pub axis: Vec3,
    /// Centroid from the joint point, m.
    pub arm: Vec3,
}

impl Kinematics {
    /// At rest at the origin.
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

    /// Velocity of a point fixed to the body at `arm` (world axes) from the centroid.
    #[inline]
    pub fn point_velocity(&self, arm: &Vec3) -> Vec3 {
        self.velocity + self.angular_velocity.cross(arm)
    }

    /// Acceleration of such a point.
    #[inline]
    pub fn point_acceleration(&self, arm: &Vec3) -> Vec3 {
        self.acceleration
            + self.angular_acceleration.cross(arm)
            + self
                .angular_velocity
                .cross(&self.angular_velocity.cross(arm))
    }
}

/// omega = 2 vec(q' q*) for a quaternion of about unit length, rad/s.
pub fn spin_of(q: &[f64], d: &[f64]) -> [f64; 3] {
    let (w, x, y, z) = (q[0], q[1], q[2], q[3]);
    [
        2.0 * (-d[0] * x + d[1] * w - d[2] * z + d[3] * y),
        2.0 * (-d[0] * y + d[1] * z + d[2] * w - d[3] * x),
        2.0 * (-d[0] * z - d[1] * y + d[2] * x + d[3] * w),
    ]
}

impl BallJoint {
    /// Centres of ball and socket from the centroids of their bodies, m.
    #[inline]
    pub fn arms(&self, motion: &[Kinematics]) -> [Vec3; 2] {
        let arm = |anchor: &Anchor| motion[anchor.body].rotation * anchor.offset;
        [arm(&self.ball), arm(&self.socket)]
    }

    /// e and de/dt, m and m/s, of the centres at these arms.
    // Every evaluation needs it for every contact: a call of its own would cost a few per cent.
    #[inline(always)]
    pub fn opening(&self, motion: &[Kinematics], [ball, socket]: &[Vec3; 2]) -> (Vec3, Vec3) {
        let (b, s) = (&motion[self.ball.body], &motion[self.socket.body]);
        (
            (b.position + ball) - (s.position + socket),
            b.point_velocity(ball) - s.point_velocity(socket),
        )
    }

    /// e = Z_j - Z_i, m (5).
    pub fn eccentricity(&self, motion: &[Kinematics]) -> Vec3 {
        self.opening(motion, &self.arms(motion)).0
    }

    /// de/dt, m/s.
    pub fn opening_rate(&self, motion: &[Kinematics]) -> Vec3 {
        self.opening(motion, &self.arms(motion)).1
    }

    /// d2e/dt2, m/s^2.
    pub fn opening_acceleration(&self, motion: &[Kinematics]) -> Vec3 {
        let [ball, socket] = &self.arms(motion);
        motion[self.ball.body].point_acceleration(ball)
            - motion[self.socket.body].point_acceleration(socket)
    }
}

/// Force and torque about a body's centroid.
#[derive(Clone, Copy, Debug)]
pub struct Wrench {
    /// N.
    pub force: Vec3,
    /// N m.
    pub torque: Vec3,
}

impl Wrench {
    /// No load.
    pub fn zero() -> Self {
        Self {
            force: Vec3::zeros(),
            torque: Vec3::zeros(),
        }
    }
}

/// Rotation matrix of a quaternion (w, x, y, z) of any length.
#[inline]
pub fn rotation_of(q: &[f64]) -> Mat3 {
    let (w, x, y, z) = (q[0], q[1], q[2], q[3]);
    let s = 2.0 / (w * w + x * x + y * y + z * z);
    let (xs, ys, zs) = (x * s, y * s, z * s);
    let (wx, wy, wz) = (w * xs, w * ys, w * zs);
    let (xx, xy, xz) = (x * xs, x * ys, x * zs);
    let (yy, yz, zz) = (y * ys, y * zs, z * zs);
    Mat3::new(
        1.0 - (yy + zz),
        xy - wz,
        xz + wy,
        xy + wz,
        1.0 - (xx + zz),
        yz - wx,
        xz - wy,
        yz + wx,
        1.0 - (xx + yy),
    )
}

/// dq/dt = 1/2 omega q for a world angular velocity.
#[inline]
pub fn quaternion_rate(q: &[f64], omega: &[f64], out: &mut [f64]) {
    let (w, x, y, z) = (q[0], q[1], q[2], q[3]);
    let (a, b, c) = (0.5 * omega[0], 0.5 * omega[1], 0.5 * omega[2]);
    out[0] = -a * x - b * y - c * z;
    out[1] = a * w + b * z - c * y;
    out[2] = b * w + c * x - a * z;
    out[3] = c * w + a * y - b * x;
}

/// Turns the quaternion at `q` by the small world rotation vector `turn` and normalises it.
pub fn turn_quaternion(q: &mut [f64], turn: &Vec3) {
    let angle = turn.norm();
    let (s, c) = libm::sincos(0.5 * angle);
    let k = if angle > 1e-9 { s / angle } else { 0.5 };
    let step = nalgebra::Quaternion::new(c, k * turn.x, k * turn.y, k * turn.z);
    let new = step * nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]);
    let norm = new.norm();
    (q[0], q[1], q[2], q[3]) = (new.w / norm, new.i / norm, new.j / norm, new.k / norm);
}

/// Scales the quaternion at `q` to length 1.
#[inline]
pub fn normalise_quaternion(q: &mut [f64]) {
    let s = 1.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]).sqrt();
    for c in &mut q[..4] {
        *c *= s;
    }
}

/// Unit quaternion of a rotation matrix.
pub fn quaternion_of(rotation: &Mat3) -> Quat {
    Quat::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(*rotation))
}

/// Motion of a child body of `parent` for its joint coordinate (q, rate, acceleration).
#[inline]
pub fn follow(
    body: &Body,
    parent: &Kinematics,
    revolute: bool,
    q: f64,
    rate: f64,
    acceleration: f64,
) -> Kinematics {
    let from_parent = parent.rotation * body.from_parent;
    let axis = parent.rotation * body.axis;
    let wp = parent.angular_velocity;
    if revolute {
        let (s, c) = libm::sincos(q);
        let rotation = parent.rotation * (body.fixed + body.cosine * c + body.sine * s);
        let arm = rotation * body.to_centroid;
        let spin = axis * rate;
        let omega = wp + spin;
        let alpha = parent.angular_acceleration + wp.cross(&spin) + axis * acceleration;
        Kinematics {
            rotation,
            position: parent.position + from_parent + arm,
            velocity: parent.velocity + wp.cross(&from_parent) + omega.cross(&arm),
            angular_velocity: omega,
            acceleration: parent.point_acceleration(&from_parent)
                + alpha.cross(&arm)
                + omega.cross(&omega.cross(&arm)),
            angular_acceleration: alpha,
            axis,
            arm,
        }
    } else {
        let rotation = parent.rotation * body.fixed;
        let slide = axis * q;
        let to_centroid = rotation * body.to_centroid;
        let arm = slide + to_centroid;
        let offset = from_parent + arm;
        let velocity = axis * rate;
        Kinematics {
            rotation,
            position: parent.position + offset,
            velocity: parent.point_velocity(&offset) + velocity,
            angular_velocity: wp,
            acceleration: parent.point_acceleration(&offset)
                + 2.0 * wp.cross(&velocity)
                + axis * acceleration,
            angular_acceleration: parent.angular_acceleration,
            axis,
            arm,
        }
    }
}

/// Completes a body's acceleration with its own coordinate's acceleration and its parent's full acceleration.
#[inline]
pub fn accelerate(
    child: &mut Kinematics,
    parent: &Kinematics,
    revolute: bool,
    rate: f64,
    acceleration: f64,
) {
    let offset = child.position - parent.position;
    let wp = parent.angular_velocity;
    if revolute {
        let from_parent = offset - child.arm;
        let omega = child.angular_velocity;
        let alpha = parent.angular_acceleration
            + wp.cross(&(child.axis * rate))
            + child.axis * acceleration;
        child.angular_acceleration = alpha;
        child.acceleration = parent.point_acceleration(&from_parent)
            + alpha.cross(&child.arm)
            + omega.cross(&omega.cross(&child.arm));
    } else {
        child.angular_acceleration = parent.angular_acceleration;
        child.acceleration = parent.point_acceleration(&offset)
            + 2.0 * wp.cross(&(child.axis * rate))
            + child.axis * acceleration;
    }
}

/// Motion prescribed by time alone, computed once per instant.
pub struct Driven {
    time: Option<f64>,
    /// Driven coordinates.
    pub coordinates: Vec<super::jet::Jet>,
    /// The paper's ideal mechanism, where the scene follows it.
    pub ideal: Option<Ideal>,
    bodies: Vec<usize>,
}

impl Driven {
    /// For `model`; nothing is computed yet.
    pub fn new(model: &Model) -> Self {
        Self {
            time: None,
            coordinates: vec![super::jet::Jet::default(); model.drives.len()],
            ideal: None,
            bodies: (0..model.bodies.len())
                .filter(|&b| model.bodies[b].driven_only)
                .collect(),
        }
    }

    /// Stops moving bodies from now on: their motion is part of the state.
    pub fn only_coordinates(&mut self) {
        self.bodies.clear();
    }

    /// Moves the bodies that depend on time alone to `t`.
    #[inline]
    pub fn update(&mut self, model: &Model, t: f64, motion: &mut [Kinematics]) {
        if self.time == Some(t) {
            return;
        }
        self.time = Some(t);
        if let Some(trajectory) = &model.trajectory {
            self.ideal = Some(trajectory.at(t));
        }
        for i in 0..self.coordinates.len() {
            self.coordinates[i] = model.drive(i, t, self.ideal.as_ref());
        }
        for &b in &self.bodies {
            let body = &model.bodies[b];
            let parent = &motion[body.parent];
            motion[b] = match body.motion {
                // A slider on the world moves only along its line.
                Motion::Driven {
                    drive,
                    revolute: false,
                } if body.parent == model.world() => {
                    let q = self.coordinates[drive];
                    let arm = body.axis * q.value + body.fixed * body.to_centroid;
                    Kinematics {
                        rotation: body.fixed,
                        position: body.from_parent + arm,
                        velocity: body.axis * q.rate,
                        acceleration: body.axis * q.acceleration,
                        axis: body.axis,
                        arm,
                        ..Kinematics::rest()
                    }
                }
                Motion::Driven { drive, revolute } => {
                    let q = self.coordinates[drive];
                    follow(body, parent, revolute, q.value, q.rate, q.acceleration)
                }
                _ => follow(body, parent, false, 0.0, 0.0, 0.0),
            };
        }
    }
}
