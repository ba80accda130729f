//! The columns of a sweep's result and the order of its numbers: one record of a fixed length for every point.

use super::drive::OBSERVABLES;
use super::point::{Plan, PointResult};
use crate::scene::Scene;

/// What a point's numbers are worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// All periods are through.
    Done,
    /// The divergence guard stopped it.
    Diverged,
    /// The scene could not start.
    NoStart,
}

impl Status {
    /// The number in files.
    pub fn code(self) -> i64 {
        match self {
            Self::Done => 0,
            Self::Diverged => 1,
            Self::NoStart => 2,
        }
    }
}

/// One array of the result.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// Name, with the unit.
    pub name: String,
    /// Whether its values are whole numbers.
    pub whole: bool,
    /// Whether a point has one value for each kept section instead of one.
    pub per_section: bool,
}

/// All arrays of a sweep's result.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    columns: Vec<Column>,
    joints: usize,
    probe: bool,
    kept: usize,
}

const JOINT: [(&str, bool); 6] = [
    ("peak_N", false),
    ("peak_kept_N", false),
    ("mean_N", false),
    ("impacts", true),
    ("impacts_kept", true),
    ("last_separation_s", false),
];

impl Layout {
    /// The arrays that a sweep of `scene` has.
    pub fn new(scene: &Scene, plan: &Plan) -> Self {
        let mut columns = Vec::new();
        let mut add = |name: &str, whole: bool, per_section: bool| {
            columns.push(Column {
                name: name.to_owned(),
                whole,
                per_section,
            });
        };
        add("status", true, false);
        add("stopped_at_s", false, false);
        add("regime", true, false);
        add("period", true, false);
        add("return_distance", false, false);
        add("distinct_sections", true, false);
        add("zero_one", false, false);
        add("exponent_per_s", false, false);
        add("exponent_standard_error_per_s", false, false);
        add("exponent_bound_per_s", false, false);
        for joint in &scene.ball_joints {
            for (quantity, whole) in JOINT {
                add(&format!("{}_{quantity}", joint.name), whole, false);
            }
        }
        let probe = scene.output.probe.is_some();
        if probe {
            add("probe_error_max_um", false, false);
            add("probe_error_rms_um", false, false);
        }
        add("exponent_running_per_s", false, true);
        for observable in OBSERVABLES {
            add(&format!("section_{observable}"), false, true);
        }
        Self {
            columns,
            joints: scene.ball_joints.len(),
            probe,
            kept: plan.periods - plan.discard,
        }
    }

    /// Arrays in order.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Sections kept of a point.
    pub fn kept(&self) -> usize {
        self.kept
    }

    /// Values that a point has in `column`.
    pub fn values_in(&self, column: &Column) -> usize {
        if column.per_section { self.kept } else { 1 }
    }

    /// Numbers of a record.
    pub fn record_length(&self) -> usize {
        self.columns.iter().map(|c| self.values_in(c)).sum()
    }

    /// Where in a record the values of array `column` begin.
    pub fn offset(&self, column: usize) -> usize {
        self.columns[..column]
            .iter()
            .map(|c| self.values_in(c))
            .sum()
    }

    /// Appends the record of a point; `None` stands for one that could not start.
    pub fn append(&self, result: Option<&PointResult>, record: &mut Vec<f64>) {
        let unknown;
        let (status, result) = match result {
            Some(result) if result.stopped.is_some() => (Status::Diverged, result),
            Some(result) => (Status::Done, result),
            None => {
                unknown = PointResult::empty(self.joints);
                (Status::NoStart, &unknown)
            }
        };
        let start = record.len();
        let evidence = &result.evidence;
        let exponent = evidence.exponent.as_ref();
        record.push(status.code() as f64);
        record.push(result.stopped.unwrap_or(f64::NAN));
        // A point that did not end has no regime: its code is that of none, -1.
        let done = status == Status::Done;
        record.push(if done {
            result.regime.code() as f64
        } else {
            -1.0
        });
        record.push(result.regime.period() as f64);
        let known = |value: f64| if done { value } else { f64::NAN };
        record.push(known(evidence.return_distance));
        record.push(evidence.distinct as f64);
        record.push(evidence.zero_one);
        record.push(exponent.map_or(f64::NAN, |e| e.value));
        record.push(exponent.map_or(f64::NAN, |e| e.standard_error));
        record.push(known(evidence.exponent_bound));
        for joint in &result.joints {
            record.extend([joint.peak, joint.peak_kept, joint.mean]);
            record.extend([joint.impacts as f64, joint.impacts_kept as f64]);
            record.push(joint.last_separation);
        }
        if self.probe {
            let (largest, rms) = result.probe.unwrap_or((f64::NAN, f64::NAN));
            record.extend([largest * 1e6, rms * 1e6]);
        }
        let running = exponent.map_or(&[][..], |e| &e.running);
        record.extend((0..self.kept).map(|k| running.get(k).copied().unwrap_or(f64::NAN)));
        let width = OBSERVABLES.len();
        for i in 0..width {
            let value = |k: usize| result.sections.get(k * width + i).copied();
            record.extend((0..self.kept).map(|k| value(k).unwrap_or(f64::NAN)));
        }
        debug_assert_eq!(record.len() - start, self.record_length());
    }
}
