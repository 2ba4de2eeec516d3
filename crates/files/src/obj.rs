//! Reads OBJ and MTL files as they are written: groups, triangles and material entries, without
//! unit, transform or meaning. Meshes in memory and other files of meshes take the same form.
//!
//! The crate tobj reads the geometry. It reports no line numbers, accepts NaN and panics on some
//! files. Therefore `scan` checks every line first, and tobj is given only valid `v` and `f` lines,
//! with one model per part.

mod lines;
mod mesh;
mod mtl;
mod part;
mod scan;
mod tangents;
mod texture;

use std::path::Path;

use glam::DVec3;

use crate::input::quoted;
use lines::{Lines, decode};
use phylux_core::error::{Error, LISTED, Result, some};
use phylux_core::math::{
    geometry::{is_bent, is_tangled, triangulate},
    machine::{gib, memory_left},
};
use scan::Scan;

pub use mesh::{Mesh, MeshGroup};
pub use mtl::{MissingMtl, MtlEntry, MtlLibrary};
pub use part::{ObjGroup, ObjPart};
pub use scan::MAX_CORNERS;
pub use tangents::{longest_edge, tangents};
pub use texture::{TextureMap, textures};

/// How many bytes a byte of an OBJ file takes while it is read, with its triangles.
const PARSING: u64 = 8;
/// Any machine has so many bytes left.
const SMALL: u64 = 1 << 24;

/// The content of an OBJ file and of its MTL files.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ObjFile {
    /// The groups that have faces, in order of their first face.
    pub groups: Vec<ObjGroup>,
    /// Runs of faces with one group and one material, in file order; at least one.
    pub parts: Vec<ObjPart>,
    /// The material entries of the MTL files that the OBJ file names.
    pub mtl: MtlLibrary,
    /// What a user should know of the file's content that is not used: sentences without a place.
    pub notes: Vec<String>,
    /// Groups that became one because they have one name: a sentence without a place, which matters
    /// where groups count light.
    pub merged: Option<String>,
    /// Whether the file is a glTF: its lengths are metres, whatever the scene's unit, and its y axis
    /// points up, but the triangles here are turned already so that z points up.
    pub is_gltf: bool,
}

impl ObjFile {
    /// Reads the `bytes` of the OBJ file at `path`. `load_mtl` fetches the bytes of an MTL file, or
    /// says why it cannot; the paths of MTL files are relative to the OBJ file.
    ///
    /// # Errors
    /// The file is not OBJ text or has no face; or, at `path:LINE`, a line cannot be understood: a
    /// coordinate is not a finite number, a corner names a vertex that does not exist, and the
    /// like.
    pub fn parse(
        bytes: &[u8],
        path: &Path,
        load_mtl: impl FnMut(&Path) -> std::result::Result<Vec<u8>, String>,
    ) -> Result<Self> {
        let needed = PARSING * bytes.len() as u64;
        let left = if needed < SMALL { SMALL } else { memory_left() };
        if needed > left {
            let problem = format!(
                "takes {:.1} GiB of memory to read, of {:.1} that are left",
                gib(needed),
                gib(left)
            );
            return Err(Error::input(path.display(), problem).remedy("use a coarser mesh"));
        }
        let text = decode(bytes).map_err(|why| {
            Error::input(path.display(), why).remedy("an OBJ file is plain text in UTF-8")
        })?;
        let mut scan = Scan::new(path.display().to_string());
        for line in Lines::new(&text) {
            scan.line(&line)?;
        }
        if scan.parts.is_empty() {
            let found = match scan.vertices {
                0 if text.trim().is_empty() => "is empty".into(),
                n => format!("holds no face ({n} vertices)"),
            };
            return Err(Error::input(scan.path, found).remedy("a face is a line `f 1 2 3`"));
        }
        let mtl = MtlLibrary::load(&scan.mtllibs, path, load_mtl);
        drop(text);
        let mut parts = scan.parts;
        load_triangles(scan.sound, &mut parts)
            .map_err(|e| Error::input(&scan.path, format!("tobj cannot read it: {e}")))?;
        let notes = scan
            .unused
            .iter()
            .map(|(line, word, meaning)| format!("`{word}` at line {line} is not read: {meaning}"));
        let merged = merged(scan.merged.iter().map(|(name, line)| (name, format!("line {line}"))));
        let (groups, notes) = (scan.groups, notes.collect());
        Ok(Self { groups, parts, mtl, notes, merged, is_gltf: false })
    }

    /// Returns the number of triangles in all parts.
    pub fn triangles(&self) -> usize {
        self.parts.iter().map(|part| part.triangles.len()).sum()
    }
}

/// Says that groups became one; `again` holds the name and the place of each that came again.
pub fn merged<'a>(again: impl ExactSizeIterator<Item = (&'a String, String)>) -> Option<String> {
    let count = again.len();
    let names = match count {
        1 => "the name of a group comes".into(),
        _ => format!("{count} names of groups come"),
    };
    let places = some(again.map(|(name, place)| format!("{} at {place}", quoted(name))), LISTED);
    (count > 0).then(|| {
        format!(
            "{names} again ({places}), and groups of one name are one captor; give each a name \
            of its own to count its light by itself"
        )
    })
}

/// Lets tobj read the checked text `sound` and fills in the triangles of the parts, one model per
/// part.
fn load_triangles(
    sound: String,
    parts: &mut [ObjPart],
) -> std::result::Result<(), tobj::LoadError> {
    // keep polygons whole: tobj would cut them into fans, which is wrong for concave ones
    let options = tobj::LoadOptions::default();
    let no_mtl = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut sound.as_bytes(), &options, no_mtl)?;
    drop(sound);
    debug_assert_eq!(models.len(), parts.len());
    for (part, model) in parts.iter_mut().zip(models) {
        let mesh = model.mesh;
        let positions = mesh.positions.as_chunks::<3>().0;
        let corner = |i: &u32| DVec3::from_array(positions[*i as usize]);
        if mesh.face_arities.is_empty() {
            let faces = mesh.indices.as_chunks::<3>().0;
            part.triangles = faces.iter().map(|f| f.each_ref().map(corner)).collect();
            continue;
        }
        let mut indices = mesh.indices.iter();
        let mut polygon = Vec::new();
        for arity in mesh.face_arities {
            polygon.clear();
            polygon.extend(indices.by_ref().take(arity as usize).map(corner));
            let cut = cut(&polygon);
            part.tangled += usize::from(is_tangled(&polygon, &cut));
            part.bent += usize::from(is_bent(&polygon));
            part.triangles.extend(cut.iter().map(|t| t.map(|i| polygon[i])));
        }
    }
    Ok(())
}

/// Cuts a face into triangles, as indices of its corners.
pub fn cut(polygon: &[DVec3]) -> Vec<[usize; 3]> {
    let cut = triangulate(polygon);
    match cut.is_empty() {
        // no ear was found in a tangled outline, but a face must not vanish, so it becomes a fan
        true => (2..polygon.len()).map(|i| [0, i - 1, i]).collect(),
        false => cut,
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::{Display, Write as _};

    use proptest::prelude::*;

    use super::scan::MAX_CORNERS;
    use super::*;
    use phylux_testing::spoiled;

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    fn parse(text: impl AsRef<[u8]>) -> Result<ObjFile> {
        ObjFile::parse(text.as_ref(), Path::new("dir/a.obj"), |_| {
            Err("there is no such file".into())
        })
    }

    fn parse_square(rest: impl Display) -> ObjFile {
        parse(format!("{SQUARE}{rest}")).unwrap()
    }

    fn area(triangles: &[[DVec3; 3]]) -> f64 {
        triangles.iter().map(phylux_core::math::geometry::area).sum()
    }

    /// Returns group name, material, line and number of triangles of each part.
    fn outline<'a>(file: &'a ObjFile) -> Vec<(Option<&'a str>, Option<&'a str>, usize, usize)> {
        let name = |p: &ObjPart| file.groups[p.group].name.as_deref();
        let row = |p: &'a ObjPart| (name(p), p.material.as_deref(), p.line, p.triangles.len());
        file.parts.iter().map(row).collect()
    }

    #[test]
    fn faces_are_read_however_they_are_written() {
        let (a, b, c) = (DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0));
        for face in [
            "f 1 2 3",
            "  f\t1   2\t3  ",
            "f 1 2 3\r",
            "f -4 -3 -2",
            "f 1/1 2/2 3/3",
            "f 1//1 2//9 3//-7",
            "f 1/2/3 2//5 3",
            "f 1/ 2// 3",
            "f 1 \\\n2 \\\r\n 3",
            "f 1 2 3 # front",
            "f 1 2 3 \\",
            "\\\nf 1 2 3",
            "f 1 2 3 # C:\\dir\\\nf 1 2 3",
            "fo 1 2 3",
            "f +1 2 3",
            "# C:\\dir\\\nf 1 2 3",
            "# \u{fc}\ns off\nvn 0 0 nan\nvt\np 1\nl 1 2\nf 1 2 3",
        ] {
            let file = parse_square(face);
            assert_eq!(file.parts[0].triangles[0], [a, b, c], "{face:?}");
            assert_eq!(file.parts[0].triangles.len(), face.matches("f 1 2").count().max(1));
        }
        let latin1 = parse([SQUARE.as_bytes(), b"# gr\xfcn\nf 1 2 3"].concat()).unwrap();
        assert_eq!(latin1.parts[0].triangles, [[a, b, c]]);
        let bom = parse(format!("\u{feff}{SQUARE}f 1 2 3")).unwrap();
        assert_eq!(bom.parts[0].triangles, [[a, b, c]]);
    }

    #[test]
    fn vertices_keep_double_precision_and_drop_weights_and_colours() {
        for tail in ["", " 2", " .1 .2 .3", " .1 .2 .3 1", " # far", " nan"] {
            let file =
                parse(format!("v 10000.00000001 -1e-3 +2.5{tail}\nv 1 0 0\nv 0 1 0\nf 1 2 3"))
                    .unwrap();
            let expected = DVec3::new(10000.00000001, -1e-3, 2.5);
            assert_eq!(file.parts[0].triangles[0][0], expected, "{tail}");
        }
    }

    #[test]
    fn concave_polygons_keep_their_area_and_side() {
        let ell = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\n";
        // start the outline at each of its corners, since a fan would depend on the first one
        for first in 0..6 {
            let corners: Vec<String> = (0..6).map(|i| ((first + i) % 6 + 1).to_string()).collect();
            let file = parse(format!("{ell}f 1 2 3\nf {}", corners.join(" "))).unwrap();
            let cut = &file.parts[0].triangles[1..];
            assert_eq!((cut.len(), area(cut)), (4, 3.0));
            assert!(cut.iter().all(|[a, b, c]| (b - a).cross(c - a).z >= 0.0));
        }
    }

    #[test]
    fn faces_without_area_are_kept() {
        for (face, n) in [("f 1 1 2", 1), ("f 1 1 1 1", 2), ("f 1 3 2 4 1", 3), ("f 1 2 1 2", 2)] {
            assert_eq!(parse_square(face).parts[0].triangles.len(), n, "{face}");
        }
    }

    #[test]
    fn groups_and_materials_make_parts() {
        type Rows<'a> = &'a [(Option<&'a str>, Option<&'a str>, usize, usize)];
        let rows: [(&str, Rows); 9] = [
            ("f 1 2 3", &[(None, None, 5, 1)]),
            ("f 1 2 3\no a\nf 1 2 3", &[(None, None, 5, 1), (Some("a"), None, 7, 1)]),
            ("g a b\to \nf 1 2 3", &[(Some("a b\to"), None, 6, 1)]),
            ("o a\ng b\nf 1 2 3", &[(Some("b"), None, 7, 1)]),
            ("g b\no a\nf 1 2 3", &[(Some("a"), None, 7, 1)]),
            ("o a\ng\nf 1 2 3", &[(Some("default"), None, 7, 1)]),
            (
                "g a\nf 1 2 3\ng b\nf 1 2 3\ng a\nf 1 2 3 4",
                &[(Some("a"), None, 6, 1), (Some("b"), None, 8, 1), (Some("a"), None, 10, 2)],
            ),
            (
                "usemtl my leaf #2\nf 1 2 3\nusemtl my leaf #2\nf 1 2 3\nusemtl\nf 1 2 3",
                &[(None, Some("my leaf #2"), 6, 2), (None, None, 10, 1)],
            ),
            ("usemtl a\ng x\nusemtl b\ng x\nf 1 2 3", &[(Some("x"), Some("b"), 9, 1)]),
        ];
        for (text, expected) in rows {
            assert_eq!(outline(&parse_square(text)), expected, "{text}");
        }
        // groups without faces do not count; a name that occurs again continues its group
        let file = parse_square("g empty\ng a\nf 1 2 3\ng b\nf 1 2 3\ng a\nf 1 2 3");
        let names: Vec<_> = file.groups.iter().map(|g| g.name.as_deref()).collect();
        assert_eq!(names, [Some("a"), Some("b")]);
    }

    #[test]
    fn errors_name_the_line_and_the_cure() {
        let square = |rest: &str| format!("{SQUARE}{rest}").into_bytes();
        let many = format!("f{}", " 1".repeat(MAX_CORNERS + 1));
        let rows: [(Vec<u8>, &str); 34] = [
            (b"".into(), "dir/a.obj: is empty; a face is a line `f 1 2 3`"),
            (b" \n\n".into(), "dir/a.obj: is empty"),
            (square("p 1\nl 1 2"), "dir/a.obj: holds no face (4 vertices)"),
            (square("# f 1 2 3"), "dir/a.obj: holds no face"),
            (b"\x7fELF\0\0".into(), "dir/a.obj: is not UTF-8 text but binary"),
            (b"\xff\xfev\0 \0".into(), "dir/a.obj: is not UTF-8 text but binary, or UTF-16"),
            (b"\x80\x81 1".into(), "dir/a.obj:1: unknown word `\u{fffd}\u{fffd}`; is it an OBJ"),
            (b"g gr\xfcn".into(), "dir/a.obj:1: the name `gr\u{fffd}n` is not valid UTF-8; save"),
            (b"usemtl \xfc".into(), "dir/a.obj:1: the name `\u{fffd}` is not valid UTF-8"),
            (b"v 1 2".into(), "dir/a.obj:1: vertex of 2 numbers; write `v x y z`"),
            (b"v".into(), "dir/a.obj:1: vertex of 0 numbers"),
            (b"v 1 2 3 4 5".into(), "dir/a.obj:1: vertex of 5 numbers"),
            (b"v 1 2 3 4 5 6 7 8".into(), "dir/a.obj:1: vertex of 8 numbers"),
            (b"v 1 2 3 v 1 2 3".into(), "dir/a.obj:1: `v` is not a finite number"),
            (b"\n\nv 0 NaN 0".into(), "dir/a.obj:3: `NaN` is not a finite number; a vertex is"),
            (b"v 0 0 -inf".into(), "dir/a.obj:1: `-inf` is not a finite number"),
            (b"v 1e999 0 0".into(), "dir/a.obj:1: `1e999` is not a finite number"),
            (b"v 1,5 0 0".into(), "dir/a.obj:1: `1,5` is not a finite number"),
            (b"f 1 2 3".into(), "dir/a.obj:1: corner 1, but no vertex stands before this face"),
            (square("f 1 2 5\nv 2 2 2"), "dir/a.obj:5: corner 5, but only 4 vertices stand before"),
            (
                square("f 0 1 2"),
                "dir/a.obj:5: corner 0 does not exist; vertices are counted from 1",
            ),
            (square("f 1 2 -5"), "dir/a.obj:5: corner -5, but only 4 vertices"),
            (square("f 1 2 4000000000"), "dir/a.obj:5: corner 4000000000, but only"),
            (square("f 1 2 -9223372036854775808"), "dir/a.obj:5: corner -9223372036854775808"),
            (square("f 1 2 99999999999999999999"), "dir/a.obj:5: `99999999999999999999` is not a"),
            (square("f 1 2 4e9"), "dir/a.obj:5: `4e9` is not a corner; write vertex,"),
            (square("f 1 2 3/4/5/6"), "dir/a.obj:5: `3/4/5/6` is not a corner"),
            (square("f 1 2 3/x"), "dir/a.obj:5: `3/x` is not a corner"),
            (square("f 1 2 //3"), "dir/a.obj:5: `//3` is not a corner"),
            (square("f 1 \\\n2"), "dir/a.obj:5: face of 2 corners, must have at least 3; delete"),
            (square("f"), "dir/a.obj:5: face of 0 corners"),
            (square(&many), "dir/a.obj:5: face of more than 10000 corners; cut it"),
            (square("usemlt a"), "dir/a.obj:5: unknown word `usemlt`; did you mean `usemtl`?"),
            (square("F 1 2 3"), "dir/a.obj:5: unknown word `F`; did you mean `f`?"),
        ];
        for (text, start) in rows {
            let error = parse(&text).unwrap_err().to_string();
            assert!(error.starts_with(start), "{error}\n{start}");
        }
        let error = parse("surf 0 1 0 1").unwrap_err().to_string();
        assert!(error.starts_with("dir/a.obj:1: free-form surfaces (`surf`) are not supported"));
        let error = parse("solid ascii-stl").unwrap_err().to_string();
        assert!(error.ends_with("is it an OBJ file? comments begin with #"), "{error}");
    }

    #[test]
    fn long_lines_do_no_harm() {
        let long = "1 ".repeat(5_000_000);
        for start in ["# ", "g ", "vt ", "mtllib ", "usemtl "] {
            assert!(parse(format!("{SQUARE}{start}{long}\nf 1 2 3")).is_ok());
        }
        for start in ["f ", "v ", "\u{e9}", "f \\\n"] {
            assert!(parse(format!("{SQUARE}{start}{long}")).unwrap_err().to_string().len() < 200);
        }
        let joined = "\\\n".repeat(5_000_000);
        assert!(parse(format!("{SQUARE}f 1 2 {joined} 3")).is_ok());
        assert!(parse(long.trim().replace(' ', "")).unwrap_err().to_string().len() < 200);
    }

    const FILES: &[&str] = &[
        "mtllib a.mtl\no bench\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl wood\nf 1 2 3 4\nf 1 3 4\n",
        "v 0 0 0 1 0 0\r\nv 2 0 0 1 0 0\r\nv 2 1 0 1 0 0\r\nv 1 1 0\r\nv 1 2 0\r\nv 0 2 0\r\n\
         g ell\r\nf 1/1/1 2//1 3 4 5 6\r\nf -1 -2 -3\r\n",
        "v 0 0 0\nv 1 0 0\nv 1 1 1\nvn 0 0 1\nvt 0 0\nf 1 2 \\\n 3\ng a b\nusemtl my leaf\nf 1//1 2//1 3//1\n\
         g\nl 1 2\np 1\nf 3 2 1 # back\ng a b\nf 2 1 3\ns off\n",
    ];
    const WORDS: &[&str] =
        &["v", "f", "g", "o", "usemtl", "mtllib", "a.mtl", "surf", "s", "l", "vt", "fo"];

    /// Checks what must hold of every result, whatever the text.
    fn check(bytes: &[u8], result: &Result<ObjFile>) {
        match result {
            Err(error) => assert!(error.to_string().starts_with("dir/a.obj:")),
            Ok(file) => {
                let text = String::from_utf8_lossy(bytes);
                let mut used = 0;
                let mut last = 0;
                for part in &file.parts {
                    assert!(part.group <= used, "groups in order of first face");
                    used = used.max(part.group + 1);
                    assert!(part.line > last && !part.triangles.is_empty());
                    last = part.line;
                    let line = text.lines().nth(last - 1).unwrap();
                    assert!(
                        line.trim_start_matches('\u{feff}').trim_start().starts_with(['f', '\\'])
                    );
                    assert!(part.triangles.iter().flatten().all(|p| p.is_finite()));
                }
                assert_eq!(used, file.groups.len());
            }
        }
    }

    /// The configuration of proptest; the environment variable PROPTEST_CASES sets the number of
    /// cases.
    fn config() -> ProptestConfig {
        ProptestConfig { failure_persistence: None, ..ProptestConfig::default() }
    }

    proptest! {
        #![proptest_config(config())]

        #[test]
        fn no_spoiled_file_panics(bytes in spoiled(FILES, WORDS)) {
            check(&bytes, &parse(&bytes));
        }

        #[test]
        fn no_bytes_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            check(&bytes, &parse(&bytes));
        }

        /// Triangles written in one of many ways are read back exactly, in their groups.
        #[test]
        fn what_is_written_is_read(
            faces in proptest::collection::vec(
                (any::<[[f32; 3]; 3]>(), 0..4u8, 0..3u8, 0..6u8), 1..20),
        ) {
            let mut text = String::new();
            let mut expected: Vec<(Option<String>, Option<String>, [DVec3; 3])> = Vec::new();
            let mut name = None;
            let mut material = None;
            for (corners, g, m, style) in faces {
                prop_assume!(corners.iter().flatten().all(|x| x.is_finite()));
                let corners = corners.map(|c| DVec3::from_array(c.map(f64::from)));
                let n = 3 * expected.len();
                for p in corners {
                    writeln!(text, "v {:e} {} {:?}", p.x, p.y, p.z).unwrap();
                }
                if g > 0 {
                    name = Some(format!("leaf {g}"));
                    writeln!(text, "{} leaf {g}", if g > 1 { 'o' } else { 'g' }).unwrap();
                }
                if m > 0 {
                    material = Some(format!("m{m}"));
                    writeln!(text, "usemtl m{m}").unwrap();
                }
                let (i, j, k) = (n + 1, n + 2, n + 3);
                match style {
                    0 => writeln!(text, "f {i} {j} {k}"),
                    1 => writeln!(text, "f -3 -2 -1\r"),
                    2 => writeln!(text, "f {i}/7/8 {j}//8 {k}"),
                    3 => writeln!(text, "\tf {i} \\\n{j}\t{k} # x"),
                    4 => writeln!(text, "f -3/1 {j}/2 -1/3\n# end \\"),
                    _ => writeln!(text, "vn 0 0 1\nvt 0 0\nf {i}/-1/-1 {j}/-1/-1 {k}/-1/-1"),
                }
                .unwrap();
                expected.push((name.clone(), material.clone(), corners));
            }
            let file = parse(&text).unwrap();
            let found: Vec<_> = file.parts.iter().flat_map(|p| {
                let name = &file.groups[p.group].name;
                p.triangles.iter().map(|t| (name.clone(), p.material.clone(), *t))
            }).collect();
            prop_assert_eq!(found, expected);
        }
    }
}
