//! Spectra of lamps and daylight that are at hand under a name.
//!
//! `known.csv` holds illuminants and lamps of CIE 15:2018 (*Colorimetry*, 4th edition), each
//! relative to a scale of its own. The spectra of daylight are those of ASTM G173-03.

use std::sync::LazyLock;

use crate::{
    math::curve::Curve,
    scene::daylight::{DaylightSource, standard_spectrum},
};

/// Diodes by formula: name, and for each of their peaks the wavelength, the full width at half of
/// the maximum, both in nm, and the height.
///
/// A peak narrower than 50 nm is that of a diode after Ohno (2005, Optical Engineering 44, 111302);
/// a wider one is a phosphor's, a Gaussian.
const DIODES: [(&str, &[[f64; 3]]); 4] = [
    ("LED-blue-450", &[[450.0, 20.0, 1.0]]),
    ("LED-red-660", &[[660.0, 20.0, 1.0]]),
    ("LED-far-red-730", &[[730.0, 25.0, 1.0]]),
    ("LED-white-450-580", &[[450.0, 20.0, 1.0], [580.0, 130.0, 0.6]]),
];

/// The part of its peak below which a diode by formula is dark.
const DARK: f64 = 1e-9;

/// Full width at half of the maximum of Ohno's peak, in units of its parameter.
const OHNO: f64 = 0.921_82;

/// Cosine of the angle between the sun and the normal of the plane that the standard's global
/// spectrum falls on.
const G173_COS: f64 = 0.980_99;

static KNOWN: LazyLock<Vec<(&'static str, Curve)>> = LazyLock::new(|| {
    let mut lines = include_str!("known.csv").lines();
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').skip(1).collect();
    let mut points = vec![Vec::new(); names.len()];
    for line in lines {
        let mut cells = line.split(',').map(|cell| cell.parse::<f64>().ok());
        let nm = cells.next().flatten().expect("a wavelength");
        // where a table does not reach, its cell is empty
        for (points, value) in points.iter_mut().zip(cells) {
            points.extend(value.map(|value| [nm, value]));
        }
    }
    let diode = |peaks: &'static [[f64; 3]]| {
        (600..=1800).map(move |step| {
            let nm = 0.5 * f64::from(step);
            let of_peak = |&[peak, width, height]: &[f64; 3]| {
                let place = (nm - peak) / width;
                height
                    * if width < 50.0 {
                        let g = (-(OHNO * place).powi(2)).exp();
                        (g + 2.0 * g.powi(5)) / 3.0
                    } else {
                        (-4.0 * std::f64::consts::LN_2 * place * place).exp()
                    }
            };
            let value: f64 = peaks.iter().map(of_peak).sum();
            // far from its peaks a diode is dark, and not only nearly so
            [nm, if value < DARK { 0.0 } else { value }]
        })
    };
    let daylight = |sun: f64, sky: f64| {
        let [sun_at, sky_at] = [DaylightSource::Sun, DaylightSource::Sky].map(standard_spectrum);
        let both = sun_at.into_iter().zip(sky_at);
        both.map(move |([nm, direct], [_, diffuse])| [nm, sun * direct + sky * diffuse])
    };
    let curve = |points: Vec<[f64; 2]>| Curve::new(points).expect("wavelengths that rise");
    names
        .into_iter()
        .zip(points)
        .chain(DIODES.iter().map(|&(name, peaks)| (name, diode(peaks).collect())))
        .chain([
            ("AM1.5G", daylight(G173_COS, 1.0).collect()),
            ("AM1.5-direct", daylight(1.0, 0.0).collect()),
            ("AM1.5-diffuse", daylight(0.0, 1.0).collect()),
        ])
        .map(|(name, points)| (name, curve(points)))
        .collect()
});

/// Returns a spectrum by its name: energy per nm against wavelength in nm, on any scale. There are
/// illuminants and lamps of the CIE (`D65`, `HP1`, `LED-B3`, ...), diodes by formula
/// (`LED-red-660`, ...) and the daylight of ASTM G173 (`AM1.5G`, ...).
pub fn known_spectrum(name: &str) -> Option<&'static Curve> {
    KNOWN.iter().find(|(known, _)| *known == name).map(|(_, curve)| curve)
}

/// Returns the names of all spectra that [`known_spectrum`] knows.
pub fn known_spectra() -> impl Iterator<Item = &'static str> + Clone {
    KNOWN.iter().map(|(name, _)| *name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::curve::integral;

    fn total(curve: &Curve, from: f64, to: f64, weight: impl Fn(f64) -> f64) -> f64 {
        integral(from, to, curve.places(), |nm| curve.at(nm) * weight(nm))
    }

    /// Illuminant A is a Planckian radiator of 2856 K, D65 is 100 at 560 nm, and the low-pressure
    /// and high-pressure lamps have their lines.
    #[test]
    fn tables_are_those_of_their_lamps() {
        let planck = |nm: f64| nm.powi(-5) / ((1.435e7 / (nm * 2848.0)).exp() - 1.0);
        let a = known_spectrum("A").unwrap();
        for nm in [300.0, 420.0, 560.0, 700.0, 780.0] {
            let exact = 100.0 * planck(nm) / planck(560.0);
            assert!((a.at(nm) - exact).abs() < 2e-4 * exact, "{nm}: {}, not {exact}", a.at(nm));
        }
        assert_eq!(known_spectrum("D65").unwrap().at(560.0), 100.0);
        let highest = |name: &str| {
            let curve = known_spectrum(name).unwrap();
            let by_value = |a: &&f64, b: &&f64| curve.at(**a).total_cmp(&curve.at(**b));
            *curve.places().iter().max_by(by_value).unwrap()
        };
        assert_eq!([highest("FL11"), highest("HP1"), highest("LED-B5")], [545.0, 595.0, 450.0]);
        assert_eq!(known_spectrum("FL2").unwrap().range(), [380.0, 780.0]);
        assert!(known_spectrum("D66").is_none() && known_spectra().count() > 20);
    }

    /// A diode's peak has the width that its name or the table says, and the standard's daylight has
    /// its total: 1000.4 W/m2 of global, 900.1 W/m2 of direct light.
    #[test]
    fn formulas_have_their_widths_and_daylight_its_totals() {
        for (name, peak, half) in [("LED-red-660", 660.0, 10.0), ("LED-blue-450", 450.0, 10.0)] {
            let curve = known_spectrum(name).unwrap();
            let middle = total(curve, 300.0, 900.0, |nm| nm) / total(curve, 300.0, 900.0, |_| 1.0);
            assert!((middle - peak).abs() < 0.1, "{name}: {middle}");
            for side in [peak - half, peak + half] {
                assert!((curve.at(side) / curve.at(peak) - 0.5).abs() < 1e-3, "{name} at {side}");
            }
        }
        for (name, watts) in [("AM1.5G", 1000.4), ("AM1.5-direct", 900.1)] {
            let curve = known_spectrum(name).unwrap();
            let found = total(curve, 280.0, 4000.0, |_| 1.0);
            assert!((found / watts - 1.0).abs() < 2e-3, "{name}: {found}");
        }
    }
}
