//! Checks that a result which was read from a file is complete.

use super::{
    BandResult, BudgetResult, ByLight, CaptorResult, Energy, Factor, GroupResult, Row, RunResult,
    ToleranceResult,
};
use crate::{
    lists::{are_errors, are_values},
    quantity::QUANTITIES,
};
use phylux_core::math::stats::is_possible;

impl RunResult {
    /// Returns whether every list has an entry for each band, as the lists of a run have, sums come
    /// after bands, and no number is so large that sums and squares of such numbers are infinite.
    pub fn is_valid(&self) -> bool {
        let (bands, ratios) = (self.bands.len(), self.ratios.len());
        let of_captor = |captor: &CaptorResult| {
            let CaptorResult { area, center, normal, .. } = captor;
            center.iter().chain(normal).chain([area]).all(|number| is_possible(*number))
        };
        let rows = self.captors.iter().map(CaptorResult::row);
        let mut rows = rows.chain(self.groups.iter().map(GroupResult::row)).flat_map(Row::parts);
        let parts = self.energy.by_light.iter().flat_map(ByLight::values);
        let own = self.own_bands().len();
        let mut factors = self.mixed.iter().flat_map(ByLight::values);
        parts.chain([&self.energy]).all(|energy| energy.is_valid(bands))
            && factors.all(|factor| factor.is_valid(own))
            && self.account.unseen.iter().all(|shares| are_values(shares, bands))
            && self.account.unseen_se.iter().all(|errors| are_values(errors, bands))
            && self.account.cut_off.is_none_or(is_possible)
            && self.period_h.is_none_or(is_possible)
            && self.account.tolerance.iter().all(ToleranceResult::is_valid)
            && self.account.electricity.iter().all(|found| found.is_valid(bands))
            && self.ratios.iter().all(|ratio| ratio.is_valid(own))
            && self.bands.iter().all(BandResult::is_valid)
            && self.own_bands().iter().all(|band| band.sum_of.is_none())
            && self.captors.iter().all(of_captor)
            && self.groups.iter().all(|group| is_possible(group.area))
            && rows.all(|row| row.is_valid(bands, ratios))
            && self.extras.layers.iter().flatten().all(|layer| layer.is_valid(bands))
            && self
                .extras
                .sensitivity
                .iter()
                .flatten()
                .all(|found| found.is_valid(bands, self.ratios.len()))
            && self.extras.budget.iter().flatten().all(BudgetResult::is_valid)
            && self.extras.uncertain.iter().flatten().all(|input| input.is_valid(own))
            && self.extras.canopy.iter().all(|canopy| canopy.is_valid(bands))
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

impl Row<'_> {
    /// Returns whether every list has an entry for each band or ratio, and no number is too large.
    pub(super) fn is_valid(&self, bands: usize, ratios: usize) -> bool {
        let columns = QUANTITIES.iter().flat_map(|quantity| {
            let faces = (0..3).filter_map(|face| quantity.at(self, face));
            faces.map(|column| (column, quantity.width(bands, ratios)))
        });
        let found = self.faces.iter().flatten().filter_map(|face| face.ratios.as_deref());
        let knn = self.faces.iter().flatten().filter_map(|face| face.knn.as_ref()?.as_deref());
        columns.into_iter().all(|(column, width)| column.is_valid(width))
            && found.chain(self.absorbed_ratios).all(|found| found.has_covariances(ratios))
            && knn.into_iter().all(|knn| [knn.radius, knn.coverage].into_iter().all(is_possible))
    }
}
