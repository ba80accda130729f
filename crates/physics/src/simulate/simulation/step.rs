//! Steps of a state: start, fixed and kinematic steps, and what every accepted step does.

use super::discrete::discrete_size;
use super::flights::{clear_flights, write_flights};
use super::wear::{Abrasion, Growth};
use super::{
    Attempt, LONGEST_STEP, MAX_SWEEP, Model, NEARLY, OPEN_LOOP, SHORTEST_KINEMATIC_STEP, State, StepEnd, Stepping,
    Workspace, store_gaps,
};
use crate::integrate::{Method, StepControl, System as _};
use crate::machine::Machine;
use crate::mechanism::{ActiveSet, Counts, Mechanism, OFF_PATH};
use crate::simulate::impacts::ImpactEvents;
use crate::simulate::peaks::Recent;
use crate::simulate::{Frame, Indeterminate, StartError, StopAdvice, StopFault, Stopped};

impl Attempt {
    /// For the steps of a state of `dimension` components.
    pub(super) fn new(machine: &Machine, dimension: usize, contacts: usize) -> Self {
        let edges = 3 * machine.elements.len();
        Self {
            end: StepEnd::new(vec![0.0; dimension], contacts),
            located_contact: None,
            corner: None,
            element_sides: Vec::with_capacity(edges),
            edge: false,
            edge_indicators: std::array::from_fn(|_| Vec::with_capacity(edges)),
            has_switched_branch: false,
            has_left_branch: vec![false; contacts],
            full_step: None,
            step_to_reproduce: None,
            events: ImpactEvents::new(contacts),
            may_contain_peak: false,
            is_near_peak: false,
            wearing: vec![Growth::default(); machine.loose_joints.len()],
            abrasion: vec![Abrasion::default(); contacts],
            peak_forces: vec![(0.0, 0.0); contacts],
            rebounds: vec![None; contacts],
            stiffness: 0.0,
            counts: Counts::default(),
            factorisations: 0,
        }
    }

    /// Forgets how the latest step ended, which belongs to another state.
    pub(super) fn clear(&mut self) {
        self.located_contact = None;
        self.corner = None;
        self.full_step = None;
        self.step_to_reproduce = None;
        self.may_contain_peak = false;
        self.events.clear();
    }
}

impl<'a> Stepping<'a> {
    /// Attaches `workspace` to `state` first, if it is attached to another.
    pub(super) fn new(model: &'a Model, state: &'a mut State, workspace: &'a mut Workspace) -> Self {
        workspace.attach_to(model, state);
        let Workspace { mechanism, stepper, before, attempt, scratch_y, scratch_k, scratch_contacts, .. } = workspace;
        let machine = model.machine();
        Self { model, machine, state, mechanism, stepper, before, attempt, scratch_y, scratch_k, scratch_contacts }
    }
}

impl Stepping<'_> {
    /// Completes the start: contacts, derivative, first peaks, ledger.
    pub(super) fn begin(&mut self) -> Result<(), StartError> {
        self.begin_contacts_at_start();
        self.choose_first_scheme();
        self.refresh();
        self.state.record.determinant_positive = self.mechanism.is_determinant_positive();
        self.track_peaks(0.0);
        self.track_reactions();
        self.start_ledger();
        self.state.record.starts_inside = self.deepest_in_stop();
        Ok(())
    }

    /// Discards what the stepper computed at a state that is no longer current.
    pub(super) fn invalidate(&mut self) {
        self.stepper.invalidate();
        self.state.polynomial.clear();
    }

    /// Discards the previous step.
    pub(super) fn discard_previous_step(&mut self) {
        self.before.copy_from(&self.state.now);
        self.state.control.grid_origin = self.state.now.t;
        self.state.control.grid_count = 0;
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

    /// Whether the method locates the instants at which contacts begin and end, and the corners of their laws.
    pub(super) fn locates(&self) -> bool {
        self.state.conditions.solver.method.is_adaptive()
    }

    /// Rounding error of a penetration at the current state, m.
    pub(super) fn rounding(&self) -> f64 {
        self.mechanism.rounding(&self.state.now.y)
    }

    /// Recomputes derivative and gaps after a change of state other than a step; discards the previous step.
    pub(super) fn refresh(&mut self) {
        self.end_flights();
        self.freeze_branches(true);
        let located = self.locates();
        let Self { mechanism, state, .. } = self;
        let State { now, .. } = state;
        now.release_bristles(mechanism);
        let active_set = ActiveSet::by(located, &now.contact_states);
        let mut evaluator = mechanism.evaluator(active_set);
        evaluator.derivative(now.t, &now.y, &mut now.k);
        mechanism.complete_gaps(active_set, &now.y);
        store_gaps(mechanism, &mut now.gaps);
        self.count_turns();
        // Forces jump here: a parabola across the jump would have a spurious peak.
        self.state.joints.iter_mut().for_each(|joint| joint.reaction = Recent::default());
        self.invalidate();
        self.begin_contacts_at_walls();
        self.discard_previous_step();
    }

    /// Takes one accepted step that ends no later than `end`, s.
    pub(super) fn advance(&mut self, end: f64) -> Result<(), Stopped> {
        // Done here and not at the end of the previous step, because samples inside that step must still see the clearance move.
        self.finish_ramps();
        let limit = end.min(self.ramp_end());
        // Fixed steps ignore this limit: their size is the user's choice.
        let t = self.state.now.t;
        let sweep = self.state.control.sweep;
        let rubs_until = if sweep > 0.0 { t + MAX_SWEEP / sweep } else { f64::INFINITY };
        let longest = limit.min(self.mechanism.step_end(t)).min(rubs_until);
        self.attempt.element_sides.clear();
        self.attempt.edge = false;
        if self.mechanism.is_kinematic() {
            self.kinematic_step(longest)?;
        } else if self.state.conditions.solver.method.is_adaptive() {
            let step = self.adaptive_step(longest);
            if step.is_err() {
                self.discard_step_with_flights();
            }
            step?;
        } else if self.state.conditions.solver.method == Method::DiscreteGradient {
            self.discrete_step(longest)?;
        } else {
            self.fixed_step(limit)?;
        }
        Ok(())
    }

    pub(super) fn fixed_step(&mut self, limit: f64) -> Result<(), Stopped> {
        let step = self.state.conditions.solver.step;
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
    pub(super) fn try_step(&mut self, h: f64) -> f64 {
        let located = self.locates();
        let Self { mechanism, stepper, state, attempt, .. } = self;
        let State { now, conditions, polynomial, .. } = &mut **state;
        let contact_states = &now.contact_states;
        mechanism.freeze_elements(&attempt.element_sides);
        attempt.has_left_branch.fill(false);
        let mut evaluator =
            mechanism.evaluator_with_branches(ActiveSet::by(located, contact_states), &mut attempt.has_left_branch);
        let end = &mut attempt.end;
        let tolerance = conditions.solver.tolerance;
        let error = stepper.attempt(&mut evaluator, now.step(h), &mut end.y, &mut end.k, tolerance, polynomial);
        attempt.counts += evaluator.counts;
        let factorisations = stepper.factorisations();
        attempt.factorisations += factorisations;
        attempt.stiffness = stepper.stiffness(&evaluator, h, &end.y, &end.k);
        attempt.counts.algebra += u64::from(factorisations) * mechanism.implicit_time() as u64;
        mechanism.freeze_elements(&[]);
        error
    }

    /// Evaluates derivative and gaps at the end `t_end` of the current step.
    pub(super) fn evaluate_end(&mut self, t_end: f64) {
        let located = self.locates();
        let Self { mechanism, state, attempt, .. } = self;
        let end = &mut attempt.end;
        let mut evaluator = mechanism.evaluator(ActiveSet::by(located, &state.now.contact_states));
        evaluator.derivative(t_end, &end.y, &mut end.k);
        attempt.counts += evaluator.counts;
        self.finish_gaps(t_end);
    }

    /// Computes bodies in flight, and gaps, at the end `t_end` of the current step, after an evaluation there.
    pub(super) fn finish_gaps(&mut self, t_end: f64) {
        let active_set = ActiveSet::by(self.locates(), &self.state.now.contact_states);
        let end = &mut self.attempt.end;
        write_flights(self.mechanism, &self.state.flights, t_end, &mut end.y);
        clear_flights(self.mechanism, &self.state.flights, &mut end.k);
        self.mechanism.complete_gaps(active_set, &end.y);
        self.mechanism.flatten_bristles(&mut end.y);
        store_gaps(self.mechanism, &mut end.gaps);
    }

    /// Takes a step of a kinematic scene: predict, close the loops, compute the reactions. A failed step is retried with shorter
    /// ones, so that the last good state is close to the failure.
    pub(super) fn kinematic_step(&mut self, limit: f64) -> Result<(), Stopped> {
        let t = self.state.now.t;
        let mut step = self.mechanism.kinematic_step().min(LONGEST_STEP);
        loop {
            let t_end = if t + step >= limit - NEARLY * step { limit } else { t + step };
            let (now, end) = (&self.state.now, &mut self.attempt.end);
            self.mechanism.predict(t_end - t, &now.y, &now.k, self.scratch_k, &mut end.y);
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

    /// Accepts the attempted step: projection, guard, contact state, peaks.
    pub(super) fn accept(&mut self, t_end: f64, h: f64) -> Result<(), Stopped> {
        let open = self.mechanism.project(t_end, &mut self.attempt.end.y);
        self.accept_closed(t_end, h, open)
    }

    /// As [`Self::accept`], once loops have been closed up to `open`, m or rad. With mean rates the end has been measured.
    pub(super) fn accept_closed(&mut self, t_end: f64, h: f64, open: f64) -> Result<(), Stopped> {
        let mean_rates = self.stepper.has_mean_rates();
        if mean_rates {
            // Forces at the end of the step belong to a contact that may end long before the next step does: the mean over the
            // step is more informative.
            let (mechanism, now) = (&mut self.mechanism, &self.state.now);
            let StepEnd { y, k, .. } = &mut self.attempt.end;
            mechanism.position_rate(y, k);
            for i in mechanism.positions()..y.len() {
                k[i] = (y[i] - now.y[i]) / h;
            }
        } else if !self.stepper.ends_with_derivative() || self.mechanism.projects() {
            self.evaluate_end(t_end);
        }
        self.state.record.statistics.count(self.attempt.counts);
        // Past a singular pose the loops may close again on another branch.
        let passed = self.mechanism.is_determinant_positive() != self.state.record.determinant_positive;
        let distance = self.mechanism.distance_from_path();
        let fault = if passed {
            Some(StopFault::SingularLoops)
        } else if distance > OFF_PATH {
            Some(StopFault::OffPath { distance })
        } else {
            self.divergence(open, h)
        };
        if let Some(fault) = fault {
            let solver = &self.state.conditions.solver;
            let advice = if passed || open.is_nan() || open > OPEN_LOOP {
                StopAdvice::Dependent
            } else if matches!(fault, StopFault::OffPath { .. }) {
                StopAdvice::FittingPath
            } else {
                match solver.method.control() {
                    StepControl::Error => StopAdvice::GentlerMotion { tolerance: solver.tolerance },
                    StepControl::Fixed => StopAdvice::ShorterStep { step: solver.step },
                    StepControl::PerImpact => StopAdvice::OtherMethod,
                }
            };
            return Err(self.stopped(fault, advice));
        }
        let State { now, record, .. } = &mut *self.state;
        std::mem::swap(self.before, now);
        std::mem::swap(now, &mut self.attempt.end);
        now.t = t_end;
        now.contact_states.copy_from_slice(&self.before.contact_states);
        let statistics = &mut record.statistics;
        statistics.steps += 1;
        let drift = self.mechanism.constraint_drift();
        statistics.constraint_drift = statistics.constraint_drift.max(drift);
        for (j, axial) in self.mechanism.travelled() {
            statistics.joints[j].axial = statistics.joints[j].axial.max(axial);
        }
        let located = self.locates();
        if located {
            self.track_reactions();
        }
        self.find_peak_forces(h);
        let switched = self.switch_contacts(h);
        self.track_peaks(h);
        self.state.now.release_bristles(self.mechanism);
        let again = (mean_rates && self.mechanism.has_reactions()) || (!mean_rates && switched.forces);
        if !again && !located {
            self.track_reactions();
        }
        self.record_step(h, switched.contacts || switched.forces);
        self.switch_at_corner();
        // The force now depends on the approach speed just found. Reactions of ideal joints need the derivative at the end even
        // if the method does not.
        if again {
            let Self { mechanism, state, scratch_k, .. } = self;
            let StepEnd { t, y, k, contact_states, .. } = &mut state.now;
            let rate: &mut [f64] = if mean_rates { scratch_k } else { k };
            let mut evaluator = mechanism.evaluator(ActiveSet::by(located, contact_states));
            evaluator.derivative(*t, y, rate);
            let counts = evaluator.counts;
            mechanism.forget_evaluation();
            state.record.statistics.count(counts);
            if !located {
                self.track_reactions();
            }
        }
        self.search_peaks();
        self.count_turns();
        self.wear_walls()
    }

    /// Counts the turns of angles that follow from poses at the current state.
    fn count_turns(&mut self) {
        let State { now, quarter_turns, record, .. } = &mut *self.state;
        self.mechanism.count_turns(now.t, &now.y, quarter_turns.iter_mut().chain(&mut record.quarter_turns));
    }

    pub(super) fn stopped(&self, fault: StopFault, advice: StopAdvice) -> Stopped {
        let dependent = self.mechanism.has_dependent_rows();
        Stopped { time: self.state.now.t, fault, advice: if dependent { StopAdvice::Dependent } else { advice } }
    }

    /// As [`Simulation::indeterminate_forces`](crate::simulate::Simulation::indeterminate_forces).
    pub(super) fn indeterminate_forces(&mut self) -> Indeterminate {
        self.sample(self.state.now.t, &mut Frame::default());
        let mechanism = &mut self.mechanism;
        let reactions: Vec<usize> = (0..mechanism.cut_joints()).filter(|&j| !mechanism.is_reaction_unique(j)).collect();
        Indeterminate {
            directions: reactions.iter().map(|&j| mechanism.undetermined_directions(j)).collect(),
            reactions,
            actuators: (0..mechanism.drives()).filter(|&i| !mechanism.is_actuator_unique(i)).collect(),
        }
    }
}

/// As [`Simulation::is_truncated_by`](crate::simulate::Simulation::is_truncated_by).
pub(super) fn is_truncated_by(state: &State, mechanism: &Mechanism, end: f64) -> bool {
    let (t, control, solver) = (state.now.t, &state.control, &state.conditions.solver);
    let (t_end, h) = if mechanism.is_kinematic() {
        let h = mechanism.kinematic_step().min(LONGEST_STEP);
        (t + h, h)
    } else if solver.method.is_adaptive() {
        let h = control.h_next.min(LONGEST_STEP);
        (t + h, h)
    } else if solver.method == Method::DiscreteGradient {
        let h = discrete_size(state, mechanism);
        (t + h, h)
    } else {
        let next = (control.grid_count + 1) as f64;
        (control.grid_origin + next * solver.step, solver.step)
    };
    t_end >= end - NEARLY * h
}
