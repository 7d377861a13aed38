// Foam on the water; beyond the grid it fades within eight samples.

@group(0) @binding(6) var<storage, read> foam: array<f32>;

fn foam_cover(p: vec2f) -> f32 {
    let size = stage.foam_size;
    let last = vec2f(size - 1u);
    let q = (p - stage.foam_low) / stage.foam_spacing;
    let out = max(-q, q - last);
    let g = clamp(q, vec2f(0.0), last);
    let cell = min(vec2u(g), max(size, vec2u(2u)) - 2u);
    let k = cell.y * size.x + cell.x;
    let c = vec4f(foam[k], foam[k + 1u], foam[k + size.x], foam[k + size.x + 1u]);
    return clamp(bilinear(c, g - vec2f(cell)), 0.0, 1.0) * clamp(1.0 - max(out.x, out.y) / 8.0, 0.0, 1.0);
}
