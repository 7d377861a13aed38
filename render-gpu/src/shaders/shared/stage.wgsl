// What every pass may ask about the frame. Lengths are metres; positions are relative to an anchor near the water, so
// that single precision suffices. Laid out as `layout.rs` says; a test compares the offsets.

const AIR: u32 = 0u;
const WATER: u32 = 1u;
const FAR: f32 = 1e30;
const WATER_FIELD: u32 = 0u;
const GROUND_FIELD: u32 = 1u;

// A heightfield with its continuation; the offsets count words of `heights` (`shared/store_*.wgsl`).
struct Field {
    low: vec2f,
    high: vec2f,
    period: vec2f,
    range: vec2f,
    size: vec2u,
    periodic: vec2u,
    spacing: f32,
    level: f32,
    heights: u32,
    slopes: u32,
    pyramid: array<vec4u, 4>,
    levels: u32,
    present: u32,
    safety: f32,
    radii: u32,
}

struct Stage {
    eye: vec3f,
    medium: u32,
    forward: vec3f,
    pixel_angle: f32,
    right: vec3f,
    hair: f32,
    up: vec3f,
    index: f32,
    size: vec2f,
    jitter: vec2f,
    sun_direction: vec3f,
    sun_radius: f32,
    sun_irradiance: vec3f,
    has_sun: u32,
    beam_direction: vec3f,
    has_beam: u32,
    beam_irradiance: vec3f,
    entering: f32,
    from_below: vec3f,
    visual_range: f32,
    extinction: vec3f,
    cutoff_distance: f32,
    scattering: vec3f,
    spread: f32,
    source_sun: vec3f,
    near: f32,
    rate_sun: vec3f,
    sky_rows: f32,
    source_sky: vec3f,
    sky_levels: f32,
    rate_sky: vec3f,
    sky_rotation: f32,
    sky_scale: vec3f,
    sky_table: u32,
    level_sky: vec3f,
    solid_count: u32,
    albedo: vec3f,
    checker: f32,
    steep: vec3f,
    look_spacing: f32,
    shore: vec3f,
    noise: u32,
    look_shift: vec2f,
    checker_shift: vec2f,
    open_low: vec2f,
    open_size: vec2u,
    open_spacing: f32,
    open: u32,
    side_count: u32,
    deck: f32,
    sides: array<vec4f, 4>,
    // What walls, and what glass sides leave between them: lowest x and z, highest x and z.
    walls: vec4f,
    glass: vec4f,
    map_low: vec2f,
    photons: vec2u,
    map_size: vec2u,
    foam_size: vec2u,
    foam_low: vec2f,
    foam_spacing: f32,
    spray_root: u32,
    sun_point: vec2f,
    sample_share: f32,
    map_spacing: f32,
    fields: array<Field, 2>,
}

@group(0) @binding(0) var<uniform> stage: Stage;
// Irradiance by normal, haze by azimuth, noise, openness of the ground.
@group(0) @binding(2) var<storage, read> tables: array<f32>;

fn table3(k: u32) -> vec3f {
    return vec3f(tables[k], tables[k + 1u], tables[k + 2u]);
}

// Unit direction through a point of the picture, pixels from the top left.
fn view_direction(at: vec2f) -> vec3f {
    let u = 2.0 * at.x / stage.size.x - 1.0;
    let v = 1.0 - 2.0 * at.y / stage.size.y;
    return normalize(stage.forward + u * stage.right + v * stage.up);
}

// Clip coordinates with infinite reversed depth: near / distance.
fn project(p: vec3f) -> vec4f {
    let q = p - stage.eye;
    let x = dot(q, stage.right) / dot(stage.right, stage.right);
    let y = dot(q, stage.up) / dot(stage.up, stage.up);
    let w = dot(q, stage.forward);
    // The samples of a pixel move the picture against its pixels.
    let shift = vec2f(-2.0, 2.0) * (stage.jitter - 0.5) / stage.size;
    return vec4f(x + shift.x * w, y + shift.y * w, stage.near, w);
}

// Place in the picture, pixels from the top left, of a point in front of the eye.
fn to_picture(p: vec3f) -> vec2f {
    let c = project(p);
    return vec2f(0.5 + 0.5 * c.x / c.w, 0.5 - 0.5 * c.y / c.w) * stage.size;
}

fn depth_of(p: vec3f) -> f32 {
    return stage.near / max(dot(p - stage.eye, stage.forward), stage.near);
}
