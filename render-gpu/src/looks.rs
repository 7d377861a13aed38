//! What parts of models look like, as rows that shaders read (`shaders/shared/looks.wgsl`).

use crate::hierarchy::Rows;
use meniscus_sim::Scene;
use meniscus_sim::mesh::{Material, Texture, TriangleMesh, Wrap};
use meniscus_sim::scene::description::Shape;

/// Whether any model has more than one colour.
pub(crate) fn are_needed(scene: &Scene) -> bool {
    let objects = scene.description.objects.iter().zip(&scene.meshes);
    objects
        .filter(|(object, _)| matches!(object.shape, Shape::Model { .. }))
        .any(|(_, mesh)| !mesh.material_of.is_empty())
}

/// Rows of a triangle: corners and normals, and where there are looks, one for its material.
pub(crate) const fn triangle_rows(looks: bool) -> u32 {
    if looks { 7 } else { 6 }
}

/// Rows that the materials of a mesh take.
pub(crate) fn planned_rows(mesh: &TriangleMesh) -> usize {
    let texels = |m: &Material| m.texture.as_ref().map_or(0, |t| t.texels.len());
    mesh.materials.iter().map(|m| 2 + texels(m).div_ceil(4)).sum()
}

/// The materials of a mesh, whose rows are counted from `base`, and the row of each.
pub(crate) fn material_rows(mesh: &TriangleMesh, base: u32) -> (Rows, Vec<u32>) {
    let mut rows = Rows::new();
    let mut places = Vec::with_capacity(mesh.materials.len());
    for material in &mesh.materials {
        let at = base + rows.len() as u32;
        places.push(at);
        let [r, g, b] = material.color.to_array().map(f32::to_bits);
        rows.push([r, g, b, at + 2]);
        match &material.texture {
            Some(texture) => {
                let [w, h] = texture.size.to_array();
                let [u, v] = texture.wrap.map(wrap_code);
                rows.push([w, h, u, v]);
                rows.extend(texel_rows(texture));
            }
            None => rows.push([0; 4]),
        }
    }
    (rows, places)
}

/// Texels as words of eight bits a colour, four a row.
fn texel_rows(texture: &Texture) -> impl Iterator<Item = [u32; 4]> {
    texture.texels.chunks(4).map(|four| {
        let word = |k: usize| {
            four.get(k)
                .map_or(0, |&[r, g, b]| u32::from_le_bytes([r, g, b, 0]))
        };
        [word(0), word(1), word(2), word(3)]
    })
}

fn wrap_code(wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meniscus_sim::glam::{UVec2, Vec3};

    #[test]
    fn materials_follow_each_other_with_their_texels() {
        let texture = Texture {
            size: UVec2::new(5, 1),
            texels: vec![[1, 2, 3]; 5],
            wrap: [Wrap::Clamp, Wrap::Mirror],
        };
        let material = |texture| Material {
            color: Vec3::ONE,
            texture,
            shine: None,
        };
        let mesh = TriangleMesh {
            materials: vec![material(None), material(Some(texture)), material(None)],
            ..TriangleMesh::default()
        };
        let (rows, places) = material_rows(&mesh, 100);
        assert_eq!(places, [100, 102, 106]);
        assert_eq!(rows.len(), planned_rows(&mesh));
        assert_eq!(rows[3], [5, 1, 2, 1]);
        assert_eq!(rows[2][3], 104);
        assert_eq!((rows[4], rows[5]), ([0x0003_0201; 4], [0x0003_0201, 0, 0, 0]));
    }
}
