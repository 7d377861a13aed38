// Liu, Han & Fei 2020, table 1, mended: where a point on the other side of flat water seems to stand, at the length of
// the refracted path along the ray that leaves the eye for it. The horizontal direction is towards the point, and the eye is added.

// Within 0.003 pixels of 1280 × 720 from either side.
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
    var low = 0.0;
    var high = d;
    if i < 1.0 {
        // Under water: no light comes through the surface from beyond the critical angle, nor farther back from the point than
        // at the angle of the straight line. Without these bounds points close to the surface are off by five times as much.
        let sine = d / sqrt(a * a + d * d) / i;
        high = min(d, a * i / sqrt(1.0 - i * i));
        if sine < 1.0 {
            low = clamp(d - b * sine / sqrt(1.0 - sine * sine), 0.0, high);
        }
    }
    var x = clamp(a / (a + b / i) * d, low, high);
    for (var n = 0; n < NEWTON_STEPS; n++) {
        let near = sqrt(a * a + x * x);
        let far = sqrt(b * b + (d - x) * (d - x));
        let f = x / near - i * (d - x) / far;
        let slope = a * a / (near * near * near) + i * b * b / (far * far * far);
        x = clamp(x - f / slope, low, high);
    }
    let path = sqrt(a * a + x * x) + sqrt(b * b + (d - x) * (d - x));
    let gate = vec3f(stage.eye.x + x * across.x / d, level, stage.eye.z + x * across.y / d);
    return stage.eye + normalize(gate - stage.eye) * path;
}
