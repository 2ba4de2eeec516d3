//! The walk through the tree, and ray against eight boxes.

use glam::{Vec3, Vec3A, Vec4};

use super::triangle::{Shear, main_axis};
use super::{Bvh, Hit};
use crate::geometry::Ray;

/// Eight children: their boxes and what is inside.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(super) struct Node {
    /// Along x, y, z the lower (0) and upper (1) planes of the boxes, m. A child that does not
    /// exist has +infinity and -infinity, which no ray enters.
    planes: [[[f32; 8]; 2]; 3],
    /// Where each child is.
    children: [Child; 8],
}

impl Node {
    /// No children.
    pub const EMPTY: Self = Self {
        planes: [[[f32::INFINITY; 8], [f32::NEG_INFINITY; 8]]; 3],
        children: [Child::NONE; 8],
    };

    /// Makes `child`, whose box is `min` to `max`, the one at `place`.
    pub fn set(&mut self, place: usize, child: Child, min: Vec3, max: Vec3) {
        self.children[place] = child;
        for axis in 0..3 {
            self.planes[axis][0][place] = min[axis];
            self.planes[axis][1][place] = max[axis];
        }
    }
}

/// An inner node's index, or with the highest bit set a leaf: first triangle and count (1 to 3).
#[derive(Clone, Copy, Debug)]
pub(super) struct Child(u32);

const LEAF: u32 = 1 << 31;

impl Child {
    const NONE: Self = Self(LEAF);

    pub fn inner(node: u32) -> Self {
        assert!(node < LEAF);
        Self(node)
    }

    pub fn leaf(first: u32, count: u32) -> Self {
        assert!(first < LEAF >> 2 && count < 4);
        Self(LEAF | first << 2 | count)
    }

    #[inline(always)]
    fn is_leaf(self) -> bool {
        self.0 & LEAF != 0
    }

    #[inline(always)]
    fn triangles(self) -> std::ops::Range<usize> {
        let first = (self.0 & !LEAF) >> 2;
        first as usize..(first + (self.0 & 3)) as usize
    }
}

/// A child that waits, with the distance at which the ray enters its box: the bits of a float >= 0
/// above the child's. So the nearest is the least.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
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

impl Node {
    /// Which children's boxes reach into a ball, as a bit mask; rounding may add one that touches it.
    #[inline(always)]
    fn touched(&self, center: Vec3, radius: f32) -> u32 {
        let mut distance2 = [0.0; 8];
        for axis in 0..3 {
            let [min, max] = &self.planes[axis];
            for i in 0..8 {
                let outside = (min[i] - center[axis]).max(center[axis] - max[i]).max(0.0);
                distance2[i] += outside * outside;
            }
        }
        let reach2 = radius * radius * (1.0 + 1e-5);
        (0..8).map(|i| u32::from(distance2[i] <= reach2) << i).sum()
    }
}

impl Bvh {
    /// Asks for the memory of a child that waits, so that it is there when its turn comes: among half a
    /// million triangles that saves a seventh of the time.
    #[inline(always)]
    fn prefetch(&self, child: Child) {
        #[cfg(target_arch = "x86_64")]
        #[allow(unsafe_code)]
        {
            use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
            let (start, bytes) = if child.is_leaf() {
                let start = self.corners.as_ptr().wrapping_add(child.triangles().start);
                (start.cast::<i8>(), 2 * size_of::<[Vec4; 3]>())
            } else {
                let start = self.nodes.as_ptr().wrapping_add(child.0 as usize);
                (start.cast::<i8>(), size_of::<Node>())
            };
            for line in (0..bytes).step_by(64) {
                // SAFETY: every processor of this kind has it, and it reads nothing.
                unsafe { _mm_prefetch(start.wrapping_add(line), _MM_HINT_T0) };
            }
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = child;
    }

    /// Calls `visit` with the place of each triangle in boxes that reach into a ball.
    pub(super) fn walk_ball(&self, center: Vec3, radius: f32, mut visit: impl FnMut(usize)) {
        if self.nodes.is_empty() {
            return;
        }
        let mut waiting = Vec::with_capacity(self.stack_size + 8);
        waiting.push(Child::inner(0));
        while let Some(child) = waiting.pop() {
            if child.is_leaf() {
                child.triangles().for_each(&mut visit);
                continue;
            }
            let node = &self.nodes[child.0 as usize];
            let mut mask = node.touched(center, radius);
            while mask != 0 {
                waiting.push(node.children[mask.trailing_zeros() as usize & 7]);
                mask &= mask - 1;
            }
        }
    }

    /// See [`Bvh::walk`]; `enter` is the box test.
    #[inline(always)]
    pub(super) fn walk_with<S>(
        &self,
        Probe { slabs, shear }: &Probe,
        t_max: f32,
        mut state: S,
        visit: impl Fn(&mut S, Hit) -> f32,
        enter: impl Fn(&Slabs, &Node, f32) -> Entered,
    ) -> S {
        if self.nodes.is_empty() {
            return state;
        }
        // clearing more than is needed would cost a short walk a tenth of its time
        let (mut small, mut medium, mut large);
        let stack: &mut [Waiting] = match self.stack_size {
            0..=48 => {
                small = [Waiting::default(); 48];
                &mut small
            }
            49..=100 => {
                medium = [Waiting::default(); 100];
                &mut medium
            }
            _ => {
                large = vec![Waiting::default(); self.stack_size];
                &mut large
            }
        };
        let mut limit = t_max;
        let mut waiting = 0;
        let mut child = Child::inner(0);
        loop {
            if child.is_leaf() {
                for i in child.triangles() {
                    if let Some(m) = shear.meet(&self.corners[i], limit) {
                        let hit = Hit {
                            t: m.t,
                            triangle: self.indices[i],
                            place: i as u32,
                            u: m.u,
                            v: m.v,
                            owned: m.owned,
                        };
                        limit = visit(&mut state, hit);
                    }
                }
            } else {
                let node = &self.nodes[child.0 as usize];
                let Entered { near, mut mask } = enter(slabs, node, limit);
                if mask != 0 {
                    let mut next = || {
                        let i = mask.trailing_zeros() as usize & 7;
                        mask &= mask - 1;
                        (Waiting::new(near[i], node.children[i]), mask == 0)
                    };
                    let (mut nearest, mut last) = next();
                    let bottom = waiting;
                    while !last {
                        let other;
                        (other, last) = next();
                        // those that wait stay in order, the nearest on top
                        let farther = nearest.max(other);
                        self.prefetch(farther.child());
                        nearest = nearest.min(other);
                        let mut place = waiting;
                        while place > bottom && stack[place - 1] < farther {
                            stack[place] = stack[place - 1];
                            place -= 1;
                        }
                        stack[place] = farther;
                        waiting += 1;
                    }
                    child = nearest.child();
                    continue;
                }
            }
            child = loop {
                if waiting == 0 {
                    return state;
                }
                waiting -= 1;
                if stack[waiting].near() <= limit {
                    break stack[waiting].child();
                }
            };
        }
    }
}

/// A ray, prepared for boxes and triangles of one or more trees.
pub struct Probe {
    slabs: Slabs,
    shear: Shear,
}

impl Probe {
    /// For trees of which no corner lies beyond `reach`, m from the origin along each axis.
    #[inline(always)]
    pub fn new(ray: &Ray, reach: Vec3) -> Self {
        let slabs = Slabs::new(ray, reach);
        let shear = Shear::new(ray, slabs.inverse);
        Self { slabs, shear }
    }
}

/// A ray, and what the box test needs of it: the distance of the plane x = p is p `inverse.x` +
/// `near.x` or + `far.x`, rounded down or up.
///
/// Let u = 2^-24, r the scene's reach along an axis, o that of the ray's origin, k one over the
/// direction, R, O, K the same of the main axis (the direction's largest). The sums below err by
/// less than 6 u (r + o) k. The triangle test shears corners with errors of 2 u (r + o) and
/// 5 u (R + O) times the slope, as if the distance were off by 2 u (r + o) k + 5 u (R + O) K. A pad
/// of 16 u of both terms covers it all: no box is left out in which a triangle would be hit.
pub(super) struct Slabs {
    inverse: [f32; 3],
    near: [f32; 3],
    far: [f32; 3],
    /// Which of the two planes the ray meets first.
    first: [usize; 3],
}

/// Which of the children a ray enters before its limit, as a bit mask, and at what distance.
pub(super) struct Entered {
    near: [f32; 8],
    mask: u32,
}

const PAD: f32 = 16.0 / (1 << 24) as f32;

/// Stands for 1/0: large enough for every other distance to be small beside it, small enough for
/// no product to overflow. With it a ray in the plane of a box's face counts as inside: the pad
/// of that axis exceeds every distance.
const LARGEST_INVERSE: f32 = (1u128 << 96) as f32;

impl Slabs {
    #[inline(always)]
    fn new(ray: &Ray, reach: Vec3) -> Self {
        let (o, d) = (Vec3A::from(ray.origin), Vec3A::from(ray.direction));
        let zero = d.abs().cmplt(Vec3A::splat(1.0 / LARGEST_INVERSE));
        let inverse = Vec3A::select(zero, Vec3A::splat(LARGEST_INVERSE).copysign(d), 1.0 / d);
        let error = (Vec3A::from(reach) + o.abs()) * inverse.abs() * PAD;
        let pad = error + Vec3A::splat(error.to_array()[main_axis(ray.direction)]);
        let shift = -o * inverse;
        let first = d.is_negative_bitmask() as usize;
        Self {
            inverse: inverse.to_array(),
            near: (shift - pad).to_array(),
            far: (shift + pad).to_array(),
            first: [first & 1, first >> 1 & 1, first >> 2],
        }
    }

    #[inline(always)]
    pub fn enter(&self, node: &Node, limit: f32) -> Entered {
        let mut near = [0.0; 8];
        let mut far = [limit; 8];
        for axis in 0..3 {
            let first = self.first[axis] & 1;
            let (entry, exit) = (&node.planes[axis][first], &node.planes[axis][1 - first]);
            for i in 0..8 {
                let t = entry[i] * self.inverse[axis] + self.near[axis];
                near[i] = if t > near[i] { t } else { near[i] };
                let t = exit[i] * self.inverse[axis] + self.far[axis];
                far[i] = if t < far[i] { t } else { far[i] };
            }
        }
        let mask = (0..8).map(|i| u32::from(near[i] <= far[i]) << i).sum();
        Entered { near, mask }
    }

    /// The same eight at a time.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    #[inline]
    pub fn enter_avx2(&self, node: &Node, limit: f32) -> Entered {
        use std::arch::x86_64::*;
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let first = self.first[axis] & 1;
            let inverse = _mm256_set1_ps(self.inverse[axis]);
            let entry = _mm256_mul_ps(load(&node.planes[axis][first]), inverse);
            let exit = _mm256_mul_ps(load(&node.planes[axis][1 - first]), inverse);
            let near = _mm256_add_ps(entry, _mm256_set1_ps(self.near[axis]));
            let far = _mm256_add_ps(exit, _mm256_set1_ps(self.far[axis]));
            (near, far)
        });
        let near = _mm256_max_ps(_mm256_max_ps(x.0, y.0), _mm256_max_ps(z.0, _mm256_setzero_ps()));
        let far = _mm256_min_ps(_mm256_min_ps(x.1, y.1), _mm256_min_ps(z.1, _mm256_set1_ps(limit)));
        let mask = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(near, far)) as u32;
        Entered { near: store(near), mask }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
#[allow(unsafe_code)]
fn load(lanes: &[f32; 8]) -> std::arch::x86_64::__m256 {
    // SAFETY: reads the eight numbers that the reference stands for.
    unsafe { std::arch::x86_64::_mm256_loadu_ps(lanes.as_ptr()) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
#[allow(unsafe_code)]
fn store(lanes: std::arch::x86_64::__m256) -> [f32; 8] {
    let mut out = [0.0; 8];
    // SAFETY: writes the eight numbers of `out`.
    unsafe { std::arch::x86_64::_mm256_storeu_ps(out.as_mut_ptr(), lanes) };
    out
}
