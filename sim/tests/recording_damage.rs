//! Cut, changed, spliced and hostile recordings: no panic, no allocation past the limit, no wrong frame taken for good,
//! and every whole frame that can be told from the rest is read.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

#[path = "recording_common/counting.rs"]
mod counting;
#[path = "recording_common/file.rs"]
mod file;
mod recording_common;

use file::{CHUNK_HEADER, PREAMBLE, TRAILER, chunks, reseal, reseal_header, u32_at};
use meniscus_sim::glam::UVec2;
use meniscus_sim::recording::{Reader, RecordingError, ReplaySource, Writer};
use meniscus_sim::rng::Rng;
use meniscus_sim::{Channels, Frame, FrameSource, Progress, Scene, SourceError};
use recording_common::{bits, frame, report, scene};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

#[global_allocator]
static ALLOCATOR: counting::Counting = counting::Counting;

/// Changed bytes.
const CHANGES: usize = 10_000;
/// Large enough for every predictor.
const SIZE: UVec2 = UVec2::new(48, 45);
const FRAMES: u64 = 5;
/// What the reader may allocate here: a file has 150 KB and a frame 75 KB; the rest is work space of pco and serde.
const MEMORY: usize = 4 << 20;

/// Tests that count allocations must not run beside others.
static ALONE: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    // A test that failed has left nothing behind.
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

struct Sample {
    _folder: tempfile::TempDir,
    path: PathBuf,
    scene: Scene,
    bytes: Vec<u8>,
    frames: Vec<Vec<u32>>,
}

impl Sample {
    /// A recording of every channel; a finished one has an index.
    fn new(finished: bool) -> Self {
        Self::with(SIZE, Channels::ALL, finished)
    }

    fn with(size: UVec2, channels: Channels, finished: bool) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sample.mrec");
        let scene = scene(size, 0.0);
        let mut writer = Writer::create(&path, &scene, channels).unwrap();
        let mut frames = Vec::new();
        for k in 0..FRAMES {
            let frame = frame(scene.grid, channels, k);
            frames.push(bits(&frame));
            writer.push(&frame, Some(report(k))).unwrap();
        }
        if finished {
            writer.finish().unwrap();
        } else {
            drop(writer);
        }
        let bytes = std::fs::read(&path).unwrap();
        Self {
            _folder: folder,
            path,
            scene,
            bytes,
            frames,
        }
    }

    fn open(&self, bytes: &[u8]) -> Result<Reader, RecordingError> {
        std::fs::write(&self.path, bytes).unwrap();
        Reader::open(&self.path)
    }

    /// Offset and end of each frame's chunk.
    fn frame_chunks(&self) -> Vec<(usize, usize)> {
        chunks(&self.bytes)[1..=FRAMES as usize].to_vec()
    }

    /// Reads every frame; those that are read must be the recorded ones. Returns which were.
    fn readable(&self, reader: &mut Reader, out: &mut Frame) -> Vec<bool> {
        (0..reader.len())
            .map(|k| match reader.read(k, out) {
                Ok(totals) => {
                    assert_eq!(
                        bits(out),
                        self.frames[k],
                        "frame {k} is wrong and was taken for good"
                    );
                    assert_eq!(totals, Some(report(k as u64)));
                    true
                }
                Err(RecordingError::DamagedFrame { frame, .. }) => {
                    assert_eq!(frame, k);
                    assert!(reader.damage().iter().any(|d| d.frame == Some(k)));
                    false
                }
                Err(other) => panic!("{other}"),
            })
            .collect()
    }
}

#[test]
fn every_cut_of_the_last_two_frames_leaves_the_whole_ones() {
    let _alone = alone();
    for (finished, channels) in [
        (true, Channels::ALL),
        (false, Channels::DEPTH | Channels::VELOCITY),
    ] {
        let sample = Sample::with(UVec2::new(9, 7), channels, finished);
        let chunks = sample.frame_chunks();
        let mut out = Frame::new(sample.scene.grid);
        let file = std::fs::File::options().write(true).open(&sample.path).unwrap();
        for cut in (chunks[FRAMES as usize - 2].0..sample.bytes.len()).rev() {
            file.set_len(cut as u64).unwrap();
            let mut reader = Reader::open(&sample.path).unwrap();
            let whole = chunks.iter().filter(|c| c.1 <= cut).count();
            assert_eq!(reader.len(), whole, "cut at {cut}");
            assert_eq!(
                sample.readable(&mut reader, &mut out),
                vec![true; whole],
                "cut at {cut}"
            );
            // A cut between two chunks leaves no trace but the missing index, one in the trailer none at all.
            let clean = chunks.iter().any(|c| c.0 == cut || c.1 == cut);
            let in_trailer = finished && cut + TRAILER >= sample.bytes.len();
            let damage = reader.damage();
            assert_eq!(damage.is_empty(), clean || in_trailer, "cut at {cut}: {damage:?}");
        }
    }
}

#[test]
fn every_cut_of_the_header_is_one_clear_error() {
    let _alone = alone();
    let sample = Sample::with(UVec2::new(9, 7), Channels::NONE, true);
    let end = chunks(&sample.bytes)[0].1;
    assert_eq!(sample.open(&sample.bytes[..end]).unwrap().len(), 0);
    for cut in 0..end {
        match sample.open(&sample.bytes[..cut]).unwrap_err() {
            RecordingError::Empty { .. } => assert_eq!(cut, 0),
            RecordingError::TruncatedHeader { length, .. } => assert_eq!(length, cut as u64),
            other => panic!("cut at {cut}: {other}"),
        }
    }
}

#[test]
fn ten_thousand_changed_bytes_never_give_a_wrong_frame() {
    let _alone = alone();
    let mut rng = Rng::new(20, 26);
    for finished in [true, false] {
        let sample = Sample::with(SIZE, Channels::DEPTH | Channels::DROPLETS, finished);
        let chunks = sample.frame_chunks();
        let first = chunks[0].0;
        let mut out = Frame::new(sample.scene.grid);
        let mut refused = 0;
        for _ in 0..CHANGES / 2 {
            let mut bytes = sample.bytes.clone();
            let at = (rng.next_u64() % bytes.len() as u64) as usize;
            bytes[at] ^= 1 + (rng.next_u64() % 255) as u8;
            std::fs::write(&sample.path, &bytes).unwrap();
            let held = counting::reset_peak();
            let opened = Reader::open(&sample.path);
            let Ok(mut reader) = opened else {
                // The scene stands before the frames; nothing can be drawn without it.
                assert!(at < first, "byte {at}: {}", opened.unwrap_err());
                refused += 1;
                continue;
            };
            assert!(at >= first, "byte {at} of the header was changed unnoticed");
            let read = sample.readable(&mut reader, &mut out);
            assert!(
                counting::peak() - held < MEMORY,
                "byte {at}: {} bytes",
                counting::peak() - held
            );
            // All frames but the one that was hit; without an index, the last one may seem never to have been written.
            let hit = chunks.iter().position(|c| (c.0..c.1).contains(&at));
            let expected: Vec<bool> = (0..FRAMES as usize).map(|k| Some(k) != hit).collect();
            let last = expected.len() - 1;
            assert!(
                read == expected || (!finished && hit == Some(last) && read == expected[..last]),
                "byte {at}: {read:?}"
            );
            assert!(hit.is_none() || !reader.damage().is_empty());
        }
        assert!(refused < CHANGES / 2);
    }
}

#[test]
fn removed_added_swapped_doubled_and_foreign_chunks_are_told_apart() {
    let _alone = alone();
    let sample = Sample::new(false);
    let c = sample.frame_chunks();
    let all = &sample.bytes;
    let mut out = Frame::new(sample.scene.grid);
    let mut check = |name: &str, bytes: &[u8], expected: [bool; 5], damage: usize| {
        let mut reader = sample.open(bytes).unwrap();
        assert_eq!(reader.damage().len(), damage, "{name}: {:?}", reader.damage());
        assert_eq!(sample.readable(&mut reader, &mut out), expected, "{name}");
    };
    // Bytes missing in frame 1, so that frame 2 begins earlier than frame 1 says.
    let missing = [&all[..c[1].0 + 500], &all[c[1].0 + 700..]].concat();
    check("missing bytes", &missing, [true, false, true, true, true], 1);
    // Bytes added in frame 1.
    let added = [&all[..c[1].0 + 500], &[0x55; 333], &all[c[1].0 + 500..]].concat();
    check("added bytes", &added, [true, false, true, true, true], 1);
    // A frame gone whole: known by its number, and its time is between its neighbours'.
    let gone = [&all[..c[2].0], &all[c[2].1..]].concat();
    check("missing chunk", &gone, [true, true, false, true, true], 1);
    let reader = sample.open(&gone).unwrap();
    assert!((reader.time(2) - 2.0 / 30.0).abs() < 1e-9);
    assert_eq!(reader.damage()[0].frame, Some(2));
    // Two frames swapped: both are read under their own numbers.
    let swapped = [
        &all[..c[2].0],
        &all[c[3].0..c[3].1],
        &all[c[2].0..c[2].1],
        &all[c[3].1..],
    ]
    .concat();
    check("swapped chunks", &swapped, [true; 5], 1);
    let doubled = [&all[..c[2].1], &all[c[2].0..]].concat();
    check("doubled chunk", &doubled, [true; 5], 1);
    // A frame of another recording with a number that fits.
    let other = foreign(&sample);
    let o = chunks(&other)[4];
    let foreign = [&all[..c[3].0], &other[o.0..o.1], &all[c[3].1..]].concat();
    check("foreign chunk", &foreign, [true, true, true, false, true], 2);
    // Zeros, as a file system may leave them after a power cut.
    let mut zeros = all.clone();
    zeros[c[3].0..].fill(0);
    let mut reader = sample.open(&zeros).unwrap();
    assert_eq!(sample.readable(&mut reader, &mut out), [true; 3]);
    assert_eq!(reader.damage().len(), 1);
}

/// A recording of another scene with the same grid and channels.
fn foreign(sample: &Sample) -> Vec<u8> {
    let path = sample.path.with_extension("other");
    let mut scene = sample.scene.clone();
    scene.description.seed += 1;
    let mut writer = Writer::create(&path, &scene, Channels::ALL).unwrap();
    for k in 0..FRAMES {
        writer
            .push(&frame(scene.grid, Channels::ALL, k + 100), None)
            .unwrap();
    }
    writer.finish().unwrap();
    std::fs::read(&path).unwrap()
}

#[test]
fn bytes_after_the_index_do_not_hide_it() {
    let _alone = alone();
    let sample = Sample::new(true);
    let mut bytes = sample.bytes.clone();
    bytes.extend_from_slice(b"appended by something else");
    let mut reader = sample.open(&bytes).unwrap();
    assert!(reader.is_complete());
    let mut out = Frame::new(sample.scene.grid);
    assert_eq!(sample.readable(&mut reader, &mut out), [true; 5]);
}

#[test]
fn hostile_lengths_with_right_checksums_are_refused_before_allocation() {
    let _alone = alone();
    let sample = Sample::new(false);
    let c = sample.frame_chunks();
    let structure = c[1].0 + CHUNK_HEADER;
    // Offsets in a frame's payload: u32 length, u64 index, option, report, then the counts of droplets and bodies.
    let report = 4 + 8 * 7 + 8;
    let droplets = structure + 4 + 8 + 1 + report;
    let bands_of_first = droplets + 4 + 4 + 8 + 1 + 8 + 4;
    let mut places = vec![
        structure,
        structure + 2,
        droplets,
        droplets + 3,
        droplets + 4,
        droplets + 8,
    ];
    places.extend(bands_of_first..bands_of_first + 24);
    // The count of particles ends the structure.
    let length = sample.bytes[structure..structure + 4].try_into().unwrap();
    let particles = structure + u32::from_le_bytes(length) as usize;
    places.extend([particles, particles + 3]);
    for at in places {
        for value in [0xff, 0x7f, 0x01, 0x00] {
            let mut bytes = sample.bytes.clone();
            if bytes[at] == value {
                continue;
            }
            bytes[at] = value;
            reseal(&mut bytes, c[1].0, c[1].1);
            std::fs::write(&sample.path, &bytes).unwrap();
            let mut out = Frame::new(sample.scene.grid);
            let held = counting::reset_peak();
            let mut reader = Reader::open(&sample.path).unwrap();
            let read = reader.read(1, &mut out);
            assert!(
                matches!(read, Err(RecordingError::DamagedFrame { frame: 1, .. })),
                "byte {} of the payload set to {value:#x}",
                at - structure
            );
            reader.read(2, &mut out).unwrap();
            assert!(
                counting::peak() - held < MEMORY,
                "byte {at}: {}",
                counting::peak() - held
            );
        }
    }
    // A text in the header's structure that claims more than there is.
    for length in [u64::MAX, 50 << 20, 3 << 20] {
        let mut bytes = sample.bytes.clone();
        let (start, end) = chunks(&bytes)[0];
        let text = start + CHUNK_HEADER + 4;
        bytes[text..text + 8].copy_from_slice(&length.to_le_bytes());
        reseal(&mut bytes, start, end);
        std::fs::write(&sample.path, &bytes).unwrap();
        let held = counting::reset_peak();
        assert!(matches!(
            Reader::open(&sample.path),
            Err(RecordingError::DamagedHeader { .. })
        ));
        assert!(
            counting::peak() - held < MEMORY,
            "a text of {length}: {}",
            counting::peak() - held
        );
    }
    // Lengths of the chunk itself.
    for length in [u64::MAX, u64::MAX / 2, 1 << 40, sample.bytes.len() as u64, 0, 1] {
        let mut bytes = sample.bytes.clone();
        bytes[c[1].0 + 32..c[1].0 + 40].copy_from_slice(&length.to_le_bytes());
        reseal_header(&mut bytes, c[1].0);
        let held = counting::reset_peak();
        let mut reader = sample.open(&bytes).unwrap();
        let mut out = Frame::new(sample.scene.grid);
        assert_eq!(
            sample.readable(&mut reader, &mut out),
            [true, false, true, true, true],
            "{length}"
        );
        assert!(counting::peak() - held < MEMORY);
    }
    // Numbers that would need a slot for every frame before them.
    for sequence in [0, u64::MAX, 1 << 40] {
        let mut bytes = sample.bytes.clone();
        bytes[c[1].0 + 16..c[1].0 + 24].copy_from_slice(&u64::to_le_bytes(sequence));
        reseal_header(&mut bytes, c[1].0);
        let mut reader = sample.open(&bytes).unwrap();
        let mut out = Frame::new(sample.scene.grid);
        assert_eq!(
            sample.readable(&mut reader, &mut out),
            [true, false, true, true, true],
            "{sequence}"
        );
    }
}

#[test]
fn a_small_file_cannot_claim_a_large_grid() {
    let _alone = alone();
    let sample = Sample::new(false);
    let header = chunks(&sample.bytes)[0];
    let payload = &sample.bytes[header.0 + CHUNK_HEADER..header.1];
    // The grid's size stands behind the two texts, origin and spacing.
    let producer = u64::from(u32_at(payload, 4)) as usize;
    let scene = u32_at(payload, 4 + 8 + producer) as usize;
    let size = header.0 + CHUNK_HEADER + 4 + 8 + producer + 8 + scene + 12;
    assert_eq!(
        (u32_at(&sample.bytes, size), u32_at(&sample.bytes, size + 4)),
        (SIZE.x, SIZE.y)
    );
    for [x, y] in [
        [u32::MAX, u32::MAX],
        [1 << 14, 1 << 14],
        [1 << 28, 1],
        [0, 5],
        [4096, 4096],
    ] {
        let mut bytes = sample.bytes.clone();
        bytes[size..size + 4].copy_from_slice(&x.to_le_bytes());
        bytes[size + 4..size + 8].copy_from_slice(&y.to_le_bytes());
        reseal(&mut bytes, header.0, header.1);
        let recording = u32_at(&bytes, header.0 + 12).to_le_bytes();
        for (at, _) in sample.frame_chunks() {
            bytes[at + 12..at + 16].copy_from_slice(&recording);
            reseal_header(&mut bytes, at);
        }
        let held = counting::reset_peak();
        let opened = sample.open(&bytes);
        assert!(
            matches!(opened, Err(RecordingError::DamagedHeader { .. })),
            "{x} x {y}"
        );
        assert!(
            counting::peak() - held < MEMORY,
            "{x} x {y}: {}",
            counting::peak() - held
        );
    }
}

#[test]
fn a_memory_limit_is_kept() {
    let _alone = alone();
    let sample = Sample::new(true);
    std::fs::write(&sample.path, &sample.bytes).unwrap();
    assert!(matches!(
        Reader::open_with_limit(&sample.path, 1000),
        Err(RecordingError::TooLarge { .. })
    ));
    // Enough for the header's arrays, too little for a frame of seven numbers a sample.
    let mut reader = Reader::open_with_limit(&sample.path, 40_000).unwrap();
    let mut out = Frame::new(sample.scene.grid);
    let error = reader.read(0, &mut out).unwrap_err();
    assert!(matches!(error, RecordingError::TooLarge { .. }), "{error}");
}

#[test]
fn a_replay_reports_a_damaged_frame_once_and_goes_on() {
    let _alone = alone();
    let sample = Sample::new(true);
    let mut bytes = sample.bytes.clone();
    bytes[sample.frame_chunks()[2].0 + 900] ^= 4;
    let mut source = ReplaySource::new(sample.open(&bytes).unwrap());
    let mut out = Frame::new(sample.scene.grid);
    let mut seen = Vec::new();
    loop {
        match source.read_into(&mut out) {
            Ok(Progress::Frame(_)) => seen.push(out.index as i64),
            Ok(Progress::End) => break,
            Err(SourceError::Recording(RecordingError::DamagedFrame { frame, .. })) => {
                seen.push(-(frame as i64))
            }
            Err(other) => panic!("{other}"),
        }
    }
    assert_eq!(seen, [0, 1, -2, 3, 4]);
}

#[test]
fn what_is_no_recording_is_one_clear_error() {
    let _alone = alone();
    let sample = Sample::new(true);
    let message = |path: &Path| Reader::open(path).unwrap_err().to_string();
    let folder = sample.path.parent().unwrap();
    assert!(message(folder).contains("a directory instead of a recording"));
    assert!(message(&folder.join("none.mrec")).contains("check the name"));
    assert!(message(Path::new("/dev/null")).contains("device"));
    let with = |bytes: &[u8]| sample.open(bytes).unwrap_err().to_string();
    assert!(with(b"").contains("empty"));
    assert!(with(b"[solver]\nkind = \"wave-equation\"\n").contains("begins as a text"));
    assert!(with(&[7; 300]).contains("not a recording"));
    assert!(with(&sample.bytes[..7]).contains("ends inside its header, at byte 7"));
    // A transfer as text.
    let text: Vec<u8> = sample.bytes.iter().copied().filter(|&b| b != b'\r').collect();
    assert!(with(&text).contains("not a recording"));
    let mut newer = sample.bytes.clone();
    newer[8] = 9;
    let crc = file::crc32(&newer[..16]);
    newer[16..PREAMBLE].copy_from_slice(&crc.to_le_bytes());
    let message = with(&newer);
    assert!(
        message.contains("version 9") && message.contains("newer meniscus"),
        "{message}"
    );
    // The name is in every message.
    assert!(message.contains("sample.mrec"));
}
