//! Loops with redundant constraints: independent rows determine the motion, and the reactions have minimum norm.
//!
//! A planar four-bar of hinges closed by a ball joint is compared with an independent model of its geometry and one-coordinate
//! dynamics.

use crate::common::matrix::in_tree;
use crate::common::{frame_now, parse, run_until};
use jointplay_physics::machine::{Quat, Vec3};
use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_scene::Scene;

const G: f64 = 9.81;

/// Lengths of the crank from O, the coupler and the rocker from D = (ground, 0), m; the crank's initial angle, rad, and rate, rad/s.
#[derive(Clone, Copy)]
pub struct FourBar {
    lengths: [f64; 3],
    ground: f64,
    angle: f64,
    rate: f64,
}

/// Masses, kg, and moments of inertia about the centroids, kg m^2, which are in the middle of the links.
const MASS: [f64; 3] = [0.3, 0.5, 0.4];
const INERTIA: [f64; 3] = [4e-4, 3e-3, 2e-3];

/// Grashof: 0.1 + 0.26 < 0.24 + 0.21.
pub const GRASHOF: FourBar = FourBar { lengths: [0.1, 0.26, 0.21], ground: 0.24, angle: 1.0, rate: 12.0 };

type Plane = [f64; 2];

fn along(length: f64, angle: f64) -> Plane {
    [length * angle.cos(), length * angle.sin()]
}

fn cross(a: Plane, b: Plane) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

impl FourBar {
    /// Angles of crank, coupler and rocker from the ground for an angle of the crank, by the cosine rule.
    fn angles(&self, crank: f64) -> [f64; 3] {
        let [a, b, c] = self.lengths;
        let (dx, dy) = (self.ground - a * crank.cos(), -a * crank.sin());
        let reach = dx.hypot(dy);
        let coupler = dy.atan2(dx) + ((b * b + reach * reach - c * c) / (2.0 * b * reach)).acos();
        let rocker = (b * coupler.sin() - dy).atan2(b * coupler.cos() - dx);
        [crank, coupler, rocker]
    }

    /// First derivatives of the angles by the crank's, from the differentiated closure equations.
    fn derivatives(&self, crank: f64) -> [f64; 3] {
        let [a, b, c] = self.lengths;
        let [_, coupler, rocker] = self.angles(crank);
        let s = (coupler - rocker).sin();
        [1.0, a * (rocker - crank).sin() / (b * s), a * (coupler - crank).sin() / (c * s)]
    }

    /// Second derivatives of the angles by the crank's, by five-point differences.
    fn second_derivatives(&self, crank: f64) -> [f64; 3] {
        let h = 1e-3;
        let at = |k: f64| self.derivatives(crank + k * h);
        let (l2, l1, r1, r2) = (at(-2.0), at(-1.0), at(1.0), at(2.0));
        std::array::from_fn(|i| (l2[i] - 8.0 * l1[i] + 8.0 * r1[i] - r2[i]) / (12.0 * h))
    }

    /// Inertia reduced to the crank, and the potential energy.
    fn reduced(&self, crank: f64) -> (f64, f64) {
        let [a, b, c] = self.lengths;
        let (q, s) = (self.angles(crank), self.derivatives(crank));
        // Centroid of the coupler: half way along it from the crank's end.
        let centre = [-a * q[0].sin() - 0.5 * b * s[1] * q[1].sin(), a * q[0].cos() + 0.5 * b * s[1] * q[1].cos()];
        let inertia = INERTIA[0]
            + MASS[0] * 0.25 * a * a
            + INERTIA[1] * s[1] * s[1]
            + MASS[1] * (centre[0] * centre[0] + centre[1] * centre[1])
            + (INERTIA[2] + MASS[2] * 0.25 * c * c) * s[2] * s[2];
        let heights = [0.5 * a * q[0].sin(), a * q[0].sin() + 0.5 * b * q[1].sin(), 0.5 * c * q[2].sin()];
        let potential = heights.iter().zip(MASS).map(|(h, m)| m * G * h).sum();
        (inertia, potential)
    }

    /// Square of the crank's rate by energy.
    fn rate_squared(&self, crank: f64) -> f64 {
        let (i0, v0) = self.reduced(self.angle);
        let (i, v) = self.reduced(crank);
        (i0 * self.rate * self.rate + 2.0 * (v0 - v)) / i
    }

    /// Time from the start to an angle that the crank reaches without reversing, by composite Gauss quadrature.
    fn time_to(&self, crank: f64) -> f64 {
        let pieces = 400;
        let width = (crank - self.angle) / f64::from(pieces);
        let node = (0.6_f64).sqrt();
        let piece = |k: u32| {
            let middle = self.angle + (f64::from(k) + 0.5) * width;
            let inverse_rate = |x: f64| 1.0 / self.rate_squared(middle + 0.5 * width * x).sqrt();
            width / 18.0 * (5.0 * inverse_rate(-node) + 8.0 * inverse_rate(0.0) + 5.0 * inverse_rate(node))
        };
        (0..pieces).map(piece).sum()
    }

    /// Force on the rocker's end in the plane, N, from moments of the rocker about D and of the coupler about A.
    fn reaction(&self, crank: f64) -> Plane {
        let [a, b, c] = self.lengths;
        let (q, s, bend) = (self.angles(crank), self.derivatives(crank), self.second_derivatives(crank));
        let square = self.rate_squared(crank);
        let h = 1e-3;
        let at = |k: f64| self.rate_squared(crank + k * h);
        let slope = (at(-2.0) - 8.0 * at(-1.0) + 8.0 * at(1.0) - at(2.0)) / (12.0 * h);
        let acceleration: [f64; 3] = std::array::from_fn(|i| bend[i] * square + s[i] * 0.5 * slope);
        let point_acceleration = |length: f64, i: usize| {
            let arm = along(length, q[i]);
            let w2 = s[i] * s[i] * square;
            [-acceleration[i] * arm[1] - w2 * arm[0], acceleration[i] * arm[0] - w2 * arm[1]]
        };
        let (end_a, half_b) = (point_acceleration(a, 0), point_acceleration(0.5 * b, 1));
        let needed = [end_a[0] + half_b[0], end_a[1] + half_b[1] + G].map(|x| MASS[1] * x);
        let coupler = INERTIA[1] * acceleration[1] + cross(along(0.5 * b, q[1]), needed);
        let rocker =
            (INERTIA[2] + MASS[2] * 0.25 * c * c) * acceleration[2] + cross(along(0.5 * c, q[2]), [0.0, MASS[2] * G]);
        // cross(coupler, -F) = coupler, cross(rocker, F) = rocker.
        let (u, v) = (along(b, q[1]), along(c, q[2]));
        let determinant = u[0] * v[1] - u[1] * v[0];
        [-(coupler * v[0] + rocker * u[0]) / determinant, -(coupler * v[1] + rocker * u[1]) / determinant]
    }

    /// The scene: the plane is the world's xz plane rotated by `turn`; hinge axes are its -y, so that angles count from x to z.
    pub fn scene(&self, turn: Quat, extras: Extras, changes: &[(&str, &str)]) -> Scene {
        let [a, b, c] = self.lengths;
        let (q, s) = (self.angles(self.angle), self.derivatives(self.angle));
        let (q, s) = (extras.pose.unwrap_or(q), extras.rates.unwrap_or(s));
        let numbers = |v: Vec3, unit: &str| format!("\"{:e} {:e} {:e} {unit}\"", v.x, v.y, v.z);
        let start = |i: usize, position: f64, rate: f64| {
            let law = format!("position = \"{position:e} rad\", velocity = \"{rate:e} rad/s\"");
            if extras.driven.contains(&i) {
                format!("drive = {{ law = \"constant\", {law} }}")
            } else {
                format!("start = {{ {law} }}")
            }
        };
        let quaternion = format!("[{:e}, {:e}, {:e}, {:e}]", turn.w, turn.i, turn.j, turn.k);
        let axis = numbers(turn * -Vec3::y(), "").replace(' ', ", ").replace(", \"", "\"");
        let axis = axis.trim_matches('"').trim_end_matches(',').to_owned();
        let ground = |name: &str, child: &str, at: Vec3, start: String| {
            format!(
                "[[joint]]\nname = \"{name}\"\nkind = \"revolute\"\nchild = \"{child}\"\nparent_point = {}\n\
                 axis = [{axis}]\nrotation = {{ quaternion = {quaternion} }}\n{start}\n",
                numbers(turn * at, "m")
            )
        };
        let body = |i: usize, name: &str| {
            format!(
                "[[body]]\nname = \"{name}\"\nmass = \"{} kg\"\ncentre = \"{:e} 0 0 m\"\ninertia = \"{:e} {:e} {:e} kg m^2\"\n",
                MASS[i],
                0.5 * self.lengths[i],
                0.3 * INERTIA[i],
                INERTIA[i],
                INERTIA[i]
            )
        };
        let g = turn * Vec3::new(0.0, 0.0, -G);
        let rate = self.rate;
        let text = [
            format!("start = \"{}\"\n", extras.start),
            format!("[gravity]\nx = \"{:e} m/s^2\"\ny = \"{:e} m/s^2\"\nz = \"{:e} m/s^2\"\n", g.x, g.y, g.z),
            "[solver]\ntolerance = 1e-9\n".to_owned(),
            body(0, "crank") + &body(1, "coupler") + &body(2, "rocker"),
            ground("O", "crank", Vec3::zeros(), start(0, q[0], rate)),
            format!(
                "[[joint]]\nname = \"A\"\nkind = \"revolute\"\nparent = \"crank\"\nchild = \"coupler\"\n\
                 parent_point = \"{a:e} 0 0 m\"\naxis = [0, -1, 0]\n{}\n",
                start(1, q[1] - q[0], rate * (s[1] - 1.0))
            ),
            ground("D", "rocker", Vec3::new(self.ground, extras.offset, 0.0), start(2, q[2], rate * s[2])),
            format!(
                "[[ball_joint]]\nname = \"B\"\nsocket = {{ body = \"coupler\", at = \"{b:e} 0 0 m\" }}\n\
                 ball = {{ body = \"rocker\", at = \"{c:e} 0 0 m\" }}\nclearance = \"{}\"\n",
                extras.clearance
            ),
        ];
        parse(&text.concat(), changes)
    }
}

/// Variations of the scene.
#[derive(Clone, Copy)]
pub struct Extras {
    pub start: &'static str,
    pub clearance: &'static str,
    pub driven: &'static [usize],
    /// Offset of the rocker's hinge out of the plane, m.
    pub offset: f64,
    pub pose: Option<[f64; 3]>,
    pub rates: Option<[f64; 3]>,
}

pub const PLAIN: Extras =
    Extras { start: "as-given", clearance: "0", driven: &[], offset: 0.0, pose: None, rates: None };

fn tilted() -> Quat {
    Quat::from_euler_angles(0.4, -0.7, 1.1)
}

/// Direction of a body's x axis in the plane, -pi to pi.
fn angle_of(frame: &Frame, turn: Quat, body: usize) -> f64 {
    let x = turn.inverse() * (frame.bodies[body].rotation * Vec3::x());
    assert!(x.y.abs() < 1e-7, "out of the plane by {:e}", x.y);
    x.z.atan2(x.x)
}

fn angle_difference(a: f64, b: f64) -> f64 {
    let d = a - b;
    d.sin().atan2(d.cos()).abs()
}

fn start_error(scene: &Scene) -> String {
    match Simulation::new(&scene.machine) {
        Ok(_) => panic!("started"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn a_four_bar_closed_by_an_ideal_ball_joint_obeys_geometry_and_energy() {
    let bar = GRASHOF;
    for (turn, form) in
        [(Quat::identity(), "tree"), (Quat::identity(), "lagrange"), (tilted(), "tree"), (tilted(), "lagrange")]
    {
        let scene = bar.scene(turn, PLAIN, &[("formulation", form)]);
        let mut simulation = Simulation::new(&scene.machine).unwrap();
        let summary = simulation.mechanism().summary();
        assert_eq!((summary.dependent_rows, summary.degrees_of_freedom), (1, 1));
        assert_eq!(simulation.indeterminate_forces().reactions, [0]);
        let mut travel = 0.0;
        let mut last = bar.angle;
        for k in 1..=12 {
            run_until(&mut simulation, 0.05 * f64::from(k));
            let frame = frame_now(&mut simulation);
            let crank = angle_of(&frame, turn, 0);
            travel += {
                let d = crank - last;
                d.sin().atan2(d.cos())
            };
            last = crank;
            let expected = bar.angles(crank);
            for (body, angle) in expected.iter().enumerate() {
                let error = angle_difference(angle_of(&frame, turn, body), *angle);
                // `lagrange` only stabilises the constraints.
                let limit = if form == "tree" { 1e-11 } else { 1e-7 };
                assert!(error < limit, "{form}, body {body}: {error:e}");
            }
            let w = frame.bodies[0].angular_velocity.norm();
            let rate = bar.rate_squared(crank).sqrt();
            assert!((w - rate).abs() < 1e-6 * bar.rate, "{form}: {w} {rate}");
            let time = bar.time_to(bar.angle + travel);
            let error = time - frame.time;
            assert!(error.abs() < 1e-6, "{form}: {error:e} s at {}", frame.time);
            let force = turn.inverse() * frame.joints[0].normal_force;
            let [x, z] = bar.reaction(crank);
            let error = (force - Vec3::new(x, 0.0, z)).norm();
            assert!(error < 1e-5 * x.hypot(z).max(1.0), "{form}: {force} {x} {z}");
        }
        assert!(travel > 1.0, "the crank turns: {travel}");
    }
}

#[test]
fn every_method_steps_a_planar_loop_ideal_driven_and_with_play() {
    for (clearance, driven) in [("0", &[][..]), ("0", &[0]), ("0.3 mm", &[])] {
        let with = Extras { start: "ideal", clearance, driven, ..PLAIN };
        let reference = {
            let scene = GRASHOF.scene(Quat::identity(), with, &[]);
            let mut simulation = Simulation::new(&scene.machine).unwrap();
            run_until(&mut simulation, 0.02);
            frame_now(&mut simulation)
        };
        for variant in in_tree() {
            let mut simulation =
                Simulation::new(&GRASHOF.scene(Quat::identity(), with, &variant.changes()).machine).unwrap();
            run_until(&mut simulation, 0.02);
            let frame = frame_now(&mut simulation);
            let impacts = simulation.statistics().joints[0].impacts;
            assert_eq!(impacts > 0, clearance != "0");
            for (a, b) in frame.bodies.iter().zip(&reference.bodies) {
                let error = (a.position - b.position).norm();
                // Bounds for first-order methods at 10 us; impacts amplify the differences.
                let limit = if clearance == "0" { 2e-6 } else { 3e-4 };
                assert!(error < limit, "{clearance}, {driven:?}, {variant}: {error:e}");
            }
        }
    }
}

#[test]
fn a_parallelogram_passes_through_flat_poses_but_does_not_start_in_one() {
    let bar = FourBar { lengths: [0.1, 0.24, 0.1], ground: 0.24, angle: 1.0, rate: 20.0 };
    let run = |form, method, tolerance, driven: &'static [usize]| {
        let changes = [
            ("formulation", form),
            ("solver.method", method),
            ("solver.tolerance", tolerance),
            ("solver.step", "50 us"),
        ];
        let with = Extras { driven, ..PLAIN };
        let mut simulation = Simulation::new(&bar.scene(tilted(), with, &changes).machine).unwrap();
        let stopped = simulation.advance_to(0.5).err();
        (simulation, stopped)
    };
    for (method, tolerance) in [("automatic", "1e-6"), ("automatic", "1e-9"), ("radau5", "1e-8"), ("rk4", "1e-6")] {
        for driven in [&[][..], &[0]] {
            let (mut simulation, stopped) = run("tree", method, tolerance, driven);
            let case = format!("{method}, {tolerance}, {driven:?}");
            assert_eq!(stopped, None, "{case}");
            let frame = frame_now(&mut simulation);
            let [crank, coupler, rocker] = [0, 1, 2].map(|b| angle_of(&frame, tilted(), b));
            assert!(angle_difference(crank, rocker) < 1e-9, "{case}: {crank} {rocker}");
            assert!(angle_difference(coupler, 0.0) < 1e-9, "{case}: {coupler}");
            let residual = simulation.ledger().unwrap().relative_residual();
            assert!(residual.abs() < 1e-4, "{case}: {residual}");
        }
    }
    // Stabilised constraints drift near singular poses; the drift is reported and all values stay finite.
    let (mut simulation, stopped) = run("lagrange", "automatic", "1e-6", &[]);
    let frame = frame_now(&mut simulation);
    assert!(frame.bodies.iter().all(|b| b.acceleration.norm().is_finite()));
    let drift = simulation.statistics().constraint_drift;
    assert!(drift < 1e-3 && (stopped.is_some() || drift > 0.0));
    let flat = FourBar { angle: 0.0, ..bar };
    let with = Extras { pose: Some([0.0; 3]), rates: Some([1.0, 0.0, 1.0]), ..PLAIN };
    let error = start_error(&flat.scene(Quat::identity(), with, &[]));
    assert!(error.contains("singular pose: at B"), "{error}");
    // With clearance there is no bifurcation.
    let loose = Extras { clearance: "0.3 mm", ..with };
    for start in ["as-given", "ideal"] {
        let loose = Extras { start, ..loose };
        let mut simulation = Simulation::new(&flat.scene(Quat::identity(), loose, &[]).machine).unwrap();
        run_until(&mut simulation, 0.02);
    }
}

#[test]
fn unclosable_loops_are_refused_with_joint_and_direction() {
    for start in ["as-given", "ideal"] {
        let out_of_plane = Extras { start, offset: 5e-3, ..PLAIN };
        let error = start_error(&GRASHOF.scene(Quat::identity(), out_of_plane, &[]));
        let words = if start == "ideal" {
            "ball joint B: ball and socket centres are 5 mm apart as given and cannot be closed: remaining gaps: B by \
             5 mm along y (no joint"
        } else {
            "5 mm apart as given, and an ideal joint may be open by at most 0.01 mm"
        };
        assert!(error.contains(words), "{error}");
    }
    let short = FourBar { lengths: [0.1, 0.05, 0.05], ..GRASHOF };
    let too_short = Extras { start: "ideal", pose: Some([1.0, 0.2, 2.5]), rates: Some([1.0, 0.0, 0.0]), ..PLAIN };
    let error = start_error(&short.scene(Quat::identity(), too_short, &[]));
    assert!(error.contains("cannot be closed: the parts do not reach"), "{error}");
}

#[test]
fn two_drives_of_a_parallelogram_share_the_load_or_are_refused() {
    let bar = FourBar { lengths: [0.1, 0.24, 0.1], ground: 0.24, angle: 1.0, rate: 4.0 };
    for form in ["tree", "lagrange"] {
        let both = Extras { driven: &[0, 2], ..PLAIN };
        let scene = bar.scene(Quat::identity(), both, &[("formulation", form)]);
        let mut simulation = Simulation::new(&scene.machine).unwrap();
        let indeterminate = simulation.indeterminate_forces();
        assert_eq!((indeterminate.reactions, indeterminate.actuators), (vec![0], vec![0, 1]));
        run_until(&mut simulation, 0.1);
        let frame = frame_now(&mut simulation);
        // A single motor needs the same torque as both together.
        let one_drive = Extras { driven: &[0], ..PLAIN };
        let mut single = Simulation::new(&bar.scene(Quat::identity(), one_drive, &[]).machine).unwrap();
        assert_eq!(single.indeterminate_forces().actuators, [0; 0]);
        run_until(&mut single, 0.1);
        let torque = frame_now(&mut single).actuators[0];
        let sum: f64 = frame.actuators.iter().sum();
        assert!((sum - torque).abs() < 1e-6, "{form}: {sum} {torque}");
        let conflicting = Extras { rates: Some([1.0, 0.0, 1.5]), ..both };
        let scene = bar.scene(Quat::identity(), conflicting, &[("formulation", form)]);
        let error = start_error(&scene);
        assert!(error.contains("ball joint B: at the speeds of the drives it opens"), "{error}");
    }
}

/// A door hung by two ideal ball joints swings as on a hinge; the joints share the redundant axial force equally.
#[test]
fn two_ball_joints_make_a_hinge() {
    let door = "[gravity]\nz = \"-9.81 m/s^2\"\n[solver]\ntolerance = 1e-9\n[contact]\nclearance = 0\n\
                [[body]]\nname = \"door\"\nmass = \"2 kg\"\ninertia = \"0.05 0.02 0.04 kg m^2\"\n[[joint]]\nname = \"J\"\n";
    // The axis leans: gravity drives the swing. Origin at the centroid.
    let axis = Vec3::new(0.3, 0.0, 1.0).normalize();
    let arm = Vec3::new(-0.2, -0.3, 0.1);
    let numbers = |v: Vec3| format!("\"{:e} {:e} {:e} m\"", v.x, v.y, v.z);
    let hinge = format!(
        "{door}kind = \"revolute\"\nchild = \"door\"\nchild_point = {}\naxis = [{:e}, 0, {:e}]\n",
        numbers(arm),
        axis.x,
        axis.z
    );
    let ball = |name: &str, along: f64| {
        format!(
            "[[ball_joint]]\nname = \"{name}\"\nsocket = {{ body = \"world\", at = {} }}\n\
             ball = {{ body = \"door\", at = {} }}\n",
            numbers(axis * along),
            numbers(arm + axis * along)
        )
    };
    let balls = format!(
        "{door}kind = \"free\"\nchild = \"door\"\nstart = {{ position = {} }}\n{}{}",
        numbers(-arm),
        ball("low", -0.4),
        ball("high", 0.6)
    );
    let mut hinged = Simulation::new(&parse(&hinge, &[]).machine).unwrap();
    run_until(&mut hinged, 0.5);
    let expected = frame_now(&mut hinged);
    let weight = 2.0 * (expected.bodies[0].acceleration + Vec3::new(0.0, 0.0, G));
    let scene = parse(&balls, &[]);
    let mut simulation = Simulation::new(&scene.machine).unwrap();
    assert_eq!(simulation.mechanism().summary().degrees_of_freedom, 1);
    run_until(&mut simulation, 0.5);
    let frame = frame_now(&mut simulation);
    let error = (frame.bodies[0].position - expected.bodies[0].position).norm();
    assert!(error < 1e-7, "{error:e}");
    let [low, high] = [0, 1].map(|j| frame.joints[j].normal_force);
    assert!((low + high - weight).norm() < 1e-5, "{}", low + high);
    assert!((low - high).dot(&axis).abs() < 1e-6, "{low} {high}");
    assert_eq!(simulation.indeterminate_forces().reactions, [0, 1]);
}

#[test]
fn displacements_by_the_assembly_are_reported() {
    let degrees = std::f64::consts::PI / 180.0;
    let closed = GRASHOF.angles(GRASHOF.angle);
    let guess = [closed[0], closed[1] + 8.0 * degrees, closed[2]];
    let with = Extras { start: "ideal", driven: &[0], pose: Some(guess), ..PLAIN };
    let simulation = Simulation::new(&GRASHOF.scene(tilted(), with, &[]).machine).unwrap();
    let assembly = simulation.mechanism().assembly();
    let (joint, gap) = assembly.widest.unwrap();
    // Chord of 8 degrees at the coupler's end.
    let chord = 2.0 * GRASHOF.lengths[1] * (4.0 * degrees).sin();
    assert!(joint == 0 && (gap - chord).abs() < 1e-12, "{gap} {chord}");
    assert_eq!(assembly.bodies[0].moved, 0.0);
    let displacement = assembly.bodies[1].turned;
    assert!((displacement - 8.0 * degrees).abs() < 1e-9, "{displacement}");
    assert!(assembly.bodies[2].turned < 1e-9 && !assembly.other_mode);
}

/// The sign of the angle between coupler and rocker determines the mode.
#[test]
fn an_assembly_mode_other_than_the_guessed_one_is_reported() {
    let (mut switched, mut retained) = (0, 0);
    for k in 0..20 {
        for l in 0..20 {
            if (k + 20 - l) % 10 == 0 {
                continue; // Collinear: neither mode.
            }
            let guess = [k, l].map(|k| f64::from(k) * std::f64::consts::TAU / 20.0 + 0.05);
            let with =
                Extras { start: "ideal", driven: &[0], pose: Some([GRASHOF.angle, guess[0], guess[1]]), ..PLAIN };
            let scene = GRASHOF.scene(Quat::identity(), with, &[]);
            let Ok(mut simulation) = Simulation::new(&scene.machine) else {
                continue;
            };
            let frame = frame_now(&mut simulation);
            let [coupler, rocker] = [1, 2].map(|body| angle_of(&frame, Quat::identity(), body));
            let other = ((guess[0] - guess[1]).sin() > 0.0) != ((coupler - rocker).sin() > 0.0);
            assert_eq!(simulation.mechanism().assembly().other_mode, other, "{guess:?}");
            switched += u32::from(other);
            retained += u32::from(!other);
        }
    }
    assert!(switched > 10 && retained > 100, "{switched} {retained}");
}
