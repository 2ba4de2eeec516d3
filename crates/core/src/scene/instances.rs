//! Copies of an object that share its triangles: a tree over the boxes of the copies, and one tree
//! of triangles for each object (Wald et al., "Embree", ACM Transactions on Graphics 33 (4), 2014).
//!
//! A ray is brought into the coordinates of the object, where it meets the object's own triangles,
//! and what it meets is brought back. Distances along it stay the same. All triangles of all copies
//! have an index of their own, copy by copy, after those of the surfaces that are no shared copies:
//! so whatever counts by triangles knows no difference.

use std::ops::Range;

use glam::{DMat3, DVec3, Mat3, UVec3, Vec3};
use rayon::prelude::*;

use super::{
    bvh::{Bvh, Hit},
    lattice::{Cell, Lattice},
};
use crate::math::geometry::{Extent, ROUNDING, Ray, Transform, Triangle, across};

/// How far a transform may be from one that only turns, mirrors and scales, relative to its scale:
/// matrices in files are rounded.
const UNEVEN: f64 = 1e-5;

/// Where a copy of an object stands. A point p of the object is at `linear` p + `at`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    linear: Mat3,
    at: Vec3,
    scale: f32,
    is_mirrored: bool,
    /// Index of the object among those that are shared.
    pub prototype: u32,
}

impl Instance {
    /// Makes the copy of an object, relative to `origin` (in its own coordinates, m), in a scene
    /// whose coordinates are relative to `center`. The transform must be [even](is_even); the copy
    /// stands by the nearest one that is exactly so.
    fn new(transform: &Transform, origin: DVec3, center: DVec3, prototype: u32) -> Self {
        let axes = DMat3::IDENTITY.to_cols_array_2d().map(|axis| transform.turned(axis.into()));
        let (linear, scale) = straightened(DMat3::from_cols(axes[0], axes[1], axes[2]));
        Self {
            linear: linear.as_mat3(),
            at: (transform.point(origin) - center).as_vec3(),
            scale: scale as f32,
            is_mirrored: transform.is_mirrored(),
            prototype,
        }
    }

    /// Returns a ray in the coordinates of the object, with the same distances along it.
    #[inline]
    pub fn enter(&self, ray: &Ray) -> Ray {
        let back = self.linear.transpose() * (1.0 / (self.scale * self.scale));
        Ray { origin: back * (ray.origin - self.at), direction: back * ray.direction }
    }

    /// Returns a point of the scene in the coordinates of the object.
    #[inline]
    fn enter_point(&self, point: Vec3) -> Vec3 {
        self.linear.transpose() * ((point - self.at) * (1.0 / (self.scale * self.scale)))
    }

    /// Returns how far errors reach along each axis of the scene that reach as far as `along` the axes
    /// of the object.
    #[inline]
    fn spread(&self, along: Vec3) -> Vec3 {
        let Mat3 { x_axis, y_axis, z_axis } = self.linear;
        let along = along.abs();
        x_axis.abs() * along.x + y_axis.abs() * along.y + z_axis.abs() * along.z
    }

    /// Returns where a point of the object is, in double precision.
    #[inline]
    pub fn place_exactly(&self, point: DVec3) -> DVec3 {
        self.linear.as_dmat3() * point + self.at.as_dvec3()
    }

    /// Returns where a point of the object is.
    #[inline]
    pub fn place(&self, point: Vec3) -> Vec3 {
        self.linear * point + self.at
    }

    /// Returns a unit vector of the object in the coordinates of the scene.
    #[inline]
    pub fn turn(&self, unit: Vec3) -> Vec3 {
        (self.linear * unit) * (1.0 / self.scale)
    }

    /// Returns the axes of the object in the coordinates of the scene, unit vectors.
    pub fn axes(&self) -> Mat3 {
        self.linear * (1.0 / self.scale)
    }

    /// Returns whether the copy is turned inside out: its corners then go round the other way.
    #[inline]
    pub fn is_mirrored(&self) -> bool {
        self.is_mirrored
    }

    /// Returns the factor on lengths.
    #[inline]
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// Returns a triangle of the object where it is; its front stays its front.
    pub fn triangle(&self, triangle: &Triangle) -> Triangle {
        let [a, b, c] = [triangle.a, triangle.b, triangle.c].map(|corner| self.place(corner));
        if self.is_mirrored { [a, c, b] } else { [a, b, c] }.into()
    }

    /// Returns the transform that places the object, m from the user's origin, to within the
    /// rounding of single precision.
    fn transform(&self, origin: DVec3, center: DVec3) -> Transform {
        let linear = self.linear.as_dmat3();
        Transform::of_matrix(linear, self.at.as_dvec3() + center - linear * origin)
    }

    fn moved(&self, by: Vec3) -> Self {
        Self { at: self.at + by, ..*self }
    }
}

/// Returns whether a transform only turns, mirrors, scales and moves: copies of others do not share
/// their triangles, as their normals and areas differ.
pub fn is_even(transform: &Transform) -> bool {
    let axes = DMat3::IDENTITY.to_cols_array_2d().map(|axis| transform.turned(axis.into()));
    let square = axes[0].length_squared();
    let pairs = [(0, 1), (0, 2), (1, 2)];
    square > 0.0
        && axes.iter().all(|axis| (axis.length_squared() / square - 1.0).abs() <= UNEVEN)
        && pairs.iter().all(|&(i, j)| axes[i].dot(axes[j]).abs() <= UNEVEN * square)
}

/// Returns the nearest matrix that only turns, mirrors and scales, and its scale. The error of each
/// step is the square of the one before (Higham, "Computing the polar decomposition", SIAM Journal
/// on Scientific and Statistical Computing 7, 1986).
fn straightened(linear: DMat3) -> (DMat3, f64) {
    let scale = linear.determinant().abs().cbrt();
    let step = |unit: DMat3, _| (unit + unit.inverse().transpose()) * 0.5;
    ((0..3).fold(linear * scale.recip(), step) * scale, scale)
}

/// An object whose copies share its triangles.
#[derive(Debug, PartialEq)]
pub struct Prototype {
    /// Its triangles, m from `origin`.
    pub triangles: Vec<Triangle>,
    /// The point, m in the object's own coordinates, that they are relative to.
    pub origin: DVec3,
    /// The largest distance of a corner from it, m, and along each axis.
    pub radius: f32,
    pub reach: Vec3,
    /// The copies.
    pub instances: Range<usize>,
    /// Index of the first triangle of the first copy, among those of all surfaces.
    pub first: usize,
}

/// Which triangle of which copy an index among the triangles of all surfaces means.
#[derive(Clone, Copy, Debug)]
pub struct Located {
    /// Index of the object among those that are shared.
    pub prototype: usize,
    /// Number of the copy among those of the object.
    pub copy: usize,
    /// Index of the triangle in the object.
    pub triangle: usize,
}

/// All copies that share triangles, before search structures are built.
#[derive(Debug, Default, PartialEq)]
pub struct Placed {
    /// The objects.
    pub prototypes: Vec<Prototype>,
    /// The copies, object by object.
    pub instances: Vec<Instance>,
    /// The point, m from the user's origin, that the scene's coordinates are relative to.
    center: DVec3,
}

impl Placed {
    /// Returns copies of no object, for a scene whose coordinates are relative to `center`.
    pub fn new(center: DVec3) -> Self {
        Self { center, ..Self::default() }
    }

    /// Adds copies of an object with corners in its own coordinates, m. The index of the first
    /// triangle of the first copy is `first`.
    pub fn add<'t>(
        &mut self,
        corners: impl Iterator<Item = &'t [DVec3; 3]> + Clone,
        transforms: &[Transform],
        first: usize,
    ) {
        let all = || corners.clone().flatten();
        let low = all().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = all().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let origin = if low.is_finite() { 0.5 * (low + high) } else { DVec3::ZERO };
        let radius = all().map(|p| p.distance(origin)).fold(0.0, f64::max) as f32;
        let local = |t: &[DVec3; 3]| Triangle::from(t.map(|p| (p - origin).as_vec3()));
        let triangles: Vec<Triangle> = corners.clone().map(local).collect();
        let prototype = self.prototypes.len() as u32;
        let from = self.instances.len();
        let place = |t: &Transform| Instance::new(t, origin, self.center, prototype);
        self.instances.extend(transforms.iter().map(place));
        let instances = from..self.instances.len();
        let reach = Extent::of_triangles(&triangles).size() * 0.5;
        self.prototypes.push(Prototype { triangles, origin, radius, reach, instances, first });
    }

    /// Returns the number of triangles of all copies.
    pub fn count(&self) -> usize {
        self.prototypes.iter().map(|p| p.triangles.len() * p.instances.len()).sum()
    }

    /// Returns what an index means; `None` if it means no triangle of a copy.
    #[inline]
    pub fn locate(&self, triangle: usize) -> Option<Located> {
        let after = self.prototypes.partition_point(|prototype| prototype.first <= triangle);
        let prototype = after.checked_sub(1)?;
        let Prototype { triangles, first, .. } = &self.prototypes[prototype];
        let index = triangle - first;
        let (copy, triangle) = (index / triangles.len(), index % triangles.len());
        Some(Located { prototype, copy, triangle })
    }

    /// Returns where a copy stands.
    #[inline]
    pub fn instance(&self, located: &Located) -> &Instance {
        &self.instances[self.prototypes[located.prototype].instances.start + located.copy]
    }

    /// Returns the index of the first triangle of a copy.
    #[inline]
    pub fn first_of(&self, instance: usize) -> usize {
        let prototype = &self.prototypes[self.instances[instance].prototype as usize];
        prototype.first + (instance - prototype.instances.start) * prototype.triangles.len()
    }

    /// Returns a triangle of a copy where it is.
    pub fn triangle(&self, located: &Located) -> Triangle {
        let triangle = &self.prototypes[located.prototype].triangles[located.triangle];
        self.instance(located).triangle(triangle)
    }

    /// Returns how far a copy reaches from the centre of the scene along each axis, and how far from
    /// its own middle, m: the errors of its points grow with both.
    #[inline]
    pub fn reach(&self, instance: &Instance) -> (Vec3, f32) {
        let own = instance.scale * self.prototypes[instance.prototype as usize].radius;
        (instance.at.abs() + own, own)
    }

    /// Returns what the way into the coordinates of the object adds to the distance from a triangle
    /// of a copy, of this unit normal, at which rays that leave it at `point` start, m.
    #[inline]
    pub fn extra_offset_at(&self, instance: &Instance, normal: Vec3, point: Vec3) -> f32 {
        ROUNDING * across(normal, instance.spread(instance.enter_point(point)))
    }

    /// Returns the largest of these distances at the points of the copy; in a scene that repeats the
    /// way into the coordinates of a cell adds to it.
    #[inline]
    pub fn extra_offset(&self, instance: &Instance, normal: Vec3, repeats: bool) -> f32 {
        let own = instance.spread(self.prototypes[instance.prototype as usize].reach);
        let of_cell = if repeats { instance.at.abs() + own } else { Vec3::ZERO };
        ROUNDING * across(normal, own + of_cell)
    }

    /// Returns the transform that placed a copy, m from the user's origin.
    pub fn transform(&self, located: &Located) -> Transform {
        let origin = self.prototypes[located.prototype].origin;
        self.instance(located).transform(origin, self.center)
    }

    /// Returns a box around each copy.
    pub fn boxes(&self) -> Vec<Extent> {
        let pieces: Vec<Vec<Extent>> =
            self.prototypes.iter().map(|prototype| pieces(&prototype.triangles)).collect();
        let around = |instance: &Instance| {
            let Mat3 { x_axis, y_axis, z_axis } = instance.linear;
            let widened = |piece: &Extent| {
                let (middle, half) = (instance.place(piece.center()), 0.5 * piece.size());
                let half = x_axis.abs() * half.x + y_axis.abs() * half.y + z_axis.abs() * half.z;
                Extent { min: middle - half, max: middle + half }
            };
            let own = pieces[instance.prototype as usize].iter().map(widened);
            let (reach, radius) = self.reach(instance);
            own.fold(Extent::EMPTY, Extent::join).wider(ROUNDING * (reach.max_element() + radius))
        };
        self.instances.par_iter().map(around).collect()
    }
}

/// Number of parts, along each axis, into which an object is divided for the boxes of its copies.
const PARTS: u32 = 6;

/// Returns boxes that together hold all corners: turned one by one they reach less far than one box
/// around them all.
fn pieces(triangles: &[Triangle]) -> Vec<Extent> {
    let all = Extent::of_triangles(triangles);
    let scale = PARTS as f32 / all.size().max(Vec3::splat(f32::MIN_POSITIVE));
    let mut pieces = vec![Extent::EMPTY; PARTS.pow(3) as usize];
    for corner in triangles.iter().flat_map(|t| [t.a, t.b, t.c]) {
        let place = ((corner - all.min) * scale).as_uvec3().min(UVec3::splat(PARTS - 1));
        let piece = &mut pieces[((place.x * PARTS + place.y) * PARTS + place.z) as usize];
        *piece = piece.join(Extent { min: corner, max: corner });
    }
    pieces.retain(|piece| piece.min.x <= piece.max.x);
    pieces
}

/// The search structures of all copies.
#[derive(Debug)]
pub struct Forest {
    /// One tree for each object.
    trees: Vec<Bvh>,
    /// The tree of the boxes of copies.
    boxes: Bvh,
    /// In a scene that repeats: the copy and the cell of each box, as images of one copy may reach
    /// into the cell (0, 0) from several.
    images: Vec<(u32, Cell)>,
    /// The ways to those cells.
    shifts: Vec<Vec3>,
}

/// The place where a ray meets a triangle of a copy.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    /// The copy, moved to the cell in which the ray meets it.
    pub instance: Instance,
    /// Index of the copy among all.
    pub index: usize,
    /// The cell.
    pub cell: Cell,
    /// The hit, in the coordinates of the object.
    pub hit: Hit,
}

impl Forest {
    /// Builds the search structures, in the caller's rayon pool. `doubles` finds the triangles of an
    /// object that coincide with an earlier one, in rising order, of which light meets only the
    /// first.
    pub fn new(
        placed: &Placed,
        lattice: Option<(&Lattice, f64)>,
        doubles: impl Fn(&[Triangle]) -> Vec<[u32; 2]>,
    ) -> Self {
        let tree = |triangles: &[Triangle]| {
            let doubles = doubles(triangles);
            let is_double =
                |i: &u32| doubles.binary_search_by_key(i, |[double, _]| *double).is_ok();
            Bvh::build_of(triangles, (0..triangles.len() as u32).filter(|i| !is_double(i)))
        };
        let trees = placed.prototypes.iter().map(|p| tree(&p.triangles)).collect();
        let (mut boxes, mut images) = (placed.boxes(), Vec::new());
        if let Some((lattice, slack)) = lattice {
            let mut all = Vec::new();
            for (index, extent) in boxes.iter().enumerate() {
                let corners = [extent.min.as_dvec3(), extent.max.as_dvec3()];
                let [[x0, x1], [y0, y1]] = lattice.images_of(&corners, slack);
                let reaching = (x0..=x1).flat_map(|x| (y0..=y1).map(move |y| [x, y]));
                // the copy itself is there, wherever it stands
                let (own, others): (Vec<Cell>, Vec<Cell>) = reaching.partition(|c| *c == [0, 0]);
                for cell in own.into_iter().chain([[0, 0]]).take(1).chain(others) {
                    let by = lattice.shift(cell).as_vec3();
                    images.push((index as u32, cell));
                    all.push(Extent { min: extent.min + by, max: extent.max + by });
                }
            }
            boxes = all;
        }
        let shifts = images.iter().map(|(_, cell)| match lattice {
            Some((lattice, _)) => lattice.shift(*cell).as_vec3(),
            None => Vec3::ZERO,
        });
        let shifts = shifts.collect();
        Self { trees, boxes: Bvh::build_of_boxes(&boxes), images, shifts }
    }

    /// Returns the copy of a box, its index and its cell.
    #[inline]
    fn copy(&self, placed: &Placed, entry: u32) -> (Instance, usize, Cell) {
        match self.images.get(entry as usize) {
            None => (placed.instances[entry as usize], entry as usize, [0, 0]),
            Some(&(index, cell)) => {
                let instance = &placed.instances[index as usize];
                (instance.moved(self.shifts[entry as usize]), index as usize, cell)
            }
        }
    }

    fn met(&self, placed: &Placed, entry: u32, hit: Hit) -> Met {
        let (instance, index, cell) = self.copy(placed, entry);
        Met { instance, index, cell, hit }
    }

    fn enter(&self, placed: &Placed, ray: &Ray, entry: u32) -> (Ray, &Bvh) {
        let (instance, ..) = self.copy(placed, entry);
        (instance.enter(ray), &self.trees[instance.prototype as usize])
    }

    /// Returns the nearest hit with 0 < t < `t_max` (which may be infinite).
    pub fn closest(&self, placed: &Placed, ray: &Ray, t_max: f32) -> Option<Met> {
        let enter = |entry| self.enter(placed, ray, entry);
        let (entry, hit) = self.boxes.closest_within(ray, t_max, &enter)?;
        Some(self.met(placed, entry, hit))
    }

    /// Returns whether any triangle that the ray hits with 0 < t < `t_max` `stops` it, each asked at
    /// most once, in no particular order.
    pub fn occluded(
        &self,
        placed: &Placed,
        ray: &Ray,
        t_max: f32,
        mut stops: impl FnMut(Met) -> bool,
    ) -> bool {
        let enter = |entry| self.enter(placed, ray, entry);
        self.boxes
            .occluded_within(ray, t_max, &enter, |entry, hit| stops(self.met(placed, entry, hit)))
    }

    /// Visits the copies' triangles that may reach into the ball of `radius`, m, around `center`:
    /// the index of each among those of all surfaces.
    pub fn near(
        &self,
        placed: &Placed,
        center: Vec3,
        radius: f32,
        mut visit: impl FnMut(&Instance, usize, Cell),
    ) {
        self.boxes.near_leaves(center, radius, |entry| {
            let (instance, index, cell) = self.copy(placed, entry as u32);
            let first = placed.first_of(index);
            self.near_in(&instance, center, radius, |t| visit(&instance, first + t, cell));
        });
    }

    /// Visits the triangles of one copy that may reach into the ball of `radius`, m, around `center`:
    /// the index of each in the object.
    pub fn near_in(
        &self,
        instance: &Instance,
        center: Vec3,
        radius: f32,
        mut visit: impl FnMut(usize),
    ) {
        let around = instance.enter(&Ray { origin: center, direction: Vec3::Z }).origin;
        let tree = self.tree(instance.prototype);
        tree.near(around, radius / instance.scale, |t| visit(t as usize));
    }

    /// Returns the tree of an object.
    pub fn tree(&self, prototype: u32) -> &Bvh {
        &self.trees[prototype as usize]
    }
}
