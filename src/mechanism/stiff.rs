//! The stiff part of the equations of motion, linearised analytically: contact forces against displacement and velocity.
//!
//! A W-method keeps its order with any approximation of the Jacobian, so what is not stiff (gravity, gyroscopic terms,
//! the turning of arms) is left out. With a = M^-1 (Q + ...), K = dQ/dq and D = dQ/dv in velocity space,
//! (s I - J) (x_q, x_v) = (b_q, b_v) becomes (s I - M^-1 D - M^-1 K / s) x_v = b_v + M^-1 K T^+ b_q / s,
//! x_q = (b_q + T x_v) / s, where T maps velocities to position rates.

use super::contacts::Contacts;
use super::kinematics::Kinematics;
use super::model::{BallJoint, Model, Motion};
use crate::scene::{Mat3, Vec3};

/// Derivatives of one contact's force on the ball, and of its normal.
struct Stiffness {
    /// dF/de, N/m.
    by_displacement: Mat3,
    /// Part of dF that follows the centres' relative velocity, N s/m.
    by_rate: Mat3,
    /// Part of dF that follows the sliding velocity, N s/m.
    by_slip: Mat3,
    /// dn/de, 1/m.
    normal: Mat3,
    force: Vec3,
    n: Vec3,
}

/// Columns of one contact: how each coordinate moves it.
#[derive(Clone, Copy)]
struct Column {
    coordinate: usize,
    /// Ball centre against socket centre.
    centre: Vec3,
    /// Ball's contact point against the socket's.
    surface: Vec3,
    /// r omega_ball - R omega_socket.
    turn: Vec3,
}

/// The linearisation and its factors.
pub struct Stiff {
    n: usize,
    /// M^-1 K and M^-1 D, column-major n x n.
    by_position: Vec<f64>,
    by_velocity: Vec<f64>,
    lu: Vec<f64>,
    pivots: Vec<usize>,
    columns: Vec<Column>,
    /// df/dt, positions and velocities.
    pub time_derivative: Vec<f64>,
    /// Scratch for the derivative at the point of linearisation.
    pub derivative: Vec<f64>,
    /// Positions at which the linearisation was taken.
    y: Vec<f64>,
    shift: f64,
    scratch: Vec<f64>,
    rate: Vec<f64>,
    /// No contact carries a force: J is taken as zero but for q' = T v.
    empty: bool,
}

impl Stiff {
    /// For `velocities` velocity coordinates in a state of `dimension`.
    pub fn new(velocities: usize, dimension: usize) -> Self {
        let n = velocities;
        Self {
            n,
            by_position: vec![0.0; n * n],
            by_velocity: vec![0.0; n * n],
            lu: vec![0.0; n * n],
            pivots: vec![0; n],
            columns: Vec::with_capacity(n),
            time_derivative: vec![0.0; dimension],
            derivative: vec![0.0; dimension],
            y: vec![0.0; dimension],
            shift: 1.0,
            scratch: vec![0.0; n],
            rate: vec![0.0; dimension - n],
            empty: true,
        }
    }

    /// Generalised stiffness and damping of all contacts, from gaps and forces of the evaluation just made at `y`.
    /// `visit(body, point, f)` calls f(coordinate, point velocity, angular velocity) for the coordinates that move a body.
    pub fn gather(
        &mut self,
        model: &Model,
        contacts: &Contacts,
        motion: &[Kinematics],
        y: &[f64],
        visit: impl Fn(usize, &Vec3, &mut dyn FnMut(usize, Vec3, Vec3)),
    ) {
        self.y.copy_from_slice(y);
        self.by_position.fill(0.0);
        self.by_velocity.fill(0.0);
        self.empty = true;
        for (j, joint) in model.joints.iter().enumerate() {
            let Some(stiffness) = linearise_contact(contacts, motion, joint, j) else {
                continue;
            };
            self.empty = false;
            self.collect(contacts, motion, joint, j, &stiffness.n, &visit);
            self.add(&stiffness, contacts.coefficients(j).surface);
        }
    }

    fn collect(
        &mut self,
        contacts: &Contacts,
        motion: &[Kinematics],
        joint: &BallJoint,
        j: usize,
        n: &Vec3,
        visit: &impl Fn(usize, &Vec3, &mut dyn FnMut(usize, Vec3, Vec3)),
    ) {
        self.columns.clear();
        let radius = contacts.coefficients(j).ball_radius;
        let sides = [
            (&joint.ball, radius, 1.0),
            (&joint.socket, radius + contacts.clearance(j), -1.0),
        ];
        for (anchor, radius, sign) in sides {
            let m = &motion[anchor.body];
            let centre = m.position + m.rotation * anchor.offset;
            let to_surface = n * radius;
            let columns = &mut self.columns;
            visit(anchor.body, &centre, &mut |coordinate, velocity, omega| {
                let centre = velocity * sign;
                let surface = (velocity + omega.cross(&to_surface)) * sign;
                let turn = omega * (radius * sign);
                // A coordinate above both bodies of the joint moves both.
                if let Some(column) = columns.iter_mut().find(|c| c.coordinate == coordinate) {
                    column.centre += centre;
                    column.surface += surface;
                    column.turn += turn;
                } else {
                    columns.push(Column {
                        coordinate,
                        centre,
                        surface,
                        turn,
                    });
                }
            });
        }
    }

    /// Adds one contact: dQ_k = surface_k . dF + (F x turn_k) . dn.
    fn add(&mut self, s: &Stiffness, slips_by_surface: bool) {
        let n = self.n;
        for l in &self.columns {
            let force_q = s.by_displacement * l.centre;
            let normal_q = s.normal * l.centre;
            let slip = if slips_by_surface {
                l.surface
            } else {
                l.centre
            };
            let force_v = s.by_rate * l.centre + s.by_slip * slip;
            let lever = normal_q.cross(&s.force);
            for k in &self.columns {
                let at = l.coordinate * n + k.coordinate;
                self.by_position[at] += k.surface.dot(&force_q) + k.turn.dot(&lever);
                self.by_velocity[at] += k.surface.dot(&force_v);
            }
        }
    }

    /// Turns forces into accelerations: `mobilise` maps generalised forces to accelerations in place.
    pub fn mobilise(&mut self, mut mobilise: impl FnMut(&mut [f64])) {
        if self.empty {
            return;
        }
        for column in self.by_position.chunks_exact_mut(self.n) {
            mobilise(column);
        }
        for column in self.by_velocity.chunks_exact_mut(self.n) {
            mobilise(column);
        }
    }

    /// Factors s I - M^-1 D - M^-1 K / s by elimination with row exchanges.
    pub fn factor(&mut self, shift: f64) {
        self.shift = shift;
        if self.empty {
            return;
        }
        let n = self.n;
        let a = &mut self.lu;
        // Row-major for the elimination.
        for i in 0..n {
            for j in 0..n {
                a[i * n + j] = -self.by_velocity[j * n + i] - self.by_position[j * n + i] / shift;
            }
            a[i * n + i] += shift;
        }
        for k in 0..n {
            let mut best = k;
            for i in k + 1..n {
                if a[i * n + k].abs() > a[best * n + k].abs() {
                    best = i;
                }
            }
            self.pivots[k] = best;
            if best != k {
                for j in 0..n {
                    a.swap(k * n + j, best * n + j);
                }
            }
            let (top, bottom) = a.split_at_mut((k + 1) * n);
            let pivot_row = &top[k * n..];
            let inverse = 1.0 / pivot_row[k];
            for row in bottom.chunks_exact_mut(n) {
                let factor = row[k] * inverse;
                row[k] = factor;
                if factor != 0.0 {
                    for j in k + 1..n {
                        row[j] -= factor * pivot_row[j];
                    }
                }
            }
        }
    }

    /// Solves (s I - J) x = b in place; `positions` splits `b`.
    pub fn solve(
        &mut self,
        positions: usize,
        b: &mut [f64],
        to_velocity_space: impl Fn(&[f64], &[f64], &mut [f64]),
        position_rate: impl Fn(&[f64], &mut [f64]),
    ) {
        let n = self.n;
        let (b_q, b_v) = b.split_at_mut(positions);
        if !self.empty {
            to_velocity_space(&self.y, b_q, &mut self.scratch);
            for (j, x) in self.scratch.iter().enumerate() {
                let x = x / self.shift;
                let column = &self.by_position[j * n..(j + 1) * n];
                for i in 0..n {
                    b_v[i] += column[i] * x;
                }
            }
            for k in 0..n {
                b_v.swap(k, self.pivots[k]);
            }
            for i in 1..n {
                let row = &self.lu[i * n..i * n + i];
                let dot: f64 = row.iter().zip(&*b_v).map(|(a, x)| a * x).sum();
                b_v[i] -= dot;
            }
            for i in (0..n).rev() {
                let row = &self.lu[i * n..(i + 1) * n];
                let dot: f64 = row[i + 1..]
                    .iter()
                    .zip(&b_v[i + 1..])
                    .map(|(a, x)| a * x)
                    .sum();
                b_v[i] = (b_v[i] - dot) / row[i];
            }
        } else {
            for x in b_v.iter_mut() {
                *x /= self.shift;
            }
        }
        // T is linear in v at the positions of the linearisation.
        self.y[positions..].copy_from_slice(b_v);
        position_rate(&self.y, &mut self.rate);
        for (x, r) in b_q.iter_mut().zip(&self.rate) {
            *x = (*x + r) / self.shift;
        }
    }
}

/// Derivatives of contact `j`; `None` where it carries no force.
fn linearise_contact(
    contacts: &Contacts,
    motion: &[Kinematics],
    joint: &BallJoint,
    j: usize,
) -> Option<Stiffness> {
    let gap = &contacts.gaps()[j];
    if joint.ideal.is_some() || gap.normal_force <= 0.0 {
        return None;
    }
    let c = contacts.coefficients(j);
    let distance = gap.eccentricity.norm();
    let n = gap.eccentricity / distance;
    let rate = n.dot(&gap.eccentricity_rate) - contacts.clearance_rate(j);
    let penetration = distance - contacts.clearance(j);
    let memory = &contacts.memory()[j];
    let approach = if memory.active {
        memory.approach_speed
    } else {
        rate.max(c.speed_floor)
    };
    let identity = Mat3::identity();
    let tangent = identity - n * n.transpose();
    let normal = tangent / distance;
    let root = penetration.sqrt();
    let elastic = c.stiffness * penetration * root;
    let factor = 1.0 + c.damping * rate / approach;
    let by_penetration = 1.5 * c.stiffness * root * factor;
    let by_rate = elastic * c.damping / approach;
    let force_n = gap.normal_force;

    // F = -F_N n - mu F_N t, with t along the sliding velocity.
    let mut along = -n;
    let mut by_slip = Mat3::zeros();
    let mut by_normal = identity * -force_n;
    if c.friction > 0.0 && gap.slip_speed > 0.0 {
        let speed = gap.slip_speed;
        let ratio = c.friction_ratio(speed);
        let radius = c.ball_radius;
        let (ball, socket) = (&motion[joint.ball.body], &motion[joint.socket.body]);
        let mut sliding = gap.eccentricity_rate;
        if c.surface {
            sliding += ball.angular_velocity.cross(&(n * radius))
                - socket
                    .angular_velocity
                    .cross(&(n * (radius + contacts.clearance(j))));
        }
        let t = (sliding - n * n.dot(&sliding)) / speed;
        along -= t * ratio;
        let slope = c.friction_slope(speed);
        let tt = t * t.transpose();
        by_slip = ((tangent - tt) * (ratio / speed) + tt * slope) * -force_n;
        // The tangent plane turns with n: d(v_t) = -(n . w) dn - n (w . dn).
        by_normal += by_slip * (identity * -n.dot(&sliding));
        by_slip *= tangent;
    }
    // d(delta_dot)/de = e_dot_t / |e|.
    let rate_by_e = normal * gap.eccentricity_rate;
    let by_displacement =
        along * (n * by_penetration + rate_by_e * by_rate).transpose() + by_normal * normal;
    Some(Stiffness {
        by_displacement,
        by_rate: along * (n * by_rate).transpose(),
        by_slip,
        normal,
        force: n * -force_n + gap.friction,
        n,
    })
}

/// T^+ of the tree coordinates: rates of positions to velocities.
pub fn tree_velocities(model: &Model, y: &[f64], rate: &[f64], out: &mut [f64]) {
    for body in &model.bodies {
        match body.motion {
            Motion::Free { q, v } => {
                out[v..v + 3].copy_from_slice(&rate[q..q + 3]);
                out[v + 3..v + 6].copy_from_slice(&spin_of(&y[q + 3..q + 7], &rate[q + 3..q + 7]));
            }
            Motion::Revolute { q, v } | Motion::Prismatic { q, v } => out[v] = rate[q],
            Motion::Fixed | Motion::Driven { .. } => {}
        }
    }
}

/// T^+ of body coordinates.
pub fn body_velocities(bodies: usize, y: &[f64], rate: &[f64], out: &mut [f64]) {
    for b in 0..bodies {
        out[6 * b..6 * b + 3].copy_from_slice(&rate[7 * b..7 * b + 3]);
        let spin = spin_of(&y[7 * b + 3..7 * b + 7], &rate[7 * b + 3..7 * b + 7]);
        out[6 * b + 3..6 * b + 6].copy_from_slice(&spin);
    }
}

/// omega = 2 vec(q' q*) for a quaternion of about unit length.
fn spin_of(q: &[f64], d: &[f64]) -> [f64; 3] {
    let (w, x, y, z) = (q[0], q[1], q[2], q[3]);
    [
        2.0 * (-d[0] * x + d[1] * w - d[2] * z + d[3] * y),
        2.0 * (-d[0] * y + d[1] * z + d[2] * w - d[3] * x),
        2.0 * (-d[0] * z - d[1] * y + d[2] * x + d[3] * w),
    ]
}
