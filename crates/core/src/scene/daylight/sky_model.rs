//! Sky models: how radiance is spread over the sky. The values are relative; quadrature over cells
//! normalises them.

use std::f64::consts::FRAC_PI_2;

/// Radiance of a sky relative to an arbitrary radiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RelativeSky {
    /// The same radiance everywhere.
    Uniform,
    /// (1 + 2 sin h) / 3 of the zenith's radiance, with h the elevation (Moon and Spencer, 1942;
    /// the traditional overcast sky of CIE S 011).
    Overcast,
    /// (1 + a exp(b / cos Z)) (1 + c (exp(d g) - offset) + e cos^2 g), with Z the angle from the
    /// zenith and g the angle from the sun.
    General {
        /// Coefficients a and b of the gradation between zenith and horizon.
        gradation: [f64; 2],
        /// Coefficients c, d and e of the indicatrix around the sun.
        indicatrix: [f64; 3],
        /// exp(d pi / 2) for the skies of the CIE, 0 for those of Perez.
        offset: f64,
    },
}

/// Coefficients a and b of the CIE's types 1 to 15 (ISO 15469:2004, CIE S 011/E:2003).
const CIE_GRADATION: [[f64; 2]; 15] = [
    [4.0, -0.70],
    [4.0, -0.70],
    [1.1, -0.8],
    [1.1, -0.8],
    [0.0, -1.0],
    [0.0, -1.0],
    [0.0, -1.0],
    [0.0, -1.0],
    [-1.0, -0.55],
    [-1.0, -0.55],
    [-1.0, -0.55],
    [-1.0, -0.32],
    [-1.0, -0.32],
    [-1.0, -0.15],
    [-1.0, -0.15],
];

/// Coefficients c, d and e of the CIE's types 1 to 15.
const CIE_INDICATRIX: [[f64; 3]; 15] = [
    [0.0, -1.0, 0.0],
    [2.0, -1.5, 0.15],
    [0.0, -1.0, 0.0],
    [2.0, -1.5, 0.15],
    [0.0, -1.0, 0.0],
    [2.0, -1.5, 0.15],
    [5.0, -2.5, 0.30],
    [10.0, -3.0, 0.45],
    [2.0, -1.5, 0.15],
    [5.0, -2.5, 0.30],
    [10.0, -3.0, 0.45],
    [10.0, -3.0, 0.45],
    [16.0, -3.0, 0.30],
    [16.0, -3.0, 0.30],
    [24.0, -2.8, 0.15],
];

/// Lowest clearness of each bin (Perez, Seals, Michalsky, Solar Energy 50:235, 1993).
const PEREZ_BINS: [f64; 8] = [1.0, 1.065, 1.23, 1.5, 1.95, 2.8, 4.5, 6.2];

/// Four numbers for each of the coefficients a to e, by bin (the same paper, table 1).
#[rustfmt::skip]
const PEREZ: [[[f64; 4]; 5]; 8] = [
    [[1.3525, -0.2576, -0.2690, -1.4366], [-0.7670, 0.0007, 1.2734, -0.1233],
     [2.8000, 0.6004, 1.2375, 1.0000], [1.8734, 0.6297, 0.9738, 0.2809], [0.0356, -0.1246, -0.5718, 0.9938]],
    [[-1.2219, -0.7730, 1.4148, 1.1016], [-0.2054, 0.0367, -3.9128, 0.9156],
     [6.9750, 0.1774, 6.4477, -0.1239], [-1.5798, -0.5081, -1.7812, 0.1080], [0.2624, 0.0672, -0.2190, -0.4285]],
    [[-1.1000, -0.2515, 0.8952, 0.0156], [0.2782, -0.1812, -4.5000, 1.1766],
     [24.7219, -13.0812, -37.7000, 34.8438], [-5.0000, 1.5218, 3.9229, -2.6204], [-0.0156, 0.1597, 0.4199, -0.5562]],
    [[-0.5484, -0.6654, -0.2672, 0.7117], [0.7234, -0.6219, -5.6812, 2.6297],
     [33.3389, -18.3000, -62.2500, 52.0781], [-3.5000, 0.0016, 1.1477, 0.1062], [0.4659, -0.3296, -0.0876, -0.0329]],
    [[-0.6000, -0.3566, -2.5000, 2.3250], [0.2937, 0.0496, -5.6812, 1.8415],
     [21.0000, -4.7656, -21.5906, 7.2492], [-3.5000, -0.1554, 1.4062, 0.3988], [0.0032, 0.0766, -0.0656, -0.1294]],
    [[-1.0156, -0.3670, 1.0078, 1.4051], [0.2875, -0.5328, -3.8500, 3.3750],
     [14.0000, -0.9999, -7.1406, 7.5469], [-3.4000, -0.1078, -1.0750, 1.5702], [-0.0672, 0.4016, 0.3017, -0.4844]],
    [[-1.0000, 0.0211, 0.5025, -0.5119], [-0.3000, 0.1922, 0.7023, -1.6317],
     [19.0000, -5.0000, 1.2438, -1.9094], [-4.0000, 0.0250, 0.3844, 0.2656], [1.0468, -0.3788, -2.4517, 1.4656]],
    [[-1.0500, 0.0289, 0.4260, 0.3590], [-0.3250, 0.1156, 0.7781, 0.0025],
     [31.0625, -14.5000, -46.1148, 55.3750], [-7.2312, 0.4050, 13.3500, 0.6234], [1.5000, -0.6426, 1.8564, 0.5636]],
];

impl RelativeSky {
    /// Returns one of the CIE's general skies, `kind` 1 to 15; other numbers count as the nearest
    /// of these.
    pub fn cie(kind: usize) -> Self {
        let kind = kind.clamp(1, 15) - 1;
        let indicatrix = CIE_INDICATRIX[kind];
        let offset = (indicatrix[1] * FRAC_PI_2).exp();
        Self::General { gradation: CIE_GRADATION[kind], indicatrix, offset }
    }

    /// Returns the all-weather sky of Perez, Seals and Michalsky (1993, erratum Solar Energy
    /// 51:423). It depends on the direct normal and the diffuse horizontal irradiance (> 0), W/m2,
    /// the sun's angle from the zenith, rad (a sun below the horizon counts as on it), and the
    /// [`eccentricity`](super::eccentricity) of the day.
    ///
    /// The model was fitted to luminance. The brightness is kept above 0.01, and above 0.2 where
    /// the clearness is between 1.065 and 2.8 (the erratum); the clearness is at most 11.9.
    pub fn perez(direct: f64, diffuse: f64, zenith: f64, eccentricity: f64) -> Self {
        let z = zenith.clamp(0.0, FRAC_PI_2);
        let cubed = 1.041 * z.powi(3);
        let clearness = (((diffuse + direct) / diffuse + cubed) / (1.0 + cubed)).clamp(1.0, 11.9);
        // air mass (Kasten, 1965)
        let mass = 1.0 / (z.cos() + 0.15 * (93.885 - z.to_degrees()).powf(-1.253));
        let least = if clearness > 1.065 && clearness < 2.8 { 0.2 } else { 0.01 };
        let brightness = (diffuse * mass / (1367.0 * eccentricity)).max(least);
        let bin = PEREZ_BINS.partition_point(|&first| first <= clearness).clamp(1, 8) - 1;
        let x = PEREZ[bin];
        let [a, b, mut c, mut d, e] = x.map(|x| x[0] + x[1] * z + brightness * (x[2] + x[3] * z));
        if bin == 0 {
            let [_, _, xc, xd, _] = x;
            c = (brightness * (xc[0] + xc[1] * z)).powf(xc[2]).exp() - xc[3];
            d = -(brightness * (xd[0] + xd[1] * z)).exp() + xd[2] + brightness * xd[3];
        }
        Self::General { gradation: [a, b], indicatrix: [c, d, e], offset: 0.0 }
    }

    /// Returns the factor that depends on the elevation alone, whose `sine` is at least 0.
    pub fn gradation(&self, sine: f64) -> f64 {
        match *self {
            Self::Uniform => 1.0,
            Self::Overcast => (1.0 + 2.0 * sine) / 3.0,
            // at the horizon b / 0 would be minus infinity, or plus infinity in a Perez sky with
            // b > 0
            Self::General { gradation: [a, b], .. } => 1.0 + a * (b / sine.max(0.01)).exp(),
        }
    }

    /// Returns the factor that depends on the angle from the sun alone, given its `cosine`.
    pub fn indicatrix(&self, cosine: f64) -> f64 {
        match *self {
            Self::Uniform | Self::Overcast => 1.0,
            Self::General { indicatrix: [c, d, e], offset, .. } => {
                let angle = cosine.clamp(-1.0, 1.0).acos();
                1.0 + c * ((d * angle).exp() - offset) + e * cosine * cosine
            }
        }
    }

    /// Returns the relative radiance, at least 0, where the formula of Perez may be negative.
    pub fn radiance(&self, sine: f64, cosine_to_sun: f64) -> f64 {
        (self.gradation(sine) * self.indicatrix(cosine_to_sun)).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the cosine of the angle between two directions, from their zenith angles and the
    /// difference of their azimuths, degrees.
    fn cosine(z: f64, zs: f64, azimuth: f64) -> f64 {
        let [z, zs, a] = [z, zs, azimuth].map(f64::to_radians);
        z.cos() * zs.cos() + z.sin() * zs.sin() * a.cos()
    }

    /// The radiance at 45 degrees from the zenith, opposite a sun at 30 degrees from it, over that
    /// of the zenith, is that of published code.
    #[test]
    fn cie_skies_have_the_standard_s_values() {
        for (kind, expected) in [(1, 0.832_584_6), (12, 0.454_452_4), (5, 1.0)] {
            let sky = RelativeSky::cie(kind);
            let at = sky.radiance(45f64.to_radians().cos(), cosine(45.0, 30.0, 180.0));
            let ratio = at / sky.radiance(1.0, cosine(0.0, 30.0, 0.0));
            assert!((ratio - expected).abs() < 1e-6, "type {kind}: {ratio}");
        }
    }

    #[test]
    fn a_clear_june_noon_has_its_coefficients() {
        // Spencer's value of the eccentricity for 21 June
        let (z, june) = ((90f64 - 69.83).to_radians(), 0.96744);
        let RelativeSky::General { gradation, indicatrix, offset } =
            RelativeSky::perez(850.0, 100.0, z, june)
        else {
            panic!()
        };
        assert_eq!(offset, 0.0);
        let found = gradation.iter().chain(&indicatrix);
        for (found, (expected, digit)) in found.zip([
            (-0.9954, 2e-4),
            (-0.2216, 2e-4),
            (23.815, 2e-3),
            (-5.996, 1.5e-3),
            (1.4392, 5e-4),
        ]) {
            assert!((found - expected).abs() < digit, "{found}, not {expected}");
        }
    }

    /// Radiances are finite and not negative in every bin, at every height of the sun, with the
    /// brightness of any weather.
    #[test]
    fn every_perez_sky_is_finite() {
        for direct in [0.0, 1.0, 20.0, 60.0, 200.0, 600.0, 1100.0] {
            for diffuse in [0.1, 1.0, 10.0, 80.0, 300.0, 700.0] {
                for zenith in 0..=100 {
                    let zenith = f64::from(zenith).to_radians();
                    let sky = RelativeSky::perez(direct, diffuse, zenith, 1.0);
                    for sine in [0.0, 0.001, 0.1, 0.5, 1.0] {
                        for cosine in [-1.0, 0.0, 0.7, 1.0] {
                            let l = sky.radiance(sine, cosine);
                            assert!(l.is_finite() && l >= 0.0, "{direct} {diffuse} {zenith}: {l}");
                        }
                    }
                }
            }
        }
    }

    /// With a clearness between 1.065 and 2.8, a thin diffuse sky counts as one of brightness 0.2.
    #[test]
    fn the_erratum_holds() {
        let sky = |diffuse: f64, direct| RelativeSky::perez(direct, diffuse, 0.5, 1.0);
        assert_eq!(sky(20.0, 10.0), sky(40.0, 20.0));
        assert_ne!(sky(20.0, 100.0), sky(40.0, 200.0));
    }
}
