//! Shade around what stands in front, which tells the eye what is near: the depth of a picture is
//! compared with its own blur (Luft, Colditz and Deussen, Image Enhancement by Unsharp Masking the
//! Depth Buffer, SIGGRAPH 2006).

use glam::Vec3;

use super::glow::blurred;

/// The standard deviation of the blur, as a fraction of the picture's width.
const SPREAD: f32 = 0.008;
/// How much darker it is where depth is greater than around, per unit of the logarithm of depth,
/// and the difference beyond which it is no darker.
const STRENGTH: f32 = 3.5;
const FARTHEST: f32 = 0.5;

/// Returns the share of its light that each pixel keeps, row by row: less than 1 where something
/// nearer is beside it. `depths` are distances, m, or infinite where nothing is seen.
pub fn relief(depths: &[f32], width: usize) -> Vec<f32> {
    let seen = || depths.iter().copied().filter(|depth| depth.is_finite() && *depth > 0.0);
    let far = seen().fold(f32::MIN_POSITIVE, f32::max);
    let logs: Vec<f32> = depths.iter().map(|depth| depth.clamp(1e-6 * far, far).ln()).collect();
    let spread =
        blurred(logs.iter().map(|log| Vec3::splat(*log)).collect(), width, SPREAD * width as f32);
    let share =
        |(log, around): (&f32, &Vec3)| (-STRENGTH * (log - around.x).clamp(0.0, FARTHEST)).exp();
    logs.iter().zip(&spread).map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What stands in front keeps its light and has shade around it, which fades away from it; a
    /// wall that recedes evenly has none.
    #[test]
    fn shade_is_around_what_stands_in_front() {
        let (width, height) = (400, 100);
        let column = |pixel: usize| pixel % width;
        let depths: Vec<f32> = (0..width * height)
            .map(|pixel| if (150..250).contains(&column(pixel)) { 2.0 } else { 4.0 })
            .collect();
        let shares = relief(&depths, width);
        let row = &shares[50 * width..][..width];
        assert!(row[151] == 1.0 && row[200] == 1.0 && row[10] > 0.999);
        assert!(row[148] < 0.5 && row[251] < 0.5, "{} {}", row[148], row[251]);
        assert!(row[252..300].is_sorted(), "{:?}", &row[252..300]);
        let receding: Vec<f32> =
            (0..width * height).map(|pixel| 2.0 + 0.01 * column(pixel) as f32).collect();
        let shares = relief(&receding, width);
        assert!(shares.iter().all(|share| *share > 0.95));
        assert!(relief(&[f32::INFINITY; 40], 8).iter().all(|share| *share == 1.0));
    }
}
