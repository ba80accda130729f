//! Force elements on a slide or a hinge against closed-form solutions, in every method and both formulations.

use crate::common::assert_refused;
use crate::common::matrix::for_every;
use crate::elements::frame_at;
use jointplay_physics::machine::{Machine, Vec3};
use jointplay_physics::simulate::{Frame, Simulation};
use jointplay_scene::Scene;

/// The joint that connects the single body with the world.
#[derive(Clone, Copy, Debug, PartialEq)]
enum JointKind {
    Slide,
    Hinge,
}
use JointKind::{Hinge, Slide};

pub fn start_simulation(text: &str, changes: &[(&str, &str)]) -> Simulation {
    Simulation::new(&crate::common::parse(text, changes).machine).unwrap()
}

impl JointKind {
    /// Mass, kg, or moment of inertia about the axis, kg m^2; the centroid is 0.1 m from the axis.
    fn inertia(self) -> f64 {
        match self {
            Slide => 0.5,
            Hinge => 4e-4 + 0.5 * 0.1 * 0.1,
        }
    }

    /// Units of position, velocity, force, stiffness and damping.
    fn units(self) -> [&'static str; 5] {
        match self {
            Slide => ["m", "m/s", "N", "N/m", "N s/m"],
            Hinge => ["rad", "rad/s", "N m", "N m/rad", "N m s/rad"],
        }
    }

    fn force_key(self) -> &'static str {
        match self {
            Slide => "force",
            Hinge => "torque",
        }
    }

    fn text(self, start: [f64; 2], more: &str) -> String {
        let [length, speed, ..] = self.units();
        let kind = match self {
            Slide => "kind = \"prismatic\"\naxis = [1, 0, 0]",
            Hinge => "kind = \"revolute\"\naxis = [0, 0, 1]\nchild_point = \"-100 0 0 mm\"",
        };
        format!(
            "[gravity]\nx = 0\ny = 0\nz = 0\n\
             [[body]]\nname = \"mass\"\nmass = \"0.5 kg\"\ninertia = \"2e-4 3e-4 4e-4 kg m^2\"\n\
             [[joint]]\nname = \"j\"\n{kind}\nchild = \"mass\"\n\
             start = {{ position = \"{:e} {length}\", velocity = \"{:e} {speed}\" }}\n{more}",
            start[0], start[1]
        )
    }

    /// A simulation from `start`, a coordinate and its rate.
    fn start_at(self, start: [f64; 2], more: &str, changes: &[(&str, &str)]) -> Simulation {
        start_simulation(&self.text(start, more), changes)
    }

    fn coordinate(self, frame: &Frame) -> f64 {
        let body = &frame.bodies[0];
        match self {
            Slide => body.position.x,
            Hinge => body.rotation[(1, 0)].atan2(body.rotation[(0, 0)]),
        }
    }

    fn rate(self, frame: &Frame) -> f64 {
        match self {
            Slide => frame.bodies[0].velocity.x,
            Hinge => frame.bodies[0].angular_velocity.z,
        }
    }

    /// Force or torque of element `i` on the body along the axis.
    fn force(self, frame: &Frame, i: usize) -> f64 {
        match self {
            Slide => frame.elements[i].force.x,
            Hinge => frame.elements[i].torque.expect("a torque").z,
        }
    }

    fn spring(self, stiffness: f64, damping: f64) -> String {
        let [position, _, _, by_position, by_rate] = self.units();
        format!(
            "[[joint_spring]]\nname = \"s\"\njoint = \"j\"\nposition = \"0.1 {position}\"\n\
             stiffness = \"{stiffness:e} {by_position}\"\ndamping = \"{damping:e} {by_rate}\"\n"
        )
    }
}

/// x and dx/dt at `t` of m x'' + c x' + k x = 0, underdamped, from `x` and `v`.
fn damped_oscillation([m, c, k]: [f64; 3], [x, v]: [f64; 2], t: f64) -> [f64; 2] {
    let d = c / (2.0 * m);
    let w = (k / m - d * d).sqrt();
    let (sin, cos) = (w * t).sin_cos();
    let (a, b) = (x, (v + d * x) / w);
    let decay = (-d * t).exp();
    [decay * (a * cos + b * sin), decay * ((b * w - d * a) * cos - (a * w + d * b) * sin)]
}

#[test]
fn a_joint_spring_has_its_natural_frequency_in_every_method_and_formulation() {
    for_every([Slide, Hinge], |joint, variant| {
        let (m, bound) = (joint.inertia(), variant.bound());
        let k = 400.0 * m;
        let mut simulation = joint.start_at([0.13, 0.0], &joint.spring(k, 0.0), &variant.close());
        let frame = frame_at(&mut simulation, 0.2);
        let [offset, rate] = damped_oscillation([m, 0.0, k], [0.03, 0.0], 0.2);
        let label = format!("{joint:?} {variant}");
        let error = (joint.coordinate(&frame) - 0.1 - offset).abs();
        assert!(error < bound, "{label}: {error:e}");
        assert!((joint.rate(&frame) - rate).abs() < 20.0 * bound, "{label}");
        let force = joint.force(&frame, 0);
        assert!((force + k * offset).abs() < 2.0 * k * bound, "{label}: {force}");
        let elastic = frame.elastic - 0.5 * k * offset * offset;
        assert!(elastic.abs() < 0.1 * k * bound, "{label}: {elastic:e}");
        let residual = simulation.ledger().unwrap().relative_residual();
        assert!(residual.abs() < 1e-4, "{label}: {residual:e}");
    });
}

#[test]
fn damping_and_preload_of_a_joint_spring_match_the_closed_form() {
    for joint in [Slide, Hinge] {
        let m = joint.inertia();
        let (k, c, preload) = (400.0 * m, 8.0 * m, 2.0 * m);
        let spring = joint.spring(k, c) + &format!("preload = \"{preload:e} {}\"\n", joint.units()[2]);
        for method in ["dopri5", "radau5", "automatic", "rk4"] {
            let changes = [("solver.method", method), ("solver.tolerance", "1e-10")];
            let mut simulation = joint.start_at([0.13, 0.0], &spring, &changes);
            let frame = frame_at(&mut simulation, 0.25);
            // The oscillation is about the zero-force position.
            let rest = -preload / k;
            let [offset, rate] = damped_oscillation([m, c, k], [0.03 - rest, 0.0], 0.25);
            let label = format!("{joint:?} {method}");
            let error = (joint.coordinate(&frame) - 0.1 - rest - offset).abs();
            assert!(error < 1e-8, "{label}: {error:e}");
            let energy = |x: f64, v: f64| 0.5 * (m * v * v + k * x * x);
            let lost = energy(0.03 - rest, 0.0) - energy(offset, rate);
            let ledger = simulation.ledger().unwrap();
            assert!((ledger.damping_loss / lost - 1.0).abs() < 1e-5, "{label}: {ledger:?}");
            let deflection = joint.coordinate(&frame) - 0.1;
            let stored = deflection * (preload + 0.5 * k * deflection);
            assert!((frame.elastic - stored).abs() < 1e-12, "{label}");
        }
    }
}

#[test]
fn the_error_of_a_joint_spring_falls_with_the_order_of_the_method() {
    let m = Hinge.inertia();
    let k = 400.0 * m;
    let error = |method: &str, key: &str, value: f64| {
        let value = format!("{value:e}{}", if key == "solver.step" { " s" } else { "" });
        let changes = [("solver.method", method), (key, &*value)];
        let mut simulation = Hinge.start_at([0.13, 0.0], &Hinge.spring(k, 4.0 * m), &changes);
        let frame = frame_at(&mut simulation, 0.2);
        let [offset, _] = damped_oscillation([m, 4.0 * m, k], [0.03, 0.0], 0.2);
        (Hinge.coordinate(&frame) - 0.1 - offset).abs()
    };
    let [coarse, fine] = [4e-3, 2e-3].map(|step| error("rk4", "solver.step", step));
    let observed = (coarse / fine).log2();
    assert!((observed - 4.0).abs() < 0.2, "rk4: {observed}");
    for method in ["dopri5", "radau5", "automatic"] {
        let [loose, tight] = [1e-4, 1e-8].map(|tolerance| error(method, "solver.tolerance", tolerance));
        let label = format!("{method}: {loose:e} {tight:e}");
        assert!(loose < 1e-4 && tight < 1e-8 && tight < loose, "{label}");
    }
}

#[test]
fn stiff_elements_on_joints_do_not_slow_implicit_methods() {
    for joint in [Slide, Hinge] {
        let m = joint.inertia();
        let stiff = joint.spring(1.6e8 * m, 2e4 * m);
        let evaluations = |method: &str| {
            let changes = [("solver.method", method), ("solver.tolerance", "1e-6")];
            let mut simulation = joint.start_at([0.13, 0.0], &stiff, &changes);
            let frame = frame_at(&mut simulation, 1.0);
            let error = joint.coordinate(&frame) - 0.1;
            assert!(error.abs() < 1e-6, "{joint:?} {method}: {error:e}");
            simulation.statistics().evaluations
        };
        let explicit = evaluations("dopri5");
        for method in ["radau5", "automatic"] {
            let implicit = evaluations(method);
            println!("{joint:?} {method} {implicit}, dopri5 {explicit}");
            assert!(4 * implicit < explicit, "{joint:?} {method}: {implicit} {explicit}");
        }
    }
}

/// A free body, an arm on a hinge and a rod on a slide of the arm, tumbling without gravity.
const TUMBLING: &str = "[gravity]\nx = 0\ny = 0\nz = 0\n\
    [[body]]\nname = \"base\"\nmass = \"0.5 kg\"\ninertia = \"2e-4 3e-4 4e-4 kg m^2\"\n\
    [[body]]\nname = \"arm\"\nmass = \"0.3 kg\"\ninertia = \"2e-4 1e-4 2.5e-4 kg m^2\"\n\
    [[body]]\nname = \"rod\"\nmass = \"0.2 kg\"\ninertia = \"1e-4 1.5e-4 2e-4 kg m^2\"\n\
    [[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"base\"\n\
    start = { position = [0, 0, 0], velocity = \"0.1 0.2 0.3 m/s\", angular_velocity = \"4 -3 5 rad/s\" }\n\
    [[joint]]\nname = \"elbow\"\nkind = \"revolute\"\nparent = \"base\"\nchild = \"arm\"\naxis = [1, 2, 2]\n\
    parent_point = \"50 10 20 mm\"\nchild_point = \"-60 20 0 mm\"\nrotation = { axis = [0, 1, 1], angle = \"35 deg\" }\n\
    start = { position = \"20 deg\", velocity = \"2 rad/s\" }\n\
    [[joint]]\nname = \"slide\"\nkind = \"prismatic\"\nparent = \"arm\"\nchild = \"rod\"\naxis = [2, -1, 1]\n\
    parent_point = \"30 0 10 mm\"\nchild_point = \"0 20 -10 mm\"\n\
    start = { position = \"5 mm\", velocity = \"0.2 m/s\" }\n";

/// Momentum and angular momentum about the world's origin of bodies whose frames are at their centroids.
pub fn momenta(frame: &Frame, machine: &Machine) -> [Vec3; 2] {
    let mut sums = [Vec3::zeros(); 2];
    for (body, m) in machine.bodies.iter().zip(&frame.bodies) {
        let momentum = m.velocity * body.mass;
        let spin = m.rotation.tr_mul(&m.angular_velocity);
        sums[0] += momentum;
        sums[1] += m.position.cross(&momentum) + m.rotation * (body.inertia * spin);
    }
    sums
}

#[test]
fn elements_on_joints_conserve_momentum_and_balance_their_energy() {
    let springs = "[[joint_spring]]\nname = \"t\"\njoint = \"elbow\"\nstiffness = \"3 N m/rad\"\ndamping = \"DT N m s/rad\"\n\
        [[joint_spring]]\nname = \"s\"\njoint = \"slide\"\nstiffness = \"500 N/m\"\ndamping = \"DS N s/m\"\npreload = \"2 N\"\n\
        [[stop]]\nname = \"u\"\njoint = \"elbow\"\nlower = \"-15 deg\"\nupper = \"25 deg\"\ntorque = \"1 N m\"\ndepth = \"2 deg\"\n\
        restitution = R\nspeed = \"1 rad/s\"\n\
        [[stop]]\nname = \"l\"\njoint = \"slide\"\nlower = \"-6 mm\"\nupper = \"8 mm\"\nforce = \"20 N\"\ndepth = \"1 mm\"\n\
        restitution = R\nspeed = \"0.2 m/s\"\n";
    for damped in [false, true] {
        let [turning, sliding, restitution] = match damped {
            false => ["0", "0", "1"],
            true => ["2e-3", "1.5", "0.7"],
        };
        let springs = springs.replace("DT", turning).replace("DS", sliding);
        let text = TUMBLING.to_owned() + &springs.replace('R', restitution);
        let mut ends = Vec::new();
        let pairs = [("tree", "dopri5"), ("lagrange", "radau5"), ("lagrange", "dopri5"), ("tree", "radau5")];
        // Damping adds no difference between the pairs: two are enough with it.
        for (formulation, method) in pairs.into_iter().skip(if damped { 2 } else { 0 }) {
            let changes = [("solver.method", method), ("solver.tolerance", "1e-10"), ("formulation", formulation)];
            let mut simulation = start_simulation(&text, &changes);
            let machine = simulation.machine().clone();
            let before = frame_at(&mut simulation, 0.0);
            let mut stopped = [false; 2];
            for sample in 1..=30 {
                let frame = frame_at(&mut simulation, f64::from(sample) * 0.01);
                let elbow = frame.elements[2].torque.expect("a torque");
                let slide = frame.elements[3].force;
                stopped[0] |= elbow.norm() > 0.1;
                stopped[1] |= slide.norm() > 1.0;
                // A stop only pushes: its force on the rod points towards the middle.
                let offset = frame.elements[3].points[1] - frame.elements[3].points[0];
                assert!(slide.dot(&offset) <= 0.0, "{slide} {offset}");
            }
            let frame = frame_at(&mut simulation, 0.3);
            let label = format!("{formulation} {method} damped {damped}");
            assert!(damped || (stopped[0] && stopped[1]), "{label}: untouched");
            let (then, now) = (momenta(&before, &machine), momenta(&frame, &machine));
            for (then, now) in then.iter().zip(&now) {
                let error = (now - then).norm() / then.norm();
                assert!(error < 2e-8, "{label}: {error:e}");
            }
            let ledger = simulation.ledger().unwrap();
            let residual = ledger.relative_residual();
            assert!(residual.abs() < 1e-6, "{label}: {residual:e}");
            if !damped {
                let energy = |f: &Frame| f.kinetic + f.elastic;
                let error = energy(&frame) / energy(&before) - 1.0;
                assert!(error.abs() < 1e-7, "{label}: {error:e}");
                assert_eq!(ledger.damping_loss, 0.0);
            } else {
                assert!(ledger.damping_loss > 1e-3, "{label}: {ledger:?}");
            }
            ends.push(frame.bodies[2].position);
        }
        for end in &ends[1..] {
            assert!((end - ends[0]).norm() < 1e-6, "{end} {}", ends[0]);
        }
    }
}

#[test]
fn a_joint_spring_on_a_drive_loads_it() {
    for (joint, rate) in [(Slide, "50 mm/s"), (Hinge, "50 mrad/s")] {
        let kind = if joint == Slide { "prismatic" } else { "revolute" };
        let text = format!(
            "[gravity]\nx = 0\ny = 0\nz = 0\n\
             [[body]]\nname = \"driven\"\nmass = \"1 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n\
             [[body]]\nname = \"mass\"\nmass = \"0.5 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n\
             [[joint]]\nname = \"j\"\nkind = \"{kind}\"\nchild = \"driven\"\naxis = [0, 0, 1]\n\
             drive = {{ law = \"constant\", position = \"0.1 {}\", velocity = \"{rate}\" }}\n\
             [[joint]]\nname = \"free\"\nkind = \"free\"\nchild = \"mass\"\nstart = {{ position = \"0 500 0 mm\" }}\n{}",
            joint.units()[0],
            joint.spring(300.0, 0.0)
        );
        let mut simulation = start_simulation(&text, &[]);
        let frame = frame_at(&mut simulation, 0.2);
        let stored = 0.5 * 300.0 * 0.01 * 0.01;
        assert!((frame.elastic / stored - 1.0).abs() < 1e-6, "{joint:?}");
        let work = simulation.ledger().unwrap().drive_work;
        assert!((work / stored - 1.0).abs() < 1e-5, "{joint:?}: {work}");
        let force = frame.actuators[0];
        assert!((force - 300.0 * 0.01).abs() < 1e-5, "{joint:?}: {force}");
    }
}

/// The value in `low..high` at which `above` turns true, by bisection.
fn bisect(mut low: f64, mut high: f64, above: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if above(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    low
}

/// Whether an impact at v under the law F = K d^1.5 (1 + chi d' / v) rebounds slower than with `restitution`:
/// chi and restitution e satisfy chi (1 + e) = ln((1 + chi) / (1 - e chi)).
fn rebound_beyond(chi: f64, restitution: f64) -> bool {
    chi * (1.0 + restitution) < ((1.0 + chi) / (1.0 - restitution * chi)).ln()
}

#[test]
fn a_stop_rebounds_by_its_law_at_any_speed() {
    let chi = bisect(1e-3, 1.0 / 0.6 - 1e-9, |chi| rebound_beyond(chi, 0.6));
    for_every([Slide, Hinge], |joint, variant| {
        let m = joint.inertia();
        let [position, speed, force, ..] = joint.units();
        let stop = format!(
            "[[stop]]\nname = \"s\"\njoint = \"j\"\nlower = \"-0.02 {position}\"\nupper = \"0.01 {position}\"\n\
             {} = \"{:e} {force}\"\ndepth = \"1e-3 {position}\"\nrestitution = 0.6\nspeed = \"0.2 {speed}\"\n",
            joint.force_key(),
            1000.0 * m
        );
        let (step, bound) = match variant.method {
            "discrete-gradient" => ("10 us", 2e-5),
            _ => ("10 us", 2e-6),
        };
        for (v, limit) in [(0.2_f64, 0.01), (-0.2, -0.02), (0.05, 0.01)] {
            let [method, _, tolerance, parts, formulation] = variant.close();
            let scaled_chi = chi * v.abs() / 0.2;
            let expected = match v.abs() == 0.2 {
                true => 0.6,
                false => bisect(0.0, (1.0 / scaled_chi).min(1.0), |e| rebound_beyond(scaled_chi, e)),
            };
            let changes = [method, ("solver.step", step), tolerance, parts, formulation];
            let mut simulation = joint.start_at([0.8 * limit, v], &stop, &changes);
            let frame = frame_at(&mut simulation, 0.08);
            let label = format!("{joint:?} {variant} {v}");
            let rebound = -joint.rate(&frame) / v;
            assert!((rebound - expected).abs() < bound, "{label}: {rebound} {expected}");
            assert_eq!((frame.elastic, joint.force(&frame, 0)), (0.0, 0.0), "{label}");
            let lost = 0.5 * m * v * v * (1.0 - expected * expected);
            let ledger = simulation.ledger().unwrap();
            let error = ledger.damping_loss / lost - 1.0;
            assert!(error.abs() < 1e4 * bound.min(1e-6), "{label}: {error:e}");
            assert!(ledger.relative_residual().abs() < 2e-3, "{label}: {ledger:?}");
        }
    });
}

#[test]
fn a_weight_settles_on_a_stop_at_the_hertz_penetration() {
    let stop = "[[stop]]\nname = \"s\"\njoint = \"j\"\nlower = \"-5 mm\"\nforce = \"100 N\"\ndepth = \"1 mm\"\n\
                restitution = 0.2\nspeed = \"0.1 m/s\"\n";
    let text = Slide.text([0.0, 0.0], stop).replace("x = 0\n", "x = \"-9.81 m/s^2\"\n");
    for method in ["radau5", "automatic", "dopri5"] {
        let changes = [("solver.method", method), ("solver.tolerance", "1e-8")];
        let mut simulation = start_simulation(&text, &changes);
        // The law's damping vanishes with the speed, so the last micrometres ring for a long time.
        let frame = frame_at(&mut simulation, 3.0);
        let depth = -5e-3 - Slide.coordinate(&frame);
        let weight: f64 = 0.5 * 9.81;
        let expected = 1e-3 * (weight / 100.0).powf(2.0 / 3.0);
        assert!((depth / expected - 1.0).abs() < 0.02, "{method}: {depth:e} {expected:e}");
    }
}

#[test]
fn a_motor_follows_its_target_like_a_spring_and_its_work_counts_as_drive_work() {
    for_every([Slide, Hinge], |joint, variant| {
        let (m, bound, label) = (joint.inertia(), variant.bound(), format!("{joint:?} {variant}"));
        let (k, d) = (400.0 * m, 12.0 * m);
        let [position, speed, _, by_position, by_rate] = joint.units();
        let gains = format!(
            "[[motor]]\nname = \"m\"\njoint = \"j\"\nstiffness = \"{k:e} {by_position}\"\ndamping = \"{d:e} {by_rate}\"\n"
        );
        let constant = gains.clone()
            + &format!(
                "target = {{ law = \"constant\", position = \"0.1 {position}\", velocity = \"0.3 {speed}\" }}\n"
            );
        let harmonic = gains
            + &format!(
                "target = {{ law = \"harmonic\", amplitude = \"0.1 {position}\", frequency = \"4 Hz\", phase = \"30 deg\" }}\n"
            );
        let t = 0.2;
        // The error relative to a target in uniform motion oscillates freely.
        let mut simulation = joint.start_at([0.0, 0.0], &constant, &variant.close());
        let frame = frame_at(&mut simulation, t);
        let [offset, rate] = damped_oscillation([m, d, k], [-0.1, -0.3], t);
        let error = (joint.coordinate(&frame) - (0.1 + 0.3 * t) - offset).abs();
        assert!(error < 2.0 * bound, "{label}: {error:e}");
        let force = joint.force(&frame, 0);
        assert!((force + k * offset + d * rate).abs() < 60.0 * k * bound, "{label}");
        let kinetic = 0.5 * m * joint.rate(&frame).powi(2);
        let ledger = simulation.ledger().unwrap();
        assert!((ledger.drive_work - kinetic).abs() < 1e-4 * ledger.exchanged, "{label}: {ledger:?}");
        assert_eq!(ledger.damping_loss, 0.0);
        // m q'' + d q' + k q = Re (k + i w d) T e^(i w t), T = 0.1 e^(i phase) / i: forced and free.
        let mut simulation = joint.start_at([0.0, 0.0], &harmonic, &variant.close());
        let frame = frame_at(&mut simulation, t);
        let w = std::f64::consts::TAU * 4.0;
        let (re, im) = (k - m * w * w, d * w);
        let size = 0.1 * (k * k + im * im).sqrt() / (re * re + im * im).sqrt();
        let phase = 30_f64.to_radians() + (im / k).atan() - im.atan2(re);
        let forced = |t: f64| [size * (w * t + phase).sin(), size * w * (w * t + phase).cos()];
        let [x, v] = forced(0.0);
        let free = damped_oscillation([m, d, k], [-x, -v], t)[0];
        let error = (joint.coordinate(&frame) - forced(t)[0] - free).abs();
        assert!(error < 4.0 * bound, "{label}: {error:e}");
    });
}

#[test]
fn a_motor_does_not_exceed_its_limit() {
    for joint in [Slide, Hinge] {
        let m = joint.inertia();
        let [position, speed, force, by_position, _] = joint.units();
        let (k, limit) = (100.0 * m, 20.0 * m);
        let motor = format!(
            "[[motor]]\nname = \"m\"\njoint = \"j\"\nstiffness = \"{k:e} {by_position}\"\nlimit = \"{limit:e} {force}\"\n\
             target = {{ law = \"constant\", position = \"1 {position}\", velocity = \"0 {speed}\" }}\n"
        );
        // At full force until 0.2 from the target, then oscillating freely about it.
        let release_time = (2.0 * 0.8 / 20.0_f64).sqrt();
        for method in ["dopri5", "radau5", "automatic"] {
            let changes = [("solver.method", method), ("solver.tolerance", "1e-10")];
            let label = format!("{joint:?} {method}");
            let mut simulation = joint.start_at([0.0, 0.0], &motor, &changes);
            let t = 0.99 * release_time;
            let frame = frame_at(&mut simulation, t);
            assert!((joint.force(&frame, 0) / limit - 1.0).abs() < 1e-12, "{label}");
            assert!((joint.coordinate(&frame) - 10.0 * t * t).abs() < 1e-8, "{label}");
            let t = release_time + 0.05;
            let frame = frame_at(&mut simulation, t);
            let [offset, _] = damped_oscillation([m, 0.0, k], [-0.2, 20.0 * release_time], 0.05);
            let error = (joint.coordinate(&frame) - 1.0 - offset).abs();
            assert!(error < 1e-7, "{label}: {error:e}");
        }
        // A constant force alone.
        let push = format!("[[motor]]\nname = \"m\"\njoint = \"j\"\n{} = \"{limit:e} {force}\"\n", joint.force_key());
        let mut simulation = joint.start_at([0.0, 0.0], &push, &[]);
        let frame = frame_at(&mut simulation, 0.3);
        assert!((joint.rate(&frame) - 6.0).abs() < 1e-9, "{joint:?}");
        let work = simulation.ledger().unwrap().drive_work;
        assert!((work / (0.5 * m * 36.0) - 1.0).abs() < 1e-9, "{joint:?}: {work}");
    }
}

#[test]
fn a_motor_does_not_step_over_a_pulse_of_its_target() {
    // Nothing moves before the pulse, so an adaptive step would grow beyond its length.
    let m = Slide.inertia();
    let motor = format!(
        "[[motor]]\nname = \"m\"\njoint = \"j\"\nstiffness = \"{:e} N/m\"\ndamping = \"{:e} N s/m\"\n\
         target = {{ law = \"pulse\", height = \"10 mm\", start = \"1 s\", duration = \"5 ms\" }}\n",
        1e4 * m,
        20.0 * m
    );
    let end = |method: &str| {
        let changes = [("solver.method", method), ("solver.tolerance", "1e-9")];
        let mut simulation = Slide.start_at([0.0, 0.0], &motor, &changes);
        Slide.coordinate(&frame_at(&mut simulation, 1.03))
    };
    let expected = end("rk4");
    assert!(expected.abs() > 1e-4, "{expected:e}");
    for method in ["dopri5", "radau5", "automatic"] {
        let position = end(method);
        assert!((position - expected).abs() < 1e-7, "{method}: {position:e} {expected:e}");
    }
}

#[test]
fn columns_follow_the_kind_of_joint() {
    let columns = |joint: JointKind| {
        let text = joint.text([0.13, 0.0], &joint.spring(200.0, 0.0));
        let scene = Scene::parse(&text, None, &[]).unwrap();
        let frame = frame_at(&mut Simulation::new(&scene.machine).unwrap(), 0.0);
        let columns = jointplay_physics::simulate::channels_of(&scene.machine, &frame);
        columns
            .into_iter()
            .filter(|channel| channel.by_default)
            .map(|channel| channel.column)
            .collect::<Vec<_>>()
            .join(",")
    };
    let (slide, hinge) = (columns(Slide), columns(Hinge));
    assert!(slide.contains("s_force_x_N,s_force_y_N,s_force_z_N") && !slide.contains("s_torque"));
    assert!(hinge.contains("s_torque_x_Nm,s_torque_y_Nm,s_torque_z_Nm") && !hinge.contains("s_force"));
}

#[test]
fn bad_elements_on_joints_are_refused_with_their_position() {
    let text = TUMBLING.to_owned()
        + "[[body]]\nname = \"wheel\"\nmass = \"1 kg\"\ninertia = \"1 1 1 kg m^2\"\n\
           [[joint]]\nname = \"crank\"\nkind = \"revolute\"\nchild = \"wheel\"\naxis = [0, 0, 1]\n\
           drive = { law = \"constant\", velocity = \"60 rpm\" }\n";
    let cases = r#"
        [[joint_spring]]; name = "s" -> joint_spring.s.joint | missing
        [[joint_spring]]; name = "s"; joint = "elbwo" -> did you mean `elbow` | allowed
        [[joint_spring]]; name = "s"; joint = "free" -> a free joint is neither | elbow, slide
        [[joint_spring]]; name = "s"; joint = "elbow" -> joint_spring.s | does nothing: stiffness, damping, preload
        [[joint_spring]]; name = "s"; joint = "elbow"; stiffness = "10 N/m" -> wrong unit `N/m` (a unit of stiffness) | N m/rad
        [[joint_spring]]; name = "s"; joint = "slide"; stiffness = "-1 N/m" -> stiffness | allowed 0 N/m to
        [[stop]]; name = "s"; joint = "elbow"; force = "1 N"; depth = "1 deg"; upper = 0 -> stop.s.force | the joint is a hinge, where `torque` belongs
        [[stop]]; name = "s"; joint = "elbow"; torque = "1 N m"; depth = "1 deg" -> stop.s.upper | `lower`, `upper` or both
        [[stop]]; name = "s"; joint = "slide"; force = "1 N"; depth = "1 mm"; lower = "2 mm"; upper = "1 mm" -> stop.s.upper | above lower, 2 mm
        [[stop]]; name = "s"; joint = "slide"; force = "1 N"; depth = "1 mm"; upper = 0; restitution = 0.5 -> stop.s.speed | missing
        [[stop]]; name = "s"; joint = "slide"; force = "1 N"; depth = "1 mm"; upper = 0; restitution = 0 -> stop.s.restitution | allowed 0.01 to 1
        [[stop]]; name = "s"; joint = "slide"; force = "1 N"; depth = 0; upper = 0 -> stop.s.depth | allowed 1e-9 m to 1000 m
        [[motor]]; name = "m"; joint = "crank"; torque = "1 N m" -> motor.m.joint | has a drive
        [[motor]]; name = "m"; joint = "elbow"; limit = "1 N m" -> motor.m | does nothing: torque, stiffness, damping are missing
        [[motor]]; name = "m"; joint = "elbow"; stiffness = "1 N m/rad" -> motor.m.target | missing
        [[motor]]; name = "m"; joint = "elbow"; torque = "1 N m"; target = { law = "constant", velocity = 0 } -> motor.m.target | has no effect
        [[motor]]; name = "m"; joint = "elbow"; stiffness = "1 N m/rad"; target = { law = "constant", velocity = "1 m/s" } -> motor.m.target.velocity | rad/s
        [[motor]]; name = "elbow"; joint = "elbow"; torque = "1 N m" -> motor.elbow.name | already a joint or force element
    "#;
    assert_refused(cases, |more| Scene::parse(&format!("{text}{more}"), Some("mine.toml"), &[]));
}
