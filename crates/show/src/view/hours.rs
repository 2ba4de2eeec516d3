//! The hours of a year for the page: the values of captors and groups in each hour, in three bytes
//! each.

use std::collections::HashMap;

use indexmap::IndexSet;
use serde_json::{Value, json};

use super::levels::Levels;
use phylux_files::year_table::YearTable;

/// Limit on the number of values in a page, some 20 MB. If there are more, evenly spaced days are
/// kept and the others left out.
const MOST: usize = 8_000_000;

/// The encoded values of all hours that are not dark everywhere.
pub struct Hours {
    days: Vec<String>,
    clocks: Vec<String>,
    values: Levels,
    /// The scale of standard errors relative to their values.
    errors: Levels,
    /// Day and time of day of each hour, as `day * clocks + clock`.
    pub slots: Vec<u32>,
    /// Levels of the values: hour by hour, in it band by band, in it captors and then groups.
    pub value_levels: Vec<u16>,
    /// Levels of the errors, in the same order.
    pub error_levels: Vec<u8>,
}

impl Hours {
    /// Encodes the hours of a file for the captors and groups with these names, as far as the file
    /// has them.
    pub fn new<'a>(file: &YearTable, names: impl Iterator<Item = &'a str>) -> Self {
        Self::at_most(file, names, MOST)
    }

    fn at_most<'a>(file: &YearTable, names: impl Iterator<Item = &'a str>, most: usize) -> Self {
        let known: HashMap<&str, usize> = file.ids.iter().map(String::as_str).zip(0..).collect();
        let rows: Vec<usize> = names.filter_map(|name| known.get(name).copied()).collect();
        let (bands, each) = (file.bands.len(), file.ids.len() * file.bands.len());
        let lit: Vec<(usize, (&str, &str))> = file
            .times
            .iter()
            .map(|time| parted(time))
            .enumerate()
            .filter(|(h, _)| file.values[h * each..][..each].iter().any(|[value, _]| *value > 0.0))
            .collect();
        let days: IndexSet<&str> = file.times.iter().map(|time| parted(time).0).collect();
        let apart = (lit.len() * rows.len() * bands).div_ceil(most).max(1);
        let days: IndexSet<&str> = days.into_iter().step_by(apart).collect();
        let mut clocks: Vec<&str> = file.times.iter().map(|time| parted(time).1).collect();
        clocks.sort_unstable();
        clocks.dedup();
        let place = |(day, clock): &(&str, &str)| {
            let clock = clocks.binary_search(clock).ok()?;
            Some((days.get_index_of(day)? * clocks.len() + clock) as u32)
        };
        let shown: Vec<(usize, u32)> =
            lit.iter().filter_map(|(hour, time)| Some((*hour, place(time)?))).collect();
        let (rows, shown) = (&rows, &shown);
        let of_hour = move |hour: usize| {
            let places = (0..bands).flat_map(move |b| rows.iter().map(move |row| row * bands + b));
            places.map(move |at| file.values[hour * each + at])
        };
        let all = || shown.iter().flat_map(move |(hour, _)| of_hour(*hour));
        let relative = |[value, error]: [f32; 2]| if value > 0.0 { error / value } else { 0.0 };
        let values = Levels::fine(all().map(|[value, _]| value).fold(f32::MIN_POSITIVE, f32::max));
        let errors = Levels::coarse(all().map(relative).fold(f32::MIN_POSITIVE, f32::max), 0.0);
        Self {
            value_levels: all().map(|[value, _]| values.level(value)).collect(),
            error_levels: all().map(|both| errors.level(relative(both)) as u8).collect(),
            slots: shown.iter().map(|(_, slot)| *slot).collect(),
            days: days.into_iter().map(String::from).collect(),
            clocks: clocks.into_iter().map(String::from).collect(),
            values,
            errors,
        }
    }

    pub fn facts(&self) -> Value {
        json!({
            "days": self.days, "clocks": self.clocks,
            "values": self.values.facts(), "errors": self.errors.facts(),
        })
    }
}

/// Splits a time such as `2005-06-21T13:00+01:00` into day and time of day.
fn parted(time: &str) -> (&str, &str) {
    let (day, clock) = time.split_once('T').unwrap_or((time, ""));
    (day, clock.get(..5).unwrap_or(clock))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hours_without_light_and_days_beyond_the_most_are_left_out() {
        let times = |hour| (1..=4).map(move |day| format!("2025-06-0{day}T{hour:02}:00+01:00"));
        let file = YearTable {
            ids: vec!["a".into(), "b".into()],
            bands: vec!["PAR".into()],
            times: times(0).zip(times(12)).flat_map(|(night, noon)| [night, noon]).collect(),
            values: (0..4)
                .flat_map(|d| [[0.0; 2], [0.0; 2], [d as f32 + 1.0, 0.5], [8.0, 0.0]])
                .collect(),
            ..YearTable::default()
        };
        let hours = Hours::at_most(&file, ["b", "a"].into_iter(), 100);
        assert_eq!(hours.days.len(), 4);
        assert_eq!(hours.clocks, ["00:00", "12:00"]);
        assert_eq!(hours.slots, [1, 3, 5, 7]);
        assert_eq!(hours.value_levels.len(), 8);
        assert_eq!((hours.value_levels[0], hours.value_levels[2]), (u16::MAX, u16::MAX));
        assert!(hours.value_levels[1] < hours.value_levels[3]);
        assert_eq!(hours.error_levels[..2], [0, 255]);
        let few = Hours::at_most(&file, ["b", "a"].into_iter(), 4);
        assert_eq!((few.days.len(), few.slots.len()), (2, 2));
        assert_eq!(few.days[1], "2025-06-03");
    }
}
