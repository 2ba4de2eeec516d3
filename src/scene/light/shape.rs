//! Shapes of lights as users give them, with the checks of their values.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::{
    area::Area,
    checks::Checked,
    cone::Cone,
    entrance::{Entrance, Prism},
    intensity::Intensity,
    kinds::AnyEmitter,
    line::IsotropicLine,
    luminaire::{Luminaire, LuminaireArea},
    surface::EmittingSurface,
    tube::Tube,
};
use crate::{error::Problem, math::geometry::Extent, scene::daylight::InfiniteLight};

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

impl LightShape {
    /// Checks the values of the shape. Error: nothing that shines can be made of it. Whether
    /// coordinates are finite is checked with the scene.
    pub fn check(&self) -> Checked {
        match self {
            // made with the scene that its light enters
            Self::Infinite(_) => Ok(()),
            _ => self.emitter(0, &Prism::from(Extent::EMPTY), |p| p.as_vec3()).map(drop),
        }
    }

    /// Returns the triangles of an area light; the list is empty for other shapes.
    pub fn triangles(&self) -> &[[DVec3; 3]] {
        match self {
            Self::Area { triangles, .. } | Self::LuminaireArea { triangles, .. } => triangles,
            _ => &[],
        }
    }

    /// Returns the ends of the axis and the radius, m, of a tube.
    pub(crate) fn tube(&self) -> Option<([DVec3; 2], f64)> {
        match self {
            Self::Tube { from, to, radius } | Self::ApertureTube { from, to, radius, .. } => {
                Some(([*from, *to], *radius))
            }
            _ => None,
        }
    }

    /// Returns the corners of what a ray may meet: the triangles of an area light, or triangles from
    /// one end of a tube to the other that span the boxes around both ends and all heights between.
    pub(crate) fn pieces(&self) -> impl Iterator<Item = [DVec3; 3]> {
        let tube = self.tube().into_iter().flat_map(|([from, to], radius)| {
            let diagonals = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
            diagonals.into_iter().flat_map(move |(x, y)| {
                let across = radius * DVec3::new(x, y, 1.0);
                [
                    [from - across, from + across, to + across],
                    [from - across, to - across, to + across],
                ]
            })
        });
        self.triangles().iter().copied().chain(tube)
    }

    /// Returns the place of a point, or the ends of a line.
    pub(crate) fn points(&self) -> impl Iterator<Item = DVec3> {
        let [first, second] = match self {
            Self::Point { position }
            | Self::Spot { position, .. }
            | Self::Luminaire { position, .. } => [Some(*position), None],
            Self::IsotropicLine { from, to } => [Some(*from), Some(*to)],
            _ => [None, None],
        };
        first.into_iter().chain(second)
    }

    /// Makes what emits. `local` converts coordinates to those of the scene; a light at infinity, of
    /// so many `bands`, enters the prism `inside`, in these coordinates. Error: it could not shine.
    pub(super) fn emitter(
        &self,
        bands: usize,
        inside: &Prism,
        local: impl Fn(DVec3) -> Vec3,
    ) -> Result<AnyEmitter, Problem> {
        let surface = |triangles| EmittingSurface::new(triangles, &local);
        Ok(match self {
            Self::Point { position } => Cone::sphere(local(*position)).into(),
            Self::Spot { position, direction, half_angle } => {
                Cone::spot(local(*position), *direction, *half_angle)?.into()
            }
            Self::Tube { from, to, radius } => {
                Tube::whole(local(*from), *to - *from, *radius)?.into()
            }
            Self::ApertureTube { from, to, radius, toward, opening } => {
                Tube::part(local(*from), *to - *from, *radius, *toward, *opening)?.into()
            }
            Self::IsotropicLine { from, to } => {
                IsotropicLine::new(local(*from), *to - *from)?.into()
            }
            Self::Area { triangles, two_sided } => {
                Area::new(surface(triangles)?, *two_sided).into()
            }
            Self::Luminaire { position, intensity } => {
                Luminaire { position: local(*position), intensity: intensity.clone() }.into()
            }
            Self::LuminaireArea { triangles, intensity } => {
                let surface = surface(triangles)?;
                LuminaireArea { surface, intensity: intensity.clone() }.into()
            }
            Self::Infinite(light) => {
                Arc::new(Entrance::new(light.clone(), bands, inside, local)).into()
            }
        })
    }
}
