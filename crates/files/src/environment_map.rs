//! Environment maps: pictures of the radiance from all directions, by latitude and longitude, in
//! OpenEXR or Radiance HDR files. They are twice as wide as high; other projections are refused.
//!
//! The top row is at the zenith and the middle column is at the heading, with the directions east
//! of the heading to its right, as in a panorama seen from inside. Radiance is constant within a
//! texel.

#[cfg(feature = "exr")]
mod exr_file;
mod hdr;
mod panorama;
#[cfg(all(test, feature = "exr"))]
mod tests;

use std::path::Path;

use panorama::MOST;
pub use panorama::Panorama;

use super::input::quoted;
use phylux_core::{
    error::{Error, Result, some},
    scene::daylight::RadianceMap,
};

impl Panorama {
    /// Reads the `bytes` of the picture at `path`: `.exr` (its first layer) or Radiance `.hdr`. The
    /// first bytes decide which of the two it is.
    ///
    /// # Errors
    /// At the file: it is neither of these, is damaged, holds more than 2^27 numbers, or is not a
    /// picture by latitude and longitude: a cube, or not twice as wide as high.
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Self> {
        let found = if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
            exr_file::read(bytes)
        } else if bytes.starts_with(b"#?") {
            hdr::read(bytes)
        } else {
            Err("is neither OpenEXR nor Radiance HDR".into())
        };
        found.map_err(|problem| {
            Error::input(path.display(), problem)
                .remedy("save the map by latitude and longitude, 2:1, as .exr or .hdr")
        })
    }

    /// Returns what the file holds that is not used for these bands, one sentence each.
    pub fn notes(&self, bands: &[&str]) -> Vec<String> {
        let chosen = self.chosen(bands).unwrap_or_default();
        let unused = self.channels.iter().enumerate().filter(|(c, _)| !chosen.contains(c));
        let unused =
            some(unused.filter(|(_, (name, _))| name != "A").map(|(_, (n, _))| quoted(n)), 8);
        let mut notes = self.notes.clone();
        if !unused.is_empty() {
            let used = some(chosen.iter().map(|&c| quoted(&self.channels[c].0)), 8);
            notes.push(format!("its channels {unused} are not used: the bands have {used}"));
        }
        notes
    }

    /// Returns the indices of the channels for these bands: those of their names, or red, green and
    /// blue for three bands or one, which takes their mean. `None` where there are neither.
    fn chosen(&self, bands: &[&str]) -> Option<Vec<usize>> {
        let find = |name: &&str| self.channels.iter().position(|(known, _)| known == name);
        let by_name: Option<Vec<usize>> = bands.iter().map(find).collect();
        by_name.or_else(|| {
            let colours = ["R", "G", "B"];
            matches!(bands.len(), 1 | 3).then(|| colours.iter().map(find).collect()).flatten()
        })
    }

    /// Returns the radiance per band over the directions: the texels times `scale` (one factor per
    /// band).
    ///
    /// The bands take the channels that have their names. Where there are no such channels, three
    /// bands take R, G, B in this order, and a single band takes their mean. `heading`, rad, is the
    /// azimuth of the middle column, clockwise from +y.
    ///
    /// # Errors
    /// At `path`: bands have no channels; a texel is negative or not finite; the picture is too
    /// large for so many bands; `scale` makes a value too large.
    pub fn map(
        &self,
        path: &Path,
        bands: &[&str],
        heading: f64,
        scale: &[f64],
    ) -> Result<RadianceMap> {
        let error = |problem: String| Error::input(path.display(), problem);
        let texels = self.width * self.height;
        if texels.saturating_mul(bands.len()) > MOST {
            let problem =
                format!("{} x {} texels in {} bands", self.width, self.height, bands.len());
            return Err(error(problem).remedy("make the picture smaller: 2048 x 1024 is plenty"));
        }
        let Some(chosen) = self.chosen(bands) else {
            let names = some(self.channels.iter().map(|(name, _)| quoted(name)), 8);
            let problem =
                format!("its channels {names} are not those of the {} bands", bands.len());
            return Err(error(problem).remedy(
                "name the channels of an OpenEXR like the bands; R, G, B serve one band or three",
            ));
        };
        let mean = bands.len() < chosen.len();
        let channels: Vec<&[f32]> = chosen.iter().map(|&c| &self.channels[c].1[..]).collect();
        let is_bad = |value: &f32| !(value.is_finite() && *value >= 0.0);
        let bad =
            channels.iter().filter_map(|texels| Some((texels.iter().position(is_bad)?, texels)));
        if let Some((texel, channel)) = bad.min_by_key(|(texel, _)| *texel) {
            let (row, column, value) = (texel / self.width, texel % self.width, channel[texel]);
            let problem =
                format!("the texel in row {row}, column {column} (both from 0) is {value}");
            return Err(error(problem).remedy("radiance must be a finite number, at least 0"));
        }
        let mut values = vec![0.0; texels * bands.len()];
        if mean {
            for (texel, value) in values.iter_mut().enumerate() {
                let sum: f64 = channels.iter().map(|c| f64::from(c[texel])).sum();
                *value = (sum / 3.0 * scale[0]) as f32;
            }
        } else {
            for (b, (channel, scale)) in channels.iter().zip(scale).enumerate() {
                let of_band = values.iter_mut().skip(b).step_by(bands.len());
                of_band
                    .zip(*channel)
                    .for_each(|(v, texel)| *v = (f64::from(*texel) * scale) as f32);
            }
        }
        if values.iter().any(|value| !value.is_finite()) {
            return Err(
                error("`scale` makes it brighter than numbers go".into()).remedy("lower it")
            );
        }
        let start = heading - std::f64::consts::PI;
        Ok(match bands.len() {
            1 => RadianceMap::new(self.width, start, values),
            bands => RadianceMap::spectral(self.width, start, bands, values),
        })
    }
}

#[cfg(not(feature = "exr"))]
mod exr_file {
    use super::panorama::Panorama;

    pub(super) fn read(_: &[u8]) -> std::result::Result<Panorama, String> {
        Err("is OpenEXR, which this build does not read (feature `exr`)".into())
    }
}
