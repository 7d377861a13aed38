//! The keys.

use eframe::egui::{self, RichText};

/// Keys and what they do, in two columns: of playing, and of looking and touching.
const KEYS: [(&str, [(&str, &str); 13]); 2] = [
    (
        "Playing",
        [
            ("Space", "play or pause"),
            ("Left, Right", "a frame back or on"),
            ("Shift+Left, Right", "a second back or on"),
            ("J K L", "play back, stop, play; again: faster"),
            ("Shift+L", "play a recording in a loop"),
            ("Up, Down", "faster, slower"),
            ("Home, End", "first and last frame; Home begins a live run again"),
            ("R", "record a live run, finish the recording"),
            ("O", "open; a file may be dropped onto the window too"),
            ("S", "save the picture as PNG, here"),
            ("P", "plots"),
            ("H", "panel at the side"),
            ("Ctrl Q", "close; a recording is finished first"),
        ],
    ),
    (
        "Looking and touching",
        [
            ("Drag", "turn; with Shift or the middle button: move"),
            ("Wheel", "nearer, farther"),
            ("Right button", "turn; with W A S D Q E: fly"),
            ("Double click", "turn about that place"),
            ("1 to 9", "cameras"),
            ("Panel, Touch the water", "what dragging does instead of turning"),
            ("Esc", "back to turning the camera"),
            ("C", "compare with a renderer or a recording"),
            ("M", "split, flicker, difference, tile"),
            ("F", "full screen"),
            ("T", "light or dark colours"),
            ("Ctrl +, Ctrl -", "larger and smaller letters"),
            ("F1, ?", "these keys"),
        ],
    ),
];

/// Points that the list takes where there is room.
const MOST: egui::Vec2 = egui::vec2(940.0, 480.0);

pub(in super::super) fn show(ctx: &egui::Context, open: &mut bool) {
    egui::Window::new("Keys")
        .open(open)
        .collapsible(false)
        .resizable(false)
        .anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0])
        .show(ctx, |ui| {
            let room = ctx.content_rect().size() - egui::vec2(40.0, 80.0);
            egui::ScrollArea::both()
                .max_width(room.x)
                .max_height(room.y)
                .min_scrolled_width(room.x.min(MOST.x))
                .min_scrolled_height(room.y.min(MOST.y))
                .show(ui, |ui| {
                    ui.horizontal_top(|ui| {
                        for (title, keys) in KEYS {
                            ui.vertical(|ui| column(ui, title, &keys));
                            ui.add_space(12.0);
                        }
                    });
                });
        });
}

fn column(ui: &mut egui::Ui, title: &str, keys: &[(&str, &str)]) {
    ui.label(RichText::new(title).weak());
    egui::Grid::new(title)
        .num_columns(2)
        .striped(true)
        .spacing([18.0, 6.0])
        .show(ui, |ui| {
            for (keys, what) in keys {
                ui.label(RichText::new(*keys).strong());
                ui.label(*what);
                ui.end_row();
            }
        });
}
