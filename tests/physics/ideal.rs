//! The ideal motion with which a probe is compared: the same machine without play, in closed form or simulated alongside.

use crate::common::scene;
use jointplay_physics::machine::{Machine, Vec3};
use jointplay_physics::simulate::{Effect, Frame, Simulation};

/// Tip of the probe in the ideal motion at `time`.
fn ideal_tip(simulation: &mut Simulation, time: f64) -> Vec3 {
    let mut frame = Frame::default();
    simulation.advance_to(time).expect("runs");
    simulation.sample(time, &mut frame);
    let output = simulation.machine().output.clone();
    let body = &frame.bodies[output.body];
    body.position + body.rotation * output.probe.expect("has a probe") - frame.probe_error.expect("continues")
}

#[test]
fn the_simulated_ideal_motion_agrees_with_the_closed_form_of_the_paper() {
    let machine = Machine::clone(&scene("spcmm", &[]).machine);
    let mut alongside = machine.clone();
    alongside.closed_form.as_mut().expect("has one").path = None;
    let mut simulations = [machine, alongside].map(|machine| Simulation::new(&machine).expect("starts"));
    for k in 0..40 {
        // Times between step ends of either motion.
        let time = 0.0137 * f64::from(k);
        let [known, simulated] = simulations.each_mut().map(|simulation| ideal_tip(simulation, time));
        let off = (known - simulated).norm();
        assert!(off < 1e-10, "{off:e} at {time}");
    }
}

#[test]
fn a_change_of_gravity_takes_effect_at_its_instant() {
    let mut machine = Machine::clone(&scene("pendulum", &[]).machine);
    machine.output.probe = Some(Vec3::new(0.0, 0.0, -0.1));
    let mut simulation = Simulation::new(&machine).expect("starts");
    let before = ideal_tip(&mut simulation, 0.045);
    simulation.advance_to(0.05).expect("runs");
    let change = simulation.time();
    let weightless = Machine { gravity: Vec3::zeros(), ..machine };
    assert_eq!(simulation.adopt(&weightless), Ok(Effect::Now));
    // Without gravity a rod in an ideal joint rotates uniformly: its tip stays on its circle, at its speed.
    let tips = [0.0, 0.01, 0.02].map(|ahead| ideal_tip(&mut simulation, change + ahead));
    let angle = |a: Vec3, b: Vec3| libm::atan2(a.cross(&b).norm(), a.dot(&b));
    let (first, second) = (angle(tips[0], tips[1]), angle(tips[1], tips[2]));
    assert!(first > 0.01 && (first - second).abs() < 1e-9, "{first} {second}");
    assert!((angle(before, tips[0]) / (change - 0.045) - first / 0.01).abs() > 1e-4);
}
