//! Sweep files: say which scene is run, which of its values vary, and which values go together.
//! They are checked and become a [`Sweep`].
//!
//! `format` has the types that the JSON is read into, `reader` turns them into parameters and the
//! points of the design, and `design` and `parameter` define these.

mod design;
mod format;
mod parameter;
mod reader;

use std::{
    collections::HashMap,
    fmt::Display,
    path::{Path, PathBuf},
};

use serde_json::{Map, Value};
use sha2::{Digest, Sha256};

use format::CombineFile;
pub use format::SweepFile;

use crate::{
    input::{RELATIVE, hex, quoted, read_bytes},
    json,
};
use design::Points;
pub use parameter::{BALANCE, Parameter};
use parameter::{X, expression, is_numbers};
use phylux_core::{
    error::{Error, Result},
    math::expression::Expression,
    transport::settings::Settings,
};
use reader::Reader;

/// A scene and all the values that it is to be run with.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// The folder that the path of the scene, and the paths in the scene, are relative to.
    folder: PathBuf,
    /// Path of the scene file, relative to `folder`.
    scene_path: String,
    /// Content of the sweep file, as written.
    file: Value,
    /// Content of the scene file, as written.
    scene: Value,
    parameters: Vec<Parameter>,
    points: Points,
    /// Whether the points of the design are a sample.
    sampled: bool,
    seeds: u64,
}

/// One run of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Run<'a> {
    /// Number of the run, from 1, in the order of the design.
    pub number: usize,
    /// Index of the value of each parameter.
    pub choices: Vec<usize>,
    /// Each parameter with its value.
    pub values: Vec<(&'a Parameter, &'a Value)>,
    /// Seed of the run's random streams.
    pub seed: u64,
}

impl Sweep {
    /// Reads the sweep file at `path` and its scene. Errors name the file and the place in it.
    pub fn load(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        let bytes = read_bytes(path)
            .map_err(|why| Error::input(&name, why).remedy("name a sweep file (JSON)"))?;
        let value = json::parse(&name, &bytes)?;
        let file: SweepFile = json::read(&name, value.clone())?;
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let bytes = read_bytes(&folder.join(&file.scene)).map_err(|why| {
            let problem = format!("{}: {why}", file.scene);
            Error::input(json::place(&name, "/scene"), problem).remedy(RELATIVE)
        })?;
        let scene = json::parse(&file.scene, &bytes)?;
        Self::new(&name, value, scene, folder)
    }

    /// Makes a sweep of the content of the sweep file `name` and of its scene. Paths in the scene
    /// are relative to `folder`. Errors name the place in the sweep file.
    pub fn new(name: &str, file: Value, scene: Value, folder: PathBuf) -> Result<Self> {
        let sweep_file: SweepFile = json::read(name, file.clone())?;
        let reader = Reader { name, scene: &scene };
        let seeds = sweep_file.seeds.map_or(1, |seeds| seeds.0);
        let (parameters, points) = reader.design(&sweep_file, seeds)?;
        let sampled = matches!(sweep_file.combine, CombineFile::Sample(_));
        let scene_path = sweep_file.scene;
        let sweep = Self { folder, scene_path, file, scene, parameters, points, sampled, seeds };
        sweep.check_runs(name)?;
        Ok(sweep)
    }

    /// Returns the sweep with this number of photons and this first seed in place of those of the
    /// scene, where they are given.
    pub fn with_settings(mut self, photons: Option<u64>, seed: Option<u64>) -> Self {
        let given = [("photons", photons), ("seed", seed)];
        if let Value::Object(scene) = &mut self.scene
            && given.iter().any(|(_, value)| value.is_some())
            && let Value::Object(settings) =
                scene.entry("settings").or_insert_with(|| Map::new().into())
        {
            for (key, value) in given {
                value.map(|value| settings.insert(key.into(), value.into()));
            }
        }
        self
    }

    /// Returns the content of the sweep file, as written.
    pub fn file(&self) -> &Value {
        &self.file
    }

    /// Returns the content of the scene file, as written.
    pub fn scene(&self) -> &Value {
        &self.scene
    }

    /// Returns the path of the scene, relative to the sweep file.
    pub fn scene_path(&self) -> &str {
        &self.scene_path
    }

    /// Returns the folder that the path of the scene, and the paths in the scene, are relative to.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns the parameters that the sweep varies.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Returns whether several parameters vary at once, so that the runs with neighbouring values
    /// of one parameter differ in the others too.
    pub fn is_scattered(&self) -> bool {
        self.sampled && self.parameters.len() > 1
    }

    /// Returns all runs in the order of the design; the runs of a point with different seeds follow
    /// one another.
    pub fn runs(&self) -> impl ExactSizeIterator<Item = Run<'_>> {
        (0..self.points.len() * self.seeds as usize).map(|index| self.run(index))
    }

    /// Returns the run with this index, from 0, in the order of the design.
    pub fn run(&self, index: usize) -> Run<'_> {
        let (point, seed) = (index / self.seeds as usize, index as u64 % self.seeds);
        let choices: Vec<usize> = self.points[point].iter().map(|i| *i as usize).collect();
        let values = self.parameters.iter().zip(&choices);
        let values = values.map(|(p, &i)| (p, &p.values[i])).collect();
        Run { number: index + 1, choices, values, seed: self.first_seed().wrapping_add(seed) }
    }

    fn first_seed(&self) -> u64 {
        let seed = self.scene.pointer("/settings/seed").and_then(Value::as_u64);
        seed.unwrap_or(Settings::default().seed)
    }

    /// Returns what a value of a run puts at a place in the scene. An expression, where the scene
    /// has numbers, gives its own value for each of these numbers, rounded to 12 digits; any other
    /// value is put there unchanged. An expression whose value is not finite is put there as text,
    /// which makes the scene invalid.
    pub fn value_at(&self, run: &Run, value: &Value, place: &str) -> Value {
        let parsed = expression(value).and_then(|text| Expression::parse(text).ok());
        let there = || self.scene.pointer(place).filter(|there| is_numbers(there));
        let Some((expression, there)) = parsed.zip(there()) else { return value.clone() };
        let of_parameter = |name: &str| {
            let found = run.values.iter().find(|(parameter, _)| parameter.name == name);
            found.and_then(|(_, value)| value.as_f64()).unwrap_or(f64::NAN)
        };
        each_number(there, &|x: f64| {
            let found = expression.value(|name| if name == X { x } else { of_parameter(name) });
            if found.is_finite() { design::number(design::round(found)) } else { value.clone() }
        })
    }

    /// Returns the scene of a run, with the run's values and seed.
    pub fn document(&self, run: &Run) -> Value {
        let mut document = self.scene.clone();
        for (parameter, value) in &run.values {
            for place in &parameter.at {
                let value = self.value_at(run, value, place);
                if let Some(place) = document.pointer_mut(place) {
                    *place = value;
                }
            }
        }
        if let Value::Object(scene) = &mut document
            && let Value::Object(settings) =
                scene.entry("settings").or_insert_with(|| Map::new().into())
        {
            settings.insert("seed".into(), run.seed.into());
        }
        document
    }

    /// Returns a name of a run that does not depend on the other runs of the sweep: a hash of the
    /// path of the scene and of the run's values and seed.
    pub fn key(&self, run: &Run) -> String {
        let values = run.values.iter().map(|(p, value)| (&p.name, &p.at, value));
        let text = serde_json::json!([self.scene_path, values.collect::<Vec<_>>(), run.seed]);
        hash(text.to_string().as_bytes())[..16].to_string()
    }

    /// Checks that no two runs are the same. Those of a point differ in their seeds, so points are
    /// compared.
    fn check_runs(&self, name: &str) -> Result<()> {
        let firsts: Vec<Vec<u32>> = self.parameters.iter().map(|p| firsts(&p.values)).collect();
        let mut known = HashMap::with_capacity(self.points.len());
        for (point, choices) in self.points.iter().enumerate() {
            let choices = choices.iter().zip(&firsts).map(|(&i, firsts)| firsts[i as usize]);
            if let Some(first) = known.insert(choices.collect::<Vec<u32>>(), point) {
                let of_point = |point: usize| self.run(point * self.seeds as usize);
                let (first, run) = (of_point(first), of_point(point));
                let problem =
                    format!("runs {} and {} are the same ({run})", first.number, run.number);
                return Err(Error::input(json::place(name, "/vary"), problem)
                    .remedy("name each value once; `seeds` repeats runs"));
            }
        }
        Ok(())
    }
}

/// Returns for each value the index of the first one that is the same.
fn firsts(values: &[Value]) -> Vec<u32> {
    let mut known = HashMap::with_capacity(values.len());
    let first = |(i, value): (usize, &Value)| *known.entry(value.to_string()).or_insert(i as u32);
    values.iter().enumerate().map(first).collect()
}

/// Replaces each number in `value` by the result of `of`.
fn each_number(value: &Value, of: &dyn Fn(f64) -> Value) -> Value {
    match value {
        Value::Number(number) => number.as_f64().map_or(Value::Null, of),
        Value::Array(values) => values.iter().map(|value| each_number(value, of)).collect(),
        other => other.clone(),
    }
}

impl Display for Run<'_> {
    /// Writes the run's values and its seed.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (parameter, value) in &self.values {
            let (name, unit) = without_unit(&parameter.name);
            match value {
                Value::Number(number) if !unit.is_empty() => {
                    write!(f, "{name} = {number} {unit}, ")?
                }
                _ => write!(f, "{} = {}, ", parameter.name, quoted_value(value))?,
            }
        }
        write!(f, "seed {}", self.seed)
    }
}

/// Units that the name of a parameter may end with, after a comma, as at an axis.
const UNITS: [&str; 17] = [
    "m",
    "cm",
    "mm",
    "km",
    "in",
    "ft",
    "nm",
    "W",
    "kW",
    "umol/s",
    "W/m2",
    "umol/m2/s",
    "mol/m2/d",
    "h",
    "deg",
    "°",
    "%",
];

/// Returns the name of a parameter without its unit, and the unit: `lamp height, m` is `lamp height`
/// and `m`. The unit is empty if the name ends with none.
fn without_unit(name: &str) -> (&str, &str) {
    match name.rsplit_once(", ") {
        Some((name, unit)) if UNITS.contains(&unit) => (name, unit),
        _ => (name, ""),
    }
}

/// Returns a value for a sentence.
fn quoted_value(value: &Value) -> String {
    match value {
        Value::Number(number) => number.to_string(),
        Value::String(text) => quoted(text),
        other => quoted(&other.to_string()),
    }
}

/// Returns a SHA-256 hash in hexadecimal digits.
pub fn hash(bytes: &[u8]) -> String {
    hex(Sha256::new_with_prefix(bytes))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use phylux_testing::spoiled;

    const SCENE: &str = r#"{"lights": [{"power": 1}, {"power": [2, 3]}], "settings": {"seed": 3}}"#;
    const FILES: &[&str] = &[
        r#"{ "scene": "s.json",
             "vary": { "/lights/0/power": [ 1, 2.5, "x" ], "b": { "at": [ "/lights/1/power/0" ],
                "from": 1, "to": 2, "steps": 3 } }, "combine": "grid", "seeds": 3 }"#,
        r#"{ "scene": "s.json", "vary": { "/lights/0/power": { "from": 1, "to": 20 } },
             "combine": { "sample": "sobol", "count": 9, "seed": 4 } }"#,
        r#"{ "scene": "s.json", "vary": { "/lights/0/power": [ 1, 2 ],
             "/lights/1/power/1": { "values": [ [ 1 ], true ] } }, "combine": "zip" }"#,
        r#"{ "scene": "s.json", "vary": { "rise": [ 0, 0.5 ], "/lights/*/power": [ "=x + rise", "=-(x ^ 2) / {rise}" ] } }"#,
    ];

    #[test]
    fn a_star_stands_for_every_index_and_name() {
        let scene: Value = serde_json::from_str(SCENE).expect("JSON");
        let sweep = |vary: &str| {
            let file = format!(r#"{{"scene": "s.json", "vary": {{{vary}}}}}"#);
            let file = serde_json::from_str(&file).expect("JSON");
            Sweep::new("s", file, scene.clone(), PathBuf::new())
        };
        let found = sweep(r#""/lights/*/power": [4, 5]"#).expect("a sweep");
        assert_eq!(found.parameters()[0].at, ["/lights/0/power", "/lights/1/power"]);
        let last = found.document(&found.run(1));
        assert_eq!(last["lights"], serde_json::json!([{"power": 5}, {"power": 5}]));
        let found = sweep(r#""a": {"at": ["/*/*/power/1"], "values": [4]}"#).expect("a sweep");
        assert_eq!(found.parameters()[0].at, ["/lights/1/power/1"]);
        let none = sweep(r#""/lights/*/powr": [4]"#).unwrap_err().to_string();
        assert!(none.contains("the scene has no `/lights/*/powr`"), "{none}");
    }

    /// Expressions read each number in the scene and the other parameters; a parameter that only
    /// expressions read needs no place.
    #[test]
    fn expressions_read_the_scene_and_other_parameters() {
        let sweep = |vary: &str| {
            let scene = serde_json::from_str(SCENE).expect("JSON");
            let file = format!(r#"{{"scene": "s.json", "vary": {{{vary}}}}}"#);
            Sweep::new("s", serde_json::from_str(&file).expect("JSON"), scene, PathBuf::new())
        };
        let found = sweep(
            r#""rise": [0, 0.1], "/lights/*/power": ["=x", "=1.5 * x + rise"], "/settings/seed": [3]"#,
        );
        assert!(found.unwrap_err().to_string().contains("/settings/seed cannot vary"));
        let found = sweep(r#""rise": [0, 0.1], "/lights/*/power": ["=x", "=1.5 * x + rise"]"#);
        let found = found.expect("a sweep");
        let documents: Vec<Value> = found.runs().map(|run| found.document(&run)).collect();
        let powers: Vec<Value> = documents
            .iter()
            .map(|d| serde_json::json!([d["lights"][0]["power"], d["lights"][1]["power"]]))
            .collect();
        let expected =
            serde_json::json!([[1, [2, 3]], [1.5, [3, 4.5]], [1, [2, 3]], [1.6, [3.1, 4.6]]]);
        assert_eq!(Value::from(powers), expected);
        for (vary, words) in [
            (r#""/lights/0/power": ["=x +"]"#, "`=x +`: it ends too early"),
            (r#""/lights/0/power": ["=2 * z"]"#, "`=2 * z`: there is no parameter `z`"),
            (r#""a": ["=1"], "/lights/0/power": ["=a"]"#, "`=a`: a value of `a` is no number"),
            (r#""a": [1, 2]"#, "does not say where in the scene its value goes"),
        ] {
            let error = sweep(vary).expect_err(vary).to_string();
            assert!(error.contains(words), "{error}");
        }
        // where the scene has no number, the expression is a plain text
        let text = sweep(r#""/lights/0": ["=2 * x"]"#).expect("a sweep");
        assert_eq!(text.document(&text.run(0))["lights"][0], "=2 * x");
        // a run whose expression has no value fails alone, without the other runs
        let odd = sweep(r#""/lights/0/power": ["=x / 0"]"#).expect("a sweep");
        assert_eq!(odd.document(&odd.run(0))["lights"][0]["power"], "=x / 0");
    }

    /// A run is described with the unit behind its number, where the name ends with a unit.
    #[test]
    fn a_unit_follows_its_number() {
        for (name, words) in [
            ("lamp height, m", "lamp height = 0.6 m, seed 3"),
            ("light, in the middle", "light, in the middle = 0.6, seed 3"),
            ("m", "m = 0.6, seed 3"),
        ] {
            let vary =
                serde_json::json!({ name: { "at": ["/lights/0/power"], "values": [0.6, 1] } });
            let file = serde_json::json!({ "scene": "s.json", "vary": vary });
            let scene = serde_json::from_str(SCENE).expect("JSON");
            let sweep = Sweep::new("s", file, scene, PathBuf::new()).expect("a sweep");
            assert_eq!(sweep.run(0).to_string(), words);
        }
    }

    const WORDS: &[&str] = &[
        "\"grid\"",
        "\"=x * 2\"",
        "\"=b ^ x\"",
        "\"zip\"",
        "\"latin-hypercube\"",
        "\"steps\":",
        "\"at\":",
        "[",
        "]",
        "{",
        "}",
        "null",
        "\"/lights/0\"",
        "\"/settings/seed\"",
        "\"\"",
        "40.0",
        "1e6",
        "100000",
    ];

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Any text gives a sweep of different runs, or an error of one sentence.
        #[test]
        fn no_spoiled_file_panics(bytes in spoiled(FILES, WORDS)) {
            let scene: Value = serde_json::from_str(SCENE).expect("JSON");
            let sweep = json::parse("s", &bytes)
                .and_then(|file| Sweep::new("s", file, scene.clone(), PathBuf::new()));
            match sweep {
                Ok(sweep) => {
                    let last = sweep.runs().last().expect("a run");
                    assert_eq!(last.number, sweep.runs().len());
                    assert_eq!(sweep.document(&last)["settings"]["seed"], last.seed);
                }
                Err(error) => {
                    let sentence = error.to_string();
                    assert!(sentence.starts_with('s'), "{sentence}");
                    assert!(!sentence.contains(char::is_control), "{sentence:?}");
                }
            }
        }
    }
}
