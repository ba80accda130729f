//! A running scene with its transport controls: playing, pacing, recording, peaks and warnings. No egui here.

mod before_change;
pub mod contact_history;
pub mod impact_record;
mod keyframes;
mod record;
#[cfg(test)]
mod tests;
mod travel;

use super::advice::{self, Advice};
use super::clock::{Clock, wall};
use super::friction::FrictionRecord;
use super::goal::Goal;
use super::history::History;
use super::ideal::{AppliedHistory, Ideal};
use super::log::{Entry, Event, Log, Script};
use super::pace::{Limit, Pacer};
use super::paths::Paths;
use super::settled::Settling;
use super::twin::Twin;
use super::watch::RunWatch;
use super::worn::WearWatch;
use crate::machine::AppliedForces;
use crate::scene::{LiveScene, Scene, SetError, Value};
use crate::simulate::{
    ChannelInfo, Channels, ContactMode, Effect, Frame, Peak, Pull, Simulation, StartError, Stopped, Wear,
};
use before_change::BeforeChange;
use keyframes::Keyframes;
pub use record::FINEST_BIN;
use record::Record;
use travel::ImpactSearch;
pub use travel::{AbandonedFuture, Flag};

/// A simulation and everything needed to play and plot it.
///
/// There is one displayed instant, the pacer's: frame, peaks, sections and link all refer to it. The simulation itself is ahead
/// by part of its latest step, which stays hidden until its time. The record extends as far as the run was ever shown
/// ([`Self::reached`]): a past instant is displayed by restoring a keyframe and repeating the same steps.
#[derive(Clone)]
pub struct Player {
    /// How fast simulated time passes.
    pub pacer: Pacer,
    /// Length of the plots' time axis, s.
    pub(crate) plotted: f64,
    /// Clock that measures stepping time.
    pub clock: Clock,
    simulation: LiveScene,
    /// The run as it was before a change within the displayed step; samples that step up to the change.
    unchanged: Option<Box<LiveScene>>,
    /// The scene as loaded from its file.
    original: Scene,
    /// Warnings about settings that are valid but may surprise the user.
    warnings: Vec<Advice>,
    playing: bool,
    /// Time runs backwards while it plays.
    backwards: bool,
    stopped: Option<Stopped>,
    frame: Frame,
    record: Record,
    keyframes: Keyframes,
    /// Latest instant ever displayed, s, and largest number of steps taken.
    reached: f64,
    most_steps: u64,
    /// The future abandoned when the run branched from its past.
    abandoned: Option<Box<AbandonedFuture>>,
    impact_search: Option<ImpactSearch>,
    /// Events since the start, and those ahead of the displayed instant.
    script: Script,
    /// Parameter changes since the last `take_edits`.
    edits: Vec<Edit>,
    before_change: BeforeChange,
    twin: Option<Box<Twin>>,
    /// Gravity and force elements since the start, for the ideal motion.
    forces: AppliedHistory,
    /// The ideal motion, while it is shown or its distance from the run is recorded.
    ideal: Option<Box<Ideal>>,
    shows_ideal: bool,
    records_tip_error: bool,
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
fn changed_value(changes: &[(String, String)], key: &str) -> Option<String> {
    changes.iter().rev().find(|(other, _)| other == key).map(|(_, text)| text.clone())
}

/// Distance of a play from its setting below which it is not said, m.
const NOTICEABLE: f64 = 5e-7;

/// Viewing time covered by the automatic plot window, s.
const VIEWING_TIME: f64 = 5.0;

/// Averaging time of the capacity, s of stepping, and the shortest measured time that yields a value.
const AVERAGING_TIME: f64 = 0.3;
const MIN_AVERAGING_TIME: f64 = 1e-3;

/// Largest number of instants recorded within one step.
const MAX_RECORDED_PER_STEP: f64 = 64.0;

impl Player {
    /// Starts `scene` at t = 0, paused.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn new(scene: &Scene) -> Result<Self, StartError> {
        // The text alone has been valid before. Should it fail now, the default of a control is its current value.
        let original = scene.with_changes(&[]).unwrap_or_else(|_| scene.clone());
        let mut player = Self::with_simulation(LiveScene::new(scene)?, original);
        player.start();
        Ok(player)
    }

    /// A paused run without any record yet.
    fn with_simulation(simulation: LiveScene, original: Scene) -> Self {
        let scene = simulation.running();
        Self {
            pacer: Pacer::default(),
            plotted: f64::INFINITY,
            clock: wall,
            original,
            warnings: advice::of(scene),
            playing: false,
            backwards: false,
            stopped: None,
            frame: Frame::default(),
            unchanged: None,
            record: Record::new(scene),
            keyframes: Keyframes::default(),
            reached: 0.0,
            most_steps: 0,
            abandoned: None,
            impact_search: None,
            stepped: 0.0,
            stepping: 0.0,
            script: Script::new(Log::new(&scene.changes)),
            edits: Vec::new(),
            before_change: BeforeChange::default(),
            twin: None,
            forces: AppliedHistory::new(AppliedForces::of(&scene.machine)),
            ideal: None,
            shows_ideal: false,
            records_tip_error: false,
            simulation,
        }
    }

    /// Name patterns of the picked channels.
    pub fn picks(&self) -> &[String] {
        &self.record.picks
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

    /// Largest forces since the previous frame, per joint with play.
    pub fn peaks(&self) -> &[Peak] {
        &self.record.peaks
    }

    /// Which channels are recorded.
    pub fn channels(&self) -> &Channels {
        &self.record.channels
    }

    /// Record channels that hold the clearances of the joints with play over time.
    pub fn clearances(&self) -> std::ops::Range<usize> {
        self.record.channels.len()..self.record.history.channels() - self.record.channels.picked().len()
    }

    /// Record channels that hold the picked channels.
    pub fn picked(&self) -> std::ops::Range<usize> {
        self.clearances().end..self.record.history.channels()
    }

    /// Also records the channels that match `patterns`, from now on. Earlier picks that do not match are dropped.
    pub fn pick(&mut self, patterns: &[String]) {
        if self.record.picks == patterns {
            return;
        }
        self.record.picks = patterns.to_vec();
        let (first, channels) = (self.clearances().end, self.record.history.channels());
        let old = self.record.channels.clone();
        self.record.channels.pick(&self.simulation.running().machine, &self.frame, patterns);
        let old_index = |new: &ChannelInfo| {
            let same = |old: &ChannelInfo| old.column == new.column;
            old.picked().iter().position(same).map(|at| first + at)
        };
        let picked = self.record.channels.picked().iter().map(old_index);
        let from: Vec<Option<usize>> = (0..first).map(Some).chain(picked).collect();
        let abandoned = self.abandoned.as_mut().map(|future| &mut future.history);
        let detailed = self.record.detailed.as_deref_mut();
        for record in std::iter::once(&mut self.record.history).chain(detailed).chain(abandoned) {
            *record = record.rearranged(&from);
        }
        self.keyframes.rearrange(channels, &from);
        self.record.channels.request(&mut self.record.recorded);
        // New channels start at the displayed instant.
        self.record_at(self.record.recorded_to);
    }

    /// The record of the run, as far as it was ever displayed.
    pub fn history(&self) -> &History {
        &self.record.history
    }

    /// The recent paths of the parts of joints with play.
    pub fn paths(&self) -> &Paths {
        &self.record.paths
    }

    /// The recent friction at the contacts of joints with play.
    pub fn friction(&self) -> &FrictionRecord {
        &self.record.friction
    }

    /// Events from the start of the run to the displayed instant.
    pub fn log(&self) -> Log {
        self.script.past()
    }

    /// Orbit and sections of the run for the chaos bench.
    pub fn watch(&self) -> &RunWatch {
        &self.record.watch
    }

    /// Wear of the sockets since the start, over the steps completed at the displayed instant.
    pub fn wear(&self) -> Option<&Wear> {
        self.simulation.wear()
    }

    /// Growth of both plays of each joint by wear, m/s, over the last full period of the drives before the displayed instant, without a
    /// periodic drive over the last full second; `None` if there is none since the start or the latest change.
    pub fn wear_rates(&self) -> Option<Vec<[f64; 2]>> {
        self.record.worn.rates(self.pacer.shown())
    }

    /// Sets the drive phase of the sections.
    pub fn set_phase(&mut self, phase: f64) {
        self.record.watch.set_phase(phase, self.pacer.shown());
    }

    /// The twin run, if there is one.
    pub fn twin(&self) -> Option<&Twin> {
        self.twin.as_deref()
    }

    /// Moves the ghosts to the displayed instant.
    pub fn update_ghosts(&mut self) {
        if let Some(twin) = &mut self.twin {
            twin.move_to(self.pacer.shown());
        }
        if let Some(ideal) = &mut self.ideal {
            // The record has sampled it at its end, unless it lags behind.
            let time = if self.shows_ideal { self.pacer.shown() } else { self.record.recorded_to };
            ideal.catch_up(time, &self.forces, self.clock);
        }
    }

    /// The ideal motion, if it is shown.
    pub fn ideal(&self) -> Option<&Ideal> {
        self.ideal.as_deref().filter(|_| self.shows_ideal)
    }

    /// Whether the ideal motion still has to reach the displayed instant.
    pub fn is_ideal_behind(&self) -> bool {
        let shown = self.pacer.shown();
        self.ideal().is_some_and(|ideal| ideal.is_behind(shown))
    }

    /// Shows the ideal motion or hides it. This never affects the run itself.
    pub fn set_ideal(&mut self, on: bool) {
        self.shows_ideal = on;
        self.run_ideal();
    }

    /// Records the distance of the output point from its ideal motion, or stops. This never affects the run itself.
    pub fn record_tip_error(&mut self, on: bool) {
        self.records_tip_error = on;
        self.run_ideal();
    }

    /// Whether [`Self::record_tip_error`] is on.
    pub fn records_tip_error(&self) -> bool {
        self.records_tip_error
    }

    fn run_ideal(&mut self) {
        if !(self.shows_ideal || self.records_tip_error) {
            self.ideal = None;
        } else if self.ideal.is_none() {
            self.ideal = Some(Box::new(Ideal::new(&self.simulation.running().machine)));
        }
    }

    /// Starts a twin run from the current state, or ends it. This never affects the run itself.
    pub fn set_twin(&mut self, on: bool) {
        self.twin = on.then(|| Box::new(Twin::new(&self.simulation)));
    }

    /// Restarts the twin from the current state if `is_wrong` for its start, s.
    fn restart_twin(&mut self, is_wrong: impl Fn(f64) -> bool) {
        if let Some(twin) = self.twin.as_mut().filter(|twin| is_wrong(twin.start_time())) {
            twin.restart(&self.simulation);
        }
    }

    /// Adds events that [`Self::continue_to`] applies on its way.
    pub(crate) fn queue(&mut self, entries: impl IntoIterator<Item = Entry>) {
        self.script.queue(entries);
    }

    /// Drops the queued events that were not reached.
    pub fn drop_queued(&mut self) {
        self.script.drop_ahead();
    }

    /// Logs an event at the current step.
    fn log_event(&mut self, event: Event) {
        self.script.record(self.steps(), event, self.simulation.time());
    }

    /// Accepted steps since the start.
    pub fn steps(&self) -> u64 {
        self.simulation.statistics().steps
    }

    /// Default time window of the plots, s: a few seconds of viewing.
    pub fn automatic_window(&self) -> f64 {
        VIEWING_TIME * self.pacer.scale()
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
            self.resume();
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
        self.record.settling.has_settled()
    }

    /// Whether periodic drives move the machine.
    pub fn is_driven(&self) -> bool {
        self.record.settling.is_driven()
    }

    /// Advances by one frame, `dt` seconds after the last, and updates the display.
    pub fn advance(&mut self, dt: f64) {
        if let Some(impact_search) = self.impact_search {
            self.seek(impact_search);
        } else if self.is_playing_backwards() {
            let shown = self.pacer.shown();
            let ahead = self.pacer.begin(dt);
            self.travel(2.0 * shown - ahead);
            self.playing = self.pacer.shown() > 0.0;
        } else if self.playing {
            let target = self.pacer.begin(dt);
            let spent = self.step_within_budget(target, Pacer::may_step);
            self.pacer.end(dt, target, self.simulation.time(), spent);
            self.update_display();
        }
        self.publish_peaks();
    }

    /// Steps for a while between two frames, `since` seconds after the first began. Returns whether the run is still behind;
    /// `None` if nothing remains to do before the next frame.
    pub fn step_between(&mut self, since: f64) -> Option<bool> {
        if !self.playing || self.backwards || self.impact_search.is_some() {
            return None;
        }
        let target = self.pacer.begin_between(since)?;
        let spent = self.step_within_budget(target, Pacer::may_step_between);
        let before = self.pacer.shown();
        let (another, behind) = self.pacer.end_between(target, self.simulation.time(), spent);
        if self.pacer.shown() > before {
            self.update_display();
        }
        another.then_some(behind)
    }

    /// Steps to `target`, s, while the pacer allows it. Returns the time spent, s.
    fn step_within_budget(&mut self, target: f64, may_step: fn(&Pacer, f64) -> bool) -> f64 {
        if self.simulation.time() >= target {
            return 0.0;
        }
        let (start, before) = ((self.clock)(), self.simulation.time());
        let in_time = |player: &Self| may_step(&player.pacer, (player.clock)() - start);
        // A stop is displayed by the window.
        let _ = self.step_towards(target, |player| player.simulation.time() >= target, in_time);
        let spent = (self.clock)() - start;
        let decay = libm::exp(-spent / AVERAGING_TIME);
        self.stepped = self.stepped * decay + (self.simulation.time() - before);
        self.stepping = self.stepping * decay + spent;
        spent
    }

    /// Recent simulated seconds per second of stepping, recording included; `None` until enough steps were measured.
    pub fn capacity(&self) -> Option<f64> {
        (self.stepping > MIN_AVERAGING_TIME).then(|| self.stepped / self.stepping)
    }

    /// What limits the run to less than the requested time scale; `None` while it keeps up.
    pub fn limit(&self) -> Option<Limit> {
        self.pacer.limit(self.capacity())
    }

    /// Part of the latest frame of `dt` s not spent stepping, s.
    pub fn drawing(&self, dt: f64) -> f64 {
        if self.playing && !self.backwards { self.pacer.drawing() } else { dt }
    }

    /// Takes one accepted step and displays its end.
    pub fn single_step(&mut self) {
        self.set_paused();
        if self.stopped.is_none() {
            self.resume();
            let _ = self.continue_to(Goal::after(self.steps() + 1), || true);
        }
    }

    /// Pauses and steps to `time`, s, without a time budget: the start of a headless frame.
    pub fn run_to(&mut self, time: f64) {
        self.run_towards(time, || true);
    }

    /// As [`Self::run_to`], while `may_step`. Returns true once `time` is reached or the run cannot continue.
    pub fn run_towards(&mut self, time: f64, may_step: impl FnMut() -> bool) -> bool {
        self.set_paused();
        self.resume();
        self.continue_to(Goal::at(time), may_step) != Ok(false)
    }

    /// Restarts at t = 0 with every change applied.
    ///
    /// # Errors
    /// As [`Simulation::new`]; the run is left unchanged.
    pub fn reset(&mut self) -> Result<(), StartError> {
        let simulation = LiveScene::new(self.pending())?;
        // A new run with the same settings.
        let mut run = Self {
            pacer: self.pacer.clone(),
            plotted: self.plotted,
            clock: self.clock,
            playing: self.playing,
            backwards: self.backwards,
            edits: std::mem::take(&mut self.edits),
            before_change: std::mem::take(&mut self.before_change),
            stepped: self.stepped,
            stepping: self.stepping,
            ..Self::with_simulation(simulation, self.original.clone())
        };
        run.record.watch.set_phase(self.record.watch.phase(), 0.0);
        run.set_ideal(self.shows_ideal);
        run.record_tip_error(self.records_tip_error);
        run.set_twin(self.twin.is_some());
        run.start();
        run.pick(&self.record.picks);
        *self = run;
        Ok(())
    }

    /// Changes a parameter to a value as a user writes it.
    ///
    /// # Errors
    /// As [`LiveScene::set`]; the run is left unchanged.
    pub fn set(&mut self, key: &str, value: &str) -> Result<Effect, SetError> {
        if self.has_future() {
            // A refused change must not abandon the future.
            self.pending().with(key, value)?;
        }
        self.change(key, [Event::set(key, value)])
    }

    /// Changes several parameters as one change of `name`: to the values, as a user writes them, or where there is none to that of the
    /// scene file.
    ///
    /// # Errors
    /// As [`Self::set`]; nothing is changed then.
    pub fn set_all(&mut self, name: &str, values: &[(String, Option<String>)]) -> Result<(), SetError> {
        let mut scene = self.pending().clone();
        for (key, value) in values {
            match value {
                Some(value) => scene = scene.with(key, value)?,
                None => drop(scene.undo_change(key)?),
            }
        }
        let event = |(key, value): &(String, Option<String>)| match value {
            Some(value) => Event::set(key, value),
            None => Event::Original { key: key.clone() },
        };
        self.change(name, values.iter().map(event)).map(drop)
    }

    /// Records the edits relative to the changes `before`.
    fn record_edits(&mut self, before: &[(String, String)]) {
        let after = &self.simulation.pending().changes;
        for (key, _) in before.iter().chain(after) {
            let (old, new) = (changed_value(before, key), changed_value(after, key));
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
    pub fn take_edits(&mut self) -> Vec<Edit> {
        std::mem::take(&mut self.edits)
    }

    /// Restores `key` to the value `text`, or to the scene file's value if `None`.
    ///
    /// # Errors
    /// As [`Self::set`].
    pub fn restore_parameter(&mut self, key: &str, text: Option<&str>) -> Result<(), SetError> {
        if changed_value(&self.pending().changes, key).as_deref() == text {
            return Ok(());
        }
        match text {
            Some(text) => self.set(key, text).map(|_| ()),
            None => self.set_original(key).map(|_| ()),
        }
    }

    /// Applies a change at the latest state. The rest of the latest step is still displayed as computed.
    fn apply(&mut self, event: &Event) -> Result<Effect, SetError> {
        let Self { simulation: run, unchanged, pacer, .. } = self;
        let effect = if pacer.shown() >= run.time() || run.step_start() >= run.time() {
            event.apply(run)?
        } else {
            let mut copy = run.clone();
            let effect = event.apply(&mut copy)?;
            *unchanged = Some(Box::new(std::mem::replace(run, copy)));
            effect
        };
        self.after_change();
        Ok(effect)
    }

    /// Reverts the change of a parameter: it has its value in the scene file again, or follows what it follows there.
    ///
    /// # Errors
    /// As [`LiveScene::undo_change`]; the run is left unchanged.
    pub fn set_original(&mut self, key: &str) -> Result<Effect, SetError> {
        self.pending().parameter(key)?;
        self.change(key, [Event::Original { key: key.to_owned() }])
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
        let event = Event::Pull(pull.map(Into::into));
        self.apply(&event)?;
        // Only the last of several moves between two steps counts.
        let steps = self.steps();
        let is_same_pull = |entry: &Entry| entry.steps == steps && matches!(entry.event, Event::Pull(Some(_)));
        if pull.is_some() && self.script.log.entries.last().is_some_and(is_same_pull) {
            self.script.go_back(self.script.passed - 1);
        }
        self.log_event(event);
        Ok(())
    }

    fn after_change(&mut self) {
        self.warnings = advice::of(self.pending());
        self.record.watch.restart(self.simulation.running(), self.simulation.time());
        self.record.worn = WearWatch::new(self.simulation.running(), self.simulation.time());
        self.record.settling = Settling::new(self.simulation.running());
        // While the run is retraced, the twin may begin later than now.
        let now = self.simulation.time();
        self.restart_twin(|start| start <= now);
        self.update_display();
    }

    /// Whether `key` was changed and waits for a reset.
    pub fn is_pending(&self, key: &str) -> bool {
        self.pending().get(key).ok() != self.running().get(key).ok()
    }

    /// The play of the displayed instant, m, where it is still on its way to the value of `key`: a live change moves it at a bounded
    /// rate, so that a wall pushes no ball at a blow. Of several joints, the one that has farthest to go.
    pub fn moving_play(&self, key: &str) -> Option<f64> {
        let joints = self.running().machine.loose_joints.iter().zip(&self.frame.joints).enumerate();
        let moving = joints.filter(|(j, (joint, now))| {
            let sets = key == "contact.clearance" || self.running().joint_key(*j, "clearance") == key;
            sets && (now.clearance - joint.contact.clearance).abs() > NOTICEABLE
        });
        let far = |play: &f64, to: f64| (play - to).abs();
        let moving = moving.map(|(_, (joint, now))| (now.clearance, joint.contact.clearance));
        moving.max_by(|a, b| far(&a.0, a.1).total_cmp(&far(&b.0, b.1))).map(|(now, _)| now)
    }

    /// Whether any change waits for a reset.
    pub fn has_pending_changes(&self) -> bool {
        self.pending().changes.iter().any(|(key, _)| self.is_pending(key))
    }

    /// Texts of the warnings about settings that are valid but may surprise the user.
    pub fn warnings(&self) -> impl Iterator<Item = &str> {
        self.warnings.iter().map(|advice| &*advice.text)
    }

    /// Warning about the current value of `key`, if any.
    pub fn warning(&self, key: &str) -> Option<&Advice> {
        self.warnings.iter().find(|advice| advice.concerns(key))
    }

    /// Value of `key` after [`Self::set_original`]: that of the scene file, or what it follows there, such as the common value of the
    /// joints with play.
    pub fn original(&self, key: &str) -> Option<Value> {
        self.pending().value_without_change(&self.original, key)
    }

    /// Records the rest of the previous step and takes one step; false if the divergence guard stopped it.
    pub(crate) fn step(&mut self) -> bool {
        self.record_until(self.simulation.time());
        self.store_keyframe();
        match self.script.step(&mut self.simulation, f64::INFINITY) {
            Ok(()) => {
                self.unchanged = None;
                self.simulation.take_peaks(&mut self.record.upcoming_peaks);
                self.record.impact_record.record(&mut self.simulation);
                if let Some(twin) = &mut self.twin {
                    twin.follow(&self.simulation);
                }
                let (start, forces) = (self.simulation.step_start(), self.simulation.state().applied_forces());
                if self.forces.observe(start, forces)
                    && let Some(ideal) = &mut self.ideal
                {
                    ideal.forget_after(start);
                }
                true
            }
            Err(stopped) => {
                self.playing = false;
                self.stopped = Some(stopped);
                false
            }
        }
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
        let start = self.record.recorded_to;
        let next_peak = |player: &Self| {
            let forces = player.record.upcoming_peaks.iter().filter(|peak| peak.normal > 0.0);
            forces.map(|peak| peak.time).min_by(f64::total_cmp)
        };
        if until > start {
            // A long step is also recorded at instants within it, so that plots stay smooth.
            let parts = ((until - start) / self.automatic_window() * 400.0).ceil().clamp(1.0, MAX_RECORDED_PER_STEP);
            for part in 1..=parts as u32 {
                let end =
                    if f64::from(part) == parts { until } else { start + (until - start) * f64::from(part) / parts };
                // A peak between two instants adds another instant.
                let close = end - 1e-3 * (end - start) / parts;
                while let Some(peak) = next_peak(self).filter(|peak| *peak < close) {
                    self.record_at(peak);
                    self.commit_peaks(peak);
                }
                self.record_at(end);
            }
        }
        self.commit_peaks(until);
        let run = self.unchanged.as_deref_mut().unwrap_or(&mut self.simulation);
        self.record.watch.step(run, until);
        self.record.worn.step(run, until);
    }

    /// Records the instant `time`, s, of the latest step.
    fn record_at(&mut self, time: f64) {
        let mut frame = std::mem::take(&mut self.record.recorded);
        self.run_at(time).sample(time, &mut frame);
        self.record.channels.read(&frame, &mut self.record.values);
        let joints = frame.joints.iter().take(self.clearances().len());
        self.record.values.extend(joints.map(|joint| joint.clearance));
        self.record.channels.read_picked(&frame, &mut self.record.values);
        for (joint, peak) in self.record.upcoming_peaks.iter().enumerate() {
            // The peak comes from the cubic of the step, not from the interpolated state. It is that of one place, the row the sum of all.
            if peak.normal > 0.0
                && peak.time == time
                && let Some(channel) = self.record.channels.normal_force(joint)
            {
                let several = !self.simulation.machine().loose_joints[joint].kind.site_names().is_empty();
                let value = &mut self.record.values[channel];
                *value = if several { value.max(peak.normal) } else { peak.normal };
            }
        }
        self.record.recorded_to = time;
        if let Some(ideal) = &mut self.ideal {
            ideal.follow(time, &self.forces);
            let error = ideal.output_error(&frame).map_or(f64::NAN, |e| e.norm());
            self.record.values[self.record.channels.tip_error()] = error;
        }
        for record in std::iter::once(&mut self.record.history).chain(self.record.detailed.as_deref_mut()) {
            record.push(time, &self.record.values);
        }
        self.record.contact_history.record(&frame);
        self.record.watch.record(&frame);
        self.record.settling.record(&frame);
        self.record.paths.record(&frame);
        self.record.friction.record(&frame);
        self.record.recorded = frame;
    }

    /// Adds the peaks up to `time`, s, to the record and to the frame's peaks.
    fn commit_peaks(&mut self, time: f64) {
        self.record.passed_peaks.resize(self.record.upcoming_peaks.len(), Peak::default());
        let all = time >= self.simulation.time();
        if all {
            self.simulation.commit_wear();
        }
        for joint in 0..self.record.upcoming_peaks.len() {
            let peak = self.record.upcoming_peaks[joint];
            // A contact that carries no force yet began at the end of the step.
            if !all && (peak.normal <= 0.0 || peak.time > time) {
                continue;
            }
            self.record.upcoming_peaks[joint] = Peak::default();
            if peak.normal > 0.0
                && let Some(channel) = self.record.channels.normal_force(joint)
            {
                for record in std::iter::once(&mut self.record.history).chain(self.record.detailed.as_deref_mut()) {
                    record.raise(peak.time, channel, peak.normal);
                }
            }
            let passed = &mut self.record.passed_peaks[joint];
            let (impacts, speed) = (passed.impacts, passed.approach_speed);
            if peak.normal > passed.normal {
                *passed = peak;
            }
            passed.impacts = impacts + peak.impacts;
            passed.approach_speed = speed.max(peak.approach_speed);
        }
    }

    /// Makes the peaks since the previous call available to [`Self::peaks`].
    pub(crate) fn publish_peaks(&mut self) {
        std::mem::swap(&mut self.record.peaks, &mut self.record.passed_peaks);
        self.record.passed_peaks.clear();
        self.record.passed_peaks.resize(self.record.peaks.len(), Peak::default());
    }

    /// Records up to the displayed instant and samples the frame there.
    fn update_display(&mut self) {
        let shown = self.pacer.shown();
        self.record_until(shown);
        self.reached = self.reached.max(shown);
        self.record.watch.set_shown(shown);
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

    /// Records and displays the start of the run.
    fn start(&mut self) {
        self.simulation.track_wear();
        self.record.contact_history.begin(0.0);
        // Forces at the start belong to the first frame: there has been no impact yet.
        self.simulation.take_peaks(&mut self.record.upcoming_peaks);
        self.record.impact_record.begin(self.simulation.state());
        self.record.drop_peaks();
        self.record_at(self.simulation.time());
        self.store_keyframe();
        self.pacer.jump(self.simulation.time());
        self.update_display();
    }
}
