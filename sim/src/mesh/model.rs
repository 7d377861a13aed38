//! Triangle meshes from glTF 2.0 files (`.gltf` and `.glb`).

use super::{DEFAULT_COLOR, TriangleMesh};
use crate::scene::{Fault, ReadError, display_fault, read_file};
use glam::{Mat3, Mat4, Vec2, Vec3};
use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::{Mode, Semantic};
use std::path::{Path, PathBuf};

/// Largest file in bytes.
const MAX_BYTES: u64 = 1 << 30;
/// Most vertices and most triangles of a model; nodes that share a mesh count each time.
const MAX_ELEMENTS: usize = 1 << 26;
/// Deepest hierarchy of nodes.
const MAX_DEPTH: u32 = 64;

/// Why a model cannot be read.
#[derive(Debug)]
pub struct MeshError {
    /// The model's file.
    pub file: PathBuf,
    /// What is wrong with it.
    pub kind: MeshErrorKind,
}

/// What is wrong with a model.
#[derive(Debug)]
#[non_exhaustive]
pub enum MeshErrorKind {
    /// The file could not be read.
    Read(ReadError),
    /// It is not a valid glTF file.
    Invalid(String),
    /// It cannot be shown without an extension that is not known here.
    UnsupportedExtension(String),
    /// It uses something that is not known here.
    Unsupported(String),
    /// A buffer is not there.
    MissingBuffer {
        /// Number of the buffer.
        index: usize,
        /// Why.
        reason: String,
    },
    /// Data reaches beyond its buffer.
    Truncated {
        /// Number of the accessor.
        accessor: usize,
        /// First byte after the data.
        needed: u64,
        /// Bytes of its view of the buffer.
        found: u64,
    },
    /// A triangle names a vertex that is not there.
    Index {
        /// The index.
        index: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A coordinate is NaN or infinite, or beyond 10⁹ m after scaling.
    NotFinite {
        /// Name or number of the mesh.
        mesh: String,
        /// Number of the vertex.
        vertex: usize,
        /// Its position in the file.
        position: [f32; 3],
    },
    /// Nodes contain each other, or are nested too deeply.
    Hierarchy,
    /// Too many vertices or triangles.
    TooLarge,
    /// No triangle in the scene of the file.
    NoTriangles,
}

use MeshErrorKind as Kind;

impl Fault for MeshError {
    fn what(&self) -> String {
        match &self.kind {
            Kind::Read(e) => e.what(),
            Kind::Invalid(reason) => format!("this is not a valid glTF file: {reason}"),
            Kind::UnsupportedExtension(name) => format!("the model requires the extension `{name}`"),
            Kind::Unsupported(what) => format!("the model uses {what}"),
            Kind::MissingBuffer { index, reason } => format!("buffer {index} is missing: {reason}"),
            Kind::Truncated {
                accessor,
                needed,
                found,
            } => {
                format!("accessor {accessor} needs {needed} bytes of its buffer view, which has {found}")
            }
            Kind::Index { index, count } => format!("a triangle names vertex {index} of {count}"),
            Kind::NotFinite {
                mesh,
                vertex,
                position,
            } => {
                format!("vertex {vertex} of mesh {mesh} is at {position:?}, which is no place within 1e9 m")
            }
            Kind::Hierarchy => format!("nodes contain each other or are nested more than {MAX_DEPTH} deep"),
            Kind::TooLarge => format!("the model has more than {MAX_ELEMENTS} vertices or triangles"),
            Kind::NoTriangles => "the model's scene has no triangle with an area".into(),
        }
    }

    fn remedy(&self) -> String {
        match &self.kind {
            Kind::Read(e) => e.remedy(),
            Kind::Invalid(_) | Kind::Truncated { .. } | Kind::Index { .. } => "export the model anew".into(),
            Kind::UnsupportedExtension(_) | Kind::Unsupported(_) => {
                "export it without, as plain triangles in full precision".into()
            }
            Kind::MissingBuffer { .. } => {
                "put the buffer beside the model, or save it as one .glb file".into()
            }
            Kind::NotFinite { .. } => "repair the mesh, or check the model's scale".into(),
            Kind::Hierarchy | Kind::TooLarge => "simplify the model".into(),
            Kind::NoTriangles => "export at least one triangle mesh in the default scene".into(),
        }
    }

    fn file(&self) -> Option<&Path> {
        match self.kind {
            Kind::Read(_) => None,
            _ => Some(&self.file),
        }
    }

    fn read_error(&self) -> Option<&ReadError> {
        match &self.kind {
            Kind::Read(e) => Some(e),
            _ => None,
        }
    }
}

display_fault!(MeshError);

/// Reads every triangle of the model's default scene (its first scene if it names none, all root nodes if it has no
/// scene) into one mesh. `scale` is the length of a model unit in metres.
///
/// Vertices of primitives without normals are doubled so that their faces are flat, as glTF prescribes. The base
/// colour is that of the primitive with the most triangles. Skins, morph targets and textures are left out.
///
/// # Errors
/// [`MeshError`]
pub fn load_gltf(path: &Path, scale: f32) -> Result<TriangleMesh, MeshError> {
    let fail = |kind| MeshError {
        file: path.to_path_buf(),
        kind,
    };
    let bytes = read_file(path, MAX_BYTES).map_err(|e| fail(Kind::Read(e)))?;
    parse(&bytes, path.parent(), scale).map_err(fail)
}

/// As [`load_gltf`], from the bytes of a file; other files that it names are sought in `base`.
pub(crate) fn parse(bytes: &[u8], base: Option<&Path>, scale: f32) -> Result<TriangleMesh, Kind> {
    let invalid = |e: &dyn std::fmt::Display| {
        let text = e.to_string();
        Kind::Invalid(text.chars().take(200).collect())
    };
    // The reader of binary files subtracts the length of its header from the length in it unchecked.
    if bytes.starts_with(b"glTF") {
        let length = bytes
            .get(8..12)
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        if length.is_none_or(|l| l < 12) {
            return Err(Kind::Invalid("the binary header is cut off".into()));
        }
    }
    let gltf = gltf::Gltf::from_slice_without_validation(bytes).map_err(|e| invalid(&e))?;
    if let Some(name) = gltf.document.as_json().extensions_required.first() {
        return Err(Kind::UnsupportedExtension(name.chars().take(80).collect()));
    }
    let blob = gltf.blob;
    let document = gltf::Document::from_json(gltf.document.into_json()).map_err(|e| invalid(&e))?;
    let buffers = buffers(&document, base, blob)?;
    let mut reader = Reader {
        buffers,
        mesh: TriangleMesh {
            base_color: DEFAULT_COLOR,
            ..TriangleMesh::default()
        },
        largest: 0,
        nodes_left: document.nodes().len(),
        elements_read: 0,
    };
    let scene = document.default_scene().or_else(|| document.scenes().next());
    let roots: Vec<_> = match scene {
        Some(scene) => scene.nodes().collect(),
        None => root_nodes(&document),
    };
    for node in roots {
        reader.node(&node, Mat4::from_scale(Vec3::splat(scale)), 0)?;
    }
    if reader.mesh.triangles.is_empty() {
        return Err(Kind::NoTriangles);
    }
    Ok(reader.mesh)
}

/// Nodes that are nobody's children.
fn root_nodes(document: &gltf::Document) -> Vec<gltf::Node<'_>> {
    let mut is_child = vec![false; document.nodes().len()];
    for child in document.nodes().flat_map(|n| n.children()) {
        is_child[child.index()] = true;
    }
    document.nodes().filter(|n| !is_child[n.index()]).collect()
}

/// The bytes of every buffer.
fn buffers(
    document: &gltf::Document,
    base: Option<&Path>,
    blob: Option<Vec<u8>>,
) -> Result<Vec<Vec<u8>>, Kind> {
    let mut blob = blob;
    let mut all = Vec::new();
    for buffer in document.buffers() {
        let index = buffer.index();
        let missing = |reason: String| Kind::MissingBuffer { index, reason };
        let data = match buffer.source() {
            gltf::buffer::Source::Bin => blob
                .take()
                .ok_or_else(|| missing("the file has no binary part for it".into()))?,
            gltf::buffer::Source::Uri(uri) if uri.starts_with("data:") => {
                let data = gltf::buffer::Data::from_source(buffer.source(), None);
                data.map_err(|e| missing(format!("its embedded data cannot be decoded: {e}")))?
                    .0
            }
            gltf::buffer::Source::Uri(uri) => {
                let shown: String = uri.chars().take(120).collect();
                let name = decode_percent(uri).filter(|n| !n.contains(':') && !n.contains('\0'));
                let name = name.ok_or_else(|| missing(format!("`{shown}` is not the name of a file")))?;
                let path = base.unwrap_or(Path::new("")).join(name);
                read_file(&path, MAX_BYTES).map_err(|e| missing(e.what()))?
            }
        };
        if data.len() < buffer.length() {
            let reason = format!(
                "it has {} bytes where {} are declared",
                data.len(),
                buffer.length()
            );
            return Err(missing(reason));
        }
        all.push(data);
    }
    Ok(all)
}

/// Decodes `%20` and the like.
fn decode_percent(uri: &str) -> Option<String> {
    let mut out = Vec::with_capacity(uri.len());
    let mut bytes = uri.bytes();
    while let Some(b) = bytes.next() {
        if b == b'%' {
            let digit = |b: u8| (b as char).to_digit(16);
            let (high, low) = (digit(bytes.next()?)?, digit(bytes.next()?)?);
            out.push((16 * high + low) as u8);
        } else {
            out.push(b);
        }
    }
    String::from_utf8(out).ok()
}

struct Reader {
    buffers: Vec<Vec<u8>>,
    mesh: TriangleMesh,
    /// Triangles of the primitive that gave the base colour.
    largest: usize,
    /// In a valid file each node has one parent, so each is visited once.
    nodes_left: usize,
    elements_read: usize,
}

impl Reader {
    fn node(&mut self, node: &gltf::Node<'_>, parent: Mat4, depth: u32) -> Result<(), Kind> {
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
            .vectors::<3>(&positions)?
            .into_iter()
            .map(Vec3::from)
            .collect();
        let mut triangles = self.triangles(primitive, positions.len())?;
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
        let mut texcoords = match primitive.get(&Semantic::TexCoords(0)) {
            Some(a) if a.count() == positions.len() => self.texcoords(&a)?,
            _ => Vec::new(),
        };
        let mut normals = match primitive.get(&Semantic::Normals) {
            Some(a) if a.count() == positions.len() => {
                self.vectors::<3>(&a)?.into_iter().map(Vec3::from).collect()
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
        if triangles.len() > self.largest {
            self.largest = triangles.len();
            let material = primitive.material();
            let [r, g, b, _] = material.pbr_metallic_roughness().base_color_factor();
            let color = Vec3::new(r, g, b);
            let given = material.index().is_some() && color.is_finite();
            self.mesh.base_color = if given {
                color.clamp(Vec3::ZERO, Vec3::ONE)
            } else {
                DEFAULT_COLOR
            };
        }
        self.append(positions, normals, texcoords, &triangles);
        Ok(())
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

    fn triangles(&self, primitive: &gltf::Primitive<'_>, count: usize) -> Result<Vec<[u32; 3]>, Kind> {
        let indices = match primitive.indices() {
            Some(accessor) => self.indices(&accessor)?,
            None => (0..count as u32).collect(),
        };
        if let Some(&index) = indices.iter().find(|&&k| k as usize >= count) {
            return Err(Kind::Index { index, count });
        }
        let strip = |w: (usize, &[u32])| {
            if w.0.is_multiple_of(2) {
                [w.1[0], w.1[1], w.1[2]]
            } else {
                [w.1[1], w.1[0], w.1[2]]
            }
        };
        Ok(match primitive.mode() {
            Mode::TriangleStrip => indices.windows(3).enumerate().map(strip).collect(),
            Mode::TriangleFan => {
                let hub = indices.first().copied().unwrap_or(0);
                indices
                    .get(1..)
                    .unwrap_or(&[])
                    .windows(2)
                    .map(|w| [hub, w[0], w[1]])
                    .collect()
            }
            _ => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        })
    }

    fn indices(&self, accessor: &gltf::Accessor<'_>) -> Result<Vec<u32>, Kind> {
        let size = match (accessor.dimensions(), accessor.data_type()) {
            (Dimensions::Scalar, DataType::U8) => 1,
            (Dimensions::Scalar, DataType::U16) => 2,
            (Dimensions::Scalar, DataType::U32) => 4,
            (_, other) => return Err(Kind::Unsupported(format!("indices of type {other:?}"))),
        };
        let value = |b: &[u8]| b.iter().rev().fold(0_u32, |v, &byte| v << 8 | u32::from(byte));
        Ok(self.elements(accessor, size)?.map(value).collect())
    }

    fn vectors<const N: usize>(&self, accessor: &gltf::Accessor<'_>) -> Result<Vec<[f32; N]>, Kind> {
        let dimensions = [Dimensions::Scalar, Dimensions::Vec2, Dimensions::Vec3][N - 1];
        if (accessor.dimensions(), accessor.data_type()) != (dimensions, DataType::F32) {
            let what = format!(
                "vertices of type {:?} {:?}",
                accessor.dimensions(),
                accessor.data_type()
            );
            return Err(Kind::Unsupported(what));
        }
        let number =
            |b: &[u8], k: usize| f32::from_le_bytes([b[4 * k], b[4 * k + 1], b[4 * k + 2], b[4 * k + 3]]);
        Ok(self
            .elements(accessor, 4 * N)?
            .map(|b| std::array::from_fn(|k| number(b, k)))
            .collect())
    }

    fn texcoords(&self, accessor: &gltf::Accessor<'_>) -> Result<Vec<Vec2>, Kind> {
        let share = |low: u8, high: u8| f32::from(u16::from_le_bytes([low, high])) / 65_535.0;
        Ok(match (accessor.dimensions(), accessor.data_type()) {
            (Dimensions::Vec2, DataType::F32) => {
                let finite = |uv: [f32; 2]| Vec2::from(uv.map(|v| if v.is_finite() { v } else { 0.0 }));
                self.vectors::<2>(accessor)?.into_iter().map(finite).collect()
            }
            (Dimensions::Vec2, DataType::U8) => {
                let of = |b: &[u8]| Vec2::new(f32::from(b[0]), f32::from(b[1])) / 255.0;
                self.elements(accessor, 2)?.map(of).collect()
            }
            (Dimensions::Vec2, DataType::U16) => self
                .elements(accessor, 4)?
                .map(|b| Vec2::new(share(b[0], b[1]), share(b[2], b[3])))
                .collect(),
            _ => Vec::new(),
        })
    }

    /// The bytes of each element, checked against view and buffer before anything is allocated.
    fn elements(
        &self,
        accessor: &gltf::Accessor<'_>,
        size: usize,
    ) -> Result<impl Iterator<Item = &[u8]>, Kind> {
        if accessor.sparse().is_some() {
            return Err(Kind::Unsupported("sparse accessors".into()));
        }
        let Some(view) = accessor.view() else {
            return Err(Kind::Unsupported("an accessor without data".into()));
        };
        let (count, stride) = (accessor.count(), view.stride().unwrap_or(size).max(size));
        let offset = accessor.offset();
        let end = count
            .saturating_sub(1)
            .saturating_mul(stride)
            .saturating_add(size)
            .saturating_add(offset);
        let end = if count == 0 { offset } else { end };
        let buffer = self.buffers.get(view.buffer().index()).map_or(&[][..], |b| b);
        let start = view.offset().min(buffer.len());
        let data = &buffer[start
            ..view
                .offset()
                .saturating_add(view.length())
                .clamp(start, buffer.len())];
        if end > data.len() {
            return Err(Kind::Truncated {
                accessor: accessor.index(),
                needed: end as u64,
                found: data.len() as u64,
            });
        }
        Ok((0..count).map(move |k| &data[offset + k * stride..offset + k * stride + size]))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::closed::assert_closed;

    /// A tetrahedron with corners at the origin and on the axes; four faces, outwards.
    const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]];
    const FACES: [u16; 12] = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];

    fn buffer(corners: &[[f32; 3]], faces: &[u16]) -> Vec<u8> {
        let corners = corners.iter().flatten().flat_map(|v| v.to_le_bytes());
        corners
            .chain(faces.iter().flat_map(|k| k.to_le_bytes()))
            .collect()
    }

    /// A file with one mesh; `nodes` and `mesh` are JSON, `more` further members of the root.
    fn text(nodes: &str, primitive: &str, more: &str) -> String {
        format!(
            r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0, "scenes": [{{ "nodes": [0] }}], "nodes": {nodes},
            "meshes": [{{ "name": "tetra", "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "indices": 1 {primitive} }}] }}],
            "buffers": [{{ "uri": "the%20mesh.bin", "byteLength": 72 }}],
            "bufferViews": [{{ "buffer": 0, "byteLength": 48 }}, {{ "buffer": 0, "byteOffset": 48, "byteLength": 24 }}],
            "accessors": [
                {{ "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4, "min": [0, 0, 0], "max": [1, 2, 3] }},
                {{ "bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": 12 }}
            ] {more} }}"#
        )
    }

    fn load(text: &str, data: &[u8], scale: f32) -> Result<TriangleMesh, Kind> {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("the mesh.bin"), data).unwrap();
        parse(text.as_bytes(), Some(dir.path()), scale)
    }

    fn good(nodes: &str, more: &str) -> TriangleMesh {
        load(&text(nodes, "", more), &buffer(&CORNERS, &FACES), 1.0).unwrap()
    }

    const NODE: &str = r#"[{ "mesh": 0 }]"#;

    #[test]
    fn the_bunny_is_whole_closed_and_scaled() {
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../data/models/bunny.glb"));
        let bunny = load_gltf(path, 1.0).unwrap();
        assert_eq!((bunny.triangles.len(), bunny.positions.len()), (5648, 2826));
        bunny.validate().unwrap();
        assert_closed(&bunny, false);
        assert_eq!(bunny.base_color, DEFAULT_COLOR);
        let height = |m: &TriangleMesh| {
            let y = m.positions.iter().map(|p| p.y);
            y.clone().fold(f32::MIN, f32::max) - y.fold(f32::MAX, f32::min)
        };
        assert!((height(&bunny) - 1.830_873).abs() < 1e-5);
        let large = load_gltf(path, 1000.0).unwrap();
        assert!((height(&large) / height(&bunny) - 1000.0).abs() < 1e-3);
        let turned = large
            .normals
            .iter()
            .zip(&bunny.normals)
            .map(|(a, b)| (*a - *b).length());
        assert!(turned.fold(0.0, f32::max) < 1e-6);
    }

    #[test]
    fn missing_normals_are_those_of_the_faces() {
        let mesh = good(NODE, "");
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (12, 4));
        assert_closed(&mesh, true);
        assert_eq!(mesh.normals[0], -Vec3::Z);
    }

    #[test]
    fn transforms_of_nodes_apply_and_mirrors_keep_the_outside_outside() {
        let nodes = r#"[{ "translation": [10, 0, 0], "children": [1, 2] },
            { "mesh": 0, "scale": [1, 2, 1] }, { "mesh": 0, "scale": [-1, 1, 1], "translation": [-1, 0, 0] }]"#;
        let mesh = good(nodes, "");
        assert_eq!(mesh.triangles.len(), 8);
        assert_closed(&mesh, true);
        let (low, high) = mesh
            .positions
            .iter()
            .fold((Vec3::MAX, Vec3::MIN), |(l, h), p| (l.min(*p), h.max(*p)));
        assert_eq!((low, high), (Vec3::new(8.0, 0.0, 0.0), Vec3::new(11.0, 4.0, 3.0)));
    }

    #[test]
    fn the_base_colour_is_that_of_the_material() {
        let materials =
            r#", "materials": [{ "pbrMetallicRoughness": { "baseColorFactor": [0.25, 0.5, 0.75, 1] } }]"#;
        let colored = text(NODE, r#", "material": 0"#, materials);
        let mesh = load(&colored, &buffer(&CORNERS, &FACES), 1.0).unwrap();
        assert_eq!(mesh.base_color, Vec3::new(0.25, 0.5, 0.75));
    }

    #[test]
    fn strips_and_fans_become_triangles_of_one_sense() {
        let count = |mode: u32, faces: &[u16]| {
            let mut faces = faces.to_vec();
            faces.resize(12, faces[faces.len() - 1]);
            let text = text(NODE, &format!(r#", "mode": {mode}"#), "");
            load(&text, &buffer(&CORNERS, &faces), 1.0)
                .unwrap()
                .triangles
                .len()
        };
        // The strip 1 2 3 0 has two faces, what repeats an index none.
        assert_eq!(count(5, &[1, 2, 3, 0]), 2);
        assert_eq!(count(6, &[0, 1, 2, 3]), 2);
    }

    #[test]
    fn each_fault_has_its_name() {
        let data = buffer(&CORNERS, &FACES);
        let fault = |text: &str, data: &[u8]| {
            let kind = load(text, data, 1.0).unwrap_err();
            let error = MeshError {
                file: "m.gltf".into(),
                kind,
            };
            assert!(!error.remedy().is_empty() && error.to_string().starts_with("m.gltf: "));
            error
        };
        let plain = text(NODE, "", "");
        let draco = text(
            NODE,
            "",
            r#", "extensionsRequired": ["KHR_draco_mesh_compression"]"#,
        );
        assert!(
            matches!(fault(&draco, &data).kind, Kind::UnsupportedExtension(name) if name.contains("draco"))
        );
        let missing = plain.replace("the%20mesh", "other");
        assert!(
            matches!(fault(&missing, &data).kind, Kind::MissingBuffer { index: 0, reason } if reason.contains("no such file"))
        );
        assert!(
            matches!(fault(&plain, &data[..60]).kind, Kind::MissingBuffer { reason, .. } if reason.contains("60 bytes where 72"))
        );
        let foreign = plain.replace("the%20mesh.bin", "https://example.org/mesh.bin");
        assert!(matches!(fault(&foreign, &data).kind, Kind::MissingBuffer { .. }));
        let undecodable = plain.replace("the%20mesh.bin", "%ff%fe");
        assert!(matches!(
            fault(&undecodable, &data).kind,
            Kind::MissingBuffer { .. }
        ));
        let long = plain.replace(r#""count": 12"#, r#""count": 13"#);
        assert!(matches!(
            fault(&long, &data).kind,
            Kind::Truncated {
                accessor: 1,
                needed: 26,
                found: 24
            }
        ));
        let hostile = plain.replace(r#""count": 4"#, r#""count": 18446744073709551615"#);
        assert!(matches!(
            fault(&hostile, &data).kind,
            Kind::Truncated { accessor: 0, .. }
        ));
        let mut faces = FACES;
        faces[5] = 4;
        assert!(matches!(
            fault(&plain, &buffer(&CORNERS, &faces)).kind,
            Kind::Index { index: 4, count: 4 }
        ));
        let mut corners = CORNERS;
        corners[2][1] = f32::NAN;
        assert!(matches!(
            fault(&plain, &buffer(&corners, &FACES)).kind,
            Kind::NotFinite { vertex: 2, .. }
        ));
        assert!(matches!(
            fault(&plain, &buffer(&CORNERS, &[0; 12])).kind,
            Kind::NoTriangles
        ));
        let points = text(NODE, r#", "mode": 0"#, "");
        assert!(matches!(fault(&points, &data).kind, Kind::NoTriangles));
        let empty = text(r#"[{ "name": "nothing" }]"#, "", "");
        assert!(matches!(fault(&empty, &data).kind, Kind::NoTriangles));
        let ring = text(r#"[{ "children": [1] }, { "children": [0] }]"#, "", "");
        assert!(matches!(fault(&ring, &data).kind, Kind::Hierarchy));
        for invalid in ["", "{}", "not json", "glTF", "glTF\u{2}\0\0\0\u{1}\0\0\0"] {
            assert!(
                matches!(fault(invalid, &data).kind, Kind::Invalid(_)),
                "{invalid}"
            );
        }
        let wrong = plain.replace(r#""scene": 0"#, r#""scene": 7"#);
        assert!(matches!(fault(&wrong, &data).kind, Kind::Invalid(_)));
        assert!(load(&plain, &data, 1e9).is_err_and(|k| matches!(k, Kind::NotFinite { .. })));
    }
}
