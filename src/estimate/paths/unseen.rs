//! What paths cannot find.

use crate::{
    light::{Light, Strata},
    material::Onward,
    rng::Stream,
    scene::Scene,
    spectrum::Spectrum,
    trace::{Event, trace},
};

/// Photons of the run that tells it.
const PHOTONS: u64 = 50_000;

/// Flux of a short photon run per band, in W or umol/s: on the captors or, where it reached none, on
/// all surfaces.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Unseen {
    /// Flux of all lights.
    pub all: Vec<f64>,
    /// Flux that no path can find: of a point or line light, by way of a mirror or refraction
    /// before its first diffuse scattering.
    pub hidden: Vec<f64>,
}

impl Unseen {
    /// Runs photons; none where the scene has no point or line light, or nothing smooth.
    pub fn find<const N: usize>(scene: &Scene, seed: u64) -> Option<Self> {
        let smooth = scene.materials.iter().any(|named| named.material.has_mirror());
        if !smooth || !scene.lights.iter().any(Light::is_delta) {
            return None;
        }
        let nothing = || {
            let zeros = vec![0.0; scene.bands.len()];
            Self { all: zeros.clone(), hidden: zeros }
        };
        let (mut on_captors, mut on_surfaces) = (nothing(), nothing());
        let photons = PHOTONS.max(2 * scene.lights.len() as u64);
        let strata = Strata::new(&scene.lights, photons, N);
        for index in 0..photons {
            let (light, weights) = (strata.light(index), strata.weights(strata.light(index)));
            let light = &scene.lights[light];
            let mut rng = Stream::new(seed, 0, index);
            let ray = light.emit(scene.ray_offset(), &mut rng);
            let power = Spectrum(std::array::from_fn(|b| f32::from(weights[b] > 0.0)));
            let (mut hidden, mut diffused) = (false, false);
            trace(scene, ray, power, &mut rng, |event: Event<'_, N>| match event {
                Event::Crossing { power, .. } => on_captors.add(weights, &power, hidden),
                Event::Arrival { surface, power, onward, .. } => {
                    on_surfaces.add(weights, &power, hidden);
                    if surface.captor().is_some() {
                        on_captors.add(weights, &power, hidden);
                    }
                    hidden |= light.is_delta() && !diffused && onward == Some(Onward::Specular);
                    diffused |= onward == Some(Onward::Diffuse);
                }
                Event::Escaped(_) | Event::Lost(_) => {}
            });
        }
        let reached = on_captors.all.iter().any(|&flux| flux > 0.0);
        let flux = if reached { on_captors } else { on_surfaces };
        let mean = |sums: Vec<f64>| sums.iter().map(|sum| sum / photons as f64).collect();
        Some(Self { all: mean(flux.all), hidden: mean(flux.hidden) })
    }

    /// The largest hidden share over bands, in [0, 1].
    pub fn share(&self) -> f64 {
        let lit = self.hidden.iter().zip(&self.all).filter(|(_, all)| **all > 0.0);
        lit.map(|(hidden, all)| hidden / all).fold(0.0, f64::max)
    }

    fn add<const N: usize>(&mut self, weights: &[f64], power: &Spectrum<N>, hidden: bool) {
        let sums = self.all.iter_mut().zip(&mut self.hidden);
        for (((all, unseen), weight), power) in sums.zip(weights).zip(power.0) {
            let flux = f64::from(power) * weight;
            *all += flux;
            *unseen += if hidden { flux } else { 0.0 };
        }
    }
}
