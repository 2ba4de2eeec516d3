//! Reads tables with a line of names above them: CSV of our own, and the tables of PVGIS, NSRDB,
//! Open-Meteo and NASA POWER, whose heads (`heads`) say place, clock and units.

use std::path::Path;

use super::{
    cells::{KINDS, Line, Odd, date, in_typical_year},
    heads::{Column, Head, NAMES, Source, head, name_and_unit, number_after},
    record::{Clock, DAY, HOUR, Record, Stamp, Weather},
};
use crate::{input::quoted, iso8601::parse_time};
use phylux_core::{
    error::{Error, Result},
    scene::daylight::{Date, Timestamp},
};

/// What is said where no column of irradiance is found.
const LOOKED_FOR: &str = "the columns looked for are ghi, dni, dhi (PVGIS: G(h), Gb(n), Gd(h), or G(i), Gb(i), Gd(i) of \
     slope 0; Open-Meteo: shortwave_radiation, direct_normal_irradiance, diffuse_radiation, direct_radiation; NASA \
     POWER: ALLSKY_SFC_SW_DWN, ALLSKY_SFC_SW_DNI, ALLSKY_SFC_SW_DIFF)";

/// The time of a row.
struct Time {
    date: Date,
    /// Seconds since midnight.
    clock: f64,
    stamp: Timestamp,
}

/// Reads a table; `stamp` is what the user says about its times.
pub(super) fn read(
    path: &Path,
    lines: &[Line],
    stamp: Option<Stamp>,
    odd: &mut Odd,
) -> Result<Weather> {
    let head = head(path, lines)?;
    let columns = head.columns()?;
    let times = head.times()?;
    let Some(stamp_of_rows) = stamp.or(head.stamp) else {
        let problem = "does not say where in its interval the time of a row stands";
        let remedy = "set `stamp` beside the file to `start`, `middle` or `end`";
        return Err(Error::input(path.display(), problem).remedy(remedy));
    };
    // where the user says what the times are, the head's offset is part of that
    let late = if stamp.is_none() { head.late } else { 0.0 };
    let mut records = Vec::new();
    let mut dates = Vec::new();
    for line in head.rows {
        let filled = line.values.iter().rposition(|v| !v.is_empty()).map_or(0, |last| last + 1);
        let (count, due) = (line.values.len(), head.names.values.len());
        if filled > due || (head.source == Source::Plain && count != due) {
            let problem = format!("{count} values, but the header has {due} columns");
            return Err(line.error(problem).remedy("numbers take a decimal point, not a comma"));
        }
        let time = times.of(line)?;
        let mut value = |wanted: Column| match columns.iter().find(|c| c.what == wanted) {
            Some(c) => {
                let name = head.names.values[c.index];
                let text = line.text(c.index, name)?;
                Ok(odd.irradiance(text, c.factor, name, line.line))
            }
            None => Ok(None),
        };
        let [mut global, direct, mut diffuse, beam] = [
            value(Column::Global)?,
            value(Column::Direct)?,
            value(Column::Diffuse)?,
            value(Column::Beam)?,
        ];
        if let Some(beam) = beam {
            global = global.or(diffuse.map(|diffuse| diffuse + beam));
            diffuse = diffuse.or(global.map(|global| (global - beam).max(0.0)));
        }
        let start = time.stamp;
        let (from, to) = (start.unix + late, start.unix);
        records.push(Record { line: line.line, from, to, start, global, direct, diffuse });
        dates.push((time.date, time.clock + late));
    }
    let step = step(path, &records)?;
    if let Some(energy) = columns.iter().find(|c| c.of_an_hour)
        && step != HOUR
    {
        let name = quoted(head.names.values[energy.index]);
        let problem = format!("{name} is energy of an hour, but rows are {step} s apart");
        return Err(head.names.error(problem).remedy("use irradiance, or hourly rows"));
    }
    let back = match stamp_of_rows {
        Stamp::Start => 0.0,
        Stamp::Middle => 0.5 * step,
        Stamp::End => step,
    };
    let typical = head.typical || (head.source == Source::Nsrdb && is_typical(&records, &dates));
    for (record, (date, clock)) in records.iter_mut().zip(dates) {
        record.start.unix = record.from - back;
        record.from = match typical {
            true => in_typical_year(date) + clock - back,
            false => record.start.unix,
        };
        record.to = record.from + step;
    }
    let clock = if typical { Clock::TypicalYear { zone: head.zone } } else { Clock::Unix };
    Ok(Weather { path: path.into(), site: head.site, notes: Vec::new(), clock, records })
}

/// Returns the shortest time between neighbouring rows, s. Error: it is not 1 s to 1 h, or there
/// are fewer than two rows.
fn step(path: &Path, records: &[Record]) -> Result<f64> {
    let mut times: Vec<f64> = records.iter().map(|record| record.from).collect();
    times.sort_by(f64::total_cmp);
    let steps = times.windows(2).map(|pair| pair[1] - pair[0]).filter(|&step| step > 0.0);
    let step = steps.fold(f64::INFINITY, f64::min);
    match (1.0..=HOUR).contains(&step) {
        true => Ok(step),
        false if records.len() < 2 => Err(Error::input(path.display(), "holds less than two rows")
            .remedy("the time between rows says how long each one counts")),
        false => Err(Error::input(path.display(), format!("rows are {step} s apart"))
            .remedy("use rows 1 s to 1 h apart")),
    }
}

/// Returns whether rows are a typical year: months of several years, or a leap year without its
/// leap day.
fn is_typical(records: &[Record], dates: &[(Date, f64)]) -> bool {
    let has = |month: u32, day: u32| dates.iter().any(|(d, _)| (d.month, d.day) == (month, day));
    let years = || dates.iter().map(|(date, _)| date.year);
    let first = years().min();
    if first == years().max() {
        let leap = first.is_some_and(|year| Date::new(year, 2, 29).is_some());
        return leap && has(2, 28) && has(3, 1) && !has(2, 29);
    }
    let mut days: Vec<(u32, u32)> = dates.iter().map(|(d, _)| (d.month, d.day)).collect();
    days.sort_unstable();
    days.dedup();
    let hours: f64 = records.windows(2).map(|p| (p[1].from - p[0].from).abs().min(HOUR)).sum();
    let jumps = records.windows(2).any(|p| !(0.0..15.0 * DAY).contains(&(p[1].from - p[0].from)));
    jumps && hours < (days.len() as f64 + 1.0) * DAY
}

/// A column of irradiance.
struct Found {
    what: Column,
    index: usize,
    /// W/m2 of its unit.
    factor: f64,
    of_an_hour: bool,
}

impl Head<'_, '_> {
    fn error(&self, problem: impl std::fmt::Display) -> Error {
        self.names.error(problem)
    }

    /// Finds the columns of irradiance.
    fn columns(&self) -> Result<Vec<Found>> {
        let mut found: Vec<Found> = Vec::new();
        for (index, whole) in self.names.values.iter().enumerate() {
            let (name, unit) = name_and_unit(whole);
            let known = NAMES.iter().find(|(_, names)| names.contains(&name.as_str()));
            let Some(&(what, _)) = known else {
                if whole.trim_start().starts_with('{') {
                    let remedy = "fetch it as CSV (of Open-Meteo by `&format=csv`)";
                    return Err(self.error("this is JSON, not a table").remedy(remedy));
                }
                if self.source == Source::Plain && name != "time" {
                    let problem = format!("unknown column {}", quoted(whole));
                    return Err(self.error(problem).remedy(KINDS));
                }
                continue;
            };
            if found.iter().any(|c| c.what == what) {
                return Err(self.error(format!("two columns {whole}")).remedy("keep one of them"));
            }
            if name.ends_with("(i)") {
                self.check_slope(whole)?;
            }
            let of_head = self.units.iter().find(|(of, _)| of.eq_ignore_ascii_case(&name));
            let unit = unit.or(of_head.map(|(_, unit)| unit.as_str())).unwrap_or("W/m2");
            let Some((factor, of_an_hour)) = watts(unit) else {
                let problem = format!("{} is in {}, not in W/m2", quoted(whole), quoted(unit));
                return Err(self.error(problem).remedy("fetch the table in W/m2, or convert it"));
            };
            found.push(Found { what, index, factor, of_an_hour });
        }
        let has = |what| found.iter().any(|c| c.what == what);
        let enough = has(Column::Global)
            || has(Column::Diffuse) && (has(Column::Direct) || has(Column::Beam));
        match enough {
            true => Ok(found),
            false => Err(self
                .error("neither global irradiance nor both direct and diffuse (no `ghi`, or `dni` and `dhi`)")
                .remedy(LOOKED_FOR)),
        }
    }

    /// Refuses the inclined plane of PVGIS, unless it is horizontal.
    fn check_slope(&self, name: &str) -> Result<()> {
        let slope = self.units.iter().find(|(key, _)| key == "slope");
        let level = slope.and_then(|(_, value)| number_after(value, ""));
        if level == Some(0.0) {
            return Ok(());
        }
        let of = slope.map_or("unknown slope".to_owned(), |(_, value)| format!("slope {value}"));
        let problem = format!("{} is irradiance of an inclined plane ({of})", quoted(name));
        Err(self.error(problem).remedy("fetch it with slope 0, or as typical year (TMY)"))
    }

    /// Finds the columns of time.
    fn times(&self) -> Result<Times> {
        let at = |wanted: &str| {
            self.names.values.iter().position(|name| name_and_unit(name).0 == wanted)
        };
        let need = |wanted: &str| {
            at(wanted).ok_or_else(|| self.error(format!("no column `{wanted}`")).remedy(KINDS))
        };
        let zone = self.zone;
        Ok(match self.source {
            Source::Plain => Times::Iso { column: need("time")?, zone: None },
            Source::OpenMeteo => Times::Iso { column: need("time")?, zone: Some(zone) },
            Source::Pvgis => Times::Pvgis,
            Source::Nsrdb => Times::Parts {
                columns: [need("year")?, need("month")?, need("day")?, need("hour")?],
                minute: at("minute"),
                zone,
            },
            Source::Power => Times::Parts {
                columns: [need("year")?, need("mo")?, need("dy")?, need("hr")?],
                minute: None,
                zone,
            },
        })
    }
}

/// Where the time of a row stands.
enum Times {
    /// ISO 8601 or seconds since 1970; without an offset of its own it has that of the head.
    Iso {
        column: usize,
        zone: Option<f64>,
    },
    /// `20160101:0011`, UTC.
    Pvgis,
    Parts {
        columns: [usize; 4],
        minute: Option<usize>,
        zone: f64,
    },
}

impl Times {
    fn of(&self, line: &Line) -> Result<Time> {
        let civil = |date: Date, clock: f64, zone: f64| Time {
            date,
            clock,
            stamp: Timestamp { unix: date.days() as f64 * DAY + clock - zone, offset: zone },
        };
        let of_stamp = |stamp: Timestamp| {
            let local = stamp.unix + stamp.offset;
            let date = Date::from_days((local / DAY).floor() as i64);
            Time { date, clock: local.rem_euclid(DAY), stamp }
        };
        match *self {
            Self::Iso { column, zone } => {
                let text = line.text(column, "time")?;
                let Some(zone) = zone else { return Ok(of_stamp(parse_time(text, line.place())?)) };
                let seconds =
                    text.parse().ok().filter(|s: &i64| (-2e9..4.1e9).contains(&(*s as f64)));
                if let Some(seconds) = seconds {
                    return Ok(of_stamp(Timestamp { unix: seconds as f64, offset: zone }));
                }
                let minutes = (zone / 60.0).round() as i64;
                let (sign, minutes) = (if minutes < 0 { '-' } else { '+' }, minutes.abs());
                let offset = format!("{sign}{:02}:{:02}", minutes / 60, minutes % 60);
                let clock = text.split_once(['T', ' ']).map_or("", |(_, clock)| clock);
                let own = clock.contains(['Z', 'z', '+', '-']);
                let text = if own { text.to_owned() } else { format!("{text}{offset}") };
                Ok(of_stamp(parse_time(&text, line.place())?))
            }
            Self::Pvgis => {
                let text = line.text(0, "the time")?;
                let wrong = || {
                    line.error(format!("the time is {}", quoted(text)))
                        .remedy("PVGIS writes it like 20160101:0011")
                };
                let number = |from: usize, to: usize| -> Result<i64> {
                    let digits =
                        text.get(from..to).filter(|t| t.bytes().all(|b| b.is_ascii_digit()));
                    digits.and_then(|t| t.parse().ok()).ok_or_else(wrong)
                };
                if text.len() != 13 || text.as_bytes().get(8) != Some(&b':') {
                    return Err(wrong());
                }
                let (month, day) = (number(4, 6)? as u32, number(6, 8)? as u32);
                let date = Date::new(number(0, 4)?, month, day).ok_or_else(wrong)?;
                let clock = number(9, 11)? as f64 * HOUR + number(11, 13)? as f64 * 60.0;
                if clock >= DAY {
                    return Err(wrong());
                }
                Ok(civil(date, clock, 0.0))
            }
            Self::Parts { columns: [year, month, day, hour], minute, zone } => {
                let year = line.integer(year, "the year", 1900..=2100)?;
                let date = date(line, year, month, day)?;
                let hour = line.integer(hour, "the hour", 0..=23)?;
                let minute = match minute {
                    Some(column) => line.integer(column, "the minute", 0..=59)?,
                    None => 0,
                };
                Ok(civil(date, hour as f64 * HOUR + minute as f64 * 60.0, zone))
            }
        }
    }
}

/// Returns the W/m2 of a unit, and whether it is energy of an hour.
fn watts(unit: &str) -> Option<(f64, bool)> {
    let plain: String = unit
        .to_lowercase()
        .replace('²', "2")
        .chars()
        .filter(|c| !matches!(c, ' ' | '^' | '-' | '*' | '.'))
        .collect();
    Some(match plain.as_str() {
        "w/m2" | "wm2" => (1.0, false),
        "kw/m2" | "kwm2" => (1000.0, false),
        "wh/m2" | "whm2" | "wh/m2/h" | "whr/m2" => (1.0, true),
        "kwh/m2" | "kwhr/m2" => (1000.0, true),
        "mj/m2" | "mj/hr" | "mj/h" | "mj/m2/h" | "mj/m2/hr" | "mj/m2/hour" => (1e6 / HOUR, true),
        "kj/m2" | "kj/m2/h" | "kj/m2/hr" => (1e3 / HOUR, true),
        _ => return None,
    })
}
