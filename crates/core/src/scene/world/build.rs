//! Builds a scene from its parts, with all checks.

use std::{
    collections::{BTreeMap, HashMap},
    mem,
    ops::Range,
    sync::OnceLock,
};

use glam::{DVec3, Vec3};

use super::{
    CaptorPart, CopyPart, LightPart, Lighting, NO_CAPTOR, NamedMaterial, ObjectCopy, Scene,
    SceneParts, SharedPart, Surface, SurfacePart,
    contents::{Common, Head, Objects, Place},
    flush,
    images::LightShapes,
    mirrors::FlatMirrors,
    shapes::{KeptShapes, Outlines},
    validate::check_images,
};
use crate::{
    error::{Checked, Error, NO_THREADS, Result, number},
    math::{
        geometry::{Extent, ROUNDING, Triangle, across, area, closeness},
        round::Round,
        spectrum::lanes,
    },
    scene::{
        captor::{Captor, CaptorKind, Moments},
        instances::Placed,
        lattice::{Images, Lattice, Layers, Repeats},
        light::{Light, MARGIN, Prism},
        material::Scatterer,
        parameter::Parameters,
        stand::{Heights, LayerBins, Stand},
    },
};

impl Scene {
    /// Checks the parts and builds the scene, on threads of its own. Errors: no light; no or too
    /// many bands; lists that do not have one number for each band; numbers that are not finite or
    /// out of range; fractions whose sum is above 1; indices of things that do not exist; duplicate
    /// names; a light or captor without extent; an extent that single precision cannot represent.
    pub fn new(parts: SceneParts) -> Result<Self> {
        Self::with_kept(parts, &KeptShapes::default())
    }

    /// Works like [`new`](Self::new), but reuses the shapes kept from other scenes where the
    /// triangles are the same.
    pub fn with_kept(parts: SceneParts, kept: &KeptShapes) -> Result<Self> {
        let pool = rayon::ThreadPoolBuilder::new().build();
        pool.map_err(|e| Error::run("threads", e).remedy(NO_THREADS))?
            .install(|| Self::build(parts, kept))
    }

    fn build(mut parts: SceneParts, kept: &KeptShapes) -> Result<Self> {
        let name = parts.name.clone();
        let place = || format!("scene {name}");
        parts.validate(&place())?;
        let bounds = Bounds::checked(&parts, place())?;
        let center = working_center(&parts).unwrap_or_else(|| bounds.center());
        let radius = bounds.radius() as f32;
        let local = |t: &[DVec3; 3]| Triangle::from(t.map(|p| (p - center).as_vec3()));
        let periods = parts.lattice.map(|lattice| Periods::of(lattice, &parts, center));
        if let Some(Periods { own, layers, .. }) = &periods {
            check_images(&parts, own, layers.slack).map_err(|problem| problem.at(place()))?;
        }
        parts.lights.iter().try_for_each(|light| check_light(light, local))?;
        let geometry = Geometry::of(&mut parts, center, periods, place)?;
        let Geometry { outlines, captors, runs, tangents, object_parts, copies, common, stand } =
            geometry;
        let inside = inside(&outlines);
        let bands = parts.bands.len();
        let made = |LightPart { name, source }: LightPart| {
            Light::new(name, source, bands, center, &inside)
        };
        let mut lights: Vec<Light> = parts.lights.into_iter().map(made).collect();
        if let Some(repeats) = &outlines.repeats {
            lights.iter_mut().for_each(|light| light.bring_into_cell(&repeats.lattice));
        }
        let light_shapes = LightShapes::of(&lights, outlines.repeats.as_deref());
        let lanes = lanes(bands);
        let place_material = |(named, tangents): (NamedMaterial, _)| NamedMaterial {
            material: named.material.placed(lanes, tangents),
            ..named
        };
        let materials: Vec<NamedMaterial> =
            parts.materials.into_iter().zip(tangents).map(place_material).collect();
        let is_periodic = outlines.repeats.is_some();
        let shapes = kept.shapes(outlines);
        // after the search structures, whose making needs the most memory
        let surfaces = surfaces_of(runs, &shapes.triangles, is_periodic);
        let flush_lights =
            flush::lift(&mut lights, &shapes, (bounds.center() - center).as_vec3(), radius);
        // images without end are not searched
        let margin = MARGIN * closeness(Vec3::splat(radius));
        let find = || FlatMirrors::find(&lights, &shapes.triangles, &surfaces, &materials, margin);
        let flat_mirrors = (!is_periodic).then(find).flatten();
        let lighting = Lighting::new(
            lights,
            parts.watts,
            light_shapes,
            flush_lights,
            flat_mirrors,
            is_periodic,
        );
        let head = Head {
            name: parts.name,
            quantity: parts.quantity,
            period_h: parts.period_h,
            bands: parts.bands,
            sums: parts.sums,
            ratios: parts.ratios,
        };
        Ok(Self {
            head,
            asked: parts.asked,
            parameters: Parameters::new(parts.parameters, materials.len(), lighting.lights.len()),
            materials,
            objects: Objects {
                names: parts.objects,
                parts: object_parts,
                copies,
                surfaces,
                common,
            },
            lighting,
            captors,
            groups: parts.groups,
            place: Place { center, radius, inside, stand },
            shapes,
        })
    }
}

/// What a scene is made of besides lights and materials.
struct Geometry {
    outlines: Outlines,
    captors: Vec<Captor>,
    /// For each part of the surfaces its number of triangles, its material and its captor.
    runs: Vec<(usize, usize, Option<usize>)>,
    /// For each material the triangles that have a tangent, with this.
    tangents: Vec<Vec<(u32, Vec3)>>,
    /// For each part its first triangle, and its object.
    object_parts: Vec<(usize, Option<usize>)>,
    copies: Vec<ObjectCopy>,
    common: Vec<Common>,
    stand: Stand,
}

impl Geometry {
    /// Takes surfaces, captors and copies out of the parts of a scene. Errors: those of captors and of
    /// layers.
    fn of(
        parts: &mut SceneParts,
        center: DVec3,
        periods: Option<Periods>,
        place: impl Fn() -> String,
    ) -> Result<Self> {
        let local = |t: &[DVec3; 3]| Triangle::from(t.map(|p| (p - center).as_vec3()));
        let of_captor = |captor: &CaptorPart| captor.sensor.round.map(|round| round.moved(-center));
        let rounds: Vec<Round> = parts.captors.iter().filter_map(of_captor).collect();
        let objects: Vec<Option<usize>> = parts.surfaces.iter().map(|part| part.object).collect();
        let mut surfaces: Vec<(usize, SurfacePart)> =
            mem::take(&mut parts.surfaces).into_iter().enumerate().collect();
        // the triangles of a captor become contiguous, whatever the order of the files
        surfaces.sort_by_key(|(_, part)| part.captor);
        // shapes that repeat need their exact corners once more
        let repeats = periods
            .map(|periods| Box::new(periods.repeats(&surfaces, &parts.captors, &rounds, local)));
        // shared copies that are none take no place
        let is_any = |part: &SharedPart| !part.transforms.is_empty() && part.triangles() > 0;
        parts.shared.retain(is_any);
        parts.shared.iter_mut().for_each(|part| part.surfaces.sort_by_key(|of| of.captor));
        let stand = stand_of(parts, &surfaces, &place)?;
        let own = OwnSurfaces::of(&surfaces, &parts.tangents, parts.materials.len(), local);
        let OwnSurfaces { triangles, runs, tangents, object_parts, of_part, mut found } = own;
        // before the search structures need memory
        drop(surfaces);
        let copies = copies(mem::take(&mut parts.copies), &of_part, &objects);
        let mut placed = Placed::new(center);
        let shared = mem::take(&mut parts.shared);
        let common = common(shared, &mut placed, triangles.len(), &mut found);
        let (sensors, by_face) = (mem::take(&mut parts.captors), parts.asked.absorbed_by_face);
        let captors = Captors::of(sensors, &mut found, by_face, center, place)?;
        let Captors { captors, triangles: captor_triangles, of_triangle: captor_of_triangle } =
            captors;
        let outlines =
            Outlines { triangles, captor_triangles, rounds, captor_of_triangle, repeats, placed };
        Ok(Self { outlines, captors, runs, tangents, object_parts, copies, common, stand })
    }
}

/// The periods of a scene that repeats, and where it holds anything.
struct Periods {
    own: Lattice,
    /// The same, relative to the centre of the scene.
    lattice: Lattice,
    layers: Layers,
}

impl Periods {
    fn of(own: Lattice, parts: &SceneParts, center: DVec3) -> Self {
        let lattice = own.relative_to(center);
        let layers = Layers::new(&lattice, |visit| each_piece(parts, center, visit));
        let layers = match layers.range() {
            Some(_) => layers,
            None => Layers::new(&lattice, |visit| visit(&[DVec3::ZERO])),
        };
        Self { own, lattice, layers }
    }

    /// Adds the images of surfaces, which are sorted by captor, and of sensors.
    fn repeats(
        self,
        surfaces: &[(usize, SurfacePart)],
        captors: &[CaptorPart],
        rounds: &[Round],
        local: impl Fn(&[DVec3; 3]) -> Triangle,
    ) -> Repeats {
        let Self { own, lattice, layers } = self;
        let surfaces = surfaces.iter().flat_map(|(_, part)| &part.triangles);
        let surfaces = Images::new(&own, layers.slack, false, surfaces, &local);
        let captors = captors.iter().flat_map(|captor| &captor.triangles);
        let captors = Images::new(&own, layers.slack, true, captors, &local);
        let rounds = Images::of_rounds(&lattice, layers.slack, rounds);
        Repeats { lattice, layers, surfaces, captors, rounds }
    }
}

/// The surfaces with triangles of their own, which are sorted by captor.
struct OwnSurfaces {
    triangles: Vec<Triangle>,
    /// For each part its number of triangles, its material and its captor.
    runs: Vec<(usize, usize, Option<usize>)>,
    /// For each material the triangles that have a tangent, with this.
    tangents: Vec<Vec<(u32, Vec3)>>,
    /// For each part its first triangle, and its object.
    object_parts: Vec<(usize, Option<usize>)>,
    /// The triangles of each part, in the order of the parts of the scene.
    of_part: Vec<Range<usize>>,
    /// The moments and the triangles of captors that are surfaces.
    found: Found,
}

/// Moments and triangles by captor.
type Found = HashMap<usize, (Moments, Range<usize>)>;

impl OwnSurfaces {
    fn of(
        parts: &[(usize, SurfacePart)],
        tangents_of: &BTreeMap<usize, Vec<DVec3>>,
        materials: usize,
        local: impl Fn(&[DVec3; 3]) -> Triangle,
    ) -> Self {
        let all = parts.iter().map(|(_, part)| part.triangles.len()).sum();
        let mut triangles = Vec::with_capacity(all);
        let mut runs = Vec::with_capacity(parts.len());
        let mut tangents = vec![Vec::new(); materials];
        let mut object_parts = Vec::with_capacity(parts.len());
        let mut of_part = vec![0..0; parts.len()];
        let mut found = Found::new();
        let mut first = 0;
        for own in parts.chunk_by(|(_, a), (_, b)| a.captor == b.captor) {
            let corners = || own.iter().flat_map(|(_, part)| &part.triangles);
            let range =
                first..first + own.iter().map(|(_, part)| part.triangles.len()).sum::<usize>();
            first = range.end;
            if let Some(captor) = own[0].1.captor {
                found.insert(captor, (Moments::of(corners()), range));
            }
        }
        for (index, part) in parts {
            object_parts.push((triangles.len(), part.object));
            for (i, tangent) in tangents_of.get(index).into_iter().flatten().enumerate() {
                tangents[part.material].push(((triangles.len() + i) as u32, tangent.as_vec3()));
            }
            triangles.extend(part.triangles.iter().map(&local));
            runs.push((part.triangles.len(), part.material, part.captor));
            of_part[*index] = triangles.len() - part.triangles.len()..triangles.len();
        }
        Self { triangles, runs, tangents, object_parts, of_part, found }
    }
}

/// Returns what copies that share their triangles have in common, and places them: the first of their
/// triangles has the index `first`.
fn common(
    shared: Vec<SharedPart>,
    placed: &mut Placed,
    mut first: usize,
    found: &mut Found,
) -> Vec<Common> {
    let mut common = Vec::with_capacity(shared.len());
    for part in shared {
        let corners = || part.surfaces.iter().flat_map(|surface| &surface.triangles);
        placed.add(corners(), &part.transforms, first);
        add_captors(&part, first, found);
        let prototype = &placed.prototypes[common.len()];
        first += prototype.triangles.len() * part.transforms.len();
        let mut own = prototype.triangles.iter();
        let surfaces = part.surfaces.iter().flat_map(|surface| {
            let triangles = own.by_ref().take(surface.triangles.len());
            let of = |t| surface_of(t, surface.material, surface.captor);
            triangles.map(of).collect::<Vec<Surface>>()
        });
        common.push(Common {
            surfaces: surfaces.collect(),
            object: part.object,
            first_captor: part.first_captor,
            captors: part.captors,
            areas: (0..part.captors).map(|_| OnceLock::new()).collect(),
        });
    }
    common
}

/// The captors, and the triangles of those that are sensors.
struct Captors {
    captors: Vec<Captor>,
    triangles: Vec<Triangle>,
    /// The captor of each triangle and then of each disc and sphere.
    of_triangle: Vec<u32>,
}

impl Captors {
    /// Takes what surfaces are found to be, and adds the sensors. Errors: a captor without area, or one that
    /// single precision cannot represent.
    fn of(
        parts: Vec<CaptorPart>,
        found: &mut Found,
        absorbed_by_face: bool,
        center: DVec3,
        place: impl Fn() -> String,
    ) -> Result<Self> {
        let local = |t: &[DVec3; 3]| Triangle::from(t.map(|p| (p - center).as_vec3()));
        let mut captors: Vec<Captor> = Vec::with_capacity(parts.len());
        let (mut triangles, mut of_triangle) = (Vec::new(), Vec::new());
        let mut of_round = Vec::new();
        // discs and spheres come after all triangles
        let first_round: usize = parts.iter().map(|captor| captor.triangles.len()).sum();
        for (index, part) in parts.into_iter().enumerate() {
            let (corners, first) = match part.kind {
                CaptorKind::Surface => (Vec::new(), 0),
                CaptorKind::Virtual { .. } => (part.triangles, triangles.len()),
            };
            let own = || match &part.sensor.round {
                Some(round) => {
                    let first = first_round + of_round.len();
                    (Moments::from(round), first..first + 1)
                }
                None => (Moments::of(&corners), first..first + corners.len()),
            };
            let (moments, range) = found.remove(&index).unwrap_or_else(own);
            let Moments { area, center: middle, normal } = moments;
            if area <= 0.0 {
                return Err(Error::input(place(), format!("captor `{}` has no area", part.id))
                    .remedy("leave it out, or correct its corners"));
            }
            let area = if part.sensor.is_sphere { 0.25 * area } else { area };
            if let Some(round) = &part.sensor.round {
                check_radius(&part.id, round, center)?;
                of_round.push(index as u32);
            } else if let CaptorKind::Virtual { .. } = part.kind {
                check_rounding(("captor", &part.id), &corners, 0.001, local)?;
                triangles.extend(corners.iter().map(local));
                of_triangle.resize(triangles.len(), index as u32);
            }
            let first_channel =
                captors.last().map_or(0, |c: &Captor| c.first_channel + c.channels());
            captors.push(Captor {
                id: part.id,
                kind: part.kind,
                area,
                center: middle,
                normal,
                triangles: range,
                first_channel,
                groups: part.groups,
                sensor: part.sensor,
                by_face: absorbed_by_face && part.kind == CaptorKind::Surface,
            });
        }
        of_triangle.extend(of_round);
        Ok(Self { captors, triangles, of_triangle })
    }
}

/// Returns a prism around all that photons may meet: triangles of surfaces and of sensors, discs and
/// spheres, and boxes around copies.
fn inside(outlines: &Outlines) -> Prism {
    let Outlines { triangles, captor_triangles, rounds, repeats, placed, .. } = outlines;
    let boxes = placed.boxes();
    let around = Extent::of_triangles(triangles).join(Extent::of_triangles(captor_triangles));
    let around = rounds.iter().map(Round::extent).fold(around, Extent::join);
    let around = boxes.iter().fold(around, |around, copy| around.join(*copy));
    let around = if around.min.is_finite() { around } else { Extent::of([Vec3::ZERO]) };
    let margin = MARGIN * closeness(around.min.abs().max(around.max.abs()));
    let around = Extent { min: around.min - margin, max: around.max + margin };
    let Some(repeats) = repeats else { return around.into() };
    let own = triangles.iter().chain(captor_triangles).flat_map(|t| [t.a, t.b, t.c]);
    let corners = own.chain(boxes.iter().flat_map(Extent::corners));
    let of_rounds = rounds.iter().map(Round::extent);
    let corners = corners.chain(of_rounds.flat_map(|extent| extent.corners()));
    Prism::of_cell(&repeats.lattice, &around, corners)
}

/// Returns what the balance and the layers of a stand of plants need. Error: too many layers.
fn stand_of(
    parts: &SceneParts,
    surfaces: &[(usize, SurfacePart)],
    place: impl Fn() -> String,
) -> Result<Stand> {
    let mut stand = Stand::default();
    if !parts.ground.is_empty() {
        stand.is_ground = vec![false; parts.objects.len()];
        parts.ground.iter().for_each(|&object| stand.is_ground[object] = true);
    }
    if let Some(dz) = parts.layers {
        let layers = layers_of(dz, surfaces, &parts.shared, &stand);
        stand.layers = Some(layers.map_err(|problem| problem.of("layers").at(place()))?);
    }
    stand.balances = parts.lattice.is_some_and(|lattice| lattice.area().is_some())
        && parts.lights.iter().all(|light| light.infinite().is_some());
    Ok(stand)
}

/// Makes layers of the height `dz`, m, for surfaces that are sorted by captor, those without one
/// first. Error: too many layers.
fn layers_of(
    dz: f64,
    surfaces: &[(usize, SurfacePart)],
    shared: &[SharedPart],
    stand: &Stand,
) -> Checked<LayerBins> {
    let counts = |object: Option<usize>| {
        object.is_none_or(|object| stand.is_ground.get(object) != Some(&true))
    };
    let heights_of = |corners: &[DVec3; 3]| corners.map(|corner| corner.z);
    let (others, captors) =
        surfaces.split_at(surfaces.partition_point(|(_, part)| part.captor.is_none()));
    let heights = Heights {
        first: others.iter().map(|(_, part)| part.triangles.len()).sum(),
        own: captors.iter().flat_map(|(_, part)| &part.triangles).map(heights_of).collect(),
        shared: shared.iter().map(SharedPart::heights).collect(),
    };
    let own = captors.iter().filter(|(_, part)| counts(part.object));
    let own = own.flat_map(|(_, part)| &part.triangles).map(|t| (heights_of(t), area(t)));
    let copies = shared.iter().filter(|part| counts(part.object)).flat_map(|part| {
        let of_captors = || part.surfaces.iter().filter(|of| of.captor.is_some());
        part.levels().into_iter().flat_map(move |(level, area_of_copies)| {
            let triangles = of_captors().flat_map(|of| &of.triangles);
            triangles.map(move |t| (level.heights(t), area_of_copies * area(t)))
        })
    });
    let of_own = captors.iter().flat_map(|(_, part)| {
        let counts = counts(part.object);
        part.triangles.iter().map(move |_| counts)
    });
    LayerBins::new(dz, own.chain(copies), heights, of_own)
}

/// Returns the properties of triangles, of which each run has one material and one captor.
fn surfaces_of(
    runs: Vec<(usize, usize, Option<usize>)>,
    triangles: &[Triangle],
    is_periodic: bool,
) -> Vec<Surface> {
    let mut surfaces: Vec<Surface> = Vec::with_capacity(triangles.len());
    for (count, material, captor) in runs {
        let run = &triangles[surfaces.len()..][..count];
        surfaces.extend(run.iter().map(|t| surface_of(t, material, captor)));
    }
    if is_periodic {
        // the corners of images are rounded where these are
        for (surface, triangle) in surfaces.iter_mut().zip(triangles) {
            surface.extra_offset = ROUNDING * across(surface.normal, triangle.reach());
        }
    }
    surfaces
}

/// Returns the properties of a triangle.
fn surface_of(triangle: &Triangle, material: usize, captor: Option<usize>) -> Surface {
    Surface {
        normal: triangle.normal(),
        material: material as u32,
        captor: captor.map_or(NO_CAPTOR, |captor| captor as u32),
        extra_offset: 0.0,
        steepest: (ROUNDING * triangle.slopes()).max_element(),
        reach: triangle.blur() / ROUNDING,
    }
}

/// Adds the moments and the triangles of the captors of copies that share their triangles, of which
/// the first has the index `first`. Surfaces are sorted by captor.
fn add_captors(part: &SharedPart, first: usize, found: &mut Found) {
    let each = part.triangles();
    let mut start = 0;
    for surfaces in part.surfaces.chunk_by(|a, b| a.captor == b.captor) {
        let corners: Vec<[DVec3; 3]> =
            surfaces.iter().flat_map(|surface| &surface.triangles).copied().collect();
        let own = start..start + corners.len();
        start = own.end;
        let Some(captor) = surfaces[0].captor else { continue };
        let moments = Moments::of(&corners);
        for (copy, transform) in part.transforms.iter().enumerate() {
            let range = first + copy * each + own.start..first + copy * each + own.end;
            let index = part.first_captor + copy * part.captors + captor;
            found.insert(index, (moments.placed(transform), range));
        }
    }
}

/// Returns the copies with their triangles. Triangles are sorted by captor, and a scene file numbers
/// captors copy by copy, so the triangles of each of its copies are contiguous. A program may number
/// them otherwise; a copy that is scattered is left out, and is displayed like any other surface.
fn copies(
    parts: Vec<CopyPart>,
    triangles: &[Range<usize>],
    objects: &[Option<usize>],
) -> Vec<ObjectCopy> {
    let copy = |part: CopyPart| {
        let ranges = triangles.get(part.surfaces.clone())?;
        let first = ranges.iter().map(|range| range.start).min()?;
        let end = ranges.iter().map(|range| range.end).max()?;
        let count: usize = ranges.iter().map(Range::len).sum();
        let object = *objects.get(part.surfaces.start)?;
        let (triangles, transform) = (first..end, part.transform);
        (count == triangles.len()).then_some(ObjectCopy { object, triangles, transform })
    };
    parts.into_iter().filter_map(copy).collect()
}

/// Returns the point that coordinates are relative to: the median of the middles of all captors'
/// triangles, discs and spheres or, without captors, of all surfaces' triangles, along each axis.
/// Single precision is finest there, whatever stands far away. `None` without any of these.
fn working_center(parts: &SceneParts) -> Option<DVec3> {
    // triangles without area do not count, as nowhere else
    let middle =
        |[a, b, c]: &[DVec3; 3]| ((b - a).cross(c - a) != DVec3::ZERO).then(|| (a + b + c) / 3.0);
    let surfaces = |captors: bool| {
        let of = parts.surfaces.iter().filter(move |part| part.captor.is_some() || !captors);
        of.flat_map(|part| &part.triangles).filter_map(middle)
    };
    let sensors = parts.captors.iter().flat_map(|captor| &captor.triangles).filter_map(middle);
    let rounds = parts.captors.iter().filter_map(|captor| Some(captor.sensor.round?.center));
    let mut middles: Vec<DVec3> = surfaces(true).chain(sensors).chain(rounds).collect();
    if middles.is_empty() {
        middles = surfaces(false).collect();
    }
    // a copy that shares its triangles counts once
    for shared in &parts.shared {
        let counts = shared.captors > 0 || parts.captors.is_empty();
        let boxes = shared.boxes().filter(|_| counts);
        middles.extend(boxes.map(|corners| corners.into_iter().sum::<DVec3>() / 8.0));
    }
    let (half, even) = (middles.len() / 2, middles.len().is_multiple_of(2));
    let mut median = |axis: usize| {
        let by_axis = |p: &DVec3, q: &DVec3| p[axis].total_cmp(&q[axis]);
        let (below, middle, _) = middles.select_nth_unstable_by(half, by_axis);
        let before = below.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max);
        // the mean of the two in the middle, if they are two
        if even { 0.5 * (before + middle[axis]) } else { middle[axis] }
    };
    (half > 0 || !even).then(|| DVec3::new(median(0), median(1), median(2)))
}

/// Visits the corners of each thing that rays may meet: triangles of surfaces and captors, what lamps
/// are made of, and boxes around discs, spheres and copies.
fn each_piece(parts: &SceneParts, center: DVec3, visit: &mut dyn FnMut(&[DVec3])) {
    let surfaces = parts.surfaces.iter().flat_map(|part| &part.triangles);
    let captors = parts.captors.iter().flat_map(|captor| &captor.triangles);
    let lamps =
        parts.lights.iter().filter_map(LightPart::lamp).flat_map(|lamp| lamp.outline().pieces());
    for corners in surfaces.chain(captors).copied().chain(lamps) {
        visit(&corners.map(|corner| corner - center));
    }
    let rounds = parts.captors.iter().filter_map(|captor| Some(captor.sensor.round?.corners()));
    for corners in parts.shared.iter().flat_map(SharedPart::boxes).chain(rounds) {
        visit(&corners.map(|corner| corner - center));
    }
}

/// Refuses an area light that is too small where it stands.
fn check_light(light: &LightPart, local: impl Fn(&[DVec3; 3]) -> Triangle) -> Result<()> {
    match light.triangles() {
        [] => Ok(()),
        triangles => check_rounding(("light", &light.name), triangles, 0.02, local),
    }
}

/// Refuses a shape that is so small where it stands that single precision changes its area, or the
/// area that it shows to light from some side, by more than the fraction `tolerated`.
fn check_rounding(
    (what, name): (&str, &str),
    corners: &[[DVec3; 3]],
    tolerated: f64,
    local: impl Fn(&[DVec3; 3]) -> Triangle,
) -> Result<()> {
    /// Smallest area relative to the squared distance from the centre, and at all (m2): no ray finds
    /// a shape of a nanometre.
    const SMALLEST: f64 = 1e-12;
    const NANOMETRE: f64 = 1e-18;
    let shown = |corners: &[[DVec3; 3]]| -> DVec3 {
        corners.iter().map(|[a, b, c]| 0.5 * (b - a).cross(c - a)).sum()
    };
    let exact = Moments::of(corners).area;
    let far = corners.iter().map(|t| local(t).reach().max_element()).fold(0.0, f32::max);
    let rounded = |t| {
        let Triangle { a, b, c } = local(t);
        [a, b, c].map(|p| p.as_dvec3())
    };
    let rounded: Vec<[DVec3; 3]> = corners.iter().map(rounded).collect();
    let change = (Moments::of(&rounded).area - exact).abs();
    let change = change.max(shown(&rounded).distance(shown(corners)));
    let seen = exact >= (SMALLEST * f64::from(far).powi(2)).max(NANOMETRE);
    if seen && change <= tolerated * exact {
        return Ok(());
    }
    Err(drowns((what, name), exact, far))
}

/// Refuses a disc or sphere that is so small where it stands that single precision moves rays by more
/// than a sixteenth of its radius: then photons read it wrong, by a tenth and more.
fn check_radius(name: &str, round: &Round, center: DVec3) -> Result<()> {
    const NANOMETRE: f64 = 1e-9;
    let far = round.moved(-center).reach().max_element();
    let moves = 0.5 * f64::from(f32::EPSILON) * f64::from(far);
    if round.radius >= NANOMETRE.max(16.0 * moves) {
        return Ok(());
    }
    Err(drowns(("captor", name), round.area(), far))
}

/// Makes the error on a shape of this area, m2, so far from the centre, m.
fn drowns((what, name): (&str, &str), area: f64, far: f32) -> Error {
    let problem = format!(
        "{what} `{name}` of {area:.1e} m2 drowns in the rounding of its coordinates: it is \
        {far:.3} m from the middle of the captors"
    );
    Error::input("scene", problem).remedy("bring what is far away nearer, or make it larger")
}

/// Extent of everything in a scene, m.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    min: DVec3,
    max: DVec3,
    finite: bool,
}

impl Bounds {
    fn of(parts: &SceneParts) -> Self {
        let mut bounds = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY, finite: true };
        let triangles = parts.surfaces.iter().flat_map(|s| &s.triangles);
        let captors = parts.captors.iter().flat_map(|c| &c.triangles);
        triangles.chain(captors).flatten().for_each(|&p| bounds.add(p));
        let rounds = parts.captors.iter().filter_map(|captor| Some(captor.sensor.round?.corners()));
        rounds.flatten().for_each(|p| bounds.add(p));
        parts.shared.iter().flat_map(SharedPart::boxes).flatten().for_each(|p| bounds.add(p));
        for lamp in parts.lights.iter().filter_map(LightPart::lamp) {
            lamp.outline().points().iter().for_each(|&p| bounds.add(p));
            lamp.outline().pieces().flatten().for_each(|p| bounds.add(p));
        }
        // a scene of a sky alone
        if bounds.min.x > bounds.max.x {
            bounds.add(DVec3::ZERO);
        }
        bounds
    }

    /// Returns the extent. Errors, at this place: a coordinate is not finite; it is too large or too small.
    fn checked(parts: &SceneParts, place: String) -> Result<Self> {
        let bounds = Self::of(parts);
        let remedy = "check the unit, transforms and coordinates";
        if !bounds.finite {
            let problem = "a coordinate is not finite once it is placed";
            return Err(Error::input(place, problem).remedy(remedy));
        }
        let radius = bounds.radius();
        if !(1e-6..=1e9).contains(&radius) {
            let problem = format!(
                "half of the diagonal of all that is in it is {} m, must be 1e-6 to 1e9 m",
                number(f64::from(radius as f32))
            );
            return Err(Error::input(place, problem).remedy(remedy));
        }
        Ok(bounds)
    }

    fn add(&mut self, p: DVec3) {
        self.finite &= p.is_finite();
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    fn size(&self) -> DVec3 {
        self.max - self.min
    }

    fn center(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// Returns half the diagonal, m; 1 m for a scene that is a single point.
    fn radius(&self) -> f64 {
        let half = 0.5 * self.size().length();
        if half > 0.0 { half } else { 1.0 }
    }
}
