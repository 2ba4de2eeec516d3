//! Whether results that were read are those of a scene.

use super::RunResult;
use phylux_core::{
    error::{Error, Result},
    scene::{captor::CaptorKind, world::Scene},
};

impl RunResult {
    /// Checks that the results are of this scene. Error: bands, unit or captors differ.
    pub fn check_scene(&self, scene: &Scene) -> Result<()> {
        let refuse = |problem: String| {
            Err(Error::input("results", format!("are of another scene: {problem}"))
                .remedy("name the results of a run of this scene as it is, or leave them out"))
        };
        let mut bands = scene.band_names();
        let mut theirs = self.bands.iter().map(|band| band.name.as_str());
        loop {
            match (bands.next(), theirs.next()) {
                (None, None) => break,
                (ours, theirs) if ours == theirs => {}
                (ours, theirs) => {
                    let name = |band: Option<&str>| {
                        band.map_or("no more".into(), |name| format!("band `{name}`"))
                    };
                    return refuse(format!("they have {}, it has {}", name(theirs), name(ours)));
                }
            }
        }
        let unit = scene.quantity().unit_names().flux;
        if self.unit.flux != unit {
            return refuse(format!("they are in {}, it is in {unit}", self.unit.flux));
        }
        for (ours, theirs) in scene.captors().iter().zip(&self.captors) {
            let id = &ours.id;
            if *id != theirs.id {
                return refuse(format!("they have captor `{}` where it has `{id}`", theirs.id));
            }
            // results hold both numbers to the last digit
            if ours.area != theirs.area || theirs.center != ours.center.to_array() {
                return refuse(format!("captor `{id}` has moved or changed its size"));
            }
            let absorbs = ours.kind == CaptorKind::Surface;
            if ours.kind.has_back() != theirs.back.is_some() || absorbs != theirs.absorbed.is_some()
            {
                return refuse(format!("captor `{id}` counts other sides"));
            }
        }
        let (ours, theirs) = (scene.captors().len(), self.captors.len());
        if let Some(captor) = scene.captors().get(theirs) {
            return refuse(format!("they have no captor `{}`", captor.id));
        }
        if let Some(captor) = self.captors.get(ours) {
            return refuse(format!("they have captor `{}`, which it has not", captor.id));
        }
        Ok(())
    }
}
