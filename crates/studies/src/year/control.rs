//! Control of lamps by the hour, as a control file says.

use std::path::Path;

use super::{
    burning::{Burning, Entry, Lacking, Place},
    conditions::{Outside, Wrong},
    hours::Lamp,
    part::Part,
    places::Places,
};
use phylux_core::{
    error::{Error, Result, nearest},
    math::units::Quantity,
    scene::world::Scene,
};
use phylux_files::{
    control_file::{ControlFile, DimFile, LampControl},
    json,
    output::folder_of,
    scene_file::HourlyLights,
};
use phylux_results::result::BandResult;

/// The entries of a control file, and the places that they are about.
#[derive(Default)]
pub(super) struct Entries<'a> {
    all: Vec<Entry<'a>>,
    places: Vec<Place>,
}

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
                let prices = match &lamps.prices {
                    None => Vec::new(),
                    Some(file) => {
                        let wrong: Wrong = &|key, problem| wrong(&format!("/prices{key}"), problem);
                        self.outside.prices(file, &folder, wrong)?
                    }
                };
                let (on, power, lacking) = (Vec::new(), Vec::new(), Lacking::default());
                entries.push(Entry { lamps, lights, place, may, dim, prices, on, power, lacking });
            }
        }
        let off: Vec<String> =
            (0..names.len()).filter(|&l| !taken[l]).map(|l| format!("`{}`", names[l])).collect();
        if !off.is_empty() {
            let some = off[..off.len().min(5)].join(", ");
            let more =
                if off.len() > 5 { format!(" and {} more", off.len() - 5) } else { String::new() };
            warnings.push(format!(
                "lights that no control file names are off: {some}{more}; name them in one \
                 (docs/year.md#the-control-file)"
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
        Burning::new(self.outside.slots, parts, (&entries, &places), self.places, |place| {
            (self.daylight)(parts, place)
        })?
        .switch(&mut entries);
        let quantity = parts[0].scene.quantity();
        warnings.extend(entries.iter().filter_map(|entry| self.lacks(entry, &places, quantity)));
        for entry in entries.iter().filter(|entry| entry.lamps.fill_to.is_some()) {
            if entry.may.iter().any(|may| *may > 0.0) && entry.on.iter().all(|on| *on == 0.0) {
                let of = entry.lamps.of.as_deref().unwrap_or_default();
                warnings.push(format!(
                    "the lamps `{}` were never on: there is always enough light at `{of}` (`fill_to`), or theirs \
                     does not reach it (docs/year.md#the-control-file)",
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

    /// Returns a warning if the lamps of an entry could not fill up some days.
    fn lacks(&self, entry: &Entry, places: &[Place], quantity: Quantity) -> Option<String> {
        let (amount, day) = entry.lacking.most.as_ref()?;
        let [all, lacking] = entry.lacking.days;
        let (id, _) = places[entry.place?];
        let unit = match quantity {
            Quantity::Micromole => "mol/m2",
            Quantity::Watt => "MJ/m2",
        };
        Some(format!(
            "`{}` cannot fill up {lacking} of {all} days at `{}` (`fill_day`): at most {amount:.2} {unit} lack, on {day}; \
             give the lamps more hours or power (docs/year.md#filling-up-a-day)",
            entry.lamps.lights, self.places.ids[id]
        ))
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
        let of_days = [("/until_dli", lamps.until_dli), ("/fill_day", lamps.fill_day)];
        let of_days = of_days.iter().find(|(_, given)| given.is_some());
        if let (Some((key, _)), false) = (of_days, self.integrated[band]) {
            let problem = format!("no daily light integral of band `{}`", self.bands[band].name);
            return Err(wrong(key, problem).remedy("name one within 400 to 700 nm"));
        }
        Ok(Some((id, band)))
    }
}
