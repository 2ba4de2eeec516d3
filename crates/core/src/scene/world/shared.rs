//! Triangles of copies that share them, as the rest of the program sees them.

use std::borrow::Cow;

use glam::{DVec3, Mat3, Vec3};

use super::{
    Common, MARGINS, NO_CAPTOR, ObjectCopy, Scene, Surface, SurfaceHit,
    shapes::Shapes,
    triangles::{Alike, SharedCopy, Standing, Triangles, located},
};
use crate::{
    math::geometry::{Extent, ROUNDING, Ray, Triangle},
    scene::{
        bvh::Hit,
        captor::{Captor, CaptorKind},
        instances::{Instance, Located, Met, Placed},
        lattice::Cell,
    },
};

impl Scene {
    /// Returns the triangles of all surfaces.
    #[inline]
    pub fn triangles(&self) -> Triangles<'_> {
        Triangles::new(&self.shapes)
    }

    /// Returns the number of triangles that are kept in memory: those of shared copies once.
    pub fn distinct_triangles(&self) -> usize {
        let shared = self.shapes.placed.prototypes.iter().map(|p| p.triangles.len());
        self.shapes.triangles.len() + shared.sum::<usize>()
    }

    /// Returns the triangles of which each shape is there once: those that are no shared copies, and
    /// those of the first copy of each object.
    pub fn standing(&self) -> Vec<Standing> {
        let own = Standing { triangles: 0..self.unshared(), copies: 1, area: 1.0 };
        let shared = self.alike().map(|Alike { triangles, areas }| Standing {
            triangles,
            copies: areas.len(),
            area: areas.iter().sum(),
        });
        std::iter::once(own).chain(shared).collect()
    }

    /// Returns the indices of those triangles.
    pub fn standing_for_all(&self) -> impl Iterator<Item = usize> + use<> {
        self.standing().into_iter().flat_map(|standing| standing.triangles)
    }

    /// Returns the number of triangles that are no shared copies; they come first.
    pub fn unshared(&self) -> usize {
        self.shapes.triangles.len()
    }

    /// Returns the copies that share their triangles: of each the index of its first triangle, the
    /// number of its triangles and a box around it.
    pub fn shared_copies(&self) -> impl ExactSizeIterator<Item = SharedCopy> + use<'_> {
        let placed: &Placed = &self.shapes.placed;
        placed.boxes().into_iter().enumerate().map(|(index, extent)| SharedCopy {
            first: placed.first_of(index),
            triangles: placed.prototypes[placed.instances[index].prototype as usize]
                .triangles
                .len(),
            extent,
        })
    }

    /// Returns the copies that share their triangles, object by object.
    pub fn alike(&self) -> impl Iterator<Item = Alike> + use<'_> {
        let placed: &Placed = &self.shapes.placed;
        placed.prototypes.iter().map(|prototype| {
            let copies = &placed.instances[prototype.instances.clone()];
            let square = |instance: &Instance| f64::from(instance.scale()).powi(2);
            let first = copies.first().map_or(1.0, square);
            Alike {
                triangles: prototype.first..prototype.first + prototype.triangles.len(),
                areas: copies.iter().map(|instance| square(instance) / first).collect(),
            }
        })
    }

    /// Returns what the index of a triangle of a shared copy means; `None` for other triangles.
    pub(super) fn located(&self, triangle: usize) -> Option<Located> {
        let placed = &self.shapes.placed;
        if triangle < self.shapes.triangles.len() { None } else { placed.locate(triangle) }
    }

    /// Returns the triangles of a captor; of a disc or sphere those by which it is shown.
    pub fn triangles_of(&self, captor: &Captor) -> Cow<'_, [Triangle]> {
        if let Some(round) = self.round(captor) {
            let rounded = |corners: [DVec3; 3]| corners.map(|corner| corner.as_vec3()).into();
            return round.triangles().into_iter().map(rounded).collect();
        }
        let range = captor.triangles.clone();
        match captor.kind {
            CaptorKind::Virtual { .. } => Cow::Borrowed(&self.captor_triangles()[range]),
            CaptorKind::Surface => match self.shapes.triangles.get(range.clone()) {
                Some(triangles) => Cow::Borrowed(triangles),
                None => range.map(|triangle| self.triangles().at(triangle)).collect(),
            },
        }
    }

    /// Returns a box around a captor, m from the centre of the scene.
    pub fn extent_of(&self, captor: &Captor) -> Extent {
        match self.round(captor) {
            Some(round) => round.extent(),
            None => Extent::of_triangles(&*self.triangles_of(captor)),
        }
    }

    /// Returns the largest distance from a captor's triangles at which rays that leave them start, m;
    /// of a shared copy a bound of it.
    pub fn offset_of(&self, captor: &Captor) -> f32 {
        let first = captor.triangles.start;
        match captor.kind {
            CaptorKind::Surface if first >= self.unshared() => ROUNDING * self.surface(first).reach,
            _ => self.triangles_of(captor).iter().map(Triangle::offset).fold(0.0, f32::max),
        }
    }

    /// Returns the surfaces that are copies of an object, at least two of each.
    pub fn object_copies(&self) -> impl Iterator<Item = ObjectCopy> {
        let placed: &Placed = &self.shapes.placed;
        let shared = placed.prototypes.iter().zip(&self.objects.common).flat_map(
            move |(prototype, common)| {
                let each = prototype.triangles.len();
                (0..prototype.instances.len()).map(move |copy| {
                    let first = prototype.first + copy * each;
                    ObjectCopy {
                        object: common.object,
                        triangles: first..first + each,
                        transform: placed.transform(&located(placed, first)),
                    }
                })
            },
        );
        self.objects.copies.iter().cloned().chain(shared)
    }

    /// Returns the properties of a triangle of a copy, for rays that leave it at this point or, without
    /// one, anywhere.
    #[inline(never)]
    pub(super) fn shared_surface(&self, triangle: usize, point: Option<Vec3>) -> Surface {
        let placed = &self.shapes.placed;
        let located = located(placed, triangle);
        let (common, instance) =
            (&self.objects.common[located.prototype], placed.instance(&located));
        let mut surface = self.placed_surface(instance, located.triangle, common, point);
        if surface.captor != NO_CAPTOR {
            surface.captor += (common.first_captor + located.copy * common.captors) as u32;
        }
        surface
    }

    /// Returns the properties of a triangle where a copy stands, with the number of its captor
    /// among those of the copy.
    fn placed_surface(
        &self,
        instance: &Instance,
        triangle: usize,
        common: &Common,
        point: Option<Vec3>,
    ) -> Surface {
        let own = &common.surfaces[triangle];
        let placed = &self.shapes.placed;
        let (reach, radius) = placed.reach(instance);
        let normal = instance.turn(own.normal);
        let repeats = self.shapes.repeats.is_some();
        let extra_offset = match point {
            Some(point) if !repeats => placed.extra_offset_at(instance, normal, point),
            _ => placed.extra_offset(instance, normal, repeats),
        };
        Surface {
            normal,
            extra_offset,
            steepest: own.steepest / instance.scale(),
            reach: 1.1 * (reach.length() + radius),
            ..*own
        }
    }

    /// Returns the triangle of the first copy that a triangle repeats, and how a unit vector there
    /// turns to the copy's own place, which may mirror it. A triangle that is not of a shared copy
    /// repeats itself.
    pub fn in_first_copy(&self, triangle: usize) -> (usize, Mat3) {
        let placed = &self.shapes.placed;
        let Some(located) = self.located(triangle) else {
            return (triangle, Mat3::IDENTITY);
        };
        let prototype = &placed.prototypes[located.prototype];
        let first = &placed.instances[prototype.instances.start];
        let turn = placed.instance(&located).axes() * first.axes().transpose();
        (prototype.first + located.triangle, turn)
    }

    /// Returns the object of a triangle of a copy.
    pub(super) fn object_of_copy(&self, triangle: usize) -> Option<usize> {
        self.objects.common[located(&self.shapes.placed, triangle).prototype].object
    }

    /// Returns the hit of a triangle of a copy where the scene describes it.
    pub(super) fn hit_of_copy(&self, ray: &Ray, met: &Met) -> SurfaceHit {
        let Met { instance, index, hit, .. } = met;
        let placed = &self.shapes.placed;
        let (prototype, common) = (
            &placed.prototypes[instance.prototype as usize],
            &self.objects.common[instance.prototype as usize],
        );
        let mut hit = *hit;
        let triangle = |hit: &Hit| hit.triangle as usize;
        // in the coordinates of the object, in which lengths along the ray are those of the scene
        let (reach, radius) = placed.reach(instance);
        let reach = 1.1 * (reach.length() + radius);
        let change =
            |hit: &Hit| prototype.triangles[triangle(hit)].slopes() * (ROUNDING / instance.scale());
        let weights = Vec3::new(1.0 - hit.u - hit.v, hit.u, hit.v);
        let steepest = common.surfaces[triangle(&hit)].steepest / instance.scale();
        let mut is_near_edge = false;
        if weights.min_element() < steepest * (MARGINS * (reach + hit.t)) {
            let own = instance.enter(ray);
            let tree = self.shapes.forest.as_ref().map(|forest| forest.tree(instance.prototype));
            is_near_edge = weights.cmplt(change(&hit) * (MARGINS * (reach + hit.t))).any();
            if let Some(tree) = tree.filter(|_| is_near_edge) {
                let shape = |t: u32| &prototype.triangles[t as usize];
                hit = super::front_at_edge(tree, shape, &own, &hit, reach);
            }
        }
        let instance = &placed.instances[*index];
        let point = instance.place_exactly(hit.point.as_dvec3());
        let point = match is_near_edge {
            true => {
                let shape = instance.triangle(&prototype.triangles[triangle(&hit)]);
                let rounded = Some(point.as_vec3());
                let surface = self.placed_surface(instance, triangle(&hit), common, rounded);
                surface.off_edges(&shape, point)
            }
            false => point.as_vec3(),
        };
        SurfaceHit { t: hit.t, triangle: placed.first_of(*index) + triangle(&hit), point }
    }
}

/// A place where a ray meets a surface.
#[derive(Clone, Copy, Debug)]
pub enum Surfaced {
    /// A triangle that is no shared copy, or an image of one.
    Own(Hit),
    /// A triangle of a copy.
    Shared(Met),
}

impl Surfaced {
    /// Returns the distance along the ray, m.
    pub fn t(&self) -> f32 {
        match self {
            Self::Own(hit) => hit.t,
            Self::Shared(met) => met.hit.t,
        }
    }

    /// Returns whether the hit belongs to the triangle rather than to its neighbour at an edge.
    pub fn is_owned(&self) -> bool {
        match self {
            Self::Own(hit) => hit.owned,
            Self::Shared(met) => met.hit.owned,
        }
    }

    /// Returns the index of the triangle among those of all surfaces, and the cell of its image.
    pub fn origin(&self, shapes: &Shapes) -> (usize, Cell) {
        match self {
            Self::Own(hit) => {
                let own = shapes.triangles.len();
                let origin = shapes.repeats.as_ref().map(|r| r.surfaces.origin(hit.triangle, own));
                let (triangle, cell) = origin.unwrap_or((hit.triangle, [0, 0]));
                (triangle as usize, cell)
            }
            Self::Shared(met) => {
                (shapes.placed.first_of(met.index) + met.hit.triangle as usize, met.cell)
            }
        }
    }
}

impl Shapes {
    /// Returns the nearest surface with 0 < t < `t_max`.
    pub fn first_met(&self, ray: &Ray, t_max: f32) -> Option<Surfaced> {
        let own = self.surface_bvh.closest(ray, t_max);
        let t_max = own.map_or(t_max, |hit| hit.t);
        let shared = self.forest.as_ref().and_then(|f| f.closest(&self.placed, ray, t_max));
        shared.map(Surfaced::Shared).or(own.map(Surfaced::Own))
    }

    /// Returns whether any surface with 0 < t < `t_max` `stops` the ray.
    pub fn occluded(&self, ray: &Ray, t_max: f32, mut stops: impl FnMut(Surfaced) -> bool) -> bool {
        self.surface_bvh.occluded(ray, t_max, |hit| stops(Surfaced::Own(hit)))
            || self.forest.as_ref().is_some_and(|forest| {
                forest.occluded(&self.placed, ray, t_max, |met| stops(Surfaced::Shared(met)))
            })
    }
}
