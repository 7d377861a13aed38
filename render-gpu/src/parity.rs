//! Formulas on both kinds of processor: the shaders' optics against `sim/src/optics.rs` on one table.

use crate::device::Gpu;
use crate::executor::read_buffer;
use crate::pipelines::{MadeStage, Pipelines, Recipe, StageRecipe};
use crate::shader::{Piece, Switches};
use meniscus_sim::glam::Vec3;
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

#[test]
fn the_optics_of_shaders_are_those_of_rust() {
    let gpu = Gpu::open().unwrap();
    let rows = table();
    let buffer = |bytes: u64, usage| {
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: bytes,
            usage,
            mapped_at_creation: false,
        })
    };
    let input = buffer(
        32 * rows.len() as u64,
        wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
    );
    let size = 64 * rows.len() as u64;
    let output = buffer(size, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let readable = buffer(size, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
    gpu.queue.write_buffer(&input, 0, bytemuck::cast_slice(&rows));
    let mut pipelines = Pipelines::default();
    let recipe = Recipe {
        pieces: vec![Piece::Optics, Piece::Parity],
        switches: Switches::default(),
        stage: StageRecipe::Compute("parity"),
    };
    let made = pipelines.get(&gpu, &recipe).unwrap();
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &made.layout,
        entries: &[
            wgpu::BindGroupEntry {
                binding: 10,
                resource: input.as_entire_binding(),
            },
            wgpu::BindGroupEntry {
                binding: 11,
                resource: output.as_entire_binding(),
            },
        ],
    });
    let MadeStage::Compute(pipeline) = &made.stage else {
        panic!("a compute pipeline")
    };
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(rows.len() as u32 / 64, 1, 1);
    }
    encoder.copy_buffer_to_buffer(&output, 0, &readable, 0, size);
    gpu.queue.submit([encoder.finish()]);
    let bytes = read_buffer(&gpu, &readable, size).unwrap();
    assert_eq!(gpu.take_error(), None);
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
        ];
        for (k, (e, f)) in expected.iter().zip(found).enumerate() {
            // WGSL allows exp, sqrt and division a few units in the last place; near the critical angle the root of a
            // small difference magnifies them.
            let tolerance = 4e-6 * e.abs().max(1.0)
                + if (4..7).contains(&k) || k == 0 {
                    2e-4 * (1.0 - e.abs()).abs().min(0.05)
                } else {
                    0.0
                };
            assert!((e - f).abs() <= tolerance, "value {k} of {row:?}: {e} {f}");
        }
    }
}
