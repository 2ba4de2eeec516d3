//! Tallies: sums over a batch of histories of what arrived where.

mod moments;
mod sums;
mod totals;

use serde::{Deserialize, Serialize};

use crate::{
    math::spectrum::{Lanes, Spectrum},
    scene::{
        captor::{ABSORBED_FRONT, Captor, CaptorKind, Channel},
        material::Scatterer,
        parameter::{ParameterIndex, Sent, Variant},
        stand::Balance,
        world::{Arrived, Scene},
    },
    transport::{
        met::{Account, Meeting, Met, Moments},
        paths::PathScore,
        trace::{Counted, Event},
    },
};

use moments::{MomentTally, accumulate};
pub use sums::Sums;
pub use totals::Totals;

/// The power balance, per band, in W or umol/s.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// Power with which the photons were emitted.
    pub emitted: Vec<f64>,
    /// Power that surfaces absorbed: all bands for the first material, then for the second, and so
    /// on.
    pub absorbed: Vec<f64>,
    /// Power that left the scene.
    pub escaped: Vec<f64>,
    /// The part of `escaped` that met no surface, where light comes from infinitely far away; else
    /// empty.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missed: Vec<f64>,
    /// Power on paths longer than the limits.
    pub lost: Vec<f64>,
    /// Power that games of chance took, less the power that they gave, where photons are guided.
    /// Its mean is 0. Empty where photons are not guided.
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

/// The counts of a channel.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    /// Number of photons; one that arrives twice, or in two flights, counts twice.
    photons: u64,
    /// Number of histories to which these photons belong.
    histories: u64,
    /// Number of the last of these histories.
    last: u64,
}

/// How much the histories of a channel differ in the power that they bring, summed over all bands.
#[derive(Clone, Copy, Debug, Default)]
struct Weighed {
    /// Number of the last history, and the power that it has brought so far.
    last: u64,
    own: f64,
    /// The sum of the powers that earlier histories brought, and the sum of the squares of these
    /// powers.
    before: [f64; 2],
}

impl Weighed {
    /// Closes the last history.
    fn settle(&mut self) {
        let own = std::mem::take(&mut self.own);
        self.before = [self.before[0] + own, self.before[1] + own * own];
    }
}

/// Sums over some histories, per band of the channels in which anything was counted. A tally takes
/// memory for these channels, and 4 bytes for each other channel of the scene. Powers are in the
/// units of [`crate::scene::light::Strata::weights`].
#[derive(Clone, Debug)]
pub struct Tally {
    bands: usize,
    /// For each channel its place in the next four lists, plus one; 0 where nothing was counted.
    places: Vec<u32>,
    touched: Vec<u32>,
    counts: Vec<Counts>,
    /// How much the histories of each channel differ, if that is asked for.
    weighed: Option<Vec<Weighed>>,
    /// Power per place and band.
    flux: Vec<f64>,
    /// Number of the history that is under way.
    history: u64,
    /// Number of straight flights: between emission, interactions and escape.
    segments: u64,
    /// The work beside these flights, as [`effort`](crate::math::effort) counts it, in trials.
    effort: u64,
    /// Number of paths that a length limit ended.
    cut_off: u64,
    ledger: Ledger,
    /// A tally for each part of the light, if the light is split, or for each variant of the scene.
    parts: Vec<Tally>,
    /// The [moments](super::met) of the scene's parameters, if they are asked for.
    moments: Option<MomentTally>,
}

impl Tally {
    /// Returns an empty tally for `scene`, whose light is split into `parts` parts; 0 means not
    /// split.
    pub fn new(scene: &Scene, parts: usize) -> Self {
        let bands = scene.bands().len();
        Self {
            bands,
            places: vec![0; scene.channels() + scene.stand().channels()],
            touched: Vec::new(),
            counts: Vec::new(),
            weighed: None,
            flux: Vec::new(),
            history: 0,
            segments: 0,
            effort: 0,
            cut_off: 0,
            ledger: Ledger::new(bands, scene.materials().len()),
            parts: (0..parts).map(|_| Self::new(scene, 0)).collect(),
            moments: None,
        }
    }

    /// Returns the same tally, which now also sums the moments of the scene's parameters.
    pub fn with_moments(self, scene: &Scene) -> Self {
        let of_part = |part: Self| {
            let parameters = scene.parameters().moments_by_light().count();
            Self { moments: MomentTally::new(scene, parameters), ..part }
        };
        Self {
            moments: MomentTally::new(scene, scene.parameters().moments().count()),
            parts: self.parts.into_iter().map(of_part).collect(),
            ..self
        }
    }

    /// Returns whether it counts by what light has met: moments of parameters, or variants of the scene.
    pub fn keeps_account(&self, scene: &Scene) -> bool {
        let variants = !scene.parameters().variants().is_empty() && !self.parts.is_empty();
        variants || self.moments.is_some()
    }

    /// Returns the same tally, which now also records how many equal histories its counts
    /// correspond to. Guided photons bring unequal powers.
    pub fn weighing(self) -> Self {
        Self { weighed: Some(Vec::new()), ..self }
    }

    /// Returns about how many bytes a tally takes for `scene` with so many parts, when anything was
    /// counted in at most `touched` channels.
    pub fn bytes(scene: &Scene, parts: usize, touched: usize) -> usize {
        let all = scene.channels() + scene.stand().channels();
        let touched = touched.min(all);
        let ledger = (scene.materials().len() + 3) * scene.bands().len();
        let sums = (touched * scene.bands().len() + ledger) * size_of::<f64>();
        let places = all * size_of::<u32>();
        let counts = touched * (size_of::<Counts>() + size_of::<u32>());
        let moments = |parameters| MomentTally::bytes(scene, parameters, touched);
        (parts + 1) * (2 * size_of::<Self>() + sums + places + counts)
            + moments(scene.parameters().moments().count())
            + parts * moments(scene.parameters().moments_by_light().count())
    }

    /// Adds work that was counted.
    pub fn spend(&mut self, effort: u64) {
        self.effort += effort;
    }

    /// Scores the emission of a photon, with its whole power, also in its `part`.
    #[inline]
    pub fn emitted<L: Lanes>(&mut self, part: Option<usize>, weights: &[f64], power: &Spectrum<L>) {
        self.history += 1;
        accumulate(&mut self.ledger.emitted, weights, power);
        if let Some(part) = part {
            self.parts[part].emitted(None, weights, power);
        }
    }

    /// Scores an event of a photon of these weights, also in its `part`.
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

    /// Kept out of line, because most runs are not split.
    #[inline(never)]
    fn score_part<L: Lanes>(&mut self, scene: &Scene, weights: &[f64], event: &Event<'_, L>) {
        self.score_whole(scene, weights, event);
    }

    #[inline]
    fn score_whole<L: Lanes>(&mut self, scene: &Scene, weights: &[f64], event: &Event<'_, L>) {
        self.score_beside(scene, weights, event, |_| true);
    }

    /// Scores an event of a photon of these weights. It counts for the captors for which `counts`
    /// is true; where power goes is scored in any case.
    #[inline]
    pub fn score_beside<L: Lanes>(
        &mut self,
        scene: &Scene,
        weights: &[f64],
        event: &Event<'_, L>,
        counts: impl Fn(&Counted<'_, L>) -> bool,
    ) {
        let counted = event.counted(scene).filter(counts);
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
            Event::Crossing { .. } | Event::ArrivalBeside { .. } | Event::Turn(_) => {}
            Event::FlightBeside => self.segments += 1,
            Event::Chance { before, after } => {
                self.ledger.chance.resize(self.bands, 0.0);
                let (before, after) = (before.values(), after.values());
                for (b, chance) in self.ledger.chance.iter_mut().enumerate() {
                    *chance += (f64::from(before[b]) - f64::from(after[b])) * weights[b];
                }
            }
            Event::Arrival { at, power, scattered, .. } => {
                self.segments += 1;
                let first = at.surface.material as usize * self.bands;
                let absorbed = self.ledger.absorbed[first..][..self.bands].iter_mut();
                let powers = power.values().iter().zip(scattered.values()).zip(weights);
                for (absorbed, ((came, left), weight)) in absorbed.zip(powers) {
                    *absorbed += (f64::from(*came) - f64::from(*left)) * weight;
                }
                if let Some(Counted { captor, face, .. }) = counted {
                    let absorbed = absorbed_of(at, power, scattered);
                    let channel = captor.first_channel + Channel::Absorbed as usize;
                    self.add(channel, weights, &absorbed);
                    if captor.by_face {
                        let channel = captor.first_channel + ABSORBED_FRONT + face as usize;
                        self.add(channel, weights, &absorbed);
                    }
                    if let Some(layer) = scene.layer_of(at.hit.triangle, at.hit.point) {
                        self.add(scene.channels() + layer, weights, &absorbed);
                    }
                }
                if scene.stand().balances {
                    self.balance_arrival(scene, weights, event);
                }
            }
            Event::Escaped { power, missed, direction } => {
                self.segments += 1;
                accumulate(&mut self.ledger.escaped, weights, power);
                if missed && scene.has_daylight() {
                    self.ledger.missed.resize(self.bands, 0.0);
                    accumulate(&mut self.ledger.missed, weights, power);
                }
                if scene.stand().balances {
                    let way = if scene.rises(direction) { Balance::Up } else { Balance::Down };
                    self.add(scene.channels() + scene.stand().channel(way), weights, power);
                }
            }
            Event::Lost(power) => accumulate(&mut self.ledger.lost, weights, power),
        }
    }

    /// Scores the emission of a photon, with its whole power, in the variants of the scene.
    pub fn emitted_in_variants<L: Lanes>(
        &mut self,
        scene: &Scene,
        weights: &[f64],
        power: &Spectrum<L>,
        account: &mut Account<L>,
    ) {
        if scene.parameters().variants().is_empty() {
            return;
        }
        let met = account.now(scene);
        for (part, variant) in self.parts.iter_mut().zip(scene.parameters().variants()) {
            part.emitted(None, weights, &(met.factor(variant, scene.lanes()) * power));
        }
    }

    /// Scores an event of light of which an account says what it has met, in the moments of parameters,
    /// also in those of its `part`, or in the variants of the scene, for the captors for which `counts`
    /// is true.
    #[inline]
    pub fn score_met<L: Lanes>(
        &mut self,
        scene: &Scene,
        part: Option<usize>,
        weights: &[f64],
        event: &Event<'_, L>,
        account: &mut Account<L>,
        counts: impl Fn(&Counted<'_, L>) -> bool,
    ) {
        match scene.parameters().variants() {
            [] => {
                if let Some(counted) = event.counted(scene).filter(counts) {
                    let met = account.of(scene, event);
                    self.score_moments(scene, weights, (event, &counted), met);
                    if let Some(part) = part {
                        self.parts[part].score_moments(scene, weights, (event, &counted), met);
                    }
                }
            }
            // these are of no light that counts
            _ if matches!(
                event,
                Event::FlightBeside | Event::ArrivalBeside { .. } | Event::Turn(_)
            ) => {}
            variants => {
                let met = account.of(scene, event);
                for (part, variant) in self.parts.iter_mut().zip(variants) {
                    part.score_variant(scene, weights, event, (met, variant), &counts);
                }
            }
        }
    }

    /// Scores what an event is in a variant of the scene.
    fn score_variant<L: Lanes>(
        &mut self,
        scene: &Scene,
        weights: &[f64],
        event: &Event<'_, L>,
        (met, variant): (&Met<L>, &Variant),
        counts: impl Fn(&Counted<'_, L>) -> bool,
    ) {
        let factor: Spectrum<L> = met.factor(variant, scene.lanes());
        let scaled = |power: &Spectrum<L>| factor.clone() * power;
        let mut score = |event: Event<'_, L>| self.score_beside(scene, weights, &event, &counts);
        match *event {
            Event::Crossing { crossing, direction, power, .. } => {
                score(Event::Crossing {
                    crossing,
                    direction,
                    power: &scaled(power),
                    carried: None,
                });
            }
            Event::Arrival { at, power, scattered, lobe } => {
                let material = variant.material(at.surface.material);
                let own = lobe.and_then(Sent::by).and_then(|sent| {
                    scene.parameters().of_way(at.surface.material, at.interaction.front, sent)
                });
                let onward = match own {
                    Some(own) => scaled(scattered) * Spectrum::load(variant.factor(own)),
                    None => scaled(scattered),
                };
                score(Event::Arrival {
                    at: &Arrived { material, ..*at },
                    power: &scaled(power),
                    scattered: &onward,
                    lobe,
                });
            }
            Event::Chance { before, after } => {
                score(Event::Chance { before: &scaled(before), after: &scaled(after) });
            }
            Event::Escaped { power, missed, direction } => {
                score(Event::Escaped { power: &scaled(power), missed, direction });
            }
            Event::Lost(power) => score(Event::Lost(&scaled(power))),
            Event::FlightBeside | Event::ArrivalBeside { .. } | Event::Turn(_) => {}
        }
    }

    /// Scores an event that counts at a captor, of light that has met these parameters, in their
    /// moments.
    #[inline(never)]
    fn score_moments<L: Lanes>(
        &mut self,
        scene: &Scene,
        weights: &[f64],
        (event, counted): (&Event<'_, L>, &Counted<'_, L>),
        met: &Met<L>,
    ) {
        let Some(moments) = &mut self.moments else { return };
        match &counted.captor.sensor.response {
            None => moments.add_met(counted.channel(), weights, counted.power, met),
            Some(response) => {
                let read = counted.power.clone().scaled(response.factor(event.cosine(scene)));
                moments.add_met(counted.channel(), weights, &read, met);
            }
        }
        let Event::Arrival { at, power, scattered, lobe } = *event else { return };
        let first = counted.captor.first_channel;
        let by_face =
            counted.captor.by_face.then_some(first + ABSORBED_FRONT + counted.face as usize);
        let absorbed = absorbed_of(at, power, scattered);
        // what the surface itself sends on, it does not absorb
        let own = lobe.and_then(|lobe| Meeting::sent_on(scene, at.into(), lobe));
        let own = own.map(|own| (own.parameter, own.moment(&scattered.clone().scaled(-1.0))));
        for channel in [Some(first + Channel::Absorbed as usize), by_face].into_iter().flatten() {
            moments.add_met(channel, weights, &absorbed, met);
            if let Some((parameter, moment)) = &own {
                moments.add(channel, *parameter, weights, moment);
            }
        }
    }

    /// Scores what an arrival means for the balance of the light of sun and sky. Kept out of line,
    /// because most scenes have none.
    #[cold]
    #[inline(never)]
    fn balance_arrival<L: Lanes>(&mut self, scene: &Scene, weights: &[f64], event: &Event<'_, L>) {
        let Event::Arrival { at, power, scattered, .. } = *event else { return };
        let channel = |balance| scene.channels() + scene.stand().channel(balance);
        let absorbed = absorbed_of(at, power, scattered);
        if scene.is_ground(at.hit.triangle) {
            if !scene.rises(at.interaction.direction) {
                self.add(channel(Balance::OnGround), weights, power);
            }
            self.add(channel(Balance::ByGround), weights, &absorbed);
        } else {
            self.add(channel(Balance::ByStand), weights, &absorbed);
        }
    }

    /// Scores what a path has found for a captor's face, also in moments and variants of the scene.
    pub fn score_path<L: Lanes>(
        &mut self,
        scene: &Scene,
        captor: &Captor,
        face: Channel,
        score: &PathScore<L>,
    ) {
        self.score_path_found(scene, captor, face, score);
        let sums = [&score.moments, &score.absorbed_moments];
        if sums.iter().any(|sums| !sums.0.is_empty()) || !self.parts.is_empty() {
            self.score_path_sums(scene, captor, face, score);
        }
    }

    /// Scores what a path has found for a captor's face.
    fn score_path_found<L: Lanes>(
        &mut self,
        scene: &Scene,
        captor: &Captor,
        face: Channel,
        score: &PathScore<L>,
    ) {
        let ones = std::iter::repeat(&1.0);
        self.history += 1;
        self.segments += u64::from(score.rays);
        self.cut_off += u64::from(score.cut_off);
        self.add(captor.first_channel + face as usize, ones.clone(), &score.flux);
        if captor.kind == CaptorKind::Surface {
            let channel = captor.first_channel + Channel::Absorbed as usize;
            self.add(channel, ones.clone(), &score.absorbed);
            if captor.by_face {
                let channel = captor.first_channel + ABSORBED_FRONT + face as usize;
                self.add(channel, ones.clone(), &score.absorbed);
            }
            for (layer, absorbed) in &score.in_layers {
                self.add(scene.channels() + layer, ones.clone(), absorbed);
            }
        }
    }

    /// Scores what a path has found in moments and variants of the scene. Kept out of line, because most
    /// runs ask for none.
    #[inline(never)]
    fn score_path_sums<L: Lanes>(
        &mut self,
        scene: &Scene,
        captor: &Captor,
        face: Channel,
        score: &PathScore<L>,
    ) {
        let ones = std::iter::repeat(&1.0);
        let variants = scene.parameters().variants().len();
        for (v, part) in self.parts.iter_mut().enumerate().take(variants) {
            // a path counts in each variant, also if it has found nothing
            let of = |sums: &Moments<L>| {
                let own = sums.0.iter().find(|(index, _)| *index == v);
                own.map_or_else(|| score.flux.zero(), |(_, sum)| sum.clone())
            };
            let [flux, absorbed] = [of(&score.moments), of(&score.absorbed_moments)];
            let (moments, absorbed_moments) = (Moments::default(), Moments::default());
            let in_layers = Vec::new();
            let cut_off = score.cut_off;
            let own = PathScore {
                flux,
                absorbed,
                rays: 0,
                cut_off,
                in_layers,
                moments,
                absorbed_moments,
            };
            part.score_path_found(scene, captor, face, &own);
        }
        let Some(moments) = &mut self.moments else { return };
        for (index, flux) in &score.moments.0 {
            let channel = captor.first_channel + face as usize;
            moments.add(channel, *index as ParameterIndex, ones.clone(), flux);
        }
        for (index, absorbed) in &score.absorbed_moments.0 {
            let index = *index as ParameterIndex;
            let channel = captor.first_channel + Channel::Absorbed as usize;
            moments.add(channel, index, ones.clone(), absorbed);
            if captor.by_face {
                let channel = captor.first_channel + ABSORBED_FRONT + face as usize;
                moments.add(channel, index, ones.clone(), absorbed);
            }
        }
    }

    /// Adds what a sensor reads of the power that arrives. Kept out of line, because most sensors
    /// have no response of their own.
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

    /// Adds `power` to what the history under way has brought to this place. Kept out of line,
    /// because most tallies do not record it.
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

    /// Returns the place of a channel in the lists; a new channel gets a place at their end.
    #[inline(always)]
    fn place(&mut self, channel: usize) -> usize {
        match self.places[channel] {
            0 => self.new_place(channel),
            next => next as usize - 1,
        }
    }

    /// Kept out of line, because most channels already have a place.
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

/// Returns what a surface absorbs of the power that arrives, on average or, where no closed form is
/// known, of this photon.
#[inline]
fn absorbed_of<L: Lanes>(
    at: &Arrived,
    power: &Spectrum<L>,
    scattered: &Spectrum<L>,
) -> Spectrum<L> {
    match at.material.absorptance::<L>(&at.interaction) {
        Some(absorptance) => absorptance * power,
        None => power.clone().zip(scattered, |before, after| before - after),
    }
}
