//! Whether a result that was read is one.

use super::{Absorbed, ByLight, CaptorResult, Energy, FaceResult, GroupResult, RunResult};

impl RunResult {
    /// Whether every list has an entry for each band, as those of a run have.
    pub fn is_whole(&self) -> bool {
        let bands = self.bands.len();
        let of_captors = |captor: &CaptorResult| {
            captor.faces().all(|face| face.is_whole(bands))
                && fits(&captor.absorbed, &captor.absorbed_se, &captor.by_light, bands)
        };
        let of_groups = |group: &GroupResult| {
            std::iter::once(&group.front).chain(&group.back).all(|face| face.is_whole(bands))
                && fits(&group.absorbed, &group.absorbed_se, &group.by_light, bands)
        };
        let parts = self.energy.by_light.iter().flat_map(ByLight::values);
        parts.chain([&self.energy]).all(|energy| energy.is_whole(bands))
            && self.captors.iter().all(of_captors)
            && self.groups.iter().all(of_groups)
    }
}

impl Energy {
    fn is_whole(&self, bands: usize) -> bool {
        let Self { power, emitted, absorbed, escaped, lost, absorbed_by, .. } = self;
        let by_material = absorbed_by.iter().flat_map(ByLight::values);
        let mut known = [emitted, absorbed, escaped, lost].into_iter().chain(by_material);
        let paths = [emitted, absorbed, escaped, lost].iter().all(|values| values.is_empty());
        power.len() == bands
            && (paths && absorbed_by.is_none() || known.all(|values| values.len() == bands))
    }
}

impl FaceResult {
    fn is_whole(&self, bands: usize) -> bool {
        let mut values =
            [&self.flux, &self.irradiance].into_iter().chain(&self.min).chain(&self.max);
        let mut errors = [&self.flux_se, &self.irradiance_se].into_iter();
        values.all(|values| values.len() == bands)
            && errors.all(|errors| errors.len() == bands)
            && self.by_light.iter().flat_map(ByLight::values).all(|part| part.is_whole(bands))
            && self
                .knn
                .iter()
                .flatten()
                .all(|knn| knn.irradiance.len() == bands && knn.irradiance_se.len() == bands)
    }
}

fn fits(
    absorbed: &Option<Vec<f64>>,
    errors: &Option<Vec<Option<f64>>>,
    parts: &Option<ByLight<Absorbed>>,
    bands: usize,
) -> bool {
    let parts = || parts.iter().flat_map(ByLight::values);
    absorbed.iter().chain(parts().map(|p| &p.absorbed)).all(|values| values.len() == bands)
        && errors.iter().chain(parts().map(|p| &p.absorbed_se)).all(|e| e.len() == bands)
}
