//! Exports a scene with its light to files for other programs.

use std::{
    io::{self, Write},
    path::Path,
};

use crate::{
    glb::{Shown, write_glb},
    picture::Scale,
    ply::write_ply,
    rendered::{MOST_TILES, RenderedScene},
    vtk::{VtkKind, write_vtk},
};
use phylux_core::{
    error::{Error, Result, nearest, setting},
    scene::{
        tiles::Tiles,
        world::{MAX_TRIANGLES, Scene},
    },
    words,
};

/// The most parts of copies that a file names one by one: other programs take long to open more.
const MOST_NODES: usize = 200_000;

/// The formats of exported files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportFormat {
    /// Surfaces and captors with all values, for ParaView.
    Vtk(VtkKind),
    /// Surfaces and captors coloured by one value, for Blender and browsers.
    Glb,
    /// Stored photons.
    Ply,
}

impl ExportFormat {
    /// Returns the format for the ending of a path. Error: no format has this ending.
    pub fn of(path: &Path) -> Result<Self> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("vtp") => Ok(Self::Vtk(VtkKind::PolyData)),
            Some("vtu") => Ok(Self::Vtk(VtkKind::UnstructuredGrid)),
            Some("glb") => Ok(Self::Glb),
            Some("ply") => Ok(Self::Ply),
            _ => Err(Error::input(path.display(), "its ending names no format to write")
                .remedy("end it in .vtp, .vtu, .glb or .ply")),
        }
    }
}

/// The quantity that colours show, as the user asks for it.
#[derive(Clone, Debug, Default)]
pub struct Colours {
    /// Whether colours show absorbed power per area; otherwise irradiance.
    pub absorbed: Option<bool>,
    /// Name of a band or sum; `None` stands for the first sum, or the first band.
    pub band: Option<String>,
    /// Values at the ends of the colour map.
    pub range: Option<(f64, f64)>,
    /// Whether the colour scale is logarithmic.
    pub log: bool,
}

impl Colours {
    /// Checks the request. Errors: the format has no colours; the range is not valid.
    pub fn check(&self, format: ExportFormat) -> Result<()> {
        let asked =
            self.absorbed.is_some() || self.band.is_some() || self.range.is_some() || self.log;
        if asked && format != ExportFormat::Glb {
            let [quantity, band, range, log] = ["quantity", "band", "range", "log"].map(setting);
            let problem = words![
                quantity,
                ", ",
                band,
                ", ",
                range,
                " and ",
                log,
                " are for the colours of a .glb",
            ];
            return Err(Error::input("export", problem)
                .remedy("leave them out: other files hold every value"));
        }
        self.range.map_or(Ok(()), |(low, high)| Scale::new(low, high, self.log).map(drop))
    }

    /// Looks up the band in a scene. Error: the scene has no such band.
    pub fn shown(&self, scene: &Scene) -> Result<Shown> {
        let band = match &self.band {
            Some(name) => scene.band_names().position(|band| band == name).ok_or_else(|| {
                let error =
                    Error::input(setting("band"), format!("the scene has no band `{name}`"));
                match nearest(name, scene.band_names()) {
                    Some(near) => error.remedy(format!("did you mean `{near}`?")),
                    None => error.remedy("name one of /bands or /sums"),
                }
            })?,
            None if scene.sums().is_empty() => 0,
            None => scene.bands().len(),
        };
        let absorbed = self.absorbed.unwrap_or(false);
        Ok(Shown { band, absorbed, range: self.range, log: self.log })
    }
}

/// Checks that a scene can be written in a format, and returns the most tiles of such a file. Errors:
/// it has no such band; it has too many triangles or copies; it has no surface for photons to arrive
/// on.
pub fn check_export(scene: &Scene, format: ExportFormat, colours: &Colours) -> Result<usize> {
    colours.shown(scene)?;
    let triangles = scene.triangles().len();
    let (most, counts) = match format {
        // every copy has triangles of its own
        ExportFormat::Vtk(_) => (usize::MAX, vec![(triangles, MAX_TRIANGLES, "triangles")]),
        // copies share their triangles, and each of their parts is a node
        ExportFormat::Glb if triangles > MOST_TILES => {
            let own = scene.unshared() + scene.captor_tiles();
            let nodes = Tiles::least(scene) - own;
            (
                MOST_TILES,
                vec![(own, MAX_TRIANGLES, "triangles"), (nodes, MOST_NODES, "parts of copies")],
            )
        }
        ExportFormat::Glb | ExportFormat::Ply => (MOST_TILES, Vec::new()),
    };
    for (count, most, what) in counts {
        if count > most {
            let problem = format!("it has {count} {what}, more than {most}");
            let remedy = match format {
                ExportFormat::Vtk(_) if scene.unshared() < triangles => {
                    "export a .glb, in which copies share their triangles, or its captors' values as CSV"
                }
                _ => "export its captors' values as CSV, or a scene with fewer copies",
            };
            return Err(Error::input("scene", problem).remedy(remedy));
        }
    }
    if format == ExportFormat::Ply && scene.triangles().is_empty() {
        return Err(Error::input("scene", "it has no surface for photons to arrive on")
            .remedy("export its captors (.vtp)"));
    }
    Ok(most)
}

/// Writes a rendered scene in a format. Errors: writing fails; the scene has no photons or no such
/// band.
pub fn write_export(
    rendered: &RenderedScene,
    format: ExportFormat,
    colours: &Colours,
    writer: &mut dyn Write,
) -> io::Result<()> {
    match (format, &rendered.light) {
        (ExportFormat::Vtk(kind), _) => write_vtk(rendered, kind, writer),
        (ExportFormat::Glb, _) => {
            let shown = colours.shown(rendered.scene).map_err(io::Error::other)?;
            write_glb(rendered, &shown, writer)
        }
        (ExportFormat::Ply, Some(light)) => write_ply(light, writer),
        (ExportFormat::Ply, None) => Err(io::Error::other("no photons were traced")),
    }
}
