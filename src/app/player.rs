//! A running scene with its transport: playing, pacing, recording, peaks and what went wrong. No egui here.

use std::collections::VecDeque;
use std::sync::OnceLock;

use web_time::Instant;

use super::ideal::{Gravity, Ideal};
use super::log::{Event, Log, Number};
use super::paths::Paths;
use super::settled::Settling;
use super::twin::Twin;
use super::watch::Watch;
use crate::analysis::section::Schedule;
use crate::scene::{Scene, SceneError, Value};
use crate::simulate::{
    Channels, Effect, Frame, History, Mark, Pacer, Peak, RECORDED_JOINTS, Simulation, Snapshot,
    StartError, Stopped,
};

/// Narrowest bin of the record, s: shorter than any step that resolves an impact.
const FINEST_BIN: f64 = 2e-6;

/// Seconds from any start: what a frame has spent on stepping is measured by it.
pub type Clock = fn() -> f64;

/// The clock on the wall.
pub fn wall() -> f64 {
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_secs_f64()
}

/// A simulation and everything needed to play and plot it.
///
/// There is one instant on show, the pacer's: frame, record, peaks, sections and link are those of it. The simulation itself
/// is further on by a part of its latest step, of which nothing is told before its time.
pub struct Player {
    /// How fast simulated time passes.
    pub pacer: Pacer,
    /// What measures how long stepping takes.
    pub clock: Clock,
    simulation: Simulation,
    /// The run as it was before a change in the middle of the latest step: what that step did until the change.
    unchanged: Option<Box<Simulation>>,
    /// The scene as its file gives it.
    original: Scene,
    /// What is allowed but may not mean what the user expects.
    warnings: Vec<String>,
    playing: bool,
    stopped: Option<Stopped>,
    frame: Frame,
    peaks: Vec<Peak>,
    /// Of the latest step, as far as they are still to come.
    coming: Vec<Peak>,
    /// Since the frame before.
    passed: Vec<Peak>,
    channels: Channels,
    /// Of the channels, and behind them the clearance of each recorded ball joint.
    history: History,
    recorded: Frame,
    values: Vec<f64>,
    settling: Settling,
    paths: Paths,
    /// What was before the latest single steps, oldest first.
    past: VecDeque<Before>,
    /// What was done since the start.
    log: Log,
    /// Instants at which steps end.
    sections: Option<Schedule>,
    watch: Watch,
    twin: Option<Box<Twin>>,
    /// Gravity since the start, for the ideal motion.
    gravity: Gravity,
    ideal: Option<Box<Ideal>>,
    /// Simulated time and seconds of stepping that it took, both fading.
    stepped: f64,
    stepping: f64,
}

/// What a single step is taken back to.
struct Before {
    state: Snapshot,
    /// Length of the log.
    entries: usize,
    record: Mark,
}

/// Keys of the solver that win over its preset.
const SOLVER_KEYS: [&str; 3] = ["solver.method", "solver.step", "solver.tolerance"];

/// Single steps that can be taken back.
const PAST: usize = 64;

/// Seconds of viewing that the automatic window of the plots shows.
const VIEWING: f64 = 5.0;

/// Seconds of stepping over which the capacity is averaged, and the fewest that say something.
const MEASURED: f64 = 0.3;
const LEAST_MEASURED: f64 = 1e-3;

/// Most instants recorded of one long step.
const MOST_RECORDED: f64 = 64.0;

/// What the interface says of a scene.
fn sentences(scene: &Scene) -> Vec<String> {
    let warnings = scene.warnings().into_iter();
    warnings.map(|warning| warning.to_string()).collect()
}

impl Player {
    /// Starts `scene` at t = 0, paused.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn new(scene: &Scene) -> Result<Self, StartError> {
        let simulation = Simulation::new(scene)?;
        // The text was read once already; should it no longer read, a control's default is its present value.
        let original = Scene::parse(&scene.source.text, scene.source.file.as_deref(), &[])
            .unwrap_or_else(|_| scene.clone());
        let channels = Channels::of(scene);
        let mut player = Self {
            pacer: Pacer::default(),
            clock: wall,
            original,
            warnings: sentences(scene),
            playing: false,
            stopped: None,
            frame: Frame::default(),
            peaks: Vec::new(),
            coming: Vec::new(),
            passed: Vec::new(),
            unchanged: None,
            history: record_of(scene, &channels),
            channels,
            recorded: Frame::default(),
            values: Vec::new(),
            settling: Settling::new(scene),
            paths: Paths::new(scene),
            past: VecDeque::new(),
            stepped: 0.0,
            stepping: 0.0,
            log: Log::new(&scene.changes),
            sections: None,
            watch: Watch::new(scene),
            twin: None,
            gravity: Gravity::new(scene.gravity),
            ideal: None,
            simulation,
        };
        player.start_record();
        Ok(player)
    }

    /// The simulation.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// The scene as the user wants it: with the changes that still wait for a reset.
    pub fn wanted(&self) -> &Scene {
        self.simulation.scene()
    }

    /// The scene as it runs.
    pub fn scene(&self) -> &Scene {
        self.simulation.running_scene()
    }

    /// What is on show.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Strongest instants since the frame before, per ball joint.
    pub fn peaks(&self) -> &[Peak] {
        &self.peaks
    }

    /// Which channels are recorded.
    pub fn channels(&self) -> &Channels {
        &self.channels
    }

    /// Where the record has the clearances of the ball joints, as they were in force.
    pub fn clearances(&self) -> std::ops::Range<usize> {
        self.channels.len()..self.history.channels()
    }

    /// The recorded past.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// Where the balls went lately.
    pub fn paths(&self) -> &Paths {
        &self.paths
    }

    /// What was done to the run since its start.
    pub fn log(&self) -> &Log {
        &self.log
    }

    /// What the chaos bench keeps of the run.
    pub fn watch(&self) -> &Watch {
        &self.watch
    }

    /// Another drive phase of the sections.
    pub fn set_phase(&mut self, phase: f64) {
        self.watch.set_phase(phase, self.pacer.shown());
    }

    /// The twin run, if there is one.
    pub fn twin(&self) -> Option<&Twin> {
        self.twin.as_deref()
    }

    /// Puts the ghosts where they are at the time on show.
    pub(super) fn place_ghost(&mut self) {
        if let Some(twin) = &mut self.twin {
            twin.place(self.pacer.shown());
        }
        if let Some(ideal) = &mut self.ideal {
            ideal.catch_up(self.pacer.shown(), &self.gravity, self.clock);
        }
    }

    /// The ideal motion, where it is on.
    pub fn ideal(&self) -> Option<&Ideal> {
        self.ideal.as_deref()
    }

    /// Whether the ideal motion is on its way to the instant on show.
    pub fn is_ideal_behind(&self) -> bool {
        let shown = self.pacer.shown();
        self.ideal().is_some_and(|ideal| ideal.is_behind(shown))
    }

    /// Has the ideal motion computed beside the run, or no longer. The run itself never changes by it.
    pub fn set_ideal(&mut self, on: bool) {
        self.ideal = on.then(|| Box::new(Ideal::new(self.simulation.running_scene())));
    }

    /// Starts a twin run from the present state, or ends it. The run itself never changes by it.
    ///
    /// # Errors
    /// The twin cannot start.
    pub fn set_twin(&mut self, on: bool) -> Result<(), StartError> {
        self.twin = None;
        if on {
            self.twin = Some(Box::new(Twin::new(&self.simulation)?));
        }
        Ok(())
    }

    /// The state changed by other means than a step.
    fn restart_twin(&mut self) {
        if self.twin.is_some() {
            // A scene that runs starts again.
            self.twin = Twin::new(&self.simulation).ok().map(Box::new);
        }
    }

    /// From now on steps end at the instants of `schedule`.
    pub(super) fn end_steps_at(&mut self, schedule: Schedule) {
        let event = Event::Sections {
            first: Number(schedule.first),
            interval: Number(schedule.interval),
            sections: schedule.sections as u64,
        };
        self.log.push(self.steps(), event);
        self.past.clear();
        self.sections = Some(schedule);
    }

    /// Instants of the schedule that are still to come.
    pub(super) fn sections_to_come(&self) -> usize {
        let now = self.simulation.time();
        self.sections
            .map_or(0, |schedule| schedule.sections - passed(&schedule, now))
    }

    /// Accepted steps since the start.
    pub fn steps(&self) -> u64 {
        self.simulation.statistics().steps
    }

    /// Length of the past that plots show unless told otherwise, s: some seconds of viewing.
    pub fn automatic_window(&self) -> f64 {
        VIEWING * self.pacer.scale()
    }

    /// Whether time passes.
    pub fn is_playing(&self) -> bool {
        self.playing
    }

    /// Lets time pass, or stand still. A stopped run does not start again before a reset.
    pub fn set_playing(&mut self, playing: bool) {
        self.playing = playing && self.stopped.is_none();
        if self.playing {
            self.past.clear();
            // The average of the reached speed starts anew.
            self.pacer.jump(self.pacer.shown());
        }
    }

    /// Why the divergence guard stopped the run.
    pub fn stopped(&self) -> Option<&Stopped> {
        self.stopped.as_ref()
    }

    /// Whether the motion relative to the drives has ended.
    pub fn has_settled(&self) -> bool {
        self.settling.has_settled()
    }

    /// Moves on by one frame that comes `dt` seconds after the last, and refreshes what is on show.
    pub fn advance(&mut self, dt: f64) {
        if self.playing {
            let target = self.pacer.begin(dt);
            let start = (self.clock)();
            let before = self.simulation.time();
            while self.simulation.time() < target && self.pacer.may_step((self.clock)() - start) {
                if !self.step() {
                    break;
                }
            }
            self.measure(self.simulation.time() - before, (self.clock)() - start);
            self.pacer.end(dt, target, self.simulation.time());
            self.present();
        }
        self.hand_out_peaks();
    }

    fn measure(&mut self, stepped: f64, stepping: f64) {
        let keep = libm::exp(-stepping / MEASURED);
        self.stepped = self.stepped * keep + stepped;
        self.stepping = self.stepping * keep + stepping;
    }

    /// Simulated seconds per second of stepping lately, the record included; `None` before enough was stepped.
    pub fn capacity(&self) -> Option<f64> {
        (self.stepping > LEAST_MEASURED).then(|| self.stepped / self.stepping)
    }

    /// One accepted step, shown at once.
    pub fn single_step(&mut self) {
        self.playing = false;
        if self.stopped.is_some() {
            return;
        }
        // Where the step begins, not the instant on show within the one before.
        self.record_until(self.simulation.time());
        if self.past.len() == PAST {
            self.past.pop_front();
        }
        self.past.push_back(Before {
            state: self.simulation.snapshot(),
            entries: self.log.entries.len(),
            record: self.history.mark(),
        });
        self.step();
        self.show_latest();
    }

    /// Takes the latest single step back; nothing where there is none.
    pub fn step_back(&mut self) {
        let Some(before) = self.past.pop_back() else {
            return;
        };
        self.playing = false;
        // A scene that has run once starts again.
        if self.simulation.restore(&before.state).is_ok() {
            self.stopped = None;
            self.unchanged = None;
            self.log.entries.truncate(before.entries);
            self.history.rewind(&before.record);
            self.forget_peaks();
            self.watch.back_to(self.simulation.time());
            self.settling = Settling::new(self.simulation.running_scene());
            self.restart_twin();
            self.show_latest();
        }
    }

    /// Pauses and runs on until `time`, s, whatever it takes: the start of a headless frame.
    pub fn run_to(&mut self, time: f64) {
        self.playing = false;
        self.past.clear();
        while self.simulation.time() < time && self.stopped.is_none() {
            self.step();
        }
        self.show(time);
    }

    /// One step towards an instant that a link names, with its record; false when the guard stopped the run.
    pub(super) fn replay_step(&mut self) -> bool {
        self.step()
    }

    /// Puts `time`, s, on show, as far as it lies in what is left of the latest step: no way leads back.
    pub(super) fn show(&mut self, time: f64) {
        let recorded = self.history.span().map_or(0.0, |(_, end)| end);
        let shown = time.max(recorded).min(self.simulation.time());
        self.pacer.jump(shown);
        self.present();
    }

    /// Back to t = 0 with every change applied.
    ///
    /// # Errors
    /// As [`Simulation::reset`]; nothing has changed then.
    pub fn reset(&mut self) -> Result<(), StartError> {
        self.simulation.reset()?;
        self.stopped = None;
        self.log = Log::new(&self.simulation.scene().changes);
        self.sections = None;
        self.watch.begin(self.simulation.running_scene(), 0.0);
        self.restart_twin();
        let channels = Channels::of(self.simulation.running_scene());
        if channels.list() != self.channels.list() {
            self.history = record_of(self.simulation.running_scene(), &channels);
            self.channels = channels;
        }
        self.start_record();
        Ok(())
    }

    /// Changes a parameter to a value as a user writes it.
    ///
    /// # Errors
    /// As [`Simulation::set`]; nothing has changed then.
    pub fn set(&mut self, key: &str, value: &str) -> Result<Effect, SceneError> {
        let effect = self.change(|run| run.set(key, value))?;
        self.log.set(self.steps(), key, value);
        if key == "solver.preset" {
            // Chosen here, a preset is to have effect: it replaces what was set by name before.
            for by_name in SOLVER_KEYS {
                self.simulation.set_value(by_name, &Value::Unset)?;
            }
        }
        self.after_change();
        Ok(effect)
    }

    /// Keys that the scene's file gives by name and that therefore win over any preset.
    pub fn beats_preset(&self) -> Vec<&'static str> {
        let places = &self.original.source.places;
        let given = |key: &&str| places.contains_key(*key);
        SOLVER_KEYS.into_iter().filter(given).collect()
    }

    /// Gives a parameter the value that the scene's file has.
    ///
    /// # Errors
    /// As [`Simulation::set_value`]; nothing has changed then.
    pub fn set_original(&mut self, key: &str) -> Result<Effect, SceneError> {
        let value = self.original.get(key)?;
        let effect = self.change(|run| run.set_value(key, &value))?;
        let event = Event::Original {
            key: key.to_owned(),
        };
        self.log.push(self.steps(), event);
        self.after_change();
        Ok(effect)
    }

    /// Changes the run at its latest state. What is left to show of the step before is shown as it was.
    fn change<T>(
        &mut self,
        change: impl FnOnce(&mut Simulation) -> Result<T, SceneError>,
    ) -> Result<T, SceneError> {
        let run = &mut self.simulation;
        if self.pacer.shown() >= run.time() || run.step_start() >= run.time() {
            return change(run);
        }
        let mut copy = match Simulation::new(run.running_scene()) {
            Ok(copy) => copy,
            // A scene that runs starts again; should it not, the rest of the step is left out.
            Err(_) => return change(run),
        };
        if copy.restore(&run.snapshot()).is_err() {
            return change(run);
        }
        let done = change(&mut copy)?;
        self.unchanged = Some(Box::new(std::mem::replace(run, copy)));
        Ok(done)
    }

    fn after_change(&mut self) {
        self.warnings = sentences(self.wanted());
        self.past.clear();
        self.watch
            .begin(self.simulation.running_scene(), self.simulation.time());
        self.settling = Settling::new(self.simulation.running_scene());
        self.restart_twin();
        self.present();
    }

    /// Whether `key` was changed and waits for a reset.
    pub fn is_waiting(&self, key: &str) -> bool {
        self.wanted().get(key).ok() != self.scene().get(key).ok()
    }

    /// Whether any change waits for a reset.
    pub fn has_waiting(&self) -> bool {
        self.wanted()
            .changes
            .iter()
            .any(|(key, _)| self.is_waiting(key))
    }

    /// What is allowed but may not mean what the user expects.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// What to know about the present value of `key`, if anything.
    pub fn warning(&self, key: &str) -> Option<&str> {
        let last = key.rsplit('.').next().unwrap_or(key);
        let of_joint = format!(": {last} ");
        let of_scene = format!("{key} ");
        self.warnings
            .iter()
            .find(|warning| warning.contains(&of_joint) || warning.starts_with(&of_scene))
            .map(String::as_str)
    }

    /// Value that the scene's file gives `key`.
    pub fn original(&self, key: &str) -> Option<Value> {
        self.original.get(key).ok()
    }

    /// One step, the rest of the one before recorded first; false when the guard stopped it.
    fn step(&mut self) -> bool {
        self.record_until(self.simulation.time());
        match self.simulation.step_until(self.next_section()) {
            Ok(()) => {
                self.unchanged = None;
                self.simulation.take_peaks(&mut self.coming);
                if let Some(twin) = &mut self.twin {
                    twin.follow(&self.simulation);
                }
                let (start, gravity) = (
                    self.simulation.step_start(),
                    self.simulation.running_scene().gravity,
                );
                if self.gravity.observe(start, gravity)
                    && let Some(ideal) = &mut self.ideal
                {
                    ideal.forget_after(start);
                }
                true
            }
            Err(stopped) => {
                self.playing = false;
                self.stopped = Some(stopped);
                self.log.push(self.steps(), Event::Stop);
                false
            }
        }
    }

    /// Where the next step ends at the latest, s.
    fn next_section(&self) -> f64 {
        let now = self.simulation.time();
        let schedule = self.sections.as_ref();
        schedule.map_or(f64::INFINITY, |schedule| match passed(schedule, now) {
            k if k < schedule.sections => schedule.time(k),
            _ => f64::INFINITY,
        })
    }

    /// The run that knows what was at `time`, s, in the latest step.
    fn run_at(&mut self, time: f64) -> &mut Simulation {
        match &mut self.unchanged {
            Some(run) if time < self.simulation.time() => run,
            _ => &mut self.simulation,
        }
    }

    /// Takes what the latest step did until `until`, s, into the record.
    fn record_until(&mut self, until: f64) {
        let Some((_, start)) = self.history.span() else {
            return;
        };
        if until > start {
            // A long step is recorded at instants within it, so that a curve stays one on a plot.
            let parts = ((until - start) / self.automatic_window() * 400.0)
                .ceil()
                .clamp(1.0, MOST_RECORDED);
            for part in 1..=parts as u32 {
                let end = if f64::from(part) == parts {
                    until
                } else {
                    start + (until - start) * f64::from(part) / parts
                };
                // A peak between two instants is one more.
                let close = end - 1e-3 * (end - start) / parts;
                while let Some(peak) = self.next_peak().filter(|peak| *peak < close) {
                    self.record(peak);
                    self.pass_peaks(peak);
                }
                self.record(end);
            }
        }
        self.pass_peaks(until);
        let run = match &mut self.unchanged {
            Some(run) => run,
            None => &mut self.simulation,
        };
        self.watch.step(run, until);
    }

    /// When the next peak comes, s.
    fn next_peak(&self) -> Option<f64> {
        let forces = self.coming.iter().filter(|peak| peak.normal > 0.0);
        forces.map(|peak| peak.time).min_by(f64::total_cmp)
    }

    fn record(&mut self, time: f64) {
        let mut frame = std::mem::take(&mut self.recorded);
        self.run_at(time).sample(time, &mut frame);
        self.channels.read(&frame, &mut self.values);
        let joints = frame.joints.iter().take(self.clearances().len());
        self.values.extend(joints.map(|joint| joint.clearance));
        for (joint, peak) in self.coming.iter().enumerate() {
            // The peak of the step is that of its cubic, not of the interpolated state.
            if peak.normal > 0.0
                && peak.time == time
                && let Some(channel) = self.channels.normal_force(joint)
            {
                self.values[channel] = peak.normal;
            }
        }
        if let Some(ideal) = &mut self.ideal {
            ideal.follow(time, &self.gravity);
            let error = ideal.output_error(&frame).map_or(f64::NAN, |e| e.norm());
            self.values[self.channels.tip_error()] = error;
        }
        self.history.push(time, &self.values);
        self.watch.record(&frame);
        self.settling.record(&frame);
        self.paths.record(&frame);
        self.recorded = frame;
    }

    /// Takes the peaks up to `time`, s, into the record and among those of the frame.
    fn pass_peaks(&mut self, time: f64) {
        self.passed.resize(self.coming.len(), Peak::default());
        let all = time >= self.simulation.time();
        for joint in 0..self.coming.len() {
            let peak = self.coming[joint];
            // A contact that began without a force yet began with the end of the step.
            if !all && (peak.normal <= 0.0 || peak.time > time) {
                continue;
            }
            self.coming[joint] = Peak::default();
            if peak.normal > 0.0
                && let Some(channel) = self.channels.normal_force(joint)
            {
                self.history.widen(peak.time, channel, peak.normal);
            }
            let passed = &mut self.passed[joint];
            let (impacts, speed) = (passed.impacts, passed.approach_speed);
            if peak.normal > passed.normal {
                *passed = peak;
            }
            passed.impacts = impacts + peak.impacts;
            passed.approach_speed = speed.max(peak.approach_speed);
        }
    }

    /// Peaks since the call before.
    fn hand_out_peaks(&mut self) {
        std::mem::swap(&mut self.peaks, &mut self.passed);
        self.passed.clear();
        self.passed.resize(self.peaks.len(), Peak::default());
    }

    fn forget_peaks(&mut self) {
        let joints = self.simulation.running_scene().ball_joints.len();
        for peaks in [&mut self.peaks, &mut self.coming, &mut self.passed] {
            peaks.clear();
            peaks.resize(joints, Peak::default());
        }
    }

    /// Records up to the instant on show and fills the frame with it.
    fn present(&mut self) {
        let shown = self.pacer.shown();
        self.record_until(shown);
        let mut frame = std::mem::take(&mut self.frame);
        self.run_at(shown).sample(shown, &mut frame);
        self.frame = frame;
    }

    fn show_latest(&mut self) {
        self.pacer.jump(self.simulation.time());
        self.present();
    }

    fn start_record(&mut self) {
        self.history.clear();
        self.past.clear();
        self.unchanged = None;
        self.settling = Settling::new(self.simulation.running_scene());
        self.paths = Paths::new(self.simulation.running_scene());
        self.gravity = Gravity::new(self.simulation.running_scene().gravity);
        self.set_ideal(self.ideal.is_some());
        // Forces at the start are those of the first frame: nothing has struck yet.
        self.simulation.take_peaks(&mut self.coming);
        self.forget_peaks();
        self.record(self.simulation.time());
        self.show_latest();
    }
}

/// An empty record of `channels` and of the clearances.
fn record_of(scene: &Scene, channels: &Channels) -> History {
    let joints = scene.ball_joints.len().min(RECORDED_JOINTS);
    History::new(channels.len() + joints, FINEST_BIN)
}

/// Instants of `schedule` up to `now`, s.
fn passed(schedule: &Schedule, now: f64) -> usize {
    let guess = ((now - schedule.first) / schedule.interval).floor();
    // Within one, whatever the rounding; a negative guess is 0.
    let mut k = (guess as usize).saturating_sub(1).min(schedule.sections);
    while k < schedule.sections && schedule.time(k) <= now {
        k += 1;
    }
    k
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::Quantity;

    fn player(scene: &str) -> Player {
        let scene = Scene::load(scene, &[]).expect("built in");
        Player::new(&scene).expect("starts")
    }

    fn recorded(player: &Player, quantity: Quantity, to: f64) -> Vec<[f64; 2]> {
        let list = player.channels().list();
        let channel = list
            .iter()
            .position(|c| c.quantity == quantity)
            .expect("recorded");
        let mut bins = Vec::new();
        player.history().bins(channel, 0.0, to, 400, &mut bins);
        let points = bins.iter().map(|b| [0.5 * (b.from + b.to), b.greatest]);
        points.collect()
    }

    #[test]
    fn the_record_holds_the_peak_of_an_impact_between_steps() {
        let mut player = player("spcmm");
        player.run_to(9e-3);
        player.advance(0.0);
        let points = recorded(&player, Quantity::NormalForce, 9e-3);
        let peak = points.iter().map(|p| p[1]).fold(0.0, f64::max);
        // Peak of the first impact of S1 (`tests/physics/reference.rs`); the live tolerance is coarser than the reference's.
        assert!((peak - 621.35).abs() < 0.005 * 621.35, "{peak}");
    }

    #[test]
    fn a_long_step_is_recorded_as_a_curve() {
        // Free fall: half an acceleration times time squared, in steps of milliseconds.
        let mut player = player("spcmm");
        player.run_to(7e-3);
        let points = recorded(&player, Quantity::Eccentricity, 7e-3);
        assert!(points.len() > 15, "{}", points.len());
        let last = points[points.len() - 1];
        for point in points {
            let fall = last[1] * (point[0] / last[0]).powi(2);
            assert!(
                (point[1] - fall).abs() < 0.03 * last[1],
                "{point:?}: {fall}"
            );
        }
    }

    /// The instant on show is that of frame, record, peaks and sections, whatever the run itself has computed beyond it.
    fn one_clock(player: &Player) {
        let shown = player.pacer.shown();
        assert_eq!(player.frame().time, shown);
        let (_, end) = player.history().span().expect("recorded");
        assert_eq!(end, shown);
        assert!(player.peaks().iter().all(|peak| peak.time <= shown));
        assert!(player.watch().orbit().all(|(time, _)| *time <= shown));
        assert!(player.watch().sections().all(|(time, _)| *time <= shown));
        assert!(player.simulation().time() >= shown);
    }

    #[test]
    fn nothing_tells_of_what_is_still_to_come() {
        let mut player = player("spcmm");
        one_clock(&player);
        player.pacer.set_scale(0.01);
        player.set_playing(true);
        let mut within = 0;
        for frame in 0..150 {
            player.advance(1.0 / 60.0);
            one_clock(&player);
            let far = player.simulation().time() - player.pacer.shown();
            within += usize::from(far > 1e-4);
            if frame == 60 {
                player.set_playing(false);
                player.advance(1.0 / 60.0);
                one_clock(&player);
                player.set_playing(true);
            }
        }
        assert!(within > 20, "in the midst of long steps: {within}");
        // Strictly after the peak of the second impact: the record has its top, and the last value is that on show.
        let forces = recorded(&player, Quantity::NormalForce, 1.0);
        let peak = player.simulation().statistics().peak_normal[0];
        let top = forces.iter().map(|p| p[1]).fold(0.0, f64::max);
        assert!((top / peak - 1.0).abs() < 1e-6, "{top} {peak}");
        for back in 0..6 {
            player.single_step();
            one_clock(&player);
            if back > 2 {
                player.step_back();
                one_clock(&player);
            }
        }
        player.run_to(0.2);
        one_clock(&player);
        player.reset().expect("starts");
        one_clock(&player);
        assert!(player.peaks().iter().all(|peak| *peak == Peak::default()));
        assert_eq!(player.history().rows(9).len(), 1);
    }

    #[test]
    fn after_steps_back_the_record_is_as_before_and_another_future_follows_it() {
        let mut player = player("spcmm");
        player.run_to(8.6e-3);
        player.single_step();
        let rows = player.history().rows(200);
        for _ in 0..40 {
            player.single_step();
        }
        assert!(player.history().rows(200) != rows);
        for _ in 0..40 {
            player.step_back();
        }
        assert!(player.history().rows(200) == rows);
        // A change takes nothing of the past away.
        player.set("contact.friction", "0.3").expect("in range");
        assert!(player.history().rows(200) == rows);
        player.run_to(12e-3);
        one_clock(&player);
        let forces = recorded(&player, Quantity::NormalForce, 8.6e-3);
        assert!(forces.iter().any(|point| point[1] > 300.0));
    }

    #[test]
    fn a_change_in_the_middle_of_a_step_leaves_the_rest_of_it_as_it_was() {
        let (mut player, mut other) = (player("spcmm"), player("spcmm"));
        for player in [&mut player, &mut other] {
            player.pacer.set_scale(0.005);
            player.set_playing(true);
            while player.simulation().time() < 2e-3 + player.pacer.shown() {
                player.advance(1.0 / 60.0);
            }
        }
        let change = player.simulation().time();
        player.set("contact.clearance", "0.6 mm").expect("in range");
        one_clock(&player);
        // The run goes on as if it had been changed there by itself.
        let mut straight = Simulation::new(other.scene()).expect("starts");
        straight
            .restore(&other.simulation().snapshot())
            .expect("the same scene");
        straight
            .set("contact.clearance", "0.6 mm")
            .expect("in range");
        assert_eq!(player.simulation().state_hash(), straight.state_hash());
        let mut frames = 0;
        loop {
            player.advance(1.0 / 60.0);
            other.advance(1.0 / 60.0);
            one_clock(&player);
            if player.pacer.shown() >= change {
                break;
            }
            frames += 1;
            assert_eq!(player.frame().pose, other.frame().pose);
            assert_eq!(player.frame().joints, other.frame().joints);
        }
        assert!(frames > 5, "{frames}");
        assert_eq!(player.frame().joints[0].clearance, 0.6e-3);
        let mut clearances = Vec::new();
        let channel = player.clearances().start;
        player
            .history()
            .bins(channel, 0.0, 1.0, 400, &mut clearances);
        let (first, last) = (clearances[0], clearances[clearances.len() - 1]);
        assert!((first.greatest - 0.3e-3).abs() < 1e-9 && (last.greatest - 0.6e-3).abs() < 1e-9);
    }

    #[test]
    fn a_window_that_was_hidden_for_minutes_goes_on_and_does_not_catch_up() {
        let mut player = player("spcmm");
        player.pacer.set_scale(0.02);
        player.set_playing(true);
        for _ in 0..30 {
            player.advance(1.0 / 60.0);
        }
        let (before, steps) = (player.pacer.shown(), player.steps());
        // Ten minutes at 1:50 would be 12 s of simulated time.
        player.advance(600.0);
        let leap = player.pacer.shown() - before;
        assert!(
            leap <= 0.02 * crate::simulate::LONGEST_FRAME + 1e-12,
            "{leap}"
        );
        assert!(player.steps() - steps < 20_000);
        let before = player.pacer.shown();
        for _ in 0..30 {
            player.advance(1.0 / 60.0);
        }
        let passed = player.pacer.shown() - before;
        assert!(passed <= 0.01 + 1e-9, "nothing is owed: {passed}");
        assert!(player.is_playing());
    }

    #[test]
    fn another_number_of_links_is_recorded_after_the_reset() {
        let mut player = player("chain");
        let before = player.channels().len();
        assert_eq!(
            player.set("chain.links", "3").expect("in range"),
            Effect::AtReset
        );
        assert!(player.is_waiting("chain.links") && player.has_waiting());
        assert_eq!(player.channels().len(), before);
        player.reset().expect("starts");
        assert!(!player.has_waiting());
        assert!(player.channels().len() < before);
        player.run_to(0.01);
        assert!(!recorded(&player, Quantity::NormalForce, 0.01).is_empty());
    }

    #[test]
    fn single_steps_are_taken_back_bit_by_bit() {
        let mut player = player("spcmm");
        player.run_to(8e-3);
        player.step_back();
        let mut hashes = Vec::new();
        for _ in 0..80 {
            hashes.push(player.simulation().state_hash());
            player.single_step();
        }
        let end = player.simulation().state_hash();
        for hash in hashes.iter().rev().take(PAST) {
            player.step_back();
            assert_eq!(player.simulation().state_hash(), *hash);
        }
        player.step_back();
        assert_eq!(player.simulation().state_hash(), hashes[80 - PAST]);
        for _ in 0..PAST {
            player.single_step();
        }
        assert_eq!(player.simulation().state_hash(), end);
        player.set("contact.friction", "0.3").expect("in range");
        player.step_back();
        assert_eq!(player.simulation().state_hash(), end);
    }

    #[test]
    fn a_preset_chosen_here_replaces_what_was_set_by_name() {
        let mut player = player("spcmm");
        player.set("solver.tolerance", "1e-9").expect("in range");
        player.set("solver.preset", "accurate").expect("a preset");
        let (_, _, tolerance) = crate::scene::Preset::Accurate.point();
        assert_eq!(player.wanted().solver.tolerance, tolerance);
        assert_eq!(player.scene().solver.tolerance, tolerance);
        player.set("solver.tolerance", "1e-9").expect("in range");
        assert_eq!(player.scene().solver.tolerance, 1e-9);
        assert!(player.beats_preset().is_empty());
    }

    #[test]
    fn a_refused_value_changes_nothing() {
        let mut player = player("spcmm");
        let before = player.wanted().contact;
        assert!(player.set("contact.clearance", "-1 mm").is_err());
        assert!(player.set("contact.clearence", "1 mm").is_err());
        assert_eq!(player.wanted().contact, before);
        player.set("contact.clearance", "0.7 mm").expect("in range");
        player
            .set_original("contact.clearance")
            .expect("the scene's own");
        assert_eq!(player.wanted().contact, before);
    }
}
