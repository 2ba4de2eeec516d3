//! The objects of a scene one by one, and mistakes that are common where a model comes from another
//! program.

use std::collections::HashSet;

use glam::{DVec3, Vec3};
use serde::{Serialize, Serializer};

use super::{
    copies,
    inside::is_in,
    lamps,
    remarks::{Remarks, length, quoted},
};
use phylux_core::{
    math::geometry::{Extent, Ray, closeness},
    scene::{
        captor::{Captor, CaptorKind},
        light::Light,
        material::Scatterer,
        world::Scene,
    },
    transport::{
        settings::{Estimator, Guiding, NearestCount, PhotonCount, Settings, TimeLimit},
        simulate::{Control, simulate},
    },
};

/// An object may reach this many times as high as the highest lamp.
const TOO_HIGH: f32 = 3.0;
/// Fraction of a room's size by which an object may stick out of it.
const STICKS_OUT: f32 = 0.01;
/// Fraction of its own size by which an object that counts light may stick out, if that is less.
const OWN_PART: f32 = 0.05;
/// Fraction of a room's size by which any object may stick out, however small it is.
const FLUSH: f32 = 1e-3;
/// Number of rays that decide whether an object is a room.
const RAYS: usize = 200;
/// Number of rays that search a room for an opening through which a lamp may shine.
const MORE_RAYS: usize = 1 << 16;
/// Sensors with more triangles than this are not checked for being half inside an object.
const MOST_TRIANGLES: usize = 64;
/// Number of photons of the trial that looks for light on captors.
const TRIAL: u64 = 10_000;
/// With aimed flights, at least as many arrivals are expected as with this many times the photons.
const FLIGHTS: u64 = 16;
/// The trial ends after this time.
const LONGEST: f64 = 5.0;

/// An object, with all of its copies together.
#[derive(Clone, Debug, Serialize)]
pub struct ObjectSummary {
    /// Name of the object.
    #[serde(rename = "name")]
    pub object: String,
    /// Lowest coordinates, m.
    #[serde(serialize_with = "coordinates")]
    pub from: DVec3,
    /// Highest coordinates, m.
    #[serde(serialize_with = "coordinates")]
    pub to: DVec3,
    /// Height of the lowest and the highest point above the lowest point of all surfaces, m.
    pub height: [f64; 2],
    /// Fraction of the object's area whose front looks up, in [0, 1].
    pub facing_up: f64,
}

fn coordinates<S: Serializer>(point: &DVec3, serializer: S) -> Result<S::Ok, S::Error> {
    point.to_array().serialize(serializer)
}

/// An object's box, m from the scene's own origin, its area, and the part of the area that looks
/// up, m2.
#[derive(Clone, Copy)]
struct Piece {
    extent: Extent,
    area: f64,
    up: f64,
}

/// Returns the objects that have surfaces, with their indices.
fn pieces(scene: &Scene) -> Vec<(usize, Piece)> {
    let empty = Piece { extent: Extent::EMPTY, area: 0.0, up: 0.0 };
    let mut pieces = vec![empty; scene.objects().len()];
    let all = scene
        .standing()
        .into_iter()
        .flat_map(|standing| standing.triangles.map(move |triangle| (triangle, standing.area)));
    for (i, times) in all {
        let Some(object) = scene.object(i) else { continue };
        let (piece, triangle) = (&mut pieces[object], scene.triangles().at(i));
        piece.extent = piece.extent.join(Extent::of_triangles([triangle]));
        let area = f64::from(triangle.area()) * times;
        piece.area += area;
        piece.up += if triangle.normal().z > 0.0 { area } else { 0.0 };
    }
    for copy in scene.shared_copies() {
        if let Some(object) = scene.object(copy.first) {
            pieces[object].extent = pieces[object].extent.join(copy.extent);
        }
    }
    pieces.into_iter().enumerate().filter(|(_, piece)| piece.extent.min.is_finite()).collect()
}

/// Returns the summary of each object.
pub(super) fn objects(scene: &Scene) -> Vec<ObjectSummary> {
    let lowest = f64::from(scene.triangles().extent().min.z);
    let summary = |(object, piece): (usize, Piece)| {
        let Piece { extent, area, up } = piece;
        let height = [extent.min.z, extent.max.z].map(|z| f64::from(z) - lowest);
        ObjectSummary {
            object: scene.objects()[object].clone(),
            from: scene.center() + extent.min.as_dvec3(),
            to: scene.center() + extent.max.as_dvec3(),
            height,
            facing_up: if area > 0.0 { up / area } else { 0.0 },
        }
    };
    pieces(scene).into_iter().map(summary).collect()
}

/// Warns of common mistakes.
pub(super) fn check_slips(scene: &Scene, remarks: &mut Remarks) {
    let pieces = pieces(scene);
    let lamps: Vec<(&Light, Extent)> = scene
        .lights()
        .iter()
        .map(|light| (light, light.extent()))
        // daylight has no place
        .filter(|(_, extent)| extent.min.is_finite())
        .collect();
    // a cell of a scene that repeats is no room
    let room = room(scene, &pieces, &lamps).filter(|_| scene.lattice().is_none());
    check_heights(scene, &pieces, room, &lamps, remarks);
    if let Some(room) = room {
        check_room(scene, &pieces, room, &lamps, remarks);
    }
    copies::check_copies(scene, remarks);
    lamps::check_lamps(scene, room.map(|(room, _)| *room), remarks);
    check_captors_in_solids(scene, remarks);
    check_dark_captors(scene, remarks);
}

/// Returns the closed room that lamps or captors are in, if there is one. Only the largest object
/// can be a room; a closed object without any of them in it is a solid.
fn room<'a>(
    scene: &Scene,
    pieces: &'a [(usize, Piece)],
    lamps: &[(&Light, Extent)],
) -> Option<&'a (usize, Piece)> {
    let volume = |piece: &Piece| piece.extent.size().as_dvec3().element_product();
    let largest = pieces.iter().max_by(|a, b| volume(&a.1).total_cmp(&volume(&b.1)))?;
    let (object, Piece { extent, .. }) = largest;
    // some plants may be below the floor by mistake, but hardly all captors and all lamps
    let captors = scene.captors().iter().filter(|captor| !is_of(scene, captor, *object));
    let captors = captors.map(|captor| (captor.center - scene.center()).as_vec3());
    let mut middles = captors.chain(lamps.iter().map(|(_, lamp)| lamp.center()));
    let is_inside = |middle: Vec3| {
        !Extent::of([middle]).is_clear_of(extent, 0.0) && is_in(scene, middle, *object)
    };
    let is_room = is_closed(scene, *object, extent, RAYS) && middles.any(is_inside);
    is_room.then_some(largest)
}

/// Returns whether a captor is a part of an object.
fn is_of(scene: &Scene, captor: &Captor, object: usize) -> bool {
    captor.kind == CaptorKind::Surface && scene.object(captor.triangles.start) == Some(object)
}

/// Warns of objects far above the highest lamp, such as a plant of 15 m among lamps at 1 m.
fn check_heights(
    scene: &Scene,
    pieces: &[(usize, Piece)],
    room: Option<&(usize, Piece)>,
    lamps: &[(&Light, Extent)],
    remarks: &mut Remarks,
) {
    let lowest = scene.triangles().extent().min.z;
    let highest = lamps.iter().map(|(_, extent)| extent.max.z - lowest).fold(0.0, f32::max);
    let is_room = |object: usize| room.is_some_and(|(room, _)| *room == object);
    let too_high = pieces.iter().filter(|(object, piece)| {
        let reaches = piece.extent.max.z - lowest;
        highest > 0.0 && reaches > TOO_HIGH * highest && !is_room(*object)
    });
    let named = too_high.map(|(object, piece)| {
        let top = f64::from(piece.extent.max.z - lowest);
        format!("`{}` ({})", scene.objects()[*object], length(top))
    });
    remarks.warn_of(named, |list| {
        format!(
            "objects that reach far above the highest lamp, which is {} high: {list}; check their `scale` (a model in \
            centimetres needs 0.01) and `up`",
            length(highest.into())
        )
    });
}

/// Warns of objects that reach through the walls of a closed room, and of captors and lamps outside
/// it.
fn check_room(
    scene: &Scene,
    pieces: &[(usize, Piece)],
    (room, Piece { extent, .. }): &(usize, Piece),
    lamps: &[(&Light, Extent)],
    remarks: &mut Remarks,
) {
    let largest = extent.size().max_element();
    let sticks_out = |object: usize, other: &Extent| {
        let most = Vec3::splat(STICKS_OUT * largest);
        // of a low plant a small part under the floor is much
        let slack = match scene.captors().iter().any(|captor| is_of(scene, captor, object)) {
            true => most.min(OWN_PART * other.size()).max(Vec3::splat(FLUSH * largest)),
            false => most,
        };
        let low = other.min.cmplt(extent.min - slack);
        (low | other.max.cmpgt(extent.max + slack)).any()
    };
    let name = &scene.objects()[*room];
    let through = pieces.iter().filter(|(object, piece)| {
        object != room
            && sticks_out(*object, &piece.extent)
            && !piece.extent.is_clear_of(extent, 0.0)
    });
    remarks.warn_of(quoted(through.map(|(object, _)| &scene.objects()[*object])), |list| {
        format!(
            "objects that reach through the walls of `{name}`: {list}; check their `scale` and \
            `translate`"
        )
    });
    let outside =
        || lamps.iter().filter(|(_, lamp)| lamp.is_clear_of(extent, STICKS_OUT * largest));
    // where a lamp or daylight is outside, captors may be there as well
    let all_inside = lamps.len() == scene.lights().len() && outside().next().is_none();
    let lost = || {
        let captors = scene.captors().iter().filter(|captor| {
            let middle = (captor.center - scene.center()).as_vec3();
            Extent::of([middle]).is_clear_of(extent, closeness(middle))
        });
        captors.filter(|captor| all_inside && !is_of(scene, captor, *room)).map(|captor| &captor.id)
    };
    let any = outside().next().is_some() || lost().next().is_some();
    if !any || !is_closed(scene, *room, extent, MORE_RAYS) {
        return;
    }
    remarks.warn_of(quoted(lost()), |list| {
        format!(
            "captors outside the closed room `{name}`: {list}; no light of the lamps in it comes to them; \
            check the `scale`, `translate` and `up` of their objects"
        )
    });
    remarks.warn_of(quoted(outside().map(|(light, _)| &light.name)), |list| {
        format!(
            "lights outside the closed room `{name}`: {list}; none of {MORE_RAYS} rays from its middle finds an \
            opening for their light; check their position"
        )
    });
}

/// Returns whether an object keeps light in and out: each of this number of rays from its middle
/// meets the object, at a place where nothing goes through.
fn is_closed(scene: &Scene, object: usize, extent: &Extent, rays: usize) -> bool {
    let turn = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..rays).all(|i| {
        // directions on a spiral of equal areas on the sphere
        let z = 1.0 - (2 * i + 1) as f32 / rays as f32;
        let (sin, cos) = (turn * i as f64).sin_cos();
        let [sin, cos] = [sin as f32, cos as f32];
        let direction = Vec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z;
        let mut ray = Ray { origin: extent.center(), direction };
        // rays go on through other objects in the room
        for _ in 0..100 {
            let Some(hit) = scene.closest(&ray) else { return false };
            if scene.object(hit.triangle) == Some(object) {
                let material = scene.material(&scene.surface(hit.triangle));
                return !material.is_clear() && !material.transmits_diffusely();
            }
            ray = scene.pass(&hit, direction);
        }
        true
    })
}

/// Warns of sensors that are half inside a closed object: a corner is hidden from the middle, and
/// only one of the two lies in the object.
fn check_captors_in_solids(scene: &Scene, remarks: &mut Remarks) {
    let in_surface: HashSet<usize> = scene.captors_in_surfaces().iter().copied().collect();
    let is_half_inside = |captor: &Captor| {
        let middle = (captor.center - scene.center()).as_vec3();
        let offset = 2.0 * closeness(middle);
        let is_inside = |corner: Vec3| {
            let (way, far) = (corner - middle, corner.distance(middle));
            let ray = Ray { origin: middle, direction: way.normalize_or_zero() };
            let hit = if far > 2.0 * offset { scene.closest(&ray) } else { None };
            hit.filter(|hit| hit.t < far - offset)
                .and_then(|hit| scene.object(hit.triangle))
                .is_some_and(|object| is_in(scene, corner, object) != is_in(scene, middle, object))
        };
        scene.triangles_of(captor).iter().any(|t| [t.a, t.b].into_iter().any(is_inside))
    };
    let flat = scene.captors().iter().enumerate().filter(|(index, captor)| {
        let virtual_kind = matches!(captor.kind, CaptorKind::Virtual { .. });
        let few = captor.triangles.len() <= MOST_TRIANGLES;
        virtual_kind && few && captor.normal != DVec3::ZERO && !in_surface.contains(index)
    });
    let cut = flat.filter(|(_, captor)| is_half_inside(captor));
    remarks.warn_of(quoted(cut.map(|(_, captor)| &captor.id)), |list| {
        format!("captors that are half inside an object: {list}; move them off it")
    });
}

/// Warns if no photon of a trial comes to any captor, although many would if they flew in all
/// directions alike.
fn check_dark_captors(scene: &Scene, remarks: &mut Remarks) {
    let lit = scene.lights().iter().any(|light| light.power.iter().any(|power| *power > 0.0));
    let around = scene.triangles().extent();
    let around = around.join(scene.captors_extent());
    let areas: f64 = scene.captors().iter().map(|captor| captor.area).sum();
    let expected = (TRIAL * FLIGHTS) as f64 * areas / f64::from(2.0 * around.half_area());
    if !lit || expected.is_nan() || expected < lamps::EXPECTED || scene.sources() as u64 > TRIAL {
        return;
    }
    let settings = Settings {
        estimator: Estimator::Photons,
        photons: Some(PhotonCount::nearest_to(TRIAL)),
        k: Some(NearestCount::NONE),
        guiding: Guiding::Aim,
        max_time: TimeLimit::new(LONGEST).ok(),
        ..Settings::default()
    };
    let control = Control::default();
    // a scene that is too large for a trial is no mistake
    let Ok(simulation) = simulate(scene, &settings, &control) else { return };
    let totals = simulation.totals();
    let channels = scene.captors().iter().map(|c| (c.first_channel, c.channels()));
    let mut channels = channels.flat_map(|(first, count)| first..first + count);
    if channels.all(|channel| totals.photons(channel) == 0) {
        let photons = totals.histories;
        remarks.warnings.push(format!(
            "of {photons} photons none came to any captor; check which way their normals point, \
            where the lamps are, and what stands between"
        ));
    }
}
