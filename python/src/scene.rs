//! Scenes: loads, describes, runs and shows them.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
    sync::Arc,
};

use glam::DVec3;
use numpy::{PyArray1, PyReadonlyArray2};
use phylux::{
    Control, Error, LoadedScene, Settings,
    cli::embedded::{self, Rendering, Words},
    formats::{FilesRead, InMemory, Mesh, MeshGroup, OutputFile},
    results::ResultsFile,
    show::{RenderPlan, RenderedScene},
};
use pyo3::prelude::*;

use crate::{errors::raised, result::Found, watched::watched};

/// A mesh: its name, its vertices (n, 3), the corners of its triangles (m, 3), and its groups. A
/// group has a name, a material, and the range of its triangles (start and end).
type MeshParts<'py> = (
    String,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, i64>,
    Vec<(Option<String>, Option<String>, usize, usize)>,
);

/// Width in pixels, number of bands, and a value for each row, pixel and band.
type PixelNumbers<'py> = (usize, usize, Bound<'py, PyArray1<f32>>);

/// A checked scene, with its geometry arranged for tracing rays.
#[pyclass(frozen, module = "phylux._native")]
pub struct Loaded {
    loaded: Arc<LoadedScene>,
    folder: PathBuf,
}

/// Loads a scene from the JSON of a scene file, with meshes and tables in memory. Paths in the
/// scene are relative to the folder of `path`.
#[pyfunction]
pub fn load(
    py: Python<'_>,
    json: String,
    path: PathBuf,
    meshes: Vec<MeshParts<'_>>,
    tables: HashMap<String, Vec<u8>>,
) -> PyResult<Loaded> {
    let mut memory = InMemory { tables, ..InMemory::default() };
    for (name, vertices, faces, groups) in &meshes {
        let mesh = mesh(vertices.as_slice()?, faces.as_slice()?, groups);
        memory.meshes.insert(name.clone(), raised(py, mesh.map_err(|e| e.at(name)))?);
    }
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    let loaded = watched(py, None, move |_| {
        let scene = serde_json::from_str(&json).map_err(|e| Error::input(path.display(), e))?;
        phylux::formats::load_from(scene, &path, &memory)
    })?;
    Ok(Loaded { loaded: Arc::new(loaded), folder })
}

fn mesh(
    vertices: &[f64],
    faces: &[i64],
    groups: &[(Option<String>, Option<String>, usize, usize)],
) -> phylux::Result<Mesh> {
    let (vertices, faces) = (vertices.as_chunks::<3>().0, faces.as_chunks::<3>().0);
    let corner = |face: usize, corner: i64| {
        let vertex = usize::try_from(corner).ok().and_then(|i| vertices.get(i));
        vertex.map(|v| DVec3::from_array(*v)).ok_or_else(|| {
            let problem =
                format!("corner {corner} of face {face}: there are {} vertices", vertices.len());
            Error::input("mesh", problem).remedy("vertices are counted from 0")
        })
    };
    let triangle = |f: usize| {
        let [a, b, c] = faces[f];
        Ok([corner(f, a)?, corner(f, b)?, corner(f, c)?])
    };
    let group = |(name, material, from, to): &(Option<String>, Option<String>, usize, usize)| {
        let triangles = (*from..(*to).min(faces.len())).map(triangle);
        let triangles = triangles.collect::<phylux::Result<_>>()?;
        Ok(MeshGroup { name: name.clone(), material: material.clone(), triangles })
    };
    Mesh::new(groups.iter().map(group).collect::<phylux::Result<_>>()?)
}

/// Writes a mesh as an OBJ file from which the same mesh is read.
#[pyfunction]
pub fn write_obj(py: Python<'_>, path: PathBuf, mesh: MeshParts<'_>) -> PyResult<()> {
    let (_, vertices, faces, groups) = &mesh;
    let (vertices, faces) = (vertices.as_slice()?, faces.as_slice()?);
    let written = OutputFile::create(&path).and_then(|file| {
        file.write(&FilesRead::default(), |writer| {
            // the shortest digits from which the same number is read
            for [x, y, z] in vertices.as_chunks::<3>().0 {
                writeln!(writer, "v {x} {y} {z}")?;
            }
            for (name, material, from, to) in groups {
                name.iter().try_for_each(|name| writeln!(writer, "g {name}"))?;
                material.iter().try_for_each(|material| writeln!(writer, "usemtl {material}"))?;
                for [a, b, c] in &faces.as_chunks::<3>().0[*from..*to] {
                    writeln!(writer, "f {} {} {}", a + 1, b + 1, c + 1)?;
                }
            }
            Ok(())
        })
    });
    raised(py, written)
}

#[pymethods]
impl Loaded {
    /// The warnings from loading the scene.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.loaded.warnings.clone()
    }

    /// Returns the text of `phylux check`, and its warnings.
    fn check(&self, py: Python<'_>) -> PyResult<(String, Vec<String>)> {
        let loaded = self.loaded.clone();
        let Words { text, warnings } = watched(py, None, move |_| embedded::describe(&loaded))?;
        Ok((text, warnings))
    }

    /// Runs the scene with options of the command line.
    #[pyo3(signature = (options, progress=None))]
    fn run(
        &self,
        py: Python<'_>,
        options: Vec<String>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Found> {
        let loaded = self.loaded.clone();
        let result = watched(py, progress, move |watch| {
            let control = Control { stop: &watch.stop, progress: &|p| watch.note(p) };
            embedded::found(&loaded, &options, &control)
        })?;
        Ok(Found::new(result, self.loaded.files.clone()))
    }

    /// Renders a picture with options of the command line. Returns its width, its pixels (height x
    /// width x 3, 8 bits), and, where it shows light on surfaces, the numbers behind them.
    fn render<'py>(
        &self,
        py: Python<'py>,
        options: Vec<String>,
    ) -> PyResult<(usize, Bound<'py, PyArray1<u8>>, Option<PixelNumbers<'py>>)> {
        let loaded = self.loaded.clone();
        let rendering =
            watched(py, None, move |watch| embedded::picture(&loaded, &options, &watch.stop))?;
        let Rendering { picture, pixels } = rendering;
        let numbers = pixels.map(|p| (p.width, p.bands, PyArray1::from_vec(py, p.values)));
        Ok((picture.width, PyArray1::from_slice(py, picture.rgb()), numbers))
    }

    /// Writes the page for a browser, with the light of a result or of a run of its own.
    #[pyo3(signature = (path, results, trace, threads))]
    fn view(
        &self,
        py: Python<'_>,
        path: PathBuf,
        results: Option<&Found>,
        trace: bool,
        threads: Option<usize>,
    ) -> PyResult<()> {
        let loaded = self.loaded.clone();
        let results = results.map(Found::json_bytes).transpose()?;
        watched(py, None, move |watch| {
            phylux::show::check_view(&loaded.scene)?;
            let file = OutputFile::create(&path)?;
            let plan = match results {
                Some(json) => {
                    let results = Box::new(ResultsFile::parse(&json)?);
                    RenderPlan::Results { results, trace }
                }
                None => RenderPlan::Run,
            };
            let own = &loaded.settings;
            let settings = Settings { threads: threads.unwrap_or(own.threads), ..own.clone() };
            let control = Control { stop: &watch.stop, progress: &|_| {} };
            let rendered =
                RenderedScene::new(&loaded.scene, &settings, plan, &control, &|_, _| {})?;
            file.write(&FilesRead::new(&loaded.files), |writer| {
                phylux::show::write_view(&rendered, None, writer)
            })
        })
    }

    fn __repr__(&self) -> String {
        let scene = &self.loaded.scene;
        format!("<scene `{}` in {}>", scene.name, self.folder.display())
    }
}
