//! Parameters of `solver.kind = "ocean"`: what the sea is made of, how it is cut into patches, its foam.

use super::one_wide;
use serde::{Deserialize, Serialize};

/// Parameters of an ocean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ocean {
    /// Distance between samples in metres.
    pub spacing: f32,
    /// Depth of the water in metres, for dispersion, motion and the spectrum `tma`; absent: deep water.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth: Option<f64>,
    /// Whether surface tension counts.
    #[serde(default = "yes")]
    pub capillary: bool,
    /// Factor on the horizontal displacement: 0 for none, 1 for what linear theory says.
    #[serde(default = "one_wide")]
    pub choppiness: f64,
    /// Period in seconds after which everything repeats exactly; absent: never.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loop_period: Option<f64>,
    /// Wind seas and swells; their variances add.
    #[serde(default, rename = "sea", skip_serializing_if = "Vec::is_empty")]
    pub seas: Vec<Sea>,
    /// Periodic patches whose waves add up, each with a band of wave numbers of its own; absent: chosen for the domain.
    #[serde(default, rename = "cascade", skip_serializing_if = "Vec::is_empty")]
    pub cascades: Vec<Cascade>,
    /// Foam where the surface is pressed together; absent: none, at no cost.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub foam: Option<OceanFoam>,
}

fn yes() -> bool {
    true
}

/// One wind sea or swell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sea {
    /// Variance over frequency.
    #[serde(flatten)]
    pub spectrum: Spectrum,
    /// Mean direction of travel in degrees from +X towards +Z.
    #[serde(default)]
    pub direction: f64,
    /// Variance over direction.
    #[serde(default)]
    pub spreading: Spreading,
}

/// A frequency spectrum.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Spectrum {
    /// Phillips' spectrum as used since Tessendorf 2001, normalised to a given wave height: its constant is free, so it
    /// implies none.
    Phillips {
        /// Wind speed in m/s; sets the longest waves, L = U²/g.
        wind: f64,
        /// Significant wave height in metres.
        height: f64,
    },
    /// Pierson & Moskowitz 1964: a fully developed sea.
    PiersonMoskowitz {
        /// Wind speed 19.5 m above the sea in m/s.
        wind: f64,
    },
    /// JONSWAP (Hasselmann et al. 1973): a sea that the wind has had a limited fetch to raise.
    Jonswap {
        /// Wind speed 10 m above the sea in m/s.
        wind: f64,
        /// Distance over which the wind has blown, metres.
        fetch: f64,
        /// Peak enhancement; 3.3 is the mean of the experiment.
        #[serde(default = "default_gamma")]
        gamma: f64,
    },
    /// TMA (Bouws et al. 1985): JONSWAP in water of the ocean's depth.
    Tma {
        /// Wind speed 10 m above the sea in m/s.
        wind: f64,
        /// Distance over which the wind has blown, metres.
        fetch: f64,
        /// Peak enhancement.
        #[serde(default = "default_gamma")]
        gamma: f64,
    },
    /// A swell of given height and period: JONSWAP's form with a narrow peak, scaled to the height.
    Swell {
        /// Significant wave height in metres.
        height: f64,
        /// Period of the peak in seconds.
        period: f64,
        /// Peak enhancement; larger is narrower.
        #[serde(default = "default_swell_gamma")]
        gamma: f64,
    },
}

fn default_gamma() -> f64 {
    3.3
}

fn default_swell_gamma() -> f64 {
    8.0
}

/// How the energy of a frequency spreads over directions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Spreading {
    /// cos²ˢ(θ/2) with the exponent of Hasselmann, Dunckel & Ewing 1980.
    #[default]
    Hasselmann,
    /// cos²ˢ(θ/2) with the exponent of Mitsuyasu et al. 1975.
    Mitsuyasu,
    /// sech²(βθ) of Donelan, Hamilton & Hui 1985 with Banner's 1990 tail.
    DonelanBanner,
    /// cos²ˢ(θ/2) with one exponent for all frequencies (Longuet-Higgins et al. 1963).
    CosinePower {
        /// Exponent s, at least 0; 0 spreads evenly, 50 is a narrow swell.
        exponent: f64,
    },
    /// Hasselmann's exponent plus 16 tanh(ω_p/ω) elongation²: long crests at low frequencies (Horvath 2015).
    Swell {
        /// 0 is Hasselmann's spreading, 1 long parallel crests.
        elongation: f64,
    },
}

/// One periodic patch of an ocean.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cascade {
    /// Period along both axes in metres.
    pub period: f64,
}

/// How foam comes and goes: ∂f/∂t = growth · (threshold − J)₊ · (1 − f) − fade · f, with J the area that a surface
/// element has left, 1 at rest and 0 where it folds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OceanFoam {
    /// Foam grows where J is below this.
    pub threshold: f64,
    /// Rate of growth, 1/s, a unit of J below the threshold.
    pub growth: f64,
    /// Rate at which foam fades, 1/s.
    pub fade: f64,
}

impl Default for OceanFoam {
    fn default() -> Self {
        Self {
            threshold: 0.5,
            growth: 10.0,
            fade: 0.25,
        }
    }
}
