//! The searches of the structure, compiled twice: for any processor, and for those with AVX2.

use std::{cell::Cell, sync::LazyLock};

use super::layout::{Bvh, Gather, Hit};
use super::walk::Probe;
use crate::math::{effort, geometry::Ray};

/// A search with its arguments. `answer` must be inlined: what it calls is then compiled for the
/// processor too, and the ray stays in registers. Callbacks for hits are called through a pointer:
/// that is rare, and it makes one copy of the walk for each kind of search, not for each caller.
pub(super) trait Query {
    type Answer;
    fn answer(self, gather: impl Gather) -> Self::Answer;
}

/// The variant of the code that traces rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// Code for x86-64 processors with AVX2, BMI and LZCNT.
    Avx2,
    /// Code that runs on any processor.
    Plain,
}

impl Kernel {
    /// Returns the fastest kernel that this processor can run, or the plain one if the environment
    /// variable `PHYLUX_KERNEL` is `plain`. Both give the same bits.
    pub fn used() -> Self {
        static USED: LazyLock<Kernel> = LazyLock::new(|| {
            #[cfg(target_arch = "x86_64")]
            let able = is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("lzcnt");
            #[cfg(not(target_arch = "x86_64"))]
            let able = false;
            let plain = std::env::var_os("PHYLUX_KERNEL").is_some_and(|kernel| kernel == "plain");
            if able && !plain { Kernel::Avx2 } else { Kernel::Plain }
        });
        *USED
    }

    /// Returns the name of the kernel, as `phylux --version` prints it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Avx2 => "AVX2",
            Self::Plain => "plain",
        }
    }
}

/// Runs a search with the fastest code for this processor, and counts its work where work is counted.
#[inline]
pub(super) fn ask<Q: Query>(query: Q) -> Q::Answer {
    match effort::is_counted() {
        true => ask_counted(query),
        false => ask_fastest(query),
    }
}

#[inline]
fn ask_fastest<Q: Query>(query: Q) -> Q::Answer {
    #[cfg(target_arch = "x86_64")]
    if Kernel::used() == Kernel::Avx2 {
        #[allow(unsafe_code)]
        // SAFETY: the processor has the instructions that are needed, as was just checked.
        return unsafe { ask_avx2(query) };
    }
    ask_plain(query)
}

/// Runs a search with code for any processor. It is never inlined, so that the answer is returned
/// straight to the caller.
#[inline(never)]
pub(super) fn ask_plain<Q: Query>(query: Q) -> Q::Answer {
    query.answer(|lanes| (0..8).map(|i| (lanes[i] & 1) << i).sum())
}

#[cold]
#[inline(never)]
fn ask_counted<Q: Query>(query: Q) -> Q::Answer {
    let visits = Cell::new(0);
    let answer = ask_fastest(Counted { query, visits: &visits });
    effort::spend(effort::RAY + effort::VISIT * visits.get());
    answer
}

/// A search that counts its tests of boxes and triangles. Each ends by gathering bits.
struct Counted<'a, Q> {
    query: Q,
    visits: &'a Cell<u64>,
}

impl<Q: Query> Query for Counted<'_, Q> {
    type Answer = Q::Answer;

    #[inline(always)]
    fn answer(self, gather: impl Gather) -> Q::Answer {
        let visits = self.visits;
        self.query.answer(move |lanes: [u32; 8]| {
            visits.set(visits.get() + 1);
            gather(lanes)
        })
    }
}

/// Runs a search with code compiled for AVX2. It gives the same bits, as Rust never
/// contracts a * b + c.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt")]
fn ask_avx2<Q: Query>(query: Q) -> Q::Answer {
    query.answer(|lanes| gather_avx2(lanes))
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
#[inline]
fn gather_avx2([a, b, c, d, e, f, g, h]: [u32; 8]) -> u32 {
    use std::arch::x86_64::{_mm256_castsi256_ps, _mm256_movemask_ps, _mm256_setr_epi32};
    let [a, b, c, d, e, f, g, h] = [a, b, c, d, e, f, g, h].map(u32::cast_signed);
    _mm256_movemask_ps(_mm256_castsi256_ps(_mm256_setr_epi32(a, b, c, d, e, f, g, h))) as u32
}

/// The search of [`Bvh::closest`].
pub(super) struct Closest<'a> {
    pub bvh: &'a Bvh,
    pub ray: &'a Ray,
    pub t_max: f32,
}

impl Query for Closest<'_> {
    type Answer = Option<Hit>;

    #[inline(always)]
    fn answer(self, gather: impl Gather) -> Option<Hit> {
        self.bvh.closest_of(&Probe::new(self.ray), self.t_max, gather)
    }
}

/// The search of [`Bvh::occluded`].
pub(super) struct Occluded<'a> {
    pub bvh: &'a Bvh,
    pub ray: &'a Ray,
    pub t_max: f32,
    pub stops: &'a mut dyn FnMut(Hit) -> bool,
}

impl Query for Occluded<'_> {
    type Answer = bool;

    #[inline(always)]
    fn answer(self, gather: impl Gather) -> bool {
        let Self { bvh, ray, t_max, stops } = self;
        let mut found = false;
        bvh.walk(&Probe::new(ray), t_max, gather, |hit| {
            found = found || (hit.t < t_max && stops(hit));
            if found { -1.0 } else { t_max }
        });
        found
    }
}

/// The search of [`Bvh::crossings`].
pub(super) struct Crossings<'a> {
    pub bvh: &'a Bvh,
    pub ray: &'a Ray,
    pub t_max: f32,
    pub visit: &'a mut dyn FnMut(Hit),
}

impl Query for Crossings<'_> {
    type Answer = ();

    #[inline(always)]
    fn answer(self, gather: impl Gather) {
        let probe = Probe::new(self.ray);
        self.bvh.crossings_of(&probe, self.t_max, gather, self.visit);
    }
}

/// The search of [`Bvh::meet`].
pub(super) struct Meet<'a> {
    pub surfaces: &'a Bvh,
    pub crossed: &'a Bvh,
    pub ray: &'a Ray,
    pub visit: &'a mut dyn FnMut(Hit, bool),
}

impl Query for Meet<'_> {
    type Answer = Option<Hit>;

    #[inline(always)]
    fn answer(self, gather: impl Gather) -> Option<Hit> {
        let Self { surfaces, crossed, ray, visit } = self;
        let probe = Probe::new(ray);
        let hit = surfaces.closest_of(&probe, f32::INFINITY, gather);
        let t_max = hit.map_or(f32::INFINITY, |hit| hit.t);
        crossed.crossings_of(&probe, t_max.next_up(), gather, |hit| visit(hit, hit.t == t_max));
        hit
    }
}

/// Tells of a box of a tree what it holds: the ray in the coordinates of the tree in it, with the
/// same distances along it, and that tree.
pub(in crate::scene) type Enter<'e, 't> = &'e dyn Fn(u32) -> (Ray, &'t Bvh);

/// The search of [`Bvh::closest_within`].
pub(super) struct ClosestWithin<'a, 't> {
    pub boxes: &'a Bvh,
    pub ray: &'a Ray,
    pub t_max: f32,
    pub enter: Enter<'a, 't>,
}

impl Query for ClosestWithin<'_, '_> {
    type Answer = Option<(u32, Hit)>;

    #[inline(always)]
    fn answer(self, gather: impl Gather) -> Self::Answer {
        let Self { boxes, ray, t_max, enter } = self;
        let mut nearest = None;
        boxes.walk_leaves(&Probe::new(ray).slabs, t_max, gather, |index, limit| {
            let (ray, bvh) = enter(index as u32);
            match bvh.closest_of(&Probe::new(&ray), limit, gather) {
                Some(hit) => {
                    nearest = Some((index as u32, hit));
                    hit.t
                }
                None => limit,
            }
        });
        nearest
    }
}

/// The search of [`Bvh::occluded_within`].
pub(super) struct OccludedWithin<'a, 't> {
    pub boxes: &'a Bvh,
    pub ray: &'a Ray,
    pub t_max: f32,
    pub enter: Enter<'a, 't>,
    pub stops: &'a mut dyn FnMut(u32, Hit) -> bool,
}

impl Query for OccludedWithin<'_, '_> {
    type Answer = bool;

    #[inline(always)]
    fn answer(self, gather: impl Gather) -> bool {
        let Self { boxes, ray, t_max, enter, stops } = self;
        let mut found = false;
        boxes.walk_leaves(&Probe::new(ray).slabs, t_max, gather, |index, _| {
            let (ray, bvh) = enter(index as u32);
            bvh.walk(&Probe::new(&ray), t_max, gather, |hit| {
                found = found || (hit.t < t_max && stops(index as u32, hit));
                if found { -1.0 } else { t_max }
            });
            if found { -1.0 } else { t_max }
        });
        found
    }
}

impl Bvh {
    #[inline(always)]
    fn closest_of(&self, probe: &Probe, t_max: f32, gather: impl Gather) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        self.walk(probe, t_max, gather, |hit| {
            let nearer = match nearest {
                None => hit.t < t_max,
                Some(n) => hit.t < n.t || (hit.t == n.t && hit.triangle < n.triangle),
            };
            if nearer {
                nearest = Some(hit);
            }
            nearest.map_or(t_max, |nearest| nearest.t)
        });
        nearest
    }

    #[inline(always)]
    fn crossings_of(
        &self,
        probe: &Probe,
        t_max: f32,
        gather: impl Gather,
        mut visit: impl FnMut(Hit),
    ) {
        self.walk(probe, t_max, gather, |hit| {
            if hit.t < t_max && hit.owned {
                visit(hit);
            }
            t_max
        });
    }
}
