//! Writing pictures: PNG, EXR, animated GIF and PNG, and MP4 where `ffmpeg` is installed.
//!
//! Every file is written under a temporary name beside its final one and renamed when it is whole, so that an
//! interrupted run leaves no half picture under the final name.

mod apng;
mod exr;
mod gif;
mod mp4;
mod palette;
mod png;
mod staged;

pub use self::apng::ApngWriter;
pub use self::exr::{Channel, ExrExtras, ExrFile, read_exr, write_exr, write_exr_with};
pub use self::gif::GifWriter;
pub use self::mp4::Mp4Writer;
pub use self::png::write_png;

use glam::UVec2;
use meniscus_sim::render::Image;
use std::path::{Path, PathBuf};

/// Why a picture could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// A file could not be created, written or renamed.
    #[error("{}: {action} failed: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was being done.
        action: &'static str,
        /// What the system says.
        source: std::io::Error,
    },
    /// An encoder refused the picture.
    #[error("{}: cannot encode: {message}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// What the encoder says.
        message: String,
    },
    /// A file is no picture that can be read.
    #[error("{}: cannot decode: {message}", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// What the decoder says.
        message: String,
    },
    /// The picture has a size that the format or this program cannot take.
    #[error("{}: a picture of {width} x {height} pixels; {remedy}", path.display())]
    Size {
        /// The file.
        path: PathBuf,
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// What would be right.
        remedy: &'static str,
    },
    /// A number of pixels that does not belong to the size.
    #[error("{}: {found} pixels given for a picture of {width} x {height}", path.display())]
    Length {
        /// The file.
        path: PathBuf,
        /// Pixels given.
        found: usize,
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// The rate of an animation is impossible.
    #[error("{}: {rate} frames a second; {remedy}", path.display())]
    Rate {
        /// The file.
        path: PathBuf,
        /// Frames a second.
        rate: f64,
        /// What would be right.
        remedy: &'static str,
    },
    /// `ffmpeg` is needed and not there, or it failed.
    #[error("{}: {message}", path.display())]
    Ffmpeg {
        /// The file.
        path: PathBuf,
        /// What is wrong and what to do.
        message: String,
    },
}

impl OutputError {
    fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        Self::Io {
            path: path.to_owned(),
            action,
            source,
        }
    }

    fn encode(path: &Path, error: impl std::fmt::Display) -> Self {
        Self::Encode {
            path: path.to_owned(),
            message: error.to_string(),
        }
    }
}

/// Checks that each side is 1 to [`Image::MAX_SIDE`].
fn check_size(path: &Path, size: UVec2) -> Result<(), OutputError> {
    if size.min_element() >= 1 && size.max_element() <= Image::MAX_SIDE {
        return Ok(());
    }
    Err(OutputError::Size {
        path: path.to_owned(),
        width: size.x,
        height: size.y,
        remedy: "each side must be 1 to 16384",
    })
}

fn check_length(path: &Path, size: UVec2, found: usize) -> Result<(), OutputError> {
    if found == size.x as usize * size.y as usize {
        return Ok(());
    }
    Err(OutputError::Length {
        path: path.to_owned(),
        found,
        width: size.x,
        height: size.y,
    })
}

/// A frame of an animation: of the size of the first, and with as many pixels as that takes.
fn check_frame(path: &Path, size: UVec2, image: &Image) -> Result<(), OutputError> {
    if image.size != size {
        return Err(OutputError::Size {
            path: path.to_owned(),
            width: image.size.x,
            height: image.size.y,
            remedy: "every frame must have the size of the first",
        });
    }
    check_length(path, size, image.pixels.len())
}

#[cfg(test)]
mod tests;
