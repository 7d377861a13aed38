//! NumPy archives: a zip of `.npy` arrays, stored, so that readers can map them.

use super::staged::{Spool, Staged, io_error};
use super::{ExportError, Sink, Summary};
use crate::frame::{BodyPose, Frame};
use crate::grid::Grid;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Numbers of a body: position, rotation, velocity, angular velocity.
const BODY: usize = 13;

/// NumPy's name of a little- or big-endian type.
fn native(kind: &str) -> String {
    format!("{}{kind}", if cfg!(target_endian = "little") { '<' } else { '>' })
}

/// Header of a `.npy` file, version 1.0.
fn header(kind: &str, shape: &[u64]) -> Vec<u8> {
    let mut sizes: String = shape.iter().map(|n| format!("{n}, ")).collect();
    if shape.len() > 1 {
        sizes.truncate(sizes.len() - 2);
    }
    let mut text = format!(
        "{{'descr': '{}', 'fortran_order': False, 'shape': ({sizes}), }}",
        native(kind)
    );
    // Data begins at a multiple of 64 bytes, after ten bytes of preamble and a newline.
    let padding = 63 - (10 + text.len()) % 64;
    text.extend(std::iter::repeat_n(' ', padding));
    text.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    // At most five numbers of twenty digits: far below the limit of 65535.
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes
}

type Zip<'a> = ZipWriter<&'a mut BufWriter<File>>;

/// Name, type, shape and bytes of an array.
type Fixed = (&'static str, &'static str, Vec<u64>, Vec<u8>);

/// One array that grows with the frames.
struct Array {
    name: &'static str,
    kind: &'static str,
    /// Bytes of an element along the first axis.
    row: u64,
    /// Shape without the first axis.
    tail: Vec<u64>,
    spool: Spool,
}

/// The archive being made.
pub(super) struct Npz {
    out: PathBuf,
    staged: Option<Staged>,
    arrays: Vec<Array>,
    /// Arrays that are complete from the first frame on.
    fixed: Vec<Fixed>,
    /// Frames and droplets so far.
    frames: u64,
    droplets: u64,
}

impl Npz {
    pub(super) fn create(out: &Path) -> Result<Self, ExportError> {
        Ok(Self {
            out: out.to_owned(),
            staged: Some(Staged::create(out)?),
            arrays: Vec::new(),
            fixed: Vec::new(),
            frames: 0,
            droplets: 0,
        })
    }

    /// Appends values to the array `name`, which is begun if need be.
    fn push<T: bytemuck::NoUninit>(
        &mut self,
        name: &'static str,
        kind: &'static str,
        tail: &[u64],
        values: &[T],
    ) -> Result<(), ExportError> {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        if let Some(array) = self.arrays.iter_mut().find(|a| a.name == name) {
            return array.spool.push(bytes);
        }
        let width: u64 = if kind.ends_with('8') { 8 } else { 4 };
        let mut array = Array {
            name,
            kind,
            row: width * tail.iter().product::<u64>(),
            tail: tail.to_vec(),
            spool: Spool::create(&self.out, name)?,
        };
        array.spool.push(bytes)?;
        self.arrays.push(array);
        Ok(())
    }

    /// What does not change from frame to frame.
    fn begin(&mut self, frame: &Frame, ground: Option<&Grid<f32>>) {
        let spec = *frame.spec();
        let axis = |origin: f32, n: usize| -> Vec<u8> {
            (0..n)
                .flat_map(|i| (f64::from(origin) + f64::from(spec.spacing) * i as f64).to_ne_bytes())
                .collect()
        };
        let (nx, nz) = (spec.width(), spec.height());
        let ground: Vec<u8> = match ground {
            Some(ground) => bytemuck::cast_slice(ground.as_slice()).to_vec(),
            None => f32::NEG_INFINITY.to_ne_bytes().repeat(spec.len()),
        };
        self.fixed = vec![
            ("x", "f8", vec![nx as u64], axis(spec.origin.x, nx)),
            ("z", "f8", vec![nz as u64], axis(spec.origin.y, nz)),
            ("ground", "f4", vec![nz as u64, nx as u64], ground),
        ];
    }

    /// Writes the archive and tells the size of its file.
    fn assemble(&mut self) -> Result<u64, ExportError> {
        let Some(mut staged) = self.staged.take() else {
            return Ok(0);
        };
        let (arrays, fixed, frames) = (&mut self.arrays, &self.fixed, self.frames);
        staged.write(|file| {
            let mut zip = ZipWriter::new(file);
            match fill(&mut zip, arrays, fixed, frames) {
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
fn fill(zip: &mut Zip<'_>, arrays: &mut [Array], fixed: &[Fixed], frames: u64) -> io::Result<()> {
    for array in arrays {
        let bytes = array.spool.bytes();
        // Frames of an empty list have no bytes to be counted by.
        let mut shape = vec![bytes.checked_div(array.row).unwrap_or(frames)];
        shape.extend(&array.tail);
        entry(zip, array.name, &header(array.kind, &shape), bytes)?;
        array.spool.copy_to(zip)?;
    }
    for (name, kind, shape, bytes) in fixed {
        entry(zip, name, &header(kind, shape), bytes.len() as u64)?;
        zip.write_all(bytes)?;
    }
    Ok(())
}

/// Begins the entry of an array of `bytes` bytes.
fn entry(zip: &mut Zip<'_>, name: &str, header: &[u8], bytes: u64) -> io::Result<()> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .large_file(header.len() as u64 + bytes >= u64::from(u32::MAX));
    zip.start_file(format!("{name}.npy"), options)?;
    zip.write_all(header)
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
        if self.fixed.is_empty() {
            self.begin(frame, ground);
        }
        self.frames += 1;
        let (nx, nz) = (frame.spec().width() as u64, frame.spec().height() as u64);
        self.push("time", "f8", &[], &[frame.time])?;
        self.push("frame", "u8", &[], &[frame.index])?;
        self.push("elevation", "f4", &[nz, nx], frame.elevation.as_slice())?;
        if let Some(depth) = &frame.depth {
            self.push("depth", "f4", &[nz, nx], depth.as_slice())?;
        }
        if let Some(velocity) = &frame.velocity {
            self.push("velocity", "f4", &[nz, nx, 2], velocity.as_slice())?;
        }
        if let Some(displacement) = &frame.displacement {
            self.push("displacement", "f4", &[nz, nx, 2], displacement.as_slice())?;
        }
        if let Some(foam) = &frame.foam {
            self.push("foam", "f4", &[nz, nx], foam.as_slice())?;
        }
        if let Some(bodies) = &frame.bodies {
            let numbers: Vec<[f32; BODY]> = bodies.iter().map(body_numbers).collect();
            self.push("bodies", "f4", &[bodies.len() as u64, BODY as u64], &numbers)?;
        }
        if let Some(droplets) = &frame.droplets {
            if self.frames == 1 {
                self.push("droplets_offset", "u8", &[], &[0_u64])?;
            }
            self.droplets += droplets.len() as u64;
            self.push("droplets_offset", "u8", &[], &[self.droplets])?;
            self.push("droplets_position", "f4", &[3], &droplets.position)?;
            self.push("droplets_velocity", "f4", &[3], &droplets.velocity)?;
            self.push("droplets_radius", "f4", &[], &droplets.radius)?;
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
