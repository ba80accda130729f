//! A running simulation: stepping, events, live changes, snapshots. Reads no clock.

mod adaptive;
mod automatic;
mod contacts;
mod corners;
mod displace;
mod doubts;
mod edges;
mod energy;
mod flights;
mod guard;
pub mod ideal;
pub(super) mod live;
mod sample;
pub(super) mod saved;
mod search;
mod snapshot;
mod wear;

use serde::{Deserialize, Serialize};

use std::sync::Arc;

use super::impacts::{Impact, Impacts};
use super::ledger::Account;
use super::peaks::{Approach, Recent};
use super::stepper::{ActiveScheme, AnyStepper};
use super::{Frame, Indeterminate, LoadPeaks, Peak, StartError, Statistics, StopAdvice, StopFault, Stopped, Wear};
use crate::contact::Memory;
use crate::integrate::{Controller, System as _};
use crate::machine::Machine;
use crate::mechanism::{ActiveSet, Counts, Flight, Mechanism, MechanismError, Pull, Ramp};
use adaptive::Whole;
use automatic::{SchemeSelector, controller_of, prepare_implicit};
use corners::LawBranch;
use flights::{clear_flights, put_flights};
use ideal::{IdealTip, ProbeFault};

/// Rate at which a clearance shrinks when a jump would place the ball inside its socket wall, m/s: an impact at this speed gives
/// a force of the order of the static ones.
pub const CLEARANCE_SPEED: f64 = 2e-3;
/// Longest step of an adaptive method, s.
const LONGEST_STEP: f64 = 10e-3;
/// Shortest step of an adaptive method, s.
const SHORTEST_STEP: f64 = 1e-14;
/// A step that would end within this fraction of its length of a limit ends at the limit.
const NEARLY: f64 = 1e-6;
/// Distance of an ideal motion from its closed form, m, beyond which it has switched to another branch.
const OTHER_BRANCH: f64 = 1e-6;
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

/// A running simulation of one machine.
///
/// The same machine and the same calls give the same bits.
pub struct Simulation {
    /// Includes the live changes so far.
    machine: Arc<Machine>,
    mechanism: Mechanism,
    stepper: AnyStepper,
    state: State,
    /// Ideal tip with which the probe is compared.
    reference: IdealTip,
    /// Largest sampled force, N, and its time, s, by joint: not part of the state, which sampling must not change.
    sampled: Vec<(f64, f64)>,
    /// Load peaks, if tracked: not part of the state for the same reason.
    loads: Option<LoadPeaks>,
    attempt: Attempt,
    scratch_y: Vec<f64>,
    scratch_k: Vec<f64>,
    scratch_memory: Vec<Memory>,
}

/// Time, state, derivative, gaps and contact memory at the end of a step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct StepEnd {
    t: f64,
    /// Coordinates, then velocities.
    y: Vec<f64>,
    /// Their derivative.
    k: Vec<f64>,
    gaps: Vec<Approach>,
    /// Contact memory for the step that begins here.
    memory: Vec<Memory>,
}

impl StepEnd {
    fn new(y: Vec<f64>, joints: usize) -> Self {
        Self {
            t: 0.0,
            k: vec![0.0; y.len()],
            gaps: vec![Approach::default(); joints],
            memory: vec![Memory::default(); joints],
            y,
        }
    }

    /// Copies `other`, of the same scene, without allocating.
    fn copy_from(&mut self, other: &Self) {
        self.t = other.t;
        self.y.copy_from_slice(&other.y);
        self.k.copy_from_slice(&other.k);
        self.gaps.copy_from_slice(&other.gaps);
        self.memory.copy_from_slice(&other.memory);
    }
}

/// The step being taken.
struct Attempt {
    end: StepEnd,
    /// Joint whose contact starts or ends at the step's end.
    located: Option<usize>,
    /// Joint that switches to another branch of a law there, and that branch.
    corner: Option<(usize, LawBranch)>,
    /// Contact indicators that fix the side of each element during the step, as from [`Mechanism::pressed`]; empty if steps do
    /// not end at edges of elements.
    sides: Vec<f64>,
    /// Whether it ends at an edge.
    edge: bool,
    /// Contact indicators at both ends of a part of the step.
    pressed: [Vec<f64>; 2],
    /// Whether it was restarted on another branch.
    turned: bool,
    /// The full step, if an event truncated it, and the full step that the next one must reproduce to follow another run.
    whole: Option<Whole>,
    beside: Option<Whole>,
    /// Whether it may contain the largest force of a contact.
    near_peak: bool,
    /// Largest normal force of each joint in contact, N, and the fraction of the step at which it occurs.
    strongest: Vec<(f64, f64)>,
    /// Step size times the largest eigenvalue seen; 0 if unknown.
    stiffness: f64,
    /// Evaluations spent so far, and factorisations.
    counts: Counts,
    factorisations: u32,
}

/// Data copied by a snapshot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct State {
    /// Current physical state, and the start of the latest step; samples lie between them.
    now: StepEnd,
    before: StepEnd,
    /// Active clearance ramps, and current clearances, m.
    ramps: Vec<Option<Ramp>>,
    clearances: Vec<f64>,
    /// The hand's pull, if any.
    pull: Option<Pull>,
    /// Flights of the bodies excluded from the latest step, indexed like the mechanism's free-flight bodies.
    flights: Vec<Option<Flight>>,
    control: Control,
    record: Record,
}

/// Step control: not part of the physical state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Control {
    /// Next step of an adaptive method.
    h_next: f64,
    /// Step that worked after the latest contact began.
    h_contact: f64,
    /// A contact began at the latest event.
    contact_began: bool,
    /// Measure of how often corners of the friction law occur, and whether that is too often to locate them.
    chatter: u32,
    chatters: bool,
    /// Active scheme of the automatic method.
    member: ActiveScheme,
    /// Data for the automatic choice of scheme.
    choice: SchemeSelector,
    controller: Controller,
    /// Fixed steps are counted from here, so that times do not accumulate rounding errors.
    grid_origin: f64,
    grid_count: u64,
}

/// Diagnostics of the run so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Record {
    account: Account,
    wear: Option<Wear>,
    impacts: Impacts,
    statistics: Statistics,
    /// Reactions of the ideal joints at the latest two instants, for their peaks between steps.
    reactions: Vec<Recent>,
    /// Steps since the current contact began, by joint.
    contact_steps: Vec<u64>,
    /// Peaks of each ball joint since they were last taken.
    peaks: Vec<Peak>,
    /// The stop that starts deepest relative to its nominal depth, if any exceeds that: index, [depth, nominal depth] (m or rad),
    /// force (N or N m).
    starts_inside: Option<(usize, [f64; 2], f64)>,
    /// Side of singular poses on which a kinematic scene started.
    determinant_positive: bool,
}

impl Control {
    fn new(machine: &Machine) -> Self {
        Self {
            h_next: machine.solver.step.min(LONGEST_STEP),
            h_contact: FIRST_CONTACT_STEP,
            contact_began: false,
            chatter: 0,
            chatters: false,
            member: ActiveScheme::Explicit,
            choice: SchemeSelector::default(),
            controller: controller_of(machine.solver.method, ActiveScheme::Explicit),
            grid_origin: 0.0,
            grid_count: 0,
        }
    }
}

impl State {
    /// The state at t = 0 with coordinates and velocities `y`.
    fn new(machine: &Machine, mechanism: &Mechanism, y: Vec<f64>) -> Self {
        let joints = mechanism.contacts.len();
        let now = StepEnd::new(y, joints);
        Self {
            before: now.clone(),
            now,
            ramps: vec![None; joints],
            clearances: (0..joints).map(|j| mechanism.contacts.clearance(j)).collect(),
            pull: None,
            flights: vec![None; mechanism.free_flight_bodies().len()],
            control: Control::new(machine),
            record: Record {
                account: Account::default(),
                wear: None,
                impacts: Impacts::new(joints),
                statistics: Statistics::new(joints),
                reactions: vec![Recent::default(); joints],
                contact_steps: vec![0; joints],
                peaks: vec![Peak::default(); joints],
                starts_inside: None,
                determinant_positive: true,
            },
        }
    }

    /// Discards the previous step.
    fn discard_previous_step(&mut self) {
        self.before.copy_from(&self.now);
        self.control.grid_origin = self.now.t;
        self.control.grid_count = 0;
    }
}

impl Simulation {
    /// Starts `machine` at t = 0.
    ///
    /// # Errors
    /// If ball joints do not close, or the rods cannot follow the prescribed trajectory.
    pub fn new(machine: &Machine) -> Result<Self, StartError> {
        let mut mechanism = Mechanism::new(machine)?;
        let y = mechanism.start()?;
        prepare_implicit(&mut mechanism, machine.solver.method)?;
        let state = State::new(machine, &mechanism, y);
        let machine = Arc::new(machine.clone());
        let reference = IdealTip::of(&machine, mechanism.has_closed_form());
        let mut simulation = Self::assembled(&machine, mechanism, state, reference);
        simulation.begin_contacts_at_start();
        simulation.choose_first_member();
        simulation.refresh();
        simulation.state.record.determinant_positive = simulation.mechanism.is_determinant_positive();
        if simulation.mechanism.distance_from_ideal() > OTHER_BRANCH {
            return Err(MechanismError::OtherBranch.into());
        }
        simulation.track_peaks(0.0);
        simulation.track_reactions();
        simulation.start_ledger();
        simulation.state.record.starts_inside = simulation.deepest_in_stop();
        Ok(simulation)
    }

    /// Computes [`Record::starts_inside`] from the latest evaluation.
    fn deepest_in_stop(&self) -> Option<(usize, [f64; 2], f64)> {
        let reports = self.mechanism.element_reports(self.state.now.t).enumerate();
        let inside = reports.filter_map(|(i, report)| {
            let force = report.torque.unwrap_or(report.force).norm();
            report.depth.filter(|[depth, usual]| depth > usual).map(|depth| (i, depth, force))
        });
        inside.max_by(|a, b| (a.1[0] / a.1[1]).total_cmp(&(b.1[0] / b.1[1])))
    }

    /// Assembles a simulation from its parts, with `state` unchanged.
    fn assembled(machine: &Arc<Machine>, mechanism: Mechanism, state: State, reference: IdealTip) -> Self {
        let (n, joints) = (state.now.y.len(), state.now.gaps.len());
        Self {
            machine: machine.clone(),
            stepper: AnyStepper::new(machine.solver.method, n),
            reference,
            sampled: vec![(0.0, 0.0); joints],
            loads: None,
            attempt: Attempt {
                end: StepEnd::new(vec![0.0; n], joints),
                located: None,
                corner: None,
                edge: false,
                sides: Vec::with_capacity(2 * machine.elements.len()),
                pressed: std::array::from_fn(|_| Vec::with_capacity(2 * machine.elements.len())),
                turned: false,
                whole: None,
                beside: None,
                near_peak: false,
                strongest: vec![(0.0, 0.0); joints],
                stiffness: 0.0,
                counts: Counts::default(),
                factorisations: 0,
            },
            scratch_y: vec![0.0; n],
            scratch_k: vec![0.0; n],
            scratch_memory: vec![Memory::default(); joints],
            state,
            mechanism,
        }
    }

    /// Whether the method locates the instants at which contacts begin and end.
    fn locates(&self) -> bool {
        self.machine.solver.method.is_adaptive()
    }

    /// Recomputes derivative and gaps after a change of state other than a step; discards the previous step.
    fn refresh(&mut self) {
        self.end_flights();
        self.freeze_branches(true);
        let located = self.locates();
        let Self { mechanism, state, .. } = self;
        let State { now, .. } = state;
        let touching = ActiveSet::by(located, &now.memory);
        let mut evaluator = mechanism.evaluator(touching);
        evaluator.derivative(now.t, &now.y, &mut now.k);
        mechanism.complete_gaps(touching, &now.y);
        store_gaps(mechanism, &mut now.gaps);
        self.stepper.invalidate();
        // Forces jump here: a parabola across the jump would have a spurious peak.
        state.record.reactions.fill(Recent::default());
        self.begin_contacts_at_walls();
        self.state.discard_previous_step();
    }

    /// The machine with the changes so far.
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// Equations of motion.
    pub fn mechanism(&self) -> &Mechanism {
        &self.mechanism
    }

    /// Time of the latest state, s.
    pub fn time(&self) -> f64 {
        self.state.now.t
    }

    /// Time at the start of the latest step, s: [`Self::sample`] accepts times from here to [`Self::time`].
    pub fn step_start(&self) -> f64 {
        self.state.before.t
    }

    /// Counters since the last reset.
    pub fn statistics(&self) -> &Statistics {
        &self.state.record.statistics
    }

    /// Takes one accepted step.
    ///
    /// # Errors
    /// If the divergence guard stops the run; the state is then the last good one.
    pub fn step(&mut self) -> Result<(), Stopped> {
        self.advance(f64::INFINITY)
    }

    /// Takes one step that ends no later than `end`, and exactly there if it would overshoot.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_until(&mut self, end: f64) -> Result<(), Stopped> {
        if self.state.now.t >= end {
            return Ok(());
        }
        self.advance(end)
    }

    /// Steps until [`Self::time`] is at least `time`, without shortening a step.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn advance_to(&mut self, time: f64) -> Result<(), Stopped> {
        while self.state.now.t < time {
            self.step()?;
        }
        Ok(())
    }

    fn advance(&mut self, end: f64) -> Result<(), Stopped> {
        // Done here and not at the end of the previous step, because samples inside that step must still see the clearance move.
        self.finish_ramps();
        let limit = end.min(self.ramp_end());
        // Fixed steps ignore this limit: their size is the user's choice.
        let follows_drives = limit.min(self.mechanism.step_end(self.state.now.t));
        self.attempt.sides.clear();
        self.attempt.edge = false;
        if self.mechanism.is_kinematic() {
            self.kinematic_step(follows_drives)?;
        } else if self.machine.solver.method.is_adaptive() {
            let step = self.adaptive_step(follows_drives);
            if step.is_err() {
                self.forget_flown();
            }
            step?;
        } else {
            self.fixed_step(limit)?;
        }
        Ok(())
    }

    /// Whether `end` would truncate the next step.
    pub fn is_cut_by(&self, end: f64) -> bool {
        let (t, control) = (self.state.now.t, &self.state.control);
        let (t_end, h) = if self.mechanism.is_kinematic() {
            let h = self.mechanism.kinematic_step().min(LONGEST_STEP);
            (t + h, h)
        } else if self.machine.solver.method.is_adaptive() {
            let h = control.h_next.min(LONGEST_STEP);
            (t + h, h)
        } else {
            let step = self.machine.solver.step;
            let next = (control.grid_count + 1) as f64;
            (control.grid_origin + next * step, step)
        };
        t_end >= end - NEARLY * h
    }

    fn fixed_step(&mut self, limit: f64) -> Result<(), Stopped> {
        let step = self.machine.solver.step;
        let control = &self.state.control;
        let mut t_end = control.grid_origin + (control.grid_count + 1) as f64 * step;
        if t_end >= limit - NEARLY * step {
            t_end = limit;
        }
        let h = t_end - self.state.now.t;
        self.attempt.counts = Counts::default();
        self.try_step(h);
        self.accept(t_end, h)?;
        let control = &mut self.state.control;
        if t_end == limit {
            // The next grid begins where this one was cut.
            control.grid_origin = t_end;
            control.grid_count = 0;
        } else {
            control.grid_count += 1;
        }
        Ok(())
    }

    /// Tries a step of size `h` from the current state; returns the scaled error estimate.
    fn try_step(&mut self, h: f64) -> f64 {
        let located = self.locates();
        let Self { mechanism, stepper, state, attempt, machine, .. } = self;
        let StepEnd { t, y, k, memory, .. } = &state.now;
        mechanism.contacts.forget_left_pieces();
        mechanism.hold_elements(&attempt.sides);
        let mut evaluator = mechanism.evaluator(ActiveSet::by(located, memory));
        let end = &mut attempt.end;
        let tolerance = machine.solver.tolerance;
        let error = stepper.attempt(&mut evaluator, *t, h, y, k, &mut end.y, &mut end.k, tolerance);
        attempt.counts += evaluator.counts;
        attempt.factorisations += stepper.factorisations();
        attempt.stiffness = stepper.stiffness(&evaluator, h, &end.y, &end.k);
        mechanism.hold_elements(&[]);
        error
    }

    /// Evaluates derivative and gaps at the end `t_end` of the current step.
    fn evaluate_end(&mut self, t_end: f64) {
        let located = self.locates();
        let Self { mechanism, state, attempt, .. } = self;
        let end = &mut attempt.end;
        let mut evaluator = mechanism.evaluator(ActiveSet::by(located, &state.now.memory));
        evaluator.derivative(t_end, &end.y, &mut end.k);
        attempt.counts += evaluator.counts;
        self.finish_gaps(t_end);
    }

    /// Computes bodies in flight, and gaps, at the end `t_end` of the current step, after an evaluation there.
    fn finish_gaps(&mut self, t_end: f64) {
        let touching = ActiveSet::by(self.locates(), &self.state.now.memory);
        let end = &mut self.attempt.end;
        put_flights(&self.mechanism, &self.state.flights, t_end, &mut end.y);
        clear_flights(&self.mechanism, &self.state.flights, &mut end.k);
        self.mechanism.complete_gaps(touching, &end.y);
        store_gaps(&self.mechanism, &mut end.gaps);
    }

    /// Takes a step of a kinematic scene: predict, close the loops, compute the reactions. A failed step is retried with shorter
    /// ones, so that the last good state is close to the failure.
    fn kinematic_step(&mut self, limit: f64) -> Result<(), Stopped> {
        let t = self.state.now.t;
        let mut step = self.mechanism.kinematic_step().min(LONGEST_STEP);
        loop {
            let t_end = if t + step >= limit - NEARLY * step { limit } else { t + step };
            let (now, end) = (&self.state.now, &mut self.attempt.end);
            self.mechanism.predict(t_end - t, &now.y, &now.k, &mut self.scratch_k, &mut end.y);
            self.attempt.counts = Counts::default();
            match self.accept(t_end, t_end - t) {
                Err(_) if step > SHORTEST_KINEMATIC_STEP => {
                    self.state.record.statistics.rejected += 1;
                    step *= 0.25;
                }
                result => return result,
            }
        }
    }

    /// Accepts the attempted step: projection, guard, contact memory, peaks.
    fn accept(&mut self, t_end: f64, h: f64) -> Result<(), Stopped> {
        let open = self.mechanism.project(t_end, &mut self.attempt.end.y);
        let mean_rates = self.stepper.has_mean_rates();
        if mean_rates {
            // Forces at the end of the step belong to a contact that may end long before the next step does: the mean over the
            // step is more informative.
            let (mechanism, now) = (&mut self.mechanism, &self.state.now);
            let StepEnd { y, k, .. } = &mut self.attempt.end;
            mechanism.measure(t_end, y);
            mechanism.position_rate(y, k);
            for i in mechanism.positions()..y.len() {
                k[i] = (y[i] - now.y[i]) / h;
            }
            store_gaps(mechanism, &mut self.attempt.end.gaps);
        } else if !self.stepper.ends_with_derivative() || self.mechanism.projects() {
            self.evaluate_end(t_end);
        }
        self.state.record.statistics.count(self.attempt.counts);
        // Past a singular pose the loops may close again on another branch.
        let passed = self.mechanism.is_determinant_positive() != self.state.record.determinant_positive
            || self.mechanism.distance_from_ideal() > OTHER_BRANCH;
        let fault = if passed { Some(StopFault::SingularLoops) } else { self.divergence(open, h) };
        if let Some(fault) = fault {
            let solver = &self.machine.solver;
            let advice = if passed || open.is_nan() || open > OPEN_LOOP {
                StopAdvice::Dependent
            } else if solver.method.is_adaptive() {
                StopAdvice::GentlerMotion { tolerance: solver.tolerance }
            } else {
                StopAdvice::ShorterStep { step: solver.step }
            };
            return Err(self.stopped(fault, advice));
        }
        let State { now, before, record, .. } = &mut self.state;
        std::mem::swap(before, now);
        std::mem::swap(now, &mut self.attempt.end);
        now.t = t_end;
        now.memory.copy_from_slice(&before.memory);
        let statistics = &mut record.statistics;
        statistics.steps += 1;
        let drift = self.mechanism.constraint_drift();
        statistics.constraint_drift = statistics.constraint_drift.max(drift);
        let located = self.locates();
        if located {
            self.track_reactions();
        }
        self.find_strongest(h);
        let switched = self.switch_contacts(h);
        self.track_peaks(h);
        let again = (mean_rates && self.mechanism.has_reactions()) || (!mean_rates && switched.forces);
        if !again && !located {
            self.track_reactions();
        }
        self.record_step(h, switched.contacts || switched.forces);
        self.pass_corner();
        // The force now depends on the approach speed just found. Reactions of ideal joints need the derivative at the end even
        // if the method does not.
        if again {
            let Self { mechanism, state, scratch_k, .. } = self;
            let StepEnd { t, y, k, memory, .. } = &mut state.now;
            let rate = if mean_rates { scratch_k } else { k };
            let mut evaluator = mechanism.evaluator(ActiveSet::by(located, memory));
            evaluator.derivative(*t, y, rate);
            let counts = evaluator.counts;
            mechanism.forget_evaluation();
            state.record.statistics.count(counts);
            if !located {
                self.track_reactions();
            }
        }
        self.search_peaks();
        Ok(())
    }

    fn stopped(&self, fault: StopFault, advice: StopAdvice) -> Stopped {
        let dependent = self.mechanism.has_dependent_rows();
        Stopped { time: self.state.now.t, fault, advice: if dependent { StopAdvice::Dependent } else { advice } }
    }

    /// Why the probe has no ideal motion to be compared with: the ideal mechanism cannot start, or could not continue.
    pub fn probe_fault(&self) -> Option<ProbeFault> {
        self.reference.fault()
    }

    /// Forces at the latest state that the motion does not determine uniquely.
    pub fn not_unique(&mut self) -> Indeterminate {
        self.sample(self.state.now.t, &mut Frame::default());
        let mechanism = &mut self.mechanism;
        Indeterminate {
            reactions: (0..mechanism.cut_joints()).filter(|&j| !mechanism.is_reaction_unique(j)).collect(),
            actuators: (0..mechanism.drives()).filter(|&i| !mechanism.is_actuator_unique(i)).collect(),
        }
    }

    /// Moves the peaks of each ball joint since the last call into `out`, in joint order.
    pub fn take_peaks(&mut self, out: &mut Vec<Peak>) {
        out.clear();
        let peaks = &mut self.state.record.peaks;
        out.extend_from_slice(peaks);
        peaks.fill(Peak::default());
    }

    /// The latest finished impacts, at most 64, oldest first.
    pub fn impacts(&self) -> impl ExactSizeIterator<Item = &Impact> + DoubleEndedIterator {
        self.state.record.impacts.latest()
    }

    /// Appends to `out` the impacts that finished since the last call. None is lost if it is called after every step;
    /// otherwise only the latest 64 (more with more ball joints) are guaranteed.
    pub fn take_impacts(&mut self, out: &mut Vec<Impact>) {
        self.state.record.impacts.hand_out(out);
    }

    /// Coordinates, then velocities, as the formulation orders them.
    pub fn state(&self) -> &[f64] {
        &self.state.now.y
    }

    /// Contact memory of ball joint `j`: whether it is in contact, and its approach speed.
    pub fn contact_memory(&self, j: usize) -> Memory {
        self.state.now.memory[j]
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
