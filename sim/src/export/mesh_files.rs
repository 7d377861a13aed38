//! One mesh file a frame.

use super::staged::Staged;
use super::surface::Surface;
use super::{ExportError, Sink, Summary};
use crate::frame::Frame;
use crate::grid::Grid;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

/// Writes a surface into a file.
pub(super) type WriteMesh = fn(&Surface, &mut BufWriter<File>) -> io::Result<()>;

/// The stem of `out` without the extension that it may have, or why it has none.
pub(super) fn stem<'a>(out: &'a Path, extension: &str) -> Result<&'a str, ExportError> {
    let refuse = |message, remedy| {
        Err(ExportError::Destination {
            path: out.to_owned(),
            message,
            remedy,
        })
    };
    if out.is_dir() {
        return refuse(
            "this is a folder",
            "name a file in it, from which the files of the frames get their names",
        );
    }
    let Some(name) = out.file_name().and_then(|n| n.to_str()) else {
        return refuse("this is no file name in Unicode", "name a file");
    };
    let bare = name
        .strip_suffix(extension)
        .and_then(|n| n.strip_suffix('.'))
        .unwrap_or(name);
    if bare.is_empty() {
        return refuse(
            "this name has nothing before its extension",
            "name a file such as `water.obj`",
        );
    }
    Ok(bare)
}

/// A sequence of mesh files.
pub(super) struct MeshFiles {
    out: PathBuf,
    stem: String,
    extension: &'static str,
    write: WriteMesh,
    surface: Surface,
    summary: Summary,
}

impl MeshFiles {
    pub(super) fn create(out: &Path, extension: &'static str, write: WriteMesh) -> Result<Self, ExportError> {
        Ok(Self {
            stem: stem(out, extension)?.to_owned(),
            out: out.to_owned(),
            extension,
            write,
            surface: Surface::default(),
            summary: Summary::default(),
        })
    }
}

impl Sink for MeshFiles {
    fn frame(&mut self, frame: &Frame, ground: Option<&Grid<f32>>) -> Result<(), ExportError> {
        self.surface.build(frame, ground);
        let name = format!("{}_{:06}.{}", self.stem, frame.index, self.extension);
        let path = self.out.with_file_name(name);
        let mut file = Staged::create(&path)?;
        file.write(|out| (self.write)(&self.surface, out))?;
        self.summary.bytes += file.commit()?;
        if self.summary.files == 0 {
            self.summary.entry = path;
        }
        self.summary.files += 1;
        Ok(())
    }

    fn finish(&mut self) -> Result<Summary, ExportError> {
        Ok(self.summary.clone())
    }
}
