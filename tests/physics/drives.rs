//! Laws of drives in running machines: short pulses are not stepped over, and every joule is accounted for.

use crate::common::{Changes, frame_now, parse, run_until};
use jointplay_physics::simulate::Simulation;

/// A slider with this drive along x and a rod that hangs from it on a ball joint.
fn hanging(drive: &str, changes: &Changes) -> Simulation {
    let text = format!(
        "start = \"ideal\"\n[gravity]\nz = \"-9.81 m/s^2\"\n\
         [[body]]\nname = \"slider\"\nmass = \"1 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n\
         [[body]]\nname = \"rod\"\nmass = \"0.384 kg\"\ninertia = \"1.92e-3 1.92e-3 1.58e-5 kg m^2\"\n\
         [[joint]]\nname = \"guide\"\nkind = \"prismatic\"\nchild = \"slider\"\naxis = [1, 0, 0]\ndrive = {{ {drive} }}\n\
         [[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"rod\"\nchild_point = \"0 0 100 mm\"\n\
         start = {{ position = [0, 0, 0] }}\n\
         [[ball_joint]]\nname = \"S1\"\nsocket = {{ body = \"slider\" }}\nball = {{ body = \"rod\", at = \"0 0 100 mm\" }}\n"
    );
    Simulation::new(&parse(&text, changes).machine).unwrap()
}

/// A slider-crank with this drive and ideal joints, whose motion is a function of time alone.
fn kinematic(drive: &str, changes: &Changes) -> Simulation {
    let body =
        |name: &str| format!("[[body]]\nname = \"{name}\"\nmass = \"1 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n");
    let bodies: String = ["crank", "knuckle", "rod", "slider"].map(body).concat();
    let text = format!(
        "start = \"ideal\"\n[gravity]\nz = \"-9.81 m/s^2\"\n[contact]\nclearance = 0\n{bodies}\
         [[joint]]\nname = \"crank\"\nkind = \"revolute\"\nchild = \"crank\"\naxis = [0, 1, 0]\ndrive = {{ {drive} }}\n\
         [[joint]]\nname = \"pin\"\nkind = \"revolute\"\nparent = \"crank\"\nchild = \"knuckle\"\n\
         parent_point = \"0 0 40 mm\"\naxis = [0, 1, 0]\nstart = {{ position = \"11 deg\" }}\n\
         [[joint]]\nname = \"yaw\"\nkind = \"revolute\"\nparent = \"knuckle\"\nchild = \"rod\"\n\
         child_point = \"-100 0 0 mm\"\naxis = [0, 0, 1]\n\
         [[joint]]\nname = \"guide\"\nkind = \"prismatic\"\nchild = \"slider\"\naxis = [1, 0, 0]\n\
         start = {{ position = \"196 mm\" }}\n\
         [[ball_joint]]\nname = \"S1\"\nsocket = {{ body = \"slider\" }}\nball = {{ body = \"rod\", at = \"100 0 0 mm\" }}\n"
    );
    Simulation::new(&parse(&text, changes).machine).unwrap()
}

/// Laws that move a slide by some millimetres within a third of a second.
const LAWS: [&str; 8] = [
    "law = \"constant\", velocity = \"20 mm/s\"",
    "law = \"harmonic\", amplitude = \"5 mm\", frequency = \"5 Hz\"",
    "law = \"harmonics\", terms = [{ amplitude = \"5 mm\", frequency = \"2 Hz\" }, \
     { amplitude = \"1 mm\", frequency = \"11 Hz\", phase = \"30 deg\" }]",
    "law = \"ramp\", to = \"5 mm\", start = \"50 ms\", duration = \"0.1 s\"",
    "law = \"pulse\", height = \"5 mm\", start = \"50 ms\", duration = \"0.1 s\"",
    "law = \"table\", points = [[\"50 ms\", 0], [\"100 ms\", \"3 mm\"], [\"120 ms\", \"5 mm\"], [\"0.2 s\", \"1 mm\"]]",
    "law = \"table\", repeat = true, points = [[\"0 s\", 0], [\"50 ms\", \"3 mm\"], [\"70 ms\", \"5 mm\"], [\"0.15 s\", 0]]",
    "law = \"formula\", unit = \"mm\", formula = \"5 * sin(2*pi*4*t) * exp(-t)\"",
];

#[test]
fn the_ledger_balances_under_every_law() {
    for law in LAWS {
        for clearance in ["0", "0.3 mm"] {
            let mut simulation = hanging(law, &[("contact.clearance", clearance), ("solver.preset", "accurate")]);
            run_until(&mut simulation, 0.3);
            let ledger = simulation.ledger().unwrap();
            let residual = ledger.relative_residual();
            println!("{law} {clearance}: {residual:.1e}");
            assert!(residual.abs() < 1e-4, "{law} {clearance}: {ledger:?}");
            assert!(ledger.drive_work.abs() > 1e-6, "{law}: {ledger:?}");
        }
    }
}

#[test]
fn the_ledger_balances_for_kinematic_motion() {
    for law in LAWS {
        let law = law.replace("mm/s", "rad/s").replace("5 mm", "1 rad").replace("mm", "deg");
        let mut simulation = kinematic(&law, &[]);
        assert!(simulation.mechanism().is_kinematic());
        run_until(&mut simulation, 0.3);
        let ledger = simulation.ledger().unwrap();
        let residual = ledger.relative_residual();
        println!("{law}: {residual:.1e}");
        assert!(residual.abs() < 1e-4, "{law}: {ledger:?}");
        assert!(ledger.exchanged > 1e-6, "{law}: {ledger:?}");
    }
}

#[test]
fn no_step_passes_over_a_pulse_after_a_second_of_rest() {
    for (height, duration) in [("2 mm", "5 ms"), ("0.2 mm", "0.5 ms")] {
        let law = format!("law = \"pulse\", height = \"{height}\", start = \"1.0037 s\", duration = \"{duration}\"");
        let exchanged_energy = |method: &str| {
            let changes = [("contact.clearance", "0"), ("solver.method", method), ("solver.tolerance", "1e-8")];
            let mut simulation = hanging(&law, &changes);
            run_until(&mut simulation, 1.0037);
            let before = *simulation.ledger().unwrap();
            assert!(before.exchanged < 1e-12, "{method}: {before:?}");
            run_until(&mut simulation, 1.05);
            let ledger = *simulation.ledger().unwrap();
            let residual = ledger.relative_residual();
            assert!(residual.abs() < 1e-5, "{method}: {residual:e}");
            ledger.exchanged
        };
        let fixed = exchanged_energy("rk4");
        assert!(fixed > 1e-3, "{fixed}");
        for method in ["dopri5", "automatic", "radau5"] {
            let ratio = exchanged_energy(method) / fixed;
            // The tolerance covers energy that is exchanged and returned within a step.
            assert!((ratio - 1.0).abs() < 0.02, "{method}: {ratio}");
        }
    }
}

/// The same without a sample before the pulse.
#[test]
fn no_step_passes_over_a_pulse_between_two_samples() {
    let law = "law = \"pulse\", height = \"0.2 mm\", start = \"1.0037 s\", duration = \"0.5 ms\"";
    for method in ["dopri5", "automatic"] {
        let changes = [("contact.clearance", "0"), ("solver.method", method)];
        let mut simulation = hanging(law, &changes);
        run_until(&mut simulation, 1.5);
        let ledger = simulation.ledger().unwrap();
        assert!(ledger.exchanged > 1e-3, "{method}: {ledger:?}");
        let steps = simulation.statistics().steps;
        assert!(steps < 600, "{method}: {steps} steps");
    }
    // A formula needs the key `resolve`.
    let formula = "law = \"formula\", resolve = \"50 us\", unit = \"mm\", \
                   formula = \"0.2 * smoothstep((t - 0.1037)/2e-4) * (1 - smoothstep((t - 0.1039)/2e-4))\"";
    let mut simulation = hanging(formula, &[("contact.clearance", "0")]);
    run_until(&mut simulation, 0.15);
    assert!(simulation.ledger().unwrap().exchanged > 1e-3);
}

#[test]
fn equivalent_formula_table_and_sum_move_a_machine_as_the_harmonic_law() {
    let points: Vec<String> = (0..=200)
        .map(|n| {
            let t = f64::from(n) / 800.0;
            let x = if n == 200 { 0.0 } else { 5e-3 * libm::sin(8.0 * std::f64::consts::PI * t) };
            format!("[\"{t} s\", \"{x:e} m\"]")
        })
        .collect();
    let equivalent = [
        "law = \"harmonics\", terms = [{ amplitude = \"5 mm\", frequency = \"4 Hz\" }]".to_owned(),
        "law = \"formula\", formula = \"0.005 * sin(2*pi*4*t)\"".to_owned(),
        "law = \"formula\", formula = \"5*sin(8*pi*t)\", unit = \"mm\"".to_owned(),
        format!("law = \"table\", repeat = true, points = [{}]", points.join(", ")),
    ];
    let end = |law: &str| {
        let changes = [("contact.clearance", "0"), ("solver.tolerance", "1e-10")];
        let mut simulation = hanging(law, &changes);
        run_until(&mut simulation, 0.6);
        let frame = frame_now(&mut simulation);
        [frame.bodies[0].position, frame.bodies[1].position]
    };
    let [slider, rod] = end("law = \"harmonic\", amplitude = \"5 mm\", frequency = \"4 Hz\"");
    for law in &equivalent {
        let [s, r] = end(law);
        assert!((s - slider).norm() < 1e-8, "{law}: {s} {slider}");
        assert!((r - rod).norm() < 1e-7, "{law}: {r} {rod}");
    }
}

#[test]
fn a_hinge_follows_a_ramp_to_its_end_angle() {
    let law = "law = \"ramp\", from = \"10 deg\", to = \"70 deg\", duration = \"0.1 s\"";
    let mut simulation = kinematic(law, &[]);
    let bodies = &simulation.machine().bodies;
    let crank = bodies.iter().position(|body| body.name == "crank").unwrap();
    let before = frame_now(&mut simulation).bodies[crank].rotation;
    run_until(&mut simulation, 0.2);
    let now = frame_now(&mut simulation).bodies[crank];
    let angle = (before.transpose() * now.rotation).trace();
    let angle = (0.5 * (angle - 1.0)).acos().to_degrees();
    assert!((angle - 60.0).abs() < 1e-9, "{angle}");
    assert!(now.angular_velocity.norm() < 1e-12);
}

#[test]
fn a_formula_that_ends_stops_the_run_without_a_panic() {
    let mut simulation =
        hanging("law = \"formula\", formula = \"0.01 * sqrt(0.1 - t)\"", &[("contact.clearance", "0")]);
    let stopped = loop {
        if let Err(stopped) = simulation.step() {
            break stopped;
        }
        assert!(simulation.time() < 0.2);
    };
    assert!(stopped.time <= 0.1, "{stopped}");
    println!("{stopped}");
}
