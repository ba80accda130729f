//! Sections of a motion where a channel crosses a value, such as `crank.angle=90deg:up`.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::drive::{OBSERVABLES, ObservedError, ObservedRun, observed};
use super::section::SectionsSoFar;
use super::statistic::channels;
use jointplay_physics::simulate::{Frame, Reading, Simulation, StartError, UnknownChannel, matching};
use jointplay_physics::units::{Dimension, QuantityError, all_units, parse_quantity};
use jointplay_scene::Scene;

/// Instants per step at which the channel is read. Two crossings between neighbouring instants remain undetected.
const SAMPLES_PER_STEP: u32 = 4;
/// Largest number of bisections, enough to reach adjacent floating-point times.
const BISECTIONS: u32 = 60;

/// Reasons why a condition for sections is invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CrossingError {
    /// A malformed condition.
    #[error("{text}: expected phase or CHANNEL=VALUE[:up|:down], e.g. crank.angle=90deg:up")]
    Form {
        /// The given text.
        text: String,
    },
    /// An unknown channel.
    #[error("{text}: {error}")]
    Channel {
        /// The given text.
        text: String,
        /// The reason.
        error: UnknownChannel,
    },
    /// A pattern that matches several channels.
    #[error("{text}: the section needs one channel, and these match: {}", .names.join(", "))]
    Several {
        /// The given text.
        text: String,
        /// The channels.
        names: Vec<String>,
    },
    /// A text that is not a value of the channel.
    #[error("{text}: {value} {error}")]
    Value {
        /// The given text.
        text: String,
        /// The given value.
        value: String,
        /// The reason.
        error: QuantityError,
    },
    /// The scene whose channels are needed does not start.
    #[error("the scene does not start, so its channels are unknown: {0}")]
    Start(#[from] StartError),
}

/// Direction of a crossing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Direction {
    Up,
    Down,
    Either,
}

/// A value of a channel; each crossing of it is a section. An angle crosses its value once per turn.
#[derive(Clone, Debug, PartialEq)]
pub struct Crossing {
    text: String,
    channel: String,
    value: f64,
    is_angle: bool,
    direction: Direction,
}

impl Crossing {
    /// Parses `CHANNEL=VALUE[:up|:down]` for `scene`.
    ///
    /// # Errors
    /// A malformed text, no such channel or several, a value without its unit; a scene that does not start.
    pub fn parse(scene: &Scene, text: &str) -> Result<Self, CrossingError> {
        let given = || text.to_owned();
        let (pattern, rest) = text.split_once('=').ok_or_else(|| CrossingError::Form { text: given() })?;
        let (value, direction) = match rest.split_once(':').map(|(value, direction)| (value, direction.trim())) {
            None => (rest, Direction::Either),
            Some((value, "up")) => (value, Direction::Up),
            Some((value, "down")) => (value, Direction::Down),
            Some(_) => return Err(CrossingError::Form { text: given() }),
        };
        let list = channels(&scene.machine, &mut Simulation::new(&scene.machine)?);
        let pattern = pattern.trim();
        let chosen = matching(&list, pattern).map_err(|error| CrossingError::Channel { text: given(), error })?;
        // An exact name takes precedence over a pattern with a single match.
        let exact = chosen.iter().find(|channel| channel.name == pattern);
        let channel = match (exact, &chosen[..]) {
            (Some(channel), _) | (None, [channel]) => *channel,
            _ => {
                let names = chosen.iter().map(|channel| channel.name.clone()).collect();
                return Err(CrossingError::Several { text: given(), names });
            }
        };
        let number = parse_quantity(value, dimension_of(channel.unit)).map_err(|error| {
            let value = value.trim().to_owned();
            CrossingError::Value { text: given(), value, error }
        })?;
        let is_angle = channel.unit == "rad";
        Ok(Self { text: given(), channel: channel.name.clone(), value: number, is_angle, direction })
    }

    /// The given text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Deviation of `value` from the value to cross; for an angle, from the nearest turn.
    fn deviation(&self, value: f64) -> f64 {
        let deviation = value - self.value;
        if self.is_angle { deviation - TAU * (deviation / TAU).round() } else { deviation }
    }

    /// Whether the channel crosses its value between two deviations.
    fn is_between(&self, before: f64, after: f64) -> bool {
        // Half a turn away from the value, the wrapped deviation jumps without a crossing.
        let is_near = !self.is_angle || before.abs().max(after.abs()) < FRAC_PI_2;
        let is_upward = before < 0.0 && after >= 0.0 && self.direction != Direction::Down;
        let is_downward = before > 0.0 && after <= 0.0 && self.direction != Direction::Up;
        is_near && (is_upward || is_downward)
    }
}

/// Dimension of a channel's unit; a pure number if scenes have no such unit.
fn dimension_of(unit: &str) -> Dimension {
    let plain = |text: &str| text.replace([' ', '^'], "");
    let same = |(name, _, size): &(&str, Dimension, f64)| *size == 1.0 && plain(name) == plain(unit);
    all_units().find(same).map_or(Dimension::None, |(_, dimension, _)| dimension)
}

/// A run whose sections are the crossings of a channel.
pub(super) struct CrossingRun {
    pub(super) so_far: SectionsSoFar<ObservedRun>,
    crossing: Crossing,
    reading: Option<Reading>,
    frame: Frame,
    /// Deviation at the end of the latest step.
    latest: f64,
    /// Number of crossings to record, including discarded ones.
    count: usize,
    /// End of the run, s, even if fewer crossings have occurred.
    end: f64,
    /// Times of the kept sections, s.
    pub(super) times: Vec<f64>,
}

impl CrossingRun {
    /// Observes `orbit` from now until `count` crossings have occurred, or until time `end`, s.
    pub(super) fn new(mut orbit: ObservedRun, crossing: &Crossing, (count, discard): (usize, usize), end: f64) -> Self {
        let machine = orbit.simulation().machine().clone();
        let list = channels(&machine, orbit.simulation_mut());
        let reading = list.iter().find(|channel| channel.name == crossing.channel).map(|channel| channel.reading());
        let mut frame = Frame::default();
        reading.iter().for_each(|reading| reading.request(&mut frame));
        let (crossing, times) = (crossing.clone(), Vec::new());
        let so_far = SectionsSoFar { orbit, taken: 0, discard, kept: Vec::new() };
        let mut run = Self { so_far, crossing, reading, frame, latest: 0.0, count, end, times };
        run.latest = run.deviation_at(run.so_far.orbit.simulation().time());
        run
    }

    pub(super) fn is_done(&self) -> bool {
        self.so_far.taken >= self.count || self.so_far.orbit.simulation().time() >= self.end
    }

    /// Takes one step; returns `true` if it contains a crossing.
    pub(super) fn step(&mut self) -> Result<bool, ObservedError> {
        let start = self.so_far.orbit.simulation().time();
        self.so_far.orbit.simulation_mut().step_until(self.end)?;
        let step = self.so_far.orbit.simulation().time() - start;
        let (mut has_crossed, mut before) = (false, start);
        for k in 1..=SAMPLES_PER_STEP {
            let now = if k == SAMPLES_PER_STEP {
                start + step
            } else {
                start + step * f64::from(k) / f64::from(SAMPLES_PER_STEP)
            };
            let deviation = self.deviation_at(now);
            if self.so_far.taken < self.count && self.crossing.is_between(self.latest, deviation) {
                has_crossed = true;
                self.record_crossing(before, now);
            }
            (before, self.latest) = (now, deviation);
        }
        Ok(has_crossed)
    }

    /// Records the crossing between two times, s.
    fn record_crossing(&mut self, mut before: f64, mut after: f64) {
        let mut latest = self.latest;
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (before + after);
            if middle <= before || middle >= after {
                break;
            }
            let deviation = self.deviation_at(middle);
            if self.crossing.is_between(latest, deviation) {
                after = middle;
            } else {
                (before, latest) = (middle, deviation);
            }
        }
        self.so_far.taken += 1;
        if self.so_far.taken > self.so_far.discard {
            self.deviation_at(after);
            self.so_far.kept.extend(observed(&self.frame.pose));
            self.times.push(after);
        }
        debug_assert_eq!(self.so_far.kept.len(), OBSERVABLES.len() * self.times.len());
    }

    /// Samples the latest step at `time`, s.
    fn deviation_at(&mut self, time: f64) -> f64 {
        self.so_far.orbit.simulation_mut().sample(time, &mut self.frame);
        let value = self.reading.and_then(|reading| reading.read(&self.frame));
        value.map_or(f64::NAN, |value| self.crossing.deviation(value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene() -> Scene {
        Scene::load("slider-crank-driven", &[]).expect("built in")
    }

    #[test]
    fn errors_of_invalid_conditions_state_the_reason() {
        for (text, fragment) in [
            ("zero", "expected phase or CHANNEL=VALUE"),
            ("crank.angle=90deg:round", "expected phase or CHANNEL=VALUE"),
            ("crank.angle=90", "90 needs a unit"),
            ("crank.angel=90deg", "did you mean `crank.angle`?"),
            ("B.force=1N", "B.force.x, B.force.y, B.force.z"),
        ] {
            let error = Crossing::parse(&scene(), text).expect_err(text).to_string();
            assert!(error.contains(fragment), "{text}: {error}");
        }
        let kinetic = Crossing::parse(&scene(), "energy.kinetic=0.5:up").expect("a number in J");
        assert_eq!((kinetic.value, kinetic.is_angle), (0.5, false));
    }

    /// The crank turns at a constant rate, so that its crossings are known.
    #[test]
    fn a_turning_crank_crosses_an_angle_once_per_turn() {
        let scene = scene();
        let period = crate::drive::drive_period(&scene).expect("driven");
        for (text, per_turn) in
            [("crank.angle=90deg", 1.0), ("crank.angle=90deg:up", 1.0), ("crank.angle=90deg:down", 1.0)]
        {
            let crossing = Crossing::parse(&scene, text).expect("a section");
            let orbit = ObservedRun::new(&scene).expect("starts");
            let mut run = CrossingRun::new(orbit, &crossing, (4, 1), 3.2 * period);
            while !run.is_done() {
                run.step().expect("runs");
            }
            let turns =
                |times: &[f64]| times.windows(2).all(|w| ((w[1] - w[0]) * per_turn / period - 1.0).abs() < 1e-9);
            // The crank turns in one direction, so that crossings in the other direction never occur.
            assert!(run.so_far.taken == 0 || (run.so_far.taken >= 3 && turns(&run.times)), "{text}: {:?}", run.times);
            assert_eq!(run.so_far.kept.len(), 12 * run.times.len());
            if text == "crank.angle=90deg" {
                assert!(run.so_far.taken >= 3);
            }
        }
    }
}
