//! Tables as Parquet files.

use std::{
    io::{self, Write},
    sync::Arc,
};

use parquet::{
    basic::{LogicalType, Repetition, Type as Physical},
    column::writer::ColumnWriter,
    data_type::ByteArray,
    errors::ParquetError,
    file::{properties::WriterProperties, writer::SerializedFileWriter},
    schema::types::Type,
};

use super::cell::{Cell, Kind};

/// Number of rows that are kept in memory before they are written.
const ROWS: usize = 50_000;

/// A table that is being written.
pub struct ParquetTable<W: Write + Send> {
    writer: SerializedFileWriter<W>,
    columns: Vec<Column>,
}

/// The rows of a column that are not written yet: the values of cells that are not empty, and for
/// each cell whether it has a value.
struct Column {
    values: Values,
    present: Vec<i16>,
}

enum Values {
    Whole(Vec<i64>),
    Number(Vec<f64>),
    Single(Vec<f32>),
    Text(Vec<ByteArray>),
}

impl<W: Write + Send> ParquetTable<W> {
    pub fn begin(file: W, columns: &[(impl AsRef<str>, Kind)]) -> io::Result<Self> {
        let writer = begin(file, columns)?;
        let columns = columns.iter().map(|(_, kind)| Column::new(*kind)).collect();
        Ok(Self { writer, columns })
    }

    pub fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        self.columns.iter_mut().zip(cells).for_each(|(column, cell)| column.push(cell));
        match self.columns[0].present.len() {
            ROWS.. => Ok(self.write_group()?),
            _ => Ok(()),
        }
    }

    /// Ends the table and returns the file with all of its rows.
    pub fn end(mut self) -> io::Result<W> {
        self.write_group()?;
        Ok(self.writer.into_inner()?)
    }

    fn write_group(&mut self) -> std::result::Result<(), ParquetError> {
        let mut group = self.writer.next_row_group()?;
        for column in &mut self.columns {
            let Some(mut writer) = group.next_column()? else { break };
            column.write(writer.untyped())?;
            writer.close()?;
        }
        group.close().map(drop)
    }
}

fn begin<W: Write + Send, N: AsRef<str>>(
    file: W,
    columns: &[(N, Kind)],
) -> std::result::Result<SerializedFileWriter<W>, ParquetError> {
    let field = |(name, kind): &(N, Kind)| {
        let (physical, logical) = match kind {
            Kind::Whole => (Physical::INT64, Some(LogicalType::integer(64, false))),
            Kind::Number => (Physical::DOUBLE, None),
            Kind::Single => (Physical::FLOAT, None),
            Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let field = Type::primitive_type_builder(name.as_ref(), physical);
        field.with_repetition(Repetition::OPTIONAL).with_logical_type(logical).build().map(Arc::new)
    };
    let fields = columns.iter().map(field).collect::<std::result::Result<_, _>>()?;
    let schema = Type::group_type_builder("table").with_fields(fields).build()?;
    let writer = format!("phylux {}", env!("CARGO_PKG_VERSION"));
    let properties = WriterProperties::builder().set_created_by(writer).build();
    SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties))
}

impl Column {
    fn new(kind: Kind) -> Self {
        let values = match kind {
            Kind::Whole => Values::Whole(Vec::new()),
            Kind::Number => Values::Number(Vec::new()),
            Kind::Single => Values::Single(Vec::new()),
            Kind::Text => Values::Text(Vec::new()),
        };
        Self { values, present: Vec::new() }
    }

    fn push(&mut self, cell: &Cell) {
        let number = match cell {
            Cell::Whole(n) => Some(*n as f64),
            Cell::Number(v) => Some(*v),
            Cell::Single(v) => Some((*v).into()),
            Cell::Value(value) => value.as_f64(),
            Cell::Text(_) | Cell::Nothing => None,
        };
        let there = match (&mut self.values, cell) {
            (_, Cell::Nothing) => false,
            // the bits of an unsigned number, as the type of the column says
            (Values::Whole(values), Cell::Whole(n)) => {
                values.push(*n as i64);
                true
            }
            (Values::Whole(_), _) => false,
            (Values::Number(values), _) => {
                values.extend(number);
                number.is_some()
            }
            (Values::Single(values), _) => {
                values.extend(number.map(|number| number as f32));
                number.is_some()
            }
            (Values::Text(values), cell) => {
                values.push(cell.text().into_bytes().into());
                true
            }
        };
        self.present.push(there.into());
    }

    fn write(&mut self, writer: &mut ColumnWriter) -> std::result::Result<(), ParquetError> {
        let present = std::mem::take(&mut self.present);
        match (&mut self.values, writer) {
            (Values::Whole(values), ColumnWriter::Int64ColumnWriter(writer)) => {
                writer.write_batch(&std::mem::take(values), Some(&present), None)?;
            }
            (Values::Number(values), ColumnWriter::DoubleColumnWriter(writer)) => {
                writer.write_batch(&std::mem::take(values), Some(&present), None)?;
            }
            (Values::Single(values), ColumnWriter::FloatColumnWriter(writer)) => {
                writer.write_batch(&std::mem::take(values), Some(&present), None)?;
            }
            (Values::Text(values), ColumnWriter::ByteArrayColumnWriter(writer)) => {
                writer.write_batch(&std::mem::take(values), Some(&present), None)?;
            }
            _ => return Err(ParquetError::General("a column of another kind".into())),
        }
        Ok(())
    }
}
