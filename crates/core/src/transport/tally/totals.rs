//! The sums over all batches.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::{Ledger, Sums, sums::MOST};
use crate::{
    math::{
        effort,
        stats::{Estimate, Running, RunningFour, RunningOver, RunningPair, is_possible},
    },
    scene::world::{BandRatio, Scene},
};

/// The sums over all batches: running sums for each channel of the captors, then of the groups, then
/// of the stand; in each channel for each band, then for each sum over bands.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Totals {
    /// Number of batches so far.
    pub batches: u64,
    /// Number of histories so far.
    pub histories: u64,
    /// Number of straight flights so far.
    pub segments: u64,
    /// The work beside these flights, as [`effort`] counts it; 0 but in trials.
    #[serde(skip)]
    pub effort: u64,
    /// Number of paths so far that a length limit ended.
    pub cut_off: u64,
    columns: usize,
    running: Vec<Running>,
    /// For each channel and each ratio of sums over bands: the two sums.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pairs: Vec<RunningPair>,
    photons: Vec<u64>,
    /// Number of histories that arrived, per channel of captors.
    arrived: Vec<u64>,
    /// Per channel of captors: the sum of the powers that the histories brought, and the sum of the
    /// squares of these powers. Empty if they are not recorded.
    #[serde(default)]
    weighed: Vec<[f64; 2]>,
    ledger: Ledger,
    /// Whether photons count beside paths.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    beside_paths: bool,
    /// Then: for each channel of captors and groups whether photons alone count there; empty if that is so
    /// nowhere.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    by_photons: Vec<bool>,
    /// Per band, then per sum: power that each material absorbed, that left the scene, that was
    /// lost, and that games of chance took. Empty unless the scene says what its lights cost.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    spent: Vec<Running>,
    /// Power that games of chance took, per band, then per sum; empty if there were no games.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    chance: Vec<Running>,
    captor_of_channel: Vec<u32>,
    group_values: Vec<f64>,
    /// Totals of each part of the light, if the light is split, or of each variant of the scene.
    parts: Vec<Totals>,
    /// The channels that have moments: those of captors and groups, or if these are too many, of groups
    /// alone.
    #[serde(default, skip_serializing_if = "Range::is_empty")]
    moment_channels: Range<usize>,
    /// For each such channel, parameter and column the [moment](crate::transport::met). Empty if no
    /// moments are asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    moments: Vec<RunningOver>,
    /// For each such channel, parameter and ratio the moment and the value of its numerator and of its
    /// denominator.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    ratio_moments: Vec<RunningFour>,
}

/// The largest number of moments of captors that are kept: 40 MB, and some hundreds of MB of results.
/// Beyond it only groups have any. As many are kept of captors by light.
const MOST_MOMENTS: usize = 1_000_000;

/// Returns the channels of captors and groups that have moments of so many parameters.
fn channels_with_moments(scene: &Scene, parameters: usize) -> Range<usize> {
    let columns = scene.bands().len() + scene.sums().len() + scene.ratios().len();
    let each = columns.saturating_mul(parameters);
    let groups = scene.groups().len() * scene.group_channels();
    let kept = scene.channels().saturating_mul(each) <= MOST_MOMENTS;
    (if kept { 0 } else { scene.channels() })..scene.channels() + groups
}

impl Totals {
    /// Returns empty totals for `scene`, whose light is split into `parts` parts; 0 means not
    /// split.
    pub fn new(scene: &Scene, parts: usize) -> Self {
        let columns = scene.bands().len() + scene.sums().len();
        let group_channels = scene.groups().len() * scene.group_channels();
        let channels = scene.channels() + group_channels + scene.stand().channels();
        let captor_of_channel = scene
            .captors()
            .iter()
            .enumerate()
            .flat_map(|(i, captor)| std::iter::repeat_n(i as u32, captor.channels()))
            .collect();
        Self {
            batches: 0,
            histories: 0,
            segments: 0,
            effort: 0,
            cut_off: 0,
            columns,
            running: vec![Running::default(); channels * columns],
            pairs: vec![RunningPair::default(); channels * scene.ratios().len()],
            photons: vec![0; channels],
            arrived: vec![0; scene.channels()],
            weighed: Vec::new(),
            ledger: Ledger::new(scene.bands().len(), scene.materials().len()),
            beside_paths: false,
            by_photons: Vec::new(),
            spent: match scene.watts().is_empty() {
                true => Vec::new(),
                false => vec![Running::default(); (scene.materials().len() + 3) * columns],
            },
            chance: Vec::new(),
            captor_of_channel,
            group_values: vec![0.0; group_channels * columns],
            parts: (0..parts).map(|_| Self::new(scene, 0)).collect(),
            moment_channels: 0..0,
            moments: Vec::new(),
            ratio_moments: Vec::new(),
        }
    }

    /// Returns the same totals, with room for the moments of the scene's parameters.
    pub fn with_moments(mut self, scene: &Scene) -> Self {
        let by_light = scene.parameters().moments_by_light().count();
        let of_parts = channels_with_moments(scene, by_light * self.parts.len());
        let parts = std::mem::take(&mut self.parts).into_iter();
        let parts = parts.map(|part| part.with_room(scene, of_parts.clone(), by_light)).collect();
        let all = scene.parameters().moments().count();
        Self { parts, ..self.with_room(scene, channels_with_moments(scene, all), all) }
    }

    /// Returns the same totals, with room for the moments of so many parameters in these channels.
    fn with_room(self, scene: &Scene, moment_channels: Range<usize>, parameters: usize) -> Self {
        let places = moment_channels.len() * parameters;
        let moments = vec![RunningOver::default(); places * self.columns];
        let ratio_moments = vec![RunningFour::default(); places * scene.ratios().len()];
        Self { moment_channels, moments, ratio_moments, ..self }
    }

    /// Adds the moments that a batch has found, in captors and groups. What the batch has brought to
    /// groups is in `group_values`.
    fn add_moments(&mut self, scene: &Scene, batch: &Sums, scale: f64) {
        let Some(found) = &batch.moments else { return };
        let bands = scene.bands().len();
        let width = self.parameters() * bands;
        let mut of_groups = vec![0.0; self.group_values.len() / self.columns * width];
        let mut values = vec![0.0; self.columns];
        for (channel, moments) in found.rows() {
            // what comes after the captors is of the stand
            let Some(&captor) = self.captor_of_channel.get(channel) else { continue };
            let captor = &scene.captors()[captor as usize];
            let moments: Vec<f64> = moments.iter().map(|moment| moment * scale).collect();
            for group in &captor.groups {
                let of = group * scene.group_channels() + channel - captor.first_channel;
                let sums = of_groups[of * width..][..width].iter_mut();
                sums.zip(&moments).for_each(|(sum, moment)| *sum += moment);
            }
            if let Ok(i) = batch.channels.binary_search(&(channel as u32)) {
                let flux = &batch.flux[i * bands..][..bands];
                fill(scene, &mut values, flux.iter().map(|flux| flux * scale));
                self.add_moments_of(scene, channel, &moments, &values);
            }
        }
        for (group, moments) in of_groups.chunks_exact(width).enumerate() {
            values.copy_from_slice(&self.group_values[group * self.columns..][..self.columns]);
            self.add_moments_of(scene, scene.channels() + group, moments, &values);
        }
    }

    /// Adds the moments of all parameters in a channel, per band, and the values there, per column.
    /// Most moments are 0, because light meets few of the parameters on its way.
    fn add_moments_of(&mut self, scene: &Scene, channel: usize, moments: &[f64], values: &[f64]) {
        let Some(first) = self.place_of_moments(0, channel) else { return };
        let ratios = scene.ratios();
        let mut row = vec![0.0; self.columns];
        for (i, moments) in moments.chunks_exact(scene.bands().len()).enumerate() {
            if ratios.is_empty() && moments.iter().all(|moment| *moment == 0.0) {
                continue;
            }
            fill(scene, &mut row, moments.iter().copied());
            let own = self.moments[(first + i) * self.columns..].iter_mut();
            own.zip(row.iter().zip(values)).for_each(|(own, (moment, value))| {
                own.add(*moment, *value);
            });
            let fours = self.ratio_moments[(first + i) * ratios.len()..].iter_mut();
            for (four, BandRatio { numerator, denominator, .. }) in fours.zip(ratios) {
                let sums = [numerator, denominator].map(|sum| [sum.of(&row), sum.of(values)]);
                four.add([sums[0][0], sums[0][1], sums[1][0], sums[1][1]]);
            }
        }
    }

    /// Returns the number of parameters whose moments are kept.
    fn parameters(&self) -> usize {
        let each = self.moment_channels.len() * self.columns;
        self.moments.len().checked_div(each).unwrap_or(0)
    }

    /// Returns the place of a parameter in a channel among those of all channels; `None` where its
    /// moments are not kept.
    fn place_of_moments(&self, parameter: usize, channel: usize) -> Option<usize> {
        let (kept, parameters) = (&self.moment_channels, self.parameters());
        let is_kept = kept.contains(&channel) && parameter < parameters;
        is_kept.then(|| (channel - kept.start) * parameters + parameter)
    }

    /// Returns whether moments are kept in a channel of a captor or group.
    pub fn keeps_moments_of(&self, channel: usize) -> bool {
        self.moment_channels.contains(&channel)
    }

    /// Returns for each band and sum the mean moment of a parameter in a channel of a captor or group,
    /// and the mean value there, and from two batches on the variance of the first, their covariance
    /// and the variance of the second. `None` where no moments are kept.
    pub fn moments(
        &self,
        parameter: usize,
        channel: usize,
    ) -> Option<impl Iterator<Item = ([f64; 2], Option<[f64; 3]>)>> {
        let at = self.place_of_moments(parameter, channel)?;
        let own = self.moments[at * self.columns..].iter().zip(self.running(channel));
        Some(own.map(|(own, value)| own.estimate(value, self.batches)))
    }

    /// Returns for each ratio how the moments and the values of its two sums were found in a
    /// channel of a captor or group, and over how many batches. `None` where no moments are kept.
    pub fn ratio_moments(
        &self,
        scene: &Scene,
        parameter: usize,
        channel: usize,
    ) -> Option<(&[RunningFour], u64)> {
        let at = self.place_of_moments(parameter, channel)?;
        let ratios = scene.ratios().len();
        Some((&self.ratio_moments[at * ratios..][..ratios], self.batches))
    }

    /// Returns the same totals, for paths beside which photons count: alone in the channels
    /// of captors `by_photons`, and in those of groups whose captors all have it so.
    pub fn beside_paths(self, scene: &Scene, by_photons: &[bool]) -> Self {
        let mut all = by_photons.to_vec();
        if !all.is_empty() {
            let width = scene.group_channels();
            all.resize(scene.channels() + scene.groups().len() * width, true);
            for captor in scene.captors() {
                for (i, &group) in (0..captor.channels())
                    .flat_map(|i| captor.groups.iter().map(move |group| (i, group)))
                {
                    all[scene.channels() + group * width + i] &=
                        by_photons[captor.first_channel + i];
                }
            }
        }
        let parts = self.parts.into_iter().map(|part| part.beside_paths(scene, by_photons));
        Self { beside_paths: true, by_photons: all, parts: parts.collect(), ..self }
    }

    /// Returns about how many bytes totals take for `scene`, split into so many parts.
    pub fn bytes(scene: &Scene, parts: usize) -> usize {
        let columns = scene.bands().len() + scene.sums().len();
        let groups = scene.groups().len() * scene.group_channels();
        let pairs = scene.ratios().len() * size_of::<RunningPair>();
        let of_channel = columns * size_of::<Running>() + pairs + size_of::<[u64; 2]>();
        let of_group = columns * size_of::<f64>();
        let ledger = (scene.materials().len() + 3) * scene.bands().len() * size_of::<f64>();
        let channels = scene.channels() + groups + scene.stand().channels();
        let of_ratios = scene.ratios().len() * size_of::<RunningFour>();
        let of_channel_moments = columns * size_of::<RunningOver>() + of_ratios;
        // counted for so many parameters of each of so many lights
        let moments = |parameters: usize, lights: usize| {
            let all = parameters * lights;
            channels_with_moments(scene, all).len() * of_channel_moments * all
        };
        let parameters = scene.parameters();
        let sums = channels * of_channel + groups * of_group + ledger;
        (parts + 1) * (size_of::<Self>() + sums)
            + moments(parameters.moments().count(), 1)
            + moments(parameters.moments_by_light().count(), parts)
    }

    /// Adds a batch of `histories`. All batches have equal weight: each is a whole small run, in
    /// which every light has its share.
    pub fn add_batch(&mut self, scene: &Scene, batch: &Sums, histories: u64) {
        let scale = 1.0 / histories as f64;
        let bands = scene.bands().len();
        let mut row = vec![0.0; self.columns];
        for (i, &channel) in batch.channels.iter().enumerate() {
            let channel = channel as usize;
            let flux = &batch.flux[i * bands..][..bands];
            fill(scene, &mut row, flux.iter().map(|flux| flux * scale));
            let photons = batch.photons[i];
            if channel >= scene.channels() {
                // those of the stand come after the groups
                let channel = channel + scene.groups().len() * scene.group_channels();
                self.photons[channel] += photons;
                let running = &mut self.running[channel * self.columns..];
                running.iter_mut().zip(&row).for_each(|(running, value)| running.add(*value));
                continue;
            }
            add_ratios(scene, &mut self.pairs, channel, &row);
            self.photons[channel] += photons;
            self.arrived[channel] += batch.histories[i];
            if let Some(theirs) = batch.weighed.get(i) {
                self.weighed.resize(self.arrived.len(), [0.0; 2]);
                let mine = &mut self.weighed[channel];
                *mine = [mine[0] + theirs[0], mine[1] + theirs[1]];
            }
            for (running, value) in self.running[channel * self.columns..].iter_mut().zip(&row) {
                running.add(*value);
            }
            let captor = &scene.captors()[self.captor_of_channel[channel] as usize];
            for &group in &captor.groups {
                let group_channel = group * scene.group_channels() + channel - captor.first_channel;
                self.photons[scene.channels() + group_channel] += photons;
                let values = &mut self.group_values[group_channel * self.columns..];
                values.iter_mut().zip(&row).for_each(|(sum, value)| *sum += value);
            }
        }
        for (group, values) in self.group_values.chunks(self.columns).enumerate() {
            add_ratios(scene, &mut self.pairs, scene.channels() + group, values);
        }
        if !self.moments.is_empty() {
            self.add_moments(scene, batch, scale);
        }
        let group_running = &mut self.running[scene.channels() * self.columns..];
        for (running, value) in group_running.iter_mut().zip(&mut self.group_values) {
            running.add(std::mem::take(value));
        }
        self.ledger.add(&batch.ledger, |_| scale);
        if !self.spent.is_empty() {
            let Ledger { absorbed, escaped, lost, chance, .. } = &batch.ledger;
            let rows = absorbed.chunks(bands).chain([&escaped[..], &lost[..], &chance[..]]);
            for (spent, row) in self.spent.chunks_mut(self.columns).zip(rows) {
                let row: Vec<f64> = row.iter().map(|value| value * scale).collect();
                if row.len() == bands {
                    let columns = scene.with_sums(&row);
                    spent.iter_mut().zip(columns).for_each(|(running, value)| running.add(value));
                }
            }
        }
        if !batch.ledger.chance.is_empty() {
            self.chance.resize(self.columns, Running::default());
            let taken: Vec<f64> = batch.ledger.chance.iter().map(|taken| taken * scale).collect();
            let columns = scene.with_sums(&taken);
            self.chance.iter_mut().zip(columns).for_each(|(running, taken)| running.add(taken));
        }
        self.batches += 1;
        self.histories += histories;
        self.segments += batch.segments;
        self.effort += batch.effort;
        self.cut_off += batch.cut_off;
        for (part, sums) in self.parts.iter_mut().zip(&batch.parts) {
            part.add_batch(scene, sums, histories);
        }
    }

    /// Returns the work of a trial, in the units of [`effort`].
    pub fn work(&self) -> u64 {
        self.effort + effort::SEGMENT * self.segments
    }

    /// Returns whether these may be totals of the same scene, split alike, as `other`.
    pub fn fits(&self, other: &Self) -> bool {
        let Ledger { emitted, absorbed, escaped, missed, lost, chance } = &self.ledger;
        let theirs = &other.ledger;
        let powers = [emitted, absorbed, escaped, missed, lost, chance];
        let mut counts = self.photons.iter().chain(&self.arrived);
        counts.all(|count| *count <= MOST)
            && self.segments.max(self.cut_off) <= MOST
            && self.columns == other.columns
            && self.running.len() == other.running.len()
            && self.pairs.len() == other.pairs.len()
            && self.pairs.iter().all(RunningPair::is_possible)
            && self.photons.len() == other.photons.len()
            && self.arrived.len() == other.arrived.len()
            && [0, self.arrived.len()].contains(&self.weighed.len())
            && self.weighed.iter().flatten().all(|sum| is_possible(*sum))
            && self.group_values.len() == other.group_values.len()
            && self.captor_of_channel == other.captor_of_channel
            && [emitted.len(), escaped.len(), lost.len()] == [theirs.emitted.len(); 3]
            && absorbed.len() == theirs.absorbed.len()
            && [missed, chance].into_iter().all(|l| [0, theirs.emitted.len()].contains(&l.len()))
            && [0, self.columns].contains(&self.chance.len())
            && self.chance.iter().all(Running::is_possible)
            && self.spent.len() == other.spent.len()
            && self.spent.iter().all(Running::is_possible)
            && powers.into_iter().flatten().all(|power| is_possible(*power))
            && self.running.iter().all(Running::is_possible)
            && self.parts.len() == other.parts.len()
            && self.parts.iter().zip(&other.parts).all(|(mine, theirs)| mine.fits(theirs))
            && self.moment_channels == other.moment_channels
            && self.moments.len() == other.moments.len()
            && self.moments.iter().all(RunningOver::is_possible)
            && self.ratio_moments.len() == other.ratio_moments.len()
            && self.ratio_moments.iter().all(RunningFour::is_possible)
    }

    /// Returns the totals of each part of the light, or of each variant of the scene; empty if there are
    /// none.
    pub fn parts(&self) -> &[Self] {
        &self.parts
    }

    /// Returns the totals of a part as those of a run of its own.
    pub fn of_part(&self, part: usize) -> Self {
        let Self { histories, segments, effort, cut_off, .. } = *self;
        Self { histories, segments, effort, cut_off, ..self.parts[part].clone() }
    }

    /// Returns the totals with each part multiplied by its factors, per band, sum and ratio; they
    /// are no longer split.
    pub fn mixed(&self, factors: &[Vec<f64>]) -> Self {
        let ratios = self.pairs.len().checked_div(self.photons.len()).unwrap_or(0);
        let parts = || self.parts.iter().zip(factors);
        let pair = |i: usize| {
            let pairs = parts().map(|(part, by)| (part.pairs[i], by[self.columns + i % ratios]));
            RunningPair::mixed(pairs, self.batches)
        };
        let mixed = |of: fn(&Self) -> &[Running]| -> Vec<Running> {
            let mix = |i: usize| {
                let some = |(part, by): (&Self, &Vec<f64>)| {
                    Some((*of(part).get(i)?, by[i % self.columns]))
                };
                Running::mixed(parts().filter_map(some), self.batches)
            };
            (0..of(self).len()).map(mix).collect()
        };
        let mut ledger = Ledger::new(self.ledger.emitted.len(), 0);
        ledger.absorbed = vec![0.0; self.ledger.absorbed.len()];
        parts().for_each(|(part, factors)| ledger.add(&part.ledger, |band| factors[band]));
        Self {
            running: mixed(|part| &part.running),
            pairs: (0..self.pairs.len()).map(pair).collect(),
            photons: self.photons.clone(),
            arrived: self.arrived.clone(),
            weighed: self.weighed.clone(),
            ledger,
            by_photons: Vec::new(),
            spent: mixed(|part| &part.spent),
            chance: mixed(|part| &part.chance),
            captor_of_channel: self.captor_of_channel.clone(),
            group_values: Vec::new(),
            parts: Vec::new(),
            moment_channels: 0..0,
            moments: Vec::new(),
            ratio_moments: Vec::new(),
            ..*self
        }
    }

    /// Returns the power that games of chance took, less the power that they gave, per band, then
    /// per sum; empty if there were no games.
    pub fn chance(&self) -> &[Running] {
        &self.chance
    }

    /// Returns the number of photons that were counted in a channel.
    pub fn photons(&self, channel: usize) -> u64 {
        self.photons[channel]
    }

    /// Returns the number of histories to which the photons counted in a channel belong. `None` for
    /// a channel of a group, because the captors of a group share histories.
    pub fn histories_in(&self, channel: usize) -> Option<u64> {
        self.arrived.get(channel).copied()
    }

    /// Returns the number of equal histories that would vary as much as those of a channel, (Σ x)²
    /// / Σ x². `None` if the powers of histories were not recorded.
    pub fn equal_histories(&self, channel: usize) -> Option<f64> {
        let [sum, squares] = *self.weighed.get(channel)?;
        Some(if squares > 0.0 { sum * sum / squares } else { 0.0 })
    }

    /// Returns the mean and the standard error of one of the sums of the stand, per band, then per sum.
    pub fn of_stand(&self, scene: &Scene, channel: usize) -> impl Iterator<Item = Estimate> {
        let groups = scene.groups().len() * scene.group_channels();
        self.estimates(scene.channels() + groups + channel)
    }

    /// Returns the running mean and standard error of a channel, per band, then per sum.
    pub fn running(&self, channel: usize) -> &[Running] {
        &self.running[channel * self.columns..][..self.columns]
    }

    /// Returns the mean and the standard error of a channel, per band, then per sum.
    pub fn estimates(&self, channel: usize) -> impl Iterator<Item = Estimate> {
        let histories = self.misses_of(channel);
        let running = self.running(channel).iter();
        running.map(move |running| running.estimate(self.batches).with_misses(histories))
    }

    /// Returns the number of histories of photons that were counted in a channel, of which
    /// [one more may miss](Estimate::with_misses); 0 where paths find the light: they emit nothing,
    /// and their batches are alike because they find what they look for.
    pub fn misses_of(&self, channel: usize) -> u64 {
        let emits = || self.ledger.emitted.iter().any(|power| *power > 0.0);
        let alone = || self.by_photons.get(channel).is_some_and(|&alone| alone);
        let of_photons = (!self.beside_paths || alone()) && emits();
        let counted = || self.histories_in(channel).unwrap_or(self.photons(channel));
        if of_photons { counted() } else { 0 }
    }

    /// Returns for each band and sum the power that each material absorbed, that left the scene,
    /// that was lost, and that games of chance took, in lists of one entry per column; none unless
    /// the scene says what its lights cost.
    pub fn spent(&self) -> impl Iterator<Item = &[Running]> {
        self.spent.chunks(self.columns)
    }

    /// Returns for each ratio the means of its two sums in a channel and, from two batches on, the
    /// variance of the first, their covariance and the variance of the second.
    pub fn ratios(
        &self,
        channel: usize,
    ) -> impl ExactSizeIterator<Item = ([f64; 2], Option<[f64; 3]>)> {
        let ratios = self.pairs.len().checked_div(self.photons.len()).unwrap_or(0);
        let pairs = self.pairs[channel * ratios..][..ratios].iter();
        pairs.map(move |pair| pair.estimate(self.batches))
    }

    /// Returns the power balance, averaged over the batches, in W or umol/s.
    pub fn ledger(&self) -> Ledger {
        let mut mean = Ledger::new(self.ledger.emitted.len(), 0);
        mean.absorbed = vec![0.0; self.ledger.absorbed.len()];
        let scale = 1.0 / self.batches as f64;
        mean.add(&self.ledger, |_| scale);
        mean
    }
}

/// Writes values per band into a row, and after them those of the sums over bands.
#[inline]
fn fill(scene: &Scene, row: &mut [f64], of_bands: impl Iterator<Item = f64>) {
    row.iter_mut().zip(of_bands).for_each(|(value, of_band)| *value = of_band);
    for (s, sum) in scene.sums().iter().enumerate() {
        row[scene.bands().len() + s] = sum.of(row);
    }
}

/// Adds what a batch brought to a channel, per band, to the two sums of each ratio.
fn add_ratios(scene: &Scene, pairs: &mut [RunningPair], channel: usize, row: &[f64]) {
    let pairs = pairs.iter_mut().skip(channel * scene.ratios().len());
    for (pair, ratio) in pairs.zip(scene.ratios()) {
        pair.add(ratio.numerator.of(row), ratio.denominator.of(row));
    }
}
