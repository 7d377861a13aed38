//! What objects and their waves do.

use super::*;

fn mover(shape: Shape, points: Vec<(f64, Vec3)>) -> Object {
    Object {
        name: "box".to_owned(),
        shape,
        position: points[0].1,
        rotation: glam::Quat::IDENTITY,
        velocity: Vec3::ZERO,
        spin: Vec3::ZERO,
        density: 600.0,
        motion: Motion::Path {
            points: points
                .into_iter()
                .map(|(time, position)| WayPoint {
                    time,
                    position,
                    rotation: glam::Quat::IDENTITY,
                })
                .collect(),
        },
        color: None,
    }
}

#[test]
fn a_box_pushed_under_makes_waves_of_the_volume_it_displaces() {
    let size = Vec3::new(1.0, 1.0, 1.5);
    for (from, to, displaced) in [
        (0.5, 0.1, 0.6),
        (0.2, -0.3, 0.75),
        (-2.0, 0.3, -1.2),
        (1.0, -3.0, 1.5),
    ] {
        let mut description = scene(grid(100, 100, 0.1), "smallest = 1e-8");
        let at = |y: f32| Vec3::new(5.0, y, 5.0);
        description.description.objects =
            vec![mover(Shape::Box { size }, vec![(0.3, at(from)), (1.1, at(to))])];
        description.meshes = vec![TriangleMesh::cuboid(size)];
        let mut s = WaveParticles::from_scene(&description).unwrap();
        s.advance(0.7).unwrap();
        s.advance(1.3).unwrap();
        let l = s.ledger();
        assert!((l.made - displaced).abs() < 1e-6, "{from} to {to}: {}", l.made);
        assert!((s.volume() + l.culled - displaced).abs() < 1e-6 && l.missed == 0.0);
    }
}

#[test]
fn a_bobbing_box_radiates_rings_as_symmetric_as_itself() {
    let size = Vec3::new(1.0, 1.0, 1.0);
    let mut description = scene(grid(121, 121, 0.1), &format!("smallest = 1e-7\n{OPEN}"));
    let y = |k: u32| 0.15 * (TAU * f64::from(k) / 16.0).sin() as f32;
    let points = (0..64)
        .map(|k| (0.1 * f64::from(k), Vec3::new(6.0, y(k), 6.0)))
        .collect();
    description.description.objects = vec![mover(Shape::Box { size }, points)];
    description.meshes = vec![TriangleMesh::cuboid(size)];
    let mut s = WaveParticles::from_scene(&description).unwrap();
    for _ in 0..12 {
        s.advance(0.5).unwrap();
    }
    let f = frame(&s);
    let highest = f.elevation.range().1;
    assert!(highest > 1e-3);
    for j in 0..121 {
        for i in 0..121 {
            let here = f.elevation[(i, j)];
            for there in [f.elevation[(120 - i, j)], f.elevation[(j, i)]] {
                assert!(
                    (here - there).abs() < 0.02 * highest,
                    "({i}, {j}): {here} {there}"
                );
            }
        }
    }
    // Round as well: a square patch of pressure makes waves 0.94 times as high ahead of a side as ahead of a corner by
    // linear theory (its transform at this wave number); the particles make 0.955.
    let ring = |angle: f64| {
        let ray = DVec2::from_angle(angle);
        (30..50)
            .map(|k| field(&s, DVec2::splat(6.0) + 0.1 * f64::from(k) * ray).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let (side, corner) = (ring(0.02), ring(PI / 4.0 + 0.02));
    assert!((side / corner - 0.94).abs() < 0.05, "{side} {corner}");
}

#[test]
fn a_boat_under_way_adds_no_volume_and_leaves_a_wake() {
    let size = Vec3::new(2.0, 0.8, 0.6);
    let mut description = scene(grid(160, 80, 0.1), &format!("smallest = 1e-6\n{OPEN}"));
    let points = vec![(0.0, Vec3::new(3.0, 0.1, 4.0)), (4.0, Vec3::new(13.0, 0.1, 4.0))];
    description.description.objects = vec![mover(Shape::Box { size }, points)];
    description.meshes = vec![TriangleMesh::cuboid(size)];
    let mut s = WaveParticles::from_scene(&description).unwrap();
    s.advance(2.9).unwrap();
    assert!(s.ledger().made.abs() < 1e-6, "{}", s.ledger().made);
    let f = frame(&s);
    // 2.5 times as fast as the waves: a crest ahead, and nothing beyond the Mach line, 24 degrees from the track.
    assert!(f.elevation.range().1 > 0.01);
    assert!(f.elevation[(90, 78)].abs() < 1e-6);
    let again = {
        let mut s = WaveParticles::from_scene(&description).unwrap();
        for _ in 0..29 {
            s.advance(0.1).unwrap();
        }
        frame(&s)
    };
    let most = f.elevation.as_slice().iter().zip(again.elevation.as_slice());
    let most = most.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(most < 1e-5, "the frame rate changes nothing: {most}");
}
