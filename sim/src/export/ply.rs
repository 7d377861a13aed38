//! Stanford PLY, binary little endian.

use super::surface::Surface;
use std::io::{self, Write};

/// Writes `surface`: positions and normals a vertex, triangles.
pub(super) fn write(surface: &Surface, out: &mut impl Write) -> io::Result<()> {
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment Meniscus water surface, metres, +Y up\n\
         element vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property float nx\nproperty float ny\nproperty float nz\n\
         element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        surface.positions.len(),
        surface.triangles.len(),
    )?;
    for (p, n) in surface.positions.iter().zip(&surface.normals) {
        for value in p.to_array().into_iter().chain(n.to_array()) {
            out.write_all(&value.to_le_bytes())?;
        }
    }
    for triangle in &surface.triangles {
        out.write_all(&[3])?;
        for index in triangle {
            out.write_all(&index.to_le_bytes())?;
        }
    }
    Ok(())
}
