//! Reasons to doubt a result, from the scene's settings and from the course of the run.

use super::{Model, State};
use crate::contact::{Coefficients, ElasticLaw, FrictionVelocity};
use crate::integrate::Method;
use crate::machine::{LooseJoint, LooseKind, MIN_IMPACT_STEPS, Machine, Pin, Slide};
use crate::simulate::{AffectedJoints, Doubt, Ledger, LedgerTerm, Overdamped, WornWall};

/// Fraction of a joint's contacts that may be slower than the floor.
const MAX_BELOW_SPEED_FLOOR: f64 = 0.5;
/// Contact patch over ball radius beyond which Hertz theory, which treats the ball as a half-space, is far off.
const MAX_PATCH: f64 = 1.0 / 3.0;
/// Worn depth over the size of the joint beyond which its surfaces are no longer those of the start.
const MAX_WORN: f64 = 0.1;
/// Constraint violations above this fraction of the smallest clearance blur the effect of the clearance.
const DRIFT_OF_CLEARANCE: f64 = 0.1;
/// Limit on constraint violations if every joint with play is ideal, m.
const DRIFT: f64 = 1e-4;
/// Excess of damping over elastic force, compared with an undisturbed impact, beyond which a force is an artefact of the law.
const MAX_DAMPING: f64 = 1.0;
/// Allowed excess of an undisturbed impact's restitution over its law's prediction.
const MAX_RESTITUTION_EXCESS: f64 = 0.1;
/// Allowed residual as a fraction of the ledger's energy scale.
const RESIDUAL: f64 = 5e-3;
/// Allowed residual as a fraction of each work, and the smallest residual, as a fraction of the energy scale, for which this is
/// checked: a restitution loss may be tiny compared with everything else, and correct although the residual is as large.
const RESIDUAL_OF_WORK: f64 = 0.1;
const NOTEWORTHY: f64 = 1e-3;
/// Fraction of the energies present below which a residual is rounding.
const ROUNDING: f64 = 1e-9;
/// Time to cross the smallest clearance at a negligible speed, s. A mechanism at rest has almost no energy: energies below those
/// of all bodies at this speed do not count.
const CROSSING_TIME: f64 = 0.1;
/// Allowed fraction of time in which stability limits an explicit method's steps, and the loosest tolerance at which such steps
/// still conserve energy.
const MAX_STABILITY_LIMITED: f64 = 0.1;
const LOOSEST_TOLERANCE: f64 = 3e-5;

/// A state and its machine under the state's conditions.
struct DoubtContext<'a> {
    machine: Machine,
    state: &'a State,
}

/// As [`Model::doubts`].
pub(super) fn doubts(model: &Model, state: &State) -> Vec<Doubt> {
    let machine = model.machine().with_conditions(&state.conditions, &state.elements);
    DoubtContext { machine, state }.doubts()
}

impl DoubtContext<'_> {
    /// Reasons not to trust the results since the last reset; empty if there are none. Begins with
    /// [`crate::machine::Machine::doubts`] of the machine as it is running.
    fn doubts(&self) -> Vec<Doubt> {
        let machine = self.machine.doubts().into_iter().map(Doubt::Machine);
        let mut doubts: Vec<Doubt> = machine.collect();
        let statistics = self.state.statistics();
        let part = |part: u64, j: usize| part as f64 / statistics.joints[j].impacts.max(1) as f64;
        let unresolved = self.worst(0.0, |j| part(statistics.joints[j].coarse, j));
        doubts.extend(unresolved.map(|(joints, j)| Doubt::Unresolved {
            joints,
            short: statistics.joints[j].coarse,
            contacts: statistics.joints[j].impacts,
            steps: MIN_IMPACT_STEPS,
        }));
        let below_speed_floor = self.worst(MAX_BELOW_SPEED_FLOOR, |j| part(statistics.joints[j].below_speed_floor, j));
        doubts.extend(below_speed_floor.map(|(joints, j)| Doubt::BelowSpeedFloor {
            joints,
            slow: statistics.joints[j].below_speed_floor,
            contacts: statistics.joints[j].impacts,
        }));
        let late = self.worst(0.0, |j| statistics.joints[j].late);
        doubts.extend(late.map(|(joints, j)| Doubt::Late { joints, depth: statistics.joints[j].late }));
        let rebounds = self.worst(MAX_RESTITUTION_EXCESS, |j| {
            statistics.joints[j].excessive_rebound.map_or(0.0, |impact| impact.restitution_excess())
        });
        doubts.extend(rebounds.and_then(|(joints, j)| {
            let impact = statistics.joints[j].excessive_rebound?;
            Some(Doubt::Rebound { joints, time: impact.end, achieved: impact.achieved(), law: impact.law })
        }));
        let patch = self.worst(MAX_PATCH, |j| self.largest_patch(j));
        doubts.extend(patch.map(|(joints, j)| Doubt::Patch { joints, radii: self.largest_patch(j) }));
        let travel = |j: usize| match self.machine.loose_joints[j].kind {
            LooseKind::Pin(Pin { travel, .. }) => travel.unwrap_or(f64::INFINITY),
            LooseKind::Ball | LooseKind::Slide(_) => f64::INFINITY,
        };
        let travelled = self.worst(1.0, |j| statistics.joints[j].axial / travel(j));
        doubts.extend(travelled.map(|(joints, j)| Doubt::Travel {
            joints,
            distance: statistics.joints[j].axial,
            travel: travel(j),
        }));
        let size = |j: usize| match self.machine.loose_joints[j].kind {
            LooseKind::Slide(Slide { half_length, .. }) => half_length,
            LooseKind::Ball | LooseKind::Pin(_) => self.machine.loose_joints[j].contact.ball_radius,
        };
        let deepest = |j: usize| {
            // Bumps are higher than their sum: few walls need to be asked.
            let highest = self.state.profiles(j).flatten().copied().fold(0.0, f64::max);
            if highest <= MAX_WORN * size(j) {
                return highest;
            }
            self.state.worn_walls(&self.machine, j).iter().map(WornWall::deepest).fold(0.0, f64::max)
        };
        let depth = |j: usize| self.state.worn(j).into_iter().fold(deepest(j), f64::max);
        let worn = self.worst(MAX_WORN, |j| depth(j) / size(j));
        doubts.extend(worn.map(|(joints, j)| Doubt::Worn { joints, depth: depth(j), size: size(j) }));
        let damping = self.worst(MAX_DAMPING, |j| statistics.joints[j].overdamped.excess());
        doubts.extend(damping.map(|(joints, j)| {
            let Overdamped { time, ratio, usual } = statistics.joints[j].overdamped;
            Doubt::Damping { joints, time, ratio, usual }
        }));
        doubts.extend(self.state.record.starts_inside.map(|(i, [depth, usual], force)| {
            let element = &self.machine.elements[i];
            Doubt::StartsInside { stop: element.name.clone(), turns: element.is_on_hinge(), depth, usual, force }
        }));
        let clearances = self.machine.loose_joints.iter().map(|j| j.contact.clearance);
        let least = clearances.filter(|c| *c > 0.0).reduce(f64::min);
        let distance = statistics.constraint_drift;
        if distance > least.map_or(DRIFT, |c| DRIFT.min(DRIFT_OF_CLEARANCE * c)) {
            doubts.push(Doubt::Drift { distance });
        }
        if let Some(ledger) = self.state.ledger() {
            doubts.extend(self.energy_doubt(ledger));
        }
        doubts.extend(self.stability_doubt());
        doubts
    }

    /// Doubts about unaccounted energy, compared with the energy held and lost or with each work, and about negative losses.
    fn energy_doubt(&self, ledger: &Ledger) -> Option<Doubt> {
        let residual = ledger.residual();
        let clearances = self.machine.loose_joints.iter().map(|j| j.contact.clearance);
        let least = clearances.filter(|c| *c > 0.0).fold(DRIFT, f64::min);
        let mass: f64 = self.machine.bodies.iter().map(|body| body.mass).sum();
        let slow = mass * (least / CROSSING_TIME) * (least / CROSSING_TIME);
        let scale = ledger.scale() + slow;
        let may_drive = |joint: &LooseJoint| joint.contact.friction_velocity != FrictionVelocity::Surface;
        let losses = [
            (LedgerTerm::Restitution, ledger.restitution_loss),
            (
                LedgerTerm::Friction,
                if self.machine.loose_joints.iter().any(may_drive) { 0.0 } else { ledger.friction_loss },
            ),
            (LedgerTerm::Damping, ledger.damping_loss),
        ];
        if let Some((work, value)) = losses.into_iter().find(|(_, loss)| *loss < -RESIDUAL * scale) {
            return Some(Doubt::Gain { work, value });
        }
        if !(residual.abs() > ROUNDING * (self.state.record.account.energy() + slow)) {
            return None;
        }
        let share = residual.abs() / scale;
        if share > RESIDUAL {
            return Some(Doubt::Energy { residual, share });
        }
        let works = [
            (LedgerTerm::Drives, ledger.drive_work),
            (LedgerTerm::Gravity, ledger.gravity_work),
            (LedgerTerm::Restitution, ledger.restitution_loss),
            (LedgerTerm::Friction, ledger.friction_loss),
            (LedgerTerm::Clearance, ledger.clearance_work),
            (LedgerTerm::Damping, ledger.damping_loss),
            (LedgerTerm::External, ledger.external_work),
            (LedgerTerm::Changes, ledger.change_work),
        ];
        let least = works.into_iter().filter(|(_, value)| *value != 0.0).min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let beyond = |value: f64| residual.abs() > RESIDUAL_OF_WORK * value.abs() && share > NOTEWORTHY;
        least.filter(|(_, value)| beyond(*value)).map(|(work, value)| Doubt::Work { work, value, residual })
    }

    /// An explicit method at a loose tolerance, limited by stability and not by its error: the estimate then says little
    /// about how much energy settled contacts lose.
    fn stability_doubt(&self) -> Option<Doubt> {
        let solver = &self.machine.solver;
        let share = self.state.statistics().stability_limited_time / self.state.now.t;
        let loose = solver.method == Method::DormandPrince5 && solver.tolerance > LOOSEST_TOLERANCE;
        (loose && share > MAX_STABILITY_LIMITED).then_some(Doubt::StabilityLimited {
            share,
            tolerance: solver.tolerance,
            loosest: LOOSEST_TOLERANCE,
        })
    }

    /// The joint for which `measure` is largest and above `limit`, and how many others are above it.
    fn worst(&self, limit: f64, measure: impl Fn(usize) -> f64) -> Option<(AffectedJoints, usize)> {
        let joints = &self.machine.loose_joints;
        let beyond = || (0..joints.len()).filter(|&j| measure(j) > limit);
        let worst = beyond().max_by(|&a, &b| measure(a).total_cmp(&measure(b)))?;
        let joints = AffectedJoints { worst: joints[worst].name.clone(), others: beyond().count() - 1 };
        Some((joints, worst))
    }

    /// Coefficients of joint `j`.
    fn coefficients(&self, j: usize) -> Coefficients {
        Coefficients::new(&self.machine.loose_joints[j].contact, self.state.clearance(j))
    }

    /// Radius of the contact patch at the largest force so far, in radii of the ball, the pin or the corner; 0 for an ideal joint and
    /// without contact.
    fn largest_patch(&self, j: usize) -> f64 {
        let joint = &self.machine.loose_joints[j];
        if joint.contact.is_ideal() {
            return 0.0;
        }
        let c = self.coefficients(j);
        let force = self.state.statistics().joints[j].peak_normal;
        if let LooseKind::Slide(Slide { corner_radius, .. }) = joint.kind {
            // A sphere on a plane.
            let depth = ElasticLaw::of_corner(&joint.contact, corner_radius).depth(force);
            return libm::sqrt(depth / corner_radius);
        }
        let depth = c.elastic.depth(force / joint.kind.share());
        c.elastic.patch(c.ball_radius, c.clearance, depth).map_or(0.0, |patch| patch / c.ball_radius)
    }
}
