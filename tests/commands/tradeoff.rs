//! The trade-off of speed and accuracy on the command line and in the library.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use jointplay::analysis::{AnalysisError, Grid, Row, RunContext, Setting, Tradeoff, presets};
use jointplay::integrate::{Method, StepControl};
use jointplay::machine::Preset;
use jointplay::scene::BUILT_IN;
use serde_json::Value as Json;

use crate::program::{jointplay, names};

#[track_caller]
fn run(folder: &Path, line: &str, code: i32) -> String {
    let outcome = jointplay(folder, line).expect(code);
    outcome.stdout + &outcome.stderr
}

/// A cheap scene: a rod on an ideal joint.
const SMALL: &str = "pendulum --set contact.clearance=0 --quick --quiet";

#[test]
fn the_command_writes_all_files_or_none() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &format!("tradeoff trammel {SMALL} --out out"), 0);
    assert!(output.contains("rk4") && output.contains("trammel") && output.contains("no impact"), "{output}");
    let out = folder.path().join("out");
    assert_eq!(names(folder.path()), ["out"], "no other file is left");
    assert_eq!(names(&out), ["manifest.json", "tradeoff.csv"]);

    let csv = fs::read_to_string(out.join("tradeoff.csv")).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert!(rows.iter().all(|row| row.len() == rows[0].len()), "{csv}");
    let column = |name: &str| rows[0].iter().position(|head| *head == name).unwrap();
    for scene in ["trammel", "pendulum"] {
        let of_scene = || rows.iter().filter(|row| row[column("scene")] == scene);
        for method in Method::ALL {
            assert!(of_scene().any(|row| row[column("method")] == method.word()), "{scene}, {method}");
        }
        for preset in Preset::ALL {
            let count = of_scene().filter(|row| row[column("preset")] == preset.word()).count();
            assert_eq!(count, 1, "{scene}, {preset:?}");
        }
    }
    for row in rows.iter().skip(1) {
        let value = |name: &str| row[column(name)].parse::<f64>().unwrap_or(0.0);
        assert!(value("span_s") == 0.1 && value("steps") > 0.0, "{row:?}");
        assert!(row[column("end")] != "reached" || value("cost") >= value("evaluations"), "{row:?}");
    }
    let baseline = rows.iter().find(|row| row[column("method")] == "rk4" && row[column("step_s")].parse() == Ok(1e-5));
    assert_eq!(baseline.unwrap()[column("ratio")], "1");

    let manifest: Json = serde_json::from_str(&fs::read_to_string(out.join("manifest.json")).unwrap()).unwrap();
    assert_eq!(manifest["scenes"], serde_json::json!(["trammel", "pendulum"]));
    assert!(manifest["machine"].is_string(), "{manifest}");

    // Existing results are refused before any measurement and stay unchanged.
    fs::write(folder.path().join("presets.json"), "mine").unwrap();
    for option in ["--quick --out out", "--presets presets.json"] {
        let message = run(folder.path(), &format!("tradeoff pendulum --quiet {option}"), 1);
        assert!(message.contains("--force"), "{message}");
    }
    assert_eq!(fs::read_to_string(folder.path().join("presets.json")).unwrap(), "mine");
}

#[test]
fn the_record_has_the_presets_of_the_scenes_measured() {
    let folder = tempfile::tempdir().unwrap();
    // A file of the user's has no place in it.
    fs::copy("assets/benchmarks/ball.toml", folder.path().join("mine.toml")).unwrap();
    run(folder.path(), "tradeoff ball mine.toml --quiet --presets record.json", 0);
    assert_eq!(names(folder.path()), ["mine.toml", "record.json"]);
    let text = fs::read_to_string(folder.path().join("record.json")).unwrap();
    let record: presets::Record = serde_json::from_str(&text).unwrap();
    assert_eq!(record.scenes.keys().collect::<Vec<_>>(), ["ball"]);
    let measured = &record.scenes["ball"];
    assert_eq!(measured.len(), Preset::ALL.len() + 1);
    assert_eq!(measured[presets::DEFAULT].setting, ("automatic".to_owned(), 1e-6));
    assert_eq!(measured["accurate"].setting, ("automatic".to_owned(), 1e-7));
    let errors = Preset::ALL.map(|preset| measured[preset.word()].peak_error.unwrap());
    assert!(errors.windows(2).all(|pair| pair[1] <= pair[0]), "from fast to accurate: {errors:?}");
    assert!(record.pace["ball"] > 0.0);
}

#[test]
fn errors_about_invalid_input_state_what_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    for (line, fragment) in [
        ("tradeoff", "SCENE"),
        ("tradeoff pendulum pendulm --quick", "pendulm"),
        ("tradeoff pendulum --quick --presets p.json", "cannot be used with"),
        ("tradeoff pendulum --set contact.clearence=1mm", "contact.clearance"),
        ("tradeoff --all --write .", "tradeoff SCENE"),
        ("bench --quiet", "tradeoff SCENE"),
    ] {
        let message = run(folder.path(), line, 2);
        assert!(message.contains(fragment), "{line}: {message}");
    }
    assert!(names(folder.path()).is_empty());
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_measurement_writes_nothing() {
    use crate::command_line::{signal, start_and_listen};
    let folder = tempfile::tempdir().unwrap();
    let line = "tradeoff chain --quiet --out out --presets record.json";
    let child = start_and_listen(&mut crate::program::command(folder.path(), line));
    signal(&child, "-INT");
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    assert!(output.stdout.is_empty());
    assert!(names(folder.path()).is_empty(), "{:?}", names(folder.path()));
}

/// Runs an analysis without a clock.
fn measure<T>(
    analysis: impl FnOnce(&mut RunContext) -> Result<T, AnalysisError>,
    max_reports: u64,
) -> Result<T, AnalysisError> {
    let mut reports = 0;
    let mut progress = |done: f64| {
        assert!((0.0..=1.0).contains(&done), "{done}");
        reports += 1;
        if reports > max_reports { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    analysis(&mut RunContext::new(&mut || 0.0, &mut progress))
}

#[test]
fn finer_steps_and_tolerances_reduce_the_error_and_raise_the_cost() {
    let scene = crate::common::scene("spcmm", &[]);
    let grid = Grid {
        span_s: 0.013,
        max_cost: 1e6,
        steps: &[10e-6, 3e-6],
        tolerances: &[1e-4, 1e-8],
        steps_per_impact: &[4.0, 64.0],
    };
    let found = measure(|context| Tradeoff::measure(&scene, &grid, context), u64::MAX).unwrap();
    let row = |method: Method, value: f64| -> &Row {
        let matches = |row: &&Row| row.setting.method == method && row.setting.value() == value;
        found.rows.iter().find(matches).unwrap()
    };
    for method in Method::ALL {
        let [coarse, fine] = match method.control() {
            StepControl::Fixed => [10e-6, 3e-6],
            StepControl::Error => [1e-4, 1e-8],
            StepControl::PerImpact => [4.0, 64.0],
        };
        let (coarse, fine) = (row(method, coarse), row(method, fine));
        let (coarse_error, fine_error) = (coarse.errors.peak.unwrap(), fine.errors.peak.unwrap());
        println!("{method}: {coarse_error:e} {fine_error:e}");
        assert!(fine_error < 0.6 * coarse_error, "{method}");
        assert!(fine.cost.unwrap() > 2.0 * coarse.cost.unwrap(), "{method}");
    }
    // Two methods of high order that agree with the reference also confirm it.
    assert!(row(Method::Radau5, 1e-8).errors.peak.unwrap() < 1e-5);
    assert!(row(Method::DormandPrince5, 1e-8).errors.peak.unwrap() < 1e-5);
    // Cost is counted, and the same in every run.
    let again = measure(|context| Tradeoff::measure(&scene, &grid, context), u64::MAX).unwrap();
    for (row, again) in found.rows.iter().zip(&again.rows) {
        assert_eq!((row.cost, row.errors), (again.cost, again.errors), "{}", row.setting.method);
    }
    assert_eq!(measure(|context| Tradeoff::measure(&scene, &grid, context), 20).unwrap_err(), AnalysisError::Cancelled);
}

#[test]
fn a_scene_whose_reference_fails_has_no_result() {
    // Balls leave their sockets.
    let soft = crate::common::scene("pendulum", &[("contact.youngs_modulus", "1 MPa"), ("gravity.z", "-1000 m/s^2")]);
    let error = measure(|context| Tradeoff::measure(&soft, &Grid::QUICK, context), u64::MAX).unwrap_err();
    assert!(matches!(error, AnalysisError::Stopped(_)), "{error}");
}

#[test]
fn the_built_in_presets_equal_the_measured_ones() {
    let record = presets::record();
    for name in BUILT_IN {
        let machine = crate::common::scene(name, &[]).machine;
        for preset in Preset::ALL {
            let stale = format!("{name}, {preset:?}: measure the presets again, see docs/checks.md");
            let measured = presets::measured(name, preset.word()).unwrap_or_else(|| panic!("{stale}"));
            let setting = Setting::of_preset(preset, &machine);
            assert_eq!(
                (measured.setting.0.as_str(), measured.setting.1),
                (setting.method.word(), setting.value()),
                "{stale}"
            );
            let (error, limit) = (measured.peak_error.unwrap(), presets::limit(preset));
            assert!(error <= limit, "{name}, {preset:?}: {error:e} against {limit:e}");
        }
    }
    assert_eq!(record.scenes.len(), BUILT_IN.len());
    assert_eq!(presets::measured("mine", "accurate"), None);
}
