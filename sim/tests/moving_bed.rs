//! Ground that moves under the water: linear theory, conservation, rest, and what is refused.

#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs, reason = "test code")]

use glam::{UVec2, Vec2};
use meniscus_sim::recording::{Reader, Writer};
use meniscus_sim::scene::Scene;
use meniscus_sim::shallow_water::{
    BedMotion, Condition, Edges, Initial, LatticeSettings, Method, Precision, Series, Settings, ShallowWater,
};
use meniscus_sim::{Channels, Frame, GridSpec, Solver};
use std::path::Path;

const GRAVITY: f64 = 9.81;
const HEIGHT: f64 = 1e-3;
/// Half the width of what rises, m.
const HALF: f64 = 6.0;

fn methods() -> [Method; 3] {
    [
        Method::FiniteVolume,
        Method::Lattice(LatticeSettings::default()),
        Method::Bgk { relaxation: 0.6 },
    ]
}

/// A channel of 100 m, 1 m deep, X from −50 m.
fn channel(cells: u32) -> GridSpec {
    let spacing = 100.0 / cells as f32;
    GridSpec::new(
        Vec2::new(-50.0 + 0.5 * spacing, 0.0),
        spacing,
        UVec2::new(cells, 4),
    )
    .unwrap()
}

fn solver(spec: GridSpec, method: Method, bed: Vec<BedMotion>) -> ShallowWater {
    let edges = Edges {
        x_min: Condition::Open,
        x_max: Condition::Open,
        ..Edges::all(&Condition::Periodic)
    };
    let settings = Settings {
        method,
        precision: Precision::Double,
        edges,
        bed,
        level: Some(0.0),
        ..Settings::default()
    };
    ShallowWater::new(spec, &Initial::still(&spec, |_, _| (-1.0, 0.0)), settings).unwrap()
}

/// cos² of height 1 over |x| < [`HALF`].
fn bell(x: f64) -> f64 {
    if x.abs() < HALF {
        (0.5 * std::f64::consts::PI * x / HALF).cos().powi(2)
    } else {
        0.0
    }
}

fn uplift(spec: &GridSpec, shape: impl Fn(f64, f64) -> f64, share: &[[f64; 2]]) -> BedMotion {
    let shape = (0..spec.len())
        .map(|k| {
            let at = spec.position(k % spec.width(), k / spec.width()).as_dvec2();
            shape(at.x, at.y)
        })
        .collect();
    BedMotion::Uplift {
        shape,
        share: Series::new(share).unwrap(),
    }
}

/// Σ|η − truth| / Σ|truth|.
fn error(solver: &ShallowWater, truth: impl Fn(f64) -> f64) -> f64 {
    let spec = solver.spec();
    let (mut sum, mut scale) = (0.0, 0.0);
    for i in 0..spec.width() {
        let exact = truth(f64::from(spec.position(i, 1).x));
        sum += (solver.elevation_at(i, 1) - exact).abs();
        scale += exact.abs();
    }
    sum / scale
}

/// Errors on 200 and 400 cells of every scheme, each time with the volume that it had.
fn errors(bed: impl Fn(&GridSpec) -> BedMotion, time: f64, truth: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
    methods()
        .into_iter()
        .map(|method| {
            [200, 400].map(|cells| {
                let spec = channel(cells);
                let mut solver = solver(spec, method, vec![bed(&spec)]);
                let before: f64 = solver.depths().iter().sum();
                for _ in 0..20 {
                    solver.advance((time / 20.0) as f32).unwrap();
                }
                let drift = solver.depths().iter().sum::<f64>() / before - 1.0;
                assert!(drift.abs() < 1e-13, "{method:?}: {drift}");
                error(&solver, &truth)
            })
        })
        .collect()
}

/// Second order for finite volumes and the lattice; the paper's scheme smears by its viscosity.
fn hold(errors: &[[f64; 2]], bars: [f64; 3]) {
    println!("errors on 200 and 400 cells: {errors:.4?}");
    for (k, ([coarse, fine], bar)) in errors.iter().zip(bars).enumerate() {
        assert!(*fine < bar && fine < coarse, "scheme {k}: {errors:?}");
    }
}

#[test]
fn what_rises_at_once_parts_into_two_halves() {
    // d'Alembert: ½ ζ(x − ct) + ½ ζ(x + ct). What is not linear is ζ/h = 1e-3.
    let c = GRAVITY.sqrt();
    let wave = |x: f64| HEIGHT * 0.5 * (bell(x - c * 6.0) + bell(x + c * 6.0)) + 1e-300;
    let bed = |spec: &GridSpec| uplift(spec, |x, _| HEIGHT * bell(x), &[[0.0, 0.0], [1e-9, 1.0]]);
    hold(&errors(bed, 6.0, wave), [0.02, 0.02, 0.1]);
}

#[test]
fn what_rises_slowly_makes_the_wave_of_linear_theory() {
    // Hammack 1973 without dispersion: the halves of every moment's rise, each from its own time.
    let (c, rise) = (GRAVITY.sqrt(), 3.0);
    let parts = 2000;
    let wave = |x: f64| {
        let half = |k: u32| {
            let ago = 6.0 - rise * (f64::from(k) + 0.5) / f64::from(parts);
            0.5 * (bell(x - c * ago) + bell(x + c * ago))
        };
        HEIGHT * (0..parts).map(half).sum::<f64>() / f64::from(parts)
    };
    let bed = |spec: &GridSpec| uplift(spec, |x, _| HEIGHT * bell(x), &[[0.0, 0.0], [rise, 1.0]]);
    hold(&errors(bed, 6.0, wave), [0.02, 0.02, 0.1]);
}

#[test]
fn a_slide_pushes_a_wave_and_leaves_one_behind() {
    // η_tt − c² η_xx = B_tt for a hump B(x − Ut) that starts on still water:
    // U²/(U² − c²) B(x − Ut) − U/2(U − c) B(x − ct) − U/2(U + c) B(x + ct).
    let (c, u, radius, time) = (GRAVITY.sqrt(), 1.5, 8.0, 7.0);
    let hump = |x: f64| {
        let free = (1.0 - x * x / (radius * radius)).max(0.0);
        HEIGHT * free * free
    };
    let wave = |x: f64| {
        u * u / (u * u - c * c) * hump(x + 10.0 - u * time)
            - 0.5 * u / (u - c) * hump(x + 10.0 - c * time)
            - 0.5 * u / (u + c) * hump(x + 10.0 + c * time)
    };
    let bed = |spec: &GridSpec| BedMotion::Slide {
        height: HEIGHT,
        radius,
        path: vec![
            (0.0, [-10.0, f64::from(spec.spacing) * 1.5]),
            (20.0, [-10.0 + 20.0 * u, f64::from(spec.spacing) * 1.5]),
        ],
    };
    hold(&errors(bed, time, wave), [0.02, 0.02, 0.12]);
}

#[test]
fn level_and_dry_ground_may_move_without_a_wave() {
    let spec = GridSpec::new(Vec2::ZERO, 0.5, UVec2::new(40, 36)).unwrap();
    let island = |x: f64, z: f64| 2.0 * (-0.1 * ((x - 9.0).powi(2) + (z - 8.0).powi(2))).exp() - 1.0;
    let summit = |x: f64, z: f64| if island(x, z) > 0.2 { 0.7 } else { 0.0 };
    for method in [Method::FiniteVolume, Method::Lattice(LatticeSettings::default())] {
        for precision in [Precision::Single, Precision::Double] {
            // The whole basin rises by whole quanta; the island's dry top rises too.
            let all = uplift(&spec, |_, _| 0.25, &[[0.0, 0.0], [2.0, 1.0]]);
            let top = uplift(&spec, summit, &[[0.5, 0.0], [1.0, 1.0]]);
            let settings = Settings {
                method,
                precision,
                bed: vec![all, top],
                ..Settings::default()
            };
            let initial = Initial::still(&spec, |x, z| (island(x, z), 0.0));
            let mut solver = ShallowWater::new(spec, &initial, settings).unwrap();
            let depths = solver.depths();
            for _ in 0..12 {
                solver.advance(0.25).unwrap();
            }
            let fastest = solver
                .discharges()
                .iter()
                .flatten()
                .fold(0.0_f64, |a, q| a.max(q.abs()));
            // Half risen ground is rounded to quanta cell by cell, so that level ground stays level to a quantum.
            let bar = match precision {
                Precision::Single => 2e-5,
                Precision::Double => 1e-12,
            };
            assert!(fastest <= bar, "{method:?} {precision:?}: {fastest}");
            let moved = solver
                .depths()
                .iter()
                .zip(&depths)
                .fold(0.0_f64, |a, (x, y)| a.max((x - y).abs()));
            assert!(moved <= bar, "{moved}");
            assert!((solver.elevation_at(38, 2) - 0.25).abs() < 1e-5);
            assert!((solver.elevation_at(18, 16) - (island(9.0, 8.0) + 0.95)).abs() < 1e-5);
        }
    }
}

/// A landslide from a bank into a lake with an open end, in single precision.
fn landslide() -> ShallowWater {
    let spec = GridSpec::new(Vec2::ZERO, 1.0, UVec2::new(60, 40)).unwrap();
    let settings = Settings {
        bed: vec![
            BedMotion::Slide {
                height: 4.0,
                radius: 9.0,
                path: vec![(0.5, [4.0, 20.0]), (4.0, [30.0, 20.0])],
            },
            uplift(
                &spec,
                |x, _| if x > 50.0 { -1.0 } else { 0.0 },
                &[[0.0, 0.0], [5.0, 1.0]],
            ),
        ],
        edges: Edges {
            x_max: Condition::Open,
            ..Edges::default()
        },
        ..Settings::default()
    };
    let initial = Initial::still(&spec, |x, _| (3.0 - 0.4 * x.min(20.0), 0.0));
    ShallowWater::new(spec, &initial, settings).unwrap()
}

#[test]
fn a_landslide_keeps_depths_sound_and_goes_on_from_a_checkpoint() {
    let mut unbroken = landslide();
    let mut kept = None;
    let (mut highest, mut steps) = (0.0_f64, 0);
    for k in 0..24 {
        steps += unbroken.advance(0.25).unwrap().substeps;
        assert!(unbroken.depths().iter().all(|h| *h >= 0.0 && h.is_finite()));
        highest = highest.max(unbroken.elevation_at(36, 20));
        if k == 9 {
            kept = Some(unbroken.checkpoint());
        }
    }
    assert!(highest > 0.3 && highest < 6.0, "{highest} m in {steps} steps");
    let mut again = landslide();
    again.restore(&kept.unwrap()).unwrap();
    for _ in 10..24 {
        again.advance(0.25).unwrap();
    }
    assert_eq!(again.depths(), unbroken.depths());
    assert_eq!(again.discharges(), unbroken.discharges());
}

#[test]
fn scenes_move_the_ground_and_mistakes_are_told() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("rise.csv"), "time_s,share\n0,0\n1,0.5\n2,1\n").unwrap();
    let scene = |bed: &str| {
        let text = format!(
            "name = 'basin'\ndomain.size = [20.0, 10.0]\nterrain = {{ kind = 'flat', height = -2.0 }}\n\
             solver = {{ kind = 'shallow-water', spacing = 0.5 }}\nbed = [{bed}]\n"
        );
        Scene::from_toml(&text, Path::new("basin.toml"), folder.path(), &[])
    };
    let patch = "kind = 'patch', min = [5, 2], max = [10, 8], height = '50 cm'";
    for (time, expected) in [
        ("start = 1, rise = 0", 0.5),
        ("series = 'rise.csv'", 0.5),
        (
            "points = [{ time = 0, value = 1 }, { time = 3, value = -1 }]",
            -0.5,
        ),
    ] {
        let scene = scene(&format!("{{ {patch}, {time} }}")).unwrap();
        let mut solver = ShallowWater::from_scene(&scene).unwrap();
        let before = solver.report().mass;
        for _ in 0..16 {
            solver.advance(0.25).unwrap();
        }
        let (spec, k) = (solver.spec(), 10 * 41 + 15);
        assert_eq!((spec.width(), spec.height()), (41, 21));
        let bed = solver.elevations()[k] - solver.depths()[k];
        assert!((bed - (expected - 2.0)).abs() < 1e-5, "{time}: {bed}");
        assert!((solver.report().mass / before - 1.0).abs() < 1e-12);
    }
    for bad in [
        "{ kind = 'patch', min = [5, 2], max = [5, 8], height = 1 }",
        "{ kind = 'patch', min = [5, 2], max = [9, 8], height = 1, start = 1, series = 'rise.csv' }",
        "{ kind = 'patch', min = [5, 2], max = [9, 8], height = 1, series = 'none.csv' }",
        "{ kind = 'array', file = 'none.npy' }",
        "{ kind = 'slide', height = 1, radius = 2, path = [] }",
        "{ kind = 'slide', height = 1, radius = 2, path = [{ time = 1, position = [1, 1] }, { time = 1, position = [2, 1] }] }",
        "{ kind = 'slide', height = 1, radius = 0, path = [{ time = 1, position = [1, 1] }] }",
        "{ kind = 'slide', height = 'NaN', radius = 1, path = [{ time = 1, position = [1, 1] }] }",
    ] {
        let error = scene(bad).unwrap_err();
        assert!(!error.problems.is_empty(), "{bad}");
    }
}

#[test]
fn pictures_and_recordings_know_the_ground_that_the_water_knows() {
    let folder = tempfile::tempdir().unwrap();
    let heights: Vec<f32> = (0..21 * 41).map(|k| 0.01 * (k % 7) as f32).collect();
    let mut array = std::fs::File::create(folder.path().join("rise.npy")).unwrap();
    meniscus_sim::npy::write(&mut array, &[21, 41], &heights).unwrap();
    drop(array);
    let text = "name = 'basin'\ndomain.size = [20.0, 10.0]\nterrain = { kind = 'flat', height = -2.0 }\n\
        solver = { kind = 'shallow-water', spacing = 0.5 }\n\
        bed = [{ kind = 'patch', min = [5, 2], max = [10, 8], height = 0.5, start = 0.5, rise = 2 },\n\
        { kind = 'array', file = 'rise.npy', scale = 2, points = [{ time = 0, value = 0 }, { time = 3, value = -1 }] },\n\
        { kind = 'slide', height = 0.7, radius = 3, path = [{ time = 0, position = [3, 3] }, { time = 4, position = [15, 8] }] }]\n";
    let scene = Scene::from_toml(text, Path::new("basin.toml"), folder.path(), &[]).unwrap();

    let path = folder.path().join("run.mrec");
    let mut writer = Writer::create(&path, &scene, Channels::DEPTH).unwrap();
    let mut solver = ShallowWater::from_scene(&scene).unwrap();
    let mut frame = Frame::new(scene.grid);
    let mut moved = 0.0_f32;
    for _ in 0..8 {
        solver.advance(0.4).unwrap();
        solver.extract(Channels::DEPTH, &mut frame);
        writer.push(&frame, None).unwrap();
        let drawn = scene.at(solver.time()).ground_on_grid().unwrap();
        let depth = frame.depth.as_ref().unwrap();
        for (k, drawn) in drawn.as_slice().iter().enumerate() {
            let bed = frame.elevation.as_slice()[k] - depth.as_slice()[k];
            assert!(
                (bed - drawn).abs() < 1e-5,
                "{k} at {}: {bed} {drawn}",
                solver.time()
            );
            moved = moved.max((drawn + 2.0).abs());
        }
    }
    assert!(moved > 0.5);
    writer.finish().unwrap();

    // Without the folder: the recording has all that it takes to run again.
    std::fs::remove_file(folder.path().join("rise.npy")).unwrap();
    let reader = Reader::open(&path).unwrap();
    assert_eq!(reader.scene().uplifts, scene.uplifts);
    let mut again = ShallowWater::from_scene(reader.scene()).unwrap();
    for _ in 0..8 {
        again.advance(0.4).unwrap();
    }
    assert_eq!(again.depths(), solver.depths());
}
