//! The light of a scene by the hour: what each of its lights brings, and how strong each is in each
//! hour.

use std::path::Path;

use super::{matrix::Matrix, places::Places, states::StateScene};
use crate::{
    error::{Error, Result},
    formats::scene_file::{HourlyLight, HourlyLights},
    results::result::FEW_HISTORIES,
    scene::{
        captor::{CHANNELS, Channel},
        daylight::{InfiniteLight, InfinitePart, InfiniteShape, Suns},
        world::Scene,
    },
    transport::{
        settings::Settings,
        simulate::{Control, simulate_light_by_light},
        tally::Totals,
    },
};

/// A scene whose lights have been traced one by one.
pub(super) struct Part<'a> {
    pub scene: &'a Scene,
    /// The lights that are daylight.
    pub hourly: &'a [HourlyLight],
    /// For each light a row: what it brings at its power in the scene, at each id, channel and band.
    pub responses: Matrix,
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
    /// For each light, whether it is daylight.
    pub is_daylight: Vec<bool>,
    /// The lights that are not.
    pub lamps: Vec<usize>,
    /// For each captor, the number of photons of daylight that arrived on its front.
    arrived: Vec<u64>,
    /// For each other light and captor, that number, at most 255.
    of_lamps: Vec<Vec<u8>>,
}

impl<'a> Part<'a> {
    /// Traces the lights of a scene that was loaded by the hour. `folder` takes what does not fit
    /// into memory. Errors: those of a run.
    pub fn trace(
        StateScene { loaded, shares, .. }: &'a StateScene,
        places: &Places,
        settings: &Settings,
        folder: &Path,
        control: &Control,
    ) -> Result<Self> {
        let scene = &loaded.scene;
        let hourly = loaded.hourly.as_ref().ok_or_else(|| {
            Error::input(&scene.name, "was not loaded by the hour").remedy("load it so")
        })?;
        let mut weights = vec![Vec::new(); hourly.slots.len()];
        let mut slot_of_hour = vec![0; hourly.hours.len()];
        for (s, slot) in hourly.slots.iter().enumerate() {
            slot.hour.iter().for_each(|&h| slot_of_hour[h] = s);
        }
        let mut is_daylight = vec![false; scene.lights.len()];
        for light in &hourly.lights {
            is_daylight[light.light] = true;
            for &(h, factor) in &light.factors {
                let slot = slot_of_hour[h];
                weights[slot].push((light.light, factor * shares[slot]));
            }
        }
        let responses = Matrix::new(scene.lights.len(), places.ids.len() * places.light(), folder)?;
        let (suns, lights) = moving_suns(hourly);
        let mut part = Self {
            scene,
            hourly: &hourly.lights,
            responses,
            weights,
            suns,
            lights,
            shares,
            areas: Places::new(scene).areas,
            seed: settings.seed,
            lamps: (0..scene.lights.len()).filter(|&light| !is_daylight[light]).collect(),
            is_daylight,
            arrived: vec![0; scene.captors.len()],
            of_lamps: vec![Vec::new(); scene.lights.len()],
        };
        let mut row = vec![[0.0; 2]; places.ids.len() * places.light()];
        simulate_light_by_light(scene, settings, control, &mut |light, totals| {
            part.take(light, totals, places, &mut row)
        })?;
        Ok(part)
    }

    /// Takes in what a light brings.
    fn take(
        &mut self,
        light: usize,
        totals: &Totals,
        places: &Places,
        row: &mut [[f32; 2]],
    ) -> Result<()> {
        let photons = |captor: usize| totals.photons(self.scene.captors[captor].first_channel);
        let captors = 0..self.scene.captors.len();
        if self.is_daylight[light] {
            self.arrived.iter_mut().enumerate().for_each(|(c, sum)| *sum += photons(c));
        } else {
            self.of_lamps[light] = captors.map(|c| photons(c).min(255) as u8).collect();
        }
        for (id, row) in row.chunks_exact_mut(places.light()).enumerate() {
            for (channel, row) in CHANNELS.iter().zip(row.chunks_exact_mut(places.columns)) {
                if !places.has(id, *channel) {
                    continue;
                }
                let area = self.areas[id][*channel as usize];
                let running = totals.running(places.channel(self.scene, id, *channel));
                for (out, running) in row.iter_mut().zip(running) {
                    let found = running.estimate(totals.batches);
                    let error = found.standard_error.unwrap_or(0.0);
                    *out = [found.mean, error].map(|value| (value / area) as f32);
                }
            }
        }
        self.responses.write(light, 0, row)
    }

    /// Returns whether daylight ever shines.
    pub fn has_daylight(&self) -> bool {
        self.hourly.iter().any(|light| !light.factors.is_empty())
    }

    /// Returns what a light brings to the front of an id in a band.
    pub fn front(&self, places: &Places, light: usize, id: usize, band: usize) -> Result<f64> {
        let mut value = [[0.0; 2]];
        let place = id * places.light() + Channel::Front as usize * places.columns + band;
        self.responses.read(light, place, &mut value)?;
        Ok(f64::from(value[0][0]))
    }
}

/// Returns a warning of captors on whose fronts too few photons arrived in all parts, of daylight or
/// of these `lamps`, to estimate an error; `None` if there are no such captors.
pub(super) fn too_few_photons(parts: &[Part], of: &str, lamps: Option<&[usize]>) -> Option<String> {
    let in_part = |part: &Part, captor: usize| match lamps {
        None => part.arrived[captor],
        Some(lamps) => lamps.iter().map(|&l| u64::from(part.of_lamps[part.lamps[l]][captor])).sum(),
    };
    let captors = &parts[0].scene.captors;
    let arrived = |captor: usize| parts.iter().map(|part| in_part(part, captor)).sum::<u64>();
    let mut few = (0..captors.len()).filter(|&captor| arrived(captor) < FEW_HISTORIES);
    let first = few.next()?;
    Some(format!(
        "fewer than {FEW_HISTORIES} photons of {of} arrived at {} of {} captors (`{}` is the first): neither these \
         values nor their errors can be relied on, and a 0 may be chance; trace more photons",
        1 + few.count(),
        captors.len(),
        captors[first].id
    ))
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
