//! The numbers behind the page: runs and settled curves as NumPy archives and CSV, sweeps as NumPy archives, comparisons as CSV.

use ndarray::Array1;
use ndarray_npy::NpzWriter;
use serde_json::{Map, Value as Json, json};

use super::statements::words;
use super::text;
use crate::analysis::paper::Published;
use crate::analysis::reproduction::{COLUMNS, Column, Findings, RecordedRun, Report, SweepData};
use crate::cli::Failure;
use crate::cli::sweep::{Archive, Source, meta};
use crate::cli::tables::{csv, number};
use crate::files::Folder;

/// Writes all data files into `folder`.
///
/// # Errors
/// The file system.
pub(super) fn write(folder: &Folder, report: &Report) -> Result<(), Failure> {
    let put =
        |name: String, content: &[u8]| -> Result<(), Failure> { Ok(folder.write(&format!("data/{name}"), content)?) };
    let put_run = |run: &RecordedRun| {
        put(format!("{}.csv", run.name), samples(run).as_bytes())?;
        put(format!("{}.npz", run.name), &rows(run, report)?)
    };
    let put_sweep = |data: &SweepData| {
        archive(folder, data)?;
        put(format!("{}.csv", data.file_name()), points(data).as_bytes())
    };
    put_run(&report.corrected.ideal)?;
    for found in [&report.corrected, &report.printed] {
        let prefix = &found.variant.prefix;
        put(format!("{prefix}numbers.csv"), numbers(found).as_bytes())?;
        put(format!("{prefix}statements.csv"), verdicts(found).as_bytes())?;
        put(format!("{prefix}settled_curves.csv"), curves(found).as_bytes())?;
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

fn numbers(found: &Findings) -> String {
    csv(
        "figure,clearance_mm,friction,quantity,unit,paper,full,sampled,ratio,sampled_ratio,agreement",
        found.comparisons().iter().map(|c| {
            let Published { figure, case, quantity, value } = c.published;
            vec![
                figure.clone(),
                case.clearance.to_string(),
                case.friction.to_string(),
                quantity.to_string(),
                quantity.unit().to_owned(),
                number(*value),
                number(c.full),
                number(c.sampled),
                number(c.ratio()),
                number(c.sampled_ratio()),
                c.agreement().to_string(),
            ]
        }),
    )
}

fn verdicts(found: &Findings) -> String {
    csv(
        "place,statement,criterion,verdict,evidence",
        found.statements().iter().map(|s| {
            let (criterion, evidence) = words(s);
            vec![
                s.claim.place.clone(),
                s.claim.says.clone(),
                criterion,
                text::verdict(s.confirmed).to_owned(),
                evidence,
            ]
        }),
    )
}

/// A run at the paper's output step, which the last column marks.
fn samples(run: &RecordedRun) -> String {
    let columns = COLUMNS.len() - 1;
    let names = COLUMNS.map(|c| c.name);
    let rows = run.samples().into_iter();
    csv(&names[..columns].join(","), rows.map(|row| row[..columns].iter().map(|v| number(*v)).collect()))
}

/// A run at every examined instant.
fn rows(run: &RecordedRun, report: &Report) -> Result<Vec<u8>, Failure> {
    let mut meta = super::meta(report);
    meta.insert("run".into(), json!(run.name));
    meta.insert("clearance_mm".into(), json!(run.case.clearance));
    meta.insert("friction".into(), json!(run.case.friction));
    let failed = |e: ndarray_npy::WriteNpzError| Failure::io(format!("cannot write {}: {e}", run.name));
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut archive = NpzWriter::new(&mut bytes);
    for (k, Column { name, .. }) in COLUMNS.into_iter().enumerate() {
        let column: Array1<f64> = run.rows.iter().map(|row| row[k]).collect();
        archive.add_array(name, &column).map_err(failed)?;
    }
    let meta = Array1::from(Json::Object(meta).to_string().into_bytes());
    archive.add_array("meta", &meta).map_err(failed)?;
    archive.finish().map_err(failed)?;
    Ok(bytes.into_inner())
}

fn curves(found: &Findings) -> String {
    let rows = found.curves.iter().flat_map(|curve| {
        let last = curve.coordinates[0].len() - 1;
        (0..=last).map(move |k| {
            let mut row = vec![
                curve.case.clearance.to_string(),
                curve.case.friction.to_string(),
                number(k as f64 / last.max(1) as f64),
            ];
            for (values, rates) in curve.coordinates.iter().zip(&curve.rates) {
                row.extend([number(values[k]), number(rates[k])]);
            }
            row
        })
    });
    csv("clearance_mm,friction,phase,x_m,vx_m_s,beta_rad,beta_rate_rad_s", rows)
}

/// One row per point of a sweep, without its sections.
fn points(data: &SweepData) -> String {
    let (layout, grid) = (data.sweep.layout(), data.sweep.grid());
    let single = layout.columns().iter().filter(|c| !c.per_section);
    let axes = grid.axes().iter().map(|a| a.key());
    let names: Vec<&str> = axes.chain(single.clone().map(|c| &c.name[..])).collect();
    let columns: Vec<Vec<f64>> = single.map(|c| data.values(&c.name)).collect();
    let row = |point: usize| {
        let at = grid.axes().iter().zip(grid.indices(point));
        let at = at.map(|(axis, index)| axis.value(index));
        let values = columns.iter().map(|column| column[point]);
        at.chain(values).map(number).collect()
    };
    csv(&names.join(","), (0..grid.points()).map(row))
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

/// A sweep in the format that `sweep` writes.
fn archive(folder: &Folder, data: &SweepData) -> Result<(), Failure> {
    let meta: Map<String, Json> = meta(&data.sweep);
    let mut source = Records { records: &data.records, length: data.sweep.layout().record_length() };
    let target = folder.file(&format!("data/{}.npz", data.file_name()))?;
    Archive::of_sweep(meta, &data.sweep, None).write(target, &mut source)
}
