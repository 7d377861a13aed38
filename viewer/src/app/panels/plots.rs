//! Plots against time.

use super::super::model::history::{QUANTITIES, Row};
use super::super::model::player::{Player, free_name};
use super::super::style;
use super::super::viewer::Layout;
use eframe::egui::{self, Color32, RichText};
use egui_plot::{Legend, Line, Plot, PlotPoints, VLine};
use std::path::Path;

/// Most points of a curve: more would not be seen.
const MOST_POINTS: usize = 600;

/// Colours of the curves of a plot.
const COLORS: [Color32; 2] = [style::ACCENT, style::WARNING];

pub(in super::super) fn show(ui: &mut egui::Ui, player: &mut Player, layout: &mut Layout, folder: &Path) {
    let mut save = false;
    ui.horizontal_wrapped(|ui| {
        for (quantity, shown) in QUANTITIES.iter().zip(&mut layout.plotted) {
            ui.toggle_value(shown, quantity.title);
        }
        ui.separator();
        save = ui
            .button("CSV")
            .on_hover_text("Save all of them as a table")
            .clicked();
        if let Some(session) = &mut player.session
            && ui.button("Clear").clicked()
        {
            session.history.clear();
        }
    });
    if save {
        write(player, folder);
    }
    let Some(session) = &player.session else { return };
    let shown: Vec<_> = QUANTITIES
        .iter()
        .zip(&layout.plotted)
        .filter(|(_, on)| **on)
        .collect();
    if shown.is_empty() {
        ui.label(RichText::new("choose what to plot").weak());
        return;
    }
    let rows: Vec<&Row> = session.history.rows().collect();
    let now = session.moment.as_ref().map(|moment| moment.frame.time);
    let width = (ui.available_width() / shown.len() as f32 - ui.spacing().item_spacing.x).max(120.0);
    let height = (ui.available_height() - 24.0).max(60.0);
    egui::ScrollArea::horizontal().show(ui, |ui| {
        ui.horizontal(|ui| {
            for (quantity, _) in shown {
                let unit = quantity.unit;
                let mut plot = Plot::new(quantity.title)
                    .width(width)
                    .height(height)
                    .allow_scroll(false)
                    .allow_drag(false)
                    .allow_zoom(false)
                    .allow_boxed_zoom(false)
                    .y_axis_min_width(44.0);
                if quantity.curves.len() > 1 {
                    plot = plot.legend(Legend::default().background_alpha(0.6));
                }
                // Above the plot: along its axis a long name would reach beyond it.
                let title = if unit.is_empty() {
                    format!("{} over s", quantity.title)
                } else {
                    format!("{} in {unit} over s", quantity.title)
                };
                ui.vertical(|ui| {
                    ui.label(RichText::new(title).small());
                    plot.show(ui, |plot| {
                        for ((name, read), color) in quantity.curves.iter().zip(COLORS) {
                            plot.line(Line::new(*name, points(&rows, *read)).color(color).width(1.5));
                        }
                        if let Some(now) = now {
                            plot.vline(
                                VLine::new("", now)
                                    .color(Color32::GRAY)
                                    .width(1.0)
                                    .allow_hover(false),
                            );
                        }
                    });
                });
            }
        });
    });
}

/// A curve of at most [`MOST_POINTS`]: of each group of rows the lowest and the highest.
fn points(rows: &[&Row], read: fn(&Row) -> Option<f64>) -> PlotPoints<'static> {
    let group = (2 * rows.len()).div_ceil(MOST_POINTS).max(1);
    let mut points = Vec::with_capacity(MOST_POINTS + 2);
    for rows in rows.chunks(group) {
        let values = rows.iter().filter_map(|row| Some((row.time, read(row)?)));
        let mut extremes: Option<[(f64, f64); 2]> = None;
        for value in values {
            let [low, high] = extremes.get_or_insert([value, value]);
            if value.1 < low.1 {
                *low = value;
            }
            if value.1 > high.1 {
                *high = value;
            }
        }
        if let Some([a, b]) = extremes {
            let (first, second) = if a.0 <= b.0 { (a, b) } else { (b, a) };
            points.push([first.0, first.1]);
            if second != first {
                points.push([second.0, second.1]);
            }
        }
    }
    PlotPoints::from(points)
}

fn write(player: &mut Player, folder: &Path) {
    let Some(session) = &player.session else { return };
    let stem = session
        .path
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let path = free_name(folder, &stem, "csv");
    match session.history.write_csv(&path) {
        Ok(()) => player.messages.note(format!("saved {}", path.display())),
        Err(error) => player.messages.error(error),
    }
}
