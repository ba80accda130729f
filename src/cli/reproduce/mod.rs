//! `reproduce`: the paper's whole section 4 in one go, as data, plots and one page that compares it with the paper.

mod compute;
mod data;
mod figures;
mod kept;
mod page;
mod scatter;
mod statements;
mod text;

use std::path::Path;
use std::time::Instant;

use serde_json::{Value as Json, json};

use self::kept::Kept;
use super::args::ReproduceArguments;
use super::{Failure, interrupt, print, progress, threads, warn};
use crate::analysis::paper::{Agreement, Series};
use crate::analysis::reproduction::{Agenda, Extent, Findings, Report, Statement};
use crate::files::Folder;

/// Runs `reproduce`.
///
/// # Errors
/// A folder that cannot be written, before anything is computed; Ctrl-C, the file system.
pub fn reproduce(arguments: &ReproduceArguments) -> Result<(), Failure> {
    // From here on there is a temporary folder, which an interrupted run removes.
    interrupt::listen();
    let extent = if arguments.quick { Extent::QUICK } else { Extent::FULL };
    let threads = threads(arguments.threads);
    let started = Instant::now();
    let folder = Folder::claim(&arguments.out, arguments.force)?;
    let report = make(folder, &arguments.out, extent, threads, arguments.quiet)?;
    let wall = started.elapsed().as_secs_f64();
    print(&summary(&report, &arguments.out, wall))
}

/// Computes a report into `folder`, which becomes `out`.
fn make(folder: Folder, out: &Path, extent: Extent, threads: usize, quiet: bool) -> Result<Report, Failure> {
    let work = Agenda::new(extent).map_err(|error| Failure::usage(error.to_string()))?;
    let mut kept = Kept::open(out, &work)?;
    if kept.is_begun() && !quiet {
        warn(&format!("resuming where {} stopped", kept.folder().display()));
    }
    let length = (0..work.jobs()).map(|job| work.length(job)).sum::<f64>();
    let bar = progress::bar(!quiet, length.ceil() as u64);
    let report = compute::compute(work, &mut kept, threads, &bar);
    bar.finish_and_clear();
    let report = report?;
    let manifest = fill(&folder, &report, &kept)?;
    folder.finish(manifest)?;
    kept.remove();
    Ok(report)
}

/// Writes all files into `folder`; returns their provenance.
fn fill(folder: &Folder, report: &Report, kept: &Kept) -> Result<serde_json::Map<String, Json>, Failure> {
    data::write(folder, report)?;
    let drawn = [&report.corrected, &report.printed].map(figures::all).concat();
    let mut pictures = page::Pictures::new();
    for (name, sheet) in drawn {
        if interrupt::asked() {
            return Err(interrupted(kept));
        }
        let drawing = |error: crate::chart::SheetError| Failure::io(format!("{name}: {error}"));
        let svg = sheet.svg().map_err(drawing)?;
        folder.write(&format!("plots/{name}.svg"), svg.as_bytes())?;
        let png = sheet.png(1.5).map_err(drawing)?;
        folder.write(&format!("plots/{name}.png"), &png)?;
        pictures.insert(name, svg);
    }
    let page = page::page(report, &pictures);
    folder.write("index.html", page.as_bytes())?;
    Ok(meta(report))
}

/// Provenance of the report.
fn meta(report: &Report) -> serde_json::Map<String, Json> {
    let scene = report.corrected.cold(Series::Clearance).sweep.scene();
    let mut meta = super::provenance::meta(scene);
    meta.insert("command".into(), json!(command(report)));
    meta.insert("simulated_s".into(), json!(text::simulated(report)));
    meta
}

fn command(report: &Report) -> &'static str {
    if report.corrected.extent == Extent::FULL {
        "jointplay reproduce --out report/"
    } else {
        "jointplay reproduce --out report/ --quick"
    }
}

fn interrupted(kept: &Kept) -> Failure {
    Failure::new(
        Failure::INTERRUPTED,
        format!("interrupted; no report was written, and the same command resumes from {}", kept.folder().display()),
    )
}

/// How many of the paper's numbers and statements a model agrees with.
#[derive(Clone, Copy, Debug)]
struct Score {
    numbers: usize,
    agree: usize,
    near: usize,
    confirmed: usize,
}

impl Score {
    fn of(found: &Findings, statements: &[Statement]) -> Self {
        let compared = found.comparisons();
        let with = |agreement| {
            let of = compared.iter().filter(|c| c.agreement() == agreement);
            of.count()
        };
        Self {
            numbers: compared.len(),
            agree: with(Agreement::Agrees),
            near: with(Agreement::Near),
            confirmed: statements.iter().filter(|s| s.confirmed).count(),
        }
    }

    fn differ(&self) -> usize {
        self.numbers - self.agree - self.near
    }
}

/// The results in a few lines.
fn summary(report: &Report, out: &Path, wall: f64) -> String {
    let statements = report.corrected.statements();
    let corrected = Score::of(&report.corrected, &statements);
    let printed = Score::of(&report.printed, &report.printed.statements());
    format!(
        "Numbers           {} of {} agree within 10 %, {} more within a factor of 2, {} differ\n\
         Statements        {} of {} confirmed\n\
         (13) as printed   {} numbers agree within 10 %, {} more within a factor of 2; {} statements confirmed\n\
         Simulated         {:.0} s\n\
         Wall time         {wall:.1} s\n\
         Written           {}\n\
         Version           jointplay {}\n",
        corrected.agree,
        corrected.numbers,
        corrected.near,
        corrected.differ(),
        corrected.confirmed,
        statements.len(),
        printed.agree,
        printed.near,
        printed.confirmed,
        text::simulated(report),
        out.join("index.html").display(),
        crate::VERSION
    )
}
