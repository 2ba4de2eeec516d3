//! Reads STL files, as text or binary. Each solid of a text is a group.

use glam::DVec3;
use indexmap::IndexMap;

use super::shared::{number, of_groups};
use crate::{
    input::quoted,
    obj::{MeshGroup, ObjFile, merged},
};
use phylux_core::error::{Error, Result};

/// Bytes before the triangles of a binary file: 80 of any text, and the number of triangles.
const HEAD: usize = 84;
/// Bytes of a triangle: normal and corners as 12 numbers, and 2 bytes that no standard explains.
const TRIANGLE: usize = 50;

pub fn parse(bytes: &[u8], name: &str) -> Result<ObjFile> {
    let mut facets = Facets::default();
    // a text begins with `solid`, but so do the heads of many binary files
    match binary_count(bytes) {
        Some(count) if bytes.len() == HEAD + TRIANGLE * count => facets.binary(bytes, name)?,
        _ if is_text(bytes) => facets.text(bytes, name)?,
        Some(count) if bytes.len() > HEAD + TRIANGLE * count => facets.binary(bytes, name)?,
        Some(count) => {
            let held = bytes.len().saturating_sub(HEAD) / TRIANGLE;
            let problem = format!("says {count} triangles, but holds {held} and then ends");
            return Err(Error::input(name, problem).remedy("export it again"));
        }
        None => {
            return Err(Error::input(name, "is too short for an STL file")
                .remedy("a text begins with `solid NAME`"));
        }
    }
    let Facets { groups, repeated, opposed, beyond } = facets;
    let mut file = of_groups(groups.into_values().collect(), name, "0 triangles")?;
    if opposed > 0 {
        file.notes.push(format!(
            "{opposed} of {} triangles have a normal on the other side than the order of their \
             corners says, and the order holds; turn their normals in the modelling program",
            file.triangles()
        ));
    }
    if beyond > 0 {
        let why = "they are more than the triangles that its head counts";
        file.notes.push(format!("its last {beyond} bytes are not read: {why}"));
    }
    file.merged = merged(repeated.iter().map(|(name, line)| (name, format!("line {line}"))));
    Ok(file)
}

/// The number of triangles that the head of a binary file says; `None` where it is too short.
fn binary_count(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEAD - 4..)?.first_chunk::<4>()?;
    Some(u32::from_le_bytes(*count) as usize)
}

fn is_text(bytes: &[u8]) -> bool {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    let begins = bytes.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    begins && !bytes.iter().take(1024).any(|&byte| byte == 0)
}

#[derive(Default)]
struct Facets {
    groups: IndexMap<Option<String>, MeshGroup>,
    /// Names of solids that come again, with the line.
    repeated: IndexMap<String, usize>,
    /// Number of triangles whose normal is on the other side than their corners say.
    opposed: usize,
    /// Number of bytes after the triangles.
    beyond: usize,
}

impl Facets {
    fn group(&mut self, name: Option<String>) -> &mut MeshGroup {
        let new = || MeshGroup { name: name.clone(), ..MeshGroup::default() };
        self.groups.entry(name.clone()).or_insert_with(new)
    }

    fn count_opposed(&mut self, normal: DVec3, [a, b, c]: [DVec3; 3]) {
        // a normal that is zero or no number says nothing
        let across = (b - a).cross(c - a).normalize_or_zero().dot(normal.normalize_or_zero());
        self.opposed += usize::from(across < -0.1);
    }

    fn binary(&mut self, bytes: &[u8], name: &str) -> Result<()> {
        let count = binary_count(bytes).unwrap_or(0);
        let (triangles, _) = bytes[HEAD..].as_chunks::<TRIANGLE>();
        self.beyond = bytes.len() - HEAD - TRIANGLE * count;
        for (i, triangle) in triangles.iter().take(count).enumerate() {
            let numbers = triangle.as_chunks::<4>().0;
            let at = |k: usize| f64::from(f32::from_le_bytes(numbers[k]));
            let point = |k: usize| DVec3::new(at(k), at(k + 1), at(k + 2));
            let corners = [point(3), point(6), point(9)];
            if !corners.iter().all(|corner| corner.is_finite()) {
                let problem = format!("triangle {i} has a coordinate that is no finite number");
                return Err(Error::input(name, problem)
                    .remedy("triangles are counted from 0; mend or delete it"));
            }
            self.count_opposed(point(0), corners);
            self.group(None).triangles.push(corners);
        }
        Ok(())
    }

    fn text(&mut self, bytes: &[u8], name: &str) -> Result<()> {
        let text = String::from_utf8_lossy(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes));
        let mut solid = None;
        let mut facet: Option<Facet> = None;
        // a line ends with \n, \r\n or \r
        let lines = text.split('\n').enumerate();
        let lines = lines.flat_map(|(i, line)| line.split('\r').map(move |line| (i + 1, line)));
        for (number, line) in lines {
            let error = |problem: String| {
                Error::input(format!("{name}:{number}"), problem).remedy(
                    "a triangle is `facet normal x y z`, `outer loop`, three lines `vertex x y z`, \
                     `endloop`, `endfacet`",
                )
            };
            let line = line.trim();
            let (word, rest) = line.split_once([' ', '\t']).unwrap_or((line, ""));
            let rest = rest.trim();
            match (keyword(word, rest).as_str(), &mut facet) {
                ("" | "outer" | "endloop", _) => {}
                ("solid", None) => {
                    solid = (!rest.is_empty()).then(|| rest.to_owned());
                    if let Some(again) = &solid
                        && self.groups.contains_key(&solid)
                    {
                        self.repeated.entry(again.clone()).or_insert(number);
                    }
                }
                ("endsolid", None) => solid = None,
                ("facet", None) => {
                    let mut words = rest.split_whitespace().skip(1);
                    let mut next = || words.next().and_then(|word| word.parse().ok());
                    let mut next = || next().unwrap_or(f64::NAN);
                    let normal = DVec3::new(next(), next(), next());
                    facet = Some(Facet { normal, corners: Vec::with_capacity(3) });
                }
                ("vertex", Some(Facet { corners, .. })) => {
                    if corners.len() == 3 {
                        return Err(error("a facet of more than 3 corners".into()));
                    }
                    corners.push(point(rest).map_err(error)?);
                }
                ("endfacet", Some(Facet { normal, corners })) => {
                    let [a, b, c] = corners[..] else {
                        return Err(error(format!("a facet of {} corners", corners.len())));
                    };
                    let normal = *normal;
                    facet = None;
                    self.count_opposed(normal, [a, b, c]);
                    self.group(solid.clone()).triangles.push([a, b, c]);
                }
                (_, Some(_)) => {
                    let problem = format!("{} inside of a facet", quoted(word));
                    return Err(error(problem));
                }
                _ => return Err(error(format!("{} outside of a facet", quoted(word)))),
            }
        }
        match facet {
            None => Ok(()),
            Some(_) => Err(Error::input(name, "ends inside of a facet").remedy("export it again")),
        }
    }
}

/// Returns the word of a line in small letters. Some programs write ends in two words, as `end solid`,
/// or the name of a solid right behind its end, as `endsolidNAME`.
fn keyword(word: &str, rest: &str) -> String {
    let word = word.to_ascii_lowercase();
    let whole = match word.as_str() {
        "end" => {
            let ended = rest.split_whitespace().next().unwrap_or_default();
            word + &ended.to_ascii_lowercase()
        }
        _ => word,
    };
    if whole.starts_with("endsolid") { "endsolid".into() } else { whole }
}

/// A facet that is being read.
struct Facet {
    normal: DVec3,
    corners: Vec<DVec3>,
}

/// Reads three numbers; the error is the problem alone, in words.
fn point(rest: &str) -> std::result::Result<DVec3, String> {
    let mut words = rest.split_whitespace();
    let mut found = [0.0; 3];
    for value in &mut found {
        *value = number(words.next().ok_or("a vertex of fewer than 3 numbers")?)?;
    }
    match words.next() {
        None => Ok(DVec3::from(found)),
        Some(_) => Err("a vertex of more than 3 numbers".into()),
    }
}
