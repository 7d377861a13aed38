//! Recordings: append-only, crash-safe files of frames (`.mrec`), described byte by byte in `docs/recording-format.md`.
//!
//! A recording holds everything that a scene needs to be drawn again (its description, terrain, geometry, sky), then
//! one checksummed chunk a frame, then an index. [`Writer`] encodes and writes off the caller's thread; [`Reader`]
//! opens a file at any stage of its life, also one that was cut or damaged, reads any frame at the cost of decoding
//! that frame, and names what it could not read. [`ReplaySource`] plays a recording as a [`crate::FrameSource`].
//!
//! From the bytes upwards: [`plane`] packs one array of numbers (with [`quantise`], [`predict`] and [`fitted`]); [`codec`] the
//! structure around arrays; [`frame_payload`] and [`header`] a frame and a scene; [`chunk`] frames both with
//! checksums; [`index`] and [`scan`] find the frames of a file.

mod chunk;
pub(crate) mod codec;
mod error;
mod fitted;
mod frame_payload;
mod header;
mod index;
mod looks;
mod plane;
mod predict;
mod quantise;
mod reader;
mod replay;
mod scan;
mod statistics;
mod writer;

pub use error::RecordingError;
pub use reader::{Damage, Reader};
pub use replay::ReplaySource;
pub use statistics::{ChannelStatistics, Statistics, Totals};
pub use writer::{Summary, Writer};

/// Version of the format that this program writes, and the newest that it reads.
pub const FORMAT_VERSION: u32 = 2;

/// Most droplets in one recorded frame.
pub const MAX_DROPLETS: usize = 1 << 24;

/// Most bodies in one recorded frame.
pub const MAX_BODIES: usize = 1 << 16;

/// Bytes that [`Reader::open`] is ready to hold decoded: the header's arrays and one frame together.
pub const DEFAULT_MEMORY_LIMIT: u64 = 4 << 30;
