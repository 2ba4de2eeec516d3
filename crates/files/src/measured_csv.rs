//! Files of measured readings: what an instrument showed at captors, with one reading per row.

use std::{collections::BTreeSet, path::Path};

use csv::StringRecord;
use glam::DVec3;

use super::csv_table::{Head, Place, rows, twice};
use crate::input::quoted;
use phylux_core::{
    error::{Result, nearest},
    math::stats::LARGEST,
};

/// One row: a reading of an instrument.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredRow {
    /// Line in the file, from 1.
    pub line: u64,
    /// Where the reading was taken.
    pub at: MeasuredAt,
    /// Name of the band of the reading; `None` where the file has no column `band`.
    pub band: Option<String>,
    /// The reading, above 0, in the unit of irradiance of the scene; `None` for a place whose
    /// reading is to be predicted.
    pub value: Option<f64>,
    /// Standard deviation of the reading, at least 0, in the same unit.
    pub sd: Option<f64>,
    /// Whether the reading was taken on the back of the captor.
    pub back: bool,
    /// Whether the reading is kept for a test, and not used for the fit.
    pub test: bool,
    /// Name of the block; all readings of a block are left out together in cross-validation.
    pub block: Option<String>,
}

/// Where a reading was taken.
#[derive(Clone, Debug, PartialEq)]
pub enum MeasuredAt {
    /// At the captor with this id.
    Captor(String),
    /// At the captor with this centre, in the scene's unit of length.
    Point(DVec3),
}

const COLUMNS: [&str; 10] =
    ["captor", "x", "y", "z", "band", "value", "sd", "face", "use", "block"];
const HEADER: &str = "the first line names the columns: captor,band,value and, if wanted, sd,face,use,block; x,y,z may \
    stand for captor";

/// Reads the `bytes` of the file of readings at `path`: a header, then at least one row.
///
/// # Errors
/// The file has no row; or, at `path:LINE`: a column is unknown, missing or repeated, a value is
/// not a finite number, a reading is not positive or is missing where a use is named, a face is neither front nor back, a use is
/// neither fit nor test, or a row has the same place, face and band as a row before it.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Vec<MeasuredRow>> {
    let mut seen = BTreeSet::new();
    rows(bytes, path, ("reading", HEADER), Header::read, |header, record, place| {
        let row = header.row(record, place)?;
        if !seen.insert(format!("{:?} {:?} {}", row.at, row.band, row.back)) {
            return Err(place
                .error("a second reading of the same captor, face and band")
                .remedy("give their mean, with its standard deviation as `sd`"));
        }
        Ok(row)
    })
}

/// Positions of the columns in the rows of a file.
struct Header {
    head: Head,
    /// Index of each column, in the order of [`COLUMNS`]; `None` where the file does not have it.
    at: [Option<usize>; COLUMNS.len()],
}

impl Header {
    fn read(record: &StringRecord, place: &Place) -> Result<Self> {
        let mut at = [None; COLUMNS.len()];
        for (i, name) in record.iter().enumerate() {
            let Some(column) = COLUMNS.iter().position(|known| *known == name) else {
                let error = place.error(format!("unknown column {}", quoted(name)));
                let long = COLUMNS.into_iter().filter(|known| known.len() > 1);
                return Err(error.did_you_mean(nearest(name, long), HEADER));
            };
            if let Some(first) = at[column].replace(i) {
                return Err(twice(place, name, first, i));
            }
        }
        let header = Self { head: Head::new(record), at };
        let has = |name: &str| header.column(name).is_some();
        let by_id = has("captor");
        if by_id == ["x", "y", "z"].into_iter().any(has) {
            let problem = if by_id { "has captor and x, y or z" } else { "has no column captor" };
            return Err(place.error(problem).remedy("name captors by `captor`, or by x,y,z"));
        }
        for name in if by_id { &["value"][..] } else { &["x", "y", "z", "value"] } {
            if !has(name) {
                return Err(place.error(format!("column {name} missing")).remedy(HEADER));
            }
        }
        Ok(header)
    }

    fn column(&self, name: &str) -> Option<usize> {
        COLUMNS.iter().position(|known| *known == name).and_then(|column| self.at[column])
    }

    fn row(&self, record: &StringRecord, place: &Place) -> Result<MeasuredRow> {
        self.head.check(record, place)?;
        let text = |name: &str| {
            let cell = self.column(name).map(|i| &record[i]);
            cell.filter(|text| !text.is_empty())
        };
        let number = |name: &str| match text(name).map(str::parse::<f64>) {
            Some(Ok(value)) if value.abs() <= LARGEST => Ok(value),
            _ => {
                let word = quoted(text(name).unwrap_or_default());
                Err(place
                    .error(format!("{name} is {word}, not a finite number"))
                    .remedy("write it like 0.25 or 2.5e-1"))
            }
        };
        let one_of = |name: &str, [usual, other]: [&str; 2]| match text(name) {
            None => Ok(false),
            Some(word) if word == usual || word == other => Ok(word == other),
            Some(word) => Err(place
                .error(format!("{name} is {}", quoted(word)))
                .remedy(format!("it is `{usual}` or `{other}`"))),
        };
        let value = text("value").map(|_| number("value")).transpose()?;
        if let Some(value) = value.filter(|value| *value <= 0.0) {
            return Err(place
                .error(format!("the reading is {value}, must be above 0"))
                .remedy("leave out readings in the dark: errors are relative to the reading"));
        }
        let sd = text("sd").map(|_| number("sd")).transpose()?;
        if let Some(sd) = sd.filter(|sd| *sd < 0.0) {
            let problem = format!("sd is {sd}, must be at least 0");
            return Err(place.error(problem).remedy("it is the standard deviation of the reading"));
        }
        let at = match self.column("captor") {
            None => MeasuredAt::Point(DVec3::new(number("x")?, number("y")?, number("z")?)),
            Some(_) => match text("captor") {
                Some(id) => MeasuredAt::Captor(id.to_string()),
                None => return Err(place.error("the captor is empty").remedy("give its id")),
            },
        };
        if self.column("band").is_some() && text("band").is_none() {
            return Err(place.error("the band is empty").remedy("give its name"));
        }
        if let (None, Some(purpose)) = (value, text("use")) {
            return Err(place
                .error(format!("there is no value, but use is {}", quoted(purpose)))
                .remedy("leave both empty where a reading is to be predicted"));
        }
        Ok(MeasuredRow {
            line: place.line,
            at,
            band: text("band").map(str::to_string),
            value,
            sd,
            back: one_of("face", ["front", "back"])?,
            test: one_of("use", ["fit", "test"])?,
            block: text("block").map(str::to_string),
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use phylux_testing::{check_error, spoiled};

    fn parse_text(text: &str) -> Result<Vec<MeasuredRow>> {
        parse(text.as_bytes(), Path::new("dir/m.csv"))
    }

    #[test]
    fn rows_are_read_in_any_order_of_columns() {
        let text = "band,captor,value,use,sd,face,block\nblue,a,2.5,test,0.1,back,left\nred,\"b,1\",3,,,,\n";
        let rows = parse_text(text).unwrap();
        assert_eq!(rows.len(), 2);
        assert_eq!(rows[0].at, MeasuredAt::Captor("a".into()));
        assert_eq!(
            (rows[0].value, rows[0].sd, rows[0].back, rows[0].test),
            (Some(2.5), Some(0.1), true, true)
        );
        assert_eq!(
            (rows[0].block.as_deref(), rows[0].band.as_deref()),
            (Some("left"), Some("blue"))
        );
        assert_eq!(rows[1].at, MeasuredAt::Captor("b,1".into()));
        assert_eq!((rows[1].sd, rows[1].back, rows[1].test, rows[1].line), (None, false, false, 3));
        assert_eq!(parse_text("captor,value\na,\nb,2").unwrap()[0].value, None);
        let at = &parse_text("x,y,z,value\n1,-2,3e2,4").unwrap()[0].at;
        assert_eq!(*at, MeasuredAt::Point(DVec3::new(1.0, -2.0, 300.0)));
    }

    #[test]
    fn errors_name_the_line_and_the_cure() {
        const H: &str = "captor,band,value,sd,face,use";
        for (text, start) in [
            (String::new(), "dir/m.csv: is empty; the first line names the columns: captor,band"),
            (format!("{H}\n"), "dir/m.csv: holds no reading"),
            ("captor,valeu".into(), "dir/m.csv:1: unknown column `valeu`; did you mean `value`?"),
            ("value".into(), "dir/m.csv:1: has no column captor; name captors by"),
            ("captor,x,value".into(), "dir/m.csv:1: has captor and x, y or z; name captors by"),
            ("x,y,value".into(), "dir/m.csv:1: column z missing; the first line"),
            ("captor,captor".into(), "dir/m.csv:1: columns 1 and 2 are both captor; keep one"),
            (format!("{H}\na,b,1"), "dir/m.csv:2: 3 values, but the header has 6 columns"),
            (format!("{H}\na,b,0,,,"), "dir/m.csv:2: the reading is 0, must be above 0; leave"),
            (format!("{H}\na,b,-1,,,"), "dir/m.csv:2: the reading is -1, must be above 0"),
            (format!("{H}\na,b,x,,,"), "dir/m.csv:2: value is `x`, not a finite number"),
            (format!("{H}\na,b,,,,fit"), "dir/m.csv:2: there is no value, but use is `fit`; leave"),
            (format!("{H}\na,b,1,-1,,"), "dir/m.csv:2: sd is -1, must be at least 0"),
            (format!("{H}\na,b,1,,top,"), "dir/m.csv:2: face is `top`; it is `front` or `back`"),
            (format!("{H}\na,b,1,,,no"), "dir/m.csv:2: use is `no`; it is `fit` or `test`"),
            (format!("{H}\n,b,1,,,"), "dir/m.csv:2: the captor is empty; give its id"),
            (format!("{H}\na,,1,,,"), "dir/m.csv:2: the band is empty; give its name"),
            (format!("{H}\na,b,1,,,\na,b,2,,front,"), "dir/m.csv:3: a second reading of the same"),
        ] {
            let error = parse_text(&text).unwrap_err().to_string();
            assert!(error.starts_with(start), "{error}\n{start}");
        }
    }

    const FILES: &[&str] = &[
        "captor,band,value,sd,face,use,block\na,blue,1.5,0.1,front,fit,1\nd,blue,,,,,\nb,blue,2,,back,test,\n\"c, 1\",red,3e-1,,,,2\n",
        "x,y,z,value\r\n1,2,3,0.1\r\n\r\n4,5,6,7\r\n",
    ];
    const WORDS: &[&str] =
        &["captor", "x", "value", "use", "fit", "test", "front", "back", "\"\"", "\n\n"];

    fn check(bytes: &[u8]) {
        let path = Path::new("dir/m.csv");
        match parse(bytes, path) {
            Err(error) => check_error(&error, path),
            Ok(rows) => {
                assert!(!rows.is_empty() && rows.is_sorted_by(|a, b| a.line < b.line));
                let sound = |row: &MeasuredRow| row.value.is_none_or(|v| v > 0.0 && v.is_finite());
                assert!(rows.iter().all(sound));
                assert!(rows.iter().all(|row| row.sd.is_none_or(|sd| sd >= 0.0 && sd.is_finite())));
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn no_spoiled_file_panics(bytes in spoiled(FILES, WORDS)) {
            check(&bytes);
        }

        #[test]
        fn no_bytes_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            check(&bytes);
        }
    }
}
