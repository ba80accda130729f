//! An independent solver crate on the same equations, and on equations written down here a second time.
//!
//! diffsol's Tsitouras 5(4) pair and its BDF integrate; its root finding says when a contact begins or ends, and the contact
//! memory is kept here.

use std::cell::RefCell;

use crate::common::{Changes, run_until, scene};
use diffsol::{NalgebraLU, NalgebraMat, OdeBuilder, OdeSolverMethod, OdeSolverStopReason, Vector};
use jointplay::contact::Memory;
use jointplay::integrate::System;
use jointplay::mechanism::{Mechanism, Touching};
use jointplay::simulate::Simulation;

type M = NalgebraMat<f64>;
type Lu = NalgebraLU<f64>;

/// A scene as an independent solver needs it: derivative and penetrations for a contact memory that it is told.
trait Equations {
    fn start(&self) -> Vec<f64>;
    fn derivative(&self, t: f64, y: &[f64], dy: &mut [f64]);
    /// Penetration and its rate for each ball joint.
    fn gaps(&self, t: f64, y: &[f64]) -> Vec<(f64, f64)>;
    /// Normal force for each ball joint.
    fn forces(&self, t: f64, y: &[f64]) -> Vec<f64>;
    fn speed_floor(&self) -> f64;
    /// Approach speeds of the contacts under way.
    fn remember(&self, contacts: &[Option<f64>]);
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Solver {
    Tsitouras,
    Bdf,
}

/// What an independent run gives.
struct Run {
    y: Vec<f64>,
    /// Joint, time, approach speed, largest normal force seen, in order of beginning.
    contacts: Vec<(usize, f64, f64, f64)>,
}

/// A root function's own zero is not found again: a contact that just began ends this much further out, m.
const HYSTERESIS: f64 = 1e-14;

/// Integrates to `end` with relative and absolute tolerance `tolerance`.
fn integrate(equations: &impl Equations, solver: Solver, tolerance: f64, end: f64) -> Run {
    let mut y = equations.start();
    let mut t = 0.0;
    let mut active: Vec<Option<f64>> = vec![None; equations.gaps(t, &y).len()];
    let mut run = Run { y: Vec::new(), contacts: Vec::new() };
    equations.remember(&active);
    while t < end {
        let (t_next, y_next, root) = segment(equations, solver, tolerance, t, end, &y, &active, &mut run);
        (t, y) = (t_next, y_next);
        if let Some(j) = root {
            active[j] = match active[j] {
                Some(_) => None,
                None => {
                    let speed = equations.gaps(t, &y)[j].1.max(equations.speed_floor());
                    run.contacts.push((j, t, speed, 0.0));
                    Some(speed)
                }
            };
            equations.remember(&active);
        }
    }
    run.y = y;
    run
}

/// To the next beginning or end of a contact, or to `end`: time, state, and the joint.
fn segment(
    equations: &impl Equations,
    solver: Solver,
    tolerance: f64,
    start: f64,
    end: f64,
    y: &[f64],
    active: &[Option<f64>],
    run: &mut Run,
) -> (f64, Vec<f64>, Option<usize>) {
    let n = y.len();
    // The implicit solver wants the product of the Jacobian and a vector: by central differences.
    let product = |x: &[f64], _: &[f64], t: f64, v: &[f64], out: &mut [f64]| {
        let size = v.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        let h = 1e-8 / size.max(1e-300);
        let at = |s: f64| {
            let moved: Vec<f64> = x.iter().zip(v).map(|(x, v)| x + s * h * v).collect();
            let mut dy = vec![0.0; n];
            equations.derivative(t, &moved, &mut dy);
            dy
        };
        let (plus, minus) = (at(1.0), at(-1.0));
        for i in 0..n {
            out[i] = (plus[i] - minus[i]) / (2.0 * h);
        }
    };
    let roots = |x: &[f64], _: &[f64], t: f64, out: &mut [f64]| {
        for (j, (out, gap)) in out.iter_mut().zip(equations.gaps(t, x)).enumerate() {
            let shift = if active[j].is_some() { HYSTERESIS } else { -HYSTERESIS };
            *out = gap.0 + shift;
        }
    };
    let problem = OdeBuilder::<M>::new()
        .t0(start)
        .h0(1e-7)
        .rtol(tolerance)
        .atol([tolerance])
        .rhs_implicit(|x, _, t, dy| equations.derivative(t, x, dy), product)
        .init(|_, _, out| out.copy_from_slice(y), n)
        .root(roots, active.len())
        .build()
        .unwrap();
    match solver {
        Solver::Tsitouras => follow(problem.tsit45().unwrap(), equations, end, run),
        Solver::Bdf => follow(problem.bdf::<Lu>().unwrap(), equations, end, run),
    }
}

fn follow<'a, Eqn, S>(
    mut solver: S,
    equations: &impl Equations,
    end: f64,
    run: &mut Run,
) -> (f64, Vec<f64>, Option<usize>)
where
    Eqn: diffsol::OdeEquations<T = f64, M = M, V = diffsol::NalgebraVec<f64>> + 'a,
    S: OdeSolverMethod<'a, Eqn>,
{
    solver.set_stop_time(end).unwrap();
    loop {
        let before = solver.state().t;
        let reason = solver.step().unwrap();
        let (t, root) = match reason {
            OdeSolverStopReason::RootFound(t, j) => (t, Some(j)),
            _ => (solver.state().t, None),
        };
        // Forces inside the step, for the peaks.
        for k in 1..=16 {
            let inside = before + (t - before) * f64::from(k) / 16.0;
            let y = solver.interpolate(inside).unwrap().clone_as_vec();
            for (j, force) in equations.forces(inside, &y).into_iter().enumerate() {
                if let Some(contact) = run.contacts.iter_mut().rev().find(|c| c.0 == j) {
                    contact.3 = contact.3.max(force);
                }
            }
        }
        if root.is_some() || reason == OdeSolverStopReason::TstopReached {
            return (t, solver.interpolate(t).unwrap().clone_as_vec(), root);
        }
    }
}

/// The program's equations under another's solver.
struct Borrowed {
    mechanism: RefCell<Mechanism>,
    memory: RefCell<Vec<Memory>>,
    speed_floor: f64,
}

impl Borrowed {
    fn new(name: &str, changes: &Changes) -> Self {
        let scene = scene(name, changes);
        Self {
            mechanism: RefCell::new(Mechanism::new(&scene).unwrap()),
            memory: RefCell::new(vec![Memory::default(); scene.ball_joints.len()]),
            speed_floor: scene.contact.impact_speed_floor,
        }
    }
}

impl Equations for Borrowed {
    fn start(&self) -> Vec<f64> {
        self.mechanism.borrow_mut().start().unwrap()
    }

    fn derivative(&self, t: f64, y: &[f64], dy: &mut [f64]) {
        let memory = self.memory.borrow();
        let mut mechanism = self.mechanism.borrow_mut();
        let mut evaluator = mechanism.evaluator(Touching::Located(&memory));
        evaluator.derivative(t, y, dy);
    }

    fn gaps(&self, t: f64, y: &[f64]) -> Vec<(f64, f64)> {
        let mut mechanism = self.mechanism.borrow_mut();
        mechanism.measure(t, y);
        let gaps = mechanism.contacts.gaps();
        gaps.map(|gap| (gap.separation.penetration, gap.separation.rate)).collect()
    }

    fn forces(&self, t: f64, y: &[f64]) -> Vec<f64> {
        self.derivative(t, y, &mut vec![0.0; y.len()]);
        let mechanism = self.mechanism.borrow();
        let gaps = mechanism.contacts.gaps();
        gaps.map(|gap| gap.normal_force).collect()
    }

    fn speed_floor(&self) -> f64 {
        self.speed_floor
    }

    fn remember(&self, contacts: &[Option<f64>]) {
        for (memory, speed) in self.memory.borrow_mut().iter_mut().zip(contacts) {
            *memory = Memory {
                active: speed.is_some(),
                approach_speed: speed.unwrap_or(0.0),
                floored: false,
                ..Memory::default()
            };
        }
    }
}

/// The pendulum written down again, from the built-in scene's description alone: it starts at rest in the XZ plane and stays
/// there. State x, z of the centroid, angle about +Y, and their rates; the ball is 0.1 m up the rod from the centroid.
struct Pendulum {
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

    fn normal(&self, y: &[f64]) -> f64 {
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
        let closing = n[0] * rate[0] + n[1] * rate[1];
        let damping = 1.0 + 3.0 * (1.0 - restitution * restitution) / 4.0 * closing / approach;
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
        let normal = self.normal(y);
        // The touching point of the ball against the socket, which stands still.
        let (turn, r) = (y[5], Self::RADIUS);
        let slip = [rate[0] + turn * r * n[1], rate[1] - turn * r * n[0]];
        let along = slip[0] * n[0] + slip[1] * n[1];
        let slip = [slip[0] - along * n[0], slip[1] - along * n[1]];
        let speed = slip[0].hypot(slip[1]);
        let (low, high) = (1e-6, 1e-4);
        let correction = ((speed - low) / (high - low)).clamp(0.0, 1.0);
        let friction = if speed > 0.0 { -0.15 * correction * normal / speed } else { 0.0 };
        let force = [-normal * n[0] + friction * slip[0], -normal * n[1] + friction * slip[1]];
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
        vec![self.normal(y)]
    }

    fn speed_floor(&self) -> f64 {
        1e-3
    }

    fn remember(&self, contacts: &[Option<f64>]) {
        *self.approach.borrow_mut() = contacts[0];
    }
}

/// The measuring mechanism written down again: platform and three rods with all their coordinates, hinges by multipliers, sliders
/// by (39) as functions of time, contacts by (19)-(21). State: position, quaternion (w, x, y, z), velocity and angular velocity of
/// platform, rod 1, 2, 3, one body after the other; world axes.
struct Machine {
    clearance: f64,
    friction: f64,
    /// Friction reads the velocities of (13) as printed, not (15)-(16).
    printed: bool,
    start: Vec<f64>,
    approach: RefCell<Vec<Option<f64>>>,
}

/// One contact: force on the ball, where it acts, delta, its rate, F_N.
struct Touch {
    force: Vec3,
    at: Vec3,
    depth: f64,
    rate: f64,
    normal: f64,
}

/// One body of [`Machine`].
struct Moving {
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

    /// Starts where the program starts.
    fn new(clearance: f64, friction: f64, printed: bool, changes: &Changes) -> Self {
        let mut simulation = Simulation::new(&scene("spcmm", changes)).unwrap();
        let frame = crate::common::frame_now(&mut simulation);
        let mut start = Vec::new();
        // Parents come first: sliders, platform, rods.
        for body in [3, 4, 5, 6].map(|b| frame.bodies[b]) {
            let turn = nalgebra::Rotation3::from_matrix_unchecked(body.rotation);
            let q = nalgebra::UnitQuaternion::from_rotation_matrix(&turn);
            start.extend(body.position.iter());
            start.extend([q.w, q.i, q.j, q.k]);
            start.extend(body.velocity.iter());
            start.extend(body.angular_velocity.iter());
        }
        Self { clearance, friction, printed, start, approach: RefCell::new(vec![None; 3]) }
    }

    fn bodies(y: &[f64]) -> Vec<Moving> {
        let of = |s: &[f64]| {
            let q = nalgebra::Quaternion::new(s[3], s[4], s[5], s[6]);
            Moving {
                position: Vec3::new(s[0], s[1], s[2]),
                axes: *nalgebra::UnitQuaternion::from_quaternion(q).to_rotation_matrix().matrix(),
                velocity: Vec3::new(s[7], s[8], s[9]),
                spin: Vec3::new(s[10], s[11], s[12]),
            }
        };
        y.chunks_exact(13).map(of).collect()
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

    /// Their velocities, by central differences of order 8.
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

    fn touches(&self, t: f64, bodies: &[Moving]) -> Vec<Touch> {
        let (sockets, rates) = (Self::sockets(t), Self::socket_rates(t));
        let approach = self.approach.borrow();
        let (young, poisson, restitution) = (206e9, 0.3, 0.9);
        let s = (1.0 - poisson * poisson) / young;
        let socket = Self::RADIUS + self.clearance;
        let k = 4.0 / (3.0 * (s + s)) * (socket * Self::RADIUS / self.clearance).sqrt();
        let of = |j: usize| {
            let rod = &bodies[j + 1];
            let arm = rod.axes * Vec3::new(-0.1, 0.0, 0.0);
            let e = rod.position + arm - sockets[j];
            let moving = rod.velocity + rod.spin.cross(&arm) - rates[j];
            let size = e.norm();
            let n = if size > 0.0 { e / size } else { e };
            let (depth, rate) = (size - self.clearance, n.dot(&moving));
            let mut touch =
                Touch { force: Vec3::zeros(), at: rod.position + arm + n * Self::RADIUS, depth, rate, normal: 0.0 };
            let Some(began) = approach[j].filter(|_| depth > 0.0) else {
                return touch;
            };
            let damping = 1.0 + 0.75 * (1.0 - restitution * restitution) * rate / began;
            touch.normal = (k * depth.powf(1.5) * damping).max(0.0);
            let mut sliding = moving - n * rate;
            if self.printed {
                // Z_j + r n against Z_i + R n, with dn/dt.
                let turning = (moving - n * rate) / size;
                sliding += turning * Self::RADIUS - turning * socket;
            }
            let speed = sliding.norm();
            let (low, high) = (1e-6, 1e-4);
            let correction = ((speed - low) / (high - low)).clamp(0.0, 1.0);
            touch.force = -n * touch.normal;
            if speed > 0.0 {
                touch.force -= sliding * (self.friction * correction * touch.normal / speed);
            }
            touch
        };
        (0..3).map(of).collect()
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
            let turning = -body.spin.cross(&(inertia * body.spin));
            right.rows_mut(6 * b + 3, 3).copy_from(&turning);
        }
        for (j, touch) in self.touches(t, &bodies).iter().enumerate() {
            let b = j + 1;
            let torque = (touch.at - bodies[b].position).cross(&touch.force);
            for i in 0..3 {
                right[6 * b + i] += touch.force[i];
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
        let found = matrix.lu().solve(&right).unwrap();
        for (b, body) in bodies.iter().enumerate() {
            let (out, q) = (&mut dy[13 * b..13 * b + 13], &y[13 * b + 3..13 * b + 7]);
            out[..3].copy_from_slice(body.velocity.as_slice());
            let q = nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]);
            let rate = nalgebra::Quaternion::from_imag(body.spin) * q * 0.5;
            out[3..7].copy_from_slice(&[rate.w, rate.i, rate.j, rate.k]);
            for i in 0..6 {
                out[7 + i] = found[6 * b + i];
            }
        }
    }

    fn gaps(&self, t: f64, y: &[f64]) -> Vec<(f64, f64)> {
        let touches = self.touches(t, &Self::bodies(y));
        touches.iter().map(|touch| (touch.depth, touch.rate)).collect()
    }

    fn forces(&self, t: f64, y: &[f64]) -> Vec<f64> {
        let touches = self.touches(t, &Self::bodies(y));
        touches.iter().map(|touch| touch.normal).collect()
    }

    fn speed_floor(&self) -> f64 {
        1e-3
    }

    fn remember(&self, contacts: &[Option<f64>]) {
        self.approach.borrow_mut().copy_from_slice(contacts);
    }
}

/// The program's own run to `time`, and its contacts as in [`Run`].
fn program(name: &str, changes: &Changes, time: f64) -> (Simulation, Vec<(usize, f64, f64, f64)>) {
    let mut simulation = Simulation::new(&scene(name, changes)).unwrap();
    let mut contacts: Vec<(usize, f64, f64, f64)> = Vec::new();
    let mut peaks = Vec::new();
    while simulation.time() < time {
        simulation.step_until(time).unwrap();
        simulation.take_peaks(&mut peaks);
        for (j, peak) in peaks.iter().enumerate() {
            if peak.impacts > 0 {
                let speed = simulation.contact_memory(j).approach_speed;
                contacts.push((j, simulation.time(), speed, 0.0));
            } else if let Some(contact) = contacts.iter_mut().rev().find(|c| c.0 == j) {
                contact.3 = contact.3.max(peak.normal);
            }
        }
    }
    (simulation, contacts)
}

/// Compares the contacts one by one.
fn same_contacts(what: &str, ours: &[(usize, f64, f64, f64)], theirs: &[(usize, f64, f64, f64)]) {
    assert_eq!(ours.len(), theirs.len(), "{what}");
    // The last may be under way.
    for (n, (a, b)) in ours.iter().zip(theirs).enumerate().take(ours.len() - 1) {
        println!(
            "{what}: contact {n}: joint {}, {:.9} s, off by {:.1e} s, {:.1e} m/s; {:.3} N, off by {:.1e}",
            b.0,
            b.1,
            a.1 - b.1,
            a.2 - b.2,
            b.3,
            a.3 / b.3 - 1.0
        );
        assert_eq!(a.0, b.0, "{what}");
        assert!((a.1 - b.1).abs() < 1e-9, "{what}: time of contact {n}");
        assert!((a.2 / b.2 - 1.0).abs() < 1e-6, "{what}: approach speed of contact {n}");
        assert!((a.3 / b.3 - 1.0).abs() < 1e-5, "{what}: peak of contact {n}");
    }
}

const TIGHT: (&str, &str) = ("solver.tolerance", "1e-11");

#[test]
fn the_pendulum_is_that_of_other_equations_and_another_solver() {
    let end = 0.03;
    let equations = Pendulum { approach: RefCell::new(None) };
    for (solver, tolerance) in [(Solver::Tsitouras, 1e-12), (Solver::Bdf, 1e-11)] {
        let theirs = integrate(&equations, solver, tolerance, end);
        for method in ["dopri5", "automatic"] {
            let changes = [("solver.method", method), TIGHT];
            let (mut simulation, contacts) = program("pendulum", &changes, end);
            let what = format!("{solver:?} and {method}");
            same_contacts(&what, &contacts, &theirs.contacts);
            assert!(contacts.len() > 3, "only {} contacts", contacts.len());
            let body = crate::common::frame_now(&mut simulation).bodies[0];
            let angle = body.rotation[(0, 2)].atan2(body.rotation[(2, 2)]);
            let off =
                [body.position.x - theirs.y[0], body.position.y, body.position.z - theirs.y[1], angle - theirs.y[2]];
            println!("{what}: off by {off:?} m, m, m, rad");
            assert!(off.iter().all(|off| off.abs() < 1e-9), "{what}: {off:?}");
        }
    }
}

#[test]
fn the_measuring_mechanism_is_that_of_other_equations_with_either_friction_velocity() {
    let end = 0.025;
    let mut ends = Vec::new();
    for word in ["centres", "printed"] {
        let changes = [
            ("contact.clearance", "0.5 mm"),
            ("contact.friction", "0.2"),
            ("contact.friction_velocity", word),
            ("solver.method", "dopri5"),
            TIGHT,
        ];
        let equations = Machine::new(0.5e-3, 0.2, word == "printed", &changes);
        let theirs = integrate(&equations, Solver::Tsitouras, 1e-12, end);
        let (mut simulation, contacts) = program("spcmm", &changes, end);
        same_contacts(word, &contacts, &theirs.contacts);
        assert!(contacts.len() >= 6, "only {} contacts", contacts.len());
        // What a section holds.
        let pose = crate::common::frame_now(&mut simulation).pose;
        let axes = Machine::bodies(&theirs.y)[0].axes;
        let (x, beta) = (theirs.y[0], -axes[(0, 1)].asin());
        let off = [pose.position.x - x, pose.angles.y - beta];
        println!("{word}: x {x} m, beta {beta} rad, off by {off:?}");
        assert!(off.iter().all(|off| off.abs() < 1e-9), "{word}: {off:?}");
        ends.push(x);
    }
    // Or the comparison would not tell the two.
    assert!((ends[0] - ends[1]).abs() > 1e-7, "{ends:?}");
}

#[test]
fn the_measuring_mechanism_moves_the_same_under_another_solver() {
    let end = 0.013;
    let equations = Borrowed::new("spcmm", &[]);
    let theirs = integrate(&equations, Solver::Tsitouras, 1e-12, end);
    let (simulation, contacts) = program("spcmm", &[("solver.method", "dopri5"), TIGHT], end);
    same_contacts("spcmm", &contacts, &theirs.contacts);
    assert!(contacts.len() >= 6, "only {} contacts", contacts.len());
    let positions = equations.mechanism.borrow().positions();
    let pairs = simulation.state()[..positions].iter().zip(&theirs.y);
    let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("off by {off:.1e} m or rad");
    assert!(off < 1e-9, "{off}");
}

/// How many contacts a scene with ideal joints has until `end` under an implicit solver, and how far it then is from the
/// program's, m or rad. Nothing is projected here, so that the closing of loops is left to the equations.
pub fn moves_the_same(name: &str, changes: &Changes, end: f64) -> (usize, f64) {
    let equations = Borrowed::new(name, changes);
    let theirs = integrate(&equations, Solver::Bdf, 1e-10, end);
    let mut simulation = Simulation::new(&scene(name, &[changes, &[TIGHT]].concat())).unwrap();
    run_until(&mut simulation, end);
    let positions = equations.mechanism.borrow().positions();
    let pairs = simulation.state()[..positions].iter().zip(&theirs.y);
    let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("{name}: off by {off:.1e} m or rad, {} contacts", theirs.contacts.len());
    (theirs.contacts.len(), off)
}

#[test]
fn a_mechanism_with_an_ideal_joint_moves_the_same_under_an_implicit_solver() {
    let (contacts, off) = moves_the_same("spcmm", &[("joint.S1.clearance", "0")], 0.012);
    assert!(contacts >= 2);
    assert!(off < 1e-9, "{off}");
}

#[test]
fn peaks_of_the_presets_are_those_of_another_solver() {
    // The first five impacts are over, the sixth has not begun.
    let end = 0.0118;
    let theirs = integrate(&Borrowed::new("spcmm", &[]), Solver::Tsitouras, 1e-11, end);
    assert_eq!(theirs.contacts.len(), 5);
    for preset in ["real-time", "accurate", "reference"] {
        let (_, contacts) = program("spcmm", &[("solver.preset", preset)], end);
        assert_eq!(contacts.len(), 5, "{preset}");
        for (a, b) in contacts.iter().zip(&theirs.contacts) {
            let off = a.3 / b.3 - 1.0;
            println!("{preset}: joint {}: {:.2} N, off by {off:.1e}", a.0, b.3);
            assert!(a.0 == b.0 && off.abs() < 0.01, "{preset}: {off}");
        }
    }
}
