//! An independent model of the measuring mechanism.

use std::cell::RefCell;

use jointplay::scene::Scene;
use jointplay::simulate::{Frame, Simulation};

use crate::integrate::Equations;

/// An independent model of the measuring mechanism: platform and three rods with full coordinates, hinges by multipliers, sliders by
/// (39) as functions of time, contacts by (19)-(21). State: position, quaternion (w, x, y, z), velocity and angular velocity of
/// platform, rod 1, 2, 3, one body after the other; world axes.
pub struct Machine {
    clearance: f64,
    friction: f64,
    start: Vec<f64>,
    approach: RefCell<Vec<Option<f64>>>,
}

/// One contact: force on the ball, its point of action, delta, its rate, F_N.
struct Contact {
    force: Vec3,
    at: Vec3,
    depth: f64,
    rate: f64,
    normal: f64,
}

/// One body of [`Machine`].
struct BodyState {
    position: Vec3,
    axes: Mat3,
    velocity: Vec3,
    spin: Vec3,
}

type Vec3 = nalgebra::Vector3<f64>;
type Mat3 = nalgebra::Matrix3<f64>;

impl Machine {
    const MASSES: [f64; 4] = [0.490, 0.384, 0.384, 0.384];
    const MOMENTS: [[f64; 3]; 4] = [
        [4.44e-4, 3.31e-4, 1.35e-4],
        [1.58e-5, 1.92e-3, 1.93e-3],
        [1.58e-5, 1.92e-3, 1.93e-3],
        [1.58e-5, 1.93e-3, 1.92e-3],
    ];
    const RADIUS: f64 = 0.010;

    /// Starts in the program's initial state of `scene`.
    pub fn new(clearance: f64, friction: f64, scene: &Scene) -> Self {
        let mut frame = Frame::default();
        Simulation::new(&scene.machine).unwrap().sample(0.0, &mut frame);
        let mut start = Vec::new();
        // Bodies are in the order sliders, platform, rods.
        for body in [3, 4, 5, 6].map(|b| frame.bodies[b]) {
            let turn = nalgebra::Rotation3::from_matrix_unchecked(body.rotation);
            let q = nalgebra::UnitQuaternion::from_rotation_matrix(&turn);
            start.extend(body.position.iter());
            start.extend([q.w, q.i, q.j, q.k]);
            start.extend(body.velocity.iter());
            start.extend(body.angular_velocity.iter());
        }
        Self { clearance, friction, start, approach: RefCell::new(vec![None; 3]) }
    }

    fn bodies(y: &[f64]) -> Vec<BodyState> {
        let body = |s: &[f64]| {
            let q = nalgebra::Quaternion::new(s[3], s[4], s[5], s[6]);
            BodyState {
                position: Vec3::new(s[0], s[1], s[2]),
                axes: *nalgebra::UnitQuaternion::from_quaternion(q).to_rotation_matrix().matrix(),
                velocity: Vec3::new(s[7], s[8], s[9]),
                spin: Vec3::new(s[10], s[11], s[12]),
            }
        };
        y.chunks_exact(13).map(body).collect()
    }

    /// Socket centres at `t`: the inverse kinematics of trajectory (59) with (39) as corrected.
    fn sockets(t: f64) -> [Vec3; 3] {
        let (b, rod, plane) = (0.052, 0.2, 0.060);
        let phase = (std::f64::consts::PI * t).sin();
        let (xr, beta, gamma) = (0.203 + 0.025 * phase - plane, 0.025 * phase, std::f64::consts::PI / 12.0);
        let y = xr * beta.tan();
        let sag = beta.sin() * gamma.tan();
        let level = -(y * sag + xr * beta.cos() * gamma.tan());
        let reach = rod * rod - (xr - b * beta.sin()).powi(2);
        let side = y + b * beta.cos();
        // (C^2 + 1) f^2 + 2 (C D - A) f + A^2 - B + D^2 = 0.
        let (lead, half) = (sag * sag + 1.0, sag * level - side);
        let rest = side * side - reach + level * level;
        let f3 = (-half + (half * half - lead * rest).sqrt()) / lead;
        let z = (f3 - y) * sag - xr * beta.cos() * gamma.tan();
        let w = Vec3::new(beta.cos() * gamma.sin(), beta.sin() * gamma.sin(), gamma.cos());
        let left = |x: f64, y: f64| (rod * rod - x * x - y * y).sqrt();
        let f1 = b * w.z + z + left(xr + b * w.x, y + b * w.y);
        let f2 = b * w.z - z + left(xr - b * w.x, y - b * w.y);
        [Vec3::new(plane, 0.0, f1), Vec3::new(plane, 0.0, -f2), Vec3::new(plane, f3, 0.0)]
    }

    /// Velocities of the socket centres, by central differences of order 8.
    fn socket_rates(t: f64) -> [Vec3; 3] {
        let h = 1e-3;
        let weights = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];
        let mut rates = [Vec3::zeros(); 3];
        for (k, weight) in (1..).zip(weights) {
            let (after, before) = (Self::sockets(t + f64::from(k) * h), Self::sockets(t - f64::from(k) * h));
            for j in 0..3 {
                rates[j] += (after[j] - before[j]) * (weight / h);
            }
        }
        rates
    }

    fn contacts(&self, t: f64, bodies: &[BodyState]) -> Vec<Contact> {
        let (sockets, rates) = (Self::sockets(t), Self::socket_rates(t));
        let approach = self.approach.borrow();
        let (young, poisson, restitution) = (206e9, 0.3, 0.9);
        let s = (1.0 - poisson * poisson) / young;
        let socket = Self::RADIUS + self.clearance;
        let k = 4.0 / (3.0 * (s + s)) * (socket * Self::RADIUS / self.clearance).sqrt();
        let contact_of = |j: usize| {
            let rod = &bodies[j + 1];
            let arm = rod.axes * Vec3::new(-0.1, 0.0, 0.0);
            let e = rod.position + arm - sockets[j];
            let relative_velocity = rod.velocity + rod.spin.cross(&arm) - rates[j];
            let size = e.norm();
            let n = if size > 0.0 { e / size } else { e };
            let (depth, rate) = (size - self.clearance, n.dot(&relative_velocity));
            let mut contact =
                Contact { force: Vec3::zeros(), at: rod.position + arm + n * Self::RADIUS, depth, rate, normal: 0.0 };
            let Some(approach_speed) = approach[j].filter(|_| depth > 0.0) else {
                return contact;
            };
            let damping = 1.0 + 0.75 * (1.0 - restitution * restitution) * rate / approach_speed;
            contact.normal = (k * depth.powf(1.5) * damping).max(0.0);
            let slip = relative_velocity - n * rate;
            let speed = slip.norm();
            let (low, high) = (1e-6, 1e-4);
            let correction = ((speed - low) / (high - low)).clamp(0.0, 1.0);
            contact.force = -n * contact.normal;
            if speed > 0.0 {
                contact.force -= slip * (self.friction * correction * contact.normal / speed);
            }
            contact
        };
        (0..3).map(contact_of).collect()
    }
}

impl Equations for Machine {
    fn start(&self) -> Vec<f64> {
        self.start.clone()
    }

    fn derivative(&self, t: f64, y: &[f64], dy: &mut [f64]) {
        let bodies = Self::bodies(y);
        // Accelerations of the four bodies, then three and two rows for each hinge.
        let mut matrix = nalgebra::DMatrix::<f64>::zeros(39, 39);
        let mut right = nalgebra::DVector::<f64>::zeros(39);
        for (b, body) in bodies.iter().enumerate() {
            let moments = Mat3::from_diagonal(&Vec3::from(Self::MOMENTS[b]));
            let inertia = body.axes * moments * body.axes.transpose();
            for i in 0..3 {
                matrix[(6 * b + i, 6 * b + i)] = Self::MASSES[b];
            }
            matrix.view_mut((6 * b + 3, 6 * b + 3), (3, 3)).copy_from(&inertia);
            right[6 * b] = 9.81 * Self::MASSES[b];
            let gyroscopic = -body.spin.cross(&(inertia * body.spin));
            right.rows_mut(6 * b + 3, 3).copy_from(&gyroscopic);
        }
        for (j, contact) in self.contacts(t, &bodies).iter().enumerate() {
            let b = j + 1;
            let torque = (contact.at - bodies[b].position).cross(&contact.force);
            for i in 0..3 {
                right[6 * b + i] += contact.force[i];
                right[6 * b + 3 + i] += torque[i];
            }
        }
        let platform = &bodies[0];
        let pins = [
            (Vec3::new(0.0, 0.0, 0.052), Vec3::y(), [Vec3::x(), Vec3::z()]),
            (Vec3::new(0.0, 0.0, -0.052), Vec3::y(), [Vec3::x(), Vec3::z()]),
            (Vec3::new(0.0, 0.052, 0.0), Vec3::z(), [Vec3::x(), Vec3::y()]),
        ];
        let mut row = 24;
        let mut set = |row: usize, column: usize, value: f64| {
            matrix[(row, column)] = value;
            matrix[(column, row)] = value;
        };
        for (j, (point, axis, across)) in pins.into_iter().enumerate() {
            let (b, rod) = (j + 1, &bodies[j + 1]);
            let arm = rod.axes * Vec3::new(0.1, 0.0, 0.0);
            let seat = platform.axes * point;
            let bias = platform.spin.cross(&platform.spin.cross(&seat)) - rod.spin.cross(&rod.spin.cross(&arm));
            for i in 0..3 {
                let unit = Vec3::ith(i, 1.0);
                set(row, 6 * b + i, 1.0);
                set(row, i, -1.0);
                let (by_rod, by_platform) = (arm.cross(&unit), seat.cross(&unit));
                for k in 0..3 {
                    set(row, 6 * b + 3 + k, by_rod[k]);
                    set(row, 3 + k, -by_platform[k]);
                }
                right[row] = bias[i];
                row += 1;
            }
            let along = rod.axes * axis;
            for s in across.map(|s| platform.axes * s) {
                let lever = along.cross(&s);
                let turned = rod.spin.cross(&along).cross(&s) + along.cross(&platform.spin.cross(&s));
                for k in 0..3 {
                    set(row, 6 * b + 3 + k, lever[k]);
                    set(row, 3 + k, -lever[k]);
                }
                right[row] = -(rod.spin - platform.spin).dot(&turned);
                row += 1;
            }
        }
        let accelerations = matrix.lu().solve(&right).unwrap();
        for (b, body) in bodies.iter().enumerate() {
            let (out, q) = (&mut dy[13 * b..13 * b + 13], &y[13 * b + 3..13 * b + 7]);
            out[..3].copy_from_slice(body.velocity.as_slice());
            let q = nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]);
            let rate = nalgebra::Quaternion::from_imag(body.spin) * q * 0.5;
            out[3..7].copy_from_slice(&[rate.w, rate.i, rate.j, rate.k]);
            for i in 0..6 {
                out[7 + i] = accelerations[6 * b + i];
            }
        }
    }

    fn gaps(&self, t: f64, y: &[f64]) -> Vec<(f64, f64)> {
        let contacts = self.contacts(t, &Self::bodies(y));
        contacts.iter().map(|contact| (contact.depth, contact.rate)).collect()
    }

    fn forces(&self, t: f64, y: &[f64]) -> Vec<f64> {
        let contacts = self.contacts(t, &Self::bodies(y));
        contacts.iter().map(|contact| contact.normal).collect()
    }

    fn speed_floor(&self) -> f64 {
        1e-3
    }

    fn set_contacts(&self, contacts: &[Option<f64>]) {
        self.approach.borrow_mut().copy_from_slice(contacts);
    }
}
