//! Loops closed by joints of any kind: the same motion as with that joint in the tree, mechanisms against their loop equations,
//! redundant constraints, and loops that cannot close.

use crate::common::matrix::FORMULATIONS;
use crate::common::matrix::every_variant;
use crate::common::{frame_now, parse, run_until};
use crate::elements::frame_at;
use crate::formulations;
use crate::joint_elements::start_simulation;
use crate::two_degrees::angle_difference;
use jointplay_physics::machine::{Mat3, Quat, Vec3};
use jointplay_physics::simulate::{BodyMotion, Frame, Simulation};

const G: f64 = 9.81;

fn rotation_about(axis: Vec3, angle: f64) -> Quat {
    Quat::from_axis_angle(&nalgebra::Unit::new_normalize(axis), angle)
}

fn quaternion_text(of: &Quat) -> String {
    format!("{{ quaternion = [{:e}, {:e}, {:e}, {:e}] }}", of.w, of.i, of.j, of.k)
}

fn plain_vector_text(v: Vec3) -> String {
    format!("[{:e}, {:e}, {:e}]", v.x, v.y, v.z)
}

fn vector_text(v: Vec3, unit: &str) -> String {
    format!("\"{:e} {:e} {:e} {unit}\"", v.x, v.y, v.z)
}

/// The joint between an arm, hinged to the world, and a rod.
struct Pair {
    kind: &'static str,
    /// Geometry as lines of the scene file.
    keys: String,
    start: &'static str,
    freedoms: usize,
}

fn pairs() -> [Pair; 5] {
    let rest = rotation_about(Vec3::new(1.0, 0.0, 1.0), 0.4);
    let axis = Vec3::new(1.0, 2.0, 2.0) / 3.0;
    let second = rest.inverse() * axis.cross(&Vec3::z()).normalize();
    let points = format!(
        "parent_point = \"120 0 10 mm\"\nchild_point = \"-50 5 0 mm\"\nrotation = {}\n",
        quaternion_text(&rest)
    );
    let along = format!("{points}axis = {}\n", plain_vector_text(axis));
    let pair = |kind, keys: &str, start, freedoms| Pair { kind, keys: keys.to_owned(), start, freedoms };
    [
        pair("fixed", &points, "", 0),
        pair("revolute", &along, "start = { position = \"20 deg\", velocity = \"-4 rad/s\" }\n", 1),
        pair("prismatic", &along, "start = { position = \"6 mm\", velocity = \"0.2 m/s\" }\n", 1),
        pair(
            "cylindrical",
            &along,
            "start = { position = \"6 mm\", angle = \"20 deg\", velocity = \"0.2 m/s\", angular_velocity = \"-4 rad/s\" }\n",
            2,
        ),
        pair(
            "universal",
            &format!("{along}child_axis = {}\n", plain_vector_text(second)),
            "start = { angle = \"20 deg\", child_angle = \"-35 deg\", angular_velocity = \"2 rad/s\", child_angular_velocity = \"-4 rad/s\" }\n",
            2,
        ),
    ]
}

/// The scene of arm and rod; `joint_text` connects the two, and `driven` prescribes the arm's motion.
fn two_bodies(driven: bool, joint_text: &str) -> String {
    let law = if driven {
        "drive = { law = \"harmonic\", mean = \"20 deg\", amplitude = \"30 deg\", frequency = \"1 Hz\" }\n"
    } else {
        "start = { position = \"20 deg\", velocity = \"3 rad/s\" }\n"
    };
    format!(
        "[gravity]\nz = \"-9.81 m/s^2\"\n[solver]\ntolerance = 1e-10\n\
         [[body]]\nname = \"arm\"\nmass = \"0.4 kg\"\ncentre = \"60 10 0 mm\"\ninertia = \"3e-4 8e-4 7e-4 kg m^2\"\n\
         [[body]]\nname = \"rod\"\nmass = \"0.3 kg\"\ncentre = \"20 0 10 mm\"\ninertia = \"2e-4 5e-4 6e-4 kg m^2\"\n\
         [[joint]]\nname = \"hinge\"\nkind = \"revolute\"\nchild = \"arm\"\naxis = [0, 1, 0]\n{law}{joint_text}"
    )
}

/// Force on the rod at its joint point and torque on it, from its motion by the Newton-Euler equations.
fn joint_load(rod: &BodyMotion) -> [Vec3; 2] {
    let centre = rod.rotation * Vec3::new(0.02, 0.0, 0.01);
    let (spin, rate) = (rod.angular_velocity, rod.angular_acceleration);
    let acceleration = rod.acceleration + rate.cross(&centre) + spin.cross(&spin.cross(&centre));
    let force = 0.3 * (acceleration + Vec3::new(0.0, 0.0, G));
    let inertia = rod.rotation * Mat3::from_diagonal(&Vec3::new(2e-4, 5e-4, 6e-4)) * rod.rotation.transpose();
    let arm = rod.rotation * Vec3::new(-0.05, 0.005, 0.0) - centre;
    let moment = inertia * rate + spin.cross(&(inertia * spin));
    [force, moment - arm.cross(&force)]
}

#[test]
fn a_body_on_a_closing_joint_moves_as_with_the_joint_in_the_tree() {
    for pair in pairs() {
        for driven in [false, true] {
            let tree_joint = format!(
                "[[joint]]\nname = \"j\"\nkind = \"{}\"\nparent = \"arm\"\nchild = \"rod\"\n{}{}",
                pair.kind, pair.keys, pair.start
            );
            let mut simulation = start_simulation(&two_bodies(driven, &tree_joint), &[]);
            let rod = frame_now(&mut simulation).bodies[1];
            let end = frame_at(&mut simulation, 0.25);
            let free = format!(
                "[[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"rod\"\nstart = {{ position = {}, rotation = {}, velocity = {}, \
                 angular_velocity = {} }}\n[[joint]]\nname = \"j\"\nkind = \"{}\"\nparent = \"arm\"\nchild = \"rod\"\ncloses_loop = true\n{}",
                vector_text(rod.position, "m"),
                quaternion_text(&Quat::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(rod.rotation))),
                vector_text(rod.velocity, "m/s"),
                vector_text(rod.angular_velocity, "rad/s"),
                pair.kind,
                pair.keys
            );
            let label = format!("{}, driven: {driven}", pair.kind);
            formulations::check(&label, &two_bodies(driven, &free));
            let mut simulation = start_simulation(&two_bodies(driven, &free), &[]);
            let summary = simulation.mechanism().summary();
            let free = pair.freedoms + usize::from(!driven);
            assert_eq!(summary.degrees_of_freedom, free, "{label}");
            assert_eq!((summary.closing_joints, summary.dependent_rows), (1, 0), "{label}");
            assert_eq!(simulation.indeterminate_forces(), Default::default(), "{label}");
            let frame = frame_at(&mut simulation, 0.25);
            for (a, b) in frame.bodies.iter().zip(&end.bodies) {
                let error = (a.position - b.position).norm();
                assert!(error < 2e-7, "{label}: {error:e}");
                let error = (a.rotation - b.rotation).amax();
                assert!(error < 2e-6, "{label}: {error:e}");
                let error = (a.angular_acceleration - b.angular_acceleration).norm();
                assert!(error < 2e-4 * b.angular_acceleration.norm().max(1.0), "{label}: {error:e}");
            }
            assert_eq!(frame.coordinates.len(), end.coordinates.len());
            for (a, b) in frame.coordinates.iter().zip(&end.coordinates) {
                assert!(angle_difference(a[0], b[0]) < 2e-6 && (a[1] - b[1]).abs() < 2e-5, "{label}: {a:?} {b:?}");
            }
            for (a, b) in frame.actuators.iter().zip(&end.actuators) {
                assert!((a - b).abs() < 1e-5, "{label}: {a} {b}");
            }
            for (own, expected) in frame.closing[0].iter().zip(joint_load(&frame.bodies[1])) {
                let error = (own - expected).norm();
                assert!(error < 2e-4, "{label}: {own} {expected}");
            }
            let residual = simulation.ledger().unwrap().relative_residual();
            assert!(residual.abs() < 1e-6, "{label}: {residual:e}");
        }
    }
}

/// Lengths of crank, coupler and rocker, and of the ground, m.
const BAR: [f64; 3] = [0.1, 0.26, 0.21];
const GROUND: f64 = 0.24;

/// Angles of coupler and rocker from the ground, by the cosine rule.
fn four_bar_angles(crank: f64) -> [f64; 2] {
    let [a, b, c] = BAR;
    let (dx, dy) = (GROUND - a * crank.cos(), -a * crank.sin());
    let reach = dx.hypot(dy);
    let coupler = dy.atan2(dx) + ((b * b + reach * reach - c * c) / (2.0 * b * reach)).acos();
    [coupler, (b * coupler.sin() - dy).atan2(b * coupler.cos() - dx)]
}

/// Variations of the planar four-bar.
struct Bar {
    start: &'static str,
    /// Drive rates of crank and rocker, rad/s.
    driven: [Option<f64>; 2],
    /// Offset of the rocker's hinge out of the plane, m.
    out_of_plane: f64,
    /// Added to the coupler's angle, rad.
    coupler_offset: f64,
    closed_by: &'static str,
}

const REVOLUTE: &str = "[[joint]]\nname = \"B\"\nkind = \"revolute\"\nparent = \"coupler\"\nchild = \"rocker\"\ncloses_loop = true\n\
                        parent_point = \"0.26 0 0 m\"\nchild_point = \"0.21 0 0 m\"\naxis = [0, -1, 0]\n";
const BALL: &str = "[[ball_joint]]\nname = \"B\"\nsocket = { body = \"coupler\", at = \"0.26 0 0 m\" }\n\
                    ball = { body = \"rocker\", at = \"0.21 0 0 m\" }\nclearance = 0\n";

const PLAIN: Bar =
    Bar { start: "as-given", driven: [None; 2], out_of_plane: 0.0, coupler_offset: 0.0, closed_by: REVOLUTE };

/// The four-bar in the world's xz plane. Hinge axes are -y, so that angles count from x to z. The crank starts at 1 rad and 12 rad/s.
fn four_bar(bar: &Bar) -> String {
    let [a, b, c] = BAR;
    let crank = 1.0;
    let [coupler, rocker] = four_bar_angles(crank);
    let s = (coupler - rocker).sin();
    let rates = [12.0 * a * (rocker - crank).sin() / (b * s), 12.0 * a * (coupler - crank).sin() / (c * s)];
    let body = |i: usize, name: &str, mass: f64, inertia: f64| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = \"{mass} kg\"\ncentre = \"{} 0 0 m\"\ninertia = \"{} {inertia} {inertia} kg m^2\"\n",
            0.5 * BAR[i],
            0.3 * inertia
        )
    };
    let start = |driven: Option<f64>, angle: f64, rate: f64| match driven {
        Some(rate) => {
            format!("drive = {{ law = \"constant\", position = \"{angle:e} rad\", velocity = \"{rate:e} rad/s\" }}\n")
        }
        None => {
            format!("start = {{ position = \"{angle:e} rad\", velocity = \"{rate:e} rad/s\" }}\n")
        }
    };
    let hinge = |name: &str, child: &str, at: String, start: String| {
        format!(
            "[[joint]]\nname = \"{name}\"\nkind = \"revolute\"\nchild = \"{child}\"\n{at}axis = [0, -1, 0]\n{start}"
        )
    };
    [
        format!("start = \"{}\"\n[gravity]\nz = \"-9.81 m/s^2\"\n[solver]\ntolerance = 1e-10\n", bar.start),
        body(0, "crank", 0.3, 4e-4),
        body(1, "coupler", 0.5, 3e-3),
        body(2, "rocker", 0.4, 2e-3),
        hinge("O", "crank", String::new(), start(bar.driven[0], crank, 12.0)),
        hinge(
            "A",
            "coupler",
            format!("parent = \"crank\"\nparent_point = \"{a} 0 0 m\"\n"),
            start(None, coupler - crank + bar.coupler_offset, rates[0] - 12.0),
        ),
        hinge(
            "D",
            "rocker",
            format!("parent_point = \"{GROUND} {} 0 m\"\n", bar.out_of_plane),
            start(bar.driven[1], rocker, rates[1]),
        ),
        bar.closed_by.to_owned(),
    ]
    .concat()
}

/// Residual of the loop equations, m.
fn loop_residual(frame: &Frame) -> f64 {
    let [crank, coupler, rocker] = [0, 1, 2].map(|i| frame.coordinates[i][0]);
    let coupler = crank + coupler;
    let [a, b, c] = BAR;
    let x = a * crank.cos() + b * coupler.cos() - c * rocker.cos() - GROUND;
    let z = a * crank.sin() + b * coupler.sin() - c * rocker.sin();
    x.hypot(z)
}

#[test]
fn a_planar_four_bar_closed_by_a_hinge_moves_as_one_closed_by_a_ball_joint() {
    let with_ball = Bar { closed_by: BALL, ..PLAIN };
    let mut ball = start_simulation(&four_bar(&with_ball), &[]);
    let end = frame_at(&mut ball, 0.3);
    let mut reactions = Vec::new();
    for formulation in FORMULATIONS {
        let mut simulation = start_simulation(&four_bar(&PLAIN), &[("formulation", formulation)]);
        let summary = simulation.mechanism().summary();
        // Two rows close a loop in the plane.
        assert_eq!((summary.dependent_rows, summary.degrees_of_freedom), (3, 1));
        assert_eq!(simulation.indeterminate_forces().reactions, [0]);
        let frame = frame_at(&mut simulation, 0.3);
        let bound = if formulation == "tree" { 1e-9 } else { 1e-6 };
        assert!(loop_residual(&frame) < bound, "{formulation}: {:e}", loop_residual(&frame));
        for (a, b) in frame.bodies.iter().zip(&end.bodies) {
            let error = (a.position - b.position).norm();
            assert!(error < 1e-6, "{formulation}: {error:e}");
        }
        let residual = simulation.ledger().unwrap().relative_residual();
        assert!(residual.abs() < 1e-6, "{formulation}: {residual:e}");
        reactions.push(frame.closing[0]);
        // The closing hinge measures the angle between its bodies.
        let [crank, coupler, rocker, closing] = frame.coordinates[..] else {
            panic!("{:?}", frame.coordinates);
        };
        assert!(angle_difference(closing[0], rocker[0] - crank[0] - coupler[0]) < bound);
        let rate = rocker[1] - crank[1] - coupler[1];
        assert!((closing[1] - rate).abs() < 100.0 * bound, "{formulation}: {closing:?} {rate}");
    }
    // Both formulations choose the minimum-norm reactions. In the plane these are the forces of the ball joint.
    let [tree, lagrange] = reactions[..] else {
        panic!("two formulations");
    };
    for (a, b) in tree.iter().zip(lagrange) {
        assert!((a - b).norm() < 1e-3 * tree[0].norm(), "{a} {b}");
    }
    assert!(tree[0].y.abs() < 1e-9 * tree[0].norm() && tree[1].norm() < 1e-9);
    let error = (tree[0] - end.joints[0].normal_force).norm();
    assert!(error < 1e-4 * tree[0].norm(), "{error:e}");
}

/// The four-bar with a bob on a loose ball joint, which exercises contacts, implicit contacts and automatic selection.
pub fn four_bar_with_a_bob() -> String {
    let bob = "[[body]]\nname = \"bob\"\nmass = \"0.1 kg\"\ninertia = \"4e-5 4e-5 1e-5 kg m^2\"\n\
               [[joint]]\nname = \"bob\"\nkind = \"free\"\nchild = \"bob\"\nchild_point = \"0 0 40 mm\"\n\
               start = { position = \"0 50 0 mm\" }\n\
               [[ball_joint]]\nname = \"S\"\nsocket = { body = \"crank\", at = \"0 50 0 mm\" }\n\
               ball = { body = \"bob\", at = \"0 0 40 mm\" }\nclearance = \"0.1 mm\"\nfriction = 0.1\n";
    four_bar(&PLAIN) + bob
}

#[test]
fn every_method_keeps_a_loop_closed() {
    for variant in every_variant() {
        let step = if variant.method.ends_with("euler") { "2 us" } else { "5 us" };
        let [method, formulation] = variant.changes();
        let changes = [method, ("solver.step", step), ("solver.tolerance", "1e-7"), formulation];
        let mut simulation = start_simulation(&four_bar_with_a_bob(), &changes);
        run_until(&mut simulation, 12e-3);
        let frame = frame_now(&mut simulation);
        let bound = if variant.formulation == "tree" { 1e-9 } else { 1e-5 };
        assert!(loop_residual(&frame) < bound, "{variant}: {:e}", loop_residual(&frame));
        let impacts: u64 = simulation.statistics().impacts();
        assert!(impacts > 0, "{variant}");
    }
}

/// Crank radius, m. The block on the crank's pin slides along y in the slot of a yoke, which slides along x.
const YOKE: f64 = 0.08;

fn scotch_yoke(crank: &str) -> String {
    let body = |name: &str, mass: f64| {
        format!("[[body]]\nname = \"{name}\"\nmass = \"{mass} kg\"\ninertia = \"2e-4 3e-4 4e-4 kg m^2\"\n")
    };
    [
        "[gravity]\nx = 0\ny = 0\nz = 0\n[solver]\ntolerance = 1e-11\n".to_owned(),
        body("crank", 0.7) + &body("block", 0.2) + &body("yoke", 1.5),
        format!("[[joint]]\nname = \"crank\"\nkind = \"revolute\"\nchild = \"crank\"\naxis = [0, 0, 1]\n{crank}\n"),
        format!(
            "[[joint]]\nname = \"pin\"\nkind = \"revolute\"\nparent = \"crank\"\nchild = \"block\"\nparent_point = \"{YOKE} 0 0 m\"\n\
             axis = [0, 0, 1]\nstart = {{ position = \"-0.5 rad\", velocity = \"-9 rad/s\" }}\n"
        ),
        format!(
            "[[joint]]\nname = \"guide\"\nkind = \"prismatic\"\nchild = \"yoke\"\naxis = [1, 0, 0]\n\
             start = {{ position = \"{:e} m\", velocity = \"{:e} m/s\" }}\n",
            YOKE * 0.5_f64.cos(),
            -9.0 * YOKE * 0.5_f64.sin()
        ),
        "[[joint]]\nname = \"slot\"\nkind = \"prismatic\"\nparent = \"yoke\"\nchild = \"block\"\naxis = [0, 1, 0]\ncloses_loop = true\n"
            .to_owned(),
    ]
    .concat()
}

#[test]
fn a_scotch_yoke_follows_its_closed_form() {
    let inertia = |angle: f64| 4e-4 + YOKE * YOKE * (0.2 + 1.5 * angle.sin().powi(2));
    let bound = 1e-9;
    let free = "start = { position = \"0.5 rad\", velocity = \"9 rad/s\" }";
    formulations::check("scotch yoke", &scotch_yoke(free));
    let mut simulation = start_simulation(&scotch_yoke(free), &[]);
    let summary = simulation.mechanism().summary();
    assert_eq!((summary.dependent_rows, summary.degrees_of_freedom), (3, 1));
    let frame = frame_at(&mut simulation, 0.5);
    let [[angle, rate], _, [x, speed], [slot, _]] = frame.coordinates[..] else {
        panic!("{:?}", frame.coordinates);
    };
    assert!((x - YOKE * angle.cos()).abs() < bound, "{x}");
    assert!((speed + YOKE * rate * angle.sin()).abs() < 100.0 * bound);
    assert!((slot - YOKE * angle.sin()).abs() < bound, "{slot}");
    let expected = 9.0 * (inertia(0.5) / inertia(angle)).sqrt();
    assert!((rate - expected).abs() < 1e-6, "{rate} {expected}");
    // At a constant rate the torque follows from the changing inertia.
    let drive = "drive = { law = \"constant\", position = \"0.5 rad\", velocity = \"9 rad/s\" }";
    let mut simulation = start_simulation(&scotch_yoke(drive), &[]);
    let frame = frame_at(&mut simulation, 0.3);
    let angle: f64 = 0.5 + 9.0 * 0.3;
    let torque = 1.5 * YOKE * YOKE * 81.0 * angle.sin() * angle.cos();
    let error = frame.actuators[0] - torque;
    assert!(error.abs() < 1e-5 * torque.abs().max(1.0), "{error:e}");
    assert_eq!(simulation.indeterminate_forces().actuators, [0; 0]);
}

/// Two shafts at an angle, connected by a universal joint; the bearing of the second one closes the loop.
#[test]
fn a_universal_joint_turns_a_shaft_at_its_known_ratio() {
    let bend = 40_f64.to_radians();
    for (bearing, dependent) in [("revolute", 3), ("cylindrical", 2)] {
        let text = format!(
            "[gravity]\nx = 0\ny = 0\nz = 0\n[solver]\ntolerance = 1e-11\n\
             [[body]]\nname = \"in\"\nmass = \"1 kg\"\ninertia = \"1e-3 2e-3 2e-3 kg m^2\"\n\
             [[body]]\nname = \"out\"\nmass = \"1 kg\"\ninertia = \"2e-3 3e-3 3e-3 kg m^2\"\n\
             [[joint]]\nname = \"in\"\nkind = \"revolute\"\nchild = \"in\"\naxis = [1, 0, 0]\n\
             drive = {{ law = \"constant\", position = 0, velocity = \"10 rad/s\" }}\n\
             [[joint]]\nname = \"cross\"\nkind = \"universal\"\nparent = \"in\"\nchild = \"out\"\naxis = [0, 1, 0]\nchild_axis = [0, 0, 1]\n\
             start = {{ child_angle = \"{bend:e} rad\", angular_velocity = 0, child_angular_velocity = 0 }}\n\
             [[joint]]\nname = \"bearing\"\nkind = \"{bearing}\"\nchild = \"out\"\nchild_point = \"200 0 0 mm\"\nparent_point = {}\n\
             axis = {}\nrotation = {{ axis = [0, 0, 1], angle = \"{bend:e} rad\" }}\ncloses_loop = true\n",
            vector_text(Vec3::new(0.2 * bend.cos(), 0.2 * bend.sin(), 0.0), "m"),
            plain_vector_text(Vec3::new(bend.cos(), bend.sin(), 0.0)),
        );
        formulations::check("universal joint", &text);
        let mut simulation = start_simulation(&text, &[]);
        let summary = simulation.mechanism().summary();
        assert_eq!((summary.dependent_rows, summary.degrees_of_freedom), (dependent, 0), "{bearing}");
        let (near, fast) = (1e-9, 1e-8);
        for k in 1..=20 {
            let t = 0.04 * f64::from(k);
            let frame = frame_at(&mut simulation, t);
            let (sin, cos) = (10.0 * t).sin_cos();
            let angle = sin.atan2(cos * bend.cos());
            let ratio = bend.cos() / (1.0 - (bend.sin() * cos).powi(2));
            let [own, rate] = frame.coordinates[frame.coordinates.len() - 1];
            assert!(angle_difference(own, angle) < near, "{bearing} {t}: {own} {angle}");
            assert!((rate - 10.0 * ratio).abs() < 10.0 * fast, "{bearing} {t}: {rate}");
            // The torque only accelerates the second shaft.
            let slope = -bend.cos() * 2.0 * bend.sin().powi(2) * cos * sin / (1.0 - (bend.sin() * cos).powi(2)).powi(2);
            let torque = 2e-3 * ratio * slope * 100.0;
            let error = (frame.actuators[0] - torque).abs();
            assert!(error < 2e-3 * fast.max(1e-6) * 100.0, "{bearing} {t}: {error:e}");
        }
    }
}

/// A Bennett linkage: four hinges that are mobile only because opposite links are equal and lengths are as the sines of the twists.
#[test]
fn a_bennett_linkage_follows_its_closed_form() {
    let (alpha, beta) = (30_f64.to_radians(), 70_f64.to_radians());
    let a = 0.1;
    let b = a * beta.sin() / alpha.sin();
    let factor = (0.5 * (beta + alpha)).sin() / (0.5 * (beta - alpha)).sin();
    let second = |first: f64| 2.0 * (factor / (0.5 * first).tan()).atan();
    let first = 0.7;
    let tilted = |angle: f64| plain_vector_text(rotation_about(Vec3::x(), angle) * Vec3::z());
    let body = |name: &str| {
        format!(
            "[[body]]\nname = \"{name}\"\nmass = \"0.3 kg\"\ncentre = \"50 0 0 mm\"\ninertia = \"1e-4 4e-4 4e-4 kg m^2\"\n"
        )
    };
    let hinge = |name: &str, parent: &str, length: f64, twist: f64, start: String| {
        format!(
            "[[joint]]\nname = \"{name}\"\nkind = \"revolute\"\nparent = \"{parent}\"\nchild = \"{name}\"\n\
             parent_point = \"{length:e} 0 0 m\"\naxis = {}\nrotation = {{ axis = [1, 0, 0], angle = \"{twist:e} rad\" }}\n{start}\n",
            tilted(twist)
        )
    };
    for driven in [true, false] {
        let rate = 3.0;
        // d(second)/d(first), from tan(first/2) tan(second/2) = factor.
        let slope = -second(first).sin() / first.sin();
        let law = if driven { "drive = { law = \"constant\", " } else { "start = { " };
        let text = [
            "[gravity]\nz = \"-9.81 m/s^2\"\n[solver]\ntolerance = 1e-10\n".to_owned(),
            body("l1") + &body("l2") + &body("l3"),
            hinge("l1", "world", 0.0, 0.0, format!("{law}position = \"{first} rad\", velocity = \"{rate} rad/s\" }}")),
            hinge(
                "l2",
                "l1",
                a,
                alpha,
                format!(
                    "start = {{ position = \"{:e} rad\", velocity = \"{:e} rad/s\" }}",
                    second(first),
                    rate * slope
                ),
            ),
            hinge(
                "l3",
                "l2",
                b,
                beta,
                format!("start = {{ position = \"{:e} rad\", velocity = \"{:e} rad/s\" }}", -first, -rate),
            ),
            format!(
                "[[joint]]\nname = \"J4\"\nkind = \"revolute\"\nchild = \"l3\"\nparent_point = \"{:e} 0 0 m\"\nchild_point = \"{a:e} 0 0 m\"\n\
                 axis = {}\nrotation = {{ axis = [1, 0, 0], angle = \"{:e} rad\" }}\ncloses_loop = true\n",
                -b,
                tilted(-beta),
                -alpha - beta
            ),
        ]
        .concat();
        let label = format!("driven: {driven}");
        formulations::check("Bennett linkage", &text);
        let mut simulation = start_simulation(&text, &[]);
        let summary = simulation.mechanism().summary();
        let free = usize::from(!driven);
        assert_eq!((summary.dependent_rows, summary.degrees_of_freedom), (3, free), "{label}");
        let bound = 1e-9;
        for k in 1..=8 {
            let frame = frame_at(&mut simulation, 0.1 * f64::from(k));
            let [[q1, _], [q2, _], [q3, _], [q4, _]] = frame.coordinates[..] else {
                panic!("{label}: {:?}", frame.coordinates);
            };
            for (own, expected) in [(q2, second(q1)), (q3, -q1), (q4, second(q1))] {
                assert!(angle_difference(own, expected) < bound, "{label}: {own} {expected}");
            }
        }
        let residual = simulation.ledger().unwrap().relative_residual();
        assert!(residual.abs() < 1e-5, "{label}: {residual:e}");
    }
}

/// A hinge and three cylindrical joints on skew axes, one of which closes the loop. No constraint is redundant; the pose is assembled from a guess.
#[test]
fn an_rccc_loop_keeps_angles_and_distances_of_its_axes() {
    let degrees = |x: f64| x.to_radians();
    // Axes 1 (z of the world) and 2 (of the input), 2 and 3 (of the coupler), 3 and 4 (of the output), 4 and 1.
    let [z12, z23, z34, z41] = [30.0, 80.0, 70.0, 75.0].map(|x| rotation_about(Vec3::x(), degrees(x)) * Vec3::z());
    // At their angles of 0 the frames of input, coupler and output have axes 1, 2 and 4 along z.
    let of_coupler = rotation_about(Vec3::x(), degrees(30.0));
    let of_output = rotation_about(Vec3::x(), degrees(75.0));
    // Turns the third axis as seen from the output into the third axis as seen from the coupler.
    let closing = Quat::rotation_between(&z34, &z23).unwrap();
    let (p12, p23, p34, p41) =
        (Vec3::new(0.06, 0.0, 0.0), Vec3::new(0.2, 0.02, 0.0), Vec3::new(0.15, 0.0, 0.03), Vec3::new(-0.12, 0.04, 0.0));
    let body =
        |name: &str| format!("[[body]]\nname = \"{name}\"\nmass = \"0.3 kg\"\ninertia = \"4e-4 4e-4 2e-4 kg m^2\"\n");
    let cylindrical = |name: &str, parent: &str, child: &str, more: String| {
        format!(
            "[[joint]]\nname = \"{name}\"\nkind = \"cylindrical\"\nparent = \"{parent}\"\nchild = \"{child}\"\n{more}\n"
        )
    };
    let text = [
        "start = \"ideal\"\n[gravity]\nz = \"-9.81 m/s^2\"\n[solver]\ntolerance = 1e-10\n".to_owned(),
        body("input") + &body("coupler") + &body("output"),
        "[[joint]]\nname = \"input\"\nkind = \"revolute\"\nchild = \"input\"\naxis = [0, 0, 1]\n\
         drive = { law = \"constant\", position = \"0 deg\", velocity = \"6 rad/s\" }\n"
            .to_owned(),
        cylindrical(
            "coupler",
            "input",
            "coupler",
            format!(
                "parent_point = {}\naxis = {}\nrotation = {}\nstart = {{ angle = \"100 deg\" }}",
                vector_text(p12, "m"),
                plain_vector_text(z12),
                quaternion_text(&of_coupler)
            ),
        ),
        cylindrical(
            "output",
            "world",
            "output",
            format!(
                "parent_point = {}\naxis = {}\nrotation = {}\nstart = {{ angle = \"80 deg\" }}",
                vector_text(p41, "m"),
                plain_vector_text(z41),
                quaternion_text(&of_output)
            ),
        ),
        cylindrical(
            "third",
            "coupler",
            "output",
            format!(
                "parent_point = {}\nchild_point = {}\naxis = {}\nrotation = {}\ncloses_loop = true",
                vector_text(p23, "m"),
                vector_text(p34, "m"),
                plain_vector_text(z23),
                quaternion_text(&closing)
            ),
        ),
    ]
    .concat();
    formulations::check("RCCC loop", &text);
    let mut simulation = start_simulation(&text, &[]);
    let summary = simulation.mechanism().summary();
    assert_eq!((summary.dependent_rows, summary.degrees_of_freedom), (0, 0));
    let (joint, gap) = simulation.mechanism().assembly().widest.unwrap();
    assert!(joint == 0 && gap > 1e-3, "{joint} {gap}");
    let bound = 1e-9;
    let mut max_slide = 0.0_f64;
    for k in 0..=10 {
        let t = 0.1 * f64::from(k);
        let frame = frame_at(&mut simulation, t);
        let [_, _, _, [slid, _], [turned, _], ..] = frame.coordinates[..] else {
            panic!("{:?}", frame.coordinates);
        };
        // Axis 2 follows from the input's angle alone, axis 3 from the output's coordinates alone.
        let input = rotation_about(Vec3::z(), 6.0 * t);
        let (z2, p2) = (input * z12, input * p12);
        let output = rotation_about(z41, turned) * of_output;
        let (z3, p3) = (output * z34, p41 + z41 * slid + output * p34);
        let angle = z2.dot(&z3) - degrees(80.0).cos();
        assert!(angle.abs() < bound, "{t}: {angle:e}");
        let distance = (p3 - p2).dot(&z2.cross(&z3));
        // In the coupler axis 2 is z through the origin.
        let expected = p23.dot(&Vec3::z().cross(&z23));
        assert!((distance - expected).abs() < bound, "{t}: {distance} {expected}");
        max_slide = max_slide.max(slid.abs());
    }
    assert!(max_slide > 1e-3, "it slides: {max_slide}");
}

fn start_error(text: &str) -> String {
    let scene = parse(text, &[]);
    let error = Simulation::new(&scene.machine).expect_err("does not start");
    scene.locate(&error).to_string()
}

#[test]
fn a_loop_that_does_not_close_is_refused_by_joint_and_direction() {
    let out_of_plane = Bar { out_of_plane: 5e-3, ..PLAIN };
    let error = start_error(&four_bar(&out_of_plane));
    let words = "joint B: its bodies are 5 mm apart there and turned against it by 0 deg as given, and a joint that closes a loop may be \
                 open by at most 0.01 mm and 0.00573 deg";
    assert!(error.contains(words), "{error}");
    let out_of_plane = Bar { start: "ideal", ..out_of_plane };
    let error = start_error(&four_bar(&out_of_plane));
    let words = "as given and cannot be closed: remaining gaps: B by 5 mm along y (no joint can move that way)";
    assert!(error.contains(words), "{error}");
    // A reversed axis satisfies every constraint row, but contradicts the file.
    let flipped = REVOLUTE.to_owned() + "rotation = { axis = [1, 0, 0], angle = \"180 deg\" }\n";
    let error = start_error(&four_bar(&PLAIN).replace(REVOLUTE, &flipped));
    assert!(error.contains("turned against it by 180 deg as given"), "{error}");
    let ideal = Bar { start: "ideal", ..PLAIN };
    let error = start_error(&four_bar(&ideal).replace(REVOLUTE, &flipped));
    assert!(error.contains("remaining gaps: B by 180 deg"), "{error}");
    let conflicting = Bar { driven: [Some(12.0), Some(30.0)], ..PLAIN };
    let error = start_error(&four_bar(&conflicting));
    assert!(error.contains("joint B: at the speeds of the drives it opens at"), "{error}");
}

#[test]
fn a_guessed_pose_is_assembled_and_displacements_are_reported() {
    let coupler_offset = 8_f64.to_radians();
    let guess = Bar { start: "ideal", driven: [Some(12.0), None], coupler_offset, ..PLAIN };
    for start in ["ideal", "settled"] {
        let text = four_bar(&Bar { start, ..guess });
        let mut simulation = Simulation::new(&parse(&text, &[]).machine).unwrap();
        let assembly = simulation.mechanism().assembly();
        let (joint, gap) = assembly.widest.unwrap();
        let chord = 2.0 * BAR[1] * (0.5 * coupler_offset).sin();
        assert!(joint == 0 && (gap - chord).abs() < 1e-12, "{gap} {chord}");
        assert!((assembly.bodies[1].turned - coupler_offset).abs() < 1e-9);
        assert_eq!(assembly.bodies.len(), 3);
        // Hinges keep the bodies parallel to the plane at any angle.
        assert!(assembly.most_turned.unwrap().1 < 1e-12);
        let frame = frame_now(&mut simulation);
        assert!(loop_residual(&frame) < 1e-12);
    }
}

/// Loop-closing joints weld the legs of a pattern to a hub outside it, with the leg as parent and as child.
#[test]
fn loops_of_a_pattern_close_in_every_instance() {
    for (parent, child) in [("leg", "hub"), ("hub", "leg")] {
        let points = match parent {
            "leg" => "parent_point = \"0 0 -50 mm\"\nchild_point = \"100 0 20 mm\"",
            _ => "parent_point = \"100 0 20 mm\"\nchild_point = \"0 0 -50 mm\"",
        };
        let text = format!(
            "[gravity]\nz = \"-9.81 m/s^2\"\n\
             [[body]]\nname = \"hub\"\nmass = \"1 kg\"\ninertia = \"2e-3 3e-3 4e-3 kg m^2\"\n\
             [[joint]]\nname = \"hub\"\nkind = \"free\"\nchild = \"hub\"\n\
             start = {{ position = [0, 0, 0], angular_velocity = \"0 0 3 rad/s\" }}\n\
             [[pattern]]\nname = \"legs\"\ncount = 3\nabout = {{ axis = [0, 0, 1] }}\n\
             [[pattern.body]]\nname = \"leg\"\nmass = \"0.2 kg\"\ninertia = \"2e-4 2e-4 1e-4 kg m^2\"\n\
             [[pattern.joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"leg\"\nchild_point = \"0 0 -50 mm\"\n\
             start = {{ position = \"100 0 20 mm\", velocity = \"0 300 0 mm/s\", angular_velocity = \"0 0 3 rad/s\" }}\n\
             [[pattern.joint]]\nname = \"weld\"\nkind = \"fixed\"\nparent = \"{parent}\"\nchild = \"{child}\"\n{points}\ncloses_loop = true\n"
        );
        formulations::check("pattern", &text);
        let mut simulation = start_simulation(&text, &[]);
        assert_eq!(simulation.mechanism().summary().degrees_of_freedom, 6);
        run_until(&mut simulation, 0.02);
        let frame = frame_now(&mut simulation);
        let hub = &frame.bodies[0];
        for (k, leg) in (0..).zip(&frame.bodies[1..]) {
            let third = rotation_about(Vec3::z(), f64::from(k) * std::f64::consts::TAU / 3.0);
            let third: Mat3 = hub.rotation * third.to_rotation_matrix().into_inner();
            let error = (leg.rotation - third).amax();
            assert!(error < 1e-6, "{parent} {k}: {error:e}");
            let ends = [
                hub.position + third * Vec3::new(0.1, 0.0, 0.02),
                leg.position + leg.rotation * Vec3::new(0.0, 0.0, -0.05),
            ];
            assert!((ends[0] - ends[1]).norm() < 1e-6, "{parent} {k}");
        }
        // The assembly falls as one body.
        let parts = frame.bodies.iter().zip([1.0, 0.2, 0.2, 0.2]);
        let parts = parts.map(|(body, mass)| body.acceleration * (mass / 1.6));
        let falls = parts.sum::<Vec3>() + Vec3::new(0.0, 0.0, G);
        assert!(falls.norm() < 1e-6, "{falls}");
    }
}
