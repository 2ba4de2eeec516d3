//! Rays in a scene that repeats, or whose copies share triangles.
//!
//! The search structures hold everything that reaches into the cell (0, 0), from whichever cell.
//! A ray is followed from cell to cell; where nothing repeats, it is of one piece. What it meets is reported where the scene describes it: a
//! hit has the index of the triangle itself and the point there, and the next ray starts from that
//! point. Lengths are those of the ray's way.

use glam::Vec3;

use super::{
    Crossing, Scene, Surface, SurfaceHit, front_at_edge,
    shapes::{Found, has_parallel},
    shared::Surfaced,
};
use crate::{
    math::{
        geometry::{Ray, Triangle, closeness},
        spectrum::{Lanes, Spectrum},
    },
    scene::{
        bvh::Hit,
        lattice::{Cell, Repeats, Stretch, Walk},
        light::EmitterHit,
        material::Scatterer,
    },
};

/// The pieces of a ray.
enum Pieces<'s> {
    /// Those in the cells that it comes through.
    Cells(Walk<'s>),
    /// The ray as it is.
    Whole(Option<Stretch>),
}

impl Pieces<'_> {
    /// Returns whether the ray was given up before its end.
    fn is_lost(&self) -> bool {
        matches!(self, Self::Cells(walk) if walk.is_lost)
    }
}

impl Iterator for Pieces<'_> {
    type Item = Stretch;

    fn next(&mut self) -> Option<Stretch> {
        match self {
            Self::Cells(walk) => walk.next(),
            Self::Whole(ray) => ray.take(),
        }
    }
}

/// What a ray has met close to the borders of the cells that it comes through. Rounding may put what
/// lies in a border into both cells, or into neither. Close to a border it counts in the first cell
/// that sees it, and not once more in the next.
struct Borders<S> {
    /// What was met there, the cell that it is in, and the distance along the whole ray, m.
    met: Vec<(S, Cell, f64)>,
}

impl<S: PartialEq> Borders<S> {
    fn new() -> Self {
        Self { met: Vec::new() }
    }

    /// Returns whether a shape counts that a ray meets at the distance `t` of a stretch. It is that of
    /// `cell`, as seen from the cell of the stretch.
    #[inline]
    fn count(&mut self, stretch: &Stretch, t: f32, shape: S, cell: Cell) -> bool {
        let ([from, to], [before, after]) = (stretch.inside, stretch.slack);
        if (from + before..to - after).contains(&t) {
            return true;
        }
        (from - before..to + after).contains(&t) && self.count_once(stretch, t, shape, cell)
    }

    #[inline(never)]
    fn count_once(&mut self, stretch: &Stretch, t: f32, shape: S, cell: Cell) -> bool {
        let cell = [0, 1].map(|axis| stretch.cell[axis] + cell[axis]);
        let (start, near) = (stretch.start, 4.0 * f64::from(stretch.slack[0]));
        // what a ray meets in a stretch comes in any order
        self.met.retain(|(_, _, way)| start - way < near);
        let is_new = self.met.iter().all(|(other, of, _)| (other, of) != (&shape, &cell));
        if is_new {
            self.met.push((shape, cell, start + f64::from(t)));
        }
        is_new
    }
}

impl Scene {
    /// Returns the pieces of a ray.
    fn pieces(&self, ray: &Ray) -> Pieces<'_> {
        match &self.shapes.repeats {
            Some(repeats) => Pieces::Cells(repeats.walk(ray)),
            None => Pieces::Whole(Some(Stretch {
                ray: *ray,
                start: 0.0,
                inside: [0.0, f32::INFINITY],
                slack: [0.0; 2],
                cell: [0, 0],
            })),
        }
    }

    /// The search of [`closest`](Self::closest).
    #[inline(never)]
    pub(super) fn closest_in_pieces(&self, ray: &Ray) -> Option<SurfaceHit> {
        for stretch in self.pieces(ray) {
            if let Some(met) = self.shapes.first_met(&stretch.ray, stretch.end()) {
                return Some(self.hit_in_piece(&stretch, met));
            }
        }
        None
    }

    /// The search of [`meet`](Self::meet).
    #[inline(never)]
    pub(super) fn meet_in_pieces(
        &self,
        ray: &Ray,
        visit: &mut dyn FnMut(Crossing),
    ) -> Option<SurfaceHit> {
        let mut borders = Borders::new();
        for stretch in self.pieces(ray) {
            let t_max = stretch.end();
            let met = self.shapes.first_met(&stretch.ray, t_max);
            if self.has_virtual_captors() {
                let t = met.map(|met| met.t());
                let t_max = t.map_or(t_max, f32::next_up);
                self.cross_in_piece(&stretch, t_max, t, &mut borders, visit);
            }
            if let Some(met) = met {
                return Some(self.hit_in_piece(&stretch, met));
            }
        }
        None
    }

    /// The search of [`crossings`](Self::crossings).
    #[cold]
    #[inline(never)]
    pub(super) fn crossings_in_pieces(
        &self,
        ray: &Ray,
        t_max: f32,
        visit: &mut dyn FnMut(Crossing),
    ) {
        let t_max = f64::from(t_max);
        let mut borders = Borders::new();
        for stretch in self.pieces(ray).take_while(|stretch| stretch.start < t_max) {
            let to = stretch.end().min((t_max - stretch.start) as f32);
            self.cross_in_piece(&stretch, to, None, &mut borders, visit);
        }
    }

    /// Visits the captors that a ray crosses in a stretch, before `t_max`. `hit` is the distance at
    /// which it meets a surface.
    fn cross_in_piece(
        &self,
        stretch: &Stretch,
        t_max: f32,
        hit: Option<f32>,
        borders: &mut Borders<(usize, bool)>,
        visit: &mut dyn FnMut(Crossing),
    ) {
        let mut visit = |crossing: Crossing| {
            let t = (stretch.start + f64::from(crossing.t)) as f32;
            visit(Crossing { t, ..crossing });
        };
        let counts = |crossing: &Crossing, cell| {
            borders.count(stretch, crossing.t, (crossing.triangle, crossing.front), cell)
        };
        self.cross_rounds(&stretch.ray, t_max, hit, counts, &mut visit);
        let own = self.captor_triangles().len();
        self.shapes.captor_bvh.crossings(&stretch.ray, t_max, |mut crossed| {
            let mut cell = [0, 0];
            if let Some(repeats) = &self.shapes.repeats {
                (crossed.triangle, cell) = repeats.captors.origin(crossed.triangle, own);
                crossed.point -= repeats.lattice.shift(cell).as_vec3();
            }
            self.crossing(&stretch.ray, &mut |crossing: Crossing| {
                let shape = (crossing.triangle, crossing.front);
                if borders.count(stretch, crossing.t, shape, cell) {
                    visit(crossing);
                }
            })(crossed, hit == Some(crossed.t));
        });
    }

    /// Returns the hit of a surface where the scene describes it.
    fn hit_in_piece(&self, stretch: &Stretch, met: Surfaced) -> SurfaceHit {
        let hit = match (met, &self.shapes.repeats) {
            (Surfaced::Shared(met), _) => self.hit_of_copy(&stretch.ray, &met),
            (Surfaced::Own(hit), None) => self.surface_hit(&stretch.ray, &hit),
            (Surfaced::Own(hit), Some(repeats)) => self.hit_in_cell(repeats, stretch, hit),
        };
        SurfaceHit { t: (stretch.start + f64::from(hit.t)) as f32, ..hit }
    }

    fn hit_in_cell(&self, repeats: &Repeats, stretch: &Stretch, mut hit: Hit) -> SurfaceHit {
        let own = self.shapes.triangles.len();
        let of = |hit: &Hit| repeats.surfaces.origin(hit.triangle, own).0 as usize;
        let surface = &self.objects.surfaces[of(&hit)];
        let is_near_edge = surface.may_be_near_edge(&hit) && self.is_near_edge(of(&hit), &hit);
        if is_near_edge {
            let shape = |t| self.shapes.surface_shape(t);
            let bvh = &self.shapes.surface_bvh;
            hit = front_at_edge(bvh, shape, &stretch.ray, &hit, surface.reach);
        }
        let (triangle, cell) = repeats.surfaces.origin(hit.triangle, own);
        let triangle = triangle as usize;
        let shape = &self.shapes.triangles[triangle];
        // the corners of an image are rounded otherwise
        let point = hit.point.as_dvec3() - repeats.lattice.shift(cell);
        let point = if cell == [0, 0] { point } else { shape.foot(point) };
        let point = match is_near_edge {
            true => self.objects.surfaces[triangle].off_edges(shape, point),
            false => point.as_vec3(),
        };
        SurfaceHit { t: hit.t, triangle, point }
    }

    /// Returns whether a direction leads up from the slope on which the scene repeats; up from the
    /// horizontal if it does not.
    pub fn rises(&self, direction: Vec3) -> bool {
        let direction = direction.as_dvec3();
        self.lattice().map_or(direction.z, |lattice| lattice.level(direction)) > 0.0
    }

    /// Returns whether a triangle of a surface reaches over more periods than are followed.
    pub fn reaches_far(&self, triangle: usize) -> bool {
        self.lattice().is_some_and(|lattice| lattice.reaches_far(&self.triangles().at(triangle)))
    }

    /// Returns the number of triangles of surfaces that reach out of the cell (0, 0).
    pub fn reaching_out(&self) -> usize {
        let Some(repeats) = &self.shapes.repeats else { return 0 };
        let cell = |p: Vec3| repeats.lattice.cell_of(p.as_dvec3());
        let reaches =
            |t: &Triangle| [t.a, t.b, t.c].into_iter().any(|corner| cell(corner) != [0, 0]);
        let slack = repeats.layers.slack as f32;
        // what only touches the border stays in the cell
        let shrunk = |t: &Triangle| -> Triangle {
            let middle = t.centroid();
            let inwards = |p: Vec3| p + 4.0 * slack * (middle - p).normalize_or_zero();
            [inwards(t.a), inwards(t.b), inwards(t.c)].into()
        };
        let out = |triangle: Triangle| reaches(&shrunk(&triangle));
        let own = self.shapes.triangles.iter().filter(|t| out(**t)).count();
        let copies = self
            .shared_copies()
            .filter(|copy| copy.extent.corners().into_iter().any(|corner| cell(corner) != [0, 0]));
        let of_copies = copies.flat_map(|copy| copy.first..copy.first + copy.triangles);
        own + of_copies.filter(|&t| out(self.triangles().at(t))).count()
    }

    /// Returns whether a triangle of a surface lies in the plane of an image of its own object, which
    /// overlaps it. It looks at its middle and close to its corners.
    pub fn lies_on_its_image(&self, triangle: usize) -> bool {
        let Some(repeats) = &self.shapes.repeats else { return false };
        if repeats.surfaces.of.is_empty() && self.shapes.forest.is_none() {
            return false;
        }
        let (object, shape) = (self.object(triangle), self.triangles().at(triangle));
        let places = [(1.0 / 3.0, 1.0 / 3.0), (0.02, 0.02), (0.96, 0.02), (0.02, 0.96)];
        places.map(|(u, v)| shape.point(u, v)).into_iter().any(|point| {
            let cell = repeats.lattice.cell_of(point.as_dvec3());
            let inside = point - repeats.lattice.shift(cell).as_vec3();
            let reach = closeness(inside) + 4.0 * shape.offset_at(inside);
            let crosses = |ray: &Ray, t_max: f32, visit: &mut dyn FnMut(Found) -> bool| {
                self.shapes.crosses(ray, t_max, visit);
            };
            has_parallel(crosses, inside, shape.normal(), reach, |found| {
                let in_place = found.cell == cell.map(|i| -i);
                !in_place && self.object(found.index) == object
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

    /// Returns a ray that leaves a surface where `before` has met it in the coordinates of that ray,
    /// however many periods away the scene describes the surface.
    pub fn unfolded(&self, before: &Ray, hit: &SurfaceHit, ray: Ray) -> Ray {
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
        if self.lighting.shapes.triangles.is_empty() && self.lighting.shapes.images.tubes.is_empty()
        {
            return;
        }
        let mut borders = Borders::new();
        for stretch in repeats.walk(ray).take_while(|stretch| stretch.start < f64::from(t_max)) {
            let left = (f64::from(t_max) - stretch.start) as f32;
            let to = stretch.end().min(left);
            let mut met = |shape: (usize, u32), cell: Cell, hit: EmitterHit| {
                let (light, _) = shape;
                if hit.t < to && borders.count(&stretch, hit.t, shape, cell) {
                    let t = (stretch.start + f64::from(hit.t)) as f32;
                    let image = [0, 1].map(|axis| stretch.cell[axis] + cell[axis]);
                    visit(light, EmitterHit { t, image, ..hit });
                }
            };
            for &(light, cell) in &self.lighting.shapes.images.tubes {
                let origin = stretch.ray.origin - repeats.lattice.shift(cell).as_vec3();
                if let Some(hit) = self.lighting.lights[light].hit(&Ray { origin, ..stretch.ray }) {
                    met((light, 0), cell, hit);
                }
            }
            if self.lighting.shapes.triangles.is_empty() {
                continue;
            }
            let own = self.lighting.shapes.triangles.len();
            self.lighting.shapes.bvh.crossings(&stretch.ray, to, |hit| {
                let (triangle, cell) =
                    self.lighting.shapes.images.triangles.origin(hit.triangle, own);
                if let Some((light, hit)) = self.emitter_hit(&stretch.ray, triangle, hit.t) {
                    met((light, triangle), cell, hit);
                }
            });
        }
    }

    /// The search of [`passes_straight`](Self::passes_straight).
    #[inline(never)]
    pub(super) fn passes_in_pieces<L: Lanes>(
        &self,
        ray: &Ray,
        distance: f32,
        pass: &mut impl FnMut(&Surface, Spectrum<L>),
    ) -> bool {
        let (mut pieces, mut borders) = (self.pieces(ray), Borders::new());
        for stretch in pieces.by_ref() {
            if stretch.start >= f64::from(distance) {
                break;
            }
            let left = (f64::from(distance) - stretch.start) as f32;
            let t_max = left.min(stretch.end());
            let occluded = self.shapes.occluded(&stretch.ray, t_max, |met| {
                let (triangle, cell) = met.origin(&self.shapes);
                let surface = &self.surface(triangle);
                let material = self.material(surface);
                let straight = material.straight::<L>(ray.direction, surface.normal);
                let Some(straight) = straight else { return true };
                if met.is_owned() && borders.count(&stretch, met.t(), triangle, cell) {
                    pass(surface, straight);
                }
                false
            });
            if occluded {
                return false;
            }
        }
        !pieces.is_lost()
    }

    /// Returns the farthest opening of a light at infinity that a ray crosses, as
    /// [`Entrance::last_opening`](crate::scene::light::Entrance::last_opening).
    pub(super) fn last_opening_in_cells(
        &self,
        light: usize,
        ray: &Ray,
        offset: f32,
    ) -> Option<(f32, bool)> {
        let entrance = self.lighting.lights[light].entrance()?;
        let Some(repeats) = &self.shapes.repeats else { return entrance.last_opening(ray, offset) };
        let openings = self.lighting.shapes.images.openings.get(&light)?;
        let shapes = || entrance.openings().iter().chain(&openings.images.shapes);
        let starts_in: Vec<bool> = {
            let shift = repeats.lattice.shift(repeats.lattice.cell_of(ray.origin.as_dvec3()));
            let origin = (ray.origin.as_dvec3() - shift).as_vec3();
            let near = |t: &Triangle| (origin - t.a).dot(t.normal()).abs() < offset;
            shapes().map(near).collect()
        };
        let mut last = None;
        for stretch in Walk::new(&repeats.lattice, &openings.layers, ray) {
            // those near a border may be seen in both cells; the farthest is the same
            let (from, to) = (stretch.inside[0] - stretch.slack[0], stretch.end());
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
