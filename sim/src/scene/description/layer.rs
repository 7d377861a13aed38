//! `[[layer]]` and `[detail]`: what is laid over the water that the solver moves.

use super::{Solver, one};
use serde::{Deserialize, Serialize};

/// Waves of another method over the solver's water.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// The method and its parameters, as in `[solver]`.
    pub solver: Solver,
    /// Depth of the base's water in metres from which the layer is there in full; it fades towards the shore.
    #[serde(default = "one")]
    pub fade_depth: f32,
}

/// Small waves and wrinkles over the water, carried by it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Detail {
    /// Four octaves of gradient noise.
    Noise {
        /// Period of the tile in metres; a quarter of it is the longest wrinkle.
        period: f64,
        /// Standard deviation of the heights in metres.
        height: f64,
        /// How fast it changes, longest wrinkles a second.
        #[serde(default = "rate")]
        rate: f64,
        /// Seconds for which the water carries a pattern before it begins anew.
        #[serde(default = "lifetime")]
        lifetime: f64,
    },
    /// Short wind waves, a JONSWAP sea on deep water.
    Waves {
        /// Period of the tile in metres; longer waves are left out.
        period: f64,
        /// Wind speed 10 m above the water in m/s.
        wind: f64,
        /// Distance over which the wind has blown, metres.
        #[serde(default = "fetch")]
        fetch: f64,
        /// Direction of travel in degrees from +X towards +Z.
        #[serde(default)]
        direction: f64,
        /// Seconds for which the water carries a pattern before it begins anew.
        #[serde(default = "lifetime")]
        lifetime: f64,
    },
}

fn rate() -> f64 {
    0.5
}

fn lifetime() -> f64 {
    4.0
}

fn fetch() -> f64 {
    1000.0
}

impl Detail {
    /// Period of the tile in metres.
    pub fn period(&self) -> f64 {
        match *self {
            Self::Noise { period, .. } | Self::Waves { period, .. } => period,
        }
    }

    /// Seconds for which the water carries a pattern before it begins anew.
    pub fn lifetime(&self) -> f64 {
        match *self {
            Self::Noise { lifetime, .. } | Self::Waves { lifetime, .. } => lifetime,
        }
    }
}
