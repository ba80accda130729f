//! The numbers behind the page: runs and settled curves as NumPy archives and CSV, sweeps as NumPy archives, comparisons as CSV.

use ndarray::Array1;
use ndarray_npy::NpzWriter;
use serde_json::{Value as Json, json};

use super::results;
use crate::analysis::paper::{Case, Comparison, Published};
use crate::analysis::reproduction::{COLUMNS, Findings, RecordedRun, Report, SettledCurve, SweepData};
use crate::cli::Failure;
use crate::cli::sweep::{Archive, Source, meta};
use crate::cli::tables::{Table, number};
use crate::files::Folder;

/// Writes all data files into `folder`.
///
/// # Errors
/// The file system.
pub(super) fn write(folder: &Folder, report: &Report) -> Result<(), Failure> {
    let write_data =
        |name: &str, content: &[u8]| -> Result<(), Failure> { Ok(folder.write(&format!("data/{name}"), content)?) };
    for findings in report.complete() {
        let statements = results::statements("place | statement | criterion | verdict | evidence", findings);
        let tables = [("numbers", numbers(findings)), ("statements", statements), ("settled_curves", curves(findings))];
        for (name, table) in tables {
            write_data(&format!("{}{name}.csv", findings.variant.prefix), table.csv().as_bytes())?;
        }
    }
    for findings in &report.models {
        for run in &findings.runs {
            write_run(run, report, &write_data)?;
        }
        for data in &findings.sweeps {
            write_data(&format!("{}.csv", data.file_name()), points(data).csv().as_bytes())?;
            // In the format that `sweep` writes.
            let target = folder.file(&format!("data/{}.npz", data.file_name()))?;
            Archive::of_sweep(meta(&data.sweep), &data.sweep, None).write(target, &mut &*data)?;
        }
    }
    write_run(&report.models[0].ideal, report, &write_data)
}

fn write_run(
    run: &RecordedRun,
    report: &Report,
    write_data: &impl Fn(&str, &[u8]) -> Result<(), Failure>,
) -> Result<(), Failure> {
    write_data(&format!("{}.csv", run.name), samples(run).csv().as_bytes())?;
    let bytes = archive(run, report).map_err(|e| Failure::io(format!("cannot write {}: {e}", run.name)))?;
    write_data(&format!("{}.npz", run.name), &bytes)
}

fn numbers(findings: &Findings) -> Table {
    let row = |c: &Comparison| {
        let Published { figure, case, quantity, value } = c.published;
        let mut row = vec![figure.clone(), case.clearance.to_string(), case.friction.to_string()];
        row.extend([quantity.to_string(), quantity.unit().to_owned()]);
        row.extend([Some(*value), Some(c.full), c.sampled, Some(c.ratio()), c.sampled_ratio()].map(number));
        row.push(c.agreement().to_string());
        row
    };
    let heads = "figure | clearance_mm | friction | quantity | unit | paper | full | sampled | ratio | sampled_ratio | agreement";
    Table::new(heads, findings.comparisons().iter().map(row))
}

/// A run at the paper's output step, without the last column, which marks these rows.
fn samples(run: &RecordedRun) -> Table {
    let columns = COLUMNS.len() - 1;
    let rows = run.samples().into_iter().map(|row| row[..columns].iter().map(|v| number(*v)).collect());
    Table::new(&COLUMNS.map(|c| c.name)[..columns].join(" | "), rows)
}

/// A run at every examined instant.
fn archive(run: &RecordedRun, report: &Report) -> Result<Vec<u8>, ndarray_npy::WriteNpzError> {
    let mut meta = super::meta(report);
    meta.insert("run".into(), json!(run.name));
    meta.insert("clearance_mm".into(), json!(run.case.clearance));
    meta.insert("friction".into(), json!(run.case.friction));
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut archive = NpzWriter::new(&mut bytes);
    for (k, column) in COLUMNS.iter().enumerate() {
        archive.add_array(column.name, &run.rows.iter().map(|row| row[k]).collect::<Array1<f64>>())?;
    }
    archive.add_array("meta", &Array1::from(Json::Object(meta).to_string().into_bytes()))?;
    archive.finish()?;
    Ok(bytes.into_inner())
}

fn curves(findings: &Findings) -> Table {
    let row = |case: Case, curve: &SettledCurve, k: usize| {
        let last = curve.coordinates[0].len() - 1;
        let mut row = vec![case.clearance.to_string(), case.friction.to_string()];
        row.push(number(k as f64 / last.max(1) as f64));
        for (values, rates) in curve.coordinates.iter().zip(&curve.rates) {
            row.extend([number(values[k]), number(rates[k])]);
        }
        row
    };
    let curves = findings.runs.iter().filter_map(|run| Some((run.case, run.settled.as_ref()?)));
    let rows = curves.flat_map(|(case, curve)| (0..curve.rates[0].len()).map(move |k| row(case, curve, k)));
    Table::new("clearance_mm | friction | phase | x_m | vx_m_s | beta_rad | beta_rate_rad_s", rows)
}

/// One row per point of a sweep, without its sections.
fn points(data: &SweepData) -> Table {
    let (layout, design) = (data.sweep.layout(), data.sweep.design());
    let single = layout.columns().iter().filter(|c| !c.per_section);
    let names: Vec<&str> = design.axes().iter().map(|a| a.key()).chain(single.clone().map(|c| &c.name[..])).collect();
    let columns: Vec<Vec<f64>> = single.map(|c| data.values(&c.name)).collect();
    let row = |point: usize| {
        let at = design.axes().iter().zip(design.indices(point)).map(|(axis, index)| axis.number(index));
        at.chain(columns.iter().map(|column| column[point])).map(number).collect()
    };
    Table::new(&names.join(" | "), (0..design.points()).map(row))
}

impl Source for &SweepData {
    fn gather(&mut self, offset: usize, length: usize, out: &mut [f64]) -> Result<(), Failure> {
        let records = self.records.chunks_exact(self.sweep.layout().record_length());
        for (record, out) in records.zip(out.chunks_exact_mut(length)) {
            out.copy_from_slice(&record[offset..offset + length]);
        }
        Ok(())
    }
}
