//! `start = "settled"`: each ball starts with the penetration at which it transmits the reaction of the machine without play.

use crate::common::{frame_now, scene};
use jointplay_physics::machine::{LooseJoint, StartRule};
use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_scene::Scene;

fn start_simulation(name: &str, changes: &[(&str, &str)]) -> Simulation {
    Simulation::new(&scene(name, changes).machine).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Reactions of the ball joints of the scene without play, N.
fn reactions(name: &str) -> Vec<f64> {
    let mut ideal = start_simulation(name, &[("contact.clearance", "0"), ("start", "ideal")]);
    let frame = frame_now(&mut ideal);
    frame.joints.iter().map(|joint| joint.normal_force.norm()).collect()
}

const SCENES: [&str; 5] = ["spcmm", "pendulum", "slider-crank", "slider-crank-driven", "chain"];

#[test]
fn every_contact_begins_with_the_force_of_the_ideal_joint() {
    for name in SCENES {
        for formulation in ["tree", "lagrange"] {
            let changes = [("start", "settled"), ("contact.friction", "0"), ("formulation", formulation)];
            let mut simulation = start_simulation(name, &changes);
            let frame: Frame = frame_now(&mut simulation);
            let loose = |joint: &&LooseJoint| joint.contact.clearance > 0.0;
            let loose = simulation.machine().loose_joints.iter().filter(loose).count();
            let touching = frame.joints.iter().filter(|joint| joint.penetration > 0.0);
            assert_eq!(touching.count(), loose, "{name}");
            for (joint, ideal) in frame.joints.iter().zip(reactions(name)) {
                // The displaced ball changes the reaction by the ratio of clearance to machine size.
                let error = (joint.normal_force.norm() - ideal).abs() / ideal;
                assert!(error < 0.02, "{name} {formulation}: {} N, {ideal} N", joint.normal_force);
                let depth = joint.penetration;
                assert!(depth < 1e-4, "{name}: {depth:e} m under {ideal} N");
            }
        }
    }
}

#[test]
fn a_settled_start_has_no_impact_peaks() {
    for name in SCENES {
        let peak_ratio = |start: &str| {
            let changes = [("start", start), ("contact.friction", "0")];
            let mut simulation = start_simulation(name, &changes);
            simulation.advance_to(0.02).expect("runs");
            let peaks = (0..simulation.machine().loose_joints.len()).map(|j| {
                let (force, _) = simulation.peak(j);
                force
            });
            let ideal = reactions(name);
            peaks.zip(ideal).map(|(peak, ideal)| peak / ideal).fold(0.0, f64::max)
        };
        let (from_centre, settled) = (peak_ratio("ideal"), peak_ratio("settled"));
        assert!(settled < 1.3, "{name}: {settled}");
        assert!(from_centre > 3.0 * settled, "{name}: {from_centre} {settled}");
    }
}

#[test]
fn a_hanging_pendulum_rests_on_its_wall() {
    let text = jointplay_scene::built_in_text("pendulum").expect("built in");
    let scene = Scene::parse(text, None, &[]).expect("reads");
    let mut scene = scene;
    scene.set("start", "settled").expect("a choice");
    assert_eq!(scene.machine.start, StartRule::Settled);
    let mut simulation = Simulation::new(&scene.machine).expect("starts");
    let frame = frame_now(&mut simulation);
    let joint = &frame.joints[0];
    let contact = &scene.machine.loose_joints[0].contact;
    // Hertz: F = K delta^1.5, with the force of the ideal joint.
    let stiffness = jointplay_physics::contact::Coefficients::new(contact, contact.clearance).elastic.stiffness;
    let depth = (reactions("pendulum")[0] / stiffness).powf(2.0 / 3.0);
    assert!((joint.penetration / depth - 1.0).abs() < 0.01, "{} {depth}", joint.penetration);
    assert!((joint.eccentricity.norm() - contact.clearance - depth).abs() < 1e-9);
}

#[test]
fn ideal_and_unloaded_joints_stay_closed() {
    let mut simulation = start_simulation("slider-crank", &[("start", "settled"), ("joint.B.clearance", "0")]);
    let frame = frame_now(&mut simulation);
    assert!(frame.joints[0].eccentricity.norm() < 1e-9);
    assert!(frame.joints[1].penetration > 0.0);
    // Without gravity no force presses the ball.
    let mut floating = start_simulation("pendulum", &[("start", "settled"), ("gravity.z", "0")]);
    let frame = frame_now(&mut floating);
    assert!(frame.joints[0].eccentricity.norm() < 1e-12 && frame.joints[0].normal_force.norm() == 0.0);
}
