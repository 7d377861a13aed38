//! NumPy `.npy` arrays, read and written (format versions 1 to 3 of NumPy's `numpy.lib.format`).

use crate::scene::{Fault, ReadError, read_file};
use std::io::{self, Write};
use std::path::Path;

/// An array that was read, values in C order (last index fastest) whatever the order in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Number of elements along each axis; empty for a single number.
    pub shape: Vec<usize>,
    /// The values. 64-bit integers beyond 2⁵³ are rounded.
    pub values: Vec<f64>,
}

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

/// Most elements of an array that is read: those of the largest grid.
const MAX_ELEMENTS: u64 = crate::grid::GridSpec::MAX_SAMPLES;
/// NumPy's own limit on headers that it trusts is 10 000 bytes.
const MAX_HEADER: usize = 64 * 1024;
/// NumPy's own limit.
const MAX_AXES: usize = 32;

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
    let header = Cursor {
        text,
        at: 0,
        base: at,
    }
    .header()?;
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

struct Header {
    element: Element,
    fortran: bool,
    shape: Vec<usize>,
}

/// Type of the elements.
#[derive(Clone, Copy)]
struct Element {
    kind: u8,
    size: usize,
    big_endian: bool,
}

impl Element {
    /// From NumPy's name, such as `<f4`.
    fn parse(name: &[u8]) -> Option<Self> {
        let (order, kind, size) = match name {
            [order @ (b'<' | b'>' | b'|' | b'='), kind, size] => (*order, *kind, *size),
            [kind, size] => (b'=', *kind, *size),
            _ => return None,
        };
        let size = usize::from(size.wrapping_sub(b'0'));
        let known = match kind {
            b'f' => matches!(size, 2 | 4 | 8),
            b'i' | b'u' => matches!(size, 1 | 2 | 4 | 8),
            b'b' => size == 1,
            _ => false,
        };
        known.then_some(Self {
            kind,
            size,
            big_endian: order == b'>',
        })
    }

    /// Reads one element; `bytes` has its size.
    fn read(self, bytes: &[u8]) -> f64 {
        let mut little = [0_u8; 8];
        for (k, &b) in bytes.iter().enumerate() {
            let to = if self.big_endian { self.size - 1 - k } else { k };
            little[to] = b;
        }
        let bits = u64::from_le_bytes(little);
        match (self.kind, self.size) {
            (b'f', 2) => half::f16::from_bits(bits as u16).to_f64(),
            (b'f', 4) => f64::from(f32::from_bits(bits as u32)),
            (b'f', _) => f64::from_bits(bits),
            (b'i', size) => {
                let unused = 64 - 8 * size as u32;
                ((bits << unused) as i64 >> unused) as f64
            }
            (b'b', _) => f64::from(u8::from(bits != 0)),
            _ => bits as f64,
        }
    }
}

/// Reads the header: the text of a Python dictionary with three keys.
struct Cursor<'a> {
    text: &'a [u8],
    at: usize,
    /// Position of the header in the file.
    base: usize,
}

impl<'a> Cursor<'a> {
    fn header(mut self) -> Result<Header, NpyError> {
        let (mut element, mut fortran, mut shape) = (None, None, None);
        self.expect(b'{', "`{`")?;
        while !self.take(b'}') {
            let key = self.string()?;
            self.expect(b':', "`:`")?;
            match key {
                b"descr" => {
                    let start = self.skip();
                    if !matches!(self.peek(), Some(b'\'' | b'"')) {
                        let shown: Vec<u8> = self.text[start..].iter().copied().take(40).collect();
                        return Err(NpyError::Type(String::from_utf8_lossy(&shown).into_owned()));
                    }
                    let name = self.string()?;
                    let unknown = || NpyError::Type(format!("'{}'", String::from_utf8_lossy(name)));
                    element = Some(Element::parse(name).ok_or_else(unknown)?);
                }
                b"fortran_order" => fortran = Some(self.boolean()?),
                b"shape" => shape = Some(self.shape()?),
                _ => return Err(self.fault("one of the keys 'descr', 'fortran_order', 'shape'")),
            }
            if !self.take(b',') {
                self.expect(b'}', "`,` or `}`")?;
                break;
            }
        }
        match (element, fortran, shape) {
            (Some(element), Some(fortran), Some(shape)) => Ok(Header {
                element,
                fortran,
                shape,
            }),
            _ => Err(self.fault("the keys 'descr', 'fortran_order' and 'shape'")),
        }
    }

    fn fault(&self, expected: &'static str) -> NpyError {
        NpyError::Header {
            byte: self.base + self.at,
            expected,
        }
    }

    fn skip(&mut self) -> usize {
        while self.text.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
        self.at
    }

    fn peek(&mut self) -> Option<u8> {
        self.skip();
        self.text.get(self.at).copied()
    }

    fn take(&mut self, byte: u8) -> bool {
        let found = self.peek() == Some(byte);
        self.at += usize::from(found);
        found
    }

    fn expect(&mut self, byte: u8, name: &'static str) -> Result<(), NpyError> {
        if self.take(byte) {
            Ok(())
        } else {
            Err(self.fault(name))
        }
    }

    fn string(&mut self) -> Result<&'a [u8], NpyError> {
        let Some(quote @ (b'\'' | b'"')) = self.peek() else {
            return Err(self.fault("a text in quotes"));
        };
        let rest = &self.text[self.at + 1..];
        let Some(length) = rest.iter().position(|&b| b == quote) else {
            return Err(self.fault("a text that ends"));
        };
        self.at += length + 2;
        Ok(&rest[..length])
    }

    fn boolean(&mut self) -> Result<bool, NpyError> {
        self.skip();
        for (name, value) in [(b"True".as_slice(), true), (b"False", false)] {
            if self.text[self.at..].starts_with(name) {
                self.at += name.len();
                return Ok(value);
            }
        }
        Err(self.fault("True or False"))
    }

    fn shape(&mut self) -> Result<Vec<usize>, NpyError> {
        self.expect(b'(', "`(`")?;
        let mut shape = Vec::new();
        while !self.take(b')') {
            if shape.len() == MAX_AXES {
                return Err(self.fault("at most 32 axes"));
            }
            shape.push(self.whole_number()?);
            if !self.take(b',') {
                self.expect(b')', "`,` or `)`")?;
                break;
            }
        }
        Ok(shape)
    }

    fn whole_number(&mut self) -> Result<usize, NpyError> {
        self.skip();
        let start = self.at;
        while self.text.get(self.at).is_some_and(u8::is_ascii_digit) {
            self.at += 1;
        }
        let number = std::str::from_utf8(&self.text[start..self.at])
            .ok()
            .and_then(|t| t.parse().ok());
        // Python 2 wrote long integers with a trailing L.
        self.at += usize::from(self.text.get(self.at) == Some(&b'L'));
        number.ok_or_else(|| self.fault("a whole number"))
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn file(descr: &str, fortran: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        raw(
            &format!("{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': {shape}, }}\n"),
            data,
        )
    }

    fn raw(header: &str, data: &[u8]) -> Vec<u8> {
        let mut out = b"\x93NUMPY\x01\x00".to_vec();
        out.extend((header.len() as u16).to_le_bytes());
        out.extend(header.as_bytes());
        out.extend(data);
        out
    }

    #[test]
    fn every_type_and_byte_order_is_read() {
        for (descr, bytes, value) in [
            ("<f8", (-1.5_f64).to_le_bytes().to_vec(), -1.5),
            (">f8", (-1.5_f64).to_be_bytes().to_vec(), -1.5),
            ("<f4", 0.1_f32.to_le_bytes().to_vec(), f64::from(0.1_f32)),
            (">f4", 0.1_f32.to_be_bytes().to_vec(), f64::from(0.1_f32)),
            ("<f2", half::f16::from_f32(0.5).to_le_bytes().to_vec(), 0.5),
            ("|i1", vec![0xfe], -2.0),
            ("<i2", (-300_i16).to_le_bytes().to_vec(), -300.0),
            (">i2", (-300_i16).to_be_bytes().to_vec(), -300.0),
            (">i4", (-70_000_i32).to_be_bytes().to_vec(), -70_000.0),
            ("<i8", (-5_i64).to_le_bytes().to_vec(), -5.0),
            ("|u1", vec![0xfe], 254.0),
            ("<u2", 65_535_u16.to_le_bytes().to_vec(), 65_535.0),
            (">u4", u32::MAX.to_be_bytes().to_vec(), f64::from(u32::MAX)),
            ("|b1", vec![1], 1.0),
        ] {
            let array = parse(&file(&format!("'{descr}'"), "False", "(1,)", &bytes)).unwrap();
            assert_eq!(
                (array.shape.as_slice(), array.values.as_slice()),
                ([1].as_slice(), [value].as_slice()),
                "{descr}"
            );
        }
    }

    #[test]
    fn fortran_order_becomes_c_order() {
        // numpy.arange(6).reshape(2, 3) stored by columns.
        let array = parse(&file("'|u1'", "True", "(2, 3)", &[0, 3, 1, 4, 2, 5])).unwrap();
        assert_eq!(
            (array.shape, array.values),
            (vec![2, 3], vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
        );
        let cube = parse(&file("'|u1'", "True", "(2, 2, 2)", &[0, 4, 2, 6, 1, 5, 3, 7])).unwrap();
        assert_eq!(cube.values, (0..8).map(f64::from).collect::<Vec<_>>());
    }

    #[test]
    fn a_file_as_numpy_writes_it_is_the_file_that_is_written() {
        // numpy.save of numpy.array([[1, 2, 3]], 'f4'), NumPy 1.26.
        let mut expected = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
        expected.extend(b"{'descr': '<f4', 'fortran_order': False, 'shape': (1, 3), }");
        expected.resize(127, b' ');
        expected.push(b'\n');
        for v in [1.0_f32, 2.0, 3.0] {
            expected.extend(v.to_le_bytes());
        }
        let mut out = Vec::new();
        write(&mut out, &[1, 3], &[1.0_f32, 2.0, 3.0]).unwrap();
        assert_eq!(out, expected);
        assert!(write(&mut Vec::new(), &[2, 3], &[1.0_f32]).is_err());
        for shape in [vec![], vec![5], vec![1, 2, 3], vec![1; 30]] {
            let head = header::<f64>(&shape);
            assert_eq!(head.len() % 64, 0);
            let mut bytes = head;
            bytes.resize(bytes.len() + 64 * 8, 0);
            assert_eq!(parse(&bytes).unwrap().shape, shape);
        }
    }

    #[test]
    fn damaged_and_hostile_files_are_refused_by_name() {
        let message = |bytes: &[u8]| parse(bytes).unwrap_err().to_string();
        let good = file("'<f4'", "False", "(2,)", &[0; 8]);
        assert!(message(b"").contains("not a .npy array"));
        assert!(message(b"name = 'pond'").contains("not a .npy array"));
        assert!(message(b"\x93NUMPY\x09\x00..").contains("version 9.0"));
        assert!(message(&good[..good.len() - 1]).contains("needs 8 bytes after its header, the file has 7"));
        assert!(message(&good[..20]).contains("expected the rest of the header"));
        assert!(message(b"\x93NUMPY\x02\x00\xff\xff\xff\xff").contains("at most 64 KiB"));
        assert!(
            message(&file("'<f4'", "False", "(4294967296, 4294967296)", &[])).contains("exceeds the limit")
        );
        assert!(message(&file("'<f4'", "False", "(99999999999999999999999,)", &[])).contains("whole number"));
        assert!(message(&file("'<f4'", "False", "(-1,)", &[])).contains("whole number"));
        assert!(message(&file("[('x', '<f4')]", "False", "(1,)", &[])).contains("[('x', '<f4')]"));
        assert!(message(&file("'<c8'", "False", "(1,)", &[])).contains("'<c8'"));
        assert!(message(&file("'|O'", "False", "(1,)", &[])).contains("not plain numbers"));
        assert!(message(&file("'<f4'", "Maybe", "(1,)", &[])).contains("True or False"));
        assert!(message(&raw("{'descr': '<f4'}", &[])).contains("the keys"));
        assert!(message(&raw("{'descr: ", &[])).contains("a text that ends"));
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = parse(&bytes);
            let mut begun = b"\x93NUMPY\x01\x00".to_vec();
            begun.extend(bytes);
            let _ = parse(&begun);
        }

        #[test]
        fn mutated_files_are_read_or_refused(at in 0_usize..160, byte: u8) {
            let mut bytes = Vec::new();
            write(&mut bytes, &[2, 3], &[1.0_f32, 2.0, 3.0, 4.0, 5.0, 6.0]).unwrap();
            let at = at % bytes.len();
            bytes[at] = byte;
            if let Ok(array) = parse(&bytes) {
                prop_assert_eq!(array.shape.iter().product::<usize>(), array.values.len());
            }
        }

        #[test]
        fn what_is_written_is_read(values in proptest::collection::vec(any::<f64>(), 0..50)) {
            let mut bytes = Vec::new();
            write(&mut bytes, &[values.len()], &values).unwrap();
            let read = parse(&bytes).unwrap();
            let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(&read.values), bits(&values));
        }
    }
}
