// What stands in the medium of the eye.

@vertex
fn near_vertex(@builtin(vertex_index) k: u32) -> Corner {
    let v = vertex_of(k);
    return corner_at(project(v.position), v);
}

@fragment
fn near(in: Corner) -> @location(0) vec4f {
    let face = cross(dpdx(in.position), dpdy(in.position));
    let in_air = stage.medium == AIR;
    // Samples of one pixel lie on both sides of the waterline: a pixel more is drawn, which the water then covers.
    let margin = select(0.0, fwidth(in.position.y), MULTISAMPLED) * select(-1.0, 1.0, in_air);
    let p = fragment_place(in.position);
    if is_in_water(p + vec3f(0.0, margin, 0.0)) == in_air {
        discard;
    }
    let to = p - stage.eye;
    let distance = length(to);
    let d = to / distance;
    let width = stage.spread * distance;
    let matt = fragment_matt(p, in.normal, corner_color(in), normalize(face), d, width, stage.medium);
    var radiance = lit(matt);
    if in_air {
        let left = air_transmittance(distance);
        radiance = radiance * left + haze(d) * (1.0 - left);
    } else if ABSORPTION {
        radiance = radiance * transmittance(stage.extinction, distance)
            + scattered(depth_below(stage.eye), -d.y, distance);
    }
    return target_value(radiance);
}
