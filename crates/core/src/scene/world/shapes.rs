//! The shapes of a scene with their search structures. They are the part of a scene that takes
//! time to build, and they do not depend on its materials and powers.

use std::{
    borrow::Cow,
    collections::BTreeMap,
    hash::{DefaultHasher, Hash, Hasher},
    ops::Range,
    sync::{Arc, Mutex, Weak},
};

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::rounds::Rounds;
use crate::{
    error::lock,
    math::{
        geometry::{ROUNDING, Ray, Triangle, across, closeness},
        round::Round,
    },
    scene::{
        bvh::Bvh,
        instances::{Forest, Instance, Met, Placed},
        lattice::{Cell, Images, Repeats},
    },
};

/// Triangles, discs and spheres, before search structures are built.
#[derive(Debug, Default, PartialEq)]
pub struct Outlines {
    /// Triangles of all surfaces.
    pub triangles: Vec<Triangle>,
    /// Triangles of all virtual captors, where the user put them.
    pub captor_triangles: Vec<Triangle>,
    /// The discs and spheres among the virtual captors, where the user put them, m from the centre of
    /// the scene.
    pub rounds: Vec<Round>,
    /// Index of the captor of each of `captor_triangles`, and then of each of `rounds`.
    pub captor_of_triangle: Vec<u32>,
    /// How they repeat; `None` if they do not.
    pub repeats: Option<Box<Repeats>>,
    /// Copies that share triangles of their own, which are not among these.
    pub placed: Placed,
}

/// A triangle of a surface that a search has found.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Its index among the triangles of all surfaces.
    pub index: usize,
    /// The cell of the image that was found.
    pub cell: Cell,
    /// The triangle where it was found.
    pub triangle: Triangle,
    /// What the way to it adds to the error of its points, m.
    extra_offset: f32,
    /// Rises in the order in which triangles are looked at, images after what they are images of.
    pub order: usize,
}

impl Found {
    /// Returns the distance from the triangle within which things near `point` count as lying in it,
    /// m.
    pub fn offset_at(&self, point: Vec3) -> f32 {
        self.extra_offset + self.triangle.offset_at(point)
    }
}

impl Outlines {
    /// Returns what the search structure of surfaces knows by this index.
    fn own(&self, index: u32) -> Found {
        let triangle = *self.surface_shape(index);
        let own = self.triangles.len();
        let origin = |repeats: &Repeats| repeats.surfaces.origin(index, own);
        let (of, cell) = self.repeats.as_deref().map_or((index, [0, 0]), origin);
        Found { index: of as usize, cell, triangle, extra_offset: 0.0, order: index as usize }
    }

    /// Returns a triangle of a copy.
    fn shared(&self, instance: &Instance, index: usize, cell: Cell) -> Option<Found> {
        let located = self.placed.locate(index)?;
        let own = &self.placed.prototypes[located.prototype].triangles[located.triangle];
        let triangle = instance.triangle(own);
        let normal = instance.turn(own.normal());
        let extra_offset = self.placed.extra_offset(instance, normal, self.repeats.is_some());
        Some(Found { index, cell, triangle, extra_offset, order: index + u32::MAX as usize })
    }

    /// Returns a triangle that the search structure of surfaces knows by this index, which may be
    /// an image of a triangle of the scene.
    #[inline]
    pub fn surface_shape(&self, index: u32) -> &Triangle {
        shape(&self.triangles, self.repeats.as_ref().map(|repeats| &repeats.surfaces), index)
    }

    /// Returns the index of the disc or sphere that a captor with this range of shapes is; `None` if it is
    /// made of triangles.
    fn round_of(&self, range: &Range<usize>) -> Option<usize> {
        range.start.checked_sub(self.captor_triangles.len())
    }

    /// Returns the index of the triangle of a captor of which the search structure knows this image,
    /// or which it is itself.
    pub fn captor_origin(&self, index: u32) -> u32 {
        let own = self.captor_triangles.len();
        self.repeats.as_ref().map_or(index, |repeats| repeats.captors.origin(index, own).0)
    }

    /// Returns the index of the disc or sphere of which the search structure knows this image, or which
    /// it is itself, and the cell of the image.
    pub fn round_origin(&self, index: usize) -> (usize, Cell) {
        let Some(repeats) = &self.repeats else { return (index, [0, 0]) };
        let (of, cell) = repeats.rounds.origin(index as u32, self.rounds.len());
        (of as usize, cell)
    }
}

#[inline]
fn shape<'t>(own: &'t [Triangle], images: Option<&'t Images>, index: u32) -> &'t Triangle {
    let index = index as usize;
    match images {
        Some(images) if index >= own.len() => &images.shapes[index - own.len()],
        _ => &own[index],
    }
}

/// Returns the triangles with their images.
fn with_images<'t>(own: &'t [Triangle], images: Option<&Images>) -> Cow<'t, [Triangle]> {
    match images {
        Some(images) if !images.shapes.is_empty() => {
            Cow::Owned(own.iter().chain(&images.shapes).copied().collect())
        }
        _ => Cow::Borrowed(own),
    }
}

/// Triangles with their search structures.
#[derive(Debug)]
pub struct Shapes {
    outlines: Outlines,
    /// Triangles of surfaces that coincide with an earlier one, corner by corner, each with the
    /// first of them, in rising order. Light meets only the first.
    pub copies: Vec<[u32; 2]>,
    /// Finds triangles of surfaces, without the copies: a ray would test all that lie in one place.
    pub surface_bvh: Bvh,
    /// Finds triangles of copies that share them, if there are any.
    pub forest: Option<Forest>,
    /// Whether all surfaces that rays may meet are in the search structure as they are: nothing
    /// repeats, and no triangles are shared.
    pub is_plain: bool,
    /// Whether the same holds of virtual captors, as all are made of triangles.
    pub has_plain_captors: bool,
    /// Finds triangles of virtual captors, lifted off the surfaces that they lie in.
    pub captor_bvh: Bvh,
    /// The discs and spheres among them, lifted, too.
    pub round_captors: Rounds,
    /// Indices of the virtual captors that lie in a surface, in rising order.
    pub in_surface: Vec<usize>,
    /// The distance, m, by which each of these is lifted.
    pub lifts: Vec<f32>,
}

impl std::ops::Deref for Shapes {
    type Target = Outlines;
    fn deref(&self) -> &Outlines {
        &self.outlines
    }
}

/// Keeps the shapes of scenes, for use by further scenes with the same triangles: the shapes asked
/// for last, and all that are still in use.
#[derive(Debug, Default)]
pub struct KeptShapes(Mutex<Bin>);

#[derive(Debug, Default)]
struct Bin {
    last: Option<Arc<Shapes>>,
    known: Vec<Weak<Shapes>>,
}

impl KeptShapes {
    /// Returns the shapes for these outlines, built only if none are kept.
    pub fn shapes(&self, outlines: Outlines) -> Arc<Shapes> {
        let bin = || lock(&self.0);
        let known: Vec<Arc<Shapes>> = bin().known.iter().filter_map(Weak::upgrade).collect();
        let same = known.into_iter().find(|shapes| shapes.outlines == outlines);
        let is_new = same.is_none();
        // without the lock, so that other shapes can be built meanwhile
        let shapes = same.unwrap_or_else(|| Arc::new(Shapes::new(outlines)));
        let mut bin = bin();
        bin.last = Some(shapes.clone());
        bin.known.retain(|known| known.strong_count() > 0);
        if is_new {
            bin.known.push(Arc::downgrade(&shapes));
        }
        shapes
    }
}

/// The shapes and what finds them, before captors that lie in surfaces are lifted.
struct Unlifted<'a> {
    outlines: &'a Outlines,
    surface_bvh: &'a Bvh,
    forest: Option<&'a Forest>,
    /// Triangles of virtual captors, with their images.
    captors: &'a [Triangle],
    captor_bvh: &'a Bvh,
    rounds: &'a Rounds,
}

impl Unlifted<'_> {
    /// Returns, for each virtual captor that lies in surfaces, the largest of their offsets, m.
    fn in_surface(&self, captors: &[(usize, Range<usize>)]) -> BTreeMap<usize, f32> {
        let Outlines { triangles, captor_triangles, rounds, captor_of_triangle, .. } =
            self.outlines;
        let below = |(captor, range): &(usize, Range<usize>)| {
            let offset = match self.outlines.round_of(range) {
                Some(round) => self.offset_below_disc(&rounds[round]),
                None => {
                    let own = captor_triangles[range.clone()].iter();
                    own.filter_map(|triangle| self.offset_below(triangle)).reduce(f32::max)
                }
            };
            Some((*captor, offset?))
        };
        let mut all: BTreeMap<usize, f32> = captors.par_iter().filter_map(below).collect();
        // a captor larger than the surface that it lies in is found from the surface
        let mut covered: Vec<(usize, f32)> = Vec::new();
        if !captor_triangles.is_empty() {
            covered.par_extend(triangles.par_iter().filter_map(|t| self.triangle_above(t)));
        }
        if rounds.iter().any(|round| round.normal.is_some()) {
            covered.par_extend(triangles.par_iter().filter_map(|t| self.disc_above(t)));
        }
        for (shape, offset) in covered {
            let largest = all.entry(captor_of_triangle[shape] as usize).or_insert(offset);
            *largest = largest.max(offset);
        }
        all
    }

    /// Returns the largest offset of the surfaces in which points lie, where a captor has this normal.
    fn largest_offset(&self, points: impl Iterator<Item = Vec3>, normal: Vec3) -> Option<f32> {
        let Self { outlines, surface_bvh, forest, .. } = *self;
        let mut largest: Option<f32> = None;
        for point in points {
            let reach = closeness(point) + 4.0 * ROUNDING * across(normal, point);
            let crosses = |ray: &Ray, t_max: f32, visit: &mut dyn FnMut(Found) -> bool| {
                crosses(outlines, surface_bvh, forest, ray, t_max, visit);
            };
            has_parallel(crosses, point, normal, reach, |found| {
                let offset = found.offset_at(point);
                largest = Some(largest.map_or(offset, |other| other.max(offset)));
                false
            });
        }
        largest
    }

    /// Returns the largest offset of the surfaces in which a triangle of a captor lies.
    fn offset_below(&self, triangle: &Triangle) -> Option<f32> {
        let near_corners = [(0.05, 0.05), (0.9, 0.05), (0.05, 0.9)];
        let points = [(1.0 / 3.0, 1.0 / 3.0)].into_iter().chain(near_corners);
        self.largest_offset(points.map(|(u, v)| triangle.point(u, v)), triangle.normal())
    }

    /// Returns the same of a disc; a sphere lies in no plane.
    fn offset_below_disc(&self, round: &Round) -> Option<f32> {
        let near_rim = (0..8).map(|i| Vec2::new(0.9, i as f32 / 8.0));
        let points = [Vec2::ZERO].into_iter().chain(near_rim);
        let normal = round.normal?.as_vec3();
        self.largest_offset(points.map(|u| round.point(u).as_vec3()), normal)
    }

    /// Returns the first triangle of a captor that lies in the plane of a surface's triangle, where the
    /// middle of this is, with the offset of the surface there.
    fn triangle_above(&self, t: &Triangle) -> Option<(usize, f32)> {
        let (middle, normal) = (t.centroid(), t.normal());
        let reach = closeness(middle) + 4.0 * t.offset_at(middle);
        let mut least: Option<usize> = None;
        let crosses = |ray: &Ray, t_max: f32, visit: &mut dyn FnMut(Found) -> bool| {
            self.captor_bvh.crosses(ray, t_max, |hit| {
                let (triangle, order) =
                    (self.captors[hit.triangle as usize], hit.triangle as usize);
                let index = self.outlines.captor_origin(hit.triangle) as usize;
                visit(Found { index, cell: [0, 0], triangle, extra_offset: 0.0, order })
            });
        };
        has_parallel(crosses, middle, normal, reach, |found| {
            least = Some(least.map_or(found.index, |other| other.min(found.index)));
            false
        });
        least.map(|shape| (shape, t.offset_at(middle)))
    }

    /// Returns the first disc that lies so, as the index of its shape.
    fn disc_above(&self, t: &Triangle) -> Option<(usize, f32)> {
        let Outlines { captor_triangles, rounds, .. } = self.outlines;
        let (middle, normal) = (t.centroid(), t.normal());
        let reach = closeness(middle) + 4.0 * t.offset_at(middle);
        let ray = Ray { origin: middle - reach * normal, direction: normal };
        let mut least: Option<usize> = None;
        self.rounds.crossings(&ray, 2.0 * reach, |index, _| {
            let (of, _) = self.outlines.round_origin(index);
            let cos = rounds[of].normal.map_or(0.0, |disc| disc.as_vec3().dot(normal));
            if cos.abs() > 0.999_999 {
                least = Some(least.map_or(of, |other| other.min(of)));
            }
        });
        least.map(|disc| (captor_triangles.len() + disc, t.offset_at(middle)))
    }
}

/// Virtual captors, of which those that lie in surfaces are moved off them, towards their normals.
struct Lifted {
    triangles: Vec<Triangle>,
    /// Whether any of the triangles is moved.
    any_triangle: bool,
    /// The move of each disc and sphere, m.
    rounds: Vec<DVec3>,
    /// The distance by which each captor that lies in a surface is moved, m.
    lifts: BTreeMap<usize, f32>,
}

impl Lifted {
    /// Moves the `captors` for which `below` has the distance to the points that rays start from;
    /// `triangles` are those of all captors, and then their images.
    fn of(
        outlines: &Outlines,
        captors: &[(usize, Range<usize>)],
        below: &BTreeMap<usize, f32>,
        triangles: Vec<Triangle>,
    ) -> Self {
        let Outlines { captor_triangles, rounds, repeats, .. } = outlines;
        let of_images = repeats.as_ref().map_or(&[][..], |repeats| &repeats.captors.of);
        let zero = vec![DVec3::ZERO; rounds.len()];
        let mut all = Self { triangles, any_triangle: false, rounds: zero, lifts: BTreeMap::new() };
        for (captor, range) in captors {
            let Some(below) = below.get(captor) else { continue };
            if let Some(round) = outlines.round_of(range) {
                let (reach, normal) = (rounds[round].reach(), rounds[round].normal);
                let normal = normal.unwrap_or_default();
                let offset = ROUNDING * across(normal.as_vec3(), reach);
                let lift = closeness(reach) + 4.0 * offset + 2.0 * below;
                all.rounds[round] = f64::from(lift) * normal;
                all.lifts.insert(*captor, lift);
                continue;
            }
            all.any_triangle = true;
            let own = &mut all.triangles[range.clone()];
            let apart = |t: &Triangle| closeness(t.reach()) + 4.0 * t.offset();
            let lift = own.iter().map(apart).fold(0.0, f32::max) + 2.0 * below;
            own.iter_mut().for_each(|triangle| *triangle = lifted_by(triangle, lift));
            all.lifts.insert(*captor, lift);
            let images = all.triangles[captor_triangles.len()..].iter_mut().zip(of_images);
            for (triangle, _) in images.filter(|(_, (of, _))| range.contains(&(*of as usize))) {
                *triangle = lifted_by(triangle, lift);
            }
        }
        all
    }
}

impl Shapes {
    /// Builds the search structures, in the caller's rayon pool. A virtual captor in the plane of a
    /// surface counts as lying off it, on the side to which its normal points: its triangles move
    /// above the points that rays start from.
    fn new(outlines: Outlines) -> Self {
        let Outlines { triangles, captor_triangles, rounds, captor_of_triangle, repeats, placed } =
            &outlines;
        let repeats = repeats.as_deref();
        let lattice = repeats.map(|repeats| (&repeats.lattice, repeats.layers.slack));
        let forest = (!placed.instances.is_empty()).then(|| Forest::new(placed, lattice, copies));
        let all = with_images(triangles, repeats.map(|repeats| &repeats.surfaces));
        let mut copies = copies(&all);
        let is_copy = |i: &u32| copies.binary_search_by_key(i, |[copy, _]| *copy).is_ok();
        let distinct = (0..all.len() as u32).filter(|i| !is_copy(i));
        let surface_bvh = match repeats {
            None => Bvh::build_of(&all, distinct),
            Some(Repeats { lattice, layers, surfaces, .. }) => {
                let within = |image: &Triangle| lattice.box_within(image, 2.0 * layers.slack);
                let boxes = surfaces.shapes.par_iter().map(within).collect();
                Bvh::build_within(&all, distinct, boxes)
            }
        };
        drop(all);
        copies.retain(|[copy, _]| (*copy as usize) < triangles.len());
        let all_captors = with_images(captor_triangles, repeats.map(|repeats| &repeats.captors));
        let captor_bvh = Bvh::build_for_few(&all_captors);
        let of_rounds = repeats.iter().flat_map(|repeats| &repeats.rounds.shapes);
        let all_rounds = rounds.iter().chain(of_rounds).copied().collect();
        let mut round_captors = Rounds::new(all_rounds);
        let captors = captors(captor_of_triangle);
        let unlifted = Unlifted {
            outlines: &outlines,
            surface_bvh: &surface_bvh,
            forest: forest.as_ref(),
            captors: &all_captors,
            captor_bvh: &captor_bvh,
            rounds: &round_captors,
        };
        let below = unlifted.in_surface(&captors);
        let lifted = Lifted::of(&outlines, &captors, &below, all_captors.into_owned());
        let captor_bvh = match lifted.any_triangle {
            true => Bvh::build_for_few(&lifted.triangles),
            false => captor_bvh,
        };
        if lifted.rounds.iter().any(|lift| *lift != DVec3::ZERO) {
            let lift = |(index, round): (usize, &Round)| {
                round.moved(lifted.rounds[outlines.round_origin(index).0])
            };
            round_captors =
                Rounds::new(round_captors.shapes.iter().enumerate().map(lift).collect());
        }
        let (in_surface, lifts) = lifted.lifts.into_iter().unzip();
        let is_plain = outlines.repeats.is_none() && forest.is_none();
        Self {
            copies,
            surface_bvh,
            forest,
            is_plain,
            has_plain_captors: is_plain && round_captors.is_empty(),
            captor_bvh,
            round_captors,
            in_surface,
            lifts,
            outlines,
        }
    }

    /// Visits triangles of surfaces that a ray crosses with 0 < t < `t_max`, each once, in no
    /// particular order, until `visit` returns true.
    pub fn crosses(&self, ray: &Ray, t_max: f32, visit: &mut dyn FnMut(Found) -> bool) {
        crosses(&self.outlines, &self.surface_bvh, self.forest.as_ref(), ray, t_max, visit);
    }

    /// Visits triangles of surfaces that may reach into the ball of `radius`, m, around `center`.
    pub fn near(&self, center: Vec3, radius: f32, mut visit: impl FnMut(Found)) {
        self.surface_bvh.near(center, radius, |t| visit(self.own(t)));
        if let Some(forest) = &self.forest {
            forest.near(&self.placed, center, radius, |instance, index, cell| {
                visit_some(self.shared(instance, index, cell), &mut visit);
            });
        }
    }
}

fn visit_some(found: Option<Found>, visit: &mut impl FnMut(Found)) {
    if let Some(found) = found {
        visit(found);
    }
}

fn crosses(
    outlines: &Outlines,
    own: &Bvh,
    forest: Option<&Forest>,
    ray: &Ray,
    t_max: f32,
    visit: &mut dyn FnMut(Found) -> bool,
) {
    if own.crosses(ray, t_max, |hit| visit(outlines.own(hit.triangle))) {
        return;
    }
    if let Some(forest) = forest {
        let placed = &outlines.placed;
        forest.occluded(placed, ray, t_max, |Met { instance, index, cell, hit }| {
            let index = placed.first_of(index) + hit.triangle as usize;
            hit.owned && outlines.shared(&instance, index, cell).is_some_and(&mut *visit)
        });
    }
}

/// Returns a triangle moved by `lift`, m, to the side of its front.
fn lifted_by(triangle: &Triangle, lift: f32) -> Triangle {
    let shift = lift * triangle.normal();
    [triangle.a + shift, triangle.b + shift, triangle.c + shift].into()
}

/// Returns each virtual captor with the range of its triangles, which are contiguous.
fn captors(captor_of_triangle: &[u32]) -> Vec<(usize, Range<usize>)> {
    let mut first = 0;
    let runs = captor_of_triangle.chunk_by(|a, b| a == b);
    runs.map(|run| {
        let range = first..first + run.len();
        first = range.end;
        (run[0] as usize, range)
    })
    .collect()
}

/// Returns the triangles that coincide with an earlier one, corner by corner, each with the first
/// of them, in rising order.
fn copies(triangles: &[Triangle]) -> Vec<[u32; 2]> {
    let bits = |t: &Triangle| [t.a, t.b, t.c].map(|p| p.to_array().map(f32::to_bits));
    // half of a hash, above the index
    let key = |(triangle, index): (&Triangle, u32)| {
        let mut hasher = DefaultHasher::new();
        bits(triangle).hash(&mut hasher);
        hasher.finish() >> 32 << 32 | u64::from(index)
    };
    let mut keys: Vec<u64> = triangles.par_iter().zip(0..triangles.len() as u32).map(key).collect();
    keys.par_sort_unstable();
    let mut copies: Vec<[u32; 2]> = Vec::new();
    let alike = keys.chunk_by(|p, q| p >> 32 == q >> 32).filter(|alike| alike.len() > 1);
    for alike in alike {
        let indices = alike.iter().map(|key| *key as u32);
        let mut found: Vec<_> = indices.map(|i| (bits(&triangles[i as usize]), i)).collect();
        found.sort_unstable();
        for same in found.chunk_by(|(p, _), (q, _)| p == q) {
            copies.extend(same[1..].iter().map(|(_, copy)| [*copy, same[0].1]));
        }
    }
    copies.sort_unstable();
    copies
}

/// Limit on the number of triangles that are looked at in one place. It bounds the cost of the
/// worst place, which is spent for every point that is asked for.
pub const LOOKED_AT: usize = 100;

/// Returns whether any triangle within `reach`, m, of `point` along `normal` that is perpendicular to
/// `normal` is `wanted`; `crosses` visits the triangles that a ray crosses before a distance until one
/// is found. `None` if more than [`LOOKED_AT`] triangles lie there and none of those looked at is
/// wanted.
pub fn has_parallel(
    crosses: impl FnOnce(&Ray, f32, &mut dyn FnMut(Found) -> bool),
    point: Vec3,
    normal: Vec3,
    reach: f32,
    mut wanted: impl FnMut(&Found) -> bool,
) -> Option<bool> {
    if normal == Vec3::ZERO {
        return Some(false);
    }
    let ray = Ray { origin: point - reach * normal, direction: normal };
    let (mut looked_at, mut is_found) = (0, false);
    crosses(&ray, 2.0 * reach, &mut |found| {
        looked_at += 1;
        let parallel = found.triangle.normal().dot(normal).abs() > 0.999_999;
        is_found = looked_at <= LOOKED_AT && parallel && wanted(&found);
        is_found || looked_at > LOOKED_AT
    });
    (is_found || looked_at <= LOOKED_AT).then_some(is_found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_triangles_are_arranged_once() {
        let outlines = |z: f32| Outlines {
            triangles: vec![[Vec3::ZERO, Vec3::X, Vec3::new(0.0, 1.0, z)].into()],
            ..Outlines::default()
        };
        let kept = KeptShapes::default();
        let (first, other) = (kept.shapes(outlines(0.0)), kept.shapes(outlines(1.0)));
        assert!(!Arc::ptr_eq(&first, &other));
        // not asked for last, but in use
        assert!(Arc::ptr_eq(&first, &kept.shapes(outlines(0.0))));
        drop(first);
        // not in use, but asked for last
        let first = Arc::downgrade(&kept.shapes(outlines(0.0)));
        assert!(first.upgrade().is_some());
        assert!(Arc::ptr_eq(&other, &kept.shapes(outlines(1.0))));
        assert!(first.upgrade().is_none(), "neither");
    }

    /// Of a thousand copies of a triangle, among other triangles, a ray meets only the first.
    #[test]
    fn copies_are_left_out() {
        let at = |z: f32| Triangle::from([Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p + z * Vec3::Z));
        let mut triangles = vec![at(1.0), at(0.0)];
        triangles.extend([at(1.0); 1000]);
        let turned = at(1.0);
        triangles.push([turned.b, turned.c, turned.a].into());
        let outlines = Outlines { triangles, ..Outlines::default() };
        let shapes = KeptShapes::default().shapes(outlines);
        assert_eq!(shapes.copies, (2..1002).map(|copy| [copy, 0]).collect::<Vec<_>>());
        let ray = Ray { origin: Vec3::new(0.2, 0.2, -1.0), direction: Vec3::Z };
        let mut met = Vec::new();
        shapes.surface_bvh.crossings(&ray, f32::INFINITY, |hit| met.push(hit.triangle));
        met.sort_unstable();
        assert_eq!(met, [0, 1, 1002]);
    }

    /// Of triangles nearly in one place at most [`LOOKED_AT`] are looked at, whatever is wanted.
    #[test]
    fn a_heap_is_looked_at_in_part() {
        let at = |i: usize| {
            let shift = i as f32 * 1e-7 * Vec3::X;
            Triangle::from([Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p + shift))
        };
        let looked_at = |count: usize, wanted: bool| {
            let triangles: Vec<Triangle> = (0..count).map(at).collect();
            let mut asked = 0;
            let middle = triangles[0].centroid();
            let outlines = Outlines { triangles, ..Outlines::default() };
            let bvh = Bvh::build(&outlines.triangles);
            let crosses = |ray: &Ray, t_max: f32, visit: &mut dyn FnMut(Found) -> bool| {
                crosses(&outlines, &bvh, None, ray, t_max, visit);
            };
            let found = has_parallel(crosses, middle, Vec3::Z, 1e-5, |_| {
                asked += 1;
                wanted
            });
            (found, asked)
        };
        assert_eq!(looked_at(LOOKED_AT, false), (Some(false), LOOKED_AT));
        assert_eq!(looked_at(10 * LOOKED_AT, false), (None, LOOKED_AT));
        assert_eq!(looked_at(10 * LOOKED_AT, true), (Some(true), 1));
    }
}
