//! What the lights bring to the captors and groups.

use std::{
    io::{self, Read, Seek, SeekFrom, Write},
    path::Path,
    sync::Mutex,
};

use tempfile::SpooledTempFile;

use super::kept::{decode, encode};
use phylux_core::error::{Error, Result, lock};

/// The most bytes of the rows of lights that are kept in memory.
pub(super) const IN_MEMORY: u64 = 96 << 20;

/// What each light of a part brings to all ids: values with their standard errors, most of which are
/// 0, because few photons of one light come to one leaf. They are kept without these zeros, block by
/// block of ids; in memory or, where they take too much of it, in a file without a name, which the
/// system removes however the program ends.
pub(super) struct LightRows {
    /// Number of values of each block of ids.
    widths: Vec<usize>,
    /// For each light, where its blocks begin in the store, and where the last one ends. Empty if the
    /// light brings nothing.
    starts: Vec<Vec<u64>>,
    end: u64,
    store: Mutex<SpooledTempFile>,
}

impl LightRows {
    /// Makes rows of zeros, with so many values in each block. `folder` takes the file, if there must
    /// be one.
    pub fn new(lights: usize, widths: Vec<usize>, folder: &Path) -> Self {
        Self {
            widths,
            starts: vec![Vec::new(); lights],
            end: 0,
            store: Mutex::new(SpooledTempFile::new_in(IN_MEMORY as usize, folder)),
        }
    }

    /// Returns the number of lights.
    pub fn lights(&self) -> usize {
        self.starts.len()
    }

    /// Sets what a light brings to all ids. Error: the disk is full.
    pub fn put(&mut self, light: usize, mut values: &[[f32; 2]]) -> Result<()> {
        let mut bytes = Vec::new();
        let mut starts = vec![self.end];
        for &width in &self.widths {
            let (own, others) = values.split_at(width);
            encode(own, &mut bytes);
            starts.push(self.end + bytes.len() as u64);
            values = others;
        }
        let mut store = lock(&self.store);
        let written = store.seek(SeekFrom::Start(self.end)).and_then(|_| store.write_all(&bytes));
        written.map_err(|e| {
            Error::run("the light of all hours", format!("does not fit on the disk: {e}"))
                .remedy("make room there, or ask for fewer captors, bands or states")
        })?;
        self.end += bytes.len() as u64;
        self.starts[light] = starts;
        Ok(())
    }

    /// Returns what a light brings to a block of ids. Error: the file cannot be read.
    pub fn get(&self, light: usize, block: usize) -> Result<Vec<[f32; 2]>> {
        let width = self.widths[block];
        let Some(&[start, end]) = self.starts[light].get(block..block + 2) else {
            return Ok(vec![[0.0; 2]; width]);
        };
        let failed = |e| Error::run("the light of all hours", format!("cannot be read: {e}"));
        let mut bytes = vec![0; (end - start) as usize];
        let mut store = lock(&self.store);
        let read = store.seek(SeekFrom::Start(start)).and_then(|_| store.read_exact(&mut bytes));
        drop(store);
        read.map_err(failed)?;
        decode(&bytes, width).ok_or_else(|| failed(io::ErrorKind::InvalidData.into()))
    }
}

/// What the lights of a part bring to a block of ids: light by light, means and variances.
pub(super) struct Responses {
    width: usize,
    means: Vec<f64>,
    variances: Vec<f64>,
}

impl Responses {
    pub fn read(rows: &LightRows, block: usize) -> Result<Self> {
        let width = rows.widths[block];
        let [mut means, mut variances] =
            [(); 2].map(|()| Vec::with_capacity(rows.lights() * width));
        for light in 0..rows.lights() {
            let row = rows.get(light, block)?;
            means.extend(row.iter().map(|&[mean, _]| f64::from(mean)));
            variances.extend(row.iter().map(|&[_, error]| f64::from(error).powi(2)));
        }
        Ok(Self { width, means, variances })
    }

    /// Returns the number of values of the block.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Returns the number of lights.
    pub fn lights(&self) -> usize {
        self.means.len().checked_div(self.width).unwrap_or(0)
    }

    pub fn means_of(&self, light: usize) -> &[f64] {
        &self.means[light * self.width..][..self.width]
    }

    pub fn variances_of(&self, light: usize) -> &[f64] {
        &self.variances[light * self.width..][..self.width]
    }

    /// Returns the means and the variances of some lights.
    pub fn of(&self, lights: &[usize]) -> [Vec<f64>; 2] {
        let means = lights.iter().flat_map(|&l| self.means_of(l)).copied().collect();
        let variances = lights.iter().flat_map(|&l| self.variances_of(l)).copied().collect();
        [means, variances]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_read_as_they_were_put() {
        let folder = tempfile::tempdir().unwrap();
        // as many values as do not fit into memory without zeros
        let (widths, lights) = (vec![1 << 20, 3, 1 << 20], 7);
        let mut rows = LightRows::new(lights, widths.clone(), folder.path());
        let value = |light: usize, place: usize| match (light + place) % 9 {
            0 => [0.0; 2],
            _ => [light as f32, place as f32],
        };
        let all: usize = widths.iter().sum();
        for light in [4, 0, 6, 1, 2, 3] {
            let values: Vec<[f32; 2]> = (0..all).map(|place| value(light, place)).collect();
            rows.put(light, &values).unwrap();
        }
        assert!(rows.end > IN_MEMORY);
        let at = [0, widths[0], widths[0] + 3];
        for (light, block) in [(0, 0), (3, 1), (6, 2), (4, 2), (2, 0)] {
            let found = rows.get(light, block).unwrap();
            let wanted = (at[block]..at[block] + widths[block]).map(|place| value(light, place));
            assert!(found.into_iter().eq(wanted), "light {light}, block {block}");
        }
        // a light that was not put, and none outside
        assert_eq!(rows.get(5, 1).unwrap(), [[0.0; 2]; 3]);
        assert_eq!((rows.lights(), std::fs::read_dir(folder.path()).unwrap().count()), (7, 0));
    }
}
