//! Reading a recording at any stage of its life.

use super::chunk::{self, CHUNK_HEADER, ChunkHeader, Kind, MAGIC, PREAMBLE};
use super::frame_payload::Structure;
use super::header::{self, Header, HeaderError};
use super::index::{self, Slot, TRAILER};
use super::scan;
use super::{DEFAULT_MEMORY_LIMIT, FORMAT_VERSION, RecordingError};
use crate::events::Action;
use crate::frame::{Channels, Frame};
use crate::scene::Scene;
use crate::solver::StepReport;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// A part of a recording that cannot be read.
#[derive(Clone, Debug, PartialEq)]
pub struct Damage {
    /// Number of the frame that is lost, from 0, where it is known.
    pub frame: Option<usize>,
    /// Where the damage begins, or the last place known before it.
    pub offset: u64,
    /// Bytes that are damaged, 0 where unknown.
    pub length: u64,
    /// What does not fit.
    pub reason: String,
}

/// A recording opened for reading.
///
/// Frames are numbered from 0 in the order in which they were recorded, lost ones included, so that a number means
/// the same frame before and after damage.
#[derive(Debug)]
pub struct Reader {
    path: PathBuf,
    file: File,
    file_bytes: u64,
    header_bytes: u64,
    recording: u32,
    header: Header,
    slots: Vec<Slot>,
    damage: Vec<Damage>,
    complete: bool,
    memory_limit: u64,
    payload: Vec<u8>,
    scratch: Vec<f32>,
}

impl Reader {
    /// Opens a recording: the header is read and decoded, the frames are found by the index or, where that is missing
    /// or damaged, by a scan.
    ///
    /// # Errors
    /// [`RecordingError`] if this is not a recording, a newer one, or its header is cut or damaged. Damage beyond the
    /// header is no error: see [`Self::damage`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self, RecordingError> {
        Self::open_with_limit(path, DEFAULT_MEMORY_LIMIT)
    }

    /// Opens a recording that may take `memory_limit` bytes: for the header's arrays, and for one frame with its
    /// stored bytes. [`DEFAULT_MEMORY_LIMIT`] is that of [`Self::open`].
    ///
    /// # Errors
    /// As [`Self::open`], and [`RecordingError::TooLarge`] if the header's arrays take more.
    pub fn open_with_limit(path: impl AsRef<Path>, memory_limit: u64) -> Result<Self, RecordingError> {
        let path = path.as_ref();
        let io = |e| RecordingError::io(path, "open", e);
        let metadata = std::fs::metadata(path).map_err(io)?;
        if !metadata.is_file() {
            let found = if metadata.is_dir() {
                "a directory"
            } else {
                "a device or pipe"
            };
            return Err(RecordingError::NotAFile {
                path: path.to_owned(),
                found,
            });
        }
        let mut file = File::open(path).map_err(io)?;
        let file_bytes = metadata.len();
        check_preamble(path, &mut file, file_bytes)?;
        let (header, recording, header_bytes) = read_header(path, &mut file, file_bytes, memory_limit)?;
        let mut reader = Self {
            path: path.to_owned(),
            file,
            file_bytes,
            header_bytes,
            recording,
            header,
            slots: Vec::new(),
            damage: Vec::new(),
            complete: false,
            memory_limit,
            payload: Vec::new(),
            scratch: Vec::new(),
        };
        if let Some(slots) = reader.read_index().map_err(io)? {
            reader.slots = slots;
            reader.complete = true;
        } else {
            let found = scan::scan(&mut reader.file, header_bytes, file_bytes, recording).map_err(io)?;
            reader.slots = found.slots;
            reader.damage = found.damage;
            reader.complete = found.complete;
        }
        Ok(reader)
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The scene, with everything that its files held.
    pub fn scene(&self) -> &Scene {
        &self.header.scene
    }

    /// The optional channels that every frame holds.
    pub fn channels(&self) -> Channels {
        self.header.channels
    }

    /// Largest error of a recorded value that was asked for (metres, m/s, …); 0 for lossless.
    pub fn tolerance(&self) -> f32 {
        self.header.tolerance
    }

    /// Frames a second of simulated time that were asked for.
    pub fn rate(&self) -> f64 {
        self.header.rate
    }

    /// Program and version that wrote the file.
    pub fn producer(&self) -> &str {
        &self.header.producer
    }

    /// Number of frames, lost ones included.
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// Whether there is no frame.
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    /// Time of frame `k` in seconds; that of a lost frame is interpolated, that of a frame beyond the end is NaN.
    pub fn time(&self, k: usize) -> f64 {
        self.slots.get(k).map_or(f64::NAN, |slot| slot.time)
    }

    /// The last frame whose time is not after `time` seconds, or the first one; `None` without frames.
    pub fn frame_at(&self, time: f64) -> Option<usize> {
        let after = self.slots.partition_point(|slot| slot.time <= time);
        (!self.slots.is_empty()).then(|| after.saturating_sub(1))
    }

    /// Whether the recording was finished: if not, frames may be missing at its end.
    pub fn is_complete(&self) -> bool {
        self.complete
    }

    /// Bytes in the file.
    pub fn file_bytes(&self) -> u64 {
        self.file_bytes
    }

    /// Bytes before the first frame.
    pub fn header_bytes(&self) -> u64 {
        self.header_bytes
    }

    /// What is known to be damaged: after opening, what a scan met; frames that turn out to be damaged when they are
    /// read are added. [`Self::statistics`] reads them all.
    pub fn damage(&self) -> &[Damage] {
        &self.damage
    }

    /// Reads frame `k` into `out`, reusing its allocations; returns the totals recorded with it. Costs the decoding
    /// of this one frame.
    ///
    /// # Errors
    /// [`RecordingError::DamagedFrame`] if it is damaged or lost (`out` is then unspecified; other frames can still
    /// be read), [`RecordingError::NoSuchFrame`], [`RecordingError::TooLarge`] or [`RecordingError::Io`].
    pub fn read(&mut self, k: usize, out: &mut Frame) -> Result<Option<StepReport>, RecordingError> {
        let time = self.load(k)?;
        let spec = self.header.scene.grid;
        let channels = self.header.channels;
        let decoded = match Structure::read(&self.payload, spec, channels) {
            Ok(structure) => {
                let needed = structure.decoded_bytes() + self.payload.len() as u64;
                if needed > self.memory_limit {
                    return Err(self.too_large(needed));
                }
                structure
                    .decode(spec, channels, &mut self.scratch, out)
                    .map(|()| structure.report())
            }
            Err(reason) => Err(reason),
        };
        let report = decoded.map_err(|reason| self.damaged(k, reason))?;
        out.time = time;
        Ok(report)
    }

    /// What was done live between frame `k` − 1 and frame `k`, with the time of the frame after which it was. All frames'
    /// together are what [`crate::source::LiveSource::repeating`] takes to repeat the run.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn acted(&mut self, k: usize) -> Result<Vec<(f64, Action)>, RecordingError> {
        self.load(k)?;
        Structure::read(&self.payload, self.header.scene.grid, self.header.channels)
            .map(Structure::acted)
            .map_err(|reason| self.damaged(k, reason))
    }

    /// Reads the chunk of frame `k` into `self.payload` and checks it; returns the frame's time.
    pub(super) fn load(&mut self, k: usize) -> Result<f64, RecordingError> {
        let Some(&slot) = self.slots.get(k) else {
            return Err(RecordingError::NoSuchFrame {
                path: self.path.clone(),
                frame: k,
                len: self.slots.len(),
            });
        };
        let Some(offset) = slot.offset else {
            return Err(self.damaged(k, "the frame is lost".to_owned()));
        };
        let bytes = read_chunk_header(&mut self.file, offset, self.file_bytes);
        let bytes = bytes.map_err(|e| RecordingError::io(&self.path, "read", e))?;
        let right = |h: &ChunkHeader| {
            h.kind == Kind::Frame
                && h.recording == self.recording
                && h.sequence == k as u64 + 1
                && h.time.to_bits() == slot.time.to_bits()
        };
        let Some(header) = bytes else {
            return Err(self.damaged(k, "its chunk header is damaged".to_owned()));
        };
        if !right(&header) {
            return Err(self.damaged(k, "another chunk stands in its place".to_owned()));
        }
        if header.length > self.memory_limit {
            return Err(self.too_large(header.length));
        }
        read_payload(&mut self.file, header, &mut self.payload)
            .map_err(|e| RecordingError::io(&self.path, "read", e))?;
        if crc32fast::hash(&self.payload) != header.payload_crc {
            return Err(self.damaged(
                k,
                "its bytes do not have the checksum stored with them".to_owned(),
            ));
        }
        Ok(header.time)
    }

    /// The payload that was loaded last.
    pub(super) fn payload(&self) -> &[u8] {
        &self.payload
    }

    fn too_large(&self, needed: u64) -> RecordingError {
        RecordingError::TooLarge {
            path: self.path.clone(),
            what: "a frame",
            needed,
            limit: self.memory_limit,
            remedy: "open it with a larger limit",
        }
    }

    /// Takes note of a damaged frame.
    pub(super) fn damaged(&mut self, k: usize, reason: String) -> RecordingError {
        let known = self.damage.iter().find(|d| d.frame == Some(k));
        let offset = known.map(|d| d.offset);
        let offset = offset
            .or_else(|| self.slots.get(k).and_then(|slot| slot.offset))
            .unwrap_or(self.header_bytes);
        if known.is_none() {
            self.damage.push(Damage {
                frame: Some(k),
                offset,
                length: 0,
                reason: reason.clone(),
            });
        }
        RecordingError::DamagedFrame {
            path: self.path.clone(),
            frame: k,
            offset,
            reason,
        }
    }

    /// The slots of the index, if there is a whole one.
    fn read_index(&mut self) -> io::Result<Option<Vec<Slot>>> {
        let least = self.header_bytes + (CHUNK_HEADER + TRAILER) as u64;
        if self.file_bytes < least {
            return Ok(None);
        }
        let mut trailer = [0; TRAILER];
        self.file
            .seek(SeekFrom::Start(self.file_bytes - TRAILER as u64))?;
        self.file.read_exact(&mut trailer)?;
        let Some(offset) = index::read_trailer(&trailer, self.recording) else {
            return Ok(None);
        };
        let end = self.file_bytes - TRAILER as u64;
        let Some(header) = read_chunk_header(&mut self.file, offset, end)? else {
            return Ok(None);
        };
        // The index must be the last thing before the trailer: something may have been appended since.
        let fits = header.kind == Kind::Index
            && header.recording == self.recording
            && offset >= self.header_bytes
            && offset + CHUNK_HEADER as u64 + header.length == end;
        if !fits {
            return Ok(None);
        }
        let mut payload = Vec::new();
        read_payload(&mut self.file, header, &mut payload)?;
        if crc32fast::hash(&payload) != header.payload_crc {
            return Ok(None);
        }
        Ok(index::decode(
            &payload,
            self.header_bytes,
            offset,
            header.sequence,
        ))
    }
}

/// Checks the first bytes of a file.
fn check_preamble(path: &Path, file: &mut File, file_bytes: u64) -> Result<(), RecordingError> {
    let path = || path.to_owned();
    if file_bytes == 0 {
        return Err(RecordingError::Empty { path: path() });
    }
    let mut bytes = [0; PREAMBLE];
    let length = file_bytes.min(PREAMBLE as u64) as usize;
    file.read_exact(&mut bytes[..length])
        .map_err(|e| RecordingError::io(&path(), "read", e))?;
    let magic = length.min(MAGIC.len());
    if bytes[..magic] != MAGIC[..magic] {
        let text = std::str::from_utf8(&bytes[..length]).is_ok_and(|s| !s.contains('\0'));
        let found = if text {
            "it begins as a text"
        } else {
            "its first bytes are others"
        };
        return Err(RecordingError::NotARecording { path: path(), found });
    }
    if length < PREAMBLE {
        return Err(RecordingError::TruncatedHeader {
            path: path(),
            length: file_bytes,
        });
    }
    let (version, flags) = (chunk::u32_at(&bytes, 8), chunk::u32_at(&bytes, 12));
    if crc32fast::hash(&bytes[..16]) != chunk::u32_at(&bytes, 16) {
        return Err(RecordingError::DamagedHeader {
            path: path(),
            offset: 0,
            reason: "the checksum of its first bytes is wrong".to_owned(),
        });
    }
    if version > FORMAT_VERSION {
        return Err(RecordingError::Newer {
            path: path(),
            version,
            supported: FORMAT_VERSION,
        });
    }
    if version == 0 || flags != 0 {
        return Err(RecordingError::DamagedHeader {
            path: path(),
            offset: 8,
            reason: format!("version {version} with flags {flags:#x} was never written"),
        });
    }
    Ok(())
}

/// Reads and decodes the header; returns it with the recording's number and the offset of the first frame.
fn read_header(
    path: &Path,
    file: &mut File,
    file_bytes: u64,
    limit: u64,
) -> Result<(Header, u32, u64), RecordingError> {
    let io = |e| RecordingError::io(path, "read", e);
    let damaged = |reason: &str| RecordingError::DamagedHeader {
        path: path.to_owned(),
        offset: PREAMBLE as u64,
        reason: reason.to_owned(),
    };
    let truncated = || RecordingError::TruncatedHeader {
        path: path.to_owned(),
        length: file_bytes,
    };
    let too_large = |needed| RecordingError::TooLarge {
        path: path.to_owned(),
        what: "the header",
        needed,
        limit,
        remedy: "open it with a larger limit",
    };
    let start = PREAMBLE as u64;
    let room = file_bytes - start;
    if room < CHUNK_HEADER as u64 {
        return Err(truncated());
    }
    let mut bytes = [0; CHUNK_HEADER];
    file.seek(SeekFrom::Start(start)).map_err(io)?;
    file.read_exact(&mut bytes).map_err(io)?;
    let header =
        ChunkHeader::from_bytes(&bytes).ok_or_else(|| damaged("the checksum of its chunk is wrong"))?;
    if header.kind != Kind::Header || header.sequence != 0 || header.recording != header.payload_crc {
        return Err(damaged("another chunk stands in its place"));
    }
    if header.length > room - CHUNK_HEADER as u64 {
        return Err(truncated());
    }
    if header.length > limit {
        return Err(too_large(header.length));
    }
    let mut payload = Vec::new();
    read_payload(file, header, &mut payload).map_err(io)?;
    if crc32fast::hash(&payload) != header.payload_crc {
        return Err(damaged("its bytes do not have the checksum stored with them"));
    }
    let decoded = header::decode(&payload, limit).map_err(|e| match e {
        HeaderError::Damaged(reason) => damaged(&reason),
        HeaderError::TooLarge(needed) => too_large(needed),
    })?;
    Ok((
        decoded,
        header.recording,
        start + CHUNK_HEADER as u64 + header.length,
    ))
}

/// The chunk header at `offset`, if it is whole and its payload ends before `end`. The file then stands at the payload.
fn read_chunk_header(file: &mut File, offset: u64, end: u64) -> io::Result<Option<ChunkHeader>> {
    if offset > end || end - offset < CHUNK_HEADER as u64 {
        return Ok(None);
    }
    let mut bytes = [0; CHUNK_HEADER];
    file.seek(SeekFrom::Start(offset))?;
    file.read_exact(&mut bytes)?;
    let room = end - offset - CHUNK_HEADER as u64;
    Ok(ChunkHeader::from_bytes(&bytes).filter(|h| h.length <= room))
}

/// Reads a payload whose length was checked against the file's.
fn read_payload(file: &mut File, header: ChunkHeader, out: &mut Vec<u8>) -> io::Result<()> {
    out.clear();
    let read = file.take(header.length).read_to_end(out)?;
    if read as u64 == header.length {
        Ok(())
    } else {
        Err(io::ErrorKind::UnexpectedEof.into())
    }
}
