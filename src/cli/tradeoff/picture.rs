//! The work-precision diagram of a scene.

use super::points::value;
use crate::analysis::{Point, View, WorkPrecision};
use crate::chart::{Axis, Chart, Label, Level, Marker, PALETTE, Series, Sheet};
use crate::integrate::Method;

/// Width of one diagram and height of the page, pixels.
const WIDTH: u32 = 560;
const HEIGHT: u32 = 500;
/// Markers of the methods, in order; a longer list starts again.
const MARKERS: [Marker; 8] = [
    Marker::Square,
    Marker::Disc,
    Marker::Triangle,
    Marker::Diamond,
    Marker::TriangleDown,
    Marker::Cross,
    Marker::Plus,
    Marker::Disc,
];
/// Largest error plotted; larger ones are meaningless.
const WORST: f64 = 1.0;
const FRONT: &str = "On the front: no other setting is both faster and more accurate";

/// Error against time, both phases side by side. `relative`: times relative to Runge-Kutta 4 at 10 microseconds, which carry
/// over to other machines.
pub(super) fn picture(results: &WorkPrecision, relative: bool, machine: &str) -> Sheet {
    let floor = &results.reference.floor;
    let impacts = if results.reference.impacts == 0 { "Reactions" } else { "First impacts" };
    let peak = "Largest relative error of a peak force";
    let mut charts = vec![diagram(results, relative, impacts, peak, Point::in_impacts, floor.peak)];
    if results.reference.settled.is_some() {
        let mean = "Largest relative error of a mean force";
        charts.push(diagram(results, relative, "Settled motion", mean, Point::in_settled, floor.settled));
    }
    let columns = charts.len();
    Sheet {
        title: format!("{}: what accuracy costs", results.reference.scene().name),
        size: (WIDTH * columns.max(2) as u32, HEIGHT),
        charts,
        columns,
        note: format!("jointplay {}, {machine}", crate::VERSION),
        separate_legends: false,
    }
}

fn diagram(results: &WorkPrecision, relative: bool, title: &str, error: &str, view: View, floor: Option<f64>) -> Chart {
    let floor = floor.filter(|floor| *floor > 0.0);
    let place = |point: &Point| {
        let (phase, error) = view(point)?;
        let cost = if relative { 1.0 / phase.ratio? } else { phase.cost()? };
        // Errors below the floor cannot be resolved, so the point is drawn on it.
        let error = error.max(floor.unwrap_or(0.0));
        (error <= WORST).then_some((cost, error))
    };
    let series = Method::ALL.into_iter().enumerate().map(|(n, method)| {
        let own = results.points.iter().filter(|p| p.setting.method == method);
        // A point without a position leaves a gap in the line.
        let points = own.map(|p| place(p).unwrap_or((f64::NAN, f64::NAN))).collect();
        let line = Series::line(method.word(), points, PALETTE[n % PALETTE.len()]);
        line.marked(MARKERS[n % MARKERS.len()])
    });
    let on_front = results.points.iter().filter(|p| view(p).is_some_and(|(phase, _)| phase.front));
    let front = Series::dots(FRONT, on_front.filter_map(place).collect(), (90, 90, 90), Marker::Ring);
    let labels = results.points.iter().filter_map(|point| {
        let text = match point.preset {
            Some(preset) => preset.word().to_owned(),
            None if is_baseline(point) => format!("{} {}", point.setting.method, value(&point.setting)),
            None => return None,
        };
        Some(Label { at: place(point)?, text })
    });
    let unit = if relative { "that of rk4 at 10 us is 1" } else { "s" };
    let time = Axis::logarithmic("Time for a simulated second", unit);
    Chart {
        labels: labels.collect(),
        levels: floor.map(|y| Level { y, text: "accuracy of the reference".to_owned() }).into_iter().collect(),
        ..Chart::new(title, time, Axis::logarithmic(error, ""), series.chain([front]).collect())
    }
}

/// Whether a point is Runge-Kutta 4 at 10 microseconds.
pub(super) fn is_baseline(point: &Point) -> bool {
    point.setting.method == Method::RungeKutta4 && point.setting.step_s == 10e-6
}
