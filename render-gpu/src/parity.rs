//! Formulas on both kinds of processor: the shaders' optics against `sim/src/optics.rs` on one table.
#![allow(clippy::unwrap_used)] // a test may panic

use crate::device::Gpu;
use crate::executor::read_buffer;
use crate::layout::StageUniform;
use crate::pipelines::{MadeStage, Pipelines, Recipe, StageRecipe};
use crate::shader::{Piece, Switches};
use meniscus_sim::glam::{DVec2, DVec3, Vec3};
use meniscus_sim::optics;

/// Directions, a normal facing each, an index, a cosine and a distance.
fn table() -> Vec<[f32; 8]> {
    let mut rows = Vec::new();
    for a in 0..16 {
        for b in 0..16 {
            let (u, v) = ((a as f32 + 0.5) / 16.0, (b as f32 + 0.5) / 16.0);
            let angle = u * 1.55;
            let d = Vec3::new(
                angle.sin() * (6.0 * v).cos(),
                -angle.cos(),
                angle.sin() * (6.0 * v).sin(),
            );
            let eta = if (a + b) % 2 == 0 {
                optics::WATER_INDEX
            } else {
                1.0 / optics::WATER_INDEX
            };
            rows.push([d.x, d.y, d.z, eta, u, v, 12.0 * v, 0.9 * (2.0 * u - 1.0)]);
        }
    }
    rows
}

/// What a compute shader makes of `input` at binding 10: `size` bytes at binding 11.
fn computed(
    pieces: &[Piece],
    entry: &'static str,
    input: &[u8],
    groups: u32,
    size: u64,
    stage: &StageUniform,
) -> Vec<u8> {
    let gpu = Gpu::open().unwrap();
    let buffer = |bytes: u64, usage| {
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: bytes,
            usage,
            mapped_at_creation: false,
        })
    };
    use wgpu::BufferUsages as Usage;
    let given = buffer(input.len() as u64, Usage::STORAGE | Usage::COPY_DST);
    let uniform = buffer(
        size_of::<StageUniform>() as u64,
        gpu.constants_usage() | Usage::COPY_DST,
    );
    let output = buffer(size, Usage::STORAGE | Usage::COPY_SRC);
    let readable = buffer(size, Usage::MAP_READ | Usage::COPY_DST);
    gpu.queue.write_buffer(&given, 0, input);
    gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(stage));
    let mut pipelines = Pipelines::default();
    let recipe = Recipe {
        pieces: pieces.to_vec(),
        switches: Switches::default(),
        stage: StageRecipe::Compute(entry),
    };
    let made = pipelines.get(&gpu, &recipe).unwrap();
    let bound = [(0, &uniform), (10, &given), (11, &output)];
    let entries: Vec<_> = bound
        .into_iter()
        .filter(|(binding, _)| made.slots.iter().any(|s| s.binding == *binding))
        .map(|(binding, buffer)| wgpu::BindGroupEntry {
            binding,
            resource: buffer.as_entire_binding(),
        })
        .collect();
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &made.layout,
        entries: &entries,
    });
    let MadeStage::Compute(pipeline) = &made.stage else {
        panic!("a compute pipeline")
    };
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(groups, 1, 1);
    }
    encoder.copy_buffer_to_buffer(&output, 0, &readable, 0, size);
    gpu.queue.submit([encoder.finish()]);
    let bytes = read_buffer(&gpu, &readable, size).unwrap();
    assert_eq!(gpu.take_error(), None);
    bytes
}

#[test]
fn the_optics_of_shaders_are_those_of_rust() {
    let rows = table();
    let bytes = computed(
        &[Piece::Optics, Piece::Parity],
        "parity",
        bytemuck::cast_slice(&rows),
        rows.len() as u32 / 64,
        64 * rows.len() as u64,
        &StageUniform::default(),
    );
    let found: Vec<[f32; 16]> = bytes.chunks_exact(64).map(bytemuck::pod_read_unaligned).collect();
    for (row, found) in rows.iter().zip(&found) {
        let [x, y, z, eta, cos, _, distance, g] = *row;
        let d = Vec3::new(x, y, z);
        let refracted = optics::refract(d, Vec3::Y, eta).unwrap_or(Vec3::ZERO);
        let reflected = optics::reflect(d, Vec3::Y);
        let left = optics::transmittance(optics::WATER_ABSORPTION, distance);
        let expected = [
            optics::fresnel(cos, eta),
            optics::fresnel_schlick(cos, optics::reflectance_at_normal(eta)),
            optics::reflectance_at_normal(eta),
            optics::henyey_greenstein(cos, g),
            refracted.x,
            refracted.y,
            refracted.z,
            reflected.x,
            reflected.y,
            reflected.z,
            left.x,
            left.y,
            left.z,
            optics::WATER_INDEX,
            optics::linear_of_srgb(cos),
            optics::linear_of_srgb(0.03),
        ];
        for (k, (e, f)) in expected.iter().zip(found).enumerate() {
            // WGSL allows exp, sqrt and division a few units in the last place; near the critical angle the root of a
            // small difference magnifies them.
            let absorption = (10..13).contains(&k);
            let tolerance = if absorption { 1e-6 } else { 4e-6 * e.abs().max(1.0) }
                + if (4..7).contains(&k) || k == 0 {
                    2e-4 * (1.0 - e.abs()).abs().min(0.05)
                } else {
                    0.0
                };
            assert!((e - f).abs() <= tolerance, "value {k} of {row:?}: {e} {f}");
        }
    }
}

/// The gate on level water through which light from `p` reaches `eye`, by Fermat's principle and bisection in double precision: its
/// distance from the eye's foot, and the length of the path.
fn gate(eye: DVec3, p: DVec3, index: f64) -> (f64, f64) {
    let d = DVec2::new(p.x - eye.x, p.z - eye.z).length();
    let (a, b) = (eye.y.abs(), p.y.abs());
    let i = if eye.y < 0.0 { 1.0 / index } else { index };
    let (mut low, mut high) = (0.0, d);
    for _ in 0..200 {
        let x = 0.5 * (low + high);
        if x / a.hypot(x) < i * (d - x) / b.hypot(d - x) {
            low = x;
        } else {
            high = x;
        }
    }
    (low, a.hypot(low) + b.hypot(d - low))
}

/// The broad phase at its vertices, on level water: floor, walls and what stands above, from both sides, at 1280 × 720 pixels and
/// 52° of view.
#[test]
fn the_broad_phase_is_exact_at_vertices() {
    let pixel = 2.0 * 26_f64.to_radians().tan() / 720.0;
    let index = f64::from(optics::WATER_INDEX);
    for eye in [
        DVec3::new(-2.5, 1.7, 3.2),
        DVec3::new(0.3, 0.05, -0.2),
        DVec3::new(-2.4, -0.9, 1.4),
        DVec3::new(1.0, -0.02, 0.0),
    ] {
        let other = -eye.y.signum();
        let mut points = Vec::new();
        for k in 0..64 * 64 {
            let (u, v) = (f64::from(k % 64) / 63.0, f64::from(k / 64) / 63.0);
            let across = [6.0 * u - 3.0, 4.0 * v - 2.0];
            // A level sheet at three heights, one just beyond the water, and a wall.
            for y in [1e-4, 0.2, 1.5] {
                points.push(DVec3::new(across[0], other * y, across[1]));
            }
            points.push(DVec3::new(3.0, other * (1.5 * v).max(1e-4), 4.0 * u - 2.0));
        }
        let stage = StageUniform {
            eye: eye.as_vec3().to_array(),
            index: optics::WATER_INDEX,
            ..StageUniform::default()
        };
        let rows: Vec<[f32; 4]> = points
            .iter()
            .map(|p| p.as_vec3().extend(0.0).to_array())
            .collect();
        let bytes = computed(
            &[Piece::Stage, Piece::Apparent, Piece::ParityApparent],
            "parity_apparent",
            bytemuck::cast_slice(&rows),
            rows.len() as u32 / 64,
            16 * rows.len() as u64,
            &stage,
        );
        let found: Vec<[f32; 4]> = bytes.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect();
        let (mut worst, mut longest, mut steepest) = (0.0_f64, 0.0_f64, 0.0_f64);
        for (row, f) in rows.iter().zip(&found) {
            let p = Vec3::new(row[0], row[1], row[2]).as_dvec3();
            let eye = eye.as_vec3().as_dvec3();
            let (x, path) = gate(eye, p, index);
            let across = DVec2::new(p.x - eye.x, p.z - eye.z).normalize_or_zero();
            let truth = DVec3::new(x * across.x, -eye.y, x * across.y).normalize();
            let theirs = Vec3::new(f[0], f[1], f[2]).as_dvec3() - eye;
            worst = worst.max(theirs.normalize().distance(truth) / pixel);
            longest = longest.max((theirs.length() / path - 1.0).abs());
            let sin = DVec2::new(theirs.x, theirs.z).length() / theirs.length();
            steepest = steepest.max(if eye.y < 0.0 { sin * index } else { sin });
        }
        println!("eye {eye}: {worst} px, path {longest}, sin θ n {steepest}");
        assert!(worst <= 0.01 && longest <= 1e-5, "{eye}: {worst} {longest}");
        // From below nothing lies beyond the rim of Snell's window, but for rounding.
        assert!(steepest <= 1.0 + 1e-6, "{eye}: {steepest}");
    }
}
