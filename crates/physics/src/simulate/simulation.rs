//! A running simulation: a constant model, the state of a run, and the workspace in which it is stepped. Their methods are
//! in the files of this module's folder. Reads no clock.

mod adaptive;
mod automatic;
mod contacts;
mod corners;
mod discrete;
mod displace;
mod doubts;
mod edges;
mod energy;
mod flights;
mod guard;
mod ideal;
mod live;
mod model;
mod observations;
mod restart;
mod sample;
mod search;
mod state;
mod step;
mod wear;
mod workspace;

use serde::{Deserialize, Serialize};

use std::sync::Arc;

use super::impacts::{ImpactEvents, Impacts};
use super::ledger::Account;
use super::peaks::{Approach, Recent};
use super::stepper::{ActiveScheme, AnyStepper};
use super::{
    Doubt, Effect, Frame, Impact, ImpactEvent, Indeterminate, Ledger, LoadPeaks, Peak, StartError, Statistics, Stopped,
    Wear,
};
use crate::contact::{ContactPhase, ContactState};
use crate::integrate::{Controller, Polynomial};
use crate::machine::{AppliedForces, Conditions, ControlFault, ElementNumber, LiveElements, Machine, Vec3};
use crate::mechanism::{self, ContactId, Counts, EdgeIndicator, ElementReport, Flight, Mechanism, Pull, Ramp, Worn};
use adaptive::FullStep;
use automatic::SchemeSelector;
use corners::LawBranch;
use ideal::TipHistory;
pub use ideal::{ProbeFault, closed};
pub use live::ChangeError;
use observations::Observations;
pub use observations::Snapshot;
pub use restart::{Linearisation, RestartError};

/// Rate at which a clearance shrinks when a jump would place the ball inside its socket wall, m/s: an impact at this speed gives
/// a force of the order of the static ones.
pub const CLEARANCE_SPEED: f64 = 2e-3;
/// Longest step of an adaptive method, s.
const LONGEST_STEP: f64 = 10e-3;
/// Largest angle that a place of contact may turn along a wall which wears by direction in a step whose size is not the user's choice,
/// rad: the wall wears at the quadrature nodes of the step alone.
const MAX_SWEEP: f64 = 0.2;
/// Shortest step of an adaptive method, s.
const SHORTEST_STEP: f64 = 1e-14;
/// A step that would end within this fraction of its length of a limit ends at the limit.
const NEARLY: f64 = 1e-6;
/// Shortest retry of a kinematic step, s: how closely it approaches a pose that it cannot pass.
const SHORTEST_KINEMATIC_STEP: f64 = 1e-5;
/// First step after a contact begins, before a workable one is known, s: a tenth of a typical impact.
const FIRST_CONTACT_STEP: f64 = 1e-5;
/// Loops still open by more than this after projection have come apart, m.
const OPEN_LOOP: f64 = 1e-7;

/// Shortest adaptive step, s, that still advances the time `t`.
fn shortest_step(t: f64) -> f64 {
    SHORTEST_STEP.max(4.0 * f64::EPSILON * t)
}

/// A machine compiled for simulation. It is constant, and threads may share it; what changes is a [`State`], which is stepped in
/// a [`Workspace`].
///
/// ```
/// # use jointplay_physics::{machine::*, simulate::*};
/// # let mut machine = Machine { gravity: Vec3::new(0.0, 0.0, -9.81), ..Machine::default() };
/// # let bob = machine.add_body(Body::new("bob", 0.4, Mat3::identity() * 1e-3), Joint::free(0));
/// # let joint = LooseJoint::ball("S1", Attachment::world(Vec3::zeros()), Attachment::on(bob, Vec3::zeros()));
/// # machine.loose_joints.push(joint.with_clearance(0.2e-3));
/// let model = Model::new(&machine)?;
/// let mut state = model.start();
/// let mut workspace = model.workspace(&state);
/// while state.time() < 0.01 {
///     model.step(&mut state, &mut workspace)?;
/// }
/// // A copy continues with the same bits, in this workspace or another one.
/// let mut copy = state.clone();
/// model.step(&mut state, &mut workspace)?;
/// model.step(&mut copy, &mut workspace)?;
/// assert_eq!(copy, state);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Model {
    machine: Machine,
    compiled: Arc<mechanism::Model>,
    ideal: IdealSource,
    start: State,
}

/// The state of a run of a [`Model`]: everything that changes in a step, each fact once. A clone continues with the same bits.
/// Looking at it changes nothing of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// The physical state.
    now: StepEnd,
    /// Nearest number of quarter turns of each angle that force elements act on, where it follows from poses alone and not from a
    /// coordinate that counts turns.
    quarter_turns: Vec<i64>,
    /// Gravity, contacts and stepper with the live changes so far.
    conditions: Conditions,
    /// Force elements with the live changes so far.
    elements: LiveElements,
    /// What each loose joint remembers, and each contact.
    joints: Vec<JointState>,
    contacts: Vec<ContactMemory>,
    /// Of each contact whose wall wears by direction, the depths of its profile, m; empty for others.
    profiles: Vec<Vec<f64>>,
    /// The hand's pull, if any.
    pull: Option<Pull>,
    /// Flights of the bodies excluded from the latest step, indexed like the mechanism's free-flight bodies.
    flights: Vec<Option<Flight>>,
    control: Control,
    /// Latest collocation polynomial; empty unless the method has one.
    polynomial: Polynomial,
    record: Record,
    #[serde(skip)]
    workspace_id: WorkspaceId,
}

/// What one loose joint remembers from step to step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct JointState {
    /// Number of its contacts: none if it is ideal.
    contacts: usize,
    /// Active ramp of each play, and the play without it, m; both without wear.
    ramps: [Option<Ramp>; 2],
    plays: [f64; 2],
    /// By how much each play has worn wider.
    worn: [Worn; 2],
    /// Reaction at the latest two instants, if the joint is ideal, for its peak between steps.
    reaction: Recent,
    /// Peak since it was last taken.
    peak: Peak,
}

/// What one contact remembers from step to step, besides its gap and its [`ContactState`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct ContactMemory {
    /// Effect of a unit normal force on the opening at its latest touch, 1/kg, and its phase: for the discrete-gradient method.
    mobility: f64,
    phase: ContactPhase,
    /// Steps since it began or ended.
    steps: u64,
}

/// State vector, derivative, gaps and contact state at one instant.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct StepEnd {
    t: f64,
    /// Coordinates, then velocities.
    y: Vec<f64>,
    /// Their derivative.
    k: Vec<f64>,
    gaps: Vec<Approach>,
    /// Contact states for the step that begins here.
    contact_states: Vec<ContactState>,
}

/// Step control: not part of the physical state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Control {
    /// Next step of an adaptive method.
    h_next: f64,
    /// Step size that was accepted after the latest contact began.
    h_contact: f64,
    /// Whether a contact began at the latest event.
    contact_began: bool,
    /// Measure of how often corners of the friction law occur, and whether they occur too often to be located.
    chatter: u32,
    chatters: bool,
    /// Active scheme of the automatic method.
    scheme: ActiveScheme,
    /// Data for the automatic choice of scheme.
    selector: SchemeSelector,
    controller: Controller,
    /// Fixed steps are counted from here, so that times do not accumulate rounding errors.
    grid_origin: f64,
    grid_count: u64,
    /// Fastest turning of a place of contact along a wall that wears by direction, rad/s.
    sweep: f64,
    discrete: DiscreteControl,
}

/// Step control of the discrete-gradient method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct DiscreteControl {
    /// The latest step, s, and the derivative of the velocities without contact forces at its middle; no step yet if 0.
    h: f64,
    acceleration: Vec<f64>,
    /// Longest step for which forces other than contact forces change little enough, s.
    smooth: f64,
}

/// Diagnostics of the run so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Record {
    account: Account,
    wear: Option<Wear>,
    impacts: Impacts,
    statistics: Statistics,
    /// The stop that starts deepest relative to its nominal depth, if any exceeds that: index, [depth, nominal depth] (m or rad),
    /// force (N or N m).
    starts_inside: Option<(usize, [f64; 2], f64)>,
    /// Side of singular poses on which a kinematic scene started.
    determinant_positive: bool,
    /// As [`State::quarter_turns`], of joint angles that no element acts on.
    quarter_turns: Vec<i64>,
}

/// A state of another model, or one that no run of the model can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("these values do not describe a state of this scene")]
pub struct StateMismatch;

/// Memory for stepping besides [`Model`] and [`State`]: matrices, stages, the latest step for samples within it, and forces of
/// the latest evaluation. It is attached to one state at a time; given another, it is first attached to that one, which evaluates
/// nothing. Steps then allocate nothing.
pub struct Workspace {
    mechanism: Mechanism,
    stepper: AnyStepper,
    /// Start of the latest step: samples lie between it and the state.
    before: StepEnd,
    attempt: Attempt,
    scratch_y: Vec<f64>,
    scratch_k: Vec<f64>,
    scratch_contacts: Vec<ContactState>,
    workspace_id: WorkspaceId,
}

/// Identifies the workspace that a state is attached to: both hold the same number, a new one each time a workspace is attached
/// to a state. Clones of a state and states read from files are attached to none. The numbers do not enter any computation.
#[derive(Debug, Default)]
struct WorkspaceId(u64);

/// A state of a model that is stepped in the workspace attached to it.
struct Stepping<'a> {
    model: &'a Model,
    machine: &'a Machine,
    state: &'a mut State,
    mechanism: &'a mut Mechanism,
    stepper: &'a mut AnyStepper,
    /// Start of the latest step.
    before: &'a mut StepEnd,
    attempt: &'a mut Attempt,
    scratch_y: &'a mut [f64],
    scratch_k: &'a mut [f64],
    scratch_contacts: &'a mut [ContactState],
}

/// The step being taken.
struct Attempt {
    end: StepEnd,
    /// Contact that starts or ends at the step's end.
    located_contact: Option<ContactId>,
    /// Contact that switches to another branch of a law there, and that branch.
    corner: Option<(ContactId, LawBranch)>,
    /// Indicators that fix the side of each element during the step, as from [`Mechanism::edge_indicators`]; empty if steps do not
    /// end at edges of elements.
    element_sides: Vec<EdgeIndicator>,
    /// Whether it ends at an edge.
    edge: bool,
    /// The same indicators at both ends of a part of the step.
    edge_indicators: [Vec<EdgeIndicator>; 2],
    /// Whether it has been restarted on another branch.
    has_switched_branch: bool,
    /// Contacts that left the frozen branches of their laws in an evaluation.
    has_left_branch: Vec<bool>,
    /// The full step, if an event truncated it, and the full step of another run that the next step must reproduce.
    full_step: Option<FullStep>,
    step_to_reproduce: Option<FullStep>,
    /// What happened to impacts since it was last asked.
    events: ImpactEvents,
    /// Whether it may contain the largest force of a contact.
    may_contain_peak: bool,
    /// The same of the step just accepted.
    is_near_peak: bool,
    /// Wear of each play of each joint over the step: at its quadrature nodes, then its growth, m, and the rate at its end, m/s.
    wearing: Vec<wear::Growth>,
    /// The same of each contact whose wall wears by direction.
    abrasion: Vec<wear::Abrasion>,
    /// Largest normal force of each contact, N, and the fraction of the step at which it occurs.
    peak_forces: Vec<(f64, f64)>,
    /// [`StepStart::rebounds`](crate::mechanism::StepStart::rebounds) of a discrete-gradient step.
    rebounds: Vec<Option<f64>>,
    /// Step size times the largest eigenvalue seen; 0 if unknown.
    stiffness: f64,
    /// Evaluations spent so far, and factorisations.
    counts: Counts,
    factorisations: u32,
}

/// Source of the ideal tip of a model.
enum IdealSource {
    /// There is no probe, or the drives' closed form gives it.
    ClosedForm,
    /// Every joint with play is ideal: the motion is its own reference.
    SelfReference,
    /// A simulation alongside.
    Simulated(Box<IdealModel>),
    /// The ideal mechanism cannot start.
    None(StartError),
}

/// The ideal machine, and the point on its output body that is followed.
struct IdealModel {
    model: Model,
    body: usize,
    probe: Vec3,
}

/// State of the ideal motion, and past positions of its tip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct IdealState {
    state: State,
    tips: TipHistory,
}

/// Workspace of the ideal motion.
struct IdealWorkspace {
    workspace: Workspace,
    frame: Frame,
}

/// A running simulation of one machine: a [`Model`], a [`State`] and the [`Workspace`] in which it is stepped.
///
/// The same machine and the same calls give the same bits. A clone continues with the same bits, too.
pub struct Simulation {
    model: Arc<Model>,
    state: State,
    observations: Observations,
    workspace: Workspace,
    /// For the ideal motion alongside.
    ideal: Option<Box<IdealWorkspace>>,
}

impl Clone for Simulation {
    fn clone(&self) -> Self {
        Self::from_snapshot(self.model.clone(), self.snapshot())
    }
}

impl std::fmt::Debug for Simulation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Simulation").field("model", &self.model).field("time", &self.time()).finish_non_exhaustive()
    }
}

impl Simulation {
    /// Starts `machine` at t = 0.
    ///
    /// # Errors
    /// If joints with play do not close, or the rods cannot follow the prescribed trajectory.
    pub fn new(machine: &Machine) -> Result<Self, StartError> {
        let (model, workspace) = Model::with_workspace(machine)?;
        let observations = Observations::new(&model);
        let ideal = observations.workspace(&model);
        Ok(Self { state: model.start(), observations, model: Arc::new(model), workspace, ideal })
    }

    /// Continues from `snapshot`, of a run of `model`.
    pub fn from_snapshot(model: Arc<Model>, snapshot: Snapshot) -> Self {
        let Snapshot { mut state, observations } = snapshot;
        let mut workspace = model.workspace(&state);
        workspace.attach_to(&model, &mut state);
        let ideal = observations.workspace(&model);
        Self { model, state, observations, workspace, ideal }
    }

    fn run(&mut self) -> Stepping<'_> {
        Stepping::new(&self.model, &mut self.state, &mut self.workspace)
    }

    /// The compiled machine.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// The whole state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The state, and what looking at the run has found.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot { state: self.state.clone(), observations: self.observations.clone() }
    }

    /// Continues from a snapshot of another run of the same model, which costs a copy and evaluates nothing.
    pub fn restore(&mut self, snapshot: &Snapshot) {
        self.state.clone_from(&snapshot.state);
        self.observations.clone_from(&snapshot.observations);
        self.workspace.attach_to(&self.model, &mut self.state);
    }

    /// Continues from a snapshot read from a file.
    ///
    /// # Errors
    /// If it cannot belong to this model; the simulation is then unchanged.
    pub fn resume(&mut self, snapshot: &Snapshot) -> Result<(), StateMismatch> {
        snapshot.check(&self.model)?;
        self.restore(snapshot);
        Ok(())
    }

    /// The machine, as it started; see [`Self::conditions`].
    pub fn machine(&self) -> &Machine {
        self.model.machine()
    }

    /// Gravity, contacts and stepper with the live changes so far.
    pub fn conditions(&self) -> &Conditions {
        self.state.conditions()
    }

    /// The machine with the live changes so far.
    pub fn changed_machine(&self) -> Machine {
        self.machine().with_conditions(self.conditions(), &self.state.elements)
    }

    /// Equations of motion at the latest evaluation.
    pub fn mechanism(&self) -> &Mechanism {
        self.workspace.mechanism()
    }

    /// Time of the latest state, s.
    pub fn time(&self) -> f64 {
        self.state.time()
    }

    /// Time at the start of the latest step, s: [`Self::sample`] accepts times from here to [`Self::time`].
    pub fn step_start(&self) -> f64 {
        self.workspace.before.t
    }

    /// As [`State::vector`].
    pub fn state_vector(&self) -> &[f64] {
        self.state.vector()
    }

    /// As [`State::hash`].
    pub fn state_hash(&self) -> u64 {
        self.state.hash()
    }

    /// States of the contacts of loose joint `j`, none if it is ideal: whether they touch, and their approach speeds.
    pub fn contact_states(&self, j: usize) -> &[ContactState] {
        &self.state.now.contact_states[self.mechanism().contacts.of_joint(j)]
    }

    /// As [`State::statistics`].
    pub fn statistics(&self) -> &Statistics {
        self.state.statistics()
    }

    /// What the run cost so far, in evaluations of the equations: these, the linear algebra of implicit steps and of coupled
    /// contacts, and what is done once a step. The same on every computer.
    pub fn counted_cost(&self) -> f64 {
        let Statistics { steps, rejected, evaluations, algebra, .. } = self.statistics();
        // Error control and the search for events double what a step costs besides.
        let controls = if self.conditions().solver.method.is_adaptive() { 2.0 } else { 1.0 };
        let steps = controls * automatic::STEP_COST * (steps + rejected) as f64;
        *evaluations as f64 + *algebra as f64 / self.mechanism().evaluation_time() + steps
    }

    /// As [`State::impacts`].
    pub fn impacts(&self) -> impl ExactSizeIterator<Item = &Impact> + DoubleEndedIterator {
        self.state.impacts()
    }

    /// As [`State::ledger`].
    pub fn ledger(&self) -> Option<&Ledger> {
        self.state.ledger()
    }

    /// As [`State::wear`].
    pub fn wear(&self) -> Option<&Wear> {
        self.state.wear()
    }

    /// Load peaks at the ends of steps and in samples, if tracked.
    pub fn load_peaks(&self) -> Option<&LoadPeaks> {
        self.observations.loads()
    }

    /// Largest normal force of loose joint `j` (reaction, if ideal) since the start, and its time, (N, s): the value in
    /// [`Statistics`], found from the ends of steps, or a larger one from a sample.
    pub fn peak(&self, j: usize) -> (f64, f64) {
        let own = &self.statistics().joints[j];
        self.observations.peak(j, (own.peak_normal, own.peak_time))
    }

    /// As [`State::pull`].
    pub fn pulled(&self) -> Option<Pull> {
        self.state.pull()
    }

    /// As [`Model::doubts`].
    pub fn doubts(&self) -> Vec<Doubt> {
        self.model.doubts(&self.state)
    }

    /// Why the probe has no ideal motion to be compared with: the ideal mechanism cannot start, or could not continue.
    pub fn probe_fault(&self) -> Option<ProbeFault> {
        self.model.ideal().fault(self.observations.ideal())
    }

    /// As [`Model::step`].
    ///
    /// # Errors
    /// If the divergence guard stops the run; the state is then the last good one.
    pub fn step(&mut self) -> Result<(), Stopped> {
        self.advance(f64::INFINITY)
    }

    fn advance(&mut self, end: f64) -> Result<(), Stopped> {
        self.run().advance(end)?;
        self.observations.observe_step(Stepping::new(&self.model, &mut self.state, &mut self.workspace));
        Ok(())
    }

    /// As [`Model::step_until`].
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_until(&mut self, end: f64) -> Result<(), Stopped> {
        if self.time() >= end {
            return Ok(());
        }
        self.advance(end)
    }

    /// Steps until [`Self::time`] is at least `time`, without shortening a step.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn advance_to(&mut self, time: f64) -> Result<(), Stopped> {
        while self.time() < time {
            self.step()?;
        }
        Ok(())
    }

    /// Whether `end` would truncate the next step.
    pub fn is_truncated_by(&self, end: f64) -> bool {
        step::is_truncated_by(&self.state, &self.workspace.mechanism, end)
    }

    /// Samples the latest state.
    pub fn sample_now(&mut self, out: &mut Frame) {
        self.sample(self.time(), out);
    }

    /// As [`Model::sample`], with the error of a probe in any case; the largest forces sampled are remembered.
    pub fn sample(&mut self, time: f64, out: &mut Frame) {
        self.run().sample(time, out);
        self.observations.observe_sample(&self.model, &mut self.workspace, self.ideal.as_deref_mut(), out);
    }

    /// Forces at the latest state that the motion does not determine uniquely.
    pub fn indeterminate_forces(&mut self) -> Indeterminate {
        self.run().indeterminate_forces()
    }

    /// Moves the peaks of each joint with play since the last call into `out`, in joint order.
    pub fn take_peaks(&mut self, out: &mut Vec<Peak>) {
        out.clear();
        out.extend(self.state.joints.iter_mut().map(|joint| std::mem::take(&mut joint.peak)));
    }

    /// What happened to impacts since the last call, in order. None is lost if it is called after every step; otherwise only the
    /// latest of 64 impacts are guaranteed.
    pub fn take_events(&mut self) -> impl Iterator<Item = ImpactEvent> + '_ {
        self.workspace.attempt.events.take()
    }

    /// The impacts that finished since the last call, among these events; the others are dropped.
    pub fn take_impacts(&mut self) -> impl Iterator<Item = Impact> + '_ {
        self.take_events().filter_map(ImpactEvent::finished)
    }

    /// Adopts gravity, contacts, stepper and the forces of elements of `next`. Returns [`Effect::AtReset`] and changes nothing if
    /// `next` differs in anything else, or if a joint with play becomes or ceases to be ideal, which changes the equations. What
    /// [`Self::control`] set of an element holds until `next` has another one in its place.
    ///
    /// # Errors
    /// If the method is too costly for the equations; nothing has changed then.
    pub fn adopt(&mut self, next: &Machine) -> Result<Effect, ChangeError> {
        let before = self.state.applied_forces();
        let effect = self.run().adopt(next)?;
        self.tell_ideal(&before);
        Ok(effect)
    }

    /// Sets numbers of elements from now on: element, number and value, SI. They act together, at the cost of one evaluation.
    ///
    /// # Errors
    /// An element or number that does not exist, a value out of range, or forces that the method cannot follow; nothing has
    /// changed then.
    pub fn control(&mut self, numbers: &[(usize, ElementNumber, f64)]) -> Result<(), ChangeError> {
        let before = self.state.applied_forces();
        self.run().control(numbers)?;
        self.tell_ideal(&before);
        Ok(())
    }

    /// Checks whether [`Self::control`] could set a number.
    ///
    /// # Errors
    /// An element or number that does not exist, or a value out of range.
    pub fn check_control(&self, i: usize, number: ElementNumber, value: f64) -> Result<(), ControlFault> {
        live::check_control(self.machine(), &self.state.elements, (i, number, value))
    }

    /// Value now of a number of element `i`, SI, as [`Self::control`] sets it; `None` if it does not have that number.
    ///
    /// # Panics
    /// An element that does not exist.
    pub fn controlled(&self, i: usize, number: ElementNumber) -> Option<f64> {
        live::number_at(&self.state.elements.element(self.machine(), i), number, self.time())
    }

    /// Lets the ideal motion follow what acts on the run now, unless that is still `before`.
    fn tell_ideal(&mut self, before: &AppliedForces) {
        let now = self.state.applied_forces();
        if now != *before {
            let time = self.time();
            self.observations.set_applied_forces(&self.model, self.ideal.as_deref_mut(), (time, &now));
        }
    }

    /// Lets `forces` act from now on, and changes nothing else.
    ///
    /// # Errors
    /// Forces that the method cannot follow; nothing has changed then.
    pub fn set_applied_forces(&mut self, forces: &AppliedForces) -> Result<(), ChangeError> {
        self.run().set_applied_forces(forces)
    }

    /// Starts, changes or (with `None`) ends the pull of a hand on a body.
    ///
    /// # Errors
    /// As [`Self::check_pull`]: the running simulation is unchanged.
    pub fn pull(&mut self, pull: Option<Pull>) -> Result<(), ChangeError> {
        pull.map_or(Ok(()), |pull| self.check_pull(&pull))?;
        self.run().pull(pull);
        Ok(())
    }

    /// Checks whether a pull is possible.
    ///
    /// # Errors
    /// An unknown body, or a position out of reach.
    pub fn check_pull(&self, pull: &Pull) -> Result<(), ChangeError> {
        live::check_pull(self.machine(), pull)
    }

    /// Force of the pulling hand, if any, with the bodies as in `frame`.
    pub fn pull_in(&self, frame: &Frame) -> Option<ElementReport> {
        let pull = self.pulled()?;
        let motion = frame.bodies.get(pull.body)?;
        let arm = motion.rotation * pull.point;
        let velocity = motion.velocity + motion.angular_velocity.cross(&arm);
        Some(pull.report(motion.position + arm, velocity))
    }

    /// Adds `offset` to coordinates and velocities (ordered as in [`Self::state_vector`]) and continues from there. Quaternions
    /// are renormalised, ideal joints closed again. A ball moved into its wall is now in contact, a ball lifted off is not; every
    /// other contact retains its state. Counters are unchanged; a wear map is dropped.
    ///
    /// Components of `offset` beyond the state's are ignored, missing ones are 0.
    pub fn displace(&mut self, offset: &[f64]) {
        self.run().displace(offset);
    }

    /// Moves the stored approach speeds of the contacts towards those of `other`, a run in nearly the same state, by the fraction
    /// `fraction` of their difference.
    pub fn blend_approach_speeds(&mut self, other: &Self, fraction: f64) {
        for (own, other) in self.state.now.contact_states.iter_mut().zip(&other.state.now.contact_states) {
            own.approach_speed += fraction * (other.approach_speed - own.approach_speed);
        }
    }

    /// Steps to the time of `other`, a run in nearly the same state, by reproducing its latest step and the way it ended. A step
    /// merely truncated there would have a different error, by about the tolerance.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn reproduce_step(&mut self, other: &Self) -> Result<(), Stopped> {
        if self.time() == other.step_start() {
            self.run().reproduce(&other.workspace.attempt);
        }
        while self.time() < other.time() {
            self.step_until(other.time())?;
        }
        Ok(())
    }

    /// Adopts the step control of `other`, a run in nearly the same state: its step size and its scheme of the automatic method.
    /// Two runs that choose their own have different errors and seem to diverge.
    pub fn adopt_step_control(&mut self, other: &Self) {
        self.run().adopt_step_control(&other.state.control);
    }

    /// Scale of each component of [`Self::state_vector`]: the error scales of the tolerance.
    pub fn scales(&self) -> &[f64] {
        self.mechanism().scale()
    }

    /// Starts a wear map, empty except for the current contacts, which count as begun. It belongs to the state, and a reset ends
    /// it. It does not affect the steps.
    pub fn track_wear(&mut self) {
        self.run().track_wear();
    }

    /// Adds the contributions of the latest step to the wear map, instead of leaving that to the next step.
    pub fn commit_wear(&mut self) {
        if let Some(wear) = &mut self.state.record.wear {
            wear.commit_step();
        }
    }

    /// Tracks load peaks from now on. This does not affect the steps.
    pub fn track_load_peaks(&mut self) {
        self.observations.track_loads(Stepping::new(&self.model, &mut self.state, &mut self.workspace));
    }
}

fn store_gaps(mechanism: &Mechanism, out: &mut [Approach]) {
    for (out, gap) in out.iter_mut().zip(mechanism.contacts.gaps()) {
        *out = Approach {
            penetration: gap.separation.penetration,
            rate: gap.separation.rate,
            speed: gap.eccentricity_rate.norm(),
        };
    }
}
