//! The light of a month, or of the whole period, as the result of a run that has lasted so long.

use std::borrow::Cow;

use super::{
    Year,
    hours::HOUR,
    places::Of,
    value::{OWN, Value, Values},
};
use phylux_core::{error::Result, scene::captor::Channel, transport::settings::Estimator};
use phylux_results::result::{
    Account, CaptorResult, Energy, Extras, FEW_HISTORIES, FORMAT, FaceResult, GroupResult, Own,
    PerBand, Provenance, Ratios, RunResult, Spread, Whole,
};

impl Year {
    /// Returns the mean light of a month, by its index, or of the whole period, as results of a
    /// run. Error: a file of the system cannot be read.
    pub fn result(&self, month: Option<usize>) -> Result<RunResult> {
        let (values, slots) = match month {
            Some(month) => (self.month(month)?, self.months[month].clone()),
            None => (self.whole()?, (0..self.slots.len()).collect()),
        };
        let hours: f64 = slots.iter().map(|&s: &usize| self.slots[s].length).sum();
        let power = self.days.len() + month.unwrap_or(self.months.len());
        let mean = Mean { year: self, values, scale: 1.0 / (HOUR * hours.min(24.0)) };
        let captors: Vec<CaptorResult> =
            (0..self.places.captors).map(|id| mean.captor(id)).collect();
        let members = self.places.members();
        let groups = self.places.of.iter().enumerate().filter_map(|(id, of)| match of {
            Of::Group(group) => Some(mean.group(id, &members[*group], &captors)),
            Of::Captor(_) => None,
        });
        let provenance = Provenance {
            format: FORMAT,
            phylux: env!("CARGO_PKG_VERSION").into(),
            scene: self.head.scene.clone(),
            scene_hash: String::new(),
            seed: self.seed,
            photons: self.photons,
            photons_beside: None,
            batches: self.head.batches,
            estimator: Estimator::Photons,
            guiding: None,
            starved: false,
            chosen: None,
            shared: None,
            mixed: None,
            calibrated: false,
            settings: None,
            warnings: self.warnings.clone(),
        };
        let mut result = RunResult {
            provenance,
            unit: self.units(),
            period_h: Some(hours),
            bands: self.bands.clone(),
            ratios: self.places.ratios.clone(),
            energy: Energy {
                power: self.head.powers[power][..self.bands.len()].to_vec(),
                ..Energy::default()
            },
            account: Account::default(),
            groups: groups.collect(),
            captors,
            extras: Extras::default(),
        };
        result.add_dli();
        Ok(result)
    }
}

/// Integrals per day, and the factor that makes means of them.
struct Mean<'y> {
    year: &'y Year,
    values: Values<'y>,
    scale: f64,
}

impl Mean<'_> {
    /// Returns the light of a channel times a factor, and its errors; `None` if the id has no such
    /// channel.
    fn light(&self, id: usize, channel: Channel, factor: f64) -> Option<Light> {
        let values = (0..self.year.bands.len()).map(|band| self.values.light(id, channel, band));
        let values: Vec<Value> = values.collect::<Option<_>>()?;
        let factor = self.scale * factor;
        let known = values.iter().map(|v| (v.mean != 0.0).then(|| factor * v.variance.sqrt()));
        Some((values.iter().map(|v| factor * v.mean).collect(), known.collect()))
    }

    fn face(&self, id: usize, channel: Channel, photons: u64) -> Option<FaceResult> {
        let area = self.year.places.areas[id][channel as usize];
        let (irradiance, irradiance_se) = self.light(id, channel, 1.0)?;
        let (flux, flux_se) = self.light(id, channel, area)?;
        Some(FaceResult {
            photons,
            flux,
            flux_se,
            irradiance,
            irradiance_se,
            ratios: self.ratios(id, channel),
            few_paths: photons < FEW_HISTORIES,
            ..FaceResult::default()
        })
    }

    fn absorbed(&self, id: usize) -> Option<Light> {
        self.light(id, Channel::Absorbed, self.year.places.areas[id][Channel::Absorbed as usize])
    }

    /// Returns the ratios of the light of a channel; `None` if the scene has none, or the id has no
    /// such channel.
    fn ratios(&self, id: usize, channel: Channel) -> Option<Box<Ratios>> {
        let places = &self.year.places;
        if places.ratios.is_empty() || !places.has(id, channel) {
            return None;
        }
        let found = (0..places.ratios.len()).map(|r| self.values.ratio(id, channel, r));
        let (ratio, ratio_se) =
            found.map(|found| found.map(|v| (v.mean, v.variance.sqrt())).unzip()).unzip();
        Some(Box::new(Ratios { ratio, ratio_se, ..Ratios::default() }))
    }

    /// Returns what an id has as a whole, with the share of its area that the sun shines on, on
    /// average over the time in which it shines.
    fn whole(&self, id: usize) -> Whole {
        let (absorbed, absorbed_se) = self.absorbed(id).unzip();
        let share = self.values.own(id).map(|share| [share.mean, share.variance.sqrt()]);
        Whole {
            absorbed,
            absorbed_se,
            own: Own::default().with(OWN, share),
            absorbed_ratios: self.ratios(id, Channel::Absorbed),
            ..Whole::default()
        }
    }

    fn captor(&self, id: usize) -> CaptorResult {
        let places = &self.year.places;
        let shape = &places.shapes[id];
        let [front, back] = self.year.head.arrived[id];
        CaptorResult {
            id: places.ids[id].clone(),
            kind: Cow::Borrowed(shape.kind),
            area: places.areas[id][Channel::Front as usize],
            center: shape.center.unwrap_or_default().to_array(),
            normal: shape.normal.unwrap_or_default().to_array(),
            front: self.face(id, Channel::Front, front).unwrap_or_else(nothing),
            back: self.face(id, Channel::Back, back),
            whole: self.whole(id),
            groups: Some(shape.groups.clone()),
        }
    }

    fn group(&self, id: usize, members: &[usize], captors: &[CaptorResult]) -> GroupResult {
        let places = &self.year.places;
        let (mut fronts, mut backs) = (Spread::default(), Spread::default());
        let mut photons = [0; 2];
        for &captor in members {
            let (of, area) = (&captors[captor], captors[captor].area);
            fronts.add(&of.front, area);
            of.back.iter().for_each(|back| backs.add(back, area));
            let arrived = self.year.head.arrived[captor];
            photons.iter_mut().zip(arrived).for_each(|(sum, own)| *sum += own);
        }
        let front = self.face(id, Channel::Front, photons[0]).unwrap_or_else(nothing);
        GroupResult {
            id: places.ids[id].clone(),
            captors: members.len(),
            area: places.areas[id][Channel::Front as usize],
            front: fronts.on(front),
            back: self.face(id, Channel::Back, photons[1]).map(|back| backs.on(back)),
            whole: self.whole(id),
        }
    }
}

/// Values and their errors, band by band.
type Light = (PerBand<f64>, PerBand<Option<f64>>);

fn nothing() -> FaceResult {
    unreachable!("a captor without a front")
}
