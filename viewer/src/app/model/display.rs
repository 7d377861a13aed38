//! Tone mapping on the device: a picture that was drawn there is shown without ever leaving it.

use eframe::wgpu;
use meniscus_render_cpu::tonemap::ToneMap;
use meniscus_render_gpu::device::Gpu;
use meniscus_sim::glam::{Mat3, UVec2};
use std::sync::Arc;

/// Shows the pictures of one device.
#[derive(Debug)]
pub struct Display {
    gpu: Arc<Gpu>,
    pipeline: wgpu::RenderPipeline,
    uniform: wgpu::Buffer,
}

/// Values of the shader's uniform: two matrices of padded columns, the curve, the size.
const VALUES: usize = 12 + 12 + 4 + 4;

impl Display {
    /// Compiles the shader for a device.
    pub fn new(gpu: Arc<Gpu>) -> Self {
        let device = &gpu.device;
        let module = device.create_shader_module(wgpu::include_wgsl!("display.wgsl"));
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("display"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("corner"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("show"),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::TextureFormat::Rgba8Unorm.into())],
            }),
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            multiview_mask: None,
            cache: None,
        });
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("display"),
            size: 4 * VALUES as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self {
            gpu,
            pipeline,
            uniform,
        }
    }

    /// The device.
    pub fn gpu(&self) -> &Arc<Gpu> {
        &self.gpu
    }

    /// A texture of sRGB values of `picture`, which holds four `f32` of linear radiance a pixel.
    pub fn show(&self, picture: &wgpu::Buffer, size: UVec2, map: &ToneMap) -> wgpu::Texture {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        queue.write_buffer(&self.uniform, 0, &values(size, map));
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("shown"),
            size: wgpu::Extent3d {
                width: size.x,
                height: size.y,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("display"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: self.uniform.as_entire_binding(),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: picture.as_entire_binding(),
                },
            ],
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        {
            let view = texture.create_view(&Default::default());
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("display"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: None,
                timestamp_writes: None,
                occlusion_query_set: None,
                multiview_mask: None,
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.draw(0..3, 0..1);
        }
        queue.submit([encoder.finish()]);
        texture
    }
}

/// The shader's uniform.
fn values(size: UVec2, map: &ToneMap) -> Vec<u8> {
    let parts = map.parts();
    let columns = |m: Mat3| [m.x_axis, m.y_axis, m.z_axis].map(|c| [c.x, c.y, c.z, 0.0]);
    let matrices = columns(parts.into)
        .into_iter()
        .chain(columns(parts.out_of))
        .flatten();
    let curve = [parts.gain, parts.contrast, parts.half, parts.scale];
    let floats = matrices.chain(curve).flat_map(f32::to_le_bytes);
    let size = [size.x, size.y, 0, 0].into_iter().flat_map(u32::to_le_bytes);
    floats.chain(size).collect()
}
