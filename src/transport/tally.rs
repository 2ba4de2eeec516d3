//! Tallies: what arrived where, in sums over a batch of histories.

mod sums;
mod totals;

use serde::{Deserialize, Serialize};

use crate::{
    math::spectrum::{Lanes, Spectrum},
    scene::{
        captor::{Captor, CaptorKind, Channel},
        world::Scene,
    },
    transport::{
        paths::PathScore,
        trace::{Counted, Event},
    },
};

pub use sums::Sums;
pub use totals::Totals;

/// Power accounted for, per band, in W or umol/s.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// What the photons were emitted with.
    pub emitted: Vec<f64>,
    /// What surfaces absorbed: band by band for each material in turn.
    pub absorbed: Vec<f64>,
    /// What left the scene.
    pub escaped: Vec<f64>,
    /// What of that met no surface, where light comes from infinitely far away; else empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missed: Vec<f64>,
    /// What was on paths longer than the limits.
    pub lost: Vec<f64>,
    /// What games of chance took, less what they gave, where photons are guided; 0 in the mean. Else empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub chance: Vec<f64>,
}

impl Ledger {
    fn new(bands: usize, materials: usize) -> Self {
        let zeros = || vec![0.0; bands];
        let absorbed = vec![0.0; bands * materials];
        Self {
            emitted: zeros(),
            absorbed,
            escaped: zeros(),
            missed: Vec::new(),
            lost: zeros(),
            chance: Vec::new(),
        }
    }

    fn entries(&mut self) -> [&mut Vec<f64>; 6] {
        let Self { emitted, absorbed, escaped, missed, lost, chance } = self;
        [emitted, absorbed, escaped, missed, lost, chance]
    }

    /// Adds `other`, each band times its factor.
    fn add(&mut self, other: &Self, factor: impl Fn(usize) -> f64) {
        let bands = self.emitted.len();
        let Self { emitted, absorbed, escaped, missed, lost, chance } = other;
        self.missed.resize(self.missed.len().max(missed.len()), 0.0);
        self.chance.resize(self.chance.len().max(chance.len()), 0.0);
        let other = [emitted, absorbed, escaped, missed, lost, chance];
        for (mine, theirs) in self.entries().into_iter().zip(other) {
            for (i, (a, b)) in mine.iter_mut().zip(theirs).enumerate() {
                *a += b * factor(i % bands);
            }
        }
    }
}

/// What a channel has counted.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    /// Photons: one that comes twice, or in two flights, counts twice.
    photons: u64,
    /// Histories that they are of.
    histories: u64,
    /// Number of the last of these.
    last: u64,
}

/// How much the histories of a channel differ in what they bring, over all bands.
#[derive(Clone, Copy, Debug, Default)]
struct Weighed {
    /// Number of the last one, and what it has brought.
    last: u64,
    own: f64,
    /// The sum of what those before it brought, and of its squares.
    before: [f64; 2],
}

impl Weighed {
    /// No more comes of the last history.
    fn settle(&mut self) {
        let own = std::mem::take(&mut self.own);
        self.before = [self.before[0] + own, self.before[1] + own * own];
    }
}

/// Sums over some histories, per band of the channels in which anything was counted: one takes memory for these, and 4
/// bytes for each other channel of the scene. Powers are in the units of [`crate::scene::light::Strata::weights`].
#[derive(Clone, Debug)]
pub struct Tally {
    bands: usize,
    /// For each channel one more than its place in the next four lists; 0 where nothing was counted.
    places: Vec<u32>,
    touched: Vec<u32>,
    counts: Vec<Counts>,
    /// Only where it is asked for.
    weighed: Option<Vec<Weighed>>,
    /// Per place and band.
    flux: Vec<f64>,
    /// Number of the history that is under way.
    history: u64,
    /// Straight flights between emission, interactions and escape.
    segments: u64,
    /// Paths that a length limit ended.
    cut_off: u64,
    ledger: Ledger,
    /// The same for each part of the light, where it is split.
    parts: Vec<Tally>,
}

impl Tally {
    /// An empty one for `scene`, of which the light is split into so many parts; 0 splits nothing.
    pub fn new(scene: &Scene, parts: usize) -> Self {
        let bands = scene.bands.len();
        Self {
            bands,
            places: vec![0; scene.channels()],
            touched: Vec::new(),
            counts: Vec::new(),
            weighed: None,
            flux: Vec::new(),
            history: 0,
            segments: 0,
            cut_off: 0,
            ledger: Ledger::new(bands, scene.materials.len()),
            parts: (0..parts).map(|_| Self::new(scene, 0)).collect(),
        }
    }

    /// One that also tells how many histories what it counts rests on: photons with flights beside them bring
    /// more or less.
    pub fn weighing(self) -> Self {
        Self { weighed: Some(Vec::new()), ..self }
    }

    /// Bytes that one takes for `scene` split into so many parts, about, when something was counted in at most so many
    /// channels.
    pub fn bytes(scene: &Scene, parts: usize, touched: usize) -> usize {
        let touched = touched.min(scene.channels());
        let ledger = (scene.materials.len() + 3) * scene.bands.len();
        let sums = (touched * scene.bands.len() + ledger) * size_of::<f64>();
        let places = scene.channels() * size_of::<u32>();
        let counts = touched * (size_of::<Counts>() + size_of::<u32>());
        (parts + 1) * (2 * size_of::<Self>() + sums + places + counts)
    }

    /// Scores the emission of a photon with all of its power, also in its `part`.
    #[inline]
    pub fn emitted<L: Lanes>(&mut self, part: Option<usize>, weights: &[f64], power: &Spectrum<L>) {
        self.history += 1;
        accumulate(&mut self.ledger.emitted, weights, power);
        if let Some(part) = part {
            self.parts[part].emitted(None, weights, power);
        }
    }

    /// Scores what happened to a photon of these weights, also in its `part`.
    #[inline]
    pub fn score<L: Lanes>(
        &mut self,
        scene: &Scene,
        part: Option<usize>,
        weights: &[f64],
        event: &Event<'_, L>,
    ) {
        self.score_whole(scene, weights, event);
        if let Some(part) = part {
            self.parts[part].score_part(scene, weights, event);
        }
    }

    /// Out of the way of runs that split nothing.
    #[inline(never)]
    fn score_part<L: Lanes>(&mut self, scene: &Scene, weights: &[f64], event: &Event<'_, L>) {
        self.score_whole(scene, weights, event);
    }

    #[inline]
    fn score_whole<L: Lanes>(&mut self, scene: &Scene, weights: &[f64], event: &Event<'_, L>) {
        let counted = event.counted(scene);
        if let Some(counted) = &counted {
            match &counted.captor.sensor.response {
                None => self.add(counted.channel(), weights, counted.power),
                Some(response) => {
                    let factor = response.factor(event.cosine(scene));
                    self.add_read(counted, weights, factor);
                }
            }
        }
        match *event {
            Event::Crossing { .. } => {}
            Event::FlightBeside => self.segments += 1,
            Event::Chance { before, after } => {
                self.ledger.chance.resize(self.bands, 0.0);
                let (before, after) = (before.values(), after.values());
                for (b, chance) in self.ledger.chance.iter_mut().enumerate() {
                    *chance += (f64::from(before[b]) - f64::from(after[b])) * weights[b];
                }
            }
            Event::Arrival { surface, interaction, power, scattered, .. } => {
                self.segments += 1;
                let absorbed = &mut self.ledger.absorbed[surface.material as usize * self.bands..];
                let (came, left) = (power.values(), scattered.values());
                for b in 0..self.bands {
                    absorbed[b] += (f64::from(came[b]) - f64::from(left[b])) * weights[b];
                }
                if let Some(Counted { captor, .. }) = counted {
                    let absorbed = match scene.material(surface).absorptance::<L>(interaction) {
                        Some(absorptance) => absorptance * power,
                        None => power.clone().zip(scattered, |before, after| before - after),
                    };
                    let channel = captor.first_channel + Channel::Absorbed as usize;
                    self.add(channel, weights, &absorbed);
                }
            }
            Event::Escaped { power, missed } => {
                self.segments += 1;
                accumulate(&mut self.ledger.escaped, weights, power);
                if missed && scene.has_daylight() {
                    self.ledger.missed.resize(self.bands, 0.0);
                    accumulate(&mut self.ledger.missed, weights, power);
                }
            }
            Event::Lost(power) => accumulate(&mut self.ledger.lost, weights, power),
        }
    }

    /// Scores what a path says about a captor's face.
    pub fn score_path<L: Lanes>(&mut self, captor: &Captor, face: Channel, score: &PathScore<L>) {
        let ones = std::iter::repeat(&1.0);
        self.history += 1;
        self.segments += u64::from(score.rays);
        self.cut_off += u64::from(score.cut_off);
        self.add(captor.first_channel + face as usize, ones.clone(), &score.flux);
        if captor.kind == CaptorKind::Surface {
            self.add(captor.first_channel + Channel::Absorbed as usize, ones, &score.absorbed);
        }
    }

    /// Adds what a sensor reads of what comes to it; out of the way of those that count all alike.
    #[cold]
    #[inline(never)]
    fn add_read<L: Lanes>(&mut self, counted: &Counted<'_, L>, weights: &[f64], factor: f32) {
        self.add(counted.channel(), weights, &counted.power.clone().scaled(factor));
    }

    #[inline(always)]
    fn add<'a, L: Lanes>(
        &mut self,
        channel: usize,
        weights: impl IntoIterator<Item = &'a f64> + Clone,
        power: &Spectrum<L>,
    ) {
        let place = self.place(channel);
        if self.weighed.is_some() {
            self.weigh(place, weights.clone(), power);
        }
        let counts = &mut self.counts[place];
        counts.photons += 1;
        counts.histories += u64::from(counts.last != self.history);
        counts.last = self.history;
        accumulate(&mut self.flux[place * self.bands..][..self.bands], weights, power);
    }

    /// Adds what a history brings to what it brought before, if it is not new; out of the way of those that weigh none.
    #[cold]
    #[inline(never)]
    fn weigh<'a, L: Lanes>(
        &mut self,
        place: usize,
        weights: impl IntoIterator<Item = &'a f64>,
        power: &Spectrum<L>,
    ) {
        let Some(weighed) = self.weighed.as_mut().and_then(|all| all.get_mut(place)) else {
            return;
        };
        if weighed.last != self.history {
            weighed.settle();
            weighed.last = self.history;
        }
        let powers = weights.into_iter().zip(power.values());
        weighed.own += powers.map(|(weight, power)| weight * f64::from(*power)).sum::<f64>();
    }

    /// The place of a channel in the lists; at the end, if it is a new one.
    #[inline(always)]
    fn place(&mut self, channel: usize) -> usize {
        match self.places[channel] {
            0 => self.new_place(channel),
            next => next as usize - 1,
        }
    }

    /// Out of the way of the many that come to a place that is there.
    #[cold]
    #[inline(never)]
    fn new_place(&mut self, channel: usize) -> usize {
        let place = self.touched.len();
        self.touched.push(channel as u32);
        self.counts.push(Counts::default());
        self.weighed.iter_mut().for_each(|all| all.push(Weighed::default()));
        self.flux.resize(self.flux.len() + self.bands, 0.0);
        self.places[channel] = place as u32 + 1;
        place
    }
}

#[inline]
fn accumulate<'a, L: Lanes>(
    sums: &mut [f64],
    weights: impl IntoIterator<Item = &'a f64>,
    power: &Spectrum<L>,
) {
    for ((sum, weight), power) in sums.iter_mut().zip(weights).zip(power.values()) {
        *sum += weight * f64::from(*power);
    }
}
