//! `sweep`: one scene at many parameter values, on all cores; `merge`: combines the shards of a sweep.

mod archive;
mod csv;
mod merge;
mod options;
mod parquet;
mod partial;
mod request;
mod target;
mod word;

pub(super) use archive::Source;
pub use merge::merge;
pub(super) use partial::Partial;
pub(super) use word::Word;

use std::collections::HashSet;
use std::time::Instant;

use indicatif::ProgressBar;
use serde_json::{Map, Value as Json, json};

use self::archive::{Archive, ZIPPED, unit_suffix};
use self::options::Shard;
use self::target::Target;
use super::args::{SummaryForm, SweepArguments};
use super::measuring::within;
use super::output::{RowsFile, check_distinct};
use super::summary::count;
use super::workers::run_jobs;
use super::{Failure, interrupt, print, progress, threads, warn};
use crate::analysis::axis::Axis;
use crate::analysis::design::{Arrangement, FOLLOW_BLOCK};
use crate::analysis::ideal_fault::{IdealFault, ideal_fault};
use crate::analysis::layout::Status;
use crate::analysis::point::{MAX_EXPONENT_TOLERANCE, Span};
use crate::analysis::regime::{MIN_SECTIONS, Regime};
use crate::analysis::sweep::Sweep;
use crate::machine::WarningKind;
use crate::scene::{Scene, insert_texts};
use crate::simulate::Doubt;

/// Steps between two checks for Ctrl-C.
const STEPS_BETWEEN_CHECKS: u32 = 4096;

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
    let shard = arguments.shard.as_deref().map(options::shard).transpose()?;
    let target = Target::claim(&arguments.out, arguments.force, shard.is_some())?;
    let archive = Archive::of_sweep(meta(&sweep), &sweep, shard.as_ref());
    let blocks: Vec<usize> =
        (0..sweep.design().blocks()).filter(|&b| shard.as_ref().is_none_or(|shard| shard.has(b))).collect();
    if !arguments.quiet {
        warnings(&sweep).iter().for_each(|warning| warn(warning));
    }
    let mut partial = Partial::open(&arguments.out, archive.meta(), &sweep, &blocks)?;
    let todo: Vec<usize> = blocks.iter().copied().filter(|b| !partial.has(*b)).collect();
    let points = |blocks: &[usize]| -> u64 {
        let lengths = blocks.iter().map(|&b| sweep.design().block(b).len() as u64);
        lengths.sum()
    };
    let (all, left) = (points(&blocks), points(&todo));
    if left < all && !arguments.quiet {
        warn(&format!("resuming where {} stopped: {} of {all} points are done", partial.path().display(), all - left));
    }
    let bar = progress::bar(!arguments.quiet, all);
    bar.set_position(all - left);
    bar.reset_eta();
    let threads = threads(arguments.threads);
    let started = Instant::now();
    let outcome = compute(&sweep, &todo, threads, &mut partial, &bar);
    let wall = started.elapsed().as_secs_f64();
    bar.finish_and_clear();
    outcome?;
    if todo.iter().any(|b| !partial.has(*b)) {
        let left = points(&blocks.into_iter().filter(|b| !partial.has(*b)).collect::<Vec<_>>());
        return Err(Failure::new(
            Failure::INTERRUPTED,
            format!(
                "interrupted with {} of {all} points done; the same command resumes from {}",
                all - left,
                partial.path().display()
            ),
        ));
    }
    let mut summary = summarise(&archive, &mut partial)?;
    summary.insert("wall_s".into(), json!(wall));
    target.write(&archive, &mut partial)?;
    partial.remove();
    report(&archive, &summary, &arguments.out, arguments.summary)
}

/// Provenance of the result: the same for the whole sweep and every shard of it.
pub(super) fn meta(sweep: &Sweep) -> Map<String, Json> {
    let scene = sweep.scene();
    let (design, protocol) = (sweep.design(), sweep.protocol());
    let mut meta = super::provenance::meta(scene);
    insert_texts(&mut meta, scene);
    let mut add = |key: &str, value: Json| meta.insert(key.to_owned(), value);
    add("scene_crc32", json!(format!("{:08x}", crc32fast::hash(scene.source.text.as_bytes()))));
    add("vary", design.axes().iter().map(|axis| axis_meta(scene, axis)).collect());
    add("arrangement", json!(if design.arrangement() == Arrangement::Zipped { ZIPPED } else { "crossed" }));
    match &protocol.span {
        Span::Sections { plan, .. } => {
            // A parameter that changes the period gives different periods at the ends of its range.
            let [period, other] = [0, design.points() - 1].map(|point| {
                let scene = design.scene(scene, point).ok()?;
                protocol.interval(&scene).ok()
            });
            add("periods", json!(plan.periods));
            add("discard", json!(plan.discard));
            add("section", json!("phase"));
            add("phase", json!(plan.phase));
            add("period_s", json!(period.filter(|_| period == other)));
        }
        Span::Duration { duration, from } => {
            add("duration_s", json!(duration));
            add("from_s", json!(from));
        }
        Span::Crossings { crossing, count, discard, duration } => {
            add("crossings", json!(count));
            add("discard", json!(discard));
            add("section", json!(crossing.text()));
            add("duration_s", json!(duration));
        }
    }
    let starts: Vec<&str> = design.starts().iter().map(|start| start.word()).collect();
    add("start", if let [start] = starts[..] { json!(start) } else { json!(starts) });
    add("follow_block", json!(FOLLOW_BLOCK));
    if let Some(plan) = protocol.plan() {
        add("exponent", json!(plan.exponent));
    }
    let statuses = json!({
        Status::Done.code().to_string(): "done",
        Status::Diverged.code().to_string(): "diverged",
        Status::NoStart.code().to_string(): "could not start",
    });
    add("statuses", statuses);
    if protocol.sections().is_some() {
        let words = Regime::ALL.iter().map(|regime| (regime.code().to_string(), json!(regime.word())));
        let none = ("-1".to_owned(), json!("none"));
        add("regimes", Json::Object(words.chain([none]).collect()));
    }
    let doubts = Doubt::KINDS.iter().enumerate();
    add("doubts", doubts.map(|(k, kind)| ((1_u32 << k).to_string(), json!(kind))).collect::<Map<_, _>>().into());
    meta
}

/// A varied parameter in `meta`. Listed values are in the arrays; their checksum distinguishes sweeps.
fn axis_meta(scene: &Scene, axis: &Axis) -> Json {
    let mut own = Map::new();
    let mut add = |key: &str, value: Json| own.insert(key.to_owned(), value);
    add("key", json!(axis.key()));
    if axis.is_listed() {
        let mut checksum = crc32fast::Hasher::new();
        for i in 0..axis.count() {
            let value = scene.parameter(axis.key()).map(|parameter| parameter.write(&axis.value(i)));
            checksum.update(format!("{}\n", value.unwrap_or_default()).as_bytes());
        }
        add("values_crc32", json!(format!("{:08x}", checksum.finalize())));
    } else {
        add("from", json!(axis.number(0)));
        add("to", json!(axis.number(axis.count() - 1)));
    }
    add("count", json!(axis.count()));
    add("spacing", json!(axis.spacing()));
    if axis.words().is_some() {
        add("words", json!(true));
    }
    add("unit", json!(unit_suffix(scene, axis)));
    Json::Object(own)
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

/// Computes the blocks `todo` and appends each to `partial` when it is done; stops early after Ctrl-C.
pub(super) fn compute(
    sweep: &Sweep,
    todo: &[usize],
    threads: usize,
    partial: &mut Partial,
    bar: &ProgressBar,
) -> Result<(), Failure> {
    let work = |b: usize, may_continue: &dyn Fn() -> bool| {
        let mut block = sweep.begin(b);
        let mut reported = 0;
        while !block.is_done() {
            if !may_continue() {
                return None;
            }
            block.advance(STEPS_BETWEEN_CHECKS);
            let finished = block.finished().len();
            bar.inc((finished - reported) as u64);
            reported = finished;
        }
        Some(Ok(block.records()))
    };
    run_jobs(todo, threads, work, |b, records| partial.append(b, &records))
}

/// Number of points by outcome.
fn summarise(archive: &Archive, source: &mut impl Source) -> Result<Map<String, Json>, Failure> {
    let statuses = archive.values("status", source)?;
    let regimes = archive.values("regime", source)?;
    let with = |values: &[f64], code: i64| values.iter().filter(|v| **v == code as f64).count();
    let mut summary = Map::new();
    summary.insert("points".into(), json!(statuses.len()));
    summary.insert("diverged".into(), json!(with(&statuses, Status::Diverged.code())));
    summary.insert("no_start".into(), json!(with(&statuses, Status::NoStart.code())));
    if let Some(words) = archive.meta().get("regimes").and_then(Json::as_object) {
        let count = |(code, word): (&String, &Json)| {
            let number = with(&regimes, code.parse().ok()?);
            (number > 0).then(|| (word.as_str().unwrap_or_default().to_owned(), json!(number)))
        };
        summary.insert("regimes".into(), Json::Object(words.iter().filter_map(count).collect()));
    }
    let doubts = archive.values("doubts", source)?;
    let words = archive.meta().get("doubts").and_then(Json::as_object);
    let of_kind = words.into_iter().flatten().filter_map(|(bit, word)| {
        let bit: u32 = bit.parse().ok()?;
        let number = doubts.iter().filter(|bits| **bits as u32 & bit != 0).count();
        (number > 0).then(|| (word.as_str().unwrap_or_default().to_owned(), json!(number)))
    });
    let of_kind: Map<String, Json> = of_kind.collect();
    summary.insert("doubtful".into(), json!(doubts.iter().filter(|bits| **bits > 0.0).count()));
    summary.insert("doubts".into(), Json::Object(of_kind));
    Ok(summary)
}

/// Prints the summary of the written file.
fn report(
    archive: &Archive,
    summary: &Map<String, Json>,
    out: &std::path::Path,
    form: SummaryForm,
) -> Result<(), Failure> {
    if form == SummaryForm::Json {
        let mut all = archive.meta().clone();
        all.insert("status".into(), json!("done"));
        all.extend(summary.clone());
        all.insert("out".into(), json!(out.display().to_string()));
        return print(&format!("{:#}\n", Json::Object(all)));
    }
    let number = |key: &str| summary.get(key).and_then(Json::as_u64).unwrap_or(0);
    let mut text = format!("Points            {}", number("points"));
    for (key, what) in [("diverged", "diverged"), ("no_start", "could not start")] {
        if number(key) > 0 {
            text += &format!(", {} {what}", number(key));
        }
    }
    let regimes = summary.get("regimes").and_then(Json::as_object).map_or_else(String::new, |regimes| {
        let regimes: Vec<String> = regimes.iter().map(|(word, number)| format!("{number} {word}")).collect();
        // A shard of a sweep with fewer points than shards may have none.
        let words = if regimes.is_empty() { "none".to_owned() } else { regimes.join(", ") };
        format!("\nRegimes           {words}")
    });
    let of_kind = summary.get("doubts").and_then(Json::as_object).into_iter().flatten();
    let of_kind: Vec<String> = of_kind.map(|(word, number)| format!("{number} {word}")).collect();
    let doubtful = match number("doubtful") {
        0 => String::new(),
        some => format!("\nNot trusted       {}: {}", count(some, "point"), of_kind.join(", ")),
    };
    let wall = summary.get("wall_s").and_then(Json::as_f64);
    let wall = wall.map_or_else(String::new, |wall| format!("\nWall time         {wall:.1} s"));
    text += &format!(
        "{regimes}{doubtful}{wall}\nWritten           {} to {}\nVersion           jointplay {}\n",
        count(number("points"), "point"),
        out.display(),
        crate::VERSION
    );
    print(&text)
}

impl Shard {
    /// Whether block `b` belongs to this shard. Blocks are assigned round-robin to balance the work.
    fn has(&self, b: usize) -> bool {
        b % self.of == self.number - 1
    }
}
