//! A scene in motion: stepping, events, live changes, snapshots. Depends on no clock.

mod adaptive;
mod automatic;
mod contacts;
mod corners;
mod displace;
mod doubts;
mod energy;
mod guard;
mod live;
mod sample;
mod search;
mod snapshot;

use super::ideal::Reference;
use super::impacts::{Impact, Impacts};
use super::ledger::Account;
use super::peaks::{Approach, Recent};
use super::stepper::AnyStepper;
use super::{Frame, NotUnique, Peak, StartError, Statistics, Stopped};
use crate::contact::Memory;
use crate::integrate::{Controller, System};
use crate::mechanism::{Mechanism, MechanismError, Ramp, Switching};
use crate::scene::Scene;
use automatic::{Choice, controller_of, prepare_implicit};
pub use automatic::{LARGEST_DENSE, LARGEST_IMPLICIT};
use corners::Piece;

/// Speed at which the clearance closes when a jump would put a ball inside its socket wall, m/s: an impact at this speed
/// is of the order of the settled forces.
pub const CLEARANCE_SPEED: f64 = 2e-3;
/// Longest step of an adaptive method, s.
const LONGEST_STEP: f64 = 10e-3;
/// Further than this from its closed form, an ideal motion is on another branch of it, m.
const OTHER_BRANCH: f64 = 1e-6;
/// How close a scene that is a function of time alone comes to a pose that it cannot pass, s.
const SHORTEST_KINEMATIC_STEP: f64 = 1e-5;
/// First step after a contact begins, before one is known to work, s: a tenth of a usual impact.
const FIRST_CONTACT_STEP: f64 = 1e-5;
/// Loops that are open by more than this after projection have come apart, m.
const OPEN_LOOP: f64 = 1e-7;

/// Advice where closed loops cannot stay closed.
const DEPENDENT: &str = "the ideal joints are (nearly) dependent here: keep clear of this pose, or give a joint a clearance";

/// A scene in motion.
///
/// The same scene and the same calls give the same bits.
pub struct Simulation {
    /// With changes that wait for a reset.
    scene: Scene,
    /// As it runs.
    running: Scene,
    mechanism: Mechanism,
    stepper: AnyStepper,
    state: State,
    peaks: Vec<Peak>,
    /// Largest force that a sample met and when, by joint: no part of the state, which sampling does not change.
    sampled: Vec<(f64, f64)>,
    /// Scratch of the step's end.
    y_end: Vec<f64>,
    k_end: Vec<f64>,
    scratch_y: Vec<f64>,
    scratch_k: Vec<f64>,
    gaps_end: Vec<Approach>,
    /// On which side of singular poses a scene that is a function of time alone started.
    right_handed: bool,
    /// Joint whose contact starts or ends at the end of the step being taken.
    located: Option<usize>,
    /// Joint that goes onto another piece of a law there.
    corner: Option<(usize, Piece)>,
    /// The step being taken was begun again on another piece.
    turned: bool,
    scratch_memory: Vec<Memory>,
    /// What the probe is compared with.
    pub(super) reference: Reference,
    /// The step just accepted may hold the largest force of a contact.
    near_peak: bool,
    /// Largest normal force of each joint that was in contact over the step just accepted, N, and at which part of it.
    strongest: Vec<(f64, f64)>,
}

/// What a snapshot copies.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct State {
    /// Start of the latest step.
    t0: f64,
    y0: Vec<f64>,
    k0: Vec<f64>,
    gaps0: Vec<Approach>,
    /// Contact memory that was in force during the latest step.
    memory0: Vec<Memory>,
    /// Now.
    t: f64,
    y: Vec<f64>,
    k: Vec<f64>,
    gaps: Vec<Approach>,
    memory: Vec<Memory>,
    /// Steps since the contact under way began.
    contact_steps: Vec<u64>,
    ramps: Vec<Option<Ramp>>,
    /// Clearances in force.
    clearances: Vec<f64>,
    /// Reactions of the ideal joints at the latest two instants, for their peaks between steps.
    reactions: Vec<Recent>,
    /// Next step of an adaptive method.
    h_next: f64,
    /// Step that worked after the latest contact began.
    h_contact: f64,
    /// A contact began at the latest event.
    contact_began: bool,
    /// How closely corners of the friction law followed one another, and whether too closely to locate them.
    chatter: u32,
    chatters: bool,
    /// Of the automatic pair the implicit method steps.
    implicit: bool,
    /// What the automatic pair's choice goes by.
    choice: Choice,
    controller: Controller,
    /// Fixed steps are counted from here, so that times do not accumulate rounding.
    grid_origin: f64,
    grid_count: u64,
    account: Account,
    impacts: Impacts,
    statistics: Statistics,
}

impl State {
    /// At t = 0 with the coordinates and velocities `y`.
    fn new(scene: &Scene, mechanism: &Mechanism, y: Vec<f64>) -> Self {
        let (n, joints) = (y.len(), mechanism.contacts.len());
        Self {
            t0: 0.0,
            y0: y.clone(),
            k0: vec![0.0; n],
            gaps0: vec![Approach::default(); joints],
            memory0: vec![Memory::default(); joints],
            t: 0.0,
            y,
            k: vec![0.0; n],
            gaps: vec![Approach::default(); joints],
            memory: vec![Memory::default(); joints],
            contact_steps: vec![0; joints],
            ramps: vec![None; joints],
            clearances: (0..joints)
                .map(|j| mechanism.contacts.clearance(j))
                .collect(),
            reactions: vec![Recent::default(); joints],
            h_next: scene.solver.step.min(LONGEST_STEP),
            h_contact: FIRST_CONTACT_STEP,
            contact_began: false,
            chatter: 0,
            chatters: false,
            implicit: false,
            choice: Choice::default(),
            controller: controller_of(scene.solver.method, false),
            grid_origin: 0.0,
            grid_count: 0,
            account: Account::default(),
            impacts: Impacts::new(joints),
            statistics: Statistics {
                impacts: vec![0; joints],
                floored: vec![0; joints],
                coarse: vec![0; joints],
                peak_normal: vec![0.0; joints],
                peak_time: vec![0.0; joints],
                last_separation: vec![f64::NAN; joints],
                damping: vec![0.0; joints],
                damping_time: vec![0.0; joints],
                ..Statistics::default()
            },
        }
    }
}

impl Simulation {
    /// Starts `scene` at t = 0.
    ///
    /// # Errors
    /// Ball joints that do not close, a trajectory that the rods cannot reach.
    pub fn new(scene: &Scene) -> Result<Self, StartError> {
        let mut mechanism = Mechanism::new(scene)?;
        let y = mechanism.start()?;
        prepare_implicit(&mut mechanism, scene.solver.method)?;
        let state = State::new(scene, &mechanism, y);
        let mut simulation = Self::assembled(scene, mechanism, state);
        simulation.begin_contacts_at_start();
        simulation.refresh();
        simulation.right_handed = simulation.mechanism.is_right_handed();
        if simulation.mechanism.distance_from_ideal() > OTHER_BRANCH {
            return Err(MechanismError::OtherBranch.into());
        }
        simulation.track_peaks(0.0);
        simulation.track_reactions();
        simulation.open_account();
        Ok(simulation)
    }

    /// With the equations of `scene` set up and `state` taken as it is.
    fn assembled(scene: &Scene, mut mechanism: Mechanism, state: State) -> Self {
        let (n, joints) = (state.y.len(), state.gaps.len());
        mechanism.contacts.switching = switching_of(scene);
        Self {
            scene: scene.clone(),
            running: scene.clone(),
            stepper: AnyStepper::new(scene.solver.method, n),
            state,
            peaks: vec![Peak::default(); joints],
            sampled: vec![(0.0, 0.0); joints],
            y_end: vec![0.0; n],
            k_end: vec![0.0; n],
            scratch_y: vec![0.0; n],
            scratch_k: vec![0.0; n],
            gaps_end: vec![Approach::default(); joints],
            right_handed: true,
            located: None,
            corner: None,
            turned: false,
            scratch_memory: vec![Memory::default(); joints],
            reference: Reference::of(scene),
            near_peak: false,
            strongest: vec![(0.0, 0.0); joints],
            mechanism,
        }
    }

    /// Contacts that exist at the start take the floor as their approach speed: nothing tells how they began.
    fn begin_contacts_at_start(&mut self) {
        self.mechanism.measure(self.state.t, &self.state.y);
        for j in 0..self.state.memory.len() {
            if self.mechanism.contacts.has_clearance(j)
                && self.mechanism.contacts.gaps()[j].penetration > 0.0
            {
                let coefficients = self.mechanism.contacts.coefficients(j);
                self.state.memory[j] = Memory::begun(coefficients, f64::NEG_INFINITY);
                self.state.statistics.impacts[j] += 1;
                self.state.statistics.floored[j] += 1;
            }
        }
    }

    /// Recomputes derivative and gaps of the current state after anything but a step changed it; forgets the step before.
    fn refresh(&mut self) {
        self.hold_pieces(true);
        let Self {
            mechanism, state, ..
        } = self;
        mechanism
            .contacts
            .memory_mut()
            .copy_from_slice(&state.memory);
        let evaluations = mechanism.evaluations;
        mechanism.derivative(state.t, &state.y, &mut state.k);
        mechanism.evaluations = evaluations;
        mechanism.contacts.finish();
        store_gaps(mechanism, &mut state.gaps);
        self.stepper.invalidate();
        // Forces jump here: a parabola through both sides would have a peak that never was.
        state.reactions.fill(Recent::default());
        state.t0 = state.t;
        state.y0.copy_from_slice(&state.y);
        state.k0.copy_from_slice(&state.k);
        state.gaps0.copy_from_slice(&state.gaps);
        state.memory0.copy_from_slice(&state.memory);
        state.grid_origin = state.t;
        state.grid_count = 0;
    }

    /// The scene with every change, those that wait for a reset included.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene as it runs now: without the changes that wait for a reset.
    pub fn running_scene(&self) -> &Scene {
        &self.running
    }

    /// Equations of motion.
    pub fn mechanism(&self) -> &Mechanism {
        &self.mechanism
    }

    /// Time of the latest state, s.
    pub fn time(&self) -> f64 {
        self.state.t
    }

    /// Time at the start of the latest step, s: [`Self::sample`] accepts times from here to [`Self::time`].
    pub fn step_start(&self) -> f64 {
        self.state.t0
    }

    /// Counters since the last reset.
    pub fn statistics(&self) -> &Statistics {
        &self.state.statistics
    }

    /// One accepted step.
    ///
    /// # Errors
    /// The divergence guard; the state is then the last good one.
    pub fn step(&mut self) -> Result<(), Stopped> {
        self.advance(f64::INFINITY)
    }

    /// One step that ends at `end` at the latest, exactly there if it would pass it.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_until(&mut self, end: f64) -> Result<(), Stopped> {
        if self.state.t >= end {
            return Ok(());
        }
        self.advance(end)
    }

    /// Steps until [`Self::time`] is at least `time`, never shortening a step.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn advance_to(&mut self, time: f64) -> Result<(), Stopped> {
        while self.state.t < time {
            self.step()?;
        }
        Ok(())
    }

    fn advance(&mut self, end: f64) -> Result<(), Stopped> {
        // Not at the end of the step before: samples inside it still see the clearance on its way.
        self.finish_ramps();
        let limit = end.min(self.ramp_end());
        if self.mechanism.is_kinematic() {
            self.kinematic_step(limit)?;
        } else if self.running.solver.method.is_adaptive() {
            self.adaptive_step(limit)?;
        } else {
            self.fixed_step(limit)?;
        }
        Ok(())
    }

    fn fixed_step(&mut self, limit: f64) -> Result<(), Stopped> {
        let Self {
            mechanism,
            stepper,
            state,
            y_end,
            k_end,
            ..
        } = self;
        let evaluations = mechanism.evaluations;
        mechanism
            .contacts
            .memory_mut()
            .copy_from_slice(&state.memory);
        let (t, step) = (state.t, self.running.solver.step);
        let mut t_end = state.grid_origin + (state.grid_count + 1) as f64 * step;
        if t_end >= limit - 1e-6 * step {
            t_end = limit;
        }
        let h = t_end - t;
        let tolerance = self.running.solver.tolerance;
        stepper.attempt(mechanism, t, h, &state.y, &state.k, y_end, k_end, tolerance);
        self.accept(t_end, h, evaluations)?;
        if t_end == limit {
            // The next grid begins where this one was cut.
            self.state.grid_origin = t_end;
            self.state.grid_count = 0;
        } else {
            self.state.grid_count += 1;
        }
        Ok(())
    }

    /// A step of a scene whose motion is a function of time alone: predict, close the loops, read the reactions. Where
    /// that fails it comes closer in shorter steps, so that the last good state is next to the bad one.
    fn kinematic_step(&mut self, limit: f64) -> Result<(), Stopped> {
        let t = self.state.t;
        let mut step = self.mechanism.kinematic_step().min(LONGEST_STEP);
        loop {
            let Self {
                mechanism,
                state,
                y_end,
                scratch_k,
                ..
            } = self;
            let evaluations = mechanism.evaluations;
            let t_end = if t + step >= limit - 1e-6 * step {
                limit
            } else {
                t + step
            };
            mechanism.predict(t_end - t, &state.y, &state.k, scratch_k, y_end);
            match self.accept(t_end, t_end - t, evaluations) {
                Err(_) if step > SHORTEST_KINEMATIC_STEP => {
                    self.state.statistics.rejected += 1;
                    step *= 0.25;
                }
                result => return result,
            }
        }
    }

    /// Makes the attempted step count: projection, guard, contact memory, peaks.
    fn accept(&mut self, t_end: f64, h: f64, evaluations: u64) -> Result<(), Stopped> {
        let Self {
            mechanism,
            stepper,
            state,
            y_end,
            k_end,
            gaps_end,
            ..
        } = self;
        let open = mechanism.project(t_end, y_end);
        if stepper.differs_rates() {
            // Forces at its end are those of a contact that may be long over by the next: the step's own mean tells more.
            mechanism.measure(t_end, y_end);
            mechanism.position_rate(t_end, y_end, k_end);
            for i in mechanism.positions()..y_end.len() {
                k_end[i] = (y_end[i] - state.y[i]) / h;
            }
            store_gaps(mechanism, gaps_end);
        } else if !stepper.ends_with_derivative() || mechanism.projects() {
            mechanism.derivative(t_end, y_end, k_end);
            mechanism.contacts.finish();
            store_gaps(mechanism, gaps_end);
        }
        state.statistics.evaluations += mechanism.evaluations - evaluations;
        // The loops may close again behind the pose, on another branch.
        let passed = mechanism.is_right_handed() != self.right_handed
            || mechanism.distance_from_ideal() > OTHER_BRANCH;
        let objection = if passed {
            Some("the loops through the ideal ball joints pass a singular pose".to_owned())
        } else {
            self.objection(open, h)
        };
        if let Some(what) = objection {
            let solver = &self.running.solver;
            let advice = if passed || open.is_nan() || open > OPEN_LOOP {
                DEPENDENT.to_owned()
            } else if solver.method.is_adaptive() {
                // Its steps are as short as they need to be: the motion itself is beyond the model.
                format!(
                    "try slower drives, a stiffer contact, or a tighter solver.tolerance (now {:e})",
                    solver.tolerance
                )
            } else {
                format!(
                    "try a smaller solver.step (now {:e} s) or solver.method = automatic, or else a stiffer contact",
                    solver.step
                )
            };
            return Err(self.stopped(&what, advice));
        }
        let Self {
            mechanism,
            state,
            y_end,
            k_end,
            gaps_end,
            ..
        } = self;
        state.t0 = state.t;
        std::mem::swap(&mut state.y0, &mut state.y);
        std::mem::swap(&mut state.k0, &mut state.k);
        std::mem::swap(&mut state.gaps0, &mut state.gaps);
        state.memory0.copy_from_slice(&state.memory);
        state.t = t_end;
        std::mem::swap(&mut state.y, y_end);
        std::mem::swap(&mut state.k, k_end);
        std::mem::swap(&mut state.gaps, gaps_end);
        state.statistics.steps += 1;
        state.statistics.constraint_drift = state
            .statistics
            .constraint_drift
            .max(mechanism.constraint_drift());
        let differs = self.stepper.differs_rates();
        let located = self.mechanism.contacts.switching == Switching::Located;
        if located {
            self.track_reactions();
        }
        self.find_strongest(h);
        let switched = self.switch_contacts(h);
        self.track_peaks(h);
        let again = (differs && self.mechanism.has_reactions()) || (!differs && switched.forces);
        if !again && !located {
            self.track_reactions();
        }
        self.book_step(h, switched.contacts || switched.forces);
        self.pass_corner();
        let Self {
            mechanism,
            state,
            scratch_k,
            ..
        } = self;
        let rate = if differs { scratch_k } else { &mut state.k };
        // The force now divides by the approach speed just found. Where no step needs the derivative at its end, the reactions of
        // ideal joints do.
        if again {
            mechanism
                .contacts
                .memory_mut()
                .copy_from_slice(&state.memory);
            mechanism.derivative(state.t, &state.y, rate);
            mechanism.forget_evaluation();
            state.statistics.evaluations += 1;
            if !located {
                self.track_reactions();
            }
        }
        self.search_peaks();
        Ok(())
    }

    fn stopped(&self, what: &str, advice: String) -> Stopped {
        let advice = if self.mechanism.least_pivot() < 1e-12 {
            DEPENDENT.to_owned()
        } else {
            advice
        };
        Stopped {
            time: self.state.t,
            what: what.to_owned(),
            advice,
        }
    }

    /// Why there is nothing, or nothing any more, that the probe could be compared with: the ideal mechanism does not start,
    /// or came to where it cannot go on.
    pub fn probe_fault(&self) -> Option<String> {
        self.reference.fault()
    }

    /// Forces at the latest state that the motion does not fix.
    pub fn not_unique(&mut self) -> NotUnique {
        self.sample(self.state.t, &mut Frame::default());
        let Self {
            mechanism, state, ..
        } = self;
        NotUnique {
            reactions: (0..state.gaps.len())
                .filter(|&j| !mechanism.is_reaction_unique(j))
                .collect(),
            actuators: (0..mechanism.drives())
                .filter(|&i| !mechanism.is_actuator_unique(i))
                .collect(),
        }
    }

    /// Peaks per ball joint since the last call, written to `out` in joint order, and forgotten here.
    pub fn take_peaks(&mut self, out: &mut Vec<Peak>) {
        out.clear();
        out.extend_from_slice(&self.peaks);
        self.peaks.fill(Peak::default());
    }

    /// The latest finished impacts, at most 64, the oldest first.
    pub fn impacts(&self) -> impl ExactSizeIterator<Item = &Impact> + DoubleEndedIterator {
        self.state.impacts.latest()
    }

    /// Appends to `out` the impacts that finished since the last call. None is lost if it is called after every step;
    /// otherwise only the latest 64 (more where there are more ball joints) are sure to be there.
    pub fn take_impacts(&mut self, out: &mut Vec<Impact>) {
        self.state.impacts.hand_out(out);
    }

    /// Back to t = 0 with the parameters as they are now, those that wait for a reset included.
    ///
    /// # Errors
    /// As [`Self::new`]; the simulation is then unchanged.
    pub fn reset(&mut self) -> Result<(), StartError> {
        *self = Self::new(&self.scene)?;
        Ok(())
    }

    /// Coordinates, then velocities, as the formulation orders them.
    pub fn state(&self) -> &[f64] {
        &self.state.y
    }

    /// Contact memory of ball joint `j`: whether it is in contact, with which approach speed.
    pub fn contact_memory(&self, j: usize) -> Memory {
        self.state.memory[j]
    }
}

fn switching_of(scene: &Scene) -> Switching {
    if scene.solver.method.is_adaptive() {
        Switching::Located
    } else {
        Switching::Immediate
    }
}

fn store_gaps(mechanism: &Mechanism, out: &mut [Approach]) {
    for (out, gap) in out.iter_mut().zip(mechanism.contacts.gaps()) {
        *out = Approach {
            penetration: gap.penetration,
            rate: gap.rate,
            speed: gap.eccentricity_rate.norm(),
        };
    }
}
