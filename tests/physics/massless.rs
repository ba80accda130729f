//! Massless bodies between joints: joints in series, against equivalent single joints and closed-form solutions.

use crate::common::matrix::in_tree;
use crate::common::{assert_refused, frame_now, replaced};
use crate::elements::frame_at;
use crate::joint_elements::start_simulation;
use crate::two_degrees::{G, train};
use jointplay_physics::machine::{Machine, MachineFault, Vec3};
use jointplay_physics::mechanism::MechanismError;
use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_scene::Scene;

fn link(name: &str) -> String {
    format!("[[body]]\nname = \"{name}\"\nmass = 0\ninertia = [0, 0, 0]\n")
}

/// The chain of `two_degrees` with slide and hinge instead of its cylindrical joint, and two hinges instead of its universal joint.
fn in_series(gravity: f64) -> String {
    let text = train(gravity);
    let (before, joints) = text.split_once("[[joint]]\nname = \"c\"").expect("a cylindrical joint");
    let (ring, rod) = joints.split_once("[[joint]]\nname = \"u\"").expect("a universal joint");
    let line = |joint: &str, key: &str| joint.lines().find(|line| line.starts_with(key)).expect("a key").to_owned();
    let axes = |joint: &str| {
        (line(joint, "axis"), line(joint, "parent_point"), line(joint, "child_point"), line(joint, "rotation"))
    };
    let (along, at, child, rotation) = axes(ring);
    let slide = format!(
        "[[joint]]\nname = \"c1\"\nkind = \"prismatic\"\nparent = \"base\"\nchild = \"sleeve\"\n{along}\n{at}\n\
         start = {{ position = \"5 mm\", velocity = \"0.2 m/s\" }}\n\
         [[joint]]\nname = \"c2\"\nkind = \"revolute\"\nparent = \"sleeve\"\nchild = \"ring\"\n{along}\n{child}\n{rotation}\n\
         start = {{ position = \"20 deg\", velocity = \"6 rad/s\" }}\n"
    );
    let (first, at, child, rotation) = axes(rod);
    let hinges = format!(
        "[[joint]]\nname = \"u1\"\nkind = \"revolute\"\nparent = \"ring\"\nchild = \"cross\"\n{first}\n{at}\n\
         start = {{ position = \"25 deg\", velocity = \"3 rad/s\" }}\n\
         [[joint]]\nname = \"u2\"\nkind = \"revolute\"\nparent = \"cross\"\nchild = \"rod\"\naxis = [0, 0, 1]\n{child}\n{rotation}\n\
         start = {{ position = \"-40 deg\", velocity = \"-5 rad/s\" }}\n"
    );
    format!("{before}{}{}{slide}{hinges}", link("sleeve"), link("cross"))
}

/// Checks that pairs of bodies of two frames agree within `bound` (m, rad; velocities within 10 `bound`).
fn assert_agree(frame: &Frame, other: &Frame, bodies: &[(usize, usize)], bound: f64, label: &str) {
    for &(one, two) in bodies {
        let (a, b) = (&frame.bodies[one], &other.bodies[two]);
        let errors = [
            (a.position - b.position).norm(),
            (a.rotation - b.rotation).amax(),
            (a.velocity - b.velocity).norm() / 10.0,
            (a.angular_velocity - b.angular_velocity).norm() / 10.0,
        ];
        assert!(errors.iter().all(|error| *error < bound), "{label}: body {one}: {errors:?}");
    }
}

#[test]
fn joints_in_series_move_as_a_cylindrical_and_a_universal_joint() {
    // Bodies are sorted by their joints.
    let text = in_series(-G);
    let scene = Scene::parse(&text, None, &[]).unwrap();
    let index = |name: &str| scene.machine.bodies.iter().position(|body| body.name == name).unwrap();
    let pairs = [(0, index("base")), (1, index("ring")), (2, index("rod"))];
    for variant in in_tree() {
        let mut single = start_simulation(&train(-G), &variant.close());
        let mut series = start_simulation(&text, &variant.close());
        let (summary, other) = (single.mechanism().summary(), series.mechanism().summary());
        assert_eq!((summary.degrees_of_freedom, summary.velocity_coordinates), (10, other.velocity_coordinates));
        // Agreement within rounding at the start, later within the method's error.
        assert_agree(&frame_now(&mut single), &frame_now(&mut series), &pairs, 1e-13, "at the start");
        for (a, b) in pairs {
            let (own, other) = (frame_now(&mut single), frame_now(&mut series));
            let error = (own.bodies[a].acceleration - other.bodies[b].acceleration).norm();
            assert!(error < 1e-9, "{variant}: {error:e}");
        }
        assert_agree(
            &frame_at(&mut single, 0.2),
            &frame_at(&mut series, 0.2),
            &pairs,
            10.0 * variant.bound(),
            &variant.to_string(),
        );
    }
}

/// A top with the given joints and further bodies.
fn top(joints: &str, bodies: &str) -> String {
    format!(
        "[gravity]\nz = \"-9.81 m/s^2\"\n[solver]\ntolerance = 1e-11\n[contact]\nclearance = \"0 mm\"\n{bodies}\
         [[body]]\nname = \"top\"\nmass = \"0.4 kg\"\ncentre = \"0 0 60 mm\"\ninertia = \"3e-4 4e-4 2e-4 kg m^2\"\n{joints}"
    )
}

fn hinges(second: &str) -> String {
    let bodies = link("outer") + &link("inner");
    let joints = format!(
        "[[joint]]\nname = \"x\"\nkind = \"revolute\"\nchild = \"outer\"\naxis = [1, 0, 0]\nstart = {{ position = 0, velocity = \"2 rad/s\" }}\n\
         [[joint]]\nname = \"y\"\nkind = \"revolute\"\nparent = \"outer\"\nchild = \"inner\"\naxis = [0, 1, 0]\nstart = {{ position = \"{second}\" }}\n\
         [[joint]]\nname = \"z\"\nkind = \"revolute\"\nparent = \"inner\"\nchild = \"top\"\naxis = [0, 0, 1]\nstart = {{ position = 0, velocity = \"30 rad/s\" }}\n"
    );
    top(&joints, &bodies)
}

#[test]
fn three_hinges_through_one_point_move_as_a_ball_joint_until_two_axes_coincide() {
    // Hinge x is about the world's x, hinge z about the top's axis, which is tilted about y by half a radian.
    let (sine, cosine) = (0.5_f64.sin(), 0.5_f64.cos());
    let ball = format!(
        "[[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"top\"\n\
         start = {{ position = [0, 0, 0], rotation = {{ axis = [0, 1, 0], angle = \"0.5 rad\" }}, \
         angular_velocity = \"{} 0 {} rad/s\" }}\n\
         [[ball_joint]]\nname = \"ball\"\nsocket = {{ body = \"world\" }}\nball = {{ body = \"top\" }}\n",
        2.0 + 30.0 * sine,
        30.0 * cosine
    );
    let mut single = start_simulation(&top(&ball, ""), &[]);
    let mut series = start_simulation(&hinges("0.5 rad"), &[]);
    let mut energy = None;
    for step in 0..=10 {
        let t = 0.03 * f64::from(step);
        let (one, other) = (frame_at(&mut single, t), frame_at(&mut series, t));
        assert_agree(&one, &other, &[(0, 2)], 1e-7, &format!("{t} s"));
        let now = other.kinetic + other.potential;
        let lost = now - *energy.get_or_insert(now);
        assert!(lost.abs() < 1e-8, "{lost:e} J");
    }
    let start_error = |text: &str| {
        let scene = Scene::parse(text, Some("top.toml"), &[]).unwrap();
        let error = Simulation::new(&scene.machine).expect_err("singular");
        scene.locate(&error).to_string()
    };
    let error = start_error(&hinges("90 deg"));
    assert!(error.contains("joint.x: joint x: at the start values it moves all mass in the same way"), "{error}");
    assert!(error.contains("| [[joint]]"), "{error}");
    let parallel = hinges("0.5 rad").replace("axis = [0, 1, 0]", "axis = [1, 0, 0]");
    assert!(start_error(&parallel).contains("joint x: at the start values"), "{}", start_error(&parallel));
}

/// Two slides and a hinge carry a plate in its plane: without forces its centroid moves uniformly and it rotates uniformly.
#[test]
fn two_slides_and_a_hinge_move_a_plate_in_its_plane() {
    let joint = |name: &str, kind: &str, parent: &str, child: &str, axis: &str, start: &str| {
        format!(
            "[[joint]]\nname = \"{name}\"\nkind = \"{kind}\"\n{parent}child = \"{child}\"\naxis = {axis}\nstart = {{ {start} }}\n"
        )
    };
    let text = format!(
        "[gravity]\nz = \"-9.81 m/s^2\"\n[solver]\ntolerance = 1e-10\n{}{}\
         [[body]]\nname = \"plate\"\nmass = \"2 kg\"\ncentre = \"100 0 0 mm\"\ninertia = \"0.01 0.01 0.02 kg m^2\"\n{}{}{}",
        link("rail"),
        link("carriage"),
        joint("x", "prismatic", "", "rail", "[1, 0, 0]", "position = 0, velocity = \"0.3 m/s\""),
        joint("y", "prismatic", "parent = \"rail\"\n", "carriage", "[0, 1, 0]", "position = \"20 mm\""),
        joint(
            "turn",
            "revolute",
            "parent = \"carriage\"\n",
            "plate",
            "[0, 0, 1]",
            "position = 0, velocity = \"5 rad/s\""
        ),
    );
    let mut simulation = start_simulation(&text, &[]);
    let t = 0.7;
    let frame = frame_at(&mut simulation, t);
    let plate = &frame.bodies[2];
    let centre = plate.position + plate.rotation * Vec3::new(0.1, 0.0, 0.0);
    // The centroid starts at (0.1, 0.02, 0) with (0.3, 5 x 0.1, 0).
    let expected = Vec3::new(0.1 + 0.3 * t, 0.02 + 0.5 * t, 0.0);
    assert!((centre - expected).norm() < 1e-8, "{centre}");
    let angle = plate.rotation[(1, 0)].atan2(plate.rotation[(0, 0)]);
    assert!((angle - 5.0 * t + std::f64::consts::TAU).abs() < 1e-8, "{angle}");
}

#[test]
fn a_body_that_needs_its_mass_is_refused_with_its_line() {
    let good = hinges("0.5 rad");
    let cases = r#"
        parent = "inner" => parent = "outer" -> body.inner.mass = 0: only a body between joints may have no mass: it carries no body
        [[joint]]; name = "x" => [[ball_joint]]; name = "b"; socket = { body = "world" }; ball = { body = "inner" }; [[joint]]; name = "x" -> body.inner.mass = 0: only a body between joints may have no mass: joint with play b is on it
        kind = "revolute"; child = "outer"; axis = [1, 0, 0]; start = { position = 0, velocity = "2 rad/s" } => kind = "free"; child = "outer"; start = { position = [0, 0, 0] } -> body.outer.mass = 0: only a body between joints may have no mass: it is carried by a free joint
        name = "outer"; mass = 0; inertia = [0, 0, 0] => name = "outer"; mass = 0; inertia = "1e-6 1e-6 1e-6 kg m^2" -> body.outer.mass = 0: out of range; allowed above 0
        name = "outer"; mass = 0 => name = "outer"; mass = "1 kg" -> allowed above 0; units
    "#;
    assert_refused(cases, |change| {
        let (from, to) = change.split_once(" => ").expect(change);
        Scene::parse(&replaced(&good, from, to), Some("top.toml"), &[])
    });
    let change = ("formulation".to_owned(), "lagrange".to_owned());
    let scene = Scene::parse(&good, Some("top.toml"), &[change]).unwrap();
    let error = scene.locate(&Simulation::new(&scene.machine).expect_err("refused")).to_string();
    assert!(error.contains("formulation = lagrange: body outer has mass 0 kg"), "{error}");
    let mut machine = Machine::clone(&scene.machine);
    machine.bodies[0].inertia.m11 = 1.0;
    let fault = MechanismError::Machine(MachineFault::Inertia { body: "outer".to_owned() });
    assert_eq!(Simulation::new(&machine).expect_err("refused").0, fault);
}
