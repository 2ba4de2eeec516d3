//! The map against brute force, and the map builder against a simple reference.

use glam::Vec3;

use super::*;
use crate::math::rng::Stream;

fn arrival(position: Vec3, bin: u32, history: u32) -> Arrival {
    let direction = PackedDirection::new(Vec3::NEG_Z);
    let photon = StoredPhoton { direction, triangle: 0, light: 0, history };
    Arrival { position, bin, photon }
}

fn map_of(arrivals: &[Arrival]) -> PhotonMap {
    let power: Vec<f32> = (0..arrivals.len()).map(|i| i as f32).collect();
    PhotonMap::new(arrivals.to_vec(), power, 1, arrivals.len() as u64)
}

fn cube(rng: &mut Stream) -> Vec3 {
    Vec3::new(rng.uniform(), rng.uniform(), rng.uniform()) * 2.0 - 1.0
}

/// Photons in a volume, on a wall, on a line, in clumps, and all at one point; fewer and more than
/// the number from which there is a tree; more asked for than there are. Seed 1, distances to 1e-5.
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
        for n in [1, 7, SMALL_BIN, SMALL_BIN + 1, 5_000] {
            // around them photons of another bin, which must not be found
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
                        .filter(|a| a.bin == 9)
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
                        let arrival = &arrivals[map.photons[found.index].history as usize];
                        assert_eq!(arrival.bin, 9);
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

/// Powers stay with their arrivals when these are sorted into bins.
#[test]
fn powers_follow_their_arrivals() {
    let arrivals: Vec<Arrival> =
        (0..100).map(|i| arrival(Vec3::splat(i as f32), 7 * i % 5, i)).collect();
    let map = map_of(&arrivals);
    let bin = |photon: &StoredPhoton| arrivals[photon.history as usize].bin;
    assert!(map.photons.is_sorted_by_key(bin));
    assert_eq!(map.photons.len(), arrivals.len());
    for (i, photon) in map.photons.iter().enumerate() {
        assert_eq!(map.power(i), [photon.history as f32]);
    }
}

/// A task of a run: its key, and the number of arrivals of each of its histories.
struct Traced {
    key: TaskKey,
    histories: Vec<u32>,
}

/// 4000 random runs of seed 2: tasks of unequal size, some without histories that arrive. They are
/// generated in the order of `TaskKey`, but added in any order, and only while they are wanted. The
/// map must hold the arrivals of as many of the first histories as fit, number the histories that
/// arrived, and say how many histories there are in all.
#[test]
fn map_is_that_of_the_first_histories() {
    let mut rng = Stream::new(2, 0, 0);
    let mut below = |n: u32| (rng.uniform() * n as f32) as u32;
    for run in 0..4_000 {
        let (rounds, slices, batches) = (1 + below(2), 1 + below(3), 1 + below(4));
        let busy = below(5);
        let mut tasks = Vec::new();
        for round in 0..rounds {
            for slice in 0..slices {
                for batch in 0..batches {
                    let histories = (0..1 + below(6))
                        .map(|_| below(4).saturating_sub(below(2)) * below(busy + 1));
                    let key = (round.into(), slice.into(), batch.into());
                    tasks.push(Traced { key, histories: histories.collect() });
                }
            }
        }
        let total: u32 = tasks.iter().flat_map(|p| &p.histories).sum();
        let limit = below(total + 3) as usize;

        // the reference: history by history, in order
        let (mut fit, mut arrived, mut kept) = (0, 0, Vec::new());
        'fill: for task in &tasks {
            for &arrivals in &task.histories {
                if kept.len() + arrivals as usize > limit {
                    break 'fill;
                }
                kept.extend((0..arrivals).map(|i| (task.key, arrived, i)));
                arrived += u32::from(arrivals > 0);
                fit += 1;
            }
        }

        let mut order: Vec<usize> = (0..tasks.len()).collect();
        for i in (1..order.len()).rev() {
            order.swap(i, below(i as u32 + 1) as usize);
        }
        let mut builder = MapBuilder::new(limit, 2);
        // two threads: a task is begun before the last one is added
        let mut begun: Option<(TaskKey, TaskArrivals)> = None;
        for &p in &order {
            let Traced { key, histories } = &tasks[p];
            let task = builder.task(*key);
            if let Some((key, task)) = begun.take() {
                builder.add(key, task);
            }
            let Some(mut task) = task else { continue };
            for (history, &arrivals) in histories.iter().enumerate() {
                for i in 0..arrivals {
                    let place = key.0 << 16 | key.1 << 8 | key.2;
                    let mut arrival = arrival(Vec3::ZERO, 0, history as u32);
                    (arrival.photon.triangle, arrival.photon.light) = (i, place as u32);
                    task.push(limit, arrival, [place as f32, i as f32].into_iter());
                }
            }
            begun = Some((*key, task));
        }
        if let Some((key, task)) = begun {
            builder.add(key, task);
        }

        let before = |key: TaskKey| -> u64 {
            tasks.iter().filter(|p| p.key < key).map(|p| p.histories.len() as u64).sum()
        };
        let all: u64 = tasks.iter().map(|p| p.histories.len() as u64).sum();
        let map = builder.build(all, before);
        assert_eq!(map.histories, fit, "run {run}, limit {limit} of {total}");
        let found: Vec<(TaskKey, u32, u32)> = map
            .photons
            .iter()
            .map(|photon| {
                let [_, x, y, z] = photon.light.to_be_bytes().map(u64::from);
                ((x, y, z), photon.history, photon.triangle)
            })
            .collect();
        assert_eq!(found, kept, "run {run}, limit {limit} of {total}");
        for (i, photon) in map.photons.iter().enumerate() {
            assert_eq!(map.power(i), [photon.light as f32, photon.triangle as f32]);
        }
    }
}

/// The memory that a photon of one band takes. In the tree: its position and its index, and its
/// share of the leaf (where the leaf begins and ends), of the split above (with room for twice the
/// leaves) and of 7 bytes that kiddo sets aside for each leaf. Outside the tree: its other
/// properties and its power.
#[test]
fn stored_photon_takes_at_most_48_bytes() {
    let mut rng = Stream::new(3, 0, 0);
    // just over a power of two: the emptiest leaves
    for n in [SMALL_BIN + 1, (1 << 16) + 1, 100_000, 1 << 17] {
        let arrivals: Vec<Arrival> = (0..n).map(|i| arrival(cube(&mut rng), 0, i as u32)).collect();
        let map = map_of(&arrivals);
        let [tree] = &map.bins.trees[..] else { panic!("a tree") };
        let places = n * (size_of::<[f32; 3]>() + size_of::<u32>());
        let leaf = size_of::<[usize; 2]>() + 7 + 2 * size_of::<f32>();
        let in_tree = places + tree.leaf_count().next_power_of_two() * leaf;
        let beside = map.photons.capacity() * size_of::<StoredPhoton>()
            + map.power.capacity() * size_of::<f32>();
        let each = (in_tree + beside) as f64 / n as f64;
        println!("{n} photons, {} leaves: {each:.1} bytes each", tree.leaf_count());
        assert!(each <= 48.0, "{each}");
    }
    // in a list it is less
    assert!(size_of::<Vec3>() + size_of::<StoredPhoton>() + size_of::<f32>() <= 48);
}

/// On leaves there are nearly as many bins as photons, so that a bin takes no more than the position
/// of a photon and its power: 16 bytes. All photons are found again, and in the order of their bins.
#[test]
fn many_bins_of_few_photons_take_few_bytes() {
    assert!(size_of::<Bin>() <= 16, "{} bytes", size_of::<Bin>());
    let place = |i: u32| Vec3::new(i as f32, 0.5, -1.0);
    let bin = |i: u32| 7 * (i % 5000);
    let arrivals: Vec<Arrival> = (0..10_000).map(|i| arrival(place(i), bin(i), i)).collect();
    let map = map_of(&arrivals);
    assert_eq!(map.bins().count(), 5000);
    let positions = map.positions();
    for (number, photons) in map.bins() {
        assert_eq!((photons.len(), map.count(number)), (2, 2));
        for photon in photons {
            let history = map.photons[photon].history;
            assert_eq!((number, positions[photon]), (bin(history), place(history)));
            assert_eq!(map.nearest(number, place(history), 1)[0].index, photon);
        }
    }
    assert!(map.nearest(8, Vec3::ZERO, 3).is_empty());
    assert_eq!(map.count(35_000), 0);
}

/// A run of 300 tasks, of whose arrivals a builder for estimates at eight faces stores what they use:
/// 40,000 of each of five faces, about a middle that no photon marks, on average twice from a history;
/// 600 of a face that is not thinned; a caustic of one history at a middle; and a face of which no
/// estimate is made.
fn arrive(task: u64, mut put: impl FnMut(u32, Vec3, u32)) {
    let mut rng = Stream::new(7, 0, task);
    for history in 0..500 {
        for _ in 0..3 {
            let bin = (rng.uniform() * 10.0) as u32;
            match bin {
                8 => {}
                7 if history > 3 => {}
                _ => put(bin, cube(&mut rng), history),
            }
        }
        if (task, history) == (5, 100) {
            (0..3_000).for_each(|_| put(2, 0.01 * cube(&mut rng), history));
        }
    }
}

fn thinning_of(k: Option<usize>) -> Thinning {
    let middle = |first: usize| 0.1 * Vec3::splat(first as f32 / 3.0 - 1.0);
    let middles = [0, 2, 4, 6].map(|first| (first..first + 2, middle(first)));
    Thinning::new(10, middles.into_iter(), k)
}

/// Whether tasks come in order or not, from one machine or, as words, from three: the estimates of
/// which `k` is given, or chosen, take the photons that they take of all arrivals; and what is stored is
/// a small part of these. Seed 7.
#[test]
fn thinned_map_gives_the_estimates_of_all_arrivals() {
    const TASKS: u64 = 300;
    let key = |task: u64| (0, task / 64, task % 64);
    let mut order: Vec<u64> = (0..TASKS).collect();
    order.sort_by_key(|task| key(*task));
    let place = |task: u64| order.iter().position(|t| *t == task).unwrap() as u64;
    let histories = |k: TaskKey| 500 * order.iter().filter(|t| key(**t) < k).count() as u64;
    let fill = |mut builder: MapBuilder, tasks: &[u64], lag: usize| {
        let mut begun = std::collections::VecDeque::new();
        for &task in tasks {
            if let Some(mut stored) = builder.task(key(task)) {
                arrive(task, |bin, position, history| {
                    if builder.uses(bin) && stored.wants(bin, position, history) {
                        let mut arrival = arrival(position, bin, history);
                        arrival.photon.light = place(task) as u32;
                        stored.push(builder.limit(), arrival, [1.0].into_iter());
                    }
                });
                begun.push_back((key(task), stored));
            }
            while begun.len() > lag {
                let (key, task) = begun.pop_front().unwrap();
                builder.add(key, task);
            }
        }
        begun.into_iter().for_each(|(key, task)| builder.add(key, task));
        builder
    };
    let mut shuffled = order.clone();
    shuffled.sort_by_key(|task| task * 7919 % 307);
    for (limit, k) in [(1 << 22, None), (1 << 22, Some(20)), (150_000, None), (3_000, None)] {
        let thin = || MapBuilder::for_estimates(limit, 1, thinning_of(k));
        let joined = {
            let mut joined = thin();
            for tasks in order.chunks(100) {
                let (tasks, end) = fill(thin(), tasks, 2).into_pieces();
                for (key, task) in tasks {
                    joined.add(key, TaskArrivals::from_words(&task.words(), 1).unwrap());
                }
                end.into_iter().for_each(|end| joined.end_at(end));
            }
            joined
        };
        let builders = [fill(thin(), &order, 0), fill(thin(), &shuffled, 5), joined];
        let maps = builders.map(|builder| builder.build(500 * TASKS, histories));
        let traced = maps[0].histories;
        assert!(maps.iter().all(|map| map.histories == traced), "{limit}");
        // all arrivals of these histories
        let mut all = Vec::new();
        for &task in &order {
            arrive(task, |bin, position, history| {
                let mut arrival = arrival(position, bin, history + 500 * place(task) as u32);
                arrival.photon.light = place(task) as u32;
                if u64::from(arrival.photon.history) < traced && bin < 8 {
                    all.push(arrival);
                }
            });
        }
        let power = vec![1.0; all.len()];
        let reference = PhotonMap::new(all.clone(), power, 1, traced);
        for map in &maps {
            for (first, middle) in [0, 2, 4, 6].map(|bin| (bin, thinning_of(k).middle(bin))) {
                for bin in [first, first + 1] {
                    assert_eq!(map.arrived(bin), reference.arrived(bin), "{bin}, {limit}");
                    let [photons, histories] = map.arrived(bin);
                    let k = k.unwrap_or_else(|| chosen_k(photons, histories));
                    let [own, other] = [map, &reference].map(|map| {
                        let found = map.gather(bin, middle, k, 1.0, f64::from).expect("photons");
                        let mut lights: Vec<u32> =
                            found.photons.iter().map(|p| map.photons[p.index].light).collect();
                        lights.sort_unstable();
                        (found.found, found.radius, found.weight, lights)
                    });
                    assert_eq!(own, other, "{bin}, {limit}");
                }
            }
            assert_eq!(map.count(8) + map.count(9), 0);
        }
        let share = maps.map(|map| map.photons.len() as f64 / all.len() as f64);
        println!("{limit} {k:?}: {traced} histories, {} arrivals, stored {share:.3?}", all.len());
        assert!(limit < 1 << 14 || share.iter().all(|share| *share < 0.25), "{share:.3?}");
    }
}

/// Counts in the words of a task that no run writes: more arrivals than the map holds, of which none is
/// stored. Nothing panics, and the map ends before that task.
#[test]
fn damaged_counts_are_no_panic() {
    for (limit, key) in [(100, FIRST), (100, (0, 1, 0)), (1 << 20, FIRST), (1 << 20, (0, 1, 0))] {
        let mut builder = MapBuilder::for_estimates(limit, 1, thinning_of(None));
        let words = [1.0f32.to_bits(), 0, 0, 2, u32::MAX, u32::MAX, 0, 7, 0];
        builder.add(key, TaskArrivals::from_words(&words, 1).expect("whole words"));
        let map = builder.build(1000, |before| if before == FIRST { 0 } else { 500 });
        assert_eq!((map.arrivals(), map.photons.len()), (0, 0));
        assert_eq!(map.histories, if key == FIRST { 0 } else { 500 });
    }
}

const FIRST: TaskKey = (0, 0, 0);
