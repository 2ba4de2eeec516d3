//! How far off the scattered sunlight of single hours is because it is mixed with that of hours
//! about them. Sums over the period do not suffer, because bundles hold each hour once in all.

use super::value::Value;
use crate::formats::scene_file::HourlyLights;

/// Ratio of the error of an hour to the mean difference of its bundles to what the bundles beside
/// them let expect. If light changed with the place of the sun as a parabola does, it would be 1/3;
/// at edges of shadows it is larger. With this factor the mean square of the deviations over their
/// errors was 0.9, for 89 hours of sensors behind a window.
pub(super) const FACTOR: f64 = 0.6;
/// The most hours that are looked at for the warning.
pub(super) const HOURS: usize = 200;
/// Fraction of the captors and groups from which on a warning names them.
pub(super) const MANY: f64 = 0.05;

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
