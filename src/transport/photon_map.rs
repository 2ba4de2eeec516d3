//! The photon map: stored arrivals, and the k nearest of them (kiddo's kd-tree).

use std::{collections::BTreeMap, num::NonZero, ops::Range, sync::Arc};

use glam::{Mat3, Vec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};

mod builder;
mod direction;
#[cfg(test)]
mod tests;

pub use builder::{MapBuilder, TaskArrivals, TaskKey};
pub use direction::PackedDirection;

/// A photon that arrived on, or crossed, a surface.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Where, relative to the centre of the scene, m.
    pub position: Vec3,
    /// What it is filed under: a channel of a captor, for a run.
    pub bin: u32,
    /// The rest of it.
    pub photon: StoredPhoton,
}

/// What a map keeps of an arrival beside its power: the place is kept by the tree of its bin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoredPhoton {
    /// The way it travelled.
    pub direction: PackedDirection,
    /// Index of the triangle, among the surfaces or the virtual captors.
    pub triangle: u32,
    /// Index of the light that it came from.
    pub light: u32,
    /// Index of its history in the task; in a map, among the histories that it holds.
    pub history: u32,
}

/// How a photon came from its light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Way {
    /// How often it was scattered in a random direction.
    pub bounces: u16,
    /// Whether it was mirrored or refracted, too.
    pub mirrored: bool,
    /// Whether one of those bounces was at a surface without a glossy lobe.
    pub diffused: bool,
}

impl Way {
    /// Whether it came by way of mirrors, refraction or gloss alone: light that no path from a camera should look for,
    /// as it would find it seldom, and much of it then.
    pub fn is_focused(self) -> bool {
        !self.diffused && (self.mirrored || self.bounces > 0)
    }
}

/// Stored photons, bin by bin, with a tree over each large bin.
pub struct PhotonMap {
    /// All photons; those of one bin stand side by side.
    pub photons: Arc<Vec<StoredPhoton>>,
    power: Vec<f32>,
    ways: Vec<Way>,
    bands: usize,
    /// The histories that these are all arrivals of.
    pub histories: u64,
    bins: Arc<BTreeMap<u32, Bin>>,
}

struct Bin {
    range: Range<usize>,
    places: Places,
}

/// Where the photons of a bin are.
enum Places {
    /// One by one: few, or such as kiddo refuses.
    List(Vec<Vec3>),
    /// Turned.
    Tree(ImmutableKdTree<f32, 3>),
}

/// A stored photon near a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Index of the photon.
    pub index: usize,
    /// Squared distance, m2.
    pub distance2: f32,
}

/// Bins of at most this many arrivals are searched one by one.
const SMALL_SHELF: usize = 1024;

impl PhotonMap {
    /// A map of all arrivals of `histories`, and their powers per band times `histories`, one after the
    /// other.
    ///
    /// # Panics
    ///
    /// Unless there are `bands` powers for each arrival, and fewer than 2^32 arrivals.
    pub fn new(arrivals: Vec<Arrival>, power: Vec<f32>, bands: usize, histories: u64) -> Self {
        Self::file(arrivals, power, Vec::new(), bands, histories)
    }

    fn file(
        arrivals: Vec<Arrival>,
        power: Vec<f32>,
        ways: Vec<Way>,
        bands: usize,
        histories: u64,
    ) -> Self {
        assert_eq!(power.len(), arrivals.len() * bands, "powers of all arrivals");
        let count = u32::try_from(arrivals.len()).expect("fewer than 2^32 arrivals");
        let mut order: Vec<u32> = (0..count).collect();
        order.sort_by_key(|&i| arrivals[i as usize].bin);
        let arrival = |&i: &u32| &arrivals[i as usize];
        let mut bins = BTreeMap::new();
        let mut first = 0;
        for bin in order.chunk_by(|a, b| arrival(a).bin == arrival(b).bin) {
            let range = first..first + bin.len();
            first = range.end;
            let places = Places::of(bin.iter().map(|i| arrival(i).position));
            bins.insert(arrival(&bin[0]).bin, Bin { range, places });
        }
        let photons = order.iter().map(|i| arrival(i).photon).collect::<Vec<_>>();
        drop(arrivals);
        let mut sorted = Vec::with_capacity(power.len());
        order.iter().for_each(|&i| sorted.extend(&power[i as usize * bands..][..bands]));
        let ways =
            if ways.is_empty() { ways } else { order.iter().map(|&i| ways[i as usize]).collect() };
        let (photons, bins) = (Arc::new(photons), Arc::new(bins));
        Self { photons, power: sorted, ways, bands, histories, bins }
    }

    /// Power of a photon per band, W or umol/s x [`histories`](Self::histories).
    pub fn power(&self, index: usize) -> &[f32] {
        &self.power[index * self.bands..][..self.bands]
    }

    /// The same map with the powers of each light times these factors, which are per band.
    pub fn at_powers<'a>(&self, factors: impl Fn(usize) -> &'a [f64]) -> Self {
        let scaled = |(photon, power): (&StoredPhoton, &[f32])| {
            let factors = factors(photon.light as usize);
            power.iter().zip(factors).map(|(p, f)| (f64::from(*p) * f) as f32).collect::<Vec<_>>()
        };
        let power = self.photons.iter().zip(self.power.chunks(self.bands)).flat_map(scaled);
        Self {
            photons: self.photons.clone(),
            ways: self.ways.clone(),
            power: power.collect(),
            bins: self.bins.clone(),
            ..*self
        }
    }

    /// The photons that came in some ways, of a map that keeps them.
    pub fn part(&self, wanted: impl Fn(Way) -> bool) -> Self {
        let (mut arrivals, mut power, mut ways) = (Vec::new(), Vec::new(), Vec::new());
        let positions = self.positions();
        for (&bin, Bin { range, .. }) in self.bins.iter() {
            for i in range.clone().filter(|&i| wanted(self.ways[i])) {
                arrivals.push(Arrival { position: positions[i], bin, photon: self.photons[i] });
                power.extend(self.power(i));
                ways.push(self.ways[i]);
            }
        }
        Self::file(arrivals, power, ways, self.bands, self.histories)
    }

    /// The bins that have photons, and the indices of these.
    pub fn bins(&self) -> impl Iterator<Item = (u32, Range<usize>)> {
        self.bins.iter().map(|(bin, Bin { range, .. })| (*bin, range.clone()))
    }

    /// How each photon came, in the order of `photons`; empty in a map that does not keep it.
    pub fn ways(&self) -> &[Way] {
        &self.ways
    }

    /// Where each photon is, in the order of `photons`, m relative to the centre of the scene; those in
    /// trees to rounding.
    pub fn positions(&self) -> Vec<Vec3> {
        let mut positions = vec![Vec3::ZERO; self.photons.len()];
        for Bin { range, places } in self.bins.values() {
            let positions = &mut positions[range.clone()];
            match places {
                Places::List(places) => positions.copy_from_slice(places),
                Places::Tree(tree) => {
                    tree.iter().for_each(|(i, p)| positions[i as usize] = turned_back(p));
                }
            }
        }
        positions
    }

    /// How many photons a bin has.
    pub fn count(&self, bin: u32) -> usize {
        self.bins.get(&bin).map_or(0, |bin| bin.range.len())
    }

    /// How many histories these are of.
    pub fn histories_on(&self, bin: u32) -> usize {
        let Some(Bin { range, .. }) = self.bins.get(&bin) else { return 0 };
        // they are stored in the order of their histories
        self.photons[range.clone()].chunk_by(|a, b| a.history == b.history).count()
    }

    /// The photons of a bin nearer to `point` than the k-th, and the area inside the ball that this one spans, as `inside`
    /// tells it from the radius, m. With fewer than `k` (at least 1) photons all of them, and the `whole` area, m2. None
    /// where there is no photon or no area.
    pub fn gather(
        &self,
        bin: u32,
        point: Vec3,
        k: usize,
        whole: f64,
        inside: impl FnOnce(f32) -> f64,
    ) -> Option<Gathered> {
        let mut photons = self.nearest(bin, point, k);
        let found = photons.len();
        let (radius, area) = if found < k {
            (None, whole)
        } else {
            let radius = photons.pop()?.distance2.sqrt();
            (Some(radius), inside(radius))
        };
        let weight = 1.0 / (area * self.histories as f64);
        let some = found > 0 && weight.is_finite();
        some.then_some(Gathered { photons, found, radius, area, weight })
    }

    /// The `k` (at least 1) photons of a bin nearest to `point`, nearest first; fewer where the
    /// bin has fewer.
    pub fn nearest(&self, bin: u32, point: Vec3, k: usize) -> Vec<Neighbour> {
        let (Some(Bin { range, places }), Some(k)) = (self.bins.get(&bin), NonZero::new(k)) else {
            return Vec::new();
        };
        let mut found = places.nearest(point, k);
        found.iter_mut().for_each(|neighbour| neighbour.index += range.start);
        found
    }
}

/// The photons that count at a point of one face, and the area that they fell on.
pub struct Gathered {
    /// All but the k-th.
    pub photons: Vec<Neighbour>,
    /// How many there were, with the k-th.
    pub found: usize,
    /// Distance of the k-th, m; none where there are fewer.
    pub radius: Option<f32>,
    /// m2.
    pub area: f64,
    /// What makes an irradiance of their powers: 1 / (area x histories), 1/m2.
    pub weight: f64,
}

impl Places {
    fn of(places: impl ExactSizeIterator<Item = Vec3> + Clone) -> Self {
        if places.len() > SMALL_SHELF {
            let points: Vec<[f32; 3]> = places.clone().map(turned).collect();
            if let Ok(tree) = ImmutableKdTree::new_from_slice(&points) {
                return Self::Tree(tree);
            }
        }
        Self::List(places.collect())
    }

    fn nearest(&self, point: Vec3, k: NonZero<usize>) -> Vec<Neighbour> {
        let neighbour = |item, distance2| Neighbour { index: item as usize, distance2 };
        let mut all: Vec<Neighbour> = match self {
            Self::Tree(tree) if k.get() < tree.size() => {
                let point = turned(point);
                let found = tree.query(&point).nearest_n::<SquaredEuclidean<f32>>(k).execute();
                return found.iter().map(|f| neighbour(f.item, f.distance)).collect();
            }
            Self::Tree(tree) => {
                let point = Vec3::from(turned(point));
                let distance2 = |place: [f32; 3]| point.distance_squared(place.into());
                tree.iter().map(|(item, place)| neighbour(item, distance2(place))).collect()
            }
            Self::List(places) => {
                (0..).zip(places).map(|(i, p)| neighbour(i, p.distance_squared(point))).collect()
            }
        };
        let order = |a: &Neighbour, b: &Neighbour| {
            a.distance2.total_cmp(&b.distance2).then(a.index.cmp(&b.index))
        };
        if k.get() < all.len() {
            all.select_nth_unstable_by(k.get() - 1, order);
            all.truncate(k.get());
        }
        all.sort_unstable_by(order);
        all
    }
}

/// Photons lie on walls, and a wall across an axis wastes the splits along it: turn everything
/// once by a generic rotation.
const ROTATION: Mat3 = Mat3::from_cols_array(&[
    -0.727_502, -0.170_520, 0.664_578, -0.375_651, -0.711_547, -0.593_790, 0.574_132, -0.681_633,
    0.453_596,
]);

fn turned(p: Vec3) -> [f32; 3] {
    (ROTATION * p).to_array()
}

fn turned_back(p: [f32; 3]) -> Vec3 {
    ROTATION.transpose() * Vec3::from(p)
}
