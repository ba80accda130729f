//! A result that is not to be trusted says so, and why; one that is says nothing.

mod common;

use common::{Changes, run_until, simulation};
use jointplay::simulate::Simulation;

fn words(simulation: &Simulation) -> Vec<String> {
    let doubts = simulation.doubts();
    doubts.iter().map(ToString::to_string).collect()
}

fn ran(scene: &str, changes: &Changes, duration: f64) -> Simulation {
    let mut simulation = simulation(scene, changes);
    run_until(&mut simulation, duration);
    simulation
}

#[test]
fn nothing_speaks_against_the_built_in_scenes_with_any_preset() {
    for scene in common::SCENES {
        for preset in ["preview", "real-time", "accurate"] {
            let simulation = ran(scene, &[("solver.preset", preset)], 0.03);
            let none: [String; 0] = [];
            assert_eq!(words(&simulation), none, "{scene}, {preset}");
        }
    }
    let rk4 = ran("spcmm", &[("solver.method", "rk4")], 0.03);
    assert_eq!(rk4.statistics().coarse, [0; 3]);
    assert!(rk4.doubts().is_empty(), "{:?}", rk4.doubts());
}

#[test]
fn each_doubt_is_told_once_and_names_its_joint() {
    let rk4 = ("solver.method", "rk4");
    let cases: [(&str, &Changes, &str); 6] = [
        (
            "pendulum",
            &[rk4, ("solver.step", "40 us")],
            "lasted fewer than 5 steps",
        ),
        (
            "pendulum",
            &[("contact.impact_speed_floor", "10 m/s")],
            "S1: 4 of 4 contacts began slower than impact_speed_floor",
        ),
        (
            "spcmm",
            &[("contact.youngs_modulus", "10 MPa")],
            "(and 2 more): the contact patch reached",
        ),
        (
            "spcmm",
            &[
                ("contact.restitution", "0"),
                ("contact.normal_law", "hunt-crossley"),
            ],
            "restitution 0 with hunt-crossley, which is right only near 1",
        ),
        (
            "spcmm",
            &[("solver.tolerance", "1e-2")],
            "solver.tolerance 1e-2",
        ),
        (
            "spcmm",
            &[("joint.S2.clearance", "5 um")],
            "S2: clearance 0.005 mm is so small",
        ),
    ];
    for (scene, changes, expected) in cases {
        let doubts = words(&ran(scene, changes, 0.03));
        let said = doubts.iter().filter(|doubt| doubt.contains(expected));
        assert_eq!(said.count(), 1, "{scene} {changes:?}: {doubts:#?}");
    }
}

#[test]
fn a_reset_forgets_what_the_run_met_and_a_snapshot_keeps_it() {
    let changes = [("contact.impact_speed_floor", "10 m/s")];
    let mut simulation = ran("pendulum", &changes, 0.03);
    let kept = simulation.doubts();
    assert_eq!(kept.len(), 1);
    let snapshot = simulation.snapshot();
    simulation.reset().unwrap();
    assert!(simulation.doubts().is_empty());
    simulation.restore(&snapshot).unwrap();
    assert_eq!(simulation.doubts(), kept);
}

#[test]
fn the_summary_of_a_run_marks_it() {
    let run = |form: &str, floor: &str| {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_jointplay"))
            .args([
                "run",
                "pendulum",
                "--duration",
                "20ms",
                "--quiet",
                "--summary",
                form,
            ])
            .args(["--set", floor])
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let (odd, usual) = (
        "contact.impact_speed_floor=10m/s",
        "contact.impact_speed_floor=1mm/s",
    );
    let json: serde_json::Value = serde_json::from_str(&run("json", odd)).unwrap();
    assert_eq!(json["doubts"].as_array().unwrap().len(), 1, "{json}");
    assert_eq!(json["slower_than_asked"], false);
    let json: serde_json::Value = serde_json::from_str(&run("json", usual)).unwrap();
    assert!(json["doubts"].as_array().unwrap().is_empty(), "{json}");
    assert!(
        run("text", odd).contains("Not trusted       S1: "),
        "{}",
        run("text", odd)
    );
    assert!(!run("text", usual).contains("Not trusted"));
}
