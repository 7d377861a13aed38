// A sky as an equirectangular picture with its halvings (`sim/src/stage/sky.rs`).

@group(0) @binding(3) var sky: texture_2d<f32>;

fn sky_level(uv: vec2f, level: i32) -> vec3f {
    // Not asked of the level itself: software drivers answer for one pixel of several.
    let size = max(vec2i(textureDimensions(sky, 0)) >> vec2u(u32(level)), vec2i(1));
    let x = fract(uv.x) * f32(size.x) - 0.5;
    let y = clamp(uv.y * f32(size.y) - 0.5, 0.0, f32(size.y - 1));
    let i = i32(floor(x));
    let j = i32(y);
    let i0 = (i + size.x) % size.x;
    let i1 = (i0 + 1) % size.x;
    let j1 = min(j + 1, size.y - 1);
    let f = vec2f(x - floor(x), y - f32(j));
    let a = textureLoad(sky, vec2i(i0, j), level).rgb;
    let b = textureLoad(sky, vec2i(i1, j), level).rgb;
    let c = textureLoad(sky, vec2i(i0, j1), level).rgb;
    let d = textureLoad(sky, vec2i(i1, j1), level).rgb;
    return mix(mix(a, b, f.x), mix(c, d, f.x), f.y);
}

fn sky_radiance(direction: vec3f, spread: f32) -> vec3f {
    let uv = vec2f((azimuth(direction) + stage.sky_rotation) / TAU, acos(clamp(direction.y, -1.0, 1.0)) / PI);
    let texel = PI / stage.sky_rows;
    let level = min(log2(max(2.0 * spread / texel, 1.0)), stage.sky_levels - 1.0);
    let k = i32(level);
    var value = sky_level(uv, k);
    let share = level - f32(k);
    if share > 0.0 && k + 1 < i32(stage.sky_levels) {
        value = mix(value, sky_level(uv, k + 1), share);
    }
    return stage.sky_scale * value;
}

fn sky_irradiance(normal: vec3f) -> vec3f {
    let rows = u32(NORMAL_ROWS);
    let columns = u32(NORMAL_COLUMNS);
    let y = acos(clamp(normal.y, -1.0, 1.0)) / PI * f32(rows - 1u);
    let x = fract(azimuth(normal) / TAU) * f32(columns);
    let j = min(u32(y), rows - 2u);
    let i = u32(x) % columns;
    let i1 = (i + 1u) % columns;
    let base = stage.sky_table + 3u * (j * columns);
    let a = table3(base + 3u * i);
    let b = table3(base + 3u * i1);
    let c = table3(base + 3u * (columns + i));
    let d = table3(base + 3u * (columns + i1));
    return mix(mix(a, b, fract(x)), mix(c, d, fract(x)), y - f32(j));
}
