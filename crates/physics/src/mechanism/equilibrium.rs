//! Start in static equilibrium: every force of springs, bushings, tyres, stops, contacts and gravity in balance, at the values
//! that drives, targets, grounds and load factors have at t = 0. Friction is zero, because nothing slides.
//!
//! The rest position is a zero of the accelerations a(q) of the machine without velocities. It is found along the flow
//! dq/ds = a(q), which leads downhill in the potential energy (dV/ds = -a' M a), by implicit Euler steps d / tau = a(q + d),
//! solved by Newton's method. While the forces fall, tau grows, and the steps become those of Newton's method for a = 0:
//! pseudo-transient continuation (Kelley & Keyes, SIAM J. Numer. Anal. 35, 1998, pp. 508-523).

use std::sync::Arc;

use super::assembly::Settled;
use super::constraints::Constraints;
use super::drives::{Trajectory, trajectory_of};
use super::lu::Lu;
use super::model::{Body, Model, Motion};
use super::settled::{settle, without_play};
use super::start::{CLOSED, factor_at};
use super::tree::Tree;
use super::{ActiveSet, Mechanism, MechanismError};
use crate::contact::ContactState;
use crate::integrate::System as _;
use crate::machine::{BallJoint, Drive, ElementKind, Formulation, Machine, StartRule};

/// Maximum number of velocity coordinates: the derivative of the accelerations is taken by differences and is dense.
const MAX_COORDINATES: usize = 400;
/// Maximum number of iterations of all steps, those that are repeated with a smaller tau included, and of evaluations, one for
/// each coordinate in an iteration: some seconds.
const MAX_STEPS: usize = 1000;
const MAX_EVALUATIONS: usize = 50_000;
/// Maximum number of iterations of a step: bodies that move along a wall leave it by the curvature of their path, and each
/// iteration takes two thirds of a penetration back. Steps with more than a few are not made longer.
const MAX_CORRECTIONS: usize = 12;
const FEW_CORRECTIONS: usize = 6;
/// Displacement for differences, as a time at the scales' speeds, s: 1e-9 m with balls of 10 mm, 1e-8 rad.
const DIFFERENCE: f64 = 1e-8;
/// Largest turn in one iteration, rad, and largest shift over the length scale and over the size of the machine, whichever is
/// more.
const MAX_TURN: f64 = 0.3;
const MAX_SHIFT: (f64, f64) = (3.0, 0.1);
/// First tau, the bounds within which it changes, s^2, and the factors by which it does.
const FIRST_TAU: f64 = 1e-4;
const TAU: (f64, f64) = (1e-20, 1e3);
const GROWTH: (f64, f64) = (2.0, 100.0);
const CUT: f64 = 0.25;
/// Smallest tau, s^2, at which the length of a step measures the distance from rest. Parts that oscillate more slowly than 1
/// rad/s need a larger one.
const CONVERGENCE_TAU: f64 = 1.0;
/// Factor by which the accelerations may grow in a step, and the fraction of those of gravity that may be rounding.
const RISE: f64 = 2.0;
const NOISE: f64 = 1e-5;
/// Displacements of a step at which the search ends, as times at the scales' speeds, s: that of the last step, which is 1e-12 of
/// the length scale; the largest one of steps that no longer become shorter because of rounding; and the same with the largest
/// tau, at which parts without a restoring force drift.
const AT_REST: f64 = 1e-13;
const ROUNDING: f64 = 2e-9;
const DRIFT: f64 = 1e-8;

/// Start in equilibrium of `machine` at t = 0. The tree coordinates `near`, if given, replace its start values.
///
/// First finds the rest of the machine without play. Then places the balls on their walls where its reactions press them, and
/// continues the search from there: far from rest, balls that slide along their walls would limit the steps.
///
/// # Errors
/// The machine has no settled start, has too many coordinates, or no position of rest is found.
pub(super) fn rest_state(machine: &Machine, near: Option<&[f64]>) -> Result<Settled, MechanismError> {
    let Settled { mut state, assembly } = settle(machine, near)?;
    let mut constant = with_constant_laws(machine);
    constant.formulation = Formulation::Tree;
    let play = |joint: &BallJoint| joint.contact.clearance > 0.0;
    if constant.ball_joints.iter().any(play) {
        let ideal = without_play(&constant);
        // If there is no rest without play, the search with play reports where it ended.
        if let Ok(rests) = rest_state_near(&ideal, state.clone()) {
            state = settle(&constant, Some(&rests))?.state;
        }
    }
    constant.start = StartRule::AsGiven;
    Ok(Settled { state: rest_state_near(&constant, state)?, assembly })
}

/// State of rest of `machine`, whose laws are constant, near the tree coordinates `state`.
pub(super) fn rest_state_near(machine: &Machine, mut state: Vec<f64>) -> Result<Vec<f64>, MechanismError> {
    let Model { nq, nv, .. } = Model::new(machine);
    if nv > MAX_COORDINATES {
        return Err(MechanismError::TooLargeForRest { velocities: nv, most: MAX_COORDINATES });
    }
    state[nq..].fill(0.0);
    let mut mechanism = Mechanism::with_guess(machine, Some(&state))?;
    let state = mechanism.start_off_path()?;
    let found = Search::new(&mut mechanism).find(state);
    found.map_err(|fastest_body| MechanismError::NoRest {
        body: machine.bodies[fastest_body.body].name.clone(),
        acceleration: fastest_body.acceleration,
        angular_acceleration: fastest_body.angular_acceleration,
    })
}

/// `machine` with the values that every law has at t = 0.
pub(super) fn with_constant_laws(machine: &Machine) -> Machine {
    let mut constant = machine.clone();
    let functions = machine.closed_form.as_ref().map_or(Vec::new(), |form| form.at(0.0));
    let hold = |drive: &mut Drive, turns: bool| {
        let trajectory = trajectory_of(drive, turns);
        let position = match &trajectory {
            Trajectory::Function(function) => functions[function + 1].value,
            Trajectory::Own(law) => law.at(0.0).value,
        };
        *drive = Drive::Constant { position, velocity: 0.0 };
    };
    constant.closed_form = None;
    for joint in &mut constant.joints {
        let freedoms = joint.kind.freedoms();
        let drives = [&mut joint.drive, &mut joint.second_drive];
        for (drive, freedom) in drives.into_iter().zip(freedoms) {
            drive.iter_mut().for_each(|drive| hold(drive, freedom.turns()));
        }
    }
    for element in &mut constant.elements {
        let turns = element.is_on_hinge();
        let law = match &mut element.kind {
            ElementKind::Load(load) => &mut load.factor,
            ElementKind::Motor(motor) => &mut motor.target,
            ElementKind::Tyre(tyre) => &mut tyre.ground,
            ElementKind::Spring(_) | ElementKind::JointSpring(_) | ElementKind::Stop(_) | ElementKind::Bushing(_) => {
                continue;
            }
        };
        law.iter_mut().for_each(|law| hold(law, turns));
    }
    constant
}

/// The body with the largest accelerations, m/s^2 and rad/s^2, where no position of rest was found.
struct FastestBody {
    body: usize,
    acceleration: f64,
    angular_acceleration: f64,
}

/// The search for the rest position.
struct Search<'a> {
    mechanism: &'a mut Mechanism,
    model: Arc<Model>,
    tree: Tree,
    /// Of the joints without play that close loops.
    constraints: Option<Constraints>,
    contact_states: Vec<ContactState>,
    derivative: Vec<f64>,
    /// Columns of da/dq.
    columns: Vec<Vec<f64>>,
    lu: Lu<f64>,
}

impl<'a> Search<'a> {
    fn new(mechanism: &'a mut Mechanism) -> Self {
        let model = mechanism.model.clone();
        let tree = Tree::new(&model);
        let constraints = model.closes_loops().then(|| {
            let mut constraints = Constraints::new(&model, &model.ideal_joints);
            if let Some(rank) = model.assembled.get().and_then(|assembled| assembled.rank) {
                constraints.treat_as_dependent(rank);
            }
            constraints
        });
        Self {
            tree,
            constraints,
            contact_states: vec![ContactState::default(); model.joints.len()],
            derivative: vec![0.0; model.nq + model.nv],
            columns: Vec::new(),
            lu: Lu::new(model.nv),
            model,
            mechanism,
        }
    }

    /// The state of rest near `y`.
    fn find(&mut self, mut y: Vec<f64>) -> Result<Vec<f64>, FastestBody> {
        let nv = self.model.nv;
        if nv == 0 {
            return Ok(y);
        }
        let mut start = vec![0.0; nv];
        self.accelerate(&y, &mut start);
        let mut size = self.size(&start);
        let largest_shift = (MAX_SHIFT.0 * self.model.length_scale).max(MAX_SHIFT.1 * self.extent());
        let fall = self.mechanism.gravity.norm() / self.model.speed_scale();
        let noise = NOISE * size.max(fall);
        let (mut tau, mut last) = (FIRST_TAU, f64::INFINITY);
        // Within a step: the current iterate, its displacement from the start of the step, and the accelerations there.
        let (mut trial, mut moved, mut accelerations) = (y.clone(), vec![0.0; nv], start.clone());
        let mut iterations = 0;
        for _ in 0..MAX_STEPS.min(MAX_EVALUATIONS / nv) {
            self.linearise(&trial, &accelerations);
            let mut step: Vec<f64> = accelerations.iter().zip(&moved).map(|(a, moved)| a - moved / tau).collect();
            self.solve(tau, &mut step);
            self.project_step(&trial, &mut step);
            let length = self.size(&step);
            let stagnates = length <= if tau >= TAU.1 { DRIFT } else { ROUNDING } && length >= 0.5 * last;
            if iterations == 0 && tau >= CONVERGENCE_TAU && (length <= AT_REST || stagnates) {
                return Ok(y);
            }
            let cut = (1.0 / self.excess(&step, largest_shift)).min(1.0);
            step.iter_mut().for_each(|part| *part *= cut);
            let is_closed = length.is_finite() && self.displace(&mut trial, &step);
            moved.iter_mut().zip(&step).for_each(|(moved, part)| *moved += part);
            self.accelerate(&trial, &mut accelerations);
            let new_size = self.size(&accelerations);
            iterations += 1;
            // Far from rest, a ball may leave its wall and fall freely.
            let slack = if tau >= CONVERGENCE_TAU { noise } else { fall };
            let diverges = iterations > 1 && length > self.size(&moved);
            if is_closed && new_size <= RISE * size + slack {
                // A step that needed many corrections, or in which the accelerations grew, is not made longer.
                let growth = match size / new_size.max(f64::MIN_POSITIVE) {
                    _ if iterations > FEW_CORRECTIONS => 1.0,
                    _ if new_size == 0.0 => GROWTH.1,
                    fall if fall > 0.8 => fall.clamp(GROWTH.0, GROWTH.1),
                    fall if fall * RISE > 1.0 => 1.0,
                    _ => CUT,
                };
                tau = (growth * tau).clamp(TAU.0, TAU.1);
                (size, last) = (new_size, self.size(&moved));
                y.clone_from(&trial);
                start.clone_from(&accelerations);
            } else if is_closed && new_size.is_finite() && !diverges && iterations < MAX_CORRECTIONS {
                continue;
            } else {
                tau = (CUT * tau).max(TAU.0);
                trial.clone_from(&y);
                accelerations.clone_from(&start);
            }
            moved.fill(0.0);
            iterations = 0;
        }
        Err(self.fastest_body(&y))
    }

    /// Solves (I / tau - da/dq) x = b in place.
    fn solve(&mut self, tau: f64, b: &mut [f64]) {
        let columns = self.columns.iter().enumerate();
        let entries = columns.flat_map(|(j, column)| column.iter().enumerate().map(move |(i, x)| (i, j, -x)));
        self.lu.factor(b.len(), entries, 1.0 / tau);
        self.lu.solve(b);
    }

    /// Diagonal of the box around the centroids at the latest evaluation, m.
    fn extent(&self) -> f64 {
        let places = || self.mechanism.motion()[..self.model.massive].iter().map(|body| body.position);
        let most = places().reduce(|a, b| a.sup(&b)).unwrap_or_default();
        let least = places().reduce(|a, b| a.inf(&b)).unwrap_or_default();
        (most - least).norm()
    }

    /// Largest ratio of a component of the displacement `step` to the limit of one iteration; `largest_shift`, m, limits shifts.
    fn excess(&self, step: &[f64], largest_shift: f64) -> f64 {
        let shift = |part: &f64| part.abs() / largest_shift;
        let turn = |part: &f64| part.abs() / MAX_TURN;
        let most = |parts: &[f64], over: &dyn Fn(&f64) -> f64| parts.iter().map(over).fold(0.0, f64::max);
        let of_body = |body: &Body| match body.motion {
            Motion::Free { v, .. } => most(&step[v..v + 3], &shift).max(most(&step[v + 3..v + 6], &turn)),
            Motion::Prismatic { v, .. } => shift(&step[v]),
            Motion::Revolute { v, .. } => turn(&step[v]),
            Motion::Fixed | Motion::Driven { .. } => 0.0,
        };
        self.model.bodies.iter().map(of_body).fold(0.0, f64::max)
    }

    /// Largest part of a displacement, velocity or acceleration, over the scales' speeds.
    fn size(&self, parts: &[f64]) -> f64 {
        let scales = &self.model.scale[self.model.nq..];
        let sizes = parts.iter().zip(scales).map(|(part, scale)| (part / scale).abs());
        // Unlike `max`, this propagates NaN.
        sizes.fold(0.0, |most, size| if size <= most { most } else { size })
    }

    /// Accelerations at the positions in `y`, without velocities.
    fn accelerate(&mut self, y: &[f64], out: &mut [f64]) {
        let mut evaluator = self.mechanism.evaluator(ActiveSet::Immediate(&self.contact_states));
        evaluator.derivative(0.0, y, &mut self.derivative);
        out.copy_from_slice(&self.derivative[self.model.nq..]);
    }

    /// Derivatives of the accelerations along every coordinate, as far as the joints can move that way.
    fn linearise(&mut self, y: &[f64], accelerations: &[f64]) {
        let nv = self.model.nv;
        self.columns.resize(nv, Vec::new());
        for j in 0..nv {
            let size = DIFFERENCE * self.model.scale[self.model.nq + j];
            let mut step = vec![0.0; nv];
            step[j] = size;
            self.project_step(y, &mut step);
            // The step is so small that it opens the joints by less than rounding errors.
            let mut displaced = y.to_vec();
            Tree::displace(&self.model, &mut displaced, &step);
            let mut column = vec![0.0; nv];
            self.accelerate(&displaced, &mut column);
            for (slope, at) in column.iter_mut().zip(accelerations) {
                *slope = (*slope - at) / size;
            }
            self.columns[j] = column;
        }
    }

    /// Removes the part of the displacement `step` from `y` that would open the joints.
    fn project_step(&mut self, y: &[f64], step: &mut [f64]) {
        if let Some(constraints) = &mut self.constraints {
            factor_at(&self.model, constraints, &mut self.tree, 0.0, y);
            constraints.project_accelerations(&self.model, step);
        }
    }

    /// Moves the positions in `y` by `step`; returns whether the joints still close.
    fn displace(&mut self, y: &mut [f64], step: &[f64]) -> bool {
        Tree::displace(&self.model, y, step);
        Tree::normalise(&self.model, y);
        let Some(constraints) = &mut self.constraints else {
            return true;
        };
        let error = constraints.project(&self.model, &mut self.tree, 0.0, y);
        y[self.model.nq..].fill(0.0);
        error <= CLOSED
    }

    /// The body with the largest accelerations at `y`.
    fn fastest_body(&mut self, y: &[f64]) -> FastestBody {
        let mut evaluator = self.mechanism.evaluator(ActiveSet::Immediate(&self.contact_states));
        evaluator.evaluate_fully(0.0, y, &mut self.derivative);
        let scale = self.model.length_scale;
        let motion = self.mechanism.motion()[..self.model.massive].iter().enumerate();
        let fastest_body = motion.map(|(body, motion)| FastestBody {
            body,
            acceleration: motion.acceleration.norm(),
            angular_acceleration: motion.angular_acceleration.norm(),
        });
        let size = |fastest_body: &FastestBody| fastest_body.acceleration + scale * fastest_body.angular_acceleration;
        let none = FastestBody { body: 0, acceleration: 0.0, angular_acceleration: 0.0 };
        fastest_body
            .fold(none, |most, fastest_body| if size(&fastest_body) > size(&most) { fastest_body } else { most })
    }
}
