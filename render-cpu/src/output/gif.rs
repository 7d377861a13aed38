//! Animated GIF.

use super::palette::Palette;
use super::staged::Staged;
use super::{OutputError, check_frame, check_size};
use crate::tonemap::ToneMap;
use glam::UVec2;
use image::codecs::gif::{GifEncoder, Repeat};
use image::{Delay, Frame, RgbaImage};
use meniscus_sim::render::Image;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// A palette is kept for the following frames until its error grows by this factor.
const STALE: f32 = 1.3;

/// Writes frames to an endlessly repeating GIF. The palette of 256 colours is made for the first frame and made anew
/// when the picture has changed too much for it.
pub struct GifWriter {
    path: PathBuf,
    size: UVec2,
    /// Frames a second, and the hundredths of a second given to frames so far.
    rate: f64,
    frames: u64,
    palette: Option<Palette>,
    // Before `staged`, so that the file is closed when it is removed.
    encoder: GifEncoder<BufWriter<File>>,
    staged: Staged,
}

impl std::fmt::Debug for GifWriter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("GifWriter")
            .field("path", &self.path)
            .field("size", &self.size)
            .finish_non_exhaustive()
    }
}

impl GifWriter {
    /// Largest rate that the format and its viewers can show.
    pub const MAX_RATE: f64 = 50.0;

    /// A GIF of that size at `rate` frames a second.
    ///
    /// # Errors
    /// [`OutputError`].
    pub fn create(path: &Path, size: UVec2, rate: f64) -> Result<Self, OutputError> {
        check_size(path, size)?;
        if !(rate > 0.0 && rate <= Self::MAX_RATE) {
            return Err(OutputError::Rate {
                path: path.to_owned(),
                rate,
                remedy: "a GIF can show up to 50: it counts in hundredths of a second, and viewers slow down below 2",
            });
        }
        let staged = Staged::new(path)?;
        let mut encoder = GifEncoder::new(staged.create()?);
        encoder
            .set_repeat(Repeat::Infinite)
            .map_err(|e| OutputError::encode(path, e))?;
        Ok(Self {
            path: path.to_owned(),
            size,
            rate,
            frames: 0,
            palette: None,
            encoder,
            staged,
        })
    }

    /// Appends a picture of the size given at creation.
    ///
    /// # Errors
    /// [`OutputError`].
    pub fn push(&mut self, image: &Image, map: &ToneMap) -> Result<(), OutputError> {
        check_frame(&self.path, self.size, image)?;
        let rgb = map.image(image);
        if self
            .palette
            .as_ref()
            .is_none_or(|p| p.error_of(&rgb) > STALE * p.error + 1.0)
        {
            self.palette = Some(Palette::for_picture(&rgb));
        }
        let Some(palette) = &self.palette else {
            return Ok(());
        };
        let rgba = palette.apply(&rgb, self.size.x as usize);
        let Some(picture) = RgbaImage::from_raw(self.size.x, self.size.y, rgba) else {
            return Ok(());
        };
        // Delays are whole hundredths; their sum follows the rate without drift.
        let end = |n: u64| (n as f64 * 100.0 / self.rate).round() as u32;
        let delay = end(self.frames + 1) - end(self.frames);
        let frame = Frame::from_parts(picture, 0, 0, Delay::from_numer_denom_ms(10 * delay, 1));
        self.encoder
            .encode_frame(frame)
            .map_err(|e| OutputError::encode(&self.path, e))?;
        self.frames += 1;
        Ok(())
    }

    /// Ends the file and gives it its name.
    ///
    /// # Errors
    /// [`OutputError`].
    pub fn finish(self) -> Result<(), OutputError> {
        let Self {
            path,
            encoder,
            mut staged,
            ..
        } = self;
        // The encoder writes the end mark and flushes when dropped.
        drop(encoder);
        let whole = std::fs::metadata(staged.part()).map_err(|e| OutputError::io(&path, "writing", e))?;
        if whole.len() == 0 {
            return Err(OutputError::encode(
                &path,
                "an animation needs at least one frame",
            ));
        }
        staged.rename()
    }
}
