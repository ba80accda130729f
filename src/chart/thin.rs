//! Drops invisible points of lines, so that pictures stay small for any number of points.

type Point = (i32, i32);

/// A subset of `path` whose line stays within `tolerance` of every point (Ramer 1972, Douglas & Peucker 1973).
pub(super) fn line(path: &[Point], tolerance: f64) -> Vec<Point> {
    let mut path = path.to_vec();
    path.dedup();
    if path.len() < 3 {
        return path;
    }
    let mut keep = vec![false; path.len()];
    let last = path.len() - 1;
    (keep[0], keep[last]) = (true, true);
    let mut open = vec![(0, last)];
    while let Some((from, to)) = open.pop() {
        let far =
            (from + 1..to).map(|k| (distance(path[k], path[from], path[to]), k)).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((most, k)) = far
            && most > tolerance
        {
            keep[k] = true;
            open.extend([(from, k), (k, to)]);
        }
    }
    let kept = path.into_iter().zip(keep).filter(|(_, keep)| *keep);
    kept.map(|(point, _)| point).collect()
}

/// Distance of `p` from the straight line between `a` and `b`.
fn distance(p: Point, a: Point, b: Point) -> f64 {
    let to = |q: Point| (f64::from(q.0 - a.0), f64::from(q.1 - a.1));
    let ((px, py), (bx, by)) = (to(p), to(b));
    let length = bx * bx + by * by;
    let theta = if length > 0.0 { ((px * bx + py * by) / length).clamp(0.0, 1.0) } else { 0.0 };
    (px - theta * bx).hypot(py - theta * by)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_and_peaks_are_kept_and_straight_parts_thinned() {
        let mut path: Vec<Point> = (0..100).map(|k| (k, 0)).collect();
        path[40].1 = 9;
        let thin = line(&path, 0.5);
        assert_eq!(thin, [(0, 0), (39, 0), (40, 9), (41, 0), (99, 0)]);
        let circle: Vec<Point> = (0..=2000)
            .map(|k| {
                let a = f64::from(k) * 0.00314159;
                ((1000.0 * a.cos()) as i32, (1000.0 * a.sin()) as i32)
            })
            .collect();
        let thin = line(&circle, 1.0);
        assert!(thin.len() < 120, "{}", thin.len());
        for p in &circle {
            let near = thin.windows(2).map(|w| distance(*p, w[0], w[1]));
            assert!(near.fold(f64::INFINITY, f64::min) <= 1.0);
        }
        // A closed curve begins where it ends.
        assert_eq!(line(&[(0, 0), (9, 0), (9, 9), (0, 0)], 0.5).len(), 4);
    }
}
