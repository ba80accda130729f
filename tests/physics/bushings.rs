//! Bushings against closed-form solutions: deflections, natural frequencies, momentum and energy.

use crate::common::matrix::for_every;
use crate::common::{assert_refused, replaced};
use crate::elements::frame_at;
use crate::joint_elements::{momenta, start_simulation};
use jointplay_physics::machine::{Quat, Vec3};
use jointplay_scene::Scene;

/// A free body of 0.5 kg with the pose `start`, and a bushing from the world at (0.1, 0.2, 0.3) m to its centroid; `more` has further keys.
fn bushing_scene(start: &str, more: &str) -> String {
    format!(
        "[gravity]\nx = 0\ny = 0\nz = 0\n\
         [[body]]\nname = \"mass\"\nmass = \"0.5 kg\"\ninertia = \"2e-4 3e-4 4e-4 kg m^2\"\n\
         [[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"mass\"\nstart = {{ {start} }}\n\
         [[bushing]]\nname = \"b\"\nfrom = {{ body = \"world\", at = \"100 200 300 mm\" }}\nto = {{ body = \"mass\" }}\n\
         stiffness = \"200 300 500 N/m\"\nturning_stiffness = \"0.1 0.2 0.3 N m/rad\"\n{more}"
    )
}

const STIFFNESS: [f64; 3] = [200.0, 300.0, 500.0];
const TURNING_STIFFNESS: [f64; 3] = [0.1, 0.2, 0.3];
const INERTIA: [f64; 3] = [2e-4, 3e-4, 4e-4];

/// Rotation vector of a rotation matrix.
fn rotation_vector(rotation: &nalgebra::Matrix3<f64>) -> Vec3 {
    Quat::from_matrix(rotation).scaled_axis()
}

#[test]
fn a_bushing_has_the_six_natural_frequencies_of_its_stiffnesses() {
    for_every(0..3, |axis, variant| {
        let (bound, label) = (variant.bound(), format!("{variant}, axis {axis}"));
        let mut position = [100.0, 200.0, 300.0];
        position[axis] += 20.0;
        let start = format!("position = \"{} {} {} mm\"", position[0], position[1], position[2]);
        let mut simulation = start_simulation(&bushing_scene(&start, ""), &variant.close());
        let t = 0.15;
        let frame = frame_at(&mut simulation, t);
        let omega = (STIFFNESS[axis] / 0.5).sqrt();
        let displacement = 0.02 * (omega * t).cos();
        let expected = Vec3::new(0.1, 0.2, 0.3) + Vec3::ith(axis, displacement);
        let error = (frame.bodies[0].position - expected).norm();
        assert!(error < 2.0 * bound, "{label}: {error:e}");
        let force = frame.elements[0].force[axis] + STIFFNESS[axis] * displacement;
        assert!(force.abs() < 2e3 * bound, "{label}: {force:e}");

        // Rotation about one axis is linear up to any angle.
        let mut about = [0, 0, 0];
        about[axis] = 1;
        let start = format!("position = \"100 200 300 mm\", rotation = {{ axis = {about:?}, angle = \"1 rad\" }}");
        let mut simulation = start_simulation(&bushing_scene(&start, ""), &variant.close());
        let frame = frame_at(&mut simulation, t);
        let omega = (TURNING_STIFFNESS[axis] / INERTIA[axis]).sqrt();
        let angle = (omega * t).cos();
        let error = (rotation_vector(&frame.bodies[0].rotation) - Vec3::ith(axis, angle)).norm();
        assert!(error < 200.0 * bound, "{label}: {error:e}");
        let residual = simulation.ledger().unwrap().relative_residual();
        assert!(residual.abs() < 1e-3, "{label}: {residual:e}");
    });
}

#[test]
fn a_loaded_bushing_deflects_along_and_about_its_own_axes() {
    // Its axes are rotated by 30 degrees about z; the body's rest orientation is 20 degrees about x.
    let (sin, cos) = 30_f64.to_radians().sin_cos();
    let axes = nalgebra::Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
    let rest = Quat::from_axis_angle(&Vec3::x_axis(), 20_f64.to_radians());
    let bushing = "damping = \"10 10 10 N s/m\"\nturning_damping = \"5e-3 5e-3 5e-3 N m s/rad\"\n\
        axes = { axis = [0, 0, 1], angle = \"30 deg\" }\nrotation = { axis = [1, 0, 0], angle = \"20 deg\" }\n";
    let start = "position = \"100 200 300 mm\", rotation = { axis = [1, 0, 0], angle = \"20 deg\" }";
    for method in ["radau5", "dopri5"] {
        for axis in 0..3 {
            let direction = axes.column(axis).into_owned();
            let list = |size: f64, unit: &str| {
                let v = direction * size;
                format!("\"{:e} {:e} {:e} {unit}\"", v.x, v.y, v.z)
            };
            let load = format!(
                "[[load]]\nname = \"f\"\non = {{ body = \"mass\" }}\nforce = {}\ntorque = {}\n",
                list(4.0, "N"),
                list(0.05, "N m")
            );
            let changes = [("solver.method", method), ("solver.tolerance", "1e-8")];
            let text = bushing_scene(start, bushing) + &load;
            let mut simulation = start_simulation(&text, &changes);
            let frame = frame_at(&mut simulation, 3.0);
            let label = format!("{method} {axis}");
            let moved = frame.bodies[0].position - Vec3::new(0.1, 0.2, 0.3);
            let expected = direction * (4.0 / STIFFNESS[axis]);
            assert!((moved - expected).norm() < 1e-7, "{label}: {moved} {expected}");
            let turn = rotation_vector(&(frame.bodies[0].rotation * rest.inverse().to_rotation_matrix()));
            let expected = direction * (0.05 / TURNING_STIFFNESS[axis]);
            assert!((turn - expected).norm() < 1e-6, "{label}: {turn} {expected}");
            // The load is the first element.
            let report = &frame.elements[1];
            let error = (report.force + direction * 4.0).norm();
            assert!(error < 1e-3, "{label}: {error:e}");
            assert!((report.torque.unwrap() + direction * 0.05).norm() < 1e-5, "{label}: {report:?}");
        }
    }
}

#[test]
fn a_tumbling_pair_on_a_soft_bushing_conserves_momentum_and_energy() {
    // So soft that the relative rotations are large.
    let pair = "[gravity]\nx = 0\ny = 0\nz = 0\n\
        [[body]]\nname = \"one\"\nmass = \"0.5 kg\"\ninertia = \"2e-4 3e-4 4e-4 kg m^2\"\n\
        [[body]]\nname = \"two\"\nmass = \"0.3 kg\"\ninertia = \"1e-4 2e-4 1.5e-4 kg m^2\"\n\
        [[joint]]\nname = \"a\"\nkind = \"free\"\nchild = \"one\"\n\
        start = { position = [0, 0, 0], velocity = \"0.1 0 0.2 m/s\", angular_velocity = \"4 -3 8 rad/s\" }\n\
        [[joint]]\nname = \"b\"\nkind = \"free\"\nchild = \"two\"\n\
        start = { position = \"100 10 5 mm\", velocity = \"-0.2 0.1 0 m/s\", angular_velocity = \"-9 2 5 rad/s\", \
        rotation = { axis = [1, 1, 0], angle = \"25 deg\" } }\n\
        [[bushing]]\nname = \"b1\"\nfrom = { body = \"one\", at = \"50 0 0 mm\" }\nto = { body = \"two\", at = \"-40 10 0 mm\" }\n\
        axes = { axis = [1, 2, 0], angle = \"40 deg\" }\nrotation = { axis = [0, 1, 0], angle = \"15 deg\" }\n\
        stiffness = \"300 100 700 N/m\"\nturning_stiffness = \"0.05 0.03 0.1 N m/rad\"\n";
    let damped = "damping = \"0.5 0.2 1 N s/m\"\nturning_damping = \"1e-3 5e-4 2e-3 N m s/rad\"\n";
    for more in ["", damped] {
        let mut ends = Vec::new();
        let variants = [
            ("dopri5", "tree"),
            ("radau5", "tree"),
            ("radau5", "lagrange"),
            ("automatic", "tree"),
            ("dopri5", "lagrange"),
        ];
        // Damping adds no difference between the variants: two are enough with it.
        for (method, formulation) in variants.into_iter().skip(if more.is_empty() { 0 } else { 3 }) {
            let changes = [("solver.method", method), ("solver.tolerance", "1e-10"), ("formulation", formulation)];
            let mut simulation = start_simulation(&format!("{pair}{more}"), &changes);
            let machine = simulation.machine().clone();
            let before = frame_at(&mut simulation, 0.0);
            let mut furthest: f64 = 0.0;
            for sample in 1..=20 {
                let frame = frame_at(&mut simulation, 0.05 * f64::from(sample));
                let relative = frame.bodies[0].rotation.transpose() * frame.bodies[1].rotation;
                furthest = furthest.max(rotation_vector(&relative).norm());
            }
            assert!(furthest > 0.7 && furthest < 3.0, "{furthest}");
            let frame = frame_at(&mut simulation, 1.0);
            let label = format!("{method} {formulation} {}", more.len());
            for (then, now) in momenta(&before, &machine).iter().zip(&momenta(&frame, &machine)) {
                let error = (now - then).norm() / then.norm();
                assert!(error < 1e-8, "{label}: {error:e}");
            }
            let ledger = simulation.ledger().unwrap();
            assert!(ledger.relative_residual().abs() < 1e-6, "{label}: {ledger:?}");
            if more.is_empty() {
                let error = (frame.kinetic + frame.elastic) / (before.kinetic + before.elastic) - 1.0;
                assert!(error.abs() < 1e-8, "{label}: {error:e}");
            } else {
                assert!(ledger.damping_loss > 1e-3, "{label}: {ledger:?}");
            }
            ends.push(frame.bodies[1].position);
        }
        for end in &ends[1..] {
            assert!((end - ends[0]).norm() < 1e-6, "{end} {}", ends[0]);
        }
    }
}

#[test]
fn a_body_on_a_bushing_is_not_in_free_flight() {
    // Bodies without contact are excluded from the steps, unless a force element acts on them.
    let text = jointplay_scene::built_in_text("chain").unwrap();
    let bushing = "[[bushing]]\nname = \"b\"\nfrom = { body = \"world\", at = \"0 0 0 mm\" }\nto = { body = \"link3\" }\n\
                   stiffness = \"0 2 0 N/m\"\nrotation = { axis = [1, 0, 0], angle = \"0 deg\" }\n\
                   turning_stiffness = \"0 0 0.4 N m/rad\"\n";
    let scene = Scene::parse(&format!("{text}\n{bushing}"), None, &[]).unwrap();
    let mut simulation = jointplay_physics::simulate::Simulation::new(&scene.machine).unwrap();
    frame_at(&mut simulation, 0.05);
    let residual = simulation.ledger().unwrap().relative_residual();
    assert!(residual.abs() < 1e-4, "{residual:e}");
}

#[test]
fn invalid_bushings_are_refused_with_their_position() {
    let cases = r#"
        200 300 500 N/m => 200 -300 500 N/m -> bushing.b.stiffness | allowed 0 N/m to
        0.3 N m/rad => 0.3 N/m -> wrong unit `N/m` | units of turning stiffness
        stiffness = "200 300 500 N/m"; turning_stiffness = "0.1 0.2 0.3 N m/rad" => -> does nothing: stiffness, damping, turning_stiffness | are 0
        to = { body = "mass" } => to = { body = "mass" }; axes = { axis = [0, 0, 1] } -> bushing.b.axes.angle | missing
        body = "mass" }; stiff => body = "world" }; stiff -> bushing.b.to | same body
    "#;
    assert_refused(cases, |change| {
        let (from, to) = change.split_once(" =>").expect(change);
        Scene::parse(
            &replaced(&bushing_scene("position = [0, 0, 0]", ""), from, to.trim_start()),
            Some("mine.toml"),
            &[],
        )
    });
}

/// Three bodies around the z axis, each 20 mm outside a bushing to the world that is stiffest in the radial direction.
const RING: &str = "[gravity]\nx = 0\ny = 0\nz = 0\n\
    [[pattern]]\nname = \"ring\"\ncount = 3\nabout = { axis = [0, 0, 1] }\n\
    [[pattern.body]]\nname = \"mass\"\nmass = \"0.5 kg\"\ninertia = \"2e-4 3e-4 4e-4 kg m^2\"\n\
    [[pattern.joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"mass\"\nstart = { position = \"120 0 0 mm\" }\n\
    [[pattern.bushing]]\nname = \"b\"\nfrom = { body = \"world\", at = \"100 0 0 mm\" }\nto = { body = \"mass\" }\n\
    stiffness = \"500 300 200 N/m\"\nturning_stiffness = \"1 2 3 N m/rad\"\n";

#[test]
fn bushings_of_a_pattern_rotate_with_its_instances() {
    // The axes rotate with the instances, whichever end is the world.
    let backwards = RING.replace(
        "from = { body = \"world\", at = \"100 0 0 mm\" }\nto = { body = \"mass\" }",
        "from = { body = \"mass\" }\nto = { body = \"world\", at = \"100 0 0 mm\" }",
    );
    assert_ne!(backwards, RING);
    let out = 0.1 + 0.02 * ((500.0_f64 / 0.5).sqrt() * 0.1).cos();
    for text in [RING, &backwards] {
        let mut simulation = start_simulation(text, &[("solver.tolerance", "1e-10")]);
        let frame = frame_at(&mut simulation, 0.1);
        for (copy, body) in frame.bodies.iter().enumerate() {
            let angle = std::f64::consts::TAU / 3.0 * copy as f64;
            let expected = Vec3::new(angle.cos(), angle.sin(), 0.0) * out;
            assert!((body.position - expected).norm() < 1e-9, "{copy}: {}", body.position);
            let torque = frame.elements[copy].torque.expect("a torque").norm();
            assert!(torque < 1e-12, "{copy}: {torque:e}");
        }
    }
}
