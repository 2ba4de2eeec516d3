//! Reads weather files: their format is told by their first lines. EPW, TMY3 and TMY2 are read here,
//! all other tables in `tables`.

use std::path::Path;

use super::{
    calendar::mend_leap_day,
    cells::{KINDS, Line, Odd, cells, date, existing, in_typical_year},
    record::{Clock, DAY, HOUR, Record, Site, Stamp, Weather},
    tables,
};
use crate::input::quoted;
use phylux_core::{
    error::{Error, Result},
    scene::daylight::{Date, Timestamp},
};

/// Reads a weather file; [`Weather::parse`] describes the errors.
pub(super) fn parse(bytes: &[u8], path: &Path, stamp: Option<Stamp>) -> Result<Weather> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    // names of places may be in any encoding, but numbers are ASCII in all of them
    let text = String::from_utf8_lossy(bytes);
    let lines = text.lines().zip(1..).map(|(text, line)| Line {
        path,
        line,
        whole: text,
        values: cells(text),
    });
    // skip lines without content
    let lines: Vec<Line> = lines.filter(|l| l.values.iter().any(|v| !v.is_empty())).collect();
    let Some(first) = lines.first() else {
        return Err(Error::input(path.display(), "is empty").remedy(KINDS));
    };
    if bytes.contains(&0) {
        return Err(Error::input(path.display(), "is not text but binary").remedy(KINDS));
    }
    let epw = first.values[0].eq_ignore_ascii_case("LOCATION");
    let tmy3 = lines.get(1).is_some_and(|l| l.values[0].starts_with("Date (MM/DD/YYYY)"));
    let tmy2 = is_tmy2(first);
    if stamp.is_some() && (epw || tmy3 || tmy2) {
        let problem = "`stamp` goes with CSV alone: EPW, TMY3 and TMY2 give the hour that ends";
        return Err(Error::input(path.display(), problem).remedy("leave `stamp` out"));
    }
    let mut odd = Odd::default();
    let mut weather = if epw {
        read_epw(path, &lines, &mut odd)?
    } else if tmy3 {
        read_tmy3(path, &lines, &mut odd)?
    } else if tmy2 {
        read_tmy2(path, &lines, &mut odd)?
    } else {
        tables::read(path, &lines, stamp, &mut odd)?
    };
    weather.notes.extend(odd.note());
    if weather.records.is_empty() {
        return Err(Error::input(path.display(), "holds no hour").remedy(KINDS));
    }
    mend_leap_day(weather.clock, &mut weather.records);
    weather.records.sort_by(|a, b| a.from.total_cmp(&b.from));
    for pair in weather.records.windows(2) {
        // times may be rounded to decimal minutes, so allow for an overlap of a second
        if pair[1].from < pair[0].to - 1.0 {
            let line = pair[0].line.max(pair[1].line);
            let problem = format!("its hour stands in line {} too", pair[0].line.min(pair[1].line));
            return Err(Error::input(format_args!("{}:{line}", path.display()), problem)
                .remedy("keep one of them"));
        }
    }
    Ok(weather)
}

/// Returns the record of the hour that ends at `hour` of a day, on the clock of a typical year,
/// with its global, direct normal and diffuse light.
fn typical(
    line: &Line,
    (date, hour): (Date, i64),
    zone: f64,
    [global, direct, diffuse]: [Option<f64>; 3],
) -> Record {
    let since_midnight = (hour - 1) as f64 * HOUR;
    let unix = date.days() as f64 * DAY + since_midnight - zone;
    let from = in_typical_year(date) + since_midnight;
    let (to, start) = (from + HOUR, Timestamp { unix, offset: zone });
    Record { line: line.line, from, to, start, global, direct, diffuse }
}

/// Reads EnergyPlus weather (Auxiliary programs, EnergyPlus 9.6): eight lines about the place, then
/// one line per hour.
fn read_epw(path: &Path, lines: &[Line], odd: &mut Odd) -> Result<Weather> {
    lines[0].count(10..=10)?;
    let site = lines[0].site(6, 7)?;
    let zone = lines[0].zone(8)?;
    let periods = lines.iter().position(|l| l.values[0].eq_ignore_ascii_case("DATA PERIODS"));
    let Some(periods) = periods else {
        return Err(Error::input(path.display(), "has no line `DATA PERIODS`")
            .remedy("fetch the file again: an EPW file begins with eight such lines"));
    };
    let per_hour = lines[periods].integer(2, "the number of records in an hour", 1..=60)?;
    if per_hour != 1 {
        let problem = format!("{per_hour} records in an hour");
        return Err(lines[periods].error(problem).remedy("use a file of whole hours"));
    }
    let mut records = Vec::new();
    for line in &lines[periods + 1..] {
        let year = line.integer(0, "the year", 1900..=2100)?;
        let date = date(line, year, 1, 2)?;
        let hour = line.integer(3, "the hour", 1..=24)?;
        let mut value = |column, name| line.irradiance(column, name, odd);
        let light = [value(13, "global")?, value(14, "direct normal")?, value(15, "diffuse")?];
        records.push(typical(line, (date, hour), zone, light));
    }
    Ok(typical_year(path, site, zone, records))
}

/// Reads a typical meteorological year, third collection (Wilcox and Marion, NREL/TP-581-43156,
/// 2008).
fn read_tmy3(path: &Path, lines: &[Line], odd: &mut Odd) -> Result<Weather> {
    lines[0].count(7..=7)?;
    let zone = lines[0].zone(3)?;
    let site = lines[0].site(4, 5)?;
    let header = &lines[1];
    let column = |name: &str| {
        header.values.iter().position(|v| v.starts_with(name)).ok_or_else(|| {
            header.error(format!("no column `{name}`")).remedy("fetch the file again")
        })
    };
    let columns = [column("GHI (W/m^2)")?, column("DNI (W/m^2)")?, column("DHI (W/m^2)")?];
    let mut records = Vec::new();
    for line in &lines[2..] {
        let text = line.text(0, "the date")?;
        let numbers: Vec<Option<i64>> = text.split('/').map(|part| part.parse().ok()).collect();
        let date = match numbers[..] {
            [Some(month @ 1..=12), Some(day @ 1..=31), Some(year)] => {
                Date::new(year, month as u32, day as u32)
            }
            _ => None,
        };
        let date = date.ok_or_else(|| {
            line.error(format!("the date is {}", quoted(text))).remedy("write it like 06/21/1998")
        })?;
        let text = line.text(1, "the time")?;
        let mut parts = text.split(':');
        let hour = parts.next().and_then(|hour| hour.parse().ok());
        let is_whole = parts.all(|part| part.parse() == Ok(0));
        let hour = hour.filter(|hour| is_whole && (0..=24).contains(hour)).ok_or_else(|| {
            line.error(format!("the time is {}, must be 01:00 to 24:00", quoted(text)))
                .remedy("fetch the file again")
        })?;
        // some write the end of a day as 00:00 of the next one
        let (date, hour) = match hour {
            0 => (Date::from_days(date.days() - 1), 24),
            _ => (date, hour),
        };
        let mut value = |k: usize, name| line.irradiance(columns[k], name, odd);
        let light = [value(0, "GHI")?, value(1, "DNI")?, value(2, "DHI")?];
        records.push(typical(line, (date, hour), zone, light));
    }
    Ok(typical_year(path, site, zone, records))
}

fn typical_year(path: &Path, site: Site, zone: f64, records: Vec<Record>) -> Weather {
    let clock = Clock::TypicalYear { zone };
    Weather { path: path.into(), site: Some(site), notes: Vec::new(), clock, records }
}

/// Columns of the letters for north or south and for east or west in the first line of a TMY2 file.
const SIDES: [usize; 2] = [37, 45];

/// Returns whether this is the first line of a TMY2 file.
fn is_tmy2(line: &Line) -> bool {
    let [north, east] = SIDES.map(|at| line.whole.as_bytes().get(at).copied());
    matches!(north, Some(b'N' | b'S')) && matches!(east, Some(b'E' | b'W'))
}

/// Reads a typical meteorological year, second collection (Marion and Urban, User's manual for
/// TMY2s, NREL/SP-463-7668, 1995): columns of fixed widths, of which those of irradiance hold Wh/m2
/// of an hour.
fn read_tmy2(path: &Path, lines: &[Line], odd: &mut Odd) -> Result<Weather> {
    let head = &lines[0];
    let degrees = |at: usize, digits: usize, side: usize, negative: &str| -> Result<f64> {
        let whole = head.fixed(at..at + digits, "degrees", 0..=180)?;
        let minutes = head.fixed(at + digits + 1..at + digits + 3, "minutes", 0..=59)?;
        let sign = if head.cut(side..side + 1)? == negative { -1.0 } else { 1.0 };
        Ok(sign * (whole as f64 + minutes as f64 / 60.0))
    };
    let site = Site {
        latitude: degrees(39, 2, SIDES[0], "S")?,
        longitude: degrees(47, 3, SIDES[1], "W")?,
    };
    let site = head.checked(site)?;
    let zone = head.fixed(33..36, "the time zone", -14..=14)? as f64 * HOUR;
    let mut records = Vec::new();
    for line in &lines[1..] {
        let year = 1900 + line.fixed(1..3, "the year", 0..=99)?;
        let month = line.fixed(3..5, "the month", 1..=12)?;
        let day = line.fixed(5..7, "the day", 1..=31)?;
        let date = existing(line, year, month, day)?;
        let hour = line.fixed(7..9, "the hour", 1..=24)?;
        let mut value = |from: usize, name: &str| -> Result<Option<f64>> {
            Ok(odd.irradiance(line.cut(from..from + 4)?, 1.0, name, line.line))
        };
        let light = [value(17, "global")?, value(23, "direct normal")?, value(29, "diffuse")?];
        records.push(typical(line, (date, hour), zone, light));
    }
    Ok(typical_year(path, site, zone, records))
}
