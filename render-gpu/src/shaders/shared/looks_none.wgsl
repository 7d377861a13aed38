// Models of one colour: a triangle is its six rows.

const TRIANGLE_ROWS: u32 = 6u;

fn hit_color(record: u32, triangle: u32, weights: vec2f) -> vec3f {
    return record_color(record);
}
