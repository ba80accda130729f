//! One ball and one socket: restitution of every law, friction, and contacts at the start.

use crate::common::{frame_now, parse};
use jointplay_physics::contact::{ElasticLaw, NormalLaw, undisturbed_restitution};
use jointplay_physics::machine::Vec3;
use jointplay_physics::simulate::{ContactMode, Frame, Simulation};

const MASS: f64 = 0.5;
const INERTIA: f64 = 2e-5;
const RADIUS: f64 = 0.010;
const CLEARANCE: f64 = 0.3e-3;

/// A free ball of 10 mm in a fixed socket, under `gravity` along x; position in m, velocity in m/s, spin in rad/s.
fn ball(position: Vec3, velocity: Vec3, spin: Vec3, gravity: f64, changes: &[(&str, &str)]) -> Simulation {
    let vector = |v: Vec3, unit: &str| format!("\"{:e} {:e} {:e} {unit}\"", v.x, v.y, v.z);
    let text = format!(
        r#"
name = "ball"
title = "Ball in its socket"
description = "One ball in one socket."
[gravity]
x = "{gravity:e} m/s^2"
[contact]
clearance = "0.3 mm"
friction = 0.2
restitution = 0.9
youngs_modulus = "206 GPa"
poisson_ratio = 0.3
ball_radius = "10 mm"
[solver]
tolerance = 1e-11
[[body]]
name = "ball"
mass = "{MASS} kg"
inertia = "{INERTIA:e} {INERTIA:e} {INERTIA:e} kg m^2"
[[joint]]
name = "free"
kind = "free"
child = "ball"
[joint.start]
position = {}
velocity = {}
angular_velocity = {}
[[ball_joint]]
name = "S"
socket = {{ body = "world", at = [0, 0, 0] }}
ball = {{ body = "ball", at = [0, 0, 0] }}
opening = [0, 0, 1]
"#,
        vector(position, "m"),
        vector(velocity, "m/s"),
        vector(spin, "rad/s"),
    );
    Simulation::new(&parse(&text, changes).machine).unwrap()
}

/// Restitution of m v dv = -F(delta) (1 + chi v / v0) d delta by quadrature of both halves of the impact:
/// the integral of u / (1 + chi u) over 0..1 equals that of u / (1 - chi u) over 0..e.
fn restitution_by_quadrature(chi: f64) -> f64 {
    let simpson = |end: f64, f: &dyn Fn(f64) -> f64| {
        let n = 2000;
        let h = end / f64::from(n);
        let weight = |i: i32| match i {
            0 => 1.0,
            i if i == n => 1.0,
            i if i % 2 == 1 => 4.0,
            _ => 2.0,
        };
        (0..=n).map(|i| weight(i) * f(f64::from(i) * h)).sum::<f64>() * h / 3.0
    };
    let compression = simpson(1.0, &|u| u / (1.0 + chi * u));
    let (mut low, mut high) = (0.0, 1.0_f64.min(0.999 / chi));
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if simpson(middle, &|u| u / (1.0 - chi * u)) < compression {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Restitution of the first impact of a ball that moves along x.
fn rebound(speed: f64, changes: &[(&str, &str)]) -> (f64, Simulation) {
    let mut simulation = ball(Vec3::zeros(), Vec3::x() * speed, Vec3::zeros(), 0.0, changes);
    while simulation.statistics().joints[0].last_separation.is_none() {
        simulation.step().unwrap();
        assert!(simulation.time() < 1.0);
    }
    let frame = frame_now(&mut simulation);
    assert_eq!(frame.joints[0].state, ContactMode::Free);
    (-frame.bodies[0].velocity.x / speed, simulation)
}

#[test]
fn head_on_impacts_give_the_restitution_of_their_law() {
    let mut worst = 0.0_f64;
    for law in NormalLaw::ALL {
        let name = law.word();
        for ce in ["0", "0.3", "0.6", "0.9", "1"] {
            let number: f64 = ce.parse().unwrap();
            let chi = law.damping_factor(number);
            if !chi.is_finite() {
                continue;
            }
            let expected = undisturbed_restitution(chi);
            if chi > 0.0 {
                let quadrature = restitution_by_quadrature(chi);
                assert!((quadrature - expected).abs() < 1e-5, "{name} {ce}: {quadrature}");
            }
            let changes = [("contact.normal_law", name), ("contact.restitution", ce)];
            for speed in [0.02, 0.5] {
                let (actual, _) = rebound(speed, &changes);
                worst = worst.max((actual - expected).abs());
                assert!((actual - expected).abs() < 1e-7, "{name}, {ce}, {speed} m/s: {actual} against {expected}");
            }
        }
    }
    println!("restitution off by at most {worst:.1e}");
}

#[test]
fn elastic_impacts_have_the_peak_force_of_hertz() {
    let speed = 0.1;
    let (_, simulation) = rebound(speed, &[("contact.normal_law", "hertz")]);
    let contact = simulation.machine().contact;
    let k = ElasticLaw::of_joint(&contact, CLEARANCE).stiffness;
    // m v^2 / 2 = 2/5 K delta^2.5.
    let deepest = (1.25 * MASS * speed * speed / k).powf(0.4);
    let expected = k * deepest.powf(1.5);
    let peak = simulation.statistics().joints[0].peak_normal;
    println!("peak {peak:.6} N, expected {expected:.6} N");
    assert!((peak / expected - 1.0).abs() < 1e-4, "{peak} {expected}");
}

#[test]
fn slow_impacts_use_the_speed_floor_and_rebound_higher() {
    let mut simulation = ball(Vec3::zeros(), Vec3::x() * 4e-4, Vec3::zeros(), 0.0, &[]);
    while simulation.statistics().joints[0].impacts == 0 {
        simulation.step().unwrap();
    }
    let contact = simulation.contact_states(0)[0];
    assert!(contact.active && contact.below_speed_floor);
    assert_eq!(contact.approach_speed, 1e-3);
    let (slow, _) = rebound(4e-4, &[]);
    let (fast, _) = rebound(0.1, &[]);
    assert!(slow > fast + 0.01 && slow < 1.0, "{slow} {fast}");
    let mut above = ball(Vec3::zeros(), Vec3::x() * 0.1, Vec3::zeros(), 0.0, &[]);
    while above.statistics().joints[0].impacts == 0 {
        above.step().unwrap();
    }
    let contact = above.contact_states(0)[0];
    assert!(!contact.below_speed_floor);
    assert!((contact.approach_speed - 0.1).abs() < 1e-12, "{contact:?}");
}

/// A ball pressed against the wall at +x by its weight, with the given tangential velocity and spin.
fn pressed(velocity: Vec3, spin: Vec3, changes: &[(&str, &str)]) -> (Simulation, Frame) {
    let parameters = jointplay_physics::contact::Parameters::default();
    let load = MASS * 9.81;
    let depth = ElasticLaw::of_joint(&parameters, CLEARANCE).depth(load);
    let position = Vec3::x() * (CLEARANCE + depth);
    let mut simulation = ball(position, velocity, spin, 9.81, changes);
    let frame = frame_now(&mut simulation);
    // Nothing moves along the normal, so the elastic force alone carries the weight.
    let normal = frame.joints[0].normal_force;
    assert!((normal + Vec3::x() * load).norm() < 1e-8 * load, "{normal}");
    (simulation, frame)
}

#[test]
fn contacts_at_the_start_have_the_floor_as_approach_speed() {
    let (simulation, frame) = pressed(Vec3::zeros(), Vec3::zeros(), &[]);
    let contact = simulation.contact_states(0)[0];
    assert!(contact.active && contact.below_speed_floor);
    assert_eq!(contact.approach_speed, 1e-3);
    assert_eq!(simulation.statistics().joints[0].impacts, 1);
    assert_eq!(frame.joints[0].state, ContactMode::Creep);
    assert_eq!(frame.joints[0].friction_force, Vec3::zeros());
    assert!(frame.bodies[0].acceleration.norm() < 1e-6);
}

#[test]
fn friction_opposes_the_slip_with_its_share_of_the_normal_force() {
    let load = MASS * 9.81;
    // (slip speed, fraction of cf): full above v_theta = 1e-4 m/s, linear above v_a = 1e-6 m/s, none below.
    for (speed, fraction) in [(0.05, 1.0), (2e-4, 1.0), (0.4e-4, (0.4e-4 - 1e-6) / (1e-4 - 1e-6)), (0.9e-6, 0.0)] {
        for reading in ["centres", "surface"] {
            let slip = Vec3::new(0.0, 0.6, -0.8) * speed;
            let changes = [("contact.friction_velocity", reading)];
            let (_, frame) = pressed(slip, Vec3::zeros(), &changes);
            let joint = &frame.joints[0];
            let expected = slip * (-0.2 * fraction * load / speed);
            let error = (joint.friction_force - expected).norm();
            assert!(error < 1e-8 * load, "{reading} {speed}: {}", joint.friction_force);
            assert!((joint.slip_speed - speed).abs() < 1e-12);
            let state = if speed < 1e-4 { ContactMode::Creep } else { ContactMode::Slip };
            assert_eq!(joint.state, state);
            // Newton-Euler equations about the centroid, with the force at r n.
            let body = &frame.bodies[0];
            let arm = Vec3::x() * RADIUS;
            let turn = arm.cross(&joint.friction_force) / INERTIA;
            assert!((body.acceleration - joint.friction_force / MASS).norm() < 1e-6);
            assert!((body.angular_acceleration - turn).norm() < 1e-6 * (1.0 + turn.norm()));
        }
    }
}

#[test]
fn spin_causes_friction_with_surface_velocities_and_none_with_centre_velocities() {
    let spin = Vec3::z() * 5.0;
    let surface_speed = spin.cross(&(Vec3::x() * RADIUS));
    let friction = |velocity: Vec3, reading: &str| {
        let changes = [("contact.friction_velocity", reading)];
        pressed(velocity, spin, &changes).1.joints[0].friction_force
    };
    let full = 0.2 * MASS * 9.81;
    // Spinning in place.
    assert_eq!(friction(Vec3::zeros(), "centres"), Vec3::zeros());
    let on_spot = friction(Vec3::zeros(), "surface");
    assert!((on_spot + surface_speed.normalize() * full).norm() < 1e-8);
    // Rolling: the contact points have no relative velocity, the centres have.
    let rolling = -surface_speed;
    assert!(friction(rolling, "surface").norm() < 1e-12);
    let with_centres = friction(rolling, "centres");
    assert!((with_centres + rolling.normalize() * full).norm() < 1e-8);
}

#[test]
fn friction_slows_a_spinning_ball_until_it_rolls() {
    let (mut simulation, frame) = pressed(Vec3::zeros(), Vec3::z() * 5.0, &[]);
    let start = frame.kinetic;
    let mut energy = frame.kinetic + frame.potential;
    let first = energy;
    while simulation.time() < 0.02 {
        simulation.step().unwrap();
        let frame = frame_now(&mut simulation);
        let now = frame.kinetic + frame.potential;
        assert!(now < energy + 1e-12, "{}: {now} after {energy}", frame.time);
        energy = now;
    }
    println!("friction took {:.3e} J of {start:.3e} J", first - energy);
    assert!(first - energy > 0.01 * start);
}
