//! The part of a triangle that lies below a surface.

use glam::DVec3;

/// The corners of a panel with their depths below the surface (negative above it), m.
pub(super) type Corner = (DVec3, f64);

/// Hands the submerged part of a triangle to `each`, as at most two triangles of the same sense. The surface is taken
/// as straight between the corners.
pub(super) fn submerged(corners: [Corner; 3], mut each: impl FnMut([Corner; 3])) {
    let below = corners.map(|(_, depth)| depth > 0.0);
    match below {
        [true, true, true] => each(corners),
        [false, false, false] => {}
        _ => {
            // Turned so that the first corner is the one that is alone on its side.
            let alone = match below {
                [true, false, false] | [false, true, true] => 0,
                [false, true, false] | [true, false, true] => 1,
                _ => 2,
            };
            let [a, b, c] = [0, 1, 2].map(|k| corners[(alone + k) % 3]);
            let (ab, ac) = (crossing(a, b), crossing(a, c));
            if a.1 > 0.0 {
                each([a, ab, ac]);
            } else {
                each([ab, b, c]);
                each([ab, c, ac]);
            }
        }
    }
}

/// Where the surface crosses an edge whose ends are on different sides.
fn crossing((p, d): Corner, (q, e): Corner) -> Corner {
    (p + (q - p) * (d / (d - e)), 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_below_and_above_make_up_the_triangle() {
        let corners = [
            DVec3::new(0.0, -0.3, 0.0),
            DVec3::new(1.0, 0.2, 0.1),
            DVec3::new(0.2, 0.5, 1.0),
        ];
        let face = |p: [DVec3; 3]| 0.5 * (p[1] - p[0]).cross(p[2] - p[0]);
        for level in [-1.0, -0.1, 0.0, 0.2, 0.3, 0.5, 1.0] {
            let mut sum = DVec3::ZERO;
            for sign in [1.0, -1.0] {
                submerged(corners.map(|p| (p, sign * (level - p.y))), |part| {
                    sum += face(part.map(|(p, _)| p));
                    for (p, depth) in part {
                        assert!(depth >= 0.0 && sign * (level - p.y) >= -1e-12);
                    }
                });
            }
            assert!((sum - face(corners)).length() < 1e-12, "{level}");
        }
    }
}
