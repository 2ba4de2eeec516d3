//! The rows of a table of hours: when they begin, on the clock of the place, and how long they last.

use phylux_core::{
    error::{Error, Result, call},
    words,
};
use phylux_files::year_table::YearTable;

/// A row whose next is farther away than so many times the usual length has this length.
const LONGEST: f64 = 1.5;

/// A row of a table of hours.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row<'t> {
    /// The day on which it begins, such as `2005-06-21`, and its number, from 1970.
    pub day: &'t str,
    pub number: i64,
    /// When it begins, h of the day.
    pub hour: f64,
    /// How long it lasts, h.
    pub length: f64,
}

impl Row<'_> {
    /// Returns the numbers of the days that it is a part of, each with the hours of the day at which
    /// the part begins and ends.
    pub fn by_day(&self) -> impl Iterator<Item = (i64, f64, f64)> {
        let (number, from, to) = (self.number, self.hour, self.hour + self.length);
        let parts = [(number, from, to.min(24.0)), (number + 1, 0.0, to - 24.0)];
        parts.into_iter().filter(|(_, from, to)| to - from > 1e-9)
    }
}

/// Returns the rows of a table. A row lasts until the next begins, whatever the clock of the place
/// does in between; the last one, and one before a gap, have the usual length. Error: a time is none.
pub(super) fn rows_of(table: &YearTable) -> Result<Vec<Row<'_>>> {
    let times: Vec<(Row, f64)> = table
        .times
        .iter()
        .map(|time| {
            parted(time).ok_or_else(|| {
                Error::input(table.path.display(), format!("`{time}` is no time"))
                    .remedy(words!["write the table again with ", call("year")])
            })
        })
        .collect::<Result<_>>()?;
    let lengths = times.windows(2).map(|pair| pair[1].1 - pair[0].1);
    let mut sorted: Vec<f64> = lengths.clone().filter(|length| *length > 0.0).collect();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted.get(sorted.len() / 2).copied().unwrap_or(1.0);
    let known = |length: &f64| *length > 0.0 && *length <= LONGEST * usual;
    let lengths: Vec<f64> = lengths.map(|l| if known(&l) { l } else { usual }).collect();
    let lengths = lengths.into_iter().chain([usual]);
    Ok(times.into_iter().zip(lengths).map(|((row, _), length)| Row { length, ..row }).collect())
}

/// Splits a time such as `2005-06-21T13:30+01:00` into its day and hour, and returns it in hours
/// from 1970, too.
fn parted(time: &str) -> Option<(Row<'_>, f64)> {
    let (day, clock) = time.split_once('T')?;
    let hour = hours(clock.get(..5)?)?;
    let offset = match clock.get(5..)? {
        "" | "Z" => 0.0,
        offset if offset.starts_with('-') => -hours(&offset[1..])?,
        offset => hours(offset.strip_prefix('+')?)?,
    };
    let mut parts = day.splitn(3, '-').map(|part| part.parse::<i64>().ok());
    let (year, month, of_month) = (parts.next()??, parts.next()??, parts.next()??);
    if !(1..=12).contains(&month) || year.abs() > 9999 {
        return None;
    }
    // the years of this count begin in March, so that the leap day is the last one
    let year = if month <= 2 { year - 1 } else { year };
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + of_month - 1;
    let leap_days = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    let number = 365 * year + leap_days + of_year - 719_468;
    Some((Row { day, number, hour, length: 0.0 }, 24.0 * number as f64 + hour - offset))
}

/// Reads hours and minutes, such as `13:30`.
fn hours(clock: &str) -> Option<f64> {
    let (hour, minute) = clock.split_once(':')?;
    Some(hour.parse::<u8>().ok()? as f64 + minute.get(..2)?.parse::<u8>().ok()? as f64 / 60.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(times: &[&str]) -> YearTable {
        YearTable { times: times.iter().map(|t| t.to_string()).collect(), ..YearTable::default() }
    }

    #[test]
    fn days_are_counted() {
        for (time, number) in [
            ("1970-01-01T00:00+00:00", 0),
            ("2000-02-29T00:00+00:00", 11_016),
            ("2000-03-01T00:00+00:00", 11_017),
            ("2026-11-28T12:00-03:30", 20_785),
        ] {
            assert_eq!(parted(time).expect("a time").0.number, number, "{time}");
        }
        assert!(
            ["", "2005-06-21", "2005-13-01T00:00Z", "2005-06-21T1", "x-y-zT00:00+00:00"]
                .into_iter()
                .all(|text| parted(text).is_none())
        );
    }

    /// Rows that begin at ten past, half hours, and those about the change of a clock last until the
    /// next; a row over midnight is a part of two days.
    #[test]
    fn rows_last_until_the_next() {
        let lengths = |times: &[&str]| -> Vec<f64> {
            let table = table(times);
            let rows = rows_of(&table).expect("rows");
            rows.iter().map(|row| (1e6 * row.length).round() / 1e6).collect()
        };
        let day = "2023-06-01T";
        let of = |clocks: &[&str]| {
            let times: Vec<String> = clocks.iter().map(|c| format!("{day}{c}+00:00")).collect();
            lengths(&times.iter().map(String::as_str).collect::<Vec<_>>())
        };
        assert_eq!(of(&["00:00", "00:40", "01:40", "02:40"]), [0.666667, 1.0, 1.0, 1.0]);
        assert_eq!(of(&["00:00", "00:30", "01:00"]), [0.5, 0.5, 0.5]);
        assert_eq!(of(&["00:00", "01:00", "02:00", "09:00", "10:00"]), [1.0; 5]);
        // a day of 23 hours and one of 25
        let spring = ["2023-03-26T01:00+01:00", "2023-03-26T03:00+02:00", "2023-03-26T04:00+02:00"];
        assert_eq!(lengths(&spring), [1.0; 3]);
        let autumn = ["2023-10-29T02:00+02:00", "2023-10-29T02:00+01:00", "2023-10-29T03:00+01:00"];
        assert_eq!(lengths(&autumn), [1.0; 3]);
        let night = table(&["2023-06-01T22:40+00:00", "2023-06-01T23:40+00:00"]);
        let rows = rows_of(&night).expect("rows");
        let parts: Vec<(i64, f64, f64)> = rows[1].by_day().collect();
        assert_eq!(parts.len(), 2);
        assert_eq!((parts[1].0 - parts[0].0, parts[0].2, parts[1].1), (1, 24.0, 0.0));
        assert!((parts[1].2 - 2.0 / 3.0).abs() < 1e-9, "{parts:?}");
    }
}
