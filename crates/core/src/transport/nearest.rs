//! The k-nearest estimate: irradiance and radiance at the middle of a captor, from the photons
//! stored nearest to it, each with equal weight (Jensen, Realistic Image Synthesis Using Photon
//! Mapping, 2001, ch. 7). The estimate is biased, because it is a mean over the gather disc; with
//! the default k it is consistent as the number of photons grows.

use std::f64::consts::PI;

use glam::Vec3;

use crate::{
    math::{
        geometry::{ROUNDING, Triangle},
        spectrum::{Lanes, Spectrum, with_lanes},
        stats::Estimate,
    },
    scene::{
        captor::{Captor, CaptorKind, Channel},
        material::{Interaction, Scatterer},
        world::Scene,
    },
    transport::photon_map::{Gathered, PhotonMap, Thinning, chosen_k},
};

#[cfg(test)]
mod tests;

/// The k-nearest estimates for one face of a captor. Standard errors are those of the noise alone;
/// they are `None` where fewer than two photons count, and where nothing arrived.
#[derive(Clone, Debug, PartialEq)]
pub struct NearestEstimate {
    /// Number of photons gathered: k, or all photons if there are fewer.
    pub k: usize,
    /// Distance of the k-th photon, m; with fewer than k photons, the distance of the captor's
    /// farthest point.
    pub radius: f64,
    /// Fraction of the captor's area over which the estimate is a mean, in (0, 1].
    pub coverage: f64,
    /// Irradiance per band, then per sum over bands, W/m2 or umol/m2/s.
    pub irradiance: Vec<Estimate>,
    /// Radiance along the mean normal of the face, by scattering other than mirror reflection, per
    /// band, then per sum, W/m2/sr or umol/m2/s/sr. `None` if the surface has no such scattering,
    /// or no mean normal.
    pub radiance: Option<Vec<Estimate>>,
}

/// Limit on the number of triangles of a captor that is a part of a copy which shares its triangles:
/// whole plants by the thousand would take long, and an estimate at one point says little of them.
const MOST_SHARED: usize = 256;

/// A captor lies in one plane if the sum of its area vectors is at least this share of its area, and
/// none of its corners is farther from the plane than this share of its size, the root of its area.
const AREA_IN_PLANE: f32 = 0.9999;
const OFF_PLANE: f32 = 0.01;

/// Returns the estimates for a captor, front then back; `None` for a face that no photon has
/// reached, for captors that do not [lie in one plane](is_flat), and for large captors of copies
/// that share their triangles. Without `k`, each face has a k of its own that depends on the photons
/// there.
pub fn estimate(
    scene: &Scene,
    map: &PhotonMap,
    captor: &Captor,
    k: Option<usize>,
) -> [Option<NearestEstimate>; 2] {
    if !has_estimate(scene, captor) {
        return [None, None];
    }
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

/// Returns whether any captor of a scene can have an estimate.
pub fn any_estimates(scene: &Scene) -> bool {
    scene.captors().iter().any(|captor| has_estimate(scene, captor))
}

/// Returns what the estimates, of which `k` may be given, use of what arrives at the captors of a scene.
pub fn thinning(scene: &Scene, k: Option<usize>) -> Thinning {
    let with_estimates = scene.captors().iter().filter(|captor| has_estimate(scene, captor));
    let middles = with_estimates.map(|captor| {
        let first = captor.first_channel;
        (first..first + captor.kind.faces().len(), middle(scene, captor))
    });
    Thinning::new(scene.channels(), middles, k)
}

fn has_estimate(scene: &Scene, captor: &Captor) -> bool {
    let is_shared =
        captor.kind == CaptorKind::Surface && captor.triangles.start >= scene.unshared();
    let is_large = is_shared && captor.triangles.len() > MOST_SHARED;
    match scene.round(captor) {
        Some(round) => round.normal.is_some(),
        None => !is_large && is_flat(&scene.triangles_of(captor)),
    }
}

/// Returns whether triangles lie in one plane and look to one side, but for rounding. Only then is the
/// light at one point also what the whole would get of even light: the fluence rate of a sphere is
/// four times the irradiance of one of its patches, and the halves of a folded leaf differ.
fn is_flat(triangles: &[Triangle]) -> bool {
    let corners = || triangles.iter().flat_map(|t| [t.a, t.b, t.c]);
    let Some(anchor) = corners().next() else { return false };
    // coordinates are rounded, those of a small captor far away by more than the limits
    let rounding = ROUNDING * corners().map(Vec3::length).fold(0.0, f32::max);
    let vectors = || triangles.iter().map(|t| 0.5 * t.cross());
    let (sum, area) = (vectors().sum::<Vec3>(), vectors().map(Vec3::length).sum::<f32>());
    let (size, normal) = (area.sqrt(), sum.normalize_or_zero());
    let blurred = rounding / size;
    let off = |corner: Vec3| normal.dot(corner - anchor).abs();
    sum.length() >= area * (AREA_IN_PLANE - blurred)
        && corners().all(|corner| off(corner) <= OFF_PLANE * size + 4.0 * rounding)
}

/// Returns the photons, each with the factor that turns its power into an irradiance, 1/m2.
fn weighted(gathered: &Gathered) -> impl Iterator<Item = (usize, f64)> {
    gathered.photons.iter().map(|photon| (photon.index, gathered.weight))
}

/// Returns the radiance of an ideal white Lambertian receiver.
fn white(irradiance: &Estimate) -> Estimate {
    let Estimate { mean, standard_error } = irradiance;
    Estimate { mean: mean / PI, standard_error: standard_error.map(|error| error / PI) }
}

/// Returns the sum of what weighted photons score, per band, then per sum over bands. Let n
/// independent scores x be sorted by distance. The variance of the sum of the first n - 1 of them,
/// over the area within the n-th, is on average the sum of (x / area)^2. All photons of one history
/// together make one x.
fn sum(
    scene: &Scene,
    map: &PhotonMap,
    mut photons: Vec<(usize, f64)>,
    score: impl Fn(usize, f64, &mut [f64]),
) -> Vec<Estimate> {
    let history = |(photon, _): &(usize, f64)| map.photons[*photon].history;
    photons.sort_by_key(history);
    let mut one = vec![0.0; scene.bands().len()];
    let mut sums = vec![0.0; one.len() + scene.sums().len()];
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

/// Returns the point of the captor nearest to its area centroid.
fn middle(scene: &Scene, captor: &Captor) -> Vec3 {
    let center = (captor.center - scene.center()).as_vec3();
    if scene.round(captor).is_some() {
        return center;
    }
    let distance = |p: &Vec3| p.distance_squared(center);
    scene
        .triangles_of(captor)
        .iter()
        .map(|triangle| triangle.nearest_point(center))
        .min_by(|p, q| distance(p).total_cmp(&distance(q)))
        .unwrap_or(center)
}

/// Returns the photons on a face that are nearest to `query`, and the area of the captor on which
/// they arrived.
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
    let k = k.unwrap_or_else(|| {
        let [photons, histories] = map.arrived(bin);
        chosen_k(photons, histories)
    });
    if let Some(round) = scene.round(captor) {
        // the query is the middle of the disc
        return map.gather(bin, query, k, captor.area, |radius| {
            PI * f64::from(radius).min(round.radius).powi(2)
        });
    }
    let triangles = scene.triangles_of(captor);
    map.gather(bin, query, k, captor.area, |radius| {
        triangles.iter().map(|t| f64::from(t.area_in_ball(query, radius))).sum()
    })
}

/// Returns the distance from `query` to the farthest point of the captor, m.
fn reach(scene: &Scene, captor: &Captor, query: Vec3) -> f32 {
    if let Some(round) = scene.round(captor) {
        return round.radius as f32;
    }
    let triangles = scene.triangles_of(captor);
    let corners = triangles.iter().flat_map(|t| [t.a, t.b, t.c]);
    corners.map(|p| p.distance(query)).fold(0.0, f32::max)
}

/// Returns the radiance along the mean normal of `face`: reflected from photons on this face, and
/// transmitted from photons on the other face. `None` if the surface does not scatter diffusely, or
/// has no mean normal.
fn radiance<L: Lanes>(
    scene: &Scene,
    map: &PhotonMap,
    captor: &Captor,
    gathered: &[Option<Gathered>; 2],
    face: Channel,
) -> Option<Vec<Estimate>> {
    let diffuse = captor.triangles.clone().all(|t| scene.material(&scene.surface(t)).is_diffuse());
    let normal = captor.normal.as_vec3();
    if !diffuse || normal == Vec3::ZERO {
        return None;
    }
    let outgoing = if face == Channel::Front { normal } else { -normal };
    let photons = gathered.iter().flatten().flat_map(weighted).collect();
    Some(sum(scene, map, photons, |photon, weight, into| {
        let stored = &map.photons[photon];
        let surface = &scene.surface(stored.triangle as usize);
        let interaction = Interaction::new(stored.direction.unpack(), surface.normal)
            .on(stored.triangle as usize);
        // light that leaves a bent leaf on its other side is not seen from this face
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
