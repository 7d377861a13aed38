//! The table `[boundary]`: what happens at the edges of the domain.

use serde::{Deserialize, Serialize};

/// What happens at each edge of the domain.
#[derive(Clone, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
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
