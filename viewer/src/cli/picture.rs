//! Picture files: PNG and EXR one a frame, GIF and MP4 one for all.

use super::claim::Claim;
use super::failure::{Classify as _, Failure};
use super::video::Video;
use glam::UVec2;
use meniscus_render_cpu::output::{self, GifWriter};
use meniscus_sim::render::Image;
use std::path::{Path, PathBuf};

/// What kind of file a name asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PictureKind {
    /// Eight bits a channel, tone-mapped.
    Png,
    /// Linear radiance, not tone-mapped.
    Exr,
    /// An animation, tone-mapped, with a palette a frame.
    Gif,
    /// A video, tone-mapped, encoded by ffmpeg.
    Mp4,
}

impl PictureKind {
    /// The kind that the extension of `path` says.
    ///
    /// # Errors
    /// [`Failure::Input`] that lists the kinds.
    pub(crate) fn of(path: &Path) -> Result<Self, Failure> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
        match extension.as_str() {
            "png" => Ok(Self::Png),
            "exr" => Ok(Self::Exr),
            "gif" => Ok(Self::Gif),
            "mp4" => Ok(Self::Mp4),
            _ => Err(Failure::input(format_args!(
                "{}: the name must end in .png, .exr, .gif or .mp4, which says what is written",
                path.display()
            ))),
        }
    }

    /// Whether one file holds all pictures.
    pub(crate) fn is_animation(self) -> bool {
        matches!(self, Self::Gif | Self::Mp4)
    }
}

/// What is common to all pictures of a command.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PictureFormat {
    pub(crate) kind: PictureKind,
    /// Pixels.
    pub(crate) size: UVec2,
    /// Pictures a second of an animation.
    pub(crate) rate: f64,
    /// Exposure in stops; EXR files hold radiance and leave it out.
    pub(crate) exposure: f32,
}

/// Where pictures go, one after the other.
pub(crate) struct Pictures {
    out: PathBuf,
    format: PictureFormat,
    /// Largest frame number, where every picture gets a file with its number in the name.
    numbered: Option<u64>,
    sink: Sink,
}

enum Sink {
    /// A file a picture; the first is claimed before anything is drawn.
    Files(Option<Claim>),
    Gif(GifWriter, Claim),
    Video(Video, Claim),
}

impl Pictures {
    /// Claims the output. `numbered` gives the first and the last frame where there is a file for each.
    ///
    /// # Errors
    /// [`Failure`] if the output cannot be written or ffmpeg is missing.
    pub(crate) fn create(out: &Path, format: PictureFormat, numbered: Option<(u64, u64)>) -> Result<Self, Failure> {
        let sink = match format.kind {
            PictureKind::Png | PictureKind::Exr => {
                let first = match numbered {
                    Some((first, last)) => numbered_name(out, first, last),
                    None => out.to_owned(),
                };
                Sink::Files(Some(Claim::new(&first)?))
            }
            PictureKind::Gif => {
                let claim = Claim::new(out)?;
                Sink::Gif(GifWriter::create(out, format.size, format.rate).or_run()?, claim)
            }
            PictureKind::Mp4 => {
                let claim = Claim::new(out)?;
                Sink::Video(Video::start(out, format.size, format.rate)?, claim)
            }
        };
        Ok(Self {
            out: out.to_owned(),
            format,
            numbered: numbered.map(|(_, last)| last),
            sink,
        })
    }

    /// Writes the picture of frame `index`; returns the file that it is in.
    ///
    /// # Errors
    /// [`Failure::Run`]
    pub(crate) fn write(&mut self, image: &Image, index: u64) -> Result<PathBuf, Failure> {
        let path = match self.numbered {
            Some(last) if !self.format.kind.is_animation() => numbered_name(&self.out, index, last),
            _ => self.out.clone(),
        };
        match &mut self.sink {
            Sink::Files(claim) => {
                match self.format.kind {
                    PictureKind::Exr => output::write_exr(&path, image),
                    _ => output::write_png(&path, image, self.format.exposure),
                }
                .or_run()?;
                if let Some(claim) = claim.take() {
                    claim.keep();
                }
            }
            Sink::Gif(gif, _) => gif.push(image, self.format.exposure).or_run()?,
            Sink::Video(video, _) => video.push(image, self.format.exposure)?,
        }
        Ok(path)
    }

    /// Closes the file of an animation. One without any picture is removed.
    ///
    /// # Errors
    /// [`Failure::Run`]
    pub(crate) fn finish(self, written: usize) -> Result<(), Failure> {
        let claim = match self.sink {
            Sink::Files(_) => return Ok(()),
            Sink::Gif(gif, claim) => {
                gif.finish().or_run()?;
                claim
            }
            Sink::Video(video, claim) => {
                video.finish()?;
                claim
            }
        };
        if written > 0 {
            claim.keep();
        }
        Ok(())
    }
}

/// `wave.png` for frame 7 of 1 to 120 is `wave-0007.png`: four digits at least, so that names sort as frames do.
fn numbered_name(out: &Path, index: u64, last: u64) -> PathBuf {
    let digits = last.to_string().len().max(4);
    let stem = out.file_stem().unwrap_or_default().to_string_lossy();
    let extension = out.extension().unwrap_or_default().to_string_lossy();
    out.with_file_name(format!("{stem}-{index:0digits$}.{extension}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_says_the_kind() {
        assert_eq!(PictureKind::of(Path::new("a/b.PNG")).ok(), Some(PictureKind::Png));
        for bad in ["a", "a.jpg", "png", ".png"] {
            assert_eq!(PictureKind::of(Path::new(bad)).unwrap_err().exit_code(), 2, "{bad}");
        }
    }

    #[test]
    fn names_sort_as_frames_do() {
        assert_eq!(numbered_name(Path::new("d/w.png"), 7, 120), Path::new("d/w-0007.png"));
        assert_eq!(numbered_name(Path::new("w.a.exr"), 7, 12_345), Path::new("w.a-00007.exr"));
    }
}
