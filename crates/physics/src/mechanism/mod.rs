//! Equations of motion of a scene.
//!
//! Joints with play, and other joints marked as loop-closing, are cut, so that every scene is a forest of trees. A joint with play then
//! adds contact forces, constraint rows for what it does not leave free, or both; any other cut joint up to six rows. A scene pays
//! only for what it contains.

mod assembly;
mod band;
mod bounds;
mod closed_form;
mod columns;
mod constraints;
mod contacts;
mod coupled;
mod discrete_gradient;
mod drives;
mod dynamics;
mod elements;
mod equations;
mod equilibrium;
mod factor;
mod flight;
mod forest;
mod held;
mod kinematics;
mod lagrange;
mod loose;
mod lu;
mod massless;
mod members;
mod model;
mod norm_sum;
mod pairs;
mod path;
mod power;
mod reachable;
mod rows;
mod settled;
mod start;
mod stiff;
mod summary;
mod systems;
mod tree;
mod turns;

pub use crate::jet::Jet;
use assembly::Settled;
pub use assembly::{Assembly, Placement, UnstableRest};
pub use bounds::{Advice, CostlyTask, LimitedQuantity, MAX_DENSE};
pub use closed_form::{ClosedMotion, Unreachable};
pub use contacts::{Contacts, Ramp, Worn};
pub use discrete_gradient::StepStart;
pub(crate) use drives::law_of;
pub use drives::{Law, laws_of, periods_of};
pub use dynamics::Coordinate;
pub use elements::{ActiveSet, Counts, EdgeIndicator, ElementReport, Gap, Powers, Pull, WallContact};
use flight::ActiveRanges;
pub use flight::{Flight, FreeFlightBody};
pub use held::{HeldError, HeldMachine, drive_positions};
pub(crate) use kinematics::angle_of;
pub use kinematics::{Kinematics, Wrench};
pub use loose::{Division, Edges, Grid, Part, Profile, Shape, Spot, WornWall};
pub use pairs::Opening;
pub use reachable::{Farthest, TipFreedoms};
pub use start::{OFF_PATH, poses_as_given};
pub use summary::Summary;
pub use systems::Evaluator;

use std::ops::Range;
use std::sync::Arc;

use crate::contact::{ContactState, FrictionBranch};
use crate::machine::{Formulation, LiveElements, Machine, MachineFault, Mat3, StartRule, Vec3};
use crate::units::format_quantity_digits;
use elements::{Film, ForceElement, element_of, elements_of};
use equations::{Equations, LEAST_PIVOT, NEARLY_DEPENDENT};
use forest::Forest;
use lagrange::Lagrange;
pub use model::ContactId;
pub(crate) use model::Model;
use model::Motion;
use path::Path;
use rows::NEGLIGIBLE;
use tree::Tree;
use turns::Turns;

/// Error in setting up the equations of a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MechanismError {
    /// A machine with inconsistent parts.
    #[error("{0}")]
    Machine(#[from] MachineFault),
    /// The machine cannot follow its closed form somewhere, as where a rod is too short.
    #[error("{0}")]
    Unreachable(#[from] Unreachable),
    /// A loop-closing joint that is open although the start values are to be used as given.
    #[error(
        "{given} as given, and {} may be open by at most {}: correct the start values, or let start = \"ideal\" close it",
        .given.kind(), .given.limit()
    )]
    Open {
        /// Its opening.
        given: OpenJoint,
    },
    /// Loops that cannot be closed near the initial guess.
    #[error("{given} as given and cannot be closed{}", unclosed(.remaining))]
    NoClosure {
        /// Widest gap as given.
        given: OpenJoint,
        /// Joints still open where assembly converged: no admissible motion of the mechanism reduces these gaps. Empty if
        /// assembly did not converge.
        remaining: Vec<OpenJoint>,
    },
    /// Loops that close but that the drives open again immediately.
    #[error(
        "{}: at the speeds of the drives it {}; no motion of the mechanism satisfies both",
        .rate.title(), .rate.rate_text()
    )]
    InconsistentDrives {
        /// The joint, with opening rates in m/s and rad/s.
        rate: OpenJoint,
    },
    /// A joint that starts implausibly deep in its wall.
    #[error(
        "joint {joint}: as given it is {} off its middle, deeper in the wall than its play {} plus a hundredth of the radius \
         there",
        length(*.distance), length(*.clearance)
    )]
    OutsideSocket {
        /// Name of the joint.
        joint: String,
        /// Of the site deepest in its wall, from its middle, m.
        distance: f64,
        /// Its play, m.
        clearance: f64,
    },
    /// Loops that close where the closed form does not have the output body.
    #[error(
        "where the loops close at t = 0, body {body} is {} off its path in [closed_form]: the path does not fit the drives, or \
         the loops close in another assembly mode because the start poses are too far off",
        length(*.distance)
    )]
    OffPath {
        /// Name of the output body.
        body: String,
        /// Of the probe's tip, or of the body's origin if there is no probe, m.
        distance: f64,
    },
    /// A start pose in which the ideal joints do not determine the velocities.
    #[error(
        "the mechanism starts in a singular pose, in which its drives do not fix its velocities: \
         move the start of the trajectory away from it"
    )]
    Singular,
    /// A formulation that divides by the mass of every body.
    #[error(
        "body {body} has mass 0 kg, and formulation = \"lagrange\" divides by the mass of every body: choose formulation = \"tree\""
    )]
    NeedsMass {
        /// Name of the first body without mass.
        body: String,
    },
    /// A singular mass matrix because of bodies without mass.
    #[error(
        "joint {joint}: at the start values it moves all mass in the same way as other joints do, as two hinges with one axis, \
         because a body between them has mass 0 kg; its acceleration is not determined: start in another pose, change an axis, or \
         give that body a mass"
    )]
    Undetermined {
        /// Name of the joint nearest to the world whose coordinate depends on the others.
        joint: String,
    },
    /// Too many coordinates for a method with a dense matrix.
    #[error(
        "this scene has {velocities} velocity coordinates; the implicit methods take at most {most}: \
         choose solver.method = automatic or dopri5"
    )]
    TooLarge {
        /// Number of velocity coordinates.
        velocities: usize,
        /// Maximum accepted.
        most: usize,
    },
    /// Too many coordinates for the search of a position of rest.
    #[error(
        "this scene has {velocities} velocity coordinates; a position of rest is found for at most {most}: \
         choose start = \"settled\""
    )]
    TooLargeForRest {
        /// Number of velocity coordinates.
        velocities: usize,
        /// Maximum accepted.
        most: usize,
    },
    /// A machine for which no position of rest was found.
    #[error(
        "found no position of rest: where the search ended, body {body} accelerates at {} and {}; \
         hold it by a spring, a stop, a tyre or a joint, bring the start values closer to where it rests, or choose start = \"settled\"",
        format_quantity_digits(*.acceleration, "m/s^2", 4), format_quantity_digits(*.angular_acceleration, "rad/s^2", 4)
    )]
    NoRest {
        /// Name of the body that moves most.
        body: String,
        /// Acceleration of its centroid, m/s^2.
        acceleration: f64,
        /// Its angular acceleration, rad/s^2.
        angular_acceleration: f64,
    },
    /// Equations that exceed the limits on memory or time.
    #[error("too large for {of}: {needed} {what}; allowed at most {most}: {advice}")]
    TooCostly {
        /// The task that is too costly.
        of: CostlyTask,
        /// The quantity limited.
        what: LimitedQuantity,
        /// Amount needed.
        needed: u64,
        /// Maximum allowed.
        most: u64,
        /// Remedy.
        advice: Advice,
    },
    /// A start pose in which constraints become dependent that are independent in every neighbouring pose.
    #[error(
        "the mechanism starts in a singular pose: at {} constraints are dependent here that are independent in \
         neighbouring poses, and the motion could continue in more than one way; start it away from that pose",
        .joints.join(", ")
    )]
    Branching {
        /// Names of the joints.
        joints: Vec<String>,
    },
}

/// Maximum gap of a loop-closing joint if start values are used as given, m, and maximum angular misalignment of its bodies, rad.
const MAX_GIVEN_GAP: f64 = 1e-5;
const MAX_GIVEN_ANGLE: f64 = 1e-4;

/// Opening of a cut joint.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenJoint {
    /// Joint name.
    pub joint: String,
    /// Whether it is a ball joint, whose opening is e = Z_j - Z_i alone.
    pub ball: bool,
    /// World axes, m and rad.
    pub opening: Opening,
}

impl OpenJoint {
    /// The joint, for the beginning of a sentence.
    fn title(&self) -> String {
        let kind = if self.ball { "ball joint" } else { "joint" };
        format!("{kind} {}", self.joint)
    }

    /// Kind of joint to which the limit [`Self::limit`] applies.
    fn kind(&self) -> &'static str {
        if self.ball { "an ideal joint" } else { "a joint that closes a loop" }
    }

    /// Maximum opening of the joint as given, as text.
    fn limit(&self) -> String {
        let apart = length(MAX_GIVEN_GAP);
        if self.ball {
            return apart;
        }
        format!("{apart} and {}", angle(MAX_GIVEN_ANGLE))
    }

    /// The gap as text: `B by 5 mm along y and by 3 deg`.
    fn gap_text(&self) -> String {
        let Opening { apart, turned } = &self.opening;
        let apart =
            (apart.norm() > start::CLOSED).then(|| format!(" by {} along {}", length(apart.norm()), axes(apart)));
        let turned = (*turned > start::CLOSED).then(|| format!(" by {}", angle(*turned)));
        let parts: Vec<String> = apart.into_iter().chain(turned).collect();
        format!("{}{}", self.joint, parts.join(" and"))
    }

    /// The opening rate as text: `opens at 1 m/s along y`.
    fn rate_text(&self) -> String {
        let Opening { apart, turned } = &self.opening;
        if apart.norm() > start::MAX_OPENING_RATE {
            let speed = format_quantity_digits(apart.norm(), "m/s", 4);
            return format!("opens at {speed} along {}", axes(apart));
        }
        format!("is turned open at {}", format_quantity_digits(*turned, "rad/s", 4))
    }
}

impl std::fmt::Display for OpenJoint {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let apart = length(self.opening.apart.norm());
        if self.ball {
            return write!(f, "{}: ball and socket centres are {apart} apart", self.title());
        }
        let turned = angle(self.opening.turned);
        write!(f, "{}: its bodies are {apart} apart there and turned against it by {turned}", self.title())
    }
}

fn length(si: f64) -> String {
    format_quantity_digits(si, if si < 1.0 { "mm" } else { "m" }, 4)
}

fn angle(si: f64) -> String {
    format_quantity_digits(si, "deg", 4)
}

/// World axes along which a vector has a significant component: `x and z`.
fn axes(vector: &Vec3) -> String {
    let largest = vector.amax();
    let named = ["x", "y", "z"].into_iter().zip(vector.iter());
    let named = named.filter(|(_, part)| part.abs() > 0.05 * largest);
    named.map(|(axis, _)| axis).collect::<Vec<_>>().join(" and ")
}

/// Orthogonal unit vectors that span `vectors`, the longest of which has a length of about 1. Components at the level of rounding do
/// not count.
fn span(vectors: impl Iterator<Item = Vec3>) -> Vec<Vec3> {
    let squares = vectors.fold(Mat3::zeros(), |sum, vector| sum + vector * vector.transpose()).symmetric_eigen();
    let directions = squares.eigenvectors.column_iter().zip(&squares.eigenvalues);
    let counted = directions.filter(|(_, square)| **square > NEGLIGIBLE * NEGLIGIBLE);
    counted.map(|(direction, _)| direction.into_owned()).collect()
}

fn unclosed(remaining: &[OpenJoint]) -> String {
    if remaining.is_empty() {
        return ": the parts do not reach, or the guess is too far off".to_owned();
    }
    let each: Vec<String> = remaining.iter().map(OpenJoint::gap_text).collect();
    format!(": remaining gaps: {} (no joint can move that way)", each.join(", "))
}

/// The equations of motion of one scene in one formulation.
pub struct Mechanism {
    model: Arc<Model>,
    equations: Box<dyn Equations>,
    /// Contacts of the loose joints.
    pub contacts: Contacts,
    /// Bodies that determine the gap of each contact; `None` if nearly all do.
    paths: Vec<Option<Path>>,
    /// The scene's elements in its order, then the pulling hand, if any.
    elements: Vec<Box<dyn ForceElement>>,
    /// Time law of each of the scene's elements, if it follows one.
    element_laws: Vec<Option<Arc<dyn Law>>>,
    /// Changes of the scene's elements since the start.
    live: LiveElements,
    /// Number of the scene's elements.
    scene_elements: usize,
    /// Places of those that are films in joints with play.
    films: Vec<usize>,
    pull: Option<Pull>,
    turns: Turns,
    /// World gravity, m/s^2.
    pub gravity: Vec3,
    /// Names of the cut joints: loose joints, then other joints that close loops, then those of [`Model::lasting`].
    joint_names: Vec<String>,
    output_name: String,
    /// Linearisation, allocated if an implicit method is chosen.
    stiff: Option<Box<stiff::Stiff>>,
    sources: power::Sources,
    /// Origin of the motion and the forces.
    latest: Latest,
    /// Workspace of the discrete-gradient step, allocated if that method is chosen.
    discrete: Option<Box<discrete_gradient::DiscreteGradient>>,
    /// Time of one evaluation, ns, from [`bounds::evaluation_time`].
    evaluation_time: f64,
    free_flight_bodies: Vec<FreeFlightBody>,
    active_ranges: ActiveRanges,
    /// Scale of the state, if it has bristles.
    scale: Vec<f64>,
}

/// Origin of the motion and the forces in a mechanism.
#[derive(Clone, Copy, PartialEq)]
enum Latest {
    /// An evaluation at this time, s.
    Evaluated(f64),
    /// The motion and the gaps alone, at this time, s.
    Measured(f64),
    /// Unknown, because they have been overwritten.
    Unknown,
}

impl Mechanism {
    /// Sets up the equations of `machine`.
    ///
    /// # Errors
    /// The machine is inconsistent or cannot follow its closed form, the equations would be too costly, or no start that is
    /// settled or in equilibrium is found.
    pub fn new(machine: &Machine) -> Result<Self, MechanismError> {
        Self::with_guess(machine, None)
    }

    /// The same. `guess`, if any, replaces the machine's start values as the initial guess of assembly, in tree coordinates and
    /// velocities.
    fn with_guess(machine: &Machine, guess: Option<&[f64]>) -> Result<Self, MechanismError> {
        machine.check()?;
        let mut model = Model::new(machine);
        if let Some(form) = &model.closed_form {
            form.check()?;
        }
        bounds::check(machine, &model)?;
        massless::check(machine, &model)?;
        model.settled = match machine.start {
            StartRule::AsGiven | StartRule::Ideal => {
                guess.map(|guess| Settled { state: guess.to_vec(), assembly: Assembly::default() })
            }
            StartRule::Settled => Some(settled::settle(machine, None)?),
            StartRule::Equilibrium => Some(equilibrium::rest_state(machine, None)?),
        };
        Ok(Self::with_model(machine, Arc::new(model)))
    }

    fn with_model(machine: &Machine, model: Arc<Model>) -> Self {
        let contacts = Contacts::new(machine, &model);
        let lasting = model.lasting.iter().map(|(j, _)| &*machine.loose_joints[*j].name);
        let joint_names = machine.cut_joints().chain(lasting).map(str::to_owned).collect();
        let equations: Box<dyn Equations> = match machine.formulation {
            Formulation::Tree => Box::new(Forest::new(&model)),
            Formulation::Lagrange => Box::new(Lagrange::new(machine, &model)),
        };
        let path = |site| equations.path(&model, site);
        let elements = elements_of(machine, &model);
        let mut mechanism = Self {
            paths: model.sites.iter().map(path).collect(),
            evaluation_time: bounds::evaluation_time(machine, &model),
            sources: power::Sources::new(&model, &*equations, machine.elements.len()),
            films: elements
                .iter()
                .enumerate()
                .filter(|(_, e)| e.film().is_some_and(|f| f.len() > 0))
                .map(|(i, _)| i)
                .collect(),
            elements,
            element_laws: machine.elements.iter().map(drives::law_of).collect(),
            live: LiveElements::default(),
            scene_elements: machine.elements.len(),
            pull: None,
            turns: Turns::new(machine, &model),
            latest: Latest::Unknown,
            model,
            equations,
            contacts,
            gravity: machine.gravity,
            output_name: machine.bodies[machine.output.body].name.clone(),
            joint_names,
            stiff: None,
            discrete: None,
            free_flight_bodies: Vec::new(),
            active_ranges: ActiveRanges::default(),
            scale: Vec::new(),
        };
        if mechanism.contacts.bristles() > 0 {
            let bristles = std::iter::repeat_n(mechanism.model.length_scale, mechanism.contacts.bristles());
            mechanism.scale = mechanism.equations.scale(&mechanism.model).iter().copied().chain(bristles).collect();
        }
        mechanism.free_flight_bodies = FreeFlightBody::all(&mechanism, machine);
        mechanism.active_ranges = ActiveRanges::with_capacity(mechanism.free_flight_bodies.len());
        mechanism.suspend(|_| false);
        mechanism
    }

    /// Further equations of `model`, which is `machine` compiled and assembled by [`Self::start`].
    pub(crate) fn from_model(machine: &Machine, model: Arc<Model>) -> Self {
        let rank = model.assembled.get().and_then(|assembled| assembled.rank);
        let mut mechanism = Self::with_model(machine, model);
        if let Some(rank) = rank {
            mechanism.equations.treat_as_dependent(rank);
        }
        mechanism
    }

    /// The compiled machine.
    pub(crate) fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Whether these are equations of `model`.
    pub(crate) fn belongs_to(&self, model: &Arc<Model>) -> bool {
        Arc::ptr_eq(&self.model, model)
    }

    /// Whether positions and velocities are projected onto the constraints after a step.
    pub(crate) fn projects(&self) -> bool {
        self.equations.projects()
    }

    /// Whether the motion is a function of time alone: as many independent constraint rows as coordinates.
    pub fn is_kinematic(&self) -> bool {
        self.equations.is_kinematic(&self.model)
    }

    /// Maximum step if the motion is a function of time alone, s: a fiftieth of the shortest period of drives and loads.
    pub(crate) fn kinematic_step(&self) -> f64 {
        let laws = self.element_laws.iter().flatten();
        laws.map(|law| law.shortest_period()).fold(self.model.shortest_period, f64::min) / 50.0
    }

    /// Whether derivatives of prescribed motions jump at ends of steps.
    pub(crate) fn has_broken_drives(&self) -> bool {
        !self.model.bounding.is_empty()
    }

    /// Latest end of an adaptive step that starts at `t`, s.
    pub fn step_end(&self, t: f64) -> f64 {
        let laws = self.element_laws.iter().flatten();
        laws.map(|law| law.step_end(t)).fold(self.model.step_end(t), f64::min)
    }

    /// If the motion is a function of time alone: whether the determinant of the loops' Jacobian is positive. Its sign changes
    /// across a singular pose. Otherwise true.
    pub(crate) fn is_determinant_positive(&mut self) -> bool {
        !self.is_kinematic() || self.equations.is_determinant_positive(&self.model)
    }

    /// Distance of the probe's tip, or of the output body's origin if there is no probe, from its motion in closed form at the
    /// latest evaluation, m, if the motion is a function of time alone and known in closed form; otherwise 0.
    pub(crate) fn distance_from_path(&self) -> f64 {
        let ideal = self.closed_motion().filter(|_| self.is_kinematic());
        ideal.map_or(0.0, |ideal| kinematics::distance_from(&ideal, &self.model, self.motion()))
    }

    /// Predicts the state after a step `h`, s, to second order in positions, if the motion is a function of time alone.
    pub(crate) fn predict(&self, h: f64, y: &[f64], k: &[f64], step: &mut [f64], out: &mut [f64]) {
        let nq = self.model.nq;
        out.copy_from_slice(y);
        for i in 0..self.model.nv {
            step[i] = h * (y[nq + i] + 0.5 * h * k[nq + i]);
            out[nq + i] += h * k[nq + i];
        }
        Tree::displace(&self.model, out, step);
    }

    /// Projects the state after a step: quaternions to unit length, loops closed. Returns the remaining closure error, m.
    pub fn project(&mut self, t: f64, y: &mut [f64]) -> f64 {
        self.latest = Latest::Unknown;
        self.equations.project(&self.model, t, y)
    }

    /// Poses, velocities and gaps at (t, y), without forces.
    pub fn measure(&mut self, t: f64, y: &[f64]) {
        self.latest = Latest::Measured(t);
        self.equations.update_kinematics(&self.model, t, y);
        self.turns.follow(&mut self.elements, &*self.equations, &self.model, (t, y));
        self.contacts.measure(t, self.equations.motion());
    }

    /// Components of the state read by [`Self::measure_one`] for contact `c`, its bristles aside; `None` if it reads all.
    pub fn gap_components(&self, c: ContactId) -> Option<&[Range<usize>]> {
        self.paths[c].as_ref().map(|path| &path.parts[..])
    }

    /// Measures the gap of contact `c` at (t, y), and the motion of the bodies that determine it.
    pub fn measure_one(&mut self, c: ContactId, t: f64, y: &[f64]) {
        self.latest = Latest::Unknown;
        match &self.paths[c] {
            Some(path) => self.equations.update_along(&self.model, t, y, path),
            None => self.equations.update_kinematics(&self.model, t, y),
        }
        self.contacts.measure_one(c, t, self.equations.motion());
    }

    /// Components of the bristles of contact `c`; `None` without any.
    pub(crate) fn bristles_of(&self, c: ContactId) -> Option<Range<usize>> {
        let first = self.first_bristle();
        self.contacts.bristles_of(c).map(|of| first + of.start..first + of.end)
    }

    /// First component of the state that is a deflection of bristles: after the velocities.
    fn first_bristle(&self) -> usize {
        self.positions() + self.velocities()
    }

    /// How far the bristles of contact `c` lie beyond `branch` in the motion last measured, of the state `y`, m; `None` without
    /// bristles.
    pub(crate) fn bristle_excess(
        &self,
        c: ContactId,
        y: &[f64],
        contact_state: &ContactState,
        branch: FrictionBranch,
    ) -> Option<f64> {
        let bristles = &y[self.first_bristle()..];
        self.contacts.contact(c).bristle_excess(bristles, self.motion(), contact_state, branch)
    }

    /// Turns the deflections in `y` into the planes in which bristles bend, at the motion last measured.
    pub(crate) fn flatten_bristles(&self, y: &mut [f64]) {
        if self.contacts.bristles() > 0 {
            self.contacts.flatten_bristles(&mut y[self.first_bristle()..], self.motion());
        }
    }

    /// Straightens the bristles of contacts that have ended in the state `y` with the derivative `k`.
    #[inline]
    pub(crate) fn release_bristles(&self, [y, k]: [&mut [f64]; 2], contact_states: &[ContactState]) {
        if self.contacts.bristles() == 0 {
            return;
        }
        let ended = contact_states.iter().enumerate().filter(|(_, contact_state)| !contact_state.active);
        for of in ended.filter_map(|(c, _)| self.bristles_of(c)) {
            y[of.clone()].fill(0.0);
            k[of].fill(0.0);
        }
    }

    /// Energy stored in the bristles of the state `y`, J.
    #[inline]
    pub(crate) fn bristle_energy(&self, y: &[f64]) -> f64 {
        if self.contacts.bristles() == 0 { 0.0 } else { self.contacts.bristle_energy(&y[self.first_bristle()..]) }
    }

    /// Sliding speed of contact `c` in the motion last measured, m/s.
    pub fn slip_speed(&self, c: ContactId) -> f64 {
        self.contacts.slip_speed(c, self.motion())
    }

    /// Number of components of a state: positions, then velocities, then the deflections of bristles.
    pub fn dimension(&self) -> usize {
        self.first_bristle() + self.contacts.bristles()
    }

    /// Number of velocities.
    pub fn velocities(&self) -> usize {
        self.equations.velocities(&self.model)
    }

    /// Components of a state that are velocities.
    pub fn velocity_range(&self) -> Range<usize> {
        self.positions()..self.first_bristle()
    }

    /// Number of positions.
    pub fn positions(&self) -> usize {
        self.equations.positions(&self.model)
    }

    /// Rounding error of the distance between two points of the machine in the state `y`, m: a few units in the last place of
    /// their coordinates.
    pub fn rounding(&self, y: &[f64]) -> f64 {
        const UNITS: f64 = 32.0;
        let farthest = y[..self.positions()].iter().fold(self.model.extent, |most, q| most.max(q.abs()));
        UNITS * f64::EPSILON * farthest
    }

    /// Absolute scale of each component of a state.
    pub fn scale(&self) -> &[f64] {
        if self.scale.is_empty() { self.equations.scale(&self.model) } else { &self.scale }
    }

    /// Position rates from the velocities in `y`, into the leading components of `dy`.
    pub(crate) fn position_rate(&self, y: &[f64], dy: &mut [f64]) {
        let dq = &mut dy[..self.positions()];
        self.equations.position_rate(&self.model, y, dq);
    }

    /// Motion of the centroid frames at the latest evaluation; the last entry is the world.
    pub fn motion(&self) -> &[Kinematics] {
        self.equations.motion()
    }

    /// Whether the path of the output body is known in closed form.
    pub(crate) fn has_closed_form(&self) -> bool {
        self.model.path().is_some()
    }

    /// Motion of the output body in closed form at the latest instant, if known.
    pub(crate) fn closed_motion(&self) -> Option<ClosedMotion> {
        Some(self.model.path()?.1.at(&self.equations.driven().functions.latest))
    }

    /// Origin of the carried part's frame of loose joint `j` from that of the carrier's at the latest evaluation, m: e = Z_j - Z_i
    /// (5).
    pub fn separation(&self, j: usize) -> Vec3 {
        let joint = &self.model.joints[j];
        pairs::separation([&joint.carried, &joint.carrier], self.motion(), 0)
    }

    /// Displacement along the axis of each pin with a travel, by its joint, at the latest evaluation, m.
    pub(crate) fn travelled(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.model.travelling.iter().map(|&(j, axis)| {
            let axis = self.motion()[self.model.joints[j].carrier.body].rotation * axis;
            (j, axis.dot(&self.separation(j)).abs())
        })
    }

    /// Where contact `c` acts at the latest evaluation, m.
    pub fn contact_point(&self, c: ContactId) -> Vec3 {
        let contact = self.contacts.contact(c);
        let gap = &contact.gap.separation;
        let body = &self.motion()[contact.site.carried.body];
        let [lever, _] = contact.site.wall.levers(&contact.law, gap.distance);
        (body.position + body.rotation * contact.site.carried.offset) + gap.normal * lever
    }

    /// Constraint force on the carried part of loose joint `j` at the latest evaluation, N; `None` for a joint with clearance.
    pub fn reaction(&self, j: usize) -> Option<Vec3> {
        let k = self.model.joints[j].ideal?;
        Some(self.equations.closing_load(k)[0])
    }

    /// Index of cut joint `j`, loose joints first, among those that close loops; `None` for a joint with clearance.
    fn closed_index(&self, j: usize) -> Option<usize> {
        match self.model.joints.get(j) {
            Some(joint) => joint.ideal,
            None => Some(self.model.ideal_joints.len() + j - self.model.joints.len()),
        }
    }

    /// Whether the reaction of cut joint `j` is unique at the latest evaluation; loose joints come first, then other loop-closing
    /// joints. If a direction is constrained redundantly, [`Self::reaction`] minimises the sum of squares over all such joints,
    /// in N and N m.
    pub(crate) fn is_reaction_unique(&self, j: usize) -> bool {
        self.closed_index(j).is_none_or(|k| self.equations.is_closing_load_unique(k))
    }

    /// Directions in which the force, and about which the torque, of cut joint `j` is not unique at the latest evaluation, counted
    /// as in [`Self::is_reaction_unique`]: orthogonal unit vectors, world axes.
    pub(crate) fn undetermined_directions(&self, j: usize) -> [Vec<Vec3>; 2] {
        let loads = self.closed_index(j).map_or_else(Vec::new, |k| self.equations.null_closing_loads(k));
        [0, 1].map(|part| span(loads.iter().map(|load| load[part])))
    }

    /// Force, N, at the child's point and torque, N m, exerted on its child by each loop-closing joint at the latest evaluation.
    pub(crate) fn closing_loads(&self) -> impl Iterator<Item = [Vec3; 2]> {
        let first = self.model.ideal_joints.len();
        let all = first..first + self.model.closures.len();
        all.map(|k| self.equations.closing_load(k))
    }

    /// Number of cut joints: joints with play, then other joints that close loops.
    pub fn cut_joints(&self) -> usize {
        self.model.joints.len() + self.model.closures.len()
    }

    /// Whether any ball joint is ideal, so that [`Self::reaction`] changes with every evaluation.
    pub(crate) fn has_reactions(&self) -> bool {
        !self.model.ideal_joints.is_empty()
    }

    /// Largest constraint violation at the latest evaluation of the `lagrange` form, m or rad; 0 in the `tree` form.
    pub fn constraint_drift(&self) -> f64 {
        self.equations.drift()
    }

    /// Whether constraint rows were dependent, up to rounding, at the latest evaluation.
    pub(crate) fn has_dependent_rows(&self) -> bool {
        self.equations.least_pivot() < LEAST_PIVOT
    }

    /// Whether the rows were so nearly dependent that steps cannot pass: the pose is singular.
    pub(crate) fn is_nearly_singular(&self) -> bool {
        self.equations.least_pivot() < NEARLY_DEPENDENT
    }

    /// Whether the constraints no longer determine the motion at the latest evaluation.
    pub(crate) fn is_undetermined(&self) -> bool {
        self.equations.is_undetermined()
    }

    /// Number of driven coordinates.
    pub fn drives(&self) -> usize {
        self.model.drives.len()
    }

    /// Force (N) or torque (N m) of every actuator after [`Evaluator::evaluate_fully`], positive along the joint's axis.
    pub fn actuator_forces(&mut self, out: &mut [f64]) {
        self.equations.actuator_forces(&self.model, &self.gravity, out);
    }

    /// Force, N, and torque about the child's joint point, N m, exerted on its child by every fixed, sliding or turning joint,
    /// drive included, in scene order, after [`Self::actuator_forces`]. World axes.
    pub fn joint_reactions(&mut self) -> impl Iterator<Item = [Vec3; 2]> {
        let (motion, loads) = self.equations.joint_loads();
        // Massless links only transmit the loads of their parents.
        let bodies = &self.model.bodies[..self.model.massive];
        let bodies = bodies.iter().zip(motion).zip(loads);
        bodies.filter_map(|((body, m), load)| {
            let arm = m.rotation * body.to_centroid;
            let held = !matches!(body.motion, Motion::Free { .. });
            held.then(|| [load.force, load.torque + arm.cross(&load.force)])
        })
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

    /// Energy stored in contacts and springs at the gaps last measured, at `t`, J.
    pub(crate) fn elastic_energy(&self, t: f64) -> f64 {
        let motion = self.equations.motion();
        let mut energy = 0.0;
        for contact in self.contacts.iter() {
            energy += contact.stored(t, motion);
        }
        energy + self.energy_in_elements(t)
    }

    /// Energy stored in springs at the latest evaluation, at `t`, J.
    pub(crate) fn energy_in_elements(&self, t: f64) -> f64 {
        let motion = self.equations.motion();
        self.elements.iter().map(|e| e.stored(t, motion)).sum()
    }

    /// Reports of the force elements in scene order; `t`, s, is the time of the latest evaluation.
    pub(crate) fn element_reports(&self, t: f64) -> impl Iterator<Item = ElementReport> {
        let motion = self.equations.motion();
        let scene_elements = self.elements[..self.scene_elements].iter();
        scene_elements.map(move |e| e.report(t, motion))
    }

    /// Indicators of all edges of the elements' forces. `t`, s, is the time of the motion last measured.
    pub(crate) fn edge_indicators(&self, t: f64) -> impl Iterator<Item = EdgeIndicator> {
        let motion = self.equations.motion();
        self.elements.iter().flat_map(move |element| element.edges(t, motion)).flatten()
    }

    /// Whether any element is one-sided or has a force with kinks.
    pub(crate) fn has_edges(&self) -> bool {
        self.edge_indicators(0.0).next().is_some()
    }

    /// Freezes each element on its side of every edge according to `indicators` from [`Self::edge_indicators`], regardless of the
    /// motion; unfreezes it if `indicators` is empty.
    pub(crate) fn freeze_elements(&mut self, indicators: &[EdgeIndicator]) {
        let motion = self.equations.motion();
        let mut indicators = indicators.iter().copied();
        for element in &mut self.elements {
            let sides = element.edges(0.0, motion).map(|edge| edge.and_then(|_| indicators.next()));
            element.freeze(sides);
        }
    }

    /// Films in joints with play, with their places among the scene's elements.
    pub(crate) fn films(&self) -> impl Iterator<Item = (usize, &Film)> {
        self.films.iter().filter_map(|i| Some((*i, self.elements[*i].film()?)))
    }

    /// Bound of the rate at which films damp the motion last measured, 1/s; 0 without films.
    pub(crate) fn fastest_film(&self) -> f64 {
        let motion = self.motion();
        let rate = |(_, film): (usize, &Film)| {
            let rates = film.stations(motion).map(|station| {
                let points = film.points(&station, motion);
                film.damping(&station).norm() * discrete_gradient::max_mobility(&self.model, &points)[0]
            });
            rates.sum()
        };
        self.films().map(rate).fold(0.0, f64::max)
    }

    /// Whether a film is in loose joint `j`, which has play.
    pub(crate) fn has_film(&self, j: usize) -> bool {
        self.films().any(|(_, film)| film.joint == j)
    }

    /// The hand's pull, if any.
    pub fn pull(&self) -> Option<Pull> {
        self.pull
    }

    /// Sets or removes the hand's pull on a body of `machine`, which these equations must belong to.
    pub(crate) fn set_pull(&mut self, machine: &Machine, pull: Option<Pull>) {
        self.elements.truncate(self.scene_elements);
        self.pull = pull;
        if let Some(pull) = pull {
            let hand = elements::hand(machine, &self.model, pull);
            self.elements.push(hand);
        }
        let elements = self.elements.len();
        self.sources = power::Sources::new(&self.model, &*self.equations, elements);
    }

    /// Lets the scene's elements act as `live` says; `machine` is what these equations were set up from.
    ///
    /// # Errors
    /// The discrete-gradient method is prepared, and forces of the elements would couple the contacts too widely for it; nothing
    /// has changed then.
    pub(crate) fn set_elements(&mut self, machine: &Machine, live: &LiveElements) -> Result<(), MechanismError> {
        if self.live == *live {
            return Ok(());
        }
        let before = std::mem::replace(&mut self.live, live.clone());
        let differs = |i: &usize| before.element(machine, *i) != live.element(machine, *i);
        let changed: Vec<usize> = (0..self.scene_elements).filter(differs).collect();
        if let Err(error) = self.replace_elements(machine, &changed) {
            self.live = before;
            self.replace_elements(machine, &changed)?;
            return Err(error);
        }
        Ok(())
    }

    /// Builds these elements anew.
    fn replace_elements(&mut self, machine: &Machine, which: &[usize]) -> Result<(), MechanismError> {
        let mut other_ends = false;
        for &i in which {
            let element = self.live.element(machine, i);
            let next = element_of(machine, &self.model, &element);
            self.element_laws[i] = drives::law_of(&element);
            let motion = self.equations.motion();
            other_ends |= next.ends(motion).is_some() != self.elements[i].ends(motion).is_some();
            self.elements[i] = next;
        }
        if other_ends && self.discrete.take().is_some() {
            self.prepare_discrete_gradient()?;
        }
        Ok(())
    }

    /// Whether the force of any element depends on motion in a possibly stiff way.
    pub(crate) fn has_couplings(&self) -> bool {
        let motion = self.equations.motion();
        self.elements.iter().any(|e| e.ends(motion).is_some())
    }

    /// Origin of the scene frame of body `b` from its centroid, body axes, m.
    pub(crate) fn frame_origin(&self, b: usize) -> Vec3 {
        self.model.bodies[b].origin
    }

    /// Allocates the workspace of [`linearise`](crate::integrate::StiffSystem::linearise), so that steps do not allocate.
    pub(crate) fn prepare_linearisation(&mut self) {
        if self.stiff.is_none() {
            let dimensions = [self.positions(), self.velocities(), self.contacts.bristles()];
            let separate = self.equations.is_block_diagonal();
            self.stiff = Some(Box::new(stiff::Stiff::new(&self.model, dimensions, separate)));
        }
    }

    /// Approximate cost of linear algebra in the latest implicit step, in evaluations.
    pub(crate) fn implicit_algebra(&self) -> f64 {
        self.implicit_time() / self.evaluation_time
    }

    /// The same, ns.
    pub(crate) fn implicit_time(&self) -> f64 {
        let stiff = self.stiff.as_ref();
        let [coordinates, products] = stiff.map_or([0; 2], |stiff| stiff.size());
        bounds::implicit_time(coordinates, products)
    }

    /// Approximate time of one evaluation, ns: only its ratio to other such times matters.
    pub(crate) fn evaluation_time(&self) -> f64 {
        self.evaluation_time
    }

    /// Maximum number of velocity coordinates for which the automatic choice considers implicit steps.
    pub fn largest_implicit(&self) -> usize {
        if self.equations.is_block_diagonal() { MAX_DENSE } else { bounds::MAX_COUPLED }
    }

    /// Contents of the scene, and the computations it needs.
    pub fn summary(&self) -> Summary {
        Summary::new(self)
    }
}
