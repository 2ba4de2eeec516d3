//! The k-nearest estimate: irradiance and radiance at a captor's middle from the photons stored
//! there (Jensen, Realistic Image Synthesis Using Photon Mapping, 2001, ch. 7). Biased by the
//! size of the gather disc, consistent as photons grow.

use std::f64::consts::PI;

use glam::Vec3;

use crate::{
    captor::{Captor, CaptorKind, Channel},
    material::Encounter,
    photon_map::{Neighbour, PhotonMap},
    scene::Scene,
    spectrum::{Spectrum, with_lanes},
};

#[cfg(test)]
mod tests;

/// What the k nearest photons of one face say.
#[derive(Clone, Debug, PartialEq)]
pub struct NearestEstimate {
    /// Photons gathered: the asked-for k, or all there are.
    pub k: usize,
    /// Distance of the k-th photon, m; with fewer than k, of the captor's farthest point.
    pub radius: f64,
    /// Share of the captor's area that it is a mean over, in (0, 1].
    pub coverage: f64,
    /// Per band, W/m2 or umol/m2/s.
    pub irradiance: Vec<f64>,
    /// Sent along the face's mean normal by scattering that is no mirror, per band, W/m2/sr or
    /// umol/m2/s/sr; none where the surface has no such scattering or no mean normal.
    pub radiance: Option<Vec<f64>>,
}

/// The photons that count at one face, and the area that they fell on.
struct Gathered {
    photons: Vec<Neighbour>,
    found: usize,
    radius: f64,
    area: f64,
}

/// The estimates for a captor, front then back; none for a face that no photon has reached.
pub fn estimate(
    scene: &Scene,
    map: &PhotonMap,
    captor: &Captor,
    k: usize,
) -> [Option<NearestEstimate>; 2] {
    let query = middle(scene, captor);
    let faces = [Channel::Front, Channel::Back];
    let gathered = faces.map(|face| gather(scene, map, captor, face, query, k));
    let radiance = |face| match captor.kind {
        CaptorKind::Virtual { .. } => None,
        CaptorKind::Surface => {
            with_lanes!(scene.lanes(), N => radiance::<N>(scene, map, captor, &gathered, face))
        }
    };
    faces.map(|face| {
        let gathered = gathered[face as usize].as_ref()?;
        let bands = scene.bands.len();
        let mut irradiance = vec![0.0; bands];
        for photon in &gathered.photons {
            let power = map.power(photon.index);
            irradiance.iter_mut().zip(power).for_each(|(sum, p)| *sum += f64::from(*p));
        }
        let scale = 1.0 / (gathered.area * map.histories as f64);
        irradiance.iter_mut().for_each(|e| *e *= scale);
        let radiance = match captor.kind {
            CaptorKind::Virtual { .. } => Some(irradiance.iter().map(|e| e / PI).collect()),
            CaptorKind::Surface => radiance(face),
        };
        let Gathered { found: k, radius, area, .. } = *gathered;
        let coverage = (area / captor.area).min(1.0);
        Some(NearestEstimate { k, radius, coverage, irradiance, radiance })
    })
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

/// The k-1 photons nearer than the k-th, and the captor's area inside the ball that it spans;
/// with fewer photons than k all of them, and the whole area.
fn gather(
    scene: &Scene,
    map: &PhotonMap,
    captor: &Captor,
    face: Channel,
    query: Vec3,
    k: usize,
) -> Option<Gathered> {
    if face as usize >= captor.kind.channels() {
        return None;
    }
    let shelf = (captor.first_channel + face as usize) as u32;
    let mut photons = map.nearest(shelf, query, k);
    let triangles = scene.triangles_of(captor);
    let found = photons.len();
    if found == 0 {
        return None;
    }
    if found < k {
        let corners = triangles.iter().flat_map(|t| [t.a, t.b, t.c]);
        let radius = corners.map(|p| p.distance(query)).fold(0.0, f32::max);
        return Some(Gathered { photons, found, radius: f64::from(radius), area: captor.area });
    }
    let radius = photons.pop()?.distance2.sqrt();
    let area = triangles.iter().map(|t| f64::from(t.area_in_ball(query, radius))).sum::<f64>();
    (area > 0.0).then_some(Gathered { photons, found, radius: f64::from(radius), area })
}

/// Radiance along the mean normal of `face`: reflected from its own photons, transmitted from
/// those of the other face.
fn radiance<const N: usize>(
    scene: &Scene,
    map: &PhotonMap,
    captor: &Captor,
    gathered: &[Option<Gathered>; 2],
    face: Channel,
) -> Option<Vec<f64>> {
    let diffuse = captor.triangles.clone().all(|t| scene.material(scene.surface(t)).is_diffuse());
    let normal = captor.normal.as_vec3();
    if !diffuse || normal == Vec3::ZERO {
        return None;
    }
    let outgoing = if face == Channel::Front { normal } else { -normal };
    let mut radiance = vec![0.0; scene.bands.len()];
    for side in gathered.iter().flatten() {
        let scale = 1.0 / (side.area * map.histories as f64);
        for photon in &side.photons {
            let arrival = &map.arrivals[photon.index];
            let surface = scene.surface(arrival.triangle as usize);
            let encounter = Encounter::new(arrival.direction, surface.normal);
            // what leaves the other side of a bent leaf is not seen from this face
            let leaves_front = outgoing.dot(surface.normal) > 0.0;
            if leaves_front != (face == Channel::Front) {
                continue;
            }
            let f: Spectrum<N> = scene.material(surface).evaluate(&encounter, outgoing);
            let power = map.power(photon.index);
            for (b, sum) in radiance.iter_mut().enumerate() {
                *sum += f64::from(f.0[b]) * f64::from(power[b]) * scale;
            }
        }
    }
    Some(radiance)
}
