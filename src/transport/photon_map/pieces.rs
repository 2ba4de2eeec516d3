//! Arrivals collected piece by piece.

use std::collections::BTreeMap;

use glam::Vec3;

use super::{Arrival, PackedDirection, PhotonMap, StoredPhoton, Way};

/// Order of a piece of histories in a run: round, piece within the block, block. Every block
/// has its first piece before any has its second.
pub type PieceKey = (u64, u64, u64);

/// Whole numbers that an arrival takes, without its powers.
const WORDS: usize = 8;

/// Arrivals of one piece, in order, and their powers per band.
#[derive(Clone, Debug, Default)]
pub struct Piece {
    arrivals: Vec<Arrival>,
    power: Vec<f32>,
    ways: Vec<Way>,
}

impl Piece {
    /// All of it in whole numbers, of which floating-point numbers are the bits.
    pub fn words(&self) -> Vec<u32> {
        let bands = self.power.len() / self.arrivals.len().max(1);
        let mut words = Vec::with_capacity(self.arrivals.len() * (WORDS + bands));
        for (i, Arrival { position, shelf, photon }) in self.arrivals.iter().enumerate() {
            words.extend(position.to_array().map(f32::to_bits));
            let StoredPhoton { direction, triangle, light, history } = photon;
            words.extend([*shelf, direction.bits(), *triangle, *light, *history]);
            words.extend(self.power[i * bands..][..bands].iter().map(|power| power.to_bits()));
        }
        words
    }

    /// From [`words`](Self::words) of photons with `bands` powers; none where they are not whole.
    pub fn from_words(words: &[u32], bands: usize) -> Option<Self> {
        if !words.len().is_multiple_of(WORDS + bands) {
            return None;
        }
        let mut piece = Self::default();
        for arrival in words.chunks(WORDS + bands) {
            let position = Vec3::from([0, 1, 2].map(|i| f32::from_bits(arrival[i])));
            let [shelf, direction, triangle, light, history] = [3, 4, 5, 6, 7].map(|i| arrival[i]);
            let direction = PackedDirection::from_bits(direction);
            let photon = StoredPhoton { direction, triangle, light, history };
            piece.arrivals.push(Arrival { position, shelf, photon });
            piece.power.extend(arrival[WORDS..].iter().map(|bits| f32::from_bits(*bits)));
        }
        let finite = piece.arrivals.iter().all(|arrival| arrival.position.is_finite());
        (finite && piece.power.iter().all(|power| power.is_finite())).then_some(piece)
    }

    /// Its arrivals, in order.
    pub fn arrivals(&self) -> &[Arrival] {
        &self.arrivals
    }

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

    /// What is kept so far, in order, and the first piece that no longer fits.
    pub fn into_pieces(self) -> (BTreeMap<PieceKey, Piece>, Option<PieceKey>) {
        (self.pieces, self.end)
    }

    /// Takes in that `end` no longer fits, from someone who has seen only some of the pieces.
    pub fn end_at(&mut self, end: PieceKey) {
        self.end = Some(self.end.map_or(end, |own| own.min(end)));
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
