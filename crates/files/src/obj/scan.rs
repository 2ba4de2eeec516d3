//! The first pass over an OBJ file: checks each line, follows groups and materials, and writes down
//! the lines that tobj is given.

use std::collections::HashMap;
use std::fmt::Write as _;

use indexmap::IndexMap;

use super::lines::{Line, values};
use super::part::{ObjGroup, ObjPart};
use crate::input::quoted;
use phylux_core::error::{Error, Result, nearest};

/// The largest number of corners of a polygon. More are refused, because the time to cut a polygon
/// into triangles grows with the square of the number.
pub const MAX_CORNERS: usize = 10_000;

/// Lines that describe no surface: normals and texture coordinates, points and lines, display
/// settings, and free-form curves. They are skipped.
#[rustfmt::skip]
const IGNORED: &[&str] = &[
    "vt", "vn", "vp", "p", "l", "s", "mg", "lod", "bevel", "c_interp", "d_interp", "maplib", "ctech", "stech",
    "cstype", "deg", "bmat", "step", "curv", "curv2", "parm", "trim", "hole", "scrv", "sp", "end", "con", "cdc",
    "res",
];
/// Lines that mean something for light but are not used, and what they mean. The first of each is
/// told to the user.
const UNUSED: [(&str, &str); 3] = [
    ("usemap", "a picture on the faces; the material of a face has one colour everywhere"),
    ("shadow_obj", "another file whose shape casts the shadows; the faces of this file cast them"),
    ("trace_obj", "another file whose shape is seen in mirrors; the faces of this file are"),
];
/// Surfaces that are not made of polygons.
const FREE_FORM: [&str; 4] = ["surf", "bsp", "bzp", "cdp"];
/// The first words of lines that are read.
const READ: [&str; 6] = ["usemtl", "mtllib", "v", "f", "o", "g"];

/// The state of the first pass between two lines.
pub struct Scan {
    pub path: String,
    /// The text that tobj is given.
    pub sound: String,
    /// Number of vertices so far.
    pub vertices: i64,
    /// The groups that have faces so far, in order of their first face.
    pub groups: Vec<ObjGroup>,
    /// Index into `groups` by name.
    by_name: HashMap<Option<String>, usize>,
    /// The runs of faces so far, still without triangles.
    pub parts: Vec<ObjPart>,
    /// The group that applies to the next face.
    group: Option<String>,
    material: Option<String>,
    /// Whether group or material may have changed since the last face.
    changed: bool,
    /// Whether a line has named the group since the last face.
    named: bool,
    /// Groups that lines name again after they have had faces, with the line of the next face.
    pub merged: IndexMap<String, usize>,
    /// Lines that mean something for light but are not used: line number, first word and meaning.
    pub unused: Vec<(usize, &'static str, &'static str)>,
    /// File names after `mtllib`, with their lines.
    pub mtllibs: Vec<(usize, String)>,
}

impl Scan {
    /// Starts the first pass over the file at `path`.
    pub fn new(path: String) -> Self {
        Self {
            path,
            sound: String::new(),
            vertices: 0,
            groups: Vec::new(),
            by_name: HashMap::new(),
            parts: Vec::new(),
            group: None,
            material: None,
            changed: true,
            named: false,
            merged: IndexMap::new(),
            unused: Vec::new(),
            mtllibs: Vec::new(),
        }
    }

    /// Checks the next line. Error, at the line: it cannot be understood.
    pub fn line(&mut self, line: &Line) -> Result<()> {
        let (word, rest) = line.split();
        match word {
            "v" => self.vertex(line, rest),
            "f" | "fo" => self.face(line, rest),
            "o" | "g" => {
                let name = if rest.is_empty() { "default" } else { rest };
                self.group = Some(self.name(line, name)?);
                (self.changed, self.named) = (true, true);
                Ok(())
            }
            "usemtl" => {
                self.material = match rest {
                    "" => None,
                    name => Some(self.name(line, name)?),
                };
                self.changed = true;
                Ok(())
            }
            "mtllib" => {
                self.mtllibs.extend(mtl_files(rest).map(|file| (line.number, file.to_owned())));
                Ok(())
            }
            _ if FREE_FORM.contains(&word) => Err(self
                .error(line, format!("free-form surfaces (`{word}`) are not supported"))
                .remedy("export the surface as polygons")),
            "call" | "csh" => Err(self
                .error(line, format!("`{word}` (another file or a command) is not followed"))
                .remedy("export everything into one file")),
            _ if UNUSED.iter().any(|(known, _)| *known == word) => {
                if !self.unused.iter().any(|(_, known, _)| *known == word) {
                    let own = UNUSED.iter().filter(|(known, _)| *known == word);
                    self.unused.extend(own.map(|(word, meaning)| (line.number, *word, *meaning)));
                }
                Ok(())
            }
            _ if IGNORED.contains(&word) => Ok(()),
            _ => Err(self.unknown(line, word)),
        }
    }

    fn error(&self, line: &Line, problem: impl std::fmt::Display) -> Error {
        Error::input(format_args!("{}:{}", self.path, line.number), problem)
    }

    fn name(&self, line: &Line, name: &str) -> Result<String> {
        if name.contains(char::REPLACEMENT_CHARACTER) {
            let problem = format!("the name {} is not valid UTF-8", quoted(name));
            return Err(self.error(line, problem).remedy("save the file in UTF-8"));
        }
        Ok(name.to_owned())
    }

    fn unknown(&self, line: &Line, word: &str) -> Error {
        let error = self.error(line, format!("unknown word {}", quoted(word)));
        let short: String = word.chars().take(20).flat_map(char::to_lowercase).collect();
        // a word of one or two letters is similar to every other short word
        let near = nearest(&short, READ).filter(|&k| k == short || k.len() > 2);
        error.did_you_mean(near, "is it an OBJ file? comments begin with #")
    }

    fn vertex(&mut self, line: &Line, rest: &str) -> Result<()> {
        let mut count = 0;
        self.sound.push('v');
        for word in values(rest) {
            // x, y, z may be followed by a weight, a colour or both: numbers that are not used
            match word.parse::<f64>() {
                Ok(x) if x.is_finite() || count >= 3 => {}
                _ => {
                    let problem = format!("{} is not a finite number", quoted(word));
                    return Err(self.error(line, problem).remedy("a vertex is `v x y z`"));
                }
            }
            if count < 3 {
                self.sound.push(' ');
                self.sound.push_str(word);
            }
            count += 1;
        }
        self.sound.push('\n');
        self.vertices += 1;
        match count {
            3 | 4 | 6 | 7 => Ok(()),
            n => Err(self
                .error(line, format!("vertex of {n} numbers"))
                .remedy("write `v x y z`, then a weight, a colour r g b or nothing")),
        }
    }

    fn face(&mut self, line: &Line, rest: &str) -> Result<()> {
        if self.changed {
            self.begin_part(line);
        }
        self.sound.push('f');
        let mut count = 0;
        for corner in values(rest) {
            if let Err((problem, remedy)) = self.corner(corner) {
                return Err(self.error(line, problem).remedy(remedy));
            }
            count += 1;
            if count > MAX_CORNERS {
                let problem = format!("face of more than {MAX_CORNERS} corners");
                return Err(self.error(line, problem).remedy("cut it into smaller faces"));
            }
        }
        self.sound.push('\n');
        match count {
            0..3 => Err(self
                .error(line, format!("face of {count} corners, must have at least 3"))
                .remedy("delete the line, or give the face its corners")),
            _ => Ok(()),
        }
    }

    /// Checks one corner (`7`, `7/1`, `7//3`, `7/1/3`) and writes its vertex to the text for tobj.
    /// The error is the problem and its remedy.
    fn corner(&mut self, corner: &str) -> std::result::Result<(), (String, &'static str)> {
        let mut pieces = corner.split('/');
        let vertex = pieces.next().unwrap_or_default();
        let rest_sound =
            pieces.by_ref().take(2).all(|piece| piece.is_empty() || piece.parse::<i64>().is_ok());
        let (Ok(index), true, None) = (vertex.parse::<i64>(), rest_sound, pieces.next()) else {
            let problem = format!("{} is not a corner", quoted(corner));
            return Err((problem, "write vertex, vertex/texture, vertex//normal or all three"));
        };
        if index == 0 || index > self.vertices || index < -self.vertices {
            let problem = match self.vertices {
                _ if index == 0 => "corner 0 does not exist".into(),
                0 => format!("corner {index}, but no vertex stands before this face"),
                n => format!("corner {index}, but only {n} vertices stand before this face"),
            };
            return Err((problem, "vertices are counted from 1, or from -1 backwards"));
        }
        self.sound.push(' ');
        self.sound.push_str(vertex);
        Ok(())
    }

    fn begin_part(&mut self, line: &Line) {
        let named = std::mem::take(&mut self.named);
        self.changed = false;
        let group = match self.by_name.get(&self.group) {
            Some(&group) => {
                if let Some(name) = self.group.as_ref().filter(|_| named) {
                    self.merged.entry(name.clone()).or_insert(line.number);
                }
                group
            }
            None => {
                self.groups.push(ObjGroup { name: self.group.clone() });
                self.by_name.insert(self.group.clone(), self.groups.len() - 1);
                self.groups.len() - 1
            }
        };
        // a line that repeats the current group or material begins no new part
        if self.parts.last().is_some_and(|p| p.group == group && p.material == self.material) {
            return;
        }
        // gives the part a model of its own in tobj
        let _ = writeln!(self.sound, "o {}", self.parts.len());
        let (material, triangles) = (self.material.clone(), Vec::new());
        self.parts.push(ObjPart {
            group,
            material,
            line: line.number,
            triangles,
            tangled: 0,
            bent: 0,
        });
    }
}

/// Returns the file names of an `mtllib` line. Names may contain spaces, so a name ends after
/// `.mtl` or with the line.
fn mtl_files(rest: &str) -> impl Iterator<Item = &str> {
    let mut rest = rest;
    std::iter::from_fn(move || {
        rest = rest.trim_start();
        let ends_name =
            |at: usize| rest.get(at - 4..at).is_some_and(|e| e.eq_ignore_ascii_case(".mtl"));
        let mut blanks = rest.match_indices([' ', '\t']).map(|(at, _)| at);
        let end = blanks.find(|&at| at > 4 && ends_name(at)).unwrap_or(rest.len());
        let (name, tail) = rest.split_at(end);
        rest = tail;
        (!name.is_empty()).then_some(name)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mtllib_names_may_hold_spaces() {
        for (rest, names) in [
            ("a.mtl", &["a.mtl"][..]),
            ("a.mtl b.MTL\tc", &["a.mtl", "b.MTL", "c"]),
            ("my  plant.mtl other plant.mtl", &["my  plant.mtl", "other plant.mtl"]),
            ("sub/a.mtl.txt", &["sub/a.mtl.txt"]),
            (".mtl é.mtl b", &[".mtl é.mtl", "b"]),
            ("", &[]),
        ] {
            assert_eq!(mtl_files(rest).collect::<Vec<_>>(), names, "{rest}");
        }
    }
}
