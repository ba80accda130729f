//! Force elements against closed-form solutions, in every method and both formulations.

use crate::common::matrix::in_tree;
use crate::common::{THREE_VARIANTS, assert_refused, parse};
use jointplay_physics::machine::Vec3;
use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_scene::Scene;

const MASS: f64 = 0.5;

/// A free body of `MASS` at rest at (0.13, 0, 0) m without gravity; `more` is appended to the scene.
fn floating(more: &str, changes: &[(&str, &str)]) -> Simulation {
    let text = format!(
        "[gravity]\nx = 0\ny = 0\nz = 0\n\
         [[body]]\nname = \"mass\"\nmass = \"{MASS} kg\"\ninertia = \"2e-4 3e-4 4e-4 kg m^2\"\n\
         [[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"mass\"\nstart = {{ position = \"130 0 0 mm\" }}\n{more}"
    );
    let owned = |&(key, value): &(&str, &str)| (key.to_owned(), value.to_owned());
    let changes: Vec<(String, String)> = changes.iter().map(owned).collect();
    Simulation::new(&Scene::parse(&text, None, &changes).unwrap().machine).unwrap()
}

/// The frame at `time`, s.
pub fn frame_at(simulation: &mut Simulation, time: f64) -> Frame {
    while simulation.time() < time {
        simulation.step_until(time).unwrap();
    }
    let mut frame = Frame::default();
    simulation.sample(time, &mut frame);
    frame
}

/// Spring of 200 N/m with 100 mm of free length, from the origin to the body's centroid.
const SPRING: &str = "[[spring]]\nname = \"s\"\nfrom = { body = \"world\" }\nto = { body = \"mass\" }\n\
                      length = \"100 mm\"\nstiffness = \"200 N/m\"\n";

#[test]
fn a_mass_on_a_spring_has_its_natural_frequency_in_every_method() {
    let omega = (200.0 / MASS).sqrt();
    for variant in in_tree() {
        let bound = variant.bound();
        let mut simulation = floating(SPRING, &variant.close());
        let time = 0.2;
        let frame = frame_at(&mut simulation, time);
        let expected = 0.1 + 0.03 * (omega * time).cos();
        let error = (frame.bodies[0].position - Vec3::new(expected, 0.0, 0.0)).norm();
        assert!(error < bound, "{variant}: {error:e}");
        let tension = 200.0 * (expected - 0.1);
        assert!((frame.elements[0].force.x + tension).abs() < 2e3 * bound);
        assert!((frame.elastic - 0.5 * 200.0 * (expected - 0.1f64).powi(2)).abs() < 20.0 * bound);
        let ledger = simulation.ledger().unwrap();
        assert!(ledger.exchanged > 0.1, "{ledger:?}");
        assert!(ledger.relative_residual().abs() < 1e-4, "{variant}");
    }
}

#[test]
fn a_damper_dissipates_as_the_closed_form() {
    // Underdamped: x = 0.1 + e^(-d t) (A cos w t + B sin w t) with d = c / 2m, w^2 = k/m - d^2, started at rest.
    let (k, c): (f64, f64) = (200.0, 4.0);
    let d = c / (2.0 * MASS);
    let w = (k / MASS - d * d).sqrt();
    for method in ["dopri5", "radau5", "automatic", "rk4"] {
        let mut simulation = floating(
            &format!("{SPRING}damping = \"4 N s/m\"\n"),
            &[("solver.method", method), ("solver.tolerance", "1e-10")],
        );
        let time = 0.25;
        let frame = frame_at(&mut simulation, time);
        let (sin, cos) = (w * time).sin_cos();
        let decay = (-d * time).exp();
        let expected = 0.1 + 0.03 * decay * (cos + d / w * sin);
        let error = (frame.bodies[0].position.x - expected).abs();
        assert!(error < 1e-8, "{method}: {error:e}");
        let speed = -0.03 * decay * (w + d * d / w) * sin;
        let remaining = 0.5 * MASS * speed * speed + 0.5 * k * (expected - 0.1).powi(2);
        let lost = simulation.ledger().unwrap().damping_loss;
        let expected = 0.5 * k * 0.03 * 0.03 - remaining;
        assert!((lost / expected - 1.0).abs() < 1e-5, "{method}: {lost} {expected}");
    }
}

#[test]
fn a_stiff_damped_spring_does_not_slow_an_implicit_method() {
    // 2 kHz and nearly critically damped: after 0.2 s nothing moves, but an explicit method still takes microsecond steps.
    let stiff = "[[spring]]\nname = \"s\"\nfrom = { body = \"world\" }\nto = { body = \"mass\" }\n\
                 length = \"100 mm\"\nstiffness = \"80 kN/mm\"\ndamping = \"10 kN s/m\"\n";
    let evaluations = |method: &str| {
        let mut simulation = floating(stiff, &[("solver.method", method), ("solver.tolerance", "1e-4")]);
        let frame = frame_at(&mut simulation, 0.2);
        let length = frame.bodies[0].position.norm();
        assert!((length - 0.1).abs() < 1e-6, "{method}: {length}");
        simulation.statistics().evaluations
    };
    let explicit = evaluations("dopri5");
    for method in ["radau5", "automatic"] {
        let implicit = evaluations(method);
        println!("{method} {implicit}, dopri5 {explicit} evaluations");
        assert!(4 * implicit < explicit, "{method}: {implicit} {explicit}");
    }
}

#[test]
fn a_preload_pulls_at_the_rest_length_and_enters_the_energy() {
    let preload = "[[spring]]\nname = \"s\"\nfrom = { body = \"world\" }\nto = { body = \"mass\" }\n\
                   length = \"130 mm\"\npreload = \"6 N\"\n";
    let mut simulation = floating(preload, &[("solver.tolerance", "1e-10")]);
    // A constant pull: x = x0 - F t^2 / 2 m.
    let frame = frame_at(&mut simulation, 0.05);
    let expected = 0.13 - 0.5 * 6.0 / MASS * 0.05 * 0.05;
    assert!((frame.bodies[0].position.x - expected).abs() < 1e-10);
    assert!((frame.elastic - 6.0 * (expected - 0.13)).abs() < 1e-9);
    let residual = simulation.ledger().unwrap().relative_residual();
    assert!(residual.abs() < 1e-9, "{residual:e}");
}

#[test]
fn loads_accelerate_a_body_as_in_the_newton_euler_equations() {
    let push = |axes: &str| {
        format!(
            "[[load]]\nname = \"f\"\non = {{ body = \"mass\" }}\nforce = \"0 3 0 N\"\ntorque = \"0 0 0.02 N m\"\naxes = \"{axes}\"\n"
        )
    };
    let (spin_up, time) = (0.02 / 4e-4, 0.1);
    for method in ["dopri5", "radau5", "rk4"] {
        let changes = [("solver.method", method), ("solver.tolerance", "1e-10"), ("solver.step", "50 us")];
        let mut simulation = floating(&push("world"), &changes);
        let body = frame_at(&mut simulation, time).bodies[0];
        let moved = body.position - Vec3::new(0.13, 0.5 * 3.0 / MASS * time * time, 0.0);
        assert!(moved.norm() < 1e-9, "{method}: {moved}");
        assert!((body.angular_velocity.z - spin_up * time).abs() < 1e-8);
        let kinetic = 0.5 * MASS * body.velocity.norm_squared() + 0.5 * 4e-4 * (spin_up * time).powi(2);
        let work = simulation.ledger().unwrap().external_work;
        assert!((work / kinetic - 1.0).abs() < 1e-6, "{work} {kinetic}");
        // In body axes the force rotates by spin_up t^2 / 2: its impulse is a Fresnel integral.
        let mut rotating = floating(&push("body"), &changes);
        let velocity = frame_at(&mut rotating, time).bodies[0].velocity;
        let (mut x, mut y) = (0.0, 0.0);
        let n = 20_000;
        for i in 0..n {
            let t = (f64::from(i) + 0.5) * time / f64::from(n);
            let (sin, cos) = (0.5 * spin_up * t * t).sin_cos();
            x -= 3.0 * sin / MASS * time / f64::from(n);
            y += 3.0 * cos / MASS * time / f64::from(n);
        }
        let error = (velocity - Vec3::new(x, y, 0.0)).norm();
        assert!(error < 1e-6, "{method}: {error:e}");
    }
}

#[test]
fn elements_are_fixed_to_links_of_a_chain() {
    let text = jointplay_scene::built_in_text("chain").unwrap();
    let with = |element: &str| Scene::parse(&format!("{text}\n{element}"), None, &[]);
    // The load is strong, so the link moves freely before its balls cross their clearances.
    let scene = with("[[load]]\nname = \"push\"\non = { body = \"link3\" }\nforce = \"0 40 0 N\"\n");
    let mut simulation = Simulation::new(&scene.unwrap().machine).unwrap();
    let before = frame_at(&mut simulation, 0.0).bodies[2].position;
    let frame = frame_at(&mut simulation, 1e-3);
    assert!(frame.joints.iter().all(|joint| joint.normal_force.norm() == 0.0));
    let moved = frame.bodies[2].position - before;
    let expected = Vec3::new(0.0, 40.0 / 0.384, -9.81) * 0.5e-6;
    assert!((moved - expected).norm() < 1e-12, "{moved} {expected}");

    for (name, body, fragment) in [
        ("J2", "link3", "already a joint or force element"),
        ("free2", "link3", "already a joint or force element"),
        ("push", "link9", "link8"),
    ] {
        let load = format!("[[load]]\nname = \"{name}\"\non = {{ body = \"{body}\" }}\nforce = \"1 0 0 N\"\n");
        let error = with(&load).unwrap_err().to_string();
        assert!(error.contains(fragment), "{error}");
    }
}

#[test]
fn a_harmonic_load_moves_a_body_as_in_closed_form() {
    let load = "[[load]]\nname = \"f\"\non = { body = \"mass\" }\nforce = \"2 0 0 N\"\nfrequency = \"5 Hz\"\nphase = \"90 deg\"\n";
    let mut simulation = floating(load, &[("solver.tolerance", "1e-10")]);
    let omega = std::f64::consts::TAU * 5.0;
    let time = 0.37;
    let frame = frame_at(&mut simulation, time);
    // m x'' = F cos w t from rest.
    let expected = 0.13 + 2.0 / (MASS * omega * omega) * (1.0 - (omega * time).cos());
    assert!((frame.bodies[0].position.x - expected).abs() < 1e-9);
    assert!((frame.elements[0].force.x - 2.0 * (omega * time).cos()).abs() < 1e-9);
}

#[test]
fn a_spring_on_a_driven_slide_stores_the_work_of_the_drive() {
    // A driven slide stretches a spring fixed to the world: all the drive's work is stored.
    let text = "[gravity]\nx = 0\ny = 0\nz = 0\n\
        [[body]]\nname = \"slide\"\nmass = \"1 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n\
        [[body]]\nname = \"mass\"\nmass = \"0.5 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n\
        [[joint]]\nname = \"x\"\nkind = \"prismatic\"\nchild = \"slide\"\naxis = [1, 0, 0]\n\
        drive = { law = \"constant\", position = \"100 mm\", velocity = \"50 mm/s\" }\n\
        [[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"mass\"\nstart = { position = \"0 500 0 mm\" }\n\
        [[spring]]\nname = \"s\"\nfrom = { body = \"world\" }\nto = { body = \"slide\" }\nlength = \"100 mm\"\nstiffness = \"300 N/m\"\n";
    let mut simulation = Simulation::new(&parse(text, &[]).machine).unwrap();
    let frame = frame_at(&mut simulation, 0.2);
    let stored = 0.5 * 300.0 * 0.01 * 0.01;
    assert!((frame.elastic - stored).abs() < 1e-6 * stored, "");
    let ledger = simulation.ledger().unwrap();
    assert!((ledger.drive_work / stored - 1.0).abs() < 1e-5, "{ledger:?}");
    assert!((frame.actuators[0] - 300.0 * 0.01).abs() < 1e-5, "");
}

#[test]
fn a_scene_without_elements_has_no_element_terms() {
    let mut simulation = crate::common::simulation("spcmm", &[]);
    let frame = frame_at(&mut simulation, 1e-3);
    assert!(frame.elements.is_empty());
    let ledger = simulation.ledger().unwrap();
    assert_eq!((ledger.damping_loss, ledger.external_work), (0.0, 0.0));
}

#[test]
fn a_bush_that_starts_concentric_is_stiff_from_the_first_step() {
    let bush = "[[spring]]\nname = \"s\"\nfrom = { body = \"world\", at = \"130 0 0 mm\" }\nto = { body = \"mass\" }\n\
                length = \"0 m\"\nstiffness = \"80 kN/mm\"\ndamping = \"10 kN s/m\"\n\
                [[load]]\nname = \"f\"\non = { body = \"mass\" }\nforce = \"0 8 0 N\"\n";
    let changes = [("solver.method", "radau5"), ("solver.tolerance", "1e-9")];
    let mut simulation = floating(bush, &changes);
    let frame = frame_at(&mut simulation, 0.1);
    let error = (frame.bodies[0].position - Vec3::new(0.13, 8.0 / 80e6, 0.0)).norm();
    assert!(error < 1e-10, "{error:e}");
    assert!((frame.elements[0].force + Vec3::new(0.0, 8.0, 0.0)).norm() < 1e-2);
}

#[test]
fn a_fast_load_is_resolved_even_without_degrees_of_freedom() {
    // With ideal joints the motion is prescribed by drives of half a hertz.
    let text = crate::common::scene("spcmm", &[]).source.text.to_string()
        + "\n[[load]]\nname = \"shake\"\non = { body = \"platform\" }\nforce = \"0 20 0 N\"\nfrequency = \"200 Hz\"\n";
    let scene = crate::common::parse(&text, &[("contact.clearance", "0")]);
    let mut simulation = Simulation::new(&scene.machine).unwrap();
    frame_at(&mut simulation, 0.3);
    let ledger = *simulation.ledger().unwrap();
    assert!(ledger.external_work.abs() > 1e-5, "{ledger:?}");
    assert!(ledger.relative_residual().abs() < 1e-6, "{ledger:?}");
}

#[test]
fn bad_elements_are_refused_with_their_position() {
    let text = "[[body]]\nname = \"mass\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n\
                [[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"mass\"\nstart = { position = [0, 0, 0] }\n";
    let cases = r#"
        [[spring]]; name = "s" -> spring.s.from | missing
        [[spring]]; name = "s"; from = { body = "world" }; to = { body = "world" }; length = "1 m" -> spring.s.to | same body
        [[spring]]; name = "s"; from = { body = "world" }; to = { body = "mass" }; length = "1 m"; stiffness = "-1 N/m" -> -1 N/m | allowed 0 N/m to
        [[spring]]; name = "s"; from = { body = "world" }; to = { body = "mass" }; length = "1 m"; stifness = "1 N/m" -> stifness | stiffness
        [[load]]; name = "f"; on = { body = "world" }; force = "1 0 0 N" -> load.f.on | not on the world
        [[load]]; name = "f"; on = { body = "mass" }; frequency = "2 Hz" -> load.f | does nothing: force, torque are missing
        [[load]]; name = "free"; on = { body = "mass" }; force = "1 0 0 N" -> load.free.name | already a joint or force element
        [[load]]; name = "f"; on = { body = "mass" }; axes = "bodies" -> axes | world, body
    "#;
    assert_refused(cases, |more| Scene::parse(&format!("{text}{more}"), Some("mine.toml"), &[]));
}

#[test]
fn a_one_sided_spring_releases_and_catches_the_mass() {
    // A spring that only pushes throws a mass off; it falls back as fast as it left and is in free flight in between.
    let text = "
[gravity]
z = \"-9.81 m/s^2\"

[[body]]
name = \"mass\"
mass = \"0.5 kg\"
inertia = \"1e-3 1e-3 1e-3 kg m^2\"

[[joint]]
name = \"guide\"
kind = \"prismatic\"
child = \"mass\"
axis = [0, 0, 1]
start = { position = \"60 mm\" }

[[spring]]
name = \"pad\"
from = { body = \"world\" }
to = { body = \"mass\" }
length = \"100 mm\"
stiffness = \"2 kN/m\"
side = \"push\"
";
    for (method, formulation) in THREE_VARIANTS {
        let changes = [("solver.method", method), ("solver.tolerance", "1e-9"), ("formulation", formulation)];
        let mut simulation = Simulation::new(&parse(text, &changes).machine).unwrap();
        // Where it leaves the spring: half k 0.04^2 - m g 0.04 = half m v^2.
        let speed = (2000.0 * 0.04_f64.powi(2) / 0.5 - 2.0 * 9.81 * 0.04).sqrt();
        let top = 0.1 + speed * speed / (2.0 * 9.81);
        let mut highest = 0.0_f64;
        for n in 1..=1500 {
            let frame = frame_at(&mut simulation, f64::from(n) * 1e-3);
            let height = frame.bodies[0].position.z;
            highest = highest.max(height);
            let force = frame.elements[0].force.z;
            let expected = 2000.0 * (0.1 - height).max(0.0);
            assert!((force - expected).abs() < 1e-9, "{force} {expected}");
        }
        assert!((highest - top).abs() < 1e-4, "{method}: {highest} {top}");
        let ledger = simulation.ledger().unwrap();
        assert!(ledger.relative_residual().abs() < 1e-6, "{method} {ledger:?}");
    }
    // Preloaded and damped, the energy balances although the spring goes slack.
    let damped =
        text.replace("stiffness = \"2 kN/m\"", "stiffness = \"2 kN/m\"\ndamping = \"5 N s/m\"\npreload = \"-10 N\"");
    let mut simulation = Simulation::new(&parse(&damped, &[("solver.tolerance", "1e-9")]).machine).unwrap();
    simulation.advance_to(1.0).unwrap();
    let ledger = simulation.ledger().unwrap();
    // The damper dissipates the spring's remaining energy at release, where steps are long because the mass is in free flight.
    let residual = ledger.relative_residual().abs();
    assert!(ledger.damping_loss > 0.1 && residual < 1e-3, "{residual:e} {ledger:?}");
}
