//! Checks that a result which was read from a file is complete.

use super::{
    Absorbed, AbsorbedByFace, BandResult, BudgetResult, ByLight, CaptorResult, Deviations, Energy,
    FaceResult, Factor, GroupResult, NearestResult, Ratios, RunResult, ToleranceResult,
};
use phylux_core::math::stats::is_possible;

impl RunResult {
    /// Returns whether every list has an entry for each band, as the lists of a run have, and no
    /// number is so large that sums and squares of such numbers are infinite.
    pub fn is_valid(&self) -> bool {
        let (bands, ratios) = (self.bands.len(), self.ratios.len());
        let of_captors = |captor: &CaptorResult| {
            let CaptorResult { area, center, normal, absorbed, absorbed_se, by_light, .. } = captor;
            let mut numbers = center.iter().chain(normal).chain([area]);
            numbers.all(|number| is_possible(*number))
                && captor.faces().all(|face| face.is_valid(bands, ratios))
                && fits(absorbed, absorbed_se, by_light, bands)
                && captor.absorbed_model_se.iter().all(|of| are_values(of, bands))
                && are_ratios(&captor.absorbed_ratios, by_light, ratios)
                && are_faces(&captor.absorbed_by_face, by_light, bands)
        };
        let of_groups = |group: &GroupResult| {
            is_possible(group.area)
                && std::iter::once(&group.front)
                    .chain(&group.back)
                    .all(|f| f.is_valid(bands, ratios))
                && fits(&group.absorbed, &group.absorbed_se, &group.by_light, bands)
                && group.absorbed_model_se.iter().all(|of| are_values(of, bands))
                && are_ratios(&group.absorbed_ratios, &group.by_light, ratios)
                && are_faces(&group.absorbed_by_face, &group.by_light, bands)
        };
        let parts = self.energy.by_light.iter().flat_map(ByLight::values);
        let own = self.bands.iter().filter(|band| band.sum_of.is_none()).count();
        let mut factors = self.mixed.iter().flat_map(ByLight::values);
        parts.chain([&self.energy]).all(|energy| energy.is_valid(bands))
            && factors.all(|factor| factor.is_valid(own))
            && self.unseen.iter().all(|shares| are_values(shares, bands))
            && self.cut_off.is_none_or(is_possible)
            && self.period_h.is_none_or(is_possible)
            && self.tolerance.iter().all(ToleranceResult::is_valid)
            && self.electricity.iter().all(|found| found.is_valid(bands))
            && self.ratios.iter().all(|ratio| ratio.is_valid(own))
            && self.bands.iter().all(BandResult::is_valid)
            && self.captors.iter().all(of_captors)
            && self.groups.iter().all(of_groups)
            && self.layers.iter().flatten().all(|layer| layer.is_valid(bands))
            && self
                .sensitivity
                .iter()
                .flatten()
                .all(|found| found.is_valid(bands, self.ratios.len()))
            && self.budget.iter().flatten().all(BudgetResult::is_valid)
            && self.uncertain.iter().flatten().all(|input| input.is_valid(own))
            && self.canopy.iter().all(|canopy| canopy.is_valid(bands))
    }
}

impl Factor {
    /// `bands` is the number of bands without the sums, which have no factors of their own.
    fn is_valid(&self, bands: usize) -> bool {
        match self {
            Self::All(factor) => is_possible(*factor),
            Self::Bands(factors) => are_values(factors, bands),
        }
    }
}

impl ToleranceResult {
    fn is_valid(&self) -> bool {
        let Self { asked, worst, dark, .. } = self;
        let error = worst.as_ref().and_then(|worst| worst.relative_error);
        let mut numbers = dark.iter().map(|dark| dark.below).chain(error).chain([*asked]);
        numbers.all(is_possible)
    }
}

impl Energy {
    fn is_valid(&self, bands: usize) -> bool {
        let Self { power, emitted, absorbed, escaped, missed, lost, absorbed_by, .. } = self;
        let Self { chance, chance_se, .. } = self;
        let by_material = absorbed_by.iter().flat_map(ByLight::values);
        let mut known = [emitted, absorbed, escaped, lost].into_iter().chain(by_material);
        let paths = [emitted, absorbed, escaped, lost].iter().all(|values| values.is_empty());
        are_values(power, bands)
            && (missed.is_empty() || are_values(missed, bands))
            && chance.iter().all(|values| are_values(values, bands))
            && chance_se.iter().all(|errors| are_errors(errors, bands))
            && (paths && absorbed_by.is_none() || known.all(|values| are_values(values, bands)))
    }
}

impl BandResult {
    fn is_valid(&self) -> bool {
        let members = self.sum_of.as_ref().map_or(0, Vec::len);
        let is_weight = |weight: &f64| (0.0..=1e30).contains(weight);
        self.weights.iter().all(|all| all.len() == members && all.iter().all(is_weight))
    }
}

impl FaceResult {
    fn is_valid(&self, bands: usize, ratios: usize) -> bool {
        let mut values =
            [&self.flux, &self.irradiance].into_iter().chain(&self.min).chain(&self.max);
        let mut errors = [&self.flux_se, &self.irradiance_se].into_iter();
        values.all(|values| are_values(values, bands))
            && errors.all(|errors| are_errors(errors, bands))
            && are_model_errors(self.flux_model_se.as_deref(), bands)
            && are_model_errors(self.irradiance_model_se.as_deref(), bands)
            && self.dli.iter().chain(&self.dli_se).all(|values| are_errors(values, bands))
            && self.uniformity.iter().all(|even| even.is_valid(bands))
            && self
                .by_light
                .iter()
                .flat_map(|lights| lights.values())
                .all(|part| part.is_valid(bands, ratios))
            && self.ratios.iter().all(|found| found.is_valid(ratios))
            && self.knn.iter().flatten().all(|knn| knn.is_valid(bands))
    }
}

impl NearestResult {
    fn is_valid(&self, bands: usize) -> bool {
        let Self { radius, coverage, irradiance, irradiance_se, radiance, radiance_se, .. } = self;
        [radius, coverage].into_iter().all(|number| is_possible(*number))
            && radiance.iter().chain([irradiance]).all(|values| are_values(values, bands))
            && radiance_se.iter().chain([irradiance_se]).all(|errors| are_errors(errors, bands))
    }
}

fn fits(
    absorbed: &Option<Vec<f64>>,
    errors: &Option<Vec<Option<f64>>>,
    parts: &Option<ByLight<Absorbed>>,
    bands: usize,
) -> bool {
    let parts = || parts.iter().flat_map(ByLight::values);
    absorbed.iter().chain(parts().map(|p| &p.absorbed)).all(|values| are_values(values, bands))
        && errors.iter().chain(parts().map(|p| &p.absorbed_se)).all(|e| are_errors(e, bands))
}

fn are_ratios(all: &Option<Ratios>, parts: &Option<ByLight<Absorbed>>, ratios: usize) -> bool {
    let parts = parts.iter().flat_map(ByLight::values).filter_map(|p| p.absorbed_ratios.as_ref());
    all.iter().chain(parts).all(|found| found.is_valid(ratios))
}

fn are_faces(
    all: &Option<AbsorbedByFace>,
    parts: &Option<ByLight<Absorbed>>,
    bands: usize,
) -> bool {
    let parts = parts.iter().flat_map(ByLight::values).filter_map(|p| p.absorbed_by_face.as_ref());
    all.iter().chain(parts).all(|of| {
        [&of.front, &of.back].iter().all(|values| are_values(values, bands))
            && [&of.front_se, &of.back_se].iter().all(|errors| are_errors(errors, bands))
    })
}

/// Returns whether these are values of so many bands.
pub fn are_values(values: &[f64], bands: usize) -> bool {
    values.len() == bands && values.iter().all(|value| is_possible(*value))
}

/// Returns whether these are standard errors of so many bands, some of which may be unknown.
pub fn are_errors(errors: &[Option<f64>], bands: usize) -> bool {
    errors.len() == bands && errors.iter().flatten().all(|error| is_possible(*error))
}

/// Returns whether these are standard deviations of so many values, where there are any.
pub fn are_model_errors(errors: Option<&Deviations>, values: usize) -> bool {
    errors.is_none_or(|errors| are_values(errors, values))
}
