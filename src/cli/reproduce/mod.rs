//! `reproduce`: the paper's whole section 4 in one go, as data, plots and one page that compares it with the paper.

mod compute;
mod data;
mod figures;
mod page;
mod results;

use std::path::Path;
use std::time::Instant;

use serde_json::{Map, Value as Json, json};

use self::compute::FinishedBlocks;
use super::args::ReproduceArguments;
use super::tables::lines;
use super::{Failure, interrupt, print, progress, threads, warn};
use crate::analysis::reproduction::{Agenda, Extent, Report};
use crate::files::Folder;

/// Runs `reproduce`.
///
/// # Errors
/// A folder that cannot be written, before anything is computed; Ctrl-C, the file system.
pub fn reproduce(arguments: &ReproduceArguments) -> Result<(), Failure> {
    // From here on there is a temporary folder, which an interrupted run removes.
    interrupt::listen();
    let started = Instant::now();
    let folder = Folder::claim(&arguments.out, arguments.force)?;
    let report = make(folder, arguments)?;
    print(&summary(&report, &arguments.out, started.elapsed().as_secs_f64()))
}

/// Computes a report into `folder`.
fn make(folder: Folder, arguments: &ReproduceArguments) -> Result<Report, Failure> {
    let extent = if arguments.quick { Extent::QUICK } else { Extent::FULL };
    let work = Agenda::new(extent);
    let mut finished = FinishedBlocks::open(&arguments.out, &work)?;
    if let Some(folder) = finished.resumed_folder().filter(|_| !arguments.quiet) {
        warn(&format!("resuming where {} stopped", folder.display()));
    }
    let length = (0..work.jobs()).map(|job| work.length(job)).sum::<f64>();
    let bar = progress::bar(!arguments.quiet, length.ceil() as u64);
    let report = compute::compute(work, &mut finished, threads(arguments.threads), &bar);
    bar.finish_and_clear();
    let report = report?;
    fill(&folder, &report, &finished)?;
    folder.finish(meta(&report))?;
    finished.remove();
    Ok(report)
}

/// Writes all files into `folder`.
fn fill(folder: &Folder, report: &Report, finished: &FinishedBlocks) -> Result<(), Failure> {
    data::write(folder, report)?;
    let mut pictures = page::Pictures::new();
    for (name, sheet) in report.complete().into_iter().flat_map(figures::all) {
        if interrupt::is_requested() {
            return Err(finished.interrupted());
        }
        let drawing = |error: crate::chart::SheetError| Failure::io(format!("{name}: {error}"));
        let svg = sheet.svg().map_err(drawing)?;
        folder.write(&format!("plots/{name}.svg"), svg.as_bytes())?;
        folder.write(&format!("plots/{name}.png"), &sheet.png(1.5).map_err(drawing)?)?;
        pictures.insert(name, svg);
    }
    Ok(folder.write("index.html", page::page(report, &pictures).as_bytes())?)
}

/// Provenance of the report.
fn meta(report: &Report) -> Map<String, Json> {
    let mut meta = super::provenance::meta(report.models[0].sweeps[0].sweep.scene());
    let quick = if report.extent == Extent::FULL { "" } else { " --quick" };
    meta.insert("command".into(), json!(format!("jointplay reproduce --out report/{quick}")));
    meta.insert("simulated_s".into(), json!(report.simulated()));
    meta
}

/// The results in a few lines.
fn summary(report: &Report, out: &Path, wall: f64) -> String {
    let [[agree, near, differ, confirmed, stated], printed] = report.complete().map(results::score);
    let numbers = |agree, near, differ| {
        let all = agree + near + differ;
        format!("{agree} of {all} agree within 10 %, {near} more within a factor of 2, {differ} differ")
    };
    lines([
        ("Numbers", numbers(agree, near, differ)),
        ("Statements", format!("{confirmed} of {stated} confirmed")),
        (
            "(13) as printed",
            format!("{}; {} statements confirmed", numbers(printed[0], printed[1], printed[2]), printed[3]),
        ),
        ("Simulated", format!("{:.0} s", report.simulated())),
        ("Wall time", format!("{wall:.1} s")),
        ("Written", out.join("index.html").display().to_string()),
        ("Version", format!("jointplay {}", crate::VERSION)),
    ])
}
