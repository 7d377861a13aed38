// One radius a field.

fn safe_radius(f: u32, p: vec2f, from_above: bool) -> f32 {
    return stage.fields[f].safety;
}
