//! Sweeps over arbitrary points: durations, tables, words, statistics of channels, several starts, crossings.

use std::fs;

use jointplay::scene::Scene;
use serde_json::Value as Json;

use crate::program::{folder, jointplay};
use crate::sweep::{PENDULUM, archive};

#[test]
fn a_sweep_over_a_duration_needs_no_drive_and_threads_change_no_bit() {
    let folder = folder();
    let line = format!("{PENDULUM} --from 10ms --vary contact.normal_law=hertz,flores");
    let run = |rest: &str| jointplay(folder.path(), &format!("{line} {rest}")).expect(0);
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    let text = run("--threads 1 --out one.npz").stdout;
    assert!(text.contains("Points            6") && !text.contains("Regimes"), "{text}");
    run("--threads 2 --out two.npz");
    run("--threads 2 --out two.csv");
    assert!(read("one.npz") == read("two.npz"));

    let (arrays, meta) = archive(&folder.path().join("one.npz"));
    assert_eq!((&meta["duration_s"], &meta["from_s"]), (&Json::from(0.05), &Json::from(0.01)));
    let own: Vec<&str> = meta["arrays"].as_array().unwrap().iter().map(|a| a["name"].as_str().unwrap()).collect();
    let expected = "status stopped_at_s doubts energy_residual S1_peak_N S1_peak_kept_N S1_mean_N S1_impacts \
                    S1_impacts_kept S1_last_separation_s";
    assert_eq!(own.join(" "), expected);
    assert_eq!(arrays["S1_peak_N"].shape(), [3, 2]);
    // NumPy stores strings as UTF-32.
    let utf32 = |word: &str| word.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect::<Vec<u8>>();
    let holds = |bytes: &[u8]| read("one.npz").windows(bytes.len()).any(|window| window == bytes);
    assert!(holds(b"<U32") && holds(&utf32("hertz")) && holds(&utf32("flores")) && !holds(&utf32("gonthier")));

    // The table has the same numbers at every point.
    let text = String::from_utf8(read("two.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let heads = lines.next().unwrap();
    assert_eq!(heads[..3], ["contact.clearance_m", "contact.normal_law", "status"]);
    let rows: Vec<Vec<&str>> = lines.collect();
    assert_eq!(rows.len(), 6);
    for (i, row) in rows.iter().enumerate() {
        assert_eq!(row[1], ["hertz", "flores"][i % 2]);
        for (head, cell) in heads.iter().zip(row).skip(2) {
            let (cell, value): (f64, f64) = (cell.parse().unwrap(), arrays[*head][[i / 2, i % 2]]);
            assert!((cell - value).abs() <= 1e-11 * value.abs() || (cell.is_nan() && value.is_nan()), "{head}");
        }
    }
    assert_eq!((rows[2][0], rows[4][0]), ("0.0003", "0.0004"));
}

#[test]
fn statistics_equal_those_of_the_rows_of_a_run() {
    let folder = folder();
    let keep = "S1.normal:max,S1.normal:min,S1.normal:mean,*.force.x:rms,tip_error:max,tip_error:end,P1.rate:range,P1.rate:std";
    let line = format!("sweep spcmm --vary solver.method=dopri5,radau5 --duration 0.2s --keep {keep} --out a.npz");
    jointplay(folder.path(), &line).expect(0);
    let (arrays, _) = archive(&folder.path().join("a.npz"));
    for (i, method) in ["dopri5", "radau5"].into_iter().enumerate() {
        let value = |name: &str| arrays[name][[i]];
        let run = jointplay(
            folder.path(),
            &format!(
                "run spcmm --set solver.method={method} --duration 0.2s --every 20us --channels \
                 S1.normal,S*.force.x,tip_error,P1.rate --out run.json --summary json --force"
            ),
        );
        let summary: Json = serde_json::from_str(&run.expect(0).stdout).unwrap();
        assert_eq!(value("S1_normal_max_N"), summary["peak_normal_N"]["S1"]);
        let rows: Json = serde_json::from_slice(&fs::read(folder.path().join("run.json")).unwrap()).unwrap();
        let column = |name: &str| -> Vec<f64> {
            rows["columns"][name].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
        };
        let mean =
            |values: &[f64]| values.windows(2).map(|w| 0.5 * (w[0] + w[1])).sum::<f64>() / (values.len() - 1) as f64;
        let squares = |values: &[f64], about: f64| values.iter().map(|v| (v - about).powi(2)).collect::<Vec<_>>();
        let (smallest, largest) = (
            |v: &[f64]| v.iter().copied().fold(f64::INFINITY, f64::min),
            |v: &[f64]| v.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        );
        let (normal, tip, rate) = (column("S1_normal_N"), column("probe_error_m"), column("P1_rate_m_s"));
        // Both resolve every impact, of about 0.1 ms, at different instants.
        let assert_near = |name: &str, expected: f64, part: f64| {
            let error = value(name) - expected;
            assert!(error.abs() <= part * expected.abs(), "{method}: {name}: {} for {expected}", value(name));
        };
        assert_eq!(value("S1_normal_min_N"), smallest(&normal));
        assert_near("S1_normal_mean_N", mean(&normal), 1e-2);
        for joint in ["S1", "S2", "S3"] {
            let force = column(&format!("{joint}_force_x_N"));
            assert_near(&format!("{joint}_force_x_rms_N"), mean(&squares(&force, 0.0)).sqrt(), 1e-2);
        }
        assert_near("probe_error_max_m", largest(&tip), 1e-3);
        assert_near("probe_error_end_m", tip[tip.len() - 1], 1e-9);
        assert_near("P1_rate_range_m_s", largest(&rate) - smallest(&rate), 1e-3);
        assert_near("P1_rate_std_m_s", mean(&squares(&rate, mean(&rate))).sqrt(), 1e-4);
    }
}

#[test]
fn points_from_a_file_are_those_of_a_crossed_sweep() {
    let folder = folder();
    let points = "contact.clearance,contact.friction,contact.normal_law\n0.2mm,0.1,hertz\n\"0.8 mm\",0.3,flores\n";
    fs::write(folder.path().join("points.csv"), points).unwrap();
    let rest = "--duration 30ms --keep S1.normal:max,S1.normal:mean";
    let run = |line: &str| jointplay(folder.path(), &format!("sweep pendulum {line} {rest}")).expect(0);
    run("--points points.csv --out file.csv");
    let crossed = "--vary contact.clearance=0.2mm..0.8mm:2:log --vary contact.friction=0.1,0.3 \
                   --vary contact.normal_law=hertz,flores";
    run(&format!("{crossed} --out cross.csv"));
    // One value of each is a list.
    run("--vary contact.clearance=0.8mm --vary contact.friction=0.3 --vary contact.normal_law=flores --out one.csv");
    run("--points points.csv --out file.npz");
    let rows = |name: &str| -> Vec<String> {
        fs::read_to_string(folder.path().join(name)).unwrap().lines().map(str::to_owned).collect()
    };
    let (file, cross, one) = (rows("file.csv"), rows("cross.csv"), rows("one.csv"));
    assert_eq!((file.len(), cross.len(), one.len()), (3, 9, 2));
    assert_eq!((&cross[1], &cross[8], &one[1]), (&file[1], &file[2], &file[2]));
    assert!(file[2].starts_with("0.0008,0.3,flores,0,NaN,"), "{}", file[2]);
    let (arrays, meta) = archive(&folder.path().join("file.npz"));
    assert_eq!(meta["arrangement"], "table");
    assert_eq!((arrays["contact.friction"].shape(), arrays["S1_normal_max_N"].shape()), (&[2][..], &[2][..]));

    let outcome =
        jointplay(folder.path(), "sweep pendulum --points points.csv --duration 1ms --out points.csv --force");
    assert!(outcome.expect(2).stderr.contains("the same file"), "the points are not overwritten");
}

#[test]
fn sections_at_crossings_have_the_value_and_repeat_with_the_drive() {
    let folder = folder();
    let line = "sweep slider-crank-driven --vary contact.clearance=0.1mm..0.2mm:2 --section crank.angle=90deg:up --crossings 4 \
                --discard 2 --duration 10s --keep crank.angle:end --out a.npz";
    jointplay(folder.path(), line).expect(0);
    let (arrays, meta) = archive(&folder.path().join("a.npz"));
    assert_eq!(meta["section"], "crank.angle=90deg:up");
    let scene = Scene::load("slider-crank-driven", &[]).unwrap();
    let period = jointplay::analysis::drive::drive_period(&scene).unwrap();
    assert_eq!(arrays["section_time_s"].shape(), [2, 2]);
    for point in 0..2 {
        let time = |k: usize| arrays["section_time_s"][[point, k]];
        assert_eq!(arrays["crossings"][[point]], 4.0);
        // The drive turns the crank at a constant rate.
        assert!((time(1) - time(0) - period).abs() < 1e-9 * period, "{} {period}", time(1) - time(0));
        let run = jointplay(
            folder.path(),
            &format!(
                "run slider-crank-driven --set contact.clearance={}mm --duration {}s --every {}s --channels crank.angle,x_m \
                 --out run.json --force --quiet",
                [0.1, 0.2][point],
                time(1),
                time(1)
            ),
        );
        run.expect(0);
        let rows: Json = serde_json::from_slice(&fs::read(folder.path().join("run.json")).unwrap()).unwrap();
        let last = |name: &str| rows["columns"][name][1].as_f64().unwrap();
        let turns = (last("crank_angle_rad") - std::f64::consts::FRAC_PI_2) / std::f64::consts::TAU;
        assert!((turns - turns.round()).abs() < 1e-9, "{turns}");
        assert!((last("x_m") - arrays["section_x_m"][[point, 1]]).abs() < 1e-6);
    }
}

#[test]
fn each_start_has_its_own_slice_of_the_result() {
    let folder = folder();
    let line = "sweep spcmm --set spcmm.frequency=5Hz --vary contact.friction=0.1..0.3:3 --periods 2 --discard 1 --no-exponent";
    let run = |rest: &str| jointplay(folder.path(), &format!("{line} {rest}")).expect(0);
    run("--start cold,follow-up,follow-down --threads 2 --out all.npz");
    run("--start cold,follow-up,follow-down --out all.csv");
    let (all, meta) = archive(&folder.path().join("all.npz"));
    assert_eq!(meta["start"], serde_json::json!(["cold", "follow-up", "follow-down"]));
    assert_eq!(all["section_beta_rad"].shape(), [3, 3, 1]);
    let table = fs::read_to_string(folder.path().join("all.csv")).unwrap();
    for (s, start) in ["cold", "follow-up", "follow-down"].into_iter().enumerate() {
        run(&format!("--start {start} --out {start}.npz"));
        let (own, meta) = archive(&folder.path().join(format!("{start}.npz")));
        assert_eq!(meta["start"], start);
        assert_eq!(table.lines().filter(|line| line.starts_with(&format!("{start},"))).count(), 3);
        for name in ["section_beta_rad", "S1_peak_N", "energy_residual"] {
            let part = all[name].index_axis(ndarray::Axis(0), s);
            assert!(part == own[name], "{start}: {name}");
        }
    }
}

/// The lines of `docs/cluster.md` for an array of jobs give the table of one sweep.
#[cfg(unix)]
#[test]
fn jobs_over_ranges_of_rows_give_the_table_of_one_sweep() {
    let folder = folder();
    let clearances = (0..5).map(|k| format!("0.{}mm\n", k + 2));
    let points = format!("contact.clearance\n{}", clearances.collect::<String>());
    fs::write(folder.path().join("points.csv"), points).unwrap();
    let page = fs::read_to_string("docs/cluster.md").unwrap();
    let blocks: Vec<String> = page
        .split("```sh\n")
        .skip(1)
        .map(|rest| rest.split("```").next().unwrap().replace("--periods 100 --discard 40", "--periods 2 --discard 1"))
        .collect();
    assert_eq!(blocks.len(), 2);
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_jointplay")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let run = |script: &str, job: usize| {
        let mut shell = std::process::Command::new("bash");
        shell.args(["-ec", &script.replace("seq 16", "seq 3")]).current_dir(folder.path());
        shell.env("PATH", &path).env("SLURM_ARRAY_TASK_ID", job.to_string()).env("ROWS", "2");
        assert!(shell.status().unwrap().success());
    };
    (1..=3).for_each(|job| run(&blocks[0], job));
    run(&blocks[1], 0);
    jointplay(folder.path(), "sweep spcmm --points points.csv --periods 2 --discard 1 --out whole.csv").expect(0);
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    assert_eq!(read("all.csv"), read("whole.csv"));
    assert_eq!(read("all.csv").lines().count(), 6);
}
