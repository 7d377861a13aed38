//! What shaders read of the stage, laid out as WGSL lays it out. `shaders/shared/stage.wgsl` declares the same; a test
//! compares the offsets of every member.

#![allow(unsafe_code)] // The derives below: both structs are plain numbers without padding, which the derive itself proves.

use bytemuck::{Pod, Zeroable};

/// A heightfield with its continuation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs)]
pub struct FieldUniform {
    pub low: [f32; 2],
    pub high: [f32; 2],
    pub period: [f32; 2],
    pub range: [f32; 2],
    pub size: [u32; 2],
    pub periodic: [u32; 2],
    pub spacing: f32,
    pub level: f32,
    pub heights: u32,
    pub slopes: u32,
    pub pyramid: [[u32; 4]; 4],
    pub levels: u32,
    pub present: u32,
    pub safety: f32,
    pub radii: u32,
}

/// Everything else.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
#[allow(missing_docs)]
pub struct StageUniform {
    pub eye: [f32; 3],
    pub medium: u32,
    pub forward: [f32; 3],
    pub pixel_angle: f32,
    pub right: [f32; 3],
    pub hair: f32,
    pub up: [f32; 3],
    pub index: f32,
    pub size: [f32; 2],
    pub jitter: [f32; 2],
    pub sun_direction: [f32; 3],
    pub sun_radius: f32,
    pub sun_irradiance: [f32; 3],
    pub has_sun: u32,
    pub beam_direction: [f32; 3],
    pub has_beam: u32,
    pub beam_irradiance: [f32; 3],
    pub entering: f32,
    pub from_below: [f32; 3],
    pub visual_range: f32,
    pub extinction: [f32; 3],
    pub cutoff_distance: f32,
    pub scattering: [f32; 3],
    pub spread: f32,
    pub source_sun: [f32; 3],
    pub near: f32,
    pub rate_sun: [f32; 3],
    pub sky_rows: f32,
    pub source_sky: [f32; 3],
    pub sky_levels: f32,
    pub rate_sky: [f32; 3],
    pub sky_rotation: f32,
    pub sky_scale: [f32; 3],
    pub sky_table: u32,
    pub level_sky: [f32; 3],
    pub solid_count: u32,
    pub albedo: [f32; 3],
    pub checker: f32,
    pub steep: [f32; 3],
    pub look_spacing: f32,
    pub shore: [f32; 3],
    pub noise: u32,
    pub look_shift: [f32; 2],
    pub checker_shift: [f32; 2],
    pub open_low: [f32; 2],
    pub open_size: [u32; 2],
    pub open_spacing: f32,
    pub open: u32,
    pub side_count: u32,
    pub deck: f32,
    pub sides: [[f32; 4]; 4],
    pub walls: [f32; 4],
    pub glass: [f32; 4],
    pub map_low: [f32; 2],
    pub photons: [u32; 2],
    pub map_size: [u32; 2],
    pub foam_size: [u32; 2],
    pub foam_low: [f32; 2],
    pub foam_spacing: f32,
    pub spray_root: u32,
    pub sun_point: [f32; 2],
    pub sample_share: f32,
    pub map_spacing: f32,
    pub fields: [FieldUniform; 2],
}

#[cfg(test)]
#[cfg(feature = "wgpu")]
mod tests {
    use super::*;
    use std::mem::offset_of;
    use wgpu::naga;

    macro_rules! offsets {
        ($type:ty: $($member:ident),* $(,)?) => { vec![$((stringify!($member), offset_of!($type, $member))),*] };
    }

    fn declared(module: &naga::Module, name: &str) -> (Vec<(String, usize)>, usize) {
        let (_, found) = module
            .types
            .iter()
            .find(|(_, t)| t.name.as_deref() == Some(name))
            .unwrap();
        let naga::TypeInner::Struct { members, span } = &found.inner else {
            panic!("{name} is a struct");
        };
        let list = members
            .iter()
            .map(|m| (m.name.clone().unwrap(), m.offset as usize));
        (list.collect(), *span as usize)
    }

    #[test]
    fn shaders_and_rust_agree_on_every_offset() {
        let source = include_str!("shaders/shared/stage.wgsl");
        let module = naga::front::wgsl::parse_str(source).unwrap();
        let field = offsets!(FieldUniform: low, high, period, range, size, periodic, spacing, level, heights, slopes,
            pyramid, levels, present, safety, radii);
        let stage = offsets!(StageUniform: eye, medium, forward, pixel_angle, right, hair, up, index, size, jitter,
            sun_direction, sun_radius, sun_irradiance, has_sun, beam_direction, has_beam, beam_irradiance, entering,
            from_below, visual_range, extinction, cutoff_distance, scattering, spread, source_sun, near, rate_sun,
            sky_rows, source_sky, sky_levels, rate_sky, sky_rotation, sky_scale, sky_table, level_sky, solid_count,
            albedo, checker, steep, look_spacing, shore, noise, look_shift, checker_shift, open_low, open_size,
            open_spacing, open, side_count, deck, sides, walls, glass, map_low, photons, map_size, foam_size,
            foam_low, foam_spacing, spray_root, sun_point, sample_share, map_spacing, fields);
        for (name, ours, size) in [
            ("Field", field, size_of::<FieldUniform>()),
            ("Stage", stage, size_of::<StageUniform>()),
        ] {
            let (theirs, span) = declared(&module, name);
            let ours: Vec<(String, usize)> = ours.into_iter().map(|(n, o)| (n.to_owned(), o)).collect();
            assert_eq!(ours, theirs, "{name}");
            assert_eq!(size, span, "{name}");
        }
    }
}
