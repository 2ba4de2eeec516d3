//! Direct and mirrored sunlight on captors, found by shadow rays.

use std::{
    ops::Range,
    sync::atomic::{AtomicBool, Ordering},
};

use rayon::prelude::*;

use crate::{
    math::{
        rng::{Purpose, Streams},
        spectrum::{Lanes, Spectrum, with_lanes},
    },
    scene::{
        captor::{CHANNELS, Captor, CaptorKind, Channel},
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

/// Number of points of each captor for its sunlit share, up to [`SunRays::CAPTORS`] captors; at least
/// one in each of [`SETS`] sets.
const SHARE_POINTS: u64 = 64;

/// Returns the fraction of each captor's area that has a straight path to the sun, also through thin
/// panes, by one of its faces, or by the front of a sensor that counts one side; with its
/// [standard error](error_of_share). The scene has one sun. The same seed gives the same values on any
/// number of threads. `None` if no sun is there, or if there are several.
pub fn sunlit_shares(scene: &Scene, seed: u64) -> Option<Vec<[f64; 2]>> {
    let light = only_sun(scene)?;
    let captors = scene.captors().len() as u64;
    let points = (SHARE_POINTS * SunRays::CAPTORS / captors.max(1)).min(SHARE_POINTS);
    let rays = SunRays { sets: SETS, points: (points / SETS).max(1) };
    let (channels, never) = (CHANNELS.len(), AtomicBool::new(false));
    let share = |captor: usize| {
        let light = std::slice::from_ref(light);
        let row = direct_sun(scene, captor, channels, light, seed, rays, &never);
        let [mean, error] = row.last().map_or([0.0; 2], |pair| pair.map(f64::from));
        [mean, error_of_share(error, rays.count() as f64)]
    };
    Some((0..scene.captors().len()).into_par_iter().map(share).collect())
}

/// Returns the light that is the scene's one sun; `None` if no sun is there, or several are.
fn only_sun(scene: &Scene) -> Option<&InfiniteLight> {
    let mut suns = scene.infinite_lights().filter(|(_, light)| light.suns() > 0);
    let (_, light) = suns.next().filter(|(_, light)| light.suns() == 1)?;
    suns.next().is_none().then_some(light)
}

/// Number of sets of points whose spread gives the error of a sunlit share.
const SETS: u64 = 8;
/// The interval of 95 % by Student's distribution for so many sets, over that for the 128 batches of a
/// run: 2.365 / 1.979.
const WIDER: f64 = 1.195;

/// Returns the standard error of a share of so many points in [`SETS`] sets, whose spread gives the
/// error `spread` of their mean. The spread of so few is not well known itself, so that the error is
/// larger by as much as the interval is wider. And where all sets agree by chance, one more point may
/// still differ, as one more history may [miss](crate::math::stats::Estimate::with_misses).
fn error_of_share(spread: f64, points: f64) -> f64 {
    (WIDER * spread).hypot(1.0 / points)
}

/// Number of points for the sunlit shares of layers in each of [`SETS`] sets.
const LAYER_SETS: usize = SETS as usize;
const LAYER_POINTS: f64 = 16_384.0;

/// Returns the fraction of the leaves of each layer, by area, that has a straight path to the sun,
/// also through thin panes, by either face; with its [standard error](error_of_share). The points are
/// spread evenly over all leaves of the scene, which has one sun. The same seed gives the same values
/// on any number of threads. `None` for a layer in which no point lies; for the whole if the scene has
/// no layers or not one sun.
pub fn sunlit_layers(scene: &Scene, seed: u64) -> Option<Vec<Option<[f64; 2]>>> {
    let mut layers = vec![[[0u64; 2]; LAYER_SETS]; scene.stand().layers.as_ref()?.areas.len()];
    let sun = only_sun(scene)?;
    let of_leaves = |captor: &Captor| match captor.kind {
        CaptorKind::Surface if !scene.is_ground(captor.triangles.start) => captor.area,
        _ => 0.0,
    };
    let mut end = 0.0;
    let areas: Vec<_> = scene
        .captors()
        .iter()
        .map(|captor| {
            let start = end;
            end += of_leaves(captor);
            start..end
        })
        .collect();
    // in each set the points of a captor are those multiples of one share of the area, from another
    // start in each set, that lie in its range
    let before = |set: usize, area: f64| {
        (LAYER_POINTS * area / end + set as f64 / LAYER_SETS as f64).floor() as u64
    };
    let of_captor = |(captor, area): (usize, &Range<f64>)| {
        let points = std::array::from_fn(|set| before(set, area.end) - before(set, area.start));
        with_lanes!(scene.lanes(), L => in_layers::<L>(scene, captor, sun, seed, points))
    };
    let found: Vec<_> = areas.par_iter().enumerate().map(of_captor).collect();
    for (set, layer, is_sunlit) in found.into_iter().flatten() {
        let [points, sunlit] = &mut layers[layer][set];
        *points += 1;
        *sunlit += u64::from(is_sunlit);
    }
    Some(layers.iter().map(share_of).collect())
}

/// Looks for the sun from so many points of a captor in each set. Returns for each point that counts
/// in a layer its set, the layer, and whether the sun shines there.
fn in_layers<L: Lanes>(
    scene: &Scene,
    captor: usize,
    sun: &InfiniteLight,
    seed: u64,
    points: [u64; LAYER_SETS],
) -> Vec<(usize, usize, bool)> {
    if points == [0; LAYER_SETS] {
        return Vec::new();
    }
    let faces = [Channel::Front, Channel::Back].map(|face| Face::new(scene, captor, face));
    let streams = Streams::new(seed, Purpose::DirectSun, captor as u64);
    let look = |set: usize, point: u64| {
        let rng = streams.history(point * LAYER_SETS as u64 + set as u64);
        let mut rng = rng.with_sobol(streams.sequence(set as u64), point, NUMBERS);
        let beam = faces[0].sunbeam::<L>(sun, &mut rng)?;
        Some((set, faces[0].layer_of(&beam)?, faces.iter().any(|face| face.is_sunlit(&beam))))
    };
    let all = (0..LAYER_SETS).flat_map(|set| (0..points[set]).map(move |point| (set, point)));
    all.filter_map(|(set, point)| look(set, point)).collect()
}

/// Returns the share of points in the sun by the counts of several sets, with its standard error.
fn share_of(sets: &[[u64; 2]; LAYER_SETS]) -> Option<[f64; 2]> {
    let sets = sets.map(|counts| counts.map(|count| count as f64));
    let [points, sunlit] =
        sets.iter().fold([0.0; 2], |[a, b], [points, sunlit]| [a + points, b + sunlit]);
    let share = sunlit / points;
    let squares: f64 = sets.iter().map(|[points, sunlit]| (sunlit - share * points).powi(2)).sum();
    let n = LAYER_SETS as f64;
    let spread = (squares * n / (n - 1.0)).sqrt();
    (points > 0.0).then(|| [share, error_of_share(spread / points, points)])
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
    let normals: Vec<_> = match from_anywhere {
        true => Vec::new(),
        false => {
            let disc = scene.round(of).and_then(|round| round.normal);
            match disc {
                Some(normal) => vec![normal.as_vec3()],
                None => scene.triangles_of(of).iter().map(|t| t.normal()).collect(),
            }
        }
    };
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
            let mut sunlit = 0.0;
            for point in 0..rays.points {
                let faint = if point < rays.looks() { rays.looks_count_for() } else { 0.0 };
                let rng = streams.history(set * rays.points + point);
                let mut rng = rng.with_sobol(sequence, point, NUMBERS);
                let Some(beam) = faces[0].sunbeam::<L>(light, &mut rng) else { continue };
                for face in &faces {
                    let Some(sunlight) = face.direct(&beam, faint, &mut rng) else { continue };
                    add(face.channel, &sunlight.irradiance);
                    sunlit += f64::from(u8::from(sunlight.is_straight));
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
            sums[row - 1] = sunlit;
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
    use crate::math::stats::student_half_width;

    #[test]
    fn the_interval_of_few_sets_is_wider() {
        let width = |sets: f64| student_half_width(sets - 1.0, 0.95);
        assert!((width(SETS as f64) / width(128.0) - WIDER).abs() < 1e-3);
    }

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
