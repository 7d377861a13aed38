//! Solvers from scenes, driven through time with their events.

#![allow(clippy::unwrap_used, missing_docs, reason = "test code")]

use glam::{UVec2, Vec2, Vec3};
use meniscus_sim::events::{Action, EventError, TICK};
use meniscus_sim::scene::description::{Description, Event, Motion, Object, Shape, WayPoint};
use meniscus_sim::solvers::{self, BuildError};
use meniscus_sim::source::LiveSource;
use meniscus_sim::{
    Channels, Frame, FrameSource, Grid, GridSpec, Progress, Scene, Solver, SourceError, StepError, StepReport,
};
use std::path::Path;

fn scene(solver: &str) -> Scene {
    let text = format!("name = \"test\"\n[solver]\nspacing = 0.25\n{solver}");
    let description: Description = toml::from_str(&text).unwrap();
    Scene {
        description,
        grid: GridSpec::new(Vec2::ZERO, 0.25, UVec2::new(64, 48)).unwrap(),
        terrain: None,
        meshes: Vec::new(),
        sky: None,
        initial_elevation: None,
        uplifts: Vec::new(),
    }
}

fn pond() -> Scene {
    scene("kind = \"wave-equation\"\ndepth = 1.0")
}

fn live(scene: &Scene, channels: Channels) -> LiveSource {
    LiveSource::new(scene, solvers::build(scene).unwrap(), channels)
}

fn next(source: &mut LiveSource, frame: &mut Frame) -> StepReport {
    match source.read_into(frame).unwrap() {
        Progress::Frame(Some(report)) => report,
        other => panic!("{other:?}"),
    }
}

fn drop_at(time: f64) -> Event {
    Event::Drop {
        time,
        position: Vec2::new(8.0, 6.0),
        radius: 1.0,
        volume: 0.1,
    }
}

#[test]
fn stages_tell_where_the_time_of_a_frame_went() {
    let tank = "name = \"tank\"\ndomain = { size = [8, 8] }\nterrain = { kind = \"flat\", height = -1.0 }\n\
                solver = { kind = \"shallow-water\", spacing = 0.25 }";
    let tank = Scene::from_toml(tank, Path::new("tank.toml"), Path::new("."), &[]).unwrap();
    for (scene, names) in [
        (pond(), &["wave-equation", "frame"][..]),
        (tank, &["flow", "totals", "frame"]),
    ] {
        let mut source = live(&scene, Channels::DEPTH);
        let mut frame = Frame::new(scene.grid);
        let start = std::time::Instant::now();
        for k in 0..3 {
            next(&mut source, &mut frame);
            let listed: Vec<&str> = source.stages().iter().map(|(name, _)| *name).collect();
            // The first frame is the initial state: nothing is solved for it.
            assert_eq!(listed, if k == 0 { &["frame"] } else { names });
        }
        let spent: f64 = source.stages().iter().map(|(_, seconds)| seconds).sum();
        assert!(spent > 0.0 && spent <= start.elapsed().as_secs_f64(), "{spent}");
    }
}

#[test]
fn every_solver_that_is_compiled_in_can_be_built_by_its_name() {
    let infos = solvers::available();
    assert_eq!(
        infos.iter().map(|s| s.name).collect::<Vec<_>>(),
        [
            "wave-equation",
            "procedural",
            "shallow-water",
            "ocean",
            "wave-particles",
            "sph"
        ]
    );
    for info in infos.iter().filter(|s| s.compiled) {
        let mut scene = scene(&format!("kind = \"{}\"", info.name));
        scene.terrain = Some(Grid::filled(scene.grid, -1.0));
        let solver = solvers::build(&scene).unwrap();
        assert_eq!(solver.name(), info.name);
        assert_eq!(solver.time(), 0.0);
        assert_eq!(solver.report().substeps, 0);
        assert!(solver.bytes() < 1 << 24);
    }
}

#[test]
fn a_builder_refuses_the_scene_of_another_solver() {
    let error = meniscus_sim::procedural::Procedural::from_scene(&pond())
        .err()
        .unwrap();
    assert!(matches!(
        error,
        BuildError::WrongSolver {
            expected: "procedural",
            found: "wave-equation"
        }
    ));
}

#[test]
fn frames_stand_at_whole_multiples_of_the_frame_time() {
    let mut scene = pond();
    scene.description.recording.rate = 24.0;
    scene.description.events = vec![drop_at(0.0), drop_at(0.503), drop_at(0.504)];
    let mut source = live(&scene, Channels::NONE);
    let mut frame = Frame::new(scene.grid);
    let first = next(&mut source, &mut frame);
    // Frame 0 is the initial state: what happens at time 0 shows in frame 1.
    assert_eq!((frame.time, frame.index, first.substeps), (0.0, 0, 0));
    assert!(frame.elevation.as_slice().iter().all(|&e| e == 0.0));
    for k in 1..50 {
        let report = next(&mut source, &mut frame);
        assert_eq!((frame.time, frame.index), (k as f64 / 24.0, k));
        assert!((source.solver().time() - frame.time).abs() < 1e-7);
        let drops = 1 + if k > 12 { 2 } else { 0 };
        assert!(
            (report.mass - 100.0 * f64::from(drops)).abs() < 1e-3,
            "{k}: {}",
            report.mass
        );
        // Sub-steps of all parts of the interval are counted: frame 13 is cut twice.
        let whole = (1.0_f64 / 24.0 / (0.95 * report.largest_stable_step)).ceil() as u32;
        assert!(report.substeps >= whole && report.substeps <= whole + if k == 13 { 2 } else { 0 });
    }
}

#[test]
fn events_act_at_their_own_times_whatever_the_frame_rate() {
    let at_two_seconds = |rate: f64| {
        let mut scene = scene("kind = \"wave-equation\"\ndepth = 1.0\nstep = 0.005");
        scene.description.recording.rate = rate;
        scene.description.events = vec![drop_at(0.337), drop_at(1.111)];
        let mut source = live(&scene, Channels::NONE);
        let mut frame = Frame::new(scene.grid);
        for _ in 0..=(2.0 * rate) as u32 {
            next(&mut source, &mut frame);
        }
        assert_eq!(frame.time, 2.0);
        frame
    };
    let fine = at_two_seconds(120.0);
    let coarse = at_two_seconds(4.0);
    let most = fine
        .elevation
        .as_slice()
        .iter()
        .fold(0.0_f32, |a, b| a.max(b.abs()));
    let worst = fine
        .elevation
        .as_slice()
        .iter()
        .zip(coarse.elevation.as_slice())
        .fold(0.0_f32, |a, (p, q)| a.max((p - q).abs()));
    // Only the lengths of the sub-steps differ a little, by their second-order error. Events rounded to frames would
    // move the ring by most of its width.
    assert!(worst < 5e-3 * most, "{worst} of {most}");
}

#[test]
fn rain_is_the_same_for_a_seed_and_another_for_another() {
    let run = |seed: u64, rate: f64| {
        let mut scene = pond();
        scene.description.seed = seed;
        scene.description.recording.rate = rate;
        scene.description.events = vec![Event::Rain {
            start: 0.0,
            end: None,
            rate: 40.0,
            radius: 0.4,
            volume: 2e-3,
            adds_water: true,
        }];
        let mut source = live(&scene, Channels::NONE);
        let mut frame = Frame::new(scene.grid);
        let mut mass = 0.0;
        for _ in 0..=rate as u32 {
            mass = next(&mut source, &mut frame).mass;
        }
        (frame.elevation, mass)
    };
    let (one, mass) = run(7, 32.0);
    assert_eq!(one, run(7, 32.0).0);
    assert_ne!(one, run(8, 32.0).0);
    // At another frame rate the same drops fall: whole ticks end with the second at both. Drops at the edge lose what
    // falls beyond it, the same at both rates.
    assert_eq!((1.0 / TICK).fract(), 0.0);
    let (_, other) = run(7, 16.0);
    assert!(
        (mass - other).abs() < 1e-4 * mass && mass > 40.0,
        "{mass} {other}"
    );
}

#[test]
fn rain_that_adds_no_water_keeps_the_volume() {
    let mut scene = pond();
    scene.description.events = vec![
        Event::Rain {
            start: 0.0,
            end: None,
            rate: 200.0,
            radius: 0.4,
            volume: 2e-3,
            adds_water: false,
        },
        Event::Sweep {
            start: 0.2,
            end: 1.7,
            from: Vec2::new(-2.0, 6.0),
            to: Vec2::new(18.0, 7.0),
            radius: 0.8,
            rate: 0.5,
        },
    ];
    let mut source = live(&scene, Channels::NONE);
    let mut frame = Frame::new(scene.grid);
    for _ in 0..60 {
        let report = next(&mut source, &mut frame);
        let size: f64 = frame
            .elevation
            .as_slice()
            .iter()
            .map(|&e| f64::from(e.abs()))
            .sum::<f64>()
            * 1000.0
            / 16.0;
        assert!(report.mass.abs() <= 1e-5 * size, "{} of {size}", report.mass);
    }
    assert!(frame.elevation.range().1 > 0.01);
}

#[test]
fn a_run_ends_when_it_is_told_to() {
    let mut source = live(&pond(), Channels::NONE).until(0.1);
    assert_eq!(source.frames(), Some(4));
    let mut frame = Frame::new(pond().grid);
    for _ in 0..4 {
        next(&mut source, &mut frame);
    }
    let before = frame.clone();
    for _ in 0..2 {
        assert_eq!(source.read_into(&mut frame).unwrap(), Progress::End);
    }
    assert_eq!(frame, before);
    assert_eq!(live(&pond(), Channels::NONE).until(-1.0).frames(), Some(0));
}

#[test]
fn poses_of_objects_come_with_the_frames() {
    let mut scene = pond();
    let object = |motion| Object {
        name: "boat".to_owned(),
        shape: Shape::Sphere { radius: 0.3 },
        position: Vec3::new(1.0, 2.0, 3.0),
        rotation: glam::Quat::IDENTITY,
        velocity: glam::Vec3::ZERO,
        spin: glam::Vec3::ZERO,
        density: 500.0,
        motion,
        color: None,
    };
    let point = |time, x| WayPoint {
        time,
        position: Vec3::new(x, 1.0, 2.0),
        rotation: glam::Quat::from_rotation_y(0.3 * x),
    };
    scene.description.objects = vec![
        object(Motion::Fixed),
        object(Motion::Path {
            points: vec![point(0.5, 0.0), point(1.5, 4.0)],
        }),
    ];
    scene.description.recording.rate = 2.0;
    let mut source = live(&scene, Channels::ALL);
    assert_eq!(
        source.channels(),
        Channels::DEPTH | Channels::VELOCITY | Channels::BODIES
    );
    let mut frame = Frame::new(scene.grid);
    let mut poses = Vec::new();
    for _ in 0..5 {
        next(&mut source, &mut frame);
        poses.push(frame.bodies.clone().unwrap());
    }
    assert!(
        poses
            .iter()
            .all(|p| p.len() == 2 && p[0].position == Vec3::new(1.0, 2.0, 3.0))
    );
    let x: Vec<f32> = poses.iter().map(|p| p[1].position.x).collect();
    assert_eq!(x, [0.0, 0.0, 2.0, 4.0, 4.0]);
    assert_eq!(poses[2][1].velocity, Vec3::new(4.0, 0.0, 0.0));
    assert!((poses[2][1].angular_velocity - Vec3::new(0.0, 1.2, 0.0)).length() < 1e-5);
    assert_eq!(poses[4][1].velocity, Vec3::ZERO);
}

#[test]
fn live_actions_show_in_the_next_frame() {
    let scene = pond();
    let mut source = live(&scene, Channels::NONE);
    let mut frame = Frame::new(scene.grid);
    next(&mut source, &mut frame);
    let press = Action::Press {
        position: Vec2::new(8.0, 6.0),
        radius: 1.0,
        depth: 0.1,
    };
    source.act(&press).unwrap();
    next(&mut source, &mut frame);
    assert!(frame.elevation[(32, 24)] < -0.05);

    let mut sea = live(&self::scene("kind = \"procedural\""), Channels::NONE);
    assert!(matches!(sea.act(&press), Err(EventError::Unsupported { .. })));
}

/// A solver that hands out what it is told to.
struct Broken {
    spec: GridSpec,
    time: f64,
    value: f32,
    fails: bool,
}

impl Solver for Broken {
    fn name(&self) -> &'static str {
        "broken"
    }
    fn spec(&self) -> GridSpec {
        self.spec
    }
    fn time(&self) -> f64 {
        self.time
    }
    fn offers(&self) -> Channels {
        Channels::NONE
    }
    fn advance(&mut self, dt: f32) -> Result<StepReport, StepError> {
        self.time += f64::from(dt);
        if self.fails {
            Err(StepError::InvalidStep { dt })
        } else {
            Ok(StepReport::default())
        }
    }
    fn extract(&self, want: Channels, out: &mut Frame) {
        out.prepare(self.spec, want & self.offers());
        out.elevation.as_mut_slice().fill(self.value);
    }
    fn apply(&mut self, _: &Action) -> Result<(), EventError> {
        Ok(())
    }
    fn report(&self) -> StepReport {
        StepReport::default()
    }
    fn bytes(&self) -> u64 {
        0
    }
}

#[test]
fn values_that_are_no_numbers_and_failed_states_never_become_frames() {
    let scene = pond();
    let broken = |value, fails| {
        let solver = Broken {
            spec: scene.grid,
            time: 0.0,
            value,
            fails,
        };
        LiveSource::new(&scene, Box::new(solver), Channels::NONE)
    };
    let mut frame = Frame::new(scene.grid);
    let mut source = broken(f32::NAN, false);
    for _ in 0..2 {
        assert!(matches!(
            source.read_into(&mut frame),
            Err(SourceError::NonFinite(_))
        ));
    }
    let mut source = broken(0.0, true);
    next(&mut source, &mut frame);
    for _ in 0..3 {
        assert!(matches!(source.read_into(&mut frame), Err(SourceError::Step(_))));
    }
    // It failed at the first step and was not stepped again.
    assert!(source.solver().time() < 0.04);
}
