//! Frames by number, from a recording or from a live run.

use super::args::FrameRange;
use super::failure::Failure;
use super::input::Input;
use super::interrupt::Interrupt;
use super::live;
use meniscus_sim::recording::{Reader, RecordingError};
use meniscus_sim::render::Renderer;
use meniscus_sim::source::LiveSource;
use meniscus_sim::{Channels, Frame, FrameSource as _, Progress, Scene};
use std::ops::Range;

/// A sequence of frames that is read forwards.
pub(crate) enum Frames {
    /// A recording, read in any order.
    Recorded(Box<Reader>),
    /// A live run, which goes through every frame.
    Live {
        scene: Box<Scene>,
        source: Box<LiveSource>,
        /// Number of the frame that comes next.
        next: u64,
    },
}

impl Frames {
    /// The frames of a recording, or of a scene run live with what `renderer` needs of what is offered.
    ///
    /// # Errors
    /// [`Failure::Input`] if no solver can be built.
    pub(crate) fn new(input: Input, renderer: &dyn Renderer) -> Result<Self, Failure> {
        Ok(match input {
            Input::Recording(reader) => Self::Recorded(reader),
            Input::Scene(scene) => {
                let solver = live::solver(&scene)?;
                let choices = live::choose_channels(&scene, live::offers(&scene, solver.as_ref()), renderer);
                let source = Box::new(live::source(&scene, solver, live::active(&choices)));
                Self::Live {
                    scene,
                    source,
                    next: 0,
                }
            }
        })
    }

    pub(crate) fn scene(&self) -> &Scene {
        match self {
            Self::Recorded(reader) => reader.scene(),
            Self::Live { scene, .. } => scene,
        }
    }

    /// The optional channels that every frame has.
    pub(crate) fn channels(&self) -> Channels {
        match self {
            Self::Recorded(reader) => reader.channels(),
            Self::Live { source, .. } => source.channels(),
        }
    }

    /// Number of frames: of a recording those in it, of a live run those of the scene's duration.
    pub(crate) fn len(&self) -> u64 {
        match self {
            Self::Recorded(reader) => reader.len() as u64,
            Self::Live { scene, .. } => live::frame_count(scene, scene.description.duration),
        }
    }

    /// The frame nearest to `time`.
    ///
    /// # Errors
    /// [`Failure::Input`] if a recording ends more than one frame before.
    pub(crate) fn nearest(&self, time: f64) -> Result<u64, Failure> {
        let rate = self.scene().description.recording.rate;
        let reader = match self {
            Self::Live { .. } => return Ok((time * rate).round() as u64),
            Self::Recorded(reader) => reader,
        };
        let before = reader.frame_at(time).ok_or_else(|| {
            Failure::input(format_args!(
                "{}: the recording holds no whole frame; record it again",
                reader.path().display()
            ))
        })?;
        let last = reader.time(reader.len() - 1);
        if time > last + 1.0 / rate {
            return Err(Failure::input(format_args!(
                "--at {time}: the recording ends at {last} s; ask for a time up to that"
            )));
        }
        let after = (before + 1).min(reader.len() - 1);
        let nearer = if reader.time(after) - time < time - reader.time(before) {
            after
        } else {
            before
        };
        Ok(nearer as u64)
    }

    /// The frames that `range` names.
    ///
    /// # Errors
    /// [`Failure::Input`] if a recording lacks one of them, or if there are none.
    pub(crate) fn select(&self, range: FrameRange) -> Result<Range<u64>, Failure> {
        let selected = match self {
            Self::Recorded(_) => range.within(self.len()),
            Self::Live { .. } => range.unbounded(self.len()),
        };
        selected.map_err(|message| Failure::input(format_args!("--frames: {message}")))
    }

    /// Reads frame `index`, which must not lie before one read earlier. `stepped` is called with the number of every
    /// frame that a live run passes on the way. `false`: Ctrl-C was pressed on the way.
    ///
    /// # Errors
    /// [`FrameError`]
    pub(crate) fn read(
        &mut self,
        index: u64,
        frame: &mut Frame,
        interrupt: Interrupt,
        stepped: impl Fn(u64),
    ) -> Result<bool, FrameError> {
        match self {
            Self::Recorded(reader) => {
                let index = usize::try_from(index).unwrap_or(usize::MAX);
                match reader.read(index, frame) {
                    Ok(_) => Ok(true),
                    Err(error @ RecordingError::DamagedFrame { .. }) => {
                        Err(FrameError::Damaged(error.to_string()))
                    }
                    Err(error) => Err(FrameError::Failed(Failure::Run(error.into()))),
                }
            }
            Self::Live { scene, source, next } => {
                while *next <= index {
                    if interrupt.pressed() {
                        return Ok(false);
                    }
                    match source.read_into(frame) {
                        Ok(Progress::Frame(_)) => {}
                        // It was made without an end.
                        Ok(Progress::End) => break,
                        Err(error) => {
                            return Err(FrameError::Failed(live::run_failed(error, scene, *next, "")));
                        }
                    }
                    *next += 1;
                    stepped(*next);
                }
                Ok(true)
            }
        }
    }
}

/// Why a frame could not be had.
pub(crate) enum FrameError {
    /// It is damaged, and others are not.
    Damaged(String),
    /// Nothing more can be had.
    Failed(Failure),
}
