//! The chaos bench: phase portrait and Poincaré section of the running scene, sweeps in the background, and a twin run.

mod asked;
mod coordinate;
mod diagram;
mod divergence;
mod plane;
mod portrait;
mod sweep;
mod swept;
mod throttle;

use eframe::egui::{CollapsingHeader, RichText, Ui};

use super::host::Host;
use super::player::Player;
use super::spoken;
use crate::analysis::ready::ReadySweep;
use crate::scene::Scene;
pub use asked::Asked;
use coordinate::Coordinate;
use portrait::Portrait;
use sweep::SweepPanel;
pub use swept::Swept;

/// The panel.
#[derive(Default)]
pub struct Bench {
    coordinate: Coordinate,
    portrait: Portrait,
    sweep: SweepPanel,
}

impl Bench {
    /// Takes messages from a sweep; returns whether one is running.
    pub fn update(&mut self, host: &mut dyn Host) -> bool {
        self.sweep.update(host)
    }

    /// Reports a frame at time `now`, s; `moves`: whether the picture is animated.
    pub fn seen(&mut self, now: f64, moves: bool) {
        self.sweep.seen(now, moves);
    }

    /// Starts a ready sweep over the displayed `scene`.
    pub(super) fn start(&mut self, ready: &'static ReadySweep, scene: &Scene) {
        // The diagram shows the coordinate along the machine's travel.
        self.coordinate = Coordinate::default();
        self.sweep.start(ready, scene);
    }

    /// The latest sweep.
    pub fn swept(&self) -> Option<&Swept> {
        self.sweep.swept()
    }

    /// Whether a sweep is running.
    pub fn is_sweeping(&self) -> bool {
        self.sweep.is_running()
    }

    /// Fraction of the diagram that was visible when it was last drawn, 0 to 1.
    pub fn diagram_seen(&self) -> f32 {
        self.sweep.diagram().seen()
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

    /// The whole bench; returns the user's request to the run.
    pub fn ui(&mut self, ui: &mut Ui, player: &mut Player) -> Option<Asked> {
        const TITLE: &str = "Chaos bench";
        let title = ui.horizontal_wrapped(|ui| {
            let title = ui.label(RichText::new(TITLE).strong());
            ui.label("Coordinate");
            self.coordinate.ui(ui);
            title
        });
        spoken::titled(ui, &title.inner, TITLE);
        let Self { coordinate, portrait, sweep } = self;
        let help = "How fast neighbouring motions of the running scene diverge";
        part(ui, "Divergence of neighbouring motions", help, |ui| {
            divergence::ui(ui, player);
        });
        let help = "The running scene in its phase space";
        part(ui, "Phase portrait and Poincaré section", help, |ui| {
            portrait.ui(ui, player, *coordinate);
        });
        let help = "The scene at many values of a parameter: the bifurcation diagram";
        part(ui, "Sweep", help, |ui| sweep.ui(ui, player, *coordinate)).flatten()
    }
}

/// A collapsible part of the bench; returns the result of `content` if it is open.
fn part<R>(ui: &mut Ui, name: &str, help: &str, content: impl FnOnce(&mut Ui) -> R) -> Option<R> {
    let header = CollapsingHeader::new(RichText::new(name).strong()).default_open(true);
    let shown = header.show_unindented(ui, content);
    shown.header_response.on_hover_text(help);
    shown.body_returned
}
