//! Daylight and lamps by the hour. One run keeps the patches of the sky, bundles of suns and the
//! lamps apart. For every hour, the light on a captor is a weighted sum of what each of them
//! brought.
//!
//! The sky of an hour consists of the same patches with weights of its own. Its light on a captor
//! is therefore the product of a matrix, which is traced once, and these weights. The suns of the
//! hours are bundled on a grid, and only their scattered light counts, which changes smoothly as
//! the sun moves. Light straight from the sun or by way of one flat mirror is found by shadow rays
//! towards the sun's position in each hour.
//!
//! Read [`Year::find`], then [`control`] for the lamps, [`interpolated`] for what the grid costs and
//! [`tables`] for what is written.

mod control;
mod interpolated;
pub mod tables;
mod value;

pub use value::Value;

use std::collections::HashSet;

use indexmap::IndexMap;

use interpolated::{FACTOR, HOURS, MANY, bends};

use crate::{
    error::{Error, Result},
    formats::{
        control_file::ControlFile,
        scene_file::{HourlyLights, LoadedScene},
        weather::Slot,
    },
    math::units::Quantity,
    results::result::{BandResult, CaptorResult, FEW_HISTORIES, FaceResult, RunResult},
    scene::{
        daylight::{Date, InfiniteLight, InfinitePart, InfiniteShape, Suns},
        world::Scene,
    },
    transport::{
        direct_sun::direct_sun,
        paths::Unseen,
        settings::Settings,
        simulate::{Control, simulate_without_direct_sun},
    },
};

/// Light of 1 umol/m2/s in an hour, mol/m2, or of 1 W/m2, MJ/m2.
const HOUR: f64 = 3600.0 * 1e-6;

/// Fraction of the daylight above which sunlight that is not found hour by hour is worth a warning.
const UNSEEN: f64 = 1e-3;

/// Daylight and lamps by the hour on the fronts of captors and groups.
pub struct Year {
    /// Ids of the captors, then of the groups that have no captor's id.
    pub ids: Vec<String>,
    /// The bands and sums.
    pub bands: Vec<BandResult>,
    /// For each band or sum, whether it has a daily light integral.
    pub integrated: Vec<bool>,
    /// Unit of the daily light integrals.
    pub unit: &'static str,
    /// All hours of the period.
    pub slots: Vec<Slot>,
    /// The lamps that are controlled.
    pub lamps: Vec<Lamp>,
    /// The run that found all light except straight sunlight.
    pub run: RunResult,
    /// Warnings that a user should read.
    pub warnings: Vec<String>,
    /// For each light, at its power in the run: irradiance and its standard error, at each id and
    /// band.
    responses: Vec<Vec<[f32; 2]>>,
    /// For each light that is a bundle of suns, how far its light is from what the bundles beside
    /// it let expect, at each id and band.
    bends: Vec<Vec<f32>>,
    /// For each hour, the lights that shine and their strengths, as multiples of their power in the
    /// run.
    weights: Vec<Vec<(usize, f64)>>,
    /// For each light, whether it is daylight.
    is_daylight: Vec<bool>,
    /// For each hour, the index of its sun.
    suns: Vec<Option<usize>>,
    /// Irradiance straight from these suns, or by way of one flat mirror, and its standard error:
    /// for each id, sun by sun and band by band.
    direct: Vec<Vec<[f32; 2]>>,
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
}

impl Year {
    /// Traces a scene that was loaded by the hour. The lamps are controlled by `file`, a control
    /// file and its name. Errors: those of a run; a control file that names what the scene does not
    /// have.
    pub fn find(
        loaded: &LoadedScene,
        file: Option<(&ControlFile, &str)>,
        settings: &Settings,
        control: &Control,
    ) -> Result<Self> {
        let scene = &loaded.scene;
        let hourly = loaded.hourly.as_ref().ok_or_else(|| {
            Error::input(&scene.name, "was not loaded by the hour").remedy("load it so")
        })?;
        let simulation = simulate_without_direct_sun(scene, settings, control)?;
        let run = RunResult::new(scene, settings, &simulation);
        let bands = run.bands.clone();
        let ids = ids(&run);
        let (suns, lights) = moving_suns(hourly);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(settings.threads).build();
        let pool = pool.map_err(|e| Error::run("threads", e))?;
        let mut direct = pool.install(|| direct_sun(scene, &lights, settings.seed, control))?;
        for group in 0..scene.groups.len() {
            if ids.contains(&scene.groups[group])
                && !run.captors.iter().any(|captor| captor.id == scene.groups[group])
            {
                direct.push(of_group(scene, group, &direct, lights.len() * bands.len()));
            }
        }
        let mut weights = vec![Vec::new(); hourly.slots.len()];
        let mut slot_of_hour = vec![0; hourly.hours.len()];
        for (s, slot) in hourly.slots.iter().enumerate() {
            slot.hour.iter().for_each(|&h| slot_of_hour[h] = s);
        }
        let mut is_daylight = vec![false; scene.lights.len()];
        for light in &hourly.lights {
            is_daylight[light.light] = true;
            for &(h, factor) in &light.factors {
                weights[slot_of_hour[h]].push((light.light, factor));
            }
        }
        // a sum with a unit of its own is not in MJ
        let par = |band: &BandResult| match scene.quantity {
            Quantity::Watt => band.unit.is_none(),
            Quantity::Micromole => band.has_dli(&bands, true),
        };
        let responses = responses(&run, &ids, scene.lights.len());
        let mut year = Self {
            integrated: bands.iter().map(par).collect(),
            unit: match scene.quantity {
                Quantity::Watt => "MJ/m2/d",
                Quantity::Micromole => "mol/m2/d",
            },
            bends: bends(hourly, &responses),
            responses,
            slots: hourly.slots.clone(),
            lamps: Vec::new(),
            warnings: Vec::new(),
            ids,
            bands,
            is_daylight: is_daylight.clone(),
            weights,
            suns,
            direct,
            run,
        };
        let steady: Vec<usize> = (0..scene.lights.len()).filter(|&l| !is_daylight[l]).collect();
        year.control_lamps(scene, &steady, file)?;
        let is_lit = |lamp: &&Lamp| lamp.on.iter().any(|on| *on > 0.0);
        let lit: HashSet<String> =
            year.lamps.iter().filter(is_lit).map(|l| l.name.clone()).collect();
        let few = |of: &str, wanted: &dyn Fn(usize) -> bool| few_photons(&year.run, of, wanted);
        let warnings = [
            few(
                "daylight, but for what comes straight from the sun or by one flat mirror,",
                &|l| is_daylight[l],
            )
            .filter(|_| hourly.lights.iter().any(|light| !light.factors.is_empty())),
            few("the lamps", &|l| lit.contains(&scene.lights[l].name)).filter(|_| !lit.is_empty()),
        ];
        let unseen = Unseen::of_suns(scene, settings.seed).and_then(|unseen| unseen_sun(&unseen));
        let warnings = warnings.into_iter().chain([unseen, year.interpolated(), year.no_ratios()]);
        let warnings: Vec<String> = warnings.flatten().collect();
        year.warnings.extend(warnings);
        Ok(year)
    }

    /// Returns a warning if the scene asks for ratios, which a year does not compute.
    fn no_ratios(&self) -> Option<String> {
        let names: Vec<&str> = self.run.ratios.iter().map(|ratio| ratio.name.as_str()).collect();
        (!names.is_empty()).then(|| {
            format!(
                "a year has no ratios: {} are not in its tables; divide the sums that they are made of",
                names.join(", ")
            )
        })
    }

    /// Returns the number of bands and sums.
    fn width(&self) -> usize {
        self.bands.len()
    }

    /// Returns the irradiance at an id, by its index, in a band and hour, by their indices.
    fn at(&self, slot: usize, id: usize, band: usize) -> f64 {
        let place = id * self.width() + band;
        let scattered: f64 = self.weights[slot]
            .iter()
            .map(|&(light, weight)| weight * f64::from(self.responses[light][place][0]))
            .sum();
        let direct = self.suns[slot]
            .map_or(0.0, |sun| f64::from(self.direct[id][sun * self.width() + band][0]));
        scattered + direct
    }

    /// Returns the irradiances at all ids and bands, summed over hours with a weight each. Hours
    /// share the results of the lights, so errors add up light by light; shadow rays differ in each
    /// hour.
    pub fn sum(&self, hours: impl Iterator<Item = (usize, f64)> + Clone) -> Vec<Value> {
        self.sum_of(hours, |_| true)
    }

    /// Returns the same sums for the lights that are `wanted` and for light straight from the sun.
    fn sum_of(
        &self,
        hours: impl Iterator<Item = (usize, f64)> + Clone,
        wanted: impl Fn(usize) -> bool,
    ) -> Vec<Value> {
        let width = self.width();
        let mut sums = vec![Value::default(); self.ids.len() * width];
        let mut strengths = vec![0.0; self.responses.len()];
        for (slot, share) in hours.clone() {
            let lights = self.weights[slot].iter().filter(|(light, _)| wanted(*light));
            lights.for_each(|&(light, weight)| strengths[light] += share * weight);
        }
        for (strength, responses) in strengths.iter().zip(&self.responses) {
            if *strength != 0.0 {
                for (sum, &[mean, error]) in sums.iter_mut().zip(responses) {
                    sum.add(*strength, mean, error);
                }
            }
        }
        for (slot, share) in hours {
            let Some(sun) = self.suns[slot] else { continue };
            for (sums, direct) in sums.chunks_mut(width).zip(&self.direct) {
                for (sum, &[mean, error]) in sums.iter_mut().zip(&direct[sun * width..]) {
                    sum.add(share, mean, error);
                }
            }
        }
        sums
    }

    /// Returns the hours of each day, of each month or of the whole period, by the name that `name`
    /// gives to their dates.
    pub fn periods(&self, name: impl Fn(Date) -> String) -> IndexMap<String, Vec<usize>> {
        let mut periods: IndexMap<String, Vec<usize>> = IndexMap::new();
        for (s, slot) in self.slots.iter().enumerate() {
            periods.entry(name(local(slot).0)).or_default().push(s);
        }
        periods
    }

    /// Returns how many hours a lamp was on in some slots.
    pub fn hours_on(&self, lamp: &Lamp, slots: impl Iterator<Item = usize>) -> f64 {
        slots.map(|s| lamp.on[s] * self.slots[s].length).sum()
    }

    /// Returns the mean daily light integral over some hours at all ids and bands, in
    /// [`unit`](Self::unit). For less than a day, it is what these hours brought.
    pub fn daily(&self, slots: &[usize]) -> Vec<Value> {
        self.sum(self.of_a_day(slots))
    }

    /// Returns the same integrals for daylight alone.
    pub fn daily_daylight(&self, slots: &[usize]) -> Vec<Value> {
        self.sum_of(self.of_a_day(slots), |light| self.is_daylight[light])
    }

    /// Returns the weights of some hours by which their sum is the mean integral over a day.
    fn of_a_day<'a>(
        &'a self,
        slots: &'a [usize],
    ) -> impl Iterator<Item = (usize, f64)> + Clone + 'a {
        let hours: f64 = slots.iter().map(|&s| self.slots[s].length).sum();
        let scale = HOUR / (hours / 24.0).max(1.0);
        slots.iter().map(move |&s| (s, scale * self.slots[s].length))
    }
}

impl Year {
    /// Returns the irradiances at all ids and bands in an hour. Their errors include what the light
    /// of the hour may be off because it is interpolated.
    pub fn hour(&self, slot: usize) -> Vec<Value> {
        let mut values = self.sum(std::iter::once((slot, 1.0)));
        for (value, off) in values.iter_mut().zip(self.off(slot)) {
            value.variance += off * off;
        }
        values
    }

    /// Returns by how much the interpolated light of an hour may be off, at all ids and bands.
    fn off(&self, slot: usize) -> Vec<f64> {
        let mut off = vec![0.0; self.ids.len() * self.width()];
        for &(light, weight) in &self.weights[slot] {
            for (off, bend) in off.iter_mut().zip(&self.bends[light]) {
                *off += FACTOR * weight * f64::from(*bend);
            }
        }
        off
    }

    /// Returns a warning if at more than a few captors and groups the light of hours is less sure
    /// because it is interpolated than because of chance.
    fn interpolated(&self) -> Option<String> {
        let width = self.width();
        let mut squares = vec![[0.0; 2]; self.ids.len() * width];
        let lit = (0..self.slots.len()).filter(|&slot| self.suns[slot].is_some());
        let lit: Vec<usize> = lit.collect();
        for &slot in lit.iter().step_by(lit.len().div_ceil(HOURS).max(1)) {
            let by_chance = self.sum(std::iter::once((slot, 1.0)));
            for (([off, noise], more), value) in
                squares.iter_mut().zip(self.off(slot)).zip(by_chance)
            {
                *off += more * more;
                *noise += value.variance;
            }
        }
        let wide = |squares: &&[[f64; 2]]| squares.iter().any(|[off, noise]| off > noise);
        let many = squares.chunks(width).filter(wide).count();
        let all = self.ids.len();
        (many as f64 > MANY * all as f64).then(|| {
            format!(
                "hours are interpolated: at {many} of {all} captors and groups scattered sunlight changes so \
                 fast with the sun's position that this, and not chance, makes up most of the errors of hours; \
                 sums over the period are right, and an hour that matters is best run by itself"
            )
        })
    }
}

/// Returns the day and the hours since midnight at which a slot starts, on the clock of the weather
/// file.
fn local(slot: &Slot) -> (Date, f64) {
    const DAY: f64 = 86_400.0;
    let local = slot.start.unix + slot.start.offset;
    (Date::from_days((local / DAY).floor() as i64), local.rem_euclid(DAY) / 3600.0)
}

/// Returns a warning of captors on whose fronts too few photons of the lights `wanted` arrived to
/// estimate an error; `None` if there are no such captors.
fn few_photons(run: &RunResult, of: &str, wanted: &dyn Fn(usize) -> bool) -> Option<String> {
    let arrived = |captor: &CaptorResult| -> u64 {
        let parts = captor.front.by_light.iter().flat_map(|parts| parts.values()).enumerate();
        parts.filter(|(light, _)| wanted(*light)).map(|(_, face)| face.photons).sum()
    };
    let mut few = run.captors.iter().filter(|captor| arrived(captor) < FEW_HISTORIES);
    let first = few.next()?;
    Some(format!(
        "fewer than {FEW_HISTORIES} photons of {of} arrived at {} of {} captors (`{}` is the first): neither these \
         values nor their errors can be relied on, and a 0 may be chance; trace more photons",
        1 + few.count(),
        run.captors.len(),
        first.id
    ))
}

/// Returns a warning of sunlight that is mirrored or refracted but not found hour by hour; `None` if
/// there is hardly any.
fn unseen_sun(unseen: &Unseen) -> Option<String> {
    let share = unseen.share();
    (share > UNSEEN).then(|| {
        format!(
            "about {:.2} % of the daylight on the captors is sunlight that is mirrored or refracted otherwise than \
             by one flat pane or mirror (unseen): it is interpolated between hours, so that single hours may \
             be wrong by more than their errors say where it is bright; sums over the period are right",
            100.0 * share
        )
    })
}

/// Returns the ids of the captors, then those of the groups that have no captor's id.
fn ids(run: &RunResult) -> Vec<String> {
    let captors = run.captors.iter().map(|captor| captor.id.clone());
    let mut ids: Vec<String> = captors.collect();
    let known: HashSet<&str> = run.captors.iter().map(|captor| captor.id.as_str()).collect();
    ids.extend(run.groups.iter().filter(|g| !known.contains(g.id.as_str())).map(|g| g.id.clone()));
    ids
}

/// Returns the irradiance that each light brought to each id and band, and its standard error.
fn responses(run: &RunResult, ids: &[String], lights: usize) -> Vec<Vec<[f32; 2]>> {
    let width = run.bands.len();
    let mut responses = vec![Vec::with_capacity(ids.len() * width); lights];
    let captors = run.captors.iter().map(|captor| &captor.front);
    let groups = run.groups.iter().filter(|group| ids[run.captors.len()..].contains(&group.id));
    for face in captors.chain(groups.map(|group| &group.front)) {
        let parts = face.by_light.iter().flat_map(|parts| parts.values());
        for (responses, FaceResult { irradiance, irradiance_se, .. }) in
            responses.iter_mut().zip(parts)
        {
            let errors = irradiance_se.iter().map(|error| error.unwrap_or(0.0) as f32);
            responses.extend(irradiance.iter().zip(errors).map(|(e, error)| [*e as f32, error]));
        }
    }
    responses
}

/// Returns for each slot the index of its sun, and these suns as lights.
fn moving_suns(hourly: &HourlyLights) -> (Vec<Option<usize>>, Vec<InfiniteLight>) {
    let mut lights = Vec::new();
    let suns = hourly.slots.iter().map(|slot| {
        let hour = &hourly.hours[slot.hour?];
        let toward = hour.sun.direction(hourly.north);
        let parts = hourly.suns.iter().filter_map(|sun| {
            let disc = Suns::new(sun.half_angle, [(toward, hour.direct_normal)])?;
            let strength = sun.shares.iter().map(|share| share * hour.direct_normal).collect();
            Some(InfinitePart::new(InfiniteShape::Suns(disc.into()), strength))
        });
        let parts: Vec<InfinitePart> = parts.collect();
        (!parts.is_empty()).then(|| {
            let bands = parts[0].scale().len();
            lights.push(InfiniteLight::new("sun".into(), bands, parts));
            lights.len() - 1
        })
    });
    (suns.collect(), lights)
}

/// Returns the mean over the captors of a group, weighted by their areas.
fn of_group(scene: &Scene, group: usize, direct: &[Vec<[f32; 2]>], length: usize) -> Vec<[f32; 2]> {
    let members = || scene.captors.iter().zip(direct).filter(|(c, _)| c.groups.contains(&group));
    let area: f64 = members().map(|(captor, _)| captor.area).sum();
    let mut sums = vec![Value::default(); length];
    for (captor, own) in members() {
        for (sum, &[mean, error]) in sums.iter_mut().zip(own) {
            sum.add(captor.area / area, mean, error);
        }
    }
    sums.iter().map(|sum| [sum.mean as f32, sum.variance.sqrt() as f32]).collect()
}
