//! What the caller draws itself, among which the water stands.

use meniscus_sim::glam::{UVec2, Vec3};
use meniscus_sim::render::RenderError;

/// A picture of other geometry from the same view: it hides what lies behind it and is hidden by what lies before it. What of
/// it is behind the water's surface is hidden by the water; refracted rays do not meet it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Foreign {
    /// Width and height in pixels: that of the view.
    pub size: UVec2,
    /// Linear radiance that reaches the eye, row-major from the top left.
    pub radiance: Vec<Vec3>,
    /// Metres from the eye along the ray through the pixel's middle; infinite where there is nothing.
    pub distance: Vec<f32>,
}

impl Foreign {
    /// The rows that shaders read.
    ///
    /// # Errors
    /// [`RenderError::View`] if its size is not that of the view.
    pub(crate) fn rows(&self, size: UVec2) -> Result<Vec<[f32; 4]>, RenderError> {
        let pixels = size.x as usize * size.y as usize;
        if self.size != size || self.radiance.len() != pixels || self.distance.len() != pixels {
            return Err(RenderError::View {
                what: format!(
                    "the caller's layer has {} x {} pixels, {} radiances and {} distances for a view of {} x {} pixels",
                    self.size.x,
                    self.size.y,
                    self.radiance.len(),
                    self.distance.len(),
                    size.x,
                    size.y
                ),
                remedy: "draw the layer at the size of the view",
            });
        }
        let rows = self.radiance.iter().zip(&self.distance);
        Ok(rows.map(|(c, &t)| [c.x, c.y, c.z, t]).collect())
    }
}
