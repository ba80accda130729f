//! A running simulation: a model with one state and its workspace.

use std::sync::Arc;

use super::run::Run;
use super::{
    ChangeError, Doubt, Effect, Frame, Impact, Indeterminate, Ledger, LoadPeaks, Model, Peak, ProbeFault, StartError,
    State, StateMismatch, Statistics, Stopped, Wear, Workspace,
};
use crate::contact::ContactState;
use crate::machine::{Conditions, Machine, Vec3};
use crate::mechanism::{ElementReport, Mechanism, Pull};

/// A running simulation of one machine: a [`Model`], a [`State`] and the [`Workspace`] in which it is stepped.
///
/// The same machine and the same calls give the same bits. A clone continues with the same bits, too.
pub struct Simulation {
    model: Arc<Model>,
    state: State,
    workspace: Workspace,
}

impl Clone for Simulation {
    fn clone(&self) -> Self {
        Self::of(self.model.clone(), self.state.clone())
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
    /// If ball joints do not close, or the rods cannot follow the prescribed trajectory.
    pub fn new(machine: &Machine) -> Result<Self, StartError> {
        let (model, workspace) = Model::with_workspace(machine)?;
        Ok(Self { state: model.start(), model: Arc::new(model), workspace })
    }

    /// Continues from `state`, a state of `model`.
    pub fn of(model: Arc<Model>, state: State) -> Self {
        let workspace = model.workspace(&state);
        Self { model, state, workspace }
    }

    fn run(&mut self) -> Run<'_> {
        Run::new(&self.model, &mut self.state, &mut self.workspace)
    }

    /// The compiled machine.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// The whole state: a clone of it is a snapshot.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Continues from another state of the same model, which costs a copy and evaluates nothing.
    pub fn restore(&mut self, state: &State) {
        self.state.clone_from(state);
        self.workspace.follow(&self.model, &mut self.state);
    }

    /// Continues from a state that was read from a file.
    ///
    /// # Errors
    /// If the state cannot belong to this model; the simulation is then unchanged.
    pub fn resume(&mut self, state: &State) -> Result<(), StateMismatch> {
        self.model.check(state)?;
        self.restore(state);
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
        self.machine().under(self.conditions())
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

    /// As [`State::contact_state`].
    pub fn contact_state(&self, j: usize) -> ContactState {
        self.state.contact_state(j)
    }

    /// As [`State::statistics`].
    pub fn statistics(&self) -> &Statistics {
        self.state.statistics()
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

    /// As [`State::load_peaks`].
    pub fn load_peaks(&self) -> Option<&LoadPeaks> {
        self.state.load_peaks()
    }

    /// As [`State::peak`].
    pub fn peak(&self, j: usize) -> (f64, f64) {
        self.state.peak(j)
    }

    /// As [`State::pull`].
    pub fn pulled(&self) -> Option<Pull> {
        self.state.pull()
    }

    /// As [`Model::doubts`].
    pub fn doubts(&self) -> Vec<Doubt> {
        self.model.doubts(&self.state)
    }

    /// As [`Model::probe_fault`].
    pub fn probe_fault(&self) -> Option<ProbeFault> {
        self.model.probe_fault(&self.state)
    }

    /// As [`Model::step`].
    ///
    /// # Errors
    /// If the divergence guard stops the run; the state is then the last good one.
    pub fn step(&mut self) -> Result<(), Stopped> {
        self.run().advance(f64::INFINITY)
    }

    /// As [`Model::step_until`].
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_until(&mut self, end: f64) -> Result<(), Stopped> {
        if self.time() >= end {
            return Ok(());
        }
        self.run().advance(end)
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
    pub fn is_cut_by(&self, end: f64) -> bool {
        super::run::is_cut_by(&self.state, &self.workspace.mechanism, end)
    }

    /// Samples the latest state.
    pub fn sample_now(&mut self, out: &mut Frame) {
        self.sample(self.time(), out);
    }

    /// As [`Model::sample`].
    pub fn sample(&mut self, time: f64, out: &mut Frame) {
        self.run().sample(time, out);
    }

    /// Forces at the latest state that the motion does not determine uniquely.
    pub fn not_unique(&mut self) -> Indeterminate {
        self.run().not_unique()
    }

    /// Moves the peaks of each ball joint since the last call into `out`, in joint order.
    pub fn take_peaks(&mut self, out: &mut Vec<Peak>) {
        out.clear();
        let peaks = &mut self.state.record.peaks;
        out.extend_from_slice(peaks);
        peaks.fill(Peak::default());
    }

    /// Appends to `out` the impacts that finished since the last call. None is lost if it is called after every step;
    /// otherwise only the latest 64 (more with more ball joints) are guaranteed.
    pub fn take_impacts(&mut self, out: &mut Vec<Impact>) {
        self.state.record.impacts.hand_out(out);
    }

    /// Adopts the gravity, contacts and stepper of `next`. Returns [`Effect::AtReset`] and changes nothing if `next` differs in
    /// anything else, or if a ball joint becomes or ceases to be ideal, which changes the equations.
    ///
    /// # Errors
    /// If the method is too costly for the equations; nothing has changed then.
    pub fn adopt(&mut self, next: &Machine) -> Result<Effect, ChangeError> {
        self.run().adopt(next)
    }

    /// Sets gravity from now on, m/s^2, and changes nothing else.
    pub fn set_gravity(&mut self, gravity: Vec3) {
        self.run().set_gravity(gravity);
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
        super::run::check_pull(self.machine(), pull)
    }

    /// Force of the pulling hand, if any, with the bodies as in `frame`.
    pub fn pull_in(&self, frame: &Frame) -> Option<ElementReport> {
        let pull = self.pulled()?;
        let motion = frame.bodies.get(pull.body)?;
        let arm = motion.rotation * pull.point;
        let velocity = motion.velocity + motion.angular_velocity.cross(&arm);
        Some(pull.report(motion.position + arm, velocity))
    }

    /// Adds `offset` to coordinates and velocities (ordered as in [`Self::state_vector`]) and continues from there. Quaternions are
    /// renormalised, ideal joints closed again. A ball moved into its wall is now in contact, a ball lifted off is not; every
    /// other contact retains its contact_state. Counters are unchanged; a wear map is dropped.
    ///
    /// Components of `offset` beyond the state's are ignored, missing ones are 0.
    pub fn displace(&mut self, offset: &[f64]) {
        self.run().displace(offset);
    }

    /// Moves the stored approach speeds of the contacts towards those of `other`, a run in nearly the same state, by the fraction
    /// `part` of their difference.
    pub fn remember_like(&mut self, other: &Self, part: f64) {
        for (own, other) in self.state.now.contact_states.iter_mut().zip(&other.state.now.contact_states) {
            own.approach_speed += part * (other.approach_speed - own.approach_speed);
        }
    }

    /// Steps to the time of `other`, a run in nearly the same state, by reproducing its latest step and the way it ended. A step
    /// merely truncated there would have a different error, by about the tolerance.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_beside(&mut self, other: &Self) -> Result<(), Stopped> {
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
    pub fn step_like(&mut self, other: &Self) {
        self.run().step_like(&other.state.control);
    }

    /// Scale of each component of [`Self::state_vector`]: the error scales of the tolerance.
    pub fn scales(&self) -> &[f64] {
        self.mechanism().scale()
    }

    /// Starts a wear map, empty except for the current contacts, which count as begun. It belongs to the state, and a reset ends
    /// it. It does not affect the steps.
    pub fn keep_wear(&mut self) {
        self.run().keep_wear();
    }

    /// Adds the contributions of the latest step to the wear map, instead of leaving that to the next step.
    pub fn commit_wear(&mut self) {
        if let Some(wear) = &mut self.state.record.wear {
            wear.pass();
        }
    }

    /// Tracks load peaks from now on. This does not affect the steps.
    pub fn keep_load_peaks(&mut self) {
        self.run().keep_load_peaks();
    }
}
