//! The lights that sun and sky of a period become, and how much of each shines in each hour.

use crate::{formats::weather::Slot, scene::daylight::Hour};

/// How many patches a sky is cut into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkyDivision {
    /// 145, of some 12 degrees.
    Tregenza,
    /// 577, of some 6 degrees.
    Reinhart,
}

/// The daylight of a period by the hour.
#[derive(Clone, Debug, Default)]
pub struct HourlyLights {
    /// All hours of the period, in order.
    pub slots: Vec<Slot>,
    /// The hours that are not dark.
    pub hours: Vec<Hour>,
    /// What the scene has in the place of sun and sky. In the mean of the period each has the power that the scene
    /// gives it.
    pub lights: Vec<HourlyLight>,
    /// The suns that the scene's file has: where they stand in each hour.
    pub suns: Vec<HourlySun>,
    /// Azimuth of north, rad, clockwise from +y.
    pub north: f64,
}

/// A patch of sky, a sun of the grid, or the ground.
#[derive(Clone, Debug)]
pub struct HourlyLight {
    /// Index of the light in the scene.
    pub light: usize,
    /// Index of an hour that is not dark, and its light over that of the mean, above 0.
    pub factors: Vec<(usize, f64)>,
}

/// A sun that moves.
#[derive(Clone, Debug)]
pub struct HourlySun {
    /// Half angle of its disc, rad.
    pub half_angle: f64,
    /// Irradiance across its direction over that of the whole spectrum, per band: the scene's quantity per J.
    pub shares: Vec<f64>,
}
