//! The coordinate of the output body shown in the bench.

use eframe::egui::Ui;

use super::plane::AxisLabel;
use crate::app::layout;
use crate::app::plots::plot_of;
use crate::app::watch::Observed;
use crate::simulate::Quantity;

/// One of x, y, z, alpha, beta, gamma, by its index in a section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BenchCoordinate(usize);

/// Names of the coordinates.
const NAMES: [&str; 6] = ["x", "y", "z", "α", "β", "γ"];
/// Order in the list: the paper's coordinates first.
const ORDER: [usize; 6] = [0, 4, 1, 2, 3, 5];

impl Default for BenchCoordinate {
    fn default() -> Self {
        Self(ORDER[0])
    }
}

impl BenchCoordinate {
    /// Its index in a section.
    pub fn index(self) -> usize {
        self.0
    }

    /// Axis units of the coordinate and of its rate, and their values in SI units.
    fn units(self) -> [(&'static str, f64); 2] {
        let own = if self.0 < 3 {
            [Quantity::Position, Quantity::Velocity]
        } else {
            [Quantity::Angles, Quantity::AngleRates]
        };
        own.map(|quantity| plot_of(quantity).unit)
    }

    /// The axis of the coordinate.
    pub fn axis(self) -> AxisLabel {
        AxisLabel::new(NAMES[self.0], self.units()[0].0)
    }

    /// The axis of its rate.
    pub fn rate_axis(self) -> AxisLabel {
        let name = format!("rate of {}", NAMES[self.0]);
        AxisLabel::new(name, self.units()[1].0)
    }

    /// Converts an SI value to the unit of [`Self::axis`].
    pub fn shown(self, si: f64) -> f64 {
        si / self.units()[0].1
    }

    /// Coordinate and rate in the units of their axes.
    pub fn of(self, state: &Observed) -> [f64; 2] {
        let rate = self.units()[1].1;
        [self.shown(state[self.0]), state[6 + self.0] / rate]
    }

    /// Combo box for the coordinate.
    pub fn ui(&mut self, ui: &mut Ui) {
        let names = ["Coordinate", "Coordinate of the output body that all plots of the bench show"];
        layout::choice(ui, names, Some(64.0), &mut self.0, ORDER, |index| NAMES[index]);
    }
}
