//! The tip's error over the workspace. For every point of a grid of drive positions and parameters, it gives the error at rest
//! and the set of errors that are reachable with every ball anywhere in its play.

use super::axis::{Axis, RangeError};
use super::design::{Design, Start};
use jointplay_physics::machine::Vec3;
use jointplay_physics::mechanism::{Farthest, HeldError, HeldMachine, TipFreedoms};
use jointplay_scene::{Scene, SceneError};

/// Allowed numbers of directions.
pub const DIRECTIONS: std::ops::RangeInclusive<usize> = 2..=4096;
/// Largest number of errors in a map, points times directions: their arrays take 512 MiB.
const MAX_ERRORS: usize = 1 << 24;
/// Relative growth below which the search for the largest error has converged.
const CONVERGED_GROWTH: f64 = 1e-9;
/// Largest number of iterations of that search.
const MAX_ITERATIONS: usize = 50;

/// A grid of points at which the drives are held.
#[derive(Clone, Debug)]
pub struct WorkspaceMap {
    scene: Scene,
    design: Design,
    directions: usize,
}

/// Tip errors at a point.
#[derive(Clone, Debug)]
pub struct MapPoint {
    /// Tip without play, world axes, m.
    pub ideal_tip: Vec3,
    /// Tip at rest with play minus `ideal_tip`, m; the error if there is no rest position.
    pub settled: Result<Vec3, HeldError>,
    /// Directions in which the tip can err.
    pub freedoms: TipFreedoms,
    /// Farthest errors in directions spread evenly over the bounded directions, without components in unbounded directions.
    pub farthest: Vec<Farthest>,
    /// The largest error in any bounded direction; `None` if play does not move the tip, or if no pose closes the loops.
    pub largest: Option<Farthest>,
}

/// Reasons why a point has no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MapPointError {
    /// Parameter values that the scene does not accept together.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The machine without play has no pose at this point.
    #[error(transparent)]
    Held(#[from] HeldError),
}

impl WorkspaceMap {
    /// A map of `scene` over all combinations of the axes in `over`, in the syntax of [`Axis::parse_over`]; the last axis
    /// varies fastest. `directions` is the number of directions at each point.
    ///
    /// # Errors
    /// As [`Axis::parse_over`] and [`Design::crossed`]; more points times directions than a map holds.
    pub fn new(scene: Scene, over: &[String], directions: usize) -> Result<Self, RangeError> {
        let axes = over.iter().map(|text| Axis::parse_over(&scene, text)).collect::<Result<Vec<_>, _>>()?;
        let design = Design::crossed(&scene, axes, &[Start::Cold])?;
        if design.points() > MAX_ERRORS / directions {
            let what = format!(
                "{} points with {directions} directions each are more than a map holds ({MAX_ERRORS} errors): fewer values in \
                 --over, or fewer --directions",
                design.points()
            );
            return Err(RangeError::Together(None, what));
        }
        Ok(Self { scene, design, directions })
    }

    /// The scene, without the varied values.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The points.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// Number of directions at each point.
    pub fn directions(&self) -> usize {
        self.directions
    }

    /// Computes a point.
    ///
    /// # Errors
    /// The scene rejects the parameter values, or the machine without play has no pose at the point.
    pub fn point(&self, point: usize) -> Result<MapPoint, MapPointError> {
        let scene = self.design.scene(&self.scene, point)?;
        let mut positions = vec![None; scene.machine.driven().count()];
        for (coordinate, position) in self.design.coordinates(point) {
            positions[coordinate.index] = Some(position);
        }
        let mut held = HeldMachine::new(&scene.machine, &positions)?;
        let freedoms = held.freedoms();
        let mut farthest = |direction: &Vec3| {
            let mut farthest = held.farthest(direction);
            for free in &freedoms.unbounded {
                farthest.error = farthest.error.map(|error| error - free * free.dot(&error));
            }
            farthest
        };
        let sampled: Vec<Farthest> = spread(&freedoms.bounded, self.directions).iter().map(&mut farthest).collect();
        let largest = largest(&sampled, farthest);
        Ok(MapPoint {
            ideal_tip: held.ideal_tip(),
            settled: held.settled_error().map_err(HeldError::from),
            freedoms,
            farthest: sampled,
            largest,
        })
    }
}

/// At most `count` unit vectors, spread evenly over the space that `basis` spans: both ways along a line, around a circle, or
/// over a sphere along a Fibonacci spiral (González, Math. Geosci. 42, 2010, pp. 49-64).
fn spread(basis: &[Vec3], count: usize) -> Vec<Vec3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let around = |turn: f64| (libm::cos(turn), libm::sin(turn));
    match *basis {
        [] => Vec::new(),
        [along] => vec![along, -along],
        [x, y] => {
            let turn = |i: usize| std::f64::consts::TAU * i as f64 / count as f64;
            let directions = (0..count).map(|i| around(turn(i)));
            directions.map(|(cosine, sine)| x * cosine + y * sine).collect()
        }
        [x, y, z, ..] => {
            let directions = (0..count).map(|i| {
                let height = 1.0 - (2 * i + 1) as f64 / count as f64;
                let (cosine, sine) = around(golden * i as f64);
                let radius = (1.0 - height * height).sqrt();
                (x * cosine + y * sine) * radius + z * height
            });
            directions.collect()
        }
    }
}

/// The largest error, by an iteration that starts at the largest of `sampled` and searches along each error for the next. The
/// set's `farthest` point along an error is at least as far as that error (Journée et al., J. Mach. Learn. Res. 11, 2010, pp.
/// 517-553, algorithm 1).
fn largest(sampled: &[Farthest], mut farthest: impl FnMut(&Vec3) -> Farthest) -> Option<Farthest> {
    let size = |farthest: &Farthest| farthest.error.map_or(0.0, |error| error.norm());
    let first = sampled.iter().reduce(|largest, next| if size(next) > size(largest) { next } else { largest })?;
    let mut largest = first.clone();
    for _ in 0..MAX_ITERATIONS {
        let direction = largest.error?.try_normalize(0.0)?;
        let next = farthest(&direction);
        let has_grown = size(&next) > size(&largest) * (1.0 + CONVERGED_GROWTH);
        if size(&next) >= size(&largest) {
            largest = next;
        }
        if !has_grown {
            break;
        }
    }
    Some(largest)
}
