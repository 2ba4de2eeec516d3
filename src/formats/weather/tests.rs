//! Tests with files made here: a clear sky at the latitude of Montpellier, in which global, direct
//! and diffuse irradiance fit together exactly.

use proptest::prelude::*;

use super::record::{DAY, HOUR};
use super::*;
use crate::scene::daylight::Timestamp;
use crate::{
    formats::{iso8601::parse_time, spoil::spoiled},
    scene::daylight::Date,
};

const SITE: Site = Site { latitude: 43.61, longitude: 3.88 };

/// Returns the sine of the sun's elevation in the middle of the hour that ends at `hour` (standard
/// time, UTC + 1), if the file's clock is `late` h behind.
fn sine(month: u32, day: u32, hour: f64, late: f64) -> f64 {
    let start = Date { year: 2005, month, day }.days() as f64 * DAY - HOUR;
    let start = crate::scene::daylight::Timestamp { unix: start, offset: HOUR };
    SITE.sun(start, (hour - 0.5 + late) * HOUR).elevation.sin().max(0.0)
}

/// Returns global, direct and diffuse irradiance of that hour, W/m2.
fn clear(month: u32, day: u32, hour: f64, late: f64) -> [f64; 3] {
    let sine = sine(month, day, hour, late);
    let (direct, diffuse) =
        if sine > 0.0 { (900.0 * sine.sqrt(), 120.0 * sine) } else { (0.0, 0.0) };
    [direct * sine + diffuse, direct, diffuse]
}

/// Writes a year in which the sun of each hour is that of `late` hours later.
fn epw(late: f64) -> String {
    let mut text = String::from(
        "LOCATION,Montpellier,-,FRA,made,0,43.61,3.88,1.0,5\nDESIGN CONDITIONS,0\nTYPICAL/EXTREME PERIODS,0\n\
         GROUND TEMPERATURES,0\nHOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0\nCOMMENTS 1,made\nCOMMENTS 2\n\
         DATA PERIODS,1,1,Data,Sunday,1/1,12/31\n",
    );
    let first = Date { year: 2005, month: 1, day: 1 }.days();
    for day in 0..365 {
        let Date { month, day, .. } = Date::from_days(first + day);
        for hour in 1..=24 {
            let [global, direct, diffuse] = clear(month, day, f64::from(hour), late);
            text += &format!(
                "2005,{month},{day},{hour},60,?9?9,12,5,60,101000,0,0,300,{global:.2},{direct:.2},{diffuse:.2},0\n"
            );
        }
    }
    text
}

fn read(text: &str) -> Result<Weather> {
    Weather::parse(text.as_bytes(), Path::new("a.epw"), None)
}

fn span(from: &str, to: &str) -> Period {
    Period::Span { from: time(from), to: time(to) }
}

fn time(text: &str) -> Timestamp {
    parse_time(text, "time").unwrap()
}

#[test]
fn a_year_has_the_mean_of_its_hours() {
    let weather = read(&epw(0.0)).unwrap();
    assert_eq!(weather.site, Some(SITE));
    assert_eq!(weather.records.len(), 8760);
    let selected = weather.select(Period::Year, SITE, 0.0).unwrap();
    assert_eq!((selected.length, selected.estimated), (8760.0, 0));
    assert!(selected.warnings().is_empty(), "{:?}", selected.warnings());
    let mean = |f: &dyn Fn(&crate::scene::daylight::Hour) -> f64| -> f64 {
        selected.hours.iter().map(|h| h.weight * f(h)).sum()
    };
    let total = |k: usize| {
        weather.records.iter().map(|r| [r.global, r.direct, r.diffuse][k].unwrap()).sum::<f64>()
            / 8760.0
    };
    assert!((mean(&|h| h.direct_normal) - total(1)).abs() < 1e-9);
    assert!((mean(&|h| h.diffuse_horizontal) - total(2)).abs() < 1e-9);
    let closed = mean(&|h| h.direct_normal * h.sun.elevation.sin() + h.diffuse_horizontal);
    // sunrise and sunset differ, where the sun is taken in the middle of the sunlit part
    assert!((closed / total(0) - 1.0).abs() < 2e-3, "{closed} {}", total(0));
}

#[test]
fn an_instant_takes_its_hour() {
    let weather = read(&epw(0.0)).unwrap();
    let at = |text: &str| weather.select(Period::Instant(time(text)), SITE, 0.0).unwrap();
    // 13:46 summer time is 12:46 on the file's clock, in the hour that ends at 13
    let noon = at("2031-06-21T13:46+02:00");
    let [_, direct, diffuse] = clear(6, 21, 13.0, 0.0);
    assert_eq!((noon.hours.len(), noon.length, noon.hours[0].weight), (1, 0.0, 1.0));
    assert!((noon.hours[0].direct_normal - direct).abs() < 0.01);
    assert!((noon.hours[0].diffuse_horizontal - diffuse).abs() < 0.01);
    assert!((noon.hours[0].sun.elevation.to_degrees() - 69.8).abs() < 0.05);
    assert!(at("2025-06-21T23:00Z").hours.is_empty());
    // a leap day has the weather of the day before
    let leap = at("2024-02-29T12:00Z").hours[0].direct_normal;
    assert!((leap - clear(2, 28, 14.0, 0.0)[1]).abs() < 0.01, "{leap}");
    // with a clock that is an hour behind, the same instant lies an hour earlier in the file
    let shifted =
        weather.select(Period::Instant(time("2031-06-21T13:46+02:00")), SITE, 1.0).unwrap();
    let [_, direct, _] = clear(6, 21, 12.0, 0.0);
    assert!((shifted.hours[0].direct_normal - direct).abs() < 0.01);
}

#[test]
fn a_period_takes_its_part() {
    let weather = read(&epw(0.0)).unwrap();
    let select = |period| weather.select(period, SITE, 0.0);
    let sum = |period| -> f64 {
        let selected = select(period).unwrap();
        selected.hours.iter().map(|h| h.weight * h.direct_normal).sum::<f64>() * selected.length
    };
    // half of the hour that ends at 13, and all of the next hour
    let part = select(span("2025-06-21T12:30+01:00", "2025-06-21T14:00+01:00")).unwrap();
    assert_eq!(part.length, 1.5);
    let weights: Vec<f64> = part.hours.iter().map(|h| h.weight).collect();
    assert!((weights[0] - 1.0 / 3.0).abs() < 1e-12 && (weights[1] - 2.0 / 3.0).abs() < 1e-12);
    // nights count: a day has 24 h
    let day = select(span("2025-06-21T00:00+01:00", "2025-06-22T00:00+01:00")).unwrap();
    assert_eq!(day.length, 24.0);
    let expected: f64 = (1..=24).map(|hour| clear(6, 21, f64::from(hour), 0.0)[1]).sum();
    assert!((sum(span("2025-06-21T00:00+01:00", "2025-06-22T00:00+01:00")) - expected).abs() < 0.2);
    // two halves give the same as the whole, also across New Year
    let halves = sum(span("2024-12-20T00:00Z", "2024-12-31T12:00Z"))
        + sum(span("2024-12-31T12:00Z", "2025-01-10T00:00Z"));
    let whole = sum(span("2024-12-20T00:00Z", "2025-01-10T00:00Z"));
    assert!((halves / whole - 1.0).abs() < 1e-9, "{halves} {whole}");
    // the sun is taken in the sunlit part of the hour in which it rises
    let rise = select(span("2025-06-21T05:00+01:00", "2025-06-21T06:00+01:00")).unwrap();
    assert!(rise.hours.iter().all(|h| h.sun.elevation > 0.0));
    for (period, start) in [
        (span("2025-06-21T05:00Z", "2025-06-21T05:00Z"), "a.epw: the period ends before it starts"),
        (span("2025-06-21T05:00Z", "2027-06-21T05:00Z"), "a.epw: the period is longer than a year"),
        (
            span("2024-02-29T05:00Z", "2024-02-29T08:00Z"),
            "a.epw: the period lies within 29 February, which a typical year has not",
        ),
    ] {
        let error = select(period).unwrap_err().to_string();
        assert!(error.starts_with(start), "{error}");
    }
    // a whole year may begin on any day
    let year = select(span("2025-06-21T00:00Z", "2026-06-21T00:00Z")).unwrap();
    assert_eq!(year.length, 8760.0);
}

/// As in real files, times are right in the middle of the hour, or the clock is another one such as
/// UTC.
#[test]
fn the_clock_is_tested_by_closure() {
    for (late, best) in [(0.0, 0.0), (0.68, 0.68), (-0.5, -0.5)] {
        let check = read(&epw(late)).unwrap().check_clock(SITE, 0.0).unwrap();
        assert!((check.best_shift - best).abs() < 0.015, "{late}: {check:?}");
        assert!(check.best_rms < 1.0, "{late}: {check:?}");
        match late == 0.0 {
            true => assert_eq!(check.warning(), None),
            false => {
                let warning = check.warning().unwrap();
                assert!(
                    warning.contains(&format!("with `shift_h` {best:.2} they fit")),
                    "{warning}"
                );
            }
        }
    }
    let check = read(&epw(0.68)).unwrap().check_clock(SITE, 0.68).unwrap();
    assert_eq!(check.warning(), None);
}

/// Global irradiance alone is enough, with a warning; an hour by day without any irradiance is an
/// error.
#[test]
fn what_is_missing_is_estimated_or_named() {
    let whole = epw(0.0);
    let change = |row: usize, columns: &[usize]| {
        let mut lines: Vec<String> = whole.lines().map(str::to_owned).collect();
        let mut values: Vec<&str> = lines[row].split(',').collect();
        columns.iter().for_each(|&c| values[c] = "9999");
        lines[row] = values.join(",");
        read(&lines.join("\n")).unwrap()
    };
    // 21 June, the hour that ends at 13, is row 8 + 171 x 24 + 12 counted from 0, so its line
    // number is one more
    let row = 8 + 171 * 24 + 12;
    let day = span("2025-06-21T00:00+01:00", "2025-06-22T00:00+01:00");
    let selected = change(row, &[14, 15]).select(day, SITE, 0.0).unwrap();
    assert_eq!(selected.estimated, 1);
    assert!(selected.warnings()[0].contains("1 records are estimated from the global by Erbs"));
    let error = change(row, &[13, 14]).select(day, SITE, 0.0).unwrap_err().to_string();
    let start =
        format!("a.epw:{}: 1 needed row lacks irradiances, this the first; choose", row + 1);
    assert!(error.starts_with(&start), "{error}");
    // missing values are harmless at night and on other days
    assert!(change(row - 12, &[13, 14, 15]).select(day, SITE, 0.0).is_ok());
    assert!(change(row + 24, &[13, 14, 15]).select(day, SITE, 0.0).is_ok());
    // missing rows
    let cut: Vec<&str> = whole
        .lines()
        .enumerate()
        .filter(|(i, _)| !(row..row + 3).contains(i))
        .map(|(_, l)| l)
        .collect();
    let error = read(&cut.join("\n")).unwrap().select(day, SITE, 0.0).unwrap_err().to_string();
    let start =
        "a.epw: 3 needed hours are missing: 06-21 12:00, 06-21 13:00, 06-21 14:00; choose another";
    assert!(error.starts_with(start), "{error}");
    let instant = Period::Instant(time("2025-06-21T12:30+01:00"));
    let error = read(&cut.join("\n")).unwrap().select(instant, SITE, 0.0).unwrap_err().to_string();
    assert!(error.starts_with("a.epw: 1 needed hour is missing: 06-21 12:30; choose"), "{error}");
    // direct light while the sun is below the horizon
    let mut lines: Vec<String> = whole.lines().map(str::to_owned).collect();
    lines[row - 12] = lines[row - 12].replace("0.00,0.00,0.00", "0.00,50.00,3.00");
    let selected = read(&lines.join("\n")).unwrap().select(day, SITE, 0.0).unwrap();
    assert!((selected.dropped_direct - 50.0).abs() < 1e-9);
    assert!(
        selected.warnings()[0].starts_with("50.0 Wh/m2 of direct light while the sun is below")
    );
}

#[test]
fn csv_rows_stand_where_their_stamp_says() {
    let text = "time,ghi,dni,dhi\n2025-06-21T12:00+01:00,900,800,150\n2025-06-21T12:30+01:00,880,780,160\n";
    let at = |stamp, time_text: &str| {
        let weather = Weather::parse(text.as_bytes(), Path::new("a.csv"), Some(stamp)).unwrap();
        let selected = weather.select(Period::Instant(time(time_text)), SITE, 0.0);
        selected.map(|s| s.hours[0].direct_normal)
    };
    assert_eq!(at(Stamp::Start, "2025-06-21T12:29+01:00").unwrap(), 800.0);
    assert_eq!(at(Stamp::Middle, "2025-06-21T12:29+01:00").unwrap(), 780.0);
    assert_eq!(at(Stamp::End, "2025-06-21T12:29+01:00").unwrap(), 780.0);
    assert_eq!(at(Stamp::End, "2025-06-21T11:31+01:00").unwrap(), 800.0);
    let error = at(Stamp::End, "2025-06-21T12:31+01:00").unwrap_err().to_string();
    assert!(error.starts_with("a.csv: 1 needed hour is missing: 2025-06-21T11:31Z"), "{error}");
    let weather = Weather::parse(text.as_bytes(), Path::new("a.csv"), Some(Stamp::Start)).unwrap();
    let error = weather.select(Period::Year, SITE, 0.0).unwrap_err().to_string();
    assert!(error.starts_with("a.csv: covers 0.0 days, not a year; give a period"), "{error}");
    // global irradiance alone
    let text = "time,ghi\n2025-06-21T10:00Z,500\n2025-06-21T11:00Z,-3\n";
    let weather = Weather::parse(text.as_bytes(), Path::new("a.csv"), Some(Stamp::Start)).unwrap();
    let period = span("2025-06-21T10:00Z", "2025-06-21T12:00Z");
    let selected = weather.select(period, SITE, 0.0).unwrap();
    assert_eq!((selected.hours.len(), selected.estimated), (1, 1));
    let hour = selected.hours[0];
    let closed = hour.direct_normal * hour.sun.elevation.sin() + hour.diffuse_horizontal;
    assert!((closed - 500.0).abs() < 1e-9);
}

#[test]
fn tmy3_is_read() {
    let mut text = String::from(
        "722780,\"PHOENIX\",AZ,-7.0,33.450,-111.983,337\nDate (MM/DD/YYYY),Time (HH:MM),\
         ETR (W/m^2),GHI (W/m^2),GHI source,DNI (W/m^2),DHI (W/m^2)\n",
    );
    for hour in 1..=24 {
        text += &format!("06/21/1998,{hour:02}:00,0,{},1,{},-9900\n", 10 * hour, 20 * hour);
    }
    let weather = read(&text).unwrap();
    assert_eq!(weather.site, Some(Site { latitude: 33.45, longitude: -111.983 }));
    let record = weather.records[11];
    assert_eq!((record.global, record.direct, record.diffuse), (Some(120.0), Some(240.0), None));
    assert_eq!(record.start.unix, time("1998-06-21T11:00-07:00").unix);
}

#[test]
fn broken_files_get_their_sentence() {
    let whole = epw(0.0);
    let head: Vec<&str> = whole.lines().take(9).collect();
    let with = |row: &str| [&head[..8], &[row]].concat().join("\n");
    let good = head[8];
    for (text, start) in [
        (String::new(), "a.epw: is empty; weather files are EPW, TMY3, or CSV"),
        (
            "x".into(),
            "a.epw: does not say where in its interval the time of a row stands; set `stamp`",
        ),
        ("\0\u{1}".into(), "a.epw: is not text but binary; weather files are EPW"),
        (head[..8].join("\n"), "a.epw: holds no hour; weather files are"),
        (head[..7].join("\n"), "a.epw: has no line `DATA PERIODS`; fetch"),
        (with(&good[..20]), "a.epw:9: 7 values, global should be number 14; the line is cut off"),
        (with(&good.replace("2005,1,1,1,", "2005,2,31,1,")), "a.epw:9: there is no day 2005-02-31"),
        (
            with(&good.replace("2005,1,1,1,", "2005,1,1,25,")),
            "a.epw:9: the hour is `25`, must be 1 to 24",
        ),
        (
            with(&good.replace("300,0.00", "300,nan")),
            "a.epw:9: global is `nan`, not a finite number",
        ),
        (
            with(&good.replace("300,0.00", "300,3000")),
            "a.epw:9: global is 3000 W/m2, must be 0 to 2000",
        ),
        (
            with(&good.replace("300,0.00", "300,-90")),
            "a.epw:9: global is -90 W/m2, must be 0 to 2000",
        ),
        (with(&format!("{good}\n{good}")), "a.epw:10: its hour stands in line 9 too; keep one"),
        (whole.replace("43.61", "143.61"), "a.epw:1: no place has latitude 143.61, longitude 3.88"),
        (
            whole.replace("PERIODS,1,1", "PERIODS,1,4"),
            "a.epw:8: 4 records in an hour; use a file of whole",
        ),
        (whole.replace("3.88,1.0", "3.88,east"), "a.epw:1: the time zone is `east`, not a finite"),
    ] {
        let error = read(&text).unwrap_err().to_string();
        assert!(error.starts_with(start), "{error}\n{start}");
    }
    let csv = |text: &str| {
        let bytes = text.as_bytes();
        Weather::parse(bytes, Path::new("a.csv"), Some(Stamp::End)).unwrap_err().to_string()
    };
    for (text, start) in [
        ("time,ghi,note\n", "a.csv:1: unknown column `note`; weather files are"),
        ("time,dni\n", "a.csv:1: neither `ghi` nor `dni` and `dhi`"),
        ("ghi,dni\n", "a.csv:1: no column `time`"),
        ("time,ghi,ghi\n", "a.csv:1: two columns ghi; keep one"),
        (
            "time,ghi\n2025-06-21T10:00,5\n",
            "a.csv:2: `2025-06-21T10:00` does not say the clock's offset",
        ),
        ("time,ghi\n2025-06-21T10:00Z,5,6\n", "a.csv:2: 3 values, but the header has 2 columns"),
        ("time,ghi\n2025-06-21T10:00Z,5\n", "a.csv: holds less than two rows"),
        ("time,ghi\n2025-06-21T10:00Z,5\n2025-06-22T10:00Z,5\n", "a.csv: rows are 86400 s apart"),
    ] {
        assert!(csv(text).starts_with(start), "{}\n{start}", csv(text));
    }
    let error = Weather::parse(whole.as_bytes(), Path::new("a.epw"), Some(Stamp::End)).unwrap_err();
    assert!(error.to_string().starts_with("a.epw: `stamp` goes with CSV alone"));
}

const FILES: &[&str] = &[
    "LOCATION,a,-,FRA,b,0,43.61,3.88,1.0,5\nDATA PERIODS,1,1,Data,Sunday,1/1,12/31\n\
     2005,6,21,12,60,?,12,5,60,101000,0,0,300,900,800,100,0\n2004,2,29,13,60,?,12,5,60,101000,0,0,300,900,9999,1,0\n",
    "time,ghi,dni,dhi\n2025-06-21T12:00+01:00,900,800,150\n2025-06-21T12:30+01:00,880,780,160\n",
    "7,\"P\",AZ,-7.0,33.450,-111.983,337\nDate (MM/DD/YYYY),GHI (W/m^2),DNI (W/m^2),DHI (W/m^2)\n06/21/1998,01:00,5,6\n",
];
const WORDS: &[&str] =
    &["LOCATION", "DATA PERIODS", "-24", "9999", "2100", "1900", "29", "12/31/2000"];

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_spoiled_file_panics(bytes in spoiled(FILES, WORDS), stamped: bool) {
        let stamp = stamped.then_some(Stamp::Middle);
        match Weather::parse(&bytes, Path::new("a.epw"), stamp) {
            Err(error) => prop_assert!(error.to_string().starts_with("a.epw")),
            Ok(weather) => {
                for period in [Period::Year, Period::Instant(time("2025-06-21T12:15Z"))] {
                    let _ = weather.select(period, SITE, 0.3);
                }
                let _ = weather.check_clock(SITE, 0.0);
            }
        }
    }
}
