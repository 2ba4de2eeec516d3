//! Pictures of captors, in false colour by the results of a run.

use super::task::{Made, Task};
use phylux_core::{
    error::Result,
    transport::{
        settings::{NearestCount, Settings},
        simulate::simulate,
    },
    words,
};
use phylux_files::result_file::read_json;
use phylux_files::scene_file::LoadedScene;
use phylux_results::result::{PerBand, RunResult};
use phylux_show::render::Viewpoint;

/// Irradiances of one captor, per band and then per sum, on the front and on the back.
struct Faces([Option<PerBand<f64>>; 2]);

impl Task<'_> {
    pub fn captors(&self, loaded: &LoadedScene) -> Result<Made> {
        loaded.check_captors()?;
        let (faces, words) = match &self.job.results {
            Some(path) => {
                let results = read_json(path)?;
                let words = format!("{} {}\n", results.photons, results.estimator);
                results.check_scene(self.scene).map_err(|e| e.at(path.display()))?;
                let faces = results.captors.into_iter().map(|captor| {
                    Faces([Some(captor.front.irradiance), captor.back.map(|back| back.irradiance)])
                });
                (faces.collect(), words)
            }
            None => self.simulated(&loaded.settings)?,
        };
        let value = |captor: usize, front: bool| {
            let values = faces[captor].0[usize::from(!front)].as_ref()?;
            Some(match self.band.index {
                Some(index) => *values.get(index)?,
                None => self.band.bands.iter().map(|&b| values.get(b)).sum::<Option<f64>>()?,
            })
        };
        let all = (0..faces.len()).flat_map(|c| [value(c, true), value(c, false)]).flatten();
        let all: Vec<f64> = all.collect();
        let most = all.iter().copied().fold(0.0, f64::max);
        let scale = self.scale(all, 1.0);
        let picture = self.pale(Viewpoint::first_visible, |captor, front| {
            value(captor, front).map(|v| scale.colour(v))
        })?;
        let [_, unit] = self.scene.units(self.band.index.unwrap_or(0));
        let legend = self.legend("irradiance", &unit, scale, most);
        Ok(Made { picture: picture.with_bar(&legend)?, pixels: None, words: words![words] })
    }

    /// Runs the scene as `phylux run` would, and returns the irradiances of its captors with a line
    /// about the run.
    fn simulated(&self, settings: &Settings) -> Result<(Vec<Faces>, String)> {
        let Settings { seed, threads, photons, .. } = self.settings;
        let photons = photons.or(settings.photons);
        let settings =
            Settings { photons, seed, threads, k: Some(NearestCount::NONE), ..settings.clone() };
        let simulation =
            self.watched("photons", |control| simulate(self.scene, &settings, control))?;
        let result = RunResult::new(&simulation);
        let words = format!("{} {}\n", simulation.totals().histories, simulation.estimator());
        let faces = result.captors.into_iter().map(|captor| {
            Faces([Some(captor.front.irradiance), captor.back.map(|back| back.irradiance)])
        });
        Ok((faces.collect(), words))
    }
}
