//! Messages over the picture, until they are put away.

use super::super::model::messages::Severity;
use super::super::model::player::Player;
use super::super::style;
use eframe::egui::{self, Align2, Color32, CornerRadius, Margin, RichText, vec2};

/// Most messages that are shown at once.
const SHOWN: usize = 5;

pub(in super::super) fn show(ui: &egui::Ui, player: &mut Player) {
    let count = player.messages.list().len();
    if count == 0 {
        return;
    }
    let area = ui.max_rect();
    let mut gone = None;
    let mut clear = false;
    egui::Area::new(egui::Id::unique("notices"))
        .fixed_pos(area.left_bottom() + vec2(10.0, -10.0))
        .pivot(Align2::LEFT_BOTTOM)
        .show(ui.ctx(), |ui| {
            ui.set_max_width((0.75 * area.width()).min(640.0));
            if count > SHOWN && ui.small_button(format!("put all {count} away")).clicked() {
                clear = true;
            }
            for (k, message) in player
                .messages
                .list()
                .iter()
                .enumerate()
                .skip(count.saturating_sub(SHOWN))
            {
                let color = match message.severity {
                    Severity::Note => style::ACCENT,
                    Severity::Warning => style::WARNING,
                    Severity::Error => style::ALARM,
                };
                egui::Frame::NONE
                    .fill(Color32::from_rgba_unmultiplied(24, 26, 29, 235))
                    .corner_radius(CornerRadius::same(4))
                    .stroke(egui::Stroke::new(1.0, color))
                    .inner_margin(Margin::symmetric(10, 6))
                    .show(ui, |ui| {
                        ui.horizontal_top(|ui| {
                            if ui.small_button("×").on_hover_text("Put away").clicked() {
                                gone = Some(k);
                            }
                            let times = if message.times > 1 {
                                format!("{} ({} times)", message.text, message.times)
                            } else {
                                message.text.clone()
                            };
                            ui.add(
                                egui::Label::new(RichText::new(times).color(Color32::from_gray(230))).wrap(),
                            );
                        });
                    });
            }
        });
    if let Some(k) = gone {
        player.messages.dismiss(k);
    }
    if clear {
        player.messages.clear();
    }
}
