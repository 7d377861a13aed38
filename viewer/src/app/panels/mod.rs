//! The parts of the window. Each shows what the model says and changes what it is told to.

pub(super) mod bar;
pub(super) mod help;
mod icons;
mod knobs;
pub(super) mod notices;
pub(super) mod open;
pub(super) mod picture;
pub(super) mod plots;
pub(super) mod side;
mod textures;
pub(super) mod transport;

pub(super) use textures::Textures;

use eframe::egui::{self, RichText};

/// Seconds as `1.25 s`, or milliseconds below a tenth.
fn seconds(value: f64) -> String {
    if value < 0.1 {
        format!("{:.1} ms", 1e3 * value)
    } else {
        format!("{value:.2} s")
    }
}

/// A name and what it is, on one line.
fn fact(ui: &mut egui::Ui, name: &str, value: impl Into<String>) {
    let row = egui::vec2(ui.available_width(), 17.0);
    ui.allocate_ui_with_layout(row, egui::Layout::left_to_right(egui::Align::Center), |ui| {
        ui.label(RichText::new(name).weak());
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.add(egui::Label::new(value.into()).truncate());
        });
    });
}

/// A part of the side panel, which can be folded.
fn section(ui: &mut egui::Ui, title: &str, open: bool, contents: impl FnOnce(&mut egui::Ui)) {
    egui::CollapsingHeader::new(RichText::new(title).strong())
        .default_open(open)
        .show_unindented(ui, |ui| {
            contents(ui);
            ui.add_space(4.0);
        });
    ui.separator();
}
