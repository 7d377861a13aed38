//! From the nodes of a model to one mesh in its own axes.

use super::accessors::Accessors;
use super::{Kind, MAX_DEPTH, MAX_ELEMENTS, textures};
use crate::mesh::{DEFAULT_COLOR, TriangleMesh};
use glam::{Mat3, Mat4, Vec2, Vec3};
use gltf::mesh::{Mode, Semantic};
use std::collections::HashMap;
use std::path::Path;

/// Gathers the triangles of all nodes in one mesh.
pub(super) struct Reader<'a> {
    data: Accessors,
    pub(super) mesh: TriangleMesh,
    /// Where other files are sought.
    base: Option<&'a Path>,
    /// Materials of the mesh by their numbers in the file.
    materials: HashMap<Option<usize>, u16>,
    /// Triangles of the primitive that gave the base colour.
    largest: usize,
    /// In a valid file each node has one parent, so each is visited once.
    nodes_left: usize,
    elements_read: usize,
}

impl<'a> Reader<'a> {
    /// `nodes` is how many there are in the file.
    pub(super) fn new(data: Accessors, nodes: usize, base: Option<&'a Path>) -> Self {
        Self {
            data,
            base,
            materials: HashMap::new(),
            mesh: TriangleMesh {
                base_color: DEFAULT_COLOR,
                ..TriangleMesh::default()
            },
            largest: 0,
            nodes_left: nodes,
            elements_read: 0,
        }
    }

    /// Adds the triangles of a node and of all below it.
    pub(super) fn node(&mut self, node: &gltf::Node<'_>, parent: Mat4, depth: u32) -> Result<(), Kind> {
        if depth > MAX_DEPTH || self.nodes_left == 0 {
            return Err(Kind::Hierarchy);
        }
        self.nodes_left -= 1;
        let model_from_node = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
        if let Some(mesh) = node.mesh() {
            let name = mesh
                .name()
                .map_or_else(|| mesh.index().to_string(), |n| format!("`{n}`"));
            for primitive in mesh.primitives() {
                self.primitive(&primitive, model_from_node, &name)?;
            }
        }
        node.children()
            .try_for_each(|child| self.node(&child, model_from_node, depth + 1))
    }

    fn primitive(
        &mut self,
        primitive: &gltf::Primitive<'_>,
        transform: Mat4,
        name: &str,
    ) -> Result<(), Kind> {
        if matches!(
            primitive.mode(),
            Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip
        ) {
            return Ok(());
        }
        let Some(positions) = primitive.get(&Semantic::Positions) else {
            return Ok(());
        };
        let mut positions: Vec<Vec3> = self
            .data
            .vectors::<3>(&positions)?
            .into_iter()
            .map(Vec3::from)
            .collect();
        let mut triangles = self.data.triangles(primitive, positions.len())?;
        // Every vertex that is read counts, kept or not: nodes may share a mesh as often as they like.
        self.elements_read += positions.len().max(3 * triangles.len());
        if self.elements_read > MAX_ELEMENTS {
            return Err(Kind::TooLarge);
        }
        for (vertex, p) in positions.iter_mut().enumerate() {
            let placed = transform.transform_point3(*p);
            // A comparison that NaN fails.
            if !(placed.abs().max_element() <= 1e9 && placed.is_finite()) {
                let position = p.to_array();
                return Err(Kind::NotFinite {
                    mesh: name.into(),
                    vertex,
                    position,
                });
            }
            *p = placed;
        }
        let linear = Mat3::from_mat4(transform);
        if linear.determinant() < 0.0 {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let cross = |t: &[u32; 3], p: &[Vec3]| {
            let [a, b, c] = t.map(|k| p[k as usize].as_dvec3());
            (b - a).cross(c - a)
        };
        triangles.retain(|t| cross(t, &positions).length_squared() > 0.0);
        if triangles.is_empty() {
            return Ok(());
        }
        let look = primitive.material();
        let set = look
            .pbr_metallic_roughness()
            .base_color_texture()
            .map_or(0, |info| info.tex_coord());
        let mut texcoords = match primitive.get(&Semantic::TexCoords(set)) {
            Some(a) if a.count() == positions.len() => self.data.texcoords(&a)?,
            _ => Vec::new(),
        };
        let mut normals = match primitive.get(&Semantic::Normals) {
            Some(a) if a.count() == positions.len() => {
                self.data.vectors::<3>(&a)?.into_iter().map(Vec3::from).collect()
            }
            _ => Vec::new(),
        };
        if normals.is_empty() {
            let corners: Vec<u32> = triangles.iter().flatten().copied().collect();
            texcoords = if texcoords.is_empty() {
                texcoords
            } else {
                pick(&texcoords, &corners)
            };
            normals = triangles
                .iter()
                .flat_map(|t| [cross(t, &positions).normalize().as_vec3(); 3])
                .collect();
            positions = pick(&positions, &corners);
            triangles = (0..triangles.len() as u32)
                .map(|k| [3 * k, 3 * k + 1, 3 * k + 2])
                .collect();
        } else {
            let cofactor = linear.inverse().transpose();
            let faces = face_normals(&positions, &triangles, cross);
            for (normal, face) in normals.iter_mut().zip(faces) {
                let turned = (cofactor * *normal).try_normalize();
                *normal = turned.unwrap_or(face);
            }
        }
        let number = self.material(&look)?;
        if triangles.len() > self.largest {
            self.largest = triangles.len();
            self.mesh.base_color = self.mesh.materials[usize::from(number)].mean();
        }
        self.mesh
            .material_of
            .extend(std::iter::repeat_n(number, triangles.len()));
        self.append(positions, normals, texcoords, &triangles);
        Ok(())
    }

    /// Number of a material in the mesh, read at its first use.
    fn material(&mut self, look: &gltf::Material<'_>) -> Result<u16, Kind> {
        if let Some(&known) = self.materials.get(&look.index()) {
            return Ok(known);
        }
        let number = u16::try_from(self.mesh.materials.len()).map_err(|_| Kind::TooLarge)?;
        let material = textures::material(look, &self.data, self.base)?;
        self.mesh.materials.push(material);
        self.materials.insert(look.index(), number);
        Ok(number)
    }

    /// The mesh; one of a single colour without materials, and textures without coordinates as their means.
    pub(super) fn finish(self) -> TriangleMesh {
        let mut mesh = self.mesh;
        for material in &mut mesh.materials {
            if mesh.texcoords.is_empty() && material.texture.is_some() {
                material.color = material.mean();
                material.texture = None;
            }
        }
        let plain = |m: &crate::mesh::Material| {
            m.texture.is_none() && m.shine.is_none() && m.color == mesh.base_color
        };
        if mesh.materials.iter().all(plain) {
            mesh.materials.clear();
            mesh.material_of.clear();
        }
        mesh
    }

    fn append(
        &mut self,
        positions: Vec<Vec3>,
        normals: Vec<Vec3>,
        texcoords: Vec<Vec2>,
        triangles: &[[u32; 3]],
    ) {
        let mesh = &mut self.mesh;
        let first = mesh.positions.len() as u32;
        // Texture coordinates are all there or not at all.
        if !texcoords.is_empty() || !mesh.texcoords.is_empty() {
            mesh.texcoords.resize(first as usize, Vec2::ZERO);
            mesh.texcoords.extend(&texcoords);
            mesh.texcoords
                .resize(first as usize + positions.len(), Vec2::ZERO);
        }
        mesh.positions.extend(positions);
        mesh.normals.extend(normals);
        mesh.triangles
            .extend(triangles.iter().map(|t| t.map(|k| k + first)));
    }
}

fn pick<T: Copy>(values: &[T], indices: &[u32]) -> Vec<T> {
    indices.iter().map(|&k| values[k as usize]).collect()
}

/// Normals of the faces about each vertex, weighted by area: for vertices whose own normal is unusable.
fn face_normals(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    cross: impl Fn(&[u32; 3], &[Vec3]) -> glam::DVec3,
) -> Vec<Vec3> {
    let mut sums = vec![glam::DVec3::ZERO; positions.len()];
    for t in triangles {
        let face = cross(t, positions);
        t.iter().for_each(|&k| sums[k as usize] += face);
    }
    sums.into_iter()
        .map(|s| s.normalize_or(glam::DVec3::Y).as_vec3())
        .collect()
}
