//! The viewer as egui sees it: panels around a picture, and the keyboard.

use super::model::player::{Mode, Player, recording_name};
use super::model::session::RecordingState;
use super::model::touch::Tool;
use super::panels::{self, Textures};
use super::style;
use super::timing::Timing;
use eframe::egui::{self, Key, Modifiers, Theme, ViewportCommand};
use meniscus_sim::glam::UVec2;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// What is open around the picture.
#[derive(Clone, Debug)]
pub struct Layout {
    /// The panel at the side.
    pub side: bool,
    /// The plots.
    pub plots: bool,
    /// The list of keys.
    pub help: bool,
    /// The panel that opens files.
    pub open: bool,
    /// Which plots are shown.
    pub plotted: Vec<bool>,
    /// What is typed as the file to open.
    pub path: String,
    /// What is typed as changes to the scene.
    pub overrides: String,
    /// Whether the picture that is named next is the one to compare with.
    pub second: bool,
}

impl Default for Layout {
    fn default() -> Self {
        let shown = ["Volume", "Energy", "Time of a frame"];
        let titles = super::model::history::TITLES.iter();
        Self {
            side: true,
            plots: false,
            help: false,
            open: false,
            plotted: titles.map(|title| shown.contains(title)).collect(),
            path: String::new(),
            overrides: String::new(),
            second: false,
        }
    }
}

/// See the module.
pub struct Viewer {
    /// What is shown and done.
    pub player: Player,
    /// What is open around the picture.
    pub layout: Layout,
    /// Where pictures, recordings and tables are written.
    pub folder: PathBuf,
    /// How long each update took on this thread.
    pub timing: Timing,
    textures: Textures,
    curves: panels::plots::Curves,
    start: Instant,
    /// Pixels of the picture's place.
    pixels: UVec2,
    title: String,
    styled: bool,
    fixed_now: Option<f64>,
}

impl Viewer {
    /// Shows a player.
    pub fn new(player: Player, folder: PathBuf) -> Self {
        Self {
            player,
            layout: Layout::default(),
            folder,
            timing: Timing::default(),
            textures: Textures::sharing(None),
            curves: panels::plots::Curves::default(),
            start: Instant::now(),
            pixels: UVec2::ZERO,
            title: String::new(),
            styled: false,
            fixed_now: None,
        }
    }

    /// Shows pictures that stay on the device of the window.
    #[must_use]
    pub fn sharing(mut self, state: eframe::egui_wgpu::RenderState) -> Self {
        self.textures = Textures::sharing(Some(state));
        self
    }

    /// Takes `now` (seconds) for the time instead of the clock's, for pictures that must be the same every time.
    pub fn set_now(&mut self, now: f64) {
        self.fixed_now = Some(now);
    }

    /// Everything, once.
    pub fn ui(&mut self, ui: &mut egui::Ui) {
        let begun = Instant::now();
        let ctx = ui.ctx().clone();
        if !std::mem::replace(&mut self.styled, true) {
            style::apply(&ctx);
        }
        let now = self
            .fixed_now
            .unwrap_or_else(|| self.start.elapsed().as_secs_f64());
        self.dropped(&ctx);
        self.keys(&ctx);
        self.player.update(now, self.pixels);
        self.textures.update(&ctx, self.player.drawn.as_ref());

        let bar = egui::Panel::top("bar").show_separator_line(false);
        bar.show(ui, |ui| {
            panels::bar::show(ui, &mut self.player, &mut self.layout, &self.folder)
        });
        if self.player.session.is_some() {
            let transport = egui::Panel::bottom("transport").show_separator_line(false);
            transport.show(ui, |ui| {
                panels::transport::show(ui, &mut self.player, &self.folder)
            });
            if self.layout.plots {
                egui::Panel::bottom("plots")
                    .resizable(true)
                    .default_size(230.0)
                    .size_range(140.0..=700.0)
                    .show(ui, |ui| {
                        let (player, layout) = (&mut self.player, &mut self.layout);
                        panels::plots::show(ui, player, layout, &mut self.curves, &self.folder);
                        // A panel that can be resized is as large as what it holds: it would shrink to that.
                        ui.take_available_space();
                    });
            }
            if self.layout.side {
                egui::Panel::right("side")
                    .resizable(true)
                    .default_size(300.0)
                    .size_range(250.0..=520.0)
                    .show(ui, |ui| {
                        panels::side::show(ui, &mut self.player, &mut self.layout, &self.timing, &self.folder)
                    });
            }
        }
        egui::CentralPanel::default()
            .frame(egui::Frame::NONE.fill(style::BACKDROP))
            .show(ui, |ui| {
                if self.player.session.is_some() {
                    self.pixels = panels::picture::show(ui, &mut self.player, &self.textures, now);
                } else {
                    panels::open::welcome(ui, &mut self.player, &mut self.layout);
                }
                panels::notices::show(ui, &mut self.player);
            });
        if self.layout.open {
            panels::open::window(&ctx, &mut self.player, &mut self.layout);
        }
        if self.layout.help {
            panels::help::show(&ctx, &mut self.layout.help);
        }
        self.name(&ctx);
        if let Some(seconds) = self.player.due().filter(|_| self.fixed_now.is_none()) {
            ctx.request_repaint_after(Duration::from_secs_f64(seconds));
        }
        self.timing.add(begun.elapsed().as_secs_f64());
    }

    /// Pixels of the picture's place.
    pub fn pixels(&self) -> UVec2 {
        self.pixels
    }

    /// The window's title says what is open.
    fn name(&mut self, ctx: &egui::Context) {
        let title = match &self.player.session {
            Some(session) => format!("{} - Meniscus", session.scene.description.name),
            None => "Meniscus".to_owned(),
        };
        if title != self.title {
            ctx.send_viewport_cmd(ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }

    /// Files that were dropped onto the window.
    fn dropped(&mut self, ctx: &egui::Context) {
        let files = ctx.input(|input| input.raw.dropped_files.clone());
        if let Some(file) = files.first() {
            self.player.open(file.path(), Vec::new());
        }
    }

    fn keys(&mut self, ctx: &egui::Context) {
        // Whoever types means letters; whoever holds the right button flies.
        if ctx.egui_wants_keyboard_input() || ctx.input(|input| input.pointer.secondary_down()) {
            return;
        }
        let pressed = |key| ctx.input_mut(|input| input.consume_key(Modifiers::NONE, key));
        let shifted = |key| ctx.input_mut(|input| input.consume_key(Modifiers::SHIFT, key));
        if pressed(Key::F) {
            let full = ctx.input(|input| input.viewport().fullscreen.unwrap_or(false));
            ctx.send_viewport_cmd(ViewportCommand::Fullscreen(!full));
        }
        for (key, open) in [
            (Key::O, &mut self.layout.open),
            (Key::H, &mut self.layout.side),
            (Key::P, &mut self.layout.plots),
            (Key::F1, &mut self.layout.help),
        ] {
            if pressed(key) {
                *open = !*open;
            }
        }
        if ctx.input_mut(|input| input.consume_key(Modifiers::COMMAND, Key::Q)) {
            ctx.send_viewport_cmd(ViewportCommand::Close);
        }
        if pressed(Key::T) {
            let dark = ctx.theme() == Theme::Dark;
            ctx.set_theme(if dark { Theme::Light } else { Theme::Dark });
        }
        if pressed(Key::S) {
            self.player.screenshot(&self.folder);
        }
        if pressed(Key::C) {
            self.player.compare.on = !self.player.compare.on;
        }
        if pressed(Key::M) {
            let at = Mode::ALL
                .iter()
                .position(|(mode, ..)| *mode == self.player.compare.mode);
            self.player.compare.mode = Mode::ALL[(at.unwrap_or(0) + 1) % Mode::ALL.len()].0;
        }
        if pressed(Key::R)
            && let Some(session) = &mut self.player.session
        {
            let off = session.recording == RecordingState::Off;
            session.record(off.then(|| recording_name(session, &self.folder)));
        }
        let Some(session) = &mut self.player.session else {
            return;
        };
        for (back, key, seconds) in [(true, Key::ArrowLeft, -1.0), (false, Key::ArrowRight, 1.0)] {
            if shifted(key) && session.replay().is_some() {
                session.clock.seek(session.clock.time + seconds);
            } else if pressed(key) {
                session.step(back);
            }
        }
        if pressed(Key::Space) {
            session.toggle();
        }
        if pressed(Key::K) {
            session.clock.playing = false;
        }
        let replayed = session.replay().is_some();
        if shifted(Key::L) && replayed {
            session.clock.looping = !session.clock.looping;
        }
        if pressed(Key::L) && session.failed.is_none() {
            session.clock.shuttle(false);
        }
        if pressed(Key::J) && replayed {
            session.clock.shuttle(true);
        }
        for (key, steps) in [(Key::ArrowUp, 1), (Key::ArrowDown, -1)] {
            if pressed(key) {
                session.clock.faster(steps);
            }
        }
        if pressed(Key::Home) || pressed(Key::Backspace) {
            session.rewind();
        }
        if pressed(Key::End) && replayed {
            session.clock.seek(session.clock.range.1);
        }
        if pressed(Key::Escape) {
            session.touch.tool = Tool::Look;
            self.layout.help = false;
            self.layout.open = false;
        }
        let digits = [
            Key::Num1,
            Key::Num2,
            Key::Num3,
            Key::Num4,
            Key::Num5,
            Key::Num6,
            Key::Num7,
            Key::Num8,
            Key::Num9,
        ];
        for (k, key) in digits.into_iter().enumerate() {
            if pressed(key)
                && let Some(mark) = session.bookmarks.get(k)
            {
                (session.camera, session.exposure) = (mark.camera, mark.exposure);
            }
        }
    }
}
