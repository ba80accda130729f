//! `sweep` as scripts use it: the same bytes for any number of threads and interruptions.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use jointplay::analysis::axis::Axis;
use jointplay::analysis::design::{Design, FOLLOW_BLOCK, Start};
use jointplay::analysis::point::Plan;
use jointplay::analysis::sweep::Sweep;
use jointplay::scene::Scene;
use ndarray::{ArrayD, IxDyn, OwnedRepr};
use ndarray_npy::NpzReader;
use serde_json::Value as Json;

use crate::program::{command, folder, jointplay, names};

/// A sweep of three points without a drive.
pub const PENDULUM: &str = "sweep pendulum --vary contact.clearance=0.2mm..0.4mm:3 --duration 50ms";
/// A sweep of four points that takes a fraction of a second.
const SMALL: &str = "sweep spcmm --vary contact.clearance=0.2mm..0.5mm:4 --periods 3 --discard 1";

/// The numeric arrays of an archive, integers converted to `f64`, and its `meta`.
pub fn archive(path: &Path) -> (BTreeMap<String, ArrayD<f64>>, Json) {
    let mut reader = NpzReader::new(fs::File::open(path).unwrap()).unwrap();
    let mut arrays = BTreeMap::new();
    let mut meta = Json::Null;
    for name in reader.names().unwrap() {
        if name == "meta" {
            let bytes: ArrayD<u8> = reader.by_name::<OwnedRepr<u8>, IxDyn>(&name).unwrap();
            meta = serde_json::from_slice(&bytes.into_raw_vec_and_offset().0).unwrap();
        } else if let Ok(array) = reader.by_name::<OwnedRepr<f64>, IxDyn>(&name) {
            arrays.insert(name, array);
        } else if let Ok(array) = reader.by_name::<OwnedRepr<i64>, IxDyn>(&name) {
            arrays.insert(name, array.mapv(|value| value as f64));
        }
    }
    (arrays, meta)
}

#[test]
fn a_map_has_the_shape_of_its_ranges_and_the_values_of_single_runs() {
    let folder = folder();
    let line = "sweep spcmm --vary contact.friction=0.1..0.2:2 --vary contact.clearance=0.2mm..0.3mm:3 --periods 2 \
                --discard 0 --out map.npz --summary json";
    let summary = jointplay(folder.path(), line).expect(0).stdout;
    let summary: Json = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["points"], 6);
    assert_eq!(summary["status"], "done");
    let (arrays, meta) = archive(&folder.path().join("map.npz"));
    assert_eq!(arrays["contact.friction"].shape(), [2]);
    assert_eq!(arrays["contact.clearance"].shape(), [3]);
    for array in meta["arrays"].as_array().unwrap() {
        let name = array["name"].as_str().unwrap();
        let shape: &[usize] = if array["per_section"] == true { &[2, 3, 2] } else { &[2, 3] };
        assert_eq!(arrays[name].shape(), shape, "{name}");
    }
    assert_eq!(meta["scene"], "spcmm");
    assert_eq!(meta["regimes"]["3"], "chaotic");
    assert!(arrays["status"].iter().all(|status| *status == 0.0));
    // The point at friction 0.2, clearance 0.25 mm equals a single run of that scene.
    let run = jointplay(
        folder.path(),
        "run spcmm --set contact.friction=0.2 --set contact.clearance=0.25mm --duration 4s --every 2s --out run.json \
         --summary json",
    );
    let run: Json = serde_json::from_str(&run.expect(0).stdout).unwrap();
    for joint in ["S1", "S2", "S3"] {
        let value = |name: &str| arrays[&format!("{joint}_{name}")][[1, 1]];
        assert_eq!(value("peak_N"), run["peak_normal_N"][joint]);
        assert_eq!(value("impacts"), run["impacts"][joint].as_f64().unwrap());
        assert!(value("mean_N") > 2.0 && value("mean_N") < 20.0);
        let separation = value("last_separation_s");
        assert!(separation > 0.01 && separation < 0.3, "{separation}");
    }
    let rows: Json = serde_json::from_slice(&fs::read(folder.path().join("run.json")).unwrap()).unwrap();
    for (quantity, tolerance) in [("x_m", 1e-9), ("beta_rad", 1e-8), ("beta_rate_rad_s", 1e-6)] {
        for k in 0..2 {
            let row = rows["columns"][quantity][k + 1].as_f64().unwrap();
            let section = arrays[&format!("section_{quantity}")][[1, 1, k]];
            assert!((row - section).abs() < tolerance, "{quantity}: {row} {section}");
        }
    }
    let error = arrays["probe_error_max_um"][[1, 1]];
    assert!(error > 200.0 && error < 2000.0, "{error} um");
    assert!(arrays["probe_error_rms_um"][[1, 1]] < error);
}

#[test]
fn threads_change_no_bit() {
    let folder = folder();
    let run = |rest: &str| jointplay(folder.path(), &format!("{SMALL} {rest}")).expect(0);
    run("--threads 1 --out one.npz");
    run("--threads 3 --out three.npz");
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(read("one.npz") == read("three.npz"));
}

/// The partial file holds the texts of the scene and of the files that it names.
#[test]
fn a_scene_of_megabytes_can_be_swept() {
    let folder = folder();
    let pendulum = fs::read_to_string("assets/scenes/pendulum.toml").unwrap();
    let large = format!("{pendulum}\n{}", "# A comment as long as a table of measured values.\n".repeat(40_000));
    assert!(large.len() > 2_000_000);
    fs::write(folder.path().join("large.toml"), large).unwrap();
    let sweep = "sweep large.toml --vary contact.clearance=0.2mm..0.3mm:2 --duration 1ms --quiet --out a.npz";
    jointplay(folder.path(), sweep).expect(0);
    assert_eq!(names(folder.path()), ["a.npz", "large.toml"]);
}

#[cfg(unix)]
#[test]
fn an_interrupted_sweep_resumes_and_a_partial_file_of_another_is_refused() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let sweep = |points: usize, out: &str| {
        format!(
            "sweep spcmm --vary contact.clearance=0.2mm..0.3mm:{points} --periods 4 --discard 2 --threads 2 --out {out}"
        )
    };
    // Doubles the points until the sweep is long enough to be interrupted.
    let mut points = 12;
    loop {
        let mut child = command(folder.path(), &sweep(points, "a.npz"))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // Waits until some blocks are written.
        let length = || fs::metadata(at("a.npz.partial")).map_or(0, |file| file.len());
        let mut lengths = Vec::new();
        while lengths.len() < 4 && child.try_wait().unwrap().is_none() {
            let now = length();
            if now > 0 && lengths.last() != Some(&now) {
                lengths.push(now);
            }
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        if child.try_wait().unwrap().is_none() {
            let interrupted = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
            assert!(interrupted.unwrap().success());
        }
        let output = child.wait_with_output().unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        if output.status.code() == Some(0) {
            fs::remove_file(at("a.npz")).unwrap();
            points *= 2;
            continue;
        }
        assert_eq!(output.status.code(), Some(130), "{stderr}");
        let progress = format!("of {points} points done");
        assert!(stderr.contains(&progress), "{stderr}");
        assert_eq!(names(folder.path()), ["a.npz.partial"]);
        break;
    }
    let line = |out: &str| sweep(points, out);
    let partial = fs::read(at("a.npz.partial")).unwrap();

    // Settings of another sweep, damaged settings and a foreign file are refused.
    let check_refused = |bytes: &[u8], line: &str, code: i32, fragment: &str| {
        fs::write(at("a.npz.partial"), bytes).unwrap();
        let outcome = jointplay(folder.path(), line).expect(code);
        assert!(outcome.stderr.contains("a.npz.partial"), "{}", outcome.stderr);
        assert!(outcome.stderr.contains(fragment), "{}", outcome.stderr);
        assert_eq!(names(folder.path()), ["a.npz.partial"]);
        assert!(fs::read(at("a.npz.partial")).unwrap() == bytes, "the file is unchanged");
    };
    let flipped = |offset: usize| {
        let mut bytes = partial.clone();
        bytes[offset] ^= 0x10;
        bytes
    };
    check_refused(&flipped(100), &line("a.npz"), 1, "no finished blocks");
    check_refused(b"mine", &line("a.npz"), 1, "no finished blocks");
    let other = line("a.npz").replace("--periods 4", "--periods 5");
    check_refused(&partial, &other, 2, "periods: 4 there, 5 now");

    // A damaged block, and one truncated by a crash, are computed again.
    let damaged = flipped(partial.len() - 100);
    fs::write(at("a.npz.partial"), &damaged[..partial.len() - 1]).unwrap();
    let resumed = jointplay(folder.path(), &line("a.npz")).expect(0);
    assert!(resumed.stderr.contains("resuming where"), "{}", resumed.stderr);
    jointplay(folder.path(), &line("b.npz")).expect(0);
    assert!(fs::read(at("a.npz")).unwrap() == fs::read(at("b.npz")).unwrap());
    assert_eq!(names(folder.path()), ["a.npz", "b.npz"]);
    // A finished sweep is not overwritten without --force.
    let refused = jointplay(folder.path(), &line("a.npz")).expect(1);
    assert!(refused.stderr.contains("--force"), "{}", refused.stderr);
}

#[cfg(unix)]
#[test]
fn a_sweep_killed_at_any_instant_resumes_to_the_same_bytes() {
    let folder = folder();
    let over_periods =
        "spcmm --vary contact.clearance=0.2mm..0.3mm:12 --periods 2 --discard 1 --no-exponent --out a.npz";
    let over_time = "pendulum --vary contact.clearance=0.2mm..0.3mm:12 --duration 0.3s --keep S1.*:max --out a.csv";
    for (line, out) in [(over_periods, "a.npz"), (over_time, "a.csv")] {
        let line = format!("sweep {line} --threads 2");
        let start = std::time::Instant::now();
        jointplay(folder.path(), &line).expect(0);
        let length = start.elapsed();
        let expected = fs::read(folder.path().join(out)).unwrap();
        crate::common::at_random_instants(length, 4, |instant| {
            let folder = self::folder();
            let mut child = command(folder.path(), &line).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
            std::thread::sleep(instant);
            child.kill().unwrap();
            child.wait().unwrap();
            if !folder.path().join(out).exists() {
                jointplay(folder.path(), &line).expect(0);
                assert!(names(folder.path()).iter().all(|name| !name.ends_with(".partial")));
            }
            assert!(fs::read(folder.path().join(out)).unwrap() == expected);
        });
    }
}

#[test]
fn a_diverging_point_is_recorded_and_the_others_are_computed() {
    let folder = folder();
    let line =
        "sweep spcmm --set solver.method=rk4 --vary solver.step=20us..10ms:2 --periods 1 --discard 0 --out a.npz";
    let outcome = jointplay(folder.path(), line).expect(0);
    assert!(outcome.stdout.contains("2, 1 diverged"), "{}", outcome.stdout);
    assert!(outcome.stderr.contains("1 section of each point: with fewer than 8 no regime"), "{}", outcome.stderr);
    let (arrays, _) = archive(&folder.path().join("a.npz"));
    assert_eq!(arrays["status"].as_slice(), Some(&[0.0, 1.0][..]));
    assert_eq!(arrays["regime"][1], -1.0);
    let stopped = &arrays["stopped_at_s"];
    assert!(stopped[0].is_nan() && stopped[1] >= 0.0 && stopped[1] < 2.0);
    assert!(arrays["section_x_m"][[0, 0]].is_finite());
    assert!(arrays["section_x_m"][[1, 0]].is_nan());
    assert!(arrays["S1_peak_N"][1].is_nan());
}

#[test]
fn each_kind_of_warning_within_the_ranges_is_printed_once() {
    let folder = folder();
    // Singular poses are in the middle of this range, not at its ends.
    let line = "sweep spcmm --vary contact.clearance=0.01mm..0.2mm:2 --vary spcmm.slider_plane=20mm..300mm:15 --periods 1 \
                --discard 0 --period 1ms --no-exponent --out a.npz";
    let outcome = jointplay(folder.path(), line).expect(0);
    let warnings: Vec<&str> = outcome.stderr.lines().filter(|l| l.contains("warning:")).collect();
    assert_eq!(warnings.len(), 4, "{}", outcome.stderr);
    assert!(warnings[3].contains("fewer than 8"), "{}", outcome.stderr);
    assert!(warnings[0].contains("contact.clearance = 0.01 mm") && warnings[0].contains("Hertz"));
    for kind in ["comes near a singular pose", "has a singular pose"] {
        assert!(outcome.stderr.matches(kind).count() == 1, "{}", outcome.stderr);
    }
    assert!(outcome.stderr.contains("spcmm.slider_plane = 140 mm"), "{}", outcome.stderr);
}

#[test]
fn a_point_without_a_rest_is_a_row_that_says_so() {
    let folder = folder();
    let scene = "start = \"equilibrium\"\n[gravity]\nz = \"-9.81 m/s^2\"\n[[parameter]]\nname = \"k\"\nvalue = \"100 N/m\"\n\
                 [[body]]\nname = \"m\"\nmass = \"1 kg\"\ninertia = \"1e-3 1e-3 1e-3 kg m^2\"\n\
                 [[joint]]\nname = \"g\"\nkind = \"prismatic\"\nchild = \"m\"\naxis = [0, 0, 1]\n\
                 [[joint_spring]]\nname = \"s\"\njoint = \"g\"\nstiffness = \"k\"\ndamping = \"1 N s/m\"\n";
    fs::write(folder.path().join("m.toml"), scene).unwrap();
    let line = "sweep ./m.toml --vary parameter.k=0N/m..200N/m:3 --duration 10ms --keep m.pose.z:end --out a.npz";
    jointplay(folder.path(), line).expect(0);
    let (arrays, _) = archive(&folder.path().join("a.npz"));
    assert_eq!(arrays["status"].as_slice().unwrap(), [2.0, 0.0, 0.0]);
    let depths = arrays["z_end_m"].as_slice().unwrap();
    assert!(
        depths[0].is_nan() && (depths[1] + 0.0981).abs() < 1e-9 && (depths[2] + 0.04905).abs() < 1e-9,
        "{depths:?}"
    );
}

#[test]
fn invalid_input_is_refused_before_anything_runs() {
    let folder = folder();
    let plan = "--periods 3 --discard 1 --out a.npz";
    for (line, code, fragment) in [
        (format!("sweep spcmm {plan}"), 2, "--vary"),
        (format!("sweep spcmm --vary contact.clearance=1mm..0.1mm:5 {plan}"), 2, "reversed"),
        (format!("sweep spcmm --vary contact.clearance=1mm..1mm:5 {plan}"), 2, "empty"),
        (format!("sweep spcmm --vary contact.clearance=1mm..2mm:0 {plan}"), 2, "empty"),
        (format!("sweep spcmm --vary contact.clearance=0.1..1:5 {plan}"), 2, "needs a unit"),
        (format!("sweep spcmm --vary contact.clearence=0.1mm..1mm:5 {plan}"), 2, "did you mean"),
        (
            format!("sweep spcmm --vary spcmm.slider_plane=10mm..32mm:5 {plan}"),
            2,
            "the scene cannot start at spcmm.slider_plane = 10 mm",
        ),
        (format!("sweep spcmm --vary spcmm.frequency=0.5Hz..1Hz:3 --start follow-up {plan}"), 2, "--start cold"),
        (format!("sweep pendulum --vary contact.clearance=0.1mm..1mm:5 {plan}"), 2, "no drive that repeats"),
        (format!("sweep pendulum --vary contact.clearance=0.1mm..1mm:5 {plan}"), 2, "--duration"),
        (
            format!("sweep spcmm --set spcmm.frequency=0Hz --vary contact.clearance=0.1mm..1mm:5 {plan}"),
            2,
            "no drive that repeats",
        ),
        (
            "sweep spcmm --vary contact.clearance=0.1mm..1mm:5 --periods 3 --discard 3 --out a.npz".to_owned(),
            2,
            "--discard must be less",
        ),
        (
            "sweep spcmm --vary contact.clearance=0.1mm..1mm:5 --periods 99999999999999 --discard 3 --out a.npz"
                .to_owned(),
            2,
            "more than a result holds",
        ),
        (format!("{SMALL} --out a.txt"), 2, ".npz or .csv"),
        (format!("{SMALL} --shard 1/2 --out a.csv"), 2, "`--shard` of `jointplay sweep` is gone: split the rows"),
        (format!("{SMALL} --zip --out a.csv"), 2, "`--zip` of `jointplay sweep` is gone: write one row per point"),
        ("merge a.npz --out b.npz".to_owned(), 2, "`jointplay merge` is gone: split the rows"),
        (format!("{SMALL} --period 0 --out a.npz"), 2, "--period 0: the time must be above 0"),
        (format!("{SMALL} --keep S1.nromal:max --out a.npz"), 2, "did you mean `S1.normal`?"),
        (format!("{SMALL} --keep S1.normal:top --out a.npz"), 2, "`top` is not a statistic"),
        (format!("{SMALL} --start cold,cold --out a.npz"), 2, "cold is given twice"),
        (format!("{SMALL} --duration 1s --out a.npz"), 2, "cannot be used with"),
        (format!("{SMALL} --points points.csv --out a.npz"), 2, "cannot be used with"),
        (format!("{PENDULUM} --from 60ms --out a.npz"), 2, "must begin before the end"),
        (format!("{PENDULUM} --vary contact.normal_law=hertz,flores --start follow-up --out a.npz"), 2, "ascending"),
        (
            "sweep pendulum --points none.csv --duration 1ms --out a.npz".to_owned(),
            1,
            "none.csv: cannot read this file",
        ),
        (format!("{SMALL} --out no/such/folder/a.npz"), 1, "a.npz"),
        (format!("{SMALL} --phase 2 --out a.npz"), 2, "--phase 2"),
        (format!("{SMALL} --threads 0 --out a.npz"), 2, "--threads"),
        (format!("{SMALL} --section zero --out a.npz"), 2, "phase"),
        (format!("{SMALL} --section S1.normal=1N --out a.npz"), 2, "--crossings and --discard"),
        (format!("{PENDULUM} --section S1.normal=1N --out a.npz"), 2, "--crossings and --discard"),
        (format!("{PENDULUM} --section S1.normal=1 --crossings 2 --discard 1 --out a.npz"), 2, "needs a unit"),
        (
            format!("{PENDULUM} --section S1.normal=1N --crossings 2 --discard 2 --out a.npz"),
            2,
            "less than --crossings",
        ),
        (format!("{PENDULUM} --discard 2 --out a.npz"), 2, "--discard 2: it counts periods"),
    ] {
        let outcome = jointplay(folder.path(), &line).expect(code);
        assert!(outcome.stderr.contains(fragment), "{line}: {}", outcome.stderr);
        assert!(names(folder.path()).is_empty(), "{line}: {:?}", names(folder.path()));
    }
}

fn small_sweep(start: Start, points: usize) -> Sweep {
    let scene = Scene::load("spcmm", &[]).unwrap();
    let text = format!("contact.clearance=0.2mm..0.3mm:{points}");
    let axis = Axis::parse(&scene, &text).unwrap();
    let design = Design::crossed(&scene, vec![axis], &[start]).unwrap();
    let plan = Plan { periods: 2, discard: 1, phase: 0.25, exponent: true };
    Sweep::new(scene, design, plan).unwrap()
}

fn records(sweep: &Sweep, b: usize, steps: u32) -> Vec<u64> {
    let mut block = sweep.begin(b);
    while !block.is_done() {
        block.advance(steps);
    }
    block.records().iter().map(|value| value.to_bits()).collect()
}

#[test]
fn blocks_are_independent_of_order_and_of_each_other() {
    let sweep = small_sweep(Start::Cold, 3);
    let forwards: Vec<_> = (0..3).map(|b| records(&sweep, b, 1000)).collect();
    let backwards: Vec<_> = (0..3).rev().map(|b| records(&sweep, b, 77)).collect();
    assert!(forwards.iter().eq(backwards.iter().rev()));
    // A point is the same in a finer sweep that contains it.
    let finer = small_sweep(Start::Cold, 5);
    assert!(forwards[1] == records(&finer, 2, 1000));
}

#[test]
fn following_continues_the_neighbour_within_fixed_blocks() {
    let points = FOLLOW_BLOCK + 2;
    let up = small_sweep(Start::FollowUp, points);
    let down = small_sweep(Start::FollowDown, points);
    assert_eq!(up.design().blocks(), 2);
    let cold = small_sweep(Start::Cold, points);
    let column = |sweep: &Sweep, name: &str| {
        let columns = sweep.layout().columns();
        sweep.layout().offset(columns.iter().position(|c| c.name == name).unwrap())
    };
    let length = up.layout().record_length();
    let value = |sweep: &Sweep, records: &[u64], point: usize, name: &str| {
        f64::from_bits(records[point * length + column(sweep, name)])
    };
    // The second block has two points; its first one in the direction of following starts cold.
    let (first, second) = (records(&cold, FOLLOW_BLOCK, 999), records(&cold, FOLLOW_BLOCK + 1, 999));
    let (up_block, down_block) = (records(&up, 1, 999), records(&down, 1, 999));
    assert!(up_block[..length] == first);
    assert!(down_block[length..] == second);
    for (sweep, block, followed, single) in [(&up, &up_block, 1, &second), (&down, &down_block, 0, &first)] {
        // Following skips the first fall through the gaps, so there is no hard impact; the settled section is the same.
        let peak = value(sweep, block, followed, "S1_peak_N");
        assert!(peak < 0.2 * value(&cold, single, 0, "S1_peak_N"), "{peak}");
        let beta = value(sweep, block, followed, "section_beta_rad");
        let cold_beta = value(&cold, single, 0, "section_beta_rad");
        // Over two periods the creep of the balls decays a difference of at most 1e-3 rad by e^-9.
        assert!((beta - cold_beta).abs() < 1e-6, "{beta} {cold_beta}");
        assert_eq!(value(sweep, block, followed, "status"), 0.0);
    }
}
