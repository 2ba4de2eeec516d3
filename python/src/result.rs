//! The results of a run as flat arrays for numpy, and as files.

use phylux::formats::parse_results;
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
        Absorbed, AbsorbedByFace, ByLight, CaptorResult, Comparison, FaceResult, Factor,
        GroupResult, Ratios, ResultsFile,
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

    /// Returns the results as they are read from their file.
    pub fn results_file(&self) -> PyResult<ResultsFile> {
        let bytes = self.json_bytes()?;
        Python::attach(|py| raised(py, parse_results(&bytes)))
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

/// A captor or group: its area, its faces, and the power that it absorbed, with standard errors.
struct Row<'a> {
    area: f64,
    faces: [Option<&'a FaceResult>; 2],
    absorbed: Option<(&'a [f64], &'a [Option<f64>])>,
    absorbed_model: Option<&'a [f64]>,
    absorbed_ratios: Option<&'a Ratios>,
    by_face: Option<&'a AbsorbedByFace>,
    sunlit: Option<[f64; 2]>,
}

impl<'a> Row<'a> {
    fn of_captor(captor: &'a CaptorResult) -> Self {
        Self {
            area: captor.area,
            faces: [Some(&captor.front), captor.back.as_ref()],
            absorbed: captor.absorbed.as_deref().zip(captor.absorbed_se.as_deref()),
            absorbed_model: captor.absorbed_model_se.as_deref(),
            absorbed_ratios: captor.absorbed_ratios.as_ref(),
            by_face: captor.absorbed_by_face.as_ref(),
            sunlit: captor.sunlit.zip(captor.sunlit_se).map(|(share, error)| [share, error]),
        }
    }

    fn of_group(group: &'a GroupResult) -> Self {
        Self {
            area: group.area,
            faces: [Some(&group.front), group.back.as_ref()],
            absorbed: group.absorbed.as_deref().zip(group.absorbed_se.as_deref()),
            absorbed_model: group.absorbed_model_se.as_deref(),
            absorbed_ratios: group.absorbed_ratios.as_ref(),
            by_face: group.absorbed_by_face.as_ref(),
            sunlit: group.sunlit.zip(group.sunlit_se).map(|(share, error)| [share, error]),
        }
    }

    /// Returns the same row with the values of one light alone.
    fn of_light(self, by_light: Option<&'a ByLight<Absorbed>>, light: usize) -> Self {
        let of_face = |face: &'a FaceResult| Some(face.by_light.as_ref()?.get_index(light)?.1);
        let absorbed = by_light.and_then(|lights| lights.get_index(light));
        Self {
            faces: self.faces.map(|face| face.and_then(of_face)),
            absorbed: absorbed.map(|(_, a)| (&a.absorbed[..], &a.absorbed_se[..])),
            absorbed_model: None,
            absorbed_ratios: absorbed.and_then(|(_, a)| a.absorbed_ratios.as_ref()),
            by_face: absorbed.and_then(|(_, a)| a.absorbed_by_face.as_ref()),
            ..self
        }
    }
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

    fn put_known(&mut self, row: usize, values: &[Option<f64>]) {
        let into = &mut self.values[row * self.width..][..self.width];
        into.iter_mut().zip(values).for_each(|(into, value)| *into = value.unwrap_or(f64::NAN));
    }
}

/// Puts ratios, their standard errors and their standard deviations by uncertain inputs into a row.
fn put_ratios([values, errors, model]: &mut [Numbers; 3], row: usize, found: &Ratios) {
    values.put_known(row, &found.ratio);
    errors.put_known(row, &found.ratio_se);
    found.ratio_model_se.iter().for_each(|values| model.put(row, values));
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
        let (a, b) = (self.results_file()?, other.results_file()?);
        let comparison = raised(py, py.detach(|| Comparison::new(&a, &b)))?;
        let text = phylux::studies::comparison(&page(width), &a, &b, &comparison, WORST);
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
        let rows: Box<dyn Iterator<Item = Row<'_>>> = match groups {
            true => Box::new(self.result.groups.iter().map(move |group| {
                let row = Row::of_group(group);
                match light {
                    Some(light) => row.of_light(group.by_light.as_ref(), light),
                    None => row,
                }
            })),
            false => Box::new(self.result.captors.iter().map(move |captor| {
                let row = Row::of_captor(captor);
                match light {
                    Some(light) => row.of_light(captor.by_light.as_ref(), light),
                    None => row,
                }
            })),
        };
        let count = if groups { self.result.groups.len() } else { self.result.captors.len() };
        let bands = self.result.bands.len();
        let faces = || Numbers::new(2 * count, bands);
        let (mut flux, mut flux_se, mut irradiance, mut irradiance_se) =
            (faces(), faces(), faces(), faces());
        let (mut min, mut max) = (faces(), faces());
        let even = ["min_over_mean", "min_over_mean_se", "cv", "cv_se"];
        let mut even = even.map(|name| (name, faces()));
        let (mut dli, mut dli_se) = (faces(), faces());
        // standard deviations by uncertain inputs
        let (mut flux_model, mut irradiance_model) = (faces(), faces());
        let mut absorbed_model = Numbers::new(count, bands);
        let has_model = self.result.budget.is_some() && light.is_none();
        let ratios = self.result.ratios.len();
        let mut ratio = [(); 3].map(|()| Numbers::new(2 * count, ratios));
        let mut absorbed_ratio = [(); 3].map(|()| Numbers::new(count, ratios));
        let (mut by_face, mut by_face_se, mut has_faces) = (faces(), faces(), false);
        let mut sunlit = [(); 2].map(|()| Numbers::new(count, 1));
        let mut has_sunlit = false;
        let mut absorbed = Numbers::new(count, bands);
        let mut absorbed_se = Numbers::new(count, bands);
        let mut area = Numbers::new(count, 1);
        let (mut photons, mut histories) = (vec![0; 2 * count], vec![0; 2 * count]);
        let (mut has_back, mut ranges) = (vec![0; count], false);
        let has_dli = self.result.unit.dli.is_some();
        for (i, row) in rows.enumerate() {
            area.put(i, &[row.area]);
            has_back[i] = i64::from(row.faces[1].is_some());
            for (f, face) in row.faces.into_iter().enumerate() {
                let Some(face) = face else { continue };
                let at = 2 * i + f;
                flux.put(at, &face.flux);
                flux_se.put_known(at, &face.flux_se);
                irradiance.put(at, &face.irradiance);
                irradiance_se.put_known(at, &face.irradiance_se);
                face.flux_model_se.iter().for_each(|values| flux_model.put(at, values));
                face.irradiance_model_se.iter().for_each(|of| irradiance_model.put(at, of));
                face.dli.iter().for_each(|values| dli.put_known(at, values));
                face.dli_se.iter().for_each(|values| dli_se.put_known(at, values));
                face.ratios.iter().for_each(|found| put_ratios(&mut ratio, at, found));
                photons[at] = face.photons.cast_signed();
                histories[at] = face.histories.unwrap_or(0).cast_signed();
                if let (Some(least), Some(most)) = (&face.min, &face.max) {
                    ranges = true;
                    min.put(at, least);
                    max.put(at, most);
                }
                for (name, values) in face.uniformity.iter().flat_map(|even| even.columns()) {
                    let own = even.iter_mut().filter(|(own, _)| *own == name);
                    own.for_each(|(_, array)| array.put_known(at, values));
                }
            }
            if let Some((power, error)) = row.absorbed {
                absorbed.put(i, power);
                absorbed_se.put_known(i, error);
            }
            row.absorbed_model.iter().for_each(|values| absorbed_model.put(i, values));
            if let Some(AbsorbedByFace { front, front_se, back, back_se }) = row.by_face {
                has_faces = true;
                by_face.put(2 * i, front);
                by_face.put(2 * i + 1, back);
                by_face_se.put_known(2 * i, front_se);
                by_face_se.put_known(2 * i + 1, back_se);
            }
            if let Some(found) = row.sunlit {
                has_sunlit = true;
                sunlit.iter_mut().zip(found).for_each(|(array, value)| array.put(i, &[value]));
            }
            row.absorbed_ratios.iter().for_each(|found| put_ratios(&mut absorbed_ratio, i, found));
        }
        let arrays = Arrays::new(py);
        arrays.add("flux", flux)?;
        arrays.add("flux_se", flux_se)?;
        arrays.add("irradiance", irradiance)?;
        arrays.add("irradiance_se", irradiance_se)?;
        arrays.add("absorbed", absorbed)?;
        arrays.add("absorbed_se", absorbed_se)?;
        arrays.add("area", area)?;
        arrays.add_counts("photons", photons)?;
        arrays.add_counts("has_back", has_back)?;
        if !groups {
            arrays.add_counts("histories", histories)?;
        }
        if has_model {
            arrays.add("flux_model_se", flux_model)?;
            arrays.add("irradiance_model_se", irradiance_model)?;
            arrays.add("absorbed_model_se", absorbed_model)?;
        }
        for (name, [values, errors, model]) in
            [("ratios", ratio), ("absorbed_ratios", absorbed_ratio)]
                .into_iter()
                .filter(|_| ratios > 0)
        {
            arrays.add(name, values)?;
            arrays.add(&format!("{name}_se"), errors)?;
            if has_model {
                arrays.add(&format!("{name}_model_se"), model)?;
            }
        }
        if has_sunlit {
            let [share, error] = sunlit;
            arrays.add("sunlit", share)?;
            arrays.add("sunlit_se", error)?;
        }
        if has_faces {
            arrays.add("absorbed_by_face", by_face)?;
            arrays.add("absorbed_by_face_se", by_face_se)?;
        }
        if has_dli {
            arrays.add("dli", dli)?;
            arrays.add("dli_se", dli_se)?;
        }
        if ranges {
            arrays.add("irradiance_min", min)?;
            arrays.add("irradiance_max", max)?;
            even.into_iter().try_for_each(|(name, array)| arrays.add(name, array))?;
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
        let faces = || Numbers::new(2 * captors.len(), self.result.bands.len());
        let (mut irradiance, mut irradiance_se, mut radiance, mut radiance_se) =
            (faces(), faces(), faces(), faces());
        let mut k = vec![0; 2 * captors.len()];
        let mut radius = Numbers::new(2 * captors.len(), 1);
        let mut coverage = Numbers::new(2 * captors.len(), 1);
        for (i, captor) in captors.iter().enumerate() {
            for (f, face) in captor.faces().enumerate() {
                let Some(Some(nearest)) = &face.knn else { continue };
                let at = 2 * i + f;
                irradiance.put(at, &nearest.irradiance);
                irradiance_se.put_known(at, &nearest.irradiance_se);
                nearest.radiance.iter().for_each(|values| radiance.put(at, values));
                nearest.radiance_se.iter().for_each(|values| radiance_se.put_known(at, values));
                k[at] = nearest.k as i64;
                radius.put(at, &[nearest.radius]);
                coverage.put(at, &[nearest.coverage]);
            }
        }
        arrays.add("knn_irradiance", irradiance)?;
        arrays.add("knn_irradiance_se", irradiance_se)?;
        arrays.add("knn_radiance", radiance)?;
        arrays.add("knn_radiance_se", radiance_se)?;
        arrays.add("radius", radius)?;
        arrays.add("coverage", coverage)?;
        arrays.add_counts("k", k)?;
        Ok(arrays.0)
    }
}

impl Found {
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
