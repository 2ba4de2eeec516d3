//! The k-nearest estimate: irradiance and radiance at a captor's middle from the photons stored
//! there (Jensen, Realistic Image Synthesis Using Photon Mapping, 2001, ch. 7), each with equal
//! weight. Biased by the size of the gather disc; with the default k consistent as photons grow.

use std::f64::consts::PI;

use glam::Vec3;

use crate::{
    math::{
        spectrum::{Lanes, Spectrum, with_lanes},
        stats::Estimate,
    },
    scene::{
        captor::{Captor, CaptorKind, Channel},
        material::Interaction,
        world::Scene,
    },
    transport::photon_map::{Gathered, PhotonMap},
};

#[cfg(test)]
mod tests;

/// What the k nearest photons of one face say. Standard errors are of the noise alone; none for fewer
/// than two photons and where nothing arrived.
#[derive(Clone, Debug, PartialEq)]
pub struct NearestEstimate {
    /// Photons gathered: the asked-for k, or all there are.
    pub k: usize,
    /// Distance of the k-th photon, m; with fewer than k, of the captor's farthest point.
    pub radius: f64,
    /// Share of the captor's area that it is a mean over, in (0, 1].
    pub coverage: f64,
    /// Per band and sum over bands, W/m2 or umol/m2/s.
    pub irradiance: Vec<Estimate>,
    /// Sent along the face's mean normal by scattering that is no mirror, per band and sum, W/m2/sr or
    /// umol/m2/s/sr; none where the surface has no such scattering or no mean normal.
    pub radiance: Option<Vec<Estimate>>,
}

/// The least k that is chosen: an error of 14 %.
const LEAST_K: usize = 50;

/// The k for a face that `photons` of so many `histories` arrived on: those of the number of histories to the power
/// 2/3, the law of the least mean square error in the plane (Silverman, Density Estimation, 1986, 5.2). The
/// relative error and the share of the captor's area are then alike, histories^(-1/3), from 354 histories on:
/// photons that come of one, as flights that it was split into, are no more independent for being many.
fn chosen_k(photons: usize, histories: usize) -> usize {
    let independent = (histories as f64).powf(2.0 / 3.0).round().max(LEAST_K as f64);
    (independent * photons as f64 / histories.max(1) as f64).ceil() as usize
}

/// The estimates for a captor, front then back; none for a face that no photon has reached. Without
/// `k` each face has its own, after the photons on it.
pub fn estimate(
    scene: &Scene,
    map: &PhotonMap,
    captor: &Captor,
    k: Option<usize>,
) -> [Option<NearestEstimate>; 2] {
    let query = middle(scene, captor);
    let faces = [Channel::Front, Channel::Back];
    let gathered = faces.map(|face| gather(scene, map, captor, face, query, k));
    let radiance = |face| match captor.kind {
        CaptorKind::Virtual { .. } => None,
        CaptorKind::Surface => {
            with_lanes!(scene.lanes(), L => radiance::<L>(scene, map, captor, &gathered, face))
        }
    };
    faces.map(|face| {
        let own = gathered[face as usize].as_ref()?;
        let irradiance = sum(scene, map, weighted(own).collect(), |photon, weight, into| {
            let power = map.power(photon);
            into.iter_mut().zip(power).for_each(|(sum, p)| *sum += weight * f64::from(*p));
        });
        let radiance = match captor.kind {
            CaptorKind::Virtual { .. } => Some(irradiance.iter().map(white).collect()),
            CaptorKind::Surface => radiance(face),
        };
        let Gathered { found: k, radius, area, .. } = *own;
        let radius = f64::from(radius.unwrap_or_else(|| reach(scene, captor, query)));
        let coverage = (area / captor.area).min(1.0);
        Some(NearestEstimate { k, radius, coverage, irradiance, radiance })
    })
}

/// The photons, each with what makes an irradiance of its power, 1/m2.
fn weighted(gathered: &Gathered) -> impl Iterator<Item = (usize, f64)> {
    gathered.photons.iter().map(|photon| (photon.index, gathered.weight))
}

/// The radiance of an ideal white Lambertian receiver.
fn white(irradiance: &Estimate) -> Estimate {
    let Estimate { mean, standard_error } = irradiance;
    Estimate { mean: mean / PI, standard_error: standard_error.map(|error| error / PI) }
}

/// The sum of what weighted photons score, per band and sum over bands. Where n - 1 independent x
/// lie within the n-th, the variance of their sum / area is on average the sum of (x / area)^2; the
/// photons of one history are one x.
fn sum(
    scene: &Scene,
    map: &PhotonMap,
    mut photons: Vec<(usize, f64)>,
    score: impl Fn(usize, f64, &mut [f64]),
) -> Vec<Estimate> {
    let history = |(photon, _): &(usize, f64)| map.photons[*photon].history;
    photons.sort_by_key(history);
    let mut one = vec![0.0; scene.bands.len()];
    let mut sums = vec![0.0; one.len() + scene.sums.len()];
    let mut squares = sums.clone();
    for photons in photons.chunk_by(|a, b| history(a) == history(b)) {
        one.fill(0.0);
        photons.iter().for_each(|(photon, weight)| score(*photon, *weight, &mut one));
        for ((sum, square), x) in sums.iter_mut().zip(&mut squares).zip(scene.with_sums(&one)) {
            *sum += x;
            *square += x * x;
        }
    }
    let estimate = |(mean, square): (f64, f64)| {
        let known = photons.len() > 1 && mean > 0.0;
        Estimate { mean, standard_error: known.then(|| square.sqrt()) }
    };
    sums.into_iter().zip(squares).map(estimate).collect()
}

/// The point of the captor nearest to its area centroid.
fn middle(scene: &Scene, captor: &Captor) -> Vec3 {
    let center = (captor.center - scene.center).as_vec3();
    let distance = |p: &Vec3| p.distance_squared(center);
    scene
        .triangles_of(captor)
        .iter()
        .map(|triangle| triangle.nearest_point(center))
        .min_by(|p, q| distance(p).total_cmp(&distance(q)))
        .unwrap_or(center)
}

/// The photons on a face nearest to `query`, and the area of the captor that they fell on.
fn gather(
    scene: &Scene,
    map: &PhotonMap,
    captor: &Captor,
    face: Channel,
    query: Vec3,
    k: Option<usize>,
) -> Option<Gathered> {
    if face as usize >= captor.kind.channels() {
        return None;
    }
    let bin = (captor.first_channel + face as usize) as u32;
    let k = k.unwrap_or_else(|| chosen_k(map.count(bin), map.histories_on(bin)));
    let triangles = scene.triangles_of(captor);
    map.gather(bin, query, k, captor.area, |radius| {
        triangles.iter().map(|t| f64::from(t.area_in_ball(query, radius))).sum()
    })
}

/// Distance of the captor's farthest point, m.
fn reach(scene: &Scene, captor: &Captor, query: Vec3) -> f32 {
    let corners = scene.triangles_of(captor).iter().flat_map(|t| [t.a, t.b, t.c]);
    corners.map(|p| p.distance(query)).fold(0.0, f32::max)
}

/// Radiance along the mean normal of `face`: reflected from its own photons, transmitted from
/// those of the other face.
fn radiance<L: Lanes>(
    scene: &Scene,
    map: &PhotonMap,
    captor: &Captor,
    gathered: &[Option<Gathered>; 2],
    face: Channel,
) -> Option<Vec<Estimate>> {
    let diffuse = captor.triangles.clone().all(|t| scene.material(scene.surface(t)).is_diffuse());
    let normal = captor.normal.as_vec3();
    if !diffuse || normal == Vec3::ZERO {
        return None;
    }
    let outgoing = if face == Channel::Front { normal } else { -normal };
    let photons = gathered.iter().flatten().flat_map(weighted).collect();
    Some(sum(scene, map, photons, |photon, weight, into| {
        let stored = &map.photons[photon];
        let surface = scene.surface(stored.triangle as usize);
        let interaction = Interaction::new(stored.direction.unpack(), surface.normal)
            .on(stored.triangle as usize);
        // what leaves the other side of a bent leaf is not seen from this face
        let leaves_front = outgoing.dot(surface.normal) > 0.0;
        if leaves_front != (face == Channel::Front) {
            return;
        }
        let f: Spectrum<L> = scene.material(surface).evaluate(&interaction, outgoing);
        for ((sum, f), power) in into.iter_mut().zip(f.values()).zip(map.power(photon)) {
            *sum += f64::from(*f) * f64::from(*power) * weight;
        }
    }))
}
