//! What an adapter cannot hold, refused before anything is made.

use crate::device::Gpu;
use crate::facts::Facts;
use meniscus_sim::render::RenderError;

/// Refuses what the adapter cannot hold.
pub(crate) fn check_limits(gpu: &Gpu, facts: &Facts) -> Result<(), RenderError> {
    let limits = gpu.limits();
    let name = &gpu.description.name;
    let side = facts.size[0].max(facts.size[1]);
    if side > limits.max_texture_dimension_2d {
        return Err(RenderError::Unsupported {
            what: format!(
                "an image of {} x {} pixels: adapter `{name}` holds textures of at most {} a side",
                facts.size[0], facts.size[1], limits.max_texture_dimension_2d
            ),
            remedy: "choose a smaller image, or use `whitted`".to_owned(),
        });
    }
    let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let pixels = u64::from(facts.size[0]) * u64::from(facts.size[1]);
    for (what, bytes, remedy) in [
        (
            "the heights of water and ground",
            4 * facts.height_words(),
            "choose a coarser spacing",
        ),
        (
            "the objects",
            16 * u64::from(facts.solid_rows),
            "choose models of fewer triangles",
        ),
        ("the image", 16 * pixels, "choose a smaller image"),
    ] {
        if bytes > most {
            return Err(RenderError::Unsupported {
                what: format!("{what} take {bytes} bytes: adapter `{name}` holds buffers of at most {most}"),
                remedy: format!("{remedy}, or use `whitted`"),
            });
        }
    }
    if let Some([w, h]) = facts
        .sky
        .filter(|s| s[0].max(s[1]) > limits.max_texture_dimension_2d)
    {
        return Err(RenderError::Unsupported {
            what: format!(
                "a sky of {w} x {h} pixels: adapter `{name}` holds textures of at most {} a side",
                limits.max_texture_dimension_2d
            ),
            remedy: "choose a smaller picture, or use `whitted`".to_owned(),
        });
    }
    Ok(())
}
