//! Tests of masks: areas of known shapes, pictures of every kind, and damaged files.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use proptest::prelude::*;

use super::*;

const MOST: usize = 1_000_000;

/// Makes a bitmap of a rule for the middle of each texel, in texture coordinates.
fn bitmap(width: usize, height: usize, rule: impl Fn(f64, f64) -> bool) -> Bitmap {
    let texel = |i: usize| {
        let (x, y) = (i % width, height - 1 - i / width);
        rule((x as f64 + 0.5) / width as f64, (y as f64 + 0.5) / height as f64)
    };
    Bitmap { width, height, texels: (0..width * height).map(texel).collect() }
}

fn area(triangles: impl IntoIterator<Item = [DVec3; 3]>) -> f64 {
    triangles.into_iter().map(|[a, b, c]| 0.5 * (b - a).cross(c - a).z).sum()
}

/// Cuts a square of 1 m2 that shows the texture coordinates from `low` to `high`.
fn card(bitmap: &Bitmap, clamp: bool, low: [f64; 2], high: [f64; 2]) -> Vec<[DVec3; 3]> {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(DVec2::from_array);
    let (low, high) = (DVec2::from_array(low), DVec2::from_array(high));
    let triangles = [[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i: usize| corners[i].extend(0.0)));
    let textures =
        [[0, 1, 2], [0, 2, 3]].map(|t| Some(t.map(|i: usize| low + corners[i] * (high - low))));
    let reach = low.abs().max(high.abs()).max_element().ceil().max(1.0);
    let mask = Mask::new(bitmap.clone(), clamp, reach).unwrap();
    let pieces = mask.cut(&triangles, &textures, MOST).unwrap();
    assert!(pieces.is_sorted_by_key(|piece| piece.source));
    pieces.into_iter().map(|piece| piece.corners).collect()
}

fn whole(bitmap: &Bitmap) -> Vec<[DVec3; 3]> {
    card(bitmap, false, [0.0; 2], [1.0; 2])
}

#[test]
fn what_is_left_has_the_share_of_the_texels() {
    let disc = |x: f64, y: f64| (x - 0.5).hypot(y - 0.5) < 0.4;
    let ring = |x: f64, y: f64| disc(x, y) && (x - 0.5).hypot(y - 0.4) > 0.2;
    let checker =
        |n: f64| move |x: f64, y: f64| ((x * n) as u32 + (y * n) as u32).is_multiple_of(2);
    let leaf =
        |x: f64, y: f64| (y - 0.5).abs() < 0.45 * (PI * x).sin() * (1.0 - 0.2 * (40.0 * x).sin());
    let rows: [(&str, Bitmap, usize); 9] = [
        ("half", bitmap(16, 16, |x, _| x < 0.5), 4),
        ("one texel of four", bitmap(2, 2, |x, y| x < 0.5 && y > 0.5), 4),
        ("small checker", bitmap(2, 2, checker(2.0)), 8),
        ("checker", bitmap(64, 64, checker(8.0)), 160),
        ("every other texel", bitmap(8, 8, checker(8.0)), 160),
        ("disc", bitmap(256, 256, disc), 40),
        ("large disc", bitmap(1024, 1024, disc), 40),
        ("ring", bitmap(256, 200, ring), 80),
        ("leaf", bitmap(512, 256, leaf), 150),
    ];
    for (name, bitmap, most) in rows {
        let left = whole(&bitmap);
        let (found, share) = (area(left.iter().copied()), bitmap.share());
        assert!((found / share - 1.0).abs() < 1e-3, "{name}: {found}, must be {share}");
        assert!(left.len() <= most, "{name}: {} triangles", left.len());
        assert!(left.iter().all(|t| area([*t]) > 0.0), "{name}: a triangle is turned over");
    }
}

#[test]
fn the_picture_stands_upright_and_repeats() {
    let texel = bitmap(4, 4, |x, y| x < 0.25 && y > 0.75);
    let middle = whole(&texel).concat().iter().sum::<DVec3>() / 3.0;
    assert!(middle.x < 1.0 && middle.y > 1.0, "the top left: {middle}");
    let of = |clamp, low, high| area(card(&texel, clamp, low, high));
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-6, "{found}");
    near(of(false, [0.0, 0.0], [3.0, 2.0]), 1.0 / 16.0);
    near(of(false, [-1.0, 5.0], [-2.0, 6.0]), 1.0 / 16.0);
    near(of(false, [0.0, 0.75], [0.25, 1.0]), 1.0);
    near(of(false, [-0.5, 0.5], [0.5, 1.5]), 1.0 / 16.0);
    // the corner texel goes on to the top left
    near(of(true, [-1.0, 0.0], [1.0, 2.0]), 1.25 * 1.25 / 4.0);
    near(of(true, [5.0, 0.0], [6.0, 1.0]), 0.0);
    // turned over by its texture coordinates, the card keeps its side
    near(of(false, [1.0, 0.0], [0.0, 1.0]), 1.0 / 16.0);
}

#[test]
fn what_is_all_there_stays_as_it_is() {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::new(0.1, 0.7, 0.3)];
    let texture = [DVec2::ZERO, DVec2::X, DVec2::Y];
    let cut = |mask: &Mask, texture| mask.cut(&[corners], &[texture], MOST).unwrap();
    let opaque = Mask::new(bitmap(3, 3, |_, _| true), false, 1.0).unwrap();
    assert_eq!(cut(&opaque, Some(texture))[0].corners, corners);
    let clear = Mask::new(bitmap(3, 3, |_, _| false), false, 1.0).unwrap();
    assert!(cut(&clear, Some(texture)).is_empty());
    assert_eq!(cut(&clear, None)[0].corners, corners, "no texture coordinates");
    let half = Mask::new(bitmap(8, 8, |x, _| x < 0.5), false, 1.0).unwrap();
    let within = texture.map(|at| 0.4 * at + 0.05);
    assert_eq!(cut(&half, Some(within))[0].corners, corners);
    // coordinates without area are there or not
    assert_eq!(cut(&half, Some([DVec2::splat(0.25); 3])).len(), 1);
    assert_eq!(cut(&half, Some([DVec2::splat(0.75); 3])).len(), 0);
    let often = half.cut(&[corners], &[Some(texture.map(|at| at * 1000.0))], MOST);
    assert!(often.unwrap_err().contains("repeats 1000000 times"));
    let far = texture.map(|at| at + 1e300);
    assert!(half.cut(&[corners], &[Some(far)], MOST).is_ok());
}

fn png(color: png::ColorType, depth: png::BitDepth, size: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size, 1);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == png::ColorType::Indexed {
        encoder.set_palette(vec![0, 0, 0, 255, 255, 255]);
        encoder.set_trns(vec![255, 0]);
    }
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    bytes
}

/// A TGA file of one row.
fn tga(kind: u8, bits: u8, descriptor: u8, width: u8, data: &[u8]) -> Vec<u8> {
    let head = [0, 0, kind, 0, 0, 0, 0, 0, 0, 0, 0, 0, width, 0, 1, 0, bits, descriptor];
    [&head, data].concat()
}

#[test]
fn every_kind_of_picture_is_read() {
    use png::{BitDepth::*, ColorType::*};
    let rows: [(&str, Vec<u8>, Channel); 14] = [
        ("grey", png(Grayscale, Eight, 2, &[127, 128]), Channel::Luminance),
        ("1 bit", png(Grayscale, One, 2, &[0b0100_0000]), Channel::Luminance),
        ("16 bits", png(Grayscale, Sixteen, 2, &[127, 255, 128, 0]), Channel::Luminance),
        ("grey and alpha", png(GrayscaleAlpha, Eight, 2, &[9, 0, 9, 255]), Channel::Alpha),
        ("RGB", png(Rgb, Eight, 2, &[0, 0, 0, 255, 255, 255]), Channel::Luminance),
        ("red", png(Rgb, Eight, 2, &[0, 255, 255, 255, 0, 0]), Channel::Red),
        ("RGBA", png(Rgba, Eight, 2, &[9, 9, 9, 1, 9, 9, 9, 200]), Channel::Alpha),
        ("palette", png(Indexed, Eight, 2, &[1, 0]), Channel::Alpha),
        ("TGA RGBA", tga(2, 32, 8, 2, &[1, 2, 3, 0, 1, 2, 3, 255]), Channel::Alpha),
        ("TGA RLE", tga(10, 32, 8, 2, &[0x80, 1, 2, 3, 0, 0, 1, 2, 3, 255]), Channel::Alpha),
        ("TGA from the right", tga(3, 8, 0x10, 2, &[255, 0]), Channel::Luminance),
        ("TGA grey", tga(3, 8, 0, 2, &[0, 255]), Channel::Luminance),
        ("TGA RGB", tga(2, 24, 0, 2, &[0, 0, 0, 255, 255, 255]), Channel::Luminance),
        ("TGA blue", tga(2, 24, 0, 2, &[0, 255, 255, 255, 0, 0]), Channel::Blue),
    ];
    for (name, bytes, channel) in rows {
        let picture = Picture::read(&bytes).unwrap_or_else(|why| panic!("{name}: {why}"));
        let read = picture.bitmap(channel, [0.0, 1.0]);
        assert_eq!(read.texels, [false, true], "{name}");
        assert_eq!(picture.has_alpha(), channel == Channel::Alpha, "{name}");
    }
    // the first row of a TGA file is the lowest
    let two = [0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 2, 0, 8, 0, 0, 255];
    let read = Picture::read(&two).unwrap().bitmap(Channel::Luminance, [0.0, 1.0]);
    assert_eq!(read.texels, [true, false]);
    assert!(!read.at(0, 0) && read.at(0, 1));
    for (bytes, problem) in [
        (&b""[..], "neither a PNG nor a TGA"),
        (b"\xff\xd8\xff\xe0", "is a JPEG file"),
        (b"\x89PNG\r\n\x1a\n", "is a damaged PNG"),
        (&tga(2, 24, 0, 2, &[0, 0, 0]), "fewer than its 2 x 1 texels"),
        (&tga(10, 24, 0, 2, &[0x80, 0, 0, 0]), "fewer than its 2 x 1 texels"),
        (&tga(2, 24, 0, 0, &[]), "has no texels"),
    ] {
        assert!(Picture::read(bytes).unwrap_err().contains(problem), "{problem}");
    }
    let mut large = tga(3, 8, 0, 2, &[0, 0]);
    large[12..16].fill(255);
    assert!(Picture::read(&large).unwrap_err().contains("more than 67108864"));
}

fn config() -> ProptestConfig {
    ProptestConfig { failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn no_spoiled_picture_panics(
        kind in 0..4usize,
        changes in proptest::collection::vec((0..200usize, any::<u8>()), 0..6),
        length in 0..200usize,
    ) {
        let mut bytes = match kind {
            0 => png(png::ColorType::Rgba, png::BitDepth::Eight, 2, &[9; 8]),
            1 => tga(2, 32, 8, 2, &[1, 2, 3, 0, 1, 2, 3, 255]),
            2 => tga(10, 32, 8, 2, &[0x80, 1, 2, 3, 0, 0, 1, 2, 3, 255]),
            _ => [&[0, 1, 1, 0, 0, 2, 0, 24, 0, 0, 0, 0, 2, 0, 1, 0, 8, 0][..], &[7; 8]].concat(),
        };
        for (at, byte) in changes {
            if let Some(place) = bytes.get_mut(at) {
                *place = byte;
            }
        }
        bytes.truncate(length.max(18));
        if let Ok(picture) = Picture::read(&bytes) {
            picture.bitmap(Channel::Luminance, [0.0, 1.0]);
        }
    }

    /// The area of random texels is kept on random triangles, also where the picture repeats: two
    /// triangles that share an edge make up a parallelogram of whole pictures.
    #[test]
    fn no_bitmap_panics_and_areas_hold(
        width in 1..24usize,
        seed in proptest::collection::vec(any::<bool>(), 24 * 24),
        height in 1..24usize,
        shift in -2.0..2.0f64,
        skew in -2..3i32,
    ) {
        let bitmap = Bitmap { width, height, texels: seed[..width * height].to_vec() };
        let mask = Mask::new(bitmap.clone(), false, 1.0).unwrap();
        let (o, u, v) = (DVec2::splat(shift), DVec2::X, DVec2::new(f64::from(skew), 1.0));
        let textures = [[o, o + u, o + u + v], [o, o + u + v, o + v]];
        let triangles = textures.map(|t| t.map(|at| at.extend(0.0)));
        let pieces = mask.cut(&triangles, &textures.map(Some), MOST).unwrap();
        let found = area(pieces.iter().map(|piece| piece.corners));
        prop_assert!((found - bitmap.share()).abs() < 2e-3 + 1e-3 * bitmap.share(), "{found}");
    }
}
