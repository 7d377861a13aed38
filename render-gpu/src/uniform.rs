//! The numbers of scene and view, as shaders read them.

use crate::facts::Facts;
use crate::fixed::Fixed;
use crate::layout::StageUniform;
use crate::settings::Settings;
use meniscus_sim::Scene;
use meniscus_sim::glam::{DVec2, DVec3, Vec3};
use meniscus_sim::render::View;
use meniscus_sim::stage::Lens;

/// Distance of the plane at which reversed depth is one, in sizes of the scene.
pub(crate) const NEAR: f64 = 1e-4;

/// Everything that does not depend on the frame's water.
pub(crate) fn uniform(
    scene: &Scene,
    fixed: &Fixed,
    facts: &Facts,
    lens: &Lens,
    view: &View,
    settings: &Settings,
) -> StageUniform {
    let (light, volume, look, anchor) = (&fixed.light, &fixed.volume, &fixed.look, fixed.anchor);
    let parts = light.sky.parts();
    let three = |v: DVec3| v.as_vec3().to_array();
    let sun = light.sun;
    let beam = light.beam;
    let plan = DVec2::new(anchor.x, anchor.z);
    let checker = look.checker;
    let shift = if checker > 0.0 {
        (plan / (2.0 * checker) - (plan / (2.0 * checker)).floor()) * 2.0 * checker
    } else {
        DVec2::ZERO
    };
    let least = volume.extinction.min_element();
    let cutoff = settings.absorption_cutoff;
    StageUniform {
        eye: three(lens.eye - anchor),
        forward: three(lens.forward),
        pixel_angle: lens.pixel_angle as f32,
        right: three(lens.right),
        up: three(lens.up),
        index: scene.description.water.index,
        size: view.size.as_vec2().to_array(),
        jitter: [0.5, 0.5],
        sun_direction: sun.map_or([0.0, 1.0, 0.0], |s| s.direction.to_array()),
        sun_radius: sun.map_or(0.0, |s| s.radius),
        sun_irradiance: sun.map_or([0.0; 3], |s| s.irradiance.to_array()),
        has_sun: u32::from(sun.is_some()),
        beam_direction: beam.map_or([0.0, 1.0, 0.0], |b| b.direction.to_array()),
        has_beam: u32::from(beam.is_some()),
        beam_irradiance: beam.map_or([0.0; 3], |b| b.irradiance.to_array()),
        entering: light.entering,
        from_below: light.from_below.to_array(),
        visual_range: settings.visual_range.unwrap_or(0.0),
        extinction: volume.extinction.to_array(),
        // Baboud & Décoret's (6), −ln ε over the least extinction.
        cutoff_distance: if cutoff > 0.0 && least > 0.0 {
            -cutoff.min(1.0).ln() / least
        } else {
            1e30
        },
        scattering: volume.scattering().to_array(),
        spread: (0.5 * lens.pixel_angle / f64::from(view.samples).sqrt()) as f32,
        source_sun: volume.sources[0].0.to_array(),
        near: (NEAR * fixed.scale) as f32,
        rate_sun: volume.sources[0].1.to_array(),
        sky_rows: parts.levels.first().map_or(1.0, |l| l.height as f32),
        source_sky: volume.sources[1].0.to_array(),
        sky_levels: parts.levels.len() as f32,
        rate_sky: volume.sources[1].1.to_array(),
        sky_rotation: parts.rotation,
        sky_scale: parts.scale.to_array(),
        sky_table: fixed.table_irradiance,
        level_sky: (light.entering * light.sky.irradiance(Vec3::Y)).to_array(),
        albedo: look.albedo.to_array(),
        checker: checker as f32,
        steep: look.steep.to_array(),
        look_spacing: look.spacing as f32,
        shore: look.shore.to_array(),
        noise: if facts.noise { fixed.table_noise } else { 0 },
        look_shift: plan.as_vec2().to_array(),
        checker_shift: shift.as_vec2().to_array(),
        open_low: fixed
            .open
            .map_or([0.0; 2], |s| (s.origin.as_dvec2() - plan).as_vec2().to_array()),
        open_size: fixed.open.map_or([0; 2], |s| s.size.to_array()),
        open_spacing: fixed.open.map_or(1.0, |s| s.spacing),
        open: fixed.table_open,
        sample_share: 1.0,
        ..StageUniform::default()
    }
}
