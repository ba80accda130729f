//! A start in static equilibrium: the bodies are at rest where the forces can balance; otherwise the start is refused. The rest is
//! a minimum of the potential energy, downhill from the start values.

use crate::common::{parse, scene};
use jointplay_physics::contact::Coefficients;
use jointplay_physics::machine::Vec3;
use jointplay_physics::mechanism::UnstableRest;
use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_scene::{BUILT_IN, LiveScene, Scene};

const G: f64 = 9.81;

/// A mass of 2 kg on a slide along z.
fn mass(start: &str, more: &str) -> String {
    mass_of("2 kg", start, more)
}

/// A mass on a slide along z.
fn mass_of(mass: &str, start: &str, more: &str) -> String {
    format!(
        "start = \"equilibrium\"\n[gravity]\nz = \"-{G} m/s^2\"\n\
         [[body]]\nname = \"mass\"\nmass = \"{mass}\"\ninertia = \"1e-2 1e-2 1e-2 kg m^2\"\n\
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

/// The unstable rest that the search met, if any.
fn unstable_rest(scene: &Scene) -> Option<UnstableRest> {
    let simulation = Simulation::new(&scene.machine).unwrap_or_else(|error| panic!("{error}"));
    simulation.mechanism().assembly().unstable_rest
}

/// Angle at the start of a body that turns about y, degrees.
fn angle_at_start(scene: &Scene, body: usize) -> f64 {
    let rotation = frame_at_start(scene).bodies[body].rotation;
    rotation[(0, 2)].atan2(rotation[(2, 2)]).to_degrees()
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
    let contact = &scene.machine.loose_joints[0].contact;
    let weight = scene.machine.bodies.iter().map(|body| body.mass).sum::<f64>() * G;
    let depth = Coefficients::new(contact, contact.clearance).elastic.depth(weight);
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

const SWITCH: &str = include_str!("../trials/switch.toml");
const SNAP: &str = include_str!("../trials/snap.toml");
const STACK: &str = include_str!("../trials/stack-up.toml");

#[test]
fn a_rocker_rests_on_the_stop_to_which_it_leans_whatever_its_mass() {
    for mass in ["1 mg", "2 g", "200 g", "1000 kg"] {
        let text = SWITCH.replace("2 g", mass);
        for start in ["0.01 deg", "0.3 deg", "2 deg", "9 deg", "14 deg", "-0.01 deg", "-14 deg"] {
            let scene = parse(&text, &[("parameter.q0", start)]);
            let angle = angle_at_start(&scene, 0);
            let expected = if start.starts_with('-') { -15.109 } else { 15.109 };
            assert!((angle - expected).abs() < 5e-4, "{mass} from {start}: {angle}");
            assert_eq!(unstable_rest(&scene), None, "{mass} from {start}");
        }
    }
}

#[test]
fn an_unstable_rest_without_a_slope_is_left_to_one_side_and_that_is_said() {
    let scene = parse(SWITCH, &[("parameter.q0", "0 deg")]);
    assert!((angle_at_start(&scene, 0) - 15.109).abs() < 5e-4);
    assert_eq!(unstable_rest(&scene), Some(UnstableRest::Left));
}

#[test]
fn a_truss_snaps_to_the_side_on_which_it_starts() {
    let position = |start: &str| {
        let scene = parse(&SNAP.replace("\"0.05 m\"", &format!("\"{start} m\"")), &[]);
        (frame_at_start(&scene).bodies[0].position.z, unstable_rest(&scene))
    };
    for start in ["0.001", "0.05", "0.1", "0.2", "0.29", "0.6", "1.5"] {
        for sign in ["", "-"] {
            let (z, unstable) = position(&format!("{sign}{start}"));
            let expected = if sign.is_empty() { 0.3 } else { -0.3 };
            assert!((z - expected).abs() < 1e-9, "{sign}{start}: {z}");
            assert_eq!(unstable, None, "{sign}{start}");
        }
    }
    let (z, unstable) = position("0");
    assert!((z - 0.3).abs() < 1e-9, "{z}");
    assert_eq!(unstable, Some(UnstableRest::Left));
}

#[test]
fn an_unstable_rest_without_a_stable_one_is_kept_and_that_is_said() {
    let text = "start = \"equilibrium\"\n[gravity]\nz = 0\n\
         [[body]]\nname = \"mass\"\nmass = \"2 kg\"\ninertia = \"1e-2 1e-2 1e-2 kg m^2\"\n\
         [[joint]]\nname = \"guide\"\nkind = \"prismatic\"\nchild = \"mass\"\naxis = [0, 0, 1]\n\
         [[joint_spring]]\nname = \"s\"\njoint = \"guide\"\ncharacteristic = [[\"-1 m\", \"100 N\"], [\"0 m\", \"0 N\"], [\"1 m\", \"-100 N\"]]\n";
    let scene = parse(text, &[]);
    assert_eq!(frame_at_start(&scene).bodies[0].position.z, 0.0);
    assert_eq!(unstable_rest(&scene), Some(UnstableRest::Kept));
}

#[test]
fn a_pendulum_hangs_below_its_hinge_from_any_angle_at_any_mass() {
    for mass in ["1e-6 kg", "1 kg", "1e3 kg"] {
        for (start, unstable) in
            [("1", None), ("90", None), ("179", None), ("179.999", None), ("180", Some(UnstableRest::Left))]
        {
            let text = format!(
                "start = \"equilibrium\"\n[gravity]\nz = \"-{G} m/s^2\"\n\
                 [[body]]\nname = \"arm\"\nmass = \"{mass}\"\ninertia = \"1e-2 1e-2 1e-2 kg m^2\"\n\
                 [[joint]]\nname = \"h\"\nkind = \"revolute\"\nchild = \"arm\"\nchild_point = \"0 0 3 m\"\naxis = [0, 1, 0]\n\
                 start = {{ position = \"{start} deg\" }}\n"
            );
            let scene = parse(&text, &[]);
            let position = frame_at_start(&scene).bodies[0].position;
            assert!((position - Vec3::new(0.0, 0.0, -3.0)).norm() < 1e-7, "{mass} {start}: {position}");
            assert_eq!(unstable_rest(&scene), unstable, "{mass} {start}");
        }
    }
}

#[test]
fn every_unit_of_a_stack_starts_and_hangs_lower_by_the_sum_of_its_gaps() {
    let mut gaps = vec![[0.167977, 0.196908, 0.058872]];
    // Additive recurrence of the plastic number's generalisation: evenly spread, without random numbers.
    gaps.extend((1..=60).map(|k| {
        let part = |step: f64| (f64::from(k) * step).fract();
        [0.05 + 0.3 * part(0.819_172_5), 0.05 + 0.2 * part(0.671_043_6), 0.05 + 0.1 * part(0.549_700_5)]
    }));
    for gaps in gaps {
        let changes: Vec<(String, String)> =
            (1..).zip(gaps).map(|(k, gap)| (format!("joint.J{k}.clearance"), format!("{gap} mm"))).collect();
        let changes: Vec<(&str, &str)> = changes.iter().map(|(key, value)| (&key[..], &value[..])).collect();
        let scene = parse(STACK, &changes);
        let frame = frame_at_start(&scene);
        let depths: f64 = frame.joints.iter().map(|joint| joint.penetration).sum();
        let lower = -frame.bodies[2].position.z - 0.25;
        let expected = 1e-3 * gaps.iter().sum::<f64>() + depths;
        assert!((lower - expected).abs() < 1e-9 && depths < 1e-6, "{gaps:?}: {lower} {expected}");
        for (joint, weight) in frame.joints.iter().zip([0.9 * G, 0.6 * G, 0.3 * G]) {
            assert!((joint.normal_force.norm() / weight - 1.0).abs() < 1e-6, "{gaps:?}");
        }
    }
}

/// A mass on a slide between two rods on loose balls, whose other ends press against springs: it snaps through between its rests at
/// about 62.45 mm on either side.
fn toggle(start: f64, clearance: &str, mass: f64, gravity: f64) -> String {
    let x = (0.2 * 0.2 - start * start).sqrt();
    let mut text = format!(
        "start = \"equilibrium\"\n[gravity]\nz = \"-{gravity} m/s^2\"\n[contact]\nclearance = \"{clearance}\"\nfriction = 0.3\n\
         [[body]]\nname = \"m\"\nmass = \"{mass} kg\"\ninertia = \"1e-4 1e-4 1e-4 kg m^2\"\n\
         [[joint]]\nname = \"m\"\nkind = \"prismatic\"\nchild = \"m\"\naxis = [0, 0, 1]\nstart = {{ position = \"{start} m\" }}\n"
    );
    for (side, sign) in [("a", 1.0), ("b", -1.0)] {
        text += &format!(
            "[[body]]\nname = \"shoe_{side}\"\nmass = \"{mass} kg\"\ninertia = \"1e-4 1e-4 1e-4 kg m^2\"\n\
             [[joint]]\nname = \"shoe_{side}\"\nkind = \"prismatic\"\nchild = \"shoe_{side}\"\naxis = [{sign}, 0, 0]\n\
             start = {{ position = \"{x} m\" }}\n\
             [[joint_spring]]\nname = \"spring_{side}\"\njoint = \"shoe_{side}\"\nposition = \"0.19 m\"\nstiffness = \"20 N/mm\"\n\
             [[body]]\nname = \"rod_{side}\"\nmass = \"{} kg\"\ninertia = \"1e-6 1e-5 1e-5 kg m^2\"\n\
             [[joint]]\nname = \"rod_{side}\"\nkind = \"free\"\nchild = \"rod_{side}\"\n\
             start = {{ position = [\"{} m\", 0, \"{} m\"], rotation = {{ x = [{}, 0, {start}], y = [0, 1, 0] }} }}\n\
             [[ball_joint]]\nname = \"inner_{side}\"\nsocket = {{ body = \"m\" }}\nball = {{ body = \"rod_{side}\", at = \"0.1 0 0 m\" }}\n\
             [[ball_joint]]\nname = \"outer_{side}\"\nsocket = {{ body = \"shoe_{side}\" }}\n\
             ball = {{ body = \"rod_{side}\", at = \"-0.1 0 0 m\" }}\n",
            0.1 * mass,
            sign * 0.5 * x,
            0.5 * start,
            -sign * x,
        );
    }
    text
}

#[test]
fn a_toggle_rests_on_its_own_side_with_ideal_and_with_loose_balls() {
    let rest = (0.2_f64 * 0.2 - 0.19 * 0.19).sqrt();
    for clearance in ["0 mm", "0.1 mm"] {
        for mass in [0.01, 0.3, 100.0] {
            for (start, side) in [(1e-4, 1.0), (0.02, 1.0), (-0.01, -1.0), (0.09, 1.0)] {
                let z = frame_at_start(&parse(&toggle(start, clearance, mass, 0.0), &[])).bodies[0].position.z;
                // Without a load the balls have not yet met their walls.
                assert!((z - side * rest).abs() < 1e-6, "{clearance}, {mass} kg from {start} m: {z}");
            }
            for start in [-0.05, -0.01] {
                let scene = parse(&toggle(start, clearance, mass, G), &[]);
                let frame = frame_at_start(&scene);
                assert!(frame.bodies[0].position.z < -rest, "{clearance}, {mass} kg from {start} m");
                let touching = frame.joints.iter().filter(|joint| joint.penetration > 0.0).count();
                assert!(clearance == "0 mm" || touching == 4, "{mass} kg from {start} m: {touching} balls touch");
            }
        }
    }
}

#[test]
fn a_light_mass_rests_on_a_stiff_tyre_and_on_a_stiff_stop() {
    for mass in ["1e-6 kg", "2 kg", "1e3 kg"] {
        for (more, expected) in [
            ("[[tyre]]\nname = \"t\"\non = { body = \"mass\" }\nradius = \"0.3 m\"\nstiffness = \"2e8 N/m\"\n", 0.3),
            (
                "[[stop]]\nname = \"e\"\njoint = \"guide\"\nlower = \"-100 mm\"\nforce = \"1e6 N\"\ndepth = \"1 um\"\n",
                -0.1,
            ),
        ] {
            let scene = parse(&mass_of(mass, "2 m", more), &[]);
            let z = frame_at_start(&scene).bodies[0].position.z;
            assert!((z - expected).abs() < 1e-4 && z < expected + 1e-15, "{mass}: {z}");
        }
    }
}
