//! Fields of one periodic patch at a time: only those that are asked for are transformed.

use super::lattice::{Lattice, sin_cos_turns, wave_number};
use super::transform::{Transform, vectorised};
use rayon::prelude::*;
use rustfft::num_complex::Complex32;

/// A real field over the patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Field {
    /// η in metres.
    Elevation,
    /// Horizontal displacement along X in metres, coth(kd) i kx/k ĥ: towards the crests. (With −i, as often printed, the
    /// points would move away from them; codes then use a negative choppiness.)
    DisplacementX,
    /// Horizontal displacement along Z in metres.
    DisplacementZ,
    /// ∂η/∂x.
    SlopeX,
    /// ∂η/∂z.
    SlopeZ,
    /// ∂Dx/∂x.
    StretchXX,
    /// ∂Dz/∂z.
    StretchZZ,
    /// ∂Dx/∂z = ∂Dz/∂x.
    StretchXZ,
    /// Orbital velocity at the surface along X in m/s.
    VelocityX,
    /// Orbital velocity at the surface along Z in m/s.
    VelocityZ,
    /// ∂η/∂t in m/s.
    Rise,
}

impl Field {
    /// The factor on ĥ (or ∂ĥ/∂t) at wave number (kx, kz), and whether i multiplies it too. `per_k` is coth(kd)/k.
    #[inline(always)]
    pub(super) fn factor<T: std::ops::Mul<Output = T> + std::ops::Neg<Output = T> + From<f32> + Copy>(
        self,
        kx: T,
        kz: T,
        per_k: T,
    ) -> (T, bool) {
        match self {
            Self::Elevation | Self::Rise => (T::from(1.0), false),
            Self::DisplacementX | Self::VelocityX => (kx * per_k, true),
            Self::DisplacementZ | Self::VelocityZ => (kz * per_k, true),
            Self::SlopeX => (kx, true),
            Self::SlopeZ => (kz, true),
            Self::StretchXX => (-kx * kx * per_k, false),
            Self::StretchZZ => (-kz * kz * per_k, false),
            Self::StretchXZ => (-kx * kz * per_k, false),
        }
    }

    /// Whether the field is made of ∂ĥ/∂t rather than of ĥ.
    pub(super) fn is_rate(self) -> bool {
        matches!(self, Self::VelocityX | Self::VelocityZ | Self::Rise)
    }
}

/// A lattice of waves with what does not change from one time to the next.
#[derive(Debug)]
pub struct Patch {
    lattice: Lattice,
    kz: Vec<f32>,
    /// coth(kd)/k, laid out as the lattice.
    per_k: Vec<f32>,
}

/// Work space of a patch: transforms and spectra at one time.
#[derive(Debug)]
pub struct Work {
    transform: Transform,
    waves: Vec<Complex32>,
    rates: Vec<Complex32>,
}

impl Work {
    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        self.transform.bytes() + 8 * (self.waves.capacity() + self.rates.capacity()) as u64
    }
}

impl Patch {
    /// A patch in water of `depth` metres (infinite: deep).
    pub fn new(lattice: Lattice, depth: f64) -> Self {
        let (w, h) = (lattice.size.x as usize, lattice.size.y as usize);
        let kz: Vec<f32> = (0..h)
            .map(|n| wave_number(n, h, lattice.period.y) as f32)
            .collect();
        let mut per_k = vec![0.0; (w / 2 + 1) * h];
        for m in 0..=w / 2 {
            for n in 0..h {
                let k = wave_number(m, w, lattice.period.x).hypot(wave_number(n, h, lattice.period.y));
                if k > 0.0 {
                    per_k[m * h + n] = per_wave_number(k, depth) as f32;
                }
            }
        }
        Self { lattice, kz, per_k }
    }

    /// The waves.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Work space for this patch.
    pub fn work(&self) -> Work {
        Work {
            transform: Transform::new(self.lattice.size),
            waves: Vec::new(),
            rates: Vec::new(),
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        self.lattice.bytes() + 4 * (self.kz.len() + self.per_k.len()) as u64
    }

    /// Samples of one field at the time of the last [`Self::turn`], by a real transform. Its first `rows` rows, x fastest,
    /// go to `write` with their part of `out`.
    pub fn one<U: Send>(
        &self,
        field: Field,
        work: &mut Work,
        rows: usize,
        out: &mut [U],
        write: impl Fn(&[f32], &mut [U]) + Sync,
    ) {
        let (row, work) = self.rows(work);
        let fill = |m: usize, out: &mut [Complex32]| vectorised(|| row.of(field, m, out));
        work.real(self.lattice.active_rows, fill, rows, out, write);
    }

    /// Samples of two fields at the time of the last [`Self::turn`] by one complex transform, as real and imaginary parts.
    /// The first `rows` rows, x fastest, go to `write` with their part of `out`.
    pub fn two<U: Send>(
        &self,
        (a, b): (Field, Field),
        work: &mut Work,
        rows: usize,
        out: &mut [U],
        write: impl Fn(&[Complex32], &mut [U]) + Sync,
    ) {
        let (row, work) = self.rows(work);
        let fill = |m: usize, first: &mut [Complex32], second: &mut [Complex32]| {
            vectorised(|| {
                row.of(a, m, first);
                row.of(b, m, second);
            });
        };
        work.pair(self.lattice.active_rows, fill, rows, out, write);
    }

    fn rows<'a>(&'a self, work: &'a mut Work) -> (Rows<'a>, &'a mut Transform) {
        let rows = Rows {
            patch: self,
            waves: &work.waves,
            rates: &work.rates,
        };
        (rows, &mut work.transform)
    }

    /// Turns the waves to `time`, in seconds for free waves and as the fraction of the loop (0 to 1) for looping ones, as far
    /// as `fields` need it.
    pub fn turn(&self, time: f64, fields: &[Field], work: &mut Work) {
        let needs_waves = fields.iter().any(|f| !f.is_rate());
        let needs_rates = fields.iter().any(|f| f.is_rate());
        self.turn_rows(time, needs_waves, needs_rates, work);
    }

    /// ĥ and ∂ĥ/∂t at `time`, for the rows that hold waves.
    fn turn_rows(&self, time: f64, needs_waves: bool, needs_rates: bool, work: &mut Work) {
        let l = &self.lattice;
        let h = l.size.y as usize;
        let rows = l.active_rows.max(1);
        let fit = |list: &mut Vec<Complex32>, wanted: bool| {
            list.resize(if wanted { rows * h } else { 0 }, Complex32::default());
        };
        fit(&mut work.waves, needs_waves);
        fit(&mut work.rates, needs_rates);
        // An empty list has as many empty rows.
        let mut waves = work.waves.chunks_mut(h);
        let mut rates = work.rates.chunks_mut(h);
        let jobs: Vec<_> = (0..rows)
            .map(|m| {
                (
                    m,
                    waves.next().unwrap_or_default(),
                    rates.next().unwrap_or_default(),
                )
            })
            .collect();
        jobs.into_par_iter().for_each_init(
            || Turns::new(h),
            |turn, (m, waves, rates)| vectorised(|| turn_row(l, m, time, waves, rates, turn)),
        );
    }
}

/// Rows of the spectra of fields at one time.
struct Rows<'a> {
    patch: &'a Patch,
    waves: &'a [Complex32],
    rates: &'a [Complex32],
}

impl Rows<'_> {
    /// Row `m` of a field.
    #[inline(always)]
    fn of(&self, field: Field, m: usize, out: &mut [Complex32]) {
        let lattice = &self.patch.lattice;
        let row = m * out.len()..(m + 1) * out.len();
        let from = if field.is_rate() { self.rates } else { self.waves };
        let kx = wave_number(m, lattice.size.x as usize, lattice.period.x) as f32;
        multiply(
            field,
            &from[row.clone()],
            kx,
            &self.patch.kz,
            &self.patch.per_k[row],
            out,
        );
    }
}

/// How far the wave numbers of a row have turned, as plain arrays so that loops over them vectorise.
struct Turns {
    cos: Vec<f32>,
    sin: Vec<f32>,
    /// rad/s.
    omega: Vec<f32>,
}

impl Turns {
    fn new(h: usize) -> Self {
        let zeros = || vec![0.0; h];
        Self {
            cos: zeros(),
            sin: zeros(),
            omega: zeros(),
        }
    }
}

/// ĥ and ∂ĥ/∂t of row `m` of kx at `time`; a list that is not wanted is empty.
#[inline(always)]
fn turn_row(
    l: &Lattice,
    m: usize,
    time: f64,
    waves: &mut [Complex32],
    rates: &mut [Complex32],
    turn: &mut Turns,
) {
    let h = turn.cos.len();
    let quarter = h / 2 + 1;
    let (even, odd) = (&l.even[m * h..(m + 1) * h], &l.odd[m * h..(m + 1) * h]);
    let turns = &l.turns[m * quarter..(m + 1) * quarter];
    let Turns { cos, sin, omega } = turn;
    for ((cos, sin), turns) in cos.iter_mut().zip(&mut *sin).zip(turns) {
        (*sin, *cos) = sin_cos_turns(turns * time);
    }
    let mirror = |list: &mut [f32]| {
        // The same for −kz.
        let (known, mirrored) = list.split_at_mut(quarter.min(h));
        for (out, known) in mirrored.iter_mut().rev().zip(&known[1..]) {
            *out = *known;
        }
    };
    mirror(cos);
    mirror(sin);
    let phases = || cos.iter().zip(&*sin);
    for (((c, e), o), (cos, sin)) in waves.iter_mut().zip(even).zip(odd).zip(phases()) {
        *c = Complex32::new(e.re * cos + o.re * sin, e.im * cos + o.im * sin);
    }
    if rates.is_empty() {
        return;
    }
    for (omega, turns) in omega.iter_mut().zip(turns) {
        *omega = (turns * l.radians) as f32;
    }
    mirror(omega);
    for ((((c, e), o), (cos, sin)), omega) in rates.iter_mut().zip(even).zip(odd).zip(phases()).zip(&*omega) {
        *c = Complex32::new(
            omega * (o.re * cos - e.re * sin),
            omega * (o.im * cos - e.im * sin),
        );
    }
}

/// coth(kd)/k in metres for `k` > 0.
pub(super) fn per_wave_number(k: f64, depth: f64) -> f64 {
    1.0 / (k * (k * depth).tanh())
}

/// A row of a field's spectrum from one of ĥ or ∂ĥ/∂t.
#[inline(always)]
fn multiply(field: Field, from: &[Complex32], kx: f32, kz: &[f32], per_k: &[f32], out: &mut [Complex32]) {
    // The field is told apart outside the loop, so that each loop is a plain one.
    macro_rules! each {
        ($($name:ident)*) => {
            match field {
                $(Field::$name => {
                    for (((c, a), kz), per_k) in out.iter_mut().zip(from).zip(kz).zip(per_k) {
                        let (factor, imaginary) = Field::$name.factor(kx, *kz, *per_k);
                        *c = if imaginary {
                            Complex32::new(-factor * a.im, factor * a.re)
                        } else {
                            Complex32::new(factor * a.re, factor * a.im)
                        };
                    }
                })*
            }
        };
    }
    each!(Elevation DisplacementX DisplacementZ SlopeX SlopeZ StretchXX StretchZZ StretchXZ VelocityX VelocityZ Rise);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dispersion::Dispersion;
    use crate::ocean::lattice::Draw;
    use crate::ocean::sea::WaveField;
    use crate::scene::description::{Sea, Spectrum, Spreading};
    use glam::{DVec2, UVec2};
    use std::f64::consts::TAU;

    fn sea(depth: Option<f64>) -> WaveField {
        let wind = Sea {
            spectrum: Spectrum::Jonswap {
                wind: 10.0,
                fetch: 5e4,
                gamma: 3.3,
            },
            direction: 20.0,
            spreading: Spreading::Hasselmann,
        };
        WaveField::new(&[wind], Dispersion::new(depth))
    }

    fn patch(size: UVec2, depth: Option<f64>) -> Patch {
        let draw = Draw {
            period: DVec2::new(200.0, 150.0),
            size,
            band: (0.0, f64::INFINITY),
            seed: 3,
            patch: 0,
            loop_period: None,
        };
        Patch::new(Lattice::new(&sea(depth), &draw), depth.unwrap_or(f64::INFINITY))
    }

    /// The samples of two fields at the time of the last turn.
    fn pair(patch: &Patch, fields: (Field, Field), work: &mut Work) -> Vec<Complex32> {
        let size = patch.lattice.size.as_usizevec2();
        let mut out = vec![Complex32::default(); size.element_product()];
        patch.two(fields, work, size.y, &mut out, |row, out| {
            out.copy_from_slice(row)
        });
        out
    }

    /// The samples of one field at the time of the last turn.
    fn single(patch: &Patch, field: Field, work: &mut Work) -> Vec<f32> {
        let size = patch.lattice.size.as_usizevec2();
        let mut out = vec![0.0; size.element_product()];
        patch.one(field, work, size.y, &mut out, |row, out| out.copy_from_slice(row));
        out
    }

    /// The samples of every field at a time, two to a transform.
    fn samples(patch: &Patch, time: f64) -> Vec<Vec<f32>> {
        let mut work = patch.work();
        patch.turn(time, &ALL, &mut work);
        let mut out = Vec::new();
        for fields in ALL.chunks(2) {
            if let [a, b] = *fields {
                let both = pair(patch, (a, b), &mut work);
                out.push(both.iter().map(|c| c.re).collect());
                out.push(both.iter().map(|c| c.im).collect());
            } else {
                out.push(single(patch, fields[0], &mut work));
            }
        }
        out
    }

    const ALL: [Field; 11] = [
        Field::Elevation,
        Field::DisplacementX,
        Field::DisplacementZ,
        Field::SlopeX,
        Field::SlopeZ,
        Field::StretchXX,
        Field::StretchZZ,
        Field::StretchXZ,
        Field::VelocityX,
        Field::VelocityZ,
        Field::Rise,
    ];

    /// The fields at sample (i, j), summed mode by mode in f64.
    fn oracle(patch: &Patch, depth: f64, time: f64, i: usize, j: usize) -> [f64; 11] {
        let l = patch.lattice();
        let (w, h) = (l.size.x as usize, l.size.y as usize);
        let dispersion = Dispersion::new(Some(depth));
        let mut sums = [0.0; 11];
        for m in 0..=w / 2 {
            for n in 0..h {
                let at = m * h + n;
                let (kx, kz) = (wave_number(m, w, l.period.x), wave_number(n, h, l.period.y));
                let k = kx.hypot(kz);
                if k == 0.0 {
                    continue;
                }
                let omega = dispersion.omega(k);
                let (sin, cos) = (omega * time).sin_cos();
                let (e, o) = (l.even[at], l.odd[at]);
                let (er, ei, or, oi) = (f64::from(e.re), f64::from(e.im), f64::from(o.re), f64::from(o.im));
                let (re, im) = (er * cos + or * sin, ei * cos + oi * sin);
                let (vr, vi) = (omega * (or * cos - er * sin), omega * (oi * cos - ei * sin));
                let phase = TAU * ((m * i) as f64 / w as f64 + (n * j) as f64 / h as f64);
                let (s, c) = phase.sin_cos();
                // Entries off the axis kx = 0 stand for themselves and their conjugate.
                let weight = if m == 0 { 1.0 } else { 2.0 };
                let real = |a: f64, b: f64| weight * (a * c - b * s);
                let per_k = 1.0 / (k * (k * depth).tanh());
                let turned = real(-im, re);
                let values = [
                    real(re, im),
                    kx * per_k * turned,
                    kz * per_k * turned,
                    kx * turned,
                    kz * turned,
                    -kx * kx * per_k * real(re, im),
                    -kz * kz * per_k * real(re, im),
                    -kx * kz * per_k * real(re, im),
                    kx * per_k * real(-vi, vr),
                    kz * per_k * real(-vi, vr),
                    real(vr, vi),
                ];
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum += value;
                }
            }
        }
        sums
    }

    #[test]
    fn transforms_equal_the_sum_of_the_waves_after_a_day() {
        for (size, depth) in [
            (UVec2::new(32, 24), None),
            (UVec2::new(15, 20), Some(8.0)),
            (UVec2::new(18, 9), None),
        ] {
            let patch = patch(size, depth);
            let time = 1e5 + 0.37;
            let out = samples(&patch, time);
            let mut scale = [0.0_f64; 11];
            let mut worst = [0.0_f64; 11];
            for (i, j) in [(0, 0), (3, 1), (7, 8), (14, 5), (9, 7), (1, 3)] {
                let truth = oracle(&patch, depth.unwrap_or(f64::INFINITY), time, i, j);
                for f in 0..11 {
                    let value = f64::from(out[f][j * size.x as usize + i]);
                    scale[f] = scale[f].max(truth[f].abs());
                    worst[f] = worst[f].max((value - truth[f]).abs());
                }
            }
            for f in 0..11 {
                assert!(
                    worst[f] <= 3e-6 * scale[f],
                    "{:?} {size}: {} of {}",
                    ALL[f],
                    worst[f],
                    scale[f]
                );
            }
        }
    }

    #[test]
    fn a_field_is_the_same_alone_and_packed_and_nothing_is_left_over() {
        let patch = patch(UVec2::new(64, 64), None);
        let (a, b) = (Field::DisplacementX, Field::SlopeZ);
        let mut work = patch.work();
        patch.turn(12.5, &ALL, &mut work);
        let both = pair(&patch, (a, b), &mut work);
        let parts: [fn(&Complex32) -> f32; 2] = [|c| c.re, |c| c.im];
        for (field, part) in [a, b].into_iter().zip(parts) {
            let alone = single(&patch, field, &mut work);
            let scale = alone.iter().fold(0.0_f32, |m, v| m.max(v.abs()));
            for (alone, packed) in alone.iter().zip(both.iter().map(part)) {
                assert!((alone - packed).abs() < 2e-6 * scale);
            }
            // Beside a field of zeros, what arrives there is the imaginary residue of the transform.
            let mut out = vec![Complex32::default(); 64 * 64];
            let (rows, transform) = patch.rows(&mut work);
            let fill = |m: usize, first: &mut [Complex32], second: &mut [Complex32]| {
                rows.of(field, m, first);
                second.fill(Complex32::default());
            };
            let active = patch.lattice.active_rows;
            transform.pair(active, fill, 64, &mut out, |row, out| out.copy_from_slice(row));
            let residue = out.iter().fold(0.0_f32, |m, v| m.max(v.im.abs()));
            assert!(residue < 1e-6 * scale, "{residue} of {scale}");
        }
    }

    #[test]
    fn nothing_depends_on_the_number_of_threads() {
        let patch = patch(UVec2::new(48, 40), Some(12.0));
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| samples(&patch, 7.25))
        };
        assert_eq!(run(1), run(3));
    }
}
