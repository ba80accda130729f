//! Reactions of the tree's joints: against closed-form solutions, and by the Newton-Euler equations of every body.

use crate::common::matrix::FORMULATIONS;
use crate::common::{parse, scene};
use jointplay_physics::machine::{JointKind, Vec3};
use jointplay_physics::simulate::{BodyMotion, Frame, Simulation};
use jointplay_scene::Scene;

/// A frame that requests reactions.
fn with_reactions() -> Frame {
    Frame { reactions: Some(Vec::new()), ..Frame::default() }
}

/// The frame at `time`, s, with reactions.
fn frame_at(simulation: &mut Simulation, time: f64) -> Frame {
    while simulation.time() < time {
        simulation.step_until(time).unwrap();
    }
    let mut frame = with_reactions();
    simulation.sample(time, &mut frame);
    frame
}

/// Force and torque of the `i`-th joint that is not free.
fn reaction(frame: &Frame, i: usize) -> [Vec3; 2] {
    frame.reactions.as_ref().expect("reactions were requested")[i]
}

const MASS: f64 = 0.7;
const GRAVITY: f64 = 9.81;

fn body(name: &str, more: &str) -> String {
    format!("[[body]]\nname = \"{name}\"\nmass = \"{MASS} kg\"\ninertia = \"2e-3 3e-3 4e-3 kg m^2\"\n{more}\n")
}

#[test]
fn the_pin_of_a_pendulum_carries_weight_and_centrifugal_force() {
    // The pin is along y; the centroid is 0.2 m from it and 0.05 m off the plane through the joint point.
    let text = format!(
        "[gravity]\nz = \"-{GRAVITY} m/s^2\"\n{}\
         [[joint]]\nname = \"pin\"\nkind = \"revolute\"\nchild = \"rod\"\naxis = [0, 1, 0]\nchild_point = \"-150 30 0 mm\"\n\
         start = {{ position = \"20 deg\" }}\n",
        body("rod", "centre = \"50 80 0 mm\"")
    );
    let (r, offset) = (0.2, 0.05);
    let inertia = 3e-3 + MASS * r * r;
    let start = 20_f64.to_radians();
    let changes = [("solver.tolerance", "1e-11")];
    let mut simulation = Simulation::new(&parse(&text, &changes).machine).unwrap();
    for time in [0.0, 0.1, 0.23, 0.4] {
        let frame = frame_at(&mut simulation, time);
        // Angle below the horizontal, positive about y.
        let angle = frame.coordinates[0][0];
        let along = Vec3::new(angle.cos(), 0.0, -angle.sin());
        let tangent = Vec3::new(-angle.sin(), 0.0, -angle.cos());
        let moment = MASS * GRAVITY * r;
        let square = 2.0 * moment * (angle.sin() - start.sin()) / inertia;
        let acceleration = moment * angle.cos() / inertia;
        let expected_force =
            MASS * (tangent * (r * acceleration) - along * (r * square)) + Vec3::new(0.0, 0.0, MASS * GRAVITY);
        let [force, torque] = reaction(&frame, 0);
        let label = format!("{time}");
        assert!((force - expected_force).norm() < 1e-6, "{label}: {force} {expected_force}");
        // The offset along the axis needs a torque; about the axis there is none.
        let expected_torque = Vec3::new(0.0, offset, 0.0).cross(&expected_force);
        assert!((torque - expected_torque).norm() < 1e-6, "{label}: {torque} {expected_torque}");
        assert!(torque.y.abs() < 1e-9, "{label}");
    }
}

#[test]
fn a_slide_carries_the_transverse_load() {
    let text = format!(
        "[gravity]\nz = \"-{GRAVITY} m/s^2\"\n{}\
         [[joint]]\nname = \"slope\"\nkind = \"prismatic\"\nchild = \"box\"\naxis = [0.8, 0, -0.6]\nchild_point = \"0 0 -40 mm\"\n\
         [[load]]\nname = \"wind\"\non = {{ body = \"box\" }}\nforce = \"0 3 0 N\"\n",
        body("box", "")
    );
    let mut simulation = Simulation::new(&parse(&text, &[]).machine).unwrap();
    for time in [0.0, 0.3] {
        let frame = frame_at(&mut simulation, time);
        let [force, torque] = reaction(&frame, 0);
        let normal = Vec3::new(0.6, 0.0, 0.8) * (MASS * GRAVITY * 0.8);
        let expected = normal - Vec3::new(0.0, 3.0, 0.0);
        assert!((force - expected).norm() < 1e-9, "{force}");
        // Nothing rotates: about the centroid force and torque cancel.
        let expected_torque = Vec3::new(0.0, 0.0, 0.04).cross(&expected);
        assert!((torque - expected_torque).norm() < 1e-9, "{torque}");
    }
}

#[test]
fn a_driven_crank_has_the_reactions_of_its_bearing_and_its_drive() {
    let text = format!(
        "[gravity]\nz = \"-{GRAVITY} m/s^2\"\n{}{}\
         [[joint]]\nname = \"crank\"\nkind = \"revolute\"\nchild = \"crank\"\naxis = [0, 1, 0]\n\
         drive = {{ law = \"constant\", velocity = \"30 rad/s\" }}\n\
         [[joint]]\nname = \"bolts\"\nkind = \"fixed\"\nparent = \"crank\"\nchild = \"weight\"\nparent_point = \"60 0 0 mm\"\n",
        body("crank", "centre = \"40 0 0 mm\""),
        body("weight", "centre = \"0 0 20 mm\"")
    );
    let mut simulation = Simulation::new(&parse(&text, &[]).machine).unwrap();
    for time in [0.0, 0.011, 0.05] {
        let frame = frame_at(&mut simulation, time);
        let turn = frame.bodies[0].rotation;
        let centres = [Vec3::new(0.04, 0.0, 0.0), Vec3::new(0.06, 0.0, 0.02)].map(|c| turn * c);
        let inertia_forces = centres.map(|c| MASS * (Vec3::new(0.0, 0.0, GRAVITY) - c * 900.0));
        let label = format!("{time}");
        // `lagrange` allows a small constraint drift.
        let bound = 1e-9;
        let [force, torque] = reaction(&frame, 0);
        assert!((force - inertia_forces[0] - inertia_forces[1]).norm() < bound * 1e2, "{label}: {force}");
        let moment = centres[0].cross(&inertia_forces[0]) + centres[1].cross(&inertia_forces[1]);
        assert!((torque - moment).norm() < bound * 1e2, "{label}: {torque} {moment}");
        assert!((torque.y - frame.actuators[0]).abs() < 1e-9, "{label}");
        let [force, torque] = reaction(&frame, 1);
        assert!((force - inertia_forces[1]).norm() < bound * 1e2, "{label}: {force}");
        let arm = turn * Vec3::new(0.0, 0.0, 0.02);
        assert!((torque - arm.cross(&inertia_forces[1])).norm() < bound * 1e2, "{label}");
    }
}

/// Residuals of the Newton-Euler equations of every body, N and N m, with all forces and torques that the frame reports.
fn residuals(scene: &Scene, frame: &Frame) -> Vec<[Vec3; 2]> {
    let centre = |b: usize| {
        let m = &frame.bodies[b];
        m.position + m.rotation * scene.machine.bodies[b].centre
    };
    let mut residuals: Vec<[Vec3; 2]> = scene
        .machine
        .bodies
        .iter()
        .zip(&frame.bodies)
        .map(|(body, m): (_, &BodyMotion)| {
            let arm = m.rotation * body.centre;
            let (w, alpha) = (m.angular_velocity, m.angular_acceleration);
            let acceleration = m.acceleration + alpha.cross(&arm) + w.cross(&w.cross(&arm));
            let inertia = m.rotation * body.inertia * m.rotation.transpose();
            [body.mass * (acceleration - scene.machine.gravity), inertia * alpha + w.cross(&(inertia * w))]
        })
        .collect();
    let mut push = |body: Option<usize>, point: Vec3, force: Vec3, torque: Vec3| {
        if let Some(b) = body {
            residuals[b][0] -= force;
            residuals[b][1] -= torque + (point - centre(b)).cross(&force);
        }
    };
    let holding = scene.machine.joints.iter().filter(|joint| joint.kind != JointKind::Free);
    for (i, joint) in holding.enumerate() {
        let [force, torque] = reaction(frame, i);
        let m = &frame.bodies[joint.child];
        let point = m.position + m.rotation * joint.child_point;
        push(Some(joint.child), point, force, torque);
        push(joint.parent, point, -force, -torque);
    }
    for (joint, report) in scene.machine.loose_joints.iter().zip(&frame.joints) {
        let force = report.normal_force + report.friction_force;
        push(joint.carried().body, report.contact_point, force, Vec3::zeros());
        push(joint.carrier().body, report.contact_point, -force, Vec3::zeros());
    }
    for (element, report) in scene.machine.elements.iter().zip(&frame.elements) {
        let torque = report.torque.unwrap_or_else(Vec3::zeros);
        match &element.points(&scene.machine)[..] {
            [only] => push(only.body, report.points[1], report.force, torque),
            [from, to] => {
                push(to.body, report.points[1], report.force, torque);
                push(from.body, report.points[1], -report.force, -torque);
            }
            _ => unreachable!("an element has one or two points"),
        }
    }
    residuals
}

/// A machine with every kind of joint and element: a driven turntable that carries an arm with a slide and a fixed tool, and a free
/// body attached to the tool by an ideal ball joint.
fn machine() -> String {
    ["table", "arm", "ram", "tool", "ball"].map(|name| body(name, "centre = \"5 -3 8 mm\"")).concat()
        + "[gravity]\nx = \"1 m/s^2\"\nz = \"-9.81 m/s^2\"\n[contact]\nclearance = 0\n\
           [[joint]]\nname = \"table\"\nkind = \"revolute\"\nchild = \"table\"\naxis = [0, 0, 1]\n\
           drive = { law = \"harmonic\", amplitude = \"1 rad\", frequency = \"1 Hz\" }\n\
           [[joint]]\nname = \"arm\"\nkind = \"revolute\"\nparent = \"table\"\nchild = \"arm\"\nparent_point = \"100 0 50 mm\"\n\
           child_point = \"-40 0 10 mm\"\naxis = [0, 1, 0.3]\nrotation = { axis = [1, 0, 1], angle = \"20 deg\" }\n\
           start = { velocity = \"3 rad/s\" }\n\
           [[joint]]\nname = \"ram\"\nkind = \"prismatic\"\nparent = \"arm\"\nchild = \"ram\"\nparent_point = \"60 0 0 mm\"\n\
           child_point = \"0 0 20 mm\"\naxis = [1, 0.2, 0]\nstart = { position = \"10 mm\" }\n\
           [[joint]]\nname = \"tool\"\nkind = \"fixed\"\nparent = \"ram\"\nchild = \"tool\"\nparent_point = \"30 0 0 mm\"\n\
           child_point = \"0 10 0 mm\"\n\
           [[joint]]\nname = \"ball\"\nkind = \"free\"\nchild = \"ball\"\nstart = { position = \"200 0 0 mm\" }\n\
           [[ball_joint]]\nname = \"S\"\nsocket = { body = \"tool\", at = \"50 0 0 mm\" }\nball = { body = \"ball\", at = \"0 0 60 mm\" }\n\
           [[spring]]\nname = \"coil\"\nfrom = { body = \"world\" }\nto = { body = \"tool\", at = \"10 0 0 mm\" }\nlength = \"150 mm\"\n\
           stiffness = \"300 N/m\"\ndamping = \"2 N s/m\"\n\
           [[joint_spring]]\nname = \"turn\"\njoint = \"arm\"\nstiffness = \"3 N m/rad\"\n\
           [[joint_spring]]\nname = \"slide\"\njoint = \"ram\"\nstiffness = \"2 kN/m\"\ndamping = \"5 N s/m\"\n\
           [[motor]]\nname = \"m\"\njoint = \"ram\"\nforce = \"4 N\"\n\
           [[bushing]]\nname = \"bush\"\nfrom = { body = \"table\", at = \"100 0 50 mm\" }\nto = { body = \"ball\" }\n\
           stiffness = \"50 60 70 N/m\"\nturning_stiffness = \"1 2 3 N m/rad\"\n\
           [[load]]\nname = \"push\"\non = { body = \"ram\", at = \"0 0 30 mm\" }\nforce = \"1 2 3 N\"\ntorque = \"0 0.1 0 N m\"\n"
}

#[test]
fn reactions_satisfy_the_newton_euler_equations_of_every_body() {
    let text = format!("start = \"ideal\"\n{}", machine());
    let mut frames = Vec::new();
    for formulation in FORMULATIONS {
        let changes = [("formulation", formulation), ("solver.tolerance", "1e-11")];
        let scene = parse(&text, &changes);
        let mut simulation = Simulation::new(&scene.machine).unwrap();
        for time in [0.0, 0.07, 0.2] {
            let frame = frame_at(&mut simulation, time);
            assert_eq!(frame.reactions.as_ref().map(Vec::len), Some(4));
            for (b, residual) in residuals(&scene, &frame).into_iter().enumerate() {
                let name = &scene.machine.bodies[b].name;
                assert!(
                    residual[0].norm() < 1e-9 && residual[1].norm() < 1e-9,
                    "{formulation} {time} {name}: {residual:?}"
                );
            }
            frames.push(frame);
        }
    }
    let (tree, lagrange) = frames.split_at(3);
    for (a, b) in tree.iter().zip(lagrange) {
        for i in 0..4 {
            for (a, b) in reaction(a, i).iter().zip(reaction(b, i)) {
                // The bound covers the drift between the two formulations.
                assert!(a.norm() > 1e-3 && (a - b).norm() < 1e-4, "{i}: {a} {b}");
            }
        }
    }
}

#[test]
fn contacts_load_the_reactions_too() {
    for name in ["slider-crank", "suspension", "delta"] {
        let changes = [("solver.method", "dopri5"), ("solver.tolerance", "1e-8")];
        let scene = scene(name, &changes);
        let mut simulation = Simulation::new(&scene.machine).unwrap();
        let mut touched = false;
        for n in 0..4 {
            simulation.advance_to(0.01 * f64::from(n)).unwrap();
            let time = simulation.time();
            let frame = frame_at(&mut simulation, time);
            touched |= frame.joints.iter().any(|joint| joint.normal_force.norm() > 1.0);
            for (b, residual) in residuals(&scene, &frame).into_iter().enumerate() {
                let body = &scene.machine.bodies[b].name;
                let size = scene.machine.bodies[b].mass * 1e3;
                assert!(residual[0].norm() < 1e-9 * size, "{name} {time} {body}: {residual:?}");
            }
        }
        assert!(touched, "{name}");
    }
}
