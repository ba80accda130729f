//! Plate outlines: validity checks and triangulation.

use super::Vec3;

/// Tolerance of flatness, as a fraction of the outline's extent: coordinates are typed with few digits.
const FLAT: f64 = 1e-3;

/// Why an outline is invalid. Its `Display` continues "corners: ".
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum OutlineFault {
    /// Fewer than three corners.
    #[error("a plate needs at least 3 corners, has {0}")]
    TooFew(usize),
    /// All corners are collinear.
    #[error("the corners of a plate lie on one line and enclose no area")]
    Line,
    /// Two adjacent corners coincide.
    #[error("corners {0} and {1} of a plate are the same point")]
    Same(usize, usize),
    /// A corner is out of the plane.
    #[error("corner {corner} of a plate is {} mm out of the plane of its corners", 1e3 * off)]
    NotFlat {
        /// One-based index of the corner.
        corner: usize,
        /// Distance from the plane, m.
        off: f64,
    },
    /// Two edges cross.
    #[error("the edge from corner {0} of a plate crosses that from corner {1}")]
    Crosses(usize, usize),
}

/// Triangulates a planar polygon in space, convex or not, by ear clipping (Meisters 1975: a polygon with more than three corners
/// has at least two ears). `corners` follow the outline; triangles are indices into them.
///
/// # Errors
/// The corners bound no area or are not in a plane, or edges cross.
pub fn triangulate(corners: &[Vec3]) -> Result<Vec<[usize; 3]>, OutlineFault> {
    let n = corners.len();
    if n < 3 {
        return Err(OutlineFault::TooFew(n));
    }
    if let Some(i) = (0..n).find(|&i| corners[i] == corners[(i + 1) % n]) {
        return Err(OutlineFault::Same(i + 1, (i + 1) % n + 1));
    }
    let middle = corners.iter().sum::<Vec3>() / n as f64;
    let from_middle = |i: usize| corners[i % n] - middle;
    // Newell's normal; its length is twice the area, whatever the shape.
    let normal = (0..n).map(|i| from_middle(i).cross(&from_middle(i + 1))).sum::<Vec3>();
    let extent = (0..n).map(|i| from_middle(i).norm()).fold(0.0, f64::max);
    if normal.norm() <= 1e-9 * extent * extent {
        return Err(OutlineFault::Line);
    }
    let normal = normal.normalize();
    let height = |i: usize| from_middle(i).dot(&normal).abs();
    if let Some(corner) = (0..n).max_by(|&i, &j| height(i).total_cmp(&height(j)))
        && height(corner) > FLAT * extent
    {
        return Err(OutlineFault::NotFlat { corner: corner + 1, off: height(corner) });
    }
    // Twice the signed area of a triangle, positive if oriented like the polygon.
    let area = |i: usize, j: usize, k: usize| {
        let (a, b) = (corners[j] - corners[i], corners[k] - corners[i]);
        a.cross(&b).dot(&normal)
    };
    for i in 0..n {
        for j in i + 2..n {
            let (a, b) = ((i + 1) % n, (j + 1) % n);
            let apart = |p: f64, q: f64| (p > 0.0 && q < 0.0) || (p < 0.0 && q > 0.0);
            if b != i && apart(area(i, a, j), area(i, a, b)) && apart(area(j, b, i), area(j, b, a)) {
                return Err(OutlineFault::Crosses(i + 1, j + 1));
            }
        }
    }
    let mut remaining: Vec<usize> = (0..n).collect();
    let mut triangles = Vec::with_capacity(n - 2);
    while remaining.len() > 2 {
        let m = remaining.len();
        let at = |k: usize| [remaining[(k + m - 1) % m], remaining[k], remaining[(k + 1) % m]];
        let is_ear = |k: usize| {
            let [i, j, l] = at(k);
            let contains = |p: usize| area(i, j, p) >= 0.0 && area(j, l, p) >= 0.0 && area(l, i, p) >= 0.0;
            let others = || remaining.iter().copied().filter(|&p| ![i, j, l].iter().any(|&q| corners[p] == corners[q]));
            area(i, j, l) > 0.0 && !others().any(contains)
        };
        // Starting at the second corner turns a convex outline into a fan. If there is no ear, rounding made the rest flat.
        let ear = (1..m).chain([0]).find(|&k| is_ear(k));
        if let Some(k) = ear {
            triangles.push(at(k));
        }
        remaining.remove(ear.unwrap_or(0));
    }
    Ok(triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(points: &[[f64; 2]]) -> Vec<Vec3> {
        points.iter().map(|[x, y]| Vec3::new(*x, 0.5 * x - *y, *y)).collect()
    }

    fn area(corners: &[Vec3], triangles: &[[usize; 3]]) -> f64 {
        let one = |t: &[usize; 3]| 0.5 * (corners[t[1]] - corners[t[0]]).cross(&(corners[t[2]] - corners[t[0]])).norm();
        triangles.iter().map(one).sum()
    }

    #[test]
    fn triangles_fill_convex_and_concave_outlines_in_either_direction() {
        // The map to the inclined plane scales areas by sqrt(1 + 1 + 1/4).
        let stretch = 1.5;
        let comb = [
            [0.0, 0.0],
            [5.0, 0.0],
            [5.0, 3.0],
            [4.0, 3.0],
            [4.0, 1.0],
            [3.0, 1.0],
            [3.0, 3.0],
            [2.0, 3.0],
            [2.0, 1.0],
            [0.0, 1.0],
        ];
        let cases: [(&[[f64; 2]], f64); 4] = [
            (&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], 1.0),
            (&[[0.0, 0.0], [100.0, 0.0], [100.0, 100.0], [50.0, 10.0]], 3000.0),
            // With a corner in the middle of an edge.
            (&[[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [0.0, 1.0]], 0.5),
            (&comb, 9.0),
        ];
        for (points, expected) in cases {
            let mut corners = flat(points);
            for _ in 0..2 {
                let triangles = triangulate(&corners).unwrap();
                let got = area(&corners, &triangles) / stretch;
                assert!((got - expected).abs() < 1e-12 * expected, "{points:?}: {got}");
                corners.reverse();
            }
        }
    }

    #[test]
    fn corners_that_bound_no_area_are_refused() {
        let fault = |points: &[[f64; 2]]| triangulate(&flat(points)).unwrap_err();
        assert_eq!(fault(&[[0.0, 0.0], [1.0, 0.0]]), OutlineFault::TooFew(2));
        assert_eq!(fault(&[[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]]), OutlineFault::Line);
        assert_eq!(fault(&[[0.0, 0.0], [1.0, 1.0], [1.0, 1.0], [0.0, 2.0]]), OutlineFault::Same(2, 3));
        assert_eq!(fault(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]]), OutlineFault::Crosses(1, 3));
        let mut bent = flat(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        bent[2].x += 0.1;
        assert!(matches!(triangulate(&bent), Err(OutlineFault::NotFlat { .. })));
    }
}
