//! The wear map: cells of the walls of joints with play coloured by the impulse or the friction work they received, or by what has worn
//! off. Where a wall wears by direction its cells are drawn where it is.

use glam::{Mat3, Vec3};

use super::instances::placed;
use super::joint;
use super::relative::RelativeShot;
use super::solids::Pose;
use super::theme::Material;
use super::{Colour, DrawList, SceneView, Shot, WearMap, WearScale};
use crate::simulate::{Cell, Wear};

/// Decades of the scale below the largest value.
const DECADES: f32 = 3.0;

impl WearMap {
    /// Magnitude of the value of a cell per square millimetre of its `area` (m^2); of `depth` (m), um.
    fn value(self, cell: &Cell, area: f64, depth: impl Fn() -> f64) -> f32 {
        let value = match self {
            Self::Off => 0.0,
            // From 1/m^2 to 1/mm^2.
            Self::Impulse => cell.impulse / area * 1e-6,
            // From J/m^2 to mJ/mm^2.
            Self::FrictionWork => cell.friction_work.abs() / area * 1e-3,
            Self::Depth => 1e6 * depth(),
        };
        value as f32
    }
}

impl WearScale {
    /// Smallest value with a colour of its own; smaller ones share its colour.
    pub fn least(&self) -> f32 {
        self.largest / 10_f32.powf(DECADES)
    }

    /// Position of `value` on the logarithmic scale: 0 for the smallest, 1 for the largest.
    pub fn position(&self, value: f32) -> f32 {
        (1.0 + (value / self.largest).log10() / DECADES).clamp(0.0, 1.0)
    }

    /// Powers of ten on the scale, ascending; none before the first contact.
    pub fn ticks(&self) -> impl Iterator<Item = f32> {
        let first = self.least().log10().ceil() as i32;
        let powers = (first..=first + DECADES as i32).map(|power| 10_f32.powi(power));
        let largest = self.largest;
        powers.take_while(move |tick| *tick <= largest)
    }

    /// Colour at a position on the scale: viridis (S. van der Walt and N. Smith, 2015), whose lightness rises evenly, also
    /// for the colour-blind and in grey.
    pub fn colour(position: f32) -> Colour {
        const VIRIDIS: [u32; 9] =
            [0x440154, 0x472D7B, 0x3B528B, 0x2C728E, 0x21918C, 0x28AE80, 0x5EC962, 0xADDC30, 0xFDE725];
        let at = position.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f32;
        let lower = (at as usize).min(VIRIDIS.len() - 2);
        let [from, to] = [lower, lower + 1].map(|i| Colour::hex(VIRIDIS[i]).0);
        let fraction = at - lower as f32;
        Colour(std::array::from_fn(|i| from[i] + fraction * (to[i] - from[i])))
    }
}

impl SceneView {
    /// Adds the map selected in `shot`, with the values in `wear`, to the list built from that shot: cells without contact
    /// stay clear.
    pub fn add_wear(&self, shot: &Shot<'_>, wear: &Wear, out: &mut DrawList) {
        let map = shot.options.wear;
        if map == WearMap::Off {
            return;
        }
        let relative = RelativeShot::of(shot);
        let shot = &relative.as_ref().map_or(*shot, |relative| relative.shot(shot));
        let joints = 0..shot.scene.machine.loose_joints.len();
        let frame = shot.frame;
        let valued = |j: usize| {
            let (division, kind) = (wear.division(j), &shot.scene.machine.loose_joints[j].kind);
            division.each().zip(wear.cells(j)).map(move |((part, cell), totals)| {
                let depth = || frame.worn_depth(j, kind, division, (part, cell));
                (j, part, cell, map.value(totals, part.area, depth))
            })
        };
        let values: Vec<_> = joints.clone().flat_map(valued).collect();
        let scale = WearScale { map, largest: values.iter().map(|(.., value)| *value).fold(0.0, f32::max) };
        out.wear_scale = Some(scale);
        if scale.largest <= 0.0 {
            return;
        }
        let drawn = joint::joints(shot.scene, shot.frame, out.magnification);
        for j in joints {
            let body = Pose::in_frame(shot.frame, shot.scene.machine.loose_joints[j].carrier().body).rotation;
            let division = wear.division(j).axes();
            // Rows of a rotation are columns of its inverse.
            let axis = |i: usize| super::to_f32(&division.row(i).transpose());
            let axes = body * Mat3::from_cols(axis(0), axis(1), axis(2));
            for &(_, part, cell, value) in values.iter().filter(|(own, .., value)| *own == j && *value > 0.0) {
                let wall = frame.worn_walls.iter().find(|wall| wall.joint == j && wall.place == part.place);
                // The wall is touched there as one about a middle moved by this.
                let moved = wall.map_or(Vec3::ZERO, |wall| {
                    let moved = wall.limit(&wear.division(j).direction(part, cell), 0.0);
                    body * super::to_f32(&moved) * out.magnification
                });
                let surface = Material { colour: WearScale::colour(scale.position(value)), roughness: 1.0, metal: 0.0 };
                drawn[j].cell((part, cell), &axes, |mesh, linear, at| {
                    out.wear.push(mesh, placed(linear, at + moved, surface));
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_is_logarithmic_and_ends_at_the_largest_value() {
        let scale = WearScale { map: WearMap::Impulse, largest: 1.2 };
        assert_eq!(scale.position(1.2), 1.0);
        assert!((scale.position(0.12) - 2.0 / 3.0).abs() < 1e-6);
        assert!(scale.position(scale.least()) < 1e-6);
        assert_eq!(scale.position(1e-9), 0.0);
        let ticks: Vec<f32> = scale.ticks().collect();
        assert_eq!(ticks.len(), 3);
        for (tick, expected) in ticks.into_iter().zip([0.01, 0.1, 1.0]) {
            assert!((tick / expected - 1.0).abs() < 1e-5, "{tick}");
        }
    }

    #[test]
    fn a_larger_value_is_lighter() {
        // Relative luminance (IEC 61966-2-1) of a colour.
        let luminance = |position: f32| {
            let [r, g, b] = WearScale::colour(position).linear();
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        for i in 0..40 {
            let (less, more) = (i as f32 / 40.0, (i + 1) as f32 / 40.0);
            assert!(luminance(less) < luminance(more), "{less}");
        }
        assert!(luminance(0.0) < 0.05 && luminance(1.0) > 0.7);
    }
}
