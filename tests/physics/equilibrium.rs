//! A start in static equilibrium: the bodies are at rest where the forces can balance; otherwise the start is refused.

use crate::common::{parse, scene};
use jointplay::contact::{Coefficients, settled_penetration};
use jointplay::machine::Vec3;
use jointplay::scene::{BUILT_IN, LiveScene, Scene};
use jointplay::simulate::{Frame, Simulation};

const G: f64 = 9.81;

/// A mass of 2 kg on a slide along z.
fn mass(start: &str, more: &str) -> String {
    format!(
        "start = \"equilibrium\"\n[gravity]\nz = \"-{G} m/s^2\"\n\
         [[body]]\nname = \"mass\"\nmass = \"2 kg\"\ninertia = \"1e-2 1e-2 1e-2 kg m^2\"\n\
         [[joint]]\nname = \"guide\"\nkind = \"prismatic\"\nchild = \"mass\"\naxis = [0, 0, 1]\n\
         start = {{ position = \"{start}\" }}\n{more}"
    )
}

/// The frame at t = 0.
fn frame_at_start(scene: &Scene) -> Frame {
    let mut simulation = Simulation::new(&scene.machine).unwrap_or_else(|error| panic!("{error}"));
    let mut frame = Frame::default();
    simulation.sample(0.0, &mut frame);
    frame
}

/// Largest speed of a body until `time`, s: m/s and rad/s.
fn max_speeds(scene: &Scene, time: f64) -> [f64; 2] {
    let mut live = LiveScene::new(scene).unwrap_or_else(|error| panic!("{}: {error}", scene.name));
    let mut frame = Frame::default();
    let mut max = [0.0_f64; 2];
    for n in 0..=20 {
        live.advance_to(time * f64::from(n) / 20.0).unwrap();
        let now = live.time();
        live.sample(now, &mut frame);
        for body in &frame.bodies {
            max[0] = max[0].max(body.velocity.norm());
            max[1] = max[1].max(body.angular_velocity.norm());
        }
    }
    max
}

#[test]
fn a_mass_starts_where_its_weight_and_its_springs_balance() {
    let spring = "[[spring]]\nname = \"s\"\nfrom = { body = \"world\", at = \"0 0 1 m\" }\nto = { body = \"mass\" }\n\
                  length = \"1 m\"\nstiffness = \"500 N/m\"\ndamping = \"3 N s/m\"\n";
    let tyre = "[[tyre]]\nname = \"t\"\non = { body = \"mass\" }\nradius = \"0.3 m\"\nstiffness = \"20 kN/m\"\n\
                ground = { law = \"harmonic\", mean = \"50 mm\", amplitude = \"10 mm\", frequency = \"2 Hz\", \
                phase = \"90 deg\" }\n";
    let bushing = "[[bushing]]\nname = \"b\"\nfrom = { body = \"world\" }\nto = { body = \"mass\" }\nstiffness = \"1 2 3 kN/m\"\n";
    let stop = "[[stop]]\nname = \"e\"\njoint = \"guide\"\nlower = \"-100 mm\"\nforce = \"100 N\"\ndepth = \"1 mm\"\n";
    let joint_spring_and_load = "[[joint_spring]]\nname = \"j\"\njoint = \"guide\"\nstiffness = \"1 kN/m\"\n\
                [[load]]\nname = \"l\"\non = { body = \"mass\" }\nforce = \"0 0 5 N\"\n\
                factor = { law = \"formula\", formula = \"2 + sin(t)\" }\n";
    let weight = 2.0 * G;
    for (what, more, expected) in [
        ("spring", spring, -weight / 500.0),
        ("tyre", tyre, 0.36 - weight / 20e3),
        ("bushing", bushing, -weight / 3e3),
        ("stop", stop, -0.1 - 1e-3 * (weight / 100.0).powf(2.0 / 3.0)),
        ("joint spring and load", joint_spring_and_load, (10.0 - weight) / 1e3),
    ] {
        // From the start of the file, from far above, and from a deep penetration of the elements that only push.
        for start in ["0 m", "0.5 m", "-0.12 m"] {
            let scene = parse(&mass(start, more), &[]);
            let frame = frame_at_start(&scene);
            let z = frame.bodies[0].position.z;
            assert!((z - expected).abs() < 1e-9, "{what} from {start}: {z} {expected}");
            assert_eq!(frame.bodies[0].velocity, Vec3::zeros());
        }
    }
    // Without an element that supports the mass.
    let error = Simulation::new(&parse(&mass("0 m", ""), &[]).machine).unwrap_err().to_string();
    assert!(error.contains("no position of rest") && error.contains("body mass accelerates at 9.81 m/s^2"), "{error}");
}

#[test]
fn a_rod_with_play_hangs_at_rest() {
    let scene = scene("pendulum", &[("start", "equilibrium")]);
    let frame = frame_at_start(&scene);
    let contact = &scene.machine.ball_joints[0].contact;
    let weight = scene.machine.bodies.iter().map(|body| body.mass).sum::<f64>() * G;
    let depth = settled_penetration(Coefficients::new(contact, contact.clearance).stiffness, weight);
    let joint = &frame.joints[0];
    assert!((joint.penetration / depth - 1.0).abs() < 1e-6, "{} {depth}", joint.penetration);
    assert!((joint.normal_force.norm() / weight - 1.0).abs() < 1e-6, "{}", joint.normal_force);
    for (formulation, method) in [("tree", "automatic"), ("lagrange", "dopri5"), ("tree", "discrete-gradient")] {
        let scene = crate::common::scene(
            "pendulum",
            &[("start", "equilibrium"), ("formulation", formulation), ("solver.method", method)],
        );
        let [speed, spin] = max_speeds(&scene, 0.1);
        assert!(speed < 1e-6 && spin < 1e-5, "{formulation} {method}: {speed:e} m/s, {spin:e} rad/s");
    }
}

#[test]
fn a_loaded_suspension_starts_at_rest() {
    let scene = scene("suspension", &[("start", "equilibrium"), ("parameter.bump", "0 mm")]);
    let [speed, spin] = max_speeds(&scene, 0.1);
    println!("{speed:e} m/s, {spin:e} rad/s");
    assert!(speed < 1e-5 && spin < 1e-4, "{speed:e} m/s, {spin:e} rad/s");
    // With the start of the file, it drops by the play of its balls.
    let [from_file, _] = max_speeds(&crate::common::scene("suspension", &[("parameter.bump", "0 mm")]), 0.1);
    assert!(from_file > 100.0 * speed, "{from_file:e} {speed:e}");
}

#[test]
fn mechanisms_without_drives_start_at_rest_wherever_their_files_begin() {
    // A deflected pendulum, a chain two metres long, and a spinning crank.
    for name in ["pendulum", "chain", "slider-crank"] {
        let scene = scene(name, &[("start", "equilibrium")]);
        let [speed, spin] = max_speeds(&scene, 0.02);
        println!("{name} {speed:e} m/s, {spin:e} rad/s");
        assert!(speed < 1e-5 && spin < 1e-4, "{name}: {speed:e} m/s, {spin:e} rad/s");
    }
}

#[test]
fn a_chain_too_long_for_the_search_is_refused() {
    // Six velocity coordinates for each link.
    let start_result = |links: &str| {
        let scene = scene("chain", &[("start", "equilibrium"), ("chain.links", links)]);
        Simulation::new(&scene.machine).map(|_| ()).map_err(|error| scene.locate(&error).to_string())
    };
    assert_eq!(start_result("40"), Ok(()));
    let error = start_result("67").unwrap_err();
    assert!(error.contains("402 velocity coordinates") && error.contains("at most 400"), "{error}");
    assert!(error.contains("chain.links = 67"), "{error}");
}

#[test]
fn every_built_in_machine_starts_in_equilibrium_in_both_formulations() {
    for name in BUILT_IN {
        let [tree, lagrange] = ["tree", "lagrange"].map(|formulation| {
            let scene = scene(name, &[("start", "equilibrium"), ("formulation", formulation)]);
            frame_at_start(&scene)
        });
        for (a, b) in tree.bodies.iter().zip(&lagrange.bodies) {
            assert!((a.position - b.position).norm() < 1e-12, "{name}");
        }
        let touching = tree.joints.iter().filter(|joint| joint.penetration > 0.0).count();
        assert!(touching > 0, "{name}: no ball touches its wall");
    }
}
