// What stands in the medium of the eye.

@vertex
fn near_vertex(@builtin(vertex_index) k: u32) -> Corner {
    let v = vertex_of(k);
    return Corner(project(v.position), v.position, v.normal, v.color);
}

@fragment
fn near(in: Corner) -> @location(0) vec4f {
    let face = cross(dpdx(in.position), dpdy(in.position));
    let in_air = stage.medium == AIR;
    if is_in_water(in.position) == in_air {
        discard;
    }
    let to = in.position - stage.eye;
    let distance = length(to);
    let d = to / distance;
    let width = stage.spread * distance;
    let matt = fragment_matt(in.position, in.normal, in.color, normalize(face), d, width, stage.medium);
    var radiance = lit(matt);
    if in_air {
        let left = air_transmittance(distance);
        radiance = radiance * left + haze(d) * (1.0 - left);
    } else if ABSORPTION {
        radiance = radiance * transmittance(stage.extinction, distance)
            + scattered(depth_below(stage.eye), -d.y, distance);
    }
    return vec4f(radiance, 1.0);
}
