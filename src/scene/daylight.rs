//! Daylight as mathematics: where the sun stands, how bright each part of the sky is, and light from
//! infinitely far away as photons and paths meet it. What files say is read elsewhere.
//!
//! Read in this order: [`SunPosition`] and [`RelativeSky`] (astronomy and sky models), [`Hour`] (the
//! weather of an hour; a period is a sum of hours), [`RadianceMap`] and [`Suns`] (what they are summed
//! into: cells of a sphere and discs, with their exact integrals and samples), [`InfiniteLight`] (what
//! the tracer asks: radiance, density, a direction, what enters through a face).
//!
//! +z is up; azimuths run clockwise from north; directions point towards the light.

mod by_hour;
mod hours;
mod infinite;
mod radiance_map;
mod sky_model;
mod solar_spectrum;
mod sun_position;
mod suns;
mod time;

#[cfg(test)]
mod tests;

pub use by_hour::{HourlyPart, sky_by_hour, suns_by_hour};
pub use hours::{Hour, SkyModel, mean_direct, mean_sky, mean_sun};
pub use infinite::{
    DirectionSample, Entering, InfiniteEntry, InfiniteLight, InfinitePart, InfiniteShape,
};
pub use radiance_map::{Cell, MapEntry, RadianceMap};
pub use sky_model::RelativeSky;
pub use solar_spectrum::{DaylightSource, WAVELENGTHS, band_share};
pub use sun_position::{SunPosition, azimuth_of, eccentricity};
pub use suns::{Suns, SunsEntry};
pub use time::{Date, Timestamp};
