//! MP4 through an installed `ffmpeg`.

use super::staged::Staged;
use super::{OutputError, check_frame, check_size};
use crate::tonemap::ToneMap;
use glam::UVec2;
use meniscus_sim::render::Image;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Feeds frames to `ffmpeg`, which encodes them as H.264.
#[derive(Debug)]
pub struct Mp4Writer {
    path: PathBuf,
    size: UVec2,
    child: Child,
    staged: Staged,
}

impl Mp4Writer {
    /// Whether `ffmpeg` can be started.
    pub fn is_available() -> bool {
        Command::new("ffmpeg")
            .arg("-version")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|s| s.success())
    }

    /// An MP4 of that size at `rate` frames a second.
    ///
    /// # Errors
    /// [`OutputError`]: both sides must be even, and `ffmpeg` must be on the PATH.
    pub fn create(path: &Path, size: UVec2, rate: f64) -> Result<Self, OutputError> {
        check_size(path, size)?;
        if !size.x.is_multiple_of(2) || !size.y.is_multiple_of(2) {
            return Err(OutputError::Size {
                path: path.to_owned(),
                width: size.x,
                height: size.y,
                remedy: "MP4 needs even sides",
            });
        }
        if !(rate > 0.0 && rate <= 1000.0) {
            return Err(OutputError::Rate {
                path: path.to_owned(),
                rate,
                remedy: "give a positive rate up to 1000",
            });
        }
        let staged = Staged::new(path)?;
        let child = Command::new("ffmpeg")
            .args(["-hide_banner", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"])
            .args(["-s", &format!("{}x{}", size.x, size.y), "-r", &rate.to_string(), "-i", "-"])
            .args(["-c:v", "libx264", "-preset", "medium", "-crf", "18", "-pix_fmt", "yuv420p"])
            .args(["-movflags", "+faststart", "-f", "mp4"])
            .arg(staged.part())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|e| OutputError::Ffmpeg {
                path: path.to_owned(),
                message: if e.kind() == std::io::ErrorKind::NotFound {
                    "MP4 is written by the program `ffmpeg`, which is not on the PATH; install it, or write a .gif or .png"
                        .to_owned()
                } else {
                    format!("`ffmpeg` cannot be started: {e}")
                },
            })?;
        Ok(Self {
            path: path.to_owned(),
            size,
            child,
            staged,
        })
    }

    /// Appends a picture of the size given at creation.
    ///
    /// # Errors
    /// [`OutputError`].
    pub fn push(&mut self, image: &Image, map: &ToneMap) -> Result<(), OutputError> {
        check_frame(&self.path, self.size, image)?;
        let rgb = map.image(image);
        let written = self
            .child
            .stdin
            .as_mut()
            .map_or(Ok(()), |pipe| pipe.write_all(&rgb));
        if written.is_err() {
            // The pipe broke because ffmpeg ended: its own message says why.
            return Err(self.failure());
        }
        Ok(())
    }

    /// Waits for `ffmpeg` and gives the file its name.
    ///
    /// # Errors
    /// [`OutputError`].
    pub fn finish(mut self) -> Result<(), OutputError> {
        drop(self.child.stdin.take());
        match self.child.wait() {
            Ok(status) if status.success() => self.staged.rename(),
            _ => Err(self.failure()),
        }
    }

    fn failure(&mut self) -> OutputError {
        drop(self.child.stdin.take());
        let mut text = String::new();
        if let Some(mut pipe) = self.child.stderr.take() {
            // An unreadable message leaves the general one.
            let _ = pipe.read_to_string(&mut text);
        }
        let text = text.trim();
        OutputError::Ffmpeg {
            path: self.path.clone(),
            message: format!(
                "`ffmpeg` failed: {}",
                if text.is_empty() {
                    "it gave no reason"
                } else {
                    text
                }
            ),
        }
    }
}

impl Drop for Mp4Writer {
    fn drop(&mut self) {
        // Without `finish` the video is not wanted; after it the process is gone and both calls fail quietly.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
