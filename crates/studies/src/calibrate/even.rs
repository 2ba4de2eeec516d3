//! Powers of lamps that light captors evenly, or that bring each captor a least irradiance.
//!
//! Light is linear in the powers: captor i has Σ_l f_l x_il of lamps l with factors f_l. The
//! coefficient of variation does not depend on a common factor. It is least for the f >= 0 that
//! minimise Σ_i a_i (1 - Σ_l f_l x_il)², with areas a_i: of all multiples of one f, the best leaves
//! CV² / (1 + CV²) of Σ a_i there. The least power for a minimum is a linear program.

use std::collections::BTreeMap;

use super::{Lamps, by_lamp, some};
use phylux_core::{
    error::{Error, Result, nearest, setting},
    math::{least_squares::nonnegative, linear_program::least_cost, pattern},
    words,
};
use phylux_files::input::quoted;
use phylux_results::{
    calibration::{EvenPowers, Lit},
    result::{ByLight, CaptorResult, Energy, Evenness, RunResult},
};

/// With fewer captors than this for each lamp there is a warning.
const FEW_CAPTORS: usize = 2;
/// Standard error of a captor over its irradiance, as a part of the coefficient of variation that
/// was found, above which there is a warning.
const LOUD: f64 = 0.5;

/// The options of an even lighting.
#[derive(Clone, Debug, Default)]
pub struct EvenPlan {
    /// Pattern of the names of groups, or of the ids of captors, whose fronts are to be lit.
    pub captors: String,
    /// Name of the band or sum; `None` for the only band, or the first sum.
    pub band: Option<String>,
    /// The mean irradiance; `None` for the present one.
    pub mean: Option<f64>,
    /// The least irradiance of a captor, which is to be reached with the least power, in place of
    /// even light.
    pub minimum: Option<f64>,
    /// Patterns of names of lights. The lights that fit one pattern share a factor.
    pub groups: Vec<String>,
}

/// Finds factors on the powers of the lights. `result` is a run that is split by light; `watts` are
/// the electric powers of lights, as far as they are known. Errors: results that are not split, no
/// such captor or band, captors that no light reaches.
pub fn even(
    result: &RunResult,
    watts: &BTreeMap<String, f64>,
    plan: &EvenPlan,
) -> Result<EvenPowers> {
    let lights = result.energy_by_light()?;
    let names: Vec<&str> = lights.keys().map(String::as_str).collect();
    let lamps = Lamps::new(&names, &plan.groups)?;
    let band = band_of(result, plan)?;
    let captors = captors_of(result, &plan.captors)?;
    let found: Vec<Vec<f64>> = captors
        .iter()
        .map(|captor| by_lamp(&captor.front, &lamps, &[(band, 1.0)])[0].clone())
        .collect();
    let bands = result.own_bands();
    let powers = Powers::new(lights, watts, bands.len());
    let factors = match plan.minimum {
        Some(least) => {
            let mut costs = vec![0.0; lamps.names.len()];
            for (light, &lamp) in names.iter().zip(&lamps.of_light) {
                costs[lamp] += powers.cost(light);
            }
            least_power(&captors, &found, &costs, least)?
        }
        None => {
            let areas: Vec<f64> = captors.iter().map(|captor| captor.area).collect();
            evenest(&found, &areas, plan)?
        }
    };
    let of_lights: ByLight<f64> = names
        .iter()
        .zip(&lamps.of_light)
        .map(|(light, &lamp)| (light.to_string(), factors[lamp]))
        .collect();
    let mixed = result.mix(&of_lights)?;
    let lit = captors_of(&mixed, &plan.captors)?;
    let no_captor = || Error::input(&result.scene, "has no such captor");
    let before = powers.lit(&captors, band, |_| 1.0).ok_or_else(no_captor)?;
    let after = powers.lit(&lit, band, |light| of_lights[light]).ok_or_else(no_captor)?;
    Ok(EvenPowers {
        phylux: env!("CARGO_PKG_VERSION").into(),
        scene: result.scene.clone(),
        captors: plan.captors.clone(),
        count: captors.len(),
        band: result.bands[band].name.clone(),
        mean: plan.minimum.is_none().then_some(plan.mean.unwrap_or(before.mean)),
        minimum: plan.minimum,
        bands: bands.iter().map(|band| band.name.clone()).collect(),
        warnings: warnings(&lamps, &factors, &lit, band, plan, &after),
        factors: of_lights
            .into_iter()
            .map(|(light, factor)| (light, vec![factor; bands.len()]))
            .collect(),
        before,
        after,
    })
}

/// What the lights of a run take.
struct Powers<'a> {
    lights: &'a ByLight<Energy>,
    watts: &'a BTreeMap<String, f64>,
    /// The number of bands.
    bands: usize,
    /// Whether the electric power of every light that shines is known.
    all_metered: bool,
}

impl<'a> Powers<'a> {
    fn new(lights: &'a ByLight<Energy>, watts: &'a BTreeMap<String, f64>, bands: usize) -> Self {
        let mut powers = Self { lights, watts, bands, all_metered: true };
        let is_metered = |light: &String| watts.contains_key(light) || powers.radiant(light) == 0.0;
        powers.all_metered = lights.keys().all(is_metered);
        powers
    }

    /// Returns the light of a light, over all bands.
    fn radiant(&self, light: &str) -> f64 {
        self.lights[light].power.iter().take(self.bands).sum()
    }

    /// Returns the electric power of a light, 0 where it is not known.
    fn electric(&self, light: &str) -> f64 {
        self.watts.get(light).copied().unwrap_or(0.0)
    }

    /// Returns the power of a light that is to be small: the electric one where all are known.
    fn cost(&self, light: &str) -> f64 {
        if self.all_metered { self.electric(light) } else { self.radiant(light) }
    }

    /// Returns how the captors are lit in a band with this factor on the power of each light;
    /// `None` for no captor.
    fn lit(
        &self,
        captors: &[&CaptorResult],
        band: usize,
        factor: impl Fn(&str) -> f64,
    ) -> Option<Lit> {
        let values = captors.iter().map(|captor| {
            let face = &captor.front;
            (face.irradiance[band], face.irradiance_se[band], captor.area)
        });
        let Evenness { mean, min, cv } = Evenness::of(values)?;
        let lights = || self.lights.keys().map(|light| (light, factor(light)));
        let watts = || lights().map(|(light, factor)| factor * self.electric(light)).sum();
        Some(Lit {
            mean: mean.0,
            mean_se: mean.1,
            min: min.0,
            min_se: min.1,
            cv: cv.map(|(cv, _)| cv),
            cv_se: cv.and_then(|(_, error)| error),
            power: lights().map(|(light, factor)| factor * self.radiant(light)).sum(),
            watts: self.all_metered.then(watts),
        })
    }
}

fn band_of(result: &RunResult, plan: &EvenPlan) -> Result<usize> {
    let names = || result.bands.iter().map(|band| band.name.as_str());
    let listed = || names().take(20).collect::<Vec<_>>().join(", ");
    match &plan.band {
        Some(name) => names().position(|band| band == name).ok_or_else(|| {
            let error = Error::input(setting("band"), format!("no band or sum {}", quoted(name)));
            error.did_you_mean(nearest(name, names()), format!("there are {}", listed()))
        }),
        None if result.bands.len() == 1 => Ok(0),
        None => result.bands.iter().position(|band| band.sum_of.is_some()).ok_or_else(|| {
            Error::input(setting("even"), "there are several bands, and no sum of them")
                .remedy(words![format!("name one of {} with ", listed()), setting("band")])
        }),
    }
}

/// Returns the captors of the groups that fit the pattern or, where no group does, the captors that
/// do.
fn captors_of<'a>(result: &'a RunResult, pattern: &str) -> Result<Vec<&'a CaptorResult>> {
    let fits = |name: &String| pattern::fits(pattern, name);
    let in_groups = |captor: &&CaptorResult| captor.groups.iter().flatten().any(fits);
    let mut captors: Vec<&CaptorResult> = result.captors.iter().filter(in_groups).collect();
    if captors.is_empty() {
        captors = result.captors.iter().filter(|captor| fits(&captor.id)).collect();
    }
    if captors.is_empty() {
        let problem = format!("no group and no captor is like {}", quoted(pattern));
        let error = Error::input(setting("even"), problem);
        let groups: Vec<&str> =
            result.groups.iter().take(20).map(|group| group.id.as_str()).collect();
        return Err(error.remedy(format!(
            "`*` stands for any characters; there are the groups {}",
            groups.join(", ")
        )));
    }
    Ok(captors)
}

/// Returns the factors with which the mean irradiance is that of the plan, and its relative
/// deviations are least.
fn evenest(found: &[Vec<f64>], areas: &[f64], plan: &EvenPlan) -> Result<Vec<f64>> {
    let lamps = found.first().map_or(0, Vec::len);
    let area: f64 = areas.iter().sum();
    let mean_of = |factors: &[f64]| {
        let of = |row: &Vec<f64>| row.iter().zip(factors).map(|(x, f)| x * f).sum::<f64>();
        found.iter().zip(areas).map(|(row, own)| own / area * of(row)).sum::<f64>()
    };
    let present = mean_of(&vec![1.0; lamps]);
    if present <= 0.0 {
        return Err(Error::input(setting("even"), "no light comes to these captors")
            .remedy("check where they are and which way they face, and trace more photons"));
    }
    // in units of the present mean, so that the numbers are near 1
    let mut normal = vec![vec![0.0; lamps]; lamps];
    let mut target = vec![0.0; lamps];
    for (row, own) in found.iter().zip(areas) {
        let row: Vec<f64> = row.iter().map(|x| x / present).collect();
        for (i, a) in row.iter().enumerate() {
            target[i] += own / area * a;
            normal[i].iter_mut().zip(&row).for_each(|(n, b)| *n += own / area * a * b);
        }
    }
    let mut factors = vec![1.0; lamps];
    nonnegative(&normal, &target, &mut factors);
    let unlit: Vec<bool> = (0..lamps).map(|l| normal[l][l] <= 0.0).collect();
    let scale = plan.mean.unwrap_or(present) / mean_of(&factors);
    // a lamp that these captors do not see stays as it is
    Ok(factors.iter().zip(unlit).map(|(f, unlit)| if unlit { 1.0 } else { f * scale }).collect())
}

/// Returns the factors that bring every captor at least this irradiance at the least cost.
fn least_power(
    captors: &[&CaptorResult],
    found: &[Vec<f64>],
    costs: &[f64],
    least: f64,
) -> Result<Vec<f64>> {
    let dark = captors.iter().zip(found).find(|(_, row)| row.iter().all(|x| *x <= 0.0));
    if let Some((captor, _)) = dark {
        let problem = format!("no light comes to captor {}", quoted(&captor.id));
        return Err(Error::input(setting("minimum"), problem)
            .remedy("leave it out, add a lamp that reaches it, or trace more photons"));
    }
    let largest = costs.iter().copied().fold(0.0, f64::max);
    // in units of the largest cost and of the least light, so that the numbers are near 1; a lamp
    // that costs nothing still has a price, so that it does not shine without bounds
    let cost = |cost: &f64| if largest > 0.0 { (cost / largest).max(1e-9) } else { 1.0 };
    let costs: Vec<f64> = costs.iter().map(cost).collect();
    let rows = found.iter().map(|row| row.iter().map(|x| (x / least).max(0.0)).collect());
    least_cost(&rows.collect::<Vec<Vec<f64>>>(), &costs).ok_or_else(|| {
        Error::run(setting("minimum"), "the least powers were not found").remedy(words![
            "join lamps by ",
            setting("group"),
            ", or ask for a ",
            setting("mean")
        ])
    })
}

fn warnings(
    lamps: &Lamps,
    factors: &[f64],
    captors: &[&CaptorResult],
    band: usize,
    plan: &EvenPlan,
    after: &Lit,
) -> Vec<String> {
    let mut warnings = Vec::new();
    if plan.minimum.is_none() && captors.len() < FEW_CAPTORS * lamps.names.len() {
        warnings.push(format!(
            "{} captors for {} lamps, fewer than {FEW_CAPTORS} for each: the light between the captors may be less \
            even than on them; add captors, or join lamps in groups",
            captors.len(),
            lamps.names.len()
        ));
    }
    let off: Vec<String> = lamps
        .names
        .iter()
        .zip(factors)
        .filter(|(_, factor)| **factor == 0.0)
        .map(|(name, _)| format!("`{name}`"))
        .collect();
    if !off.is_empty() {
        warnings.push(format!("lamps that are best switched off: {}", some(&off)));
    }
    let mut errors: Vec<f64> = captors
        .iter()
        .filter_map(|captor| {
            Some(captor.front.irradiance_se[band]? / captor.front.irradiance[band])
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    let usual = errors.get(errors.len() / 2).copied().unwrap_or(0.0);
    if plan.minimum.is_none() && after.cv.is_some_and(|cv| usual > LOUD * cv) {
        warnings.push(format!(
            "the errors of the captors ({:.2} % at the median) are not small beside their differences, so that the \
            powers follow noise; trace more photons (docs/calibration.md#even-light---even)",
            100.0 * usual
        ));
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two lamps whose light adds up to 2 everywhere if both have the factor 1, and a third that
    /// only disturbs: it is switched off, whatever the areas are.
    #[test]
    fn the_evenest_light_is_found() {
        let found = vec![
            vec![0.5, 1.5, 3.0],
            vec![1.0, 1.0, 0.0],
            vec![1.5, 0.5, 0.0],
            vec![0.2, 1.8, 0.0],
        ];
        for areas in [[1.0; 4], [1.0, 2.0, 3.0, 0.5]] {
            let plan = EvenPlan { mean: Some(10.0), ..EvenPlan::default() };
            let factors = evenest(&found, &areas, &plan).unwrap();
            assert!((factors[0] - 5.0).abs() < 1e-9 && (factors[1] - 5.0).abs() < 1e-9);
            assert!(factors[2].abs() < 1e-9, "{factors:?}");
        }
        let unseen = vec![vec![1.0, 0.0], vec![2.0, 0.0]];
        let factors = evenest(&unseen, &[1.0, 1.0], &EvenPlan::default()).unwrap();
        assert!((factors[0] - 1.0).abs() < 1e-12 && factors[1] == 1.0);
        assert!(evenest(&[vec![0.0]], &[1.0], &EvenPlan::default()).is_err());
    }
}
