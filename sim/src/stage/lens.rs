//! The rays of a view.

use crate::render::{Image, RenderError, View};
use glam::{DVec2, DVec3};

/// The rays of a view.
#[derive(Clone, Copy, Debug)]
pub struct Lens {
    /// Where they start, metres.
    pub eye: DVec3,
    /// Unit direction of the view.
    pub forward: DVec3,
    /// World vectors from the picture's centre to its right and upper edge, at unit distance along the view.
    pub right: DVec3,
    /// See `right`.
    pub up: DVec3,
    size: DVec2,
    /// Angle that one pixel covers at the centre of the picture, radians.
    pub pixel_angle: f64,
}

impl Lens {
    /// Checks a view and prepares its rays.
    ///
    /// # Errors
    /// [`RenderError::View`].
    pub fn new(view: &View) -> Result<Self, RenderError> {
        let bad = |what: String, remedy| Err(RenderError::View { what, remedy });
        let View {
            position,
            target,
            up,
            vertical_fov,
            size,
            samples,
            pass: _,
        } = *view;
        if size.min_element() == 0 || size.max_element() > Image::MAX_SIDE {
            return bad(
                format!("image of {} x {} pixels", size.x, size.y),
                "each side must be 1 to 16384 pixels",
            );
        }
        if samples == 0 {
            return bad("0 samples a pixel".into(), "ask for at least 1");
        }
        if !(position.is_finite() && target.is_finite() && up.is_finite()) {
            return bad(
                "position, target or up is not finite".into(),
                "give finite numbers",
            );
        }
        if !(vertical_fov > 0.0 && vertical_fov < std::f32::consts::PI) {
            return bad(
                format!("vertical angle of view of {vertical_fov} rad"),
                "it must lie between 0 and pi (180 degrees), both excluded",
            );
        }
        let eye = position.as_dvec3();
        let Some(forward) = (target.as_dvec3() - eye).try_normalize() else {
            return bad(
                format!("the camera looks at its own position {position}"),
                "give a target away from the position",
            );
        };
        let side = forward.cross(up.as_dvec3());
        if side.length() < 1e-9 * up.as_dvec3().length().max(1e-300) {
            return bad(
                format!("up {up} is parallel to the view"),
                "give an up direction across the view",
            );
        }
        let side = side.normalize();
        let tan_y = (0.5 * f64::from(vertical_fov)).tan();
        let size = size.as_dvec2();
        Ok(Self {
            eye,
            forward,
            right: side * (tan_y * size.x / size.y),
            up: side.cross(forward) * tan_y,
            size,
            pixel_angle: 2.0 * tan_y / size.y,
        })
    }

    /// Unit direction through the point `(x, y)` of the picture, in pixels from the top left.
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        let u = 2.0 * x / self.size.x - 1.0;
        let v = 1.0 - 2.0 * y / self.size.y;
        (self.forward + u * self.right + v * self.up).normalize()
    }
}
