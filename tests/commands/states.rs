//! `run --save-state` and `--from-state`: a run resumed in another process equals the uninterrupted run.

use std::fs;
use std::path::Path;

use serde_json::Value as Json;

use crate::program::{command, folder, jointplay};

const MACHINES: [&str; 7] = ["hexapod", "delta", "four-bar", "suspension", "press", "slider-crank-worn", "excavator"];

/// Header and rows of a CSV file.
fn rows(folder: &Path, name: &str) -> Vec<String> {
    let text = fs::read_to_string(folder.join(name)).unwrap();
    text.lines().map(str::to_owned).collect()
}

/// Runs `scene` to 10 ms, resumes to 20 ms, and compares rows and summaries with an uninterrupted run.
fn check_resumed(scene: &str, options: &str) {
    let folder = folder();
    let run = |more: &str| {
        let line = format!("run {scene} {options} --quiet --summary json --every 0.25ms {more}");
        jointplay(folder.path(), &line).expect(0).json()
    };
    let uninterrupted = run("--duration 20ms --out whole.csv --impacts whole-impacts.json");
    let first = run("--duration 10ms --out a.csv --save-state a --impacts a-impacts.json");
    assert_eq!(first["state_out"], "a");
    let second = run("--duration 20ms --out b.csv --from-state a --impacts b-impacts.json");
    let case = format!("{scene} {options}");
    let (all, later) = (rows(folder.path(), "whole.csv"), rows(folder.path(), "b.csv"));
    assert_eq!((all.len(), later.len()), (82, 42), "{case}");
    assert_eq!(all[0], later[0], "{case}");
    assert_eq!(all[41..], later[1..], "{case}");
    // The summary is that of the whole run: steps, peaks, energies, doubts, state hash.
    let excluded = ["wall_s", "ratio", "slower_than_asked", "from_time_s", "rows", "out", "impacts_out", "restitution"];
    let without_excluded = |summary: &Json| {
        let mut without_excluded = summary.as_object().unwrap().clone();
        without_excluded.retain(|key, _| !excluded.contains(&key.as_str()));
        without_excluded
    };
    assert_eq!(without_excluded(&uninterrupted), without_excluded(&second), "{case}");
    assert_eq!(second["from_time_s"], 0.01);
    // No impact is lost or reported twice.
    let impact_count = |name: &str| {
        let text = fs::read_to_string(folder.path().join(name)).unwrap();
        let json: Json = serde_json::from_str(&text).unwrap();
        json["columns"]["end_s"].as_array().unwrap().len()
    };
    assert_eq!(
        impact_count("a-impacts.json") + impact_count("b-impacts.json"),
        impact_count("whole-impacts.json"),
        "{case}"
    );
}

/// `tests/physics/promises.rs` resumes every method in every scene within a process; this test resumes in another process.
#[test]
fn built_in_scenes_resume_with_the_same_bits() {
    for (scene, method) in [
        ("spcmm", "automatic"),
        ("pendulum", "rk4"),
        ("slider-crank", "radau5"),
        ("slider-crank-driven", "discrete-gradient"),
        ("chain", "radau5"),
    ] {
        check_resumed(scene, &format!("--set solver.method={method}"));
    }
    check_resumed("spcmm", "--set solver.method=dopri5 --set formulation=lagrange");
    check_resumed("spcmm", "--set contact.clearance=0");
    check_resumed("spcmm", "--set joint.S2.clearance=0 --set contact.friction=0.3");
    check_resumed("pendulum", "--set contact.approach_speed=largest --set solver.tolerance=1e-7");
}

#[test]
fn machines_resume_with_the_same_bits() {
    // The light rods of the delta need short steps.
    let fixed = "--set solver.method=rk4 --set solver.step=1us";
    for (name, options) in MACHINES.into_iter().zip(["--set solver.tolerance=1e-4", fixed].into_iter().cycle()) {
        check_resumed(name, options);
    }
}

#[test]
fn the_ideal_reference_motion_of_a_probe_resumes_too() {
    let folder = folder();
    for (name, body) in [("pendulum", "rod"), ("slider-crank", "slider")] {
        let text = jointplay::scene::built_in_text(name).unwrap();
        let output = format!("body = \"{body}\"\n");
        let with_probe = text.replacen(&output, &format!("{output}probe = \"0 0 -10 mm\"\n"), 1);
        assert_ne!(with_probe, text);
        let path = folder.path().join(format!("{name}.toml"));
        fs::write(&path, with_probe).unwrap();
        let header =
            jointplay(folder.path(), &format!("run {} --duration 0s --every 1s --out {name}.csv", path.display()));
        header.expect(0);
        assert!(rows(folder.path(), &format!("{name}.csv"))[0].contains("probe_error_x_m"));
        check_resumed(&path.display().to_string(), "");
    }
}

#[test]
fn repeatedly_resumed_runs_and_wear_maps_equal_an_uninterrupted_run() {
    let folder = folder();
    let run = |scene: &str, more: &str| {
        let line = format!("run {scene} --quiet --force --summary json {more}");
        jointplay(folder.path(), &line).expect(0).json()
    };
    // A pin and a block, and balls.
    let mut uninterrupted = Json::Null;
    for scene in ["slider-crank-worn", "spcmm"] {
        uninterrupted = run(scene, "--duration 40ms --wear whole.csv");
        run(scene, "--duration 7ms --save-state s1 --wear w.csv");
        run(scene, "--duration 7ms --from-state s1 --save-state s2");
        run(scene, "--duration 23.3ms --from-state s2 --save-state s3 --wear w.csv");
        let last = run(scene, "--duration 40ms --from-state s3 --wear last.csv");
        assert_eq!(uninterrupted["state_hash"], last["state_hash"], "{scene}");
        assert_eq!(uninterrupted["energy_J"], last["energy_J"], "{scene}");
        assert_eq!(rows(folder.path(), "whole.csv"), rows(folder.path(), "last.csv"), "{scene}");
    }
    // A state saved at the start, and a wear map that begins late.
    run("spcmm", "--duration 0s --save-state s0");
    let line = "run spcmm --duration 40ms --from-state s0 --wear late.csv --summary json";
    let outcome = jointplay(folder.path(), line).expect(0);
    assert!(outcome.stderr.contains("wear map begins"), "{}", outcome.stderr);
    assert_eq!(uninterrupted["state_hash"], outcome.json()["state_hash"]);
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_run_saves_a_state_to_resume_from() {
    use crate::command_line::{signal, start_and_listen};
    let folder = folder();
    let line = "run spcmm --duration 1000000s --save-state s --summary json";
    let child = start_and_listen(&mut command(folder.path(), line));
    signal(&child, "-INT");
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    let summary: Json = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["state_out"], "s");
    let end = summary["time_s"].as_f64().unwrap() + 0.05;
    let hash = |more: &str| {
        let line = format!("run spcmm --duration {end}s --quiet --summary json {more}");
        jointplay(folder.path(), &line).expect(0).json()["state_hash"].clone()
    };
    assert_eq!(hash("--from-state s"), hash(""));
}

#[test]
fn a_state_of_another_scene_is_refused_with_the_reason() {
    let folder = folder();
    let path = folder.path().join("s");
    let save = "run pendulum --duration 3ms --set contact.friction=0.2 --save-state s --quiet";
    jointplay(folder.path(), save).expect(0);
    let good = fs::read_to_string(&path).unwrap();
    let check_refused = |line: &str, code: i32, words: &[&str]| {
        let run = jointplay(folder.path(), &format!("run {line} --from-state s")).expect(code);
        assert_eq!(run.stdout, "");
        assert_eq!(run.stderr.lines().count(), 1, "{}", run.stderr);
        for word in words {
            assert!(run.stderr.contains(word), "{word}: {}", run.stderr);
        }
    };
    let same = "pendulum --duration 6ms --set contact.friction=0.2";
    check_refused("spcmm --duration 6ms", 2, &["`pendulum`", "`spcmm`"]);
    check_refused("pendulum --duration 6ms", 2, &["--set contact.friction=0.2", "no --set"]);
    let other = "pendulum --duration 6ms --set contact.friction=0.2 --set solver.method=rk4";
    check_refused(other, 2, &["--set solver.method=rk4"]);
    let short = "pendulum --duration 1ms --set contact.friction=0.2";
    check_refused(short, 2, &["--duration", "0.003 s"]);
    check_refused(&format!("{same} --save-state s"), 2, &["same file"]);
    jointplay(folder.path(), &format!("{save} --force")).expect(0);
    assert_eq!(fs::read_to_string(&path).unwrap(), good, "the same bytes");
    jointplay(folder.path(), save).expect(1);

    // Truncated anywhere, or with any digit changed.
    for n in (0..good.len()).step_by(good.len() / 40) {
        fs::write(&path, &good[..n]).unwrap();
        check_refused(same, 2, &["not a state"]);
    }
    let digits: Vec<usize> = good.match_indices(|c: char| c.is_ascii_digit()).map(|m| m.0).collect();
    for at in digits.iter().step_by(digits.len() / 40) {
        let mut bytes = good.clone().into_bytes();
        bytes[*at] = if bytes[*at] == b'7' { b'8' } else { b'7' };
        // Another seventeenth digit may denote the same number.
        let parsed = |text: &[u8]| serde_json::from_slice::<Json>(text).ok();
        if parsed(&bytes) == parsed(good.as_bytes()) {
            continue;
        }
        fs::write(&path, &bytes).unwrap();
        check_refused(same, 2, &["--from-state s: "]);
    }
    for (text, words) in [
        (good.replace("\"state_format\":12", "\"state_format\":13"), "format 12"),
        ("{}".to_owned(), "not a state"),
        ("[1, 2]".to_owned(), "not a state"),
        ("\u{0}\u{1b}[31m".to_owned(), "not a state"),
    ] {
        fs::write(&path, text).unwrap();
        check_refused(same, 2, &[words]);
    }
    // Well-formed, but not a state of this scene.
    let mut json: Json = serde_json::from_str(&good).unwrap();
    for (pointer, value, words) in [
        ("/state/now/y", serde_json::json!([1.0]), "these values do not describe a state of this scene"),
        ("/state/flights", serde_json::json!([null, null]), "these values do not describe a state of this scene"),
        ("/observations/sampled", serde_json::json!([]), "these values do not describe a state of this scene"),
        (
            "/observations/loads",
            serde_json::json!({"parts": [[[1.0, 0.0], null]], "seen": 0.0, "actuators": []}),
            "these values do not describe a state of this scene",
        ),
        ("/state", serde_json::json!({}), "not a state"),
    ] {
        *json.pointer_mut(pointer).unwrap() = value;
        let content = json.as_object_mut().unwrap();
        content.shift_remove("crc32");
        let text = serde_json::to_string(content).unwrap();
        let checksum = format!("{:08x}", crc32fast::hash(text.as_bytes()));
        content.insert("crc32".to_owned(), checksum.into());
        fs::write(&path, json.to_string()).unwrap();
        check_refused(same, 2, &[words]);
        json = serde_json::from_str(&good).unwrap();
    }
    fs::remove_file(&path).unwrap();
    check_refused(same, 1, &["s: cannot read this file"]);
}

#[test]
fn a_run_resumes_only_with_the_files_that_its_scene_named() {
    let folder = folder();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    let load = |mass: &str| format!("[[parameter]]\nname = \"load\"\nvalue = \"{mass}\"\n");
    let pendulum = jointplay::scene::built_in_text("pendulum").unwrap();
    let robot = pendulum.replace("mass = \"0.384 kg\"", "mass = \"load\"");
    assert_ne!(robot, pendulum);
    let robot = format!("include = [\"leg.toml\"]\n{robot}");
    write("robot.toml", &robot);
    write("leg.toml", &load("0.4 kg"));
    let run = |more: &str| {
        let line = format!("run robot.toml --summary json --quiet --force {more}");
        jointplay(folder.path(), &line)
    };
    let meta = |name: &str| -> Json {
        let text = fs::read_to_string(folder.path().join(name)).unwrap();
        serde_json::from_str::<Json>(&text).unwrap()["meta"].take()
    };
    let first = run("--duration 3ms --save-state s --every 1ms --out a.json").expect(0);
    for meta in [meta("s"), meta("a.json")] {
        assert_eq!(meta["scene_text"], robot);
        let files = serde_json::json!({"leg.toml": load("0.4 kg")});
        assert_eq!(meta["scene_files"], files);
    }
    let checksum = format!("{:08x}", crc32fast::hash(load("0.4 kg").as_bytes()));
    assert_eq!(first.json()["scene_files_crc32"]["leg.toml"], checksum);
    let uninterrupted = run("--duration 6ms").expect(0).json();
    let last = run("--duration 6ms --from-state s").expect(0).json();
    assert_eq!(uninterrupted["state_hash"], last["state_hash"]);

    write("leg.toml", &load("0.8 kg"));
    let other = run("--duration 6ms --from-state s").expect(2);
    assert!(other.stderr.contains("whose file leg.toml has changed"), "{}", other.stderr);
    // A state without the texts of files is refused as well.
    let state = fs::read_to_string(folder.path().join("s")).unwrap();
    let mut state: Json = serde_json::from_str(&state).unwrap();
    let content = state.as_object_mut().unwrap();
    content.shift_remove("crc32");
    let meta_of_state = content["meta"].as_object_mut().unwrap();
    meta_of_state.shift_remove("scene_files").unwrap();
    let text = serde_json::to_string(content).unwrap();
    let checksum = format!("{:08x}", crc32fast::hash(text.as_bytes()));
    content.insert("crc32".to_owned(), checksum.into());
    write("s", &state.to_string());
    write("leg.toml", &load("0.4 kg"));
    let without_files = run("--duration 6ms --from-state s").expect(2);
    assert!(without_files.stderr.contains("whose file leg.toml has changed"), "{}", without_files.stderr);

    // A scene that names no files has no entry about files.
    let line = "run pendulum --duration 3ms --save-state s --every 1ms --out a.json --force --quiet";
    jointplay(folder.path(), line).expect(0);
    for meta in [meta("s"), meta("a.json")] {
        let keys = meta.as_object().unwrap().keys();
        assert!(!keys.into_iter().any(|key| key.starts_with("scene_files")));
    }
}

/// The state contains a checksum of binary mesh files, which must match when the run resumes.
#[test]
fn a_state_is_refused_if_a_mesh_of_its_scene_has_changed() {
    let folder = folder();
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    let mut stl = vec![b's'; 80];
    stl.extend(1_u32.to_le_bytes());
    for x in [0.0_f32, 0.0, 1.0, 0.0, 0.0, 0.0, 30.0, 0.0, 0.0, 0.0, 30.0, 0.0] {
        stl.extend(x.to_le_bytes());
    }
    stl.extend([0; 2]);
    let pendulum = jointplay::scene::built_in_text("pendulum").unwrap();
    let bar = "form = \"capsule\", from = \"0 0 92 mm\", to = \"0 0 -98 mm\", radius = \"4 mm\"";
    let mesh = "form = \"mesh\", file = \"fin.stl\", unit = \"mm\"";
    let fin = pendulum.replace(bar, mesh);
    assert_ne!(fin, pendulum);
    write("fin.toml", fin.as_bytes());
    write("fin.stl", &stl);
    let run = |more: &str| {
        let line = format!("run fin.toml --summary json --quiet --force {more}");
        jointplay(folder.path(), &line)
    };
    let first = run("--duration 3ms --save-state s").expect(0);
    let checksum = format!("{:08x}", crc32fast::hash(&stl));
    assert_eq!(first.json()["scene_files_crc32"]["fin.stl"], checksum);
    let uninterrupted = run("--duration 6ms").expect(0).json();
    let last = run("--duration 6ms --from-state s").expect(0).json();
    assert_eq!(uninterrupted["state_hash"], last["state_hash"]);
    stl[100] ^= 1;
    write("fin.stl", &stl);
    let other = run("--duration 6ms --from-state s").expect(2);
    assert!(other.stderr.contains("whose file fin.stl has changed"), "{}", other.stderr);
}
