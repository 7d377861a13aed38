//! Draws what egui lays out, without a display.

use eframe::egui::{self, TexturesDelta};
use eframe::egui_wgpu::{Renderer, RendererOptions, ScreenDescriptor};
use eframe::wgpu;
use egui_kittest::TestRenderer;
use image::RgbaImage;
use meniscus_render_gpu::device::Gpu;

const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// A device and egui's renderer on it.
pub(crate) struct Canvas {
    gpu: Gpu,
    renderer: Renderer,
}

impl Canvas {
    pub(crate) fn new() -> Self {
        let gpu = Gpu::open().unwrap();
        let renderer = Renderer::new(&gpu.device, FORMAT, RendererOptions::PREDICTABLE);
        Self { gpu, renderer }
    }
}

impl TestRenderer for Canvas {
    fn handle_delta(&mut self, delta: &mut TexturesDelta) {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        for (id, images) in delta.set.drain() {
            for image in images {
                self.renderer.update_texture(device, queue, id, &image);
            }
        }
        for id in delta.free.drain() {
            self.renderer.free_texture(&id);
        }
    }

    fn render(&mut self, ctx: &egui::Context, output: &egui::FullOutput) -> Result<RgbaImage, String> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let scale = ctx.pixels_per_point();
        let size = ctx.content_rect().size() * scale;
        let screen = ScreenDescriptor {
            pixels_per_point: scale,
            size_in_pixels: [size.x.round() as u32, size.y.round() as u32],
        };
        let [width, height] = screen.size_in_pixels;
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("canvas"),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let triangles = ctx.tessellate(output.shapes.clone(), scale);
        let mut encoder = device.create_command_encoder(&Default::default());
        let before = self
            .renderer
            .update_buffers(device, queue, &mut encoder, &triangles, &screen);
        let mut pass = encoder
            .begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("egui"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &texture.create_view(&Default::default()),
                    resolve_target: None,
                    depth_slice: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                ..Default::default()
            })
            .forget_lifetime();
        self.renderer.render(&mut pass, &triangles, &screen);
        drop(pass);
        queue.submit(before.into_iter().chain([encoder.finish()]));
        RgbaImage::from_raw(width, height, read(&self.gpu, &texture))
            .ok_or_else(|| "too few bytes".to_owned())
    }
}

/// Pixels of a texture of four bytes each, row-major from the top left.
pub(crate) fn read(gpu: &Gpu, texture: &wgpu::Texture) -> Vec<u8> {
    let size = texture.size();
    let row = 4 * size.width;
    // Rows in a buffer stand at multiples of 256 bytes.
    let pitch = row.next_multiple_of(256);
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(pitch) * u64::from(size.height),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(pitch),
                rows_per_image: None,
            },
        },
        size,
    );
    gpu.queue.submit([encoder.finish()]);
    buffer
        .slice(..)
        .map_async(wgpu::MapMode::Read, |result| result.unwrap());
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let bytes = buffer.slice(..).get_mapped_range().unwrap();
    let rows = bytes.chunks_exact(pitch as usize);
    rows.flat_map(|line| line[..row as usize].to_vec()).collect()
}
