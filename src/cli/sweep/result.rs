//! A sweep's result as a file: an archive with one array per quantity, or a table with one row per point.

use std::path::Path;

use serde_json::{Map, Value as Json};

use crate::analysis::axis::Axis;
use crate::analysis::sweep::Sweep;
use crate::analysis::sweep_settings::unit_suffix;
use crate::cli::Failure;
use crate::cli::output::{Column, RowFormat, RowsFile, axis_column, fill_archive};
use crate::files::{OutputFile, publish};

/// A computed sweep.
pub struct SweepResult<'a> {
    /// The sweep.
    pub sweep: &'a Sweep,
    /// Its settings.
    pub meta: Map<String, Json>,
    /// One record per point.
    pub records: &'a [f64],
}

/// The file to be written, claimed before the sweep runs.
pub enum Target {
    /// All arrays.
    Archive(OutputFile),
    /// A table of the points.
    Points(RowsFile),
}

impl Target {
    /// Checks that `path` can be written.
    ///
    /// # Errors
    /// An unknown extension, an existing file without `force`, or an unwritable folder.
    pub fn claim(path: &Path, force: bool) -> Result<Self, Failure> {
        match RowFormat::of(path) {
            Ok(RowFormat::Npz) => Ok(Self::Archive(OutputFile::claim(path, force)?)),
            Ok(RowFormat::Csv) => Ok(Self::Points(RowsFile::claim(path, force)?)),
            _ => Err(Failure::usage(format!(
                "--out {}: a sweep is written as a NumPy archive or as a table of points; use the extension .npz or .csv",
                path.display()
            ))),
        }
    }
}

impl SweepResult<'_> {
    /// All values of the array called `name`, points in order; none if there is no such array.
    pub fn values(&self, name: &str) -> Vec<f64> {
        let column = self.sweep.layout().columns().iter().position(|column| column.name == name);
        column.map_or_else(Vec::new, |column| self.values_of(column))
    }

    fn values_of(&self, column: usize) -> Vec<f64> {
        let layout = self.sweep.layout();
        let (first, count) = (layout.offset(column), layout.values_in(&layout.columns()[column]));
        let records = self.records.chunks_exact(layout.record_length());
        records.flat_map(|record| &record[first..first + count]).copied().collect()
    }

    /// Arrays over the points; those over sections only if `with_sections`.
    fn arrays(&self, with_sections: bool) -> impl Iterator<Item = Column> + '_ {
        let layout = self.sweep.layout();
        let columns =
            layout.columns().iter().enumerate().filter(move |(_, column)| with_sections || !column.per_section);
        columns.map(move |(k, column)| {
            let (values, mut shape) = (self.values_of(k), self.sweep.design().shape());
            shape.extend(column.per_section.then_some(layout.kept()));
            let array = match column.whole {
                true => Column::whole(&column.name, values.iter().map(|value| *value as i64).collect()),
                false => Column::numbers(&column.name, values),
            };
            array.shaped(shape)
        })
    }

    /// Writes the file.
    ///
    /// # Errors
    /// A file system error; an existing file is then unchanged.
    pub fn write(&self, target: Target) -> Result<(), Failure> {
        let design = self.sweep.design();
        let has_starts = design.starts().len() > 1;
        let files = match target {
            Target::Archive(file) => {
                let starts = design.starts().iter().map(|start| start.word());
                let starts = has_starts.then(|| Column::words("start", starts));
                let axes = design.axes().iter().map(|axis| axis_column(axis, axis.key(), 0..axis.count()));
                vec![fill_archive(file, starts.into_iter().chain(axes).chain(self.arrays(true)), &self.meta)?]
            }
            Target::Points(file) => {
                let points = || 0..design.points();
                let starts =
                    has_starts.then(|| Column::words("start", points().map(|point| design.start(point).word())));
                let setting = |(a, axis): (usize, &Axis)| {
                    let name = format!("{}{}", axis.key(), unit_suffix(self.sweep.scene(), axis));
                    axis_column(axis, &name, points().map(|point| design.indices(point)[a]))
                };
                let settings = design.axes().iter().enumerate().map(setting);
                file.fill(&starts.into_iter().chain(settings).chain(self.arrays(false)).collect(), self.meta.clone())?
            }
        };
        Ok(publish(files)?)
    }
}
