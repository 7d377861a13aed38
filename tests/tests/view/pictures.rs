//! Pictures of the window in each of its states, drawn without a display and compared with those that were looked at.
//!
//! A picture is compared at a third of its size, so that neither a digit of a time nor another driver's way to smooth
//! edges counts. `MENISCUS_UPDATE=FOLDER` writes the pictures anew, and whole ones to look at into that folder.

use crate::canvas::Canvas;
use crate::support::{BASIN, Folder, TRAY, player, wait};
use eframe::egui::{self, Theme, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use image::RgbImage;
use image::codecs::png;
use meniscus::app::model::history::TITLES;
use meniscus::app::model::player::{Mode, Player};
use meniscus::app::model::quality::Quality;
use meniscus::app::viewer::Viewer;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// Pixels of a whole picture along a pixel of the one that is kept.
const SHRINK: u32 = 3;

/// The same for a picture of a large screen.
const SHRINK_LARGE: u32 = 8;

/// Largest mean difference from the kept picture, of 255, and the one that 97 % of the values do not pass. What is not the
/// same every time is a few digits and the bars of the times.
const MEAN: f64 = 2.0;
const MOST: u8 = 24;

type Window = Harness<'static, Viewer>;

fn window(player: Player, folder: &Folder, size: [f32; 2], theme: Theme) -> Window {
    scaled(player, folder, size, theme, 1.0)
}

/// With `scale` pixels a point.
fn scaled(player: Player, folder: &Folder, size: [f32; 2], theme: Theme, scale: f32) -> Window {
    let mut viewer = Viewer::new(player, folder.path(""));
    viewer.set_now(0.0);
    Harness::builder()
        .with_size(Vec2::from(size))
        .with_pixels_per_point(scale)
        .with_theme(theme)
        .with_render_cursor(false)
        .renderer(Canvas::new())
        .build_ui_state(|ui, viewer: &mut Viewer| viewer.ui(ui), viewer)
}

/// Steps the window through time until `done`.
fn until(window: &mut Window, what: &str, mut done: impl FnMut(&Viewer) -> bool) {
    let mut now = 0.0;
    wait(what, || {
        now += 0.1;
        window.state_mut().set_now(now);
        window.step();
        std::thread::sleep(Duration::from_millis(3));
        done(window.state()).then_some(())
    });
    // What was laid out for the first time finds its place.
    for _ in 0..4 {
        window.step();
    }
}

/// A window with a file open that stands still, drawn by the processor at rest.
fn opened(path: &Path, folder: &Folder, size: [f32; 2], theme: Theme) -> Window {
    settled(window(opening(path), folder, size, theme))
}

/// A player that opens a file.
fn opening(path: &Path) -> Player {
    let mut player = player();
    player.messages.clear();
    player.open(path, Vec::new());
    player
}

/// Waits until the file is open, stands still, and is drawn.
fn settled(mut window: Window) -> Window {
    until(&mut window, "the first frame", |viewer| {
        viewer.player.session.as_ref().is_some_and(|s| s.moment.is_some())
    });
    let session = window.state_mut().player.session.as_mut().unwrap();
    session.clock.playing = false;
    session.clock.seek(0.5);
    rest(&mut window);
    window
}

/// Waits for the picture of what is set now, at rest.
fn rest(window: &mut Window) {
    let before = window.state().player.drawn.as_ref().map_or(0, |d| d.number);
    until(window, "a picture at rest", |viewer| {
        let player = &viewer.player;
        !player.moves()
            && player
                .drawn
                .as_ref()
                .is_some_and(|d| d.at_rest && d.number > before)
    });
}

/// What differs from run to run is folded away.
fn fold_times(window: &mut Window) {
    window.get_by_label("Time").click();
    for _ in 0..6 {
        window.step();
    }
}

fn kept(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("snapshots/view")
        .join(format!("{name}.png"))
}

/// The mean of each square of `by` pixels.
fn shrunk(whole: &image::RgbaImage, by: u32) -> RgbImage {
    let (w, h) = (whole.width() / by, whole.height() / by);
    RgbImage::from_fn(w, h, |x, y| {
        let mut sum = [0_u32; 3];
        for dy in 0..by {
            for dx in 0..by {
                let pixel = whole.get_pixel(by * x + dx, by * y + dy);
                for c in 0..3 {
                    sum[c] += u32::from(pixel[c]);
                }
            }
        }
        // Four bits a colour: what is kept is small, and what moved shows all the same.
        image::Rgb(sum.map(|s| ((s / (by * by)) as u8) & 0xf0))
    })
}

fn check(window: &mut Window, name: &str) {
    compare(window, name, SHRINK);
}

/// Compares the window with the kept picture, whose pixels are the means of `by` × `by`.
fn compare(window: &mut Window, name: &str, by: u32) {
    let whole = window.render().unwrap();
    let now = shrunk(&whole, by);
    let path = kept(name);
    if let Some(folder) = std::env::var_os("MENISCUS_UPDATE") {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        let file = std::fs::File::create(&path).unwrap();
        let (best, filter) = (png::CompressionType::Best, png::FilterType::NoFilter);
        now.write_with_encoder(png::PngEncoder::new_with_quality(file, best, filter))
            .unwrap();
        whole
            .save(PathBuf::from(folder).join(format!("{name}.png")))
            .unwrap();
        return;
    }
    let before = image::open(&path).unwrap().to_rgb8();
    assert_eq!(before.dimensions(), now.dimensions(), "{name}");
    let mut off: Vec<u8> = before
        .as_raw()
        .iter()
        .zip(now.as_raw())
        .map(|(a, b)| a.abs_diff(*b))
        .collect();
    off.sort_unstable();
    let mean = off.iter().map(|v| f64::from(*v)).sum::<f64>() / off.len() as f64;
    let most = off[off.len() * 97 / 100];
    assert!(
        mean <= MEAN && most <= MOST,
        "{name}: mean difference {mean:.2}, 97 % below {most}"
    );
    let bytes = std::fs::metadata(&path).unwrap().len();
    assert!(bytes <= 16 * 1024, "{name} takes {bytes} bytes");
}

#[test]
fn nothing_is_open() {
    let folder = Folder::new();
    folder.record("run.mrec", TRAY);
    folder.write("tray.toml", TRAY);
    let mut player = player();
    player.messages.clear();
    let mut window = window(player, &folder, [900.0, 600.0], Theme::Dark);
    // The listing shows the current folder; a missing one shows the same everywhere.
    window.state_mut().layout.path = "typed.mrec".into();
    window.step();
    window.get_by_label_contains("Drop a recording");
    // Type a folder, and what it holds can be opened.
    window.state_mut().layout.path = folder.path("").display().to_string();
    for _ in 0..12 {
        window.step();
    }
    window.get_by_label("tray.toml");
    window.get_by_label("run.mrec").click();
    until(&mut window, "the recording", |v| v.player.session.is_some());
}

#[test]
fn a_recording_stands_still() {
    let folder = Folder::new();
    let path = folder.record("run.mrec", TRAY);
    let mut window = opened(&path, &folder, [1280.0, 800.0], Theme::Dark);
    window.get_by_label_contains("recording, 21 frames");
    fold_times(&mut window);
    check(&mut window, "replay");
    // The keyboard drives it: forwards by two frames, back by one, then the second camera.
    for key in [
        egui::Key::ArrowRight,
        egui::Key::ArrowRight,
        egui::Key::ArrowLeft,
        egui::Key::Num2,
    ] {
        window.key_press(key);
        window.step();
    }
    until(&mut window, "frame 11", |v| {
        v.player
            .session
            .as_ref()
            .is_some_and(|s| s.moment.as_ref().is_some_and(|m| m.frame.index == 11))
    });
    let session = window.state().player.session.as_ref().unwrap();
    assert_eq!(session.camera, session.bookmarks[1].camera);
    window.key_press(egui::Key::Space);
    window.step();
    assert!(window.state().player.session.as_ref().unwrap().clock.playing);
}

#[test]
fn a_live_run_in_light_colours_with_plots_and_a_message() {
    let folder = Folder::new();
    let scene = folder.write("tray.toml", TRAY);
    let mut window = opened(&scene, &folder, [1280.0, 800.0], Theme::Light);
    window.state_mut().layout.plots = true;
    for k in 1..=12 {
        window.state_mut().player.session.as_mut().unwrap().step(false);
        until(&mut window, "a frame", |v| {
            v.player
                .session
                .as_ref()
                .is_some_and(|s| s.clock.time >= f64::from(k) / 20.0 - 1e-9)
        });
    }
    rest(&mut window);
    // Times are not the same every time.
    window.state_mut().layout.plotted = (0..TITLES.len()).map(|k| k < 3).collect();
    window
        .state_mut()
        .player
        .messages
        .warn("a message says what happened and what to do; it stays until it is put away");
    fold_times(&mut window);
    window.get_by_label_contains("live, wave-equation");
    window.get_by_label_contains("Record");
    check(&mut window, "live");
}

#[test]
fn two_renderers_side_by_side_and_their_difference() {
    let folder = Folder::new();
    let path = folder.record("run.mrec", BASIN);
    let mut window = opened(&path, &folder, [1280.0, 800.0], Theme::Dark);
    // A second recording, so that both pictures are the same every time.
    let other = folder.record("finer.mrec", &BASIN.replace("spacing = 0.2", "spacing = 0.1"));
    window.state_mut().player.open_other(&other);
    until(&mut window, "the other", |v| {
        v.player.session.as_ref().is_some_and(|s| s.other.is_some())
    });
    rest(&mut window);
    fold_times(&mut window);
    check(&mut window, "split");
    window.key_press(egui::Key::M);
    window.key_press(egui::Key::M);
    for _ in 0..3 {
        window.step();
    }
    assert_eq!(window.state().player.compare.mode, Mode::Difference);
    check(&mut window, "difference");
}

/// On a large screen the picture has the room, whether letters are as small as the screen can or twice that.
#[test]
fn at_3840_by_2160_the_picture_has_the_room() {
    let folder = Folder::new();
    let path = folder.record("run.mrec", TRAY);
    for (scale, theme) in [(1.0, Theme::Light), (2.0, Theme::Dark)] {
        let mut player = opening(&path);
        player.quality = Quality::Quarter;
        let points = Vec2::new(3840.0, 2160.0) / scale;
        let mut window = settled(scaled(player, &folder, points.into(), theme, scale));
        // Every pixel of its place is the picture's to draw, and the rest is panels of the usual size in points, and the
        // 16 that the harness leaves around them.
        let pixels = window.state().pixels();
        let panels = points - Vec2::new(pixels.x as f32, pixels.y as f32) / scale;
        assert!(
            (250.0..340.0).contains(&panels.x) && (90.0..130.0).contains(&panels.y),
            "{panels:?}"
        );
        let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, points);
        for label in [
            "Renderer",
            "Exposure",
            "Field of view",
            "Speed",
            "Compare",
            "Plots",
            "Open",
        ] {
            let place = window.query_all_by_label(label).next().unwrap().rect();
            assert!(
                screen.contains_rect(place) && place.height() < 40.0,
                "{label} at {place:?}"
            );
        }
        window.state_mut().layout.plots = true;
        for _ in 0..4 {
            window.step();
        }
        let plotted = window.state().pixels();
        assert!(
            plotted.y < pixels.y && f64::from(plotted.y) > 0.7 * f64::from(pixels.y),
            "{plotted}"
        );
        // The panel of the plots keeps its size.
        for _ in 0..30 {
            window.step();
        }
        assert_eq!(window.state().pixels(), plotted);
        if scale > 1.0 {
            window.state_mut().layout.plots = false;
            rest(&mut window);
            fold_times(&mut window);
            compare(&mut window, "large", SHRINK_LARGE);
        }
    }
}

/// A file that the hand of a test drops.
#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|error| error.to_string())
    }
}

#[test]
fn what_is_dropped_onto_the_window_is_opened_and_plays() {
    let folder = Folder::new();
    let path = folder.record("run.mrec", TRAY);
    let mut player = player();
    player.messages.clear();
    let mut window = window(player, &folder, [640.0, 420.0], Theme::Dark);
    window.step();
    let dropped = Arc::new(Dropped(path.clone()));
    window.input_mut().dropped_files.push(dropped);
    until(&mut window, "the recording", |v| v.player.session.is_some());
    let session = window.state().player.session.as_ref().unwrap();
    assert!(session.path == path && session.clock.playing);
    until(&mut window, "the end", |v| {
        v.player
            .session
            .as_ref()
            .is_some_and(|s| s.clock.time >= 1.0 && !s.clock.playing)
    });
}

#[test]
fn the_list_of_keys_and_a_small_window() {
    let folder = Folder::new();
    let path = folder.record("run.mrec", TRAY);
    let mut window = opened(&path, &folder, [640.0, 420.0], Theme::Dark);
    fold_times(&mut window);
    check(&mut window, "small");
    window.set_size(Vec2::new(900.0, 700.0));
    window.key_press(egui::Key::F1);
    for _ in 0..4 {
        window.step();
    }
    window.get_by_label("split, flicker, difference, tile");
    window.key_press(egui::Key::Escape);
    window.step();
    window.step();
    assert!(
        window
            .query_by_label("split, flicker, difference, tile")
            .is_none()
    );
}
