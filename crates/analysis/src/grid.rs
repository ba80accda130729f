//! The points of a sweep: the varied parameters, their values, and the blocks in which the points are computed.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use jointplay_scene::{Kind, Scene, SceneError, Value, ValueError};

/// Points per block in a `follow` sweep: each block starts cold at its first point, so that neither threads nor shards
/// affect which point continues from which.
pub const FOLLOW_BLOCK: usize = 25;
/// Largest number of points in a sweep.
const MOST_POINTS: usize = 1 << 24;
/// Largest number of parameters varied together.
const MOST_AXES: usize = 2;

/// Why a range is invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RangeError {
    /// Malformed.
    #[error("--vary {text}: expected KEY=A..B:N, e.g. contact.clearance=0.01mm..1mm:200")]
    Form {
        /// As written.
        text: String,
    },
    /// An unknown key, or an end that the parameter does not accept.
    #[error("--vary {text}: {error}")]
    Scene {
        /// As written.
        text: String,
        /// What is wrong.
        error: Box<SceneError>,
    },
    /// An end that is not a value of the parameter.
    #[error("--vary {text}: {end}: {error}")]
    End {
        /// As written.
        text: String,
        /// The end at fault.
        end: String,
        /// What is wrong and what is allowed.
        error: ValueError,
    },
    /// A parameter whose values are words.
    #[error("--vary {text}: {key} is not a number; only numbers can be varied")]
    Words {
        /// As written.
        text: String,
        /// Key.
        key: String,
    },
    /// A whole-number parameter whose equal steps are not whole.
    #[error(
        "--vary {text}: {key} takes whole numbers, which {count} equally spaced values from {from} to {to} are \
             not"
    )]
    NotWhole {
        /// As written.
        text: String,
        /// Key.
        key: String,
        /// First value.
        from: u64,
        /// Last value.
        to: u64,
        /// Number of values.
        count: usize,
    },
    /// No points.
    #[error("--vary {text}: the range is empty: {what}")]
    Empty {
        /// As written.
        text: String,
        /// Why.
        what: String,
    },
    /// The last value is below the first.
    #[error(
        "--vary {text}: the range is reversed: its first end is above its second; write {to}..{from} (--start \
         follow-down runs through it downwards)"
    )]
    Reversed {
        /// As written.
        text: String,
        /// First end as written.
        from: String,
        /// Second end as written.
        to: String,
    },
    /// Too many ranges, or one key twice.
    #[error("{0}")]
    Together(String),
}

/// One varied parameter with its values, equally spaced, both ends included.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterRange {
    key: String,
    from: f64,
    to: f64,
    count: usize,
    whole: bool,
}

impl ParameterRange {
    /// Parses `KEY=A..B:N` for `scene`, and tries both ends.
    ///
    /// # Errors
    /// A text that is not a range accepted by the scene.
    pub fn parse(scene: &Scene, text: &str) -> Result<Self, RangeError> {
        let own = || text.to_owned();
        let parts = || {
            let (key, rest) = text.split_once('=')?;
            let (range, count) = rest.rsplit_once(':')?;
            let (from, to) = range.split_once("..")?;
            Some((key.trim(), from.trim(), to.trim(), count.trim()))
        };
        let Some((key, from, to, count)) = parts() else {
            return Err(RangeError::Form { text: own() });
        };
        let wrong = |error| RangeError::Scene { text: own(), error: Box::new(error) };
        let parameter = scene.parameter(key).map_err(wrong)?;
        let count: usize = count.parse().map_err(|_| RangeError::Form { text: own() })?;
        if count == 0 {
            let what = "0 values".to_owned();
            return Err(RangeError::Empty { text: own(), what });
        }
        let read = |end: &str| match parameter.read(end) {
            Ok(value) => Ok(value),
            Err(error) => Err(RangeError::End { text: own(), end: end.to_owned(), error }),
        };
        let (first, last, whole) = match (parameter.kind, read(from)?, read(to)?) {
            (_, Value::Number(first), Value::Number(last)) => (first, last, false),
            (Kind::Count { .. }, Value::Count(first), Value::Count(last)) => (first as f64, last as f64, true),
            _ => {
                let key = key.to_owned();
                return Err(RangeError::Words { text: own(), key });
            }
        };
        if first > last {
            return Err(RangeError::Reversed { text: own(), from: from.to_owned(), to: to.to_owned() });
        }
        if (first == last) != (count == 1) {
            let what = if count == 1 {
                "1 value between two different ends; give both ends the same value, or more values".to_owned()
            } else {
                format!("both ends are {from}, so there is 1 value and not {count}")
            };
            return Err(RangeError::Empty { text: own(), what });
        }
        let axis = Self { key: key.to_owned(), from: first, to: last, count, whole };
        if whole && axis.values().any(|value| value.fract() != 0.0) {
            return Err(RangeError::NotWhole {
                text: own(),
                key: key.to_owned(),
                from: first as u64,
                to: last as u64,
                count,
            });
        }
        for end in [0, count - 1] {
            let mut trial = scene.clone();
            trial.set_value(key, &axis.parameter_value(end)).map_err(wrong)?;
        }
        Ok(axis)
    }

    /// Key of the parameter.
    pub fn key(&self) -> &str {
        &self.key
    }

    /// Number of values.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Value `i`, SI.
    pub fn value(&self, i: usize) -> f64 {
        if i + 1 == self.count {
            self.to
        } else {
            self.from + (self.to - self.from) * i as f64 / (self.count - 1) as f64
        }
    }

    /// Whether its values take effect only at a reset of `scene`.
    fn waits(&self, scene: &Scene) -> bool {
        let at = |i| {
            let mut scene = scene.clone();
            let parameter = scene.set_value(&self.key, &self.parameter_value(i)).ok()?;
            Some((parameter.at_reset, scene))
        };
        let ends = at(0).zip(at(self.count - 1));
        ends.is_some_and(|((waits, first), (_, last))| {
            waits && !first.machine.differs_in_conditions_alone(&last.machine)
        })
    }

    /// All values in order, SI.
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.count).map(|i| self.value(i))
    }

    /// Value `i` in the form that the scene accepts.
    pub fn parameter_value(&self, i: usize) -> Value {
        let value = self.value(i);
        if self.whole { Value::Count(value as u64) } else { Value::Number(value) }
    }
}

/// State from which a point starts: [`Self::meaning`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Start {
    /// The scene's own initial state.
    Cold,
    /// Final state of the point with the next lower value.
    FollowUp,
    /// Final state of the point with the next higher value.
    FollowDown,
}

impl Start {
    /// All variants, in the order of the help.
    pub const ALL: [Self; 3] = [Self::Cold, Self::FollowUp, Self::FollowDown];

    /// Description for the help of the command line.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Cold => "From the scene's own initial state",
            Self::FollowUp => "From the final state of the point with the next lower value",
            Self::FollowDown => "From the final state of the point with the next higher value",
        }
    }

    /// The word on the command line and in files.
    pub fn word(self) -> &'static str {
        match self {
            Self::Cold => "cold",
            Self::FollowUp => "follow-up",
            Self::FollowDown => "follow-down",
        }
    }
}

/// All points of a sweep; the last axis varies fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    axes: Vec<ParameterRange>,
    start: Start,
}

impl Grid {
    /// A grid over `axes`.
    ///
    /// # Errors
    /// No axis, more than two, a repeated key, too many points, or a followed parameter that changes only on reset.
    pub fn new(scene: &Scene, axes: Vec<ParameterRange>, start: Start) -> Result<Self, RangeError> {
        let wrong = |message: String| Err(RangeError::Together(message));
        let Some(last) = axes.last() else {
            return wrong("a sweep varies at least one parameter: add --vary KEY=A..B:N".to_owned());
        };
        if axes.len() > MOST_AXES {
            return wrong(format!("{} --vary: a sweep varies at most {MOST_AXES} parameters", axes.len()));
        }
        if axes.len() == 2 && axes[0].key == axes[1].key {
            return wrong(format!("--vary {} is given twice", last.key));
        }
        let points = axes.iter().try_fold(1_usize, |n, axis| n.checked_mul(axis.count));
        if points.is_none_or(|points| points > MOST_POINTS) {
            return wrong(format!("the ranges have more than {MOST_POINTS} points together"));
        }
        if start != Start::Cold && last.waits(scene) {
            return wrong(format!(
                "--start {}: {} takes effect at the next reset only, so no state can be followed through its values; use \
                 --start cold{}",
                start.word(),
                last.key,
                if axes.len() == 2 { ", or name the other range last" } else { "" },
            ));
        }
        Ok(Self { axes, start })
    }

    /// Varied parameters.
    pub fn axes(&self) -> &[ParameterRange] {
        &self.axes
    }

    /// Where points start from.
    pub fn start(&self) -> Start {
        self.start
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.axes.iter().map(ParameterRange::count).product()
    }

    /// Index of a point along each axis.
    pub fn indices(&self, point: usize) -> Vec<usize> {
        let mut rest = point;
        let mut indices: Vec<usize> = self
            .axes
            .iter()
            .rev()
            .map(|axis| {
                let index = rest % axis.count;
                rest /= axis.count;
                index
            })
            .collect();
        indices.reverse();
        indices
    }

    /// Key and value of every varied parameter at a point.
    pub fn settings(&self, point: usize) -> Vec<(&str, Value)> {
        let indices = self.indices(point).into_iter();
        let pairs = self.axes.iter().zip(indices);
        pairs.map(|(axis, i)| (axis.key(), axis.parameter_value(i))).collect()
    }

    /// The scene of a point.
    ///
    /// # Errors
    /// Values that the scene does not accept together.
    pub fn scene(&self, base: &Scene, point: usize) -> Result<Scene, SceneError> {
        let mut scene = base.clone();
        for (key, value) in self.settings(point) {
            scene.set_value(key, &value)?;
        }
        Ok(scene)
    }

    /// Number of blocks. A block is computed in one piece, independently of threads and shards.
    pub fn blocks(&self) -> usize {
        self.rows() * self.blocks_per_row()
    }

    /// Points of block `b`: one point, or for `follow` up to [`FOLLOW_BLOCK`] neighbours in one row.
    pub fn block(&self, b: usize) -> Range<usize> {
        let (row, part) = (b / self.blocks_per_row(), b % self.blocks_per_row());
        let (row_length, length) = (self.row_length(), self.block_length());
        let start = row * row_length;
        start + part * length..start + ((part + 1) * length).min(row_length)
    }

    /// Points of block `b` in the order in which they are computed.
    pub fn order(&self, b: usize) -> Vec<usize> {
        let points = self.block(b);
        if self.start == Start::FollowDown { points.rev().collect() } else { points.collect() }
    }

    fn block_length(&self) -> usize {
        if self.start == Start::Cold { 1 } else { FOLLOW_BLOCK }
    }

    fn row_length(&self) -> usize {
        self.axes.last().map_or(1, ParameterRange::count)
    }

    fn rows(&self) -> usize {
        self.points() / self.row_length()
    }

    fn blocks_per_row(&self) -> usize {
        self.row_length().div_ceil(self.block_length())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spcmm() -> Scene {
        Scene::load("spcmm", &[]).expect("built in")
    }

    fn axis(text: &str) -> Result<ParameterRange, RangeError> {
        ParameterRange::parse(&spcmm(), text)
    }

    #[test]
    fn values_are_linear_with_both_ends() {
        let axis = axis("contact.clearance=0.01mm..1mm:200").expect("a range");
        assert_eq!(axis.count(), 200);
        assert_eq!((axis.value(0), axis.value(199)), (1e-5, 1e-3));
        let steps: Vec<f64> = axis.values().collect();
        for pair in steps.windows(2) {
            assert!((pair[1] - pair[0] - 0.99e-3 / 199.0).abs() < 1e-15);
        }
        assert_eq!(super::ParameterRange::parse(&spcmm(), "contact.friction=0.2..0.2:1").map(|a| a.value(0)), Ok(0.2));
    }

    #[test]
    fn ranges_that_are_none_say_why() {
        for (text, fragment) in [
            ("contact.clearance", "expected KEY=A..B:N"),
            ("contact.clearance=0.1mm..1mm", "expected KEY=A..B:N"),
            ("contact.clearance=0.1mm..1mm:x", "expected KEY=A..B:N"),
            ("contact.clearance=0.1mm..1mm:0", "empty: 0 values"),
            ("contact.clearance=1mm..0.1mm:5", "reversed"),
            ("contact.clearance=1mm..1mm:5", "empty: both ends"),
            ("contact.clearance=0.1mm..1mm:1", "empty: 1 value"),
            ("contact.clearance=0.1..1mm:5", "0.1: needs a unit"),
            ("contact.clearance=0.1mm..20mm:5", "below the ball radius"),
            ("contact.clearence=0.1mm..1mm:5", "did you mean `contact.clearance`?"),
            ("contact.normal_law=hertz..flores:2", "only numbers"),
            ("chain.links=2..4:3", "unknown key"),
            ("contact.friction=-1..1:3", "-1: out of range"),
        ] {
            let error = axis(text).expect_err(text).to_string();
            assert!(error.contains(fragment), "{text}: {error}");
            assert!(error.starts_with("--vary"), "{error}");
        }
        let chain = Scene::load("chain", &[]).expect("built in");
        let links = ParameterRange::parse(&chain, "chain.links=2..6:3").expect("whole numbers");
        assert_eq!(links.parameter_value(1), Value::Count(4));
        assert!(matches!(ParameterRange::parse(&chain, "chain.links=2..6:4"), Err(RangeError::NotWhole { .. })));
    }

    #[test]
    fn blocks_cover_every_point_once_and_stay_in_their_row() {
        let scene = spcmm();
        let axes = || {
            vec![
                axis("contact.friction=0.1..0.4:3").expect("a range"),
                axis("contact.clearance=0.1mm..1mm:60").expect("a range"),
            ]
        };
        for start in [Start::Cold, Start::FollowUp, Start::FollowDown] {
            let grid = Grid::new(&scene, axes(), start).expect("a grid");
            let mut seen = vec![0; grid.points()];
            for b in 0..grid.blocks() {
                let order = grid.order(b);
                let row = |point: usize| grid.indices(point)[0];
                assert!(order.iter().all(|&point| row(point) == row(order[0])));
                let down = order.windows(2).all(|pair| pair[0] > pair[1]);
                let up = order.windows(2).all(|pair| pair[0] < pair[1]);
                assert!(order.len() == 1 || if start == Start::FollowDown { down } else { up });
                order.iter().for_each(|&point| seen[point] += 1);
            }
            assert!(seen.iter().all(|&n| n == 1), "{start:?}");
        }
        let grid = Grid::new(&scene, axes(), Start::Cold).expect("a grid");
        assert_eq!(grid.indices(61), [1, 1]);
        let values = grid.settings(61);
        assert_eq!(values[0], ("contact.friction", Value::Number(0.25)));
    }

    #[test]
    fn ranges_that_do_not_go_together_are_refused() {
        let scene = spcmm();
        let friction = || axis("contact.friction=0.1..0.4:3").expect("a range");
        let frequency = || axis("spcmm.frequency=0.5Hz..1Hz:3").expect("a range");
        for (axes, start, fragment) in [
            (vec![], Start::Cold, "at least one"),
            (vec![friction(), friction()], Start::Cold, "twice"),
            (vec![friction(), frequency(), friction()], Start::Cold, "at most 2"),
            (vec![frequency()], Start::FollowUp, "takes effect at the next reset"),
        ] {
            let error = Grid::new(&scene, axes, start).expect_err(fragment).to_string();
            assert!(error.contains(fragment), "{error}");
        }
        assert!(Grid::new(&scene, vec![frequency(), friction()], Start::FollowUp).is_ok());
    }
}
