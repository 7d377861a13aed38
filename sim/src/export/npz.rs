//! NumPy archives: a zip of `.npy` arrays, stored, so that readers can map them.

use super::staged::{Spool, Staged, io_error};
use super::{ExportError, Sink, Summary};
use crate::frame::{BodyPose, Channels, Frame};
use crate::grid::{Grid, GridSpec};
use crate::npy::{self, Number};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Numbers of a body: position, rotation, velocity, angular velocity.
const BODY: usize = 13;

/// One array that grows with the frames.
struct Array {
    name: &'static str,
    /// Numbers so far.
    count: usize,
    /// Shape without the first axis.
    tail: Vec<usize>,
    /// What stands before the numbers of an array of a given shape.
    header: fn(&[usize]) -> Vec<u8>,
    spool: Spool,
}

/// The archive being made.
pub(super) struct Npz {
    out: PathBuf,
    staged: Option<Staged>,
    arrays: Vec<Array>,
    frames: usize,
    /// Droplets and particles so far.
    spheres: [usize; 2],
}

/// Names of the arrays of a list of spheres.
struct Names {
    channel: Channels,
    offset: &'static str,
    position: &'static str,
    velocity: &'static str,
    radius: &'static str,
}

const SPHERES: [Names; 2] = [
    Names {
        channel: Channels::DROPLETS,
        offset: "droplets_offset",
        position: "droplets_position",
        velocity: "droplets_velocity",
        radius: "droplets_radius",
    },
    Names {
        channel: Channels::PARTICLES,
        offset: "particles_offset",
        position: "particles_position",
        velocity: "particles_velocity",
        radius: "particles_radius",
    },
];

impl Npz {
    pub(super) fn create(out: &Path) -> Result<Self, ExportError> {
        Ok(Self {
            out: out.to_owned(),
            staged: Some(Staged::create(out)?),
            arrays: Vec::new(),
            frames: 0,
            spheres: [0; 2],
        })
    }

    /// Appends numbers to the array `name`, which is begun if need be; `tail` is its shape without the first axis.
    fn push<T: Number>(
        &mut self,
        name: &'static str,
        tail: &[usize],
        numbers: &[T],
    ) -> Result<(), ExportError> {
        let at = match self.arrays.iter().position(|a| a.name == name) {
            Some(at) => at,
            None => {
                self.arrays.push(Array {
                    name,
                    count: 0,
                    tail: tail.to_vec(),
                    header: npy::header::<T>,
                    spool: Spool::create(&self.out, name)?,
                });
                self.arrays.len() - 1
            }
        };
        let array = &mut self.arrays[at];
        array.count += numbers.len();
        array.spool.fill(|out| npy::write_values(out, numbers))
    }

    /// What does not change from frame to frame.
    fn begin(&mut self, spec: &GridSpec, ground: Option<&Grid<f32>>) -> Result<(), ExportError> {
        let axis = |origin: f32, n: usize| -> Vec<f64> {
            (0..n)
                .map(|i| f64::from(origin) + f64::from(spec.spacing) * i as f64)
                .collect()
        };
        self.push("x", &[], &axis(spec.origin.x, spec.width()))?;
        self.push("z", &[], &axis(spec.origin.y, spec.height()))?;
        match ground {
            Some(ground) => self.push("ground", &[spec.width()], ground.as_slice()),
            None => self.push("ground", &[spec.width()], &vec![f32::NEG_INFINITY; spec.len()]),
        }
    }

    /// Writes the archive and tells the size of its file.
    fn assemble(&mut self) -> Result<u64, ExportError> {
        let Some(mut staged) = self.staged.take() else {
            return Ok(0);
        };
        let (arrays, frames) = (&mut self.arrays, self.frames);
        staged.write(|file| {
            let mut zip = ZipWriter::new(file);
            match fill(&mut zip, arrays, frames) {
                Ok(()) => zip.finish().map(drop).map_err(io::Error::from),
                Err(error) => {
                    // Dropped, it would try once more to end the archive, and print that it cannot.
                    std::mem::forget(zip);
                    Err(error)
                }
            }
        })?;
        staged.commit()
    }
}

/// Writes every array into the archive.
fn fill(zip: &mut ZipWriter<&mut BufWriter<File>>, arrays: &mut [Array], frames: usize) -> io::Result<()> {
    for array in arrays {
        // Frames of an empty list have no numbers to be counted by.
        let first = array
            .count
            .checked_div(array.tail.iter().product())
            .unwrap_or(frames);
        let mut shape = vec![first];
        shape.extend(&array.tail);
        let header = (array.header)(&shape);
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(header.len() as u64 + array.spool.bytes() >= u64::from(u32::MAX));
        zip.start_file(format!("{}.npy", array.name), options)?;
        zip.write_all(&header)?;
        array.spool.copy_to(zip)?;
    }
    Ok(())
}

/// The numbers of a body, in the order of the `bodies` array.
pub(super) fn body_numbers(pose: &BodyPose) -> [f32; BODY] {
    let mut numbers = [0.0; BODY];
    let parts = pose
        .position
        .to_array()
        .into_iter()
        .chain(pose.rotation.to_array())
        .chain(pose.velocity.to_array())
        .chain(pose.angular_velocity.to_array());
    for (number, part) in numbers.iter_mut().zip(parts) {
        *number = part;
    }
    numbers
}

impl Sink for Npz {
    fn frame(&mut self, frame: &Frame, ground: Option<&Grid<f32>>) -> Result<(), ExportError> {
        if self.frames == 0 {
            self.begin(frame.spec(), ground)?;
        }
        self.frames += 1;
        let (nx, nz) = (frame.spec().width(), frame.spec().height());
        self.push("time", &[], &[frame.time])?;
        self.push("frame", &[], &[frame.index])?;
        self.push("elevation", &[nz, nx], frame.elevation.as_slice())?;
        for (name, grid) in [("depth", &frame.depth), ("foam", &frame.foam)] {
            if let Some(grid) = grid {
                self.push(name, &[nz, nx], grid.as_slice())?;
            }
        }
        for (name, grid) in [
            ("velocity", &frame.velocity),
            ("displacement", &frame.displacement),
        ] {
            if let Some(grid) = grid {
                self.push::<f32>(name, &[nz, nx, 2], bytemuck::cast_slice(grid.as_slice()))?;
            }
        }
        if let Some(bodies) = &frame.bodies {
            let numbers: Vec<f32> = bodies.iter().flat_map(body_numbers).collect();
            self.push("bodies", &[bodies.len(), BODY], &numbers)?;
        }
        for (k, names) in SPHERES.iter().enumerate() {
            let Some(list) = frame.spheres(names.channel) else {
                continue;
            };
            if self.frames == 1 {
                self.push(names.offset, &[], &[0_u64])?;
            }
            self.spheres[k] += list.len();
            self.push(names.offset, &[], &[self.spheres[k] as u64])?;
            self.push::<f32>(names.position, &[3], bytemuck::cast_slice(&list.position))?;
            self.push::<f32>(names.velocity, &[3], bytemuck::cast_slice(&list.velocity))?;
            self.push(names.radius, &[], &list.radius)?;
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<Summary, ExportError> {
        let bytes = self.assemble().map_err(|e| match e {
            ExportError::Io { source, .. } => io_error(&self.out, source),
            other => other,
        })?;
        Ok(Summary {
            bytes,
            entry: self.out.clone(),
            files: 1,
            ..Summary::default()
        })
    }
}
