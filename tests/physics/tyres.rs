//! Tyres on a moving ground against closed-form solutions, in every method and both formulations.

use std::f64::consts::TAU;

use crate::common::matrix::for_every;
use crate::common::{THREE_VARIANTS, assert_refused, parse, replaced};
use crate::elements::frame_at;
use jointplay_physics::machine::Vec3;
use jointplay_physics::simulate::Frame;
use jointplay_scene::{LiveScene, Scene};

const MASS: f64 = 20.0;
const STIFFNESS: f64 = 50e3;
const RADIUS: f64 = 0.3;
const G: f64 = 9.81;
/// Height of the wheel's centre at rest on level ground, m.
const REST: f64 = RADIUS - MASS * G / STIFFNESS;

/// A wheel of `MASS` that moves along z, starting at rest at `height`, m.
fn wheel(height: f64, tyre: &str) -> String {
    format!(
        "[gravity]\nz = \"-{G} m/s^2\"\n\
         [[body]]\nname = \"wheel\"\nmass = \"{MASS} kg\"\ninertia = \"1 1 1 kg m^2\"\n\
         [[joint]]\nname = \"guide\"\nkind = \"prismatic\"\nchild = \"wheel\"\naxis = [0, 0, 1]\n\
         start = {{ position = \"{height:e} m\" }}\n\
         [[tyre]]\nname = \"t\"\non = {{ body = \"wheel\" }}\nradius = \"{RADIUS} m\"\nstiffness = \"{STIFFNESS:e} N/m\"\n{tyre}\n"
    )
}

fn start_simulation(text: &str, changes: &[(&str, &str)]) -> LiveScene {
    LiveScene::new(&parse(text, changes)).unwrap()
}

/// Height above rest of a wheel with `damping` on the ground a sin(w t), starting at rest on level ground.
fn ride_height(damping: f64, [a, w]: [f64; 2], t: f64) -> f64 {
    // m x'' + c x' + k x = k a sin w t + c a w cos w t.
    let (k, c, m) = (STIFFNESS, damping, MASS);
    let (stiff, damp) = (k - m * w * w, c * w);
    let size = stiff * stiff + damp * damp;
    // The forced part p sin w t + q cos w t.
    let p = (stiff * k * a + damp * c * a * w) / size;
    let q = (stiff * c * a * w - damp * k * a) / size;
    let d = c / (2.0 * m);
    let natural = (k / m - d * d).sqrt();
    let (x, v) = (-q, -p * w);
    let (sin, cos) = (natural * t).sin_cos();
    let free = (-d * t).exp() * (x * cos + (v + d * x) / natural * sin);
    free + p * (w * t).sin() + q * (w * t).cos()
}

#[test]
fn a_wheel_follows_a_wavy_road_as_in_the_linear_solution() {
    let (waves, time) = ([1e-3, TAU * 6.0], 0.3);
    for_every([0.0, 400.0], |damping, variant| {
        let text = wheel(
            REST,
            &format!(
                "damping = \"{damping} N s/m\"\nground = {{ law = \"harmonic\", amplitude = \"1 mm\", frequency = \"6 Hz\" }}"
            ),
        );
        let mut simulation = start_simulation(&text, &variant.close());
        let frame = frame_at(&mut simulation, time);
        let label = format!("{variant}, damping {damping}");
        let expected = ride_height(damping, waves, time);
        let error = frame.bodies[0].position.z - REST - expected;
        assert!(error.abs() < variant.bound(), "{label}: {error:e} of {expected:e}");
        let ground = waves[0] * (waves[1] * time).sin();
        let depth = ground + RADIUS - frame.bodies[0].position.z;
        let stored = 0.5 * STIFFNESS * depth * depth;
        assert!((frame.elastic - stored).abs() < 1e-12, "{label}");
        let below = frame.elements[0].points[0];
        assert!((below - Vec3::new(0.0, 0.0, ground)).norm() < 1e-15, "{label}");
        let ledger = simulation.ledger().unwrap();
        assert!(ledger.drive_work != 0.0, "{ledger:?}");
        assert_eq!(ledger.damping_loss > 0.0, damping > 0.0, "{ledger:?}");
        assert!(ledger.relative_residual().abs() < 1e-4, "{label} {ledger:?}");
    });
}

#[test]
fn a_wheel_that_falls_on_an_undamped_tyre_bounces_back() {
    let text = wheel(0.5, "");
    for (method, formulation) in THREE_VARIANTS {
        let changes = [("solver.method", method), ("solver.tolerance", "1e-9"), ("formulation", formulation)];
        let mut simulation = start_simulation(&text, &changes);
        let mut highest = 0.0_f64;
        for n in 1..=1500 {
            let frame = frame_at(&mut simulation, f64::from(n) * 1e-3);
            let height = frame.bodies[0].position.z;
            let force = frame.elements[0].force.z;
            let expected = STIFFNESS * (RADIUS - height).max(0.0);
            assert!((force - expected).abs() < 1e-9 * STIFFNESS, "{force} {expected}");
            if n > 400 {
                highest = highest.max(height);
            }
        }
        assert!((highest - 0.5).abs() < 1e-4, "{method}: {highest}");
        let ledger = simulation.ledger().unwrap();
        assert!(ledger.relative_residual().abs() < 1e-6, "{method} {ledger:?}");
    }
}

#[test]
fn no_bump_is_stepped_over() {
    // A bump of half a millisecond, a hundredth of the wheel's period, acts as an impulse.
    let text = wheel(REST, "ground = { law = \"pulse\", height = \"2 mm\", start = \"1 s\", duration = \"0.5 ms\" }");
    // The integral of sin^3(pi s) from 0 to 1 is 4 / 3 pi.
    let impulse = STIFFNESS * 2e-3 * 0.5e-3 * 4.0 / (3.0 * std::f64::consts::PI);
    let speed = impulse / MASS;
    for method in ["dopri5", "radau5", "automatic"] {
        let mut simulation = start_simulation(&text, &[("solver.method", method), ("solver.tolerance", "1e-8")]);
        let before = frame_at(&mut simulation, 0.99);
        assert!((before.bodies[0].position.z - REST).abs() < 1e-9, "{method}");
        let swing = frame_at(&mut simulation, 1.00025 + 0.25 * TAU / (STIFFNESS / MASS).sqrt());
        let expected = speed / (STIFFNESS / MASS).sqrt();
        let amplitude = swing.bodies[0].position.z - REST;
        assert!((amplitude / expected - 1.0).abs() < 1e-3, "{method}: {amplitude} {expected}");
        let ledger = simulation.ledger().unwrap();
        let work = 0.5 * MASS * speed * speed;
        assert!((ledger.drive_work / work - 1.0).abs() < 1e-2, "{method} {ledger:?}");
        assert!(ledger.relative_residual().abs() < 1e-5, "{method} {ledger:?}");
    }
}

#[test]
fn a_tyre_is_a_one_sided_spring_on_a_driven_road() {
    let law = "{ law = \"harmonic\", amplitude = \"12 mm\", frequency = \"7 Hz\" }";
    let text = wheel(REST, &format!("damping = \"300 N s/m\"\nground = {law}"));
    let road = text[..text.find("[[tyre]]").unwrap()].to_owned()
        + &format!(
            "[[body]]\nname = \"road\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n\
             [[joint]]\nname = \"road\"\nkind = \"prismatic\"\nchild = \"road\"\naxis = [0, 0, 1]\ndrive = {law}\n\
             [[spring]]\nname = \"t\"\nfrom = {{ body = \"road\" }}\nto = {{ body = \"wheel\" }}\nlength = \"{RADIUS} m\"\n\
             stiffness = \"{STIFFNESS:e} N/m\"\ndamping = \"300 N s/m\"\nside = \"push\"\n"
        );
    let changes = [("solver.tolerance", "1e-10")];
    let (mut a, mut b) = (start_simulation(&text, &changes), start_simulation(&road, &changes));
    let mut lifted = false;
    for n in 1..60 {
        let [a, b] = [&mut a, &mut b].map(|s| frame_at(s, 0.01 * f64::from(n)));
        lifted |= a.elements[0].force.z == 0.0;
        assert!((a.bodies[0].position - b.bodies[0].position).norm() < 1e-7);
        assert!((a.elements[0].force - b.elements[0].force).norm() < 1e-2);
    }
    assert!(lifted, "the road must throw the wheel off");
    let [a, b] = [a, b].map(|s| *s.ledger().unwrap());
    assert!((a.damping_loss / b.damping_loss - 1.0).abs() < 1e-4, "{a:?} {b:?}");
}

#[test]
fn up_is_opposite_to_the_gravity_of_the_file_unless_given() {
    let push = |text: &str, changes: &[(&str, &str)]| -> Vec3 {
        let mut frame = Frame::default();
        start_simulation(text, changes).sample(0.0, &mut frame);
        frame.elements[0].force
    };
    let text = wheel(REST, "");
    let weight = Vec3::new(0.0, 0.0, MASS * G);
    assert!((push(&text, &[]) - weight).norm() < 1e-9);
    // A changed gravity does not change the ground's direction.
    assert!((push(&text, &[("gravity.z", "0"), ("gravity.x", "3 m/s^2")]) - weight).norm() < 1e-9);
    let mut simulation = start_simulation(&text, &[]);
    simulation.set("gravity.z", "5 m/s^2").unwrap();
    assert!((frame_at(&mut simulation, 0.0).elements[0].force - weight).norm() < 1e-9);
    let tilted =
        wheel(REST, "up = [0, 0.6, 0.8]\nground = { law = \"constant\", position = \"-50 mm\", velocity = 0 }");
    let height = RADIUS - 0.05 - 0.8 * REST;
    let expected = Vec3::new(0.0, 0.6, 0.8) * (STIFFNESS * height.max(0.0));
    assert!((push(&tilted, &[]) - expected).norm() < 1e-9, "{expected}");
}

#[test]
fn errors_in_a_tyre_are_located() {
    let cases = r#"
        z = "-9.81 m/s^2" => x = 0; y = 0; z = 0 -> tyre.t.up | without gravity only the file can say which way is up
        body = "wheel" }; radius => body = "world" }; radius -> tyre.t.on | acts on a body, not on the world
        stiffness = "5e4 N/m" => stiffness = 0 -> tyre.t | does nothing
        ground = { law = "function", function = "f" } -> tyre.t.ground.function | [closed_form]
        ground = { law = "pulse", height = "1 deg", duration = "1 s" } -> tyre.t.ground.height | wrong unit `deg`
        up = [0, 0, 0] -> tyre.t.up | must not be zero
        ground = "flat" -> tyre.t.ground | a table
    "#;
    assert_refused(cases, |change| {
        let text = match change.split_once(" => ") {
            Some((from, to)) => replaced(&wheel(REST, ""), from, to),
            None => wheel(REST, change),
        };
        Scene::parse(&text, Some("mine.toml"), &[])
    });
}
