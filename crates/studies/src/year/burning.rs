//! How long lamps burn in each hour, by the light that is there without them.

use std::ops::Range;

use super::{
    hours::{HOUR, day as day_of, local},
    part::Part,
    places::Places,
};
use phylux_core::error::Result;
use phylux_files::{
    control_file::{LampControl, Prefer},
    weather::Slot,
};

/// How far, as a fraction, a day may be below what was to be filled up: rounding.
const ROUNDING: f64 = 1e-6;

/// A captor or group and a band, by index.
pub(super) type Place = (usize, usize);

/// An entry of the control file, with the lamps and the place that it is about.
pub(super) struct Entry<'a> {
    pub lamps: &'a LampControl,
    /// Indices among the lights that are not daylight.
    pub lights: Vec<usize>,
    /// Index of the captor or group and band in the list of all places.
    pub place: Option<usize>,
    /// For each slot the fraction of it in which they may be on by the clock and the light outside,
    /// and the fraction of their power to which they are dimmed.
    pub may: Vec<f64>,
    pub dim: Vec<f64>,
    /// For each slot the price of electricity; empty where it is not asked for.
    pub prices: Vec<f64>,
    /// For each slot the fraction of it in which they are on, and the fraction of their energy.
    pub on: Vec<f64>,
    pub power: Vec<f64>,
    /// The days that `fill_day` could not fill up.
    pub lacking: Lacking,
}

/// Days on which lamps could not bring what they were to bring.
#[derive(Clone, Debug, Default)]
pub(super) struct Lacking {
    /// Number of days on which lamps were to fill up the light, and of those that still lack some.
    pub days: [usize; 2],
    /// The largest amount that lacks, and its day.
    pub most: Option<(f64, String)>,
}

/// What is known before any lamp is switched.
pub(super) struct Burning<'a> {
    slots: &'a [Slot],
    /// For each part of the year the fraction of each slot in which it holds.
    shares: Vec<&'a [f64]>,
    /// What each entry brings to each place at its full power, for each part.
    full: Vec<Vec<Vec<f64>>>,
    /// For each place the daylight of each slot.
    daylight: Vec<Vec<f64>>,
}

/// A day, with the lamps of the first entries.
struct Day {
    slots: Range<usize>,
    /// For each of these entries and each slot, how its lamps burn.
    burn: Vec<Vec<Burn>>,
    /// For each slot and place the light of the day and of these lamps.
    light: Vec<Vec<f64>>,
}

/// How lamps burn in a slot.
#[derive(Clone, Copy)]
struct Burn {
    /// Fraction of the slot in which they are on.
    on: f64,
    /// Fraction of their power to which they are dimmed.
    strength: f64,
}

impl<'a> Burning<'a> {
    /// Finds the daylight at the places of the entries, by `daylight_at`, and what the lamps of each
    /// bring there. Error: a file of the system cannot be read, or the search was ended.
    pub fn new(
        slots: &'a [Slot],
        parts: &'a [Part],
        (entries, places): (&[Entry], &[Place]),
        of: &Places,
        daylight_at: impl Fn(Place) -> Result<Vec<f64>>,
    ) -> Result<Self> {
        let brings = |part: &Part, entry: &Entry, (id, band): Place| -> Result<f64> {
            let lights = entry.lights.iter().map(|&lamp| part.lamps[lamp]);
            lights.map(|light| part.front(of, light, id, band)).sum()
        };
        let of_part = |part: &Part| -> Result<Vec<Vec<f64>>> {
            let of = |entry: &Entry| places.iter().map(|&at| brings(part, entry, at)).collect();
            entries.iter().map(of).collect()
        };
        Ok(Self {
            slots,
            shares: parts.iter().map(|part| part.shares).collect(),
            full: parts.iter().map(of_part).collect::<Result<_>>()?,
            daylight: places.iter().map(|&place| daylight_at(place)).collect::<Result<_>>()?,
        })
    }

    /// Decides hour by hour how long the lamps of each entry are on. Entries are switched one after
    /// the other, and each takes into account what those before it bring. Those that fill up a day
    /// are planned for all of it, by what the entries before them would bring without them.
    pub fn switch(&self, entries: &mut [Entry]) {
        for slots in self.days() {
            let mut day = self.dark_day(slots.clone());
            let mut plans: Vec<Option<Vec<f64>>> = vec![None; entries.len()];
            for (e, entry) in entries.iter().enumerate() {
                if let (Some(fill_day), Some(place)) = (entry.lamps.fill_day, entry.place) {
                    day = self.burn(day, &entries[..e], &plans);
                    plans[e] = Some(self.plan(&day, (e, entry), fill_day, place));
                }
            }
            let lit = self.burn(day, entries, &plans);
            for (entry, burn) in entries.iter_mut().zip(&lit.burn) {
                for Burn { on, strength } in burn {
                    entry.on.push(*on);
                    entry.power.push(on * strength);
                }
                if let (Some(fill_day), Some(place)) = (entry.lamps.fill_day, entry.place) {
                    let (date, _) = local(&self.slots[slots.start]);
                    if entry.lamps.when().includes((date.month, date.day)) {
                        entry.lacking.add(fill_day, self.sum(&lit, place), || day_of(date));
                    }
                }
            }
        }
    }

    /// Returns a day without lamps.
    fn dark_day(&self, slots: Range<usize>) -> Day {
        let at = |slot: usize| self.daylight.iter().map(|of_place| of_place[slot]).collect();
        Day { light: slots.clone().map(at).collect(), slots, burn: Vec::new() }
    }

    /// Returns what comes to a place on a day, mol/m2 or MJ/m2.
    fn sum(&self, day: &Day, place: usize) -> f64 {
        let slots = self.slots[day.slots.clone()].iter().zip(&day.light);
        slots.map(|(slot, light)| slot.length * HOUR * light[place]).sum()
    }

    /// Returns the slots of each day.
    fn days(&self) -> Vec<Range<usize>> {
        let date = |slot: usize| local(&self.slots[slot]).0;
        let begins = |&slot: &usize| slot == 0 || date(slot) != date(slot - 1);
        let starts: Vec<usize> = (0..self.slots.len()).filter(begins).collect();
        let ends = starts.iter().skip(1).copied().chain([self.slots.len()]);
        starts.iter().zip(ends).map(|(&start, end)| start..end).collect()
    }

    /// Decides for how much of each slot of a day the lamps of an entry are on to fill it up, beside
    /// the lamps of the entries before it, which are in `day`.
    fn plan(
        &self,
        day: &Day,
        (e, entry): (usize, &Entry),
        fill_day: f64,
        place: usize,
    ) -> Vec<f64> {
        let slots = day.slots.clone();
        let mut missing = (fill_day - self.sum(day, place)).max(0.0);
        let may = |(slot, light): (usize, &Vec<f64>)| {
            let full = self.full(e, slot);
            let Burn { on, strength } = self.may_burn(entry, slot, light, &full);
            (on, self.slots[slot].length * HOUR * strength * full[place])
        };
        let may: Vec<(f64, f64)> = slots.clone().zip(&day.light).map(may).collect();
        let daylight = |i: usize| self.daylight[place][slots.start + i];
        let mut order: Vec<usize> = (0..slots.len()).collect();
        match entry.lamps.prefer.unwrap_or_default() {
            Prefer::Darkest => order.sort_by(|&a, &b| daylight(a).total_cmp(&daylight(b))),
            Prefer::Earliest => {}
            Prefer::Latest => order.reverse(),
            Prefer::Cheapest => {
                let price = |i: usize| entry.prices[slots.start + i];
                order.sort_by(|&a, &b| price(a).total_cmp(&price(b)));
            }
        }
        let mut plan = vec![0.0; slots.len()];
        for i in order {
            let (on, brings) = may[i];
            if missing > 0.0 && on > 0.0 && brings > 0.0 {
                plan[i] = if missing < on * brings { missing / brings } else { on };
                missing = (missing - plan[i] * brings).max(0.0);
            }
        }
        plan
    }

    /// Follows the lamps of all these entries through a day, in which the first of them are already.
    fn burn(&self, mut day: Day, entries: &[Entry], plans: &[Option<Vec<f64>>]) -> Day {
        if entries.iter().any(|entry| entry.lamps.until_dli.is_some()) {
            // what has come since midnight is of all entries, so that each may change those before
            day = self.dark_day(day.slots);
        }
        let first = day.burn.len();
        day.burn.resize(entries.len(), Vec::new());
        let mut since_midnight = vec![0.0; self.daylight.len()];
        for (i, s) in day.slots.clone().enumerate() {
            let amount = self.slots[s].length * HOUR;
            let light = &mut day.light[i];
            for (sum, light) in since_midnight.iter_mut().zip(&*light) {
                *sum += amount * light;
            }
            for (e, entry) in entries.iter().enumerate().skip(first) {
                let full = self.full(e, s);
                let Burn { mut on, strength } = self.may_burn(entry, s, light, &full);
                if let Some(plan) = &plans[e] {
                    on = on.min(plan[i]);
                }
                if let (Some(until), Some(place)) = (entry.lamps.until_dli, entry.place) {
                    let missing = (until - since_midnight[place]).max(0.0);
                    let brought = amount * strength * full[place];
                    on = if missing < on * brought { missing / brought } else { on };
                    on = if missing > 0.0 { on } else { 0.0 };
                }
                on = if strength > 0.0 { on } else { 0.0 };
                let power = on * strength;
                for ((sum, light), full) in since_midnight.iter_mut().zip(&mut *light).zip(&full) {
                    *light += power * full;
                    *sum += amount * power * full;
                }
                day.burn[e].push(Burn { on, strength });
            }
        }
        day
    }

    /// Returns what an entry brings to each place in a slot at its full power.
    fn full(&self, e: usize, slot: usize) -> Vec<f64> {
        let parts = || self.shares.iter().zip(&self.full);
        let at = |p: usize| parts().map(|(shares, full)| shares[slot] * full[e][p]).sum();
        (0..self.daylight.len()).map(at).collect()
    }

    /// Returns how the lamps of an entry may burn in a slot, beside the light of day and of the
    /// entries before, without regard to what has come on the day.
    fn may_burn(&self, entry: &Entry, slot: usize, light: &[f64], full: &[f64]) -> Burn {
        let lamps = entry.lamps;
        let (mut on, mut strength) = (entry.may[slot], entry.dim[slot]);
        let daylight = |place: usize| self.daylight[place][slot];
        let dim = |place: usize| lamps.below.is_none_or(|below| daylight(place) < below);
        if !entry.place.is_none_or(dim) {
            on = 0.0;
        }
        if let (Some(fill_to), Some(place)) = (lamps.fill_to, entry.place) {
            let missing = (fill_to - light[place]).max(0.0);
            // a lamp that brings nothing there cannot fill up anything
            if full[place] <= 0.0 {
                strength = 0.0;
            } else if missing < strength * full[place] {
                strength = missing / full[place];
            }
        }
        Burn { on, strength }
    }
}

impl Lacking {
    /// Adds a day on which `wanted` was to come, and `found` came.
    fn add(&mut self, wanted: f64, found: f64, day: impl FnOnce() -> String) {
        self.days[0] += 1;
        let lacks = wanted - found;
        if lacks > ROUNDING * wanted {
            self.days[1] += 1;
            if self.most.as_ref().is_none_or(|(most, _)| lacks > *most) {
                self.most = Some((lacks, day()));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use phylux_core::scene::daylight::Timestamp;
    use serde_json::{Value, json};

    /// 1000 umol/m2/s for an hour, mol/m2.
    const FULL: f64 = 3.6;

    /// Three days of hours: a bright one with 500 umol/m2/s from 6 to 18 h (21.6 mol/m2), a dim one
    /// with 100 from 9 to 12 h (1.08), and a dark one.
    fn daylight() -> Vec<f64> {
        let bright = |hour: usize| if (6..18).contains(&hour) { 500.0 } else { 0.0 };
        let dim = |hour: usize| if (9..12).contains(&hour) { 100.0 } else { 0.0 };
        let days: [&dyn Fn(usize) -> f64; 3] = [&bright, &dim, &|_| 0.0];
        days.iter().flat_map(|day| (0..24).map(day)).collect()
    }

    /// Switches lamps of 1000 umol/m2/s, one after the other, and returns for each the hours of each
    /// day in which it is on, by their parts, and the days that lack light.
    fn switch(lamps: &[Value], prices: &dyn Fn(usize) -> f64) -> Vec<(Vec<Vec<f64>>, Lacking)> {
        let controls = lamps.iter().map(|keys| {
            let mut lamp = json!({ "lights": "a", "of": "a" });
            lamp.as_object_mut().unwrap().extend(keys.as_object().unwrap().clone());
            serde_json::from_value(lamp).unwrap()
        });
        let controls: Vec<LampControl> = controls.collect();
        let slot = |s: usize| Slot {
            start: Timestamp { unix: 3600.0 * s as f64, offset: 0.0 },
            length: 1.0,
            sun_up: 0.0,
            global: 0.0,
            hour: None,
        };
        let slots: Vec<Slot> = (0..72).map(slot).collect();
        let entry = |lamps| {
            let may = |s: usize| LampControl::when(lamps).allowed((s % 24) as f64, 1.0);
            Entry {
                lamps,
                lights: Vec::new(),
                place: Some(0),
                may: (0..72).map(may).collect(),
                dim: vec![1.0; 72],
                prices: (0..72).map(|s| prices(s % 24)).collect(),
                on: Vec::new(),
                power: Vec::new(),
                lacking: Lacking::default(),
            }
        };
        let mut entries: Vec<Entry> = controls.iter().map(entry).collect();
        let burning = Burning {
            slots: &slots,
            shares: vec![&[1.0; 72][..]],
            full: vec![vec![vec![1000.0]; lamps.len()]],
            daylight: vec![daylight()],
        };
        burning.switch(&mut entries);
        let days = |entry: &Entry| entry.on.chunks(24).map(<[f64]>::to_vec).collect();
        entries.into_iter().map(|entry| (days(&entry), entry.lacking)).collect()
    }

    /// Returns the hours of a day in which a lamp is on, each with its part.
    fn on(day: &[f64]) -> Vec<(usize, f64)> {
        let parts = day.iter().map(|part| (part * 1e9).round() / 1e9).enumerate();
        parts.filter(|(_, part)| *part > 0.0).collect()
    }

    #[test]
    fn a_day_is_filled_up_just_long_enough() {
        // of 12 mol/m2 the bright day has enough; the dim one lacks 10.92, which is 3 h 2 min, and the
        // dark one 12, 3 h 20 min: in the darkest hours, of equal ones the first, within the window
        let found = switch(&[json!({ "fill_day": 12, "hours": [8, 14] })], &|_| 0.0);
        let (days, lacking) = &found[0];
        assert!(on(&days[0]).is_empty());
        let part = (10.92 - 3.0 * FULL) / FULL;
        let dim = [(8, 1.0), (9, 0.033333333), (12, 1.0), (13, 1.0)];
        assert!((part - 0.033333333).abs() < 1e-8);
        assert_eq!(on(&days[1]), dim);
        assert_eq!(on(&days[2]), [(8, 1.0), (9, 1.0), (10, 1.0), (11, 0.333333333)]);
        assert_eq!((lacking.days, &lacking.most), ([3, 0], &None));
    }

    #[test]
    fn other_hours_are_taken_if_they_are_preferred() {
        let prefer = |which: &str| {
            let price = |hour: usize| ((hour + 12) % 24) as f64;
            let keys = json!({ "fill_day": 4.5, "hours": [20, 14], "prefer": which });
            on(&switch(&[keys], &price)[0].0[2])
        };
        assert_eq!(prefer("darkest"), [(0, 1.0), (1, 0.25)]);
        assert_eq!(prefer("earliest"), [(0, 1.0), (1, 0.25)]);
        assert_eq!(prefer("latest"), [(22, 0.25), (23, 1.0)]);
        assert_eq!(prefer("cheapest"), [(12, 1.0), (13, 0.25)]);
    }

    #[test]
    fn days_that_cannot_be_filled_up_are_told() {
        // 2.5 h bring 9 mol/m2: the dim day lacks 1.92, and the dark one 3
        let found = switch(&[json!({ "fill_day": 12, "hours": [2, 4.5] })], &|_| 0.0);
        let (days, lacking) = &found[0];
        assert!(on(&days[0]).is_empty());
        assert_eq!(on(&days[2]), [(2, 1.0), (3, 1.0), (4, 0.5)]);
        let (most, day) = lacking.most.as_ref().unwrap();
        assert_eq!((lacking.days, &day[..]), ([3, 2], "1970-01-03"));
        assert!((most - 3.0).abs() < 1e-9);
    }

    #[test]
    fn lamps_fill_up_what_those_before_them_leave_open() {
        // the first lamps have their hours whatever the day brings; the second bring the rest
        let lamps = [
            json!({ "until_dli": 1000, "hours": [0, 2] }),
            json!({ "fill_day": 12, "hours": [0, 4] }),
            json!({ "fill_day": 12.36, "hours": [0, 24], "prefer": "latest" }),
        ];
        let found = switch(&lamps, &|_| 0.0);
        let dark: Vec<_> = found.iter().map(|(days, _)| on(&days[2])).collect();
        assert_eq!(dark[0], [(0, 1.0), (1, 1.0)]);
        assert_eq!(dark[1], [(0, 1.0), (1, 0.333333333)]);
        assert_eq!(dark[2], [(23, 0.1)]);
        // until_dli alone does not know what is to come: it burns from midnight on, on the bright day too
        let until = switch(&[json!({ "until_dli": 12 })], &|_| 0.0);
        assert_eq!(on(&until[0].0[0]), [(0, 1.0), (1, 1.0), (2, 1.0), (3, 0.333333333)]);
    }
}
