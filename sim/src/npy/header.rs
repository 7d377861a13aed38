//! The header of a `.npy` file: a Python dictionary that tells type, order and shape of the elements.

use super::NpyError;

/// NumPy's own limit.
const MAX_AXES: usize = 32;

/// What a header says.
pub(super) struct Header {
    pub(super) element: Element,
    pub(super) fortran: bool,
    pub(super) shape: Vec<usize>,
}

impl Header {
    /// Reads the text of a header; `base` is its position in the file, for messages.
    pub(super) fn parse(text: &[u8], base: usize) -> Result<Self, NpyError> {
        Cursor { text, at: 0, base }.header()
    }
}

/// Type of the elements.
#[derive(Clone, Copy)]
pub(super) struct Element {
    kind: u8,
    pub(super) size: usize,
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
    pub(super) fn read(self, bytes: &[u8]) -> f64 {
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
