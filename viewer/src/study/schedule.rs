//! Runs the runs of a study: every run once, then again and again in a different order each round while time is left.
//!
//! Rounds rather than blocks, so that a machine that grows slower or busier hits all methods alike; and a different
//! order each round, so that none always runs in the wake of the same other one.

use super::case::{Case, Outcome, Run};
use super::measure::{Probe, Spread};
use super::row::Row;
use meniscus_sim::rng::Rng;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How long a study may go on repeating.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Budget {
    /// A repetition after the first is begun only if it is likely to end before this.
    pub wall: Duration,
    /// Most repetitions of a run.
    pub repetitions: usize,
}

impl Budget {
    /// `quick` leaves a wide margin below a minute; what is not timed runs once.
    pub(crate) fn new(quick: bool, timed: bool) -> Self {
        let (seconds, repetitions) = if quick { (30, 5) } else { (300, 15) };
        Self {
            wall: Duration::from_secs(seconds),
            repetitions: if timed { repetitions } else { 1 },
        }
    }
}

/// A run with all its repetitions.
pub(crate) struct Measured {
    /// Index of its case.
    pub case: usize,
    /// Label of the curve it belongs to.
    pub series: String,
    /// One row for each error.
    pub rows: Vec<Row>,
    /// The costs.
    pub spread: Spread,
}

/// A repetition as it went, for `timings.csv`.
pub(crate) struct Repetition {
    /// Index into the measured runs.
    pub run: usize,
    /// Round, from 0.
    pub round: usize,
    /// Seconds after the start of the study.
    pub at_s: f64,
}

/// What came of a study.
pub(crate) struct Results {
    /// In the order of cases and runs.
    pub measured: Vec<Measured>,
    /// Every repetition, in the order in which they ran.
    pub log: Vec<Repetition>,
    /// Whether it was interrupted; what had been measured by then is there.
    pub interrupted: bool,
}

struct Slot<'a> {
    case: usize,
    run: &'a Run,
    first: Option<anyhow::Result<Outcome>>,
    reproducible: bool,
    spread: Spread,
    longest: Duration,
}

/// Measures all runs of `cases`; `progress` gets a line now and then.
pub(crate) fn measure(
    study: &str,
    cases: &[Case],
    budget: Budget,
    interrupted: &AtomicBool,
    progress: &mut dyn FnMut(&str),
) -> Results {
    let mut slots: Vec<Slot<'_>> = cases
        .iter()
        .enumerate()
        .flat_map(|(case, c)| c.runs.iter().map(move |run| (case, run)))
        .map(|(case, run)| Slot {
            case,
            run,
            first: None,
            reproducible: true,
            spread: Spread::default(),
            longest: Duration::ZERO,
        })
        .collect();
    let start = Instant::now();
    let mut log = Vec::new();
    let mut stopped = false;
    'rounds: for round in 0..budget.repetitions.max(1) {
        let mut began = 0;
        for run in order(slots.len(), round) {
            if interrupted.load(Ordering::Relaxed) {
                stopped = true;
                break 'rounds;
            }
            let slot = &mut slots[run];
            let failed = matches!(slot.first, Some(Err(_)));
            if round > 0 && (failed || start.elapsed() + slot.longest > budget.wall) {
                continue;
            }
            log.push(Repetition {
                run,
                round,
                at_s: start.elapsed().as_secs_f64(),
            });
            slot.repeat();
            began += 1;
            if round == 0 && (began % 10 == 0 || began == slots.len()) {
                progress(&format!("{study}: {began} of {} runs measured once", slots.len()));
            }
        }
        if began == 0 {
            break;
        }
        if round > 0 {
            progress(&format!(
                "{study}: round {} repeated {began} of {} runs ({:.0} s)",
                round + 1,
                slots.len(),
                start.elapsed().as_secs_f64()
            ));
        }
    }
    Results {
        measured: slots.into_iter().map(|slot| slot.finish(study, cases)).collect(),
        log,
        interrupted: stopped,
    }
}

/// The order of a round: as listed in the first, so that a table fills from coarse to fine; shuffled afterwards.
fn order(runs: usize, round: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..runs).collect();
    if round > 0 {
        let mut rng = Rng::new(round as u64, 0x5747);
        for k in (1..runs).rev() {
            order.swap(k, (rng.next_u64() % (k as u64 + 1)) as usize);
        }
    }
    order
}

impl Slot<'_> {
    fn repeat(&mut self) {
        let begin = Instant::now();
        let mut probe = Probe::begin();
        let outcome = repeat_safely(self.run, &mut probe);
        let cost = probe.end();
        self.longest = self.longest.max(begin.elapsed());
        if outcome.is_ok()
            && let Some(cost) = cost
        {
            self.spread.repetitions.push(cost);
        }
        match (&self.first, outcome) {
            (None, outcome) => self.first = Some(outcome),
            (Some(Ok(first)), Ok(again)) => self.reproducible &= same(first, &again),
            (Some(_), Ok(_) | Err(_)) => self.reproducible = false,
        }
    }

    fn finish(self, study: &str, cases: &[Case]) -> Measured {
        let outcome = match self.first {
            Some(Ok(outcome)) => outcome,
            Some(Err(error)) => failed(format!("failed: {error:#}")),
            None => failed("not run: interrupted".to_owned()),
        };
        let mut notes = Vec::new();
        if !outcome.note.is_empty() {
            notes.push(outcome.note.clone());
        }
        if !self.reproducible {
            notes.push("repetitions differ in their result".to_owned());
        }
        let count = self.spread.repetitions.len();
        if let Some((best, median)) = self.spread.cpu_s().or(self.spread.wall_s())
            && count > 1
        {
            let above = 100.0 * (median / best - 1.0);
            notes.push(format!("best of {count}, median {above:+.0} %"));
        }
        if count > 0 && self.spread.cpu_s().is_none() {
            notes.push("no CPU clock on this system, wall time only".to_owned());
        }
        let note = notes.join("; ");
        let rows = outcome.errors.iter().map(|&(metric, error)| Row {
            study: study.to_owned(),
            case: cases[self.case].name.to_owned(),
            method: self.run.method.to_owned(),
            parameters: self.run.parameters.clone(),
            resolution: self.run.resolution,
            error,
            error_metric: metric.to_owned(),
            cpu_s: self.spread.cpu_s().map(|(best, _)| best),
            wall_s: self.spread.wall_s().map_or(0.0, |(best, _)| best),
            peak_bytes: self.spread.peak_bytes(),
            mass_drift: outcome.mass_drift,
            ok: outcome.ok && error.is_finite() && self.reproducible,
            note: note.clone(),
        });
        Measured {
            case: self.case,
            series: self.run.series.clone(),
            rows: rows.collect(),
            spread: self.spread,
        }
    }
}

/// Runs a repetition; a method that panics is a finding of the study, not its end.
fn repeat_safely(run: &Run, probe: &mut Probe) -> anyhow::Result<Outcome> {
    // Nothing of a run that panicked is used again: it builds its solver anew, and the probe ends with the repetition.
    catch_unwind(AssertUnwindSafe(|| run.repeat(probe))).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
        Err(anyhow::anyhow!(
            "panicked: {}",
            text.unwrap_or("without a message")
        ))
    })
}

fn failed(note: String) -> Outcome {
    Outcome::of("none", f64::NAN).wrong(note)
}

/// Whether two repetitions found the same, bit for bit: nothing here may depend on threads or time.
fn same(a: &Outcome, b: &Outcome) -> bool {
    a.ok == b.ok
        && a.errors.len() == b.errors.len()
        && a.errors
            .iter()
            .zip(&b.errors)
            .all(|(x, y)| x.0 == y.0 && x.1.to_bits() == y.1.to_bits())
        && a.mass_drift.map(f64::to_bits) == b.mass_drift.map(f64::to_bits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::bail;
    use std::sync::Arc;
    use std::sync::atomic::AtomicUsize;

    fn case(runs: Vec<Run>) -> Vec<Case> {
        vec![Case {
            name: "case",
            truth: String::new(),
            resolution: "n",
            curves: Vec::new(),
            runs,
        }]
    }

    fn run(cases: &[Case], repetitions: usize, flag: bool) -> Results {
        let budget = Budget {
            wall: Duration::from_secs(20),
            repetitions,
        };
        measure("test", cases, budget, &AtomicBool::new(flag), &mut |_| ())
    }

    #[test]
    fn rounds_go_over_all_runs_before_any_is_repeated() {
        let trivial = |_: &mut Probe| Ok(Outcome::of("e", 1.0));
        let timed = |probe: &mut Probe| Ok(Outcome::of("e", probe.time(|| 1.0)));
        let cases = case(vec![
            Run::new("a", 1.0, timed),
            Run::new("b", 1.0, timed),
            Run::new("c", 1.0, trivial),
        ]);
        let results = run(&cases, 3, false);
        let rounds: Vec<_> = results.log.iter().map(|r| r.round).collect();
        assert_eq!(rounds, [0, 0, 0, 1, 1, 1, 2, 2, 2]);
        for round in results.log.chunks(3) {
            let mut runs: Vec<_> = round.iter().map(|r| r.run).collect();
            runs.sort_unstable();
            assert_eq!(runs, [0, 1, 2]);
        }
        assert_eq!(results.measured[0].spread.repetitions.len(), 3);
        assert!(
            results.measured[0].rows[0]
                .note
                .starts_with("best of 3, median +")
        );
        assert!(results.measured[2].spread.repetitions.is_empty());
        assert!(!results.interrupted);
    }

    #[test]
    fn a_failing_run_is_a_row_that_is_not_ok_and_is_not_repeated() {
        let cases = case(vec![Run::new("a", 1.0, |_| bail!("no water"))]);
        let results = run(&cases, 3, false);
        let row = &results.measured[0].rows[0];
        assert!(
            !row.ok && row.error.is_nan() && row.note == "failed: no water",
            "{row:?}"
        );
        assert_eq!(results.log.len(), 1);
    }

    #[test]
    fn a_run_that_panics_fails_alone() {
        let good = |probe: &mut Probe| Ok(Outcome::of("e", probe.time(|| 1.0)));
        let bad = |probe: &mut Probe| probe.time(|| panic!("index {} of {}", 7, 3));
        let cases = case(vec![Run::new("a", 1.0, bad), Run::new("b", 1.0, good)]);
        let results = run(&cases, 2, false);
        let note = &results.measured[0].rows[0].note;
        assert_eq!(note, "failed: panicked: index 7 of 3");
        assert!(results.measured[1].rows[0].ok);
    }

    #[test]
    fn repetitions_that_differ_are_not_ok() {
        let calls = Arc::new(AtomicUsize::new(0));
        let cases = case(vec![Run::new("a", 1.0, move |probe| {
            let n = calls.fetch_add(1, Ordering::Relaxed);
            Ok(Outcome::of("e", probe.time(|| n as f64)))
        })]);
        let row = &run(&cases, 2, false).measured[0].rows[0];
        assert!(!row.ok && row.note.contains("differ"), "{row:?}");
    }

    #[test]
    fn an_interrupted_study_says_what_it_did_not_run() {
        let cases = case(vec![Run::new("a", 1.0, |_| Ok(Outcome::of("e", 1.0)))]);
        let results = run(&cases, 2, true);
        assert!(results.interrupted && !results.measured[0].rows[0].ok);
        assert_eq!(results.measured[0].rows[0].note, "not run: interrupted");
    }
}
