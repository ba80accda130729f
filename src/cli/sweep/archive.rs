//! A sweep's result as a NumPy archive: one array per quantity, the varied values, and `meta`.

use std::io;
use std::path::Path;

use ndarray::{Array1, ArrayD, IxDyn};
use ndarray_npy::NpzWriter;
use serde_json::{Map, Value as Json, json};

use super::options::Shard;
use crate::analysis::layout::Column;
use crate::analysis::sweep::Sweep;
use crate::cli::Failure;
use crate::cli::output::{as_io, write_archive};
use crate::files::OutputFile;

/// Source of an archive's numbers.
pub trait Source {
    /// Writes `length` values of each point's record, starting at `offset`, to `out`, points in the archive's order.
    ///
    /// # Errors
    /// Input/output.
    fn gather(&mut self, offset: usize, length: usize, out: &mut [f64]) -> Result<(), Failure>;
}

/// An archive to be written: its description, without the numbers.
pub struct Archive {
    meta: Map<String, Json>,
    /// Key and values of each varied parameter.
    axes: Vec<(String, Vec<f64>)>,
    columns: Vec<Column>,
    kept: usize,
    /// Points of a shard; `None` in a whole sweep.
    points: Option<Vec<usize>>,
}

/// Key in `meta` that only shards have.
pub const SHARD: &str = "shard";

/// Rejects a name that readers would not recognise as a NumPy archive.
///
/// # Errors
/// Usage.
pub fn check_ending(path: &Path) -> Result<(), Failure> {
    let npz = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("npz"));
    if npz {
        return Ok(());
    }
    Err(Failure::usage(format!(
        "--out {}: a sweep is written as a NumPy archive; use the extension .npz",
        path.display()
    )))
}

impl Archive {
    /// The archive of a sweep or of one shard of it.
    pub fn of_sweep(mut meta: Map<String, Json>, sweep: &Sweep, shard: Option<&Shard>) -> Self {
        let grid = sweep.grid();
        let layout = sweep.layout();
        let axes = grid.axes().iter();
        let axes = axes.map(|axis| (axis.key().to_owned(), axis.values().collect()));
        let columns = layout
            .columns()
            .iter()
            .map(|column| json!({"name": column.name, "whole": column.whole, "per_section": column.per_section}));
        meta.insert("kept".into(), json!(layout.kept()));
        meta.insert("arrays".into(), Json::Array(columns.collect()));
        let points = shard.map(|shard| {
            meta.insert(SHARD.into(), json!(shard.to_string()));
            let blocks = (0..grid.blocks()).filter(|&b| shard.has(b));
            blocks.flat_map(|b| grid.block(b)).collect()
        });
        Self { meta, axes: axes.collect(), columns: layout.columns().to_vec(), kept: layout.kept(), points }
    }

    /// The archive of a whole sweep as its shards describe it; `None` if `meta` is not that of a sweep.
    pub fn of_meta(meta: Map<String, Json>, axes: Vec<(String, Vec<f64>)>) -> Option<Self> {
        let kept = usize::try_from(meta.get("kept")?.as_u64()?).ok()?;
        let column = |array: &Json| {
            Some(Column {
                name: array.get("name")?.as_str()?.to_owned(),
                whole: array.get("whole")?.as_bool()?,
                per_section: array.get("per_section")?.as_bool()?,
            })
        };
        let columns = meta.get("arrays")?.as_array()?.iter().map(column);
        Some(Self { columns: columns.collect::<Option<Vec<_>>>()?, meta, axes, kept, points: None })
    }

    /// Provenance.
    pub fn meta(&self) -> &Map<String, Json> {
        &self.meta
    }

    /// Number of points.
    pub fn count(&self) -> usize {
        match &self.points {
            Some(points) => points.len(),
            None => self.axes.iter().map(|(_, values)| values.len()).product(),
        }
    }

    /// Name of each array, whether it holds integers, and its number of values per point.
    pub fn names(&self) -> Vec<(String, bool, usize)> {
        let columns = self.columns.iter();
        columns.map(|c| (c.name.clone(), c.whole, self.length(c))).collect()
    }

    /// All values of the array called `name`; empty if there is none.
    ///
    /// # Errors
    /// As [`Source::gather`].
    pub fn values(&self, name: &str, source: &mut impl Source) -> Result<Vec<f64>, Failure> {
        let Some(at) = self.columns.iter().position(|column| column.name == name) else {
            return Ok(Vec::new());
        };
        let offset = self.columns[..at].iter().map(|c| self.length(c)).sum();
        let length = self.length(&self.columns[at]);
        let mut values = vec![f64::NAN; self.count() * length];
        source.gather(offset, length, &mut values)?;
        Ok(values)
    }

    /// Number of values per point in a column.
    fn length(&self, column: &Column) -> usize {
        if column.per_section { self.kept } else { 1 }
    }

    /// Writes the file, one array in memory at a time.
    ///
    /// # Errors
    /// A file system error; an existing file is then unchanged.
    pub fn write(&self, target: OutputFile, source: &mut impl Source) -> Result<(), Failure> {
        let mut failure = None;
        let written = target.write(|file| {
            write_archive(*file.get_ref(), |archive| {
                for (key, values) in &self.axes {
                    let values = Array1::from(values.clone());
                    archive.add_array(key.as_str(), &values).map_err(as_io)?;
                }
                if let Some(points) = &self.points {
                    let points: Array1<i64> = points.iter().map(|&point| point as i64).collect();
                    archive.add_array("point", &points).map_err(as_io)?;
                }
                for column in &self.columns {
                    let values = self.values(&column.name, source).map_err(|error| {
                        let text = error.message.clone();
                        failure = Some(error);
                        io::Error::other(text)
                    })?;
                    let mut shape = match &self.points {
                        Some(points) => vec![points.len()],
                        None => self.axes.iter().map(|(_, values)| values.len()).collect(),
                    };
                    if column.per_section {
                        shape.push(self.kept);
                    }
                    if column.whole {
                        let whole = values.iter().map(|value| *value as i64).collect();
                        add(archive, &column.name, shape, whole)?;
                    } else {
                        add(archive, &column.name, shape, values)?;
                    }
                }
                let meta = Json::Object(self.meta.clone()).to_string();
                let meta = Array1::from(meta.into_bytes());
                archive.add_array("meta", &meta).map_err(as_io)
            })
        });
        match failure {
            Some(failure) => Err(failure),
            None => Ok(written?),
        }
    }
}

fn add<W: io::Write + io::Seek, T: ndarray_npy::WritableElement>(
    archive: &mut NpzWriter<W>,
    name: &str,
    shape: Vec<usize>,
    values: Vec<T>,
) -> io::Result<()> {
    let array = ArrayD::from_shape_vec(IxDyn(&shape), values).map_err(io::Error::other)?;
    archive.add_array(name, &array).map_err(as_io)
}
