//! Cuts triangles along the outline of a mask.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use i_overlay::{
    core::{fill_rule::FillRule, overlay_rule::OverlayRule},
    float::single::SingleFloatOverlay,
};

use super::{bitmap::Bitmap, outline::Outline};

/// The most copies of a picture that one triangle may show.
const MAX_REPEATS: f64 = 10_000.0;

/// The smallest part of a triangle's area that becomes a piece; what is smaller comes from rounding.
const SMALLEST: f64 = 1e-10;

/// A part of a triangle that a mask leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Its corners, in the order of those of the triangle.
    pub corners: [DVec3; 3],
    /// Index of the triangle.
    pub source: usize,
}

/// Pieces of a triangle in barycentric coordinates; `None` where the triangle stays whole.
type Cut = Option<Vec<[DVec3; 3]>>;

/// A mask, ready to cut triangles.
#[derive(Debug)]
pub struct Mask {
    bitmap: Bitmap,
    /// Whether the texels of the border go on outside the picture, which repeats otherwise.
    clamp: bool,
    /// The outline in texture coordinates; `None` where the picture is all there or all clear.
    outline: Option<Outline>,
}

impl Mask {
    /// Makes a mask. With `clamp`, the texels of the border go on for `reach` pictures; otherwise
    /// the picture repeats. Error, in words: the outline has too many corners.
    pub fn new(bitmap: Bitmap, clamp: bool, reach: f64) -> Result<Self, String> {
        let all = bitmap.texels[0];
        let outline = match bitmap.texels.iter().all(|there| *there == all) {
            true => None,
            false => Some(Outline::of(&bitmap, clamp.then_some(reach))?),
        };
        Ok(Self { bitmap, clamp, outline })
    }

    /// Returns whether the surface is there at a texture coordinate.
    fn is_there(&self, at: DVec2) -> bool {
        let size = DVec2::new(self.bitmap.width as f64, self.bitmap.height as f64);
        let at = if self.clamp { at } else { at - at.floor() };
        let texel = (at * size).floor().clamp(DVec2::ZERO, size - 1.0);
        self.bitmap.at(texel.x as i64, texel.y as i64)
    }

    /// Cuts triangles, each given with the texture coordinates of its corners or with none, in
    /// which case it stays whole. At most `most` pieces are made. Error, in words: there would be
    /// more, or the picture repeats too often on one triangle.
    ///
    /// A triangle whose texture coordinates have no area is there as a whole or not at all, as the
    /// texel in its middle says.
    pub fn cut(
        &self,
        triangles: &[[DVec3; 3]],
        textures: &[Option<[DVec2; 3]>],
        most: usize,
    ) -> Result<Vec<Piece>, String> {
        // leaves of a plant often show the same part of the picture
        let mut known: HashMap<[u64; 6], Cut> = HashMap::new();
        let mut pieces = Vec::new();
        for (source, (triangle, texture)) in triangles.iter().zip(textures).enumerate() {
            let cut = match texture {
                None => &None,
                Some(texture) => {
                    let [a, b, c] = texture.map(|t| t.to_array().map(f64::to_bits));
                    let key = [a[0], a[1], b[0], b[1], c[0], c[1]];
                    if !known.contains_key(&key) {
                        // a mesh without repetition must not fill the memory twice
                        if known.len() > 10_000 {
                            known.clear();
                        }
                        known.insert(key, self.cut_one(texture, most)?);
                    }
                    &known[&key]
                }
            };
            match cut {
                None => pieces.push(Piece { corners: *triangle, source }),
                Some(cut) => pieces.extend(cut.iter().map(|weights| {
                    let [a, b, c] = triangle;
                    let corners = weights.map(|w| w.x * a + w.y * b + w.z * c);
                    Piece { corners, source }
                })),
            }
            if pieces.len() > most {
                return Err(too_many(most));
            }
        }
        Ok(pieces)
    }

    fn cut_one(&self, texture: &[DVec2; 3], most: usize) -> Result<Cut, String> {
        let whole = |there: bool| if there { None } else { Some(Vec::new()) };
        let [a, b, c] = *texture;
        let twice = (b - a).perp_dot(c - a);
        let longest = (b - a).length().max((c - a).length());
        let Some(outline) = &self.outline else { return Ok(whole(self.bitmap.texels[0])) };
        if twice.abs() <= 1e-12 * longest * longest || !twice.is_finite() {
            return Ok(whole(self.is_there((a + b + c) / 3.0)));
        }
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let (first, end) = match self.clamp {
            true => (DVec2::ZERO, DVec2::ONE),
            false => (low.floor(), high.ceil()),
        };
        let tiles = end - first;
        if tiles.element_product() > MAX_REPEATS {
            return Err(format!(
                "repeats {:.0} times on one triangle, more than {MAX_REPEATS}; scale the texture \
                coordinates",
                tiles.element_product()
            ));
        }
        let mut pieces = Vec::new();
        for tile in 0..tiles.element_product() as usize {
            let columns = tiles.x as usize;
            let origin = first + DVec2::new((tile % columns) as f64, (tile / columns) as f64);
            // corners of a piece, as weights of those of the triangle
            let weights = |at: DVec2| {
                let (p, q, r) = (a - origin - at, b - origin - at, c - origin - at);
                let u = q.perp_dot(r) / twice;
                let v = r.perp_dot(p) / twice;
                DVec3::new(u, v, 1.0 - u - v)
            };
            for corners in clipped(outline, texture.map(|t| t - origin)) {
                let area = 0.5 * (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
                if area.abs() <= 0.5 * SMALLEST * twice.abs() {
                    continue;
                }
                let mut piece = corners.map(weights);
                if area * twice < 0.0 {
                    piece.swap(1, 2);
                }
                pieces.push(piece);
            }
            if pieces.len() > most {
                return Err(too_many(most));
            }
        }
        let share = |[a, b, c]: &[DVec3; 3]| (b - a).truncate().perp_dot((c - a).truncate()).abs();
        let left: f64 = pieces.iter().map(share).sum();
        // what is whole but for rounding stays as it is
        Ok(if left >= 1.0 - 1e-8 { None } else { Some(pieces) })
    }
}

fn too_many(most: usize) -> String {
    format!("leaves more than {most} triangles; shrink or smooth the picture, or use fewer copies")
}

/// Returns the part of a triangle inside the outline, as triangles.
fn clipped(outline: &Outline, triangle: [DVec2; 3]) -> Vec<[DVec2; 3]> {
    let [a, b, c] = triangle;
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    // a line beside the triangle goes around none of its points
    let near = outline
        .contours
        .iter()
        .filter(|line| line.low.cmple(high).all() && line.high.cmpge(low).all());
    let lines: Vec<Vec<[f64; 2]>> = near.map(|line| line.corners.clone()).collect();
    if lines.is_empty() {
        return Vec::new();
    }
    let triangle = triangle.map(|p| p.to_array()).to_vec();
    let shapes = lines.overlay(&triangle, OverlayRule::Intersect, FillRule::EvenOdd);
    let mut triangles = Vec::new();
    let mut earcut = earcut::Earcut::new();
    let mut corners: Vec<usize> = Vec::new();
    for shape in shapes {
        let mut holes = Vec::new();
        let mut end = 0;
        for line in &shape {
            if end > 0 {
                holes.push(end);
            }
            end += line.len();
        }
        let points: Vec<[f64; 2]> = shape.concat();
        earcut.earcut(points.iter().copied(), &holes, &mut corners);
        let of = |t: &[usize; 3]| t.map(|i| DVec2::from_array(points[i]));
        triangles.extend(corners.as_chunks::<3>().0.iter().map(of));
    }
    triangles
}
