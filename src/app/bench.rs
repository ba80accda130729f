//! The chaos bench: phase portrait and Poincaré section of the running scene, sweeps in the background, and a twin run.

mod coordinate;
mod diagram;
mod divergence;
mod plane;
mod portrait;
mod sweep;

use eframe::egui::{RichText, Ui};

use super::host::Host;
use super::load::Load;
use super::player::Player;
use coordinate::Coordinate;
use portrait::Portrait;
use sweep::Sweep;
pub use sweep::Swept;

/// The panel.
#[derive(Default)]
pub struct Bench {
    coordinate: Coordinate,
    portrait: Portrait,
    sweep: Sweep,
    problem: Option<String>,
}

impl Bench {
    /// Takes in what a sweep said; whether one is under way.
    pub fn update(&mut self, host: &mut dyn Host) -> bool {
        self.sweep.update(host)
    }

    /// The latest sweep.
    pub fn swept(&self) -> Option<&Swept> {
        self.sweep.swept()
    }

    /// Whether a sweep is under way.
    pub fn is_sweeping(&self) -> bool {
        self.sweep.is_running()
    }

    /// Where the diagram drew a kept section of a point last, points of the screen.
    pub fn place(&self, index: usize, section: usize) -> Option<eframe::egui::Pos2> {
        self.sweep.diagram().place(index, section)
    }

    /// Everything, one below the other; the way to a section that was clicked.
    pub fn ui(&mut self, ui: &mut Ui, player: &mut Player) -> Option<Load> {
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new("Chaos bench").strong());
            ui.label("Coordinate");
            self.coordinate.ui(ui);
        });
        self.portrait.ui(ui, player, self.coordinate);
        ui.separator();
        divergence::ui(ui, player, &mut self.problem);
        if let Some(problem) = &self.problem {
            let words = RichText::new(problem).small();
            ui.label(words.color(ui.visuals().error_fg_color));
        }
        ui.separator();
        ui.label(RichText::new("Sweep").strong());
        self.sweep.ui(ui, player, self.coordinate)
    }
}
