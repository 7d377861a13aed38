//! The structure around the arrays, as bincode 2 writes it: little-endian, integers of fixed width, sequences and
//! strings preceded by a `u64` count, options by one byte, structs as their fields in order. Only this file names
//! bincode, so that it can be replaced.
//!
//! The types are those of the file, apart from those of the program, so that the one can change without the other.

use crate::events::Action;
use crate::grid::GridSpec;
use crate::solver::StepReport;
use glam::{UVec2, Vec2};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

/// Most bytes of the structure in a header (mostly the scene's text).
pub(super) const MAX_HEADER_STRUCTURE: usize = 64 << 20;
/// Most bytes of the structure in a frame.
pub(super) const MAX_FRAME_STRUCTURE: usize = 4 << 20;

/// How one array of numbers is stored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct StoredPlane {
    /// 0: f32, every bit kept; 1: f32, quantised; 2: u32, every bit kept.
    pub(super) encoding: u8,
    /// Distance between quantised values, 0 for the others.
    pub(super) step: f64,
    /// Largest difference between a stored and an original value, measured.
    pub(super) max_error: f32,
    /// The bands that it is cut into, in order.
    pub(super) bands: Vec<StoredBand>,
}

/// How one band of an array is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct StoredBand {
    /// Which predictor was used.
    pub(super) predictor: u8,
    /// Bytes of the band.
    pub(super) length: u32,
    /// CRC-32 of the integers before prediction, four bytes each, little-endian.
    pub(super) crc: u32,
}

/// A grid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct StoredGrid {
    pub(super) origin: [f32; 2],
    pub(super) spacing: f32,
    pub(super) size: [u32; 2],
}

/// A triangle mesh; its arrays are planes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct StoredMesh {
    pub(super) vertices: u32,
    pub(super) has_texcoords: bool,
    pub(super) triangles: u32,
    pub(super) base_color: [f32; 3],
}

/// A sky picture; its colours are planes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct StoredSky {
    pub(super) width: u32,
    pub(super) height: u32,
    /// Whether the planes hold the bits of half floats.
    pub(super) half: bool,
}

/// The header.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct StoredHeader {
    pub(super) producer: String,
    pub(super) scene: String,
    pub(super) grid: StoredGrid,
    pub(super) channels: u32,
    pub(super) rate: f64,
    pub(super) tolerance: f32,
    pub(super) terrain: Option<StoredGrid>,
    pub(super) meshes: Vec<StoredMesh>,
    pub(super) sky: Option<StoredSky>,
    pub(super) has_initial_elevation: bool,
    pub(super) planes: Vec<StoredPlane>,
}

/// What some meshes look like; behind the arrays of the header.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct StoredLooks {
    pub(super) looks: Vec<StoredLook>,
    pub(super) planes: Vec<StoredPlane>,
}

/// The materials of one mesh; which triangle has which is a plane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct StoredLook {
    /// Number of the mesh; they ascend.
    pub(super) mesh: u32,
    pub(super) materials: Vec<StoredMaterial>,
}

/// A material.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct StoredMaterial {
    pub(super) color: [f32; 3],
    /// Roughness and metalness.
    pub(super) shine: Option<[f32; 2]>,
    pub(super) texture: Option<StoredTexture>,
}

/// A texture; its texels are planes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct StoredTexture {
    pub(super) size: [u32; 2],
    /// What is beyond its borders: 0 the same again, 1 mirrored, 2 the texel at the border.
    pub(super) wrap: [u8; 2],
}

/// A frame; its time stands in the chunk header.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct StoredFrame {
    pub(super) index: u64,
    pub(super) report: Option<StoredReport>,
    pub(super) droplets: u32,
    pub(super) bodies: u32,
    pub(super) planes: Vec<StoredPlane>,
}

/// What was done live, as [`Action`]: the enumeration's own form names its variants and needs a format that describes
/// itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum StoredAction {
    Drop([f32; 2], f32, f32),
    Press([f32; 2], f32, f32),
    Push([f32; 2], f32, [f32; 2]),
    Drag(String, [f32; 3], [f32; 3]),
    Release(String),
    Shove(String, [f32; 3], [f32; 3]),
    Tilt([f32; 3]),
}

impl From<&Action> for StoredAction {
    fn from(action: &Action) -> Self {
        match action {
            Action::Drop {
                position,
                radius,
                volume,
            } => Self::Drop(position.to_array(), *radius, *volume),
            Action::Press {
                position,
                radius,
                depth,
            } => Self::Press(position.to_array(), *radius, *depth),
            Action::Push {
                position,
                radius,
                velocity,
            } => Self::Push(position.to_array(), *radius, velocity.to_array()),
            Action::Drag { body, grip, target } => {
                Self::Drag(body.clone(), grip.to_array(), target.to_array())
            }
            Action::Release { body } => Self::Release(body.clone()),
            Action::Shove { body, velocity, spin } => {
                Self::Shove(body.clone(), velocity.to_array(), spin.to_array())
            }
            Action::Tilt { gravity } => Self::Tilt(gravity.to_array()),
        }
    }
}

impl From<StoredAction> for Action {
    fn from(stored: StoredAction) -> Self {
        match stored {
            StoredAction::Drop(position, radius, volume) => {
                let position = position.into();
                Self::Drop {
                    position,
                    radius,
                    volume,
                }
            }
            StoredAction::Press(position, radius, depth) => {
                let position = position.into();
                Self::Press {
                    position,
                    radius,
                    depth,
                }
            }
            StoredAction::Push(position, radius, velocity) => {
                let (position, velocity) = (position.into(), velocity.into());
                Self::Push {
                    position,
                    radius,
                    velocity,
                }
            }
            StoredAction::Drag(body, grip, target) => {
                let (grip, target) = (grip.into(), target.into());
                Self::Drag { body, grip, target }
            }
            StoredAction::Release(body) => Self::Release { body },
            StoredAction::Shove(body, velocity, spin) => {
                let (velocity, spin) = (velocity.into(), spin.into());
                Self::Shove { body, velocity, spin }
            }
            StoredAction::Tilt(gravity) => Self::Tilt {
                gravity: gravity.into(),
            },
        }
    }
}

/// Totals of a frame, as [`StepReport`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct StoredReport {
    substeps: u32,
    largest_stable_step: f64,
    mass: f64,
    momentum: [f64; 2],
    energy: f64,
    courant: f64,
    froude: f64,
    clamps: u64,
}

impl From<StepReport> for StoredReport {
    fn from(r: StepReport) -> Self {
        Self {
            substeps: r.substeps,
            largest_stable_step: r.largest_stable_step,
            mass: r.mass,
            momentum: r.momentum,
            energy: r.energy,
            courant: r.courant,
            froude: r.froude,
            clamps: r.clamps,
        }
    }
}

impl From<StoredReport> for StepReport {
    fn from(r: StoredReport) -> Self {
        Self {
            substeps: r.substeps,
            largest_stable_step: r.largest_stable_step,
            mass: r.mass,
            momentum: r.momentum,
            energy: r.energy,
            courant: r.courant,
            froude: r.froude,
            clamps: r.clamps,
        }
    }
}

impl From<GridSpec> for StoredGrid {
    fn from(spec: GridSpec) -> Self {
        Self {
            origin: spec.origin.to_array(),
            spacing: spec.spacing,
            size: spec.size.to_array(),
        }
    }
}

impl StoredGrid {
    /// The grid, checked.
    pub(super) fn to_spec(self) -> Result<GridSpec, String> {
        GridSpec::new(Vec2::from(self.origin), self.spacing, UVec2::from(self.size))
            .map_err(|e| e.to_string())
    }
}

/// Appends the length of `value` as a `u32`, then its bytes.
pub(crate) fn put<T: Serialize>(value: &T, limit: usize, out: &mut Vec<u8>) -> Result<(), String> {
    let config = bincode::config::standard().with_fixed_int_encoding();
    let bytes = bincode::serde::encode_to_vec(value, config).map_err(|e| e.to_string())?;
    let length = u32::try_from(bytes.len()).ok().filter(|&n| n as usize <= limit);
    let length = length.ok_or_else(|| {
        format!(
            "its structure takes {} bytes, at most {limit} are allowed",
            bytes.len()
        )
    })?;
    out.extend_from_slice(&length.to_le_bytes());
    out.extend_from_slice(&bytes);
    Ok(())
}

/// Bytes of a small structure, such as that of most frames.
const SMALL: usize = 1 << 16;
/// Bytes of one of medium size.
const MEDIUM: usize = 1 << 20;

fn decode<T: DeserializeOwned, const LIMIT: usize>(
    structure: &[u8],
) -> Result<(T, usize), bincode::error::DecodeError> {
    let config = bincode::config::standard()
        .with_fixed_int_encoding()
        .with_limit::<LIMIT>();
    bincode::serde::decode_from_slice(structure, config)
}

/// Reads what [`put`] wrote with a limit of `LIMIT`; returns the value and the bytes after it.
pub(crate) fn take<T: DeserializeOwned, const LIMIT: usize>(bytes: &[u8]) -> Result<(T, &[u8]), String> {
    let (length, rest) = bytes
        .split_first_chunk::<4>()
        .ok_or("it ends before its structure")?;
    let length = u32::from_le_bytes(*length) as usize;
    if length > LIMIT || length > rest.len() {
        return Err(format!(
            "its structure claims {length} bytes, {} are there",
            rest.len()
        ));
    }
    let (structure, rest) = rest.split_at(length);
    // Bincode allocates what a string claims to hold before it reads it, up to a limit that is fixed when compiling.
    // So that a small file cannot make it allocate much, small structures get a small one.
    let decoded = if length <= SMALL {
        decode::<T, SMALL>(structure)
    } else if length <= MEDIUM {
        decode::<T, MEDIUM>(structure)
    } else {
        decode::<T, LIMIT>(structure)
    };
    let (value, used) = decoded.map_err(|e| format!("its structure: {e}"))?;
    if used != length {
        return Err(format!(
            "its structure takes {used} of the {length} bytes given to it"
        ));
    }
    Ok((value, rest))
}
