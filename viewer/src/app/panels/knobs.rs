//! The part of the side panel that lists what of a renderer can be changed.

use super::super::model::player::Player;
use super::section;
use eframe::egui::{self, RichText};
use meniscus_sim::knobs::{Knob, Value};

/// What the renderer says can be changed.
pub(super) fn show(ui: &mut egui::Ui, player: &mut Player) {
    let knobs = player.knobs();
    if knobs.is_empty() {
        return;
    }
    section(ui, "How it draws", false, |ui| {
        let renderer = player.renderer.clone();
        let turned = player.turned.get(&renderer).cloned().unwrap_or_default();
        let mut after = turned.clone();
        for knob in knobs.iter() {
            let value = knob_row(ui, knob);
            if value != knob.value {
                after.insert(knob.name, value);
            }
        }
        ui.horizontal(|ui| {
            let reset = egui::Button::new("Defaults").small();
            if ui.add_enabled(!after.is_empty(), reset).clicked() {
                after.clear();
            }
            ui.label(
                RichText::new("* makes shaders again: one slow picture")
                    .weak()
                    .small(),
            );
        });
        if after != turned {
            if after.is_empty() {
                player.turned.remove(&renderer);
            } else {
                player.turned.insert(renderer, after);
            }
        }
    });
}

/// A knob; what it is turned to comes back.
fn knob_row(ui: &mut egui::Ui, knob: &Knob) -> Value {
    let name = format!("{}{}", knob.name, if knob.remakes { " *" } else { "" });
    let row = ui.horizontal(|ui| match knob.value {
        Value::Switch(mut on) => {
            ui.checkbox(&mut on, name);
            Value::Switch(on)
        }
        Value::Whole { mut now, range } => {
            let label = ui.label(name);
            ui.add(egui::DragValue::new(&mut now).range(range.0..=range.1).speed(0.1))
                .labelled_by(label.id);
            Value::Whole { now, range }
        }
        Value::Number { mut now, range, unit } => {
            let label = ui.label(name);
            ui.add(
                egui::Slider::new(&mut now, range.0..=range.1)
                    .logarithmic(true)
                    .suffix(format!(" {unit}")),
            )
            .labelled_by(label.id);
            Value::Number { now, range, unit }
        }
        Value::Choice { mut now, names } => {
            let label = ui.label(name);
            let list = egui::ComboBox::from_id_salt(knob.name)
                .selected_text(names.get(now).copied().unwrap_or_default())
                .show_ui(ui, |ui| {
                    for (k, name) in names.iter().enumerate() {
                        ui.selectable_value(&mut now, k, *name);
                    }
                });
            list.response.labelled_by(label.id);
            Value::Choice { now, names }
        }
    });
    row.response.on_hover_text(knob.about);
    row.inner
}
