//! A sweep's result as a table: one row per point with its settings and its single values. Arrays over sections are left out.

use std::io::{self, Write};

use super::archive::{Archive, AxisValues, Source};
use crate::cli::Failure;
use crate::cli::output::significant;
use crate::cli::tables::quoted;

/// Largest number of values in memory, 64 MiB.
const MAX_VALUES_IN_MEMORY: usize = 1 << 23;

/// Writes header and rows.
///
/// # Errors
/// Those of `out`; an error of `source` is stored in `failure`.
pub(super) fn write(
    out: &mut impl Write,
    archive: &Archive,
    source: &mut impl Source,
    failure: &mut Option<Failure>,
) -> io::Result<()> {
    let starts = archive.starts();
    let single: Vec<&str> = archive.columns().iter().filter(|c| !c.per_section).map(|c| &c.name[..]).collect();
    let keys = archive.axes().iter().map(|axis| quoted(&format!("{}{}", axis.key, axis.unit)));
    let heads = starts.iter().take(1).map(|_| "start".to_owned()).chain(keys);
    let heads: Vec<String> = heads.chain(single.iter().map(|name| quoted(name))).collect();
    writeln!(out, "{}", heads.join(","))?;
    let rows_per_chunk = (MAX_VALUES_IN_MEMORY / single.len().max(1)).max(1);
    for first in (0..archive.count()).step_by(rows_per_chunk) {
        let rows = first..(first + rows_per_chunk).min(archive.count());
        let mut columns = Vec::new();
        for name in &single {
            let values = archive.values(name, source).map_err(|error| {
                let text = error.message.clone();
                *failure = Some(error);
                io::Error::other(text)
            })?;
            columns.push(values[rows.clone()].to_vec());
        }
        for point in rows {
            let (start, indices) = archive.indices(point);
            let settings = archive.axes().iter().zip(indices).map(|(axis, i)| match &axis.values {
                AxisValues::Numbers(values) => significant(values[i], 12),
                AxisValues::Words(words) => quoted(&words[i].0),
            });
            let values = columns.iter().map(|values| significant(values[point - first], 12));
            let cells: Vec<String> = starts.get(start).cloned().into_iter().chain(settings).chain(values).collect();
            writeln!(out, "{}", cells.join(","))?;
        }
    }
    Ok(())
}
