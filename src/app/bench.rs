//! The bench beside the picture: the chaos bench (phase portrait and Poincaré section of the running scene, sweeps in the background,
//! a twin run), or what play costs.

mod computation;
mod coordinate;
mod cost_study;
mod costs;
mod diagram;
mod divergence;
mod plane;
mod portrait;
mod shared_job;
mod sweep;
mod sweep_results;
mod throttle;
mod tornado;
mod workspace;

use eframe::egui::{Button, CollapsingHeader, Response, RichText, Ui};

use super::command::Command;
use super::host::Host;
use super::player::Player;
use super::spoken;
use crate::analysis::ready_sweeps::ReadySweep;
use crate::scene::Scene;
use crate::view::Cloud;
use coordinate::BenchCoordinate;
pub use cost_study::CostStudy;
use costs::Costs;
use portrait::Portrait;
use sweep::SweepPanel;
pub use sweep_results::SweepResults;
use workspace::MapPanel;

/// The panel.
#[derive(Default)]
pub struct Bench {
    coordinate: BenchCoordinate,
    portrait: Portrait,
    sweep: SweepPanel,
    /// What play costs, while that is open in place of the chaos bench.
    costs: Option<Box<Costs>>,
    map: MapPanel,
}

impl Bench {
    /// Takes messages from computations; returns whether one is running.
    pub fn update(&mut self, host: &mut dyn Host) -> bool {
        self.costs.take_if(|costs| !costs.was_shown());
        let computes = self.costs.as_mut().is_some_and(|costs| costs.update(host));
        let maps = self.map.update(host);
        self.sweep.update(host) || computes || maps
    }

    /// The arrows of the map, if it was shown in the latest frame.
    pub(super) fn take_cloud(&mut self, player: &Player) -> Option<Cloud> {
        self.map.take_cloud(player)
    }

    /// Reports a frame at time `now`, s; `moves`: whether the picture is animated.
    pub fn report_frame(&mut self, now: f64, moves: bool) {
        self.sweep.computation.report_frame(now, moves);
        self.map.computation.report_frame(now, moves);
        if let Some(costs) = &mut self.costs {
            costs.computation.report_frame(now, moves);
        }
    }

    /// Opens or closes what play costs, in place of the chaos bench.
    pub(super) fn show_costs(&mut self, open: bool) {
        self.costs = if open { Some(self.costs.take().unwrap_or_default()) } else { None };
    }

    /// Whether what play costs is shown.
    pub fn shows_costs(&self) -> bool {
        self.costs.as_ref().is_some_and(|costs| !costs.is_set_aside())
    }

    /// Keeps the results of what play costs while a slider in a small window, or a presentation, takes its place.
    pub(super) fn set_aside(&mut self) {
        if let Some(costs) = &mut self.costs {
            costs.set_aside();
        }
    }

    /// The latest study of what play costs.
    pub fn cost_study(&self) -> Option<&CostStudy> {
        self.costs.as_ref()?.study()
    }

    /// Whether such a study is running.
    pub fn is_computing_costs(&self) -> bool {
        self.costs.as_ref().is_some_and(|costs| costs.computation.is_running())
    }

    /// Starts a ready sweep over the displayed `scene`.
    pub(super) fn start(&mut self, ready: &'static ReadySweep, scene: &Scene) {
        // The diagram shows the coordinate along the machine's travel.
        self.coordinate = BenchCoordinate::default();
        self.sweep.start(ready, scene);
    }

    /// The latest sweep.
    pub fn swept(&self) -> Option<&SweepResults> {
        self.sweep.results()
    }

    /// Whether a sweep is running.
    pub fn is_sweeping(&self) -> bool {
        self.sweep.computation.is_running()
    }

    /// Fraction of the diagram that was visible when it was last drawn, 0 to 1.
    pub fn diagram_seen(&self) -> f32 {
        self.sweep.diagram().visible_fraction()
    }

    /// Screen position, points, where the diagram last drew a retained section of a point.
    pub fn place(&self, index: usize, section: usize) -> Option<eframe::egui::Pos2> {
        self.sweep.diagram().place(index, section)
    }

    /// Distance plot of the twin run, if there is one.
    pub(super) fn twin_ui(ui: &mut Ui, player: &Player) {
        if let Some(twin) = player.twin() {
            let title = ui.text_style_height(&eframe::egui::TextStyle::Small) + 2.0 * ui.spacing().item_spacing.y;
            divergence::distance(ui, player, twin, ui.available_height() - title);
        }
    }

    /// The whole bench; returns the command chosen in it.
    pub fn ui(&mut self, ui: &mut Ui, player: &mut Player) -> Option<Command> {
        if let Some((tab, title)) = ui.horizontal_wrapped(|ui| self.tabs(ui)).inner {
            spoken::titled(ui, &tab, title);
        }
        let Self { coordinate, portrait, sweep, costs, map } = self;
        if let Some(costs) = costs {
            return costs.ui(ui, player);
        }
        ui.horizontal(|ui| {
            ui.label("Coordinate");
            coordinate.ui(ui);
        });
        let help = "How fast neighbouring motions of the running scene diverge";
        part(ui, "Divergence of neighbouring motions", help, true, |ui| {
            divergence::ui(ui, player);
        });
        let help = "The running scene in its phase space";
        part(ui, "Phase portrait and Poincaré section", help, true, |ui| {
            portrait.ui(ui, player, *coordinate);
        });
        let help = "The scene at many values of a parameter: the bifurcation diagram";
        let command = part(ui, "Sweep", help, true, |ui| sweep.ui(ui, player, *coordinate)).flatten();
        let help = "How far the tip is from where it would be without play, with the drives held at many positions";
        part(ui, "Tip error over the workspace", help, false, |ui| map.ui(ui, player));
        command
    }

    /// Choice between the chaos bench and what play costs; returns the chosen one, which is the heading.
    fn tabs(&mut self, ui: &mut Ui) -> Option<(Response, &'static str)> {
        let (open, mut heading) = (self.costs.is_some(), None);
        for (costs, title, help) in [
            (false, "Order or chaos", "Phase portrait, Poincaré section, sweeps, a twin a billionth away (key B)"),
            (true, "What play costs", "How far an output moves with the play of each joint alone (key W)"),
        ] {
            let tab = ui.add(Button::selectable(costs == open, title)).on_hover_text(help);
            if costs == open {
                heading = Some((tab, title));
            } else if tab.clicked() {
                self.show_costs(costs);
            }
        }
        heading
    }
}

/// A collapsible part of the bench, `open` at first; returns the result of `content` if it is open.
fn part<R>(ui: &mut Ui, name: &str, help: &str, open: bool, content: impl FnOnce(&mut Ui) -> R) -> Option<R> {
    let header = CollapsingHeader::new(RichText::new(name).strong()).default_open(open);
    let shown = header.show_unindented(ui, content);
    shown.header_response.on_hover_text(help);
    shown.body_returned
}

/// The error message without its command-line prefix, `option` with one of its `values`.
fn in_words(why: &str, option: &str, values: &[String]) -> String {
    let detail = values.iter().find_map(|text| why.strip_prefix(&format!("{option} {text}: ")));
    let words = detail.or_else(|| why.strip_prefix(&format!("{option} "))).unwrap_or(why);
    let mut letters = words.chars();
    let first = letters.next().map(|c| c.to_uppercase().collect::<String>());
    first.unwrap_or_default() + letters.as_str()
}
