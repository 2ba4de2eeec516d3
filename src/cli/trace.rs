//! `phylux trace`: says on which ways light reaches a captor or a group of captors.

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
    sync::atomic::Ordering,
};

use clap::{Args, ValueEnum};

use super::{
    interrupt,
    outputs::{check_places, place_of},
    progress::{show, terminal_bar},
    terminal::{self, spelled},
    tracing::TracingArguments,
};
use phylux_core::{
    error::{Error, NOTHING_WRITTEN, Result},
    math::units::printed,
    scene::captor::Channel,
    transport::{
        settings::Checked,
        simulate::{Control, Progress},
    },
};
use phylux_files::{
    histories_csv::write_histories_csv,
    output::{FilesRead, OutputFile},
    result_file::write_lines,
    scene_file,
};
use phylux_results::histories::{HistoriesPart, HistoriesResult};
use phylux_show::{glb::write_glb_lines, vtk::write_vtk_lines};
use phylux_studies::{
    desk::STANDARD_OUTPUT,
    histories::{HistoriesJob, warnings},
    text::{table::Table, with_error},
};

/// The most rows of a table, unless all are asked for.
const ROWS: usize = 20;

#[derive(Args)]
pub(super) struct Arguments {
    /// Scene file (JSON)
    scene: PathBuf,
    /// Captor, or group of captors, whose light is followed
    #[arg(long, value_name = "NAME")]
    to: String,
    /// The face at which light counts
    #[arg(long, value_enum, default_value = "both")]
    face: Face,
    /// Band, or sum over bands, that the tables show and by which lines are drawn; files have the
    /// shares in all bands [default: the first sum, or the first band]
    #[arg(long, value_name = "NAME")]
    band: Option<String>,
    /// The most histories that are kept as lines, each with a chance in proportion to what it brings
    #[arg(long, value_name = "N", default_value = "500", value_parser = lines)]
    lines: usize,
    #[command(flatten)]
    tracing: TracingArguments,
    /// File to write; can be given several times. Its ending chooses the form: .csv (a table of
    /// shares), .json (shares and lines), .vtp (lines, for ParaView), .glb (lines, for Blender); `-` is
    /// the standard output, for JSON
    #[arg(short, long, value_name = "FILE")]
    output: Vec<PathBuf>,
}

impl Arguments {
    fn job(&self) -> HistoriesJob {
        let TracingArguments { photons, seed, threads } = self.tracing;
        let face = match self.face {
            Face::Front => Some(Channel::Front),
            Face::Back => Some(Channel::Back),
            Face::Both => None,
        };
        let (to, band, lines) = (self.to.clone(), self.band.clone(), self.lines);
        HistoriesJob { to, face, band, lines, photons, seed, threads }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum Face {
    /// The side that normals point out of
    Front,
    /// The other side
    Back,
    /// All that count light
    Both,
}

fn lines(text: &str) -> Checked<usize> {
    HistoriesJob::lines(super::run::count(text)?)
}

/// The forms of a file.
#[derive(Clone, Copy)]
enum Form {
    Csv,
    Json,
    Vtk,
    Glb,
}

impl Form {
    fn of(path: &Path) -> Result<Self> {
        if path == Path::new(STANDARD_OUTPUT) {
            return Ok(Self::Json);
        }
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("csv") => Ok(Self::Csv),
            Some("json") => Ok(Self::Json),
            Some("vtp") => Ok(Self::Vtk),
            Some("glb") => Ok(Self::Glb),
            _ => Err(Error::input(path.display(), "its ending names no form to write")
                .remedy("end it in .csv, .json, .vtp or .glb")),
        }
    }

    fn write(self, result: &HistoriesResult, writer: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::Csv => write_histories_csv(result, writer),
            Self::Json => write_lines(result, writer),
            Self::Vtk => write_vtk_lines(result, writer),
            Self::Glb => write_glb_lines(result, writer),
        }
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let desk = interrupt::desk()?;
    let forms: Vec<Form> =
        arguments.output.iter().map(|path| Form::of(path)).collect::<Result<_>>()?;
    let files: Vec<OutputFile> =
        arguments.output.iter().map(|path| desk.file(path)).collect::<Result<_>>()?;
    let places: Vec<PathBuf> =
        files.iter().filter_map(OutputFile::place).map(Path::to_path_buf).collect();
    check_places(&places, &FilesRead::default())?;
    let loaded = desk.during("reading the scene", |_| scene_file::load(&arguments.scene))?;
    let read = FilesRead::new(&loaded.files);
    check_places(&places, &read)?;
    terminal::warn(&loaded.warnings);

    let bar = terminal_bar("{bar:30} {percent}% {human_pos} photons{left}");
    let progress = |progress: Progress| show(&bar, progress);
    let control = Control { stop: desk.stop(), progress: &progress };
    let result = arguments.job().found(&loaded, &control);
    bar.finish_and_clear();
    let result = result?;
    if desk.stop().load(Ordering::Relaxed) {
        return Err(Error::interrupted("trace", NOTHING_WRITTEN));
    }
    desk.writing();
    terminal::warn(&spelled(&warnings(&result)));
    let mut text = tables(&result);
    // all are completed before the first has its place
    let complete = desk.during("writing", |_| {
        let files = files.into_iter().zip(&forms);
        let complete =
            files.map(|(file, form)| file.complete(&read, |writer| form.write(&result, writer)));
        complete.collect::<Result<Vec<_>>>()
    })?;
    for (file, path) in complete.into_iter().zip(&arguments.output) {
        file.put()?;
        text += &format!("wrote {}\n", place_of(path));
    }
    terminal::print(&text)
}

/// Returns the tables: by light, by last surface, and by both where there are several of both.
fn tables(result: &HistoriesResult) -> String {
    let HistoriesResult { to, face, photons, whole, by_light, by_surface, groups, .. } = result;
    let column = result.column;
    let band = &result.bands[column];
    let flux = with_error(whole.flux[column], whole.flux_se[column].unwrap_or(0.0));
    let unit = printed(&band.unit);
    let on = match *face {
        "both" => String::new(),
        face => format!(", {face}"),
    };
    let mut text = format!(
        "{to}{on}: {flux} {unit} in {}, {} histories of {photons} photons\n",
        band.name, whole.histories
    );
    let mut add =
        |title: &str, parts: &[HistoriesPart], name: &dyn Fn(&HistoriesPart) -> String| {
            let share = "share, %".to_string();
            let mut table = Table::new(title, [share, unit.clone(), "histories".into()], "");
            for part in parts.iter().take(terminal::shown(ROWS)) {
                let error = |errors: &[Option<f64>]| errors[column].unwrap_or(0.0);
                let share = part.share[column].map_or("-".into(), |share| {
                    with_error(100.0 * share, 100.0 * error(&part.share_se))
                });
                let flux = with_error(part.flux[column], error(&part.flux_se));
                table.row(name(part), [share, flux, part.histories.to_string()], "");
            }
            table.below(&mut text, &terminal::page());
            text += &terminal::more(parts.len(), ROWS);
        };
    let light = |part: &HistoriesPart| format!("  {}", part.light.as_deref().unwrap_or_default());
    let surface = |part: &HistoriesPart| format!("  {}", surface_name(part));
    let both = |part: &HistoriesPart| format!("{}, {}", light(part), surface_name(part));
    if by_light.len() != 1 {
        add("light", by_light, &light);
    }
    add("last surface", by_surface, &surface);
    if by_light.len() > 1 && by_surface.len() > 1 {
        add("light, last surface", groups, &both);
    }
    text.push('\n');
    text
}

/// Returns the name of a last surface with its material, where this is not the same.
fn surface_name(part: &HistoriesPart) -> String {
    let surface = part.last_surface.as_deref().unwrap_or_default();
    match &part.material {
        Some(material) if material != surface => format!("{surface} ({material})"),
        _ => surface.into(),
    }
}
