//! Phase portrait of the output body, and its Poincaré section at the drive phase.

use eframe::egui::{RichText, Slider, SliderClamping, Ui};
use egui_plot::{PlotPoint, PlotPoints, Points};

use super::coordinate::BenchCoordinate;
use super::plane::{AxisLabel, plane, set_accessible_name};
use crate::analysis::drive::observed;
use crate::app::curve::Path;
use crate::app::layout::reserve_lines;
use crate::app::player::Player;
use crate::app::watch::Observed;
use crate::app::{keys, spoken, theme, value};

/// Height of each plot, points.
const HEIGHT: f32 = 190.0;

/// Buffers reused in every frame.
#[derive(Default)]
pub struct Portrait {
    orbit: Vec<PlotPoint>,
    sections: Vec<PlotPoint>,
}

impl Portrait {
    /// Phase portrait (rate over coordinate): the orbit of the last periods and the sections.
    pub fn ui(&mut self, ui: &mut Ui, player: &mut Player, coordinate: BenchCoordinate) {
        self.update_points(player, coordinate);
        let (across, up) = (coordinate.axis(), coordinate.rate_axis());
        let dark = ui.visuals().dark_mode;
        reserve_lines(ui, "portrait of", 2, |ui| {
            let words = format!(
                "Running: {}; sections at phase {}°",
                value::scene_line(player.running(), &[]),
                value::number(360.0 * player.watch().phase(), 4)
            );
            ui.label(RichText::new(words).small())
                .on_hover_text("The run that the portrait and the section below show");
        });
        title(
            ui,
            &format!("Phase portrait: {} over {}", up.title(), across.title()),
            "The orbit of the last periods of the drive, at most 1000 instants in each, with the state on show and the sections",
        );
        let (line, mark) = (theme::series(0, dark), theme::series(1, dark));
        let Self { orbit, sections } = self;
        let shown = plane(ui, "portrait", &across, &up, HEIGHT).show(ui, |plot| {
            plot.add(Path::line("Orbit", orbit, line, 1.2));
            let series = PlotPoints::Borrowed(sections);
            plot.points(Points::new("Section", series).color(mark).radius(2.5));
            if let Some(last) = orbit.last() {
                let now = PlotPoints::Owned(vec![*last]);
                plot.points(Points::new("State on show", now).color(line).radius(4.0));
            }
        });
        set_accessible_name(&shown, "the orbit", &across, &up);
        match player.watch().period().map_err(ToOwned::to_owned) {
            Err(why) => {
                ui.label(RichText::new(format!("No Poincaré section: {why}")).weak());
            }
            Ok(period) => self.section(ui, player, period, &across, &up),
        }
    }

    fn section(&self, ui: &mut Ui, player: &mut Player, period: f64, across: &AxisLabel, up: &AxisLabel) {
        let mark = theme::series(1, ui.visuals().dark_mode);
        title(
            ui,
            &format!("Poincaré section: {} over {}", up.title(), across.title()),
            "The state once in each period of the drive, at the section phase. A periodic motion gives a few points, \
             chaos a cloud. A reset or a parameter change clears it.",
        );
        let shown = plane(ui, "section", across, up, HEIGHT).show(ui, |plot| {
            let series = PlotPoints::Borrowed(&self.sections);
            plot.points(Points::new("Section", series).color(mark).radius(2.5));
        });
        set_accessible_name(&shown, "the sections", across, up);
        ui.horizontal_wrapped(|ui| {
            ui.label("Drive phase");
            let mut degrees = 360.0 * player.watch().phase();
            let slider =
                Slider::new(&mut degrees, 0.0..=359.0).suffix("°").max_decimals(1).clamping(SliderClamping::Always);
            let slider = keys::slider(ui, slider, [0.0, 359.0])
                .on_hover_text(
                    "Phase of the drive at which sections are taken, of the running scene and of the next sweep; 0° \
                     is the phase at t = 0. A change restarts the section.",
                )
                .accessible_name("Drive phase");
            spoken::value(&slider, &format!("{}°", value::number(degrees, 4)));
            if slider.changed() {
                player.set_phase(degrees / 360.0);
            }
        });
        ui.label(
            RichText::new(format!("Sections: {}, one every {}", self.sections.len(), value::quantity(period, "s", 5)))
                .small()
                .weak(),
        )
        .on_hover_text(
            "Sections of the running scene since its start or its latest change, and the period of its \
                        drive in simulated time; a larger time scale yields them sooner",
        );
    }

    fn update_points(&mut self, player: &Player, coordinate: BenchCoordinate) {
        let watch = player.watch();
        let point = |(_, state): &(f64, Observed)| {
            let [across, up] = coordinate.of(state);
            PlotPoint::new(across, up)
        };
        self.orbit.clear();
        self.orbit.extend(watch.orbit().map(point));
        // The orbit skips closely spaced instants, so the displayed one is appended.
        let frame = player.frame();
        self.orbit.push(point(&(frame.time, observed(&frame.pose))));
        self.sections.clear();
        self.sections.extend(watch.sections().map(point));
    }
}

/// Heading of a plot.
pub fn title(ui: &mut Ui, words: &str, help: &str) {
    ui.add_space(4.0);
    ui.label(RichText::new(words).small()).on_hover_text(help);
}
