//! Lights: where photons start ([`Light::emit`]), and what a point of the scene sees of a light
//! ([`Light::sample_toward`], [`Light::pdf_toward`], [`Light::radiance`]).
//!
//! Read `emitter` first: what every kind of light does. Each kind is a file with its checks, its
//! photons and how it is seen: `cone` (points and spots), `line`, `tube`, `area`, `luminaire` and
//! `entrance` (light from infinitely far away); `AnyEmitter` lists them. [`Unplaced`] (`shape`) is
//! what their constructors make, of which a scene makes emitters. Then [`Light`], `illuminate` for light as a point sees it, `strata` for
//! the way in which histories are shared among lights, and `tree` for the choice among many.
//! `surface`, `intensity` and `checks` are what several kinds have. Nothing here knows surfaces of
//! the scene: whether one stands between a light and a point is for the caller to find out.

use std::{fmt, sync::Arc};

use enum_dispatch::enum_dispatch;
use glam::{DVec3, Vec3};

use crate::{
    math::{
        geometry::{Extent, Ray, Triangle},
        rng::Stream,
    },
    scene::{daylight::InfiniteLight, lattice::Lattice},
};
use emitter::{Emitter, Seen};

mod area;
mod checks;
mod cone;
mod emitter;
mod entrance;
mod illuminate;
mod intensity;
mod known;
mod line;
mod luminaire;
mod shape;
mod strata;
mod surface;
#[cfg(test)]
mod tests;
mod tree;
mod tube;

pub use area::Area;
pub use checks::{check_direction, check_power};
pub use cone::{Cone, check_half_angle};
pub use emitter::{EmittedRadiance, EmitterHit, Start};
pub use entrance::{Entrance, EntryFace, MARGIN, Prism};
pub use illuminate::{LightHit, LightSample, Toward};
pub use intensity::{Intensity, IntensityTable};
pub use known::{known_spectra, known_spectrum};
pub use line::{IsotropicLine, check_axis};
pub use luminaire::{Luminaire, LuminaireArea};
pub use shape::{Outline, Unplaced};
pub use strata::{Emission, Strata, sources};
pub use surface::check_area;
pub use tree::LightTree;
pub use tube::{Tube, check_aperture};

/// An emitter of any kind.
#[enum_dispatch(Emitter)]
#[derive(Clone)]
pub enum AnyEmitter {
    /// A point light or a spot.
    Cone(Cone),
    /// A line that shines in all directions alike.
    IsotropicLine(IsotropicLine),
    /// A tube, or a Lambertian line.
    Tube(Tube),
    /// A Lambertian area.
    Area(Area),
    /// A point with an intensity by direction.
    Luminaire(Luminaire),
    /// An area with an intensity by direction.
    LuminaireArea(LuminaireArea),
    /// A light at infinity.
    Infinite(Arc<Entrance>),
}

impl fmt::Debug for AnyEmitter {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        self.write(to)
    }
}

/// What a light is before it is in a scene, in metres from the user's origin.
#[derive(Clone, Debug)]
pub enum LightSource {
    /// A lamp.
    Lamp(Lamp),
    /// A light that is infinitely far away. Its power is the flux that enters the box around the
    /// scene, or its openings.
    Infinite(InfiniteLight),
}

/// A lamp of any kind, with its power.
#[derive(Clone, Debug)]
pub struct Lamp {
    /// Emitted flux per band, 0 or from 1e-30 to 1e30 W or umol/s.
    pub power: Vec<f64>,
    emitter: Unplaced<AnyEmitter>,
}

impl Lamp {
    /// Makes a lamp of this emitted flux per band, 0 or from 1e-30 to 1e30 W or umol/s, and with this
    /// emitter, which the constructors of its kind make.
    pub fn new<E: 'static>(power: impl Into<Vec<f64>>, emitter: Unplaced<E>) -> Self
    where
        AnyEmitter: From<E>,
    {
        Self { power: power.into(), emitter: emitter.of_any_kind() }
    }

    /// Returns where the lamp may be met.
    pub fn outline(&self) -> &Outline {
        self.emitter.outline()
    }
}

impl From<Lamp> for LightSource {
    fn from(lamp: Lamp) -> Self {
        Self::Lamp(lamp)
    }
}

impl From<InfiniteLight> for LightSource {
    fn from(light: InfiniteLight) -> Self {
        Self::Infinite(light)
    }
}

/// A light: the power that it emits in each band, and a way to emit it.
#[derive(Clone, Debug)]
pub struct Light {
    /// Unique name.
    pub name: String,
    /// Total emitted flux per band, W or umol/s, at least 0.
    pub power: Vec<f64>,
    emitter: AnyEmitter,
    /// Ball around the light: its middle and radius, m.
    ball: (Vec3, f32),
}

impl Light {
    /// Makes a light of so many bands in a scene. Coordinates become relative to `center`. The power
    /// of a light at infinity is the flux that enters `inside`, a prism in these coordinates.
    pub fn new(
        name: String,
        source: LightSource,
        bands: usize,
        center: DVec3,
        inside: &Prism,
    ) -> Self {
        let (power, emitter) = match source {
            LightSource::Lamp(Lamp { power, emitter }) => (power, emitter.place(center)),
            LightSource::Infinite(light) => {
                let entrance = Entrance::new(light, bands, inside, center);
                (entrance.whole_power(bands), Arc::new(entrance).into())
            }
        };
        let ball = emitter.ball();
        Self { name, power, emitter, ball }
    }

    /// Returns a box around the light, m from the centre of the scene; empty for a light at
    /// infinity.
    pub fn extent(&self) -> Extent {
        self.emitter.extent()
    }

    /// Returns points of a point, line or tube light, at which to look for surfaces that cut it: on
    /// its axis, at the middles of so many equal `pieces`. The list is empty for other lights.
    pub(super) fn places(&self, pieces: usize) -> Vec<Vec3> {
        self.emitter.places(pieces)
    }

    /// Returns the unit vector along a line or tube.
    pub(super) fn along(&self) -> Option<Vec3> {
        self.emitter.along()
    }

    /// Returns the unit vector along the axis of a spot, or in which a luminaire aims. Returns
    /// `None` for other lights, and for a spot that shines in all directions.
    pub(super) fn axis(&self) -> Option<Vec3> {
        self.emitter.axis()
    }

    /// Returns the unit vector along which a light shines in the mean, and whether it shines in the
    /// opposite direction as well. `None` where it shines to all sides alike.
    pub fn facing(&self) -> Option<(Vec3, bool)> {
        self.emitter.facing()
    }

    /// Returns the radius of a tube, m, or 0 for other lights.
    pub(super) fn radius(&self) -> f32 {
        self.emitter.radius()
    }

    /// Returns the middle of a ball around the light.
    pub(super) fn middle(&self) -> Vec3 {
        self.ball.0
    }

    /// Moves a point, spot, line or tube; other lights stay where they are.
    pub(super) fn shift(&mut self, by: Vec3) {
        if let Some(position) = self.emitter.position_mut() {
            *position += by;
            self.ball.0 += by;
        }
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
        self.emitter.intensity()
    }

    /// Returns how a light at infinity enters the scene.
    #[inline]
    pub fn entrance(&self) -> Option<&Entrance> {
        match &self.emitter {
            AnyEmitter::Infinite(entrance) => Some(entrance),
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
        self.emitter.emit(rng)
    }

    /// Returns the density, 1/sr, with which a photon of [`emit`](Self::emit) that starts at this
    /// place and side leaves along a unit vector; 0 for a light at infinity.
    pub fn density(&self, start: &Start, direction: Vec3) -> f32 {
        self.emitter.density(start, direction)
    }
}
