//! `run --channels` and `check --channels`: rows with selected columns.

use std::fs;

use serde_json::Value as Json;

use crate::program::{folder, jointplay, names};

/// Header and lines of a CSV file.
fn lines(text: &str) -> Vec<Vec<&str>> {
    text.lines().map(|line| line.split(',').collect()).collect()
}

#[test]
fn selected_columns_equal_those_of_a_full_run() {
    let folder = folder();
    let run = |more: &str| {
        let line = format!("run spcmm --duration 10ms --every 1ms --quiet {more}");
        jointplay(folder.path(), &line).expect(0);
    };
    run("--out full.csv");
    run("--out selected.csv --channels time,S2.force,platform.pose --channels energy.resid*");
    run("--out other.csv --channels rod1.pose.x,P1.position,P1.rate,S?.gap,R1.angle");
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let (full, selected) = (read("full.csv"), read("selected.csv"));
    let (full, selected) = (lines(&full), lines(&selected));
    let header =
        "t_s,x_m,y_m,z_m,alpha_rad,beta_rad,gamma_rad,S2_force_x_N,S2_force_y_N,S2_force_z_N,energy_residual_J";
    assert_eq!(selected[0].join(","), header);
    assert_eq!((selected.len(), full.len()), (12, 12));
    for (column, name) in selected[0].iter().enumerate() {
        let same = full[0].iter().position(|other| other == name).unwrap();
        for (a, b) in selected.iter().zip(&full) {
            assert_eq!(a[column], b[same], "{name}");
        }
    }
    let other = read("other.csv");
    let other = lines(&other);
    assert_eq!(other[0].join(","), "t_s,rod1_x_m,P1_position_m,P1_rate_m_s,R1_angle_rad,S1_gap_m,S2_gap_m,S3_gap_m");
    let gap = full[0].iter().position(|name| *name == "S2_penetration_m");
    for (a, b) in other[1..].iter().zip(&full[1..]) {
        let [a, b]: [f64; 2] = [a[6], b[gap.unwrap()]].map(|value| value.parse().unwrap());
        assert_eq!(a, -b);
    }
    let meta: Json = serde_json::from_str(&read("selected.csv.meta.json")).expect("metadata is JSON");
    let requested = ["time", "S2.force", "platform.pose", "energy.resid*"];
    assert_eq!(meta["channels"], serde_json::json!(requested));
}

#[test]
fn every_file_format_accepts_selected_columns() {
    let folder = folder();
    for out in ["a.json", "a.npz"] {
        let line = format!("run pendulum --duration 2ms --every 1ms --channels S1 --out {out}");
        jointplay(folder.path(), &line).expect(0);
    }
    let text = fs::read_to_string(folder.path().join("a.json")).unwrap();
    let json: Json = serde_json::from_str(&text).unwrap();
    let columns: Vec<&String> = json["columns"].as_object().unwrap().keys().collect();
    assert_eq!(columns[..2], ["t_s", "S1_eccentricity_m"]);
    assert!(columns[1..].iter().all(|name| name.starts_with("S1_")));
    let archive = fs::File::open(folder.path().join("a.npz")).unwrap();
    let mut archive = ndarray_npy::NpzReader::new(archive).unwrap();
    let arrays = archive.names().unwrap();
    for name in columns {
        assert!(arrays.iter().any(|array| array.trim_end_matches(".npy") == name));
    }
    assert_eq!(arrays.len(), json["columns"].as_object().unwrap().len() + 1);
}

#[test]
fn an_unknown_channel_is_refused_with_the_nearest_name() {
    let folder = folder();
    let run = "run pendulum --duration 1ms --every 1ms --out a.csv --channels";
    for (patterns, words) in [
        ("S1.froce", &["S1.froce", "did you mean `S1.force`?", "check pendulum --channels"][..]),
        ("S1.force,nothing.*", &["nothing.*"]),
        ("S1.force,,time", &["``"]),
    ] {
        let run = jointplay(folder.path(), &format!("{run} {patterns}")).expect(2);
        assert_eq!(run.stdout, "");
        for word in words {
            assert!(run.stderr.contains(word), "{word}: {}", run.stderr);
        }
    }
    let without_file = jointplay(folder.path(), "run pendulum --duration 1ms --channels S1");
    assert!(without_file.expect(2).stderr.contains("--out"));
    assert_eq!(names(folder.path()), [""; 0]);
}

#[test]
fn check_lists_every_channel() {
    let folder = folder();
    let list = jointplay(folder.path(), "check spcmm --channels").expect(0).stdout;
    let (default, on_request) = list.split_once("Written on request:\n").unwrap();
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    let default: Vec<_> = default.lines().skip(1).map(words).collect();
    assert_eq!(default[0][..3], ["time", "s", "t_s"]);
    assert!(on_request.lines().any(|line| words(line)[..3] == ["rod1.pose.x", "m", "rod1_x_m"]));
    let run = "run spcmm --duration 0s --every 1s --out a.csv";
    jointplay(folder.path(), run).expect(0);
    let text = fs::read_to_string(folder.path().join("a.csv")).unwrap();
    assert_eq!(lines(&text)[0].len(), default.len());
    jointplay(folder.path(), &format!("{run} --force --channels *")).expect(0);
    let text = fs::read_to_string(folder.path().join("a.csv")).unwrap();
    assert_eq!(lines(&text)[0].len(), default.len() + on_request.lines().count());
}
