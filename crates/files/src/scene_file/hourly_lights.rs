//! The lights that stand for the sun and the sky of a period, and how bright each is in each hour.

use crate::weather::Slot;
use phylux_core::scene::daylight::{Beside, Hour};

/// How finely the sky is divided into patches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkyDivision {
    /// 145 patches, each some 12 degrees wide.
    Tregenza,
    /// 577 patches, each some 6 degrees wide.
    Reinhart,
}

/// How a scene is to be loaded by the hour.
#[derive(Clone, Copy, Debug)]
pub struct ByHour<'a> {
    /// How finely the sky is divided.
    pub division: SkyDivision,
    /// For each hour of the period, the fraction of it that counts; `None` if all do.
    pub shares: Option<&'a [f64]>,
}

/// The daylight of a period by the hour.
#[derive(Clone, Debug, Default)]
pub struct HourlyLights {
    /// All hours of the period, in order, dark ones included.
    pub slots: Vec<Slot>,
    /// The hours that are not dark.
    pub hours: Vec<Hour>,
    /// The lights that stand for the sun and the sky in the scene. The scene holds each of them
    /// with the mean of its power over the period.
    pub lights: Vec<HourlyLight>,
    /// The suns of the scene file; `hours` says where they stand in each hour.
    pub suns: Vec<HourlySun>,
    /// For each sky of the scene file, the irradiance of each band over that of the whole spectrum:
    /// the scene's quantity per J.
    pub skies: Vec<Vec<f64>>,
    /// Azimuth of north, rad, clockwise from +y.
    pub north: f64,
}

/// A light of the scene that stands for a patch of the sky, a bundle of the suns of several hours,
/// or the ground.
#[derive(Clone, Debug)]
pub struct HourlyLight {
    /// Index of the light in the scene.
    pub light: usize,
    /// Pairs of the index of an hour in [`HourlyLights::hours`] and the light of this hour relative
    /// to its mean over the period, above 0. In hours without a pair the light is dark.
    pub factors: Vec<(usize, f64)>,
    /// For a bundle of suns, how its light can be guessed from that of other lights of the scene.
    pub beside: Vec<Beside>,
}

/// A sun of the scene file, which moves during the period.
#[derive(Clone, Debug)]
pub struct HourlySun {
    /// Half angle of the sun's disc, rad.
    pub half_angle: f64,
    /// Irradiance of each band on a plane that faces the sun, over that of the whole spectrum: the
    /// scene's quantity per J.
    pub shares: Vec<f64>,
}
