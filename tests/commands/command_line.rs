//! The command line as scripts see it: streams, exit codes, columns, files.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use jointplay::scene::{BENCHMARKS, BUILT_IN};
use serde_json::Value as Json;

#[cfg(target_os = "linux")]
use crate::program::poll_until;
use crate::program::{command, folder, jointplay, names};

/// First columns, in the order that readers of the published reference files expect.
const FIRST_COLUMNS: &str = "t_s,x_m,y_m,z_m,alpha_rad,beta_rad,gamma_rad,vx_m_s,vy_m_s,vz_m_s,\
                             S1_eccentricity_m,S2_eccentricity_m,S3_eccentricity_m,S1_normal_N,S2_normal_N,S3_normal_N";

struct Csv {
    header: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Csv {
    /// Every line after the first must be data: that is what readers rely on.
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap();
        let mut lines = text.lines();
        let header: Vec<String> = lines.next().unwrap().split(',').map(str::to_owned).collect();
        let rows: Vec<Vec<f64>> =
            lines.map(|line| line.split(',').map(|value| value.parse().unwrap()).collect()).collect();
        assert!(rows.iter().all(|row: &Vec<f64>| row.len() == header.len()));
        assert!(rows.iter().flatten().all(|value| value.is_finite()));
        Self { header, rows }
    }

    fn column(&self, name: &str) -> Vec<f64> {
        let column = self.header.iter().position(|h| h == name).unwrap_or_else(|| panic!("no column {name}"));
        self.rows.iter().map(|row| row[column]).collect()
    }
}

#[test]
fn rows_of_the_papers_scene_have_the_promised_columns_and_times() {
    let folder = folder();
    let run = jointplay(folder.path(), "run spcmm --duration 20ms --every 0.1ms --out run.csv").expect(0);
    assert!(run.stdout.contains("impacts"), "{}", run.stdout);
    let csv = Csv::read(&folder.path().join("run.csv"));
    assert_eq!(csv.header[..16].join(","), FIRST_COLUMNS);
    let mut expected: Vec<String> =
        ["ax_m_s2", "ay_m_s2", "az_m_s2", "alpha_rate_rad_s", "beta_rate_rad_s", "gamma_rate_rad_s"]
            .map(str::to_owned)
            .into();
    for joint in ["S1", "S2", "S3"] {
        for quantity in [
            "ex_m",
            "ey_m",
            "ez_m",
            "penetration_m",
            "penetration_rate_m_s",
            "force_x_N",
            "force_y_N",
            "force_z_N",
            "friction_x_N",
            "friction_y_N",
            "friction_z_N",
            "state",
        ] {
            expected.push(format!("{joint}_{quantity}"));
        }
    }
    expected.extend(["P1_actuator_N", "P2_actuator_N", "P3_actuator_N", "kinetic_J", "potential_J"].map(str::to_owned));
    assert_eq!(csv.header[16..16 + expected.len()], expected);

    assert_eq!(csv.rows.len(), 201);
    for (k, time) in csv.column("t_s").into_iter().enumerate() {
        // Twelve significant digits of k x 0.1 ms.
        assert!((time - k as f64 * 1e-4).abs() <= 1e-14, "row {k}: {time}");
    }

    // The columns of a row are consistent.
    for joint in ["S1", "S2", "S3"] {
        let column = |quantity: &str| csv.column(&format!("{joint}_{quantity}"));
        let clearance = 0.3e-3;
        let (e, delta, normal, state) =
            (column("eccentricity_m"), column("penetration_m"), column("normal_N"), column("state"));
        let components = [column("ex_m"), column("ey_m"), column("ez_m")];
        let force = [column("force_x_N"), column("force_y_N"), column("force_z_N")];
        let friction = [column("friction_x_N"), column("friction_y_N"), column("friction_z_N")];
        for k in 0..csv.rows.len() {
            let norm = |v: &[Vec<f64>; 3]| (v[0][k].powi(2) + v[1][k].powi(2) + v[2][k].powi(2)).sqrt();
            assert!((norm(&components) - e[k]).abs() < 1e-14);
            assert!((e[k] - clearance - delta[k]).abs() < 1e-13);
            assert_eq!(state[k] > 0.0, delta[k] > 0.0, "{joint} row {k}");
            let along = [0, 1, 2].map(|axis| force[axis][k] - friction[axis][k]);
            let along = along.iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!((along - normal[k]).abs() < 1e-9 * normal[k].max(1.0));
        }
        assert!(normal.iter().any(|&n| n > 1.0), "{joint} was hit within 20 ms");
    }
}

#[test]
fn sampling_never_changes_the_steps_and_the_same_run_gives_the_same_bits() {
    let folder = folder();
    let run = |every: &str, out: &str| {
        let line = format!("run spcmm --duration 15ms --every {every} --out {out} --summary json");
        jointplay(folder.path(), &line).expect(0).json()
    };
    let (fine, coarse, repeated) = (run("0.1ms", "a.csv"), run("1ms", "b.csv"), run("0.1ms", "c.csv"));
    for key in ["state_hash", "steps", "evaluations", "rejected", "peak_normal_N"] {
        assert_eq!(fine[key], coarse[key], "{key}");
        assert_eq!(fine[key], repeated[key], "{key}");
    }
    let bytes = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(bytes("a.csv") == bytes("c.csv"), "the same run writes the same bytes");
    assert!(bytes("a.csv.meta.json") == bytes("c.csv.meta.json"), "and the same metadata");
    // Rows at common times are the same rows.
    let (fine, coarse) = (Csv::read(&folder.path().join("a.csv")), Csv::read(&folder.path().join("b.csv")));
    assert_eq!(coarse.rows.len(), 16);
    for (k, row) in coarse.rows.iter().enumerate() {
        // The instants k x 1 ms and 10 k x 0.1 ms may differ in their last bit, a stiff force by a little more.
        for (a, b) in row.iter().zip(&fine.rows[10 * k]) {
            assert!((a - b).abs() <= 1e-9 * a.abs().max(1e-6), "row {k}: {a} {b}");
        }
    }
}

#[test]
fn the_summary_contains_the_documented_keys() {
    let folder = folder();
    let line = "run spcmm --duration 12ms --summary json --set contact.clearance=0.4mm --set contact.clearance=0.5mm";
    let run = jointplay(folder.path(), line).expect(0);
    assert_eq!(run.stderr, "", "no progress bar where there is no terminal");
    let summary = run.json();
    assert_eq!(summary["status"], "done");
    assert_eq!(summary["time_s"], 0.012);
    assert_eq!(summary["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(summary["scene"], "spcmm");
    assert!(summary["method"].is_string());
    for key in ["steps", "evaluations", "rejected"] {
        assert!(summary[key].is_u64(), "{key}");
    }
    for key in ["wall_s", "ratio"] {
        assert!(summary[key].as_f64().unwrap() > 0.0, "{key}");
    }
    for joint in ["S1", "S2", "S3"] {
        assert!(summary["impacts"][joint].as_u64().unwrap() >= 1, "{joint}");
        assert!(summary["peak_normal_N"][joint].as_f64().unwrap() > 100.0, "{joint}");
    }
    let hash = summary["state_hash"].as_str().unwrap();
    assert_eq!(hash.len(), 16);
    assert!(u64::from_str_radix(hash, 16).is_ok());
    let changed = summary["changed_parameters"].as_object().unwrap();
    assert_eq!(changed.len(), 1);
    assert!(changed["contact.clearance"].as_str().unwrap().starts_with("0.5"), "the last one wins");
    assert_eq!(names(folder.path()), [""; 0], "without --out nothing is written");
}

#[test]
fn the_three_formats_hold_the_same_values_and_their_provenance() {
    let folder = folder();
    for out in ["a.csv", "a.json", "a.npz"] {
        let line = format!("run pendulum --duration 30ms --every 1ms --out {out} --set contact.friction=0.25");
        jointplay(folder.path(), &line).expect(0);
    }
    let csv = Csv::read(&folder.path().join("a.csv"));
    let csv_meta: Json = serde_json::from_slice(&fs::read(folder.path().join("a.csv.meta.json")).unwrap()).unwrap();
    let json: Json = serde_json::from_slice(&fs::read(folder.path().join("a.json")).unwrap()).unwrap();
    let mut npz = ndarray_npy::NpzReader::new(fs::File::open(folder.path().join("a.npz")).unwrap()).unwrap();
    let npz_meta: ndarray::Array1<u8> = npz.by_name("meta").unwrap();
    let npz_meta: Json = serde_json::from_slice(npz_meta.as_slice().unwrap()).unwrap();
    for meta in [&csv_meta, &json["meta"], &npz_meta] {
        assert_eq!(meta["version"], env!("CARGO_PKG_VERSION"));
        assert_eq!(meta["scene"], "pendulum");
        assert_eq!(meta["changed_parameters"]["contact.friction"], "0.25");
        assert!(meta["method"].is_string());
        assert_eq!(meta["status"], "done");
        // The metadata alone reproduces the run.
        let text = meta["scene_text"].as_str().unwrap();
        fs::write(folder.path().join("repeated.toml"), text).unwrap();
        let changed = meta["changed_parameters"].as_object().unwrap();
        let changed = changed.iter().map(|(key, value)| format!("--set {key}={}", value.as_str().unwrap()));
        let changed: Vec<String> = changed.collect();
        let line = format!("run repeated.toml {} --duration {}s --summary json", changed.join(" "), meta["duration_s"]);
        let repeated = jointplay(folder.path(), &line).expect(0).json();
        assert_eq!(repeated["state_hash"], meta["state_hash"]);
        assert!(repeated["scene_text"].is_null(), "a summary contains the text of the scene");
    }
    for (i, name) in csv.header.iter().enumerate() {
        let columns: ndarray::Array1<f64> = npz.by_name(name).unwrap();
        let json = json["columns"][name].as_array().unwrap();
        assert_eq!((columns.len(), json.len()), (31, 31));
        for (k, row) in csv.rows.iter().enumerate() {
            // The file holds every bit; this JSON reader may be off by one in the last.
            let json = json[k].as_f64().unwrap();
            assert!((json - columns[k]).abs() <= f64::EPSILON * json.abs(), "{name} row {k}");
            assert!((row[i] - columns[k]).abs() <= 5.1e-12 * columns[k].abs(), "{name} row {k}");
        }
    }
}

#[test]
fn other_scenes_report_their_own_joints_and_drives() {
    let folder = folder();
    jointplay(folder.path(), "run slider-crank-driven --duration 1ms --every 1ms --out a.csv").expect(0);
    let csv = Csv::read(&folder.path().join("a.csv"));
    assert_eq!(csv.header[10..14].join(","), "B_eccentricity_m,C_eccentricity_m,B_normal_N,C_normal_N");
    assert!(csv.header.iter().any(|name| name.ends_with("_actuator_Nm")), "{:?}", csv.header);
    assert!(csv.column("B_state").iter().all(|&state| state == 3.0), "B is ideal");
    assert!(csv.column("B_normal_N")[0] > 0.0, "an ideal joint reports its reaction");
}

/// The slider-crank with its slider 30 mm too far out, for an assembled start.
fn misplaced(folder: &Path) {
    let text = jointplay::scene::built_in_text("slider-crank").unwrap();
    let moved = text.replace("position = \"200 mm\"", "position = \"230 mm\"");
    assert_ne!(moved, text);
    fs::write(folder.join("moved.toml"), format!("start = \"ideal\"\n{moved}")).unwrap();
}

#[test]
fn displacements_by_the_assembly_are_printed_with_a_warning() {
    let folder = folder();
    misplaced(folder.path());
    let check = jointplay(folder.path(), "check moved.toml").expect(0).stdout;
    println!("{check}");
    for words in ["largest gap as given 30 mm at C", "  slider", "Warning               assembly at the start moved"] {
        assert!(check.contains(words), "{words}: {check}");
    }
    let run = jointplay(folder.path(), "run moved.toml --duration 1ms --summary json").expect(0);
    assert!(run.stderr.contains("warning: assembly at the start moved bodies far"), "{}", run.stderr);
    let assembly = &run.json()["assembly"];
    assert_eq!(assembly["largest_gap_joint"], "C");
    assert!((assembly["largest_gap_m"].as_f64().unwrap() - 0.03).abs() < 1e-6);
    let moved = |body: &str| assembly["bodies"][body]["moved_m"].as_f64().unwrap();
    // Slider, rod and crank share the displacement.
    assert!(moved("slider") > 5e-3 && moved("slider") < 0.03, "{assembly}");
    for (scene, words) in [
        ("spcmm", "no gap in the drives' closed form"),
        ("pendulum", "none: no joint starts closed"),
        ("slider-crank", "no gap as given"),
    ] {
        let check = jointplay(folder.path(), &format!("check {scene}")).expect(0).stdout;
        assert!(check.contains(words), "{words}: {check}");
        assert!(!check.contains("assembly at the start moved"), "{check}");
    }
}

#[test]
fn a_probe_is_compared_with_the_same_scene_with_every_ball_joint_closed() {
    let folder = folder();
    let text = jointplay::scene::built_in_text("pendulum").unwrap();
    let probed = text.replace("body = \"rod\"\n\n", "body = \"rod\"\nprobe = \"0 0 -100 mm\"\n\n");
    assert_ne!(probed, text);
    fs::write(folder.path().join("probed.toml"), probed).unwrap();
    let run = |set: &str, every: &str, out: &str| {
        let line = format!("run probed.toml {set} --duration 60ms --every {every} --out {out} --summary json");
        let summary = jointplay(folder.path(), &line).expect(0).json();
        (summary["state_hash"].clone(), Csv::read(&folder.path().join(out)))
    };
    let (hash, rows) = run("", "1ms", "play.csv");
    // Denser sampling changes nothing.
    assert_eq!(run("", "0.1ms", "often.csv").0, hash);
    let line = "run pendulum --duration 60ms --summary json";
    assert_eq!(jointplay(folder.path(), line).expect(0).json()["state_hash"], hash);
    let tight = "--set contact.clearance=0 --set solver.tolerance=1e-10";
    let (_, ideal) = run(tight, "1ms", "ideal.csv");
    // Tip from the pose of the rod: R = Rx(alpha) Rz(beta) Ry(gamma).
    let tips = |csv: &Csv| -> Vec<[f64; 3]> {
        let column = |name: &str| csv.column(name);
        let p = ["x_m", "y_m", "z_m"].map(column);
        let a = ["alpha_rad", "beta_rad", "gamma_rad"].map(column);
        let tip = |k: usize| {
            let ((sa, ca), (sb, cb), (sg, cg)) = (a[0][k].sin_cos(), a[1][k].sin_cos(), a[2][k].sin_cos());
            let w = [cb * sg, ca * sb * sg - sa * cg, sa * sb * sg + ca * cg];
            [0, 1, 2].map(|i| p[i][k] - 0.1 * w[i])
        };
        (0..csv.rows.len()).map(tip).collect()
    };
    let (play, ideal_tips) = (tips(&rows), tips(&ideal));
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let errors = rows.column(&format!("probe_error_{name}_m"));
        for (k, error) in errors.iter().enumerate() {
            let expected = play[k][axis] - ideal_tips[k][axis];
            assert!((error - expected).abs() < 1e-9, "{name} row {k}: {error} {expected}");
        }
        // A joint without play is its own reference.
        assert!(ideal.column(&format!("probe_error_{name}_m")).iter().all(|e| *e == 0.0));
    }
    let largest = rows.column("probe_error_z_m").into_iter().fold(0.0, |m: f64, e| m.max(e.abs()));
    assert!(largest > 1e-4, "{largest}");
}

#[test]
fn existing_files_are_refused_before_the_run_unless_force_is_given() {
    let folder = folder();
    let endless = "run pendulum --duration 1000000s --every 1s";
    fs::write(folder.path().join("mine.csv"), "mine").unwrap();
    // Each of these would run for hours if it started.
    for (out, word) in [
        ("mine.csv", "--force"),
        ("missing/run.csv", "cannot write"),
        (".", ".csv"),
        ("run.txt", ".npz"),
        ("run", ".json"),
    ] {
        let run = jointplay(folder.path(), &format!("{endless} --out {out}"));
        assert!(matches!(run.code, Some(1 | 2)), "{out}: {:?}", run.code);
        assert!(run.stderr.contains(word), "{out}: {}", run.stderr);
    }
    assert_eq!(names(folder.path()), ["mine.csv"]);
    assert_eq!(fs::read_to_string(folder.path().join("mine.csv")).unwrap(), "mine");

    let short = "run pendulum --duration 1ms --every 1ms --out mine.csv";
    jointplay(folder.path(), short).expect(1);
    jointplay(folder.path(), &format!("{short} --force")).expect(0);
    assert_eq!(Csv::read(&folder.path().join("mine.csv")).rows.len(), 2);
    assert_eq!(names(folder.path()), ["mine.csv", "mine.csv.meta.json"]);
}

#[test]
fn a_failed_start_leaves_no_file() {
    let folder = folder();
    jointplay(folder.path(), "run spcmm --duration 1ms --every 1ms --out a.csv --set contact.clearance=20mm").expect(2);
    assert_eq!(names(folder.path()), [""; 0]);
}

#[test]
fn each_kind_of_failure_has_its_exit_code_and_a_clear_line() {
    let folder = folder();
    fs::write(folder.path().join("broken.toml"), "title = \n").unwrap();
    for (line, code, words) in [
        ("run", 2, &["SCENE"][..]),
        ("frobnicate", 2, &["frobnicate"]),
        ("run spcmm", 2, &["--duration"]),
        ("run spcmm --duration 1", 2, &["--duration", "unit", "ms"]),
        ("run spcmm --duration 1mm", 2, &["--duration", "mm", "ms"]),
        ("run spcmm --duration -1ms", 2, &["--duration", "-1ms"]),
        ("run spcmm --duration 1ms --every 0 --out a.csv", 2, &["--every"]),
        ("run spcmm --duration 1ms --every 1ms", 2, &["--out"]),
        ("run spcmm --duration 1s --every 1ns --out a.csv", 2, &["rows", "--every"]),
        ("run spcmn --duration 1ms", 2, &["spcmn", "spcmm"]),
        ("run broken.toml --duration 1ms", 2, &["broken.toml", ":1:"]),
        ("run missing.toml --duration 1ms", 1, &["missing.toml"]),
        ("run ./missing --duration 1ms", 1, &["missing"]),
        ("check spcmm --set contact.clearence=1mm", 2, &["contact.clearence", "contact.clearance"]),
        ("check spcmm --set contact.clearance=1", 2, &["contact.clearance", "mm", "unit"]),
        ("check spcmm --set contact.clearance=1s", 2, &["contact.clearance", "1s", "mm"]),
        ("check spcmm --set contact.friction=-1", 2, &["contact.friction", "-1", "0"]),
        ("check spcmm --set contact.friction=nan", 2, &["contact.friction", "nan"]),
        ("check spcmm --set chain.links=3", 2, &["chain.links"]),
        ("check spcmm --set contact.friction", 2, &["KEY=VALUE"]),
        ("check spcmm --set joint.S9.clearance=1mm", 2, &["S9"]),
        ("check spcmm --set spcmm.slider_plane=350mm", 2, &["rod"]),
        ("scenes extra", 2, &["extra"]),
    ] {
        let run = jointplay(folder.path(), line).expect(code);
        assert_eq!(run.stdout, "", "{line}: results only");
        for word in words {
            assert!(run.stderr.contains(word), "{line}: `{word}` is not in: {}", run.stderr);
        }
        assert!(!run.stderr.contains("panicked"), "{line}: {}", run.stderr);
    }
    assert_eq!(names(folder.path()), ["broken.toml"]);
}

#[test]
fn a_stopped_run_writes_its_rows_and_reports_the_reason() {
    let folder = folder();
    // Explicit steps a hundred times longer than an impact cannot resolve the contact.
    let line =
        "run spcmm --set solver.method=rk4 --set solver.step=2ms --duration 10s --every 1ms --out a.csv --summary json";
    let run = jointplay(folder.path(), line).expect(4);
    assert_eq!(run.json()["status"], "diverged");
    assert!(run.stderr.contains("stopped at t ="), "{}", run.stderr);
    let csv = Csv::read(&folder.path().join("a.csv"));
    assert!(!csv.rows.is_empty());
    let meta: Json = serde_json::from_slice(&fs::read(folder.path().join("a.csv.meta.json")).unwrap()).unwrap();
    assert_eq!(meta["status"], "diverged");
}

/// Whether `child` has signal `number` in the mask called `disposition`: `SigCgt` for caught, `SigIgn` for ignored.
#[cfg(target_os = "linux")]
fn has_signal_in(child: &std::process::Child, disposition: &str, number: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
    let mask = status.lines().find_map(|line| line.strip_prefix(disposition)?.strip_prefix(':')).unwrap();
    u64::from_str_radix(mask.trim(), 16).unwrap() & (1 << (number - 1)) != 0
}

/// Starts `command` and waits until its thread for Ctrl-C, SIGTERM and SIGHUP runs.
#[cfg(target_os = "linux")]
pub fn start_and_listen(command: &mut Command) -> std::process::Child {
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    poll_until(|| {
        let threads = fs::read_dir(format!("/proc/{}/task", child.id())).unwrap();
        let names = threads.filter_map(|thread| fs::read_to_string(thread.ok()?.path().join("comm")).ok());
        names.into_iter().any(|name| name.trim() == "signals")
    });
    child
}

#[cfg(target_os = "linux")]
pub fn signal(child: &std::process::Child, name: &str) {
    let id = child.id().to_string();
    let status = Command::new("kill").args([name, &id]).status().unwrap();
    assert!(status.success());
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_run_writes_its_complete_rows() {
    for name in ["-INT", "-TERM", "-HUP"] {
        interrupted_run("1000000s --every 1s", &|child, _| signal(child, name));
    }
}

/// Whatever the program does at that instant: read its arguments, load the scene, step, or write. Only before its first
/// instruction the system itself ends it.
#[cfg(target_os = "linux")]
#[test]
fn a_signal_at_any_instant_ends_a_command_with_the_code_of_an_interruption_and_no_temporary_file() {
    let folder = folder();
    for (k, line) in [
        "run pendulum --duration 1000000s --every 1s --out a.csv --impacts b.csv --save-state c --force --quiet",
        "sweep spcmm --vary contact.clearance=0.2mm..0.3mm:9 --periods 100000 --discard 1 --out a.npz --quiet",
        "check hexapod",
    ]
    .into_iter()
    .enumerate()
    {
        for delay in 0..12 {
            let mut child = command(folder.path(), line).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
            poll_until(|| has_signal_in(&child, "SigCgt", 15) || child_is_over(&child));
            std::thread::sleep(std::time::Duration::from_micros(300 * delay * delay));
            signal(&child, "-TERM");
            let code = child.wait().unwrap().code();
            assert!(code == Some(130) || k == 2 && code == Some(0), "{line}: {code:?}");
            let left = names(folder.path());
            assert!(!left.iter().any(|name| name.starts_with(".jointplay-")), "{line}: {left:?}");
        }
    }
}

/// Whether `child` has ended but was not waited for.
#[cfg(target_os = "linux")]
fn child_is_over(child: &std::process::Child) -> bool {
    let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
    status.lines().any(|line| line.starts_with("State:") && line.contains('Z'))
}

/// A complete result is worth more than the beginning of a new one.
#[cfg(target_os = "linux")]
#[test]
fn an_incomplete_run_leaves_the_older_result_and_writes_its_own_beside_it() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    let outputs = "--every 1ms --out a.csv --impacts b.csv --wear w.csv --save-state s --force --quiet";
    jointplay(folder.path(), &format!("run pendulum --duration 20ms {outputs}")).expect(0);
    let results = || -> Vec<(String, Vec<u8>)> {
        let all = names(folder.path()).into_iter().filter(|name| !name.starts_with("incomplete-"));
        all.map(|name| (name.clone(), fs::read(path(&name)).unwrap())).collect()
    };
    let old = results();
    let endless = format!("run pendulum --duration 1000000s {}", outputs.replace("1ms", "1s"));
    let interrupted = || {
        let child = start_and_listen(&mut command(folder.path(), &endless));
        signal(&child, "-INT");
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130));
        [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap())
    };
    let [stdout, stderr] = interrupted();
    assert!(results() == old, "the older files stay");
    assert!(stderr.contains("the older result stays, the incomplete one is in incomplete-a.csv, "), "{stderr}");
    assert!(stdout.contains("to incomplete-a.csv\n") && stdout.contains("incomplete-s\n"), "{stdout}");
    let meta: Json = serde_json::from_slice(&fs::read(path("incomplete-a.csv.meta.json")).unwrap()).unwrap();
    let rows = fs::read(path("incomplete-a.csv")).unwrap();
    assert_eq!(meta["status"], "interrupted");
    assert_eq!(meta["rows_crc32"], format!("{:08x}", crc32fast::hash(&rows)));
    for name in ["incomplete-b.csv", "incomplete-w.csv", "incomplete-s"] {
        assert!(path(name).exists(), "{name}");
    }
    // A second one replaces neither.
    let [_, stderr] = interrupted();
    assert!(stderr.contains("incomplete-2-a.csv, "), "{stderr}");
    assert!(results() == old && fs::read(path("incomplete-a.csv")).unwrap() == rows);
    // Nor does a run that stops; it saves no state.
    let stopped = "run spcmm --set solver.method=rk4 --set solver.step=2ms --duration 10s";
    let stopped = jointplay(folder.path(), &format!("{stopped} {outputs}")).expect(4);
    assert!(stopped.stderr.contains("incomplete-3-a.csv, ") && !stopped.stderr.contains("-s\n"), "{}", stopped.stderr);
    assert!(results() == old && !path("incomplete-3-s").exists());
    // A complete run does.
    jointplay(folder.path(), &format!("run pendulum --duration 30ms {outputs}")).expect(0);
    assert!(results() != old);
}

/// `timeout -s INT` sends two.
#[cfg(target_os = "linux")]
#[test]
fn a_repeated_signal_while_rows_are_written_changes_nothing() {
    interrupted_run("50s --every 10us", &|child, folder| {
        // Rows are in memory; writing them takes long enough for a second signal.
        let resident_pages = || -> u64 {
            let status = fs::read_to_string(format!("/proc/{}/statm", child.id())).unwrap();
            status.split(' ').nth(1).unwrap().parse().unwrap()
        };
        let at_start = resident_pages();
        poll_until(|| resident_pages() > at_start + (16 << 20) / 4096);
        signal(child, "-INT");
        poll_until(|| names(folder).iter().any(|name| name.starts_with(".jointplay-")));
        signal(child, "-INT");
    });
}

#[cfg(target_os = "linux")]
#[test]
fn a_run_started_by_nohup_outlives_its_terminal() {
    let folder = folder();
    let run = format!(
        "trap '' HUP; exec {} run pendulum --duration 1000000s --summary json",
        env!("CARGO_BIN_EXE_jointplay")
    );
    let mut command = Command::new("sh");
    let mut child = start_and_listen(command.args(["-c", &run]).current_dir(folder.path()));
    assert!(has_signal_in(&child, "SigIgn", 1));
    signal(&child, "-HUP");
    assert!(child.try_wait().unwrap().is_none());
    signal(&child, "-TERM");
    assert_eq!(child.wait().unwrap().code(), Some(130));
}

#[cfg(target_os = "linux")]
#[track_caller]
fn interrupted_run(times: &str, interrupt: &dyn Fn(&std::process::Child, &Path)) {
    let folder = folder();
    let line = format!("run pendulum --duration {times} --out a.json --summary json");
    // If the tests run under nohup they ignore SIGHUP, and the child would inherit that.
    let mut command = Command::new("env");
    command.args(["--default-signal=HUP", env!("CARGO_BIN_EXE_jointplay")]);
    command.args(line.split_whitespace()).current_dir(folder.path());
    let child = start_and_listen(&mut command);
    interrupt(&child, folder.path());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", String::from_utf8_lossy(&output.stderr));
    let summary: Json = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["status"], "interrupted");
    let file: Json = serde_json::from_slice(&fs::read(folder.path().join("a.json")).unwrap()).unwrap();
    assert_eq!(file["meta"]["status"], "interrupted");
    let times = file["columns"]["t_s"].as_array().unwrap();
    assert_eq!(times.len() as u64, summary["rows"].as_u64().unwrap());
    assert!(times.last().unwrap().as_f64().unwrap() <= summary["time_s"].as_f64().unwrap());
    assert_eq!(names(folder.path()), ["a.json"]);
}

#[cfg(feature = "gui")]
#[test]
fn lessons_are_listed_and_a_file_is_checked() {
    let folder = folder();
    let list = jointplay(folder.path(), "lessons").expect(0).stdout;
    assert_eq!(list.lines().count(), 12, "{list}");
    assert!(list.starts_with("rattle "), "{list}");
    let printed = jointplay(folder.path(), "lessons rattle").expect(0).stdout;
    assert!(printed.contains("[x]  At nearly the same time") && printed.contains("7.8 ms"), "{printed}");
    let near = jointplay(folder.path(), "lessons ratle").expect(2).stderr;
    assert!(near.contains("did you mean `rattle`?"), "{near}");
    let lesson = "title = \"x\"\nscene = \"pendulum\"\n[measure]\nfirst = { impact = 1 }\n[[step]]\ntitle = \"x\"\ntext = \"\"\n\
               claims = [\"first < 1 ms\"]\n";
    fs::write(folder.path().join("own.toml"), lesson).unwrap();
    let wrong = jointplay(folder.path(), "lessons own.toml").expect(2).stderr;
    assert!(wrong.contains("step 1: `first < 1 ms` does not hold: first is 7.8"), "{wrong}");
}

#[test]
fn scenes_are_listed_and_checked_with_their_contents() {
    let folder = folder();
    let list = jointplay(folder.path(), "scenes").expect(0).stdout;
    for (scene, words) in [
        ("spcmm", &["7 moving", "3 (S1, S2, S3)", "contact forces at S1, S2, S3", "P1, P2, P3"][..]),
        ("pendulum", &["1 moving", "Joints with play      1 (S1)"]),
        ("slider-crank", &["3 moving", "1 (C), 1 without (B)", "reactions of the ideal joints at B"]),
        ("slider-crank-driven", &["3 moving", "1 driven revolute"]),
        ("chain", &["8 moving", "Joints with play      8 ("]),
        ("hexapod", &["13 moving", "Joints with play      12 (", "6 driven"]),
        ("delta", &["10 moving", "Joints with play      12 (", "3 driven"]),
        ("four-bar", &["3 moving", "2 (A, B)"]),
        ("suspension", &["5 moving", "Joints with play      4 ("]),
        ("press", &["5 moving", "2 (knee, wrist)"]),
    ] {
        assert!(list.lines().any(|line| line.split_whitespace().next() == Some(scene)), "{list}");
        let report = jointplay(folder.path(), &format!("check {scene}")).expect(0).stdout;
        for word in words {
            assert!(report.contains(word), "{scene}: `{word}` is not in:\n{report}");
        }
    }
    for scene in BENCHMARKS {
        assert!(list.lines().any(|line| line.split_whitespace().next() == Some(scene)), "{list}");
        jointplay(folder.path(), &format!("check {scene}")).expect(0);
    }
    assert_eq!(list.lines().count(), BUILT_IN.len() + BENCHMARKS.len());

    let line_of = |report: &str, label: &str| {
        let line = report.lines().find(|line| line.starts_with(label)).unwrap_or_else(|| panic!("{report}"));
        line[label.len()..].trim().to_owned()
    };
    // Balls that start in the middle of their clearance fall onto the wall; `check` predicts the peak forces without a run.
    let prediction = jointplay(folder.path(), "check suspension").expect(0).stdout;
    let summary = "run suspension --duration 50ms --every 1ms --out fall.csv --summary json";
    let summary = jointplay(folder.path(), summary).expect(0).stdout;
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    for (joint, peak) in summary["peak_normal_N"].as_object().unwrap() {
        let row = prediction.lines().rfind(|line| line.trim_start().starts_with(&format!("{joint} "))).unwrap();
        let predicted: f64 = row.split_whitespace().nth(1).unwrap().parse().unwrap();
        assert!((predicted / peak.as_f64().unwrap() - 1.0).abs() < 1e-3, "{row}: {peak}");
    }
    let free = jointplay(folder.path(), "check spcmm").expect(0).stdout;
    assert_eq!(line_of(&free, "Degrees of freedom"), "9");
    assert_eq!(line_of(&free, "Constraint rows"), "0");
    let rigid = jointplay(folder.path(), "check spcmm --set contact.clearance=0").expect(0).stdout;
    assert!(line_of(&rigid, "Degrees of freedom").starts_with("0 "), "{rigid}");
    assert_eq!(line_of(&rigid, "Constraint rows"), "9");
    assert!(rigid.contains("Not computed          differential equations"), "{rigid}");
    let paper = jointplay(folder.path(), "check spcmm --set formulation=lagrange").expect(0).stdout;
    assert!(line_of(&paper, "Equations").contains("42 velocity coordinates, 33 constraint rows"), "{paper}");
    let low = jointplay(folder.path(), "check spcmm --set contact.restitution=0.3").expect(0).stdout;
    assert!(line_of(&low, "Warning").contains("restitution"), "{low}");
    let singular = jointplay(folder.path(), "check spcmm --set spcmm.slider_plane=170mm").expect(0).stdout;
    assert!(line_of(&singular, "Warning").contains("singular"), "{singular}");
    // Large reactions to a load do not indicate a singular pose.
    let text = std::fs::read_to_string("assets/scenes/spcmm.toml").unwrap();
    let load = "[[load]]\nname = \"press\"\non = { body = \"platform\" }\nforce = \"0 0 -900 N\"\n";
    std::fs::write(folder.path().join("pressed.toml"), format!("{text}\n{load}")).unwrap();
    let pressed = jointplay(folder.path(), "check pressed.toml").expect(0).stdout;
    assert!(!pressed.contains("singular"), "{pressed}");
    assert!(!free.contains("Warning"), "{free}");
    let tight = jointplay(folder.path(), "check spcmm --set contact.clearance=5um").expect(0).stdout;
    assert!(line_of(&tight, "Warning").contains("Hertz"), "{tight}");
}

/// A planar loop of hinges constrains only the directions across its plane more than once.
#[test]
fn check_names_the_parts_of_a_reaction_that_are_not_unique() {
    let folder = folder();
    let press = jointplay(folder.path(), "check press").expect(0).stdout;
    let parts = "(not unique: the force along y, the torque across y)\n";
    assert!(press.contains(parts), "{press}");
    let listed = "forces at connecting-pin (the force along y, the torque across y): joints constrain";
    assert!(press.contains(listed), "{press}");
    // In both formulations.
    let lagrange = jointplay(folder.path(), "check press --set formulation=lagrange").expect(0).stdout;
    assert!(lagrange.contains(parts), "{lagrange}");
}

#[test]
fn a_scene_with_resting_sliders_can_be_checked() {
    // A drive at rest has no period to scan; this check once never returned.
    let folder = folder();
    for changes in ["", " --set formulation=lagrange"] {
        let line = format!("check spcmm --set spcmm.frequency=0{changes}");
        let checked = jointplay(folder.path(), &line).expect(0);
        assert!(!checked.stdout.contains("singular"), "{}", checked.stdout);
    }
}

#[test]
fn a_file_works_wherever_a_built_in_name_does() {
    let folder = folder();
    let source = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/pendulum.toml");
    fs::copy(source, folder.path().join("mine.toml")).unwrap();
    let summary =
        |scene: &str| jointplay(folder.path(), &format!("run {scene} --duration 5ms --summary json")).expect(0).json();
    let (mine, built_in) = (summary("mine.toml"), summary("pendulum"));
    assert_eq!(mine["state_hash"], built_in["state_hash"]);
    assert_eq!(mine["scene_file"], "mine.toml");
    jointplay(folder.path(), "check ./mine.toml").expect(0);
}

#[cfg(unix)]
#[test]
fn a_file_name_need_not_be_unicode() {
    use std::os::unix::ffi::OsStrExt;
    let folder = folder();
    let name = |bytes: &[u8]| PathBuf::from(std::ffi::OsStr::from_bytes(bytes));
    let source = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/pendulum.toml");
    fs::copy(source, folder.path().join(name(b"\xff.toml"))).unwrap();
    let run = |scene: &[u8]| {
        command(folder.path(), "run --duration 1ms --every 1ms --out")
            .args([name(b"\xfe.json"), name(scene)])
            .output()
            .unwrap()
    };
    let output = run(b"\xff.toml");
    assert!(output.status.success(), "{output:?}");
    let file: Json = serde_json::from_slice(&fs::read(folder.path().join(name(b"\xfe.json"))).unwrap()).unwrap();
    assert_eq!(file["meta"]["scene_file"], "\u{fffd}.toml");
    let missing = run(b"./\xfd.toml");
    assert_eq!(missing.status.code(), Some(1), "{missing:?}");
}

/// Reading them might never end, or wait for ever.
#[cfg(target_os = "linux")]
#[test]
fn a_pipe_or_a_device_is_refused_where_a_file_is_expected() {
    let folder = folder();
    for name in ["pipe.toml", "pipe.stl", "pipe"] {
        assert!(Command::new("mkfifo").arg(folder.path().join(name)).status().unwrap().success());
    }
    let pendulum = fs::read_to_string("assets/scenes/pendulum.toml").unwrap();
    let mesh = "shapes = [{ form = \"mesh\", file = \"pipe.stl\", unit = \"mm\" }, ";
    let meshed = pendulum.replacen("shapes = [", mesh, 1);
    fs::write(folder.path().join("mesh.toml"), meshed).unwrap();
    fs::write(folder.path().join("include.toml"), format!("include = [\"pipe.toml\"]\n{pendulum}")).unwrap();
    for reader in [
        "check ./pipe.toml",
        "check /dev/zero",
        "check mesh.toml",
        "check include.toml",
        "run pendulum --duration 1ms --from-state pipe",
        "run pendulum --duration 1ms --from-state /dev/zero",
        "sweep pendulum --points pipe --duration 1ms --out a.npz",
        "sweep pendulum --points /dev/zero --duration 1ms --out a.npz",
        #[cfg(feature = "gui")]
        "lessons ./pipe",
        #[cfg(feature = "gui")]
        "lessons /dev/zero",
    ] {
        let run = jointplay(folder.path(), reader);
        assert!(matches!(run.code, Some(1 | 2)), "{reader}: {:?}", run.code);
        assert!(run.stderr.contains("this is a pipe, a socket or a device, not a file"), "{reader}: {}", run.stderr);
    }
}

/// The shell's file size limit makes every write beyond a few kilobytes fail, as on a full disk.
#[cfg(unix)]
#[test]
fn a_full_disk_is_reported_in_one_line_and_leaves_no_file() {
    let folder = folder();
    let run = "run spcmm --duration 20ms --every 50us --quiet --out";
    let sweep =
        "sweep spcmm --vary contact.clearance=0.2mm..0.3mm:2 --periods 2 --discard 0 --no-exponent --quiet --out";
    for (line, out, blocks) in [(run, "a.csv", 16), (run, "a.json", 16), (run, "a.npz", 16), (sweep, "b.npz", 40)] {
        let program = env!("CARGO_BIN_EXE_jointplay");
        let full = format!("trap '' XFSZ; ulimit -f {blocks}; exec {program} {line} {out}");
        let mut shell = Command::new("sh");
        let output = shell.args(["-c", &full]).current_dir(folder.path());
        let output = output.output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert!(stderr.starts_with(&format!("error: cannot write {out}: ")), "{stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
        assert!(stderr.ends_with("(os error 27)\n"), "{stderr}");
    }
    assert_eq!(names(folder.path()), ["b.npz.partial"]);
}

#[test]
fn excessive_requests_are_refused_with_the_largest_allowed_value() {
    let folder = folder();
    let sweep = "sweep spcmm --vary contact.clearance=0.2mm..0.3mm:2 --out a.npz";
    for (line, words) in [
        ("run pendulum --duration 1e300s".to_owned(), "1e6 s"),
        ("run pendulum --duration 1000001s".to_owned(), "1e6 s"),
        (format!("{sweep} --periods 9000000000000000000 --discard 8999999999999999999"), "500000 periods of 2 s"),
        (format!("{sweep} --periods 500001 --discard 500000"), "500000 periods of 2 s"),
        (format!("{sweep} --periods 9e18 --discard 1"), "67108864 sections"),
        ("run pendulum --duration 1s --every 1ns --out a.csv".to_owned(), "2 GiB"),
    ] {
        let run = jointplay(folder.path(), &line).expect(2);
        assert!(run.stderr.contains(words), "{line}: {}", run.stderr);
    }
    assert_eq!(names(folder.path()), [""; 0]);
}

#[test]
fn help_version_and_reference_go_to_standard_output() {
    let folder = folder();
    let version = jointplay(folder.path(), "--version").expect(0).stdout;
    assert_eq!(version.trim(), concat!("jointplay ", env!("CARGO_PKG_VERSION")));
    assert!(jointplay(folder.path(), "--help").expect(0).stdout.contains("render"));
    #[cfg(target_os = "linux")]
    for line in ["--version", "--help", "run --help", "reference"] {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = command(folder.path(), line).stdout(full).output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{line}: {stderr}");
        assert!(stderr.starts_with("error: cannot write to standard output: "), "{line}: {stderr}");
    }
    let page = jointplay(folder.path(), "reference").expect(0).stdout;
    assert!(page.contains("### `[[ball_joint]]`"));
    let schema = jointplay(folder.path(), "schema").expect(0).stdout;
    let schema: Json = serde_json::from_str(&schema).unwrap();
    assert!(schema["properties"]["ball_joint"].is_object());
    let page = jointplay(folder.path(), "parameters").expect(0).stdout;
    for key in
        ["contact.clearance", "contact.friction_velocity", "gravity.x", "formulation", "solver.preset", "view.down"]
    {
        assert!(page.contains(key), "{key}");
    }
}

#[cfg(feature = "gui")]
mod frames {
    use super::*;

    fn manifest(folder: &Path) -> Json {
        serde_json::from_slice(&fs::read(folder.join("manifest.json")).unwrap()).unwrap()
    }

    fn picture(path: &Path) -> (u32, u32, Vec<u8>) {
        let decoder = png::Decoder::new(std::io::BufReader::new(fs::File::open(path).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        (info.width, info.height, pixels)
    }

    #[test]
    fn frames_come_with_a_manifest_and_repeat_bit_for_bit() {
        let folder = folder();
        for out in ["a", "b"] {
            let line = format!("render spcmm --at 0s,7.85ms --size 320x180 --set contact.friction=0.2 --out {out}");
            jointplay(folder.path(), &line).expect(0);
        }
        let (a, b) = (folder.path().join("a"), folder.path().join("b"));
        assert_eq!(names(&a), ["frame_00000.png", "frame_00001.png", "manifest.json"]);
        for name in names(&a) {
            assert!(fs::read(a.join(&name)).unwrap() == fs::read(b.join(&name)).unwrap(), "{name}");
        }
        let manifest = manifest(&a);
        assert_eq!(manifest["scene"], "spcmm");
        assert_eq!(manifest["version"], env!("CARGO_PKG_VERSION"));
        assert_eq!(manifest["status"], "done");
        assert_eq!(manifest["size"], serde_json::json!([320, 180]));
        assert_eq!(manifest["changed_parameters"]["contact.friction"], "0.2");
        assert!(manifest["parameters"]["contact.clearance"].is_string());
        assert!(manifest["method"].is_string());
        assert!(!manifest["adapter"].as_str().unwrap().is_empty());
        let frames = manifest["frames"].as_array().unwrap();
        assert_eq!((frames[0]["time_s"].as_f64(), frames[1]["time_s"].as_f64()), (Some(0.0), Some(7.85e-3)));
        assert_ne!(frames[0]["state_hash"], frames[1]["state_hash"]);
        for frame in frames {
            assert!(frame["state_time_s"].as_f64() >= frame["time_s"].as_f64());
            let (width, height, pixels) = picture(&a.join(frame["file"].as_str().unwrap()));
            assert_eq!((width, height), (320, 180));
            let mut colours: Vec<&[u8]> = pixels.chunks_exact(4).collect();
            colours.sort_unstable();
            colours.dedup();
            assert!(colours.len() > 200, "too few colours for a real picture: {}", colours.len());
        }
        let first = picture(&a.join("frame_00000.png")).2;
        assert!(first != picture(&a.join("frame_00001.png")).2, "an impact is visible");
    }

    #[test]
    fn a_slow_motion_film_has_its_frames_at_equal_times() {
        let folder = folder();
        let line = "render pendulum --duration 4ms --fps 10 --slow 50 --size 160x90 --out film --overlay";
        jointplay(folder.path(), line).expect(0);
        let frames = manifest(&folder.path().join("film"))["frames"].clone();
        let times: Vec<f64> = frames.as_array().unwrap().iter().map(|f| f["time_s"].as_f64().unwrap()).collect();
        assert_eq!(times, [0.0, 0.002, 0.004]);
    }

    #[test]
    fn a_film_marks_the_impacts_between_its_frames_and_a_single_picture_does_not() {
        let folder = folder();
        // At 9 ms every ball is in free flight; each joint was hit 1.2 ms before.
        let common = "--size 320x180 --hide trail,flash";
        for (name, arrows) in [("with", "both"), ("without", "none")] {
            let film = format!(
                "render spcmm --duration 9ms --fps 1000 --slow 0.1111111111111111 {common} --arrows {arrows} --out film_{name}"
            );
            jointplay(folder.path(), &film).expect(0);
            let single = format!("render spcmm --at 9ms {common} --arrows {arrows} --out single_{name}");
            jointplay(folder.path(), &single).expect(0);
        }
        let frames = manifest(&folder.path().join("film_with"))["frames"].clone();
        assert_eq!(frames[1]["time_s"], 0.009);
        let last = |name: &str, frame: &str| picture(&folder.path().join(name).join(frame)).2;
        let (film, single) = ("frame_00001.png", "frame_00000.png");
        assert!(last("film_with", film) != last("single_with", single), "peaks are marked");
        assert!(last("film_without", film) == last("single_without", single), "the marks are the only difference");
    }

    #[test]
    fn a_wear_map_of_a_frame_covers_the_run_so_far() {
        let folder = folder();
        let common = "--size 160x120 --close-up S1 --magnification 20 --arrows none --hide trail,flash";
        let slow = "--fps 1000 --slow 0.1111111111111111";
        for (line, out) in [
            (format!("--duration 9ms {slow} --wear impulse"), "film"),
            ("--at 9ms --wear impulse".to_owned(), "single"),
            ("--at 9ms --wear friction".to_owned(), "friction"),
            ("--at 9ms".to_owned(), "without"),
        ] {
            let line = format!("render spcmm {line} {common} --out {out}");
            jointplay(folder.path(), &line).expect(0);
        }
        let at = |name: &str, frame: &str| picture(&folder.path().join(name).join(frame)).2;
        let single = at("single", "frame_00000.png");
        assert!(at("film", "frame_00001.png") == single);
        for other in ["friction", "without"] {
            assert!(at(other, "frame_00000.png") != single, "{other}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_render_killed_at_any_instant_leaves_the_old_or_the_new_folder() {
        let work = folder();
        let render = |friction: &str| {
            format!(
                "render pendulum --duration 20ms --fps 200 --size 64x64 --force --set contact.friction={friction} --out film"
            )
        };
        let film = |folder: &Path| -> Vec<(String, Vec<u8>)> {
            // Between the two renames the old folder is in a temporary one; the next command restores it.
            let backup = || names(folder).iter().map(|name| folder.join(name).join("old")).find(|old| old.is_dir());
            let path = Some(folder.join("film")).filter(|film| film.is_dir()).or_else(backup).unwrap();
            let content = |name: String| (name.clone(), fs::read(path.join(name)).unwrap());
            names(&path).into_iter().map(content).collect()
        };
        jointplay(work.path(), &render("0.1")).expect(0);
        let old = film(work.path());
        let start = std::time::Instant::now();
        jointplay(work.path(), &render("0.2")).expect(0);
        let length = start.elapsed();
        let new = film(work.path());
        assert!(old != new);
        crate::common::at_random_instants(length, 3, |instant| {
            // Restores the result of the first run.
            fs::remove_dir_all(work.path().join("film")).unwrap();
            fs::create_dir(work.path().join("film")).unwrap();
            old.iter().for_each(|(name, content)| fs::write(work.path().join("film").join(name), content).unwrap());
            let mut child = command(work.path(), &render("0.2")).stdout(Stdio::null()).spawn().unwrap();
            std::thread::sleep(instant);
            child.kill().unwrap();
            child.wait().unwrap();
            let left = film(work.path());
            assert!(left == old || left == new);
            jointplay(work.path(), &render("0.2")).expect(0);
            assert!(film(work.path()) == new);
            assert_eq!(names(work.path()), ["film"]);
        });
    }

    #[test]
    fn incomplete_frames_leave_the_older_result_and_are_written_beside_it() {
        let folder = folder();
        let unstable = "render spcmm --set solver.method=rk4 --set solver.step=2ms --size 64x64 --force --quiet";
        for (what, out) in [("--at 0s,1ms,2ms", "--out out"), ("--duration 2ms --fps 1000", "--film out.mp4")] {
            jointplay(folder.path(), &format!("render spcmm {what} --size 64x64 --quiet {out}")).expect(0);
            let name = out.split(' ').nth(1).unwrap();
            let files = || crate::program::files(folder.path());
            let old = files();
            let what = what.replace("2ms", "10s").replace("1000", "10");
            let stopped = jointplay(folder.path(), &format!("{unstable} {what} {out}")).expect(4);
            let beside = format!("the older result stays, the incomplete one is in incomplete-{name}");
            assert!(stopped.stderr.contains(&beside), "{}", stopped.stderr);
            assert!(stopped.stdout.ends_with(&format!(" in incomplete-{name}\n")), "{}", stopped.stdout);
            let now = files();
            assert!(old.iter().all(|(name, content)| now[name] == *content) && now.len() > old.len());
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn interrupted_frames_leave_the_older_result() {
        let folder = folder();
        let render = "render pendulum --size 64x64 --arrows none --force --quiet --out out";
        jointplay(folder.path(), &format!("{render} --at 0s,1ms,2ms")).expect(0);
        let old = crate::program::files(folder.path());
        let child = start_and_listen(&mut command(folder.path(), &format!("{render} --at 0s,1000000s")));
        // The first frame is in the temporary folder.
        poll_until(|| crate::program::files(folder.path()).len() > old.len());
        signal(&child, "-INT");
        let output = child.wait_with_output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(130), "{stderr}");
        assert!(stderr.contains("the incomplete one is in incomplete-out"), "{stderr}");
        let now = crate::program::files(folder.path());
        assert!(old.iter().all(|(name, content)| now[name] == *content), "the older result stays");
        assert_eq!(names(&folder.path().join("incomplete-out")), ["frame_00000.png", "manifest.json"]);
    }

    #[test]
    fn the_whole_window_can_be_rendered() {
        let folder = folder();
        jointplay(folder.path(), "render spcmm --at 1ms --size 800x500 --ui --out ui").expect(0);
        let (width, height, _) = picture(&folder.path().join("ui/frame_00000.png"));
        assert_eq!((width, height), (800, 500));
    }

    #[test]
    fn failures_of_render_have_the_right_exit_code() {
        let folder = folder();
        for (line, code, word) in [
            ("render spcmm --out a", 2, "--at"),
            ("render spcmm --duration 1s --out a", 2, "--fps"),
            ("render spcmm --duration 1s --fps 0 --out a", 2, "--fps"),
            ("render spcmm --duration 1s --fps 1e9 --out a", 2, "--fps"),
            ("render spcmm --at 1 --out a", 2, "--at"),
            ("render spcmm --at 0 --size 0x5 --out a", 2, "--size"),
            ("render spcmm --at 0 --magnification 500 --out a", 2, "--magnification"),
            ("render spcmm --at 0 --close-up S7 --size 64x64 --out a", 2, "S1, S2, S3"),
            ("render spcmm --at 0 --size 64x64 --out missing/a", 1, "missing/a"),
        ] {
            let run = jointplay(folder.path(), line).expect(code);
            assert!(run.stderr.contains(word), "{line}: {}", run.stderr);
        }
        assert_eq!(names(folder.path()), [""; 0]);
    }

    /// Mesa's Wayland client complains without a runtime folder.
    #[cfg(target_os = "linux")]
    #[test]
    fn without_a_runtime_folder_drivers_write_nothing_to_standard_error() {
        let folder = folder();
        for (line, runtime) in [
            ("render pendulum --at 0s --size 64x64 --out plain --quiet", None),
            ("render pendulum --at 0s --size 800x500 --ui --out window --quiet", Some("here")),
        ] {
            let mut command = command(folder.path(), line);
            command.env_remove("XDG_RUNTIME_DIR");
            if let Some(runtime) = runtime {
                command.env("XDG_RUNTIME_DIR", runtime);
            }
            let output = command.output().unwrap();
            assert_eq!(String::from_utf8(output.stderr).unwrap(), "", "{line}");
            assert_eq!(output.status.code(), Some(0), "{line}");
        }
        assert_eq!(names(folder.path()), ["plain", "window"]);
    }

    /// After `sudo` the variable may name a folder of another user, who may also have made links in /tmp.
    #[cfg(target_os = "linux")]
    #[test]
    fn the_scripts_use_no_runtime_folder_of_another_user() {
        let folder = folder();
        let foreign = folder.path().join("foreign");
        fs::create_dir(&foreign).unwrap();
        // Only root can give it away; for anybody else the root folder is foreign.
        let chown = Command::new("chown").arg("1:1").arg(&foreign).stderr(Stdio::null()).status().unwrap();
        let foreign = if chown.success() { foreign.as_path() } else { Path::new("/") };
        let script = "source tools/prepare.sh; ln -s / \"$TMPDIR/jointplay-runtime-$(id -u)\"; prepare_environment; \
                      echo \"$XDG_RUNTIME_DIR\"; stat -c '%u %a' \"$XDG_RUNTIME_DIR\"; id -u";
        let mut bash = Command::new("bash");
        bash.args(["-c", script]).env("XDG_RUNTIME_DIR", foreign).env("TMPDIR", folder.path());
        let text = String::from_utf8(bash.output().unwrap().stdout).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        let [chosen, owner, user] = lines[..] else { panic!("{text}") };
        assert!(Path::new(chosen) != foreign && !fs::symlink_metadata(chosen).unwrap().is_symlink(), "{text}");
        assert_eq!(owner, format!("{user} 700"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_window_without_a_display_reports_the_alternative() {
        let folder = folder();
        let view = jointplay(folder.path(), "view pendulum").expect(1);
        assert!(view.stderr.contains("display") && view.stderr.contains("jointplay render"), "{}", view.stderr);
        let view = jointplay(folder.path(), "view pendulum --set contact.clearance=-1mm").expect(2);
        assert!(view.stderr.contains("contact.clearance"), "{}", view.stderr);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn without_a_graphics_adapter_the_exit_code_is_three_and_the_message_names_a_package() {
        let folder = folder();
        let output = command(folder.path(), "render spcmm --at 0s --size 64x64 --out a")
            .env("VK_DRIVER_FILES", "/dev/null")
            .env("VK_ICD_FILENAMES", "/dev/null")
            .env("__EGL_VENDOR_LIBRARY_FILENAMES", "/dev/null")
            .output()
            .unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(3), "{stderr}");
        assert!(stderr.contains("mesa-vulkan-drivers"), "{stderr}");
        assert_eq!(names(folder.path()), [""; 0]);
    }
}

#[cfg(feature = "gui")]
#[test]
fn a_bad_link_is_refused_before_any_window_opens() {
    let folder = tempfile::tempdir().unwrap();
    for (link, words) in [
        ("?scene=pendulum&c=5", "contact.clearance = 5: needs a unit"),
        ("#scene=pendulun", "did you mean `pendulum`?"),
        ("t=5", "link: t = 5: needs a unit"),
        ("pendulum", "link: pendulum: is neither pairs nor the address of a page"),
    ] {
        let outcome = jointplay(folder.path(), &format!("view --link {link}"));
        assert_eq!(outcome.code, Some(2), "{}", outcome.stderr);
        assert!(outcome.stderr.contains(words), "{}", outcome.stderr);
    }
    let outcome = jointplay(folder.path(), "view pendulum --link ?c=1mm");
    assert_eq!(outcome.code, Some(2), "{}", outcome.stderr);
}

/// Every text a user can supply, with sequences that set a terminal's title, clear it or reverse its direction.
#[test]
fn control_characters_of_foreign_text_do_not_reach_the_terminal() {
    const CONTROL: &str = "\u{1b}]0;title\u{7}\u{9b}2J\u{7f}\r\u{202e}\u{2066}";
    let folder = folder();
    let good = fs::read_to_string("assets/scenes/pendulum.toml").unwrap();
    let escape = |c: char| format!("\\u{:04x}", u32::from(c));
    let escaped: String = CONTROL.chars().map(escape).collect();
    let title = good.lines().find(|line| line.starts_with("title")).unwrap();
    let with_title = good.replace(title, &format!("title = \"{escaped}\""));
    let not_name = |line: &&str| !line.starts_with("name = \"pendulum\"");
    let unnamed = good.lines().filter(not_name).collect::<Vec<_>>().join("\n");
    let file = |name: &str, text: &str| {
        fs::write(folder.path().join(name), text).unwrap();
        format!("./{name}")
    };
    let hostile = |line: &str| good.replace(line, &format!("{} = \"{escaped}\"", line.split(' ').next().unwrap()));
    let scenes = [
        file("title.toml", &with_title),
        file(&format!("{CONTROL}.toml"), &unnamed),
        file("joint.toml", &hostile("name = \"S1\"")),
        file("body.toml", &hostile("child = \"rod\"")),
        file("key.toml", &format!("\"{escaped}\" = 1\n{good}")),
        file("raw.toml", &format!("{CONTROL}\n{good}")),
        CONTROL.to_owned(),
    ];
    let title = scenes[0].clone();
    let mut lines: Vec<Vec<String>> = Vec::new();
    let words = |line: &[&str]| line.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
    for scene in &scenes {
        lines.push(words(&["check", scene]));
    }
    for change in [
        format!("{CONTROL}=1"),
        format!("contact.clearance={CONTROL}"),
        format!("joint.{CONTROL}.clearance=1mm"),
        CONTROL.to_owned(),
    ] {
        lines.push(words(&["check", "pendulum", "--set", &change]));
    }
    let run = ["run", &title, "--duration", "1ms"];
    for more in [
        words(&[]),
        words(&["--summary", "json"]),
        words(&["--every", CONTROL, "--out", "rows.csv"]),
        words(&["--every", "1ms", "--out", &format!("{CONTROL}.csv")]),
        words(&["--every", "1ms", "--out", &format!("{CONTROL}.txt")]),
    ] {
        lines.push([words(&run), more].concat());
    }
    lines.push(words(&[CONTROL]));
    lines.push(words(&["run", &format!("--{CONTROL}")]));
    #[cfg(feature = "gui")]
    for link in ["?scene=%1b]0;title%07", "?%9b=1&%1b=2", "?c=%1b]0;", "?log=%1b"] {
        lines.push(words(&["view", "--link", link]));
    }
    let mut escaped_count = 0;
    for line in lines {
        let output = command(folder.path(), "").args(&line).output().unwrap();
        for stream in [output.stdout, output.stderr] {
            let text = String::from_utf8(stream).unwrap();
            let is_control = |c: char| (c.is_control() && c != '\n') || CONTROL[10..].contains(c) && !c.is_ascii();
            assert!(!text.contains(is_control), "{line:?}: {text:?}");
            assert!(!text.contains("internal error"), "{text}");
            escaped_count += usize::from(text.contains("\\u001b"));
        }
    }
    // They are printed escaped, not dropped.
    assert!(escaped_count >= 12, "{escaped_count}");
    let summary = jointplay(folder.path(), &format!("run {title} --duration 1ms --summary json"));
    summary.expect(0).json();
}

#[test]
fn a_former_command_is_answered_with_the_way_there() {
    let package =
        [("sensitivity", "sensitivity"), ("tolerance", "tolerance"), ("import", "import"), ("reproduce", "paper")];
    let in_package = package.map(|(word, now)| {
        let ways = format!("`./run lab {now} …`, or `python -m jointplay {now} …` after `pip install jointplay`");
        (word, format!("error: `jointplay {word}` is now {ways}\n"))
    });
    let gone = [
        ("bench", "`jointplay tradeoff SCENE…` measures the cost and error of every method on scenes"),
        (
            "validate",
            "`cargo test -p jointplay-analysis --test physics validation` compares with the known answers of docs/validation.md",
        ),
    ];
    let gone = gone.map(|(word, now)| (word, format!("error: `jointplay {word}` is gone: {now}\n")));
    for (word, answer) in in_package.into_iter().chain(gone) {
        let run = jointplay(folder().path(), &format!("{word} four-bar --out out")).expect(2);
        assert_eq!((run.stdout.as_str(), run.stderr), ("", answer));
    }
    let all = jointplay(folder().path(), "tradeoff --all").expect(2).stderr;
    assert!(all.starts_with("error: `--all` of `jointplay tradeoff` is gone: name the scenes"), "{all}");
}
