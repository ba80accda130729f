//! `run --impacts`: one row per finished impact, and a summary of them.

use std::path::Path;

use serde_json::{Map, Value as Json, json};

use super::Failure;
use super::output::{RowsFile, Table};
use crate::analysis::impact_row::{COLUMNS, row};
use crate::files::PendingFile;
use crate::scene::Scene;
use crate::simulate::{Impact, Simulation};

/// Collects the impacts of a run for a file.
pub struct ImpactsFile {
    file: RowsFile,
    impacts: Vec<Impact>,
    /// Impacts that ended before this time, s, belong to an earlier run.
    since: f64,
}

impl ImpactsFile {
    /// Checks that `path` can be written.
    ///
    /// # Errors
    /// As [`RowsFile::claim`].
    pub fn claim(path: &Path, force: bool) -> Result<Self, Failure> {
        Ok(Self { file: RowsFile::claim(path, force)?, impacts: Vec::new(), since: 0.0 })
    }

    /// The file.
    pub fn file(&mut self) -> &mut RowsFile {
        &mut self.file
    }

    /// Collects only impacts that end at `time`, s, or later.
    pub fn begin_at(&mut self, time: f64) {
        self.since = time;
    }

    /// Collects the impacts finished since the last call; to be called after every step.
    pub fn collect(&mut self, simulation: &mut Simulation) {
        let since = self.since;
        self.impacts.extend(simulation.take_impacts().filter(|impact| impact.end >= since));
    }

    /// All impacts so far, in the order in which they finished.
    pub fn impacts(&self) -> &[Impact] {
        &self.impacts
    }

    /// Writes the impacts with their provenance `meta`, under temporary names. Also returns the number of rows.
    ///
    /// # Errors
    /// As [`RowsFile::fill`].
    pub fn fill(self, scene: &Scene, mut meta: Map<String, Json>) -> Result<(usize, Vec<PendingFile>), Failure> {
        let names: Vec<&str> = scene.machine.loose_joints.iter().map(|j| j.name.as_str()).collect();
        meta.insert("rows".into(), json!(self.impacts.len()));
        // Indices in the column `joint`, from 0.
        meta.insert("ball_joints".into(), json!(names));
        // By joint, the names of the indices in the column `site`.
        meta.insert("sites".into(), scene.machine.loose_joints.iter().map(|joint| json!(joint.sites())).collect());
        let table = Table::of_rows(COLUMNS, self.impacts.iter().map(row));
        let files = self.file.fill(&table, meta)?;
        Ok((self.impacts.len(), files))
    }
}

/// Summary of the impacts of one joint with play.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Restitution {
    /// Number of impacts.
    pub impacts: usize,
    /// Undisturbed impacts among them that were no slower than the floor.
    pub undisturbed: usize,
    /// Median of effective minus requested restitution over the undisturbed impacts; `None` without any.
    pub median_excess: Option<f64>,
}

impl Restitution {
    /// Summary for joint `joint`.
    pub fn of(impacts: &[Impact], joint: usize) -> Self {
        let own = || impacts.iter().filter(|impact| impact.joint == joint);
        let clean = own().filter(|impact| !impact.disturbed && !impact.below_speed_floor);
        let mut excess: Vec<f64> = clean.map(|impact| impact.achieved() - impact.requested).collect();
        excess.sort_by(f64::total_cmp);
        let n = excess.len();
        Self {
            impacts: own().count(),
            undisturbed: n,
            median_excess: (n > 0).then(|| 0.5 * (excess[(n - 1) / 2] + excess[n / 2])),
        }
    }

    /// As an entry of the summary.
    pub fn json(&self) -> Json {
        json!({
            "finished": self.impacts,
            "undisturbed": self.undisturbed,
            "median_excess": self.median_excess,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_leaves_disturbed_and_slow_impacts_out() {
        let impact = |joint, restitution: f64, below_speed_floor, disturbed| Impact {
            joint,
            approach_speed: 0.1,
            separation_speed: 0.1 * restitution,
            requested: 0.5,
            below_speed_floor,
            disturbed,
            ..Impact::default()
        };
        let all = [
            impact(0, 0.4, false, false),
            impact(0, 0.6, false, false),
            impact(0, 0.7, false, false),
            impact(0, 0.9, true, false),
            impact(0, 0.1, false, true),
            impact(1, 0.2, false, true),
        ];
        let first = Restitution::of(&all, 0);
        assert_eq!((first.impacts, first.undisturbed), (5, 3));
        assert!((first.median_excess.unwrap() - 0.1).abs() < 1e-12);
        let even = Restitution::of(&all[..2], 0);
        assert!(even.median_excess.unwrap().abs() < 1e-12);
        assert_eq!(Restitution::of(&all, 1).median_excess, None);
    }
}
