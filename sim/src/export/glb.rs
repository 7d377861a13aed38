//! Binary glTF 2.0.

use super::surface::Surface;
use glam::Vec3;
use std::io::{self, Write};

/// Bytes of the file header and of a chunk header.
const FILE_HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;

/// Component types and buffer targets of the standard.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Writes `surface` as one mesh of one node. A surface without water becomes a node without a mesh, since the standard
/// has no empty accessors.
pub(super) fn write(surface: &Surface, out: &mut impl Write) -> io::Result<()> {
    let vertices = 12 * surface.positions.len();
    let indices = 12 * surface.triangles.len();
    let binary = 2 * vertices + indices;
    let mut json = document(surface, vertices, indices);
    json.extend(std::iter::repeat_n(
        ' ',
        json.len().next_multiple_of(4) - json.len(),
    ));
    let binary_chunk = if binary > 0 { CHUNK_HEADER + binary } else { 0 };
    let total = FILE_HEADER + CHUNK_HEADER + json.len() + binary_chunk;
    let length = |n: usize| {
        u32::try_from(n).map_err(|_| {
            io::Error::new(
                io::ErrorKind::FileTooLarge,
                "a surface of more than 4 GiB does not fit a GLB file; use ply",
            )
        })
    };
    out.write_all(b"glTF")?;
    for word in [2, length(total)?, length(json.len())?] {
        out.write_all(&word.to_le_bytes())?;
    }
    out.write_all(b"JSON")?;
    out.write_all(json.as_bytes())?;
    if binary == 0 {
        return Ok(());
    }
    out.write_all(&length(binary)?.to_le_bytes())?;
    out.write_all(b"BIN\0")?;
    for vector in surface.positions.iter().chain(&surface.normals) {
        for value in vector.to_array() {
            out.write_all(&value.to_le_bytes())?;
        }
    }
    for index in surface.triangles.iter().flatten() {
        out.write_all(&index.to_le_bytes())?;
    }
    Ok(())
}

/// The JSON document for a surface whose vertex arrays and indices take so many bytes.
fn document(surface: &Surface, vertices: usize, indices: usize) -> String {
    let head = r#"{"asset":{"version":"2.0","generator":"Meniscus"},"scene":0,"scenes":[{"nodes":[0]}]"#;
    if surface.triangles.is_empty() {
        return format!(r#"{head},"nodes":[{{"name":"water"}}]}}"#);
    }
    let bounds = surface
        .positions
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &p| {
            (low.min(p), high.max(p))
        });
    let vector = |v: Vec3| format!("[{},{},{}]", v.x, v.y, v.z);
    let view = |offset: usize, length: usize, target: u32| {
        format!(r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{length},"target":{target}}}"#)
    };
    let count = surface.positions.len();
    [
        head.to_owned(),
        r#""nodes":[{"name":"water","mesh":0}]"#.to_owned(),
        r#""meshes":[{"name":"water","primitives":[{"attributes":{"POSITION":0,"NORMAL":1},"indices":2,"material":0}]}]"#
            .to_owned(),
        r#""materials":[{"name":"water","pbrMetallicRoughness":{"baseColorFactor":[0.02,0.08,0.1,1],"metallicFactor":0,"roughnessFactor":0.05}}]"#
            .to_owned(),
        format!(r#""buffers":[{{"byteLength":{}}}]"#, 2 * vertices + indices),
        format!(
            r#""bufferViews":[{},{},{}]"#,
            view(0, vertices, ARRAY_BUFFER),
            view(vertices, vertices, ARRAY_BUFFER),
            view(2 * vertices, indices, ELEMENT_ARRAY_BUFFER),
        ),
        format!(
            r#""accessors":[{{"bufferView":0,"componentType":{FLOAT},"count":{count},"type":"VEC3","min":{},"max":{}}},{{"bufferView":1,"componentType":{FLOAT},"count":{count},"type":"VEC3"}},{{"bufferView":2,"componentType":{UNSIGNED_INT},"count":{},"type":"SCALAR"}}]}}"#,
            vector(bounds.0),
            vector(bounds.1),
            3 * surface.triangles.len(),
        ),
    ]
    .join(",")
}
