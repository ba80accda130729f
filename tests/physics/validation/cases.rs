//! Validation cases with independently known answers: a table of cases (`cases.toml`), reference values, and this program's
//! results.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::Deserialize;

use jointplay_physics::simulate::{Frame, Impact, Reading, Simulation, channels_of, chosen_channels};
use jointplay_scene::{Scene, evaluate};

/// A run of a scene with known results.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// Title.
    pub title: String,
    /// The scene, by name.
    pub scene: String,
    /// Changed keys of the scene and their values.
    #[serde(default)]
    pub changes: Vec<(String, String)>,
    /// Length of the run, s.
    pub duration: f64,
    /// Source of the case's data and of its answer.
    pub source: String,
    /// Compared quantities.
    #[serde(rename = "check")]
    pub checks: Vec<Check>,
}

/// A quantity, its reference value, and the allowed difference.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Check {
    /// The quantity in words.
    pub quantity: String,
    /// SI unit; empty for a ratio.
    pub unit: String,
    /// Measurement in the run.
    pub measure: Measure,
    /// Reference value.
    pub right: ReferenceValue,
    /// Largest difference allowed, in `unit`.
    pub bound: f64,
}

/// Measurement of a quantity in a run. Channels are those of `run --channels`.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Measure {
    /// A channel at the end of the run.
    End(String),
    /// A channel at an instant.
    At {
        /// Name of the channel.
        channel: String,
        /// The instant, s.
        time: f64,
    },
    /// Largest absolute value of a channel at the ends of steps.
    Largest {
        /// Name of the channel.
        channel: String,
        /// Start of the search, s.
        from: f64,
    },
    /// Integral of a channel over time, by the trapezoidal rule over steps.
    Integral {
        /// Name of the channel.
        channel: String,
        /// Start of the first step that counts at the earliest, s.
        from: f64,
        /// End of the last one at the latest, s.
        to: f64,
    },
    /// Mean interval between upward crossings of a level.
    Period {
        /// Name of the channel.
        channel: String,
        /// The level, SI unit.
        level: f64,
    },
    /// A property of an impact.
    Impact {
        /// Number of the impact in the run, from 1.
        number: usize,
        /// The property.
        property: ImpactProperty,
    },
}

/// A property of an impact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ImpactProperty {
    /// Start time, s.
    Start,
    /// Approach speed, m/s.
    Approach,
    /// Largest normal force, N.
    Peak,
    /// Separation speed over approach speed.
    Restitution,
}

impl ImpactProperty {
    fn of(self, impact: &Impact) -> f64 {
        match self {
            Self::Start => impact.start,
            Self::Approach => impact.approach_speed,
            Self::Peak => impact.peak,
            Self::Restitution => impact.achieved(),
        }
    }
}

/// A reference value and its origin.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum ReferenceValue {
    /// Printed in the source of the case, SI unit.
    Published(f64),
    /// From an independent model, by table and key of `models.toml`.
    Model(String),
    /// A closed form, as an expression.
    Formula(String),
}

/// Results of the independent models (`tests/reference/validation/models.py`), SI units.
pub static MODELS: LazyLock<BTreeMap<String, BTreeMap<String, f64>>> = LazyLock::new(|| {
    let text = include_str!("models.toml");
    toml::from_str(text).unwrap()
});

impl ReferenceValue {
    /// The value, SI unit.
    ///
    /// # Panics
    /// If the embedded tables lack the value; a test reads every value.
    pub fn value(&self) -> f64 {
        match self {
            Self::Published(value) => *value,
            Self::Model(name) => {
                let (case, key) = name.split_once('.').expect("table and key");
                MODELS[case][key]
            }
            Self::Formula(text) => {
                let value = evaluate(text, &[]);
                value.unwrap_or_else(|error| panic!("{text}: {error}")).value()
            }
        }
    }
}

/// All cases, in the order of the validation page.
pub static CASES: LazyLock<Vec<Case>> = LazyLock::new(|| {
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Table {
        case: Vec<Case>,
    }
    let table: Result<Table, _> = toml::from_str(include_str!("cases.toml"));
    table.unwrap().case
});

/// Reference value of a check, and this program's result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Reference value, SI unit.
    pub right: f64,
    /// This program's result; NaN if the run does not show the quantity.
    pub ours: f64,
    /// Largest difference allowed.
    pub bound: f64,
}

impl Comparison {
    /// Result minus reference value.
    pub fn difference(&self) -> f64 {
        self.ours - self.right
    }

    /// Whether the difference is within the bound.
    pub fn holds(&self) -> bool {
        self.difference().abs() <= self.bound
    }
}

impl Case {
    /// Runs the scene and compares every quantity.
    pub fn compare(&self) -> Vec<Comparison> {
        let scene = Scene::load(&self.scene, &self.changes).unwrap();
        let mut run = Run { simulation: Simulation::new(&scene.machine).unwrap(), frame: Frame::default() };
        let mut watches = Vec::with_capacity(self.checks.len());
        for check in &self.checks {
            watches.push(Watch::new(&check.measure, self.duration, &mut run));
        }
        let mut impacts = Vec::new();
        while run.simulation.time() < self.duration {
            run.simulation.step_until(self.duration).unwrap();
            impacts.extend(run.simulation.take_impacts());
            for watch in &mut watches {
                watch.update(&mut run);
            }
        }
        let pairs = self.checks.iter().zip(&watches);
        let compare = |(check, watch): (&Check, &Watch)| Comparison {
            right: check.right.value(),
            ours: watch.result(&impacts),
            bound: check.bound,
        };
        pairs.map(compare).collect()
    }
}

struct Run {
    simulation: Simulation,
    frame: Frame,
}

impl Run {
    /// A channel at an instant within the latest step.
    fn read(&mut self, reading: Reading, time: f64) -> f64 {
        self.simulation.sample(time, &mut self.frame);
        reading.read(&self.frame).unwrap_or(f64::NAN)
    }

    fn reading(&mut self, channel: &str) -> Reading {
        self.simulation.sample(self.simulation.time(), &mut self.frame);
        let all = channels_of(self.simulation.machine(), &self.frame);
        // The first one is the time.
        let [_, own] = &chosen_channels(all, &[channel.to_owned()]).unwrap()[..] else {
            panic!("{channel} is more than one channel")
        };
        own.reading()
    }
}

/// Incremental evaluation of a measure during a run.
enum Watch {
    At { reading: Reading, time: f64, value: f64 },
    Largest { reading: Reading, from: f64, value: f64 },
    Integral { reading: Reading, from: f64, to: f64, value: f64 },
    Period { reading: Reading, level: f64, before: f64, first: f64, last: f64, intervals: u32 },
    Impact { number: usize, property: ImpactProperty },
}

impl Watch {
    fn new(measure: &Measure, duration: f64, run: &mut Run) -> Self {
        let at = |reading, time, run: &mut Run| {
            let value = if time == 0.0 { run.read(reading, 0.0) } else { f64::NAN };
            Self::At { reading, time, value }
        };
        match measure {
            Measure::End(channel) => at(run.reading(channel), duration, run),
            Measure::At { channel, time } => at(run.reading(channel), *time, run),
            Measure::Largest { channel, from } => {
                Self::Largest { reading: run.reading(channel), from: *from, value: f64::NAN }
            }
            Measure::Integral { channel, from, to } => {
                Self::Integral { reading: run.reading(channel), from: *from, to: *to, value: 0.0 }
            }
            Measure::Period { channel, level } => {
                let reading = run.reading(channel);
                let before = run.read(reading, 0.0);
                Self::Period { reading, level: *level, before, first: f64::NAN, last: f64::NAN, intervals: 0 }
            }
            Measure::Impact { number, property } => Self::Impact { number: *number, property: *property },
        }
    }

    /// Evaluates the latest step.
    fn update(&mut self, run: &mut Run) {
        let (start, end) = (run.simulation.step_start(), run.simulation.time());
        match self {
            Self::At { reading, time, value } if start < *time && *time <= end => *value = run.read(*reading, *time),
            // The first value replaces NaN.
            Self::Largest { reading, from, value } if *from <= end => *value = value.max(run.read(*reading, end).abs()),
            Self::Integral { reading, from, to, value } if *from <= start && end <= *to => {
                *value += 0.5 * (end - start) * (run.read(*reading, start) + run.read(*reading, end));
            }
            Self::Period { reading, level, before, first, last, intervals } => {
                let now = run.read(*reading, end);
                if *before < *level && *level <= now {
                    let (mut below, mut above) = (start, end);
                    // Bisection to the last bit.
                    loop {
                        let middle = 0.5 * (below + above);
                        if middle <= below || above <= middle {
                            break;
                        }
                        *(if run.read(*reading, middle) < *level { &mut below } else { &mut above }) = middle;
                    }
                    if first.is_nan() {
                        *first = above;
                    } else {
                        *intervals += 1;
                    }
                    *last = above;
                }
                *before = now;
            }
            _ => {}
        }
    }

    fn result(&self, impacts: &[Impact]) -> f64 {
        match self {
            Self::At { value, .. } | Self::Largest { value, .. } | Self::Integral { value, .. } => *value,
            // NaN without an interval.
            Self::Period { first, last, intervals, .. } => (last - first) / f64::from(*intervals),
            Self::Impact { number, property } => impacts.get(number - 1).map_or(f64::NAN, |impact| property.of(impact)),
        }
    }
}
