//! From particles to a grid: every sample is the sum of the particles that reach it, in a fixed order.
//!
//! Particles are prepared in chunks (position, amplitude, images at walls) and sorted, chunk by chunk, into bands of
//! rows. A band is then summed by one thread in the order of the particles, so frames are the same for any number of
//! threads; and a band's rows fit the nearest cache. Cost is particles × samples under each.

use super::beams::{Beams, Wedge, wedge_on_row};
use super::flight::{Beyond, Course};
use super::kernel::{LANES, Rows, Stamp, Target, WIDEST, add_row, add_small};
use super::particle::Particles;
use crate::grid::GridSpec;
use glam::DVec2;
use rayon::prelude::*;

/// Rows a band.
const BAND: usize = 16;

/// Particles a chunk.
const CHUNK: usize = 4096;

/// Where a stamp near walls may be seen.
#[derive(Clone, Copy, Debug)]
struct Clip {
    window: Option<Wedge>,
    shadows: (usize, usize),
}

/// The stamps of some particles.
#[derive(Clone, Debug, Default)]
struct Chunk {
    stamps: Vec<Stamp>,
    /// For each stamp the number of its clip plus 1, or 0.
    clip: Vec<u32>,
    clips: Vec<Clip>,
    shadows: Vec<Wedge>,
    /// Stamps by band.
    order: Vec<u32>,
    starts: Vec<u32>,
    beams: Beams,
}

/// Buffers of the evaluation, reused from frame to frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Workspace {
    chunks: Vec<Chunk>,
    used: usize,
}

/// Which sums are wanted beside the elevation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Wanted {
    pub(super) velocity: bool,
    pub(super) displacement: bool,
}

/// Sums over some rows of the grid; arrays that are not wanted are empty.
#[derive(Clone, Debug, Default)]
pub(super) struct BandSums {
    /// First row of the grid that it holds.
    first: i32,
    /// Samples a row, with [`WIDEST`] of them before the first column and more after the last.
    stride: usize,
    /// Elevation above rest, metres.
    height: Vec<f32>,
    /// Σ elevation · direction, metres.
    carried: [Vec<f32>; 2],
    /// Horizontal displacement, metres.
    moved: [Vec<f32>; 2],
    /// One row, for stamps that are cut.
    scratch: [Vec<f32>; 5],
}

impl BandSums {
    fn clear(&mut self, width: usize, first: usize, rows: usize, wanted: Wanted) {
        self.first = first as i32;
        self.stride = WIDEST + width.next_multiple_of(LANES) + WIDEST + LANES;
        let fill = |list: &mut Vec<f32>, len: usize| {
            list.clear();
            list.resize(len, 0.0);
        };
        let share = |yes: bool, len: usize| if yes { len } else { 0 };
        let all = self.stride * rows;
        fill(&mut self.height, all);
        for list in &mut self.carried {
            fill(list, share(wanted.velocity, all));
        }
        for list in &mut self.moved {
            fill(list, share(wanted.displacement, all));
        }
        let row = self.stride;
        for (k, list) in self.scratch.iter_mut().enumerate() {
            let yes = k == 0 || (k < 3 && wanted.velocity) || (k >= 3 && wanted.displacement);
            fill(list, share(yes, row));
        }
    }

    /// Row `j` of the band: elevation, direction sums, displacement.
    pub(super) fn row(&self, j: usize, width: usize) -> [&[f32]; 5] {
        let at = |list: &'_ [f32]| -> std::ops::Range<usize> {
            if list.is_empty() {
                0..0
            } else {
                let begin = self.place(j, 0);
                begin..begin + width
            }
        };
        let lists = [
            &self.height,
            &self.carried[0],
            &self.carried[1],
            &self.moved[0],
            &self.moved[1],
        ];
        lists.map(|list| &list[at(list)])
    }

    /// Where column `column` of row `row` of the band stands.
    #[inline(always)]
    fn place(&self, row: usize, column: i32) -> usize {
        row * self.stride + (WIDEST as i32 + column) as usize
    }

    #[inline(always)]
    fn target(&mut self, span: std::ops::Range<usize>) -> Target<'_> {
        fn part(list: &mut [f32], span: std::ops::Range<usize>) -> &mut [f32] {
            if list.is_empty() { &mut [] } else { &mut list[span] }
        }
        let [cx, cz] = &mut self.carried;
        let [mx, mz] = &mut self.moved;
        Target {
            height: part(&mut self.height, span.clone()),
            carried: [part(cx, span.clone()), part(cz, span.clone())],
            moved: [part(mx, span.clone()), part(mz, span)],
        }
    }
}

impl Rows for BandSums {
    #[inline(always)]
    fn samples<const N: usize>(&mut self, row: i32, first: i32) -> Target<'_> {
        let begin = self.place((row - self.first) as usize, first);
        self.target(begin..begin + N)
    }
}

/// Splits a coordinate in samples, near the grid, into a whole number and a rest.
#[inline(always)]
fn split(x: f64) -> (i32, f32) {
    // Without `floor`, a call where the processor's own rounding may not be assumed.
    let toward_zero = x as i32;
    let whole = toward_zero - i32::from(f64::from(toward_zero) > x);
    (whole, (x - f64::from(whole)) as f32)
}

/// Puts particles, their images and their periodic copies onto a list.
struct Stamper<'a> {
    course: &'a Course,
    spec: &'a GridSpec,
    bands: usize,
}

impl Stamper<'_> {
    fn stamp(
        &self,
        centre: DVec2,
        direction: DVec2,
        radius: f64,
        amplitude: f64,
        clip: u32,
        out: &mut Chunk,
    ) {
        let spacing = f64::from(self.spec.spacing);
        let g = (centre - self.spec.origin.as_dvec2()) / spacing;
        let r = radius / spacing;
        let size = self.spec.size.as_dvec2();
        if g.x + r < 0.0 || g.y + r < 0.0 || g.x - r > size.x - 1.0 || g.y - r > size.y - 1.0 {
            return;
        }
        let ((column, fx), (row, fz)) = (split(g.x), split(g.y));
        out.stamps.push(Stamp {
            column,
            row,
            fraction: [fx, fz],
            radius: r as f32,
            amplitude: amplitude as f32,
            direction: direction.as_vec2().to_array(),
        });
        out.clip.push(clip);
    }

    /// The copies of a point that reach into the rectangle, for every axis that wraps.
    fn copies(&self, centre: DVec2, radius: f64, mut visit: impl FnMut(DVec2)) {
        let period = self.course.high - self.course.low;
        let range = |axis: usize| -> (i64, i64) {
            if self.course.beyond[2 * axis] != Beyond::Wrap {
                return (0, 0);
            }
            let a = ((self.course.low[axis] - radius - centre[axis]) / period[axis]).ceil();
            let b = ((self.course.high[axis] + radius - centre[axis]) / period[axis]).floor();
            // Copies without end would be a sum without end.
            (a.max(-64.0) as i64, b.min(64.0) as i64)
        };
        let ((i0, i1), (j0, j1)) = (range(0), range(1));
        for j in j0..=j1 {
            for i in i0..=i1 {
                visit(centre + period * DVec2::new(i as f64, j as f64));
            }
        }
    }

    fn fill(&self, particles: &Particles, range: std::ops::Range<usize>, time: f64, out: &mut Chunk) {
        out.stamps.clear();
        out.clip.clear();
        out.clips.clear();
        out.shadows.clear();
        let speed = self.course.speed;
        let wraps = self.course.beyond.contains(&Beyond::Wrap);
        let mut beams = std::mem::take(&mut out.beams);
        for k in range {
            let p = particles.get(k);
            let (centre, amplitude) = (p.position(time, speed), p.shown(time, speed));
            let mut place = |centre: DVec2| {
                beams.find(&self.course.walls, centre, p.direction, p.radius);
                if beams.list.is_empty() {
                    self.stamp(centre, p.direction, p.radius, amplitude, 0, out);
                    return;
                }
                let first = out.shadows.len();
                out.shadows.extend_from_slice(&beams.shadows);
                for beam in &beams.list {
                    out.clips.push(Clip {
                        window: beam.window,
                        shadows: (first + beam.shadows.0, first + beam.shadows.1),
                    });
                    let clip = out.clips.len() as u32;
                    self.stamp(beam.centre, beam.direction, p.radius, amplitude, clip, out);
                }
            };
            if wraps {
                self.copies(centre, p.radius, place);
            } else {
                place(centre);
            }
        }
        out.beams = beams;
        self.sort(out);
    }

    /// Rows that a stamp touches, within the grid.
    fn rows(&self, s: &Stamp) -> (i32, i32) {
        let reach = s.radius.ceil() as i32 + 1;
        let last = self.spec.size.y as i32 - 1;
        (
            s.row.saturating_sub(reach).max(0),
            s.row.saturating_add(reach).min(last),
        )
    }

    /// Lists the stamps of each band.
    fn sort(&self, out: &mut Chunk) {
        out.starts.clear();
        out.starts.resize(self.bands + 1, 0);
        let bands = |s: &Stamp| {
            let (a, b) = self.rows(s);
            if a <= b {
                a as usize / BAND..b as usize / BAND + 1
            } else {
                0..0
            }
        };
        for s in &out.stamps {
            for band in bands(s) {
                out.starts[band + 1] += 1;
            }
        }
        for band in 0..self.bands {
            out.starts[band + 1] += out.starts[band];
        }
        out.order.clear();
        out.order.resize(out.starts[self.bands] as usize, 0);
        for (k, s) in out.stamps.iter().enumerate() {
            for band in bands(s) {
                // Each start is moved on to where the next stamp of its band goes …
                out.order[out.starts[band] as usize] = k as u32;
                out.starts[band] += 1;
            }
        }
        // … so that each is now where the next band's was.
        out.starts.rotate_right(1);
        out.starts[0] = 0;
    }
}

impl Workspace {
    /// Prepares the particles as they are at `time`.
    pub(super) fn prepare(&mut self, course: &Course, spec: &GridSpec, particles: &Particles, time: f64) {
        let count = particles.len();
        self.used = count.div_ceil(CHUNK);
        if self.chunks.len() < self.used {
            self.chunks.resize_with(self.used, Chunk::default);
        }
        let stamper = Stamper {
            course,
            spec,
            bands: spec.height().div_ceil(BAND),
        };
        self.chunks[..self.used]
            .par_iter_mut()
            .enumerate()
            .for_each(|(c, out)| {
                stamper.fill(particles, c * CHUNK..((c + 1) * CHUNK).min(count), time, out);
            });
    }

    /// Sums the prepared particles band by band: `finish` gets the first row of each band and its sums. `outputs` are one
    /// a band.
    pub(super) fn sum<T: Send>(
        &self,
        spec: &GridSpec,
        wanted: Wanted,
        outputs: Vec<T>,
        finish: impl Fn(T, usize, &BandSums) + Sync,
    ) {
        let arch = pulp::Arch::new();
        outputs
            .into_par_iter()
            .enumerate()
            .for_each_init(BandSums::default, |sums, (band, output)| {
                let first = band * BAND;
                let rows = BAND.min(spec.height() - first);
                sums.clear(spec.width(), first, rows, wanted);
                arch.dispatch(SumBand {
                    chunks: &self.chunks[..self.used],
                    spec,
                    band,
                    rows,
                    sums,
                });
                finish(output, first, sums);
            });
    }

    /// Number of bands of a grid.
    pub(super) fn bands(spec: &GridSpec) -> usize {
        spec.height().div_ceil(BAND)
    }

    /// Rows of a band.
    pub(super) const fn band_rows() -> usize {
        BAND
    }

    pub(super) fn bytes(&self) -> u64 {
        let chunk = |c: &Chunk| {
            c.stamps.capacity() * (size_of::<Stamp>() + 4)
                + c.clips.capacity() * size_of::<Clip>()
                + c.shadows.capacity() * size_of::<Wedge>()
                + 4 * (c.order.capacity() + c.starts.capacity())
        };
        self.chunks.iter().map(chunk).sum::<usize>() as u64
    }
}

/// The sum over one band, compiled for the widest vectors of the machine. No operation is contracted or reordered, so
/// the result is the same on all of them.
struct SumBand<'a> {
    chunks: &'a [Chunk],
    spec: &'a GridSpec,
    band: usize,
    rows: usize,
    sums: &'a mut BandSums,
}

impl pulp::WithSimd for SumBand<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let first = (self.band * BAND) as i32;
        let (width, rows) = (self.spec.size.x as i32, self.rows as i32);
        for chunk in self.chunks {
            let range = chunk.starts[self.band] as usize..chunk.starts[self.band + 1] as usize;
            for &k in &chunk.order[range] {
                let k = k as usize;
                let stamp = &chunk.stamps[k];
                if chunk.clip[k] == 0 && stamp.radius < (WIDEST / 2) as f32 {
                    // Half as many columns do where they are a whole number of vectors.
                    if stamp.radius < (WIDEST / 4) as f32 && S::F32_LANES < WIDEST {
                        add_small::<{ WIDEST / 2 }, S, _>(simd, stamp, first..first + rows, self.sums);
                    } else {
                        add_small::<WIDEST, S, _>(simd, stamp, first..first + rows, self.sums);
                    }
                    continue;
                }
                let reach = stamp.radius.ceil() as i32 + 1;
                let (from, to) = (
                    stamp.row.saturating_sub(reach).max(first),
                    stamp.row.saturating_add(reach + 1).min(first + rows),
                );
                for j in from..to {
                    let dz = (j - stamp.row) as f32 - stamp.fraction[1];
                    let square = stamp.radius * stamp.radius - dz * dz;
                    if square <= 0.0 {
                        continue;
                    }
                    // Samples strictly within the chord.
                    let chord = square.sqrt();
                    let a = (stamp.fraction[0] - chord).ceil() as i32 + stamp.column;
                    let b = (stamp.fraction[0] + chord).floor() as i32 + stamp.column;
                    let (a, b) = (a.max(0), b.min(width - 1));
                    if a > b {
                        continue;
                    }
                    let local = (j - first) as usize;
                    if chunk.clip[k] == 0 {
                        let begin = self.sums.place(local, a);
                        let len = ((b - a) as usize + 1).next_multiple_of(S::F32_LANES);
                        add_row(simd, stamp, a, dz, self.sums.target(begin..begin + len));
                    } else {
                        let clip = &chunk.clips[chunk.clip[k] as usize - 1];
                        let shadows = &chunk.shadows[clip.shadows.0..clip.shadows.1];
                        self.sums
                            .add_cut(simd, stamp, dz, (a, b), local, self.spec, j, clip, shadows);
                    }
                }
            }
        }
    }
}

impl BandSums {
    /// Adds one row of a stamp that walls cut.
    #[allow(clippy::too_many_arguments)] // the row, and what cuts it
    fn add_cut<S: pulp::Simd>(
        &mut self,
        simd: S,
        stamp: &Stamp,
        dz: f32,
        (a, b): (i32, i32),
        local: usize,
        spec: &GridSpec,
        j: i32,
        clip: &Clip,
        shadows: &[Wedge],
    ) {
        let spacing = f64::from(spec.spacing);
        let (x0, z) = (
            f64::from(spec.origin.x),
            f64::from(spec.origin.y) + spacing * f64::from(j),
        );
        // Half open in the same way everywhere, so that of two stretches that meet one has the sample between them.
        let columns = |(from, to): (f64, f64)| {
            let at = |x: f64| {
                ((x - x0) / spacing)
                    .ceil()
                    .clamp(f64::from(a), f64::from(b) + 1.0) as i32
            };
            (at(from), at(to))
        };
        let (from, to) = match &clip.window {
            Some(window) => columns(wedge_on_row(window, z)),
            None => (a, b + 1),
        };
        if from >= to {
            return;
        }
        let len = ((to - from) as usize).next_multiple_of(S::F32_LANES);
        let [h, cx, cz, mx, mz] = &mut self.scratch;
        fn begin(list: &mut [f32], len: usize) -> &mut [f32] {
            let n = len.min(list.len());
            list[..n].fill(0.0);
            &mut list[..n]
        }
        let target = Target {
            height: begin(h, len),
            carried: [begin(cx, len), begin(cz, len)],
            moved: [begin(mx, len), begin(mz, len)],
        };
        add_row(simd, stamp, from, dz, target);
        for shadow in shadows {
            let (s, e) = columns(wedge_on_row(shadow, z));
            let (s, e) = (s.max(from), e.min(to));
            if s < e {
                let span = (s - from) as usize..(e - from) as usize;
                for list in &mut self.scratch {
                    if !list.is_empty() {
                        list[span.clone()].fill(0.0);
                    }
                }
            }
        }
        let count = (to - from) as usize;
        let place = self.place(local, from);
        let [cx, cz] = &mut self.carried;
        let [mx, mz] = &mut self.moved;
        for (out, row) in [&mut self.height, cx, cz, mx, mz].into_iter().zip(&self.scratch) {
            if !out.is_empty() {
                for (o, v) in out[place..place + count].iter_mut().zip(row) {
                    *o += v;
                }
            }
        }
    }
}
