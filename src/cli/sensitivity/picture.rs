//! Tornado of each parameter alone, and its indices, for every output.

use super::Found;
use crate::chart::{Axis, Chart, Label, Marker, PALETTE, Series, Sheet};
use crate::cli::study::{Study, drawn};

/// Width of one chart, height of its frame and of each parameter, pixels.
const WIDTH: u32 = 560;
const FRAME: u32 = 170;
const ROW: u32 = 34;
/// Largest number of parameters drawn: those with the largest effects.
const MOST: usize = 20;

/// Space above and below the parameters, in rows.
const MARGIN: f64 = 0.5;

/// Two charts side by side for each output.
pub fn sheet(study: &Study, found: &Found) -> Sheet {
    let outputs = study.outputs().len();
    let mut charts = Vec::new();
    let drawn = study.inputs().len().min(MOST) as u32;
    let with_indices = found.indices.iter().any(|indices| matches!(indices, Some(Ok(_))));
    for o in 0..outputs {
        let order = order(found, o);
        charts.push(tornado(study, found, o, &order));
        if with_indices {
            charts.push(indices(study, found, o, &order));
        }
    }
    let columns = if with_indices { 2 } else { 1 };
    Sheet {
        title: format!("{}: what moves the output", study.scene().name),
        size: (WIDTH * 2.min(columns as u32 + 1), (FRAME + ROW * drawn) * outputs as u32),
        charts,
        columns,
        note: format!("jointplay {}; runs of {}", crate::VERSION, study.describe()),
        apart: true,
    }
}

/// Parameters with the largest effects alone on output `o`, the largest first.
fn order(found: &Found, o: usize) -> Vec<usize> {
    let spread = |i: usize| {
        let [(_, low), (_, high)] = &found.alone.ends[i];
        let nominal = found.alone.nominal[o];
        let spread = low[o].max(high[o]).max(nominal) - low[o].min(high[o]).min(nominal);
        if spread.is_finite() { spread } else { f64::INFINITY }
    };
    let mut order: Vec<usize> = (0..found.alone.ends.len()).collect();
    order.sort_by(|&a, &b| spread(b).total_cmp(&spread(a)));
    order.truncate(MOST);
    order
}

fn tornado(study: &Study, found: &Found, o: usize, order: &[usize]) -> Chart {
    let output = &study.outputs()[o];
    let scaled = |value: f64| drawn(value, output.unit).0;
    let place = |rank: usize| (order.len() - rank) as f64;
    let mut series = Vec::new();
    let mut labels = Vec::new();
    let (mut low_ends, mut high_ends) = (Vec::new(), Vec::new());
    for (rank, &i) in order.iter().enumerate() {
        let [(_, low), (_, high)] = &found.alone.ends[i];
        let (a, b) = ((scaled(low[o]), place(rank)), (scaled(high[o]), place(rank)));
        series.push(Series::line("", vec![a, b], PALETTE[0]));
        low_ends.push(a);
        high_ends.push(b);
        labels.push(Label { at: if b.0 > a.0 { b } else { a }, text: study.inputs()[i].key.clone() });
    }
    series.push(Series::dots("lower end of the range", low_ends, PALETTE[0], Marker::Disc));
    series.push(Series::dots("upper end", high_ends, PALETTE[1], Marker::Square));
    let nominal = scaled(found.alone.nominal[o]);
    let top = order.len() as f64 + MARGIN;
    series.push(Series::line("values of the scene", vec![(nominal, 1.0 - MARGIN), (nominal, top)], PALETTE[2]));
    let x = Axis::new(&output.name, drawn(0.0, output.unit).1);
    Chart { labels, ..Chart::new("Each parameter alone", x, ranks(order), series) }
}

fn indices(study: &Study, found: &Found, o: usize, order: &[usize]) -> Chart {
    let place = |rank: usize| (order.len() - rank) as f64;
    let mut series = Vec::new();
    let mut labels = Vec::new();
    let (mut first, mut total) = (Vec::new(), Vec::new());
    if let Some(Ok(indices)) = &found.indices[o] {
        for (rank, &i) in order.iter().enumerate() {
            let Some(at) = found.kept.iter().position(|&kept| kept == i) else {
                continue;
            };
            for (estimate, points, colour, shift) in [
                (&indices.first[at], &mut first, PALETTE[0], 0.12),
                (&indices.total[at], &mut total, PALETTE[1], -0.12),
            ] {
                let y = place(rank) + shift;
                series.push(Series::line("", vec![(estimate.low, y), (estimate.high, y)], colour));
                points.push((estimate.value, y));
            }
            labels
                .push(Label { at: (indices.total[at].high, place(rank) - 0.12), text: study.inputs()[i].key.clone() });
        }
    }
    series.push(Series::dots("first-order", first, PALETTE[0], Marker::Disc));
    series.push(Series::dots("total", total, PALETTE[1], Marker::Square));
    let x = Axis::new("Share of the variance, with intervals of 95 %", "");
    let varies = matches!(found.indices[o], Some(Ok(_)));
    let title = if varies { "All parameters together" } else { "All parameters together: no variance to share" };
    Chart { labels, ..Chart::new(title, x, ranks(order), series) }
}

/// The axis of the parameters, the one with the largest effect on top.
fn ranks(order: &[usize]) -> Axis {
    Axis { range: Some((1.0 - MARGIN, order.len() as f64 + MARGIN)), ..Axis::new("Rank from below", "") }
}
