//! Lights whose intensity was measured, and the power of lights.

use glam::DVec3;

use super::{format::*, loader::Loader};
use crate::{error::Result, formats::photometry::Photometry, scene::light::Intensity};

/// Where a luminaire aims, as the scene file says.
pub(super) struct Aim {
    pub(super) aim: Option<[f64; 3]>,
    pub(super) zero_plane: Option<[f64; 3]>,
    /// Direction in which the luminaire aims if the scene file does not say it.
    pub(super) default: DVec3,
}

impl Aim {
    pub(super) fn aim(&self) -> DVec3 {
        self.aim.map_or(self.default, DVec3::from)
    }
}

/// The intensity that a photometry file gives.
pub(super) struct Measured {
    pub(super) intensity: Intensity,
    /// The integral of the intensities in the file.
    pub(super) flux: f64,
}

impl Loader<'_> {
    /// Reads the photometry file of a light; `None` if the light names none.
    pub(super) fn measured(
        &mut self,
        pointer: &str,
        photometry: Option<&str>,
        aim: &Aim,
    ) -> Result<Option<Measured>> {
        let Some(file) = photometry else {
            self.only_with(pointer, "zero_plane", aim.zero_plane, "`photometry`")?;
            return Ok(None);
        };
        let path = self.sibling(file);
        let photometry = match self.photometries.get(&path) {
            Some(known) => known.clone(),
            None => {
                let bytes = self.bytes(&format!("{pointer}/photometry"), &path)?;
                let read = Photometry::parse(&bytes, &path)?;
                self.photometries.insert(path, read.clone());
                read
            }
        };
        if aim.aim.is_none() && aim.default.length() < 1e-6 {
            return Err(self
                .error(pointer, "the normals of its triangles cancel, so that it aims nowhere")
                .remedy("say with `aim` where it does"));
        }
        let zero_plane = aim.zero_plane.map_or(DVec3::X, DVec3::from);
        let intensity = Intensity::table(photometry.table, aim.aim(), zero_plane)
            .map_err(|problem| problem.at(self.place(pointer)))?;
        Ok(Some(Measured { intensity, flux: photometry.flux }))
    }

    /// Refuses a key that is given without the key that it belongs to.
    pub(super) fn only_with<T>(
        &self,
        pointer: &str,
        key: &str,
        given: Option<T>,
        with: &str,
    ) -> Result<()> {
        match given {
            None => Ok(()),
            Some(_) => Err(self
                .error(format!("{pointer}/{key}"), format!("goes with {with} only"))
                .remedy("leave it out, or say how its intensity depends on the direction")),
        }
    }

    /// Returns the power of a light per band. `"file"` stands for the flux in its photometry file,
    /// and is for scenes with a single band.
    pub(super) fn power(
        &self,
        pointer: &str,
        power: &PowerFile,
        measured: Option<&Measured>,
    ) -> Result<Vec<f64>> {
        let pointer = format!("{pointer}/power");
        let problem = match (power, measured) {
            (PowerFile::Given(power), _) => return self.per_band(&pointer, power, f64::MAX),
            (PowerFile::Spectrum(lamp), _) => return self.lamp_power(&pointer, lamp),
            (PowerFile::File, Some(measured)) if self.bands == 1 => {
                return Ok(vec![measured.flux]);
            }
            (PowerFile::File, Some(_)) => format!("\"file\" for {} bands", self.bands),
            (PowerFile::File, None) => "\"file\" without `photometry`".into(),
        };
        Err(self
            .error(pointer, problem)
            .remedy("give the flux of each band: a file has but one number for the whole lamp"))
    }
}
