//! From rectangular to square spacing.

use super::Raster;
use crate::grid::GridSpec;
use rayon::prelude::*;

/// Relative difference below which the two distances between samples count as equal.
const EQUAL: f64 = 1e-6;

/// Resamples the axis with the larger distance to the smaller one, by cubic convolution (Keys 1981): exact for
/// quadratic heights, third order for smooth ones. The new samples begin at the same place and end within the old ones.
///
/// # Errors
/// The counts, if there would be more samples than a grid may have.
pub(super) fn to_square(raster: Raster) -> Result<Raster, (f64, f64)> {
    let step = raster.pitch.min_element();
    let count = |n: usize, pitch: f64| ((n - 1) as f64 * pitch / step * (1.0 + 1e-9)).floor() + 1.0;
    let is_square = (raster.pitch.x - raster.pitch.y).abs() <= EQUAL * step;
    if is_square {
        return Ok(raster);
    }
    let (width, height) = (
        count(raster.width, raster.pitch.x),
        count(raster.height, raster.pitch.y),
    );
    if width * height > GridSpec::MAX_SAMPLES as f64 {
        return Err((width, height));
    }
    let (width, height) = (width as usize, height as usize);
    let values = if raster.pitch.x > raster.pitch.y {
        along_x(&raster, width, step / raster.pitch.x)
    } else {
        along_z(&raster, height, step / raster.pitch.y)
    };
    Ok(Raster {
        width,
        height,
        values,
        pitch: glam::DVec2::splat(step),
        origin: raster.origin,
    })
}

fn along_x(raster: &Raster, width: usize, ratio: f64) -> Vec<f64> {
    let mut out = vec![0.0; width * raster.height];
    out.par_chunks_mut(width)
        .zip(raster.values.par_chunks(raster.width))
        .for_each(|(to, from)| {
            for (k, value) in to.iter_mut().enumerate() {
                let (cell, share) = locate(k as f64 * ratio, from.len());
                *value = cubic(neighbours(cell, from.len(), |i| from[i]), share);
            }
        });
    out
}

fn along_z(raster: &Raster, height: usize, ratio: f64) -> Vec<f64> {
    let w = raster.width;
    let mut out = vec![0.0; w * height];
    out.par_chunks_mut(w).enumerate().for_each(|(k, to)| {
        let (cell, share) = locate(k as f64 * ratio, raster.height);
        for (i, value) in to.iter_mut().enumerate() {
            *value = cubic(
                neighbours(cell, raster.height, |j| raster.values[j * w + i]),
                share,
            );
        }
    });
    out
}

/// Cell and share in it (0 to 1) of a position in samples.
fn locate(position: f64, count: usize) -> (usize, f64) {
    let cell = (position.floor() as usize).min(count - 2);
    (cell, (position - cell as f64).clamp(0.0, 1.0))
}

/// The samples before, at, after and behind a cell; beyond the ends a parabola continues (two samples: a line).
fn neighbours(cell: usize, count: usize, at: impl Fn(usize) -> f64) -> [f64; 4] {
    let beyond = |a: f64, b: f64, c: Option<f64>| c.map_or(2.0 * a - b, |c| 3.0 * (a - b) + c);
    let (b, c) = (at(cell), at(cell + 1));
    let a = if cell > 0 {
        at(cell - 1)
    } else {
        beyond(b, c, (cell + 2 < count).then(|| at(cell + 2)))
    };
    let d = if cell + 2 < count {
        at(cell + 2)
    } else {
        beyond(c, b, cell.checked_sub(1).map(&at))
    };
    [a, b, c, d]
}

/// Cubic through `b` and `c` with the central differences as slopes (Keys' kernel with a = −1/2).
fn cubic([a, b, c, d]: [f64; 4], t: f64) -> f64 {
    let slope = 0.5 * (c - a);
    let quadratic = a - 2.5 * b + 2.0 * c - 0.5 * d;
    let third = 0.5 * (d - a) + 1.5 * (b - c);
    b + t * (slope + t * (quadratic + t * third))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;

    fn raster(width: usize, height: usize, pitch: DVec2, f: impl Fn(f64, f64) -> f64) -> Raster {
        let values = (0..width * height)
            .map(|k| f((k % width) as f64 * pitch.x, (k / width) as f64 * pitch.y))
            .collect();
        Raster {
            width,
            height,
            values,
            pitch,
            origin: DVec2::new(5.0, 7.0),
        }
    }

    /// Largest difference from `f` after resampling.
    fn error(width: usize, height: usize, pitch: DVec2, f: impl Fn(f64, f64) -> f64) -> f64 {
        let out = to_square(raster(width, height, pitch, &f)).unwrap();
        assert_eq!(
            (out.pitch, out.origin),
            (DVec2::splat(pitch.min_element()), DVec2::new(5.0, 7.0))
        );
        let s = out.pitch.x;
        (0..out.values.len())
            .map(|k| (out.values[k] - f((k % out.width) as f64 * s, (k / out.width) as f64 * s)).abs())
            .fold(0.0, f64::max)
    }

    #[test]
    fn quadratic_heights_are_exact_along_either_axis() {
        let f = |x: f64, z: f64| 3.0 + 0.5 * x - 0.25 * z + 0.02 * x * x - 0.03 * z * z;
        assert!(error(13, 9, DVec2::new(1.0, 1.7), f) < 1e-12);
        assert!(error(13, 9, DVec2::new(2.3, 1.0), f) < 1e-12);
        assert!(error(2, 2, DVec2::new(2.5, 1.0), |x, z| 2.0 * x - z) < 1e-12);
    }

    #[test]
    fn smooth_heights_converge_with_third_order() {
        let f = |x: f64, z: f64| (x * 1.3 + 0.2).sin() * (z * 0.9).cos();
        let at = |n: usize| error(5, 8 * n + 1, DVec2::new(0.4, 0.6) / n as f64, f);
        let order = (at(8) / at(16)).log2();
        assert!(order > 2.7, "order {order}");
    }

    #[test]
    fn the_new_samples_end_within_the_old_ones() {
        let out = to_square(raster(403, 344, DVec2::new(74.5, 92.6), |x, _| x)).unwrap();
        assert_eq!((out.width, out.height), (403, 427));
        // One more row would lie beyond the last of the old ones.
        let (last, end) = ((out.height - 1) as f64 * 74.5, 343.0 * 92.6);
        assert!(last <= end && last + 74.5 > end);
    }

    #[test]
    fn square_spacing_is_left_alone_and_absurd_spacing_is_refused() {
        let values = raster(4, 3, DVec2::ONE, |x, z| x * z).values;
        assert_eq!(
            to_square(raster(4, 3, DVec2::ONE, |x, z| x * z)).unwrap().values,
            values
        );
        assert!(to_square(raster(4, 3, DVec2::new(1e9, 1e-6), |x, _| x)).is_err());
    }
}
