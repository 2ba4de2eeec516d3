//! Captor files: CSV files with one disc per row, in the file's unit of length.

use std::collections::HashMap;
use std::path::Path;

use csv::StringRecord;
use glam::DVec3;

use super::csv_table::{Head, Place, check_missing, rows, twice};
use crate::input::quoted;
use phylux_core::error::{Error, Result, nearest};
use phylux_core::math::geometry::unit_vector;

/// One row of a captor file: a disc that counts light.
#[derive(Clone, Debug, PartialEq)]
pub struct CaptorRow {
    /// Line in the file, from 1.
    pub line: u64,
    /// Id of the captor, unique in the file; `None` where the file has no column `id`.
    pub id: Option<String>,
    /// Centre, in the file's unit.
    pub center: DVec3,
    /// Radius, above 0, in the file's unit.
    pub radius: f64,
    /// Unit normal.
    pub normal: DVec3,
}

/// The seven columns that a file must have, each under either of two names.
const COLUMNS: [[&str; 2]; 7] = [
    ["x", "X"],
    ["y", "Y"],
    ["z", "Z"],
    ["radius", "rayon_capteur"],
    ["nx", "Xnorm"],
    ["ny", "Ynorm"],
    ["nz", "Znorm"],
];
const HEADER: &str = "the first line names the columns: x,y,z,radius,nx,ny,nz and, if wanted, id";

/// Reads the `bytes` of the captor file at `path`: a header, then at least one row. Columns with
/// names in `ignore` are skipped.
///
/// # Errors
/// The file has no row; or, at `path:LINE`: a column is unknown, missing or repeated, a value is
/// not a finite number, a radius is not positive, a normal has length zero, or an id is empty or
/// repeated.
pub fn parse(bytes: &[u8], path: &Path, ignore: &[String]) -> Result<Vec<CaptorRow>> {
    let mut ids: HashMap<String, u64> = HashMap::new();
    let head = |record: &StringRecord, place: &Place| Header::read(record, place, ignore);
    rows(bytes, path, ("captor row", HEADER), head, |header, record, place| {
        let row = header.row(record, place)?;
        if let Some(id) = &row.id
            && let Some(first) = ids.insert(id.clone(), row.line)
        {
            let problem = format!("id {} stands in line {first} too", quoted(id));
            return Err(place.error(problem).remedy("an id must be unique"));
        }
        Ok(row)
    })
}

/// Positions of the columns in the rows of a file.
struct Header {
    head: Head,
    /// Indices of the columns in the order of [`COLUMNS`].
    numbers: [usize; 7],
    id: Option<usize>,
}

impl Header {
    fn read(record: &StringRecord, place: &Place, ignore: &[String]) -> Result<Self> {
        let mut numbers = [None; 7];
        let mut id = None;
        for (i, name) in record.iter().enumerate() {
            if ignore.iter().any(|ignored| ignored == name) {
                continue;
            }
            let slot = match COLUMNS.iter().position(|names| names.contains(&name)) {
                Some(column) => &mut numbers[column],
                None if name == "id" => &mut id,
                // a column without a name is harmless as long as its cells are empty
                None if name.is_empty() => continue,
                None => return Err(unknown(name, record, place)),
            };
            if let Some(first) = slot.replace(i) {
                return Err(twice(place, name, first, i));
            }
        }
        let french = record.iter().any(|name| COLUMNS.iter().any(|names| names[1] == name));
        let missing: Vec<&str> = (0..7)
            .filter(|&i| numbers[i].is_none())
            .map(|i| COLUMNS[i][usize::from(french)])
            .collect();
        check_missing(place, &missing, HEADER)?;
        let numbers = numbers.map(Option::unwrap_or_default);
        Ok(Self { head: Head::new(record), numbers, id })
    }

    fn row(&self, record: &StringRecord, place: &Place) -> Result<CaptorRow> {
        self.head.check(record, place)?;
        let mut values = [0.0; 7];
        for (value, &i) in values.iter_mut().zip(&self.numbers) {
            *value = self.head.number(record, place, i)?;
        }
        let [x, y, z, radius, nx, ny, nz] = values;
        if radius <= 0.0 {
            let problem =
                format!("{} is {radius}, must be above 0", self.head.name(self.numbers[3]));
            return Err(place.error(problem).remedy("give the captor a size"));
        }
        let normal = DVec3::new(nx, ny, nz);
        let Some(normal) = unit_vector(normal) else {
            let remedy = "it says where the captor looks: 0,0,1 is up";
            return Err(place.error("the normal is 0,0,0").remedy(remedy));
        };
        let id = self.id.map(|i| record[i].to_owned());
        if id.as_deref() == Some("") {
            let remedy = "give every row an id, or leave the column out";
            return Err(place.error("the id is empty").remedy(remedy));
        }
        Ok(CaptorRow { line: place.line, id, center: DVec3::new(x, y, z), radius, normal })
    }
}

/// Returns the error for an unknown column. Such a column is refused because its name may be a
/// typing error, and skipping it could silently change what is measured.
fn unknown(name: &str, record: &StringRecord, place: &Place) -> Error {
    let separator = [(';', "semicolons"), ('\t', "tabs")];
    if record.len() == 1
        && let Some((_, what)) = separator.iter().find(|(c, _)| name.contains(*c))
    {
        return place
            .error(format!("the columns are separated by {what}"))
            .remedy("separate them by commas, and write numbers with a decimal point");
    }
    let error = place.error(format!("unknown column {}", quoted(name)));
    let known = COLUMNS.iter().flatten().copied().chain(["id"]);
    let short: String = name.chars().take(20).collect();
    // a name of one or two letters is similar to every other short name
    let near = nearest(&short, known).filter(|k| k.len() > 2 || k.eq_ignore_ascii_case(&short));
    error.did_you_mean(near, HEADER)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use phylux_testing::spoiled;

    fn parse_bytes(bytes: impl AsRef<[u8]>) -> Result<Vec<CaptorRow>> {
        parse(bytes.as_ref(), Path::new("dir/a.csv"), &[])
    }

    #[test]
    fn rows_are_read_under_either_names_in_any_order() {
        let row = |line, id: Option<&str>| CaptorRow {
            line,
            id: id.map(str::to_owned),
            center: DVec3::new(1.0, 2.0, -3.0),
            radius: 0.5,
            normal: DVec3::new(0.6, 0.0, 0.8),
        };
        for (text, expected) in [
            ("x,y,z,radius,nx,ny,nz\n1,2,-3,0.5,3,0,4", vec![row(2, None)]),
            ("X,Y,Z,rayon_capteur,Xnorm,Ynorm,Znorm\n1,2,-3,5e-1,.6,0,.8\n", vec![row(2, None)]),
            ("id,nz,ny,nx,radius,z,y,x\na,4,0,3,.5,-3,2,1\n", vec![row(2, Some("a"))]),
            (
                "\u{feff}x, y ,z,radius,nx,ny,nz,id\r\n\r\n1,2,-3, 0.5,3,0,4,b 1\r\n 1,2,-3,.5,3,0,4,\"c,\"\r\n",
                vec![row(3, Some("b 1")), row(4, Some("c,"))],
            ),
            (
                "\n\nx,y,z,radius,nx,ny,nz,\n1,2,-3,.5,3,0,4,\n,,,,,,,\n\n\n1,2,-3,.5,3,0,4,\n\n",
                vec![row(4, None), row(8, None)],
            ),
            (
                "x,y,z,radius,nx,ny,nz,id\n1,2,-3,.5,3,0,4,\"two\nlines\"\n1,2,-3,.5,3,0,4,b",
                vec![row(2, Some("two\nlines")), row(4, Some("b"))],
            ),
            (
                "x,y,z,radius,nx,ny,nz\r1,2,-3,.5,3,0,4\r1,2,-3,.5,3,0,4",
                vec![row(2, None), row(3, None)],
            ),
            ("x,y,z,radius,nx,ny,nz\n1,2,-3,.5,3e300,0,4e300", vec![row(2, None)]),
        ] {
            let mut found = parse_bytes(text).unwrap();
            for row in &mut found {
                assert!((row.normal - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-15);
                row.normal = DVec3::new(0.6, 0.0, 0.8);
            }
            assert_eq!(found, expected, "{text}");
        }
    }

    #[test]
    fn ignored_columns_may_hold_anything() {
        let text = b"id,Orientation,x,y,z,radius,nx,ny,nz\na,up,1,2,3,0.5,0,0,1";
        let ignore = ["Orientation".to_string(), "not there".into()];
        let rows = parse(text, Path::new("dir/a.csv"), &ignore).unwrap();
        assert_eq!((rows[0].id.as_deref(), rows[0].radius), (Some("a"), 0.5));
        let error = parse(text, Path::new("dir/a.csv"), &[]).unwrap_err().to_string();
        assert!(error.contains("unknown column `Orientation`"), "{error}");
    }

    #[test]
    fn errors_name_the_line_and_the_cure() {
        const H: &str = "x,y,z,radius,nx,ny,nz";
        for (text, start) in [
            (String::new(), "dir/a.csv: is empty; the first line names the columns: x,y,z"),
            ("\n\n".into(), "dir/a.csv: is empty"),
            (format!("{H}\n"), "dir/a.csv: holds no captor row"),
            (format!("{H}\n,,,,,,\n"), "dir/a.csv: holds no captor row"),
            ("x,y,z\n".into(), "dir/a.csv:1: columns radius, nx, ny, nz missing; the first line"),
            ("X,Y,Z,Xnorm,Ynorm,Znorm".into(), "dir/a.csv:1: column rayon_capteur missing"),
            ("\n0,0,1,0.1,0,0,1".into(), "dir/a.csv:2: unknown column `0`; the first line names"),
            (format!("{H},Id"), "dir/a.csv:1: unknown column `Id`; did you mean `id`?"),
            ("x,y,z,raduis".into(), "dir/a.csv:1: unknown column `raduis`; did you mean `radius`?"),
            (format!("{H},note"), "dir/a.csv:1: unknown column `note`; the first line names"),
            (format!("{H},x"), "dir/a.csv:1: columns 1 and 8 are both x; keep one of them"),
            (format!("{H},X"), "dir/a.csv:1: columns 1 and 8 are both X"),
            ("id,id".into(), "dir/a.csv:1: columns 1 and 2 are both id"),
            ("x;y;z".into(), "dir/a.csv:1: the columns are separated by semicolons; separate"),
            ("x\ty\tz".into(), "dir/a.csv:1: the columns are separated by tabs"),
            (format!("{H}\n1,2,3"), "dir/a.csv:2: 3 values, but the header has 7 columns"),
            (
                format!("{H}\n0,0,1,0,5,0,0,1"),
                "dir/a.csv:2: 8 values, but the header has 7 columns",
            ),
            (
                format!(",{H}\n7,0,0,1,1,0,0,1"),
                "dir/a.csv:2: column 1 has values, but no name; name it",
            ),
            (
                format!("{H}\n0,0,1,1,0,0,1\n0,zero,1,1,0,0,1"),
                "dir/a.csv:3: y is `zero`, not a finite",
            ),
            (format!("{H}\n0,,1,1,0,0,1"), "dir/a.csv:2: y is ``, not a finite number"),
            (format!("{H}\nnan,0,1,1,0,0,1"), "dir/a.csv:2: x is `nan`, not a finite number"),
            (format!("{H}\n0,0,1e999,1,0,0,1"), "dir/a.csv:2: z is `1e999`, not a finite number"),
            (
                format!("{H}\n0,0,1,\"0,5\",0,0,1"),
                "dir/a.csv:2: radius is `0,5`, not a finite number",
            ),
            (format!("{H}\n0,0,1,0,0,0,1"), "dir/a.csv:2: radius is 0, must be above 0"),
            (format!("{H}\n0,0,1,-1,0,0,1"), "dir/a.csv:2: radius is -1, must be above 0"),
            (format!("{H}\n0,0,1,1,0,-0,0"), "dir/a.csv:2: the normal is 0,0,0; it says"),
            (format!("{H},id\n0,0,1,1,0,0,1, "), "dir/a.csv:2: the id is empty; give every row"),
            (
                format!("{H},id\n0,0,1,1,0,0,1,a\n\n0,0,1,1,0,0,1,a"),
                "dir/a.csv:4: id `a` stands in line 2 too; an id must be unique",
            ),
            (format!("{H}\n\"0,0,1,1,0,0,1\n0,0,1,1,0,0,1"), "dir/a.csv:2: 1 values, but"),
        ] {
            let error = parse_bytes(&text).unwrap_err().to_string();
            assert!(error.starts_with(start), "{error}\n{start}");
        }
        let latin1 = parse_bytes(b"x,y,z,radius,nx,ny,nz,id\n\n0,0,1,1,0,0,1,\xfc").unwrap_err();
        assert!(latin1.to_string().starts_with("dir/a.csv:3: is not UTF-8 text; save"));
        assert!(
            parse_bytes(b"\xff\xfex\0,\0").unwrap_err().to_string().starts_with("dir/a.csv:1: is")
        );
    }

    #[test]
    fn tiny_and_huge_normals_become_unit() {
        for n in ["5e-324,0,0", "1e308,1e308,1e308", "1e-200,-1e200,3"] {
            let rows = parse_bytes(format!("x,y,z,radius,nx,ny,nz\n0,0,0,1,{n}")).unwrap();
            assert!((rows[0].normal.length() - 1.0).abs() < 1e-15);
        }
    }

    const FILES: &[&str] = &[
        "id,x,y,z,radius,nx,ny,nz\na,0,0,1,0.05,0,0,1\nb,0.5,0,1,0.05,0,0,-1\n\"c, 1\",1,0,1,0.05,1,1,1\n",
        "X,Y,Z,rayon_capteur,Xnorm,Ynorm,Znorm\r\n1,2,3,0.1,0,0,1\r\n\r\n4,5,6,0.1,0,1,0\r\n",
        "\u{feff}x;y;z;radius;nx;ny;nz\n0;0;1;0,5;0;0;1\n",
    ];
    const WORDS: &[&str] =
        &["x", "Y", "radius", "rayon_capteur", "nx", "Znorm", "id", "a", "\"\"", "\n\n"];

    fn check(bytes: &[u8]) {
        match parse_bytes(bytes) {
            Err(error) => assert!(error.to_string().starts_with("dir/a.csv:")),
            Ok(rows) => {
                assert!(!rows.is_empty() && rows.is_sorted_by(|a, b| a.line < b.line));
                let lines = bytes.iter().filter(|b| matches!(b, b'\n' | b'\r')).count() as u64 + 1;
                let ids: std::collections::HashSet<_> = rows.iter().map(|r| &r.id).collect();
                assert!(ids.len() == rows.len() || rows.iter().all(|r| r.id.is_none()));
                for row in rows {
                    assert!(row.line >= 2 && row.line <= lines);
                    assert!(row.center.is_finite() && row.radius.is_finite() && row.radius > 0.0);
                    assert!((row.normal.length() - 1.0).abs() < 1e-15);
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn no_spoiled_file_panics(bytes in spoiled(FILES, WORDS)) {
            check(&bytes);
        }

        #[test]
        fn no_bytes_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            check(&bytes);
        }
    }
}
