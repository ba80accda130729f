//! What the run of a point is asked to be, by the options of a command or the arguments of a function.

use std::fmt::{Display as _, Formatter};

use super::argument::Argument;
use super::crossing::{Crossing, CrossingError};
use super::point::{Plan, Span};
use jointplay_scene::Scene;

/// Section of a drive's phase.
const PHASE: &str = "phase";

/// The arguments; times in s.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpanRequest {
    /// Drive periods, including discarded ones.
    pub periods: Option<usize>,
    /// Initial periods or crossings to discard.
    pub discard: Option<usize>,
    /// Drive phase of the sections as a fraction of the period.
    pub phase: Option<f64>,
    /// Time between two sections in place of the common period of the drives.
    pub period: Option<f64>,
    /// Whether to leave out the exponent.
    pub no_exponent: bool,
    /// Length.
    pub duration: Option<f64>,
    /// End of the transient of a duration.
    pub from: Option<f64>,
    /// `phase`, or `CHANNEL=VALUE[:up|:down]`.
    pub section: Option<String>,
    /// Crossings of a section, including discarded ones.
    pub crossings: Option<usize>,
}

/// Reasons why arguments do not define a run. `{}` names options, `{:#}` arguments ([`Argument`]).
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SpanError {
    /// A section that is none of the scene.
    #[error(fmt = section)]
    Section(CrossingError),
    /// A section of a channel without numbers of crossings.
    #[error(fmt = uncounted)]
    Uncounted(String),
    /// Arguments that contradict each other, or a value out of range: the argument, its value, and what is wrong.
    #[error(fmt = wrong)]
    Wrong(Argument, String, &'static str),
    /// An argument that another one needs.
    #[error(fmt = lacking)]
    Lacking(&'static [Argument], &'static str),
}

fn section(error: &CrossingError, f: &mut Formatter<'_>) -> std::fmt::Result {
    Argument::Section.fmt(f)?;
    write!(f, "{}{error}", if f.alternate() { ": " } else { " " })
}

fn uncounted(text: &str, f: &mut Formatter<'_>) -> std::fmt::Result {
    Argument::Section.write(text, f)?;
    f.write_str(": give the number of crossings with ")?;
    list(&[Argument::Crossings, Argument::Discard], f)?;
    f.write_str(", and ")?;
    Argument::Duration.fmt(f)?;
    f.write_str(" to end the search for them")
}

fn wrong(argument: &Argument, value: &str, what: &str, f: &mut Formatter<'_>) -> std::fmt::Result {
    argument.write(value, f)?;
    write!(f, ": {what}")
}

fn lacking(arguments: &[Argument], what: &str, f: &mut Formatter<'_>) -> std::fmt::Result {
    f.write_str("give ")?;
    list(arguments, f)?;
    f.write_str(what)
}

fn list(arguments: &[Argument], f: &mut Formatter<'_>) -> std::fmt::Result {
    for (i, argument) in arguments.iter().enumerate() {
        f.write_str(if i == 0 { "" } else { " and " })?;
        argument.fmt(f)?;
    }
    Ok(())
}

impl SpanRequest {
    /// The run of each point of a sweep of `scene`.
    ///
    /// # Errors
    /// Arguments that are missing, contradict each other or are out of range.
    pub fn span(&self, scene: &Scene) -> Result<Span, SpanError> {
        use Argument::{Discard, Duration, From, Periods};
        let wrong = |argument, value: f64, what| Err(SpanError::Wrong(argument, value.to_string(), what));
        if let Some(duration) = self.duration.filter(|duration| *duration <= 0.0) {
            return wrong(Duration, duration, "the time must be above 0");
        }
        if let Some(text) = self.section.as_ref().filter(|text| *text != PHASE) {
            let crossing = Crossing::parse(scene, text).map_err(SpanError::Section)?;
            let (Some(count), Some(discard), Some(duration)) = (self.crossings, self.discard, self.duration) else {
                return Err(SpanError::Uncounted(text.clone()));
            };
            return match self.from {
                Some(from) => wrong(From, from, "with a section, the discarded crossings are the transient"),
                None => Ok(Span::Crossings { crossing, count, discard, duration }),
            };
        }
        match (self.periods, self.duration) {
            (Some(periods), None) => {
                let Some(discard) = self.discard else {
                    return Err(SpanError::Lacking(&[Discard], ", the number of initial periods that are a transient"));
                };
                let phase = self.phase.unwrap_or_default();
                if !(0.0..1.0).contains(&phase) {
                    let what = "a drive phase is a fraction of the period, from 0 to below 1, or an angle, from 0 to below 360deg";
                    return wrong(Argument::Phase, phase, what);
                }
                if let Some(period) = self.period.filter(|period| *period <= 0.0) {
                    return wrong(Argument::Period, period, "the time must be above 0");
                }
                let plan = Plan { periods, discard, phase, exponent: !self.no_exponent };
                Ok(Span::Sections { plan, interval: self.period })
            }
            (None, Some(duration)) => {
                let from = self.from.unwrap_or_default();
                if let Some(discard) = self.discard {
                    let what = "it counts periods or crossings; with a duration alone, give the time at which the transient ends";
                    return wrong(Discard, discard as f64, what);
                }
                if from >= duration {
                    return wrong(From, from, "the statistics must begin before the end of the run");
                }
                Ok(Span::Duration { duration, from })
            }
            (Some(periods), Some(_)) => wrong(Periods, periods as f64, "give either periods or a duration"),
            (None, None) => Err(SpanError::Lacking(&[Periods, Discard], ", or a duration")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_run_is_read_and_contradictions_are_named() {
        let scene = Scene::load("slider-crank-driven", &[]).expect("built in");
        let request = SpanRequest::default();
        let periods = SpanRequest { periods: Some(4), discard: Some(1), ..request.clone() };
        let duration = SpanRequest { duration: Some(2.0), ..request.clone() };
        let section = SpanRequest { section: Some("crank.angle=90deg:up".to_owned()), ..duration.clone() };
        let counted = SpanRequest { crossings: Some(9), discard: Some(1), ..section.clone() };
        let plan = Plan { periods: 4, discard: 1, phase: 0.0, exponent: true };
        assert_eq!(periods.span(&scene), Ok(Span::Sections { plan, interval: None }));
        let late = SpanRequest { from: Some(0.5), section: Some(PHASE.to_owned()), ..duration.clone() };
        assert_eq!(late.span(&scene), Ok(Span::Duration { duration: 2.0, from: 0.5 }));
        assert!(matches!(counted.span(&scene), Ok(Span::Crossings { count: 9, discard: 1, .. })));
        for (request, option, argument) in [
            (request.clone(), "give --periods and --discard, or", "give periods and discard, or"),
            (SpanRequest { discard: None, ..periods.clone() }, "give --discard,", "give discard,"),
            (SpanRequest { phase: Some(1.0), ..periods.clone() }, "--phase 1:", "phase = 1:"),
            (SpanRequest { period: Some(0.0), ..periods.clone() }, "--period 0:", "period = 0:"),
            (SpanRequest { duration: Some(1.0), ..periods }, "--periods 4:", "periods = 4:"),
            (SpanRequest { duration: Some(0.0), ..request }, "--duration 0:", "duration = 0:"),
            (SpanRequest { from: Some(2.0), ..duration.clone() }, "--from 2:", "from_ = 2:"),
            (SpanRequest { discard: Some(3), ..duration }, "--discard 3:", "discard = 3:"),
            (section, "--section crank.angle=90deg:up: give", "section = crank.angle=90deg:up: give"),
            (SpanRequest { from: Some(0.5), ..counted.clone() }, "--from 0.5:", "from_ = 0.5:"),
            (SpanRequest { section: Some("crank".to_owned()), ..counted }, "--section crank:", "section: crank:"),
        ] {
            let error = request.span(&scene).expect_err(option);
            assert!(error.to_string().starts_with(option), "{error}");
            assert!(format!("{error:#}").starts_with(argument), "{error:#}");
        }
    }
}
