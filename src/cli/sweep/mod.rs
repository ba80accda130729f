//! `sweep`: one scene at many parameter values, on all cores.

mod request;
mod result;

use std::collections::HashSet;
use std::ops::ControlFlow;
use std::time::Instant;

use serde_json::{Map, Value as Json, json};

use self::result::{SweepResult, Target};
use super::args::{SummaryForm, SweepArguments};
use super::measuring::within;
use super::output::{RowsFile, check_distinct};
use super::provenance::WRITER;
use super::summary::count;
use super::{Failure, interrupt, print, progress, threads, warn};
use crate::analysis::ideal_fault::{IdealFault, ideal_fault};
use crate::analysis::layout::Status;
use crate::analysis::point::MAX_EXPONENT_TOLERANCE;
use crate::analysis::regime::MIN_SECTIONS;
use crate::analysis::sweep::Sweep;
use crate::analysis::sweep_run::{RunFault, SweepRun};
use crate::analysis::sweep_settings::settings;
use crate::files::remove_file;
use crate::machine::WarningKind;

/// Runs `sweep`.
///
/// # Errors
/// Bad input, before the sweep starts; later Ctrl-C or the file system.
pub fn sweep(arguments: &SweepArguments) -> Result<(), Failure> {
    let sweep = request::read(arguments)?;
    // From here on there may be temporary files, which an interrupted sweep removes.
    interrupt::listen();
    let mut names = vec![("the scene".to_owned(), arguments.scene.name())];
    names.extend(arguments.points.iter().map(|path| ("--points".to_owned(), path.clone())));
    names.extend(RowsFile::names("--out", &arguments.out));
    check_distinct(&names)?;
    let target = Target::claim(&arguments.out, arguments.force)?;
    let meta = settings(WRITER, &sweep);
    if !arguments.quiet {
        warnings(&sweep).iter().for_each(|warning| warn(warning));
    }
    let partial = arguments.out.with_added_extension("partial");
    let mut run = SweepRun::resumed(&sweep, &partial, &Json::Object(meta.clone()))?;
    let (all, before) = (sweep.design().points(), run.finished_points());
    if before > 0 && !arguments.quiet {
        warn(&format!("resuming where {} stopped: {before} of {all} points are done", partial.display()));
    }
    let bar = progress::bar(!arguments.quiet, all as u64);
    bar.set_position(before as u64);
    bar.reset_eta();
    let started = Instant::now();
    let outcome = run.compute(threads(arguments.threads), |finished| {
        bar.set_position(finished as u64);
        if interrupt::is_requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let wall = started.elapsed().as_secs_f64();
    bar.finish_and_clear();
    outcome?;
    if !run.is_complete() {
        let (done, partial) = (run.finished_points(), partial.display());
        let message = format!("interrupted with {done} of {all} points done; the same command resumes from {partial}");
        return Err(Failure::new(Failure::INTERRUPTED, message));
    }
    let result = SweepResult { sweep: &sweep, meta, records: run.records() };
    result.write(target)?;
    let text = report(&result, wall, arguments);
    drop(run);
    if let Err(error) = remove_file(&partial) {
        warn(&format!("{} is no longer needed and could not be removed: {error}", partial.display()));
    }
    print(&text)
}

impl From<RunFault> for Failure {
    fn from(fault: RunFault) -> Self {
        let is_usage = matches!(fault, RunFault::OtherSettings { .. } | RunFault::NoMemory { .. });
        Self::new(if is_usage { Self::USAGE } else { Self::INPUT_OUTPUT }, fault.to_string())
    }
}

/// Largest number of points examined for warnings, spread over the ranges, so that the check stays fast.
const MAX_EXAMINED: usize = 64;

/// Processor time for the motions without play at these points, s.
const MAX_EXAMINATION_COST: f64 = 2.0;

/// Kind of a warning; each kind is reported once.
#[derive(PartialEq, Eq, Hash)]
enum Kind {
    Scene(WarningKind),
    Singular(std::mem::Discriminant<IdealFault>),
}

/// Warnings about the scene along the ranges, each kind with its first point, and about the sweep itself.
fn warnings(sweep: &Sweep) -> Vec<String> {
    let mut all = Vec::new();
    let mut kinds = HashSet::new();
    let mut may_continue = within(MAX_EXAMINATION_COST);
    let last = sweep.design().points() - 1;
    let step = sweep.design().points().div_ceil(MAX_EXAMINED);
    for point in (0..last).step_by(step).chain([last]) {
        let Ok(scene) = sweep.design().scene(sweep.scene(), point) else {
            continue;
        };
        let of_scene = scene.machine.warnings().into_iter();
        let of_scene = of_scene.map(|warning| (Kind::Scene(warning.kind()), warning.to_string()));
        let singular = ideal_fault(&scene, &mut may_continue).map(|near| {
            let kind = Kind::Singular(std::mem::discriminant(&near));
            (kind, near.to_string())
        });
        for (kind, warning) in of_scene.chain(singular) {
            if kinds.insert(kind) {
                all.push(format!("at {}: {warning}", sweep.describe(point)));
            }
        }
    }
    let protocol = sweep.protocol();
    let kept = protocol.kept();
    if protocol.sections().is_some() && kept < MIN_SECTIONS {
        all.push(format!(
            "{} of each point: with fewer than {MIN_SECTIONS} no regime can be classified and all are reported as unclear; \
             raise --{} or lower --discard.",
            count(kept as u64, "section"),
            if protocol.plan().is_some() { "periods" } else { "crossings" }
        ));
    }
    let solver = &sweep.scene().machine.solver;
    let loose = solver.method.is_adaptive() && solver.tolerance > MAX_EXPONENT_TOLERANCE * (1.0 + 1e-9);
    if loose && protocol.plan().is_some_and(|plan| plan.exponent) {
        all.push(format!(
            "solver.tolerance {:e}: at this tolerance the integration error is too large, so exponents and the \
             regimes classified from them are unreliable; use {MAX_EXPONENT_TOLERANCE:e} or less, or --no-exponent.",
            solver.tolerance
        ));
    }
    all
}

/// The summary of the written file; `wall` is the time of computation, s.
fn report(result: &SweepResult<'_>, wall: f64, arguments: &SweepArguments) -> String {
    let statuses = result.values("status");
    let with = |values: &[f64], code: f64| values.iter().filter(|value| **value == code).count();
    let of_status = |status: Status| with(&statuses, status.code() as f64);
    // Words of the codes in `meta`, each with its number of points, if there are any.
    let counts = |codes: &str, number: &dyn Fn(f64) -> usize| -> Map<String, Json> {
        let words = result.meta.get(codes).and_then(Json::as_object).into_iter().flatten();
        let of_word = words.filter_map(|(code, word)| Some((word.as_str()?, number(code.parse().ok()?))));
        of_word.filter(|(_, number)| *number > 0).map(|(word, number)| (word.to_owned(), json!(number))).collect()
    };
    let (regime, doubt) = (result.values("regime"), result.values("doubts"));
    let regimes = counts("regimes", &|code| with(&regime, code));
    let doubts = counts("doubts", &|bit| doubt.iter().filter(|bits| **bits as u32 & bit as u32 != 0).count());
    let doubtful = doubt.iter().filter(|bits| **bits > 0.0).count();
    let (diverged, no_start) = (of_status(Status::Diverged), of_status(Status::NoStart));
    let out = arguments.out.display().to_string();
    if arguments.summary == SummaryForm::Json {
        let mut all = result.meta.clone();
        let own = json!({
            "status": "done", "points": statuses.len(), "diverged": diverged, "no_start": no_start, "regimes": regimes,
            "doubtful": doubtful, "doubts": doubts, "wall_s": wall, "out": out,
        });
        all.extend(own.as_object().cloned().unwrap_or_default());
        return format!("{:#}\n", Json::Object(all));
    }
    let listed = |counts: &Map<String, Json>| {
        let words: Vec<String> = counts.iter().map(|(word, number)| format!("{number} {word}")).collect();
        words.join(", ")
    };
    let mut text = format!("Points            {}", statuses.len());
    for (number, what) in [(diverged, "diverged"), (no_start, "could not start")] {
        if number > 0 {
            text += &format!(", {number} {what}");
        }
    }
    if !regimes.is_empty() {
        text += &format!("\nRegimes           {}", listed(&regimes));
    }
    if doubtful > 0 {
        text += &format!("\nNot trusted       {}: {}", count(doubtful as u64, "point"), listed(&doubts));
    }
    let written = count(statuses.len() as u64, "point");
    let version = crate::VERSION;
    text + &format!(
        "\nWall time         {wall:.1} s\nWritten           {written} to {out}\nVersion           jointplay {version}\n"
    )
}
