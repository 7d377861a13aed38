//! Wave particles against closed forms: the numbers of the paper, laws of decay, mirrors, volumes, and extremes.
#![cfg(feature = "wave-particles")]
#![allow(clippy::unwrap_used)] // a test may panic

mod objects;
mod walls;

use glam::{DVec2, UVec2, Vec2, Vec3};
use meniscus_sim::events::Action;
use meniscus_sim::mesh::TriangleMesh;
use meniscus_sim::rng::Rng;
use meniscus_sim::scene::description::{Description, Motion, Object, Shape, WaveFront, WayPoint};
use meniscus_sim::wave_particles::WaveParticles;
use meniscus_sim::wave_particles::kernel::{VOLUME, bump, lean};
use meniscus_sim::{Channels, Frame, Grid, GridSpec, Scene, Solver, StepError};
use std::f64::consts::{PI, SQRT_2, TAU};

const OPEN: &str = "[boundary]\nx_min = \"open\"\nx_max = \"open\"\nz_min = \"open\"\nz_max = \"open\"\n";
const PERIODIC: &str =
    "[boundary]\nx_min = \"periodic\"\nx_max = \"periodic\"\nz_min = \"periodic\"\nz_max = \"periodic\"\n";

fn grid(w: u32, h: u32, spacing: f32) -> GridSpec {
    GridSpec::new(Vec2::ZERO, spacing, UVec2::new(w, h)).unwrap()
}

/// A scene of waves at 1 m/s; `keys` go into the solver's table, further tables may follow.
fn scene(grid: GridSpec, keys: &str) -> Scene {
    let text = format!(
        "name = \"test\"\n[solver]\nkind = \"wave-particles\"\nspacing = {}\nspeed = 1.0\n{keys}",
        grid.spacing
    );
    let description: Description = toml::from_str(&text).unwrap();
    Scene {
        description,
        grid,
        terrain: None,
        meshes: Vec::new(),
        sky: None,
        initial_elevation: None,
        uplifts: Vec::new(),
    }
}

fn solver(grid: GridSpec, keys: &str) -> WaveParticles {
    WaveParticles::from_scene(&scene(grid, keys)).unwrap()
}

fn frame(solver: &WaveParticles) -> Frame {
    let mut frame = Frame::new(solver.spec());
    solver.extract(Channels::ALL, &mut frame);
    frame.check_finite().unwrap();
    frame
}

fn drop(x: f32, z: f32, radius: f32, volume: f32) -> Action {
    Action::Drop {
        position: Vec2::new(x, z),
        radius,
        volume,
    }
}

fn line(position: Vec2, direction: f32, width: f32, height: f32, radius: f32) -> WaveFront {
    WaveFront {
        time: 0.0,
        position,
        direction,
        width,
        spread: 0.0,
        height,
        radius,
    }
}

fn volume_of(frame: &Frame) -> f64 {
    let sum: f64 = frame.elevation.as_slice().iter().map(|&h| f64::from(h)).sum();
    sum * frame.spec().cell_area()
}

/// Field of all particles at a point, in double precision: what a gather must find far from walls.
fn field(solver: &WaveParticles, p: DVec2) -> f64 {
    solver
        .particles()
        .map(|(at, a, r)| a * bump((p - at).length_squared() / (r * r)))
        .sum()
}

#[test]
fn the_gather_is_the_sum_over_all_particles() {
    let mut s = solver(grid(70, 50, 0.1), OPEN);
    let mut rng = Rng::new(1, 1);
    for _ in 0..40 {
        let (x, z) = (7.0 * rng.uniform_f32(), 5.0 * rng.uniform_f32());
        s.apply(&drop(x, z, 0.25 + 0.6 * rng.uniform_f32(), 0.01))
            .unwrap();
        s.advance(0.05).unwrap();
    }
    assert!(s.count() > 1000);
    let f = frame(&s);
    let scale = f.elevation.range().1;
    for k in (0..f.spec().len()).step_by(7) {
        let p = f.spec().position(k % 70, k / 70).as_dvec2();
        let error = f64::from(f.elevation.as_slice()[k]) - field(&s, p);
        assert!(error.abs() < 2e-6 * f64::from(scale), "{error} at {p}");
    }
}

#[test]
fn frames_are_the_same_for_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let mut s = solver(grid(64, 64, 0.1), "smallest = 1e-6");
            for k in 0..12 {
                s.apply(&drop(1.0 + 0.4 * k as f32, 3.0, 0.3, 0.01)).unwrap();
                s.advance(0.31).unwrap();
            }
            (s.count(), s.report(), frame(&s))
        })
    };
    let (one, two, three) = (run(1), run(2), run(3));
    assert!(one.0 > 500 && one == two && one == three);
}

/// Ripple of a row of particles along its ridge: its amplitude over its mean, (highest − lowest)/(highest + lowest).
fn ripple(spacing: f64) -> f64 {
    let height = |x: f64| -> f64 {
        (-20..=20)
            .map(|k| bump((x - spacing * f64::from(k)).powi(2)))
            .sum()
    };
    let values: Vec<f64> = (0..200).map(|k| height(spacing * f64::from(k) / 200.0)).collect();
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, 0.0_f64), |(a, b), &v| (a.min(v), b.max(v)));
    (high - low) / (high + low)
}

#[test]
fn a_row_ripples_as_published() {
    for m in 2..9 {
        assert!(ripple(2.0 / f64::from(m)) < 1e-12, "none at 2r/m");
    }
    for (spacing, expected, digit) in [(0.45, 0.0073, 5e-5), (0.6, 0.016, 5e-4), (1.2, 0.18, 5e-3)] {
        let found = ripple(spacing);
        assert!((found - expected).abs() <= digit, "{spacing}: {found}");
    }
}

#[test]
fn a_front_has_the_height_and_volume_it_was_given() {
    // Particles half a radius apart: no ripple. Radius of 40 samples, so that the grid's sum is the integral.
    let mut s = solver(grid(240, 400, 0.05), &format!("split = 0.5\n{OPEN}"));
    s.launch(&line(Vec2::new(3.0, 10.0), 0.0, 12.0, 0.3, 2.0))
        .unwrap();
    s.advance(2.5).unwrap();
    let f = frame(&s);
    let crest = f.elevation[(110, 200)];
    assert!((f64::from(crest) / 0.3 - 1.0).abs() < 1e-5, "{crest}");
    let n = 12.0_f64;
    let each = 0.3 * (12.0 / n) / 2.0;
    assert_eq!(s.count(), 12);
    assert!((s.volume() / (n * VOLUME * each * 4.0) - 1.0).abs() < 1e-6);
    assert!((VOLUME - 0.93418).abs() < 5e-6);
    assert!(
        (volume_of(&f) / s.volume() - 1.0).abs() < 1e-4,
        "{} {}",
        volume_of(&f),
        s.volume()
    );
    // The flux of a wave is c η, its velocity g/c η at depth c²/g.
    let v = f.velocity.as_ref().unwrap()[(110, 200)];
    assert!((v.x - 9.81 * crest).abs() < 1e-4 && v.y.abs() < 1e-5, "{v}");
    // The extended height field: −sin(πu/r) D along the direction, so it points to the crest from both sides.
    let d = f.displacement.as_ref().unwrap();
    assert!(d[(90, 200)].x > 0.05 && d[(130, 200)].x < -0.05 && d[(110, 200)].x.abs() < 1e-4);
    let p = f.spec().position(95, 200).as_dvec2();
    let expected: f64 = s
        .particles()
        .map(|(at, a, r)| {
            let d = p - at;
            a * bump(d.length_squared() / (r * r)) * lean(d.x / r)
        })
        .sum();
    assert!((f64::from(d[(95, 200)].x) - expected).abs() < 1e-6);
}

/// Period of the pond below: 140 samples of a spacing that is an `f32`.
const PERIOD: f64 = 140.0 * 0.05_f32 as f64;

#[test]
fn fronts_stand_where_they_should_after_ten_thousand_seconds() {
    // A periodic pond of 7 m: 10⁴ s at 1 m/s are 1428 times around and 4 m more.
    let mut s = solver(grid(140, 20, 0.05), &format!("smallest = 1e-9\n{PERIODIC}"));
    s.launch(&line(Vec2::new(1.0, 0.5), 0.0, 0.2, 0.01, 0.3)).unwrap();
    let mut steps = solver(grid(140, 20, 0.05), &format!("smallest = 1e-9\n{PERIODIC}"));
    steps
        .launch(&line(Vec2::new(1.0, 0.5), 0.0, 0.2, 0.01, 0.3))
        .unwrap();
    s.advance(10_000.0).unwrap();
    for _ in 0..20_000 {
        steps.advance(0.5).unwrap();
    }
    for run in [&s, &steps] {
        for (p, ..) in run.particles() {
            let x = (p.x - (1.0 + 10_000.0)).rem_euclid(PERIOD);
            let off = x.min(PERIOD - x);
            // The period is an f32 spacing, and 1428 wraps add its rounding in f64: 1e-12.
            assert!(off < 1e-10, "{off}");
        }
    }
    // In the open, without a wrap, to rounding: radius 10⁴ m to 1e-12.
    let mut open = solver(grid(30, 30, 1000.0), "smallest = 1e-6");
    open.apply(&drop(15_000.0, 15_000.0, 4000.0, 1e9)).unwrap();
    open.advance(10_000.0).unwrap();
    for (p, ..) in open.particles() {
        assert!(((p - DVec2::splat(15_000.0)).length() - 1e4).abs() < 1e-8);
    }
}

/// Height of the ring of a drop at some radii, largest along a ray.
fn ring_heights(law: &str, radii: &[f64]) -> Vec<f64> {
    let mut s = solver(
        grid(32, 32, 4.0),
        &format!("smallest = 1e-12\nlaw = \"{law}\"\ntrain = 1\nlimit = 1e7"),
    );
    s.apply(&drop(64.0, 64.0, 1.0, 0.1)).unwrap();
    let mut out = Vec::new();
    for &radius in radii {
        s.advance((radius - s.time()) as f32).unwrap();
        // The mean over directions has no ripple.
        let mut sum = 0.0;
        let n = 96;
        for k in 0..n {
            let ray = DVec2::from_angle(TAU * 0.618_034 * f64::from(k));
            let height = |d: f64| field(&s, DVec2::splat(64.0) + (radius + d) * ray);
            sum += (0..=40)
                .map(|k| height(-0.4 + 0.02 * f64::from(k)))
                .fold(0.0, f64::max);
        }
        out.push(sum / f64::from(n));
    }
    out
}

#[test]
fn rings_decay_by_their_law() {
    // One front, long after the start: the volume law falls as 1/R, the energy law as 1/√R.
    // The curvature of the ring adds a share of 2.2 r²/R², seen from 16 r outwards: 0.005 here. Each split makes three of
    // one, so a ring three times as wide has its particles at the same spacing, and the same ripple.
    let radii = [20.0, 60.0];
    for (law, power) in [("volume", -1.0), ("energy", -0.5)] {
        let h = ring_heights(law, &radii);
        for k in 1..radii.len() {
            let found = (h[k] / h[0]).ln() / (radii[k] / radii[0]).ln();
            // The ripple left after averaging over directions is 0.3 %.
            assert!((found - power).abs() < 0.012, "{law}: {found} from {h:?}");
        }
    }
}

#[test]
fn volume_is_exact_through_splits_and_reflections() {
    let mut s = solver(grid(80, 60, 0.1), "smallest = 1e-7");
    for k in 0..5 {
        s.apply(&drop(1.0 + 1.3 * k as f32, 2.0 + 0.3 * k as f32, 0.5, 0.02))
            .unwrap();
    }
    let made = s.ledger().made;
    assert!((made / 0.1 - 1.0).abs() < 1e-7);
    for _ in 0..30 {
        s.advance(0.5).unwrap();
        let l = s.ledger();
        assert!((s.volume() + l.culled - made).abs() < 1e-12 * made, "{l:?}");
        assert_eq!((l.stranded, l.left), (0.0, 0.0));
    }
    assert!(
        s.events() > 5000 && s.count() > 2000,
        "{} {}",
        s.events(),
        s.count()
    );
    // What the walls return is on the grid too: all of the volume, though many particles touch a wall.
    let f = frame(&s);
    assert!(
        (volume_of(&f) / s.volume() - 1.0).abs() < 2e-3,
        "{} {}",
        volume_of(&f),
        s.volume()
    );
}

#[test]
fn a_press_moves_water_without_adding_any_and_a_push_is_its_momentum() {
    let mut s = solver(grid(100, 100, 0.1), OPEN);
    s.apply(&Action::Press {
        position: Vec2::splat(5.0),
        radius: 0.8,
        depth: 0.2,
    })
    .unwrap();
    assert!(s.volume().abs() < 1e-12);
    let f = frame(&s);
    assert!((f.elevation[(50, 50)] + 0.2).abs() < 1e-5);
    // The press of the other solvers: −(1 − s²)²(1 − 4s²) to an eighth of its depth.
    for i in 50..70 {
        let s2 = (0.1 * (i as f32 - 50.0) / 1.6).powi(2);
        let asked = -0.2 * (1.0 - s2).max(0.0).powi(2) * (1.0 - 4.0 * s2);
        assert!(
            (f.elevation[(i, 50)] - asked).abs() < 0.025,
            "{i}: {} {asked}",
            f.elevation[(i, 50)]
        );
    }
    let before = s.report().momentum;
    s.apply(&Action::Push {
        position: Vec2::splat(5.0),
        radius: 0.8,
        velocity: Vec2::new(0.3, -0.1),
    })
    .unwrap();
    let after = s.report();
    // ρ · depth · velocity · volume of the bump; depth = c²/g.
    let scale = 1000.0 / 9.81 * VOLUME * 0.64;
    assert!((after.momentum[0] - before[0] - scale * 0.3).abs() < 1e-4);
    assert!((after.momentum[1] - before[1] + scale * 0.1).abs() < 1e-4);
    assert!(s.volume().abs() < 1e-12);
}

#[test]
fn checkpoints_go_on_as_if_nothing_had_happened() {
    let mut a = solver(grid(60, 60, 0.1), "law = \"energy\"\nsmallest = 1e-5");
    a.apply(&drop(3.0, 2.0, 0.4, 0.02)).unwrap();
    a.advance(0.21).unwrap();
    let mut b = solver(grid(60, 60, 0.1), "law = \"energy\"\nsmallest = 1e-5");
    b.restore(&a.checkpoint()).unwrap();
    for _ in 0..5 {
        assert_eq!(a.advance(0.4).unwrap(), b.advance(0.4).unwrap());
    }
    assert_eq!(frame(&a), frame(&b));
    let mut other = solver(grid(61, 60, 0.1), "");
    assert!(
        other
            .restore(&a.checkpoint())
            .unwrap_err()
            .to_string()
            .contains("another grid")
    );
}

#[test]
fn limits_are_told_and_leave_the_state_as_it_was() {
    let mut s = solver(grid(60, 60, 0.1), "limit = 100\nsmallest = 1e-9");
    s.apply(&drop(3.0, 3.0, 0.4, 0.02)).unwrap();
    let before = s.checkpoint();
    let error = s.advance(50.0).unwrap_err();
    assert!(matches!(error, StepError::Crowded { allowed: 100, .. }));
    assert!(error.to_string().contains("solver.smallest"), "{error}");
    assert_eq!(s.checkpoint(), before);
    s.advance(0.1).unwrap();
    for _ in 0..20 {
        if let Err(error) = s.apply(&drop(3.0, 3.0, 0.4, 0.02)) {
            assert!(error.to_string().contains("solver.limit"), "{error}");
            return;
        }
    }
    panic!("more particles than the limit");
}

#[test]
fn what_is_no_wave_is_refused() {
    let mut s = solver(grid(60, 60, 0.1), "");
    assert!(s.apply(&drop(3.0, 3.0, 0.0, 0.02)).is_err());
    assert!(s.apply(&drop(3.0, f32::NAN, 0.1, 0.02)).is_err());
    assert!(s.apply(&drop(3.0, 3.0, 1e-6, 1e9)).is_err());
    assert!(s.advance(0.0).is_err() && s.advance(f32::NAN).is_err());
    assert_eq!((s.count(), frame(&s).elevation.range()), (0, (0.0, 0.0)));
    let mut dam = scene(grid(60, 60, 0.1), "");
    dam.description.water.initial = meniscus_sim::scene::description::Initial::Dam {
        min: Vec2::ZERO,
        max: Vec2::ONE,
        level: 1.0,
    };
    let error = WaveParticles::from_scene(&dam).err().unwrap().to_string();
    assert!(error.contains("shallow-water"), "{error}");
}

#[test]
fn extremes_stay_finite() {
    // Radius below the spacing: widened, volume kept.
    let mut s = solver(grid(40, 40, 0.1), "");
    s.apply(&drop(2.0, 2.0, 0.001, 1e-4)).unwrap();
    assert!((s.volume() / 1e-4 - 1.0).abs() < 1e-6);
    assert!((volume_of(&frame(&s)) / 1e-4 - 1.0).abs() < 0.02);
    // A drop exactly on a wall and exactly in a corner; walls stand half a spacing beyond the samples.
    for at in [
        Vec2::new(-0.05, 2.0),
        Vec2::new(-0.05, -0.05),
        Vec2::new(3.95, 3.95),
    ] {
        let mut s = solver(grid(40, 40, 0.1), "");
        s.apply(&drop(at.x, at.y, 0.5, 0.01)).unwrap();
        let (made, missed) = (s.ledger().made, s.ledger().missed);
        assert!((made + missed - 0.01).abs() < 1e-9);
        for dt in [1e-6, 0.3, 7.0, 1e4] {
            s.advance(dt).unwrap();
            frame(&s);
            let l = s.ledger();
            assert!((s.volume() + l.culled - made).abs() < 1e-10);
        }
    }
    // A pond narrower than a particle, and one of a single sample.
    for (w, h) in [(3, 60), (2, 2)] {
        let mut s = solver(grid(w, h, 0.1), "smallest = 1e-4");
        s.apply(&drop(0.1, 0.1, 0.5, 0.01)).unwrap();
        let made = s.ledger().made;
        for _ in 0..10 {
            s.advance(1.3).unwrap();
            frame(&s);
        }
        assert!((s.volume() + s.ledger().culled - made).abs() < 1e-10);
    }
    // Huge steps and huge numbers.
    let mut s = solver(grid(40, 40, 0.1), "smallest = 1e-3");
    s.apply(&drop(2.0, 2.0, 0.5, 0.5)).unwrap();
    s.launch(&line(Vec2::new(2.0, 2.0), 33.0, 1.0, 0.1, 0.5)).unwrap();
    for dt in [1e-30_f32, 3.0, 1e3, 1e5] {
        s.advance(dt).unwrap();
        frame(&s);
    }
    assert!(s.count() > 0, "a straight front never spreads");
    // A front that runs together, through its focus and beyond.
    let mut s = solver(grid(100, 100, 0.1), OPEN);
    s.launch(&WaveFront {
        spread: -90.0,
        ..line(Vec2::new(2.0, 5.0), 0.0, 4.0, 0.05, 0.5)
    })
    .unwrap();
    let mut highest = 0.0_f32;
    for _ in 0..40 {
        s.advance(0.125).unwrap();
        highest = highest.max(frame(&s).elevation.range().1);
    }
    assert!(highest > 0.2, "the focus: {highest}");
}

#[test]
fn the_scenes_of_the_repository_run() {
    for (file, frames) in [("harbour-particles", 60), ("rain-rings", 40), ("five-waves", 60)] {
        let path = format!("{}/../data/scenes/{file}.toml", env!("CARGO_MANIFEST_DIR"));
        let scene = Scene::load(std::path::Path::new(&path), &[]).unwrap_or_else(|e| panic!("{e}"));
        let solver = meniscus_sim::solvers::build(&scene).unwrap();
        let channels = solver.offers();
        let mut live = meniscus_sim::source::LiveSource::new(&scene, solver, channels);
        let mut frame = Frame::new(scene.grid);
        for _ in 0..frames {
            meniscus_sim::FrameSource::read_into(&mut live, &mut frame)
                .unwrap_or_else(|e| panic!("{file}: {e}"));
        }
        let (low, high) = frame.elevation.range();
        assert!(high > 1e-3 && high - low < 3.0, "{file}: {low} to {high}");
    }
}
