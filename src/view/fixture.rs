//! Hand-built scenes and frames for tests of view and render: nothing here is simulated.

use std::sync::Arc;

use crate::machine::{Attachment, Body, Geometry, LooseJoint, Machine, Mat3, Output, Quat, Role, Shape, Vec3};
use crate::scene::{MAX_PLOTS, Scene, SignedAxis, ViewSettings};
use crate::simulate::{BodyMotion, ContactMode, Frame, JointReport, Peak};

const BALL: f64 = 0.010;
const CLEARANCE: f64 = 0.3e-3;

fn shape(role: Role, geometry: Geometry) -> Shape {
    Shape { geometry, role: Some(role), colour: None }
}

fn bar(role: Role, from: Vec3, to: Vec3, radius: f64) -> Shape {
    shape(role, Geometry::Capsule { from, to, radius })
}

fn body(name: &str, shapes: Vec<Shape>) -> Body {
    Body {
        name: name.to_owned(),
        mass: 0.384,
        centre: Vec3::zeros(),
        inertia: Mat3::identity() * 1e-3,
        shapes,
        density: None,
    }
}

fn scene(
    name: &str,
    down: SignedAxis,
    bodies: Vec<Body>,
    loose_joints: Vec<LooseJoint>,
    fixed_shapes: Vec<Shape>,
) -> Scene {
    let mut scene = Scene::load("pendulum", &[]).expect("a built-in scene");
    Arc::make_mut(&mut scene.source).name = name.to_owned();
    scene.view = ViewSettings { down, floor: None, isometric: None, time_scale: None, plots: [None; MAX_PLOTS] };
    *scene.machine_mut() = Machine {
        gravity: down.unit() * 9.81,
        output: Output { body: 0, probe: None },
        bodies,
        joints: Vec::new(),
        loose_joints,
        fixed_shapes,
        ..Machine::clone(&scene.machine)
    };
    scene
}

fn joint(name: &str, socket: Attachment, ball: Attachment, opening: Vec3) -> LooseJoint {
    LooseJoint { opening, ..LooseJoint::ball(name, socket, ball) }
}

/// Report of a joint whose ball touches the wall in the direction `n` (unit) with `normal` newtons.
fn touching(socket_centre: Vec3, n: Vec3, normal: f64, friction: Vec3) -> JointReport {
    let eccentricity = n * (CLEARANCE + 1e-6);
    let ball_centre = socket_centre + eccentricity;
    JointReport {
        socket_centre,
        ball_centre,
        eccentricity,
        clearance: CLEARANCE,
        penetration: 1e-6,
        normal_force: -n * normal,
        friction_force: friction,
        contact_point: ball_centre + n * BALL,
        state: ContactMode::Slip,
        ..Default::default()
    }
}

fn at(position: Vec3, rotation: Mat3) -> BodyMotion {
    BodyMotion { position, rotation, ..Default::default() }
}

/// A rod of 0.2 m on one ball in a fixed socket, Z up, 30 degrees from the vertical, opening towards -Y.
pub(crate) fn pendulum() -> (Scene, Frame) {
    let rod = body("rod", vec![bar(Role::DrivenRod, Vec3::zeros(), Vec3::new(0.0, 0.0, -0.2), 0.004)]);
    let frame_shape = Geometry::Box { centre: Vec3::new(0.0, 0.0, 0.056), size: Vec3::new(0.06, 0.03, 0.02) };
    let scene = scene(
        "pendulum",
        SignedAxis::MinusZ,
        vec![rod],
        vec![joint(
            "S1",
            Attachment { body: None, point: Vec3::zeros() },
            Attachment { body: Some(0), point: Vec3::zeros() },
            -Vec3::y(),
        )],
        vec![shape(Role::Frame, frame_shape), bar(Role::Frame, Vec3::new(0.0, 0.0, 0.035), Vec3::zeros(), 0.006)],
    );
    let n = Vec3::new(-0.5, 0.0, -0.866_025_403_784_438_6);
    let report = touching(Vec3::zeros(), n, 4.0, Vec3::new(0.4, 0.0, -0.2));
    let turn = Quat::from_axis_angle(&Vec3::y_axis(), std::f64::consts::FRAC_PI_6).to_rotation_matrix();
    let frame =
        Frame { bodies: vec![at(report.ball_centre, turn.into_inner())], joints: vec![report], ..Default::default() };
    (scene, frame)
}

/// The paper's mechanism at t = 0, balls pressed against their sockets.
pub(crate) fn three_legs() -> (Scene, Frame) {
    let x = |x: f64| Vec3::new(x, 0.0, 0.0);
    let f = [0.136_493_548, 0.240_922_773_5, 0.186_472_405_6];
    let axes = [Vec3::z(), -Vec3::z(), Vec3::y()];
    let (b, x_s, driving_rod, slider_plane) = (0.052, 0.060, 0.028, 0.032);
    let gamma = std::f64::consts::PI / 12.0;
    let platform_turn = Quat::from_axis_angle(&Vec3::y_axis(), gamma).to_rotation_matrix().into_inner();
    let o7 = Vec3::new(0.203, 0.0, -0.038_316_726_4);
    let hinge = [Vec3::z() * b, -Vec3::z() * b, Vec3::y() * b];
    let hinge_axis = [Vec3::y(), Vec3::y(), Vec3::z()];

    let mut bodies = Vec::new();
    let mut motions = Vec::new();
    let mut joints = Vec::new();
    let mut reports = Vec::new();
    let mut rails = Vec::new();
    for i in 0..3 {
        let centre = x(slider_plane) + axes[i] * f[i];
        let size = Vec3::new(0.02, 0.03, 0.03);
        let shapes = vec![
            shape(Role::Slider, Geometry::Box { centre: Vec3::zeros(), size }),
            bar(Role::DrivingRod, Vec3::zeros(), x(driving_rod), 0.006),
        ];
        bodies.push(body(&format!("slider {}", i + 1), shapes));
        motions.push(at(centre, Mat3::identity()));
        let (near, far) = (x(slider_plane) + axes[i] * 0.04, x(slider_plane) + axes[i] * 0.30);
        rails.push(shape(Role::Rail, Geometry::Cylinder { from: near, to: far, radius: 0.005 }));
    }
    for i in 0..3 {
        let socket = x(x_s) + axes[i] * f[i];
        let foot = o7 + platform_turn * hinge[i];
        let down_rod = (foot - socket).normalize();
        let n = (down_rod + 0.4 * Vec3::x() + 0.25 * hinge_axis[i]).normalize();
        let report = touching(socket, n, [8.3, 8.6, 2.8][i], hinge_axis[i].cross(&n) * 1.2);
        // Body frame: origin at the ball, z along the rod.
        let turn = Quat::rotation_between(&Vec3::z(), &(foot - report.ball_centre)).unwrap_or_default();
        let rod = bar(Role::DrivenRod, Vec3::zeros(), Vec3::new(0.0, 0.0, 0.2), 0.004);
        bodies.push(body(&format!("driven rod {}", i + 1), vec![rod]));
        motions.push(at(report.ball_centre, turn.to_rotation_matrix().into_inner()));
        let socket_end = Attachment { body: Some(i), point: x(driving_rod) };
        let ball_end = Attachment { body: Some(3 + i), point: Vec3::zeros() };
        let opening = [-Vec3::y(), -Vec3::y(), -Vec3::z()][i];
        joints.push(joint(&format!("S{}", i + 1), socket_end, ball_end, opening));
        reports.push(report);
    }
    let mut shapes = vec![shape(
        Role::Platform,
        Geometry::Plate {
            corners: vec![
                Vec3::new(0.0, -0.018, 0.058),
                Vec3::new(0.0, 0.018, 0.058),
                Vec3::new(0.0, 0.058, 0.016),
                Vec3::new(0.0, 0.058, -0.016),
                Vec3::new(0.0, 0.018, -0.058),
                Vec3::new(0.0, -0.018, -0.058),
            ],
            triangles: (1..5).map(|i| [0, i, i + 1]).collect(),
            thickness: 0.008,
        },
    )];
    for i in 0..3 {
        let (from, to) = (hinge[i] - hinge_axis[i] * 0.012, hinge[i] + hinge_axis[i] * 0.012);
        shapes.push(shape(Role::Pin, Geometry::Cylinder { from, to, radius: 0.006 }));
    }
    shapes.push(shape(Role::Probe, Geometry::Cylinder { from: Vec3::zeros(), to: x(0.045), radius: 0.003 }));
    shapes.push(shape(Role::Probe, Geometry::Cone { from: x(0.045), to: x(0.060), radius: 0.003 }));
    bodies.push(body("platform", shapes));
    motions.push(at(o7, platform_turn));
    let mut scene = scene("three legs", SignedAxis::PlusX, bodies, joints, rails);
    scene.machine_mut().output = Output { body: 6, probe: Some(x(0.060)) };
    (scene, Frame { bodies: motions, joints: reports, ..Default::default() })
}

/// Peaks of a frame in which each joint was hit with ten times its current force.
pub(crate) fn hits(frame: &Frame) -> Vec<Peak> {
    let peak = |report: &JointReport| Peak {
        normal: 10.0 * report.normal_force.norm(),
        normal_force: report.normal_force * 10.0,
        impacts: 1,
        ..Default::default()
    };
    frame.joints.iter().map(peak).collect()
}
