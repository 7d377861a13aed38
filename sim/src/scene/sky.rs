//! Sky pictures.

use super::Panorama;
use super::description::SkyLayout;
use super::fault::{Fault, ReadError, display_fault, read_file};
use super::sky_layout::{self, Picture};
use glam::{UVec2, Vec3};
use image::{ImageFormat, ImageReader};
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// Largest file in bytes.
const MAX_BYTES: u64 = 2 << 30;
/// Share of a picture's brightest value by which a pixel may be below 0.
const MOST_NEGATIVE: f32 = 0.25;

/// Why a sky picture cannot be used.
#[derive(Debug)]
#[non_exhaustive]
pub enum SkyError {
    /// The file could not be read.
    Read(ReadError),
    /// The picture cannot be decoded.
    Decode {
        /// The file.
        file: PathBuf,
        /// What the decoder said.
        reason: String,
    },
    /// Its shape is not that of its layout.
    Shape {
        /// The file.
        file: PathBuf,
        /// Width and height in pixels.
        size: UVec2,
        /// What shape the layout has.
        needed: &'static str,
    },
    /// A pixel is NaN, infinite or negative.
    Pixel {
        /// The file.
        file: PathBuf,
        /// Column and row from the top left.
        at: UVec2,
        /// Its red, green, blue.
        value: Vec3,
    },
}

impl Fault for SkyError {
    fn what(&self) -> String {
        match self {
            Self::Read(e) => e.what(),
            Self::Decode { reason, .. } => format!("this picture cannot be read: {reason}"),
            Self::Shape { size, needed, .. } => {
                format!("the picture has {} x {} pixels; {needed}", size.x, size.y)
            }
            Self::Pixel { at, value, .. } => {
                format!(
                    "pixel ({}, {}) has the radiance {value}, which no light has",
                    at.x, at.y
                )
            }
        }
    }

    fn remedy(&self) -> String {
        match self {
            Self::Read(e) => e.remedy(),
            Self::Decode { .. } => "save it as OpenEXR with channels R, G, B, or as PNG, JPEG or BMP".into(),
            Self::Shape { .. } => {
                "use a picture of that shape, or name its `layout`: `panorama`, `cube` or `horizon`".into()
            }
            Self::Pixel { .. } => "give every pixel a finite radiance of 0 or more".into(),
        }
    }

    fn file(&self) -> Option<&Path> {
        match self {
            Self::Decode { file, .. } | Self::Shape { file, .. } | Self::Pixel { file, .. } => Some(file),
            Self::Read(_) => None,
        }
    }

    fn read_error(&self) -> Option<&ReadError> {
        match self {
            Self::Read(e) => Some(e),
            _ => None,
        }
    }
}

display_fault!(SkyError);

/// Most channels of a picture; a sky has three or four.
const MOST_CHANNELS: usize = 16;

/// Checks the sizes of what is stored before the decoder allocates it: its own limits look at the size of the picture
/// that is shown, and what is stored may reach beyond.
fn check_windows(bytes: &[u8]) -> Result<(), String> {
    let data = exr::meta::MetaData::read_from_buffered(bytes, false).map_err(|e| e.to_string())?;
    let most = Panorama::MAX_HEIGHT as usize;
    for header in &data.headers {
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        let channels = header.channels.list.len();
        if width > 2 * most || height > most || channels > MOST_CHANNELS {
            return Err(format!(
                "it stores {channels} channels of {width} x {height} pixels; at most {MOST_CHANNELS} of {} x {most} are read",
                2 * most
            ));
        }
    }
    Ok(())
}

impl Panorama {
    /// Largest height in pixels.
    pub const MAX_HEIGHT: u32 = 8192;

    /// Reads a picture of the surroundings: OpenEXR with linear radiance, or PNG, JPEG or BMP in sRGB, told apart by
    /// their contents. Negative radiance, which the resampling of pictures leaves behind about a sun, becomes 0, with a
    /// warning in the log; more than a quarter of the brightest value is refused, as NaN and infinity are.
    ///
    /// # Errors
    /// [`SkyError`]
    pub fn load(path: &Path, layout: SkyLayout) -> Result<Self, SkyError> {
        let bytes = read_file(path, MAX_BYTES).map_err(SkyError::Read)?;
        let file = || path.to_path_buf();
        let fail = |e: &dyn std::fmt::Display| SkyError::Decode {
            file: file(),
            reason: e.to_string().chars().take(200).collect(),
        };
        let format = image::guess_format(&bytes).map_err(|e| fail(&e))?;
        let linear = format == ImageFormat::OpenExr;
        if linear {
            check_windows(&bytes).map_err(|reason| SkyError::Decode { file: file(), reason })?;
        }
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        let mut limits = image::Limits::default();
        limits.max_image_width = Some(2 * Self::MAX_HEIGHT);
        limits.max_image_height = Some(2 * Self::MAX_HEIGHT);
        limits.max_alloc = Some(4 << 30);
        reader.limits(limits);
        let picture = reader.decode().map_err(|e| fail(&e))?.into_rgb32f();
        let size = UVec2::new(picture.width(), picture.height());
        let of_srgb = |c: f32| {
            if linear {
                c
            } else {
                crate::optics::linear_of_srgb(c)
            }
        };
        let mut pixels: Vec<Vec3> = picture.pixels().map(|p| Vec3::from(p.0.map(of_srgb))).collect();
        // Resampling with a kernel that has negative lobes leaves rings about the sun that reach below 0 by up to a
        // fifth of the sun's own value.
        let brightest = pixels
            .iter()
            .map(|p| p.max_element())
            .filter(|v| v.is_finite())
            .fold(0.0, f32::max);
        let lowest = -MOST_NEGATIVE * brightest;
        if let Some(k) = pixels
            .iter()
            .position(|p| !(p.is_finite() && p.min_element() >= lowest))
        {
            let at = UVec2::new(k as u32 % size.x, k as u32 / size.x);
            return Err(SkyError::Pixel {
                file: file(),
                at,
                value: pixels[k],
            });
        }
        let negative = pixels.iter().filter(|p| p.min_element() < 0.0).count();
        if negative > 0 {
            tracing::warn!(
                "{}: {negative} pixels with negative radiance were set to 0",
                path.display()
            );
            pixels.iter_mut().for_each(|p| *p = p.max(Vec3::ZERO));
        }
        sky_layout::panorama(Picture { size, pixels }, layout).ok_or_else(|| SkyError::Shape {
            file: file(),
            size,
            needed: sky_layout::shape(layout),
        })
    }

    /// Whether there are as many pixels as the size says and every one is a radiance.
    pub(crate) fn is_valid(&self) -> bool {
        self.pixels.len() as u64 == u64::from(self.size.x) * u64::from(self.size.y)
            && !self.pixels.is_empty()
            && self
                .pixels
                .iter()
                .all(|p| p.is_finite() && p.min_element() >= 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageBuffer, Rgb};

    fn save(
        name: &str,
        width: u32,
        height: u32,
        pixel: impl Fn(u32, u32) -> [f32; 3],
    ) -> (tempfile::TempDir, PathBuf) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(name);
        ImageBuffer::from_fn(width, height, |x, y| Rgb(pixel(x, y)))
            .save(&path)
            .unwrap();
        (dir, path)
    }

    #[test]
    fn every_sky_of_the_repository_is_light() {
        for name in ["dawn", "sky", "sunset", "venice"] {
            let path = format!("{}/../data/sky/{name}.exr", env!("CARGO_MANIFEST_DIR"));
            let sky = Panorama::load(Path::new(&path), SkyLayout::Panorama).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(sky.size, UVec2::new(512, 256));
            assert!(sky.is_valid());
        }
    }

    #[test]
    fn pixels_stand_in_rows_from_the_zenith() {
        let (_dir, path) = save("s.exr", 8, 4, |x, y| [x as f32, y as f32, 0.5]);
        let sky = Panorama::load(&path, SkyLayout::Panorama).unwrap();
        assert_eq!(sky.pixels[3 + 8 * 2], Vec3::new(3.0, 2.0, 0.5));
    }

    /// The picture that is shown may be small and what is stored of it claim to be huge.
    #[test]
    fn a_huge_data_window_is_refused_before_it_is_allocated() {
        let (_dir, path) = save("s.exr", 8, 4, |_, _| [1.0; 3]);
        let mut bytes = std::fs::read(&path).unwrap();
        let name = b"dataWindow\0box2i\0";
        let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len();
        // After the size of the attribute: the smallest x and y, then the largest.
        bytes[at + 12..at + 16].copy_from_slice(&(1_i32 << 28).to_le_bytes());
        std::fs::write(&path, bytes).unwrap();
        let message = Panorama::load(&path, SkyLayout::Panorama)
            .unwrap_err()
            .to_string();
        assert!(message.contains("this picture cannot be read"), "{message}");
    }

    #[test]
    fn what_is_no_light_is_refused_and_a_little_less_than_none_is_none() {
        let message = |value: f32| {
            let (_dir, path) = save("s.exr", 8, 4, |x, y| {
                if (x, y) == (5, 2) {
                    [1.0, value, 1.0]
                } else {
                    [1.0; 3]
                }
            });
            Panorama::load(&path, SkyLayout::Panorama)
                .map(|sky| sky.pixels[5 + 8 * 2].y)
                .map_err(|e| e.to_string())
        };
        assert_eq!(message(2.5), Ok(2.5));
        assert_eq!(message(-0.01), Ok(0.0));
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -0.5] {
            assert!(
                message(bad)
                    .unwrap_err()
                    .contains("pixel (5, 2) has the radiance")
            );
        }
        let (_dir, path) = save("s.exr", 8, 8, |_, _| [1.0; 3]);
        assert!(
            Panorama::load(&path, SkyLayout::Panorama)
                .unwrap_err()
                .to_string()
                .contains("8 x 8 pixels; a whole sky is twice as wide")
        );
    }
}
