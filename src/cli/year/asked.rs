//! Which year is to be found, and how: from options, or from shards.

use std::path::{Path, PathBuf};

use crate::cli::{outputs::check_places, progress::during, terminal};
use phylux_core::{
    error::Result,
    transport::settings::{Guiding, PhotonCount, Settings, ThreadCount},
};
use phylux_files::{
    control_file::ControlFile,
    output::FilesRead,
    scene_file::SkyDivision,
    work_file::{TableSettings, Work, WorkHead},
    year_work::YearSettings,
};
use phylux_show::plot::PlotStyle;
use phylux_studies::{
    check::check_meshes,
    year::{HoursOf, YearScenes, YearShards},
};

/// What is asked for: which year is to be found, and how.
pub struct Asked {
    pub scene: PathBuf,
    pub control: Option<PathBuf>,
    pub division: SkyDivision,
    pub photons: Option<PhotonCount>,
    pub seed: Option<u64>,
    pub guiding: Option<Guiding>,
    pub hours: HoursOf,
    pub sun_rays: Option<u64>,
    pub tables: TableSettings,
    pub plots: PlotStyle,
    pub threads: Option<ThreadCount>,
}

impl Asked {
    /// The same with the settings by which the light in a folder was traced.
    pub fn with_light_of(self, settings: &YearSettings) -> Self {
        Self {
            division: division(settings),
            photons: PhotonCount::new(settings.photons).ok(),
            seed: Some(settings.seed),
            guiding: Some(settings.guiding),
            sun_rays: Some(settings.sun_rays),
            ..self
        }
    }

    /// What was asked for when shards were traced.
    pub fn of_shards(shards: &YearShards, scene: Option<&Path>, plots: PlotStyle) -> Self {
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
            threads: None,
        }
    }

    /// Reads and checks the scene and the control file. No output may stand at `places` that
    /// would replace a file which was read.
    pub fn load(&self, places: &[PathBuf]) -> Result<Ready> {
        let control = self.control.as_deref().map(ControlFile::load).transpose()?;
        let of_control = control.as_ref().zip(self.control.as_deref());
        let scenes = during("reading the scene", || {
            YearScenes::load(&self.scene, self.division, of_control)
        })?;
        let loaded = &scenes.scenes[0].loaded;
        loaded.check_captors()?;
        let read = FilesRead::new(&scenes.files);
        check_places(places, &read)?;
        terminal::warn(&loaded.warnings);
        terminal::warn(&scenes.warnings);
        terminal::warn(&check_meshes(&loaded.scene)?);
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
    pub fn head(&self, ready: &Ready) -> Result<WorkHead> {
        let (scene, inputs) = (self.scene.display().to_string(), ready.scenes.digest()?);
        let mut head = WorkHead::new(Work::Year, scene, inputs, &self.settings(ready)?);
        head.control = self.control.as_ref().map(|path| path.display().to_string());
        head.tables = Some(self.tables.clone());
        Ok(head)
    }

    /// Returns what the light in a folder says of its year, whatever switches the lamps.
    pub fn head_of_light(&self, ready: &Ready) -> Result<WorkHead> {
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
pub struct Ready {
    pub scenes: YearScenes,
    pub control: Option<ControlFile>,
    pub settings: Settings,
    pub read: FilesRead,
}
