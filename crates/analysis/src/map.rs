//! The tip's error over the workspace: at every point of a grid over drive positions and parameters, the error at rest and the
//! set of errors that are reachable with all balls anywhere in their play.

use super::axis::{Axis, RangeError};
use super::design::{Design, Start};
use jointplay_physics::machine::Vec3;
use jointplay_physics::mechanism::{Farthest, HeldError, HeldMachine, TipFreedoms};
use jointplay_scene::{Scene, SceneError};

/// Allowed numbers of directions.
pub const DIRECTIONS: std::ops::RangeInclusive<usize> = 2..=4096;
/// Largest number of directions of all points together: their arrays take 512 MiB.
const MAX_ERRORS: usize = 1 << 24;
/// The farthest error has been found when another direction enlarges it by less than this part, and maximum number of directions.
const STANDSTILL: f64 = 1e-9;
const MAX_TURNS: usize = 50;

/// A grid of points at which the drives stand still.
#[derive(Clone, Debug)]
pub struct WorkspaceMap {
    scene: Scene,
    design: Design,
    directions: usize,
}

/// What a point has.
#[derive(Clone, Debug)]
pub struct MapPoint {
    /// Tip without play, world axes, m.
    pub ideal_tip: Vec3,
    /// Tip at rest with play minus that, m; why there is none.
    pub settled: Result<Vec3, HeldError>,
    /// Directions in which the tip can err.
    pub freedoms: TipFreedoms,
    /// Farthest errors in directions spread evenly over the bounded ones, without their parts in the unbounded ones.
    pub farthest: Vec<Farthest>,
    /// The largest error in any bounded direction; `None` if play moves the tip nowhere, or no pose closes.
    pub largest: Option<Farthest>,
}

/// Why a point has nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PointFault {
    /// Parameters that the scene does not accept together.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The machine without play has no pose there.
    #[error(transparent)]
    Held(#[from] HeldError),
}

impl WorkspaceMap {
    /// The points `over` which `scene` is mapped, each axis as [`Axis::parse_over`] reads it, all combined, the last one varying
    /// fastest; with so many `directions` at each.
    ///
    /// # Errors
    /// As [`Axis::parse_over`] and [`Design::crossed`]; more errors than a result holds.
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

    /// The scene, without what varies.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The points.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// Directions at each point.
    pub fn directions(&self) -> usize {
        self.directions
    }

    /// Computes a point.
    ///
    /// # Errors
    /// The machine without play has no pose there.
    pub fn point(&self, point: usize) -> Result<MapPoint, PointFault> {
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

/// At most `count` unit vectors, spread evenly over all that `basis` spans: both ways along a line, around a circle, or over a
/// sphere along a Fibonacci spiral (González, Math. Geosci. 42, 2010, pp. 49-64).
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

/// The largest error: from the largest of `sampled`, each error is the direction of the next. The set's `farthest` point along an
/// error is at least as far as that error (Journée et al., J. Mach. Learn. Res. 11, 2010, pp. 517-553, algorithm 1).
fn largest(sampled: &[Farthest], mut farthest: impl FnMut(&Vec3) -> Farthest) -> Option<Farthest> {
    let size = |farthest: &Farthest| farthest.error.map_or(0.0, |error| error.norm());
    let first = sampled.iter().reduce(|most, next| if size(next) > size(most) { next } else { most })?;
    let mut most = first.clone();
    for _ in 0..MAX_TURNS {
        let direction = most.error?.try_normalize(0.0)?;
        let next = farthest(&direction);
        let grown = size(&next) > size(&most) * (1.0 + STANDSTILL);
        if size(&next) >= size(&most) {
            most = next;
        }
        if !grown {
            break;
        }
    }
    Some(most)
}
