//! All kinds of lights in one type.

use std::{fmt, sync::Arc};

use enum_dispatch::enum_dispatch;
use glam::Vec3;

use super::{
    area::Area,
    cone::Cone,
    emitter::{EmittedRadiance, Emitter, EmitterHit, Seen, Start},
    entrance::Entrance,
    intensity::Intensity,
    line::IsotropicLine,
    luminaire::{Luminaire, LuminaireArea},
    tube::Tube,
};
use crate::math::{
    geometry::{Extent, Ray, Triangle},
    rng::Stream,
};

/// A light of any kind.
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

impl AnyEmitter {
    /// Returns how a light at infinity enters the scene.
    #[inline]
    pub fn entrance(&self) -> Option<&Entrance> {
        match self {
            Self::Infinite(entrance) => Some(entrance),
            _ => None,
        }
    }
}
