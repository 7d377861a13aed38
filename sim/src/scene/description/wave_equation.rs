//! Parameters of `solver.kind = "wave-equation"`.

use super::one;
use serde::{Deserialize, Serialize};

/// Parameters of the wave equation, ∂²η/∂t² = ∇·(c² ∇η) − damping ∂η/∂t.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaveEquation {
    /// Distance between samples in metres.
    pub spacing: f32,
    /// How time is stepped.
    #[serde(default)]
    pub scheme: WaveScheme,
    /// Wave speed in m/s; default: √(g · depth), from the terrain where there is one, else from `depth`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed: Option<f32>,
    /// Depth in metres that sets the speed where there is no terrain.
    #[serde(default = "one")]
    pub depth: f32,
    /// Rate at which motion is damped, 1/s.
    #[serde(default)]
    pub damping: f32,
    /// Longest sub-step in seconds; default: as long as the scheme allows. The explicit scheme refuses a value above
    /// its Courant limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<f32>,
}

/// How the wave equation is stepped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WaveScheme {
    /// Leap-frog, second order, with a Courant limit.
    #[default]
    Explicit,
    /// Alternating directions after Kass & Miller 1990, stable at any step; second order, conserves energy.
    Implicit,
    /// The same stepped backwards in time, as Kass & Miller did: first order, damps waves that the step is too long
    /// for.
    ImplicitDamped,
}
