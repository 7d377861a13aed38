//! The shallow-water solver against closed-form solutions and the laboratory. Bounds are the bars of the project, a
//! little above the figures of `docs/numerics-shallow-water.md`.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

use meniscus_sim::shallow_water::analytic::{BumpFlow, Ritter};
use meniscus_sim::shallow_water::cases::{Case, Options, Outcome};
use meniscus_sim::shallow_water::monai::Monai;
use meniscus_sim::shallow_water::{Precision, Settings};

fn run(case: Case, cells: u32, precision: Precision) -> Outcome {
    let options = Options {
        precision,
        ..Options::default()
    };
    case.run(cells, options).unwrap()
}

fn both(case: Case, bars: &[(u32, f64)]) {
    for precision in [Precision::Single, Precision::Double] {
        for &(cells, bar) in bars {
            let outcome = run(case, cells, precision);
            let error = outcome.depth_error;
            assert!(
                error <= bar,
                "{} at {cells}, {precision:?}: {error:e} > {bar:e}",
                case.name()
            );
            assert!(outcome.least_depth >= 0.0);
        }
    }
}

#[test]
fn dam_break_onto_water() {
    both(Case::Stoker, &[(100, 6.2e-3), (200, 2.7e-3), (400, 1.5e-3)]);
}

#[test]
fn dam_break_onto_dry_ground() {
    both(Case::Ritter, &[(100, 1.0e-2), (200, 4.7e-3), (400, 2.3e-3)]);
    // The closed channel keeps its volume: to the last quantum in single precision.
    assert_eq!(run(Case::Ritter, 200, Precision::Single).volume_drift, 0.0);
    assert!(run(Case::Ritter, 200, Precision::Double).volume_drift <= 1e-14);
}

#[test]
fn the_front_on_dry_ground_runs_at_its_speed() {
    // Where the exact depth passes 1 % of the reservoir's, the computed one does too, within 1 % of the way run.
    let mut setup = Case::Ritter.setup(400, Options::default()).unwrap();
    let exact = Ritter {
        dam: 5.0,
        left: 0.005,
    };
    use meniscus_sim::Solver;
    setup.solver.advance(6.0).unwrap();
    let depths = setup.solver.depths();
    let (spec, threshold) = (setup.solver.spec(), 0.01 * 0.005);
    let front = |wet: &dyn Fn(usize) -> bool| (0..spec.width()).rev().find(|&i| wet(i)).unwrap() as f64;
    let position = |i: usize| (i as f64 + 0.5) * 10.0 / 400.0;
    let computed = front(&|i| depths[i] > threshold);
    let expected = front(&|i| exact.at(position(i), 6.0).depth > threshold);
    let run = expected - 200.0;
    assert!((computed - expected).abs() <= 0.02 * run, "{computed} {expected}");
}

#[test]
fn oscillations_in_a_bowl() {
    both(Case::ThackerPlanar, &[(50, 4e-2), (100, 1.3e-2)]);
    both(Case::ThackerRadial, &[(50, 4e-2), (100, 1.3e-2)]);
    for case in [Case::ThackerPlanar, Case::ThackerRadial] {
        let outcome = run(case, 100, Precision::Single);
        assert!(
            outcome.shore_error <= 1.0,
            "{}: {}",
            case.name(),
            outcome.shore_error
        );
        assert_eq!(outcome.volume_drift, 0.0);
    }
}

#[test]
fn steady_flow_over_a_bump() {
    both(Case::Bump(BumpFlow::Subcritical), &[(200, 5e-5)]);
    both(Case::Bump(BumpFlow::Transcritical), &[(200, 3e-4)]);
    both(Case::Bump(BumpFlow::Shock), &[(200, 1.8e-3)]);
}

#[test]
fn steady_flow_with_friction_converges_at_second_order() {
    let error = |cells| run(Case::MacDonald, cells, Precision::Double).depth_error;
    let (coarse, fine) = (error(50), error(100));
    assert!(fine <= 1e-4 && coarse / fine >= 3.5, "{coarse:e} {fine:e}");
}

#[test]
fn a_dam_across_the_grid_is_as_good_as_one_along_it() {
    let along = run(Case::Stoker, 200, Precision::Double).depth_error;
    let across = run(Case::ObliqueStoker, 200, Precision::Double).depth_error;
    assert!(across <= 1.5 * along, "{across:e} against {along:e}");
}

#[test]
fn the_laboratory_tsunami() {
    let Some(folder) = Monai::find() else {
        println!("skipped: no Monai data; set MENISCUS_SHARED_DATA to the folder that holds monai_valley");
        return;
    };
    let data = Monai::load(&folder).unwrap();
    for cells in [98, 196] {
        let outcome = data.run(cells, Settings::default()).unwrap();
        assert!(outcome.mean_rms() <= 0.38e-2, "{cells}: {:?}", outcome.rms);
        assert!(
            outcome.peak_error.iter().all(|e| e.abs() <= 0.3e-2),
            "{cells}: {:?}",
            outcome.peak_error
        );
    }
}
