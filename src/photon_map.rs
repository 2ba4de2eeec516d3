//! The photon map: stored arrivals, and the k nearest of them (kiddo's kd-tree).

use std::{collections::BTreeMap, num::NonZero, ops::Range};

use glam::{Mat3, Vec3};
use kiddo::{ImmutableKdTree, SquaredEuclidean};

mod direction;
#[cfg(test)]
mod tests;

pub use direction::PackedDirection;

/// A photon that arrived on, or crossed, a surface.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Where, relative to the centre of the scene, m.
    pub position: Vec3,
    /// What it is filed under: a channel of a captor, for a run.
    pub shelf: u32,
    /// The rest of it.
    pub photon: StoredPhoton,
}

/// What a map keeps of an arrival beside its power: the place is kept by the tree of its shelf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StoredPhoton {
    /// The way it travelled.
    pub direction: PackedDirection,
    /// Index of the triangle, among the surfaces or the virtual captors.
    pub triangle: u32,
    /// Index of the light that it came from.
    pub light: u32,
    /// Index of its history in the piece; in a map, among the histories that it holds.
    pub history: u32,
}

/// Order of a piece of histories in a run: round, piece within the block, block. Every block
/// has its first piece before any has its second.
pub type PieceKey = (u64, u64, u64);

/// Arrivals of one piece, in order, and their powers per band.
#[derive(Clone, Debug, Default)]
pub struct Piece {
    arrivals: Vec<Arrival>,
    power: Vec<f32>,
    ways: Vec<Way>,
}

/// How a photon came from its light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Way {
    /// How often it was scattered in a random direction.
    pub bounces: u16,
    /// Whether it was mirrored or refracted, too.
    pub mirrored: bool,
}

impl Piece {
    /// Stores an arrival, as long as there are at most `limit`.
    #[inline]
    pub fn push(&mut self, limit: usize, arrival: Arrival, power: impl Iterator<Item = f32>) {
        if self.arrivals.len() <= limit {
            self.arrivals.push(arrival);
            self.power.extend(power);
        }
    }

    /// Stores how the arrival that was just stored has come.
    #[inline]
    pub fn came(&mut self, way: Way) {
        self.ways.resize(self.arrivals.len(), way);
    }
}

/// Collects arrivals piece by piece, in any order, and keeps those of the first histories that
/// fit, whatever that order was.
#[derive(Debug)]
pub struct MapBuilder {
    limit: usize,
    bands: usize,
    pieces: BTreeMap<PieceKey, Piece>,
    stored: usize,
    /// The first piece that no longer fits.
    end: Option<PieceKey>,
}

impl MapBuilder {
    /// For at most `limit` arrivals of `bands` bands.
    pub fn new(limit: usize, bands: usize) -> Self {
        Self { limit, bands, pieces: BTreeMap::new(), stored: 0, end: None }
    }

    /// The most arrivals that are kept.
    pub fn limit(&self) -> usize {
        self.limit
    }

    /// Whether arrivals of this piece may still be kept.
    pub fn wants(&self, key: PieceKey) -> bool {
        self.end.is_none_or(|end| key < end)
    }

    /// Adds the arrivals of a piece.
    pub fn add(&mut self, key: PieceKey, piece: Piece) {
        if piece.arrivals.is_empty() || !self.wants(key) {
            return;
        }
        self.stored += piece.arrivals.len();
        self.pieces.insert(key, piece);
        while let Some(last) = self.pieces.last_entry() {
            let rest = self.stored - last.get().arrivals.len();
            if rest <= self.limit {
                break;
            }
            self.stored = rest;
            self.end = Some(last.remove_entry().0);
        }
    }

    /// The map of the run's first histories. `histories` tells how many come before a piece;
    /// `all` is how many there are. Powers are multiplied by `scale` / histories in the map.
    pub fn build(self, all: u64, histories: impl Fn(PieceKey) -> u64) -> PhotonMap {
        let mut arrivals = Vec::with_capacity(self.stored.min(self.limit));
        let mut power = Vec::with_capacity(arrivals.capacity() * self.bands);
        let mut ways = Vec::new();
        let mut count = self.end.map_or(all, &histories);
        let mut first = 0;
        for (key, mut piece) in self.pieces {
            let room = self.limit - arrivals.len();
            if piece.arrivals.len() > room {
                // cut before the first history that does not fit whole
                let history = piece.arrivals[room].photon.history;
                let whole = piece.arrivals.partition_point(|a| a.photon.history < history);
                piece.arrivals.truncate(whole);
                piece.power.truncate(whole * self.bands);
                piece.ways.truncate(whole);
                count = histories(key) + u64::from(history);
            }
            let same = |a: &Arrival, b: &Arrival| a.photon.history == b.photon.history;
            for history in piece.arrivals.chunk_by_mut(same) {
                history.iter_mut().for_each(|arrival| arrival.photon.history = first);
                first += 1;
            }
            arrivals.append(&mut piece.arrivals);
            power.append(&mut piece.power);
            ways.append(&mut piece.ways);
        }
        PhotonMap::file(arrivals, power, ways, self.bands, count)
    }
}

/// Stored photons, shelf by shelf, with a tree over each large shelf.
pub struct PhotonMap {
    /// All photons; those of one shelf stand side by side.
    pub photons: Vec<StoredPhoton>,
    power: Vec<f32>,
    ways: Vec<Way>,
    bands: usize,
    /// The histories that these are all arrivals of.
    pub histories: u64,
    shelves: BTreeMap<u32, Shelf>,
}

struct Shelf {
    range: Range<usize>,
    places: Places,
}

/// Where the photons of a shelf are.
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

/// Shelves of at most this many arrivals are searched one by one.
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
        order.sort_by_key(|&i| arrivals[i as usize].shelf);
        let arrival = |&i: &u32| &arrivals[i as usize];
        let mut shelves = BTreeMap::new();
        let mut first = 0;
        for shelf in order.chunk_by(|a, b| arrival(a).shelf == arrival(b).shelf) {
            let range = first..first + shelf.len();
            first = range.end;
            let places = Places::of(shelf.iter().map(|i| arrival(i).position));
            shelves.insert(arrival(&shelf[0]).shelf, Shelf { range, places });
        }
        let photons = order.iter().map(|i| arrival(i).photon).collect();
        drop(arrivals);
        let mut sorted = Vec::with_capacity(power.len());
        order.iter().for_each(|&i| sorted.extend(&power[i as usize * bands..][..bands]));
        let ways =
            if ways.is_empty() { ways } else { order.iter().map(|&i| ways[i as usize]).collect() };
        Self { photons, power: sorted, ways, bands, histories, shelves }
    }

    /// Power of a photon per band, W or umol/s x [`histories`](Self::histories).
    pub fn power(&self, index: usize) -> &[f32] {
        &self.power[index * self.bands..][..self.bands]
    }

    /// How each photon came, in the order of `photons`; empty in a map that does not keep it.
    pub fn ways(&self) -> &[Way] {
        &self.ways
    }

    /// Where each photon is, in the order of `photons`, m relative to the centre of the scene; those in
    /// trees to rounding.
    pub fn positions(&self) -> Vec<Vec3> {
        let mut positions = vec![Vec3::ZERO; self.photons.len()];
        for Shelf { range, places } in self.shelves.values() {
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

    /// How many photons a shelf has.
    pub fn count(&self, shelf: u32) -> usize {
        self.shelves.get(&shelf).map_or(0, |shelf| shelf.range.len())
    }

    /// The `k` (at least 1) photons of a shelf nearest to `point`, nearest first; fewer where the
    /// shelf has fewer.
    pub fn nearest(&self, shelf: u32, point: Vec3, k: usize) -> Vec<Neighbour> {
        let (Some(Shelf { range, places }), Some(k)) = (self.shelves.get(&shelf), NonZero::new(k))
        else {
            return Vec::new();
        };
        let mut found = places.nearest(point, k);
        found.iter_mut().for_each(|neighbour| neighbour.index += range.start);
        found
    }
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
