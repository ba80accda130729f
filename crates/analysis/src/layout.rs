//! Columns of a sweep's result, and the order of values in its records, which have a fixed length per point.

use super::drive::OBSERVABLES;
use super::exponent::Exponent;
use super::point::{JointResult, PointResult, Protocol};
use jointplay_scene::Scene;
use serde::Serialize;

/// How a point ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// All periods were completed.
    Done = 0,
    /// The divergence guard stopped the run.
    Diverged = 1,
    /// The scene did not start.
    NoStart = 2,
}

impl Status {
    /// Status code in files.
    pub fn code(self) -> i64 {
        self as i64
    }
}

/// One array of the result.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ResultArray {
    /// Name, with the unit.
    pub name: String,
    /// Whether the values are whole numbers.
    pub whole: bool,
    /// Whether a point has one value per kept section instead of a single one.
    pub per_section: bool,
}

/// All arrays of a sweep's result.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    columns: Vec<ResultArray>,
    /// Joints with play whose quantities are recorded.
    joints: Vec<String>,
    probe: bool,
    /// Number of statistics of channels.
    statistics: usize,
    /// Whether there are sections.
    has_sections: bool,
    /// Whether the sections are crossings of a channel.
    at_crossings: bool,
    kept: usize,
}

/// An array with one value per point: name, whether it holds integers, and accessor of the value.
type PointColumn = (&'static str, bool, fn(&PointResult, Status) -> f64);

/// Rows of [`POINT`] that exist only with sections.
const SECTION_ROWS: std::ops::Range<usize> = 2..10;

static POINT: [PointColumn; 12] = [
    ("status", true, |_, status| status.code() as f64),
    ("stopped_at_s", false, |r, _| r.stopped.unwrap_or(f64::NAN)),
    // A point that did not reach its end has no regime, which is code -1.
    ("regime", true, |r, status| match status {
        Status::Done => r.regime.code() as f64,
        Status::Diverged | Status::NoStart => -1.0,
    }),
    ("period", true, |r, _| r.regime.period() as f64),
    ("return_distance", false, |r, status| if_done(status, r.evidence.return_distance)),
    ("distinct_sections", true, |r, _| r.evidence.distinct as f64),
    ("zero_one", false, |r, _| r.evidence.zero_one),
    ("exponent_per_s", false, |r, _| exponent(r, |e| e.value)),
    ("exponent_standard_error_per_s", false, |r, _| exponent(r, |e| e.standard_error)),
    ("exponent_bound_per_s", false, |r, status| if_done(status, r.evidence.exponent_bound)),
    ("doubts", true, |r, _| f64::from(r.doubts)),
    ("energy_residual", false, |r, _| r.residual),
];

/// As [`PointColumn`], per joint with play; the joint's name is prefixed.
type JointColumn = (&'static str, bool, fn(&JointResult) -> f64);

const JOINT: [JointColumn; 6] = [
    ("peak_N", false, |joint| joint.peak),
    ("peak_kept_N", false, |joint| joint.peak_kept),
    ("mean_N", false, |joint| joint.mean),
    ("impacts", true, |joint| joint.impacts as f64),
    ("impacts_kept", true, |joint| joint.impacts_kept as f64),
    ("last_separation_s", false, |joint| joint.last_separation.unwrap_or(f64::NAN)),
];

/// A value that is defined only for points that reached their end.
fn if_done(status: Status, value: f64) -> f64 {
    if status == Status::Done { value } else { f64::NAN }
}

fn exponent(result: &PointResult, value: fn(&Exponent) -> f64) -> f64 {
    result.evidence.exponent.as_ref().map_or(f64::NAN, value)
}

impl Layout {
    /// The arrays of a sweep of `scene`.
    pub fn new(scene: &Scene, protocol: &Protocol) -> Self {
        let mut columns = Vec::new();
        let mut add = |name: &str, whole: bool, per_section: bool| {
            columns.push(ResultArray { name: name.to_owned(), whole, per_section });
        };
        let has_sections = protocol.sections().is_some();
        let at_crossings = has_sections && protocol.plan().is_none();
        for (name, whole, _) in point_columns(has_sections) {
            add(name, *whole, false);
        }
        let by_default = protocol.keep.is_empty() || protocol.joints;
        let joints = scene.machine.loose_joints.iter().filter(|_| by_default);
        let joints: Vec<String> = joints.map(|joint| joint.name.clone()).collect();
        for joint in &joints {
            for (quantity, whole, _) in JOINT {
                add(&format!("{joint}_{quantity}"), whole, false);
            }
        }
        let probe = scene.machine.output.probe.is_some() && by_default;
        if probe {
            add("probe_error_max_um", false, false);
            add("probe_error_rms_um", false, false);
        }
        protocol.keep.iter().for_each(|statistic| add(statistic.column(), false, false));
        if at_crossings {
            add("crossings", true, false);
            add("section_time_s", false, true);
        } else if has_sections {
            add("exponent_running_per_s", false, true);
        }
        if has_sections {
            for observable in OBSERVABLES {
                add(&format!("section_{observable}"), false, true);
            }
        }
        Self {
            columns,
            joints,
            probe,
            statistics: protocol.keep.len(),
            has_sections,
            at_crossings,
            kept: protocol.kept(),
        }
    }

    /// Arrays in order.
    pub fn columns(&self) -> &[ResultArray] {
        &self.columns
    }

    /// Kept sections per point.
    pub fn kept(&self) -> usize {
        self.kept
    }

    /// Number of values per point in `column`.
    pub fn values_in(&self, column: &ResultArray) -> usize {
        if column.per_section { self.kept } else { 1 }
    }

    /// Number of values in a record.
    pub fn record_length(&self) -> usize {
        self.columns.iter().map(|c| self.values_in(c)).sum()
    }

    /// Offset of array `column` in a record.
    pub fn offset(&self, column: usize) -> usize {
        self.columns[..column].iter().map(|c| self.values_in(c)).sum()
    }

    /// Appends the record of a point; `None` stands for a point that could not start.
    pub fn append(&self, result: Option<&PointResult>, record: &mut Vec<f64>) {
        let unknown;
        let (status, result) = match result {
            Some(result) if result.stopped.is_some() => (Status::Diverged, result),
            Some(result) => (Status::Done, result),
            None => {
                unknown = PointResult::unknown();
                (Status::NoStart, &unknown)
            }
        };
        let start = record.len();
        record.extend(point_columns(self.has_sections).map(|(.., value)| value(result, status)));
        for name in &self.joints {
            // A point can lack a joint of the scene, such as the last joint of a chain with fewer links.
            let joint = result.joints.iter().find(|joint| joint.name == *name);
            let unknown = JointResult { peak: f64::NAN, peak_kept: f64::NAN, mean: f64::NAN, ..JointResult::default() };
            record.extend(JOINT.iter().map(|(.., value)| value(joint.unwrap_or(&unknown))));
        }
        if self.probe {
            let (largest, rms) = result.probe.unwrap_or((f64::NAN, f64::NAN));
            record.extend([largest * 1e6, rms * 1e6]);
        }
        record.extend((0..self.statistics).map(|i| result.statistics.get(i).copied().unwrap_or(f64::NAN)));
        if self.at_crossings {
            record.push(result.crossings as f64);
        }
        let mut per_section = |values: &[f64]| {
            record.extend((0..self.kept).map(|k| values.get(k).copied().unwrap_or(f64::NAN)));
        };
        if self.at_crossings {
            per_section(&result.times);
        } else if self.has_sections {
            per_section(result.evidence.exponent.as_ref().map_or(&[][..], |e| &e.running));
        }
        if self.has_sections {
            let width = OBSERVABLES.len();
            for i in 0..width {
                let value = |k: usize| result.sections.get(k * width + i).copied();
                record.extend((0..self.kept).map(|k| value(k).unwrap_or(f64::NAN)));
            }
        }
        debug_assert_eq!(record.len() - start, self.record_length());
    }
}

/// The rows of [`POINT`], with or without those for sections.
fn point_columns(has_sections: bool) -> impl Iterator<Item = &'static PointColumn> {
    let rows = POINT.iter().enumerate();
    rows.filter(move |(i, _)| has_sections || !SECTION_ROWS.contains(i)).map(|(_, row)| row)
}
