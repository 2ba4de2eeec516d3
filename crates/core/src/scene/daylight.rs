//! Daylight as mathematics: the position of the sun, the radiance of each part of the sky, and
//! light from infinitely far away as photons and paths meet it.
//!
//! Read in this order: [`SunPosition`], [`SunCourse`] and [`RelativeSky`] (astronomy and sky models),
//! [`Hour`] (the weather of an hour; the light of a period is the sum of that of its hours), [`RadianceMap`]
//! and [`Suns`] (the cells of a sphere and the discs that hours are summed into, with exact
//! integrals and samples), [`InfiniteLight`] (what the transport of light needs: radiance, density,
//! a sampled direction, the light that enters through a face). Weather files and the daylight of
//! scene files are read in `formats`, not here.
//!
//! The axis +z points up, azimuths run clockwise from north, and directions point towards the
//! light.

mod bundles;
mod by_hour;
mod hours;
mod infinite;
mod radiance_map;
mod sky_model;
mod solar_spectrum;
mod sun_course;
mod sun_position;
mod suns;
mod time;

#[cfg(test)]
mod tests;

pub use bundles::suns_by_hour;
pub use by_hour::{Beside, HourlyPart, sky_by_hour};
pub use hours::{Hour, SkyModel, mean_direct, mean_sky, mean_sun};
pub use infinite::{
    DirectionSample, Entering, InfiniteEntry, InfiniteLight, InfinitePart, InfiniteShape,
};
pub use radiance_map::{Cell, MapEntry, RadianceMap};
pub use sky_model::RelativeSky;
pub use solar_spectrum::{DaylightSource, WAVELENGTHS, band_share, standard_spectrum};
pub use sun_course::SunCourse;
pub use sun_position::{SunPosition, azimuth_of, eccentricity};
pub use suns::{Suns, SunsEntry};
pub use time::{Date, Timestamp};
