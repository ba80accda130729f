//! The energy ledger and the restitution check in files and summaries.

use std::fs;
use std::path::Path;

use serde_json::Value as Json;

use crate::program::jointplay;

/// Standard output of a successful run.
fn stdout_of(folder: &Path, line: &str) -> String {
    jointplay(folder, line).expect(0).stdout
}

fn json(path: &Path) -> Json {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

fn column(file: &Json, name: &str) -> Vec<f64> {
    let values = file["columns"][name].as_array();
    let values = values.unwrap_or_else(|| panic!("no column {name}"));
    values.iter().map(|value| value.as_f64().unwrap()).collect()
}

const LAST_COLUMNS: &str = "drive_work_J,gravity_work_J,restitution_loss_J,friction_loss_J,\
                            clearance_work_J,energy_residual_J";

#[test]
fn rows_contain_an_energy_ledger_that_balances() {
    let folder = tempfile::tempdir().unwrap();
    let run = "run spcmm --duration 30ms --every 0.1ms";
    let summary = stdout_of(folder.path(), &format!("{run} --out run.json --summary json"));
    let summary: Json = serde_json::from_str(&summary).unwrap();
    let file = json(&folder.path().join("run.json"));
    let get = |name: &str| column(&file, name);
    let (kinetic, elastic) = (get("kinetic_J"), get("elastic_J"));
    let works = LAST_COLUMNS.split(',').map(get).collect::<Vec<_>>();
    let exchanged = summary["energy_J"]["exchanged"].as_f64().unwrap();
    for k in 0..kinetic.len() {
        let change = kinetic[k] - kinetic[0] + elastic[k] - elastic[0];
        let [drive, gravity, restitution, friction, clearance, residual] = [0, 1, 2, 3, 4, 5].map(|i| works[i][k]);
        let accounted = drive + gravity + clearance - restitution - friction + residual;
        assert!((change - accounted).abs() < 1e-12, "row {k}");
        assert!(residual.abs() < 1e-4 * exchanged, "row {k}: {residual:e}");
    }
    let last = kinetic.len() - 1;
    for (i, key) in ["drive_work", "gravity_work", "restitution_loss", "friction_loss"].into_iter().enumerate() {
        assert_eq!(summary["energy_J"][key].as_f64().unwrap(), works[i][last], "{key}");
        assert!(works[i][last].abs() > 1e-4, "{key}");
    }
    let relative = summary["energy_J"]["relative_residual"].as_f64().unwrap();
    let residual = summary["energy_J"]["residual"].as_f64().unwrap();
    assert!((relative - residual / exchanged).abs() < 1e-15);
    let text = stdout_of(folder.path(), "run spcmm --duration 10ms");
    assert!(text.contains("of the energy exchanged"), "{text}");

    // These are the last columns; without the ledger they are absent, and the motion is the same.
    stdout_of(folder.path(), &format!("{run} --out with.csv"));
    let off = "--set solver.energy_ledger=off";
    let without = stdout_of(folder.path(), &format!("{run} {off} --out without.csv --summary json"));
    let without: Json = serde_json::from_str(&without).unwrap();
    assert_eq!(without["state_hash"], summary["state_hash"]);
    assert_eq!(without["energy_J"], Json::Null);
    let header = |name: &str| {
        let text = fs::read_to_string(folder.path().join(name)).unwrap();
        text.lines().next().unwrap().to_owned()
    };
    assert!(header("with.csv").ends_with(LAST_COLUMNS));
    assert!(!header("without.csv").contains("work_J"));
}

#[test]
fn every_impact_has_its_row() {
    let folder = tempfile::tempdir().unwrap();
    let run = "run spcmm --duration 50ms --set contact.clearance=0.2mm";
    let summary = stdout_of(folder.path(), &format!("{run} --impacts hits.json --summary json"));
    let summary: Json = serde_json::from_str(&summary).unwrap();
    let file = json(&folder.path().join("hits.json"));
    assert_eq!(file["meta"]["ball_joints"], serde_json::json!(["S1", "S2", "S3"]));
    assert_eq!(file["meta"]["scene"], "spcmm");
    assert!(file["meta"]["wall_s"].is_null(), "files of one run are the same");
    let joint = column(&file, "joint");
    let (approach, separation) = (column(&file, "approach_m_s"), column(&file, "separation_m_s"));
    let (achieved, nominal) = (column(&file, "restitution_given"), column(&file, "restitution_asked"));
    let (start, end) = (column(&file, "start_s"), column(&file, "end_s"));
    let disturbed = column(&file, "disturbed");
    assert!(joint.len() > 20, "{}", joint.len());
    for k in 0..joint.len() {
        assert!((achieved[k] - separation[k] / approach[k]).abs() < 1e-15);
        assert!(end[k] > start[k] && nominal[k] == 0.9);
        assert!(k == 0 || end[k] >= end[k - 1]);
    }
    for name in ["restitution_law", "floored", "steps", "deepest_m", "peak_N"] {
        assert_eq!(column(&file, name).len(), joint.len());
    }
    // No impact is lost: all that began have ended or are in progress.
    for (j, name) in ["S1", "S2", "S3"].into_iter().enumerate() {
        let of_joint = |k: &usize| joint[*k] == j as f64;
        let finished = (0..joint.len()).filter(of_joint).count() as u64;
        let started = summary["impacts"][name].as_u64().unwrap();
        assert!(started - finished <= 1, "{name}: {finished} of {started}");
        let entry = &summary["restitution"][name];
        assert_eq!(entry["finished"], finished);
        let undisturbed = (0..joint.len()).filter(of_joint).filter(|&k| disturbed[k] == 0.0).count();
        assert!(entry["undisturbed"].as_u64().unwrap() <= undisturbed as u64);
        assert!(entry["median_excess"].as_f64().unwrap().abs() < 0.2);
    }

    let words = stdout_of(folder.path(), "run spcmm --duration 30ms --impacts words.csv");
    let lines: Vec<&str> = words.lines().filter(|l| l.contains("than requested")).collect();
    assert!(!lines.is_empty(), "{words}");
    for line in lines {
        assert!(!line.contains(" -"), "a sign and a word: {line}");
    }

    // As for rows, the file format follows the ending, and existing files are not overwritten.
    stdout_of(folder.path(), &format!("{run} --impacts hits.csv"));
    let text = fs::read_to_string(folder.path().join("hits.csv")).unwrap();
    assert_eq!(text.lines().count(), joint.len() + 1);
    assert!(folder.path().join("hits.csv.meta.json").is_file());
    stdout_of(folder.path(), &format!("{run} --impacts hits.npz"));
    #[cfg(unix)]
    std::os::unix::fs::symlink("same.csv", folder.path().join("link.csv")).unwrap();
    for (line, code, word) in [
        ("--impacts hits.csv", 1, "--force"),
        ("--impacts hits.txt", 2, ".npz"),
        ("--impacts no/hits.csv", 1, "cannot write"),
        ("--impacts same.csv --out same.csv --every 1ms", 2, "same file"),
        ("--impacts ./same.csv --out same.csv --every 1ms", 2, "same file"),
        (
            "--impacts same.csv.meta.json --out same.csv --every 1ms",
            2,
            "--impacts and the .meta.json of --out name the same file",
        ),
        #[cfg(unix)]
        ("--impacts link.csv --out same.csv --every 1ms --force", 2, "same file"),
    ] {
        let output = jointplay(folder.path(), &format!("run pendulum --duration 1000000s {line}"));
        assert_eq!(output.code, Some(code), "{line}");
        assert!(output.stderr.contains(word), "{line}");
    }
    stdout_of(folder.path(), &format!("{run} --impacts hits.csv --force"));
    // A run without impacts writes only the header.
    stdout_of(folder.path(), "run spcmm --duration 1ms --impacts none.csv");
    let text = fs::read_to_string(folder.path().join("none.csv")).unwrap();
    assert_eq!(text.lines().count(), 1);
}

#[test]
fn the_wear_map_adds_up_to_the_rows_and_the_ledger() {
    let folder = tempfile::tempdir().unwrap();
    let run = "run spcmm --duration 30ms";
    let summary =
        stdout_of(folder.path(), &format!("{run} --every 5us --out rows.json --wear wear.json --summary json"));
    let summary: Json = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["wear_out"], "wear.json");
    let (rows, wear) = (json(&folder.path().join("rows.json")), json(&folder.path().join("wear.json")));
    let get = |name: &str| column(&wear, name);
    let (joint, impulse, work) = (get("joint"), get("impulse_N_s"), get("friction_work_J"));
    let contacts = get("contacts");
    for (j, name) in ["S1", "S2", "S3"].into_iter().enumerate() {
        let sum_of_joint = |values: &[f64]| -> f64 {
            let cells = (0..joint.len()).filter(|&k| joint[k] == j as f64);
            cells.map(|k| values[k]).sum()
        };
        let force = column(&rows, &format!("{name}_normal_N"));
        let expected: f64 = force.windows(2).map(|f| 0.5 * (f[0] + f[1]) * 5e-6).sum();
        // The bound is the error of the trapezoidal rule with twenty rows per impact.
        let error = sum_of_joint(&impulse) / expected - 1.0;
        assert!(error.abs() < 1e-3, "{name}: {error:e} of {expected} N s");
        assert_eq!(sum_of_joint(&contacts), summary["impacts"][name].as_f64().unwrap());
    }
    let loss = summary["energy_J"]["friction_loss"].as_f64().unwrap();
    let size: f64 = work.iter().map(|work| work.abs()).sum();
    assert!((work.iter().sum::<f64>() - loss).abs() < 1e-9 * size);
    // The cells have their stated areas and cover the sphere of radius r + c.
    let (area, density) = (get("area_m2"), get("impulse_N_s_m2"));
    let polar = [get("polar_from_rad"), get("polar_to_rad")];
    let azimuth = [get("azimuth_from_rad"), get("azimuth_to_rad")];
    let radius: f64 = 10.3e-3;
    for k in 0..area.len() {
        let height = polar[0][k].cos() - polar[1][k].cos();
        let area_of_cell = radius * radius * height * (azimuth[1][k] - azimuth[0][k]);
        assert!((area_of_cell / area[k] - 1.0).abs() < 1e-9, "cell {k}");
        assert!((density[k] * area[k] - impulse[k]).abs() <= 1e-12 * impulse[k]);
    }
    let sphere = 3.0 * 4.0 * std::f64::consts::PI * radius * radius;
    assert!((area.iter().sum::<f64>() / sphere - 1.0).abs() < 1e-9);
    let axes = &wear["meta"]["socket_axes"]["S1"];
    assert_eq!(wear["meta"]["ball_joints"], serde_json::json!(["S1", "S2", "S3"]));
    assert!(axes["body"].is_string() && axes["z"].as_array().unwrap().len() == 3);

    // Without the map the run is the same.
    let without = stdout_of(folder.path(), &format!("{run} --summary json"));
    let without: Json = serde_json::from_str(&without).unwrap();
    assert_eq!(without["state_hash"], summary["state_hash"]);
    assert_eq!(without["evaluations"], summary["evaluations"]);
    let text_summary = stdout_of(folder.path(), &format!("{run} --wear wear.csv"));
    assert!(text_summary.contains(&format!("{} cells to wear.csv", joint.len())), "{text_summary}");
    let text = fs::read_to_string(folder.path().join("wear.csv")).unwrap();
    assert_eq!(text.lines().count(), joint.len() + 1);
    assert!(folder.path().join("wear.csv.meta.json").is_file());
    for (line, code, word) in [
        ("--wear wear.csv", 1, "--force"),
        ("--wear wear.txt", 2, ".npz"),
        ("--wear a.csv --impacts a.csv", 2, "same file"),
    ] {
        let output = jointplay(folder.path(), &format!("run pendulum --duration 1000000s {line}"));
        assert_eq!(output.code, Some(code), "{line}");
        assert!(output.stderr.contains(word), "{line}");
    }
    // Without clearance there is no wall to hit.
    stdout_of(folder.path(), "run pendulum --set contact.clearance=0 --duration 1ms --wear none.csv");
    let text = fs::read_to_string(folder.path().join("none.csv")).unwrap();
    assert_eq!(text.lines().count(), 1);
}
