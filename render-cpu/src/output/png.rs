//! 8-bit sRGB pictures.

use super::staged::Staged;
use super::{OutputError, check_length, check_size};
use crate::tonemap::ToneMap;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use meniscus_sim::render::Image;
use std::path::Path;

/// Writes a picture as 8-bit sRGB PNG.
///
/// # Errors
/// [`OutputError`].
pub fn write_png(path: &Path, image: &Image, map: &ToneMap) -> Result<(), OutputError> {
    check_size(path, image.size)?;
    check_length(path, image.size, image.pixels.len())?;
    let bytes = map.image(image);
    let staged = Staged::new(path)?;
    let mut file = staged.create()?;
    PngEncoder::new_with_quality(&mut file, CompressionType::Default, FilterType::Adaptive)
        .write_image(&bytes, image.size.x, image.size.y, ExtendedColorType::Rgb8)
        .map_err(|e| OutputError::encode(path, e))?;
    staged.commit(file)
}
