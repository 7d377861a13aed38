//! The keys.

use eframe::egui::{self, RichText};

const KEYS: [(&str, &str); 23] = [
    ("Space", "play or pause"),
    ("Left, Right", "a frame back or on"),
    ("Shift+Left, Right", "a second back or on"),
    ("J K L", "play back, stop, play; again: faster"),
    ("Shift+L", "play a recording in a loop"),
    ("Up, Down", "faster, slower"),
    ("Home, End", "first and last frame; Home begins a live run again"),
    ("R", "record a live run, finish the recording"),
    ("1 to 9", "cameras"),
    ("Drag", "turn; with Shift or the middle button: move"),
    ("Wheel", "nearer, farther"),
    ("Right button + W A S D Q E", "fly"),
    ("Double click", "turn about that place"),
    ("C", "compare"),
    ("M", "split, flicker, difference, tile"),
    ("P", "plots"),
    ("H", "panel at the side"),
    ("S", "save the picture"),
    ("O", "open"),
    ("F, T", "full screen; light or dark"),
    ("Ctrl +, Ctrl -", "larger and smaller letters"),
    ("Ctrl Q", "close; a recording is finished first"),
    ("Esc", "back to turning the camera"),
];

pub(in super::super) fn show(ctx: &egui::Context, open: &mut bool) {
    egui::Window::new("Keys")
        .open(open)
        .collapsible(false)
        .resizable(false)
        .anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0])
        .show(ctx, |ui| {
            egui::Grid::new("keys")
                .num_columns(2)
                .striped(true)
                .spacing([24.0, 6.0])
                .show(ui, |ui| {
                    for (keys, what) in KEYS {
                        ui.label(RichText::new(keys).strong());
                        ui.label(what);
                        ui.end_row();
                    }
                });
        });
}
