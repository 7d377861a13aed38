//! Everything that the window shows and does, whatever it looks like.

mod asking;
mod saving;

use super::Wake;
use super::clip::Clip;
pub use super::compare::{Compare, Mode};
use super::drawing::{Drawing, Drawn, Make};
use super::latest::Latest;
use super::live::Command;
use super::messages::Messages;
use super::quality::{Pace, Quality};
use super::recent::Recent;
use super::renderers::{self, Choices};
use super::replay::Replay;
use super::session::Session;
use super::touch::Pointer;
use crate::cli::input::Input;
use crate::cli::{Console, Verbosity};
use asking::Inputs;
use meniscus_render_gpu::device::Gpu;
use meniscus_sim::glam::UVec2;
use meniscus_sim::knobs::{Knob, Turned};
use meniscus_sim::render::{PlanItem, Renderer};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use saving::{free_name, recording_name};

/// Seconds without a change after which the view is at rest.
const REST: f64 = 0.35;

type Opened = (PathBuf, Vec<String>, bool, Result<Input, String>);

/// See the module.
pub struct Player {
    /// What is open.
    pub session: Option<Session>,
    /// What there is to tell.
    pub messages: Messages,
    /// The renderers of this machine.
    pub choices: Choices,
    /// Name of the renderer.
    pub renderer: String,
    /// What of the renderers was changed, by their names.
    pub turned: HashMap<String, Turned>,
    /// What is compared.
    pub compare: Compare,
    /// How many pixels are drawn.
    pub quality: Quality,
    /// Files that were opened before.
    pub recent: Recent,
    /// The newest picture.
    pub drawn: Option<Arc<Drawn>>,
    /// What the next clip is to be.
    pub clip: Clip,
    /// Changes to the keys of the scene that was opened last.
    pub overrides: Vec<String>,
    drawing: Drawing,
    pace: Pace,
    wake: Wake,
    opening: Arc<Latest<Opened>>,
    busy: Option<PathBuf>,
    ordered: Option<(u64, bool)>,
    number: u64,
    /// The first order of what is open.
    oldest: u64,
    /// Whether time stands because nothing of what is open was seen yet.
    waits: bool,
    last: Option<Inputs>,
    changed: f64,
    rested: bool,
    sessions: u64,
    now: f64,
    planned: Option<(String, Vec<PlanItem>)>,
    planning: Arc<Latest<(String, Vec<PlanItem>)>>,
    planned_for: String,
    /// What of a renderer can be changed, and of which.
    listed: Option<(String, Turned, Arc<[Knob]>)>,
    /// Where the next picture is to be saved.
    shot: Option<PathBuf>,
    clipping: Option<PathBuf>,
    clipped: Arc<Latest<Result<String, String>>>,
}

impl Player {
    /// With nothing open.
    ///
    /// # Errors
    /// A message if no thread can be started.
    pub fn new(choices: Choices, recent: Recent, wake: Wake) -> Result<Self, String> {
        Self::with_renderers(choices, recent, wake, renderers::make, None)
    }

    /// As [`Self::new`], with renderers from elsewhere, and with the device of the window where pictures are to stay on it.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_renderers(
        choices: Choices,
        recent: Recent,
        wake: Wake,
        make: Make,
        shared: Option<Arc<Gpu>>,
    ) -> Result<Self, String> {
        let mut messages = Messages::default();
        let renderer = choices.first().to_owned();
        if !choices.is_gpu(&renderer) {
            messages.warn(format!(
                "no graphics adapter was found: `{renderer}` draws on the processor, at reduced size while things move. \
                 Install a Vulkan driver for more (`meniscus renderers` tells what is found)"
            ));
        }
        Ok(Self {
            session: None,
            messages,
            compare: Compare {
                on: false,
                mode: Mode::Split,
                renderer: choices.fallback().to_owned(),
                other: false,
                divider: 0.5,
                rate: 2.0,
            },
            renderer,
            turned: HashMap::new(),
            choices,
            quality: Quality::Auto,
            recent,
            drawn: None,
            clip: Clip::default(),
            shot: None,
            clipping: None,
            clipped: Arc::default(),
            overrides: Vec::new(),
            drawing: Drawing::new(make, shared, Arc::clone(&wake))?,
            pace: Pace::default(),
            wake,
            opening: Arc::default(),
            busy: None,
            ordered: None,
            number: 0,
            oldest: 0,
            waits: false,
            last: None,
            changed: 0.0,
            rested: false,
            sessions: 0,
            now: 0.0,
            planned: None,
            planning: Arc::default(),
            planned_for: String::new(),
            listed: None,
        })
    }

    /// Opens a scene or recording, on a thread of its own; what is open stays until then.
    pub fn open(&mut self, path: &Path, overrides: Vec<String>) {
        self.read(path, overrides, false);
    }

    /// Opens a second recording to compare with.
    pub fn open_other(&mut self, path: &Path) {
        self.read(path, Vec::new(), true);
    }

    fn read(&mut self, path: &Path, overrides: Vec<String>, other: bool) {
        self.busy = Some(path.to_owned());
        let (path, wake) = (path.to_owned(), Arc::clone(&self.wake));
        let opening = Arc::clone(&self.opening);
        let read = move || {
            let console = Console::new(Verbosity::Quiet);
            let input = Input::open(&path, &overrides, &console).map_err(|failure| failure.to_string());
            drop(opening.put((path, overrides, other, input)));
            wake();
        };
        let started = std::thread::Builder::new()
            .name("meniscus-open".to_owned())
            .spawn(read);
        if let Err(error) = started {
            self.busy = None;
            self.messages
                .error(format!("cannot start a thread that reads: {error}"));
        }
    }

    /// Which session is open, counted from the first.
    pub fn session_number(&self) -> u64 {
        self.sessions
    }

    /// The file that is being read.
    pub fn opening(&self) -> Option<&Path> {
        self.busy.as_deref()
    }

    fn opened(&mut self) {
        let Some((path, overrides, other, input)) = self.opening.take() else {
            return;
        };
        self.busy = None;
        let outcome = match (input, other) {
            (Err(error), _) => Err(error),
            (Ok(input), false) => self.begin(&path, overrides, input),
            (Ok(Input::Recording(reader)), true) => {
                Replay::new(*reader, Arc::clone(&self.wake)).map(|replay| {
                    if let Some(session) = &mut self.session {
                        session.other = Some(replay);
                        self.compare.other = true;
                        self.compare.on = true;
                    }
                })
            }
            (Ok(Input::Scene(_)), true) => Err(format!(
                "{}: only recordings can be compared with; record the scene first",
                path.display()
            )),
        };
        if let Err(error) = outcome {
            for line in error.lines() {
                self.messages.error(line);
            }
        }
    }

    /// Shows what was opened.
    ///
    /// # Errors
    /// A message that says what is wrong and what to do; what was shown before stays.
    pub(crate) fn begin(&mut self, path: &Path, overrides: Vec<String>, input: Input) -> Result<(), String> {
        let damage = match &input {
            Input::Recording(reader) => reader.damage().len(),
            Input::Scene(_) => 0,
        };
        let session = Session::new(path, input, Arc::clone(&self.wake))?;
        if damage > 0 {
            self.messages.warn(format!(
                "{}: {damage} places are damaged; what lies there is left out (`meniscus info` names them)",
                path.display()
            ));
        }
        self.session = Some(session);
        self.sessions += 1;
        self.oldest = self.number + 1;
        self.waits = true;
        self.overrides = overrides;
        self.compare.other = false;
        self.clip.first = 0;
        self.clip.last = self
            .session
            .as_ref()
            .and_then(Session::replay)
            .map_or(0, |replay| replay.times().len() as u64 - 1);
        self.recent.add(path);
        // A picture of what was open before says nothing about this.
        self.drawn = None;
        Ok(())
    }

    /// Lets time pass up to `now` (seconds of any clock), takes what the threads have made, and asks for what is to be
    /// drawn into `pixels`.
    pub fn update(&mut self, now: f64, pixels: UVec2) {
        let seconds = (now - self.now).max(0.0);
        self.now = now;
        self.messages.expire(now);
        self.opened();
        if let Some(session) = &mut self.session {
            let held = self.waits && !session.lacks_frame();
            let seconds = if held { 0.0 } else { seconds };
            session.update(seconds, held, &mut self.messages);
        }
        self.take_drawn();
        if let Some(clipped) = self.clipped.take() {
            self.clipping = None;
            match clipped {
                Ok(text) => self.messages.note(text),
                Err(text) => self.messages.error(text),
            }
        }
        self.ask(pixels);
    }

    /// Seconds until the next update is due though nobody touches anything; `None` if what is shown stays as it is.
    pub fn due(&self) -> Option<f64> {
        let session = self.session.as_ref()?;
        let plays = session.clock.playing && session.replay().is_some() && !self.waits;
        let replayed = plays.then(|| {
            let frame = 1.0 / (session.scene.description.recording.rate * session.clock.speed());
            (0.5 * frame).clamp(1.0 / 120.0, 0.1)
        });
        let flicker = (self.compare.on && self.compare.mode == Mode::Flicker).then_some(1.0 / 30.0);
        let rest = (!self.rested && self.ordered.is_none())
            .then(|| (REST - (self.now - self.changed)).clamp(1.0 / 120.0, REST));
        replayed.into_iter().chain(flicker).chain(rest).reduce(f64::min)
    }

    /// Whether time stands until the first picture of what is open is there: making shaders may take longer than a recording.
    pub fn waits(&self) -> bool {
        self.waits
    }

    /// Whether a picture is on its way, or will be without anybody touching anything.
    pub fn moves(&self) -> bool {
        self.ordered.is_some_and(|(_, at_rest)| !at_rest) || self.due().is_some()
    }

    fn take_drawn(&mut self) {
        let Some(outcome) = self.drawing.take() else {
            return;
        };
        match outcome {
            Ok(drawn) => {
                if self
                    .ordered
                    .is_some_and(|(number, at_rest)| number == drawn.number && !at_rest)
                {
                    self.ordered = None;
                    let right = drawn.right.as_ref().map_or(0.0, |right| right.seconds);
                    self.pace.took(drawn.left.seconds + right);
                }
                // Of what is open; of what was open before nothing is plotted.
                if let Some(session) = self.session.as_mut().filter(|_| drawn.number >= self.oldest) {
                    let left = &drawn.left;
                    session
                        .history
                        .drawn(left.frame, left.seconds, left.stages.clone());
                }
                self.waits &= drawn.number < self.oldest;
                let here = drawn.is_here();
                self.drawn = Some(Arc::new(drawn));
                if let Some(path) = self.shot.take_if(|_| here) {
                    self.save(&path);
                }
            }
            Err(undrawn) => {
                self.ordered = None;
                self.messages.error(undrawn.message);
                let fallback = self.choices.fallback();
                if self.compare.on
                    && undrawn.renderer == self.compare.renderer
                    && undrawn.renderer != self.renderer
                {
                    self.compare.on = false;
                } else if undrawn.renderer == self.renderer && self.renderer != fallback {
                    self.messages.warn(format!(
                        "`{fallback}` draws instead, on the processor, at reduced size while things move"
                    ));
                    self.renderer = fallback.to_owned();
                } else {
                    self.waits = false;
                }
            }
        }
    }

    /// What the pointer does to the water.
    pub fn touch(&mut self, pointer: &Pointer) {
        let Some(session) = &mut self.session else {
            return;
        };
        let Some(moment) = session.moment.clone() else {
            return;
        };
        if let super::session::Source::Live(live) = &session.source {
            for action in session.touch.act(&session.scene, &moment.frame, pointer) {
                live.tell(Command::Act(action));
            }
        }
    }

    /// What of the renderer can be changed, as it says itself.
    pub fn knobs(&mut self) -> Arc<[Knob]> {
        let none = Turned::new();
        let turned = self.turned.get(&self.renderer).unwrap_or(&none);
        match &self.listed {
            Some((of, when, knobs)) if *of == self.renderer && when == turned => Arc::clone(knobs),
            _ => {
                let knobs: Arc<[Knob]> = renderers::knobs(&self.renderer, turned).into();
                self.listed = Some((self.renderer.clone(), turned.clone(), Arc::clone(&knobs)));
                knobs
            }
        }
    }

    /// What the renderer runs and holds for this scene and what it leaves out, once that is known: it is found out by a
    /// thread of its own when this is called first.
    pub fn plan(&mut self) -> Option<&[PlanItem]> {
        let session = self.session.as_ref()?;
        let size = self
            .last
            .as_ref()
            .map_or(UVec2::new(1280, 720), |inputs| inputs.pixels);
        let subject = format!("{} {} {size}", self.sessions, self.named(&self.renderer));
        if self.planned_for != subject {
            self.planned_for.clone_from(&subject);
            let (scene, name) = (Arc::clone(&session.scene), self.renderer.clone());
            let turned = self.turned.get(&name).cloned().unwrap_or_default();
            let (planning, wake) = (Arc::clone(&self.planning), Arc::clone(&self.wake));
            let find = move || {
                let plan = |mut renderer: Box<dyn Renderer>| {
                    renderer.turn(&turned);
                    renderer.plan(&scene, size)
                };
                let items = renderers::build(&name).map_or_else(|_| Vec::new(), plan);
                drop(planning.put((subject, items)));
                wake();
            };
            let started = std::thread::Builder::new()
                .name("meniscus-plan".to_owned())
                .spawn(find);
            if let Err(error) = started {
                self.messages
                    .error(format!("cannot start a thread that plans: {error}"));
            }
        }
        if let Some(found) = self.planning.take() {
            self.planned = Some(found);
        }
        let (subject, items) = self.planned.as_ref()?;
        (*subject == self.planned_for).then_some(items)
    }
}
