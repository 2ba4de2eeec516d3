//! The reference against which the errors of a study are measured: a table, or a long run.

use std::{collections::BTreeMap, path::Path};

use phylux_core::{
    error::{Error, Result, nearest},
    scene::world::Scene,
};
use phylux_files::{
    csv_text,
    input::{RELATIVE, quoted, read_bytes},
};
use phylux_results::result::{CaptorResult, RunResult};

/// Largest relative standard error at which a value of a run counts as the truth.
const KNOWN: f64 = 0.05;

/// Range of irradiances and their errors in a table: the squares of their ratios are finite.
const VALUES: std::ops::RangeInclusive<f64> = 1e-60..=1e60;

/// Irradiances to compare with, one for each captor, face and band that has one.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Name of the reference: a file, or a run of this study.
    pub name: String,
    /// Number of values, by captor, face and band, that are lit but not known well enough to
    /// compare with.
    pub left_out: usize,
    /// The values with their indices, which count captors in order, their faces and their bands.
    values: Vec<(usize, TrueValue)>,
}

/// An irradiance that is known.
#[derive(Clone, Copy, Debug)]
pub struct TrueValue {
    /// Irradiance, W/m2 or umol/m2/s, above 0.
    pub value: f64,
    /// Standard error of the value.
    pub standard_error: f64,
}

impl Reference {
    /// Takes the irradiances of a run on the faces that light has reached, if it knows them to 5 %.
    pub fn of_run(result: &RunResult, scene: &Scene) -> Self {
        let bands = scene.bands().len();
        let faces = result.captors.iter().flat_map(CaptorResult::faces);
        let each = faces.flat_map(|face| {
            (0..bands).map(|b| TrueValue {
                value: face.irradiance[b],
                standard_error: face.irradiance_se[b].unwrap_or(0.0),
            })
        });
        let lit = each.enumerate().filter(|(_, truth)| truth.value > 0.0);
        let (values, rough): (Vec<_>, Vec<_>) =
            lit.partition(|(_, truth)| truth.standard_error <= KNOWN * truth.value);
        let name = format!("a run of {:.1e} {}", result.photons as f64, result.estimator);
        Self { name, left_out: rough.len(), values }
    }

    /// Reads a table with the columns `captor`, `band`, one that begins with `irradiance` and, if
    /// wanted, `face` (front or back) and `stderr` or `standard_error`. A captor is named by its
    /// id, or by what follows the last slash of its id. A band without a name is named b0, b1, ...
    /// Errors, at `path:LINE`: a column, captor or band that is not there, a value that is neither
    /// 0 nor a positive number.
    pub fn read(path: &Path, scene: &Scene) -> Result<Self> {
        let bytes =
            read_bytes(path).map_err(|why| Error::input(path.display(), why).remedy(RELATIVE))?;
        let mut table = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(&bytes[..]);
        let bad = |e: csv::Error| Error::input(path.display(), format!("is no CSV table: {e}"));
        let columns = Columns::of(table.headers().map_err(bad)?, path)?;
        let places = Places::of(scene);
        let mut values = Vec::new();
        for record in table.records() {
            let record = record.map_err(bad)?;
            let line = record.position().map_or(0, csv::Position::line);
            let place = format!("{}:{line}", path.display());
            let number = |column: usize| {
                let cell = &record[column];
                let number = cell.parse().ok().filter(|v| *v == 0.0 || VALUES.contains(v));
                let problem = || {
                    let range = format!("from {:e} to {:e}", VALUES.start(), VALUES.end());
                    format!("{} must be a number, 0 or {range}", quoted(cell))
                };
                number.ok_or_else(|| Error::input(&place, problem()).remedy("mend it"))
            };
            let face = columns.face.map_or("front", |face| &record[face]);
            let index =
                places.find(&place, &record[columns.captor], face, &record[columns.band])?;
            let value = number(columns.irradiance)?;
            let standard_error = columns.standard_error.map_or(Ok(0.0), number)?;
            if value > 0.0 {
                values.push((index, TrueValue { value, standard_error }));
            }
        }
        if values.is_empty() {
            return Err(Error::input(path.display(), "holds no value above 0")
                .remedy("one row for each captor and band"));
        }
        Ok(Self { name: path.display().to_string(), left_out: 0, values })
    }

    /// Returns how many values can be compared with.
    pub fn compared(&self) -> usize {
        self.values.len()
    }

    /// Applies `of` to the index of each value and to the value.
    pub(super) fn map(&self, of: impl Fn(usize, &TrueValue) -> f64) -> Vec<f64> {
        self.values.iter().map(|(i, truth)| of(*i, truth)).collect()
    }

    pub(super) fn mean(&self, of: impl Fn(usize, &TrueValue) -> f64) -> f64 {
        self.map(of).iter().sum::<f64>() / self.values.len() as f64
    }

    pub(super) fn rms(&self, of: impl Fn(usize, &TrueValue) -> f64) -> f64 {
        self.mean(|i, truth| of(i, truth).powi(2)).sqrt()
    }

    /// Returns the relative root mean square standard error of the reference itself.
    pub fn floor(&self) -> f64 {
        self.rms(|_, truth| truth.standard_error / truth.value)
    }
}

/// Indices of the columns of a table.
struct Columns {
    captor: usize,
    band: usize,
    irradiance: usize,
    face: Option<usize>,
    standard_error: Option<usize>,
}

impl Columns {
    fn of(header: &csv::StringRecord, path: &Path) -> Result<Self> {
        let find = |fits: &dyn Fn(&str) -> bool| header.iter().position(fits);
        let need = |name: &str, found: Option<usize>| {
            let problem = || format!("has no column `{name}`");
            found.ok_or_else(|| {
                Error::input(format!("{}:1", path.display()), problem()).remedy(
                    "the first line names the columns: captor,band,irradiance and, if wanted, \
                    face,standard_error",
                )
            })
        };
        Ok(Self {
            captor: need("captor", find(&|name| name == "captor"))?,
            band: need("band", find(&|name| name == "band"))?,
            irradiance: need("irradiance", find(&|name| name.starts_with("irradiance")))?,
            face: find(&|name| name == "face"),
            standard_error: find(&|name| ["stderr", "standard_error"].contains(&name)),
        })
    }
}

/// Finds the index of the value of a captor, face and band.
struct Places<'a> {
    scene: &'a Scene,
    /// Index of each captor's first value.
    first: Vec<usize>,
    /// Captors by id, and by what follows the last slash of their ids; `None` if several ids end
    /// so.
    captors: BTreeMap<&'a str, Option<usize>>,
}

impl<'a> Places<'a> {
    fn of(scene: &'a Scene) -> Self {
        let (mut first, mut next) = (Vec::new(), 0);
        let mut captors = BTreeMap::new();
        for (c, captor) in scene.captors().iter().enumerate() {
            first.push(next);
            next += captor.kind.faces().len() * scene.bands().len();
            let short = captor.id.rsplit('/').next().unwrap_or_default();
            captors.entry(short).and_modify(|found| *found = None).or_insert(Some(c));
        }
        captors
            .extend(scene.captors().iter().enumerate().map(|(c, captor)| (&*captor.id, Some(c))));
        Self { scene, first, captors }
    }

    fn find(&self, place: &str, captor: &str, face: &str, band: &str) -> Result<usize> {
        let unknown = |what: &str, name: &str, known: Vec<&str>| {
            let problem = format!("no {what} {} in the scene", quoted(name));
            let otherwise = format!("name a {what} of the scene");
            Error::input(place, problem).did_you_mean(nearest(name, known), otherwise)
        };
        let captor = match self.captors.get(captor).or(self.captors.get(csv_text::text(captor))) {
            Some(Some(captor)) => *captor,
            Some(None) => {
                let problem = format!("{} is the end of several captors' ids", quoted(captor));
                return Err(Error::input(place, problem).remedy("write the whole id"));
            }
            None => return Err(unknown("captor", captor, self.captors.keys().copied().collect())),
        };
        let faces = &["front", "back"][..self.scene.captors()[captor].kind.faces().len()];
        let found = faces.iter().position(|name| *name == face);
        let face = found.ok_or_else(|| unknown("face", face, faces.to_vec()))?;
        let bands = self.scene.bands();
        let number = || band.strip_prefix('b')?.parse().ok().filter(|b: &usize| *b < bands.len());
        let named = |name: &str| bands.iter().position(|b| b.name == name);
        let band = named(band).or_else(|| named(csv_text::text(band))).or_else(number).ok_or_else(
            || unknown("band", band, bands.iter().map(|b| b.name.as_str()).collect()),
        )?;
        Ok(self.first[captor] + face * bands.len() + band)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::LazyLock;

    use proptest::prelude::*;

    use super::*;
    use phylux_testing::{check_error, check_finite, small_scene, spoiled};

    const FILES: &[&str] = &[
        "captor,face,band,irradiance_W_m2,stderr\nleaf,front,a,1.5,0.01\nleaf,back,b,2.5,0\ns,front,b0,3,0.1\n",
        "captor,band,irradiance\r\nleaf,a,1.5\r\ns,b1,1e-3\r\n",
    ];
    const WORDS: &[&str] = &[
        "captor",
        "band",
        "face",
        "front",
        "back",
        "leaf",
        "'leaf",
        "s",
        "b0",
        "b1",
        "b9",
        "a",
        "irradiance",
        "standard_error",
        "\"\"",
        "1e60",
        "1e-60",
        "1e-300",
    ];

    /// The scene, and the folder of the table.
    static SCENE: LazyLock<Scene> = LazyLock::new(|| small_scene().scene);
    static FOLDER: LazyLock<tempfile::TempDir> =
        LazyLock::new(|| tempfile::tempdir().expect("a temporary folder"));

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Any text leads to an error that names the file, or to values to compare with.
        #[test]
        fn no_spoiled_table_panics(bytes in spoiled(FILES, WORDS)) {
            let path = FOLDER.path().join("truth.csv");
            std::fs::write(&path, &bytes).expect("a file");
            match Reference::read(&path, &SCENE) {
                Err(error) => check_error(&error, &path),
                Ok(reference) => {
                    check_finite(&reference);
                    check_finite(&reference.floor());
                    assert!(reference.compared() > 0);
                    let faces = SCENE.captors().iter().map(|captor| captor.kind.faces().len());
                    let most = faces.sum::<usize>() * SCENE.bands().len();
                    assert!(reference.values.iter().all(|(i, v)| *i < most && v.value > 0.0));
                }
            }
        }
    }
}
