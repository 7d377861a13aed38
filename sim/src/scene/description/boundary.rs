//! The table `[boundary]`: what happens at the edges of the domain.

use super::path_text;
use serde::{Deserialize, Serialize, Serializer};
use std::path::PathBuf;

/// What happens at each edge of the domain.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Boundary {
    /// Edge at the smallest X.
    pub x_min: Edge,
    /// Edge at the largest X.
    pub x_max: Edge,
    /// Edge at the smallest Z.
    pub z_min: Edge,
    /// Edge at the largest Z.
    pub z_max: Edge,
    /// Edges at which the water is driven from outside; they take the place of what the edge does else.
    #[serde(rename = "drive", skip_serializing_if = "Vec::is_empty")]
    pub drives: Vec<Drive>,
}

/// Which edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum EdgeName {
    /// Smallest X.
    #[serde(rename = "x_min")]
    XMin,
    /// Largest X.
    #[serde(rename = "x_max")]
    XMax,
    /// Smallest Z.
    #[serde(rename = "z_min")]
    ZMin,
    /// Largest Z.
    #[serde(rename = "z_max")]
    ZMax,
}

/// What a time series gives at an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Driven {
    /// Elevation of the surface above datum, m.
    Elevation,
    /// Water that enters a metre of edge, m²/s.
    Discharge,
}

/// What drives the water at an edge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Drive {
    /// A time series.
    Series {
        /// Which edge.
        edge: EdgeName,
        /// What is given.
        quantity: Driven,
        /// The time series. A scene that is loaded holds its points instead.
        #[serde(
            default,
            skip_serializing_if = "Option::is_none",
            serialize_with = "optional_path"
        )]
        file: Option<PathBuf>,
        /// The time series.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        points: Vec<SeriesPoint>,
    },
    /// Regular waves about `water.level`.
    Sine {
        /// Which edge.
        edge: EdgeName,
        /// From trough to crest, metres.
        height: f32,
        /// Seconds.
        period: f32,
    },
    /// A solitary wave on water that stands at `water.level`.
    Solitary {
        /// Which edge.
        edge: EdgeName,
        /// Height of the crest above still water, metres.
        height: f32,
        /// Depth of the still water at the edge, metres.
        depth: f32,
        /// When the crest passes the edge, seconds.
        time: f64,
    },
}

impl Drive {
    /// The edge that is driven.
    pub fn edge(&self) -> EdgeName {
        match *self {
            Self::Series { edge, .. } | Self::Sine { edge, .. } | Self::Solitary { edge, .. } => edge,
        }
    }

    /// The file and the points of a time series.
    pub(crate) fn series(&self) -> Option<(&Option<PathBuf>, &Vec<SeriesPoint>)> {
        match self {
            Self::Series { file, points, .. } => Some((file, points)),
            Self::Sine { .. } | Self::Solitary { .. } => None,
        }
    }
}

impl Driven {
    /// Header of a file with such a series.
    pub(crate) fn header(self) -> &'static str {
        match self {
            Self::Elevation => "time_s,elevation_m",
            Self::Discharge => "time_s,discharge_m2_s",
        }
    }
}

/// A value at a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SeriesPoint {
    /// Seconds.
    pub time: f64,
    /// In the unit of what it is a series of.
    pub value: f64,
}

pub(super) fn optional_path<S: Serializer>(path: &Option<PathBuf>, serializer: S) -> Result<S::Ok, S::Error> {
    match path {
        Some(path) => path_text(path, serializer),
        None => serializer.serialize_none(),
    }
}

/// Behaviour of one edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Edge {
    /// Waves are reflected.
    #[default]
    Wall,
    /// Waves leave.
    Open,
    /// What leaves enters at the opposite edge, which must be periodic too.
    Periodic,
}
