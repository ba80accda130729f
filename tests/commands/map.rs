//! `map`: the error polygon of two rods at positions along a line, its files, and errors in its arguments.

use std::fs;
use std::path::Path;

use ndarray::s;
use serde_json::Value as Json;

use crate::common::truss::{Guide, Rod, TIP, TWO_RODS, support, truss};
use crate::program::{folder, jointplay, names};
use crate::sweep::archive;

/// Maps the scene of two rods, whose base slides; 3 of the 4 positions are reachable.
const MAP_COMMAND: &str = "map ./truss.toml --over base.position=-50mm,0mm,40mm,-2m";

fn scene(folder: &Path) {
    fs::write(folder.join("truss.toml"), truss(&TWO_RODS, TIP, Guide::Plane, "")).unwrap();
}

/// The `count` doubles after the line `head` of a VTK file.
fn doubles(file: &[u8], head: &str, count: usize) -> Vec<f64> {
    let head = format!("{head}\n");
    let at = file.windows(head.len()).position(|part| part == head.as_bytes());
    let at = at.unwrap_or_else(|| panic!("no {head}")) + head.len();
    let bytes = &file[at..at + 8 * count];
    bytes.as_chunks().0.iter().map(|bytes| f64::from_be_bytes(*bytes)).collect()
}

#[test]
fn the_files_contain_the_error_polygon_of_two_rods_at_every_position() {
    let folder = folder();
    scene(folder.path());
    let line = format!("{MAP_COMMAND} --directions 24 --out map.npz --out map.vtk");
    let output = jointplay(folder.path(), &line).expect(0).stdout;
    for words in [
        "4, 1 without a pose",
        "base.position = -2000 mm",
        "contact between bodies",
        "worst",
        "best",
        "static equilibrium",
    ] {
        assert!(output.contains(words), "{words}: {output}");
    }
    let (arrays, meta) = archive(&folder.path().join("map.npz"));
    assert_eq!(arrays["base.position"].as_slice().unwrap(), [-0.05, 0.0, 0.04, -2.0]);
    assert_eq!(arrays["status"].as_slice().unwrap(), [0.0, 0.0, 0.0, 1.0]);
    assert!(meta["reachable_set"].as_str().unwrap().contains("ignored"), "{meta}");
    assert!(meta["faults"]["3"].as_str().unwrap().contains("% of the way"), "{meta}");
    let vector = |name: &str, point: usize| -> Vec<f64> { arrays[name].slice(s![point, ..]).to_vec() };
    assert!(arrays["ideal_tip_m"].slice(s![3, ..]).iter().all(|x| x.is_nan()));
    for point in 0..3 {
        let tip = vector("ideal_tip_m", point);
        let moved =
            Rod { from: [TWO_RODS[0].from[0] + arrays["base.position"][point], TWO_RODS[0].from[1]], ..TWO_RODS[0] };
        let rods = [moved, TWO_RODS[1]];
        let mut max_error = 0.0_f64;
        for direction in 0..24 {
            let u = arrays["direction"].slice(s![point, direction, ..]).to_vec();
            let expected = support(&rods, [tip[0], tip[2]], [u[0], u[2]]);
            assert!((arrays["support_m"][[point, direction]] / expected - 1.0).abs() < 1e-9);
            let error = arrays["error_m"].slice(s![point, direction, ..]).to_vec();
            max_error = max_error.max(error.iter().map(|part| part * part).sum::<f64>().sqrt());
        }
        let largest = vector("largest_error_m", point);
        let size = largest.iter().map(|part| part * part).sum::<f64>().sqrt();
        assert!(size >= max_error * (1.0 - 1e-12) && size < 1.01 * max_error, "{size} {max_error}");
        // The joint with the largest share of the largest error.
        let shares = vector("share_m", point);
        let joint = arrays["largest_joint"][point] as usize;
        assert!(shares.iter().all(|share| *share <= shares[joint]), "{shares:?}");
        // At rest the tip error is within the largest error, but for the penetration of the balls.
        let settled = vector("settled_error_m", point);
        let rest = settled.iter().map(|part| part * part).sum::<f64>().sqrt();
        assert!(rest > 0.1 * size && rest < size * 1.02, "{rest} {size}");
    }
    // The VTK file has the same values at the points with a pose.
    let vtk = fs::read(folder.path().join("map.vtk")).unwrap();
    let text = String::from_utf8_lossy(&vtk);
    assert!(
        text.starts_with("# vtk DataFile Version 3.0\n") && text.contains("\nBINARY\nDATASET POLYDATA\n"),
        "{text}"
    );
    for (head, name) in [
        ("POINTS 3 double", "ideal_tip_m"),
        ("VECTORS settled_error_m double", "settled_error_m"),
        ("VECTORS largest_error_m double", "largest_error_m"),
    ] {
        let expected: Vec<f64> = arrays[name].slice(s![..3, ..]).iter().copied().collect();
        assert_eq!(doubles(&vtk, head, 9), expected, "{name}");
    }
    let positions = doubles(&vtk, "SCALARS base.position double 1\nLOOKUP_TABLE default", 3);
    assert_eq!(positions, [-0.05, 0.0, 0.04]);
    assert_eq!(names(folder.path()), ["map.npz", "map.vtk", "truss.toml"]);
}

#[test]
fn threads_change_no_byte_and_json_has_the_worst_point() {
    let folder = folder();
    scene(folder.path());
    let mut summaries = Vec::new();
    for (threads, out) in [(1, "a"), (2, "b")] {
        let line = format!(
            "{MAP_COMMAND} --over contact.restitution=0.5..0.9:2 --directions 8 --threads {threads} --out {out}.npz --out {out}.vtk \
             --summary json"
        );
        summaries.push(jointplay(folder.path(), &line).expect(0).json());
    }
    for ending in ["npz", "vtk"] {
        let read = |out: &str| fs::read(folder.path().join(format!("{out}.{ending}"))).unwrap();
        assert!(read("a") == read("b"), "{ending}");
    }
    let json = &summaries[0];
    assert_eq!(
        (json["points"].as_u64(), json["no_pose"].as_u64(), json["unbounded"].as_u64()),
        (Some(8), Some(2), Some(0))
    );
    let (arrays, _) = archive(&folder.path().join("a.npz"));
    assert_eq!(arrays["error_m"].shape(), [4, 2, 8, 3]);
    let size = |which: &str| -> f64 {
        let parts = json[which]["largest_error_m"].as_array().unwrap().iter();
        parts.map(|part| part.as_f64().unwrap().powi(2)).sum::<f64>().sqrt()
    };
    assert!(size("worst") >= size("median") && size("median") >= size("best") && size("best") > 0.0, "{json}");
    let worst = json["worst"]["point"].as_u64().unwrap() as usize;
    let at = arrays["largest_error_m"].slice(s![worst / 2, worst % 2, ..]).to_vec();
    assert_eq!(json["worst"]["largest_error_m"], Json::from(at));
}

#[test]
fn built_in_machines_with_free_tips_are_reported() {
    let folder = folder();
    let outcome =
        jointplay(folder.path(), "map pendulum --over contact.clearance=0.1mm..0.2mm:2 --directions 4").expect(0);
    assert!(
        outcome.stdout.contains("Unbounded") && outcome.stdout.contains("tip moves without play"),
        "{}",
        outcome.stdout
    );
    // Driven, without a free tip.
    let outcome = jointplay(folder.path(), "map four-bar --over crank.angle=0deg..90deg:3 --directions 4").expect(0);
    assert!(
        !outcome.stdout.contains("Unbounded") && outcome.stdout.contains("crank.angle = 90 deg"),
        "{}",
        outcome.stdout
    );
}

#[test]
fn errors_name_the_allowed_values() {
    let folder = folder();
    scene(folder.path());
    fs::write(folder.path().join("existing.npz"), "").unwrap();
    for (line, code, words) in [
        ("map ./truss.toml", 2, "--over"),
        ("map ./truss.toml --over base.angle=0deg..1deg:2", 2, "driven coordinates: base.position"),
        ("map ./truss.toml --over tip.position=0mm..1mm:2", 2, "driven coordinates: base.position"),
        ("map pendulum --over rod.angle=0deg..1deg:2", 2, "no driven coordinate"),
        ("map ./truss.toml --over base.position=0..1:2", 2, "needs a unit"),
        ("map ./truss.toml --over base.position=0deg..1deg:2", 2, "deg"),
        ("map ./truss.toml --over base.position=0mm..1mm", 2, "--over base.position=0mm..1mm: expected KEY=A..B:N"),
        ("map ./truss.toml --over base.position=1mm..0mm:2", 2, "reversed"),
        (
            "map ./truss.toml --over base.position=0mm,1mm --over base.position=0mm,2mm",
            2,
            "--over base.position is given twice",
        ),
        ("map ./truss.toml --over contact.clearance=0.1mm..20mm:2", 2, "below the ball radius"),
        ("map ./truss.toml --over base.position=0mm,1mm --directions 1", 2, "from 2 to 4096"),
        ("map ./truss.toml --over base.position=0mm..1mm:5000 --directions 4096", 2, "fewer --directions"),
        ("map ./truss.toml --over base.position=0mm,1mm --out a.csv", 2, ".npz or .vtk"),
        ("map ./truss.toml --over base.position=0mm,1mm --out a.vtk --out ./a.vtk", 2, "the same file"),
        ("map ./truss.toml --over base.position=0mm,1mm --out existing.npz", 1, "already exists"),
        ("map ./truss.toml --over base.position=-2m,-3m --out a.npz", 2, "no point has a pose"),
    ] {
        let outcome = jointplay(folder.path(), line).expect(code);
        assert!(outcome.stderr.contains(words), "{line}: {}", outcome.stderr);
    }
    assert_eq!(names(folder.path()), ["existing.npz", "truss.toml"]);
}
