//! The panel at the side: picture, camera, water, comparison, costs, what was left out.

mod clip;
mod compare;
mod costs;
mod touch;

use super::super::model::player::Player;
use super::super::model::quality::{BUDGET, Quality};
use super::super::model::session::RecordingState;
use super::super::style;
use super::super::timing::Timing;
use super::super::viewer::Layout;
use super::{fact, knobs, section};
use eframe::egui::{self, Color32, RichText};
use std::path::Path;

pub(in super::super) fn show(
    ui: &mut egui::Ui,
    player: &mut Player,
    layout: &mut Layout,
    timing: &Timing,
    folder: &Path,
) {
    egui::ScrollArea::vertical()
        .auto_shrink([false, false])
        .show(ui, |ui| {
            ui.add_space(4.0);
            section(ui, "Picture", true, |ui| picture(ui, player));
            knobs::show(ui, player);
            section(ui, "Camera", true, |ui| camera(ui, player));
            section(ui, "Touch the water", true, |ui| touch::show(ui, player));
            if player.compare.on {
                section(ui, "Compare", true, |ui| compare::show(ui, player, layout));
            }
            section(ui, "Time", true, |ui| costs::show(ui, player, timing));
            section(ui, "Clip", false, |ui| clip::show(ui, player, folder));
            section(ui, "Scene", false, |ui| scene(ui, player, layout));
            section(ui, "What runs, and what was left out", false, |ui| {
                plan(ui, player)
            });
        });
}

/// Chooses a renderer of those that there are.
fn renderers(ui: &mut egui::Ui, player: &mut Player, second: bool) {
    let mut chosen = if second {
        player.compare.renderer.clone()
    } else {
        player.renderer.clone()
    };
    let name = ui.label(if second { "Second renderer" } else { "Renderer" });
    let list = egui::ComboBox::from_id_salt(("renderer", second))
        .selected_text(chosen.clone())
        .width(ui.available_width() - 8.0)
        .show_ui(ui, |ui| {
            for choice in &player.choices.list {
                let label = egui::Button::selectable(chosen == choice.name, choice.name);
                let response = ui
                    .add_enabled(choice.unavailable.is_none(), label)
                    .on_hover_text(choice.summary)
                    .on_disabled_hover_text(choice.unavailable.clone().unwrap_or_default());
                if response.clicked() {
                    chosen = choice.name.to_owned();
                }
            }
        });
    list.response.labelled_by(name.id);
    if second {
        player.compare.renderer = chosen;
    } else {
        player.renderer = chosen;
    }
}

fn picture(ui: &mut egui::Ui, player: &mut Player) {
    renderers(ui, player, false);
    if let Some(choice) = player.choices.list.iter().find(|c| c.name == player.renderer) {
        ui.label(RichText::new(choice.summary).weak().small());
    }
    ui.horizontal(|ui| {
        ui.label("Pixels");
        for (quality, name) in Quality::ALL {
            let hint = match quality {
                Quality::Auto => format!(
                    "As many as can be drawn in {:.0} ms while things move, all at rest",
                    1e3 * BUDGET
                ),
                _ => format!("{name} resolution, always"),
            };
            ui.selectable_value(&mut player.quality, quality, name)
                .on_hover_text(hint);
        }
    });
    if let Some(session) = &mut player.session {
        ui.horizontal(|ui| {
            let label = ui.label("Exposure");
            ui.add(
                egui::Slider::new(&mut session.exposure, -6.0..=6.0)
                    .step_by(0.1)
                    .suffix(" stops"),
            )
            .labelled_by(label.id);
        });
    }
    if let Some(device) = player.drawn.as_ref().and_then(|drawn| drawn.left.device.as_ref()) {
        ui.label(RichText::new(device).weak().small());
    }
}

fn camera(ui: &mut egui::Ui, player: &mut Player) {
    let Some(session) = &mut player.session else {
        return;
    };
    ui.horizontal_wrapped(|ui| {
        for (k, mark) in session.bookmarks.iter().enumerate() {
            let there = mark.camera == session.camera;
            let hint = if k < 9 {
                format!("Look from here ({})", k + 1)
            } else {
                "Look from here".to_owned()
            };
            if ui
                .selectable_label(there, &mark.name)
                .on_hover_text(hint)
                .clicked()
            {
                (session.camera, session.exposure) = (mark.camera, mark.exposure);
            }
        }
        if ui
            .button("+")
            .on_hover_text("Remember this place while the file is open")
            .clicked()
        {
            let name = format!("place {}", session.bookmarks.len() + 1);
            session.bookmarks.push(super::super::model::camera::Bookmark {
                name,
                camera: session.camera,
                exposure: session.exposure,
            });
        }
    });
    ui.horizontal(|ui| {
        let label = ui.label("Field of view");
        let mut degrees = session.camera.fov.to_degrees();
        if ui
            .add(
                egui::Slider::new(&mut degrees, 5.0..=120.0)
                    .suffix("°")
                    .step_by(1.0),
            )
            .labelled_by(label.id)
            .changed()
        {
            session.camera.fov = degrees.to_radians();
        }
    });
    let eye = session.camera.position();
    ui.label(
        RichText::new(format!("eye ({:.2}, {:.2}, {:.2}) m", eye.x, eye.y, eye.z))
            .weak()
            .small(),
    );
}

fn scene(ui: &mut egui::Ui, player: &mut Player, layout: &mut Layout) {
    let Some(session) = &player.session else { return };
    let grid = session.scene.grid;
    fact(
        ui,
        "grid",
        format!("{} × {}, {} m apart", grid.size.x, grid.size.y, grid.spacing),
    );
    fact(
        ui,
        "frames a second",
        format!("{}", session.scene.description.recording.rate),
    );
    fact(ui, "channels", session.channels().to_string());
    if let Some(live) = session.live() {
        fact(
            ui,
            "solver holds",
            format!("{:.1} MiB", live.solver_bytes() as f64 / 1_048_576.0),
        );
        ui.label("Changes to the scene's keys, one a line");
        ui.add(
            egui::TextEdit::multiline(&mut layout.overrides)
                .hint_text("solver.spacing = 0.05")
                .desired_rows(2)
                .desired_width(f32::INFINITY)
                .code_editor(),
        );
        let recording = session.recording != RecordingState::Off;
        let path = session.path.clone();
        let button = egui::Button::new("Restart with these");
        let response = ui
            .add_enabled(!recording, button)
            .on_hover_text("Keys of the scene take effect from the beginning: the run starts again")
            .on_disabled_hover_text("Finish the recording first");
        if response.clicked() {
            player.open(&path, overrides(&layout.overrides));
        }
        ui.label(
            RichText::new("What stands above under Picture and Touch changes at once; what is changed here needs a restart.")
                .weak()
                .small(),
        );
    }
    for line in &player.overrides {
        ui.label(RichText::new(format!("with {line}")).color(Color32::GRAY).small());
    }
}

/// Lines `key = value` as `--set` takes them.
fn overrides(text: &str) -> Vec<String> {
    let lines = text
        .lines()
        .map(str::trim)
        .filter(|line| !line.is_empty() && !line.starts_with('#'));
    lines
        .map(|line| match line.split_once('=') {
            Some((key, value)) => format!("{}={}", key.trim(), value.trim()),
            None => line.to_owned(),
        })
        .collect()
}

fn plan(ui: &mut egui::Ui, player: &mut Player) {
    let Some(items) = player.plan() else {
        ui.spinner();
        return;
    };
    let bytes: u64 = items.iter().map(|item| item.bytes).sum();
    fact(ui, "held by the renderer", mebibytes(bytes));
    for active in [true, false] {
        let title = if active { "runs" } else { "left out" };
        ui.label(RichText::new(title).strong().small());
        for item in items.iter().filter(|item| item.active == active) {
            ui.horizontal(|ui| {
                let (mark, color) = if active {
                    ("+", style::ACCENT)
                } else {
                    ("−", Color32::GRAY)
                };
                ui.colored_label(color, mark);
                ui.add(egui::Label::new(RichText::new(&item.name).small()).truncate())
                    .on_hover_text(&item.reason);
                if item.bytes > 0 {
                    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                        ui.label(RichText::new(mebibytes(item.bytes)).weak().small());
                    });
                }
            });
        }
    }
}

fn mebibytes(bytes: u64) -> String {
    format!("{:.2} MiB", bytes as f64 / 1_048_576.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_become_overrides() {
        assert_eq!(
            overrides(" solver.spacing = 0.5 \n\n# no\nseed=3"),
            ["solver.spacing=0.5", "seed=3"]
        );
    }
}
