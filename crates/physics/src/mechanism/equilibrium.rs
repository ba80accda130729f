//! Start in static equilibrium: every force of springs, bushings, tyres, stops, contacts and gravity in balance, at the values
//! that drives, targets, grounds and load factors have at t = 0. Friction is zero, because nothing slides.
//!
//! `search` descends in the potential energy to a rest, and `stability` finds the ways that lead down from an unstable one. Masses
//! enter as weights alone: the search moves a machine of the same geometry whose bodies all have the mass 1 kg.

mod search;
mod stability;

use super::assembly::{Settled, UnstableRest};
use super::drives::{Trajectory, trajectory_of};
use super::model::Model;
use super::settled::{settle, without_play};
use super::{ActiveSet, Mechanism, MechanismError};
use crate::contact::{ContactState, FrictionLaw};
use crate::machine::{Drive, Formulation, LooseJoint, Machine, Mat3, StartRule, Vec3};
use search::Search;

/// Maximum number of velocity coordinates: the derivative of the forces is taken by differences and is dense.
const MAX_COORDINATES: usize = 400;
/// Maximum number of unstable rests that are left one after the other.
const MAX_DEPARTURES: usize = 20;

/// Start in equilibrium of `machine` at t = 0. The tree coordinates `near`, if given, replace its start values.
///
/// First finds the rest of the machine without play. Then places the balls on their walls where its reactions press them, and
/// continues the search from there: far from rest, balls that slide along their walls would limit the steps.
///
/// # Errors
/// The machine has no settled start, has too many coordinates, or no position of rest is found.
pub(super) fn rest_state(machine: &Machine, near: Option<&[f64]>) -> Result<Settled, MechanismError> {
    let Settled { mut state, mut assembly } = settle(machine, near)?;
    let mut constant = with_constant_laws(machine);
    constant.formulation = Formulation::Tree;
    let play = |joint: &LooseJoint| !joint.contact.is_ideal();
    let mut without = None;
    if constant.loose_joints.iter().any(play) {
        let ideal = without_play(&constant);
        // If there is no rest without play, the search with play reports where it ended.
        if let Ok(rest) = rest_near(&ideal, state.clone()) {
            state = settle(&constant, Some(&rest.state))?.state;
            without = rest.unstable;
        }
    }
    constant.start = StartRule::AsGiven;
    let Rest { state, unstable } = rest_near(&constant, state)?;
    let left = without.map(|_| UnstableRest::Left);
    assembly.unstable_rest = unstable.or(left);
    Ok(Settled { state, assembly })
}

/// A position of rest.
pub(super) struct Rest {
    pub state: Vec<f64>,
    /// The unstable rest that the search met, if any.
    pub unstable: Option<UnstableRest>,
}

/// Rest of `machine`, whose laws are constant, near the tree coordinates `state`.
pub(super) fn rest_near(machine: &Machine, mut state: Vec<f64>) -> Result<Rest, MechanismError> {
    let Model { nq, nv, .. } = Model::new(machine);
    if nv > MAX_COORDINATES {
        return Err(MechanismError::TooLargeForRest { velocities: nv, most: MAX_COORDINATES });
    }
    state[nq..].fill(0.0);
    let mut mechanism = Mechanism::with_guess(&with_unit_masses(machine), Some(&state))?;
    let state = mechanism.start_off_path()?;
    if nv == 0 {
        return Ok(Rest { state, unstable: None });
    }
    let mut search = Search::new(machine, &mut mechanism, &state);
    let mut rest = search.descend(state).or_else(|end| Err(no_rest(machine, &end)?))?;
    let mut unstable = None;
    for _ in 0..MAX_DEPARTURES {
        let departures = search.ways_down(&rest);
        if departures.is_empty() {
            break;
        }
        // A way down to one side alone: the search had stopped short of the rest.
        let is_unstable = departures.len() > 1;
        let lower = departures.into_iter().find_map(|departure| search.descend(departure).ok());
        let Some(lower) = lower else {
            unstable = is_unstable.then_some(UnstableRest::Kept);
            break;
        };
        unstable = unstable.or(is_unstable.then_some(UnstableRest::Left));
        rest = lower;
    }
    Ok(Rest { state: rest, unstable })
}

/// The error for a search that ended at the tree coordinates `state`: names the body with the largest accelerations there.
fn no_rest(machine: &Machine, state: &[f64]) -> Result<MechanismError, MechanismError> {
    let mut mechanism = Mechanism::with_guess(machine, Some(state))?;
    let contact_states = vec![ContactState::default(); mechanism.model.sites.len()];
    let mut derivative = vec![0.0; state.len()];
    let mut evaluator = mechanism.evaluator(ActiveSet::Immediate(&contact_states));
    evaluator.evaluate_fully(0.0, state, &mut derivative);
    let scale = mechanism.model.length_scale;
    let motion = mechanism.motion()[..machine.bodies.len()].iter();
    let accelerations = motion.map(|motion| [motion.acceleration.norm(), motion.angular_acceleration.norm()]);
    let size = |[acceleration, angular]: &[f64; 2]| acceleration + scale * angular;
    let fastest = accelerations.enumerate().max_by(|(_, a), (_, b)| size(a).total_cmp(&size(b)));
    let (body, [acceleration, angular_acceleration]) = fastest.unwrap_or_default();
    Ok(MechanismError::NoRest { body: machine.bodies[body].name.clone(), acceleration, angular_acceleration })
}

/// Distance of the farthest point at which anything acts on each body from its centroid, m; the length scale if all act there.
fn reaches(machine: &Machine) -> Vec<f64> {
    let mut reaches = vec![0.0; machine.bodies.len()];
    for point in machine.points() {
        if let Some(body) = point.body {
            reaches[body] = f64::max(reaches[body], (point.point - machine.bodies[body].centre).norm());
        }
    }
    let scale = machine.length_scale();
    reaches.into_iter().map(|reach| if reach > 0.0 { reach } else { scale }).collect()
}

/// `machine` without gravity, and with a mass of 1 kg in every body, the radius of gyration being its reach. Its accelerations
/// measure forces, and its mass matrix displacements, independently of the masses of `machine`.
fn with_unit_masses(machine: &Machine) -> Machine {
    let mut unit = machine.clone();
    unit.gravity = Vec3::zeros();
    for (body, reach) in unit.bodies.iter_mut().zip(reaches(machine)) {
        body.mass = 1.0;
        body.inertia = Mat3::identity() * (reach * reach);
    }
    unit
}

/// `machine` with the values that every law has at t = 0.
pub(super) fn with_constant_laws(machine: &Machine) -> Machine {
    let mut constant = machine.clone();
    let functions = machine.closed_form.as_ref().map_or(Vec::new(), |form| form.at(0.0));
    let hold = |drive: &mut Drive, turns: bool| {
        let trajectory = trajectory_of(drive, turns);
        let position = match &trajectory {
            Trajectory::Function(function) => functions[function + 1].value,
            Trajectory::Own(law) => law.at(0.0).value,
        };
        *drive = Drive::Constant { position, velocity: 0.0 };
    };
    constant.closed_form = None;
    for joint in &mut constant.joints {
        let freedoms = joint.kind.freedoms();
        let drives = [&mut joint.drive, &mut joint.second_drive];
        for (drive, freedom) in drives.into_iter().zip(freedoms) {
            drive.iter_mut().for_each(|drive| hold(drive, freedom.turns()));
        }
    }
    for element in &mut constant.elements {
        let turns = element.is_on_hinge();
        element.law_mut().into_iter().for_each(|law| hold(law, turns));
    }
    // Nothing slides, and bristles are not bent.
    for joint in &mut constant.loose_joints {
        joint.contact.friction_law = FrictionLaw::None;
    }
    constant
}
