//! Rounding of values to multiples of a step such that no value moves by more than a tolerance.

/// Adding this to a number below 2³¹ leaves the nearest integer in the low bits of its representation: rounding that
/// every processor does in one addition.
const ROUND: f64 = 6_755_399_441_055_744.0; // 1.5 · 2⁵²

/// Maps values to integers and back: `q = round(v / step)`, `v ≈ f32(q · step)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Quantiser {
    step: f64,
    inverse: f64,
}

impl Quantiser {
    /// The coarsest quantiser that keeps every value of magnitude up to `max_abs` within `tolerance`.
    ///
    /// The product `q · step` is rounded to f32, which may add half a unit in the last place to the error. The step
    /// is therefore that much smaller than twice the tolerance. `None` where f32 itself is hardly finer than the
    /// tolerance or the integers would not fit: such an array is better stored without loss.
    pub(super) fn new(tolerance: f32, max_abs: f32) -> Option<Self> {
        let tolerance = f64::from(tolerance);
        let reach = f64::from(max_abs) + tolerance;
        let half_ulp = 0.5 * unit_in_last_place(reach);
        // `inverse` is rounded too: q may be off by a relative 2⁻⁵² of a step, for which the last factor makes room.
        let step = 2.0 * (tolerance - half_ulp) * (1.0 - 1e-9);
        let fits = tolerance.is_finite() && half_ulp <= 0.25 * tolerance && reach / step < f64::from(1 << 30);
        fits.then(|| Self {
            step,
            inverse: 1.0 / step,
        })
    }

    /// One that was read from a file; `None` for an impossible step.
    pub(super) fn from_step(step: f64) -> Option<Self> {
        (step.is_finite() && step > 0.0).then(|| Self {
            step,
            inverse: 1.0 / step,
        })
    }

    /// Distance between neighbouring values.
    pub(super) fn step(self) -> f64 {
        self.step
    }

    /// Appends the integers that stand for `values`.
    pub(super) fn quantise(self, values: &[f32], out: &mut Vec<i32>) {
        out.extend(
            values
                .iter()
                .map(|&v| (f64::from(v) * self.inverse + ROUND).to_bits() as u32 as i32),
        );
    }

    /// The value that an integer stands for.
    pub(super) fn value(self, q: i32) -> f32 {
        (f64::from(q) * self.step) as f32
    }

    /// Largest difference between `values` and what `q` stands for.
    pub(super) fn largest_error(self, values: &[f32], q: &[i32]) -> f64 {
        values
            .iter()
            .zip(q)
            .map(|(&v, &q)| (f64::from(self.value(q)) - f64::from(v)).abs())
            .fold(0.0, f64::max)
    }
}

/// Distance between neighbouring f32 at `x` (≥ 0).
fn unit_in_last_place(x: f64) -> f64 {
    let exponent = ((x.to_bits() >> 52) & 0x7ff) as i32 - 1023;
    2.0_f64.powi((exponent - 23).max(-149))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    #[test]
    fn no_value_moves_by_more_than_the_tolerance() {
        let mut rng = Rng::new(5, 1);
        for tolerance in [1e-3_f32, 1e-4, 1e-5] {
            for scale in [0.0_f32, 1e-6, 0.3, 1.0, 7.9, 300.0] {
                let values: Vec<f32> = (0..20_000)
                    .map(|_| scale * (2.0 * rng.uniform_f32() - 1.0))
                    .collect();
                let Some(quantiser) = Quantiser::new(tolerance, scale) else {
                    assert!(scale * f32::EPSILON > 0.4 * tolerance);
                    continue;
                };
                let mut q = Vec::new();
                quantiser.quantise(&values, &mut q);
                let error = quantiser.largest_error(&values, &q);
                assert!(error <= f64::from(tolerance), "{tolerance} {scale}: {error}");
                // The step is not needlessly fine either.
                assert!(quantiser.step() > 1.49 * f64::from(tolerance));
            }
        }
    }

    #[test]
    fn arrays_that_cannot_be_quantised_are_left_alone() {
        assert_eq!(Quantiser::new(1e-4, 1e4), None);
        assert_eq!(Quantiser::new(1e-4, f32::MAX), None);
        assert_eq!(Quantiser::new(f32::MIN_POSITIVE, 1.0), None);
        assert_eq!(Quantiser::new(f32::INFINITY, 1.0), None);
        assert_eq!(Quantiser::from_step(f64::NAN), None);
        assert_eq!(Quantiser::from_step(-1.0), None);
    }

    #[test]
    fn units_in_the_last_place_are_those_of_f32() {
        for x in [1.0_f32, 0.999, 300.0, 1e-3, 1e-40, 3.4e38] {
            let next = f64::from(f32::from_bits(x.to_bits() + 1));
            if next.is_finite() {
                assert_eq!(unit_in_last_place(f64::from(x)), next - f64::from(x));
            }
        }
    }
}
