//! The footer: where each frame begins and what its time is, so that opening and seeking need not read the frames.

use super::chunk::{CHUNK_HEADER, ChunkHeader, Kind, u32_at, u64_at};

/// Last bytes of a finished recording.
const END: [u8; 8] = [b'm', b'r', b'e', b'c', b'e', b'n', b'd', 0x0a];
/// Bytes of the trailer: offset of the index, number of the recording, CRC-32 of these, `END`.
pub(super) const TRAILER: usize = 24;
/// Bytes of one entry.
const ENTRY: usize = 16;

/// A place for a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slot {
    /// Where its chunk begins; `None` for a frame that was lost.
    pub(super) offset: Option<u64>,
    /// Its time in seconds.
    pub(super) time: f64,
}

/// The index chunk and the trailer for frames that begin at the given offsets and have the given times.
pub(super) fn encode(entries: &[(u64, f64)], recording: u32, offset: u64) -> Vec<u8> {
    let mut bytes = vec![0; CHUNK_HEADER];
    bytes.extend_from_slice(&(entries.len() as u64).to_le_bytes());
    for (offset, time) in entries {
        bytes.extend_from_slice(&offset.to_le_bytes());
        bytes.extend_from_slice(&time.to_le_bytes());
    }
    ChunkHeader::seal(
        &mut bytes,
        Kind::Index,
        Some(recording),
        entries.len() as u64 + 1,
        0.0,
    );
    let mut trailer = [0; TRAILER];
    trailer[..8].copy_from_slice(&offset.to_le_bytes());
    trailer[8..12].copy_from_slice(&recording.to_le_bytes());
    let crc = crc32fast::hash(&trailer[..12]);
    trailer[12..16].copy_from_slice(&crc.to_le_bytes());
    trailer[16..].copy_from_slice(&END);
    bytes.extend_from_slice(&trailer);
    bytes
}

/// Where the index begins, if `trailer` is one of this recording.
pub(super) fn read_trailer(trailer: &[u8; TRAILER], recording: u32) -> Option<u64> {
    let right = trailer[16..] == END
        && u32_at(trailer, 8) == recording
        && u32_at(trailer, 12) == crc32fast::hash(&trailer[..12]);
    right.then(|| u64_at(trailer, 0))
}

/// The slots of an index payload whose chunk stands at `end` and has number `sequence`, if it makes sense for frames
/// that begin at or after `start`.
pub(super) fn decode(payload: &[u8], start: u64, end: u64, sequence: u64) -> Option<Vec<Slot>> {
    let (count, entries) = payload.split_first_chunk::<8>()?;
    let count = u64::from_le_bytes(*count);
    if count.checked_add(1) != Some(sequence) || count.checked_mul(ENTRY as u64) != Some(entries.len() as u64)
    {
        return None;
    }
    let mut next = start;
    let mut slots = Vec::with_capacity(entries.len() / ENTRY);
    for entry in entries.chunks_exact(ENTRY) {
        let (offset, time) = (u64_at(entry, 0), f64::from_bits(u64_at(entry, 8)));
        if offset < next || !time.is_finite() {
            return None;
        }
        next = offset.checked_add(CHUNK_HEADER as u64)?;
        slots.push(Slot {
            offset: Some(offset),
            time,
        });
    }
    (next <= end).then_some(slots)
}
