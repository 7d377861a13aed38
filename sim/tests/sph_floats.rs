//! Bodies in water of particles: it moves them, and they move it.
#![allow(clippy::unwrap_used)] // a test may panic
#![cfg(all(feature = "sph", feature = "bodies"))]

use meniscus_sim::events::Action;
use meniscus_sim::glam::{DMat3, DVec3, Vec3};
use meniscus_sim::recording::{Reader, Writer};
use meniscus_sim::scene::description::Description;
use meniscus_sim::source::LiveSource;
use meniscus_sim::sph::{Boundary, Float, Fluid, Model, Obstacle, Settings, Solid, Sph, cases};
use meniscus_sim::{BodyPose, Channels, Frame, FrameSource as _, Scene, Solver, solvers};
use std::path::Path;

fn scene(text: &str) -> Scene {
    let description = Description::from_toml(text, Path::new("tank.toml"), &[]).unwrap();
    let meshes = description.objects.iter().map(|o| match o.shape {
        meniscus_sim::scene::description::Shape::Sphere { radius } => {
            meniscus_sim::mesh::TriangleMesh::sphere(radius)
        }
        meniscus_sim::scene::description::Shape::Box { size } => {
            meniscus_sim::mesh::TriangleMesh::cuboid(size)
        }
        _ => panic!("no such shape here"),
    });
    let meshes = meshes.collect();
    Scene::from_parts(description, None, meshes, None, None).unwrap()
}

/// A tank one particle thick, 0.8 m wide, with water 0.2 m deep and a box across it.
fn pontoon(particle: f32, density: f32, size: [f32; 2], height: f32, rest: &str) -> Scene {
    scene(&format!(
        "name = 'pontoon'\nduration = 9.0\ndomain = {{ size = [0.8, {particle}] }}\n\
         terrain = {{ kind = 'flat', height = -0.2 }}\n\
         [solver]\nkind = 'sph'\nspacing = {}\nparticle = {particle}\n\
         [[object]]\nname = 'box'\nshape = {{ kind = 'box', size = [{}, {}, {}] }}\n\
         position = [0.4, {height}, {}]\ndensity = {density}\nmotion = {{ kind = 'free' }}\n{rest}",
        0.5 * particle,
        size[0],
        size[1],
        0.98 * particle,
        0.5 * particle,
    ))
}

fn pose(solver: &dyn Solver) -> BodyPose {
    let mut frame = Frame::new(solver.spec());
    solver.extract(Channels::BODIES, &mut frame);
    frame.bodies.unwrap()[0]
}

/// Depth of the bottom of a box of `size` in m below the level that the tank would have with it, by Archimedes.
fn draft(solver: &dyn Solver, particle: f32, size: [f32; 2], density: f32) -> (f64, f64) {
    let area = f64::from(0.8 * particle);
    let displaced = f64::from(size[0] * size[1] * 0.98 * particle) * f64::from(density) / 1000.0;
    let level = (solver.report().mass / 1000.0 + displaced) / area - 0.2;
    let bottom = f64::from(pose(solver).position.y - 0.5 * size[1]);
    (level - bottom, displaced / f64::from(size[0] * particle))
}

#[test]
fn a_pontoon_floats_at_its_draft() {
    for (particle, density, size) in [(0.01, 250.0, [0.24, 0.16]), (0.02, 800.0, [0.24, 0.16])] {
        let at = 0.5 * size[1] - size[1] * density / 1000.0;
        let mut solver = Sph::from_scene(&pontoon(particle, density, size, at, "")).unwrap();
        solver.advance(1.0).unwrap();
        let (mut found, mut theory) = (0.0, 0.0);
        for _ in 0..20 {
            solver.advance(0.05).unwrap();
            let (draft, archimedes) = draft(&solver, particle, size, density);
            found += 0.05 * draft;
            theory = archimedes;
        }
        // A sixth of a spacing of the finer tank.
        let error = found / theory - 1.0;
        assert!(
            error.abs() < 0.04,
            "{density} kg/m³: draft {found} m, theory {theory} m"
        );
    }
}

#[test]
fn a_light_raft_and_a_heavy_stone_gain_no_energy_and_end_where_they_must() {
    for (density, height) in [(20.0, 0.1), (100.0, -0.1), (3000.0, 0.15)] {
        let size = [0.12, 0.06];
        let mut solver = Sph::from_scene(&pontoon(0.02, density, size, height, "")).unwrap();
        let start = solver.report();
        let mut most = start.energy;
        for _ in 0..30 {
            solver.advance(0.05).unwrap();
            most = most.max(solver.report().energy);
        }
        // Of the water's weight times the half of its depth: what a lattice that settles may have.
        let tolerance = 2e-4 * start.mass * 9.81 * 0.1;
        assert!(
            most <= start.energy + tolerance,
            "{density}: {} J grew to {most} J",
            start.energy
        );
        let end = pose(&solver).position.y;
        if density > 1000.0 {
            assert!((end + 0.17).abs() < 0.005, "on the floor: {end}");
        } else {
            assert!(end > -0.02, "afloat: {end}");
        }
    }
}

/// Water without weight or walls, and a ball that flies into it.
#[test]
fn water_and_body_keep_their_momentum_together() {
    for model in [Model::Dfsph, Model::Mcg03] {
        let d = 0.1;
        let settings = Settings {
            model,
            stiffness: 400.0,
            gravity: Vec3::ZERO,
            viscosity: 0.0,
            ..Settings::water(d)
        };
        let mut boundary = Boundary::none();
        let pose = BodyPose {
            position: Vec3::new(-0.4, 0.35, 0.3),
            velocity: Vec3::X,
            ..BodyPose::default()
        };
        boundary
            .obstacles
            .push(Obstacle::new(Solid::Box(Vec3::splat(0.25)), pose));
        let mut fluid = Fluid::new(settings, boundary);
        cases::fill(&mut fluid, Vec3::ZERO, Vec3::new(0.8, 0.6, 0.6));
        let mass = 0.3 * 1000.0 * 0.125;
        let mut body = Float {
            obstacle: 0,
            mass,
            inertia: DMat3::from_diagonal(DVec3::splat(mass * 0.25 / 6.0)),
            centre: pose.position.as_dvec3(),
            velocity: DVec3::X,
            spin: DVec3::ZERO,
        };
        let start = mass;
        let mut time = 0.0;
        while time < 0.4 {
            let step = fluid.stable_step().min(0.01) as f32;
            fluid.set_floats([body]);
            fluid.step(step);
            body = fluid.floats()[0];
            body.centre += f64::from(step) * body.velocity;
            // It is not let turn, so that its shape needs no rotation.
            body.spin = DVec3::ZERO;
            fluid.boundary_mut().obstacles[0].pose.position = body.centre.as_vec3();
            time += f64::from(step);
        }
        let water: DVec3 = fluid.velocities().iter().map(|v| v.truncate().as_dvec3()).sum();
        let all = fluid.particle_mass() * water + mass * body.velocity;
        // Pressure acts on both alike; single precision of the water's velocities is left.
        assert!(
            (all - start * DVec3::X).length() < 1e-6 * start,
            "{model:?}: {all} of {start}"
        );
        assert!(body.velocity.x < 0.7, "{}", body.velocity);
    }
}

#[test]
fn hands_drag_bodies_and_vessels_tilt() {
    let size = [0.12, 0.06];
    let tilt = "[[event]]\nkind = 'tilt'\ntime = 0.5\ngravity = [1.0, -9.76, 0.0]\n";
    let scene = pontoon(0.02, 300.0, size, 0.01, tilt);
    let mut solver = solvers::build(&scene).unwrap();
    solver
        .apply(&Action::Drag {
            body: "box".into(),
            grip: Vec3::ZERO,
            target: Vec3::new(0.6, 0.05, 0.01),
        })
        .unwrap();
    solver.advance(1.5).unwrap();
    let held = pose(&*solver).position;
    assert!((held.x - 0.6).abs() < 0.02, "{held}");
    solver.apply(&Action::Release { body: "box".into() }).unwrap();
    solver
        .apply(&Action::Tilt {
            gravity: Vec3::new(1.0, -9.76, 0.0),
        })
        .unwrap();
    solver.advance(2.0).unwrap();
    let mut frame = Frame::new(solver.spec());
    solver.extract(Channels::NONE, &mut frame);
    assert!(frame.elevation[(70, 0)] > frame.elevation[(8, 0)] + 0.03);
    let error = solver.apply(&Action::Release { body: "cat".into() }).unwrap_err();
    assert!(error.to_string().contains("cat"), "{error}");
}

#[test]
fn posts_that_stand_can_be_dragged_through_the_water() {
    for model in ["dfsph", "mcg03"] {
        let text = format!(
            "name = 'post'\ndomain = {{ size = [0.8, 0.02] }}\nterrain = {{ kind = 'flat', height = -0.2 }}\n\
             [solver]\nkind = 'sph'\nmodel = '{model}'\nspacing = 0.01\nparticle = 0.02\n\
             [[object]]\nname = 'post'\nshape = {{ kind = 'box', size = [0.08, 0.5, 0.02] }}\nposition = [0.2, 0, 0.01]\n\
             [[event]]\nkind = 'drag'\nstart = 0.5\nend = 1.0\nbody = 'post'\nfrom = [0.2, 0, 0.01]\nto = [0.6, 0, 0.01]\n"
        );
        let scene = scene(&text);
        assert!(scene.description.can_drag(&scene.description.objects[0]));
        let live = || LiveSource::new(&scene, solvers::build(&scene).unwrap(), Channels::BODIES);
        let (mut source, mut frame) = (live(), Frame::new(scene.grid));
        let (mut piled, mut kept) = (0.0_f32, Vec::new());
        for k in 0..60 {
            source.read_into(&mut frame).unwrap();
            let post = frame.bodies.as_ref().unwrap()[0];
            let x = post.position.x;
            assert!(
                k > 15 || (x == 0.2 && post.velocity == Vec3::ZERO),
                "{x} at frame {k}"
            );
            // Water piles up before the post and falls behind it.
            let [before, behind] =
                [x + 0.06, x - 0.06].map(|x| frame.elevation.sample(meniscus_sim::glam::Vec2::new(x, 0.01)));
            piled = piled.max(before - behind);
            kept.push(frame.clone());
        }
        let end = kept[59].bodies.as_ref().unwrap()[0];
        assert!(
            (0.5..=0.61).contains(&end.position.x),
            "{model}: {}",
            end.position
        );
        assert!(
            end.velocity.length() < 1e-3,
            "{model}: let go, yet {}",
            end.velocity
        );
        assert!(piled > 0.01, "{model}: {piled} m");
        // Nothing was pressed through walls or left inside the post.
        let solver = source.solver();
        assert!(solver.report().mass > 0.0 && solver.report().largest_stable_step > 0.0);
        let stages: Vec<_> = solver.stages().iter().map(|s| s.0).collect();
        assert!(
            stages.contains(&"neighbours") && stages.contains(&"motion"),
            "{stages:?}"
        );
        let spent: f64 = source.stages().iter().map(|s| s.1).sum();
        assert!(spent > 0.0, "{:?}", source.stages());
        let mut again = live();
        for (k, first) in kept.iter().enumerate() {
            again.read_into(&mut frame).unwrap();
            assert!(frame == *first, "{model}: frame {k}");
        }
    }
    // A hand far away pulls no further than the tank, and no one drags what is not there.
    let text = "name = 'post'\ndomain = { size = [0.4, 0.4] }\nterrain = { kind = 'flat', height = -0.1 }\n\
                [solver]\nkind = 'sph'\nspacing = 0.02\nparticle = 0.04\n\
                [[object]]\nname = 'post'\nshape = { kind = 'sphere', radius = 0.05 }\nposition = [0.2, 0, 0.2]\n";
    let mut solver = solvers::build(&scene(text)).unwrap();
    let drag = |body: &str, target| Action::Drag {
        body: body.into(),
        grip: Vec3::ZERO,
        target,
    };
    solver.apply(&drag("post", Vec3::new(1e6, -1e6, 0.2))).unwrap();
    solver.advance(2.0).unwrap();
    let there = pose(&*solver).position;
    assert!((there - Vec3::new(0.4, -0.5, 0.2)).length() < 1e-3, "{there}");
    assert!(
        solver
            .apply(&drag("cat", Vec3::ZERO))
            .unwrap_err()
            .to_string()
            .contains("cat")
    );
    assert!(solver.apply(&drag("post", Vec3::NAN)).is_err());
}

#[test]
fn a_recording_keeps_particles_and_what_was_done() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tank.mrec");
    let scene = pontoon(0.02, 300.0, [0.12, 0.06], 0.01, "");
    let channels = Channels::PARTICLES | Channels::BODIES;
    let live = || LiveSource::new(&scene, solvers::build(&scene).unwrap(), channels);
    let mut source = live();
    let mut writer = Writer::create(&path, &scene, channels).unwrap();
    let (mut frames, mut seen) = (Vec::new(), 0);
    for k in 0..4 {
        let mut frame = Frame::new(scene.grid);
        source.read_into(&mut frame).unwrap();
        writer.push_acted(&frame, None, &source.acted()[seen..]).unwrap();
        seen = source.acted().len();
        frames.push(frame);
        if k == 1 {
            let gravity = Vec3::new(2.0, -9.6, 0.0);
            source.act(&Action::Tilt { gravity }).unwrap();
        }
    }
    writer.finish().unwrap();
    let count = frames[0].particles.as_ref().unwrap().len();
    // 40 by 10 particles, less what the box takes.
    assert!((370..400).contains(&count), "{count}");
    let mut reader = Reader::open(&path).unwrap();
    let acted: Vec<_> = (0..reader.len()).flat_map(|k| reader.acted(k).unwrap()).collect();
    assert_eq!(acted.len(), 1);
    let mut again = live().repeating(&acted);
    for (k, frame) in frames.iter().enumerate() {
        let mut other = Frame::new(scene.grid);
        reader.read(k, &mut other).unwrap();
        assert_eq!(other.particles, frame.particles);
        again.read_into(&mut other).unwrap();
        assert!(other == *frame, "frame {k}");
    }
}
