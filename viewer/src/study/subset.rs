//! A small, telling part of the real studies, held against their own expectations in the default tests: a solver, caster
//! or codec that loses its order, accuracy or stability fails here, not only when somebody runs the whole study.
//!
//! Left out are expectations of processor time, which a busy machine can break, and those whose rows are not all taken.

use super::case::{Case, Run, Study};
use super::expectation::{Expectations, Verdict};
use super::schedule::{self, Budget};
use super::{raycast, recording, stability, wave_equation};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// Runs those runs of the quick study that `keep` names, once each; tells what came of the expectations about them.
fn verdicts(study: &dyn Study, keep: impl Fn(&Case, &Run) -> bool) -> Vec<Verdict> {
    let mut cases = study.cases(true).unwrap();
    for case in &mut cases {
        let runs = std::mem::take(&mut case.runs);
        case.runs = runs.into_iter().filter(|run| keep(case, run)).collect();
    }
    cases.retain(|case| !case.runs.is_empty());
    let once = Budget {
        wall: Duration::ZERO,
        repetitions: 1,
    };
    let results = schedule::measure(study.name(), &cases, once, &AtomicBool::new(false), &mut |_| ());
    let rows: Vec<_> = results.measured.iter().flat_map(|m| m.rows.clone()).collect();
    let expectations = Expectations::parse(study.expectations()).unwrap();
    expectations.about(&rows).check(&rows)
}

/// All hold, and there are `count` of them: the first says that every row is ok.
#[track_caller]
fn hold(verdicts: &[Verdict], count: usize) {
    for v in verdicts {
        assert!(v.holds, "{}; measured {}", v.expected, v.measured);
    }
    let all: Vec<&str> = verdicts.iter().map(|v| v.expected.as_str()).collect();
    assert_eq!(verdicts.len(), count, "{all:#?}");
}

#[test]
fn the_wave_equation_converges_as_it_should() {
    let verdicts = verdicts(&wave_equation::WaveEquationStudy, |case, run| match case.name {
        "standing wave" => run.resolution <= 128.0 && run.method != "implicit-damped",
        "radial pulse" => false,
        "travelling pulses" => run.resolution < 20.0,
        _ => true,
    });
    hold(&verdicts, 10);
}

#[test]
fn casters_find_what_brute_force_finds() {
    let verdicts = verdicts(&raycast::RaycastStudy, |case, run| {
        ["spikes, grazing rays", "smooth waves, primary rays"].contains(&case.name)
            && (run.method.starts_with("blocks") || run.method == "march" && run.resolution == 8.0)
    });
    hold(&verdicts, 6);
}

#[test]
fn recordings_of_a_lively_sea_are_small_and_exact() {
    let verdicts = verdicts(&recording::RecordingStudy, |case, run| {
        case.name == "lively sea"
            && ["read", "write"].contains(&run.method)
            && [0.0, 1e-4]
                .iter()
                .any(|t| run.parameters["tolerance"].as_f64() == Some(*t))
    });
    hold(&verdicts, 5);
}

/// Steps well below, just below and far above what the explicit scheme bears, in the situations that break schemes most
/// easily.
#[test]
fn no_solver_returns_a_wrong_state_as_good() {
    let situations = [
        "even depth",
        "open edges",
        "waves of 10 km/s",
        "noise at the Nyquist wave number",
        "waves 9 km high on 1 m of water",
        "waves of 1e30 m",
        "two rows of samples",
        "the steepest waves that do not fold",
    ];
    let verdicts = verdicts(&stability::StabilityStudy, |case, run| {
        situations.contains(&case.name) && [0.5, 0.99, 10.0, 1000.0].contains(&run.resolution)
    });
    hold(&verdicts, 2);
}
