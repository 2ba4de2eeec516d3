//! `phylux year`: finds the light of each hour of a period or a year, from the sky, the sun and
//! lamps.

use std::{
    fmt::Write,
    fs,
    path::{Path, PathBuf},
};

use clap::{Args, ValueEnum};

use super::{
    interrupt::Interrupt,
    outputs::check_places,
    progress::{during, show, terminal_bar},
    run::{photons, threads},
    summary::short,
};
use crate::{
    error::{Error, Result},
    formats::{
        control_file::ControlFile,
        output::{FilesRead, Temporary, folder_of},
        scene_file::{LoadedScene, SkyDivision},
    },
    scene::captor::Channel,
    studies::{
        check::check_meshes,
        year::{
            HoursOf, Year, YearOptions, YearScenes, gigabytes,
            tables::{YearTables, write},
        },
    },
    transport::{
        direct_sun::SunRays,
        settings::{Guiding, Settings},
        simulate::{Control, Progress},
    },
};

/// The most months, and the most captors or groups, that are shown.
const MONTHS: usize = 12;
const SHOWN: usize = 12;

#[derive(Args)]
pub(super) struct Arguments {
    /// Scene file (JSON) with a weather file and a period or "year" as `time`
    scene: PathBuf,
    /// Folder for the tables (hours, days, months, year and lamps); made if it does not exist
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Control file (JSON): when lamps are on and when screens close. Without it all lamps are off
    #[arg(long, value_name = "FILE")]
    control: Option<PathBuf>,
    /// Patches that the sky is divided into: 577 of some 6 degrees, or 145 of 12
    #[arg(long, value_enum, default_value = "577")]
    patches: Patches,
    /// Photons to trace, e.g. 5e7, for all hours together [default: the scene's]
    #[arg(long, value_name = "N", value_parser = photons, allow_negative_numbers = true)]
    photons: Option<u64>,
    /// Seed of the random numbers: the same seed gives the same results, byte for byte [default:
    /// the scene's]
    #[arg(long, value_name = "N", value_parser = super::run::count, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// What guides photons to sensors that light hardly reaches [default: the scene's]
    #[arg(long, value_enum, value_name = "NAME")]
    guiding: Option<Guiding>,
    /// No longer an option: --guiding has taken its place
    #[arg(long, hide = true, value_name = "N", value_parser = super::run::splitting)]
    splitting: Option<u64>,
    /// Captors and groups whose hours are written: groups, all, none, or a pattern of ids, such as
    /// "tomato*" [default: all, or groups if there are more than 1000]
    #[arg(long, value_name = "WHICH", value_parser = hours)]
    hours: Option<HoursOf>,
    /// Points of each captor from which the sun is looked for in every hour [default: 16, or fewer
    /// for more than 5000 captors]
    #[arg(long, value_name = "N", value_parser = sun_rays, allow_negative_numbers = true)]
    sun_rays: Option<u64>,
    /// Write the table of hours as CSV, not as Parquet
    #[arg(long)]
    csv: bool,
    /// Threads; 0 takes all processors. The results do not depend on it
    #[arg(long, value_name = "N", value_parser = threads, allow_negative_numbers = true)]
    threads: Option<usize>,
}

fn hours(text: &str) -> std::result::Result<HoursOf, String> {
    Ok(match text {
        "" => return Err("is empty: say groups, all, none, or a pattern of ids".into()),
        "all" => HoursOf::All,
        "groups" => HoursOf::Groups,
        "none" => HoursOf::None,
        pattern => HoursOf::Like(pattern.into()),
    })
}

fn sun_rays(text: &str) -> std::result::Result<u64, String> {
    let (least, most) = SunRays::RANGE.into_inner();
    let number = super::run::count(text)?;
    match SunRays::RANGE.contains(&number) {
        true => Ok(number),
        false => Err(format!("must be {least} to {most}")),
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum Patches {
    /// 145 patches, in rows 12 degrees high (Tregenza)
    #[value(name = "145")]
    Tregenza,
    /// 577 patches, in rows 6 degrees high (Reinhart)
    #[value(name = "577")]
    Reinhart,
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let interrupt = Interrupt::install()?;
    let folder = &arguments.output;
    let made = make_folder(folder, &interrupt)?;
    let mut places = Vec::new();
    let tables = YearTables::create(folder, arguments.csv, |path| {
        let file = interrupt.file(path)?;
        places.extend(file.place().map(Path::to_path_buf));
        Ok(file)
    });
    // at an immediate end the files in the folder are removed first, and then the folder if it is
    // empty
    let gone = |_: &Result<YearTables>| Some(Temporary::IfEmpty(folder.clone()));
    let tables = interrupt.make(|| Ok(tables), gone)?;
    let done = tables.and_then(|tables| find(arguments, &interrupt, tables, &places));
    if made && done.is_err() {
        // this removes the folder only if it is empty
        let _ = fs::remove_dir(folder);
    }
    done
}

/// Makes the folder, unless it exists, and returns whether it was made.
fn make_folder(folder: &Path, interrupt: &Interrupt) -> Result<bool> {
    if folder.is_dir() {
        return Ok(false);
    }
    let wrong = |problem: String| Error::input(folder.display(), problem).remedy("write elsewhere");
    if folder.exists() {
        return Err(wrong("is a file, not a folder".into()));
    }
    if !folder_of(folder).is_dir() {
        return Err(wrong(format!("there is no folder {}", folder_of(folder).display())));
    }
    let make =
        || fs::create_dir(folder).map_err(|e| wrong(format!("cannot be created: {}", e.kind())));
    interrupt.make(make, |()| None).map(|()| true)
}

fn find(
    arguments: &Arguments,
    interrupt: &Interrupt,
    tables: YearTables,
    places: &[PathBuf],
) -> Result<()> {
    let control = arguments.control.as_deref().map(ControlFile::load).transpose()?;
    let division = match arguments.patches {
        Patches::Tregenza => SkyDivision::Tregenza,
        Patches::Reinhart => SkyDivision::Reinhart,
    };
    let of_control = control.as_ref().zip(arguments.control.as_deref());
    let scenes =
        during("reading the scene", || YearScenes::load(&arguments.scene, division, of_control))?;
    let loaded = &scenes.scenes[0].loaded;
    loaded.check_captors()?;
    let files: Vec<PathBuf> = loaded.files.iter().chain(&arguments.control).cloned().collect();
    let read = FilesRead::new(&files);
    check_places(places, &read)?;
    super::terminal::warn(&loaded.warnings);
    super::terminal::warn(&scenes.warnings);
    super::terminal::warn(&check_meshes(&loaded.scene)?);
    let settings = Settings {
        photons: arguments.photons.or(loaded.settings.photons),
        seed: arguments.seed.unwrap_or(loaded.settings.seed),
        guiding: arguments.guiding.unwrap_or(loaded.settings.guiding),
        threads: arguments.threads.unwrap_or(loaded.settings.threads),
        tolerance: None,
        max_time: None,
        ..loaded.settings.clone()
    };
    let bar = terminal_bar("{bar:30} {percent}% {human_pos} {msg}, {speed}, {eta} left");
    let phase = |phase: &str| {
        bar.set_message(phase.to_owned());
        bar.set_position(0);
        bar.reset();
    };
    let progress = |progress: Progress| show(&bar, progress);
    let watched = Control { stop: interrupt.stop(), progress: &progress };
    let path = arguments.control.as_deref().map(|path| path.display().to_string());
    let options = YearOptions {
        control: control.as_ref().zip(path.as_deref()),
        hours: arguments.hours.clone().unwrap_or_default(),
        sun_rays: arguments.sun_rays,
        scratch: arguments.output.clone(),
        phase: &phase,
    };
    let needs = Year::needs(&scenes, &options, &settings)?;
    if needs.disk > 0 && !super::terminal::is_quiet() {
        let [memory, disk] = [needs.memory, needs.disk].map(gigabytes);
        let text = "GB on the disk while it is calculated";
        super::terminal::complain(&format!(
            "takes about {memory} GB of memory and {disk} {text}\n"
        ));
    }
    let year = Year::find(&scenes, &options, &settings, &watched);
    let year = match year {
        Ok(year) => year,
        Err(error) => {
            bar.finish_and_clear();
            return Err(error);
        }
    };
    interrupt.writing();
    phase("hours in tables");
    let done = write(&year, tables, &read, &|photons, of| {
        show(&bar, Progress { photons, of: Some(of), worst: None });
    });
    bar.finish_and_clear();
    done?;
    super::terminal::warn(&year.warnings);
    let wrote = format!("\nwrote {}\n", arguments.output.display());
    super::terminal::print(&(describe(loaded, &year)? + &wrote))
}

fn describe(loaded: &LoadedScene, year: &Year) -> Result<String> {
    let hours = year.slots.len();
    let lights = loaded.scene.lights.len();
    let mut text = format!(
        "{}: {hours} hours from {} photons of {lights} lights, seed {}\n",
        loaded.scene.name, year.photons, year.seed
    );
    let months: Vec<&String> = year.months.keys().take(MONTHS).collect();
    let sums: Vec<_> = (0..months.len()).map(|m| year.month(m)).collect::<Result<_>>()?;
    let ids = &year.places.ids;
    // if there are groups, they are shown in place of captors, for they say more
    let first = if ids.len() > year.places.captors { year.places.captors } else { 0 };
    for (b, band) in year.bands.iter().enumerate().filter(|(b, _)| year.integrated[*b]) {
        let _ = write!(text, "\n{:<24}", format!("{}, {}", band.name, year.unit));
        months.iter().for_each(|name| {
            let _ = write!(text, "{name:>9}");
        });
        text.push('\n');
        for (i, id) in ids.iter().enumerate().skip(first).take(SHOWN) {
            let _ = write!(text, "  {id:<22}");
            for sums in &sums {
                let _ = write!(
                    text,
                    "{:>9}",
                    short(sums.light(i, Channel::Front, b).map_or(0.0, |light| light.mean))
                );
            }
            text.push('\n');
        }
        match ids.len().saturating_sub(first + SHOWN) {
            0 => {}
            more => {
                let _ = writeln!(text, "  and {more} more");
            }
        }
    }
    if !year.lamps.is_empty() {
        let all = || 0..year.slots.len();
        let hours: f64 = year.lamps.iter().map(|lamp| year.hours_on(lamp, all())).sum();
        let energy: Option<f64> = year.lamps.iter().map(|lamp| year.energy(lamp, all())).sum();
        let energy = energy.map_or(String::new(), |e| format!(", {} kWh", short(e)));
        let _ = writeln!(text, "\n{} lamps: {} h{energy}", year.lamps.len(), short(hours));
    }
    Ok(text)
}
