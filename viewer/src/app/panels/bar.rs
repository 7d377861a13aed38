//! The bar at the top: what is open, and what can be shown around it.

use super::super::model::player::Player;
use super::super::model::session::Source;
use super::super::viewer::Layout;
use eframe::egui::{self, Align, RichText, Theme, ViewportCommand};
use std::path::{Path, PathBuf};

/// Points right of the name of what is open from which on there is room to say more of it.
const ROOM: f32 = 620.0;

pub(in super::super) fn show(ui: &mut egui::Ui, player: &mut Player, layout: &mut Layout, folder: &Path) {
    ui.add_space(2.0);
    ui.horizontal(|ui| {
        if ui
            .button("Open")
            .on_hover_text("Open a scene or a recording (O)")
            .clicked()
        {
            layout.second = false;
            layout.open = !layout.open;
        }
        recent(ui, player);
        ui.separator();
        match &player.session {
            None => {
                ui.label(RichText::new("nothing is open").weak());
            }
            Some(session) => {
                ui.label(RichText::new(&session.scene.description.name).strong());
                let size = session.scene.grid.size;
                let what = match &session.source {
                    Source::Live(live) => format!("live, {}, {} × {}", live.solver(), size.x, size.y),
                    Source::Replay(replay) => {
                        format!(
                            "recording, {} frames, {} × {}",
                            replay.times().len(),
                            size.x,
                            size.y
                        )
                    }
                };
                // In a small window the buttons need the room.
                if ui.available_width() > ROOM {
                    ui.label(RichText::new(what).weak())
                        .on_hover_text(session.path.display().to_string());
                }
            }
        }
        if let Some(path) = player.opening() {
            ui.spinner();
            ui.label(format!("reading {}", name_of(path)));
        }
        ui.with_layout(egui::Layout::right_to_left(Align::Center), |ui| {
            ui.toggle_value(&mut layout.help, "?").on_hover_text("Keys (F1)");
            let dark = ui.ctx().theme() == Theme::Dark;
            if ui
                .button(if dark { "Light" } else { "Dark" })
                .on_hover_text("Light or dark colours (T)")
                .clicked()
            {
                ui.ctx().set_theme(if dark { Theme::Light } else { Theme::Dark });
            }
            if ui.button("Full").on_hover_text("Full screen (F)").clicked() {
                let full = ui.input(|input| input.viewport().fullscreen.unwrap_or(false));
                ui.ctx().send_viewport_cmd(ViewportCommand::Fullscreen(!full));
            }
            if player.session.is_some() {
                if ui
                    .button("Save")
                    .on_hover_text("Save the picture as PNG (S)")
                    .clicked()
                {
                    player.screenshot(folder);
                }
                ui.separator();
                ui.toggle_value(&mut layout.side, "Panel")
                    .on_hover_text("Settings at the side (H)");
                ui.toggle_value(&mut layout.plots, "Plots")
                    .on_hover_text("Plots against time (P)");
                ui.toggle_value(&mut player.compare.on, "Compare")
                    .on_hover_text("A second renderer or recording (C)");
            }
        });
    });
    ui.add_space(2.0);
}

/// The files that were opened before.
fn recent(ui: &mut egui::Ui, player: &mut Player) {
    if player.recent.list().is_empty() {
        return;
    }
    let mut chosen: Option<PathBuf> = None;
    ui.menu_button("Recent", |ui| {
        for path in player.recent.list() {
            if ui
                .button(name_of(path))
                .on_hover_text(path.display().to_string())
                .clicked()
            {
                chosen = Some(path.clone());
                ui.close();
            }
        }
    });
    if let Some(path) = chosen {
        player.open(&path, Vec::new());
    }
}

/// The last part of a path.
pub(super) fn name_of(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}
