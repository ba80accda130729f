//! Measures of a lesson: the runs of its steps are computed once in the background and evaluated.

use std::sync::Arc;

use super::format::{ImpactProperty, Kind, Lesson, Measure, Run};
use super::names::{Names, parameter};
use crate::app::twin::Twin;
use crate::scene::LiveScene;
use crate::scene::{Quantity, Scene};
use crate::simulate::{ChannelInfo, Frame, Impact, Peak, Reading, channels_of, chosen_channels};
use crate::units::Dimension;

/// Latest measurable instant, s.
const MAX_TIME: f64 = 120.0;
/// An impact that begins before another may end at most this much later, s.
const MAX_OVERLAP: f64 = 5e-3;
/// Sampling intervals per step.
const SAMPLES: u32 = 4;

/// The measures of a lesson, computed incrementally.
pub struct LessonMeasures {
    lesson: Arc<Lesson>,
    values: Vec<Option<Quantity>>,
    pass: Option<MeasuringRun>,
    fault: Option<String>,
}

impl LessonMeasures {
    /// Starts with no values.
    pub fn new(lesson: Arc<Lesson>) -> Self {
        Self { values: vec![None; lesson.measures.len()], lesson, pass: None, fault: None }
    }

    /// The measures known so far.
    pub fn names(&self) -> Names<'_> {
        let measures = &self.lesson.measures;
        let known = measures.iter().zip(&self.values);
        let mut names = self.lesson.names();
        names.known.extend(known.filter_map(|(measure, value)| Some((measure.name.as_str(), (*value)?))));
        names
    }

    /// Why the computation failed.
    pub fn fault(&self) -> Option<&str> {
        self.fault.as_deref()
    }

    /// Continues while `may_step`; returns whether all measures are known or have failed.
    pub fn advance(&mut self, mut may_step: impl FnMut() -> bool) -> bool {
        while self.fault.is_none() {
            let Some(pass) = &mut self.pass else {
                match self.next_pass() {
                    Ok(None) => return true,
                    Ok(pass) => self.pass = pass,
                    Err(why) => self.fault = Some(why),
                }
                continue;
            };
            match pass.advance(&mut may_step) {
                Ok(false) => return false,
                Ok(true) => {
                    for (index, gauge) in &pass.gauges {
                        self.values[*index] = gauge.value;
                    }
                    self.pass = None;
                }
                Err(why) => self.fault = Some(why),
            }
        }
        true
    }

    /// The next run: that of the first pending measure, with all measures of that run whose instants are known.
    fn next_pass(&self) -> Result<Option<MeasuringRun>, String> {
        let measures = self.lesson.measures.iter().enumerate();
        let pending = measures.filter(|(index, _)| self.values[*index].is_none());
        let mut pass: Option<MeasuringRun> = None;
        let (mut run, mut unresolved) = (None, None);
        let names = self.names();
        for (index, measure) in pending {
            let own = measure.run;
            if run.is_some_and(|run| run != own) {
                continue;
            }
            let times = measure.times.each_ref().map(|text| names.time(text));
            let [Some(from), Some(to)] = times else {
                unresolved.get_or_insert(&measure.name);
                continue;
            };
            run = Some(own);
            let fault = |why: String| format!("measure {}: {why}", measure.name);
            let pass = match &mut pass {
                Some(pass) => pass,
                none => none.insert(MeasuringRun::new(&self.lesson.runs[own]).map_err(fault)?),
            };
            let gauge = pass.gauge(measure, from, to).map_err(fault)?;
            // A run has one twin at a time; a twin with another start waits for a later pass.
            let of_other_twin =
                |(_, other): &(usize, RunningMeasure)| other.measures_twin_distance() && other.from != from;
            if gauge.measures_twin_distance() && pass.gauges.iter().any(of_other_twin) {
                continue;
            }
            pass.gauges.push((index, gauge));
        }
        if let (None, Some(name)) = (&pass, unresolved) {
            return Err(format!("measure {name}: its instants are not times"));
        }
        Ok(pass)
    }
}

/// A run in progress.
struct MeasuringRun {
    simulation: LiveScene,
    changes: Vec<(f64, String, String)>,
    scene: Scene,
    gauges: Vec<(usize, RunningMeasure)>,
    frame: Frame,
    impacts: Vec<Impact>,
    peaks: Vec<Peak>,
    twin: Option<Twin>,
}

/// A measure in progress.
struct RunningMeasure {
    kind: Kind,
    joint: Option<usize>,
    readings: Vec<Reading>,
    dimension: Dimension,
    from: f64,
    to: f64,
    /// Extremum, integral or value so far.
    so_far: f64,
    value: Option<Quantity>,
}

impl RunningMeasure {
    /// Whether it measures the distance of a twin run.
    fn measures_twin_distance(&self) -> bool {
        matches!(self.kind, Kind::Apart)
    }
}

impl MeasuringRun {
    fn new(run: &Run) -> Result<Self, String> {
        let simulation = LiveScene::new(&run.scene).map_err(|error| run.scene.locate(&error).to_string())?;
        Ok(Self {
            simulation,
            changes: run.changes.iter().rev().cloned().collect(),
            scene: run.scene.clone(),
            gauges: Vec::new(),
            frame: Frame::default(),
            impacts: Vec::new(),
            peaks: Vec::new(),
            twin: None,
        })
    }

    fn gauge(&mut self, measure: &Measure, from: f64, to: f64) -> Result<RunningMeasure, String> {
        if to > MAX_TIME {
            return Err(format!("ends at {to} s; allowed up to {MAX_TIME} s"));
        }
        let needs_interval = matches!(measure.kind, Kind::Peak(_) | Kind::Least(_) | Kind::Mean(_));
        if needs_interval && from >= to {
            return Err(format!("ends at {to} s, not after its start at {from} s"));
        }
        let kind = measure.kind.clone();
        let joint = match kind.joint().filter(|name| *name != "any") {
            None => None,
            Some(name) => Some(self.joint(name)?),
        };
        let mut gauge = RunningMeasure {
            dimension: kind.dimension(),
            joint,
            readings: Vec::new(),
            from,
            to,
            so_far: 0.0,
            value: None,
            kind,
        };
        if let Some(channel) = gauge.kind.channel() {
            let mut first = Frame { reactions: Some(Vec::new()), ..Frame::default() };
            self.simulation.sample(0.0, &mut first);
            let pattern = [channel.to_owned()];
            let listed = channels_of(&self.scene.machine, &first);
            let listed = chosen_channels(listed, &pattern).map_err(|error| error.to_string())?;
            // The first column is the time.
            let listed = &listed[1..];
            let readings: Vec<Reading> = listed.iter().map(ChannelInfo::reading).collect();
            if !matches!(readings.len(), 1 | 3) || listed.iter().any(|c| c.unit != listed[0].unit) {
                let names: Vec<&str> = listed.iter().map(|channel| &*channel.name).collect();
                return Err(format!(
                    "`{channel}` names {} channels; allowed one, or the three components of a vector: {}",
                    names.len(),
                    names.join(", ")
                ));
            }
            gauge.dimension = dimension_of(listed[0].unit);
            // Normal force magnitudes are available in continuous time.
            gauge.joint = channel.strip_suffix(".normal").and_then(|name| self.joint(name).ok());
            readings.iter().for_each(|reading| reading.request(&mut self.frame));
            gauge.readings = readings.to_vec();
        }
        gauge.so_far = match gauge.kind {
            Kind::Peak(_) => f64::NEG_INFINITY,
            Kind::Least(_) => f64::INFINITY,
            _ => 0.0,
        };
        gauge.value = match &gauge.kind {
            Kind::Parameter(key) => Some(parameter(&self.scene, key)?),
            Kind::Instant => Some(Quantity::new(to, Dimension::Time)),
            _ => None,
        };
        Ok(gauge)
    }

    fn joint(&self, name: &str) -> Result<usize, String> {
        let joints = &self.scene.machine.loose_joints;
        joints.iter().position(|j| j.name == name).ok_or_else(|| {
            let known: Vec<&str> = joints.iter().map(|joint| &*joint.name).collect();
            format!("no joint with play `{name}`; allowed: {}", known.join(", "))
        })
    }

    /// Advances the run; returns whether all its measures are known.
    fn advance(&mut self, may_step: &mut impl FnMut() -> bool) -> Result<bool, String> {
        while self.gauges.iter().any(|(_, gauge)| gauge.value.is_none()) {
            if !may_step() {
                return Ok(false);
            }
            self.step()?;
        }
        Ok(true)
    }

    fn step(&mut self) -> Result<(), String> {
        let now = self.simulation.time();
        if now > MAX_TIME {
            return Err(format!("there is no such impact within {MAX_TIME} s"));
        }
        while let Some((_, key, value)) = self.changes.pop_if(|(time, ..)| *time <= now) {
            let done = self.simulation.set(&key, &value);
            done.map_err(|error| error.to_string())?;
        }
        let starts_twin = |(_, gauge): &(usize, RunningMeasure)| gauge.measures_twin_distance() && gauge.from <= now;
        if self.twin.is_none() && self.gauges.iter().any(starts_twin) {
            self.twin = Some(Twin::new(&self.simulation));
        }
        let stepped = self.simulation.step();
        stepped.map_err(|stopped| stopped.to_string())?;
        if let Some(twin) = &mut self.twin {
            twin.follow(&self.simulation);
        }
        self.impacts.extend(self.simulation.take_impacts());
        self.simulation.take_peaks(&mut self.peaks);
        let Self { simulation, gauges, frame, impacts, peaks, twin, .. } = self;
        for (_, gauge) in gauges.iter_mut().filter(|(_, gauge)| gauge.value.is_none()) {
            gauge.step(simulation, frame, impacts, peaks, twin.as_ref());
        }
        Ok(())
    }
}

impl RunningMeasure {
    /// Evaluates the latest step.
    fn step(
        &mut self,
        simulation: &mut LiveScene,
        frame: &mut Frame,
        impacts: &[Impact],
        peaks: &[Peak],
        twin: Option<&Twin>,
    ) {
        let (start, end) = (simulation.step_start(), simulation.time());
        let own = |impact: &&Impact| {
            self.joint.is_none_or(|joint| joint == impact.joint) && impact.start >= self.from && impact.end <= self.to
        };
        match &self.kind {
            Kind::Impact { number, its, .. } => {
                let mut known: Vec<&Impact> = impacts.iter().filter(own).collect();
                known.sort_by(|a, b| a.start.total_cmp(&b.start));
                if let Some(impact) = known.get(number - 1)
                    && end > impact.end + MAX_OVERLAP
                {
                    self.finish(its.of(impact));
                }
            }
            Kind::Count { .. } if end > self.to => {
                let count = impacts.iter().filter(own).count();
                self.finish(count as f64);
            }
            Kind::Apart if end > self.to => {
                let distances = twin.map_or(&[][..], Twin::distances);
                let last = distances.iter().rfind(|[time, _]| *time <= self.to);
                self.finish(last.map_or(f64::NAN, |[_, distance]| *distance));
            }
            Kind::At(_) if end >= self.to => {
                let value = self.sample(simulation, frame, self.to);
                self.finish(value);
            }
            Kind::Peak(_) | Kind::Least(_) | Kind::Mean(_) if end > self.from => {
                let (from, to) = (start.max(self.from), end.min(self.to));
                let part = (to - from) / f64::from(SAMPLES);
                for k in 0..=SAMPLES {
                    let value = self.sample(simulation, frame, from + part * f64::from(k));
                    // Trapezoidal rule: the ends have half weight.
                    let weight = if k == 0 || k == SAMPLES { 0.5 } else { 1.0 };
                    self.so_far = match self.kind {
                        Kind::Peak(_) => self.so_far.max(value),
                        Kind::Least(_) => self.so_far.min(value),
                        _ => self.so_far + weight * part * value,
                    };
                }
                let peak = self.joint.and_then(|joint| peaks.get(joint));
                if let (Kind::Peak(_), Some(peak)) = (&self.kind, peak)
                    && (from..=to).contains(&peak.time)
                {
                    self.so_far = self.so_far.max(peak.normal);
                }
                if end >= self.to {
                    let length = match self.kind {
                        Kind::Mean(_) => self.to - self.from,
                        _ => 1.0,
                    };
                    self.finish(self.so_far / length);
                }
            }
            _ => {}
        }
    }

    fn finish(&mut self, value: f64) {
        self.value = Some(Quantity::new(value, self.dimension));
    }

    /// Value of the channel at `time`, s, in the latest step; the magnitude for a vector.
    fn sample(&self, simulation: &mut LiveScene, frame: &mut Frame, time: f64) -> f64 {
        simulation.sample(time, frame);
        let value = |reading: &Reading| reading.read(frame).unwrap_or(f64::NAN);
        match &self.readings[..] {
            [one] => value(one),
            many => many.iter().map(|one| value(one) * value(one)).sum::<f64>().sqrt(),
        }
    }
}

impl ImpactProperty {
    fn of(self, impact: &Impact) -> f64 {
        match self {
            Self::Start => impact.start,
            Self::End => impact.end,
            Self::Duration => impact.end - impact.start,
            Self::Approach => impact.approach_speed,
            Self::Rebound => impact.separation_speed,
            Self::Force => impact.peak,
            Self::Depth => impact.deepest,
        }
    }
}

/// Dimension of the unit of a channel.
fn dimension_of(unit: &str) -> Dimension {
    match unit {
        "s" => Dimension::Time,
        "m" => Dimension::Length,
        "m/s" => Dimension::Speed,
        "m/s2" => Dimension::Acceleration,
        "rad" => Dimension::Angle,
        "rad/s" => Dimension::AngularSpeed,
        "N" => Dimension::Force,
        // A joule is a newton metre.
        "J" | "N m" => Dimension::Torque,
        _ => Dimension::None,
    }
}
