//! Settled start: every ball rests on its socket wall where the reaction of the same machine without play presses it, so that a
//! run does not begin with a drop.

use super::assembly::Settled;
use super::{ActiveSet, Mechanism, MechanismError};
use crate::contact::{Coefficients, Parameters};
use crate::machine::{Formulation, Machine, StartRule, Vec3};

/// Fixed-point iterations between reactions and ball positions. The positions change the reactions by about the ratio of
/// clearance to machine size, typically a thousandth, and each iteration reduces the error by that factor.
const ITERATIONS: usize = 4;

/// Settled start of `machine` at t = 0, with the velocities of the machine without play. The tree coordinates and velocities
/// `near`, if given, replace its start values.
///
/// # Errors
/// The machine without play does not start.
pub(super) fn settle(machine: &Machine, near: Option<&[f64]>) -> Result<Settled, MechanismError> {
    let mut ideal = without_play(machine);
    let mut mechanism = Mechanism::with_guess(&ideal, near)?;
    // Held elsewhere than at t = 0, it is off its path, too.
    let mut state = if near.is_some() { mechanism.start_off_path() } else { mechanism.start() }?;
    let assembly = mechanism.assembly().clone();
    for _ in 0..ITERATIONS {
        let mut rate = vec![0.0; state.len()];
        mechanism.evaluator(ActiveSet::Nothing).evaluate_fully(0.0, &state, &mut rate);
        for (j, joint) in machine.loose_joints.iter().enumerate() {
            if joint.contact.is_ideal() {
                continue;
            }
            // Balls that share a load in an indeterminate way stay centred: the loops could not close with both on a wall.
            let force = mechanism.reaction(j).filter(|_| mechanism.is_reaction_unique(j));
            let force = force.unwrap_or_default();
            let eccentricity = resting_eccentricity(&joint.contact, force);
            let in_body_axes = match joint.carried().body {
                Some(body) => mechanism.motion()[body].rotation.tr_mul(&eccentricity),
                None => eccentricity,
            };
            // Without play, this point of the ball's body coincides with the socket centre.
            ideal.loose_joints[j].frames[1].origin.point = joint.carried().point - in_body_axes;
        }
        mechanism = Mechanism::with_guess(&ideal, near)?;
        state = mechanism.start_off_path()?;
    }
    Ok(Settled { state, assembly })
}

/// `machine` with every joint with play ideal, in tree coordinates, to be assembled.
pub(super) fn without_play(machine: &Machine) -> Machine {
    let mut ideal = machine.clone();
    for joint in &mut ideal.loose_joints {
        joint.contact = joint.contact.without_play();
    }
    Machine { start: StartRule::Ideal, formulation: Formulation::Tree, ..ideal }
}

/// Ball centre relative to the socket centre, m, where the wall exerts `force`, N, on the ball. An unloaded ball stays centred.
fn resting_eccentricity(contact: &Parameters, force: Vec3) -> Vec3 {
    let (size, clearance) = (force.norm(), contact.clearance);
    if size > 0.0 {
        let depth = Coefficients::new(contact, clearance).elastic.depth(size);
        force * (-(clearance + depth) / size)
    } else {
        Vec3::zeros()
    }
}
