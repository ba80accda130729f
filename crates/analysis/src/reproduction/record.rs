//! Records of the runs, settled curves and sweeps of a report.

use crate::paper::{Case, Coordinate, Variant};
use crate::point::Plan;
use crate::regime::Regime;
use crate::response::{Observation, Response};
use crate::sweep::Sweep;

/// A column of a [`RecordedRow`].
#[derive(Clone, Copy)]
pub struct Column {
    /// Name in files.
    pub name: &'static str,
    /// Label in plots.
    pub label: &'static str,
    /// Unit in plots.
    pub unit: &'static str,
    /// Size of the plot unit in SI units.
    pub one: f64,
    /// Accessor of the value at an instant.
    pub(super) value: fn(&Observation) -> f64,
}

const fn column(
    name: &'static str,
    label: &'static str,
    unit: &'static str,
    one: f64,
    value: fn(&Observation) -> f64,
) -> Column {
    Column { name, label, unit, one, value }
}

const X: usize = Coordinate::X.index();
const BETA: usize = Coordinate::Beta.index();

/// Columns of a [`RecordedRow`]; each coordinate is followed by its derivatives.
pub const COLUMNS: [Column; 15] = [
    column("t_s", "time", "s", 1.0, |o| o.time),
    column("x_m", "x", "mm", 1e-3, |o| o.derivatives()[0][X]),
    column("vx_m_s", "velocity in x", "m/s", 1.0, |o| o.derivatives()[1][X]),
    column("ax_m_s2", "acceleration in x", "m/s²", 1.0, |o| o.derivatives()[2][X]),
    column("beta_rad", "beta", "mrad", 1e-3, |o| o.derivatives()[0][BETA]),
    column("beta_rate_rad_s", "rate of beta", "rad/s", 1.0, |o| o.derivatives()[1][BETA]),
    column("beta_accel_rad_s2", "acceleration of beta", "rad/s²", 1.0, |o| o.derivatives()[2][BETA]),
    column("S1_normal_N", "contact force", "N", 1.0, |o| normal_force(o, 0)),
    column("S2_normal_N", "contact force", "N", 1.0, |o| normal_force(o, 1)),
    column("S3_normal_N", "contact force", "N", 1.0, |o| normal_force(o, 2)),
    column("x_deviation_m", "x less ideal", "mm", 1e-3, |o| o.deviation()[X]),
    column("beta_deviation_rad", "beta less ideal", "mrad", 1e-3, |o| o.deviation()[BETA]),
    column("probe_error_m", "tip error", "µm", 1e-6, |o| o.frame.probe_error.map_or(f64::NAN, |e| e.norm())),
    column("constraint_drift", "largest violation so far", "", 1.0, |o| o.constraint_drift),
    column("sample", "at the paper's output step", "", 1.0, |o| f64::from(u8::from(o.sample))),
];

fn normal_force(o: &Observation, joint: usize) -> f64 {
    o.frame.joints.get(joint).map_or(f64::NAN, |joint| joint.normal_force.norm())
}

/// Index of the column called `name`.
///
/// # Panics
/// If there is no such column.
pub fn column_of(name: &str) -> usize {
    let index = COLUMNS.iter().position(|c| c.name == name);
    index.unwrap_or_else(|| panic!("no column {name}"))
}

/// Index of the column of a coordinate or of its `nth` derivative.
pub fn derivative(coordinate: Coordinate, nth: usize) -> usize {
    1 + 3 * coordinate as usize + nth
}

/// One instant of a run, in the order of [`COLUMNS`]; the last value is 1 at whole multiples of the paper's output step.
pub type RecordedRow = [f64; COLUMNS.len()];

/// A run of section 4.2 with all data of its figures.
#[derive(Clone, Debug)]
pub struct RecordedRun {
    /// Name in files.
    pub name: String,
    /// Clearance and friction.
    pub case: Case,
    /// Peaks and last separations.
    pub response: Response,
    /// All instants, in order of time.
    pub rows: Vec<RecordedRow>,
    /// Settled motion, if recorded.
    pub settled: Option<SettledCurve>,
}

impl RecordedRun {
    /// The instants at the paper's output step.
    pub fn samples(&self) -> Vec<&RecordedRow> {
        let last = COLUMNS.len() - 1;
        self.rows.iter().filter(|row| row[last] == 1.0).collect()
    }

    /// A column in its plot unit against time.
    pub fn curve(&self, column: usize) -> impl Iterator<Item = (f64, f64)> {
        let one = COLUMNS[column].one;
        self.rows.iter().map(move |row| (row[0], row[column] / one))
    }
}

/// Settled motion of one of the paper's runs over one period.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SettledCurve {
    /// x (m) and beta (rad) at equal drive phases, the same for every run.
    pub coordinates: [Vec<f64>; 2],
    /// Rates of x and beta, m/s and rad/s.
    pub rates: [Vec<f64>; 2],
    /// Width of the closed curve: largest difference of x and of beta between this period and the previous one at equal phases.
    pub width: [f64; 2],
}

/// Settled motion at one value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct SettledPoint {
    /// Value of the parameter: clearance in mm, or friction coefficient.
    pub value: f64,
    /// Regime; `None` if the point did not reach its end.
    pub regime: Option<Regime>,
    /// Largest Lyapunov exponent and its standard error, 1/s; NaN if not measured.
    pub exponent: (f64, f64),
    /// Kept sections in x (m) and beta (rad), in order of time.
    pub sections: [Vec<f64>; 2],
}

impl SettledPoint {
    /// Latest section in a coordinate.
    pub fn latest(&self, coordinate: Coordinate) -> f64 {
        let last = self.sections[coordinate as usize].last();
        last.copied().unwrap_or(f64::NAN)
    }

    /// Range of a coordinate over the second half of the sections.
    pub fn spread(&self, coordinate: Coordinate) -> f64 {
        let all = &self.sections[coordinate as usize];
        extent(all[all.len() / 2..].iter().copied())
    }

    /// Regime and period in words.
    pub fn regime_word(&self) -> String {
        self.regime.map_or_else(|| NO_REGIME.to_owned(), |regime| regime.to_string())
    }

    /// Number of drive periods after which the motion repeats; 0 if it does not.
    pub fn period(&self) -> usize {
        self.regime.map_or(0, Regime::period)
    }
}

/// Minimum and maximum.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
}

/// Maximum minus minimum.
pub(super) fn extent(values: impl IntoIterator<Item = f64>) -> f64 {
    let (least, most) = range(values.into_iter());
    most - least
}

/// Smallest and largest measured exponent, 1/s.
pub fn exponents(points: &[SettledPoint]) -> (f64, f64) {
    let measured = points.iter().map(|p| p.exponent.0);
    range(measured.filter(|e| e.is_finite()))
}

/// Name of the regime of a motion that did not reach its end.
pub const NO_REGIME: &str = "none";

/// Number of points of each regime and period, in order of first occurrence.
pub fn regime_counts(points: &[SettledPoint]) -> Vec<(String, usize)> {
    let mut counts: Vec<(String, usize)> = Vec::new();
    for point in points {
        let word = point.regime_word();
        match counts.iter_mut().find(|(counted, _)| *counted == word) {
            Some((_, count)) => *count += 1,
            None => counts.push((word, 1)),
        }
    }
    counts
}

/// A sweep with the records of all its points.
#[derive(Clone, Debug)]
pub struct SweepData {
    /// Variant of the model.
    pub variant: &'static Variant,
    /// Name used in file names.
    pub name: &'static str,
    /// Periods of each point.
    pub plan: Plan,
    /// The sweep.
    pub sweep: Sweep,
    /// One record per point, concatenated; empty until its blocks are added.
    pub records: Vec<f64>,
    /// Points along the axis; empty for a map, and before there are records.
    pub points: Vec<SettledPoint>,
}

impl SweepData {
    /// Name in files.
    pub fn file_name(&self) -> String {
        format!("{}{}", self.variant.prefix, self.name)
    }

    /// Values of the array called `name`, grouped by point; empty if there is none.
    pub fn values(&self, name: &str) -> Vec<f64> {
        let layout = self.sweep.layout();
        let Some(column) = layout.columns().iter().position(|c| c.name == name) else {
            return Vec::new();
        };
        let (offset, length) = (layout.offset(column), layout.values_in(&layout.columns()[column]));
        let records = self.records.chunks_exact(layout.record_length());
        records.flat_map(|r| r[offset..offset + length].to_vec()).collect()
    }

    /// Fills [`Self::points`] from the records.
    pub(super) fn read_points(&mut self) {
        let [axis] = self.sweep.design().axes() else {
            return;
        };
        // Clearances are in mm.
        let factor = if axis.key() == "contact.clearance" { 1e3 } else { 1.0 };
        let kept = self.sweep.layout().kept();
        let column = |name: &str| self.values(name);
        let (regimes, periods) = (column("regime"), column("period"));
        let exponents = column("exponent_per_s");
        let errors = column("exponent_standard_error_per_s");
        let (x, beta) = (column("section_x_m"), column("section_beta_rad"));
        let part = |all: &[f64], k: usize| all[k * kept..(k + 1) * kept].to_vec();
        let points = axis.numbers().enumerate().map(|(k, value)| SettledPoint {
            value: value * factor,
            regime: Regime::of_code(regimes[k] as i64, periods[k] as usize),
            exponent: (exponents[k], errors[k]),
            sections: [part(&x, k), part(&beta, k)],
        });
        self.points = points.collect();
    }
}
