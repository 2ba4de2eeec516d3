//! Control of lamps by the hour, as a control file says.

use super::{HOUR, Lamp, Year, local};
use crate::{
    error::{Error, Result, nearest},
    formats::{
        control_file::{ControlFile, LampControl},
        json,
    },
    scene::world::Scene,
};

/// An entry of the control file, with the lights and the place that it is about.
struct Entry<'a> {
    lamps: &'a LampControl,
    lights: Vec<usize>,
    /// Index of the captor or group and band in the list of all places.
    place: Option<usize>,
    on: Vec<f64>,
}

/// A captor or group and a band, by index.
type Place = (usize, usize);

impl Year {
    /// Switches the lights `steady` hour by hour, and adds them to the lights of the hours.
    pub(super) fn control_lamps(
        &mut self,
        scene: &Scene,
        steady: &[usize],
        file: Option<(&ControlFile, &str)>,
    ) -> Result<()> {
        let name = |light: usize| scene.lights[light].name.as_str();
        let mut places: Vec<Place> = Vec::new();
        let mut entries: Vec<Entry> = Vec::new();
        let mut taken = vec![false; scene.lights.len()];
        if let Some((file, path)) = file {
            for (i, lamps) in file.lamps.iter().enumerate() {
                let wrong = |key: &str, problem: String| {
                    Error::input(json::place(path, &format!("/lamps/{i}{key}")), problem)
                };
                let lights: Vec<usize> =
                    steady.iter().copied().filter(|&l| lamps.names(name(l))).collect();
                if lights.is_empty() {
                    let error = wrong("/lights", format!("no lamp `{}`", lamps.lights));
                    let all = steady.iter().map(|&l| name(l));
                    return Err(match nearest(&lamps.lights, all) {
                        Some(near) => error.remedy(format!("did you mean `{near}`?")),
                        None => error.remedy("name a light of the scene that is no sun or sky"),
                    });
                }
                for &light in &lights {
                    if std::mem::replace(&mut taken[light], true) {
                        let problem = format!("light `{}` stands in two entries", name(light));
                        return Err(wrong("/lights", problem).remedy("let it stand in one"));
                    }
                }
                let place = self.place(lamps, &wrong)?.map(|place| {
                    places.iter().position(|known| *known == place).unwrap_or_else(|| {
                        places.push(place);
                        places.len() - 1
                    })
                });
                entries.push(Entry { lamps, lights, place, on: Vec::new() });
            }
        }
        let off: Vec<String> =
            steady.iter().filter(|&&l| !taken[l]).map(|&l| format!("`{}`", name(l))).collect();
        if !off.is_empty() {
            let some = off[..off.len().min(5)].join(", ");
            let more =
                if off.len() > 5 { format!(" and {} more", off.len() - 5) } else { String::new() };
            self.warnings.push(format!(
                "lights that no control file names are off: {some}{more}; name them in a file for --control"
            ));
        }
        self.switch(&mut entries, &places);
        for entry in entries {
            for &light in &entry.lights {
                for (weights, on) in self.weights.iter_mut().zip(&entry.on) {
                    if *on > 0.0 {
                        weights.push((light, *on));
                    }
                }
                let (watts, on) = (entry.lamps.watts, entry.on.clone());
                self.lamps.push(Lamp { name: name(light).into(), watts, on });
            }
        }
        Ok(())
    }

    /// Returns the captor or group and band that the conditions of an entry read; `None` if the
    /// entry names no captor or group.
    fn place(
        &self,
        lamps: &LampControl,
        wrong: &dyn Fn(&str, String) -> Error,
    ) -> Result<Option<Place>> {
        let Some(of) = &lamps.of else { return Ok(None) };
        let Some(id) = self.ids.iter().position(|id| id == of) else {
            let error = wrong("/of", format!("no captor or group `{of}`"));
            return Err(match nearest(of, self.ids.iter().map(String::as_str)) {
                Some(near) => error.remedy(format!("did you mean `{near}`?")),
                None => error.remedy("name a captor or group of the scene"),
            });
        };
        let band = match &lamps.band {
            Some(band) => {
                self.bands.iter().position(|known| known.name == *band).ok_or_else(|| {
                    let all: Vec<&str> = self.bands.iter().map(|band| band.name.as_str()).collect();
                    wrong("/band", format!("no band or sum `{band}`"))
                        .remedy(format!("there are {}", all.join(", ")))
                })?
            }
            None => {
                let mut known = (0..self.bands.len()).filter(|&b| self.integrated[b]);
                match (known.next(), known.next()) {
                    (Some(band), None) => band,
                    _ => {
                        return Err(wrong("", "does not say which band it is about".into())
                            .remedy("name a band or sum as `band`"));
                    }
                }
            }
        };
        if lamps.until_dli.is_some() && !self.integrated[band] {
            let problem = format!("no daily light integral of band `{}`", self.bands[band].name);
            return Err(wrong("/until_dli", problem).remedy("name one within 400 to 700 nm"));
        }
        Ok(Some((id, band)))
    }

    /// Decides hour by hour how long the lamps of each entry are on. Entries are switched one after
    /// the other, and each takes into account what those before it bring.
    fn switch(&self, entries: &mut [Entry], places: &[Place]) {
        let brings = |entry: &Entry, (id, band): Place| -> f64 {
            let place = id * self.width() + band;
            entry.lights.iter().map(|&l| f64::from(self.responses[l][place][0])).sum()
        };
        let full: Vec<Vec<f64>> = entries
            .iter()
            .map(|e| places.iter().map(|&place| brings(e, place)).collect())
            .collect();
        let mut since_midnight = vec![0.0; places.len()];
        let mut today = None;
        for (s, slot) in self.slots.iter().enumerate() {
            let (day, start) = local(slot);
            if today.replace(day) != Some(day) {
                since_midnight.fill(0.0);
            }
            let daylight: Vec<f64> =
                places.iter().map(|&(id, band)| self.at(s, id, band)).collect();
            let amount = slot.length * HOUR;
            for (sum, daylight) in since_midnight.iter_mut().zip(&daylight) {
                *sum += amount * daylight;
            }
            for (entry, full) in entries.iter_mut().zip(&full) {
                let lamps = entry.lamps;
                let mut on = lamps.allowed(start, slot.length);
                let dim = |place: usize| lamps.below.is_none_or(|below| daylight[place] < below);
                if lamps.outside_below.is_some_and(|below| slot.global >= below)
                    || !entry.place.is_none_or(dim)
                {
                    on = 0.0;
                }
                if let (Some(until), Some(place)) = (lamps.until_dli, entry.place) {
                    let missing = (until - since_midnight[place]).max(0.0);
                    let brought = amount * full[place];
                    on = if missing < on * brought { missing / brought } else { on };
                    on = if missing > 0.0 { on } else { 0.0 };
                }
                for (sum, full) in since_midnight.iter_mut().zip(full) {
                    *sum += amount * on * full;
                }
                entry.on.push(on);
            }
        }
    }
}
