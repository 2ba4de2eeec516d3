//! The content of the page for the browser and of exported files: surfaces and captors in tiles,
//! with the light on them, the results of the captors, and photons.

use std::{
    fmt::Display,
    sync::atomic::{AtomicU64, Ordering},
};

use rayon::prelude::*;

use crate::following::Followed;
use phylux_core::{
    error::{Error, NOTHING_WRITTEN, Result, catch_panic},
    math::{machine, stats::Estimate},
    scene::{
        captor::{CHANNELS, Channel},
        tiles::{TilePart, Tiles},
        world::Scene,
    },
    transport::{
        settings::{Estimator, NearestCount, Settings},
        simulate::{Control, Progress, light_surfaces, map_bytes, simulate},
        surface_light::SurfaceLight,
    },
};
use phylux_results::result::{
    BudgetResult, CaptorResult, FaceResult, GroupResult, OfLights, RunResult, SensitivityResult,
};

/// A scene with its light.
pub struct RenderedScene<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The tiles of its surfaces and virtual captors.
    pub tiles: Tiles,
    /// Description of the origin of the captors' results, in words.
    pub source: String,
    /// Results of the captors, in the order of the scene.
    pub captors: Vec<CaptorResult>,
    /// Results of the groups of captors: entries, objects, their instances.
    pub groups: Vec<GroupResult>,
    /// How much these depend on materials and lights; empty where that is not known.
    pub sensitivity: Vec<SensitivityResult>,
    /// How uncertain they are because inputs are; empty where that is not known.
    pub budget: Vec<BudgetResult>,
    /// Photons on all surfaces, if any were traced.
    pub light: Option<SurfaceLight<'a>>,
    /// How light reaches some captors, if that was followed.
    pub followed: Option<Followed>,
    /// Photon estimates for the tiles of surfaces, W/m2 or umol/m2/s, by tile, channel and band.
    local: Vec<f32>,
    /// Share of each light in the irradiance, by tile, face, light and band; 255 stands for 1.
    /// Empty where there is one light, too many lights, or where results are not split by light.
    shares: Vec<u8>,
}

/// The most tiles of a page, and of a file with copies: of more triangles, those of copies that share
/// them are merged.
pub(crate) const MOST_TILES: usize = 4_000_000;

/// The source of the light in a rendered scene.
#[derive(Clone, Debug)]
pub enum RenderPlan {
    /// The scene is run for its captors, and photons are traced for all surfaces.
    Run,
    /// The captors' results are given.
    Results {
        /// Results of this scene.
        results: Box<RunResult>,
        /// Whether photons are traced if some surface is not a captor.
        trace: bool,
    },
    /// Photons are traced for all surfaces, and nothing else.
    Photons,
}

/// Stages of the work, for reports of progress.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RenderStage {
    /// The run for the captors.
    Captors,
    /// Tracing of photons for all surfaces.
    Surfaces,
    /// Estimation of the light on each tile from these photons.
    Tiles,
    /// Tracing of photons that say how light reaches captors.
    Histories,
}

impl<'a> RenderedScene<'a> {
    /// Traces what `plan` needs. Where there are more than `most` tiles, the triangles of copies that
    /// share them are merged. `progress` is called now and then, from any thread. Errors: the results
    /// are of another scene; it would not fit into memory; those of [`simulate`].
    pub fn new(
        scene: &'a Scene,
        most: usize,
        settings: &Settings,
        plan: RenderPlan,
        control: &Control,
        progress: &(dyn Fn(RenderStage, Progress) + Sync),
    ) -> Result<Self> {
        let staged = |stage| move |p: Progress| progress(stage, p);
        check_tiles(scene, most)?;
        let tiles = Tiles::new(scene, most);
        check_memory(scene, &tiles, settings, &plan)?;
        let unknown = tiles.parts.iter().any(|part| part.captor.is_none());
        let reads_tiles = !matches!(plan, RenderPlan::Photons);
        let trace = !matches!(plan, RenderPlan::Results { trace, .. } if !(trace && unknown));
        let (mut sensitivity, mut budget) = (None, None);
        let (captors, groups, source) = match plan {
            RenderPlan::Results { results, .. } => {
                results.check_scene(scene)?;
                let source = source(results.photons, results.estimator, results.seed);
                (sensitivity, budget) = (results.extras.sensitivity, results.extras.budget);
                (results.captors, results.groups, source)
            }
            RenderPlan::Run if !scene.captors().is_empty() => {
                let control = Control { progress: &staged(RenderStage::Captors), ..*control };
                let by_photons = matches!(settings.estimator, Estimator::Photons | Estimator::Auto);
                let by_light = by_photons && splits(scene);
                let settings =
                    Settings { k: Some(NearestCount::NONE), by_light, ..settings.clone() };
                let simulation = simulate(scene, &settings, &control)?;
                let result = RunResult::new(&simulation);
                let source = source(result.photons, result.estimator, result.seed);
                (sensitivity, budget) = (result.extras.sensitivity, result.extras.budget);
                (result.captors, result.groups, source)
            }
            RenderPlan::Run | RenderPlan::Photons => (Vec::new(), Vec::new(), String::new()),
        };
        let mut rendered = Self {
            scene,
            tiles,
            source,
            captors,
            groups,
            sensitivity: sensitivity.unwrap_or_default(),
            budget: budget.unwrap_or_default(),
            light: None,
            followed: None,
            local: Vec::new(),
            shares: Vec::new(),
        };
        if trace && !scene.triangles().is_empty() {
            let k = settings.k.or_else(|| NearestCount::new(NEAREST).ok());
            // beside a run for captors, as many photons as the map takes
            let photons = settings.photons.filter(|_| !reads_tiles);
            let settings = Settings { photons, k, ..settings.clone() };
            let stage = Control { progress: &staged(RenderStage::Surfaces), ..*control };
            let light = light_surfaces(scene, &settings, &stage)?;
            if reads_tiles {
                let stage = Control { progress: &staged(RenderStage::Tiles), ..*control };
                let by_light = rendered.captors.is_empty() || rendered.is_by_light();
                let split = by_light && splits(scene);
                (rendered.local, rendered.shares) =
                    local(&rendered.tiles, &light, split, settings.threads.get(), &stage)?;
            }
            rendered.light = Some(light);
        }
        Ok(rendered)
    }

    /// Returns whether the light at each place of the surfaces is known.
    pub fn has_local(&self) -> bool {
        !self.local.is_empty()
    }

    /// Returns the photon estimate for a tile, per band, W/m2 or umol/m2/s; `None` for a virtual
    /// captor and where nothing was traced.
    pub fn local(&self, tile: usize, channel: Channel) -> Option<&[f32]> {
        let bands = self.scene.bands().len();
        let values = self.local.get((3 * tile + channel as usize) * bands..)?;
        values.get(..bands)
    }

    /// Returns whether the captors' results are split by the lights of the scene.
    pub fn is_by_light(&self) -> bool {
        let same = |lights: &OfLights<FaceResult>| {
            lights.keys().eq(self.scene.lights().iter().map(|light| light.name.as_str()))
        };
        let split = |captor: &CaptorResult| captor.front.by_light.as_deref().is_some_and(same);
        splits(self.scene) && !self.captors.is_empty() && self.captors.iter().all(split)
    }

    /// Returns the share of each light in the irradiance on the faces of surfaces, by tile, face,
    /// light and band; 255 stands for 1. Empty where the shares are not known.
    pub fn shares(&self) -> &[u8] {
        &self.shares
    }

    /// Returns the flux per area on a captor's face, or its absorbed power per area, in a band or
    /// sum, W/m2 or umol/m2/s.
    pub fn captor(&self, captor: usize, channel: Channel, band: usize) -> Option<Estimate> {
        self.captors.get(captor)?.row().per_area(channel, band)
    }

    /// Returns the value that is shown for a tile in a band or sum: the light at its place where
    /// that is known, otherwise the value of its captor; per area, W/m2 or umol/m2/s.
    pub fn value(
        &self,
        part: &TilePart,
        tile: usize,
        channel: Channel,
        band: usize,
    ) -> Option<f64> {
        let Some(local) = self.local(tile, channel) else {
            return Some(self.captor(part.captor?, channel, band)?.mean);
        };
        Some(match band.checked_sub(local.len()) {
            None => f64::from(local[band]),
            Some(sum) => {
                let weighted = self.scene.sums()[sum].weighted();
                weighted.map(|(b, weight)| weight * f64::from(local[b])).sum()
            }
        })
    }
}

/// Refuses a scene whose tiles would not fit into memory, before they are made.
fn check_tiles(scene: &Scene, most: usize) -> Result<()> {
    /// About the bytes that a tile takes while tiles are cut, with what finds corners in one place.
    const CUT: u64 = 200;
    /// The same where triangles are merged: corners and index, in lists that grow.
    const MERGED: u64 = 120;
    let all = scene.triangles().len() + scene.captor_tiles();
    let shared = scene.triangles().len() - scene.unshared();
    let merged = if all > most { shared.min(most.max(Tiles::least(scene))) } else { 0 };
    let cut = if merged > 0 { all - shared } else { all };
    let (bytes, left) = (CUT * cut as u64 + MERGED * merged as u64, machine::memory_left());
    if bytes <= left {
        return Ok(());
    }
    let problem = format!(
        "{} pieces of surfaces to show take {:.1} GiB of memory, of {:.1} that they may",
        cut + merged,
        machine::gib(bytes),
        machine::gib(left)
    );
    let remedy = "end other programs, or take fewer triangles, copies or captors";
    Err(Error::input("scene", problem).remedy(remedy))
}

/// Refuses a scene whose light would not fit into memory, before it is found: the light on the tiles
/// and, where the scene is run, the values of its captors and groups. (The run itself checks what it
/// needs.)
fn check_memory(
    scene: &Scene,
    tiles: &Tiles,
    settings: &Settings,
    plan: &RenderPlan,
) -> Result<()> {
    // a value and its error, and beside them those of the run's results that they are taken from
    const VALUE: usize = size_of::<f64>() + size_of::<Option<f64>>();
    const COPIES: usize = 3;
    let (bands, columns) = (scene.bands().len(), scene.band_names().count());
    let lights = if splits(scene) { scene.lights().len() } else { 0 };
    let channels = match plan {
        RenderPlan::Run => scene.channels() + scene.group_channels() * scene.groups().len(),
        RenderPlan::Results { .. } | RenderPlan::Photons => 0,
    };
    let by_photons = matches!(settings.estimator, Estimator::Photons | Estimator::Auto);
    let split = if by_photons { lights } else { 0 };
    let captors = COPIES * VALUE * channels * columns * (split + 1);
    let surfaces = tiles.parts.iter().filter(|part| part.material.is_some());
    let surfaces = surfaces.map(|part| part.tiles.len()).sum::<usize>();
    let each = match plan {
        RenderPlan::Run | RenderPlan::Results { trace: true, .. } => {
            bands * (CHANNELS.len() * size_of::<f32>() + 2 * lights)
        }
        RenderPlan::Results { .. } | RenderPlan::Photons => 0,
    };
    let on_tiles = surfaces as u64 * each as u64;
    // the photons are stored before the light on the tiles is read from them
    let [making, photons] = if each > 0 { map_bytes(scene, settings) } else { [0, 0] };
    let bytes = captors as u64 + making.max(photons + on_tiles);
    let left = machine::memory_left();
    if bytes <= left && on_tiles <= MOST_BYTES {
        return Ok(());
    }
    let problem = format!(
        "the light on {surfaces} pieces of surfaces and {} captors, in {bands} bands, takes {:.1} GiB of memory, of \
        {:.1} that it may",
        scene.captors().len(),
        machine::gib(if on_tiles > MOST_BYTES { on_tiles } else { bytes }),
        machine::gib(if on_tiles > MOST_BYTES { MOST_BYTES } else { left })
    );
    let remedy = "take fewer bands, triangles or captors, or store fewer photons (`map_photons` in the settings)";
    Err(Error::input("scene", problem).remedy(remedy))
}

fn source(photons: u64, of: impl Display, seed: u64) -> String {
    format!("{photons} {of}, seed {seed}")
}

/// Number of photons in the estimate for a tile, unless the scene sets it: an error of 6 %, which
/// looks even to the eye.
const NEAREST: usize = 300;
/// Limit on the memory for the light on surfaces, bytes.
const MOST_BYTES: u64 = 4 << 30;
/// Limit on the number of lights that are kept apart.
const MOST_LIGHTS: usize = 32;

/// Returns whether a scene has several lights, and not too many to keep apart.
fn splits(scene: &Scene) -> bool {
    (2..=MOST_LIGHTS).contains(&scene.lights().len())
}

/// Number of tiles between two looks at the stop flag.
const CHUNK: usize = 256;

/// Returns the light at the middle of each tile of a surface, by tile, channel and band, and, if
/// `split`, the shares of the lights in it, by tile, face, light and band. Errors: `control`
/// stopped the work; no threads can be started.
fn local(
    tiles: &Tiles,
    light: &SurfaceLight,
    split: bool,
    threads: usize,
    control: &Control,
) -> Result<(Vec<f32>, Vec<u8>)> {
    let bands = light.scene.bands().len();
    let surfaces = tiles.parts.iter().filter(|part| part.material.is_some());
    let count = surfaces.map(|part| part.tiles.end).max().unwrap_or(0);
    let each = CHANNELS.len() * bands;
    let shares_each = if split { 2 * light.scene.lights().len() * bands } else { 0 };
    let mut values = vec![0.0; count * each];
    let mut shares = vec![0; count * shares_each];
    let pool = machine::pool(threads)?;
    let done = AtomicU64::new(0);
    let tile = |tile: usize, values: &mut [f32], shares: &mut [u8]| {
        let triangle = tiles.triangles[tile] as usize;
        let point = tiles.corners[tile].centroid();
        for (face, front) in [true, false].into_iter().enumerate() {
            let into = &mut values[face * bands..][..bands];
            if !split {
                let found = light.irradiance(triangle, front, point);
                into.iter_mut().zip(found).for_each(|(into, value)| *into = value as f32);
                continue;
            }
            let found = light.irradiance_by_light(triangle, front, point);
            let shares = &mut shares[face * found.len()..][..found.len()];
            for (band, into) in into.iter_mut().enumerate() {
                let sum: f64 = found.iter().skip(band).step_by(bands).sum();
                *into = sum as f32;
                let own = shares.iter_mut().zip(&found).skip(band).step_by(bands);
                own.filter(|_| sum > 0.0)
                    .for_each(|(share, value)| *share = (255.0 * value / sum).round() as u8);
            }
        }
        let absorbed = values[2 * bands..].iter_mut().zip(light.absorbed(triangle, point));
        absorbed.for_each(|(into, value)| *into = value as f32);
    };
    let all = || {
        let work = |chunk: usize, values: &mut [f32], shares: &mut [u8]| {
            if control.stop.load(Ordering::Relaxed) {
                return;
            }
            for (i, values) in values.chunks_mut(each).enumerate() {
                tile(chunk * CHUNK + i, values, &mut shares[i * shares_each..][..shares_each]);
            }
            let photons = done.fetch_add(CHUNK as u64, Ordering::Relaxed);
            (control.progress)(Progress { photons, of: Some(count as u64), worst: None });
        };
        let chunks = values.par_chunks_mut(CHUNK * each).enumerate();
        if split {
            let shares = shares.par_chunks_mut(CHUNK * shares_each);
            chunks.zip(shares).for_each(|((chunk, values), shares)| work(chunk, values, shares));
        } else {
            chunks.for_each(|(chunk, values)| work(chunk, values, &mut []));
        }
        Ok(())
    };
    catch_panic("run", || pool.install(all))?;
    if control.stop.load(Ordering::Relaxed) {
        return Err(Error::interrupted("run", NOTHING_WRITTEN));
    }
    Ok((values, shares))
}
