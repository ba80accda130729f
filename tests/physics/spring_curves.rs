//! Springs and dampers with a characteristic through points against closed-form solutions, in every method and both formulations.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::common::matrix::for_every;
use crate::common::{THREE_VARIANTS, assert_refused, parse};
use crate::elements::frame_at;
use jointplay_physics::interpolate::Interpolation;
use jointplay_physics::machine::{Characteristic, ElementKind, Machine};
use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_scene::Scene;

const MASS: f64 = 0.5;
/// Moment of inertia of the hinged body about its hinge.
const INERTIA: f64 = 4e-4 + MASS * 0.01;

/// The natural spline through (0, 0), (WIDTH, F1), (2 WIDTH, F2) is T(s) = A s + B s^3 between 0 and `WIDTH`, with
/// A = F1 / WIDTH - m1 WIDTH / 6, B = m1 / 6 WIDTH and m1 = 3 (F2 - 2 F1) / 2 WIDTH^2. Below 0 it is straight.
const WIDTH: f64 = 0.1;
const F1: f64 = 10.0;
const F2: f64 = 40.0;
const M1: f64 = 1.5 * (F2 - 2.0 * F1) / (WIDTH * WIDTH);
const A: f64 = F1 / WIDTH - M1 * WIDTH / 6.0;
const B: f64 = M1 / (6.0 * WIDTH);

/// Where the spring acts.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mounting {
    /// A spring between the world and a free body.
    Body,
    Slide,
    Hinge,
}

impl Mounting {
    fn inertia(self) -> f64 {
        if self == Self::Hinge { INERTIA } else { MASS }
    }

    /// Scale of the forces that makes the motion the same for every mounting.
    fn scale(self) -> f64 {
        self.inertia() / MASS
    }

    fn text(self, points: &[[f64; 2]], more: &str) -> String {
        let (x, f) = match self {
            Self::Hinge => ("rad", "N m"),
            _ => ("m", "N"),
        };
        let point = |p: &[f64; 2]| format!("[\"{:e} {x}\", \"{:e} {f}\"]", p[0], p[1] * self.scale());
        let points: Vec<String> = points.iter().map(point).collect();
        let points = points.join(", ");
        let (joint, spring) = match self {
            Self::Body => (
                "kind = \"free\"\nstart = { position = \"400 0 0 mm\" }",
                "[[spring]]\nfrom = { body = \"world\" }\nto = { body = \"mass\" }\nlength = \"300 mm\"",
            ),
            Self::Slide => (
                "kind = \"prismatic\"\naxis = [1, 0, 0]\nstart = { position = \"400 mm\" }",
                "[[joint_spring]]\njoint = \"j\"\nposition = \"300 mm\"",
            ),
            Self::Hinge => (
                "kind = \"revolute\"\naxis = [0, 0, 1]\nchild_point = \"-100 0 0 mm\"\nstart = { position = \"0.4 rad\" }",
                "[[joint_spring]]\njoint = \"j\"\nposition = \"0.3 rad\"",
            ),
        };
        format!(
            "[gravity]\nx = 0\ny = 0\nz = 0\n\
             [[body]]\nname = \"mass\"\nmass = \"{MASS} kg\"\ninertia = \"2e-4 3e-4 4e-4 kg m^2\"\n\
             [[joint]]\nname = \"j\"\nchild = \"mass\"\n{joint}\n\
             {spring}\nname = \"s\"\ncharacteristic = [{points}]\n{more}"
        )
    }

    fn start(self, points: &[[f64; 2]], more: &str, changes: &[(&str, &str)]) -> Simulation {
        Simulation::new(&parse(&self.text(points, more), changes).machine).unwrap()
    }

    /// Elongation of the spring, and its rate.
    fn state(self, frame: &Frame) -> [f64; 2] {
        let body = &frame.bodies[0];
        match self {
            Self::Hinge => {
                let angle = libm::atan2(body.rotation[(1, 0)], body.rotation[(0, 0)]);
                [angle - 0.3, body.angular_velocity.z]
            }
            _ => [body.position.x - 0.3, body.velocity.x],
        }
    }
}

const SPLINE: &str = "interpolation = \"spline\"\n";
const POINTS: [[f64; 2]; 3] = [[0.0, 0.0], [WIDTH, F1], [2.0 * WIDTH, F2]];

/// Complete elliptic integral of the first kind for k^2 = `m`.
fn elliptic(m: f64) -> f64 {
    let (mut a, mut b) = (1.0, (1.0 - m).sqrt());
    for _ in 0..40 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    FRAC_PI_2 / a
}

/// Time at which a mass released at `WIDTH` passes 0, and its speed there.
fn zero_crossing() -> (f64, f64) {
    let cubic = B * WIDTH * WIDTH;
    let omega = ((A + cubic) / MASS).sqrt();
    let time = elliptic(cubic / (2.0 * (A + cubic))) / omega;
    let speed = WIDTH * ((A + 0.5 * cubic) / MASS).sqrt();
    (time, speed)
}

#[test]
fn a_hardening_spring_oscillates_as_duffings_in_every_method_and_formulation() {
    let (zero_crossing, speed) = zero_crossing();
    let omega = (A / MASS).sqrt();
    for_every([Mounting::Body, Mounting::Slide, Mounting::Hinge], |mounting, variant| {
        let bound = variant.bound();
        let mut simulation = mounting.start(&POINTS, SPLINE, &variant.close());
        let label = format!("{mounting:?} {variant}");
        // A quarter period along the cubic, half a period along the straight end, and back to the cubic.
        let frame = frame_at(&mut simulation, zero_crossing);
        let [x, v] = mounting.state(&frame);
        assert!(x.abs() < bound && (v + speed).abs() < 20.0 * bound, "{label}: {x:e} {v}");
        let stored = mounting.scale() * 0.5 * MASS * speed * speed;
        assert!(frame.elastic.abs() < 20.0 * bound * mounting.scale(), "{label}");
        let frame = frame_at(&mut simulation, zero_crossing + 0.5 * PI / omega);
        let [x, _] = mounting.state(&frame);
        assert!((x + speed / omega).abs() < 2.0 * bound, "{label}: {x:e}");
        assert!((frame.elastic / stored - 1.0).abs() < 100.0 * bound, "{label}");
        let frame = frame_at(&mut simulation, zero_crossing + PI / omega);
        let [x, v] = mounting.state(&frame);
        assert!(x.abs() < 4.0 * bound && (v - speed).abs() < 40.0 * bound, "{label}: {x:e}");
        let residual = simulation.ledger().unwrap().relative_residual();
        assert!(residual.abs() < 1e-4, "{label}: {residual:e}");
    });
}

#[test]
fn the_error_falls_with_the_order_of_the_method_along_a_curve() {
    let (zero_crossing, _) = zero_crossing();
    let error = |steps: f64| {
        let step = format!("{:e} s", zero_crossing / steps);
        let changes = [("solver.method", "rk4"), ("solver.step", &*step)];
        let mut simulation = Mounting::Body.start(&POINTS, SPLINE, &changes);
        Mounting::Body.state(&frame_at(&mut simulation, zero_crossing))[0].abs()
    };
    let [coarse, fine] = [20.0, 40.0].map(error);
    let observed = (coarse / fine).log2();
    println!("{coarse:e}, {fine:e}, order {observed}");
    assert!((observed - 4.0).abs() < 0.2, "{observed}");
}

/// Two springs that meet at 0, as a characteristic.
const SOFT: f64 = 80.0;
const HARD: f64 = 320.0;
const LINES: [[f64; 2]; 3] = [[-0.2, -0.2 * SOFT], [0.0, 0.0], [0.2, 0.2 * HARD]];
const LINEAR: &str = "interpolation = \"linear\"\n";

#[test]
fn straight_lines_oscillate_as_half_periods_of_two_springs() {
    let [soft, hard] = [SOFT, HARD].map(|stiffness| PI / (stiffness / MASS).sqrt());
    for_every([Mounting::Body, Mounting::Slide, Mounting::Hinge], |mounting, variant| {
        // A step that is not cut at a kink has an error of the third order in its size.
        let bound = if variant.method == "rk4" { 1e-7 } else { variant.bound() };
        let mut simulation = mounting.start(&LINES, LINEAR, &variant.close());
        for n in 0..3 {
            let start = f64::from(n) * (soft + hard);
            let label = format!("{mounting:?} {variant} {n}");
            // It begins at 0.1 m, passes 0, turns on the soft side, and returns.
            let amplitude = 0.1 * (HARD / SOFT).sqrt();
            for (time, expected) in [
                (start, 0.1),
                (start + 0.5 * hard, 0.0),
                (start + 0.5 * (hard + soft), -amplitude),
                (start + 0.5 * hard + soft, 0.0),
            ] {
                let [x, _] = mounting.state(&frame_at(&mut simulation, time));
                assert!((x - expected).abs() < 20.0 * bound, "{label}: {:e} at {time}", x - expected);
            }
        }
        let residual = simulation.ledger().unwrap().relative_residual();
        assert!(residual.abs() < 1e-4, "{label}: {residual:e}", label = variant);
    });
}

#[test]
fn steps_end_at_the_kinks_of_straight_lines() {
    // A characteristic of 40 lines along a cubic, crossed several lines in a step at this tolerance.
    let cubic = |s: f64| 400.0 * s + 3e4 * s * s * s;
    let many: Vec<[f64; 2]> = (-20..=20).map(|n| 7.3e-3 * f64::from(n)).map(|s| [s, cubic(s)]).collect();
    for (points, mounting) in [(&LINES[..], Mounting::Slide), (&many, Mounting::Body), (&many, Mounting::Hinge)] {
        for method in ["dopri5", "automatic"] {
            let changes = [("solver.method", method), ("solver.tolerance", "1e-6")];
            let mut simulation = mounting.start(points, LINEAR, &changes);
            let kinks: Vec<f64> = points[1..points.len() - 1].iter().map(|point| point[0]).collect();
            let [mut before, _] = mounting.state(&frame_at(&mut simulation, 0.0));
            let (mut crossed, mut first) = (0, None);
            while simulation.time() < 1.0 {
                simulation.step().unwrap();
                let frame = crate::common::frame_now(&mut simulation);
                let [now, _] = mounting.state(&frame);
                let inside = before.min(now) + 1e-9..before.max(now) - 1e-9;
                let passed = kinks.iter().find(|kink| inside.contains(kink));
                assert!(
                    passed.is_none(),
                    "{method} {mounting:?}: {passed:?} between {before} and {now} at {}",
                    frame.time
                );
                crossed += u32::from(kinks.iter().any(|kink| (kink - now).abs() < 1e-9));
                let energy = frame.kinetic + frame.potential;
                let scale = *first.get_or_insert(energy);
                assert!((energy / scale - 1.0).abs() < 1e-3, "{method} {mounting:?}: {energy} {scale}");
                before = now;
            }
            assert!(crossed >= 5, "{method} {mounting:?}: {crossed}");
        }
    }
}

/// A damper that is harder up to this speed, m/s, with its damping below and above, N s/m, and a constant force that pulls, N.
const SLOW: f64 = 0.1;
const DAMPINGS: [f64; 2] = [20.0, 5.0];
const PULL: f64 = 4.0;

/// Distance moved and speed a time after release, where `force` pulls against `damping` from rest.
fn relaxed(force: f64, damping: f64, time: f64) -> [f64; 2] {
    let lag = MASS / damping;
    let fraction = -libm::expm1(-time / lag);
    let last = force / damping;
    [last * (time - lag * fraction), last * fraction]
}

#[test]
fn a_damper_along_straight_lines_lets_a_mass_approach_one_speed_and_then_another() {
    let [slow, fast] = DAMPINGS;
    let hold = slow * SLOW;
    let change = -MASS / slow * libm::log1p(-hold / PULL);
    let expected = |time: f64| {
        if time <= change {
            return relaxed(PULL, slow, time);
        }
        let [before, _] = relaxed(PULL, slow, change);
        let [moved, speed] = relaxed(PULL - hold, fast, time - change);
        [before + SLOW * (time - change) + moved, SLOW + speed]
    };
    for_every([Mounting::Body, Mounting::Slide, Mounting::Hinge], |mounting, variant| {
        let mut machine = Machine::clone(&parse(&mounting.text(&LINES, LINEAR), &variant.close()).machine);
        let scale = mounting.scale();
        let force = |speed: f64| scale * (hold + fast * (speed - SLOW));
        let points = [[-1.0, -force(1.0)], [-SLOW, -scale * hold], [SLOW, scale * hold], [1.0, force(1.0)]];
        let curve = Characteristic::Curve { points: points.to_vec(), interpolation: Interpolation::Linear };
        let constant = Characteristic::Line { offset: scale * PULL, slope: 0.0 };
        match &mut machine.elements[0].kind {
            ElementKind::Spring(spring) => (spring.elastic, spring.damping) = (constant, curve),
            ElementKind::JointSpring(spring) => (spring.elastic, spring.damping) = (constant, curve),
            _ => panic!("a spring"),
        }
        let mut simulation = Simulation::new(&machine).unwrap();
        // A step that is not cut at a kink has an error of the third order in its size.
        let bound = if variant.method == "rk4" { 1e-7 } else { variant.bound() };
        if variant.method == "dopri5" {
            let mut speeds = std::iter::from_fn(|| {
                simulation.step().unwrap();
                Some(-mounting.state(&crate::common::frame_now(&mut simulation))[1])
            });
            let first = speeds.find(|speed| *speed > SLOW - 1e-6).unwrap();
            assert!((first - SLOW).abs() < 1e-9, "a step passed the kink: {first}");
            simulation = Simulation::new(&machine).unwrap();
        }
        for time in [0.5 * change, change, 2.0 * change, 0.1, 0.3] {
            let [x, v] = mounting.state(&frame_at(&mut simulation, time));
            let [moved, speed] = expected(time);
            let off = [0.1 - x - moved, -v - speed];
            assert!(off[0].abs() < bound && off[1].abs() < 20.0 * bound, "{mounting:?} {variant} {time}: {off:?}");
        }
        let ledger = simulation.ledger().unwrap();
        let [moved, speed] = expected(simulation.time());
        let lost = scale * (PULL * moved - 0.5 * MASS * speed * speed);
        assert!((ledger.damping_loss / lost - 1.0).abs() < 1e-4, "{mounting:?} {variant}: {ledger:?} {lost}");
        assert!(ledger.relative_residual().abs() < 1e-4, "{mounting:?} {variant}: {ledger:?}");
    });
}

#[test]
fn points_on_a_line_are_the_spring_of_that_line() {
    let line = [[-0.05, -1.0], [0.0, 3.0], [0.1, 11.0], [0.15, 15.0]];
    for (mounting, keys) in [
        (Mounting::Body, "stiffness = \"80 N/m\"\npreload = \"3 N\""),
        (Mounting::Slide, "stiffness = \"80 N/m\"\npreload = \"3 N\""),
    ] {
        for side in ["", "side = \"push\"", "side = \"pull\""] {
            if mounting == Mounting::Slide && !side.is_empty() {
                continue;
            }
            let more = format!("damping = \"2 N s/m\"\n{side}\n");
            let text = mounting.text(&line, &more);
            let from = text.find("characteristic").unwrap();
            let to = from + text[from..].find('\n').unwrap();
            let plain = format!("{}{keys}{}", &text[..from], &text[to..]);
            let [mut a, mut b] = [&text, &plain].map(|text| {
                let scene = parse(text, &[("solver.tolerance", "1e-10")]);
                Simulation::new(&scene.machine).unwrap()
            });
            let offset = frame_at(&mut a, 0.0).elastic - frame_at(&mut b, 0.0).elastic;
            for n in 1..20 {
                let [a, b] = [&mut a, &mut b].map(|s| frame_at(s, 0.02 * f64::from(n)));
                assert!((a.bodies[0].position - b.bodies[0].position).norm() < 1e-9);
                assert!((a.elements[0].force - b.elements[0].force).norm() < 1e-6);
                // The zero of the elastic energy may differ where the spring does not act.
                assert!((a.elastic - b.elastic - offset).abs() < 1e-7, "{mounting:?} {side}");
            }
        }
    }
}

#[test]
fn a_one_sided_buffer_returns_its_energy() {
    // A hardening buffer throws a mass off, which falls back after free flight.
    let text = "[gravity]\nz = \"-9.81 m/s^2\"\n\
        [[body]]\nname = \"mass\"\nmass = \"0.5 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n\
        [[joint]]\nname = \"guide\"\nkind = \"prismatic\"\nchild = \"mass\"\naxis = [0, 0, 1]\nstart = { position = \"60 mm\" }\n\
        [[spring]]\nname = \"pad\"\nfrom = { body = \"world\" }\nto = { body = \"mass\" }\nlength = \"100 mm\"\nside = \"push\"\n\
        characteristic = [[\"-50 mm\", \"-200 N\"], [\"-30 mm\", \"-40 N\"], [\"-10 mm\", \"-5 N\"], [0, 0], [\"10 mm\", \"4 N\"]]\n";
    let cases = Interpolation::ALL.into_iter().flat_map(|way| THREE_VARIANTS.map(|variant| (way, variant)));
    for (interpolation, (method, formulation)) in cases {
        let text = format!("{text}interpolation = \"{interpolation}\"\n");
        let changes = [("solver.method", method), ("solver.tolerance", "1e-9"), ("formulation", formulation)];
        let mut simulation = Simulation::new(&parse(&text, &changes).machine).unwrap();
        let mut highest = 0.0_f64;
        let energy = frame_at(&mut simulation, 0.0);
        let total_energy = energy.elastic + 0.5 * 9.81 * 0.06;
        for n in 1..=1500 {
            let frame = frame_at(&mut simulation, f64::from(n) * 1e-3);
            let height = frame.bodies[0].position.z;
            highest = highest.max(height);
            let force = frame.elements[0].force.z;
            assert!(force >= 0.0 && (force == 0.0) == (height >= 0.1), "{force} at {height}");
            assert!((frame.kinetic + frame.potential - total_energy).abs() < 1e-6, "{method} {interpolation}");
        }
        let top = total_energy / (0.5 * 9.81);
        assert!(top > 0.2 && (highest - top).abs() < 1e-4, "{method} {interpolation}: {highest} {top}");
        let ledger = simulation.ledger().unwrap();
        assert!(ledger.relative_residual().abs() < 1e-6, "{method} {ledger:?}");
    }
}

#[test]
fn a_characteristic_can_be_read_from_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    let text = Mounting::Body.text(&POINTS, "");
    let from = text.find("characteristic").unwrap();
    std::fs::write(&scene, format!("{}file = \"coil.csv\"\n{SPLINE}", &text[..from])).unwrap();
    let coil = folder.path().join("coil.csv");
    std::fs::write(&coil, "# measured\nlength_mm, tension [N]\n0, 0\n100, 10\n200, 40\n").unwrap();
    let scene = Scene::load(&scene, &[]).unwrap();
    let ElementKind::Spring(spring) = &scene.machine.elements[0].kind else {
        panic!("a spring");
    };
    assert_eq!(spring.elastic, Characteristic::Curve { points: POINTS.to_vec(), interpolation: Interpolation::Spline });
    let mut simulation = Simulation::new(&scene.machine).unwrap();
    let (zero_crossing, _) = zero_crossing();
    assert!(Mounting::Body.state(&frame_at(&mut simulation, zero_crossing))[0].abs() < 1e-4);
}

#[test]
fn errors_in_a_characteristic_are_located() {
    let start = "[[body]]\nname = \"mass\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n\
        [[joint]]\nname = \"h\"\nkind = \"revolute\"\naxis = [0, 0, 1]\nchild = \"mass\"\n";
    let spring = "[[spring]]\nname = \"s\"\nfrom = { body = \"world\" }\nto = { body = \"mass\" }\nlength = \"1 m\"\n";
    let turning = "[[joint_spring]]\nname = \"t\"\njoint = \"h\"\n";
    let cases = r#"
        SPRING; characteristic = [[0, 0], ["1 mm", "1 N"]]; stiffness = "1 N/m" -> spring.s.stiffness | not allowed here: `characteristic`
        SPRING; characteristic = [[0, 0], ["1 mm", "1 N"]]; preload = "1 N" -> spring.s.preload | not allowed here
        SPRING; characteristic = [[0, 0], ["1 mm", "1 N"]]; file = "a.csv" -> spring.s.file | `characteristic` is given as well
        SPRING; file = "a.csv" -> spring.s.file | has no folder
        SPRING; stiffness = "1 N/m"; interpolation = "linear" -> spring.s.interpolation | the spring has no `characteristic`
        SPRING; characteristic = [[0, 0], ["1 mm", "1 N"]]; interpolation = "cubic" -> spring.s.interpolation = "cubic" | allowed spline, monotone, linear
        SPRING; characteristic = [[0, 0]] -> spring.s.characteristic | has 1 points; allowed 2 to 10000
        SPRING; characteristic = [[0, 0], ["2 mm", "1 N"], ["1 mm", "2 N"]] -> spring.s.characteristic[2][0] = "1 mm" | lengths must rise, by at least 1 nm
        SPRING; characteristic = [[0, 0], ["2 mm"]] -> spring.s.characteristic[1] | needs a length and a tension, has 1 values
        SPRING; characteristic = [[0, 0], ["2 mm", "1 mm"]] -> spring.s.characteristic[1][1] | wrong unit `mm`
        SPRING; characteristic = [[0, 0], ["2 mm", 0]] -> spring.s | does nothing
        TURNING; characteristic = [[0, 0], ["2 mm", "1 N"]] -> joint_spring.t.characteristic[1][0] | wrong unit `mm`
        TURNING; characteristic = [["1 deg"]] -> joint_spring.t.characteristic[0] | needs an angle and a torque
    "#;
    assert_refused(cases, |more| {
        let text = start.to_owned() + &more.replace("SPRING\n", spring).replace("TURNING\n", turning);
        Scene::parse(&text, Some("mine.toml"), &[])
    });
}
