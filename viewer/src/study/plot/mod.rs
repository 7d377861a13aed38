//! The figures of a study: log-log curves and maps, as SVG that works on light and dark paper.

mod axis;
mod canvas;
mod curves;
mod map;
mod place;
pub(crate) mod theme;

pub(crate) use axis::number;
pub(crate) use canvas::DrawError;
pub(crate) use curves::{Chart, Sample, Series};
pub use map::{Cell, CellKind, Map};
