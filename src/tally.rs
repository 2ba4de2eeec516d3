//! Tallies: what arrived where, in sums over a block of histories.

use crate::{
    captor::{CHANNELS, Captor, CaptorKind, Channel},
    estimate::paths::PathScore,
    scene::Scene,
    spectrum::Spectrum,
    stats::Running,
    trace::{Counted, Event},
};

/// Power accounted for, per band, in W or umol/s.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ledger {
    /// What the photons were emitted with.
    pub emitted: Vec<f64>,
    /// What surfaces absorbed: band by band for each material in turn.
    pub absorbed: Vec<f64>,
    /// What left the scene.
    pub escaped: Vec<f64>,
    /// What was on paths longer than the limits.
    pub lost: Vec<f64>,
}

impl Ledger {
    fn new(bands: usize, materials: usize) -> Self {
        let zeros = || vec![0.0; bands];
        let absorbed = vec![0.0; bands * materials];
        Self { emitted: zeros(), absorbed, escaped: zeros(), lost: zeros() }
    }

    fn entries(&mut self) -> [&mut Vec<f64>; 4] {
        [&mut self.emitted, &mut self.absorbed, &mut self.escaped, &mut self.lost]
    }

    /// Adds `other` x `scale` and empties it.
    fn drain(&mut self, other: &mut Self, scale: f64) {
        for (mine, theirs) in self.entries().into_iter().zip(other.entries()) {
            for (a, b) in mine.iter_mut().zip(theirs) {
                *a += std::mem::take(b) * scale;
            }
        }
    }
}

/// Sums over some histories, per channel and band. Powers are in the units of [`crate::light::Strata::weights`].
#[derive(Clone, Debug)]
pub struct Tally {
    bands: usize,
    flux: Vec<f64>,
    photons: Vec<u64>,
    /// Channels that are not empty.
    touched: Vec<u32>,
    /// Straight flights between emission, interactions and escape.
    segments: u64,
    /// Paths that a length limit ended.
    cut_off: u64,
    ledger: Ledger,
}

impl Tally {
    /// An empty one for `scene`.
    pub fn new(scene: &Scene) -> Self {
        let bands = scene.bands.len();
        Self {
            bands,
            flux: vec![0.0; scene.channels() * bands],
            photons: vec![0; scene.channels()],
            touched: Vec::new(),
            segments: 0,
            cut_off: 0,
            ledger: Ledger::new(bands, scene.materials.len()),
        }
    }

    /// Bytes that one takes for `scene`.
    pub fn bytes(scene: &Scene) -> usize {
        let ledger = (scene.materials.len() + 3) * scene.bands.len();
        (scene.channels() * (scene.bands.len() + 1) + ledger) * size_of::<f64>()
    }

    /// Scores the emission of a photon with all of its power.
    #[inline]
    pub fn emitted(&mut self, weights: &[f64]) {
        for (sum, weight) in self.ledger.emitted.iter_mut().zip(weights) {
            *sum += weight;
        }
    }

    /// Scores what happened to a photon of these weights.
    #[inline]
    pub fn score<const N: usize>(&mut self, scene: &Scene, weights: &[f64], event: &Event<'_, N>) {
        let counted = event.counted(scene);
        if let Some(counted) = &counted {
            self.add(counted.channel(), weights, counted.power);
        }
        match event {
            Event::Crossing { .. } => {}
            Event::Arrival { surface, encounter, power, scattered, .. } => {
                self.segments += 1;
                let absorbed = &mut self.ledger.absorbed[surface.material as usize * self.bands..];
                for b in 0..self.bands {
                    absorbed[b] += (f64::from(power.0[b]) - f64::from(scattered.0[b])) * weights[b];
                }
                if let Some(Counted { captor, .. }) = counted {
                    let absorbed = match scene.material(surface).absorptance::<N>(encounter) {
                        Some(absorptance) => *power * absorptance,
                        None => power.zip(*scattered, |before, after| before - after),
                    };
                    let channel = captor.first_channel + Channel::Absorbed as usize;
                    self.add(channel, weights, &absorbed);
                }
            }
            Event::Escaped(power) => {
                self.segments += 1;
                accumulate(&mut self.ledger.escaped, weights, power);
            }
            Event::Lost(power) => accumulate(&mut self.ledger.lost, weights, power),
        }
    }

    /// Scores what a path says about a captor's face.
    pub fn score_path<const N: usize>(
        &mut self,
        captor: &Captor,
        face: Channel,
        score: &PathScore<N>,
    ) {
        let ones = std::iter::repeat(&1.0);
        self.segments += u64::from(score.rays);
        self.cut_off += u64::from(score.cut_off);
        self.add(captor.first_channel + face as usize, ones.clone(), &score.flux);
        if captor.kind == CaptorKind::Surface {
            self.add(captor.first_channel + Channel::Absorbed as usize, ones, &score.absorbed);
        }
    }

    #[inline]
    fn add<'a, const N: usize>(
        &mut self,
        channel: usize,
        weights: impl IntoIterator<Item = &'a f64>,
        power: &Spectrum<N>,
    ) {
        if self.photons[channel] == 0 {
            self.touched.push(channel as u32);
        }
        self.photons[channel] += 1;
        accumulate(&mut self.flux[channel * self.bands..][..self.bands], weights, power);
    }

    /// Adds `other` and empties it.
    pub fn drain(&mut self, other: &mut Self) {
        for channel in std::mem::take(&mut other.touched) {
            let c = channel as usize;
            if self.photons[c] == 0 {
                self.touched.push(channel);
            }
            self.photons[c] += std::mem::take(&mut other.photons[c]);
            for b in c * self.bands..(c + 1) * self.bands {
                self.flux[b] += std::mem::take(&mut other.flux[b]);
            }
        }
        self.segments += std::mem::take(&mut other.segments);
        self.cut_off += std::mem::take(&mut other.cut_off);
        self.ledger.drain(&mut other.ledger, 1.0);
    }
}

#[inline]
fn accumulate<'a, const N: usize>(
    sums: &mut [f64],
    weights: impl IntoIterator<Item = &'a f64>,
    power: &Spectrum<N>,
) {
    for ((sum, weight), power) in sums.iter_mut().zip(weights).zip(&power.0) {
        *sum += weight * f64::from(*power);
    }
}

/// What all blocks found: running sums per channel of captors, then of groups, for each band,
/// then each sum over bands.
#[derive(Clone, Debug)]
pub struct Totals {
    /// Blocks so far.
    pub blocks: u64,
    /// Histories so far.
    pub histories: u64,
    /// Straight flights so far.
    pub segments: u64,
    /// Paths so far that a length limit ended.
    pub cut_off: u64,
    columns: usize,
    running: Vec<Running>,
    photons: Vec<u64>,
    ledger: Ledger,
    captor_of_channel: Vec<u32>,
    group_values: Vec<f64>,
}

impl Totals {
    /// Empty ones for `scene`.
    pub fn new(scene: &Scene) -> Self {
        let columns = scene.bands.len() + scene.sums.len();
        let group_channels = scene.groups.len() * CHANNELS.len();
        let channels = scene.channels() + group_channels;
        let captor_of_channel = scene
            .captors
            .iter()
            .enumerate()
            .flat_map(|(i, captor)| std::iter::repeat_n(i as u32, captor.kind.channels()))
            .collect();
        Self {
            blocks: 0,
            histories: 0,
            segments: 0,
            cut_off: 0,
            columns,
            running: vec![Running::default(); channels * columns],
            photons: vec![0; channels],
            ledger: Ledger::new(scene.bands.len(), scene.materials.len()),
            captor_of_channel,
            group_values: vec![0.0; group_channels * columns],
        }
    }

    /// Bytes that these and the results made of them take for `scene`, about.
    pub fn bytes(scene: &Scene) -> usize {
        let columns = scene.bands.len() + scene.sums.len();
        let channels = scene.channels() + scene.groups.len() * CHANNELS.len();
        let per_column = size_of::<Running>() + 64;
        channels * (columns * per_column + 64)
            + (scene.materials.len() + 4) * columns * 2 * size_of::<f64>()
    }

    /// Adds a block of `histories` and empties it. Each block counts alike: it is a whole small
    /// run, in which every light has its share.
    pub fn add_block(&mut self, scene: &Scene, block: &mut Tally, histories: u64) {
        let scale = 1.0 / histories as f64;
        let bands = scene.bands.len();
        let mut touched = std::mem::take(&mut block.touched);
        touched.sort_unstable();
        let mut row = vec![0.0; self.columns];
        for &channel in &touched {
            let channel = channel as usize;
            for (b, value) in row[..bands].iter_mut().enumerate() {
                *value = std::mem::take(&mut block.flux[channel * bands + b]) * scale;
            }
            for (s, sum) in scene.sums.iter().enumerate() {
                row[bands + s] = sum.bands.iter().map(|&b| row[b]).sum();
            }
            let photons = std::mem::take(&mut block.photons[channel]);
            self.photons[channel] += photons;
            for (running, value) in self.running[channel * self.columns..].iter_mut().zip(&row) {
                running.add(*value);
            }
            let captor = &scene.captors[self.captor_of_channel[channel] as usize];
            for &group in &captor.groups {
                let group_channel = group * CHANNELS.len() + channel - captor.first_channel;
                self.photons[scene.channels() + group_channel] += photons;
                let values = &mut self.group_values[group_channel * self.columns..];
                values.iter_mut().zip(&row).for_each(|(sum, value)| *sum += value);
            }
        }
        let group_running = &mut self.running[scene.channels() * self.columns..];
        for (running, value) in group_running.iter_mut().zip(&mut self.group_values) {
            running.add(std::mem::take(value));
        }
        self.ledger.drain(&mut block.ledger, scale);
        self.blocks += 1;
        self.histories += histories;
        self.segments += std::mem::take(&mut block.segments);
        self.cut_off += std::mem::take(&mut block.cut_off);
    }

    /// Photons counted in a channel.
    pub fn photons(&self, channel: usize) -> u64 {
        self.photons[channel]
    }

    /// Mean and standard error per band, then per sum, of a channel.
    pub fn running(&self, channel: usize) -> &[Running] {
        &self.running[channel * self.columns..][..self.columns]
    }

    /// The ledger, in W or umol/s.
    pub fn ledger(&self) -> Ledger {
        let mut mean = Ledger::new(self.ledger.emitted.len(), 0);
        mean.absorbed = vec![0.0; self.ledger.absorbed.len()];
        mean.drain(&mut self.ledger.clone(), 1.0 / self.blocks as f64);
        mean
    }
}
