//! Frames for other programs: NumPy, ParaView, Blender and whatever reads OBJ, PLY or glTF.
//!
//! | Format | Files | Holds |
//! |---|---|---|
//! | [`Npz`](Format::Npz) | one archive of arrays | every frame and channel; the contract with the outside |
//! | [`Vtk`](Format::Vtk) | `OUT.pvd` and a folder `OUT/` | every frame and channel, ground, droplets, particles |
//! | [`Obj`](Format::Obj), [`Ply`](Format::Ply), [`Glb`](Format::Glb) | `OUT_000000.obj` … | the surface as a mesh, one file a frame |
//!
//! Frames are taken one at a time from any [`FrameSource`]; none is kept. Every file is written under a temporary
//! name beside its place and renamed when it is whole, so a failed export leaves no half file; files that were whole
//! by then stay. A file that is already there is replaced. The files of an earlier, longer export with the same name
//! are not removed.
//!
//! Arrays of the NPZ archive: `time[f]` in seconds, `frame[f]` (numbers of the frames), `x[nx]` and `z[nz]` in metres
//! (all `float64` but `frame`), `elevation[f,nz,nx]` and `ground[nz,nx]` in metres above datum (ground is −∞ where
//! the water has no bed, and that of the first frame where it moves), and each optional channel that the frames hold: `depth[f,nz,nx]`, `velocity[f,nz,nx,2]`,
//! `displacement[f,nz,nx,2]`, `foam[f,nz,nx]` and `bodies[f,n,13]`, with position (3), rotation as a quaternion x, y,
//! z, w (4), velocity (3) and angular velocity (3). Droplets are flat, frame after frame: those of frame f are
//! `droplets_offset[f]` to `droplets_offset[f + 1]` of `droplets_position[·,3]`, `droplets_velocity[·,3]` and
//! `droplets_radius[·]`; particles the same, in `particles_…`. All are `float32` unless said otherwise.

mod glb;
mod mesh_files;
mod npz;
mod obj;
mod ply;
mod staged;
mod surface;
mod vtk;

use crate::frame::{Channels, Frame, NonFiniteFrame};
use crate::grid::{Grid, GridSpec};
use crate::recording::RecordingError;
use crate::scene::Scene;
use crate::source::{FrameSource, Progress, SourceError};
use std::path::{Path, PathBuf};

/// A format that frames can be exported to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// A NumPy archive of arrays, uncompressed.
    Npz,
    /// VTK structured grids with a ParaView collection.
    Vtk,
    /// Wavefront OBJ, text.
    Obj,
    /// Stanford PLY, binary little endian.
    Ply,
    /// Binary glTF 2.0.
    Glb,
}

impl Format {
    /// Every format, in the order of the documentation.
    pub const ALL: [Self; 5] = [Self::Npz, Self::Vtk, Self::Obj, Self::Ply, Self::Glb];

    /// Name as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Npz => "npz",
            Self::Vtk => "vtk",
            Self::Obj => "obj",
            Self::Ply => "ply",
            Self::Glb => "glb",
        }
    }

    /// The format of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|f| f.name() == name)
    }
}

/// What an export has just done.
#[derive(Debug)]
pub enum Update<'a> {
    /// A frame was written.
    Frame {
        /// Frames written so far.
        done: u64,
        /// Time of this one in seconds.
        time: f64,
    },
    /// A damaged frame of a recording was met. Going on leaves it out; stopping ends the export with its error.
    Damaged {
        /// Frames written so far.
        done: u64,
        /// What is wrong with it.
        error: &'a SourceError,
    },
}

/// What an export wrote.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Frames written.
    pub frames: u64,
    /// Damaged frames left out.
    pub damaged: u64,
    /// Bytes of all files.
    pub bytes: u64,
    /// The file to open: the archive, the collection, or the first mesh.
    pub entry: PathBuf,
    /// Number of files.
    pub files: u64,
}

/// Why frames cannot be exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// A file could not be written.
    #[error("{}: {source}; {remedy}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
        /// What would help.
        remedy: &'static str,
    },
    /// The place named for the output cannot be one.
    #[error("{}: {message}; {remedy}", path.display())]
    Destination {
        /// The place.
        path: PathBuf,
        /// What is wrong with it.
        message: &'static str,
        /// What would be right.
        remedy: &'static str,
    },
    /// The next frame could not be read.
    #[error("after {done} frames: {source}")]
    Source {
        /// Frames written before.
        done: u64,
        /// What went wrong.
        source: SourceError,
    },
    /// A frame holds a value that is not a number.
    #[error(transparent)]
    NonFinite(#[from] NonFiniteFrame),
    /// A frame does not fit the ones before it.
    #[error("frame {frame} has {found}, the first one has {expected}; export them apart")]
    Changed {
        /// Number of the frame.
        frame: u64,
        /// What it has.
        found: String,
        /// What the first frame has.
        expected: String,
    },
    /// There was no frame.
    #[error(
        "there are no frames to export; widen the range of frames, or check the recording with `meniscus info`"
    )]
    Empty,
    /// The caller interrupted the export.
    #[error("the export was interrupted after {done} frames")]
    Interrupted {
        /// Frames written before.
        done: u64,
    },
}

/// A format's writer.
trait Sink {
    /// Writes one frame. `ground` is that under the frame's samples.
    fn frame(&mut self, frame: &Frame, ground: Option<&Grid<f32>>) -> Result<(), ExportError>;

    /// Completes what is written.
    fn finish(&mut self) -> Result<Summary, ExportError>;
}

/// Writes every frame of `frames` to `out` in `format`. `progress` is told of each frame; if it returns `false`, the
/// export ends.
///
/// For the formats of one file a frame, `out` is `DIR/NAME.obj`, which gives `DIR/NAME_000000.obj` and so on, by the
/// frames' numbers; for VTK it is `DIR/NAME.pvd`, which gives `DIR/NAME/NAME_000000.vts`. `DIR` must exist.
///
/// # Errors
/// [`ExportError`]; see the [module](self) for what is left behind.
pub fn write(
    format: Format,
    scene: &Scene,
    frames: &mut dyn FrameSource,
    out: &Path,
    progress: &mut dyn FnMut(Update<'_>) -> bool,
) -> Result<Summary, ExportError> {
    let mut sink: Box<dyn Sink> = match format {
        Format::Npz => Box::new(npz::Npz::create(out)?),
        Format::Vtk => Box::new(vtk::Vtk::create(out)?),
        Format::Obj => Box::new(mesh_files::MeshFiles::create(out, "obj", obj::write)?),
        Format::Ply => Box::new(mesh_files::MeshFiles::create(out, "ply", ply::write)?),
        Format::Glb => Box::new(mesh_files::MeshFiles::create(out, "glb", glb::write)?),
    };
    let mut frame = Frame::new(scene.grid);
    let mut shape: Option<(GridSpec, Channels)> = None;
    let mut ground = None;
    let (mut done, mut damaged) = (0_u64, 0_u64);
    let mut last_damage = String::new();
    loop {
        match frames.read_into(&mut frame) {
            Ok(Progress::End) => break,
            Ok(Progress::Frame(_)) => {}
            Err(source) => {
                // Only a damaged frame can be passed over, and it is reported once; the same error again is another.
                let text = source.to_string();
                let passable = matches!(
                    source,
                    SourceError::Recording(RecordingError::DamagedFrame { .. })
                ) && text != last_damage;
                if passable && progress(Update::Damaged { done, error: &source }) {
                    last_damage = text;
                    damaged += 1;
                    continue;
                }
                return Err(ExportError::Source { done, source });
            }
        }
        frame.check_finite()?;
        let now = (*frame.spec(), frame.channels());
        if shape.is_none() || scene.ground_moves() {
            ground = ground_under(&scene.at(frame.time), frame.spec());
        }
        let first = *shape.get_or_insert(now);
        if now != first {
            return Err(ExportError::Changed {
                frame: frame.index,
                found: describe(now),
                expected: describe(first),
            });
        }
        sink.frame(&frame, ground.as_ref())?;
        done += 1;
        let time = frame.time;
        if !progress(Update::Frame { done, time }) {
            return Err(ExportError::Interrupted { done });
        }
    }
    if done == 0 {
        return Err(ExportError::Empty);
    }
    Ok(Summary {
        frames: done,
        damaged,
        ..sink.finish()?
    })
}

/// Ground at the samples of `spec`.
fn ground_under(scene: &Scene, spec: &GridSpec) -> Option<Grid<f32>> {
    let terrain = scene.terrain.as_ref()?;
    Some(Grid::from_fn(*spec, |i, j| terrain.sample(spec.position(i, j))))
}

fn describe((spec, channels): (GridSpec, Channels)) -> String {
    format!(
        "{} x {} samples and the channels {channels}",
        spec.size.x, spec.size.y
    )
}

#[cfg(test)]
mod tests;
