//! Mechanisms that come near a singular pose, where the reactions of ideal joints explode even if all rods reach.

use jointplay_physics::machine::Formulation;
use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_physics::units::format_quantity_digits;
use jointplay_scene::Scene;

/// Instants per drive period at which the ideal mechanism is examined.
const INSTANTS: u32 = 400;

/// Drive frequency of this check, Hz, as in the paper.
const SLOW: f64 = 0.5;

/// Reactions above this many times the weight of all bodies indicate a mechanism about to lose its stiffness.
const MOST_WEIGHTS: f64 = 5.0;

/// A mechanism that comes near a singular pose.
pub enum NearSingular {
    /// It gets stuck at this time, s.
    Stuck(f64),
    /// Largest reaction, N, and its time, s.
    Loaded(f64, f64),
}

impl std::fmt::Display for NearSingular {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Stuck(time) => write!(f, "the ideal mechanism has a singular pose near t = {time:.3} s"),
            Self::Loaded(largest, when) => write!(
                f,
                "the mechanism comes near a singular pose: with ideal joints and a slow drive a reaction reaches {} at \
                 t = {when:.3} s, more than {MOST_WEIGHTS} times the weight of all bodies",
                format_quantity_digits(*largest, "N", 4)
            ),
        }
    }
}

/// Looks for a nearly singular pose of a scene whose drives prescribe the motion of the ideal mechanism.
pub fn near_singular(scene: &Scene) -> Option<NearSingular> {
    let mut rigid = scene.clone();
    rigid.machine.formulation = Formulation::Tree;
    rigid.machine.elements.clear();
    let form = rigid.machine.closed_form.as_mut()?;
    // Drives at rest have a single pose.
    let instants = if form.frequency > 0.0 { INSTANTS } else { 0 };
    // At a low frequency only weight loads the joints; the poses do not depend on it.
    form.pace = if form.frequency > 0.0 { SLOW / form.frequency } else { 1.0 };
    let period = 1.0 / SLOW;
    for joint in &mut rigid.machine.ball_joints {
        joint.contact.clearance = 0.0;
    }
    let limit = MOST_WEIGHTS * 9.81 * rigid.machine.bodies.iter().map(|body| body.mass).sum::<f64>();
    let mut simulation = Simulation::new(&rigid.machine).ok()?;
    // Any other motion would need a simulation of arbitrary length.
    if !simulation.mechanism().is_kinematic() {
        return None;
    }
    let mut frame = Frame::default();
    let (mut largest, mut when) = (0.0, 0.0);
    for k in 0..=instants {
        let time = period * f64::from(k) / f64::from(INSTANTS);
        if simulation.advance_to(time).is_err() {
            return Some(NearSingular::Stuck(simulation.time()));
        }
        simulation.sample(time, &mut frame);
        for joint in &frame.joints {
            if joint.normal_force.norm() > largest {
                (largest, when) = (joint.normal_force.norm(), time);
            }
        }
    }
    (largest > limit).then_some(NearSingular::Loaded(largest, when))
}
