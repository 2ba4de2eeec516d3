//! Scenes: loads, describes, runs and shows them.

use std::{
    collections::HashMap,
    io::{self, Write},
    path::{Path, PathBuf},
    sync::Arc,
};

use glam::DVec3;
use numpy::{PyArray1, PyReadonlyArray2};
use phylux::{
    Control, Error, LoadedScene, Scene, Settings,
    formats::{FilesRead, InMemory, Mesh, MeshGroup, OutputFile, Run, SceneSource, Sweep},
    show::{Colours, ExportFormat, Following, RenderPlan, RenderedScene},
    studies::{Desk, Made, histories::following},
    transport::ThreadCount,
};
use pyo3::{exceptions::PyIndexError, prelude::*};

use crate::{
    errors::raised,
    result::{Found, page},
    runs,
    studies::studied,
    watched::watched,
};

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
    pub source: Arc<SceneSource>,
    pub loaded: Arc<LoadedScene>,
    folder: PathBuf,
}

/// Loads a scene from the JSON of a scene file, with meshes and tables in memory. Paths in the
/// scene are relative to the folder of `path`, from which the JSON was read if `is_read`.
#[pyfunction]
pub fn load(
    py: Python<'_>,
    json: String,
    path: PathBuf,
    meshes: Vec<MeshParts<'_>>,
    tables: HashMap<String, Vec<u8>>,
    is_read: bool,
) -> PyResult<Loaded> {
    let mut memory = InMemory { tables, ..InMemory::default() };
    for (name, vertices, faces, groups) in &meshes {
        let mesh = mesh(vertices.as_slice()?, faces.as_slice()?, groups);
        memory.meshes.insert(name.clone(), raised(py, mesh.map_err(|e| e.at(name)))?);
    }
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    let (source, loaded) = watched(py, None, move |_| {
        let scene = serde_json::from_str(&json).map_err(|e| Error::input(path.display(), e))?;
        let source = SceneSource::in_memory(scene, path, memory);
        let mut loaded = source.load()?;
        if is_read {
            loaded.files.insert(0, source.path().to_path_buf());
        }
        Ok((source, loaded))
    })?;
    Ok(Loaded { source: Arc::new(source), loaded: Arc::new(loaded), folder })
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

/// Writes a file completely or not at all. It replaces none of the files in `read`.
#[pyfunction]
pub fn write_file(
    py: Python<'_>,
    path: PathBuf,
    content: &[u8],
    read: Vec<PathBuf>,
) -> PyResult<()> {
    let written = py.detach(|| {
        OutputFile::create(&path)?.write(&FilesRead::new(&read), |writer| writer.write_all(content))
    });
    raised(py, written)
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

    /// The files that the scene was read from, its own first.
    #[getter]
    fn files(&self) -> Vec<PathBuf> {
        self.loaded.files.clone()
    }

    /// Returns the text of `phylux check` for lines of this width, its warnings, and all of it as
    /// JSON.
    fn check(&self, py: Python<'_>, width: usize) -> PyResult<(String, Vec<String>, String)> {
        let loaded = self.loaded.clone();
        watched(py, None, move |_| {
            let summary = phylux::studies::check(&loaded)?;
            let json = phylux::studies::as_json(&loaded, &summary)?;
            let text = phylux::studies::describe(&page(width), &loaded, &summary);
            Ok((text, summary.warnings, json))
        })
    }

    /// Runs the scene with these arguments (JSON). Returns what was found, and the warnings of the
    /// run itself.
    #[pyo3(signature = (arguments, progress=None))]
    fn run(
        &self,
        py: Python<'_>,
        arguments: String,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<(Found, Vec<String>)> {
        let loaded = self.loaded.clone();
        let (result, warnings) =
            studied(py, progress, move |desk| runs::run(&arguments)?.found(&loaded, desk))?;
        Ok((Found::new(result, self.loaded.files.clone()), warnings))
    }

    /// Makes a picture with these arguments (JSON). Returns its width, its pixels (height x width x
    /// 3, 8 bits), and, where it shows light on surfaces, the numbers behind them.
    fn render<'py>(
        &self,
        py: Python<'py>,
        arguments: String,
    ) -> PyResult<(usize, Bound<'py, PyArray1<u8>>, Option<PixelNumbers<'py>>)> {
        let loaded = self.loaded.clone();
        let work = move |desk: &Desk| runs::picture(&loaded, &arguments, desk);
        let (Made { picture, pixels, .. }, _) = studied(py, None, work)?;
        let numbers = pixels.map(|p| (p.width, p.bands, PyArray1::from_vec(py, p.values)));
        Ok((picture.width, PyArray1::from_slice(py, picture.rgb()), numbers))
    }

    /// Returns how light reaches a captor, found with these arguments (JSON), as the JSON that
    /// `phylux trace` writes, and the warnings that it prints.
    #[pyo3(signature = (arguments, progress=None))]
    fn histories(
        &self,
        py: Python<'_>,
        arguments: String,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<(String, Vec<String>)> {
        let loaded = self.loaded.clone();
        let work = move |desk: &Desk| runs::histories(&loaded, &arguments, desk);
        Ok(studied(py, progress, work)?.0)
    }

    /// Writes the page for a browser, with the light of a result or of a run of its own, and with the
    /// ways on which it reaches the captor or the group `to`.
    #[pyo3(signature = (path, results, trace, threads, to))]
    fn view(
        &self,
        py: Python<'_>,
        path: PathBuf,
        results: Option<&Found>,
        trace: bool,
        threads: Option<usize>,
        to: Option<String>,
    ) -> PyResult<()> {
        let plan = plan(results, trace);
        let check = move |scene: &Scene| {
            let following = match trace {
                true => following(scene, to.as_deref())?,
                false => Following::default(),
            };
            Ok((phylux::show::check_view(scene)?, following))
        };
        self.shown(py, path, plan, threads, check, |rendered, writer| {
            phylux::show::write_view(rendered, None, writer)
        })
    }

    /// Writes the scene and its light for another program, in the format that the ending of the
    /// path names. The light is that of a result or of a run of its own; a `.ply` has photons.
    #[pyo3(signature = (path, results, trace, threads, absorbed, band, range, log))]
    #[expect(clippy::too_many_arguments, reason = "they are the options of the command")]
    fn export(
        &self,
        py: Python<'_>,
        path: PathBuf,
        results: Option<&Found>,
        trace: bool,
        threads: Option<usize>,
        absorbed: Option<bool>,
        band: Option<String>,
        range: Option<(f64, f64)>,
        log: bool,
    ) -> PyResult<()> {
        let format = raised(py, ExportFormat::of(&path))?;
        let colours = Colours { absorbed, band, range, log };
        raised(py, colours.check(format))?;
        let plan = match format {
            ExportFormat::Ply => RenderPlan::Photons,
            _ => plan(results, trace),
        };
        let of_check = colours.clone();
        let check = move |scene: &Scene| {
            let most = phylux::show::check_export(scene, format, &of_check)?;
            Ok((most, Following::default()))
        };
        self.shown(py, path, plan, threads, check, move |rendered, writer| {
            phylux::show::write_export(rendered, format, &colours, writer)
        })
    }

    fn __repr__(&self) -> String {
        let scene = &self.loaded.scene;
        format!("<scene `{}` in {}>", scene.name(), self.folder.display())
    }
}

impl Loaded {
    /// Finds the light of the scene as planned, and writes it to a file; `check` also returns the
    /// most tiles of the file, and the captors whose light is followed.
    fn shown(
        &self,
        py: Python<'_>,
        path: PathBuf,
        plan: RenderPlan,
        threads: Option<usize>,
        check: impl Fn(&Scene) -> phylux::Result<(usize, Following)> + Send + 'static,
        write: impl Fn(&RenderedScene, &mut dyn Write) -> io::Result<()> + Send + Sync + 'static,
    ) -> PyResult<()> {
        let loaded = self.loaded.clone();
        watched(py, None, move |watch| {
            let (most, following) = check(&loaded.scene)?;
            let file = OutputFile::create(&path)?;
            let own = &loaded.settings;
            let mut settings = Settings {
                threads: threads.map_or(Ok(own.threads), ThreadCount::new)?,
                ..own.clone()
            };
            if matches!(plan, RenderPlan::Photons) {
                // the number in the scene is meant for its captors, not for photons to show
                settings.photons = None;
            }
            let control = Control { stop: &watch.stop, progress: &|_| {} };
            let mut rendered =
                RenderedScene::new(&loaded.scene, most, &settings, plan, &control, &|_, _| {})?;
            rendered.followed = following.follow(&loaded.scene, &settings, &control)?;
            file.write(&FilesRead::new(&loaded.files), |writer| write(&rendered, writer))
        })
    }
}

/// Returns where the light of a picture comes from: from a result, or from a run of its own.
fn plan(results: Option<&Found>, trace: bool) -> RenderPlan {
    results.map_or(RenderPlan::Run, |found| RenderPlan::Results {
        results: Box::new(found.result.clone()),
        trace,
    })
}

/// The runs of a sweep. The scene of each is made when it is asked for.
#[pyclass(frozen, module = "phylux._native")]
pub struct Planned(Sweep);

#[pymethods]
impl Planned {
    /// Plans a sweep: `sweep` is the content of a sweep file, and `scene` that of its scene.
    #[new]
    fn new(py: Python<'_>, sweep: &str, scene: &str) -> PyResult<Self> {
        let read = |text: &str| {
            serde_json::from_str(text)
                .map_err(|e| Error::input("sweep", format!("is no JSON: {e}")))
        };
        let planned = || Sweep::new("sweep", read(sweep)?, read(scene)?, PathBuf::new());
        Ok(Self(raised(py, py.detach(planned))?))
    }

    fn __len__(&self) -> usize {
        self.0.runs().len()
    }

    /// Returns the values of the parameters of a run, counted from 0, as JSON.
    fn values(&self, run: usize) -> PyResult<String> {
        let values = self.run(run)?.values.into_iter();
        let values: serde_json::Map<_, _> =
            values.map(|(parameter, value)| (parameter.name.clone(), value.clone())).collect();
        Ok(serde_json::Value::from(values).to_string())
    }

    /// Returns the scene of a run, counted from 0, as JSON.
    fn scene(&self, run: usize) -> PyResult<String> {
        Ok(self.0.document(&self.run(run)?).to_string())
    }
}

impl Planned {
    fn run(&self, run: usize) -> PyResult<Run<'_>> {
        match run < self.__len__() {
            true => Ok(self.0.run(run)),
            false => Err(PyIndexError::new_err(format!("run {run} of {}", self.__len__()))),
        }
    }
}
