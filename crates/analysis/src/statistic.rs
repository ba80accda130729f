//! Statistics of channels over the kept part of a run, such as `S1.normal:max` or `*.force:mean`.

use std::fmt::{self, Display, Formatter};

use jointplay_physics::machine::{LooseJoint, Machine};
use jointplay_physics::simulate::{
    ChannelInfo, Frame, Reading, Simulation, StartError, UnknownChannel, channels_of, matching,
};
use jointplay_physics::suggest::nearest;
use jointplay_physics::words::{Words, words};
use jointplay_scene::Scene;

/// A number that summarises the values of a channel over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Statistic {
    /// Largest value.
    Max,
    /// Smallest value.
    Min,
    /// Time average.
    Mean,
    /// Root of the time average of the square.
    Rms,
    /// Standard deviation in time.
    Std,
    /// Difference between the largest and the smallest value.
    Range,
    /// Last value.
    End,
}

words!(Statistic {
    Max => "max",
    Min => "min",
    Mean => "mean",
    Rms => "rms",
    Std => "std",
    Range => "range",
    End => "end",
});

/// Reasons why a list of channels with statistics is invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StatisticError {
    /// A malformed entry.
    #[error("{text}: expected CHANNEL:STATISTIC, e.g. S1.normal:max; statistics: {}", Statistic::WORDS.join(", "))]
    Form {
        /// The given entry.
        text: String,
    },
    /// An unknown statistic.
    #[error("{text}: `{word}` is not a statistic{near}; allowed: {}", Statistic::WORDS.join(", "))]
    Unknown {
        /// The given entry.
        text: String,
        /// The unknown word.
        word: String,
        /// Suggestion of the nearest word, in parentheses; empty if there is none.
        near: String,
    },
    /// An unknown channel.
    #[error("{text}: {error}")]
    Channel {
        /// The given entry.
        text: String,
        /// The reason.
        error: UnknownChannel,
    },
    /// The scene whose channels are needed does not start.
    #[error("the scene does not start, so its channels are unknown: {0}")]
    Start(#[from] StartError),
}

impl StatisticError {
    /// The invalid entry as given; `None` if the error is not about an entry.
    pub(crate) fn text(&self) -> Option<&str> {
        match self {
            Self::Form { text } | Self::Unknown { text, .. } | Self::Channel { text, .. } => Some(text),
            Self::Start(_) => None,
        }
    }
}

/// A statistic of one channel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChannelStatistic {
    channel: String,
    statistic: Statistic,
    column: String,
    unit: &'static str,
}

impl Display for ChannelStatistic {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.channel, self.statistic.word())
    }
}

impl ChannelStatistic {
    /// Parses `CHANNEL:STATISTIC,…` for `scene`. As in `run --channels`, a channel may be a pattern for all channels that match
    /// it. Repetitions count once.
    ///
    /// # Errors
    /// A malformed entry, an unknown channel or statistic; a scene that does not start.
    pub fn parse_list(scene: &Scene, text: &str) -> Result<Vec<Self>, StatisticError> {
        let list = channels(&scene.machine, &mut Simulation::new(&scene.machine)?);
        let mut statistics: Vec<Self> = Vec::new();
        for entry in text.split(',').map(str::trim) {
            let given = || entry.to_owned();
            let (pattern, word) = entry.rsplit_once(':').ok_or_else(|| StatisticError::Form { text: given() })?;
            let (pattern, word) = (pattern.trim(), word.trim());
            let statistic = Statistic::of_word(word).ok_or_else(|| {
                let near = nearest(word, Statistic::WORDS.iter().copied());
                StatisticError::Unknown { text: given(), word: word.to_owned(), near }
            })?;
            let chosen = matching(&list, pattern);
            for channel in chosen.map_err(|error| StatisticError::Channel { text: given(), error })? {
                let next = Self {
                    channel: channel.name.clone(),
                    statistic,
                    column: channel.column_of(statistic.word()),
                    unit: channel.unit,
                };
                if !statistics.contains(&next) {
                    statistics.push(next);
                }
            }
        }
        Ok(statistics)
    }

    /// Column name in files, with the SI unit, such as `S1_normal_max_N`.
    pub fn column(&self) -> &str {
        &self.column
    }

    /// SI unit; "" for a dimensionless number.
    pub fn unit(&self) -> &'static str {
        self.unit
    }

    /// Index of the joint, if this is the largest normal force of one that touches at one place, which is known in continuous time.
    /// The normal force of others is the sum over their places, of which the largest one alone is known.
    fn peak_of(&self, machine: &Machine) -> Option<usize> {
        let name = self.channel.strip_suffix(".normal").filter(|_| self.statistic == Statistic::Max)?;
        let touches_once = |joint: &LooseJoint| joint.kind.site_names().is_empty();
        machine.loose_joints.iter().position(|joint| joint.name == name && touches_once(joint))
    }
}

/// All channels of a simulation at its start.
pub(super) fn channels(machine: &Machine, simulation: &mut Simulation) -> Vec<ChannelInfo> {
    let mut first = Frame { reactions: Some(Vec::new()), ..Frame::default() };
    simulation.sample(simulation.time(), &mut first);
    channels_of(machine, &first)
}

/// Running statistics of one channel.
#[derive(Clone, Debug)]
struct Tally {
    reading: Option<Reading>,
    /// First value. Deviations from it do not lose digits if the spread is small and the mean large.
    first: f64,
    latest: f64,
    least: f64,
    largest: f64,
    /// Time integral of the deviation from the first value, by the trapezoidal rule.
    deviation: f64,
    /// Time integral of the squared deviation, by the trapezoidal rule.
    square: f64,
}

impl Tally {
    /// A tally without values.
    fn new(reading: Option<Reading>) -> Self {
        let unknown = f64::NAN;
        Self {
            reading,
            first: unknown,
            latest: unknown,
            least: unknown,
            largest: unknown,
            deviation: unknown,
            square: unknown,
        }
    }

    fn begin(&mut self, value: f64) {
        let reading = self.reading;
        *self =
            Self { reading, first: value, latest: value, least: value, largest: value, deviation: 0.0, square: 0.0 };
    }

    fn add(&mut self, value: f64, h: f64) {
        let (before, now) = (self.latest - self.first, value - self.first);
        self.deviation += 0.5 * h * (before + now);
        self.square += 0.5 * h * (before * before + now * now);
        self.latest = value;
        // A single unknown value makes the statistics unknown.
        self.least = if value < self.least || value.is_nan() { value } else { self.least };
        self.largest = if value > self.largest || value.is_nan() { value } else { self.largest };
    }

    fn value(&self, statistic: Statistic, span: f64) -> f64 {
        let (mean, square) = if span > 0.0 { (self.deviation / span, self.square / span) } else { (0.0, 0.0) };
        let variance = square - mean * mean;
        // Rounding can make the variance negative; NaN must remain NaN.
        let variance = if variance < 0.0 { 0.0 } else { variance };
        match statistic {
            Statistic::Max => self.largest,
            Statistic::Min => self.least,
            Statistic::Mean => self.first + mean,
            Statistic::Rms => ((self.first + mean) * (self.first + mean) + variance).sqrt(),
            Statistic::Std => variance.sqrt(),
            Statistic::Range => self.largest - self.least,
            Statistic::End => self.latest,
        }
    }
}

/// Accumulator with one tally for each requested [`ChannelStatistic`].
#[derive(Debug)]
pub(super) struct Accumulator {
    requested: Vec<ChannelStatistic>,
    tallies: Vec<Tally>,
    frame: Frame,
    /// Largest time between two samples, s.
    interval: f64,
    latest: f64,
    span: f64,
}

impl Accumulator {
    /// An accumulator of `requested`. Samples are taken at the end of every step and at most `interval`, s, apart. Channels
    /// that the simulation does not have remain unknown.
    pub(super) fn new(requested: &[ChannelStatistic], simulation: &mut Simulation, interval: f64) -> Self {
        let machine = simulation.machine().clone();
        let list = if requested.is_empty() { Vec::new() } else { channels(&machine, simulation) };
        let tally = |statistic: &ChannelStatistic| {
            Tally::new(list.iter().find(|channel| channel.name == statistic.channel).map(ChannelInfo::reading))
        };
        let tallies: Vec<Tally> = requested.iter().map(tally).collect();
        let mut frame = Frame::default();
        tallies.iter().filter_map(|tally| tally.reading).for_each(|reading| reading.request(&mut frame));
        Self { requested: requested.to_vec(), tallies, frame, interval, latest: simulation.time(), span: 0.0 }
    }

    /// Restarts at the latest state.
    pub(super) fn begin(&mut self, simulation: &mut Simulation) {
        if self.tallies.is_empty() {
            return;
        }
        (self.latest, self.span) = (simulation.time(), 0.0);
        simulation.sample(self.latest, &mut self.frame);
        for tally in &mut self.tallies {
            let value = tally.reading.and_then(|reading| reading.read(&self.frame));
            tally.begin(value.unwrap_or(f64::NAN));
        }
    }

    /// Adds the latest step.
    pub(super) fn sample(&mut self, simulation: &mut Simulation) {
        if self.tallies.is_empty() {
            return;
        }
        let (start, end) = (self.latest, simulation.time());
        let samples = ((end - start) / self.interval).ceil().max(1.0) as u64;
        for k in 1..=samples {
            let time = if k == samples { end } else { start + (end - start) * k as f64 / samples as f64 };
            let h = time - self.latest;
            simulation.sample(time, &mut self.frame);
            for tally in &mut self.tallies {
                let value = tally.reading.and_then(|reading| reading.read(&self.frame));
                tally.add(value.unwrap_or(f64::NAN), h);
            }
            self.span += h;
            self.latest = time;
        }
    }

    /// The statistics, in the requested order. `peaks` are the largest normal forces of the joints with play of `machine` in
    /// continuous time over the same span, N.
    pub(super) fn values(&self, machine: &Machine, peaks: impl Fn(usize) -> f64) -> Vec<f64> {
        let value = |(requested, tally): (&ChannelStatistic, &Tally)| match requested.peak_of(machine) {
            Some(joint) => peaks(joint),
            None => tally.value(requested.statistic, self.span),
        };
        self.requested.iter().zip(&self.tallies).map(value).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene() -> Scene {
        Scene::load("slider-crank-driven", &[]).expect("built in")
    }

    #[test]
    fn patterns_select_channels_and_column_names_end_with_the_unit() {
        let columns = |text: &str| {
            let statistics = ChannelStatistic::parse_list(&scene(), text).expect(text);
            statistics.iter().map(|statistic| statistic.column().to_owned()).collect::<Vec<_>>().join(" ")
        };
        for (text, expected) in [
            ("B.normal:max, B.normal:rms", "B_normal_max_N B_normal_rms_N"),
            ("*.force:mean", "B_force_x_mean_N B_force_y_mean_N B_force_z_mean_N"),
            ("crank.angle:end,crank.rate:std", "crank_angle_end_rad crank_rate_std_rad_s"),
            ("B.state:mean", "B_state_mean"),
            ("crank.*ng*:max,crank.angle:max", "crank_angle_max_rad"),
        ] {
            let expected: Vec<&str> = expected.split(' ').collect();
            let computed = columns(text);
            assert!(
                expected.iter().all(|name| computed.split(' ').any(|column| column == *name)),
                "{text}: {computed}"
            );
        }
        let repeated = columns("B.normal:max,B.normal:max");
        assert_eq!(repeated, "B_normal_max_N");
        for (text, fragment) in [
            ("B.normal", "expected CHANNEL:STATISTIC"),
            ("", "expected CHANNEL:STATISTIC"),
            ("B.normal:maks", "`maks` is not a statistic (did you mean `max`?)"),
            ("B.nromal:max", "did you mean `B.normal`?"),
        ] {
            let error = ChannelStatistic::parse_list(&scene(), text).expect_err(text).to_string();
            assert!(error.contains(fragment), "{text}: {error}");
        }
    }

    /// A sine about a large mean, sampled at unequal intervals.
    #[test]
    fn statistics_of_a_sine_match_the_exact_values() {
        let mut tally = Tally::new(None);
        let (mean, amplitude, samples) = (1e6, 2.0, 4000);
        // Two periods, with intervals that alternate between short and long.
        let time = |k: usize| (k as f64 + if k % 2 == 1 { 0.5 } else { 0.0 }) / samples as f64;
        let value = |t: f64| mean + amplitude * libm::sin(2.0 * std::f64::consts::TAU * t);
        tally.begin(value(0.0));
        (1..=samples).for_each(|k| tally.add(value(time(k)), time(k) - time(k - 1)));
        for (statistic, expected) in [
            (Statistic::Max, mean + amplitude),
            (Statistic::Min, mean - amplitude),
            (Statistic::Mean, mean),
            (Statistic::Rms, (mean * mean + amplitude * amplitude / 2.0).sqrt()),
            (Statistic::Std, amplitude / 2.0_f64.sqrt()),
            (Statistic::Range, 2.0 * amplitude),
            (Statistic::End, mean),
        ] {
            // The relative error of the trapezoidal rule is (2 pi h)^2 / 12 with the longest interval h in periods: 1e-6.
            let error = tally.value(statistic, 1.0) - expected;
            assert!(error.abs() < 1e-5, "{statistic}: {error}");
        }
        tally.add(f64::NAN, 1e-3);
        tally.add(mean, 1e-3);
        // Only the last value is known.
        assert!(Statistic::ALL[..6].iter().all(|statistic| tally.value(*statistic, 1.0).is_nan()));
    }
}
