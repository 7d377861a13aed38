// What a ray meets first, and the light of matt surfaces (`render-cpu/src/stage/world.rs`, `whitted/shade.rs`).

const NOTHING: u32 = 0u;
const SURFACE: u32 = 1u;
const GLASS: u32 = 2u;
const GROUND: u32 = 3u;
const WALL: u32 = 4u;
const SOLID: u32 = 5u;
const DROPLET: u32 = 6u;

struct Hit {
    t: f32,
    kind: u32,
    normal: vec3f,
    shading: vec3f,
    color: vec3f,
    droplet: u32,
}

// `see_water`: whether water (and in air, droplets) stops the ray; without, only what is opaque does.
fn cast_ray(o: vec3f, d: vec3f, t_max: f32, see_water: bool, in_air: bool) -> Hit {
    var hit = Hit(FAR, NOTHING, vec3f(0.0), vec3f(0.0), vec3f(0.0), 0u);
    var limit = t_max;
    let solid = cast_solids(o, d, limit);
    if solid.t < FAR && solid.t <= limit {
        limit = solid.t;
        hit = Hit(solid.t, SOLID, solid.normal, solid.shading, solid.color, 0u);
    }
    let edge = cast_solid_edges(o, d, limit);
    if edge.t < FAR {
        limit = edge.t;
        hit = Hit(edge.t, WALL, edge.normal, edge.normal, stage.steep, 0u);
    }
    // One call for both fields keeps the shader short: the ground first, then the water up to it.
    let last = select(1u, 0u, see_water);
    for (var n = 0u; n < 2u; n++) {
        let f = 1u - n;
        if f < last {
            break;
        }
        let field = field_cast(f, o, d, limit);
        if field.t < FAR && field.t <= limit && (f == GROUND_FIELD || within_glass(o + field.t * d)) {
            limit = field.t;
            hit = Hit(field.t, select(SURFACE, GROUND, f == GROUND_FIELD), field.normal, field.normal, vec3f(0.0), 0u);
        }
    }
    if see_water {
        let glass = cast_glass(o, d, limit);
        if glass.t < FAR {
            limit = glass.t;
            hit = Hit(glass.t, GLASS, glass.normal, glass.normal, vec3f(0.0), 0u);
        }
        if in_air {
            let ball = cast_spray(o, d, limit);
            if ball.x < FAR {
                let centre = droplet(u32(ball.y));
                let normal = (o + ball.x * d - centre.xyz) / centre.w;
                hit = Hit(ball.x, DROPLET, normal, normal, vec3f(0.0), u32(ball.y));
            }
        }
    }
    return hit;
}

struct Matt {
    position: vec3f,
    geometric: vec3f,
    normal: vec3f,
    albedo: vec3f,
    open: f32,
    lift: f32,
    caustics: bool,
    medium: u32,
}

fn depth_below(p: vec3f) -> f32 {
    return field_height(WATER_FIELD, p.xz) - p.y;
}

// The ground at a hit whose pixel is `width` metres wide there.
fn ground_matt(p: vec3f, geometric: vec3f, d: vec3f, width: f32, medium: u32) -> Matt {
    let slope = field_slope(GROUND_FIELD, p.xz);
    let cos = max(abs(dot(geometric, d)), 0.1);
    let look = ground_look(p.xz, slope.xy, -depth_below(p), width / sqrt(cos));
    let relief = select(0.0, 0.02 * stage.fields[GROUND_FIELD].spacing, stage.open != 0u);
    return Matt(
        p,
        geometric,
        normalize(vec3f(-look.slope.x, 1.0, -look.slope.y)),
        look.albedo,
        openness(p.xz),
        max(stage.hair, relief),
        true,
        medium,
    );
}

// The matt surface at a hit of ground, wall or object.
fn matt_of(hit: Hit, p: vec3f, d: vec3f, width: f32, medium: u32) -> Matt {
    if hit.kind == GROUND {
        return ground_matt(p, hit.normal, d, width, medium);
    }
    let away = select(1.0, -1.0, hit.kind == SOLID && dot(hit.normal, d) > 0.0);
    return Matt(p, away * hit.normal, away * hit.shading, hit.color, 1.0, stage.hair, false, medium);
}

fn lit(matt: Matt) -> vec3f {
    var irradiance = vec3f(0.0);
    var strength = vec3f(0.0);
    // The sun's way: through the air, or along the beam to the level of the surface above and on through the air.
    var towards = towards_sun();
    var reach = FAR;
    var legs = 0;
    if matt.medium == AIR {
        irradiance = ambient(matt.normal) * matt.open;
        let cos = dot(matt.normal, towards);
        if stage.has_sun != 0u && cos > 0.0 {
            strength = stage.sun_irradiance * cos;
            legs = 1;
        }
    } else {
        let depth = max(depth_below(matt.position), 0.0);
        let entered = stage.level_sky * transmittance(stage.extinction, DIFFUSE_PATH * depth);
        let up = 0.5 * (1.0 + matt.normal.y);
        irradiance = entered * (up + (1.0 - up) * matt.albedo) * matt.open;
        var level = entered;
        if stage.has_beam != 0u {
            reach = depth / stage.beam_direction.y;
            let beam = stage.beam_irradiance * transmittance(stage.extinction, reach);
            level += beam * stage.beam_direction.y;
            var cos = dot(matt.normal, stage.beam_direction);
            if matt.caustics {
                cos = beam_received(matt.normal, matt.geometric, matt.position.xz);
            }
            if cos > 0.0 {
                strength = beam * cos;
                legs = 2;
            }
        }
        let back = (1.0 - stage.entering) * matt.albedo * transmittance(stage.extinction, 2.0 * DIFFUSE_PATH * depth);
        irradiance += back / max(1.0 - back, vec3f(1e-3)) * level;
    }
    if SHADOWS && legs > 0 {
        var origin = matt.position + matt.geometric * matt.lift;
        var direction = towards;
        if legs == 2 {
            direction = stage.beam_direction;
        }
        for (var leg = 0; leg < legs; leg++) {
            let limit = select(FAR, reach, legs == 2 && leg == 0);
            if cast_ray(origin, direction, limit, false, false).kind != NOTHING {
                strength = vec3f(0.0);
                break;
            }
            origin += direction * limit;
            direction = towards;
        }
    }
    return matt.albedo * (irradiance + strength) / PI;
}

// What a water interface does to a ray.
struct Interface {
    fresnel: f32,
    reflected: vec3f,
    // Zero at total reflection.
    refracted: vec3f,
    facing: vec3f,
    shading: vec3f,
    from_water: bool,
    curvature: f32,
}

fn keep_side(direction: vec3f, normal: vec3f) -> vec3f {
    let along = dot(direction, normal);
    if along < 1e-4 {
        return normalize(direction + normal * (1e-4 - along));
    }
    return direction;
}

fn water_interface(d: vec3f, p: vec3f, normal: vec3f, glass: bool) -> Interface {
    let from_water = dot(normal, d) > 0.0;
    let side = select(1.0, -1.0, from_water);
    let facing = side * normal;
    var smooth_normal = normal;
    var curvature = 0.0;
    if !glass {
        let slope = field_slope(WATER_FIELD, p.xz);
        smooth_normal = normalize(vec3f(-slope.x, 1.0, -slope.y));
        curvature = slope.z;
    }
    var shading = side * smooth_normal;
    let along = dot(shading, d);
    if along > -1e-3 {
        shading = normalize(shading - d * (along + 1e-3));
    }
    let eta = select(1.0 / stage.index, stage.index, from_water);
    let share = fresnel(-dot(d, shading), eta);
    var refracted = optics_refract(d, shading, eta);
    if any(refracted != vec3f(0.0)) {
        refracted = keep_side(refracted, -facing);
    }
    return Interface(
        share,
        keep_side(optics_reflect(d, shading), facing),
        refracted,
        facing,
        shading,
        from_water,
        curvature,
    );
}
