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
//! [`product`] for the light of the hours, `interpolated` for what the grid costs and [`tables`]
//! for what is written. [`job`] does all of it from a scene file.

mod burning;
mod conditions;
mod control;
mod head;
mod hours;
mod hours_of;
mod interpolated;
pub mod job;
mod kept;
mod matrix;
mod needs;
mod options;
mod part;
mod places;
mod product;
mod responses;
mod results;
mod shards;
mod states;
mod strengths;
pub mod tables;
mod trace;
mod trackers;
mod value;
mod warnings;

pub use hours::Lamp;
pub use hours_of::HoursOf;
pub use kept::{Kept, KeptLight, USUAL_LIGHT};
pub use needs::{Needs, gigabytes};
pub use options::YearOptions;
pub use places::Places;
pub use shards::YearShards;
pub use states::{StateScene, YearScenes};
pub use trace::trace_shard;
pub use value::{Value, Values};

use conditions::Outside;
use control::{Controlled, lamp_names};
use head::Head;
use hours::{day, month, periods, summed};
use indexmap::IndexMap;
use matrix::Matrix;
use places::Of;
use product::{Product, Wanted, daylight_at};
use trace::{Begun, traced};
use warnings::of_light;

use phylux_core::{
    error::Result,
    math::{
        machine,
        pattern::apart,
        units::{Quantity, UnitNames},
    },
    transport::{settings::Settings, shard::Shard, simulate::Control},
};
use phylux_files::weather::Slot;
use phylux_results::{
    result::BandResult,
    year_facts::{YearFacts, daily_unit},
};

/// The largest number of groups, or of captors if there are no groups, that the chart shows.
const CHARTED: usize = 6;

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
    /// Number of points of each captor from which the sun of an hour was looked for.
    pub sun_rays: u64,
    /// The quantity that photons carry.
    pub quantity: Quantity,
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
    /// What results of months hold besides.
    head: Head,
}

/// What the chart shows.
#[derive(Debug, Default)]
struct Charted {
    ids: Vec<usize>,
    /// The last band or sum with a daily light integral.
    band: Option<usize>,
    daylight: Vec<Vec<f64>>,
}

impl Charted {
    /// Chooses the groups, or captors if there are no groups, that are not parts of others.
    fn of(places: &Places, integrated: &[bool]) -> Self {
        let first = if places.ids.len() > places.captors { places.captors } else { 0 };
        let (name, members) = (|&id: &usize| places.ids[id].as_str(), places.members());
        let of = |&id: &usize| match places.of[id] {
            Of::Group(group) => &members[group][..],
            Of::Captor(_) => &[],
        };
        let shown = match first {
            0 => (0..places.ids.len()).collect(),
            _ => apart((first..places.ids.len()).collect(), name, of, places.captors),
        };
        Self {
            ids: shown.into_iter().take(CHARTED).collect(),
            // sums come after bands, so the last one is taken
            band: integrated.iter().rposition(|&integrated| integrated),
            daylight: Vec::new(),
        }
    }

    /// Returns the ids and the band for which the chart shows daylight alone, on so many days.
    fn daylight_of(&self, days: Option<usize>) -> (Vec<usize>, usize, usize) {
        match (self.band, days) {
            (Some(band), Some(days)) => (self.ids.clone(), band, days),
            _ => (Vec::new(), 0, 0),
        }
    }
}

impl Year {
    /// Finds the light of a scene that was loaded by the hour, in each combination of its states,
    /// as far as it is not kept. Errors: those of a run; a control file or a pattern that names what
    /// the scene does not have.
    pub fn find(
        scenes: &YearScenes,
        options: &YearOptions,
        settings: &Settings,
        control: &Control,
    ) -> Result<Self> {
        let begun = Begun::new(scenes, options)?;
        let Begun { scene, hourly, places, rays } = begun;
        let slots = hourly.slots.clone();
        let (bands, integrated) = places.bands(scene);
        let wanted_hours = options.hours.chosen(&places)?;
        let has_sun: Vec<bool> = (0..slots.len()).map(|s| scenes.is_sunny(s)).collect();
        let outside = Outside::new(scene, hourly, &bands);
        let kept = options.kept;
        let controlled = Controlled {
            places: &places,
            bands: &bands,
            integrated: &integrated,
            outside: &outside,
            daylight: &|parts, at| daylight_at(parts, &places, at, rays, kept, control),
        };
        let mut warnings = Vec::new();
        let lamps: Vec<&str> = lamp_names(scene, hourly);
        let entries = controlled.entries(&lamps, options.control, &mut warnings)?;
        let folder = &options.scratch;
        Self::needs(scenes, options, settings)?.check(places.captors, folder)?;
        let photons = settings.photons_or_default();
        let mut parts = traced(scenes, &places, options, settings, Shard::WHOLE, control)?;
        let pool = machine::pool(settings.threads.get())?;
        (options.phase)("rays to the sun for the lamps");
        let switched =
            pool.install(|| controlled.switch_lamps(&mut parts, entries, &mut warnings))?;
        let parts = parts;
        (options.phase)("rays to the sun");

        let (days, months) = (periods(&slots, day), periods(&slots, month));
        let mut charted = Charted::of(&places, &integrated);
        let lit = |s: usize| has_sun[s] || parts.iter().any(|part| !part.weights[s].is_empty());
        let wanted = Wanted {
            hours: numbered(wanted_hours.into_iter()),
            rows: numbered((0..slots.len()).map(lit)),
            sun_up: slots.iter().map(|slot| slot.sun_up).collect(),
            periods: summed(&slots, &days, &months),
            daylight: charted.daylight_of((!switched.is_empty()).then_some(days.len())),
            rays,
            kept,
            folder,
        };
        let product = Product::new(&parts, &places, &wanted, control);
        let found = pool.install(|| product.find())?;
        let head = Head::of(&parts, &places, product.powers());
        warnings.extend(of_light(&parts, &switched, &wanted, &found, settings.seed));
        charted.daylight = found.daylight;
        let Wanted { hours: hour_place, rows: row_of_slot, .. } = wanted;
        Ok(Self {
            unit: daily_unit(scene.quantity()),
            states: scenes.states.clone(),
            has_sun,
            photons,
            seed: settings.seed,
            sun_rays: rays.count(),
            quantity: scene.quantity(),
            head,
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
        let photons = settings.photons_or_default();
        Ok(Needs::of(scenes, &places, hours, photons, machine::threads(settings.threads.get())))
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

    /// Returns how the light was found, and the units of the tables.
    pub fn facts(&self) -> YearFacts {
        YearFacts {
            phylux: env!("CARGO_PKG_VERSION").into(),
            scene: self.head.scene.clone(),
            seed: self.seed,
            photons: self.photons,
            sun_rays: self.sun_rays,
            from: self.slots.first().map_or(String::new(), hours::time),
            hours: self.slots.len(),
            unit: UnitNames { dli: Some(self.unit.into()), ..self.units() },
            bands: self.bands.clone(),
            warnings: self.warnings.clone(),
        }
    }

    /// Returns the names of the units of results.
    fn units(&self) -> UnitNames {
        let has_dli = self.integrated.contains(&true) && self.unit == "mol/m2/d";
        UnitNames { dli: has_dli.then(|| self.unit.into()), ..self.quantity.unit_names() }
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

/// Returns the names of the months that have some of these hours, in order.
pub fn months_of(slots: &[Slot]) -> Vec<String> {
    periods(slots, month).into_keys().collect()
}

/// Numbers what is wanted, from 0.
fn numbered(wanted: impl Iterator<Item = bool>) -> Vec<Option<usize>> {
    let mut next = 0..;
    wanted.map(|wanted| if wanted { next.next() } else { None }).collect()
}
