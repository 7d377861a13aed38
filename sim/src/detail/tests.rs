use super::*;
use crate::solvers;
use std::path::Path;

fn build(text: &str) -> Result<Box<dyn Solver>, BuildError> {
    let scene =
        Scene::from_toml(text, Path::new("test"), Path::new("."), &[]).unwrap_or_else(|e| panic!("{e}"));
    solvers::build(&scene)
}

const STILL: &str = "name = 'x'\ndomain.size = [16, 16]\n\
    boundary = { x_min = 'periodic', x_max = 'periodic', z_min = 'periodic', z_max = 'periodic' }\n\
    solver = { kind = 'procedural', spacing = 0.25 }\n";

fn detailed(text: &str) -> Detailed {
    let scene =
        Scene::from_toml(text, Path::new("test"), Path::new("."), &[]).unwrap_or_else(|e| panic!("{e}"));
    let mut bare = scene.clone();
    bare.description.detail = None;
    let how = scene.description.detail.unwrap();
    Detailed::new(&scene, &how, solvers::build(&bare).unwrap()).unwrap()
}

#[test]
fn detail_has_its_height_and_no_seam() {
    for kind in ["'noise', height = 0.02", "'waves', wind = 4.0, fetch = 2000.0"] {
        let detail = detailed(&format!("{STILL}detail = {{ kind = {kind}, period = 8.0 }}"));
        let mut square = 0.0;
        let n = 128;
        for k in 0..n * n {
            let x = Vec2::new((k % n) as f32, (k / n) as f32) * (8.0 / n as f32) + 0.01;
            let here = detail.at(x);
            square += f64::from(here.height).powi(2) / f64::from(n * n);
            let repeated = detail.at(x + Vec2::new(8.0, -16.0));
            // Coordinates of 24 m are rounded to 2e-6 m, on slopes of up to 1.
            assert!((here.height - repeated.height).abs() < 1e-5);
        }
        let deviation = square.sqrt() as f32;
        assert!(
            (deviation / detail.height - 1.0).abs() < 0.4,
            "{kind}: {deviation} of {}",
            detail.height
        );
        // Along a line across the seam the slope is the difference of heights everywhere, and never jumps.
        let (mut x, step) = (7.0_f32, 1e-3_f32);
        let mut before = detail.at(Vec2::new(x, 3.3));
        while x < 9.0 {
            x += step;
            let now = detail.at(Vec2::new(x, 3.3));
            let slope = (now.height - before.height) / step;
            assert!(
                (slope - 0.5 * (now.slope.x + before.slope.x)).abs() < 0.05 * detail.height.max(0.01) / 0.02
            );
            assert!((now.slope.x - before.slope.x).abs() < 0.02 * detail.height.max(0.01) / 0.02);
            before = now;
        }
    }
}

/// A flow that is given.
fn carried_by(detail: &mut Detailed, flow: impl Fn(Vec2) -> Vec2, until: f64, dt: f64) {
    let spec = detail.spec();
    let grid = Grid::from_fn(spec, |i, j| flow(spec.position(i, j)));
    let mut time = 0.0;
    while time < until - 1e-9 {
        time += dt;
        detail.carry(Some(&grid), time, dt);
    }
}

#[test]
fn a_uniform_flow_carries_detail_along_unchanged() {
    let text = format!("{STILL}detail = {{ kind = 'noise', height = 0.02, period = 8.0, lifetime = 4.0 }}");
    let mut detail = detailed(&text);
    let u = Vec2::new(0.7, -0.3);
    carried_by(&mut detail, |_| u, 3.0, 1.0 / 30.0);
    // The first covering began at 0, the second at 2 s.
    for (c, age) in [(0, 3.0), (1, 1.0)] {
        for carried in &detail.coverings[c].carried {
            assert!((*carried - u * age).length() < 2e-3 * age, "{c}: {carried}");
        }
    }
}

#[test]
fn shear_never_stretches_detail_by_more_than_a_lifetime_does() {
    let text = format!("{STILL}detail = {{ kind = 'noise', height = 0.02, period = 8.0, lifetime = 4.0 }}");
    let mut detail = detailed(&text);
    // A shear flow that a periodic domain can hold, with a largest shear of 0.5 1/s.
    let k = std::f32::consts::TAU / 16.0;
    carried_by(
        &mut detail,
        |x| Vec2::new(0.5 / k * (k * x.y).sin(), 0.0),
        61.7,
        0.1,
    );
    let spec = detail.spec();
    let mut steepest = 0.0_f32;
    for covering in &detail.coverings {
        for j in 1..spec.height() {
            let apart = covering.carried[spec.index(5, j)] - covering.carried[spec.index(5, j - 1)];
            steepest = steepest.max(apart.length() / spec.spacing);
        }
    }
    // 0.5 1/s over 4 s is a shear of 2; without new beginnings it would be 30 by now.
    assert!(steepest > 0.5 && steepest <= 2.05, "{steepest}");
}

#[test]
fn detail_neither_pulses_nor_touches_dry_ground() {
    let text = "name = 'x'\ndomain.size = [16, 16]\nterrain = { kind = 'flat', height = -1.0 }\n\
        solver = { kind = 'shallow-water', spacing = 0.25 }\n\
        detail = { kind = 'noise', height = 0.01, period = 8.0, lifetime = 1.0 }";
    let mut solver = build(text).unwrap();
    let mut frame = Frame::new(solver.spec());
    let mut deviations = Vec::new();
    for _ in 0..20 {
        solver.advance(0.05).unwrap();
        solver.extract(Channels::NONE, &mut frame);
        assert_eq!(frame.channels(), Channels::NONE);
        let v = frame.elevation.as_slice();
        deviations.push((v.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>() / v.len() as f64).sqrt());
    }
    let (low, high) = deviations
        .iter()
        .fold((f64::MAX, 0.0_f64), |(l, h), v| (l.min(*v), h.max(*v)));
    assert!(low > 0.006 && high < 0.015, "{low} {high}");
    let dry = text.replace("height = -1.0", "height = 1.0");
    let solver = build(&dry).unwrap();
    solver.extract(Channels::ALL, &mut frame);
    let mut bare = Frame::new(solver.spec());
    let bare_text = dry.split("detail").next().unwrap();
    build(bare_text).unwrap().extract(Channels::ALL, &mut bare);
    assert_eq!(frame, bare);
}

#[test]
fn a_tile_too_small_for_the_samples_is_refused() {
    let text = format!("{STILL}detail = {{ kind = 'noise', height = 0.02, period = 1.0 }}");
    let message = build(&text).err().unwrap().to_string();
    assert!(
        message.contains("detail.period") && message.contains("16 samples"),
        "{message}"
    );
}
