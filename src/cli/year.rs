//! `phylux year`: finds the light of each hour of a period or a year, from the sky, the sun and
//! lamps.

use std::{
    collections::HashMap,
    fmt::Write,
    path::{Path, PathBuf},
};

use clap::{Args, ValueEnum};

use super::{
    interrupt,
    outputs::place_of,
    run::{LONG_RUNS, photons, threads},
    style::Plots,
    terminal,
};
use phylux_core::{
    error::Result,
    math::pattern::copied,
    scene::captor::Channel,
    transport::{
        settings::{Checked, Guiding, PhotonCount, ThreadCount},
        shard::Shard,
    },
};
use phylux_files::{scene_file::SkyDivision, work_file::TableSettings};
use phylux_show::plot::PlotStyle;
use phylux_studies::{
    text::{
        short,
        summary::{MANY, range},
        table::Table,
        with_error,
    },
    year::{
        HoursOf, Value, Values, Year,
        job::{MadeYear, YearJob},
    },
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
    #[arg(long, value_name = "N", value_parser = photons)]
    photons: Option<PhotonCount>,
    /// Seed of the random numbers: the same seed gives the same results, byte for byte [default:
    /// the scene's]
    #[arg(long, value_name = "N", value_parser = super::run::count)]
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
    #[arg(long, value_name = "N", value_parser = sun_rays)]
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
    #[arg(long, value_name = "N", value_parser = threads)]
    threads: Option<ThreadCount>,
}

fn sun_rays(text: &str) -> Checked<u64> {
    YearJob::sun_rays(super::run::count(text)?)
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
    fn job(&self) -> YearJob {
        let hours = self.hours.clone().unwrap_or_default();
        YearJob {
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
            from: self.from.clone(),
            keep_light: self.keep_light,
            hours,
            threads: self.threads,
        }
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let desk = interrupt::desk()?;
    let (job, output) = (arguments.job(), &arguments.output);
    let checkpoint = arguments.checkpoint.as_deref();
    let Some(shard) = arguments.shard else {
        return say(&job.tables(output, checkpoint, &desk)?, output);
    };
    arguments.plots.refuse("shards", "give it when they are merged")?;
    let scene = job.shard(output, shard, checkpoint, &desk)?;
    terminal::print(&format!("shard {shard} of {scene}; wrote {}\n", place_of(output)))
}

/// Joins the shards of a year.
pub(super) fn merge(
    shards: &[PathBuf],
    scene: Option<&Path>,
    output: &Path,
    plots: PlotStyle,
) -> Result<()> {
    let desk = interrupt::desk()?;
    say(&YearJob::merge(shards, scene, output, plots, &desk)?, output)
}

/// Prints what was found, and where it is.
fn say(made: &MadeYear, folder: &Path) -> Result<()> {
    let kept = match made.has_light {
        true => "",
        false => ", without its light for --from, as it is large: --keep-light keeps it",
    };
    terminal::print(&format!("{}\nwrote {}{kept}\n", describe(made)?, folder.display()))
}

/// Returns the rows of the table, with the places of their ids, from a first one on; the copies of a
/// thing, if they are many, are one, and so are ids of the same `light`, which only groups of the same
/// captors have to all digits.
fn rows(
    ids: &[String],
    first: usize,
    light: impl Fn(usize) -> Option<Vec<[u64; 2]>>,
) -> Vec<(String, Vec<usize>)> {
    let mut copies: HashMap<&str, usize> = HashMap::new();
    ids[first..].iter().filter_map(|id| copied(id)).for_each(|thing| {
        *copies.entry(thing).or_default() += 1;
    });
    let many = |thing: &&str| !terminal::is_full() && copies[*thing] >= MANY;
    let mut places: HashMap<&str, usize> = HashMap::new();
    let mut alike: HashMap<Vec<[u64; 2]>, usize> = HashMap::new();
    let mut rows: Vec<(String, Vec<usize>)> = Vec::new();
    for (i, id) in ids.iter().enumerate().skip(first) {
        let Some(thing) = copied(id).filter(many) else {
            let row =
                light(i).map_or(rows.len(), |light| *alike.entry(light).or_insert(rows.len()));
            match rows.get_mut(row) {
                Some((name, _)) => *name += &format!(", {id}"),
                None => rows.push((id.clone(), vec![i])),
            }
            continue;
        };
        let place = *places.entry(thing).or_insert(rows.len());
        if place == rows.len() {
            rows.push((format!("each {thing}# ({})", copies[thing]), Vec::new()));
        }
        rows[place].1.push(i);
    }
    rows
}

fn describe(MadeYear { year, scene, lights, .. }: &MadeYear) -> Result<String> {
    let hours = year.slots.len();
    let mut text = format!(
        "{scene}: {hours} hours from {} photons of {lights} lights, seed {}\n",
        year.photons, year.seed
    );
    tables(year, &mut text)?;
    if !year.lamps.is_empty() {
        let all = || 0..year.slots.len();
        let hours: f64 = year.lamps.iter().map(|lamp| year.hours_on(lamp, all())).sum();
        let energy: Option<f64> = year.lamps.iter().map(|lamp| year.energy(lamp, all())).sum();
        let energy = energy.map_or(String::new(), |e| format!(", {} kWh", short(e)));
        let _ = writeln!(text, "\n{} lamps: {} h{energy}", year.lamps.len(), short(hours));
    }
    Ok(text)
}

/// Writes the light of a mean day in all bands, and that of each month in one.
fn tables(year: &Year, text: &mut String) -> Result<()> {
    let bands: Vec<usize> = (0..year.bands.len()).filter(|&b| year.integrated[b]).collect();
    let is_sum = |&&b: &&usize| year.bands[b].sum_of.is_some();
    let Some(&usual) = bands.iter().find(is_sum).or(bands.first()) else { return Ok(()) };
    let whole = year.whole()?;
    let ids = &year.places.ids;
    // if there are groups, they are shown in place of captors, for they say more
    let first = if ids.len() > year.places.captors { year.places.captors } else { 0 };
    let light = |i: usize| {
        let of_band =
            |&b: &usize| whole.light(i, Channel::Front, b).filter(|light| light.mean > 0.0);
        let bits = |light: Value| [light.mean, light.variance].map(f64::to_bits);
        (first > 0).then(|| bands.iter().map(|b| of_band(b).map(bits)).collect()).flatten()
    };
    let rows = rows(ids, first, light);
    let mut show = |title: String, columns: &[(&str, &Values, usize)]| {
        let mut table = Table::new(title, columns.iter().map(|(name, ..)| *name), "");
        for (name, of) in rows.iter().take(terminal::shown(SHOWN)) {
            let cells = columns.iter().map(|(_, values, band)| {
                let found = of.iter().filter_map(|&i| values.light(i, Channel::Front, *band));
                match &found.collect::<Vec<_>>()[..] {
                    [] => "-".into(),
                    [light] => with_error(light.mean, light.variance.sqrt()),
                    found => range(found.iter().map(|light| light.mean).collect()),
                }
            });
            table.row(format!("  {name}"), cells, "");
        }
        table.below(text, &terminal::page());
        text.push_str(&terminal::more(rows.len(), SHOWN));
    };
    let name = |b: usize| year.bands[b].name.as_str();
    let days = match year.days.len() {
        1 => "the day".into(),
        days => format!("mean of {days} days"),
    };
    let of_bands: Vec<_> = bands.iter().map(|&b| (name(b), &whole, b)).collect();
    show(format!("{days}, {}", year.unit), &of_bands);
    if year.months.len() > 1 {
        let months = year.months.keys().take(terminal::shown(MONTHS)).enumerate();
        let months = months.map(|(m, name)| Ok((name.as_str(), year.month(m)?)));
        let months: Vec<(&str, Values)> = months.collect::<Result<_>>()?;
        for &b in bands.iter().filter(|&&b| b == usual || terminal::is_full()) {
            let columns: Vec<_> = months.iter().map(|(name, values)| (*name, values, b)).collect();
            show(format!("{}, {}", name(b), year.unit), &columns);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three copies of a thing are one row where their first one stood, two are not, and captors before
    /// the groups have none.
    #[test]
    fn copies_have_a_row_together() {
        let ids = ["leaf#0", "all", "plant#0", "tree#0", "plant#1", "tree#1", "plant#2"];
        let found = rows(&ids.map(String::from), 1, |_| None);
        let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["all", "each plant# (3)", "tree#0", "tree#1"]);
        assert_eq!(found[1].1, [2, 4, 6]);
    }

    /// Groups of the same light are one row; those without light are not.
    #[test]
    fn groups_of_the_same_captors_have_a_row_together() {
        let ids = ["lit", "row", "dark", "other", "night"].map(String::from);
        let light = [Some(3), Some(3), None, Some(4), None];
        let found = rows(&ids, 0, |i| light[i].map(|bits| vec![[bits, 1]]));
        let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["lit, row", "dark", "other", "night"]);
    }
}
