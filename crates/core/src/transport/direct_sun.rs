//! Direct and mirrored sunlight on captors, found by shadow rays.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec3;

use crate::{
    math::{
        rng::{Purpose, Streams},
        spectrum::{Lanes, Spectrum, with_lanes},
    },
    scene::{
        captor::{Captor, CaptorKind, Channel},
        daylight::InfiniteLight,
        world::Scene,
    },
    transport::paths::Face,
};

/// Number of random numbers that a shadow ray takes.
const NUMBERS: u32 = 8;

/// The points of a captor from which each sun is looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SunRays {
    /// Number of sets, the spread of which gives the standard error.
    sets: u64,
    /// Number of points of a set, which are spread evenly.
    points: u64,
}

impl SunRays {
    /// The least and the most points.
    pub const RANGE: std::ops::RangeInclusive<u64> = 2..=65_536;
    /// The least where the light of single hours is asked for: their errors rest on these points
    /// alone, while sums have those of all their hours.
    const LEAST_BY_HOUR: u64 = 4;
    /// Number of points unless there are very many captors, or few.
    const USUAL: u64 = 16;
    /// The most points where there are few, and the number of points of all captors and suns that is
    /// then not exceeded: they take a few seconds.
    const PLENTY: u64 = 256;
    const CHEAP: u64 = 4_000_000;
    /// Number of captors up to which that many are taken, and the number of points of all captors
    /// and suns that is not exceeded with more captors.
    const CAPTORS: u64 = 5_000;
    const MOST: u64 = 1_000_000_000;

    /// Takes about that many points: a multiple of 8; of 4 if it is below 16, and 2 below 4.
    pub fn new(points: u64) -> Self {
        let points = points.clamp(*Self::RANGE.start(), *Self::RANGE.end());
        let sets = match points {
            ..4 => 2,
            4..Self::USUAL => 4,
            _ => 8,
        };
        Self { sets, points: points / sets }
    }

    /// Takes as many points as so many captors and suns allow. `by_hour` says whether the light of
    /// single hours on captors is asked for, or only that of days and groups.
    pub fn usual(captors: usize, suns: usize, by_hour: bool) -> Self {
        let pairs = (captors as u64).saturating_mul(suns as u64).max(1);
        let least = if by_hour { Self::LEAST_BY_HOUR } else { *Self::RANGE.start() };
        Self::new(match captors as u64 <= Self::CAPTORS {
            true => (Self::CHEAP / pairs).clamp(Self::USUAL, Self::PLENTY),
            false => (Self::MOST / pairs).clamp(least, Self::USUAL),
        })
    }

    /// Returns the number of points.
    pub fn count(self) -> u64 {
        self.sets * self.points
    }

    /// Returns how many of the points of a set, the first ones, look for faint images of the sun: half
    /// of them, which are spread evenly, too.
    fn looks(self) -> u64 {
        self.points.div_ceil(2)
    }

    /// Returns how many points each of these counts for.
    fn looks_count_for(self) -> f32 {
        self.points as f32 / self.looks() as f32
    }
}

/// Returns the light that the suns of each of some lights at infinity bring to a captor, straight,
/// through thin panes or by way of one flat pane or mirror: for each light a row of values with
/// their standard errors. A row holds, for each of the first `channels` channels, the bands and then
/// the sums over bands, W/m2 (absorbed light per area of the captor), and at its end the fraction of
/// the captor's area that has a straight path to the sun. Channels that the captor does not have are
/// 0. The same seed gives the same rows. Once `stop` is set, the rows that are missing stay 0.
pub fn direct_sun(
    scene: &Scene,
    captor: usize,
    channels: usize,
    lights: &[InfiniteLight],
    seed: u64,
    rays: SunRays,
    stop: &AtomicBool,
) -> Vec<[f32; 2]> {
    with_lanes!(scene.lanes(), L => of_captor::<L>(scene, captor, channels, lights, seed, rays, stop))
}

/// Returns the normal of the disc that a captor is, or else those of its triangles.
fn normals(scene: &Scene, captor: &Captor) -> Vec<Vec3> {
    match scene.round(captor).and_then(|round| round.normal) {
        Some(normal) => vec![normal.as_vec3()],
        None => scene.triangles_of(captor).iter().map(|triangle| triangle.normal()).collect(),
    }
}

fn of_captor<L: Lanes>(
    scene: &Scene,
    captor: usize,
    channels: usize,
    lights: &[InfiniteLight],
    seed: u64,
    rays: SunRays,
    stop: &AtomicBool,
) -> Vec<[f32; 2]> {
    let kind = scene.captors()[captor].kind;
    let faces: Vec<Face> = kind.faces().iter().map(|&c| Face::new(scene, captor, c)).collect();
    let streams = Streams::new(seed, Purpose::DirectSun, captor as u64);
    let (bands, columns) = (scene.bands().len(), scene.bands().len() + scene.sums().len());
    // a captor with a back, a sphere, and one before a mirror may get the light of any sun
    let of = &scene.captors()[captor];
    let from_anywhere = faces.len() > 1 || scene.flat_mirrors().is_some() || of.sensor.is_sphere;
    let normals = if from_anywhere { Vec::new() } else { normals(scene, of) };
    let row = channels * columns + 1;
    let mut rows = vec![[0.0; 2]; lights.len() * row];
    let (mut found, mut sums) = (vec![[0.0; 2]; row], vec![0.0; row]);
    for (l, (light, out)) in lights.iter().zip(rows.chunks_mut(row)).enumerate() {
        if stop.load(Ordering::Relaxed) {
            break;
        }
        if !from_anywhere && !normals.iter().any(|normal| light.may_shine_on(*normal)) {
            continue;
        }
        found.fill([0.0; 2]);
        for set in (0..rays.sets).map(|set| l as u64 * rays.sets + set) {
            let sequence = streams.sequence(set);
            sums.fill(0.0);
            let mut add = |channel: Channel, light: &Spectrum<L>| {
                let sums = sums[channel as usize * columns..][..bands].iter_mut();
                sums.zip(light.values()).for_each(|(sum, value)| *sum += f64::from(*value));
            };
            let mut straight = 0.0;
            for point in 0..rays.points {
                let faint = if point < rays.looks() { rays.looks_count_for() } else { 0.0 };
                let rng = streams.history(set * rays.points + point);
                let mut rng = rng.with_sobol(sequence, point, NUMBERS);
                let Some(beam) = faces[0].sunbeam::<L>(light, &mut rng) else { continue };
                for face in &faces {
                    let Some(sunlight) = face.direct(&beam, faint, &mut rng) else { continue };
                    add(face.channel, &sunlight.irradiance);
                    straight += f64::from(u8::from(sunlight.is_straight));
                    if kind == CaptorKind::Surface {
                        add(Channel::Absorbed, &sunlight.absorbed);
                    }
                }
            }
            for sums in sums.chunks_exact_mut(columns) {
                let (of_bands, of_sums) = sums.split_at_mut(bands);
                for (value, sum) in of_sums.iter_mut().zip(scene.sums()) {
                    *value = sum.of(of_bands);
                }
            }
            sums[row - 1] = straight;
            for ([sum, squares], value) in found.iter_mut().zip(&sums) {
                let value = value / rays.points as f64;
                *sum += value;
                *squares += value * value;
            }
        }
        let n = rays.sets as f64;
        for (out, [sum, squares]) in out.iter_mut().zip(&found) {
            let mean = sum / n;
            let variance = ((squares / n - mean * mean) / (n - 1.0)).max(0.0);
            *out = [mean as f32, variance.sqrt() as f32];
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_captors_have_more_rays_and_very_many_fewer() {
        let count = |captors, suns| SunRays::usual(captors, suns, true).count();
        assert_eq!([count(1, 1), count(15, 480), count(3, 4_170)], [256; 3]);
        assert_eq!(count(15, 4_170), 56);
        assert_eq!([count(400, 4_170), count(5_000, 4_170), count(10_000, 4_170)], [16; 3]);
        assert_eq!(count(25_000, 4_170), 8);
        assert_eq!([count(100_000, 4_170), count(usize::MAX, usize::MAX)], [4; 2]);
        let of_days = |captors| SunRays::usual(captors, 4_170, false).count();
        assert_eq!([5_000, 25_000, 100_000, usize::MAX].map(of_days), [16, 8, 2, 2]);
        let asked = [0, 3, 5, 12, 16, 20, 64].map(|n| SunRays::new(n).count());
        assert_eq!(asked, [2, 2, 4, 12, 16, 16, 64]);
    }
}
