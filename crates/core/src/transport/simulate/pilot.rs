//! The pilot: before a run it learns what will guide the photons, from photons and importons that count nowhere else.

use std::sync::{Arc, atomic::Ordering};

use super::{
    Arrivals, Control, Run, lamps,
    tried::{RAYS, affordable, of_a_trial},
};
use crate::{
    error::{Error, NOTHING_WRITTEN, Result},
    math::{
        machine,
        rng::{Purpose, Streams},
        spectrum::{Lanes, with_lanes},
    },
    scene::{light::Strata, material::Scatterer, world::Scene},
    transport::{
        guiding::{self, Cells, Guidance, Importance, Lamps, Sources, Windows},
        settings::Settings,
        tally::Totals,
        trace::{Event, trace},
    },
};

/// The number of rounds. In each, photons that are guided as the round before has learned find the light of the captors,
/// and importons start from the captors with weights that follow from it.
const ROUNDS: u64 = 3;
/// The importons of the first round, which shows the others where few of them arrive, and of each other round.
const FIRST_IMPORTONS: u64 = 25_000;
const IMPORTONS: u64 = 100_000;
/// The photons of a round.
const PHOTONS: u64 = 1 << 13;
/// The most photons that find which emission of the lamps matters: in a round, and in the last one.
const FEW: u64 = 1 << 16;
const MANY: u64 = 1 << 21;
/// No captor counts as darker than this, relative to the brightest.
const DARKEST: f64 = 1e-6;
/// Photons that tell the importance where photons arrive, and the most arrivals of them.
const ARRIVING: u64 = 1 << 14;
const MOST_ARRIVALS: usize = 1 << 18;
/// The usual product R of power and importance is this quantile over the places where photons first meet a diffuse
/// surface. The mean will not do: a few photons that come straight to where light matters would make it so large that
/// all others end.
const USUAL: f64 = 0.75;
/// R is at least this share of the mean: where most photons do not matter at all, the others need not be split for it.
const LEAST_USUAL: f32 = 0.2;
/// Weight windows are used where importance varies by at least this factor over the places where photons arrive.
const VARIES: f32 = 5.0;
/// This share of the arrivals, those of the most and of the least importance, is left out of that comparison.
const EXTREMES: f64 = 0.01;

/// What is learned, round by round.
pub(super) struct ImportancePilot<'a, 'c> {
    scene: &'a Scene,
    settings: Settings,
    control: &'c Control<'c>,
    pool: rayon::ThreadPool,
    cells: Arc<Cells<'a>>,
    /// How many rounds are done.
    round: u64,
    /// The importance that arrived at each cell in the last round, per area.
    arriving: Option<Vec<f32>>,
    guidance: Guidance<'a>,
    /// Whether importance varies enough for windows.
    varies: bool,
}

impl<'a, 'c> ImportancePilot<'a, 'c> {
    /// A pilot that has learned nothing yet. Error: there are no threads to be had.
    pub fn new(scene: &'a Scene, settings: &Settings, control: &'c Control<'c>) -> Result<Self> {
        Ok(Self {
            scene,
            settings: of_a_trial(settings),
            control,
            pool: machine::pool(settings.threads.get())?,
            cells: Arc::new(Cells::new(scene)),
            round: 0,
            arriving: None,
            guidance: Guidance::aim(scene).unwrap_or_default(),
            varies: false,
        })
    }

    /// One more round. Errors: those of a run.
    pub fn round(&mut self) -> Result<()> {
        let (scene, cells) = (self.scene, self.cells.clone());
        let seed = self.settings.seed;
        let (round, last) = (self.round, self.round + 1 == ROUNDS);
        let totals = self.photons()?;
        let sources = Sources::new(scene, &expected(scene, &totals));
        let before = self.arriving.as_deref();
        let importons = if round == 0 { FIRST_IMPORTONS } else { IMPORTONS };
        let stop = self.control.stop;
        let learn = || guiding::learn(&sources, &cells, seed, (round, importons), before, stop);
        let arriving = self.pool.install(learn);
        self.check_stopped()?;
        let importance = Arc::new(Importance::new(scene, cells.clone(), &arriving));
        let most = if last { MANY } else { FEW };
        with_lanes!(scene.lanes(), L => {
            let lamps = self.pool.install(|| lamps::learn::<L>(scene, &importance, seed, most, stop));
            self.guidance.starved = lamps.is_err();
            self.guidance.lamps = lamps.unwrap_or(None).map(Arc::new);
            let lamps = self.guidance.lamps.as_deref();
            let Arriving { usual, varies } = arrive::<L>(scene, &importance, lamps, seed);
            self.guidance.windows = (usual > 0.0).then_some(Windows { importance, usual });
            self.varies = varies;
        });
        self.arriving = Some(arriving);
        self.round += 1;
        self.check_stopped()
    }

    fn check_stopped(&self) -> Result<()> {
        match self.control.stop.load(Ordering::Relaxed) {
            true => Err(Error::interrupted("run", NOTHING_WRITTEN)),
            false => Ok(()),
        }
    }

    /// What has been learned: weight windows only where importance varies.
    pub fn guidance(&self) -> Guidance<'a> {
        let windows = self.guidance.windows.clone().filter(|_| self.varies);
        Guidance { windows, ..self.guidance.clone() }
    }

    /// All of it, if it guides anything. Errors: those of a run.
    pub fn learn(mut self) -> Result<Option<Guidance<'a>>> {
        if self.scene.captors().is_empty() || self.scene.lights().is_empty() {
            return Ok(None);
        }
        while self.round < ROUNDS {
            self.round()?;
        }
        let guidance = self.guidance();
        Ok(guidance.guides().then_some(guidance))
    }

    /// What photons find that are guided by the last round.
    fn photons(&self) -> Result<Totals> {
        let control = Control { progress: &|_| {}, ..*self.control };
        let (scene, round) = (self.scene, self.round);
        let run = Run::new(scene, &self.settings, Vec::new(), Arrivals::OnCaptors, &control)?;
        let guidance = Some(self.guidance.clone());
        let run = Run { purpose: Purpose::Pilot, ..run.guided_by(guidance) };
        let photons = PHOTONS.max(scene.sources() as u64);
        let photons = affordable(scene, &self.settings, &control, (photons, RAYS))?;
        run.round(round, &run.histories.schedule(run.scene, photons)?)
    }
}

/// The light on each face of the captors, per band, W/m2. Of faces that none has reached it is that of the darkest other
/// one, so that they are looked for.
fn expected(scene: &Scene, totals: &Totals) -> Vec<Vec<f64>> {
    let mut light: Vec<Vec<f64>> = Vec::new();
    for captor in scene.captors() {
        for &face in captor.kind.faces() {
            let running = &totals.running(captor.first_channel + face as usize);
            let mean = |b: usize| running[b].estimate(totals.batches).mean / captor.area;
            light.push((0..scene.bands().len()).map(mean).collect());
        }
    }
    for b in 0..scene.bands().len() {
        let lit = || light.iter().map(|face| face[b]).filter(|light| *light > 0.0);
        let brightest = lit().fold(0.0, f64::max);
        let darkest = lit().fold(f64::INFINITY, f64::min).max(DARKEST * brightest);
        let least = if brightest > 0.0 { darkest } else { 1.0 };
        light.iter_mut().for_each(|face| face[b] = face[b].max(least));
    }
    light
}

/// Importance where photons arrive.
struct Arriving {
    /// Where they first come to a diffuse surface: what is usual, times W or umol/s.
    usual: f32,
    /// Whether it varies enough for windows.
    varies: bool,
}

fn arrive<L: Lanes>(
    scene: &Scene,
    importance: &Importance,
    lamps: Option<&Lamps>,
    seed: u64,
) -> Arriving {
    let photons = ARRIVING.max(scene.sources() as u64);
    let strata = Strata::new(scene.lights(), photons, scene.lanes());
    let streams = Streams::new(seed, Purpose::Pilot, u64::MAX);
    let (mut firsts, mut all, mut arrivals, mut done) = (Vec::new(), Vec::new(), 0, 0);
    // neighbouring histories share the lights well, so it can end after any
    while done < photons && arrivals < MOST_ARRIVALS {
        let mut rng = streams.history(done);
        let (photon, density) = match lamps {
            Some(lamps) => lamps.emit::<L>(scene, &strata, done, &mut rng),
            None => (scene.emit(&strata, done, &mut rng), 1.0),
        };
        let largest = photon.weights.iter().copied().fold(0.0, f64::max);
        let weight = largest / f64::from(density);
        let mut first = true;
        trace(scene, photon.ray, photon.power, (), &mut rng, |event| {
            let Event::Arrival { at, power, .. } = event else { return };
            arrivals += 1;
            if !at.material.is_diffuse() {
                return;
            }
            let value = importance.at(&at.hit, at.interaction.front);
            if first {
                firsts.push((weight * f64::from(power.largest() * value)) as f32);
            }
            first = false;
            all.push(value);
        });
        done += 1;
    }
    let varies = quantile(&mut all, 1.0 - EXTREMES) > VARIES * quantile(&mut all, EXTREMES);
    let mean = firsts.iter().sum::<f32>() / done.max(1) as f32;
    Arriving { usual: quantile(&mut firsts, USUAL).max(LEAST_USUAL * mean), varies }
}

/// The value below which there are so many of all; 0 of none.
fn quantile(values: &mut [f32], share: f64) -> f32 {
    values.sort_unstable_by(f32::total_cmp);
    values.get((share * values.len() as f64) as usize).copied().unwrap_or(0.0)
}
