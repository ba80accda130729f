//! A running scene with its transport controls: playing, pacing, recording, peaks and warnings. No egui here.

pub mod contact_history;
pub mod impact_record;
mod keyframes;
#[cfg(test)]
mod tests;
mod travel;

use super::clock::{Clock, wall};
use super::ideal::{Gravity, Ideal};
use super::log::{Entry, Event, Log, Number};
use super::paths::Paths;
use super::settled::Settling;
use super::twin::Twin;
use super::watch::RunWatch;
use crate::analysis::presets::too_slow;
use crate::analysis::section::Schedule;
use crate::machine::Warning;
use crate::scene::{LiveScene, SOLVER_KEYS, Scene, SetError, Value};
use crate::simulate::{
    Channels, ContactMode, Effect, Frame, History, Limit, Listed, Pacer, Peak, Pull, RECORDED_JOINTS, Simulation,
    StartError, Stopped, Wear,
};
use contact_history::ContactHistory;
use impact_record::ImpactRecord;
use keyframes::Keyframes;
use travel::ImpactSearch;
pub use travel::{AbandonedFuture, Flag};

/// Narrowest bin of the record, s: shorter than any step that resolves an impact.
const FINEST_BIN: f64 = 2e-6;

/// A simulation and everything needed to play and plot it.
///
/// There is one displayed instant, the pacer's: frame, peaks, sections and link all refer to it. The simulation itself is ahead
/// by part of its latest step, which stays hidden until its time. The record extends as far as the run was ever shown
/// ([`Self::reached`]): a past instant is displayed by restoring a keyframe and repeating the same steps.
pub struct Player {
    /// How fast simulated time passes.
    pub pacer: Pacer,
    /// Clock that measures stepping time.
    pub clock: Clock,
    simulation: LiveScene,
    /// The run as it was before a change within the displayed step; samples that step up to the change.
    unchanged: Option<Box<LiveScene>>,
    /// The scene as loaded from its file.
    original: Scene,
    /// Warnings about settings that are valid but may surprise the user.
    warnings: Vec<Known>,
    playing: bool,
    /// Time runs backwards while it plays.
    backwards: bool,
    stopped: Option<Stopped>,
    frame: Frame,
    peaks: Vec<Peak>,
    /// Peaks of the latest step after the displayed instant.
    coming: Vec<Peak>,
    /// Peaks since the previous frame.
    passed: Vec<Peak>,
    channels: Channels,
    /// Name patterns of the picked channels.
    picks: Vec<String>,
    /// Record of the channels, then the clearance of each recorded ball joint, then the picked channels.
    history: History,
    /// Full-resolution record of the time window last retraced.
    near: Option<Box<History>>,
    contact_history: ContactHistory,
    impact_record: ImpactRecord,
    recorded: Frame,
    /// Time up to which the latest steps were recorded, s.
    recorded_to: f64,
    values: Vec<f64>,
    settling: Settling,
    paths: Paths,
    keyframes: Keyframes,
    /// Latest instant ever displayed, s, and largest number of steps taken.
    reached: f64,
    most_steps: u64,
    /// The future abandoned when the run branched from its past.
    left: Option<Box<AbandonedFuture>>,
    sought: Option<ImpactSearch>,
    /// Events since the start.
    log: Log,
    /// Parameter changes since the last `take_edits`.
    edits: Vec<Edit>,
    /// Whether to copy the run before a change; the key of the current gesture, which counts as one change; the latest copy
    /// with the key changed after it.
    keeps_before: bool,
    gesture: Option<String>,
    before: Option<(Box<Self>, String)>,
    /// Number of log entries before the displayed instant, and the time of every entry, s.
    applied: usize,
    event_times: Vec<f64>,
    /// Prescribed step ends.
    sections: Option<Schedule>,
    watch: RunWatch,
    twin: Option<Box<Twin>>,
    /// Gravity since the start, for the ideal motion.
    gravity: Gravity,
    ideal: Option<Box<Ideal>>,
    /// Simulated time and stepping time, s, as exponentially decaying sums.
    stepped: f64,
    stepping: f64,
}

/// A parameter change: value text before and after; `None` stands for the scene file's value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edit {
    /// Key.
    pub key: String,
    #[allow(missing_docs)]
    pub before: Option<String>,
    #[allow(missing_docs)]
    pub after: Option<String>,
}

/// Latest value text of `key` in `changes`.
fn changed(changes: &[(String, String)], key: &str) -> Option<String> {
    changes.iter().rev().find(|(other, _)| other == key).map(|(_, text)| text.clone())
}

/// Viewing time covered by the automatic plot window, s.
const VIEWING: f64 = 5.0;

/// Averaging time of the capacity, s of stepping, and the least that yields a value.
const MEASURED: f64 = 0.3;
const LEAST_MEASURED: f64 = 1e-3;

/// Most instants recorded within one step.
const MOST_RECORDED: f64 = 64.0;

/// A warning about a scene before it runs.
#[derive(Clone)]
struct Known {
    /// As [`Warning::key`].
    key: Option<&'static str>,
    sentence: String,
}

impl Known {
    /// All warnings about `scene`.
    fn of(scene: &Scene) -> Vec<Self> {
        let known = |warning: Warning| Self { key: warning.key(), sentence: warning.to_string() };
        let slow = too_slow(scene).map(|slow| Self { key: Some("solver.preset"), sentence: slow.to_string() });
        scene.machine.warnings().into_iter().map(known).chain(slow).collect()
    }

    /// Whether it concerns `key`, a parameter of the scene or of a ball joint.
    fn is_about(&self, key: &str) -> bool {
        let last = key.strip_prefix("contact.").or_else(|| key.strip_prefix("joint.")?.rsplit('.').next());
        self.key.is_some_and(|own| own == last.unwrap_or(key))
    }
}

impl Player {
    /// Starts `scene` at t = 0, paused.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn new(scene: &Scene) -> Result<Self, StartError> {
        let simulation = LiveScene::new(scene)?;
        // The text parsed before; if it fails now, a control's default is its present value.
        let original = Scene::parse_with(&scene.source.text, scene.source.file.as_deref(), &scene.source.beside, &[])
            .unwrap_or_else(|_| scene.clone());
        let channels = Channels::of(&scene.machine);
        let mut player = Self {
            pacer: Pacer::default(),
            clock: wall,
            original,
            warnings: Known::of(scene),
            playing: false,
            backwards: false,
            stopped: None,
            frame: Frame::default(),
            peaks: Vec::new(),
            coming: Vec::new(),
            passed: Vec::new(),
            unchanged: None,
            history: record_of(scene, &channels),
            near: None,
            contact_history: ContactHistory::default(),
            impact_record: ImpactRecord::default(),
            channels,
            picks: Vec::new(),
            recorded: Frame::default(),
            recorded_to: 0.0,
            values: Vec::new(),
            settling: Settling::new(scene),
            paths: Paths::new(scene),
            keyframes: Keyframes::default(),
            reached: 0.0,
            most_steps: 0,
            left: None,
            sought: None,
            applied: 0,
            event_times: Vec::new(),
            stepped: 0.0,
            stepping: 0.0,
            log: Log::new(&scene.changes),
            edits: Vec::new(),
            keeps_before: false,
            gesture: None,
            before: None,
            sections: None,
            watch: RunWatch::new(scene),
            twin: None,
            gravity: Gravity::new(scene.machine.gravity),
            ideal: None,
            simulation,
        };
        player.start_record();
        Ok(player)
    }

    /// A paused copy of the run and its record, without the twin, unaffected by later changes to this run.
    fn copy(&self) -> Self {
        let run = |run: &LiveScene| LiveScene::of(&run.snapshot());
        let scene = self.simulation.running();
        Self {
            pacer: self.pacer.clone(),
            clock: self.clock,
            simulation: run(&self.simulation),
            unchanged: self.unchanged.as_ref().map(|unchanged| Box::new(run(unchanged))),
            original: self.original.clone(),
            warnings: self.warnings.clone(),
            playing: false,
            backwards: false,
            stopped: self.stopped.clone(),
            frame: self.frame.clone(),
            peaks: self.peaks.clone(),
            coming: self.coming.clone(),
            passed: self.passed.clone(),
            channels: self.channels.clone(),
            picks: self.picks.clone(),
            history: self.history.clone(),
            near: self.near.clone(),
            contact_history: self.contact_history.clone(),
            impact_record: self.impact_record.clone(),
            recorded: self.recorded.clone(),
            recorded_to: self.recorded_to,
            values: self.values.clone(),
            settling: self.settling.clone(),
            paths: self.paths.clone(),
            keyframes: self.keyframes.copy(),
            reached: self.reached,
            most_steps: self.most_steps,
            left: None,
            sought: None,
            log: self.log.clone(),
            edits: Vec::new(),
            keeps_before: false,
            gesture: None,
            before: None,
            applied: self.applied,
            event_times: self.event_times.clone(),
            sections: self.sections,
            watch: self.watch.clone(),
            twin: None,
            gravity: self.gravity.clone(),
            ideal: self.ideal.is_some().then(|| Box::new(Ideal::new(&scene.machine))),
            stepped: self.stepped,
            stepping: self.stepping,
        }
    }

    /// Sets whether the run is copied before each parameter change, for [`Self::take_before`].
    pub(crate) fn keep_before(&mut self, on: bool) {
        self.keeps_before = on;
    }

    /// Ends the current gesture: the next change counts as a new one, even for the same parameter.
    pub(crate) fn end_gesture(&mut self) {
        self.gesture = None;
    }

    /// Takes the copy made before the latest parameter change, with the key; `None` if none was made since the last call.
    pub(crate) fn take_before(&mut self) -> Option<(Box<Self>, String)> {
        self.before.take()
    }

    /// Whether the whole record used the current parameters and no pull acted.
    pub(crate) fn is_as_started(&self) -> bool {
        self.log.entries.iter().all(|entry| entry.event == Event::Stop) && !self.has_waiting()
    }

    /// Displays `time`, s, stepping while `may_step`. Returns true once it is reached or the run cannot continue.
    pub(crate) fn follow(&mut self, time: f64, may_step: impl FnMut() -> bool) -> bool {
        if time <= self.reached {
            if time != self.pacer.shown() {
                self.go_to(time);
            }
            true
        } else {
            self.run_towards(time, may_step)
        }
    }

    /// Name patterns of the picked channels.
    pub(crate) fn picks(&self) -> &[String] {
        &self.picks
    }

    /// Copies the run before a change of `key`, if requested and not within the same gesture.
    fn before_change(&self, key: &str) -> Option<Box<Self>> {
        (self.keeps_before && self.gesture.as_deref() != Some(key)).then(|| Box::new(self.copy()))
    }

    /// Stores `before`, the copy made before `key` changed, unless the value is the same.
    fn changed_from(&mut self, before: Option<Box<Self>>, key: &str) {
        let changed = |before: &Self| before.pending().changes != self.pending().changes;
        if let Some(before) = before.filter(|before| changed(before)) {
            (self.before, self.gesture) = (Some((before, key.to_owned())), Some(key.to_owned()));
        }
    }

    /// The simulation.
    pub fn simulation(&self) -> &LiveScene {
        &self.simulation
    }

    /// The scene as the user wants it, including changes that still wait for a reset.
    pub fn pending(&self) -> &Scene {
        self.simulation.pending()
    }

    /// The scene as it runs.
    pub fn running(&self) -> &Scene {
        self.simulation.running()
    }

    /// The displayed frame.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Largest forces since the previous frame, per ball joint.
    pub fn peaks(&self) -> &[Peak] {
        &self.peaks
    }

    /// Which channels are recorded.
    pub fn channels(&self) -> &Channels {
        &self.channels
    }

    /// Record channels that hold the clearances of the ball joints over time.
    pub fn clearances(&self) -> std::ops::Range<usize> {
        self.channels.len()..self.history.channels() - self.channels.picked().len()
    }

    /// Record channels that hold the picked channels.
    pub fn picked(&self) -> std::ops::Range<usize> {
        self.clearances().end..self.history.channels()
    }

    /// Also records the channels that match `patterns`, from now on. Earlier picks that do not match are dropped.
    pub fn pick(&mut self, patterns: &[String]) {
        if self.picks == patterns {
            return;
        }
        self.picks = patterns.to_vec();
        let (first, channels) = (self.clearances().end, self.history.channels());
        let old = self.channels.clone();
        self.channels.pick(&self.simulation.running().machine, &self.frame, patterns);
        let place = |new: &Listed| {
            let same = |old: &Listed| old.column == new.column;
            old.picked().iter().position(same).map(|at| first + at)
        };
        let picked = self.channels.picked().iter().map(place);
        let from: Vec<Option<usize>> = (0..first).map(Some).chain(picked).collect();
        let left = self.left.as_mut().map(|left| &mut left.history);
        let near = self.near.as_deref_mut();
        for record in std::iter::once(&mut self.history).chain(near).chain(left) {
            *record = record.rearranged(&from);
        }
        self.keyframes.rearrange(channels, &from);
        self.channels.ask(&mut self.recorded);
        // New channels start at the displayed instant.
        let mut frame = std::mem::take(&mut self.recorded);
        let time = self.recorded_to;
        self.run_at(time).sample(time, &mut frame);
        self.read(&frame);
        self.recorded = frame;
        self.push(time);
    }

    /// The record of the run, as far as it was ever displayed.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// The recent paths of the balls.
    pub fn paths(&self) -> &Paths {
        &self.paths
    }

    /// Events from the start of the run to the displayed instant.
    pub fn log(&self) -> Log {
        let mut log = self.log.clone();
        log.entries.truncate(self.applied);
        log
    }

    /// Orbit and sections of the run for the chaos bench.
    pub fn watch(&self) -> &RunWatch {
        &self.watch
    }

    /// Wear of the sockets since the start, over the steps completed at the displayed instant.
    pub fn wear(&self) -> Option<&Wear> {
        self.simulation.wear()
    }

    /// Sets the drive phase of the sections.
    pub fn set_phase(&mut self, phase: f64) {
        self.watch.set_phase(phase, self.pacer.shown());
    }

    /// The twin run, if there is one.
    pub fn twin(&self) -> Option<&Twin> {
        self.twin.as_deref()
    }

    /// Moves the ghosts to the displayed instant.
    pub(crate) fn place_ghost(&mut self) {
        if let Some(twin) = &mut self.twin {
            twin.place(self.pacer.shown());
        }
        if let Some(ideal) = &mut self.ideal {
            ideal.catch_up(self.pacer.shown(), &self.gravity, self.clock);
        }
    }

    /// The ideal motion, if it is switched on.
    pub fn ideal(&self) -> Option<&Ideal> {
        self.ideal.as_deref()
    }

    /// Whether the ideal motion still has to reach the displayed instant.
    pub fn is_ideal_behind(&self) -> bool {
        let shown = self.pacer.shown();
        self.ideal().is_some_and(|ideal| ideal.is_behind(shown))
    }

    /// Switches the ideal motion on or off. This never affects the run itself.
    pub fn set_ideal(&mut self, on: bool) {
        self.ideal = on.then(|| Box::new(Ideal::new(&self.simulation.running().machine)));
    }

    /// Starts a twin run from the present state, or ends it. This never affects the run itself.
    pub fn set_twin(&mut self, on: bool) {
        self.twin = on.then(|| Box::new(Twin::new(&self.simulation)));
    }

    /// Restarts the twin from the present state.
    fn restart_twin(&mut self) {
        if let Some(twin) = &mut self.twin {
            twin.restart(&self.simulation);
        }
    }

    /// Makes steps end at the instants of `schedule` from now on.
    pub(crate) fn end_steps_at(&mut self, schedule: Schedule) {
        let event = Event::Sections {
            first: Number(schedule.first),
            interval: Number(schedule.interval),
            sections: schedule.sections as u64,
        };
        self.branch();
        self.sections = Some(schedule);
        self.note(event);
    }

    /// Logs an event at the present step.
    fn note(&mut self, event: Event) {
        self.log.push(self.steps(), event);
        self.event_times.push(self.simulation.time());
        self.applied = self.log.entries.len();
    }

    /// Number of scheduled instants still ahead.
    pub(crate) fn sections_to_come(&self) -> usize {
        let now = self.simulation.time();
        self.sections.map_or(0, |schedule| schedule.sections - schedule.passed(now))
    }

    /// Accepted steps since the start.
    pub fn steps(&self) -> u64 {
        self.simulation.statistics().steps
    }

    /// Default time window of the plots, s: a few seconds of viewing.
    pub fn automatic_window(&self) -> f64 {
        VIEWING * self.pacer.scale()
    }

    /// Whether the run is playing, in either direction.
    pub fn is_playing(&self) -> bool {
        self.playing
    }

    /// Plays or pauses. A stopped run resumes only after a reset or after going back in time.
    pub fn set_playing(&mut self, playing: bool) {
        self.set_paused();
        self.playing = playing && self.stopped.is_none();
        if self.playing {
            self.go_on();
            // Restart the average of the speed reached.
            self.pacer.jump(self.pacer.shown());
        }
    }

    /// Plays backwards, to the start.
    pub fn play_backwards(&mut self) {
        self.set_paused();
        self.playing = self.pacer.shown() > 0.0;
        self.backwards = self.playing;
        self.pacer.jump(self.pacer.shown());
    }

    /// Whether the run is playing backwards.
    pub fn is_playing_backwards(&self) -> bool {
        self.playing && self.backwards
    }

    /// Why the divergence guard stopped the run.
    pub fn stopped(&self) -> Option<&Stopped> {
        self.stopped.as_ref()
    }

    /// Whether the motion relative to the drives has ended.
    pub fn has_settled(&self) -> bool {
        self.settling.has_settled()
    }

    /// Advances by one frame, `dt` seconds after the last, and updates the display.
    pub fn advance(&mut self, dt: f64) {
        if let Some(sought) = self.sought {
            self.seek(sought);
        } else if self.is_playing_backwards() {
            let shown = self.pacer.shown();
            let ahead = self.pacer.begin(dt);
            self.travel(2.0 * shown - ahead);
            self.playing = self.pacer.shown() > 0.0;
        } else if self.playing {
            let target = self.pacer.begin(dt);
            let spent = self.pursue(target, Pacer::may_step);
            self.pacer.end(dt, target, self.simulation.time(), spent);
            self.present();
        }
        self.hand_out_peaks();
    }

    /// Steps for a while between two frames, `since` seconds after the first began. Returns whether the run is still behind;
    /// `None` if nothing remains to do before the next frame.
    pub fn step_between(&mut self, since: f64) -> Option<bool> {
        if !self.playing || self.backwards || self.sought.is_some() {
            return None;
        }
        let target = self.pacer.begin_between(since)?;
        let spent = self.pursue(target, Pacer::may_step_between);
        let before = self.pacer.shown();
        let (another, behind) = self.pacer.end_between(target, self.simulation.time(), spent);
        if self.pacer.shown() > before {
            self.present();
        }
        another.then_some(behind)
    }

    /// Steps to `target`, s, while the pacer allows it. Returns the time spent, s.
    fn pursue(&mut self, target: f64, may_step: fn(&Pacer, f64) -> bool) -> f64 {
        if self.simulation.time() >= target {
            return 0.0;
        }
        let (start, before) = ((self.clock)(), self.simulation.time());
        while self.simulation.time() < target && may_step(&self.pacer, (self.clock)() - start) {
            if !self.step() {
                break;
            }
        }
        let spent = (self.clock)() - start;
        self.measure(self.simulation.time() - before, spent);
        spent
    }

    fn measure(&mut self, stepped: f64, stepping: f64) {
        let keep = libm::exp(-stepping / MEASURED);
        self.stepped = self.stepped * keep + stepped;
        self.stepping = self.stepping * keep + stepping;
    }

    /// Recent simulated seconds per second of stepping, recording included; `None` until enough steps were measured.
    pub fn capacity(&self) -> Option<f64> {
        (self.stepping > LEAST_MEASURED).then(|| self.stepped / self.stepping)
    }

    /// What holds the run below the requested time scale; `None` while it keeps up.
    pub fn limit(&self) -> Option<Limit> {
        self.pacer.limit(self.capacity())
    }

    /// Part of the latest frame of `dt` s not spent stepping, s.
    pub fn drawing(&self, dt: f64) -> f64 {
        if self.playing && !self.backwards { self.pacer.drawing() } else { dt }
    }

    /// Takes one accepted step and displays its end.
    pub fn single_step(&mut self) {
        self.set_playing(false);
        if self.stopped.is_some() {
            return;
        }
        self.go_on();
        // Record to the start of the new step, not only to the displayed instant within the previous one.
        self.record_until(self.simulation.time());
        self.step();
        self.show_latest();
    }

    /// Pauses and steps to `time`, s, without a time budget: the start of a headless frame.
    pub fn run_to(&mut self, time: f64) {
        self.run_towards(time, || true);
    }

    /// The same while `may_step`. Returns true once `time` is reached or the run cannot continue.
    pub fn run_towards(&mut self, time: f64, mut may_step: impl FnMut() -> bool) -> bool {
        self.set_playing(false);
        self.go_on();
        let mut goes = true;
        while goes && self.simulation.time() < time && self.stopped.is_none() {
            goes = may_step();
            if goes {
                self.step();
            }
        }
        self.show(time);
        goes
    }

    /// Displays `time`, s, clamped to the rest of the latest step: this never goes back.
    pub(crate) fn show(&mut self, time: f64) {
        let shown = time.max(self.recorded_to).min(self.simulation.time());
        self.pacer.jump(shown);
        self.present();
    }

    /// Back to t = 0 with every change applied.
    ///
    /// # Errors
    /// As [`LiveScene::reset`]; the run is left unchanged.
    pub fn reset(&mut self) -> Result<(), StartError> {
        self.simulation.reset()?;
        self.stopped = None;
        self.log = Log::new(&self.simulation.pending().changes);
        self.sections = None;
        self.watch.begin(self.simulation.running(), 0.0);
        self.restart_twin();
        let mut first = Frame::default();
        if !self.picks.is_empty() {
            self.simulation.sample(0.0, &mut first);
        }
        let scene = self.simulation.running();
        let mut channels = Channels::of(&scene.machine);
        channels.pick(&scene.machine, &first, &self.picks);
        if channels.list() != self.channels.list() || channels.picked().len() != self.channels.picked().len() {
            self.history = record_of(scene, &channels);
        }
        channels.ask(&mut self.recorded);
        self.channels = channels;
        self.start_record();
        Ok(())
    }

    /// Changes a parameter to a value as a user writes it.
    ///
    /// # Errors
    /// As [`LiveScene::set`]; the run is left unchanged.
    pub fn set(&mut self, key: &str, value: &str) -> Result<Effect, SetError> {
        let run_before = self.before_change(key);
        if self.has_future() {
            // A refused change must not abandon the future.
            self.pending().clone().set(key, value)?;
            self.branch();
        }
        let before = self.pending().changes.clone();
        let event = Event::set(key, value);
        let effect = self.apply(&event)?;
        self.note(event);
        self.note_edits(&before);
        self.changed_from(run_before, key);
        Ok(effect)
    }

    /// Records the edits relative to the changes `before`.
    fn note_edits(&mut self, before: &[(String, String)]) {
        let after = &self.simulation.pending().changes;
        for (key, _) in before.iter().chain(after) {
            let (old, new) = (changed(before, key), changed(after, key));
            if old == new {
                continue;
            }
            match self.edits.iter_mut().find(|edit| edit.key == *key) {
                Some(edit) => edit.after = new,
                None => self.edits.push(Edit { key: key.clone(), before: old, after: new }),
            }
        }
    }

    /// Changes of parameters by the user since the last call.
    pub(crate) fn take_edits(&mut self) -> Vec<Edit> {
        std::mem::take(&mut self.edits)
    }

    /// Restores `key` to the value `text`, or to the scene file's value if `None`.
    ///
    /// # Errors
    /// As [`Self::set`].
    pub(crate) fn put_back(&mut self, key: &str, text: Option<&str>) -> Result<(), SetError> {
        if changed(&self.pending().changes, key).as_deref() == text {
            return Ok(());
        }
        match text {
            Some(text) => self.set(key, text).map(|_| ()),
            None => self.set_original(key).map(|_| ()),
        }
    }

    /// Applies a change at the latest state. The rest of the latest step is still displayed as computed.
    fn apply(&mut self, event: &Event) -> Result<Effect, SetError> {
        let Self { simulation: run, unchanged, original, pacer, .. } = self;
        let effect = if pacer.shown() >= run.time() || run.step_start() >= run.time() {
            event.apply(run, original)?
        } else {
            let mut copy = LiveScene::of(&run.snapshot());
            let effect = event.apply(&mut copy, original)?;
            *unchanged = Some(Box::new(std::mem::replace(run, copy)));
            effect
        };
        self.after_change();
        Ok(effect)
    }

    /// Keys that the scene's file sets by name and that therefore override any preset.
    pub fn keys_overriding_preset(&self) -> Vec<&'static str> {
        let places = &self.original.source.places;
        let given = |key: &&str| places.contains_key(*key);
        SOLVER_KEYS.into_iter().filter(given).collect()
    }

    /// Resets a parameter to its value in the scene file.
    ///
    /// # Errors
    /// As [`LiveScene::set_value`]; the run is left unchanged.
    pub fn set_original(&mut self, key: &str) -> Result<Effect, SetError> {
        self.original.get(key)?;
        let run_before = self.before_change(key);
        self.branch();
        let before = self.pending().changes.clone();
        let event = Event::Original { key: key.to_owned() };
        let effect = self.apply(&event)?;
        self.note(event);
        self.note_edits(&before);
        self.changed_from(run_before, key);
        Ok(effect)
    }

    /// Starts, changes or ends a pull on a body.
    ///
    /// # Errors
    /// As [`Simulation::pull`]; the run is left unchanged.
    pub fn pull(&mut self, pull: Option<Pull>) -> Result<(), SetError> {
        if self.simulation.pulled() == pull {
            return Ok(());
        }
        pull.map_or(Ok(()), |pull| self.simulation.check_pull(&pull))?;
        self.branch();
        // Only the last of several moves between two steps counts.
        let steps = self.steps();
        let moved = |entry: &Entry| entry.steps == steps && matches!(entry.event, Event::Pull(Some(_)));
        if pull.is_some() && self.log.entries.last().is_some_and(moved) {
            self.log.entries.pop();
            self.event_times.pop();
        }
        let event = Event::Pull(pull.map(Into::into));
        self.apply(&event)?;
        self.note(event);
        Ok(())
    }

    fn after_change(&mut self) {
        self.warnings = Known::of(self.pending());
        self.watch.begin(self.simulation.running(), self.simulation.time());
        self.settling = Settling::new(self.simulation.running());
        // While the run is retraced, the twin may begin later than now.
        let now = self.simulation.time();
        if self.twin.as_ref().is_some_and(|twin| twin.begins() <= now) {
            self.restart_twin();
        }
        self.present();
    }

    /// Whether `key` was changed and waits for a reset.
    pub fn is_waiting(&self, key: &str) -> bool {
        self.pending().get(key).ok() != self.running().get(key).ok()
    }

    /// Whether any change waits for a reset.
    pub fn has_waiting(&self) -> bool {
        self.pending().changes.iter().any(|(key, _)| self.is_waiting(key))
    }

    /// Warnings, as sentences, about settings that are valid but may surprise the user.
    pub fn warnings(&self) -> impl Iterator<Item = &str> {
        self.warnings.iter().map(|known| &*known.sentence)
    }

    /// Warning about the present value of `key`, if any.
    pub fn warning(&self, key: &str) -> Option<&str> {
        self.warnings.iter().find(|known| known.is_about(key)).map(|known| &*known.sentence)
    }

    /// Value of `key` in the scene file.
    pub fn original(&self, key: &str) -> Option<Value> {
        self.original.get(key).ok()
    }

    /// Records the rest of the previous step and takes one step; false if the divergence guard stopped it.
    pub(crate) fn step(&mut self) -> bool {
        self.record_until(self.simulation.time());
        self.keep();
        let end = self.next_section();
        match self.simulation.step_until(end) {
            Ok(()) => {
                self.unchanged = None;
                self.simulation.take_peaks(&mut self.coming);
                self.impact_record.record(&mut self.simulation, &self.coming);
                if let Some(twin) = &mut self.twin {
                    twin.follow(&self.simulation);
                }
                let (start, gravity) = (self.simulation.step_start(), self.simulation.running().machine.gravity);
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
                match self.log.entries.get(self.applied) {
                    // Retraced: the stop is already in the log.
                    Some(entry) if entry.event == Event::Stop => self.applied += 1,
                    _ => self.note(Event::Stop),
                }
                false
            }
        }
    }

    /// Latest end of the next step, s.
    fn next_section(&self) -> f64 {
        self.sections.map_or(f64::INFINITY, |schedule| schedule.next(self.simulation.time()))
    }

    /// The run to sample at `time`, s, within the latest step.
    fn run_at(&mut self, time: f64) -> &mut Simulation {
        match &mut self.unchanged {
            Some(run) if time < self.simulation.time() => run,
            _ => &mut self.simulation,
        }
    }

    /// Records the latest step up to `until`, s.
    fn record_until(&mut self, until: f64) {
        let start = self.recorded_to;
        if until > start {
            // A long step is also recorded at instants within it, so that plots stay smooth.
            let parts = ((until - start) / self.automatic_window() * 400.0).ceil().clamp(1.0, MOST_RECORDED);
            for part in 1..=parts as u32 {
                let end =
                    if f64::from(part) == parts { until } else { start + (until - start) * f64::from(part) / parts };
                // A peak between two instants adds another instant.
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

    /// Time of the next peak, s.
    fn next_peak(&self) -> Option<f64> {
        let forces = self.coming.iter().filter(|peak| peak.normal > 0.0);
        forces.map(|peak| peak.time).min_by(f64::total_cmp)
    }

    fn record(&mut self, time: f64) {
        let mut frame = std::mem::take(&mut self.recorded);
        self.run_at(time).sample(time, &mut frame);
        self.read(&frame);
        for (joint, peak) in self.coming.iter().enumerate() {
            // The peak comes from the cubic of the step, not from the interpolated state.
            if peak.normal > 0.0
                && peak.time == time
                && let Some(channel) = self.channels.normal_force(joint)
            {
                self.values[channel] = peak.normal;
            }
        }
        self.recorded_to = time;
        if let Some(ideal) = &mut self.ideal {
            ideal.follow(time, &self.gravity);
            let error = ideal.output_error(&frame).map_or(f64::NAN, |e| e.norm());
            self.values[self.channels.tip_error()] = error;
        }
        self.push(time);
        self.contact_history.record(&frame);
        self.watch.record(&frame);
        self.settling.record(&frame);
        self.paths.record(&frame);
        self.recorded = frame;
    }

    /// Reads the recorded channels of `frame`.
    fn read(&mut self, frame: &Frame) {
        self.channels.read(frame, &mut self.values);
        let joints = frame.joints.iter().take(self.clearances().len());
        self.values.extend(joints.map(|joint| joint.clearance));
        self.channels.read_picked(frame, &mut self.values);
    }

    /// Appends the values read at `time`, s, to the record.
    fn push(&mut self, time: f64) {
        self.history.push(time, &self.values);
        if let Some(near) = &mut self.near {
            near.push(time, &self.values);
        }
    }

    /// Adds the peaks up to `time`, s, to the record and to the frame's peaks.
    fn pass_peaks(&mut self, time: f64) {
        self.passed.resize(self.coming.len(), Peak::default());
        let all = time >= self.simulation.time();
        if all {
            self.simulation.commit_wear();
        }
        for joint in 0..self.coming.len() {
            let peak = self.coming[joint];
            // A contact that carries no force yet began at the end of the step.
            if !all && (peak.normal <= 0.0 || peak.time > time) {
                continue;
            }
            self.coming[joint] = Peak::default();
            if peak.normal > 0.0
                && let Some(channel) = self.channels.normal_force(joint)
            {
                for record in std::iter::once(&mut self.history).chain(self.near.as_deref_mut()) {
                    record.widen(peak.time, channel, peak.normal);
                }
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

    /// Hands out the peaks since the previous call.
    pub(crate) fn hand_out_peaks(&mut self) {
        std::mem::swap(&mut self.peaks, &mut self.passed);
        self.passed.clear();
        self.passed.resize(self.peaks.len(), Peak::default());
    }

    fn forget_peaks(&mut self) {
        let joints = self.simulation.running().machine.ball_joints.len();
        for peaks in [&mut self.peaks, &mut self.coming, &mut self.passed] {
            peaks.clear();
            peaks.resize(joints, Peak::default());
        }
    }

    /// Records up to the displayed instant and samples the frame there.
    fn present(&mut self) {
        let shown = self.pacer.shown();
        self.record_until(shown);
        self.reached = self.reached.max(shown);
        self.watch.show(shown);
        let mut frame = std::mem::take(&mut self.frame);
        self.run_at(shown).sample(shown, &mut frame);
        // The hand is shown at its current position, although it acts only from the next step on.
        frame.pull = self.simulation.pull_in(&frame);
        if !self.playing && self.unchanged.is_some() {
            self.show_changed_clearances(&mut frame);
        }
        self.frame = frame;
    }

    /// Shows balls in flight with a clearance changed during a pause, although the run uses it only from its next step on.
    fn show_changed_clearances(&mut self, frame: &mut Frame) {
        let mut next = Frame::default();
        let time = self.simulation.time();
        self.simulation.sample(time, &mut next);
        let pairs = frame.joints.iter_mut().zip(&next.joints);
        for (own, next) in pairs.filter(|(own, _)| own.state == ContactMode::Free) {
            own.penetration += own.clearance - next.clearance;
            own.clearance = next.clearance;
        }
    }

    fn show_latest(&mut self) {
        self.pacer.jump(self.simulation.time());
        self.present();
    }

    fn start_record(&mut self) {
        self.history.clear();
        self.clear_rewind();
        self.unchanged = None;
        self.settling = Settling::new(self.simulation.running());
        self.paths = Paths::new(self.simulation.running());
        self.gravity = Gravity::new(self.simulation.running().machine.gravity);
        self.set_ideal(self.ideal.is_some());
        self.simulation.keep_wear();
        // Forces at the start belong to the first frame: there has been no impact yet.
        self.simulation.take_peaks(&mut self.coming);
        self.impact_record.begin(&self.coming);
        self.forget_peaks();
        self.record(self.simulation.time());
        self.keep();
        self.show_latest();
    }
}

/// An empty record of `channels`, the clearances and the picked channels.
fn record_of(scene: &Scene, channels: &Channels) -> History {
    let joints = scene.machine.ball_joints.len().min(RECORDED_JOINTS);
    let picked = channels.picked().len();
    History::new(channels.len() + joints + picked, FINEST_BIN)
}
