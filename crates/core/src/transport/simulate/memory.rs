//! The memory that a run may take.

use super::schedule::AHEAD;
use crate::{
    error::{Error, Result},
    math::machine::{gib, memory_left},
    scene::{
        captor::{CHANNELS, CaptorKind},
        world::Scene,
    },
    transport::{
        photon_map::{Arrival, MapBuilder},
        settings::Settings,
        tally::{Tally, Totals},
    },
};

/// The most memory that a run may take for its sums and results, on any machine, in bytes.
const MOST: u64 = 16 << 30;
/// About the most channels of captors that a task of photons reaches: 64 arrivals of each photon.
const TOUCHED: usize = 1 << 16;
/// The most memory that sums of open batches may take, in bytes: of batches that are held side by
/// side until they can be added up or written.
const MOST_OPEN: u64 = 4 << 30;

/// Returns the most bytes that sums of open batches may take on this machine, now.
pub(super) fn most_open() -> u64 {
    MOST_OPEN.min(memory_left())
}

/// The most memory that the photon map may take, in bytes. Building it takes twice as much, and in
/// a room of mirrors the arrivals of the task of each thread may take as much again.
const MAX_MAP_BYTES: usize = 1 << 30;
/// When the photon map is made, the powers of its arrivals stand in memory this often: as the tasks
/// found them, joined, and in the order of the map.
const MAP_COPIES: u64 = 3;

/// Returns the most arrivals that a photon map keeps.
pub(super) fn map_limit(scene: &Scene, settings: &Settings) -> usize {
    let arrival = size_of::<Arrival>() + scene.bands().len() * size_of::<f32>();
    settings.map_photons.get().min(MAX_MAP_BYTES / arrival)
}

/// Returns the most bytes that the arrivals of a photon map may take on this machine, now.
pub(super) fn map_room() -> u64 {
    memory_left() / MAP_COPIES
}

/// Refuses a photon map of so many arrivals that would not fit into memory, before it is begun.
pub(super) fn check_map(scene: &Scene, arrivals: usize) -> Result<()> {
    let bytes = arrivals as u64 * MapBuilder::arrival_bytes(scene.bands().len());
    if bytes <= map_room() { Ok(()) } else { Err(map_too_large(scene)) }
}

/// Returns the bytes that a full photon map takes: while it is made, and then.
pub fn map_bytes(scene: &Scene, settings: &Settings) -> [u64; 2] {
    let arrivals = map_limit(scene, settings) as u64;
    let bytes = arrivals * MapBuilder::arrival_bytes(scene.bands().len());
    [MAP_COPIES * bytes, bytes]
}

/// Returns the error of a photon map that does not fit into memory.
pub(super) fn map_too_large(scene: &Scene) -> Error {
    let problem = format!(
        "the photons that would be stored in {} bands take more than the {:.1} GiB of memory that are left for them",
        scene.bands().len(),
        gib(map_room())
    );
    let remedy = "store fewer (`map_photons` in the settings), or ask for fewer bands";
    Error::input(format!("scene {}", scene.name()), problem).remedy(remedy)
}

/// Refuses a run whose sums and results would not fit into memory, before it begins. The light is
/// split into `parts` parts (0: not split); `nearest` says whether there are k-nearest estimates.
pub(super) fn check(scene: &Scene, parts: usize, threads: usize, nearest: bool) -> Result<()> {
    // at the end sums and results are in memory together
    let results = result_bytes(scene, parts, nearest);
    let batch = Tally::bytes(scene, parts, usize::MAX);
    let bytes = threads.saturating_mul(thread_bytes(scene, parts))
        + batch
        + Totals::bytes(scene, parts)
        + results;
    let most = MOST.min(memory_left());
    if bytes as u64 <= most {
        return Ok(());
    }
    let in_groups = scene.captors().iter().map(|captor| captor.groups.len()).sum::<usize>();
    let in_groups = match in_groups > scene.captors().len() {
        true => format!(" ({in_groups} times in groups)"),
        false => String::new(),
    };
    let problem = format!(
        "the sums and results of {} captors{in_groups}, {} bands and {} lights on {threads} threads would take {:.1} \
        GiB, of {:.1} that they may",
        scene.captors().len(),
        scene.bands().len(),
        scene.lights().len(),
        gib(bytes as u64),
        gib(most)
    );
    let remedy = match parts {
        0 => "ask for fewer captors, groups, bands or threads",
        _ => "ask for fewer captors, groups, bands, lights or threads, or do not split by light",
    };
    Err(Error::input(format!("scene {}", scene.name()), problem).remedy(remedy))
}

/// Returns about how many bytes a thread takes: the sums of a task while it is traced, and those of
/// the tasks that wait for their turn.
fn thread_bytes(scene: &Scene, parts: usize) -> usize {
    let strata = scene.sources() * scene.lanes() * size_of::<f64>();
    let waiting = Tally::bytes(scene, parts, TOUCHED) - Tally::bytes(scene, parts, 0);
    Tally::bytes(scene, parts, TOUCHED) + AHEAD as usize * waiting + strata
}

/// Returns about how many bytes the results take that are made of the sums. They are written to a
/// file piece by piece, without a copy of their text.
fn result_bytes(scene: &Scene, parts: usize, nearest: bool) -> usize {
    const VALUE: usize = size_of::<f64>();
    const ERROR: usize = size_of::<Option<f64>>();
    // lists, names and positions of a face or of what is absorbed, for all light and for a part of
    // it
    const HEAD: usize = 1024;
    let columns = scene.bands().len() + scene.sums().len();
    let absorbing = scene.captors().iter().filter(|c| c.kind == CaptorKind::Surface).count();
    let faces: usize = scene.captors().iter().map(|c| c.kind.faces().len()).sum();
    let (groups, group_faces) = (scene.groups().len(), (CHANNELS.len() - 1) * scene.groups().len());
    let (faces, absorbing) = (faces + group_faces, absorbing + groups);
    // a ratio has a value, an error and three covariances
    let ratios = 5 * ERROR * scene.ratios().len();
    let face = 2 * (VALUE + ERROR) * columns + ratios + HEAD;
    let by_face = if scene.asked().absorbed_by_face { 2 } else { 0 };
    let absorbed = (1 + by_face) * (VALUE + ERROR) * columns + ratios + HEAD;
    let split = (parts + 1) * (faces * face + absorbing * absorbed);
    // the smallest and the largest value among the captors of a group
    let range = group_faces * 2 * VALUE * columns;
    // for each group of a captor its name and its place in the group's list of faces, which grows
    let memberships: usize = scene.captors().iter().map(|captor| captor.groups.len()).sum();
    let longest = scene.groups().iter().map(String::len).max().unwrap_or(0);
    let name = size_of::<String>() + longest.next_multiple_of(16) + 16;
    let in_groups = memberships * (name + 3 * 2 * size_of::<(&u8, f64)>());
    let nearest = if nearest { (faces - group_faces) * face } else { 0 };
    let energy = (parts + 1) * (scene.materials().len() + 5) * (VALUE * columns + HEAD / 8);
    split + range + in_groups + nearest + energy
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    use crate::scene::{
        light::{Cone, Lamp},
        world::{Band, CaptorPart, LightPart, SceneParts},
    };

    /// 10,000 sensors in 4096 bands are 4.1e7 numbers. In results, with k-nearest estimates and
    /// split by light, each takes 3 x 48 bytes, and 48 bytes without either; in sums that are split
    /// by light it takes 2 x 24 and 2 x 8 bytes. The memory that is counted is not less, and at
    /// most half more.
    #[test]
    fn all_that_stands_side_by_side_is_counted() {
        let band = |b| Band { name: format!("{b}"), from_nm: None, to_nm: None };
        let captor = |i: usize| CaptorPart {
            id: format!("{i}"),
            kind: CaptorKind::Virtual { both_sides: false },
            triangles: vec![[DVec3::ZERO, DVec3::X, DVec3::Y]],
            groups: Vec::new(),
            sensor: Default::default(),
        };
        let scene = Scene::new(SceneParts {
            bands: (0..4096).map(band).collect(),
            captors: (0..10_000).map(captor).collect(),
            lights: vec![LightPart::new("lamp", Lamp::new(vec![1.0; 4096], Cone::point(DVec3::Z)))],
            ..SceneParts::default()
        });
        let scene = scene.unwrap_or_else(|e| panic!("{e}"));
        let numbers = 10_000 * 4096;
        let within = |bytes: usize, exact: usize| (exact..exact + exact / 2).contains(&bytes);
        assert!(within(result_bytes(&scene, 1, true), numbers * 3 * 48));
        assert!(within(result_bytes(&scene, 0, false), numbers * 48));
        assert!(within(Totals::bytes(&scene, 1), numbers * 2 * 24));
        assert!(within(Tally::bytes(&scene, 1, usize::MAX), numbers * 2 * 8));
    }

    /// A thread takes 4 bytes for each channel of the scene, and 12 MB for the channels that its
    /// tasks reach: with 1e6 triangles as captors, of three channels each, 24 MB in all.
    #[test]
    fn threads_take_memory_for_what_they_reach() {
        let leaves = 200_000;
        let band = Band { name: "PAR".into(), from_nm: None, to_nm: None };
        let captor = |i: usize| CaptorPart {
            id: format!("{i}"),
            kind: CaptorKind::Virtual { both_sides: true },
            triangles: vec![[DVec3::ZERO, DVec3::X, DVec3::Y]],
            groups: Vec::new(),
            sensor: Default::default(),
        };
        let scene = Scene::new(SceneParts {
            bands: vec![band],
            captors: (0..leaves).map(captor).collect(),
            lights: vec![LightPart::new("lamp", Lamp::new([1.0], Cone::point(DVec3::Z)))],
            ..SceneParts::default()
        });
        let scene = scene.unwrap_or_else(|e| panic!("{e}"));
        let bytes = thread_bytes(&scene, 0);
        let own = scene.channels() * size_of::<u32>() + 5 * TOUCHED * 36;
        assert!((own..own + 10_000).contains(&bytes), "{bytes} bytes");
    }
}
