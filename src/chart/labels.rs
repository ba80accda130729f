//! Texts at points, placed so that they cover neither points nor each other.

/// A rectangle on the sheet, in its units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Area {
    pub x: f64,
    pub y: f64,
    pub width: f64,
    pub height: f64,
}

/// A pair of coordinates, or width and height.
pub(super) type Pair = (f64, f64);

impl Area {
    fn overlap(&self, other: &Self) -> f64 {
        let x = (self.x + self.width).min(other.x + other.width) - self.x.max(other.x);
        let y = (self.y + self.height).min(other.y + other.height) - self.y.max(other.y);
        x.max(0.0) * y.max(0.0)
    }
}

/// Places each text, of the given size, as near to its point as possible without covering anything in `occupied`, inside
/// `frame`.
pub(super) fn place_labels(requested: &[(Pair, Pair)], mut occupied: Vec<Area>, frame: Area, unit: f64) -> Vec<Area> {
    let mut placed = Vec::new();
    for &((x, y), (width, height)) in requested {
        let mut best: Option<(f64, Area)> = None;
        for ring in 1..=6 {
            let gap = unit * f64::from(ring);
            let (left, right, middle) = (x - width - gap, x + gap, x - 0.5 * width);
            let (above, below, level) = (y - height - gap, y + gap, y - 0.5 * height);
            let corners = [
                (right, above),
                (right, below),
                (right, level),
                (left, above),
                (left, below),
                (left, level),
                (middle, above),
                (middle, below),
            ];
            for (x, y) in corners {
                let area = Area { x, y, width, height };
                let outside = width * height - area.overlap(&frame);
                let covered: f64 = occupied.iter().map(|other| area.overlap(other)).sum();
                // Distance breaks ties.
                let cost = covered + 4.0 * outside + 1e-3 * gap * unit;
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, area));
                }
            }
        }
        if let Some((_, area)) = best {
            occupied.push(area);
            placed.push(area);
        }
    }
    placed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_cover_neither_points_nor_each_other() {
        let frame = Area { x: 0.0, y: 0.0, width: 400.0, height: 300.0 };
        let points = [(200.0, 150.0), (204.0, 152.0), (395.0, 5.0), (60.0, 150.0)];
        let marks: Vec<Area> =
            points.iter().map(|&(x, y)| Area { x: x - 3.0, y: y - 3.0, width: 6.0, height: 6.0 }).collect();
        let requested: Vec<_> = points.iter().map(|&p| (p, (50.0, 12.0))).collect();
        let placed = place_labels(&requested, marks.clone(), frame, 6.0);
        assert_eq!(placed.len(), points.len());
        for (i, a) in placed.iter().enumerate() {
            assert!((a.overlap(&frame) - 600.0).abs() < 1e-9, "{a:?} sticks out");
            assert!(marks.iter().all(|m| a.overlap(m) == 0.0), "{a:?}");
            assert!(placed[i + 1..].iter().all(|b| a.overlap(b) == 0.0), "{a:?}");
        }
    }
}
