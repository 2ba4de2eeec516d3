//! The sensitivity of the eye, by which light is counted in lumens.

/// Lumens per W of light at 555 nm (CIE 18.2).
pub const LM_PER_W: f64 = 683.002;

/// Wavelengths that a spectrum must have for its lumens to be known, nm: beyond them the eye sees
/// less than half a hundredth of what it sees at 555 nm.
pub const VISIBLE: [f64; 2] = [410.0, 690.0];

/// V from 380 to 780 nm in steps of 5 nm (CIE 1924; ISO 23539).
const V: [f64; 81] = [
    0.000039, 0.000064, 0.00012, 0.000217, 0.000396, 0.00064, 0.00121, 0.00218, 0.004, 0.0073,
    0.0116, 0.01684, 0.023, 0.0298, 0.038, 0.048, 0.06, 0.0739, 0.09098, 0.1126, 0.13902, 0.1693,
    0.20802, 0.2586, 0.323, 0.4073, 0.503, 0.6082, 0.71, 0.7932, 0.862, 0.91485, 0.954, 0.9803,
    0.99495, 1.0, 0.995, 0.9786, 0.952, 0.9154, 0.87, 0.8163, 0.757, 0.6949, 0.631, 0.5668, 0.503,
    0.4412, 0.381, 0.321, 0.265, 0.217, 0.175, 0.1382, 0.107, 0.0816, 0.061, 0.04458, 0.032,
    0.0232, 0.017, 0.01192, 0.00821, 0.005723, 0.004102, 0.002929, 0.002091, 0.001484, 0.001047,
    0.00074, 0.00052, 0.000361, 0.000249, 0.000172, 0.00012, 0.000085, 0.00006, 0.000042, 0.00003,
    0.000021, 0.000015,
];

/// Returns the luminous efficiency V at a wavelength, nm, linear between the values of the table
/// and 0 beyond them.
pub fn luminosity(nm: f64) -> f64 {
    let at = (nm - 380.0) / 5.0;
    if !(0.0..=80.0).contains(&at) {
        return 0.0;
    }
    let i = (at as usize).min(V.len() - 2);
    V[i] + (at - i as f64) * (V[i + 1] - V[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integral of V is 106.857 nm, and its largest value 1 at 555 nm.
    #[test]
    fn v_has_its_integral() {
        let sum: f64 = V.iter().sum();
        assert!((5.0 * sum - 106.857).abs() < 1e-3, "{}", 5.0 * sum);
        assert_eq!([luminosity(555.0), luminosity(379.9), luminosity(780.1)], [1.0, 0.0, 0.0]);
        assert!((luminosity(507.5) - 0.45515).abs() < 1e-12);
    }
}
