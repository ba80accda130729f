//! The twin run: its distance from the run on a logarithmic plot, and the largest Lyapunov exponent.

use eframe::egui::{Checkbox, Ui};
use egui_plot::{GridMark, PlotPoint};

use super::plane::{AxisLabel, plane, set_accessible_name};
use super::portrait::title;
use crate::app::curve::Path;
use crate::app::layout::reserve_lines;
use crate::app::player::Player;
use crate::app::twin::Twin;
use crate::app::{plots, theme, value};

const HEIGHT: f32 = 170.0;

/// Switch, plot and exponent.
pub fn ui(ui: &mut Ui, player: &mut Player) {
    let moves = !player.simulation().mechanism().is_kinematic();
    let mut on = player.twin().is_some();
    ui.horizontal_wrapped(|ui| {
        let switch = ui
            .add_enabled(moves, Checkbox::new(&mut on, "Twin a billionth away"))
            .on_hover_text(
                "Starts a second run from the current state, displaced by a billionth of the scales of its \
                 coordinates and velocities and drawn as a violet ghost in the 3D view, and a third run, whose \
                 divergence gives the exponent. The run itself is not affected; three runs take three times as long.",
            )
            .on_disabled_hover_text(
                "The motion of this scene is a function of time alone and has no neighbouring motions",
            );
        let restarts = on
            && moves
            && ui
                .button("Restart twin")
                .on_hover_text("Starts a new twin from the current state, for example after the transient")
                .clicked();
        if switch.changed() || restarts {
            player.set_twin(on);
        }
    });
    let Some(twin) = player.twin() else {
        return;
    };
    distance(ui, player, twin, HEIGHT);
    let exponent = match twin.exponent() {
        Ok(exponent) => {
            let [value, error] = [exponent.value, 2.0 * exponent.standard_error].map(|x| value::number(x, 3));
            format!("Exponent {value} ± {error} 1/s")
        }
        Err((more, interval)) => format!("Exponent — 1/s, known in {} s", value::number(more as f64 * interval, 3)),
    };
    ui.label(exponent).on_hover_text(
        "Largest Lyapunov exponent since the twin began, ± two standard errors: the mean growth rate of the distance \
         to a neighbouring motion, with renormalisation as in a sweep. Above 0 the motion is chaotic; below 0 \
         neighbouring motions converge. It is known after 25 periods of the drives, or of 0.1 s without drives, \
         because the first impacts say nothing about it",
    );
    reserve_lines(ui, "twin says", 2, |ui| {
        if let Some(why) = twin.stopped() {
            theme::warning(ui, format!("The twin run {why}"));
        }
    });
}

/// Plot of the twin's distance, `height` points high.
pub fn distance(ui: &mut Ui, player: &Player, twin: &Twin, height: f32) {
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
        "Distance to twin, in scales of the state (logarithmic)",
        "Euclidean distance of all coordinates and velocities, each divided by its tolerance scale (1 ball radius, \
         0.1 rad and so on)",
    );
    let points: Vec<PlotPoint> =
        distances.iter().map(|[time, distance]| PlotPoint::new(time / size, distance.log10())).collect();
    let ink = ui.visuals().weak_text_color();
    let shown = plane(ui, "divergence", &across, &up, height)
        .y_grid_spacer(|input| decades(input.bounds))
        .custom_y_axes(vec![
            egui_plot::AxisHints::new_y()
                .min_thickness(46.0)
                .tick_label_color(ink)
                .tick_label_font(eframe::egui::TextStyle::Small.resolve(ui.style()))
                .formatter(|mark, _| if mark.value == 0.0 { "1".to_owned() } else { format!("10^{}", mark.value) }),
        ])
        .show(ui, |plot| {
            plot.add(Path::line("Distance", &points, theme::series(5, dark), 1.4));
        });
    set_accessible_name(&shown, "the distance to the twin", &across, &up);
}

/// Grid marks at whole powers of ten, at most a few.
fn decades((least, greatest): (f64, f64)) -> Vec<GridMark> {
    let step = ((greatest - least) / 5.0).ceil().clamp(1.0, 100.0);
    let (first, last) = ((least / step).ceil() as i64, (greatest / step).floor() as i64);
    let mark = |index: i64| GridMark { value: index as f64 * step, step_size: step };
    (first..=last).map(mark).collect()
}
