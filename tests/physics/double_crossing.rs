//! A ball that touches its socket wall and leaves it again within one long step is not missed.
//!
//! Symptom: in free flight the pendulum's ball passed 3.4 um through the wall for 3.5 ms without a force, in about one
//! run of a hundred. Cause: both ends of a 10 ms step lay outside the wall, and the cubic through them hid the crossings
//! in between. Contract: no instant has a penetration beyond rounding and no force.

use crate::common::simulation;
use jointplay_physics::simulate::Frame;

#[test]
fn no_ball_penetrates_its_wall_without_a_force() {
    let mut simulation = simulation(
        "pendulum",
        &[("contact.friction", "0"), ("contact.restitution", "1"), ("solver.tolerance", "1e-9")],
    );
    let mut frame = Frame::default();
    for n in 0..=14_800_u32 {
        let t = f64::from(n) * 5e-5;
        simulation.advance_to(t).unwrap();
        simulation.sample(t, &mut frame);
        let joint = &frame.joints[0];
        assert!(
            joint.penetration < 1e-9 || joint.normal_force.norm() > 0.0,
            "{t}: {:e} m deep without a force",
            joint.penetration
        );
    }
}
