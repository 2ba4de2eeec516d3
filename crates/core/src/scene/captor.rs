//! Captors: named surfaces that count light and do not disturb it.

use std::{fmt, ops::Range};

use glam::DVec3;

use crate::{
    error::{Problem, check_range},
    math::{geometry::Transform, round::Round},
};

/// What kind of surface a captor is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CaptorKind {
    /// Triangles of its own, or a disc or sphere, which light crosses unhindered.
    Virtual {
        /// Whether light from behind is counted, too, in a separate channel.
        both_sides: bool,
    },
    /// A surface of the scene, which counts the flux that arrives on each face and the power that
    /// is absorbed.
    Surface,
}

/// A quantity that a captor counts, each in a channel of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Channel {
    /// Flux that arrives against the normal.
    Front = 0,
    /// Flux that arrives along the normal.
    Back = 1,
    /// Power that the surface absorbs.
    Absorbed = 2,
}

/// The channels in their order.
pub const CHANNELS: [Channel; 3] = [Channel::Front, Channel::Back, Channel::Absorbed];

impl CaptorKind {
    /// Returns the number of channels, which are the first ones of [`CHANNELS`].
    pub fn channels(self) -> usize {
        match self {
            Self::Virtual { both_sides: false } => 1,
            Self::Virtual { both_sides: true } => 2,
            Self::Surface => 3,
        }
    }

    /// Returns the channels of the faces that count light.
    pub fn faces(self) -> &'static [Channel] {
        &CHANNELS[..if self.has_back() { 2 } else { 1 }]
    }

    /// Returns whether the back counts light.
    pub fn has_back(self) -> bool {
        self.channels() > 1
    }
}

/// Shape and response of a sensor. The default is flat and has a cosine response.
#[derive(Clone, Default, PartialEq)]
pub struct Sensor {
    /// The disc or sphere that it is, m from the user's origin; `None` if it is made of triangles.
    pub round: Option<Round>,
    /// Whether it is a sphere. The area of a sphere is that of its cross-section: the flux that
    /// enters the sphere, divided by that area, is the fluence rate.
    pub is_sphere: bool,
    /// Factor on each arrival by its angle. `None` counts all arrivals alike.
    pub response: Option<Response>,
}

/// Writes the shape only of a disc or sphere, so that [`Scene::digest`](crate::scene::Scene::digest)
/// of a scene without them is the same as before they existed.
impl fmt::Debug for Sensor {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let mut text = f.debug_struct("Sensor");
        if let Some(round) = &self.round {
            text.field("round", round);
        }
        text.field("is_sphere", &self.is_sphere).field("response", &self.response).finish()
    }
}

/// A factor on each arrival, by its angle to the normal: linear between the entries of a table,
/// constant beyond its ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Response(Vec<[f32; 2]>);

impl Response {
    /// Makes a response from pairs of an angle (degrees in [0, 90], rising) and a factor (in [0,
    /// 1e6]). Error: the list is empty, a number is out of range, or the angles do not rise.
    pub fn new(table: &[[f64; 2]]) -> Result<Self, Problem> {
        if table.is_empty() {
            return Err(Problem::new("an empty list", "give pairs of angle and factor"));
        }
        for [angle, factor] in table {
            check_range(*angle, 0.0, 90.0).map_err(|problem| problem.of("angle"))?;
            check_range(*factor, 0.0, 1e6).map_err(|problem| problem.of("factor"))?;
        }
        if !table.is_sorted_by(|a, b| a[0] < b[0]) {
            return Err(Problem::new("angles that do not rise", "sort the pairs by their angle"));
        }
        Ok(Self(table.iter().map(|pair| pair.map(|value| value as f32)).collect()))
    }

    /// Returns the factor on light that arrives at an angle with this cosine.
    pub fn factor(&self, cos: f32) -> f32 {
        let angle = cos.clamp(0.0, 1.0).acos().to_degrees();
        let after = self.0.partition_point(|[at, _]| *at <= angle);
        match (after.checked_sub(1).map(|i| self.0[i]), self.0.get(after)) {
            (Some([a, low]), Some([b, high])) => low + (high - low) * (angle - a) / (b - a),
            (Some([_, factor]), None) => factor,
            (None, Some([_, factor])) => *factor,
            (None, None) => 1.0,
        }
    }
}

/// A named counting surface.
#[derive(Clone)]
pub struct Captor {
    /// Unique, stable name.
    pub id: String,
    /// Whether the captor is virtual or a surface.
    pub kind: CaptorKind,
    /// One-sided area, m2.
    pub area: f64,
    /// Area centroid, m from the user's origin.
    pub center: DVec3,
    /// Area-weighted mean normal, a unit vector; zero where it cancels (a closed surface).
    pub normal: DVec3,
    /// Range of its triangles, among those of the scene's virtual captors or of the scene's
    /// surfaces. A disc or sphere counts as one; they come after all triangles of virtual captors.
    pub triangles: Range<usize>,
    /// Index of its first channel.
    pub first_channel: usize,
    /// Indices of the groups that it belongs to.
    pub groups: Vec<usize>,
    /// Shape and response, where they are special.
    pub sensor: Sensor,
    /// Whether it also counts what it absorbs of the light on its front, and on its back, each in a
    /// channel of its own after the others.
    pub by_face: bool,
}

/// The first of the two channels of what is absorbed of the light on the front and on the back,
/// after those of [`CHANNELS`].
pub const ABSORBED_FRONT: usize = CHANNELS.len();

impl Captor {
    /// Returns the number of its channels.
    pub fn channels(&self) -> usize {
        self.kind.channels() + if self.by_face { 2 } else { 0 }
    }

    /// Returns the area of a face on which light arrives, m2: for a sphere the whole surface, four
    /// times its cross-section.
    pub fn area_of_face(&self) -> f64 {
        if self.sensor.is_sphere { 4.0 * self.area } else { self.area }
    }
}

/// Writes the last two fields only where they are special, so that [`Scene::digest`](crate::scene::Scene::digest) of a
/// scene without them is the same as before they existed.
impl fmt::Debug for Captor {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { id, kind, area, center, normal, triangles, first_channel, groups, .. } = self;
        let Self { sensor, by_face, .. } = self;
        let mut text = f.debug_struct("Captor");
        text.field("id", id).field("kind", kind).field("area", area).field("center", center);
        text.field("normal", normal).field("triangles", triangles);
        text.field("first_channel", first_channel).field("groups", groups);
        if *sensor != Sensor::default() {
            text.field("sensor", sensor);
        }
        if *by_face {
            text.field("by_face", by_face);
        }
        text.finish()
    }
}

/// Area, area centroid and mean normal of a set of triangles, in double precision.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moments {
    /// Total area, m2.
    pub area: f64,
    /// Area centroid, m.
    pub center: DVec3,
    /// Unit vector along the sum of the area vectors, or zero.
    pub normal: DVec3,
}

impl From<&Round> for Moments {
    fn from(round: &Round) -> Self {
        let normal = round.normal.unwrap_or_default();
        Self { area: round.area(), center: round.center, normal }
    }
}

impl Moments {
    /// Returns the moments of the same triangles where a transform places them that only turns,
    /// mirrors, scales and moves.
    pub fn placed(&self, transform: &Transform) -> Self {
        let scale = transform.turned(DVec3::X).length();
        let normal = transform.turned(self.normal).normalize_or_zero();
        Self { area: scale.powi(2) * self.area, center: transform.point(self.center), normal }
    }

    /// Computes the moments of `triangles`, given in metres.
    pub fn of<'t>(triangles: impl IntoIterator<Item = &'t [DVec3; 3]>) -> Self {
        let (mut area, mut center, mut vector) = (0.0, DVec3::ZERO, DVec3::ZERO);
        let mut first = None;
        for [a, b, c] in triangles {
            let anchor = *first.get_or_insert(*a);
            let cross = 0.5 * (*b - *a).cross(*c - *a);
            area += cross.length();
            vector += cross;
            center += cross.length() * ((*a - anchor) + (*b - anchor) + (*c - anchor)) / 3.0;
        }
        let center =
            first.unwrap_or_default() + if area > 0.0 { center / area } else { DVec3::ZERO };
        let cancels = vector.length() <= 1e-9 * area;
        Self { area, center, normal: if cancels { DVec3::ZERO } else { vector.normalize() } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_response_is_linear_between_its_entries_and_held_at_the_ends() {
        let response = Response::new(&[[30.0, 1.0], [60.0, 0.5], [80.0, 0.0]]).unwrap();
        for (angle, factor) in
            [(0.0, 1.0), (30.0, 1.0), (45.0, 0.75), (60.0, 0.5), (70.0, 0.25), (89.0, 0.0)]
        {
            let found = response.factor((angle as f32).to_radians().cos());
            assert!((found - factor).abs() < 1e-4, "{angle}: {found}");
        }
        for wrong in [
            &[][..],
            &[[91.0, 1.0]],
            &[[0.0, -1.0]],
            &[[10.0, 1.0], [10.0, 1.0]],
            &[[0.0, f64::NAN]],
        ] {
            assert!(Response::new(wrong).is_err());
        }
    }
}
