//! Evaluation of a motion in closed form, with exact first and second derivatives.

use super::MechanismError;
use super::model::Model;
use crate::expression::{Number, Program, Tape};
use crate::jet::Jet;
use crate::machine::{ClosedForm, Function, Mat3, Path, Vec3};

/// Motion of the output body's frame in closed form at one instant.
#[derive(Clone, Copy, Debug)]
pub struct ClosedMotion {
    /// Its origin, world axes, m.
    pub position: [Jet; 3],
    /// Its rotation.
    pub rotation: Mat3,
    /// Its angular velocity, rad/s.
    pub angular_velocity: Vec3,
}

/// A motion that the machine cannot follow at some instant.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what} at t = {time:.4} s: {function} = {value}, and must be {requirement}")]
pub struct Unreachable {
    /// Description of the fault.
    pub what: String,
    /// Name of the function with the invalid value.
    pub function: String,
    /// Instant at which its value is lowest, or the first at which it is not finite, s.
    pub time: f64,
    /// Its value there, with its unit.
    pub value: String,
    /// Requirement on the value.
    pub requirement: &'static str,
}

impl ClosedForm {
    /// The functions for evaluation at every instant; value 0 is the functions' time.
    pub(super) fn tape(&self) -> Tape {
        Tape::new(self.functions.iter().map(|function| &function.program))
    }

    /// The functions' time at `t`.
    pub(super) fn time(&self, t: f64) -> Jet {
        Jet::new(self.pace * t, self.pace, 0.0)
    }

    /// Number of values of [`Self::evaluate`].
    fn length(&self) -> usize {
        1 + self.functions.len()
    }

    /// The functions' `time` and the functions, in the order of the programs' variables.
    fn evaluate<N: Number>(&self, time: N, values: &mut [N]) {
        values[0] = time;
        for (i, function) in self.functions.iter().enumerate() {
            values[i + 1] = function.program.eval(values);
        }
    }

    /// The same at `t`, in a vector of its own.
    pub(super) fn at(&self, t: f64) -> Vec<Jet> {
        let mut values = vec![Jet::default(); self.length()];
        self.evaluate(self.time(t), &mut values);
        values
    }

    /// Period of the functions with the indices `driving_functions`, s; infinite if none of them moves.
    pub(super) fn period(&self, driving_functions: &[usize]) -> f64 {
        // Sampling at seven instants misses the symmetries of a period: no function that moves is at rest at all of them.
        const INSTANTS: u32 = 7;
        let period = self.base_period();
        let moves = |instant| {
            let values = self.at(period * f64::from(instant) / f64::from(INSTANTS));
            driving_functions.iter().map(|i| values[i + 1]).any(|value| value.rate != 0.0 || value.acceleration != 0.0)
        };
        if period.is_finite() && (0..INSTANTS).any(moves) { period } else { f64::INFINITY }
    }

    /// Time after which the functions repeat, s; infinite if they stand still.
    fn base_period(&self) -> f64 {
        1.0 / (self.frequency * self.pace)
    }

    /// Samples one period, or the start alone if the functions stand still.
    ///
    /// # Errors
    /// A function that must be positive is not, or a function has no finite value. The error names the lowest of them.
    pub(super) fn check(&self) -> Result<(), MechanismError> {
        const SAMPLES: u32 = 4000;
        const AT_ONCE: usize = 8;
        let period = Some(self.base_period()).filter(|period| period.is_finite()).unwrap_or(0.0);
        let tape = self.tape();
        let mut values = vec![[0.0; AT_ONCE]; tape.length()];
        // Index of a function, instant and value.
        let (mut lowest, mut infinite) = (None::<(usize, f64, f64)>, None::<(usize, f64, f64)>);
        let samples = if period > 0.0 { SAMPLES } else { 0 };
        for first in (0..=samples).step_by(AT_ONCE) {
            let times =
                std::array::from_fn(|n| period * f64::from((first + n as u32).min(samples)) / f64::from(SAMPLES));
            // The values equal those of the jets.
            values[0] = times.map(|time| self.time(time).value);
            tape.run(&mut values);
            for (n, time) in times.into_iter().enumerate() {
                for (i, function) in self.functions.iter().enumerate() {
                    let value = values[i + 1][n];
                    // True for NaN, too.
                    if function.positive.is_some() && !(value > 0.0) {
                        if lowest.is_none_or(|(.., lowest)| !(value >= lowest)) {
                            lowest = Some((i, time, value));
                        }
                    } else if function.positive.is_none() && !value.is_finite() && infinite.is_none() {
                        infinite = Some((i, time, value));
                    }
                }
            }
        }
        let fault = |(i, time, value): (usize, f64, f64), requirement| {
            let Function { name, unit, positive, .. } = &self.functions[i];
            let what = positive.clone().unwrap_or_else(|| "a function has no value".to_owned());
            let value = format!("{value:.4e} {unit}").trim_end().to_owned();
            MechanismError::from(Unreachable { what, function: name.clone(), time, value, requirement })
        };
        match (lowest, infinite) {
            (Some(lowest), _) => Err(fault(lowest, "above 0")),
            (None, Some(infinite)) => Err(fault(infinite, "finite")),
            (None, None) => Ok(()),
        }
    }
}

/// Maximum number of instants prepared at once: the stages of Dormand-Prince.
const MAX_PREPARED: usize = 5;

/// Values of the functions at the latest instant, and at instants prepared ahead.
pub struct Values {
    /// As the tape leaves them, or only those in [`Model::required_values`] where they were announced; empty without a closed
    /// form.
    pub latest: Vec<Jet>,
    prepared: Vec<[Jet; MAX_PREPARED]>,
}

impl Values {
    /// For `model`; no instant has been evaluated.
    pub(super) fn new(model: &Model) -> Self {
        let never = Jet::constant(f64::NAN);
        let length = model.functions.length();
        Self { latest: vec![never; length], prepared: vec![[never; MAX_PREPARED]; length] }
    }

    /// Evaluates the functions at `times`, of which there are at most [`MAX_PREPARED`].
    pub(super) fn prepare(&mut self, model: &Model, times: &[f64]) {
        let (Some(form), Some(last)) = (&model.closed_form, times.len().checked_sub(1)) else {
            return;
        };
        self.prepared[0] = std::array::from_fn(|i| form.time(times[i.min(last)]));
        model.functions.run(&mut self.prepared);
    }

    /// Makes `t` the latest instant.
    pub(super) fn evaluate(&mut self, model: &Model, t: f64) {
        let Some(form) = &model.closed_form else {
            return;
        };
        let time = form.time(t);
        if self.latest[0] == time {
            return;
        }
        self.latest[0] = time;
        match self.prepared[0].iter().position(|prepared| *prepared == time) {
            Some(instant) => model.required_values.iter().for_each(|&i| self.latest[i] = self.prepared[i][instant]),
            None => model.functions.run(&mut self.latest),
        }
    }
}

impl Path {
    /// Indices of the values that it reads, some perhaps twice.
    pub(super) fn variables(&self) -> impl Iterator<Item = usize> + '_ {
        let turns = self.turns.iter().map(|(_, angle)| angle);
        self.position.iter().chain(turns).flat_map(Program::variables)
    }

    /// The motion for the `values` of [`ClosedForm::evaluate`].
    pub(super) fn at(&self, values: &[Jet]) -> ClosedMotion {
        let mut rotation = Mat3::identity();
        let mut angular_velocity = Vec3::zeros();
        for (axis, angle) in &self.turns {
            let angle = angle.eval(values);
            angular_velocity += rotation * axis * angle.rate;
            let (sine, cosine) = libm::sincos(angle.value);
            let along = axis * axis.transpose();
            rotation *= along + (Mat3::identity() - along) * cosine + axis.cross_matrix() * sine;
        }
        let mut position = self.position.each_ref().map(|program| program.eval(values));
        if let Some((turn, shift)) = &self.place {
            let row = |i: usize| {
                let turned = turn[(i, 0)] * position[0] + turn[(i, 1)] * position[1] + turn[(i, 2)] * position[2];
                turned + Jet::constant(shift[i])
            };
            position = [0, 1, 2].map(row);
            rotation = turn * rotation;
            angular_velocity = turn * angular_velocity;
        }
        ClosedMotion { position, rotation, angular_velocity }
    }
}
