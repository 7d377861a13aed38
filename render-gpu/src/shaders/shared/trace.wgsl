// The recursion of `render-cpu/src/whitted/trace.rs` as a loop: branches that wait stand on a small stack.

struct Path {
    origin: vec3f,
    direction: vec3f,
    through: vec3f,
    medium: u32,
    width: f32,
    spread: f32,
    interfaces: u32,
    weight: f32,
    // Whether the ray has just gone into water that may be thinner than the offset that keeps it off its surface.
    entering: bool,
}

fn primary_path(at: vec2f) -> Path {
    return Path(stage.eye, view_direction(at), vec3f(1.0), stage.medium, 0.0, stage.spread, 0u, 1.0, false);
}

fn largest(v: vec3f) -> f32 {
    return max(v.x, max(v.y, v.z));
}

fn given_up(path: Path) -> vec3f {
    if path.medium == AIR {
        return sky_radiance(path.direction, 0.5);
    }
    return scattered(depth_below(path.origin), 1.0, FAR);
}

// Whether a branch can be left to the other one: its share is below the cut-off, also of the sun.
fn negligible(path: Path) -> bool {
    if path.weight >= CUTOFF {
        return false;
    }
    return stage.has_sun == 0u
        || path.weight * largest(sun_disc(path.direction, path.spread)) < CUTOFF * largest(stage.sun_irradiance);
}

fn branch(path: Path, at: Interface, p: vec3f, direction: vec3f, medium: u32, width: f32, spread: f32, share: f32) -> Path {
    let side = select(-stage.hair, stage.hair, dot(direction, at.facing) > 0.0);
    return Path(
        p + at.facing * side,
        direction,
        path.through,
        medium,
        width,
        spread,
        path.interfaces + 1u,
        path.weight * share,
        medium == WATER && path.medium == AIR,
    );
}

struct Traced {
    radiance: vec3f,
    // To the first thing met; FAR for the sky.
    distance: f32,
}

fn trace(first: Path) -> Traced {
    var total = vec3f(0.0);
    var seen = FAR;
    var path = first;
    var waiting: array<Path, INTERFACE_DEPTH>;
    var count = 0;
    for (var n = 0; n < MOST_RAYS; n++) {
        let d = path.direction;
        var hit = Hit(FAR, NOTHING, vec3f(0.0), vec3f(0.0), vec3f(0.0), 0u);
        if path.entering && field_height(GROUND_FIELD, path.origin.xz) >= path.origin.y {
            hit.kind = GROUND;
            hit.t = 0.0;
            hit.normal = field_normal(GROUND_FIELD, path.origin.xz);
        } else if SELF_REFLECTION || path.interfaces == 0u || path.medium == WATER {
            let limit = select(FAR, stage.cutoff_distance, path.medium == WATER && path.interfaces > 0u);
            hit = cast_ray(path.origin, d, limit, true, path.medium == AIR);
        }
        if n == 0 {
            seen = hit.t;
        }
        var through = path.through;
        var done = true;
        var share = vec3f(0.0);
        var matt = Matt(vec3f(0.0), vec3f(0.0), vec3f(0.0), vec3f(0.0), 1.0, 0.0, false, AIR);
        let p = path.origin + hit.t * d;
        let width = path.width + path.spread * hit.t;
        if hit.kind == NOTHING {
            if path.medium == AIR {
                total += through * escaped(d, path.spread);
            } else {
                total += through * scattered(depth_below(path.origin), -d.y, FAR);
            }
        } else {
            var weight = path.weight;
            if path.medium == AIR {
                let left = air_transmittance(hit.t);
                total += through * haze(d) * (1.0 - left);
                through *= left;
            } else if ABSORPTION {
                let left = transmittance(stage.extinction, hit.t);
                total += through * scattered(depth_below(path.origin), -d.y, hit.t);
                through *= left;
                weight *= largest(left);
            }
            if hit.kind == SURFACE || hit.kind == GLASS {
                let at = water_interface(d, p, hit.normal, hit.kind == GLASS);
                var covered = 0.0;
                if hit.kind == SURFACE {
                    covered = foam_cover(p.xz);
                }
                if covered > 0.0 {
                    let up = at.shading * sign(at.shading.y);
                    matt = Matt(p, hit.normal, up, vec3f(FOAM_ALBEDO), 1.0, stage.hair, false, AIR);
                    share = through * covered;
                    through *= 1.0 - covered;
                }
                path.through = through;
                path.weight = weight;
                if covered >= 1.0 {
                    // Nothing is seen through it.
                } else if path.interfaces >= INTERFACE_DEPTH + UNSPLIT_INTERFACES {
                    total += through * given_up(path);
                } else {
                    let cos = max(dot(at.shading, -d), 0.05);
                    let turn = min(at.curvature * width, 0.5) + ROUGHNESS;
                    let near = select(AIR, WATER, at.from_water);
                    let far = select(WATER, AIR, at.from_water);
                    let mirrored = branch(path, at, p, at.reflected, near, width, path.spread + 2.0 * turn, at.fresnel);
                    done = false;
                    if all(at.refracted == vec3f(0.0)) {
                        path = mirrored;
                        path.weight = weight * at.fresnel;
                    } else {
                        let bent = branch(path, at, p, at.refracted, far, width, path.spread + 0.5 * turn / cos, 1.0 - at.fresnel);
                        let split = path.interfaces < INTERFACE_DEPTH && count < i32(INTERFACE_DEPTH);
                        if !split {
                            // The likelier way stands for both.
                            if at.fresnel > 0.5 { path = mirrored; } else { path = bent; }
                        } else if negligible(mirrored) {
                            path = bent;
                        } else if negligible(bent) {
                            path = mirrored;
                        } else {
                            waiting[count] = bent;
                            waiting[count].through = through * (1.0 - at.fresnel);
                            count += 1;
                            path = mirrored;
                            path.through = through * at.fresnel;
                        }
                    }
                }
            } else if hit.kind == DROPLET {
                // Reflected once, or refracted in and out.
                path.through = through;
                if path.interfaces >= INTERFACE_DEPTH + UNSPLIT_INTERFACES {
                    total += through * given_up(path);
                } else {
                    done = false;
                    let ball = droplet(hit.droplet);
                    let normal = hit.normal;
                    let mirror_share = fresnel(-dot(d, normal), 1.0 / stage.index);
                    let spread = path.spread + min(width / ball.w, 0.5);
                    let mirrored = optics_reflect(d, normal);
                    let inside = optics_refract(d, normal, 1.0 / stage.index);
                    let chord = -2.0 * dot(inside, normal) * ball.w;
                    let out = p + chord * inside;
                    let outwards = normalize(out - ball.xyz);
                    let leaving = optics_refract(inside, -outwards, stage.index);
                    let next = path.interfaces + 1u;
                    let hair = stage.hair;
                    if all(leaving == vec3f(0.0)) {
                        path = Path(p + hair * normal, mirrored, through, AIR, width, spread, next, path.weight * mirror_share, false);
                    } else {
                        let left = transmittance(stage.extinction, chord);
                        let whole = path.interfaces >= INTERFACE_DEPTH || mirror_share * path.weight < CUTOFF
                            || count >= i32(INTERFACE_DEPTH);
                        var passing = left * through;
                        if !whole {
                            waiting[count] = Path(p + hair * normal, mirrored, through * mirror_share, AIR, width, spread, next,
                                path.weight * mirror_share, false);
                            count += 1;
                            passing *= 1.0 - mirror_share;
                        }
                        path = Path(out + hair * outwards, leaving, passing, AIR, width, spread, next,
                            path.weight * (1.0 - mirror_share), false);
                    }
                }
            } else {
                matt = matt_of(hit, p, d, width, path.medium);
                share = through;
            }
        }
        if any(share > vec3f(0.0)) {
            total += share * lit(matt);
        }
        if done {
            if count == 0 {
                break;
            }
            count -= 1;
            path = waiting[count];
        }
    }
    return Traced(total, seen);
}
