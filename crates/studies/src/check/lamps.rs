//! Lamps one by one: where their light goes.

use glam::Vec3;
use rayon::prelude::*;

use super::{
    inside::is_in,
    remarks::{Remarks, quoted},
};
use phylux_core::{
    math::{
        rng::{Purpose, Stream, Streams},
        spectrum::{Lanes, Spectrum, with_lanes},
    },
    scene::{light::Light, material::Scatterer, world::Scene},
    transport::trace::{Event, trace},
};

/// Number of photons of each lamp that show whether its light meets anything.
const PHOTONS: u64 = 256;
/// The most photons of a lamp among many.
const MOST: u64 = 4096;
/// The most photons of all lamps where these are few.
const MOST_OF_ALL: u64 = 1 << 20;
/// Nothing is said of light that rays do not find where fewer arrivals than this would be expected of
/// rays that cross the scene in all places and directions alike.
pub(super) const EXPECTED: f64 = 100.0;
/// The most captors that are looked at for each lamp.
const MOST_POINTS: usize = 1000;
/// The most lamps that are looked at.
const MOST_LAMPS: usize = 10_000;

/// Where the light of a lamp goes.
#[derive(Clone, Copy, PartialEq)]
enum Fate {
    /// To a captor, or it is not known where.
    Captor,
    /// No photon meets anything.
    Nothing,
    /// No photon leaves the closed object in which the lamp is.
    Inside(usize),
    /// No photon comes to a captor, although captors fill much of the scene.
    NoCaptor,
}

/// Warns of lamps whose light meets nothing, stays in an object or comes to no captor. `room` is the
/// object in which everything stands, if there is one.
pub(super) fn check_lamps(scene: &Scene, room: Option<usize>, remarks: &mut Remarks) {
    if scene.triangles().is_empty() || scene.captors().is_empty() {
        return;
    }
    let lamps = scene.lights().iter().enumerate().filter(|(_, light)| {
        light.entrance().is_none() && light.power.iter().any(|power| *power > 0.0)
    });
    let lamps: Vec<usize> = lamps.map(|(l, _)| l).take(MOST_LAMPS).collect();
    let around = scene.triangles().extent();
    let around = around.join(scene.captors_extent());
    let areas: f64 = scene.captors().iter().map(|captor| captor.area).sum();
    let density = areas / f64::from(2.0 * around.half_area());
    let most = MOST.max(MOST_OF_ALL / lamps.len().max(1) as u64);
    let fate =
        |l: usize| with_lanes!(scene.lanes(), L => fate::<L>(scene, l, room, (density, most)));
    let fates: Vec<Fate> = lamps.par_iter().map(|&l| fate(l)).collect();
    let of = |wanted: Fate| {
        let all = lamps.iter().zip(&fates).filter(move |(_, fate)| **fate == wanted);
        all.map(|(&l, _)| &scene.lights()[l].name)
    };
    remarks.warn_of(quoted(of(Fate::Nothing)), |list| {
        format!(
            "lamps whose light meets nothing: {list}; check where they are and which way they aim"
        )
    });
    let inside = lamps.iter().zip(&fates).filter_map(|(&l, fate)| match fate {
        Fate::Inside(object) => {
            Some(format!("`{}` in `{}`", scene.lights()[l].name, scene.objects()[*object]))
        }
        _ => None,
    });
    remarks.warn_of(inside, |list| {
        format!(
            "lamps inside a closed object, which keeps their light: {list}; move them out of it"
        )
    });
    // of lamps of which none comes to a captor there is a warning for all together
    if fates.contains(&Fate::Captor) {
        remarks.warn_of(quoted(of(Fate::NoCaptor)), |list| {
            format!(
                "lamps of whose light nothing comes to a captor: {list}; check where they are, which \
                way they aim, and what stands between, such as a roof"
            )
        });
    }
}

/// Returns points that stand for what is in a scene: the middles of captors, and the middle and the
/// corners of the box around all surfaces.
fn points(scene: &Scene) -> impl Iterator<Item = Vec3> {
    let around = scene.triangles().extent();
    let captors = scene.captors().iter().take(MOST_POINTS);
    let middles = captors.map(|captor| (captor.center - scene.center()).as_vec3());
    middles.chain([around.center()]).chain(around.corners())
}

/// Follows at most `most` photons of a lamp until one comes to a captor. `density` is the number of
/// arrivals that are expected of a ray.
fn fate<L: Lanes>(
    scene: &Scene,
    lamp: usize,
    room: Option<usize>,
    (density, most): (f64, u64),
) -> Fate {
    let light: &Light = &scene.lights()[lamp];
    let streams = Streams::new(0, Purpose::Other, lamp as u64);
    let (mut rays, mut met, mut at_captor) = (0u64, false, false);
    let mut first = None;
    // the object that all photons meet first, if it is the same, and lets nothing through
    let mut around = Some(None);
    for photon in 0..most {
        let mut rng: Stream = streams.history(photon);
        let ray = light.emit(&mut rng);
        first.get_or_insert(ray.origin);
        let mut is_first = true;
        let power = Spectrum::<L>::splat(scene.lanes(), 1.0);
        trace(scene, ray, power, (), &mut rng, |event| match event {
            Event::Crossing { .. } => at_captor = true,
            Event::Arrival { at, .. } => {
                rays += 1;
                met = true;
                at_captor |= at.surface.captor().is_some();
                if std::mem::take(&mut is_first) {
                    let object = scene.object(at.hit.triangle);
                    let keeps = !at.material.is_clear() && !at.material.transmits_diffusely();
                    around = match (around, object.filter(|_| keeps)) {
                        (Some(None), Some(object)) => Some(Some(object)),
                        (Some(Some(one)), Some(object)) if one == object => around,
                        _ => None,
                    };
                }
            }
            Event::Escaped { missed, .. } => {
                rays += 1;
                around = around.filter(|_| !missed);
            }
            _ => {}
        });
        if at_captor {
            return Fate::Captor;
        }
        if photon + 1 == PHOTONS {
            if !met {
                // a lamp in the distance shines on what hardly any of its photons find
                let sees = |point: Vec3| light.sample_toward::<L>(point, &mut rng).is_some();
                return if points(scene).any(sees) { Fate::Captor } else { Fate::Nothing };
            }
            let inside = around.flatten().filter(|&object| Some(object) != room);
            let inside = inside.zip(first).filter(|&(object, at)| is_in(scene, at, object));
            if let Some((object, _)) = inside {
                return Fate::Inside(object);
            }
        }
        if photon + 1 >= PHOTONS && rays as f64 * density >= EXPECTED {
            return Fate::NoCaptor;
        }
    }
    Fate::Captor
}
