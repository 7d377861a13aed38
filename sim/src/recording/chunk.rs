//! The frame around every part of a file: marker, kind, place in the file, length and checksums.

/// First bytes of every recording. As in PNG, the high bit and the line ends expose transfers that change bytes.
pub(super) const MAGIC: [u8; 8] = [0x89, b'M', b'R', b'E', b'C', 0x0d, 0x0a, 0x1a];
/// Bytes of the preamble: magic, version, flags, CRC-32 of these.
pub(super) const PREAMBLE: usize = 20;
/// First bytes of every chunk, so that a scan finds the next one after damage.
pub(super) const MARKER: [u8; 8] = [0xd6, b'm', b'r', b'c', 0xc9, b'k', 0x1a, 0xe5];
/// Bytes of a chunk's header.
pub(super) const CHUNK_HEADER: usize = 48;

/// What a chunk holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// The scene; the first chunk.
    Header,
    /// A frame.
    Frame,
    /// Where the frames are; the last chunk.
    Index,
}

impl Kind {
    const fn code(self) -> [u8; 4] {
        match self {
            Self::Header => *b"HEAD",
            Self::Frame => *b"FRAM",
            Self::Index => *b"INDX",
        }
    }

    fn from_code(code: [u8; 4]) -> Option<Self> {
        [Self::Header, Self::Frame, Self::Index]
            .into_iter()
            .find(|k| k.code() == code)
    }
}

/// The header of a chunk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ChunkHeader {
    /// What the chunk holds.
    pub(super) kind: Kind,
    /// CRC-32 of the payload of the file's first chunk: tells a chunk that strayed in from another recording.
    pub(super) recording: u32,
    /// Number of the chunk in its file: 0 for the header, k + 1 for frame k.
    pub(super) sequence: u64,
    /// Time of a frame in seconds, 0 for the others.
    pub(super) time: f64,
    /// Bytes of the payload, which follows.
    pub(super) length: u64,
    /// CRC-32 of the payload.
    pub(super) payload_crc: u32,
}

impl ChunkHeader {
    /// The bytes, checksum included.
    pub(super) fn to_bytes(self) -> [u8; CHUNK_HEADER] {
        let mut b = [0; CHUNK_HEADER];
        b[..8].copy_from_slice(&MARKER);
        b[8..12].copy_from_slice(&self.kind.code());
        b[12..16].copy_from_slice(&self.recording.to_le_bytes());
        b[16..24].copy_from_slice(&self.sequence.to_le_bytes());
        b[24..32].copy_from_slice(&self.time.to_le_bytes());
        b[32..40].copy_from_slice(&self.length.to_le_bytes());
        b[40..44].copy_from_slice(&self.payload_crc.to_le_bytes());
        let crc = crc32fast::hash(&b[..44]);
        b[44..].copy_from_slice(&crc.to_le_bytes());
        b
    }

    /// The header in `b`, if marker, kind and checksum are right.
    pub(super) fn from_bytes(b: &[u8; CHUNK_HEADER]) -> Option<Self> {
        if b[..8] != MARKER || crc32fast::hash(&b[..44]) != u32_at(b, 44) {
            return None;
        }
        Some(Self {
            kind: Kind::from_code([b[8], b[9], b[10], b[11]])?,
            recording: u32_at(b, 12),
            sequence: u64_at(b, 16),
            time: f64::from_bits(u64_at(b, 24)),
            length: u64_at(b, 32),
            payload_crc: u32_at(b, 40),
        })
    }

    /// Completes a chunk whose bytes are room for the header, then the payload. The file's first chunk is the one
    /// without a `recording`; it returns the number that the others bear.
    pub(super) fn seal(
        bytes: &mut [u8],
        kind: Kind,
        recording: Option<u32>,
        sequence: u64,
        time: f64,
    ) -> u32 {
        let (head, payload) = bytes.split_at_mut(CHUNK_HEADER);
        let payload_crc = crc32fast::hash(payload);
        let recording = recording.unwrap_or(payload_crc);
        let header = Self {
            kind,
            recording,
            sequence,
            time,
            length: payload.len() as u64,
            payload_crc,
        };
        head.copy_from_slice(&header.to_bytes());
        recording
    }
}

/// The first bytes of a file of `version`.
pub(super) fn preamble(version: u32) -> [u8; PREAMBLE] {
    let mut b = [0; PREAMBLE];
    b[..8].copy_from_slice(&MAGIC);
    b[8..12].copy_from_slice(&version.to_le_bytes());
    let crc = crc32fast::hash(&b[..16]);
    b[16..].copy_from_slice(&crc.to_le_bytes());
    b
}

/// The little-endian `u32` at `at`; 0 beyond the end.
pub(super) fn u32_at(b: &[u8], at: usize) -> u32 {
    b.get(at..)
        .and_then(|b| b.first_chunk::<4>())
        .map_or(0, |b| u32::from_le_bytes(*b))
}

/// The little-endian `u64` at `at`; 0 beyond the end.
pub(super) fn u64_at(b: &[u8], at: usize) -> u64 {
    b.get(at..)
        .and_then(|b| b.first_chunk::<8>())
        .map_or(0, |b| u64::from_le_bytes(*b))
}
