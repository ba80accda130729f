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

    /// Takes a frame at `now`, s; `moves`: whether the picture moves by itself.
    pub fn seen(&mut self, now: f64, moves: bool) {
        self.sweep.seen(now, moves);
    }

    /// Starts a ready sweep over `scene`, which is the one on show.
    pub(super) fn start(&mut self, ready: &'static ReadySweep, scene: &Scene) {
        // Its diagram is in the coordinate of the machine's travel.
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

    /// What share of the diagram was in sight when it was last drawn, 0 to 1.
    pub fn diagram_seen(&self) -> f32 {
        self.sweep.diagram().seen()
    }

    /// Where the diagram last drew a kept section of a point, points of the screen.
    pub fn place(&self, index: usize, section: usize) -> Option<eframe::egui::Pos2> {
        self.sweep.diagram().place(index, section)
    }

    /// The distance of the twin run alone, if there is one.
    pub(super) fn twin_ui(ui: &mut Ui, player: &Player) {
        if let Some(twin) = player.twin() {
            let title = ui.text_style_height(&eframe::egui::TextStyle::Small) + 2.0 * ui.spacing().item_spacing.y;
            divergence::distance(ui, player, twin, ui.available_height() - title);
        }
    }

    /// The whole bench; returns what was asked of the run.
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
