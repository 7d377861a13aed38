//! Brings a frame to the device; what is there already stays.

use crate::buffers::Buffers;
use crate::device::Gpu;
use crate::executor::{Globals, Physical};
use crate::facts::FieldShape;
use crate::fixed::Fixed;
use crate::layout::StageUniform;
use crate::set::Set;
use crate::settings::Walk;
use crate::techniques::names;
use crate::voxel_scene::VoxelPlan;
use meniscus_sim::Frame;

/// The data of scene and frame on the device.
#[derive(Debug, Default)]
pub(crate) struct Uploaded {
    pub(crate) buffers: Buffers,
    sky: Option<(wgpu::Texture, wgpu::TextureView)>,
    /// How the ground that is there was kept.
    ground: Option<(FieldShape, Walk)>,
    voxels: Option<VoxelPlan>,
    /// Voxel fields built so far.
    pub(crate) voxel_fields: u64,
    /// Photon map of the last frame, texels.
    pub(crate) map_size: Option<[u32; 2]>,
}

impl Uploaded {
    /// What shaders bind by name; whether the ground was brought anew.
    pub(crate) fn bring(
        &mut self,
        gpu: &Gpu,
        fixed: &Fixed,
        set: &Set,
        frame: &Frame,
        walk: Walk,
        new_scene: bool,
    ) -> (Globals, bool) {
        use wgpu::BufferUsages as Usage;
        let mut globals = Globals::new();
        let facts = &set.facts;
        let storage = Usage::STORAGE;
        let buffers = &mut self.buffers;
        let size = size_of::<StageUniform>() as u64;
        let (uniform, _) = buffers.fit(gpu, "stage", size, gpu.constants_usage());
        globals.insert("stage", Physical::Buffer(uniform));
        let (heights, new_heights) = buffers.fit(gpu, names::HEIGHTS, 4 * facts.height_words(), storage);
        let put = |shape: &FieldShape, words: &[u32]| {
            gpu.queue.write_buffer(
                &heights,
                4 * u64::from(shape.heights),
                bytemuck::cast_slice(words),
            );
        };
        let kept = (facts.fields[1], walk);
        let new_ground = new_scene || new_heights || self.ground != Some(kept);
        if let Some(ground) = fixed.ground.as_ref().filter(|_| new_ground) {
            put(&kept.0, &ground.words(kept.0.kept));
        }
        self.ground = Some(kept);
        put(&facts.fields[0], &set.water.words(facts.fields[0].kept));
        // The passes that add slopes and pyramids know the same buffer by another name.
        globals.insert("fields", Physical::Buffer(heights.clone()));
        globals.insert(names::HEIGHTS, Physical::Buffer(heights));
        let (tables, new_tables) = buffers.fit(gpu, names::TABLES, 4 * fixed.tables.len() as u64, storage);
        if new_scene || new_tables {
            gpu.queue
                .write_buffer(&tables, 0, bytemuck::cast_slice(&fixed.tables));
        }
        globals.insert(names::TABLES, Physical::Buffer(tables));
        if facts.objects > 0 {
            let rows = (set.records.len() + fixed.models.len()).max(1);
            // Records of objects that are left out leave room before the models, whose rows are counted from all of them.
            let base = 6 * u64::from(facts.objects);
            let (solids, new) = buffers.fit(gpu, names::SOLIDS, 16 * (base + rows as u64), storage);
            gpu.queue
                .write_buffer(&solids, 0, bytemuck::cast_slice(&set.records));
            if (new_scene || new) && !fixed.models.is_empty() {
                gpu.queue
                    .write_buffer(&solids, 16 * base, bytemuck::cast_slice(&fixed.models));
            }
            globals.insert(names::SOLIDS, Physical::Buffer(solids));
        }
        let mut bring = |name, bytes: &[u8]| {
            let buffer = buffers.write(gpu, name, bytes, storage);
            globals.insert(name, Physical::Buffer(buffer));
        };
        if let Some(rows) = &set.spray {
            bring("spray", bytemuck::cast_slice(rows));
        }
        if let Some(foam) = frame.foam.as_ref().filter(|_| facts.foam > 0) {
            bring("foam", bytemuck::cast_slice(foam.as_slice()));
        }
        if !set.meshes.is_empty() {
            bring(names::MESHES, bytemuck::cast_slice(&set.meshes));
        }
        if let Some(layer) = &set.foreign {
            bring(names::FOREIGN, bytemuck::cast_slice(layer));
        }
        self.map_size = facts.caustics.map(|sizes| sizes.map);
        let pixels = u64::from(facts.size[0]) * u64::from(facts.size[1]);
        let texels = self
            .map_size
            .map(|[x, z]| (names::MAP, 4 * u64::from(x) * u64::from(z)));
        let made = [(names::MISSING, 16), (names::PICTURE, 16 * pixels)];
        for (name, bytes) in made.into_iter().chain(texels) {
            let (buffer, _) = buffers.fit(gpu, name, bytes, storage | Usage::COPY_SRC);
            globals.insert(name, Physical::Buffer(buffer));
        }
        if facts.sky.is_some() {
            if new_scene {
                self.sky = None;
            }
            let (_, view) = self.sky.get_or_insert_with(|| sky_texture(gpu, fixed));
            globals.insert(names::SKY, Physical::Texture(view.clone()));
        }
        if let Some(plan) = &set.voxels {
            self.bring_voxels(gpu, fixed, plan, &mut globals);
        }
        (globals, new_ground)
    }

    /// The voxel field, built again only if something that it shows has moved.
    fn bring_voxels(&mut self, gpu: &Gpu, fixed: &Fixed, plan: &VoxelPlan, globals: &mut Globals) {
        use wgpu::BufferUsages as Usage;
        const PLACE: &str = "voxel_box";
        if self.voxels.as_ref() != Some(plan) {
            let field = plan.build(fixed);
            let values = bytemuck::cast_slice(&field.values);
            self.buffers.write(gpu, names::VOXELS, values, Usage::STORAGE);
            self.buffers.write(
                gpu,
                PLACE,
                bytemuck::bytes_of(&field.place),
                gpu.constants_usage(),
            );
            self.voxels = Some(plan.clone());
            self.voxel_fields += 1;
        }
        for name in [names::VOXELS, PLACE] {
            if let Some(buffer) = self.buffers.get(name) {
                globals.insert(name, Physical::Buffer(buffer.clone()));
            }
        }
    }
}

/// The sky's picture and its halvings in half precision.
fn sky_texture(gpu: &Gpu, fixed: &Fixed) -> (wgpu::Texture, wgpu::TextureView) {
    let levels = fixed.light.sky.parts().levels;
    let (width, height) = levels
        .first()
        .map_or((1, 1), |l| (l.width as u32, l.height as u32));
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("sky"),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: levels.len().max(1) as u32,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    for (k, level) in levels.iter().enumerate() {
        let texels: Vec<[half::f16; 4]> = level
            .pixels
            .iter()
            .map(|p| [p.x, p.y, p.z, 1.0].map(half::f16::from_f32))
            .collect();
        let bits: Vec<u16> = texels.iter().flatten().map(|v| v.to_bits()).collect();
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                mip_level: k as u32,
                ..texture.as_image_copy()
            },
            bytemuck::cast_slice(&bits),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(8 * level.width as u32),
                rows_per_image: None,
            },
            wgpu::Extent3d {
                width: level.width as u32,
                height: level.height as u32,
                depth_or_array_layers: 1,
            },
        );
    }
    let view = texture.create_view(&Default::default());
    (texture, view)
}
