//! `phylux year`: finds the light of each hour of a period or a year, from the sky, the sun and
//! lamps.

mod asked;

use std::{
    fmt::Write,
    fs,
    path::{Path, PathBuf},
};

use clap::{Args, ValueEnum};
use indicatif::ProgressBar;

use super::{
    interrupt::{Interrupt, check_folder},
    outputs::{check_places, place_of},
    progress::{during, show, terminal_bar},
    run::{LONG_RUNS, photons, threads},
    style::Plots,
    summary::{short, with_error},
    table::Table,
    terminal,
};
use asked::{Asked, Ready};
use phylux_core::{
    error::{Error, ErrorKind, Result},
    scene::captor::Channel,
    transport::{
        direct_sun::SunRays,
        settings::{Guiding, PhotonCount, ThreadCount},
        shard::Shard,
        simulate::{Control, Progress},
    },
};
use phylux_files::{
    output::{FilesRead, Temporary, folder_of},
    scene_file::{LoadedScene, SkyDivision},
    work_file::TableSettings,
    year_work::YearWork,
};
use phylux_show::plot::PlotStyle;
use phylux_studies::year::{
    HoursOf, Kept, KeptLight, Needs, USUAL_LIGHT, Year, YearOptions, YearShards, gigabytes,
    months_of,
    tables::{YearTables, write},
    trace_shard as trace_shard_of,
};

/// The most months, and the most captors or groups, that are shown.
const MONTHS: usize = 12;
const SHOWN: usize = 12;

#[derive(Args)]
pub(super) struct Arguments {
    /// Scene file (JSON) with a weather file and a period or "year" as `time`
    scene: PathBuf,
    /// Folder for the tables (hours, days, months, year and lamps), made if it does not exist; or
    /// file of a shard
    #[arg(short, long, value_name = "DIR|FILE")]
    output: PathBuf,
    /// Control file (JSON): when lamps are on and when screens close. Without it all lamps are off
    #[arg(long, value_name = "FILE")]
    control: Option<PathBuf>,
    /// Take the light from this folder, which an earlier `phylux year` of the same scene has written,
    /// and trace none: another control of the lamps then takes seconds. The folder stays as it is
    #[arg(long, value_name = "DIR", conflicts_with_all = [
        "patches", "photons", "seed", "guiding", "splitting", "sun_rays", "shard", "checkpoint"])]
    from: Option<PathBuf>,
    /// Keep the light in DIR for --from, however large it is; up to 256 MB of it are always kept
    #[arg(long)]
    keep_light: bool,
    /// Patches that the sky is divided into: 577 of some 6 degrees, or 145 of 12
    #[arg(long, value_enum, default_value = "577")]
    patches: Patches,
    /// Photons to trace, e.g. 5e7, for all hours together [default: the scene's]
    #[arg(long, value_name = "N", value_parser = photons, allow_hyphen_values = true)]
    photons: Option<PhotonCount>,
    /// Seed of the random numbers: the same seed gives the same results, byte for byte [default:
    /// the scene's]
    #[arg(long, value_name = "N", value_parser = super::run::count, allow_hyphen_values = true)]
    seed: Option<u64>,
    /// What guides photons to sensors that light hardly reaches [default: the scene's]
    #[arg(long, value_name = "NAME", value_parser = super::choices::guiding())]
    guiding: Option<Guiding>,
    /// No longer an option: --guiding has taken its place
    #[arg(long, hide = true, value_name = "N", value_parser = super::run::splitting)]
    splitting: Option<u64>,
    /// Captors and groups whose hours are written: groups, all, none, or a pattern of ids, such as
    /// "tomato*" [default: all, or groups if there are more than 1000]
    #[arg(long, value_name = "WHICH", value_parser = HoursOf::parse)]
    hours: Option<HoursOf>,
    /// Points of each captor from which the sun is looked for in every hour [default: 16, or fewer
    /// for more than 5000 captors]
    #[arg(long, value_name = "N", value_parser = sun_rays, allow_hyphen_values = true)]
    sun_rays: Option<u64>,
    /// Write the tables of hours, days, months and the whole period as CSV, not as Parquet
    #[arg(long)]
    csv: bool,
    /// Also write the mean light of each month, and of the whole period, as results for `plot`,
    /// `view` and `compare`
    #[arg(long)]
    results: bool,
    #[command(flatten)]
    plots: Plots,
    /// Do the I-th of N shards of the work; `phylux merge` joins their files to the tables
    #[arg(long, help_heading = LONG_RUNS, value_name = "I/N", value_parser = Shard::parse)]
    shard: Option<Shard>,
    /// Keep what is done in this file, and go on from there if the file exists: the same command,
    /// after a kill or the end of a job's time, finds the same tables. The file is removed once
    /// these are written
    #[arg(long, help_heading = LONG_RUNS, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Threads; 0 takes all processors. The results do not depend on it
    #[arg(long, value_name = "N", value_parser = threads, allow_hyphen_values = true)]
    threads: Option<ThreadCount>,
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

impl Arguments {
    fn asked(&self) -> Asked {
        let hours = self.hours.clone().unwrap_or_default();
        Asked {
            scene: self.scene.clone(),
            control: self.control.clone(),
            division: match self.patches {
                Patches::Tregenza => SkyDivision::Tregenza,
                Patches::Reinhart => SkyDivision::Reinhart,
            },
            photons: self.photons,
            seed: self.seed,
            guiding: self.guiding,
            sun_rays: self.sun_rays,
            tables: TableSettings { hours: hours.text(), csv: self.csv, results: self.results },
            plots: self.plots.style(),
            hours,
            threads: self.threads,
        }
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let interrupt = Interrupt::install()?;
    if arguments.shard.is_some() {
        arguments.plots.refuse("shards", "give it when they are merged")?;
    }
    let asked = arguments.asked();
    let checkpoint = arguments.checkpoint.as_deref();
    let most = if arguments.keep_light { u64::MAX } else { USUAL_LIGHT };
    match (arguments.shard, &arguments.from) {
        (Some(shard), _) => trace_shard(&asked, &arguments.output, shard, checkpoint, &interrupt),
        (None, Some(from)) => find_from(asked, from, &arguments.output, &interrupt),
        (None, None) => in_folder(&asked, &arguments.output, &interrupt, |tables, places| {
            let mut ready = asked.load(places)?;
            let kept = match checkpoint {
                None => YearWork::temporary(&arguments.output, asked.head(&ready)?, most)?,
                Some(path) => YearWork::checkpoint(path, asked.head(&ready)?)?,
            };
            find(&asked, &mut ready, tables, places, (&[], Some(&kept), most), &interrupt)
        }),
    }
}

/// Finds a year from the light in the folder of another one.
fn find_from(asked: Asked, from: &Path, output: &Path, interrupt: &Interrupt) -> Result<()> {
    let same = fs::canonicalize(from).is_ok_and(|a| fs::canonicalize(output).is_ok_and(|b| a == b));
    if same {
        return Err(Error::input(output.display(), "is the folder that the light comes from")
            .remedy("write into another folder: that one stays as it is"));
    }
    let path = KeptLight::path(from)?;
    let (light, _) = YearWork::shard(&path)?;
    let asked = asked.with_light_of(&light.head.settings(&path)?);
    let light = [light];
    in_folder(&asked, output, interrupt, |tables, places| {
        let mut ready = asked.load(places)?;
        asked.head_of_light(&ready)?.check(
            &path,
            &light[0].head,
            "leave out --from, and the light is traced; only the control of lamps may differ",
        )?;
        find(&asked, &mut ready, tables, places, (&light, None, u64::MAX), interrupt)
    })
}

/// Joins the shards of a year.
pub(super) fn merge(
    shards: &[PathBuf],
    scene: Option<&Path>,
    output: &Path,
    plots: PlotStyle,
) -> Result<()> {
    let interrupt = Interrupt::install()?;
    let shards = YearShards::open(shards)?;
    let asked = Asked::of_shards(&shards, scene, plots);
    for path in [Some(&asked.scene), asked.control.as_ref()].into_iter().flatten() {
        if !path.is_file() {
            let problem = "a file that the shards were traced with is not there";
            return Err(Error::input(path.display(), problem)
                .remedy("merge where they were traced, or name the scene with --scene"));
        }
    }
    in_folder(&asked, output, &interrupt, |tables, places| {
        let mut ready = asked.load(places)?;
        let head = asked.head(&ready)?;
        shards.files.iter().try_for_each(|file| file.check(&head))?;
        find(&asked, &mut ready, tables, places, (&shards.files, None, USUAL_LIGHT), &interrupt)
    })
}

/// Prepares the tables in a folder, which is made if it does not exist, and does `work`.
fn in_folder(
    asked: &Asked,
    folder: &Path,
    interrupt: &Interrupt,
    work: impl FnOnce(YearTables, &mut Vec<PathBuf>) -> Result<()>,
) -> Result<()> {
    check_folder(folder)?;
    let made = make_folder(folder, interrupt)?;
    let held = interrupt.hold(folder);
    let mut places = Vec::new();
    let file = |path: &Path| {
        let file = interrupt.file(path)?;
        places.extend(file.place().map(Path::to_path_buf));
        Ok(file)
    };
    let tables = held
        .as_ref()
        .map_err(Error::clone)
        .and_then(|_| YearTables::create(folder, asked.tables.csv, asked.plots, file));
    // at an immediate end the files in the folder are removed first, and then the folder if it was
    // made here and is empty
    let gone = |_: &Result<YearTables>| made.then(|| Temporary::IfEmpty(folder.to_path_buf()));
    let tables = interrupt.make(|| Ok(tables), gone)?;
    let done = tables.and_then(|tables| work(tables, &mut places));
    drop(held);
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

/// Does some work on a year with a bar that tells of its phases. If there is a checkpoint, a signal
/// ends the work in an orderly way.
fn watched<T>(
    asked: &Asked,
    ready: &Ready,
    scratch: &Path,
    (done, now): (&[YearWork], Option<&YearWork>),
    interrupt: &Interrupt,
    work: impl FnOnce(&YearOptions, &Control, &ProgressBar) -> Result<T>,
) -> Result<T> {
    let bar = terminal_bar("{bar:30} {percent}% {human_pos} {msg}, {speed}{left}");
    let phase = |phase: &str| {
        bar.set_message(phase.to_owned());
        bar.set_position(0);
        bar.reset();
    };
    let progress = |progress: Progress| show(&bar, progress);
    let control = Control { stop: interrupt.stop(), progress: &progress };
    let path = asked.control.as_deref().map(|path| path.display().to_string());
    let options = YearOptions {
        control: ready.control.as_ref().zip(path.as_deref()),
        hours: asked.hours.clone(),
        sun_rays: asked.sun_rays,
        kept: Kept { done, now },
        scratch: scratch.to_path_buf(),
        phase: &phase,
    };
    let kept = now.filter(|file| file.place().is_some()).map(|file| {
        Error::interrupted("run", format!("what was done is in {}", file.path().display()))
            .remedy("the same command goes on from there")
    });
    let found = match &kept {
        None => work(&options, &control, &bar),
        Some(late) => interrupt.listening(Some(late.clone()), || work(&options, &control, &bar)),
    };
    bar.finish_and_clear();
    found.map_err(|error| match (error.kind() == ErrorKind::Interrupted, kept) {
        (true, Some(kept)) => kept,
        _ => error,
    })
}

fn find(
    asked: &Asked,
    ready: &mut Ready,
    mut tables: YearTables,
    places: &mut Vec<PathBuf>,
    (done, now, most): (&[YearWork], Option<&YearWork>, u64),
    interrupt: &Interrupt,
) -> Result<()> {
    let scratch = tables.folder().to_path_buf();
    let shards: Vec<PathBuf> = done.iter().map(|file| file.path().to_path_buf()).collect();
    ready.read = FilesRead::new(ready.scenes.files.iter().chain(&shards));
    places.extend(now.and_then(YearWork::place).map(Path::to_path_buf));
    let loaded = &ready.scenes.scenes[0].loaded;
    let mut file = |path: &Path| {
        let file = interrupt.file(path)?;
        places.extend(file.place().map(Path::to_path_buf));
        Ok(file)
    };
    if !loaded.scene.ratios().is_empty() {
        tables = tables.with_ratios(&mut file)?;
    }
    if let (Some(hourly), true) = (&loaded.hourly, asked.tables.results) {
        tables = tables.with_results(months_of(&hourly.slots).iter(), &mut file)?;
    }
    check_places(places, &ready.read)?;
    let mut year =
        watched(asked, ready, &scratch, (done, now), interrupt, |options, control, _| {
            say_needs(&Year::needs(&ready.scenes, options, &ready.settings)?);
            Year::find(&ready.scenes, options, &ready.settings, control)
        })?;
    interrupt.writing();
    // those of the scene and its files have been said
    let own = year.warnings.clone();
    let mut of_scene = super::run::warnings_of(loaded)?;
    of_scene.extend_from_slice(&ready.scenes.warnings);
    year.warnings.splice(0..0, of_scene);
    let light = KeptLight::new(done.iter().chain(now), &asked.head_of_light(ready)?, most);
    watched(asked, ready, &scratch, ([].as_slice(), None), interrupt, |options, _, bar| {
        (options.phase)("rows of tables");
        write(&year, tables, light.as_ref(), &ready.read, &|photons, of| {
            show(bar, Progress { photons, of: Some(of), worst: None });
        })
    })?;
    now.iter().for_each(|file| file.remove());
    super::terminal::warn(&own);
    let kept = match light.is_some() {
        true => "",
        false => ", without its light for --from, as it is large: --keep-light keeps it",
    };
    let wrote = format!("\nwrote {}{kept}\n", scratch.display());
    super::terminal::print(&(describe(loaded, &year)? + &wrote))
}

fn say_needs(needs: &Needs) {
    if needs.disk > 0 && !super::terminal::is_quiet() {
        let [memory, disk] = [needs.memory, needs.disk].map(gigabytes);
        let text = "GB on the disk while it is calculated";
        super::terminal::complain(&format!(
            "takes about {memory} GB of memory and {disk} {text}\n"
        ));
    }
}

/// Does the work of a shard, and writes it into a file.
fn trace_shard(
    asked: &Asked,
    output: &Path,
    shard: Shard,
    checkpoint: Option<&Path>,
    interrupt: &Interrupt,
) -> Result<()> {
    let file = interrupt.file(output)?;
    let mut places: Vec<PathBuf> = file.place().iter().map(|place| place.to_path_buf()).collect();
    let ready = asked.load(&places)?;
    let head = asked.head(&ready)?;
    let scratch = file.place().map_or_else(std::env::temp_dir, folder_of);
    let kept = match checkpoint {
        None => YearWork::temporary(&scratch, head, u64::MAX)?,
        Some(path) => YearWork::checkpoint(path, head)?,
    };
    places.extend(kept.place().map(Path::to_path_buf));
    check_places(&places, &ready.read)?;
    watched(asked, &ready, &scratch, (&[], Some(&kept)), interrupt, |options, control, _| {
        trace_shard_of(&ready.scenes, options, &ready.settings, shard, control)
    })?;
    interrupt.writing();
    during("writing", || file.write(&ready.read, |writer| kept.write_shard(shard, writer)))?;
    kept.remove();
    let name = ready.scenes.scenes[0].loaded.scene.name();
    let text = format!("shard {shard} of {name}; wrote {}\n", place_of(output));
    super::terminal::print(&text)
}

fn describe(loaded: &LoadedScene, year: &Year) -> Result<String> {
    let hours = year.slots.len();
    let lights = loaded.scene.lights().len();
    let mut text = format!(
        "{}: {hours} hours from {} photons of {lights} lights, seed {}\n",
        loaded.scene.name(),
        year.photons,
        year.seed
    );
    let months: Vec<&String> = year.months.keys().take(terminal::shown(MONTHS)).collect();
    let sums: Vec<_> = (0..months.len()).map(|m| year.month(m)).collect::<Result<_>>()?;
    let ids = &year.places.ids;
    // if there are groups, they are shown in place of captors, for they say more
    let first = if ids.len() > year.places.captors { year.places.captors } else { 0 };
    for (b, band) in year.bands.iter().enumerate().filter(|(b, _)| year.integrated[*b]) {
        let heads = months.iter().map(|name| name.as_str());
        let mut table = Table::new(format!("{}, {}", band.name, year.unit), heads, "");
        for (i, id) in ids.iter().enumerate().skip(first).take(terminal::shown(SHOWN)) {
            let cells = sums.iter().map(|sums| {
                let light = sums.light(i, Channel::Front, b);
                light.map_or("-".into(), |light| with_error(light.mean, light.variance.sqrt()))
            });
            table.row(format!("  {id}"), cells, "");
        }
        text.push('\n');
        table.write(&mut text, terminal::width(), terminal::is_full());
        text.push_str(&terminal::more(ids.len() - first, SHOWN));
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
