//! What a run and a sweep of the report leave behind.

use super::{PICKED, Variant};
use crate::analysis::paper::Case;
use crate::analysis::paper::chaos::Swept;
use crate::analysis::regime::Regime;
use crate::analysis::response::{Look, Response};
use crate::analysis::sweep::Sweep;

/// Columns of a [`Row`].
pub const COLUMNS: [&str; 15] = [
    "t_s",
    "x_m",
    "vx_m_s",
    "ax_m_s2",
    "beta_rad",
    "beta_rate_rad_s",
    "beta_accel_rad_s2",
    "S1_normal_N",
    "S2_normal_N",
    "S3_normal_N",
    "x_deviation_m",
    "beta_deviation_rad",
    "probe_error_m",
    "constraint_drift",
    "sample",
];

/// One instant of a run, in the order of [`COLUMNS`]; `sample` is 1 at whole multiples of the paper's output step.
pub type Row = [f64; COLUMNS.len()];

pub(super) fn row(look: &Look) -> Row {
    let [c, r, a] = look.derivatives();
    let deviation = look.deviation();
    let force = |j: usize| {
        look.frame
            .joints
            .get(j)
            .map_or(f64::NAN, |j| j.normal_force.norm())
    };
    let (x, beta) = (PICKED[0], PICKED[1]);
    [
        look.time,
        c[x],
        r[x],
        a[x],
        c[beta],
        r[beta],
        a[beta],
        force(0),
        force(1),
        force(2),
        deviation[x],
        deviation[beta],
        look.frame.probe_error.map_or(f64::NAN, |e| e.norm()),
        look.constraint_drift,
        f64::from(u8::from(look.sample)),
    ]
}

/// A run of section 4.2 with everything that its figures show.
#[derive(Clone, Debug)]
pub struct Traced {
    /// Name in files.
    pub name: String,
    /// Clearance and friction.
    pub case: Case,
    /// Peaks and separations.
    pub response: Response,
    /// All instants, in order of time.
    pub rows: Vec<Row>,
}

/// A sweep with the records of all its points.
#[derive(Clone, Debug)]
pub struct SweepData {
    /// The model.
    pub variant: Variant,
    /// What it is in words of a file's name.
    pub name: &'static str,
    /// What was swept.
    pub sweep: Sweep,
    /// A record a point, one after the other; empty until its blocks are put in.
    pub records: Vec<f64>,
}

impl SweepData {
    /// Name in files.
    pub fn file_name(&self) -> String {
        format!("{}{}", self.variant.prefix, self.name)
    }

    /// Values of the array called `name`, those of a point together; empty if there is none.
    pub fn values(&self, name: &str) -> Vec<f64> {
        let layout = self.sweep.layout();
        let Some(at) = layout.columns().iter().position(|c| c.name == name) else {
            return Vec::new();
        };
        let (offset, length) = (layout.offset(at), layout.values_in(&layout.columns()[at]));
        let records = self.records.chunks_exact(layout.record_length());
        records
            .flat_map(|r| r[offset..offset + length].to_vec())
            .collect()
    }

    /// The points along its last axis, whose values are multiplied by `factor`.
    pub fn swept(&self, factor: f64) -> Vec<Swept> {
        let Some(axis) = self.sweep.grid().axes().last() else {
            return Vec::new();
        };
        let kept = self.sweep.layout().kept();
        let column = |name: &str| self.values(name);
        let (regimes, periods) = (column("regime"), column("period"));
        let exponents = column("exponent_per_s");
        let errors = column("exponent_standard_error_per_s");
        let (x, beta) = (column("section_x_m"), column("section_beta_rad"));
        let part = |all: &[f64], k: usize| all[k * kept..(k + 1) * kept].to_vec();
        axis.values()
            .enumerate()
            .map(|(k, value)| Swept {
                value: value * factor,
                regime: regime_word(regimes[k] as i64),
                period: periods[k] as usize,
                exponent: (exponents[k], errors[k]),
                sections: [part(&x, k), part(&beta, k)],
            })
            .collect()
    }
}

/// The word of a regime's number in files.
pub fn regime_word(code: i64) -> &'static str {
    let all = [
        Regime::Unclear,
        Regime::Periodic(1),
        Regime::QuasiPeriodic,
        Regime::Chaotic,
        Regime::NotSettled,
    ];
    all.into_iter()
        .find(|r| r.code() == code)
        .map_or("none", Regime::word)
}
