//! Opening a file: by name, from those opened before, or of those in a folder.

use super::super::model::player::Player;
use super::super::viewer::Layout;
use super::bar::name_of;
use eframe::egui::{self, Align2, Key, RichText};
use std::path::{Path, PathBuf};

/// Most files that are listed of a folder.
const MOST: usize = 200;

/// What is seen while nothing is open.
pub(in super::super) fn welcome(ui: &mut egui::Ui, player: &mut Player, layout: &mut Layout) {
    let frame = egui::Frame::NONE.fill(ui.visuals().panel_fill).inner_margin(24);
    egui::CentralPanel::default().frame(frame).show(ui, |ui| {
        ui.vertical_centered(|ui| {
            ui.set_max_width(560.0);
            ui.add_space(0.08 * ui.available_height());
            ui.label(RichText::new("Meniscus").size(30.0).strong());
            ui.label(
                RichText::new("Drop a recording (.mrec) or a scene (.toml) here, or choose one below").weak(),
            );
            ui.add_space(16.0);
            chooser(ui, player, layout);
        });
    });
}

/// The same in a window over the picture.
pub(in super::super) fn window(ctx: &egui::Context, player: &mut Player, layout: &mut Layout) {
    if player.session.is_none() {
        layout.open = false;
        return;
    }
    let mut open = true;
    let title = if layout.second {
        "Compare with a recording"
    } else {
        "Open"
    };
    egui::Window::new(title)
        .open(&mut open)
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, [0.0, -40.0])
        .default_width(520.0)
        .show(ctx, |ui| chooser(ui, player, layout));
    layout.open &= open;
}

fn chooser(ui: &mut egui::Ui, player: &mut Player, layout: &mut Layout) {
    let mut chosen: Option<PathBuf> = None;
    ui.horizontal(|ui| {
        let field = egui::TextEdit::singleline(&mut layout.path)
            .hint_text("path of a scene, a recording or a folder")
            .desired_width((ui.available_width() - 76.0).max(120.0));
        let entered = ui.add(field).lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
        if ui.button("Open").clicked() || entered {
            chosen = Some(PathBuf::from(layout.path.trim()));
        }
    });
    ui.add_space(6.0);
    egui::ScrollArea::vertical().max_height(320.0).show(ui, |ui| {
        let recent: Vec<PathBuf> = player
            .recent
            .list()
            .iter()
            .filter(|p| fits(p, layout.second))
            .cloned()
            .collect();
        if !recent.is_empty() {
            ui.label(RichText::new("Opened before").strong());
            for path in recent {
                row(ui, &path, &mut chosen);
            }
            ui.add_space(6.0);
        }
        let folder = folder_of(&layout.path);
        ui.label(RichText::new(format!("In {}", folder.display())).strong());
        if let Some(parent) = folder.parent() {
            row_named(ui, parent, "../", &mut chosen);
        }
        let found = listing(ui.ctx(), &folder);
        let mut any = false;
        for path in found
            .iter()
            .filter(|path| path.is_dir() || fits(path, layout.second))
        {
            any = true;
            row(ui, path, &mut chosen);
        }
        if !any {
            ui.label(RichText::new("no scene and no recording").weak());
        }
    });
    let Some(path) = chosen.filter(|path| !path.as_os_str().is_empty()) else {
        return;
    };
    if path.is_dir() {
        layout.path = format!("{}/", path.display());
    } else if layout.second {
        player.open_other(&path);
        layout.open = false;
    } else {
        player.open(&path, Vec::new());
        layout.open = false;
    }
}

fn row(ui: &mut egui::Ui, path: &Path, chosen: &mut Option<PathBuf>) {
    let name = name_of(path);
    let text = if path.is_dir() { format!("{name}/") } else { name };
    row_named(ui, path, &text, chosen);
}

fn row_named(ui: &mut egui::Ui, path: &Path, text: &str, chosen: &mut Option<PathBuf>) {
    let button = egui::Button::selectable(false, text).min_size(egui::vec2(ui.available_width(), 0.0));
    if ui.add(button).on_hover_text(path.display().to_string()).clicked() {
        *chosen = Some(path.to_owned());
    }
}

/// Whether a file can be opened here: a recording, or also a scene where that is meant.
fn fits(path: &Path, recordings_only: bool) -> bool {
    let extension = path
        .extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_ascii_lowercase();
    extension == "mrec" || extension == "toml" && !recordings_only
}

/// The folder that is typed, or that of the file that is.
fn folder_of(typed: &str) -> PathBuf {
    let path = PathBuf::from(typed.trim());
    if path.is_dir() {
        return path;
    }
    match path.parent() {
        Some(parent) if parent.is_dir() => parent.to_owned(),
        _ => std::env::current_dir().unwrap_or_default(),
    }
}

/// Folders and files that can be opened; read once every two seconds, not every update.
fn listing(ctx: &egui::Context, folder: &Path) -> Vec<PathBuf> {
    let id = egui::Id::unique("listing");
    let now = ctx.input(|input| input.time);
    let known: Option<(PathBuf, f64, Vec<PathBuf>)> = ctx.data(|data| data.get_temp(id));
    if let Some((at, when, list)) = known
        && at == folder
        && now - when < 2.0
    {
        return list;
    }
    let entries = std::fs::read_dir(folder).map(|entries| entries.flatten().map(|entry| entry.path()));
    let mut list: Vec<PathBuf> = entries.map_or_else(
        |_| Vec::new(),
        |entries| {
            let wanted =
                |path: &PathBuf| !name_of(path).starts_with('.') && (path.is_dir() || fits(path, false));
            entries.filter(wanted).take(MOST).collect()
        },
    );
    list.sort_by_key(|path| (!path.is_dir(), name_of(path).to_lowercase()));
    ctx.data_mut(|data| data.insert_temp(id, (folder.to_owned(), now, list.clone())));
    list
}
