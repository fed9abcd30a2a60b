use super::*;

/// A PNG of such samples.
fn encoded(size: [u32; 2], colour: ::png::ColorType, depth: ::png::BitDepth, samples: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    if colour == ::png::ColorType::Indexed {
        encoder.set_palette(vec![0, 0, 0, 255, 0, 0, 0, 255, 0]);
        encoder.set_trns(vec![255, 255, 0]);
    }
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(samples).unwrap();
    writer.finish().unwrap();
    bytes
}

fn whole(bytes: &[u8]) -> Vec<[f32; 4]> {
    decode(bytes).unwrap().reduced(1, Encoding::Linear).values
}

#[test]
fn every_kind_of_png_is_the_same_picture() {
    use ::png::{BitDepth, ColorType};
    let red_and_clear = vec![[1.0, 0.0, 0.0, 1.0], [0.0; 4]];
    let kinds: [(ColorType, BitDepth, &[u8]); 4] = [
        (ColorType::Rgba, BitDepth::Eight, &[255, 0, 0, 255, 0, 255, 0, 0]),
        (ColorType::Rgba, BitDepth::Sixteen, &[255, 255, 0, 0, 0, 0, 255, 255, 0, 0, 255, 255, 0, 0, 0, 0]),
        (ColorType::Indexed, BitDepth::Eight, &[1, 2]),
        (ColorType::Indexed, BitDepth::Two, &[0b0110_0000]),
    ];
    for (colour, depth, samples) in kinds {
        assert_eq!(whole(&encoded([2, 1], colour, depth, samples)), red_and_clear, "{colour:?} {depth:?}");
    }
    let grey = whole(&encoded([2, 1], ColorType::Grayscale, BitDepth::One, &[0b1000_0000]));
    assert_eq!(grey, [[1.0; 4], [0.0, 0.0, 0.0, 1.0]]);
}

#[test]
fn pictures_are_reduced_in_light_not_in_their_code() {
    use ::png::{BitDepth, ColorType};
    let samples = [255, 255, 0, 0, 9, 255, 0, 255, 0, 9];
    let decoded = decode(&encoded([5, 2], ColorType::Grayscale, BitDepth::Eight, &samples)).unwrap();
    let reduced = decoded.reduced(2, Encoding::Srgb);
    assert_eq!(reduced.size, [2, 1], "the fifth column fills no square");
    assert!((reduced.values[0][0] - 0.75).abs() < 1e-6 && (reduced.values[1][0] - 0.25).abs() < 1e-6);
    let half = decode(&encoded([1, 1], ColorType::Grayscale, BitDepth::Eight, &[188])).unwrap();
    assert!((half.reduced(1, Encoding::Srgb).values[0][0] - 0.5).abs() < 3e-3);
    let clear = encoded([2, 1], ColorType::Rgba, BitDepth::Eight, &[255, 0, 0, 255, 255, 255, 255, 0]);
    assert_eq!(decode(&clear).unwrap().reduced(2, Encoding::Linear).values, [[0.5, 0.0, 0.0, 0.5]]);
}

#[test]
fn halving_is_a_reduction_by_two() {
    use ::png::{BitDepth, ColorType};
    let samples: Vec<u8> = (0..24).map(|i| (i * 37 % 256) as u8).collect();
    let decoded = decode(&encoded([6, 4], ColorType::Grayscale, BitDepth::Eight, &samples)).unwrap();
    let halved = decoded.reduced(1, Encoding::Linear).halved();
    let reduced = decoded.reduced(2, Encoding::Linear);
    assert_eq!(halved.size, reduced.size);
    for (a, b) in halved.values.iter().zip(&reduced.values) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-6));
    }
}

/// A JPEG of 8 x 8 pixels of one grey, 8 bits, baseline.
const GREY_JPEG: &[u8] = include_bytes!("grey.jpg");

#[test]
fn a_jpeg_is_read() {
    let pixels = decode(GREY_JPEG).unwrap().reduced(1, Encoding::Linear);
    assert_eq!(pixels.size, [16, 8]);
    assert!(pixels.values.iter().all(|p| (p[0] - 0.5).abs() < 0.02 && p[3] == 1.0), "{:?}", pixels.values[0]);
}

#[test]
fn what_is_no_picture_or_too_large_is_told() {
    let complaint = |bytes: &[u8]| decode(bytes).err().map(|fault| fault.to_string()).unwrap();
    assert!(complaint(b"GIF89a").contains("neither a PNG nor a JPEG"));
    assert!(complaint(b"").contains("is empty"));
    assert!(complaint(&GREY_JPEG[..40]).contains("the JPEG"));
    use ::png::{BitDepth, ColorType};
    let mut large = encoded([2, 1], ColorType::Grayscale, BitDepth::Eight, &[0, 0]);
    large[16..24].copy_from_slice(&[0, 0, 0x75, 0x30, 0, 0, 0x75, 0x30]);
    // The header's check sum, made anew.
    let sum = crc32fast::hash(&large[12..29]);
    large[29..33].copy_from_slice(&sum.to_be_bytes());
    assert!(complaint(&large).contains("30000 x 30000 pixels"), "{}", complaint(&large));
    let mut large = GREY_JPEG.to_vec();
    let frame = large.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
    large[frame + 5..frame + 9].copy_from_slice(&[0x75, 0x30, 0x75, 0x30]);
    assert!(complaint(&large).contains("the JPEG"), "{}", complaint(&large));
}
