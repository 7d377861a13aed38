// What stands beyond the surface, where refraction by flat water shows it (BROAD) or where it is: light before the way to
// the eye, true place and normal.

struct Beyond {
    @location(0) radiance: vec4f,
    @location(1) place: vec4f,
    @location(2) normal: vec4f,
}

@vertex
fn far_vertex(@builtin(vertex_index) k: u32) -> Corner {
    let v = vertex_of(k);
    var p = v.position;
    if BROAD {
        p = apparent(p);
    }
    return corner_at(project(p), v);
}

@fragment
fn far(in: Corner) -> Beyond {
    let face = cross(dpdx(in.position), dpdy(in.position));
    let in_air = stage.medium == AIR;
    let p = fragment_place(in.position);
    let surface = field_height(WATER_FIELD, p.xz);
    let level = stage.fields[WATER_FIELD].level;
    // A little is kept beyond the waterline, where waves may look.
    let kept = select(p.y > min(surface, level) - stage.hair, p.y < max(surface, level) + stage.hair, in_air);
    if !kept {
        discard;
    }
    let to = p - stage.eye;
    let distance = length(to);
    let medium = select(AIR, WATER, in_air);
    var matt = fragment_matt(p, in.normal, corner_color(in), normalize(face), to / distance, stage.spread * distance, medium);
    return Beyond(vec4f(lit(matt), 1.0), vec4f(p, 1.0), vec4f(matt.geometric, 1.0));
}
