//! Reads the entries of MTL files. Only a few of their keys matter. They are read here and not by
//! tobj, which panics on `Kd 0.5` and rejects the whole file on `Kd spectral`; here a broken entry
//! does not affect the others.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use super::lines::{Lines, decode, values};
use crate::input::quoted;
use phylux_core::error::{Error, Result};

/// The most statements of an entry that are kept to be told.
const MOST_UNUSED: usize = 10;

/// The entries of all MTL files that an OBJ file names.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MtlLibrary {
    entries: Vec<Read>,
    by_name: HashMap<String, usize>,
    missing: Vec<MissingMtl>,
}

/// An entry, and the error in it, which is reported only when the entry is needed.
#[derive(Clone, Debug, PartialEq)]
struct Read {
    entry: MtlEntry,
    broken: Option<Error>,
}

/// A material as the MTL file writes it. Its values are finite and not negative, but not checked
/// further.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MtlEntry {
    /// The name after `newmtl`.
    pub name: String,
    /// File and line of the entry's `newmtl`.
    pub place: String,
    /// Illumination model.
    pub illum: Option<u32>,
    /// Diffuse colour: r, g, b.
    pub kd: Option<[f64; 3]>,
    /// Specular colour: r, g, b.
    pub ks: Option<[f64; 3]>,
    /// Emitted radiance: r, g, b.
    pub ke: Option<[f64; 3]>,
    /// Transmission filter: r, g, b.
    pub tf: Option<[f64; 3]>,
    /// Specular exponent.
    pub ns: Option<f64>,
    /// Index of refraction.
    pub ni: Option<f64>,
    /// File name of the texture of the diffuse colour, as written. The texture is not read; the
    /// colour is `kd` alone.
    pub map_kd: Option<String>,
    /// Options and file name of the texture of the opacity, as written.
    pub map_d: Option<String>,
    /// Statements that mean something for light but are not used: key in lower case, and the
    /// statement in quotes.
    unused: Vec<(String, String)>,
}

impl MtlEntry {
    /// Returns the statements that mean something for light but are not used, in quotes.
    /// `replaced` says whether a material of the scene takes the place of the entry.
    pub fn unused(&self, replaced: bool) -> Vec<String> {
        // a leaf uses its filter as its transmittance
        let used = |key: &str| key == "tf" && !replaced && self.illum == Some(6);
        let said = self.unused.iter().filter(|(key, _)| !used(key)).map(|(_, text)| text.clone());
        // what else lets light through or emits it, as long as nobody says so otherwise
        let clear = self.illum.filter(|illum| replaced && [4, 9].contains(illum));
        let clear = clear.map(|illum| format!("`illum {illum}`"));
        let lit = self.ke.filter(|ke| replaced && ke.iter().any(|&v| v > 0.0));
        let lit = lit.map(|[r, g, b]| format!("`Ke {r} {g} {b}`"));
        said.chain(clear).chain(lit).collect()
    }
}

/// An MTL file that could not be read, which is an error only where an entry of it is needed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MissingMtl {
    /// Path of the file.
    pub file: String,
    /// The OBJ file and the line in it that names the MTL file.
    pub place: String,
    /// Why it could not be read.
    pub why: String,
}

impl MtlLibrary {
    /// Returns the entry of this name, or `None` if there is no such entry.
    ///
    /// # Errors
    /// At its line, if the entry cannot be understood.
    pub fn entry(&self, name: &str) -> Result<Option<&MtlEntry>> {
        match self.by_name.get(name).map(|&i| &self.entries[i]) {
            Some(Read { broken: Some(error), .. }) => Err(error.clone()),
            found => Ok(found.map(|read| &read.entry)),
        }
    }

    /// Returns the entry of this name as far as it can be understood.
    pub fn written(&self, name: &str) -> Option<&MtlEntry> {
        self.by_name.get(name).map(|&i| &self.entries[i].entry)
    }

    /// The names of all entries, in file order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().map(|read| read.entry.name.as_str())
    }

    /// Returns the MTL files that could not be read.
    pub fn missing(&self) -> &[MissingMtl] {
        &self.missing
    }

    /// Loads each file once, in order; `files` holds line numbers in the OBJ file and names
    /// relative to the OBJ file at `obj`.
    pub(super) fn load(
        files: &[(usize, String)],
        obj: &Path,
        mut load_mtl: impl FnMut(&Path) -> std::result::Result<Vec<u8>, String>,
    ) -> Self {
        let mut library = Self::default();
        let mut seen: HashSet<PathBuf> = HashSet::new();
        for (line, name) in files {
            let path = obj.with_file_name(name);
            if !seen.insert(path.clone()) {
                continue;
            }
            let file = path.display().to_string();
            let read = |bytes: Vec<u8>| Ok(parse_mtl(&decode(&bytes)?, &file));
            match load_mtl(&path).and_then(read) {
                Ok(entries) => entries.into_iter().for_each(|entry| library.add(entry)),
                Err(why) => {
                    let place = format!("{}:{line}", obj.display());
                    library.missing.push(MissingMtl { file, place, why });
                }
            }
        }
        library
    }

    fn add(&mut self, read: Read) {
        let Some(&i) = self.by_name.get(&read.entry.name) else {
            self.by_name.insert(read.entry.name.clone(), self.entries.len());
            return self.entries.push(read);
        };
        let old = &mut self.entries[i];
        // two entries with the same content are no conflict
        let (place, unused) = (old.entry.place.clone(), old.entry.unused.clone());
        let same = MtlEntry { place, unused, ..read.entry.clone() } == old.entry;
        if old.broken.is_none() {
            let name = quoted(&read.entry.name);
            let twice = format!("{name} stands at {} too, otherwise", old.entry.place);
            let error = || Error::input(&read.entry.place, twice).remedy("rename or delete one");
            old.broken = read.broken.or_else(|| (!same).then(error));
        }
    }
}

/// Whether a statement (its key in lower case) means something for light but is not used. One with
/// its usual value (opaque, without gloss) means nothing.
fn is_unused(key: &str, rest: &str) -> bool {
    let numbers = || values(rest).filter_map(|word| word.parse::<f64>().ok());
    let all_are = |usual: f64| numbers().next().is_some() && numbers().all(|x| x == usual);
    match key {
        "kd" | "ks" | "ke" | "ns" | "ni" | "illum" | "map_kd" | "map_d" => false,
        // for the ambient light of pictures, the sharpness of reflections, and the roughness of a
        // gloss that other statements give
        "ka" | "map_ka" | "sharpness" | "map_aat" | "pr" | "map_pr" | "pcr" => false,
        "d" | "tf" => !all_are(1.0),
        "tr" | "pm" | "ps" | "pc" | "aniso" | "anisor" => !all_are(0.0),
        _ => true,
    }
}

/// Returns the entries of one MTL text.
fn parse_mtl(text: &str, file: &str) -> Vec<Read> {
    let mut entries: Vec<Read> = Vec::new();
    for line in Lines::new(text) {
        let (word, rest) = line.split();
        let place = || format!("{file}:{}", line.number);
        if word.eq_ignore_ascii_case("newmtl") {
            let (name, place) = (rest.to_owned(), place());
            let entry = MtlEntry { name, place, ..MtlEntry::default() };
            entries.push(Read { entry, broken: None });
        } else if let Some(Read { entry, broken }) = entries.last_mut() {
            let key = word.to_ascii_lowercase();
            // a file may hold millions of lines
            if entry.unused.len() < MOST_UNUSED && is_unused(&key, rest) {
                let statement = format!("{word} {rest}");
                entry.unused.push((key, quoted(statement.trim_end())));
            }
            // what follows an error is read too, since a mask cuts whatever the colours are
            if let Err(problem) = set(entry, word, rest)
                && broken.is_none()
            {
                let name = quoted(&entry.name);
                let error = Error::input(place(), format!("material {name}: {word} {problem}"));
                *broken = Some(error.remedy("mend it, or give the scene a material of this name"));
            }
        }
    }
    // an entry without a name can never be used
    entries.retain(|read| !read.entry.name.is_empty());
    entries
}

/// Reads one key into the entry; the error is the problem alone, in words.
fn set(entry: &mut MtlEntry, key: &str, rest: &str) -> std::result::Result<(), String> {
    fn once<T>(field: &mut Option<T>, value: T) -> std::result::Result<(), String> {
        match field.replace(value) {
            None => Ok(()),
            Some(_) => Err("stands twice".into()),
        }
    }
    match key.to_ascii_lowercase().as_str() {
        "kd" => once(&mut entry.kd, colour(rest)?),
        "ks" => once(&mut entry.ks, colour(rest)?),
        "ke" => once(&mut entry.ke, colour(rest)?),
        "tf" => once(&mut entry.tf, colour(rest)?),
        "ns" => once(&mut entry.ns, one(rest)?),
        "ni" => once(&mut entry.ni, one(rest)?),
        "map_kd" => once(&mut entry.map_kd, rest.to_owned()),
        "map_d" => once(&mut entry.map_d, rest.to_owned()),
        "illum" => {
            let value = values(rest).next().unwrap_or_default();
            let model = value.parse().map_err(|_| format!("{} is no whole number", quoted(value)));
            once(&mut entry.illum, model?)
        }
        _ => Ok(()),
    }
}

/// Reads three numbers r g b; a single number stands for all three, as the MTL specification says.
fn colour(rest: &str) -> std::result::Result<[f64; 3], String> {
    if let Some(form @ ("spectral" | "xyz")) = values(rest).next() {
        return Err(format!("in the form `{form}` is not supported, must be r g b"));
    }
    // four numbers already are too many, and a line may hold millions
    let numbers: Vec<f64> =
        values(rest).take(4).map(number).collect::<std::result::Result<_, _>>()?;
    match numbers[..] {
        [grey] => Ok([grey; 3]),
        [r, g, b] => Ok([r, g, b]),
        _ => Err("must be three numbers r g b".into()),
    }
}

fn one(rest: &str) -> std::result::Result<f64, String> {
    let mut words = values(rest);
    match (words.next(), words.next()) {
        (Some(word), None) => number(word),
        _ => Err("must be one number".into()),
    }
}

fn number(word: &str) -> std::result::Result<f64, String> {
    let good = |x: &f64| x.is_finite() && *x >= 0.0;
    let found = word.parse().ok().filter(good);
    found.ok_or_else(|| format!("holds {}, must be a finite number, not negative", quoted(word)))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::obj::ObjFile;
    use phylux_testing::spoiled;

    /// Returns the library of an OBJ file in `dir` that has these `mtllib` lines.
    fn load(mtllibs: &str, files: &[(&str, &[u8])]) -> MtlLibrary {
        let obj = format!("{mtllibs}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3");
        let find = |path: &Path| match files.iter().find(|(name, _)| Path::new(name) == path) {
            Some((_, bytes)) => Ok(bytes.to_vec()),
            None => Err("there is no such file".to_owned()),
        };
        ObjFile::parse(obj.as_bytes(), Path::new("dir/a.obj"), find).unwrap().mtl
    }

    fn one_file(text: &str) -> MtlLibrary {
        load("mtllib a.mtl", &[("dir/a.mtl", text.as_bytes())])
    }

    #[test]
    fn keys_are_read() {
        let library = one_file(
            "\u{feff}# made by hand\nKd 9 9 9\n\nnewmtl my leaf\r\n\tKa 1 1 1\n illum 6\nKd 0.1 0.2 0.3 # green\n\
             Ks 0 0 0\nKe 1e3 \\\n2 3\nTf 0.4\nns 10\nNi 1.425\nmap_Kd C:\\a leaf.png\nd -1\nrefl x\n\
             newmtl bare",
        );
        assert_eq!(library.names().collect::<Vec<_>>(), ["my leaf", "bare"]);
        let expected = MtlEntry {
            name: "my leaf".into(),
            place: "dir/a.mtl:4".into(),
            illum: Some(6),
            kd: Some([0.1, 0.2, 0.3]),
            ks: Some([0.0; 3]),
            ke: Some([1e3, 2.0, 3.0]),
            tf: Some([0.4; 3]),
            ns: Some(10.0),
            ni: Some(1.425),
            map_kd: Some("C:\\a leaf.png".into()),
            map_d: None,
            unused: [("tf", "`Tf 0.4`"), ("d", "`d -1`"), ("refl", "`refl x`")]
                .map(|(key, text)| (key.into(), text.into()))
                .into(),
        };
        assert_eq!(library.entry("my leaf").unwrap(), Some(&expected));
        let bare = library.entry("bare").unwrap().unwrap();
        assert_eq!((bare.place.as_str(), bare.kd, bare.illum), ("dir/a.mtl:17", None, None));
        assert_eq!(library.entry("leaf"), Ok(None));
        assert!(library.missing().is_empty());
    }

    #[test]
    fn a_broken_entry_is_an_error_for_those_who_ask() {
        for (line, problem) in [
            ("Kd 0.5 0.5", "Kd must be three numbers r g b"),
            ("Kd 1 2 3 4", "Kd must be three numbers r g b"),
            ("Kd", "Kd must be three numbers r g b"),
            ("Kd spectral a.rfl", "Kd in the form `spectral` is not supported, must be r g b"),
            ("Tf xyz 1 1 1", "Tf in the form `xyz` is not supported"),
            ("Kd nan 0 0", "Kd holds `nan`, must be a finite number, not negative"),
            ("Ks 0 0 inf", "Ks holds `inf`, must be a finite number"),
            ("Ke -1 0 0", "Ke holds `-1`, must be a finite number, not negative"),
            ("Ke 0,5 0 0", "Ke holds `0,5`, must be a finite number"),
            ("Ns -2", "Ns holds `-2`"),
            ("Ns", "Ns must be one number"),
            ("Ni 1 2", "Ni must be one number"),
            ("illum", "illum `` is no whole number"),
            ("illum -1", "illum `-1` is no whole number"),
            ("illum 99999999999", "illum `99999999999` is no whole number"),
            ("Kd 1 1 1\nKd 1 1 1", "Kd stands twice"),
        ] {
            let library = one_file(&format!("newmtl good\nnewmtl bad\n{line}\nNs x\nnewmtl good2"));
            let at = 2 + line.lines().count();
            let error = library.entry("bad").unwrap_err().to_string();
            let expected = format!("dir/a.mtl:{at}: material `bad`: {problem}");
            assert!(error.starts_with(&expected), "{error}\n{expected}");
            assert!(library.entry("good").unwrap().is_some());
            assert!(library.entry("good2").unwrap().is_some());
        }
    }

    #[test]
    fn missing_files_are_remembered() {
        let library = load(
            "mtllib no.mtl\nmtllib a.mtl bin.mtl\nmtllib no.mtl",
            &[("dir/a.mtl", b"newmtl a"), ("dir/bin.mtl", b"\0")],
        );
        let missing = |file: &str, line, why: &str| MissingMtl {
            file: format!("dir/{file}"),
            place: format!("dir/a.obj:{line}"),
            why: why.into(),
        };
        let expected = [
            missing("no.mtl", 1, "there is no such file"),
            missing("bin.mtl", 2, "is not UTF-8 text but binary, or UTF-16"),
        ];
        assert_eq!(library.missing(), expected);
        assert!(library.entry("a").unwrap().is_some());
    }

    #[test]
    fn entries_of_one_name_must_agree() {
        let both = |a: &[u8], b: &[u8]| {
            let files = [("dir/a.mtl", a), ("dir/b.mtl", b)];
            load("mtllib a.mtl b.mtl\nmtllib a.mtl", &files).entry("x").map(|e| e.cloned())
        };
        let same = both(b"newmtl x\nKd 1 0 0", b"# copy\nnewmtl x\nKd 1.0 0 0").unwrap().unwrap();
        assert_eq!(same.place, "dir/a.mtl:1");
        let error = both(b"newmtl x\nKd 1 0 0", b"\nnewmtl x\nKd 0 1 0").unwrap_err().to_string();
        assert_eq!(
            error,
            "dir/b.mtl:2: `x` stands at dir/a.mtl:1 too, otherwise; rename or delete one"
        );
        assert!(both(b"newmtl x\nKd 1 0 0", b"newmtl x\nKd 1 0").is_err());
        assert!(both(b"newmtl x\nKd 1 0", b"newmtl x\nKd 1 0 0").is_err());
    }

    #[test]
    fn mtl_files_lie_beside_the_obj_file() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("sub")).unwrap();
        let write = |name: &str, text| std::fs::write(dir.path().join(name), text).unwrap();
        write("sub/my plant.mtl", "newmtl stem\nKd 1 1 1\n");
        write("sub/a.obj", "mtllib my plant.mtl\nmtllib .\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        let path = dir.path().join("sub/a.obj");
        let bytes = std::fs::read(&path).unwrap();
        let mtl = ObjFile::parse(&bytes, &path, crate::input::read_bytes).unwrap().mtl;
        assert!(mtl.entry("stem").unwrap().unwrap().place.ends_with("my plant.mtl:1"));
        assert_eq!(mtl.missing()[0].why, "is a directory, not a file");
    }

    const FILES: &[&str] = &[
        "newmtl leaf\nillum 6\nKd 0.1 0.4 0.1\nTf 0.2 0.4 0.2\nNi 1.4\n\nnewmtl lamp\nKe 10 10 10\nKd 0 0 0\n",
        "# x\r\nnewmtl my leaf\r\n\tKd .5\r\n\tKs 0 0 0\r\n\tNs 10\r\n\tmap_Kd a b.png\r\nnewmtl leaf\r\nKd 1 1 1\r\n",
    ];
    const WORDS: &[&str] =
        &["newmtl", "Kd", "Ks", "Ke", "Tf", "Ns", "Ni", "illum", "leaf", "spectral", "xyz"];

    fn check(bytes: &[u8]) {
        let library = load("mtllib a.mtl", &[("dir/a.mtl", bytes)]);
        for name in library.names() {
            match library.entry(name) {
                Err(error) => assert!(error.to_string().starts_with("dir/a.mtl:")),
                Ok(entry) => {
                    let e = entry.expect("a name has an entry");
                    assert_eq!(e.name, name);
                    let colours = [e.kd, e.ks, e.ke, e.tf].into_iter().flatten().flatten();
                    let numbers = colours.chain(e.ns).chain(e.ni);
                    numbers.for_each(|x| assert!(x.is_finite() && x >= 0.0));
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
