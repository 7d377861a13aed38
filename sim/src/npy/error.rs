//! What can be wrong with a `.npy` file.

use super::MAX_ELEMENTS;
use crate::scene::{Fault, ReadError};

/// Why an array cannot be read.
#[derive(Debug)]
#[non_exhaustive]
pub enum NpyError {
    /// The file could not be read.
    Read(ReadError),
    /// It does not begin as an array does.
    Magic,
    /// A version of the format that is not known here.
    Version(u8, u8),
    /// The header makes no sense.
    Header {
        /// Byte of the file at which reading stopped.
        byte: usize,
        /// What should stand there.
        expected: &'static str,
    },
    /// Elements of a type other than a plain number.
    Type(String),
    /// More elements than can be held.
    TooLarge {
        /// The shape in the header.
        shape: Vec<usize>,
    },
    /// The file ends before its last element.
    Truncated {
        /// Bytes that shape and type ask for.
        expected: u64,
        /// Bytes after the header.
        found: u64,
    },
}

impl Fault for NpyError {
    fn what(&self) -> String {
        match self {
            Self::Read(e) => e.what(),
            Self::Magic => "this is not a .npy array".into(),
            Self::Version(major, minor) => format!("version {major}.{minor} of the .npy format is unknown"),
            Self::Header { byte, expected } => {
                format!("damaged .npy header at byte {byte}: expected {expected}")
            }
            Self::Type(found) => format!("elements of type {found} are not plain numbers"),
            Self::TooLarge { shape } => {
                format!("an array of shape {shape:?} exceeds the limit of {MAX_ELEMENTS} elements")
            }
            Self::Truncated { expected, found } => {
                format!("the array needs {expected} bytes after its header, the file has {found}")
            }
        }
    }

    fn remedy(&self) -> String {
        match self {
            Self::Read(e) => e.remedy(),
            Self::Type(_) => "save it as float32, e.g. numpy.save(file, a.astype('f4'))".into(),
            Self::TooLarge { .. } => "thin it out".into(),
            _ => "write it anew with numpy.save".into(),
        }
    }

    fn read_error(&self) -> Option<&ReadError> {
        match self {
            Self::Read(e) => Some(e),
            _ => None,
        }
    }
}

crate::scene::display_fault!(NpyError);

impl From<ReadError> for NpyError {
    fn from(e: ReadError) -> Self {
        Self::Read(e)
    }
}
