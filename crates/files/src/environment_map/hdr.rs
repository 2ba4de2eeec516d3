//! Reads Radiance HDR pictures (Ward, Real pixels, Graphics Gems II, 1991): a header, then, for
//! each texel, three bytes and their common exponent, run-length encoded.

use super::panorama::{Panorama, check_shape, check_size};
use crate::input::quoted;

type Problem = String;

/// What the header of a picture says about its numbers.
struct Header {
    /// Product of the EXPOSURE and COLORCORR values, for red, green and blue.
    factors: [f64; 3],
    /// Product of the PIXASPECT values: the height of a texel over its width.
    aspect: f64,
    notes: Vec<String>,
}

/// The order in which the texels of a file come: index of the first, and the steps from line to
/// line and from texel to texel.
struct Order {
    width: usize,
    height: usize,
    lines: usize,
    first: usize,
    line_step: isize,
    texel_step: isize,
}

/// Reads the bytes of a picture. Radiances are divided by the EXPOSURE and COLORCORR values in the
/// header.
pub(super) fn read(bytes: &[u8]) -> Result<Panorama, Problem> {
    let mut rest = bytes;
    let header = read_header(&mut rest)?;
    let order = Order::parse(&take_line(&mut rest)?)?;
    let Order { width, height, lines, first, .. } = order;
    check_size(width, height, 3)?;
    check_shape(width, height, 1.0 / header.aspect)?;
    let length = width * height / lines;
    // a run of 127 texels takes 4 x 2 bytes, so fewer bytes cannot hold this many texels
    if rest.len() < lines || length / 127 > rest.len() {
        return Err("is cut off".into());
    }
    // 128 is the offset of the exponent, 8 the number of bits of the other bytes
    let scales: Vec<[f64; 3]> =
        (0..256).map(|e| header.factors.map(|by| 2f64.powi(e - 136) / by)).collect();
    let mut colours = [const { Vec::new() }; 3];
    colours.iter_mut().for_each(|colour| colour.resize(width * height, 0.0f32));
    let mut line = vec![[0u8; 4]; length];
    for number in 0..lines {
        read_row(&mut rest, &mut line)?;
        let mut at = first.wrapping_add_signed(number as isize * order.line_step);
        for &[red, green, blue, exponent] in &line {
            if exponent > 0 {
                let scale = &scales[usize::from(exponent)];
                for (c, byte) in [red, green, blue].into_iter().enumerate() {
                    // a byte stands for the middle of its step, as in Radiance
                    colours[c][at] = ((f64::from(byte) + 0.5) * scale[c]) as f32;
                }
            }
            at = at.wrapping_add_signed(order.texel_step);
        }
    }
    let channels = ["R", "G", "B"].map(str::to_owned).into_iter().zip(colours).collect();
    Ok(Panorama { width, height, channels, notes: header.notes })
}

fn read_header(rest: &mut &[u8]) -> Result<Header, Problem> {
    let mut header = Header { factors: [1.0; 3], aspect: 1.0, notes: Vec::new() };
    let mut format = None;
    let mut view = None;
    loop {
        let line = take_line(rest)?;
        if line.is_empty() {
            break;
        }
        // other lines, and those that begin with a blank, tell how the picture was made
        let Some((name, value)) = line.split_once('=') else { continue };
        let value = value.trim();
        let numbers = || -> Result<Vec<f64>, Problem> {
            let numbers: Option<Vec<f64>> = value
                .split_whitespace()
                .map(|word| word.parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0))
                .collect();
            let numbers = numbers.filter(|numbers| !numbers.is_empty());
            numbers.ok_or_else(|| format!("its {name} is not above 0, or no number"))
        };
        match name {
            "EXPOSURE" => {
                let by = numbers()?[0];
                header.factors.iter_mut().for_each(|factor| *factor *= by);
            }
            "COLORCORR" => {
                let [red, green, blue] = numbers()?[..] else {
                    return Err("its COLORCORR has not three numbers".into());
                };
                let by = [red, green, blue];
                header.factors.iter_mut().zip(by).for_each(|(factor, by)| *factor *= by);
            }
            "PIXASPECT" => header.aspect *= numbers()?[0],
            "FORMAT" => format = Some(value.to_string()),
            "GAMMA" if value.parse() != Ok(1.0) => header
                .notes
                .push(format!("its GAMMA={value} is not used: texels are taken as radiance")),
            "VIEW" => view = Some(value.to_string()),
            _ => {}
        }
    }
    match format.as_deref() {
        Some("32-bit_rle_rgbe") => {}
        Some("32-bit_rle_xyze") => {
            return Err("has the colours X, Y, Z (32-bit_rle_xyze), not red, green and blue: \
                convert it with `ra_xyze -r`"
                .into());
        }
        _ => return Err("is not of the format 32-bit_rle_rgbe".into()),
    }
    let bounds = 1e-30..1e30;
    if !header.factors.iter().chain([&header.aspect]).all(|factor| bounds.contains(factor)) {
        return Err("its EXPOSURE, COLORCORR or PIXASPECT is too small or too large".into());
    }
    if let Some(view) = view {
        header.notes.push(format!(
            "its VIEW={view} is a projection of Radiance, and none of those is by latitude and \
             longitude, as which the picture is read"
        ));
    }
    Ok(header)
}

impl Order {
    /// Reads the line with the size: two axes, each with its direction and length, of which the
    /// first goes from line to line.
    fn parse(line: &str) -> Result<Self, Problem> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [outer, lines, inner, length] = words[..] else {
            return Err(format!("its size is {}, not as -Y height +X width", quoted(line)));
        };
        let number =
            |word: &str| word.parse::<usize>().map_err(|_| "its size is no number".to_owned());
        let (lines, length) = (number(lines)?, number(length)?);
        let (width, height) = match [outer, inner] {
            ["-Y" | "+Y", "-X" | "+X"] => (length, lines),
            ["-X" | "+X", "-Y" | "+Y"] => (lines, length),
            _ => return Err(format!("its size is {}, not as -Y height +X width", quoted(line))),
        };
        check_size(width, height, 3)?;
        // rows count from the upper edge, which -Y begins with, columns from the left, as +X does
        let step = |axis: &str| match axis {
            "-Y" => (0, width as isize),
            "+Y" => ((height - 1) * width, -(width as isize)),
            "+X" => (0, 1),
            _ => (width - 1, -1),
        };
        let ((a, line_step), (b, texel_step)) = (step(outer), step(inner));
        Ok(Self { width, height, lines, first: a + b, line_step, texel_step })
    }
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
            let texels = &mut row[at..at + count];
            if repeats {
                let [value] = take(rest)?;
                texels.iter_mut().for_each(|texel| texel[byte] = value);
            } else {
                let (bytes, after) = rest.split_at_checked(count).ok_or("is cut off")?;
                *rest = after;
                texels.iter_mut().zip(bytes).for_each(|(texel, &value)| texel[byte] = value);
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
