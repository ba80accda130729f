//! The numbers behind the page: runs and settled curves as NumPy archives and CSV, sweeps as NumPy archives, comparisons as CSV.

use std::fmt::Write as _;

use ndarray::Array1;
use ndarray_npy::NpzWriter;
use serde_json::{Map, Value as Json, json};

use super::text::{self, Compared};
use crate::analysis::paper::Case;
use crate::analysis::reproduction::{COLUMNS, Findings, Report, SweepData, Traced};
use crate::cli::Failure;
use crate::cli::output::significant;
use crate::cli::sweep::{Archive, Source, meta};
use crate::files::Folder;

/// Writes all data files into `folder`.
///
/// # Errors
/// The file system.
pub(super) fn write(folder: &Folder, report: &Report) -> Result<(), Failure> {
    let put = |name: String, content: &[u8]| -> Result<(), Failure> {
        Ok(folder.write(&format!("data/{name}"), content)?)
    };
    let put_run = |run: &Traced| {
        put(format!("{}.csv", run.name), samples(run).as_bytes())?;
        put(format!("{}.npz", run.name), &rows(run, report)?)
    };
    let put_sweep = |data: &SweepData| {
        archive(folder, data)?;
        put(format!("{}.csv", data.file_name()), points(data).as_bytes())
    };
    put_run(&report.corrected.ideal)?;
    for found in [&report.corrected, &report.printed] {
        let prefix = found.variant.prefix;
        put(format!("{prefix}numbers.csv"), numbers(found).as_bytes())?;
        put(
            format!("{prefix}statements.csv"),
            statements(found).as_bytes(),
        )?;
        put(
            format!("{prefix}settled_curves.csv"),
            curves(found).as_bytes(),
        )?;
        for run in found.runs.iter().chain([&found.lagrange]) {
            put_run(run)?;
        }
        found.sweeps.iter().try_for_each(put_sweep)?;
    }
    for combination in &report.combinations {
        combination.runs.iter().try_for_each(put_run)?;
        put_sweep(&combination.sections)?;
    }
    Ok(())
}

/// A field of a CSV file.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

fn numbers(found: &Findings) -> String {
    let mut out = String::from(
        "figure,clearance_mm,friction,quantity,unit,paper,full,sampled,ratio,sampled_ratio,agreement\n",
    );
    for Compared {
        figure,
        case,
        what,
        unit,
        paper,
        full,
        sampled,
        agreement,
    } in text::compared(found)
    {
        let optional = |v: Option<f64>| v.map_or_else(String::new, |v| significant(v, 12));
        let Case {
            clearance,
            friction,
        } = case;
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "{figure},{clearance},{friction},{},{unit},{},{},{},{},{},{agreement}",
            quoted(&what),
            significant(paper, 12),
            significant(full, 12),
            optional(sampled),
            significant(full / paper, 12),
            optional(sampled.map(|s| s / paper)),
        );
    }
    out
}

fn statements(found: &Findings) -> String {
    let mut out = String::from("place,statement,criterion,verdict,evidence\n");
    for s in found.statements() {
        let fields = [
            &s.place[..],
            &s.says,
            &s.criterion,
            text::verdict(s.verdict),
            &s.evidence,
        ];
        let _ = writeln!(out, "{}", fields.map(quoted).join(","));
    }
    out
}

/// A run at the paper's output step.
fn samples(run: &Traced) -> String {
    let last = COLUMNS.len() - 1;
    let mut out = COLUMNS[..last].join(",");
    out.push('\n');
    for row in run.rows.iter().filter(|row| row[last] == 1.0) {
        let cells: Vec<String> = row[..last].iter().map(|v| cell(*v)).collect();
        out.push_str(&cells.join(","));
        out.push('\n');
    }
    out
}

/// Empty where there is no value.
fn cell(value: f64) -> String {
    if value.is_nan() {
        String::new()
    } else {
        significant(value, 12)
    }
}

/// A run at every instant that was looked at.
fn rows(run: &Traced, report: &Report) -> Result<Vec<u8>, Failure> {
    let mut meta = super::meta(report);
    meta.insert("run".into(), json!(run.name));
    meta.insert("clearance_mm".into(), json!(run.case.clearance));
    meta.insert("friction".into(), json!(run.case.friction));
    let failed =
        |e: ndarray_npy::WriteNpzError| Failure::io(format!("cannot write {}: {e}", run.name));
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut archive = NpzWriter::new(&mut bytes);
    for (k, name) in COLUMNS.into_iter().enumerate() {
        let column: Array1<f64> = run.rows.iter().map(|row| row[k]).collect();
        archive.add_array(name, &column).map_err(failed)?;
    }
    let meta = Array1::from(Json::Object(meta).to_string().into_bytes());
    archive.add_array("meta", &meta).map_err(failed)?;
    archive.finish().map_err(failed)?;
    Ok(bytes.into_inner())
}

fn curves(found: &Findings) -> String {
    let mut out = String::from("clearance_mm,friction,phase,x_m,vx_m_s,beta_rad,beta_rate_rad_s\n");
    for curve in &found.curves {
        let Case {
            clearance,
            friction,
        } = curve.case;
        let count = curve.coordinates[0].len();
        for k in 0..count {
            let phase = k as f64 / (count - 1).max(1) as f64;
            let values = [
                phase,
                curve.coordinates[0][k],
                curve.rates[0][k],
                curve.coordinates[1][k],
                curve.rates[1][k],
            ];
            let values = values.map(|v| significant(v, 12)).join(",");
            let _ = writeln!(out, "{clearance},{friction},{values}");
        }
    }
    out
}

/// One row a point of a sweep, without its sections.
fn points(data: &SweepData) -> String {
    let layout = data.sweep.layout();
    let grid = data.sweep.grid();
    let single: Vec<_> = layout.columns().iter().filter(|c| !c.per_section).collect();
    let axes = grid.axes().iter().map(|a| a.key().to_owned());
    let mut names: Vec<String> = axes.collect();
    names.extend(single.iter().map(|c| c.name.clone()));
    let columns: Vec<Vec<f64>> = single.iter().map(|c| data.values(&c.name)).collect();
    let mut out = names.join(",");
    out.push('\n');
    for point in 0..grid.points() {
        let indices = grid.indices(point).into_iter();
        let at = grid
            .axes()
            .iter()
            .zip(indices)
            .map(|(a, i)| significant(a.value(i), 12));
        let mut cells: Vec<String> = at.collect();
        cells.extend(columns.iter().map(|column| cell(column[point])));
        out.push_str(&cells.join(","));
        out.push('\n');
    }
    out
}

/// Records in memory.
struct Records<'a> {
    records: &'a [f64],
    length: usize,
}

impl Source for Records<'_> {
    fn gather(&mut self, offset: usize, length: usize, out: &mut [f64]) -> Result<(), Failure> {
        let records = self.records.chunks_exact(self.length);
        for (record, out) in records.zip(out.chunks_exact_mut(length)) {
            out.copy_from_slice(&record[offset..offset + length]);
        }
        Ok(())
    }
}

/// A sweep in the form that `sweep` writes.
fn archive(folder: &Folder, data: &SweepData) -> Result<(), Failure> {
    let meta: Map<String, Json> = meta(&data.sweep);
    let mut source = Records {
        records: &data.records,
        length: data.sweep.layout().record_length(),
    };
    let target = folder.file(&format!("data/{}.npz", data.file_name()))?;
    Archive::of_sweep(meta, &data.sweep, None).write(target, &mut source)
}
