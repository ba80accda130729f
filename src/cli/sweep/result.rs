//! A sweep's result as a file: a NumPy archive with one array per quantity, or a table with one row per point.

use std::io::{self, Write};
use std::path::Path;

use ndarray::Array1;
use serde_json::{Map, Value as Json};

use crate::analysis::axis::Axis;
use crate::analysis::sweep::Sweep;
use crate::analysis::sweep_settings::unit_suffix;
use crate::cli::Failure;
use crate::cli::output::{
    ChecksumWriter, add_array, add_axis, add_words, as_io, claim_metadata, significant, write_archive, write_meta,
};
use crate::cli::tables::quoted;
use crate::files::{FileError, OutputFile, PendingFile, publish};

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
    Npz(OutputFile),
    /// A table of the points, with the metadata in a file of its own.
    Csv(OutputFile, OutputFile),
}

impl Target {
    /// Checks that `path` can be written.
    ///
    /// # Errors
    /// An unknown extension, an existing file without `force`, or an unwritable folder.
    pub fn claim(path: &Path, force: bool) -> Result<Self, Failure> {
        let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default();
        match &*extension.to_ascii_lowercase() {
            "npz" => Ok(Self::Npz(OutputFile::claim(path, force)?)),
            "csv" => Ok(Self::Csv(OutputFile::claim(path, force)?, claim_metadata(path, force)?)),
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
        column.map_or_else(Vec::new, |column| self.column(column))
    }

    fn column(&self, column: usize) -> Vec<f64> {
        let layout = self.sweep.layout();
        let (first, count) = (layout.offset(column), layout.values_in(&layout.columns()[column]));
        let records = self.records.chunks_exact(layout.record_length());
        records.flat_map(|record| &record[first..first + count]).copied().collect()
    }

    /// Words of the starts, if there are several.
    fn starts(&self) -> Vec<&'static str> {
        let starts = self.sweep.design().starts();
        starts.iter().map(|start| start.word()).filter(|_| starts.len() > 1).collect()
    }

    /// Writes the file.
    ///
    /// # Errors
    /// A file system error; an existing file is then unchanged.
    pub fn write(&self, target: Target) -> Result<(), Failure> {
        match target {
            Target::Npz(file) => Ok(publish(vec![self.npz(file)?])?),
            Target::Csv(rows, metadata) => {
                let mut checksum = String::new();
                let rows = rows.fill(|file| {
                    let mut file = ChecksumWriter::new(file);
                    self.csv(&mut file)?;
                    checksum = file.checksum();
                    Ok(())
                })?;
                let mut meta = self.meta.clone();
                meta.insert("rows_crc32".into(), checksum.into());
                // In this order, a kill between the two renames never leaves rows without metadata.
                Ok(publish(vec![metadata.fill(|file| write_meta(file, &meta))?, rows])?)
            }
        }
    }

    fn npz(&self, target: OutputFile) -> Result<PendingFile, FileError> {
        let (design, layout) = (self.sweep.design(), self.sweep.layout());
        target.fill(|file| {
            write_archive(*file.get_ref(), |archive| {
                if !self.starts().is_empty() {
                    add_words(archive, "start", self.starts())?;
                }
                for axis in design.axes() {
                    add_axis(archive, axis)?;
                }
                for (k, column) in layout.columns().iter().enumerate() {
                    let mut shape = design.shape();
                    shape.extend(column.per_section.then_some(layout.kept()));
                    let values = self.column(k);
                    if column.whole {
                        let whole = values.iter().map(|value| *value as i64).collect();
                        add_array(archive, &column.name, shape, whole)?;
                    } else {
                        add_array(archive, &column.name, shape, values)?;
                    }
                }
                let meta = Array1::from(serde_json::to_vec(&self.meta).map_err(io::Error::from)?);
                archive.add_array("meta", &meta).map_err(as_io)
            })
        })
    }

    /// Header and rows: settings and single values of each point. Arrays over sections are left out.
    fn csv(&self, out: &mut impl Write) -> io::Result<()> {
        let (design, layout, starts) = (self.sweep.design(), self.sweep.layout(), self.starts());
        let single = || layout.columns().iter().enumerate().filter(|(_, column)| !column.per_section);
        let key = |axis: &Axis| quoted(&format!("{}{}", axis.key(), unit_suffix(self.sweep.scene(), axis)));
        let heads = starts.iter().take(1).map(|_| "start".to_owned()).chain(design.axes().iter().map(key));
        let heads: Vec<String> = heads.chain(single().map(|(_, column)| quoted(&column.name))).collect();
        writeln!(out, "{}", heads.join(","))?;
        let words: Vec<Option<Vec<&str>>> = design.axes().iter().map(Axis::words).collect();
        let offsets: Vec<usize> = single().map(|(k, _)| layout.offset(k)).collect();
        for (point, record) in self.records.chunks_exact(layout.record_length()).enumerate() {
            let start = starts.first().map(|_| design.start(point).word().to_owned());
            let settings = design.axes().iter().zip(design.indices(point)).zip(&words);
            let settings = settings.map(|((axis, i), words)| match words {
                None => significant(axis.number(i), 12),
                Some(words) => quoted(words[i]),
            });
            let values = offsets.iter().map(|offset| significant(record[*offset], 12));
            writeln!(out, "{}", start.into_iter().chain(settings).chain(values).collect::<Vec<_>>().join(","))?;
        }
        Ok(())
    }
}
