//! What is compared with what, how far they are apart, and what each costs.

use super::super::super::model::player::{Mode, Player};
use super::super::super::viewer::Layout;
use super::super::bar::name_of;
use super::super::{fact, seconds};
use super::renderers;
use eframe::egui::{self, RichText};

pub(super) fn show(ui: &mut egui::Ui, player: &mut Player, layout: &mut Layout) {
    ui.horizontal(|ui| {
        for (mode, name, hint) in Mode::ALL {
            ui.selectable_value(&mut player.compare.mode, mode, name)
                .on_hover_text(format!("{hint} (M: the next)"));
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
