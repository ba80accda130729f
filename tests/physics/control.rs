//! Motors, springs and loads set while a machine runs, against closed forms; restarts at a given state; mass matrix, forces and
//! linearisation against independent values.

use crate::common::matrix::for_every;
use crate::common::{frame_now, live, parse, run_until};
use jointplay_physics::machine::ElementNumber as N;
use jointplay_physics::simulate::{Effect, Frame, RestartError, Simulation};
use jointplay_scene::{LiveScene, SavedState};

const WRITER: [&str; 2] = ["jointplay", "test"];
/// Moment of inertia of the wheel about its hinge, kg m^2.
const INERTIA: f64 = 0.02;
const MASS: f64 = 2.0;
/// Elements of the machine: spring, load, motor.
const S: usize = 0;
const F: usize = 1;
const M: usize = 2;

/// A wheel on a hinge with a motor and a spring, and a block on a slide with a load and a spring to the wall.
const MACHINE: &str = r#"
    gravity = { x = 0, y = 0, z = 0 }
    [[parameter]]
    name = "push"
    value = "0 N m"
    [[parameter]]
    name = "goal"
    value = "0 rad"
    [[body]]
    name = "wheel"
    mass = "1 kg"
    inertia = "0.01 0.01 0.02 kg m^2"
    [[body]]
    name = "block"
    mass = "2 kg"
    inertia = "0.01 0.01 0.01 kg m^2"
    [[joint]]
    name = "hinge"
    kind = "revolute"
    child = "wheel"
    axis = [0, 0, 1]
    [[joint]]
    name = "rail"
    kind = "prismatic"
    child = "block"
    axis = [1, 0, 0]
    [[motor]]
    name = "m"
    joint = "hinge"
    torque = "push"
    stiffness = 0
    damping = 0
    target = { law = "constant", position = "goal", velocity = 0 }
    [[spring]]
    name = "s"
    from = { body = "world", at = "-200 0 0 mm" }
    to = { body = "block", at = [0, 0, 0] }
    length = "150 mm"
    stiffness = "80 N/m"
    damping = "0 N s/m"
    [[load]]
    name = "f"
    on = { body = "block" }
    force = [0, 0, 0]
"#;

/// Without the spring's motion.
const STILL: [(&str, &str); 1] = [("spring.s.stiffness", "0.001 N/m")];

fn machine(changes: &[(&str, &str)]) -> LiveScene {
    LiveScene::new(&parse(MACHINE, changes)).unwrap()
}

fn hinge(run: &mut LiveScene) -> [f64; 2] {
    let frame = frame_now(run);
    frame.coordinates[0]
}

/// Relative residual of the ledger.
fn residual(run: &LiveScene) -> f64 {
    run.ledger().unwrap().relative_residual().abs()
}

#[test]
fn a_torque_set_between_steps_acts_from_then_on_in_every_method_and_formulation() {
    for_every([()], |(), variant| {
        let mut run = machine(&variant.changes());
        let (mut angle, mut rate, mut work) = (0.0, 0.0, 0.0);
        for k in 0..20_u32 {
            let torque = libm::sin(f64::from(k)) - 0.3;
            run.control(&[(M, N::Force, torque), (F, N::ForceX, 5.0 * torque)]).unwrap();
            assert_eq!(run.controlled(M, N::Force), Some(torque));
            let (end, h) = (1e-3 * f64::from(k + 1), 1e-3);
            run_until(&mut run, end);
            let moved = rate * h + 0.5 * torque / INERTIA * h * h;
            work += torque * moved;
            (angle, rate) = (angle + moved, rate + torque / INERTIA * h);
        }
        let [found, speed] = hinge(&mut run);
        assert!((found - angle).abs() < 1e-9 && (speed - rate).abs() < 1e-8, "{variant:?}: {found} {angle}");
        let ledger = *run.ledger().unwrap();
        assert!((ledger.drive_work - work).abs() < 1e-8 * work.abs().max(1e-3), "{variant:?}: {ledger:?}");
        assert!(residual(&run) < 1e-5, "{variant:?}: {}", residual(&run));
    });
}

#[test]
fn numbers_set_directly_are_the_same_as_changes_of_the_scene() {
    let changes = [("parameter.push", "0.7 N m"), ("spring.s.stiffness", "200 N/m"), ("spring.s.damping", "3 N s/m")];
    let controls = [(M, N::Force, 0.7), (S, N::Stiffness, 200.0), (S, N::Damping, 3.0)];
    for method in ["automatic", "radau5", "rk4", "discrete-gradient"] {
        let [mut by_scene, mut by_number] = [(); 2].map(|()| machine(&[("solver.method", method)]));
        for (change, control) in changes.iter().zip(controls) {
            let end = by_scene.time() + 0.01;
            for run in [&mut by_scene, &mut by_number] {
                run_until(run, end);
            }
            assert_eq!(by_scene.set(change.0, change.1).unwrap(), Effect::Now, "{change:?}");
            by_number.control(&[control]).unwrap();
        }
        for run in [&mut by_scene, &mut by_number] {
            run_until(run, 0.1);
        }
        assert_eq!(by_scene.state_hash(), by_number.state_hash(), "{method}");
        assert_eq!(by_scene.ledger(), by_number.ledger());
        assert_eq!(by_scene.changed_machine().elements, by_number.changed_machine().elements);
        // A reset starts with the change, and without what was only set.
        by_scene.reset().unwrap();
        by_number.reset().unwrap();
        assert_ne!(by_scene.changed_machine().elements, by_number.changed_machine().elements);
    }
}

#[test]
fn energy_that_a_change_of_a_spring_adds_is_booked() {
    for_every([()], |(), variant| {
        let mut run = machine(&variant.changes());
        run_until(&mut run, 0.07);
        let stretch = frame_now(&mut run).bodies[1].position.x + 0.05;
        let before = run.ledger().unwrap().change_work;
        run.set("spring.s.stiffness", "300 N/m").unwrap();
        let jump = run.ledger().unwrap().change_work - before;
        let expected = 0.5 * (300.0 - 80.0) * stretch * stretch;
        assert!((jump - expected).abs() < 1e-9 * expected.abs().max(1e-6), "{variant:?}: {jump} {expected}");
        run_until(&mut run, 0.2);
        assert!(residual(&run) < 1e-4, "{variant:?}: {}", residual(&run));
    });
}

#[test]
fn a_target_is_where_it_was_set_and_moves_on_at_its_rate() {
    let mut run = machine(&STILL);
    run_until(&mut run, 0.02);
    run.control(&[(M, N::Target, 0.4), (M, N::TargetRate, 2.0)]).unwrap();
    assert!((run.controlled(M, N::Target).unwrap() - 0.4).abs() < 1e-15);
    run.control(&[(M, N::Stiffness, 50.0), (M, N::Damping, 2.0)]).unwrap();
    run_until(&mut run, 2.0);
    // Overdamped: it follows with no delay once the transient has died away.
    let [angle, rate] = hinge(&mut run);
    let expected = 0.4 + 2.0 * (2.0 - 0.02);
    assert!((angle - expected).abs() < 1e-6 && (rate - 2.0).abs() < 1e-5, "{angle} {expected} {rate}");
    assert!((run.controlled(M, N::Target).unwrap() - expected).abs() < 1e-12);
    // Changes of the scene to the same element end what was set of it, changes to another do not.
    assert_eq!(run.set("load.f.force.x", "1 N").unwrap(), Effect::Now);
    assert_eq!(run.controlled(M, N::TargetRate), Some(2.0));
    assert_eq!(run.set("parameter.goal", "1 rad").unwrap(), Effect::Now);
    assert_eq!(run.controlled(M, N::TargetRate), Some(0.0));
    assert_eq!(run.controlled(M, N::Target), Some(1.0));
}

#[test]
fn copies_and_files_of_a_state_continue_with_what_was_set() {
    for method in ["automatic", "discrete-gradient"] {
        let mut run = machine(&[("solver.method", method)]);
        run_until(&mut run, 0.01);
        run.control(&[(M, N::Force, 0.3), (S, N::Damping, 5.0)]).unwrap();
        run.set("spring.s.stiffness", "120 N/m").unwrap();
        run.control(&[(M, N::Stiffness, 4.0), (M, N::Limit, f64::INFINITY)]).unwrap();
        run_until(&mut run, 0.03);
        let snapshot = run.snapshot();
        let text = SavedState::write(WRITER, snapshot.pending(), &snapshot, snapshot.time()).unwrap();
        run.control(&[(M, N::Force, -5.0)]).unwrap();
        run_until(&mut run, 0.04);
        run.restore(&snapshot);
        assert_eq!(run.controlled(M, N::Force), Some(0.3));
        let saved = SavedState::read(WRITER, text.as_bytes()).unwrap();
        let scene = saved.scene().unwrap();
        let mut read = LiveScene::new(&parse(MACHINE, &[("solver.method", method)])).unwrap();
        read.resume_changed(&saved.snapshot, scene.clone(), scene).unwrap();
        assert_eq!([N::Stiffness, N::Limit].map(|number| read.controlled(M, number)), [Some(4.0), Some(f64::INFINITY)]);
        for run in [&mut run, &mut read] {
            run_until(run, 0.1);
        }
        assert_eq!(run.state_hash(), read.state_hash(), "{method}");
    }
}

#[test]
fn the_ideal_motion_follows_what_was_set() {
    let mut run = live("measuring-machine", &[]);
    let mut exact = live("measuring-machine", &[("contact.clearance", "0")]);
    assert!(run.machine().elements.is_empty() && exact.machine().elements.is_empty());
    // Through gravity, the only applied force that this machine has; elements share the path.
    for run in [&mut run, &mut exact] {
        run_until(run, 0.01);
        run.set("gravity.x", "3 m/s^2").unwrap();
        run_until(run, 0.02);
    }
    let [loose, ideal] = [frame_now(&mut run), frame_now(&mut exact)];
    assert!(loose.probe_error.is_some() && ideal.probe_error.unwrap().norm() < 1e-9);
}

#[test]
fn a_machine_with_play_compares_its_tip_with_the_same_load_without_play() {
    let text = r#"
        gravity = { x = 0, y = 0, z = 0 }
        output = { body = "arm", probe = "100 0 0 mm" }
        [[body]]
        name = "arm"
        mass = "1 kg"
        inertia = "0.01 0.01 0.01 kg m^2"
        [[joint]]
        name = "pin"
        kind = "revolute"
        child = "arm"
        axis = [0, 0, 1]
        play = { radial = "0.1 mm", radius = "10 mm", length = "20 mm" }
        [[load]]
        name = "f"
        on = { body = "arm" }
        torque = "0 0 0 N m"
    "#;
    let mut run = LiveScene::new(&parse(text, &[])).unwrap();
    run_until(&mut run, 0.01);
    run.control(&[(0, N::TorqueZ, 0.5)]).unwrap();
    run_until(&mut run, 0.03);
    // Turned about its centre, it touches nowhere, and the tip is where the ideal one is.
    let error = frame_now(&mut run).probe_error.unwrap().norm();
    assert!(error < 1e-8, "{error:e}");
    assert!(frame_now(&mut run).bodies[0].angular_velocity.z > 0.9);
}

#[test]
fn wrong_numbers_are_refused_and_change_nothing() {
    let mut run = machine(&[]);
    run_until(&mut run, 0.01);
    let before = run.state_hash();
    for (control, why) in [
        ((M, N::Force, f64::NAN), "force of m = NaN; allowed -1e12 to 1e12, SI"),
        ((M, N::Stiffness, -1.0), "stiffness of m = -1; allowed 0e0 to 1e12, SI"),
        ((S, N::Force, 1.0), "s has no force that could be set"),
        ((F, N::Target, 1.0), "f has no target that could be set"),
        ((3, N::Force, 1.0), "element 3 of 3 (counted from 0)"),
    ] {
        let error = run.control(&[(M, N::Force, 1.0), control]).unwrap_err();
        assert_eq!(error.to_string(), why);
        assert_eq!((run.state_hash(), run.controlled(M, N::Force)), (before, Some(0.0)));
    }
    run.control(&[(M, N::Limit, f64::INFINITY)]).unwrap();
}

/// Two pendulums in a chain, of which the first also slides.
const ARM: &str = r#"
    gravity = { x = 0, y = 0, z = "-9.81 m/s^2" }
    [[body]]
    name = "upper"
    mass = "2 kg"
    inertia = "0.02 0.03 0.04 kg m^2"
    centre = "0.1 0 0 m"
    [[body]]
    name = "lower"
    mass = "1 kg"
    inertia = "0.01 0.012 0.013 kg m^2"
    centre = "0 0 -0.2 m"
    [[body]]
    name = "ball"
    mass = "0.5 kg"
    inertia = "0.001 0.002 0.003 kg m^2"
    [[joint]]
    name = "shoulder"
    kind = "cylindrical"
    child = "upper"
    axis = [0, 1, 0]
    start = { position = "10 mm", angle = "20 deg" }
    [[joint]]
    name = "elbow"
    kind = "revolute"
    parent = "upper"
    parent_point = "0.3 0 0 m"
    child = "lower"
    axis = [0, 1, 0]
    start = { position = "30 deg", velocity = "2 rad/s" }
    [[joint]]
    name = "flight"
    kind = "free"
    child = "ball"
    start = { position = "1 0 0 m", angular_velocity = "1 2 3 rad/s" }
    [[joint_spring]]
    name = "s"
    joint = "elbow"
    stiffness = "5 N m/rad"
"#;

fn arm(changes: &[(&str, &str)]) -> LiveScene {
    LiveScene::new(&parse(ARM, changes)).unwrap()
}

#[test]
fn coordinates_have_the_names_of_channels() {
    let names = |run: &LiveScene| -> Vec<String> {
        run.coordinates().iter().map(|c| format!("{} {:?} {:?}", c.name, c.positions, c.velocities)).collect()
    };
    let expected =
        ["shoulder.position 0..1 0..1", "shoulder.angle 1..2 1..2", "elbow.angle 2..3 2..3", "ball 3..10 3..9"];
    assert_eq!(names(&arm(&[])), expected);
    let lagrange = arm(&[("formulation", "lagrange")]);
    assert_eq!(names(&lagrange), ["upper 0..7 0..6", "lower 7..14 6..12", "ball 14..21 12..18"]);
}

#[test]
fn the_mass_matrix_gives_the_kinetic_energy_and_with_the_forces_the_accelerations() {
    let mut run = arm(&[]);
    run_until(&mut run, 0.02);
    let mass = run.mass_matrix().unwrap();
    let forces = run.generalised_forces().unwrap();
    let y = run.state_vector().to_vec();
    let nq = y.len() - mass.nrows();
    let v = nalgebra::DVector::from_column_slice(&y[nq..]);
    let kinetic = 0.5 * (v.transpose() * &mass * &v)[0];
    let frame = frame_now(&mut run);
    assert!((kinetic - frame.kinetic).abs() < 1e-12 * kinetic, "{kinetic} {}", frame.kinetic);
    let hash = run.state_hash();
    let time = run.time();
    let rates = run.rhs(time, &y).unwrap();
    let accelerations = mass.lu().solve(&forces).unwrap();
    for (own, found) in rates[nq..].iter().zip(accelerations.iter()) {
        assert!((own - found).abs() < 1e-9 * own.abs().max(1.0), "{rates:?} {accelerations}");
    }
    // Looking has changed nothing.
    let mut other = arm(&[]);
    run_until(&mut other, 0.02);
    for run in [&mut run, &mut other] {
        run_until(run, 0.05);
    }
    assert_ne!(run.state_hash(), hash);
    assert_eq!(run.state_hash(), other.state_hash());
    assert_eq!(arm(&[("formulation", "lagrange")]).mass_matrix(), Err(RestartError::Formulation));
}

#[test]
fn the_right_hand_side_integrates_to_the_run() {
    let mut run = arm(&[("solver.tolerance", "1e-12")]);
    let mut y = run.state_vector().to_vec();
    let (steps, h) = (200, 1e-4);
    for k in 0..steps {
        let t = h * f64::from(k);
        let mut at = |t: f64, k: Option<&[f64]>, share: f64, y: &[f64]| {
            let moved: Vec<f64> = match k {
                Some(k) => y.iter().zip(k).map(|(y, k)| y + share * h * k).collect(),
                None => y.to_vec(),
            };
            run.rhs(t, &moved).unwrap()
        };
        let k1 = at(t, None, 0.0, &y);
        let k2 = at(t + 0.5 * h, Some(&k1), 0.5, &y);
        let k3 = at(t + 0.5 * h, Some(&k2), 0.5, &y);
        let k4 = at(t + h, Some(&k3), 1.0, &y);
        for (i, y) in y.iter_mut().enumerate() {
            *y += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
    }
    run_until(&mut run, h * f64::from(steps));
    for (own, other) in run.state_vector().iter().zip(&y) {
        assert!((own - other).abs() < 1e-9, "{:?} {y:?}", run.state_vector());
    }
}

#[test]
fn a_restart_at_a_state_is_a_start_there() {
    // Both from the same state: as a start value, and set later.
    let mut given = arm(&[]);
    let mut restarted = arm(&[]);
    let start = given.state_vector().to_vec();
    run_until(&mut restarted, 0.3);
    restarted.restart_at(0.0, &start).unwrap();
    assert_eq!((restarted.time(), restarted.statistics().steps), (0.0, 0));
    for run in [&mut given, &mut restarted] {
        run_until(run, 0.1);
    }
    assert_eq!(given.state_hash(), restarted.state_hash());
    assert_eq!(given.ledger(), restarted.ledger());
    // Contacts are found anew: a ball that rests on its wall, and one put 0.1 um into it.
    let mut run = live("pendulum", &[("start", "settled")]);
    run_until(&mut run, 0.5);
    let y = run.state_vector().to_vec();
    run.restart_at(0.5, &y).unwrap();
    assert!(run.contact_states(0).iter().any(|contact| contact.active));
    let mut bad = y.clone();
    bad[0] = f64::NAN;
    assert!(matches!(run.restart_at(0.0, &bad), Err(RestartError::NotFinite { index: 0, .. })));
    assert!(matches!(run.restart_at(0.0, &y[1..]), Err(RestartError::Length { .. })));
    let mut deep = y.clone();
    deep[..3].iter_mut().for_each(|x| *x += 0.1);
    let before = run.state_hash();
    let refused = run.restart_at(0.0, &deep).unwrap_err();
    assert!(matches!(refused, RestartError::Inside { .. }), "{refused}");
    assert_eq!(run.state_hash(), before);
    run_until(&mut run, 0.6);
}

#[test]
fn a_restart_closes_loops_and_refuses_what_cannot_close() {
    let mut run = live("four-bar", &[("contact.clearance", "0")]);
    run_until(&mut run, 0.05);
    let (time, y) = (run.time(), run.state_vector().to_vec());
    let mut near = y.clone();
    near[0] += 1e-4;
    run.restart_at(time, &near).unwrap();
    run_until(&mut run, 0.06);
    let far: Vec<f64> = y.iter().map(|y| y + 3.0).collect();
    assert!(matches!(run.restart_at(time, &far), Err(RestartError::Open { .. })));
}

/// Frequencies of small oscillations, Hz, ascending, from the eigenvalues of a linearisation.
fn frequencies(run: &Simulation) -> Vec<f64> {
    let eigenvalues = run.linearise().unwrap().matrix.complex_eigenvalues();
    let mut all: Vec<f64> = eigenvalues.iter().map(|x| x.im / std::f64::consts::TAU).filter(|f| *f > 1e-6).collect();
    all.sort_by(f64::total_cmp);
    all
}

#[test]
fn small_oscillations_have_the_frequencies_of_closed_forms() {
    let mut run = machine(&[]);
    run.control(&[(M, N::Stiffness, 7.0)]).unwrap();
    let found = frequencies(&run);
    let expected = [(80.0_f64 / MASS).sqrt(), (7.0_f64 / INERTIA).sqrt()].map(|w| w / std::f64::consts::TAU);
    assert_eq!(found.len(), 2, "{found:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found / expected - 1.0).abs() < 1e-7, "{found} {expected}");
    }
    // The one freedom of a closed loop: a seat on two parallel links swings like a point mass on them, here about an inclined position.
    let text = r#"
        gravity = { x = 0, y = 0, z = "-9.81 m/s^2" }
        [[body]]
        name = "left"
        mass = "1 kg"
        inertia = "0.5 0.5 0.5 kg m^2"
        [[body]]
        name = "right"
        mass = "1 kg"
        inertia = "0.5 0.5 0.5 kg m^2"
        [[body]]
        name = "seat"
        mass = "10 kg"
        inertia = "1 1 1 kg m^2"
        [[joint]]
        name = "a"
        kind = "revolute"
        child = "left"
        axis = [0, 1, 0]
        start = { position = "20 deg" }
        [[joint]]
        name = "b"
        kind = "revolute"
        child = "right"
        parent_point = "0.5 0 0 m"
        axis = [0, 1, 0]
        start = { position = "20 deg" }
        [[joint]]
        name = "c"
        kind = "revolute"
        parent = "left"
        parent_point = "0 0 -2 m"
        child = "seat"
        axis = [0, 1, 0]
        start = { position = "-20 deg" }
        [[joint]]
        name = "d"
        kind = "revolute"
        parent = "right"
        parent_point = "0 0 -2 m"
        child = "seat"
        child_point = "0.5 0 0 m"
        axis = [0, 1, 0]
        closes_loop = true
    "#;
    let run = LiveScene::new(&parse(text, &[])).unwrap();
    let found = frequencies(&run);
    let expected =
        (10.0 * 9.81 * 2.0 * 20.0_f64.to_radians().cos() / (10.0 * 4.0 + 2.0 * 0.5)).sqrt() / std::f64::consts::TAU;
    assert_eq!(found.len(), 1, "{found:?}");
    assert!((found[0] / expected - 1.0).abs() < 1e-6, "{found:?} {expected}");
}

#[test]
fn a_contact_at_rest_has_the_stiffness_of_its_law() {
    // A ball on its wall: the vertical frequency follows from the slope of K d^1.5 at the depth of its weight.
    let mut run = live("pendulum", &[("start", "equilibrium")]);
    let mut frame = Frame::default();
    run.sample_now(&mut frame);
    let joint = &frame.joints[0];
    let slope = 1.5 * joint.normal_force.norm() / joint.penetration;
    let mass: f64 = run.machine().bodies[0].mass;
    let eigenvalues = run.linearise().unwrap().matrix.complex_eigenvalues();
    // Damped a little by the restitution at the floor of the approach speed.
    let highest = eigenvalues.iter().filter(|x| x.im > 0.0).map(|x| x.norm()).fold(0.0, f64::max);
    let expected = (slope / mass).sqrt();
    assert!((highest / expected - 1.0).abs() < 3e-4, "{highest} {expected}");
}
