// The look of the ground (`sim/src/stage/ground.rs`).

struct Look {
    albedo: vec3f,
    slope: vec2f,
}

fn checker_integral(x: vec2f) -> vec2f {
    let f = fract(0.5 * x);
    return 2.0 * (0.5 - abs(f - 0.5));
}

// Share of the second colour of a unit checkerboard in a square of side `width`.
fn checker_share(p: vec2f, width: f32) -> f32 {
    var mean = 1.0 - 2.0 * step(vec2f(0.5), fract(0.5 * p));
    if width > 1e-4 {
        mean = (checker_integral(p + 0.5 * width) - checker_integral(p - 0.5 * width)) / width;
    }
    return 0.5 - 0.5 * mean.x * mean.y;
}

// Edges of smoothsteps may fall.
fn smooth_between(start: f32, end: f32, x: f32) -> f32 {
    let t = clamp((x - start) / (end - start), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

// Value and gradient of the noise.
fn noise_sample(p: vec2f) -> vec3f {
    let cell = floor(p);
    let f = p - cell;
    let n = u32(LATTICE);
    let i = u32(vec2i(cell).x & i32(n - 1u));
    let j = u32(vec2i(cell).y & i32(n - 1u));
    let i1 = (i + 1u) % n;
    let j1 = (j + 1u) % n;
    let a = tables[stage.noise + j * n + i];
    let b = tables[stage.noise + j * n + i1];
    let c = tables[stage.noise + j1 * n + i];
    let d = tables[stage.noise + j1 * n + i1];
    let w = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let dw = 30.0 * f * f * (f * (f - 2.0) + 1.0);
    let k = a - b - c + d;
    return vec3f(
        a + (b - a) * w.x + (c - a) * w.y + k * w.x * w.y,
        dw * vec2f(b - a + k * w.y, c - a + k * w.x),
    );
}

fn rotate2(turn: vec2f, p: vec2f) -> vec2f {
    return vec2f(turn.x * p.x - turn.y * p.y, turn.y * p.x + turn.x * p.y);
}

fn fractal(p: vec2f, footprint: f32) -> vec3f {
    var out = vec3f(0.0);
    var turn = vec2f(1.0, 0.0);
    var length = 1.6;
    var weight = 1.0;
    for (var octave = 0; octave < 10; octave++) {
        let visible = clamp(length / (2.0 * max(footprint, 1e-9)) - 1.0, 0.0, 1.0);
        if visible <= 0.0 {
            break;
        }
        let v = noise_sample(rotate2(turn, p) / length + f32(octave) * 17.31);
        let back = rotate2(vec2f(turn.x, -turn.y), v.yz);
        out += weight * visible * vec3f(0.5 * v.x, back);
        turn = rotate2(turn, vec2f(0.8, 0.6));
        length *= 0.5;
        weight *= 0.72;
    }
    return out;
}

fn ground_look(p: vec2f, slope: vec2f, above: f32, footprint: f32) -> Look {
    if stage.checker > 0.0 {
        let share = checker_share((p + stage.checker_shift) / stage.checker, footprint / stage.checker);
        return Look(mix(stage.albedo, stage.shore, share), slope);
    }
    let spacing = stage.look_spacing;
    if stage.noise == 0u {
        let wet = smooth_between(0.02 * spacing, 0.0, above);
        return Look(mix(stage.albedo, stage.shore, wet), slope);
    }
    let steepness = length(slope);
    let at = (p + stage.look_shift) / spacing;
    let detail = fractal(at, footprint / spacing);
    let roughness = (0.10 + 0.35 * min(steepness, 1.0)) * max(smooth_between(-0.1 * spacing, 0.0, above), 0.3);
    let tilted = slope + roughness * detail.yz;
    let patches = noise_sample(at / 7.0).x + 0.6 * noise_sample(at / 2.3).x;
    let height = detail.x;
    let steep = smooth_between(0.38, 0.62, steepness + 0.12 * height + 0.06 * patches);
    let tone = 1.0 + 0.30 * patches + 0.45 * height;
    let cover = stage.albedo * clamp(tone, 0.45, 1.6) * vec3f(1.0 + 0.18 * patches, 1.0, 1.0 + 0.08 * patches);
    let rock = stage.steep * clamp(1.0 + 0.5 * height, 0.5, 1.5);
    let land = mix(cover, rock, steep);
    let band = 0.05 * spacing;
    let beach = smooth_between(1.6 * band, 0.3 * band, above + band * (0.5 * height + 0.35 * patches));
    let shore = stage.shore * clamp(1.0 + 0.25 * height, 0.6, 1.3);
    let wet = smooth_between(0.35 * band, 0.0, above + 0.2 * band * height);
    let color = mix(land, shore, beach) * (1.0 - 0.45 * wet);
    return Look(clamp(color, vec3f(0.0), vec3f(1.0)), tilted);
}

// Share of the sky that the ground sees.
fn openness(p: vec2f) -> f32 {
    if stage.open == 0u {
        return 1.0;
    }
    let last = vec2f(stage.open_size - 1u);
    let g = clamp((p - stage.open_low) / stage.open_spacing, vec2f(0.0), last);
    let cell = min(vec2u(g), max(stage.open_size, vec2u(2u)) - 2u);
    let f = g - vec2f(cell);
    let k = stage.open + cell.y * stage.open_size.x + cell.x;
    let w = stage.open_size.x;
    return bilinear(vec4f(tables[k], tables[k + 1u], tables[k + w], tables[k + w + 1u]), f);
}
