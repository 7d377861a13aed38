//! Walls and shores.

use super::*;

/// A wall through the middle of the domain, at an angle: the straight shore of a plane beach.
fn beach(grid: GridSpec, point: DVec2, normal: DVec2, keys: &str) -> Scene {
    let terrain = Grid::from_fn(grid, |i, j| {
        let p = grid.position(i, j).as_dvec2();
        -(p - point).dot(normal) as f32
    });
    Scene {
        terrain: Some(terrain),
        ..scene(grid, &format!("{keys}\n{OPEN}"))
    }
}

#[test]
fn a_wall_of_any_angle_shows_the_mirror_image() {
    for degrees in [0.0_f64, 17.0, 45.0, 73.0, 90.0, 201.0] {
        let normal = DVec2::from_angle(degrees.to_radians());
        let spec = grid(120, 120, 0.1);
        let point = DVec2::splat(6.0) - 2.0 * normal;
        let keys = "smallest = 1e-7";
        let mut walled = WaveParticles::from_scene(&beach(spec, point, normal, keys)).unwrap();
        // The same water without a wall, with the source and its mirror image.
        let mut free = solver(spec, &format!("{keys}\n{OPEN}"));
        let at = DVec2::splat(6.0) + 0.5 * normal + 0.4 * normal.perp();
        let image = at - 2.0 * (at - point).dot(normal) * normal;
        let act = |p: DVec2| drop(p.x as f32, p.y as f32, 0.6, 0.05);
        walled.apply(&act(at)).unwrap();
        free.apply(&act(at)).unwrap();
        free.apply(&act(image)).unwrap();
        for time in [1.7_f32, 2.45, 2.6, 3.9] {
            walled.advance(time - walled.time() as f32).unwrap();
            free.advance(time - free.time() as f32).unwrap();
            let (a, b) = (frame(&walled), frame(&free));
            let highest = b.elevation.range().1;
            let (mut worst, mut square, mut whole) = (0.0_f32, 0.0_f64, 0.0_f64);
            for k in 0..spec.len() {
                let p = spec.position(k % 120, k / 120).as_dvec2();
                if (p - point).dot(normal) > 0.02 {
                    let (x, y) = (a.elevation.as_slice()[k], b.elevation.as_slice()[k]);
                    worst = worst.max((x - y).abs());
                    square += f64::from(x - y).powi(2);
                    whole += f64::from(y).powi(2);
                }
            }
            // The image's particles are the mirror image only up to where on the ring they stand: the ripple. The
            // shore's line is f32, and its cells cut the straight line into pieces.
            let error = (square / whole).sqrt();
            assert!(
                error < 0.02,
                "{degrees} deg, t = {time}: {error}, worst {worst} of {highest}"
            );
        }
    }
}

#[test]
fn a_round_shore_keeps_every_particle_inside() {
    let spec = grid(90, 90, 0.1);
    let centre = DVec2::new(4.4, 4.5);
    let mut description = scene(spec, "smallest = 1e-6");
    description.terrain = Some(Grid::from_fn(spec, |i, j| {
        ((spec.position(i, j).as_dvec2() - centre).length() - 3.5) as f32
    }));
    let mut s = WaveParticles::from_scene(&description).unwrap();
    s.apply(&drop(3.0, 4.0, 0.5, 0.05)).unwrap();
    let made = s.ledger().made;
    for _ in 0..40 {
        s.advance(1.0).unwrap();
        for (p, ..) in s.particles() {
            assert!((p - centre).length() < 3.5 + 1e-6, "{p} has leaked");
        }
        let l = s.ledger();
        assert!((s.volume() + l.culled - made).abs() < 1e-11 * made && l.strandings == 0);
        let f = frame(&s);
        let (w, h) = (volume_of_wet(&f, &description), s.volume());
        // Dry samples along a shore that cuts through cells: a few parts in a hundred of what is near the shore.
        assert!((w - h).abs() < 0.05 * made, "{w} {h}");
    }
    assert!(s.events() > 3000);
}

fn volume_of_wet(f: &Frame, scene: &Scene) -> f64 {
    let ground = scene.ground_on_grid().unwrap();
    let sum: f64 = (0..f.spec().len())
        .filter(|&k| ground.as_slice()[k] < 0.0)
        .map(|k| f64::from(f.elevation.as_slice()[k]))
        .sum();
    sum * f.spec().cell_area()
}

#[test]
fn nothing_passes_a_thin_breakwater() {
    // A breakwater of 0.3 m across the whole pond, particles of radius 1 m.
    let spec = grid(120, 60, 0.1);
    let mut description = scene(spec, "smallest = 1e-6");
    let size = Vec3::new(0.3, 4.0, 12.0);
    description.description.objects = vec![Object {
        name: "breakwater".to_owned(),
        shape: Shape::Box { size },
        position: Vec3::new(6.03, 0.0, 3.0),
        rotation: glam::Quat::from_rotation_y(0.1),
        velocity: Vec3::ZERO,
        spin: Vec3::ZERO,
        density: 2600.0,
        motion: Motion::Fixed,
        color: None,
    }];
    description.meshes = vec![TriangleMesh::cuboid(size)];
    let mut s = WaveParticles::from_scene(&description).unwrap();
    s.apply(&drop(3.0, 3.0, 1.0, 0.2)).unwrap();
    for _ in 0..60 {
        s.advance(0.25).unwrap();
        let f = frame(&s);
        for j in 0..60 {
            for i in 72..120 {
                assert_eq!(f.elevation[(i, j)], 0.0, "({i}, {j}) at {}", s.time());
            }
        }
        for (p, ..) in s.particles() {
            assert!(p.x < 6.4);
        }
    }
}

/// Two walls that meet at an angle: a wedge of water between two beaches.
fn wedge(degrees: f64) -> (Scene, DVec2) {
    let spec = grid(160, 80, 0.1);
    let tip = DVec2::new(1.03, 4.02);
    let half = 0.5 * degrees.to_radians();
    let (up, down) = (
        DVec2::from_angle(half - PI / 2.0),
        DVec2::from_angle(PI / 2.0 - half),
    );
    let ground = Grid::from_fn(spec, |i, j| {
        let p = spec.position(i, j).as_dvec2() - tip;
        -p.dot(up).min(p.dot(down)) as f32
    });
    let scene = Scene {
        terrain: Some(ground),
        ..scene(
            spec,
            "smallest = 1e-6\nlimit = 3e5\n[boundary]\nx_max = \"open\"\n",
        )
    };
    (scene, tip)
}

#[test]
fn wedges_of_any_angle_end_every_path_and_leak_nothing() {
    for degrees in [1.0, 7.0, 30.0, 90.0] {
        let (description, tip) = wedge(degrees);
        let mut s = WaveParticles::from_scene(&description).unwrap();
        let reach = 11.0;
        s.launch(&line(Vec2::new(12.0, tip.y as f32), 180.0, 0.05, 0.05, 0.5))
            .unwrap();
        let made = s.ledger().made;
        assert!(made > 0.0);
        for _ in 0..60 {
            s.advance(0.5).unwrap();
            frame(&s);
            for (p, ..) in s.particles() {
                let d = p - tip;
                let angle = d.to_angle().abs().to_degrees();
                // Marching squares rounds the tip off by up to a cell.
                let slack = 2.0 * SQRT_2 * 0.1;
                let beside = d.length() * (angle - 0.5 * degrees).max(0.0).to_radians().sin();
                assert!(
                    beside < slack && d.length() < reach + 20.0,
                    "{degrees}: {p} has leaked"
                );
            }
        }
        let l = s.ledger();
        assert!(
            (s.volume() + l.culled + l.left + l.stranded - made).abs() < 1e-9 * made,
            "{l:?}"
        );
    }
}
