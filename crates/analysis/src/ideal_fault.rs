//! Checks of the motion without play of a machine with a closed form: whether it comes near a singular pose, where the
//! reactions of ideal joints grow without bound even if all rods are long enough, and whether it follows the path from which
//! tip errors are measured.

use jointplay_physics::machine::{Formulation, Machine, Output};
use jointplay_physics::mechanism::OFF_PATH;
use jointplay_physics::simulate::{Frame, Simulation, StopFault, closed};
use jointplay_physics::units::format_quantity_digits;
use jointplay_scene::Scene;

/// Instants per drive period at which the ideal mechanism is examined.
const INSTANTS: u32 = 400;

/// Number of instants at which a simulated motion is compared with its path.
const COMPARED: u32 = 40;

/// Longest duration of that simulation, s.
const MAX_DURATION: f64 = 10.0;

/// Drive frequency at which reactions are checked, Hz, as in the paper.
const SLOW: f64 = 0.5;

/// Reactions above this many times the weight of all bodies indicate a mechanism about to lose its stiffness.
const MAX_WEIGHTS: f64 = 5.0;

/// A fault of the motion without play.
#[derive(Debug, thiserror::Error)]
pub enum IdealFault {
    /// The motion gets stuck at this time, s.
    #[error("the ideal mechanism has a singular pose near t = {0:.3} s")]
    Stuck(f64),
    /// A reaction beyond the limit: the largest, N, and its time, s.
    #[error(
        "the mechanism comes near a singular pose: with ideal joints and a slow drive a reaction reaches {} at t = {:.3} s, \
         more than {MAX_WEIGHTS} times the weight of all bodies",
        format_quantity_digits(*.0, "N", 4),
        .1
    )]
    HighReaction(f64, f64),
    /// A time, s, and the distance from the path in closed form at that time, m.
    #[error(
        "at t = {:.3} s the mechanism without play is {} off the path of its output body in [closed_form], from which tip \
         errors are measured",
        .0,
        format_quantity_digits(*.1, "mm", 4)
    )]
    OffPath(f64, f64),
    /// No fault up to this time, s, at which the examination was cut short.
    #[error(
        "the motion without play was examined for singular poses and for its path only up to t = {0:.3e} s, because that took \
         too long"
    )]
    NotExamined(f64),
}

/// Checks the motion without play of a scene whose drives prescribe it: whether it follows its path in closed form, and whether
/// it comes near a singular pose. `may_continue` is asked between steps: small fixed steps, for example, can take for ever.
pub fn ideal_fault(scene: &Scene, mut may_continue: impl FnMut() -> bool) -> Option<IdealFault> {
    let mut rigid = Machine::clone(&scene.machine);
    rigid.formulation = Formulation::Tree;
    rigid.elements.clear();
    let form = rigid.closed_form.as_mut()?;
    // Drives at rest have a single pose.
    let instants = if form.frequency > 0.0 { INSTANTS } else { 0 };
    // At a low frequency only weight loads the joints; the poses do not depend on the frequency.
    form.pace = if form.frequency > 0.0 { SLOW / form.frequency } else { 1.0 };
    let (pace, period) = (form.pace, 1.0 / SLOW);
    for joint in &mut rigid.loose_joints {
        joint.contact = joint.contact.without_play();
    }
    let limit = MAX_WEIGHTS * 9.81 * rigid.bodies.iter().map(|body| body.mass).sum::<f64>();
    let mut simulation = Simulation::new(&rigid).ok()?;
    // Reactions in any other motion would need a simulation of arbitrary length.
    if !simulation.mechanism().is_kinematic() {
        return off_path(&scene.machine, may_continue);
    }
    let mut frame = Frame::default();
    let (mut largest, mut when) = (0.0, 0.0);
    for k in 0..=instants {
        let time = period * f64::from(k) / f64::from(INSTANTS);
        if !may_continue() {
            return Some(IdealFault::NotExamined(pace * simulation.time()));
        }
        if let Err(stopped) = simulation.advance_to(time) {
            return Some(match stopped.fault {
                StopFault::OffPath { distance } => IdealFault::OffPath(pace * stopped.time, distance),
                _ => IdealFault::Stuck(stopped.time),
            });
        }
        simulation.sample(time, &mut frame);
        for joint in &frame.joints {
            if joint.normal_force.norm() > largest {
                (largest, when) = (joint.normal_force.norm(), time);
            }
        }
    }
    (largest > limit).then_some(IdealFault::HighReaction(largest, when))
}

/// Simulates the motion without play and compares the probe's tip with its path for one period, or for [`MAX_DURATION`] if that
/// is shorter.
fn off_path(machine: &Machine, mut may_continue: impl FnMut() -> bool) -> Option<IdealFault> {
    let form = machine.closed_form.as_ref().filter(|form| form.path.is_some() && form.frequency > 0.0)?;
    let end = f64::min(1.0 / (form.frequency * form.pace), MAX_DURATION);
    let ideal = closed(machine);
    let output = Output { probe: machine.output.probe, ..ideal.output };
    let mut simulation = Simulation::new(&Machine { output, ..ideal }).ok()?;
    let mut frame = Frame::default();
    (1..=COMPARED).find_map(|k| {
        let time = end * f64::from(k) / f64::from(COMPARED);
        while simulation.time() < time {
            if !may_continue() {
                return Some(IdealFault::NotExamined(simulation.time()));
            }
            simulation.step().ok()?;
        }
        simulation.sample(time, &mut frame);
        let distance = frame.probe_error?.norm();
        (distance > OFF_PATH).then_some(IdealFault::OffPath(time, distance))
    })
}
