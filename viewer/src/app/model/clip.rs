//! Clips of a recording, written by the code of `meniscus render` on a thread of its own.

use super::Wake;
use super::latest::Latest;
use crate::cli::render::draw_from;
use crate::cli::{Console, FrameRange, ImageSize, Interrupt, Overrides, RenderArgs, Verbosity};
use meniscus_sim::glam::UVec2;
use meniscus_sim::knobs::Turned;
use meniscus_sim::render::View;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What files a clip can be.
pub const KINDS: [(&str, &str); 3] = [
    ("gif", "GIF"),
    ("mp4", "MP4 (needs ffmpeg)"),
    ("png", "PNG, one a frame"),
];

/// Sizes that can be chosen, pixels.
pub const SIZES: [UVec2; 4] = [
    UVec2::new(480, 270),
    UVec2::new(640, 360),
    UVec2::new(1280, 720),
    UVec2::new(1920, 1080),
];

/// What a clip is to be.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// First frame.
    pub first: u64,
    /// Last frame.
    pub last: u64,
    /// Which of [`SIZES`].
    pub size: usize,
    /// Which of [`KINDS`].
    pub kind: usize,
    /// Samples a pixel.
    pub samples: u32,
}

impl Default for Clip {
    fn default() -> Self {
        Self {
            first: 0,
            last: 0,
            size: 1,
            kind: 0,
            samples: 2,
        }
    }
}

/// From where and how fast a clip is seen.
#[derive(Clone, Debug)]
pub struct Seen {
    /// The recording.
    pub recording: PathBuf,
    /// Name of the renderer.
    pub renderer: String,
    /// What of it was changed.
    pub turned: Turned,
    /// From where; the size is the clip's.
    pub view: View,
    /// Exposure in stops.
    pub exposure: f32,
    /// Simulated seconds a second.
    pub speed: f64,
}

/// Begins to write; what came of it is put into `done`.
///
/// # Errors
/// A message if no thread can be started.
pub fn write(
    clip: &Clip,
    seen: Seen,
    out: &Path,
    done: Arc<Latest<Result<String, String>>>,
    wake: Wake,
) -> Result<(), String> {
    let frames = format!("{}..={}", clip.first, clip.last.max(clip.first));
    let args = RenderArgs {
        auxiliary: false,
        passes: None,
        resume: false,
        input: seen.recording,
        overrides: Overrides::default(),
        at: None,
        frames: Some(frames.parse::<FrameRange>()?),
        renderer: seen.renderer,
        size: ImageSize(SIZES[clip.size.min(SIZES.len() - 1)]),
        camera: None,
        spp: clip.samples.max(1),
        noise: None,
        time_limit: None,
        speed: seen.speed,
        exposure: Some(f64::from(seen.exposure)),
        out: out.to_owned(),
        json: false,
    };
    let (view, turned) = (seen.view, seen.turned);
    let draw = move || {
        let console = Console::new(Verbosity::Quiet);
        let outcome = Interrupt::install()
            .and_then(|interrupt| draw_from(&args, Some((&view, &turned)), &console, interrupt))
            .map(|rendered| rendered.text())
            .map_err(|failure| failure.to_string());
        drop(done.put(outcome));
        wake();
    };
    let started = std::thread::Builder::new()
        .name("meniscus-clip".to_owned())
        .spawn(draw);
    started
        .map(drop)
        .map_err(|error| format!("cannot start a thread that draws: {error}"))
}
