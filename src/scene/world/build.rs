//! Builds a scene from its parts, with all checks.

use std::ops::Range;

use glam::{DVec3, Vec3};

use super::{
    CopyPart, NO_CAPTOR, ObjectCopy, Scene, SceneParts, Surface, SurfacePart, flush,
    mirrors::{FlatMirrors, shows_images},
    shapes::{KeptShapes, Outlines, RAY_OFFSET},
};
use crate::{
    error::{Error, Result, number},
    math::{
        geometry::{Extent, Triangle},
        spectrum::lanes,
    },
    scene::{
        bvh::Bvh,
        captor::{Captor, CaptorKind, Moments},
        light::{Entrance, Light, LightShape, MARGIN},
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
        pool.map_err(|e| Error::run("threads", e))?.install(|| Self::build(parts, kept))
    }

    fn build(mut parts: SceneParts, kept: &KeptShapes) -> Result<Self> {
        let name = parts.name.clone();
        let place = || format!("scene {name}");
        parts.validate(&place())?;
        let lanes = lanes(parts.bands.len());
        parts.materials.iter_mut().for_each(|named| named.material.pad(lanes));
        let bounds = Bounds::of(&parts);
        if !bounds.finite {
            return Err(Error::input(place(), "a coordinate is not finite once it is placed")
                .remedy("check the unit, transforms and coordinates"));
        }
        let center = bounds.center();
        let radius = bounds.radius();
        if !(1e-6..=1e9).contains(&radius) {
            let problem = format!(
                "half of the diagonal of all that is in it is {} m, must be 1e-6 to 1e9 m",
                number(f64::from(radius as f32))
            );
            return Err(
                Error::input(place(), problem).remedy("check the unit, transforms and coordinates")
            );
        }
        let radius = radius as f32;
        let local = |t: &[DVec3; 3]| Triangle::from(t.map(|p| (p - center).as_vec3()));

        for light in &parts.lights {
            let triangles = light.shape.triangles();
            if !triangles.is_empty() {
                check_rounding(("light", &light.name), triangles, local, radius)?;
            }
        }
        let objects: Vec<Option<usize>> = parts.surfaces.iter().map(|part| part.object).collect();
        let mut surface_parts: Vec<(usize, SurfacePart)> =
            parts.surfaces.into_iter().enumerate().collect();
        // the triangles of a captor become contiguous, whatever the order of the files
        surface_parts.sort_by_key(|(_, part)| part.captor);
        let mut triangles = Vec::new();
        let mut surfaces = Vec::new();
        let mut tangents = vec![Vec::new(); parts.materials.len()];
        let mut object_parts = Vec::with_capacity(surface_parts.len());
        let mut triangles_of_part = vec![0..0; surface_parts.len()];
        let mut captor_moments: Vec<(Vec<[DVec3; 3]>, usize)> =
            parts.captors.iter().map(|_| (Vec::new(), 0)).collect();
        for (index, part) in &surface_parts {
            if let Some(captor) = part.captor {
                let (corners, first) = &mut captor_moments[captor];
                if corners.is_empty() {
                    *first = triangles.len();
                }
                corners.extend_from_slice(&part.triangles);
            }
            object_parts.push((triangles.len(), part.object));
            for (i, tangent) in parts.tangents.get(index).into_iter().flatten().enumerate() {
                tangents[part.material].push(((triangles.len() + i) as u32, tangent.as_vec3()));
            }
            for corners in &part.triangles {
                let triangle = local(corners);
                surfaces.push(Surface {
                    normal: triangle.normal(),
                    material: part.material as u32,
                    captor: part.captor.map_or(NO_CAPTOR, |c| c as u32),
                    margins: Triangle::margins(triangle.slopes(), 4.0 * RAY_OFFSET * radius),
                });
                triangles.push(triangle);
            }
            triangles_of_part[*index] = triangles.len() - part.triangles.len()..triangles.len();
        }
        let copies = copies(parts.copies, &triangles_of_part, &objects);

        for (named, tangents) in parts.materials.iter_mut().zip(tangents) {
            named.material.set_tangents(tangents);
        }

        let mut captors: Vec<Captor> = Vec::with_capacity(parts.captors.len());
        let mut captor_triangles = Vec::new();
        let mut captor_of_triangle = Vec::new();
        for (index, part) in parts.captors.into_iter().enumerate() {
            let (corners, first) = match part.kind {
                CaptorKind::Surface => std::mem::take(&mut captor_moments[index]),
                CaptorKind::Virtual { .. } => (part.triangles, captor_triangles.len()),
            };
            let Moments { area, center, normal } = Moments::of(&corners);
            if area <= 0.0 {
                return Err(Error::input(place(), format!("captor `{}` has no area", part.id))
                    .remedy("leave it out, or correct its corners"));
            }
            let area = if part.sensor.is_sphere { 0.25 * area } else { area };
            if let CaptorKind::Virtual { .. } = part.kind {
                check_rounding(("captor", &part.id), &corners, local, radius)?;
                captor_triangles.extend(corners.iter().map(local));
                captor_of_triangle.resize(captor_triangles.len(), index as u32);
            }
            let first_channel =
                captors.last().map_or(0, |c: &Captor| c.first_channel + c.channels());
            captors.push(Captor {
                id: part.id,
                kind: part.kind,
                area,
                center,
                normal,
                triangles: first..first + corners.len(),
                first_channel,
                groups: part.groups,
                sensor: part.sensor,
                by_face: parts.absorbed_by_face && part.kind == CaptorKind::Surface,
            });
        }

        let around = Extent::of_triangles(&triangles).join(Extent::of_triangles(&captor_triangles));
        let around = if around.min.is_finite() { around } else { Extent::of([Vec3::ZERO]) };
        let margin = Vec3::splat(MARGIN * RAY_OFFSET * radius);
        let inside = Extent { min: around.min - margin, max: around.max + margin };
        let mut lights: Vec<Light> = parts
            .lights
            .into_iter()
            .map(|light| Light::new(light.name, light.power, &light.shape, center, &inside))
            .collect();

        let mut light_triangles = Vec::new();
        let mut light_of_triangle = Vec::new();
        for (l, light) in lights.iter().enumerate() {
            light_triangles.extend_from_slice(light.triangles());
            light_of_triangle.resize(light_triangles.len(), l as u32);
        }
        let shapes =
            kept.shapes(Outlines { triangles, captor_triangles, captor_of_triangle, radius });
        let flush_lights = flush::lift(&mut lights, &shapes, RAY_OFFSET * radius);
        let flat_mirrors = FlatMirrors::find(
            &lights,
            &shapes.triangles,
            &surfaces,
            |surface| shows_images(&parts.materials[surface.material as usize].material),
            MARGIN * RAY_OFFSET * radius,
        );
        Ok(Self {
            name: parts.name,
            quantity: parts.quantity,
            period_h: parts.period_h,
            bands: parts.bands,
            sums: parts.sums,
            ratios: parts.ratios,
            absorbed_by_face: parts.absorbed_by_face,
            watts: parts.watts,
            materials: parts.materials,
            objects: parts.objects,
            has_openings: lights.iter().filter_map(Light::entrance).any(Entrance::has_openings),
            flat_mirrors,
            infinite: (0..lights.len()).filter(|&l| lights[l].entrance().is_some()).collect(),
            lights,
            captors,
            groups: parts.groups,
            center,
            radius,
            copies,
            shapes,
            surfaces,
            object_parts,
            flush_lights,
            light_bvh: Bvh::build(&light_triangles),
            light_triangles,
            light_of_triangle,
        })
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

/// Refuses a shape that is so small relative to the scene that single precision changes its area.
fn check_rounding(
    (what, name): (&str, &str),
    corners: &[[DVec3; 3]],
    local: impl Fn(&[DVec3; 3]) -> Triangle,
    radius: f32,
) -> Result<()> {
    const TOLERATED: f64 = 0.02;
    const SMALLEST: f64 = 1e-12;
    let exact = Moments::of(corners).area;
    let rounded = |t| {
        let Triangle { a, b, c } = local(t);
        [a, b, c].map(|p| p.as_dvec3())
    };
    let rounded = Moments::of(&corners.iter().map(rounded).collect::<Vec<_>>()).area;
    let seen = exact >= SMALLEST * f64::from(radius).powi(2);
    if seen && (rounded - exact).abs() <= TOLERATED * exact {
        return Ok(());
    }
    let problem = format!(
        "{what} `{name}` of {exact:.1e} m2 drowns in the rounding of a scene {:.3} m across",
        2.0 * radius
    );
    Err(Error::input("scene", problem).remedy("bring what is far away nearer, or make it larger"))
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
        for light in &parts.lights {
            match &light.shape {
                LightShape::Point { position }
                | LightShape::Spot { position, .. }
                | LightShape::Luminaire { position, .. } => {
                    bounds.add(*position);
                }
                LightShape::Tube { from, to, radius }
                | LightShape::ApertureTube { from, to, radius, .. } => {
                    for end in [*from, *to] {
                        bounds.add(end - DVec3::splat(*radius));
                        bounds.add(end + DVec3::splat(*radius));
                    }
                }
                LightShape::IsotropicLine { from, to } => {
                    bounds.add(*from);
                    bounds.add(*to);
                }
                LightShape::Area { triangles, .. }
                | LightShape::LuminaireArea { triangles, .. } => {
                    triangles.iter().flatten().for_each(|&p| bounds.add(p));
                }
                LightShape::Infinite(_) => {}
            }
        }
        // a scene of a sky alone
        if bounds.min.x > bounds.max.x {
            bounds.add(DVec3::ZERO);
        }
        bounds
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
