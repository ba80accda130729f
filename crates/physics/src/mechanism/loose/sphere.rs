//! Cells on a sphere.

use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::Arc;

use crate::machine::Vec3;

/// Cells on each socket: about 14 degrees across.
const CELLS: usize = 200;

/// Cells of equal area on the unit sphere: P. Leopardi, "A partition of the unit sphere into regions of equal area and small
/// diameter", Electronic Transactions on Numerical Analysis 25 (2006) 309-327. A cap about each pole is a cell; the
/// zones between are divided evenly in azimuth. Cells are counted from the pole +z, and eastwards from azimuth 0.
#[derive(Debug, PartialEq)]
pub struct Grid {
    /// Number of the first cell of each zone, caps included, followed by the total number.
    first: Vec<usize>,
}

impl Grid {
    /// That of every socket.
    pub fn of_sockets() -> Arc<Self> {
        Arc::new(Self::new(CELLS))
    }

    /// Divides the sphere into `cells` cells, at least two.
    fn new(cells: usize) -> Self {
        let n = cells as f64;
        // Polar angle that encloses a given share of the sphere.
        let within = |share: f64| 2.0 * libm::asin(share.sqrt());
        let cap = within(1.0 / n);
        let collars = ((PI - 2.0 * cap) / (4.0 * PI / n).sqrt()).round().max(1.0);
        let height = (PI - 2.0 * cap) / collars;
        let mut first = vec![0, 1];
        for collar in 1..collars as usize {
            // Nearest whole number of cells down to the collar's lower edge: the rounding error carries over to the next
            // collar.
            let s = libm::sin(0.5 * (cap + height * collar as f64));
            first.push((n * s * s).round() as usize);
        }
        if cells > 2 {
            first.push(cells - 1);
        }
        first.push(cells);
        Self { first }
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.first[self.zones()]
    }

    fn zones(&self) -> usize {
        self.first.len() - 1
    }

    /// Cells of zone `zone`, counted from +z; those of one zone are identical up to a rotation about z.
    pub fn zone(&self, zone: usize) -> Option<Range<usize>> {
        (zone < self.zones()).then(|| self.first[zone]..self.first[zone + 1])
    }

    /// Zone of `cell`.
    pub fn zone_of(&self, cell: usize) -> usize {
        self.first.partition_point(|first| *first <= cell) - 1
    }

    /// Polar angles from +z, 0..=pi, and azimuths about z from +x towards +y, 0..=2 pi, between which `cell` lies, rad.
    pub fn edges(&self, cell: usize) -> [[f64; 2]; 2] {
        let zone = self.zone_of(cell);
        let (from, to) = (self.first[zone], self.first[zone + 1]);
        let polar = |cells: usize| {
            let share = cells as f64 / self.cells() as f64;
            2.0 * libm::asin(share.sqrt())
        };
        let azimuth = |sector: usize| TAU * sector as f64 / (to - from) as f64;
        [[polar(from), polar(to)], [azimuth(cell - from), azimuth(cell - from + 1)]]
    }

    /// Cell that a unit vector points into.
    pub fn cell(&self, direction: &Vec3) -> usize {
        // Zones of equal height have equal area (Archimedes): this many cells lie above.
        let above = 0.5 * (1.0 - direction.z) * self.cells() as f64;
        let zone = self.zone_of((above as usize).min(self.cells() - 1));
        let sectors = self.first[zone + 1] - self.first[zone];
        let turn = libm::atan2(direction.y, direction.x) / TAU;
        let turn = if turn < 0.0 { turn + 1.0 } else { turn };
        let sector = ((turn * sectors as f64) as usize).min(sectors - 1);
        self.first[zone] + sector
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unit vector from polar angle and azimuth.
    fn towards(polar: f64, azimuth: f64) -> Vec3 {
        let ((s, c), (sa, ca)) = (libm::sincos(polar), libm::sincos(azimuth));
        Vec3::new(s * ca, s * sa, c)
    }

    #[test]
    fn cells_have_equal_area_and_cover_the_sphere() {
        for n in [2, 3, 4, 20, CELLS, 1001] {
            let grid = Grid::new(n);
            assert_eq!(grid.cells(), n);
            let mut whole = 0.0;
            for cell in 0..n {
                let [polar, azimuth] = grid.edges(cell);
                let area = (azimuth[1] - azimuth[0]) * (libm::cos(polar[0]) - libm::cos(polar[1]));
                assert!((area * n as f64 / (4.0 * PI) - 1.0).abs() < 1e-11, "{n}: {cell}");
                whole += area;
                // The centre of a cell maps back to that cell.
                let middle = |[a, b]: [f64; 2]| 0.5 * (a + b);
                let centre = towards(middle(polar), middle(azimuth));
                assert_eq!(grid.cell(&centre), cell, "{n}");
            }
            assert!((whole - 4.0 * PI).abs() < 1e-9, "{n}: {whole}");
        }
    }

    #[test]
    fn cells_are_about_as_wide_as_high() {
        let grid = Grid::new(CELLS);
        let zones: Vec<_> = (0..).map_while(|zone| grid.zone(zone)).collect();
        let counts: Vec<usize> = zones.iter().map(ExactSizeIterator::len).collect();
        assert_eq!(counts.iter().sum::<usize>(), CELLS);
        assert_eq!((counts[0], counts[counts.len() - 1]), (1, 1));
        for zone in &zones[1..zones.len() - 1] {
            let [polar, azimuth] = grid.edges(zone.start);
            let height = polar[1] - polar[0];
            let width = (azimuth[1] - azimuth[0]) * libm::sin(0.5 * (polar[0] + polar[1]));
            assert!((0.7..1.4).contains(&(width / height)), "{zone:?}: {width} by {height}");
        }
    }

    #[test]
    fn every_direction_lies_in_one_cell() {
        let grid = Grid::new(CELLS);
        assert_eq!(grid.cell(&Vec3::z()), 0);
        assert_eq!(grid.cell(&-Vec3::z()), CELLS - 1);
        // Rounding beyond the ends.
        assert_eq!(grid.cell(&Vec3::new(0.0, 0.0, -1.0 - 1e-15)), CELLS - 1);
        let mut hit = vec![0; CELLS];
        for i in 0..400 {
            for k in 0..400 {
                let z = (f64::from(i) + 0.5) / 200.0 - 1.0;
                let azimuth = TAU * (f64::from(k) + 0.5) / 400.0 - PI;
                let cell = grid.cell(&towards(libm::acos(z), azimuth));
                hit[cell] += 1;
                let [_, edges] = grid.edges(cell);
                let azimuth = if azimuth < 0.0 { azimuth + TAU } else { azimuth };
                assert!(edges[0] <= azimuth && azimuth <= edges[1]);
            }
        }
        // Points of uniform density: equally many in every cell.
        for (cell, hits) in hit.into_iter().enumerate() {
            assert!((700..900).contains(&hits), "{cell}: {hits}");
        }
    }
}
