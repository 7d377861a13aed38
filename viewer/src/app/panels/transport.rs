//! The bar at the bottom: playing, seeking, recording.

use super::super::model::clock::SPEEDS;
use super::super::model::player::{Player, recording_name};
use super::super::model::session::{RecordingState, Session};
use super::super::style;
use super::bar::name_of;
use super::icons::{self, Icon};
use eframe::egui::{self, Align, Color32, CornerRadius, Rect, RichText, Sense, Stroke, pos2, vec2};
use std::path::Path;

pub(in super::super) fn show(ui: &mut egui::Ui, player: &mut Player, folder: &Path) {
    let mut reopen = None;
    if let Some(session) = &mut player.session {
        ui.add_space(4.0);
        timeline(ui, session);
        ui.horizontal(|ui| {
            buttons(ui, session);
            ui.separator();
            speed(ui, session);
            if session.replay().is_some() {
                ui.toggle_value(&mut session.clock.looping, "Loop")
                    .on_hover_text("From the end to the beginning (Shift+L)");
            } else {
                record(ui, session, folder);
                if let (Some(path), RecordingState::Off) = (&session.recorded, &session.recording)
                    && ui
                        .button(format!("Play {}", name_of(path)))
                        .on_hover_text("Open the recording that was just made")
                        .clicked()
                {
                    reopen = Some(path.clone());
                }
            }
            ui.with_layout(egui::Layout::right_to_left(Align::Center), |ui| {
                place(ui, session)
            });
        });
        ui.add_space(4.0);
    }
    if let Some(path) = reopen {
        player.open(&path, Vec::new());
    }
}

fn buttons(ui: &mut egui::Ui, session: &mut Session) {
    let live = session.live().is_some();
    let able = session.failed.is_none();
    let mut icon = |icon, name: &str, width, able| {
        let response = icons::button(ui, icon, name, width, able);
        response.on_hover_text(name).clicked()
    };
    let begin = if live {
        "Begin again (Home)"
    } else {
        "First frame (Home)"
    };
    if icon(Icon::First, begin, 28.0, true) {
        session.rewind();
    }
    if !live && icon(Icon::Back, "One frame back (Left)", 28.0, true) {
        session.step(true);
    }
    let (face, name) = if session.clock.playing {
        (Icon::Pause, "Pause (space)")
    } else {
        (Icon::Play, "Play (space)")
    };
    if icon(face, name, 44.0, able) {
        session.toggle();
    }
    if icon(Icon::On, "One frame on (Right)", 28.0, able) {
        session.step(false);
    }
    if !live && icon(Icon::Last, "Last frame (End)", 28.0, true) {
        session.clock.seek(session.clock.range.1);
    }
}

fn speed(ui: &mut egui::Ui, session: &mut Session) {
    let name = |speed: f64| {
        if speed < 1.0 {
            format!("1/{:.0} ×", 1.0 / speed)
        } else {
            format!("{speed:.0} ×")
        }
    };
    let mut chosen = session.clock.speed();
    let sign = if session.clock.reverse { "−" } else { "" };
    let name_of_list = ui.label("Speed");
    egui::ComboBox::from_id_salt("speed")
        .selected_text(format!("{sign}{}", name(chosen)))
        .width(64.0)
        .show_ui(ui, |ui| {
            for speed in SPEEDS {
                ui.selectable_value(&mut chosen, speed, name(speed));
            }
        })
        .response
        .labelled_by(name_of_list.id)
        .on_hover_text("Speed (Up, Down; J K L play back, stop, play)");
    if chosen != session.clock.speed() {
        session.clock.set_speed(chosen);
    }
}

fn record(ui: &mut egui::Ui, session: &mut Session, folder: &Path) {
    ui.separator();
    match session.recording.clone() {
        RecordingState::Off => {
            let face = RichText::new("Record").color(style::ALARM);
            let response = ui.button(face).on_hover_ui(|ui| {
                let name = recording_name(session, folder);
                ui.label(format!("Record from here on into {} (R)", name.display()));
            });
            if response.clicked() {
                session.record(Some(recording_name(session, folder)));
            }
        }
        RecordingState::On(path, frames) => {
            let face = RichText::new("Stop").color(Color32::WHITE);
            if ui
                .add(egui::Button::new(face).fill(style::ALARM))
                .on_hover_text("Finish the recording (R)")
                .clicked()
            {
                session.record(None);
            }
            ui.colored_label(style::ALARM, format!("{} · {frames} frames", name_of(&path)));
        }
    }
}

/// Time, frame, and how fast a live run is.
fn place(ui: &mut egui::Ui, session: &Session) {
    let clock = &session.clock;
    let shown = session
        .moment
        .as_ref()
        .map(|moment| (moment.frame.time, moment.frame.index));
    if let Some((time, index)) = shown {
        let text = match session.replay() {
            Some(replay) => format!(
                "{time:.3} / {:.2} s   frame {index} / {}",
                clock.range.1,
                replay.times().len() - 1
            ),
            None => format!("{time:.3} s   frame {index}"),
        };
        ui.label(RichText::new(text).monospace());
    }
    if let Some(factor) = session.factor {
        let slow = factor < 0.97 * clock.speed();
        let text = RichText::new(format!("{factor:.2} × real time"));
        let text = if slow {
            text.color(style::WARNING)
        } else {
            text.weak()
        };
        ui.label(text).on_hover_text(if slow {
            "The solver cannot keep to the speed that was chosen"
        } else {
            "Simulated seconds a second of the clock"
        });
    }
}

/// Points from the ends of the line of time to those of its panel: its handle has room at both.
const MARGIN: f32 = 10.0;

/// The line of time with its events; a recording is sought by dragging.
fn timeline(ui: &mut egui::Ui, session: &mut Session) {
    let able = session.replay().is_some();
    let sense = if able {
        Sense::click_and_drag()
    } else {
        Sense::hover()
    };
    let (area, response) = ui.allocate_exact_size(vec2(ui.available_width(), 22.0), sense);
    let end = match session.live() {
        // A live run is shown against the scene's duration while it is within it.
        Some(_) => session.scene.description.duration.max(session.clock.range.1),
        None => session.clock.range.1,
    };
    let (first, last) = (session.clock.range.0, end);
    let span = (last - first).max(1e-9);
    let x = |time: f64| area.left() + MARGIN + ((time - first) / span) as f32 * (area.width() - 2.0 * MARGIN);
    if let Some(pointer) = response.interact_pointer_pos().filter(|_| able) {
        let share = (pointer.x - area.left() - MARGIN) / (area.width() - 2.0 * MARGIN);
        session.clock.seek(first + f64::from(share) * span);
    }
    let painter = ui.painter_at(area);
    let visuals = ui.visuals();
    let middle = area.center().y;
    let track = |from: f32, to: f32| Rect::from_min_max(pos2(from, middle - 3.0), pos2(to, middle + 3.0));
    let round = CornerRadius::same(3);
    painter.rect_filled(track(x(first), x(last)), round, visuals.widgets.inactive.bg_fill);
    painter.rect_filled(track(x(first), x(session.clock.time)), round, style::ACCENT);
    for time in session
        .markers
        .iter()
        .filter(|time| (first..=last).contains(*time))
    {
        let at = x(*time);
        painter.line_segment(
            [pos2(at, middle - 9.0), pos2(at, middle - 4.0)],
            Stroke::new(1.5, style::WARNING),
        );
    }
    let handle = pos2(x(session.clock.time), middle);
    let radius = if response.hovered() || response.dragged() {
        8.0
    } else {
        6.5
    };
    painter.circle(
        handle,
        radius,
        visuals.panel_fill,
        Stroke::new(2.5, style::ACCENT),
    );
    if able && let Some(pointer) = response.hover_pos() {
        let share = (pointer.x - area.left() - MARGIN) / (area.width() - 2.0 * MARGIN);
        let share = f64::from(share).clamp(0.0, 1.0);
        response.on_hover_text_at_pointer(format!("{:.2} s", first + share * span));
    }
}
