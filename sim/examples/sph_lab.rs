#![allow(missing_docs, clippy::all, clippy::print_stdout, clippy::unwrap_used)]
use meniscus_sim::glam::{Vec2, Vec3};
use meniscus_sim::sph::*;
use std::time::Instant;
fn fill(f: &mut Fluid, low: Vec3, high: Vec3) {
    let d = f.settings().spacing;
    let n = ((high - low) / d).round().as_uvec3();
    for y in 0..n.y {
        for z in 0..n.z {
            for x in 0..n.x {
                f.add(
                    low + d * (Vec3::new(x as f32, y as f32, z as f32) + 0.5),
                    Vec3::ZERO,
                );
            }
        }
    }
}
fn energy(f: &Fluid) -> (f64, f64) {
    let m = f.particle_mass();
    let ke: f64 = f
        .velocities()
        .iter()
        .map(|v| 0.5 * m * v.truncate().length_squared() as f64)
        .sum();
    let pe: f64 = f.positions().iter().map(|p| m * 9.81 * p.y as f64).sum();
    (ke, pe)
}
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let arg = |k: usize, d: f64| args.get(k).and_then(|s| s.parse().ok()).unwrap_or(d);
    match args[1].as_str() {
        "dam" => {
            let d = arg(2, 0.02) as f32;
            let end = arg(3, 1.0);
            let mut f = Fluid::new(
                Settings::water(d),
                Boundary::tank(Vec2::ZERO, Vec2::new(2.0, 0.52), 0.0),
            );
            fill(&mut f, Vec3::new(0.0, 0.0, 0.01), Vec3::new(0.5, 1.0, 0.51));
            println!("n {}", f.len());
            let start = Instant::now();
            let (mut t, mut steps, mut it, mut worst, mut mean, mut out) =
                (0.0, 0, [0u32; 2], 0.0_f64, 0.0, 0.0);
            while t < end {
                let dt = f.stable_step().min(end - t);
                let s = f.step(dt as f32);
                t += dt;
                steps += 1;
                it[0] += s.iterations[0];
                it[1] += s.iterations[1];
                worst = worst.max(s.compression);
                mean += s.compression;
                if t >= out {
                    out += end / 10.0;
                    let e = energy(&f);
                    println!(
                        "t {t:.3} dt {dt:.2e} it {:?} c {:.2e} vmax {:.2} ke {:.3} pe {:.3} tot {:.3}",
                        s.iterations,
                        s.compression,
                        f.fastest(),
                        e.0,
                        e.1,
                        e.0 + e.1
                    );
                }
            }
            println!(
                "steps {steps} wall {:.2} it/step {:.1} {:.1} compression mean {:.2e} worst {:.2e}",
                start.elapsed().as_secs_f64(),
                it[0] as f64 / steps as f64,
                it[1] as f64 / steps as f64,
                mean / steps as f64,
                worst
            );
        }
        "still" => {
            let n = arg(2, 20.0) as usize;
            let end = arg(3, 2.0);
            let h = 0.5;
            let d = h / n as f32;
            let thick = arg(4, 1.0) as f32;
            let mut f = Fluid::new(
                Settings::water(d),
                Boundary::tank(Vec2::ZERO, Vec2::new(0.3, thick * d), 0.0),
            );
            fill(&mut f, Vec3::ZERO, Vec3::new(0.3, h, thick * d));
            let (mut t, mut out) = (0.0, 0.0);
            println!("n {}", f.len());
            while t < end {
                let dt = f.stable_step().min(end - t);
                let s = f.step(dt as f32);
                t += dt;
                if t >= out {
                    out += end / 10.0;
                    let mut ys: Vec<f32> = f.positions().iter().map(|p| p.y).collect();
                    ys.sort_by(f32::total_cmp);
                    let top = ys[ys.len() - (0.3 / d) as usize * thick as usize / 2] + d / 2.0;
                    let mean: f32 = ys.iter().sum::<f32>() / ys.len() as f32 * 2.0;
                    let mut err = 0.0_f64;
                    for k in 0..f.len() {
                        let y = f.positions()[k].y;
                        let p = f.pressure(k) / (9.81 * h as f64) - (h - y) as f64 / h as f64;
                        err += p * p;
                    }
                    let e = energy(&f);
                    println!(
                        "t {t:.3} dt {dt:.2e} it {:?} c {:.2e} vmax {:.4} depth {:.4} mean*2 {:.4} p rms {:.4} ke {:.2e}",
                        s.iterations,
                        s.compression,
                        f.fastest(),
                        top / h,
                        mean / h,
                        (err / f.len() as f64).sqrt(),
                        e.0
                    );
                }
            }
        }
        "mm" => {
            // a = column width, n particles across, tank long.
            let n = arg(2, 30.0) as usize;
            let end = arg(3, 5.0);
            let thick = arg(4, 1.0) as f32;
            let a = arg(5, 2.25) as f32 * 0.0254;
            let d = a / n as f32;
            let mut f = Fluid::new(
                Settings::water(d),
                Boundary::tank(Vec2::ZERO, Vec2::new(20.0 * a, thick * d), 0.0),
            );
            fill(&mut f, Vec3::ZERO, Vec3::new(a, 2.0 * a, thick * d));
            let unit = (a / (2.0 * 9.81)).sqrt() as f64; // t = T sqrt(a/2g)
            let data: Vec<(f64, f64)> = if arg(5, 2.25) > 2.0 {
                vec![
                    (0.832, 1.217),
                    (1.219, 1.474),
                    (1.997, 2.292),
                    (2.547, 2.995),
                    (3.345, 4.134),
                    (4.034, 4.944),
                    (4.418, 5.881),
                ]
            } else {
                vec![
                    (0.849, 1.245),
                    (1.212, 1.443),
                    (1.602, 1.884),
                    (2.283, 2.689),
                    (2.950, 3.728),
                    (3.598, 4.528),
                    (3.905, 4.999),
                    (4.592, 5.841),
                    (4.961, 6.271),
                ]
            };
            let (mut t, mut k, mut sum) = (0.0_f64, 0, 0.0);
            while t < end * unit && k < data.len() {
                let dt = f.stable_step().min(data[k].0 * unit - t).max(1e-9);
                f.step(dt as f32);
                t += dt;
                if t >= data[k].0 * unit - 1e-8 {
                    let mut xs: Vec<f32> = f.positions().iter().map(|p| p.x).collect();
                    xs.sort_by(f32::total_cmp);
                    let front = xs[xs.len() - 1] + d / 2.0;
                    let bulk = xs[xs.len() - 1 - thick as usize * 3] + d / 2.0;
                    let (z, zb) = (front as f64 / a as f64, bulk as f64 / a as f64);
                    sum += (z / data[k].1 - 1.0).powi(2);
                    println!(
                        "T {:.3} Z {z:.3} bulk {zb:.3} exp {:.3} err {:+.3}",
                        data[k].0,
                        data[k].1,
                        z / data[k].1 - 1.0
                    );
                    k += 1;
                }
            }
            println!("n {} rms {:.4}", f.len(), (sum / k as f64).sqrt());
        }
        _ => {}
    }
}
