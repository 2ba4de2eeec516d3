//! Rays in a scene that repeats.
//!
//! The search structures hold everything that reaches into the cell (0, 0), from whichever cell.
//! A ray is followed from cell to cell. What it meets is reported where the scene describes it: a
//! hit has the index of the triangle itself and the point there, and the next ray starts from that
//! point. Lengths are those of the ray's way.

use glam::Vec3;

use super::{Crossing, Scene, SurfaceHit, shapes::has_parallel};
use crate::{
    math::{
        geometry::{Ray, Triangle, closeness},
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        bvh::Hit,
        lattice::{Cell, Repeats, Stretch, Walk},
        light::EmitterHit,
    },
};

impl Scene {
    /// The search of [`closest`](Self::closest).
    #[cold]
    #[inline(never)]
    pub(super) fn closest_in_cells(&self, repeats: &Repeats, ray: &Ray) -> Option<SurfaceHit> {
        let slack = repeats.layers.slack as f32;
        for stretch in repeats.walk(ray) {
            let t_max = stretch.inside[1] + slack;
            if let Some(hit) = self.shapes.surface_bvh.closest(&stretch.ray, t_max) {
                return Some(self.hit_in_cell(repeats, &stretch, hit));
            }
        }
        None
    }

    /// The search of [`meet`](Self::meet).
    #[cold]
    #[inline(never)]
    pub(super) fn meet_in_cells(
        &self,
        repeats: &Repeats,
        ray: &Ray,
        visit: &mut dyn FnMut(Crossing),
    ) -> Option<SurfaceHit> {
        let slack = repeats.layers.slack as f32;
        for stretch in repeats.walk(ray) {
            let t_max = stretch.inside[1] + slack;
            let hit = self.shapes.surface_bvh.closest(&stretch.ray, t_max);
            if !self.shapes.captor_bvh.is_empty() {
                let [from, to] = stretch.inside;
                let t = hit.map(|hit| hit.t);
                let to = t.map_or(to, f32::next_up);
                self.cross_in_cell(repeats, &stretch, [from, to], t, visit);
            }
            if let Some(hit) = hit {
                return Some(self.hit_in_cell(repeats, &stretch, hit));
            }
        }
        None
    }

    /// The search of [`crossings`](Self::crossings).
    #[cold]
    #[inline(never)]
    pub(super) fn crossings_in_cells(
        &self,
        repeats: &Repeats,
        ray: &Ray,
        t_max: f32,
        visit: &mut dyn FnMut(Crossing),
    ) {
        let t_max = f64::from(t_max);
        for stretch in repeats.walk(ray).take_while(|stretch| stretch.start < t_max) {
            let [from, to] = stretch.inside;
            let to = to.min((t_max - stretch.start) as f32);
            self.cross_in_cell(repeats, &stretch, [from, to], None, visit);
        }
    }

    /// Visits the captors that a ray crosses at the distances `from <= t < to` of a stretch. `hit`
    /// is the distance at which it meets a surface.
    fn cross_in_cell(
        &self,
        repeats: &Repeats,
        stretch: &Stretch,
        [from, to]: [f32; 2],
        hit: Option<f32>,
        visit: &mut dyn FnMut(Crossing),
    ) {
        let own = self.captor_triangles().len();
        self.shapes.captor_bvh.crossings(&stretch.ray, to, |mut crossed| {
            if crossed.t < from {
                return;
            }
            let (triangle, cell) = repeats.captors.origin(crossed.triangle, own);
            crossed.triangle = triangle;
            crossed.point -= repeats.lattice.shift(cell).as_vec3();
            self.crossing(&stretch.ray, &mut *visit)(crossed, hit == Some(crossed.t));
        });
    }

    /// Returns the hit of a surface where the scene describes it.
    fn hit_in_cell(&self, repeats: &Repeats, stretch: &Stretch, mut hit: Hit) -> SurfaceHit {
        let own = self.triangles().len();
        let of = |hit: &Hit| repeats.surfaces.origin(hit.triangle, own).0 as usize;
        let surface = &self.surfaces[of(&hit)];
        if self.is_near_edge(of(&hit), &hit) {
            hit = self.front_at_edge(&stretch.ray, &hit, surface.reach);
        }
        let triangle = of(&hit);
        let point = self.triangles()[triangle].point(hit.u, hit.v);
        let point = self.off_edges(triangle, point, hit.u, hit.v);
        SurfaceHit { t: (stretch.start + f64::from(hit.t)) as f32, triangle, point }
    }

    /// Returns whether a direction leads up from the slope on which the scene repeats; up from the
    /// horizontal if it does not.
    pub fn rises(&self, direction: Vec3) -> bool {
        let direction = direction.as_dvec3();
        self.lattice().map_or(direction.z, |lattice| lattice.level(direction)) > 0.0
    }

    /// Returns the number of triangles of surfaces that reach out of the cell (0, 0).
    pub fn reaching_out(&self) -> usize {
        let Some(repeats) = &self.shapes.repeats else { return 0 };
        let cell = |p: Vec3| repeats.lattice.cell_of(p.as_dvec3());
        let reaches =
            |t: &&Triangle| [t.a, t.b, t.c].into_iter().any(|corner| cell(corner) != [0, 0]);
        let slack = repeats.layers.slack as f32;
        // what only touches the border stays in the cell
        let shrunk = |t: &Triangle| -> Triangle {
            let middle = t.centroid();
            let inwards = |p: Vec3| p + 4.0 * slack * (middle - p).normalize_or_zero();
            [inwards(t.a), inwards(t.b), inwards(t.c)].into()
        };
        self.triangles().iter().map(shrunk).filter(|t| reaches(&t)).count()
    }

    /// Returns whether a triangle of a surface lies in the plane of an image of its own object, which
    /// overlaps it. It looks at its middle and close to its corners.
    pub fn lies_on_its_image(&self, triangle: usize) -> bool {
        let Some(repeats) = self.shapes.repeats.as_ref().filter(|r| !r.surfaces.of.is_empty())
        else {
            return false;
        };
        let (own, shape) = (self.triangles().len(), self.triangles()[triangle]);
        let object = self.object(triangle);
        let places = [(1.0 / 3.0, 1.0 / 3.0), (0.02, 0.02), (0.96, 0.02), (0.02, 0.96)];
        places.map(|(u, v)| shape.point(u, v)).into_iter().any(|point| {
            let cell = repeats.lattice.cell_of(point.as_dvec3());
            let inside = point - repeats.lattice.shift(cell).as_vec3();
            let reach = closeness(inside) + 4.0 * shape.offset();
            let corners = |t| *self.shapes.surface_shape(t);
            let bvh = &self.shapes.surface_bvh;
            has_parallel(bvh, corners, inside, shape.normal(), reach, |t| {
                let (of, image) = repeats.surfaces.origin(t, own);
                let in_place = image == cell.map(|i| -i);
                !in_place && self.object(of as usize) == object
            }) == Some(true)
        })
    }

    /// Returns whether a ray that meets no surface was given up: it runs level through more cells
    /// than are followed.
    pub fn is_endless(&self, ray: &Ray) -> bool {
        self.shapes.repeats.as_ref().is_some_and(|repeats| {
            let mut walk = repeats.walk(ray);
            walk.by_ref().for_each(drop);
            walk.is_lost
        })
    }

    /// Returns the ray that leaves a surface where `before` has met it, like
    /// [`leave`](Self::leave), but in the coordinates of that ray, however many periods away the
    /// scene describes the surface.
    pub fn leave_on(&self, before: &Ray, hit: &SurfaceHit, side: Vec3, direction: Vec3) -> Ray {
        let ray = self.leave(hit, side, direction);
        Ray { origin: ray.origin + self.periods_to(before, hit), ..ray }
    }

    /// Returns the whole periods from the place where the scene describes a hit to where the ray has
    /// met it; zero in a scene that does not repeat.
    fn periods_to(&self, ray: &Ray, hit: &SurfaceHit) -> Vec3 {
        self.lattice().map_or(Vec3::ZERO, |lattice| {
            let met = ray.origin.as_dvec3() + f64::from(hit.t) * ray.direction.as_dvec3();
            lattice.shift(lattice.between(hit.point.as_dvec3(), met)).as_vec3()
        })
    }

    /// The search of [`emitters_met`](Self::emitters_met).
    #[cold]
    #[inline(never)]
    pub(super) fn emitters_in_cells(
        &self,
        repeats: &Repeats,
        ray: &Ray,
        t_max: f32,
        visit: &mut dyn FnMut(usize, EmitterHit),
    ) {
        if self.light_triangles.is_empty() && self.light_images.tubes.is_empty() {
            return;
        }
        for stretch in repeats.walk(ray).take_while(|stretch| stretch.start < f64::from(t_max)) {
            let [from, to] = stretch.inside;
            let to = to.min((f64::from(t_max) - stretch.start) as f32);
            let mut met = |light: usize, cell: Cell, hit: EmitterHit| {
                if (from..to).contains(&hit.t) {
                    let t = (stretch.start + f64::from(hit.t)) as f32;
                    let image = [0, 1].map(|axis| stretch.cell[axis] + cell[axis]);
                    visit(light, EmitterHit { t, image, ..hit });
                }
            };
            for &(light, cell) in &self.light_images.tubes {
                let origin = stretch.ray.origin - repeats.lattice.shift(cell).as_vec3();
                if let Some(hit) = self.lights[light].tube_hit(&Ray { origin, ..stretch.ray }) {
                    met(light, cell, hit);
                }
            }
            if self.light_triangles.is_empty() {
                continue;
            }
            let own = self.light_triangles.len();
            self.light_bvh.crossings(&stretch.ray, to, |hit| {
                let (triangle, cell) = self.light_images.triangles.origin(hit.triangle, own);
                if let Some((light, hit)) = self.emitter_hit(&stretch.ray, triangle, hit.t) {
                    met(light, cell, hit);
                }
            });
        }
    }

    /// The search of [`visibility_along`](Self::visibility_along).
    #[cold]
    #[inline(never)]
    pub(super) fn visibility_in_cells<L: Lanes>(
        &self,
        repeats: &Repeats,
        ray: &Ray,
        distance: f32,
    ) -> Option<Spectrum<L>> {
        let mut through = Spectrum::splat(self.lanes(), 1.0);
        let (slack, own) = (repeats.layers.slack as f32, self.triangles().len());
        let mut walk = repeats.walk(ray);
        for stretch in walk.by_ref() {
            if stretch.start >= f64::from(distance) {
                break;
            }
            let [from, to] = stretch.inside;
            let left = (f64::from(distance) - stretch.start) as f32;
            let occluded =
                self.shapes.surface_bvh.occluded(&stretch.ray, left.min(to + slack), |hit| {
                    let triangle = repeats.surfaces.origin(hit.triangle, own).0;
                    let surface = &self.surfaces[triangle as usize];
                    let material = self.material(surface);
                    let straight = material.straight::<L>(ray.direction, surface.normal);
                    let Some(straight) = straight else { return true };
                    // on a border only one of the two cells counts it
                    if hit.owned && (from..to).contains(&hit.t) {
                        through = through.clone() * straight;
                    }
                    false
                });
            if occluded {
                return None;
            }
        }
        (!walk.is_lost).then_some(through)
    }

    /// Returns the farthest opening of a light at infinity that a ray crosses, as
    /// [`Entrance::last_opening`](crate::scene::light::Entrance::last_opening).
    pub(super) fn last_opening_in_cells(
        &self,
        light: usize,
        ray: &Ray,
        offset: f32,
    ) -> Option<(f32, bool)> {
        let entrance = self.lights[light].entrance()?;
        let Some(repeats) = &self.shapes.repeats else { return entrance.last_opening(ray, offset) };
        let openings = self.light_images.openings.get(&light)?;
        let shapes = || entrance.openings().iter().chain(&openings.images.shapes);
        let starts_in: Vec<bool> = {
            let shift = repeats.lattice.shift(repeats.lattice.cell_of(ray.origin.as_dvec3()));
            let origin = (ray.origin.as_dvec3() - shift).as_vec3();
            let near = |t: &Triangle| (origin - t.a).dot(t.normal()).abs() < offset;
            shapes().map(near).collect()
        };
        let mut last = None;
        for stretch in Walk::new(&repeats.lattice, &openings.layers, ray) {
            let [from, to] = stretch.inside;
            for (triangle, _) in shapes().zip(&starts_in).filter(|(_, starts_in)| !**starts_in) {
                let crossed = triangle.crossed_at(&stretch.ray);
                if let Some(t) = crossed.filter(|t| *t > 0.0 && (from..to).contains(t)) {
                    let t = (stretch.start + f64::from(t)) as f32;
                    if last.is_none_or(|(before, _)| before < t) {
                        last = Some((t, triangle.normal().dot(ray.direction) > 0.0));
                    }
                }
            }
        }
        last
    }
}
