use super::*;
use crate::tonemap::ToneMap;
use glam::Vec3;
use image::AnimationDecoder;
use image::codecs::gif::GifDecoder;
use std::fs;
use std::io::BufReader;

fn gradient(size: UVec2, shift: f32) -> Image {
    let mut image = Image::new(size);
    for y in 0..size.y {
        for x in 0..size.x {
            let (u, v) = (x as f32 / size.x as f32, y as f32 / size.y as f32);
            image.pixels[(y * size.x + x) as usize] = Vec3::new(u, v, 0.5 + 0.5 * (6.0 * u + shift).sin());
        }
    }
    image
}

/// Everything in the folder but the named file.
fn litter(folder: &Path, name: &str) -> usize {
    fs::read_dir(folder)
        .unwrap()
        .filter(|e| e.as_ref().unwrap().file_name() != name)
        .count()
}

#[test]
fn a_png_holds_the_tone_mapped_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let image = gradient(UVec2::new(37, 11), 0.0);
    let map = ToneMap::new(0.5);
    write_png(&path, &image, &map).unwrap();
    let read = image::open(&path).unwrap().into_rgb8();
    assert_eq!(read.dimensions(), (37, 11));
    assert_eq!(read.into_raw(), map.image(&image));
    assert_eq!(litter(folder.path(), "a.png"), 0);
}

#[test]
fn an_exr_holds_radiance_and_more_channels_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut image = gradient(UVec2::new(19, 7), 1.0);
    image.pixels[3] = Vec3::new(1e5, 1e-6, 0.0);
    let depth: Vec<f32> = (0..19 * 7).map(|k| k as f32 * 0.37).collect();
    write_exr(
        &path,
        &image,
        &[Channel {
            name: "hit.distance",
            values: &depth,
        }],
    )
    .unwrap();
    let read = image::open(&path).unwrap().into_rgb32f();
    for (a, b) in read.pixels().zip(&image.pixels) {
        assert_eq!(Vec3::from(a.0), *b);
    }
    let all = ::exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
    let channels = &all.layer_data.channel_data.list;
    let found = channels
        .iter()
        .find(|c| c.name.to_string() == "hit.distance")
        .unwrap();
    assert!(found.sample_data.values_as_f32().eq(depth.iter().copied()));
    let short = write_exr(
        &path,
        &image,
        &[Channel {
            name: "x",
            values: &depth[1..],
        }],
    )
    .unwrap_err();
    assert!(short.to_string().contains("132 pixels"), "{short}");
}

/// Frames, their delay and every pixel; also where fewer frames came than were announced.
#[test]
fn an_apng_has_its_frames_its_rate_and_exactly_its_colours() {
    let folder = tempfile::tempdir().unwrap();
    let size = UVec2::new(31, 12);
    let map = ToneMap::new(0.0);
    for (announced, pushed) in [(5_u64, 5_u32), (9, 4), (3, 1)] {
        let path = folder.path().join(format!("{announced}.apng"));
        let mut apng = ApngWriter::create(&path, size, 24.0, announced).unwrap();
        for k in 0..pushed {
            apng.push(&gradient(size, 0.2 * k as f32), &map).unwrap();
        }
        assert!(apng.push(&Image::new(UVec2::splat(3)), &map).is_err());
        apng.finish().unwrap();
        let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let mut reader = ::png::Decoder::new(file).read_info().unwrap();
        assert_eq!(reader.info().animation_control().unwrap().num_frames, pushed);
        for k in 0..pushed {
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut pixels).unwrap();
            assert_eq!(pixels, map.image(&gradient(size, 0.2 * k as f32)), "frame {k}");
            let delay = reader.info().frame_control().unwrap();
            let seconds = f64::from(delay.delay_num) / f64::from(delay.delay_den);
            assert!((seconds * 24.0 - 1.0).abs() < 1e-3, "{delay:?}");
        }
        assert!(reader.next_frame(&mut vec![0; 4096]).is_err());
    }
    for rate in [0.0, -1.0, f64::NAN, 2000.0] {
        let refused = ApngWriter::create(&folder.path().join("r.apng"), size, rate, 1).unwrap_err();
        assert!(refused.to_string().contains("frames a second"), "{refused}");
    }
}

/// Whole numbers and texts come back as they were written.
#[test]
fn an_exr_gives_back_counts_and_attributes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let image = gradient(UVec2::new(5, 3), 1.0);
    let counts = [("state.n", (0..15_u32).map(|k| u32::MAX - k).collect::<Vec<_>>())];
    let attributes = [("seed", u64::MAX.to_string()), ("passes", "7".to_owned())];
    let extras = ExrExtras {
        channels: &[],
        counts: &counts,
        attributes: &attributes,
    };
    write_exr_with(&path, &image, &extras).unwrap();
    let read = read_exr(&path).unwrap();
    assert_eq!(read.image, image);
    assert_eq!(read.counts["state.n"], counts[0].1);
    assert_eq!(read.attributes["seed"], attributes[0].1);
    assert_eq!(read.attributes["passes"], "7");
    std::fs::write(&path, [0; 100]).unwrap();
    assert!(read_exr(&path).unwrap_err().to_string().contains("cannot decode"));
    let gone = read_exr(&folder.path().join("gone.exr")).unwrap_err();
    assert!(matches!(gone, OutputError::Io { .. }), "{gone}");
}

#[test]
fn a_gif_has_its_frames_its_rate_and_nearly_its_colours() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gif");
    let size = UVec2::new(64, 48);
    let map = ToneMap::new(0.0);
    let mut gif = GifWriter::create(&path, size, 30.0).unwrap();
    for k in 0..12 {
        gif.push(&gradient(size, 0.3 * k as f32), &map).unwrap();
    }
    assert!(gif.push(&Image::new(UVec2::splat(3)), &map).is_err());
    gif.finish().unwrap();
    assert_eq!(litter(folder.path(), "a.gif"), 0);
    let decoder = GifDecoder::new(BufReader::new(fs::File::open(&path).unwrap())).unwrap();
    let frames = decoder.into_frames().collect_frames().unwrap();
    assert_eq!(frames.len(), 12);
    // 12 frames at 30 a second are 0.4 s, though no single delay is a whole number of hundredths.
    let total: u32 = frames.iter().map(|f| f.delay().numer_denom_ms().0).sum();
    assert_eq!(total, 400);
    for (k, frame) in frames.iter().enumerate() {
        let truth = map.image(&gradient(size, 0.3 * k as f32));
        let pixels = frame.buffer().pixels().map(|p| [p.0[0], p.0[1], p.0[2]]);
        // Dithering shows each colour as a mixture: means over 8 × 8 pixels are right.
        let pixels: Vec<[u8; 3]> = pixels.collect();
        let mut worst = 0.0_f32;
        for by in 0..6 {
            for bx in 0..8 {
                for c in 0..3 {
                    let (mut seen, mut wanted) = (0.0, 0.0);
                    for y in 0..8 {
                        for x in 0..8 {
                            let n = (by * 8 + y) * 64 + bx * 8 + x;
                            seen += f32::from(pixels[n][c]) / 64.0;
                            wanted += f32::from(truth[3 * n + c]) / 64.0;
                        }
                    }
                    worst = worst.max((seen - wanted).abs());
                }
            }
        }
        assert!(worst < 12.0, "frame {k}: {worst}");
    }
}

#[test]
fn an_unfinished_file_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gif");
    fs::write(&path, b"the old one").unwrap();
    let mut gif = GifWriter::create(&path, UVec2::splat(8), 10.0).unwrap();
    gif.push(&gradient(UVec2::splat(8), 0.0), &ToneMap::new(0.0))
        .unwrap();
    drop(gif);
    assert_eq!(litter(folder.path(), "a.gif"), 0);
    assert_eq!(fs::read(&path).unwrap(), b"the old one");
}

#[test]
fn impossible_outputs_are_refused_with_a_reason() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let map = ToneMap::new(0.0);
    let text = |e: OutputError| e.to_string();
    let empty = text(write_png(&path, &Image::new(UVec2::ZERO), &map).unwrap_err());
    assert!(empty.contains("1 to 16384"), "{empty}");
    let broken = Image {
        size: UVec2::splat(4),
        pixels: vec![Vec3::ONE; 3],
    };
    assert!(text(write_png(&path, &broken, &map).unwrap_err()).contains("3 pixels given"));
    let nowhere = folder.path().join("missing/a.png");
    let error = text(write_png(&nowhere, &Image::new(UVec2::ONE), &map).unwrap_err());
    assert!(error.contains("missing") && error.contains("creating"), "{error}");
    assert!(write_png(Path::new("/"), &Image::new(UVec2::ONE), &map).is_err());
    for rate in [0.0, -1.0, 51.0, f64::NAN] {
        assert!(
            text(GifWriter::create(&folder.path().join("a.gif"), UVec2::ONE, rate).unwrap_err())
                .contains("up to 50")
        );
    }
    let odd = text(Mp4Writer::create(&folder.path().join("a.mp4"), UVec2::new(5, 4), 30.0).unwrap_err());
    assert!(odd.contains("even"), "{odd}");
    assert_eq!(litter(folder.path(), ""), 0);
}

#[test]
fn mp4_is_written_where_ffmpeg_is_and_refused_by_name_where_it_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mp4");
    let size = UVec2::new(32, 16);
    match Mp4Writer::create(&path, size, 25.0) {
        Ok(mut video) => {
            for k in 0..5 {
                video.push(&gradient(size, k as f32), &ToneMap::new(0.0)).unwrap();
            }
            video.finish().unwrap();
            assert!(fs::metadata(&path).unwrap().len() > 100);
        }
        Err(error) => {
            assert!(!Mp4Writer::is_available());
            assert!(
                error.to_string().contains("ffmpeg") && error.to_string().contains("install"),
                "{error}"
            );
        }
    }
    assert_eq!(litter(folder.path(), "a.mp4"), 0);
}
