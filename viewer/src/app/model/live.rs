//! A scene that is run by a thread of its own, and acted upon.

use super::history::Stages;
use super::latest::Latest;
use super::{Moment, Wake};
use crate::cli::live as runs;
use meniscus_sim::events::Action;
use meniscus_sim::recording::{Summary, Writer};
use meniscus_sim::source::LiveSource;
use meniscus_sim::{Channels, Frame, FrameSource as _, Progress, Scene, StepReport};
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What a live run can be told.
#[derive(Clone, Debug)]
pub enum Command {
    /// Act on the water, after the latest frame.
    Act(Action),
    /// Run or stand.
    Run(bool),
    /// Make one frame and stand.
    Step,
    /// Simulated seconds a second to keep to, as far as the solver can.
    Speed(f64),
    /// Take at most so many sub-steps in [`PICTURE`] seconds of the clock, and rather run slower; 0 for as many as it takes.
    MostSubsteps(u32),
    /// Begin again.
    Reset,
    /// Record from the latest frame on.
    Record(PathBuf),
    /// Finish the recording.
    StopRecording,
}

/// What a live run tells, besides frames.
#[derive(Debug)]
pub enum News {
    /// A frame was made: number, time, totals, seconds it took to solve and to hand to the recording, and in which stages.
    Made(u64, f64, StepReport, [f64; 2], Stages),
    /// It began again: what follows are frames of another run.
    Began,
    /// Recording began.
    Recording(PathBuf),
    /// A recording is whole.
    Recorded(PathBuf, Summary),
    /// An action was refused; the run goes on.
    Refused(String),
    /// The run ended; the last frame stays. Only a reset goes on.
    Failed(String),
}

/// Simulated seconds that may be made up for when solving falls behind, seconds of the clock.
const MOST_BEHIND: f64 = 0.25;

/// Seconds of the clock that a picture stands on a usual screen: sub-steps are limited in each.
pub const PICTURE: f64 = 1.0 / 60.0;

/// Frames whose clock the real-time factor is taken from.
const FACTOR_FRAMES: usize = 30;

/// See the module.
#[derive(Debug)]
pub struct Live {
    scene: Arc<Scene>,
    channels: Channels,
    solver: &'static str,
    bytes: u64,
    commands: Option<Sender<Command>>,
    frames: Arc<Latest<Arc<Moment>>>,
    news: Receiver<News>,
    factor: Arc<Latest<f64>>,
    thread: Option<JoinHandle<()>>,
}

impl Live {
    /// Builds the solver and makes the first frame; stands until told to run.
    ///
    /// # Errors
    /// A message that says why the solver cannot be built.
    pub fn new(scene: Arc<Scene>, wake: Wake) -> Result<Self, String> {
        let source = start(&scene)?;
        let (commands, incoming) = channel();
        let (outgoing, news) = channel();
        let frames = Arc::new(Latest::default());
        let factor = Arc::new(Latest::default());
        let (channels, solver, bytes) = (source.channels(), source.solver().name(), source.solver().bytes());
        let runner = Runner {
            scene: Arc::clone(&scene),
            source: Some(source),
            frames: Arc::clone(&frames),
            factor: Arc::clone(&factor),
            news: outgoing,
            wake,
            running: false,
            speed: 1.0,
            most_substeps: 0,
            earliest: None,
            made: VecDeque::new(),
            pool: Vec::new(),
            latest: None,
            recording: None,
            pace: None,
        };
        let thread = std::thread::Builder::new()
            .name("meniscus-solve".to_owned())
            .spawn(move || runner.run(&incoming))
            .map_err(|error| format!("cannot start a thread that solves: {error}"))?;
        Ok(Self {
            scene,
            channels,
            solver,
            bytes,
            commands: Some(commands),
            frames,
            news,
            factor,
            thread: Some(thread),
        })
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The optional channels that its frames have.
    pub fn channels(&self) -> Channels {
        self.channels
    }

    /// Name of the solver.
    pub fn solver(&self) -> &'static str {
        self.solver
    }

    /// Bytes that the solver holds.
    pub fn solver_bytes(&self) -> u64 {
        self.bytes
    }

    /// Tells it something; it does so after the frame in hand.
    pub fn tell(&self, command: Command) {
        if let Some(commands) = &self.commands {
            // A runner that is gone has said why.
            let _ = commands.send(command);
        }
    }

    /// The newest frame, if there is one since the last call.
    pub fn take(&self) -> Option<Arc<Moment>> {
        self.frames.take()
    }

    /// What happened since the last call.
    pub fn news(&self) -> Vec<News> {
        self.news.try_iter().collect()
    }

    /// Simulated seconds a second of the clock, where that is known anew.
    pub fn take_factor(&self) -> Option<f64> {
        self.factor.take()
    }
}

impl Drop for Live {
    /// Waits for the frame in hand and for the recording to be whole.
    fn drop(&mut self) {
        drop(self.commands.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// A run from the beginning, with the channels that recording the scene would choose.
fn start(scene: &Scene) -> Result<LiveSource, String> {
    let say = |failure: crate::cli::Failure| failure.to_string();
    let solver = runs::solver(scene).map_err(say)?;
    let renderer = runs::renderer(runs::DEFAULT_RENDERER).map_err(say)?;
    let choices = runs::choose_channels(scene, runs::offers(scene, solver.as_ref()), renderer.as_ref());
    Ok(runs::source(scene, solver, runs::active(&choices)))
}

struct Recording {
    writer: Writer,
    path: PathBuf,
    /// How much of what was done is in it.
    told: usize,
}

/// Frame and moment of the clock from which the schedule counts.
#[derive(Clone, Copy)]
struct Pace {
    since: Instant,
    time: f64,
}

struct Runner {
    scene: Arc<Scene>,
    /// `None` once it failed.
    source: Option<LiveSource>,
    frames: Arc<Latest<Arc<Moment>>>,
    factor: Arc<Latest<f64>>,
    news: Sender<News>,
    wake: Wake,
    running: bool,
    speed: f64,
    most_substeps: u32,
    /// Before which the next frame is not to be made, so that sub-steps stay within their limit.
    earliest: Option<Instant>,
    /// When the latest frames were made, and their times.
    made: VecDeque<(Instant, f64)>,
    /// Frames that were handed out and may be free again.
    pool: Vec<Arc<Moment>>,
    latest: Option<Arc<Moment>>,
    recording: Option<Recording>,
    pace: Option<Pace>,
}

impl Runner {
    fn run(mut self, commands: &Receiver<Command>) {
        self.make();
        loop {
            let wait = self.wait();
            let command = match wait {
                // Nothing to do until told so.
                None => commands.recv().map_err(|_| RecvTimeoutError::Disconnected),
                Some(wait) => commands.recv_timeout(wait),
            };
            match command {
                Ok(command) => self.obey(command),
                Err(RecvTimeoutError::Timeout) => self.make(),
                Err(RecvTimeoutError::Disconnected) => break,
            }
        }
        self.stop_recording();
    }

    /// How long until the next frame is due; `None` while it stands.
    fn wait(&mut self) -> Option<Duration> {
        if !self.running || self.source.is_none() {
            self.pace = None;
            return None;
        }
        let now = Instant::now();
        let time = self.latest.as_ref().map_or(0.0, |moment| moment.frame.time);
        let next = time + 1.0 / self.scene.description.recording.rate;
        let pace = *self.pace.get_or_insert(Pace { since: now, time });
        let due = (next - pace.time) / self.speed;
        let behind = now.duration_since(pace.since).as_secs_f64() - due;
        if behind > MOST_BEHIND {
            // It cannot keep up: from here on again, so that it never has to hurry.
            self.pace = Some(Pace { since: now, time });
        }
        let wait = Duration::from_secs_f64((-behind).max(0.0));
        let spared = self
            .earliest
            .map(|earliest| earliest.saturating_duration_since(now));
        Some(wait.max(spared.unwrap_or_default()))
    }

    fn say(&self, news: News) {
        // Nobody listens while the window closes.
        let _ = self.news.send(news);
        (self.wake)();
    }

    fn obey(&mut self, command: Command) {
        match command {
            Command::Act(action) => {
                if let Some(Err(error)) = self.source.as_mut().map(|source| source.act(&action)) {
                    self.say(News::Refused(error.to_string()));
                }
            }
            Command::Run(running) => {
                self.running = running;
                self.made.clear();
            }
            Command::Step => {
                self.running = false;
                self.make();
            }
            Command::Speed(speed) => {
                self.speed = speed.max(1e-6);
                self.pace = None;
                self.made.clear();
            }
            Command::MostSubsteps(most) => {
                self.most_substeps = most;
                self.earliest = None;
                self.pace = None;
                self.made.clear();
            }
            Command::Reset => self.reset(),
            Command::Record(path) => self.record(path),
            Command::StopRecording => self.stop_recording(),
        }
    }

    fn reset(&mut self) {
        self.stop_recording();
        match start(&self.scene) {
            Ok(source) => {
                self.source = Some(source);
                self.latest = None;
                self.pace = None;
                self.made.clear();
                self.say(News::Began);
                self.make();
            }
            Err(error) => self.say(News::Failed(error)),
        }
    }

    /// Makes the next frame, hands it to the recording and to whoever shows it.
    fn make(&mut self) {
        let Some(source) = self.source.as_mut() else {
            return;
        };
        let start = Instant::now();
        let mut moment = take_free(&mut self.pool, &self.scene);
        let outcome = Arc::get_mut(&mut moment).map(|free| {
            let progress = source.read_into(&mut free.frame);
            free.seconds = start.elapsed().as_secs_f64();
            if let Ok(Progress::Frame(report)) = &progress {
                free.report = *report;
            }
            progress
        });
        match outcome {
            Some(Ok(Progress::Frame(report))) => {
                let solved = moment.seconds;
                let stages = self
                    .source
                    .as_ref()
                    .map_or_else(Vec::new, |source| source.stages().to_vec());
                let writing = Instant::now();
                self.latest = Some(Arc::clone(&moment));
                self.write(&moment);
                self.count(moment.frame.time);
                let report = report.unwrap_or_default();
                self.earliest = (self.most_substeps > 0).then(|| {
                    let pictures = f64::from(report.substeps) / f64::from(self.most_substeps);
                    start + Duration::from_secs_f64(PICTURE * pictures)
                });
                let made = News::Made(
                    moment.frame.index,
                    moment.frame.time,
                    report,
                    [solved, writing.elapsed().as_secs_f64()],
                    stages,
                );
                drop(self.frames.put(Arc::clone(&moment)));
                self.pool.push(moment);
                self.say(made);
            }
            // It was made without an end.
            Some(Ok(Progress::End)) | None => {}
            Some(Err(error)) => {
                self.source = None;
                self.running = false;
                self.stop_recording();
                let time = self.latest.as_ref().map_or(0.0, |moment| moment.frame.time);
                self.say(News::Failed(format!(
                    "the run stopped after t = {time:.3} s: {error}. The last good frame stays; reset to run again"
                )));
            }
        }
    }

    /// Keeps account of how fast simulated time passes.
    fn count(&mut self, time: f64) {
        self.made.push_back((Instant::now(), time));
        if self.made.len() > FACTOR_FRAMES {
            self.made.pop_front();
        }
        if let (Some(first), Some(last)) = (self.made.front(), self.made.back()) {
            let clock = last.0.duration_since(first.0).as_secs_f64();
            if clock > 0.0 {
                self.factor.put((last.1 - first.1) / clock);
            }
        }
    }

    fn record(&mut self, path: PathBuf) {
        self.stop_recording();
        let Some(channels) = self.source.as_ref().map(LiveSource::channels) else {
            self.say(News::Refused(
                "there is nothing to record: the run has failed; reset it first".to_owned(),
            ));
            return;
        };
        match Writer::create(&path, &self.scene, channels) {
            Ok(writer) => {
                self.recording = Some(Recording {
                    writer,
                    path: path.clone(),
                    told: 0,
                });
                self.say(News::Recording(path));
                if let Some(latest) = self.latest.clone() {
                    self.write(&latest);
                }
            }
            Err(error) => self.say(News::Refused(format!("recording: {error}"))),
        }
    }

    /// Records a frame, and what was done before it.
    fn write(&mut self, moment: &Moment) {
        let (Some(recording), Some(source)) = (&mut self.recording, &self.source) else {
            return;
        };
        let acted = source.acted();
        // What was done after the frame that is latest belongs to the next one.
        let until = acted.partition_point(|(time, _)| *time < moment.frame.time);
        let new = acted.get(recording.told..until).unwrap_or_default();
        let pushed = recording.writer.push_acted(&moment.frame, moment.report, new);
        recording.told = until.max(recording.told);
        if let Err(error) = pushed {
            let path = recording.path.display().to_string();
            self.recording = None;
            self.say(News::Refused(format!(
                "recording {path} ended: {error}. What was written before can be read"
            )));
        }
    }

    fn stop_recording(&mut self) {
        let Some(recording) = self.recording.take() else {
            return;
        };
        let path = recording.path;
        match recording.writer.finish() {
            Ok(summary) => self.say(News::Recorded(path, summary)),
            Err(error) => self.say(News::Refused(format!(
                "recording {} could not be finished: {error}. What was written before can be read",
                path.display()
            ))),
        }
    }
}

/// A frame that nobody holds any more, or a new one.
fn take_free(pool: &mut Vec<Arc<Moment>>, scene: &Scene) -> Arc<Moment> {
    match pool.iter_mut().position(|moment| Arc::get_mut(moment).is_some()) {
        Some(free) => pool.swap_remove(free),
        None => Arc::new(Moment {
            frame: Frame::new(scene.grid),
            report: None,
            seconds: 0.0,
        }),
    }
}
