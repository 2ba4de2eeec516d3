//! How even pictures are where the light is even: the greenhouse as it is drawn by default,
//! compared with long runs.

use std::path::Path;

use phylux::{
    Control, LoadedScene, Settings,
    show::{Gather, Sampling, Show, Viewpoint, render},
    transport::{MapLimit, NearestCount},
};

const WIDTH: usize = 800;
const HEIGHT: usize = 600;
/// A place is flat if this many pixels to each side show the same flat piece of surface.
const FLAT: usize = 6;
/// The level of light at a pixel is the mean over this many pixels to each side.
const LEVEL: usize = 2;
/// Light is even at a place if the highest level around it is less than this many times the lowest.
const EVEN: f32 = 1.25;
/// A place is lit if its level is above this fraction of the mean over the picture.
const LIT: f32 = 0.1;
/// Side of the blocks whose means are compared, in pixels.
const BLOCK: usize = 32;

/// The first band of a picture, as found and denoised.
struct Drawn {
    plain: Vec<f32>,
    even: Vec<f32>,
}

fn drawn(
    loaded: &LoadedScene,
    viewpoint: &Viewpoint,
    show: Show,
    rays: u32,
    settings: Settings,
) -> Drawn {
    let control = Control::default();
    let light = phylux::transport::light_surfaces(&loaded.scene, &settings, &control);
    let light = light.unwrap_or_else(|e| panic!("{e}"));
    let gather = Gather::new(&light, 1, &settings, &control).unwrap_or_else(|e| panic!("{e}"));
    let sampling = Sampling { rays, before: 0, seed: settings.seed, threads: 0 };
    let found = render(&light, Some(&gather), viewpoint, show, sampling, &control);
    let found = found.unwrap_or_else(|e| panic!("{e}"));
    let even = found.denoised(&[0], 0).unwrap_or_else(|e| panic!("{e}"));
    let first = |pixels: phylux::show::Pixels| {
        (0..WIDTH * HEIGHT).map(|i| pixels.pixel(i)[0]).collect::<Vec<f32>>()
    };
    Drawn { plain: first(found.pixels()), even: first(even.pixels()) }
}

/// Returns the pixels at most `reach` from a pixel, which must be at least as far from the
/// picture's edges.
fn about(pixel: usize, reach: usize) -> impl Iterator<Item = usize> {
    let first = pixel - reach * WIDTH - reach;
    let side = 2 * reach + 1;
    (0..side * side).map(move |i| first + i / side * WIDTH + i % side)
}

/// Returns the pixels around which only a flat piece of an opaque surface is visible.
fn flat(viewpoint: &Viewpoint) -> Vec<usize> {
    let scene = viewpoint.scene;
    let piece = |i: usize| {
        let ray = viewpoint.camera.ray((i % WIDTH) as f32 + 0.5, (i / WIDTH) as f32 + 0.5);
        let hit = viewpoint.closest(&ray)?;
        // not behind a pane
        let seen = viewpoint.opaque(&ray)?.triangle == hit.triangle;
        let surface = &scene.surface(hit.triangle);
        seen.then_some((surface.material, surface.normal))
    };
    let pieces: Vec<_> = (0..WIDTH * HEIGHT).map(piece).collect();
    let same = |i: usize, j: usize| match (pieces[i], pieces[j]) {
        (Some((material, normal)), Some((other, slope))) => {
            material == other && normal.dot(slope) > 0.9999
        }
        _ => false,
    };
    let margin = FLAT + LEVEL;
    let inner = (margin..HEIGHT - margin)
        .flat_map(|y| (margin..WIDTH - margin).map(move |x| y * WIDTH + x));
    inner.filter(|&i| about(i, FLAT).all(|j| same(i, j))).collect()
}

/// The levels of light that two long runs find, and the pixels where surfaces are flat and evenly
/// lit.
struct Truth {
    runs: [Vec<f32>; 2],
    places: Vec<usize>,
}

impl Truth {
    fn new(runs: [Vec<f32>; 2], flat: &[usize]) -> Self {
        let runs = runs.map(|run| {
            let mut level = vec![0.0; run.len()];
            for y in LEVEL..HEIGHT - LEVEL {
                for x in LEVEL..WIDTH - LEVEL {
                    let i = y * WIDTH + x;
                    let pixels = (2 * LEVEL + 1) * (2 * LEVEL + 1);
                    level[i] = about(i, LEVEL).map(|j| run[j]).sum::<f32>() / pixels as f32;
                }
            }
            level
        });
        let level = |i: usize| runs[0][i] + runs[1][i];
        let mean = (0..runs[0].len()).map(level).sum::<f32>() / runs[0].len() as f32;
        let even = |&i: &usize| {
            let levels = || about(i, FLAT).map(level);
            let (least, most) =
                (levels().fold(f32::INFINITY, f32::min), levels().fold(0.0, f32::max));
            least > LIT * mean && most < EVEN * least
        };
        let places = flat.iter().copied().filter(even).collect();
        Self { runs, places }
    }

    /// Returns the relative difference of a picture from the truth: the root mean square over
    /// pixels, that over means of blocks, and the mean. The products of both runs' differences
    /// contain no noise of these runs, because it is independent.
    fn off(&self, picture: &[f32]) -> [f64; 3] {
        let [a, b] = &self.runs;
        let (mut squares, mut sum) = (0.0, 0.0);
        let mut blocks = std::collections::BTreeMap::<usize, [f64; 4]>::new();
        for &i in &self.places {
            let off = |run: &[f32]| f64::from(picture[i] / run[i]) - 1.0;
            squares += off(a) * off(b);
            sum += 0.5 * (off(a) + off(b));
            let block = blocks.entry(i / WIDTH / BLOCK * WIDTH + i % WIDTH / BLOCK).or_default();
            let values = [1.0, picture[i], a[i], b[i]].map(f64::from);
            block.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        }
        let half = (BLOCK * BLOCK / 2) as f64;
        let whole: Vec<f64> = blocks
            .values()
            .filter(|[pixels, ..]| *pixels >= half)
            .map(|[_, p, a, b]| (p / a - 1.0) * (p / b - 1.0))
            .collect();
        let pixels = self.places.len() as f64;
        let of_blocks = whole.iter().sum::<f64>() / whole.len() as f64;
        [(squares / pixels).max(0.0).sqrt(), of_blocks.max(0.0).sqrt(), sum / pixels]
    }
}

/// Blotches in denoised pictures of the greenhouse (800 x 600, the options of `phylux render`, seed
/// 1, PAR) are below 4 %. Found were 2.8 % for radiance and 2.7 % for irradiance; the goal is 2 %.
/// A blotch is the root mean square of the difference from two long runs (four times the photons, k
/// 400, and 24 rays a pixel, not denoised, means over 5 x 5 pixels; seeds 101 and 102), over flat,
/// opaque, lit surfaces where the light differs by less than a quarter over 13 x 13 pixels.
#[test]
#[ignore = "takes minutes: .ci/nightly runs it"]
fn nightly_blotches_of_pictures() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/greenhouse.json");
    let loaded = phylux::load(&scene).unwrap_or_else(|e| panic!("{e}"));
    let mut view = loaded.view.expect("a camera");
    (view.width, view.height) = (WIDTH, HEIGHT);
    let viewpoint = Viewpoint::new(&loaded.scene, &view).unwrap_or_else(|e| panic!("{e}"));
    let flat = flat(&viewpoint);
    let usual = Settings { photons: None, k: None, ..loaded.settings.clone() };
    let mut blotches = Vec::new();
    for (show, name) in [(Show::Radiance, "radiance"), (Show::Irradiance, "irradiance")] {
        let long = |seed| {
            let settings = Settings {
                seed,
                map_photons: MapLimit::nearest_to(8_000_000),
                k: NearestCount::new(400).ok(),
                ..usual.clone()
            };
            drawn(&loaded, &viewpoint, show, 24, settings).plain
        };
        let truth = Truth::new([long(101), long(102)], &flat);
        let settings = Settings { seed: 1, ..usual.clone() };
        let picture = drawn(&loaded, &viewpoint, show, 6, settings);
        for (what, picture) in [("evened out", &picture.even), ("as found", &picture.plain)] {
            let [pixels, blocks, mean] = truth.off(picture).map(|off| 100.0 * off);
            let places = truth.places.len();
            println!(
                "{name}, {what}: {pixels:.2} % over {places} pixels, {blocks:.2} % over blocks, mean {mean:.2} %"
            );
        }
        blotches.push(truth.off(&picture.even)[0]);
    }
    assert!(blotches.iter().all(|blotches| *blotches < 0.04), "{blotches:?}");
}
