//! Height maps from files: 16-bit images, NumPy arrays, ESRI ASCII grids, scattered soundings.
//!
//! Heights are scaled, shifted to the datum and resampled in double precision, and rounded to single precision once,
//! at the end.

mod ascii_grid;
mod picture;
mod resample;
mod soundings;

use crate::grid::{Grid, GridSpec};
use crate::npy::{self, NpyError};
use crate::scene::description::Terrain;
use crate::scene::{Fault, ReadError, display_fault};
use glam::{DVec2, UVec2};
use std::path::{Path, PathBuf};

/// Reads the ground that `terrain` names; relative files are sought in `base_dir`. Level ground needs no file and has
/// no extent of its own: it gives `None`, see [`flat`].
///
/// # Errors
/// [`TerrainError`]
pub fn load(terrain: &Terrain, base_dir: &Path) -> Result<Option<Grid<f32>>, TerrainError> {
    let (raster, file, scale, offset) = match terrain {
        Terrain::Flat { .. } => return Ok(None),
        Terrain::Image {
            file,
            pixel_size,
            scale,
            offset,
            crop,
            origin,
        } => {
            let file = base_dir.join(file);
            let mut raster = picture::read(&file, *crop)?;
            raster.pitch = pixel_size.as_dvec2();
            raster.origin = origin.as_dvec2();
            (raster, file, *scale, *offset)
        }
        Terrain::Npy {
            file,
            pixel_size,
            scale,
            offset,
            origin,
        } => {
            let file = base_dir.join(file);
            let array = npy::read(&file).map_err(|source| TerrainError::Npy {
                file: file.clone(),
                source,
            })?;
            let &[height, width] = array.shape.as_slice() else {
                let message = format!("the array has shape {:?}; heights need two axes", array.shape);
                return Err(content(&file, message, "save an array of shape (nz, nx)"));
            };
            let raster = Raster {
                width,
                height,
                values: array.values,
                pitch: pixel_size.as_dvec2(),
                origin: origin.as_dvec2(),
            };
            (raster, file, *scale, *offset)
        }
        Terrain::AsciiGrid {
            file,
            scale,
            offset,
            nodata_height,
            map_origin,
        } => {
            let file = base_dir.join(file);
            // Filled samples have the stated height after scaling, so they are filled with what scales to it.
            let fill = nodata_height.map(|h| if *scale == 0.0 { 0.0 } else { (h - offset) / scale });
            (ascii_grid::read(&file, fill, *map_origin)?, file, *scale, *offset)
        }
        Terrain::Soundings {
            file,
            coordinates,
            spacing,
            scale,
            offset,
            map_origin,
        } => {
            let file = base_dir.join(file);
            (
                soundings::read(&file, *coordinates, *spacing, *map_origin)?,
                file,
                *scale,
                *offset,
            )
        }
    };
    finish(raster, &file, scale, offset).map(Some)
}

/// Level ground under `grid`, on the fewest samples of square spacing that cover it exactly. Where those would be very
/// many, it reaches beyond the grid by less than a thousandth of its shorter side instead.
pub fn flat(height: f32, grid: &GridSpec) -> Grid<f32> {
    let cells = grid.size.saturating_sub(UVec2::ONE).max(UVec2::ONE);
    let exact = gcd(cells.x, cells.y);
    let step = if u64::from(cells.x / exact) * u64::from(cells.y / exact) <= 1 << 22 {
        exact
    } else {
        (cells.min_element() / 1024).max(1)
    };
    let count = UVec2::new(cells.x.div_ceil(step), cells.y.div_ceil(step)) + UVec2::ONE;
    Grid::filled(
        GridSpec {
            origin: grid.origin,
            spacing: grid.spacing * step as f32,
            size: count,
        },
        height,
    )
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Heights as a file has them: row-major, first row at the smallest Z, not yet scaled.
struct Raster {
    width: usize,
    height: usize,
    values: Vec<f64>,
    /// Distance between samples along X and Z in metres.
    pitch: DVec2,
    /// Position of the first sample in metres.
    origin: DVec2,
}

/// Scales, shifts, resamples to square spacing and rounds.
fn finish(mut raster: Raster, file: &Path, scale: f64, offset: f64) -> Result<Grid<f32>, TerrainError> {
    if raster.width < 2 || raster.height < 2 {
        let message = format!(
            "{} x {} heights; at least 2 x 2 are needed",
            raster.width, raster.height
        );
        return Err(content(file, message, "use a larger part of the terrain"));
    }
    for value in &mut raster.values {
        *value = *value * scale + offset;
    }
    // Single precision holds larger heights, but not their squares.
    if let Some(k) = raster.values.iter().position(|v| !(v.abs() <= 1e9)) {
        let (i, j) = (k % raster.width, k / raster.width);
        let message = format!(
            "the height in column {i}, row {j} (from 0) is {} m",
            raster.values[k]
        );
        return Err(content(
            file,
            message,
            "give every sample a finite height; fill gaps before saving",
        ));
    }
    let raster = resample::to_square(raster).map_err(|(x, z)| {
        let message = format!("resampled to square spacing it would have {x:.0} x {z:.0} samples, too many");
        TerrainError::Content {
            file: file.into(),
            message,
            remedy: "check pixel_size".into(),
        }
    })?;
    let spec = GridSpec {
        origin: raster.origin.as_vec2(),
        spacing: raster.pitch.x as f32,
        size: UVec2::new(raster.width as u32, raster.height as u32),
    };
    Grid::from_vec(spec, raster.values.iter().map(|&v| v as f32).collect())
        .map_err(|e| content(file, e.to_string(), "use a smaller part of the terrain"))
}

/// Why ground cannot be read.
#[derive(Debug)]
#[non_exhaustive]
pub enum TerrainError {
    /// The file could not be read.
    Read(ReadError),
    /// The file is not an array that can be used.
    Npy {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        source: NpyError,
    },
    /// The part that is asked for is not in the picture.
    Crop {
        /// The part: first column, first row, width, height.
        crop: [u32; 4],
        /// Size of the picture in pixels.
        size: [u32; 2],
    },
    /// A line of a text file is wrong.
    Line {
        /// The file.
        file: PathBuf,
        /// The line, from 1.
        line: u32,
        /// What is wrong.
        message: String,
        /// What would be right.
        remedy: String,
    },
    /// The content as a whole cannot be used.
    Content {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        message: String,
        /// What would be right.
        remedy: String,
    },
}

fn content(file: &Path, message: impl Into<String>, remedy: &str) -> TerrainError {
    TerrainError::Content {
        file: file.into(),
        message: message.into(),
        remedy: remedy.into(),
    }
}

impl From<ReadError> for TerrainError {
    fn from(e: ReadError) -> Self {
        Self::Read(e)
    }
}

impl Fault for TerrainError {
    fn what(&self) -> String {
        match self {
            Self::Read(e) => e.what(),
            Self::Npy { source, .. } => source.what(),
            Self::Crop {
                crop: [x, y, w, h],
                size: [width, height],
            } => {
                format!("the part [{x}, {y}, {w}, {h}] is not in the picture of {width} x {height} pixels")
            }
            Self::Line { message, .. } | Self::Content { message, .. } => message.clone(),
        }
    }

    fn remedy(&self) -> String {
        match self {
            Self::Read(e) => e.remedy(),
            Self::Npy { source, .. } => source.remedy(),
            Self::Crop {
                size: [width, height],
                ..
            } => {
                format!(
                    "write [x, y, width, height] within [0, 0, {width}, {height}], at least 2 pixels a side"
                )
            }
            Self::Line { remedy, .. } | Self::Content { remedy, .. } => remedy.clone(),
        }
    }

    fn file(&self) -> Option<&Path> {
        match self {
            Self::Npy { file, .. } | Self::Line { file, .. } | Self::Content { file, .. } => Some(file),
            Self::Read(_) | Self::Crop { .. } => None,
        }
    }

    fn line(&self) -> Option<u32> {
        match self {
            Self::Line { line, .. } => Some(*line),
            _ => None,
        }
    }

    fn read_error(&self) -> Option<&ReadError> {
        match self {
            Self::Read(e) => Some(e),
            Self::Npy { source, .. } => source.read_error(),
            _ => None,
        }
    }
}

display_fault!(TerrainError);

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    #[test]
    fn level_ground_covers_its_grid_with_few_samples() {
        for (size, expected) in [
            ((33, 33), (2, 2)),
            ((81, 41), (3, 2)),
            ((256, 181), (18, 13)),
            ((2, 2), (2, 2)),
            ((1, 5), (2, 5)),
            ((20_000, 10_008), (2224, 1113)),
        ] {
            let grid = GridSpec {
                origin: Vec2::new(3.0, -1.0),
                spacing: 0.5,
                size: size.into(),
            };
            let ground = flat(-2.0, &grid);
            assert_eq!(
                (ground.spec().size, ground.spec().origin),
                (UVec2::from(expected), grid.origin),
                "{size:?}"
            );
            let over = ground.spec().extent() - grid.extent();
            assert!(
                over.min_element() >= -1e-3
                    && over.max_element() <= 1e-3 * grid.extent().min_element().max(500.0)
            );
        }
    }

    /// The Jacksboro heights, which other tests and scenes rely on.
    #[test]
    fn a_picture_is_cropped_scaled_shifted_and_made_square() {
        let load = |crop, scale, offset| {
            let terrain = Terrain::Image {
                file: "terrain/jacksboro.png".into(),
                pixel_size: Vec2::new(74.5, 92.6),
                scale,
                offset,
                crop,
                origin: Vec2::new(100.0, 0.0),
            };
            load(
                &terrain,
                Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../data")),
            )
            .unwrap()
            .unwrap()
        };
        let whole = load(None, 1.0, 0.0);
        assert_eq!(whole.spec().size, UVec2::new(403, 427));
        assert_eq!(
            (whole.spec().spacing, whole.spec().origin),
            (74.5, Vec2::new(100.0, 0.0))
        );
        let (low, high) = whole.range();
        assert!(
            (230.0..=236.5).contains(&low) && (1075.5..1085.0).contains(&high),
            "{low} {high}"
        );
        let part = load(Some([10, 0, 20, 30]), 1.0, 0.0);
        assert_eq!((part.spec().size.x, part[(0, 0)]), (20, whole[(10, 0)]));
        // Exact in double precision: 1e6 m of datum leave no trace in the last digits.
        let shifted = load(None, 0.5, -1e6);
        assert_eq!(
            f64::from(shifted[(7, 0)]),
            f64::from((f64::from(whole[(7, 0)]) * 0.5 - 1e6) as f32)
        );
    }
}
