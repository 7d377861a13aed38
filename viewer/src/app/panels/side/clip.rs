//! A clip of the recording.

use super::super::super::model::clip::{KINDS, SIZES};
use super::super::super::model::player::Player;
use super::super::bar::name_of;
use eframe::egui::{self, RichText};
use std::path::Path;

pub(super) fn show(ui: &mut egui::Ui, player: &mut Player, folder: &Path) {
    let Some(replay) = player.session.as_ref().and_then(|session| session.replay()) else {
        ui.label(
            RichText::new(
                "Clips are written of recordings: record this run (R), then play what was recorded",
            )
            .weak()
            .small(),
        );
        return;
    };
    let last = replay.times().len() as u64 - 1;
    let here = player
        .session
        .as_ref()
        .and_then(|s| s.moment.as_ref())
        .map_or(0, |m| m.frame.index);
    let clip = &mut player.clip;
    for (name, frame) in [("first frame", &mut clip.first), ("last frame", &mut clip.last)] {
        ui.horizontal(|ui| {
            let label = ui.label(name);
            ui.add(egui::DragValue::new(frame).range(0..=last))
                .labelled_by(label.id);
            if ui
                .small_button("here")
                .on_hover_text("The frame that is shown")
                .clicked()
            {
                *frame = here;
            }
        });
    }
    ui.horizontal(|ui| {
        let file = ui.label("file");
        let kinds = egui::ComboBox::from_id_salt("clip kind")
            .selected_text(KINDS[clip.kind].0)
            .width(60.0)
            .show_ui(ui, |ui| {
                for (k, (_, name)) in KINDS.iter().enumerate() {
                    ui.selectable_value(&mut clip.kind, k, *name);
                }
            });
        kinds.response.labelled_by(file.id);
        let name = |size: meniscus_sim::glam::UVec2| format!("{} × {}", size.x, size.y);
        let sizes = egui::ComboBox::from_id_salt("clip size")
            .selected_text(name(SIZES[clip.size]))
            .show_ui(ui, |ui| {
                for (k, size) in SIZES.into_iter().enumerate() {
                    ui.selectable_value(&mut clip.size, k, name(size));
                }
            });
        sizes.response.labelled_by(file.id);
    });
    ui.horizontal(|ui| {
        let label = ui.label("samples a pixel");
        ui.add(egui::DragValue::new(&mut clip.samples).range(1..=64))
            .labelled_by(label.id);
    });
    let writing = player.clipping().map(name_of);
    match writing {
        Some(name) => {
            ui.horizontal(|ui| {
                ui.spinner();
                ui.label(format!("writing {name}"));
            });
        }
        None => {
            let hint = "As it is seen now: this renderer, camera, exposure and speed";
            if ui.button("Write clip").on_hover_text(hint).clicked() {
                player.write_clip(folder);
            }
        }
    }
}
