//! Contact forces at the end of a step: the implicit part of a semi-implicit step.
//!
//! The step is first taken without contact forces. Each joint then in contact couples with the coordinates through only three
//! directions. Let W be the Jacobian of the relative velocity at a contact and S that of its contact point. The velocities w
//! added by the contacts, and the contact forces f at the end of the step, satisfy w = h W M^-1 S^T f(w), which has three rows
//! per joint instead of one per coordinate, and Newton's method needs the mass matrix only once. The lever arms of the contact
//! points belong to a fixed normal, which is updated if it turns too far.

use super::MechanismError;
use super::band::Band;
use super::columns::{Column, collect_columns, contact_sides};
use super::contacts::Contacts;
use super::coupled::{CoupledRows, mobility_between, weigh};
use super::elements::{ActiveSet, Counts};
use super::equations::Equations;
use super::model::Model;
use crate::contact::{ApproachBranch, Coefficients, ContactState, Slope};
use crate::machine::{Mat3, Vec3};
use std::ops::Range;

/// Maximum number of Newton iterations, and the force change relative to the largest force at which they stop.
const ITERATIONS: usize = 24;
const CONVERGED: f64 = 1e-3;
/// Maximum number of successive halvings of a Newton step.
const HALVINGS: u32 = 3;
/// Eccentricity, as a fraction of the clearance, below which a ball is too far from the wall to be pushed into it.
const NEAR: f64 = 0.5;
/// Rotation of a normal (rad) beyond which its lever arms are updated.
const TURNED: f64 = 0.03;
/// Maximum number of passes with updated arms.
pub const TURNS: usize = 4;

/// A joint in contact at the end of the step, or one that others may push into contact.
struct Touch {
    joint: usize,
    law: Coefficients,
    contact_state: ContactState,
    /// Values without contact forces: eccentricity (m), its rate and the velocity used by friction (m/s).
    eccentricity: Vec3,
    rate: Vec3,
    read: Vec3,
    /// Velocities added by the contacts: of the centres, and used by friction, m/s.
    added: Vec3,
    slipping: Vec3,
    /// Normal to which the lever arms belong, and the latest normal.
    arm: Vec3,
    normal: Vec3,
    /// Force, N, and its derivatives with respect to the added velocities, N s/m.
    force: Vec3,
    impedance: Mat3,
    resistance: Mat3,
}

impl Touch {
    /// Force and its derivatives for the current added velocities, over a step of size `h`.
    fn evaluate(&mut self, h: f64, counts: &mut Counts) {
        let eccentricity = self.eccentricity + self.added * h;
        let rate = self.rate + self.added;
        let read = self.read + self.slipping;
        self.force = Vec3::zeros();
        self.impedance = Mat3::zeros();
        self.resistance = Mat3::zeros();
        let at = self.law.separation(&eccentricity, &rate);
        if at.penetration <= 0.0 {
            return;
        }
        self.normal = at.normal;
        let force = self.law.force(&self.contact_state, &at, || {
            counts.friction += 1;
            read
        });
        if force.normal <= 0.0 {
            return;
        }
        let slope = Slope::Secant;
        let stiffness = self.law.linearise(&self.contact_state, &at, &rate, &read, &force, slope);
        self.force = at.normal * -force.normal + force.friction;
        self.impedance = stiffness.by_displacement * h + stiffness.by_rate;
        self.resistance = stiffness.by_slip;
    }
}

/// Workspace of the implicit part, allocated once.
pub struct ImplicitContacts {
    /// Joint by joint.
    coupled: CoupledRows,
    band: Band,
    touches: Vec<Touch>,
    columns: Vec<Vec<Column>>,
    /// M^-1 S^T: three interleaved columns per joint over its range.
    weighted: Vec<Vec<f64>>,
    /// Block-banded matrix and its right-hand side.
    blocks: Vec<Mat3>,
    right: Vec<Vec3>,
    before: Vec<Vec3>,
    /// W M^-1 S^T in the same band, where W is for the centres and for the velocity used by friction.
    mobility: Vec<[Mat3; 2]>,
    scratch: Vec<f64>,
}

impl ImplicitContacts {
    /// For `n` velocity coordinates. With `blocks`, a force accelerates only the trees it acts on; otherwise all coordinates.
    ///
    /// # Errors
    /// The contacts are coupled too widely.
    pub fn new(model: &Model, n: usize, blocks: bool) -> Result<Self, MechanismError> {
        let joints = model.joints.len();
        let bodies = model.joints.iter().map(|joint| [joint.ball.body, joint.socket.body]);
        let coupled = CoupledRows::new(model, n, blocks, bodies)?;
        let (reach, width) = (coupled.reach, |range: &Range<usize>| range.len());
        Ok(Self {
            band: Band::with_room(joints, reach),
            touches: Vec::with_capacity(joints),
            columns: coupled.ranges.iter().map(|range| Vec::with_capacity(width(range))).collect(),
            weighted: coupled.ranges.iter().map(|range| vec![0.0; 3 * width(range)]).collect(),
            blocks: vec![Mat3::zeros(); Band::places(joints, reach)],
            right: Vec::with_capacity(joints),
            before: Vec::with_capacity(joints),
            mobility: vec![[Mat3::zeros(); 2]; Band::places(joints, reach)],
            scratch: vec![0.0; n],
            coupled,
        })
    }

    /// Collects the joints in contact from the gaps just measured at the end of the step without contact forces. Returns whether
    /// there are any.
    pub fn gather(&mut self, model: &Model, contacts: &Contacts, touching: ActiveSet<'_>) -> bool {
        self.touches.clear();
        self.right.clear();
        let mut near = false;
        for (j, joint) in model.joints.iter().enumerate() {
            let gap = contacts.gap(j);
            // Other contacts may push a ball that is still free into its wall.
            let distance = gap.eccentricity.norm();
            if joint.ideal.is_some() || distance < NEAR * contacts.clearance(j) {
                continue;
            }
            let Some(&contact_state) = touching.contact_state(j) else {
                continue;
            };
            near |= gap.separation.penetration > 0.0;
            let law = *contacts.coefficients(j);
            self.touches.push(Touch {
                joint: j,
                law,
                contact_state: if contact_state.active {
                    contact_state
                } else {
                    ContactState {
                        approach_branch: ApproachBranch::Held,
                        ..ContactState::at_onset(&law, gap.separation.rate)
                    }
                },
                eccentricity: gap.eccentricity,
                rate: gap.eccentricity_rate,
                read: gap.eccentricity_rate,
                added: Vec3::zeros(),
                slipping: Vec3::zeros(),
                arm: gap.separation.normal,
                normal: gap.separation.normal,
                force: Vec3::zeros(),
                impedance: Mat3::zeros(),
                resistance: Mat3::zeros(),
            });
        }
        near
    }

    /// Computes the Jacobian columns and sliding velocities of the contacts for the latest normals.
    pub fn arrange(&mut self, model: &Model, contacts: &Contacts, equations: &dyn Equations) {
        for touch in &mut self.touches {
            let (j, n) = (touch.joint, touch.normal);
            let joint = &model.joints[j];
            touch.arm = n;
            touch.read = contacts.slip_velocity(j, &n, equations.motion());
            let sides = contact_sides(joint, &touch.law);
            collect_columns(&mut self.columns[j], model, equations, &sides, &n);
        }
    }

    /// Computes the forces at the end of a step of size `h`, s. Returns whether a normal turned so far that its arms need an
    /// update.
    pub fn solve(&mut self, model: &Model, h: f64, equations: &mut dyn Equations, counts: &mut Counts) -> bool {
        for touch in &self.touches {
            let (j, range) = (touch.joint, &self.coupled.ranges[touch.joint]);
            weigh(model, equations, range, &self.columns[j], &mut self.scratch, &mut self.weighted[j]);
        }
        self.couple();
        // Start from the forces found with the previous arms, if any.
        self.right.resize(self.touches.len(), Vec3::zeros());
        let (mut worst, mut halvings) = (f64::INFINITY, 0);
        for _ in 0..ITERATIONS {
            let (mut off, mut largest) = (0.0_f64, 0.0_f64);
            counts.contacts += 1;
            for i in 0..self.touches.len() {
                let [added, slipping] = self.velocity_from_forces(i, h);
                let touch = &mut self.touches[i];
                (touch.added, touch.slipping) = (added, slipping);
                touch.evaluate(h, counts);
                off = off.max((touch.force - self.right[i]).norm());
                largest = largest.max(self.right[i].norm());
            }
            if off <= CONVERGED * largest {
                break;
            }
            if off < worst || halvings == HALVINGS {
                (worst, halvings) = (off, 0);
                self.before.clone_from(&self.right);
                self.eliminate(h);
            } else {
                // Overshoot: damping and the cut-off at 0 make the force law neither convex nor concave.
                halvings += 1;
                for (force, before) in self.right.iter_mut().zip(&self.before) {
                    *force = (*force + before) * 0.5;
                }
            }
        }
        let mut turned = false;
        for (touch, force) in self.touches.iter().zip(&mut self.right) {
            // Contact forces must not be tensile.
            if touch.normal.dot(force) > 0.0 {
                *force = Vec3::zeros();
            }
            turned |= (touch.normal - touch.arm).norm() > TURNED && *force != Vec3::zeros();
        }
        turned
    }

    /// Adds to `v` the velocity change due to the latest forces over a step of size `h`.
    pub fn push(&self, h: f64, v: &mut [f64]) {
        for (touch, force) in self.touches.iter().zip(&self.right) {
            let range = self.coupled.ranges[touch.joint].clone();
            let weighted = self.weighted[touch.joint].chunks_exact(3);
            for (v, w) in v[range].iter_mut().zip(weighted) {
                *v += h * (w[0] * force[0] + w[1] * force[1] + w[2] * force[2]);
            }
        }
    }

    /// Computes the mobility matrix that couples the contacts.
    fn couple(&mut self) {
        let Self { band, touches, coupled, .. } = self;
        band.arrange(touches.len(), coupled.reach, |i, j| coupled.meet(touches[i].joint, touches[j].joint));
        let band = &self.band;
        for i in 0..band.size() {
            let touch = &self.touches[i];
            let columns = &self.columns[touch.joint];
            let surface = touch.law.uses_surface_velocity() && touch.law.friction > 0.0;
            for j in band.row(i) {
                let other = self.touches[j].joint;
                let (weighted, range) = (&self.weighted[other], &self.coupled.ranges[other]);
                self.mobility[band.at(i, j)] = mobility_between(columns, weighted, range, surface);
            }
        }
    }

    /// Velocities added at touch `i` by the forces in `right`.
    fn velocity_from_forces(&self, i: usize, h: f64) -> [Vec3; 2] {
        let band = &self.band;
        let mut sum = [Vec3::zeros(); 2];
        for j in band.row(i) {
            let mobility = &self.mobility[band.at(i, j)];
            let impulse = self.right[j] * h;
            sum[0] += mobility[0] * impulse;
            sum[1] += mobility[1] * impulse;
        }
        sum
    }

    /// Contact forces of the next Newton iteration into `right`, by block elimination within the band.
    fn eliminate(&mut self, h: f64) {
        let band = &self.band;
        for (i, touch) in self.touches.iter().enumerate() {
            for j in band.row(i) {
                let unit = if i == j { Mat3::identity() } else { Mat3::zeros() };
                let [centre, felt] = &self.mobility[band.at(i, j)];
                self.blocks[band.at(i, j)] = unit - (touch.impedance * centre + touch.resistance * felt) * h;
            }
            self.right[i] = touch.force - touch.impedance * touch.added - touch.resistance * touch.slipping;
        }
        band.factor(&mut self.blocks);
        band.solve(&self.blocks, &mut self.right);
    }
}
