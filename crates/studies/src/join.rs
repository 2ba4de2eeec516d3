//! Joins the shards of one run that were traced on several machines. The result is the same as that
//! of a single run.

use std::{
    path::{Path, PathBuf},
    sync::atomic::Ordering,
};

use phylux_core::{
    error::{Error, NOTHING_WRITTEN, Result, setting, some},
    scene::world::Scene,
    transport::{
        settings::Settings,
        shard::Shard,
        simulate::{Choice, Control, Joined, Progress},
    },
    words,
};
use phylux_files::{
    run_work::{KeptSettings, RunRecord},
    scene_file::{LoadedScene, load_with_digest},
    work_file::{FORMAT, OTHER_FORMAT, VERSION, Work, WorkHead, WorkReader},
};
use phylux_results::result::RunResult;

use crate::check::check_meshes;

/// Joins the files `shards` to one result. `scene` is the path of the scene, if it is not where the
/// shards say. Errors: the shards are of different runs, some are missing or given twice, the scene
/// has changed, stopped by `control`.
pub fn join(shards: &[PathBuf], scene: Option<&Path>, control: &Control) -> Result<RunResult> {
    Shards::open(shards, scene)?.join(control)
}

/// All shards of one run, with its scene.
pub struct Shards {
    /// Readers of the shards, in order.
    readers: Vec<WorkReader>,
    scene: Scene,
    settings: Settings,
    choice: Option<Choice>,
    /// Warnings about the scene and the files that it comes from.
    warnings: Vec<String>,
    /// All files that are read: the shards, the scene and the files that it names.
    pub files: Vec<PathBuf>,
}

impl Shards {
    /// Opens the files `shards`, and loads the scene from `scene` or, without one, from where the
    /// shards say.
    pub fn open(shards: &[PathBuf], scene: Option<&Path>) -> Result<Self> {
        let readers = shards.iter().map(|path| WorkReader::shard(path, Work::Run));
        let mut readers = readers.collect::<Result<Vec<_>>>()?;
        let Some(first) = readers.first() else {
            return Err(Error::input("merge", "no files").remedy("name those of all shards"));
        };
        check_version(first)?;
        readers[1..].iter().try_for_each(|reader| check_same(first, reader))?;
        readers[1..].iter().try_for_each(check_version)?;
        let (head, of, place) = (first.head.clone(), first.shard.of(), first.path.clone());
        readers.sort_by_key(|reader| reader.shard.index());
        let all: Vec<(Shard, &Path)> = readers.iter().map(|r| (r.shard, &*r.path)).collect();
        check_complete(&all, of)?;
        let kept: KeptSettings = head.settings(&place)?;
        let loaded = scene_of(&head, scene)?;
        let settings =
            kept.settings(loaded.settings.threads).ok_or_else(|| head.no_settings(&place))?;
        let files = shards.iter().chain(&loaded.files).cloned().collect();
        let mut warnings = loaded.warnings;
        warnings.extend(check_meshes(&loaded.scene)?);
        Ok(Self { readers, scene: loaded.scene, settings, choice: kept.choice(), warnings, files })
    }

    /// Adds up the shards.
    pub fn join(self, control: &Control) -> Result<RunResult> {
        let Self { mut readers, scene, settings, choice, warnings, .. } = self;
        let mut joined = Joined::new(&scene, &settings, choice, control)?;
        let mut batches = 0;
        for reader in &mut readers {
            let mut left = joined.range(reader.shard);
            loop {
                if control.stop.load(Ordering::Relaxed) {
                    return Err(Error::interrupted("merge", NOTHING_WRITTEN));
                }
                let fits = match RunRecord::next(reader)? {
                    Some(RunRecord::Batch { index, sums }) => {
                        batches += 1;
                        (control.progress)(Progress { photons: batches, of: None, worst: None });
                        (left.next() == Some(index))
                            .then(|| joined.add_batch(index, *sums))
                            .flatten()
                    }
                    Some(RunRecord::Arrivals { key, words }) => joined.add_task(key, &words),
                    Some(RunRecord::Full { key }) => {
                        joined.end_at(key);
                        Some(())
                    }
                    Some(RunRecord::State(_)) => None,
                    None if left.next().is_none() => break,
                    None => None,
                };
                fits.ok_or_else(|| {
                    let problem = "does not fit its own scene and settings";
                    Error::input(reader.path.display(), problem).remedy("trace this shard again")
                })?;
            }
        }
        Ok(RunResult::new(&joined.finish()?).with_warnings_of_scene(warnings))
    }
}

fn check_version(reader: &WorkReader) -> Result<()> {
    let WorkHead { phylux, format, .. } = &reader.head;
    if phylux == VERSION {
        if *format == FORMAT {
            return Ok(());
        }
        return Err(
            Error::input(reader.path.display(), OTHER_FORMAT).remedy("trace this shard again")
        );
    }
    let problem = format!("is of phylux {phylux}, this is {VERSION}");
    Err(Error::input(reader.path.display(), problem).remedy("merge with the version that ran"))
}

fn check_same(first: &WorkReader, reader: &WorkReader) -> Result<()> {
    let (a, b) = (&first.head, &reader.head);
    let what = match () {
        () if a.phylux != b.phylux => "another version of phylux",
        () if a.inputs != b.inputs => "another scene, or of other contents of its files,",
        () if a.settings != b.settings => "other settings",
        () if first.shard.of() != reader.shard.of() => "another number of shards",
        () => return Ok(()),
    };
    let problem = format!("is of {what} than {}", first.path.display());
    Err(Error::input(reader.path.display(), problem).remedy("merge the shards of one run"))
}

/// Checks that the sorted shards are complete and that each is there once.
pub(super) fn check_complete(shards: &[(Shard, &Path)], of: usize) -> Result<()> {
    for pair in shards.windows(2) {
        if pair[0].0 == pair[1].0 {
            let problem = format!("is shard {}, and so is {}", pair[1].0, pair[0].1.display());
            return Err(Error::input(pair[1].1.display(), problem).remedy("name each once"));
        }
    }
    let there: Vec<usize> = shards.iter().map(|(shard, _)| shard.index()).collect();
    let missing = (0..of)
        .filter(|index| there.binary_search(index).is_err())
        .map(|index| format!("{}/{of}", index + 1));
    match of - there.len() {
        0 => Ok(()),
        more => {
            let s = if more == 1 { " is" } else { "s are" };
            let problem = format!("shard{s} missing: {}", some(missing, 6));
            Err(Error::input("merge", problem).remedy("name the files of all shards"))
        }
    }
}

/// Loads the scene of the shards, which is at `path` or, without one, where their `head` says.
fn scene_of(head: &WorkHead, path: Option<&Path>) -> Result<LoadedScene> {
    let path = path.unwrap_or(Path::new(&head.scene));
    if !path.is_file() {
        let problem = "the scene of the shards is not there";
        return Err(Error::input(path.display(), problem)
            .remedy(words!["say where it is with ", setting("scene")]));
    }
    let (loaded, digest) = load_with_digest(path)?;
    if digest != head.inputs {
        let problem = "it, or a file that it names, is not what the shards were traced in";
        return Err(Error::input(path.display(), problem)
            .remedy("merge with the files that the shards were traced with"));
    }
    Ok(loaded)
}

#[cfg(test)]
mod tests {
    use std::{fs, sync::LazyLock};

    use proptest::prelude::*;

    use super::*;
    use phylux_core::transport::{
        settings::{NearestCount, PhotonCount, ThreadCount},
        shard::Shard,
        simulate::{Plan, simulate_shard},
    };
    use phylux_files::{run_work::write_shard, work_file::sealed};
    use phylux_testing::{LEAF, SCENE, check_error, check_finite, spoiled};

    #[rustfmt::skip]
    const WORDS: &[&str] = &[
        "null", "[", "]", "{", "}", "\"batch\":", "1/2", "\"photons\":", "9007199254740992", "1000000000",
        "2139095039", "4294967295", "1e300", "-1e300", "1e-300", "auto",
    ];

    /// A folder with the scene and the files that it names.
    static FOLDER: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        fs::write(folder.path().join("scene.json"), SCENE).expect("a file");
        fs::write(folder.path().join("leaf.obj"), LEAF).expect("a file");
        folder
    });

    /// The text of the only shard of a run.
    static FILES: LazyLock<Vec<&'static str>> = LazyLock::new(|| {
        let scene = FOLDER.path().join("scene.json");
        let (loaded, inputs) = load_with_digest(&scene).unwrap_or_else(|e| panic!("{e}"));
        let settings = Settings {
            photons: PhotonCount::new(128).ok(),
            k: NearestCount::new(2).ok(),
            by_light: true,
            threads: ThreadCount::ONE,
            ..loaded.settings
        };
        let control = Control::default();
        let plan = Plan::make(&loaded.scene, &settings, &control).unwrap_or_else(|e| panic!("{e}"));
        let shard_sums = simulate_shard(&loaded.scene, &plan, Shard::WHOLE, &control);
        let settings = KeptSettings::new(&plan.settings, None);
        let head = WorkHead::new(Work::Run, scene.display().to_string(), inputs, &settings);
        let head = head.of_shard(Shard::WHOLE);
        let mut bytes = Vec::new();
        write_shard(&head, shard_sums.unwrap_or_else(|e| panic!("{e}")), &mut bytes)
            .expect("memory");
        vec![String::from_utf8(bytes).expect("UTF-8").leak()]
    });

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Any text leads to an error that names the file, or to finite numbers. A shard that was
        /// changed is accepted only if it also has a new checksum.
        #[test]
        fn no_spoiled_shard_panics(bytes in spoiled(FILES.as_slice(), WORDS), seal: bool) {
            let (scene, path) = (FOLDER.path().join("scene.json"), FOLDER.path().join("p.json"));
            let bytes = if seal { sealed(&bytes) } else { bytes };
            fs::write(&path, &bytes).expect("a file");
            let control = Control::default();
            match join(std::slice::from_ref(&path), Some(&scene), &control) {
                Ok(result) => {
                    assert!(seal || bytes == FILES[0].as_bytes());
                    check_finite(&result);
                }
                Err(error) if error.to_string().starts_with("merge: shard") => {}
                Err(error) if error.to_string().starts_with("merge: not all batches") => {}
                Err(error) => check_error(&error, FOLDER.path()),
            }
        }
    }

    #[test]
    fn the_sound_shard_is_read() {
        assert_eq!(sealed(FILES[0].as_bytes()), FILES[0].as_bytes());
    }
}
