//! Turns the words of a file into surfaces and materials.

use std::{
    collections::HashMap,
    path::{Component, Path, PathBuf},
};

use glam::{DAffine3, DVec3};

use super::{
    content::{Dialect, RadBsdf, RadFile, RadLamp, RadMaterial, RadPart},
    lexer::Lexer,
    shapes,
    xform::{MOST_COPIES, xform},
};
use crate::input::quoted;
use phylux_core::error::{Error, Result, nearest};

const SURFACES: [&str; 8] =
    ["polygon", "sphere", "bubble", "cylinder", "tube", "cone", "cup", "ring"];
const MATERIALS: [&str; 8] =
    ["plastic", "metal", "trans", "glass", "dielectric", "mirror", "light", "glow"];
/// Measured materials; the second has a part that goes straight through.
const MEASURED: [&str; 2] = ["BSDF", "aBSDF"];
/// Types of Radiance that are known and not read: materials, and what modifies them. An object of
/// such a type is an error only where a surface has it.
const UNREAD: [&str; 34] = [
    "plastic2",
    "metal2",
    "trans2",
    "ashik2",
    "interface",
    "plasfunc",
    "metfunc",
    "transfunc",
    "BRTDfunc",
    "WGMDfunc",
    "plasdata",
    "metdata",
    "transdata",
    "antimatter",
    "illum",
    "spotlight",
    "mist",
    "prism1",
    "prism2",
    "texfunc",
    "texdata",
    "colorfunc",
    "brightfunc",
    "colordata",
    "brightdata",
    "colorpict",
    "colortext",
    "brighttext",
    "mixfunc",
    "mixdata",
    "mixpict",
    "mixtext",
    "spectrum",
    "specfile",
];
/// Surfaces that stand for other files, which are not read.
const OTHER_FILES: [&str; 2] = ["instance", "mesh"];
/// The word at the beginning of a file of SEC2, before a number.
const SEC2_SCALE: &str = "scale_factor";
/// Lights of SEC2 that are lines of numbers, without counts of arguments.
const SEC2_LINES: [&str; 3] = ["point", "point_light", "spot_light"];

/// The largest number of words that are read, in all files and copies.
const MOST_WORDS: usize = 50_000_000;
/// The deepest nesting of files within files.
const DEEPEST: usize = 16;
/// The largest number of corners of a polygon.
const MOST_CORNERS: usize = 10_000;

type Load<'a> = dyn Fn(&Path) -> std::result::Result<Vec<u8>, String> + 'a;

/// Reads a file and the files that its commands name.
pub struct Scan<'a> {
    dialect: Dialect,
    load: &'a Load<'a>,
    file: RadFile,
    /// Index of the material that each name stands for.
    named: HashMap<String, usize>,
    /// Indices of materials of unknown types, with what is wrong: no materials, perhaps.
    unknown: Vec<(usize, Error)>,
    /// Corners of the polygons that were read, sorted, by material, with the normal of each
    /// polygon.
    polygons: HashMap<(usize, Vec<[u64; 3]>), DVec3>,
    open: Vec<PathBuf>,
    words: usize,
    copies: usize,
}

/// How the content of a file is placed in the room.
#[derive(Clone)]
struct Placement {
    transform: DAffine3,
    prefix: String,
    modifier: Option<String>,
    inverted: bool,
}

/// The head of a primitive and its place.
struct Primitive<'a> {
    modifier: &'a str,
    kind: &'a str,
    identifier: &'a str,
    place: String,
}

impl<'a> Scan<'a> {
    /// Starts without content; `load` fetches the bytes of files that commands name.
    pub fn new(dialect: Dialect, load: &'a Load<'a>) -> Self {
        Self {
            dialect,
            load,
            file: RadFile::default(),
            named: HashMap::new(),
            unknown: Vec::new(),
            polygons: HashMap::new(),
            open: Vec::new(),
            words: 0,
            copies: 0,
        }
    }

    /// Reads the `bytes` of the file at `path` and returns the whole room.
    pub fn whole(mut self, bytes: &[u8], path: &Path) -> Result<RadFile> {
        let placement = Placement {
            transform: DAffine3::IDENTITY,
            prefix: String::new(),
            modifier: None,
            inverted: false,
        };
        self.read(bytes, path, &placement)?;
        // what no surface has may be a surface itself, whose type is misspelt
        let used = |index| self.file.parts.iter().any(|part| part.material == index);
        if let Some((_, error)) = self.unknown.iter().find(|(index, _)| !used(*index)) {
            return Err(error.clone());
        }
        if self.file.parts.is_empty() && self.file.lamps.is_empty() {
            return Err(Error::input(path.display(), "holds no surface")
                .remedy("a surface is `material polygon name`, with counts and coordinates"));
        }
        Ok(self.file)
    }

    fn read(&mut self, bytes: &[u8], path: &Path, placement: &Placement) -> Result<()> {
        if bytes.iter().take(8192).any(|&b| b == 0) {
            return Err(Error::input(path.display(), "is not text but binary")
                .remedy("a .rad file is plain text"));
        }
        // names may be in any encoding
        let text = String::from_utf8_lossy(bytes);
        let mut lexer = Lexer::new(text.trim_start_matches('\u{feff}'));
        self.open.push(path.to_path_buf());
        loop {
            let command = lexer.command();
            let place = format!("{}:{}", path.display(), lexer.line);
            if let Some(command) = command {
                self.command(&command, path, &place, placement)?;
                continue;
            }
            let Some(modifier) = self.word(&mut lexer, &place)? else { break };
            if self.dialect == Dialect::Sec2 && modifier == SEC2_SCALE {
                self.number(&mut lexer, &place, modifier)?;
                continue;
            }
            let missing = |what: &str| {
                Error::input(&place, format!("{} without its {what}", quoted(modifier)))
                    .remedy("a primitive is `modifier type identifier`, then its arguments")
            };
            let kind = self.word(&mut lexer, &place)?.ok_or_else(|| missing("type"))?;
            let identifier = self.word(&mut lexer, &place)?.ok_or_else(|| missing("identifier"))?;
            let primitive = Primitive { modifier, kind, identifier, place };
            self.primitive(&mut lexer, &primitive, path, placement)?;
        }
        self.open.pop();
        Ok(())
    }

    /// Reads and counts the next word, if there is one.
    fn word<'t>(&mut self, lexer: &mut Lexer<'t>, place: &str) -> Result<Option<&'t str>> {
        self.words += 1;
        if self.words > MOST_WORDS {
            return Err(Error::input(place, format!("more than {MOST_WORDS} words"))
                .remedy("use fewer copies or a coarser mesh"));
        }
        Ok(lexer.word())
    }

    fn number(&mut self, lexer: &mut Lexer, place: &str, of: &str) -> Result<f64> {
        let word = self.word(lexer, place)?.unwrap_or_default();
        word.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| {
            let problem = format!("{} where {} has a number", quoted(word), quoted(of));
            Error::input(place, problem)
                .remedy("after the identifier stand three counts, each before its arguments")
        })
    }

    /// Reads the counts and arguments of a primitive and returns its real arguments; texts and
    /// whole numbers are skipped.
    fn numbers(&mut self, lexer: &mut Lexer, primitive: &Primitive) -> Result<Vec<f64>> {
        Ok(self.arguments(lexer, primitive)?.1)
    }

    /// Reads the counts and arguments of a primitive and returns its texts and its real arguments;
    /// whole numbers are skipped.
    fn arguments<'t>(
        &mut self,
        lexer: &mut Lexer<'t>,
        primitive: &Primitive,
    ) -> Result<(Vec<&'t str>, Vec<f64>)> {
        let Primitive { kind, place, .. } = primitive;
        let count = |scan: &mut Self, lexer: &mut Lexer| {
            let count = scan.number(lexer, place, kind)?;
            if (0.0..=1e9).contains(&count) && count.fract() == 0.0 {
                return Ok(count as usize);
            }
            Err(Error::input(place, format!("{count} is no count of arguments"))
                .remedy("after the identifier stand three counts, each before its arguments"))
        };
        let mut texts = Vec::new();
        for _ in 0..count(self, lexer)? {
            let ends =
                || Error::input(place, "the file ends within it").remedy("the file is broken");
            texts.push(self.word(lexer, place)?.ok_or_else(ends)?);
        }
        for _ in 0..count(self, lexer)? {
            self.number(lexer, place, kind)?;
        }
        let mut reals = count(self, lexer)?;
        let mut numbers = Vec::new();
        while numbers.len() < reals {
            numbers.push(self.number(lexer, place, kind)?);
        }
        // SEC2 counts a colour as one argument
        if self.dialect == Dialect::Sec2 && *kind == "light" && reals == 1 {
            while reals < 3 && lexer.peek().is_some_and(|word| word.parse::<f64>().is_ok()) {
                numbers.push(self.number(lexer, place, kind)?);
                reals += 1;
            }
        }
        Ok((texts, numbers))
    }

    fn primitive(
        &mut self,
        lexer: &mut Lexer,
        primitive: &Primitive,
        path: &Path,
        placement: &Placement,
    ) -> Result<()> {
        let Primitive { modifier, kind, identifier, place } = primitive;
        let error = |problem: String| Error::input(place, problem);
        match *kind {
            "alias" => self.alias(lexer, primitive),
            _ if SURFACES.contains(kind) => {
                let numbers = self.numbers(lexer, primitive)?;
                self.surface(primitive, &numbers, placement)
            }
            _ if MATERIALS.contains(kind) => {
                let numbers = self.numbers(lexer, primitive)?;
                self.material(primitive, numbers, None)
            }
            _ if MEASURED.contains(kind) => {
                let (texts, numbers) = self.arguments(lexer, primitive)?;
                match measured(primitive, &texts, &numbers, path, placement) {
                    Ok(bsdf) => self.material(primitive, numbers, Some(bsdf)),
                    Err(error) => self.unread(primitive, error),
                }
            }
            _ if UNREAD.contains(kind) => {
                self.numbers(lexer, primitive)?;
                let problem =
                    format!("{modifier} {kind} {identifier}: {} is not read", quoted(kind));
                self.unread(primitive, error(problem).remedy(OWN))
            }
            "source" => {
                self.numbers(lexer, primitive)?;
                self.file.warnings.push(format!(
                    "{place}: source {identifier} is not read: give the scene a sun, a sky or an \
                     environment"
                ));
                Ok(())
            }
            _ if OTHER_FILES.contains(kind) => {
                let problem =
                    format!("{modifier} {kind} {identifier}: {} is not supported", quoted(kind));
                Err(error(problem)
                    .remedy("write its surfaces as polygons, or as an OBJ of the scene"))
            }
            _ if self.dialect == Dialect::Sec2 && SEC2_LINES.contains(kind) => {
                self.numbers_that_follow(lexer, primitive)?;
                if *kind != "point" {
                    let warning = format!(
                        "{place}: {kind} {identifier} is not read: give the scene such a light"
                    );
                    self.file.warnings.push(warning);
                }
                Ok(())
            }
            "x" if self.dialect == Dialect::Sec2 => {
                let mut numbers = self.numbers_that_follow(lexer, primitive)?;
                // some files have the counts of Radiance before the colour
                if let &[texts, integers, reals, ref colour @ ..] = numbers.as_slice()
                    && [texts, integers] == [0.0; 2]
                    && reals == colour.len() as f64
                {
                    numbers = colour.to_vec();
                }
                let light = Primitive { kind: "light", place: place.clone(), ..*primitive };
                self.material(&light, numbers, None)
            }
            _ if *modifier == SEC2_SCALE || SEC2_LINES.contains(kind) => {
                let word = if *modifier == SEC2_SCALE { modifier } else { kind };
                Err(error(format!("{} is a word of SEC2", quoted(word)))
                    .remedy("give the object `\"dialect\": \"sec2\"`"))
            }
            _ => self.unknown(lexer, primitive),
        }
    }

    /// Gives a material another name.
    fn alias(&mut self, lexer: &mut Lexer, primitive: &Primitive) -> Result<()> {
        let Primitive { modifier, identifier, place, .. } = primitive;
        let known = self.word(lexer, place)?.unwrap_or_default();
        let Some(&material) = self.named.get(known) else {
            let problem = format!("the alias of {}, which is not defined", quoted(known));
            return Err(Error::input(place, problem).remedy("define it before"));
        };
        if *modifier != "void" {
            return self.unread(primitive, modified(modifier, place));
        }
        self.named.insert(identifier.to_string(), material);
        Ok(())
    }

    /// Keeps what has a type that Radiance does not have: an error where a surface has it, or where
    /// it may be a surface itself.
    fn unknown(&mut self, lexer: &mut Lexer, primitive: &Primitive) -> Result<()> {
        let Primitive { modifier, kind, identifier, place } = primitive;
        let all = SURFACES.iter().chain(&MATERIALS).copied();
        let otherwise = format!(
            "there are {}: take it out, or give the scene what it stands for",
            all.clone().collect::<Vec<_>>().join(", ")
        );
        let problem = format!("{modifier} {kind} {identifier}: {} is not supported", quoted(kind));
        let error = Error::input(place, problem).did_you_mean(nearest(kind, all), otherwise);
        if self.numbers(lexer, primitive).is_err() {
            return Err(error);
        }
        self.unread(primitive, error.clone())?;
        self.unknown.push((self.file.materials.len() - 1, error));
        Ok(())
    }

    /// Reads the numbers of a line without counts, as SEC2 has them.
    fn numbers_that_follow(
        &mut self,
        lexer: &mut Lexer,
        primitive: &Primitive,
    ) -> Result<Vec<f64>> {
        let mut numbers = Vec::new();
        while lexer.peek().is_some_and(|word| word.parse::<f64>().is_ok()) {
            numbers.push(self.number(lexer, &primitive.place, primitive.kind)?);
        }
        Ok(numbers)
    }

    /// Keeps what may be a material, with what is wrong with it.
    fn unread(&mut self, primitive: &Primitive, problem: Error) -> Result<()> {
        self.named.insert(primitive.identifier.to_string(), self.file.materials.len());
        self.file.materials.push(RadMaterial {
            name: primitive.identifier.to_string(),
            kind: primitive.kind.to_string(),
            numbers: Vec::new(),
            place: primitive.place.clone(),
            bsdf: None,
            problem: Some(problem),
        });
        Ok(())
    }

    fn material(
        &mut self,
        primitive: &Primitive,
        numbers: Vec<f64>,
        bsdf: Option<RadBsdf>,
    ) -> Result<()> {
        let Primitive { modifier, kind, identifier, place } = primitive;
        if *modifier != "void" {
            return self.unread(primitive, modified(modifier, place));
        }
        let counts: &[usize] = match *kind {
            "plastic" | "metal" | "dielectric" => &[5],
            "trans" => &[7],
            "glass" => &[3, 4],
            "glow" => &[4],
            "light" if self.dialect == Dialect::Sec2 => &[0, 1, 2, 3],
            "BSDF" | "aBSDF" => &[0, 3, 6, 9],
            _ => &[3],
        };
        if !counts.contains(&numbers.len()) {
            let problem =
                format!("{kind} {identifier} of {} numbers, must be {}", numbers.len(), counts[0]);
            return Err(
                Error::input(place, problem).remedy("see the manual of Radiance on materials")
            );
        }
        let material = RadMaterial {
            name: identifier.to_string(),
            kind: kind.to_string(),
            numbers,
            place: place.clone(),
            bsdf,
            problem: None,
        };
        // a file that is included again repeats the same definitions
        let known = self.named.get(*identifier).copied();
        if known.is_none_or(|index| self.file.materials[index] != material) {
            self.named.insert(identifier.to_string(), self.file.materials.len());
            self.file.materials.push(material);
        }
        Ok(())
    }

    /// Returns the index of the material of a surface. A name that the file does not define gets an
    /// entry too, because the scene may define it.
    fn made_of(&mut self, name: &str, place: &str) -> Result<usize> {
        if name == "void" {
            return Err(Error::input(place, "a surface without material")
                .remedy("write the name of its material in the place of `void`"));
        }
        if let Some(&index) = self.named.get(name) {
            return Ok(index);
        }
        self.file.materials.push(RadMaterial {
            name: name.to_string(),
            kind: String::new(),
            numbers: Vec::new(),
            place: place.to_string(),
            bsdf: None,
            problem: None,
        });
        let index = self.file.materials.len() - 1;
        self.named.insert(name.to_string(), index);
        Ok(index)
    }

    fn surface(
        &mut self,
        primitive: &Primitive,
        numbers: &[f64],
        placement: &Placement,
    ) -> Result<()> {
        let Primitive { modifier, kind, identifier, place } = primitive;
        let wrong = |problem: String| {
            Error::input(place, format!("{kind} {}: {problem}", quoted(identifier)))
                .remedy("see the manual of Radiance on surfaces")
        };
        let shape = triangles(kind, numbers).map_err(wrong)?;
        let transform = placement.transform;
        let moved = shape.iter().map(|corners| corners.map(|p| transform.transform_point3(p)));
        let mut triangles: Vec<[DVec3; 3]> = moved.collect();
        if (transform.matrix3.determinant() < 0.0) != placement.inverted {
            triangles = shapes::inverted(triangles);
        }
        if triangles.iter().flatten().any(|p| !p.is_finite()) {
            return Err(wrong("a coordinate that is not finite where it stands".into()));
        }
        let material = self.made_of(placement.modifier.as_deref().unwrap_or(modifier), place)?;
        if *kind == "polygon" && self.is_reversed_copy(material, &triangles) {
            return Ok(());
        }
        let identifier = format!("{}{identifier}", placement.prefix);
        if self.file.materials[material].is_lamp() {
            if let Some(problem) = &self.file.materials[material].problem {
                return Err(problem.clone());
            }
            let tube = (*kind == "cylinder").then(|| {
                let [from, to] = [0, 3].map(|i| transform.transform_point3(point(numbers, i)));
                (from, to, numbers[6] * transform.matrix3.determinant().abs().cbrt())
            });
            self.file.lamps.push(RadLamp { identifier, material, tube, triangles });
            return Ok(());
        }
        match self.file.parts.last_mut() {
            Some(part) if part.identifier == identifier && part.material == material => {
                part.triangles.extend(triangles);
            }
            _ => {
                let place = place.clone();
                self.file.parts.push(RadPart { identifier, material, place, triangles });
            }
        }
        Ok(())
    }

    /// Returns whether a polygon with the same corners and material, but facing the other way, was
    /// read before. Radiance files describe walls by such pairs; here a surface has two faces, so
    /// one polygon is enough.
    fn is_reversed_copy(&mut self, material: usize, triangles: &[[DVec3; 3]]) -> bool {
        let mut corners: Vec<[u64; 3]> =
            triangles.iter().flatten().map(|p| p.to_array().map(|x| (x + 0.0).to_bits())).collect();
        corners.sort_unstable();
        corners.dedup();
        let normal: DVec3 = triangles.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a)).sum();
        match self.polygons.get(&(material, corners.clone())) {
            Some(known) => known.dot(normal) < 0.0,
            None => {
                self.polygons.insert((material, corners), normal);
                false
            }
        }
    }

    fn command(
        &mut self,
        words: &[&str],
        path: &Path,
        place: &str,
        placement: &Placement,
    ) -> Result<()> {
        let error = |problem: String| Error::input(place, problem);
        let followed = "of commands `!xform` and `!cat` with files are followed, and no other is run; \
                        write what it makes into the file";
        let shell =
            |word: &&str| word.contains(['|', ';', '<', '>', '$', '`', '&', '*', '"', '\'']);
        let (name, arguments) = match words.split_first() {
            Some((&name @ ("xform" | "cat"), arguments)) if !arguments.iter().any(shell) => {
                (name, arguments)
            }
            _ => {
                let shown = words.join(" ");
                return Err(error(format!("the command {}", quoted(&shown))).remedy(followed));
            }
        };
        let asked = match name {
            "xform" => xform(arguments).map_err(|problem| error(problem).remedy(followed))?,
            _ => super::xform::Xform {
                copies: vec![DAffine3::IDENTITY],
                files: arguments.to_vec(),
                ..Default::default()
            },
        };
        if asked.files.is_empty() {
            return Err(error(format!("`!{name}` without a file")).remedy(followed));
        }
        for file in &asked.files {
            let places = places(file, path).ok_or_else(|| {
                error(format!("{} is no relative path", quoted(file)))
                    .remedy("name the file relative to this one, or to the working directory")
            })?;
            let mut found = Err(String::new());
            for there in &places {
                if self.open.contains(there) || self.open.len() == DEEPEST {
                    return Err(error(format!("{} names itself, or too deep", quoted(file)))
                        .remedy("take one of the commands out"));
                }
                found = (self.load)(there).map(|bytes| (bytes, there));
                if found.is_ok() {
                    break;
                }
            }
            let (bytes, there) = found.map_err(|why| {
                error(format!("{}: {why}", places[0].display()))
                    .remedy("name a file beside this one, or in the working directory")
            })?;
            for (i, copy) in asked.copies.iter().enumerate() {
                self.copies += 1;
                if self.copies > MOST_COPIES {
                    return Err(error(format!("more than {MOST_COPIES} copies of files"))
                        .remedy("use fewer"));
                }
                let number = if asked.copies.len() > 1 { format!(".{i}") } else { String::new() };
                let prefix = match asked.prefix {
                    Some(name) => format!("{}{name}{number}.", placement.prefix),
                    None => placement.prefix.clone(),
                };
                let modifier = asked.modifier.map(str::to_string);
                let placement = Placement {
                    transform: placement.transform * *copy,
                    prefix,
                    modifier: placement.modifier.clone().or(modifier),
                    inverted: placement.inverted != asked.inverted,
                };
                self.words += bytes.len() / 8;
                if self.words > MOST_WORDS {
                    return Err(error("copies of more numbers than memory holds".into())
                        .remedy("use fewer copies"));
                }
                self.read(&bytes, there, &placement)?;
            }
        }
        Ok(())
    }
}

/// What a user can do about a material that is not read; the remedy of errors.
const OWN: &str = "give the scene a material of this name";

/// Returns the point whose coordinates begin at an index of the arguments.
fn point(numbers: &[f64], index: usize) -> DVec3 {
    DVec3::new(numbers[index], numbers[index + 1], numbers[index + 2])
}

/// Returns the triangles of a surface of Radiance in its own coordinates, or what is wrong with its
/// arguments.
fn triangles(kind: &str, numbers: &[f64]) -> std::result::Result<Vec<[DVec3; 3]>, String> {
    let count = match kind {
        "sphere" | "bubble" => 4,
        "cylinder" | "tube" => 7,
        "cone" | "cup" | "ring" => 8,
        _ => numbers.len(),
    };
    if numbers.len() != count || kind == "polygon" && (count < 9 || !count.is_multiple_of(3)) {
        return Err(format!("{} numbers", numbers.len()));
    }
    if kind == "polygon" && count > 3 * MOST_CORNERS {
        return Err(format!("more than {MOST_CORNERS} corners"));
    }
    let radii = match kind {
        "sphere" | "bubble" => &numbers[3..],
        "cylinder" | "tube" | "cone" | "cup" | "ring" => &numbers[6..],
        _ => &[1.0],
    };
    if radii.iter().any(|r| *r < 0.0) || !radii.iter().any(|r| *r > 0.0) {
        return Err("a radius that is not above 0".into());
    }
    let at = |index| point(numbers, index);
    let shape = match kind {
        "polygon" => shapes::polygon(&(0..count / 3).map(|i| at(3 * i)).collect::<Vec<_>>()),
        "sphere" => shapes::sphere(at(0), radii[0]),
        "bubble" => shapes::inverted(shapes::sphere(at(0), radii[0])),
        "cylinder" => shapes::cone(at(0), at(3), [radii[0]; 2]),
        "tube" => shapes::inverted(shapes::cone(at(0), at(3), [radii[0]; 2])),
        "cone" => shapes::cone(at(0), at(3), [radii[0], radii[1]]),
        "cup" => shapes::inverted(shapes::cone(at(0), at(3), [radii[0], radii[1]])),
        _ => shapes::ring(at(0), at(3), [radii[0], radii[1]]),
    };
    if shape.is_empty() { Err("no extent".into()) } else { Ok(shape) }
}

/// Returns the error for a material that a pattern, a texture or a mixture changes.
fn modified(modifier: &str, place: &str) -> Error {
    let problem = format!("a material that is modified by {}", quoted(modifier));
    Error::input(place, problem).remedy(format!(
        "patterns, textures and mixtures are not read: write `void` there, or {OWN}"
    ))
}

/// Returns where a file may be that the file at `path` names: beside that one, or in the working
/// directory, from which Radiance looks. `None` for a name that is no relative path: a room that
/// somebody else made says nothing about this machine.
fn places(file: &str, path: &Path) -> Option<Vec<PathBuf>> {
    let relative = Path::new(file);
    let outside = |part: Component| matches!(part, Component::Prefix(_) | Component::RootDir);
    (!relative.components().any(outside)).then(|| {
        let beside = path.parent().unwrap_or(Path::new("")).join(relative);
        let mut places = vec![beside, relative.to_path_buf()];
        places.dedup();
        places
    })
}

/// Reads the arguments of a measured material: `thick file ux uy uz funcfile transform` of a BSDF,
/// the same without the thickness of an aBSDF, and diffuse parts that are added.
fn measured(
    primitive: &Primitive,
    texts: &[&str],
    numbers: &[f64],
    path: &Path,
    placement: &Placement,
) -> Result<RadBsdf> {
    let Primitive { kind, identifier, place, .. } = primitive;
    let wrong = |problem: &str| {
        Error::input(place, format!("{kind} {}: {problem}", quoted(identifier))).remedy(OWN)
    };
    let thin = if *kind == "BSDF" { 1 } else { 0 };
    let (thick, texts) = texts.split_at_checked(thin).unwrap_or((&[], &[]));
    let [file, ux, uy, uz, _, transform @ ..] = texts else {
        return Err(wrong("too few texts for its file and its direction up"));
    };
    let number = |text: &&str| text.parse().ok().filter(|x: &f64| x.is_finite());
    let [Some(x), Some(y), Some(z)] = [ux, uy, uz].map(number) else {
        return Err(wrong("a direction up that is not three numbers"));
    };
    let thickness = thick.first().map_or(Some(0.0), number);
    let thickness = thickness.ok_or_else(|| wrong("a thickness that is no number"))?;
    if numbers.iter().any(|&part| part != 0.0) {
        return Err(wrong("diffuse parts added to its file"));
    }
    let asked = xform(transform).map_err(|problem| wrong(&problem))?;
    let [turn] = asked.copies[..] else { return Err(wrong("a transform of several copies")) };
    let up = placement.transform.transform_vector3(turn.transform_vector3(DVec3::new(x, y, z)));
    let files =
        places(file, path).ok_or_else(|| wrong("a file that is named by no relative path"))?;
    Ok(RadBsdf { files, up, through: *kind == "aBSDF" || thickness != 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every word counts towards the limit: heads, text arguments and numbers.
    #[test]
    fn words_of_every_kind_are_counted() {
        let text = b"void plastic wall 2 some text 0 5 1 1 1 0 0\nvoid alias w wall\n\
            w polygon floor 0 0 9 0 0 0 1 0 0 0 1 0";
        let words = text.split(|b| b.is_ascii_whitespace()).filter(|word| !word.is_empty()).count();
        for (room, is_read) in [(words + 1, true), (words - 1, false)] {
            let mut scan = Scan::new(Dialect::Radiance, &|_| Err("no other file".into()));
            scan.words = MOST_WORDS - room;
            let read = scan.whole(text, Path::new("a.rad"));
            assert_eq!(read.is_ok(), is_read, "{room}");
            let refused = |error: Error| error.to_string().contains("more than 50000000 words");
            assert!(is_read || read.is_err_and(refused));
        }
    }
}
