//! Daily light integrals, the measure of a day's light that growers use.

use super::{BandResult, FaceResult, RunResult};

/// Daily light integral of a mean of 1 umol/m2/s, mol/m2/d: the seconds of a day, in mol per umol.
const DLI: f64 = 0.0864;
/// The longest time, h, of which a daily light integral is the sum.
const DAY: f64 = 24.0;

impl BandResult {
    /// Returns whether it has a daily light integral: photosynthetically active radiation, a part
    /// of it, or a weighted sum of photons. `photons` says whether the bands count photons.
    pub fn has_dli(&self, bands: &[Self], photons: bool) -> bool {
        match &self.unit {
            Some(unit) => unit.flux == "umol/s",
            None => photons && (self.weights.is_some() || self.is_par(bands)),
        }
    }

    /// Returns whether this is photosynthetically active radiation or a part of it: a band within
    /// 400 to 700 nm, or a sum of such `bands`.
    pub fn is_par(&self, bands: &[Self]) -> bool {
        match (&self.sum_of, self.from_nm, self.to_nm) {
            (Some(names), ..) => names
                .iter()
                .all(|name| bands.iter().any(|band| band.name == *name && band.is_par(&[]))),
            (None, Some(from), Some(to)) => from >= 400.0 && to <= 700.0,
            _ => false,
        }
    }
}

impl RunResult {
    /// Adds the daily light integrals, if the results have a unit for them.
    pub fn add_dli(&mut self) {
        if self.unit.dli.is_none() {
            return;
        }
        // a part of a day brings what it brings; of a longer period it is the mean of the days
        let dli = DLI * (self.period_h.unwrap_or(DAY).min(DAY) / DAY);
        let photons = self.unit.flux == "umol/s";
        let has = |band: &BandResult| band.has_dli(&self.bands, photons);
        let par: Vec<bool> = self.bands.iter().map(has).collect();
        let faces = self.parts_mut().flat_map(|(faces, _)| faces).flatten();
        faces.for_each(|face| face.add_dli(dli, &par));
    }
}

impl FaceResult {
    fn add_dli(&mut self, dli: f64, par: &[bool]) {
        let of = |values: &mut dyn Iterator<Item = Option<f64>>| {
            let of = |(value, par): (Option<f64>, &bool)| Some(dli * value.filter(|_| *par)?);
            Some(Box::new(values.zip(par).map(of).collect()))
        };
        self.dli = of(&mut self.irradiance.iter().copied().map(Some));
        self.dli_se = of(&mut self.irradiance_se.iter().copied());
        self.by_light
            .iter_mut()
            .flat_map(|lights| lights.values_mut())
            .for_each(|part| part.add_dli(dli, par));
    }
}
