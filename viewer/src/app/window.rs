//! The window itself.

use super::model::Wake;
use super::model::player::Player;
use super::model::recent::Recent;
use super::model::renderers::{self, Choices};
use super::timing::{Timing, thread_seconds};
use super::viewer::Viewer;
use crate::cli::Interrupt;
use crate::cli::input::Input;
use eframe::egui;
use eframe::egui_wgpu::{RenderState, WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew};
use meniscus_render_gpu::device::Gpu;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// What is known when the window has closed.
#[derive(Clone, Debug, Default)]
pub struct Closed {
    /// How long each update of the panels took.
    pub panels: Timing,
    /// How long the thread of the window was busy in all, an update: with laying out text and handing triangles to the
    /// adapter.
    pub busy: Timing,
    /// What an update takes of a processor on that thread, whatever else the machine does: with events, painting and handing
    /// the picture to the display; and the panels' share of it.
    pub processor: [Timing; 2],
}

struct Window {
    viewer: Viewer,
    busy: Timing,
    processor: [Timing; 2],
    /// What the thread had taken of a processor when the update before began.
    taken: Option<f64>,
    closed: Arc<Mutex<Closed>>,
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        // Of the update before this one.
        if let Some(seconds) = frame.info().cpu_usage {
            self.busy.add(f64::from(seconds));
        }
        let began = thread_seconds();
        if let (Some(began), Some(before)) = (began, self.taken) {
            self.processor[0].add(began - before);
        }
        self.taken = began;
        self.viewer.ui(ui);
        if let (Some(ended), Some(began)) = (thread_seconds(), began) {
            self.processor[1].add(ended - began);
        }
    }

    fn on_exit(&mut self) {
        let closed = Closed {
            panels: self.viewer.timing.clone(),
            busy: self.busy.clone(),
            processor: self.processor.clone(),
        };
        *self.closed.lock().unwrap_or_else(PoisonError::into_inner) = closed;
    }
}

/// How often Ctrl-C is looked for.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// Closes the window in good order when Ctrl-C is pressed.
fn close_on(interrupt: Interrupt, ctx: egui::Context) -> std::io::Result<()> {
    let watch = move || {
        while !interrupt.pressed() {
            std::thread::sleep(LOOK_EVERY);
        }
        ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        ctx.request_repaint();
    };
    let started = std::thread::Builder::new()
        .name("meniscus-interrupt".to_owned())
        .spawn(watch);
    started.map(drop)
}

/// Shares the window's device also where it is software; for measuring what that does.
const SHARE_VARIABLE: &str = "MENISCUS_VIEW_SHARE";

/// The device of the window, where renderers should share it: a picture then never leaves it. Software adapters draw in one
/// queue what the window and the renderers ask for, so that a window would wait for the water; there renderers have a
/// device of their own.
fn shared(state: Option<&RenderState>) -> Option<Arc<Gpu>> {
    let state = state?;
    let info = state.adapter.get_info();
    let software = info.device_type == eframe::wgpu::DeviceType::Cpu;
    let share = !software || std::env::var_os(SHARE_VARIABLE).is_some();
    share.then(|| Arc::new(Gpu::shared(state.device.clone(), state.queue.clone(), &info)))
}

/// What the window asks of wgpu: a device that renderers can use too, on the adapter that they would choose.
fn setup() -> WgpuSetup {
    let mut create = WgpuSetupCreateNew::without_display_handle();
    create.device_descriptor = Arc::new(Gpu::needs);
    WgpuSetup::CreateNew(create)
}

/// What to do where no window can be opened.
const REMEDY: &str = "it needs a display (on Linux: X11 or XWayland, environment variable DISPLAY) and a Vulkan, Metal or Direct3D 12 \
                      driver. `meniscus render` draws without a window, and `meniscus export` writes frames for ParaView and Blender";

/// Whether there is a display to open a window on, as far as the environment says: what the system says without one is not for users.
fn has_display() -> bool {
    let set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !cfg!(target_os = "linux")
        || ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"]
            .into_iter()
            .any(set)
}

/// What the window opens with: a file, the changes to its scene's keys, and what was read of it.
pub(crate) type Given<'a> = (&'a Path, &'a [String], Input);

/// Opens the window, with nothing in it if nothing is `given`, and returns when it is closed and everything that was
/// recorded is on the disk.
///
/// # Errors
/// A message if there is no display, or nothing that can draw a window.
pub(crate) fn run(given: Option<Given<'_>>, interrupt: Interrupt) -> Result<Closed, String> {
    if !has_display() {
        return Err(format!("no window can be opened: no display is set; {REMEDY}"));
    }
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("Meniscus")
            .with_app_id("meniscus")
            .with_inner_size([1280.0, 800.0])
            .with_min_inner_size([640.0, 420.0])
            .with_drag_and_drop(true),
        wgpu_options: WgpuConfiguration {
            wgpu_setup: setup(),
            ..Default::default()
        },
        ..Default::default()
    };
    let closed = Arc::new(Mutex::new(Closed::default()));
    let theirs = Arc::clone(&closed);
    let given = given.map(|(path, overrides, input)| (path.to_owned(), overrides.to_vec(), input));
    let outcome = eframe::run_native(
        "meniscus",
        options,
        Box::new(move |creation| {
            let ctx = creation.egui_ctx.clone();
            let wake: Wake = Arc::new(move || ctx.request_repaint());
            close_on(interrupt, creation.egui_ctx.clone())?;
            let state = creation.wgpu_render_state.clone();
            let shared = shared(state.as_ref());
            let shares = shared.is_some();
            let choices = Choices::of_machine();
            let mut player =
                Player::with_renderers(choices, Recent::of_user(), wake, renderers::make, shared)?;
            if let Some((path, overrides, input)) = given
                && let Err(error) = player.begin(&path, overrides, input)
            {
                player.messages.error(error);
            }
            let folder = std::env::current_dir().unwrap_or_default();
            let mut viewer = Viewer::new(player, folder);
            if let Some(state) = state.filter(|_| shares) {
                viewer = viewer.sharing(state);
            }
            Ok(Box::new(Window {
                viewer,
                busy: Timing::default(),
                processor: Default::default(),
                taken: None,
                closed: theirs,
            }))
        }),
    );
    let closed = closed.lock().unwrap_or_else(PoisonError::into_inner).clone();
    outcome
        .map(|()| closed)
        .map_err(|error| format!("no window can be opened: {error}; {REMEDY}"))
}
