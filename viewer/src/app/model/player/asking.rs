//! When the player asks for a picture, and of what.

use super::super::camera::Camera;
use super::super::drawing::Order;
use super::super::quality::{Quality, divided};
use super::{Mode, Player, REST};
use meniscus_sim::glam::UVec2;
use meniscus_sim::knobs::Turned;

/// What a picture depends on besides its size.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Inputs {
    pub(super) time: f64,
    pub(super) frame: u64,
    pub(super) camera: Camera,
    pub(super) pixels: UVec2,
    pub(super) renderers: String,
    pub(super) exposure: f32,
    pub(super) quality: Quality,
    pub(super) difference: bool,
    /// Which session, counted from the first.
    pub(super) session: u64,
    /// Whether the second picture's frame is there.
    pub(super) complete: bool,
}

impl Player {
    /// What the picture depends on now.
    fn inputs(&self, pixels: UVec2) -> Option<Inputs> {
        let session = self.session.as_ref()?;
        let moment = session.moment.as_ref()?;
        let mut renderers = self.named(&self.renderer);
        let mut complete = true;
        if self.compare.on {
            let other = self.compare.other && session.other.is_some();
            complete = !other || session.other_side(&self.renderer, &Turned::new()).is_some();
            renderers += if other { " | the other recording" } else { " | " };
            renderers += if self.tiles() { "in a tile, " } else { "" };
            renderers += &self.named(&self.compare.renderer);
        }
        Some(Inputs {
            time: moment.frame.time,
            frame: moment.frame.index,
            camera: session.camera,
            pixels,
            renderers,
            exposure: session.exposure,
            quality: self.quality,
            difference: self.compare.on,
            session: self.sessions,
            complete,
        })
    }

    /// A renderer's name, with what was changed of it.
    pub(super) fn named(&self, renderer: &str) -> String {
        match self.turned.get(renderer) {
            Some(turned) => format!("{renderer} {turned:?}"),
            None => renderer.to_owned(),
        }
    }

    /// Whether the second picture is a tile of the first.
    fn tiles(&self) -> bool {
        self.compare.on && self.compare.mode == Mode::Tile
    }

    /// Orders a picture if anything changed, and a better one when nothing does any more.
    pub(super) fn ask(&mut self, pixels: UVec2) {
        let Some(inputs) = self.inputs(pixels).filter(|_| pixels.min_element() > 0) else {
            return;
        };
        let fresh = self.last.as_ref() != Some(&inputs);
        if fresh {
            self.changed = self.now;
            self.rested = false;
            // One that moves is drawn to its end, so that something is seen.
            if self.ordered.is_none_or(|(_, at_rest)| at_rest) && self.order(&inputs, false) {
                self.last = Some(inputs);
            }
        } else if !self.rested && self.ordered.is_none() && self.now - self.changed >= REST {
            self.rested = self.order(&inputs, true);
        }
    }

    fn order(&mut self, inputs: &Inputs, at_rest: bool) -> bool {
        let divisor = match self.quality {
            Quality::Full => 1,
            Quality::Half => 2,
            Quality::Quarter => 4,
            Quality::Auto if at_rest => self.pace.rest().0,
            Quality::Auto => self.pace.divisor(inputs.pixels, &inputs.renderers),
        };
        let Some(session) = &self.session else {
            return false;
        };
        let turned = |renderer: &str| self.turned.get(renderer).cloned().unwrap_or_default();
        let Some(left) = session.side(&self.renderer, &turned(&self.renderer)) else {
            return false;
        };
        let tile = self.tiles();
        let right = match (self.compare.on && (at_rest || !tile), self.compare.other) {
            (false, _) => None,
            (true, true) => session.other_side(&self.renderer, &turned(&self.renderer)),
            (true, false) => session.side(&self.compare.renderer, &turned(&self.compare.renderer)),
        };
        let samples = if at_rest { self.pace.rest().1 } else { 1 };
        self.number += 1;
        self.drawing.order(Order {
            number: self.number,
            left,
            right,
            tile,
            difference: inputs.difference,
            view: session.camera.view(divided(inputs.pixels, divisor), samples),
            exposure: session.exposure,
            at_rest,
            read: self.shot.is_some(),
        });
        self.ordered = Some((self.number, at_rest));
        true
    }
}
