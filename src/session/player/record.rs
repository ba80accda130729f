//! The record of a run.

use super::contact_history::ContactHistory;
use super::impact_record::ImpactRecord;
use crate::scene::Scene;
use crate::session::friction::FrictionRecord;
use crate::session::history::{Bin, History, Mark};
use crate::session::paths::Paths;
use crate::session::settled::Settling;
use crate::session::watch::RunWatch;
use crate::session::worn::WearWatch;
use crate::simulate::{Channels, Frame, Peak, RECORDED_JOINTS, State};

/// Narrowest bin of the record, s: shorter than any step that resolves an impact.
pub const FINEST_BIN: f64 = 2e-6;

/// The record of a run, as far as it was ever displayed, and the peaks that are still to be added.
#[derive(Clone)]
pub(super) struct Record {
    /// Largest forces since the previous frame.
    pub peaks: Vec<Peak>,
    /// Peaks of the latest step after the displayed instant.
    pub upcoming_peaks: Vec<Peak>,
    /// Peaks to be handed out with the next frame.
    pub passed_peaks: Vec<Peak>,
    pub channels: Channels,
    /// Name patterns of the picked channels.
    pub picks: Vec<String>,
    /// The channels, then the clearance of each recorded joint with play, then the picked channels.
    pub history: History,
    /// Full-resolution record of the time window last retraced.
    pub detailed: Option<Box<History>>,
    pub contact_history: ContactHistory,
    pub impact_record: ImpactRecord,
    /// The instant recorded last, and its time, s; the time also follows the run when it goes back.
    pub recorded: Frame,
    pub recorded_to: f64,
    pub values: Vec<f64>,
    pub settling: Settling,
    pub paths: Paths,
    pub friction: FrictionRecord,
    pub watch: RunWatch,
    pub worn: WearWatch,
}

impl Record {
    /// An empty record of a run of `scene`.
    pub fn new(scene: &Scene) -> Self {
        let channels = Channels::of(&scene.machine);
        let joints = scene.machine.loose_joints.len().min(RECORDED_JOINTS);
        Self {
            peaks: Vec::new(),
            upcoming_peaks: Vec::new(),
            passed_peaks: Vec::new(),
            history: History::new(channels.len() + joints, FINEST_BIN),
            detailed: None,
            contact_history: ContactHistory::default(),
            impact_record: ImpactRecord::default(),
            channels,
            picks: Vec::new(),
            recorded: Frame::default(),
            recorded_to: 0.0,
            values: Vec::new(),
            settling: Settling::new(scene),
            paths: Paths::new(scene),
            friction: FrictionRecord::new(scene),
            watch: RunWatch::new(scene),
            worn: WearWatch::new(scene, 0.0),
        }
    }
    /// As [`History::bins`], from the window last retraced where possible.
    pub fn bins(&self, channel: usize, from: f64, to: f64, most_bins: usize, out: &mut Vec<Bin>) {
        let detailed = self.detailed.as_ref().and_then(|detailed| detailed.span());
        let Some((start, end)) = detailed.filter(|(start, end)| *start < to && *end > from) else {
            return self.history.bins(channel, from, to, most_bins, out);
        };
        if from < start {
            let first = out.len();
            self.history.bins(channel, from, start, most_bins, out);
            // A wide bin may extend past `start`.
            let whole = out[first..].iter().filter(|bin| bin.to <= start).count();
            out.truncate(first + whole);
        }
        if let Some(detailed) = &self.detailed {
            detailed.bins(channel, from.max(start), to.min(end), most_bins, out);
        }
        if to > end {
            let first = out.len();
            self.history.bins(channel, end, to, most_bins, out);
            drop_before(out, first, end);
        }
    }

    /// Width of the narrowest bins from `time`, s, on, s.
    pub fn resolution(&self, time: f64) -> f64 {
        let detailed = self.detailed_at(time).map_or(f64::INFINITY, |detailed| detailed.resolution(time));
        self.history.resolution(time).min(detailed)
    }

    /// The full-resolution record, if it contains `time`, s.
    pub fn detailed_at(&self, time: f64) -> Option<&History> {
        let contains = |history: &&History| history.span().is_some_and(|(from, to)| from <= time && time <= to);
        self.detailed.as_deref().filter(contains)
    }

    /// Begins another full-resolution record.
    pub fn begin_detailed(&mut self) {
        match &mut self.detailed {
            Some(detailed) => detailed.clear(),
            none => *none = Some(Box::new(History::new(self.history.channels(), FINEST_BIN))),
        }
    }

    /// Drops all peaks that are still to be added or handed out.
    pub fn drop_peaks(&mut self) {
        let joints = self.upcoming_peaks.len();
        for peaks in [&mut self.peaks, &mut self.upcoming_peaks, &mut self.passed_peaks] {
            peaks.clear();
            peaks.resize(joints, Peak::default());
        }
    }

    /// Drops everything after `state`, for a new branch; `mark` is the position of the history there.
    pub fn truncate(&mut self, state: &State, mark: Option<&Mark>) {
        if let Some(mark) = mark {
            self.history.rewind(mark);
        }
        self.detailed = None;
        self.contact_history.truncate(state.time());
        self.impact_record.truncate(state);
        self.watch.truncate(state.time());
        self.worn.truncate(state.time());
    }

    /// Continues from `time`, s, in a run of `scene`. Known data stay.
    pub fn go_back(&mut self, time: f64, scene: &Scene) {
        if time > self.recorded_to {
            // The time skipped was not recorded.
            self.paths = Paths::new(scene);
            self.friction = FrictionRecord::new(scene);
        }
        self.recorded_to = time;
        self.watch.go_to(time);
        self.worn.go_back(scene, time);
        self.settling = Settling::new(scene);
        self.drop_peaks();
    }
}

/// Drops the bins from index `first` on that begin before `start`, s.
pub(super) fn drop_before(bins: &mut Vec<Bin>, first: usize, start: f64) {
    let early = bins[first..].iter().take_while(|bin| bin.from < start);
    let count = early.count();
    bins.drain(first..first + count);
}
