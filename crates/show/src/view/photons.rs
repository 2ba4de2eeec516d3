//! The photons of the page: whole histories, of each the arrivals in the order of its path, so that
//! photons can fly from their lamps from surface to surface.

use std::collections::HashMap;

use glam::Vec3;
use rayon::prelude::*;

use phylux_core::{
    math::geometry::Extent, scene::light::Light, transport::surface_light::SurfaceLight,
};

/// Limit on the number of arrivals in a page.
const MOST: usize = 50_000;
/// Limit on the number of arrivals whose order is looked for among those of equal bounces. A path
/// that is longer in glass keeps the order in which it is stored.
const MOST_ALIKE: usize = 64;
/// Least cosine between the direction of flight and the way from the surface before.
const ALONG: f32 = 0.9995;
/// Farther than anything in a scene, m.
const FAR: f32 = 1e30;

/// An arrival, and where the photon flew from.
#[derive(Debug)]
pub struct Shown {
    /// Index in the map.
    pub index: usize,
    /// Where this straight flight began: on a lamp, on the surface before, or where it came into the
    /// scene; m from the centre of the scene.
    pub from: Vec3,
    /// Whether the photon flew here from the place of the arrival before.
    pub linked: bool,
    /// The material that it came from; `None` if it came straight from its light.
    pub material: Option<usize>,
}

/// Returns all arrivals of as many histories as a page holds, history by history, in each in the order
/// of the path. Histories are drawn by their numbers, evenly among all lights. `extent` is the box
/// around the scene.
pub fn shown(light: &SurfaceLight, extent: &Extent) -> Vec<Shown> {
    let photons = &light.map.photons;
    let places = light.map.positions();
    let mut of: HashMap<u32, Vec<usize>> = HashMap::new();
    let count = photons.par_iter().map(|photon| photon.history as usize + 1).max().unwrap_or(0);
    let mut sizes = vec![0u32; count];
    photons.iter().for_each(|photon| sizes[photon.history as usize] += 1);
    let mut histories: Vec<u32> = (0..count as u32).collect();
    // an odd factor reorders the numbers without a double
    histories.par_sort_unstable_by_key(|history| history.wrapping_mul(0x9E37_79B1));
    let mut room = MOST;
    for history in histories {
        let size = sizes[history as usize] as usize;
        if size > room {
            break;
        }
        room -= size;
        of.insert(history, Vec::with_capacity(size));
    }
    for (i, photon) in photons.iter().enumerate() {
        if let Some(own) = of.get_mut(&photon.history) {
            own.push(i);
        }
    }
    let mut chosen: Vec<(u32, Vec<usize>)> = of.into_iter().collect();
    chosen.sort_unstable_by_key(|(history, _)| *history);
    chosen.into_iter().flat_map(|(_, own)| path(light, &places, extent, own)).collect()
}

/// Returns the arrivals of a history in the order of its path.
fn path(
    light: &SurfaceLight,
    places: &[Vec3],
    extent: &Extent,
    mut left: Vec<usize>,
) -> Vec<Shown> {
    let bounces = |i: usize| light.map.ways().get(i).map_or(0, |way| way.bounces);
    let photon = |i: usize| light.map.photons[i];
    let follows = |before: usize, next: usize| {
        let way = places[next] - places[before];
        way.normalize_or_zero().dot(photon(next).direction.unpack()) > ALONG
    };
    left.sort_unstable_by_key(|i| (bounces(*i), *i));
    let mut found: Vec<Shown> = Vec::with_capacity(left.len());
    while let Some(&first) = left.first() {
        let alike = left.iter().take(MOST_ALIKE).take_while(|i| bounces(**i) == bounces(first));
        let alike: Vec<usize> = alike.copied().collect();
        let next = match found.last() {
            Some(last) => alike.iter().position(|i| follows(last.index, *i)),
            // the first of a path follows none of the others
            None => alike.iter().position(|i| !alike.iter().any(|o| o != i && follows(*o, *i))),
        };
        let index = left.remove(next.unwrap_or(0));
        let direction = photon(index).direction.unpack();
        let last = found.last().map(|last| last.index);
        let linked = last.is_some_and(|last| follows(last, index));
        let from = match last {
            Some(last) if linked => places[last],
            // through the side of a scene that repeats
            Some(_) => entrance(extent, places[index], direction),
            None => {
                let lamp = &light.scene.lights()[photon(index).light as usize];
                start(lamp, extent, places[index], direction)
            }
        };
        let material = |last: usize| light.scene.surface(photon(last).triangle as usize).material;
        let material = last.map(|last| material(last) as usize);
        found.push(Shown { index, from, linked, material });
    }
    found
}

/// Returns where a flight to `to` began: within the box around its lamp, or at the side of the scene
/// if the light comes from afar.
fn start(light: &Light, extent: &Extent, to: Vec3, direction: Vec3) -> Vec3 {
    if light.entrance().is_some() {
        return entrance(extent, to, direction);
    }
    let lamp = light.extent();
    let [near, far] = behind(&lamp, to, direction);
    let middle = (lamp.min + lamp.max) / 2.0;
    // beside the box by rounding: as near to its middle as the flight comes
    let back = if near <= far { (near + far) / 2.0 } else { (to - middle).dot(direction) };
    (to - back.max(0.0) * direction).clamp(extent.min, extent.max)
}

/// Returns where a flight to `to` came into the box around the scene.
fn entrance(extent: &Extent, to: Vec3, direction: Vec3) -> Vec3 {
    let [_, far] = behind(extent, to, direction);
    (to - far.max(0.0) * direction).clamp(extent.min, extent.max)
}

/// Returns the distances back along a flight between which it was in a box, m; the first is larger
/// than the second if it was not.
fn behind(extent: &Extent, to: Vec3, direction: Vec3) -> [f32; 2] {
    let back = -direction;
    // along a side it is always between two sides, or never
    let level = back.abs().cmplt(Vec3::splat(1e-9));
    let within = to.cmpge(extent.min) & to.cmple(extent.max);
    let ends = Vec3::select(within, Vec3::splat(FAR), Vec3::splat(-FAR));
    let along = Vec3::select(level, Vec3::ONE, back).recip();
    let [a, b] = [extent.min, extent.max].map(|side| (side - to) * along);
    let near = Vec3::select(level, -ends, a.min(b));
    let far = Vec3::select(level, ends, a.max(b));
    [near.max_element().max(0.0), far.min_element()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flights_begin_in_the_box_that_they_come_from() {
        let lamp = Extent { min: Vec3::new(1.0, 1.0, 3.0), max: Vec3::new(2.0, 2.0, 3.0) };
        assert_eq!(behind(&lamp, Vec3::new(1.5, 1.5, 0.0), -Vec3::Z), [3.0, 3.0]);
        let room = Extent { min: Vec3::ZERO, max: Vec3::splat(4.0) };
        let aside = entrance(&room, Vec3::new(1.0, 2.0, 0.0), Vec3::X);
        assert_eq!(aside, Vec3::new(0.0, 2.0, 0.0));
        let [near, far] = behind(&lamp, Vec3::ZERO, Vec3::Z);
        assert!(near > far, "{near} {far}");
    }
}
