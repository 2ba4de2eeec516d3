//! Tables of hours, which `phylux year` writes as CSV or Parquet.
//!
//! The first columns are `captor`, `time`, `band`, `value` and `standard_error`; what stands in
//! others is not read. The rows go hour by hour; within an hour captor by captor, then group by
//! group; within a captor or group band by band.

#[cfg(feature = "parquet")]
mod parquet_rows;
mod rows;

use std::path::Path;

use crate::{
    error::{Error, Result},
    formats::{csv_table::records, csv_text, input},
};
pub use rows::HoursFile;
use rows::{COLUMNS, Row, broken};

impl HoursFile {
    /// Reads `hours.parquet`, or else `hours.csv`, in a folder that `phylux year` wrote. Errors:
    /// the folder has neither file, or the file is not a complete table of hours.
    pub fn read(folder: &Path) -> Result<Self> {
        let [parquet, csv] = ["hours.parquet", "hours.csv"].map(|name| folder.join(name));
        let mut hours = match (parquet.is_file(), csv.is_file()) {
            #[cfg(feature = "parquet")]
            (true, _) => parquet_rows::read(&parquet)?,
            (_, true) => Self::read_csv(&csv)?,
            (false, false) => {
                return Err(Error::input(
                    folder.display(),
                    "holds no hours.parquet and no hours.csv",
                )
                .remedy("name the folder that `phylux year` has written"));
            }
            #[cfg(not(feature = "parquet"))]
            (true, false) => {
                return Err(Error::input(parquet.display(), "this build reads no Parquet")
                    .remedy("write the hours with `phylux year --csv`"));
            }
        };
        let all = hours.times.len() * hours.ids.len() * hours.bands.len();
        if hours.values.is_empty() || hours.values.len() != all {
            return Err(broken(&hours.path, "its last hour is not complete"));
        }
        hours.values.shrink_to_fit();
        Ok(hours)
    }

    fn read_csv(path: &Path) -> Result<Self> {
        let bytes =
            input::read_bytes(path).map_err(|problem| Error::input(path.display(), problem))?;
        let mut hours = Self { path: path.to_path_buf(), ..Self::default() };
        let mut rows = records(&bytes, path);
        let heading = rows.next().transpose()?;
        if !heading.is_some_and(|(_, heading)| heading.iter().take(COLUMNS.len()).eq(COLUMNS)) {
            return Err(broken(path, "its columns are others"));
        }
        for record in rows {
            let (place, record) = record?;
            let cell = |i: usize| record.get(i).unwrap_or_default();
            let number = |i: usize| cell(i).parse::<f64>().map_err(|_| input::quoted(cell(i)));
            let row = number(3).and_then(|value| {
                let text = |i: usize| csv_text::text(cell(i));
                let (captor, time, band) = (text(0), text(1), text(2));
                hours.add(&Row { captor, time, band, value, error: number(4)? })
            });
            row.map_err(|problem| broken(path, format!("line {}: {problem}", place.line)))?;
        }
        Ok(hours)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &str = "captor,time,band,value,standard_error\n\
        a,2025-06-20T00:00+01:00,PAR,1,0.1\n\
        a,2025-06-20T00:00+01:00,far,2,0.2\n\
        '=b,2025-06-20T00:00+01:00,PAR,3,0.3\n\
        '=b,2025-06-20T00:00+01:00,far,4,0\n\
        a,2025-06-20T01:00+01:00,PAR,5,0.5\n\
        a,2025-06-20T01:00+01:00,far,6,0.6\n\
        '=b,2025-06-20T01:00+01:00,PAR,7,0.7\n\
        '=b,2025-06-20T01:00+01:00,far,8,0.8\n";

    fn read(text: &str) -> Result<HoursFile> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("hours.csv"), text).unwrap();
        HoursFile::read(folder.path())
    }

    #[test]
    fn hours_are_read_in_order() {
        let hours = read(TABLE).unwrap();
        assert_eq!(hours.ids, ["a", "=b"]);
        assert_eq!(hours.bands, ["PAR", "far"]);
        assert_eq!(hours.times, ["2025-06-20T00:00+01:00", "2025-06-20T01:00+01:00"]);
        assert_eq!(hours.values[2], [3.0, 0.3]);
        assert_eq!(hours.values[7], [8.0, 0.8]);
        // one captor, one band
        let one = TABLE.lines().filter(|line| !line.contains("far") && !line.contains("=b"));
        let hours = read(&one.collect::<Vec<_>>().join("\n")).unwrap();
        assert_eq!(hours.values, [[1.0, 0.1], [5.0, 0.5]]);
    }

    #[test]
    fn what_is_no_table_of_hours_is_refused() {
        for (text, words) in [
            ("", "columns"),
            ("a,b\n", "columns"),
            (&TABLE[..TABLE.find('\n').unwrap() + 1], "not complete"),
            (TABLE.rsplit_once("'=b").unwrap().0, "not complete"),
            (&TABLE.replacen("far,6", "fir,6", 1), "line 7: `a`, `2025-06-20T01:00+01:00`, `fir`"),
            (&TABLE.replacen("01:00+01:00,far,8", "02:00+01:00,far,8", 1), "line 9"),
            (&TABLE.replacen("PAR,5,0.5", "PAR,five,0.5", 1), "line 6: `five`"),
            (&TABLE.replacen("PAR,5,0.5", "PAR,nan,0.5", 1), "line 6: a value that is no number"),
            (&TABLE.replacen("PAR,5,0.5", "PAR,5", 1), "line 6"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(words), "{error}: {words}");
        }
        let folder = tempfile::tempdir().unwrap();
        let error = HoursFile::read(folder.path()).unwrap_err().to_string();
        assert!(error.contains("phylux year"), "{error}");
    }
}
