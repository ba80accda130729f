//! A body hangs in a socket by a ball with 0.2 mm of play. It is released at the centre of the socket, falls on the wall and
//! rattles there. Prints one line per impact, with the effective restitution beside the one that the force law predicts.
//!
//!     cargo run --example fall_and_rattle

use std::error::Error;

use jointplay_physics::machine::{Attachment, Body, Joint, LooseJoint, Machine, Mat3, Vec3};
use jointplay_physics::simulate::Simulation;

const GRAVITY: f64 = 9.81;
const CLEARANCE: f64 = 0.2e-3;

fn main() -> Result<(), Box<dyn Error>> {
    // The ball is the body's origin, which is its centroid; the socket is a point of the world.
    let socket = Attachment::world(Vec3::zeros());
    let ball = Attachment::on(0, Vec3::zeros());
    let machine = Machine {
        gravity: Vec3::new(0.0, 0.0, -GRAVITY),
        bodies: vec![Body::new("bob", 0.4, Mat3::identity() * 1e-3)],
        joints: vec![Joint::free(0)],
        loose_joints: vec![LooseJoint::ball("S1", socket, ball).with_clearance(CLEARANCE)],
        ..Machine::default()
    };

    let mut simulation = Simulation::new(&machine)?;
    let mut impacts = Vec::new();
    println!("   start   approach   largest force   restitution   of its law");
    while impacts.len() < 8 {
        let first_new = impacts.len();
        simulation.step()?;
        impacts.extend(simulation.take_impacts());
        for impact in &impacts[first_new..] {
            let (start, speed, peak) = (impact.start * 1e3, impact.approach_speed * 1e3, impact.peak);
            let (achieved, law) = (impact.achieved(), impact.law);
            println!("{start:5.2} ms {speed:5.1} mm/s {peak:13.1} N {achieved:13.4} {law:12.4}");
        }
    }

    // Free fall through the clearance: v² = 2 g c. Each rebound is lower than the one before.
    let fallen = f64::sqrt(2.0 * GRAVITY * CLEARANCE);
    assert!((impacts[0].approach_speed / fallen - 1.0).abs() < 1e-3);
    assert!(impacts.windows(2).all(|pair| pair[1].approach_speed < pair[0].approach_speed));
    assert!(impacts.iter().all(|impact| impact.achieved() < impact.law + 1e-3));
    Ok(())
}
