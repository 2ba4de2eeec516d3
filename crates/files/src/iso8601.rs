//! Reads times in the notation of ISO 8601, which must state their offset from UTC.

use std::fmt::Display;

use super::input::quoted;
use phylux_core::{
    error::{Error, Result},
    scene::daylight::{Date, Timestamp},
};

const DAY: f64 = 86_400.0;

/// Reads a time such as `2025-06-21T13:46+02:00`, in the years 1900 to 2100. Seconds, a fraction of
/// them, and `Z` for `+00:00` are allowed.
///
/// # Errors
/// At `place`: the text is not such a time, the day does not exist, or the offset is missing.
pub fn parse_time(text: &str, place: impl Display) -> Result<Timestamp> {
    let text = text.trim();
    let wrong = |problem: &str| {
        Error::input(&place, format!("{} {problem}", quoted(text)))
            .remedy("write date, time and the clock's offset from UTC: 2025-06-21T13:46+02:00")
    };
    let no_time = || wrong("is no time");
    let (date, clock) = text.split_once(['T', 't', ' ']).ok_or_else(no_time)?;
    let [year, month, day] = numbers(date, '-', [4, 2, 2]).ok_or_else(no_time)?;
    let date = Date::new(i64::from(year), month, day)
        .ok_or_else(|| wrong("is no day of the years 1900 to 2100"))?;
    let (clock, offset) = match clock.find(['Z', 'z', '+', '-']) {
        None => return Err(wrong("does not say the clock's offset from UTC")),
        Some(at) => clock.split_at(at),
    };
    let (clock, seconds) = match clock.match_indices(':').nth(1) {
        Some((at, _)) => (&clock[..at], &clock[at + 1..]),
        None => (clock, "0"),
    };
    let [hour, minute] = numbers(clock, ':', [2, 2]).ok_or_else(no_time)?;
    let plain = seconds.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    let seconds: f64 = seconds.parse().ok().filter(|_| plain).ok_or_else(no_time)?;
    // 24:00 is the end of a day
    let since_midnight = f64::from(hour * 60 + minute) * 60.0 + seconds;
    if minute > 59 || seconds >= 60.0 || since_midnight > DAY {
        return Err(no_time());
    }
    let offset = if offset.eq_ignore_ascii_case("z") {
        0.0
    } else {
        let sign = if offset.starts_with('-') { -1.0 } else { 1.0 };
        let parts = match offset.len() {
            3 => numbers(&offset[1..], ':', [2]).map(|[hours]| [hours, 0]),
            5 if offset.is_char_boundary(3) => {
                let hours = numbers(&offset[1..3], ':', [2]);
                let minutes = numbers(&offset[3..], ':', [2]);
                hours.zip(minutes).map(|([hours], [minutes])| [hours, minutes])
            }
            _ => numbers(&offset[1..], ':', [2, 2]),
        };
        let [hours, minutes] = parts
            .filter(|[hours, minutes]| *hours <= 14 && *minutes < 60)
            .ok_or_else(|| wrong("has no offset from UTC like +02:00"))?;
        sign * f64::from(hours * 60 + minutes) * 60.0
    };
    Ok(Timestamp { unix: date.days() as f64 * DAY + since_midnight - offset, offset })
}

/// Reads numbers with separators between them; `digits` says how many digits each must have.
fn numbers<const K: usize>(text: &str, separator: char, digits: [usize; K]) -> Option<[u32; K]> {
    let mut parts = text.split(separator);
    let mut found = [0; K];
    for (number, digits) in found.iter_mut().zip(digits) {
        let part = parts.next()?;
        let whole = part.len() == digits && part.bytes().all(|b| b.is_ascii_digit());
        *number = part.parse().ok().filter(|_| whole)?;
    }
    parts.next().is_none().then_some(found)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn times_are_read() {
        for (text, unix) in [
            ("1970-01-01T00:00Z", 0.0),
            ("2000-03-01T00:00:00+00:00", 951_868_800.0),
            ("2003-10-17T12:30:30-07:00", 1_066_419_030.0),
            ("2003-10-17 12:30:30.25-0700", 1_066_419_030.25),
            ("2003-10-17T19:30:30z", 1_066_419_030.0),
            ("2025-06-21T24:00+05:30", 1_750_530_600.0),
            ("2025-06-21T18:30+00", 1_750_530_600.0),
        ] {
            assert_eq!(parse_time(text, "x").unwrap().unix, unix, "{text}");
        }
        assert_eq!(parse_time("2025-06-21T18:30+05:30", "x").unwrap().offset, 19_800.0);
    }

    #[test]
    fn errors_say_what_is_missing() {
        for (text, start) in [
            ("2025-06-21T13:46", "/time: `2025-06-21T13:46` does not say the clock's offset from"),
            ("2025-06-21T13:46 CEST", "/time: `2025-06-21T13:46 CEST` does not say the clock's"),
            ("2025-06-21", "/time: `2025-06-21` is no time; write date, time and the clock's"),
            ("2025-02-29T00:00Z", "/time: `2025-02-29T00:00Z` is no day of the years 1900 to 2100"),
            ("1066-10-14T09:00Z", "/time: `1066-10-14T09:00Z` is no day of the years"),
            ("2025-06-21T25:00Z", "/time: `2025-06-21T25:00Z` is no time"),
            ("2025-06-21T24:01Z", "/time: `2025-06-21T24:01Z` is no time"),
            ("2025-06-21T12:60Z", "/time: `2025-06-21T12:60Z` is no time"),
            ("2025-06-21T12:00:infZ", "/time: `2025-06-21T12:00:infZ` is no time"),
            ("2025-06-21T12:00+2", "/time: `2025-06-21T12:00+2` has no offset from UTC like"),
            ("2025-06-21T12:00+15:00", "/time: `2025-06-21T12:00+15:00` has no offset"),
            ("", "/time: `` is no time"),
        ] {
            let error = parse_time(text, "/time").unwrap_err().to_string();
            assert!(error.starts_with(start), "{error}\n{start}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn no_text_panics(
            text in "[-0-9]{0,10}[T ]?[:0-9.ü]{0,10}[-+Zz]?[0-9:ü]{0,6}",
        ) {
            let _ = parse_time(&text, "x");
        }
    }
}
