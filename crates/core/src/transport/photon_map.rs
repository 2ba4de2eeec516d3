//! The photon map: stored arrivals, and the search for the k nearest of them (kiddo's kd-tree).

use std::{num::NonZero, ops::Range, sync::Arc};

use glam::{Mat3, Vec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rayon::prelude::*;

mod builder;
mod direction;
#[cfg(test)]
mod tests;
mod thinning;

pub use builder::{MapBuilder, TaskArrivals, TaskKey};
pub use direction::PackedDirection;
pub use thinning::{Seen, Thinning, chosen_k};

/// A photon that arrived on a surface, or crossed a virtual captor.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Position relative to the centre of the scene, m.
    pub position: Vec3,
    /// The bin under which the arrival is filed; in a run, a channel of a captor.
    pub bin: u32,
    /// The other properties of the photon.
    pub photon: StoredPhoton,
}

/// What a map keeps of an arrival besides its power. The tree of the bin keeps the position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoredPhoton {
    /// Direction of flight.
    pub direction: PackedDirection,
    /// Index of the triangle, among those of the surfaces or of the virtual captors.
    pub triangle: u32,
    /// Index of the light that emitted the photon.
    pub light: u32,
    /// Index of its history: within its task in an arrival, and among the histories that arrived in
    /// a map.
    pub history: u32,
}

/// The way by which a photon came from its light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Way {
    /// Number of times that it was scattered by a diffuse or glossy lobe.
    pub bounces: u16,
    /// Whether it was also mirrored or refracted.
    pub mirrored: bool,
    /// Whether one of those bounces was at a surface without a glossy lobe.
    pub diffused: bool,
}

impl Way {
    /// Returns whether the photon came by way of mirrors, refraction or gloss alone. A path from a
    /// camera should not look for such light, because it would seldom find any, and then much.
    pub fn is_focused(self) -> bool {
        !self.diffused && (self.mirrored || self.bounces > 0)
    }
}

/// Stored photons, bin by bin, with a kd-tree over each large bin.
pub struct PhotonMap {
    /// The photons that are stored, sorted by bin.
    pub photons: Arc<Vec<StoredPhoton>>,
    power: Vec<f32>,
    ways: Vec<Way>,
    bands: usize,
    /// Number of histories, all arrivals of which are stored here.
    pub histories: u64,
    bins: Arc<Bins>,
    /// What arrived in the bins of which only photons near the middle of the face are stored, by rising
    /// bins.
    thinned: Arc<[Seen]>,
}

/// The bins that have photons. On leaves there are nearly as many bins as photons, so that a bin
/// takes only a few bytes.
#[derive(Default)]
struct Bins {
    /// In rising order of their numbers.
    bins: Vec<Bin>,
    /// Number of photons of all bins.
    photons: usize,
    /// The positions of the photons of those bins that are searched one by one: those of few
    /// photons, or of positions that kiddo refuses.
    listed: Vec<Vec3>,
    /// For each other bin a kd-tree of the positions, which are turned by [`ROTATION`].
    trees: Vec<ImmutableKdTree<f32, 3>>,
}

#[derive(Clone, Copy)]
struct Bin {
    number: u32,
    /// Index of its first photon; the others follow.
    first: u32,
    places: Places,
}

/// Where the positions of the photons of a bin are.
#[derive(Clone, Copy)]
enum Places {
    /// From this place of the list on.
    Listed(u32),
    /// In the tree of this index.
    Tree(u32),
}

/// A stored photon near a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbour {
    /// Index of the photon.
    pub index: usize,
    /// Squared distance from the point, m2.
    pub distance2: f32,
}

/// Bins in which at most this many photons arrived are searched one by one.
const SMALL_BIN: usize = 1024;

impl PhotonMap {
    /// Makes a map of all arrivals of `histories` histories, on the threads of the current pool.
    /// `power` holds the powers of the first arrival per band, then those of the second, and so on,
    /// each multiplied by `histories`.
    ///
    /// # Panics
    ///
    /// If there are not `bands` powers for each arrival, or 2^32 arrivals or more.
    pub fn new(arrivals: Vec<Arrival>, power: Vec<f32>, bands: usize, histories: u64) -> Self {
        Self::file(arrivals, power, Vec::new(), bands, histories, Vec::new())
    }

    /// Files arrivals. `thinned` says of some bins, in rising order, what arrived in them where only
    /// photons near the middle of the face are stored.
    fn file(
        arrivals: Vec<Arrival>,
        power: Vec<f32>,
        ways: Vec<Way>,
        bands: usize,
        histories: u64,
        thinned: Vec<Seen>,
    ) -> Self {
        assert_eq!(power.len(), arrivals.len() * bands, "powers of all arrivals");
        let count = u32::try_from(arrivals.len()).expect("fewer than 2^32 arrivals");
        // by bin, and within it in the order of arrival: both in one number, which sorts quickly
        let key = |(i, arrival): (u32, &Arrival)| u64::from(arrival.bin) << 32 | u64::from(i);
        let mut keys: Vec<u64> = (0..count).zip(&arrivals).map(key).collect();
        keys.par_sort_unstable();
        let order: Vec<u32> = keys.into_iter().map(|key| key as u32).collect();
        let arrival = |&i: &u32| &arrivals[i as usize];
        let bins = Bins::new(&order, &arrivals, &thinned);
        let photons = order.iter().map(|i| arrival(i).photon).collect::<Vec<_>>();
        drop(arrivals);
        let mut sorted = Vec::with_capacity(power.len());
        order.iter().for_each(|&i| sorted.extend(&power[i as usize * bands..][..bands]));
        let ways =
            if ways.is_empty() { ways } else { order.iter().map(|&i| ways[i as usize]).collect() };
        let (photons, bins) = (Arc::new(photons), Arc::new(bins));
        Self { photons, power: sorted, ways, bands, histories, bins, thinned: thinned.into() }
    }

    /// Returns the power of a photon per band, W or umol/s, times [`histories`](Self::histories).
    pub fn power(&self, index: usize) -> &[f32] {
        &self.power[index * self.bands..][..self.bands]
    }

    /// Returns the same map with the powers of each light multiplied by `factors` of that light,
    /// per band.
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
            thinned: self.thinned.clone(),
            ..*self
        }
    }

    /// Returns the photons that came by a wanted way, of a map that stores ways.
    pub fn part(&self, wanted: impl Fn(Way) -> bool) -> Self {
        let (mut arrivals, mut power, mut ways) = (Vec::new(), Vec::new(), Vec::new());
        let positions = self.positions();
        for (bin, photons) in self.bins() {
            for i in photons.filter(|&i| wanted(self.ways[i])) {
                arrivals.push(Arrival { position: positions[i], bin, photon: self.photons[i] });
                power.extend(self.power(i));
                ways.push(self.ways[i]);
            }
        }
        Self::file(arrivals, power, ways, self.bands, self.histories, Vec::new())
    }

    /// Returns the bins that have photons, and the indices of these photons.
    pub fn bins(&self) -> impl Iterator<Item = (u32, Range<usize>)> {
        self.bins.all().map(|(bin, range)| (bin.number, range))
    }

    /// Returns the way by which each photon came, in the order of `photons`; empty in a map that
    /// does not store ways.
    pub fn ways(&self) -> &[Way] {
        &self.ways
    }

    /// Returns the position of each photon, in the order of `photons`, m relative to the centre of
    /// the scene; positions in trees are exact up to rounding.
    pub fn positions(&self) -> Vec<Vec3> {
        let mut positions = vec![Vec3::ZERO; self.photons.len()];
        for (bin, range) in self.bins.all() {
            let positions = &mut positions[range];
            match bin.places {
                Places::Listed(first) => {
                    positions
                        .copy_from_slice(&self.bins.listed[first as usize..][..positions.len()]);
                }
                Places::Tree(tree) => {
                    let places = self.bins.trees[tree as usize].iter();
                    places.for_each(|(i, p)| positions[i as usize] = turned_back(p));
                }
            }
        }
        positions
    }

    /// Returns the number of arrivals that the map stands for. A map that is made for the estimates at
    /// captors does not [store](Self::photons) them all.
    pub fn arrivals(&self) -> u64 {
        let plain = self.bins.all().filter(|(bin, _)| self.thinned_at(bin.number).is_none());
        let stored: u64 = plain.map(|(_, photons)| photons.len() as u64).sum();
        stored + self.thinned.iter().map(|seen| u64::from(seen.photons)).sum::<u64>()
    }

    /// Returns the number of photons that are stored of a bin.
    pub fn count(&self, bin: u32) -> usize {
        self.bins.of(bin).map_or(0, |(_, range)| range.len())
    }

    /// Returns the number of photons that arrived in a bin, and of the histories that they belong to. A
    /// map that is made for the estimates at captors stores, of many, only those near the middle of the
    /// face.
    pub fn arrived(&self, bin: u32) -> [usize; 2] {
        if let Some(Seen { photons, histories, .. }) = self.thinned_at(bin) {
            return [*photons as usize, *histories as usize];
        }
        let Some((_, range)) = self.bins.of(bin) else { return [0, 0] };
        // the photons of a bin are stored in the order of their histories
        let histories = self.photons[range.clone()].chunk_by(|a, b| a.history == b.history).count();
        [range.len(), histories]
    }

    fn thinned_at(&self, bin: u32) -> Option<&Seen> {
        seen_at(&self.thinned, bin)
    }

    /// Gathers the photons of a bin that are nearer to `point` than the k-th, and the area within
    /// the distance of the k-th, which `inside` returns for a radius in m. With fewer than `k` (at
    /// least 1) photons, gathers all of them and takes the `whole` area, m2. `None` if there are no
    /// photons or no area. Where only photons near the middle of a face are stored, `point` must be
    /// that middle.
    pub fn gather(
        &self,
        bin: u32,
        point: Vec3,
        k: usize,
        whole: f64,
        inside: impl FnOnce(f32) -> f64,
    ) -> Option<Gathered> {
        let mut photons = self.nearest(bin, point, k);
        let mut k = k;
        if let Some(Seen { radius2, .. }) = self.thinned_at(bin) {
            // all that are nearer are stored
            photons.retain(|photon| photon.distance2 < *radius2);
            k = k.min(photons.len());
        }
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

    /// Returns the `k` (at least 1) photons of a bin that are nearest to `point`, nearest first;
    /// all photons if the bin has fewer.
    pub fn nearest(&self, bin: u32, point: Vec3, k: usize) -> Vec<Neighbour> {
        let (Some((bin, range)), Some(k)) = (self.bins.of(bin), NonZero::new(k)) else {
            return Vec::new();
        };
        let mut found = match bin.places {
            Places::Listed(first) => {
                nearest_listed(&self.bins.listed[first as usize..][..range.len()], point, k)
            }
            Places::Tree(tree) => nearest_in(&self.bins.trees[tree as usize], point, k),
        };
        found.iter_mut().for_each(|neighbour| neighbour.index += range.start);
        found
    }
}

/// The photons that count at a point of one face, and the area on which they arrived.
pub struct Gathered {
    /// The photons, without the k-th.
    pub photons: Vec<Neighbour>,
    /// Number of photons found, with the k-th.
    pub found: usize,
    /// Distance of the k-th photon, m; `None` if there are fewer than k.
    pub radius: Option<f32>,
    /// Area on which the photons arrived, m2.
    pub area: f64,
    /// Factor that turns their powers into irradiances: 1 / (area x histories), 1/m2.
    pub weight: f64,
}

impl Bins {
    /// Files arrivals, whose `order` is by bin.
    fn new(order: &[u32], arrivals: &[Arrival], thinned: &[Seen]) -> Self {
        let arrival = |i: &u32| &arrivals[*i as usize];
        // distances in a tree are rounded in another way, so that how many are stored must not count
        let is_large = |bin: &&[u32]| {
            let seen = seen_at(thinned, arrival(&bin[0]).bin);
            seen.map_or(bin.len(), |seen| seen.photons as usize) > SMALL_BIN
        };
        let together = || order.chunk_by(|a, b| arrival(a).bin == arrival(b).bin);
        let large: Vec<&[u32]> = together().filter(is_large).collect();
        let tree = |bin: &[u32]| {
            let points: Vec<[f32; 3]> = bin.iter().map(|i| turned(arrival(i).position)).collect();
            ImmutableKdTree::new_from_slice(&points).ok()
        };
        let made: Vec<_> = large.into_par_iter().map(tree).collect();
        let mut made = made.into_iter();
        let mut all = Self::default();
        for bin in together() {
            let tree = if is_large(&bin) { made.next().flatten() } else { None };
            let places = match tree {
                Some(tree) => {
                    all.trees.push(tree);
                    Places::Tree(all.trees.len() as u32 - 1)
                }
                None => {
                    all.listed.extend(bin.iter().map(|i| arrival(i).position));
                    Places::Listed((all.listed.len() - bin.len()) as u32)
                }
            };
            let (number, first) = (arrival(&bin[0]).bin, all.photons as u32);
            all.bins.push(Bin { number, first, places });
            all.photons += bin.len();
        }
        all.bins.shrink_to_fit();
        all.listed.shrink_to_fit();
        all
    }

    /// Returns the bin of a number, if it has photons, and the range of these.
    fn of(&self, number: u32) -> Option<(Bin, Range<usize>)> {
        let index = self.bins.binary_search_by_key(&number, |bin| bin.number).ok()?;
        Some(self.at(index))
    }

    /// Returns all bins, with the ranges of their photons.
    fn all(&self) -> impl Iterator<Item = (Bin, Range<usize>)> {
        (0..self.bins.len()).map(|index| self.at(index))
    }

    fn at(&self, index: usize) -> (Bin, Range<usize>) {
        let end = self.bins.get(index + 1).map_or(self.photons, |next| next.first as usize);
        (self.bins[index], self.bins[index].first as usize..end)
    }
}

/// Returns what is known of a bin, in a list by rising bins.
fn seen_at(thinned: &[Seen], bin: u32) -> Option<&Seen> {
    let place = thinned.binary_search_by_key(&bin, |seen| seen.bin).ok()?;
    Some(&thinned[place])
}

/// Returns the `k` photons of a tree that are nearest to `point`, nearest first; all if it has
/// fewer.
fn nearest_in(tree: &ImmutableKdTree<f32, 3>, point: Vec3, k: NonZero<usize>) -> Vec<Neighbour> {
    let neighbour = |item: u32, distance2| Neighbour { index: item as usize, distance2 };
    let point = turned(point);
    if k.get() < tree.size() {
        let found = tree.query(&point).nearest_n::<SquaredEuclidean<f32>>(k).execute();
        return found.iter().map(|f| neighbour(f.item, f.distance)).collect();
    }
    let distance2 = |place: [f32; 3]| Vec3::from(point).distance_squared(place.into());
    sorted(tree.iter().map(|(item, place)| neighbour(item, distance2(place))).collect(), k)
}

/// Returns the `k` of these places that are nearest to `point`, nearest first; all if there are
/// fewer.
fn nearest_listed(places: &[Vec3], point: Vec3, k: NonZero<usize>) -> Vec<Neighbour> {
    let neighbour = |(index, place): (usize, &Vec3)| Neighbour {
        index,
        distance2: place.distance_squared(point),
    };
    sorted(places.iter().enumerate().map(neighbour).collect(), k)
}

/// Returns the first `k` in the order of their distances.
fn sorted(mut all: Vec<Neighbour>, k: NonZero<usize>) -> Vec<Neighbour> {
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

/// Photons lie on walls, and a wall perpendicular to an axis wastes the splits along that axis. All
/// positions are therefore turned once by this generic rotation.
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
