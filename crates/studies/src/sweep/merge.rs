//! Joins the shards of one sweep that were run apart to what one machine would have written.

use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
};

use super::{
    Outcome, SweepControl, failures,
    folder::{Damaged, Manifest, RunFile, State, SweepFolder, Times, run_file},
    linear::Jobs,
    sealed::body,
    simulations,
    tables::{self, Written},
};
use phylux_core::{
    error::{Error, NOTHING_WRITTEN, Result},
    transport::shard::Shard,
};
use phylux_files::{
    input::read_bytes,
    sweep_file::{Run, Sweep},
};

/// The file of a run, and the folder that holds it.
struct Found<'a> {
    shard: &'a Path,
    file: RunFile,
}

/// Joins the folders `shards` in the folder at `path`. Errors: the shards are of different sweeps,
/// scenes or versions; a run is in none of them; they read different contents of a file; two of
/// them have different results of one run; those of [`sweep`](super::sweep).
pub fn merge(shards: &[PathBuf], path: &Path, control: &SweepControl) -> Result<Outcome> {
    let Some(first) = shards.first() else {
        return Err(Error::input("merge", "no folders").remedy("name those of all shards"));
    };
    let same = |shard: &&PathBuf| {
        fs::canonicalize(shard)
            .is_ok_and(|shard| fs::canonicalize(path).is_ok_and(|path| shard == path))
    };
    if let Some(shard) = shards.iter().find(same) {
        let problem = "is a shard, and so must stay as it is";
        return Err(Error::input(shard.display(), problem).remedy("name another folder for all"));
    }
    let manifest = Manifest::read(first)?;
    for shard in &shards[1..] {
        check_same(&manifest, first, &Manifest::read(shard)?, shard)?;
    }
    if manifest.phylux != env!("CARGO_PKG_VERSION") {
        let problem =
            format!("is of phylux {}, this is {}", manifest.phylux, env!("CARGO_PKG_VERSION"));
        return Err(
            Error::input(first.display(), problem).remedy("merge with the version that ran")
        );
    }
    let name = first.join("sweep.json").display().to_string();
    let sweep = Sweep::new(&name, manifest.sweep, manifest.scene, first.clone())?;
    let jobs = Jobs::new(&sweep, control)?;
    let found = collect(&sweep, &jobs, shards, control)?;

    let folder = SweepFolder::open(path)?;
    folder.written().clear(&tables::names(), true)?;
    folder.write_manifest(&sweep)?;
    for found in &found {
        if control.stopped() {
            return Err(Error::interrupted("merge", "not all was written")
                .remedy("the same command does it anew"));
        }
        folder.copy(&found.file.path)?;
    }
    let mut times = HashMap::new();
    for shard in shards {
        times.extend(Times::read(shard));
    }
    Times::tidy(&folder, &sweep, &times)?;
    let states: Vec<State> = found.into_iter().map(|found| found.file.state).collect();
    let Written { warned, plots } = tables::write(&folder, &sweep, &states, control)?;
    let failed = failures(sweep.runs(), &states);
    let simulations = simulations(&jobs, Shard::WHOLE);
    Ok(Outcome {
        runs: states.len(),
        kept: 0,
        damaged: 0,
        simulations,
        failed,
        missing: 0,
        warned,
        plots,
    })
}

fn check_same(a: &Manifest, first: &Path, b: &Manifest, shard: &Path) -> Result<()> {
    let what = match () {
        () if a.phylux != b.phylux => "another version of phylux",
        () if a.sweep != b.sweep => "another sweep file",
        () if a.scene != b.scene => "another scene",
        () => return Ok(()),
    };
    let problem = format!("is of {what} than {}", first.display());
    Err(Error::input(shard.display(), problem).remedy("merge shards of one sweep"))
}

/// Returns the file of each run, in order.
fn collect<'a>(
    sweep: &Sweep,
    jobs: &Jobs,
    shards: &'a [PathBuf],
    control: &SweepControl,
) -> Result<Vec<Found<'a>>> {
    let of = sweep.runs().len();
    let mut found = Vec::with_capacity(of);
    let (mut missing, mut first_missing) = (0, None);
    // the hash of each file of the scene, and the shard that read it
    let mut contents: HashMap<String, (Option<String>, &Path)> = HashMap::new();
    for run in sweep.runs() {
        if control.stopped() {
            return Err(Error::interrupted("merge", NOTHING_WRITTEN));
        }
        control.looking(run.number, of);
        let Some(file) = find(sweep, &run, jobs.base(&run), shards)? else {
            missing += 1;
            first_missing.get_or_insert(format!("run {} ({run})", run.number));
            continue;
        };
        for (name, digest) in &file.file.origin.files {
            let (known, shard) =
                contents.entry(name.clone()).or_insert_with(|| (digest.clone(), file.shard));
            if known != digest {
                let problem = format!("read another content of {name} than {}", shard.display());
                return Err(Error::input(file.shard.display(), problem)
                    .remedy("run the older shard again with the same files"));
            }
        }
        found.push(file);
    }
    if let Some(first) = first_missing {
        let problem =
            format!("{missing} of {of} runs are in none of the folders, the first: {first}");
        return Err(Error::input("merge", problem).remedy("name the folders of all shards"));
    }
    Ok(found)
}

/// Returns the file of a run, with its results or else its error. `None` if no folder has one.
/// Errors: two folders have different results; the only file is damaged.
fn find<'a>(
    sweep: &Sweep,
    run: &Run,
    base: Option<&str>,
    shards: &'a [PathBuf],
) -> Result<Option<Found<'a>>> {
    let mut best: Option<Found> = None;
    let mut damaged = None;
    for shard in shards {
        let file = match run_file(shard, sweep, run, base) {
            Ok(Some(file)) => file,
            Ok(None) => continue,
            Err(Damaged) => {
                damaged.get_or_insert(shard);
                continue;
            }
        };
        let done = file.state == State::Done;
        match &best {
            Some(best) if best.file.state == State::Done => {
                if done && !same_results(&best.file.path, &file.path) {
                    let problem = format!(
                        "has other results of run {} than {}",
                        run.number,
                        best.shard.display()
                    );
                    return Err(Error::input(shard.display(), problem)
                        .remedy("run the older shard again with the same files"));
                }
            }
            Some(_) if !done => {}
            _ => best = Some(Found { shard, file }),
        }
    }
    match (best, damaged) {
        (None, Some(shard)) => {
            let problem = format!("its file of run {} is damaged", run.number);
            Err(Error::input(shard.display(), problem)
                .remedy("do this shard again: only what is damaged is run"))
        }
        (best, _) => Ok(best),
    }
}

/// Returns whether two files hold the same results, with or without a checksum.
fn same_results(a: &Path, b: &Path) -> bool {
    let (Ok(a), Ok(b)) = (read_bytes(a), read_bytes(b)) else { return false };
    let [a, b] = [&a, &b].map(|bytes| {
        let whole = body(bytes);
        whole.strip_suffix(b"\n}\n").unwrap_or(whole)
    });
    a == b
}
