//! Reads a table of a year from Parquet.

use std::{fs::File, path::Path};

use parquet::{
    column::reader::{ColumnReader, get_typed_column_reader},
    data_type::{ByteArrayType, DataType, FloatType},
    errors::{ParquetError, Result as ParquetResult},
    file::reader::{FileReader, RowGroupReader, SerializedFileReader},
};

use super::rows::{Columns, Face, YearTable, broken};
use phylux_core::error::{Error, Result, catch_panic};

/// Number of rows that are read at once.
const ROWS: usize = 50_000;

/// Reads the Parquet file at `path`. Errors: the file cannot be read, or is not a table of a year.
pub fn read(path: &Path, face: Face) -> Result<YearTable> {
    let unread = |problem: ParquetError| broken(path, problem);
    // the parquet crate may panic on a damaged file
    catch_panic(&path.display().to_string(), || {
        let file = File::open(path).map_err(|e| Error::input(path.display(), e))?;
        let table = SerializedFileReader::new(file).map_err(unread)?;
        let schema = table.metadata().file_metadata().schema_descr();
        let names: Vec<String> = schema.columns().iter().map(|c| c.name().to_string()).collect();
        let columns = Columns::new(&names, face).map_err(|problem| broken(path, problem))?;
        let bands = columns.bands.clone();
        let mut found = YearTable { path: path.to_path_buf(), bands, face, ..YearTable::default() };
        for group in 0..table.num_row_groups() {
            let group = table.get_row_group(group).map_err(unread)?;
            add(&*group, &columns.places, &mut found).map_err(unread)?;
        }
        Ok(found)
    })
}

fn add(group: &dyn RowGroupReader, places: &[usize], table: &mut YearTable) -> ParquetResult<()> {
    let wrong = |what: &str| ParquetError::General(what.into());
    let [mut captors, mut times] = [
        Column::<ByteArrayType>::new(group.get_column_reader(0)?),
        Column::new(group.get_column_reader(1)?),
    ];
    let columns = places.iter().flat_map(|&at| [at, at + 1]);
    let mut columns = columns
        .map(|at| Ok(Column::<FloatType>::new(group.get_column_reader(at)?)))
        .collect::<ParquetResult<Vec<_>>>()?;
    let mut values = Vec::new();
    loop {
        let (captors, times) = (captors.read()?, times.read()?);
        let numbers = columns.iter_mut().map(Column::read).collect::<ParquetResult<Vec<_>>>()?;
        let mut lengths = numbers.iter().map(Vec::len).chain([times.len()]);
        if lengths.any(|length| length != captors.len()) {
            return Err(wrong("columns of other lengths"));
        }
        if captors.is_empty() {
            return Ok(());
        }
        for (i, (captor, time)) in captors.iter().zip(&times).enumerate() {
            let (Some(captor), Some(time)) = (captor, time) else {
                return Err(wrong("a row without a name"));
            };
            values.clear();
            values.extend(numbers.chunks(2).map(|both| [both[0][i], both[1][i]]));
            let added = table.add(captor.as_utf8()?, time.as_utf8()?, &values);
            added.map_err(ParquetError::General)?;
        }
    }
}

/// A column whose cells may be empty.
struct Column<T: DataType>(parquet::column::reader::ColumnReaderImpl<T>);

impl<T: DataType> Column<T> {
    fn new(reader: ColumnReader) -> Self {
        Self(get_typed_column_reader(reader))
    }

    /// Reads up to [`ROWS`] cells.
    fn read(&mut self) -> ParquetResult<Vec<Option<T::T>>> {
        let (mut present, mut cells) = (Vec::new(), Vec::new());
        self.0.read_records(ROWS, Some(&mut present), None, &mut cells)?;
        let mut cells = cells.into_iter();
        Ok(present.iter().map(|&there| if there > 0 { cells.next() } else { None }).collect())
    }
}
