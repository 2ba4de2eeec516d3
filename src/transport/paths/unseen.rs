//! What paths cannot find, or by chance alone: a short run of photons tells it.

use super::{
    Pilot,
    chance::{ByChance, Source},
};
use crate::{
    math::{
        rng::{Purpose, Streams},
        spectrum::{Lanes, Spectrum, with_lanes},
    },
    scene::{
        light::{Light, Strata},
        material::LobeKind,
        world::{FlatMirrors, Scene},
    },
    transport::trace::{Event, trace},
};

/// Photons of the run that tells it.
const PHOTONS: u64 = 50_000;
/// It ends sooner where paths are so long that they take more rays.
const MOST_RAYS: u64 = 2_000_000;

/// Flux of a short photon run per band, in W or umol/s: on the captors or, where it reached none, on
/// all surfaces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Unseen {
    /// Flux of all lights.
    pub all: Vec<f64>,
    /// Flux that no path can find: of a point or line light, by way of a mirror or refraction
    /// before its first diffuse scattering; of the sun, by others than one flat pane or mirror.
    pub hidden: Vec<f64>,
}

/// What photons tell of a run of paths.
pub struct Told {
    /// The light that paths cannot find; none where there is no such light.
    pub unseen: Option<Unseen>,
    /// The light that they find by chance alone; none where there is no such light.
    pub by_chance: Option<ByChance>,
}

/// What has happened to a photon on its way, as far as it decides whether a path could find it there.
pub struct Finding<'a> {
    delta: bool,
    /// The flat mirrors in which paths look for its light.
    images: Option<&'a FlatMirrors>,
    diffused: bool,
    mirrored: bool,
    /// Whether no path could.
    pub hidden: bool,
}

impl<'a> Finding<'a> {
    /// As it leaves a light; `delta`: one that no path meets by chance.
    pub fn new(scene: &'a Scene, light: usize, delta: bool) -> Self {
        let images = scene.flat_mirrors().filter(|mirrors| mirrors.suns().contains(&light));
        Self { delta, images, diffused: false, mirrored: false, hidden: false }
    }

    /// After an arrival at a triangle that sends it on so.
    pub fn arrived(&mut self, triangle: usize, lobe: Option<LobeKind>) {
        if self.delta && !self.diffused && lobe.is_some_and(LobeKind::is_specular) {
            // paths look for the sun by way of one flat mirror
            let shown = |images: &FlatMirrors| images.image_of(triangle).is_some();
            self.hidden |= self.mirrored || !self.images.is_some_and(shown);
            self.mirrored = true;
        }
        self.diffused |= lobe.is_some_and(LobeKind::is_diffuse);
    }
}

impl Told {
    /// Runs photons, where there is anything to tell.
    pub fn find(scene: &Scene, pilot: &Pilot, seed: u64) -> Self {
        let hides = hides(scene);
        if !hides && pilot.spots.is_none() && !(is_smooth(scene) && ByChance::may_be(scene)) {
            return Self { unseen: None, by_chance: None };
        }
        let (unseen, by_chance) =
            with_lanes!(scene.lanes(), L => count::<L>(scene, Some(pilot), seed));
        Self { unseen: hides.then_some(unseen), by_chance }
    }
}

impl Unseen {
    /// Runs photons; none where the scene has no point or line light, or nothing smooth.
    pub fn find(scene: &Scene, seed: u64) -> Option<Self> {
        hides(scene).then(|| with_lanes!(scene.lanes(), L => count::<L>(scene, None, seed)).0)
    }

    /// The largest hidden share over bands, in [0, 1].
    pub fn share(&self) -> f64 {
        let lit = self.hidden.iter().zip(&self.all).filter(|(_, all)| **all > 0.0);
        lit.map(|(hidden, all)| hidden / all).fold(0.0, f64::max)
    }

    fn add<L: Lanes>(&mut self, weights: &[f64], power: &Spectrum<L>, hidden: bool) {
        let sums = self.all.iter_mut().zip(&mut self.hidden);
        for (((all, unseen), weight), power) in sums.zip(weights).zip(power.values()) {
            let flux = f64::from(*power) * weight;
            *all += flux;
            *unseen += if hidden { flux } else { 0.0 };
        }
    }
}

/// Whether there may be light that paths cannot find.
fn hides(scene: &Scene) -> bool {
    is_smooth(scene) && scene.lights.iter().any(Light::is_delta)
}

fn is_smooth(scene: &Scene) -> bool {
    scene.materials.iter().any(|named| named.material.has_mirror())
}

/// The photons. What comes by chance alone they tell for the paths of a `pilot`.
fn count<L: Lanes>(scene: &Scene, pilot: Option<&Pilot>, seed: u64) -> (Unseen, Option<ByChance>) {
    let nothing = || {
        let zeros = vec![0.0; scene.bands.len()];
        Unseen { all: zeros.clone(), hidden: zeros }
    };
    let (mut on_captors, mut on_surfaces) = (nothing(), nothing());
    let mut by_chance = pilot.map(|_| ByChance::new(scene));
    let photons = PHOTONS.max(2 * scene.sources() as u64);
    let strata = Strata::new(&scene.lights, photons, scene.lanes());
    let (mut done, mut rays) = (0, 0);
    let streams = Streams::new(seed, Purpose::Unseen, 0);
    // neighbouring histories share the lights well, so it can end after any
    while done < photons && rays < MOST_RAYS {
        let mut rng = streams.history(done);
        let photon = scene.emit::<L>(&strata, done, &mut rng);
        let delta = strata.is_delta(&scene.lights, photon.source);
        let mut finding = Finding::new(scene, photon.light, delta);
        let mut source = pilot.map(|pilot| Source::new(scene, pilot, photon.light, photon.ray));
        trace(scene, photon.ray, photon.power, (), &mut rng, |event| {
            if let Some(counted) = event.counted(scene) {
                on_captors.add(photon.weights, counted.power, finding.hidden);
                if let (Some(by_chance), Some(source)) = (&mut by_chance, &source)
                    && !finding.hidden
                {
                    by_chance.add(source, photon.weights, &counted, &event);
                }
            }
            if let Event::Arrival { hit, surface, power, lobe, .. } = event {
                rays += 1;
                on_surfaces.add(photon.weights, power, finding.hidden);
                finding.arrived(hit.triangle, lobe);
                if let Some(source) = &mut source {
                    source.arrived(hit.point, surface.normal, lobe);
                }
            }
        });
        done += 1;
    }
    let reached = on_captors.all.iter().any(|&flux| flux > 0.0);
    let flux = if reached { on_captors } else { on_surfaces };
    let mean = |sums: Vec<f64>| sums.iter().map(|sum| sum / done as f64).collect();
    let unseen = Unseen { all: mean(flux.all), hidden: mean(flux.hidden) };
    (unseen, by_chance.and_then(|by_chance| by_chance.of(done)))
}
