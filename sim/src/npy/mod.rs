//! NumPy `.npy` arrays, read and written (format versions 1 to 3 of NumPy's `numpy.lib.format`).

mod error;
mod header;
#[cfg(test)]
mod tests;
mod write;

pub use error::NpyError;
pub use write::{Number, header, write, write_values};

use crate::scene::read_file;
use header::Header;
use std::path::Path;

/// An array that was read, values in C order (last index fastest) whatever the order in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Number of elements along each axis; empty for a single number.
    pub shape: Vec<usize>,
    /// The values. 64-bit integers beyond 2⁵³ are rounded.
    pub values: Vec<f64>,
}

/// Most elements of an array that is read: those of the largest grid.
const MAX_ELEMENTS: u64 = crate::grid::GridSpec::MAX_SAMPLES;
/// NumPy's own limit on headers that it trusts is 10 000 bytes.
const MAX_HEADER: usize = 64 * 1024;

/// Reads a file.
///
/// # Errors
/// [`NpyError`]
pub fn read(path: &Path) -> Result<Array, NpyError> {
    parse(&read_file(path, MAX_ELEMENTS * 8 + MAX_HEADER as u64)?)
}

/// Reads an array from the bytes of a file. Bytes after the last element are ignored, as NumPy does.
///
/// # Errors
/// [`NpyError`]; lengths are checked before anything is allocated.
pub fn parse(bytes: &[u8]) -> Result<Array, NpyError> {
    let Some(rest) = bytes.strip_prefix(b"\x93NUMPY") else {
        return Err(NpyError::Magic);
    };
    let short = |expected| NpyError::Header {
        byte: bytes.len(),
        expected,
    };
    let &[major, minor, ref rest @ ..] = rest else {
        return Err(short("a version"));
    };
    let (length, at) = match (major, rest) {
        (1, &[a, b, ..]) => (usize::from(u16::from_le_bytes([a, b])), 10),
        (2 | 3, &[a, b, c, d, ..]) => (u32::from_le_bytes([a, b, c, d]) as usize, 12),
        (1..=3, _) => return Err(short("the length of the header")),
        _ => return Err(NpyError::Version(major, minor)),
    };
    if length > MAX_HEADER {
        return Err(NpyError::Header {
            byte: 8,
            expected: "a header of at most 64 KiB",
        });
    }
    let text = bytes
        .get(at..at + length)
        .ok_or_else(|| short("the rest of the header"))?;
    let header = Header::parse(text, at)?;
    let data = &bytes[at + length..];

    let count = header
        .shape
        .iter()
        .try_fold(1_u64, |n, &s| n.checked_mul(s as u64))
        .filter(|&n| n <= MAX_ELEMENTS);
    let Some(count) = count else {
        return Err(NpyError::TooLarge { shape: header.shape });
    };
    let size = header.element.size;
    let expected = count * size as u64;
    if expected > data.len() as u64 {
        return Err(NpyError::Truncated {
            expected,
            found: data.len() as u64,
        });
    }
    let element = |k: usize| header.element.read(&data[k * size..(k + 1) * size]);
    let values = if header.fortran {
        c_order(&header.shape, count as usize).map(element).collect()
    } else {
        (0..count as usize).map(element).collect()
    };
    Ok(Array {
        shape: header.shape,
        values,
    })
}

/// Positions in Fortran order (first index fastest), in the order in which C order visits them.
fn c_order(shape: &[usize], count: usize) -> impl Iterator<Item = usize> {
    let strides: Vec<usize> = shape
        .iter()
        .scan(1_usize, |next, &s| {
            let stride = *next;
            *next = stride.saturating_mul(s);
            Some(stride)
        })
        .collect();
    let mut index = vec![0_usize; shape.len()];
    (0..count).map(move |_| {
        let at = index.iter().zip(&strides).map(|(i, s)| i * s).sum();
        for axis in (0..index.len()).rev() {
            index[axis] += 1;
            if index[axis] < shape[axis] {
                break;
            }
            index[axis] = 0;
        }
        at
    })
}
