//! The memory and the disk that a year takes, said before it begins.

use std::path::Path;

use super::{
    matrix::Matrix,
    places::{BLOCK, Places},
    responses::IN_MEMORY,
    states::YearScenes,
    trace::energies,
};
use phylux_core::{
    error::{Error, Result, setting},
    math::machine,
    scene::light::Strata,
    words,
};

/// Bytes of a value with its error in sums, and in tables.
const SUM: u64 = 16;
const PAIR: u64 = 8;

/// About how many bytes a year takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Needs {
    /// In memory.
    pub memory: u64,
    /// On the disk while it is calculated, without its tables.
    pub disk: u64,
}

impl Needs {
    /// Counts the bytes for the `hours` of so many ids and for so many photons, on so many threads.
    pub(super) fn of(
        scenes: &YearScenes,
        places: &Places,
        hours: usize,
        photons: u64,
        threads: usize,
    ) -> Self {
        let [ids, row] = [places.ids.len(), places.row()].map(|n| n as u64);
        let (mut memory, mut disk) = (0, 0);
        let mut matrix = |rows: u64, width: u64| {
            let bytes = Matrix::bytes(rows as usize, width as usize);
            let store = if Matrix::is_on_disk(bytes) { &mut disk } else { &mut memory };
            *store += bytes;
        };
        let (mut lights, mut suns, mut slots, mut channels) = (0, 0, 0, 0);
        let mut rows = 0;
        // a photon that arrives on a face brings light to it and to its surface, in all columns
        let of_photon = places.channels.min(2) as u64 * places.columns as u64 * PAIR;
        for (scene, share) in scenes.scenes.iter().zip(energies(scenes)) {
            let all = scene.loaded.scene.lights();
            let shares = Strata::photons_of_lights(all, (share * photons as f64) as u64, 1);
            let full = ids * places.light() as u64 * PAIR;
            rows += shares.iter().map(|photons| full.min(photons * of_photon)).sum::<u64>();
            lights += all.len() as u64;
            channels = scene.loaded.scene.channels() as u64;
            if let Some(hourly) = &scene.loaded.hourly {
                slots = hourly.slots.len() as u64;
                let sunny = hourly.hours.iter().filter(|hour| hour.direct_normal > 0.0);
                suns += sunny.count() as u64;
            }
        }
        matrix(slots, hours as u64 * row);
        // days, months and the period
        let periods = slots / 24 + slots / 700 + 2;
        matrix(periods, ids * row);
        *(if rows > IN_MEMORY { &mut disk } else { &mut memory }) += rows;
        // where each block begins in the row of a light
        memory += lights * (ids / BLOCK as u64 + 2) * 8;
        let groups = ids - places.captors as u64;
        let of_block = BLOCK as u64 * row * (PAIR * (suns + slots + periods) + SUM * 2 * lights);
        memory += 2 * threads as u64 * of_block;
        memory += groups * suns * row * SUM + 2 * lights * (slots + 2 * periods) * PAIR;
        // sums of a light: totals, and those of the tasks of each thread
        memory += (channels + 3 * groups) * places.columns as u64 * 32 * (1 + threads as u64);
        Self { memory, disk }
    }

    /// Refuses a year that does not fit into the memory, or whose files do not fit into `folder`.
    pub(super) fn check(self, captors: usize, folder: &Path) -> Result<()> {
        self.check_against(captors, machine::memory_left(), machine::disk_left(folder))
    }

    fn check_against(self, captors: usize, memory: u64, disk: u64) -> Result<()> {
        for (what, needed, left) in
            [("of memory", self.memory, memory), ("on the disk", self.disk, disk)]
        {
            if needed > left {
                let fit = (captors as f64 * left as f64 / needed as f64) as usize;
                let [needed, left] = [needed, left].map(gigabytes);
                let problem = format!("takes {needed} GB {what}, of which {left} are left");
                return Err(Error::input("year", problem).remedy(words![
                    format!("about {fit} captors would fit; or ask for the hours of fewer ("),
                    setting("hours").is("groups"),
                    "), or for fewer bands or states"
                ]));
            }
        }
        Ok(())
    }
}

/// Writes bytes as gigabytes, with two digits.
pub fn gigabytes(bytes: u64) -> String {
    let giga = bytes as f64 / 1e9;
    match giga {
        ..0.0995 => format!("{giga:.3}"),
        ..9.95 => format!("{giga:.1}"),
        _ => format!("{giga:.0}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_refused_with_what_would() {
        let needs = Needs { memory: 4_000_000_000, disk: 20_000_000_000 };
        assert!(needs.check_against(1000, 5_000_000_000, u64::MAX).is_ok());
        let error = needs.check_against(1000, 1_000_000_000, u64::MAX).unwrap_err().to_string();
        assert!(error.contains("takes 4.0 GB of memory, of which 1.0 are left"), "{error}");
        assert!(error.contains("about 250 captors would fit"), "{error}");
        let error = needs.check_against(1000, u64::MAX, 2_000_000_000).unwrap_err().to_string();
        assert!(error.contains("takes 20 GB on the disk, of which 2.0 are left"), "{error}");
    }
}
