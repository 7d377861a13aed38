//! How heights go on beyond their grid, and which heights are drawn.

use crate::{Frame, Grid, GridSpec};
use glam::{BVec2, UVec2, Vec2};
use rayon::prelude::*;

/// How a grid is continued.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Continuation {
    /// Axes (X, Z) along which the surface repeats with period `spacing · size`.
    pub periodic: BVec2,
    /// Samples of apron beyond each edge of the other axes.
    pub apron: UVec2,
    /// Height of the plane that the apron fades into, metres.
    pub level: f32,
}

/// Samples of a grid together with its continuation.
pub fn continued_samples(spec: &GridSpec, how: &Continuation) -> u64 {
    let size = continued_spec(spec, how).size;
    u64::from(size.x) * u64::from(size.y)
}

/// Where the samples of a continued grid stand.
pub fn continued_spec(spec: &GridSpec, how: &Continuation) -> GridSpec {
    let pad = |periodic: bool, n: u32, apron: u32| {
        // A periodic axis repeats its first sample at the end; a single sample becomes a level strip.
        if periodic {
            (0, n + 1)
        } else {
            (apron, (n + 2 * apron).max(2))
        }
    };
    let (ax, nx) = pad(how.periodic.x, spec.size.x, how.apron.x);
    let (az, nz) = pad(how.periodic.y, spec.size.y, how.apron.y);
    GridSpec {
        origin: spec.origin - spec.spacing * Vec2::new(ax as f32, az as f32),
        spacing: spec.spacing,
        size: UVec2::new(nx, nz),
    }
}

/// Source index along one axis and the weight of the source against the level plane.
fn continue_axis(k: usize, n: usize, periodic: bool, apron: usize) -> (usize, f32) {
    if periodic {
        return (k % n, 1.0);
    }
    let (last, x) = (n as isize - 1, k as isize - apron as isize);
    let beyond = (-x).max(x - last).max(0);
    if beyond == 0 || last == 0 {
        return (
            x.clamp(0, last) as usize,
            if beyond == 0 || apron == 0 { 1.0 } else { 0.0 },
        );
    }
    // Mirrored at the edge, as often as needed.
    let m = x.rem_euclid(2 * last);
    let mirrored = if m > last { 2 * last - m } else { m };
    let s = (beyond as f32 / apron as f32).min(1.0);
    (mirrored as usize, 1.0 - s * s * (3.0 - 2.0 * s))
}

/// The grid with its continuation, reusing what is allocated. A periodic axis repeats its first sample at the end.
pub fn continued(source: &Grid<f32>, how: &Continuation, reuse: Option<Grid<f32>>) -> Grid<f32> {
    let spec = *source.spec();
    let out_spec = continued_spec(&spec, how);
    let mut out = reuse.unwrap_or_else(|| Grid::filled(out_spec, 0.0));
    out.reshape(out_spec, 0.0);
    let columns: Vec<(usize, f32)> = (0..out_spec.width())
        .map(|i| continue_axis(i, spec.width(), how.periodic.x, how.apron.x as usize))
        .collect();
    out.as_mut_slice()
        .par_chunks_mut(out_spec.width())
        .enumerate()
        .for_each(|(j, row)| {
            let (sj, wj) = continue_axis(j, spec.height(), how.periodic.y, how.apron.y as usize);
            let source = source.row(sj);
            for (out, &(si, wi)) in row.iter_mut().zip(&columns) {
                let (h, w) = (source[si], wi * wj);
                *out = if w == 1.0 {
                    h
                } else {
                    how.level + (h - how.level) * w
                };
            }
        });
    out
}

/// Index of a sample that may lie beyond the stored row of `n`; a periodic row stores its first sample twice.
pub fn neighbour(k: isize, n: usize, periodic: bool) -> usize {
    let last = n as isize - 1;
    (if periodic {
        k.rem_euclid(last.max(1))
    } else {
        k.clamp(0, last)
    }) as usize
}

/// Slope (∂y/∂x, ∂y/∂z) at every sample of a continued grid.
pub fn slopes_of(heights: &Grid<f32>, periodic: BVec2, reuse: Option<Grid<Vec2>>) -> Grid<Vec2> {
    let spec = *heights.spec();
    let (w, h) = (spec.width(), spec.height());
    let mut slopes = reuse.unwrap_or_else(|| Grid::filled(spec, Vec2::ZERO));
    slopes.reshape(spec, Vec2::ZERO);
    let scale = 1.0 / spec.spacing;
    slopes
        .as_mut_slice()
        .par_chunks_mut(w)
        .enumerate()
        .for_each(|(j, row)| {
            let at = |i: usize, j: usize| heights.as_slice()[j * w + i];
            for (i, out) in row.iter_mut().enumerate() {
                *out = scale
                    * Vec2::new(
                        difference(i, w, periodic.x, |i| at(i, j)),
                        difference(j, h, periodic.y, |j| at(i, j)),
                    );
            }
        });
    slopes
}

/// Derivative per sample at `k` of `n`: of fourth order inside, lower at the ends of a row that does not repeat.
fn difference(k: usize, n: usize, periodic: bool, f: impl Fn(usize) -> f32) -> f32 {
    let g = |d: isize| f(neighbour(k as isize + d, n, periodic));
    if n < 2 {
        0.0
    } else if periodic || (k >= 2 && k + 2 < n) {
        (8.0 * (g(1) - g(-1)) - (g(2) - g(-2))) / 12.0
    } else if k >= 1 && k + 1 < n {
        0.5 * (g(1) - g(-1))
    } else {
        g(1) - g(-1)
    }
}

/// Weights of the four samples around a place `t` between the middle two (0 to 1).
pub fn catmull_rom(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        -0.5 * t + t2 - 0.5 * t3,
        1.0 - 2.5 * t2 + 1.5 * t3,
        0.5 * t + 2.0 * t2 - 1.5 * t3,
        -0.5 * t2 + 0.5 * t3,
    ]
}

/// The heights that are drawn: the frame's elevation, moved where the frame displaces it, and sunk below the ground
/// where it is dry.
///
/// Solvers let the surface of dry samples coincide with the ground. Ground of finer resolution dips below the chords
/// between those samples and would show puddles there; dry samples without a wet neighbour are therefore lowered by
/// more than the ground can dip within their cells. The neighbours of wet samples carry the waterline and stay.
pub fn drawable(
    frame: &Frame,
    ground: Option<&Grid<f32>>,
    periodic: BVec2,
    reuse: Option<Grid<f32>>,
) -> Grid<f32> {
    let spec = *frame.spec();
    let mut out = reuse.unwrap_or_else(|| Grid::filled(spec, 0.0));
    out.reshape(spec, 0.0);
    match frame.displacement.as_ref().filter(|d| d.spec() == &spec) {
        Some(moved) => super::choppy::undisplaced(&frame.elevation, moved, periodic, &mut out),
        None => out.as_mut_slice().copy_from_slice(frame.elevation.as_slice()),
    }
    if let Some(ground) = ground.filter(|g| g.spec() == &spec) {
        sink_dry(&mut out, ground);
    }
    out
}

/// Depth, relative to the deepest water of the frame, below which a sample counts as dry.
const FILM: f32 = 1e-4;

fn sink_dry(out: &mut Grid<f32>, ground: &Grid<f32>) {
    let elevation = out.clone();
    let (w, h) = (elevation.spec().width(), elevation.spec().height());
    let (e, g) = (elevation.as_slice(), ground.as_slice());
    let deepest = e.iter().zip(g).map(|(e, g)| e - g).fold(0.0, f32::max);
    let film = FILM * deepest;
    out.as_mut_slice()
        .par_chunks_mut(w)
        .enumerate()
        .for_each(|(j, row)| {
            for (i, out) in row.iter_mut().enumerate() {
                let here = g[j * w + i];
                let (mut wet, mut relief) = (false, 0.0_f32);
                for nj in j.saturating_sub(1)..(j + 2).min(h) {
                    for k in nj * w + i.saturating_sub(1)..nj * w + (i + 2).min(w) {
                        wet |= e[k] - g[k] > film;
                        relief = relief.max((g[k] - here).abs());
                    }
                }
                if !wet {
                    *out = here.min(*out) - 2.0 * relief - film;
                }
            }
        });
}

/// Share of the sky's light that level ground gets between the heights around it: the mean of cos² of the horizon's
/// elevation in eight directions.
pub fn openness(terrain: &Grid<f32>) -> Grid<f32> {
    const DIRECTIONS: [(isize, isize); 8] = [
        (1, 0),
        (1, 1),
        (0, 1),
        (-1, 1),
        (-1, 0),
        (-1, -1),
        (0, -1),
        (1, -1),
    ];
    let spec = *terrain.spec();
    let (w, h) = (spec.width() as isize, spec.height() as isize);
    let data = terrain.as_slice();
    let mut out = Grid::filled(spec, 1.0);
    out.as_mut_slice()
        .par_chunks_mut(spec.width())
        .enumerate()
        .for_each(|(j, row)| {
            for (i, out) in row.iter_mut().enumerate() {
                let here = data[j * spec.width() + i];
                let mut open = 0.0;
                for (di, dj) in DIRECTIONS {
                    let length = spec.spacing * ((di * di + dj * dj) as f32).sqrt();
                    let mut steepest = 0.0_f32;
                    // Steps that grow with distance: far hills need less care.
                    let (mut n, mut step) = (1_isize, 1_isize);
                    loop {
                        let (x, z) = (i as isize + n * di, j as isize + n * dj);
                        if x < 0 || z < 0 || x >= w || z >= h || n > 64 {
                            break;
                        }
                        let rise = data[(z * w + x) as usize] - here;
                        steepest = steepest.max(rise / (length * n as f32));
                        step += n / 4;
                        n += step;
                        step = 1;
                    }
                    open += 1.0 / (1.0 + steepest * steepest);
                }
                *out = open / DIRECTIONS.len() as f32;
            }
        });
    out
}
