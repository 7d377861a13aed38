//! A tetrahedron in many forms, and what is refused.

use super::*;
use crate::mesh::DEFAULT_COLOR;
use crate::mesh::closed::assert_closed;
use crate::scene::Fault;

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

/// A tetrahedron whose texture coordinates are those of a picture of two texels.
fn textured(uri: &str, more: &str) -> String {
    let materials = format!(
        r#", "materials": [{{ "pbrMetallicRoughness": {{ "baseColorFactor": [1, 0.5, 1, 1], "baseColorTexture": {{ "index": 0 }} }} }}],
        "textures": [{{ "source": 0, "sampler": 0 }}], "samplers": [{{ "wrapS": 33071, "wrapT": 33648 }}],
        "images": [{{ "uri": "{uri}" }}] {more}"#
    );
    // Positions serve as coordinates too: (x, y) of the corners.
    let text = text(NODE, r#", "material": 0"#, &materials);
    text.replace(
        r#""POSITION": 0 }"#,
        r#""POSITION": 0, "TEXCOORD_0": 2 }"#,
    )
    .replace(
        r#""SCALAR", "count": 12 }"#,
        r#""SCALAR", "count": 12 }, { "bufferView": 2, "componentType": 5126, "type": "VEC2", "count": 4 }"#,
    )
    .replace(
        r#""byteOffset": 48, "byteLength": 24 }"#,
        r#""byteOffset": 48, "byteLength": 24 }, { "buffer": 0, "byteOffset": 0, "byteLength": 48, "byteStride": 12 }"#,
    )
}

#[test]
fn base_colours_come_from_textures() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("the mesh.bin"), buffer(&CORNERS, &FACES)).unwrap();
    let picture = image::RgbImage::from_fn(2, 1, |x, _| image::Rgb([if x == 0 { 255 } else { 0 }; 3]));
    picture.save(dir.path().join("two texels.png")).unwrap();
    let parse = |text: &str| parse(text.as_bytes(), Some(dir.path()), 1.0);
    let mesh = parse(&textured("two%20texels.png", "")).unwrap();
    mesh.validate().unwrap();
    assert_eq!((mesh.materials.len(), mesh.material_of.len()), (1, 4));
    let texture = mesh.materials[0].texture.as_ref().unwrap();
    assert_eq!(
        (texture.size, &texture.texels[..]),
        (glam::UVec2::new(2, 1), &[[255; 3], [0; 3]][..])
    );
    assert_eq!(
        texture.wrap,
        [crate::mesh::Wrap::Clamp, crate::mesh::Wrap::Mirror]
    );
    // What is drawn where the texture cannot be is its mean.
    assert_eq!(mesh.base_color, Vec3::new(0.5, 0.25, 0.5));
    assert_eq!(
        mesh.materials[0].color_at(glam::Vec2::ZERO),
        Vec3::new(1.0, 0.5, 1.0)
    );
    assert_eq!(mesh.materials[0].color_at(glam::Vec2::X), Vec3::ZERO);

    let reason = |text: &str| match parse(text).unwrap_err() {
        Kind::Texture { index: 0, reason } => reason,
        other => panic!("{other:?}"),
    };
    assert!(reason(&textured("gone.png", "")).contains("no such file"));
    assert!(reason(&textured("the%20mesh.bin", "")).contains("cannot be decoded"));
    assert!(reason(&textured("https://x/y.png", "")).contains("not the name of a file"));
    let needs = r#", "extensionsRequired": ["KHR_texture_basisu"]"#;
    assert!(
        matches!(parse(&textured("two%20texels.png", needs)), Err(Kind::UnsupportedExtension(name)) if name.contains("basisu"))
    );
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
    assert!(matches!(fault(&draco, &data).kind, Kind::UnsupportedExtension(name) if name.contains("draco")));
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
    let stray = plain.replace(r#""POSITION": 0"#, r#""POSITION": 7"#);
    assert!(matches!(fault(&stray, &data).kind, Kind::Invalid(reason) if reason.contains("accessor")));
    let wrong = plain.replace(r#""scene": 0"#, r#""scene": 7"#);
    assert!(matches!(fault(&wrong, &data).kind, Kind::Invalid(_)));
    assert!(load(&plain, &data, 1e9).is_err_and(|k| matches!(k, Kind::NotFinite { .. })));
}
