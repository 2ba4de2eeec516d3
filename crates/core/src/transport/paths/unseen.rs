//! Light that paths cannot find, or find by chance alone: a short run of photons measures it.

use glam::Vec3;

use super::{
    Near, Pilot,
    chance::{ByChance, Place, Source},
};
use crate::{
    math::{
        rng::{Purpose, Stream, Streams},
        spectrum::{Lanes, Spectrum, with_lanes},
    },
    scene::{
        light::{Emission, Light, Strata},
        material::{LobeKind, Material, Scatterer},
        world::{FlatMirrors, Scene},
    },
    transport::trace::{Event, trace},
};

/// Number of photons of that run.
const PHOTONS: u64 = 50_000;
/// The run ends earlier if its photons are followed so long that they take this many rays.
const MOST_RAYS: u64 = 2_000_000;
/// Beside a run of paths they take one in so many of its rays, but a tenth of a second is always worth
/// it.
const SHARE: u64 = 32;
const LEAST_RAYS: u64 = 1 << 18;

/// Flux in a short run of photons, per band, in W or umol/s: on the captors or, if the photons
/// reached no captor, on all surfaces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Unseen {
    /// Flux of all lights.
    pub all: Vec<f64>,
    /// Flux that no path can find: of a point or a line, by way of a mirror or a refraction before
    /// its first diffuse scattering; of the sun, by way of anything but one flat pane or mirror.
    pub hidden: Vec<f64>,
    /// Number of equal histories that would vary as much as those that brought hidden flux, (Σ x)² /
    /// Σ x².
    pub histories: f64,
}

/// Results of photons that help to judge a run of paths.
pub struct Told {
    /// The light that paths cannot find; `None` if the scene has no such light.
    pub unseen: Option<Unseen>,
    /// The light that paths find by chance alone; `None` if the scene has no such light.
    pub by_chance: Option<ByChance>,
}

/// The history of a photon, as far as it decides whether a path could find the photon.
pub struct Finding<'a> {
    delta: bool,
    /// The flat mirrors in which paths search for the photon's light.
    images: Option<&'a FlatMirrors>,
    diffused: bool,
    mirrored: bool,
    /// Whether no path could find the photon.
    pub hidden: bool,
}

impl<'a> Finding<'a> {
    /// Starts with a photon that leaves a light. `delta` tells whether no path meets this light by
    /// chance, or none counts it then.
    pub fn new(scene: &'a Scene, light: usize, delta: bool) -> Self {
        let images = scene.flat_mirrors().filter(|mirrors| mirrors.suns().contains(&light));
        Self { delta, images, diffused: false, mirrored: false, hidden: false }
    }

    /// Takes in that the photon has arrived at a triangle, which sends it on by `lobe`. `None`: the
    /// photon ends there.
    pub fn arrived(&mut self, triangle: usize, lobe: Option<LobeKind>) {
        if self.delta && !self.diffused && lobe.is_some_and(LobeKind::is_specular) {
            // paths search one flat mirror for the sun
            let shown = |images: &FlatMirrors| images.image_of(triangle).is_some();
            self.hidden |= self.mirrored || !self.images.is_some_and(shown);
            self.mirrored = true;
        }
        self.diffused |= lobe.is_some_and(LobeKind::is_diffuse);
    }

    /// Takes in what the photon itself meets, as long as it is direct, and returns whether it was.
    #[inline]
    pub fn takes<L: Lanes>(&mut self, event: &Event<'_, L>) -> bool {
        let takes = !event.is_beside() && self.is_direct();
        if takes && let Event::Arrival { at, lobe, .. } = event {
            self.arrived(at.hit.triangle, *lobe);
        }
        takes
    }

    /// Returns whether the photon has come straight, through thin panes, or by way of one flat
    /// mirror in which paths search for its light.
    pub fn is_direct(&self) -> bool {
        !self.diffused && !self.hidden
    }
}

impl Told {
    /// Runs the photons, with about one ray for each [`SHARE`] of a run of paths, unless the scene
    /// cannot have light of either kind.
    pub fn find(scene: &Scene, pilot: &Pilot, seed: u64, rays: u64) -> Self {
        let hides = Unseen::may_be(scene);
        if !hides && pilot.spots.is_none() && !(is_smooth(scene) && ByChance::may_be(scene)) {
            return Self { unseen: None, by_chance: None };
        }
        let rays = (rays / SHARE).clamp(LEAST_RAYS, MOST_RAYS);
        let (unseen, by_chance) =
            with_lanes!(scene.lanes(), L => count::<L>(scene, Of::All, Some(pilot), (seed, rays)));
        Self { unseen: hides.then_some(unseen), by_chance }
    }
}

impl Unseen {
    /// Returns whether paths may miss light in the scene: it has a point, line or sun, and a smooth
    /// surface.
    pub fn may_be(scene: &Scene) -> bool {
        is_smooth(scene) && scene.lights().iter().any(Light::is_delta)
    }

    /// Runs the photons. `None` if there [cannot be](Self::may_be) such light.
    pub fn find(scene: &Scene, seed: u64) -> Option<Self> {
        Self::may_be(scene).then(|| Self::run(scene, Of::All, seed))
    }

    /// Runs the photons of daylight alone, and calls hidden only what no path can find of the sun.
    /// `None` if the scene has no smooth surface.
    pub fn of_suns(scene: &Scene, seed: u64) -> Option<Self> {
        is_smooth(scene).then(|| Self::run(scene, Of::Daylight, seed))
    }

    fn run(scene: &Scene, of: Of, seed: u64) -> Self {
        with_lanes!(scene.lanes(), L => count::<L>(scene, of, None, (seed, MOST_RAYS))).0
    }

    /// Returns the largest hidden fraction of the flux over the bands, in [0, 1].
    pub fn share(&self) -> f64 {
        let lit = self.hidden.iter().zip(&self.all).filter(|(_, all)| **all > 0.0);
        lit.map(|(hidden, all)| hidden / all).fold(0.0, f64::max)
    }

    /// Returns about the standard error of the hidden share of a band: that of a share of histories.
    pub fn error_of(&self, share: f64) -> f64 {
        share * ((1.0 - share).max(0.0) / self.histories.max(1.0)).sqrt()
    }
}

/// Sums of a run of photons on some surfaces.
#[derive(Default)]
struct Brought {
    all: Vec<f64>,
    hidden: Vec<f64>,
    /// The hidden flux of the history under way, in all bands, and the sum over earlier ones of the
    /// squares of theirs.
    own: f64,
    squares: f64,
}

impl Brought {
    fn add<L: Lanes>(&mut self, weights: &[f64], power: &Spectrum<L>, hidden: bool) {
        let sums = self.all.iter_mut().zip(&mut self.hidden);
        for (((all, unseen), weight), power) in sums.zip(weights).zip(power.values()) {
            let flux = f64::from(*power) * weight;
            *all += flux;
            if hidden {
                *unseen += flux;
                self.own += flux;
            }
        }
    }

    /// Closes the history under way.
    fn settle(&mut self) {
        self.squares += std::mem::take(&mut self.own).powi(2);
    }

    /// Returns the flux of so many histories.
    fn of(self, histories: u64) -> Unseen {
        let sum: f64 = self.hidden.iter().sum();
        let equal = if self.squares > 0.0 { sum * sum / self.squares } else { 0.0 };
        let mean = |sums: Vec<f64>| sums.iter().map(|sum| sum / histories as f64).collect();
        Unseen { all: mean(self.all), hidden: mean(self.hidden), histories: equal }
    }
}

/// Measures the light that comes to captors in ways at which no flight is aimed: by way of two
/// mirrors, or of one that is not flat. Solid glass does not count, as flights are aimed widely around
/// what it may show. `shows` tells whether flights are aimed by way of a mirror at a point with a
/// normal. Photons alone bring such light to captors, and the spread of a run in which few have done
/// so does not show it. As many photons are traced as `histories` in that run, but no more than in
/// other runs of this kind. `None` if the scene has no such light.
pub fn unaimed(
    scene: &Scene,
    shows: impl Fn(Vec3, Vec3) -> bool,
    histories: u64,
    seed: u64,
) -> Option<ByChance> {
    let mirrors = |material: &Material| material.has_mirror() && !material.is_solid();
    let any = scene.materials().iter().any(|named| mirrors(&named.material));
    let photons = histories.min(PHOTONS);
    any.then(|| with_lanes!(scene.lanes(), L => count_unaimed::<L>(scene, shows, photons, seed)))
        .flatten()
}

fn count_unaimed<L: Lanes>(
    scene: &Scene,
    shows: impl Fn(Vec3, Vec3) -> bool,
    photons: u64,
    seed: u64,
) -> Option<ByChance> {
    let mut found = ByChance::new(scene);
    let done = each_photon::<L>(scene, (photons, MOST_RAYS), seed, None, |photon, _, rng| {
        let mut rays = 0;
        // the mirrors since a flight was aimed, and whether flights are aimed by way of them
        let (mut mirrors, mut aimed) = (0, true);
        trace(scene, photon.ray, photon.power, (), rng, |event| {
            if let Some(counted) = event.counted(scene) {
                let face = Place::Face(counted.channel());
                found.leave(photon.weights, counted.power, face, !aimed);
            }
            if let Event::Arrival { at, power, lobe, .. } = event {
                rays += 1;
                found.leave(photon.weights, power, Place::Surface, !aimed);
                match lobe {
                    Some(LobeKind::MirrorReflection) if !at.material.is_solid() => {
                        mirrors += 1;
                        aimed &= mirrors == 1 && shows(at.hit.point, at.surface.normal);
                    }
                    Some(lobe) if lobe.is_diffuse() => (mirrors, aimed) = (0, true),
                    _ => {}
                }
            }
        });
        rays
    });
    found.of(scene, done)
}

/// Returns, for each channel of the captors and each band, whether light of a short run of photons
/// arrives there. The photons take at most about `rays` rays.
pub fn reached(scene: &Scene, rays: u64, seed: u64) -> Vec<bool> {
    with_lanes!(scene.lanes(), L => count_reached::<L>(scene, rays, seed))
}

fn count_reached<L: Lanes>(scene: &Scene, rays: u64, seed: u64) -> Vec<bool> {
    let bands = scene.bands().len();
    let mut reached = vec![false; scene.channels() * bands];
    each_photon::<L>(scene, (PHOTONS, rays), seed, None, |photon, _, rng| {
        let mut rays = 0;
        trace(scene, photon.ray, photon.power, (), rng, |event| {
            rays += u64::from(matches!(event, Event::Arrival { .. }));
            let Some(counted) = event.counted(scene) else { return };
            let response = counted.captor.sensor.response.as_ref();
            if response.is_some_and(|response| response.factor(event.cosine(scene)) == 0.0) {
                return;
            }
            let channel = reached[counted.channel() * bands..][..bands].iter_mut();
            channel.zip(counted.power.values()).for_each(|(reached, p)| *reached |= *p > 0.0);
        });
        rays
    });
    reached
}

/// Traces photons one by one, some of sun and sky through a box `near` the captors: so many, but two
/// for each source, and fewer if they are followed so long that they take so many `rays`. `follow` traces one, and returns its number of rays. Returns
/// how many were traced.
fn each_photon<L: Lanes>(
    scene: &Scene,
    (photons, rays): (u64, u64),
    seed: u64,
    near: Option<&Near>,
    mut follow: impl FnMut(Emission<'_, L>, &Strata, &mut Stream) -> u64,
) -> u64 {
    let photons = photons.max(2 * scene.sources() as u64);
    let strata = Strata::new(scene.lights(), photons, scene.lanes());
    let streams = Streams::new(seed, Purpose::Unseen, 0);
    let (mut done, mut taken) = (0, 0);
    // neighbouring histories share the lights well, so the loop may end after any of them
    while done < photons && taken < rays {
        let mut rng = streams.history(done);
        let photon = match near {
            Some(near) => near.emit::<L>(scene, &strata, done, &mut rng).0,
            None => scene.emit::<L>(&strata, done, &mut rng),
        };
        taken += if photon.power.is_zero() { 0 } else { follow(photon, &strata, &mut rng) };
        done += 1;
    }
    done
}

fn is_smooth(scene: &Scene) -> bool {
    scene.materials().iter().any(|named| named.material.has_mirror())
}

/// The lights whose photons are counted.
#[derive(Clone, Copy, PartialEq)]
enum Of {
    All,
    Daylight,
}

/// Runs the photons. With a `pilot`, they also measure the light that its paths find by chance
/// alone.
fn count<L: Lanes>(
    scene: &Scene,
    of: Of,
    pilot: Option<&Pilot>,
    (seed, rays): (u64, u64),
) -> (Unseen, Option<ByChance>) {
    let nothing = || {
        let zeros = vec![0.0; scene.bands().len()];
        Brought { all: zeros.clone(), hidden: zeros, ..Brought::default() }
    };
    let (mut on_captors, mut on_surfaces) = (nothing(), nothing());
    let mut by_chance = pilot.map(|_| ByChance::new(scene));
    let has_photons = pilot.is_some_and(Pilot::has_photons);
    let near = Near::find(scene);
    let done =
        each_photon::<L>(scene, (PHOTONS, rays), seed, near.as_ref(), |photon, strata, rng| {
            if of == Of::Daylight && scene.lights()[photon.light].entrance().is_none() {
                return 0;
            }
            let mut rays = 0;
            let left = pilot.is_some_and(|pilot| pilot.leaves(photon.light));
            let delta = left || strata.is_delta(scene.lights(), photon.source);
            let mut finding = Finding::new(scene, photon.light, delta);
            let mut source = pilot.map(|pilot| Source::new(scene, pilot, photon.light, photon.ray));
            trace(scene, photon.ray, photon.power, (), rng, |event| {
                let hidden = finding.hidden;
                let mut judge = |power: &Spectrum<L>, place: Place, at: (Vec3, Vec3)| {
                    let Some((by_chance, source)) = by_chance.as_mut().zip(source.as_ref()) else {
                        return;
                    };
                    match hidden {
                        false => by_chance.add(source, photon.weights, power, place, at),
                        true if has_photons => by_chance.leave(photon.weights, power, place, true),
                        true => {}
                    }
                };
                if let Some(counted) = event.counted(scene) {
                    on_captors.add(photon.weights, counted.power, hidden);
                    let face = Place::Face(counted.channel());
                    match &event {
                        Event::Crossing { crossing, .. } => {
                            let normal = scene.crossed_normal(crossing);
                            judge(counted.power, face, (crossing.point, normal));
                        }
                        Event::Arrival { at, .. } => {
                            judge(counted.power, face, (at.hit.point, at.surface.normal));
                        }
                        _ => {}
                    }
                }
                if let Event::Arrival { at, power, lobe, .. } = event {
                    rays += 1;
                    on_surfaces.add(photon.weights, power, hidden);
                    judge(power, Place::Surface, (at.hit.point, at.surface.normal));
                    finding.arrived(at.hit.triangle, lobe);
                    if let Some(source) = &mut source {
                        source.arrived(&at.hit, at.surface.normal, lobe);
                    }
                }
            });
            on_captors.settle();
            on_surfaces.settle();
            rays
        });
    let reached = on_captors.all.iter().any(|&flux| flux > 0.0);
    let flux = if reached { on_captors } else { on_surfaces };
    (flux.of(done), by_chance.and_then(|by_chance| by_chance.of(scene, done)))
}
