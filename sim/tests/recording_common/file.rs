//! The file format as another program would see it, written from `docs/recording-format.md` and not from the reader:
//! finds chunks and repairs checksums after a change.

#![allow(dead_code, unreachable_pub)]

pub const PREAMBLE: usize = 20;
pub const CHUNK_HEADER: usize = 48;
pub const TRAILER: usize = 24;
pub const MARKER: [u8; 8] = [0xd6, 0x6d, 0x72, 0x63, 0xc9, 0x6b, 0x1a, 0xe5];

/// CRC-32 (ISO-HDLC), bit by bit.
pub fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |mut crc, &byte| {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg());
        }
        crc
    })
}

pub fn u32_at(b: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([b[at], b[at + 1], b[at + 2], b[at + 3]])
}

pub fn u64_at(b: &[u8], at: usize) -> u64 {
    u64::from(u32_at(b, at)) | u64::from(u32_at(b, at + 4)) << 32
}

/// Offset and end of each whole chunk from the header's on, as far as they follow each other.
pub fn chunks(file: &[u8]) -> Vec<(usize, usize)> {
    let mut list = Vec::new();
    let mut at = PREAMBLE;
    while file.len() >= at + CHUNK_HEADER && file[at..at + 8] == MARKER {
        let length = usize::try_from(u64_at(file, at + 32)).unwrap_or(usize::MAX);
        let end = (at + CHUNK_HEADER).saturating_add(length);
        if end > file.len() {
            break;
        }
        list.push((at, end));
        at = end;
    }
    list
}

/// Makes length and checksums of the chunk at `at`, which ends at `end`, right again. If it is the header, the other
/// chunks no longer belong to it unless they are repaired too.
pub fn reseal(file: &mut [u8], at: usize, end: usize) {
    let payload = crc32(&file[at + CHUNK_HEADER..end]);
    file[at + 32..at + 40].copy_from_slice(&((end - at - CHUNK_HEADER) as u64).to_le_bytes());
    file[at + 40..at + 44].copy_from_slice(&payload.to_le_bytes());
    if file[at + 8..at + 12] == *b"HEAD" {
        file[at + 12..at + 16].copy_from_slice(&payload.to_le_bytes());
    }
    reseal_header(file, at);
}

/// Makes the checksum of the chunk header at `at` right again.
pub fn reseal_header(file: &mut [u8], at: usize) {
    let crc = crc32(&file[at..at + 44]);
    file[at + 44..at + 48].copy_from_slice(&crc.to_le_bytes());
}
