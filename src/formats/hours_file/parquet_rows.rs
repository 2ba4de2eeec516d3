//! Reads the table of hours from Parquet.

use std::{fs::File, path::Path};

use parquet::{
    column::reader::{ColumnReader, get_typed_column_reader},
    data_type::{ByteArrayType, DataType, DoubleType},
    errors::{ParquetError, Result as ParquetResult},
    file::reader::{FileReader, RowGroupReader, SerializedFileReader},
};

use super::rows::{COLUMNS, HoursFile, Row, broken};
use crate::error::{Error, Result, catch_panic};

/// Number of rows that are read at once.
const ROWS: usize = 50_000;

/// Reads the Parquet file at `path`. Errors: the file cannot be read, or is not a table of hours.
pub fn read(path: &Path) -> Result<HoursFile> {
    let unread = |problem: ParquetError| broken(path, problem);
    // the parquet crate may panic on a damaged file
    catch_panic(&path.display().to_string(), || {
        let file = File::open(path).map_err(|e| Error::input(path.display(), e))?;
        let table = SerializedFileReader::new(file).map_err(unread)?;
        let schema = table.metadata().file_metadata().schema_descr();
        if !schema.columns().iter().map(|c| c.name()).take(COLUMNS.len()).eq(COLUMNS) {
            return Err(broken(path, "its columns are others"));
        }
        let mut hours = HoursFile { path: path.to_path_buf(), ..HoursFile::default() };
        for group in 0..table.num_row_groups() {
            let group = table.get_row_group(group).map_err(unread)?;
            add(&*group, &mut hours).map_err(unread)?;
        }
        Ok(hours)
    })
}

fn add(group: &dyn RowGroupReader, hours: &mut HoursFile) -> ParquetResult<()> {
    let mut columns = (0..COLUMNS.len()).map(|i| group.get_column_reader(i));
    let mut next = || columns.next().unwrap_or(Err(ParquetError::General("a column less".into())));
    let mut texts =
        [Column::<ByteArrayType>::new(next()?), Column::new(next()?), Column::new(next()?)];
    let mut numbers = [Column::<DoubleType>::new(next()?), Column::new(next()?)];
    loop {
        let [captors, times, bands] = texts.each_mut().map(Column::read);
        let [values, errors] = numbers.each_mut().map(Column::read);
        let (captors, times, bands) = (captors?, times?, bands?);
        let (values, errors) = (values?, errors?);
        let lengths = [captors.len(), times.len(), bands.len(), values.len(), errors.len()];
        if lengths.iter().any(|length| *length != lengths[0]) {
            return Err(ParquetError::General("a cell without content".into()));
        }
        if captors.is_empty() {
            return Ok(());
        }
        for (i, captor) in captors.iter().enumerate() {
            let row = Row {
                captor: captor.as_utf8()?,
                time: times[i].as_utf8()?,
                band: bands[i].as_utf8()?,
                value: values[i],
                error: errors[i],
            };
            hours.add(&row).map_err(ParquetError::General)?;
        }
    }
}

/// A column whose cells may be empty.
struct Column<T: DataType>(parquet::column::reader::ColumnReaderImpl<T>);

impl<T: DataType> Column<T> {
    fn new(reader: ColumnReader) -> Self {
        Self(get_typed_column_reader(reader))
    }

    /// Reads up to [`ROWS`] cells and returns those that are not empty.
    fn read(&mut self) -> ParquetResult<Vec<T::T>> {
        let (mut present, mut cells) = (Vec::new(), Vec::new());
        self.0.read_records(ROWS, Some(&mut present), None, &mut cells)?;
        Ok(cells)
    }
}
