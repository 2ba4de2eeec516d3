//! From the weather of hours to a sun and a sky: the light of a period is the sum of that of its
//! hours.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

use super::{
    radiance_map::RadianceMap, sky_model::RelativeSky, sun_course::SunCourse,
    sun_position::SunPosition, suns::Suns,
};

/// Position of the sun and weather in an hour, or at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hour {
    /// Share of the period, 0 to 1. Where the shares of all hours add up to less than 1, the rest
    /// of the period is dark.
    pub weight: f64,
    /// Position of the sun in the middle of the time in which it shines.
    pub sun: SunPosition,
    /// Its positions in that time, from which the direct light comes.
    pub course: SunCourse,
    /// The [`eccentricity`](super::eccentricity) of the day.
    pub eccentricity: f64,
    /// Direct irradiance on a plane across the sun's direction, of the whole spectrum, W/m2, at
    /// least 0.
    pub direct_normal: f64,
    /// Diffuse irradiance on a horizontal plane, of the whole spectrum, W/m2, at least 0.
    pub diffuse_horizontal: f64,
}

impl Hour {
    /// Returns the irradiance on an unobstructed horizontal plane, of the whole spectrum, W/m2.
    pub fn global(&self) -> f64 {
        self.direct_horizontal() + self.diffuse_horizontal
    }

    /// Returns the direct part of this irradiance, W/m2.
    pub fn direct_horizontal(&self) -> f64 {
        self.direct_normal * self.course.sine()
    }

    /// Returns the directions towards the sun in the course of the hour, and the direct irradiance, W/m2,
    /// across each. `north` is that of [`azimuth_of`](super::azimuth_of).
    pub fn suns(&self, north: f64) -> impl Iterator<Item = (DVec3, f64)> + '_ {
        let of = move |(sun, share): (SunPosition, f64)| {
            (sun.direction(north), share * self.direct_normal)
        };
        self.course.iter().map(of)
    }
}

/// Model of how radiance is spread over the sky.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkyModel {
    /// The same radiance everywhere.
    Uniform,
    /// The traditional overcast sky.
    Overcast,
    /// One of the CIE's general skies, types 1 to 15.
    Cie(u8),
    /// The all-weather sky of Perez.
    Perez,
}

impl SkyModel {
    /// Returns the sky of an hour; its diffuse irradiance must be above 0.
    pub(super) fn sky(self, hour: &Hour) -> RelativeSky {
        match self {
            Self::Uniform => RelativeSky::Uniform,
            Self::Overcast => RelativeSky::Overcast,
            Self::Cie(kind) => RelativeSky::cie(kind.into()),
            Self::Perez => RelativeSky::perez(
                hour.direct_normal,
                hour.diffuse_horizontal,
                hour.sun.zenith(),
                hour.eccentricity,
            ),
        }
    }

    /// Returns whether the sky depends on the position of the sun.
    pub fn has_sun(self) -> bool {
        !matches!(self, Self::Uniform | Self::Overcast)
    }
}

/// Rows of the sky from zenith to horizon, 1 degree high, and columns around it, 1 degree wide.
const ROWS: usize = 90;
const COLUMNS: usize = 360;

/// Number of hours whose skies are summed up in one task.
const TASK: usize = 32;

/// Returns the mean direct irradiance on a horizontal plane, W/m2.
pub fn mean_direct(hours: &[Hour]) -> f64 {
    hours.iter().map(|hour| hour.weight * hour.direct_horizontal()).sum()
}

/// Returns the suns of all hours as one light, and its mean direct normal irradiance, W/m2, or
/// `None` where there is no direct light. `half_angle` and `north` (see
/// [`azimuth_of`](super::azimuth_of)) are in rad.
pub fn mean_sun(hours: &[Hour], half_angle: f64, north: f64) -> Option<(Suns, f64)> {
    let mean = hours.iter().map(|hour| hour.weight * hour.direct_normal).sum();
    let weighted = |hour: &'_ Hour, (toward, light): (DVec3, f64)| (toward, hour.weight * light);
    let suns = hours.iter().flat_map(|hour| hour.suns(north).map(move |sun| weighted(hour, sun)));
    Some((Suns::new(half_angle, suns)?, mean))
}

/// Returns the mean sky of all hours, scaled to a horizontal irradiance of 1 W/m2, and its own
/// horizontal irradiance, W/m2, or `None` where there is no diffuse light. `north` (see
/// [`azimuth_of`](super::azimuth_of)) is in rad.
///
/// Each cell of 1 x 1 degree has the mean of the model's radiance in it: by 4 Gauss points for up
/// to 48 hours with diffuse light, by its middle for more. The cells of each hour are scaled to its
/// diffuse irradiance.
pub fn mean_sky(model: SkyModel, hours: &[Hour], north: f64) -> Option<(RadianceMap, f64)> {
    let lit: Vec<&Hour> = hours.iter().filter(|h| h.weight * h.diffuse_horizontal > 0.0).collect();
    let points: &[f64] =
        if lit.len() <= 48 { &[0.211_324_865_405_187, 0.788_675_134_594_813] } else { &[0.5] };
    let quadrature = Quadrature::new(points);
    // each task is summed by itself and the tasks in order: the same result for any number of
    // threads
    let tasks: Vec<Vec<f64>> = lit
        .par_chunks(TASK)
        .map(|hours| {
            let mut sum = vec![0.0; ROWS * COLUMNS];
            for hour in hours {
                quadrature.add(&model.sky(hour), hour, &mut sum);
            }
            sum
        })
        .collect();
    let mut cells = vec![0.0; ROWS * COLUMNS];
    for task in &tasks {
        cells.iter_mut().zip(task).for_each(|(sum, part)| *sum += part);
    }
    let irradiance: f64 = lit.iter().map(|h| h.weight * h.diffuse_horizontal).sum();
    let below = std::iter::repeat_n(0.0, ROWS * COLUMNS);
    let values = cells.iter().map(|l| (l / irradiance) as f32).chain(below).collect();
    (irradiance > 0.0).then(|| (RadianceMap::new(COLUMNS, north, values), irradiance))
}

/// Points of quadrature in the cells of the sky.
struct Quadrature {
    /// Sine and cosine of the elevation of each line of points, row by row.
    elevations: Vec<[f64; 2]>,
    /// Sine and cosine of the azimuth of each column of points.
    azimuths: Vec<[f64; 2]>,
    points: usize,
}

impl Quadrature {
    /// Places points in all cells. `points` are fractions of a cell's height and width, symmetric
    /// about its middle.
    fn new(points: &[f64]) -> Self {
        let all = |cells: usize| {
            (0..cells).flat_map(|cell| points.iter().map(move |p| (cell as f64 + p).to_radians()))
        };
        let elevations = all(ROWS).map(|z| z.sin_cos()).map(|(sin, cos)| [cos, sin]).collect();
        let azimuths = all(COLUMNS).map(|a| a.sin_cos()).map(|(sin, cos)| [sin, cos]).collect();
        Self { elevations, azimuths, points: points.len() }
    }

    /// Adds the sky of an hour to the radiances of the cells, scaled to its diffuse irradiance
    /// times its weight.
    fn add(&self, sky: &RelativeSky, hour: &Hour, cells: &mut [f64]) {
        let own = self.radiances(sky, hour.sun.direction(0.0));
        // projected solid angle of a cell, the same for all cells of a row
        let projected = |row: usize| {
            let [above, below] = [row, row + 1].map(|r| (r as f64).to_radians().cos().powi(2));
            0.5 * (above - below) * 1f64.to_radians()
        };
        let irradiance: f64 = own
            .chunks(COLUMNS)
            .enumerate()
            .map(|(row, cells)| projected(row) * cells.iter().sum::<f64>())
            .sum();
        let due = hour.weight * hour.diffuse_horizontal;
        match irradiance > 0.0 && irradiance.is_finite() {
            true => cells.iter_mut().zip(own).for_each(|(sum, l)| *sum += l * due / irradiance),
            // a formula that is negative everywhere: a uniform sky instead
            false => cells.iter_mut().for_each(|sum| *sum += due / PI),
        }
    }

    /// Returns the mean relative radiance of each cell.
    fn radiances(&self, sky: &RelativeSky, sun: DVec3) -> Vec<f64> {
        let mut means = vec![0.0; ROWS * COLUMNS];
        let share = 1.0 / (self.points * self.points) as f64;
        for (line, &[sine, cosine]) in self.elevations.iter().enumerate() {
            let gradation = sky.gradation(sine) * share;
            let row = &mut means[line / self.points * COLUMNS..][..COLUMNS];
            for (i, &[east, north]) in self.azimuths.iter().enumerate() {
                let to_sun = cosine * (east * sun.x + north * sun.y) + sine * sun.z;
                row[i / self.points] += (gradation * sky.indicatrix(to_sun)).max(0.0);
            }
        }
        means
    }
}
