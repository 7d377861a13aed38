//! One opened file: where its frames come from, and how it is looked at.

use super::camera::{Bookmark, Camera};
use super::clock::Clock;
use super::drawing::Side;
use super::history::History;
use super::live::{Command, Live, News};
use super::messages::Messages;
use super::replay::Replay;
use super::touch::Touch;
use super::{Moment, Wake};
use crate::cli::input::Input;
use meniscus_sim::events::Schedule;
use meniscus_sim::glam::{UVec2, Vec2};
use meniscus_sim::knobs::Turned;
use meniscus_sim::{Channels, Scene};
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Most markers that a timeline shows.
const MOST_MARKERS: usize = 400;

/// Times up to `end` at which the scene's events act, thinned where they are many.
fn event_times(scene: &Scene, end: f64) -> Vec<f64> {
    let description = &scene.description;
    if description.events.is_empty() {
        return Vec::new();
    }
    let mut actions = Vec::new();
    let mut schedule = Schedule::new(&description.events, description.seed, scene.grid);
    schedule.take_until(end, &mut actions);
    let mut times: Vec<f64> = actions.iter().map(|(time, _)| *time).collect();
    let step = times.len().div_ceil(MOST_MARKERS).max(1);
    times = times.into_iter().step_by(step).collect();
    times.dedup();
    times
}

/// Where frames come from.
#[derive(Debug)]
pub enum Source {
    /// A recording.
    Replay(Replay),
    /// A solver.
    Live(Live),
}

/// What is being recorded.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum RecordingState {
    /// Nothing.
    #[default]
    Off,
    /// This file, with so many frames.
    On(PathBuf, u64),
}

/// See the module.
#[derive(Debug)]
pub struct Session {
    /// The file.
    pub path: PathBuf,
    /// Where frames come from.
    pub source: Source,
    /// The scene.
    pub scene: Arc<Scene>,
    /// Where playback stands; of a live run whether it runs, how fast, and how far it came.
    pub clock: Clock,
    /// The frame that is shown.
    pub moment: Option<Arc<Moment>>,
    /// What happened from frame to frame.
    pub history: History,
    /// From where it is looked at.
    pub camera: Camera,
    /// Exposure in stops.
    pub exposure: f32,
    /// Places to look from.
    pub bookmarks: Vec<Bookmark>,
    /// What the pointer does.
    pub touch: Touch,
    /// Where elevation is plotted, metres.
    pub probe: Option<Vec2>,
    /// What is being recorded.
    pub recording: RecordingState,
    /// The recording that was finished last.
    pub recorded: Option<PathBuf>,
    /// Simulated seconds a second of the clock, of a live run.
    pub factor: Option<f64>,
    /// Why a live run ended.
    pub failed: Option<String>,
    /// A second recording, to compare with.
    pub other: Option<Replay>,
    /// Times at which the scene's own events act on the water.
    pub markers: Vec<f64>,
    /// Most sub-steps that a live run takes while a picture stands on a usual screen; 0 for as many as it takes.
    pub most_substeps: u32,
    told: (bool, f64, u32),
    /// The damaged frame that was told of last.
    damaged: Option<usize>,
}

impl Session {
    /// Begins to show what was opened.
    ///
    /// # Errors
    /// A message that says what is wrong and what to do.
    pub(crate) fn new(path: &Path, input: Input, wake: Wake) -> Result<Self, String> {
        let source = match input {
            Input::Recording(reader) => Source::Replay(Replay::new(*reader, wake)?),
            Input::Scene(scene) => Source::Live(Live::new(Arc::new(*scene), wake)?),
        };
        let (scene, range) = match &source {
            Source::Replay(replay) => (Arc::clone(replay.scene()), replay.range()),
            Source::Live(live) => (Arc::clone(live.scene()), (0.0, 0.0)),
        };
        let bookmarks = Camera::bookmarks(&scene, UVec2::new(16, 10));
        let first = bookmarks.first().ok_or("the scene cannot be looked at")?;
        let mut clock = Clock::new(range);
        clock.playing = true;
        Ok(Self {
            path: path.to_owned(),
            clock,
            moment: None,
            history: History::default(),
            camera: first.camera,
            exposure: first.exposure,
            touch: Touch::new(&scene),
            bookmarks,
            probe: None,
            recording: RecordingState::Off,
            recorded: None,
            factor: None,
            failed: None,
            other: None,
            markers: event_times(&scene, scene.description.duration.max(range.1)),
            most_substeps: 0,
            told: (false, 1.0, 0),
            damaged: None,
            scene,
            source,
        })
    }

    /// The live run, if it is one.
    pub fn live(&self) -> Option<&Live> {
        match &self.source {
            Source::Live(live) => Some(live),
            Source::Replay(_) => None,
        }
    }

    /// The recording, if it is one.
    pub fn replay(&self) -> Option<&Replay> {
        match &self.source {
            Source::Replay(replay) => Some(replay),
            Source::Live(_) => None,
        }
    }

    /// The name of its file without its extension.
    pub fn stem(&self) -> Cow<'_, str> {
        self.path.file_stem().unwrap_or_default().to_string_lossy()
    }

    /// Whether the frame of now is damaged and none before it can be shown in its place.
    pub fn lacks_frame(&self) -> bool {
        self.moment.is_none() && self.damaged.is_some()
    }

    /// The optional channels of its frames.
    pub fn channels(&self) -> Channels {
        match &self.source {
            Source::Replay(replay) => replay.channels(),
            Source::Live(live) => live.channels(),
        }
    }

    /// Lets `seconds` of the clock pass and takes what is new; a live run that is `held` stands though it is to play.
    pub fn update(&mut self, seconds: f64, held: bool, messages: &mut Messages) {
        match &self.source {
            Source::Replay(_) => self.replayed(seconds, messages),
            Source::Live(_) => self.lived(held, messages),
        }
        if let (Some(place), Some(moment)) = (self.probe, &self.moment) {
            let elevation = moment.frame.elevation.sample(place);
            self.history.row(moment.frame.index, moment.frame.time).probe = Some(elevation);
        }
    }

    fn replayed(&mut self, seconds: f64, messages: &mut Messages) {
        self.clock.tick(seconds);
        let Source::Replay(replay) = &self.source else {
            return;
        };
        let k = replay.nearest(self.clock.time);
        let shown = self.moment.as_ref().map(|moment| moment.frame.index);
        match replay.want(k, self.clock.reverse, self.clock.looping) {
            // The frame shown before stays until it is there.
            None => {}
            Some(Err(text)) if self.damaged != Some(k) => {
                self.damaged = Some(k);
                messages.warn(text);
            }
            Some(Err(_)) => {}
            Some(Ok(moment)) if shown != Some(moment.frame.index) => {
                let row = self.history.row(k as u64, moment.frame.time);
                row.report = moment.report;
                row.seconds = [moment.seconds, 0.0];
                self.moment = Some(moment);
            }
            Some(Ok(_)) => {}
        }
    }

    fn lived(&mut self, held: bool, messages: &mut Messages) {
        let Source::Live(live) = &self.source else {
            return;
        };
        let running = self.clock.playing && !held;
        let wanted = (running, self.clock.speed(), self.most_substeps);
        if wanted.0 != self.told.0 {
            live.tell(Command::Run(wanted.0));
        }
        if wanted.1 != self.told.1 {
            live.tell(Command::Speed(wanted.1));
        }
        if wanted.2 != self.told.2 {
            live.tell(Command::MostSubsteps(wanted.2));
        }
        self.told = wanted;
        for news in live.news() {
            match news {
                News::Made(index, time, report, seconds, stages) => {
                    let row = self.history.row(index, time);
                    row.report = Some(report);
                    row.seconds = seconds;
                    self.history.solved(index, stages);
                    self.clock.range.1 = time;
                    self.clock.time = time;
                    if let RecordingState::On(_, frames) = &mut self.recording {
                        *frames += 1;
                    }
                }
                News::Began => {
                    self.history.clear();
                    self.failed = None;
                }
                News::Recording(path) => self.recording = RecordingState::On(path, 1),
                News::Recorded(path, summary) => {
                    self.recording = RecordingState::Off;
                    messages.note(format!(
                        "recorded {} frames into {}",
                        summary.frames,
                        path.display()
                    ));
                    self.recorded = Some(path);
                }
                News::Refused(text) => {
                    if text.starts_with("recording") {
                        self.recording = RecordingState::Off;
                    }
                    messages.error(text);
                }
                News::Failed(text) => {
                    self.clock.playing = false;
                    self.told.0 = false;
                    messages.error(text.clone());
                    self.failed = Some(text);
                }
            }
        }
        if let Some(moment) = live.take() {
            self.moment = Some(moment);
        }
        if let Some(factor) = live.take_factor() {
            self.factor = Some(factor);
        }
        if !self.clock.playing {
            self.factor = None;
        }
    }

    /// Begins or stops.
    pub fn toggle(&mut self) {
        match self.source {
            Source::Replay(_) => self.clock.toggle(),
            Source::Live(_) => self.clock.playing = !self.clock.playing && self.failed.is_none(),
        }
    }

    /// One frame on, or back in a recording, and stands.
    pub fn step(&mut self, back: bool) {
        self.clock.playing = false;
        match &self.source {
            Source::Replay(replay) => {
                let now = replay.nearest(self.clock.time);
                let last = replay.times().len() - 1;
                let next = if back {
                    now.saturating_sub(1)
                } else {
                    (now + 1).min(last)
                };
                self.clock.seek(replay.times()[next]);
            }
            Source::Live(live) if !back => {
                live.tell(Command::Step);
                self.told.0 = false;
            }
            Source::Live(_) => {}
        }
    }

    /// To the beginning; a live run begins again.
    pub fn rewind(&mut self) {
        match &self.source {
            Source::Replay(_) => self.clock.seek(self.clock.range.0),
            Source::Live(live) => {
                live.tell(Command::Reset);
                self.clock.range = (0.0, 0.0);
            }
        }
    }

    /// Begins to record into a file, or finishes.
    pub fn record(&mut self, path: Option<PathBuf>) {
        if let Source::Live(live) = &self.source {
            live.tell(match path {
                Some(path) => Command::Record(path),
                None => Command::StopRecording,
            });
        }
    }

    /// Puts the probe somewhere.
    pub fn place_probe(&mut self, place: Option<Vec2>) {
        self.probe = place;
        self.history.clear_probe();
    }

    /// What is to be drawn by `renderer`, if there is a frame.
    pub fn side(&self, renderer: &str, turned: &Turned) -> Option<Side> {
        Some(Side {
            scene: Arc::clone(&self.scene),
            moment: Arc::clone(self.moment.as_ref()?),
            renderer: renderer.to_owned(),
            turned: turned.clone(),
        })
    }

    /// The same time of the other recording, if there is one and it is decoded.
    pub fn other_side(&self, renderer: &str, turned: &Turned) -> Option<Side> {
        let other = self.other.as_ref()?;
        let time = self.moment.as_ref()?.frame.time;
        let decoded = other.want(other.nearest(time), self.clock.reverse, self.clock.looping)?;
        Some(Side {
            scene: Arc::clone(other.scene()),
            moment: decoded.ok()?,
            renderer: renderer.to_owned(),
            turned: turned.clone(),
        })
    }
}
