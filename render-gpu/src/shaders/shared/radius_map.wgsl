// A radius a texel, above and below the surface (`radii.wgsl`), in samples.

fn safe_radius(f: u32, p: vec2f, from_above: bool) -> f32 {
    let last = vec2f(stage.fields[f].size - 1u);
    let at = vec2u(clamp((p - stage.fields[f].low) / stage.fields[f].spacing + 0.5, vec2f(0.0), last));
    let radii = pair_at(stage.fields[f].radii, at.y * stage.fields[f].size.x + at.x);
    return select(radii.y, radii.x, from_above) * stage.fields[f].spacing * stage.fields[f].safety;
}
