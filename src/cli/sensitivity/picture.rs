//! Tornado of each parameter alone, and its indices, for every output.

use crate::analysis::study::{Sensitivity, StudyRunner as _};
use crate::chart::{Axis, Chart, Colour, PALETTE, Series, Sheet};
use crate::cli::study::{Study, axis_value};

/// Width of one chart, height of its frame and of each parameter, pixels.
const WIDTH: u32 = 560;
const FRAME: u32 = 170;
const ROW: u32 = 34;
/// Largest number of parameters drawn: those with the largest effects.
const MAX_BARS: usize = 20;

/// Space above and below the parameters, in rows.
const MARGIN: f64 = 0.5;
/// Width of a bar, and of each of two bars side by side, pixels; distance of these two from the middle, in rows.
const BAR: f64 = 20.0;
const HALF: f64 = 10.0;
const BAR_OFFSET: f64 = 0.5 * HALF / ROW as f64;
/// Colour and meaning of the bars of the tornado.
const ENDS: [(Colour, &str); 2] = [(PALETTE[1], "lower end of the range"), (PALETTE[5], "upper end")];

/// Two charts side by side for each output.
pub fn sheet(study: &Study, results: &Sensitivity) -> Sheet {
    let outputs = study.outputs().len();
    let mut charts = Vec::new();
    let bars = study.inputs().len().min(MAX_BARS) as u32;
    let with_indices = results.indices.iter().any(|indices| matches!(indices, Some(Ok(_))));
    for o in 0..outputs {
        let order = order(results, o);
        charts.push(tornado(study, results, o, &order));
        if with_indices {
            charts.push(indices(study, results, o, &order));
        }
    }
    let columns = if with_indices { 2 } else { 1 };
    Sheet {
        title: format!("{}: influences on the output", study.scene().name),
        size: (WIDTH * 2.min(columns as u32 + 1), (FRAME + ROW * bars) * outputs as u32),
        charts,
        columns,
        note: format!("jointplay {}; runs of {}", crate::VERSION, study.describe()),
        separate_legends: true,
    }
}

/// Parameters with the largest effects alone on output `o`, the largest first.
fn order(results: &Sensitivity, o: usize) -> Vec<usize> {
    let spread = |i: usize| {
        let [(_, low), (_, high)] = &results.alone.ends[i];
        let nominal = results.alone.nominal[o];
        let spread = low[o].max(high[o]).max(nominal) - low[o].min(high[o]).min(nominal);
        if spread.is_finite() { spread } else { f64::INFINITY }
    };
    let mut order: Vec<usize> = (0..results.alone.ends.len()).collect();
    order.sort_by(|&a, &b| spread(b).total_cmp(&spread(a)));
    order.truncate(MAX_BARS);
    order
}

/// A bar from the value of the scene to that at each end of a parameter's range, side by side where both are on the same side of it.
fn tornado(study: &Study, results: &Sensitivity, o: usize, order: &[usize]) -> Chart {
    let output = &study.outputs()[o];
    let scaled = |value: f64| axis_value(value, output.unit).0;
    let nominal = scaled(results.alone.nominal[o]);
    let mut series = Vec::new();
    for (rank, &i) in order.iter().enumerate() {
        let ends = results.alone.ends[i].each_ref().map(|(_, outputs)| scaled(outputs[o]));
        let opposite_sides = (ends[0] - nominal) * (ends[1] - nominal) < 0.0;
        for ((end, side), (colour, label)) in ends.into_iter().zip([1.0, -1.0]).zip(ENDS) {
            let (width, shift) = if opposite_sides { (BAR, 0.0) } else { (HALF, side * BAR_OFFSET) };
            let label = if rank == 0 { label } else { "" };
            series.push(Series::bar(label, (nominal, end), height_of_rank(order, rank) + shift, width, colour));
        }
    }
    let line = vec![(nominal, 1.0 - MARGIN), (nominal, order.len() as f64 + MARGIN)];
    series.push(Series::line("values of the scene", line, PALETTE[0]));
    let x = Axis::new(&output.name, axis_value(0.0, output.unit).1);
    Chart::new("Each parameter alone", x, names(study, order), series)
}

/// Bars of the indices, with their intervals as lines.
fn indices(study: &Study, results: &Sensitivity, o: usize, order: &[usize]) -> Chart {
    let mut series = Vec::new();
    let mut labelled = false;
    if let Some(Ok(indices)) = &results.indices[o] {
        for (rank, &i) in order.iter().enumerate() {
            let Some(at) = results.kept.iter().position(|&kept| kept == i) else {
                continue;
            };
            for (estimate, colour, label, side) in
                [(&indices.first[at], PALETTE[1], "first-order", 1.0), (&indices.total[at], PALETTE[5], "total", -1.0)]
            {
                let y = height_of_rank(order, rank) + side * BAR_OFFSET;
                let label = if labelled { "" } else { label };
                series.push(Series::bar(label, (0.0, estimate.value), y, HALF, colour));
                let interval = vec![(estimate.low, y), (estimate.high, y)];
                series.push(Series::line("", interval, PALETTE[0]));
            }
            labelled = true;
        }
    }
    let x = Axis::new("Share of the variance, with intervals of 95 %", "");
    let varies = matches!(results.indices[o], Some(Ok(_)));
    let title = if varies { "All parameters together" } else { "All parameters together: no variance to share" };
    Chart::new(title, x, names(study, order), series)
}

/// Height on the chart of the parameter with this rank.
fn height_of_rank(order: &[usize], rank: usize) -> f64 {
    (order.len() - rank) as f64
}

/// The axis of the parameters, the one with the largest effect on top.
fn names(study: &Study, order: &[usize]) -> Axis {
    let named = order.iter().enumerate().map(|(rank, &i)| (height_of_rank(order, rank), study.inputs()[i].key.clone()));
    let range = Some((1.0 - MARGIN, order.len() as f64 + MARGIN));
    Axis { range, names: named.collect(), ..Axis::default() }
}
