// A frame without foam.

fn foam_cover(p: vec2f) -> f32 {
    return 0.0;
}
