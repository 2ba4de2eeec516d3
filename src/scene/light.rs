//! Lights: where photons start ([`Light::emit`]), and what a point of the scene sees of a light
//! ([`Light::sample_toward`], [`Light::pdf_toward`], [`Light::radiance`]).
//!
//! Read [`LightShape`] (`shape`) first, then [`Light`], then `illuminate` for light as a point sees
//! it, `strata` for the way in which histories are shared among lights, and `tree` for the choice
//! among many. `intensity` holds
//! luminaires, `entrance` light from infinitely far away. Nothing here knows surfaces: whether one
//! stands between a light and a point is for the caller to find out.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use crate::{
    math::{
        geometry::{Extent, Frame, ROUNDING, Ray, unit_vector},
        rng::Stream,
        sampling::{cosine_hemisphere, uniform_cone},
    },
    scene::lattice::Lattice,
};
use emitter::{Aperture, Chosen, EmittingSurface, Line};

mod emitter;
mod entrance;
mod illuminate;
mod intensity;
mod known;
mod shape;
mod start;
mod strata;
#[cfg(test)]
mod tests;
mod tree;

pub use entrance::{Entrance, EntryFace, MARGIN, Prism};
pub use illuminate::{EmittedRadiance, EmitterHit, LightHit, LightSample, Toward};
pub use intensity::{Intensity, IntensityTable};
pub use known::{known_spectra, known_spectrum};
pub use shape::{
    LightShape, check_aperture, check_area, check_axis, check_direction, check_half_angle,
    check_power,
};
pub use start::Start;
pub use strata::{Emission, Strata, sources};
pub use tree::LightTree;

/// A light: the power that it emits in each band, and a way to emit it.
#[derive(Clone, Debug)]
pub struct Light {
    /// Unique name.
    pub name: String,
    /// Total emitted flux per band, W or umol/s, at least 0.
    pub power: Vec<f64>,
    emitter: Emitter,
    /// Ball around the light: its middle and radius, m.
    ball: (Vec3, f32),
}

#[derive(Clone, Debug)]
enum Emitter {
    Cone { position: Vec3, frame: Frame, versine: f32 },
    Tube { line: Line, frame: Frame, radius: f32, aperture: Aperture },
    IsotropicLine(Line),
    Area { surface: EmittingSurface, two_sided: bool },
    Luminaire { position: Vec3, intensity: Intensity },
    LuminaireArea { surface: EmittingSurface, intensity: Intensity },
    Infinite(Arc<Entrance>),
}

impl Light {
    /// Makes a light from its shape. Coordinates become relative to `center`. The power of a light
    /// at infinity is replaced by the flux that enters `inside`, a prism in these coordinates.
    pub(crate) fn new(
        name: String,
        mut power: Vec<f64>,
        shape: &LightShape,
        center: DVec3,
        inside: &Prism,
    ) -> Self {
        let local = |p: DVec3| (p - center).as_vec3();
        let along = |v: DVec3| Frame::new(unit_vector(v).unwrap_or(DVec3::Z).as_vec3().normalize());
        let emitter = match shape {
            LightShape::Point { position } => Emitter::Cone {
                position: local(*position),
                frame: Frame::new(Vec3::Z),
                versine: 2.0,
            },
            LightShape::Spot { position, direction, half_angle } => Emitter::Cone {
                position: local(*position),
                frame: along(*direction),
                versine: (2.0 * (half_angle / 2.0).sin().powi(2)) as f32,
            },
            LightShape::Tube { from, to, radius } => Emitter::Tube {
                line: Line::new(local(*from), (*to - *from).as_vec3()),
                frame: along(*to - *from),
                radius: *radius as f32,
                aperture: Aperture::WHOLE,
            },
            LightShape::ApertureTube { from, to, radius, toward, opening } => {
                let axis = unit_vector(*to - *from).unwrap_or(DVec3::Z);
                let tangent = check_aperture(axis, *toward, opening.to_degrees())
                    .unwrap_or(axis.any_orthonormal_vector());
                Emitter::Tube {
                    line: Line::new(local(*from), (*to - *from).as_vec3()),
                    frame: Frame {
                        tangent: tangent.as_vec3(),
                        bitangent: axis.cross(tangent).as_vec3(),
                        normal: axis.as_vec3(),
                    },
                    radius: *radius as f32,
                    aperture: Aperture((opening / std::f64::consts::TAU) as f32),
                }
            }
            LightShape::IsotropicLine { from, to } => {
                Emitter::IsotropicLine(Line::new(local(*from), (*to - *from).as_vec3()))
            }
            LightShape::Area { triangles, two_sided } => {
                let surface = EmittingSurface::new(triangles, local);
                Emitter::Area { surface, two_sided: *two_sided }
            }
            LightShape::Luminaire { position, intensity } => {
                Emitter::Luminaire { position: local(*position), intensity: intensity.clone() }
            }
            LightShape::LuminaireArea { triangles, intensity } => {
                let surface = EmittingSurface::new(triangles, local);
                Emitter::LuminaireArea { surface, intensity: intensity.clone() }
            }
            LightShape::Infinite(light) => {
                let entrance = Entrance::new(light.clone(), power.len(), inside, local);
                for (b, power) in power.iter_mut().enumerate() {
                    *power = (0..entrance.faces()).map(|face| entrance.power(face)[b]).sum();
                }
                Emitter::Infinite(Arc::new(entrance))
            }
        };
        let ball = emitter.ball();
        Self { name, power, emitter, ball }
    }

    /// Returns a box around the light, m from the centre of the scene; empty for a light at
    /// infinity.
    pub fn extent(&self) -> Extent {
        match &self.emitter {
            Emitter::Cone { position, .. } | Emitter::Luminaire { position, .. } => {
                Extent::of([*position])
            }
            Emitter::Tube { line, radius, .. } => {
                let r = Vec3::splat(*radius);
                let ends = [line.from, line.from + line.whole];
                Extent::of(ends.into_iter().flat_map(|p| [p - r, p + r]))
            }
            Emitter::IsotropicLine(line) => Extent::of([line.from, line.from + line.whole]),
            Emitter::Area { surface, .. } | Emitter::LuminaireArea { surface, .. } => {
                Extent::of_triangles(&surface.triangles)
            }
            Emitter::Infinite(_) => Extent::EMPTY,
        }
    }

    /// Returns points of a point, line or tube light, at which to look for surfaces that cut it: on
    /// its axis, at the middles of so many equal `pieces`. The list is empty for other lights.
    pub(super) fn places(&self, pieces: usize) -> Vec<Vec3> {
        match &self.emitter {
            Emitter::Cone { position, .. } | Emitter::Luminaire { position, .. } => vec![*position],
            Emitter::Tube { line, .. } | Emitter::IsotropicLine(line) => {
                let at = |i: usize| line.from + (i as f32 + 0.5) / pieces as f32 * line.whole;
                (0..pieces).map(at).collect()
            }
            Emitter::Area { .. } | Emitter::LuminaireArea { .. } | Emitter::Infinite(_) => {
                Vec::new()
            }
        }
    }

    /// Returns the unit vector along a line or tube.
    pub(super) fn along(&self) -> Option<Vec3> {
        match &self.emitter {
            Emitter::Tube { line, .. } | Emitter::IsotropicLine(line) => {
                Some(line.whole / line.length)
            }
            _ => None,
        }
    }

    /// Returns the unit vector along the axis of a spot, or in which a luminaire aims. Returns
    /// `None` for other lights, and for a spot that shines in all directions.
    pub(super) fn axis(&self) -> Option<Vec3> {
        match &self.emitter {
            Emitter::Cone { frame, versine, .. } if *versine < 2.0 => Some(frame.normal),
            Emitter::Luminaire { intensity, .. } => Some(intensity.axes().normal),
            _ => None,
        }
    }

    /// Returns the unit vector along which a light shines in the mean, and whether it shines in the
    /// opposite direction as well. `None` where it shines to all sides alike.
    pub fn facing(&self) -> Option<(Vec3, bool)> {
        match &self.emitter {
            Emitter::Area { surface, two_sided } => {
                let normal: DVec3 = surface.triangles.iter().map(|t| t.cross().as_dvec3()).sum();
                Some((unit_vector(normal)?.as_vec3(), *two_sided))
            }
            Emitter::LuminaireArea { intensity, .. } => Some((intensity.axes().normal, false)),
            Emitter::Tube { frame, aperture, .. } if aperture.0 < 1.0 => {
                Some((frame.tangent, false))
            }
            _ => self.axis().map(|axis| (axis, false)),
        }
    }

    /// Returns the radius of a tube, m, or 0 for other lights.
    pub(super) fn tube_radius(&self) -> f32 {
        match &self.emitter {
            Emitter::Tube { radius, .. } => *radius,
            _ => 0.0,
        }
    }

    /// Returns the middle of a ball around the light.
    pub(super) fn middle(&self) -> Vec3 {
        self.ball.0
    }

    /// Moves a point, spot, line or tube; other lights stay where they are.
    pub(super) fn shift(&mut self, by: Vec3) {
        match &mut self.emitter {
            Emitter::Cone { position, .. } | Emitter::Luminaire { position, .. } => *position += by,
            Emitter::Tube { line, .. } | Emitter::IsotropicLine(line) => line.from += by,
            Emitter::Area { .. } | Emitter::LuminaireArea { .. } | Emitter::Infinite(_) => return,
        }
        self.ball.0 += by;
    }

    /// Moves a point, spot or line to the image that lies in the cell (0, 0).
    pub(super) fn bring_into_cell(&mut self, lattice: &Lattice) {
        let shift = lattice.shift(lattice.cell_of(self.ball.0.as_dvec3())).as_vec3();
        if shift != Vec3::ZERO {
            self.shift(-shift);
        }
    }

    /// Returns the intensity by direction of a luminaire.
    pub fn intensity(&self) -> Option<&Intensity> {
        match &self.emitter {
            Emitter::Luminaire { intensity, .. } | Emitter::LuminaireArea { intensity, .. } => {
                Some(intensity)
            }
            _ => None,
        }
    }

    /// Returns how a light at infinity enters the scene.
    #[inline]
    pub(crate) fn entrance(&self) -> Option<&Entrance> {
        match &self.emitter {
            Emitter::Infinite(entrance) => Some(entrance),
            _ => None,
        }
    }

    /// Returns the number of strata of the light's photons: one, or one for each face by which a
    /// light at infinity enters.
    pub fn sources(&self) -> usize {
        self.entrance().map_or(1, Entrance::faces)
    }

    /// Returns the power of one of these strata, per band, W or umol/s.
    pub fn source_power(&self, source: usize) -> &[f64] {
        self.entrance().map_or(&self.power, |entrance| entrance.power(source))
    }

    /// Draws the ray of one photon. It starts off the surface of a light by the error of its points,
    /// and as far from the edges of a polygon and the ends of a line, because a light that reaches
    /// from wall to wall must not shine behind the walls by rounding.
    #[inline]
    pub fn emit(&self, rng: &mut Stream) -> Ray {
        self.emit_from(rng).1
    }

    /// Draws the ray of one photon like [`emit`](Self::emit), and returns with it the place of the
    /// light that it starts from.
    #[inline(always)]
    fn emit_from(&self, rng: &mut Stream) -> (Start, Ray) {
        match &self.emitter {
            Emitter::Cone { position, frame, versine } => {
                let direction = frame.to_world(uniform_cone(*versine, rng.square()));
                Start::of_point(*position, direction)
            }
            Emitter::Tube { line, frame, radius, aperture } => {
                let turn = aperture.turn(rng.uniform());
                let normal = turn.x * frame.tangent + turn.y * frame.bitangent;
                let point = line.choose(rng) + *radius * normal;
                leave(Chosen { point, normal, offset: tube_offset(line, *radius) }, rng)
            }
            Emitter::IsotropicLine(line) => {
                let point = line.choose(rng);
                Start::of_point(point, uniform_cone(2.0, rng.square()))
            }
            Emitter::Area { surface, two_sided } => {
                let chosen = surface.choose(rng);
                let front = !*two_sided || rng.uniform() < 0.5;
                let normal = if front { chosen.normal } else { -chosen.normal };
                leave(Chosen { normal, ..chosen }, rng)
            }
            Emitter::Luminaire { position, intensity } => {
                Start::of_point(*position, intensity.sample(rng))
            }
            Emitter::LuminaireArea { surface, intensity } => {
                let Chosen { point, normal, offset } = surface.choose(rng);
                let direction = intensity.sample(rng);
                let side = normal * normal.dot(direction).signum();
                let start = Start { point, normal, offset, both_sides: true };
                (start, Ray { origin: point + offset * side, direction })
            }
            Emitter::Infinite(entrance) => {
                let dark = || Ray { origin: Vec3::ZERO, direction: Vec3::NEG_Z };
                let ray = entrance.enter_anywhere(rng).unwrap_or_else(dark);
                Start::of_point(ray.origin, ray.direction)
            }
        }
    }
}

/// Draws a ray with a Lambertian direction from a surface.
#[inline]
fn leave(Chosen { point, normal, offset }: Chosen, rng: &mut Stream) -> (Start, Ray) {
    let start = Start { point, normal, offset, both_sides: false };
    let direction = Frame::new(normal).to_world(cosine_hemisphere(rng.square()));
    (start, Ray { origin: point + offset * normal, direction })
}

/// Returns the distance from a tube at which photons start, m.
#[inline]
fn tube_offset(axis: &Line, radius: f32) -> f32 {
    axis.blur + ROUNDING * radius
}
