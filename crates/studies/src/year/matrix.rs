//! Tables of values with their errors that may be larger than the memory.

use std::{
    fs::File,
    io::{self, Read, Seek, SeekFrom, Write},
    path::Path,
    sync::Mutex,
};

use phylux_core::{
    error::{Error, Result, lock, setting},
    words,
};

/// The most bytes of a matrix that is kept in memory.
const IN_MEMORY: u64 = 96 << 20;
/// Bytes of a value and its error.
const PAIR: usize = size_of::<[f32; 2]>();

/// Pairs of a value and its standard error, row by row: in memory or, where they take more than
/// that, in a file without a name, which the system removes however the program ends.
pub struct Matrix {
    width: usize,
    store: Mutex<Store>,
}

enum Store {
    Memory(Vec<[f32; 2]>),
    File(File),
}

impl Matrix {
    /// Makes a matrix of zeros. `folder` takes the file, if there must be one. Error: the file
    /// cannot be made.
    pub fn new(rows: usize, width: usize, folder: &Path) -> Result<Self> {
        let bytes = Self::bytes(rows, width);
        let store = match Self::is_on_disk(bytes) {
            false => Store::Memory(vec![[0.0; 2]; rows * width]),
            true => {
                let file = tempfile::tempfile_in(folder)
                    .and_then(|file| file.set_len(bytes).map(|()| file));
                Store::File(file.map_err(failed)?)
            }
        };
        Ok(Self { width, store: Mutex::new(store) })
    }

    /// Returns the number of bytes of a matrix.
    pub fn bytes(rows: usize, width: usize) -> u64 {
        (rows as u64).saturating_mul(width as u64).saturating_mul(PAIR as u64)
    }

    /// Returns whether a matrix of that many bytes is kept in a file.
    pub fn is_on_disk(bytes: u64) -> bool {
        bytes > IN_MEMORY
    }

    /// Writes a part of a row, from the place `first` on. Error: the file cannot be written.
    pub fn write(&self, row: usize, first: usize, values: &[[f32; 2]]) -> Result<()> {
        let at = row * self.width + first;
        match &mut *lock(&self.store) {
            Store::Memory(all) => all[at..][..values.len()].copy_from_slice(values),
            Store::File(file) => {
                let bytes: Vec<u8> =
                    values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
                let written = seek(file, at).and_then(|()| file.write_all(&bytes));
                written.map_err(failed)?;
            }
        }
        Ok(())
    }

    /// Reads a part of a row, from the place `first` on. Error: the file cannot be read.
    pub fn read(&self, row: usize, first: usize, values: &mut [[f32; 2]]) -> Result<()> {
        let at = row * self.width + first;
        match &mut *lock(&self.store) {
            Store::Memory(all) => values.copy_from_slice(&all[at..][..values.len()]),
            Store::File(file) => {
                let mut bytes = vec![0; values.len() * PAIR];
                let read = seek(file, at).and_then(|()| file.read_exact(&mut bytes));
                read.map_err(failed)?;
                let mut numbers = bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b));
                for number in values.iter_mut().flatten() {
                    *number = numbers.next().unwrap_or_default();
                }
            }
        }
        Ok(())
    }
}

fn seek(file: &mut File, pair: usize) -> io::Result<()> {
    file.seek(SeekFrom::Start((pair * PAIR) as u64)).map(drop)
}

fn failed(e: io::Error) -> Error {
    Error::run("the light of all hours", format!("does not fit on the disk: {e}")).remedy(words![
        "make room there, or ask for fewer hours (",
        setting("hours").is("groups"),
        ")"
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_is_the_same_in_memory_and_in_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let rows = IN_MEMORY as usize / PAIR / 3;
        for rows in [5, rows] {
            let matrix = Matrix::new(rows, 4, folder.path()).unwrap();
            assert_eq!(Matrix::is_on_disk(Matrix::bytes(rows, 4)), rows > 5);
            matrix.write(rows - 1, 1, &[[1.5, -2.0], [f32::NAN, 1e-30]]).unwrap();
            let mut row = [[7.0; 2]; 4];
            matrix.read(rows - 1, 0, &mut row).unwrap();
            assert_eq!(row[..2], [[0.0, 0.0], [1.5, -2.0]]);
            assert!(row[2][0].is_nan() && row[2][1] == 1e-30 && row[3] == [0.0; 2]);
            matrix.read(0, 0, &mut row).unwrap();
            assert_eq!(row, [[0.0; 2]; 4]);
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
