//! The walk through the tree, and the intersection test of a ray with eight boxes.

use arrayvec::ArrayVec;
use glam::{Vec3, Vec3A};

use super::layout::{Bvh, Gather, Hit, Row};
use super::triangle::{INDICES, Leaf, Shear};
use crate::math::geometry::{Extent, Ray};

/// Eight children: the lower and upper planes of their boxes along x, y and z, m, and where each
/// child is.
pub(super) type Node = [Row; NODE_ROWS];

pub(super) const NODE_ROWS: usize = 7;

/// Limit on the number of nodes that form the root. Every ray meets all of them, and their tests do
/// not depend on each other: together they take little longer than one.
pub(super) const ROOT_NODES: usize = 4;

/// The row of a node that refers to its children.
pub(super) const CHILDREN: usize = 6;

/// A node without children: no ray enters a box from +infinity to -infinity.
pub(super) const CHILDLESS: Node = {
    let (lower, upper) = (Row([f32::INFINITY; 8]), Row([f32::NEG_INFINITY; 8]));
    [lower, upper, lower, upper, lower, upper, Row([0.0; 8])]
};

/// Reference to a child: the row where a node starts or, with the highest bit set, a leaf.
#[derive(Clone, Copy, Debug)]
pub(super) struct Child(u32);

const LEAF: u32 = 1 << 31;

impl Child {
    pub fn node(row: usize) -> Self {
        // as a float the number must not be a NaN
        assert!(row < f32::INFINITY.to_bits() as usize, "less than 64 GB of rows");
        Self(row as u32)
    }

    pub fn leaf(row: usize) -> Self {
        Self(Self::node(row).0 | LEAF)
    }

    /// Returns the bits as a float, as they are stored in a row of the table.
    pub fn as_float(self) -> f32 {
        f32::from_bits(self.0)
    }

    #[inline(always)]
    fn of(node: &Node, place: usize) -> Self {
        Self(node[CHILDREN].0[place].to_bits())
    }

    #[inline(always)]
    fn is_leaf(self) -> bool {
        self.0 & LEAF != 0
    }

    #[inline(always)]
    fn row(self) -> usize {
        (self.0 & !LEAF) as usize
    }
}

/// A child that waits, with the distance at which the ray enters its box: the bits of that float,
/// which is at least 0, above the bits of the child. So the nearest child is the smallest number.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Waiting(u64);

impl Waiting {
    #[inline(always)]
    fn new(near: f32, child: Child) -> Self {
        Self(u64::from(near.to_bits()) << 32 | u64::from(child.0))
    }

    #[inline(always)]
    fn near(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    #[inline(always)]
    fn child(self) -> Child {
        Child(self.0 as u32)
    }
}

/// Limit on the number of children that wait: enough for a balanced tree of 2^28 triangles (the
/// root's children, and 28 levels with 7 each). A tree that needs more is replaced by a balanced
/// one.
pub(super) const STACK: usize = 8 * ROOT_NODES + 28 * 7;

impl Bvh {
    #[inline(always)]
    fn node(&self, row: usize) -> &Node {
        self.rows[row..row + NODE_ROWS].try_into().expect("seven")
    }

    #[inline(always)]
    pub(super) fn leaf(&self, row: usize) -> &Leaf {
        self.rows[row..row + 10].try_into().expect("ten")
    }

    /// Prefetches the memory of a child that waits, so that it is in the cache when its turn comes:
    /// among half a million triangles that saves an eighth of the time.
    #[inline(always)]
    fn prefetch(&self, child: Child) {
        #[cfg(target_arch = "x86_64")]
        for row in (0..8).step_by(2) {
            use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
            let line = self.rows.as_ptr().wrapping_add(child.row() + row);
            #[allow(unsafe_code)]
            // SAFETY: every processor of this kind has the instruction, and it reads nothing.
            unsafe {
                _mm_prefetch(line.cast(), _MM_HINT_T0);
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = child;
    }

    /// Calls `visit` for hits with 0 < t <= limit, where the limit is `t_max` at first and then
    /// what `visit` returned last; a negative one ends the walk.
    #[inline(always)]
    pub(super) fn walk(
        &self,
        Probe { slabs, shear }: &Probe,
        t_max: f32,
        gather: impl Gather,
        mut visit: impl FnMut(Hit) -> f32,
    ) {
        self.walk_leaves(slabs, t_max, gather, |row, mut limit| {
            let leaf = self.leaf(row);
            let sheared = shear.apply(leaf, limit, gather);
            let mut mask = sheared.mask;
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize % 8;
                mask &= mask - 1;
                if let Some(hit) = shear.meet(leaf, &sheared, lane, limit) {
                    limit = visit(hit);
                }
            }
            limit
        });
    }

    /// Calls `leaf` for the leaves whose boxes the ray enters before the limit, with their row (of a
    /// tree of boxes: the index of the box) and the limit; it returns the new limit.
    #[inline(always)]
    pub(super) fn walk_leaves(
        &self,
        slabs: &Slabs,
        t_max: f32,
        gather: impl Gather,
        mut leaf: impl FnMut(usize, f32) -> f32,
    ) {
        let mut limit = t_max;
        let mut stack = ArrayVec::<Waiting, STACK>::new();
        let (mut near, mut mask) = ([[0.0; 8]; ROOT_NODES], 0);
        for (i, near) in near.iter_mut().take(self.root_nodes).enumerate() {
            let entered = slabs.enter(self.node(NODE_ROWS * i), limit, gather);
            *near = entered.near;
            mask |= entered.mask << (8 * i);
        }
        if mask == 0 {
            return;
        }
        let mut child = self.descend(mask, &mut stack, |place| {
            let (i, place) = (place / 8 % ROOT_NODES, place % 8);
            Waiting::new(near[i][place], Child::of(self.node(NODE_ROWS * i), place))
        });
        loop {
            if child.is_leaf() {
                limit = leaf(child.row(), limit);
            } else {
                let node = self.node(child.row());
                let Entered { near, mask } = slabs.enter(node, limit, gather);
                if mask != 0 {
                    child = self.descend(mask, &mut stack, |place| {
                        Waiting::new(near[place % 8], Child::of(node, place % 8))
                    });
                    continue;
                }
            }
            child = loop {
                let Some(waiting) = stack.pop() else { return };
                if waiting.near() <= limit {
                    break waiting.child();
                }
            };
        }
    }

    /// Returns the nearest of the children in the places of `mask`, and lets the others wait.
    #[inline(always)]
    fn descend(
        &self,
        mut mask: u32,
        stack: &mut ArrayVec<Waiting, STACK>,
        child: impl Fn(usize) -> Waiting,
    ) -> Child {
        let mut next = || {
            let place = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            (child(place), mask == 0)
        };
        let (mut nearest, only) = next();
        if only {
            return nearest.child();
        }
        let bottom = stack.len();
        loop {
            let (other, last) = next();
            let farther = nearest.max(other);
            nearest = nearest.min(other);
            self.prefetch(farther.child());
            // the waiting children stay sorted, the nearest on top
            stack.push(farther);
            let waiting = &mut stack[bottom..];
            let mut place = waiting.len() - 1;
            while place > 0 && waiting[place - 1] < farther {
                waiting[place] = waiting[place - 1];
                place -= 1;
            }
            waiting[place] = farther;
            if last {
                return nearest.child();
            }
        }
    }

    /// Visits the index of every triangle that may reach into the ball of `radius`, m, around
    /// `center`: all triangles of the leaves whose boxes reach into it.
    pub fn near(&self, center: Vec3, radius: f32, mut visit: impl FnMut(u32)) {
        self.near_leaves(center, radius, |row| {
            let leaf = self.leaf(row);
            let filled = (0..8).filter(|&i| !leaf[0].0[i].is_nan());
            filled.for_each(|i| visit(leaf[INDICES].0[i].to_bits()));
        });
    }

    /// Visits the leaves whose boxes reach into the ball: the row of each or, of a tree of boxes,
    /// the index of the box.
    pub fn near_leaves(&self, center: Vec3, radius: f32, mut visit: impl FnMut(usize)) {
        let mut waiting: Vec<Child> =
            (0..self.root_nodes).map(|i| Child::node(NODE_ROWS * i)).collect();
        while let Some(child) = waiting.pop() {
            if child.is_leaf() {
                visit(child.row());
            } else {
                let node = self.node(child.row());
                let inside = (0..8).filter(|&i| touches(node, i, center, radius));
                waiting.extend(inside.map(|i| Child::of(node, i)));
            }
        }
    }
}

/// Returns the box of a child.
fn extent_of(node: &Node, place: usize) -> Extent {
    let [min, max] =
        [0, 1].map(|side| Vec3::from([0, 2, 4].map(|axis| node[axis + side].0[place])));
    Extent { min, max }
}

/// Returns whether a child's box reaches into a ball; because of rounding, also true for some boxes
/// that only touch it.
fn touches(node: &Node, place: usize, center: Vec3, radius: f32) -> bool {
    let Extent { min, max } = extent_of(node, place);
    let outside = (min - center).max(center - max).max(Vec3::ZERO);
    outside.length_squared() <= radius * radius * (1.0 + 1e-5)
}

/// A ray, prepared for the tests of boxes and triangles in one or more trees.
pub(super) struct Probe {
    pub slabs: Slabs,
    shear: Shear,
}

impl Probe {
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        let (origin, direction) = (Vec3A::from(ray.origin), Vec3A::from(ray.direction));
        let slabs = Slabs::new(origin, direction);
        let shear = Shear::new(origin, direction, slabs.inverse);
        Self { slabs, shear }
    }
}

/// The quantities of a ray that the box test needs: the distance of the plane x = p is p
/// `inverse.x` + `near.x` (rounded down) or p `inverse.x` + `far.x` (rounded up).
///
/// Let u = 2^-24; r the reach of a box along an axis (the largest coordinate in it), o that of the
/// ray's origin, and k one over the direction's component; R, O and K the same along the main axis
/// (that of the largest component). The sums below err by less than 6 u (r + o) k. The triangle test
/// shears corners with errors of 2 u (r + o) and of 5 u (R + O) times the slope, as if the distance
/// were off by 2 u (r + o) k + 5 u (R + O) K. A pad of 16 u of both terms, with the largest o for O,
/// covers the errors that come from the origin. Those that come from the corners are covered by the
/// boxes, which are stored wider by [`PAD`] of r and of the largest R: as K is at most k, that is
/// enough. So no box is left out in which a triangle would be hit, and a box near the centre of the
/// scene stays tight however far away another triangle is.
pub(super) struct Slabs {
    inverse: Vec3A,
    near: Vec3A,
    far: Vec3A,
    /// Bits 0, 1, 2: whether the ray meets the upper planes across x, y, z first.
    downward: usize,
}

/// The children whose boxes a ray enters before its limit, as a bit mask, and the distance at which
/// it enters each.
struct Entered {
    near: [f32; 8],
    mask: u32,
}

/// Rounding of the tests, relative to the coordinates: 16 u.
pub(super) const PAD: f32 = 16.0 / (1 << 24) as f32;

/// Stands for 1/0. It is so large that every other distance is small beside it, and so small that
/// no product overflows. With it a ray in the plane of a box's face counts as inside: what the
/// box is wider along that axis exceeds every distance.
const LARGEST_INVERSE: f32 = (1u128 << 96) as f32;

impl Slabs {
    #[inline(always)]
    pub fn new(origin: Vec3A, direction: Vec3A) -> Self {
        let zero = direction.abs().cmplt(Vec3A::splat(1.0 / LARGEST_INVERSE));
        let infinite = Vec3A::splat(LARGEST_INVERSE).copysign(direction);
        let inverse = Vec3A::select(zero, infinite, 1.0 / direction);
        let (extent, slowness) = (origin.abs() * PAD, inverse.abs());
        let pad = extent * slowness + extent.max_element() * slowness.min_element();
        let shift = -origin * inverse;
        let downward = direction.is_negative_bitmask() as usize;
        Self { inverse, near: shift - pad, far: shift + pad, downward }
    }

    #[inline(always)]
    fn enter(&self, node: &Node, limit: f32, gather: impl Gather) -> Entered {
        let (mut near, mut far) = ([0.0; 8], [limit; 8]);
        self.clip(node, 0, &mut near, &mut far);
        self.clip(node, 1, &mut near, &mut far);
        self.clip(node, 2, &mut near, &mut far);
        let inside = [0, 1, 2, 3, 4, 5, 6, 7].map(|i| if near[i] <= far[i] { u32::MAX } else { 0 });
        Entered { near, mask: gather(inside) }
    }

    /// Shortens the intervals in which the ray is inside the boxes to those between the planes
    /// across an axis.
    #[inline(always)]
    fn clip(&self, node: &Node, axis: usize, near: &mut [f32; 8], far: &mut [f32; 8]) {
        let upper_first = self.downward >> axis & 1;
        let (first, last) = (&node[2 * axis + upper_first].0, &node[2 * axis + 1 - upper_first].0);
        for i in 0..8 {
            let t = first[i] * self.inverse[axis] + self.near[axis];
            near[i] = if t > near[i] { t } else { near[i] };
            let t = last[i] * self.inverse[axis] + self.far[axis];
            far[i] = if t < far[i] { t } else { far[i] };
        }
    }
}
