//! Spectra of sunlight and skylight.
//!
//! They are the reference spectra of ASTM G173-03. The sun has its direct and circumsolar spectrum.
//! The clear sky has its global spectrum on a plane tilted by 37 degrees, less the share of direct
//! and circumsolar light on that plane, under a sun at 11.19 degrees from the plane's normal. About
//! a tenth of it is light from the ground.

use crate::math::units::{Quantity, UMOL_PER_J_NM};

/// First and last wavelength of the spectra, nm.
pub const WAVELENGTHS: [f64; 2] = [280.0, 4000.0];

/// Wavelength, nm, up to which bins are 5 nm wide; from there on they are 10 nm wide.
const COARSE_FROM: f64 = 1100.0;
const FINE_BINS: usize = 164;
const BINS: usize = 454;

/// Source of daylight, which has a spectrum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DaylightSource {
    /// Direct light of the sun.
    Sun,
    /// Diffuse light of a clear sky.
    Sky,
}

/// Returns the share of a band in broadband daylight: W in the band per W of all, from 0 to 1, or
/// umol/s in the band per W.
///
/// The power is assumed to be spread evenly inside bins of 5 nm (10 nm beyond 1100 nm). The result
/// is exact for bands with borders on those of bins, and off by up to 0.002 of the whole for
/// others. It is `None` where the band is empty or reaches beyond [`WAVELENGTHS`].
pub fn band_share(
    source: DaylightSource,
    quantity: Quantity,
    from_nm: f64,
    to_nm: f64,
) -> Option<f64> {
    let inside = from_nm >= WAVELENGTHS[0] && to_nm <= WAVELENGTHS[1] && from_nm < to_nm;
    let powers = match source {
        DaylightSource::Sun => &SUN,
        DaylightSource::Sky => &SKY,
    };
    let whole: f64 = powers.iter().map(|&power| f64::from(power)).sum();
    let of_bin = |(bin, &power): (usize, &u32)| {
        let [from, to] = [bin, bin + 1].map(border);
        let (low, high) = (from.max(from_nm), to.min(to_nm));
        if low >= high {
            return 0.0;
        }
        let inside = f64::from(power) * (high - low) / (to - from);
        match quantity {
            Quantity::Watt => inside,
            Quantity::Micromole => inside * 0.5 * (low + high) * UMOL_PER_J_NM,
        }
    };
    inside.then(|| powers.iter().enumerate().map(of_bin).sum::<f64>() / whole)
}

/// Returns the spectrum of the standard: wavelength in nm and W/m2/nm, in the middle of each bin. The
/// sun is on a plane that faces it, the sky on the standard's tilted plane.
pub fn standard_spectrum(source: DaylightSource) -> Vec<[f64; 2]> {
    let powers = match source {
        DaylightSource::Sun => &SUN,
        DaylightSource::Sky => &SKY,
    };
    let of_bin = |(bin, &power): (usize, &u32)| {
        let [from, to] = [bin, bin + 1].map(border);
        [0.5 * (from + to), 1e-3 * f64::from(power) / (to - from)]
    };
    powers.iter().enumerate().map(of_bin).collect()
}

/// Returns the wavelength at which a bin begins, nm.
fn border(bin: usize) -> f64 {
    match bin.checked_sub(FINE_BINS) {
        None => WAVELENGTHS[0] + 5.0 * bin as f64,
        Some(coarse) => COARSE_FROM + 10.0 * coarse as f64,
    }
}

/// Direct and circumsolar light, mW/m2 in each bin.
#[rustfmt::skip]
const SUN: [u32; BINS] = [
    0, 0, 0, 1, 16, 87, 268, 456, 662, 1073, 1214, 1259, 1418, 1482, 1750, 1636, 1897, 2387, 2199,
    2548, 2149, 2421, 2518, 3078, 4431, 4380, 4608, 4758, 4868, 4573, 4462, 5241, 5735, 6029, 6355,
    6483, 6600, 6506, 6634, 6791, 6861, 6261, 6748, 6800, 6575, 6831, 6760, 6272, 6775, 6665, 6817,
    6837, 6715, 6799, 6866, 6697, 6764, 6668, 6670, 6618, 6856, 6513, 6478, 6592, 6604, 6680, 6575,
    6545, 6477, 6339, 6397, 6552, 6523, 6313, 6365, 5951, 6309, 6433, 6373, 6347, 6279, 5306, 5662,
    5893, 5823, 5949, 5902, 4965, 5047, 4869, 5315, 5512, 5615, 5672, 5635, 5144, 2070, 4553, 5384,
    5389, 5332, 5229, 5043, 5022, 4959, 4960, 4593, 3977, 4144, 4301, 4328, 4625, 4648, 4584, 4328,
    4548, 4585, 4310, 4431, 4401, 4324, 4292, 4128, 3249, 3349, 3268, 3058, 3138, 3440, 3004, 1362,
    1213, 1661, 1502, 1665, 1713, 2195, 2741, 3006, 2881, 3252, 3463, 3514, 3488, 3423, 3376, 3383,
    3316, 3274, 3264, 3223, 3190, 3157, 3101, 3072, 3014, 2968, 2893, 2890, 2859, 2785, 2716, 2613,
    2461, 4367, 2369, 1118, 1740, 1801, 2477, 3774, 4189, 3990, 4251, 4121, 4259, 4359, 4442, 4384,
    4243, 3613, 3957, 3957, 3812, 3388, 2950, 2519, 1729, 860, 14, 0, 2, 1, 3, 9, 93, 255, 306, 521,
    896, 827, 773, 1139, 1892, 2168, 2457, 2617, 2636, 2638, 2608, 2551, 2299, 2411, 2423, 2231,
    2283, 2326, 2239, 2137, 2146, 2082, 2079, 2002, 1979, 1920, 1838, 1749, 1622, 1569, 1541, 1384,
    1152, 838, 524, 174, 42, 9, 0, 0, 0, 0, 0, 1, 1, 0, 1, 7, 27, 103, 145, 315, 639, 804, 703, 265,
    339, 683, 904, 836, 608, 637, 757, 853, 874, 892, 888, 873, 888, 873, 834, 785, 800, 764, 759,
    736, 763, 750, 734, 707, 677, 662, 641, 632, 605, 596, 574, 547, 541, 471, 462, 445, 400, 350,
    402, 360, 285, 342, 293, 244, 240, 245, 143, 57, 41, 31, 9, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 3, 3, 16, 10, 21, 28, 52,
    25, 37, 50, 9, 65, 68, 52, 47, 55, 33, 29, 20, 35, 44, 24, 20, 18, 38, 55, 81, 42, 69, 126, 105,
    78, 25, 3, 7, 6, 47, 20, 60, 19, 40, 85, 33, 34, 10, 30, 66, 47, 52, 59, 66, 76, 105, 72, 88,
    106, 101, 106, 102, 112, 115, 116, 118, 120, 119, 116, 98, 97, 99, 103, 90, 96, 98, 102, 101,
    106, 106, 108, 108, 99, 65, 93, 103, 105, 96, 103, 89, 97, 91, 88, 92, 88, 89, 92, 84, 96, 85,
    89, 85, 79, 69, 68, 75, 78, 70, 69, 73, 75, 77, 78, 75, 74, 72,
];

/// Global light, less 0.9810 (the cosine of 11.19 degrees) times the direct and circumsolar light,
/// mW/m2 in each bin.
#[rustfmt::skip]
const SKY: [u32; BINS] = [
    0, 0, 0, 1, 14, 74, 229, 393, 568, 890, 953, 932, 980, 956, 1051, 921, 999, 1182, 1028, 1122,
    894, 951, 940, 1087, 1494, 1410, 1420, 1404, 1375, 1241, 1162, 1318, 1390, 1410, 1435, 1414,
    1395, 1334, 1318, 1307, 1281, 1142, 1205, 1190, 1122, 1143, 1113, 1015, 1077, 1041, 1049, 1038,
    1007, 1007, 1004, 964, 957, 928, 915, 898, 925, 869, 853, 861, 856, 861, 843, 835, 820, 796,
    803, 822, 817, 785, 789, 737, 777, 795, 787, 783, 773, 634, 682, 715, 705, 721, 715, 583, 588,
    559, 615, 639, 647, 648, 639, 576, 206, 488, 588, 584, 573, 556, 530, 524, 513, 510, 462, 389,
    407, 421, 423, 454, 455, 447, 418, 437, 439, 410, 419, 413, 404, 398, 379, 286, 295, 286, 264,
    271, 300, 257, 108, 95, 132, 118, 131, 134, 175, 224, 247, 234, 268, 287, 291, 288, 281, 275,
    275, 268, 263, 261, 257, 253, 249, 243, 240, 234, 229, 222, 221, 217, 210, 204, 195, 181, 314,
    162, 72, 115, 117, 163, 254, 282, 265, 283, 274, 284, 289, 294, 288, 275, 230, 254, 253, 240,
    210, 179, 150, 99, 48, 1, 0, 0, 0, 0, 0, 4, 12, 14, 24, 42, 38, 36, 53, 91, 105, 119, 127, 128,
    127, 125, 122, 110, 117, 118, 107, 110, 112, 107, 102, 102, 97, 96, 92, 90, 87, 82, 78, 72, 69,
    68, 60, 50, 36, 22, 7, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 3, 5, 11, 23, 29, 26, 10, 12, 24,
    32, 29, 21, 22, 26, 29, 30, 30, 30, 30, 31, 30, 29, 27, 27, 26, 26, 25, 26, 25, 24, 23, 21, 20,
    19, 19, 18, 18, 17, 16, 16, 14, 14, 13, 12, 10, 12, 10, 8, 9, 8, 6, 6, 6, 3, 1, 1, 1, 0, 0, 0,
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 1, 1,
    1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
    1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
    1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
];

#[cfg(test)]
mod tests {
    use super::*;

    /// The expected shares are integrals of the standard's table by the trapezoidal rule.
    #[test]
    fn shares_are_those_of_the_standard() {
        for (from, to, sun, sun_photons, sky, sky_photons) in [
            (400.0, 500.0, 0.1279, 0.486, 0.227, 0.852),
            (500.0, 600.0, 0.1486, 0.683, 0.169, 0.772),
            (600.0, 700.0, 0.1399, 0.759, 0.134, 0.726),
            (400.0, 700.0, 0.4164, 1.928, 0.530, 2.349),
            (700.0, 800.0, 0.1149, 0.719, 0.100, 0.622),
        ] {
            for (source, watt, photons) in
                [(DaylightSource::Sun, sun, sun_photons), (DaylightSource::Sky, sky, sky_photons)]
            {
                let share = |quantity| band_share(source, quantity, from, to).unwrap();
                let (w, p) = (share(Quantity::Watt), share(Quantity::Micromole));
                assert!((w - watt).abs() < 6e-4, "{source:?} {from}: {w}, not {watt}");
                assert!((p - photons).abs() < 6e-4, "{source:?} {from}: {p}, not {photons}");
            }
        }
    }

    #[test]
    fn parts_add_up_to_the_whole() {
        let share = |from, to| band_share(DaylightSource::Sky, Quantity::Watt, from, to);
        assert!((share(280.0, 4000.0).unwrap() - 1.0).abs() < 1e-12);
        let parts = [(280.0, 403.7), (403.7, 1099.0), (1099.0, 1101.5), (1101.5, 4000.0)];
        let sum: f64 = parts.iter().map(|(from, to)| share(*from, *to).unwrap()).sum();
        assert!((sum - 1.0).abs() < 1e-12);
        assert_eq!(border(BINS), 4000.0);
        for (from, to) in [(279.9, 400.0), (400.0, 4000.1), (500.0, 500.0), (f64::NAN, 500.0)] {
            assert_eq!(share(from, to), None);
        }
    }
}
