//! What an opaque surface does to light: matt, or matt under a gloss.
//!
//! The gloss is the microfacet model of Walter, Marschner, Li & Torrance 2007 with the GGX distribution and Smith's
//! height-correlated masking (Heitz 2014), sampled by visible normals (Heitz 2018), and Schlick's approximation of
//! Fresnel's equations. What it lets through on the way in and out is left to the matt base.

use glam::{Vec2, Vec3};
use meniscus_sim::mesh::Shine;
use meniscus_sim::rng::Rng;
use std::f32::consts::{PI, TAU};

/// Reflectance of a dielectric with an index of 1.5 at normal incidence.
const DIELECTRIC: f32 = 0.04;
/// Smoothest gloss: smoother ones would hardly ever be met by sampled light.
const LEAST_ALPHA: f32 = 2e-3;

/// How a surface scatters light that leaves it in one direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scatter {
    normal: Vec3,
    /// Albedo of the matt base.
    base: Vec3,
    gloss: Option<Gloss>,
}

#[derive(Clone, Copy, Debug)]
struct Gloss {
    /// Towards the eye, about the normal as +Z.
    out: Vec3,
    alpha: f32,
    f0: Vec3,
    /// Chance that a direction is chosen by the gloss.
    chance: f32,
}

impl Scatter {
    pub(super) fn matt(normal: Vec3, albedo: Vec3) -> Self {
        Self {
            normal,
            base: albedo,
            gloss: None,
        }
    }

    /// A surface of that colour seen from `out`.
    pub(super) fn glossy(normal: Vec3, color: Vec3, shine: Shine, out: Vec3) -> Self {
        let matt = Self::matt(normal, color * (1.0 - shine.metallic));
        let out = matt.local(out);
        // A smooth normal may face away from the eye where its triangle does not.
        if out.z <= 1e-4 {
            return Self::matt(normal, color);
        }
        let f0 = Vec3::splat(DIELECTRIC).lerp(color, shine.metallic);
        let seen = schlick(f0, out.z).max_element();
        let below = matt.base.max_element() * (1.0 - seen);
        Self {
            gloss: Some(Gloss {
                out,
                alpha: (shine.roughness * shine.roughness).max(LEAST_ALPHA),
                f0,
                chance: (seen / (seen + below).max(1e-6)).clamp(0.1, 0.95),
            }),
            ..matt
        }
    }

    fn local(&self, d: Vec3) -> Vec3 {
        let (a, b) = self.normal.any_orthonormal_pair();
        Vec3::new(d.dot(a), d.dot(b), d.dot(self.normal))
    }

    /// Share of radiance from `towards` that is sent to the eye, a steradian, times the cosine.
    pub(super) fn share(&self, towards: Vec3) -> Vec3 {
        let to = self.local(towards);
        if to.z <= 0.0 {
            return Vec3::ZERO;
        }
        let Some(gloss) = &self.gloss else {
            return self.base * (to.z / PI);
        };
        let half = (gloss.out + to).normalize_or(Vec3::Z);
        let fresnel = schlick(gloss.f0, half.dot(to));
        let mirrored = fresnel * (gloss.distribution(half) * gloss.masking(to) / (4.0 * gloss.out.z));
        let through = (1.0 - schlick(gloss.f0, gloss.out.z)) * (1.0 - schlick(gloss.f0, to.z));
        mirrored + through * self.base * (to.z / PI)
    }

    /// Density a steradian with which [`Self::choose`] gives `towards`.
    pub(super) fn density(&self, towards: Vec3) -> f32 {
        let to = self.local(towards);
        if to.z <= 0.0 {
            return 0.0;
        }
        let even = to.z / PI;
        let Some(gloss) = &self.gloss else { return even };
        let half = (gloss.out + to).normalize_or(Vec3::Z);
        // Visible normals: D·G₁·(o·h)/o.z, and a half-vector turns half as far as the direction.
        let mirrored = gloss.distribution(half) * gloss.visible() / (4.0 * gloss.out.z);
        gloss.chance * mirrored + (1.0 - gloss.chance) * even
    }

    /// A direction that the surface sends light from.
    pub(super) fn choose(&self, rng: &mut Rng) -> Vec3 {
        let pick = rng.uniform_f32();
        let u = Vec2::new(rng.uniform_f32(), rng.uniform_f32());
        let local = match &self.gloss {
            Some(gloss) if pick < gloss.chance => {
                let half = gloss.visible_normal(u);
                2.0 * gloss.out.dot(half) * half - gloss.out
            }
            _ => {
                let (sin, cos) = (TAU * u.y).sin_cos();
                let r = u.x.sqrt();
                Vec3::new(r * cos, r * sin, (1.0 - u.x).max(0.0).sqrt())
            }
        };
        let (a, b) = self.normal.any_orthonormal_pair();
        (local.x * a + local.y * b + local.z * self.normal).normalize()
    }
}

impl Gloss {
    fn distribution(&self, half: Vec3) -> f32 {
        let a2 = self.alpha * self.alpha;
        // Exact for smooth surfaces too: 1 − z² from the other components.
        let across = half.x * half.x + half.y * half.y;
        let d = across + a2 * half.z * half.z;
        a2 / (PI * d * d)
    }

    /// Smith's Λ.
    fn lambda(&self, d: Vec3) -> f32 {
        let slope2 = (d.x * d.x + d.y * d.y) / (d.z * d.z).max(1e-12);
        0.5 * ((1.0 + self.alpha * self.alpha * slope2).sqrt() - 1.0)
    }

    /// Share of normals seen from the eye.
    fn visible(&self) -> f32 {
        1.0 / (1.0 + self.lambda(self.out))
    }

    /// Share seen from the eye and lit from `to`.
    fn masking(&self, to: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(self.out) + self.lambda(to))
    }

    /// A normal, in proportion to how much of it the eye sees (Heitz 2018).
    fn visible_normal(&self, u: Vec2) -> Vec3 {
        let stretched = Vec3::new(self.alpha * self.out.x, self.alpha * self.out.y, self.out.z).normalize();
        let level = stretched.x.hypot(stretched.y);
        let right = if level > 1e-7 {
            Vec3::new(-stretched.y, stretched.x, 0.0) / level
        } else {
            Vec3::X
        };
        let up = stretched.cross(right);
        let r = u.x.sqrt();
        let (sin, cos) = (TAU * u.y).sin_cos();
        let x = r * cos;
        let s = 0.5 * (1.0 + stretched.z);
        let y = (1.0 - s) * (1.0 - x * x).max(0.0).sqrt() + s * r * sin;
        let z = (1.0 - x * x - y * y).max(0.0).sqrt();
        let normal = x * right + y * up + z * stretched;
        Vec3::new(self.alpha * normal.x, self.alpha * normal.y, normal.z.max(1e-6)).normalize()
    }
}

fn schlick(f0: Vec3, cos: f32) -> Vec3 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    f0 + (1.0 - f0) * m.powi(5)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shine(roughness: f32, metallic: f32) -> Shine {
        Shine { roughness, metallic }
    }

    fn from(angle: f32) -> Vec3 {
        Vec3::new(angle.sin(), 0.0, angle.cos())
    }

    /// No more light leaves than falls in, and of smooth surfaces nearly all of it; chosen directions and even ones give the same sum, and the density integrates to at most one.
    #[test]
    fn it_sends_back_what_it_gets_and_chooses_as_it_says() {
        let n = 60_000;
        for roughness in [0.1, 0.4, 0.9] {
            for metallic in [0.0, 1.0] {
                for angle in [0.2, 1.2] {
                    let surface =
                        Scatter::glossy(Vec3::Z, Vec3::ONE, shine(roughness, metallic), from(angle));
                    let mut rng = Rng::new(5, 9);
                    let (mut chosen, mut square, mut even, mut all) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
                    for _ in 0..n {
                        let d = surface.choose(&mut rng);
                        let density = surface.density(d);
                        if density > 0.0 {
                            let value = f64::from(surface.share(d).x / density);
                            chosen += value;
                            square += value * value;
                        }
                        // Evenly in cos²: dense where GGX is, on average as any.
                        let z = rng.uniform_f32();
                        let (sin, cos) = (TAU * rng.uniform_f32()).sin_cos();
                        let r = (1.0 - z * z).max(0.0).sqrt();
                        let d = Vec3::new(r * cos, r * sin, z);
                        even += f64::from(surface.share(d).x * TAU);
                        all += f64::from(surface.density(d) * TAU);
                    }
                    let count = f64::from(n);
                    let (chosen, even, all) = (chosen / count, even / count, all / count);
                    let error = ((square / count - chosen * chosen) / count).sqrt();
                    let name = format!("roughness {roughness}, metallic {metallic}, {angle}");
                    assert!(chosen < 1.0 + 4.0 * error, "{name}: {chosen} ± {error}");
                    if roughness < 0.2 {
                        // What goes to and fro between facets is lost: next to nothing here, over half at roughness 0.9.
                        assert!(chosen > 0.9, "{name}: {chosen}");
                    }
                    if roughness > 0.3 {
                        // The smooth one is met by too few even directions to tell.
                        assert!((chosen - even).abs() < 0.03, "{name}: {chosen} {even}");
                        assert!(all < 1.03, "{name}: density {all}");
                    }
                }
            }
        }
    }

    #[test]
    fn light_may_be_followed_either_way() {
        for roughness in [0.1, 0.5] {
            let color = Vec3::new(0.8, 0.4, 0.2);
            let pairs = [
                (from(0.3), from(1.1)),
                (from(-0.9), Vec3::new(0.1, 0.6, 0.79).normalize()),
            ];
            for (a, b) in pairs {
                let seen = |out: Vec3, to: Vec3| {
                    Scatter::glossy(Vec3::Z, color, shine(roughness, 0.3), out).share(to) / to.z
                };
                let (there, back) = (seen(a, b), seen(b, a));
                assert!(
                    ((there - back) / there).abs().max_element() < 1e-4,
                    "{there} {back}"
                );
            }
        }
        let matt = Scatter::matt(Vec3::Z, Vec3::splat(0.5));
        assert_eq!(matt.share(Vec3::Z), Vec3::splat(0.5) * (1.0 / PI));
    }
}
