//! Shapes of lights as users give them, with the checks of their values.

use glam::DVec3;

use super::Intensity;
use crate::{
    error::{Problem, check_length, check_range, number},
    math::geometry::unit_vector,
    scene::daylight::InfiniteLight,
};

/// Shape and direction pattern of a light, in metres from the user's origin.
#[derive(Clone, Debug)]
pub enum LightShape {
    /// A point with the same intensity in all directions.
    Point {
        /// Position of the point.
        position: DVec3,
    },
    /// A point with uniform intensity inside a cone.
    Spot {
        /// Position of the point.
        position: DVec3,
        /// Axis of the cone; not the zero vector.
        direction: DVec3,
        /// Half angle of the cone, rad, in (0, pi].
        half_angle: f64,
    },
    /// Lateral surface of a cylinder, which emits Lambertian light.
    Tube {
        /// One end of the axis.
        from: DVec3,
        /// Other end of the axis; not the same point.
        to: DVec3,
        /// Radius, m. With 0 the light is a line, with an intensity in proportion to the sine of
        /// the angle to the axis.
        radius: f64,
    },
    /// Part of a cylinder's lateral surface, within an angle about its axis; it emits Lambertian
    /// light.
    ApertureTube {
        /// One end of the axis.
        from: DVec3,
        /// Other end of the axis; not the same point.
        to: DVec3,
        /// Radius, m, above 0.
        radius: f64,
        /// Direction from the axis to the middle of the part that shines; not along the axis.
        toward: DVec3,
        /// Angle of the part of the circumference that shines, rad, in (0, 2 pi].
        opening: f64,
    },
    /// A line that emits from points uniform on it, into directions uniform on the sphere.
    IsotropicLine {
        /// One end of the line.
        from: DVec3,
        /// Other end of the line.
        to: DVec3,
    },
    /// Triangles that emit Lambertian light from the front, or from both sides.
    Area {
        /// Corners, counter-clockwise seen from the front. The total area is above zero.
        triangles: Vec<[DVec3; 3]>,
        /// Whether the back emits as well.
        two_sided: bool,
    },
    /// A point whose intensity depends on the direction.
    Luminaire {
        /// Position of the point.
        position: DVec3,
        /// Intensity by direction.
        intensity: Intensity,
    },
    /// Triangles on which every point shines with the same intensity, whose radiance is thus I /
    /// (area x |cosine|). Light leaves from the front into directions on the front's side, and from
    /// the back into the others.
    LuminaireArea {
        /// Corners, counter-clockwise seen from the front. The total area is above zero.
        triangles: Vec<[DVec3; 3]>,
        /// Intensity by direction.
        intensity: Intensity,
    },
    /// A light that is infinitely far away. Its power is the flux that enters the box around the
    /// scene, or its openings.
    Infinite(InfiniteLight),
}

/// Range of powers above 0 that single precision can carry, W or umol/s.
const POWERS: std::ops::RangeInclusive<f64> = 1e-30..=1e30;

/// Result of a check of values: nothing, or what is wrong with them.
pub(super) type Checked = Result<(), Problem>;

/// Checks the powers of a light, W or umol/s. Error: there is not one for each of `bands` bands, or
/// one is negative or beyond what single precision can carry.
pub fn check_power(power: &[f64], bands: usize) -> Checked {
    check_length(power.len(), bands).map_err(|problem| problem.of("power"))?;
    power.iter().try_for_each(|&power| {
        check_range(power, 0.0, f64::MAX).map_err(|problem| problem.of("power"))?;
        if power == 0.0 || POWERS.contains(&power) {
            return Ok(());
        }
        let problem = format!("emits {} W or umol/s in a band", number(power));
        Err(Problem::new(problem, "it must be 0, or from 1e-30 to 1e30"))
    })
}

/// Returns the unit vector along the axis of a spot. Error: its length is 0.
pub fn check_direction(direction: DVec3) -> Result<DVec3, Problem> {
    unit_vector(direction).ok_or_else(|| {
        let remedy = "say where the spot points: [0, 0, -1] is down";
        Problem::new("a direction of length 0", remedy)
    })
}

/// Checks the half angle of a cone, degrees. Error: it is outside (0, 180].
pub fn check_half_angle(degrees: f64) -> Checked {
    if degrees > 0.0 && degrees <= 180.0 {
        return Ok(());
    }
    let remedy = "it is the angle between the axis and the rim, in degrees";
    Err(Problem::new(format!("{degrees}, must be above 0 and at most 180"), remedy))
}

/// Returns the unit vector along the axis of a tube. Error: its length is 0.
pub fn check_axis(from: DVec3, to: DVec3) -> Result<DVec3, Problem> {
    unit_vector(to - from).ok_or_else(|| {
        let problem = "a tube of length 0: `from` is `to`";
        Problem::new(problem, "move one end, or take a point light")
    })
}

/// Returns the unit vector across a tube's `axis` towards the middle of the part that shines.
/// Error: `toward` is along the axis, or the opening, degrees, is outside (0, 360].
pub fn check_aperture(axis: DVec3, toward: DVec3, opening: f64) -> Result<DVec3, Problem> {
    if !(opening > 0.0 && opening <= 360.0) {
        let remedy = "it is the part of the circumference that shines, in degrees";
        let problem = format!("opening_deg: {opening}, must be above 0 and at most 360");
        return Err(Problem::new(problem, remedy));
    }
    let across = unit_vector(toward).map(|v| v.reject_from_normalized(axis));
    across.filter(|v| v.length() > 1e-6).and_then(unit_vector).ok_or_else(|| {
        let problem = "toward: has no part across the tube";
        Problem::new(problem, "say to which side of its axis the tube shines")
    })
}

/// Checks the total area of the triangles of a light. Error: it is 0.
pub fn check_area(area: f64) -> Checked {
    if area > 0.0 {
        return Ok(());
    }
    Err(Problem::new("an area light without area", "its corners must not lie on one line"))
}

impl LightShape {
    /// Checks the values of the shape. Error: it could not shine. Whether coordinates are finite is
    /// checked with the scene.
    pub fn check(&self) -> Checked {
        match self {
            Self::Point { .. } | Self::Luminaire { .. } | Self::Infinite(_) => Ok(()),
            Self::Spot { direction, half_angle, .. } => {
                check_direction(*direction).map_err(|problem| problem.of("direction"))?;
                let degrees = half_angle.to_degrees();
                check_half_angle(degrees).map_err(|problem| problem.of("half angle"))
            }
            Self::Tube { from, to, radius } => {
                check_axis(*from, *to)?;
                check_range(*radius, 0.0, f64::MAX).map_err(|problem| problem.of("radius"))
            }
            Self::ApertureTube { from, to, radius, toward, opening } => {
                check_range(*radius, f64::MIN_POSITIVE, f64::MAX)
                    .map_err(|problem| problem.of("radius"))?;
                let axis = check_axis(*from, *to)?;
                check_aperture(axis, *toward, opening.to_degrees()).map(|_| ())
            }
            Self::IsotropicLine { from, to } => check_axis(*from, *to).map(|_| ()),
            Self::Area { triangles, .. } | Self::LuminaireArea { triangles, .. } => {
                let area = |[a, b, c]: &[DVec3; 3]| 0.5 * (*b - *a).cross(*c - *a).length();
                check_area(triangles.iter().map(area).sum())
            }
        }
    }

    /// Returns the triangles of an area light; the list is empty for other shapes.
    pub fn triangles(&self) -> &[[DVec3; 3]] {
        match self {
            Self::Area { triangles, .. } | Self::LuminaireArea { triangles, .. } => triangles,
            _ => &[],
        }
    }
}
