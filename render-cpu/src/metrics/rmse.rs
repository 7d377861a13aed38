//! Root mean square error of radiance.

use super::{MetricError, check};
use glam::{UVec2, Vec3};

/// Root mean square difference over all pixels (of the mask) and colours, in the units of the pictures. Unlike a mean it
/// is governed by the worst pixels: a few bright dots outweigh an even haze.
///
/// # Errors
/// [`MetricError`] if sizes differ or a value is not finite.
pub fn rmse(
    size: UVec2,
    reference: &[Vec3],
    test: &[Vec3],
    mask: Option<&[bool]>,
) -> Result<f64, MetricError> {
    check(size, reference, test)?;
    let (mut sum, mut count) = (0.0_f64, 0_usize);
    for (k, (a, b)) in reference.iter().zip(test).enumerate() {
        if mask.is_none_or(|m| m[k]) {
            sum += (a.as_dvec3() - b.as_dvec3()).length_squared();
            count += 3;
        }
    }
    Ok((sum / count.max(1) as f64).sqrt())
}
