//! The tables `[[event]]`: what acts on the water, and when.

use super::boundary::{SeriesPoint, optional_path};
use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Something that acts on the water at a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Event {
    /// One action at one moment.
    Drop {
        /// Seconds.
        time: f64,
        /// Centre in metres.
        position: Vec2,
        /// Radius in metres.
        radius: f32,
        /// Volume in m³.
        volume: f32,
    },
    /// The surface is pressed down once without adding water.
    Press {
        /// Seconds.
        time: f64,
        /// Centre in metres.
        position: Vec2,
        /// Radius in metres.
        radius: f32,
        /// Depth at the centre in metres.
        depth: f32,
    },
    /// A horizontal push.
    Push {
        /// Seconds.
        time: f64,
        /// Centre in metres.
        position: Vec2,
        /// Radius in metres.
        radius: f32,
        /// Change of velocity at the centre in m/s.
        velocity: Vec2,
    },
    /// A hand that holds a free object (in particles, any object) and pulls it along a line, then lets go.
    Drag {
        /// First moment, seconds.
        start: f64,
        /// Last moment, seconds.
        end: f64,
        /// Name of the object.
        body: String,
        /// Where the hand holds it, in the object's axes, metres.
        #[serde(default)]
        grip: Vec3,
        /// Where the hand begins, metres.
        from: Vec3,
        /// Where it ends, metres.
        to: Vec3,
    },
    /// A sudden push of a free object.
    Shove {
        /// Seconds.
        time: f64,
        /// Name of the object.
        body: String,
        /// Change of its velocity in m/s.
        velocity: Vec3,
        /// Change of its angular velocity in rad/s, world axes.
        #[serde(default)]
        spin: Vec3,
    },
    /// Gravity turns at once, as when a vessel is tilted.
    Tilt {
        /// Seconds.
        time: f64,
        /// Gravity from then on, m/s².
        gravity: Vec3,
    },
    /// A depression that travels from one point to another, pressing as it goes (a boat's path, a gust).
    Sweep {
        /// First moment, seconds.
        start: f64,
        /// Last moment, seconds.
        end: f64,
        /// Where it begins, metres.
        from: Vec2,
        /// Where it ends, metres.
        to: Vec2,
        /// Radius in metres.
        radius: f32,
        /// Rate at which the surface is pressed down at the centre, m/s.
        rate: f32,
    },
    /// A spring or a river's mouth: water flows in.
    Inflow {
        /// First moment, seconds.
        #[serde(default)]
        start: f64,
        /// Last moment, seconds; default: to the end.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        end: Option<f64>,
        /// Centre in metres.
        position: Vec2,
        /// Radius in metres.
        radius: f32,
        /// Steady flow in m³/s; negative drains.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        flow: Option<f32>,
        /// Time series of the flow. A scene that is loaded holds its points instead.
        #[serde(
            default,
            skip_serializing_if = "Option::is_none",
            serialize_with = "optional_path"
        )]
        series: Option<PathBuf>,
        /// Flow in m³/s by time, in place of a steady one.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        points: Vec<SeriesPoint>,
    },
    /// Rain: drops at random places and times.
    Rain {
        /// First moment, seconds.
        #[serde(default)]
        start: f64,
        /// Last moment, seconds; default: to the end.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        end: Option<f64>,
        /// Drops a second over the whole domain.
        rate: f32,
        /// Radius of the bump that a drop makes, metres.
        radius: f32,
        /// Volume of a drop in m³.
        volume: f32,
        /// Whether drops add water (`false` presses the surface instead, so that the volume stays).
        #[serde(default)]
        adds_water: bool,
    },
}
