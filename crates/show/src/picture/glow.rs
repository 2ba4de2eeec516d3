//! Glow around bright light: eyes and lenses spread a little of the light that comes from one
//! direction over all directions nearby (Spencer, Shirley, Zimmerman and Greenberg,
//! Physically-Based Glare Effects for Digital Images, SIGGRAPH 1995).

use glam::Vec3;

/// Fractions of the light, and how far each is spread: the standard deviation as a fraction of the
/// picture's width.
const SPREAD: [(f32, f32); 3] = [(0.06, 0.003), (0.04, 0.012), (0.02, 0.04)];
/// Number of box means, one after the other, which come near enough to a Gaussian.
const BOXES: u32 = 3;

/// Returns linear colours, row by row, with some of each spread around it. Their sum stays the
/// same: light that would be spread beyond the picture is mirrored at its edges.
pub fn with_glow(colours: &[Vec3], width: usize) -> Vec<Vec3> {
    let spread: f32 = SPREAD.iter().map(|(share, _)| share).sum();
    let mut sum: Vec<Vec3> = colours.iter().map(|colour| *colour * (1.0 - spread)).collect();
    for (share, deviation) in SPREAD {
        let blurred = blurred(colours.to_vec(), width, deviation * width as f32);
        sum.iter_mut().zip(blurred).for_each(|(sum, blurred)| *sum += share * blurred);
    }
    sum
}

/// Returns colours spread by a Gaussian, with a standard deviation in pixels.
pub(super) fn blurred(mut colours: Vec<Vec3>, width: usize, deviation: f32) -> Vec<Vec3> {
    let height = colours.len() / width;
    // the variance of a box of 2 r + 1 pixels is r (r + 1) / 3
    let variance = deviation * deviation / BOXES as f32;
    let reach = ((0.25 + 3.0 * variance).sqrt() - 0.5).round() as usize;
    for _ in 0..BOXES {
        colours = transposed(&box_means(&colours, width, reach), width);
        colours = transposed(&box_means(&colours, height, reach), height);
    }
    colours
}

/// Returns means over each pixel and `reach` pixels to either side of it in its row, which is
/// mirrored at its ends.
fn box_means(colours: &[Vec3], width: usize, reach: usize) -> Vec<Vec3> {
    let mirrored = |x: isize| {
        let x = x.rem_euclid(2 * width as isize) as usize;
        if x < width { x } else { 2 * width - 1 - x }
    };
    let reach = reach as isize;
    let means = |row: &[Vec3]| {
        let at = |x: isize| row[mirrored(x)].as_dvec3();
        let mut sum: glam::DVec3 = (-reach..=reach).map(at).sum();
        let mean = |x: usize| {
            let mean = sum / (2 * reach + 1) as f64;
            sum += at(x as isize + reach + 1) - at(x as isize - reach);
            mean.as_vec3().max(Vec3::ZERO)
        };
        (0..width).map(mean).collect::<Vec<Vec3>>()
    };
    colours.chunks(width).flat_map(means).collect()
}

fn transposed(colours: &[Vec3], width: usize) -> Vec<Vec3> {
    let height = colours.len() / width;
    (0..colours.len()).map(|i| colours[i % height * width + i / height]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Even light stays even. One bright pixel keeps 88 % and the part that its blurs leave there;
    /// all of its light stays in the picture, the same on all sides, and less the farther away.
    #[test]
    fn light_is_spread_and_kept() {
        let even = with_glow(&[Vec3::splat(2.0); 60], 12);
        assert!(even.iter().all(|colour| colour.distance(Vec3::splat(2.0)) < 1e-5));

        let (width, height, middle) = (201, 101, 50 * 201 + 100);
        let mut one = vec![Vec3::ZERO; width * height];
        one[middle] = Vec3::new(1e4, 0.0, 0.0);
        let glow = with_glow(&one, width);
        assert!((glow.iter().map(|colour| f64::from(colour.x)).sum::<f64>() - 1e4).abs() < 1.0);
        assert!((8800.0..9500.0).contains(&glow[middle].x), "{}", glow[middle].x);
        for away in 1..20 {
            let beside =
                [middle - away, middle + away, middle - away * width, middle + away * width];
            let [left, right, up, down] = beside.map(|i| glow[i].x);
            let alike = |other: f32| (other - left).abs() < 1e-3 * (left + 1e-3);
            assert!(alike(right) && alike(up) && alike(down), "{away}: {left} {right} {up} {down}");
            assert!(left < glow[middle - away + 1].x, "{away}");
        }
        assert!(glow.iter().all(|colour| colour.y == 0.0 && colour.z == 0.0));
    }
}
