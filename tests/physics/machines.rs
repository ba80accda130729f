//! The machines among the built-in scenes, each against an independent reference: inverse kinematics in closed form, loop
//! equations, a linear model; and with one joint loose against an independent solver.

use super::independent::compare_with_other_solver;
use crate::common::{Changes, MACHINES, SCENES, frame_now, parse, run_until, scene, simulation};
use jointplay_physics::machine::{Machine, Mat3, Vec3};
use jointplay_physics::simulate::{ContactMode, Frame, Simulation};
use jointplay_scene::{BUILT_IN, Value};
use std::f64::consts::{PI, TAU};

const IDEAL: (&str, &str) = ("contact.clearance", "0");
/// Largest residual of the energy balance, relative to the energy exchanged.
const ENERGY_TOLERANCE: f64 = 1e-4;

#[test]
fn the_list_of_built_in_scenes_is_complete() {
    assert_eq!([&SCENES[..], &MACHINES].concat(), BUILT_IN);
}

/// Pose of body `name`: position and rotation matrix.
fn pose(machine: &Machine, frame: &Frame, name: &str) -> (Vec3, Mat3) {
    let at = machine.bodies.iter().position(|body| body.name == name);
    let body = &frame.bodies[at.expect("a body of this name")];
    (body.position, body.rotation)
}

/// Calls `check` with frames of an ideal run of `name` at instants up to `end`; `more` are further changes.
fn check_ideal_run(name: &str, more: &Changes, end: f64, check: impl Fn(&Machine, &Frame)) {
    let changes = [&[IDEAL], more].concat();
    let mut simulation = simulation(name, &changes);
    let machine = simulation.machine().clone();
    let mut frame = Frame::default();
    for n in 0..=16 {
        let time = end * f64::from(n) / 16.0;
        simulation.advance_to(time).unwrap();
        simulation.sample(time, &mut frame);
        for joint in &frame.joints {
            assert_eq!(joint.state, ContactMode::Ideal, "{name}");
            assert!(joint.eccentricity.norm() < 1e-9, "{name} at {time} s");
        }
        check(&machine, &frame);
    }
}

/// The angle t with a cos t + b sin t = c; `side` (1 or -1) selects the solution.
fn solve_angle(a: f64, b: f64, c: f64, side: f64) -> f64 {
    b.atan2(a) + side * (c / a.hypot(b)).acos()
}

/// Radial and tangential unit vectors at a polar angle of `degrees`.
fn polar_basis(degrees: f64) -> (Vec3, Vec3) {
    let (sin, cos) = degrees.to_radians().sin_cos();
    (Vec3::new(cos, sin, 0.0), Vec3::new(-sin, cos, 0.0))
}

#[test]
fn cranks_of_the_hexapod_agree_with_inverse_kinematics() {
    // Twice the source's dimensions, m and degrees: radii of hinges and sockets and their angles from the axis of their pair; crank, leg.
    let (base, base_off) = (0.15399, 22.9492);
    let (hub, hub_off) = (0.09961, 48.4099);
    let (crank, leg) = (0.030, 0.280_f64);
    for (swing, rate) in [(30.0_f64, 1.0), (45.0, 2.0)] {
        let (swing_text, rate_text) = (format!("{swing} deg"), format!("{rate} Hz"));
        let changes = [("parameter.swing", &*swing_text), ("parameter.rate", &*rate_text)];
        check_ideal_run("hexapod", &changes, 1.0, |scene, frame| {
            let (centre, axes) = pose(scene, frame, "platform");
            for number in 1..=6 {
                // Pair axes are at 90, 210 and 330 degrees; even legs come before their axis, odd ones after it.
                let side = if number % 2 == 1 { 1.0 } else { -1.0 };
                let axis = 60.0 * f64::from(number - 1) - side * 30.0;
                let socket = centre + axes * polar_basis(axis + side * hub_off).0 * hub;
                let hinge = polar_basis(axis + side * base_off).0 * base;
                // A crank points along the tangent, towards the axis of its pair; its ball is a leg's length from the socket.
                let along = polar_basis(axis).1 * -side;
                let from = socket - hinge;
                let c = from.norm_squared() + crank * crank - leg * leg;
                let (a, b) = (2.0 * crank * from.dot(&along), 2.0 * crank * from.z);
                let angle = solve_angle(a, b, c, 1.0);
                let angle = (angle + PI).rem_euclid(TAU) - PI;
                let phase = f64::from(number) * PI / 3.0;
                let driven = swing.to_radians() * (TAU * rate * frame.time + phase).sin();
                // Error at the crank's ball, m.
                let error = crank * (angle - driven);
                assert!(error.abs() < 1e-9, "{number}, {} s: {error:e} m", frame.time);
            }
        });
    }
}

#[test]
fn arms_of_the_delta_agree_with_inverse_kinematics() {
    // From the source's table: sides of the triangles of base and platform, arms, rods.
    let (base, platform, length, rod) = (0.567, 0.076, 0.524, 1.244_f64);
    // The motors' axes lie on the base's inscribed circle, the sockets on the platform's circumscribed circle.
    let (motor, socket) = (base / 12_f64.sqrt(), platform / 3_f64.sqrt());
    for (swing, lift) in [(0.25, 0.0), (0.5, 0.4)] {
        let (swing_text, lift_text) = (format!("{swing} rad"), format!("{lift} rad"));
        let changes = [("parameter.swing", &*swing_text), ("parameter.lift", &*lift_text)];
        check_ideal_run("delta", &changes, 1.0 / 1.5, |scene, frame| {
            let (centre, axes) = pose(scene, frame, "platform");
            let tilt = (axes - Mat3::identity()).amax();
            assert!(tilt < 1e-9, "the platform tilts by {tilt:e}");
            for arm in 0..3 {
                let (outward, along) = polar_basis(120.0 * f64::from(arm));
                // From the motor's axis to the platform's sockets, in the arm's plane, and the rod's projection onto it.
                let (x, z) = (centre.dot(&outward) + socket - motor, centre.z);
                let flat = rod.powi(2) - centre.dot(&along).powi(2);
                let (a, b) = (2.0 * length * x, -2.0 * length * z);
                let c = x * x + z * z + length * length - flat;
                let angle = solve_angle(a, b, c, -1.0);
                let phase = f64::from(arm) * TAU / 3.0;
                let driven = lift + swing * (TAU * 1.5 * frame.time + phase).sin();
                let error = angle - driven;
                assert!(error.abs() < 1e-8, "arm {arm}, {} s: {error:e} rad", frame.time);
            }
            // The scene's description promises a circle; it is one within 2 %.
            let radius = centre.xy().norm();
            assert!(lift != 0.0 || (radius / 0.215 - 1.0).abs() < 0.02);
        });
    }
}

#[test]
fn the_springs_of_the_delta_reduce_impacts_of_its_rods() {
    // Counts impacts after those of the start.
    let impacts = |grip: &str| {
        let mut simulation = simulation("delta", &[("parameter.grip", grip)]);
        simulation.advance_to(0.1).unwrap();
        let before: u64 = simulation.statistics().impacts();
        simulation.advance_to(0.3).unwrap();
        simulation.statistics().impacts() - before
    };
    let (gripped, free) = (impacts("50 N"), impacts("0.001 N"));
    assert!(2 * gripped < free, "{gripped} impacts with springs, {free} without");
}

#[test]
fn the_rocker_of_the_four_bar_obeys_the_loop_equation() {
    const HINGE: f64 = 0.150;
    const ROCKER: f64 = 0.120;
    for (crank, coupler) in [(0.050, 0.120), (0.060, 0.140)] {
        let (crank_text, coupler_text) = (format!("{crank} m"), format!("{coupler} m"));
        let changes = [("parameter.crank", &*crank_text), ("parameter.coupler", &*coupler_text)];
        check_ideal_run("four-bar", &changes, TAU / 10.0, |scene, frame| {
            let cos = (10.0 * frame.time).cos();
            // The rocker's angle is about Y from hanging straight down; its ball is on the +X side.
            let squares = ROCKER.powi(2) + HINGE.powi(2) + crank * crank - coupler * coupler;
            let angle = solve_angle(HINGE, -crank * cos, squares / (2.0 * ROCKER), -1.0);
            let axes = pose(scene, frame, "rocker").1;
            let error = axes[(0, 2)].atan2(axes[(2, 2)]) - angle;
            assert!(error.abs() < 1e-9, "{} s: {error:e} rad", frame.time);
            // The source gives this angle from the line of the hinges to a hundredth of a degree.
            if frame.time == 0.0 && crank == 0.050 {
                assert!((180.0 + angle.to_degrees() - 112.77).abs() < 0.005);
            }
        });
    }
}

#[test]
fn the_ram_of_the_press_follows_from_two_circles() {
    // A quarter of the source's dimensions, m: both links, the connecting rod, the crank's hinge relative to the upper link's.
    const LINK: f64 = 0.830 / 4.0;
    const ROD: f64 = 0.920 / 4.0;
    const CRANK_HINGE: [f64; 2] = [0.730 / 4.0, -0.7375 / 4.0];
    for crank in [0.020, 0.046875, 0.050] {
        let text = format!("{crank} m");
        let changes = [("parameter.crank", &*text)];
        check_ideal_run("press", &changes, 0.5, |scene, frame| {
            let (sin, cos) = (2.0 * TAU * frame.time).sin_cos();
            // The knee lies on circles about the crank's pin and about the crown, left of the line between them.
            let pin = [CRANK_HINGE[0] - crank * cos, CRANK_HINGE[1] - crank * sin];
            let c = pin[0].powi(2) + pin[1].powi(2) + LINK.powi(2) - ROD.powi(2);
            // Angle from the vertical, positive to the right.
            let swing = solve_angle(-2.0 * LINK * pin[1], 2.0 * LINK * pin[0], c, -1.0);
            let error = pose(scene, frame, "ram").0.z + 2.0 * LINK * swing.cos();
            assert!(error.abs() < 1e-9, "{} s: {error:e} m", frame.time);
            // The hinge that closes the loop.
            let (rod, link) = (pose(scene, frame, "connecting-rod"), pose(scene, frame, "upper-link"));
            let of_rod = rod.0 + rod.1 * Vec3::new(-ROD, 0.0, 0.0);
            let of_link = link.0 + link.1 * Vec3::new(0.0, 0.0, -LINK);
            let knee = Vec3::new(LINK * swing.sin(), 0.0, -LINK * swing.cos());
            let error = (of_rod - knee).norm().max((of_link - knee).norm());
            assert!(error < 1e-9, "{} s: {error:e} m", frame.time);
        });
    }
}

/// At the bottom the ram rests on both ends of the lower link: with play it is higher by the clearances of wrist and knee and their
/// deformations.
#[test]
fn play_lifts_the_ram_of_the_press_at_the_bottom() {
    let bottom = |clearance: &str| {
        let changes = [("contact.clearance", clearance), ("parameter.speed", "20 rpm")];
        let mut simulation = simulation("press", &changes);
        // Half a turn, slow enough that nothing rattles.
        run_until(&mut simulation, 1.5);
        let machine = simulation.machine().clone();
        pose(&machine, &frame_now(&mut simulation), "ram").0.z
    };
    let lift = bottom("0.1 mm") - bottom("0");
    assert!((2.0e-4..2.3e-4).contains(&lift), "{lift:e} m");
}

#[test]
fn the_block_of_the_worn_slider_crank_follows_from_crank_and_rod() {
    for (crank, rod) in [(0.050, 0.150), (0.030, 0.180)] {
        let text = [crank, rod].map(|length| format!("{length} m"));
        let changes = [("parameter.crank", &*text[0]), ("parameter.rod", &*text[1])];
        check_ideal_run("slider-crank-worn", &changes, 0.35, |scene, frame| {
            // 240 rpm.
            let (sin, cos) = (TAU * frame.time * 240.0 / 60.0).sin_cos();
            let (position, axes) = pose(scene, frame, "block");
            let expected = Vec3::new(crank * cos + (rod * rod - (crank * sin).powi(2)).sqrt(), 0.0, 0.0);
            let error = (position - expected).norm();
            assert!(error < 1e-9, "{} s: {error:e} m", frame.time);
            assert!((axes - Mat3::identity()).norm() < 1e-8, "{} s", frame.time);
        });
    }
}

/// Without play the teeth of the excavator stay in its plane. With it they cannot leave it farther than the pins tilt: each by twice
/// its play and the depths of its two ends over its length, about the shortest line from its axis to the teeth; and while the load is
/// largest, they reach this bound but for the part of the play that the weight takes.
#[test]
fn the_teeth_of_the_excavator_stray_by_the_tilt_of_its_pins() {
    const LENGTH: f64 = 0.080;
    check_ideal_run("excavator", &[], 2.0, |scene, frame| {
        let across = pose(scene, frame, "bucket").0.y;
        assert!(across.abs() < 1e-9, "{} s: {across:e} m", frame.time);
    });
    for changes in [&[][..], &[("joint.stick-pin.play.radial", "0")], &[("joint.boom-pin.play.radial", "0.2 mm")]] {
        let mut simulation = simulation("excavator", changes);
        let machine = simulation.machine().clone();
        for quarter in 1..8 {
            run_until(&mut simulation, 0.25 * f64::from(quarter));
            let frame = frame_now(&mut simulation);
            let teeth = pose(&machine, &frame, "bucket").0;
            let bound: f64 = frame
                .joints
                .iter()
                .map(|joint| {
                    let arm = (teeth - joint.socket_centre).xz().norm();
                    2.0 * (joint.clearance + joint.penetration.max(0.0)) / LENGTH * arm
                })
                .sum();
            let share = teeth.y.abs() / bound;
            println!("{changes:?}, {} s: {:.3} mm, {share:.4} of the bound", frame.time, 1e3 * teeth.y);
            // The bound holds for small angles; their squares are 2e-4.
            assert!(share < 1.001, "{changes:?}, {} s: {share}", frame.time);
            if quarter % 4 == 2 {
                assert!(share > 0.95, "{changes:?}, {} s: {share}", frame.time);
            }
        }
    }
}

/// Stiffnesses of the suspension's coil spring and tyre, N/m.
const COIL: f64 = 167_062.0;
const TYRE: f64 = 326_332.0;

/// Masses, kg, with their centroids, m.
type PointMasses = [(f64, Vec3); 5];
/// Inertia tensors, kg m^2, with the rotations of their parts.
type RotatingParts = [(Mat3, Mat3); 4];

/// `point` turned by `angle` about the line through `on` along `axis`.
fn rotated_point(point: Vec3, on: Vec3, axis: Vec3, angle: f64) -> Vec3 {
    on + rotation_matrix(axis, angle) * (point - on)
}

fn rotation_matrix(axis: Vec3, angle: f64) -> Mat3 {
    *nalgebra::Rotation3::from_axis_angle(&nalgebra::Unit::new_normalize(axis), angle).matrix()
}

/// The smallest rotation of `point` about the line through `on` along `axis` that brings it to `distance` from `other`.
fn angle_to_distance(distance: f64, other: Vec3, point: Vec3, on: Vec3, axis: Vec3) -> f64 {
    let (axis, arm) = (axis.normalize(), point - on);
    let along = axis * axis.dot(&arm);
    let (across, seat) = (arm - along, on + along - other);
    let c = distance * distance - seat.norm_squared() - across.norm_squared();
    let (a, b) = (2.0 * seat.dot(&across), 2.0 * seat.dot(&axis.cross(&across)));
    [1.0, -1.0]
        .map(|side| {
            let angle = solve_angle(a, b, c, side);
            (angle + PI).rem_euclid(TAU) - PI
        })
        .into_iter()
        .min_by(|a, b| a.abs().total_cmp(&b.abs()))
        .unwrap()
}

/// An independent model of the suspension from its source, with the height of the body and the angle of the lower arm as coordinates.
struct Corner;

impl Corner {
    const SPRUNG: f64 = 538.9;
    const LOWER_HINGE: Vec3 = Vec3::new(0.0, 0.307, 0.0);
    const LOWER_BALL: Vec3 = Vec3::new(-0.036, 0.787, -0.118);
    const UPPER_HINGE: Vec3 = Vec3::new(-0.048, 0.446, 0.245);
    const UPPER_BALL: Vec3 = Vec3::new(-0.053, 0.716, 0.215);
    const INNER: Vec3 = Vec3::new(-0.250, 0.448, 0.054);
    const OUTER: Vec3 = Vec3::new(-0.176, 0.821, -0.016);
    const WHEEL: Vec3 = Vec3::new(-0.040, 0.910, -0.026);

    /// Centroids with masses, and inertias with rotations.
    fn parts(z: f64, theta: f64) -> (PointMasses, RotatingParts) {
        let up = Vec3::new(0.0, 0.0, z);
        // All points are relative to the body; `up` adds its height at the end.
        let lower_axes = rotation_matrix(Vec3::x(), theta);
        let lower = Self::LOWER_HINGE + lower_axes * (Self::LOWER_BALL - Self::LOWER_HINGE);
        let hinge = Vec3::new(0.220, -0.032, 0.049);
        let ball_distance = (Self::UPPER_BALL - Self::LOWER_BALL).norm();
        let phi = angle_to_distance(ball_distance, lower, Self::UPPER_BALL, Self::UPPER_HINGE, hinge);
        let upper = rotated_point(Self::UPPER_BALL, Self::UPPER_HINGE, hinge, phi);
        // The upright is tilted with the line of its balls, then rotated about it until the tie rod has its length.
        let line = upper - lower;
        let before = Self::UPPER_BALL - Self::LOWER_BALL;
        let tilt = nalgebra::Rotation3::rotation_between(&before, &line).unwrap();
        let outer = lower + tilt * (Self::OUTER - Self::LOWER_BALL);
        let length = (Self::OUTER - Self::INNER).norm();
        let steer_angle = angle_to_distance(length, Self::INNER, outer, lower, line);
        let axes = rotation_matrix(line, steer_angle) * tilt.matrix();
        let of_upright = |point: Vec3| up + lower + axes * (point - Self::LOWER_BALL);
        // The spin of the tie rod is left out; it moves nothing else.
        let rod = rotated_point(outer, lower, line, steer_angle) - Self::INNER;
        let along = Self::OUTER - Self::INNER;
        let rod_axes = nalgebra::Rotation3::rotation_between(&along, &rod).unwrap();
        let of_lower = |point: Vec3| rotated_point(point, Self::LOWER_HINGE, Vec3::x(), theta);
        let of_upper = |point: Vec3| rotated_point(point, Self::UPPER_HINGE, hinge, phi);
        // A flat part in the plane of three points, with this moment about any line in the plane.
        let plate = |moment: f64, a: Vec3, b: Vec3, c: Vec3| {
            let normal = (b - a).cross(&(c - a)).normalize();
            (Mat3::identity() + normal * normal.transpose()) * moment
        };
        let of_lower_arm = plate(0.4, Self::LOWER_HINGE, Self::LOWER_HINGE + Vec3::x(), Self::LOWER_BALL);
        let of_upper_arm = plate(0.03, Self::UPPER_HINGE, Self::UPPER_HINGE + hinge, Self::UPPER_BALL);
        // Masses of the upright and, 159 mm further out, of spindle, wheel and tyre.
        let (knuckle, rolling) = (19.45, 14.705 + 18.8 + 37.6);
        let steiner = knuckle * rolling / (knuckle + rolling) * 0.159_f64.powi(2);
        let across = 0.04117 + 0.4634 + 3.84 + steiner;
        let of_wheel = Vec3::new(0.1656 + across, 0.1934 + 0.07352 + 0.6243 + 6.69, 0.04367 + across);
        let direction = along.normalize();
        let thin = Mat3::identity() - direction * direction.transpose();
        let of_rod = thin * (6.0 * length * length / 12.0 + 6.0 * 0.02_f64.powi(2) / 4.0)
            + direction * direction.transpose() * (6.0 * 0.02_f64.powi(2) / 2.0);
        (
            [
                (Self::SPRUNG, up),
                (23.965, up + of_lower(Vec3::new(0.0, 0.547, -0.059))),
                (5.813, up + of_upper(Vec3::new(-0.106, 0.589, 0.218))),
                (knuckle + rolling, of_upright(Self::WHEEL - Vec3::y() * (0.159 * knuckle / (knuckle + rolling)))),
                (6.0, up + Self::INNER + 0.5 * rod),
            ],
            [
                (of_lower_arm, lower_axes),
                (of_upper_arm, rotation_matrix(hinge, phi)),
                (Mat3::from_diagonal(&of_wheel), axes),
                (of_rod, *rod_axes.matrix()),
            ],
        )
    }

    /// The wheel's centre.
    fn wheel(z: f64, theta: f64) -> Vec3 {
        let (masses, rotating) = Self::parts(z, theta);
        let out = 0.159 * 19.45 / masses[3].0;
        masses[3].1 + rotating[2].1 * Vec3::new(0.0, out, 0.0)
    }

    /// Length of the coil spring.
    fn coil(theta: f64) -> f64 {
        let seat = rotated_point(Vec3::new(0.097, 0.543, -0.047), Self::LOWER_HINGE, Vec3::x(), theta);
        (seat - Vec3::new(0.104, 0.510, 0.197)).norm()
    }

    fn weight(z: f64, theta: f64) -> f64 {
        let (masses, _) = Self::parts(z, theta);
        masses.iter().map(|(mass, at)| mass * 9.81 * at.z).sum()
    }

    fn potential(z: f64, theta: f64) -> f64 {
        // In the design pose the tyre carries the whole weight; the spring's preload follows by virtual work.
        let all: f64 = Self::parts(0.0, 0.0).0.iter().map(|(mass, _)| mass * 9.81).sum();
        let slope = |f: &dyn Fn(f64) -> f64| (f(1e-5) - f(-1e-5)) / 2e-5;
        let raised = slope(&|theta| Self::weight(0.0, theta) - all * Self::wheel(0.0, theta).z);
        let preload = -raised / slope(&Self::coil);
        let change = Self::coil(theta) - Self::coil(0.0);
        let pressed = all / TYRE - (Self::wheel(z, theta).z - Self::WHEEL.z);
        Self::weight(z, theta) + preload * change + 0.5 * COIL * change * change + 0.5 * TYRE * pressed * pressed
    }

    /// Mass and stiffness matrices of small motion about rest: elements (11, 12, 22) of each.
    fn linear() -> ([f64; 3], [f64; 3]) {
        let h = 1e-5;
        // Mass-weighted velocities and angular velocities for a unit rate of one coordinate.
        let rates = |step: [f64; 2]| {
            let (after, before) = (Self::parts(step[0] * h, step[1] * h), Self::parts(-step[0] * h, -step[1] * h));
            let speeds = std::array::from_fn::<_, 5, _>(|n| {
                let mass: f64 = after.0[n].0;
                (after.0[n].1 - before.0[n].1) * (mass.sqrt() / (2.0 * h))
            });
            let spins = std::array::from_fn::<_, 4, _>(|n| {
                let spin: Mat3 = (after.1[n].1 - before.1[n].1) / (2.0 * h);
                Vec3::new(spin[(2, 1)], spin[(0, 2)], spin[(1, 0)])
            });
            (speeds, spins)
        };
        let inertias = Self::parts(0.0, 0.0).1.map(|(inertia, _)| inertia);
        let (a, b) = (rates([1.0, 0.0]), rates([0.0, 1.0]));
        let product = |a: &([Vec3; 5], [Vec3; 4]), b: &([Vec3; 5], [Vec3; 4])| -> f64 {
            let speeds: f64 = a.0.iter().zip(&b.0).map(|(a, b)| a.dot(b)).sum();
            let spins = (0..4).map(|n| a.1[n].dot(&(inertias[n] * b.1[n])));
            speeds + spins.sum::<f64>()
        };
        let v = |z: f64, theta: f64| Self::potential(z * 1e-4, theta * 1e-4) / 1e-8;
        let middle = v(0.0, 0.0);
        let corners = v(1.0, 1.0) - v(1.0, -1.0) - v(-1.0, 1.0) + v(-1.0, -1.0);
        (
            [product(&a, &a), product(&a, &b), product(&b, &b)],
            [v(1.0, 0.0) - 2.0 * middle + v(-1.0, 0.0), 0.25 * corners, v(0.0, 1.0) - 2.0 * middle + v(0.0, -1.0)],
        )
    }

    /// Natural frequencies, Hz, and shapes (z, theta), the lower first.
    fn modes() -> [(f64, [f64; 2]); 2] {
        let (m, k) = Self::linear();
        // det(K - w^2 M) = 0.
        let a = m[0] * m[2] - m[1] * m[1];
        let b = -(m[0] * k[2] + m[2] * k[0] - 2.0 * m[1] * k[1]);
        let c = k[0] * k[2] - k[1] * k[1];
        [-1.0, 1.0].map(|side: f64| {
            let square = (-b + side * (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
            let shape = [-(k[1] - square * m[1]), k[0] - square * m[0]];
            (square.sqrt() / TAU, shape)
        })
    }
}

#[test]
fn the_suspension_oscillates_as_its_linear_model() {
    let (m, _) = Corner::linear();
    let modes = Corner::modes();
    // Without dampers, on a flat road; a slightly smaller wheel starts it off its rest position.
    let mut simulation = simulation(
        "suspension",
        &[
            IDEAL,
            ("parameter.bump", "0 mm"),
            ("spring.damper.damping", "1e-6 N s/m"),
            ("tyre.tyre.damping", "0 N s/m"),
            ("tyre.tyre.radius", "468 mm"),
        ],
    );
    let machine = simulation.machine().clone();
    let mut frame = Frame::default();
    let samples: Vec<[f64; 2]> = (0..=12_000)
        .map(|n| {
            let time = f64::from(n) * 0.5e-3;
            simulation.advance_to(time).unwrap();
            simulation.sample(time, &mut frame);
            let axes = pose(&machine, &frame, "lower-arm").1;
            let z = pose(&machine, &frame, "chassis").0.z;
            [z, axes[(2, 1)].atan2(axes[(1, 1)])]
        })
        .collect();
    for (frequency, shape) in modes {
        // Modes are orthogonal under the mass matrix: this projection leaves one of them.
        let weights = [m[0] * shape[0] + m[1] * shape[1], m[1] * shape[0] + m[2] * shape[1]];
        let mode = samples.iter().map(|x| weights[0] * x[0] + weights[1] * x[1]);
        let mode: Vec<f64> = mode.collect();
        let (min, max) = mode.iter().fold((f64::MAX, f64::MIN), |(a, b), &x| (a.min(x), b.max(x)));
        let centre = 0.5 * (min + max);
        let crossings: Vec<f64> = (1..mode.len())
            .filter(|&n| mode[n - 1] < centre && mode[n] >= centre)
            .map(|n| n as f64 - (mode[n] - centre) / (mode[n] - mode[n - 1]))
            .collect();
        let periods = crossings.len() - 1;
        let measured = periods as f64 / (0.5e-3 * (crossings[periods] - crossings[0]));
        println!("{measured} Hz, linear model {frequency} Hz, {periods} periods");
        assert!(periods >= 6);
        assert!((measured / frequency - 1.0).abs() < 5e-3, "{measured} {frequency}");
    }
    // The frequencies in the scene's help text.
    assert!((modes[0].0 - 1.1).abs() < 0.1 && (modes[1].0 - 9.3).abs() < 0.5, "{modes:?}");
}

#[test]
fn the_suspension_rests_in_its_design_pose_and_play_allows_toe_change() {
    let flat_road = [IDEAL, ("parameter.bump", "0 mm")];
    for sprung in ["400 kg", "538.9 kg", "800 kg"] {
        let changes = [&flat_road[..], &[("parameter.sprung", sprung)]].concat();
        let mut simulation = simulation("suspension", &changes);
        run_until(&mut simulation, 0.5);
        let displacement = frame_now(&mut simulation).pose.position;
        assert!(displacement.norm() < 1e-6, "{sprung}: {displacement:?}");
    }
    // Range of the toe angle, the upright's angle about Z.
    let toe_range = |changes: &Changes| {
        let mut simulation = simulation("suspension", changes);
        let (mut frame, mut min, mut max) = (Frame::default(), f64::MAX, f64::MIN);
        for n in 0..=200 {
            let time = 1e-3 * f64::from(n);
            simulation.advance_to(time).unwrap();
            simulation.sample(time, &mut frame);
            let axes = pose(simulation.machine(), &frame, "upright").1;
            let toe = axes[(1, 0)].atan2(axes[(0, 0)]);
            (min, max) = (min.min(toe), max.max(toe));
        }
        max - min
    };
    let (ideal, loose) = (toe_range(&[IDEAL]), toe_range(&[]));
    let worn = toe_range(&[("joint.outer.clearance", "1.5 mm")]);
    println!("toe moves by {ideal:e}, {loose:e}, {worn:e} rad");
    assert!(loose > 5.0 * ideal && worn > 1.2 * loose, "{ideal:e} {loose:e} {worn:e}");
}

/// A longer tie rod turns the front of the wheel inward, as the scene's help text says.
#[test]
fn the_tie_rod_sets_the_toe() {
    let toe = |length: &str| {
        let mut simulation = simulation("suspension", &[IDEAL, ("parameter.tie_rod", length)]);
        let machine = simulation.machine().clone();
        let axes = pose(&machine, &frame_now(&mut simulation), "upright").1;
        axes[(1, 0)].atan2(axes[(0, 0)])
    };
    assert!(toe("0 mm").abs() < 1e-9);
    assert!(toe("-2 mm") > 0.01 && toe("2 mm") < -0.01);
}

#[test]
fn each_machine_with_one_loose_joint_moves_the_same_under_another_solver() {
    for (name, joint, end) in [
        ("hexapod", "A6", 0.010),
        ("delta", "B2", 0.003),
        ("four-bar", "A", 0.012),
        ("suspension", "lower", 0.004),
        ("press", "wrist", 0.030),
    ] {
        let key = format!("joint.{joint}.clearance");
        // The other solver uses the speed at the onset of contact, not the largest one since.
        let start = ("contact.approach_speed", "start");
        let changes = [IDEAL, (&*key, "0.1 mm"), start];
        let (contacts, error) = compare_with_other_solver(name, &changes, end);
        assert!(contacts >= 1, "{name}");
        assert!(error < 1e-9, "{name}: {error:e}");
    }
}

#[test]
fn each_machine_balances_its_energy_in_both_formulations() {
    for name in MACHINES {
        for (form, end) in [("tree", 0.015), ("lagrange", 0.009)] {
            let changes = [("formulation", form)];
            let mut simulation = simulation(name, &changes);
            run_until(&mut simulation, end);
            let ledger = simulation.ledger().unwrap();
            let residual = ledger.relative_residual().abs();
            assert!(residual < ENERGY_TOLERANCE, "{name}, {form}: {residual:e} {ledger:?}");
            assert!(ledger.exchanged > 0.0 && ledger.drive_work != 0.0, "{name}");
            let impacts: u64 = simulation.statistics().impacts();
            assert!(impacts > 0, "{name}, {form}");
        }
    }
}

#[test]
fn the_machines_raise_no_doubt_with_their_default_settings() {
    for name in MACHINES {
        let mut simulation = simulation(name, &[]);
        run_until(&mut simulation, 0.04);
        assert_eq!(simulation.doubts(), [], "{name}");
        let warnings = simulation.machine().warnings();
        assert!(warnings.is_empty(), "{name}: {warnings:?}");
    }
}

/// A machine assembles at every corner of its parameter ranges.
#[test]
fn each_machine_assembles_at_the_ends_of_its_parameters() {
    for name in MACHINES {
        let plain = scene(name, &[]);
        let mut parameters = plain.parameters();
        parameters.retain(|row| row.scope == jointplay_scene::Scope::Own);
        assert!(!parameters.is_empty(), "{name}");
        for corner in 0..1_u32 << parameters.len() {
            let ends = parameters.iter().enumerate().map(|(n, row)| {
                let jointplay_scene::Kind::Number { min, max, .. } = row.kind else {
                    panic!("{} is no number", row.key)
                };
                let end = if corner >> n & 1 == 1 { max } else { min };
                (row.key, row.write(&Value::Number(end)))
            });
            let ends: Vec<(&str, String)> = ends.collect();
            let mut changes: Vec<(&str, &str)> = ends.iter().map(|(k, v)| (*k, &**v)).collect();
            changes.push(IDEAL);
            let scene = parse(&plain.source.text, &changes);
            let mut simulation =
                Simulation::new(&scene.machine).unwrap_or_else(|error| panic!("{name} {ends:?}: {error}"));
            for joint in frame_now(&mut simulation).joints {
                assert!(joint.eccentricity.norm() < 1e-9, "{name} {ends:?}");
            }
        }
    }
}

/// Up to 2 Hz the tool point deviates by about twice the clearance of 0.1 mm; above, where legs are unloaded, by far more.
#[test]
fn the_tool_point_of_the_hexapod_deviates_by_twice_the_clearance() {
    // Stops early once the deviation exceeds `enough`.
    let deviation = |rate: &str, enough: f64| {
        let loose = [("parameter.rate", rate), ("solver.tolerance", "1e-4"), ("contact.clearance", "0.1 mm")];
        let ideal = [("parameter.rate", rate), IDEAL];
        let mut runs = [simulation("hexapod", &loose), simulation("hexapod", &ideal)];
        let (mut frame, mut max_deviation) = (Frame::default(), 0.0_f64);
        for n in 0..=100 {
            if max_deviation > enough {
                break;
            }
            let time = 0.5 + 0.005 * f64::from(n);
            let [loose, ideal] = runs.each_mut().map(|run| {
                run.advance_to(time).unwrap();
                run.sample(time, &mut frame);
                let (position, axes) = pose(run.machine(), &frame, "platform");
                position + axes * Vec3::new(0.0, 0.0, -0.100)
            });
            max_deviation = max_deviation.max((loose - ideal).norm());
        }
        max_deviation
    };
    let (slow, fast) = (deviation("2 Hz", 2.3e-4), deviation("2.5 Hz", 4e-4));
    assert!(slow > 1.9e-4 && slow < 2.3e-4, "{slow} m");
    assert!(fast > 4e-4, "{fast} m");
}

/// At low speed the rocker sags by less than the clearances of both balls; at high speed it leads and lags by both.
#[test]
fn the_rocker_of_the_four_bar_sags_when_slow_and_leads_and_lags_when_fast() {
    let deviation_range = |speed: f64| {
        let text = format!("{speed} rad/s");
        let mut runs = [&[][..], &[IDEAL]]
            .map(|more: &Changes| simulation("four-bar", &[&[("parameter.speed", &*text)], more].concat()));
        let (mut frame, mut min, mut max) = (Frame::default(), f64::MAX, f64::MIN);
        // From half a turn to one and a half.
        for n in 50..=150 {
            let time = TAU / speed * f64::from(n) / 100.0;
            let [loose, ideal] = runs.each_mut().map(|run| {
                run.advance_to(time).unwrap();
                run.sample(time, &mut frame);
                let axes = pose(run.machine(), &frame, "rocker").1;
                0.120 * axes[(0, 2)].atan2(axes[(2, 2)])
            });
            (min, max) = (min.min(loose - ideal), max.max(loose - ideal));
        }
        (min, max)
    };
    let (slow, fast) = (deviation_range(5.0), deviation_range(20.0));
    assert!(slow.0 > 2e-5 && slow.1 > 1e-4 && slow.1 < 1.5e-4, "{slow:?}");
    assert!(fast.0 < -2e-4 && fast.1 > 2e-4, "{fast:?}");
}
