//! What passes between two cells.

use super::{Cells, Constants, Faces, Row};
use crate::shallow_water::real::Real;

/// What one face lets through.
struct Flux<T> {
    mass: T,
    before: T,
    behind: T,
    across: T,
    speed: T,
}

/// The state on one side of a face: surface and bed relative to the higher of the two cells' beds, so that rest is exact
/// and a mirrored state gives mirrored bits; normal and transverse velocity.
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
    let (left_dry, right_dry) = (a <= T::ZERO, b <= T::ZERO);
    // Water spreads onto dry ground at u ± 2c: the speeds below come out right if that ground moved so fast.
    let ul = if left_dry { r.u - (cr + cr) } else { l.u };
    let ur = if right_dry { l.u + (cl + cl) } else { r.u };
    let middle = T::HALF * (ul + ur) + (cl - cr);
    let celerity = T::HALF * (cl + cr) + T::QUARTER * (ul - ur);
    // Speeds of the outermost signals, each away from the face.
    let back = (cl - ul).larger(celerity - middle).larger(T::ZERO);
    let forth = (ur + cr).larger(middle + celerity).larger(T::ZERO);
    let inverse = T::ONE / (forth + back).larger(T::TINY);
    // Written so that a mirrored state gives the mirrored flux to the bit.
    let (wl, wr, w) = (forth * inverse, back * inverse, back * forth * inverse);

    let (ql, qr) = (a * l.u, b * r.u);
    let rise = b - a;
    let mass = (wl * ql + wr * qr) - w * rise;
    let pressure = T::HALF * k.gravity * rise * (b + a);
    let carried = (wl * (ql * l.u) + wr * (qr * r.u)) - w * (qr - ql);
    let across = mass * if mass > T::ZERO { l.v } else { r.v };
    let speed = if left_dry && right_dry {
        T::ZERO
    } else {
        forth.larger(back)
    };
    Flux {
        mass: k.round(k.lambda * mass),
        before: carried + wr * pressure,
        behind: carried - wl * pressure,
        across,
        speed,
    }
}

/// Cells on one side of a row of faces: mean values, and what to add to them half a cell on along the normal. `u` is
/// the velocity along the normal, `v` the one across it.
#[derive(Clone, Copy)]
struct Flank<'a, T> {
    bed: &'a [T],
    h: &'a [T],
    u: &'a [T],
    v: &'a [T],
    de: &'a [T],
    dz: &'a [T],
    du: &'a [T],
    dv: &'a [T],
}

impl<'a, T> Flank<'a, T> {
    /// `m` cells from number `first` on beside faces whose normal is X.
    #[inline(always)]
    fn x(bed: &'a [T], cells: &'a Cells<T>, first: usize, m: usize) -> Self {
        let end = first + m;
        let d = &cells.x;
        Self {
            bed: &bed[first..end],
            h: &cells.h[first..end],
            u: &cells.u[first..end],
            v: &cells.v[first..end],
            de: &d.e[first..end],
            dz: &d.z[first..end],
            du: &d.u[first..end],
            dv: &d.v[first..end],
        }
    }

    /// The same beside faces whose normal is Z.
    #[inline(always)]
    fn z(bed: &'a [T], cells: &'a Cells<T>, first: usize, m: usize) -> Self {
        let end = first + m;
        let d = &cells.z;
        Self {
            bed: &bed[first..end],
            h: &cells.h[first..end],
            u: &cells.v[first..end],
            v: &cells.u[first..end],
            de: &d.e[first..end],
            dz: &d.z[first..end],
            du: &d.v[first..end],
            dv: &d.u[first..end],
        }
    }
}

/// Faces along X of one row; `speed` keeps the fastest signal seen in each column.
#[inline(always)]
pub(crate) fn faces_x<T: Real>(
    k: &Constants<T>,
    z: &[T],
    cells: &Cells<T>,
    out: &mut Faces<T>,
    speed: &mut Row<T>,
) {
    // Cells 1 ..= m stand before the faces, cells 2 ..= m + 1 behind.
    let m = z.len() - 3;
    faces(k, Flank::x(z, cells, 1, m), Flank::x(z, cells, 2, m), out, speed);
}

/// Faces along Z between two rows.
#[inline(always)]
pub(crate) fn faces_z<T: Real>(
    k: &Constants<T>,
    z: (&[T], &[T]),
    cells: (&Cells<T>, &Cells<T>),
    out: &mut Faces<T>,
    speed: &mut Row<T>,
) {
    let m = z.0.len() - 2;
    let (before, behind) = (Flank::z(z.0, cells.0, 1, m), Flank::z(z.1, cells.1, 1, m));
    faces(k, before, behind, out, speed);
}

/// The faces between two flanks, from number 1 on.
#[inline(always)]
fn faces<T: Real>(
    k: &Constants<T>,
    l: Flank<'_, T>,
    r: Flank<'_, T>,
    out: &mut Faces<T>,
    speed: &mut Row<T>,
) {
    let m = l.h.len();
    let (mass, across) = (&mut out.mass[1..=m], &mut out.across[1..=m]);
    let (before, behind) = (&mut out.before[1..=m], &mut out.behind[1..=m]);
    let speed = &mut speed[1..=m];
    for c in 0..m {
        let rise = r.bed[c] - l.bed[c];
        let (up, down) = (rise.larger(T::ZERO), rise.smaller(T::ZERO));
        let left = Side {
            e: (l.h[c] + l.de[c]) - up,
            z: l.dz[c] - up,
            u: l.u[c] + l.du[c],
            v: l.v[c] + l.dv[c],
        };
        let right = Side {
            e: (r.h[c] - r.de[c]) + down,
            z: down - r.dz[c],
            u: r.u[c] - r.du[c],
            v: r.v[c] - r.dv[c],
        };
        let f = flux(k, left, right);
        mass[c] = f.mass;
        before[c] = f.before;
        behind[c] = f.behind;
        across[c] = f.across;
        speed[c] = f.speed.larger(speed[c]);
    }
}
