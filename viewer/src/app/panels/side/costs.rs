//! Where the time goes.

use super::super::super::model::player::Player;
use super::super::super::model::session::Session;
use super::super::super::style;
use super::super::super::timing::Timing;
use super::super::{fact, seconds};
use eframe::egui::{self, CornerRadius, Rect, Sense, vec2};

/// Where the time of a frame goes.
pub(super) fn show(ui: &mut egui::Ui, player: &mut Player, timing: &Timing) {
    if let Some(session) = &mut player.session
        && let Some(moment) = session.moment.clone()
    {
        let name = if session.live().is_some() {
            "solving"
        } else {
            "decoding"
        };
        fact(ui, name, seconds(moment.seconds));
        let stages = session.history.latest_stages();
        let longest = stages.iter().map(|(_, s)| *s).fold(1e-9, f64::max);
        for (name, spent) in stages {
            bar(ui, name, *spent, longest);
        }
        if let Some(report) = moment.report {
            fact(ui, "sub-steps", report.substeps.to_string());
            limit_substeps(ui, session);
            fact(ui, "largest Courant number", format!("{:.3}", report.courant));
            if report.froude > 0.0 {
                fact(ui, "largest Froude number", format!("{:.3}", report.froude));
            }
            if report.clamps > 0 {
                ui.colored_label(
                    style::WARNING,
                    format!("{} clamps: limiters of last resort fired", report.clamps),
                );
            }
        }
    }
    if let Some(drawn) = &player.drawn {
        fact(ui, "drawing", seconds(drawn.left.seconds));
        let longest = drawn.left.stages.iter().map(|(_, s)| *s).fold(1e-9, f64::max);
        for (name, spent) in &drawn.left.stages {
            bar(ui, name, *spent, longest);
        }
    }
    fact(ui, "laying out this window, mean", seconds(timing.mean()));
    fact(ui, "longest", seconds(timing.longest()));
}

/// The limit on sub-steps of a live run.
fn limit_substeps(ui: &mut egui::Ui, session: &mut Session) {
    if session.live().is_none() {
        return;
    }
    ui.horizontal(|ui| {
        let label = ui.label("limit in 1/60 s");
        let most = &mut session.most_substeps;
        ui.add(egui::DragValue::new(most).range(0..=1000).speed(0.1).custom_formatter(|n, _| {
            if n > 0.0 { format!("{n:.0}") } else { "any number".to_owned() }
        }))
        .labelled_by(label.id)
        .on_hover_text("Sub-steps while a picture stands on the screen: beyond, the run is slower than the clock rather than busier");
    });
}

/// A stage as a bar.
fn bar(ui: &mut egui::Ui, name: &str, spent: f64, longest: f64) {
    let (area, _) = ui.allocate_exact_size(vec2(ui.available_width(), 15.0), Sense::hover());
    let painter = ui.painter_at(area);
    let left = area.left() + 0.5 * area.width();
    let most = area.right() - left - 56.0;
    let width = (most * (spent / longest) as f32).max(1.0);
    let fill = Rect::from_min_size(
        egui::pos2(left, area.top() + 3.0),
        vec2(width, area.height() - 6.0),
    );
    painter.rect_filled(fill, CornerRadius::same(2), style::ACCENT);
    let font = egui::FontId::proportional(11.5);
    let weak = ui.visuals().weak_text_color();
    let clip = painter.with_clip_rect(Rect::from_min_max(
        area.min,
        egui::pos2(left - 4.0, area.bottom()),
    ));
    clip.text(
        area.left_center() + vec2(8.0, 0.0),
        egui::Align2::LEFT_CENTER,
        name,
        font.clone(),
        weak,
    );
    painter.text(
        area.right_center(),
        egui::Align2::RIGHT_CENTER,
        seconds(spent),
        font,
        weak,
    );
}
