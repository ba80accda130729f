//! The points of a sweep: the varied parameters, how their values combine, and the blocks in which the points are computed.

use std::collections::BTreeSet;
use std::ops::Range;

use super::argument::Argument;
use super::axis::{Axis, DrivenCoordinate, RangeError};
use jointplay_physics::words::words;
use jointplay_scene::{Scene, SceneError, Value};

/// Points per block in a `follow` sweep. Each block starts cold at its first point, so that the predecessor of a point does not
/// depend on threads.
pub const FOLLOW_BLOCK: usize = 25;
/// Largest number of points in a sweep.
const MAX_POINTS: usize = 1 << 24;
/// Largest number of points of a map's interior, or of a table, whose scenes are checked in advance.
const MAX_CHECKED: usize = 4096;

/// State from which a point starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// The scene's own initial state.
    Cold,
    /// Final state of the point with the next lower value.
    FollowUp,
    /// Final state of the point with the next higher value.
    FollowDown,
}

impl Start {
    /// Description for the help of the command line.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Cold => "From the scene's own initial state",
            Self::FollowUp => "From the final state of the point with the next lower value",
            Self::FollowDown => "From the final state of the point with the next higher value",
        }
    }
}

words! { Start { Cold => "cold", FollowUp => "follow-up", FollowDown => "follow-down" } }

/// How the values of several parameters combine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrangement {
    /// All combinations of the values; the last parameter varies fastest.
    Crossed,
    /// Value i of each parameter with value i of the others.
    Table,
}

/// All points of a sweep: every parameter set, once for each start.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    axes: Vec<Axis>,
    arrangement: Arrangement,
    starts: Vec<Start>,
}

impl Design {
    /// Every combination of the values of `axes`.
    ///
    /// # Errors
    /// No axis, a repeated key, too many points, a value that the scene does not accept, or a last parameter that cannot be
    /// followed.
    pub fn crossed(scene: &Scene, axes: Vec<Axis>, starts: &[Start]) -> Result<Self, RangeError> {
        axes.iter().try_for_each(|axis| axis.check(scene))?;
        Self::new(scene, axes, Arrangement::Crossed, starts)
    }

    /// One point per row of a table, whose columns are `axes`.
    ///
    /// # Errors
    /// As [`Self::crossed`]; axes of different lengths.
    pub fn of_columns(scene: &Scene, axes: Vec<Axis>, starts: &[Start]) -> Result<Self, RangeError> {
        if let Some(other) = axes.iter().find(|axis| axis.count() != axes[0].count()) {
            let what = format!(
                "{} has {} values and {} has {}; a table of points needs the same number of each",
                axes[0].key(),
                axes[0].count(),
                other.key(),
                other.count(),
            );
            return Err(RangeError::Together(Some(Argument::Points), what));
        }
        Self::new(scene, axes, Arrangement::Table, starts)
    }

    /// One point per row of `rows`, which has a value for each of `keys`.
    ///
    /// # Errors
    /// As [`Self::of_columns`]; a row of another length.
    pub fn table(scene: &Scene, keys: &[String], rows: &[Vec<Value>], starts: &[Start]) -> Result<Self, RangeError> {
        if let Some(i) = rows.iter().position(|row| row.len() != keys.len()) {
            let (values, keys) = (rows[i].len(), keys.len());
            let what = format!("row {i} of the points has {values} values for {keys} keys");
            return Err(RangeError::Together(None, what));
        }
        let column =
            |(j, key): (usize, &String)| Axis::listed(scene, key, rows.iter().map(|row| row[j].clone()).collect());
        let axes = keys.iter().enumerate().map(column).collect::<Result<Vec<_>, _>>()?;
        Self::of_columns(scene, axes, starts)
    }

    fn new(scene: &Scene, axes: Vec<Axis>, arrangement: Arrangement, starts: &[Start]) -> Result<Self, RangeError> {
        let invalid = |argument, what: String| Err(RangeError::Together(argument, what));
        if axes.is_empty() {
            return invalid(Some(Argument::Vary), "a sweep varies at least one parameter, as in KEY=A..B:N".to_owned());
        }
        let mut keys = BTreeSet::new();
        if let Some(repeated) = axes.iter().find(|axis| !keys.insert(axis.key())) {
            return Err(repeated.duplicate_error());
        }
        let mut known = BTreeSet::new();
        match starts.iter().find(|start| !known.insert(start.word())) {
            Some(repeated) => return invalid(Some(Argument::Start), format!("{} is given twice", repeated.word())),
            None if starts.is_empty() => return invalid(Some(Argument::Start), "give at least one start".to_owned()),
            None => {}
        }
        let design = Self { axes, arrangement, starts: starts.to_vec() };
        let points = design.shape().into_iter().try_fold(1_usize, usize::checked_mul);
        if points.is_none_or(|points| points > MAX_POINTS) {
            return invalid(None, format!("the ranges have more than {MAX_POINTS} points together"));
        }
        if let Some(start) = design.starts.iter().find(|start| **start != Start::Cold) {
            design.check_following(scene, *start)?;
        }
        Ok(design)
    }

    /// Requires numbers in ascending order along a row, and no parameter along it that takes effect only at a reset.
    fn check_following(&self, scene: &Scene, start: Start) -> Result<(), RangeError> {
        let invalid = |why: String, or| Err(RangeError::Start { start: start.word(), why, or });
        let (last, others) = match self.axes.split_last() {
            Some((last, others)) => (last, others),
            None => return Ok(()),
        };
        if !last.is_ascending() {
            let why = format!(
                "a state is followed from one value to the next, and the values of {} are not numbers in ascending order",
                last.key()
            );
            return invalid(why, ", or name a range last");
        }
        let along = match self.arrangement {
            Arrangement::Crossed => std::slice::from_ref(last),
            Arrangement::Table => &self.axes[..],
        };
        if let Some(deferred) = along.iter().find(|axis| axis.waits_for_restart(scene)) {
            let why = format!(
                "{} takes effect at the next reset only, so no state can be followed through its values",
                deferred.key()
            );
            let has_no_alternative = others.is_empty() || self.arrangement == Arrangement::Table;
            return invalid(why, if has_no_alternative { "" } else { ", or name another range last" });
        }
        Ok(())
    }

    /// Varied parameters.
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// How their values combine.
    pub fn arrangement(&self) -> Arrangement {
        self.arrangement
    }

    /// Starts. With several, every parameter set is a point for each of them.
    pub fn starts(&self) -> &[Start] {
        &self.starts
    }

    /// Shape of an array with one value per point: the number of starts, if there are several, then the number of values of
    /// each crossed axis, or the number of rows of a table.
    pub fn shape(&self) -> Vec<usize> {
        let starts = (self.starts.len() > 1).then_some(self.starts.len());
        starts.into_iter().chain(self.counts()).collect()
    }

    /// Number of values along each independent direction.
    fn counts(&self) -> Vec<usize> {
        let counts = self.axes.iter().map(Axis::count);
        match self.arrangement {
            Arrangement::Crossed => counts.collect(),
            Arrangement::Table => counts.take(1).collect(),
        }
    }

    /// Number of parameter sets.
    fn sets(&self) -> usize {
        self.counts().into_iter().product()
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.starts.len() * self.sets()
    }

    /// Start of a point.
    pub fn start(&self, point: usize) -> Start {
        self.starts[point / self.sets()]
    }

    /// Index of a point along each axis.
    pub fn indices(&self, point: usize) -> Vec<usize> {
        let mut rest = point % self.sets();
        if self.arrangement == Arrangement::Table {
            return vec![rest; self.axes.len()];
        }
        let index = |axis: &Axis| {
            let index = rest % axis.count();
            rest /= axis.count();
            index
        };
        let mut indices: Vec<usize> = self.axes.iter().rev().map(index).collect();
        indices.reverse();
        indices
    }

    /// Key and value of every varied parameter at a point.
    pub fn settings(&self, point: usize) -> Vec<(&str, Value)> {
        let indices = self.indices(point).into_iter();
        let pairs = self.axes.iter().zip(indices).filter(|(axis, _)| axis.coordinate().is_none());
        pairs.map(|(axis, i)| (axis.key(), axis.value(i))).collect()
    }

    /// Every varied driven coordinate at a point with its value, m or rad.
    pub fn coordinates(&self, point: usize) -> impl Iterator<Item = (DrivenCoordinate, f64)> {
        let pairs = self.axes.iter().zip(self.indices(point));
        pairs.filter_map(|(axis, i)| Some((axis.coordinate()?, axis.number(i))))
    }

    /// The scene of a point.
    ///
    /// # Errors
    /// Values that the scene does not accept together.
    pub fn scene(&self, base: &Scene, point: usize) -> Result<Scene, SceneError> {
        let settings = self.settings(point);
        let one_by_one = || {
            let mut scene = base.clone();
            for (key, value) in &settings {
                scene.set_value(key, value)?;
            }
            Ok(scene)
        };
        // One change at a time can fail on values that are valid only together, such as a large clearance and a larger ball.
        let together = |error| {
            let write = |key: &str, value| base.parameter(key).map(|parameter| parameter.write(value));
            let written = settings.iter().map(|(key, value)| Ok(((*key).to_owned(), write(key, value)?)));
            let changes: Result<Vec<_>, SceneError> = base.changes.iter().cloned().map(Ok).chain(written).collect();
            base.with_changes(&changes?).map_err(|_| error)
        };
        one_by_one().or_else(together)
    }

    /// Points whose scenes are checked before anything runs. With crossed axes, these are every value of each axis with the
    /// others at their ends, and a lattice inside, which covers every point of a small map; with more than two axes, at most
    /// [`MAX_CHECKED`] of these. In a table, these are all points, or [`MAX_CHECKED`] spread over the rows.
    pub(super) fn checked_points(&self) -> Vec<usize> {
        let sets = self.sets();
        if self.arrangement == Arrangement::Table {
            return (0..sets - 1).step_by(sets.div_ceil(MAX_CHECKED)).chain([sets - 1]).collect();
        }
        let fits = |per_axis: usize| {
            per_axis.checked_pow(self.axes.len() as u32).is_some_and(|lattice| lattice <= MAX_CHECKED)
        };
        let max_per_axis = (1..=MAX_CHECKED).take_while(|per_axis| fits(*per_axis)).last().unwrap_or(1);
        let is_checked = |point: &usize| {
            let indices = self.indices(*point);
            let along = || self.axes.iter().zip(&indices);
            let is_end = |(axis, i): (&Axis, &usize)| *i == 0 || *i + 1 == axis.count();
            let ends = along().filter(|&of| is_end(of)).count();
            ends + 1 >= indices.len() || along().all(|(axis, i)| i % axis.count().div_ceil(max_per_axis) == 0)
        };
        let all: Vec<usize> = (0..sets).filter(is_checked).collect();
        // With more than two axes, the border itself grows like 2 to the power of their number.
        let stride = if self.axes.len() > 2 { all.len().div_ceil(MAX_CHECKED) } else { 1 };
        all.into_iter().step_by(stride).collect()
    }

    /// Number of blocks. A block is computed as a whole, independently of threads.
    pub fn blocks(&self) -> usize {
        self.starts.iter().map(|start| self.blocks_of(*start)).sum()
    }

    /// Points of block `b`: one point, or for `follow` up to [`FOLLOW_BLOCK`] neighbours in one row; none beyond the last block.
    pub fn block(&self, b: usize) -> Range<usize> {
        let (mut b, mut first) = (b, 0);
        for &start in &self.starts {
            let blocks = self.blocks_of(start);
            if b < blocks {
                let per_row = self.blocks_per_row(start);
                let (row, part) = (b / per_row, b % per_row);
                let (row_length, length) = (self.row_length(), block_length(start));
                first += row * row_length;
                return first + part * length..first + ((part + 1) * length).min(row_length);
            }
            b -= blocks;
            first += self.sets();
        }
        first..first
    }

    /// Points of block `b` in the order in which they are computed.
    pub fn order(&self, b: usize) -> Vec<usize> {
        let points = self.block(b);
        let is_down = !points.is_empty() && self.start(points.start) == Start::FollowDown;
        if is_down { points.rev().collect() } else { points.collect() }
    }

    fn row_length(&self) -> usize {
        self.axes.last().map_or(1, Axis::count)
    }

    fn blocks_of(&self, start: Start) -> usize {
        self.sets() / self.row_length() * self.blocks_per_row(start)
    }

    fn blocks_per_row(&self, start: Start) -> usize {
        self.row_length().div_ceil(block_length(start))
    }
}

fn block_length(start: Start) -> usize {
    if start == Start::Cold { 1 } else { FOLLOW_BLOCK }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spcmm() -> Scene {
        Scene::load("spcmm", &[]).expect("built in")
    }

    fn axis(text: &str) -> Axis {
        Axis::parse(&spcmm(), text).expect("a range")
    }

    #[test]
    fn blocks_cover_every_point_once_and_stay_in_their_row() {
        let scene = spcmm();
        let axes = || vec![axis("contact.friction=0.1..0.4:3"), axis("contact.clearance=0.1mm..1mm:60")];
        let with_starts = |starts: &[Start]| Design::crossed(&scene, axes(), starts).expect("a map");
        for starts in [&[Start::Cold][..], &[Start::FollowUp], &[Start::FollowDown], &Start::ALL] {
            let design = with_starts(starts);
            assert_eq!(design.points(), 180 * starts.len());
            let mut seen = vec![0; design.points()];
            for b in 0..design.blocks() {
                let order = design.order(b);
                let row = |point: usize| (design.start(point).word(), design.indices(point)[0]);
                assert!(order.iter().all(|&point| row(point) == row(order[0])));
                let down = order.windows(2).all(|pair| pair[0] > pair[1]);
                let up = order.windows(2).all(|pair| pair[0] < pair[1]);
                let is_down = design.start(order[0]) == Start::FollowDown;
                assert!(order.len() == 1 || if is_down { down } else { up });
                order.iter().for_each(|&point| seen[point] += 1);
            }
            assert!(seen.iter().all(|&n| n == 1), "{starts:?}");
        }
        let design = with_starts(&Start::ALL);
        assert_eq!(design.shape(), [3, 3, 60]);
        assert_eq!(design.indices(180 + 61), [1, 1]);
        assert_eq!(design.settings(61)[0], ("contact.friction", Value::Number(0.25)));
    }

    #[test]
    fn a_row_of_a_table_is_a_point() {
        let scene = spcmm();
        let axes = vec![axis("contact.friction=0.1..0.3:3"), axis("contact.normal_law=hertz,flores,hertz")];
        let design = Design::of_columns(&scene, axes, &[Start::Cold]).expect("three points");
        assert_eq!((design.points(), design.blocks(), design.shape()), (3, 3, vec![3]));
        let settings = design.settings(1);
        assert_eq!(settings[0], ("contact.friction", Value::Number(0.2)));
        assert_eq!(settings[1], ("contact.normal_law", Value::Choice("flores")));
        let keys = ["contact.friction", "contact.normal_law"].map(str::to_owned);
        let rows = [0.1, 0.2, 0.3].map(Value::Number).into_iter().zip(["hertz", "flores", "hertz"].map(Value::Choice));
        let rows: Vec<Vec<Value>> = rows.map(|(friction, law)| vec![friction, law]).collect();
        let table = Design::table(&scene, &keys, &rows, &[Start::Cold]).expect("three points");
        assert!((0..3).all(|point| table.scene(&scene, point) == design.scene(&scene, point)));
        let short = Design::table(&scene, &keys, &[vec![Value::Number(0.1)]], &[Start::Cold]);
        assert!(short.expect_err("one value").to_string().contains("1 values for 2 keys"));
        // A clearance above the ball radius of the scene, with a larger ball.
        let keys = ["contact.clearance", "contact.ball_radius"].map(str::to_owned);
        let loose = Design::table(&scene, &keys, &[vec![Value::Number(0.012), Value::Number(0.05)]], &[Start::Cold]);
        let loose = loose.map(|table| table.scene(&scene, 0).expect("accepted together"));
        assert_eq!(loose.map(|scene| scene.machine.contact.clearance), Ok(0.012));
        let outside = Design::table(&scene, &keys[..1], &[vec![Value::Number(-1.0)]], &[Start::Cold]);
        assert!(outside.expect_err("negative").to_string().contains("out of range"));
    }

    #[test]
    fn ranges_that_cannot_be_combined_are_refused() {
        let scene = spcmm();
        let friction = || axis("contact.friction=0.1..0.4:3");
        let frequency = || axis("spcmm.frequency=0.5Hz..1Hz:3");
        let follow = [Start::FollowUp];
        for (axes, starts, fragment) in [
            (vec![], &[Start::Cold][..], "at least one"),
            (vec![friction(), friction()], &[Start::Cold], "twice"),
            (vec![axis("contact.clearance=0.1mm..20mm:5")], &[Start::Cold], "below the ball radius"),
            (vec![friction()], &[Start::Cold, Start::Cold], "cold is given twice"),
            (vec![friction()], &[], "at least one start"),
            (vec![frequency()], &follow, "takes effect at the next reset"),
            (vec![friction(), axis("contact.normal_law=hertz,flores")], &follow, "ascending"),
            (vec![axis("contact.friction=0.3,0.1")], &follow, "ascending"),
        ] {
            let error = Design::crossed(&scene, axes, starts).expect_err(fragment).to_string();
            assert!(error.contains(fragment), "{error}");
        }
        assert!(Design::crossed(&scene, vec![frequency(), friction()], &follow).is_ok());
        let table = |axes, starts| Design::of_columns(&scene, axes, starts).map_err(|error| error.to_string());
        assert!(table(vec![frequency(), friction()], &follow).is_err_and(|why| why.contains("next reset")));
        let uneven = table(vec![axis("contact.clearance=0.1mm..1mm:4"), friction()], &[Start::Cold]);
        assert!(uneven.is_err_and(|why| why.contains("contact.clearance has 4 values and contact.friction has 3")));
    }

    #[test]
    fn interior_points_of_a_small_map_are_checked() {
        let checked_points = |rows: usize, columns: usize| {
            let axes =
                [format!("contact.clearance=0.2mm..0.5mm:{rows}"), format!("contact.friction=0.1..0.2:{columns}")];
            let axes = axes.map(|text| axis(&text)).to_vec();
            Design::crossed(&spcmm(), axes, &[Start::Cold]).expect("a map").checked_points()
        };
        assert_eq!(checked_points(3, 5), (0..15).collect::<Vec<_>>());
        // The border, and every second value of the first range and every third of the second.
        let large = checked_points(128, 130);
        for (i, j, expected) in
            [(0, 1, true), (127, 7, true), (5, 129, true), (2, 3, true), (2, 4, false), (3, 3, false)]
        {
            assert_eq!(large.contains(&(i * 130 + j)), expected, "{i} {j}");
        }
    }
}
