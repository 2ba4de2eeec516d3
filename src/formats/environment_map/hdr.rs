//! Reads Radiance HDR pictures (Ward, Real pixels, Graphics Gems II, 1991): a header, then, for
//! each texel, three bytes and their common exponent, run-length encoded.

use super::panorama::{Panorama, check_size};

type Problem = String;

/// Reads the bytes of a picture. Radiances are divided by the product of the EXPOSURE values in the
/// header.
pub(super) fn read(bytes: &[u8]) -> Result<Panorama, Problem> {
    let mut rest = bytes;
    let (mut exposure, mut format) = (1.0f64, false);
    loop {
        let line = take_line(&mut rest)?;
        if line.is_empty() {
            break;
        }
        if let Some(value) = line.strip_prefix("EXPOSURE=") {
            let value: f64 = value.trim().parse().map_err(|_| "its EXPOSURE is no number")?;
            exposure *= value;
        } else if let Some(name) = line.strip_prefix("FORMAT=") {
            format = name.trim() == "32-bit_rle_rgbe";
        }
    }
    if !format {
        return Err("is not of the format 32-bit_rle_rgbe".into());
    }
    if !(exposure.is_finite() && exposure > 0.0) {
        return Err("its EXPOSURE is not above 0".into());
    }
    let size = take_line(&mut rest)?;
    let words: Vec<&str> = size.split_whitespace().collect();
    let ["-Y", height, "+X", width] = words[..] else {
        return Err("its rows do not run from the upper left (-Y height +X width)".into());
    };
    let number = |word: &str| word.parse::<usize>().map_err(|_| "its size is no number".to_owned());
    let (width, height) = (number(width)?, number(height)?);
    check_size(width, height, 3)?;
    // a run of 127 texels takes 4 x 2 bytes, so fewer bytes cannot hold this many texels
    if rest.len() < height || width / 127 > rest.len() {
        return Err("is cut off".into());
    }
    let mut colours = [const { Vec::new() }; 3];
    let mut row = vec![[0u8; 4]; width];
    for _ in 0..height {
        read_row(&mut rest, &mut row)?;
        for [red, green, blue, exponent] in &row {
            // 128 is the offset of the exponent, 8 the number of bits of the other bytes
            let scale = match exponent {
                0 => 0.0,
                &e => 2f64.powi(i32::from(e) - 136) / exposure,
            };
            for (colour, byte) in colours.iter_mut().zip([red, green, blue]) {
                colour.push((f64::from(*byte) * scale) as f32);
            }
        }
    }
    let channels = ["R", "G", "B"].map(str::to_owned).into_iter().zip(colours).collect();
    Ok(Panorama { width, height, channels })
}

fn take_line(rest: &mut &[u8]) -> Result<String, Problem> {
    let end = rest.iter().position(|&b| b == b'\n').ok_or("is cut off in its header")?;
    let line = String::from_utf8_lossy(&rest[..end]).trim_end().to_owned();
    *rest = &rest[end + 1..];
    Ok(line)
}

fn take<const K: usize>(rest: &mut &[u8]) -> Result<[u8; K], Problem> {
    let (found, after) = rest.split_first_chunk::<K>().ok_or("is cut off")?;
    *rest = after;
    Ok(*found)
}

fn read_row(rest: &mut &[u8], row: &mut [[u8; 4]]) -> Result<(), Problem> {
    let width = row.len();
    let coded = matches!(rest, [2, 2, high, low, ..]
        if usize::from(*high) << 8 | usize::from(*low) == width && (8..0x8000).contains(&width));
    if !coded {
        return read_plain(rest, row);
    }
    take::<4>(rest)?;
    for byte in 0..4 {
        let mut at = 0;
        while at < width {
            let [count] = take(rest)?;
            let (count, repeats) = if count > 128 { (count - 128, true) } else { (count, false) };
            let count = usize::from(count);
            if count == 0 || count > width - at {
                return Err("has a run that is longer than its row".into());
            }
            let [mut value] = if repeats { take(rest)? } else { [0] };
            for texel in &mut row[at..at + count] {
                if !repeats {
                    [value] = take(rest)?;
                }
                texel[byte] = value;
            }
            at += count;
        }
    }
    Ok(())
}

/// Reads a row whose texels are stored one after the other; the texel 1, 1, 1, n repeats the texel
/// before it n times.
fn read_plain(rest: &mut &[u8], row: &mut [[u8; 4]]) -> Result<(), Problem> {
    let (mut at, mut shift) = (0, 0);
    while at < row.len() {
        let texel = take::<4>(rest)?;
        if let [1, 1, 1, count] = texel {
            let count = usize::from(count) << shift;
            if at == 0 || shift > 16 || count > row.len() - at {
                return Err("has a run that is longer than its row".into());
            }
            let before = row[at - 1];
            row[at..at + count].fill(before);
            at += count;
            shift += 8;
        } else {
            row[at] = texel;
            at += 1;
            shift = 0;
        }
    }
    Ok(())
}
