//! Pictures of radiance in memory.

/// The largest allowed size of a map: texels times channels, or texels times bands.
pub(super) const MOST: usize = 1 << 27;

/// A picture: named channels of equal length, row by row from the upper left.
#[derive(Clone, Debug, PartialEq)]
pub struct Panorama {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) channels: Vec<(String, Vec<f32>)>,
    /// What the file says and is not used.
    pub(super) notes: Vec<String>,
}

/// Refuses pictures that are empty or larger than [`MOST`], before memory is allocated for them.
pub(super) fn check_size(
    width: usize,
    height: usize,
    channels: usize,
) -> std::result::Result<(), String> {
    let numbers = width.checked_mul(height).and_then(|texels| texels.checked_mul(channels));
    match numbers {
        Some(1..=MOST) => Ok(()),
        _ => Err(format!("has {width} x {height} texels in {channels} channels")),
    }
}

/// Refuses pictures that do not have the shape of the whole sphere by latitude and longitude, twice
/// as wide as high; `aspect` is the width of a texel over its height. A last row or column may be
/// missing.
pub(super) fn check_shape(
    width: usize,
    height: usize,
    aspect: f64,
) -> std::result::Result<(), String> {
    let (across, down) = (width as f64 * aspect, 2.0 * height as f64);
    let square = (aspect - 1.0).abs() < 1e-6;
    if (across - down).abs() <= if square { 1.0 } else { 1.0 + 1e-3 * down } {
        return Ok(());
    }
    let texels = match square {
        true => String::new(),
        false => format!(" whose width is {aspect:.3} of their height"),
    };
    Err(format!(
        "is {width} x {height} texels{texels}, not twice as wide as high: a map shows the whole \
         sphere by latitude and longitude, and other pictures (fisheyes, cubes, views) are not read"
    ))
}
