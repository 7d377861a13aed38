//! Finding the frames of a file that has no index, or whose index is damaged: chunk by chunk, and after damage by
//! searching for the next marker.

use super::chunk::{CHUNK_HEADER, ChunkHeader, Kind, MARKER};
use super::index::Slot;
use super::reader::Damage;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

/// Bytes looked at together while searching for a marker.
const WINDOW: usize = 1 << 16;

/// What a scan found.
pub(super) struct Found {
    pub(super) slots: Vec<Slot>,
    pub(super) damage: Vec<Damage>,
    /// Whether the file's index chunk was met, so that no frame can be missing at the end.
    pub(super) complete: bool,
}

/// Looks for the frames between `start` and `end` of a file.
pub(super) fn scan(file: &mut File, start: u64, end: u64, recording: u32) -> io::Result<Found> {
    let mut scan = Scan {
        file,
        end,
        recording,
        frames: Vec::new(),
        damage: Vec::new(),
        complete: None,
    };
    scan.run(start)?;
    Ok(scan.into_found(start))
}

struct Scan<'a> {
    file: &'a mut File,
    end: u64,
    recording: u32,
    /// Number, offset and time of each frame, in order of the file.
    frames: Vec<(u64, u64, f64)>,
    damage: Vec<Damage>,
    /// Number of the index chunk.
    complete: Option<u64>,
}

impl Scan<'_> {
    fn run(&mut self, start: u64) -> io::Result<()> {
        let mut at = start;
        // The chunk before `at`, while its payload has not been checked.
        let mut before: Option<(u64, ChunkHeader)> = None;
        while at < self.end {
            if let Some(header) = self.header(at)? {
                self.accept(at, header);
                if self.complete.is_some() {
                    return Ok(());
                }
                before = Some((at, header));
                at += CHUNK_HEADER as u64 + header.length;
                continue;
            }
            // No chunk stands here. If the payload before it is whole, the damage begins here; else bytes may be
            // missing or added inside it, and the next chunk may begin before its supposed end.
            let from = match before.take() {
                Some((offset, header)) if !self.payload_is_whole(offset, header)? => {
                    offset + MARKER.len() as u64
                }
                _ => at,
            };
            let next = self.search(from)?;
            let reason = match next {
                Some(_) => "no chunk begins where one should",
                None => "the file ends inside a chunk",
            };
            self.damage.push(Damage {
                frame: None,
                offset: from.max(at.min(next.unwrap_or(at))),
                length: next.unwrap_or(self.end).saturating_sub(at),
                reason: reason.to_owned(),
            });
            at = next.unwrap_or(self.end);
        }
        Ok(())
    }

    /// The chunk header at `offset`, if it is whole and its payload lies in the file.
    fn header(&mut self, offset: u64) -> io::Result<Option<ChunkHeader>> {
        if self.end - offset < CHUNK_HEADER as u64 {
            return Ok(None);
        }
        let mut bytes = [0; CHUNK_HEADER];
        self.file.seek(SeekFrom::Start(offset))?;
        self.file.read_exact(&mut bytes)?;
        let room = self.end - offset - CHUNK_HEADER as u64;
        Ok(ChunkHeader::from_bytes(&bytes).filter(|h| h.length <= room))
    }

    /// Takes note of a chunk.
    fn accept(&mut self, offset: u64, header: ChunkHeader) {
        // Every frame takes some bytes: a number that could not be reached in this file is no number of a frame.
        let most = self.end / CHUNK_HEADER as u64;
        let reason = if header.recording != self.recording {
            "a chunk of another recording"
        } else if header.kind == Kind::Header {
            "a second header"
        } else if header.sequence == 0 || header.sequence > most || !header.time.is_finite() {
            "a chunk with an impossible number or time"
        } else if header.kind == Kind::Index {
            self.complete = Some(header.sequence);
            return;
        } else {
            let in_order = self.frames.last().is_none_or(|f| f.0 < header.sequence);
            self.frames.push((header.sequence, offset, header.time));
            if in_order {
                return;
            }
            "a frame that stands after its place or twice"
        };
        self.damage.push(Damage {
            frame: None,
            offset,
            length: CHUNK_HEADER as u64 + header.length,
            reason: reason.to_owned(),
        });
    }

    fn payload_is_whole(&mut self, offset: u64, header: ChunkHeader) -> io::Result<bool> {
        self.file.seek(SeekFrom::Start(offset + CHUNK_HEADER as u64))?;
        let mut hasher = crc32fast::Hasher::new();
        let mut buffer = vec![0; WINDOW];
        let mut left = header.length;
        while left > 0 {
            let part = left.min(WINDOW as u64) as usize;
            self.file.read_exact(&mut buffer[..part])?;
            hasher.update(&buffer[..part]);
            left -= part as u64;
        }
        Ok(hasher.finalize() == header.payload_crc)
    }

    /// Offset of the first whole chunk header at or after `from`.
    fn search(&mut self, from: u64) -> io::Result<Option<u64>> {
        let mut buffer = vec![0; WINDOW];
        let mut at = from;
        while self.end - at >= CHUNK_HEADER as u64 {
            let part = (self.end - at).min(WINDOW as u64) as usize;
            self.file.seek(SeekFrom::Start(at))?;
            self.file.read_exact(&mut buffer[..part])?;
            let mut here = 0;
            while let Some(n) = buffer[here..part].windows(MARKER.len()).position(|w| w == MARKER) {
                let offset = at + (here + n) as u64;
                if self.header(offset)?.is_some() {
                    return Ok(Some(offset));
                }
                here += n + 1;
            }
            if part < WINDOW {
                return Ok(None);
            }
            // Windows overlap, so that a marker across their border is seen.
            at += (part - MARKER.len() + 1) as u64;
        }
        Ok(None)
    }

    /// Puts the frames in order of their numbers and fills the gaps.
    fn into_found(mut self, start: u64) -> Found {
        // Stable: of two frames of the same number the first counts.
        self.frames.sort_by_key(|f| f.0);
        self.frames.dedup_by_key(|f| f.0);
        let recorded = self.complete.map_or(0, |sequence| sequence - 1);
        let last = self.frames.last().map_or(0, |f| f.0).max(recorded);
        let mut slots = Vec::with_capacity(last as usize);
        let mut place = start;
        let mut frames = self.frames.iter().peekable();
        for sequence in 1..=last {
            if let Some(&&(_, offset, time)) = frames.peek().filter(|f| f.0 == sequence) {
                frames.next();
                place = offset;
                slots.push(Slot {
                    offset: Some(offset),
                    time,
                });
                continue;
            }
            self.damage.push(Damage {
                frame: Some(sequence as usize - 1),
                offset: place,
                length: 0,
                reason: "the frame is lost".to_owned(),
            });
            slots.push(Slot {
                offset: None,
                time: f64::NAN,
            });
        }
        fill_times(&mut slots);
        Found {
            slots,
            damage: self.damage,
            complete: self.complete.is_some(),
        }
    }
}

/// Gives lost frames times between those of their neighbours.
fn fill_times(slots: &mut [Slot]) {
    let known: Vec<usize> = (0..slots.len()).filter(|&k| slots[k].offset.is_some()).collect();
    for k in 0..slots.len() {
        if slots[k].offset.is_some() {
            continue;
        }
        let after = known.partition_point(|&n| n < k);
        let before = after.checked_sub(1).and_then(|n| known.get(n));
        slots[k].time = match (before, known.get(after)) {
            (Some(&a), Some(&b)) => {
                let share = (k - a) as f64 / (b - a) as f64;
                slots[a].time + share * (slots[b].time - slots[a].time)
            }
            (Some(&a), None) => slots[a].time,
            (None, Some(&b)) => slots[b].time,
            (None, None) => 0.0,
        };
    }
}
