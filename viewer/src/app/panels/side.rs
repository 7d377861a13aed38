//! The panel at the side: picture, camera, water, comparison, costs, what was left out.

use super::super::model::clip::{KINDS, SIZES};
use super::super::model::player::{Mode, Player};
use super::super::model::quality::{BUDGET, Quality};
use super::super::model::session::{RecordingState, Session};
use super::super::model::touch::Tool;
use super::super::style;
use super::super::timing::Timing;
use super::super::viewer::Layout;
use super::bar::name_of;
use super::{fact, knobs, seconds, section};
use eframe::egui::{self, Color32, CornerRadius, Rect, RichText, Sense, vec2};
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
            section(ui, "Touch the water", true, |ui| touch(ui, player));
            if player.compare.on {
                section(ui, "Compare", true, |ui| compare(ui, player, layout));
            }
            section(ui, "Time", true, |ui| costs(ui, player, timing));
            if player
                .session
                .as_ref()
                .is_some_and(|session| session.replay().is_some())
            {
                section(ui, "Clip", false, |ui| clip(ui, player, folder));
            }
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

fn touch(ui: &mut egui::Ui, player: &mut Player) {
    let Some(session) = &mut player.session else {
        return;
    };
    let live = session.live().is_some();
    ui.horizontal_wrapped(|ui| {
        for (tool, name, hint) in Tool::ALL {
            let button = egui::Button::selectable(session.touch.tool == tool, name);
            let response = ui
                .add_enabled(live || !tool.acts(), button)
                .on_hover_text(hint)
                .on_disabled_hover_text("Only a live run can be touched: open the scene file");
            if response.clicked() {
                session.touch.tool = tool;
            }
        }
    });
    if session.touch.tool.acts() && live {
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
    if let Some(place) = session.probe {
        ui.horizontal(|ui| {
            ui.label(format!("probe at ({:.2}, {:.2}) m", place.x, place.y));
            if ui.small_button("remove").clicked() {
                session.place_probe(None);
            }
        });
    }
}

fn compare(ui: &mut egui::Ui, player: &mut Player, layout: &mut Layout) {
    ui.horizontal(|ui| {
        for (mode, name) in Mode::ALL {
            ui.selectable_value(&mut player.compare.mode, mode, name)
                .on_hover_text("Next with M");
        }
    });
    let other = player
        .session
        .as_ref()
        .and_then(|session| session.other.as_ref())
        .map(|other| name_of(other.path()));
    if let Some(name) = &other {
        ui.horizontal(|ui| {
            ui.label("with");
            ui.selectable_value(&mut player.compare.other, false, "a renderer");
            ui.selectable_value(&mut player.compare.other, true, name);
        });
    }
    if player.compare.other && other.is_some() {
        ui.label(
            RichText::new("the same renderer draws both recordings at the same time")
                .weak()
                .small(),
        );
    } else {
        renderers(ui, player, true);
    }
    if ui.button("Compare with a recording…").clicked() {
        layout.second = true;
        layout.open = true;
    }
    if player.compare.mode == Mode::Flicker {
        ui.add(egui::Slider::new(&mut player.compare.rate, 0.5..=8.0).suffix(" a second"));
    }
    let Some(drawn) = &player.drawn else { return };
    let Some(right) = &drawn.right else { return };
    fact(
        ui,
        &format!("A  {}", drawn.left.renderer),
        seconds(drawn.left.seconds),
    );
    fact(ui, &format!("B  {}", right.renderer), seconds(right.seconds));
    if let Some(difference) = &drawn.difference {
        fact(ui, "FLIP, mean", format!("{:.5}", difference.flip.mean));
        fact(ui, "median", format!("{:.5}", difference.flip.median));
        fact(ui, "95th percentile", format!("{:.4}", difference.flip.p95));
        fact(ui, "comparing took", seconds(difference.seconds));
    }
    if let Some(noise) = right.noise {
        fact(
            ui,
            "B, noise",
            format!("{:.2} % after {} passes", 100.0 * noise, right.passes),
        );
    }
}

/// Where the time of a frame goes.
fn costs(ui: &mut egui::Ui, player: &mut Player, timing: &Timing) {
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
    fact(ui, "this window", format!("{} mean", seconds(timing.mean())));
    fact(ui, "longest", seconds(timing.longest()));
}

/// The limit on sub-steps of a live run.
fn limit_substeps(ui: &mut egui::Ui, session: &mut Session) {
    if session.live().is_none() {
        return;
    }
    ui.horizontal(|ui| {
        let label = ui.label("at most, in 1/60 s");
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

fn clip(ui: &mut egui::Ui, player: &mut Player, folder: &Path) {
    let Some(replay) = player.session.as_ref().and_then(|session| session.replay()) else {
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
