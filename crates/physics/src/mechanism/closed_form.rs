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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;

    fn paper(changes: &[(&str, String)]) -> ClosedForm {
        let changes: Vec<(String, String)> =
            changes.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
        Scene::load("spcmm", &changes).expect("built in").machine.closed_form.expect("has one")
    }

    fn place(form: &ClosedForm, name: &str) -> usize {
        form.functions.iter().position(|function| function.name == name).expect("is a function")
    }

    fn sliders(form: &ClosedForm, t: f64) -> [Jet; 3] {
        let values = form.at(t);
        ["f1", "f2", "f3"].map(|name| values[1 + place(form, name)])
    }

    #[test]
    fn sliders_of_the_paper_have_the_reference_values() {
        let form = paper(&[]);
        let expected = [
            (0.1364935480, -0.11575599, -0.13201567),
            (0.2409227735, -0.04964883, -0.0671871),
            (0.1864724056, -0.07282449, -0.08487076),
        ];
        for (f, (value, rate, acceleration)) in sliders(&form, 0.0).iter().zip(expected) {
            assert!((f.value - value).abs() < 1e-10, "{f:?}");
            assert!((f.rate - rate).abs() < 1e-8, "{f:?}");
            assert!((f.acceleration - acceleration).abs() < 1e-8, "{f:?}");
        }
        // The reference trajectories' first row; 0.143 m tan(pi / 12).
        let motion = form.path.as_ref().expect("known").at(&form.at(0.0));
        assert!((motion.position[2].value + 0.0383167345177).abs() < 1e-12);
        for (f, value) in sliders(&form, 0.5).iter().zip([0.0902403840, 0.2210909323, 0.1575618239]) {
            assert!((f.value - value).abs() < 1e-10, "{f:?}");
        }
    }

    #[test]
    fn roots_are_real_in_the_stated_range_of_the_socket_plane() {
        for (socket_plane, reachable) in [(0.041518, true), (0.041516, false), (0.364482, true), (0.364484, false)] {
            let form = paper(&[("spcmm.slider_plane", format!("{} m", socket_plane - 0.028))]);
            assert_eq!(form.check().is_ok(), reachable, "x_s = {socket_plane}");
        }
    }

    #[test]
    fn the_error_names_the_function_with_the_lowest_negative_value() {
        let Err(MechanismError::Unreachable(error)) = paper(&[("spcmm.slider_plane", "0 m".to_owned())]).check() else {
            panic!("the rod is long enough");
        };
        assert_eq!((error.function.as_str(), error.what.as_str()), ("root1", "slider 1: rod too short"));
        assert!(error.value.starts_with('-') && error.value.ends_with(" m^2"), "{error}");
        let mut silent = paper(&[("spcmm.slider_plane", "0 m".to_owned())]);
        silent.functions.iter_mut().for_each(|function| function.positive = None);
        let Err(MechanismError::Unreachable(error)) = silent.check() else {
            panic!("roots of negative numbers are values")
        };
        assert!(error.to_string().starts_with("a function has no value at t = 0."), "{error}");
        assert!(error.function == "f1" && error.value == "NaN m" && error.requirement == "finite", "{error}");
    }

    #[test]
    fn a_motion_at_another_pace_is_the_same_motion() {
        let (form, t) = (paper(&[]), 0.3);
        let slow = ClosedForm { pace: 0.25, ..form.clone() };
        let sliders_of = |form: &ClosedForm| ["f1", "f2", "f3"].map(|name| place(form, name));
        assert_eq!((form.period(&sliders_of(&form)), slow.period(&sliders_of(&form))), (2.0, 8.0));
        for (a, b) in sliders(&form, t).iter().zip(sliders(&slow, 4.0 * t)) {
            assert!((a.value - b.value).abs() < 1e-15 && (a.rate - 4.0 * b.rate).abs() < 1e-14, "{a:?} {b:?}");
            assert!((a.acceleration - 16.0 * b.acceleration).abs() < 1e-13, "{a:?} {b:?}");
        }
        let still = paper(&["spcmm.amplitude_x", "spcmm.amplitude_beta"].map(|key| (key, "0".to_owned())));
        assert_eq!(still.period(&sliders_of(&still)), f64::INFINITY);
    }
}
