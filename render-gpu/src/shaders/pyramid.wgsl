// One level of the minimum-maximum pyramid: bounds of 2^level × 2^level patches, from the level below or the samples.

struct Which {
    field: u32,
    level: u32,
    unused0: u32,
    unused1: u32,
}

@group(0) @binding(10) var<uniform> which: Which;
@group(0) @binding(11) var<storage, read_write> fields: array<f32>;

fn level_offset(f: u32, level: u32) -> u32 {
    return stage.fields[f].pyramid[(level - 1u) / 4u][(level - 1u) % 4u];
}

@compute @workgroup_size(8, 8)
fn pyramid(@builtin(global_invocation_id) at: vec3u) {
    let f = which.field;
    let level = which.level;
    let size = stage.fields[f].size;
    let cells = size - 1u;
    let blocks = (cells + (1u << level) - 1u) >> vec2u(level);
    if any(at.xy >= blocks) {
        return;
    }
    var low = FAR;
    var high = -FAR;
    if level == 1u {
        // Two by two patches have three by three samples.
        for (var b = 0u; b < 3u; b++) {
            for (var a = 0u; a < 3u; a++) {
                let s = min(2u * at.xy + vec2u(a, b), cells);
                let h = fields[stage.fields[f].heights + s.y * size.x + s.x];
                low = min(low, h);
                high = max(high, h);
            }
        }
    } else {
        let below = (cells + (1u << (level - 1u)) - 1u) >> vec2u(level - 1u);
        let offset = level_offset(f, level - 1u);
        for (var b = 0u; b < 2u; b++) {
            for (var a = 0u; a < 2u; a++) {
                let s = min(2u * at.xy + vec2u(a, b), below - 1u);
                let k = offset + 2u * (s.y * below.x + s.x);
                low = min(low, fields[k]);
                high = max(high, fields[k + 1u]);
            }
        }
    }
    let k = level_offset(f, level) + 2u * (at.y * blocks.x + at.x);
    fields[k] = low;
    fields[k + 1u] = high;
}
