//! Plots against time.

use super::super::model::history::{History, PROBED, Quantity, Read, Row, TITLES};
use super::super::model::player::{Player, free_name};
use super::super::style;
use super::super::viewer::Layout;
use eframe::egui::{self, Color32, Rangef, RichText};
use egui_plot::{AxisHints, Legend, Line, Plot, PlotPoint, PlotPoints, VLine};
use std::path::Path;
use std::time::{Duration, Instant};

/// Most points of a curve: more would not be seen.
const MOST_POINTS: usize = 600;

/// Points between two numbers of the axis of time at which they appear and are plain: a plot is narrow, and should have
/// more than one.
const TIME_SPACING: Rangef = Rangef { min: 28.0, max: 40.0 };

/// Colours of the curves of a plot.
const COLORS: [Color32; 8] = [
    style::ACCENT,
    style::WARNING,
    Color32::from_rgb(120, 170, 90),
    Color32::from_rgb(190, 110, 170),
    Color32::from_rgb(110, 120, 200),
    Color32::from_rgb(200, 90, 80),
    Color32::from_rgb(90, 170, 170),
    Color32::from_rgb(150, 140, 100),
];

/// Rows from which on curves are made anew only when another point of theirs is due.
const MANY_ROWS: usize = 1000;

/// Changes of a history that come with a row: what was solved, in which stages, and what was drawn.
const CHANGES_A_ROW: u64 = 3;

/// After which they are made anew at the latest.
const NOW_AND_THEN: Duration = Duration::from_secs(2);

/// What curves were made from: the session, its changes and which of them are plotted.
type Basis = (u64, u64, Vec<bool>);

/// The curves as they are drawn, kept while nothing that they show changes.
#[derive(Default)]
pub(in super::super) struct Curves {
    made: Option<(Basis, Instant)>,
    quantities: Vec<Quantity>,
    /// A list of curves for each quantity.
    points: Vec<Vec<Vec<PlotPoint>>>,
}

impl Curves {
    fn update(&mut self, session: u64, history: &History, plotted: &[bool]) {
        let basis = (session, history.changes(), plotted.to_vec());
        let few =
            |changes: u64| basis.1.saturating_sub(changes) < CHANGES_A_ROW * group(history.len()) as u64;
        let stands = self
            .made
            .as_ref()
            .is_some_and(|((number, changes, shown), made)| {
                *number == session
                    && shown.as_slice() == plotted
                    && (*changes == basis.1
                        || history.len() > MANY_ROWS && few(*changes) && made.elapsed() < NOW_AND_THEN)
            });
        if stands {
            return;
        }
        let rows: Vec<&Row> = history.rows().collect();
        let of = |(quantity, on): (&Quantity, &bool)| {
            let curves = quantity.curves.iter().filter(|_| *on);
            curves.map(|(_, read)| points(&rows, *read)).collect()
        };
        self.quantities = history.quantities();
        self.points = self.quantities.iter().zip(plotted).map(of).collect();
        self.made = Some((basis, Instant::now()));
    }
}

pub(in super::super) fn show(
    ui: &mut egui::Ui,
    player: &mut Player,
    layout: &mut Layout,
    curves: &mut Curves,
    folder: &Path,
) {
    let mut save = false;
    let probed = player
        .session
        .as_ref()
        .is_some_and(|session| session.probe.is_some());
    ui.horizontal_wrapped(|ui| {
        for (title, shown) in TITLES.iter().zip(&mut layout.plotted) {
            let choice = ui.toggle_value(shown, *title);
            if *title == PROBED && !probed {
                choice.on_hover_text("Place it first: Probe, under Touch the water, then click the water");
            }
        }
        ui.separator();
        save = ui
            .button("CSV")
            .on_hover_text("Save all of them as a table, a row a frame")
            .clicked();
        if let Some(session) = &mut player.session
            && ui
                .button("Clear")
                .on_hover_text("Forget what was plotted so far")
                .clicked()
        {
            session.history.clear();
        }
    });
    if save {
        write(player, folder);
    }
    let number = player.session_number();
    let Some(session) = &player.session else { return };
    curves.update(number, &session.history, &layout.plotted);
    let shown: Vec<_> = curves
        .quantities
        .iter()
        .zip(&curves.points)
        .zip(&layout.plotted)
        .filter(|(_, on)| **on)
        .map(|(shown, _)| shown)
        .collect();
    if shown.is_empty() {
        ui.label(RichText::new("choose what to plot").weak());
        return;
    }
    let now = session.moment.as_ref().map(|moment| moment.frame.time);
    let width = (ui.available_width() / shown.len() as f32 - ui.spacing().item_spacing.x).max(120.0);
    let height = (ui.available_height() - 24.0).max(60.0);
    egui::ScrollArea::horizontal().show(ui, |ui| {
        ui.horizontal(|ui| {
            for (quantity, points) in shown {
                let unit = quantity.unit;
                let mut plot = Plot::new(quantity.title)
                    .width(width)
                    .height(height)
                    .allow_scroll(false)
                    .allow_drag(false)
                    .allow_zoom(false)
                    .allow_boxed_zoom(false)
                    .custom_x_axes(vec![AxisHints::new_x().label_spacing(TIME_SPACING)])
                    .custom_y_axes(vec![AxisHints::new_y().min_thickness(44.0)]);
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
                        for (((name, _), points), color) in
                            quantity.curves.iter().zip(points).zip(COLORS.into_iter().cycle())
                        {
                            let points = PlotPoints::Borrowed(points);
                            plot.line(Line::new(*name, points).color(color).width(1.5));
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

/// Rows whose lowest and highest values are kept, of so many.
fn group(rows: usize) -> usize {
    (2 * rows).div_ceil(MOST_POINTS).max(1)
}

/// A curve of at most [`MOST_POINTS`]: of each group of rows the lowest and the highest.
fn points(rows: &[&Row], read: Read) -> Vec<PlotPoint> {
    let mut points = Vec::with_capacity(MOST_POINTS + 2);
    for rows in rows.chunks(group(rows.len())) {
        let values = rows.iter().filter_map(|row| Some((row.time, read.of(row)?)));
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
            points.push(PlotPoint::new(first.0, first.1));
            if second != first {
                points.push(PlotPoint::new(second.0, second.1));
            }
        }
    }
    points
}

fn write(player: &mut Player, folder: &Path) {
    let Some(session) = &player.session else { return };
    let path = free_name(folder, &session.stem(), "csv");
    match session.history.write_csv(&path) {
        Ok(()) => player.messages.note(format!("saved {}", path.display())),
        Err(error) => player.messages.error(error),
    }
}
