//! How long the thread of the window was busy.

/// Upper ends of the classes, milliseconds; the last class has none.
const ENDS: [f64; 9] = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 33.0, 50.0, 100.0];

/// A histogram of durations.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timing {
    counts: [u64; ENDS.len() + 1],
    total: f64,
    longest: f64,
}

impl Timing {
    /// Something took so many seconds.
    pub fn add(&mut self, seconds: f64) {
        let class = ENDS.partition_point(|end| *end < 1e3 * seconds);
        self.counts[class] += 1;
        self.total += seconds;
        self.longest = self.longest.max(seconds);
    }

    /// How many durations were added.
    pub fn count(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Their mean, seconds.
    pub fn mean(&self) -> f64 {
        self.total / self.count().max(1) as f64
    }

    /// The longest, seconds.
    pub fn longest(&self) -> f64 {
        self.longest
    }

    /// The classes in a line.
    pub fn text(&self) -> String {
        let classes = self.counts.iter().enumerate().filter(|(_, count)| **count > 0);
        let classes: Vec<String> = classes
            .map(|(k, count)| match ENDS.get(k) {
                Some(end) => format!("{count} up to {end} ms"),
                None => format!("{count} longer"),
            })
            .collect();
        format!(
            "{} updates, mean {:.2} ms, longest {:.1} ms: {}",
            self.count(),
            1e3 * self.mean(),
            1e3 * self.longest,
            classes.join(", ")
        )
    }
}

/// Seconds of a processor that this thread has taken so far.
#[cfg(unix)]
pub(super) fn thread_seconds() -> Option<f64> {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Some(t.tv_sec as f64 + t.tv_nsec as f64 * 1e-9)
}

/// Seconds of a processor that this thread has taken so far: not known on this system.
#[cfg(not(unix))]
pub(super) fn thread_seconds() -> Option<f64> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_duration_is_in_one_class() {
        let mut timing = Timing::default();
        for ms in [0.1, 0.5, 0.6, 49.0, 50.0, 51.0, 1000.0] {
            timing.add(1e-3 * ms);
        }
        assert_eq!(timing.count(), 7);
        assert_eq!(timing.longest(), 1.0);
        assert!(timing.text().contains("2 up to 0.5 ms"), "{}", timing.text());
        assert!(timing.text().contains("2 up to 50 ms"), "{}", timing.text());
        assert!(timing.text().contains("1 longer"), "{}", timing.text());
    }
}
