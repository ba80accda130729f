//! Distribution function of each limited output, with its limits.

use crate::analysis::lot::{Limit, Lot};
use crate::analysis::study::StudyRunner as _;
use crate::chart::{Axis, Chart, PALETTE, Series, Sheet};
use crate::cli::study::{Study, axis_value};

/// Width and height of a chart, pixels.
const SIZE: (u32, u32) = (640, 420);

/// A chart for each output.
pub fn sheet(study: &Study, limits: &[Limit], lot: &Lot) -> Sheet {
    let charts = limits.iter().enumerate().map(|(o, limit)| chart(study, o, limit, lot));
    let charts: Vec<Chart> = charts.collect();
    let columns = charts.len().min(2);
    let size = (SIZE.0 * columns as u32, SIZE.1 * charts.len().div_ceil(columns) as u32);
    Sheet {
        title: format!("{}: a lot of {}", study.scene().name, lot.accepted.len()),
        size,
        charts,
        columns,
        note: format!("jointplay {}; runs of {}", crate::VERSION, study.describe()),
        separate_legends: true,
    }
}

fn chart(study: &Study, o: usize, limit: &Limit, lot: &Lot) -> Chart {
    let output = &study.outputs()[o];
    let scaled = |value: f64| axis_value(value, output.unit).0;
    let mut values: Vec<f64> = lot.outputs.iter().map(|outputs| outputs[o]).filter(|value| value.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    // Units without a result count, so that the function stays below 100 % with them.
    let share = |units: usize| 100.0 * units as f64 / lot.outputs.len() as f64;
    let steps = values.iter().enumerate().flat_map(|(i, &value)| [i, i + 1].map(|below| (scaled(value), share(below))));
    let mut series = vec![Series::line("part of the lot below", steps.collect(), PALETTE[1])];
    for (name, end) in [("lower limit", limit.lower), ("upper limit", limit.upper)] {
        if let Some(end) = end {
            series.push(Series::line(name, vec![(scaled(end), 0.0), (scaled(end), 100.0)], PALETTE[2]));
        }
    }
    let y = Axis { range: Some((0.0, 100.0)), ..Axis::new("Part of the lot", "%") };
    Chart::new(&output.name, Axis::new(&output.name, axis_value(0.0, output.unit).1), y, series)
}
