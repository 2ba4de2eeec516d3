//! What a run may take of memory.

use crate::{
    error::{Error, Result},
    scene::world::Scene,
    transport::tally::{Tally, Totals},
};

/// The most memory that a run may take for its sums and results, bytes.
const MAX_SUM_BYTES: usize = 16 << 30;

/// Refuses a run whose sums would not fit into memory, before it begins.
pub(super) fn check(scene: &Scene, parts: usize, threads: usize) -> Result<()> {
    let strata = scene.lights.len() * scene.lanes() * size_of::<f64>();
    let of_each = 2 * Tally::bytes(scene, parts) + strata;
    let bytes = threads.saturating_mul(of_each) + Totals::bytes(scene, parts);
    if bytes <= MAX_SUM_BYTES {
        return Ok(());
    }
    let problem = format!(
        "the sums for {} captors, {} bands and {} lights on {threads} threads would take {:.0} GiB",
        scene.captors.len(),
        scene.bands.len(),
        scene.lights.len(),
        bytes as f64 / f64::from(1 << 30)
    );
    let remedy = match parts {
        0 => "ask for fewer captors, bands or threads",
        _ => "ask for fewer captors, lights or threads, or do not split by light",
    };
    Err(Error::input(format!("scene {}", scene.name), problem).remedy(remedy))
}
