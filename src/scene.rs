//! The world: surfaces, lights and captors, validated and immutable.
//!
//! Coordinates come in double precision and are kept in single precision relative to the centre
//! of the scene, so that a scene far from the origin works like one at the origin.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::{
    bvh::Bvh,
    captor::{Captor, CaptorKind, Moments},
    error::{Error, Result, number},
    geometry::{Ray, Triangle},
    light::{Light, LightShape},
    material::Material,
    spectrum::{MAX_BANDS, lanes},
    units::Quantity,
};

mod sight;

pub use sight::LightHit;

/// Distance at which a ray starts off the surface that it leaves, relative to the radius of the
/// scene: well above the rounding of single precision (2^-24), far below any geometry.
const RAY_OFFSET: f32 = 1.0 / (1 << 18) as f32;

/// A wavelength interval that is traced apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Band {
    /// Unique name.
    pub name: String,
    /// Wavelengths, nm.
    pub from_nm: Option<f64>,
    /// Wavelengths, nm.
    pub to_nm: Option<f64>,
}

/// A total over bands, reported like a band.
#[derive(Clone, Debug, PartialEq)]
pub struct BandSum {
    /// Unique among bands and sums.
    pub name: String,
    /// Indices of its bands.
    pub bands: Vec<usize>,
}

/// A material with its name.
#[derive(Clone, Debug)]
pub struct NamedMaterial {
    /// Unique name.
    pub name: String,
    /// What it does with light.
    pub material: Material,
}

/// Triangles of one object and material, and of one captor if they count.
#[derive(Clone, Debug)]
pub struct SurfacePart {
    /// Index of the object that it is part of, if it has a name.
    pub object: Option<usize>,
    /// Index of the material.
    pub material: usize,
    /// Index of the surface captor.
    pub captor: Option<usize>,
    /// Corners, m from the user's origin.
    pub triangles: Vec<[DVec3; 3]>,
}

/// A light to be.
#[derive(Clone, Debug)]
pub struct LightPart {
    /// Unique name.
    pub name: String,
    /// Emitted flux per band, finite and at least 0.
    pub power: Vec<f64>,
    /// Shape, m from the user's origin.
    pub shape: LightShape,
}

/// A captor to be.
#[derive(Clone, Debug)]
pub struct CaptorPart {
    /// Unique name.
    pub id: String,
    /// Virtual or surface.
    pub kind: CaptorKind,
    /// Corners of a virtual captor, m; a surface captor's are the parts that name it.
    pub triangles: Vec<[DVec3; 3]>,
    /// Indices of the groups that it belongs to.
    pub groups: Vec<usize>,
}

/// What a scene is made of, as files or a program give it.
#[derive(Clone, Debug, Default)]
pub struct SceneParts {
    /// Title.
    pub name: String,
    /// What the photons carry.
    pub quantity: Quantity,
    /// At least one.
    pub bands: Vec<Band>,
    /// Totals over bands.
    pub sums: Vec<BandSum>,
    /// The materials.
    pub materials: Vec<NamedMaterial>,
    /// Names of the objects.
    pub objects: Vec<String>,
    /// The surfaces.
    pub surfaces: Vec<SurfacePart>,
    /// The lights, at least one.
    pub lights: Vec<LightPart>,
    /// The captors.
    pub captors: Vec<CaptorPart>,
    /// Names of the groups, unique.
    pub groups: Vec<String>,
}

/// One triangle of a surface: what the hot loop asks of it.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Unit normal of the front.
    pub normal: Vec3,
    /// Index of the material.
    pub material: u32,
    captor: u32,
    /// Barycentric weights below which a point is too near to the edge opposite each corner.
    pub(crate) margins: Vec3,
}

const NO_CAPTOR: u32 = u32::MAX;

impl Surface {
    /// Index of its captor, if it counts.
    #[inline]
    pub fn captor(&self) -> Option<usize> {
        (self.captor != NO_CAPTOR).then_some(self.captor as usize)
    }
}

/// A validated scene.
#[derive(Debug)]
pub struct Scene {
    /// Title.
    pub name: String,
    /// What the photons carry.
    pub quantity: Quantity,
    /// The bands.
    pub bands: Vec<Band>,
    /// Totals over bands.
    pub sums: Vec<BandSum>,
    /// The materials.
    pub materials: Vec<NamedMaterial>,
    /// Names of the objects.
    pub objects: Vec<String>,
    /// The lights.
    pub lights: Vec<Light>,
    /// The captors.
    pub captors: Vec<Captor>,
    /// Names of the groups.
    pub groups: Vec<String>,
    /// The point that single-precision coordinates are relative to, m from the user's origin.
    pub center: DVec3,
    /// Half the diagonal of everything, m.
    pub radius: f32,
    /// Triangles of all surfaces.
    pub triangles: Vec<Triangle>,
    /// Triangles of all virtual captors, where the user put them.
    pub captor_triangles: Vec<Triangle>,
    surfaces: Vec<Surface>,
    /// The object of each part, and the first triangle of it.
    object_parts: Vec<(usize, Option<usize>)>,
    captor_of_triangle: Vec<u32>,
    surface_bvh: Bvh,
    captor_bvh: Bvh,
    in_surface: Vec<usize>,
    light_triangles: Vec<Triangle>,
    light_of_triangle: Vec<u32>,
    light_bvh: Bvh,
}

/// A ray's meeting with a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceHit {
    /// Distance along the ray, m.
    pub t: f32,
    /// Index of the triangle.
    pub triangle: usize,
    /// The point on the surface, kept a little inside the triangle's edges.
    pub point: Vec3,
}

/// A ray's passage through a virtual captor.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Index of the captor.
    pub captor: usize,
    /// Index of the triangle in the list of captor triangles.
    pub triangle: usize,
    /// Whether it came against the normal.
    pub front: bool,
    /// Where.
    pub point: Vec3,
}

impl Scene {
    /// Checks the parts and builds the scene, on threads of its own. Errors: no light, no or too
    /// many bands, numbers that are not finite, an extent that single precision cannot carry.
    pub fn new(parts: SceneParts) -> Result<Self> {
        let pool = rayon::ThreadPoolBuilder::new().build();
        pool.map_err(|e| Error::run("threads", e))?.install(|| Self::build(parts))
    }

    fn build(parts: SceneParts) -> Result<Self> {
        let name = parts.name.clone();
        let place = || format!("scene {name}");
        if parts.lights.is_empty() {
            return Err(Error::input(place(), "it has no light").remedy("add one to /lights"));
        }
        if parts.bands.is_empty() || parts.bands.len() > MAX_BANDS {
            let problem = format!("{} bands, must be 1 to {MAX_BANDS}", parts.bands.len());
            return Err(Error::input(place(), problem).remedy("change /bands"));
        }
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
            if let LightShape::Area { triangles, .. } = &light.shape {
                check_rounding(("light", &light.name), triangles, local, radius)?;
            }
        }
        let lights: Vec<Light> = parts
            .lights
            .into_iter()
            .map(|light| Light::new(light.name, light.power, &light.shape, center))
            .collect();

        let mut surface_parts = parts.surfaces;
        // a captor's triangles side by side, whatever the order of the files
        surface_parts.sort_by_key(|part| part.captor);
        let mut triangles = Vec::new();
        let mut surfaces = Vec::new();
        let mut object_parts = Vec::with_capacity(surface_parts.len());
        let mut captor_moments: Vec<(Vec<[DVec3; 3]>, usize)> =
            parts.captors.iter().map(|_| (Vec::new(), 0)).collect();
        for part in &surface_parts {
            if let Some(captor) = part.captor {
                let (corners, first) = &mut captor_moments[captor];
                if corners.is_empty() {
                    *first = triangles.len();
                }
                corners.extend_from_slice(&part.triangles);
            }
            object_parts.push((triangles.len(), part.object));
            for corners in &part.triangles {
                let triangle = local(corners);
                surfaces.push(Surface {
                    normal: triangle.normal(),
                    material: part.material as u32,
                    captor: part.captor.map_or(NO_CAPTOR, |c| c as u32),
                    margins: triangle.margins(4.0 * RAY_OFFSET * radius),
                });
                triangles.push(triangle);
            }
        }

        let mut captors: Vec<Captor> = Vec::with_capacity(parts.captors.len());
        let mut captor_triangles = Vec::new();
        let mut captor_of_triangle = Vec::new();
        for (index, part) in parts.captors.into_iter().enumerate() {
            let (corners, first) = match part.kind {
                CaptorKind::Surface => std::mem::take(&mut captor_moments[index]),
                CaptorKind::Virtual { .. } => (part.triangles, captor_triangles.len()),
            };
            if let CaptorKind::Virtual { .. } = part.kind {
                check_rounding(("captor", &part.id), &corners, local, radius)?;
                captor_triangles.extend(corners.iter().map(local));
                captor_of_triangle.resize(captor_triangles.len(), index as u32);
            }
            let Moments { area, center, normal } = Moments::of(&corners);
            if area <= 0.0 {
                return Err(Error::input(place(), format!("captor `{}` has no area", part.id))
                    .remedy("leave it out, or correct its corners"));
            }
            let first_channel =
                captors.last().map_or(0, |c: &Captor| c.first_channel + c.kind.channels());
            captors.push(Captor {
                id: part.id,
                kind: part.kind,
                area,
                center,
                normal,
                triangles: first..first + corners.len(),
                first_channel,
                groups: part.groups,
            });
        }

        let mut light_triangles = Vec::new();
        let mut light_of_triangle = Vec::new();
        for (l, light) in lights.iter().enumerate() {
            light_triangles.extend_from_slice(light.triangles());
            light_of_triangle.resize(light_triangles.len(), l as u32);
        }
        let surface_bvh = Bvh::build(&triangles);
        let mut scene = Self {
            name: parts.name,
            quantity: parts.quantity,
            bands: parts.bands,
            sums: parts.sums,
            materials: parts.materials,
            objects: parts.objects,
            lights,
            captors,
            groups: parts.groups,
            center,
            radius,
            triangles,
            captor_bvh: Bvh::build(&captor_triangles),
            captor_triangles,
            surfaces,
            object_parts,
            captor_of_triangle,
            surface_bvh,
            in_surface: Vec::new(),
            light_bvh: Bvh::build(&light_triangles),
            light_triangles,
            light_of_triangle,
        };
        scene.lift_captors_off_surfaces();
        Ok(scene)
    }

    /// Number of lanes that its bands are carried in.
    pub fn lanes(&self) -> usize {
        lanes(self.bands.len())
    }

    /// Channels of all captors.
    pub fn channels(&self) -> usize {
        self.captors.last().map_or(0, |c| c.first_channel + c.kind.channels())
    }

    /// What a triangle of a surface is.
    #[inline]
    pub fn surface(&self, triangle: usize) -> &Surface {
        &self.surfaces[triangle]
    }

    /// Index of the object that a triangle of a surface is part of, if it has a name.
    pub fn object(&self, triangle: usize) -> Option<usize> {
        let after = self.object_parts.partition_point(|(first, _)| *first <= triangle);
        self.object_parts[..after].last()?.1
    }

    /// The material of a triangle.
    #[inline]
    pub fn material(&self, surface: &Surface) -> &Material {
        &self.materials[surface.material as usize].material
    }

    /// Names of the bands, followed by those of the sums over bands.
    pub fn band_names(&self) -> impl Iterator<Item = &str> + Clone {
        let bands = self.bands.iter().map(|band| band.name.as_str());
        bands.chain(self.sums.iter().map(|sum| sum.name.as_str()))
    }

    /// Values per band, followed by those of the sums over bands.
    pub fn with_sums(&self, values: &[f64]) -> Vec<f64> {
        let sums = self.sums.iter().map(|sum| sum.bands.iter().map(|&b| values[b]).sum());
        values.iter().copied().chain(sums).collect()
    }

    /// The triangles of a captor.
    pub fn triangles_of(&self, captor: &Captor) -> &[Triangle] {
        match captor.kind {
            CaptorKind::Surface => &self.triangles[captor.triangles.clone()],
            CaptorKind::Virtual { .. } => &self.captor_triangles[captor.triangles.clone()],
        }
    }

    /// How far a captor's triangles are taken off the surface that they lie in, m.
    pub fn lift(&self, captor: usize) -> f32 {
        match self.in_surface.binary_search(&captor) {
            Ok(_) => 2.0 * self.ray_offset(),
            Err(_) => 0.0,
        }
    }

    /// Virtual captors that lie in a surface.
    pub fn captors_in_surfaces(&self) -> &[usize] {
        &self.in_surface
    }

    /// Distance at which rays start off surfaces, m.
    #[inline]
    pub fn ray_offset(&self) -> f32 {
        RAY_OFFSET * self.radius
    }

    /// The nearest surface that a ray meets.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<SurfaceHit> {
        let hit = self.surface_bvh.closest(ray, f32::INFINITY)?;
        let triangle = hit.triangle as usize;
        let point = self.inside(triangle, self.surface_bvh.point(&hit), hit.u, hit.v);
        Some(SurfaceHit { t: hit.t, triangle, point })
    }

    /// Every virtual captor that a ray crosses before `t_max`, in any order.
    #[inline]
    pub fn crossings(&self, ray: &Ray, t_max: f32, mut visit: impl FnMut(Crossing)) {
        if self.captor_triangles.is_empty() {
            return;
        }
        self.captor_bvh.crossings(ray, t_max, |hit| {
            let triangle = hit.triangle as usize;
            let shape = &self.captor_triangles[triangle];
            visit(Crossing {
                captor: self.captor_of_triangle[triangle] as usize,
                triangle,
                front: shape.cross().dot(ray.direction) < 0.0,
                point: shape.point(hit.u, hit.v),
            });
        });
    }

    /// Visits every triangle of a surface that may reach into the ball of `radius`, m, around `center`.
    pub fn near(&self, center: Vec3, radius: f32, mut visit: impl FnMut(usize)) {
        self.surface_bvh.near(center, radius, |triangle| visit(triangle as usize));
    }

    /// Another triangle of a surface that lies in the plane of this one, over its middle.
    pub fn coincident(&self, triangle: usize) -> Option<usize> {
        let shape = &self.triangles[triangle];
        let (middle, normal) = (shape.centroid(), shape.normal());
        let found = parallel_neighbours(
            &self.surface_bvh,
            &self.triangles,
            middle,
            normal,
            self.ray_offset(),
        );
        found.filter(|&other| other as usize != triangle).min().map(|other| other as usize)
    }

    /// The ray that leaves a surface at `point` on the side of `normal`.
    #[inline]
    pub fn leave(&self, point: Vec3, normal: Vec3, direction: Vec3) -> Ray {
        Ray { origin: point + self.ray_offset() * normal, direction }
    }

    /// A hit point, drawn in from edges nearer than a few ray offsets: a point that rounding has
    /// put beyond the edge of a closed mesh would let light through its corner.
    #[inline]
    fn inside(&self, triangle: usize, point: Vec3, u: f32, v: f32) -> Vec3 {
        self.triangles[triangle].draw_in(point, u, v, self.surfaces[triangle].margins)
    }

    /// A virtual captor in the plane of a surface counts as lying off it, where its normal points:
    /// its triangles move to two ray offsets, above the points that rays start from.
    fn lift_captors_off_surfaces(&mut self) {
        let offset = self.ray_offset();
        let mut lies_in: Vec<bool> = self
            .captors
            .par_iter()
            .map(|captor| {
                matches!(captor.kind, CaptorKind::Virtual { .. })
                    && self.triangles_of(captor).iter().any(|t| self.lies_in_surface(t))
            })
            .collect();
        // a captor larger than the surface that it lies in is found from the surface's side
        if !self.captor_triangles.is_empty() {
            let covered: Vec<u32> = self
                .triangles
                .par_iter()
                .filter_map(|t| {
                    parallel_neighbours(
                        &self.captor_bvh,
                        &self.captor_triangles,
                        t.centroid(),
                        t.normal(),
                        offset,
                    )
                    .min()
                })
                .collect();
            for triangle in covered {
                lies_in[self.captor_of_triangle[triangle as usize] as usize] = true;
            }
        }
        self.in_surface = (0..lies_in.len()).filter(|&c| lies_in[c]).collect();
        if self.in_surface.is_empty() {
            return;
        }
        let mut lifted = self.captor_triangles.clone();
        for &captor in &self.in_surface {
            for triangle in &mut lifted[self.captors[captor].triangles.clone()] {
                let shift = 2.0 * offset * triangle.normal();
                *triangle = [triangle.a + shift, triangle.b + shift, triangle.c + shift].into();
            }
        }
        self.captor_bvh = Bvh::build(&lifted);
    }

    fn lies_in_surface(&self, triangle: &Triangle) -> bool {
        let normal = triangle.normal();
        let near_corners = [(0.05, 0.05), (0.9, 0.05), (0.05, 0.9)];
        [(1.0 / 3.0, 1.0 / 3.0)].iter().chain(&near_corners).any(|&(u, v)| {
            let point = triangle.point(u, v);
            parallel_neighbours(
                &self.surface_bvh,
                &self.triangles,
                point,
                normal,
                self.ray_offset(),
            )
            .next()
            .is_some()
        })
    }
}

/// Refuses a shape so small against the scene that single precision changes its area.
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

/// The triangles parallel to `normal` within `reach` of `point`.
fn parallel_neighbours(
    bvh: &Bvh,
    triangles: &[Triangle],
    point: Vec3,
    normal: Vec3,
    reach: f32,
) -> impl Iterator<Item = u32> {
    let mut found = Vec::new();
    if normal != Vec3::ZERO {
        let ray = Ray { origin: point - reach * normal, direction: normal };
        bvh.crossings(&ray, 2.0 * reach, |hit| {
            if triangles[hit.triangle as usize].normal().dot(normal).abs() > 0.999_999 {
                found.push(hit.triangle);
            }
        });
    }
    found.into_iter()
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
                LightShape::Point { position } | LightShape::Spot { position, .. } => {
                    bounds.add(*position);
                }
                LightShape::Tube { from, to, radius } => {
                    for end in [*from, *to] {
                        bounds.add(end - DVec3::splat(*radius));
                        bounds.add(end + DVec3::splat(*radius));
                    }
                }
                LightShape::IsotropicLine { from, to } => {
                    bounds.add(*from);
                    bounds.add(*to);
                }
                LightShape::Area { triangles, .. } => {
                    triangles.iter().flatten().for_each(|&p| bounds.add(p));
                }
            }
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

    /// Half the diagonal; 1 m for a scene that is a single point.
    fn radius(&self) -> f64 {
        let half = 0.5 * self.size().length();
        if half > 0.0 { half } else { 1.0 }
    }
}
