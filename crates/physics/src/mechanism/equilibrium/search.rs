//! Descent in the potential energy V to a position of rest.
//!
//! A step d minimises the second-order model of V(q + d) + |d|^2 / 2 tau, where |d|^2 is twice the kinetic energy of a machine with
//! unit masses: (G / tau + K) d = f, with its mass matrix G, the generalised forces f = -dV/dq and the stiffness matrix K =
//! -df/dq, both within the motions that the joints allow. tau is so small that G / tau + K is positive definite, so that every
//! step leads downhill, also where V is concave. It grows while the model predicts the energies, and the steps become those of
//! Newton's method: pseudo-transient continuation (Kelley & Keyes, SIAM J. Numer. Anal. 35, 1998, pp. 508-523) with the
//! acceptance of a trust-region method (Nocedal & Wright, Numerical Optimization, 2006, chapter 4).

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::reaches;
use crate::contact::ContactState;
use crate::integrate::System as _;
use crate::machine::{Machine, Vec3};
use crate::mechanism::constraints::Constraints;
use crate::mechanism::elements::{At, Counts, Loads, weight};
use crate::mechanism::kinematics::{Kinematics, Wrench};
use crate::mechanism::lu::Lu;
use crate::mechanism::model::{Body, Model, Motion};
use crate::mechanism::start::{CLOSED, factor_at};
use crate::mechanism::tree::{Tree, visit_columns};
use crate::mechanism::{ActiveSet, Mechanism};

/// Maximum number of steps; of evaluations in all, at least one for each coordinate in a step; and of such evaluations times
/// coordinates, for small machines: some seconds.
const MAX_STEPS: usize = 4000;
const MAX_EVALUATIONS: usize = 50_000;
const MAX_WORK: usize = 3_000_000;
/// Number of successive steps without much progress after which a search ends if it is close to a rest.
const PATIENCE: usize = 10;
/// Maximum number of corrections of a step: bodies that move along a wall leave it by the curvature of their path, and each
/// correction takes two thirds of a penetration back.
const MAX_CORRECTIONS: usize = 12;
/// Largest displacement for differences, over the length scale and over the size of the machine, whichever is less; its ratio to
/// the depth of a contact, and the smallest one over the largest.
const DIFFERENCE: (f64, f64) = (1e-7, 1e-8);
const OF_DEPTH: f64 = 0.05;
const FINEST: f64 = 1e-3;
/// Largest turn in one step, rad, and largest shift over the size of the machine; both of the first step are a hundredth.
const MAX_TURN: f64 = 0.3;
const MAX_SHIFT: f64 = 0.1;
const FIRST_STEP: f64 = 0.01;
/// Factors by which tau changes, and its bounds, over the inverse of the largest stiffness.
const GROWTH: (f64, f64) = (4.0, 100.0);
const CUT: f64 = 0.25;
const TAU: (f64, f64) = (1e-15, 1e13);
/// Fractions of the predicted fall of the energy that a step must achieve, and at which tau grows and is cut.
const ACCEPTED: f64 = 0.1;
const GOOD: f64 = 0.75;
const POOR: f64 = 0.25;
/// Bound of the rounding error of a sum over the machine, over the machine epsilon.
const ROUNDING: f64 = 64.0;
/// A search that cannot go on has found a rest if the unbalanced forces are this fraction of those that act, or if Newton's method
/// would move by this fraction of the largest step: where balls barely touch, all forces vanish.
const BALANCED: f64 = 1e-6;
const NEGLIGIBLE: f64 = 1e-9;
/// The first of these fractions for a search that makes little progress.
const CLOSELY_BALANCED: f64 = 1e-9;

/// The machine at a position.
pub(super) struct Pose {
    pub state: Vec<f64>,
    /// Accelerations of the coordinates with unit masses: G^-1 f.
    pub accelerations: DVector<f64>,
    /// Energy stored in contacts and elements, J.
    stored: f64,
    motion: Vec<Kinematics>,
}

/// Derivatives at a pose. Directions that would open joints have no stiffness.
pub(super) struct Linearisation {
    /// Derivatives of the accelerations along every coordinate.
    columns: DMatrix<f64>,
    /// G and the symmetric part of K.
    pub metric: DMatrix<f64>,
    pub stiffness: DMatrix<f64>,
    /// Rounding errors of the generalised forces, and the forces that act along each coordinate regardless of their signs.
    noise: DVector<f64>,
    acting: DVector<f64>,
    /// Largest stiffness over the metric, 1/s^2; at least that which would balance the forces within a step.
    pub stiffest: f64,
    /// Smallest displacement for differences, m.
    pub finest: f64,
    /// Distance of the farthest point from the world's origin, m, to which rounding errors of positions are proportional.
    pub farthest: f64,
}

impl Linearisation {
    /// Whether the model of a step with `tau` has a minimum, with a margin for rounding.
    fn is_convex(&self, tau: f64) -> bool {
        (&self.metric * (0.5 / tau) + &self.stiffness).cholesky().is_some()
    }

    /// Largest ratio of a generalised force at `pose` to its rounding error, and to the forces that act.
    fn imbalance(&self, pose: &Pose) -> (f64, f64) {
        let forces = self.metric.tr_mul(&pose.accelerations);
        let ratio = |of: &DVector<f64>| {
            let ratios = forces.iter().zip(of).filter(|(force, _)| **force != 0.0);
            // Unlike `max`, this propagates NaN.
            ratios.map(|(force, of)| force.abs() / of).fold(0.0, |most, ratio| if ratio <= most { most } else { ratio })
        };
        (ratio(&self.noise), ratio(&self.acting))
    }

    /// Generalised force along `direction` at `pose`; 0 if it may be a rounding error.
    pub fn force_along(&self, pose: &Pose, direction: &DVector<f64>) -> f64 {
        let force = self.metric.tr_mul(&pose.accelerations).dot(direction);
        if force.abs() > self.noise.dot(&direction.abs()) { force } else { 0.0 }
    }
}

/// The search for a position of rest.
pub(super) struct Search<'a> {
    mechanism: &'a mut Mechanism,
    pub model: Arc<Model>,
    tree: Tree,
    /// Of the joints without play that close loops.
    constraints: Option<Constraints>,
    contact_states: Vec<ContactState>,
    derivative: Vec<f64>,
    lu: Lu<f64>,
    /// Of each body, m.
    reaches: Vec<f64>,
    /// Largest shift of a step, and largest displacement for differences, m.
    largest_shift: f64,
    pub difference: f64,
    /// Bound of the rounding error of an energy, J.
    pub(crate) energy_noise: f64,
    evaluations: usize,
}

impl<'a> Search<'a> {
    /// The search for a rest of `machine`; `mechanism` has its equations with unit masses and without gravity, `state` a position.
    pub fn new(machine: &Machine, mechanism: &'a mut Mechanism, state: &[f64]) -> Self {
        for (body, own) in machine.bodies.iter().enumerate() {
            mechanism.elements.push(weight(body, machine.gravity * own.mass));
        }
        let model = mechanism.model.clone();
        let mut tree = Tree::new(&model);
        let constraints = model.closes_loops().then(|| {
            let mut constraints = Constraints::new(&model, &model.ideal_joints);
            if let Some(rank) = model.assembled.get().and_then(|assembled| assembled.rank) {
                constraints.treat_as_dependent(rank);
            }
            constraints
        });
        tree.update_kinematics(&model, 0.0, state);
        let points = machine.points().map(|point| {
            let anchor = model.anchor(machine, &point);
            let body = &tree.motion[anchor.body];
            body.position + body.rotation * anchor.offset
        });
        let corners = points.map(|point| (point, point)).reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)));
        let size = corners.map_or(0.0, |(least, most)| (most - least).norm());
        let scale = machine.length_scale();
        let size = if size > 0.0 { size } else { scale };
        Self {
            reaches: reaches(machine),
            largest_shift: MAX_SHIFT * size,
            difference: (DIFFERENCE.0 * scale).min(DIFFERENCE.1 * size),
            energy_noise: 0.0,
            evaluations: 0,
            tree,
            constraints,
            contact_states: vec![ContactState::default(); model.sites.len()],
            derivative: vec![0.0; model.nq + model.nv],
            lu: Lu::new(model.nv),
            model,
            mechanism,
        }
    }

    /// Descends from the position `state` to a rest; otherwise returns where the search ended.
    pub fn descend(&mut self, state: Vec<f64>) -> Result<Vec<f64>, Vec<f64>> {
        let mut pose = self.pose(state);
        let (mut tau, mut last, mut slow) = (None, f64::INFINITY, 0);
        for _ in 0..MAX_STEPS {
            if self.evaluations > MAX_EVALUATIONS.max(MAX_WORK / self.model.nv) {
                break;
            }
            let linear = self.linearise(&pose);
            let (over_noise, over_acting) = linear.imbalance(&pose);
            let stagnates = over_noise > 0.5 * last;
            if over_noise * ROUNDING <= 1.0 || (over_noise <= 1.0 && stagnates) {
                return Ok(pose.state);
            }
            slow = if stagnates { slow + 1 } else { 0 };
            if slow >= PATIENCE && (over_acting <= CLOSELY_BALANCED || self.hardly_moves(&pose, &linear)) {
                return Ok(pose.state);
            }
            last = over_noise;
            if !(linear.stiffest > 0.0 && over_acting.is_finite()) {
                return Err(pose.state);
            }
            let unit = 1.0 / linear.stiffest;
            let first = || FIRST_STEP / self.excess(pose.accelerations.as_slice());
            let mut trial_tau = tau.unwrap_or_else(first).clamp(TAU.0 * unit, TAU.1 * unit);
            let next = loop {
                if !(trial_tau >= TAU.0 * unit) {
                    break None;
                }
                if let Some(step) = linear.is_convex(trial_tau).then(|| self.step(&pose, &linear, trial_tau)).flatten()
                {
                    break Some(step);
                }
                trial_tau *= CUT;
            };
            match next {
                Some((next, growth)) => {
                    pose = next;
                    tau = Some(growth * trial_tau);
                }
                // No step leads farther down.
                None if over_noise <= 1.0 || over_acting <= BALANCED => return Ok(pose.state),
                None if self.hardly_moves(&pose, &linear) => return Ok(pose.state),
                None => return Err(pose.state),
            }
        }
        Err(pose.state)
    }

    /// Whether Newton's method would hardly move from `pose`.
    fn hardly_moves(&mut self, pose: &Pose, linear: &Linearisation) -> bool {
        let mut tau = TAU.1 / linear.stiffest;
        while tau >= TAU.0 / linear.stiffest && !linear.is_convex(tau) {
            tau *= CUT;
        }
        let step = self.newton_step(pose, linear, tau);
        self.excess(step.as_slice()) <= NEGLIGIBLE
    }
}

impl Search<'_> {
    /// The machine at `state`.
    pub fn pose(&mut self, state: Vec<f64>) -> Pose {
        self.evaluations += 1;
        let mut evaluator = self.mechanism.evaluator(ActiveSet::Immediate(&self.contact_states));
        evaluator.derivative(0.0, &state, &mut self.derivative);
        Pose {
            accelerations: DVector::from_column_slice(&self.derivative[self.model.nq..]),
            stored: self.mechanism.elastic_energy(0.0),
            motion: self.mechanism.motion().to_vec(),
            state,
        }
    }

    /// The machine where the displacement `step`, which the joints allow, leads from `pose`; `None` if they do not close there.
    pub fn displaced(&mut self, pose: &Pose, step: &DVector<f64>) -> Option<Pose> {
        let mut state = pose.state.clone();
        Tree::displace(&self.model, &mut state, step.as_slice());
        Tree::normalise(&self.model, &mut state);
        if let Some(constraints) = &mut self.constraints {
            let error = constraints.project(&self.model, &mut self.tree, 0.0, &mut state);
            state[self.model.nq..].fill(0.0);
            if !(error <= CLOSED) {
                return None;
            }
        }
        Some(self.pose(state))
    }

    /// Rise of the potential energy from one pose to another, J.
    pub fn rise(&self, from: &Pose, to: &Pose) -> f64 {
        let works = self.mechanism.elements.iter().map(|element| element.work(0.0, [&from.motion, &to.motion]));
        to.stored - from.stored - works.sum::<f64>()
    }

    /// The solution of (G / tau + K) d = f at `pose`.
    fn newton_step(&mut self, pose: &Pose, linear: &Linearisation, tau: f64) -> DVector<f64> {
        self.factor(&linear.columns, tau);
        let mut step = pose.accelerations.clone();
        self.lu.solve(step.as_mut_slice());
        step
    }

    /// Factors I / tau - A, where A has the derivatives of the accelerations as `columns`.
    fn factor(&mut self, columns: &DMatrix<f64>, tau: f64) {
        let nv = self.model.nv;
        let entries = columns.iter().enumerate().map(|(k, x)| (k % nv, k / nv, -x));
        self.lu.factor(nv, entries.filter(|(.., x)| *x != 0.0), 1.0 / tau);
    }

    /// A step from `pose` that lowers the energy, and the factor by which tau then changes; `None` if there is none.
    fn step(&mut self, pose: &Pose, linear: &Linearisation, tau: f64) -> Option<(Pose, f64)> {
        let mut moved = self.newton_step(pose, linear, tau);
        if !(self.excess(moved.as_slice()) <= 1.0) {
            return None;
        }
        let metric = |a: &DVector<f64>, b: &DVector<f64>| linear.metric.tr_mul(b).dot(a);
        let length = |a: &DVector<f64>| metric(a, a).sqrt();
        // Half the work of the forces, plus the part of the model that belongs to tau.
        let fall = 0.5 * (metric(&pose.accelerations, &moved) + metric(&moved, &moved) / tau);
        let before = length(&pose.accelerations);
        let mut last = length(&moved);
        for correction in 0..=MAX_CORRECTIONS {
            let next = self.displaced(pose, &moved)?;
            let rise = self.rise(pose, &next);
            let after = length(&next.accelerations);
            let is_noise = fall <= self.energy_noise && rise <= self.energy_noise;
            if -rise >= ACCEPTED * fall || (is_noise && after < before) {
                let growth = match -rise / fall {
                    _ if correction > 0 => 1.0,
                    achieved if is_noise || achieved > GOOD => (before / after).clamp(GROWTH.0, GROWTH.1),
                    achieved if achieved < POOR => CUT,
                    _ => 1.0,
                };
                return Some((next, growth));
            }
            // Newton's method for the minimum of V + |d|^2 / 2 tau, with the same matrix while that converges.
            let residual = &next.accelerations - &moved / tau;
            let mut change = residual.clone();
            self.lu.solve(change.as_mut_slice());
            let mut size = length(&change);
            if !(size <= 0.5 * last) {
                let columns = self.linearise(&next).columns;
                self.factor(&columns, tau);
                change = residual;
                self.lu.solve(change.as_mut_slice());
                size = length(&change);
                if !(size <= length(&moved)) {
                    return None;
                }
            }
            last = size;
            moved += change;
        }
        None
    }

    /// Derivatives at `pose`.
    pub fn linearise(&mut self, pose: &Pose) -> Linearisation {
        let nv = self.model.nv;
        let jacobians = self.jacobians(&pose.motion);
        let mut metric = DMatrix::zeros(nv, nv);
        for (columns, reach) in jacobians.iter().zip(&self.reaches) {
            for (i, v, w) in columns {
                for (j, other_v, other_w) in columns {
                    metric[(*i, *j)] += v.dot(other_v) + reach * reach * w.dot(other_w);
                }
            }
        }
        let differences = self.differences(pose, &jacobians);
        let mut columns = DMatrix::zeros(nv, nv);
        for j in 0..nv {
            let size = differences[j] / f64::sqrt(metric[(j, j)]);
            let mut step = DVector::zeros(nv);
            step[j] = size;
            self.project(pose, step.as_mut_slice());
            // The step is so small that it opens the joints by less than rounding errors.
            let mut displaced = pose.state.clone();
            Tree::displace(&self.model, &mut displaced, step.as_slice());
            let mut change = (self.pose(displaced).accelerations - &pose.accelerations) / size;
            self.project(pose, change.as_mut_slice());
            columns.set_column(j, &change);
        }
        // `tr_mul` rather than a product: the library's product differs between processors in the last bits.
        let stiffness = metric.tr_mul(&columns);
        let stiffness = (&stiffness + stiffness.transpose()) * -0.5;
        let acting = self.acting_forces(pose, &jacobians);
        let distance = pose.motion.iter().zip(&self.reaches).map(|(body, reach)| body.position.norm() + reach);
        let farthest = distance.fold(0.0, f64::max);
        let widths = metric.diagonal().map(|width| farthest / width.sqrt());
        let noise = (stiffness.abs().tr_mul(&widths) + &acting) * (ROUNDING * f64::EPSILON);
        self.energy_noise = ROUNDING * f64::EPSILON * (pose.stored.abs() + acting.dot(&widths));
        let balance = metric.tr_mul(&pose.accelerations).dot(&pose.accelerations).sqrt() / self.largest_shift;
        let over_metric = stiffness.diagonal().component_div(&metric.diagonal());
        let stiffest = over_metric.fold(balance, |most, k| k.abs().max(most));
        let finest = differences.min();
        Linearisation { columns, metric, stiffness, noise, acting, stiffest, finest, farthest }
    }

    /// Displacement for differences along each coordinate, m: less than the depth of the contacts of the bodies that it moves.
    fn differences(&mut self, pose: &Pose, jacobians: &[Vec<(usize, Vec3, Vec3)>]) -> DVector<f64> {
        // The gaps are those of the latest evaluation.
        self.pose(pose.state.clone());
        let mut differences = DVector::from_element(self.model.nv, self.difference);
        for (site, gap) in self.model.sites.iter().zip(self.mechanism.contacts.gaps()) {
            let depth = gap.separation.penetration;
            let ends = [site.carried.body, site.carrier.body].map(|body| jacobians.get(body));
            for (j, ..) in ends.into_iter().flatten().flatten().filter(|_| depth > 0.0) {
                differences[*j] = differences[*j].min((OF_DEPTH * depth).max(FINEST * self.difference));
            }
        }
        differences
    }

    /// Coordinates that move each body, with the velocity of its centroid and its angular velocity per unit rate.
    fn jacobians(&self, motion: &[Kinematics]) -> Vec<Vec<(usize, Vec3, Vec3)>> {
        let model = &self.model;
        let of = |body: usize| {
            let mut columns = Vec::new();
            if !model.bodies[body].driven_only {
                let first = model.blocks[model.block_of[body]].v;
                visit_columns(model, motion, body, &motion[body].position, |c, v, w| columns.push((first + c, v, w)));
            }
            columns
        };
        (0..model.massive).map(of).collect()
    }

    /// Sums of the magnitudes of all forces along each coordinate at `pose`.
    fn acting_forces(&mut self, pose: &Pose, jacobians: &[Vec<(usize, Vec3, Vec3)>]) -> DVector<f64> {
        // Reactions and contact forces are those of the latest evaluation.
        self.pose(pose.state.clone());
        let mechanism = &mut *self.mechanism;
        let mut sums = vec![[0.0; 2]; pose.motion.len()];
        for (j, joint) in self.model.joints.iter().enumerate() {
            let contacts = joint.contacts.clone().map(|c| mechanism.contacts.gap(c).normal_force).sum();
            let force: f64 = mechanism.reaction(j).map_or(contacts, |reaction| reaction.norm());
            for body in [joint.carried.body, joint.carrier.body] {
                sums[body][0] += force;
            }
        }
        for (pair, [force, torque]) in self.model.closures.iter().zip(mechanism.closing_loads()) {
            for body in [pair.child.body, pair.parent.body] {
                sums[body][0] += force.norm();
                sums[body][1] += torque.norm();
            }
        }
        let mut wrench = vec![Wrench::zero(); pose.motion.len()];
        let at = At { t: 0.0, motion: &pose.motion, active_set: ActiveSet::Nothing, bristles: &[] };
        for element in &mut mechanism.elements {
            wrench.fill(Wrench::zero());
            let mut counts = Counts::default();
            element.load(&at, &mut Loads { wrench: &mut wrench, counts: &mut counts, has_left_branch: &mut [] });
            for (sum, load) in sums.iter_mut().zip(&wrench) {
                sum[0] += load.force.norm();
                sum[1] += load.torque.norm();
            }
        }
        let mut acting = DVector::zeros(self.model.nv);
        for ((columns, [force, torque]), reach) in jacobians.iter().zip(&sums).zip(&self.reaches) {
            for (j, v, w) in columns {
                acting[*j] += v.norm() * force + w.norm() * (torque + reach * force);
            }
        }
        acting
    }

    /// Removes the part of the displacement or acceleration `step` at `pose` that would open the joints.
    pub fn project(&mut self, pose: &Pose, step: &mut [f64]) {
        if let Some(constraints) = &mut self.constraints {
            factor_at(&self.model, constraints, &mut self.tree, 0.0, &pose.state);
            constraints.project_accelerations(&self.model, step);
        }
    }

    /// Largest ratio of a component of the displacement `step` to the limit of one step.
    pub fn excess(&self, step: &[f64]) -> f64 {
        let shift = |part: &f64| part.abs() / self.largest_shift;
        let turn = |part: &f64| part.abs() / MAX_TURN;
        // Unlike `max`, this propagates NaN.
        let greater = |most: f64, ratio: f64| if ratio <= most { most } else { ratio };
        let most = |parts: &[f64], over: &dyn Fn(&f64) -> f64| parts.iter().map(over).fold(0.0, greater);
        let of_body = |body: &Body| match body.motion {
            Motion::Free { v, .. } => greater(most(&step[v..v + 3], &shift), most(&step[v + 3..v + 6], &turn)),
            Motion::Prismatic { v, .. } => shift(&step[v]),
            Motion::Revolute { v, .. } => turn(&step[v]),
            Motion::Fixed | Motion::Driven { .. } => 0.0,
        };
        self.model.bodies.iter().map(of_body).fold(0.0, greater)
    }
}
