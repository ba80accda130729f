//! Reference solution of a scene: the peaks of its first impacts, the position of its output body at the third impact, and the
//! mean contact forces after settling, each with its change in a run at a tighter tolerance.
//!
//! The motion is sensitive to errors: after some tens of impacts, two accurate runs have diverged. So the first impacts are
//! compared one by one, each within a time slot of the reference, and settled motion starts from the same state for every
//! method.

use serde::Serialize;

use super::timing::advance_capped;
use super::{AnalysisError, End, RunContext, Setting, WorkBudget};
use jointplay_physics::machine::Vec3;
use jointplay_physics::simulate::{Frame, Peak, Simulation};
use jointplay_scene::Scene;

/// Number of impacts to compare.
const IMPACT_COUNT: usize = 6;
/// A scene with fewer impacts to compare. Its next impact overlaps an impact of a neighbouring joint by 25 us, and the peak
/// depends on which of the two begins first. So no method is close to that peak before it resolves the instants to a
/// microsecond.
const OVERLAPPING_SCENE: (&str, usize) = ("chain", 5);
/// The impact at which the position is compared.
const POSITION_IMPACT: usize = 3;
/// Simulated time within which the impacts must occur, s.
const IMPACT_TIME_LIMIT: f64 = 0.5;
/// Compared time span of a scene without impacts, s.
const SPAN_WITHOUT_IMPACTS: f64 = 0.1;
/// Time after which a longer contact counts as ended, s; an impact takes 0.1 ms.
const LONG_CONTACT: f64 = 5e-3;
/// Simulated time after the last impact, s.
const EXTRA_TIME: f64 = 0.1e-3;
/// Time without a new or lost contact after which a scene has settled, s.
const QUIET_TIME: f64 = 0.15;
/// Time limit for settling, s.
const SETTLING_TIME_LIMIT: f64 = 1.2;
/// Tolerance of the run that settles a scene; all methods start from its final state.
const SETTLING_TOLERANCE: f64 = 1e-6;
/// Untimed start of a settled run, in which a method adapts its step size, s.
const WARM_UP: f64 = 0.05;
/// Timed span of a settled run, s.
const SETTLED_SPAN: f64 = 0.2;
/// Number of instants over which forces are averaged.
const SAMPLES: u32 = 200;
/// Fraction of the largest mean force below which the relative error of a mean force is meaningless.
const SMALL_FORCE: f64 = 1e-3;
/// Tolerance of the reference solution.
const REFERENCE_TOLERANCE: f64 = 1e-12;

/// The comparison slot of one impact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Slot {
    /// Index of the ball joint in the scene.
    pub joint: usize,
    /// Start of the contact in the reference, s.
    pub begin_s: f64,
    /// Start of the slot, s: half-way from the joint's previous contact.
    pub from_s: f64,
    /// End of the slot, s: half-way to the joint's next contact.
    pub to_s: f64,
    /// Peak in the reference, N: the largest normal force in the slot, or the largest reaction of an ideal joint.
    pub peak_n: f64,
}

/// Settled motion.
#[derive(Clone, Debug)]
pub struct SettledSpan {
    /// Start of the span over which forces are averaged, s.
    pub from: f64,
    /// End of that span, s.
    pub to: f64,
    /// Mean magnitude of each joint's contact force (reaction of an ideal joint), N.
    pub means: Vec<f64>,
    /// Initial state of every run.
    start: Simulation,
}

/// Errors against the reference; `None` if the run did not reach the quantity, or the scene does not have it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// Largest relative error of the peak forces of the first impacts.
    pub peak: Option<f64>,
    /// Error of the output body's position at the third impact, m.
    pub position_m: Option<f64>,
    /// Largest relative error of the joints' mean settled forces.
    pub settled: Option<f64>,
    /// Residual of the energy balance over the first impacts, relative to the energy exchanged.
    pub energy: Option<f64>,
}

/// Work of a run in one phase.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PhaseCost {
    pub steps: u64,
    pub evaluations: u64,
    pub rejected: u64,
}

/// The reference solution of a scene.
#[derive(Clone, Debug)]
pub struct ReferenceSolution {
    scene: Scene,
    /// The first impacts in the order in which they begin; one entry per joint if there is no impact.
    pub slots: Vec<Slot>,
    /// Number of compared impacts.
    pub impacts: usize,
    /// End of the span with the first impacts, s.
    pub span: f64,
    /// Instant at which the position is compared, s: the third impact, the last impact if there are fewer, or the end if there
    /// is none.
    pub instant: f64,
    /// Number of the impact at `instant`, from 1; 0 if there is none.
    pub instant_impact: usize,
    position: Vec3,
    /// Settled motion, if the scene reaches it in time.
    pub settled: Option<SettledSpan>,
    /// The method and tolerance of the reference.
    pub setting: Setting,
    /// Change of the reference itself at half its tolerance; smaller errors cannot be resolved.
    pub floor: Errors,
}

/// A contact of the reference.
struct Contact {
    joint: usize,
    begin: f64,
    end: Option<f64>,
}

impl Contact {
    /// End of the contact, or the time at which it counts as ended; `None` if neither is reached at `now`.
    fn end_at(&self, now: f64) -> Option<f64> {
        let long = self.begin + LONG_CONTACT;
        self.end.filter(|end| *end <= long).or((now >= long).then_some(long))
    }
}

/// Number of impacts to compare for `scene`.
fn impacts_compared(scene: &Scene) -> usize {
    let (name, fewer) = OVERLAPPING_SCENE;
    if scene.name == name { fewer } else { IMPACT_COUNT }
}

impl ReferenceSolution {
    /// Computes the reference of `scene`.
    ///
    /// # Errors
    /// A scene that does not start, or whose reference does not reach the end of the first impacts; cancellation by
    /// [`RunContext`].
    pub fn new(scene: &Scene, context: &mut RunContext) -> Result<Self, AnalysisError> {
        let mut reference = Self::of_impacts(scene, REFERENCE_TOLERANCE, &mut context.part(0, 2))?;
        let setting = reference.setting;
        let tighter = Setting { tolerance: 0.5 * REFERENCE_TOLERANCE, ..setting };
        let (peaks, position) = reference.reference_impacts(&tighter, &mut context.part(2, 4))?;
        reference.floor.peak = reference.peak_error(&peaks);
        reference.floor.position_m = Some((position - reference.position).norm());
        reference.settle(&setting, &tighter, &mut context.part(3, 4))?;
        Ok(reference)
    }

    /// The reference of the first impacts only, by the explicit pair at `tolerance`, without settled motion and floor.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(super) fn of_impacts(scene: &Scene, tolerance: f64, context: &mut RunContext) -> Result<Self, AnalysisError> {
        let setting = Setting::reference(tolerance);
        let (contacts, impacts) = first_contacts(&setting, scene, &mut context.part(0, 2))?;
        let mut reference = Self {
            scene: scene.clone(),
            slots: Vec::new(),
            impacts,
            span: SPAN_WITHOUT_IMPACTS,
            instant: SPAN_WITHOUT_IMPACTS,
            instant_impact: 0,
            position: Vec3::zeros(),
            settled: None,
            setting,
            floor: Errors::default(),
        };
        reference.set_slots(&contacts, scene.machine.ball_joints.len());
        let (peaks, position) = reference.reference_impacts(&setting, &mut context.part(1, 2))?;
        for (slot, peak) in reference.slots.iter_mut().zip(&peaks) {
            slot.peak_n = *peak;
        }
        reference.position = position;
        Ok(reference)
    }

    /// Sets the slots of the first impacts, which extend half-way to the same joint's previous and next contacts.
    fn set_slots(&mut self, contacts: &[Contact], joints: usize) {
        let first = &contacts[..self.impacts];
        if first.is_empty() {
            let whole = |joint| Slot { joint, begin_s: 0.0, from_s: 0.0, to_s: SPAN_WITHOUT_IMPACTS, peak_n: 0.0 };
            self.slots = (0..joints).map(whole).collect();
            return;
        }
        let end_of = |contact: &Contact| contact.end_at(f64::INFINITY).unwrap_or(contact.begin);
        self.span = first.iter().map(end_of).fold(0.0, f64::max) + EXTRA_TIME;
        let at = self.impacts.min(POSITION_IMPACT);
        self.instant = first[at - 1].begin;
        self.instant_impact = at;
        for (index, contact) in first.iter().enumerate() {
            let same = |other: &&Contact| other.joint == contact.joint;
            let before = contacts[..index].iter().rfind(same);
            let after = contacts[index + 1..].iter().find(same);
            self.slots.push(Slot {
                joint: contact.joint,
                begin_s: contact.begin,
                from_s: before.map_or(0.0, |other| 0.5 * (end_of(other) + contact.begin)),
                to_s: after.map_or(self.span, |other| self.span.min(0.5 * (end_of(contact) + other.begin))),
                peak_n: 0.0,
            });
        }
    }

    fn reference_impacts(
        &self,
        setting: &Setting,
        context: &mut RunContext,
    ) -> Result<(Vec<f64>, Vec3), AnalysisError> {
        let mut simulation = setting.start(&self.scene)?;
        let (end, peaks, position) = self.observe_impacts(&mut simulation, &WorkBudget::REFERENCE, context)?;
        require_reached(end)?;
        Ok((peaks, position.unwrap_or_default()))
    }

    /// Runs over the first impacts. Returns how the run ended, the largest force in every slot, and the position at the
    /// instant.
    fn observe_impacts(
        &self,
        simulation: &mut Simulation,
        budget: &WorkBudget,
        context: &mut RunContext,
    ) -> Result<(End, Vec<f64>, Option<Vec3>), AnalysisError> {
        let mut largest = vec![0.0_f64; self.slots.len()];
        let mut position = None;
        let mut peaks: Vec<Peak> = Vec::new();
        let mut frame = Frame::default();
        let end = advance_capped(simulation, self.span, budget, context, |simulation| {
            simulation.take_peaks(&mut peaks);
            for (slot, largest) in self.slots.iter().zip(&mut largest) {
                let peak = &peaks[slot.joint];
                if (slot.from_s..=slot.to_s).contains(&peak.time) {
                    *largest = largest.max(peak.normal);
                }
            }
            if position.is_none() && simulation.time() >= self.instant {
                simulation.sample(self.instant, &mut frame);
                position = Some(frame.pose.position);
            }
            false
        })?;
        Ok((end, largest, position))
    }

    /// Largest relative error of `peaks`; `None` if there is nothing to compare.
    fn peak_error(&self, peaks: &[f64]) -> Option<f64> {
        let pairs = self.slots.iter().zip(peaks);
        pairs
            .filter(|(slot, _)| slot.peak_n > 0.0)
            .map(|(slot, peak)| (peak / slot.peak_n - 1.0).abs())
            .reduce(f64::max)
    }

    /// Errors of a run over the first impacts, its work, and how it ended.
    pub(super) fn impact_errors(
        &self,
        setting: &Setting,
        budget: &WorkBudget,
        context: &mut RunContext,
    ) -> Result<(End, Errors, PhaseCost), AnalysisError> {
        let mut simulation = setting.start(&self.scene)?;
        let (end, peaks, position) = self.observe_impacts(&mut simulation, budget, context)?;
        let mut errors = Errors::default();
        if end == End::Reached {
            errors.peak = self.peak_error(&peaks);
            errors.position_m = position.map(|p| (p - self.position).norm());
            errors.energy = energy_residual(&simulation);
        }
        Ok((end, errors, work(&simulation, &PhaseCost::default())))
    }

    /// Computes the settled motion, if there is any, and averages its forces.
    fn settle(&mut self, setting: &Setting, tighter: &Setting, context: &mut RunContext) -> Result<(), AnalysisError> {
        let Some(start) = settled_state(&self.scene, &mut context.part(0, 3))? else {
            return Ok(());
        };
        let from = start.time() + WARM_UP;
        self.settled = Some(SettledSpan {
            from,
            to: from + SETTLED_SPAN,
            means: vec![0.0; self.scene.machine.ball_joints.len()],
            start,
        });
        let budget = WorkBudget::REFERENCE;
        let mut means = [Vec::new(), Vec::new()];
        for (n, (setting, means)) in [setting, tighter].into_iter().zip(&mut means).enumerate() {
            let (end, forces, _) = self.mean_forces(setting, &budget, &mut context.part(n + 1, 3))?;
            if end != End::Reached {
                // A settled motion that the reference run cannot complete is no basis for comparison.
                self.settled = None;
                return Ok(());
            }
            *means = forces;
        }
        let [means, check] = means;
        if let Some(span) = &mut self.settled {
            span.means = means;
        }
        self.floor.settled = self.mean_error(&check);
        Ok(())
    }

    /// The settled simulation under `setting`, after its warm-up.
    pub(super) fn resume(
        &self,
        span: &SettledSpan,
        setting: &Setting,
        budget: &WorkBudget,
        context: &mut RunContext,
    ) -> Result<(End, Simulation), AnalysisError> {
        let mut simulation = setting.resume(&span.start)?;
        let end = advance_capped(&mut simulation, span.from, budget, context, |_| false)?;
        Ok((end, simulation))
    }

    fn mean_forces(
        &self,
        setting: &Setting,
        budget: &WorkBudget,
        context: &mut RunContext,
    ) -> Result<(End, Vec<f64>, PhaseCost), AnalysisError> {
        let span = self.settled.as_ref().expect("only called for a scene that settles");
        let (end, mut simulation) = self.resume(span, setting, budget, context)?;
        let before = work(&simulation, &PhaseCost::default());
        let mut forces = MeanForces::new(&self.scene, (span.from, span.to), SAMPLES);
        if end != End::Reached {
            return Ok((end, forces.means, work(&simulation, &before)));
        }
        let end = advance_capped(&mut simulation, span.to, budget, context, |simulation| {
            forces.sample_step(simulation);
            false
        })?;
        Ok((end, forces.means, work(&simulation, &before)))
    }

    fn mean_error(&self, means: &[f64]) -> Option<f64> {
        let expected = &self.settled.as_ref()?.means;
        let smallest = SMALL_FORCE * expected.iter().copied().fold(0.0, f64::max);
        let pairs = expected.iter().zip(means);
        pairs
            .filter(|(expected, _)| **expected > smallest)
            .map(|(expected, mean)| (mean / expected - 1.0).abs())
            .reduce(f64::max)
    }

    /// Error of the settled forces, the run's work, and how it ended; `None` if the scene does not settle.
    pub(super) fn settled_error(
        &self,
        setting: &Setting,
        budget: &WorkBudget,
        context: &mut RunContext,
    ) -> Result<Option<(End, Option<f64>, PhaseCost)>, AnalysisError> {
        if self.settled.is_none() {
            return Ok(None);
        }
        let (end, means, work) = self.mean_forces(setting, budget, context)?;
        let error = (end == End::Reached).then(|| self.mean_error(&means));
        Ok(Some((end, error.flatten(), work)))
    }

    /// The scene of the reference.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }
}

fn work(simulation: &Simulation, before: &PhaseCost) -> PhaseCost {
    let now = simulation.statistics();
    PhaseCost {
        steps: now.steps - before.steps,
        evaluations: now.evaluations - before.evaluations,
        rejected: now.rejected - before.rejected,
    }
}

/// Magnitude of the residual of the energy balance since the start, relative to the energy exchanged; `None` without a ledger.
fn energy_residual(simulation: &Simulation) -> Option<f64> {
    let ledger = simulation.ledger()?;
    Some(ledger.relative_residual().abs())
}

/// Mean magnitude of each joint's contact force over a span, from equally spaced instants.
pub(super) struct MeanForces {
    span: (f64, f64),
    samples: u32,
    next: u32,
    frame: Frame,
    /// Mean forces, N; complete once a run has been sampled to the end of the span.
    pub means: Vec<f64>,
}

impl MeanForces {
    pub(super) fn new(scene: &Scene, span: (f64, f64), samples: u32) -> Self {
        Self { span, samples, next: 0, frame: Frame::default(), means: vec![0.0; scene.machine.ball_joints.len()] }
    }

    /// Samples the instants that lie in the latest step.
    pub(super) fn sample_step(&mut self, simulation: &mut Simulation) {
        let (from, to) = self.span;
        while self.next < self.samples {
            let theta = (f64::from(self.next) + 0.5) / f64::from(self.samples);
            let instant = from + (to - from) * theta;
            if instant > simulation.time() {
                return;
            }
            simulation.sample(instant, &mut self.frame);
            for (mean, joint) in self.means.iter_mut().zip(&self.frame.joints) {
                let force = (joint.normal_force + joint.friction_force).norm();
                *mean += force / f64::from(self.samples);
            }
            self.next += 1;
        }
    }
}

/// Requires that the reference run reached its end; the error states why it did not.
pub(super) fn require_reached(end: End) -> Result<(), AnalysisError> {
    match end {
        End::Reached => Ok(()),
        End::Capped => Err(AnalysisError::TooLong { evaluations: WorkBudget::REFERENCE.evaluations }),
        End::Stopped(stopped) => Err(stopped.into()),
        End::Refused(refused) => Err(refused.into()),
    }
}

/// Contacts of the reference until shortly after the first impacts, and the number of them to compare.
fn first_contacts(
    setting: &Setting,
    scene: &Scene,
    context: &mut RunContext,
) -> Result<(Vec<Contact>, usize), AnalysisError> {
    let mut simulation = setting.start(scene)?;
    let joints = scene.machine.ball_joints.len();
    if scene.machine.ball_joints.iter().all(|j| j.contact.clearance == 0.0) {
        return Ok((Vec::new(), 0));
    }
    let starts_in_contact = |j: &usize| simulation.contact_state(*j).active;
    let mut contacts: Vec<Contact> =
        (0..joints).filter(starts_in_contact).map(|joint| Contact { joint, begin: 0.0, end: None }).collect();
    let mut peaks: Vec<Peak> = Vec::new();
    simulation.take_peaks(&mut peaks);
    let (budget, count) = (WorkBudget::REFERENCE, impacts_compared(scene));
    let end = advance_capped(&mut simulation, IMPACT_TIME_LIMIT, &budget, context, |simulation| {
        let now = simulation.time();
        simulation.take_peaks(&mut peaks);
        for (joint, peak) in peaks.iter().enumerate() {
            let open = contacts.iter_mut().rfind(|c| c.joint == joint && c.end.is_none());
            let active = simulation.contact_state(joint).active;
            if let Some(contact) = open
                && (!active || peak.impacts > 0)
            {
                contact.end = Some(now);
            }
            if peak.impacts > 0 {
                contacts.push(Contact { joint, begin: now, end: (!active).then_some(now) });
            }
        }
        let is_over = |contact: &Contact| contact.end_at(now).is_some_and(|t| now > t + EXTRA_TIME);
        contacts.len() >= count && contacts[..count].iter().all(is_over)
    })?;
    match end {
        // A large scene may reach the cap before its sixth impact; then the impacts so far are compared.
        End::Capped if !contacts.is_empty() => {}
        end => require_reached(end)?,
    }
    let last = simulation.time();
    // Only contacts that are over can be compared.
    let is_over = |contact: &&Contact| contact.end_at(last).is_some_and(|end| end + EXTRA_TIME <= last);
    let compared = contacts.iter().take(count).take_while(is_over).count();
    Ok((contacts, compared))
}

/// The simulation once every joint with clearance has been in contact for [`QUIET_TIME`] without a new impact; `None` if the
/// scene does not settle in time.
fn settled_state(scene: &Scene, context: &mut RunContext) -> Result<Option<Simulation>, AnalysisError> {
    let setting = Setting::automatic(SETTLING_TOLERANCE);
    let mut simulation = setting.start(scene)?;
    let mut peaks: Vec<Peak> = Vec::new();
    let mut since = 0.0;
    let clearance: Vec<usize> = (0..scene.machine.ball_joints.len())
        .filter(|&j| scene.machine.ball_joints[j].contact.clearance > 0.0)
        .collect();
    let mut settled = false;
    let budget = WorkBudget { seconds: f64::INFINITY, ..WorkBudget::FULL };
    advance_capped(&mut simulation, SETTLING_TIME_LIMIT, &budget, context, |simulation| {
        simulation.take_peaks(&mut peaks);
        let open = |&j: &usize| !simulation.contact_state(j).active || peaks[j].impacts > 0;
        if clearance.iter().any(open) {
            since = simulation.time();
        }
        settled = simulation.time() - since >= QUIET_TIME;
        settled
    })?;
    Ok(settled.then_some(simulation))
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;

    fn reference(name: &str, changes: &[(&str, &str)]) -> ReferenceSolution {
        let changes: Vec<_> = changes.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        let scene = Scene::load(name, &changes).expect("built in");
        let mut clock = || 0.0;
        let mut progress = |_: f64| ControlFlow::Continue(());
        ReferenceSolution::new(&scene, &mut RunContext::new(&mut clock, &mut progress)).expect("measures")
    }

    #[test]
    fn the_reference_of_the_default_scene_matches_the_published_impacts() {
        let reference = reference("spcmm", &[]);
        // (joint, start in ms, peak in N) of an independent solution, with rounded last digits.
        let published = [
            (0, 7.801422908, 621.35),
            (1, 7.807677416, 560.67),
            (2, 7.807810294, 533.36),
            (1, 10.01967, 870.58),
            (0, 10.50063, 771.13),
            (2, 12.38051, 321.29),
        ];
        assert_eq!(reference.slots.len(), published.len());
        for (slot, (joint, begin, peak)) in reference.slots.iter().zip(published) {
            assert_eq!(slot.joint, joint);
            assert!((slot.begin_s * 1e3 - begin).abs() < 1e-5, "{slot:?}");
            assert!((slot.peak_n / peak - 1.0).abs() < 1e-4, "{slot:?}");
        }
        assert_eq!(reference.instant, reference.slots[2].begin_s);
        let floor = reference.floor;
        assert!(floor.peak.is_some_and(|e| e < 1e-5), "{floor:?}");
        assert!(floor.position_m.is_some_and(|e| e < 1e-10), "{floor:?}");
        assert!(floor.settled.is_some_and(|e| e < 1e-3), "{floor:?}");
        let settled = reference.settled.expect("its contacts settle");
        assert!(settled.from < 0.6, "{}", settled.from);
    }

    #[test]
    fn a_scene_without_play_is_compared_by_its_reactions() {
        let reference = reference("pendulum", &[("contact.clearance", "0")]);
        assert_eq!((reference.impacts, reference.slots.len()), (0, 1));
        // The reaction of a released pendulum grows: m g cos(theta) plus the centripetal force.
        assert!(reference.slots[0].peak_n > 0.384 * 9.81 * 0.75);
        assert!(reference.settled.is_some());
        assert!(reference.floor.peak.is_some_and(|e| e < 1e-9));
    }

    #[test]
    fn a_scene_that_keeps_rattling_does_not_settle() {
        let frictionless = [("contact.friction", "0"), ("contact.restitution", "1")];
        assert!(reference("pendulum", &frictionless).settled.is_none());
    }
}
