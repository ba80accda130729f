//! One point of a sweep: the run of a scene through its periods, and its recorded results.

use super::crossing::{Crossing, CrossingRun};
use super::drive::{NoPeriod, OBSERVABLES, ObservedError, ObservedRun, drive_period};
use super::orbit::Orbit;
use super::regime::{Evidence, Regime, classify};
use super::section::{Schedule, SectionRun, SectionsSoFar};
use super::statistic::{Accumulator, ChannelStatistic};
use jointplay_physics::machine::{Machine, Solver};
use jointplay_physics::simulate::{Effect, Peak};
use jointplay_scene::Scene;

/// Samples per drive period: an upper limit for the means and the tip error, and a lower limit for statistics of channels.
const SAMPLES: f64 = 400.0;
/// Samples per run of given duration, with the same meaning.
const SAMPLES_OF_DURATION: f64 = 1000.0;
/// Separation of the twin over the tolerance, in units of the scales of the tolerance: 10 nm at a tolerance of 1e-6 in a
/// machine with balls of 10 mm. It is so small that only a grazing contact separates the twins, and well above the difference
/// between runs with the same steps, which comes from the last iteration of an implicit step.
const SEPARATION_OVER_TOLERANCE: f64 = 1.0;
/// Range of the separation, in units of the scales of the tolerance.
const SEPARATIONS: (f64, f64) = (1e-6, 1e-5);
/// Loosest tolerance at which a run follows the motion of its scene closely enough to have the same exponent.
pub const MAX_EXPONENT_TOLERANCE: f64 = 1e-5;
/// Resolution of the coordinates and of the rates of a section, over the tolerance. The errors of many steps add up, and a
/// stiff contact turns coordinate errors into larger rate errors.
const RESOLUTION: [f64; 2] = [10.0, 100.0];
/// Tolerance that stands for the errors of a fixed-step method.
const FIXED_STEP_TOLERANCE: f64 = 1e-5;

/// Run length and section phase of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Drive periods, including discarded ones.
    pub periods: usize,
    /// Initial periods to discard as a transient.
    pub discard: usize,
    /// Drive phase of the sections as a fraction of the period, 0 <= phase < 1.
    pub phase: f64,
    /// Whether to measure the largest Lyapunov exponent with a twin run.
    pub exponent: bool,
}

/// Length of the run of each point, and its observed part.
#[derive(Clone, Debug, PartialEq)]
pub enum Span {
    /// A number of periods with a section in each.
    Sections {
        /// Number of periods and phase of the sections.
        plan: Plan,
        /// Time between two sections, s; `None` for the common period of the scene's drives.
        interval: Option<f64>,
    },
    /// A duration without sections.
    Duration {
        /// Length, s, from the point's start.
        duration: f64,
        /// End of the transient, s, 0 <= from < duration.
        from: f64,
    },
    /// A number of crossings of a channel, with a section at each.
    Crossings {
        /// The channel and its value.
        crossing: Crossing,
        /// Number of crossings, including discarded ones.
        count: usize,
        /// Initial crossings to discard as a transient.
        discard: usize,
        /// Time limit for the crossings, s, from the point's start.
        duration: f64,
    },
}

/// The run of each point of a sweep and the recorded quantities.
#[derive(Clone, Debug, PartialEq)]
pub struct Protocol {
    /// Length and observed part.
    pub span: Span,
    /// Statistics of channels to record. If empty, the quantities of the joints with play and the probe are recorded.
    pub keep: Vec<ChannelStatistic>,
    /// Whether to record the quantities of the joints with play and the probe in addition to statistics of channels.
    pub joints: bool,
}

impl Protocol {
    /// The plan of the sections, if there are any.
    pub fn plan(&self) -> Option<&Plan> {
        match &self.span {
            Span::Sections { plan, .. } => Some(plan),
            Span::Duration { .. } | Span::Crossings { .. } => None,
        }
    }

    /// Number of sections per point, and how many of them are discarded; `None` for a duration without sections.
    pub fn sections(&self) -> Option<(usize, usize)> {
        match &self.span {
            Span::Sections { plan, .. } => Some((plan.periods, plan.discard)),
            Span::Crossings { count, discard, .. } => Some((*count, *discard)),
            Span::Duration { .. } => None,
        }
    }

    /// Number of sections recorded per point.
    pub fn kept(&self) -> usize {
        self.sections().map_or(0, |(all, discard)| all.saturating_sub(discard))
    }

    /// Time between two sections of `scene`, or the observed time, s.
    ///
    /// # Errors
    /// A scene without a common drive period, if the period is needed.
    pub fn interval(&self, scene: &Scene) -> Result<f64, NoPeriod> {
        match self.span {
            Span::Sections { interval, .. } => interval.map_or_else(|| drive_period(scene), Ok),
            Span::Duration { duration, from } => Ok(duration - from),
            Span::Crossings { duration, .. } => Ok(duration),
        }
    }

    /// The run of a simulation that starts cold at t = 0 or, if it `follows`, continues another point. A duration is
    /// represented by a transient that ends at a first, discarded section, and one interval to a second section.
    fn start_run(&self, machine: ObservedRun, interval: f64, separation: Option<f64>, follows: bool) -> SpanRun {
        let now = machine.time();
        let follows = follows.then_some(now);
        let schedule = match &self.span {
            Span::Sections { plan, .. } => {
                // Sections lie at (k + phase) T, with k = 1, 2, … for phase 0 and k = 0, 1, … otherwise, so that there are
                // always as many as periods.
                let part = if plan.phase > 0.0 { plan.phase } else { 1.0 };
                let first = follows.map_or(part * interval, |now| now + interval);
                Schedule { first, interval, sections: plan.periods, discard: plan.discard }
            }
            Span::Duration { duration, from } => {
                let discard = usize::from(*from > 0.0);
                let first = now + if *from > 0.0 { *from } else { *duration };
                Schedule { first, interval, sections: 1 + discard, discard }
            }
            Span::Crossings { crossing, count, discard, duration } => {
                let run = CrossingRun::new(machine, crossing, (*count, *discard), now + duration);
                return SpanRun::Crossings(Box::new(run));
            }
        };
        SpanRun::Sections(Box::new(SectionRun::new(machine, schedule, separation)))
    }
}

impl From<Plan> for Protocol {
    /// Sections in each period of the drives.
    fn from(plan: Plan) -> Self {
        Self { span: Span::Sections { plan, interval: None }, keep: Vec::new(), joints: false }
    }
}

/// Result for one joint with play.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointResult {
    /// Name of the joint.
    pub name: String,
    /// Largest normal force of all periods, in continuous time, N.
    pub peak: f64,
    /// Largest normal force of the kept periods, N.
    pub peak_kept: f64,
    /// Mean normal force over the kept periods, N.
    pub mean: f64,
    /// Number of contacts that began in all periods.
    pub impacts: u64,
    /// Number of contacts that began in the kept periods.
    pub impacts_kept: u64,
    /// Time from the point's start to the last separation, if any, s.
    pub last_separation: Option<f64>,
}

/// Result of a point.
#[derive(Clone, Debug, PartialEq)]
pub struct PointResult {
    /// Time at which the divergence guard stopped the run, s from the point's start; `None` if it did not.
    pub stopped: Option<f64>,
    /// Joints with play in scene order.
    pub joints: Vec<JointResult>,
    /// Largest and root-mean-square distance of the probe tip from the ideal tip over the kept periods, m; `None` where
    /// the scene has no such reference.
    pub probe: Option<(f64, f64)>,
    /// Kind of motion.
    pub regime: Regime,
    /// Evidence for the regime.
    pub evidence: Evidence,
    /// Doubts about the result: bit k is set for kind k of [`jointplay_physics::simulate::Doubt::KINDS`].
    pub doubts: u32,
    /// Unaccounted energy since the start of the run, relative to the energy that the machine contained and lost; NaN without a
    /// ledger.
    pub residual: f64,
    /// Kept sections, concatenated, in the order of [`OBSERVABLES`].
    pub sections: Vec<f64>,
    /// Number of sections, including discarded ones.
    pub crossings: usize,
    /// Times of the kept crossings of a channel, s from the point's start; empty for sections at a phase.
    pub times: Vec<f64>,
    /// Values of [`Protocol::keep`], SI; NaN where unknown.
    pub statistics: Vec<f64>,
}

/// A run through the sections of a point.
enum SpanRun {
    Sections(Box<SectionRun<ObservedRun>>),
    Crossings(Box<CrossingRun>),
}

impl SpanRun {
    fn so_far(&self) -> &SectionsSoFar<ObservedRun> {
        match self {
            Self::Sections(run) => &run.so_far,
            Self::Crossings(run) => &run.so_far,
        }
    }

    fn so_far_mut(&mut self) -> &mut SectionsSoFar<ObservedRun> {
        match self {
            Self::Sections(run) => &mut run.so_far,
            Self::Crossings(run) => &mut run.so_far,
        }
    }
}

/// A point being computed.
pub struct PointRun {
    span_run: SpanRun,
    interval: f64,
    /// Whether the transient is over.
    is_recording: bool,
    resolution: Vec<f64>,
    started: f64,
    impacts_at_start: Vec<u64>,
    impacts_at_discard: Vec<u64>,
    peaks: Vec<Peak>,
    transient_peaks: Vec<f64>,
    means: Means,
    statistics: Accumulator,
}

impl PointRun {
    /// Starts `scene` at t = 0; `interval` is [`Protocol::interval`], s.
    ///
    /// # Errors
    /// A scene that cannot start.
    pub fn cold(scene: &Scene, protocol: &Protocol, interval: f64) -> Result<Self, ObservedError> {
        Ok(Self::begin(ObservedRun::new(scene)?, protocol, interval, false))
    }

    /// Continues from the latest section of another point with the parameters of `machine`; `None` if a running simulation
    /// cannot adopt them.
    pub fn follow(mut run: ObservedRun, machine: &Machine, protocol: &Protocol, interval: f64) -> Option<Self> {
        if run.simulation_mut().adopt(machine) != Ok(Effect::Now) {
            return None;
        }
        Some(Self::begin(run, protocol, interval, true))
    }

    fn begin(mut machine: ObservedRun, protocol: &Protocol, interval: f64, follows: bool) -> Self {
        let solver = machine.simulation().machine().solver;
        let tolerance = tolerance_of(&solver);
        let samples = if protocol.plan().is_some() { SAMPLES } else { SAMPLES_OF_DURATION };
        let sample_interval = interval / samples;
        // A purely kinematic scene has a single motion, from which no twin can deviate.
        let exponent = protocol.plan().is_some_and(|plan| plan.exponent);
        let twin = exponent && !machine.simulation().mechanism().is_kinematic();
        let separation = twin.then(|| separation(tolerance));
        let mut peaks = Vec::new();
        let simulation = machine.simulation_mut();
        if simulation.time() > 0.0 {
            simulation.take_peaks(&mut peaks);
        }
        let impacts: Vec<u64> = simulation.statistics().joints.iter().map(|joint| joint.impacts).collect();
        let joints = impacts.len();
        let started = simulation.time();
        let mut run = Self {
            resolution: resolution(simulation.machine(), tolerance),
            means: Means::new(joints, sample_interval),
            statistics: Accumulator::new(&protocol.keep, simulation, sample_interval),
            span_run: protocol.start_run(machine, interval, separation, follows),
            interval,
            is_recording: false,
            started,
            impacts_at_discard: impacts.clone(),
            impacts_at_start: impacts,
            peaks,
            transient_peaks: vec![0.0; joints],
        };
        if run.span_run.so_far().discard == 0 {
            run.begin_recording();
        }
        run
    }

    /// Time of the first section at a phase of the drive, including discarded ones, s; NaN for crossings.
    pub fn first(&self) -> f64 {
        match &self.span_run {
            SpanRun::Sections(run) => run.schedule.first,
            SpanRun::Crossings(_) => f64::NAN,
        }
    }

    /// Whether the point started from the scene's own initial state.
    pub(crate) fn is_cold(&self) -> bool {
        self.started == 0.0
    }

    /// Whether all periods are complete.
    pub fn is_done(&self) -> bool {
        match &self.span_run {
            SpanRun::Sections(run) => run.is_done(),
            SpanRun::Crossings(run) => run.is_done(),
        }
    }

    /// Number of sections taken, including discarded ones.
    pub fn taken(&self) -> usize {
        self.span_run.so_far().taken
    }

    /// The running scene.
    pub fn machine(&self) -> &ObservedRun {
        &self.span_run.so_far().orbit
    }

    /// Takes one step of the scene.
    ///
    /// # Errors
    /// The divergence guard: the point has diverged.
    pub fn step(&mut self) -> Result<(), ObservedError> {
        let at_section = match &mut self.span_run {
            SpanRun::Sections(run) => run.step()?,
            SpanRun::Crossings(run) => run.step()?,
        };
        if self.span_run.so_far().taken < self.span_run.so_far().discard {
            return Ok(());
        }
        if !self.is_recording {
            self.begin_recording();
        } else {
            self.means.sample(&mut self.span_run.so_far_mut().orbit, at_section);
            self.statistics.sample(self.span_run.so_far_mut().orbit.simulation_mut());
        }
        Ok(())
    }

    /// Ends the transient and starts recording.
    fn begin_recording(&mut self) {
        self.is_recording = true;
        let machine = &mut self.span_run.so_far_mut().orbit;
        let simulation = machine.simulation_mut();
        simulation.take_peaks(&mut self.peaks);
        for (largest, peak) in self.transient_peaks.iter_mut().zip(&self.peaks) {
            *largest = peak.normal;
        }
        self.impacts_at_discard.clear();
        self.impacts_at_discard.extend(simulation.statistics().joints.iter().map(|joint| joint.impacts));
        self.means.begin(machine);
        self.statistics.begin(machine.simulation_mut());
    }

    /// The result, and the scene in the state of its latest section, from which the next point can continue.
    pub fn finish(mut self) -> (PointResult, ObservedRun) {
        let simulation = self.span_run.so_far_mut().orbit.simulation_mut();
        simulation.take_peaks(&mut self.peaks);
        let doubts = simulation.doubts().iter().fold(0, |bits, doubt| bits | 1 << doubt.kind());
        let residual = simulation.ledger().map_or(f64::NAN, |ledger| ledger.share());
        let statistics = simulation.statistics();
        let span = self.means.span;
        let machine = simulation.machine();
        // A point with no more crossings than are discarded has no kept part.
        let peak_kept = |j: usize| if self.is_recording { self.peaks[j].normal } else { f64::NAN };
        let statistics_of_channels = self.statistics.values(machine, peak_kept);
        let joints = (0..self.peaks.len())
            .map(|j| JointResult {
                name: machine.loose_joints[j].name.clone(),
                peak: self.peaks[j].normal.max(self.transient_peaks[j]),
                peak_kept: peak_kept(j),
                mean: self.means.normal[j] / span,
                impacts: statistics.joints[j].impacts - self.impacts_at_start[j],
                impacts_kept: if self.is_recording {
                    statistics.joints[j].impacts - self.impacts_at_discard[j]
                } else {
                    0
                },
                last_separation: statistics.joints[j]
                    .last_separation
                    .filter(|&time| time > self.started)
                    .map(|time| time - self.started),
            })
            .collect();
        let probe_error = self.means.probe_now.filter(|_| !self.means.probe_lost);
        let probe = probe_error.map(|_| (self.means.probe_largest, (self.means.probe_square / span).sqrt()));
        let sections = self.span_run.so_far().kept.clone();
        let crossings = self.span_run.so_far().taken;
        let (exponent, times) = match &self.span_run {
            SpanRun::Sections(run) => (run.exponent().and_then(|benettin| benettin.result()), Vec::new()),
            SpanRun::Crossings(run) => (None, run.times.iter().map(|time| time - self.started).collect()),
        };
        let (regime, evidence) = classify(&sections, &self.resolution, self.interval, exponent);
        let statistics = statistics_of_channels;
        let result = PointResult {
            stopped: None,
            joints,
            probe,
            regime,
            evidence,
            doubts,
            residual,
            sections,
            crossings,
            times,
            statistics,
        };
        let machine = match self.span_run {
            SpanRun::Sections(run) => run.so_far.orbit,
            SpanRun::Crossings(run) => run.so_far.orbit,
        };
        (result, machine)
    }

    /// Result of a point that the divergence guard stopped, with only the time known.
    pub fn stopped(self) -> PointResult {
        PointResult { stopped: Some(self.machine().time() - self.started), ..PointResult::unknown() }
    }
}

impl PointResult {
    /// A result without known values.
    pub fn unknown() -> Self {
        let (regime, evidence) = classify(&[], &[1.0], 1.0, None);
        Self {
            stopped: None,
            joints: Vec::new(),
            probe: None,
            regime,
            evidence,
            doubts: 0,
            residual: f64::NAN,
            sections: Vec::new(),
            crossings: 0,
            times: Vec::new(),
            statistics: Vec::new(),
        }
    }
}

/// Relative tolerance as a measure of a run's errors.
fn tolerance_of(solver: &Solver) -> f64 {
    if solver.method.is_adaptive() { solver.tolerance } else { FIXED_STEP_TOLERANCE }
}

/// Separation of the twin of a run with this tolerance, in units of the scales.
fn separation(tolerance: f64) -> f64 {
    (SEPARATION_OVER_TOLERANCE * tolerance).clamp(SEPARATIONS.0, SEPARATIONS.1)
}

/// Separation of the twin of a run of `machine`, in units of the scales.
pub fn separation_of(machine: &Machine) -> f64 {
    separation(tolerance_of(&machine.solver))
}

/// Smallest differences that distinguish two sections of `machine`, in the order of [`OBSERVABLES`]: products of the tolerance,
/// the scales and a factor.
pub fn resolution(machine: &Machine, tolerance: f64) -> Vec<f64> {
    let length = machine.length_scale();
    let of_group = [length, 0.1, length / 0.1, 1.0];
    (0..OBSERVABLES.len()).map(|i| RESOLUTION[i / 6] * tolerance * of_group[i / 3]).collect()
}

/// Time averages by the trapezoidal rule.
struct Means {
    /// Least time between two samples, s.
    min_interval: f64,
    /// Time of the latest sample, s.
    latest: f64,
    /// Time covered so far, s.
    span: f64,
    /// Integral of the normal force per joint with play, N s.
    normal: Vec<f64>,
    /// Normal forces at the latest sample, N.
    normal_now: Vec<f64>,
    /// Integral of the squared tip error, m^2 s.
    probe_square: f64,
    /// Tip error at the latest sample, m.
    probe_now: Option<f64>,
    probe_largest: f64,
    probe_lost: bool,
}

impl Means {
    fn new(joints: usize, min_interval: f64) -> Self {
        Self {
            min_interval,
            latest: f64::NAN,
            span: 0.0,
            normal: vec![0.0; joints],
            normal_now: vec![0.0; joints],
            probe_square: 0.0,
            probe_now: None,
            probe_largest: 0.0,
            probe_lost: false,
        }
    }

    fn begin(&mut self, machine: &mut ObservedRun) {
        self.latest = machine.time();
        self.integrate(machine, 0.0);
    }

    /// Takes a sample at a section, or if the latest sample is old enough.
    fn sample(&mut self, machine: &mut ObservedRun, at_section: bool) {
        let elapsed = machine.time() - self.latest;
        if elapsed >= self.min_interval || (at_section && elapsed > 0.0) {
            self.latest = machine.time();
            self.integrate(machine, elapsed);
        }
    }

    fn integrate(&mut self, machine: &mut ObservedRun, h: f64) {
        let frame = machine.frame();
        self.span += h;
        let values = self.normal.iter_mut().zip(&mut self.normal_now);
        for ((sum, now), joint) in values.zip(&frame.joints) {
            let force = joint.normal_force.norm();
            *sum += 0.5 * h * (*now + force);
            *now = force;
        }
        // An ideal motion that ends early leaves no mean over the whole span.
        self.probe_lost |= frame.probe_error.is_none();
        if let Some(error) = frame.probe_error.filter(|_| !self.probe_lost) {
            let size = error.norm();
            let before = self.probe_now.unwrap_or(size);
            self.probe_square += 0.5 * h * (before * before + size * size);
            self.probe_largest = self.probe_largest.max(size);
            self.probe_now = Some(size);
        }
    }
}
