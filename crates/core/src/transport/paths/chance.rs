//! Light that paths find by chance alone.
//!
//! Examples are the image of a small lamp or of a bright spot in a mirror, and light that is
//! scattered twice close to a lamp. Few paths find such light, and each of these finds much. If no
//! path of a run has found any, the spread of the paths does not show it, and the standard errors
//! are too small. Photons therefore measure how much of such light comes to each face, and how much
//! a path counts that finds it.
//!
//! Suppose that a path can find the light of a lamp of power Φ in band b only by meeting a source
//! that sheds Φ g per m2. The source is the lamp itself, for which g is 1 / area, or a place that
//! the lamp lights, for which Φ g is the irradiance there. On a face of area A such a path counts
//! up to X = Φ g A. The mean of X² over paths is the mean of w X over photons that bring the power
//! w by the same ways, whatever the chance of these ways is. This mean is what such light adds to
//! the variance of a path.

use std::f32::consts::PI;

use glam::Vec3;

use super::{Pilot, is_small, spots};
use crate::{
    math::{
        geometry::Ray,
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        captor::Captor,
        material::LobeKind,
        world::{Scene, Standing, SurfaceHit},
    },
    transport::tally::Totals,
};

/// A face with fewer photons than this is given the mean of all faces, and faces that have fewer
/// together the mean of all surfaces.
const FEW: u64 = 100;
/// The standard errors are called too small if such light adds more than this many times the
/// variance that the run has found. Photons overestimate it up to threefold, because they assume
/// that a path loses nothing on its way (see `LEAST` of paths).
const TOO_SMALL: f64 = 4.0;
/// Light that is left to photons hides nothing where it is less than this many standard errors: if
/// none of it has come, the value is too small by no more than that.
const MISSING: f64 = 0.5;
/// A relative error of this size may be rounding.
const ROUNDING: f64 = 1e-4;

/// What photons tell of the faces of captors: how much light comes to them that a run finds by
/// chance.
pub struct ByChance {
    bands: usize,
    photons: u64,
    /// For each channel of the captors.
    faces: Vec<Sums>,
    /// All surfaces, while photons are added; then all faces, unless few photons came to them.
    all: Sums,
}

/// A place where a photon arrives.
pub(super) enum Place {
    /// A face of a captor, by its channel.
    Face(usize),
    /// Any surface.
    Surface,
}

/// Sums over the photons that came to a face, or to all faces.
#[derive(Clone, Debug, Default)]
struct Sums {
    photons: u64,
    /// Flux of the light that is found: by paths or, beside complete paths, by photons. The sum of
    /// power, per band.
    flux: Vec<f64>,
    /// Second moment of the light that paths find by chance alone: the sum of power times Φ g, per
    /// band.
    second: Vec<f64>,
    /// Second moment of the light that is left to photons: the sum of squared power, per band.
    left: Vec<f64>,
    /// Flux of the light that is left to photons: the sum of power, per band.
    left_flux: Vec<f64>,
    /// Area of the face from which paths start, m2.
    area: f64,
}

/// The source that a path has to meet in order to find the light of a photon. It changes as the
/// photon is followed.
pub struct Source<'a> {
    scene: &'a Scene,
    light: usize,
    /// The ray of the photon as it left its light.
    ray: Ray,
    /// Length of its way so far, m.
    length: f32,
    /// Whether the light also sends photons to paths.
    sent: bool,
    way: Way,
}

#[derive(Clone, Copy)]
enum Way {
    /// The photon has come straight from its light, which next-event estimation finds.
    Straight,
    /// The photon was scattered once, at this point of a surface with this normal. `exitance` is
    /// that of the lit place per watt, 1/m2, and `mirrored` tells whether a mirror or a refraction
    /// came after it.
    Once { at: Vec3, normal: Vec3, exitance: f32, mirrored: bool },
    /// A source of this exitance per watt, 1/m2, is to be met.
    Known(f32),
}

impl<'a> Source<'a> {
    /// Starts with a photon that leaves its light along `ray`.
    pub fn new(scene: &'a Scene, pilot: &Pilot, light: usize, ray: Ray) -> Self {
        let sent = pilot.spots.as_ref().is_some_and(|spots| spots.has(light));
        let infinite = scene.lights()[light].entrance().is_some();
        let way = if infinite { Way::Known(0.0) } else { Way::Straight };
        Self { scene, light, ray, length: 0.0, sent, way }
    }

    /// Takes in that the photon has arrived at a point of a surface, which sends it on by `lobe`.
    /// `None`: the photon ends there.
    pub fn arrived(&mut self, hit: &SurfaceHit, normal: Vec3, lobe: Option<LobeKind>) {
        self.length += hit.t;
        let point = match (self.way, self.scene.lattice()) {
            // as far from the lamp as the light has come
            (Way::Straight, Some(_)) => self.ray.at(self.length),
            _ => hit.point,
        };
        let own = self.scene.lights()[self.light].exitance();
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

    /// Returns g of the source, in 1/m2, for paths that come to a point of a surface or start
    /// there; 0 if they find the light without chance. Lit places that are not small are met by
    /// enough paths; a lamp in a mirror or behind glass may be seen by few, however large it is.
    fn per_watt(&self, point: Vec3, normal: Vec3) -> f32 {
        let of_place = |g: f32| if is_small(self.scene, g) { g } else { 0.0 };
        match self.way {
            Way::Straight => 0.0,
            Way::Known(g) => g,
            Way::Once { exitance, mirrored: true, .. } => of_place(exitance),
            // a sent photon that is joined with the path finds it from afar; close by, the joining
            // kernel has no bound
            Way::Once { at, normal: there, exitance, .. } if self.sent => {
                let away = point - at;
                let d2 = away.length_squared();
                let cosines = away.dot(there) * away.dot(normal) / d2;
                of_place(exitance.min(cosines.abs() / (PI * d2)))
            }
            Way::Once { .. } => 0.0,
        }
    }
}

impl ByChance {
    /// Returns whether a scene with a smooth surface may have such light.
    pub fn may_be(scene: &Scene) -> bool {
        scene.lights().iter().any(|light| light.entrance().is_none())
    }

    pub(super) fn new(scene: &Scene) -> Self {
        let bands = scene.bands().len();
        let mut faces = vec![Sums::new(bands); scene.channels()];
        for captor in scene.captors() {
            for &face in captor.kind.faces() {
                faces[captor.first_channel + face as usize].area = captor.area_of_face();
            }
        }
        Self { bands, photons: 0, faces, all: Sums::new(bands) }
    }

    fn sums(&mut self, place: Place) -> &mut Sums {
        let sums = match place {
            Place::Face(channel) => &mut self.faces[channel],
            Place::Surface => &mut self.all,
        };
        sums.photons += 1;
        sums
    }

    /// Adds a photon that comes to a place, at a point where the surface has this normal.
    pub(super) fn add<L: Lanes>(
        &mut self,
        source: &Source,
        weights: &[f64],
        power: &Spectrum<L>,
        place: Place,
        (point, normal): (Vec3, Vec3),
    ) {
        let g = f64::from(source.per_watt(point, normal));
        let lamp = &source.scene.lights()[source.light].power;
        let bands = self.bands;
        let sums = self.sums(place);
        for (b, power) in power.values().iter().take(bands).enumerate() {
            let flux = f64::from(*power) * weights[b];
            sums.flux[b] += flux;
            sums.second[b] += flux * lamp[b] * g;
        }
    }

    /// Adds a photon that comes to a place. `left` tells whether paths, or aimed flights, leave its
    /// light to photons.
    pub(super) fn leave<L: Lanes>(
        &mut self,
        weights: &[f64],
        power: &Spectrum<L>,
        place: Place,
        left: bool,
    ) {
        let bands = self.bands;
        let sums = self.sums(place);
        for (b, power) in power.values().iter().take(bands).enumerate() {
            let flux = f64::from(*power) * weights[b];
            sums.flux[b] += flux;
            if left {
                sums.left[b] += flux * flux;
                sums.left_flux[b] += flux;
            }
        }
    }

    /// Ends the sums after this number of photons. `None` if there is no light that paths find by
    /// chance alone.
    pub(super) fn of(self, scene: &Scene, photons: u64) -> Option<Self> {
        let mut all = Sums::new(self.bands);
        self.faces.iter().for_each(|sums| all.add(sums));
        if all.photons < FEW {
            let triangle = |t: usize| f64::from(scene.triangles().at(t).area());
            let of =
                |standing: Standing| standing.area * standing.triangles.map(triangle).sum::<f64>();
            all = Sums { area: scene.standing().into_iter().map(of).sum(), ..self.all };
        }
        let any = all.second.iter().chain(&all.left).any(|&second| second > 0.0);
        any.then_some(Self { photons, all, ..self })
    }

    /// Returns, for each channel of captors and groups, whether the standard errors of a run with
    /// this number of paths from each face, and of photons beside them, are too small for what such
    /// light, and light that is left to photons, must add to them. No paths start from the faces
    /// where all photons count, `by_photons`.
    pub fn too_small(
        &self,
        scene: &Scene,
        totals: &Totals,
        paths: u64,
        beside: Option<u64>,
        by_photons: &[bool],
    ) -> Vec<bool> {
        let (bands, captors) = (self.bands, scene.channels());
        let mut hidden = vec![
            Hidden::default();
            (captors + scene.groups().len() * scene.group_channels()) * bands
        ];
        let faces = |captor: &Captor| {
            let Captor { first_channel, kind, .. } = *captor;
            kind.faces().iter().map(move |&face| (face as usize, first_channel + face as usize))
        };
        for captor in scene.captors() {
            for (face, channel) in faces(captor) {
                if by_photons.get(channel).is_some_and(|&alone| alone) {
                    continue;
                }
                let own = &self.faces[channel];
                let known = own.photons >= FEW;
                let sums = if known { own } else { &self.all };
                let adds = |&b: &usize| sums.second[b] + sums.left[b] > 0.0;
                for b in (0..bands).filter(adds) {
                    let flux = sums.flux[b] / self.photons as f64;
                    let relative = sums.second[b] * sums.area / self.photons as f64 / flux.powi(2);
                    // the photons measure what arrives, but a sensor with a response reads
                    // something else
                    let flux = match known && captor.sensor.response.is_none() {
                        true => flux,
                        false => totals.running(channel)[b].estimate(totals.batches).mean,
                    };
                    // for each unit of light: the variance of a photon, and the flux
                    let [left, left_flux] =
                        [&sums.left, &sums.left_flux].map(|left| left[b] / sums.flux[b]);
                    let own = Hidden {
                        by_chance: relative * flux.powi(2) / paths as f64,
                        left: beside.map_or(0.0, |photons| left * flux / photons as f64),
                        left_flux: left_flux * flux,
                    };
                    hidden[channel * bands + b] = own;
                    for &group in &captor.groups {
                        let channel = scene.first_channel_of_group(group) + face;
                        hidden[channel * bands + b].add(own);
                    }
                }
            }
        }
        let too_small = |(channel, hidden): (usize, &[Hidden])| {
            hidden.iter().zip(totals.running(channel)).any(|(hidden, running)| {
                let found = running.estimate(totals.batches);
                let least = (ROUNDING * found.mean).powi(2);
                found.standard_error.is_some_and(|error| hidden.exceeds(error, least))
            })
        };
        hidden.chunks(bands).enumerate().map(too_small).collect()
    }
}

/// What a run may not have shown of a face in a band.
#[derive(Clone, Copy, Debug, Default)]
struct Hidden {
    /// Variance of the light that paths find by chance alone.
    by_chance: f64,
    /// Variance, and flux, of the light that is left to photons.
    left: f64,
    left_flux: f64,
}

impl Hidden {
    fn add(&mut self, other: Self) {
        self.by_chance += other.by_chance;
        self.left += other.left;
        self.left_flux += other.left_flux;
    }

    /// Returns whether this must add much to a standard error. The variance `least` may be rounding.
    fn exceeds(&self, error: f64, least: f64) -> bool {
        let most = TOO_SMALL * error * error + least;
        let missing = self.left_flux > MISSING * error;
        self.by_chance > most || (missing && self.by_chance + self.left > most)
    }
}

impl Sums {
    fn new(bands: usize) -> Self {
        let [flux, second, left, left_flux] = [0.0; 4].map(|zero| vec![zero; bands]);
        Self { flux, second, left, left_flux, ..Self::default() }
    }

    fn add(&mut self, other: &Self) {
        self.photons += other.photons;
        self.area += other.area;
        for (sums, more) in [
            (&mut self.flux, &other.flux),
            (&mut self.second, &other.second),
            (&mut self.left, &other.left),
            (&mut self.left_flux, &other.left_flux),
        ] {
            sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
        }
    }
}
