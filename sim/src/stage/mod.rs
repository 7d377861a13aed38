//! A frame set up for pictures: what every renderer draws, before any ray or triangle.
//!
//! A scene file does not say all that a picture shows. What stands here fills it in once, for renderers on either kind
//! of processor: how [`light`] and [`sky`] reach surfaces in air and under water, what the [`volume`] takes and gives,
//! how the [`ground`] looks, how heights go on beyond their grid ([`continuation`], [`surroundings`]), where the
//! [`objects`] stand, and which rays a view has ([`lens`]). Renderers of the same stage differ in how they follow
//! light, and in nothing else.

pub mod air;
pub mod choppy;
pub mod continuation;
pub mod ground;
pub mod lens;
pub mod light;
pub mod objects;
mod ray;
pub mod sky;
pub mod surroundings;
pub mod volume;

pub use continuation::Continuation;
pub use lens::Lens;
pub use ray::Ray;

use crate::Scene;
use crate::frame::Channels;

/// Albedo of foam (Whitlock, Bartlett & Gurganus 1982: 0.4 to 0.9 fresh).
pub const FOAM_ALBEDO: f32 = 0.75;

/// The optional channels that the stage of this scene can be set with.
pub fn needs(scene: &Scene) -> Channels {
    let mut set = Channels::DISPLACEMENT | Channels::FOAM | Channels::DROPLETS;
    if !scene.description.objects.is_empty() {
        set |= Channels::BODIES;
    }
    set
}

/// Changes when anything does that depends on the scene alone.
pub fn fingerprint(scene: &Scene) -> u64 {
    use std::hash::{DefaultHasher, Hash, Hasher};
    let mut hasher = DefaultHasher::new();
    format!("{:?}{:?}", scene.description, scene.grid).hash(&mut hasher);
    if let Some(terrain) = &scene.terrain {
        format!("{:?}", terrain.spec()).hash(&mut hasher);
        hasher.write(bytemuck::cast_slice(terrain.as_slice()));
    }
    if let Some(sky) = &scene.sky {
        hasher.write(bytemuck::cast_slice(&sky.pixels));
    }
    for mesh in &scene.meshes {
        hasher.write(bytemuck::cast_slice(&mesh.positions));
        hasher.write(bytemuck::cast_slice(&mesh.normals));
        mesh.triangles.hash(&mut hasher);
        mesh.material_of.hash(&mut hasher);
        for material in &mesh.materials {
            format!("{:?}{:?}", material.color, material.shine).hash(&mut hasher);
            if let Some(texture) = &material.texture {
                hasher.write(texture.texels.as_flattened());
            }
        }
    }
    hasher.finish()
}
