// Liu, Han & Fei 2020, table 1, mended: where a point on the other side of flat water seems to stand, at the length of
// the refracted path along the ray that leaves the eye for it. The horizontal direction is towards the point, and the eye is added.

const NEWTON_STEPS: i32 = 8;

fn apparent(p: vec3f) -> vec3f {
    let level = stage.fields[WATER_FIELD].level;
    let a = abs(stage.eye.y - level);
    let b = abs(p.y - level);
    let same_side = (p.y - level) * (stage.eye.y - level) >= 0.0;
    let across = p.xz - stage.eye.xz;
    let d = length(across);
    if same_side || b < 1e-9 || a < 1e-9 || d < 1e-9 {
        if same_side || b < 1e-9 || a < 1e-9 {
            return p;
        }
        return vec3f(p.x, stage.eye.y - sign(stage.eye.y - level) * (a + b), p.z);
    }
    // sin of the ray in the eye's medium is i times that beyond.
    let i = select(stage.index, 1.0 / stage.index, stage.eye.y < level);
    var x = a / (a + b / i) * d;
    for (var n = 0; n < NEWTON_STEPS; n++) {
        let near = sqrt(a * a + x * x);
        let far = sqrt(b * b + (d - x) * (d - x));
        let f = x / near - i * (d - x) / far;
        let slope = a * a / (near * near * near) + i * b * b / (far * far * far);
        x = clamp(x - f / slope, 0.0, d);
    }
    let path = sqrt(a * a + x * x) + sqrt(b * b + (d - x) * (d - x));
    let gate = vec3f(stage.eye.x + x * across.x / d, level, stage.eye.z + x * across.y / d);
    return stage.eye + normalize(gate - stage.eye) * path;
}
