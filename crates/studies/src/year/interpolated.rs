//! How far off the light of single hours may be besides what its photons say: its scattered sunlight
//! is mixed with that of hours about them, and few photons may make it up. Sums over the period do not
//! suffer, because bundles hold each hour once in all, and because they have the photons of all hours.

use super::{part::Part, responses::Responses};
use phylux_files::scene_file::HourlyLight;

/// Ratio of the error of an hour to the mean difference of its bundles to what the bundles beside
/// them let expect. If light changed with the place of the sun as a parabola does, it would be 1/3;
/// at edges of shadows it is larger. With this factor the mean square of the deviations over their
/// errors was 0.9, for 89 hours of sensors behind a window.
pub(super) const FACTOR: f64 = 0.6;
/// The most hours that are looked at for the warning.
pub(super) const HOURS: usize = 200;
/// Fraction of the captors and groups from which on a warning names them.
pub(super) const MANY: f64 = 0.05;

/// Returns for each light, at each place, by how much its light differs from a guess by the lights
/// beside it, beyond what noise explains. The list is empty for lights that stand alone.
pub(super) fn bends(hourly: &[HourlyLight], responses: &Responses) -> Vec<Vec<f64>> {
    let lights = hourly.iter().map(|light| light.light + 1).max().unwrap_or(0);
    let mut bends = vec![Vec::new(); lights.max(responses.lights())];
    for light in hourly.iter().filter(|light| !light.beside.is_empty()) {
        let mut squares = vec![0.0; responses.means_of(light.light).len()];
        for beside in &light.beside {
            let of = |light| (responses.means_of(light), responses.variances_of(light));
            let own = of(light.light);
            let [(a, in_a), (b, in_b)] = beside.from.map(|(other, share)| (of(other), share));
            for (place, sum) in squares.iter_mut().enumerate() {
                let off = own.0[place] - in_a * a.0[place] - in_b * b.0[place];
                let noise = own.1[place] + in_a * in_a * a.1[place] + in_b * in_b * b.1[place];
                *sum += beside.scale.powi(2) * (off * off - noise).max(0.0);
            }
        }
        bends[light.light] = squares.into_iter().map(f64::sqrt).collect();
    }
    bends
}

/// Returns for each place what a photon brings there that arrives, over the power with which it sets out
/// from its light: the mean over the photons of all lights, 0 where none arrived.
pub(super) fn of_a_photon(part: &Part, responses: &Responses) -> Vec<f64> {
    let mut sums = vec![[0.0; 2]; responses.width()];
    for (light, &power) in part.photon.iter().enumerate().filter(|(_, power)| **power > 0.0) {
        let (means, variances) = (responses.means_of(light), responses.variances_of(light));
        for (sums, (mean, variance)) in sums.iter_mut().zip(means.iter().zip(variances)) {
            // n photons that bring e each have the mean n e and the variance n e^2
            sums[0] += variance / power;
            sums[1] += mean;
        }
    }
    sums.into_iter().map(|[squares, sum]| if sum > 0.0 { squares / sum } else { 0.0 }).collect()
}

impl Part<'_> {
    /// Returns the largest power, in the strength that its light has in a slot, with which a photon sets
    /// out.
    pub(super) fn largest_photon(&self, slot: usize) -> f64 {
        let lights = self.weights[slot].iter();
        lights.map(|&(light, strength)| strength * self.photon[light]).fold(0.0, f64::max)
    }
}
