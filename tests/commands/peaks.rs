//! The peaks in the summary of `run`.

use std::fs;

use serde_json::Value as Json;

use crate::program::{folder, jointplay};

/// Parts of the suspension, whether they are elements, and whether they have a torque.
const SUSPENSION: [(&str, bool, bool); 6] = [
    ("coil", true, false),
    ("damper", true, false),
    ("tyre", true, false),
    ("chassis", false, true),
    ("lower-arm", false, true),
    ("upper-arm", false, true),
];

/// Largest size of the vector whose columns are called `stem`, component and `unit`, in a file of rows, with the time of its row.
fn largest(file: &Json, stem: &str, unit: &str) -> (f64, f64) {
    let column = |name: String| file["columns"][&name].as_array().unwrap_or_else(|| panic!("no column {name}"));
    let number = |value: &Json| value.as_f64().unwrap();
    let axes = ["x", "y", "z"].map(|axis| column(format!("{stem}_{axis}_{unit}")));
    let size = |row: usize| axes.iter().map(|axis| number(&axis[row]).powi(2)).sum::<f64>().sqrt();
    let rows = column("t_s".to_owned()).iter().enumerate();
    let sizes = rows.map(|(row, time)| (size(row), number(time)));
    sizes.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
}

#[test]
fn peaks_are_at_least_those_of_the_rows() {
    let folder = folder();
    let cases = [
        // The first peak of its damper forces and the first impacts.
        ("suspension", "2ms", "0.5us", &SUSPENSION[..]),
        (
            "press",
            "10ms",
            "5us",
            &[("cushion1", true, false), ("connecting-pin", false, false), ("ram", false, true)][..],
        ),
    ];
    for (scene, duration, every, parts) in cases {
        let run = format!("run {scene} --duration {duration} --summary json");
        let line =
            format!("{run} --every {every} --channels time,*.force,*.reaction,*.reaction_torque --out {scene}.json");
        let with_rows = jointplay(folder.path(), &line).expect(0).json();
        let without = jointplay(folder.path(), &run).expect(0).json();
        let text = jointplay(folder.path(), &format!("run {scene} --duration {duration}")).expect(0).stdout;
        assert!(!text.contains("e-1"), "a rounding error is reported as a peak: {text}");
        let file: Json =
            serde_json::from_str(&fs::read_to_string(folder.path().join(format!("{scene}.json"))).unwrap()).unwrap();
        for &(name, element, turns) in parts {
            let channel = if element { "force" } else { "reaction" };
            assert!(text.contains(&format!("{} {name} ", if element { "Element" } else { "Joint" })), "{name}: {text}");
            let loads = [("peak_force", channel, "N"), ("peak_torque", "reaction_torque", "Nm")];
            for (member, channel, unit) in loads.into_iter().take(1 + usize::from(turns)) {
                let (row, time) = largest(&file, &format!("{name}_{channel}"), unit);
                let peak = |summary: &Json| {
                    let number =
                        |member: String| summary[member][name].as_f64().unwrap_or_else(|| panic!("{name}: {summary}"));
                    (number(format!("{member}_{unit}")), number(format!("{member}_time_s")))
                };
                let (largest, when) = peak(&with_rows);
                // The peak between rows may be higher: a torque peaks while friction reverses, for 0.2 us.
                let limit = if unit == "N" { 1.02 } else { 1.3 };
                assert!(largest >= row && largest < limit * row, "{scene} {name} {channel}: {largest} in rows {row}");
                assert!((when - time).abs() < 2e-4, "{scene} {name} {channel}: at {when} s, in rows {time} s");
                let (without_rows, _) = peak(&without);
                assert!(
                    without_rows > 0.95 * row && without_rows <= largest,
                    "{scene} {name} {channel}: {without_rows}, with rows {largest}"
                );
            }
        }
    }
}
