//! Wear that widens the play (Archard 1953): closed forms, the balance of the worn volume, the ledger, states and live changes.

use std::f64::consts::PI;

use crate::bristles::TURNING;
use crate::common::{Changes, METHODS, frame_now, pair, pair_joints, parse, replaced, run_until};
use crate::joint_elements::momenta;
use jointplay_physics::machine::Vec3;
use jointplay_physics::simulate::{Effect, Simulation};
use jointplay_scene::{LiveScene, SavedState};

/// A pin of 1 kg, 10 mm in radius and 24 mm long, that turns in its bearing at 100 rad/s, where it rests on the wall from the start: so deep
/// that each end bears half of its weight of 10 N.
const PIN: &str = r#"
    gravity = { x = 0, y = 0, z = "-10 m/s^2" }
    [contact]
    friction_law = "none"
    friction = 0.2
    wear_coefficient = "1e-8 m^2/N"
    [solver]
    method = "dopri5"
    tolerance = 1e-9
    [[body]]
    name = "pin"
    mass = "1 kg"
    inertia = "5e-5 1.6e-4 1.6e-4 kg m^2"
    [[joint]]
    name = "J"
    kind = "revolute"
    child = "pin"
    axis = [1, 0, 0]
    play = { radial = "0.1 mm", length = "24 mm", radius = "10 mm", ends = "pin", stiffness = "1e10 N/m^1.5" }
    start = { velocity = "100 rad/s", offset = "0 0 -0.101 mm" }
"#;

/// One joint of each kind, thrown about in its play: a ball, a pin with collars, a piston, and a block.
const KINDS: &str = r#"
    gravity = { x = 0, y = 0, z = "-10 m/s^2" }
    [contact]
    friction = 0.02
    wear_coefficient = "1e-8 m^2/N"
    [solver]
    method = "dopri5"
    tolerance = 1e-9
    [[body]]
    name = "bob"
    mass = "0.1 kg"
    inertia = "4e-6 4e-6 4e-6 kg m^2"
    [[joint]]
    name = "bob"
    kind = "free"
    child = "bob"
    start = { position = "0 0 0 mm", velocity = "0.03 0.05 -0.1 m/s", angular_velocity = "20 30 5 rad/s" }
    [[ball_joint]]
    name = "ball"
    socket = { body = "world" }
    ball = { body = "bob" }
    [[body]]
    name = "pin"
    mass = "0.1 kg"
    inertia = "5e-6 1.6e-5 1.6e-5 kg m^2"
    [[joint]]
    name = "collars"
    kind = "revolute"
    child = "pin"
    parent_point = "0 0.2 0 m"
    axis = [1, 0, 0]
    play = { radial = "0.1 mm", axial = "0.05 mm", length = "24 mm", radius = "10 mm", face_radius = "15 mm" }
    start = { velocity = "20 rad/s", offset_velocity = "0.3 0.1 -0.2 m/s", tilt_velocity = "0 3 -2 rad/s" }
    [[body]]
    name = "piston"
    mass = "0.2 kg"
    inertia = "3e-5 3e-5 3e-5 kg m^2"
    [[joint]]
    name = "bore"
    kind = "cylindrical"
    child = "piston"
    parent_point = "0 0.4 0 m"
    axis = [0, 1, 0]
    play = { radial = "0.05 mm", length = "30 mm", radius = "12 mm", ends = "pin" }
    start = { velocity = "0.1 m/s", angular_velocity = "15 rad/s", offset_velocity = "0.1 0 0.05 m/s" }
    [[body]]
    name = "block"
    mass = "0.2 kg"
    inertia = "3e-5 3e-5 3e-5 kg m^2"
    [[joint]]
    name = "guide"
    kind = "prismatic"
    child = "block"
    parent_point = "0 0.6 0 m"
    axis = [1, 0, 0]
    play = { y = "0.05 mm", z = "0.1 mm", half_length = "25 mm", half_y = "20 mm", half_z = "10 mm" }
    start = { velocity = "0.5 m/s", offset_velocity = "0 0.1 0.2 m/s" }
"#;

/// Ways in which a joint wears.
const SHAPES: [&str; 2] = ["even", "profile"];

/// 2 pi r L, m^2; and its rate of depth, k N w r / A, m/s.
const AREA: f64 = 2.0 * PI * 0.01 * 0.024;
const RATE: f64 = 1e-8 * 10.0 * 100.0 * 0.01 / AREA;

/// The pin, which sinks as fast as its bearing wears, so that nothing oscillates.
fn sinking() -> String {
    let velocity = format!("offset = \"0 0 -0.101 mm\", offset_velocity = \"0 0 -{RATE} m/s\"");
    replaced(PIN, "offset = \"0 0 -0.101 mm\"", &velocity)
}

fn start(text: &str, changes: &Changes) -> LiveScene {
    LiveScene::new(&parse(text, changes)).unwrap()
}

/// Run of a scene by a method.
fn run_by(method: &str, text: &str, changes: &Changes, end: f64) -> LiveScene {
    let changes: Vec<_> = [("solver.method", method)].iter().chain(changes).copied().collect();
    let mut simulation = start(text, &changes);
    run_until(&mut simulation, end);
    simulation
}

fn worn(simulation: &Simulation) -> f64 {
    simulation.state().worn(0)[0]
}

#[test]
fn a_turning_pin_under_its_weight_wears_by_the_closed_form() {
    for method in METHODS {
        let mut simulation = run_by(method, &sinking(), &[], 0.1);
        let (got, expected) = (worn(&simulation), RATE * 0.1);
        let volume = simulation.state().worn_volumes(simulation.machine(), 0)[0];
        println!("{method}: {:e}, {} steps", got / expected - 1.0, simulation.statistics().steps);
        assert!((volume / (1e-8 * 10.0 * 1.0 * 0.1) - 1.0).abs() < 1e-9, "{method}: {volume:e}");
        assert!((got / expected - 1.0).abs() < 1e-9, "{method}");
        let frame = frame_now(&mut simulation);
        assert_eq!(frame.joints[0].worn, [got, 0.0]);
        assert_eq!(frame.joints[0].clearance, 1e-4 + got);
    }
}

/// What friction has dissipated at each joint, from a wear map, J.
fn friction_work(simulation: &Simulation, j: usize) -> f64 {
    simulation.wear().unwrap().cells(j).iter().map(|cell| cell.friction_work).sum()
}

#[test]
fn the_worn_volume_is_the_work_of_friction_over_its_coefficient() {
    // All slides faster than the ramp of friction, so that its power is c_f N |v|: two quadratures of the same integral.
    for (method, shape) in METHODS.into_iter().flat_map(|method| SHAPES.map(|shape| (method, shape))) {
        let scene = parse(KINDS, &[("solver.method", method), ("contact.wear_shape", shape)]);
        let mut simulation = LiveScene::new(&scene).unwrap();
        simulation.track_wear();
        run_until(&mut simulation, 0.004);
        simulation.commit_wear();
        // Friction of the discrete-gradient method opposes the sliding at the end of a step, its work has the mean.
        let tolerance = if method == "discrete-gradient" { 1e-3 } else { 1e-11 };
        let mut total = 0.0;
        for (j, joint) in scene.machine.loose_joints.iter().enumerate() {
            let volume: f64 = simulation.state().worn_volumes(simulation.machine(), j).iter().sum();
            let expected = 1e-8 / 0.02 * friction_work(&simulation, j);
            println!("{method} {shape} {}: {volume:e} {:e}", joint.name, volume / expected - 1.0);
            assert!(expected > 1e-12, "{method} {}", joint.name);
            assert!((volume / expected - 1.0).abs() < tolerance, "{method} {}: {volume:e} {expected:e}", joint.name);
            total += volume;
        }
        let loss = simulation.ledger().unwrap().friction_loss;
        assert!((total * 0.02 / 1e-8 / loss - 1.0).abs() < tolerance, "{method}: {total:e} {loss:e}");
    }
}

#[test]
fn areas_are_those_of_the_surfaces_that_share_a_play() {
    // mm^2: the sphere; the cylinder, and the rings of two collars; the cylinder; two faces of 50 x 20 and of 50 x 40 mm.
    let expected = [
        ("ball", 0, 4.0 * PI * 100.0),
        ("collars", 0, 2.0 * PI * 10.0 * 24.0),
        ("collars", 1, 2.0 * PI * (225.0 - 100.0)),
        ("bore", 0, 2.0 * PI * 12.0 * 30.0),
        ("guide", 0, 2.0 * 50.0 * 20.0),
        ("guide", 1, 2.0 * 50.0 * 40.0),
    ];
    let machine = parse(KINDS, &[]).machine;
    for (name, play, area) in expected {
        let joint = machine.loose_joints.iter().find(|joint| joint.name == name).unwrap();
        let got = joint.kind.wearing_area(&joint.contact, play).unwrap();
        assert!((got / (1e-6 * area) - 1.0).abs() < 1e-14, "{name} {play}: {got:e}");
    }
}

#[test]
fn methods_agree_on_what_wears() {
    // A profile moves at the ends of steps alone: the less it wears in one, the better methods agree.
    for (shape, wear, few_steps) in [(SHAPES[0], "1e-9 m^2/N", 1e-3), (SHAPES[1], "1e-11 m^2/N", 3e-3)] {
        let [shape, wear] = [("contact.wear_shape", shape), ("contact.wear_coefficient", wear)];
        let reference = run_by("radau5", KINDS, &[wear, shape, ("solver.tolerance", "1e-11")], 0.004);
        let cases = [
            ("dopri5", ("solver.tolerance", "1e-10"), 1e-4),
            ("automatic", ("solver.tolerance", "1e-10"), 1e-4),
            ("radau5", ("solver.tolerance", "1e-9"), 1e-4),
            ("rk4", ("solver.step", "0.5 us"), 1e-4),
            ("discrete-gradient", ("solver.steps_per_impact", "160"), few_steps),
        ];
        for (method, accuracy, tolerance) in cases {
            let got = run_by(method, KINDS, &[wear, shape, accuracy], 0.004);
            for j in 0..4 {
                for (got, expected) in got.state().worn(j).into_iter().zip(reference.state().worn(j)) {
                    println!("{method} {} {j}: {expected:e} {:e}", shape.1, got / expected - 1.0);
                    assert!((got - expected).abs() <= tolerance * expected, "{method} {j}: {got:e} {expected:e}");
                }
            }
        }
    }
}

#[test]
fn the_ledger_is_closed_as_without_wear() {
    for method in METHODS {
        let residual = |wear: &str, shape: &str| {
            let changes = [("contact.wear_coefficient", wear), ("contact.wear_shape", shape), ("solver.step", "1 us")];
            let simulation = run_by(method, KINDS, &changes, 0.01);
            let ledger = *simulation.ledger().unwrap();
            (ledger.share(), ledger.clearance_work)
        };
        for shape in SHAPES {
            let ((without, none), (with, work)) = (residual("0", shape), residual("1e-8 m^2/N", shape));
            println!("{method} {shape}: {without:e}, with wear {with:e}, work {work:e}");
            assert!(none.abs() < 1e-15, "{method}: {none:e}");
            assert!(work < -1e-7, "{method}: {work:e}");
            assert!(with < 1.5 * without + 1e-8, "{method}: {without:e} {with:e}");
        }
    }
}

#[test]
fn a_run_continues_from_a_saved_state_with_the_same_bits() {
    const WRITER: [&str; 2] = ["jointplay", "test"];
    for (method, shape) in METHODS.into_iter().flat_map(|method| SHAPES.map(|shape| (method, shape))) {
        let shape = ("contact.wear_shape", shape);
        let mut simulation = run_by(method, KINDS, &[shape], 0.002);
        let snapshot = simulation.snapshot();
        let text = SavedState::write(WRITER, simulation.pending(), &snapshot, simulation.time()).unwrap();
        assert!(worn(&simulation) > 0.0 && simulation.state().worn(1)[0] > 0.0);
        run_until(&mut simulation, 0.003);

        let saved = SavedState::read(WRITER, text.as_bytes()).unwrap();
        let mut resumed = start(KINDS, &[("solver.method", method), shape]);
        resumed.resume(&saved.snapshot).unwrap();
        run_until(&mut resumed, 0.003);
        assert_eq!(resumed.state(), simulation.state(), "{method}");

        let mut back = run_by(method, KINDS, &[shape], 0.001);
        back.restore(&snapshot);
        run_until(&mut back, 0.003);
        assert_eq!(back.state(), simulation.state(), "{method}");
    }
}

#[test]
fn until_something_has_worn_the_hash_is_that_without_wear() {
    for shape in SHAPES {
        let [mut none, mut some] = ["0", "1e-8 m^2/N"]
            .map(|wear| start(KINDS, &[("contact.wear_coefficient", wear), ("contact.wear_shape", shape)]));
        assert_eq!(none.state_hash(), some.state_hash());
        // In free flight and up to the first impact nothing differs, and nothing is evaluated more often.
        while none.statistics().impacts() == 0 {
            none.step().unwrap();
            some.step().unwrap();
            assert_eq!(none.state_hash(), some.state_hash());
        }
        assert_eq!(none.statistics().evaluations, some.statistics().evaluations);
        for _ in 0..5 {
            none.step().unwrap();
            some.step().unwrap();
        }
        assert_ne!(none.state_hash(), some.state_hash());
    }
}

#[test]
fn a_profile_that_nothing_has_worn_moves_as_a_round_wall() {
    for method in METHODS {
        let [even, profile] = SHAPES.map(|shape| {
            let none = ("contact.wear_coefficient", "0 m^2/N");
            run_by(method, KINDS, &[none, ("contact.wear_shape", shape)], 0.01)
        });
        assert_eq!(even.state().vector(), profile.state().vector(), "{method}");
        assert_eq!(even.state_hash(), profile.state_hash(), "{method}");
    }
}

/// Mean depth worn off a bearing in which the pin has cut its own shape, `depth` deep, m: the wall between the unworn one and that of the
/// pin in its groove, which is rounded at the tip by a twentieth of the way.
fn cut(clearance: f64, depth: f64) -> f64 {
    let tip = 0.05 * (clearance + depth);
    let (unworn, reach) = (clearance - tip, clearance + depth - tip);
    let edge = (unworn / reach).acos();
    (reach * edge.sin() - unworn * edge) / PI
}

#[test]
fn a_steady_load_cuts_the_shape_of_the_pin() {
    // A pin that turns under its weight sinks until its own circle and that of the bearing enclose what has worn off, and leans neither
    // way: nothing rubs against it.
    for (method, ends) in METHODS.into_iter().flat_map(|method| ["pin", "bearing"].map(|ends| (method, ends))) {
        let text = replaced(PIN, "ends = \"pin\"", &format!("ends = \"{ends}\""));
        let changes = [("contact.wear_shape", "profile"), ("contact.wear_coefficient", "1e-7 m^2/N")];
        let mut simulation = run_by(method, &text, &changes, 0.05);
        let volume = simulation.state().worn_volumes(simulation.machine(), 0)[0];
        let e = frame_now(&mut simulation).joints[0].eccentricity;
        // Each end bears half of the weight.
        let depth = -e.z - 1e-4 - (5.0_f64 / 0.5e10).powf(1.0 / 1.5);
        let expected = volume / AREA;
        let got = cut(1e-4, depth);
        println!("{method} {ends}: {volume:e} m^3, {depth:e} m deep, {got:e} of {expected:e}");
        assert!((got / expected - 1.0).abs() < 0.03, "{method} {ends}: {got:e} {expected:e}");
        assert!(e.y.abs() < 1e-9 && e.x == 0.0, "{method} {ends}: {e}");
    }
}

#[test]
fn a_bearing_far_from_the_origin_wears_as_at_it() {
    let changes = [("contact.wear_shape", "profile"), ("contact.wear_coefficient", "1e-7 m^2/N")];
    let far = |point: &str| replaced(PIN, "axis = [1, 0, 0]", &format!("axis = [1, 0, 0]\nparent_point = \"{point}\""));
    for method in METHODS {
        let deepest = |text: &str| {
            let simulation = run_by(method, text, &changes, 0.02);
            assert!(simulation.ledger().unwrap().share() < 1e-5, "{method}");
            simulation.state().worn_walls(simulation.machine(), 0)[0].deepest()
        };
        let (here, there) = (deepest(PIN), deepest(&far("1000 -500 300 m")));
        println!("{method}: {here:e} {:e}", there / here - 1.0);
        assert!((there / here - 1.0).abs() < 1e-4, "{method}: {here:e} {there:e}");
    }
}

#[test]
fn steps_longer_than_an_impact_wear_too() {
    let changes = [("solver.steps_per_impact", "2"), ("contact.wear_shape", "profile")];
    let text = replaced(KINDS, "radial = \"0.1 mm\"", "radial = \"0.002 mm\"")
        .replace("[contact]", "[contact]\nclearance = \"0.001 mm\"");
    let simulation = run_by("discrete-gradient", &text, &changes, 0.02);
    for j in 0..4 {
        let worn = simulation.state().worn(j);
        assert!(worn[0] > 0.0 && worn[0] < 1e-4, "{j}: {worn:?}");
    }
}

#[test]
fn in_the_middle_of_a_wall_that_has_worn_on_all_sides_nothing_touches() {
    // Worn by twice the play, the wall is three times as far, also beyond the middle.
    let text = replaced(PIN, "\"-10 m/s^2\"", "\"0 m/s^2\"");
    let start_there = "offset = \"0 0 -0.099 mm\", offset_velocity = \"0 0.01 0.3 m/s\"";
    let text = replaced(&text, "offset = \"0 0 -0.101 mm\"", start_there);
    for method in METHODS {
        let changes = [("solver.method", method), ("contact.wear_shape", "profile"), ("solver.step", "1 us")];
        let mut simulation = start(&text, &changes);
        simulation.set_profiles(0, &[vec![2e-4; 72], vec![2e-4; 72]]).unwrap();
        while simulation.statistics().impacts() == 0 {
            simulation.step().unwrap();
        }
        let e = frame_now(&mut simulation).joints[0].eccentricity;
        println!("{method}: {e}");
        assert!((e.norm() - 3e-4).abs() < 5e-6 && e.z > 2.9e-4, "{method}: {e}");
    }
}

#[test]
fn bristles_slide_in_a_groove_as_coulomb_friction_does() {
    let loss = |ends: &str, law: &str| {
        let text = replaced(PIN, "ends = \"pin\"", &format!("ends = \"{ends}\""));
        let text = replaced(&text, "friction_law = \"none\"", &format!("friction_law = \"{law}\""));
        let changes = [("contact.wear_shape", "profile"), ("contact.wear_coefficient", "1e-7 m^2/N")];
        run_by("radau5", &text, &changes, 0.05).ledger().unwrap().friction_loss
    };
    for ends in ["pin", "bearing"] {
        let [bristle, coulomb] = ["bristle", "modified-coulomb"].map(|law| loss(ends, law));
        println!("{ends}: {bristle:e} {coulomb:e}");
        assert!((bristle / coulomb - 1.0).abs() < 1e-6, "{ends}: {bristle:e} {coulomb:e}");
    }
}

#[test]
fn a_wall_that_has_worn_through_stops_the_run() {
    let changes = [("contact.wear_shape", "profile"), ("contact.wear_coefficient", "1e-6 m^2/N")];
    let mut simulation = start(&replaced(PIN, "\"1 kg\"", "\"20 kg\""), &changes);
    let stopped = loop {
        if let Err(stopped) = simulation.step() {
            break stopped.to_string();
        }
        assert!(simulation.time() < 1.0);
    };
    assert!(
        stopped.contains("joint J: its wall has worn by 1.") && stopped.contains("more than its radius"),
        "{stopped}"
    );
}

#[test]
fn a_groove_twice_as_deep_as_the_clearance_is_stepped_like_any_wall() {
    // Where the pin fits its groove the normal turns fast; in a wall with two lowest points it would jump.
    for method in METHODS {
        let changes = [("contact.wear_shape", "profile"), ("contact.wear_coefficient", "2e-7 m^2/N")];
        let text = replaced(PIN, "friction_law = \"none\"", "friction_law = \"modified-coulomb\"");
        let simulation = run_by(method, &text, &changes, 0.04);
        let deepest = simulation.state().worn_walls(simulation.machine(), 0)[0].deepest();
        let (steps, share) = (simulation.statistics().steps, simulation.ledger().unwrap().share());
        println!("{method}: {deepest:e} m, {steps} steps, ledger {share:e}");
        assert!(deepest > 1.5e-4 && share < 1e-5 && steps < 10_000, "{method}: {deepest:e} {share:e} {steps}");
    }
}

#[test]
fn a_wall_that_turns_under_a_steady_load_wears_evenly() {
    for method in ["automatic", "radau5", "dopri5", "discrete-gradient"] {
        let changes = [
            ("solver.method", method),
            ("contact.friction_law", "modified-coulomb"),
            ("contact.wear_coefficient", "1e-15 m^2/N"),
            ("contact.wear_shape", "profile"),
        ];
        let mut simulation = start(TURNING, &changes);
        // 31.8 turns.
        run_until(&mut simulation, 2.0);
        for wall in simulation.state().worn_walls(simulation.machine(), 0) {
            let depths: Vec<f64> = (0..360)
                .map(|degrees| f64::from(degrees).to_radians().sin_cos())
                .map(|(sine, cosine)| wall.depth(&Vec3::new(cosine, 0.0, sine)))
                .collect();
            let mean = depths.iter().sum::<f64>() / 360.0;
            let [least, most] = [f64::min, f64::max].map(|of| depths.iter().copied().reduce(of).unwrap() / mean);
            println!("{method}: {least} to {most} of {mean:e} m, {} steps", simulation.statistics().steps);
            assert!(mean > 1e-14 && least > 0.96 && most < 1.04, "{method}: {least} to {most} of {mean:e} m");
        }
    }
}

#[test]
fn what_wears_no_more_limits_no_step() {
    for method in ["automatic", "radau5"] {
        let changes = [
            ("solver.method", method),
            ("contact.friction_law", "modified-coulomb"),
            ("contact.wear_coefficient", "1e-15 m^2/N"),
            ("contact.wear_shape", "profile"),
        ];
        let mut simulation = start(TURNING, &changes);
        run_until(&mut simulation, 1.0);
        let worn = simulation.statistics().steps;
        assert_eq!(simulation.set("contact.wear_coefficient", "0 m^2/N"), Ok(Effect::Now));
        run_until(&mut simulation, 2.0);
        let more = simulation.statistics().steps - worn;
        assert!(worn > 500 && more < 250, "{method}: {worn}, then {more}");
    }
}

#[test]
fn worn_walls_keep_momentum_and_the_formulations_agree() {
    let settings = "[contact]\nwear_coefficient = \"1e-7 m^2/N\"\nwear_shape = \"profile\"\nclearance = \"0.1 mm\"\n\
        [solver]\ntolerance = 1e-10\nstep = \"1 us\"\n";
    for (place, kind) in pair_joints(0.0).iter().enumerate() {
        let text = pair(settings, kind, 0.0, "");
        for method in METHODS {
            let [tree, lagrange] = ["tree", "lagrange"].map(|formulation| {
                let changes = [("solver.method", method), ("formulation", formulation)];
                let mut simulation = start(&text, &changes);
                let machine = simulation.machine().clone();
                let before = momenta(&frame_now(&mut simulation), &machine);
                run_until(&mut simulation, 0.004);
                let after = momenta(&frame_now(&mut simulation), &machine);
                let off = [0, 1].map(|i| (after[i] - before[i]).norm() / before[i].norm());
                let worn = worn(&simulation);
                // A ball has the two points of force of the paper, a few micrometres apart.
                let turning = match method {
                    _ if place == 0 => 1e-4,
                    "discrete-gradient" => 1e-6,
                    _ => 1e-12,
                };
                assert!(off[0] < 1e-13 && off[1] < turning, "{method} {formulation}: {off:?} {kind}");
                assert!(worn > 1e-6);
                worn
            });
            assert!((tree / lagrange - 1.0).abs() < 1e-6, "{method}: {tree:e} {lagrange:e}");
        }
    }
}

#[test]
fn changed_wear_and_changed_play_act_from_now_on() {
    for method in METHODS {
        let mut simulation = run_by(method, &sinking(), &[], 0.02);
        let before = worn(&simulation);
        // Four times the wear: from rest a little later, as the pin must first fall faster.
        assert_eq!(simulation.set("contact.wear_coefficient", "4e-8 m^2/N"), Ok(Effect::Now));
        run_until(&mut simulation, 0.04);
        let faster = worn(&simulation);
        assert!((before / (0.02 * RATE) - 1.0).abs() < 1e-9, "{method}");
        assert!(((faster - before) / (0.08 * RATE) - 1.0).abs() < 2e-3, "{method}: {:e}", faster - before);
        // More play: the pin falls the rest of the way, and wears the wall as before. The worn part stays.
        assert_eq!(simulation.set("joint.J.play.radial", "0.12 mm"), Ok(Effect::Now));
        assert_eq!(worn(&simulation), faster);
        let frame = frame_now(&mut simulation);
        assert_eq!((frame.joints[0].clearance, frame.joints[0].worn[0]), (1.2e-4 + faster, faster));
        run_until(&mut simulation, 0.05);
        // Less play ramps the wall, which goes on wearing.
        let between = worn(&simulation);
        assert!(between > faster, "{method}");
        assert_eq!(simulation.set("joint.J.play.radial", "0.1 mm"), Ok(Effect::Now));
        run_until(&mut simulation, 0.07);
        let after = worn(&simulation);
        assert!(after > between, "{method}");
        assert!((simulation.state().plays(0)[0] - (1e-4 + after)).abs() < 1e-18, "{method}");
        // And without it nothing more.
        assert_eq!(simulation.set("contact.wear_coefficient", "0"), Ok(Effect::Now));
        run_until(&mut simulation, 0.08);
        assert_eq!(worn(&simulation), after, "{method}");
        assert!(simulation.ledger().unwrap().share() < 1e-6, "{method}: {:e}", simulation.ledger().unwrap().share());
    }
}

#[test]
fn a_run_with_the_worn_depth_in_its_play_continues_another() {
    let run = run_by("dopri5", &sinking(), &[], 0.02);
    let depth = worn(&run);
    let wider = format!("{} m", 1e-4 + depth);
    let fresh = replaced(
        &replaced(&sinking(), "radial = \"0.1 mm\"", &format!("radial = \"{wider}\"")),
        "-0.101 mm",
        &format!("{} mm", -0.101 - 1e3 * depth),
    );
    let again = run_by("dopri5", &fresh, &[], 0.02);
    let straight = run_by("dopri5", &sinking(), &[], 0.04);
    assert!((depth + worn(&again) - worn(&straight)).abs() < 1e-9 * worn(&straight));
}

#[test]
fn joints_without_a_wearing_surface_are_refused() {
    let refused = |text: &str, words: [&str; 4]| {
        let error = jointplay_scene::Scene::parse(text, None, &[]).expect_err(text).to_string();
        for word in words {
            assert!(error.contains(word), "{error}\nlacks {word}");
        }
    };
    let planar = replaced(PIN, "length = \"24 mm\"", "planar = true");
    refused(&planar, ["wear_coefficient", "1e-8 m^2/N", "planar pin", "allowed without it 0 m^2/N"]);
    let line = replaced(&planar, "planar = true", "planar = true, length = \"24 mm\", elastic = \"line\"");
    let line = replaced(&line, ", stiffness = \"1e10 N/m^1.5\"", "");
    assert_eq!(
        parse(&line, &[]).machine.loose_joints[0]
            .kind
            .wearing_area(&parse(&line, &[]).machine.loose_joints[0].contact, 0),
        Some(AREA)
    );
    let collars = replaced(KINDS, ", face_radius = \"15 mm\"", "");
    refused(&collars, ["wear_coefficient", "face_radius", "collars", "0 m^2/N"]);
    let block = replaced(KINDS, "z = \"0.1 mm\", ", "planar = true, ").replace(", half_z = \"10 mm\"", "");
    refused(&block, ["wear_coefficient", "planar block", "guide", "0 m^2/N"]);
    let beyond = replaced(PIN, "1e-8 m^2/N", "1 m^2/N");
    refused(&beyond, ["wear_coefficient", "1 m^2/N", "allowed", "1e-6"]);
    // The same in the unit of the literature.
    let mm = parse(&replaced(PIN, "1e-8 m^2/N", "10 mm^3/(N m)"), &[]);
    assert_eq!(mm.machine.loose_joints[0].contact.wear_coefficient, 1e-8);
}

#[test]
fn a_play_worn_wide_is_doubted() {
    let doubts = |wear: &str| {
        let run = run_by("dopri5", PIN, &[("contact.wear_coefficient", wear)], 0.2);
        run.doubts().iter().map(ToString::to_string).collect::<String>()
    };
    assert!(!doubts("1e-8 m^2/N").contains("worn"));
    let deep = doubts("1e-6 m^2/N");
    assert!(deep.contains("J: its play has worn") && deep.contains("a tenth of 10 mm"), "{deep}");
}

#[test]
fn worn_depths_converge_with_the_square_of_the_step_or_with_damping_with_the_step() {
    // The pin starts at rest and oscillates about its place on the receding wall. Damping feels the speed of the wall, which is that at the
    // start of each step.
    for (law, least_ratio, most) in [("hertz", 3.5, 2e-6), ("lankarani-nikravesh", 1.8, 1e-6)] {
        let depth = |step: &str| worn(&run_by("rk4", PIN, &[("solver.step", step), ("contact.normal_law", law)], 5e-3));
        let reference = depth("0.1 us");
        let errors = ["8 us", "4 us", "2 us"].map(|step| (depth(step) / reference - 1.0).abs());
        println!("{law}: {errors:?}");
        assert!(errors[0] < most, "{law}: {errors:?}");
        assert!(errors.windows(2).all(|pair| pair[0] > least_ratio * pair[1]), "{law}: {errors:?}");
    }
}

#[test]
fn a_restart_keeps_what_has_worn_off() {
    let mut simulation = run_by("dopri5", PIN, &[], 0.01);
    let (depth, vector) = (worn(&simulation), simulation.state_vector().to_vec());
    simulation.restart_at(0.0, &vector).unwrap();
    assert!(depth > 0.0);
    assert_eq!(worn(&simulation), depth);
    assert_eq!(simulation.state().plays(0)[0], 1e-4 + depth);
    run_until(&mut simulation, 0.01);
    assert!((worn(&simulation) / (2.0 * depth) - 1.0).abs() < 0.01);
    // A reset makes the joint new.
    simulation.reset().unwrap();
    assert_eq!(worn(&simulation), 0.0);
}
