//! Weightings of light by its wavelength: what the eye, photosynthesis and phytochrome make of it.
//!
//! A band of a scene has no spectrum of its own within it. Its light is taken to be flat: the same
//! in each nm, in the quantity that the scene counts.

use super::{
    curve::integral,
    luminosity::{LM_PER_W, luminosity},
    phytochrome::{MANCINELLI, SAGER},
    units::{Quantity, UMOL_PER_J_NM},
};

/// What a weighted sum is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WeightedUnit {
    /// Luminous flux, lm.
    Lumen,
    /// Photon flux, umol/s, also where the scene counts W.
    Photons,
    /// Radiant flux, W, also where the scene counts umol/s.
    Watts,
}

impl WeightedUnit {
    /// Returns the units of flux and of flux per area.
    pub fn names(self) -> [&'static str; 2] {
        match self {
            Self::Lumen => ["lm", "lx"],
            Self::Photons => ["umol/s", "umol/m2/s"],
            Self::Watts => ["W", "W/m2"],
        }
    }
}

/// A weighting of light by its wavelength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weighting {
    /// Lumens: V of the CIE, 683 lm/W at 555 nm.
    Photopic,
    /// Photons between two wavelengths, nm.
    Photons(f64, f64),
    /// Energy between two wavelengths, nm.
    Energy(f64, f64),
    /// Photons by the table of a weight per photon: linear between its points, 0 beyond its ends.
    Table(&'static [[f64; 2]]),
}

impl Weighting {
    /// Returns what the sum is measured in.
    pub fn unit(self) -> WeightedUnit {
        match self {
            Self::Photopic => WeightedUnit::Lumen,
            Self::Photons(..) | Self::Table(_) => WeightedUnit::Photons,
            Self::Energy(..) => WeightedUnit::Watts,
        }
    }

    /// Returns the wavelengths beyond which the weight is 0, nm.
    pub fn range(self) -> [f64; 2] {
        match self {
            Self::Photopic => [380.0, 780.0],
            Self::Photons(from, to) | Self::Energy(from, to) => [from, to],
            Self::Table(points) => [points[0][0], points[points.len() - 1][0]],
        }
    }

    /// Returns the weight at a wavelength, nm: of a photon where the weighting is one of photons, else
    /// of 1 W.
    pub fn at(self, nm: f64) -> f64 {
        let [from, to] = self.range();
        match self {
            _ if !(from..=to).contains(&nm) => 0.0,
            Self::Photopic => LM_PER_W * luminosity(nm),
            Self::Photons(..) | Self::Energy(..) => 1.0,
            Self::Table(points) => {
                let i = points.partition_point(|[at, _]| *at <= nm).clamp(1, points.len() - 1);
                let ([a, low], [b, high]) = (points[i - 1], points[i]);
                low + (high - low) * (nm - a) / (b - a)
            }
        }
    }

    /// Returns the weight of light that is spread evenly over a band, per unit of `quantity`.
    pub fn of_band(self, [from, to]: [f64; 2], quantity: Quantity) -> f64 {
        let [first, last] = self.range();
        let (start, end) = (from.max(first), to.min(last));
        if start >= end {
            return 0.0;
        }
        let per_unit = |nm: f64| match (self.unit(), quantity) {
            (WeightedUnit::Lumen | WeightedUnit::Watts, Quantity::Watt)
            | (WeightedUnit::Photons, Quantity::Micromole) => self.at(nm),
            (WeightedUnit::Lumen | WeightedUnit::Watts, Quantity::Micromole) => {
                self.at(nm) / (nm * UMOL_PER_J_NM)
            }
            (WeightedUnit::Photons, Quantity::Watt) => self.at(nm) * nm * UMOL_PER_J_NM,
        };
        integral(start, end, &self.knots(), per_unit) / (to - from)
    }

    /// Returns the integral of the weights between two wavelengths, nm.
    pub fn between(self, from: f64, to: f64) -> f64 {
        integral(from, to, &self.knots(), |nm| self.at(nm))
    }

    /// Returns the wavelengths between which the weight is smooth, nm.
    fn knots(self) -> Vec<f64> {
        match self {
            // the points of the table of V
            Self::Photopic => (0..=80).map(|i| 380.0 + 5.0 * f64::from(i)).collect(),
            Self::Photons(from, to) | Self::Energy(from, to) => vec![from, to],
            Self::Table(points) => points.iter().map(|[nm, _]| *nm).collect(),
        }
    }

    /// Returns the least and the largest weight within a band, over the largest of all.
    pub fn extremes(self, [from, to]: [f64; 2]) -> [f64; 2] {
        let values = |[from, to]: [f64; 2]| {
            const STEPS: u32 = 200;
            let step = (to - from) / f64::from(STEPS);
            (0..STEPS).map(move |i| self.at(from + (f64::from(i) + 0.5) * step))
        };
        let most = values(self.range()).fold(0.0, f64::max);
        let [least, largest] =
            values([from, to]).fold([f64::INFINITY, 0.0], |[a, b], v| [a.min(v), b.max(v)]);
        [least / most, largest / most]
    }
}

/// The weightings of sums that have a name.
pub const SUMS: [(&str, Weighting); 5] = [
    ("photopic", Weighting::Photopic),
    ("PPF", Weighting::Photons(400.0, 700.0)),
    ("ePAR", Weighting::Photons(400.0, 750.0)),
    ("YPF", Weighting::Table(&YIELD)),
    ("YPF-chamber", Weighting::Table(&YIELD_CHAMBER)),
];

/// The ratios that have a name: of light weighted in one way over light weighted in ways that are
/// added up.
pub const RATIOS: [(&str, Weighting, &[Weighting]); 5] = [
    ("R:FR", Weighting::Photons(655.0, 665.0), &[Weighting::Photons(725.0, 735.0)]),
    ("R:FR-broad", Weighting::Photons(600.0, 700.0), &[Weighting::Photons(700.0, 800.0)]),
    ("blue-share", Weighting::Photons(400.0, 500.0), &[Weighting::Photons(400.0, 700.0)]),
    (
        "PSS",
        Weighting::Table(SAGER.to_pfr),
        &[Weighting::Table(SAGER.to_pfr), Weighting::Table(SAGER.to_pr)],
    ),
    (
        "PSS-Mancinelli",
        Weighting::Table(MANCINELLI.to_pfr),
        &[Weighting::Table(MANCINELLI.to_pfr), Weighting::Table(MANCINELLI.to_pr)],
    ),
];

/// Action of a photon in photosynthesis, relative to 625 nm: the mean over species grown in the
/// field (McCree 1972, Agricultural Meteorology 9, 191-216, tables III and IV).
const YIELD: [[f64; 2]; 16] = [
    [350.0, 0.02],
    [375.0, 0.12],
    [400.0, 0.42],
    [425.0, 0.68],
    [450.0, 0.70],
    [475.0, 0.63],
    [500.0, 0.65],
    [525.0, 0.72],
    [550.0, 0.82],
    [575.0, 0.91],
    [600.0, 0.97],
    [625.0, 1.00],
    [650.0, 0.90],
    [675.0, 0.90],
    [700.0, 0.48],
    [725.0, 0.23],
];

/// The same for plants from growth chambers.
const YIELD_CHAMBER: [[f64; 2]; 16] = [
    [350.0, 0.16],
    [375.0, 0.45],
    [400.0, 0.66],
    [425.0, 0.76],
    [450.0, 0.75],
    [475.0, 0.68],
    [500.0, 0.71],
    [525.0, 0.74],
    [550.0, 0.87],
    [575.0, 0.95],
    [600.0, 1.00],
    [625.0, 1.00],
    [650.0, 0.94],
    [675.0, 0.92],
    [700.0, 0.44],
    [725.0, 0.20],
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Direct sums in steps of 0.001 nm, written out here, of light that is flat over a band.
    fn direct(of: impl Fn(f64) -> f64, [from, to]: [f64; 2]) -> f64 {
        const STEPS: u32 = 400_000;
        let step = (to - from) / f64::from(STEPS);
        (0..STEPS).map(|i| of(from + (f64::from(i) + 0.5) * step)).sum::<f64>() / f64::from(STEPS)
    }

    #[test]
    fn weights_of_bands_are_means_of_the_tables() {
        let photon = |nm: f64| nm / 119.626_566; // umol in 1 J
        let bands =
            [[400.0, 500.0], [580.0, 720.0], [300.0, 800.0], [655.0, 665.0], [412.0, 413.0]];
        for (name, weighting) in SUMS {
            for band in bands {
                let lumen = weighting.unit() == WeightedUnit::Lumen;
                let watt = |nm: f64| weighting.at(nm) * if lumen { 1.0 } else { photon(nm) };
                let umol = |nm: f64| weighting.at(nm) / if lumen { photon(nm) } else { 1.0 };
                let found =
                    [Quantity::Watt, Quantity::Micromole].map(|q| weighting.of_band(band, q));
                for (found, direct) in
                    found.into_iter().zip([direct(watt, band), direct(umol, band)])
                {
                    assert!(
                        (found - direct).abs() < 2e-6 * direct + 1e-12,
                        "{name} {band:?}: {found}, {direct}"
                    );
                }
            }
        }
    }

    /// Known values: 1 W at 555 nm is 683 lm; of flat light from 400 to 700 nm 1 J has 4.598 umol;
    /// photons beyond a window count for nothing; phytochrome in light of 660 and 730 nm.
    #[test]
    fn known_values() {
        let narrow = |nm: f64| [nm - 1e-3, nm + 1e-3];
        let photopic = Weighting::Photopic.of_band(narrow(555.0), Quantity::Watt);
        assert!((photopic - 683.0).abs() < 0.05, "{photopic}");
        let ppf = Weighting::Photons(400.0, 700.0);
        assert!((ppf.of_band([400.0, 700.0], Quantity::Watt) - 4.598).abs() < 5e-4);
        assert!((ppf.of_band([650.0, 750.0], Quantity::Micromole) - 0.5).abs() < 1e-12);
        assert_eq!(ppf.of_band([700.0, 800.0], Quantity::Micromole), 0.0);
        let pss = |ratio: usize, nm: f64| {
            let (_, over, under) = RATIOS[ratio];
            over.at(nm) / under.iter().map(|weighting| weighting.at(nm)).sum::<f64>()
        };
        assert!((pss(3, 660.0) - 5250.0 / 5884.0).abs() < 1e-12);
        assert!((pss(3, 731.0) - 80.8 / (80.8 + 1505.0)).abs() < 1e-12);
        assert!((pss(4, 660.0) - 4963.0 / 5706.9).abs() < 1e-12);
        assert!((pss(4, 730.0) - 35.53 / 1736.53).abs() < 1e-12);
        let yields = SUMS.map(|(_, weighting)| weighting.at(612.5));
        assert!((yields[3] - 0.985).abs() < 1e-12 && (yields[4] - 1.0).abs() < 1e-12);
        assert_eq!([SUMS[3].1.at(349.9), SUMS[3].1.at(725.1)], [0.0, 0.0]);
    }
}
