//! From the six numbers of a cell to its populations.

use super::{Constants, RowView, Star};
use crate::shallow_water::real::Real;

/// Populations beyond rest from the six numbers.
#[inline(always)]
pub(in super::super) fn collided<T: Real>(k: &Constants<T>, row: RowView<'_, T>, out: &mut Star<T>) {
    let n = row.h.len();
    let (qx, qz) = (&row.qx[..n], &row.qz[..n]);
    let [xx, zz, xz] = row.moments.map(|m| &m[..n]);
    let [o0, o1, o2, o3, o4, o5, o6, o7] = out.0.each_mut().map(|o| &mut o[..n]);
    for i in 0..n {
        let h = row.h[i];
        let (mx, mz) = (k.lambda * qx[i], k.lambda * qz[i]);
        let inverse = T::ONE / h;
        let (u, v) = (mx * inverse, mz * inverse);
        let (a, b, c) = (k.unfold * xx[i], k.unfold * zz[i], k.unfold * xz[i]);
        let p = k.half_gravity * h * h;
        // Raw moments of second order and above, less those of rest.
        let (m20, m02, m11) = (a + mx * u, b + mz * v, c + mx * v);
        let twice = c + c;
        let m21 = u * twice + v * (p + m20);
        let m12 = v * twice + u * (p + m02);
        let m22 = (u * u * (p + b) + v * v * (p + a)) + u * v * ((twice + twice) + mx * v);
        let (even_x, odd_x) = (T::HALF * (m20 - m22), T::HALF * (mx - m12));
        let (even_z, odd_z) = (T::HALF * (m02 - m22), T::HALF * (mz - m21));
        let (even, odd) = (T::QUARTER * (m22 + m11), T::QUARTER * (m21 + m12));
        let (skew_even, skew_odd) = (T::QUARTER * (m22 - m11), T::QUARTER * (m12 - m21));
        (o0[i], o1[i]) = (even_x + odd_x, even_x - odd_x);
        (o2[i], o3[i]) = (even_z + odd_z, even_z - odd_z);
        (o4[i], o5[i]) = (even + odd, even - odd);
        (o6[i], o7[i]) = (skew_even + skew_odd, skew_even - skew_odd);
    }
}
