//! The twin run: its distance from the run on a logarithmic plot, and the slope.

use eframe::egui::{Checkbox, Ui};
use egui_plot::{GridMark, Line, LineStyle, PlotPoint, PlotPoints};

use super::plane::{AxisLabel, plane};
use super::portrait::title;
use crate::app::curve::Path;
use crate::app::layout::reserved;
use crate::app::player::Player;
use crate::app::{plots, theme, value};

const HEIGHT: f32 = 170.0;

/// Switch, plot and slope.
pub fn ui(ui: &mut Ui, player: &mut Player) {
    let moves = !player.simulation().mechanism().is_kinematic();
    let mut on = player.twin().is_some();
    ui.horizontal_wrapped(|ui| {
        let switch = ui
            .add_enabled(moves, Checkbox::new(&mut on, "Twin run"))
            .on_hover_text(
                "A second run from the present state, displaced by a billionth of the scales of its coordinates and \
                 velocities, drawn as a violet ghost in the 3D view. The run itself does not change by a bit. Halves the speed.",
            )
            .on_disabled_hover_text(
                "The motion of this scene is a function of time alone: it has no neighbouring motions",
            );
        let anew = on
            && moves
            && ui
                .button("Start anew")
                .on_hover_text("A new twin from the present state, say once the transient is over")
                .clicked();
        if switch.changed() || anew {
            player.set_twin(on);
        }
    });
    let Some(twin) = player.twin() else {
        return;
    };
    let dark = ui.visuals().dark_mode;
    // The twin has reached the end of the latest step; the displayed instant lies within it.
    let shown = player.pacer.shown();
    let distances = twin.distances();
    let distances = &distances[..distances.partition_point(|[time, _]| *time <= shown)];
    let span = distances.last().zip(distances.first());
    let length = span.map_or(0.0, |(last, first)| last[0] - first[0]);
    let (unit, size) = plots::time_axis(length);
    let across = AxisLabel::new("at", unit);
    let up = AxisLabel::new("log10 of the distance", "");
    title(
        ui,
        "Distance of the twin, in scales of the state (logarithmic)",
        "Euclidean distance of all coordinates and velocities, each over its scale of the tolerance (1 ball radius, 0.1 rad \
         and so on); the line is fitted over the growing part",
    );
    let points: Vec<PlotPoint> =
        distances.iter().map(|[time, distance]| PlotPoint::new(time / size, distance.log10())).collect();
    let fit = twin.fit();
    let ink = ui.visuals().weak_text_color();
    plane(ui, "divergence", &across, &up, HEIGHT)
        .y_grid_spacer(|input| decades(input.bounds))
        .custom_y_axes(vec![
            egui_plot::AxisHints::new_y()
                .min_thickness(46.0)
                .tick_label_color(ink)
                .tick_label_font(eframe::egui::TextStyle::Small.resolve(ui.style()))
                .formatter(|mark, _| format!("1e{}", mark.value)),
        ])
        .show(ui, |plot| {
            plot.add(Path::line("Distance", &points, theme::series(5, dark), 1.4));
            if let Some(fit) = fit {
                let at = |time: f64| {
                    let ln = fit.start + fit.slope * (time - fit.from);
                    [time / size, ln / std::f64::consts::LN_10]
                };
                let line = Line::new("Fit", PlotPoints::from(vec![at(fit.from), at(fit.to)]));
                let style = LineStyle::dashed_loose();
                plot.line(line.color(theme::series(1, dark)).style(style).width(2.0));
            }
        });
    let (slope, over) = fit.map_or_else(
        || ("—".to_owned(), String::new()),
        |fit| {
            let [from, to] = [fit.from, fit.to].map(value::time);
            (value::number(fit.slope, 4), format!(", here from {from} to {to}"))
        },
    );
    ui.label(format!("Slope {slope} 1/s")).on_hover_text(format!(
        "Slope of the natural logarithm of the distance by least squares, from the displacement to where the distance first \
         reaches a tenth of its largest value{over}. The largest Lyapunov exponent of a sweep brings its twin back again \
         and again, and so tells of the whole motion.",
    ));
    reserved(ui, "twin says", 2, |ui| {
        if let Some(why) = twin.ended() {
            theme::warning(ui, format!("The twin run {why}"));
        }
    });
}

/// Marks at whole powers of ten, spaced so that there are few.
fn decades((least, greatest): (f64, f64)) -> Vec<GridMark> {
    let step = ((greatest - least) / 5.0).ceil().clamp(1.0, 100.0);
    let (first, last) = ((least / step).ceil() as i64, (greatest / step).floor() as i64);
    let mark = |index: i64| GridMark { value: index as f64 * step, step_size: step };
    (first..=last).map(mark).collect()
}
