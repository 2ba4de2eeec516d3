//! Captors in the colours of their results.

use std::collections::HashMap;

use super::task::{Made, Task};
use crate::{
    error::{Error, Result},
    render::Eye,
    result::RunResult,
    result_file::ResultsFile,
    scene_file::LoadedScene,
    settings::Settings,
    simulate::simulate,
};

/// Irradiances per band and sum, front and back, of one captor.
struct Faces([Option<Vec<f64>>; 2]);

impl Task<'_> {
    pub fn captors(&self, loaded: &LoadedScene) -> Result<Made> {
        loaded.check_captors()?;
        let (faces, words) = match &self.arguments.results {
            Some(path) => {
                let results = ResultsFile::read(path)?;
                let words = format!("{} {}\n", results.photons, results.estimator);
                let faces = self.matched(&results).map_err(|e| e.at(path.display()))?;
                (faces, words)
            }
            None => self.simulated(&loaded.settings)?,
        };
        let value = |captor: usize, front: bool| {
            let values = faces[captor].0[usize::from(!front)].as_ref()?;
            Some(match self.band.index {
                Some(index) => *values.get(index)?,
                None => self.band.bands.iter().map(|&b| values[b]).sum(),
            })
        };
        let all = (0..faces.len()).flat_map(|c| [value(c, true), value(c, false)]).flatten();
        let scale = self.scale(all.collect(), 1.0);
        let picture =
            self.pale(Eye::sight, |captor, front| value(captor, front).map(|v| scale.colour(v)))?;
        let unit = self.scene.quantity.unit_names().irradiance;
        let legend = self.legend("irradiance", unit, scale);
        Ok(Made { picture: picture.with_bar(&legend), pixels: None, words })
    }

    /// Runs the scene as `phylux run` would.
    fn simulated(&self, settings: &Settings) -> Result<(Vec<Faces>, String)> {
        let Settings { seed, threads, .. } = self.settings;
        let settings = Settings { seed, threads, k: Some(0), ..settings.clone() };
        let simulation =
            self.watched("photons", |control| simulate(self.scene, &settings, control))?;
        let result = RunResult::new(self.scene, &settings, &simulation);
        let words = format!("{} {}\n", simulation.totals.histories, simulation.estimator);
        let faces = result.captors.into_iter().map(|captor| {
            Faces([Some(captor.front.irradiance), captor.back.map(|back| back.irradiance)])
        });
        Ok((faces.collect(), words))
    }

    /// The results of this scene's captors from a file. Errors: other bands or units, a captor that is
    /// not in it.
    fn matched(&self, results: &ResultsFile) -> Result<Vec<Faces>> {
        let other = |problem: String| {
            Err(Error::input("results", problem).remedy("name the results of this scene"))
        };
        let bands = self.scene.bands.iter().map(|band| &band.name);
        let names = bands.chain(self.scene.sums.iter().map(|sum| &sum.name));
        if !names.eq(results.bands.iter().map(|band| &band.name)) {
            return other("its bands and sums are not those of the scene".into());
        }
        let unit = self.scene.quantity.unit_names().irradiance;
        if results.unit.irradiance != unit {
            return other(format!("is in {}, the scene in {unit}", results.unit.irradiance));
        }
        let by_id: HashMap<&str, _> =
            results.captors.iter().map(|captor| (captor.id.as_str(), captor)).collect();
        let mut faces = Vec::new();
        for captor in &self.scene.captors {
            let Some(found) = by_id.get(captor.id.as_str()) else {
                return other(format!("has no captor `{}`, which is in the scene", captor.id));
            };
            let back = found.back.as_ref().map(|back| back.irradiance.clone());
            let sides = [Some(found.front.irradiance.clone()), back];
            if sides.iter().flatten().any(|values| values.len() != results.bands.len()) {
                return other(format!("captor `{}` lacks a value for some band", captor.id));
            }
            faces.push(Faces(sides));
        }
        Ok(faces)
    }
}
