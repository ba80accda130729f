//! Joints with two degrees of freedom, cylindrical and universal: closed forms, conservation laws and both formulations.

use crate::common::matrix::in_tree;
use crate::common::{frame_now, slope};
use crate::elements::frame_at;
use crate::joint_elements::start_simulation;
use jointplay_physics::machine::{Quat, Vec3};
use jointplay_physics::simulate::Frame;

pub const G: f64 = 9.81;

fn rotation_about(axis: Vec3, angle: f64) -> Quat {
    Quat::from_axis_angle(&nalgebra::Unit::new_normalize(axis), angle)
}

/// Absolute difference of two angles modulo a turn, by its chord.
pub fn angle_difference(a: f64, b: f64) -> f64 {
    (0.5 * (a - b)).sin().abs() * 2.0
}

#[test]
fn a_cylindrical_joint_slides_and_turns_independently() {
    let text = "[gravity]\nz = \"-9.81 m/s^2\"\n\
                [[body]]\nname = \"ring\"\nmass = \"0.5 kg\"\ninertia = \"2e-4 2e-4 3e-4 kg m^2\"\n\
                [[joint]]\nname = \"c\"\nkind = \"cylindrical\"\nchild = \"ring\"\naxis = [0, 0, 2]\n\
                start = { position = \"20 mm\", angle = \"30 deg\", velocity = \"0.4 m/s\", angular_velocity = \"7 rad/s\" }\n";
    for variant in in_tree() {
        let bound = variant.bound();
        let mut simulation = start_simulation(text, &variant.close());
        let t = 0.1;
        let frame = frame_at(&mut simulation, t);
        let z = 0.02 + 0.4 * t - 0.5 * G * t * t;
        let angle = 30_f64.to_radians() + 7.0 * t;
        let body = &frame.bodies[0];
        let error = (body.position - Vec3::new(0.0, 0.0, z)).norm();
        assert!(error < bound, "{variant}: {error:e}");
        let body_angle = body.rotation[(1, 0)].atan2(body.rotation[(0, 0)]);
        assert!(angle_difference(body_angle, angle) < bound, "{variant}: {body_angle} {angle}");
        let [[slide_position, speed], [joint_angle, spin]] = frame.coordinates[..] else {
            panic!("{variant}: {:?}", frame.coordinates);
        };
        assert!((slide_position - z).abs() < bound && (speed - 0.4 + G * t).abs() < 20.0 * bound);
        assert!(angle_difference(joint_angle, angle) < bound && (spin - 7.0).abs() < bound);
    }
}

/// Masses, centroids and inertias of a free body, a ring on a cylindrical joint of it, and a rod on a universal joint of the ring.
const MASS: [f64; 3] = [1.2, 0.5, 0.3];
const CENTRE: [[f64; 3]; 3] = [[0.01, -0.02, 0.005], [0.03, 0.01, -0.02], [-0.02, 0.0, 0.06]];
const INERTIA: [[f64; 3]; 3] = [[2e-3, 3e-3, 4e-3], [5e-4, 8e-4, 6e-4], [3e-4, 4e-4, 2e-4]];

pub fn train(gravity: f64) -> String {
    let body = |i: usize, name: &str| {
        let ([x, y, z], [xx, yy, zz]) = (CENTRE[i], INERTIA[i]);
        format!(
            "[[body]]\nname = \"{name}\"\nmass = \"{} kg\"\ncentre = \"{x} {y} {z} m\"\ninertia = \"{xx} {yy} {zz} kg m^2\"\n",
            MASS[i]
        )
    };
    // The universal joint's second axis, (0, 0, 1) of the ring, in the rod's frame.
    let rest = rotation_about(Vec3::new(1.0, 2.0, -1.0), 0.6);
    let second = rest.inverse() * Vec3::z();
    format!(
        "[gravity]\nx = 0\ny = 0\nz = \"{gravity} m/s^2\"\n{}{}{}\
         [[joint]]\nname = \"base\"\nkind = \"free\"\nchild = \"base\"\n\
         start = {{ position = [0, 0, 0], velocity = \"0.1 -0.3 0.2 m/s\", angular_velocity = \"1 4 -2 rad/s\" }}\n\
         [[joint]]\nname = \"c\"\nkind = \"cylindrical\"\nparent = \"base\"\nchild = \"ring\"\naxis = [1, 1, 0]\n\
         parent_point = \"50 0 20 mm\"\nchild_point = \"-10 0 30 mm\"\nrotation = {{ axis = [0, 1, 1], angle = \"35 deg\" }}\n\
         start = {{ position = \"5 mm\", angle = \"20 deg\", velocity = \"0.2 m/s\", angular_velocity = \"6 rad/s\" }}\n\
         [[joint]]\nname = \"u\"\nkind = \"universal\"\nparent = \"ring\"\nchild = \"rod\"\naxis = [1, 0, 0]\n\
         child_axis = [{:e}, {:e}, {:e}]\nparent_point = \"40 0 0 mm\"\nchild_point = \"0 10 -50 mm\"\n\
         rotation = {{ axis = [1, 2, -1], angle = \"0.6 rad\" }}\n\
         start = {{ angle = \"25 deg\", child_angle = \"-40 deg\", angular_velocity = \"3 rad/s\", child_angular_velocity = \"-5 rad/s\" }}\n",
        body(0, "base"),
        body(1, "ring"),
        body(2, "rod"),
        second.x,
        second.y,
        second.z
    )
}

/// Momentum, and angular momentum about the origin.
fn momenta(frame: &Frame) -> [Vec3; 2] {
    let mut sum = [Vec3::zeros(); 2];
    for (i, body) in frame.bodies.iter().enumerate() {
        let arm = body.rotation * Vec3::from(CENTRE[i]);
        let momentum = MASS[i] * (body.velocity + body.angular_velocity.cross(&arm));
        let spin = Vec3::from(INERTIA[i]).component_mul(&body.rotation.tr_mul(&body.angular_velocity));
        sum[0] += momentum;
        sum[1] += (body.position + arm).cross(&momentum) + body.rotation * spin;
    }
    sum
}

#[test]
fn a_chain_of_both_joints_starts_at_its_coordinates() {
    let mut simulation = start_simulation(&train(0.0), &[]);
    let summary = simulation.mechanism().summary();
    assert_eq!((summary.bodies, summary.degrees_of_freedom), (3, 10));
    let frame = frame_now(&mut simulation);
    let [base, ring, rod] = &frame.bodies[..] else {
        panic!("three bodies");
    };
    let along = Vec3::new(1.0, 1.0, 0.0).normalize();
    let ring_turn =
        rotation_about(along, 20_f64.to_radians()) * rotation_about(Vec3::new(0.0, 1.0, 1.0), 35_f64.to_radians());
    let of_ring = base.rotation * ring_turn.to_rotation_matrix().into_inner();
    assert!((ring.rotation - of_ring).amax() < 1e-14);
    let joint = base.position + base.rotation * (Vec3::new(0.05, 0.0, 0.02) + along * 5e-3);
    let error = joint - (ring.position + ring.rotation * Vec3::new(-0.01, 0.0, 0.03));
    assert!(error.norm() < 1e-15, "{error}");
    let spin = base.angular_velocity + base.rotation * along * 6.0;
    assert!((ring.angular_velocity - spin).norm() < 1e-13);
    let rest = rotation_about(Vec3::new(1.0, 2.0, -1.0), 0.6);
    let second = rest.inverse() * Vec3::z();
    let rod_turn = rotation_about(Vec3::x(), 25_f64.to_radians()) * rest * rotation_about(second, -40_f64.to_radians());
    let of_rod = ring.rotation * rod_turn.to_rotation_matrix().into_inner();
    assert!((rod.rotation - of_rod).amax() < 1e-13);
    let spin = ring.angular_velocity + ring.rotation * Vec3::x() * 3.0 - rod.rotation * second * 5.0;
    assert!((rod.angular_velocity - spin).norm() < 1e-13);
    let expected = [[5e-3, 0.2], [20_f64.to_radians(), 6.0], [25_f64.to_radians(), 3.0], [-40_f64.to_radians(), -5.0]];
    for (own, expected) in frame.coordinates.iter().zip(expected) {
        for (own, expected) in own.iter().zip(expected) {
            assert!((own - expected).abs() < 1e-13, "{own} {expected}");
        }
    }
    assert_eq!(frame.coordinates.len(), 4);
}

#[test]
fn a_free_chain_conserves_momenta_and_energy() {
    let mut simulation = start_simulation(&train(0.0), &[("solver.tolerance", "1e-11")]);
    let before = frame_now(&mut simulation);
    let after = frame_at(&mut simulation, 0.4);
    for (a, b) in momenta(&before).iter().zip(momenta(&after)) {
        assert!((a - b).norm() < 1e-8 * a.norm(), "{a} {b}");
    }
    let lost = (after.kinetic / before.kinetic - 1.0).abs();
    assert!(lost < 1e-8, "{lost:e}");
}

#[test]
fn the_error_falls_with_the_order_of_the_method() {
    let end = |method: &str, step: &str, tolerance: &str| {
        let changes = [("solver.method", method), ("solver.step", step), ("solver.tolerance", tolerance)];
        let mut simulation = start_simulation(&train(-G), &changes);
        frame_at(&mut simulation, 0.2)
    };
    let exact = end("dopri5", "10 us", "1e-13");
    let points = [8.0, 4.0, 2.0].map(|ms| {
        let frame = end("rk4", &format!("{ms} ms"), "1e-6");
        let pairs = frame.bodies.iter().zip(&exact.bodies);
        let errors = pairs.map(|(a, b)| (a.position - b.position).norm());
        (ms, errors.fold(0.0, f64::max))
    });
    let order = slope(&points);
    assert!((3.7..4.5).contains(&order), "{order}: {points:?}");
}

#[test]
fn products_of_inertia_have_the_sign_of_their_definition() {
    // 0.5 kg at each of (p, q) = (0.1, 0.1) m and (-0.1, -0.1) m in a plane of the axes, and 1e-3 kg m^2 about every axis: the
    // moment about the line through both is the latter alone, about the line across them it has 2 m (0.1 sqrt 2)^2 more.
    for (i, j, products) in [(0, 1, "0.01 0 0"), (0, 2, "0 0.01 0"), (1, 2, "0 0 0.01")] {
        let moments = [0, 1, 2].map(|axis| if axis == i || axis == j { "0.011" } else { "0.021" }).join(" ");
        let text = format!(
            "[[body]]\nname = \"b\"\nmass = \"1 kg\"\ninertia = \"{moments} kg m^2\"\nproducts = \"{products} kg m^2\"\n\
             [[joint]]\nname = \"j\"\nkind = \"free\"\nchild = \"b\"\nstart = {{ position = \"0 0 0 mm\" }}\n"
        );
        let inertia = crate::common::parse(&text, &[]).machine.bodies[0].inertia;
        let [mut along, mut across] = [Vec3::zeros(); 2];
        (along[i], along[j], across[i], across[j]) = (0.5_f64.sqrt(), 0.5_f64.sqrt(), 0.5_f64.sqrt(), -0.5_f64.sqrt());
        // Rounding.
        assert!((along.dot(&(inertia * along)) - 1e-3).abs() < 1e-15, "{products}: {inertia}");
        assert!((across.dot(&(inertia * across)) - 0.021).abs() < 1e-15, "{products}: {inertia}");
    }
}
