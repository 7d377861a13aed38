//! Logarithmic axes: range, ticks and how numbers are written on them.

/// A logarithmic axis over positive values, in pixels from `start` to `end`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    low: f64,
    high: f64,
    start: f64,
    end: f64,
}

impl Axis {
    /// An axis that shows all `values` with some room on both sides; values that are not positive are left out.
    pub(crate) fn over(values: impl Iterator<Item = f64>, start: f64, end: f64, room: f64) -> Self {
        let logs = values.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10);
        let (low, high) = logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
            (l.min(v), h.max(v))
        });
        let (low, high) = if low <= high { (low, high) } else { (-1.0, 0.0) };
        // At least a third of a decade, so that points that agree to rounding do not look scattered.
        let middle = 0.5 * (low + high);
        let half = (0.5 * (high - low)).max(1.0 / 6.0) * (1.0 + room);
        Self {
            low: middle - half,
            high: middle + half,
            start,
            end,
        }
    }

    /// The same axis, going on to another end.
    pub(crate) fn stretched_to(self, end: f64) -> Self {
        let decade = self.decade();
        Self {
            high: self.low + (end - self.start) / decade,
            end,
            ..self
        }
    }

    /// The pixel of a positive value.
    pub(crate) fn pixel(&self, value: f64) -> f64 {
        self.start + (value.log10() - self.low) / (self.high - self.low) * (self.end - self.start)
    }

    /// Pixels a decade, signed.
    pub(crate) fn decade(&self) -> f64 {
        (self.end - self.start) / (self.high - self.low)
    }

    /// Extends the axis downwards by a decade for values that are zero, and tells the value they are drawn at.
    pub(crate) fn make_room_for_zero(&mut self) -> f64 {
        let zero = self.low.floor() - 0.5;
        self.low = zero - 0.3;
        10_f64.powf(zero)
    }

    /// Values to mark and label, `apart` pixels apart or more.
    pub(crate) fn ticks(&self, apart: f64) -> Vec<(f64, String)> {
        let decade = self.decade().abs();
        let mut ticks: Vec<f64> = Vec::new();
        let (first, last) = (self.low.ceil() as i32, self.high.floor() as i32);
        if decade >= 3.4 * apart {
            let steps: &[f64] = if decade >= 9.0 * apart {
                &[1.0, 1.5, 2.0, 3.0, 5.0, 7.0]
            } else {
                &[1.0, 2.0, 5.0]
            };
            for k in first - 1..=last {
                ticks.extend(steps.iter().map(|s| s * 10_f64.powi(k)));
            }
        } else {
            let every = (apart / decade).ceil().max(1.0) as i32;
            ticks.extend(
                (first..=last)
                    .filter(|k| k.rem_euclid(every) == 0)
                    .map(|k| 10_f64.powi(k)),
            );
        }
        ticks.retain(|v| (self.low..=self.high).contains(&v.log10()));
        let labels: Vec<String> = ticks.iter().map(|v| number(*v)).collect();
        // One notation an axis: powers of ten where any of its decades needs one.
        let powers = labels.iter().any(|l| l.parse::<f64>().is_err()) && decades(&ticks);
        let label = |(v, text): (f64, String)| match (powers, v.log10().round() as i32) {
            (true, 0) | (false, _) => (v, text),
            (true, exponent) => (v, format!("10{}", superscript(exponent))),
        };
        ticks.into_iter().zip(labels).map(label).collect()
    }

    /// Labels at the swept values themselves where they are few and stand far enough apart, else [`Self::ticks`].
    pub(crate) fn ticks_at(&self, values: &[f64], apart: f64) -> Vec<(f64, String)> {
        let mut values: Vec<f64> = values.iter().copied().filter(|v| *v > 0.0).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        let roomy = values
            .windows(2)
            .all(|w| (self.pixel(w[1]) - self.pixel(w[0])).abs() >= apart);
        if values.len() >= 2 && values.len() <= 12 && roomy {
            values.into_iter().map(|v| (v, number(v))).collect()
        } else {
            self.ticks(apart)
        }
    }
}

/// Whether all ticks are powers of ten.
fn decades(ticks: &[f64]) -> bool {
    ticks.iter().all(|v| (v.log10() - v.log10().round()).abs() < 1e-9)
}

/// A number as on an axis: plain from 0.001 to 99 999, else as a power of ten.
pub(crate) fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if (0.000_999..99_999.5).contains(&value.abs()) {
        // Three significant digits without trailing zeros; whole numbers in full.
        let digits = (2 - value.abs().log10().floor() as i32).max(0) as usize;
        let text = format!("{value:.digits$}");
        return if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        };
    }
    let mut exponent = value.abs().log10().floor() as i32;
    let mut mantissa = value / 10_f64.powi(exponent);
    if mantissa.abs() >= 9.995 {
        mantissa /= 10.0;
        exponent += 1;
    }
    let power = superscript(exponent);
    if (mantissa - 1.0).abs() < 5e-3 {
        format!("10{power}")
    } else {
        let mantissa = format!("{mantissa:.2}");
        format!(
            "{}·10{power}",
            mantissa.trim_end_matches('0').trim_end_matches('.')
        )
    }
}

fn superscript(exponent: i32) -> String {
    exponent
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            d => char::from_u32('⁰' as u32 + d as u32 - '0' as u32).unwrap_or(d),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        for (value, text) in [
            (0.0, "0"),
            (0.001, "0.001"),
            (0.01, "0.01"),
            (0.0025, "0.0025"),
            (0.5, "0.5"),
            (1.0, "1"),
            (12.5, "12.5"),
            (100.0, "100"),
            (4096.0, "4096"),
            (99_999.0, "99999"),
            (1e5, "10⁵"),
            (1e-6, "10⁻⁶"),
            (3.4e-10, "3.4·10⁻¹⁰"),
            (9.999e-7, "10⁻⁶"),
            (-2e-5, "-2·10⁻⁵"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn ticks_keep_their_distance_and_stay_inside() {
        for (low, high) in [(1.0, 3.0), (1e-3, 1e2), (1e-16, 1e4), (5.0, 5.0), (0.0, 0.0)] {
            let axis = Axis::over([low, high].into_iter(), 80.0, 600.0, 0.05);
            let ticks = axis.ticks(40.0);
            assert!(!ticks.is_empty() && ticks.len() < 14, "{low} {high}: {ticks:?}");
            let pixels: Vec<f64> = ticks.iter().map(|t| axis.pixel(t.0)).collect();
            assert!(pixels.iter().all(|p| (79.9..600.1).contains(p)), "{pixels:?}");
            assert!(pixels.windows(2).all(|w| w[1] - w[0] > 35.0), "{pixels:?}");
        }
    }

    #[test]
    fn swept_values_are_labelled_where_they_fit() {
        let axis = Axis::over([16.0, 128.0].into_iter(), 0.0, 400.0, 0.1);
        let labels: Vec<String> = axis
            .ticks_at(&[16.0, 32.0, 64.0, 128.0], 30.0)
            .into_iter()
            .map(|t| t.1)
            .collect();
        assert_eq!(labels, ["16", "32", "64", "128"]);
    }
}
