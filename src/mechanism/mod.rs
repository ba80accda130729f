//! Equations of motion of a scene.
//!
//! Ball joints are always the cut joints. Cut them and every scene is a forest of trees; each ball joint is then either
//! three constraint rows (ideal) or one contact force (clearance). A scene pays only for what it has.

mod bounds;
mod constraints;
mod contact_stiffness;
mod contacts;
mod factor;
mod implicit;
mod jet;
mod kinematics;
mod lagrange;
mod lu;
mod model;
mod power;
mod spcmm;
mod stiff;
mod summary;
mod systems;
mod tree;

pub use contacts::{Contacts, Gap, Memory, Ramp, Switching};
pub use jet::Jet;
pub use kinematics::{Kinematics, Wrench};
pub use power::Powers;
pub use spcmm::{Ideal, Trajectory, Unreachable};
pub use summary::Summary;

use crate::integrate::System;
use crate::scene::{Formulation, Scene, StartRule, Vec3};
use constraints::Constraints;
use lagrange::Lagrange;
use model::{Model, Motion};
use tree::Tree;

/// Smallest pivot ratio at which a start still has its velocities to three digits.
const DEPENDENT_ROWS: f64 = 1e-13;

/// Why a scene's equations cannot be set up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MechanismError {
    /// A rod cannot reach its slider somewhere along the trajectory.
    #[error("{0}")]
    Unreachable(#[from] Unreachable),
    /// An ideal ball joint, or one that is to start concentric, is open at the start.
    #[error(
        "ball joint {joint}: ball and socket centres are {distance:.3e} m apart at the start and cannot be closed"
    )]
    Open {
        /// Name of the joint.
        joint: String,
        /// |Z_j - Z_i|, m.
        distance: f64,
    },
    /// A ball that starts deeper in its socket wall than a contact can mean.
    #[error(
        "ball joint {joint}: ball and socket centres are {distance:.3e} m apart at the start, \
         deeper in the wall than the clearance {clearance:.3e} m and a hundredth of the ball radius allow"
    )]
    OutsideSocket {
        /// Name of the joint.
        joint: String,
        /// |Z_j - Z_i|, m.
        distance: f64,
        /// c, m.
        clearance: f64,
    },
    /// The loops closed at the start, but not where the drives' closed form has them.
    #[error(
        "the loops close on another branch than the drives ask for: start poses are too far off"
    )]
    OtherBranch,
    /// A start pose in which the ideal joints do not fix the velocities.
    #[error(
        "the mechanism starts in a singular pose, in which its drives do not fix its velocities: \
         move the start of the trajectory away from it"
    )]
    Singular,
    /// Too many coordinates for a method that solves with a dense matrix.
    #[error(
        "this scene has {velocities} velocity coordinates; the implicit methods take at most {most}: \
         choose solver.method = automatic or dopri5"
    )]
    TooLarge {
        /// Velocity coordinates.
        velocities: usize,
        /// Most that are taken.
        most: usize,
    },
    /// Equations that would take more memory or time than is allowed.
    #[error("too large for {form}: {needed} {what}; allowed at most {most}: {advice}")]
    TooCostly {
        /// What would take it.
        form: &'static str,
        /// What it would take.
        what: &'static str,
        /// How much of it.
        needed: u64,
        /// Most that is taken.
        most: u64,
        /// What to do instead.
        advice: &'static str,
    },
    /// Ideal joints whose rows depend on one another.
    #[error("the ideal ball joints over-constrain the mechanism: give one of them a clearance")]
    Redundant,
}

enum Form {
    Tree {
        tree: Box<Tree>,
        constraints: Option<Box<Constraints>>,
    },
    Lagrange(Box<Lagrange>),
}

/// The equations of motion of one scene in one formulation.
pub struct Mechanism {
    model: Model,
    form: Form,
    /// Ball joints with clearance.
    pub contacts: Contacts,
    /// World gravity, m/s^2.
    pub gravity: Vec3,
    joint_names: Vec<String>,
    /// Linearisation; made where an implicit method is chosen.
    stiff: Option<Box<stiff::Stiff>>,
    sources: power::Sources,
    /// Instant at which motion and forces are those of the latest evaluation, s; NaN where something was measured since.
    evaluated: f64,
    /// Made where contacts alone are stepped implicitly.
    implicit: Option<Box<implicit::ImplicitContacts>>,
    /// Evaluations of the equations of motion so far.
    pub evaluations: u64,
}

impl Mechanism {
    /// Sets up the equations of `scene`.
    ///
    /// # Errors
    /// A trajectory that the rods cannot reach; equations that would take too much.
    pub fn new(scene: &Scene) -> Result<Self, MechanismError> {
        let model = Model::new(scene);
        if let Some(trajectory) = &model.trajectory {
            trajectory.check()?;
        }
        bounds::check(scene, &model)?;
        let contacts = Contacts::new(scene, &model);
        let form = match scene.formulation {
            Formulation::Tree => Form::Tree {
                tree: Box::new(Tree::new(&model)),
                constraints: (!model.ideal_joints.is_empty())
                    .then(|| Box::new(Constraints::new(&model, &model.ideal_joints))),
            },
            Formulation::Lagrange => Form::Lagrange(Box::new(Lagrange::new(scene, &model))),
        };
        Ok(Self {
            sources: power::Sources::new(&model, matches!(form, Form::Tree { .. })),
            evaluated: f64::NAN,
            model,
            form,
            contacts,
            gravity: scene.gravity,
            joint_names: scene.ball_joints.iter().map(|j| j.name.clone()).collect(),
            stiff: None,
            implicit: None,
            evaluations: 0,
        })
    }

    /// State at t = 0: positions, then velocities.
    ///
    /// # Errors
    /// Ball joints that do not close.
    pub fn start(&mut self) -> Result<Vec<f64>, MechanismError> {
        const T: f64 = 0.0;
        let model = &self.model;
        let all: Vec<usize> = match model.start {
            StartRule::Ideal => (0..model.joints.len()).collect(),
            StartRule::AsGiven => model.ideal_joints.clone(),
        };
        // Poses alone need no mass matrix.
        let mut tree = if all.is_empty() {
            Tree::without_masses(model)
        } else {
            Tree::new(model)
        };
        let mut y = model.start_state.clone();
        if model.start == StartRule::Ideal
            && let Some(trajectory) = &model.trajectory
        {
            place_output_body(model, trajectory, &mut y);
            tree.forward(model, T, &y);
            turn_hinges(model, &tree.motion, &mut y);
        }
        tree.forward(model, T, &y);
        let distance = |tree: &Tree, j: usize| {
            constraints::eccentricity(&model.joints[j], &tree.motion).norm()
        };
        for j in 0..model.joints.len() {
            let d = distance(&tree, j);
            let coefficients = self.contacts.coefficients(j);
            let clearance = self.contacts.clearance(j);
            if all.contains(&j) {
                // Newton starts from the scene's guess: anything like closed will do for an assembled start.
                let limit = if model.start == StartRule::Ideal {
                    f64::INFINITY
                } else {
                    1e-5
                };
                if d > limit {
                    return Err(MechanismError::Open {
                        joint: self.joint_names[j].clone(),
                        distance: d,
                    });
                }
            } else if d > clearance + 0.01 * coefficients.ball_radius {
                return Err(MechanismError::OutsideSocket {
                    joint: self.joint_names[j].clone(),
                    distance: d,
                    clearance,
                });
            }
        }
        if !all.is_empty() {
            let mut constraints = Constraints::new(model, &all);
            let error = constraints.project(model, &mut tree, T, &mut y);
            tree.forward(model, T, &y);
            if !(error <= 1e-9) {
                let worst = all
                    .iter()
                    .copied()
                    .max_by(|&a, &b| distance(&tree, a).total_cmp(&distance(&tree, b)));
                let joint = worst.unwrap_or(0);
                let distance = distance(&tree, joint);
                return Err(MechanismError::Open {
                    joint: self.joint_names[joint].clone(),
                    distance,
                });
            }
            if constraints.least_pivot < DEPENDENT_ROWS {
                return Err(match model.start {
                    StartRule::AsGiven => MechanismError::Redundant,
                    StartRule::Ideal => MechanismError::Singular,
                });
            }
        }
        Tree::normalise(model, &mut y);
        if let Form::Lagrange(_) = self.form {
            tree.forward(model, T, &y);
            y = Lagrange::state_of(&tree.motion, model.bodies.len());
        }
        Ok(y)
    }

    /// Whether positions and velocities are projected back onto constraints after a step.
    pub fn projects(&self) -> bool {
        matches!(
            &self.form,
            Form::Tree {
                constraints: Some(_),
                ..
            }
        )
    }

    /// Whether the motion is a function of time alone: as many independent constraint rows as coordinates.
    pub fn is_kinematic(&self) -> bool {
        match &self.form {
            Form::Tree { constraints, .. } => {
                self.model.nv == constraints.as_ref().map_or(0, |c| c.rows())
            }
            Form::Lagrange(_) => false,
        }
    }

    /// Longest step of a scene that is a function of time alone, s: a fiftieth of its shortest period.
    pub fn kinematic_step(&self) -> f64 {
        self.model.shortest_period() / 50.0
    }

    /// For a scene that is a function of time alone, on which side of a singular pose its loops are.
    pub fn is_right_handed(&mut self) -> bool {
        if !self.is_kinematic() {
            return true;
        }
        match &mut self.form {
            Form::Tree {
                constraints: Some(constraints),
                ..
            } => constraints.is_right_handed(&self.model),
            _ => true,
        }
    }

    /// For a scene that is a function of time alone and knows its motion in closed form: how far its output body is from
    /// that motion at the latest evaluation, m. 0 elsewhere.
    pub fn distance_from_ideal(&self) -> f64 {
        let Some(ideal) = self.ideal().filter(|_| self.is_kinematic()) else {
            return 0.0;
        };
        let body = &self.model.bodies[self.model.output_body];
        let m = &self.motion()[self.model.output_body];
        let origin = m.position + m.rotation * body.origin;
        (origin - Vec3::from_fn(|i, _| ideal.position[i].value)).norm()
    }

    /// Predicts the state of a scene that is a function of time alone a step `h` on: second order in positions.
    pub fn predict(&self, h: f64, y: &[f64], k: &[f64], step: &mut [f64], out: &mut [f64]) {
        let nq = self.model.nq;
        out.copy_from_slice(y);
        for i in 0..self.model.nv {
            step[i] = h * (y[nq + i] + 0.5 * h * k[nq + i]);
            out[nq + i] += h * k[nq + i];
        }
        Tree::displace(&self.model, out, step);
    }

    /// After a step: orientations back to unit length, loops closed again. Returns the closure error left, m.
    pub fn project(&mut self, t: f64, y: &mut [f64]) -> f64 {
        self.evaluated = f64::NAN;
        let Self { model, form, .. } = self;
        match form {
            Form::Tree { tree, constraints } => {
                Tree::normalise(model, y);
                constraints
                    .as_mut()
                    .map_or(0.0, |c| c.project(model, tree, t, y))
            }
            Form::Lagrange(_) => {
                Lagrange::normalise(model.bodies.len(), y);
                0.0
            }
        }
    }

    /// Poses, velocities and gaps at (t, y), without forces.
    pub fn measure(&mut self, t: f64, y: &[f64]) {
        self.evaluated = f64::NAN;
        let Self {
            model,
            form,
            contacts,
            ..
        } = self;
        match form {
            Form::Tree { tree, .. } => {
                tree.forward(model, t, y);
                contacts.measure(t, &tree.motion);
            }
            Form::Lagrange(lagrange) => {
                lagrange.forward(model, t, y);
                contacts.measure(t, &lagrange.motion);
            }
        }
    }

    /// Sliding speed of ball joint `j` in the motion last measured, m/s.
    pub fn slip_speed(&self, j: usize) -> f64 {
        self.contacts.slip_speed(j, self.motion())
    }

    /// Everything at (t, y): derivative into `dy`, true accelerations in [`Self::motion`], gaps of all joints,
    /// reactions and actuator forces.
    pub fn evaluate_fully(&mut self, t: f64, y: &[f64], dy: &mut [f64]) {
        self.derivative(t, y, dy);
        self.evaluated = f64::NAN;
        let nq = self.positions();
        let Self {
            model,
            form,
            contacts,
            ..
        } = self;
        if let Form::Tree { tree, .. } = form {
            tree.accelerate(model, y, &dy[nq..]);
        }
        // Forces stay those of the derivative; only the geometry of ideal joints is missing.
        let motion = match form {
            Form::Tree { tree, .. } => &tree.motion,
            Form::Lagrange(lagrange) => &lagrange.motion,
        };
        contacts.measure(t, motion);
    }

    /// Motion of the centroid frames at the latest evaluation; the last entry is the world.
    pub fn motion(&self) -> &[Kinematics] {
        match &self.form {
            Form::Tree { tree, .. } => &tree.motion,
            Form::Lagrange(lagrange) => &lagrange.motion,
        }
    }

    /// The paper's ideal mechanism at the latest instant, where the scene follows it.
    pub fn ideal(&self) -> Option<&Ideal> {
        match &self.form {
            Form::Tree { tree, .. } => tree.driven.ideal.as_ref(),
            Form::Lagrange(lagrange) => lagrange.driven.ideal.as_ref(),
        }
    }

    /// Force of the constraint on the ball of joint `j` at the latest evaluation, N; `None` where it has clearance.
    pub fn reaction(&self, j: usize) -> Option<Vec3> {
        let k = self.model.joints[j].ideal?;
        match &self.form {
            Form::Tree { constraints, .. } => constraints.as_ref().map(|c| c.reaction(k)),
            Form::Lagrange(lagrange) => Some(lagrange.reaction(k)),
        }
    }

    /// Largest constraint violation at the latest evaluation of the `lagrange` form, m or rad; 0 in the `tree` form.
    pub fn constraint_drift(&self) -> f64 {
        match &self.form {
            Form::Tree { .. } => 0.0,
            Form::Lagrange(lagrange) => lagrange.drift,
        }
    }

    /// Smallest pivot ratio of the constraint matrix at the latest evaluation: near rounding level where rows depend on
    /// one another. Infinite without constraints.
    pub fn least_pivot(&self) -> f64 {
        match &self.form {
            Form::Tree { constraints, .. } => constraints
                .as_ref()
                .map_or(f64::INFINITY, |c| c.least_pivot),
            Form::Lagrange(lagrange) => lagrange.least_pivot,
        }
    }

    /// Number of driven coordinates.
    pub fn drives(&self) -> usize {
        self.model.drives.len()
    }

    /// Driven body of drive `i`.
    pub fn driven_body(&self, i: usize) -> usize {
        self.model.drives[i].body
    }

    /// Force (N) or torque (N m) of every actuator after [`Self::evaluate_fully`], positive along the joint's axis.
    pub fn actuators(&mut self, out: &mut [f64]) {
        let Self {
            model,
            form,
            gravity,
            ..
        } = self;
        match form {
            Form::Lagrange(lagrange) => {
                for (i, out) in out.iter_mut().enumerate() {
                    *out = lagrange.actuator(i);
                }
            }
            Form::Tree { tree, constraints } => {
                if let Some(constraints) = constraints {
                    load_reactions(model, tree, constraints);
                }
                let Tree { motion, wrench, .. } = &mut **tree;
                power::inverse_dynamics(
                    model,
                    motion,
                    wrench,
                    gravity,
                    |_| true,
                    |drive, force| out[drive] = force,
                );
            }
        }
    }

    /// Kinetic energy and gravitational potential (zero at the world origin) at the latest evaluation, J.
    pub fn energies(&self) -> (f64, f64) {
        let (mut kinetic, mut potential) = (0.0, 0.0);
        for (body, m) in self.model.bodies.iter().zip(self.motion()) {
            let w = m.rotation.tr_mul(&m.angular_velocity);
            kinetic += 0.5 * (body.mass * m.velocity.norm_squared() + w.dot(&(body.inertia * w)));
            potential -= body.mass * self.gravity.dot(&m.position);
        }
        (kinetic, potential)
    }

    /// Origin of body `b`'s scene frame from its centroid, body axes, m.
    pub fn frame_origin(&self, b: usize) -> Vec3 {
        self.model.bodies[b].origin
    }

    /// Allocates what [`linearise`](crate::integrate::StiffSystem::linearise) needs, so that no step does.
    pub fn prepare_linearisation(&mut self) {
        if self.stiff.is_none() {
            let (dimension, positions) = (self.dimension(), self.positions());
            let joints = self.contacts.len();
            self.stiff = Some(Box::new(stiff::Stiff::new(
                dimension - positions,
                dimension,
                joints,
            )));
        }
    }

    /// Allocates what [`ContactSystem`](crate::integrate::ContactSystem) needs, so that no step does.
    ///
    /// # Errors
    /// Contacts that couple too widely for it.
    pub fn prepare_implicit_contacts(&mut self) -> Result<(), MechanismError> {
        if self.implicit.is_none() {
            let velocities = self.dimension() - self.positions();
            let blocks = matches!(
                &self.form,
                Form::Tree {
                    constraints: None,
                    ..
                }
            );
            let contacts = implicit::ImplicitContacts::new(&self.model, velocities, blocks)?;
            self.implicit = Some(Box::new(contacts));
        }
        Ok(())
    }

    /// What the scene contains, what will be computed and what not.
    pub fn summary(&self) -> Summary {
        Summary::new(self)
    }
}

/// Puts the free output body where the ideal mechanism has it at t = 0, so that assembling has little left to do.
fn place_output_body(model: &Model, trajectory: &Trajectory, y: &mut [f64]) {
    let ideal = trajectory.at(0.0);
    let body = &model.bodies[model.output_body];
    if let Motion::Free { q, v } = body.motion {
        let to_centroid = -(ideal.rotation * body.origin);
        let position = Vec3::from_fn(|i, _| ideal.position[i].value) + to_centroid;
        let rotation = kinematics::quaternion_of(&ideal.rotation);
        y[q..q + 3].copy_from_slice(position.as_slice());
        y[q + 3..q + 7].copy_from_slice(&[rotation.w, rotation.i, rotation.j, rotation.k]);
        let velocity = Vec3::from_fn(|i, _| ideal.position[i].rate)
            + ideal.angular_velocity.cross(&to_centroid);
        let v = model.nq + v;
        y[v..v + 3].copy_from_slice(velocity.as_slice());
        y[v + 3..v + 6].copy_from_slice(ideal.angular_velocity.as_slice());
    }
}

/// Turns every hinged body that carries a ball until the ball comes closest to its socket, so that loops close on the
/// branch that the closed form means.
fn turn_hinges(model: &Model, motion: &[Kinematics], y: &mut [f64]) {
    for joint in &model.joints {
        let motion_of = |b: usize| model.bodies.get(b).map(|body| body.motion);
        let Some(Motion::Revolute { q, .. }) = motion_of(joint.ball.body) else {
            continue;
        };
        let body = &motion[joint.ball.body];
        let hinge = body.position - body.arm;
        let centre = |a: &model::Anchor| {
            motion[a.body].position + motion[a.body].rotation * a.offset - hinge
        };
        let (ball, socket, axis) = (centre(&joint.ball), centre(&joint.socket), body.axis);
        let sine = axis.dot(&ball.cross(&socket));
        let cosine = ball.dot(&socket) - axis.dot(&ball) * axis.dot(&socket);
        y[q] += libm::atan2(sine, cosine);
    }
}

/// Adds the reactions of the ideal joints to the loads on the bodies.
fn load_reactions(model: &Model, tree: &mut Tree, constraints: &Constraints) {
    let mut load = |anchor: &model::Anchor, force: Vec3| {
        let arm = tree.motion[anchor.body].rotation * anchor.offset;
        let w = &mut tree.wrench[anchor.body];
        w.force += force;
        w.torque += arm.cross(&force);
    };
    for (k, &j) in model.ideal_joints.iter().enumerate() {
        let force = constraints.reaction(k);
        load(&model.joints[j].ball, force);
        load(&model.joints[j].socket, -force);
    }
}
