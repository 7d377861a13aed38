//! Edges, shores and actions.

use super::*;

/// Share of the amplitude that comes back from an open edge, for wave packets of `points` samples a wavelength that meet
/// it at `angle` from the normal.
fn reflection(points: f64, angle: f64, scheme: &str) -> f64 {
    // A whole number of waves across: that sets the exact angle.
    let (w, c) = (640_u32, 1.0);
    let k = TAU / points;
    let across = if angle > 0.0 {
        (TAU / (k * angle.sin())).round() as u32
    } else {
        4
    };
    let kz = if angle > 0.0 { TAU / f64::from(across) } else { 0.0 };
    let kx = (k * k - kz * kz).sqrt();
    let spec = grid(w, across, 1.0);
    let keys = format!(
        "speed = {c}\nscheme = \"{scheme}\"\nstep = 0.35\n[boundary]\nx_min = \"open\"\nx_max = \"open\"\nz_min = \"periodic\"\nz_max = \"periodic\""
    );
    let middle = 0.5 * f64::from(w);
    let width = 45.0;
    let mut solver = solver(&scene(spec, &keys, |i, j| {
        let x = i as f64 - middle;
        ((kx * x + kz * j as f64).cos() * (-0.5 * (x / width).powi(2)).exp()) as f32
    }));
    let before = solver.energies().physical;
    // Two packets leave for the two edges; stop when what comes back is in the middle again.
    let speed = c * kx / k;
    solver.advance((2.0 * middle / speed) as f32).unwrap();
    (solver.energies().physical / before).sqrt()
}

#[test]
fn open_edges_let_waves_out_as_first_order_absorption_does() {
    for scheme in ["explicit", "implicit"] {
        let normal = [8.0, 16.0, 32.0].map(|points| reflection(points, 0.0, scheme));
        println!("{scheme}: reflection at normal incidence for 8, 16, 32 samples a wave: {normal:.5?}");
        for (points, measured) in [8.0, 16.0, 32.0].into_iter().zip(normal) {
            // Exact in the continuum; the half cell of the edge makes it second order, (k·spacing)²/16 or so.
            assert!(measured < (TAU / points).powi(2) / 12.0, "{points}: {measured}");
        }
        for degrees in [30.0_f64, 45.0, 60.0] {
            let angle = degrees.to_radians();
            let theory = (1.0 - angle.cos()) / (1.0 + angle.cos());
            let measured = reflection(24.0, angle, scheme);
            println!("{scheme}: at {degrees}°: {measured:.4} (theory {theory:.4})");
            // The packet spans some degrees, and the theory is that of the continuum.
            assert!(
                (measured / theory - 1.0).abs() < 0.1,
                "{degrees}: {measured} {theory}"
            );
        }
    }
}

#[test]
fn every_combination_of_edges_takes_energy_or_keeps_it() {
    let spec = grid(36, 28, 0.5);
    let pairs = [
        ["wall", "wall"],
        ["wall", "open"],
        ["open", "wall"],
        ["open", "open"],
        ["periodic", "periodic"],
    ];
    for scheme in ["explicit", "implicit"] {
        for [x_min, x_max] in pairs {
            for [z_min, z_max] in pairs {
                let keys = format!(
                    "depth = 1.0\nscheme = \"{scheme}\"\n[boundary]\nx_min = \"{x_min}\"\nx_max = \"{x_max}\"\nz_min = \"{z_min}\"\nz_max = \"{z_max}\""
                );
                let mut solver = solver(&scene(spec, &keys, |i, j| uneven(i, j).1));
                let volume = solver.volume();
                solver.advance(0.05).unwrap();
                let mut last = solver.energies().conserved;
                for _ in 0..60 {
                    // One sub-step each at half the limit, so that leap-frog's own energy is exact.
                    solver.advance(0.05).unwrap();
                    let now = solver.energies().conserved;
                    assert!(now <= last * (1.0 + 1e-6), "{keys}: {now} after {last}");
                    last = now;
                }
                if !keys.contains("open") {
                    assert!(
                        (solver.volume() - volume).abs() < 1e-6 * volume_in_motion(&solver),
                        "{keys}"
                    );
                }
            }
        }
    }
}

#[test]
fn raised_water_drains_through_open_edges_and_stays_within_walls() {
    let spec = grid(40, 30, 0.5);
    let open =
        "depth = 1.0\n[boundary]\nx_min = \"open\"\nx_max = \"open\"\nz_min = \"open\"\nz_max = \"open\"";
    for scheme in ["explicit", "implicit"] {
        let mut leaving = solver(&scene(spec, &format!("scheme = \"{scheme}\"\n{open}"), |_, _| {
            0.2
        }));
        let mut last = leaving.report().energy;
        for _ in 0..40 {
            let report = leaving.advance(0.5).unwrap();
            // An open edge never gives energy. Leap-frog's own swings are below a thousandth of what there was.
            assert!(
                report.energy <= last * 1.001 + 1e-3,
                "{scheme}: {} after {last}",
                report.energy
            );
            last = report.energy;
        }
        assert!(
            leaving.volume().abs() < 1e-3 * 0.2 * 300.0,
            "{scheme}: {}",
            leaving.volume()
        );
    }
    let mut staying = solver(&scene(spec, "depth = 1.0", |_, _| 0.2));
    staying.advance(10.0).unwrap();
    assert!(staying.deviation().iter().all(|&e| e == 0.2));
}

#[test]
fn water_does_not_cross_land() {
    let divided = |i: usize, j: usize| {
        let ground = if i == 30 { 1.0 } else { -2.0 + 0.01 * j as f32 };
        (ground, if i < 30 { 0.3 * (0.2 * i as f32).cos() } else { 0.0 })
    };
    for keys in ["", "scheme = \"implicit\""] {
        let mut solver = solver(&basin(60, 40, keys, divided));
        let mass = solver.report().mass;
        for _ in 0..20 {
            solver.advance(0.5).unwrap();
        }
        for j in 0..40 {
            for i in 30..60 {
                assert_eq!(solver.deviation()[j * 60 + i], 0.0, "{i} {j}");
            }
        }
        let after = solver.report().mass;
        assert!((after / mass - 1.0).abs() < 1e-7, "{mass} {after}");
        // 59 by 40 samples of 0.25 m² with 1.805 m of water on average, and what was raised.
        let rest = 59.0 * 40.0 * 0.25 * 1.805 * 1000.0;
        assert!((mass - rest - 1000.0 * solver.volume()).abs() < 1e-3 * rest);
    }
}

#[test]
fn frames_of_a_shore_are_dry_on_land_and_never_deeper_than_nothing() {
    let mut solver = solver(&basin(70, 52, "", |i, j| (uneven(i, j).0, -1.9)));
    solver.advance(0.7).unwrap();
    let mut frame = Frame::new(solver.spec());
    solver.extract(Channels::ALL, &mut frame);
    assert_eq!(frame.channels(), Channels::DEPTH | Channels::VELOCITY);
    frame.check_finite().unwrap();
    let (depth, velocity) = (frame.depth.as_ref().unwrap(), frame.velocity.as_ref().unwrap());
    let mut dry = 0;
    for j in 0..52 {
        for i in 0..70 {
            let ground = uneven(i, j).0;
            let elevation = frame.elevation[(i, j)];
            assert!(depth[(i, j)] >= 0.0);
            assert_eq!(
                depth[(i, j)],
                if ground < 0.0 {
                    (elevation - ground).max(0.0)
                } else {
                    0.0
                }
            );
            if ground >= 0.0 {
                dry += 1;
                assert!(elevation <= ground && velocity[(i, j)] == Vec2::ZERO);
            }
        }
    }
    assert!(dry > 20);
}
