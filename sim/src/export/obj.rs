//! Wavefront OBJ.

use super::surface::Surface;
use std::io::{self, Write};

/// Writes `surface` as text: positions, normals, triangles.
pub(super) fn write(surface: &Surface, out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "# Meniscus water surface, metres, +Y up")?;
    writeln!(out, "o water")?;
    for p in &surface.positions {
        writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for n in &surface.normals {
        writeln!(out, "vn {:.5} {:.5} {:.5}", n.x, n.y, n.z)?;
    }
    for [a, b, c] in &surface.triangles {
        // Numbers begin at 1.
        writeln!(out, "f {0}//{0} {1}//{1} {2}//{2}", a + 1, b + 1, c + 1)?;
    }
    Ok(())
}
