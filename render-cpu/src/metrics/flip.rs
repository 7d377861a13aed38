//! FLIP: the difference that a viewer perceives when two pictures are flipped between.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström & Fairchild 2020, *FLIP: a difference evaluator for alternating
//! images*, doi:10.1145/3406183, for display values (LDR). Colour: both pictures are seen through the contrast
//! sensitivity of the eye (§4.1.1), compared in a perceptually even space by HyAB (§4.1.3) and mapped to 0 to 1. Features:
//! edges and points that one picture has and the other lacks (§4.2) raise it.

use super::{MetricError, check};
use glam::{Mat3, UVec2, Vec3};
use rayon::prelude::*;
use std::f32::consts::PI;

/// Pixels a degree of a 0.7 m wide display of 3840 pixels seen from 0.7 m: the authors' default.
pub const PIXELS_PER_DEGREE: f32 = 67.020_64;

/// Exponents and break of the colour map (§4.1.4) and of the feature map (§4.2).
const COLOR_EXPONENT: f32 = 0.7;
const BREAK: f32 = 0.4;
const AT_BREAK: f32 = 0.95;
const FEATURE_EXPONENT: f32 = 0.5;
/// Width of the edge and point detectors in degrees.
const FEATURE_WIDTH: f32 = 0.082;

/// Linear sRGB to CIE XYZ (columns are the primaries), from the rounded chromaticities of the standard, as the authors have it.
const XYZ_FROM_RGB: Mat3 = Mat3::from_cols(
    Vec3::new(0.412_386_56, 0.212_636_82, 0.019_330_62),
    Vec3::new(0.357_591_5, 0.715_183, 0.119_197_17),
    Vec3::new(0.180_450_5, 0.072_180_2, 0.950_372_6),
);

/// Error of every pixel, 0 to 1, of two pictures of display values (sRGB-encoded, 0 to 1; what lies beyond is clamped), seen at
/// `pixels_per_degree` ([`PIXELS_PER_DEGREE`]).
///
/// # Errors
/// [`MetricError`] if sizes differ or a value is not finite.
pub fn flip(
    size: UVec2,
    reference: &[Vec3],
    test: &[Vec3],
    pixels_per_degree: f32,
) -> Result<Vec<f32>, MetricError> {
    check(size, reference, test)?;
    let prepare = |picture: &[Vec3]| -> Plane {
        Plane {
            size,
            values: picture
                .iter()
                .map(|p| ycxcz_from_rgb(p.clamp(Vec3::ZERO, Vec3::ONE).map(linear)))
                .collect(),
        }
    };
    let (reference, test) = (prepare(reference), prepare(test));
    let seen = |picture: &Plane| -> Vec<Vec3> {
        let filtered = picture.seen(pixels_per_degree);
        filtered
            .into_par_iter()
            .map(|c| hunt(lab_from_rgb(rgb_from_ycxcz(c).clamp(Vec3::ZERO, Vec3::ONE))))
            .collect()
    };
    let (a, b) = (seen(&reference), seen(&test));
    let (fa, fb) = (
        reference.features(pixels_per_degree),
        test.features(pixels_per_degree),
    );
    // The largest difference there is, between green and blue (§4.1.4).
    let largest = hyab(hunt(lab_from_rgb(Vec3::Y)), hunt(lab_from_rgb(Vec3::Z))).powf(COLOR_EXPONENT);
    Ok((0..a.len())
        .into_par_iter()
        .map(|k| {
            let color = compress(hyab(a[k], b[k]).powf(COLOR_EXPONENT), largest);
            let [edge, point] = [0, 1].map(|f| (fa[k][f] - fb[k][f]).abs());
            let feature = (edge.max(point) / 2.0_f32.sqrt())
                .clamp(0.0, 1.0)
                .powf(FEATURE_EXPONENT);
            color.powf(1.0 - feature)
        })
        .collect())
}

/// sRGB to linear.
fn linear(v: f32) -> f32 {
    if v <= 0.040_45 {
        v / 12.92
    } else {
        ((v + 0.055) / 1.055).powf(2.4)
    }
}

fn white() -> Vec3 {
    XYZ_FROM_RGB * Vec3::ONE
}

/// Opponent space in which the eye's filters act: luminance, red against green, yellow against blue.
fn ycxcz_from_rgb(rgb: Vec3) -> Vec3 {
    let xyz = XYZ_FROM_RGB * rgb / white();
    Vec3::new(
        116.0 * xyz.y - 16.0,
        500.0 * (xyz.x - xyz.y),
        200.0 * (xyz.y - xyz.z),
    )
}

fn rgb_from_ycxcz(c: Vec3) -> Vec3 {
    let y = (c.x + 16.0) / 116.0;
    let xyz = Vec3::new(c.y / 500.0 + y, y, y - c.z / 200.0) * white();
    XYZ_FROM_RGB.inverse() * xyz
}

fn lab_from_rgb(rgb: Vec3) -> Vec3 {
    const DELTA: f32 = 6.0 / 29.0;
    let f = |t: f32| {
        if t > DELTA * DELTA * DELTA {
            t.cbrt()
        } else {
            t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    };
    let xyz = (XYZ_FROM_RGB * rgb / white()).map(f);
    Vec3::new(
        116.0 * xyz.y - 16.0,
        500.0 * (xyz.x - xyz.y),
        200.0 * (xyz.y - xyz.z),
    )
}

/// Hunt's effect: colours look stronger where it is bright.
fn hunt(lab: Vec3) -> Vec3 {
    let factor = 0.01 * lab.x;
    Vec3::new(lab.x, factor * lab.y, factor * lab.z)
}

/// City block in lightness, Euclid in colour (Abasi, Tehran & Fairchild 2020).
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x.abs() + d.y.hypot(d.z)
}

/// Differences up to 0.4 of the largest get nearly the whole range.
fn compress(error: f32, largest: f32) -> f32 {
    let at = BREAK * largest;
    if error < at {
        AT_BREAK / at * error
    } else {
        AT_BREAK + (error - at) / (largest - at) * (1.0 - AT_BREAK)
    }
}

/// A picture in the opponent space.
struct Plane {
    size: UVec2,
    values: Vec<Vec3>,
}

/// Sum of Gaussians Σ a √(π/b) e^(−π² x²/b) over degrees: the contrast sensitivity of one channel (table 1).
const SENSITIVITY: [[(f32, f32); 2]; 3] = [
    [(1.0, 0.0047), (0.0, 1e-5)],
    [(1.0, 0.0053), (0.0, 1e-5)],
    [(34.1, 0.04), (13.5, 0.025)],
];

impl Plane {
    /// Seen through the eye's contrast sensitivity.
    fn seen(&self, ppd: f32) -> Vec<Vec3> {
        let widest = 0.04_f32;
        let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * ppd).ceil() as i32;
        let [y, x, z] = SENSITIVITY.map(|terms| {
            // Each term is separable, their sum is not: filtered term by term and added.
            let weight: Vec<f32> = terms.iter().map(|(a, b)| a * (PI / b)).collect();
            let lines: Vec<Vec<f32>> = terms
                .iter()
                .map(|(_, b)| line(radius, |d| (-PI * PI * (d / ppd) * (d / ppd) / b).exp()))
                .collect();
            let total: f32 = weight
                .iter()
                .zip(&lines)
                .map(|(w, l)| w * l.iter().sum::<f32>().powi(2))
                .sum();
            (weight, lines, total)
        });
        let channel = |k: usize, (weight, lines, total): &(Vec<f32>, Vec<Vec<f32>>, f32)| {
            let values: Vec<f32> = self.values.iter().map(|v| v[k]).collect();
            let mut out = vec![0.0; values.len()];
            for (w, l) in weight.iter().zip(lines).filter(|(w, _)| **w > 0.0) {
                let filtered = convolve(self.size, &values, l, l);
                for (o, f) in out.iter_mut().zip(filtered) {
                    *o += w / total * f;
                }
            }
            out
        };
        let (y, x, z) = (channel(0, &y), channel(1, &x), channel(2, &z));
        (0..y.len()).map(|k| Vec3::new(y[k], x[k], z[k])).collect()
    }

    /// Strength of edges and of points at every pixel, of the luminance.
    fn features(&self, ppd: f32) -> Vec<[f32; 2]> {
        let sd = 0.5 * FEATURE_WIDTH * ppd;
        let radius = (3.0 * sd).ceil() as i32;
        let gauss = |d: f32| (-d * d / (2.0 * sd * sd)).exp();
        let smooth = normalised(line(radius, gauss));
        // Parts of either sign add up to 1 each, in two dimensions.
        let edge = balanced(line(radius, |d| -d * gauss(d)));
        let point = balanced(line(radius, |d| (d * d / (sd * sd) - 1.0) * gauss(d)));
        let values: Vec<f32> = self.values.iter().map(|v| (v.x + 16.0) / 116.0).collect();
        let strength = |kernel: &[f32]| -> Vec<f32> {
            let x = convolve(self.size, &values, kernel, &smooth);
            let y = convolve(self.size, &values, &smooth, kernel);
            x.iter().zip(&y).map(|(x, y)| x.hypot(*y)).collect()
        };
        let (edges, points) = (strength(&edge), strength(&point));
        edges.into_iter().zip(points).map(|(e, p)| [e, p]).collect()
    }
}

fn line(radius: i32, f: impl Fn(f32) -> f32) -> Vec<f32> {
    (-radius..=radius).map(|d| f(d as f32)).collect()
}

fn normalised(kernel: Vec<f32>) -> Vec<f32> {
    let sum: f32 = kernel.iter().sum();
    kernel.into_iter().map(|k| k / sum).collect()
}

/// Scaled so that positive values add up to 1 and negative ones to −1.
fn balanced(kernel: Vec<f32>) -> Vec<f32> {
    let sum = |sign: f32| kernel.iter().map(|k| (sign * k).max(0.0)).sum::<f32>();
    let (plus, minus) = (sum(1.0), sum(-1.0));
    kernel
        .into_iter()
        .map(|k| if k > 0.0 { k / plus } else { k / minus })
        .collect()
}

/// Rows by `along`, then columns by `down`; the picture's border goes on beyond it.
fn convolve(size: UVec2, values: &[f32], along: &[f32], down: &[f32]) -> Vec<f32> {
    let (w, h) = (size.x as usize, size.y as usize);
    let reach = |kernel: &[f32]| (kernel.len() / 2) as i32;
    let mut rows = vec![0.0_f32; values.len()];
    rows.par_chunks_mut(w)
        .zip(values.par_chunks(w))
        .for_each(|(out, row)| {
            for (x, out) in out.iter_mut().enumerate() {
                *out = along
                    .iter()
                    .enumerate()
                    .map(|(d, k)| {
                        k * row[(x as i32 + d as i32 - reach(along)).clamp(0, w as i32 - 1) as usize]
                    })
                    .sum();
            }
        });
    let mut out = vec![0.0_f32; values.len()];
    out.par_chunks_mut(w).enumerate().for_each(|(y, out)| {
        for (d, k) in down.iter().enumerate() {
            let from = (y as i32 + d as i32 - reach(down)).clamp(0, h as i32 - 1) as usize * w;
            for (out, v) in out.iter_mut().zip(&rows[from..from + w]) {
                *out += k * v;
            }
        }
    });
    out
}
