//! MP4 through the program `ffmpeg`, where it is installed.

use super::failure::Failure;
use glam::UVec2;
use meniscus_render_cpu::tonemap::ToneMap;
use meniscus_sim::render::Image;
use std::io::{self, Read as _, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// A running ffmpeg that takes pictures on its standard input.
pub(crate) struct Video {
    ffmpeg: Child,
}

impl Video {
    /// Starts ffmpeg.
    ///
    /// # Errors
    /// [`Failure::Input`] for an odd size, which the pixel format of players cannot hold; [`Failure::Run`] without
    /// ffmpeg.
    pub(crate) fn start(out: &Path, size: UVec2, rate: f64) -> Result<Self, Failure> {
        if size.x % 2 == 1 || size.y % 2 == 1 {
            return Err(Failure::input(format_args!(
                "--size {}x{}: width and height of an MP4 must be even; choose {}x{}, or write a GIF",
                size.x,
                size.y,
                size.x.next_multiple_of(2),
                size.y.next_multiple_of(2)
            )));
        }
        let mut command = Command::new("ffmpeg");
        command
            .args(["-loglevel", "error", "-y", "-f", "rawvideo", "-pixel_format", "rgb24"])
            .args(["-video_size", &format!("{}x{}", size.x, size.y), "-framerate", &rate.to_string()])
            .args(["-i", "-", "-an", "-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p"])
            .args(["-movflags", "+faststart", "-f", "mp4"])
            .arg(out)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        // Ctrl-C on a terminal goes to the whole process group; ffmpeg has to live on to close the file.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let ffmpeg = command.spawn().map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => Failure::run(format_args!(
                "{}: MP4 is written by the program `ffmpeg`, which is not on PATH; install it, or write a .gif or \
                 numbered .png files",
                out.display()
            )),
            _ => Failure::run(format_args!("cannot start ffmpeg: {error}; write a .gif or numbered .png files")),
        })?;
        Ok(Self { ffmpeg })
    }

    /// Hands a picture to ffmpeg.
    ///
    /// # Errors
    /// [`Failure::Run`] with what ffmpeg said if it has ended.
    pub(crate) fn push(&mut self, image: &Image, exposure: f32) -> Result<(), Failure> {
        let bytes = ToneMap::new(exposure).image(image);
        let Some(input) = &mut self.ffmpeg.stdin else {
            return Err(Failure::run("ffmpeg takes no more pictures"));
        };
        match input.write_all(&bytes) {
            Ok(()) => Ok(()),
            Err(error) => Err(self.failed(&error.to_string())),
        }
    }

    /// Waits for ffmpeg to close the file.
    ///
    /// # Errors
    /// [`Failure::Run`] with what ffmpeg said if it could not.
    pub(crate) fn finish(mut self) -> Result<(), Failure> {
        drop(self.ffmpeg.stdin.take());
        match self.ffmpeg.wait() {
            Ok(status) if status.success() => Ok(()),
            Ok(status) => Err(self.failed(&status.to_string())),
            Err(error) => Err(self.failed(&error.to_string())),
        }
    }

    /// What went wrong: the last line that ffmpeg wrote, else `otherwise`.
    fn failed(&mut self, otherwise: &str) -> Failure {
        drop(self.ffmpeg.stdin.take());
        let mut said = String::new();
        if let Some(stderr) = &mut self.ffmpeg.stderr {
            // What cannot be read is not shown.
            let _ = stderr.read_to_string(&mut said);
        }
        let said = said.lines().rev().map(str::trim).find(|line| !line.is_empty());
        Failure::run(format_args!("ffmpeg failed: {}", said.unwrap_or(otherwise)))
    }
}

impl Drop for Video {
    /// Leaves no process behind when a run is given up.
    fn drop(&mut self) {
        drop(self.ffmpeg.stdin.take());
        let _ = self.ffmpeg.wait();
    }
}
