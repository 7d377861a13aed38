//! Colours and spacing: quiet around the picture, so that the picture is what is seen.

use eframe::egui;
use egui::{Color32, CornerRadius, Stroke, Style, Theme, Visuals, vec2};

/// Colour of what is active.
pub(super) const ACCENT: Color32 = Color32::from_rgb(46, 134, 193);

/// Colour of recording and of errors.
pub(super) const ALARM: Color32 = Color32::from_rgb(214, 69, 65);

/// Colour of warnings.
pub(super) const WARNING: Color32 = Color32::from_rgb(222, 150, 40);

/// Behind the picture.
pub(super) const BACKDROP: Color32 = Color32::from_rgb(16, 18, 20);

/// Sets both themes.
pub(super) fn apply(ctx: &egui::Context) {
    ctx.style_mut_of(Theme::Dark, |style| {
        shape(style, Visuals::dark(), Color32::from_rgb(27, 30, 33))
    });
    ctx.style_mut_of(Theme::Light, |style| {
        shape(style, Visuals::light(), Color32::from_rgb(246, 247, 248))
    });
}

fn shape(style: &mut Style, visuals: Visuals, panel: Color32) {
    style.visuals = visuals;
    let v = &mut style.visuals;
    v.panel_fill = panel;
    v.window_fill = panel;
    v.selection.bg_fill = ACCENT;
    v.selection.stroke = Stroke::new(1.0, Color32::WHITE);
    v.hyperlink_color = ACCENT;
    v.slider_trailing_fill = true;
    for widget in [
        &mut v.widgets.inactive,
        &mut v.widgets.hovered,
        &mut v.widgets.active,
        &mut v.widgets.open,
    ] {
        widget.corner_radius = CornerRadius::same(4);
    }
    if let Some(small) = style.text_styles.get_mut(&egui::TextStyle::Small) {
        small.size = 11.5;
    }
    v.weak_text_alpha = 0.72;
    style.spacing.item_spacing = vec2(8.0, 5.0);
    style.spacing.button_padding = vec2(8.0, 3.0);
    style.spacing.interact_size.y = 24.0;
}
