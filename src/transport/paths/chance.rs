//! Light that paths find by chance alone.
//!
//! A small lamp in a mirror, a bright spot there, light that is scattered twice close to a lamp: few paths find
//! these, and find much. A run in which none has done so knows nothing of them, and its errors are too small. So photons
//! tell how much of such light comes to each face, and what it counts for a path that finds it.
//!
//! Say that a path can find the light of a lamp of power Φ in band b but by meeting a source that sheds Φ g per m2: the
//! lamp itself, for which g is 1 / area, or a place that it lights, for which Φ g is the irradiance there. On a face of area A
//! such a path counts up to X = Φ g A. The mean of X² over paths is the mean of w X over photons that bring the power w by
//! the same ways, whatever the chance is: this is what such light adds to the variance of a path.

use std::f32::consts::PI;

use glam::Vec3;

use super::{Pilot, spots};
use crate::{
    math::{geometry::Ray, spectrum::Lanes},
    scene::{
        captor::{CHANNELS, Captor},
        material::LobeKind,
        world::Scene,
    },
    transport::{
        tally::Totals,
        trace::{Counted, Event},
    },
};

/// The least g times the squared radius of the scene: from so far its source fills less than about a tenth of a
/// steradian. What is larger, paths find often enough for their errors to know it.
const SMALL: f32 = 10.0;
/// Photons on a face below which all faces together speak for it.
const FEW: u64 = 100;
/// How many times the variance that a run has found such light must add for its errors to be called too small.
/// Photons overrate it up to threefold: they take a path to lose nothing on its way (see `LEAST` of paths).
const TOO_SMALL: f64 = 4.0;
/// A relative error that is no more than rounding.
const ROUNDING: f64 = 1e-4;

/// What photons found on faces of captors.
pub struct ByChance {
    bands: usize,
    photons: u64,
    /// Per channel of the captors.
    faces: Vec<Sums>,
}

/// Sums over the photons of a face, or of all.
#[derive(Clone, Debug, Default)]
struct Sums {
    photons: u64,
    /// Of what a path may find: power per band.
    flux: Vec<f64>,
    /// Of what it finds by chance alone: power times Φ g.
    second: Vec<f64>,
    /// Area that paths start from, m2.
    area: f64,
}

/// Where the light of a photon is to be found.
pub struct Source<'a> {
    scene: &'a Scene,
    light: usize,
    /// As it left its light.
    ray: Ray,
    /// Whether paths are sent light of it.
    sent: bool,
    way: Way,
}

#[derive(Clone, Copy)]
enum Way {
    /// Straight from its light: by joining.
    Straight,
    /// Scattered once, at this point of a surface with this normal.
    Once { at: Vec3, normal: Vec3, exitance: f32, mirrored: bool },
    /// At a source of this exitance per watt, 1/m2.
    Known(f32),
}

impl<'a> Source<'a> {
    /// As a photon leaves its light.
    pub fn new(scene: &'a Scene, pilot: &Pilot, light: usize, ray: Ray) -> Self {
        let sent = pilot.spots.as_ref().is_some_and(|spots| spots.has(light));
        let infinite = scene.lights[light].entrance().is_some();
        let way = if infinite { Way::Known(0.0) } else { Way::Straight };
        Self { scene, light, ray, sent, way }
    }

    /// After an arrival at a point of a surface that sends it on so.
    pub fn arrived(&mut self, point: Vec3, normal: Vec3, lobe: Option<LobeKind>) {
        let own = self.scene.lights[self.light].exitance();
        self.way = match (self.way, lobe) {
            (Way::Straight, Some(lobe)) if lobe.is_specular() => Way::Known(own.unwrap_or(0.0)),
            (Way::Straight, Some(lobe)) if lobe.is_diffuse() => {
                let lit = spots::origin(self.scene, self.light, &self.ray, point);
                let lit = lit.map_or(0.0, |origin| origin.irradiance_on(normal));
                let exitance = lit.min(own.unwrap_or(f32::INFINITY));
                Way::Once { at: point, normal, exitance, mirrored: false }
            }
            (Way::Once { at, normal, exitance, .. }, Some(lobe)) if lobe.is_specular() => {
                Way::Once { at, normal, exitance, mirrored: true }
            }
            (Way::Once { .. }, Some(lobe)) if lobe.is_diffuse() => {
                Way::Known(self.per_watt(point, normal))
            }
            (way, _) => way,
        };
    }

    /// g of the source, for paths that come to a point of a surface, or start there; 0 where they need no chance.
    fn per_watt(&self, point: Vec3, normal: Vec3) -> f32 {
        match self.way {
            Way::Straight => 0.0,
            Way::Known(g) => g,
            Way::Once { exitance, mirrored: true, .. } => exitance,
            // found from afar by what the light's own photons are joined with, which has no bound close by
            Way::Once { at, normal: there, exitance, .. } if self.sent => {
                let away = point - at;
                let d2 = away.length_squared();
                let cosines = away.dot(there) * away.dot(normal) / d2;
                exitance.min(cosines.abs() / (PI * d2))
            }
            Way::Once { .. } => 0.0,
        }
    }
}

impl ByChance {
    /// Whether a scene with something smooth may have such light.
    pub fn may_be(scene: &Scene) -> bool {
        scene.lights.iter().any(|light| light.entrance().is_none())
    }

    pub(super) fn new(scene: &Scene) -> Self {
        let bands = scene.bands.len();
        let mut faces = vec![Sums::new(bands); scene.channels()];
        for captor in &scene.captors {
            for &face in captor.kind.faces() {
                faces[captor.first_channel + face as usize].area = captor.area_of_face();
            }
        }
        Self { bands, photons: 0, faces }
    }

    /// A photon that comes to a face.
    pub(super) fn add<L: Lanes>(
        &mut self,
        source: &Source,
        weights: &[f64],
        counted: &Counted<'_, L>,
        event: &Event<'_, L>,
    ) {
        let scene = source.scene;
        let (point, normal) = match event {
            Event::Crossing { crossing, .. } => {
                (crossing.point, scene.captor_triangles()[crossing.triangle].normal())
            }
            Event::Arrival { hit, surface, .. } => (hit.point, surface.normal),
            _ => return,
        };
        let g = source.per_watt(point, normal);
        let g = if g * scene.radius * scene.radius > SMALL { f64::from(g) } else { 0.0 };
        let sums = &mut self.faces[counted.channel()];
        sums.photons += 1;
        let lamp = &scene.lights[source.light].power;
        for (b, power) in counted.power.values().iter().take(self.bands).enumerate() {
            let flux = f64::from(*power) * weights[b];
            sums.flux[b] += flux;
            sums.second[b] += flux * lamp[b] * g;
        }
    }

    /// All of it, of so many photons; none where no light comes by chance alone.
    pub(super) fn of(self, photons: u64) -> Option<Self> {
        let any = self.faces.iter().any(|sums| sums.second.iter().any(|&second| second > 0.0));
        any.then_some(Self { photons, ..self })
    }

    /// Per channel of captors and groups, whether the errors that so many paths from each face found are too small for what
    /// such light must add to them.
    pub fn too_small(&self, scene: &Scene, totals: &Totals, paths: u64) -> Vec<bool> {
        let (bands, captors) = (self.bands, scene.channels());
        let mut all = Sums::new(bands);
        self.faces.iter().for_each(|sums| all.add(sums));
        let mut variances = vec![0.0; (captors + scene.groups.len() * CHANNELS.len()) * bands];
        let faces = |captor: &Captor| {
            let Captor { first_channel, kind, .. } = *captor;
            kind.faces().iter().map(move |&face| (face as usize, first_channel + face as usize))
        };
        for captor in &scene.captors {
            for (face, channel) in faces(captor) {
                let own = &self.faces[channel];
                let known = own.photons >= FEW;
                let sums = if known { own } else { &all };
                for b in (0..bands).filter(|&b| sums.second[b] > 0.0) {
                    let flux = sums.flux[b] / self.photons as f64;
                    let relative = sums.second[b] * sums.area / self.photons as f64 / flux.powi(2);
                    // with a response the sensor reads something else than comes
                    let flux = match known && captor.sensor.response.is_none() {
                        true => flux,
                        false => totals.running(channel)[b].estimate(totals.batches).mean,
                    };
                    let variance = relative * flux.powi(2) / paths as f64;
                    variances[channel * bands + b] = variance;
                    for &group in &captor.groups {
                        let channel = captors + group * CHANNELS.len() + face;
                        variances[channel * bands + b] += variance;
                    }
                }
            }
        }
        let too_small = |(channel, variances): (usize, &[f64])| {
            variances.iter().zip(totals.running(channel)).any(|(variance, running)| {
                let found = running.estimate(totals.batches);
                let least = (ROUNDING * found.mean).powi(2);
                let error = found.standard_error;
                error.is_some_and(|error| *variance > TOO_SMALL * error * error + least)
            })
        };
        variances.chunks(bands).enumerate().map(too_small).collect()
    }
}

impl Sums {
    fn new(bands: usize) -> Self {
        Self { flux: vec![0.0; bands], second: vec![0.0; bands], ..Self::default() }
    }

    fn add(&mut self, other: &Self) {
        self.photons += other.photons;
        self.area += other.area;
        for (sums, more) in [(&mut self.flux, &other.flux), (&mut self.second, &other.second)] {
            sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
        }
    }
}
