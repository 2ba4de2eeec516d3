//! A year from its beginning: loads the scene and the control file, and writes the tables into a
//! folder, a shard into a file, or the tables of all shards.

use std::{
    fs,
    path::{Path, PathBuf},
};

use super::{
    HoursOf, Kept, KeptLight, Needs, USUAL_LIGHT, Year, YearOptions, YearScenes, YearShards,
    gigabytes, months_of,
    tables::{YearTables, write},
    trace_shard,
};
use crate::{
    check::check_meshes,
    desk::{Desk, check_folder},
};
use phylux_core::{
    error::{Error, ErrorKind, Result, setting},
    transport::{
        direct_sun::SunRays,
        settings::{Checked, Guiding, PhotonCount, Settings, ThreadCount},
        shard::Shard,
        simulate::{Control, Progress},
    },
    words,
};
use phylux_files::{
    control_file::ControlFile,
    output::{FilesRead, Temporary, check_places, folder_of},
    scene_file::SkyDivision,
    work_file::{TableSettings, Work, WorkHead},
    year_work::{YearSettings, YearWork},
};
use phylux_show::plot::PlotStyle;

/// Which year is to be found, and how.
#[derive(Clone, Debug)]
pub struct YearJob {
    /// The scene file.
    pub scene: PathBuf,
    /// The control file; without it all lamps are off.
    pub control: Option<PathBuf>,
    /// The patches of the sky.
    pub division: SkyDivision,
    /// Number of photons; where it, the seed, the guiding or the number of threads is not given,
    /// the scene's holds.
    pub photons: Option<PhotonCount>,
    /// Seed of the random numbers.
    pub seed: Option<u64>,
    /// What guides the photons.
    pub guiding: Option<Guiding>,
    /// The captors and groups whose hours are written.
    pub hours: HoursOf,
    /// Number of points of each captor from which the sun of an hour is looked for.
    pub sun_rays: Option<u64>,
    /// Which tables are written, and in which format.
    pub tables: TableSettings,
    /// How plots look.
    pub plots: PlotStyle,
    /// The folder of an earlier year of the same scene, whose light is taken; its settings of the
    /// light hold then.
    pub from: Option<PathBuf>,
    /// Whether the light is kept in the folder for another control of the lamps, however large it
    /// is.
    pub keep_light: bool,
    /// Number of threads; 0 takes all processors.
    pub threads: Option<ThreadCount>,
}

impl YearJob {
    /// Checks a number of points from which the sun is looked for. Error: it is out of range.
    pub fn sun_rays(number: u64) -> Checked<u64> {
        let (least, most) = SunRays::RANGE.into_inner();
        match SunRays::RANGE.contains(&number) {
            true => Ok(number),
            false => Err(format!("must be {least} to {most}")),
        }
    }

    /// What was asked for when shards were traced.
    fn of_shards(shards: &YearShards, scene: Option<&Path>, plots: PlotStyle) -> Self {
        let YearShards { head, settings, .. } = shards;
        let tables = head.tables.clone().unwrap_or_default();
        let hours = tables.hours.as_deref().and_then(|text| HoursOf::parse(text).ok());
        Self {
            scene: scene.map_or_else(|| PathBuf::from(&head.scene), Path::to_path_buf),
            control: head.control.as_ref().map(PathBuf::from),
            division: division(settings),
            photons: PhotonCount::new(settings.photons).ok(),
            seed: Some(settings.seed),
            guiding: Some(settings.guiding),
            hours: hours.unwrap_or_default(),
            sun_rays: Some(settings.sun_rays),
            tables,
            plots,
            from: None,
            keep_light: false,
            threads: None,
        }
    }

    /// The same with the settings by which the light in a folder was traced.
    fn with_light_of(&self, settings: &YearSettings) -> Self {
        Self {
            division: division(settings),
            photons: PhotonCount::new(settings.photons).ok(),
            seed: Some(settings.seed),
            guiding: Some(settings.guiding),
            sun_rays: Some(settings.sun_rays),
            ..self.clone()
        }
    }

    /// Reads and checks the scene and the control file. No output may stand at `places` that
    /// would replace a file which was read.
    fn load(&self, places: &[PathBuf], desk: &Desk) -> Result<Ready> {
        let control = self.control.as_deref().map(ControlFile::load).transpose()?;
        let of_control = control.as_ref().zip(self.control.as_deref());
        let scenes = desk.during("reading the scene", |_| {
            YearScenes::load(&self.scene, self.division, of_control)
        })?;
        let loaded = &scenes.scenes[0].loaded;
        loaded.check_captors()?;
        let read = FilesRead::new(&scenes.files);
        check_places(places, &read)?;
        desk.warn(&loaded.warnings);
        desk.warn(&scenes.warnings);
        desk.warn(&check_meshes(&loaded.scene)?);
        let settings = Settings {
            photons: self.photons.or(loaded.settings.photons),
            seed: self.seed.unwrap_or(loaded.settings.seed),
            guiding: self.guiding.unwrap_or(loaded.settings.guiding),
            threads: self.threads.unwrap_or(loaded.settings.threads),
            tolerance: None,
            max_time: None,
            ..loaded.settings.clone()
        };
        Ok(Ready { scenes, control, settings, read })
    }

    /// Returns what work files say of this year.
    fn head(&self, ready: &Ready) -> Result<WorkHead> {
        let (scene, inputs) = (self.scene.display().to_string(), ready.scenes.digest()?);
        let mut head = WorkHead::new(Work::Year, scene, inputs, &self.settings(ready)?);
        head.control = self.control.as_ref().map(|path| path.display().to_string());
        head.tables = Some(self.tables.clone());
        Ok(head)
    }

    /// Returns what the light in a folder says of its year, whatever switches the lamps.
    fn head_of_light(&self, ready: &Ready) -> Result<WorkHead> {
        // no path, so that the light is the same wherever the files are
        let scene = ready.scenes.scenes[0].loaded.scene.name().to_string();
        let inputs = ready.scenes.digest_of_light()?;
        Ok(WorkHead::new(Work::Year, scene, inputs, &self.settings(ready)?))
    }

    fn settings(&self, ready: &Ready) -> Result<YearSettings> {
        Ok(YearSettings {
            patches: match self.division {
                SkyDivision::Tregenza => 145,
                SkyDivision::Reinhart => 577,
            },
            photons: ready.settings.photons_or_default(),
            seed: ready.settings.seed,
            guiding: ready.settings.guiding,
            sun_rays: ready.scenes.sun_rays(self.sun_rays, &self.hours)?,
        })
    }
}

fn division(settings: &YearSettings) -> SkyDivision {
    match settings.patches {
        145 => SkyDivision::Tregenza,
        _ => SkyDivision::Reinhart,
    }
}

/// What was read.
struct Ready {
    scenes: YearScenes,
    control: Option<ControlFile>,
    settings: Settings,
    read: FilesRead,
}

/// A year, and the facts about its scene that a summary tells.
pub struct MadeYear {
    /// The year.
    pub year: Year,
    /// Name of the scene.
    pub scene: String,
    /// Number of lights.
    pub lights: usize,
    /// Whether its light is kept in the folder, for another control of the lamps.
    pub has_light: bool,
}

impl YearJob {
    /// Finds the year, and writes its tables into `folder`, which is made if it does not exist. What
    /// is done is kept in the file `checkpoint`, from which the same job goes on. Errors: those of the
    /// scene, the control file and [`Year::find`]; a file in the folder that no year has written;
    /// light that is not of this scene.
    pub fn tables(
        &self,
        folder: &Path,
        checkpoint: Option<&Path>,
        desk: &Desk,
    ) -> Result<MadeYear> {
        if let Some(from) = &self.from {
            return self.tables_from(from, folder, desk);
        }
        let most = if self.keep_light { u64::MAX } else { USUAL_LIGHT };
        self.in_folder(folder, desk, |tables, places| {
            let ready = self.load(places, desk)?;
            let kept = match checkpoint {
                None => YearWork::temporary(folder, self.head(&ready)?, most)?,
                Some(path) => YearWork::checkpoint(path, self.head(&ready)?)?,
            };
            self.find(ready, tables, places, (&[], Some(&kept), most), desk)
        })
    }

    /// Finds a year from the light in the folder of another one.
    fn tables_from(&self, from: &Path, folder: &Path, desk: &Desk) -> Result<MadeYear> {
        let same =
            fs::canonicalize(from).is_ok_and(|a| fs::canonicalize(folder).is_ok_and(|b| a == b));
        if same {
            return Err(Error::input(folder.display(), "is the folder that the light comes from")
                .remedy("write into another folder: that one stays as it is"));
        }
        let path = KeptLight::path(from)?;
        let (light, _) = YearWork::shard(&path)?;
        let job = self.with_light_of(&light.head.settings(&path)?);
        let light = [light];
        job.in_folder(folder, desk, |tables, places| {
            let ready = job.load(places, desk)?;
            job.head_of_light(&ready)?.check(
                &path,
                &light[0].head,
                words![
                    "leave out ",
                    setting("from"),
                    ", and the light is traced; only the control of lamps may differ"
                ],
            )?;
            job.find(ready, tables, places, (&light, None, u64::MAX), desk)
        })
    }

    /// Joins the shards of a year, and writes its tables into `folder`. `scene` is the scene file if
    /// it is not where it was when the shards were traced. Errors: those of [`tables`](Self::tables);
    /// shards that do not belong together.
    pub fn merge(
        shards: &[PathBuf],
        scene: Option<&Path>,
        folder: &Path,
        plots: PlotStyle,
        desk: &Desk,
    ) -> Result<MadeYear> {
        let shards = YearShards::open(shards)?;
        let job = Self::of_shards(&shards, scene, plots);
        for path in [Some(&job.scene), job.control.as_ref()].into_iter().flatten() {
            if !path.is_file() {
                let problem = "a file that the shards were traced with is not there";
                return Err(Error::input(path.display(), problem).remedy(words![
                    "merge where they were traced, or name the scene with ",
                    setting("scene")
                ]));
            }
        }
        job.in_folder(folder, desk, |tables, places| {
            let ready = job.load(places, desk)?;
            let head = job.head(&ready)?;
            shards.files.iter().try_for_each(|file| file.check(&head))?;
            job.find(ready, tables, places, (&shards.files, None, USUAL_LIGHT), desk)
        })
    }

    /// Does the work of a shard, and writes it into the file `output`. Returns the name of the
    /// scene. Errors: those of [`tables`](Self::tables).
    pub fn shard(
        &self,
        output: &Path,
        shard: Shard,
        checkpoint: Option<&Path>,
        desk: &Desk,
    ) -> Result<String> {
        let file = desk.file(output)?;
        let mut places: Vec<PathBuf> =
            file.place().iter().map(|place| place.to_path_buf()).collect();
        let ready = self.load(&places, desk)?;
        let head = self.head(&ready)?;
        let scratch = file.place().map_or_else(std::env::temp_dir, folder_of);
        let kept = match checkpoint {
            None => YearWork::temporary(&scratch, head, u64::MAX)?,
            Some(path) => YearWork::checkpoint(path, head)?,
        };
        places.extend(kept.place().map(Path::to_path_buf));
        check_places(&places, &ready.read)?;
        self.watched(&ready, &scratch, (&[], Some(&kept)), desk, |options, control| {
            trace_shard(&ready.scenes, options, &ready.settings, shard, control)
        })?;
        desk.writing();
        desk.during("writing", |_| {
            file.write(&ready.read, |writer| kept.write_shard(shard, writer))
        })?;
        kept.remove();
        Ok(ready.scenes.scenes[0].loaded.scene.name().to_string())
    }

    /// Prepares the tables in a folder, which is made if it does not exist, and does `work`.
    fn in_folder<T>(
        &self,
        folder: &Path,
        desk: &Desk,
        work: impl FnOnce(YearTables, &mut Vec<PathBuf>) -> Result<T>,
    ) -> Result<T> {
        check_folder(folder)?;
        let made = make_folder(folder, desk)?;
        let held = desk.hold(folder);
        let mut places = Vec::new();
        let file = |path: &Path| {
            let file = desk.file(path)?;
            places.extend(file.place().map(Path::to_path_buf));
            Ok(file)
        };
        let tables = held
            .as_ref()
            .map_err(Error::clone)
            .and_then(|_| YearTables::create(folder, self.tables.csv, self.plots, file));
        // at an immediate end the files in the folder are removed first, and then the folder if it
        // was made here and is empty
        let gone = |_: &Result<YearTables>| made.then(|| Temporary::IfEmpty(folder.to_path_buf()));
        let tables = desk.make(|| Ok(tables), gone)?;
        let done = tables.and_then(|tables| work(tables, &mut places));
        drop(held);
        if made && done.is_err() {
            // this removes the folder only if it is empty
            let _ = fs::remove_dir(folder);
        }
        done
    }

    /// Does some work on a year, of whose phases the desk hears. If there is a checkpoint, a signal
    /// ends the work in an orderly way.
    fn watched<T>(
        &self,
        ready: &Ready,
        scratch: &Path,
        (done, now): (&[YearWork], Option<&YearWork>),
        desk: &Desk,
        work: impl FnOnce(&YearOptions, &Control) -> Result<T>,
    ) -> Result<T> {
        let path = self.control.as_deref().map(|path| path.display().to_string());
        let kept = now.filter(|file| file.place().is_some()).map(|file| {
            Error::interrupted("run", format!("what was done is in {}", file.path().display()))
                .remedy("the same command goes on from there")
        });
        let found = desk.during("planning", |progress| {
            let options = YearOptions {
                control: ready.control.as_ref().zip(path.as_deref()),
                hours: self.hours.clone(),
                sun_rays: self.sun_rays,
                kept: Kept { done, now },
                scratch: scratch.to_path_buf(),
                phase: &|phase| desk.begin(phase),
            };
            let work = || work(&options, &Control { stop: desk.stop(), progress });
            match &kept {
                None => work(),
                Some(late) => desk.listening(Some(late.clone()), work),
            }
        });
        found.map_err(|error| match (error.kind() == ErrorKind::Interrupted, kept) {
            (true, Some(kept)) => kept,
            _ => error,
        })
    }

    fn find(
        &self,
        mut ready: Ready,
        mut tables: YearTables,
        places: &mut Vec<PathBuf>,
        (done, now, most): (&[YearWork], Option<&YearWork>, u64),
        desk: &Desk,
    ) -> Result<MadeYear> {
        let scratch = tables.folder().to_path_buf();
        let shards: Vec<PathBuf> = done.iter().map(|file| file.path().to_path_buf()).collect();
        ready.read = FilesRead::new(ready.scenes.files.iter().chain(&shards));
        places.extend(now.and_then(YearWork::place).map(Path::to_path_buf));
        let loaded = &ready.scenes.scenes[0].loaded;
        let mut file = |path: &Path| {
            let file = desk.file(path)?;
            places.extend(file.place().map(Path::to_path_buf));
            Ok(file)
        };
        if !loaded.scene.ratios().is_empty() {
            tables = tables.with_ratios(&mut file)?;
        }
        if let (Some(hourly), true) = (&loaded.hourly, self.tables.results) {
            tables = tables.with_results(months_of(&hourly.slots).iter(), &mut file)?;
        }
        check_places(places, &ready.read)?;
        let mut year = self.watched(&ready, &scratch, (done, now), desk, |options, control| {
            say_needs(&Year::needs(&ready.scenes, options, &ready.settings)?, desk);
            Year::find(&ready.scenes, options, &ready.settings, control)
        })?;
        desk.writing();
        // those of the scene and its files have been said
        let own = year.warnings.clone();
        let mut of_scene = loaded.warnings.clone();
        of_scene.extend(check_meshes(&loaded.scene)?);
        of_scene.extend_from_slice(&ready.scenes.warnings);
        year.warnings.splice(0..0, of_scene);
        let light = KeptLight::new(done.iter().chain(now), &self.head_of_light(&ready)?, most);
        self.watched(&ready, &scratch, ([].as_slice(), None), desk, |options, control| {
            (options.phase)("rows of tables");
            write(&year, tables, light.as_ref(), &ready.read, &|photons, of| {
                (control.progress)(Progress { photons, of: Some(of), worst: None });
            })
        })?;
        now.iter().for_each(|file| file.remove());
        desk.warn(&own);
        let (scene, lights) = (loaded.scene.name().to_string(), loaded.scene.lights().len());
        Ok(MadeYear { year, scene, lights, has_light: light.is_some() })
    }
}

/// Makes the folder, unless it exists, and returns whether it was made.
fn make_folder(folder: &Path, desk: &Desk) -> Result<bool> {
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
    desk.make(make, |()| None).map(|()| true)
}

fn say_needs(needs: &Needs, desk: &Desk) {
    if needs.disk > 0 {
        let [memory, disk] = [needs.memory, needs.disk].map(gigabytes);
        let text = "GB on the disk while it is calculated";
        desk.note(&format!("takes about {memory} GB of memory and {disk} {text}"));
    }
}
