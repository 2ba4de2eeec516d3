//! Tests of how histories are shared among lights.

use glam::DVec3;

use super::{
    super::{Cone, Lamp},
    *,
};
use crate::math::geometry::Extent;

fn lights(powers: &[f64]) -> Vec<Light> {
    // two bands, of which the largest decides
    let light = |&p: &f64| {
        let lamp = Lamp::new([0.3 * p, p], Cone::point(DVec3::ZERO)).into();
        Light::new("lamp".into(), lamp, 2, DVec3::ZERO, &Extent::EMPTY.into())
    };
    powers.iter().map(light).collect()
}

/// Returns powers that are alike, very unlike, zero, and many.
fn mixtures() -> Vec<Vec<f64>> {
    let mut rng = Stream::new(5, 0, 0);
    let mut mixtures = vec![
        vec![1.0],
        vec![1.0; 7],
        vec![1.0, 1e-8],
        vec![100.0, 1e-6, 0.0, 50.0],
        vec![0.0, 0.0, 0.0],
        vec![1e8, 1.0, 1.0, 1e-8],
    ];
    for n in [2, 5, 40, 300] {
        let power = |_| 10f64.powf(4.0 * f64::from(rng.uniform()));
        mixtures.push((0..n).map(power).collect());
    }
    mixtures
}

/// For any mixture of lights and number of histories: the counts add up and are at least one each.
/// They are in proportion to the powers to one history, and not below 1 % / lights (all counts
/// raised to that take at most 1 % of the others). Each light appears exactly as often as its
/// count, and the weights add up to the powers.
#[test]
fn strata_are_exact() {
    for powers in mixtures() {
        let (n, total) = (powers.len() as u64, powers.iter().sum::<f64>());
        for histories in [n, n + 1, 2 * n + 3, 100, 997, 1 << 12, 7_813, 78_125] {
            if histories < n {
                continue;
            }
            let strata = Strata::new(&lights(&powers), histories, 4);
            assert_eq!(strata.histories(), histories);
            let mut counts = vec![0u64; powers.len()];
            for index in 0..histories {
                counts[strata.source(index)] += 1;
            }
            let least = 0.01 / n as f64;
            for (l, &count) in counts.iter().enumerate() {
                let what = format!("light {l} of {powers:?}: {count} of {histories}");
                assert_eq!(count, strata.first[l + 1] - strata.first[l], "{what}");
                assert!(count >= 1, "{what}");
                let exact = [0.3 * powers[l], powers[l], 0.0, 0.0];
                for (weight, power) in strata.weights(l).iter().zip(exact) {
                    let emitted = count as f64 * weight / histories as f64;
                    assert!((emitted - power).abs() <= 1e-12 * power, "{what}: {emitted}");
                }
                // with few histories, the minimum of one each takes some from the other lights
                if histories >= 200 * n {
                    let share = if total > 0.0 { powers[l] / total } else { 1.0 / n as f64 };
                    let due = share.max(least) * histories as f64;
                    assert!((due / 1.01 - 1.0..=due + 1.0).contains(&(count as f64)), "{what}");
                }
            }
        }
    }
}

/// In any run of neighbouring histories each light has its share to within 8 histories, whether the
/// run starts with the first history or not (the discrepancy of a golden sequence grows with the
/// logarithm).
#[test]
fn neighbouring_histories_have_each_lights_share() {
    for powers in mixtures() {
        for histories in [500, 997, 1 << 12, 7_813, 78_125] {
            let strata = Strata::new(&lights(&powers), histories, 2);
            let share =
                |l: usize| (strata.first[l + 1] - strata.first[l]) as f64 / histories as f64;
            let mut ahead = vec![0.0f64; powers.len()];
            let mut range = vec![[0.0f64; 2]; powers.len()];
            let shares: Vec<f64> = (0..powers.len()).map(share).collect();
            for index in 0..histories {
                ahead[strata.source(index)] += 1.0;
                // how far each light is ahead of its share after so many histories
                if powers.len() <= 7 || index % 64 == 0 {
                    for l in 0..powers.len() {
                        let lead = ahead[l] - shares[l] * (index + 1) as f64;
                        range[l] = [range[l][0].min(lead), range[l][1].max(lead)];
                    }
                }
            }
            for [low, high] in range {
                assert!(high - low < 8.0, "{powers:?}, {histories}: {low} to {high}");
            }
        }
    }
}

#[test]
fn golden_stride_visits_every_rank() {
    for n in 1..=5_000 {
        let stride = golden_stride(n);
        assert_eq!(gcd(stride, n), 1, "{n}");
        let golden = 0.618 * n as f64;
        assert!((stride as f64) > golden - 1.0 && (stride as f64) < golden + 12.0, "{n}: {stride}");
    }
}

/// Beyond 2^32 histories the product of an index and the stride exceeds 64 bits. Ranks are odd about
/// zero modulo the number of histories, so that those of the last histories follow from those of the
/// first, whose products are small.
#[test]
fn more_than_2_to_the_32_histories() {
    for histories in [(1u64 << 32) + 1, (1 << 34) + 7, 1 << 45] {
        let strata = Strata::new(&lights(&[1.0, 2.0, 1.0]), histories, 4);
        assert_eq!(strata.histories(), histories);
        let mut counts = [0u32; 3];
        for index in 1..=4_000 {
            let rank = histories - index * strata.stride % histories;
            let expected = (0..3).rfind(|&s| strata.first[s] <= rank).unwrap();
            let source = strata.source(histories - index);
            assert_eq!(source, expected, "history {index} from the end of {histories}");
            counts[source] += 1;
        }
        for (count, share) in counts.into_iter().zip([1_000, 2_000, 1_000]) {
            assert!(count.abs_diff(share) < 8, "{counts:?} of {histories}");
        }
    }
}
