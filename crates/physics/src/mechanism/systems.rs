//! The equations of motion behind the interfaces of the steppers.

use super::elements::{ActiveSet, Counts};
use super::elements::{At, Loads};
use super::kinematics::Wrench;
use super::{Latest, Mechanism, Powers};
use crate::integrate::{StiffSystem, System};
use std::ops::Range;

/// The equations of motion, with the contacts that may carry a force during a step.
pub struct Evaluator<'a> {
    pub(super) mechanism: &'a mut Mechanism,
    pub(super) active_set: ActiveSet<'a>,
    /// Evaluations made through it.
    pub counts: Counts,
    has_left_branch: &'a mut [bool],
}

impl Mechanism {
    /// Evaluator with `active_set` as the active contacts.
    pub fn evaluator<'a>(&'a mut self, active_set: ActiveSet<'a>) -> Evaluator<'a> {
        self.evaluator_with_branches(active_set, &mut [])
    }

    /// The same; it sets the entry in `has_left_branch` of each contact that leaves the frozen branches of its laws
    /// in an evaluation.
    pub(crate) fn evaluator_with_branches<'a>(
        &'a mut self,
        active_set: ActiveSet<'a>,
        has_left_branch: &'a mut [bool],
    ) -> Evaluator<'a> {
        Evaluator { mechanism: self, active_set, counts: Counts::default(), has_left_branch }
    }
}

impl Evaluator<'_> {
    /// Evaluates everything at (t, y): derivative into `dy`, true accelerations in [`Mechanism::motion`], gaps of all joints,
    /// reactions and actuator forces.
    pub fn evaluate_fully(&mut self, t: f64, y: &[f64], dy: &mut [f64]) {
        self.derivative(t, y, dy);
        let Mechanism { model, equations, contacts, latest, .. } = &mut *self.mechanism;
        *latest = Latest::Unknown;
        let (positions, velocities) = (equations.positions(model), equations.velocities(model));
        equations.complete_motion(model, y, &dy[positions..positions + velocities]);
        // Forces are those of the derivative; only the geometry of ideal joints is missing.
        contacts.measure(t, equations.motion());
    }

    /// Motion and contact forces at (t, y), without accelerations.
    fn load(&mut self, t: f64, y: &[f64]) {
        let Mechanism { model, equations, contacts, elements, films, turns, latest, .. } = &mut *self.mechanism;
        *latest = Latest::Unknown;
        equations.update_active(model, t, y);
        turns.follow(elements, &**equations, model, (t, y));
        let (motion, wrench) = equations.loads();
        wrench.fill(Wrench::zero());
        let bristles = &y[y.len() - contacts.bristles()..];
        let at = At { t, motion, active_set: self.active_set, bristles };
        let mut loads = Loads { wrench, counts: &mut self.counts, has_left_branch: &mut *self.has_left_branch };
        contacts.load(&at, &mut loads);
        for film in &**films {
            elements[*film].follow(contacts, t);
        }
        for element in elements {
            element.load(&at, &mut loads);
        }
    }

    /// Powers at (t, y). `dy` must hold the derivative if the latest evaluation was at this instant; otherwise it is scratch.
    pub fn powers(&mut self, t: f64, y: &[f64], dy: &mut [f64]) -> Powers {
        let sources = &self.mechanism.sources;
        if sources.none {
            return Powers::default();
        }
        let forces_suffice = sources.forces_suffice;
        if !self.mechanism.is_evaluated_at(t) {
            if forces_suffice {
                self.load(t, y);
            } else {
                self.derivative(t, y, dy);
            }
        }
        self.mechanism.powers_of_latest(t, y, dy)
    }
}

impl System for Evaluator<'_> {
    fn prepare_times(&mut self, times: &[f64]) {
        let Mechanism { model, equations, .. } = &mut *self.mechanism;
        equations.driven_mut().prepare(model, times);
    }

    fn derivative(&mut self, t: f64, y: &[f64], dy: &mut [f64]) {
        self.counts.equations += 1;
        self.load(t, y);
        let Mechanism { model, equations, contacts, gravity, latest, .. } = &mut *self.mechanism;
        let (moving, bristles) = dy.split_at_mut(y.len() - contacts.bristles());
        if !bristles.is_empty() {
            contacts.bristle_rates(bristles);
        }
        let (dq, dv) = moving.split_at_mut(equations.positions(model));
        equations.position_rate(model, y, dq);
        equations.accelerate(model, gravity, t, y, dv);
        *latest = Latest::Evaluated(t);
    }

    fn active_ranges(&self) -> &[Range<usize>] {
        self.mechanism.active_ranges()
    }

    fn scale(&self) -> &[f64] {
        self.mechanism.scale()
    }
}

impl StiffSystem for Evaluator<'_> {
    fn linearise(&mut self, t: f64, y: &[f64], shift: f64) {
        self.mechanism.prepare_linearisation();
        let Some(mut stiff) = self.mechanism.stiff.take() else {
            return;
        };
        let mut scratch = std::mem::take(&mut stiff.derivative);
        self.derivative(t, y, &mut scratch);
        stiff.derivative = scratch;
        let Mechanism { model, equations, contacts, elements, .. } = &mut *self.mechanism;
        let active_set = self.active_set;
        stiff.gather(model, contacts, elements, active_set, &**equations, (t, y, shift));
        stiff.apply_inverse_mass(model, &mut **equations);
        self.mechanism.stiff = Some(stiff);
    }

    fn factor_shifted(&mut self, shift: f64) {
        if let Some(stiff) = &mut self.mechanism.stiff {
            stiff.factor(shift);
        }
    }

    fn solve_shifted(&mut self, b: &mut [f64]) {
        let Mechanism { model, equations, stiff, active_ranges, .. } = &mut *self.mechanism;
        if let Some(stiff) = stiff {
            stiff.solve(b, active_ranges, &**equations, model);
        }
    }

    fn factor_shifted_pair(&mut self, real: f64, imaginary: f64) {
        if let Some(stiff) = &mut self.mechanism.stiff {
            stiff.factor_pair(nalgebra::Complex::new(real, imaginary));
        }
    }

    fn solve_shifted_pair(&mut self, b_real: &mut [f64], b_imaginary: &mut [f64]) {
        let Mechanism { model, equations, stiff, active_ranges, .. } = &mut *self.mechanism;
        if let Some(stiff) = stiff {
            stiff.solve_pair(b_real, b_imaginary, active_ranges, &**equations, model);
        }
    }
}
