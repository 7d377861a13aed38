//! What a run costs: CPU and wall seconds of its timed sections and the peak of the heap.
//!
//! CPU seconds are those of the whole process (all its threads) from the system's process clock, in nanoseconds where
//! the system has one. The peak is counted under the allocator: bytes asked for and not yet given back, relative to
//! the start of the run. Resident memory would not do: a heap that kept what an earlier run returned to it makes the
//! next run look free, and the high-water mark of a process cannot be reset portably.

use peakmem_alloc::{INSTRUMENTED_SYSTEM, PeakMemAlloc, PeakMemAllocTrait};
use std::alloc::System;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// The system allocator with two counters; every allocation of the program passes through it.
#[global_allocator]
static ALLOCATOR: &PeakMemAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Held while a run is measured: two runs at once would count each other's time and memory.
static MEASURING: Mutex<()> = Mutex::new(());

/// What one repetition of a run cost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// CPU seconds of the process, all threads; `None` where the system has no such clock.
    pub cpu_s: Option<f64>,
    /// Wall seconds.
    pub wall_s: f64,
    /// Largest number of heap bytes held at once, above what was held when the run began.
    pub peak_bytes: u64,
}

/// Handed to a run: measures the sections that the run marks.
#[derive(Debug)]
pub struct Probe {
    cost: Cost,
    timed: bool,
    _alone: MutexGuard<'static, ()>,
}

impl Probe {
    /// Begins a run, waiting for one that is being measured: from here on the heap is watched.
    pub(crate) fn begin() -> Self {
        // A run that panicked left nothing behind that the next one could trip over.
        let alone = MEASURING.lock().unwrap_or_else(PoisonError::into_inner);
        ALLOCATOR.reset_peak_memory();
        Self {
            cost: Cost::default(),
            timed: false,
            _alone: alone,
        }
    }

    /// Runs `work`, adding its CPU and wall seconds to the cost of the run. The peak covers everything from the start
    /// of the run to the end of its last timed section; comparing with the truth afterwards is free.
    pub fn time<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let cpu = process_cpu_seconds();
        let wall = Instant::now();
        let value = work();
        self.cost.wall_s += wall.elapsed().as_secs_f64();
        if let (Some(before), Some(after)) = (cpu, process_cpu_seconds()) {
            *self.cost.cpu_s.get_or_insert(0.0) += after - before;
        }
        self.cost.peak_bytes = ALLOCATOR.get_peak_memory() as u64;
        self.timed = true;
        value
    }

    /// Forgets what the heap did so far, for a run that must build its input first.
    pub fn forget_memory(&mut self) {
        ALLOCATOR.reset_peak_memory();
        self.cost.peak_bytes = 0;
    }

    /// The cost, or `None` if the run timed nothing.
    pub(crate) fn end(self) -> Option<Cost> {
        self.timed.then_some(self.cost)
    }
}

/// CPU seconds of this process so far, user and system, all threads.
#[cfg(unix)]
pub fn process_cpu_seconds() -> Option<f64> {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Some(t.tv_sec as f64 + t.tv_nsec as f64 * 1e-9)
}

/// CPU seconds of this process so far: not known on this system.
#[cfg(not(unix))]
pub fn process_cpu_seconds() -> Option<f64> {
    None
}

/// Costs of the repetitions of one run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spread {
    /// One cost a repetition, in the order in which they ran.
    pub repetitions: Vec<Cost>,
}

impl Spread {
    /// Smallest and median of a quantity over the repetitions, or `None` if it was not measured.
    fn best_and_median(&self, of: impl Fn(&Cost) -> Option<f64>) -> Option<(f64, f64)> {
        let mut values: Vec<f64> = self.repetitions.iter().filter_map(of).collect();
        values.sort_by(f64::total_cmp);
        let best = *values.first()?;
        let middle = values.len() / 2;
        let median = if values.len() % 2 == 1 {
            values[middle]
        } else {
            0.5 * (values[middle - 1] + values[middle])
        };
        Some((best, median))
    }

    /// Best and median CPU seconds.
    pub fn cpu_s(&self) -> Option<(f64, f64)> {
        self.best_and_median(|c| c.cpu_s)
    }

    /// Best and median wall seconds.
    pub fn wall_s(&self) -> Option<(f64, f64)> {
        self.best_and_median(|c| Some(c.wall_s))
    }

    /// Largest peak of the repetitions in bytes.
    pub fn peak_bytes(&self) -> u64 {
        self.repetitions.iter().map(|c| c.peak_bytes).max().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::hint::black_box;

    #[test]
    fn cpu_seconds_grow_with_work_and_not_with_sleep() {
        let mut probe = Probe::begin();
        let mut x = 0.0_f64;
        probe.time(|| {
            for k in 0..3_000_000 {
                x += black_box(f64::from(k)).sqrt();
            }
        });
        let worked = probe.end().unwrap();
        assert!(x > 0.0 && worked.wall_s > 0.0);
        if let Some(cpu) = worked.cpu_s {
            assert!(cpu > 0.0);
        }
        let mut probe = Probe::begin();
        probe.time(|| std::thread::sleep(std::time::Duration::from_millis(30)));
        let slept = probe.end().unwrap();
        assert!(slept.wall_s >= 0.03);
    }

    #[test]
    fn the_peak_is_at_least_what_was_held_at_once() {
        let mut probe = Probe::begin();
        let held = probe.time(|| {
            let first = black_box(vec![1_u8; 1 << 25]);
            let second = black_box(vec![2_u8; 1 << 26]);
            drop(first);
            second
        });
        // 96 MiB were held at once. Other tests allocate and free meanwhile, hence the room.
        let peak = probe.end().unwrap().peak_bytes;
        assert!(peak > 3 << 24 && held.len() == 1 << 26, "{peak}");
    }

    #[test]
    fn the_spread_is_best_and_median() {
        let cost = |wall_s| Cost {
            wall_s,
            ..Cost::default()
        };
        let mut spread = Spread {
            repetitions: vec![cost(3.0), cost(1.0), cost(2.0)],
        };
        assert_eq!(spread.wall_s(), Some((1.0, 2.0)));
        spread.repetitions.push(cost(5.0));
        assert_eq!(spread.wall_s(), Some((1.0, 2.5)));
        assert_eq!(spread.cpu_s(), None);
    }

    #[test]
    fn a_run_that_times_nothing_has_no_cost() {
        assert_eq!(Probe::begin().end(), None);
    }
}
