//! The scattering function of a thin sheet, measured for pairs of directions.

use std::fmt;

use glam::Vec3;

use super::{
    basis::{Polar, Sectors},
    part::{PairValues, Part, View},
};
use crate::{
    error::{Checked, Problem, check_length},
    math::{
        geometry::Frame,
        rng::Stream,
        spectrum::{Lanes, Spectrum},
    },
    scene::material::{BsdfSample, Interaction, Scatterer, Transport, choose, complement},
};

/// Amount by which the sum of reflectance and transmittance of a table may exceed 1, because of its
/// rounding and its steps. Such a table is scaled down to 1.
const TOLERATED: f64 = 1e-3;

/// A sheet whose scattering function is given for pairs of directions of incidence and exit. Light
/// that comes to a face is reflected and transmitted by tables of that face. If there are none for
/// the back, it reflects like the front, and its transmission is that of the front in the opposite
/// direction. Directions are sampled by the largest value of the table in any band.
#[derive(Clone, PartialEq)]
pub struct Bsdf {
    front: Box<Face>,
    back: Option<Box<Face>>,
    bands: usize,
    /// Axis of azimuth 0 on each triangle of the sheet, with the index of the triangle. It is empty
    /// where only the difference of azimuths counts.
    tangents: Vec<(u32, Vec3)>,
    isotropic: bool,
}

/// Scattering of the light that comes to one face.
#[derive(Clone, Debug, PartialEq)]
struct Face {
    reflected: Part,
    transmitted: Part,
}

/// Measured values for the light that comes to one face. Directions are counted from the normal of
/// the side that they are on, azimuths about the normal of the front, and all directions point away
/// from the sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceValues {
    /// Scattering back to the side that the light comes from.
    pub reflected: PairValues,
    /// Scattering to the other side. Its rows are those of `reflected`.
    pub transmitted: PairValues,
}

/// Values that a [`Bsdf`] is made from.
#[derive(Clone, Debug, PartialEq)]
pub struct BsdfFaces {
    /// Values for light that comes to the front.
    pub front: FaceValues,
    /// Values for light that comes to the back, if they are known.
    pub back: Option<FaceValues>,
    /// Number of bands.
    pub bands: usize,
}

/// Deviation of a table from reciprocity, f(i, o) = f(o, i).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reciprocity {
    /// Mean of |f(i, o) - f(o, i)| over the mean of f, in the band and the part of the table where
    /// it is largest.
    pub error: f64,
}

impl BsdfFaces {
    /// Replaces all values for which both are known by the mean of f(i, o) and f(o, i).
    pub fn make_reciprocal(&mut self) {
        let bands = self.bands;
        let parts = |values: &FaceValues| {
            [&values.reflected, &values.transmitted].map(|values| Part::new(values, bands))
        };
        let front = parts(&self.front);
        let back = self.back.as_ref().map(parts);
        average(&mut self.front.reflected, &front[0], bands);
        if let (Some(values), Some(back)) = (&mut self.back, &back) {
            average(&mut values.reflected, &back[0], bands);
            // transmission one way has to equal transmission the other way
            average(&mut self.front.transmitted, &back[1], bands);
            average(&mut values.transmitted, &front[1], bands);
        }
    }

    /// Returns the same with all values multiplied by a factor.
    fn scaled(&self, by: f64) -> Self {
        let mut faces = self.clone();
        for face in [&mut faces.front].into_iter().chain(&mut faces.back) {
            for part in [&mut face.reflected, &mut face.transmitted] {
                part.values.iter_mut().for_each(|f| *f = (f64::from(*f) * by) as f32);
            }
        }
        faces
    }

    /// Refuses values that are no scattering function in so many bands.
    fn check(&self, bands: usize) -> Checked {
        check_length(self.bands, bands)?;
        for face in [&self.front].into_iter().chain(&self.back) {
            for part in [&face.reflected, &face.transmitted] {
                let (values, pairs) = (&part.values, part.pairs());
                if values.len() != pairs * bands || bands == 0 {
                    let problem = format!("{} values for {pairs} pairs", values.len());
                    let remedy = "give one per band for each pair of directions";
                    return Err(Problem::new(problem, remedy));
                }
                if values.iter().any(|&f| !(f >= 0.0 && f.is_finite())) {
                    let problem = "a value that is below 0 or not finite";
                    return Err(Problem::new(problem, "noise below 0 counts as 0"));
                }
            }
        }
        Ok(())
    }

    /// Returns how far the values are from reciprocity.
    pub fn reciprocity(&self) -> Reciprocity {
        let part = |values: &PairValues| Part::new(values, self.bands);
        let mut errors =
            vec![difference(&self.front.reflected, &part(&self.front.reflected), self.bands)];
        if let Some(back) = &self.back {
            errors.push(difference(&back.reflected, &part(&back.reflected), self.bands));
            errors.push(difference(&self.front.transmitted, &part(&back.transmitted), self.bands));
        }
        Reciprocity { error: errors.into_iter().fold(0.0, f64::max) }
    }
}

/// Visits every pair with its index, its two directions and the product of their measures.
fn each_pair(values: &PairValues, mut visit: impl FnMut(usize, Polar, Polar, f64)) {
    let sectors = values.turns.as_deref().map_or(Sectors::full(), Sectors::between);
    let mut pair = 0;
    for row in 0..values.rows.len() {
        let (from, of_row) = (values.rows.middle(row), values.rows.measure(row));
        for column in 0..values.columns.len() {
            let (to, of_column) = (values.columns.middle(column), values.columns.measure(column));
            for sector in 0..sectors.len() {
                let to = match values.turns {
                    Some(_) => Polar { phi: from.phi + sectors.middle(sector), ..to },
                    None => to,
                };
                visit(pair, from, to, of_row * of_column * sectors.share(sector));
                pair += 1;
            }
        }
    }
}

/// Replaces each value by its mean with the value of `opposite` for light that goes the other way.
fn average(values: &mut PairValues, opposite: &Part, bands: usize) {
    let mut means = values.values.clone();
    each_pair(values, |pair, from, to, _| {
        for band in 0..bands {
            let back = opposite.value(to, from, band) as f32;
            let mean = &mut means[pair * bands + band];
            *mean = 0.5 * (*mean + back);
        }
    });
    values.values = means;
}

/// Returns the mean difference from the values of `opposite` for light that goes the other way,
/// over the mean of both, in the band where it is largest.
fn difference(values: &PairValues, opposite: &Part, bands: usize) -> f64 {
    let mut sums = vec![[0.0; 2]; bands];
    each_pair(values, |pair, from, to, measure| {
        for (band, [differences, whole]) in sums.iter_mut().enumerate() {
            let here = f64::from(values.values[pair * bands + band]);
            let back = opposite.value(to, from, band);
            *differences += measure * (here - back).abs();
            *whole += measure * 0.5 * (here + back);
        }
    });
    let lit = sums.into_iter().filter(|[_, whole]| *whole > 0.0);
    lit.map(|[differences, whole]| differences / whole).fold(0.0, f64::max)
}

impl Bsdf {
    /// The largest share of light that goes on which is taken for 1.
    pub const ROUNDED: f64 = 1.0 + TOLERATED;

    /// Makes the material from its values. `bands` are the names of the bands. Where slightly more
    /// light would go on than came, all values are scaled down. Error: there is not one value for
    /// each pair and band, a value is below 0 or not finite, or more light would go on.
    pub fn new(faces: &BsdfFaces, bands: &[&str]) -> Result<Self, Problem> {
        Self::tolerating(1.0, faces, bands).map(|(made, _)| made)
    }

    /// Makes the material like [`new`](Self::new), but scales all values down, too, where of the
    /// light from one direction up to `tolerated` would go on. Returns with it the largest fraction
    /// that went on before.
    pub fn tolerating(tolerated: f64, faces: &BsdfFaces, bands: &[&str]) -> Checked<(Self, f64)> {
        faces.check(bands.len())?;
        let made = Self::made(faces);
        let most = made.largest_share();
        if most > Self::ROUNDED && most <= tolerated {
            return Ok((Self::new(&faces.scaled(1.0 / most), bands)?, most));
        }
        if let Some(sum) = made.sums().find(|sum| sum.share > Self::ROUNDED) {
            return Err(sum.problem(bands));
        }
        let made = if most > 1.0 { Self::made(&faces.scaled(1.0 / most)) } else { made };
        Ok((made, most))
    }

    fn made(faces: &BsdfFaces) -> Self {
        let bands = faces.bands;
        let face = |values: &FaceValues| {
            let [reflected, transmitted] =
                [&values.reflected, &values.transmitted].map(|values| Part::new(values, bands));
            Box::new(Face { reflected, transmitted })
        };
        let isotropic = faces.front.reflected.turns.is_some();
        let back = faces.back.as_ref().map(face);
        Self { front: face(&faces.front), back, bands, tangents: Vec::new(), isotropic }
    }

    /// Returns the largest fraction of light that goes on, over all directions of incidence and
    /// bands.
    fn largest_share(&self) -> f64 {
        self.sums().map(|sum| sum.share).fold(0.0, f64::max)
    }

    /// Returns the fraction of light that goes on, for each direction of incidence and each band.
    fn sums(&self) -> impl Iterator<Item = Sum> {
        let of_face = |face: &Face, front: bool| {
            let sum = |row: usize, band: usize| Sum {
                share: face.reflected.row_albedo(row, band)
                    + face.transmitted.row_albedo(row, band),
                from: face.reflected.rows().middle(row),
                front,
                band,
            };
            let rows = 0..face.reflected.rows().len();
            rows.flat_map(|row| (0..self.bands).map(move |band| (row, band)))
                .map(|(row, band)| sum(row, band))
                .collect::<Vec<_>>()
        };
        let mut sums = of_face(&self.front, true);
        match &self.back {
            Some(back) => sums.extend(of_face(back, false)),
            None => {
                let Face { reflected, transmitted } = &*self.front;
                let columns = transmitted.columns();
                for column in 0..columns.len() {
                    let from = columns.middle(column);
                    for band in 0..self.bands {
                        let rows = reflected.rows().weights(from);
                        let rows = rows.list().iter();
                        let back: f64 = rows
                            .map(|&(row, weight)| {
                                f64::from(weight) * reflected.row_albedo(row, band)
                            })
                            .sum();
                        let share = back + transmitted.column_albedo(column, band);
                        sums.push(Sum { share, from, front: false, band });
                    }
                }
            }
        }
        sums.into_iter()
    }

    /// Returns reflection and transmission, as views from the light's end, for light that comes to
    /// the front or the back.
    fn ways_of_light(&self, front: bool) -> [View<'_>; 2] {
        let (face, seen_backward) = match (&self.back, front) {
            (Some(back), false) => (back, false),
            (None, false) => (&self.front, true),
            (_, true) => (&self.front, false),
        };
        [
            View { part: &face.reflected, backward: false },
            View { part: &face.transmitted, backward: seen_backward },
        ]
    }

    /// Returns reflection and transmission for a path that meets the front or the back. For a path
    /// that is followed backward the light comes from where the path goes on: back from this face,
    /// or through the sheet from the other face.
    fn ways(&self, front: bool, transport: Transport) -> [View<'_>; 2] {
        if transport == Transport::Light {
            return self.ways_of_light(front);
        }
        let [reflected, _] = self.ways_of_light(front);
        let [_, transmitted] = self.ways_of_light(!front);
        [reflected, transmitted].map(|View { part, backward }| View { part, backward: !backward })
    }

    /// Returns axes about the front's normal: the tangent has azimuth 0, the bitangent azimuth 90
    /// degrees.
    fn frame(&self, at: &Interaction) -> Frame {
        let normal = if at.front { at.normal } else { -at.normal };
        let found = self.tangents.binary_search_by_key(&at.triangle, |(triangle, _)| *triangle);
        let tangent = found.ok().and_then(|i| {
            let given = self.tangents[i].1;
            (given - given.dot(normal) * normal).try_normalize()
        });
        match tangent {
            Some(tangent) => Frame { tangent, bitangent: normal.cross(tangent), normal },
            None => Frame::new(normal),
        }
    }

    /// Returns the direction that a path comes from.
    fn near(frame: &Frame, at: &Interaction) -> Polar {
        Polar { cos: at.cos, ..polar(frame, -at.direction) }
    }
}

/// The digest of a scene is made of this text: it is that of before, when a table could be wrong.
impl fmt::Debug for Bsdf {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        let Self { front, back, bands, tangents, isotropic } = self;
        let mut text = to.debug_struct("Bsdf");
        text.field("front", front).field("back", back).field("bands", bands);
        text.field("wrong", &None::<Problem>).field("tangents", tangents);
        text.field("isotropic", isotropic).finish()
    }
}

impl Scatterer for Bsdf {
    fn lanes(&self) -> usize {
        self.front.reflected.lanes()
    }

    fn check_bands(&self, bands: usize) -> Result<(), Problem> {
        check_length(self.lanes(), bands)
    }

    fn placed(mut self, lanes: usize, tangents: Vec<(u32, Vec3)>) -> Self {
        for face in [&mut self.front].into_iter().chain(&mut self.back) {
            face.reflected.pad(lanes);
            face.transmitted.pad(lanes);
        }
        Self { tangents, ..self }
    }

    fn needs_tangents(&self) -> bool {
        !self.isotropic
    }

    #[inline(never)]
    fn sample<L: Lanes>(
        &self,
        at: &Interaction,
        transport: Transport,
        rng: &mut Stream,
    ) -> Option<BsdfSample<L>> {
        let frame = self.frame(at);
        let near = Self::near(&frame, at);
        let ways = self.ways(at.front, transport);
        let choice = choose(ways.map(|way| way.total(near)), rng)?;
        let way = ways[choice.lobe];
        let far = way.sample(near, rng)?;
        let largest = way.largest(near, far);
        if largest <= 0.0 {
            return None;
        }
        let crosses = choice.lobe == 1;
        let side = if crosses { -at.normal } else { at.normal };
        let sin = (1.0 - far.cos * far.cos).max(0.0).sqrt();
        let across = far.phi.cos() * frame.tangent + far.phi.sin() * frame.bitangent;
        let direction = (far.cos * side + sin * across).normalize();
        let weight = way.value::<L>(near, far).scaled(choice.weight / largest);
        Some(BsdfSample::diffuse(direction, weight, crosses))
    }

    fn evaluate<L: Lanes>(&self, at: &Interaction, outgoing: Vec3) -> Spectrum<L> {
        let frame = self.frame(at);
        let [reflected, transmitted] = self.ways_of_light(at.front);
        let way = if outgoing.dot(at.normal) > 0.0 { reflected } else { transmitted };
        way.value(Self::near(&frame, at), polar(&frame, outgoing))
    }

    fn pdf(&self, at: &Interaction, transport: Transport, outgoing: Vec3) -> f32 {
        let frame = self.frame(at);
        let near = Self::near(&frame, at);
        let ways = self.ways(at.front, transport);
        let total: f32 = ways.iter().map(|way| way.total(near)).sum();
        let cos = outgoing.dot(at.normal);
        let way = if cos > 0.0 { ways[0] } else { ways[1] };
        let largest = way.largest(near, polar(&frame, outgoing));
        largest * cos.abs() / total.max(f32::MIN_POSITIVE)
    }

    fn absorptance<L: Lanes>(&self, at: &Interaction) -> Option<Spectrum<L>> {
        let near = Self::near(&self.frame(at), at);
        let [reflected, transmitted] = self.ways_of_light(at.front).map(|way| way.albedo(near));
        Some(complement(reflected + transmitted))
    }

    fn is_diffuse(&self) -> bool {
        true
    }

    fn transmits_diffusely(&self) -> bool {
        let mut faces = [&self.front].into_iter().chain(&self.back);
        faces.any(|face| !face.transmitted.is_black())
    }
}

/// Converts a direction to its cosine to the normal on its side of the sheet, and its azimuth about
/// the front's normal.
fn polar(frame: &Frame, direction: Vec3) -> Polar {
    let [x, y, z] = [frame.tangent, frame.bitangent, frame.normal].map(|axis| direction.dot(axis));
    Polar { cos: z.abs().min(1.0), phi: y.atan2(x) }
}

/// Fraction of the light from a direction that goes on in a band.
struct Sum {
    share: f64,
    from: Polar,
    front: bool,
    band: usize,
}

impl Sum {
    fn problem(&self, names: &[&str]) -> Problem {
        let Self { share, from, front, band } = self;
        let face = if *front { "front" } else { "back" };
        let degrees = f64::from(from.cos.acos()).to_degrees();
        let of_band = match names {
            [_] => String::new(),
            _ => format!(" in band `{}`", names[*band]),
        };
        let problem = format!(
            "of the light that comes to the {face} at {degrees:.1} degrees {share:.4} goes on{of_band}, must be at most 1"
        );
        Problem::new(problem, "the values are f in 1/sr, without the cosine; check their unit")
    }
}
