//! Animated PNG.

use super::staged::Staged;
use super::{OutputError, check_frame, check_size};
use crate::tonemap::ToneMap;
use glam::UVec2;
use meniscus_sim::render::Image;
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Bytes from the start of the file within which its `acTL` chunk stands.
const HEAD: usize = 512;

/// Writes frames to an endlessly repeating APNG, in full colour.
pub struct ApngWriter {
    path: PathBuf,
    size: UVec2,
    frames: u32,
    announced: u32,
    // Before `staged`, so that the file is closed when it is removed.
    writer: Option<png::Writer<BufWriter<File>>>,
    staged: Staged,
}

impl std::fmt::Debug for ApngWriter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ApngWriter")
            .field("path", &self.path)
            .field("size", &self.size)
            .finish_non_exhaustive()
    }
}

impl ApngWriter {
    /// An APNG of that size at `rate` frames a second, of at most `frames` frames.
    ///
    /// # Errors
    /// [`OutputError`].
    pub fn create(path: &Path, size: UVec2, rate: f64, frames: u64) -> Result<Self, OutputError> {
        check_size(path, size)?;
        // Delays are fractions of two 16-bit numbers, seconds.
        let Some((delay, base)) = delay(rate) else {
            return Err(OutputError::Rate {
                path: path.to_owned(),
                rate,
                remedy: "an APNG can show between one frame a minute and 1000 a second",
            });
        };
        let announced = u32::try_from(frames).unwrap_or(u32::MAX).max(1);
        let staged = Staged::new(path)?;
        let fail = |e: png::EncodingError| OutputError::encode(path, e);
        let mut encoder = png::Encoder::new(staged.create()?, size.x, size.y);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        encoder.set_animated(announced, 0).map_err(fail)?;
        encoder.set_frame_delay(delay, base).map_err(fail)?;
        let writer = encoder.write_header().map_err(fail)?;
        Ok(Self {
            path: path.to_owned(),
            size,
            frames: 0,
            announced,
            writer: Some(writer),
            staged,
        })
    }

    /// Appends a picture of the size given at creation.
    ///
    /// # Errors
    /// [`OutputError`].
    pub fn push(&mut self, image: &Image, map: &ToneMap) -> Result<(), OutputError> {
        check_frame(&self.path, self.size, image)?;
        if let Some(writer) = &mut self.writer {
            writer
                .write_image_data(&map.image(image))
                .map_err(|e| OutputError::encode(&self.path, e))?;
            self.frames += 1;
        }
        Ok(())
    }

    /// Closes the file and gives it its name.
    ///
    /// # Errors
    /// [`OutputError`].
    pub fn finish(mut self) -> Result<(), OutputError> {
        // Dropped, it writes the last chunk; finished, it would insist on as many frames as were announced.
        drop(self.writer.take());
        if self.frames < self.announced {
            announce(self.staged.part(), self.frames)
                .map_err(|e| OutputError::io(&self.path, "writing", e))?;
        }
        self.staged.rename()
    }
}

/// Seconds a frame as a fraction.
fn delay(rate: f64) -> Option<(u16, u16)> {
    if !(1.0 / 60.0..=1000.0).contains(&rate) {
        return None;
    }
    // A base that keeps the numerator large and within 16 bits.
    let base = (60_000.0 * rate).min(10_000.0).floor();
    Some(((base / rate).round() as u16, base as u16))
}

/// Corrects the number of frames in the `acTL` chunk of a file that got fewer than were announced.
fn announce(file: &Path, frames: u32) -> std::io::Result<()> {
    let mut file = OpenOptions::new().read(true).write(true).open(file)?;
    let mut head = vec![0; HEAD];
    let length = file.read(&mut head)?;
    head.truncate(length);
    let found = head.windows(4).position(|w| w == b"acTL");
    // Name, number of frames, number of plays, then the checksum of these.
    let Some(chunk) = found.and_then(|at| head.get_mut(at..at + 16).map(|c| (at, c))) else {
        let what = "the encoder wrote no acTL chunk near the start";
        return Err(std::io::Error::new(std::io::ErrorKind::InvalidData, what));
    };
    let (at, chunk) = chunk;
    chunk[4..8].copy_from_slice(&frames.to_be_bytes());
    let crc = crc32fast::hash(&chunk[..12]);
    chunk[12..16].copy_from_slice(&crc.to_be_bytes());
    file.seek(SeekFrom::Start(at as u64))?;
    file.write_all(chunk)
}
