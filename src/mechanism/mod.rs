//! Equations of motion of a scene.
//!
//! Ball joints are always the cut joints. Cut them and every scene is a forest of trees; each ball joint is then either
//! three constraint rows (ideal) or one contact force (clearance). A scene pays only for what it has.

mod bounds;
mod columns;
mod constraints;
mod contacts;
mod elements;
mod equations;
mod factor;
mod forest;
mod implicit;
mod jet;
mod kinematics;
mod lagrange;
mod lu;
mod model;
mod power;
mod rows;
mod spcmm;
mod start;
mod stiff;
mod summary;
mod systems;
mod tree;

pub use bounds::CostOf;
pub use contacts::{Contacts, Counts, Ramp, Touching};
pub use elements::{ElementReport, Gap, Pull};
pub use jet::Jet;
pub use kinematics::{Kinematics, Wrench};
pub use power::{Powers, Touch};
pub use spcmm::{Ideal, Trajectory, Unreachable};
pub use start::{Assembly, Placement};
pub use summary::Summary;
pub use systems::Evaluator;

use std::sync::Arc;

use crate::scene::{Formulation, Scene, Vec3, format_quantity_digits};
use elements::{ForceElement, SceneElement, elements_of};
use equations::Equations;
use forest::Forest;
use lagrange::Lagrange;
use model::Model;
use tree::Tree;

/// Why a scene's equations cannot be set up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MechanismError {
    /// A rod cannot reach its slider somewhere along the trajectory.
    #[error("{0}")]
    Unreachable(#[from] Unreachable),
    /// An ideal ball joint that the scene's values leave open, where they are to stand as given.
    #[error(
        "ball joint {joint}: ball and socket centres are {} apart as given, and an ideal joint may be open by at most {}: \
         correct the start values, or let start = \"ideal\" close it",
        length(*.given), length(OPEN_AS_GIVEN)
    )]
    Open {
        /// Name of the joint.
        joint: String,
        /// |Z_j - Z_i| as the scene gives it, m.
        given: f64,
    },
    /// Loops that no pose near the guess closes.
    #[error(
        "ball joint {joint}: ball and socket centres are {} apart as given and cannot be closed{}",
        length(*.given), unclosed(.stays)
    )]
    NoClosure {
        /// Name of the joint that is widest open as given.
        joint: String,
        /// |Z_j - Z_i| as the scene gives it, m.
        given: f64,
        /// Where assembling came to rest with joints open: their names and Z_j - Z_i, m, world axes. No motion that the
        /// mechanism has makes these smaller. Empty where it came to no rest.
        stays: Vec<(String, Vec3)>,
    },
    /// Loops that close, but whose drives tear them apart at once.
    #[error(
        "ball joint {joint}: the drives ask for speeds at which it opens at {} along {}; no motion that the mechanism has \
         follows both",
        speed(.rate.norm()), axes(.rate)
    )]
    Torn {
        /// Name of the joint.
        joint: String,
        /// d(Z_j - Z_i)/dt, m/s, world axes.
        rate: Vec3,
    },
    /// A ball that starts deeper in its socket wall than a contact can mean.
    #[error(
        "ball joint {joint}: ball and socket centres are {} apart as given, \
         deeper in the wall than the clearance {} and a hundredth of the ball radius allow",
        length(*.distance), length(*.clearance)
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
    #[error("too large for {of}: {needed} {what}; allowed at most {most}: {advice}")]
    TooCostly {
        /// What would take it.
        of: CostOf,
        /// What it would take.
        what: &'static str,
        /// How much of it.
        needed: u64,
        /// Most that is taken.
        most: u64,
        /// What to do instead.
        advice: &'static str,
    },
    /// A start pose in which constraints lose their independence that have it in every pose around.
    #[error(
        "the mechanism starts in a singular pose: at {} directions that the ideal joints hold elsewhere coincide here, \
         and the motion could go on in more than one way; start it beside that pose",
        .joints.join(", ")
    )]
    Branching {
        /// Names of the joints.
        joints: Vec<String>,
    },
}

/// An ideal joint may be open by this much where values stand as given, m.
const OPEN_AS_GIVEN: f64 = 1e-5;

fn length(si: f64) -> String {
    format_quantity_digits(si, if si < 1.0 { "mm" } else { "m" }, 4)
}

fn speed(si: f64) -> String {
    format_quantity_digits(si, "m/s", 4)
}

/// World axes that a vector has a part along: `x and z`.
fn axes(vector: &Vec3) -> String {
    let largest = vector.amax();
    let named = ["x", "y", "z"].into_iter().zip(vector.iter());
    let named = named.filter(|(_, part)| part.abs() > 0.05 * largest);
    named
        .map(|(axis, _)| axis)
        .collect::<Vec<_>>()
        .join(" and ")
}

fn unclosed(stays: &[(String, Vec3)]) -> String {
    if stays.is_empty() {
        return ": the parts do not reach, or the guess is too far off".to_owned();
    }
    let each = |(joint, gap): &(String, Vec3)| {
        format!("{joint} by {} along {}", length(gap.norm()), axes(gap))
    };
    let each: Vec<String> = stays.iter().map(each).collect();
    format!(
        ": what stays open is {}, where no joint of the mechanism moves",
        each.join(", ")
    )
}

/// What tells the equations of one mechanism from those of another: they are equal where their states can be exchanged.
#[derive(Clone, Debug)]
pub struct Structure {
    model: Arc<Model>,
    rank: Option<usize>,
}

/// The equations of motion of one scene in one formulation.
pub struct Mechanism {
    model: Arc<Model>,
    /// Independent rows of the ideal joints, where some depend on others.
    rank: Option<usize>,
    equations: Box<dyn Equations>,
    /// Ball joints with clearance.
    pub contacts: Contacts,
    /// Those of the scene in its order, then the hand that pulls, if one does.
    elements: Vec<Box<dyn SceneElement>>,
    of_scene: usize,
    pull: Option<Pull>,
    /// World gravity, m/s^2.
    pub gravity: Vec3,
    joint_names: Vec<String>,
    /// Linearisation; made where an implicit method is chosen.
    stiff: Option<Box<stiff::Stiff>>,
    sources: power::Sources,
    /// Instant at which motion and forces are those of the latest evaluation, s; `None` where something was measured since.
    evaluated: Option<f64>,
    /// Made where contacts alone are stepped implicitly.
    implicit: Option<Box<implicit::ImplicitContacts>>,
    assembly: Assembly,
}

impl Mechanism {
    /// Sets up the equations of `scene`.
    ///
    /// # Errors
    /// A trajectory that the rods cannot reach; equations that would take too much.
    pub fn new(scene: &Scene) -> Result<Self, MechanismError> {
        let model = Arc::new(Model::new(scene));
        if let Some(trajectory) = &model.trajectory {
            trajectory.check()?;
        }
        bounds::check(scene, &model)?;
        let contacts = Contacts::new(scene, &model);
        let equations: Box<dyn Equations> = match scene.formulation {
            Formulation::Tree => Box::new(Forest::new(&model)),
            Formulation::Lagrange => Box::new(Lagrange::new(scene, &model)),
        };
        Ok(Self {
            sources: power::Sources::new(&model, &*equations, scene.elements.len()),
            elements: elements_of(scene, &model),
            of_scene: scene.elements.len(),
            pull: None,
            evaluated: None,
            model,
            rank: None,
            equations,
            contacts,
            gravity: scene.gravity,
            joint_names: scene.ball_joints.iter().map(|j| j.name.clone()).collect(),
            stiff: None,
            implicit: None,
            assembly: Assembly::default(),
        })
    }

    /// For a state of the mechanism that `structure` is of, without a start.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn resumed(scene: &Scene, structure: &Structure) -> Result<Self, MechanismError> {
        let mut mechanism = Self::new(scene)?;
        mechanism.rank = structure.rank;
        if let Some(rank) = structure.rank {
            mechanism.equations.reveal(rank);
        }
        Ok(mechanism)
    }

    /// What a snapshot keeps of the equations.
    pub fn structure(&self) -> Structure {
        Structure {
            model: self.model.clone(),
            rank: self.rank,
        }
    }

    /// Whether these are the equations that `structure` is of.
    pub fn has_structure(&self, structure: &Structure) -> bool {
        Arc::ptr_eq(&self.model, &structure.model)
    }

    /// Whether positions and velocities are projected back onto constraints after a step.
    pub fn projects(&self) -> bool {
        self.equations.projects()
    }

    /// Whether the motion is a function of time alone: as many independent constraint rows as coordinates.
    pub fn is_kinematic(&self) -> bool {
        self.equations.is_kinematic(&self.model)
    }

    /// Longest step of a scene that is a function of time alone, s: a fiftieth of the shortest period of drives and loads.
    pub fn kinematic_step(&self) -> f64 {
        let loads = self.elements.iter().map(|element| element.period());
        loads.fold(self.model.shortest_period(), f64::min) / 50.0
    }

    /// For a scene that is a function of time alone, on which side of a singular pose its loops are.
    pub fn is_right_handed(&mut self) -> bool {
        !self.is_kinematic() || self.equations.is_right_handed(&self.model)
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
        self.evaluated = None;
        self.equations.project(&self.model, t, y)
    }

    /// Poses, velocities and gaps at (t, y), without forces.
    pub fn measure(&mut self, t: f64, y: &[f64]) {
        self.evaluated = None;
        self.equations.forward(&self.model, t, y);
        self.contacts.measure(t, self.equations.motion());
    }

    /// Sliding speed of ball joint `j` in the motion last measured, m/s.
    pub fn slip_speed(&self, j: usize) -> f64 {
        self.contacts.slip_speed(j, self.motion())
    }

    /// Number of components of a state: positions, then velocities.
    pub fn dimension(&self) -> usize {
        self.positions() + self.equations.velocities(&self.model)
    }

    /// Number of positions.
    pub fn positions(&self) -> usize {
        self.equations.positions(&self.model)
    }

    /// Absolute scale of each component of a state.
    pub fn scale(&self) -> &[f64] {
        self.equations.scale(&self.model)
    }

    /// Rates of the positions from the velocities in `y`, into the front of `dy`.
    pub fn position_rate(&self, y: &[f64], dy: &mut [f64]) {
        let dq = &mut dy[..self.positions()];
        self.equations.position_rate(&self.model, y, dq);
    }

    /// Motion of the centroid frames at the latest evaluation; the last entry is the world.
    pub fn motion(&self) -> &[Kinematics] {
        self.equations.motion()
    }

    /// The paper's ideal mechanism at the latest instant, where the scene follows it.
    pub fn ideal(&self) -> Option<&Ideal> {
        self.equations.driven().ideal.as_ref()
    }

    /// Force of the constraint on the ball of joint `j` at the latest evaluation, N; `None` where it has clearance.
    pub fn reaction(&self, j: usize) -> Option<Vec3> {
        let k = self.model.joints[j].ideal?;
        Some(self.equations.reaction(k))
    }

    /// Whether the reaction of joint `j` is the only one that fits the motion, at the latest evaluation. Where ideal joints
    /// hold a direction that others hold already, [`Self::reaction`] is the one of least squares over all ideal joints.
    pub fn is_reaction_unique(&self, j: usize) -> bool {
        let ideal = self.model.joints[j].ideal;
        ideal.is_none_or(|k| self.equations.is_reaction_unique(k))
    }

    /// Whether a ball joint is ideal: [`Self::reaction`] is then another at every evaluation.
    pub fn has_reactions(&self) -> bool {
        !self.model.ideal_joints.is_empty()
    }

    /// Largest constraint violation at the latest evaluation of the `lagrange` form, m or rad; 0 in the `tree` form.
    pub fn constraint_drift(&self) -> f64 {
        self.equations.drift()
    }

    /// Smallest pivot ratio of the constraint matrix at the latest evaluation: near rounding level where rows depend on
    /// one another. Infinite without constraints.
    pub fn least_pivot(&self) -> f64 {
        self.equations.least_pivot()
    }

    /// Number of driven coordinates.
    pub fn drives(&self) -> usize {
        self.model.drives.len()
    }

    /// Driven body of drive `i`.
    pub fn driven_body(&self, i: usize) -> usize {
        self.model.drives[i].body
    }

    /// Force (N) or torque (N m) of every actuator after [`Evaluator::evaluate_fully`], positive along the joint's axis.
    pub fn actuators(&mut self, out: &mut [f64]) {
        self.equations.actuators(&self.model, &self.gravity, out);
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

    /// Energy stored in contacts and springs where gaps were measured last, J.
    pub fn elastic_energy(&self) -> f64 {
        let motion = self.equations.motion();
        let mut energy = 0.0;
        for contact in self.contacts.loose() {
            energy += contact.stored(motion);
        }
        energy + self.energy_in_elements()
    }

    /// Energy stored in springs at the latest evaluation, J.
    pub fn energy_in_elements(&self) -> f64 {
        let motion = self.equations.motion();
        self.elements.iter().map(|e| e.stored(motion)).sum()
    }

    /// What the force elements do at `t`, that of the latest evaluation, in the order of the scene.
    pub fn element_reports(&self, t: f64) -> impl Iterator<Item = ElementReport> {
        let motion = self.equations.motion();
        let of_scene = self.elements[..self.of_scene].iter();
        of_scene.map(move |e| e.report(t, motion))
    }

    /// Where a hand pulls.
    pub fn pull(&self) -> Option<Pull> {
        self.pull
    }

    /// From now on a hand pulls on a body of `scene`, whose equations these are, or none does.
    pub fn set_pull(&mut self, scene: &Scene, pull: Option<Pull>) {
        self.elements.truncate(self.of_scene);
        self.pull = pull;
        if let Some(pull) = pull {
            let hand = elements::hand(scene, &self.model, pull);
            self.elements.push(hand);
        }
        let elements = self.elements.len();
        self.sources = power::Sources::new(&self.model, &*self.equations, elements);
    }

    /// Whether an element answers to motion, so that it can be stiff.
    pub fn has_couplings(&self) -> bool {
        self.elements.iter().any(|e| e.ends().is_some())
    }

    /// Origin of body `b`'s scene frame from its centroid, body axes, m.
    pub fn frame_origin(&self, b: usize) -> Vec3 {
        self.model.bodies[b].origin
    }

    /// Allocates what [`linearise`](crate::integrate::StiffSystem::linearise) needs, so that no step does.
    pub fn prepare_linearisation(&mut self) {
        if self.stiff.is_none() {
            let (dimension, positions) = (self.dimension(), self.positions());
            let couplings = self.contacts.len() + self.elements.len();
            self.stiff = Some(Box::new(stiff::Stiff::new(
                dimension - positions,
                dimension,
                couplings,
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
            let blocks = self.equations.is_block_diagonal();
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
