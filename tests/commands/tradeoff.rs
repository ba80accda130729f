//! The trade-off of speed and accuracy on the command line and in the library.

use std::cell::Cell;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use jointplay::analysis::{
    AnalysisError, End, RunContext, Setting, WorkBudget, WorkPrecision, presets, work_precision,
};
use jointplay::integrate::{Method, StepControl};
use jointplay::machine::Preset;
use jointplay::scene::Scene;
use serde_json::Value as Json;

use crate::program::{jointplay, names};

#[track_caller]
fn run(folder: &Path, line: &str, code: i32) -> String {
    let outcome = jointplay(folder, line).expect(code);
    outcome.stdout + &outcome.stderr
}

const FILES: [&str; 5] = ["manifest.json", "tradeoff.csv", "tradeoff.json", "tradeoff.png", "tradeoff.svg"];

/// A cheap scene: a rod on an ideal joint.
const SMALL: &str = "pendulum --set contact.clearance=0 --quick --quiet";

#[test]
fn the_command_writes_all_files_or_none() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &format!("tradeoff {SMALL} --out out"), 0);
    assert!(output.contains("rk4") && output.contains("Settled motion"), "{output}");
    let out = folder.path().join("out");
    assert_eq!(names(folder.path()), ["out"], "no other file is left");
    assert_eq!(names(&out), FILES);

    let csv = fs::read_to_string(out.join("tradeoff.csv")).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert!(rows.iter().all(|row| row.len() == rows[0].len()), "{csv}");
    let column = |name: &str| rows[0].iter().position(|head| *head == name).unwrap();
    for method in Method::ALL {
        assert!(rows.iter().any(|row| row[0] == method.word()), "{method}");
    }
    for preset in Preset::ALL {
        let has_preset = |row: &&Vec<&str>| row[column("preset")] == preset.word();
        assert_eq!(rows.iter().filter(has_preset).count(), 1, "{preset:?}");
    }
    let error: f64 = rows[1][column("peak_error")].parse().unwrap();
    assert!(error >= 0.0);
    for row in rows.iter().skip(1) {
        let count = |name: &str| row[column(name)].parse::<f64>().unwrap_or(0.0);
        for phase in ["impacts", "settled"] {
            let phase_count = |name: &str| count(&format!("{phase}_{name}"));
            assert!(phase_count("steps") > 0.0 && phase_count("simulated_s") > 0.0, "{row:?}");
            assert!(phase_count("evaluations") >= phase_count("steps"), "{row:?}");
        }
    }

    let text = fs::read_to_string(out.join("tradeoff.json")).unwrap();
    let json: Json = serde_json::from_str(&text).unwrap();
    assert_eq!(json["points"].as_array().unwrap().len(), rows.len() - 1);
    assert_eq!(json["meta"]["changed_parameters"]["contact.clearance"], "0");
    assert!(json["meta"]["machine"].is_string());
    let png = fs::read(out.join("tradeoff.png")).unwrap();
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    let svg = fs::read_to_string(out.join("tradeoff.svg")).unwrap();
    assert!(svg.contains("radau5") && svg.contains("Time for a simulated second"));

    // Existing folders are refused before any measurement and stay unchanged.
    let message = run(folder.path(), &format!("tradeoff {SMALL} --out out"), 1);
    assert!(message.contains("--force"), "{message}");
    fs::create_dir(folder.path().join("photos")).unwrap();
    fs::write(folder.path().join("photos/holiday"), "mine").unwrap();
    let line = format!("tradeoff {SMALL} --out photos --force");
    run(folder.path(), &line, 1);
    assert_eq!(names(&folder.path().join("photos")), ["holiday"]);
}

#[test]
fn errors_about_invalid_input_state_what_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    for (line, fragment) in [
        ("tradeoff", "--all"),
        ("tradeoff pendulm --quick", "pendulum"),
        ("tradeoff --all", "--write"),
        ("tradeoff pendulum --all --write .", "cannot be used with"),
        ("tradeoff pendulum --set contact.clearence=1mm", "contact.clearance"),
        ("bench --set contact.friction=-1", "contact.friction"),
    ] {
        let message = run(folder.path(), line, 2);
        assert!(message.contains(fragment), "{line}: {message}");
    }
    let message = run(folder.path(), "tradeoff --all --write .", 1);
    assert!(message.contains("tradeoff"), "{message}");
    assert!(names(folder.path()).is_empty());
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_measurement_writes_nothing() {
    use crate::command_line::{signal, start_and_listen};
    let folder = tempfile::tempdir().unwrap();
    let child = start_and_listen(&mut crate::program::command(folder.path(), "tradeoff chain --quiet --out out"));
    signal(&child, "-INT");
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    assert!(output.stdout.is_empty());
    assert!(names(folder.path()).is_empty(), "{:?}", names(folder.path()));
}

/// Runs an analysis with a clock that advances at every reading, so that the result is the same on every computer.
fn measure<T>(
    analysis: impl FnOnce(&mut RunContext) -> Result<T, AnalysisError>,
    max_reports: u64,
) -> Result<T, AnalysisError> {
    let (readings, reports) = (Cell::new(0), Cell::new(0));
    let mut clock = || {
        readings.set(readings.get() + 1);
        readings.get() as f64 * 1e-4
    };
    let mut progress = |done: f64| {
        assert!((0.0..=1.0).contains(&done), "{done}");
        reports.set(reports.get() + 1);
        if reports.get() > max_reports { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    analysis(&mut RunContext::new(&mut clock, &mut progress))
}

fn error_at(diagram: &WorkPrecision, method: Method, value: f64) -> f64 {
    let matches = |p: &&jointplay::analysis::Point| p.setting.method == method && p.setting.value() == value;
    let point = diagram.points.iter().find(matches).unwrap();
    assert_eq!(point.impacts.end, End::Reached);
    point.errors.peak.unwrap()
}

#[test]
fn finer_steps_and_tolerances_reduce_the_error_and_raise_the_cost() {
    let scene = crate::common::scene("spcmm", &[]);
    let budget = WorkBudget {
        evaluations: 40_000,
        measured: 0.0,
        steps: &[10e-6, 3e-6],
        tolerances: &[1e-4, 1e-8],
        steps_per_impact: &[4.0, 64.0],
        seconds: f64::INFINITY,
    };
    let diagram = measure(|context| work_precision(&scene, &budget, context), u64::MAX).unwrap();
    for method in Method::ALL {
        let points: Vec<_> = diagram.points.iter().filter(|p| p.setting.method == method).collect();
        assert!(points.len() >= 2, "{method}");
        let [coarse, fine] = match method.control() {
            StepControl::Fixed => [10e-6, 3e-6],
            StepControl::Error => [1e-4, 1e-8],
            StepControl::PerImpact => [4.0, 64.0],
        };
        let (coarse_error, fine_error) = (error_at(&diagram, method, coarse), error_at(&diagram, method, fine));
        println!("{method}: {coarse_error:e} {fine_error:e}");
        assert!(fine_error < 0.6 * coarse_error, "{method}");
        let evaluations = |value: f64| {
            let point = points.iter().find(|p| p.setting.value() == value).unwrap();
            point.impacts.evaluations
        };
        assert!(evaluations(fine) > 2 * evaluations(coarse), "{method}");
    }
    // The reference is accurate enough to distinguish all settings, and the best settings approach it.
    let floor = diagram.reference.floor.peak.unwrap();
    assert!(floor < 1e-6, "{floor}");
    assert!(error_at(&diagram, Method::Radau5, 1e-8) < 1e-5);
    // The Pareto front is not empty, and no point on it is dominated.
    let front: Vec<_> = diagram.points.iter().filter(|p| p.impacts.front).collect();
    assert!(!front.is_empty());
    for point in &front {
        for other in &diagram.points {
            let (Some(a), Some(b)) = (point.errors.peak, other.errors.peak) else {
                continue;
            };
            let slower = other.impacts.wall_s >= point.impacts.wall_s;
            assert!(slower || b.max(floor) > a.max(floor), "{point:?} {other:?}");
        }
    }
}

#[test]
fn presets_can_be_measured_on_any_scene_and_cancelled() {
    let scene = crate::common::scene("pendulum", &[("contact.clearance", "0.5 mm")]);
    let measure_presets = |scene: &Scene, max_reports: u64| {
        measure(|context| presets::measure(scene, &Preset::ALL, context), max_reports)
    };
    let points = measure_presets(&scene, u64::MAX).unwrap();
    assert_eq!(points.len(), Preset::ALL.len());
    let errors: Vec<f64> = points.iter().map(|p| p.errors.peak.unwrap()).collect();
    assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "from fast to accurate: {errors:?}");
    for (point, preset) in points.iter().zip(Preset::ALL) {
        assert_eq!(point.preset, Some(preset));
        assert!(presets::Measured::of(point).impacts_ratio.is_some());
    }
    assert_eq!(measure_presets(&scene, 20).unwrap_err(), AnalysisError::Cancelled);
    // The reference run fails because balls leave their sockets.
    let soft = crate::common::scene("pendulum", &[("contact.youngs_modulus", "1 MPa"), ("gravity.z", "-1000 m/s^2")]);
    let error = measure_presets(&soft, u64::MAX).unwrap_err();
    assert!(matches!(error, AnalysisError::Stopped(_)), "{error}");
}

#[test]
fn the_built_in_presets_equal_the_measured_ones() {
    let record = presets::record();
    for preset in Preset::ALL {
        // `tests/texts/documents.rs` checks that the record has all built-in scenes.
        for name in presets::record().scenes.keys() {
            let (method, value) = &record.points[name][preset.word()];
            let setting = Setting::of_preset(preset, &crate::common::scene(name, &[]).machine);
            assert_eq!(
                (method.as_str(), *value),
                (setting.method.word(), setting.value()),
                "{name}, {preset:?} has changed: jointplay tradeoff --all --write ."
            );
            let measured = presets::measured(name, preset).unwrap();
            let error = measured.peak_error.unwrap();
            let limit = presets::limit(preset);
            assert!(error <= limit, "{name}, {preset:?}: {error:e} against {limit:e}");
        }
    }
    assert_eq!(presets::measured("mine", Preset::Accurate), None);
}
