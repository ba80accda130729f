//! Friction that sticks, against closed forms and an independent model.

use crate::common::{Changes, METHODS, THREE_VARIANTS, frame_now, live, parse, run_until, simulation};
use jointplay_physics::contact::{ElasticLaw, Parameters};
use jointplay_physics::integrate::Method;
use jointplay_physics::machine::Vec3;
use jointplay_physics::simulate::{ContactMode, Effect, Frame, Simulation};

const BRISTLES: (&str, &str) = ("contact.friction_law", "bristle");

/// A free ball of 0.1 kg pressed by its weight onto the wall of its socket at an angle (rad) from the lowest point.
fn ball_on_wall(angle: f64, changes: &Changes) -> Simulation {
    let parameters = Parameters::default();
    let depth = ElasticLaw::of_joint(&parameters, parameters.clearance).depth(0.1 * 9.81 * angle.cos());
    let distance = 1e3 * (parameters.clearance + depth);
    let text = format!(
        r#"
        [gravity]
        z = "-9.81 m/s^2"
        [contact]
        friction_law = "bristle"
        friction_velocity = "centres"
        [[body]]
        name = "ball"
        mass = "0.1 kg"
        inertia = "4e-6 4e-6 4e-6 kg m^2"
        [[joint]]
        name = "ball"
        kind = "free"
        child = "ball"
        start = {{ position = "{:e} 0 {:e} mm" }}
        [[ball_joint]]
        name = "S"
        socket = {{ body = "world" }}
        ball = {{ body = "ball" }}
        "#,
        distance * angle.sin(),
        -distance * angle.cos()
    );
    Simulation::new(&parse(&text, changes).machine).unwrap()
}

/// A block of 1 kg and 50 mm of length that lies in a guide with play, `planar`, or hangs in it without gravity.
fn block(gravity: &str, guide: &str, rest: &str) -> String {
    format!(
        r#"
        [gravity]
        y = "{gravity}"
        [contact]
        friction_law = "bristle"
        [solver]
        method = "radau5"
        tolerance = 1e-8
        [[body]]
        name = "block"
        mass = "1 kg"
        inertia = "1e-3 1e-3 1e-3 kg m^2"
        [[joint]]
        name = "J"
        kind = "prismatic"
        child = "block"
        axis = [1, 0, 0]
        {guide}
        play = {{ y = "0.1 mm", half_length = "25 mm", half_y = "1 mm", planar = true }}
        {rest}
        "#
    )
}

fn run(text: &str, changes: &Changes) -> Simulation {
    Simulation::new(&parse(text, changes).machine).unwrap()
}

#[test]
fn a_loaded_ball_stays_where_it_is() {
    for method in Method::ALL {
        let mut simulation = ball_on_wall(2.0_f64.to_radians(), &[BRISTLES, ("solver.method", method.word())]);
        run_until(&mut simulation, 0.5);
        let before = frame_now(&mut simulation);
        assert_eq!(before.joints[0].state, ContactMode::Stick);
        run_until(&mut simulation, 1.0);
        let moved = (frame_now(&mut simulation).joints[0].eccentricity - before.joints[0].eccentricity).norm();
        assert!(moved < 1e-10, "{method}: {moved:e} m");
    }
}

/// Where a point that starts at rest at the angle `from` of a circle stops, by Runge-Kutta steps of its speed squared over g c:
/// dw = 2 (sin a - mu (cos a + w)) along the way down.
fn stop_on_circle(from: f64, friction: f64) -> f64 {
    let rate = |angle: f64, w: f64| 2.0 * (angle.sin() - friction * (angle.cos() + w));
    let (mut angle, mut w, h) = (from, 0.0, 1e-6);
    loop {
        let a = rate(angle, w);
        let b = rate(angle - 0.5 * h, w + 0.5 * h * a);
        let c = rate(angle - 0.5 * h, w + 0.5 * h * b);
        let d = rate(angle - h, w + h * c);
        w += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
        angle -= h;
        if w <= 0.0 {
            return angle;
        }
    }
}

/// 8.53 degrees hold it: it slides until friction has taken its energy, below that angle.
#[test]
fn a_ball_beyond_its_friction_angle_slides_to_where_its_energy_ends() {
    for method in Method::ALL {
        for from in [10.0_f64, 12.0] {
            let mut simulation = ball_on_wall(from.to_radians(), &[BRISTLES, ("solver.method", method.word())]);
            run_until(&mut simulation, 0.3);
            let frame = frame_now(&mut simulation);
            assert_eq!(frame.joints[0].state, ContactMode::Stick, "{method}");
            let e = frame.joints[0].eccentricity;
            let (end, expected) = ((-e.x / e.z).atan(), stop_on_circle(from.to_radians(), 0.15));
            let off = (end - expected).to_degrees().abs();
            println!("{method} from {from}: {off}");
            assert!(off < 0.01, "{method} from {from}: {end} rad, expected {expected}");
        }
    }
    assert!((stop_on_circle(8.54_f64.to_radians(), 0.15).to_degrees() - 8.53 * 2.0 + 8.54).abs() < 0.01);
}

#[test]
fn a_block_breaks_away_at_the_static_limit() {
    let load = "[[load]]\nname = \"push\"\non = { body = \"block\" }\nforce = \"1 0 0 N\"\n\
        factor = { law = \"table\", interpolation = \"linear\", points = [[\"0 s\", 0], [\"1 s\", 4]] }";
    let limit = 0.15 * 1.5 * 9.81;
    for method in Method::ALL {
        let changes = [("contact.static_friction_ratio", "1.5"), ("solver.method", method.word())];
        let mut simulation = run(&block("-9.81 m/s^2", "", load), &changes);
        run_until(&mut simulation, 0.5);
        assert_eq!(frame_now(&mut simulation).joints[0].state, ContactMode::Stick, "{method}");
        while frame_now(&mut simulation).joints[0].state == ContactMode::Stick {
            simulation.step_until(simulation.time() + 1e-4).unwrap();
        }
        let force = 4.0 * simulation.time();
        println!("{method}: {force} {limit}");
        assert!((force / limit - 1.0).abs() < 2e-3, "{method}: {force} N, not {limit}");
    }
}

#[test]
fn a_slide_pushed_far_from_its_guide_wedges() {
    // Two walls press with P b / L each, and hold 2 mu P b / L: all of P from b = L / (2 mu) on, 83.3 mm.
    for method in Method::ALL {
        for (arm, holds) in [(82.0, false), (85.0, true)] {
            let load = format!(
                "[[load]]\nname = \"push\"\non = {{ body = \"block\", at = \"0 {arm} 0 mm\" }}\nforce = \"1 0 0 N\"\n\
                factor = {{ law = \"table\", points = [[\"0 s\", 0], [\"0.5 s\", 10]] }}"
            );
            let mut simulation = run(&block("0 m/s^2", "friction = 0.3", &load), &[("solver.method", method.word())]);
            run_until(&mut simulation, 0.6);
            let before = frame_now(&mut simulation).bodies[0].position.x;
            run_until(&mut simulation, 1.0);
            let frame = frame_now(&mut simulation);
            let moved = frame.bodies[0].position.x - before;
            println!("{method} {arm}: {:?} {moved:e}", frame.joints[0].state);
            if holds {
                assert!(moved.abs() < 1e-9, "{method} {arm}: {moved:e} m");
            } else {
                assert!(moved > 1e-2, "{method} {arm}: {moved:e} m");
            }
        }
    }
}

/// Period, largest and least position of a block of 1 kg on a belt of speed `v` behind a spring `k`, from its reduced equation
/// m x'' = -k x + mu(v - x') N with rigid sticking, by steps of the classical Runge-Kutta method.
fn stick_slip(v: f64, k: f64, normal: f64, kinetic: f64, ratio: f64, stribeck: f64) -> [f64; 3] {
    let coefficient = |slip: f64| kinetic * (1.0 + (ratio - 1.0) * (-(slip / stribeck).powi(2)).exp());
    let rate = |x: f64, u: f64| [u, -k * x + coefficient(v - u) * normal];
    let breaks = ratio * kinetic * normal / k;
    let (mut x, mut u, mut slipping, h) = (breaks, v, 0.0, 1e-6);
    let (mut highest, mut lowest) = (x, x);
    while u < v || slipping < 1e-3 {
        let a = rate(x, u);
        let b = rate(x + 0.5 * h * a[0], u + 0.5 * h * a[1]);
        let c = rate(x + 0.5 * h * b[0], u + 0.5 * h * b[1]);
        let d = rate(x + h * c[0], u + h * c[1]);
        x += h / 6.0 * (a[0] + 2.0 * b[0] + 2.0 * c[0] + d[0]);
        u += h / 6.0 * (a[1] + 2.0 * b[1] + 2.0 * c[1] + d[1]);
        slipping += h;
        (highest, lowest) = (highest.max(x), lowest.min(x));
    }
    [slipping + (breaks - x) / v, highest, lowest]
}

#[test]
fn a_block_on_a_belt_sticks_and_slips_as_in_an_independent_model() {
    let (v, k) = (0.05, 200.0);
    let belt = "parent = \"belt\"";
    let rest = "[[body]]\nname = \"belt\"\nmass = \"1 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n\
        [[joint]]\nname = \"B\"\nkind = \"prismatic\"\nchild = \"belt\"\naxis = [1, 0, 0]\n\
        drive = { law = \"constant\", velocity = \"50 mm/s\" }\n\
        [[bushing]]\nname = \"spring\"\nfrom = { body = \"world\" }\nto = { body = \"block\" }\nstiffness = \"200 0 0 N/m\"";
    let expected = stick_slip(v, k, 9.81, 0.15, 1.6, 2e-3);
    for method in Method::ALL {
        let changes = [
            ("contact.static_friction_ratio", "1.6"),
            ("contact.stribeck_speed", "2 mm/s"),
            ("solver.method", method.word()),
        ];
        let mut simulation = run(&block("-9.81 m/s^2", belt, rest), &changes);
        let mut time = 0.9;
        run_until(&mut simulation, time);
        // Positions every 0.1 ms, from which the turning points follow by parabolas.
        let mut x = Vec::new();
        while time < 2.5 {
            x.push(-frame_now(&mut simulation).elements[0].force.x / k);
            time += 1e-4;
            run_until(&mut simulation, time);
        }
        let turn = |i: usize| {
            let (a, b) = (0.5 * (x[i + 1] - x[i - 1]), x[i + 1] - 2.0 * x[i] + x[i - 1]);
            (0.9 + (i as f64 - a / b) * 1e-4, x[i] - 0.5 * a * a / b)
        };
        let tops: Vec<(f64, f64)> =
            (1..x.len() - 1).filter(|&i| x[i] > 0.012 && x[i] > x[i - 1] && x[i] >= x[i + 1]).map(turn).collect();
        assert_eq!(tops.len(), 3, "{method}: {tops:?}");
        let lowest = x.iter().copied().fold(f64::INFINITY, f64::min);
        let period = 0.5 * (tops[2].0 - tops[0].0);
        let found = [period, tops[1].1, lowest];
        println!("{method}: {found:?} {expected:?}");
        let allowed = if method == Method::DiscreteGradient { 1e-2 } else { 1e-4 };
        for (i, scale) in [expected[0], expected[1], expected[1]].into_iter().enumerate() {
            assert!((found[i] - expected[i]).abs() < allowed * scale, "{method}: {found:?} {expected:?}");
        }
        let ledger = frame_now(&mut simulation).ledger.expect("on");
        assert!(ledger.relative_residual().abs() < 1e-4, "{method}: {:e}", ledger.relative_residual());
    }
}

/// Every kind of joint with play, ball, pin, block and planar pin, in every method and formulation.
#[test]
fn methods_and_formulations_agree_on_every_kind() {
    for (name, end) in [("spcmm", 20e-3), ("slider-crank-worn", 8e-3), ("excavator", 60e-3), ("released-slide", 8e-3)] {
        let runs = THREE_VARIANTS.map(|(method, formulation)| {
            let changes = [
                BRISTLES,
                ("contact.static_friction_ratio", "1.3"),
                ("solver.method", method),
                ("formulation", formulation),
                ("solver.tolerance", "1e-9"),
            ];
            let mut run = simulation(name, &changes);
            let (mut frame, mut losses) = (Frame::default(), vec![0.0]);
            for n in 1..=200 {
                let time = end * f64::from(n) / 200.0;
                run.advance_to(time).unwrap();
                run.sample(time, &mut frame);
                losses.push(frame.ledger.expect("on").friction_loss);
            }
            let ledger = frame.ledger.expect("on");
            assert!(losses.windows(2).all(|pair| pair[1] >= pair[0] - 1e-9 * ledger.exchanged), "{name}, {method}");
            assert!(ledger.residual().abs() < 1e-6 * ledger.exchanged, "{name}, {method}: {:e}", ledger.residual());
            let friction = frame.joints.iter().map(|joint| joint.friction_force.norm()).fold(0.0, f64::max);
            (frame.bodies.iter().map(|body| body.position).collect::<Vec<Vec3>>(), losses, friction)
        });
        let (first, others) = runs.split_first().expect("three");
        for (i, other) in others.iter().enumerate() {
            let off = first.0.iter().zip(&other.0).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            let loss = (first.1[200] / other.1[200] - 1.0).abs();
            println!("{name} {i}: {off:e} m, loss {loss:e} of {:e}", first.1[200]);
            assert!(off < 1e-7 && loss < 1e-3, "{name}, {i}: {off:e} m, loss {loss:e}");
        }
        assert!(first.1[200] > 0.0, "{name}");
    }
}

#[test]
fn a_state_continues_with_the_same_bits() {
    for method in Method::ALL {
        let changes = [BRISTLES, ("solver.method", method.word())];
        let mut run = simulation("spcmm", &changes);
        run.advance_to(0.05).unwrap();
        let state = run.snapshot();
        run.advance_to(0.08).unwrap();
        let hash = run.state_hash();
        let mut other = simulation("spcmm", &changes);
        other.restore(&state);
        other.advance_to(0.08).unwrap();
        assert_eq!(other.state_hash(), hash, "{method}");
    }
}

#[test]
fn the_law_changes_at_a_reset_and_its_numbers_at_once() {
    let mut run = live("spcmm", &[BRISTLES]);
    run.advance_to(0.03).unwrap();
    for (key, value, effect) in [
        ("contact.static_friction_ratio", "1.5", Effect::Now),
        ("contact.stribeck_speed", "1 mm/s", Effect::Now),
        ("contact.bristle_stiffness", "5e7 N/m", Effect::Now),
        ("contact.bristle_damping", "500 N s/m", Effect::Now),
        ("joint.S2.friction_law", "none", Effect::AtReset),
    ] {
        assert_eq!(run.set(key, value), Ok(effect), "{key}");
        let next = run.time() + 5e-3;
        run.advance_to(next).unwrap();
        let ledger = *run.ledger().expect("on");
        assert!(ledger.residual().abs() < 1e-5 * ledger.exchanged, "{key}: {:e}", ledger.residual());
    }
}

/// A long arm hangs on a loose pin that sticks, and so rolls in its bearing: about c / r times the friction angle to each side.
#[test]
fn a_pin_that_sticks_rolls_in_its_bearing() {
    let text = r#"
        [gravity]
        z = "-9.81 m/s^2"
        [contact]
        friction_law = "bristle"
        friction = 0.5
        [solver]
        method = "radau5"
        [[body]]
        name = "arm"
        mass = "1 kg"
        inertia = "1e-2 1e-2 1e-2 kg m^2"
        [[joint]]
        name = "J"
        kind = "revolute"
        child = "arm"
        axis = [0, 1, 0]
        child_point = "0 0 1 m"
        start = { position = "0.6 deg" }
        play = { radial = "0.1 mm", length = "20 mm", radius = "10 mm", planar = true }
        "#;
    let mut run = run(text, &[]);
    run_until(&mut run, 15.0);
    let lost = frame_now(&mut run).ledger.expect("on").friction_loss;
    let mut swing = 0.0_f64;
    for n in 0..50 {
        run_until(&mut run, 15.0 + 0.1 * f64::from(n));
        swing = swing.max(frame_now(&mut run).bodies[0].position.x.abs());
    }
    let more = frame_now(&mut run).ledger.expect("on").friction_loss - lost;
    let expected = 0.1e-3 / 10e-3 * 0.5_f64.atan();
    println!("{swing:e} {expected:e}, lost {more:e} J");
    assert!((swing / expected - 1.0).abs() < 0.1, "{swing:e} rad, expected about {expected:e}");
    assert!(more < 0.01 * 9.81 * swing * swing / 2.0, "{more:e} J");
}

/// It swings along its guide on its bristles: two at the corners that press, and their damping.
/// A bearing that turns at 100 rad/s about a pin of 1 kg which does not: the carrier of the bristles turns under a contact that stays.
pub const TURNING: &str = r#"
[contact]
friction = 0.1
friction_law = "bristle"
[[body]]
name = "house"
mass = "1 kg"
inertia = "0.01 0.01 0.01 kg m^2"
[[joint]]
name = "H"
kind = "revolute"
child = "house"
axis = [0, 1, 0]
drive = { law = "constant", velocity = "100 rad/s" }
[[body]]
name = "shaft"
mass = "1 kg"
inertia = "1000 1000 1000 kg m^2"
[[joint]]
name = "J"
kind = "cylindrical"
parent = "house"
child = "shaft"
axis = [0, 1, 0]
start = { angular_velocity = "-100 rad/s", offset = [0, 0, "-0.1001 mm"] }
play = { radial = "0.1 mm", radius = "10 mm", length = "20 mm" }
[[bushing]]
name = "d"
from = { body = "world" }
to = { body = "shaft" }
damping = "3000 3000 3000 N s/m"
"#;

#[test]
fn bristles_on_a_turning_wall_stay_in_its_plane_and_take_what_the_drive_gives() {
    for method in METHODS {
        // Explicit steps at the limit of their stability fill a wide tolerance with noise.
        let widest = if method == "dopri5" { "1e-6" } else { "1e-4" };
        for tolerance in [widest, "1e-7"] {
            let mut simulation = run(TURNING, &[("solver.method", method), ("solver.tolerance", tolerance)]);
            run_until(&mut simulation, 0.1);
            let before = *simulation.ledger().unwrap();
            run_until(&mut simulation, 2.0);
            let after = *simulation.ledger().unwrap();
            let (given, taken) = (after.drive_work - before.drive_work, after.friction_loss - before.friction_loss);
            let steps = simulation.statistics().steps;
            println!("{method} {tolerance}: {given} J, {:e} J, {steps} steps", taken - given);
            assert!(
                (given / 1.9 / 0.986 - 1.0).abs() < 0.01 && (taken / given - 1.0).abs() < 1e-4,
                "{method}: {taken}"
            );
            // Two ends bear half of the weight each.
            let limit = 0.1 * 0.5 * 9.81 / 1e8;
            let state = simulation.state_vector();
            for bent in state[state.len() - 6..].chunks(3) {
                let length = Vec3::from_column_slice(bent).norm();
                assert!(length < 3.0 * limit, "{method} {tolerance}: {length:e} m, not {limit:e}");
            }
            // Sliding that does not change limits no implicit step, however short the bristles' time.
            assert!(method != "radau5" || steps < 1000, "{method} {tolerance}: {steps} steps");
        }
    }
}

#[test]
fn what_sticks_is_linearised_with_its_stiffness() {
    let mut run = run(&block("-9.81 m/s^2", "", ""), &[]);
    run.advance_to(1.0).unwrap();
    let (k, d, mass) = (2e8_f64, 4e3, 1.0);
    let expected = (k / mass - (0.5 * d / mass) * (0.5 * d / mass)).sqrt();
    let eigenvalues = run.linearise().unwrap().matrix.complex_eigenvalues();
    println!("{eigenvalues} {expected}");
    let nearest = eigenvalues.iter().map(|value| (value.im / expected - 1.0).abs()).fold(f64::INFINITY, f64::min);
    assert!(nearest < 1e-3, "{nearest:e}");
}

/// A block in a guide 50 mm from the vertical axis of a table that turns at 3 rad/s: its bristles bear 0.45 N and turn with the guide.
#[test]
fn what_sticks_turns_with_its_carrier() {
    let table = "[[body]]\nname = \"table\"\nmass = \"1 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n\
        [[joint]]\nname = \"turn\"\nkind = \"revolute\"\nchild = \"table\"\naxis = [0, 1, 0]\n\
        drive = { law = \"constant\", velocity = \"3 rad/s\" }";
    let guide = "parent = \"table\"\nparent_point = \"50 0 0 mm\"";
    for method in Method::ALL {
        let mut run = run(&block("-9.81 m/s^2", guide, table), &[("solver.method", method.word())]);
        run_until(&mut run, 0.5);
        let before = frame_now(&mut run).joints[0];
        assert_eq!(before.state, ContactMode::Stick, "{method}");
        run_until(&mut run, 1.5);
        let after = frame_now(&mut run).joints[0];
        let (moved, force) = ((after.axial - before.axial).abs(), after.friction_force.norm());
        println!("{method}: {moved:e} m, {force} N");
        assert!(moved < 1e-9, "{method}: {moved:e} m");
        assert!((force - 0.45).abs() < 1e-3, "{method}: {force} N");
    }
}

#[test]
#[ignore = "full: half a minute"]
fn full_a_loaded_block_does_not_drift_in_a_thousand_seconds() {
    let load = "[[load]]\nname = \"push\"\non = { body = \"block\" }\nforce = \"1 0 0 N\"\n\
        factor = { law = \"table\", interpolation = \"linear\", points = [[\"0 s\", 0], [\"0.5 s\", 1]] }";
    for method in [Method::Automatic, Method::Radau5, Method::DiscreteGradient] {
        let mut run = run(&block("-9.81 m/s^2", "", load), &[("solver.method", method.word())]);
        run_until(&mut run, 1.0);
        let before = frame_now(&mut run).bodies[0].position;
        run_until(&mut run, 1000.0);
        let frame = frame_now(&mut run);
        let moved = (frame.bodies[0].position - before).norm();
        println!("{method}: {moved:e} m, {} steps", run.statistics().steps);
        assert!(moved < 1e-9, "{method}: {moved:e} m");
        assert_eq!(frame.joints[0].state, ContactMode::Stick, "{method}");
    }
}
