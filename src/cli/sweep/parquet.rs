//! A sweep's result as a Parquet table: the columns of the CSV table at full precision, and `meta` among the metadata of the file.

use std::io::{self, Write};
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use serde_json::Value as Json;

use super::archive::{Archive, AxisValues, Source};
use crate::cli::Failure;
use crate::files::PROGRAM;

/// Writes one row per point, one column in memory at a time.
///
/// # Errors
/// Those of `out`; an error of `source` is stored in `failure`.
pub(super) fn write(
    out: &mut (impl Write + Send),
    archive: &Archive,
    source: &mut impl Source,
    failure: &mut Option<Failure>,
) -> io::Result<()> {
    let meta = Json::Object(archive.meta().clone()).to_string();
    let properties = WriterProperties::builder()
        .set_created_by(format!("{PROGRAM} {}", crate::VERSION))
        .set_key_value_metadata(Some(vec![KeyValue::new("meta".to_owned(), meta)]));
    let schema = schema(archive).map_err(as_io)?;
    let file = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties.build()));
    let mut file = file.map_err(as_io)?;
    let mut rows = file.next_row_group().map_err(as_io)?;
    let points = || 0..archive.count();
    let word = |word: &str| ByteArray::from(word);
    if !archive.starts().is_empty() {
        let starts: Vec<ByteArray> = points().map(|point| word(&archive.starts()[archive.indices(point).0])).collect();
        add::<ByteArrayType, _>(&mut rows, &starts)?;
    }
    for (k, axis) in archive.axes().iter().enumerate() {
        let index = |point: usize| archive.indices(point).1[k];
        match &axis.values {
            AxisValues::Numbers(values) => {
                let values: Vec<f64> = points().map(|point| values[index(point)]).collect();
                add::<DoubleType, _>(&mut rows, &values)?;
            }
            AxisValues::Words(words) => {
                let words: Vec<ByteArray> = points().map(|point| word(&words[index(point)].0)).collect();
                add::<ByteArrayType, _>(&mut rows, &words)?;
            }
        }
    }
    for column in archive.columns().iter().filter(|column| !column.per_section) {
        let values = archive.values(&column.name, source).map_err(|error| {
            let text = error.message.clone();
            *failure = Some(error);
            io::Error::other(text)
        })?;
        if column.whole {
            let values: Vec<i64> = values.iter().map(|value| *value as i64).collect();
            add::<Int64Type, _>(&mut rows, &values)?;
        } else {
            add::<DoubleType, _>(&mut rows, &values)?;
        }
    }
    rows.close().map_err(as_io)?;
    file.close().map_err(as_io)?;
    Ok(())
}

/// Names and types of the columns; every value is present.
fn schema(archive: &Archive) -> Result<Type, ParquetError> {
    let column = |name: &str, physical: Physical| {
        let words = physical == Physical::BYTE_ARRAY;
        let column = Type::primitive_type_builder(name, physical).with_repetition(Repetition::REQUIRED);
        column.with_logical_type(words.then_some(LogicalType::String)).build().map(Arc::new)
    };
    let starts = archive.starts().iter().take(1).map(|_| column("start", Physical::BYTE_ARRAY));
    let axes = archive.axes().iter().map(|axis| match axis.values {
        AxisValues::Numbers(_) => column(&format!("{}{}", axis.key, axis.unit), Physical::DOUBLE),
        AxisValues::Words(_) => column(&axis.key, Physical::BYTE_ARRAY),
    });
    let single = archive.columns().iter().filter(|column| !column.per_section);
    let single = single.map(|of| column(&of.name, if of.whole { Physical::INT64 } else { Physical::DOUBLE }));
    let fields = starts.chain(axes).chain(single).collect::<Result<Vec<_>, _>>()?;
    Type::group_type_builder("sweep").with_fields(fields).build()
}

/// Writes the next column.
fn add<T: DataType<T = V>, V>(
    rows: &mut SerializedRowGroupWriter<'_, impl Write + Send>,
    values: &[V],
) -> io::Result<()> {
    if let Some(mut column) = rows.next_column().map_err(as_io)? {
        column.typed::<T>().write_batch(values, None, None).map_err(as_io)?;
        column.close().map_err(as_io)?;
    }
    Ok(())
}

fn as_io(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(error) => io::Error::other(error),
        other => io::Error::other(other),
    }
}
