//! How far off the scattered sunlight of single hours is because it is mixed with that of hours
//! about them. Sums over the period do not suffer, because bundles hold each hour once in all.

use super::{Value, Year};
use crate::formats::scene_file::HourlyLights;

/// Ratio of the error of an hour to the mean difference of its bundles to what the bundles beside
/// them let expect. If light changed with the place of the sun as a parabola does, it would be 1/3;
/// at edges of shadows it is larger. With this factor the mean square of the deviations over their
/// errors was 0.9, for 89 hours of sensors behind a window.
const FACTOR: f64 = 0.6;
/// The most hours that are looked at for the warning.
const HOURS: usize = 200;
/// Fraction of the captors and groups from which on a warning names them.
const MANY: f64 = 0.05;

/// Returns for each light of a scene, at each id and band, by how much its light differs from a
/// guess by the lights beside it, beyond what noise explains. The list is empty for lights that
/// stand alone.
pub(super) fn bends(hourly: &HourlyLights, responses: &[Vec<[f32; 2]>]) -> Vec<Vec<f32>> {
    let mut bends = vec![Vec::new(); responses.len()];
    for light in hourly.lights.iter().filter(|light| !light.beside.is_empty()) {
        let own = &responses[light.light];
        let bend = |(place, &[mean, error]): (usize, &[f32; 2])| {
            let squares = light.beside.iter().map(|beside| {
                let mut off = Value::default();
                off.add(1.0, mean, error);
                for (other, share) in beside.from {
                    let [mean, error] = responses[other][place];
                    off.add(-share, mean, error);
                }
                beside.scale.powi(2) * (off.mean * off.mean - off.variance).max(0.0)
            });
            squares.sum::<f64>().sqrt() as f32
        };
        bends[light.light] = own.iter().enumerate().map(bend).collect();
    }
    bends
}

impl Year {
    /// Returns the irradiances at all ids and bands in an hour. Their errors include what the light
    /// of the hour may be off because it is interpolated.
    pub fn hour(&self, slot: usize) -> Vec<Value> {
        let mut values = self.sum(std::iter::once((slot, 1.0)));
        for (value, off) in values.iter_mut().zip(self.off(slot)) {
            value.variance += off * off;
        }
        values
    }

    /// Returns by how much the interpolated light of an hour may be off, at all ids and bands.
    fn off(&self, slot: usize) -> Vec<f64> {
        let mut off = vec![0.0; self.ids.len() * self.width()];
        for &(light, weight) in &self.weights[slot] {
            for (off, bend) in off.iter_mut().zip(&self.bends[light]) {
                *off += FACTOR * weight * f64::from(*bend);
            }
        }
        off
    }

    /// Returns a warning if at more than a few captors and groups the light of hours is less sure
    /// because it is interpolated than because of chance.
    pub(super) fn interpolated(&self) -> Option<String> {
        let width = self.width();
        let mut squares = vec![[0.0; 2]; self.ids.len() * width];
        let lit = (0..self.slots.len()).filter(|&slot| self.suns[slot].is_some());
        let lit: Vec<usize> = lit.collect();
        for &slot in lit.iter().step_by(lit.len().div_ceil(HOURS).max(1)) {
            let by_chance = self.sum(std::iter::once((slot, 1.0)));
            for (([off, noise], more), value) in
                squares.iter_mut().zip(self.off(slot)).zip(by_chance)
            {
                *off += more * more;
                *noise += value.variance;
            }
        }
        let wide = |squares: &&[[f64; 2]]| squares.iter().any(|[off, noise]| off > noise);
        let many = squares.chunks(width).filter(wide).count();
        let all = self.ids.len();
        (many as f64 > MANY * all as f64).then(|| {
            format!(
                "hours are interpolated: at {many} of {all} captors and groups scattered sunlight changes so \
                 fast with the sun's position that this, and not chance, makes up most of the errors of hours; \
                 sums over the period are right, and an hour that matters is best run by itself"
            )
        })
    }
}
