//! Loads that vary by a law, a table, a file or a formula.

use std::f64::consts::{PI, TAU};

use crate::common::{THREE_VARIANTS, assert_refused, parse};
use crate::elements::frame_at;
use jointplay_physics::machine::Vec3;
use jointplay_physics::mechanism::periods_of;
use jointplay_physics::simulate::Simulation;
use jointplay_scene::{Scene, Texts};

const MASS: f64 = 0.5;

/// A mass at rest on a spring with a damper along x, without gravity, under a load of 2 N along x with these keys.
fn oscillator(load: &str) -> String {
    format!(
        "[gravity]\nx = 0\ny = 0\nz = 0\n\
         [[body]]\nname = \"mass\"\nmass = \"{MASS} kg\"\ninertia = \"2e-4 2e-4 2e-4 kg m^2\"\n\
         [[joint]]\nname = \"guide\"\nkind = \"prismatic\"\nchild = \"mass\"\naxis = [1, 0, 0]\n\
         [[spring]]\nname = \"s\"\nfrom = {{ body = \"world\", at = \"-100 0 0 mm\" }}\nto = {{ body = \"mass\" }}\n\
         length = \"100 mm\"\nstiffness = \"200 N/m\"\ndamping = \"0.5 N s/m\"\n\
         [[load]]\nname = \"f\"\non = {{ body = \"mass\" }}\nforce = \"2 0 0 N\"\n{load}\n"
    )
}

/// Points of sin(2 pi 2 t + 30 deg) over one period, `join`ed.
fn samples(join: &str, point: impl Fn(f64, f64) -> String) -> String {
    const POINTS: u32 = 400;
    let at = |n: u32| {
        let t = 0.5 * f64::from(n) / f64::from(POINTS);
        point(t, (TAU * 2.0 * t + PI / 6.0).sin())
    };
    (0..=POINTS).map(at).collect::<Vec<_>>().join(join)
}

#[test]
fn a_law_a_formula_and_a_table_of_a_sine_give_the_same_motion() {
    let points = samples(", ", |t, x| format!("[\"{t:e} s\", {x:e}]"));
    let csv = "time_ms;factor\n".to_owned() + &samples("\n", |t, x| format!("{:e};{x:e}", 1e3 * t)) + "\n";
    let files: Texts = [("pull.csv".to_owned(), csv.into())].into();
    let laws = [
        "{ law = \"harmonic\", amplitude = 1, frequency = \"2 Hz\", phase = \"30 deg\" }".to_owned(),
        "{ law = \"harmonics\", terms = [{ amplitude = \"0.5 + 0.5\", frequency = \"2 Hz\", phase = \"30 deg\" }] }"
            .to_owned(),
        "{ law = \"formula\", formula = \"sin(2*pi*2*t + pi/6)\" }".to_owned(),
        "{ law = \"formula\", formula = \"sin(2*pi*2 Hz*t + 30 deg)\", resolve = \"5 ms\" }".to_owned(),
        format!("{{ law = \"table\", interpolation = \"spline\", points = [{points}], repeat = true }}"),
        "{ law = \"table\", interpolation = \"spline\", file = \"pull.csv\", repeat = true }".to_owned(),
    ];
    for (method, formulation) in THREE_VARIANTS {
        let changes = [("solver.method", method), ("solver.tolerance", "1e-11"), ("formulation", formulation)];
        let mut sine =
            Simulation::new(&parse(&oscillator("frequency = \"2 Hz\"\nphase = \"30 deg\""), &changes).machine).unwrap();
        let expected = frame_at(&mut sine, 1.3);
        let work = sine.ledger().unwrap().external_work;
        assert!(expected.bodies[0].position.x.abs() > 1e-3 && work > 1e-3);
        for (index, law) in laws.iter().enumerate() {
            let text = oscillator(&format!("factor = {law}"));
            let changes = changes.map(|(key, value)| (key.to_owned(), value.to_owned()));
            let scene = Scene::parse_with(&text, None, &files, &changes).unwrap();
            let period = periods_of(&scene.machine).fold(f64::INFINITY, f64::min);
            assert_eq!((period - 0.5).abs() < 1e-12, !law.contains("formula"), "{law}: {period}");
            let mut simulation = Simulation::new(&scene.machine).unwrap();
            let frame = frame_at(&mut simulation, 1.3);
            let error = (frame.bodies[0].position - expected.bodies[0].position).norm();
            let label = format!("{method} {formulation} law {index}");
            assert!(error < 1e-9, "{label}: {error:e}");
            assert!((frame.elements[1].force - expected.elements[1].force).norm() < 1e-8, "{label}");
            let ledger = simulation.ledger().unwrap();
            assert!((ledger.external_work - work).abs() < 1e-8, "{label}: {ledger:?}");
            assert!(ledger.relative_residual().abs() < 1e-8, "{label}: {ledger:?}");
            // The first two laws evaluate the same expression as the load's own keys: same bits.
            assert!(index > 1 || error == 0.0, "{label}");
        }
    }
}

#[test]
fn a_short_pulse_of_a_load_is_not_stepped_over() {
    // A free mass at rest: only the start of the pulse ends a step. Its impulse is F T 4 / (3 pi).
    let text = "[gravity]\nx = 0\ny = 0\nz = 0\n\
        [[body]]\nname = \"mass\"\nmass = \"0.5 kg\"\ninertia = \"2e-4 2e-4 2e-4 kg m^2\"\n\
        [[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"mass\"\nstart = { position = [0, 0, 0] }\n\
        [[load]]\nname = \"knock\"\non = { body = \"mass\" }\nforce = \"30 0 40 N\"\n\
        factor = { law = \"pulse\", height = 2, start = \"0.5 s\", duration = \"1 ms\" }\n";
    for (method, formulation) in THREE_VARIANTS {
        let changes = [("solver.method", method), ("solver.tolerance", "1e-9"), ("formulation", formulation)];
        let mut simulation = Simulation::new(&parse(text, &changes).machine).unwrap();
        let frame = frame_at(&mut simulation, 0.7);
        let speed = Vec3::new(60.0, 0.0, 80.0) * 1e-3 * 4.0 / (3.0 * PI) / MASS;
        let error = (frame.bodies[0].velocity - speed).norm();
        assert!(error < 1e-8, "{method} {formulation}: {error:e}");
        let ledger = simulation.ledger().unwrap();
        let energy = 0.5 * MASS * speed.norm_squared();
        assert!((ledger.external_work / energy - 1.0).abs() < 1e-6, "{method} {formulation}: {ledger:?}");
    }
}

#[test]
fn a_torque_that_is_switched_on_smoothly_turns_with_its_body() {
    // The torque and the body's rotation are both about z, so the torque keeps its direction.
    let text = "[gravity]\nx = 0\ny = 0\nz = 0\n\
        [[body]]\nname = \"rotor\"\nmass = \"0.5 kg\"\ninertia = \"2e-4 2e-4 2e-4 kg m^2\"\n\
        [[joint]]\nname = \"hinge\"\nkind = \"revolute\"\nchild = \"rotor\"\naxis = [0, 0, 1]\n\
        [[load]]\nname = \"torque\"\non = { body = \"rotor\" }\ntorque = \"0 0 1e-3 N m\"\naxes = \"body\"\n\
        factor = { law = \"ramp\", from = 1, to = -1, start = \"0.1 s\", duration = \"0.2 s\" }\n";
    let mut simulation = Simulation::new(&parse(text, &[("solver.tolerance", "1e-10")]).machine).unwrap();
    // The ramp is odd about its middle.
    for (time, momentum) in [(0.1, 1e-4), (0.3, 1e-4), (0.4, 0.0)] {
        let frame = frame_at(&mut simulation, time);
        let error = (frame.bodies[0].angular_velocity.z - momentum / 2e-4).abs();
        assert!(error < 1e-7, "{time}: {error:e}");
    }
    assert!(simulation.ledger().unwrap().relative_residual().abs() < 1e-8);
}

#[test]
fn bad_factors_are_refused_with_their_position() {
    let files: Texts = [
        ("no-header.csv".to_owned(), "0,1\n1,2\n".into()),
        ("falls.csv".to_owned(), "time_s,factor\n0,1\n0.2,x\n".into()),
    ]
    .into();
    let cases = r#"
        factor = { law = "constant", velocity = "1 1/s" }; frequency = "2 Hz" -> load.f.frequency | `factor` says how
        factor = { law = "harmonic", amplitude = "1 N", frequency = "1 Hz" } -> load.f.factor.amplitude | 1 N
        factor = { law = "spcmm", slider = 1 } -> load.f.factor.law | allowed constant, harmonic
        factor = { law = "formula", formula = "abs(t)" } -> load.f.factor.formula | smoothstep
        factor = { law = "formula", formula = "t", unit = "N" } -> load.f.factor.unit | unknown key
        factor = { law = "formula", formula = "t * 1 N / 1 s" } -> load.f.factor.formula | must be a pure number
        factor = { law = "formula", formula = "1/t" } -> load.f.factor.formula | no finite value at t = 0
        factor = { law = "table", file = "no-header.csv" } -> no-header.csv:1:1 | time_s
        factor = { law = "table", file = "falls.csv" } -> falls.csv:3:5 | not a number
        factor = { law = "table", repeat = true, points = [[0, 1], ["1 s", 2], ["2 s", 3]] } -> load.f.factor.points | the last factor must be the first
    "#;
    assert_refused(cases, |load| Scene::parse_with(&oscillator(load), Some("mine.toml"), &files, &[]));
}
