//! A table, written row by row as CSV and as Parquet at once.

use std::{io, path::Path, sync::Arc};

use parquet::{
    basic::{LogicalType, Repetition, Type as Physical},
    column::writer::ColumnWriter,
    data_type::ByteArray,
    errors::ParquetError,
    file::{properties::WriterProperties, writer::SerializedFileWriter},
    schema::types::Type,
};
use serde_json::Value;

use crate::{
    error::{Error, Result},
    formats::output::{OpenFile, OutputFile},
};

/// Rows that are kept in memory for a Parquet file.
const ROWS: usize = 50_000;

/// What all cells of a column are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Whole numbers, at least 0.
    Whole,
    /// Numbers.
    Number,
    /// Texts.
    Text,
}

impl Kind {
    /// Of a parameter with these values: text, unless all are numbers.
    pub fn of(values: &[Value]) -> Self {
        if values.iter().all(Value::is_number) { Self::Number } else { Self::Text }
    }
}

/// What stands in a column of a row.
#[derive(Clone, Debug)]
pub enum Cell<'a> {
    /// A whole number.
    Whole(u64),
    /// A number.
    Number(f64),
    /// A text.
    Text(&'a str),
    /// The value of a parameter.
    Value(&'a Value),
    /// Nothing.
    Nothing,
}

impl Cell<'_> {
    /// A number, or nothing.
    pub fn number(value: Option<f64>) -> Self {
        value.map_or(Self::Nothing, Self::Number)
    }

    fn text(&self) -> String {
        match self {
            Self::Whole(n) => n.to_string(),
            Self::Number(v) => v.to_string(),
            Self::Text(text) => text.to_string(),
            Self::Value(Value::String(text)) => text.clone(),
            Self::Value(value) => value.to_string(),
            Self::Nothing => String::new(),
        }
    }
}

/// A table while it is written.
pub struct Table {
    name: String,
    csv: csv::Writer<OpenFile>,
    parquet: SerializedFileWriter<OpenFile>,
    columns: Vec<Column>,
}

/// The rows of a column that are not written yet, where they are not empty; and which are not.
struct Column {
    values: Values,
    present: Vec<i16>,
}

enum Values {
    Whole(Vec<i64>),
    Number(Vec<f64>),
    Text(Vec<ByteArray>),
}

impl Table {
    /// What the names of its files end with.
    pub const ENDINGS: [&str; 2] = ["csv", "parquet"];

    /// Begins a table in a folder. No two columns have one name.
    pub fn create(folder: &Path, name: &str, columns: Vec<(String, Kind)>) -> Result<Self> {
        let [csv, parquet] = Self::ENDINGS
            .map(|ending| OutputFile::create(&folder.join(format!("{name}.{ending}"))));
        let (csv, parquet) = (csv?.open()?, parquet?.open()?);
        let name = folder.join(name).display().to_string();
        let mut csv = csv::Writer::from_writer(csv);
        csv.write_record(columns.iter().map(|(name, _)| name))
            .map_err(|e| unwritten(&name, e.into()))?;
        let parquet = begin(parquet, &columns).map_err(|e| unwritten(&name, io(e)))?;
        let columns = columns.into_iter().map(|(_, kind)| Column::new(kind)).collect();
        Ok(Self { name, csv, parquet, columns })
    }

    /// Adds a row: a cell for each column.
    pub fn row(&mut self, cells: &[Cell]) -> Result<()> {
        let written = self.csv.write_record(cells.iter().map(Cell::text));
        written.map_err(|e| unwritten(&self.name, e.into()))?;
        self.columns.iter_mut().zip(cells).for_each(|(column, cell)| column.push(cell));
        match self.columns[0].present.len() {
            ROWS.. => self.write_group(),
            _ => Ok(()),
        }
    }

    /// Puts its files in their places.
    pub fn finish(mut self) -> Result<()> {
        self.write_group()?;
        let Self { name, csv, parquet, .. } = self;
        let csv = csv.into_inner().map_err(|e| unwritten(&name, e.into_error()))?;
        let parquet = parquet.into_inner().map_err(|e| unwritten(&name, io(e)))?;
        parquet.finish(Ok(()))?;
        csv.finish(Ok(()))
    }

    fn write_group(&mut self) -> Result<()> {
        let columns = &mut self.columns;
        let mut write = || {
            let mut group = self.parquet.next_row_group()?;
            for column in columns.iter_mut() {
                let Some(mut writer) = group.next_column()? else { break };
                column.write(writer.untyped())?;
                writer.close()?;
            }
            group.close().map(drop)
        };
        write().map_err(|e| unwritten(&self.name, io(e)))
    }
}

fn begin(
    file: OpenFile,
    columns: &[(String, Kind)],
) -> std::result::Result<SerializedFileWriter<OpenFile>, ParquetError> {
    let field = |(name, kind): &(String, Kind)| {
        let (physical, logical) = match kind {
            Kind::Whole => (Physical::INT64, Some(LogicalType::integer(64, false))),
            Kind::Number => (Physical::DOUBLE, None),
            Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let field = Type::primitive_type_builder(name, physical);
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
            Kind::Text => Values::Text(Vec::new()),
        };
        Self { values, present: Vec::new() }
    }

    fn push(&mut self, cell: &Cell) {
        let number = match cell {
            Cell::Whole(n) => Some(*n as f64),
            Cell::Number(v) => Some(*v),
            Cell::Value(value) => value.as_f64(),
            Cell::Text(_) | Cell::Nothing => None,
        };
        let there = match (&mut self.values, cell) {
            (_, Cell::Nothing) => false,
            // the bits of an unsigned number, as the column says
            (Values::Whole(values), Cell::Whole(n)) => {
                values.push(*n as i64);
                true
            }
            (Values::Whole(_), _) => false,
            (Values::Number(values), _) => {
                values.extend(number);
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
            (Values::Text(values), ColumnWriter::ByteArrayColumnWriter(writer)) => {
                writer.write_batch(&std::mem::take(values), Some(&present), None)?;
            }
            _ => return Err(ParquetError::General("a column of another kind".into())),
        }
        Ok(())
    }
}

fn io(e: ParquetError) -> io::Error {
    io::Error::other(e)
}

fn unwritten(name: &str, e: io::Error) -> Error {
    Error::run(name, format!("cannot be written: {e}"))
}
