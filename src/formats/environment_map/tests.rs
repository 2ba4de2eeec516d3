use std::io::Cursor;

use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image, SmallVec, WritableImage, f16};
use proptest::prelude::*;

use super::*;
use crate::scene::daylight::SunPosition;

fn parse(bytes: &[u8]) -> Result<Panorama> {
    Panorama::parse(bytes, Path::new("sky.hdr"))
}

fn exr_bytes(channels: Vec<(&str, FlatSamples)>, size: (usize, usize)) -> Vec<u8> {
    let channels: SmallVec<[AnyChannel<FlatSamples>; 4]> =
        channels.into_iter().map(|(name, values)| AnyChannel::new(name, values)).collect();
    let mut bytes = Cursor::new(Vec::new());
    let image = Image::from_channels(size, AnyChannels::sort(channels));
    image.write().non_parallel().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// Makes a picture of 16 x 2 texels in which each row has runs and single bytes; its exposure is 2
/// x 4.
fn hdr_bytes() -> Vec<u8> {
    let mut bytes =
        b"#?RADIANCE\nEXPOSURE=2\n# a comment\nEXPOSURE= 4\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 16\n"
            .to_vec();
    for row in 0..2u8 {
        bytes.extend([2, 2, 0, 16]);
        bytes.extend([128 + 16, 128]);
        bytes.push(16);
        bytes.extend((0..16).map(|i| 8 * i + row));
        bytes.extend([128 + 10, 0, 128 + 6, 64]);
        bytes.extend([128 + 16, 129]);
    }
    bytes
}

#[test]
fn hdr_is_read_and_divided_by_its_exposure() {
    let picture = parse(&hdr_bytes()).unwrap();
    assert_eq!((picture.width, picture.height), (16, 2));
    let value = |channel: usize, texel: usize| picture.channels[channel].1[texel];
    // 128 x 2^(129 - 136) = 1, divided by the exposure of 8
    assert_eq!(value(0, 5), 0.125);
    assert_eq!(value(1, 16 + 3), 25.0 / 128.0 / 8.0);
    assert_eq!((value(2, 9), value(2, 10)), (0.0, 0.0625));
    // texels one after the other, with a run of the old kind
    let plain =
        b"#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 4\n\x80\x40\x00\x81\x01\x01\x01\x03".to_vec();
    let picture = parse(&plain).unwrap();
    assert_eq!(picture.channels[0].1, [1.0; 4]);
    assert_eq!(picture.channels[1].1, [0.5; 4]);
}

#[test]
fn channels_become_bands() {
    let numbers = |first: f32| (0..32).map(|i| first + i as f32).collect::<Vec<f32>>();
    let bytes = exr_bytes(
        vec![
            ("PAR", FlatSamples::F32(numbers(0.0))),
            ("NIR", FlatSamples::F16(vec![f16::from_f32(0.5); 32])),
            ("R", FlatSamples::F32(numbers(3.0))),
            ("G", FlatSamples::F32(numbers(6.0))),
            ("B", FlatSamples::F32(numbers(9.0))),
        ],
        (8, 4),
    );
    let path = Path::new("sky.exr");
    let picture = Panorama::parse(&bytes, path).unwrap();
    let zenith = SunPosition { elevation: 1.5, azimuth: 0.1 }.direction(0.0);
    // azimuth 0.1 falls just right of the middle, into the fifth of 8 columns
    let look = |bands: &[&str], scale: &[f64]| {
        let map = picture.map(path, bands, 0.0, scale).unwrap();
        let cell = map.cell(zenith);
        (0..bands.len()).map(|b| map.radiance(cell, b)).collect::<Vec<f32>>()
    };
    assert_eq!(look(&["PAR"], &[2.0]), [8.0]);
    assert_eq!(look(&["NIR", "PAR"], &[1.0, 3.0]), [0.5, 12.0]);
    assert_eq!(look(&["other"], &[1.0]), [10.0]);
    assert_eq!(look(&["a", "b", "c"], &[1.0, 1.0, 2.0]), [7.0, 10.0, 26.0]);
    let error = picture.map(path, &["a", "b"], 0.0, &[1.0; 2]).unwrap_err().to_string();
    let start =
        "sky.exr: its channels `B`, `G`, `NIR`, `PAR`, `R` are not those of the 2 bands; name the";
    assert!(error.starts_with(start), "{error}");
    // with the map turned by a quarter, the same texel lies in the east
    let map = picture.map(path, &["PAR"], std::f64::consts::FRAC_PI_2, &[1.0]).unwrap();
    let east = SunPosition { elevation: 1.5, azimuth: std::f64::consts::FRAC_PI_2 + 0.1 };
    assert_eq!(map.radiance(map.cell(east.direction(0.0)), 0), 4.0);
}

#[test]
fn what_is_no_radiance_is_refused() {
    let path = Path::new("sky.exr");
    for (bad, word) in [(-1.0, "-1"), (f32::NAN, "NaN"), (f32::INFINITY, "inf")] {
        let mut values = vec![1.0; 32];
        values[13] = bad;
        let bytes = exr_bytes(vec![("PAR", FlatSamples::F32(values))], (8, 4));
        let picture = Panorama::parse(&bytes, path).unwrap();
        let error = picture.map(path, &["PAR"], 0.0, &[1.0]).unwrap_err().to_string();
        let start = format!(
            "sky.exr: the texel in row 1, column 5 (both from 0) is {word}; radiance must be"
        );
        assert!(error.starts_with(&start), "{error}");
    }
    let header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n".to_vec();
    let with = |text: &[u8]| [&header[..], text].concat();
    for (bytes, start) in [
        (b"P6 1 1".to_vec(), "sky.hdr: is neither OpenEXR nor Radiance HDR; save the map as"),
        (
            b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n".to_vec(),
            "sky.hdr: is not of the format",
        ),
        (b"#?RADIANCE\n".to_vec(), "sky.hdr: is cut off in its header"),
        (
            b"#?RADIANCE\nEXPOSURE=0\nFORMAT=32-bit_rle_rgbe\n\n".to_vec(),
            "sky.hdr: its EXPOSURE is not",
        ),
        (with(b"+Y 1 +X 1\n\x80\x40\x00\x81"), "sky.hdr: its rows do not run from the upper left"),
        (
            with(b"-Y 99999999 +X 99999999\n"),
            "sky.hdr: has 99999999 x 99999999 texels in 3 channels",
        ),
        (with(b"-Y 0 +X 8\n"), "sky.hdr: has 8 x 0 texels"),
        (with(b"-Y 4000 +X 8000\n"), "sky.hdr: is cut off"),
        (with(b"-Y 1 +X 2\n\x01\x01\x01\x09"), "sky.hdr: has a run that is longer"),
        (with(b"-Y 1 +X 8\n\x02\x02\x00\x08\x00"), "sky.hdr: has a run that is longer"),
    ] {
        let error = parse(&bytes).unwrap_err().to_string();
        assert!(error.starts_with(start), "{error}\n{start}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_spoiled_picture_panics(
        exr in any::<bool>(),
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        cut in any::<prop::sample::Index>(),
        whole in any::<bool>(),
    ) {
        let mut bytes = match exr {
            true => exr_bytes(vec![("R", FlatSamples::F32(vec![1.0; 32]))], (8, 4)),
            false => hdr_bytes(),
        };
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if !whole {
            bytes.truncate(cut.index(bytes.len()));
        }
        if let Ok(picture) = parse(&bytes) {
            let _ = picture.map(Path::new("x"), &["R"], 0.0, &[1.0]);
        }
    }
}
