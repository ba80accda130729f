//! Untrustworthy results raise a doubt with its reason; trustworthy ones raise none.

use crate::common::{Changes, frame_now, free_ball, parse, run_until, simulation};
use jointplay_physics::machine;
use jointplay_physics::simulate::{Doubt, Simulation};
use jointplay_scene::built_in_text;

fn doubt_texts(simulation: &Simulation) -> Vec<String> {
    let doubts = simulation.doubts();
    doubts.iter().map(ToString::to_string).collect()
}

fn run_for(scene: &str, changes: &Changes, duration: f64) -> Simulation {
    let mut simulation = simulation(scene, changes);
    run_until(&mut simulation, duration);
    simulation
}

#[test]
fn the_built_in_scenes_raise_no_doubt_with_any_preset() {
    for scene in crate::common::SCENES {
        for preset in ["preview", "real-time", "accurate"] {
            let simulation = run_for(scene, &[("solver.preset", preset)], 0.03);
            let none: [String; 0] = [];
            assert_eq!(doubt_texts(&simulation), none, "{scene}, {preset}");
        }
    }
    let rk4 = run_for("spcmm", &[("solver.method", "rk4")], 0.03);
    assert_eq!(rk4.statistics().joints.iter().map(|joint| joint.coarse).collect::<Vec<_>>(), [0; 3]);
    assert!(rk4.doubts().is_empty(), "{:?}", rk4.doubts());
}

#[test]
fn longer_runs_with_default_settings_raise_no_doubt() {
    for scene in crate::common::SCENES {
        let simulation = run_for(scene, &[], 0.1);
        assert_eq!(simulation.doubts(), [], "{scene}");
        let simulation = run_for(scene, &[("formulation", "lagrange")], 0.03);
        assert_eq!(simulation.doubts(), [], "{scene}, lagrange");
    }
}

/// A scene, changes, for how long, and whether a doubt is the one expected.
type Case<'a> = (&'a str, &'a Changes<'a>, f64, fn(&Doubt) -> bool);

#[test]
fn a_wrong_energy_raises_a_doubt() {
    let coarse = [("solver.method", "rk4"), ("solver.step", "50 us")];
    let loose = [("solver.method", "dopri5"), ("solver.tolerance", "1e-3")];
    let heavy = [("solver.method", "rk4"), ("gravity.x", "981 m/s^2")];
    let energy = |doubt: &Doubt| matches!(doubt, Doubt::Energy { share, .. } if *share > 5e-3);
    let too_few_steps = |doubt: &Doubt| matches!(doubt, Doubt::Unresolved { steps: 5, .. });
    let stability_limited = |doubt: &Doubt| matches!(doubt, Doubt::StabilityLimited { share, .. } if *share > 0.1);
    let work =
        |doubt: &Doubt| matches!(doubt, Doubt::Work { value, residual, .. } if residual.abs() > 0.1 * value.abs());
    let looser = [("solver.method", "dopri5"), ("solver.tolerance", "4e-4")];
    let cases: [Case; 7] = [
        ("pendulum", &coarse, 0.01, energy),
        ("pendulum", &coarse, 0.01, too_few_steps),
        ("spcmm", &coarse, 0.012, energy),
        ("spcmm", &coarse, 0.012, too_few_steps),
        ("spcmm", &heavy, 0.01, energy),
        ("spcmm", &loose, 0.5, stability_limited),
        ("pendulum", &looser, 0.5, work),
    ];
    for (scene, changes, duration, expected) in cases {
        let doubts = run_for(scene, changes, duration).doubts();
        let count = doubts.iter().filter(|doubt| expected(doubt)).count();
        assert_eq!(count, 1, "{scene} {changes:?}: {doubts:#?}");
        for doubt in &doubts {
            let text = doubt.to_string();
            assert!(text.ends_with('.') && !text.contains("NaN"), "{text}");
        }
    }
    // Without a ledger there is no doubt about energy; that about the steps stays.
    let off = [coarse[0], coarse[1], ("solver.energy_ledger", "off")];
    let doubts = run_for("pendulum", &off, 0.01).doubts();
    assert!(doubts.iter().any(too_few_steps) && !doubts.iter().any(energy), "{doubts:?}");
}

#[test]
fn damping_beyond_its_domain_names_joint_and_instant() {
    let changes = [("chain.links", "12"), ("contact.approach_speed", "start"), ("solver.tolerance", "1e-4")];
    let simulation = run_for("chain", &changes, 0.06);
    let doubts = simulation.doubts();
    let damping = doubts.iter().find_map(|doubt| match doubt {
        Doubt::Damping { joints, time, ratio, usual } => Some((joints, *time, *ratio, *usual)),
        _ => None,
    });
    let (joints, time, ratio, undisturbed) = damping.expect("a doubt about damping");
    assert!(joints.worst.starts_with('J') && (0.0..0.06).contains(&time), "{doubts:?}");
    assert!(ratio > undisturbed + 1.0 && (undisturbed - 0.1425).abs() < 1e-6, "{doubts:?}");
}

#[test]
fn each_doubt_is_reported_once_with_its_joint() {
    let rk4 = ("solver.method", "rk4");
    let cases: [(&str, &Changes, &str); 6] = [
        ("pendulum", &[rk4, ("solver.step", "40 us")], "lasted fewer than 5 steps"),
        (
            "pendulum",
            &[("contact.impact_speed_floor", "10 m/s")],
            "S1: 4 of 4 contacts began slower than impact_speed_floor",
        ),
        ("spcmm", &[("contact.youngs_modulus", "10 MPa")], "(and 2 more): the contact patch reached"),
        (
            "spcmm",
            &[("contact.restitution", "0"), ("contact.normal_law", "hunt-crossley")],
            "restitution 0 with hunt-crossley gives 0.488",
        ),
        ("spcmm", &[("solver.tolerance", "1e-2")], "solver.tolerance 1e-2"),
        ("spcmm", &[("joint.S2.clearance", "5 um")], "S2: clearance 0.005 mm is so small"),
    ];
    for (scene, changes, expected) in cases {
        let doubts = doubt_texts(&run_for(scene, changes, 0.03));
        let matching = doubts.iter().filter(|doubt| doubt.contains(expected));
        assert_eq!(matching.count(), 1, "{scene} {changes:?}: {doubts:#?}");
    }
}

#[test]
fn a_reset_clears_doubts_and_a_snapshot_keeps_them() {
    let changes = [("contact.impact_speed_floor", "10 m/s")];
    let mut simulation = crate::common::live("pendulum", &changes);
    run_until(&mut simulation, 0.03);
    let expected = simulation.doubts();
    assert_eq!(expected.len(), 1);
    let snapshot = simulation.snapshot();
    simulation.reset().unwrap();
    assert!(simulation.doubts().is_empty());
    simulation.restore(&snapshot);
    assert_eq!(simulation.doubts(), expected);
}

/// Lines of `[contact]`.
const PLAY: &str = r#"clearance = "0.3 mm""#;

/// The energy exchanged by a bouncing ball grows with every bounce, its stored energy does not.
#[test]
fn steady_drift_raises_a_doubt_even_after_many_exchanges_of_energy() {
    let text = free_ball(0.0, 0.0, -9.81, PLAY);
    let cases: [(&Changes, bool); 3] = [
        (&[("solver.preset", "preview")], true),
        (&[("solver.method", "dopri5"), ("solver.tolerance", "1e-4")], true),
        (&[], false),
    ];
    for (changes, drifts) in cases {
        let changes = [changes, &[("contact.normal_law", "hertz")]].concat();
        let mut simulation = Simulation::new(&parse(&text, &changes).machine).unwrap();
        run_until(&mut simulation, 10.0);
        let ledger = simulation.ledger().unwrap();
        let share = ledger.residual().abs() / (0.1 * 9.81 * 3e-4);
        let has_doubt = simulation.doubts().iter().any(|doubt| matches!(doubt, Doubt::Energy { .. }));
        assert_eq!(has_doubt, drifts, "{changes:?}: {:?}", simulation.doubts());
        assert_eq!(share > 0.1, drifts, "{changes:?}: {share}");
    }
}

/// At rest under a load hardly any energy is exchanged, so that rounding is a large part of it, and nothing rebounds.
#[test]
fn a_ball_at_rest_under_a_load_raises_no_doubt() {
    let load = "[[load]]\nname = \"L\"\non = { body = \"ball\" }\nforce = \"0 0 -100 N\"";
    let text = format!("start = \"settled\"\n{}{load}", free_ball(0.0, 0.0, -9.81, PLAY));
    for changes in [
        &[][..],
        &[("solver.preset", "reference")],
        &[("contact.normal_law", "hertz"), ("contact.restitution", "1"), ("solver.tolerance", "1e-5")],
        &[("contact.normal_law", "hertz"), ("contact.restitution", "1"), ("solver.tolerance", "1e-7")],
    ] {
        let mut simulation = Simulation::new(&parse(&text, changes).machine).unwrap();
        run_until(&mut simulation, 1.0);
        assert_eq!(simulation.doubts(), [], "{changes:?}");
        let force = frame_now(&mut simulation).joints[0].normal_force.norm();
        assert!((force / 100.981 - 1.0).abs() < 1e-6, "{changes:?}: {force}");
        assert!(
            simulation.statistics().steps < 200 || changes.contains(&("solver.preset", "reference")),
            "{changes:?}"
        );
    }
}

#[test]
fn a_start_inside_a_stop_raises_a_doubt_with_depth_and_force() {
    let text = |start: &str| {
        format!(
            r#"
            [gravity]
            z = 0
            [[body]]
            name = "a"
            mass = "1 kg"
            inertia = "1e-3 1e-3 1e-3 kg m^2"
            [[joint]]
            name = "j"
            kind = "prismatic"
            child = "a"
            axis = [1, 0, 0]
            start = {{ position = "{start} mm" }}
            [[stop]]
            name = "end"
            joint = "j"
            upper = "10 mm"
            force = "100 N"
            depth = "0.1 mm"
            "#
        )
    };
    let doubts = |start: &str| doubt_texts(&Simulation::new(&parse(&text(start), &[]).machine).unwrap());
    let expected = "end: the machine starts 40 mm inside this stop, whose depth is 0.1 mm: it pushes with 800000 N; the start or the \
                limit is wrong.";
    assert_eq!(doubts("50"), [expected]);
    // A machine that rests on the stop raises none.
    assert!(doubts("10.05").is_empty() && doubts("5").is_empty());
}

/// Estimated duration of the pendulum's impacts with these sections added, s, if a step of 10 us does not resolve it.
fn doubted_duration(sections: &str) -> Option<f64> {
    let text = format!("{}\n{sections}", built_in_text("pendulum").expect("built in"));
    let scene = parse(&text, &[("solver.method", "rk4"), ("solver.step", "10 us")]);
    scene.machine.doubts().into_iter().find_map(|doubt| match doubt {
        machine::Doubt::Step { duration, .. } => Some(duration),
        _ => None,
    })
}

#[test]
fn a_load_shortens_the_estimated_impact() {
    let load = |force: &str| {
        let on = "{ body = \"rod\", at = [0, 0, 0] }";
        format!("[[load]]\nname = \"l\"\non = {on}\nforce = \"0 0 {force}\"\n")
    };
    assert_eq!(doubted_duration(&load("1 N")), None);
    let [less, more] = ["-1e4 N", "-1e8 N"].map(|force| doubted_duration(&load(force)).expect("short"));
    assert!(less < 5e-5 && more < 0.5 * less, "{less:e} {more:e}");
}
