//! Buttons with the signs of players, drawn: no font needs to have them.

use eframe::egui::{self, Pos2, Rect, Response, Role, Sense, Shape, Stroke, WidgetInfo, pos2, vec2};

/// A sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Icon {
    First,
    Back,
    Play,
    Pause,
    On,
    Last,
}

/// A button with a sign, named for whoever cannot see it.
pub(super) fn button(ui: &mut egui::Ui, icon: Icon, name: &str, width: f32, enabled: bool) -> Response {
    let sense = if enabled { Sense::click() } else { Sense::hover() };
    let (area, response) = ui.allocate_exact_size(vec2(width, 26.0), sense);
    response.widget_info(|| WidgetInfo::labeled(Role::Button, enabled, name));
    let visuals = ui.style().interact(&response);
    let painter = ui.painter_at(area);
    painter.rect_filled(area.shrink(1.0), visuals.corner_radius, visuals.weak_bg_fill);
    let color = if enabled {
        visuals.fg_stroke.color
    } else {
        ui.visuals().weak_text_color().gamma_multiply(0.5)
    };
    let c = area.center();
    let triangle = |x: f32, to: f32| {
        let corners: Vec<Pos2> = vec![
            pos2(x - 4.0 * to, c.y - 6.0),
            pos2(x - 4.0 * to, c.y + 6.0),
            pos2(x + 6.0 * to, c.y),
        ];
        Shape::convex_polygon(corners, color, Stroke::NONE)
    };
    let bar = |x: f32| {
        let rect = Rect::from_center_size(pos2(x, c.y), vec2(2.5, 12.0));
        Shape::rect_filled(rect, 1.0, color)
    };
    let shapes = match icon {
        Icon::First => vec![bar(c.x - 5.5), triangle(c.x + 2.0, -1.0)],
        Icon::Back => vec![triangle(c.x - 2.0, -1.0), bar(c.x + 5.0)],
        Icon::Play => vec![triangle(c.x - 0.5, 1.2)],
        Icon::Pause => vec![bar(c.x - 3.5), bar(c.x + 3.5)],
        Icon::On => vec![bar(c.x - 5.0), triangle(c.x + 2.0, 1.0)],
        Icon::Last => vec![triangle(c.x - 2.0, 1.0), bar(c.x + 5.5)],
    };
    painter.extend(shapes);
    response
}
