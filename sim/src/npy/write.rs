//! Writing `.npy` arrays.

use std::io::{self, Write};

/// Types of element that are written.
pub trait Number: bytemuck::NoUninit + sealed::Sealed {
    /// NumPy's name of the type.
    const NAME: &'static str;
}

impl Number for f32 {
    const NAME: &'static str = "<f4";
}

impl Number for f64 {
    const NAME: &'static str = "<f8";
}

impl Number for u64 {
    const NAME: &'static str = "<u8";
}

mod sealed {
    pub trait Sealed {
        fn write_le(values: &[Self], out: &mut dyn std::io::Write) -> std::io::Result<()>
        where
            Self: Sized;
    }

    macro_rules! seal {
        ($type:ty) => {
            impl Sealed for $type {
                fn write_le(values: &[Self], out: &mut dyn std::io::Write) -> std::io::Result<()> {
                    if cfg!(target_endian = "little") {
                        return out.write_all(bytemuck::cast_slice(values));
                    }
                    values
                        .iter()
                        .try_for_each(|v| out.write_all(&v.to_le_bytes()))
                }
            }
        };
    }
    seal!(f32);
    seal!(f64);
    seal!(u64);
}

/// What stands before the elements of an array of this shape; [`write_values`] may then be called as often as it takes.
pub fn header<T: Number>(shape: &[usize]) -> Vec<u8> {
    let mut list = shape.iter().map(|s| format!("{s}, ")).collect::<String>();
    if shape.len() > 1 {
        list.truncate(list.len() - 2);
    } else {
        list = list.trim_end().to_string();
    }
    let dictionary = format!(
        "{{'descr': '{}', 'fortran_order': False, 'shape': ({list}), }}",
        T::NAME
    );
    // Magic, version, length, dictionary and a line feed fill a multiple of 64 bytes, so that elements are aligned.
    let prefix = if dictionary.len() + 65 < 65_536 { 10 } else { 12 };
    let total = (prefix + dictionary.len() + 1).next_multiple_of(64);
    let mut out = b"\x93NUMPY".to_vec();
    let length = total - prefix;
    if prefix == 10 {
        out.extend([1, 0]);
        out.extend((length as u16).to_le_bytes());
    } else {
        out.extend([2, 0]);
        out.extend((length as u32).to_le_bytes());
    }
    out.extend(dictionary.as_bytes());
    out.resize(total - 1, b' ');
    out.push(b'\n');
    out
}

/// Writes elements as they stand in a `.npy` file.
///
/// # Errors
/// What `out` says.
pub fn write_values<T: Number>(out: &mut dyn Write, values: &[T]) -> io::Result<()> {
    T::write_le(values, out)
}

/// Writes a whole array in C order. `values` must have as many elements as `shape` says.
///
/// # Errors
/// What `out` says; [`io::ErrorKind::InvalidInput`] if shape and values disagree.
pub fn write<T: Number>(out: &mut dyn Write, shape: &[usize], values: &[T]) -> io::Result<()> {
    let count = shape.iter().try_fold(1_usize, |n, &s| n.checked_mul(s));
    if count != Some(values.len()) {
        let message = format!("{} values do not fill an array of shape {shape:?}", values.len());
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    out.write_all(&header::<T>(shape))?;
    write_values(out, values)
}
