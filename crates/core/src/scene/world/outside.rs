//! Surfaces outside the openings that daylight comes in through.

use std::collections::HashMap;

use super::Scene;
use crate::{
    math::{
        geometry::{Frame, Ray, closeness},
        rng::{Purpose, Streams},
        sampling::{cosine_hemisphere, uniform_triangle, weighted_choice},
        spectrum::{Lanes, Spectrum, with_lanes},
    },
    scene::{light::Entrance, material::Scatterer},
};

/// Number of rays to the sky from the openings of a light.
const RAYS: u64 = 4096;
/// Fraction of the view that surfaces may take, times what they send on, before it is told.
const NEXT_TO_NOTHING: f64 = 1e-3;

/// Surfaces that openings see towards the sky. Light that falls on them does not come in.
#[derive(Clone, Debug, PartialEq)]
pub struct Outside {
    /// Indices of the lights that come in through these openings alone.
    pub lights: Vec<usize>,
    /// Fraction of what the openings see, weighted by the cosine.
    pub share: f64,
    /// Names of the objects, or of the materials of nameless ones, what is seen most first.
    pub names: Vec<String>,
}

impl Scene {
    /// Returns the surfaces that openings see towards the sky, and that send on some light.
    pub fn outside_openings(&self) -> Vec<Outside> {
        let mut found: Vec<Outside> = Vec::new();
        let entrances = || {
            self.lighting
                .infinite
                .iter()
                .filter_map(|&light| Some((light, self.lighting.lights[light].entrance()?)))
        };
        for (light, entrance) in entrances().filter(|(_, e)| e.has_openings() && !e.light.is_dark())
        {
            let through = |&other: &usize| {
                let other = self.lighting.lights[other].entrance();
                other.is_some_and(|other| other.light.through == entrance.light.through)
            };
            match found.iter_mut().find(|outside| outside.lights.iter().any(through)) {
                Some(outside) => outside.lights.push(light),
                None => {
                    let outside =
                        with_lanes!(self.lanes(), L => self.outside::<L>(light, entrance));
                    found.push(outside);
                }
            }
        }
        found.retain(|outside| !outside.names.is_empty());
        found
    }

    fn outside<L: Lanes>(&self, light: usize, entrance: &Entrance) -> Outside {
        let mut area = 0.0;
        let areas = entrance.openings().iter().map(|triangle| {
            area += f64::from(triangle.area());
            area
        });
        let areas: Vec<f64> = areas.collect();
        let streams = Streams::new(0, Purpose::Other, light as u64);
        let mut seen: HashMap<String, (u64, f64)> = HashMap::new();
        for index in (0..RAYS).filter(|_| !areas.is_empty()) {
            let mut rng = streams.history(index);
            let triangle = entrance.openings()[weighted_choice(&areas, rng.uniform_fine()).index];
            let (at, normal) = (uniform_triangle(rng.square()), triangle.normal());
            let direction = Frame::new(normal).to_world(cosine_hemisphere(rng.square()));
            let origin = triangle.point(at.x, at.y);
            let offset = triangle.offset_at(origin);
            let origin = origin + 2.0 * offset * normal;
            let ray = Ray { origin, direction };
            let Some(at) = self.arrive(&ray) else { continue };
            // behind another opening there is light again
            let offset = closeness(origin) + 4.0 * offset;
            let other = self.last_opening_in_cells(light, &ray, offset);
            if other.is_some_and(|(t, _)| t < at.hit.t) {
                continue;
            }
            let absorbed = at.material.absorptance(&at.interaction);
            let least = |absorbed: Spectrum<L>| {
                let bands = absorbed.values().iter().take(self.head.bands.len());
                bands.copied().fold(f32::INFINITY, f32::min)
            };
            let sent_on = 1.0 - absorbed.map_or(0.0, least);
            let name = match self.object(at.hit.triangle) {
                Some(object) => &self.objects.names[object],
                None => &self.materials[at.surface.material as usize].name,
            };
            let (count, sent) = seen.entry(name.clone()).or_default();
            (*count, *sent) = (*count + 1, *sent + f64::from(sent_on));
        }
        let all = RAYS as f64;
        let mut seen: Vec<(String, (u64, f64))> = seen.into_iter().collect();
        seen.retain(|(_, (_, sent))| *sent > 0.0);
        seen.sort_by(|(a, (m, _)), (b, (n, _))| n.cmp(m).then(a.cmp(b)));
        let sent: f64 = seen.iter().map(|(_, (_, sent))| sent).sum();
        if sent < NEXT_TO_NOTHING * all {
            seen.clear();
        }
        let share = seen.iter().map(|(_, (count, _))| *count as f64).sum::<f64>() / all;
        let names = seen.into_iter().map(|(name, _)| name).collect();
        Outside { lights: vec![light], share, names }
    }
}
