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
//! Read [`Year::find`], then [`part`] for what the lights bring, [`control`] for the lamps,
//! [`product`] for the light of the hours, [`interpolated`] for what the grid costs and [`tables`]
//! for what is written.

mod conditions;
mod control;
mod hours;
mod interpolated;
mod matrix;
mod needs;
mod part;
mod places;
mod product;
mod responses;
mod states;
pub mod tables;
mod value;

pub use hours::Lamp;
pub use needs::{Needs, gigabytes};
pub use places::Places;
pub use states::{StateScene, YearScenes};
pub use value::Value;

use std::path::PathBuf;

use conditions::Outside;
use control::Controlled;
use hours::{day, month, of_a_day, periods};
use indexmap::IndexMap;
use interpolated::MANY;
use matrix::Matrix;
use part::{Part, too_few_photons};
use product::{Product, Wanted, daylight_at};

use crate::{
    error::{Error, Result},
    formats::{control_file::ControlFile, scene_file::HourlyLights, weather::Slot},
    math::{machine, pattern, stats, units::Quantity},
    results::result::{BandResult, band_results},
    scene::captor::Channel,
    transport::{direct_sun::SunRays, paths::Unseen, settings::Settings, simulate::Control},
};

/// Fraction of the daylight above which sunlight that is not found hour by hour is worth a warning.
const UNSEEN: f64 = 1e-3;

/// The number of columns from which a ratio is found.
const RATIO: usize = 3;

/// The largest number of groups, or of captors if there are no groups, that the chart shows.
const CHARTED: usize = 6;

/// How a year is to be found.
#[derive(Clone)]
pub struct YearOptions<'a> {
    /// A control file and its name.
    pub control: Option<(&'a ControlFile, &'a str)>,
    /// The captors and groups whose hours are wanted.
    pub hours: HoursOf,
    /// Number of points of each captor from which the sun is looked for in each hour; `None` takes
    /// as many as the number of captors allows.
    pub sun_rays: Option<u64>,
    /// A folder on a disk that has room for what does not fit into memory.
    pub scratch: PathBuf,
    /// Is told what is done next: what the progress counts from here on.
    pub phase: &'a (dyn Fn(&str) + Sync),
}

impl Default for YearOptions<'_> {
    fn default() -> Self {
        let scratch = std::env::temp_dir();
        let hours = HoursOf::default();
        Self { control: None, hours, sun_rays: None, scratch, phase: &|_| {} }
    }
}

/// The captors and groups whose light is kept for each hour.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum HoursOf {
    /// All of them; only groups if there are more than [`HoursOf::ALL`].
    #[default]
    Usual,
    /// All of them.
    All,
    /// Groups.
    Groups,
    /// None.
    None,
    /// Those whose id or name fits this pattern, in which `*` stands for any characters.
    Like(String),
}

impl HoursOf {
    /// The largest number of captors and groups all of whose hours are kept unless that is asked
    /// for.
    pub const ALL: usize = 1000;

    /// Returns for each id whether its hours are wanted. Error: a pattern that nothing fits.
    fn chosen(&self, places: &Places) -> Result<Vec<bool>> {
        let all = places.ids.len();
        let from = |first: usize| (0..all).map(|id| id >= first).collect();
        Ok(match self {
            Self::All => from(0),
            Self::Usual if all <= Self::ALL => from(0),
            Self::Usual | Self::Groups => from(places.captors),
            Self::None => from(all),
            Self::Like(pattern) => {
                let chosen: Vec<bool> =
                    places.ids.iter().map(|id| pattern::fits(pattern, id)).collect();
                if !chosen.contains(&true) {
                    let problem = format!("no captor and no group like `{pattern}`");
                    return Err(Error::input("--hours", problem)
                        .remedy("`*` stands for any characters; or say groups, all or none"));
                }
                chosen
            }
        })
    }
}

/// Daylight and lamps by the hour on captors and groups.
pub struct Year {
    /// The captors and groups.
    pub places: Places,
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
    /// For each state its name, and for each hour the fraction of it in which it holds.
    pub states: Vec<(String, Vec<f64>)>,
    /// Warnings that a user should read.
    pub warnings: Vec<String>,
    /// Number of photons, and the seed.
    pub photons: u64,
    /// Seed of the random numbers.
    pub seed: u64,
    /// The days and the months, with their hours.
    pub days: IndexMap<String, Vec<usize>>,
    /// The months, with their hours.
    pub months: IndexMap<String, Vec<usize>>,
    /// The values of days, then of months, and then of the whole period.
    sums: Matrix,
    /// The values of hours: a row for each in which anything shines.
    hours: Matrix,
    /// For each hour its row.
    row_of_slot: Vec<Option<usize>>,
    /// For each id its place in a row; `None` if its hours were not asked for.
    hour_place: Vec<Option<usize>>,
    /// Whether the sun shines in each hour.
    has_sun: Vec<bool>,
    /// Ids of the chart, the band that it shows, and daylight alone on each day.
    charted: Charted,
}

/// What the chart shows.
#[derive(Debug, Default)]
struct Charted {
    ids: Vec<usize>,
    /// The last band or sum with a daily light integral.
    band: Option<usize>,
    daylight: Vec<Vec<f64>>,
}

/// The values of captors and groups in an hour, a day, a month or the whole period.
#[derive(Clone, Debug)]
pub struct Values<'y> {
    places: &'y Places,
    values: Vec<[f32; 2]>,
    /// For each id its place among the values.
    place: Option<&'y [Option<usize>]>,
}

impl Values<'_> {
    /// Returns the light of a channel of an id, by its index, in a band or sum: irradiance or an
    /// integral of it, and for absorbed light the same per area. `None` if the id does not count
    /// the channel, or its hours were not asked for.
    pub fn light(&self, id: usize, channel: Channel, band: usize) -> Option<Value> {
        let counts = self.places.has(id, channel);
        let at = self.first(id)? + channel as usize * self.places.columns + band;
        counts.then(|| Value::of_pair(self.values[at]))
    }

    /// Returns the ratio with this index of the light of a channel of an id. `None` if the id does not
    /// count the channel, or nothing arrived that it could be divided by.
    pub fn ratio(&self, id: usize, channel: Channel, ratio: usize) -> Option<Value> {
        let first = self.places.columns - RATIO * (self.places.ratios.len() - ratio);
        let of = |part| self.light(id, channel, first + part);
        let (over, under, both) = (of(0)?, of(1)?, of(2)?);
        let covariance = 0.5 * (both.variance - over.variance - under.variance);
        let covariance = [over.variance, covariance, under.variance];
        let (mean, error) = stats::ratio([over.mean, under.mean], Some(covariance))?;
        Some(Value { mean, variance: error.unwrap_or(0.0).powi(2) })
    }

    /// Returns the fraction of the area of an id that has a straight path to the sun, on average
    /// over the time in which the sun shines. `None` if it does not shine.
    pub fn sunlit(&self, id: usize) -> Option<Value> {
        let pair = self.values[self.first(id)? + self.places.light()];
        (!pair[0].is_nan()).then(|| Value::of_pair(pair))
    }

    fn first(&self, id: usize) -> Option<usize> {
        let place = self.place.map_or(Some(id), |places| places[id])?;
        Some(place * self.places.row())
    }
}

impl Year {
    /// Traces a scene that was loaded by the hour, in each combination of its states. Errors: those of a run; a control file or a
    /// pattern that names what the scene does not have.
    pub fn find(
        scenes: &YearScenes,
        options: &YearOptions,
        settings: &Settings,
        control: &Control,
    ) -> Result<Self> {
        let Some(StateScene { loaded, .. }) = scenes.scenes.first() else {
            return Err(Error::input("scene", "there is none").remedy("load one by the hour"));
        };
        let scene = &loaded.scene;
        let hourly = loaded.hourly.as_ref().ok_or_else(|| {
            Error::input(&scene.name, "was not loaded by the hour").remedy("load it so")
        })?;
        let slots = hourly.slots.clone();
        let places = Places::new(scene);
        let mut bands = band_results(scene);
        bands.truncate(places.columns - RATIO * places.ratios.len());
        // a sum with a unit of its own is not in MJ
        let par = |band: &BandResult| match scene.quantity {
            Quantity::Watt => band.unit.is_none(),
            Quantity::Micromole => band.has_dli(&bands, true),
        };
        let integrated: Vec<bool> = bands.iter().map(par).collect();
        let wanted_hours = options.hours.chosen(&places)?;
        let sunny = |s: usize| {
            let hourly = scenes.scenes.iter().filter_map(|scene| scene.loaded.hourly.as_ref());
            hourly.into_iter().any(|hourly| is_sunny(hourly, &hourly.slots[s]))
        };
        let has_sun: Vec<bool> = (0..slots.len()).map(sunny).collect();
        let suns = has_sun.iter().filter(|has_sun| **has_sun).count();
        let rays = match options.sun_rays {
            Some(rays) => SunRays::new(rays),
            None => SunRays::usual(scene.captors.len(), suns),
        };
        let outside = Outside::new(scene, hourly, &bands);
        let controlled = Controlled {
            places: &places,
            bands: &bands,
            integrated: &integrated,
            outside: &outside,
            daylight: &|parts, at| daylight_at(parts, &places, at, rays, control),
        };
        let mut warnings = Vec::new();
        let lamps: Vec<&str> = lamp_names(scene, hourly);
        let entries = controlled.entries(&lamps, options.control, &mut warnings)?;
        let folder = &options.scratch;
        Self::needs(scenes, options, settings)?.check(places.captors, folder)?;
        let photons = settings.photons.unwrap_or(Settings::DEFAULT_PHOTONS);
        let mut parts = Vec::new();
        for (part, (scene, share)) in scenes.scenes.iter().zip(energies(scenes)).enumerate() {
            let settings = Settings {
                photons: Some((share * photons as f64).round() as u64),
                // the parts are independent
                seed: settings.seed ^ (part as u64) << 56,
                ..settings.clone()
            };
            let of = match (part, scenes.scenes.len()) {
                (_, 1) => String::new(),
                (part, all) => format!(" (scene {} of {all})", part + 1),
            };
            (options.phase)(&format!("photons{of}"));
            parts.push(Part::trace(scene, &places, &settings, folder, control)?);
        }
        let pool = machine::pool(settings.threads)?;
        (options.phase)("rays to the sun");
        let switched = pool.install(|| controlled.switch_lamps(&mut parts, entries))?;
        let parts = parts;

        let (days, months) = (periods(&slots, day), periods(&slots, month));
        let first = if places.ids.len() > places.captors { places.captors } else { 0 };
        let mut charted = Charted {
            ids: (first..places.ids.len()).take(CHARTED).collect(),
            // sums come after bands, so the last one is taken
            band: integrated.iter().rposition(|&integrated| integrated),
            daylight: Vec::new(),
        };
        let lit = |slot: usize| parts.iter().any(|part| !part.weights[slot].is_empty());
        let lit = (0..slots.len()).map(|s| lit(s) || has_sun[s]);
        let wanted = Wanted {
            hours: numbered(wanted_hours.into_iter()),
            rows: numbered(lit),
            lengths: slots.iter().map(|slot| slot.length).collect(),
            periods: days
                .values()
                .chain(months.values())
                .map(|hours| of_a_day(&slots, hours))
                .chain([of_a_day(&slots, &(0..slots.len()).collect::<Vec<_>>())])
                .collect(),
            daylight: match (switched.is_empty(), charted.band) {
                (false, Some(band)) => (charted.ids.clone(), band, days.len()),
                _ => (Vec::new(), 0, 0),
            },
            rays,
            folder,
        };
        let found = pool.install(|| Product::new(&parts, &places, &wanted, control).find())?;
        charted.daylight = found.daylight;
        warnings.extend(few_photons(&parts, &switched));
        let unseen = Unseen::of_suns(scene, settings.seed).and_then(|unseen| unseen_sun(&unseen));
        warnings.extend(unseen);
        warnings.extend(interpolated(found.interpolated, places.ids.len()));
        let Wanted { hours: hour_place, rows: row_of_slot, .. } = wanted;
        Ok(Self {
            unit: match scene.quantity {
                Quantity::Watt => "MJ/m2/d",
                Quantity::Micromole => "mol/m2/d",
            },
            states: scenes.states.clone(),
            has_sun,
            photons,
            seed: settings.seed,
            lamps: switched.into_iter().map(|(_, lamp)| lamp).collect(),
            sums: found.periods,
            hours: found.hours,
            row_of_slot,
            hour_place,
            days,
            months,
            charted,
            slots,
            warnings,
            places,
            bands,
            integrated,
        })
    }

    /// Returns about how many bytes a year takes. Error: a pattern that nothing fits.
    pub fn needs(scenes: &YearScenes, options: &YearOptions, settings: &Settings) -> Result<Needs> {
        let places = Places::new(&scenes.scenes[0].loaded.scene);
        let hours = options.hours.chosen(&places)?.iter().filter(|chosen| **chosen).count();
        Ok(Needs::of(scenes, &places, hours, machine::threads(settings.threads)))
    }

    /// Returns the light of an hour on the captors and groups whose hours were asked for. Its
    /// errors include what the light may be off because it is interpolated. Error: a file of the
    /// system cannot be read.
    pub fn hour(&self, slot: usize) -> Result<Values<'_>> {
        let count = self.hour_place.iter().flatten().count();
        let mut values = vec![[0.0; 2]; count * self.places.row()];
        match self.row_of_slot[slot] {
            Some(row) => self.hours.read(row, 0, &mut values)?,
            None => {
                let row = self.places.row();
                values.chunks_mut(row).for_each(|values| values[row - 1] = [f32::NAN; 2]);
            }
        }
        Ok(Values { places: &self.places, values, place: Some(&self.hour_place) })
    }

    /// Returns the daily light integrals of a day, by its index, in [`unit`](Self::unit). Error: a
    /// file of the system cannot be read.
    pub fn day(&self, day: usize) -> Result<Values<'_>> {
        self.sum(day)
    }

    /// Returns the daily light integrals of a month, by its index, as the mean of its days. For less
    /// than a day, they are what its hours brought.
    pub fn month(&self, month: usize) -> Result<Values<'_>> {
        self.sum(self.days.len() + month)
    }

    /// Returns the daily light integrals of the whole period, as the mean of its days.
    pub fn whole(&self) -> Result<Values<'_>> {
        self.sum(self.days.len() + self.months.len())
    }

    fn sum(&self, row: usize) -> Result<Values<'_>> {
        let mut values = vec![[0.0; 2]; self.places.ids.len() * self.places.row()];
        self.sums.read(row, 0, &mut values)?;
        Ok(Values { places: &self.places, values, place: None })
    }

    /// Returns the captors and groups whose hours were asked for, by index.
    pub fn with_hours(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.places.ids.len()).filter(|&id| self.hour_place[id].is_some())
    }

    /// Returns whether the sun shines in an hour.
    pub fn has_sun(&self, slot: usize) -> bool {
        self.has_sun[slot]
    }

    /// Returns how many hours a lamp was on in some slots.
    pub fn hours_on(&self, lamp: &Lamp, slots: impl Iterator<Item = usize>) -> f64 {
        slots.map(|s| lamp.on[s] * self.slots[s].length).sum()
    }

    /// Returns the electric energy that a lamp took in some slots, kWh; `None` if its power is not
    /// known.
    pub fn energy(&self, lamp: &Lamp, slots: impl Iterator<Item = usize>) -> Option<f64> {
        let hours: f64 = slots.map(|s| lamp.power[s] * self.slots[s].length).sum();
        lamp.watts.map(|watts| watts * hours / 1000.0)
    }
}

/// Returns the fractions of the photons for the combinations of states: by their energy, but at least
/// 2 % for each. Lamps are taken to be as bright as daylight, since it is not yet known when they are
/// on.
fn energies(scenes: &YearScenes) -> Vec<f64> {
    const LEAST: f64 = 0.02;
    let of = |scene: &StateScene| {
        let slots = scene.loaded.hourly.iter().flat_map(|hourly| &hourly.slots);
        let (mut energy, mut time) = (0.0, 0.0);
        for (slot, share) in slots.zip(&scene.shares) {
            energy += share * slot.length * slot.global.max(0.0);
            time += share * slot.length;
        }
        [energy, time]
    };
    let each: Vec<[f64; 2]> = scenes.scenes.iter().map(of).collect();
    let total = |i: usize| each.iter().map(|sums| sums[i]).sum::<f64>();
    let lamps = scenes.scenes.iter().all(|scene| {
        let daylight = scene.loaded.hourly.as_ref().map_or(0, |hourly| hourly.lights.len());
        scene.loaded.scene.lights.len() > daylight
    });
    let part = |sums: &[f64; 2], i: usize| if total(i) > 0.0 { sums[i] / total(i) } else { 0.0 };
    let share = |sums| match lamps {
        true => 0.5 * (part(sums, 0) + part(sums, 1)),
        false => part(sums, 0),
    };
    let shares: Vec<f64> = each.iter().map(|sums| share(sums).max(LEAST)).collect();
    let all: f64 = shares.iter().sum();
    shares.iter().map(|share| share / all).collect()
}

/// Numbers what is wanted, from 0.
fn numbered(wanted: impl Iterator<Item = bool>) -> Vec<Option<usize>> {
    let mut next = 0..;
    wanted.map(|wanted| if wanted { next.next() } else { None }).collect()
}

/// Returns whether there is direct sunlight in a slot.
fn is_sunny(hourly: &HourlyLights, slot: &Slot) -> bool {
    !hourly.suns.is_empty() && slot.hour.is_some_and(|h| hourly.hours[h].direct_normal > 0.0)
}

/// Returns the names of the lights that are not daylight.
fn lamp_names<'s>(scene: &'s crate::scene::world::Scene, hourly: &HourlyLights) -> Vec<&'s str> {
    let mut is_daylight = vec![false; scene.lights.len()];
    hourly.lights.iter().for_each(|light| is_daylight[light.light] = true);
    let lamps = scene.lights.iter().zip(is_daylight).filter(|(_, daylight)| !daylight);
    lamps.map(|(light, _)| light.name.as_str()).collect()
}

/// Returns warnings of captors on whose fronts too few photons of daylight, or of the lamps that are
/// lit, arrived to estimate an error.
fn few_photons(parts: &[Part], lamps: &[(usize, Lamp)]) -> Vec<String> {
    let is_lit = |(_, lamp): &&(usize, Lamp)| lamp.on.iter().any(|on| *on > 0.0);
    let lit: Vec<usize> = lamps.iter().filter(is_lit).map(|(lamp, _)| *lamp).collect();
    let daylight = parts.iter().any(Part::has_daylight).then(|| {
        let of = "daylight, but for what comes straight from the sun or by one flat mirror,";
        too_few_photons(parts, of, None)
    });
    let of_lamps = (!lit.is_empty()).then(|| too_few_photons(parts, "the lamps", Some(&lit)));
    [daylight, of_lamps].into_iter().flatten().flatten().collect()
}

/// Returns a warning if at more than a few captors and groups the light of hours is less sure
/// because it is interpolated than because of chance.
fn interpolated(many: usize, all: usize) -> Option<String> {
    (many as f64 > MANY * all as f64).then(|| {
        format!(
            "hours are interpolated: at {many} of {all} captors and groups scattered sunlight changes so \
             fast with the sun's position that this, and not chance, makes up most of the errors of hours; \
             sums over the period are right, and an hour that matters is best run by itself"
        )
    })
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
