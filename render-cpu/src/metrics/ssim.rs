//! Structural similarity.

use super::{MetricError, check};
use glam::{UVec2, Vec3};

/// Standard deviation of the window in pixels.
const SIGMA: f64 = 1.5;
/// Pixels of the window on each side of its middle.
const RADIUS: i32 = 5;

/// Mean structural similarity of the luma of two pictures of display values in 0 to 1 (Wang, Bovik, Sheikh & Simoncelli
/// 2004, doi:10.1109/TIP.2003.819861: Gaussian window of 1.5 pixels, K1 = 0.01, K2 = 0.03). 1 for equal pictures. Windows
/// that reach over the border are left out, as the authors do, unless the picture is smaller than a window.
///
/// # Errors
/// [`MetricError`] if sizes differ or a value is not finite.
pub fn ssim(size: UVec2, reference: &[Vec3], test: &[Vec3]) -> Result<f64, MetricError> {
    check(size, reference, test)?;
    let (w, h) = (size.x as i32, size.y as i32);
    let luma = |p: &Vec3| f64::from(0.299 * p.x + 0.587 * p.y + 0.114 * p.z);
    let a: Vec<f64> = reference.iter().map(luma).collect();
    let b: Vec<f64> = test.iter().map(luma).collect();
    let weight = |d: i32| (-f64::from(d * d) / (2.0 * SIGMA * SIGMA)).exp();
    let inner = |n: i32| {
        if n > 2 * RADIUS { RADIUS..n - RADIUS } else { 0..n }
    };
    let (c1, c2) = (0.01 * 0.01, 0.03 * 0.03);
    let (mut sum, mut count) = (0.0, 0.0);
    for y in inner(h) {
        for x in inner(w) {
            let (mut total, mut ma, mut mb, mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
            for v in (y - RADIUS).max(0)..=(y + RADIUS).min(h - 1) {
                for u in (x - RADIUS).max(0)..=(x + RADIUS).min(w - 1) {
                    let g = weight(u - x) * weight(v - y);
                    let k = (v * w + u) as usize;
                    total += g;
                    ma += g * a[k];
                    mb += g * b[k];
                    aa += g * a[k] * a[k];
                    bb += g * b[k] * b[k];
                    ab += g * a[k] * b[k];
                }
            }
            let (ma, mb) = (ma / total, mb / total);
            let (va, vb, cov) = (aa / total - ma * ma, bb / total - mb * mb, ab / total - ma * mb);
            sum += (2.0 * ma * mb + c1) * (2.0 * cov + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2));
            count += 1.0;
        }
    }
    Ok(sum / count)
}
