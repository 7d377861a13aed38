//! The table `[horizon]`: the room of pictures that the renderer `horizon` hangs around the water.

use super::one;
use serde::{Deserialize, Serialize};

/// How the renderer `horizon` sees the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Horizon {
    /// Distance of the walls from the edges of the domain in metres; default: half its longer side.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distance: Option<f32>,
    /// Depth of the floor below the water's level in metres, where the scene has no terrain; default: a tenth of the
    /// domain's longer side.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth: Option<f32>,
    /// Share of the reflected picture in the colour of the water, 0 to 1; default: what Fresnel's equations say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mix: Option<f32>,
    /// Factor on the light of the floor; less than 1 makes the water oily.
    #[serde(default = "one")]
    pub floor: f32,
    /// How the normal between the vertices of the water's mesh is found.
    pub normals: NormalBlend,
}

impl Default for Horizon {
    fn default() -> Self {
        Self {
            distance: None,
            depth: None,
            mix: None,
            floor: 1.0,
            normals: NormalBlend::default(),
        }
    }
}

/// Normals between the vertices of a mesh of quadrilaterals.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NormalBlend {
    /// One a face.
    Face,
    /// Those of the corners, weighted by the reciprocal of the distance to each.
    Distance,
    /// Those of the corners, each weighted by the area of the rectangle between the point and the corner opposite.
    #[default]
    Area,
}
