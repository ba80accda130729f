//! Contact forces at the end of a step: the implicit part of a semi-implicit step.
//!
//! Each touching joint couples with the coordinates through three directions alone. With the accelerations a for forces
//! f_0 where the present velocity carries the contacts, W the relative velocity at a contact per coordinate, S its contact
//! point's, and w the change of that velocity over the step, the forces at its end solve
//! w = h W a + h W M^-1 S^T (f(w) - f_0): three rows a joint instead of a row for every coordinate
//! (Sherman-Morrison-Woodbury). Newton's method needs the mass matrix once. What is not stiff at such steps is left as it is
//! at the start: the turning of the normal and of arms.

use super::contacts::{Contacts, Switching};
use super::kinematics::Kinematics;
use super::model::Model;
use super::stiff::{Column, collect_columns};
use crate::contact::{Coefficients, Slip};
use crate::scene::{Mat3, Vec3};

/// Most Newton iterations, and the change of a normal force against the largest at which they end.
const ITERATIONS: usize = 8;
const CONVERGED: f64 = 1e-3;
/// Part of its clearance within which a ball is too far from the wall to reach it unasked.
const NEAR: f64 = 0.5;

/// One joint that touches, or will within the step.
struct Touch {
    joint: usize,
    law: Coefficients,
    slip: Slip,
    approach: f64,
    normal: Vec3,
    /// Where the present velocity carries the contact: penetration (m), its rate (m/s), sliding velocity (m/s), force (N).
    penetration: f64,
    rate: f64,
    sliding: Vec3,
    start: Vec3,
    /// Velocity that the step adds, m/s.
    added: Vec3,
    /// Force there, N, and its derivative by the added velocity, N s/m.
    force: Vec3,
    impedance: Mat3,
}

impl Touch {
    /// Force and impedance for the velocity now in `added`, over a step of size `h`.
    fn evaluate(&mut self, h: f64) {
        let n = self.normal;
        let along_normal = n.dot(&self.added);
        let penetration = self.penetration + h * along_normal;
        let rate = self.rate + along_normal;
        let c = &self.law;
        let normal_force = c.normal_force(penetration, rate, self.approach);
        self.force = Vec3::zeros();
        self.impedance = Mat3::zeros();
        if normal_force > 0.0 {
            let root = penetration.sqrt();
            let stiffness = c.stiffness * root;
            let by_penetration = 1.5 * stiffness * (1.0 + c.damping * rate / self.approach);
            let by_rate = stiffness * penetration * c.damping / self.approach;
            let tangent = Mat3::identity() - n * n.transpose();
            let sliding = self.sliding + tangent * self.added;
            // Friction by its secant: it brings sliding to rest within a step and cannot reverse it.
            let per_speed = c.friction_per_speed(self.slip, sliding.norm());
            let along = -n - sliding * per_speed;
            self.force = along * normal_force;
            self.impedance = along * n.transpose() * (h * by_penetration + by_rate)
                - tangent * (per_speed * normal_force);
        }
    }
}

/// Scratch of the implicit part, allocated once.
pub struct ImplicitContacts {
    n: usize,
    /// First and last velocity coordinate that a force at each joint may accelerate.
    ranges: Vec<(usize, usize)>,
    /// Joints further apart than this in their order do not feel each other.
    reach: usize,
    touches: Vec<Touch>,
    columns: Vec<Vec<Column>>,
    /// M^-1 S^T, three columns a joint over its range, interleaved.
    weighted: Vec<Vec<f64>>,
    /// Block band matrix and its right side.
    blocks: Vec<Mat3>,
    right: Vec<Vec3>,
    /// W M^-1 S^T in the same band, and h W a.
    mobility: Vec<Mat3>,
    free: Vec<Vec3>,
    scratch: Vec<f64>,
}

impl ImplicitContacts {
    /// For `n` velocity coordinates. With `blocks`, a force accelerates only the trees that it acts on; else all.
    pub fn new(model: &Model, n: usize, blocks: bool) -> Self {
        let joints = model.joints.len();
        let block_of = |body: usize| {
            (body < model.bodies.len() && !model.bodies[body].driven_only)
                .then(|| model.block_of[body])
        };
        let of_joint = |j: usize| {
            let joint = &model.joints[j];
            [block_of(joint.ball.body), block_of(joint.socket.body)]
        };
        let range = |j: usize| {
            if !blocks {
                return (0, n);
            }
            let of = |b: usize| (model.blocks[b].v, model.blocks[b].v + model.blocks[b].n);
            let mut range = (n, 0);
            for (first, end) in of_joint(j).into_iter().flatten().map(of) {
                range = (range.0.min(first), range.1.max(end));
            }
            (range.0.min(range.1), range.1)
        };
        let couples = |i: usize, j: usize| {
            !blocks
                || of_joint(i)
                    .into_iter()
                    .flatten()
                    .any(|b| of_joint(j).contains(&Some(b)))
        };
        let reach = (0..joints)
            .filter_map(|i| (i..joints).rev().find(|&j| couples(i, j)).map(|j| j - i))
            .max()
            .unwrap_or(0);
        let ranges: Vec<_> = (0..joints).map(range).collect();
        let width = |&(first, end): &(usize, usize)| end - first;
        Self {
            n,
            reach,
            touches: Vec::with_capacity(joints),
            columns: ranges
                .iter()
                .map(|range| Vec::with_capacity(width(range)))
                .collect(),
            weighted: ranges.iter().map(|r| vec![0.0; 3 * width(r)]).collect(),
            blocks: vec![Mat3::zeros(); joints * (2 * reach + 1)],
            right: vec![Vec3::zeros(); joints],
            mobility: vec![Mat3::zeros(); joints * (2 * reach + 1)],
            free: vec![Vec3::zeros(); joints],
            scratch: vec![0.0; n],
            ranges,
        }
    }

    /// Takes the contacts of the evaluation just made, where the present velocity carries them within the step.
    /// `visit(body, point, f)` as in [`super::stiff::Stiff::gather`].
    pub fn gather(
        &mut self,
        model: &Model,
        contacts: &Contacts,
        motion: &[Kinematics],
        visit: impl Fn(usize, &Vec3, &mut dyn FnMut(usize, Vec3, Vec3)),
    ) {
        self.touches.clear();
        let mut near = false;
        for (j, joint) in model.joints.iter().enumerate() {
            let gap = &contacts.gaps()[j];
            if joint.ideal.is_some() {
                continue;
            }
            let memory = contacts.memory()[j];
            if contacts.switching == Switching::Located && !memory.active {
                continue;
            }
            let distance = gap.eccentricity.norm();
            let penetration = distance - contacts.clearance(j);
            // Others may push a ball that is still free into its wall.
            if distance < NEAR * contacts.clearance(j) {
                continue;
            }
            near |= penetration > 0.0 || memory.active;
            let law = *contacts.coefficients(j);
            let normal = gap.eccentricity / distance;
            let rate = normal.dot(&gap.eccentricity_rate) - contacts.clearance_rate(j);
            let mut relative = gap.eccentricity_rate;
            if law.surface {
                let (ball, socket) = (&motion[joint.ball.body], &motion[joint.socket.body]);
                let radius = law.ball_radius;
                relative += ball.angular_velocity.cross(&(normal * radius))
                    - socket
                        .angular_velocity
                        .cross(&(normal * (radius + contacts.clearance(j))));
            }
            self.touches.push(Touch {
                joint: j,
                law,
                slip: memory.slip,
                approach: if memory.active {
                    memory.approach_speed
                } else {
                    rate.max(law.speed_floor)
                },
                normal,
                penetration,
                rate,
                sliding: relative - normal * normal.dot(&relative),
                start: gap.friction - normal * gap.normal_force,
                added: Vec3::zeros(),
                force: Vec3::zeros(),
                impedance: Mat3::zeros(),
            });
            collect_columns(
                &mut self.columns[j],
                contacts,
                motion,
                joint,
                j,
                &normal,
                &visit,
            );
        }
        if !near {
            self.touches.clear();
        }
    }

    /// Turns the accelerations `a` at the start of a step of size `h` into its mean accelerations. `mobilise(range, x)`
    /// maps generalised forces within a range of coordinates to accelerations, in place.
    pub fn correct(
        &mut self,
        h: f64,
        a: &mut [f64],
        mut mobilise: impl FnMut((usize, usize), &mut [f64]),
    ) {
        for touch in &self.touches {
            let j = touch.joint;
            let (first, end) = self.ranges[j];
            for i in 0..3 {
                self.scratch[first..end].fill(0.0);
                for column in &self.columns[j] {
                    self.scratch[column.coordinate] = column.surface[i];
                }
                mobilise((first, end), &mut self.scratch[..self.n]);
                for k in first..end {
                    self.weighted[j][3 * (k - first) + i] = self.scratch[k];
                }
            }
        }
        self.couple(h, a);
        for _ in 0..ITERATIONS {
            for touch in &mut self.touches {
                touch.evaluate(h);
            }
            self.solve(h);
            let (mut change, mut largest) = (0.0_f64, 0.0_f64);
            for i in 0..self.touches.len() {
                let added = self.free[i] + self.driven_by(i, h);
                let touch = &mut self.touches[i];
                let before = touch.force.dot(&touch.normal);
                let after = (touch.start + self.right[i]).dot(&touch.normal);
                change = change.max((after - before).abs());
                largest = largest.max(after.abs());
                touch.added = added;
            }
            if change <= CONVERGED * largest {
                break;
            }
        }
        // What the last iteration leaves must not pull.
        for (touch, p) in self.touches.iter().zip(&mut self.right) {
            if touch.normal.dot(&(touch.start + *p)) > 0.0 {
                *p = -touch.start;
            }
        }
        for (touch, p) in self.touches.iter().zip(&self.right) {
            let (first, end) = self.ranges[touch.joint];
            let weighted = self.weighted[touch.joint].chunks_exact(3);
            for (a, w) in a[first..end].iter_mut().zip(weighted) {
                *a += w[0] * p[0] + w[1] * p[1] + w[2] * p[2];
            }
        }
    }

    /// How the contacts move each other, and what the accelerations `a` add to their velocities.
    fn couple(&mut self, h: f64, a: &[f64]) {
        let m = self.touches.len();
        for i in 0..m {
            let touch = &self.touches[i];
            let columns = &self.columns[touch.joint];
            let w = |c: &Column| {
                if touch.law.surface {
                    c.surface
                } else {
                    c.centre
                }
            };
            for j in i.saturating_sub(self.reach)..=(i + self.reach).min(m - 1) {
                let other = self.touches[j].joint;
                let (first, end) = self.ranges[other];
                let mut mobility = Mat3::zeros();
                for c in columns {
                    if (first..end).contains(&c.coordinate) {
                        let x = &self.weighted[other][3 * (c.coordinate - first)..][..3];
                        mobility += w(c) * Vec3::new(x[0], x[1], x[2]).transpose();
                    }
                }
                let at = self.at(i, j);
                self.mobility[at] = mobility;
            }
            self.free[i] = columns
                .iter()
                .fold(Vec3::zeros(), |sum, c| sum + w(c) * (h * a[c.coordinate]));
        }
    }

    /// Place of block (i, j) in the band.
    fn at(&self, i: usize, j: usize) -> usize {
        i * (2 * self.reach + 1) + j + self.reach - i
    }

    /// Velocity that the changes of force in `right` add at touch `i`.
    fn driven_by(&self, i: usize, h: f64) -> Vec3 {
        let last = (i + self.reach).min(self.touches.len() - 1);
        (i.saturating_sub(self.reach)..=last).fold(Vec3::zeros(), |sum, j| {
            sum + self.mobility[self.at(i, j)] * self.right[j] * h
        })
    }

    /// Changes of the contact forces into `right`, by block elimination within the band.
    fn solve(&mut self, h: f64) {
        let (m, reach) = (self.touches.len(), self.reach);
        let at = |i: usize, j: usize| i * (2 * reach + 1) + j + reach - i;
        for (i, touch) in self.touches.iter().enumerate() {
            for j in i.saturating_sub(reach)..=(i + reach).min(m - 1) {
                let unit = if i == j {
                    Mat3::identity()
                } else {
                    Mat3::zeros()
                };
                self.blocks[at(i, j)] = unit - touch.impedance * self.mobility[at(i, j)] * h;
            }
            self.right[i] =
                touch.force - touch.start + touch.impedance * (self.free[i] - touch.added);
        }
        for k in 0..m {
            let last = (k + reach).min(m - 1);
            let inverse = self.blocks[at(k, k)]
                .try_inverse()
                .unwrap_or_else(|| Mat3::from_element(f64::NAN));
            self.blocks[at(k, k)] = inverse;
            for i in k + 1..=last {
                let factor = self.blocks[at(i, k)] * inverse;
                for j in k + 1..=last {
                    let upper = self.blocks[at(k, j)];
                    self.blocks[at(i, j)] -= factor * upper;
                }
                let above = self.right[k];
                self.right[i] -= factor * above;
            }
        }
        for k in (0..m).rev() {
            let mut sum = self.right[k];
            for j in k + 1..=(k + reach).min(m - 1) {
                sum -= self.blocks[at(k, j)] * self.right[j];
            }
            self.right[k] = self.blocks[at(k, k)] * sum;
        }
    }
}
