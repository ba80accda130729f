//! Joints with play in scene files: the table `play` of a `[[joint]]`, its keys, channels and start.

use super::loose_kinds::compare;
use jointplay_physics::machine::{JointStart, LooseKind, Machine};
use jointplay_physics::simulate::{Effect, Frame, Simulation, channels_of};
use jointplay_scene::{LiveScene, Scene, Value};

const THROWN: &str = include_str!("../../assets/benchmarks/thrown-pin.toml");
const CRANK: &str = include_str!("../../assets/benchmarks/crank-pin.toml");
const BLOCK: &str = include_str!("../../assets/benchmarks/released-slide.toml");

fn scene(text: &str, changes: &[(&str, &str)]) -> Scene {
    let own = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
    let changes: Vec<(String, String)> = changes.iter().map(own).collect();
    Scene::parse(text, Some("file.toml"), &changes).unwrap_or_else(|error| panic!("{error}"))
}

fn machine(text: &str, changes: &[(&str, &str)]) -> Machine {
    (*scene(text, changes).machine).clone()
}

#[test]
fn files_give_the_contacts_of_an_independent_program() {
    compare("a", machine(THROWN, &[]), include_str!("joints/a-contacts.csv"), 5.1e-3);
    let shaft = machine(THROWN, &[("joint.J.play.ends", "bearing")]);
    compare("a_shaft", shaft, include_str!("joints/a_shaft-contacts.csv"), 5.1e-3);
    compare("b", machine(THROWN, &[("joint.J.friction", "0")]), include_str!("joints/b-contacts.csv"), 5.1e-3);
    compare("c", machine(CRANK, &[]), include_str!("joints/c-contacts.csv"), 2e-3);
    compare("d1", machine(BLOCK, &[]), include_str!("joints/d1-contacts.csv"), 0.02);
    compare(
        "h",
        machine(include_str!("../../assets/benchmarks/free-housing.toml"), &[]),
        include_str!("joints/h-contacts.csv"),
        8e-3,
    );
}

/// A pendulum of three links, the lower two with play, of which the upper is displaced at the start.
const PENDULUM: &str = r#"
[[body]]
name = "first"
mass = "1 kg"
inertia = "1e-2 1e-2 1e-3 kg m^2"

[[joint]]
name = "A"
kind = "revolute"
child = "first"
axis = [0, 1, 0]
start = { position = "30 deg", velocity = "2 rad/s" }

[[body]]
name = "second"
mass = "1 kg"
inertia = "1e-2 1e-2 1e-3 kg m^2"

[[joint]]
name = "B"
kind = "revolute"
parent = "first"
child = "second"
parent_point = "0 0 -200 mm"
child_point = "0 0 200 mm"
axis = [0, 1, 0]
start = { position = "10 deg", velocity = "-1 rad/s" }
PLAY_B

[[body]]
name = "third"
mass = "1 kg"
inertia = "1e-2 1e-2 1e-3 kg m^2"

[[joint]]
name = "C"
kind = "cylindrical"
parent = "second"
child = "third"
parent_point = "0 0 -200 mm"
child_point = "0 0 200 mm"
axis = [0, 1, 0]
start = { angle = "-20 deg", angular_velocity = "3 rad/s", position = "5 mm", velocity = "0.1 m/s" }
PLAY_C
"#;

fn pendulum(b: &str, c: &str) -> String {
    PENDULUM.replace("PLAY_B", b).replace("PLAY_C", c)
}

fn first_frame(scene: &Scene) -> Frame {
    let mut frame = Frame::default();
    Simulation::new(&scene.machine).unwrap_or_else(|error| panic!("{error}")).sample_now(&mut frame);
    frame
}

const PLAY: &str = "play = { radial = \"0.1 mm\", length = \"24 mm\", radius = \"10 mm\" }";

#[test]
fn a_cut_joint_starts_where_the_ideal_one_does() {
    let ideal = first_frame(&scene(&pendulum("", ""), &[]));
    for (b, c) in [(PLAY, PLAY), ("", PLAY), (PLAY, "")] {
        let loose = first_frame(&scene(&pendulum(b, c), &[]));
        for (ideal, loose) in ideal.bodies.iter().zip(&loose.bodies) {
            assert!((ideal.position - loose.position).norm() < 1e-15, "{b} {c}");
            assert!((ideal.rotation - loose.rotation).norm() < 1e-15, "{b} {c}");
            assert!((ideal.velocity - loose.velocity).norm() < 1e-15, "{b} {c}");
            assert!((ideal.angular_velocity - loose.angular_velocity).norm() < 1e-14, "{b} {c}");
        }
    }
}

#[test]
fn a_displaced_joint_carries_what_hangs_on_it() {
    let displaced = pendulum(PLAY, PLAY).replace(
        "velocity = \"-1 rad/s\" }",
        "velocity = \"-1 rad/s\", offset = \"0.03 0 0.04 mm\", tilt = \"0 0 0.2 deg\", offset_velocity = \"0 0 0.5 m/s\" }",
    );
    let [ideal, moved] = [pendulum(PLAY, PLAY), displaced].map(|text| first_frame(&scene(&text, &[])));
    // In the axes of the first link, which turned by 30 deg about y.
    let [own, was] = [&moved, &ideal].map(|frame| &frame.joints);
    let turn = ideal.bodies[0].rotation;
    let offset = turn.tr_mul(&own[0].eccentricity);
    assert!((offset - nalgebra::Vector3::new(3e-5, 0.0, 4e-5)).norm() < 1e-16, "{offset}");
    assert!((own[0].tilt - 0.2f64.to_radians()).abs() < 1e-12 && was[0].tilt < 1e-15, "{}", own[0].tilt);
    // The joint below is where it was in its parent, with what moves there.
    assert!(own[1].eccentricity.norm() < 1e-15 && (own[1].axial - was[1].axial).abs() < 1e-15);
    assert!((own[1].axial - 5e-3).abs() < 1e-15 && own[1].tilt < 1e-15);
    let point = |frame: &Frame| {
        frame.bodies[1].velocity
            + frame.bodies[1]
                .angular_velocity
                .cross(&(frame.bodies[1].rotation * nalgebra::Vector3::new(0.0, 0.0, 0.2)))
    };
    let faster = turn.tr_mul(&(point(&moved) - point(&ideal)));
    // The point of the first link at the displaced joint is moved along by 2 rad/s.
    let by_turn = 2.0 * 5e-5;
    assert!((faster - nalgebra::Vector3::new(0.0, 0.0, 0.5)).norm() < 1.1 * by_turn, "{faster}");
}

#[test]
fn a_joint_without_play_moves_as_the_tree_joint() {
    let at = |text: &str| {
        let accurate = [("solver.method", "dopri5"), ("solver.tolerance", "1e-11")];
        let mut simulation = Simulation::new(&scene(text, &accurate).machine).unwrap();
        simulation.advance_to(0.3).unwrap();
        let mut frame = Frame::default();
        simulation.sample(0.3, &mut frame);
        frame
    };
    let tree = at(&pendulum("", ""));
    let closed = PLAY.replace("\"0.1 mm\"", "0");
    for (b, c) in [(&*closed, ""), ("", &*closed), (&*closed, &*closed)] {
        for (tree, cut) in tree.bodies.iter().zip(&at(&pendulum(b, c)).bodies) {
            assert!((tree.position - cut.position).norm() < 1e-9, "{} {}", tree.position, cut.position);
        }
    }
}

#[test]
fn keys_of_play_are_read_changed_and_reverted() {
    let mut block = scene(BLOCK, &[("joint.J.play.y", "0.2 mm"), ("joint.J.play.corner_radius", "2 mm")]);
    assert_eq!(block.get("joint.J.play.y"), Ok(Value::Number(0.2e-3)));
    assert_eq!(block.get("joint.J.play.corner_radius"), Ok(Value::Number(2e-3)));
    assert_eq!(block.get("joint.J.play.planar"), Ok(Value::Choice("true")));
    let LooseKind::Slide(slide) = block.machine.loose_joints[0].kind else { panic!("no slide") };
    assert_eq!(
        (slide.half_length, slide.half_width, slide.half_height, slide.corner_radius),
        (0.05, 0.025, None, 2e-3)
    );
    block.undo_change("joint.J.play.y").unwrap();
    assert_eq!(block.get("joint.J.play.y"), Ok(Value::Number(1e-3)));
    // What the file does not give follows the scene, and a ball's play is its clearance.
    let crank = scene(CRANK, &[("contact.clearance", "0.1 mm"), ("contact.approach_speed", "largest")]);
    assert_eq!(crank.get("joint.J.play.radial"), Ok(Value::Number(0.1e-3)));
    assert!(crank.get("joint.J.play.axial").is_err());
    assert_eq!(crank.get("joint.S.clearance"), Ok(Value::Number(0.0)));
    let open = scene(CRANK, &[("joint.S.play.radial", "0.3 mm")]);
    assert_eq!(open.get("joint.S.clearance"), Ok(Value::Number(0.3e-3)));
    assert_eq!(open.changes[0].0, "joint.S.clearance");
    // The default of the damping speed; a file that gives it speaks for every joint.
    let word = |text: &str| scene(text, &[]).get("joint.J.approach_speed").unwrap();
    assert_eq!(word(CRANK), Value::Choice("start"));
    assert_eq!(word(&CRANK.replace("approach_speed = \"start\"", "")), Value::Choice("largest"));
    let keys: Vec<String> = scene(THROWN, &[]).joint_keys(0).collect();
    for key in &keys {
        scene(THROWN, &[]).get(key).unwrap_or_else(|error| panic!("{error}"));
    }
    assert!(keys.contains(&"joint.J.play.axial".to_owned()) && !keys.contains(&"joint.J.clearance".to_owned()));
}

#[test]
fn changes_of_play_are_saved_where_the_file_has_them() {
    let changes = [
        (THROWN, "joint.J.play.radial", "0.15 mm"),
        (THROWN, "joint.J.play.axial", "0.3 mm"),
        (THROWN, "joint.J.play.length", "30 mm"),
        (THROWN, "joint.J.restitution", "0.8"),
        (CRANK, "joint.J.play.radial", "0.2 mm"),
        (BLOCK, "joint.J.play.y", "0.2 mm"),
    ];
    for (text, key, value) in changes {
        let changed = scene(text, &[(key, value)]);
        let saved = changed.to_toml().unwrap_or_else(|error| panic!("{key}: {error}"));
        assert!(!saved.contains("joint_contact"), "{key}: {saved}");
        assert_eq!(scene(&saved, &[]).get(key), changed.get(key), "{key}");
        assert_eq!(scene(&saved, &[]).machine.loose_joints, changed.machine.loose_joints, "{key}");
    }
}

#[test]
fn plays_change_while_the_machine_runs() {
    let mut live = LiveScene::new(&scene(THROWN, &[])).unwrap();
    live.advance_to(2e-3).unwrap();
    assert_eq!(live.set("joint.J.play.radial", "0.2 mm"), Ok(Effect::Now));
    assert_eq!(live.set("joint.J.play.axial", "0.1 mm"), Ok(Effect::Now));
    assert_eq!(live.set("joint.J.play.length", "30 mm"), Ok(Effect::AtReset));
    live.advance_to(0.2).unwrap();
    let mut frame = Frame::default();
    live.sample_now(&mut frame);
    assert_eq!(frame.joints[0].clearance, 0.2e-3);
    let residual = live.ledger().unwrap().residual();
    assert!(residual.abs() < 1e-3 * 0.1 * 9.81 * 0.2, "{residual:e} J");
}

#[test]
fn channels_name_ends_and_corners() {
    let names = |text: &str| -> Vec<String> {
        let scene = scene(text, &[]);
        channels_of(&scene.machine, &first_frame(&scene)).into_iter().map(|channel| channel.name).collect()
    };
    let pin = names(THROWN);
    for name in [
        "J.normal",
        "J.friction.size",
        "J.gap",
        "J.tilt",
        "J.axial",
        "J.a.normal",
        "J.b.gap",
        "J.front.normal",
        "J.back.force.x",
    ] {
        assert!(pin.iter().any(|own| own == name), "{name}: {pin:?}");
    }
    let block = names(BLOCK);
    for corner in ["1y", "3y", "5y", "7y"] {
        assert!(block.contains(&format!("J.{corner}.normal")), "{block:?}");
    }
    // The sum of the ends is the joint's force, and the deepest is its gap.
    let scene = scene(THROWN, &[]);
    let mut simulation = Simulation::new(&scene.machine).unwrap();
    let mut touched = 0;
    for k in 1..400 {
        simulation.advance_to(f64::from(k) * 2e-5).unwrap();
        let mut frame = Frame::default();
        simulation.sample_now(&mut frame);
        let sum = frame.sites.iter().fold(nalgebra::Vector3::zeros(), |sum, site| sum + site.normal_force);
        assert_eq!(sum, frame.joints[0].normal_force);
        let gap = frame.sites.iter().fold(f64::INFINITY, |gap: f64, site| gap.min(site.gap));
        assert_eq!(gap, -frame.joints[0].penetration);
        touched += usize::from(frame.sites.iter().any(|site| site.gap < 0.0));
    }
    assert!(touched > 10, "{touched}");
}

#[test]
fn bad_play_is_refused_with_file_line_key_and_range() {
    let error = |text: &str, changes: &[(&str, &str)]| {
        let own = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
        let changes: Vec<(String, String)> = changes.iter().map(own).collect();
        Scene::parse(text, Some("file.toml"), &changes).expect_err(text).to_string()
    };
    let cases = [
        (THROWN.replace("length = \"24 mm\"", "length = 0"), "length", "allowed above 0"),
        (THROWN.replace("length = \"24 mm\", ", ""), "play.length", "missing"),
        (
            THROWN.replace("radial = \"0.1 mm\"", "radial = \"1.1 mm\""),
            "play.radial",
            "a tenth of the radius; allowed 0 mm to 1 mm",
        ),
        (
            THROWN.replace("length = \"24 mm\"", "length = \"0.9 mm\""),
            "play.radial",
            "a tenth of the length; allowed 0 mm to 0.09 mm",
        ),
        (THROWN.replace("radial = \"0.1 mm\"", "radial = \"-0.1 mm\""), "play.radial", "allowed 0 mm to"),
        (THROWN.replace("axial = \"0.2 mm\"", "axial = \"0.2 mm\", planar = true"), "play.axial", "no second play"),
        (THROWN.replace("axial = \"0.2 mm\"", "y = \"0.2 mm\""), "play.y", "unknown key"),
        (THROWN.replace("friction = 0.15", "friction_velocity = \"centres\""), "friction_velocity", "allowed surface"),
        (
            THROWN.replace("[contact]", "start = \"settled\"\n[contact]"),
            "start",
            "allowed as-given, ideal, equilibrium",
        ),
        (BLOCK.replace("half_y = \"25 mm\"", "half_y = \"5 mm\""), "play.y", "allowed 0 mm to 0.5 mm"),
        // What the joint does not give is that of the scene, or else the joint is pointed out.
        (
            CRANK.replace("clearance = \"0.5 mm\"", "clearance = \"3 mm\""),
            "contact.clearance",
            "a tenth of the radius; allowed 0 mm to 1 mm",
        ),
        (
            THROWN.replace("radial = \"0.1 mm\", axial = \"0.2 mm\", length = \"24 mm\"", "length = \"2 mm\""),
            "joint.J",
            "a tenth of the length",
        ),
        (BLOCK.replace("play = {", "friction_law = \"none\"\nplays = {"), "plays", "unknown key"),
        (
            pendulum("drive = { law = \"constant\", velocity = \"6 rad/s\" }\nPLAY", "")
                .replace("start = { position = \"10 deg\", velocity = \"-1 rad/s\" }", "")
                .replace("PLAY", PLAY),
            "drive",
            "a joint with play has no drive",
        ),
        (pendulum("friction = 0.2", ""), "joint.B.friction", "only a joint with a table `play`"),
        (
            pendulum("", "").replace("velocity = \"-1 rad/s\" }", "offset = \"1 0 0 mm\" }"),
            "offset",
            "only a joint with a table `play`",
        ),
        (THROWN.replace("kind = \"revolute\"", "kind = \"fixed\""), "", "not allowed"),
    ];
    for (text, key, words) in &cases {
        if words.is_empty() {
            continue;
        }
        let message = error(text, &[]);
        println!("{message}\n");
        assert!(message.starts_with("file.toml:") && message.contains(key) && message.contains(words), "{message}");
    }
    let message = error(THROWN, &[("joint.J.play.radial", "2 mm")]);
    assert!(message.contains("joint.J.play.radial") && message.contains("allowed 0 mm to 1 mm"), "{message}");
    let message = error(THROWN, &[("joint.J.clearance", "0.2 mm")]);
    assert!(message.contains("did you mean `joint.J.play.radial`"), "{message}");
    let message = error(&pendulum("", ""), &[("joint.B.play.radial", "0.2 mm")]);
    assert!(message.contains("joint.B"), "{message}");
}

/// The start of a cut joint, in the file or by tilt, is that of the machine built in code.
#[test]
fn the_written_start_is_that_of_the_body() {
    let machine = machine(THROWN, &[]);
    let JointStart::Pose { position, velocity, angular_velocity, .. } = machine.joints[0].start else { panic!("free") };
    assert_eq!(position, nalgebra::Vector3::new(2e-5, 3e-5, -1e-5));
    assert_eq!(velocity, nalgebra::Vector3::new(0.05, 0.1, -0.2));
    assert_eq!(angular_velocity, nalgebra::Vector3::new(20.0, 3.0, -2.0));
}

/// A placed group turns its displaced starts, second axes and openings with it, and a change undone under either of its names is gone.
#[test]
fn a_turned_scene_starts_turned() {
    let turned = format!("rotation = {{ axis = [0, 0, 1], angle = \"90 deg\" }}\n{THROWN}");
    let frames = [THROWN, &turned].map(|text| first_frame(&scene(text, &[])));
    let [plain, turned] = frames.map(|frame| frame.bodies[0]);
    let turn = nalgebra::Rotation3::from_axis_angle(&nalgebra::Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
    assert!((turn * plain.position - turned.position).norm() < 1e-18, "{} {}", plain.position, turned.position);
    assert!((turn * plain.velocity - turned.velocity).norm() < 1e-15);
    assert!((turn * plain.angular_velocity - turned.angular_velocity).norm() < 1e-14);
    let mut open = scene(CRANK, &[("joint.S.play.radial", "0.3 mm")]);
    open.undo_change("joint.S.play.radial").unwrap();
    assert!(open.changes.is_empty());
}

#[test]
fn the_elastic_law_stands_on_the_joint() {
    let peak = |more: &str| {
        let text = THROWN
            .replace("ends = \"pin\"", &format!("ends = \"pin\"{more}"))
            .replace("friction = 0.15", "friction = 0\nnormal_law = \"hertz\"")
            .replace("axial = \"0.2 mm\", ", "");
        // Parallel, 0.1 kg at 0.2 m/s: sphere 1235 N, line 2438 N, half at each end.
        let start = text.find("[joint.start]").unwrap();
        let text = format!("{}[joint.start]\noffset_velocity = \"0 0 -0.2 m/s\"\n", &text[..start]);
        let mut machine = machine(&text, &[("solver.method", "dopri5"), ("solver.tolerance", "1e-10")]);
        machine.gravity = nalgebra::Vector3::zeros();
        let mut simulation = Simulation::new(&machine).unwrap();
        simulation.advance_to(0.8e-3).unwrap();
        2.0 * simulation.statistics().joints[0].peak_normal
    };
    for (more, expected) in [
        ("", 1235.2),
        (", elastic = \"sphere\"", 1235.2),
        (", elastic = \"line\"", 2437.7),
        (", stiffness_at = \"1 kN\"", 2924.0),
        (", stiffness = \"1.516684525971360e11 N/m^1.5\"", 1235.2),
    ] {
        let found = peak(more);
        assert!((found / expected - 1.0).abs() < 3e-4, "{more}: {found}");
    }
    let refused = |more: &str| {
        let text = THROWN.replace("ends = \"pin\"", &format!("ends = \"pin\"{more}"));
        Scene::parse(&text, Some("file.toml"), &[]).expect_err(more).to_string()
    };
    let both = refused(", elastic = \"line\", stiffness = \"1e11 N/m^1.5\"");
    assert!(both.contains("one of three ways"), "{both}");
    let much = refused(", stiffness_at = \"10 GN\"");
    assert!(much.contains("units"), "{much}");
    let much = refused(", stiffness_at = \"1000 MN\"");
    assert!(much.contains("play.stiffness_at") && much.contains("allowed above 0 N to below"), "{much}");
    let changed = scene(THROWN, &[("joint.J.play.elastic", "line")]);
    assert_eq!(changed.get("joint.J.play.elastic"), Ok(Value::Choice("line")));
}

#[test]
fn doubtful_pins_are_named() {
    let doubts = |text: &str, changes: &[(&str, &str)]| -> Vec<String> {
        let mut simulation = Simulation::new(&machine(text, changes)).unwrap();
        simulation.advance_to(0.02).unwrap();
        simulation.doubts().iter().map(ToString::to_string).collect()
    };
    let short = |list: &[String]| list.iter().any(|doubt| doubt.contains("its rim is farther"));
    // L^2/(80 r) of r 10 mm: 0.1 mm for L 8.944 mm.
    assert!(!short(&doubts(THROWN, &[("joint.J.play.length", "9 mm"), ("joint.J.play.axial", "0.1 mm")])));
    assert!(short(&doubts(THROWN, &[("joint.J.play.length", "8.9 mm"), ("joint.J.play.axial", "0.1 mm")])));
    // Thrown along its axis at 0.05 m/s: 1 mm in 20 ms without collars.
    let free = THROWN
        .replace("kind = \"revolute\"", "kind = \"cylindrical\"")
        .replace("axial = \"0.2 mm\", ", "travel = \"0.5 mm\", ")
        .replace("velocity = \"20 rad/s\"", "angular_velocity = \"20 rad/s\"");
    let own = doubts(&free, &[("joint.J.friction", "0")]);
    assert!(own.iter().any(|doubt| doubt.contains("more than its travel of 0.5 mm")), "{own:?}");
    assert!(
        !doubts(&free, &[("joint.J.friction", "0"), ("joint.J.play.travel", "2 mm")])
            .iter()
            .any(|doubt| doubt.contains("travel"))
    );
}
