//! A table of numbers as a Parquet file, written one row group at a time.

use crate::layout::{Record, Value};
use parquet::{
    basic::{Compression, LogicalType, Repetition, Type as Physical},
    data_type::{BoolType, DoubleType, Int64Type},
    errors::Result,
    file::{properties::WriterProperties, writer::SerializedFileWriter},
    schema::types::Type,
};
use std::{fs::File, path::Path, sync::Arc};

/// Rows per group: half a minute of ticks, some megabytes.
const GROUP: usize = 32_768;

/// One column's values until the group is full.
enum Column {
    F64(Vec<f64>),
    U64(Vec<i64>),
    Bool(Vec<bool>),
}

pub(super) struct ParquetTable {
    writer: SerializedFileWriter<File>,
    columns: Vec<Column>,
    n_rows: usize,
}

impl ParquetTable {
    /// `lead` are names of columns of real numbers before those of the record.
    pub(super) fn create<R: Record>(path: &Path, lead: &[&str]) -> Result<Self> {
        let mut values = vec![Value::F64(0.0); lead.len()];
        R::default().values(&mut values);
        let names = (lead.iter().map(|&name| name.to_owned())).chain(R::columns());
        let fields = (names.zip(&values))
            .map(|(name, value)| {
                let (physical, logical) = match value {
                    Value::F64(_) => (Physical::DOUBLE, None),
                    Value::Bool(_) => (Physical::BOOLEAN, None),
                    Value::U64(_) => (Physical::INT64, Some(LogicalType::integer(64, false))),
                };
                let field = Type::primitive_type_builder(&name, physical)
                    .with_repetition(Repetition::REQUIRED)
                    .with_logical_type(logical)
                    .build()?;
                Ok(Arc::new(field))
            })
            .collect::<Result<_>>()?;
        let schema = Type::group_type_builder(R::NAME)
            .with_fields(fields)
            .build()?;
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .build();
        let writer =
            SerializedFileWriter::new(File::create(path)?, Arc::new(schema), Arc::new(properties))?;
        let columns = values
            .iter()
            .map(|value| match value {
                Value::F64(_) => Column::F64(Vec::new()),
                Value::U64(_) => Column::U64(Vec::new()),
                Value::Bool(_) => Column::Bool(Vec::new()),
            })
            .collect();
        Ok(Self {
            writer,
            columns,
            n_rows: 0,
        })
    }

    pub(super) fn add(&mut self, values: &[Value]) -> Result<()> {
        for (column, value) in self.columns.iter_mut().zip(values) {
            match (column, value) {
                (Column::F64(all), Value::F64(v)) => all.push(*v),
                // The bits stay the same; the logical type marks them as unsigned.
                (Column::U64(all), Value::U64(v)) => all.push(v.cast_signed()),
                (Column::Bool(all), Value::Bool(v)) => all.push(*v),
                _ => unreachable!("a record's values have the same types each time"),
            }
        }
        self.n_rows += 1;
        if self.n_rows == GROUP {
            self.write_group()
        } else {
            Ok(())
        }
    }

    pub(super) fn finish(mut self) -> Result<()> {
        self.write_group()?;
        self.writer.close().map(drop)
    }

    fn write_group(&mut self) -> Result<()> {
        if self.n_rows == 0 {
            return Ok(());
        }
        let mut group = self.writer.next_row_group()?;
        for column in &mut self.columns {
            let Some(mut writer) = group.next_column()? else {
                break;
            };
            match column {
                Column::F64(all) => {
                    writer.typed::<DoubleType>().write_batch(all, None, None)?;
                    all.clear();
                }
                Column::U64(all) => {
                    writer.typed::<Int64Type>().write_batch(all, None, None)?;
                    all.clear();
                }
                Column::Bool(all) => {
                    writer.typed::<BoolType>().write_batch(all, None, None)?;
                    all.clear();
                }
            }
            writer.close()?;
        }
        group.close()?;
        self.n_rows = 0;
        Ok(())
    }
}
