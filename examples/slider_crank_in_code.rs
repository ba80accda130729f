//! A slider-crank built in code instead of read from a scene file. The crank turns five times a second; the ball at its pin is ideal,
//! the one at the slider has 0.1 mm of play. At which crank angle is that joint loaded most?
//!
//!     cargo run --example slider_crank_in_code

use std::error::Error;
use std::f64::consts::TAU;

use jointplay_physics::machine::{Attachment, Body, Drive, Joint, LooseJoint, Machine, Mat3, StartRule, Vec3};
use jointplay_physics::simulate::{Frame, Simulation};

// Indices of the bodies. The mechanism lies in the x-z plane, and the crank turns about y.
const CRANK: usize = 0;
const ROD: usize = 1;
const SLIDER: usize = 2;
// Turns of the crank per second; lengths in m.
const TURNS: f64 = 5.0;
const RADIUS: f64 = 0.05;
const LENGTH: f64 = 0.2;

fn main() -> Result<(), Box<dyn Error>> {
    let inertia = |x: f64, y: f64, z: f64| Mat3::from_diagonal(&Vec3::new(x, y, z));
    // The crank has its frame at its hinge; the rod has its frame at its middle, with x along the rod.
    let crank = Body::new("crank", 0.3, inertia(1e-5, 1e-4, 1e-4));
    let rod = Body::new("rod", 0.2, inertia(1e-5, 7e-4, 7e-4));
    let slider = Body::new("slider", 0.5, inertia(2e-4, 2e-4, 2e-4));
    let turning = Drive::Constant { position: 0.0, velocity: TURNS * TAU };
    let along = |x: f64| Vec3::new(x, 0.0, 0.0);

    let pin = LooseJoint::ball("pin", Attachment::on(CRANK, along(RADIUS)), Attachment::on(ROD, along(-LENGTH / 2.0)));
    let mut loose =
        LooseJoint::ball("loose", Attachment::on(SLIDER, along(0.0)), Attachment::on(ROD, along(LENGTH / 2.0)));
    loose.contact.friction = 0.05;
    let machine = Machine {
        gravity: Vec3::new(0.0, 0.0, -9.81),
        bodies: vec![crank, rod, slider],
        joints: vec![
            Joint::revolute(None, CRANK, Vec3::y()).with_drive(turning),
            Joint::free_at(ROD, along(RADIUS + LENGTH / 2.0)),
            Joint::prismatic(None, SLIDER, Vec3::x()).with_start(RADIUS + LENGTH, 0.0),
        ],
        loose_joints: vec![pin.with_clearance(0.0), loose.with_clearance(0.1e-3)],
        // The positions above are initial guesses; the velocities follow from the drive.
        start: StartRule::Ideal,
        ..Machine::default()
    };

    // The first half second is a transient. Each call of `take_peaks` returns the peaks since the previous call.
    let mut simulation = Simulation::new(&machine)?;
    let mut peaks = Vec::new();
    simulation.advance_to(0.5)?;
    simulation.take_peaks(&mut peaks);
    simulation.advance_to(1.0)?;
    simulation.take_peaks(&mut peaks);
    let peak = &peaks[1];
    println!("the loose joint begins {} contacts in half a second", peak.impacts);
    println!("largest force {:.0} N, where the crank is at {:.0}°", peak.normal, (360.0 * TURNS * peak.time) % 360.0);

    // After whole turns the slider is back at its dead centre, apart from the play.
    let mut frame = Frame::default();
    simulation.sample(1.0, &mut frame);
    let slider_position = frame.bodies[SLIDER].position.x;
    assert!((slider_position - (RADIUS + LENGTH)).abs() < 0.2e-3);
    assert!(peak.normal > 100.0 && peak.impacts > 1);
    Ok(())
}
