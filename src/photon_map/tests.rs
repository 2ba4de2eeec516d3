//! The map against brute force, and its making against a simple reference.

use glam::Vec3;

use super::*;
use crate::rng::Stream;

fn arrival(position: Vec3, shelf: u32, history: u32) -> Arrival {
    let direction = Vec3::NEG_Z;
    Arrival { position, direction, triangle: 0, shelf, light: 0, history, front: true }
}

fn map_of(arrivals: &[Arrival]) -> PhotonMap {
    let power: Vec<f32> = (0..arrivals.len()).map(|i| i as f32).collect();
    PhotonMap::new(arrivals.to_vec(), power, 1, arrivals.len() as u64)
}

fn cube(rng: &mut Stream) -> Vec3 {
    Vec3::new(rng.uniform(), rng.uniform(), rng.uniform()) * 2.0 - 1.0
}

/// Seed 1. Photons in a volume, on a wall, on a line, in clumps, all at one point; on either side of
/// the size from which there is a tree; more asked for than there are. Distances to 1e-5.
#[test]
fn nearest_is_that_of_brute_force() {
    let mut rng = Stream::new(1, 0, 0);
    let kinds: [fn(Vec3) -> Vec3; 5] = [
        |p| p,
        |p| Vec3::new(p.x, 0.25, p.z),
        |p| Vec3::new(0.5, p.y, -0.5),
        |p| (4.0 * p).round() * 0.25,
        |_| Vec3::new(0.1, 0.2, 0.3),
    ];
    for kind in kinds {
        for n in [1, 7, SMALL_SHELF, SMALL_SHELF + 1, 5_000] {
            // another shelf around it, that must not be found
            let arrivals: Vec<Arrival> = (0..2 * n)
                .map(|i| arrival(kind(cube(&mut rng)), if i % 2 == 0 { 4 } else { 9 }, i as u32))
                .collect();
            let map = map_of(&arrivals);
            for k in [1, 2, 50, n - 1, n, n + 1] {
                for _ in 0..4 {
                    let point = kind(cube(&mut rng)) + 0.01 * cube(&mut rng);
                    let found = map.nearest(9, point, k);
                    let mut exact: Vec<f32> = arrivals
                        .iter()
                        .filter(|a| a.shelf == 9)
                        .map(|a| a.position.distance(point))
                        .collect();
                    exact.sort_by(f32::total_cmp);
                    exact.truncate(k);
                    assert_eq!(found.len(), exact.len());
                    let mut seen: Vec<usize> = found.iter().map(|f| f.index).collect();
                    seen.sort_unstable();
                    seen.dedup();
                    assert_eq!(seen.len(), found.len(), "a photon is found twice");
                    for (found, exact) in found.iter().zip(exact) {
                        let arrival = &map.arrivals[found.index];
                        assert_eq!(arrival.shelf, 9);
                        let own = arrival.position.distance(point);
                        let near = |d: f32| (d - exact).abs() < 1e-5;
                        assert!(near(found.distance2.sqrt()) && near(own), "{n} {k}: {exact}");
                    }
                }
            }
            assert!(map.nearest(5, Vec3::ZERO, 3).is_empty());
            assert!(map.nearest(9, Vec3::ZERO, 0).is_empty());
        }
    }
}

/// Powers stay with their arrivals when these are sorted onto shelves.
#[test]
fn powers_follow_their_arrivals() {
    let arrivals: Vec<Arrival> =
        (0..100).map(|i| arrival(Vec3::splat(i as f32), 7 * i % 5, i)).collect();
    let map = map_of(&arrivals);
    assert!(map.arrivals.is_sorted_by_key(|a| a.shelf));
    for (i, a) in map.arrivals.iter().enumerate() {
        assert_eq!(map.power(i), [a.history as f32]);
    }
}

/// A piece of a run: its place, its histories, and the arrivals of each.
struct Traced {
    key: PieceKey,
    histories: Vec<u32>,
}

/// Seed 2, 4000 random runs: pieces of unequal size, some without histories that arrive, in the order
/// of `PieceKey`, added in any other order and only while they are wanted. The map holds the arrivals
/// of the most first histories that fit, numbers those that arrived, and says how many all are.
#[test]
fn map_is_that_of_the_first_histories() {
    let mut rng = Stream::new(2, 0, 0);
    let mut below = |n: u32| (rng.uniform() * n as f32) as u32;
    for run in 0..4_000 {
        let (rounds, slices, blocks) = (1 + below(2), 1 + below(3), 1 + below(4));
        let busy = below(5);
        let mut pieces = Vec::new();
        for round in 0..rounds {
            for slice in 0..slices {
                for block in 0..blocks {
                    let histories = (0..1 + below(6))
                        .map(|_| below(4).saturating_sub(below(2)) * below(busy + 1));
                    let key = (round.into(), slice.into(), block.into());
                    pieces.push(Traced { key, histories: histories.collect() });
                }
            }
        }
        let total: u32 = pieces.iter().flat_map(|p| &p.histories).sum();
        let limit = below(total + 3) as usize;

        // the reference: history by history, in order
        let (mut fit, mut arrived, mut kept) = (0, 0, Vec::new());
        'fill: for piece in &pieces {
            for &arrivals in &piece.histories {
                if kept.len() + arrivals as usize > limit {
                    break 'fill;
                }
                kept.extend((0..arrivals).map(|i| (piece.key, arrived, i)));
                arrived += u32::from(arrivals > 0);
                fit += 1;
            }
        }

        let mut order: Vec<usize> = (0..pieces.len()).collect();
        for i in (1..order.len()).rev() {
            order.swap(i, below(i as u32 + 1) as usize);
        }
        let mut builder = MapBuilder::new(limit, 2);
        // two threads: a piece is begun before the last one is added
        let mut begun: Option<(PieceKey, Piece)> = None;
        for &p in &order {
            let Traced { key, histories } = &pieces[p];
            let wanted = builder.wants(*key);
            if let Some((key, piece)) = begun.take() {
                builder.add(key, piece);
            }
            if !wanted {
                continue;
            }
            let mut piece = Piece::default();
            for (history, &arrivals) in histories.iter().enumerate() {
                for i in 0..arrivals {
                    let position = Vec3::new(key.0 as f32, key.1 as f32, key.2 as f32);
                    let mut arrival = arrival(position, 0, history as u32);
                    arrival.triangle = i;
                    piece.push(limit, arrival, [position.x + 1.0, i as f32].into_iter());
                }
            }
            begun = Some((*key, piece));
        }
        if let Some((key, piece)) = begun {
            builder.add(key, piece);
        }

        let before = |key: PieceKey| -> u64 {
            pieces.iter().filter(|p| p.key < key).map(|p| p.histories.len() as u64).sum()
        };
        let all: u64 = pieces.iter().map(|p| p.histories.len() as u64).sum();
        let map = builder.build(all, before);
        assert_eq!(map.histories, fit, "run {run}, limit {limit} of {total}");
        let found: Vec<(PieceKey, u32, u32)> = map
            .arrivals
            .iter()
            .map(|a| {
                let [x, y, z] = a.position.to_array().map(|x| x as u64);
                ((x, y, z), a.history, a.triangle)
            })
            .collect();
        assert_eq!(found, kept, "run {run}, limit {limit} of {total}");
        for (i, a) in map.arrivals.iter().enumerate() {
            assert_eq!(map.power(i), [a.position.x + 1.0, a.triangle as f32]);
        }
    }
}
