//! What the window does, without a window: everything here runs and is tested headless.
//!
//! Three kinds of thread do the work, and none of them is the one that shows it: [`replay`] decodes frames, [`live`] runs
//! a solver, [`drawing`] draws pictures. They hand over what is newest through [`latest`], so that whoever is slow
//! drops frames and nobody waits. [`session`] ties them to a [`clock`], a [`camera`], [`history`] and [`messages`].

pub mod camera;
pub mod clip;
pub mod clock;
pub mod compare;
pub mod display;
pub mod drawing;
pub mod history;
pub mod latest;
pub mod live;
pub mod messages;
pub mod player;
pub mod probe;
pub mod quality;
pub mod recent;
pub mod renderers;
pub mod replay;
pub mod session;
pub mod tile;
pub mod tilting;
pub mod touch;

use meniscus_sim::{Frame, StepReport};
use std::sync::Arc;

/// A frame with what is known of its step.
#[derive(Clone, Debug)]
pub struct Moment {
    /// The frame.
    pub frame: Frame,
    /// Totals of the step that led to it.
    pub report: Option<StepReport>,
    /// Seconds of the clock that solving or decoding it took.
    pub seconds: f64,
}

/// Told when a thread has something new; the window redraws then.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// Wakes nobody.
pub fn nobody() -> Wake {
    Arc::new(|| {})
}
