//! The command line as scripts see it: streams, exit codes, columns, files.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value as Json;
use tempfile::TempDir;

/// First columns, in the order that readers of the published reference files expect.
const FIRST_COLUMNS: &str = "t_s,x_m,y_m,z_m,alpha_rad,beta_rad,gamma_rad,vx_m_s,vy_m_s,vz_m_s,\
                             S1_eccentricity_m,S2_eccentricity_m,S3_eccentricity_m,S1_normal_N,S2_normal_N,S3_normal_N";

struct Outcome {
    code: Option<i32>,
    stdout: String,
    stderr: String,
}

impl Outcome {
    #[track_caller]
    fn expect(self, code: i32) -> Self {
        assert_eq!(
            self.code,
            Some(code),
            "stdout: {}\nstderr: {}",
            self.stdout,
            self.stderr
        );
        self
    }

    fn json(&self) -> Json {
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|error| panic!("{error} in: {}", self.stdout))
    }
}

/// Runs the program in `folder` with the words of `line`.
fn jointplay(folder: &Path, line: &str) -> Outcome {
    let output = command(folder, line).output().unwrap();
    Outcome {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

fn command(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_jointplay"));
    command
        .args(line.split_whitespace())
        .current_dir(folder)
        .env_remove("RUST_LOG")
        .env_remove("RUST_BACKTRACE")
        // No test opens a window.
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .env_remove("WAYLAND_SOCKET");
    command
}

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

struct Csv {
    header: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Csv {
    /// Every line after the first must be data: that is what readers rely on.
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap();
        let mut lines = text.lines();
        let header: Vec<String> = lines
            .next()
            .unwrap()
            .split(',')
            .map(str::to_owned)
            .collect();
        let rows: Vec<Vec<f64>> = lines
            .map(|line| {
                line.split(',')
                    .map(|value| value.parse().unwrap())
                    .collect()
            })
            .collect();
        assert!(rows.iter().all(|row: &Vec<f64>| row.len() == header.len()));
        assert!(rows.iter().flatten().all(|value| value.is_finite()));
        Self { header, rows }
    }

    fn column(&self, name: &str) -> Vec<f64> {
        let column = self
            .header
            .iter()
            .position(|h| h == name)
            .unwrap_or_else(|| panic!("no column {name}"));
        self.rows.iter().map(|row| row[column]).collect()
    }
}

#[test]
fn rows_of_the_default_scene_have_the_promised_columns_and_times() {
    let folder = folder();
    let run = jointplay(
        folder.path(),
        "run spcmm --duration 20ms --every 0.1ms --out run.csv",
    )
    .expect(0);
    assert!(run.stdout.contains("impacts"), "{}", run.stdout);
    let csv = Csv::read(&folder.path().join("run.csv"));
    assert_eq!(csv.header[..16].join(","), FIRST_COLUMNS);
    let mut expected: Vec<String> = [
        "ax_m_s2",
        "ay_m_s2",
        "az_m_s2",
        "alpha_rate_rad_s",
        "beta_rate_rad_s",
        "gamma_rate_rad_s",
    ]
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
    expected.extend(
        [
            "P1_actuator_N",
            "P2_actuator_N",
            "P3_actuator_N",
            "kinetic_J",
            "potential_J",
        ]
        .map(str::to_owned),
    );
    assert_eq!(csv.header[16..16 + expected.len()], expected);

    assert_eq!(csv.rows.len(), 201);
    for (k, time) in csv.column("t_s").into_iter().enumerate() {
        // Twelve significant digits of k x 0.1 ms.
        assert!((time - k as f64 * 1e-4).abs() <= 1e-14, "row {k}: {time}");
    }

    // The columns of one row tell one story.
    for joint in ["S1", "S2", "S3"] {
        let column = |quantity: &str| csv.column(&format!("{joint}_{quantity}"));
        let clearance = 0.3e-3;
        let (e, delta, normal, state) = (
            column("eccentricity_m"),
            column("penetration_m"),
            column("normal_N"),
            column("state"),
        );
        let components = [column("ex_m"), column("ey_m"), column("ez_m")];
        let force = [
            column("force_x_N"),
            column("force_y_N"),
            column("force_z_N"),
        ];
        let friction = [
            column("friction_x_N"),
            column("friction_y_N"),
            column("friction_z_N"),
        ];
        for k in 0..csv.rows.len() {
            let norm =
                |v: &[Vec<f64>; 3]| (v[0][k].powi(2) + v[1][k].powi(2) + v[2][k].powi(2)).sqrt();
            assert!((norm(&components) - e[k]).abs() < 1e-14);
            assert!((e[k] - clearance - delta[k]).abs() < 1e-13);
            assert_eq!(state[k] > 0.0, delta[k] > 0.0, "{joint} row {k}");
            let along = [0, 1, 2].map(|axis| force[axis][k] - friction[axis][k]);
            let along = along.iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!((along - normal[k]).abs() < 1e-9 * normal[k].max(1.0));
        }
        assert!(
            normal.iter().any(|&n| n > 1.0),
            "{joint} was hit within 20 ms"
        );
    }
}

#[test]
fn sampling_never_changes_the_steps_and_the_same_run_gives_the_same_bits() {
    let folder = folder();
    let run = |every: &str, out: &str| {
        let line = format!("run spcmm --duration 15ms --every {every} --out {out} --summary json");
        jointplay(folder.path(), &line).expect(0).json()
    };
    let (fine, coarse, again) = (
        run("0.1ms", "a.csv"),
        run("1ms", "b.csv"),
        run("0.1ms", "c.csv"),
    );
    for key in [
        "state_hash",
        "steps",
        "evaluations",
        "rejected",
        "peak_normal_N",
    ] {
        assert_eq!(fine[key], coarse[key], "{key}");
        assert_eq!(fine[key], again[key], "{key}");
    }
    let bytes = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(
        bytes("a.csv") == bytes("c.csv"),
        "the same run writes the same file"
    );
    assert!(
        bytes("a.csv.meta.json") == bytes("c.csv.meta.json"),
        "and the same account of it"
    );
    // Rows at common times are the same rows.
    let (fine, coarse) = (
        Csv::read(&folder.path().join("a.csv")),
        Csv::read(&folder.path().join("b.csv")),
    );
    assert_eq!(coarse.rows.len(), 16);
    for (k, row) in coarse.rows.iter().enumerate() {
        // The instants k x 1 ms and 10 k x 0.1 ms may differ in their last bit, a stiff force by a little more.
        for (a, b) in row.iter().zip(&fine.rows[10 * k]) {
            assert!(
                (a - b).abs() <= 1e-9 * a.abs().max(1e-6),
                "row {k}: {a} {b}"
            );
        }
    }
}

#[test]
fn the_summary_has_what_scripts_rely_on() {
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
        assert!(
            summary["peak_normal_N"][joint].as_f64().unwrap() > 100.0,
            "{joint}"
        );
    }
    let hash = summary["state_hash"].as_str().unwrap();
    assert_eq!(hash.len(), 16);
    assert!(u64::from_str_radix(hash, 16).is_ok());
    let changed = summary["changed_parameters"].as_object().unwrap();
    assert_eq!(changed.len(), 1);
    assert!(
        changed["contact.clearance"]
            .as_str()
            .unwrap()
            .starts_with("0.5"),
        "the last one wins"
    );
    assert_eq!(
        names(folder.path()),
        [""; 0],
        "without --out nothing is written"
    );
}

#[test]
fn the_three_formats_hold_the_same_values_and_say_what_made_them() {
    let folder = folder();
    for out in ["a.csv", "a.json", "a.npz"] {
        let line = format!(
            "run pendulum --duration 30ms --every 1ms --out {out} --set contact.friction=0.25"
        );
        jointplay(folder.path(), &line).expect(0);
    }
    let csv = Csv::read(&folder.path().join("a.csv"));
    let csv_meta: Json =
        serde_json::from_slice(&fs::read(folder.path().join("a.csv.meta.json")).unwrap()).unwrap();
    let json: Json =
        serde_json::from_slice(&fs::read(folder.path().join("a.json")).unwrap()).unwrap();
    let mut npz =
        ndarray_npy::NpzReader::new(fs::File::open(folder.path().join("a.npz")).unwrap()).unwrap();
    let npz_meta: ndarray::Array1<u8> = npz.by_name("meta").unwrap();
    let npz_meta: Json = serde_json::from_slice(npz_meta.as_slice().unwrap()).unwrap();
    for meta in [&csv_meta, &json["meta"], &npz_meta] {
        assert_eq!(meta["version"], env!("CARGO_PKG_VERSION"));
        assert_eq!(meta["scene"], "pendulum");
        assert_eq!(meta["changed_parameters"]["contact.friction"], "0.25");
        assert!(meta["method"].is_string());
        assert_eq!(meta["status"], "done");
    }
    for (i, name) in csv.header.iter().enumerate() {
        let columns: ndarray::Array1<f64> = npz.by_name(name).unwrap();
        let json = json["columns"][name].as_array().unwrap();
        assert_eq!((columns.len(), json.len()), (31, 31));
        for (k, row) in csv.rows.iter().enumerate() {
            // The file holds every bit; this reader of it may be one off in the last.
            let json = json[k].as_f64().unwrap();
            assert!(
                (json - columns[k]).abs() <= f64::EPSILON * json.abs(),
                "{name} row {k}"
            );
            assert!(
                (row[i] - columns[k]).abs() <= 5.1e-12 * columns[k].abs(),
                "{name} row {k}"
            );
        }
    }
}

#[test]
fn other_scenes_report_their_own_joints_and_drives() {
    let folder = folder();
    jointplay(
        folder.path(),
        "run slider-crank-driven --duration 1ms --every 1ms --out a.csv",
    )
    .expect(0);
    let csv = Csv::read(&folder.path().join("a.csv"));
    assert_eq!(
        csv.header[10..14].join(","),
        "B_eccentricity_m,C_eccentricity_m,B_normal_N,C_normal_N"
    );
    assert!(
        csv.header.iter().any(|name| name.ends_with("_actuator_Nm")),
        "{:?}",
        csv.header
    );
    assert!(
        csv.column("B_state").iter().all(|&state| state == 3.0),
        "B is ideal"
    );
    assert!(
        csv.column("B_normal_N")[0] > 0.0,
        "an ideal joint reports its reaction"
    );
}

#[test]
fn existing_files_are_replaced_only_by_force_and_nothing_runs_in_vain() {
    let folder = folder();
    let long = "run pendulum --duration 1000000s --every 1s";
    fs::write(folder.path().join("mine.csv"), "mine").unwrap();
    // Each of these would run for hours if it started.
    for (out, word) in [
        ("mine.csv", "--force"),
        ("missing/run.csv", "cannot write"),
        (".", ".csv"),
        ("run.txt", ".npz"),
        ("run", ".json"),
    ] {
        let run = jointplay(folder.path(), &format!("{long} --out {out}"));
        assert!(matches!(run.code, Some(1 | 2)), "{out}: {:?}", run.code);
        assert!(run.stderr.contains(word), "{out}: {}", run.stderr);
    }
    assert_eq!(names(folder.path()), ["mine.csv"]);
    assert_eq!(
        fs::read_to_string(folder.path().join("mine.csv")).unwrap(),
        "mine"
    );

    let short = "run pendulum --duration 1ms --every 1ms --out mine.csv";
    jointplay(folder.path(), short).expect(1);
    jointplay(folder.path(), &format!("{short} --force")).expect(0);
    assert_eq!(Csv::read(&folder.path().join("mine.csv")).rows.len(), 2);
    assert_eq!(names(folder.path()), ["mine.csv", "mine.csv.meta.json"]);
}

#[test]
fn a_failed_start_leaves_no_file() {
    let folder = folder();
    jointplay(
        folder.path(),
        "run spcmm --duration 1ms --every 1ms --out a.csv --set contact.clearance=20mm",
    )
    .expect(2);
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
        (
            "run spcmm --duration 1ms --every 0 --out a.csv",
            2,
            &["--every"],
        ),
        ("run spcmm --duration 1ms --every 1ms", 2, &["--out"]),
        (
            "run spcmm --duration 1s --every 1ns --out a.csv",
            2,
            &["rows", "--every"],
        ),
        ("run spcmn --duration 1ms", 2, &["spcmn", "spcmm"]),
        ("run broken.toml --duration 1ms", 2, &["broken.toml", ":1:"]),
        ("run missing.toml --duration 1ms", 1, &["missing.toml"]),
        ("run ./missing --duration 1ms", 1, &["missing"]),
        (
            "check spcmm --set contact.clearence=1mm",
            2,
            &["contact.clearence", "contact.clearance"],
        ),
        (
            "check spcmm --set contact.clearance=1",
            2,
            &["contact.clearance", "mm", "unit"],
        ),
        (
            "check spcmm --set contact.clearance=1s",
            2,
            &["contact.clearance", "1s", "mm"],
        ),
        (
            "check spcmm --set contact.friction=-1",
            2,
            &["contact.friction", "-1", "0"],
        ),
        (
            "check spcmm --set contact.friction=nan",
            2,
            &["contact.friction", "nan"],
        ),
        ("check spcmm --set chain.links=3", 2, &["chain.links"]),
        ("check spcmm --set contact.friction", 2, &["KEY=VALUE"]),
        ("check spcmm --set joint.S9.clearance=1mm", 2, &["S9"]),
        ("check spcmm --set spcmm.slider_plane=350mm", 2, &["rod"]),
        ("scenes extra", 2, &["extra"]),
    ] {
        let run = jointplay(folder.path(), line).expect(code);
        assert_eq!(run.stdout, "", "{line}: results only");
        for word in words {
            assert!(
                run.stderr.contains(word),
                "{line}: `{word}` is not in: {}",
                run.stderr
            );
        }
        assert!(!run.stderr.contains("panicked"), "{line}: {}", run.stderr);
    }
    assert_eq!(names(folder.path()), ["broken.toml"]);
}

#[test]
fn a_stopped_run_keeps_its_rows_and_says_why() {
    let folder = folder();
    // Explicit steps a hundred times longer than an impact cannot hold the contact.
    let line = "run spcmm --set solver.method=rk4 --set solver.step=2ms --duration 10s --every 1ms --out a.csv --summary json";
    let run = jointplay(folder.path(), line).expect(4);
    assert_eq!(run.json()["status"], "diverged");
    assert!(run.stderr.contains("stopped at t ="), "{}", run.stderr);
    let csv = Csv::read(&folder.path().join("a.csv"));
    assert!(!csv.rows.is_empty());
    let meta: Json =
        serde_json::from_slice(&fs::read(folder.path().join("a.csv.meta.json")).unwrap()).unwrap();
    assert_eq!(meta["status"], "diverged");
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_run_keeps_its_complete_rows() {
    let folder = folder();
    let line = "run pendulum --duration 1000000s --every 1s --out a.json --summary json";
    let child = command(folder.path(), line)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let pid = child.id();
    // Ctrl-C counts once the program listens for it: signal 2 is then among those it catches.
    let listens = || {
        let status = fs::read_to_string(format!("/proc/{pid}/status")).unwrap();
        let caught = status
            .lines()
            .find_map(|line| line.strip_prefix("SigCgt:"))
            .unwrap();
        u64::from_str_radix(caught.trim(), 16).unwrap() & 2 != 0
    };
    while !listens() {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    assert!(
        Command::new("kill")
            .args(["-INT", &pid.to_string()])
            .status()
            .unwrap()
            .success()
    );
    let output = child.wait_with_output().unwrap();
    assert_eq!(
        output.status.code(),
        Some(130),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let summary: Json = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["status"], "interrupted");
    let file: Json =
        serde_json::from_slice(&fs::read(folder.path().join("a.json")).unwrap()).unwrap();
    assert_eq!(file["meta"]["status"], "interrupted");
    let times = file["columns"]["t_s"].as_array().unwrap();
    assert_eq!(times.len() as u64, summary["rows"].as_u64().unwrap());
    assert!(times.last().unwrap().as_f64().unwrap() <= summary["time_s"].as_f64().unwrap());
    assert_eq!(names(folder.path()), ["a.json"]);
}

#[test]
fn scenes_are_listed_and_each_says_what_it_contains() {
    let folder = folder();
    let list = jointplay(folder.path(), "scenes").expect(0).stdout;
    for (scene, words) in [
        (
            "spcmm",
            &[
                "7 moving",
                "3 with clearance",
                "contact forces at S1, S2, S3",
                "P1, P2, P3",
            ][..],
        ),
        ("pendulum", &["1 moving", "1 with clearance"]),
        (
            "slider-crank",
            &[
                "3 moving",
                "1 with clearance, 1 ideal",
                "reactions of the ideal joints at B",
            ],
        ),
        ("slider-crank-driven", &["3 moving", "1 driven revolute"]),
        ("chain", &["8 moving", "8 with clearance"]),
    ] {
        assert!(
            list.lines()
                .any(|line| line.split_whitespace().next() == Some(scene)),
            "{list}"
        );
        let report = jointplay(folder.path(), &format!("check {scene}"))
            .expect(0)
            .stdout;
        for word in words {
            assert!(
                report.contains(word),
                "{scene}: `{word}` is not in:\n{report}"
            );
        }
    }
    assert_eq!(list.lines().count(), 5);

    let line_of = |report: &str, label: &str| {
        let line = report
            .lines()
            .find(|line| line.starts_with(label))
            .unwrap_or_else(|| panic!("{report}"));
        line[label.len()..].trim().to_owned()
    };
    let free = jointplay(folder.path(), "check spcmm").expect(0).stdout;
    assert_eq!(line_of(&free, "Degrees of freedom"), "9");
    assert_eq!(line_of(&free, "Constraint rows"), "0");
    let rigid = jointplay(folder.path(), "check spcmm --set contact.clearance=0")
        .expect(0)
        .stdout;
    assert!(
        line_of(&rigid, "Degrees of freedom").starts_with("0 "),
        "{rigid}"
    );
    assert_eq!(line_of(&rigid, "Constraint rows"), "9");
    assert!(
        rigid.contains("Not computed          differential equations"),
        "{rigid}"
    );
    let paper = jointplay(folder.path(), "check spcmm --set formulation=lagrange")
        .expect(0)
        .stdout;
    assert!(
        line_of(&paper, "Equations").contains("42 velocity coordinates, 33 constraint rows"),
        "{paper}"
    );
    let low = jointplay(folder.path(), "check spcmm --set contact.restitution=0.3")
        .expect(0)
        .stdout;
    assert!(line_of(&low, "Warning").contains("restitution"), "{low}");
    let singular = jointplay(folder.path(), "check spcmm --set spcmm.slider_plane=170mm")
        .expect(0)
        .stdout;
    assert!(
        line_of(&singular, "Warning").contains("singular"),
        "{singular}"
    );
    assert!(!free.contains("Warning"), "{free}");
    let tight = jointplay(folder.path(), "check spcmm --set contact.clearance=5um")
        .expect(0)
        .stdout;
    assert!(line_of(&tight, "Warning").contains("Hertz"), "{tight}");
}

#[test]
fn a_scene_whose_sliders_rest_can_be_checked() {
    // A drive without a period has no period to look through: this once never came back.
    let here = folder();
    for changes in ["", " --set formulation=lagrange"] {
        let line = format!("check spcmm --set spcmm.frequency=0{changes}");
        let checked = jointplay(here.path(), &line).expect(0);
        assert!(!checked.stdout.contains("singular"), "{}", checked.stdout);
    }
}

#[test]
fn a_file_works_wherever_a_name_does() {
    let folder = folder();
    let source = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/pendulum.toml");
    fs::copy(source, folder.path().join("mine.toml")).unwrap();
    let summary = |scene: &str| {
        jointplay(
            folder.path(),
            &format!("run {scene} --duration 5ms --summary json"),
        )
        .expect(0)
        .json()
    };
    let (mine, built_in) = (summary("mine.toml"), summary("pendulum"));
    assert_eq!(mine["state_hash"], built_in["state_hash"]);
    assert_eq!(mine["scene_file"], "mine.toml");
    jointplay(folder.path(), "check ./mine.toml").expect(0);
}

#[test]
fn help_version_and_the_reference_page_are_results() {
    let folder = folder();
    let version = jointplay(folder.path(), "--version").expect(0).stdout;
    assert_eq!(
        version.trim(),
        concat!("jointplay ", env!("CARGO_PKG_VERSION"))
    );
    assert!(
        jointplay(folder.path(), "--help")
            .expect(0)
            .stdout
            .contains("render")
    );
    let page = jointplay(folder.path(), "parameters").expect(0).stdout;
    for key in [
        "contact.clearance",
        "contact.friction_velocity",
        "gravity.x",
        "spcmm.slider_plane",
        "chain.links",
        "formulation",
        "solver.preset",
        "view.down",
    ] {
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
            let line = format!(
                "render spcmm --at 0s,7.85ms --size 320x180 --set contact.friction=0.2 --out {out}"
            );
            jointplay(folder.path(), &line).expect(0);
        }
        let (a, b) = (folder.path().join("a"), folder.path().join("b"));
        assert_eq!(
            names(&a),
            ["frame_00000.png", "frame_00001.png", "manifest.json"]
        );
        for name in names(&a) {
            assert!(
                fs::read(a.join(&name)).unwrap() == fs::read(b.join(&name)).unwrap(),
                "{name}"
            );
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
        assert_eq!(
            (frames[0]["time_s"].as_f64(), frames[1]["time_s"].as_f64()),
            (Some(0.0), Some(7.85e-3))
        );
        assert_ne!(frames[0]["state_hash"], frames[1]["state_hash"]);
        for frame in frames {
            assert!(frame["state_time_s"].as_f64() >= frame["time_s"].as_f64());
            let (width, height, pixels) = picture(&a.join(frame["file"].as_str().unwrap()));
            assert_eq!((width, height), (320, 180));
            let mut colours: Vec<&[u8]> = pixels.chunks_exact(4).collect();
            colours.sort_unstable();
            colours.dedup();
            assert!(
                colours.len() > 200,
                "a picture of something, not {} colours",
                colours.len()
            );
        }
        let first = picture(&a.join("frame_00000.png")).2;
        assert!(
            first != picture(&a.join("frame_00001.png")).2,
            "an impact is visible"
        );
    }

    #[test]
    fn a_slow_motion_film_has_its_frames_at_equal_times() {
        let folder = folder();
        let line =
            "render pendulum --duration 4ms --fps 10 --slow 50 --size 160x90 --out film --overlay";
        jointplay(folder.path(), line).expect(0);
        let frames = manifest(&folder.path().join("film"))["frames"].clone();
        let times: Vec<f64> = frames
            .as_array()
            .unwrap()
            .iter()
            .map(|f| f["time_s"].as_f64().unwrap())
            .collect();
        assert_eq!(times, [0.0, 0.002, 0.004]);
    }

    #[test]
    fn a_film_marks_the_impacts_between_its_frames_and_a_single_picture_does_not() {
        let folder = folder();
        // At 9 ms every ball flies free; each joint was hit 1.2 ms before.
        let common = "--size 320x180 --hide trail,flash";
        for (name, arrows) in [("with", "both"), ("without", "none")] {
            let film = format!(
                "render spcmm --duration 9ms --fps 1000 --slow 0.1111111111111111 {common} --arrows {arrows} --out film_{name}"
            );
            jointplay(folder.path(), &film).expect(0);
            let single =
                format!("render spcmm --at 9ms {common} --arrows {arrows} --out single_{name}");
            jointplay(folder.path(), &single).expect(0);
        }
        let frames = manifest(&folder.path().join("film_with"))["frames"].clone();
        assert_eq!(frames[1]["time_s"], 0.009);
        let last = |name: &str, frame: &str| picture(&folder.path().join(name).join(frame)).2;
        let (film, single) = ("frame_00001.png", "frame_00000.png");
        assert!(
            last("film_with", film) != last("single_with", single),
            "peaks are marked"
        );
        assert!(
            last("film_without", film) == last("single_without", single),
            "and are all that differs"
        );
    }

    #[test]
    fn the_whole_application_can_be_drawn() {
        let folder = folder();
        jointplay(
            folder.path(),
            "render spcmm --at 1ms --size 800x500 --ui --out ui",
        )
        .expect(0);
        let (width, height, _) = picture(&folder.path().join("ui/frame_00000.png"));
        assert_eq!((width, height), (800, 500));
    }

    #[test]
    fn frames_fail_with_the_right_code() {
        let folder = folder();
        for (line, code, word) in [
            ("render spcmm --out a", 2, "--at"),
            ("render spcmm --duration 1s --out a", 2, "--fps"),
            ("render spcmm --duration 1s --fps 0 --out a", 2, "--fps"),
            ("render spcmm --duration 1s --fps 1e9 --out a", 2, "--fps"),
            ("render spcmm --at 1 --out a", 2, "--at"),
            ("render spcmm --at 0 --size 0x5 --out a", 2, "--size"),
            (
                "render spcmm --at 0 --magnification 500 --out a",
                2,
                "--magnification",
            ),
            (
                "render spcmm --at 0 --close-up S7 --size 64x64 --out a",
                2,
                "S1, S2, S3",
            ),
            (
                "render spcmm --at 0 --size 64x64 --out missing/a",
                1,
                "missing/a",
            ),
        ] {
            let run = jointplay(folder.path(), line).expect(code);
            assert!(run.stderr.contains(word), "{line}: {}", run.stderr);
        }
        assert_eq!(names(folder.path()), [""; 0]);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_window_without_a_display_says_what_works_instead() {
        let folder = folder();
        let view = jointplay(folder.path(), "view pendulum").expect(1);
        assert!(
            view.stderr.contains("display") && view.stderr.contains("jointplay render"),
            "{}",
            view.stderr
        );
        let view = jointplay(folder.path(), "view pendulum --set contact.clearance=-1mm").expect(2);
        assert!(view.stderr.contains("contact.clearance"), "{}", view.stderr);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn without_any_adapter_the_code_is_three_and_the_line_says_what_to_install() {
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
    ] {
        let outcome = jointplay(folder.path(), &format!("view --link {link}"));
        assert_eq!(outcome.code, Some(2), "{}", outcome.stderr);
        assert!(outcome.stderr.contains(words), "{}", outcome.stderr);
    }
    let outcome = jointplay(folder.path(), "view pendulum --link ?c=1mm");
    assert_eq!(outcome.code, Some(2), "{}", outcome.stderr);
}
