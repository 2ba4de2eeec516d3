//! The light of a scene by the hour: what each of its lights brings, and how strong each is in each
//! hour.

use std::{
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
};

use super::{
    kept::{Kept, Row},
    places::Places,
    responses::LightRows,
    states::StateScene,
};
use phylux_core::{
    error::{Error, Result},
    scene::{
        captor::{CHANNELS, Channel},
        daylight::{InfiniteLight, InfinitePart, InfiniteShape, Suns},
        material::Scatterer,
        world::Scene,
    },
    transport::{
        direct_sun::{SunRays, direct_sun},
        settings::Settings,
        shard::Shard,
        simulate::{Control, photons_by_light, simulate_light_by_light},
        tally::Totals,
    },
};
use phylux_files::{
    scene_file::{HourlyLight, HourlyLights},
    year_work::{Unit, UnitKind},
};
use phylux_results::result::FEW_HISTORIES;

/// A scene whose lights have been traced one by one.
pub(super) struct Part<'a> {
    /// Index of its combination of states.
    index: usize,
    pub scene: &'a Scene,
    /// The lights that are daylight.
    pub hourly: &'a [HourlyLight],
    /// What each light brings at its power in the scene, at each id, channel and band.
    pub responses: LightRows,
    /// For each slot, the lights that shine and their strengths, as multiples of their power in the
    /// scene.
    pub weights: Vec<Vec<(usize, f64)>>,
    /// For each slot, the index of its sun.
    pub suns: Vec<Option<usize>>,
    /// These suns.
    pub lights: Vec<InfiniteLight>,
    /// For each slot, the fraction of it in which the scene is as it is here.
    pub shares: &'a [f64],
    /// For each id the area that counts for each channel, m2.
    pub areas: Vec<[f64; CHANNELS.len()]>,
    /// Seed of its random numbers.
    pub seed: u64,
    /// For each light the power of one of its photons, in the band where it is largest: W or umol/s.
    pub photon: Vec<f64>,
    /// For each light, whether it is daylight.
    pub is_daylight: Vec<bool>,
    /// The lights that are not.
    pub lamps: Vec<usize>,
    /// The least number of batches of a light; `None` without lights.
    pub batches: Option<u64>,
    /// For each captor, the numbers of photons that arrived on its front and on its back.
    pub arrived: Vec<[u64; 2]>,
    /// For each captor, the numbers of photons of daylight that arrived on its front and on its back.
    of_daylight: Vec<[u64; 2]>,
    /// For each other light and captor, these numbers, at most 255.
    of_lamps: Vec<Vec<[u8; 2]>>,
}

impl<'a> Part<'a> {
    /// Prepares the scene of a combination of states, by its index, without tracing anything.
    /// `folder` takes what does not fit into memory. Error: it was not loaded by the hour.
    pub fn new(
        index: usize,
        StateScene { loaded, shares, .. }: &'a StateScene,
        places: &Places,
        seed: u64,
        folder: &Path,
    ) -> Result<Self> {
        let scene = &loaded.scene;
        let hourly = loaded.hourly.as_ref().ok_or_else(|| {
            Error::input(scene.name(), "was not loaded by the hour").remedy("load it so")
        })?;
        let mut weights = vec![Vec::new(); hourly.slots.len()];
        let mut slot_of_hour = vec![0; hourly.hours.len()];
        for (s, slot) in hourly.slots.iter().enumerate() {
            slot.hour.iter().for_each(|&h| slot_of_hour[h] = s);
        }
        let mut is_daylight = vec![false; scene.lights().len()];
        for light in &hourly.lights {
            is_daylight[light.light] = true;
            for &(h, factor) in &light.factors {
                let slot = slot_of_hour[h];
                weights[slot].push((light.light, factor * shares[slot]));
            }
        }
        let (suns, lights) = moving_suns(hourly);
        Ok(Self {
            index,
            scene,
            hourly: &hourly.lights,
            responses: LightRows::new(scene.lights().len(), places.widths(), folder),
            weights,
            suns,
            lights,
            shares,
            areas: Places::new(scene).areas,
            seed,
            lamps: (0..scene.lights().len()).filter(|&light| !is_daylight[light]).collect(),
            photon: vec![0.0; scene.lights().len()],
            is_daylight,
            batches: None,
            arrived: vec![[0; 2]; scene.captors().len()],
            of_daylight: vec![[0; 2]; scene.captors().len()],
            of_lamps: vec![Vec::new(); scene.lights().len()],
        })
    }

    /// Traces those of the lights that `shard` holds and that are not kept. What a light brings is
    /// taken in and kept. Errors: those of a run; a file cannot be read or written.
    pub fn trace(
        &mut self,
        places: &Places,
        settings: &Settings,
        shard: Shard,
        kept: Kept,
        control: &Control,
    ) -> Result<()> {
        let index = self.index;
        let unit =
            |light: usize| Unit { part: index as u32, kind: UnitKind::Light, index: light as u64 };
        let (counts, values) =
            (1 + 2 * self.scene.captors().len(), places.ids.len() * places.light());
        let mut missing = Vec::new();
        for light in 0..self.scene.lights().len() {
            match kept.get(unit(light), counts, values)? {
                Some(row) => self.take(light, &row)?,
                None if shard.holds(light) => missing.push(light),
                None => {}
            }
        }
        let scene = self.scene;
        let photons = settings.photons_or_default();
        let shares = photons_by_light(scene, photons);
        for ((photon, light), photons) in self.photon.iter_mut().zip(scene.lights()).zip(shares) {
            *photon = light.power.iter().copied().fold(0.0, f64::max) / photons.max(1) as f64;
        }
        let mut row = Row { counts: vec![0; counts], values: vec![[0.0; 2]; values] };
        simulate_light_by_light(scene, settings, control, &missing, &mut |light, totals| {
            self.fill(totals, places, &mut row);
            kept.put(unit(light), &row.counts, &row.values)?;
            self.take(light, &row)
        })
    }

    /// Fills in what a light brings: the number of batches and, for each captor, the numbers of
    /// photons on its front and back; the values of all ids.
    fn fill(&self, totals: &Totals, places: &Places, row: &mut Row) {
        let few = |count: u64| u32::try_from(count).unwrap_or(u32::MAX);
        row.counts[0] = few(totals.batches);
        for (captor, out) in self.scene.captors().iter().zip(row.counts[1..].chunks_exact_mut(2)) {
            let back = captor.kind.has_back().then_some(captor.first_channel + 1);
            out[0] = few(totals.photons(captor.first_channel));
            out[1] = back.map_or(0, |channel| few(totals.photons(channel)));
        }
        for (id, row) in row.values.chunks_exact_mut(places.light()).enumerate() {
            for (channel, row) in CHANNELS.iter().zip(row.chunks_exact_mut(places.columns)) {
                if !places.has(id, *channel) {
                    continue;
                }
                let area = self.areas[id][*channel as usize];
                let running = totals.running(places.channel(self.scene, id, *channel));
                for (out, running) in row.iter_mut().zip(running) {
                    let found = running.estimate(totals.batches);
                    // of one photon no error is known, so it is taken to be as large as the value
                    let error = found.standard_error.unwrap_or(found.mean);
                    *out = [found.mean, error].map(|value| (value / area) as f32);
                }
            }
        }
    }

    /// Takes in what a light brings.
    fn take(&mut self, light: usize, row: &Row) -> Result<()> {
        let batches = u64::from(row.counts[0]);
        self.batches = self.batches.min(Some(batches)).or(Some(batches));
        let counts: &[[u32; 2]] = row.counts[1..].as_chunks().0;
        let add = |sums: &mut [[u64; 2]]| {
            for (sums, own) in sums.iter_mut().zip(counts) {
                *sums = added(*sums, own.map(u64::from));
            }
        };
        add(&mut self.arrived);
        match self.is_daylight[light] {
            true => add(&mut self.of_daylight),
            false => {
                let few = |own: &[u32; 2]| own.map(|count| count.min(255) as u8);
                self.of_lamps[light] = counts.iter().map(few).collect();
            }
        }
        self.responses.put(light, &row.values)
    }

    /// Returns the light that comes straight from the sun to a captor in the hours of each sun, as
    /// it was kept or by looking for it. Error: a file cannot be read or written.
    pub fn direct(
        &self,
        captor: usize,
        places: &Places,
        rays: SunRays,
        kept: Kept,
        stop: &AtomicBool,
    ) -> Result<Vec<[f32; 2]>> {
        let unit = self.direct_unit(captor);
        let values = self.lights.len() * places.row();
        if let Some(row) = kept.get(unit, 0, values)? {
            return Ok(row.values);
        }
        let (lights, channels) = (&self.lights, places.channels);
        let rows = direct_sun(self.scene, captor, channels, lights, self.seed, rays, stop);
        // after a stop the rows are not complete
        if !stop.load(Ordering::Relaxed) {
            kept.put(unit, &[], &rows)?;
        }
        Ok(rows)
    }

    /// Returns the unit of work that finds the light straight from the sun on a captor.
    pub fn direct_unit(&self, captor: usize) -> Unit {
        Unit { part: self.index as u32, kind: UnitKind::Captor, index: captor as u64 }
    }

    /// Returns whether photons find any daylight: that of a sky or the ground, or sunlight that
    /// surfaces scatter or refract. Rays find the rest, but for what several mirrors send.
    pub fn has_light_by_photons(&self) -> bool {
        let scene = self.scene;
        let mut materials = scene.materials().iter().map(|named| &named.material);
        let scatters = materials.any(|material| material.is_diffuse() || material.is_solid());
        let is_sun = |light: usize| {
            scene.lights()[light].entrance().is_some_and(|entrance| entrance.light.has_sun())
        };
        let found = |light: &HourlyLight| scatters || !is_sun(light.light);
        self.hourly.iter().any(|light| !light.factors.is_empty() && found(light))
    }

    /// Returns what a light brings to the front of an id in a band.
    pub fn front(&self, places: &Places, light: usize, id: usize, band: usize) -> Result<f64> {
        let (block, id) = places.block_of(id);
        let place = id * places.light() + Channel::Front as usize * places.columns + band;
        Ok(f64::from(self.responses.get(light, block)?[place][0]))
    }
}

/// Returns a warning of captors on a face of which too few photons arrived in all parts, of daylight
/// or of these `lamps`, to estimate an error; `None` if there are no such captors. A back that none
/// came to may be closed.
pub(super) fn too_few_photons(parts: &[Part], of: &str, lamps: Option<&[usize]>) -> Option<String> {
    let in_part = |part: &Part, captor: usize| match lamps {
        None => part.of_daylight[captor],
        Some(lamps) => {
            let of_lamp = |&lamp: &usize| part.of_lamps[part.lamps[lamp]][captor].map(u64::from);
            lamps.iter().map(of_lamp).fold([0; 2], added)
        }
    };
    let captors = parts[0].scene.captors();
    let is_few = |&captor: &usize| {
        let [front, back] = parts.iter().map(|part| in_part(part, captor)).fold([0; 2], added);
        front < FEW_HISTORIES || (0 < back && back < FEW_HISTORIES)
    };
    let mut few = (0..captors.len()).filter(is_few);
    let first = few.next()?;
    Some(format!(
        "fewer than {FEW_HISTORIES} photons of {of} arrived at a face of {} of {} captors (`{}` is the first): \
         a 0 may be chance; trace more photons (docs/year.md#warnings-of-a-year)",
        1 + few.count(),
        captors.len(),
        captors[first].id
    ))
}

/// Adds up the numbers of both faces.
fn added(a: [u64; 2], b: [u64; 2]) -> [u64; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

/// Returns for each slot the index of its sun, and these suns as lights.
fn moving_suns(hourly: &HourlyLights) -> (Vec<Option<usize>>, Vec<InfiniteLight>) {
    let mut lights = Vec::new();
    let suns = hourly.slots.iter().map(|slot| {
        let hour = &hourly.hours[slot.hour?];
        let parts = hourly.suns.iter().filter_map(|sun| {
            let discs = Suns::new(sun.half_angle, hour.suns(hourly.north))?;
            let strength = sun.shares.iter().map(|share| share * hour.direct_normal).collect();
            Some(InfinitePart::new(InfiniteShape::Suns(discs.into()), strength))
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
