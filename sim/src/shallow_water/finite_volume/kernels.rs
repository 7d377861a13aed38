//! One row of cells at a time: velocities, reconstruction, faces, draining, update.
//!
//! The scheme is MUSCL-Hancock (van Leer 1979; Toro, *Shock-Capturing Methods for Free-Surface Shallow Flows*, 2001,
//! §9.4) without directional splitting, over hydrostatically reconstructed beds (Audusse, Bouchut, Bristeau, Klein &
//! Perthame 2004, doi:10.1137/S1064827503431090, §2.3 and §5). Symbols: `h` depth, `z` bed, `η = h + z`, `(u, v)` velocity
//! along X and Z, `λ = Δt/Δx`.
//!
//! Heights enter only as differences between neighbours, so that a lake in a high valley costs no digits. All depths,
//! beds and mass fluxes are multiples of one quantum: their sums are exact, which makes water conserved to the last
//! bit and a lake at rest exactly still.

use super::super::real::Real;

/// Cells of a row that a tile can hold, its halo included.
pub(in super::super) const LANES: usize = 272;

/// One value for each cell of a tile's row.
pub(in super::super) type Row<T> = [T; LANES];

/// What the kernels need to know besides the state.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Constants<T> {
    /// Gravity, m/s².
    pub(in super::super) gravity: T,
    /// Δt/Δx, s/m.
    pub(in super::super) lambda: T,
    /// Adding and subtracting this rounds to a multiple of the quantum.
    pub(in super::super) rounder: T,
    /// The quantum of depth, m.
    pub(in super::super) quantum: T,
    /// Depth below which velocities fade, m.
    pub(in super::super) film: T,
    /// Depth up to which a cell counts as dry, m.
    pub(in super::super) dry: T,
    /// Depth from which the quantum is too fine, m.
    pub(in super::super) depth_limit: T,
    /// Momentum per area from which a run counts as unstable, m²/s.
    pub(in super::super) momentum_limit: T,
    /// g n² Δt for Manning's roughness n; 0 without friction.
    pub(in super::super) friction: T,
}

impl<T: Real> Constants<T> {
    #[inline(always)]
    pub(in super::super) fn round(&self, x: T) -> T {
        (x + self.rounder) - self.rounder
    }
}

/// Depth, bed and velocity of one row; all of one length.
#[derive(Clone, Copy)]
pub(in super::super) struct RowView<'a, T> {
    pub(in super::super) h: &'a [T],
    pub(in super::super) z: &'a [T],
    pub(in super::super) u: &'a [T],
    pub(in super::super) v: &'a [T],
}

/// Velocities of a row.
#[derive(Clone)]
pub(in super::super) struct Velocities<T> {
    pub(in super::super) u: Row<T>,
    pub(in super::super) v: Row<T>,
}

/// A row at the half step: the centre value of each quantity and half its difference across the cell.
#[derive(Clone)]
pub(in super::super) struct Cells<T> {
    pub(in super::super) h: Row<T>,
    u: Row<T>,
    v: Row<T>,
    /// Halves of the differences along X of surface, bed, u, v.
    pub(in super::super) xe: Row<T>,
    pub(in super::super) xz: Row<T>,
    pub(in super::super) xu: Row<T>,
    pub(in super::super) xv: Row<T>,
    /// The same along Z.
    pub(in super::super) ze: Row<T>,
    pub(in super::super) zz: Row<T>,
    pub(in super::super) zu: Row<T>,
    pub(in super::super) zv: Row<T>,
}

/// Fluxes through a row of faces. Along X, entry `c` is the face between cells `c` and `c + 1`; along Z, the face
/// between cell `c` of this row and of the next.
#[derive(Clone)]
pub(in super::super) struct Faces<T> {
    /// Depth that crosses the face in the step, a multiple of the quantum, m.
    pub(in super::super) mass: Row<T>,
    /// Flux of normal momentum less the pressure of the cell before the face, m³/s².
    pub(in super::super) before: Row<T>,
    /// The same less the pressure of the cell behind the face.
    pub(in super::super) behind: Row<T>,
    /// Flux of transverse momentum, m³/s².
    pub(in super::super) across: Row<T>,
}

impl<T: Real> Velocities<T> {
    pub(in super::super) const ZERO: Self = Self {
        u: [T::ZERO; LANES],
        v: [T::ZERO; LANES],
    };
}

impl<T: Real> Cells<T> {
    pub(in super::super) const ZERO: Self = Self {
        h: [T::ZERO; LANES],
        u: [T::ZERO; LANES],
        v: [T::ZERO; LANES],
        xe: [T::ZERO; LANES],
        xz: [T::ZERO; LANES],
        xu: [T::ZERO; LANES],
        xv: [T::ZERO; LANES],
        ze: [T::ZERO; LANES],
        zz: [T::ZERO; LANES],
        zu: [T::ZERO; LANES],
        zv: [T::ZERO; LANES],
    };
}

impl<T: Real> Faces<T> {
    pub(in super::super) const ZERO: Self = Self {
        mass: [T::ZERO; LANES],
        before: [T::ZERO; LANES],
        behind: [T::ZERO; LANES],
        across: [T::ZERO; LANES],
    };
}

/// u = q/h, fading to 0 in films (after Kurganov & Petrova 2007, eq. 2.17).
#[inline(always)]
pub(in super::super) fn velocities<T: Real>(
    k: &Constants<T>,
    h: &[T],
    qx: &[T],
    qz: &[T],
    out: &mut Velocities<T>,
) {
    let n = h.len();
    let (qx, qz) = (&qx[..n], &qz[..n]);
    let (u, v) = (&mut out.u[..n], &mut out.v[..n]);
    for c in 0..n {
        let film = h[c].larger(k.film);
        let inverse = (h[c] + h[c]) / (h[c] * h[c] + film * film);
        u[c] = qx[c] * inverse;
        v[c] = qz[c] * inverse;
    }
}

/// Steepest slope in units of the smaller one-sided difference. The monotonised central limiter has 2; a little less
/// keeps a standing jump from ringing and costs hardly anything elsewhere (measured in `docs/numerics-shallow-water.md`).
const STEEPEST: f64 = 1.8;

/// Central difference (a + b)/2, within [`STEEPEST`] times a and b, 0 at an extremum (van Leer 1977's limiter).
#[inline(always)]
fn limited<T: Real>(a: T, b: T) -> T {
    let steepest = T::from_f64(STEEPEST);
    let most = steepest * a.smaller(b).larger(T::ZERO);
    let least = steepest * a.larger(b).smaller(T::ZERO);
    (T::HALF * (a + b)).smaller(most).larger(least)
}

/// Limited differences across each cell and the half step in time (Toro 2001, eq. 9.44, in primitive variables).
#[inline(always)]
pub(in super::super) fn reconstruct<T: Real>(
    k: &Constants<T>,
    before: RowView<'_, T>,
    here: RowView<'_, T>,
    behind: RowView<'_, T>,
    out: &mut Cells<T>,
) {
    let n = here.h.len();
    let m = n - 2;
    // Neighbours along X: west, centre, east; along Z: the rows before and behind.
    let (hw, hc, he) = (&here.h[..m], &here.h[1..=m], &here.h[2..n]);
    let (zw, zc, ze) = (&here.z[..m], &here.z[1..=m], &here.z[2..n]);
    let (uw, uc, ue) = (&here.u[..m], &here.u[1..=m], &here.u[2..n]);
    let (vw, vc, ve) = (&here.v[..m], &here.v[1..=m], &here.v[2..n]);
    let (hb, zb, ub, vb) = (
        &before.h[1..=m],
        &before.z[1..=m],
        &before.u[1..=m],
        &before.v[1..=m],
    );
    let (hf, zf, uf, vf) = (
        &behind.h[1..=m],
        &behind.z[1..=m],
        &behind.u[1..=m],
        &behind.v[1..=m],
    );
    let (oh, ou, ov) = (&mut out.h[1..=m], &mut out.u[1..=m], &mut out.v[1..=m]);
    let (oxe, oxz, oxu, oxv) = (
        &mut out.xe[1..=m],
        &mut out.xz[1..=m],
        &mut out.xu[1..=m],
        &mut out.xv[1..=m],
    );
    let (oze, ozz, ozu, ozv) = (
        &mut out.ze[1..=m],
        &mut out.zz[1..=m],
        &mut out.zu[1..=m],
        &mut out.zv[1..=m],
    );
    let half_lambda = T::HALF * k.lambda;
    for c in 0..m {
        let (h, u, v) = (hc[c], uc[c], vc[c]);
        let wet = h > k.dry;
        let gate = |slope: T| if wet { slope } else { T::ZERO };
        // A surface that falls by more than the depth across a cell would push water that is not there.
        let held = |slope: T| slope.smaller(h).larger(-h);

        let (h1, h2) = (h - hw[c], he[c] - h);
        let (z1, z2) = (zc[c] - zw[c], ze[c] - zc[c]);
        let dhx = gate(limited(h1, h2));
        let dex = gate(held(limited(h1 + z1, h2 + z2)));
        let dux = gate(limited(u - uw[c], ue[c] - u));
        let dvx = gate(limited(v - vw[c], ve[c] - v));

        let (h1, h2) = (h - hb[c], hf[c] - h);
        let (z1, z2) = (zc[c] - zb[c], zf[c] - zc[c]);
        let dhz = gate(limited(h1, h2));
        let dez = gate(held(limited(h1 + z1, h2 + z2)));
        let duz = gate(limited(u - ub[c], uf[c] - u));
        let dvz = gate(limited(v - vb[c], vf[c] - v));

        let outflow = half_lambda * (u * dhx + v * dhz + h * (dux + dvz));
        // No corner of the cell may run dry within the half step.
        let spare = h - T::HALF * dhx.abs().larger(dhz.abs());
        oh[c] = h - outflow.smaller(spare);
        ou[c] = u - half_lambda * (u * dux + v * duz + k.gravity * dex);
        ov[c] = v - half_lambda * (u * dvx + v * dvz + k.gravity * dez);
        oxe[c] = T::HALF * dex;
        oxz[c] = T::HALF * (dex - dhx);
        oxu[c] = T::HALF * dux;
        oxv[c] = T::HALF * dvx;
        oze[c] = T::HALF * dez;
        ozz[c] = T::HALF * (dez - dhz);
        ozu[c] = T::HALF * duz;
        ozv[c] = T::HALF * dvz;
    }
}

/// Manning's friction over the half step, so that a steady flow, in which it balances the bed's slope, stays steady.
#[inline(always)]
pub(in super::super) fn rub_half<T: Real>(k: &Constants<T>, here: RowView<'_, T>, out: &mut Cells<T>) {
    let n = here.h.len();
    let m = n - 2;
    let (h, u, v) = (&here.h[1..=m], &here.u[1..=m], &here.v[1..=m]);
    let (ou, ov) = (&mut out.u[1..=m], &mut out.v[1..=m]);
    let half = T::HALF * k.friction;
    for c in 0..m {
        let depth = h[c].larger(k.dry);
        let speed = (u[c] * u[c] + v[c] * v[c]).sqrt();
        let factor = T::ONE / (T::ONE + half * speed * depth.inverse_cube_root() / depth);
        ou[c] = ou[c] * factor;
        ov[c] = ov[c] * factor;
    }
}

/// What one face lets through.
struct Flux<T> {
    mass: T,
    before: T,
    behind: T,
    across: T,
    speed: T,
}

/// The state on one side of a face: surface and bed relative to the bed of the cell before the face, normal and
/// transverse velocity.
struct Side<T> {
    e: T,
    z: T,
    u: T,
    v: T,
}

/// HLL flux (Harten, Lax & van Leer 1983) between hydrostatically reconstructed depths, with the two-rarefaction
/// speeds and the dry-bed limits of Toro 2001 (§10.3); transverse momentum goes with the mass, from the side it leaves.
#[inline(always)]
fn flux<T: Real>(k: &Constants<T>, l: Side<T>, r: Side<T>) -> Flux<T> {
    let bed = l.z.larger(r.z);
    let a = (l.e - bed).larger(T::ZERO);
    let b = (r.e - bed).larger(T::ZERO);
    let (cl, cr) = ((k.gravity * a).sqrt(), (k.gravity * b).sqrt());
    let middle = T::HALF * (l.u + r.u) + (cl - cr);
    let celerity = T::HALF * (cl + cr) + T::QUARTER * (l.u - r.u);
    let (left_dry, right_dry) = (a <= T::ZERO, b <= T::ZERO);
    let first = (l.u - cl).smaller(middle - celerity);
    let last = (r.u + cr).larger(middle + celerity);
    let first = if left_dry {
        r.u - T::TWO * cr
    } else if right_dry {
        l.u - cl
    } else {
        first
    };
    let last = if right_dry {
        l.u + T::TWO * cl
    } else if left_dry {
        r.u + cr
    } else {
        last
    };
    let (first, last) = (first.smaller(T::ZERO), last.larger(T::ZERO));
    let inverse = T::ONE / (last - first).larger(T::TINY);
    let (wl, wr, w) = (last * inverse, -first * inverse, first * last * inverse);

    let (ql, qr) = (a * l.u, b * r.u);
    let mass = (wl * ql + wr * qr) + w * (b - a);
    let pressure = T::HALF * k.gravity * (b - a) * (b + a);
    // Written so that a mirrored state gives the mirrored flux to the bit.
    let carried = (wl * (ql * l.u) + wr * (qr * r.u)) + w * (qr - ql);
    let across = mass * if mass > T::ZERO { l.v } else { r.v };
    let speed = if left_dry && right_dry {
        T::ZERO
    } else {
        last.larger(-first)
    };
    Flux {
        mass: k.round(k.lambda * mass),
        before: carried + wr * pressure,
        behind: carried - wl * pressure,
        across,
        speed,
    }
}

/// Faces along X of one row; `speed` keeps the fastest signal seen in each column.
#[inline(always)]
pub(in super::super) fn faces_x<T: Real>(
    k: &Constants<T>,
    z: &[T],
    cells: &Cells<T>,
    out: &mut Faces<T>,
    speed: &mut Row<T>,
) {
    let n = z.len();
    let m = n - 3;
    // Cells 1 ..= m stand before the faces, cells 2 ..= m + 1 behind.
    let (zl, zr) = (&z[1..=m], &z[2..m + 2]);
    let (hl, hr) = (&cells.h[1..=m], &cells.h[2..m + 2]);
    let (ul, ur) = (&cells.u[1..=m], &cells.u[2..m + 2]);
    let (vl, vr) = (&cells.v[1..=m], &cells.v[2..m + 2]);
    let (del, der) = (&cells.xe[1..=m], &cells.xe[2..m + 2]);
    let (dzl, dzr) = (&cells.xz[1..=m], &cells.xz[2..m + 2]);
    let (dul, dur) = (&cells.xu[1..=m], &cells.xu[2..m + 2]);
    let (dvl, dvr) = (&cells.xv[1..=m], &cells.xv[2..m + 2]);
    let (mass, across) = (&mut out.mass[1..=m], &mut out.across[1..=m]);
    let (before, behind) = (&mut out.before[1..=m], &mut out.behind[1..=m]);
    let speed = &mut speed[1..=m];
    for c in 0..m {
        let left = Side {
            e: hl[c] + del[c],
            z: dzl[c],
            u: ul[c] + dul[c],
            v: vl[c] + dvl[c],
        };
        let right = Side {
            e: (zr[c] - zl[c]) + (hr[c] - der[c]),
            z: (zr[c] - zl[c]) - dzr[c],
            u: ur[c] - dur[c],
            v: vr[c] - dvr[c],
        };
        let f = flux(k, left, right);
        mass[c] = f.mass;
        before[c] = f.before;
        behind[c] = f.behind;
        across[c] = f.across;
        speed[c] = f.speed.larger(speed[c]);
    }
}

/// Faces along Z between two rows.
#[inline(always)]
pub(in super::super) fn faces_z<T: Real>(
    k: &Constants<T>,
    z: (&[T], &[T]),
    cells: (&Cells<T>, &Cells<T>),
    out: &mut Faces<T>,
    speed: &mut Row<T>,
) {
    let n = z.0.len();
    let m = n - 2;
    let (zl, zr) = (&z.0[1..=m], &z.1[1..=m]);
    let (l, r) = cells;
    let (hl, hr) = (&l.h[1..=m], &r.h[1..=m]);
    let (ul, ur) = (&l.u[1..=m], &r.u[1..=m]);
    let (vl, vr) = (&l.v[1..=m], &r.v[1..=m]);
    let (del, der) = (&l.ze[1..=m], &r.ze[1..=m]);
    let (dzl, dzr) = (&l.zz[1..=m], &r.zz[1..=m]);
    let (dul, dur) = (&l.zu[1..=m], &r.zu[1..=m]);
    let (dvl, dvr) = (&l.zv[1..=m], &r.zv[1..=m]);
    let (mass, across) = (&mut out.mass[1..=m], &mut out.across[1..=m]);
    let (before, behind) = (&mut out.before[1..=m], &mut out.behind[1..=m]);
    let speed = &mut speed[1..=m];
    for c in 0..m {
        let left = Side {
            e: hl[c] + del[c],
            z: dzl[c],
            u: vl[c] + dvl[c],
            v: ul[c] + dul[c],
        };
        let right = Side {
            e: (zr[c] - zl[c]) + (hr[c] - der[c]),
            z: (zr[c] - zl[c]) - dzr[c],
            u: vr[c] - dvr[c],
            v: ur[c] - dur[c],
        };
        let f = flux(k, left, right);
        mass[c] = f.mass;
        before[c] = f.before;
        behind[c] = f.behind;
        across[c] = f.across;
        speed[c] = f.speed.larger(speed[c]);
    }
}

/// The share of its outgoing fluxes that each cell of a row can pay for with the water it has; says whether any cell
/// cannot pay all (Bollermann, Noelle & Lukáčová 2011, doi:10.4208/cicp.220210.020710a, the draining time).
#[inline(always)]
pub(in super::super) fn shares<T: Real>(
    k: &Constants<T>,
    h: &[T],
    x: &Faces<T>,
    z: (&Faces<T>, &Faces<T>),
    out: &mut Row<T>,
) -> bool {
    let n = h.len();
    let m = n - 4;
    // Cells 2 ..= m + 1, whose four faces are all known.
    let h = &h[2..m + 2];
    let (west, east) = (&x.mass[1..=m], &x.mass[2..m + 2]);
    let (first, last) = (&z.0.mass[2..m + 2], &z.1.mass[2..m + 2]);
    let out = &mut out[2..m + 2];
    let mut short = 0_u32;
    for c in 0..m {
        let need = (T::ZERO.larger(-west[c]) + T::ZERO.larger(east[c]))
            + (T::ZERO.larger(-first[c]) + T::ZERO.larger(last[c]));
        short |= u32::from(need > h[c]);
        out[c] = need;
    }
    if short == 0 {
        return false;
    }
    for c in 0..m {
        let need = out[c];
        // Rounding the shares may add half a quantum at each of four faces.
        let spare = (h[c] - T::TWO * k.quantum).larger(T::ZERO);
        out[c] = if need > h[c] { spare / need } else { T::ONE };
    }
    true
}

/// Scales the faces along X of a row by the share of the cell that the water leaves.
#[inline(always)]
pub(in super::super) fn drain_x<T: Real>(k: &Constants<T>, n: usize, share: &Row<T>, faces: &mut Faces<T>) {
    let m = n - 5;
    drain(k, &share[2..m + 2], &share[3..m + 3], faces, 2, m);
}

/// Scales the faces along Z between two rows by the share of the cell that the water leaves.
#[inline(always)]
pub(in super::super) fn drain_z<T: Real>(
    k: &Constants<T>,
    n: usize,
    share: (&Row<T>, &Row<T>),
    faces: &mut Faces<T>,
) {
    let m = n - 4;
    drain(k, &share.0[2..m + 2], &share.1[2..m + 2], faces, 2, m);
}

#[inline(always)]
fn drain<T: Real>(k: &Constants<T>, left: &[T], right: &[T], faces: &mut Faces<T>, start: usize, m: usize) {
    let (mass, across) = (
        &mut faces.mass[start..start + m],
        &mut faces.across[start..start + m],
    );
    let (before, behind) = (
        &mut faces.before[start..start + m],
        &mut faces.behind[start..start + m],
    );
    for c in 0..m {
        let share = if mass[c] > T::ZERO { left[c] } else { right[c] };
        let all = share >= T::ONE;
        mass[c] = if all { mass[c] } else { k.round(mass[c] * share) };
        across[c] = across[c] * share;
        before[c] = before[c] * share;
        behind[c] = behind[c] * share;
    }
}

/// Bits that [`update`] returns.
pub(in super::super) mod flag {
    /// Some cell changed or carries momentum.
    pub(in super::super::super) const ALIVE: u32 = 1;
    /// Some depth passed the limit of the quantum.
    pub(in super::super::super) const DEEP: u32 = 2;
    /// Some value is not finite or beyond its limit.
    pub(in super::super::super) const BROKEN: u32 = 4;
}

/// The state of one row, or the place for it.
pub(in super::super) struct State<'a, T> {
    pub(in super::super) h: &'a [T],
    pub(in super::super) qx: &'a [T],
    pub(in super::super) qz: &'a [T],
}

/// Adds the fluxes and the bed force to one row: cells 3 .. n − 3 of the views go to `h`, `qx`, `qz`.
#[inline(always)]
#[expect(
    clippy::too_many_arguments,
    reason = "outputs must be separate references for the loop to vectorise"
)]
pub(in super::super) fn update<T: Real>(
    k: &Constants<T>,
    old: State<'_, T>,
    cells: &Cells<T>,
    x: &Faces<T>,
    z: (&Faces<T>, &Faces<T>),
    h: &mut [T],
    qx: &mut [T],
    qz: &mut [T],
) -> u32 {
    let m = h.len();
    let (qx, qz) = (&mut qx[..m], &mut qz[..m]);
    let (h0, qx0, qz0) = (&old.h[3..m + 3], &old.qx[3..m + 3], &old.qz[3..m + 3]);
    let (hc, xe, ze) = (&cells.h[3..m + 3], &cells.xe[3..m + 3], &cells.ze[3..m + 3]);
    let (wm, em) = (&x.mass[2..m + 2], &x.mass[3..m + 3]);
    let (wp, ep) = (&x.behind[2..m + 2], &x.before[3..m + 3]);
    let (wa, ea) = (&x.across[2..m + 2], &x.across[3..m + 3]);
    let (fm, lm) = (&z.0.mass[3..m + 3], &z.1.mass[3..m + 3]);
    let (fp, lp) = (&z.0.behind[3..m + 3], &z.1.before[3..m + 3]);
    let (fa, la) = (&z.0.across[3..m + 3], &z.1.across[3..m + 3]);
    let two_g = k.gravity + k.gravity;
    for c in 0..m {
        // ½ g (h₊ + h₋)(η₊ − η₋): the bed force and the cell's own pressure in one, exactly 0 under a level surface.
        let slope_x = two_g * hc[c] * xe[c];
        let slope_z = two_g * hc[c] * ze[c];
        h[c] = (h0[c] + (wm[c] - em[c])) + (fm[c] - lm[c]);
        qx[c] = qx0[c] + k.lambda * ((wp[c] - ep[c]) - slope_x + (fa[c] - la[c]));
        qz[c] = qz0[c] + k.lambda * ((fp[c] - lp[c]) - slope_z + (wa[c] - ea[c]));
    }
    finish(k, (h0, qx0, qz0), h, qx, qz)
}

/// What follows the fluxes in a row: films settle, friction acts, and the new state is looked at; bits of [`flag`].
#[inline(always)]
pub(in super::super) fn finish<T: Real>(
    k: &Constants<T>,
    old: (&[T], &[T], &[T]),
    h: &[T],
    qx: &mut [T],
    qz: &mut [T],
) -> u32 {
    let mut thin = 0_u32;
    for c in 0..h.len() {
        thin |= u32::from(h[c] < k.film);
    }
    if thin != 0 {
        settle_films(k, h, qx, qz);
    }
    if k.friction > T::ZERO {
        rub(k, h, qx, qz);
    }
    inspect(k, old, (h, qx, qz))
}

/// What a row's update found, as bits of [`flag`].
#[inline(always)]
pub(in super::super) fn inspect<T: Real>(
    k: &Constants<T>,
    old: (&[T], &[T], &[T]),
    new: (&[T], &[T], &[T]),
) -> u32 {
    let m = new.0.len();
    let (h0, qx0, qz0) = (&old.0[..m], &old.1[..m], &old.2[..m]);
    let (h, qx, qz) = (&new.0[..m], &new.1[..m], &new.2[..m]);
    let (mut alive, mut deep, mut broken) = (0_u32, 0_u32, 0_u32);
    for c in 0..m {
        let motion = (qx[c].abs() + qz[c].abs()) + (qx0[c].abs() + qz0[c].abs());
        alive |= u32::from(motion + (h[c] - h0[c]).abs() > T::ZERO);
        deep |= u32::from(h[c] >= k.depth_limit);
        // Written so that NaN counts as broken.
        broken |= u32::from(!(motion < k.momentum_limit)) | u32::from(!(h[c] >= T::ZERO));
    }
    (alive * flag::ALIVE) | (deep * flag::DEEP) | (broken * flag::BROKEN)
}

/// Momentum of films made consistent with their faded velocity; none where it is dry.
#[inline(always)]
fn settle_films<T: Real>(k: &Constants<T>, h: &[T], qx: &mut [T], qz: &mut [T]) {
    let m = h.len();
    let (qx, qz) = (&mut qx[..m], &mut qz[..m]);
    for c in 0..m {
        let film = h[c].larger(k.film);
        let square = h[c] * h[c];
        let factor = (square + square) / (square + film * film);
        let factor = if h[c] > k.dry { factor } else { T::ZERO };
        qx[c] = qx[c] * factor;
        qz[c] = qz[c] * factor;
    }
}

/// Manning's friction, implicit and solved exactly: |q| (1 + K|q|) = |q*| with K = g n² Δt / h^(7/3).
#[inline(always)]
pub(in super::super) fn rub<T: Real>(k: &Constants<T>, h: &[T], qx: &mut [T], qz: &mut [T]) {
    let m = h.len();
    let (qx, qz) = (&mut qx[..m], &mut qz[..m]);
    for c in 0..m {
        let depth = h[c].larger(k.dry);
        let inverse = T::ONE / depth;
        let size = (qx[c] * qx[c] + qz[c] * qz[c]).sqrt();
        let rate = k.friction * inverse * inverse * depth.inverse_cube_root();
        let factor = T::TWO / (T::ONE + (T::ONE + T::FOUR * rate * size).sqrt());
        qx[c] = qx[c] * factor;
        qz[c] = qz[c] * factor;
    }
}
