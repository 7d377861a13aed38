//! What the pointer is for.

use super::super::super::model::player::Player;
use super::super::super::model::touch::Tool;
use eframe::egui::{self, RichText};

pub(super) fn show(ui: &mut egui::Ui, player: &mut Player) {
    let Some(session) = &mut player.session else {
        return;
    };
    let live = session.live().is_some();
    ui.horizontal_wrapped(|ui| {
        for (tool, name, hint) in Tool::ALL {
            let idle = if live || !tool.acts() {
                tool.idle(&session.scene)
            } else {
                Some("Only a live run can be touched: open the scene file")
            };
            let button = egui::Button::selectable(session.touch.tool == tool, name);
            let response = ui
                .add_enabled(idle.is_none(), button)
                .on_hover_text(hint)
                .on_disabled_hover_text(idle.unwrap_or_default());
            if response.clicked() {
                session.touch.tool = tool;
            }
        }
    });
    let tool = session.touch.tool;
    let hint = Tool::ALL.iter().find(|(known, ..)| *known == tool);
    let said = match hint {
        Some((.., hint)) if live || !tool.acts() => *hint,
        _ => "",
    };
    ui.label(RichText::new(said).weak().small());
    if tool.is_round() && live {
        let extent = session.scene.grid.extent().min_element();
        let smallest = (2.0 * session.scene.grid.spacing).min(0.2 * extent);
        ui.horizontal(|ui| {
            let label = ui.label("Radius");
            let range = smallest..=0.3 * extent;
            ui.add(
                egui::Slider::new(&mut session.touch.radius, range)
                    .logarithmic(true)
                    .suffix(" m"),
            )
            .labelled_by(label.id);
        });
    }
    if tool.has_strength() && live {
        ui.horizontal(|ui| {
            let label = ui.label("Strength");
            ui.add(
                egui::Slider::new(&mut session.touch.strength, 0.1..=5.0)
                    .logarithmic(true)
                    .suffix(" ×"),
            )
            .labelled_by(label.id);
        });
    }
    if let Some(name) = session.touch.holds() {
        ui.label(format!("holding {name}"));
    }
    if let Some(degrees) = session.touch.tilted() {
        ui.label(format!("tilted by {degrees:.0}°"));
    }
    if let Some(place) = session.probe {
        ui.horizontal(|ui| {
            ui.label(format!("probe at ({:.2}, {:.2}) m", place.x, place.y));
            if ui.small_button("remove").clicked() {
                session.place_probe(None);
            }
        });
    }
}
