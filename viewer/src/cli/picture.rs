//! Picture files: PNG and EXR one a frame, animations one for all.

use super::failure::Failure;
use glam::UVec2;
use meniscus_render_cpu::output::{self, ApngWriter, Channel, ExrExtras, GifWriter, Mp4Writer, OutputError};
use meniscus_render_cpu::tonemap::ToneMap;
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
    /// An animation, tone-mapped, in full colour.
    Apng,
    /// A video, tone-mapped, encoded by ffmpeg.
    Mp4,
}

impl PictureKind {
    /// The kind that the extension of `path` says.
    ///
    /// # Errors
    /// [`Failure::Input`] that lists the kinds.
    pub(crate) fn of(path: &Path) -> Result<Self, Failure> {
        let extension = path
            .extension()
            .unwrap_or_default()
            .to_string_lossy()
            .to_ascii_lowercase();
        match extension.as_str() {
            "png" => Ok(Self::Png),
            "exr" => Ok(Self::Exr),
            "gif" => Ok(Self::Gif),
            "apng" => Ok(Self::Apng),
            "mp4" => Ok(Self::Mp4),
            _ => Err(Failure::input(format_args!(
                "{}: the name must end in .png, .exr, .gif, .apng or .mp4, which says what is written",
                path.display()
            ))),
        }
    }

    /// Whether one file holds all pictures.
    pub(crate) fn is_animation(self) -> bool {
        matches!(self, Self::Gif | Self::Apng | Self::Mp4)
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
    /// Most pictures that there will be.
    pub(crate) count: u64,
    /// Exposure in stops; EXR files hold radiance and leave it out.
    pub(crate) exposure: f32,
}

/// What an EXR holds beside its picture.
#[derive(Clone, Debug, Default)]
pub(crate) struct Extras {
    pub(crate) planes: Vec<(&'static str, Vec<f32>)>,
    pub(crate) counts: Vec<(&'static str, Vec<u32>)>,
    pub(crate) attributes: Vec<(&'static str, String)>,
}

/// Where pictures go, one after the other. Every file appears under its name when it is whole.
pub(crate) struct Pictures {
    out: PathBuf,
    kind: PictureKind,
    map: ToneMap,
    /// Whether every still has its frame's number in the name.
    numbered: bool,
    animation: Option<Animation>,
    written: usize,
}

enum Animation {
    Gif(Box<GifWriter>),
    Apng(Box<ApngWriter>),
    Mp4(Mp4Writer),
}

impl Pictures {
    /// Begins the output. `numbered` stills get the number of their frame into the name.
    ///
    /// # Errors
    /// [`Failure::Run`] if it cannot be written, or if ffmpeg is needed and missing; [`Failure::Input`] if the format
    /// cannot hold such a size or rate.
    pub(crate) fn create(out: &Path, format: PictureFormat, numbered: bool) -> Result<Self, Failure> {
        let animation = match format.kind {
            PictureKind::Png | PictureKind::Exr => None,
            PictureKind::Gif => {
                let writer = GifWriter::create(out, format.size, format.rate).map_err(classify)?;
                Some(Animation::Gif(Box::new(writer)))
            }
            PictureKind::Apng => {
                let writer =
                    ApngWriter::create(out, format.size, format.rate, format.count).map_err(classify)?;
                Some(Animation::Apng(Box::new(writer)))
            }
            PictureKind::Mp4 => {
                let writer = Mp4Writer::create(out, format.size, format.rate).map_err(classify)?;
                Some(Animation::Mp4(writer))
            }
        };
        Ok(Self {
            out: out.to_owned(),
            kind: format.kind,
            map: ToneMap::new(format.exposure),
            numbered,
            animation,
            written: 0,
        })
    }

    /// The file that the picture of frame `index` is in.
    pub(crate) fn file(&self, index: u64) -> PathBuf {
        if self.numbered && self.animation.is_none() {
            numbered_name(&self.out, index)
        } else {
            self.out.clone()
        }
    }

    /// Writes the picture of frame `index`, an EXR with `extras`; returns the file that it is in.
    ///
    /// # Errors
    /// [`Failure::Run`]
    pub(crate) fn write(&mut self, image: &Image, index: u64, extras: &Extras) -> Result<PathBuf, Failure> {
        let path = self.file(index);
        match &mut self.animation {
            Some(Animation::Gif(gif)) => gif.push(image, &self.map),
            Some(Animation::Apng(apng)) => apng.push(image, &self.map),
            Some(Animation::Mp4(mp4)) => mp4.push(image, &self.map),
            None if self.kind == PictureKind::Exr => {
                let planes = extras.planes.iter();
                let channels: Vec<Channel<'_>> =
                    planes.map(|(name, values)| Channel { name, values }).collect();
                let extras = ExrExtras {
                    channels: &channels,
                    counts: &extras.counts,
                    attributes: &extras.attributes,
                };
                output::write_exr_with(&path, image, &extras)
            }
            None => output::write_png(&path, image, &self.map),
        }
        .map_err(classify)?;
        self.written += 1;
        Ok(path)
    }

    /// Closes the file of an animation. One without any picture never appears.
    ///
    /// # Errors
    /// [`Failure::Run`]
    pub(crate) fn finish(self) -> Result<(), Failure> {
        if self.written == 0 {
            return Ok(());
        }
        match self.animation {
            Some(Animation::Gif(gif)) => gif.finish(),
            Some(Animation::Apng(apng)) => apng.finish(),
            Some(Animation::Mp4(mp4)) => mp4.finish(),
            None => Ok(()),
        }
        .map_err(classify)
    }
}

/// A size or rate that a format cannot hold is wrong input; all else went wrong on the way.
fn classify(error: OutputError) -> Failure {
    match error {
        OutputError::Size { .. } => Failure::Input(error.into()),
        OutputError::Rate { .. } => {
            Failure::input(format_args!("{error}; choose another --speed, or stills"))
        }
        _ => Failure::Run(error.into()),
    }
}

/// `wave.png` for frame 7 is `wave_000007.png`, as exported files are named.
fn numbered_name(out: &Path, index: u64) -> PathBuf {
    let stem = out.file_stem().unwrap_or_default().to_string_lossy();
    let extension = out.extension().unwrap_or_default().to_string_lossy();
    out.with_file_name(format!("{stem}_{index:06}.{extension}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_says_the_kind() {
        assert_eq!(PictureKind::of(Path::new("a/b.PNG")).ok(), Some(PictureKind::Png));
        for bad in ["a", "a.jpg", "png", ".png"] {
            assert_eq!(
                PictureKind::of(Path::new(bad)).unwrap_err().exit_code(),
                2,
                "{bad}"
            );
        }
    }

    #[test]
    fn names_sort_as_frames_do() {
        assert_eq!(
            numbered_name(Path::new("d/w.png"), 7),
            Path::new("d/w_000007.png")
        );
        assert_eq!(
            numbered_name(Path::new("w.a.exr"), 1_234_567),
            Path::new("w.a_1234567.exr")
        );
    }
}
