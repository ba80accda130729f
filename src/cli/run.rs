//! `run`: simulate without a window and write rows at equal intervals.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use indicatif::ProgressBar;
use serde_json::{Map, Value as Json, json};

use super::args::{RunArguments, SummaryForm};
use super::impacts::ImpactsFile;
use super::link::{self, LinkedRun};
use super::output::{RowsFile, Table, check_distinct, reserve};
use super::state::{self, StateFile};
use super::summary::{self, Status, Stepping};
use super::{Failure, interrupt, load, print, progress, quantity, start, warn, wear};
use crate::analysis::assembly::StartReport;
use crate::analysis::row_times::{RowReader, RowTimes};
use crate::files::{publish, spare_older};
use crate::scene::{LiveScene, SavedState, Scene, insert_texts};
use crate::simulate::{Frame, channels_of, chosen_channels};
use crate::units::significant;

/// Steps between two checks of the clock, the progress bar and Ctrl-C.
const STEPS_BETWEEN_CHECKS: u32 = 256;

/// How the stepping ended, with a message for the user if it ended early.
struct End {
    status: Status,
    failure: Option<Failure>,
}

/// Runs `run`.
///
/// # Errors
/// Bad input, before the run starts; later the divergence guard, Ctrl-C or the file system.
pub fn run(arguments: &RunArguments) -> Result<(), Failure> {
    let mut replay = link_replay(arguments)?;
    let requested = arguments.duration.as_deref().map(|text| quantity::duration("--duration", text)).transpose()?;
    let Some(duration) = requested.or(replay.as_ref().and_then(LinkedRun::time)) else {
        return Err(Failure::usage("--link: the link names no instant; give the length of the run with --duration"));
    };
    let times = row_times(arguments, duration)?;
    let scene = load(&arguments.scene)?;
    let mut simulation = start(&scene)?;
    // From here on there may be temporary files, which an interrupted run removes.
    interrupt::listen();
    let mut outputs = Outputs::claim(arguments)?;
    let start_report = StartReport::of(&mut simulation);
    let mut frame = Frame::default();
    // Columns are determined at t = 0, also for a resumed run.
    simulation.sample(0.0, &mut frame);
    let from = match &arguments.from_state {
        Some(path) => resume_from(&mut simulation, path, &scene, duration)?,
        None => 0.0,
    };
    if let Some(impacts) = &mut outputs.impacts {
        impacts.begin_at(from);
    }
    if simulation.load_peaks().is_none() {
        simulation.track_load_peaks();
    }
    let starts_wear = outputs.wear.is_some() && simulation.wear().is_none();
    if starts_wear {
        simulation.track_wear();
    }
    let channels = chosen_channels(channels_of(&scene.machine, &frame), &arguments.channels).map_err(|error| {
        Failure::usage(format!(
            "--channels: {error}; `jointplay check {} --channels` lists them",
            arguments.scene.name().display()
        ))
    })?;
    let mut table = Table::new(channels.iter().map(|channel| &channel.column));
    if let (Some(times), Some(_)) = (&times, &outputs.rows) {
        reserve(&mut table, times.last().saturating_add(1))?;
    }
    if !arguments.quiet {
        if times.is_some_and(|times| !times.include_the_end()) {
            warn("the duration is not a whole number of intervals: the last row lies before the end");
        }
        if starts_wear && arguments.from_state.is_some() {
            warn("the wear map begins at the saved state, which has none");
        }
        start_report.warnings_of(&scene).iter().for_each(|warning| warn(warning));
    }

    let progress = progress::bar(!arguments.quiet, position(duration));
    let mut stopwatch = Duration::ZERO;
    let rows = times.map(|times| {
        let channels = channels.into_iter().map(|channel| (channel.column.clone(), channel.reading())).collect();
        RowReader::new(times, times.first(from, simulation.time()), channels)
    });
    let end = simulate(
        &mut simulation,
        duration,
        rows,
        &mut table,
        &mut StepObservers {
            impacts: outputs.impacts.as_mut(),
            state: outputs.state.as_mut(),
            replay: replay.as_mut(),
            end: requested,
        },
        &mut stopwatch,
        &progress,
    );
    progress.finish_and_clear();
    let End { status, failure } = end;
    if status == Status::Diverged {
        // It would diverge again when resumed.
        outputs.state = None;
    }
    let failure = failure.map(|failure| failure.with_result_in(&outputs.spare_older()));

    let stepping = Stepping { from, wall: stopwatch.as_secs_f64() };
    let finished_impacts = outputs.impacts.as_ref().map(ImpactsFile::impacts);
    let mut facts = summary::json(&simulation, status, stepping, finished_impacts);
    let mut text = summary::text(&simulation, status, stepping, finished_impacts);
    summary::start(&mut facts, &mut text, &start_report);
    let fault = simulation.probe_fault();
    if let Some(fault) = &fault {
        summary::line(&mut text, "No tip error", &format!("the ideal mechanism {fault}"));
    }
    facts.insert("probe_fault".into(), json!(fault.map(|fault| fault.to_string())));
    facts.insert("rows".into(), json!(table.rows()));
    if let Some(path) = &arguments.from_state {
        let message = format!("{} s, from {}", significant(from, 9), path.display());
        summary::line(&mut text, "Resumed at", &message);
        facts.insert("from_time_s".into(), json!(from));
    }
    let mut verdict = None;
    if let Some(replay) = replay.as_ref().filter(|replay| requested.is_none() && replay.is_reached(&simulation)) {
        let compared = replay.verdict(&simulation);
        facts.insert("agrees_with_link".into(), json!(replay.hash().map(|_| compared.is_ok())));
        match compared {
            Ok(message) => summary::line(&mut text, "Link", &message),
            Err(message) => verdict = Some(Failure::new(Failure::MISSED, format!("--link: {message}"))),
        }
    }
    let mut meta = facts.clone();
    // Repeated runs must write identical files, so timings are left out.
    meta.shift_remove("wall_s");
    meta.shift_remove("ratio");
    meta.shift_remove("slower_than_asked");
    meta.insert("duration_s".into(), json!(duration));
    insert_texts(&mut meta, &scene);
    let unsaved = outputs.write(arguments, &mut simulation, &scene, (&table, times), meta, (&mut facts, &mut text))?;
    match arguments.summary {
        SummaryForm::Text => print(&text)?,
        SummaryForm::Json => print(&format!("{:#}\n", Json::Object(facts)))?,
    }
    failure.or(verdict).or(unsaved).map_or(Ok(()), Err)
}

/// The instants of the rows of a run of `duration`, s, if `--every` asks for rows.
fn row_times(arguments: &RunArguments, duration: f64) -> Result<Option<RowTimes>, Failure> {
    let Some(every) = &arguments.every else { return Ok(None) };
    let every = quantity::duration("--every", every)?;
    let zero = || Failure::usage("--every 0: the interval between rows must be greater than 0");
    Ok(Some(RowTimes::new(duration, every).ok_or_else(zero)?))
}

/// The files that a run writes.
struct Outputs {
    rows: Option<RowsFile>,
    impacts: Option<ImpactsFile>,
    wear: Option<RowsFile>,
    state: Option<StateFile>,
}

impl Outputs {
    fn claim(arguments: &RunArguments) -> Result<Self, Failure> {
        let RunArguments { out, impacts, wear, save_state, from_state, force, .. } = arguments;
        let mut names = vec![("the scene".to_owned(), arguments.scene.name())];
        for (option, path) in [("--out", out), ("--impacts", impacts), ("--wear", wear)] {
            names.extend(path.iter().flat_map(|path| RowsFile::names(option, path)));
        }
        for (option, path) in [("--save-state", save_state), ("--from-state", from_state)] {
            names.extend(path.iter().map(|path| (option.to_owned(), path.clone())));
        }
        check_distinct(&names)?;
        let rows = |path: &Option<PathBuf>| path.as_ref().map(|path| RowsFile::claim(path, *force)).transpose();
        Ok(Self {
            rows: rows(out)?,
            impacts: impacts.as_ref().map(|path| ImpactsFile::claim(path, *force)).transpose()?,
            wear: rows(wear)?,
            state: save_state.as_ref().map(|path| StateFile::claim(path, *force)).transpose()?,
        })
    }

    /// After a failure: gives the files other names if they would replace older ones; returns these names.
    fn spare_older(&mut self) -> Vec<PathBuf> {
        let rows = self.rows.iter_mut().chain(&mut self.wear).chain(self.impacts.as_mut().map(ImpactsFile::file));
        let targets = rows.flat_map(RowsFile::targets).chain(self.state.as_mut().map(StateFile::file));
        spare_older(targets.collect())
    }

    /// Writes the files with `meta`, and their names into the summary: `facts` and `text`. Returns why there is no saved state
    /// if the others were written without it.
    fn write(
        self,
        arguments: &RunArguments,
        simulation: &mut LiveScene,
        scene: &Scene,
        (table, times): (&Table, Option<RowTimes>),
        meta: Map<String, Json>,
        (facts, text): (&mut Map<String, Json>, &mut String),
    ) -> Result<Option<Failure>, Failure> {
        let mut files = Vec::new();
        if let (Some(file), Some(times)) = (self.rows, times) {
            let path = file.path().to_owned();
            let mut meta = meta.clone();
            meta.insert("every_s".into(), json!(times.every()));
            if !arguments.channels.is_empty() {
                meta.insert("channels".into(), json!(arguments.channels));
            }
            meta.insert(
                "contact_states".into(),
                json!({"0": "free", "1": "creep", "2": "slip", "3": "ideal", "4": "stick"}),
            );
            files.extend(file.fill(table, meta)?);
            facts.insert("out".into(), json!(path.display().to_string()));
            summary::written(text, table.rows(), "row", &path);
        }
        if let Some(mut impacts) = self.impacts {
            let path = impacts.file().path().to_owned();
            let (rows, filled) = impacts.fill(scene, meta.clone())?;
            files.extend(filled);
            facts.insert("impacts_out".into(), json!(path.display().to_string()));
            summary::written(text, rows, "impact", &path);
        }
        simulation.commit_wear();
        let mut end = Frame::default();
        if self.wear.is_some() {
            let time = simulation.time();
            simulation.sample(time, &mut end);
        }
        if let (Some(file), Some(map)) = (self.wear, simulation.wear()) {
            let path = file.path().to_owned();
            let (rows, filled) = wear::fill(file, (map, &end), scene, meta)?;
            files.extend(filled);
            facts.insert("wear_out".into(), json!(path.display().to_string()));
            summary::written(text, rows, "cell", &path);
        }
        let mut failure = None;
        if let Some(mut state) = self.state {
            match state.text(simulation) {
                Ok(content) => {
                    let path = state.file().path().display().to_string();
                    files.push(state.fill(&content)?);
                    facts.insert("state_out".into(), json!(path));
                    summary::line(text, "State", &path);
                }
                // The rows are still useful without the saved state.
                Err(error) => failure = Some(error),
            }
        }
        publish(files)?;
        Ok(failure)
    }
}

/// The replay of the run that `--link` names, if given.
fn link_replay(arguments: &RunArguments) -> Result<Option<LinkedRun>, Failure> {
    let text = arguments.scene.link.as_deref();
    text.map(|text| link::parse(text).map(LinkedRun::new)).transpose()
}

/// Loads the state file `path` into the freshly started `simulation`; returns the time at which the run resumes, s.
///
/// # Errors
/// As [`state::read`]; a `duration`, s, before the saved time; a state that does not fit the simulation.
fn resume_from(simulation: &mut LiveScene, path: &Path, scene: &Scene, duration: f64) -> Result<f64, Failure> {
    let SavedState { snapshot, time, .. } = state::read(path, scene)?;
    if duration < time {
        return Err(Failure::usage(format!(
            "--duration {duration} s lies before the {time} s of --from-state {}: it counts from the start of the run",
            path.display()
        )));
    }
    simulation
        .resume(&snapshot)
        .map_err(|mismatch| Failure::usage(format!("--from-state {}: {mismatch}", path.display())))?;
    Ok(time)
}

/// Observers called around every step.
struct StepObservers<'a> {
    impacts: Option<&'a mut ImpactsFile>,
    state: Option<&'a mut StateFile>,
    /// Replay of a link. It ends at `end`, s, or by default at the link's instant.
    replay: Option<&'a mut LinkedRun>,
    end: Option<f64>,
}

impl StepObservers<'_> {
    /// Whether the run is over.
    fn is_over(&self, simulation: &LiveScene, duration: f64) -> bool {
        let at_link = self.replay.as_ref().filter(|_| self.end.is_none());
        at_link.map_or(simulation.time() >= duration, |replay| replay.is_reached(simulation))
    }
}

/// Steps to `duration` and fills `table` with the rows; `stopwatch` runs only while the simulation steps.
fn simulate(
    simulation: &mut LiveScene,
    duration: f64,
    mut rows: Option<RowReader>,
    table: &mut Table,
    observers: &mut StepObservers<'_>,
    stopwatch: &mut Duration,
    progress: &ProgressBar,
) -> End {
    loop {
        if let Some(rows) = &mut rows
            && let Err(error) = rows.read(simulation, |row| table.push(row))
        {
            let failure = Some(Failure::new(Failure::DIVERGED, error.to_string()));
            return End { status: Status::Diverged, failure };
        }
        if observers.is_over(simulation, duration) {
            return End { status: Status::Done, failure: None };
        }
        progress.set_position(position(simulation.time()));
        if interrupt::is_requested() {
            return End {
                status: Status::Interrupted,
                failure: Some(Failure::new(
                    Failure::INTERRUPTED,
                    format!("interrupted at t = {:.6e} s of {duration:.6e} s", simulation.time()),
                )),
            };
        }
        let last = if observers.replay.is_some() { f64::INFINITY } else { duration };
        let row = rows.as_ref().and_then(RowReader::next_time).unwrap_or(last);
        let started = Instant::now();
        let outcome = step_until_check(simulation, row, duration, observers);
        *stopwatch += started.elapsed();
        if let Err(message) = outcome {
            return End { status: Status::Diverged, failure: Some(Failure::new(Failure::DIVERGED, message)) };
        }
    }
}

/// Steps until time `row`, s, is reached, the run ends, or a check is due; a row never shortens a step. The error is the reason
/// why the stepping stopped.
fn step_until_check(
    simulation: &mut LiveScene,
    row: f64,
    duration: f64,
    observers: &mut StepObservers<'_>,
) -> Result<(), String> {
    for _ in 0..STEPS_BETWEEN_CHECKS {
        if simulation.time() >= row || observers.is_over(simulation, duration) {
            break;
        }
        if let Some(state) = &mut observers.state {
            state.watch(simulation, duration);
        }
        match &mut observers.replay {
            None => simulation.step_until(duration).map_err(|stopped| stopped.to_string())?,
            Some(replay) => replay.step(simulation, observers.end)?,
        }
        if let Some(impacts) = &mut observers.impacts {
            impacts.collect(simulation);
        }
    }
    Ok(())
}

/// Simulated time in ns, because the progress bar counts in integers.
fn position(time: f64) -> u64 {
    (time * 1e9) as u64
}
