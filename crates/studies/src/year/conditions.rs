//! When states hold and lamps may be on, as far as that does not depend on the light inside: by the
//! clock, the season, the light outside and tables by time.

use std::path::Path;

use super::hours::{local, time};
use phylux_core::{
    error::{Error, Result, nearest},
    scene::world::Scene,
};
use phylux_files::{
    control_file::{SeriesFile, WhenKeys},
    csv_table::{self, records},
    input::{quoted, read_bytes},
    iso8601::parse_time,
    scene_file::HourlyLights,
    weather::Slot,
};
use phylux_results::result::BandResult;

/// What is known of the hours before anything is traced.
pub(super) struct Outside<'a> {
    pub slots: &'a [Slot],
    pub bands: &'a [BandResult],
    /// For each slot the light on a horizontal plane in the open: bands, then sums.
    light: Vec<Vec<f64>>,
}

/// Makes an error at a key of an entry.
pub(super) type Wrong<'w> = &'w dyn Fn(&str, String) -> Error;

impl<'a> Outside<'a> {
    pub fn new(scene: &Scene, hourly: &'a HourlyLights, bands: &'a [BandResult]) -> Self {
        let light = |slot: &Slot| {
            let mut light = vec![0.0; scene.bands().len()];
            if let Some(hour) = slot.hour.map(|h| &hourly.hours[h]) {
                let direct = hour.direct_horizontal();
                let suns = hourly.suns.iter().map(|sun| (&sun.shares, direct));
                let skies = hourly.skies.iter().map(|shares| (shares, hour.diffuse_horizontal));
                for (shares, of) in suns.chain(skies) {
                    light.iter_mut().zip(shares).for_each(|(sum, share)| *sum += share * of);
                }
            }
            scene.with_sums(&light)
        };
        Self { slots: &hourly.slots, bands, light: hourly.slots.iter().map(light).collect() }
    }

    /// Returns for each slot the fraction of it in which conditions hold. `folder` is that of the
    /// control file.
    pub fn shares(&self, keys: &WhenKeys, folder: &Path, wrong: Wrong) -> Result<Vec<f64>> {
        let band = keys.outside_band.map(|name| {
            self.bands.iter().position(|band| band.name == name).ok_or_else(|| {
                let all: Vec<&str> = self.bands.iter().map(|band| band.name.as_str()).collect();
                wrong("/outside_band", format!("no band or sum {}", quoted(name)))
                    .remedy(format!("there are {}", all.join(", ")))
            })
        });
        let band = band.transpose()?;
        let series = keys.series.map(|series| self.series(series, folder, wrong)).transpose()?;
        let share = |(s, slot): (usize, &Slot)| {
            let (date, start) = local(slot);
            let light = band.map_or(slot.global, |band| self.light[s][band]);
            let holds = keys.includes((date.month, date.day))
                && keys.outside_below.is_none_or(|below| light < below)
                && keys.outside_above.is_none_or(|above| light > above);
            match holds {
                true => keys.allowed(start, slot.length) * series.as_ref().map_or(1.0, |v| v[s]),
                false => 0.0,
            }
        };
        Ok(self.slots.iter().enumerate().map(share).collect())
    }

    /// Reads a table of fractions by time, and returns its mean in each slot. Errors: it cannot be
    /// read, has no such column, does not cover the period, or holds a number that is no fraction.
    pub fn series(&self, file: &SeriesFile, folder: &Path, wrong: Wrong) -> Result<Vec<f64>> {
        let means = self.means(file, folder, Values::Fractions, wrong)?;
        Ok(means.into_iter().map(|mean| mean.clamp(0.0, 1.0)).collect())
    }

    /// Reads a table of prices by time, and returns their mean in each slot. Errors: those of
    /// [`series`](Self::series), but any number is a price.
    pub fn prices(&self, file: &SeriesFile, folder: &Path, wrong: Wrong) -> Result<Vec<f64>> {
        self.means(file, folder, Values::Prices, wrong)
    }

    fn means(
        &self,
        file: &SeriesFile,
        folder: &Path,
        values: Values,
        wrong: Wrong,
    ) -> Result<Vec<f64>> {
        let path = folder.join(&file.file);
        let bytes = read_bytes(&path).map_err(|why| {
            wrong("/file", format!("{}: {why}", path.display())).remedy("name a CSV file")
        })?;
        let rows = read_series(&bytes, &path, &file.column, values)?;
        let ends = rows.iter().skip(1).map(|row| row.0);
        // the last row holds as long as the one before it, or for an hour
        let last = match rows.as_slice() {
            [.., before, last] => 2.0 * last.0 - before.0,
            [only] => only.0 + 3600.0,
            [] => return Err(Error::input(path.display(), "has no row").remedy("add rows")),
        };
        let ends: Vec<f64> = ends.chain([last]).collect();
        let mean = |slot: &Slot| {
            let (from, to) = (slot.start.unix, slot.start.unix + 3600.0 * slot.length);
            let first = ends.partition_point(|&end| end <= from);
            let (mut sum, mut covered) = (0.0, 0.0);
            for (&(start, value), &end) in rows[first..].iter().zip(&ends[first..]) {
                let length = end.min(to) - start.max(from);
                if length <= 0.0 {
                    break;
                }
                sum += length * value;
                covered += length;
            }
            if covered < (to - from) * (1.0 - 1e-6) {
                let problem = format!("has no row for the hour from {}", time(slot));
                return Err(Error::input(path.display(), problem)
                    .remedy("let it cover the whole period, in steps of equal length"));
            }
            Ok(sum / covered)
        };
        self.slots.iter().map(mean).collect()
    }
}

/// What the numbers of a table by time are.
#[derive(Clone, Copy)]
enum Values {
    /// Fractions from 0 to 1.
    Fractions,
    /// Prices, which may be below 0.
    Prices,
}

/// Returns the times at which the rows of a table begin to hold, s since 1970, and their values.
fn read_series(bytes: &[u8], path: &Path, column: &str, values: Values) -> Result<Vec<(f64, f64)>> {
    let (range, must, remedy) = match values {
        Values::Fractions => {
            (0.0..=1.0, "must be a number from 0 to 1", "write 0 for open and 1 for closed")
        }
        Values::Prices => (-1e9..=1e9, "must be a price", "write a number of at most 1e9"),
    };
    let mut records = records(bytes, path);
    let Some((place, head)) = records.next().transpose()? else {
        return Err(Error::input(path.display(), "is empty").remedy("write `time` and a column"));
    };
    let find = |name: &str| {
        head.iter().position(|cell| cell == name).ok_or_else(|| {
            let error = place.error(format!("no column {}", quoted(name)));
            match nearest(name, head.iter()) {
                Some(near) => error.remedy(format!("did you mean {}?", quoted(near))),
                None => error.remedy("the first line names the columns, separated by commas"),
            }
        })
    };
    let (at_time, value) = (find("time")?, find(column)?);
    let mut rows: Vec<(f64, f64)> = Vec::new();
    let (mut least, mut longest) = (f64::INFINITY, None);
    for record in records {
        let (place, record) = record?;
        let cell = |i: usize| record.get(i).unwrap_or_default();
        let at = format!("{}:{}", path.display(), place.line);
        let start = parse_time(cell(at_time), &at)?.unix;
        let number = csv_table::number(cell(value), Some(','));
        let Some(number) = number.filter(|x| range.contains(x)) else {
            let problem = format!("{} {must}", quoted(cell(value)));
            return Err(place.error(problem).remedy(remedy));
        };
        if let Some(&(before, _)) = rows.last() {
            let own = start - before;
            if own <= 0.0 {
                return Err(place
                    .error("is not later than the row before")
                    .remedy("sort the rows"));
            }
            least = own.min(least);
            if longest.as_ref().is_none_or(|(step, _)| own > *step) {
                longest = Some((own, place));
            }
        }
        rows.push((start, number));
    }
    match longest {
        Some((step, place)) if step > 1.5 * least => Err(place
            .error("comes after a gap")
            .remedy("let each row stand for a step of equal length, and add what is missing")),
        _ => Ok(rows),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn read(text: &str) -> Result<Vec<(f64, f64)>> {
        read_series(text.as_bytes(), Path::new("c.csv"), "curtain", Values::Fractions)
    }

    #[test]
    fn prices_may_be_below_nothing() {
        let read = |price: &str| {
            let table = format!("time,p\n2025-06-20T00:00+01:00,{price}\n");
            read_series(table.as_bytes(), Path::new("p.csv"), "p", Values::Prices)
        };
        assert_eq!(read("-12.5").unwrap()[0].1, -12.5);
        assert!(read("dear").unwrap_err().to_string().contains("p.csv:2: `dear` must be a price"));
    }

    #[test]
    fn series_are_read_with_their_faults() {
        let table = "time,curtain,x\n2025-06-20T00:00+01:00,0.25,9\n2025-06-20T01:00+01:00,1,9\n";
        let rows = read(table).unwrap();
        assert_eq!((rows[1].0 - rows[0].0, rows[0].1, rows[1].1), (3600.0, 0.25, 1.0));
        for (text, words) in [
            (table.replace("0.25", "1.5"), "c.csv:2: `1.5` must be a number from 0 to 1"),
            (table.replace("0.25", ""), "c.csv:2: "),
            (table.replace("T01:00", "T00:00"), "c.csv:3: is not later"),
            (table.replace("+01:00,1", ",1"), "c.csv:3: "),
            (table.replace("curtain", "curtains"), "did you mean `curtains`"),
            (format!("{table}2025-06-20T05:00+01:00,1,9\n"), "c.csv:4: comes after a gap"),
            (
                table.replace("T00:00", "T00:30") + "2025-06-20T02:00+01:00,1,9\n",
                "c.csv:4: comes after a gap",
            ),
            (
                table.replace("2025-06-20T00", "2025-06-19T20") + "2025-06-20T02:00+01:00,1,9\n",
                "c.csv:3: comes after a gap",
            ),
            (String::new(), "c.csv: is empty"),
        ] {
            let error = read(&text).unwrap_err().to_string();
            assert!(error.contains(words), "{error}: {words}");
        }
    }

    proptest! {
        #[test]
        fn no_series_panics(text in "(time,curtain\n)?([-+0-9T:.,eZ ]{0,40}\n){0,4}") {
            if let Ok(rows) = read(&text) {
                prop_assert!(rows.iter().all(|row| row.0.is_finite() && (0.0..=1.0).contains(&row.1)));
            }
        }
    }
}
