//! Bodies in shallow water against Archimedes, the theory of added mass and a laboratory; conservation; extremes.

#![cfg(all(feature = "bodies", feature = "shallow-water"))]
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use meniscus_sim::events::{Action, EventError};
use meniscus_sim::frame::BodyPose;
use meniscus_sim::glam::{Vec2, Vec3};
use meniscus_sim::scene::Scene;
use meniscus_sim::shallow_water::ShallowWater;
use meniscus_sim::{Channels, Frame, FrameSource, Solver};
use std::path::Path;

/// A square tank of still water with its level at 0, and objects in it.
struct Tank {
    side: f32,
    depth: f32,
    spacing: f32,
    more: &'static str,
    objects: String,
}

impl Tank {
    fn new(side: f32, depth: f32, spacing: f32) -> Self {
        Self {
            side,
            depth,
            spacing,
            more: "",
            objects: String::new(),
        }
    }

    /// Adds a free object, described by further keys.
    fn free(mut self, name: &str, shape: &str, position: [f32; 3], density: f32, keys: &str) -> Self {
        self.objects += &format!(
            "[[object]]\nname = \"{name}\"\nshape = {shape}\nposition = {position:?}\ndensity = {density}\n{keys}\n\
             motion = {{ kind = \"free\" }}\n"
        );
        self
    }

    fn scene(&self) -> Scene {
        let Self {
            side,
            depth,
            spacing,
            more,
            objects,
        } = self;
        let text = format!(
            "name = \"tank\"\nduration = 1000.0\ndomain = {{ origin = [{0}, {0}], size = [{side}, {side}] }}\n\
             terrain = {{ kind = \"flat\", height = {1} }}\n\
             solver = {{ kind = \"shallow-water\", spacing = {spacing} }}\n{more}\n{objects}",
            -0.5 * side,
            -depth
        );
        Scene::from_toml(&text, Path::new("tank.toml"), Path::new("."), &[]).unwrap()
    }

    fn solver(&self) -> ShallowWater {
        ShallowWater::from_scene(&self.scene()).unwrap()
    }
}

/// Flat enough to float upright at any density; a cube would lie on an edge.
const FLAT: &str = r#"{ kind = "box", size = [1.0, 0.6, 1.0] }"#;
const OPEN: &str = r#"boundary = { x_min = "open", x_max = "open", z_min = "open", z_max = "open" }"#;
const CUBE: &str = r#"{ kind = "box", size = [1.0, 1.0, 1.0] }"#;

fn pose(solver: &ShallowWater, k: usize) -> BodyPose {
    solver.bodies().unwrap().poses()[k]
}

/// Runs for `duration`, handing the state to `each` after every `dt`.
fn run(solver: &mut ShallowWater, duration: f32, dt: f32, mut each: impl FnMut(&ShallowWater)) {
    for _ in 0..(duration / dt).round() as u32 {
        solver.advance(dt).unwrap();
        each(solver);
    }
}

/// Mean height of the water over the whole tank.
fn mean_level(solver: &ShallowWater) -> f64 {
    let elevations = solver.elevations();
    elevations.iter().sum::<f64>() / elevations.len() as f64
}

/// Times between upward passages of the mean of the last values, by linear interpolation.
fn period(heights: &[f64], dt: f64, passages: usize) -> f64 {
    let rest =
        heights[heights.len() * 3 / 4..].iter().sum::<f64>() / (heights.len() - heights.len() * 3 / 4) as f64;
    let mut times = Vec::new();
    for (k, pair) in heights.windows(2).enumerate() {
        let (a, b) = (pair[0] - rest, pair[1] - rest);
        if a < 0.0 && b >= 0.0 {
            times.push(dt * (k as f64 + a / (a - b)));
        }
    }
    assert!(times.len() > passages, "{} passages", times.len());
    (times[passages] - times[0]) / passages as f64
}

/// Heave added mass of the half spheroid with horizontal half-axis `a` and volume `v` (Lamb § 114), in its displacement.
fn heave_share(a: f64, v: f64) -> f64 {
    let c = 3.0 * v / (2.0 * std::f64::consts::PI * a * a);
    let share = if c > a {
        let e = (1.0 - a * a / (c * c)).sqrt();
        2.0 * (1.0 - e * e) / e.powi(3) * (0.5 * ((1.0 + e) / (1.0 - e)).ln() - e)
    } else {
        let e = (1.0 - c * c / (a * a)).sqrt();
        2.0 / (e * e) * (1.0 - (1.0 - e * e).sqrt() * e.asin() / e)
    };
    share / (2.0 - share)
}

#[test]
fn a_floating_box_comes_to_rest_at_archimedes_draft() {
    for (density, height) in [(600.0, 0.4_f32), (200.0, 0.3), (900.0, 0.9)] {
        let mut tank = Tank::new(8.0, 3.0, 0.25).free("box", FLAT, [0.0, height, 0.0], density, "");
        // Without friction a closed tank would slosh for ever.
        tank.more = OPEN;
        let mut solver = tank.solver();
        run(&mut solver, 40.0, 0.1, |_| {});
        let pose = pose(&solver, 0);
        let draft = mean_level(&solver) - (f64::from(pose.position.y) - 0.3);
        let expected = 0.6 * f64::from(density) / 1000.0;
        assert!(
            (draft / expected - 1.0).abs() < 0.01,
            "density {density}: draft {draft} for {expected}"
        );
        println!(
            "density {density}: draft {draft:.5} m for {expected:.5} m, {:?}",
            pose.velocity
        );
        assert!(
            pose.velocity.y.abs() < 1e-3 && pose.angular_velocity.length() < 1e-3,
            "{pose:?}"
        );
        // In the middle of the tank nothing pushes it aside. (Elsewhere the waves of the open edges set it adrift, which
        // is resisted by the square of its speed alone and dies out as 1/t.)
        assert!(pose.velocity.length() < 1e-3, "{pose:?}");
    }
}

#[test]
fn a_box_bobs_with_the_period_of_added_mass_theory() {
    // The square's second moment is that of an ellipse of half-axis 2/√12; 0.3 m³ are submerged.
    let added = 1000.0 * 0.3 * heave_share(2.0 / 12.0_f64.sqrt(), 0.3);
    let theory = std::f64::consts::TAU * ((300.0 + added) / 9810.0).sqrt();
    for spacing in [0.5, 0.25] {
        let mut tank = Tank::new(20.0, 4.0, spacing).free("box", FLAT, [0.0, 0.05, 0.0], 500.0, "");
        tank.more = OPEN;
        let mut solver = tank.solver();
        let mut heights = Vec::new();
        run(&mut solver, 12.0, 0.02, |s| {
            heights.push(f64::from(pose(s, 0).position.y))
        });
        let found = period(&heights, 0.02, 2);
        println!("period at spacing {spacing}: {found:.4} s, theory {theory:.4} s");
        assert!((found / theory - 1.0).abs() < 0.05, "{found} s for {theory} s");
    }
}

/// Heave decay of a sphere of 0.3 m and 7.056 kg in 0.9 m of water: M. B. Kramer et al., Energies 14, 269 (2021).
#[test]
fn a_sphere_bobs_as_in_the_laboratory() {
    let mut tank = Tank::new(8.0, 0.9, 0.1).free(
        "sphere",
        r#"{ kind = "sphere", radius = 0.15 }"#,
        [0.0, 0.03, 0.0],
        500.0,
        "",
    );
    tank.more = OPEN;
    let mut solver = tank.solver();
    let mut heights = Vec::new();
    run(&mut solver, 6.0, 0.01, |s| {
        heights.push(f64::from(pose(s, 0).position.y))
    });
    let found = period(&heights, 0.01, 2);
    println!("sphere: {found:.4} s");
    assert!((found / 0.76 - 1.0).abs() < 0.05, "{found} s");
}

#[test]
fn a_stone_sinks_and_rests_on_the_ground() {
    let ball = r#"{ kind = "sphere", radius = 0.3 }"#;
    let mut solver = Tank::new(6.0, 2.0, 0.25)
        .free("stone", ball, [0.0, 1.0, 0.0], 2500.0, "")
        .solver();
    run(&mut solver, 10.0, 0.1, |_| {});
    let pose = pose(&solver, 0);
    assert!((pose.position.y + 1.7).abs() < 0.01, "{pose:?}");
    assert!(pose.velocity.length() < 1e-2, "{pose:?}");
    let submerged = solver.bodies().unwrap().submerged_volume(0);
    let volume = 4.0 / 3.0 * std::f64::consts::PI * 0.027;
    assert!((submerged / volume - 1.0).abs() < 0.01);
    // The pond has risen by the stone.
    let rise = mean_level(&solver) * 625.0 * 0.0625;
    assert!(
        (rise / submerged - 1.0).abs() < 1e-3,
        "{rise} m³ for {submerged} m³"
    );
}

#[test]
fn a_tilted_box_rights_itself() {
    let flat = r#"{ kind = "box", size = [1.2, 0.4, 1.2] }"#;
    let tilt = "rotation = { axis = [0.3, 0.0, 1.0], angle = 50 }";
    let mut solver = Tank::new(8.0, 3.0, 0.25)
        .free("box", flat, [0.0, 0.3, 0.0], 500.0, tilt)
        .solver();
    run(&mut solver, 20.0, 0.1, |_| {});
    let up = pose(&solver, 0).rotation * Vec3::Y;
    assert!(up.y > 0.999, "{up}");
}

#[test]
fn bodies_collide_and_do_not_pass_through_each_other() {
    let mut solver = Tank::new(10.0, 3.0, 0.25)
        .free(
            "left",
            CUBE,
            [-1.2, 0.0, 0.0],
            500.0,
            "velocity = [3.0, 0.0, 0.0]",
        )
        .free(
            "right",
            CUBE,
            [1.2, 0.0, 0.1],
            500.0,
            "velocity = [-3.0, 0.0, 0.0]",
        )
        .solver();
    let (mut nearest, mut met) = (f32::MAX, false);
    run(&mut solver, 6.0, 0.05, |s| {
        let gap = pose(s, 1).position.x - pose(s, 0).position.x;
        nearest = nearest.min(gap);
        met |= gap < 1.1;
    });
    assert!(met && nearest > 0.95, "{nearest}");
}

#[test]
fn a_towed_boat_leaves_a_wake_and_the_water_is_all_there() {
    let mut tank = Tank::new(40.0, 2.0, 0.5);
    tank.objects = "[[object]]\nname = \"boat\"\nshape = { kind = \"box\", size = [4.0, 1.5, 1.5] }\n\
        motion = { kind = \"path\", points = [{ time = 0.0, position = [-12.0, 0.25, 0.0] }, \
        { time = 8.0, position = [12.0, 0.25, 0.0] }] }\n"
        .into();
    let mut solver = tank.solver();
    let before = solver.report().mass;
    run(&mut solver, 6.0, 0.1, |s| {
        assert!((s.report().mass / before - 1.0).abs() < 1e-12);
    });
    let frame = frame(&solver);
    let along = |x: f32, z: f32| frame.elevation.sample(Vec2::new(x, z));
    let boat = pose(&solver, 0).position.x;
    assert!((boat - 6.0).abs() < 0.3);
    assert!(
        along(boat + 3.0, 0.0) > 0.02,
        "no bow wave: {}",
        along(boat + 3.0, 0.0)
    );
    let (low, high) = frame.elevation.range();
    assert!(low < -0.03 && high < 1.0, "{low} {high}");
    for (x, z) in [(0.0, 3.0), (4.0, 2.0), (-6.0, 5.0)] {
        assert!(
            (along(x, z) - along(x, -z)).abs() < 2e-3,
            "the wake is lopsided at {x}, {z}"
        );
    }
}

#[test]
fn water_and_bodies_exchange_momentum_and_lose_none() {
    // Without walls for the water and on a level bed nothing else takes momentum.
    let mut tank = Tank::new(12.0, 2.0, 0.25)
        .free(
            "box",
            CUBE,
            [-2.0, 0.1, -1.0],
            600.0,
            "velocity = [2.0, 0.0, 1.0]\nspin = [0.0, 2.0, 0.5]",
        )
        .free(
            "ball",
            r#"{ kind = "sphere", radius = 0.4 }"#,
            [2.0, 1.0, 1.0],
            300.0,
            "velocity = [-1.0, 0.0, 0.3]",
        );
    tank.more = "boundary = { x_min = \"periodic\", x_max = \"periodic\", z_min = \"periodic\", z_max = \"periodic\" }";
    let mut solver = tank.solver();
    let total = |s: &ShallowWater| {
        let (water, bodies) = (s.report().momentum, s.bodies().unwrap().momentum());
        [water[0] + bodies[0], water[1] + bodies[2]]
    };
    let (start, mass) = (total(&solver), solver.report().mass);
    assert!(start[0] > 1000.0);
    run(&mut solver, 4.0, 0.1, |s| {
        for (now, start) in total(s).into_iter().zip(start) {
            // Momentum of 300 t of water in single precision.
            assert!((now - start).abs() < 2.0, "{now} kg m/s of {start}");
        }
        assert!((s.report().mass / mass - 1.0).abs() < 1e-12);
    });
    // And it did go over.
    assert!(solver.report().momentum[0] > 0.3 * start[0]);
}

#[test]
fn energy_never_grows() {
    let tank = Tank::new(10.0, 2.0, 0.25)
        .free(
            "box",
            CUBE,
            [0.0, 1.5, 0.0],
            400.0,
            "rotation = { axis = [1.0, 0.0, 0.4], angle = 30 }\nvelocity = [1.0, -2.0, 0.0]",
        )
        .free(
            "light",
            r#"{ kind = "sphere", radius = 0.3 }"#,
            [2.0, -1.0, 1.0],
            5.0,
            "",
        );
    let mut solver = tank.solver();
    let start = solver.report().energy;
    let mut lowest = start;
    run(&mut solver, 15.0, 0.05, |s| {
        let now = s.report().energy;
        // First-order coupling: a bounded wobble of a percent of what there was, no drift.
        assert!(
            now < lowest + 0.01 * start.abs(),
            "energy grew to {now} J from {lowest} J"
        );
        lowest = lowest.min(now);
    });
    assert!(lowest < 0.5 * start, "{lowest} {start}");
}

fn frame(solver: &ShallowWater) -> Frame {
    let mut frame = Frame::new(solver.spec());
    solver.extract(solver.offers(), &mut frame);
    frame.check_finite().unwrap();
    frame
}

#[test]
fn extremes_are_survived_or_refused() {
    let ball = |r: f32| format!("{{ kind = \"sphere\", radius = {r} }}");
    let cases = [
        ("feather", CUBE.to_string(), [0.0, 0.6, 0.0], 0.6, ""),
        ("lead", CUBE.to_string(), [0.0, 0.6, 0.0], 600_000.0, ""),
        ("light below", ball(0.5), [0.0, -2.0, 0.0], 1.0, ""),
        ("smaller than a cell", ball(0.02), [0.1, 0.0, 0.1], 500.0, ""),
        ("dropped from high", ball(0.5), [0.0, 1000.0, 0.0], 700.0, ""),
        (
            "thrown hard",
            CUBE.to_string(),
            [0.0, 0.5, 0.0],
            500.0,
            "velocity = [200.0, -50.0, 30.0]\nspin = [30.0, 5.0, 60.0]",
        ),
        (
            "nearly as large as the tank",
            r#"{ kind = "box", size = [7.5, 1.0, 7.5] }"#.into(),
            [0.0, 0.0, 0.0],
            500.0,
            "",
        ),
        (
            "deeper than the water",
            r#"{ kind = "box", size = [1.0, 5.0, 1.0] }"#.into(),
            [0.0, -0.4, 0.0],
            500.0,
            "",
        ),
    ];
    for (name, shape, position, density, keys) in cases {
        let mut solver = Tank::new(8.0, 3.0, 0.5)
            .free(name, &shape, position, density, keys)
            .solver();
        let mass = solver.report().mass;
        let duration = if position[1] > 100.0 { 25.0 } else { 8.0 };
        run(&mut solver, duration, 0.1, |s| {
            assert!((s.report().mass / mass - 1.0).abs() < 1e-12, "{name}: mass");
            assert!(s.report().energy.is_finite(), "{name}: energy");
        });
        let frame = frame(&solver);
        assert!(
            frame.elevation.range().1 < 3.0,
            "{name}: {:?}",
            frame.elevation.range()
        );
        let at = pose(&solver, 0).position;
        assert!(
            at.x.abs() <= 4.0 && at.z.abs() <= 4.0 && at.y > -3.1 && at.y < 20.0,
            "{name}: {at}"
        );
    }
    let refused = |shape: &str, position: [f32; 3]| {
        let scene = Tank::new(8.0, 3.0, 0.5)
            .free("body", shape, position, 500.0, "")
            .scene();
        ShallowWater::from_scene(&scene)
            .err()
            .expect("refused")
            .to_string()
    };
    assert!(refused(CUBE, [0.0, -3.0, 0.0]).contains("0.500 m deep in the ground"));
    assert!(refused(CUBE, [9.0, 0.0, 0.0]).contains("outside of the domain"));
    assert!(refused(r#"{ kind = "box", size = [20.0, 1.0, 1.0] }"#, [0.0; 3]).contains("20.000 m"));
}

/// A box, a ball and a towed boat, with a hand and a shove.
fn busy() -> Tank {
    let mut tank = Tank::new(10.0, 2.0, 0.25)
        .free("box", CUBE, [0.0, 0.8, 0.0], 600.0, "spin = [1.0, 0.0, 2.0]")
        .free(
            "ball",
            r#"{ kind = "sphere", radius = 0.4 }"#,
            [1.0, 2.0, 0.3],
            300.0,
            "",
        );
    tank.objects += "[[object]]\nname = \"boat\"\nshape = { kind = \"box\", size = [1.0, 0.8, 0.6] }\n\
        motion = { kind = \"path\", points = [{ time = 0.0, position = [-4.0, 0.0, -3.0] }, \
        { time = 4.0, position = [4.0, 0.0, -3.0] }] }\n";
    tank
}

#[test]
fn threads_and_restarts_change_no_bit() {
    let tank = busy();
    let run_for = |solver: &mut ShallowWater, steps: u32| {
        for _ in 0..steps {
            solver.advance(1.0 / 30.0).unwrap();
        }
    };
    let in_pool = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let mut solver = tank.solver();
            run_for(&mut solver, 60);
            solver.checkpoint()
        })
    };
    let whole = in_pool(1);
    assert!(whole == in_pool(2), "another number of threads, another result");

    let mut first = tank.solver();
    run_for(&mut first, 25);
    let saved = first.checkpoint();
    let mut second = tank.solver();
    second.restore(&saved).unwrap();
    assert!(second.checkpoint() == saved);
    run_for(&mut second, 35);
    assert!(second.checkpoint() == whole, "a restart changes the run");
    let mut other = Tank::new(10.0, 2.0, 0.25).solver();
    assert!(other.restore(&saved).is_err());
}

#[test]
fn ground_that_rises_lifts_what_stands_on_it() {
    let mut tank = Tank::new(10.0, 2.0, 0.25).free(
        "block",
        r#"{ kind = "box", size = [0.8, 0.6, 0.8] }"#,
        [0.3, -1.7, -0.2],
        2500.0,
        "",
    );
    // By 0.8 m from 0.5 to 2.5 s, under the block and far around it; the ground falls off between two samples.
    tank.more =
        "bed = [{ kind = 'patch', min = [-3, -3], max = [3, 3], height = 0.8, start = 0.5, rise = 2 }]";
    let run_for = |solver: &mut ShallowWater, steps: u32| {
        for _ in 0..steps {
            solver.advance(1.0 / 30.0).unwrap();
        }
    };
    let mut whole = tank.solver();
    run_for(&mut whole, 45);
    let half_way = whole.checkpoint();
    // At 1.5 s half of it. Contacts take out what overlaps at ω/(ω dt + 2 ζ) = 14 a second (30 Hz, ζ = 5, steps of 1/60 s),
    // so the block follows ground that rises at 0.4 m/s by 2.8 cm.
    let bottom = |solver: &ShallowWater| f64::from(solver.bodies().unwrap().poses()[0].position.y) - 0.3;
    let lag = -1.6 - bottom(&whole);
    assert!((0.02..0.034).contains(&lag), "{lag}");
    run_for(&mut whole, 75);
    assert!((bottom(&whole) - -1.2).abs() < 0.01, "{}", bottom(&whole));
    assert_eq!(whole.report().clamps, 0, "pushed, not put");

    let mut again = tank.solver();
    again.restore(&half_way).unwrap();
    run_for(&mut again, 75);
    assert!(
        again.checkpoint() == whole.checkpoint(),
        "a restart changes the run"
    );
}

#[test]
fn hands_and_shoves_act_live_and_replay_exactly() {
    let mut solver = Tank::new(10.0, 2.0, 0.25)
        .free("box", CUBE, [0.0, 0.0, 0.0], 500.0, "")
        .solver();
    let drag = Action::Drag {
        body: "box".into(),
        grip: Vec3::ZERO,
        target: Vec3::new(3.0, 1.0, -1.0),
    };
    solver.apply(&drag).unwrap();
    run(&mut solver, 6.0, 0.1, |_| {});
    let held = pose(&solver, 0).position;
    // Held out of the water, hanging g/ω² below the hand.
    assert!(
        (held - Vec3::new(3.0, 1.0 - 0.0981, -1.0)).length() < 0.02,
        "{held}"
    );
    solver.apply(&Action::Release { body: "box".into() }).unwrap();
    run(&mut solver, 4.0, 0.1, |_| {});
    assert!(pose(&solver, 0).position.y < 0.3);
    let shove = |body: &str| Action::Shove {
        body: body.into(),
        velocity: Vec3::new(0.0, 5.0, 0.0),
        spin: Vec3::ZERO,
    };
    solver.apply(&shove("box")).unwrap();
    assert!((pose(&solver, 0).velocity.y - 5.0).abs() < 0.2);
    assert!(matches!(
        solver.apply(&shove("ghost")),
        Err(EventError::NoBody { .. })
    ));
    let mut without = Tank::new(10.0, 2.0, 0.5).solver();
    assert!(matches!(
        without.apply(&shove("box")),
        Err(EventError::Unsupported { .. })
    ));
    assert!(without.bodies().is_none() && without.extras().is_empty());

    // The same by the scene's schedule, twice.
    let mut tank = busy();
    tank.objects += "[[event]]\nkind = \"drag\"\nstart = 0.2\nend = 1.0\nbody = \"box\"\nfrom = [0, 1, 0]\nto = [2, 1, 1]\n\
        [[event]]\nkind = \"shove\"\ntime = 1.2\nbody = \"ball\"\nvelocity = [1, 3, 0]\n";
    let frames = |again: &[(f64, Action)]| {
        let scene = tank.scene();
        let solver = Box::new(ShallowWater::from_scene(&scene).unwrap());
        let source = meniscus_sim::source::LiveSource::new(&scene, solver, Channels::ALL);
        let mut source = source.until(2.0).repeating(again);
        let mut frame = Frame::new(scene.grid);
        let mut all = Vec::new();
        while let meniscus_sim::Progress::Frame(_) = source.read_into(&mut frame).unwrap() {
            all.push(frame.clone());
            // A hand in a window, the first time.
            if again.is_empty() && all.len() == 20 {
                source.act(&shove("ball")).unwrap();
            }
        }
        (all, source.acted().to_vec())
    };
    let (first, acted) = frames(&[]);
    assert_eq!(acted.len(), 1);
    let (second, repeated) = frames(&acted);
    assert!(first == second && acted == repeated && first.len() == 61);
    let bodies = first[60].bodies.as_ref().unwrap();
    assert!(bodies.len() == 3 && bodies[0].position != Vec3::new(0.0, 0.8, 0.0));
}
