//! The validated scene: surfaces, lights and captors, immutable and arranged for the tracing of
//! rays.
//!
//! [`SceneParts`] is the input; `build` and `validate` turn it into a [`Scene`]; `contents` says what
//! that is made of; `shapes` keeps the triangles with their search structures, and `rounds` discs and
//! spheres; `lights_met` finds the lights that a ray meets.
//!
//! Coordinates come in double precision and are kept in single precision relative to the centre of
//! the scene, so that a scene far from the origin works like one at the origin.

mod arrived;
mod build;
mod contents;
mod digest;
mod flush;
mod images;
mod lights_met;
mod mirrors;
mod outline;
mod outside;
mod parts;
mod repeats;
mod rounds;
mod shapes;
mod shared;
mod surface;
mod triangles;
mod tubes;
mod validate;

use std::{borrow::Cow, collections::BTreeMap, sync::Arc};

use glam::{DVec3, Vec3, Vec4};

use crate::{
    error::Problem,
    math::{
        geometry::{Extent, ROUNDING, Ray, Triangle, across, closeness},
        round::{Round, RoundHit},
        spectrum::lanes,
        units::{Quantity, UnitNames},
    },
    scene::{
        bvh::{Bvh, Hit},
        captor::{CHANNELS, Captor},
        lattice::{Cell, Lattice},
        light::{Entrance, Light, LightTree, Prism, sources},
        material::Material,
        parameter::Parameters,
        stand::{InLayers, LayerBins, Stand},
    },
};
use contents::{Common, Head, Objects, Place};
use images::LightShapes;
use shapes::{Found, Shapes, has_parallel};
use surface::{MARGINS, NO_CAPTOR};
use tubes::{MANY, Tubes};

pub use arrived::Arrived;
pub use contents::ObjectCopy;
pub use flush::FlushLight;
pub use mirrors::{ChosenImage, FlatMirrors, MirrorPlane};
pub use outline::{Outline, Shape};
pub use outside::Outside;
pub use parts::{
    Asked, Band, BandRatio, BandSum, CaptorPart, CopyPart, LightPart, NamedMaterial, SceneParts,
    SharedPart, SurfacePart,
};
pub use shapes::{KeptShapes, LOOKED_AT};
pub use surface::Surface;
pub use triangles::{SharedCopy, Standing, Triangles};
pub use validate::{MAX_CAPTORS, MAX_LIGHTS, MAX_TRIANGLES, check_crowd};
pub use validate::{check_watts, may_be_shared};

/// Largest error of the difference between the distances at which a ray meets two faces at their
/// common edge, as a multiple of the error of their points. The error is largest for a face that the
/// ray grazes.
const GRAZING: f32 = 512.0;

/// A validated scene. What it promises cannot be changed: it is read by methods.
#[derive(Debug)]
pub struct Scene {
    head: Head,
    asked: Asked,
    parameters: Parameters,
    materials: Vec<NamedMaterial>,
    objects: Objects,
    lighting: Lighting,
    captors: Vec<Captor>,
    groups: Vec<String>,
    place: Place,
    shapes: Arc<Shapes>,
}

/// The lights of a scene and what finds them.
#[derive(Debug)]
struct Lighting {
    lights: Vec<Light>,
    watts: BTreeMap<String, f64>,
    /// The tree by which one of many lights is chosen.
    tree: Option<LightTree>,
    tubes: Tubes,
    shapes: LightShapes,
    /// Indices of the lights at infinity.
    infinite: Vec<usize>,
    /// Whether the light of one of these enters through openings alone.
    has_openings: bool,
    /// The lights that lie in surfaces.
    flush: Vec<FlushLight>,
    mirrors: Option<FlatMirrors>,
}

impl Lighting {
    /// Arranges lights of which these are the shapes, those that lie in surfaces, and the mirrors that
    /// show suns.
    fn new(
        lights: Vec<Light>,
        watts: BTreeMap<String, f64>,
        shapes: LightShapes,
        flush: Vec<FlushLight>,
        mirrors: Option<FlatMirrors>,
        is_periodic: bool,
    ) -> Self {
        Self {
            watts,
            tree: (lights.len() > MANY && !is_periodic).then(|| LightTree::new(&lights)),
            tubes: Tubes::new(&lights),
            shapes,
            infinite: (0..lights.len()).filter(|&l| lights[l].entrance().is_some()).collect(),
            has_openings: lights.iter().filter_map(Light::entrance).any(Entrance::has_openings),
            flush,
            mirrors,
            lights,
        }
    }
}

/// The place where a ray meets a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceHit {
    /// Distance along the ray, m.
    pub t: f32,
    /// Index of the triangle.
    pub triangle: usize,
    /// The point on the surface, kept a little inside the triangle's edges.
    pub point: Vec3,
}

/// A [`SurfaceHit`] whose numbers lie side by side.
struct PackedHit {
    point_and_t: Vec4,
    triangle: usize,
}

impl From<PackedHit> for SurfaceHit {
    #[inline(always)]
    fn from(PackedHit { point_and_t, triangle }: PackedHit) -> Self {
        Self { t: point_and_t.w, triangle, point: point_and_t.truncate() }
    }
}

/// The place where a ray crosses a virtual captor.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// Distance along the ray, m.
    pub t: f32,
    /// Index of the captor.
    pub captor: usize,
    /// Index of the triangle in the list of captor triangles, or of the disc or sphere after them.
    pub triangle: usize,
    /// Whether the ray goes against the normal, and so arrives at the front.
    pub front: bool,
    /// The point of the crossing.
    pub point: Vec3,
}

impl Scene {
    /// Returns the title.
    pub fn name(&self) -> &str {
        &self.head.name
    }

    /// Returns the quantity that photons carry: power in W or photon flux in umol/s.
    pub fn quantity(&self) -> Quantity {
        self.head.quantity
    }

    /// Returns the length of the period, h, whose mean the daylight of the scene is, nights
    /// included; `None` for an instant.
    pub fn period_h(&self) -> Option<f64> {
        self.head.period_h
    }

    /// Returns the wavelength bands.
    #[inline]
    pub fn bands(&self) -> &[Band] {
        &self.head.bands
    }

    /// Returns the sums over bands.
    #[inline]
    pub fn sums(&self) -> &[BandSum] {
        &self.head.sums
    }

    /// Returns the ratios of sums over bands.
    #[inline]
    pub fn ratios(&self) -> &[BandRatio] {
        &self.head.ratios
    }

    /// Returns the parameters on which a run says how its results depend; there may be none.
    #[inline]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// Returns the same scene, of which runs also find what `other` would find: a scene that differs from
    /// it in the values of its parameters alone. Factors are best at most 1: where light counts for more
    /// than it did, a few histories that have met a parameter often decide everything. Error: a value is 0
    /// here and not there.
    #[doc(hidden)]
    pub fn with_variant(mut self, other: &Self) -> Result<Self, Problem> {
        let (lights, lanes) = ([&self.lighting.lights[..], &other.lighting.lights], self.lanes());
        let materials = other.materials.iter().map(|named| named.material.clone()).collect();
        self.parameters.add_variant(lights, materials, &other.parameters, lanes)?;
        Ok(self)
    }

    /// Returns what captors say beside the light that they receive.
    #[inline]
    pub fn asked(&self) -> Asked {
        self.asked
    }

    /// Returns the electric power of lights, W, by their names.
    pub fn watts(&self) -> &BTreeMap<String, f64> {
        &self.lighting.watts
    }

    /// Returns the materials.
    #[inline]
    pub fn materials(&self) -> &[NamedMaterial] {
        &self.materials
    }

    /// Returns the names of the objects.
    pub fn objects(&self) -> &[String] {
        &self.objects.names
    }

    /// Returns the lights.
    #[inline]
    pub fn lights(&self) -> &[Light] {
        &self.lighting.lights
    }

    /// Returns the captors.
    #[inline]
    pub fn captors(&self) -> &[Captor] {
        &self.captors
    }

    /// Returns the names of the groups.
    #[inline]
    pub fn groups(&self) -> &[String] {
        &self.groups
    }

    /// Returns the point that single-precision coordinates are relative to, m from the user's
    /// origin.
    #[inline]
    pub fn center(&self) -> DVec3 {
        self.place.center
    }

    /// Returns half the diagonal of the box around surfaces, captors and lights, m.
    #[inline]
    pub fn radius(&self) -> f32 {
        self.place.radius
    }

    /// Returns the number of lanes in which the bands are carried.
    pub fn lanes(&self) -> usize {
        lanes(self.head.bands.len())
    }

    /// Returns the number of strata of the lights, which is the least number of photons in a run.
    pub fn sources(&self) -> usize {
        sources(&self.lighting.lights)
    }

    /// Returns whether there is a light at infinity: a sun or a sky.
    pub fn has_daylight(&self) -> bool {
        !self.lighting.infinite.is_empty()
    }

    /// Returns the number of channels of all captors.
    pub fn channels(&self) -> usize {
        self.captors.last().map_or(0, |c| c.first_channel + c.channels())
    }

    /// Returns the number of channels of each group of captors.
    pub fn group_channels(&self) -> usize {
        CHANNELS.len() + if self.asked.absorbed_by_face { 2 } else { 0 }
    }

    /// Returns the first channel of a group of captors; those of groups come after those of captors.
    pub fn first_channel_of_group(&self, group: usize) -> usize {
        self.channels() + group * self.group_channels()
    }

    /// Returns how the scene repeats, in the coordinates in which rays are traced; `None` if it
    /// does not.
    pub fn lattice(&self) -> Option<&Lattice> {
        self.shapes.repeats.as_ref().map(|repeats| &repeats.lattice)
    }

    /// Returns the prism by whose faces light from infinitely far away comes in.
    pub fn inside(&self) -> &Prism {
        &self.place.inside
    }

    /// Returns the tree of the lights, if there are so many that scanning them takes longer. A scene
    /// that repeats has none.
    #[inline]
    pub fn light_tree(&self) -> Option<&LightTree> {
        self.lighting.tree.as_ref()
    }

    /// Returns what is summed of the plants as a whole.
    #[inline]
    pub fn stand(&self) -> &Stand {
        &self.place.stand
    }

    /// Returns whether a triangle of a surface belongs to the ground.
    pub fn is_ground(&self, triangle: usize) -> bool {
        self.object(triangle).is_some_and(|o| self.place.stand.is_ground.get(o) == Some(&true))
    }

    /// Returns the layer in which a point of a triangle of a surface captor counts; `None` if there
    /// are no layers, or if the triangle is ground.
    #[inline]
    pub fn layer_of(&self, triangle: usize, point: Vec3) -> Option<usize> {
        self.place
            .stand
            .layers
            .as_ref()
            .and_then(|layers| self.layer_among(layers, triangle, point))
    }

    #[inline(never)]
    fn layer_among(&self, layers: &LayerBins, triangle: usize, point: Vec3) -> Option<usize> {
        match layers.of_triangle(triangle) {
            InLayers::Nowhere => return None,
            InLayers::In(layer) => return Some(layer),
            InLayers::Across if self.is_ground(triangle) => return None,
            InLayers::Across => {}
        }
        let copy = self.located(triangle);
        let [a, b, c] = layers.heights(triangle, copy);
        let is_mirrored = copy.is_some_and(|copy| self.shapes.placed.instance(&copy).is_mirrored());
        let heights = if is_mirrored { [a, c, b] } else { [a, b, c] };
        Some(layers.of(heights, self.triangles().at(triangle).weights(point)))
    }

    /// Returns the triangles of the virtual captors that are made of triangles, where the user put
    /// them.
    #[inline]
    pub fn captor_triangles(&self) -> &[Triangle] {
        &self.shapes.captor_triangles
    }

    /// Returns a box around all virtual captors, m from the centre of the scene.
    pub fn captors_extent(&self) -> Extent {
        let triangles = Extent::of_triangles(self.captor_triangles());
        self.shapes.rounds.iter().map(Round::extent).fold(triangles, Extent::join)
    }

    /// Returns the number of shapes of virtual captors: of triangles, discs and spheres.
    pub fn captor_shapes(&self) -> usize {
        self.shapes.captor_of_triangle.len()
    }

    /// Returns the number of triangles by which virtual captors are shown.
    pub fn captor_tiles(&self) -> usize {
        let rounds = self.shapes.rounds.iter().map(Round::shown_by);
        self.captor_triangles().len() + rounds.sum::<usize>()
    }

    /// Returns the disc or sphere that a virtual captor is, m from the centre of the scene; `None` if it
    /// is made of triangles.
    #[inline]
    pub fn round(&self, captor: &Captor) -> Option<&Round> {
        captor.sensor.round?;
        self.shapes.rounds.get(captor.triangles.start - self.captor_triangles().len())
    }

    /// Returns the unit normal of the front of a virtual captor where a ray crosses it.
    #[inline]
    pub fn crossed_normal(&self, crossing: &Crossing) -> Vec3 {
        let triangles = self.captor_triangles();
        match triangles.get(crossing.triangle) {
            Some(triangle) => triangle.normal(),
            None => {
                self.shapes.rounds[crossing.triangle - triangles.len()].normal_at(crossing.point)
            }
        }
    }

    /// Returns the properties of a triangle of a surface.
    #[inline]
    pub fn surface(&self, triangle: usize) -> Surface {
        match self.objects.surfaces.get(triangle) {
            Some(surface) => *surface,
            None => self.shared_surface(triangle, None),
        }
    }

    /// Returns the properties of the surface where a ray has met it. Of a copy that shares its
    /// triangles, the errors are those at this point; they are less than anywhere.
    #[inline]
    pub fn surface_at(&self, hit: &SurfaceHit) -> Surface {
        match self.objects.surfaces.get(hit.triangle) {
            Some(surface) => *surface,
            None => self.shared_surface(hit.triangle, Some(hit.point)),
        }
    }

    /// Returns the index of the object that a triangle of a surface belongs to, if the object has a
    /// name.
    pub fn object(&self, triangle: usize) -> Option<usize> {
        if triangle >= self.objects.surfaces.len() {
            return self.object_of_copy(triangle);
        }
        let after = self.objects.parts.partition_point(|(first, _)| *first <= triangle);
        self.objects.parts[..after].last()?.1
    }

    /// Returns the material of a surface's triangle.
    #[inline]
    pub fn material(&self, surface: &Surface) -> &Material {
        &self.materials[surface.material as usize].material
    }

    /// Returns the names of the bands, followed by those of the sums over bands.
    pub fn band_names(&self) -> impl Iterator<Item = &str> + Clone {
        let bands = self.head.bands.iter().map(|band| band.name.as_str());
        bands.chain(self.head.sums.iter().map(|sum| sum.name.as_str()))
    }

    /// Returns the units of flux and irradiance of a band or, by its index after them, of a sum.
    pub fn units(&self, column: usize) -> [Cow<'static, str>; 2] {
        let UnitNames { flux, irradiance, .. } = self.head.quantity.unit_names();
        let sum = column.checked_sub(self.head.bands.len()).and_then(|sum| self.head.sums.get(sum));
        match sum.and_then(|sum| sum.unit) {
            Some(unit) => unit.names().map(Cow::Borrowed),
            None => [flux, irradiance],
        }
    }

    /// Returns `values` per band, followed by their sums over bands.
    pub fn with_sums(&self, values: &[f64]) -> Vec<f64> {
        let sums = self.head.sums.iter().map(|sum| sum.of(values));
        values.iter().copied().chain(sums).collect()
    }

    /// Returns whether the scene has virtual captors.
    pub fn has_virtual_captors(&self) -> bool {
        !self.shapes.captor_of_triangle.is_empty()
    }

    /// Returns the distance by which a captor's triangles are lifted off the surface that they lie
    /// in, m; 0 if they lie in none.
    pub fn lift(&self, captor: usize) -> f32 {
        match self.shapes.in_surface.binary_search(&captor) {
            Ok(place) => self.shapes.lifts[place],
            Err(_) => 0.0,
        }
    }

    /// Returns the largest distance by which a captor is lifted, m.
    pub fn highest_lift(&self) -> f32 {
        self.shapes.lifts.iter().copied().fold(0.0, f32::max)
    }

    /// Returns the indices of the virtual captors that lie in a surface, in rising order.
    pub fn captors_in_surfaces(&self) -> &[usize] {
        &self.shapes.in_surface
    }

    /// Returns the lights that lie in a surface, and the tubes that a surface cuts.
    pub fn flush_lights(&self) -> &[FlushLight] {
        &self.lighting.flush
    }

    /// Returns the nearest surface that a ray meets.
    #[inline(always)]
    pub fn closest(&self, ray: &Ray) -> Option<SurfaceHit> {
        if !self.shapes.is_plain {
            return self.closest_in_pieces(ray);
        }
        let hit = self.shapes.surface_bvh.closest(ray, f32::INFINITY)?;
        Some(self.surface_hit(ray, &hit))
    }

    /// Returns the nearest surface that a ray meets, and visits every virtual captor that the ray
    /// crosses before it, in any order.
    #[inline]
    pub fn meet(&self, ray: &Ray, mut visit: impl FnMut(Crossing)) -> Option<SurfaceHit> {
        let Shapes { surface_bvh, captor_bvh, .. } = &*self.shapes;
        if !self.shapes.has_plain_captors {
            return self.meet_otherwise(ray, &mut visit);
        }
        let hit = if captor_bvh.is_empty() {
            surface_bvh.closest(ray, f32::INFINITY)
        } else {
            surface_bvh.meet(captor_bvh, ray, self.crossing(ray, &mut visit))
        };
        hit.map(|hit| self.surface_hit(ray, &hit))
    }

    /// The search of [`meet`](Self::meet) where not all is made of plain triangles.
    #[inline(never)]
    fn meet_otherwise(&self, ray: &Ray, visit: &mut dyn FnMut(Crossing)) -> Option<SurfaceHit> {
        let Shapes { surface_bvh, captor_bvh, .. } = &*self.shapes;
        if !self.shapes.is_plain {
            return self.meet_in_pieces(ray, visit);
        }
        let mut visit = |crossing| visit(crossing);
        let hit = match captor_bvh.is_empty() {
            true => surface_bvh.closest(ray, f32::INFINITY),
            false => surface_bvh.meet(captor_bvh, ray, self.crossing(ray, &mut visit)),
        };
        let t = hit.map_or(f32::INFINITY, |hit| hit.t);
        self.cross_rounds(ray, t.next_up(), Some(t), |_, _| true, &mut visit);
        hit.map(|hit| self.surface_hit(ray, &hit))
    }

    /// Visits the discs and spheres that a ray crosses before `t_max` and that `count`, in the cell that
    /// they are seen in. `hit` is the distance at which it meets a surface: see
    /// [`crossing`](Self::crossing).
    #[inline]
    fn cross_rounds(
        &self,
        ray: &Ray,
        t_max: f32,
        hit: Option<f32>,
        mut count: impl FnMut(&Crossing, Cell) -> bool,
        visit: &mut impl FnMut(Crossing),
    ) {
        let shapes = &*self.shapes;
        shapes.round_captors.crossings(ray, t_max, |index, RoundHit { t, front, mut point }| {
            let (index, cell) = shapes.round_origin(index);
            let triangle = shapes.captor_triangles.len() + index;
            let captor = shapes.captor_of_triangle[triangle] as usize;
            let is_tied = hit == Some(t);
            if is_tied && !(front && self.lift(captor) > 0.0) {
                return;
            }
            if let Some(repeats) = shapes.repeats.as_ref().filter(|_| cell != [0, 0]) {
                point -= repeats.lattice.shift(cell).as_vec3();
            }
            let crossing = Crossing { t, captor, triangle, front, point };
            if count(&crossing, cell) {
                visit(crossing);
            }
        });
    }

    /// Visits every virtual captor that a ray crosses before `t_max`, in any order.
    pub fn crossings(&self, ray: &Ray, t_max: f32, mut visit: impl FnMut(Crossing)) {
        if self.shapes.repeats.is_some() {
            return self.crossings_in_pieces(ray, t_max, &mut visit);
        }
        self.cross_rounds(ray, t_max, None, |_, _| true, &mut visit);
        let mut visit = self.crossing(ray, &mut visit);
        self.shapes.captor_bvh.crossings(ray, t_max, |hit| visit(hit, false));
    }

    /// Visits every virtual captor that a ray crosses before it meets a surface, in any order.
    /// Surfaces are searched only as far as the farthest captor: less work than
    /// [`meet`](Self::meet) where few rays cross a captor.
    pub fn glance(&self, ray: &Ray, mut visit: impl FnMut(Crossing)) {
        let Shapes { surface_bvh, captor_bvh, round_captors, .. } = &*self.shapes;
        if !self.shapes.is_plain {
            self.meet_in_pieces(ray, &mut visit);
            return;
        }
        let mut farthest = 0.0;
        captor_bvh.crossings(ray, f32::INFINITY, |hit| farthest = hit.t.max(farthest));
        round_captors.crossings(ray, f32::INFINITY, |_, hit| farthest = hit.t.max(farthest));
        if farthest > 0.0 {
            let hit = surface_bvh.closest(ray, farthest.next_up());
            let t_max = hit.map_or(f32::INFINITY, |hit| hit.t);
            self.cross_rounds(ray, t_max.next_up(), Some(t_max), |_, _| true, &mut visit);
            let mut visit = self.crossing(ray, &mut visit);
            captor_bvh.crossings(ray, t_max.next_up(), |hit| visit(hit, hit.t == t_max));
        }
    }

    #[inline]
    fn surface_hit(&self, ray: &Ray, hit: &Hit) -> SurfaceHit {
        let triangle = hit.triangle as usize;
        if self.objects.surfaces[triangle].may_be_near_edge(hit) {
            return SurfaceHit::from(self.hit_near_edge(ray, hit));
        }
        SurfaceHit { t: hit.t, triangle, point: hit.point }
    }

    /// Returns the hit near an edge, packed so that this rare call does not force the usual hit into
    /// memory.
    #[cold]
    fn hit_near_edge(&self, ray: &Ray, hit: &Hit) -> PackedHit {
        let triangle = hit.triangle as usize;
        if !self.is_near_edge(triangle, hit) {
            return PackedHit { point_and_t: hit.point.extend(hit.t), triangle };
        }
        let shape = |t| self.shapes.surface_shape(t);
        let reach = self.objects.surfaces[triangle].reach;
        let front = front_at_edge(&self.shapes.surface_bvh, shape, ray, hit, reach);
        let triangle = front.triangle as usize;
        let own = &self.shapes.triangles[triangle];
        let point = self.objects.surfaces[triangle].off_edges(own, front.point.as_dvec3());
        PackedHit { point_and_t: point.extend(front.t), triangle }
    }

    /// Returns whether a hit is so near to an edge of the triangle of a surface, of this index, that
    /// its error, that of a ray from afar included, may put it beyond the edge.
    fn is_near_edge(&self, triangle: usize, hit: &Hit) -> bool {
        let weights = Vec3::new(1.0 - hit.u - hit.v, hit.u, hit.v);
        let change = ROUNDING * self.shapes.triangles[triangle].slopes();
        weights.cmplt(change * (MARGINS * (self.objects.surfaces[triangle].reach + hit.t))).any()
    }

    /// Returns the barycentric weights below which a point of the triangle of a surface may be too
    /// near to the edge opposite each corner; at most 1/3, the weight of the centroid.
    pub fn margins(&self, triangle: usize) -> Vec3 {
        let change = ROUNDING * self.triangles().at(triangle).slopes();
        Triangle::margins(change, MARGINS * self.surface(triangle).reach)
    }

    /// Returns a function that turns the hit of a captor's triangle into a [`Crossing`] and visits
    /// it. The second argument tells whether a surface is met at the same distance: a ray from afar
    /// cannot tell a captor from the surface that it lies in, and crosses it first only if it comes
    /// from the side to which the captor is lifted.
    #[inline]
    fn crossing<'v>(
        &'v self,
        ray: &'v Ray,
        visit: &'v mut impl FnMut(Crossing),
    ) -> impl FnMut(Hit, bool) + 'v {
        move |hit, tied| {
            let triangle = hit.triangle as usize;
            let shape = &self.captor_triangles()[triangle];
            let captor = self.shapes.captor_of_triangle[triangle] as usize;
            let front = shape.cross().dot(ray.direction) < 0.0;
            if !tied || (front && self.lift(captor) > 0.0) {
                visit(Crossing { t: hit.t, captor, triangle, front, point: hit.point });
            }
        }
    }

    /// Visits the index of every triangle that may reach into the ball of `radius`, m, around
    /// `center`, in the same mesh as `triangle`: its own copy where copies share their triangles, or
    /// else all surfaces that do not.
    pub fn near(&self, triangle: usize, center: Vec3, radius: f32, mut visit: impl FnMut(usize)) {
        let Shapes { surface_bvh, forest, .. } = &*self.shapes;
        let placed = &self.shapes.placed;
        if let (Some(copy), Some(forest)) = (placed.locate(triangle), forest) {
            let (instance, first) = (placed.instance(&copy), triangle - copy.triangle);
            return forest.near_in(instance, center, radius, |member| visit(first + member));
        }
        // images are visited where they come from
        let own = self.objects.surfaces.len();
        surface_bvh.near(center, radius, |triangle| {
            if (triangle as usize) < own {
                visit(triangle as usize);
            }
        });
    }

    /// Returns the triangles of surfaces that coincide with an earlier one, corner by corner, each
    /// with the first of them, in rising order. Rays meet only the first.
    pub fn copies(&self) -> &[[u32; 2]] {
        &self.shapes.copies
    }

    /// Returns the indices of the triangles that [stand for all](Self::standing_for_all), without
    /// [copies](Self::copies) and those without area. Neighbours mostly follow each other, so that
    /// to look around each of them in turn reads the same memory again.
    pub fn distinct_by_place(&self) -> Vec<usize> {
        /// Beyond all coordinates, m.
        const ANYWHERE: f32 = 1e18;
        let own = self.unshared();
        let mut found = Vec::with_capacity(own);
        self.shapes.surface_bvh.near(Vec3::ZERO, ANYWHERE, |triangle| {
            // an image stands for nothing
            if (triangle as usize) < own {
                found.push(triangle as usize);
            }
        });
        found.extend(self.standing_for_all().skip(own));
        found
    }

    /// Returns whether any triangle that lies in the plane of this one over its middle is `wanted`.
    /// It looks at the triangles of surfaces without [copies](Self::copies), this one among them.
    /// `None` if more than 100 triangles lie there and none of those looked at is wanted.
    pub fn has_coincident(
        &self,
        triangle: usize,
        mut wanted: impl FnMut(usize) -> bool,
    ) -> Option<bool> {
        let shape = self.triangles().at(triangle);
        let (middle, normal) = (shape.centroid(), shape.normal());
        // no more than the rounding of the triangles themselves: rays tell those apart that lie farther
        let reach = ROUNDING * middle.length() + shape.offset_at(middle);
        let crosses = |ray: &Ray, t_max: f32, visit: &mut dyn FnMut(Found) -> bool| {
            self.shapes.crosses(ray, t_max, visit);
        };
        has_parallel(crosses, middle, normal, reach, |found| wanted(found.index))
    }

    /// Returns the ray that leaves a surface where another has met it. It starts off the surface, on
    /// the side of the unit normal `side`, by the error of the point.
    #[inline]
    pub fn leave(&self, hit: &SurfaceHit, side: Vec3, direction: Vec3) -> Ray {
        self.surface_at(hit).leave(hit.point, side, direction)
    }

    /// Returns the ray that goes on straight through the surface that it has met.
    pub fn pass(&self, hit: &SurfaceHit, direction: Vec3) -> Ray {
        let normal = self.surface(hit.triangle).normal;
        self.leave(hit, normal * normal.dot(direction).signum(), direction)
    }

    /// Returns the distance along a ray up to which lights that lie in the surface that it meets are
    /// met, m. Without a surface it is infinite.
    #[inline]
    pub fn beyond(&self, hit: Option<&SurfaceHit>) -> f32 {
        hit.map_or(f32::INFINITY, |hit| {
            let surface = self.surface_at(hit);
            let in_plane = surface.extra_offset + ROUNDING * across(surface.normal, hit.point);
            let error = 4.0 * in_plane + closeness(hit.point);
            hit.t * (1.0 + ROUNDING) + error
        })
    }
}

/// Returns the hit of a ray near the edge of a triangle of a search structure, of which `shape` gives
/// the corners; the bound of their error is `reach` over [`ROUNDING`]. At the outline of a mesh, the
/// distances of the face that looks at the ray and of the face that looks away differ by less than
/// their error. There the face in front is taken as hit; otherwise light that grazes a closed mesh
/// would enter it.
fn front_at_edge<'t>(
    bvh: &Bvh,
    shape: impl Fn(u32) -> &'t Triangle,
    ray: &Ray,
    hit: &Hit,
    reach: f32,
) -> Hit {
    let mut front = *hit;
    let triangle = shape(hit.triangle);
    let t_max = hit.t + GRAZING * ROUNDING * (reach + hit.t);
    bvh.occluded(ray, t_max, |other| {
        let before = shape(other.triangle).is_before_at_fold(triangle, ray.direction);
        if before {
            front = other;
        }
        before
    });
    front
}
