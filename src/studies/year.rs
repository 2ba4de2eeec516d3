//! Daylight and lamps by the hour: one run in which patches of the sky, suns on a grid and lamps are kept apart, and
//! for every hour a weighted sum of what they brought.
//!
//! An hour's sky is the same patches with weights of its own, so that its light on a captor is a product of
//! a matrix, traced once, and these weights. Of the suns on the grid only scattered light counts, which changes
//! smoothly as the sun moves; what comes straight from the sun is found by shadow rays to where it
//! stands. Read [`Year::find`], then [`control`] for the lamps and [`tables`] for what is written.

mod control;
pub mod tables;

use std::collections::HashSet;

use indexmap::IndexMap;

use crate::{
    error::{Error, NOTHING_WRITTEN, Result},
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
        settings::Settings,
        simulate::{Control, simulate_without_direct_sun},
    },
};

/// mol/m2 of 1 umol/m2/s, or MJ/m2 of 1 W/m2, for an hour.
const HOUR: f64 = 3600.0 * 1e-6;

/// Daylight and lamps by the hour on the fronts of captors and groups.
pub struct Year {
    /// Ids of the captors, then of the groups that are no captor.
    pub ids: Vec<String>,
    /// The bands and sums.
    pub bands: Vec<BandResult>,
    /// Whether a daily light integral of each of these is told.
    pub integrated: Vec<bool>,
    /// What it is told in.
    pub unit: &'static str,
    /// All hours of the period.
    pub slots: Vec<Slot>,
    /// The lamps that are controlled.
    pub lamps: Vec<Lamp>,
    /// The run that all light but straight sunlight is from.
    pub run: RunResult,
    /// What a user should know.
    pub warnings: Vec<String>,
    /// Irradiance and its standard error by each light at the power of the run, at each id and band.
    responses: Vec<Vec<[f32; 2]>>,
    /// In each hour, the lights that shine and how strong: multiples of their power in the run.
    weights: Vec<Vec<(usize, f64)>>,
    /// Which lights are daylight.
    is_daylight: Vec<bool>,
    /// In each hour, the index of its sun.
    suns: Vec<Option<usize>>,
    /// Irradiance straight from these and its standard error: for each id, sun by sun, band by band.
    direct: Vec<Vec<[f32; 2]>>,
}

/// A lamp, and when it was on.
#[derive(Clone, Debug)]
pub struct Lamp {
    /// Its name.
    pub name: String,
    /// Electric power, W.
    pub watts: Option<f64>,
    /// For each hour, the part of it that the lamp was on, 0 to 1.
    pub on: Vec<f64>,
}

/// A value, and the square of its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Value {
    /// Irradiance, or an integral of it.
    pub mean: f64,
    /// Of the mean.
    pub variance: f64,
}

impl Year {
    /// Traces a scene that was loaded by the hour, with lamps as `file` (named `name`) says. Errors: those of a
    /// run; a control that names what the scene does not have.
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
        let mut direct = pool.install(|| direct_sun(scene, &lights, settings.seed));
        if control.stop.load(std::sync::atomic::Ordering::Relaxed) {
            return Err(Error::interrupted("run", NOTHING_WRITTEN));
        }
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
        let par = |band: &BandResult| scene.quantity == Quantity::Watt || band.is_par(&bands);
        let mut year = Self {
            integrated: bands.iter().map(par).collect(),
            unit: match scene.quantity {
                Quantity::Watt => "MJ/m2/d",
                Quantity::Micromole => "mol/m2/d",
            },
            responses: responses(&run, &ids, scene.lights.len()),
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
            few("daylight, but for what comes straight from the sun,", &|l| is_daylight[l]),
            few("the lamps", &|l| lit.contains(&scene.lights[l].name)).filter(|_| !lit.is_empty()),
        ];
        year.warnings.extend(warnings.into_iter().flatten());
        Ok(year)
    }

    /// Number of bands and sums.
    fn width(&self) -> usize {
        self.bands.len()
    }

    /// Irradiance at an id, by its index, in a band, in an hour.
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

    /// Irradiances at all ids and bands, summed over hours, each with a weight. Hours share what the lights
    /// bring, so their errors add up light by light; shadow rays are each hour's own.
    pub fn sum(&self, hours: impl Iterator<Item = (usize, f64)> + Clone) -> Vec<Value> {
        self.sum_of(hours, |_| true)
    }

    /// The same of lights that are `wanted`, and of what comes straight from the sun.
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

    /// The hours of each day, month or all, by name.
    pub fn periods(&self, name: impl Fn(Date) -> String) -> IndexMap<String, Vec<usize>> {
        let mut periods: IndexMap<String, Vec<usize>> = IndexMap::new();
        for (s, slot) in self.slots.iter().enumerate() {
            periods.entry(name(local(slot).0)).or_default().push(s);
        }
        periods
    }

    /// The hours that a lamp was on in some slots.
    pub fn hours_on(&self, lamp: &Lamp, slots: impl Iterator<Item = usize>) -> f64 {
        slots.map(|s| lamp.on[s] * self.slots[s].length).sum()
    }

    /// The mean daily light integral over some hours at all ids and bands, in [`unit`](Self::unit); of a part of a day
    /// what it brought.
    pub fn daily(&self, slots: &[usize]) -> Vec<Value> {
        self.sum(self.of_a_day(slots))
    }

    /// The same of daylight alone.
    pub fn daily_daylight(&self, slots: &[usize]) -> Vec<Value> {
        self.sum_of(self.of_a_day(slots), |light| self.is_daylight[light])
    }

    /// Weights that make an integral over a day, in the mean of the days, of some hours.
    fn of_a_day<'a>(
        &'a self,
        slots: &'a [usize],
    ) -> impl Iterator<Item = (usize, f64)> + Clone + 'a {
        let hours: f64 = slots.iter().map(|&s| self.slots[s].length).sum();
        let scale = HOUR / (hours / 24.0).max(1.0);
        slots.iter().map(move |&s| (s, scale * self.slots[s].length))
    }
}

impl Value {
    fn add(&mut self, share: f64, mean: f32, error: f32) {
        self.mean += share * f64::from(mean);
        self.variance += (share * f64::from(error)).powi(2);
    }
}

/// Day and hours since midnight at which a slot starts, on the clock of the weather file.
fn local(slot: &Slot) -> (Date, f64) {
    const DAY: f64 = 86_400.0;
    let local = slot.start.unix + slot.start.offset;
    (Date::from_days((local / DAY).floor() as i64), local.rem_euclid(DAY) / 3600.0)
}

/// A warning of captors on whose fronts too few photons of the lights `wanted` arrived for an error; none if there are
/// none.
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

/// Captors, then groups that are not the captor of that name.
fn ids(run: &RunResult) -> Vec<String> {
    let captors = run.captors.iter().map(|captor| captor.id.clone());
    let mut ids: Vec<String> = captors.collect();
    let known: HashSet<&str> = run.captors.iter().map(|captor| captor.id.as_str()).collect();
    ids.extend(run.groups.iter().filter(|g| !known.contains(g.id.as_str())).map(|g| g.id.clone()));
    ids
}

/// What each light brought to each id and band, and its standard error.
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

/// For each slot the index of its sun, and these suns as lights.
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

/// The mean over the captors of a group.
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
