//! Pictures of radiance in memory.

/// The largest allowed size of a map: texels times channels, or texels times bands.
pub(super) const MOST: usize = 1 << 27;

/// A picture: named channels of equal length, row by row from the upper left.
#[derive(Clone, Debug, PartialEq)]
pub struct Panorama {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) channels: Vec<(String, Vec<f32>)>,
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
