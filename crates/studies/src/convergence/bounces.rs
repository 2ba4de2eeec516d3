//! How often light is scattered before it arrives at the captors.

use std::sync::atomic::Ordering;

use serde::{Deserialize, Serialize};

use phylux_core::{
    error::{Error, NOTHING_WRITTEN, Result},
    math::{
        rng::{Purpose, Streams},
        spectrum::{Lanes, with_lanes},
    },
    scene::{light::Strata, world::Scene},
    transport::{
        settings::Settings,
        simulate::Control,
        trace::{Event, trace},
    },
};

/// Numbers of bounces up to which light is summed.
const LIMITS: [u32; 24] =
    [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 12, 15, 20, 25, 30, 40, 50, 70, 100, 200, 500, 1000, 10_000];

/// The light that arrives on captors, by the number of bounces.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Bounces {
    /// Number of photons traced.
    pub photons: u64,
    /// One row for each number of bounces, in rising order, up to the first within which all light
    /// has arrived.
    pub rows: Vec<Within>,
}

/// Light that arrives within a number of bounces.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Within {
    /// Largest number of interactions with surfaces on the way; 0 is light straight from a lamp.
    pub bounces: u32,
    /// Fraction of all light on captors, over all bands, in [0, 1].
    pub share: f64,
    /// Relative root mean square of the missing light, over captors, faces and bands.
    pub error: f64,
    /// Standard error of the share that is missing, as if arrivals were independent; `None` in
    /// studies of before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub share_se: Option<f64>,
    /// What noise alone contributes to `error`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<f64>,
}

impl Bounces {
    /// Traces `photons` of `scene`. Error: stopped by `control`.
    pub fn count(scene: &Scene, photons: u64, control: &Control) -> Result<Self> {
        with_lanes!(scene.lanes(), L => count::<L>(scene, photons, control))
    }

    /// Returns the first number of bounces within which this share of the light arrives.
    pub fn within(&self, share: f64) -> Option<u32> {
        self.rows.iter().find(|row| row.share >= share).map(|row| row.bounces)
    }
}

fn count<L: Lanes>(scene: &Scene, photons: u64, control: &Control) -> Result<Bounces> {
    let bands = scene.bands().len();
    let width = scene.channels() * bands;
    let mut sums = vec![vec![Sum::default(); width]; LIMITS.len()];
    let strata = Strata::new(scene.lights(), photons, scene.lanes());
    let streams = Streams::new(Settings::default().seed, Purpose::Bounces, 0);
    for index in 0..photons {
        if control.stop.load(Ordering::Relaxed) {
            return Err(Error::interrupted("chart", NOTHING_WRITTEN));
        }
        let mut rng = streams.history(index);
        let photon = scene.emit::<L>(&strata, index, &mut rng);
        let mut bounces = 0;
        trace(scene, photon.ray, photon.power, (), &mut rng, |event| {
            if let Some(counted) = event.counted(scene) {
                let first = counted.channel() * bands;
                let power = counted.power.values();
                let row = &mut sums[LIMITS.partition_point(|limit| *limit < bounces)];
                for b in 0..bands {
                    let arrived = f64::from(power[b]) * photon.weights[b];
                    row[first + b].light += arrived;
                    row[first + b].squares += arrived * arrived;
                }
            }
            bounces += u32::from(matches!(event, Event::Arrival { .. }));
        });
    }
    Ok(Bounces { photons, rows: cumulated(&sums) })
}

/// Light that arrived, and the sum of the squares of what arrived at once.
#[derive(Clone, Copy, Default)]
struct Sum {
    light: f64,
    squares: f64,
}

/// Turns the sums of each number of bounces into sums within that number.
fn cumulated(sums: &[Vec<Sum>]) -> Vec<Within> {
    let width = sums[0].len();
    let total = |of: fn(&Sum) -> f64| -> Vec<f64> {
        (0..width).map(|i| sums.iter().map(|row| of(&row[i])).sum()).collect()
    };
    let (whole, mut beyond) = (total(|sum| sum.light), total(|sum| sum.squares));
    let lit = whole.iter().filter(|sum| **sum > 0.0).count().max(1) as f64;
    let all: f64 = whole.iter().sum();
    let mut so_far = vec![0.0; width];
    let mut rows = Vec::new();
    for (row, bounces) in sums.iter().zip(LIMITS) {
        so_far.iter_mut().zip(row).for_each(|(sum, new)| *sum += new.light);
        beyond.iter_mut().zip(row).for_each(|(sum, new)| *sum = (*sum - new.squares).max(0.0));
        let missing = so_far.iter().zip(&whole).filter(|(_, whole)| **whole > 0.0);
        let squares: f64 = missing.map(|(sum, whole)| (1.0 - sum / whole).powi(2)).sum();
        let noise = beyond.iter().zip(&whole).filter(|(_, whole)| **whole > 0.0);
        let noise: f64 = noise.map(|(squares, whole)| squares / whole.powi(2)).sum();
        let share = if all > 0.0 { so_far.iter().sum::<f64>() / all } else { 1.0 };
        let share_se = if all > 0.0 { beyond.iter().sum::<f64>().sqrt() / all } else { 0.0 };
        rows.push(Within {
            bounces,
            share,
            error: (squares / lit).sqrt(),
            share_se: Some(share_se),
            noise: Some((noise / lit).sqrt()),
        });
        if share >= 1.0 - 1e-9 {
            break;
        }
    }
    rows
}
