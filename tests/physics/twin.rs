//! Displaced states, and exponents and regimes from twin runs of a mechanism.

use crate::common::{Changes, METHODS, frame_now, parse, run_until, scene, simulation};
use jointplay_analysis::drive::{drive_period, observed};
use jointplay_analysis::point::{Plan, PointResult, PointRun};
use jointplay_analysis::regime::Regime;
use jointplay_physics::simulate::Simulation;

/// Displaces coordinate `i` by `by` and nothing else.
fn displace_coordinate(simulation: &mut Simulation, i: usize, by: f64) {
    let mut offset = vec![0.0; simulation.state_vector().len()];
    offset[i] = by;
    simulation.displace(&offset);
}

#[test]
fn a_displaced_state_continues_from_its_displacement() {
    let mut simulation = simulation("spcmm", &[]);
    run_until(&mut simulation, 0.005);
    let before = frame_now(&mut simulation);
    // The first coordinate of the tree is the free platform's x.
    displace_coordinate(&mut simulation, 0, 1e-5);
    let after = frame_now(&mut simulation);
    assert_eq!(after.time, before.time);
    let shift = after.pose.position - before.pose.position;
    assert!((shift.x - 1e-5).abs() < 1e-15 && shift.yz().norm() < 1e-15);
    for (a, b) in before.joints.iter().zip(&after.joints) {
        assert!(((b.eccentricity - a.eccentricity).x - 1e-5).abs() < 1e-14);
    }
    let norm = |simulation: &Simulation| simulation.state_vector()[3..7].iter().map(|q| q * q).sum::<f64>();
    displace_coordinate(&mut simulation, 4, 1e-3);
    assert!((norm(&simulation) - 1.0).abs() < 1e-15);
    run_until(&mut simulation, 0.02);
}

#[test]
fn contacts_follow_a_displacement_and_keep_their_state() {
    let mut simulation = simulation("spcmm", &[]);
    run_until(&mut simulation, 1.0);
    let contacts = |simulation: &Simulation| [0, 1, 2].map(|j| simulation.contact_states(j)[0]);
    let (settled, hash) = (contacts(&simulation), simulation.state_hash());
    assert!(settled.iter().all(|m| m.active));
    let begun = |simulation: &Simulation| [0, 1, 2].map(|j| simulation.statistics().joints[j].impacts);
    let impacts = begun(&simulation);
    // A zero displacement changes nothing.
    let none = vec![0.0; simulation.state_vector().len()];
    simulation.displace(&none);
    assert_eq!(simulation.state_hash(), hash);
    // X points down: 50 um up lifts the balls off their walls, and 50 um down restores contact.
    displace_coordinate(&mut simulation, 0, -5e-5);
    assert!(contacts(&simulation).iter().all(|m| !m.active));
    displace_coordinate(&mut simulation, 0, 5e-5);
    let floor = simulation.machine().contact.impact_speed_floor;
    for m in contacts(&simulation) {
        assert!(m.active && m.approach_speed >= floor);
    }
    assert_eq!(begun(&simulation), impacts);
    // A displacement of a tenth of a nanometre keeps the contacts.
    let before = contacts(&simulation);
    displace_coordinate(&mut simulation, 0, 1e-10);
    assert_eq!(contacts(&simulation), before);
    run_until(&mut simulation, 1.01);
}

#[test]
fn ideal_joints_stay_closed_under_a_displacement() {
    let mut simulation = simulation("slider-crank", &[]);
    run_until(&mut simulation, 0.05);
    let offset: Vec<f64> = (0..simulation.state_vector().len()).map(|i| 1e-4 * (i as f64).sin()).collect();
    simulation.displace(&offset);
    let frame = frame_now(&mut simulation);
    assert!(frame.joints[0].eccentricity.norm() < 1e-12);
    run_until(&mut simulation, 0.06);
}

fn point(name: &str, changes: &Changes, periods: usize, discard: usize) -> PointResult {
    let scene = scene(name, changes);
    let plan = Plan { periods, discard, phase: 0.0, exponent: true };
    let mut run = PointRun::cold(&scene, &plan.into(), drive_period(&scene).unwrap()).unwrap();
    while !run.is_done() {
        run.step().unwrap();
    }
    run.finish().0
}

/// A settled ball creeps in its socket like an overdamped pendulum of length c: its load N pulls it back with stiffness N / c, and
/// friction damps it with cf N / (v_theta - v_a). A deviation decays at the rate (v_theta - v_a) / (c cf).
#[test]
fn settled_creep_has_the_exponent_of_an_overdamped_pendulum() {
    for (clearance, friction) in [(3e-4, 0.15), (3e-4, 0.3), (1.5e-4, 0.2)] {
        let (c, cf) = (format!("{clearance} m"), friction.to_string());
        let changes = [("contact.clearance", c.as_str()), ("contact.friction", cf.as_str())];
        let result = point("spcmm", &changes, 14, 4);
        let exponent = result.evidence.exponent.as_ref().unwrap();
        let predicted = -(1e-4 - 1e-6) / (clearance * friction);
        // The load is not constant over a period, and the three balls are coupled by the platform.
        let ratio = exponent.value / predicted;
        assert!((0.9..1.15).contains(&ratio), "{} for {predicted}", exponent.value);
        assert!(exponent.standard_error < 0.02 * exponent.value.abs(), "{}", exponent.standard_error);
        assert_eq!(result.regime, Regime::Periodic(1));
        assert_eq!(exponent.running.len(), 10);
    }
}

/// Without friction nothing damps the swinging of the balls in their sockets.
#[test]
fn a_frictionless_mechanism_is_chaotic() {
    let result = point("spcmm", &[("contact.friction", "0"), ("spcmm.frequency", "2 Hz")], 12, 2);
    let exponent = result.evidence.exponent.as_ref().unwrap();
    assert_eq!(result.regime, Regime::Chaotic);
    assert!(exponent.value > 1.0, "{}", exponent.value);
    assert_eq!(result.evidence.distinct, result.evidence.sections);
}

#[test]
fn an_ideal_mechanism_repeats_exactly_and_has_no_exponent() {
    let result = point("spcmm", &[("contact.clearance", "0")], 10, 1);
    assert_eq!(result.regime, Regime::Periodic(1));
    assert!(result.evidence.exponent.is_none());
    let (largest, _) = result.probe.unwrap();
    assert!(largest < 1e-9, "{largest}");
    let reaction = result.joints[1].peak;
    assert!(reaction > 8.5687 && reaction < 12.0, "{reaction}");
}

/// The twin does not disturb the run.
#[test]
fn sections_equal_those_of_a_run_without_a_twin() {
    let scene = scene("spcmm", &[]);
    let period = drive_period(&scene).unwrap();
    let sections = |exponent: bool| {
        let plan = Plan { periods: 3, discard: 1, phase: 0.0, exponent };
        let mut run = PointRun::cold(&scene, &plan.into(), period).unwrap();
        while !run.is_done() {
            run.step().unwrap();
        }
        run.finish().0.sections
    };
    let plain = sections(false);
    assert_eq!(plain, sections(true));
    // The last section has the pose of the machine at 6 s.
    let mut simulation = Simulation::new(&scene.machine).unwrap();
    for end in [2.0, 4.0, 6.0] {
        run_until(&mut simulation, end);
    }
    assert_eq!(&plain[12..], observed(&frame_now(&mut simulation).pose));
}

#[test]
fn drives_report_their_common_period() {
    assert_eq!(drive_period(&scene("spcmm", &[])), Ok(2.0));
    let crank = drive_period(&scene("slider-crank-driven", &[])).unwrap();
    assert!((crank - std::f64::consts::TAU / 6.0).abs() < 1e-15);
    // The laws of force elements have periods like those of drives.
    let tyre = "ground = { law = \"harmonic\", amplitude = \"1 mm\", frequency = \"4 Hz\" }";
    let load = "[[load]]\nname = \"wind\"\non = { body = \"wheel\" }\nforce = \"1 0 0 N\"\nfrequency = \"4 Hz\"";
    for element in [tyre, load, ""] {
        let text = format!(
            "[[body]]\nname = \"wheel\"\nmass = \"20 kg\"\ninertia = \"1 1 1 kg m^2\"\n\
             [[joint]]\nname = \"wheel\"\nkind = \"free\"\nchild = \"wheel\"\nstart = {{ position = \"0 0 0.3 m\" }}\n\
             [[tyre]]\nname = \"t\"\non = {{ body = \"wheel\" }}\nup = [0, 0, 1]\nradius = \"0.3 m\"\nstiffness = \"50 N/mm\"\n{element}\n"
        );
        let period = drive_period(&parse(&text, &[]));
        assert_eq!(period.ok(), (!element.is_empty()).then_some(0.25), "{element}");
    }
    for scene_name in ["pendulum", "chain", "slider-crank"] {
        assert!(drive_period(&scene(scene_name, &[])).is_err(), "{scene_name}");
    }
}

/// Sections and exponent of a scene over `periods` periods, of which the first `discard` are discarded.
fn exponent_of(scene: &jointplay_scene::Scene, periods: usize, discard: usize) -> PointResult {
    let period = drive_period(scene).expect("a drive");
    let plan = Plan { periods, discard, phase: 0.0, exponent: true };
    let mut run = PointRun::cold(scene, &plan.into(), period).expect("starts");
    while !run.is_done() {
        run.step().expect("runs");
    }
    run.finish().0
}

/// A periodic motion has no positive exponent, whatever steps its method takes; it was once reported as +165 1/s.
#[test]
fn a_periodic_motion_has_no_positive_exponent() {
    for method in ["automatic", "dopri5", "radau5"] {
        let changes = [("parameter.speed", "22.6271186440678 rad/s"), ("solver.method", method)];
        let result = exponent_of(&scene("four-bar", &changes), 30, 20);
        assert_eq!(result.regime, Regime::Periodic(1), "{method}");
        let value = result.evidence.exponent.expect("a twin").value;
        assert!(value < 0.2, "{method}: {value}");
    }
}

/// Exponents of a mass between two stops on an oscillating carriage against independent computations (SciPy DOP853 at 1e-12 with
/// located contacts, eight neighbours).
#[test]
fn exponents_agree_with_independent_computations() {
    let carriage = |rate: &str| {
        let text = format!(
            r#"
            [gravity]
            z = 0
            [[body]]
            name = "carriage"
            mass = "1 kg"
            inertia = "1e-3 1e-3 1e-3 kg m^2"
            [[joint]]
            name = "carriage"
            kind = "prismatic"
            child = "carriage"
            axis = [1, 0, 0]
            drive = {{ law = "harmonic", amplitude = "10 mm", frequency = "{rate} Hz" }}
            [[body]]
            name = "mass"
            mass = "0.5 kg"
            inertia = "1e-3 1e-3 1e-3 kg m^2"
            [[joint]]
            name = "mass"
            kind = "prismatic"
            parent = "carriage"
            child = "mass"
            axis = [1, 0, 0]
            start = {{ position = "0.3 mm" }}
            [[joint_spring]]
            name = "spring"
            joint = "mass"
            stiffness = "200 N/m"
            damping = "0.5 N s/m"
            [[stop]]
            name = "stop"
            joint = "mass"
            lower = "-3 mm"
            upper = "2 mm"
            force = "100 N"
            depth = "0.2 mm"
            restitution = 0.7
            speed = "0.3 m/s"
            "#
        );
        parse(&text, &[])
    };
    let value = |result: &PointResult| result.evidence.exponent.as_ref().expect("a twin").value;
    for (rate, expected, tolerance) in [("3.6", 1.85, 0.4), ("4.2", 2.30, 0.4), ("5.4", 3.20, 0.4), ("5.8", 2.83, 0.4)]
    {
        let result = exponent_of(&carriage(rate), 600, 100);
        assert_eq!(result.regime, Regime::Chaotic, "{rate} Hz");
        assert!((value(&result) - expected).abs() < tolerance, "{rate} Hz: {}", value(&result));
    }
    let result = exponent_of(&carriage("10"), 160, 60);
    assert_eq!(result.regime, Regime::Periodic(2));
    assert!((value(&result) + 12.51).abs() < 0.2, "{}", value(&result));
}

#[test]
fn a_twin_that_adopts_the_step_control_takes_the_same_steps() {
    let mut run = simulation("four-bar", &[("solver.preset", "preview")]);
    run.advance_to(0.3).expect("runs");
    let twin = |offset: f64| {
        let mut twin = run.clone();
        twin.displace(&[offset; 8]);
        twin
    };
    let (mut follower, mut alone) = (twin(1e-9), twin(1e-9));
    let before = run.statistics().steps;
    for _ in 0..400 {
        run.step().expect("runs");
        for other in [&mut follower, &mut alone] {
            while other.time() < run.time() {
                other.step_until(run.time()).expect("runs");
            }
        }
        follower.adopt_step_control(&run);
    }
    // Rounding splits some of the follower's steps in two; a twin that chooses its own is truncated at nearly every one of
    // the run's.
    let steps = |of: &Simulation| of.statistics().steps - before;
    assert!(steps(&follower) < 600, "{}", steps(&follower));
    assert!(steps(&alone) > 800, "{}", steps(&alone));
}

#[test]
fn states_stepped_in_turn_in_one_workspace_have_the_bits_of_states_in_their_own() {
    for method in METHODS {
        let mut alone = simulation("pendulum", &[("solver.method", method), ("solver.step", "20 us")]);
        let model = alone.model().clone();
        let mut states = [model.start(), model.start()];
        let mut workspace = model.workspace(&states[0]);
        while alone.time() < 0.015 {
            alone.step().expect("runs");
            for state in &mut states {
                model.step(state, &mut workspace).expect("runs");
            }
        }
        assert!(alone.statistics().impacts() > 0, "{method}");
        for state in &states {
            assert!(state == alone.state(), "{method}");
        }
    }
}
