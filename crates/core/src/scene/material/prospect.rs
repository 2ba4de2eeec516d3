//! PROSPECT-D: reflectance and transmittance of a leaf from what it is made of.
//!
//! The model is that of Féret, Gitelson, Noble and Jacquemoud (2017, Remote Sensing of Environment
//! 193, 204-215), after Jacquemoud and Baret (1990): N layers of leaf tissue, each a plate that
//! absorbs, with rough faces inside the leaf. The coefficients of absorption and the index of
//! refraction in `prospect.csv` are those that its authors published.

use std::{f64::consts::PI, sync::LazyLock};

use crate::{
    error::{Problem, Result, check_range},
    math::curve::Curve,
};

/// What a leaf is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prospect {
    /// Structure parameter N: the number of layers, from 1 (a compact leaf) to 10; 1.2 to 2.5 in
    /// most leaves. It need not be whole.
    pub n: f64,
    /// Chlorophyll a and b, ug/cm2.
    pub chlorophyll: f64,
    /// Carotenoids, ug/cm2.
    pub carotenoids: f64,
    /// Anthocyanins, ug/cm2.
    pub anthocyanins: f64,
    /// Brown pigments, in arbitrary units, from 0 (none) to about 1.
    pub brown: f64,
    /// Water, as the thickness of its layer, cm (the same as g/cm2).
    pub water: f64,
    /// Dry matter, g/cm2.
    pub dry_matter: f64,
}

/// What an integrating sphere measures of a leaf near normal incidence, from 400 to 2500 nm.
#[derive(Clone, Debug, PartialEq)]
pub struct LeafSpectra {
    /// Reflectance against wavelength in nm, the surface's reflection included.
    pub reflectance: Curve,
    /// Transmittance against wavelength in nm.
    pub transmittance: Curve,
}

/// A row of the table of coefficients: wavelength in nm, index of refraction, and the absorption by
/// a unit of chlorophyll, carotenoids, anthocyanins, brown pigments, water and dry matter.
type Row = [f64; 8];

/// The table of coefficients, one row for each nm from 400 to 2500.
static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| {
    let lines = include_str!("prospect.csv").lines().skip(1);
    let row = |line: &str| {
        let mut cells = line.split(',').map(|cell| cell.parse().expect("a number"));
        std::array::from_fn(|_| cells.next().expect("eight cells"))
    };
    lines.map(row).collect()
});

/// Largest angle of incidence of light that comes to the leaf, degrees: the model takes its
/// surface for rough, so that light meets it at all angles up to this one.
const ROUGHNESS_DEG: f64 = 40.0;

impl Prospect {
    /// Computes the leaf's spectra, at each nm from 400 to 2500.
    ///
    /// # Errors
    ///
    /// `n` is not from 1 to 10, or an amount is negative or not finite. The place of the error is
    /// the name of the field.
    pub fn spectra(&self) -> Result<LeafSpectra> {
        let amounts = [
            ("chlorophyll", self.chlorophyll),
            ("carotenoids", self.carotenoids),
            ("anthocyanins", self.anthocyanins),
            ("brown", self.brown),
            ("water", self.water),
            ("dry_matter", self.dry_matter),
        ];
        check_range(self.n, 1.0, 10.0).map_err(|problem| problem.at("n"))?;
        for (name, amount) in amounts {
            check_range(amount, 0.0, f64::MAX).map_err(|problem| problem.at(name))?;
        }
        let of_row = |row: &Row| {
            let absorbed: f64 = amounts.iter().zip(&row[2..]).map(|((_, a), k)| a * k).sum();
            (row[0], self.at(row[1], absorbed / self.n))
        };
        let values: Vec<(f64, [f64; 2])> = ROWS.iter().map(of_row).collect();
        let curve = |i: usize| {
            let points = values.iter().map(|&(nm, both)| [nm, both[i]]);
            Curve::new(points).map_err(|problem: Problem| problem.at("n"))
        };
        Ok(LeafSpectra { reflectance: curve(0)?, transmittance: curve(1)? })
    }

    /// Returns reflectance and transmittance at one wavelength, from the index of refraction and
    /// the absorption coefficient of a layer (times its thickness).
    fn at(&self, index: f64, absorption: f64) -> [f64; 2] {
        // one layer: diffuse light passes its inside, between two rough faces
        let inside = diffuse_transmittance(absorption);
        let entering = isotropic_transmittance(ROUGHNESS_DEG, index);
        let into = isotropic_transmittance(90.0, index);
        let out = into / (index * index);
        let back = 1.0 - out;
        let repeated = 1.0 / (1.0 - (back * inside).powi(2));
        let t = into * inside * out * repeated;
        let r = 1.0 - into + back * inside * t;
        let t_first = entering * inside * out * repeated;
        let r_first = 1.0 - entering + back * inside * t_first;
        // the N - 1 layers below the first one
        let [r_below, t_below] = pile(r, t, self.n - 1.0);
        let between = 1.0 / (1.0 - r_below * r);
        [r_first + t_first * r_below * t * between, t_first * t_below * between]
    }
}

/// Returns reflectance and transmittance of a pile of plates that each reflect `r` > 0 and transmit
/// `t` (Stokes 1862). Their number need not be whole.
fn pile(r: f64, t: f64, number: f64) -> [f64; 2] {
    let absorbed = 1.0 - r - t;
    if absorbed < 1e-12 {
        let through = t / (t + (1.0 - t) * number);
        return [1.0 - through, through];
    }
    let root = ((1.0 + r + t) * (1.0 + r - t) * (1.0 - r + t) * absorbed).sqrt();
    let a = (1.0 + r * r - t * t + root) / (2.0 * r);
    // what is left behind so many plates, without reflections between them
    let left = (2.0 * t / (1.0 - r * r + t * t + root)).powf(number);
    let repeated = 1.0 / (a * a - left * left);
    [a * (1.0 - left * left) * repeated, left * (a * a - 1.0) * repeated]
}

/// Returns the share of isotropic light that passes a layer of optical thickness `k` >= 0: twice
/// the exponential integral E3, in terms of E1.
fn diffuse_transmittance(k: f64) -> f64 {
    if k == 0.0 {
        return 1.0;
    }
    (1.0 - k) * (-k).exp() + k * k * exponential_integral(k)
}

/// Returns the exponential integral E1 of x > 0: its series up to 1, beyond it the continued
/// fraction (Abramowitz and Stegun 1964, 5.1.11 and 5.1.22).
fn exponential_integral(x: f64) -> f64 {
    const EULER: f64 = 0.577_215_664_901_532_9;
    if x <= 1.0 {
        let (mut sum, mut power) = (-EULER - x.ln(), 1.0);
        for i in 1..=20 {
            power *= -x / f64::from(i);
            sum -= power / f64::from(i);
        }
        return sum;
    }
    // from the inside: more terms are needed only close to 1
    let fraction = (1..=60).rev().fold(0.0, |rest, i| {
        let i = f64::from(i);
        i / (1.0 + i / (x + rest))
    });
    (-x).exp() / (x + fraction)
}

/// Returns the share of light that passes from air into a medium of index `n` > 1, for unpolarised
/// light that comes evenly from all directions up to the angle `up_to_deg` (Stern 1964; Allen
/// 1973).
fn isotropic_transmittance(up_to_deg: f64, n: f64) -> f64 {
    let sin2 = (up_to_deg * PI / 180.0).sin().powi(2);
    let n2 = n * n;
    let (sum, difference) = (n2 + 1.0, n2 - 1.0);
    let a = (n + 1.0).powi(2) / 2.0;
    let k = -difference * difference / 4.0;
    let middle = sin2 - sum / 2.0;
    // 0 at 90 degrees, where rounding may leave a small negative number
    let b = (middle * middle + k).max(0.0).sqrt() - middle;
    let s_at = |x: f64| k * k / (6.0 * x.powi(3)) + k / x - x / 2.0;
    let s = s_at(b) - s_at(a);
    let [at_b, at_a] = [b, a].map(|x| 2.0 * sum * x - difference * difference);
    let p = -2.0 * n2 * (b - a) / (sum * sum)
        - 2.0 * n2 * sum * (b / a).ln() / (difference * difference)
        + n2 * (1.0 / b - 1.0 / a) / 2.0
        + 16.0 * n2 * n2 * (n2 * n2 + 1.0) * (at_b / at_a).ln()
            / (sum.powi(3) * difference * difference)
        + 16.0 * n2.powi(3) * (1.0 / at_b - 1.0 / at_a) / sum.powi(3);
    (s + p) / (2.0 * sin2)
}

#[cfg(test)]
mod tests;
