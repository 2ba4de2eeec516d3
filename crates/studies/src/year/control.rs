//! Control of lamps by the hour, as a control file says.

use std::path::Path;

use super::{
    conditions::{Outside, Wrong},
    hours::{HOUR, Lamp, local},
    part::Part,
    places::Places,
};
use phylux_core::{
    error::{Error, Result, nearest},
    scene::world::Scene,
};
use phylux_files::{
    control_file::{ControlFile, DimFile, LampControl},
    json,
    output::folder_of,
    scene_file::HourlyLights,
};
use phylux_results::result::BandResult;

/// An entry of the control file, with the lamps and the place that it is about.
struct Entry<'a> {
    lamps: &'a LampControl,
    /// Indices among the lights that are not daylight.
    lights: Vec<usize>,
    /// Index of the captor or group and band in the list of all places.
    place: Option<usize>,
    /// For each slot the fraction of it in which they may be on by the clock and the light outside,
    /// and the fraction of their power to which they are dimmed.
    may: Vec<f64>,
    dim: Vec<f64>,
    /// For each slot the fraction of it in which they are on, and the fraction of their energy.
    on: Vec<f64>,
    power: Vec<f64>,
}

/// The entries of a control file, and the places that they are about.
#[derive(Default)]
pub(super) struct Entries<'a> {
    all: Vec<Entry<'a>>,
    places: Vec<Place>,
}

/// A captor or group and a band, by index.
pub(super) type Place = (usize, usize);

/// Finds daylight in each slot.
type DaylightAt<'a> = dyn Fn(&[Part], Place) -> Result<Vec<f64>> + Sync + 'a;

/// What a control decides by.
pub(super) struct Controlled<'a> {
    pub places: &'a Places,
    pub bands: &'a [BandResult],
    /// For each band or sum, whether it has a daily light integral.
    pub integrated: &'a [bool],
    pub outside: &'a Outside<'a>,
    /// Finds daylight on the front of a captor or group in a band, for each slot.
    pub daylight: &'a DaylightAt<'a>,
}

/// Returns the names of the lights that are not daylight.
pub(super) fn lamp_names<'s>(scene: &'s Scene, hourly: &HourlyLights) -> Vec<&'s str> {
    let mut is_daylight = vec![false; scene.lights().len()];
    hourly.lights.iter().for_each(|light| is_daylight[light.light] = true);
    let lamps = scene.lights().iter().zip(is_daylight).filter(|(_, daylight)| !daylight);
    lamps.map(|(light, _)| light.name.as_str()).collect()
}

impl Controlled<'_> {
    /// Reads which of the lights that are not daylight, with these `names`, the entries of a control
    /// file are about, and adds to the `warnings`. Error: the file names what the scene does not
    /// have.
    pub fn entries<'f>(
        &self,
        names: &[&str],
        file: Option<(&'f ControlFile, &str)>,
        warnings: &mut Vec<String>,
    ) -> Result<Entries<'f>> {
        let Entries { all: mut entries, mut places } = Entries::default();
        let mut taken = vec![false; names.len()];
        if let Some((file, path)) = file {
            for (i, lamps) in file.lamps.iter().enumerate() {
                let wrong = |key: &str, problem: String| {
                    Error::input(json::place(path, &format!("/lamps/{i}{key}")), problem)
                };
                let lights: Vec<usize> =
                    (0..names.len()).filter(|&l| lamps.names(names[l])).collect();
                if lights.is_empty() {
                    let error = wrong("/lights", format!("no lamp `{}`", lamps.lights));
                    let near = nearest(&lamps.lights, names.iter().copied());
                    let otherwise = "name a light of the scene that is no sun or sky";
                    return Err(error.did_you_mean(near, otherwise));
                }
                for &light in &lights {
                    if std::mem::replace(&mut taken[light], true) {
                        let problem = format!("light `{}` stands in two entries", names[light]);
                        return Err(wrong("/lights", problem).remedy("let it stand in one"));
                    }
                }
                let place = self.place(lamps, &wrong)?.map(|place| {
                    places.iter().position(|known| *known == place).unwrap_or_else(|| {
                        places.push(place);
                        places.len() - 1
                    })
                });
                let folder = folder_of(Path::new(path));
                let slots = self.outside.slots.len();
                let dim = match &lamps.dim {
                    None => vec![1.0; slots],
                    Some(DimFile::Fraction(dim)) => vec![*dim; slots],
                    Some(DimFile::Series(series)) => {
                        let wrong: Wrong = &|key, problem| wrong(&format!("/dim{key}"), problem);
                        self.outside.series(series, &folder, wrong)?
                    }
                };
                let may = self.outside.shares(&lamps.when(), &folder, &wrong)?;
                let (on, power) = (Vec::new(), Vec::new());
                entries.push(Entry { lamps, lights, place, may, dim, on, power });
            }
        }
        let off: Vec<String> =
            (0..names.len()).filter(|&l| !taken[l]).map(|l| format!("`{}`", names[l])).collect();
        if !off.is_empty() {
            let some = off[..off.len().min(5)].join(", ");
            let more =
                if off.len() > 5 { format!(" and {} more", off.len() - 5) } else { String::new() };
            warnings.push(format!(
                "lights that no control file names are off: {some}{more}; name them in a file for --control"
            ));
        }
        Ok(Entries { all: entries, places })
    }

    /// Switches the lamps hour by hour, and adds them to the lights of the hours. Returns the lamps
    /// with their indices among the lights that are not daylight, and adds to the `warnings`.
    pub fn switch_lamps(
        &self,
        parts: &mut [Part],
        Entries { all: mut entries, places }: Entries,
        warnings: &mut Vec<String>,
    ) -> Result<Vec<(usize, Lamp)>> {
        self.switch(parts, &mut entries, &places)?;
        for entry in entries.iter().filter(|entry| entry.lamps.fill_to.is_some()) {
            if entry.may.iter().any(|may| *may > 0.0) && entry.on.iter().all(|on| *on == 0.0) {
                let of = entry.lamps.of.as_deref().unwrap_or_default();
                warnings.push(format!(
                    "the lamps `{}` were never on: there is always enough light at `{of}` (`fill_to`), or theirs \
                     does not reach it",
                    entry.lamps.lights
                ));
            }
        }
        let mut switched = Vec::new();
        for entry in entries {
            for &lamp in &entry.lights {
                for part in &mut *parts {
                    for (slot, power) in entry.power.iter().enumerate() {
                        let strength = power * part.shares[slot];
                        if strength > 0.0 {
                            part.weights[slot].push((part.lamps[lamp], strength));
                        }
                    }
                }
                let name = parts[0].scene.lights()[parts[0].lamps[lamp]].name.clone();
                let watts = entry.lamps.watts.or(parts[0].scene.watts().get(&name).copied());
                let (on, power) = (entry.on.clone(), entry.power.clone());
                switched.push((lamp, Lamp { name, watts, on, power }));
            }
        }
        Ok(switched)
    }

    /// Returns the captor or group and band that the conditions of an entry read; `None` if the
    /// entry names no captor or group.
    fn place(
        &self,
        lamps: &LampControl,
        wrong: &dyn Fn(&str, String) -> Error,
    ) -> Result<Option<Place>> {
        let Some(of) = &lamps.of else { return Ok(None) };
        let Some(id) = self.places.ids.iter().position(|id| id == of) else {
            let error = wrong("/of", format!("no captor or group `{of}`"));
            let near = nearest(of, self.places.ids.iter().map(String::as_str));
            return Err(error.did_you_mean(near, "name a captor or group of the scene"));
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
    fn switch(&self, parts: &[Part], entries: &mut [Entry], places: &[Place]) -> Result<()> {
        let brings = |part: &Part, entry: &Entry, (id, band): Place| -> Result<f64> {
            let lights = entry.lights.iter().map(|&lamp| part.lamps[lamp]);
            lights.map(|light| part.front(self.places, light, id, band)).sum()
        };
        // what each entry brings to each place at its full power, for each part
        let of_part = |part: &Part| -> Result<Vec<Vec<f64>>> {
            let of = |entry: &Entry| places.iter().map(|&at| brings(part, entry, at)).collect();
            entries.iter().map(of).collect()
        };
        let full: Vec<Vec<Vec<f64>>> = parts.iter().map(of_part).collect::<Result<_>>()?;
        let daylight: Vec<Vec<f64>> =
            places.iter().map(|&place| (self.daylight)(parts, place)).collect::<Result<_>>()?;
        let mut since_midnight = vec![0.0; places.len()];
        let mut today = None;
        for (s, slot) in self.outside.slots.iter().enumerate() {
            let (day, _) = local(slot);
            if today.replace(day) != Some(day) {
                since_midnight.fill(0.0);
            }
            let daylight: Vec<f64> = daylight.iter().map(|of_place| of_place[s]).collect();
            let amount = slot.length * HOUR;
            for (sum, daylight) in since_midnight.iter_mut().zip(&daylight) {
                *sum += amount * daylight;
            }
            // daylight and the lamps of the entries so far
            let mut light = daylight.clone();
            for (e, entry) in entries.iter_mut().enumerate() {
                let full: Vec<f64> = (0..places.len())
                    .map(|p| {
                        parts.iter().zip(&full).map(|(part, f)| part.shares[s] * f[e][p]).sum()
                    })
                    .collect();
                let lamps = entry.lamps;
                let (mut on, mut strength) = (entry.may[s], entry.dim[s]);
                let dim = |place: usize| lamps.below.is_none_or(|below| daylight[place] < below);
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
                if let (Some(until), Some(place)) = (lamps.until_dli, entry.place) {
                    let missing = (until - since_midnight[place]).max(0.0);
                    let brought = amount * strength * full[place];
                    on = if missing < on * brought { missing / brought } else { on };
                    on = if missing > 0.0 { on } else { 0.0 };
                }
                on = if strength > 0.0 { on } else { 0.0 };
                let power = on * strength;
                for ((sum, light), full) in since_midnight.iter_mut().zip(&mut light).zip(&full) {
                    *light += power * full;
                    *sum += amount * power * full;
                }
                entry.on.push(on);
                entry.power.push(power);
            }
        }
        Ok(())
    }
}
