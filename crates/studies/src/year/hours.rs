//! The hours of a period: their days and months, and the lamps that are on in them.

use indexmap::IndexMap;

use phylux_core::scene::daylight::Date;
use phylux_files::weather::Slot;

/// Light of 1 umol/m2/s in an hour, mol/m2, or of 1 W/m2, MJ/m2.
pub(super) const HOUR: f64 = 3600.0 * 1e-6;

/// Hours whose light is added up.
pub(super) struct Period {
    /// The hours, and the weight of each in the sum.
    pub slots: Vec<(usize, f64)>,
}

/// A lamp, with the times when it was on.
#[derive(Clone, Debug)]
pub struct Lamp {
    /// Name of the light.
    pub name: String,
    /// Electric power, W.
    pub watts: Option<f64>,
    /// For each hour, the fraction of it during which the lamp was on, in [0, 1].
    pub on: Vec<f64>,
    /// For each hour, its energy over that of a whole hour at full power, in [0, 1].
    pub power: Vec<f64>,
}

/// Returns the day and the hours since midnight at which a slot starts, on the clock of the weather
/// file.
pub(super) fn local(slot: &Slot) -> (Date, f64) {
    const DAY: f64 = 86_400.0;
    let local = slot.start.unix + slot.start.offset;
    (Date::from_days((local / DAY).floor() as i64), local.rem_euclid(DAY) / 3600.0)
}

/// Returns the start of an hour, on the clock of the weather file.
pub(super) fn time(slot: &Slot) -> String {
    let (date, start) = local(slot);
    let minutes = (start * 60.0).round() as u32;
    let offset = (slot.start.offset / 60.0).round() as i32;
    let sign = if offset < 0 { '-' } else { '+' };
    format!(
        "{}T{:02}:{:02}{sign}{:02}:{:02}",
        day(date),
        minutes / 60,
        minutes % 60,
        offset.abs() / 60,
        offset.abs() % 60
    )
}

/// Writes a date as `2005-06-21`.
pub fn day(date: Date) -> String {
    format!("{}-{:02}-{:02}", date.year, date.month, date.day)
}

/// Writes a month as `2005-06`.
pub fn month(date: Date) -> String {
    format!("{}-{:02}", date.year, date.month)
}

/// Returns the hours of each day or month, by the name that `name` gives to their dates.
pub(super) fn periods(
    slots: &[Slot],
    name: impl Fn(Date) -> String,
) -> IndexMap<String, Vec<usize>> {
    let mut periods: IndexMap<String, Vec<usize>> = IndexMap::new();
    for (s, slot) in slots.iter().enumerate() {
        periods.entry(name(local(slot).0)).or_default().push(s);
    }
    periods
}

/// Returns the hours of a day of the calendar with the weights by which their sum is its integral; a
/// day may have 23 or 25 h, where the clock changes.
pub(super) fn of_the_day(slots: &[Slot], hours: &[usize]) -> Period {
    Period { slots: hours.iter().map(|&s| (s, HOUR * slots[s].length)).collect() }
}

/// Returns some hours with the weights by which their sum is the mean integral over a day. For less
/// than a day, it is what these hours bring.
pub(super) fn of_a_day(slots: &[Slot], hours: &[usize]) -> Period {
    let length: f64 = hours.iter().map(|&s| slots[s].length).sum();
    let scale = HOUR / (length / 24.0).max(1.0);
    Period { slots: hours.iter().map(|&s| (s, scale * slots[s].length)).collect() }
}

/// Returns the periods over which a year sums light: its days, its months, and all of it.
pub(super) fn summed(
    slots: &[Slot],
    days: &IndexMap<String, Vec<usize>>,
    months: &IndexMap<String, Vec<usize>>,
) -> Vec<Period> {
    let all: Vec<usize> = (0..slots.len()).collect();
    let days = days.values().map(|hours| of_the_day(slots, hours));
    let months = months.values().chain([&all]).map(|hours| of_a_day(slots, hours));
    days.chain(months).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use phylux_core::scene::daylight::Timestamp;

    /// The day on which summer time ends has 25 h, of which none is left out of its integral; a mean
    /// over days has days of 24 h.
    #[test]
    fn a_day_of_25_hours_is_whole() {
        let start = Timestamp { unix: 0.0, offset: 0.0 };
        let slots = vec![Slot { start, length: 1.0, sun_up: 0.0, global: 0.0, hour: None }; 25];
        let all: Vec<usize> = (0..25).collect();
        let sum =
            |period: Period| period.slots.iter().map(|(_, weight)| weight / HOUR).sum::<f64>();
        assert!((sum(of_the_day(&slots, &all)) - 25.0).abs() < 1e-12);
        assert!((sum(of_a_day(&slots, &all)) - 24.0).abs() < 1e-12);
        assert!((sum(of_a_day(&slots, &all[..5])) - 5.0).abs() < 1e-12);
    }
}
