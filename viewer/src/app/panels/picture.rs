//! The picture, what lies over it, and what the pointer does in it.

use super::super::model::camera::Camera;
use super::super::model::drawing::{Picture, heat};
use super::super::model::player::{Mode, Player};
use super::super::model::probe;
use super::super::model::touch::{Pointer, Tool};
use super::super::style;
use super::{Textures, seconds};
use eframe::egui::{
    self, Align2, Color32, CornerRadius, CursorIcon, FontId, Key, PointerButton, Rect, Sense, Stroke,
    StrokeKind, TextureHandle, TextureId, pos2, vec2,
};
use meniscus_sim::glam::{UVec2, Vec3, vec2 as point};

/// Half the width of the divider's handle.
const HANDLE: f32 = 7.0;

/// Shows it; the pixels of its place come back.
pub(in super::super) fn show(ui: &mut egui::Ui, player: &mut Player, textures: &Textures, now: f64) -> UVec2 {
    let area = ui.available_rect_before_wrap();
    let response = ui.allocate_rect(area, Sense::click_and_drag());
    let scale = ui.ctx().pixels_per_point();
    let pixels = UVec2::new(
        (area.width() * scale).round().max(1.0) as u32,
        (area.height() * scale).round().max(1.0) as u32,
    );
    let painter = ui.painter_at(area);
    match textures.left() {
        Some(left) => pictures(&painter, area, player, textures, left, now),
        None => first(&painter, area, player),
    }
    let busy = player.compare.on && player.compare.mode == Mode::Split && divide(ui, area, player);
    let met = if busy {
        None
    } else {
        hands(ui, &response, area, pixels, player, now)
    };
    marks(ui, &painter, area, &response, player, met);
    pixels
}

/// What is waited for before there is a picture.
fn first(painter: &egui::Painter, area: Rect, player: &Player) {
    let renderer = &player.renderer;
    let shaders = if player.choices.is_gpu(renderer) {
        "\nIts shaders are made first, which may take a while where a driver draws in software. Time stands until then."
    } else {
        ""
    };
    let text = format!("{renderer} draws the first picture…{shaders}");
    let galley = painter.layout(
        text,
        FontId::proportional(15.0),
        Color32::GRAY,
        0.8 * area.width(),
    );
    let place = Align2::CENTER_CENTER.anchor_size(area.center(), galley.size());
    painter.galley(place.min, galley, Color32::GRAY);
}

fn pictures(
    painter: &egui::Painter,
    area: Rect,
    player: &Player,
    textures: &Textures,
    left: TextureId,
    now: f64,
) {
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    let full = |texture: TextureId| painter.image(texture, area, whole, Color32::WHITE);
    let Some(drawn) = textures.drawn() else { return };
    let place = [
        area.left_top() + vec2(10.0, 10.0),
        area.right_top() + vec2(-10.0, 10.0),
    ];
    let pair = textures
        .right
        .as_ref()
        .map(TextureHandle::id)
        .zip(drawn.right.as_ref())
        .filter(|_| player.compare.on);
    let Some((second, right)) = pair else {
        full(left);
        tag(painter, place[0], Align2::LEFT_TOP, &title(&drawn.left, None));
        return;
    };
    let error = drawn.difference.as_ref().map(|difference| difference.flip);
    match player.compare.mode {
        Mode::Split => {
            full(left);
            let at = player.compare.divider;
            let x = area.left() + at * area.width();
            let part = Rect::from_min_max(pos2(x, area.top()), area.max);
            let uv = Rect::from_min_max(pos2(at, 0.0), pos2(1.0, 1.0));
            painter.image(second, part, uv, Color32::WHITE);
            tag(
                painter,
                place[0],
                Align2::LEFT_TOP,
                &title(&drawn.left, Some("A")),
            );
            tag(painter, place[1], Align2::RIGHT_TOP, &title(right, Some("B")));
        }
        Mode::Flicker => {
            let odd = (now * f64::from(player.compare.rate)).rem_euclid(2.0) >= 1.0;
            let (texture, picture, name) = if odd {
                (second, right, "B")
            } else {
                (left, &drawn.left, "A")
            };
            full(texture);
            tag(painter, place[0], Align2::LEFT_TOP, &title(picture, Some(name)));
        }
        Mode::Difference => {
            full(textures.difference.as_ref().map_or(left, TextureHandle::id));
            tag(
                painter,
                place[0],
                Align2::LEFT_TOP,
                &title(&drawn.left, Some("A")),
            );
            tag(painter, place[1], Align2::RIGHT_TOP, &title(right, Some("B")));
            scale_bar(painter, area);
        }
        Mode::Tile => {
            full(left);
            let share = vec2(
                right.size.x as f32 / drawn.left.size.x.max(1) as f32,
                right.size.y as f32 / drawn.left.size.y.max(1) as f32,
            );
            let part = Rect::from_center_size(area.center(), area.size() * share);
            painter.image(second, part, whole, Color32::WHITE);
            let frame = Stroke::new(1.5, Color32::from_white_alpha(200));
            painter.rect_stroke(part, CornerRadius::ZERO, frame, StrokeKind::Outside);
            tag(
                painter,
                place[0],
                Align2::LEFT_TOP,
                &title(&drawn.left, Some("A")),
            );
            let below = part.left_bottom() + vec2(0.0, 6.0);
            tag(painter, below, Align2::LEFT_TOP, &title(right, Some("B")));
        }
    }
    if let Some(flip) = error {
        let text = format!(
            "A against B: FLIP mean {:.4}, 95 % below {:.3}, largest {:.3}",
            flip.mean, flip.p95, flip.largest
        );
        tag(
            painter,
            area.right_bottom() - vec2(10.0, 10.0),
            Align2::RIGHT_BOTTOM,
            &text,
        );
    }
}

/// Renderer, time and size of a picture.
fn title(picture: &Picture, name: Option<&str>) -> String {
    let mut text = name.map_or_else(String::new, |name| format!("{name}  "));
    text += picture.renderer;
    text += &format!(
        "\n{}  ·  {} × {}",
        seconds(picture.seconds),
        picture.size.x,
        picture.size.y
    );
    if let Some(noise) = picture.noise {
        text += &format!("\n{} passes  ·  noise {:.1} %", picture.passes, 100.0 * noise);
    }
    text
}

/// A line or two on a dark plate.
fn tag(painter: &egui::Painter, at: egui::Pos2, anchor: Align2, text: &str) {
    let galley = painter.layout_no_wrap(
        text.to_owned(),
        FontId::proportional(13.0),
        Color32::from_gray(235),
    );
    let rect = anchor.anchor_size(at, galley.size() + vec2(14.0, 8.0));
    painter.rect_filled(rect, CornerRadius::same(4), Color32::from_black_alpha(165));
    painter.galley(rect.min + vec2(7.0, 4.0), galley, Color32::WHITE);
}

/// What the colours of a difference mean.
fn scale_bar(painter: &egui::Painter, area: Rect) {
    let size = vec2(180.0, 10.0);
    let bar = Rect::from_min_size(area.right_bottom() - size - vec2(24.0, 66.0), size);
    painter.rect_filled(
        bar.expand2(vec2(10.0, 8.0)).translate(vec2(0.0, 6.0)),
        CornerRadius::same(4),
        Color32::from_black_alpha(165),
    );
    for k in 0..45 {
        let [r, g, b, _] = heat(k as f32 / 44.0);
        let from = bar.left() + size.x * k as f32 / 45.0;
        let part = Rect::from_min_size(pos2(from, bar.top()), vec2(size.x / 45.0 + 0.5, size.y));
        painter.rect_filled(part, CornerRadius::ZERO, Color32::from_rgb(r, g, b));
    }
    for (at, text, anchor) in [
        (bar.left(), "0", Align2::LEFT_TOP),
        (bar.center().x, "FLIP", Align2::CENTER_TOP),
        (bar.right(), "1", Align2::RIGHT_TOP),
    ] {
        painter.text(
            pos2(at, bar.bottom() + 1.0),
            anchor,
            text,
            FontId::proportional(11.0),
            Color32::from_gray(220),
        );
    }
}

/// The movable divider; whether the pointer is at it.
fn divide(ui: &mut egui::Ui, area: Rect, player: &mut Player) -> bool {
    let x = area.left() + player.compare.divider * area.width();
    let grip = Rect::from_min_max(pos2(x - HANDLE, area.top()), pos2(x + HANDLE, area.bottom()));
    let response = ui.interact(grip, ui.scope_id().with("divider"), Sense::drag());
    if response.dragged() {
        let moved = response.drag_delta().x / area.width().max(1.0);
        player.compare.divider = (player.compare.divider + moved).clamp(0.02, 0.98);
    }
    let held = response.hovered() || response.dragged();
    if held {
        ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    let painter = ui.painter_at(area);
    let color = if held { style::ACCENT } else { Color32::WHITE };
    painter.line_segment(
        [pos2(x, area.top()), pos2(x, area.bottom())],
        Stroke::new(2.0, color),
    );
    let knob = Rect::from_center_size(pos2(x, area.center().y), vec2(10.0, 44.0));
    painter.rect(
        knob,
        CornerRadius::same(5),
        Color32::from_gray(245),
        Stroke::new(1.5, color),
        StrokeKind::Outside,
    );
    held
}

/// Turning, moving and flying the camera, and touching the water. Where the pointer meets it comes back.
fn hands(
    ui: &egui::Ui,
    response: &egui::Response,
    area: Rect,
    pixels: UVec2,
    player: &mut Player,
    now: f64,
) -> Option<Vec3> {
    let session = player.session.as_mut()?;
    let by = response.drag_delta() / area.height().max(1.0);
    let by = point(by.x, by.y);
    let shift = ui.input(|input| input.modifiers.shift);
    let tool = session.touch.tool;
    let look = tool == Tool::Look || tool == Tool::Probe || session.live().is_none();
    if response.dragged_by(PointerButton::Middle)
        || response.dragged_by(PointerButton::Primary) && look && shift
    {
        session.camera.pan(by);
    } else if response.dragged_by(PointerButton::Secondary)
        || response.dragged_by(PointerButton::Primary) && look
    {
        session.camera.orbit(by);
    }
    if response.hovered() || response.dragged() {
        let (scroll, pinch) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
        let factor = pinch * (0.0025 * scroll).exp();
        if (factor - 1.0).abs() > 1e-4 {
            session.camera.zoom(factor);
        }
    }
    fly(ui, &mut session.camera);
    let at = response.hover_pos().or_else(|| response.interact_pointer_pos())?;
    let place = point(
        (at.x - area.left()) / area.width(),
        (at.y - area.top()) / area.height(),
    );
    let (eye, direction) = session.camera.ray(place, pixels)?;
    let met = session
        .moment
        .as_ref()
        .and_then(|moment| probe::water(&moment.frame, eye, direction));
    if tool == Tool::Probe && response.clicked() {
        session.place_probe(met.map(|p| point(p.x, p.z)));
    }
    if let Some(p) = met.filter(|_| response.double_clicked() && look) {
        let eye = session.camera.position();
        session.camera = Camera::of(&meniscus_sim::render::View {
            position: eye,
            target: p,
            ..session.camera.view(pixels, 1)
        });
    }
    if !look && !shift {
        let (down, pressed) = ui.input(|input| {
            (
                input.pointer.primary_down(),
                input.pointer.button_pressed(PointerButton::Primary),
            )
        });
        player.touch(&Pointer {
            eye,
            direction,
            pressed: pressed && response.contains_pointer(),
            down: down && response.is_pointer_button_down_on(),
            now,
        });
        if down {
            ui.ctx().request_repaint();
        }
    }
    met
}

/// W, A, S, D, Q and E while the right button is down.
fn fly(ui: &egui::Ui, camera: &mut Camera) {
    let by = ui.input(|input| {
        let axis = |plus, minus| {
            f32::from(u8::from(input.key_down(plus))) - f32::from(u8::from(input.key_down(minus)))
        };
        let by = Vec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::W, Key::S));
        if input.pointer.secondary_down() {
            by * input.stable_dt.min(0.1)
        } else {
            Vec3::ZERO
        }
    });
    if by != Vec3::ZERO {
        camera.fly(0.8 * by);
        ui.ctx().request_repaint();
    }
}

/// The probe, and the reach of the tool around where the pointer meets the water.
fn marks(
    ui: &egui::Ui,
    painter: &egui::Painter,
    area: Rect,
    response: &egui::Response,
    player: &Player,
    met: Option<Vec3>,
) {
    let Some((session, moment)) = player
        .session
        .as_ref()
        .and_then(|s| s.moment.as_ref().map(|m| (s, m)))
    else {
        return;
    };
    let aspect = area.width() / area.height().max(1.0);
    let seen = |p: Vec3| {
        let place = session.camera.project(p, aspect)?;
        Some(pos2(
            area.left() + place.x * area.width(),
            area.top() + place.y * area.height(),
        ))
    };
    if let Some(place) = session.probe {
        let height = moment.frame.elevation.sample(place);
        if let Some(at) = seen(Vec3::new(place.x, height, place.y)) {
            painter.circle(at, 5.0, style::WARNING, Stroke::new(2.0, Color32::WHITE));
            tag(
                painter,
                at + vec2(10.0, -10.0),
                Align2::LEFT_BOTTOM,
                &format!("{height:+.4} m"),
            );
        }
    }
    let tool = session.touch.tool;
    if !tool.acts() || session.live().is_none() {
        return;
    }
    if response.hover_pos().is_none() {
        return;
    }
    ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
    let Some(centre) = met.filter(|_| tool.is_round()) else {
        return;
    };
    let ring: Vec<egui::Pos2> = (0..=48)
        .filter_map(|k| {
            let (sin, cos) = (std::f32::consts::TAU * k as f32 / 48.0).sin_cos();
            let p = point(
                centre.x + session.touch.radius * cos,
                centre.z + session.touch.radius * sin,
            );
            seen(Vec3::new(p.x, moment.frame.elevation.sample(p), p.y))
        })
        .collect();
    painter.line(ring, Stroke::new(1.5, Color32::from_white_alpha(190)));
}
