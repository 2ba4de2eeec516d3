//! The results of a run as flat arrays for numpy, and as files.

use std::{
    collections::BTreeMap,
    io::{self, Write},
    path::PathBuf,
};

use numpy::PyArray1;
use phylux::{
    RunResult,
    formats::{FilesRead, OutputFile, OutputFolder},
    results::{
        CaptorResult, Column, Comparison, Errors, FaceResult, Factor, GroupResult, Measure, Per,
        QUANTITIES, Quantity, Row, When,
    },
    studies::{EvenPlan, Mix, Page, Summary, WORST, summary},
};
use pyo3::{
    prelude::*,
    types::{PyBytes, PyDict},
};

use crate::errors::{InPython, raised, spelled};

/// The results of a run.
#[pyclass(frozen, module = "phylux._native")]
pub struct Found {
    pub result: RunResult,
    /// All fields of the results file except the captors and groups, as JSON.
    head: String,
    /// The files that the scene was read from; no output may replace one of them.
    files: Vec<PathBuf>,
}

impl Found {
    /// Takes the results of a scene that was read from these files.
    pub fn new(mut result: RunResult, files: Vec<PathBuf>) -> Self {
        let captors = std::mem::take(&mut result.captors);
        let groups = std::mem::take(&mut result.groups);
        // plain data with texts as keys always has a form in JSON
        let head = serde_json::to_string(&result).unwrap_or_default();
        Self { result: RunResult { captors, groups, ..result }, head, files }
    }

    /// Returns the content of the results file.
    pub fn json_bytes(&self) -> PyResult<Vec<u8>> {
        let mut bytes = Vec::new();
        phylux::formats::write_json(&self.result, &mut bytes)?;
        Ok(bytes)
    }
}

/// Returns a page of Python with lines of this width.
pub fn page(width: usize) -> Page {
    Page { width: width.max(Page::WIDTH), full: false, spelling: &InPython }
}

/// Text, values as JSON, unmatched values, number of values left out, limit of |z|, whether both
/// agree, whether they share random numbers.
type Compared = (String, String, Vec<String>, usize, f64, bool, bool);

/// One or more factors on the power of a light.
#[derive(FromPyObject)]
enum Factors {
    /// The same factor in all bands.
    All(f64),
    /// One factor for each band.
    Bands(Vec<f64>),
}

impl From<Factors> for Factor {
    fn from(factors: Factors) -> Self {
        match factors {
            Factors::All(factor) => Self::All(factor),
            Factors::Bands(factors) => Self::Bands(factors),
        }
    }
}

/// Name in tables and of arrays, what there is a value for, unit, whether faces have it, whether all
/// results do, whether it is known by its name alone, and its part of the rows of captors.
type Entry = (&'static str, &'static str, &'static str, &'static str, bool, bool, bool, Option<u8>);

/// Returns the registry of quantities.
#[pyfunction]
pub fn quantities() -> Vec<Entry> {
    let entry = |quantity: &Quantity| {
        let per = match quantity.per {
            Per::Band => "band",
            Per::Ratio => "ratio",
            Per::Place => "",
        };
        let unit = match quantity.measure {
            Measure::Flux => "flux",
            Measure::Irradiance => "irradiance",
            Measure::Radiance => "radiance",
            Measure::Dli => "dli",
            Measure::Number => "",
        };
        let (of_faces, always) = (quantity.is_of_faces(), quantity.when == When::Always);
        let (name, array, part) = (quantity.name, quantity.array, quantity.captor_rows);
        (name, array, per, unit, of_faces, always, quantity.is_own(), part)
    };
    QUANTITIES.iter().map(entry).collect()
}

/// Numbers for an array of `width` columns; NaN where no value is known.
struct Numbers {
    values: Vec<f64>,
    width: usize,
}

impl Numbers {
    fn new(rows: usize, width: usize) -> Self {
        Self { values: vec![f64::NAN; rows * width], width }
    }

    fn put(&mut self, row: usize, values: &[f64]) {
        let into = &mut self.values[row * self.width..][..self.width];
        into.iter_mut().zip(values).for_each(|(into, value)| *into = *value);
    }

    fn put_each(&mut self, row: usize, value: impl Fn(usize) -> Option<f64>) {
        let into = self.values[row * self.width..][..self.width].iter_mut();
        into.enumerate().for_each(|(i, into)| *into = value(i).unwrap_or(f64::NAN));
    }
}

/// A dictionary of flat arrays.
struct Arrays<'py>(Bound<'py, PyDict>);

impl<'py> Arrays<'py> {
    fn new(py: Python<'py>) -> Self {
        Self(PyDict::new(py))
    }

    fn add(&self, name: &str, numbers: Numbers) -> PyResult<()> {
        self.0.set_item(name, PyArray1::from_vec(self.0.py(), numbers.values))
    }

    fn add_counts(&self, name: &str, counts: Vec<i64>) -> PyResult<()> {
        self.0.set_item(name, PyArray1::from_vec(self.0.py(), counts))
    }
}

#[pymethods]
impl Found {
    /// Reads a results file.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let result = raised(py, py.detach(|| phylux::formats::read_json(&path)))?;
        Ok(Self::new(result, Vec::new()))
    }

    /// Reads results from the bytes of a results file.
    #[staticmethod]
    fn from_json(py: Python<'_>, json: &[u8]) -> PyResult<Self> {
        Ok(Self::new(raised(py, phylux::formats::parse_json(json))?, Vec::new()))
    }

    /// Returns the bytes of the results file.
    fn to_json<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.json_bytes()?))
    }

    /// Writes the results file.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        self.write_with(py, path, |result, writer| phylux::formats::write_json(result, writer))
    }

    /// Writes the tidy table.
    fn write_csv(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        self.write_with(py, path, |result, writer| phylux::formats::write_csv(result, writer))
    }

    /// Writes one file for each captor into a folder.
    fn write_per_captor(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        let written = py.detach(|| {
            OutputFolder::create(&folder)?.write(&FilesRead::new(&self.files), &self.result)
        });
        raised(py, written)
    }

    /// The files that the scene was read from.
    #[getter]
    fn files(&self) -> Vec<PathBuf> {
        self.files.clone()
    }

    /// All fields of the results file except captors and groups, as JSON.
    #[getter]
    fn head(&self) -> &str {
        &self.head
    }

    /// Returns the summary that `phylux run` ends with, for lines of this width, and its warnings.
    fn summary(&self, width: usize) -> (String, Vec<String>) {
        let Summary { text, warnings } = summary(&page(width), &self.result, "");
        let mut all = self.result.warnings_of_scene();
        all.extend(spelled(&warnings));
        (text, all)
    }

    /// Returns the results that the run would have with the powers of its lights multiplied by
    /// these factors.
    #[pyo3(signature = (factors, calibration=None))]
    fn mix(
        &self,
        py: Python<'_>,
        factors: Vec<(String, Factors)>,
        calibration: Option<PathBuf>,
    ) -> PyResult<Self> {
        let factors = factors.into_iter().map(|(name, factors)| (name, factors.into())).collect();
        let mixed =
            py.detach(|| Mix::new(&self.result, factors, calibration.as_deref())?.of(&self.result));
        Ok(Self::new(raised(py, mixed)?, self.files.clone()))
    }

    /// Returns the powers of lamps that light these captors evenly, as JSON. `watts` are the electric
    /// powers of lights.
    #[pyo3(signature = (captors, watts, mean=None, minimum=None, band=None, groups=Vec::new()))]
    #[expect(clippy::too_many_arguments, reason = "they are those of the method in Python")]
    fn even(
        &self,
        py: Python<'_>,
        captors: String,
        watts: BTreeMap<String, f64>,
        mean: Option<f64>,
        minimum: Option<f64>,
        band: Option<String>,
        groups: Vec<String>,
    ) -> PyResult<String> {
        let plan = EvenPlan { captors, band, mean, minimum, groups };
        let found = raised(py, py.detach(|| phylux::studies::even(&self.result, &watts, &plan)))?;
        Ok(serde_json::to_string(&found).unwrap_or_default())
    }

    /// Compares these results with others. Returns the text of `phylux compare`, for lines of this
    /// width; all values as JSON;
    /// those that only one of them has; the number that is left out because their errors say little;
    /// the limit of |z|; and whether both agree, and share random numbers.
    fn compare(&self, py: Python<'_>, other: &Self, width: usize) -> PyResult<Compared> {
        let (a, b) = (&self.result, &other.result);
        let comparison = raised(py, py.detach(|| Comparison::new(a, b)))?;
        let text = phylux::studies::comparison(&page(width), a, b, &comparison, WORST);
        let agree = comparison.agrees();
        let Comparison { differences, few_paths, unmatched, limit, dependent } = comparison;
        let values = serde_json::to_string(&differences).unwrap_or_default();
        Ok((text, values, unmatched, few_paths, limit, agree, dependent))
    }

    /// Returns the ids of the captors, or of the groups.
    fn ids(&self, groups: bool) -> Vec<&str> {
        match groups {
            true => self.result.groups.iter().map(|group| group.id.as_str()).collect(),
            false => self.result.captors.iter().map(|captor| captor.id.as_str()).collect(),
        }
    }

    /// Returns the values of captors or groups, for all light or for the light with this index. The
    /// arrays are flat: the index of the captor or group comes first, then the face (front, back),
    /// then the band; NaN where there is no value.
    #[pyo3(signature = (groups, light=None))]
    fn arrays<'py>(
        &self,
        py: Python<'py>,
        groups: bool,
        light: Option<usize>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let rows = self.rows(groups, light);
        let areas = match groups {
            true => self.result.groups.iter().map(|group| group.area).collect(),
            false => self.result.captors.iter().map(|captor| captor.area).collect(),
        };
        let arrays = Arrays::new(py);
        arrays.add("area", Numbers { values: areas, width: 1 })?;
        let faces = || rows.iter().flat_map(|row| row.faces);
        let count = |of: fn(&FaceResult) -> u64| {
            faces().map(|face| face.map_or(0, of).cast_signed()).collect()
        };
        arrays.add_counts("photons", count(|face| face.photons))?;
        let has_back = rows.iter().map(|row| i64::from(row.faces[1].is_some()));
        arrays.add_counts("has_back", has_back.collect())?;
        if !groups {
            arrays.add_counts("histories", count(|face| face.histories.unwrap_or(0)))?;
        }
        let uncertain = self.result.extras.budget.is_some() && light.is_none();
        for quantity in QUANTITIES.iter().filter(|quantity| !quantity.is_nearest()) {
            self.add(&arrays, quantity, &rows, uncertain)?;
        }
        Ok(arrays.0)
    }

    /// Returns the places of the captors: `center` and `normal` with three coordinates for each
    /// captor, and `surface`, which is 1 for surfaces and 0 for virtual captors.
    fn places<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let captors = &self.result.captors;
        let mut center = Numbers::new(captors.len(), 3);
        let mut normal = Numbers::new(captors.len(), 3);
        for (i, captor) in captors.iter().enumerate() {
            center.put(i, &captor.center);
            normal.put(i, &captor.normal);
        }
        let surface = captors.iter().map(|captor| i64::from(captor.kind == "surface")).collect();
        let arrays = Arrays::new(py);
        arrays.add("center", center)?;
        arrays.add("normal", normal)?;
        arrays.add_counts("surface", surface)?;
        Ok(arrays.0)
    }

    /// Returns the k-nearest estimates by captor, face and band; the dictionary is empty if there
    /// are none.
    fn nearest<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let captors = &self.result.captors;
        let arrays = Arrays::new(py);
        if !captors.iter().any(|captor| captor.faces().any(|f| matches!(f.knn, Some(Some(_))))) {
            return Ok(arrays.0);
        }
        let mut k = vec![0; 2 * captors.len()];
        let mut radius = Numbers::new(2 * captors.len(), 1);
        let mut coverage = Numbers::new(2 * captors.len(), 1);
        for (i, captor) in captors.iter().enumerate() {
            for (f, face) in captor.faces().enumerate() {
                let Some(Some(nearest)) = &face.knn else { continue };
                let at = 2 * i + f;
                k[at] = nearest.k as i64;
                radius.put(at, &[nearest.radius]);
                coverage.put(at, &[nearest.coverage]);
            }
        }
        let rows = self.rows(false, None);
        for quantity in QUANTITIES.iter().filter(|quantity| quantity.is_nearest()) {
            self.add(&arrays, quantity, &rows, false)?;
        }
        arrays.add("radius", radius)?;
        arrays.add("coverage", coverage)?;
        arrays.add_counts("k", k)?;
        Ok(arrays.0)
    }
}

impl Found {
    /// Returns the rows of captors or groups, for all light or for the light with this index.
    fn rows(&self, groups: bool, light: Option<usize>) -> Vec<Row<'_>> {
        let rows: Vec<Row<'_>> = match groups {
            true => self.result.groups.iter().map(GroupResult::row).collect(),
            false => self.result.captors.iter().map(CaptorResult::row).collect(),
        };
        match light {
            Some(light) => rows.into_iter().map(|row| row.of_light(light)).collect(),
            None => rows,
        }
    }

    /// Adds the arrays of a quantity, with those of its errors, where these rows have it.
    fn add(
        &self,
        arrays: &Arrays<'_>,
        quantity: &Quantity,
        rows: &[Row<'_>],
        uncertain: bool,
    ) -> PyResult<()> {
        let result = &self.result;
        let faces = if quantity.is_of_faces() { 0..2 } else { 2..3 };
        let at = rows.iter().flat_map(|row| faces.clone().map(|face| quantity.at(row, face)));
        let columns: Vec<Option<Column<'_>>> = at.collect();
        let there = match quantity.when {
            When::Always => true,
            When::Daily => result.unit.dli.is_some(),
            When::Ratios => !result.ratios.is_empty(),
            When::Found => columns.iter().any(Option::is_some),
        };
        if !there {
            return Ok(());
        }
        let width = quantity.width(result.bands.len(), result.ratios.len());
        let array = |of: &dyn Fn(&Column<'_>, usize) -> Option<f64>| {
            let mut numbers = Numbers::new(columns.len(), width);
            for (at, column) in columns.iter().enumerate() {
                column.iter().for_each(|column| numbers.put_each(at, |i| of(column, i)));
            }
            numbers
        };
        let name = quantity.array;
        arrays.add(name, array(&|column, i| column.value(i)))?;
        if quantity.errors != Errors::No {
            arrays.add(&format!("{name}_se"), array(&|column, i| column.errors(i)[0]))?;
        }
        if quantity.errors == Errors::Inputs && uncertain {
            arrays.add(&format!("{name}_model_se"), array(&|column, i| column.errors(i)[1]))?;
        }
        Ok(())
    }

    fn write_with(
        &self,
        py: Python<'_>,
        path: PathBuf,
        write: impl Fn(&RunResult, &mut dyn Write) -> io::Result<()> + Send + Sync,
    ) -> PyResult<()> {
        let written = py.detach(|| {
            let file = OutputFile::create(&path)?;
            file.write(&FilesRead::new(&self.files), |writer| write(&self.result, writer))
        });
        raised(py, written)
    }
}
