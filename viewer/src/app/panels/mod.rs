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

use eframe::egui::{
    self, Color32, RichText, Role, Sense, TextStyle, TextWrapMode, WidgetInfo, WidgetText, pos2, vec2,
};

/// Seconds as `1.25 s`, or milliseconds below a tenth.
fn seconds(value: f64) -> String {
    if value < 0.1 {
        format!("{:.1} ms", 1e3 * value)
    } else {
        format!("{value:.2} s")
    }
}

/// A name and what it is, on one line. There are many of them in every update: they are painted, not laid out as widgets.
fn fact(ui: &mut egui::Ui, name: &str, value: impl Into<String>) {
    let value = value.into();
    let (area, response) = ui.allocate_exact_size(vec2(ui.available_width(), 17.0), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("{name} {value}")));
    let galley = |text: &str, color: Color32, room: f32| {
        let text = RichText::new(text).color(color);
        WidgetText::from(text).into_galley(ui, Some(TextWrapMode::Truncate), room, TextStyle::Body)
    };
    let (weak, plain) = (ui.visuals().weak_text_color(), ui.visuals().text_color());
    let name = galley(name, weak, area.width());
    let room = area.width() - name.size().x - 8.0;
    let shown = galley(&value, plain, room);
    let top = |height: f32| area.center().y - 0.5 * height;
    let right = pos2(area.right() - shown.size().x, top(shown.size().y));
    let left = pos2(area.left(), top(name.size().y));
    let elided = shown.elided;
    ui.painter().galley(left, name, weak);
    ui.painter().galley(right, shown, plain);
    if elided {
        response.on_hover_text(value);
    }
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
