//! Lots of machines with limits: yields, percentiles, drivers of rejects, and the cheapest fits.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde_json::Value as Json;

use crate::program::{folder, jointplay, names};

/// Short runs of the four-bar in which both balls have impacts.
const FOUR_BAR: &str = "tolerance four-bar --set solver.preset=real-time --duration 20ms --quiet --out t";
const TOLERANCES: &str = "# Both joints\nparameter,distribution\n\njoint.*.clearance,\"uniform(0.05 mm, 0.2mm)\"\n\
                          contact.friction,\"normal(0.1, 0.01, 0.05..0.15)\"\n";
const LIMITS: &str = "--limit peak-force=140N --limit impacts=7..12";

/// Rows of `runs.csv`: the stage, and values by column name.
fn runs(folder: &Path) -> Vec<(String, BTreeMap<String, f64>)> {
    let text = fs::read_to_string(folder.join("t/runs.csv")).unwrap();
    let mut lines = text.lines();
    let heads: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let values = heads.iter().zip(&cells).skip(1).map(|(head, cell)| ((*head).to_owned(), cell.parse().unwrap()));
        (cells[0].to_owned(), values.collect())
    };
    lines.map(row).collect()
}

fn assert_close(value: &Json, expected: f64) {
    let value = value.as_f64().unwrap();
    assert!((value - expected).abs() <= 1e-10 * expected.abs(), "{value} for {expected}");
}

#[test]
fn a_yield_counts_the_runs_that_hold_all_limits() {
    let folder = folder();
    fs::write(folder.path().join("tolerances.csv"), TOLERANCES).unwrap();
    let line = format!("{FOUR_BAR} {LIMITS} --tolerances tolerances.csv --runs 64");
    let results = jointplay(folder.path(), &format!("{line} --threads 1 --summary json")).expect(0).json();
    assert_eq!(
        names(&folder.path().join("t")),
        ["manifest.json", "runs.csv", "tolerance.csv", "tolerance.json", "tolerance.png", "tolerance.svg"]
    );
    assert_eq!(names(folder.path()), ["t", "tolerances.csv"]);
    let runs = runs(folder.path());
    assert_eq!(runs.len(), 64);
    let force = |run: &(String, BTreeMap<String, f64>)| run.1["peak-force (N)"];
    let impacts = |run: &(String, BTreeMap<String, f64>)| run.1["impacts"];
    let is_within_force_limit = |run: &&(String, BTreeMap<String, f64>)| force(run) <= 140.0;
    let is_accepted =
        |run: &&(String, BTreeMap<String, f64>)| is_within_force_limit(run) && (7.0..=12.0).contains(&impacts(run));
    let (within_force_limit, accepted) =
        (runs.iter().filter(is_within_force_limit).count(), runs.iter().filter(is_accepted).count());
    assert!(
        accepted < within_force_limit && within_force_limit < 64,
        "the limits split the lot: {accepted}, {within_force_limit}"
    );
    assert_eq!((&results["units"], &results["accepted"]), (&Json::from(64), &Json::from(accepted)));
    assert_close(&results["yield"]["value"], accepted as f64 / 64.0);
    let of_force = &results["outputs"][0];
    assert_close(&of_force["yield"]["value"], within_force_limit as f64 / 64.0);

    // Statistics over the rows.
    let mut forces: Vec<f64> = runs.iter().map(force).collect();
    forces.sort_by(f64::total_cmp);
    let mean = forces.iter().sum::<f64>() / 64.0;
    let deviation = (forces.iter().map(|force| (force - mean).powi(2)).sum::<f64>() / 63.0).sqrt();
    assert_close(&of_force["mean"], mean);
    assert_close(&of_force["deviation"], deviation);
    assert_close(&of_force["cpk"]["value"], (140.0 - mean) / (3.0 * deviation));
    assert_close(&of_force["percentile_50"]["value"], 0.5 * (forces[31] + forces[32]));
    assert_close(&of_force["percentile_95"]["value"], 0.15 * forces[59] + 0.85 * forces[60]);
    // The largest of 64 is above the 99 % percentile with a probability of 1 - 0.99^64 = 47 %.
    assert_eq!(of_force["percentile_99"]["high"], Json::Null);

    // Values are within their distributions, and drivers are sorted by distance, which is recomputed for the first.
    for (_, values) in &runs {
        let clearances = ["joint.A.clearance (m)", "joint.B.clearance (m)"].map(|key| values[key]);
        assert!(clearances.iter().all(|clearance| (50e-6..=200e-6).contains(clearance)));
        assert!((0.05..=0.15).contains(&values["contact.friction"]));
    }
    let drivers = results["reject_drivers"].as_array().unwrap();
    let distances: Vec<f64> = drivers.iter().map(|driver| driver["distance"].as_f64().unwrap()).collect();
    assert_eq!(distances.len(), 3);
    assert!(distances.is_sorted_by(|a, b| a >= b), "{distances:?}");
    let key = drivers[0]["key"].as_str().unwrap();
    let key = if key.ends_with("clearance") { format!("{key} (m)") } else { key.to_owned() };
    let fraction_below = |value: f64, accepted: bool| {
        let values: Vec<f64> = runs.iter().filter(|run| is_accepted(run) == accepted).map(|run| run.1[&key]).collect();
        values.iter().filter(|other| **other <= value).count() as f64 / values.len() as f64
    };
    let distance = runs
        .iter()
        .map(|run| (fraction_below(run.1[&key], true) - fraction_below(run.1[&key], false)).abs())
        .fold(0.0, f64::max);
    assert_close(&drivers[0]["distance"], distance);

    // Two threads give the same bytes; the text summary agrees with the JSON.
    let files = ["runs.csv", "tolerance.csv", "tolerance.json", "tolerance.png", "tolerance.svg"];
    let read = || files.map(|name| fs::read(folder.path().join("t").join(name)).unwrap());
    let first = read();
    let text = jointplay(folder.path(), &format!("{line} --threads 2 --force")).expect(0).stdout;
    assert!(read() == first);
    assert!(text.contains(&format!("Lot               64 units, {} rejected", 64 - accepted)), "{text}");
    assert!(text.contains("peak-force at most 140 N: ") && text.contains("impacts from 7 to 12: "), "{text}");
}

#[test]
fn sampling_methods_and_seeds_change_the_lot_and_options_override_the_file() {
    let folder = folder();
    fs::write(folder.path().join("tolerances.csv"), TOLERANCES).unwrap();
    let line = format!("{FOUR_BAR} --limit peak-force=140 --tolerances tolerances.csv --runs 16 --force");
    let mut lots = Vec::new();
    for rest in ["", "--seed 2", "--sampling latin-hypercube", "--sampling random"] {
        jointplay(folder.path(), &format!("{line} --over joint.A.clearance=0.1mm..0.11mm {rest}")).expect(0);
        let clearances = |key: &str| runs(folder.path()).iter().map(|run| run.1[key]).collect::<Vec<_>>();
        assert!(clearances("joint.A.clearance (m)").iter().all(|clearance| (1e-4..=1.1e-4).contains(clearance)));
        let mut values = clearances("joint.B.clearance (m)");
        // Unless sampled randomly, 16 units have one value in each sixteenth of the range.
        values.sort_by(f64::total_cmp);
        let stratified = values.iter().enumerate().all(|(i, b)| (((b - 50e-6) / 150e-6 * 16.0) as usize) == i);
        assert_eq!(stratified, !rest.contains("random"), "{rest}");
        lots.push(values);
    }
    assert!(lots.iter().enumerate().all(|(i, lot)| lots[..i].iter().all(|other| other != lot)));
}

#[test]
fn the_cheapest_fits_equal_those_of_an_exhaustive_search() {
    let folder = folder();
    fs::write(folder.path().join("tolerances.csv"), TOLERANCES).unwrap();
    let fits = ["0.05mm..0.2mm", "0.05mm..0.1mm"];
    let costs: [[f64; 2]; 2] = [[1.0, 3.0], [2.0, 7.0]];
    let mut text = String::from("parameter,fit,cost\n");
    for (joint, costs) in ["A", "B"].iter().zip(costs) {
        for (fit, cost) in fits.iter().zip(costs) {
            text += &format!("joint.{joint}.clearance,{fit},{cost}\n");
        }
    }
    fs::write(folder.path().join("costs.csv"), text).unwrap();
    let line =
        format!("{FOUR_BAR} --limit peak-force=125 --runs 32 --summary json --force --tolerances tolerances.csv");
    // Evaluates all four choices on the same units.
    let mut yields = BTreeMap::new();
    for a in 0..2 {
        for b in 0..2 {
            let over = format!("--over joint.A.clearance={} --over joint.B.clearance={}", fits[a], fits[b]);
            let results = jointplay(folder.path(), &format!("{line} {over}")).expect(0).json();
            yields.insert((a, b), results["yield"]["value"].as_f64().unwrap());
        }
    }
    let all: Vec<f64> = yields.values().copied().collect();
    assert!(all.iter().any(|value| value != &all[0]), "{all:?}");
    for required in all {
        let search = format!("{line} --cost costs.csv --yield {required}");
        let results = jointplay(folder.path(), &search).expect(0).json();
        let fit = &results["fits"];
        let cost = |(a, b): &(usize, usize)| costs[0][*a] + costs[1][*b];
        let feasible = yields.iter().filter(|(_, value)| **value >= required).map(|(choice, _)| choice);
        let best = feasible.min_by(|x, y| cost(x).total_cmp(&cost(y))).unwrap();
        assert_eq!(fit["best"]["cost"], cost(best), "{yields:?} for {required}");
        let chosen = [best.0, best.1].map(|at| fits[at]);
        assert_eq!([0, 1].map(|at| fit["best"]["fits"][at]["fit"].as_str().unwrap()), chosen);
        assert_close(&fit["best"]["yield"]["value"], yields[best]);
        assert_eq!(fit["is_proven"], true);
        let runs = runs(folder.path());
        let evaluations = fit["evaluations"].as_u64().unwrap() as usize;
        assert!((1..=4).contains(&evaluations));
        assert_eq!(runs.len(), 32 * (evaluations + 2));
        // The check uses separate units.
        let of_check: Vec<_> = runs.iter().filter(|run| run.0 == "fits-check").collect();
        let accepted = of_check.iter().filter(|run| run.1["peak-force (N)"] <= 125.0).count();
        assert_close(&fit["check"]["yield"]["value"], accepted as f64 / 32.0);
        assert!(of_check.iter().all(|run| runs.iter().filter(|other| other.1 == run.1).count() == 1));
    }
    let none = jointplay(folder.path(), &format!("{line} --cost costs.csv --limit impacts=1000.. --yield 100%"));
    assert_eq!(none.expect(0).json()["fits"]["best"], Json::Null);

    // A single evaluation, of the tightest fits, does not prove optimality.
    let limited = format!(
        "{FOUR_BAR} --limit peak-force=125 --runs 8 --force --tolerances tolerances.csv --cost costs.csv --yield 1%"
    );
    let text = jointplay(folder.path(), &format!("{limited} --evaluations 1")).expect(0).stdout;
    assert!(
        text.contains("cost 10, not proven the cheapest: --evaluations 1 ended the search; 1 choice tried"),
        "{text}"
    );
    let normal =
        "parameter,fit,cost\njoint.A.clearance,\"normal(0.1mm, 5um)\",1\njoint.A.clearance,\"normal(0.1mm, 2um)\",2\n";
    fs::write(folder.path().join("costs.csv"), normal).unwrap();
    let text = jointplay(folder.path(), &limited).expect(0).stdout;
    assert!(text.contains("The order of the candidates of joint.A.clearance is not checked"), "{text}");
    assert!(text.contains("cost 1, proven the cheapest") && text.contains("in another lot: "), "{text}");
}

#[test]
fn units_that_cannot_start_are_rejects() {
    let folder = folder();
    let line = "tolerance spcmm --set solver.preset=real-time --duration 2ms --over spcmm.slider_plane=-100mm..60mm --quiet \
                --limit tip-error=50um --runs 16 --out t";
    let text = jointplay(folder.path(), line).expect(0).stdout;
    let results: Json = serde_json::from_slice(&fs::read(folder.path().join("t/tolerance.json")).unwrap()).unwrap();
    let runs = runs(folder.path());
    let finite: Vec<f64> = runs.iter().map(|run| run.1["tip-error (m)"]).filter(|error| error.is_finite()).collect();
    // The sliders reach the platform only from some planes.
    assert!((1..16).contains(&finite.len()), "{finite:?}");
    let accepted = finite.iter().filter(|error| **error <= 50e-6).count();
    assert_eq!((&results["units"], &results["accepted"]), (&Json::from(16), &Json::from(accepted)));
    assert_eq!(results["without_result"], 16 - finite.len());
    assert_close(&results["outputs"][0]["mean"], finite.iter().sum::<f64>() / finite.len() as f64);
    assert!(text.contains(&format!("{} without a result", 16 - finite.len())), "{text}");
}

#[test]
fn errors_are_reported_with_their_line() {
    let folder = folder();
    let line = format!("{FOUR_BAR} --runs 2 --limit peak-force=140");
    let tolerances = "parameter,distribution\n";
    let costs = "parameter,fit,cost\njoint.A.clearance,0.1mm..0.2mm,1\n";
    for (option, text, fragment) in [
        ("tolerances", "", "--tolerances bad.csv: expected the heading parameter,distribution"),
        ("tolerances", tolerances, "--tolerances bad.csv: expected the heading"),
        ("tolerances", "key,value\na,b\n", "--tolerances bad.csv, line 1: expected the heading"),
        ("tolerances", &format!("{tolerances}#\njoint.C.clearance,0..1mm\n"), "bad.csv, line 3: "),
        ("tolerances", &format!("{tolerances}joint.*.clearance,1..2\n"), "line 2: joint.A.clearance: "),
        ("tolerances", &format!("{tolerances}joint.A.clearance,H7/q6\n"), "line 2: joint.A.clearance: `H7/q6`"),
        ("tolerances", &format!("{tolerances}contact.friction,normal(0.1,0.2)\n"), "line 2: 3 cells for the 2"),
        ("tolerances", &format!("{tolerances}contact.friction,\"0.1\n"), "line 2: a quoted cell does not end"),
        ("tolerances", &format!("{tolerances}contact.friction,\"normal(0,0.1)\"\n"), "contact.friction: -0."),
        ("cost", &format!("{costs}joint.B.clearance,0.1mm,1\n"), "line 3: joint.B.clearance: give the parameter"),
        ("cost", &format!("{costs}joint.A.clearance,0.1mm,-1\n"), "line 3: joint.A.clearance: expected a cost"),
        (
            "cost",
            &format!("{costs}joint.A.clearance,0.1mm..0.3mm,2\n"),
            "line 3: joint.A.clearance: 0.1mm..0.3mm is wider",
        ),
    ] {
        fs::write(folder.path().join("bad.csv"), text).unwrap();
        let over = if option == "cost" { "--over joint.A.clearance=0.1mm..0.2mm" } else { "" };
        let message = jointplay(folder.path(), &format!("{line} {over} --{option} bad.csv")).expect(2).stderr;
        assert!(message.contains(fragment), "{text}: {message}");
        assert_eq!(names(folder.path()), ["bad.csv"], "{text}");
    }
    let over = "--over contact.friction=0.1..0.2";
    for (rest, code, fragment) in [
        ("--limit peak-force=140", 2, "--over"),
        ("--limit peak-force=140 --tolerances none.csv", 1, "none.csv: cannot read this file"),
        (&format!("--limit peak-force {over}"), 2, "--limit peak-force: expected OUTPUT=LIMIT"),
        (&format!("--limit peak-force=1mm {over}"), 2, "expected a number for peak-force in N"),
        (&format!("--limit peak-force=3..2 {over}"), 2, "the lower limit must be below"),
        (&format!("--limit peak-force=1 --limit peak-force=2 {over}"), 2, "has a limit already"),
        (&format!("--limit peak-forc=1 {over}"), 2, "--limit peak-forc: "),
        (&format!("--limit peak-force=1 --yield 99 {over}"), 2, "99% or 0.99"),
    ] {
        let message = jointplay(folder.path(), &format!("{FOUR_BAR} --runs 2 {rest}")).expect(code).stderr;
        assert!(message.contains(fragment), "{rest}: {message}");
    }
}
