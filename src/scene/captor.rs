//! Captors: named surfaces that count light and do not disturb it.

use std::ops::Range;

use glam::DVec3;

/// What kind of surface a captor is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CaptorKind {
    /// Triangles of its own, which light crosses unhindered.
    Virtual {
        /// Whether light from behind is counted too, apart.
        both_sides: bool,
    },
    /// A surface of the scene: counts what arrives on each face and what is absorbed.
    Surface,
}

/// What is counted at a captor, each in a channel of its own.
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
    /// Number of channels: the first ones of [`CHANNELS`].
    pub fn channels(self) -> usize {
        match self {
            Self::Virtual { both_sides: false } => 1,
            Self::Virtual { both_sides: true } => 2,
            Self::Surface => 3,
        }
    }

    /// The faces that count.
    pub fn faces(self) -> &'static [Channel] {
        &CHANNELS[..if self.has_back() { 2 } else { 1 }]
    }

    /// Whether it has a back that counts.
    pub fn has_back(self) -> bool {
        self.channels() > 1
    }
}

/// A named counting surface.
#[derive(Clone, Debug)]
pub struct Captor {
    /// Unique, stable name.
    pub id: String,
    /// Virtual or surface.
    pub kind: CaptorKind,
    /// One-sided area, m2.
    pub area: f64,
    /// Area centroid, m from the user's origin.
    pub center: DVec3,
    /// Area-weighted mean normal, a unit vector; zero where it cancels (a closed surface).
    pub normal: DVec3,
    /// Its triangles: of the scene's virtual captors, or of the scene's surfaces.
    pub triangles: Range<usize>,
    /// Index of its first channel.
    pub first_channel: usize,
    /// The groups that it belongs to.
    pub groups: Vec<usize>,
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

impl Moments {
    /// Of `triangles`, in metres.
    pub fn of(triangles: &[[DVec3; 3]]) -> Self {
        let (mut area, mut center, mut vector) = (0.0, DVec3::ZERO, DVec3::ZERO);
        let anchor = triangles.first().map_or(DVec3::ZERO, |t| t[0]);
        for [a, b, c] in triangles {
            let cross = 0.5 * (*b - *a).cross(*c - *a);
            area += cross.length();
            vector += cross;
            center += cross.length() * ((*a - anchor) + (*b - anchor) + (*c - anchor)) / 3.0;
        }
        let center = anchor + if area > 0.0 { center / area } else { DVec3::ZERO };
        let cancels = vector.length() <= 1e-9 * area;
        Self { area, center, normal: if cancels { DVec3::ZERO } else { vector.normalize() } }
    }
}
