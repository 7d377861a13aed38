// One level of the minimum-maximum pyramid: bounds of 2^level × 2^level patches, from the level below or the samples.

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
                let h = stored(f, s.x, s.y);
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
                let bounds = stored_bounds(f, offset, s.y * below.x + s.x);
                low = min(low, bounds.x);
                high = max(high, bounds.y);
            }
        }
    }
    keep_bounds(f, level_offset(f, level), at.y * blocks.x + at.x, vec2f(low, high));
}
