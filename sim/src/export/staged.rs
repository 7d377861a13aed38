//! Files that appear under their name only when they are whole.

use super::ExportError;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// An [`ExportError`] for `path`, with what helps against that kind of failure.
pub(super) fn io_error(path: &Path, source: io::Error) -> ExportError {
    let remedy = match source.kind() {
        io::ErrorKind::NotFound => "create the folder first",
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "choose a place that you may write to"
        }
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => "free some space or choose another disk",
        io::ErrorKind::IsADirectory | io::ErrorKind::NotADirectory => "name a file in an existing folder",
        _ => "check the disk or choose another place",
    };
    ExportError::Io {
        path: path.to_owned(),
        source,
        remedy,
    }
}

/// A name beside `path` that no finished file has: `.NAME.suffix`.
pub(super) fn beside(path: &Path, suffix: &str) -> PathBuf {
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".");
    name.push(suffix);
    path.with_file_name(name)
}

/// A file being written. Dropped before [`Self::commit`], it leaves nothing behind.
pub(super) struct Staged {
    path: PathBuf,
    /// Where it is written until it is whole; `None` for what is no regular file (a device, a pipe), which is written
    /// directly and never replaced.
    temporary: Option<PathBuf>,
    writer: Option<BufWriter<File>>,
}

impl Staged {
    /// Begins the file `path`.
    pub(super) fn create(path: &Path) -> Result<Self, ExportError> {
        let special = match fs::metadata(path) {
            Ok(data) if data.is_dir() => {
                return Err(ExportError::Destination {
                    path: path.to_owned(),
                    message: "this is a folder",
                    remedy: "name a file in it",
                });
            }
            Ok(data) => !data.is_file(),
            Err(_) => false,
        };
        let (file, temporary) = if special {
            (File::options().write(true).open(path), None)
        } else {
            let temporary = beside(path, "partial");
            (File::create(&temporary), Some(temporary))
        };
        Ok(Self {
            path: path.to_owned(),
            temporary,
            writer: Some(BufWriter::with_capacity(
                1 << 16,
                file.map_err(|e| io_error(path, e))?,
            )),
        })
    }

    /// Lets `fill` write into the file.
    pub(super) fn write<T>(
        &mut self,
        fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<T>,
    ) -> Result<T, ExportError> {
        match &mut self.writer {
            Some(writer) => fill(writer).map_err(|e| io_error(&self.path, e)),
            None => Err(io_error(&self.path, io::ErrorKind::NotConnected.into())),
        }
    }

    /// Puts the whole file in its place and tells its size in bytes.
    pub(super) fn commit(mut self) -> Result<u64, ExportError> {
        let failed = |e| io_error(&self.path, e);
        let Some(writer) = self.writer.take() else {
            return Ok(0);
        };
        let file = writer.into_inner().map_err(|e| failed(e.into_error()))?;
        let size = file.metadata().map_err(failed)?.len();
        if let Some(temporary) = &self.temporary {
            // On disk before it has its name, so that a power cut leaves no empty file under it.
            file.sync_all().map_err(failed)?;
            drop(file);
            fs::rename(temporary, &self.path).map_err(failed)?;
            self.temporary = None;
        }
        Ok(size)
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        // Closed before it is removed: not every system removes open files.
        drop(self.writer.take());
        if let Some(temporary) = &self.temporary {
            // Nothing more can be done about a temporary file that cannot be removed.
            let _ = fs::remove_file(temporary);
        }
    }
}

/// Values collected on disk until their number is known; removed with the struct.
pub(super) struct Spool {
    path: PathBuf,
    writer: BufWriter<File>,
    bytes: u64,
}

impl Spool {
    /// An empty spool beside `out`.
    pub(super) fn create(out: &Path, name: &str) -> Result<Self, ExportError> {
        let path = beside(out, &format!("{name}.partial"));
        let file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(true)
            .open(&path)
            .map_err(|e| io_error(out, e))?;
        // Where open files can go without their name, a killed export leaves nothing; elsewhere `drop` removes it.
        let _ = fs::remove_file(&path);
        Ok(Self {
            path,
            writer: BufWriter::with_capacity(1 << 16, file),
            bytes: 0,
        })
    }

    /// Lets `fill` append to the spool.
    pub(super) fn fill(
        &mut self,
        fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), ExportError> {
        let Self { path, writer, bytes } = self;
        fill(&mut Counting { writer, bytes }).map_err(|e| io_error(path, e))
    }

    /// Bytes so far.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Copies all of it to `out`.
    pub(super) fn copy_to(&mut self, out: &mut dyn Write) -> io::Result<()> {
        use io::{Seek, SeekFrom};
        self.writer.flush()?;
        let file = self.writer.get_mut();
        file.seek(SeekFrom::Start(0))?;
        io::copy(file, out)?;
        Ok(())
    }
}

/// Counts what is written.
struct Counting<'a> {
    writer: &'a mut BufWriter<File>,
    bytes: &'a mut u64,
}

impl Write for Counting<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.writer.write(bytes)?;
        *self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

impl Drop for Spool {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}
