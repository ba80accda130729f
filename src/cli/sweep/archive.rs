//! A sweep's result as a NumPy archive: one array per quantity, the varied values, and `meta`.

use std::io;

use ndarray::Array1;
use serde_json::{Map, Value as Json, json};

use super::options::Shard;
use super::word::Word;
use crate::analysis::axis::Axis;
use crate::analysis::design::Arrangement;
use crate::analysis::layout::Column;
use crate::analysis::sweep::Sweep;
use crate::cli::Failure;
use crate::cli::output::{add_array, as_io, write_archive};
use crate::files::OutputFile;
use crate::scene::{Kind, Scene};
use crate::units::si_unit;

/// Source of an archive's numbers.
pub trait Source {
    /// Writes `length` values of each point's record, starting at `offset`, to `out`, points in the archive's order.
    ///
    /// # Errors
    /// Input/output.
    fn gather(&mut self, offset: usize, length: usize, out: &mut [f64]) -> Result<(), Failure>;
}

/// Values of a varied parameter, SI or words.
pub enum AxisValues {
    /// Numbers, SI.
    Numbers(Vec<f64>),
    /// Words.
    Words(Vec<Word>),
}

impl AxisValues {
    fn len(&self) -> usize {
        match self {
            Self::Numbers(values) => values.len(),
            Self::Words(words) => words.len(),
        }
    }
}

/// A varied parameter.
pub struct ArchivedAxis {
    /// Key.
    pub key: String,
    /// SI unit as a suffix of a column's name, such as `_m`; empty for a pure number or a word.
    pub unit: String,
    /// Its values.
    pub values: AxisValues,
}

/// An archive to be written: its description, without the numbers.
pub struct Archive {
    meta: Map<String, Json>,
    axes: Vec<ArchivedAxis>,
    zipped: bool,
    /// Words of the starts, if there are several.
    starts: Vec<String>,
    columns: Vec<Column>,
    kept: usize,
    /// Points of a shard; `None` in a whole sweep.
    points: Option<Vec<usize>>,
}

/// Key in `meta` that only shards have.
pub const SHARD: &str = "shard";
/// Word for zipped axes in `meta`.
pub const ZIPPED: &str = "zipped";

impl Archive {
    /// The archive of a sweep or of one shard of it.
    pub fn of_sweep(mut meta: Map<String, Json>, sweep: &Sweep, shard: Option<&Shard>) -> Self {
        let design = sweep.design();
        let layout = sweep.layout();
        let axes = design.axes().iter().map(|axis| ArchivedAxis {
            key: axis.key().to_owned(),
            unit: unit_suffix(sweep.scene(), axis),
            values: match axis.words() {
                Some(words) => AxisValues::Words(words.into_iter().map(|word| Word(word.to_owned())).collect()),
                None => AxisValues::Numbers(axis.numbers().collect()),
            },
        });
        let columns = layout
            .columns()
            .iter()
            .map(|column| json!({"name": column.name, "whole": column.whole, "per_section": column.per_section}));
        meta.insert("kept".into(), json!(layout.kept()));
        meta.insert("arrays".into(), Json::Array(columns.collect()));
        let points = shard.map(|shard| {
            meta.insert(SHARD.into(), json!(shard.to_string()));
            let blocks = (0..design.blocks()).filter(|&b| shard.has(b));
            blocks.flat_map(|b| design.block(b)).collect()
        });
        Self {
            zipped: design.arrangement() == Arrangement::Zipped,
            starts: starts_of(&meta),
            meta,
            axes: axes.collect(),
            columns: layout.columns().to_vec(),
            kept: layout.kept(),
            points,
        }
    }

    /// The archive of a whole sweep, described by the `meta` of its shards; `None` if `meta` is not that of a sweep.
    pub fn of_meta(meta: Map<String, Json>, axes: Vec<ArchivedAxis>) -> Option<Self> {
        let kept = usize::try_from(meta.get("kept")?.as_u64()?).ok()?;
        let column = |array: &Json| {
            Some(Column {
                name: array.get("name")?.as_str()?.to_owned(),
                whole: array.get("whole")?.as_bool()?,
                per_section: array.get("per_section")?.as_bool()?,
            })
        };
        let columns = meta.get("arrays")?.as_array()?.iter().map(column);
        Some(Self {
            columns: columns.collect::<Option<Vec<_>>>()?,
            zipped: meta.get("arrangement")?.as_str()? == ZIPPED,
            starts: starts_of(&meta),
            meta,
            axes,
            kept,
            points: None,
        })
    }

    /// Varied parameters.
    pub fn axes(&self) -> &[ArchivedAxis] {
        &self.axes
    }

    /// Words of the starts; empty if there is only one.
    pub fn starts(&self) -> &[String] {
        &self.starts
    }

    /// Arrays in order.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Shape of an array with one value per point.
    fn shape(&self) -> Vec<usize> {
        if let Some(points) = &self.points {
            return vec![points.len()];
        }
        let starts = (!self.starts.is_empty()).then_some(self.starts.len());
        starts.into_iter().chain(self.counts()).collect()
    }

    /// Number of values along each independent direction.
    fn counts(&self) -> impl DoubleEndedIterator<Item = usize> {
        let independent = if self.zipped { 1 } else { self.axes.len() };
        self.axes[..independent.min(self.axes.len())].iter().map(|axis| axis.values.len())
    }

    /// Index of the start of a point of the whole sweep, and its index along each axis.
    pub fn indices(&self, point: usize) -> (usize, Vec<usize>) {
        let mut rest = point;
        let mut indices: Vec<usize> = Vec::new();
        for count in self.counts().rev() {
            indices.insert(0, rest % count);
            rest /= count;
        }
        if self.zipped {
            indices = vec![indices[0]; self.axes.len()];
        }
        (rest, indices)
    }

    /// Provenance.
    pub fn meta(&self) -> &Map<String, Json> {
        &self.meta
    }

    /// Number of points.
    pub fn count(&self) -> usize {
        self.shape().into_iter().product()
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
                if !self.starts.is_empty() {
                    let starts: Array1<Word> = self.starts.iter().map(|word| Word(word.clone())).collect();
                    archive.add_array("start", &starts).map_err(as_io)?;
                }
                for axis in &self.axes {
                    let written = match &axis.values {
                        AxisValues::Numbers(values) => archive.add_array(&*axis.key, &Array1::from(values.clone())),
                        AxisValues::Words(words) => archive.add_array(&*axis.key, &Array1::from(words.clone())),
                    };
                    written.map_err(as_io)?;
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
                    let mut shape = self.shape();
                    if column.per_section {
                        shape.push(self.kept);
                    }
                    if column.whole {
                        let whole = values.iter().map(|value| *value as i64).collect();
                        add_array(archive, &column.name, shape, whole)?;
                    } else {
                        add_array(archive, &column.name, shape, values)?;
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

/// Words of the starts of a sweep with several.
fn starts_of(meta: &Map<String, Json>) -> Vec<String> {
    let words = meta.get("start").and_then(Json::as_array).into_iter().flatten();
    words.filter_map(|word| word.as_str().map(str::to_owned)).collect()
}

/// SI unit of the values of `axis`, as a suffix: `_m`, `_rad_s`.
pub(super) fn unit_suffix(scene: &Scene, axis: &Axis) -> String {
    let unit = match scene.parameter(axis.key()).map(|parameter| parameter.kind) {
        Ok(Kind::Number { dimension, .. }) => si_unit(dimension),
        _ => "",
    };
    let unit = unit.replace([' ', '^'], "").replace('/', "_");
    if unit.is_empty() { unit } else { format!("_{unit}") }
}
