//! Results as Parquet, with typed columns.

use std::path::Path;
use std::sync::Arc;

use anyhow::Context;
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use report::files::Pending;

use super::columns::{Column, Kind};
use super::results::CSV;

const NAME: &str = "results.parquet";
/// Rows that are in memory at a time.
const ROWS: usize = 8_192;

/// Writes `results.parquet` beside `results.csv`.
///
/// # Errors
/// If `results.csv` cannot be read or the file cannot be written.
pub fn write(dir: &Path, columns: &[Column]) -> anyhow::Result<()> {
    let mut parquet = Pending::create(dir, NAME)?;
    convert(&dir.join(CSV), &mut parquet, columns)
        .with_context(|| format!("{}: cannot write", dir.join(NAME).display()))?;
    parquet.finish()
}

fn convert(csv: &Path, parquet: &mut Pending, columns: &[Column]) -> anyhow::Result<()> {
    let mut reader = csv::Reader::from_path(csv)?;
    let fields = columns.iter().map(field).collect::<anyhow::Result<_>>()?;
    let schema = Type::group_type_builder("sweep")
        .with_fields(fields)
        .build()?;
    let properties = Arc::new(WriterProperties::builder().build());
    let mut writer = SerializedFileWriter::new(parquet, Arc::new(schema), properties)?;
    let mut records = reader.records();
    loop {
        let rows = records.by_ref().take(ROWS).collect::<Result<Vec<_>, _>>()?;
        if rows.is_empty() {
            break;
        }
        let mut group = writer.next_row_group()?;
        for (n, column) in columns.iter().enumerate() {
            let values = rows.iter().map(|row| &row[n]);
            write_column(&mut group, column, values)
                .with_context(|| format!("column {}", column.name))?;
        }
        group.close()?;
    }
    writer.close()?;
    Ok(())
}

fn field(column: &Column) -> anyhow::Result<Arc<Type>> {
    let (physical, logical, repetition) = match column.kind {
        Kind::Integer => (Physical::INT64, None, Repetition::REQUIRED),
        Kind::Number => (Physical::DOUBLE, None, Repetition::OPTIONAL),
        Kind::Text => (
            Physical::BYTE_ARRAY,
            Some(LogicalType::String),
            Repetition::OPTIONAL,
        ),
    };
    let field = Type::primitive_type_builder(&column.name, physical)
        .with_logical_type(logical)
        .with_repetition(repetition)
        .build()?;
    Ok(Arc::new(field))
}

/// An empty field is a missing value.
fn write_column<'a>(
    group: &mut SerializedRowGroupWriter<&mut Pending>,
    column: &Column,
    values: impl Iterator<Item = &'a str> + Clone,
) -> anyhow::Result<()> {
    let mut writer = group
        .next_column()?
        .context("more columns than in the schema")?;
    let there: Vec<i16> = values
        .clone()
        .map(|text| i16::from(!text.is_empty()))
        .collect();
    let full = values.filter(|text| !text.is_empty());
    match column.kind {
        Kind::Integer => {
            let values = full.map(str::parse).collect::<Result<Vec<i64>, _>>()?;
            writer
                .typed::<Int64Type>()
                .write_batch(&values, None, None)?;
        }
        Kind::Number => {
            let values = full.map(str::parse).collect::<Result<Vec<f64>, _>>()?;
            writer
                .typed::<DoubleType>()
                .write_batch(&values, Some(&there), None)?;
        }
        Kind::Text => {
            let values: Vec<ByteArray> = full.map(ByteArray::from).collect();
            writer
                .typed::<ByteArrayType>()
                .write_batch(&values, Some(&there), None)?;
        }
    }
    Ok(writer.close()?)
}
