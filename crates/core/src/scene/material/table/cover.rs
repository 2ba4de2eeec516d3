//! The cover of a greenhouse, a screen or a film, for which makers state the transmittance at some
//! angles.

use std::f32::consts::PI;

use glam::Vec3;

use crate::{
    error::{Checked, Problem, check_range},
    math::{
        rng::Stream,
        sampling::cosine_hemisphere_density,
        spectrum::{Lanes, Spectrum},
    },
    scene::material::{
        BsdfSample, Interaction, Pane, Scatterer, Transport, check_per_band, check_sum, choose,
        complement, diffuse,
    },
};

/// Index of refraction of the pane whose transmittance continues a table beyond its last angle.
const PANE_IOR: f32 = 1.52;

/// A thin sheet with both faces alike. Of the light that comes at an angle, one part goes straight
/// on, one is transmitted Lambertian (f = diffuse / pi) and one is mirrored. Between the angles of
/// the table these parts are linear in the angle. Beyond its last angle the transmitted parts fall
/// as through a thin pane of n = 1.52, to 0 at 90 degrees.
///
/// The sheet is not reciprocal where `diffuse` differs between angles. The transmitted light
/// depends on the angle at which light comes in, and backward paths account for that.
#[derive(Clone, Debug, PartialEq)]
pub struct Cover {
    rows: Vec<Row>,
    /// Largest value of each part over angles and bands. For the diffuse part it is the mean under
    /// diffuse light of the largest band.
    largest: Parts<f32>,
}

/// Fractions of the light that comes at one angle of incidence. Each part has one fraction per
/// band, in [0, 1], and the sum of the parts is at most 1.
#[derive(Clone, Debug, PartialEq)]
pub struct CoverRow {
    /// Angle of incidence, degrees, from 0 to 90.
    pub angle_deg: f64,
    /// Fraction that goes straight on.
    pub direct: Vec<f32>,
    /// Fraction that is transmitted diffusely, into all directions.
    pub diffuse: Vec<f32>,
    /// Fraction that is mirrored.
    pub reflectance: Vec<f32>,
}

/// One value for each part of the light.
type Parts<T> = [T; 3];
const MIRRORED: usize = 0;
const STRAIGHT: usize = 1;
const DIFFUSE: usize = 2;

#[derive(Clone, Debug, PartialEq)]
struct Row {
    /// Angle of incidence, rad.
    angle: f32,
    parts: Parts<Vec<f32>>,
}

/// Place of an angle among the rows of the table.
struct Place<'a> {
    before: &'a Row,
    after: &'a Row,
    /// Weight of the row `after`, in [0, 1].
    along: f32,
    /// Factor on transmitted light beyond the last angle; 1 at other angles.
    beyond: f32,
}

impl CoverRow {
    /// Returns the row of a table. `bands` are the names of the bands.
    fn checked(self, bands: &[&str]) -> Checked<Row> {
        let Self { angle_deg, direct, diffuse, reflectance } = self;
        check_range(angle_deg, 0.0, 90.0).map_err(|problem| problem.of("angles_deg"))?;
        let parts = [reflectance, direct, diffuse];
        for (part, key) in parts.iter().zip(["reflectance", "direct", "diffuse"]) {
            check_per_band(key, part, bands.len())?;
        }
        for band in 0..bands.len() {
            let sum = parts.iter().map(|part| f64::from(part[band])).sum();
            let fractions = format!("direct + diffuse + reflectance at {angle_deg} degrees");
            check_sum(&fractions, sum, band, bands)?;
        }
        Ok(Row { angle: angle_deg.to_radians() as f32, parts })
    }
}

impl Cover {
    /// Makes the material from its rows in the order of rising angles; there must be at least one.
    /// `bands` are the names of the bands. Error: there is no row, the angles do not rise, a number
    /// is out of its range, there is not one for each band, or the sum of the fractions is above 1.
    pub fn new(rows: Vec<CoverRow>, bands: &[&str]) -> Result<Self, Problem> {
        if rows.is_empty() {
            return Err(Problem::new("a table without angles", "give at least one"));
        }
        let rows = rows.into_iter().map(|row| row.checked(bands));
        let mut cover = Self { rows: rows.collect::<Checked<_>>()?, largest: [0.0; 3] };
        if cover.rows.windows(2).any(|pair| pair[1].angle <= pair[0].angle) {
            let problem = "angles_deg: an angle comes after one that is not smaller";
            return Err(Problem::new(problem, "sort the rows by angle, each angle once"));
        }
        cover.largest = [MIRRORED, STRAIGHT, DIFFUSE].map(|part| {
            cover.rows.iter().flat_map(|row| &row.parts[part]).copied().fold(0.0, f32::max)
        });
        if cover.largest[DIFFUSE] > 0.0 {
            cover.largest[DIFFUSE] = cover.mean_diffuse();
        }
        Ok(cover)
    }

    /// Returns the mean under diffuse light of the largest band's diffuse part. It affects sampling
    /// probabilities only.
    fn mean_diffuse(&self) -> f32 {
        const STEPS: usize = 200;
        let at = |i: usize| {
            let squared_cos = (i as f32 + 0.5) / STEPS as f32;
            Self::largest_at(&self.place(squared_cos.sqrt()), DIFFUSE)
        };
        let mean = (0..STEPS).map(at).sum::<f32>() / STEPS as f32;
        // not too small where the diffuse part shows at single angles only
        mean.max(0.01 * self.largest[DIFFUSE])
    }

    fn place(&self, cos: f32) -> Place<'_> {
        let angle = cos.acos();
        let next = self.rows.partition_point(|row| row.angle < angle);
        let before = &self.rows[next.saturating_sub(1)];
        match self.rows.get(next) {
            Some(after) if next > 0 => {
                let along = (angle - before.angle) / (after.angle - before.angle);
                Place { before, after, along, beyond: 1.0 }
            }
            Some(first) => Place { before: first, after: first, along: 0.0, beyond: 1.0 },
            None => {
                let [here, there] =
                    [cos, before.angle.cos()].map(|cos| Pane::lossless(cos.max(1e-7), PANE_IOR));
                let beyond = (here / there).min(1.0);
                Place { before, after: before, along: 0.0, beyond }
            }
        }
    }

    /// Returns one part of the light, per band, at a place in the table.
    fn part<L: Lanes>(place: &Place, part: usize) -> Spectrum<L> {
        let [before, after] = [place.before, place.after].map(|row| &row.parts[part]);
        let scale = if part == MIRRORED { 1.0 } else { place.beyond };
        Spectrum::from_fn(before.len(), |b| {
            scale * (before[b] + place.along * (after[b] - before[b]))
        })
    }

    fn parts<L: Lanes>(&self, at: &Interaction) -> Parts<Spectrum<L>> {
        let place = self.place(at.cos);
        [MIRRORED, STRAIGHT, DIFFUSE].map(|part| Self::part(&place, part))
    }

    /// Returns the largest band of one part at a place in the table.
    fn largest_at(place: &Place, part: usize) -> f32 {
        let pairs = place.before.parts[part].iter().zip(&place.after.parts[part]);
        let scale = if part == MIRRORED { 1.0 } else { place.beyond };
        pairs.map(|(a, b)| scale * (a + place.along * (b - a))).fold(0.0, f32::max)
    }

    /// Returns the chances of the parts for a path at a place in the table, up to a common factor.
    /// Light that a path follows backward came at the angle at which the path goes on, so that the
    /// diffuse part then has the chance of its mean.
    fn chances(&self, place: &Place, transport: Transport) -> Parts<f32> {
        [MIRRORED, STRAIGHT, DIFFUSE].map(|part| match (part, transport) {
            (DIFFUSE, Transport::Importance) => self.largest[DIFFUSE],
            _ => Self::largest_at(place, part),
        })
    }
}

impl Scatterer for Cover {
    fn lanes(&self) -> usize {
        self.rows[0].parts[MIRRORED].len()
    }

    fn placed(mut self, lanes: usize, _tangents: Vec<(u32, Vec3)>) -> Self {
        let parts = self.rows.iter_mut().flat_map(|row| &mut row.parts);
        parts.for_each(|part| part.resize(lanes, 0.0));
        self
    }

    #[inline(never)]
    fn sample<L: Lanes>(
        &self,
        at: &Interaction,
        transport: Transport,
        rng: &mut Stream,
    ) -> Option<BsdfSample<L>> {
        let place = self.place(at.cos);
        let chances = self.chances(&place, transport);
        let choice = choose(chances, rng)?;
        let scale = choice.weight / chances[choice.lobe];
        let scaled = |part: Spectrum<L>| part.scaled(scale);
        Some(match choice.lobe {
            MIRRORED => BsdfSample::mirrored(at, scaled(Self::part(&place, MIRRORED))),
            STRAIGHT => BsdfSample::straight(at, scaled(Self::part(&place, STRAIGHT))),
            _ => {
                let direction = diffuse(-at.normal, rng);
                let scattered = match transport {
                    Transport::Light => Self::part(&place, DIFFUSE),
                    Transport::Importance => {
                        let cos = direction.dot(at.normal).abs().clamp(1e-7, 1.0);
                        Self::part(&self.place(cos), DIFFUSE)
                    }
                };
                BsdfSample::diffuse(direction, scaled(scattered), true)
            }
        })
    }

    fn evaluate<L: Lanes>(&self, at: &Interaction, outgoing: Vec3) -> Spectrum<L> {
        let scattered = Self::part::<L>(&self.place(at.cos), DIFFUSE);
        if outgoing.dot(at.normal) > 0.0 { scattered.zero() } else { scattered.scaled(1.0 / PI) }
    }

    fn pdf(&self, at: &Interaction, transport: Transport, outgoing: Vec3) -> f32 {
        let cos = -outgoing.dot(at.normal);
        if cos <= 0.0 || !self.is_diffuse() {
            return 0.0;
        }
        let chances = self.chances(&self.place(at.cos), transport);
        let total: f32 = chances.iter().sum();
        chances[DIFFUSE] / total.max(f32::MIN_POSITIVE) * cosine_hemisphere_density(cos)
    }

    fn smooth_ways<L: Lanes>(
        &self,
        at: &Interaction,
        _transport: Transport,
    ) -> [Option<BsdfSample<L>>; 2] {
        let [mirrored, straight, _] = self.parts::<L>(at);
        [
            (!mirrored.is_zero()).then(|| BsdfSample::mirrored(at, mirrored)),
            (!straight.is_zero()).then(|| BsdfSample::straight(at, straight)),
        ]
    }

    fn straight<L: Lanes>(&self, direction: Vec3, front_normal: Vec3) -> Option<Spectrum<L>> {
        let at = Interaction::new(direction, front_normal);
        (self.largest[STRAIGHT] > 0.0).then(|| Self::part(&self.place(at.cos), STRAIGHT))
    }

    fn absorptance<L: Lanes>(&self, at: &Interaction) -> Option<Spectrum<L>> {
        let [mirrored, straight, diffuse] = self.parts::<L>(at);
        Some(complement(mirrored + straight + diffuse))
    }

    fn is_diffuse(&self) -> bool {
        self.largest[DIFFUSE] > 0.0
    }

    fn transmits_diffusely(&self) -> bool {
        self.is_diffuse()
    }

    fn has_mirror(&self) -> bool {
        self.largest[MIRRORED] > 0.0
    }

    fn is_clear(&self) -> bool {
        self.largest[STRAIGHT] > 0.0 && !self.is_diffuse()
    }
}
