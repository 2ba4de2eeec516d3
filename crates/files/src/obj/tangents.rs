//! The direction of azimuth 0 on the triangles of an OBJ file, for materials whose scattering
//! depends on the rotation about the normal: along the texture coordinate u where the corners have
//! one, otherwise along the longest edge of the face.

use glam::{DVec2, DVec3};

use super::{
    cut,
    lines::{Lines, decode, values},
};

/// Returns the direction of azimuth 0 for each triangle of a file that
/// [`ObjFile::parse`](super::ObjFile::parse) has accepted, in the order of its parts. The vectors
/// are not of unit length.
pub fn tangents(bytes: &[u8]) -> Vec<DVec3> {
    let mut tangents = Vec::new();
    each_face(bytes, |polygon, texture| of_face(polygon, texture, &mut tangents));
    tangents
}

/// Gives the corners of each face, in file order, with their texture coordinates where they have
/// any.
pub(super) fn each_face(bytes: &[u8], mut then: impl FnMut(&[DVec3], &[Option<DVec2>])) {
    let text = decode(bytes).unwrap_or_default();
    let (mut vertices, mut textures) = (Vec::new(), Vec::new());
    for line in Lines::new(&text) {
        let (word, rest) = line.split();
        let mut numbers = values(rest).map(|word| word.parse::<f64>().unwrap_or(f64::NAN));
        let mut next = || numbers.next().unwrap_or(f64::NAN);
        match word {
            "v" => vertices.push(DVec3::new(next(), next(), next())),
            "vt" => textures.push(DVec2::new(next(), next())),
            "f" | "fo" => {
                let corner = |word: &str| {
                    let mut pieces = word.split('/');
                    let vertex = named(&vertices, pieces.next()).unwrap_or(DVec3::ZERO);
                    (vertex, named(&textures, pieces.next()))
                };
                let (polygon, texture): (Vec<DVec3>, Vec<Option<DVec2>>) =
                    values(rest).map(corner).unzip();
                then(&polygon, &texture);
            }
            _ => {}
        }
    }
}

/// Returns the entry of `list` that an index of a corner names; such an index counts from 1, or
/// from -1 backwards.
fn named<T: Copy>(list: &[T], index: Option<&str>) -> Option<T> {
    let index: i64 = index?.parse().ok()?;
    let place = if index < 0 { list.len() as i64 + index } else { index - 1 };
    list.get(usize::try_from(place).ok()?).copied()
}

/// Adds the directions of azimuth 0 on the triangles of a face.
fn of_face(polygon: &[DVec3], texture: &[Option<DVec2>], tangents: &mut Vec<DVec3>) {
    let longest = longest_edge(polygon);
    for triangle in cut(polygon) {
        let along_u = || {
            let [a, b, c] = triangle.map(|i| texture[i]);
            along_u(triangle.map(|i| polygon[i]), [a?, b?, c?])
        };
        tangents.push(along_u().unwrap_or(longest));
    }
}

/// Returns the direction in which u grows and v stays constant, or `None` where the texture
/// coordinates do not determine one.
fn along_u([a, b, c]: [DVec3; 3], [ta, tb, tc]: [DVec2; 3]) -> Option<DVec3> {
    let (b, c, tb, tc) = (b - a, c - a, tb - ta, tc - ta);
    let turned = tb.perp_dot(tc);
    let along = (tc.y * b - tb.y * c) * turned.signum();
    (turned.abs() > 1e-12 * tb.length() * tc.length()).then(|| along.try_normalize())?
}

/// Returns the longest edge of a polygon, as a vector from its first to its second corner in the
/// order of the outline. Of edges with equal length, the first is returned.
pub fn longest_edge(polygon: &[DVec3]) -> DVec3 {
    let ends = polygon.iter().zip(polygon.iter().cycle().skip(1));
    ends.fold(DVec3::ZERO, |longest, (from, to)| {
        let edge = *to - *from;
        if edge.length() > longest.length() * (1.0 + 1e-6) { edge } else { longest }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_comes_before_the_longest_edge() {
        let rows: [(&str, &[DVec3]); 6] = [
            // the longer side of a rectangle, not a diagonal of its triangles
            ("v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3 4", &[DVec3::X, DVec3::X]),
            ("v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf -3 -2 -1 -4", &[DVec3::NEG_X, DVec3::NEG_X]),
            // u along y, whatever the edges are
            ("v 0 0 0\nv 2 0 0\nv 2 1 0\nvt 0 0\nvt 0 -1\nvt 1 -1\nf 1/1 2/2 3/3", &[DVec3::Y]),
            // mirrored texture coordinates
            ("v 0 0 0\nv 2 0 0\nv 2 1 0\nvt 0 0\nvt 0 1\nvt 1 1\nf 1/1/1 2/2/1 3/3/1", &[DVec3::Y]),
            // no texture coordinates, coordinates without area, and coordinates that are missing
            ("v 0 0 0\nv 2 0 0\nv 2 1 0\nvt 0 0\nf 1/1 2/1 3/1\nf 1/7 2/8 3/9", &[DVec3::ZERO; 0]),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3", &[DVec3::new(-1.0, 1.0, 0.0).normalize()]),
        ];
        for (text, expected) in rows {
            let found = tangents(text.as_bytes());
            let longest = DVec3::new(2.0, 1.0, 0.0).normalize();
            let expected = if expected.is_empty() { vec![-longest; 2] } else { expected.to_vec() };
            assert_eq!(found.len(), expected.len(), "{text}");
            for (found, expected) in found.iter().zip(&expected) {
                assert!(found.normalize().distance(*expected) < 1e-12, "{text}: {found}");
            }
        }
    }
}
