//! Shapes of lights as users give them, and their checks.

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
    /// A point, alike in all directions.
    Point {
        /// Where it is.
        position: DVec3,
    },
    /// A point with uniform intensity inside a cone.
    Spot {
        /// Where it is.
        position: DVec3,
        /// Axis of the cone; not zero.
        direction: DVec3,
        /// Half angle of the cone, rad, in (0, pi].
        half_angle: f64,
    },
    /// Lateral surface of a cylinder, Lambertian.
    Tube {
        /// One end of the axis.
        from: DVec3,
        /// The other end, not the same.
        to: DVec3,
        /// Radius, m; 0 is the line (intensity ~ sine of the angle to the axis).
        radius: f64,
    },
    /// The part of a cylinder's lateral surface within an angle, Lambertian.
    ApertureTube {
        /// One end of the axis.
        from: DVec3,
        /// The other end, not the same.
        to: DVec3,
        /// Radius, m, above 0.
        radius: f64,
        /// The middle of the part that shines, as seen from the axis; not along it.
        toward: DVec3,
        /// How much of the circumference shines, rad, in (0, 2 pi].
        opening: f64,
    },
    /// Points uniform on a line, directions uniform on the sphere.
    IsotropicLine {
        /// One end.
        from: DVec3,
        /// The other end.
        to: DVec3,
    },
    /// Triangles, Lambertian from the front, or from both sides.
    Area {
        /// Corners, counter-clockwise seen from the front; total area above zero.
        triangles: Vec<[DVec3; 3]>,
        /// Whether the back emits too.
        two_sided: bool,
    },
    /// A point whose intensity depends on the direction.
    Luminaire {
        /// Where it is.
        position: DVec3,
        /// Into which directions it shines.
        intensity: Intensity,
    },
    /// Triangles of which every point shines with the same intensity, from the front where that goes to the
    /// front, from the back where it goes to the back: with the radiance I / (area x |cosine|).
    LuminaireArea {
        /// Corners, counter-clockwise seen from the front; total area above zero.
        triangles: Vec<[DVec3; 3]>,
        /// Into which directions it shines.
        intensity: Intensity,
    },
    /// Infinitely far away: what enters the scene's box is its power.
    Infinite(InfiniteLight),
}

/// Powers that single precision can carry, W or umol/s.
const POWERS: std::ops::RangeInclusive<f64> = 1e-30..=1e30;

/// What a check of a value finds.
pub(super) type Checked = Result<(), Problem>;

/// Refuses all but one power that single precision can carry for each of so many bands.
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

/// The unit vector of the axis of a spot; refuses one of length 0.
pub fn check_direction(direction: DVec3) -> Result<DVec3, Problem> {
    unit_vector(direction).ok_or_else(|| {
        let remedy = "say where the spot points: [0, 0, -1] is down";
        Problem::new("a direction of length 0", remedy)
    })
}

/// Refuses a half angle of a cone, degrees, outside (0, 180].
pub fn check_half_angle(degrees: f64) -> Checked {
    if degrees > 0.0 && degrees <= 180.0 {
        return Ok(());
    }
    let remedy = "it is the angle between the axis and the rim, in degrees";
    Err(Problem::new(format!("{degrees}, must be above 0 and at most 180"), remedy))
}

/// The unit vector of the axis of a tube; refuses one of length 0.
pub fn check_axis(from: DVec3, to: DVec3) -> Result<DVec3, Problem> {
    unit_vector(to - from).ok_or_else(|| {
        let problem = "a tube of length 0: `from` is `to`";
        Problem::new(problem, "move one end, or take a point light")
    })
}

/// The unit vector across a tube's `axis` where it shines; refuses one along it, and an opening, degrees, outside
/// (0, 360].
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

/// Refuses triangles that together have no area.
pub fn check_area(area: f64) -> Checked {
    if area > 0.0 {
        return Ok(());
    }
    Err(Problem::new("an area light without area", "its corners must not lie on one line"))
}

impl LightShape {
    /// Refuses what cannot shine. That coordinates are finite is for the scene to check.
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

    /// The triangles that it is made of, if it is.
    pub fn triangles(&self) -> &[[DVec3; 3]] {
        match self {
            Self::Area { triangles, .. } | Self::LuminaireArea { triangles, .. } => triangles,
            _ => &[],
        }
    }
}
