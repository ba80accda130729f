//! A scene in motion: stepping, events, live changes, snapshots. Depends on no clock.

use super::peaks::{Approach, Course};
use super::stepper::AnyStepper;
use super::{Effect, Frame, Peak, Snapshot, StartError, Statistics, Stopped, report};
use crate::integrate::{Controller, Method, System, find_root, hermite};
use crate::mechanism::{Mechanism, MechanismError, Memory, Ramp, Switching};
use crate::scene::{Scene, SceneError};

/// Speed at which the clearance closes when a jump would put a ball inside its socket wall, m/s: an impact at this speed
/// is of the order of the settled forces.
pub const CLEARANCE_SPEED: f64 = 2e-3;
/// Longest step of an adaptive method, s.
const LONGEST_STEP: f64 = 10e-3;
/// Shortest step of an adaptive method, s.
const SHORTEST_STEP: f64 = 1e-14;
/// Step of a scene that is a function of time alone, s: nothing accumulates, so it only spaces the peaks that are seen.
const KINEMATIC_STEP: f64 = 2e-3;
/// First step after a contact begins, before one is known to work, s: a tenth of a usual impact.
const FIRST_CONTACT_STEP: f64 = 1e-5;
/// h |lambda| beyond which an explicit step is held by stability.
const HELD_BY_STABILITY: f64 = 3.0;
/// Steps that must be held by stability, or taken since the latest contact began, before the implicit method is tried.
const HELD_STEPS: u32 = 8;
const SETTLED_STEPS: u32 = 60;
/// Over so many implicit steps the progress per evaluation must be this many times the explicit method's; else the
/// explicit one has its turn for so many steps.
const TRIAL_STEPS: u32 = 12;
const WORTH_IT: f64 = 2.0;
const EXPLICIT_TURN: u32 = 200;
/// Evaluations of one explicit step.
const EXPLICIT_EVALUATIONS: f64 = 6.0;
/// More velocity coordinates than this are refused by the implicit methods, whose matrices are dense.
const LARGEST_DENSE: usize = 1024;
/// More velocity coordinates than this make a dense factorisation dearer than many explicit steps.
const LARGEST_IMPLICIT: usize = 96;
/// Speed beyond which a state is absurd, m/s and rad/s.
const ABSURD_SPEED: f64 = 1e6;
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
    /// Scratch of the step's end.
    y_end: Vec<f64>,
    k_end: Vec<f64>,
    scratch_y: Vec<f64>,
    scratch_k: Vec<f64>,
    gaps_end: Vec<Approach>,
    scratch_memory: Vec<Memory>,
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
    ramps: Vec<Option<Ramp>>,
    /// Clearances in force.
    clearances: Vec<f64>,
    /// Next step of an adaptive method.
    h_next: f64,
    /// Step that worked after the latest contact began.
    h_contact: f64,
    /// A contact began at the latest event.
    contact_began: bool,
    /// Of the automatic pair the linearly implicit method steps.
    implicit: bool,
    /// What the automatic pair's choice goes by.
    choice: Choice,
    controller: Controller,
    /// Fixed steps are counted from here, so that times do not accumulate rounding.
    grid_origin: f64,
    grid_count: u64,
    statistics: Statistics,
}

/// Memory of the automatic pair.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Choice {
    /// Explicit steps since the latest contact began, and how many of them were held by stability.
    since_contact: u32,
    held: u32,
    /// Explicit steps before the implicit method may be tried again.
    wait: u32,
    /// Explicit step at the latest change to the implicit method, s.
    h_explicit: f64,
    /// Time and evaluations of the implicit steps on trial.
    progress: f64,
    cost: u64,
    steps: u32,
}

impl Simulation {
    /// Starts `scene` at t = 0.
    ///
    /// # Errors
    /// Ball joints that do not close, a trajectory that the rods cannot reach.
    pub fn new(scene: &Scene) -> Result<Self, StartError> {
        let mut mechanism = Mechanism::new(scene)?;
        let y = mechanism.start()?;
        let n = y.len();
        prepare_implicit(&mut mechanism, scene.solver.method)?;
        let joints = mechanism.contacts.len();
        let mut simulation = Self {
            scene: scene.clone(),
            running: scene.clone(),
            stepper: AnyStepper::new(scene.solver.method, n),
            state: State {
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
                ramps: vec![None; joints],
                clearances: (0..joints)
                    .map(|j| mechanism.contacts.clearance(j))
                    .collect(),
                h_next: scene.solver.step.min(LONGEST_STEP),
                h_contact: FIRST_CONTACT_STEP,
                contact_began: false,
                implicit: false,
                choice: Choice::default(),
                controller: controller_of(scene.solver.method, false),
                grid_origin: 0.0,
                grid_count: 0,
                statistics: Statistics {
                    impacts: vec![0; joints],
                    peak_normal: vec![0.0; joints],
                    peak_time: vec![0.0; joints],
                    last_separation: vec![f64::NAN; joints],
                    ..Statistics::default()
                },
            },
            peaks: vec![Peak::default(); joints],
            y_end: vec![0.0; n],
            k_end: vec![0.0; n],
            scratch_y: vec![0.0; n],
            scratch_k: vec![0.0; n],
            gaps_end: vec![Approach::default(); joints],
            scratch_memory: vec![Memory::default(); joints],
            mechanism,
        };
        simulation.mechanism.contacts.switching = switching_of(scene);
        simulation.begin_contacts_at_start();
        simulation.refresh();
        Ok(simulation)
    }

    /// Contacts that exist at the start take the floor as their approach speed: nothing tells how they began.
    fn begin_contacts_at_start(&mut self) {
        self.mechanism.measure(self.state.t, &self.state.y);
        for j in 0..self.state.memory.len() {
            if self.mechanism.contacts.has_clearance(j)
                && self.mechanism.contacts.gaps()[j].penetration > 0.0
            {
                let approach_speed = self.mechanism.contacts.coefficients(j).speed_floor;
                self.state.memory[j] = Memory {
                    active: true,
                    approach_speed,
                    floored: true,
                };
                self.state.statistics.impacts[j] += 1;
            }
        }
    }

    /// Recomputes derivative and gaps of the current state after anything but a step changed it; forgets the step before.
    fn refresh(&mut self) {
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
        mechanism.contacts.finish(state.t);
        store_gaps(mechanism, &mut state.gaps);
        self.stepper.invalidate();
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

    /// A step whose size follows the error estimate, cut at the first contact start or end inside it.
    fn adaptive_step(&mut self, limit: f64) -> Result<(), Stopped> {
        let before = self.mechanism.evaluations;
        let contacts = self.mechanism.contacts.memory_mut();
        contacts.copy_from_slice(&self.state.memory);
        self.stepper.choose(self.state.implicit);
        let (t_end, h) = loop {
            if let Some(step) = self.attempt_adaptive(limit) {
                break step;
            }
            self.state.statistics.rejected += 1;
            let shortest = SHORTEST_STEP.max(4.0 * f64::EPSILON * self.state.t);
            if !(self.state.h_next >= shortest) {
                self.state.statistics.evaluations += self.mechanism.evaluations - before;
                self.state.h_next = self.running.solver.step;
                let what = "the step size that the tolerance asks for fell below 1e-14 s";
                let tolerance = self.running.solver.tolerance;
                let advice = format!(
                    "try a looser solver.tolerance (now {tolerance:e}) or a softer or heavier scene"
                );
                return Err(self.stopped(what, advice));
            }
        };
        let stiffness = self.stepper.stiffness(h, &self.y_end, &self.k_end);
        let evaluations = self.mechanism.evaluations - before;
        self.accept(t_end, h, before)?;
        if self.running.solver.method == Method::Automatic {
            self.vote(h, stiffness, evaluations);
        }
        Ok(())
    }

    /// One try of a step with its event; `None` where it has to be repeated with the smaller `h_next` that it left.
    fn attempt_adaptive(&mut self, limit: f64) -> Option<(f64, f64)> {
        let t = self.state.t;
        let tolerance = self.running.solver.tolerance;
        let mut h = self.state.h_next.min(LONGEST_STEP);
        let mut t_end = t + h;
        let cut = t_end >= limit - 1e-6 * h;
        if cut {
            t_end = limit;
            h = limit - t;
        }
        let error = self.attempt(h) / tolerance;
        let state = &mut self.state;
        if !(error <= 1.0) {
            state.h_next = h * state.controller.after_reject(error);
            return None;
        }
        let next = h * state.controller.after_accept(error);
        // A step cut short says nothing against the longer one.
        state.h_next = if cut { state.h_next.max(next) } else { next };
        let contact_began = std::mem::take(&mut state.contact_began);
        self.finish_gaps(t_end);
        if let Some(theta) = self.first_event(h) {
            // The step is taken again, shorter, so that its end carries the method's error and not the interpolant's.
            t_end = t + theta * h;
            h *= theta;
            if !self.attempt(h).is_finite() {
                self.state.h_next = 0.5 * h;
                self.state.contact_began = contact_began;
                return None;
            }
            self.finish_gaps(t_end);
        } else if contact_began {
            self.state.h_contact = h.max(1e-9);
        }
        Some((t_end, h))
    }

    /// Tries a step of size `h` from the current state; returns the error against the scales.
    fn attempt(&mut self, h: f64) -> f64 {
        let Self {
            mechanism,
            stepper,
            state,
            y_end,
            k_end,
            ..
        } = self;
        let tolerance = self.running.solver.tolerance;
        stepper.attempt(
            mechanism, state.t, h, &state.y, &state.k, y_end, k_end, tolerance,
        )
    }

    fn finish_gaps(&mut self, t_end: f64) {
        self.mechanism.contacts.finish(t_end);
        store_gaps(&self.mechanism, &mut self.gaps_end);
    }

    /// Which method of the automatic pair takes the next step, after one of size `h` that took so many evaluations.
    fn vote(&mut self, h: f64, stiffness: f64, evaluations: u64) {
        let state = &mut self.state;
        let choice = &mut state.choice;
        if state.contact_began {
            choice.since_contact = 0;
            choice.held = 0;
            // An impact is short and not stiff: the explicit method resolves it at less cost.
            if state.implicit && state.memory.iter().any(|m| m.active && !m.floored) {
                state.implicit = false;
                state.controller = controller_of(Method::Automatic, false);
            }
            return;
        }
        if state.implicit {
            choice.progress += h;
            choice.cost += evaluations;
            choice.steps += 1;
            if choice.steps >= TRIAL_STEPS {
                let explicit = choice.h_explicit / EXPLICIT_EVALUATIONS;
                if choice.progress < WORTH_IT * explicit * choice.cost as f64 {
                    state.implicit = false;
                    state.controller = controller_of(Method::Automatic, false);
                    state.h_next = choice.h_explicit;
                    choice.wait = EXPLICIT_TURN;
                }
                (choice.progress, choice.cost, choice.steps) = (0.0, 0, 0);
            }
            return;
        }
        choice.since_contact += 1;
        choice.held = if stiffness > HELD_BY_STABILITY {
            choice.held + 1
        } else {
            choice.held.saturating_sub(1)
        };
        if choice.wait > 0 {
            choice.wait -= 1;
            return;
        }
        let settled = choice.held >= HELD_STEPS || choice.since_contact >= SETTLED_STEPS;
        let velocities = state.y.len() - self.mechanism.positions();
        if settled && velocities <= LARGEST_IMPLICIT && state.memory.iter().any(|m| m.active) {
            state.implicit = true;
            state.controller = controller_of(Method::Automatic, true);
            *choice = Choice {
                h_explicit: h,
                ..Choice::default()
            };
        }
    }

    /// Fraction of the step just attempted at which the first contact starts or ends, if one does.
    fn first_event(&mut self, h: f64) -> Option<f64> {
        let mut first: Option<f64> = None;
        for j in 0..self.gaps_end.len() {
            if !self.mechanism.contacts.has_clearance(j) {
                continue;
            }
            let (start, end) = (self.state.gaps[j], self.gaps_end[j]);
            let course = Course::new(start, end, h);
            // Positive where the contact is in the other state than its memory says.
            let sign = if self.state.memory[j].active {
                -1.0
            } else {
                1.0
            };
            let (from, to) = (sign * start.penetration, sign * end.penetration);
            let (from_rate, to_rate) = (sign * start.rate, sign * end.rate);
            let bracket = if to > 0.0 {
                if from < 0.0 {
                    Some((0.0, from, 1.0, to))
                } else if from_rate < 0.0 && to_rate > 0.0 {
                    // Switched at the start of this step, went the right way and came back.
                    let theta = course.extremum();
                    let value = sign * self.penetration_at(j, theta, h);
                    (value < 0.0).then_some((theta, value, 1.0, to))
                } else {
                    None
                }
            } else if from < 0.0 && from_rate > 0.0 && to_rate < 0.0 {
                // Grazes between two steps.
                let theta = course.extremum();
                let value = if sign * course.at(theta).0 > 0.0 {
                    sign * self.penetration_at(j, theta, h)
                } else {
                    -1.0
                };
                (value > 0.0).then_some((0.0, from, theta, value))
            } else {
                None
            };
            let theta = match bracket {
                Some((a, fa, b, fb)) => {
                    let width = (1e-15 / h).max(1e-12);
                    find_root(a, fa, b, fb, width, 1e-16, |theta| {
                        sign * self.penetration_at(j, theta, h)
                    })
                }
                // Wrong all along: switch as soon as a step allows it.
                None if to > 0.0 => 1.0,
                None => continue,
            };
            first = Some(first.map_or(theta, |f: f64| f.min(theta)));
        }
        first.filter(|&theta| theta < 1.0)
    }

    /// Penetration of joint `j` on the interpolant of the attempted step.
    fn penetration_at(&mut self, j: usize, theta: f64, h: f64) -> f64 {
        let Self {
            mechanism,
            stepper,
            state,
            y_end,
            k_end,
            scratch_y,
            ..
        } = self;
        stepper.interpolate(theta, h, &state.y, &state.k, y_end, k_end, scratch_y);
        mechanism.measure(state.t + theta * h, scratch_y);
        mechanism.contacts.gaps()[j].penetration
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

    /// A step of a scene whose motion is a function of time alone: predict, close the loops, read the reactions.
    fn kinematic_step(&mut self, limit: f64) -> Result<(), Stopped> {
        let Self {
            mechanism,
            state,
            y_end,
            ..
        } = self;
        let evaluations = mechanism.evaluations;
        let t = state.t;
        let mut t_end = t + KINEMATIC_STEP;
        if t_end >= limit - 1e-6 * KINEMATIC_STEP {
            t_end = limit;
        }
        let h = t_end - t;
        for i in 0..y_end.len() {
            y_end[i] = state.y[i] + h * state.k[i];
        }
        self.accept(t_end, h, evaluations)
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
        if !stepper.ends_with_derivative() || mechanism.projects() {
            mechanism.derivative(t_end, y_end, k_end);
            mechanism.contacts.finish(t_end);
            store_gaps(mechanism, gaps_end);
        }
        state.statistics.evaluations += mechanism.evaluations - evaluations;
        if let Some(what) = self.objection(open) {
            let solver = &self.running.solver;
            let advice = if open.is_nan() || open > OPEN_LOOP {
                DEPENDENT.to_owned()
            } else if solver.method.is_adaptive() {
                // Its steps are as short as they need to be: the motion itself is beyond the model.
                format!(
                    "try slower drives, a stiffer contact, or a tighter solver.tolerance (now {:e})",
                    solver.tolerance
                )
            } else {
                format!(
                    "try a smaller solver.step (now {:e} s) or solver.method = dopri5",
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
        self.track_peaks(h);
        if self.switch_contacts(h) && self.mechanism.contacts.switching == Switching::Immediate {
            // The force now divides by the approach speed just found.
            let Self {
                mechanism, state, ..
            } = self;
            mechanism
                .contacts
                .memory_mut()
                .copy_from_slice(&state.memory);
            mechanism.derivative(state.t, &state.y, &mut state.k);
            state.statistics.evaluations += 1;
        }
        Ok(())
    }

    /// Starts and ends contacts whose penetration changed sign over the step just accepted.
    fn switch_contacts(&mut self, h: f64) -> bool {
        let Self {
            mechanism,
            state,
            peaks,
            ..
        } = self;
        let mut switched = false;
        for j in 0..state.gaps.len() {
            if !mechanism.contacts.has_clearance(j) {
                continue;
            }
            let (start, end) = (state.gaps0[j], state.gaps[j]);
            let touching = end.penetration > 0.0
                // Located a hair before the wall.
                || (!state.memory[j].active && end.penetration > -1e-15 && end.rate > 0.0);
            if touching == state.memory[j].active {
                continue;
            }
            switched = true;
            if touching {
                let rate = if start.penetration < 0.0 && end.penetration > 0.0 {
                    let course = Course::new(start, end, h);
                    course.at(course.crossing()).1
                } else {
                    end.rate
                };
                let floor = mechanism.contacts.coefficients(j).speed_floor;
                state.memory[j] = Memory {
                    active: true,
                    approach_speed: rate.max(floor),
                    floored: rate < floor,
                };
                state.statistics.impacts[j] += 1;
                peaks[j].impacts += 1;
                peaks[j].approach_speed = peaks[j].approach_speed.max(rate);
                state.contact_began = true;
                state.h_next = state.h_next.min(state.h_contact);
            } else {
                state.memory[j] = Memory::default();
                state.statistics.last_separation[j] = state.t;
            }
        }
        switched
    }

    /// Largest forces of the step just accepted, in continuous time.
    fn track_peaks(&mut self, h: f64) {
        let Self {
            mechanism,
            state,
            peaks,
            ..
        } = self;
        for j in 0..state.gaps.len() {
            if !mechanism.contacts.has_clearance(j) {
                if let Some(reaction) = mechanism.reaction(j) {
                    let force = reaction.norm();
                    if force > state.statistics.peak_normal[j] {
                        state.statistics.peak_normal[j] = force;
                        state.statistics.peak_time[j] = state.t;
                    }
                    if force > peaks[j].normal {
                        peaks[j].normal = force;
                        peaks[j].time = state.t;
                        peaks[j].normal_force = reaction;
                    }
                }
                continue;
            }
            let (start, end) = (state.gaps0[j], state.gaps[j]);
            if start.penetration <= 0.0 && end.penetration <= 0.0 {
                continue;
            }
            let coefficients = mechanism.contacts.coefficients(j);
            let approach = if state.memory0[j].active {
                state.memory0[j].approach_speed
            } else {
                start.rate.max(end.rate).max(coefficients.speed_floor)
            };
            let (force, theta) = Course::new(start, end, h).strongest(coefficients, approach);
            let time = state.t0 + theta * h;
            if force > state.statistics.peak_normal[j] {
                state.statistics.peak_normal[j] = force;
                state.statistics.peak_time[j] = time;
            }
            if force > peaks[j].normal {
                let gap = &mechanism.contacts.gaps()[j];
                let n = if gap.eccentricity.norm() > 0.0 {
                    gap.eccentricity.normalize()
                } else {
                    gap.eccentricity
                };
                peaks[j].normal = force;
                peaks[j].time = time;
                peaks[j].normal_force = n * -force;
                // Friction follows the normal force within a step: its ratio at the step's end serves for the peak.
                peaks[j].friction_force = if gap.normal_force > 0.0 {
                    gap.friction * (force / gap.normal_force)
                } else {
                    gap.friction
                };
            }
        }
    }

    /// What is wrong with the step just attempted, if anything.
    fn objection(&self, open: f64) -> Option<String> {
        if !(open <= OPEN_LOOP) {
            return Some(format!(
                "the loops through the ideal ball joints came apart by {open:.1e} m"
            ));
        }
        for j in 0..self.gaps_end.len() {
            if !self.mechanism.contacts.has_clearance(j) {
                continue;
            }
            let penetration = self.gaps_end[j].penetration;
            let radius = self.mechanism.contacts.coefficients(j).ball_radius;
            if !(penetration <= radius) {
                let name = &self.running.ball_joints[j].name;
                return Some(format!(
                    "ball joint {name}: the ball is {penetration:.3e} m inside its socket wall, more than its radius"
                ));
            }
        }
        for (m, body) in self.mechanism.motion().iter().zip(&self.running.bodies) {
            let (v, w) = (m.velocity.norm(), m.angular_velocity.norm());
            let sane = v <= ABSURD_SPEED && w <= ABSURD_SPEED;
            if !(sane && m.position.iter().all(|x| x.is_finite())) {
                return Some(format!(
                    "body {}: speed {v:.3e} m/s, angular speed {w:.3e} rad/s",
                    body.name
                ));
            }
        }
        if self.k_end.iter().chain(&self.y_end).any(|x| !x.is_finite()) {
            return Some("the accelerations are not finite".to_owned());
        }
        None
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

    /// Everything at `time`, interpolated within the latest step; forces come from the interpolated state.
    /// Allocates only while `out` is too small.
    pub fn sample(&mut self, time: f64, out: &mut Frame) {
        let Self {
            mechanism,
            stepper,
            state,
            scratch_y,
            scratch_k,
            scratch_memory,
            ..
        } = self;
        let counts = (mechanism.evaluations, mechanism.contacts.evaluations);
        let h = state.t - state.t0;
        let time = time.clamp(state.t0, state.t);
        let inside = h > 0.0 && time < state.t;
        if inside {
            let theta = (time - state.t0) / h;
            if mechanism.is_kinematic() {
                hermite(
                    theta, h, &state.y0, &state.k0, &state.y, &state.k, scratch_y,
                );
            } else {
                stepper.interpolate(
                    theta, h, &state.y0, &state.k0, &state.y, &state.k, scratch_y,
                );
            }
            mechanism.project(time, scratch_y);
        } else {
            scratch_y.copy_from_slice(&state.y);
        }
        let memory = if inside {
            &state.memory0
        } else {
            &state.memory
        };
        scratch_memory.copy_from_slice(memory);
        mechanism
            .contacts
            .memory_mut()
            .copy_from_slice(scratch_memory);
        mechanism.evaluate_fully(time, scratch_y, scratch_k);
        report::fill(mechanism, &self.running, time, out);
        (mechanism.evaluations, mechanism.contacts.evaluations) = counts;
    }

    /// Peaks per ball joint since the last call, written to `out` in joint order, and forgotten here.
    pub fn take_peaks(&mut self, out: &mut Vec<Peak>) {
        out.clear();
        out.extend_from_slice(&self.peaks);
        self.peaks.fill(Peak::default());
    }

    /// Changes a parameter (`contact.clearance`, `joint.S1.friction`, …) to a value as a user writes it.
    ///
    /// # Errors
    /// Unknown key, bad unit, out of range: the running simulation is unchanged.
    pub fn set(&mut self, key: &str, value: &str) -> Result<Effect, SceneError> {
        let mut next = self.scene.clone();
        let waits = next.set(key, value)?.at_reset;
        self.adopt(next, |running| running.set(key, value).map(|_| ()), waits)
    }

    /// As [`Self::set`], with a value in SI units.
    ///
    /// # Errors
    /// As [`Self::set`].
    pub fn set_value(
        &mut self,
        key: &str,
        value: &crate::scene::Value,
    ) -> Result<Effect, SceneError> {
        let mut next = self.scene.clone();
        let waits = next.set_value(key, value)?.at_reset;
        self.adopt(
            next,
            |running| running.set_value(key, value).map(|_| ()),
            waits,
        )
    }

    fn adopt(
        &mut self,
        next: Scene,
        change: impl FnOnce(&mut Scene) -> Result<(), SceneError>,
        waits: bool,
    ) -> Result<Effect, SceneError> {
        let mut running = self.running.clone();
        // What the running scene cannot take may suit the one that waits, say a joint of a longer chain.
        let waits = waits || change(&mut running).is_err();
        // A joint that turns ideal, or stops being so, changes the equations.
        let turns = |running: &Scene| {
            let pairs = self.running.ball_joints.iter().zip(&running.ball_joints);
            pairs
                .map(|(a, b)| (a.contact.clearance, b.contact.clearance))
                .any(|(a, b)| (a == 0.0) != (b == 0.0))
        };
        if waits || turns(&running) {
            self.scene = next;
            return Ok(Effect::AtReset);
        }
        if running.solver.method != self.running.solver.method {
            prepare_implicit(&mut self.mechanism, running.solver.method).map_err(|error| {
                SceneError {
                    key: Some("solver.method".to_owned()),
                    message: error.to_string(),
                    ..SceneError::default()
                }
            })?;
        }
        self.scene = next;
        let before = std::mem::replace(&mut self.running, running);
        self.mechanism.gravity = self.running.gravity;
        for j in 0..self.running.ball_joints.len() {
            let contact = self.running.ball_joints[j].contact;
            if contact != before.ball_joints[j].contact {
                self.change_contact(j, &contact);
            }
        }
        if self.running.solver != before.solver {
            let solver = &self.running.solver;
            if solver.method != before.solver.method {
                self.stepper = AnyStepper::new(solver.method, self.state.y.len());
                self.state.implicit = false;
                self.state.controller = controller_of(solver.method, false);
                self.state.choice = Choice::default();
                self.mechanism.contacts.switching = switching_of(&self.running);
            }
            self.state.h_next = self.state.h_next.min(solver.step);
        }
        self.refresh();
        Ok(Effect::Now)
    }

    /// New contact parameters at this instant; a clearance that would put the ball inside the wall starts to move.
    fn change_contact(&mut self, j: usize, contact: &crate::contact::Parameters) {
        if contact.clearance == 0.0 {
            return;
        }
        let Self {
            mechanism, state, ..
        } = self;
        mechanism.measure(state.t, &state.y);
        let now = mechanism.contacts.clearance(j);
        let gap = mechanism.contacts.gaps()[j];
        let distance = gap.penetration + now;
        let clearance = if contact.clearance < now && distance > contact.clearance {
            let ramp = Ramp {
                start: state.t,
                from: now,
                rate: -CLEARANCE_SPEED,
                to: contact.clearance,
            };
            state.ramps[j] = Some(ramp);
            now
        } else {
            state.ramps[j] = None;
            contact.clearance
        };
        mechanism.contacts.set_ramp(j, state.ramps[j]);
        mechanism.contacts.set_parameters(j, contact, clearance);
        state.clearances[j] = clearance;
        if state.memory[j].active && distance <= clearance {
            state.memory[j] = Memory::default();
        }
    }

    /// When the first clearance under way arrives, s.
    fn ramp_end(&self) -> f64 {
        let end = |r: &Ramp| r.start + (r.to - r.from) / r.rate;
        self.state
            .ramps
            .iter()
            .flatten()
            .map(end)
            .fold(f64::INFINITY, f64::min)
    }

    fn finish_ramps(&mut self) {
        let t = self.state.t;
        let mut finished = false;
        for j in 0..self.state.ramps.len() {
            let Some(ramp) = self.state.ramps[j] else {
                continue;
            };
            if t >= ramp.start + (ramp.to - ramp.from) / ramp.rate {
                self.state.ramps[j] = None;
                self.state.clearances[j] = ramp.to;
                self.mechanism.contacts.set_ramp(j, None);
                let contact = self.running.ball_joints[j].contact;
                self.mechanism.contacts.set_parameters(j, &contact, ramp.to);
                finished = true;
            }
        }
        if finished {
            self.refresh();
        }
    }

    /// Back to t = 0 with the parameters as they are now, those that wait for a reset included.
    ///
    /// # Errors
    /// As [`Self::new`]; the simulation is then unchanged.
    pub fn reset(&mut self) -> Result<(), StartError> {
        *self = Self::new(&self.scene)?;
        Ok(())
    }

    /// The whole state.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            scene: self.scene.clone(),
            running: self.running.clone(),
            state: self.state.clone(),
            polynomial: self.stepper.polynomial().cloned(),
        }
    }

    /// Goes back to a state that this simulation, or another of the same scene, was in. Resuming gives the same bits.
    ///
    /// # Errors
    /// A snapshot of a scene whose equations cannot be set up.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), StartError> {
        let mut fresh = Self::new(&snapshot.running)?;
        fresh.scene = snapshot.scene.clone();
        fresh.state = snapshot.state.clone();
        for j in 0..fresh.state.ramps.len() {
            fresh.mechanism.contacts.set_ramp(j, fresh.state.ramps[j]);
            let contact = fresh.running.ball_joints[j].contact;
            if contact.clearance > 0.0 {
                fresh
                    .mechanism
                    .contacts
                    .set_parameters(j, &contact, fresh.state.clearances[j]);
            }
        }
        // The interpolant of the step before is not part of a state.
        let state = &mut fresh.state;
        state.t0 = state.t;
        state.y0.copy_from_slice(&state.y);
        state.k0.copy_from_slice(&state.k);
        state.gaps0.copy_from_slice(&state.gaps);
        state.memory0.copy_from_slice(&state.memory);
        if let Some(polynomial) = &snapshot.polynomial {
            fresh.stepper.set_polynomial(polynomial);
        }
        *self = fresh;
        Ok(())
    }

    /// FNV-1a, 64 bit, over the whole state: little-endian bits of time, coordinates, velocities, then for each ball
    /// joint whether it is in contact, its approach speed, and its clearance in force.
    pub fn state_hash(&self) -> u64 {
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut add = |bits: u64| {
            for byte in bits.to_le_bytes() {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
            }
        };
        let state = &self.state;
        add(state.t.to_bits());
        for y in &state.y {
            add(y.to_bits());
        }
        for (j, m) in state.memory.iter().enumerate() {
            add(u64::from(m.active));
            add(m.approach_speed.to_bits());
            let clearance = state.ramps[j].map_or(state.clearances[j], |r| r.at(state.t).0);
            add(clearance.to_bits());
        }
        hash
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

/// Step-size control for the order of the method's error estimate.
fn controller_of(method: Method, implicit: bool) -> Controller {
    Controller::new(match (method, implicit) {
        (Method::Rosenbrock, _) => 2,
        (Method::Radau5, _) | (Method::Automatic, true) => 3,
        _ => 4,
    })
}

/// Allocates what an implicit method needs.
fn prepare_implicit(mechanism: &mut Mechanism, method: Method) -> Result<(), MechanismError> {
    let velocities = mechanism.dimension() - mechanism.positions();
    if mechanism.is_kinematic() {
        return Ok(());
    }
    if method.is_implicit() && velocities > LARGEST_DENSE {
        return Err(MechanismError::TooLarge {
            velocities,
            most: LARGEST_DENSE,
        });
    }
    if method.is_implicit() || (method == Method::Automatic && velocities <= LARGEST_IMPLICIT) {
        mechanism.prepare_linearisation();
    }
    Ok(())
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
        };
    }
}
