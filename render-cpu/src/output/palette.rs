//! 256 colours for a picture: median cut (Heckbert 1982) refined by k-means, and ordered dithering.
//!
//! The pattern of the dithering is fixed to the pixels, so that what does not change between the frames of an
//! animation does not flicker either.

/// Bits a channel of the histogram and of the look-up table.
const BITS: u32 = 5;
const BINS: usize = 1 << (3 * BITS);

/// A palette with a table of the nearest entries.
#[derive(Clone, Debug)]
pub(super) struct Palette {
    colors: Vec<[f32; 3]>,
    nearest: Vec<u8>,
    /// Distance of each entry to its nearest fellow: what dithering has to bridge.
    gap: Vec<f32>,
    /// Mean squared error of the picture that it was made for.
    pub(super) error: f32,
}

#[derive(Clone, Copy, Default)]
struct Bin {
    sum: [f64; 3],
    count: f64,
}

fn bin_of(p: [u8; 3]) -> usize {
    let q = p.map(|v| usize::from(v >> (8 - BITS)));
    (q[0] << (2 * BITS)) | (q[1] << BITS) | q[2]
}

fn bin_centre(k: usize) -> [f32; 3] {
    let mask = (1 << BITS) - 1;
    [k >> (2 * BITS), (k >> BITS) & mask, k & mask].map(|v| ((v as f32) + 0.5) * (256 >> BITS) as f32 - 0.5)
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    // Green counts more, as to the eye.
    let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    2.0 * d[0] * d[0] + 4.0 * d[1] * d[1] + 3.0 * d[2] * d[2]
}

fn nearest(colors: &[[f32; 3]], c: [f32; 3]) -> usize {
    let mut best = (f32::INFINITY, 0);
    for (k, &p) in colors.iter().enumerate() {
        let d = distance(p, c);
        if d < best.0 {
            best = (d, k);
        }
    }
    best.1
}

impl Palette {
    /// For a picture of RGB bytes.
    pub(super) fn for_picture(rgb: &[u8]) -> Self {
        let mut bins = vec![Bin::default(); BINS];
        for p in rgb.chunks_exact(3) {
            let bin = &mut bins[bin_of([p[0], p[1], p[2]])];
            for (sum, &v) in bin.sum.iter_mut().zip(p) {
                *sum += f64::from(v);
            }
            bin.count += 1.0;
        }
        let points: Vec<([f32; 3], f64)> = bins
            .iter()
            .filter(|b| b.count > 0.0)
            .map(|b| (b.sum.map(|s| (s / b.count) as f32), b.count))
            .collect();
        let mut colors = median_cut(points.clone(), 256);
        for _ in 0..4 {
            let mut sums = vec![Bin::default(); colors.len()];
            for &(c, n) in &points {
                let bin = &mut sums[nearest(&colors, c)];
                for (sum, v) in bin.sum.iter_mut().zip(c) {
                    *sum += n * f64::from(v);
                }
                bin.count += n;
            }
            for (color, bin) in colors.iter_mut().zip(&sums) {
                if bin.count > 0.0 {
                    *color = bin.sum.map(|s| (s / bin.count) as f32);
                }
            }
        }
        // What is written are bytes.
        for color in &mut colors {
            *color = color.map(|v| v.round().clamp(0.0, 255.0));
        }
        let gap = (0..colors.len())
            .map(|k| {
                let others = colors.iter().enumerate().filter(|(j, _)| *j != k);
                let d = others
                    .map(|(_, &c)| distance(c, colors[k]) / 3.0)
                    .fold(f32::INFINITY, f32::min);
                d.sqrt().min(48.0)
            })
            .collect();
        let table = (0..BINS).map(|k| nearest(&colors, bin_centre(k)) as u8).collect();
        let mut palette = Self {
            colors,
            nearest: table,
            gap,
            error: 0.0,
        };
        palette.error = palette.error_of(rgb);
        palette
    }

    /// Mean squared error of a picture in this palette without dithering, from every seventh pixel.
    pub(super) fn error_of(&self, rgb: &[u8]) -> f32 {
        let (mut sum, mut count) = (0.0_f64, 0.0_f64);
        for p in rgb.chunks_exact(3).step_by(7) {
            let p = [p[0], p[1], p[2]];
            let k = usize::from(self.nearest[bin_of(p)]);
            sum += f64::from(distance(self.colors[k], p.map(f32::from)));
            count += 1.0;
        }
        (sum / count.max(1.0)) as f32
    }

    /// The picture in colours of the palette, as RGBA bytes.
    pub(super) fn apply(&self, rgb: &[u8], width: usize) -> Vec<u8> {
        let mut out = Vec::with_capacity(rgb.len() / 3 * 4);
        for (n, p) in rgb.chunks_exact(3).enumerate() {
            let p = [p[0], p[1], p[2]];
            let amplitude = self.gap[usize::from(self.nearest[bin_of(p)])];
            let offset = amplitude * bayer(n % width, n / width);
            let dithered = p.map(|v| (f32::from(v) + offset).round().clamp(0.0, 255.0) as u8);
            let k = usize::from(self.nearest[bin_of(dithered)]);
            out.extend(self.colors[k].map(|v| v as u8));
            out.push(255);
        }
        out
    }
}

/// Ordered-dither threshold in −½ to ½, 8 × 8 (Bayer 1973).
fn bayer(x: usize, y: usize) -> f32 {
    let mut value = 0;
    for bit in 0..3 {
        let (a, b) = ((x >> bit) & 1, (y >> bit) & 1);
        value |= ((a ^ b) << 1 | b) << (2 * (2 - bit));
    }
    (value as f32 + 0.5) / 64.0 - 0.5
}

/// Splits the box with the largest weighted spread until there are `wanted`, then takes the means.
fn median_cut(points: Vec<([f32; 3], f64)>, wanted: usize) -> Vec<[f32; 3]> {
    struct Box3 {
        points: Vec<([f32; 3], f64)>,
        axis: usize,
        spread: f64,
    }
    fn measured(points: Vec<([f32; 3], f64)>) -> Box3 {
        let weight: f64 = points.iter().map(|p| p.1).sum();
        let (mut axis, mut spread) = (0, 0.0);
        for k in 0..3 {
            let mean = points.iter().map(|p| p.1 * f64::from(p.0[k])).sum::<f64>() / weight;
            let s: f64 = points
                .iter()
                .map(|p| p.1 * (f64::from(p.0[k]) - mean).powi(2))
                .sum();
            if s > spread {
                (axis, spread) = (k, s);
            }
        }
        // The square root keeps small but distinct colours alive beside large even areas.
        Box3 {
            spread: if points.len() > 1 {
                spread.sqrt() * weight.powf(0.1)
            } else {
                0.0
            },
            points,
            axis,
        }
    }
    if points.is_empty() {
        return vec![[0.0; 3]];
    }
    let mut boxes = vec![measured(points)];
    while boxes.len() < wanted {
        let Some(k) = (0..boxes.len()).max_by(|&a, &b| boxes[a].spread.total_cmp(&boxes[b].spread)) else {
            break;
        };
        if boxes[k].spread <= 0.0 {
            break;
        }
        let Box3 { mut points, axis, .. } = boxes.swap_remove(k);
        points.sort_by(|a, b| a.0[axis].total_cmp(&b.0[axis]));
        let half = 0.5 * points.iter().map(|p| p.1).sum::<f64>();
        let mut seen = 0.0;
        let mut cut = 0;
        while cut < points.len() - 1 && (cut == 0 || seen + points[cut].1 <= half) {
            seen += points[cut].1;
            cut += 1;
        }
        let rest = points.split_off(cut);
        boxes.push(measured(points));
        boxes.push(measured(rest));
    }
    boxes
        .iter()
        .map(|b| {
            let weight: f64 = b.points.iter().map(|p| p.1).sum();
            std::array::from_fn(|k| {
                (b.points.iter().map(|p| p.1 * f64::from(p.0[k])).sum::<f64>() / weight) as f32
            })
        })
        .collect()
}
