//! Reference solution of a scene: the peaks of its first impacts, the position of its output body at the third of them, and the
//! mean contact forces after settling.
//!
//! The motion is sensitive to errors: after some tens of impacts, two accurate runs have diverged. So the first impacts are
//! compared one by one, each within a time slot of the reference, and settled motion starts from the same state for every
//! method.

use super::timing::{End, advance_capped};
use super::{AnalysisError, RunContext, Setting};
use jointplay_physics::machine::Vec3;
use jointplay_physics::simulate::{Frame, Impact, Peak, Simulation};
use jointplay_scene::Scene;

/// Number of impacts to compare, and to look for: the next one of the same joint ends the slot of each.
const IMPACT_COUNT: usize = 6;
const SOUGHT: usize = 2 * IMPACT_COUNT;
/// A scene with fewer impacts to compare. Its next impact overlaps an impact of a neighbouring joint by 25 us, and the peak
/// depends on which of the two begins first. So no method is close to that peak before it resolves the instants to a
/// microsecond.
const OVERLAPPING_SCENE: (&str, usize) = ("chain", 5);
/// The impact at which the position is compared.
const POSITION_IMPACT: usize = 3;
/// Simulated time within which the impacts must occur, s.
const IMPACT_TIME_LIMIT: f64 = 1.0;
/// Compared time span of a scene without impacts, s.
const SPAN_WITHOUT_IMPACTS: f64 = 0.1;
/// Simulated time after the last impact, s.
const EXTRA_TIME: f64 = 0.1e-3;
/// Time without a new or lost contact after which a scene has settled, s.
const QUIET_TIME: f64 = 0.15;
/// Time limit for settling, s.
const SETTLING_TIME_LIMIT: f64 = 1.2;
/// Tolerance of the run that settles a scene; all methods start from its final state.
const SETTLING_TOLERANCE: f64 = 1e-6;
/// Start of a settled run, in which a method adapts its step size, s.
const WARM_UP: f64 = 0.05;
/// Span over which settled forces are averaged, s, and number of instants.
const SETTLED_SPAN: f64 = 0.2;
const SAMPLES: u32 = 200;
/// Fraction of the largest mean force below which the relative error of a mean force is meaningless.
const SMALL_FORCE: f64 = 1e-3;
/// Tolerance of the reference solution.
const TOLERANCE: f64 = 1e-12;
/// Cap on the counted cost of a reference run, on which all other results depend.
const MAX_COST: f64 = 2e7;
/// Cap on the counted cost of looking for impacts in a scene that may have none, and of settling.
const SEARCH_COST: f64 = 4e6;

/// The comparison slot of one impact.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Slot {
    /// Index of the joint in the scene.
    joint: usize,
    /// Of a joint that touches at several places, this one, whose impacts are compared.
    place: Option<u8>,
    /// From half-way after the joint's previous contact to half-way before its next one, s.
    span: (f64, f64),
    /// Peak in the reference, N: the largest normal force in the slot, or the largest reaction of an ideal joint.
    peak: f64,
}

/// Motion with every loose ball in contact, from which forces are averaged.
#[derive(Clone, Debug)]
struct Settled {
    /// Initial state of every run.
    start: Simulation,
    /// Mean magnitude of each joint's contact force (reaction of an ideal joint), N.
    means: Vec<f64>,
}

/// Errors against the reference; `None` if the run did not reach the quantity, or the scene does not have it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Largest relative error of the peak forces of the first impacts.
    pub peak: Option<f64>,
    /// Error of the output body's position at the third impact, m.
    pub position_m: Option<f64>,
    /// Residual of the energy balance over the first impacts, relative to the energy exchanged.
    pub energy: Option<f64>,
    /// Largest relative error of the joints' mean settled forces.
    pub force: Option<f64>,
}

/// The reference solution of a scene: that of the explicit pair of order 5 at a tolerance of 1e-12.
#[derive(Clone, Debug)]
pub struct ReferenceSolution {
    scene: Scene,
    /// The first impacts in the order in which they begin; one entry per joint if there is no impact.
    slots: Vec<Slot>,
    /// Number of compared impacts.
    pub impacts: usize,
    /// End of the span with the first impacts, s.
    pub span_s: f64,
    /// Instant at which the position is compared, s: the third impact, the last impact if there are fewer, or the end if there
    /// is none.
    instant: f64,
    position: Vec3,
    settled: Option<Settled>,
}

impl ReferenceSolution {
    /// Computes the reference of `scene`.
    ///
    /// # Errors
    /// A scene that does not start, or whose reference does not reach the end of the first impacts; cancellation by
    /// [`RunContext`].
    pub fn new(scene: &Scene, context: &mut RunContext) -> Result<Self, AnalysisError> {
        let setting = Setting::reference(TOLERANCE);
        let found = first_impacts(&setting, scene, &mut context.part(0, 4))?;
        let count = if scene.name == OVERLAPPING_SCENE.0 { OVERLAPPING_SCENE.1 } else { IMPACT_COUNT };
        let first = &found[..count.min(found.len())];
        let span_s = first.iter().map(|impact| impact.end + EXTRA_TIME).reduce(f64::max);
        let span_s = span_s.unwrap_or(SPAN_WITHOUT_IMPACTS);
        let at = first.len().min(POSITION_IMPACT);
        let mut reference = Self {
            scene: scene.clone(),
            slots: Vec::new(),
            impacts: first.len(),
            span_s,
            instant: if at > 0 { first[at - 1].start } else { span_s },
            position: Vec3::zeros(),
            settled: None,
        };
        let joints = if first.is_empty() { scene.machine.loose_joints.len() } else { 0 };
        reference.slots =
            (0..joints).map(|joint| Slot { joint, place: None, span: (0.0, span_s), peak: 0.0 }).collect();
        for (index, impact) in first.iter().enumerate() {
            let same = |other: &&Impact| (other.joint, other.place) == (impact.joint, impact.place);
            let has_places = !scene.machine.loose_joints[impact.joint].kind.site_names().is_empty();
            let before = found[..index].iter().rfind(same).map_or(0.0, |other| 0.5 * (other.end + impact.start));
            let after = found[index + 1..].iter().find(same).map(|other| 0.5 * (impact.end + other.start));
            let span = (before, after.unwrap_or(span_s).min(span_s));
            let place = has_places.then_some(impact.place);
            reference.slots.push(Slot { joint: impact.joint, place, span, peak: 0.0 });
        }
        let mut simulation = setting.start(scene)?;
        let (end, peaks, position) = reference.observe_impacts(&mut simulation, MAX_COST, &mut context.part(1, 4))?;
        require_reached(end)?;
        for (slot, peak) in reference.slots.iter_mut().zip(peaks) {
            slot.peak = peak;
        }
        reference.position = position.unwrap_or_default();
        if let Some(start) = settled_state(scene, &mut context.part(2, 4))? {
            // A settled motion that the reference run cannot complete is no basis for comparison.
            let means = mean_forces(&setting, &start, MAX_COST, &mut context.part(3, 4))?;
            reference.settled = means.map(|means| Settled { start, means });
        }
        Ok(reference)
    }

    /// Runs over the first impacts. Returns how the run ended, the largest force in every slot, and the position at the
    /// instant.
    fn observe_impacts(
        &self,
        simulation: &mut Simulation,
        max_cost: f64,
        context: &mut RunContext,
    ) -> Result<(End, Vec<f64>, Option<Vec3>), AnalysisError> {
        let mut largest = vec![0.0_f64; self.slots.len()];
        let mut position = None;
        let mut peaks: Vec<Peak> = Vec::new();
        let mut frame = Frame::default();
        let end = advance_capped(simulation, self.span_s, max_cost, context, |simulation| {
            simulation.take_peaks(&mut peaks);
            for (slot, largest) in self.slots.iter().zip(&mut largest).filter(|(slot, _)| slot.place.is_none()) {
                let peak = &peaks[slot.joint];
                if (slot.span.0..=slot.span.1).contains(&peak.time) {
                    *largest = largest.max(peak.normal);
                }
            }
            if position.is_none() && simulation.time() >= self.instant {
                simulation.sample(self.instant, &mut frame);
                position = Some(frame.pose.position);
            }
            false
        })?;
        for (slot, largest) in self.slots.iter().zip(&mut largest) {
            let in_slot = |impact: &&Impact| {
                (impact.joint, Some(impact.place)) == (slot.joint, slot.place)
                    && (slot.span.0..=slot.span.1).contains(&impact.start)
            };
            *largest = simulation.impacts().filter(in_slot).fold(*largest, |most, impact| most.max(impact.peak));
        }
        Ok((end, largest, position))
    }

    /// Errors of a run of the scene under `setting`, of settled motion, too, unless it costs more than `max_cost`.
    ///
    /// # Errors
    /// A scene that does not start with this method; cancellation.
    pub fn errors(&self, setting: &Setting, max_cost: f64, context: &mut RunContext) -> Result<Errors, AnalysisError> {
        let mut simulation = setting.start(&self.scene)?;
        let (end, peaks, position) = self.observe_impacts(&mut simulation, max_cost, &mut context.part(0, 2))?;
        let mut errors = Errors::default();
        if end == End::Reached {
            errors.peak = largest_error(self.slots.iter().map(|slot| slot.peak).zip(peaks), 0.0);
            errors.position_m = position.map(|position| (position - self.position).norm());
            errors.energy = simulation.ledger().map(|ledger| ledger.relative_residual().abs());
        }
        if let Some(Settled { start, means }) = &self.settled {
            let smallest = SMALL_FORCE * means.iter().copied().fold(0.0, f64::max);
            let found = mean_forces(setting, start, max_cost, &mut context.part(1, 2))?;
            errors.force = found.and_then(|found| largest_error(means.iter().copied().zip(found), smallest));
        }
        Ok(errors)
    }
}

/// Largest relative error among pairs of an expected value above `smallest` and a value found; `None` if there are none.
fn largest_error(pairs: impl Iterator<Item = (f64, f64)>, smallest: f64) -> Option<f64> {
    let compared = pairs.filter(|(expected, _)| *expected > smallest);
    compared.map(|(expected, found)| (found / expected - 1.0).abs()).reduce(f64::max)
}

/// Requires that a reference run reached its end; the error states why it did not.
fn require_reached(end: End) -> Result<(), AnalysisError> {
    match end {
        End::Reached => Ok(()),
        End::Capped => Err(AnalysisError::TooLong { cost: MAX_COST }),
        End::Stopped(stopped) => Err(stopped.into()),
        End::Refused(refused) => Err(refused.into()),
    }
}

/// The first impacts of the reference to have ended, in the order in which they begin, and some more.
fn first_impacts(setting: &Setting, scene: &Scene, context: &mut RunContext) -> Result<Vec<Impact>, AnalysisError> {
    if scene.machine.loose_joints.iter().all(|joint| joint.contact.is_ideal()) {
        return Ok(Vec::new());
    }
    let mut simulation = setting.start(scene)?;
    let end = advance_capped(&mut simulation, IMPACT_TIME_LIMIT, SEARCH_COST, context, |simulation| {
        simulation.impacts().nth(SOUGHT - 1).is_some_and(|last| last.end + EXTRA_TIME < simulation.time())
    })?;
    // A large scene may reach the cap before its last impact; then the impacts so far are compared.
    if end != End::Capped {
        require_reached(end)?;
    }
    let is_over = |impact: &&Impact| impact.end + EXTRA_TIME <= simulation.time();
    let mut impacts: Vec<Impact> = simulation.impacts().filter(is_over).copied().collect();
    impacts.sort_by(|a, b| a.start.total_cmp(&b.start));
    Ok(impacts)
}

/// The simulation once every joint with clearance has been in contact for [`QUIET_TIME`] without a new impact; `None` if the
/// scene does not settle in time.
fn settled_state(scene: &Scene, context: &mut RunContext) -> Result<Option<Simulation>, AnalysisError> {
    let mut simulation = Setting::automatic(SETTLING_TOLERANCE).start(scene)?;
    let mut peaks: Vec<Peak> = Vec::new();
    let (mut since, mut settled) = (0.0, false);
    let joints = scene.machine.loose_joints.iter().enumerate();
    let loose: Vec<usize> = joints.filter(|(_, joint)| !joint.contact.is_ideal()).map(|(j, _)| j).collect();
    advance_capped(&mut simulation, SETTLING_TIME_LIMIT, SEARCH_COST, context, |simulation| {
        simulation.take_peaks(&mut peaks);
        if loose
            .iter()
            .any(|&j| simulation.contact_states(j).iter().all(|contact| !contact.active) || peaks[j].impacts > 0)
        {
            since = simulation.time();
        }
        settled = simulation.time() - since >= QUIET_TIME;
        settled
    })?;
    Ok(settled.then_some(simulation))
}

/// Mean magnitude of each joint's contact force in settled motion from `start`, N; `None` if the run does not reach its end.
fn mean_forces(
    setting: &Setting,
    start: &Simulation,
    max_cost: f64,
    context: &mut RunContext,
) -> Result<Option<Vec<f64>>, AnalysisError> {
    let mut simulation = setting.resume(start)?;
    let from = start.time() + WARM_UP;
    let (mut means, mut next) = (vec![0.0; start.machine().loose_joints.len()], 0);
    let mut frame = Frame::default();
    let end = advance_capped(&mut simulation, from + SETTLED_SPAN, max_cost, context, |simulation| {
        while next < SAMPLES {
            let instant = from + SETTLED_SPAN * (f64::from(next) + 0.5) / f64::from(SAMPLES);
            if instant > simulation.time() {
                break;
            }
            simulation.sample(instant, &mut frame);
            for (mean, joint) in means.iter_mut().zip(&frame.joints) {
                *mean += (joint.normal_force + joint.friction_force).norm() / f64::from(SAMPLES);
            }
            next += 1;
        }
        false
    })?;
    Ok((end == End::Reached).then_some(means))
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
    fn the_reference_of_the_papers_scene_matches_the_published_impacts() {
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
            assert!(slot.span.0 < begin * 1e-3 && begin * 1e-3 < slot.span.1, "{slot:?}");
            assert!((slot.peak / peak - 1.0).abs() < 1e-4, "{slot:?}");
        }
        assert!((reference.instant * 1e3 - published[2].1).abs() < 1e-5, "{}", reference.instant);
        assert!(reference.settled.is_some_and(|settled| settled.start.time() < 0.6), "its contacts settle");
    }

    #[test]
    fn a_scene_without_play_is_compared_by_its_reactions() {
        let reference = reference("pendulum", &[("contact.clearance", "0")]);
        assert_eq!((reference.impacts, reference.slots.len()), (0, 1));
        // The reaction of a released pendulum grows: m g cos(theta) plus the centripetal force.
        assert!(reference.slots[0].peak > 0.384 * 9.81 * 0.75);
        assert!(reference.settled.is_some());
    }

    #[test]
    fn a_scene_that_keeps_rattling_does_not_settle() {
        let frictionless = [("contact.friction", "0"), ("contact.restitution", "1")];
        assert!(reference("pendulum", &frictionless).settled.is_none());
    }
}
