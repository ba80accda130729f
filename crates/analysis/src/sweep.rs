//! A whole sweep: its scene, its points, and the computation of one block of them. The caller schedules the blocks: the records
//! of a block depend only on the sweep and the block number.

use super::drive::{NoPeriod, ObservedRun, drive_period};
use super::grid::{Grid, ParameterRange, Start};
use super::layout::Layout;
use super::point::{Plan, PointResult, PointRun};
use jointplay_physics::simulate::{LONGEST_RUN, Simulation};
use jointplay_scene::{Scene, SceneError, Value};

/// Largest total number of kept sections: an array of them takes 512 MiB.
const MOST_SECTIONS: usize = 1 << 26;

/// Largest number of values per range at which the interior of a map is tried before anything runs.
const MOST_WITHIN: usize = 64;

/// Why a sweep is invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SweepError {
    /// No kept periods.
    #[error(
        "--periods {periods} --discard {discard}: the periods include those discarded, so --discard must be less than --periods"
    )]
    NothingKept {
        /// Periods.
        periods: usize,
        /// Discarded periods.
        discard: usize,
    },
    /// More numbers than a result can hold.
    #[error(
        "{points} points with {kept} kept sections each are more than a result holds ({most} sections): fewer values in \
         --vary, fewer --periods, or more of them in --discard"
    )]
    TooLarge {
        /// Points.
        points: usize,
        /// Kept sections of a point.
        kept: usize,
        /// Most sections.
        most: usize,
    },
    /// Longer than the longest allowed run.
    #[error(
        "--periods {periods}: at {point} the longest run allowed, {LONGEST_RUN:e} s, covers {most} periods of \
             {period} s"
    )]
    TooLong {
        /// Periods.
        periods: usize,
        /// Parameters of the point.
        point: String,
        /// Its drive period, s.
        period: f64,
        /// Most periods.
        most: usize,
    },
    /// No drive phase.
    #[error("{0}; a sweep needs a driven scene such as spcmm or slider-crank-driven")]
    NoPeriod(#[from] NoPeriod),
    /// A point that the scene does not accept, or that cannot start.
    #[error("the scene cannot start at {point}: {error}")]
    Infeasible {
        /// Parameters of the point.
        point: String,
        /// What is wrong there.
        error: Box<SceneError>,
    },
}

/// A sweep.
#[derive(Clone, Debug)]
pub struct Sweep {
    scene: Scene,
    grid: Grid,
    plan: Plan,
    layout: Layout,
}

impl Sweep {
    /// A sweep of `scene`. Every value of each range is tried with the other range at its ends. Values inside a map are tried
    /// too, all of them if there are few enough.
    ///
    /// # Errors
    /// No kept periods, no drive phase, or a value at which the scene cannot start.
    pub fn new(scene: Scene, grid: Grid, plan: Plan) -> Result<Self, SweepError> {
        if plan.discard >= plan.periods {
            return Err(SweepError::NothingKept { periods: plan.periods, discard: plan.discard });
        }
        let (points, kept) = (grid.points(), plan.periods - plan.discard);
        if kept > MOST_SECTIONS / points {
            return Err(SweepError::TooLarge { points, kept, most: MOST_SECTIONS });
        }
        let layout = Layout::new(&scene, &plan);
        let sweep = Self { scene, grid, plan, layout };
        for point in sweep.tried() {
            let scene = sweep.grid.scene(&sweep.scene, point);
            let started = scene.and_then(|scene| {
                Simulation::new(&scene.machine).map_err(|error| scene.locate(&error))?;
                Ok(scene)
            });
            match started {
                Ok(scene) => {
                    let period = drive_period(&scene)?;
                    let most = (LONGEST_RUN / period) as usize;
                    if plan.periods > most {
                        return Err(SweepError::TooLong {
                            periods: plan.periods,
                            point: sweep.describe(point),
                            period,
                            most,
                        });
                    }
                }
                Err(error) => {
                    return Err(SweepError::Infeasible { point: sweep.describe(point), error: Box::new(error) });
                }
            }
        }
        Ok(sweep)
    }

    /// Points tried before anything runs: every value of each range with the other at its ends, and a lattice inside, which
    /// covers every point of a small map.
    fn tried(&self) -> Vec<usize> {
        let tried = |point: &usize| {
            let indices = self.grid.indices(*point);
            let along = || self.grid.axes().iter().zip(&indices);
            let is_end = |(axis, i): (&ParameterRange, &usize)| *i == 0 || *i + 1 == axis.count();
            let ends = along().filter(|&of| is_end(of)).count();
            ends + 1 >= indices.len() || along().all(|(axis, i)| i % axis.count().div_ceil(MOST_WITHIN) == 0)
        };
        (0..self.grid.points()).filter(tried).collect()
    }

    /// Parameters of a point, formatted for the user.
    pub fn describe(&self, point: usize) -> String {
        let written = |(key, value): (&str, Value)| {
            let shown = self.scene.parameter(key).map(|parameter| parameter.show(&value));
            format!("{key} = {}", shown.unwrap_or_default())
        };
        let settings = self.grid.settings(point).into_iter();
        settings.map(written).collect::<Vec<_>>().join(", ")
    }

    /// The scene, without the varied parameters.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The points.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Periods and sections of each point.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The arrays of the result.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Block `b`, not yet started.
    pub fn begin(&self, b: usize) -> BlockRun<'_> {
        BlockRun { sweep: self, order: self.grid.order(b), at: 0, run: None, machine: None, done: Vec::new() }
    }
}

/// A block of points being computed.
pub struct BlockRun<'a> {
    sweep: &'a Sweep,
    order: Vec<usize>,
    at: usize,
    run: Option<PointRun>,
    /// Run at the end of the previous point, if the next point follows it.
    machine: Option<ObservedRun>,
    done: Vec<(usize, Option<PointResult>)>,
}

impl BlockRun<'_> {
    /// Points finished so far, in the order of computation: index and result, `None` for one that could not start.
    pub fn finished(&self) -> &[(usize, Option<PointResult>)] {
        &self.done
    }

    /// The point being computed.
    pub fn current(&self) -> Option<&PointRun> {
        self.run.as_ref()
    }

    /// Whether every point is finished.
    pub fn is_done(&self) -> bool {
        self.at >= self.order.len()
    }

    /// Advances by at most `steps` simulation steps, not past the end of a point.
    pub fn advance(&mut self, steps: u32) {
        if self.is_done() {
            return;
        }
        let Some(mut run) = self.run.take().or_else(|| self.start()) else {
            self.close(None, None);
            return;
        };
        for _ in 0..steps {
            if run.step().is_err() {
                self.close(Some(run.stopped()), None);
                return;
            }
            if run.is_done() {
                let (result, machine) = run.finish();
                self.close(Some(result), Some(machine));
                return;
            }
        }
        self.run = Some(run);
    }

    /// Starts the next point, from the previous one if it follows that.
    fn start(&mut self) -> Option<PointRun> {
        let sweep = self.sweep;
        let point = self.order[self.at];
        let scene = sweep.grid.scene(&sweep.scene, point).ok()?;
        let period = drive_period(&scene).ok()?;
        let run = self.machine.take();
        let followed = run.and_then(|run| PointRun::follow(run, &scene.machine, sweep.plan, period));
        followed.or_else(|| PointRun::cold(&scene, sweep.plan, period).ok())
    }

    /// Finishes the current point; the next one follows `machine`, or starts cold without one.
    fn close(&mut self, result: Option<PointResult>, machine: Option<ObservedRun>) {
        self.done.push((self.order[self.at], result));
        self.at += 1;
        self.machine = machine.filter(|_| self.sweep.grid.start() != Start::Cold);
    }

    /// Records of the finished block, in point order.
    pub fn records(mut self) -> Vec<f64> {
        self.done.sort_by_key(|(point, _)| *point);
        let mut records = Vec::new();
        for (_, result) in &self.done {
            self.sweep.layout.append(result.as_ref(), &mut records);
        }
        records
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_are_tried_within() {
        let scene = Scene::load("spcmm", &[]).expect("built in");
        let tried = |rows: usize, columns: usize| {
            let ranges =
                [format!("contact.clearance=0.2mm..0.5mm:{rows}"), format!("contact.friction=0.1..0.2:{columns}")];
            let axes = ranges.map(|text| ParameterRange::parse(&scene, &text).expect("a range"));
            let grid = Grid::new(&scene, axes.to_vec(), Start::Cold).expect("a map");
            let plan = Plan { periods: 2, discard: 1, phase: 0.0, exponent: false };
            let layout = Layout::new(&scene, &plan);
            let sweep = Sweep { scene: scene.clone(), grid, plan, layout };
            sweep.tried()
        };
        assert_eq!(tried(3, 5), (0..15).collect::<Vec<_>>());
        // The border, and every second value of the first range and every third of the second.
        let large = tried(128, 130);
        for (i, j, is) in [(0, 1, true), (127, 7, true), (5, 129, true), (2, 3, true), (2, 4, false), (3, 3, false)] {
            assert_eq!(large.contains(&(i * 130 + j)), is, "{i} {j}");
        }
    }
}
