//! Tables of copies: CSV files with one row for each copy of an object, as models of plants and
//! fields write them.

use std::path::Path;

use csv::StringRecord;
use glam::{DMat3, DVec3};

use super::csv_table::{Head, Place, check_missing, rows, twice};
use crate::input::quoted;
use phylux_core::{
    error::{Result, nearest},
    math::geometry::Transform,
};

/// Where a copy stands, how it is turned and how large it is.
const PLACED: [&str; 5] = ["x", "y", "z", "turn_deg", "scale"];
/// The first three rows of a 4 x 4 matrix: m03, m13 and m23 are the translation.
const MATRIX: [&str; 12] =
    ["m00", "m01", "m02", "m03", "m10", "m11", "m12", "m13", "m20", "m21", "m22", "m23"];
const HEADER: &str = "the first line names the columns: x,y,z and, if wanted, turn_deg (about z) and \
                      scale, or the twelve of a matrix, m00 to m23";

/// Reads the `bytes` of the table at `path`, whose lengths are in units of so many `metres`.
///
/// # Errors
/// The file has no row; or, at `path:LINE`: a column is unknown, missing or repeated, a value is
/// not a finite number, a scale is not positive, or a matrix flattens what it moves.
pub fn parse(bytes: &[u8], path: &Path, metres: f64) -> Result<Vec<Transform>> {
    rows(bytes, path, ("copy", HEADER), Header::read, |header, record, place| {
        header.copy(record, place, metres)
    })
}

/// Positions of the columns in the rows of a table.
struct Header {
    head: Head,
    columns: Columns,
}

enum Columns {
    /// Of [`PLACED`]; the last two may be missing.
    Placed([Option<usize>; 5]),
    /// Of [`MATRIX`].
    Matrix([usize; 12]),
}

impl Header {
    fn read(record: &StringRecord, place: &Place) -> Result<Self> {
        let names: Vec<&str> = record.iter().collect();
        let known = || PLACED.iter().chain(&MATRIX).copied();
        for (i, &name) in names.iter().enumerate() {
            // a column without a name is harmless as long as its cells are empty
            if !name.is_empty() && !known().any(|known| known == name) {
                let error = place.error(format!("column {} is unknown", quoted(name)));
                return Err(match nearest(name, known()) {
                    Some(near) => error.remedy(format!("did you mean `{near}`? {HEADER}")),
                    None => error.remedy(HEADER),
                });
            }
            if let Some(first) = names[..i].iter().position(|&n| n == name && !n.is_empty()) {
                return Err(twice(place, name, first, i));
            }
        }
        let at = |name: &str| names.iter().position(|&n| n == name);
        let all_of = |needed: &[&str]| {
            let missing: Vec<&str> = needed.iter().copied().filter(|n| at(n).is_none()).collect();
            check_missing(place, &missing, HEADER)
        };
        let has = |names: &[&str]| names.iter().any(|name| at(name).is_some());
        let columns = match (has(&PLACED), has(&MATRIX)) {
            (true, true) => {
                let problem = "columns of a place and of a matrix";
                return Err(place.error(problem).remedy("keep one kind"));
            }
            (_, false) => {
                all_of(&PLACED[..3])?;
                Columns::Placed(PLACED.map(at))
            }
            (false, true) => {
                all_of(&MATRIX)?;
                Columns::Matrix(MATRIX.map(|name| at(name).unwrap_or_default()))
            }
        };
        Ok(Self { head: Head::new(record), columns })
    }

    fn copy(&self, record: &StringRecord, place: &Place, metres: f64) -> Result<Transform> {
        self.head.check(record, place)?;
        let number = |i: usize| self.head.number(record, place, i);
        match &self.columns {
            Columns::Placed(columns) => {
                let value = |i: usize, default: f64| columns[i].map_or(Ok(default), number);
                let at = DVec3::new(value(0, 0.0)?, value(1, 0.0)?, value(2, 0.0)?);
                let (turn, scale) = (value(3, 0.0)?, value(4, 1.0)?);
                if scale <= 0.0 {
                    let problem = format!("scale is {scale}, must be above 0");
                    return Err(place.error(problem).remedy("a matrix can mirror a copy"));
                }
                Ok(Transform::new(scale, turn * DVec3::Z, at * metres))
            }
            Columns::Matrix(columns) => {
                let mut m = [0.0; 12];
                for (value, &i) in m.iter_mut().zip(columns) {
                    *value = number(i)?;
                }
                let row = |i: usize| DVec3::new(m[4 * i], m[4 * i + 1], m[4 * i + 2]);
                let linear = DMat3::from_cols(row(0), row(1), row(2)).transpose();
                let size = row(0).length() * row(1).length() * row(2).length();
                let determinant = linear.determinant().abs();
                if !size.is_finite() || determinant <= 1e-9 * size {
                    let problem = "the matrix flattens what it moves";
                    return Err(place.error(problem).remedy("its rows must not lie in one plane"));
                }
                let translate = DVec3::new(m[3], m[7], m[11]) * metres;
                Ok(Transform::of_matrix(linear, translate))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use phylux_testing::spoiled;

    fn read(text: &str) -> Result<Vec<Transform>> {
        parse(text.as_bytes(), Path::new("field.csv"), 0.01)
    }

    /// A turn of 90 degrees and a scale of 2, in centimetres, as a place and as a matrix.
    #[test]
    fn a_place_is_a_matrix() {
        let placed = read("scale,x,y,z,turn_deg\n2,100,200,0,90\n").unwrap();
        let matrix = "m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n";
        let matrix = read(&format!("{matrix}0,-2,0,100,2,0,0,200,0,0,2,0\n")).unwrap();
        for copy in placed.iter().chain(&matrix) {
            let point = copy.point(DVec3::new(0.5, 0.0, 0.25));
            assert!((point - DVec3::new(1.0, 3.0, 0.5)).length() < 1e-12, "{point}");
            assert!(!copy.is_mirrored());
        }
        let mirror = "m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n-1,0,0,0,0,1,0,0,0,0,1,0\n";
        assert!(read(mirror).unwrap()[0].is_mirrored());
    }

    #[test]
    fn what_is_wrong_is_named() {
        let wrong = |text: &str, words: &str| {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(words) && error.contains("field.csv"), "{error}");
        };
        wrong("", "is empty");
        wrong("x,y,z\n", "holds no copy");
        wrong("x,y\n0,0\n", "column z missing");
        wrong("x,y,z,turn\n", "did you mean `turn_deg`?");
        wrong("x,y,z,m00\n", "a place and of a matrix");
        wrong("m00,m01\n", "m02, m03");
        wrong("x,y,z,scale\n0,0,0,-1\n", "field.csv:2");
        wrong("x,y,z\n0,0,a\n", "not a finite number");
        wrong("x,y,z\n0,0,0,5\n", "4 values, but the header has 3");
        wrong("x,y,z,x\n", "columns 1 and 4 are both x");
        let flat = "m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n1,0,0,0,1,0,0,0,0,0,1,0\n";
        wrong(flat, "flattens");
    }

    const FILES: &[&str] = &[
        "x,y,z,turn_deg,scale\n1,2,3,90,2\n0,0,0,0,1\n",
        "m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n-1,0,0,1,0,1,0,2,0,0,1,3\n",
        "# a field\nx,y,z\n0.5,1e3,-2\n",
    ];
    const WORDS: &[&str] =
        &["x", "m13", "scale", "turn_deg", "1e999", "-0", ",", ";", "\"", "\n", "#"];

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// What is read places points finitely and keeps volumes; all else is an error.
        #[test]
        fn no_spoiled_file_panics(bytes in spoiled(FILES, WORDS)) {
            for copy in parse(&bytes, Path::new("field.csv"), 0.01).into_iter().flatten() {
                let moved = copy.point(DVec3::new(0.1, 0.2, 0.3));
                prop_assert!(moved.is_finite() || moved.abs().max_element() > 1e100, "{}", moved);
            }
        }
    }
}
