//! Tests with files made here: a clear sky at the latitude of Montpellier, in which global, direct
//! and diffuse irradiance fit together exactly.

use proptest::prelude::*;

use super::record::{DAY, HOUR};
use super::*;
use crate::iso8601::parse_time;
use phylux_core::scene::daylight::Date;
use phylux_core::scene::daylight::Timestamp;
use phylux_testing::spoiled;

const SITE: Site = Site { latitude: 43.61, longitude: 3.88 };

/// Returns the sine of the sun's elevation in the middle of the hour that ends at `hour` (standard
/// time, UTC + 1), if the file's clock is `late` h behind.
fn sine(month: u32, day: u32, hour: f64, late: f64) -> f64 {
    let start = Date { year: 2005, month, day }.days() as f64 * DAY - HOUR;
    let start = phylux_core::scene::daylight::Timestamp { unix: start, offset: HOUR };
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
    let mean = |f: &dyn Fn(&phylux_core::scene::daylight::Hour) -> f64| -> f64 {
        selected.hours.iter().map(|h| h.weight * f(h)).sum()
    };
    let total = |k: usize| {
        weather.records.iter().map(|r| [r.global, r.direct, r.diffuse][k].unwrap()).sum::<f64>()
            / 8760.0
    };
    assert!((mean(&|h| h.direct_normal) - total(1)).abs() < 1e-9);
    assert!((mean(&|h| h.diffuse_horizontal) - total(2)).abs() < 1e-9);
    let closed = mean(&|h| h.global());
    // the global irradiance made here is that of the sun in the middle of each hour
    assert!((closed / total(0) - 1.0).abs() < 5e-3, "{closed} {}", total(0));
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
    // of the hour in which the sun rises, it is taken in the part in which it is up
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
    for (late, best) in [(0.0, 0.0), (0.68, 0.68), (-0.5, -0.5), (-2.0, -2.0), (-7.0, -7.0)] {
        let check = read(&epw(late)).unwrap().check_clock(SITE, 0.0).unwrap();
        assert!((check.best_shift - best).abs() < 0.015, "{late}: {check:?}");
        // the search takes the sun's declination as that of the record
        assert!(check.best_misfit < 1.0 + 0.1 * late.abs(), "{late}: {check:?}");
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
    // a wrong shift of the user's is found as well
    let warnings = read(&epw(-2.0)).unwrap().clock_warnings(SITE, -1.6);
    assert!(warnings[0].contains("with `shift_h` -2.00 they fit within"), "{warnings:?}");
    // columns that fit with no clock get no advice
    let halved: String = epw(0.0)
        .lines()
        .map(|line| {
            let mut values: Vec<String> = line.split(',').map(str::to_owned).collect();
            if let Some(global) = values.get_mut(13) {
                *global = format!("{}", 0.5 * global.parse::<f64>().unwrap());
            }
            values.join(",") + "\n"
        })
        .collect();
    let warning = read(&halved).unwrap().check_clock(SITE, 0.0).unwrap().warning().unwrap();
    assert!(warning.ends_with("whatever the clock: are they of the same place and instruments?"));
}

/// Global irradiance alone shows the clock by the course of the days and by light that cannot be;
/// days that are all cloudy in another way do not, while the clock is right.
#[test]
fn the_clock_is_tested_by_global_irradiance_alone() {
    let weather = |late: f64, cloudy: bool| {
        let rows = epw(late).lines().skip(8).enumerate().fold(String::new(), |text, (i, line)| {
            let values: Vec<&str> = line.split(',').collect();
            // two factors that repeat in no whole number of days
            let cloud = if cloudy { [0.9, 0.3, 0.6, 1.0, 0.2][i * i % 5] } else { 1.0 };
            let global = cloud * values[13].parse::<f64>().unwrap();
            let days = (i / 24) as i64 + Date { year: 2005, month: 1, day: 1 }.days();
            let Date { month, day, .. } = Date::from_days(days);
            text + &format!("2005-{month:02}-{day:02}T{:02}:00+01:00,{global:.1}\n", i % 24)
        });
        let text = format!("time,ghi\n{rows}");
        Weather::parse(text.as_bytes(), Path::new("a.csv"), Some(Stamp::Start)).unwrap()
    };
    for cloudy in [false, true] {
        let right = weather(0.0, cloudy).clock_warnings(SITE, 0.0);
        assert!(right.is_empty(), "{cloudy}: {right:?}");
        // the other end of the day is no better: 13 h later is another day
        for late in [-1.0, 1.0, 2.0, -7.0, -11.0] {
            let weather = weather(late, cloudy);
            let check = weather.check_clock(SITE, 0.0).unwrap();
            assert_eq!(check.by, Evidence::Course);
            let near = if cloudy { 0.25 } else { 0.05 };
            assert!(check.advised && (check.best_shift - late).abs() < near, "{late}: {check:?}");
            assert!(check.warning().unwrap().contains("with `shift_h`"));
            assert!(weather.clock_warnings(SITE, late).is_empty(), "{late}, {cloudy}");
        }
    }
    // light at night, in a file that shows no whole day
    let text = "time,ghi\n2025-06-21T22:00Z,300\n2025-06-21T23:00Z,310\n2025-06-22T00:00Z,20\n";
    let weather = Weather::parse(text.as_bytes(), Path::new("a.csv"), Some(Stamp::Start)).unwrap();
    let warnings = weather.clock_warnings(SITE, 0.0);
    assert_eq!(warnings.len(), 1);
    assert!(warnings[0].starts_with("2 rows have more light than can arrive"), "{warnings:?}");
    assert!(warnings[0].contains("line 3: 310.0 W/m2 where at most 50.0"), "{warnings:?}");
}

/// Direct and diffuse light alone show the clock too, as their sum on the ground must rise and fall
/// with the sun.
#[test]
fn the_clock_is_tested_by_direct_and_diffuse_light() {
    let weather = |late: f64, diffuse: f64| {
        let rows = epw(late).lines().skip(8).enumerate().fold(String::new(), |text, (i, line)| {
            let values: Vec<&str> = line.split(',').collect();
            let days = (i / 24) as i64 + Date { year: 2005, month: 1, day: 1 }.days();
            let Date { month, day, .. } = Date::from_days(days);
            let time = format!("2005-{month:02}-{day:02}T{:02}:00+01:00", i % 24);
            let [direct, rest] = [14, 15].map(|column| values[column].parse::<f64>().unwrap());
            text + &format!("{time},{direct:.1},{:.1}\n", diffuse * rest)
        });
        let text = format!("time,dni,dhi\n{rows}");
        Weather::parse(text.as_bytes(), Path::new("a.csv"), Some(Stamp::Start)).unwrap()
    };
    assert!(weather(0.0, 1.0).clock_warnings(SITE, 0.0).is_empty());
    for late in [-1.0, 1.0, 2.0, -3.0] {
        let weather = weather(late, 1.0);
        let check = weather.check_clock(SITE, 0.0).unwrap();
        assert_eq!(check.by, Evidence::Course);
        assert!(check.advised && (check.best_shift - late).abs() < 0.1, "{late}: {check:?}");
        assert!(weather.clock_warnings(SITE, late).is_empty(), "{late}");
    }
    // direct light alone fits any clock by which the sun is up
    for late in [0.0, 2.0] {
        assert_eq!(weather(late, 0.0).check_clock(SITE, 0.0), None);
    }
}

/// More direct light than there is outside the atmosphere, and hardly any light at noon, are said.
#[test]
fn light_in_other_units_is_said() {
    let warnings = |columns: &str, values: &str| {
        let rows: String =
            (8..16).map(|hour| format!("2025-06-21T{hour:02}:00+01:00,{values}\n")).collect();
        let text = format!("time,{columns}\n{rows}");
        let weather = Weather::parse(text.as_bytes(), Path::new("a.csv"), Some(Stamp::Start));
        weather.unwrap().clock_warnings(SITE, 0.0).join("\n")
    };
    let beyond = warnings("dni,dhi", "1350,20");
    assert!(beyond.contains("W/m2 of direct light where at most 132"), "{beyond}");
    assert!(warnings("ghi,dhi", "0.5,0.1").contains("is the unit kW/m2"));
    assert!(warnings("dni,dhi", "0.5,0.1").contains("hardly any light arrives: of 8 rows"));
    assert_eq!(warnings("dni,dhi", "100,50"), "");
}

/// Rows whose columns contradict each other are counted, and the worst is named.
#[test]
fn measured_global_is_compared() {
    let text = "time,ghi,dni,dhi\n2025-06-21T10:00Z,600,90,90\n2025-06-21T11:00Z,640,0,90\n2025-06-21T12:00Z,95,0,90\n";
    let weather = Weather::parse(text.as_bytes(), Path::new("a.csv"), Some(Stamp::Start)).unwrap();
    let period = span("2025-06-21T10:00Z", "2025-06-21T13:00Z");
    let selected = weather.select(period, SITE, 0.0).unwrap();
    assert_eq!((selected.misfits, selected.worst_misfit), (2, Some((3, [640.0, 90.0]))));
    let warnings = selected.warnings();
    assert!(
        warnings[0].starts_with("the global irradiance of 2 records is not that"),
        "{warnings:?}"
    );
    assert!(warnings[0].contains("in line 3: 640.0 W/m2, not 90.0"), "{warnings:?}");
    let selected = weather.select(Period::Instant(time("2025-06-21T10:30Z")), SITE, 0.0).unwrap();
    assert_eq!(selected.misfits, 1);
}

/// An hour's light is split with the hour's own sun, wherever in it an instant lies.
#[test]
fn an_instant_splits_as_its_hour() {
    let text = "time,ghi\n2025-06-21T18:00Z,100\n2025-06-21T19:00Z,40\n";
    let weather = Weather::parse(text.as_bytes(), Path::new("a.csv"), Some(Stamp::Start)).unwrap();
    let hour = weather.select(span("2025-06-21T18:00Z", "2025-06-21T19:00Z"), SITE, 0.0).unwrap();
    for minute in ["01", "30", "59"] {
        let at = Period::Instant(time(&format!("2025-06-21T18:{minute}Z")));
        let found = weather.select(at, SITE, 0.0).unwrap();
        assert_eq!(found.hours[0].direct_normal, hour.hours[0].direct_normal, "{minute}");
        assert_eq!(found.hours[0].diffuse_horizontal, hour.hours[0].diffuse_horizontal);
    }
}

/// 29 February counts where the file has it: for an instant, a mean and a year.
#[test]
fn a_leap_day_counts_if_the_file_has_it() {
    let row = |month: u32, day: u32, hour: u32, diffuse: f64| {
        format!("2024,{month},{day},{hour},60,?,12,5,60,101000,0,0,300,{diffuse},0,{diffuse},0\n")
    };
    let mut text: String = epw(0.0).lines().take(8).map(|line| format!("{line}\n")).collect();
    for days in 0..366 {
        let first = Date { year: 2024, month: 1, day: 1 }.days();
        let Date { month, day, .. } = Date::from_days(first + days);
        let diffuse = if (month, day) == (2, 29) { 240.0 } else { 60.0 };
        text.extend((1..=24).map(|hour| row(month, day, hour, diffuse)));
    }
    let weather = read(&text).unwrap();
    let mean = |period| {
        let selected = weather.select(period, SITE, 0.0).unwrap();
        let sum: f64 = selected.hours.iter().map(|h| h.weight * h.diffuse_horizontal).sum();
        (sum, selected.length, selected.slots.len())
    };
    let near = |period, sum: f64, hours: f64, slots: usize| {
        let found = mean(period);
        assert!((found.0 - sum).abs() < 1e-9, "{found:?}");
        assert_eq!((found.1, found.2), (hours, slots));
    };
    let instant = |text| Period::Instant(time(text));
    near(instant("2024-02-29T12:00Z"), 240.0, 0.0, 0);
    near(instant("2024-02-28T12:00Z"), 60.0, 0.0, 0);
    near(instant("2025-03-01T12:00Z"), 60.0, 0.0, 0);
    near(span("2024-02-28T00:00+01:00", "2024-03-02T00:00+01:00"), 120.0, 72.0, 72);
    near(span("2024-02-29T06:00+01:00", "2024-02-29T18:00+01:00"), 240.0, 12.0, 12);
    // a year without that day
    near(span("2025-02-28T00:00+01:00", "2025-03-02T00:00+01:00"), 60.0, 48.0, 48);
    near(Period::Year, 60.0 + 180.0 / 366.0, 8784.0, 8784);
    near(
        span("2024-01-01T00:00+01:00", "2025-01-01T00:00+01:00"),
        60.0 + 180.0 / 366.0,
        8784.0,
        8784,
    );
    near(span("2025-01-01T00:00+01:00", "2026-01-01T00:00+01:00"), 60.0, 8760.0, 8760);
    let days = weather.select(Period::Year, SITE, 0.0).unwrap();
    let starts: Vec<f64> = days.slots.iter().map(|slot| slot.start.unix).collect();
    assert!(starts.windows(2).all(|pair| pair[1] - pair[0] == HOUR));
}

/// What is no irradiance blocks its hour alone; words and codes for it are silent.
#[test]
fn a_bad_cell_blocks_its_hour_alone() {
    let whole = epw(0.0);
    let row = 8 + 171 * 24 + 12;
    let day = |day: u32| {
        span(&format!("2025-06-{day}T00:00+01:00"), &format!("2025-06-{}T00:00+01:00", day + 1))
    };
    for (cell, said) in [
        ("-999", false),
        ("-9999", false),
        ("9999", false),
        ("99999", false),
        ("", false),
        ("NaN", false),
        ("n/a", false),
        ("null", false),
        ("3000", true),
        ("-50", true),
        ("inf", true),
        ("abc", true),
    ] {
        for columns in [&[13][..], &[14], &[15], &[13, 14, 15]] {
            let mut lines: Vec<String> = whole.lines().map(str::to_owned).collect();
            let mut values: Vec<&str> = lines[row].split(',').collect();
            columns.iter().for_each(|&c| values[c] = cell);
            lines[row] = values.join(",");
            let weather = read(&lines.join("\n")).unwrap();
            assert_eq!(weather.notes.len(), usize::from(said), "{cell}: {:?}", weather.notes);
            assert!(weather.select(day(22), SITE, 0.0).is_ok(), "{cell}");
            let found = weather.select(day(21), SITE, 0.0);
            assert_eq!(found.is_ok(), columns.len() == 1, "{cell}");
        }
    }
    let weather = read(&whole.replacen("300,0.00", "300,?", 1)).unwrap();
    let note = "1 cell holds no irradiance, which is 0 to 2000 W/m2, and count as missing; the first is `?` as global in line 9";
    assert_eq!(weather.notes, [note.replace("and count", "and counts")]);
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
    // one column of three follows from the others
    for column in [13, 14, 15] {
        let selected = change(row, &[column]).select(day, SITE, 0.0).unwrap();
        assert!(selected.warnings().is_empty(), "{:?}", selected.warnings());
        let whole = read(&whole).unwrap().select(day, SITE, 0.0).unwrap();
        for (found, given) in selected.hours.iter().zip(&whole.hours) {
            // the global irradiance made here is that of the sun in the middle of the hour
            let near = |a: f64, b: f64| (a - b).abs() < 4e-3 * given.direct_normal + 0.05;
            assert!(near(found.direct_normal, given.direct_normal), "{column}");
            assert!(near(found.diffuse_horizontal, given.diffuse_horizontal), "{column}");
        }
    }
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
    // what rounding leaves there is no light
    let none = Selected { dropped_direct: 0.04, ..selected };
    assert!(none.warnings().iter().all(|warning| !warning.contains("while the sun is below")));
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
    assert!((hour.global() - 500.0).abs() < 1e-9);
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

/// The end of a day may be 00:00 of the next day, also before 1 March, of a leap year too.
#[test]
fn midnight_of_tmy3_is_read_in_both_ways() {
    let table = |midnight: fn(Date) -> String, leap: bool| {
        let mut text = String::from(
            "1,\"A, B\",CO,-7.0,40.0,-105.0,9\nDate (MM/DD/YYYY),Time (HH:MM),GHI (W/m^2),DNI (W/m^2),DHI (W/m^2)\n",
        );
        let year = if leap { 1996 } else { 1999 };
        let first = Date { year, month: 1, day: 1 }.days();
        let days = (0..365 + i64::from(leap)).map(|day| Date::from_days(first + day));
        for day in days.filter(|day| (day.month, day.day) != (2, 29)) {
            let date = |Date { year, month, day }| format!("{month:02}/{day:02}/{year}");
            let hours = (1..24).map(|hour| format!("{},{hour:02}:00", date(day)));
            for time in hours.chain([midnight(day)]) {
                text += &format!("{time},{0},0,{0}\n", 10 * day.day);
            }
        }
        read(&text).unwrap().select(Period::Year, SITE, 0.0).unwrap()
    };
    let at_the_end: fn(Date) -> String =
        |Date { year, month, day }| format!("{month:02}/{day:02}/{year},24:00");
    let of_the_next: fn(Date) -> String = |date| {
        let mut next = Date::from_days(date.days() + 1);
        if (next.month, next.day) == (2, 29) {
            next = Date { month: 3, day: 1, ..next };
        }
        format!("{:02}/{:02}/{},00:00", next.month, next.day, next.year)
    };
    for leap in [false, true] {
        let [a, b] = [at_the_end, of_the_next].map(|midnight| table(midnight, leap));
        assert_eq!((a.length, b.length), (8760.0, 8760.0));
        let own = |selected: &Selected| -> Vec<(f64, f64)> {
            selected.slots.iter().map(|slot| (slot.global, slot.length)).collect()
        };
        assert_eq!(own(&a), own(&b));
    }
    let half = "1,A,CO,-7,40,-105,9\nDate (MM/DD/YYYY),Time (HH:MM),GHI (W/m^2),DNI (W/m^2),DHI (W/m^2)\n\
         01/01/2001,00:30,0,0,0\n";
    let error = read(half).unwrap_err().to_string();
    assert!(error.starts_with("a.epw:3: the time is `00:30`, must be 01:00 to 24:00"), "{error}");
}

/// A comma in the name of a place shifts all that stands behind it, unless the name is in quotes.
#[test]
fn names_with_commas_stand_in_quotes() {
    let whole = epw(0.0);
    let with = |name: &str| read(&whole.replacen("Montpellier", name, 1));
    for name in ["\"Montpellier, Sud\"", " \"A,B, C\" ", "Mont \"pellier"] {
        assert_eq!(with(name).unwrap().site, Some(SITE), "{name}");
    }
    assert_eq!(read(&whole.replacen("1.0,5\n", "1.0,5,,\n", 1)).unwrap().site, Some(SITE));
    let nsrdb = |city: &str| {
        let text = format!(
            "Source,City,Latitude,Longitude,Time Zone\nNSRDB,{city},43.61,3.88,1\nYear,Month,Day,Hour,GHI\n\
             2025,6,21,10,500\n2025,6,21,11,500\n"
        );
        Weather::parse(text.as_bytes(), Path::new("a.epw"), None)
    };
    assert_eq!(nsrdb("\"A, B\"").unwrap().site, Some(SITE));
    let tmy3 = "1,A, B,CO,-7,40,-105,9\nDate (MM/DD/YYYY),Time (HH:MM),GHI (W/m^2)\n";
    for (error, line) in [
        (with("Montpellier, Sud").unwrap_err(), "1: 11 values between commas in place of 10"),
        (read(&whole.replacen("-,FRA", "FRA", 1)).unwrap_err(), "1: 9 values between commas in"),
        (read(tmy3).unwrap_err(), "1: 8 values between commas in place of 7"),
        (nsrdb("A, B").unwrap_err(), "2: 6 values between commas in place of 5"),
    ] {
        let error = error.to_string();
        assert!(error.starts_with(&format!("a.epw:{line}")), "{error}");
        let remedy = if line.contains(" 9 ") { "fetch the file again" } else { "in quotes" };
        assert!(error.contains(remedy), "{error}");
    }
}

#[test]
fn broken_files_get_their_sentence() {
    let whole = epw(0.0);
    let head: Vec<&str> = whole.lines().take(9).collect();
    let with = |row: &str| [&head[..8], &[row]].concat().join("\n");
    let good = head[8];
    for (text, start) in [
        (String::new(), "a.epw: is empty; weather files are EPW, TMY3, TMY2, tables of"),
        (
            "time,ghi\n2025-06-21T10:00Z,5\n2025-06-21T11:00Z,5".into(),
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
        (
            "{\"latitude\": 45.0, \"hourly\": {}}\n",
            "a.csv:1: this is JSON, not a table; fetch it as",
        ),
        ("time,dni\n", "a.csv:1: neither global irradiance nor both direct and diffuse (no `ghi`"),
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

/// Tables of other sources are read as they come: place, clock, columns and units by their heads.
#[test]
fn tables_of_others_are_read() {
    let noon = |text: &str, utc: &str| {
        let weather = Weather::parse(text.as_bytes(), Path::new("a.csv"), None).unwrap();
        assert_eq!(weather.site, Some(Site { latitude: 45.0, longitude: 8.5 }));
        let selected = weather.select(Period::Instant(time(utc)), SITE, 0.0).unwrap();
        [selected.hours[0].direct_normal, selected.hours[0].diffuse_horizontal]
    };
    let open_meteo = |columns: &str, rows: &str| {
        format!(
            "latitude,longitude,elevation,utc_offset_seconds,timezone,timezone_abbreviation\n\
             45.0,8.5,38.0,7200,Europe/Rome,GMT+2\n\n{columns}\n{rows}\n\ntime,sunrise (iso8601)\n2025-06-21,2025-06-21T05:00\n"
        )
    };
    // means of the hour before, at an offset of two hours
    let text = open_meteo(
        "time,temperature_2m (°C),shortwave_radiation (W/m²),direct_radiation (W/m²),diffuse_radiation (W/m²),\
         direct_normal_irradiance (W/m²)",
        "2025-06-21T13:00,20,1,1,1,1\n2025-06-21T14:00,20,850.0,750.0,100.0,800.0",
    );
    assert_eq!(noon(&text, "2025-06-21T11:01Z"), [800.0, 100.0]);
    assert_eq!(noon(&text, "2025-06-21T11:59Z"), [800.0, 100.0]);
    let text = open_meteo(
        "time,shortwave_radiation (W/m²),direct_radiation (W/m²)",
        "1750503600,1,1\n1750507200,850.0,750.0",
    );
    let [direct, diffuse] = noon(&text, "2025-06-21T11:30Z");
    assert!((diffuse - 100.0).abs() < 1e-9 && (direct - 800.0).abs() < 30.0, "{direct} {diffuse}");
    // the instant, in the clock that the head says, of rows half an hour apart
    let nsrdb = "Source,Location ID,City,State,Country,Latitude,Longitude,Time Zone,Elevation,Local Time Zone,DHI Units,Version\n\
         NSRDB,1,-,-,-,45.0,8.5,-7,300,-7,w/m2,3\nYear,Month,Day,Hour,Minute,DHI,Temperature,Clearsky GHI,DNI,GHI,Fill Flag\n\
         2025,6,21,4,0,1,20,900,1,1,0\n2025,6,21,4,30,100,20,900,800,850,0\n";
    assert_eq!(noon(nsrdb, "2025-06-21T11:16Z"), [800.0, 100.0]);
    assert_eq!(noon(nsrdb, "2025-06-21T11:44Z"), [800.0, 100.0]);
    // UTC, at the minutes of the satellite
    let pvgis = |slope: &str| {
        format!(
            "Latitude (decimal degrees):\t45.000\r\nLongitude (decimal degrees):\t8.500\r\nElevation (m):\t250\r\n\
             Radiation database:\tPVGIS-SARAH2\r\n\r\n\r\nSlope: {slope} deg. \r\nAzimuth: 0 deg. \r\n\r\n\
             time,Gb(i),Gd(i),Gr(i),H_sun,T2m,WS10m,Int\r\n20250621:1011,1,1,0.0,50,20,1,0\r\n\
             20250621:1111,750.0,100.0,0.0,68.0,20,1,0\r\n\r\nGb(i): Beam irradiance (W/m2)\r\n"
        )
    };
    let [direct, diffuse] = noon(&pvgis("0"), "2025-06-21T11:20Z");
    assert!((diffuse - 100.0).abs() < 1e-9 && (direct - 800.0).abs() < 30.0, "{direct} {diffuse}");
    let error = Weather::parse(pvgis("35").as_bytes(), Path::new("a.csv"), None).unwrap_err();
    assert!(error.to_string().contains("inclined plane (slope 35 deg.)"), "{error}");
    let tmy = "Latitude (decimal degrees): 45.000\nLongitude (decimal degrees): 8.500\nElevation (m): 250.0\n\
         Irradiance Time Offset (h): 0.5\nmonth,year\n1,2012\n6,2010\ntime(UTC),T2m,RH,G(h),Gb(n),Gd(h),IR(h)\n\
         20100621:1000,20,50,1,1,1,300\n20100621:1100,20,50,850.0,800.0,100.0,300\n20121231:1100,1,1,1,-0.0,1,1\n\n\
         T2m: 2-m air temperature\n\nPVGIS (c) European Union, 2001-2026\n";
    // another year than that of the row, half an hour after its time
    assert_eq!(noon(tmy, "2031-06-21T11:01Z"), [800.0, 100.0]);
    assert_eq!(noon(tmy, "2031-06-21T11:59Z"), [800.0, 100.0]);
    // means of the hour that begins; solar time of the zone of 15 degrees
    let power = |clock: &str, unit: &str, values: &str| {
        format!(
            "-BEGIN HEADER-\nNASA/POWER Source Native Resolution Hourly Data \n\
             Dates (month/day/year): 06/21/2025 through 06/21/2025 in {clock}\nLocation: Latitude  45.0   Longitude 8.5 \n\
             missing source data: -999 \nParameter(s): \nALLSKY_SFC_SW_DWN      CERES (SYN) Irradiance ({unit}) \n\
             -END HEADER-\nYEAR,MO,DY,HR,ALLSKY_SFC_SW_DWN,ALLSKY_SFC_SW_DNI,ALLSKY_SFC_SW_DIFF,T2M\n{values}\n"
        )
    };
    let rows = "2025,6,21,11,850.0,800.0,100.0,20\n2025,6,21,12,-999,1,1,1";
    assert_eq!(noon(&power("UTC", "Wh/m^2", rows), "2025-06-21T11:59Z"), [800.0, 100.0]);
    assert_eq!(noon(&power("LST", "Wh/m^2", rows), "2025-06-21T10:59Z"), [800.0, 100.0]);
    let rows = "2025,6,21,11,3.06,-999,100.0,20\n2025,6,21,12,-999,1,1,1";
    let [direct, diffuse] = noon(&power("UTC", "MJ/hr", rows), "2025-06-21T11:59Z");
    assert!((diffuse - 100.0).abs() < 1e-9 && (direct - 800.0).abs() < 30.0, "{direct} {diffuse}");
    for (text, start) in [
        (power("local", "W/m^2", ""), "a.csv:3: says neither `in UTC` nor `in LST`"),
        (power("UTC", "cal/cm2", ""), "a.csv:9: `ALLSKY_SFC_SW_DWN` is in `cal/cm2`, not in W/m2"),
        (
            open_meteo("time,rain", "2025-06-21T13:00,2"),
            "a.csv:4: neither global irradiance nor both",
        ),
        ("Datum;GHI\n".into(), "a.csv:1: unknown column `Datum;GHI`; weather files are EPW"),
    ] {
        let error =
            Weather::parse(text.as_bytes(), Path::new("a.csv"), None).unwrap_err().to_string();
        assert!(error.starts_with(start), "{error}");
    }
}

/// TMY2 has columns of fixed widths; hours are numbered by their ends, in standard time.
#[test]
fn tmy2_is_read() {
    let head = " 14944 SIOUX_FALLS            SD  -6 N 43 34 W  96 44   435\n";
    let row = |hour: u32, global: u32, direct: &str| {
        format!(" 830621{hour:02}12001330{global:4}I4{direct:>4}I4 100I41234\n")
    };
    let text = format!("{head}{}{}{}", row(12, 1, "1"), row(13, 850, " 800"), row(14, 850, "9999"));
    let weather = read(&text).unwrap();
    let site = weather.site.unwrap();
    assert!((site.latitude - 43.5667).abs() < 1e-3 && (site.longitude + 96.7333).abs() < 1e-3);
    let record = weather.records[1];
    assert_eq!([record.global, record.direct, record.diffuse], [850.0, 800.0, 100.0].map(Some));
    assert_eq!(record.start.unix, time("1983-06-21T12:00-06:00").unix);
    assert_eq!(weather.records[2].direct, None);
    let cut = read(&text[..text.len() - 12]).unwrap_err().to_string();
    assert!(cut.starts_with("a.epw:4: ends before column 33"), "{cut}");
}

/// Months of several years are a typical year, and so is a leap year without its leap day.
#[test]
fn typical_years_of_nsrdb_are_known() {
    let table = |year: &dyn Fn(u32) -> i64, leap: bool| {
        let mut text = String::from(
            "Source,Latitude,Longitude,Time Zone\nNSRDB,43.61,3.88,1\nYear,Month,Day,Hour,Minute,GHI,DNI,DHI\n",
        );
        let first = Date { year: 2024, month: 1, day: 1 }.days();
        for days in 0..366 {
            let Date { month, day, .. } = Date::from_days(first + days);
            if leap || (month, day) != (2, 29) {
                let row = |hour| format!("{},{month},{day},{hour},30,100,0,100\n", year(month));
                text.extend((0..24).map(row));
            }
        }
        let weather = Weather::parse(text.as_bytes(), Path::new("a.csv"), None).unwrap();
        let instant = weather.select(Period::Instant(time("2031-06-21T12:00Z")), SITE, 0.0);
        let hours = weather.select(Period::Year, SITE, 0.0).unwrap().length;
        (instant.is_ok(), hours)
    };
    assert_eq!(table(&|month| 2000 + i64::from(month * 7 % 12), false), (true, 8760.0));
    assert_eq!(table(&|_| 2024, false), (true, 8760.0));
    assert_eq!(table(&|_| 2024, true), (false, 8784.0));
    assert_eq!(table(&|_| 2023, false), (false, 8760.0));
}

/// Returns the days and months in which slots begin, in the order in which they come.
fn days_and_months(selected: &Selected) -> [Vec<(i64, u32, u32)>; 2] {
    let day = |slot: &Slot| {
        let local = slot.start.unix + slot.start.offset;
        let Date { year, month, day } = Date::from_days((local / DAY).floor() as i64);
        (year, month, day)
    };
    let mut days: Vec<_> = selected.slots.iter().map(day).collect();
    days.dedup();
    let mut months: Vec<_> = days.iter().map(|&(year, month, _)| (year, month, 0)).collect();
    months.dedup();
    [days, months]
}

/// A typical year has 12 months and 365 days, each with the year of its rows, wherever in the hour
/// its rows stand and however its clock is moved; leap years among the years of its months add none.
#[test]
fn typical_years_have_twelve_months() {
    let year_of = |month: u32| 2000 + i64::from(month * 7 % 12);
    let rows = |write: &dyn Fn(Date, i64) -> String| -> String {
        let first = Date { year: 2001, month: 1, day: 1 }.days();
        let dates = (first..first + 365).map(Date::from_days);
        let dates = dates.map(|date| Date { year: year_of(date.month), ..date });
        dates.flat_map(|date| (0..24).map(move |hour| write(date, hour))).collect()
    };
    let nsrdb = |minute: i64| {
        let row = |Date { year, month, day }, hour: i64| {
            format!("{year},{month},{day},{hour},{minute},100,0,100\n")
        };
        let head = "Source,Latitude,Longitude,Time Zone\nNSRDB,43.61,3.88,1\nYear,Month,Day,Hour,Minute,GHI,DNI,DHI\n";
        head.to_owned() + &rows(&row)
    };
    let pvgis = |late: f64| {
        let row = |Date { year, month, day }, hour: i64| {
            format!("{year}{month:02}{day:02}:{hour:02}00,100,0,100\n")
        };
        format!(
            "Latitude (decimal degrees): 43.61\nLongitude (decimal degrees): 3.88\nIrradiance Time Offset (h): {late}\n\
             month,year\ntime(UTC),G(h),Gb(n),Gd(h)\n{}",
            rows(&row)
        )
    };
    for (text, stamp) in [
        (nsrdb(0), None),
        (nsrdb(30), None),
        (nsrdb(0), Some(Stamp::End)),
        (nsrdb(0), Some(Stamp::Start)),
        (pvgis(0.17), None),
        (pvgis(-0.2), None),
        (pvgis(0.5), None),
    ] {
        let weather = Weather::parse(text.as_bytes(), Path::new("a.csv"), stamp).unwrap();
        for shift in [0.0, 0.5, -0.33, 7.0, -7.0] {
            let selected = weather.select(Period::Year, SITE, shift).unwrap();
            let [days, months] = days_and_months(&selected);
            assert_eq!((selected.length, days.len(), months.len()), (8760.0, 365, 12), "{shift}");
            assert!(months.iter().all(|&(year, month, _)| year == year_of(month)), "{months:?}");
            let length: f64 = selected.slots.iter().map(|slot| slot.length).sum();
            assert!((length - 8760.0).abs() < 1e-6, "{length}");
            let mean: f64 = selected.hours.iter().map(|h| h.weight * h.diffuse_horizontal).sum();
            assert!((mean - 100.0).abs() < 1e-6, "{mean}");
        }
    }
}

/// With a shift of the clock, a period and its slots are those of the mended clock: the sun stands
/// where it is at their times. A year of a table that is no typical one is all of its rows.
#[test]
fn slots_have_the_mended_clock() {
    // rows of UTC that say they are two hours ahead of it
    let mut text = String::from("time,ghi,dni,dhi\n");
    let first = Date { year: 2025, month: 1, day: 1 }.days();
    for day in 0..365 {
        let Date { year, month, day } = Date::from_days(first + day);
        for hour in 0..24 {
            text += &format!("{year}-{month:02}-{day:02}T{hour:02}:00+02:00,,0,{hour}\n");
        }
    }
    let weather = Weather::parse(text.as_bytes(), Path::new("a.csv"), Some(Stamp::Start)).unwrap();
    let period = span("2025-05-04T00:00+02:00", "2025-05-05T00:00+02:00");
    let selected = weather.select(period, SITE, 2.0).unwrap();
    assert_eq!((selected.slots.len(), selected.length), (24, 24.0));
    for (i, slot) in selected.slots.iter().enumerate() {
        let start = time(&format!("2025-05-04T{i:02}:00+02:00"));
        assert_eq!(slot.start, start);
        // the row of the hour two hours before
        let diffuse = slot.hour.map_or(0.0, |hour| selected.hours[hour].diffuse_horizontal);
        assert_eq!(diffuse, ((i + 22) % 24) as f64);
        if let Some(hour) = slot.hour.map(|hour| selected.hours[hour]) {
            let own = SITE.sun(start, 0.5 * HOUR);
            assert!(hour.sun.elevation < 0.0 || (hour.sun.azimuth - own.azimuth).abs() < 0.2);
        }
    }
    let year = weather.select(Period::Year, SITE, 2.0).unwrap();
    assert_eq!((year.slots.len(), year.length), (8760, 8760.0));
    assert_eq!(year.slots[0].start, time("2025-01-01T02:00+02:00"));
    assert!(year.slots.iter().all(|slot| slot.length == 1.0));
}

/// The sun is up for a part of the hour in which it rises, of that in which it sets, and of one in
/// which it does both.
#[test]
fn the_sun_is_up_for_a_part_of_an_hour() {
    let site = Site { latitude: 66.4, longitude: 15.0 };
    let mut text = String::from("time,dni,dhi\n");
    for hour in 0..24 {
        text += &format!("2025-12-21T{hour:02}:00+01:00,100,0\n");
    }
    let weather = Weather::parse(text.as_bytes(), Path::new("a.csv"), Some(Stamp::Start)).unwrap();
    let day = span("2025-12-21T00:00+01:00", "2025-12-22T00:00+01:00");
    for site in [site, SITE, Site { latitude: -66.0, ..site }] {
        let selected = weather.select(day, site, 0.0).unwrap();
        let up: f64 = selected.slots.iter().map(|slot| slot.sun_up).sum();
        let start = time("2025-12-21T00:00+01:00");
        let minutes = (0..1440)
            .filter(|&minute| site.sun(start, 60.0 * (f64::from(minute) + 0.5)).elevation > 0.0);
        let minutes = minutes.count() as f64;
        assert!((60.0 * up - minutes).abs() < 2.0, "{} {minutes}", 60.0 * up);
        for hour in &selected.hours {
            assert!(hour.course.iter().all(|(sun, _)| sun.elevation > 0.0));
        }
    }
}

const FILES: &[&str] = &[
    "LOCATION,a,-,FRA,b,0,43.61,3.88,1.0,5\nDATA PERIODS,1,1,Data,Sunday,1/1,12/31\n\
     2005,6,21,12,60,?,12,5,60,101000,0,0,300,900,800,100,0\n2004,2,29,13,60,?,12,5,60,101000,0,0,300,900,9999,1,0\n",
    "time,ghi,dni,dhi\n2025-06-21T12:00+01:00,900,800,150\n2025-06-21T12:30+01:00,880,780,160\n",
    "7,\"P\",AZ,-7.0,33.450,-111.983,337\nDate (MM/DD/YYYY),GHI (W/m^2),DNI (W/m^2),DHI (W/m^2)\n06/21/1998,01:00,5,6\n",
    " 14944 SIOUX_FALLS            SD  -6 N 43 34 W  96 44   435\n 8306211312001330 850I4 800I4 100I41234\n",
    "latitude,longitude,utc_offset_seconds\n45.0,8.5,7200\n\ntime,shortwave_radiation (W/m²),direct_radiation (W/m²)\n\
     2025-06-21T13:00,1,1\n1750507200,850.0,750.0\n",
    "Source,Latitude,Longitude,Time Zone\nNSRDB,45,8,-7\nYear,Month,Day,Hour,Minute,DHI,DNI\n2024,6,21,4,0,1,20\n2025,6,21,4,30,1,2\n",
    "Latitude (decimal degrees): 45.0\nLongitude (decimal degrees): 8.5\nIrradiance Time Offset (h): 0.5\nmonth,year\nSlope: 0 deg.\n\
     time,G(i),Gb(i)\n20100621:1000,20,5\n20100621:1100,20,50\n\nend\n",
    "-BEGIN HEADER-\nDates (m) in LST\nLatitude  45.0   Longitude 8.5\nALLSKY_SFC_SW_DWN x (MJ/hr)\n-END HEADER-\n\
     YEAR,MO,DY,HR,ALLSKY_SFC_SW_DWN\n2025,6,21,11,3.06\n2025,6,21,12,-999\n",
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
                let _ = weather.clock_warnings(SITE, 0.0);
            }
        }
    }
}
