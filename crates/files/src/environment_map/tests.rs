use std::io::Cursor;

use exr::{
    image::write::layers::WritableLayers,
    meta::{attribute::EnvironmentMap, header::ImageAttributes},
    prelude::{
        AnyChannel, AnyChannels, Encoding, FlatSamples, Image, IntegerBounds, Layer,
        LayerAttributes, SmallVec, Vec2, WritableImage, f16,
    },
};
use proptest::prelude::*;

use super::*;
use phylux_core::scene::daylight::SunPosition;

fn parse(bytes: &[u8]) -> Result<Panorama> {
    Panorama::parse(bytes, Path::new("sky.hdr"))
}

fn exr_bytes(channels: Vec<(&str, FlatSamples)>, size: (usize, usize)) -> Vec<u8> {
    written(&Image::from_channels(size, exr_channels(channels)))
}

fn exr_channels(channels: Vec<(&str, FlatSamples)>) -> AnyChannels<FlatSamples> {
    let channels: SmallVec<[AnyChannel<FlatSamples>; 4]> =
        channels.into_iter().map(|(name, values)| AnyChannel::new(name, values)).collect();
    AnyChannels::sort(channels)
}

fn written<'i, L: WritableLayers<'i>>(image: &'i Image<L>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// Makes a picture of 16 x 8 texels in which each row has runs and single bytes; its exposure is 2
/// x 4.
fn hdr_bytes() -> Vec<u8> {
    let mut bytes =
        b"#?RADIANCE\nEXPOSURE=2\n# a comment\nEXPOSURE= 4\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n"
            .to_vec();
    for row in 0..8u8 {
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
    assert_eq!((picture.width, picture.height), (16, 8));
    let value = |channel: usize, texel: usize| picture.channels[channel].1[texel];
    // 128.5 x 2^(129 - 136), divided by the exposure of 8
    assert_eq!(value(0, 5), 128.5 / 128.0 / 8.0);
    assert_eq!(value(1, 16 + 3), 25.5 / 128.0 / 8.0);
    assert_eq!((value(2, 9), value(2, 10)), (0.5 / 128.0 / 8.0, 64.5 / 128.0 / 8.0));
    // texels one after the other, with a run of the old kind
    let plain =
        b"#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n\x80\x40\x00\x81\x01\x01\x01\x03\x80\x40\x00\x81\x01\x01\x01\x03".to_vec();
    let picture = parse(&plain).unwrap();
    assert_eq!(picture.channels[0].1, [128.5 / 128.0; 8]);
    assert_eq!(picture.channels[1].1, [64.5 / 128.0; 8]);
}

/// The same picture in each of the eight orders of rows and columns, with the factors of its header.
#[test]
fn rows_and_columns_come_in_any_order() {
    let (width, height) = (4, 2);
    let header = "#?RADIANCE\nCOLORCORR=1 2 4\nPIXASPECT=0.5\nPIXASPECT=2\nEXPOSURE=0.5\n\
        \tVIEW= -vtv\nFORMAT=32-bit_rle_rgbe\n\n";
    for size in ["-Y 2 +X 4", "-Y 2 -X 4", "+Y 2 +X 4", "+Y 2 -X 4", "-X 4 -Y 2", "+X 4 +Y 2"]
        .into_iter()
        .chain(["+X 4 -Y 2", "-X 4 +Y 2"])
    {
        let words: Vec<&str> = size.split(' ').collect();
        let number = |i: usize| words[i].parse::<usize>().unwrap();
        let mut bytes = [header, size, "\n"].concat().into_bytes();
        for line in 0..number(1) {
            for texel in 0..number(3) {
                // the row and the column that stand here, as the two axes say
                let at = |axis: char| {
                    let i = usize::from(words[2].ends_with(axis)) * 2;
                    let count = if i == 0 { line } else { texel };
                    let forward = words[i] == "-Y" || words[i] == "+X";
                    if forward { count } else { number(i + 1) - 1 - count }
                };
                let value = (20 + 10 * at('Y') + at('X')) as u8;
                bytes.extend([value, value, value, 136]);
            }
        }
        let picture = parse(&bytes).unwrap_or_else(|e| panic!("{size}: {e}"));
        assert_eq!((picture.width, picture.height), (width, height), "{size}");
        for (channel, factor) in picture.channels.iter().zip([2.0, 1.0, 0.5]) {
            let expected = [20, 21, 22, 23, 30, 31, 32, 33].map(|v| (v as f32 + 0.5) * factor);
            assert_eq!(channel.1, expected, "{size}");
        }
        assert_eq!(picture.notes(&["all"]), [""; 0]);
    }
    let wide = "#?RADIANCE\nPIXASPECT=0.5\nGAMMA=2.2\nVIEW= -vth -vh 180\nFORMAT=32-bit_rle_rgbe\n\n\
        -Y 2 +X 2\nAAAAAAAAAAAAAAAA";
    let error = parse(wide.replace("0.5", "1").as_bytes()).unwrap_err().to_string();
    assert!(error.starts_with("sky.hdr: is 2 x 2 texels, not twice as wide"), "{error}");
    let error = parse(wide.replace("0.5", "0.25").as_bytes()).unwrap_err().to_string();
    assert!(error.starts_with("sky.hdr: is 2 x 2 texels whose width is 4.000 of"), "{error}");
    let notes = parse(wide.as_bytes()).unwrap().notes(&["all"]).join("; ");
    assert!(
        notes.contains("GAMMA=2.2 is not") && notes.contains("VIEW=-vth -vh 180 is"),
        "{notes}"
    );
}

/// An OpenEXR file stores the texels of its data window; the picture is the display window.
#[test]
fn a_data_window_is_placed_in_the_display_window() {
    let picture = |size: (usize, usize), at: [i32; 2], display: IntegerBounds| {
        let values = (1..=size.0 * size.1).map(|i| i as f32).collect();
        let channels = exr_channels(vec![("R", FlatSamples::F32(values))]);
        let mut layer = LayerAttributes::named("main");
        layer.layer_position = Vec2(at[0], at[1]);
        let layer = Layer::new(size, layer, Encoding::FAST_LOSSLESS, channels);
        let mut image = Image::from_layer(layer);
        image.attributes.display_window = display;
        image
    };
    let read = |size, at, display| {
        let image = picture(size, at, display);
        Panorama::parse(&written(&image), Path::new("sky.exr"))
    };
    let window = |x, y, width, height| IntegerBounds::new((x, y), (width, height));
    // inside, beyond the left and lower edges, larger on all sides, elsewhere
    for (size, at, display, expected) in [
        ((2, 1), [1, 0], window(0, 0, 4, 2), [0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ((3, 2), [-1, 1], window(0, 0, 4, 2), [0.0, 0.0, 0.0, 0.0, 2.0, 3.0, 0.0, 0.0]),
        ((6, 4), [9, 19], window(10, 20, 4, 2), [8.0, 9.0, 10.0, 11.0, 14.0, 15.0, 16.0, 17.0]),
        ((4, 2), [40, -20], window(0, 0, 4, 2), [0.0; 8]),
        ((4, 2), [-40, 20], window(0, 0, 4, 2), [0.0; 8]),
    ] {
        let picture = read(size, at, display).unwrap();
        assert_eq!((picture.width, picture.height), (4, 2));
        assert_eq!(picture.channels[0].1, expected, "{size:?} {at:?}");
        let notes = picture.notes(&["R"]).join("; ");
        assert!(notes.contains("is not its display window, 4 x 2"), "{notes}");
    }
    let same = read((4, 2), [3, -2], window(3, -2, 4, 2)).unwrap();
    assert_eq!((same.channels[0].1[0], same.notes(&["R"])), (1.0, vec![]));
    let error = read((4, 2), [0, 0], window(0, 0, 4, 4)).unwrap_err().to_string();
    assert!(error.starts_with("sky.exr: is 4 x 4 texels, not twice"), "{error}");
    // what the attribute `envmap` says
    for (kind, cropped, problem) in [
        (EnvironmentMap::Cube, false, "is a cube map (its attribute"),
        (EnvironmentMap::LatitudeLongitude, true, "leaves open which of the two"),
        (EnvironmentMap::LatitudeLongitude, false, ""),
    ] {
        let mut image = picture((4, 2), [0, 0], window(0, 0, if cropped { 8 } else { 4 }, 2));
        image.layer_data.attributes.environment_map = Some(kind);
        image.layer_data.attributes.white_luminance = Some(80.0);
        match Panorama::parse(&written(&image), Path::new("sky.exr")) {
            Ok(picture) => assert!(picture.notes(&["R"])[0].contains("`whiteLuminance` of 80")),
            Err(error) => {
                let error = error.to_string();
                assert!(!problem.is_empty() && error.contains(problem), "{error}");
            }
        }
    }
}

#[test]
fn channels_and_layers_that_are_not_used_are_told() {
    let values = || FlatSamples::F32(vec![1.0; 8]);
    let layer = |name: &str| {
        let channels = ["A", "B", "G", "NIR", "R"].map(|channel| (channel, values()));
        let attributes = LayerAttributes::named(name);
        Layer::new((4, 2), attributes, Encoding::FAST_LOSSLESS, exr_channels(channels.into()))
    };
    let attributes = ImageAttributes::with_size((4, 2));
    let image = Image::from_layers(attributes, vec![layer("left"), layer("right")]);
    let picture = Panorama::parse(&written(&image), Path::new("sky.exr")).unwrap();
    let notes = picture.notes(&["NIR"]).join("; ");
    assert_eq!(
        notes,
        "of its layers only the first, `left`, is read, not `right`; its channels `B`, `G`, `R` are \
         not used: the bands have `NIR`"
    );
    assert!(
        picture.notes(&["a", "b", "c"])[1]
            .contains("`NIR` are not used: the bands have `R`, `G`, `B`")
    );
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
        (b"P6 1 1".to_vec(), "sky.hdr: is neither OpenEXR nor Radiance HDR; save the map by"),
        (
            b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n".to_vec(),
            "sky.hdr: has the colours X, Y, Z",
        ),
        (b"#?RADIANCE\n".to_vec(), "sky.hdr: is cut off in its header"),
        (
            b"#?RADIANCE\nEXPOSURE=0\nFORMAT=32-bit_rle_rgbe\n\n".to_vec(),
            "sky.hdr: its EXPOSURE is not",
        ),
        (with(b"-Y 1 -Y 1\n\x80\x40\x00\x81"), "sky.hdr: its size is `-Y 1 -Y 1`, not as -Y"),
        (with(b"-Y 1\n\x80\x40\x00\x81"), "sky.hdr: its size is `-Y 1`, not as -Y"),
        (
            with(b"-Y 99999999 +X 99999999\n"),
            "sky.hdr: has 99999999 x 99999999 texels in 3 channels",
        ),
        (with(b"-Y 16 +X 16\n"), "sky.hdr: is 16 x 16 texels, not twice as wide as high: a map"),
        (with(b"-Y 6 +X 1\n"), "sky.hdr: is 1 x 6 texels, not twice"),
        (with(b"+X 8 -Y 16\n"), "sky.hdr: is 8 x 16 texels, not twice"),
        (with(b"-Y 0 +X 8\n"), "sky.hdr: has 8 x 0 texels"),
        (with(b"-Y 4000 +X 8000\n"), "sky.hdr: is cut off"),
        (with(b"-Y 1 +X 2\n\x01\x01\x01\x09"), "sky.hdr: has a run that is longer"),
        (with(b"-Y 4 +X 8\n\x02\x02\x00\x08\x00"), "sky.hdr: has a run that is longer"),
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
