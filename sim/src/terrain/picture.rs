//! Heights from grey PNG pictures.

use super::{Raster, TerrainError, content};
use crate::scene::read_file;
use glam::DVec2;
use image::{DynamicImage, ImageFormat, ImageReader};
use std::io::Cursor;
use std::path::Path;

/// Largest side of a picture in pixels.
const MAX_SIDE: u32 = 16_384;

/// Grey steps of a picture or of a part of it (`[x, y, width, height]`), one metre apart.
pub(super) fn read(file: &Path, crop: Option<[u32; 4]>) -> Result<Raster, TerrainError> {
    let bytes = read_file(file, 4 << 30)?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Png);
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(4 << 30);
    reader.limits(limits);
    let picture = reader.decode().map_err(|e| {
        content(
            file,
            format!("this PNG cannot be read: {e}"),
            "save the heights as a grey 16-bit PNG",
        )
    })?;
    let size = [picture.width(), picture.height()];
    let part = crop.unwrap_or([0, 0, size[0], size[1]]);
    let fits = |first: u32, count: u32, all: u32| {
        count >= 2 && first.checked_add(count).is_some_and(|end| end <= all)
    };
    if crop.is_some() && !(fits(part[0], part[2], size[0]) && fits(part[1], part[3], size[1])) {
        return Err(TerrainError::Crop { crop: part, size });
    }
    let values = match &picture {
        DynamicImage::ImageLuma8(grey) => cut(grey.as_raw(), size[0], part),
        DynamicImage::ImageLuma16(grey) => cut(grey.as_raw(), size[0], part),
        other => {
            let message = format!("the picture is {:?}, not grey", other.color());
            return Err(content(
                file,
                message,
                "save the heights as a grey 16-bit PNG without alpha",
            ));
        }
    };
    Ok(Raster {
        width: part[2] as usize,
        height: part[3] as usize,
        values,
        pitch: DVec2::ONE,
        origin: DVec2::ZERO,
    })
}

fn cut<T: Copy + Into<f64>>(pixels: &[T], stride: u32, [x, y, w, h]: [u32; 4]) -> Vec<f64> {
    let (x, w) = (x as usize, w as usize);
    pixels
        .chunks_exact(stride as usize)
        .skip(y as usize)
        .take(h as usize)
        .flat_map(|row| row[x..x + w].iter().map(|&v| v.into()))
        .collect()
}
