//! Materials of a model: base colours, and the pictures that they name.

use super::accessors::Accessors;
use super::{Kind, MAX_BYTES, buffers};
use crate::mesh::DEFAULT_COLOR;
use crate::mesh::texture::{Material, Shine, Texture, Wrap};
use glam::{UVec2, Vec3};
use gltf::texture::WrappingMode;
use image::ImageReader;
use std::io::Cursor;
use std::path::Path;

/// Largest side of a texture in texels.
const MAX_SIDE: u32 = 16_384;
/// Most bytes that decoding one may take.
const MAX_DECODED: u64 = 1 << 30;

/// The material of a primitive.
pub(super) fn material(
    material: &gltf::Material<'_>,
    data: &Accessors,
    base: Option<&Path>,
) -> Result<Material, Kind> {
    let look = material.pbr_metallic_roughness();
    let [r, g, b, _] = look.base_color_factor();
    let color = Vec3::new(r, g, b);
    let given = material.index().is_some() && color.is_finite();
    let color = if given {
        color.clamp(Vec3::ZERO, Vec3::ONE)
    } else {
        DEFAULT_COLOR
    };
    let texture = look
        .base_color_texture()
        .map(|info| texture(&info.texture(), data, base))
        .transpose()?;
    // Rough, which is also what a material that says nothing is, counts as matt.
    let (roughness, metallic) = (look.roughness_factor(), look.metallic_factor());
    let shine = (given && (0.0..1.0).contains(&roughness)).then_some(Shine {
        roughness,
        metallic: if metallic.is_finite() {
            metallic.clamp(0.0, 1.0)
        } else {
            0.0
        },
    });
    Ok(Material {
        color,
        texture,
        shine,
    })
}

fn texture(texture: &gltf::Texture<'_>, data: &Accessors, base: Option<&Path>) -> Result<Texture, Kind> {
    let source = texture.source();
    let index = source.index();
    let fail = |reason: String| Kind::Texture { index, reason };
    let read;
    let bytes: &[u8] = match source.source() {
        gltf::image::Source::View { view, .. } => data
            .view(&view)
            .ok_or_else(|| fail("it reaches beyond its buffer".into()))?,
        gltf::image::Source::Uri { uri, .. } => {
            read = buffers::of_uri(uri, base, MAX_BYTES).map_err(fail)?;
            &read
        }
    };
    let decode = |e: &dyn std::fmt::Display| {
        let reason: String = e.to_string().chars().take(200).collect();
        fail(format!("it cannot be decoded: {reason}"))
    };
    let format = image::guess_format(bytes).map_err(|e| decode(&e))?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_DECODED);
    reader.limits(limits);
    let picture = reader.decode().map_err(|e| decode(&e))?.into_rgb8();
    let sampler = texture.sampler();
    let wrap = |mode| match mode {
        WrappingMode::Repeat => Wrap::Repeat,
        WrappingMode::MirroredRepeat => Wrap::Mirror,
        WrappingMode::ClampToEdge => Wrap::Clamp,
    };
    Ok(Texture {
        size: UVec2::new(picture.width(), picture.height()),
        texels: picture.pixels().map(|p| p.0).collect(),
        wrap: [wrap(sampler.wrap_s()), wrap(sampler.wrap_t())],
    })
}
