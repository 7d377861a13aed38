//! Walls from what a scene contains: edges of the domain, the waterline of the terrain, outlines of fixed objects.

use super::walls::Segment;
use crate::grid::GridSpec;
use crate::mesh::TriangleMesh;
use crate::scene::description::{Boundary, Edge};
use glam::{DVec2, DVec3, Quat, Vec3};

/// The rectangle of water of a grid: a wall stands half a spacing beyond the outermost samples, as everywhere in this
/// crate, so that every sample owns a whole cell. A periodic axis has the same length.
pub(super) fn rectangle(spec: &GridSpec) -> (DVec2, DVec2) {
    let h = f64::from(spec.spacing);
    let low = spec.origin.as_dvec2() - 0.5 * h;
    (low, low + h * spec.size.as_dvec2())
}

/// The walls along the edges of the domain. They go on far beyond edges that are open.
pub(super) fn edges(spec: &GridSpec, boundary: &Boundary) -> Vec<Segment> {
    let (low, high) = rectangle(spec);
    let far = high - low;
    let stretch = |edge: Edge, length: f64| if edge == Edge::Open { length } else { 0.0 };
    let (x0, x1) = (
        low.x - stretch(boundary.x_min, far.x),
        high.x + stretch(boundary.x_max, far.x),
    );
    let (z0, z1) = (
        low.y - stretch(boundary.z_min, far.y),
        high.y + stretch(boundary.z_max, far.y),
    );
    let wall = |edge: Edge, a: DVec2, b: DVec2, side: DVec2| {
        (edge == Edge::Wall)
            .then(|| Segment::towards(a, b, side))
            .flatten()
    };
    [
        wall(
            boundary.x_min,
            DVec2::new(low.x, z0),
            DVec2::new(low.x, z1),
            DVec2::X,
        ),
        wall(
            boundary.x_max,
            DVec2::new(high.x, z0),
            DVec2::new(high.x, z1),
            -DVec2::X,
        ),
        wall(
            boundary.z_min,
            DVec2::new(x0, low.y),
            DVec2::new(x1, low.y),
            DVec2::Y,
        ),
        wall(
            boundary.z_max,
            DVec2::new(x0, high.y),
            DVec2::new(x1, high.y),
            -DVec2::Y,
        ),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// The waterline of the depth at rest by marching squares: walls between samples with water (`depth > 0`) and dry
/// ones, where the depth interpolated along the cell's sides is 0. A saddle is cut as the mean of its corners says. The
/// samples at the edge of the domain are repeated half a spacing outwards, so that the line reaches the edge.
pub(super) fn waterline(spec: &GridSpec, depth: &[f32], wrap: [bool; 2]) -> Vec<Segment> {
    let lines = |axis: usize, n: usize| -> Vec<(usize, f64)> {
        let (o, h) = (f64::from(spec.origin[axis]), f64::from(spec.spacing));
        let at = |k: usize| o + h * k as f64;
        let inner = (0..n).map(|k| (k, at(k)));
        if wrap[axis] {
            inner.chain([(0, at(n))]).collect()
        } else {
            let (first, last) = ((0, o - 0.5 * h), (n - 1, at(n - 1) + 0.5 * h));
            [first].into_iter().chain(inner).chain([last]).collect()
        }
    };
    let (columns, rows) = (lines(0, spec.width()), lines(1, spec.height()));
    let mut out = Vec::new();
    for z in rows.windows(2) {
        for x in columns.windows(2) {
            let corner = |i: usize, j: usize| {
                let ((column, px), (row, pz)) = (x[i], z[j]);
                (DVec2::new(px, pz), f64::from(depth[row * spec.width() + column]))
            };
            // In the order around the cell.
            cell(
                &[corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)],
                &mut out,
            );
        }
    }
    out
}

/// Where the depth between two corners is 0. The same number whichever comes first, so that lines of neighbouring
/// cells meet.
fn crossing(p: (DVec2, f64), q: (DVec2, f64)) -> DVec2 {
    let ((a, da), (b, db)) = if (p.0.x, p.0.y) <= (q.0.x, q.0.y) {
        (p, q)
    } else {
        (q, p)
    };
    a + da / (da - db) * (b - a)
}

/// The walls of one cell.
fn cell(corners: &[(DVec2, f64); 4], out: &mut Vec<Segment>) {
    let wet = |k: usize| corners[k % 4].1 > 0.0;
    let changes: Vec<usize> = (0..4).filter(|&k| wet(k) != wet(k + 1)).collect();
    let at = |k: usize| crossing(corners[k % 4], corners[(k + 1) % 4]);
    match changes[..] {
        [a, b] => {
            // Corner a + 1 is on the other side than corner a; all up to b are as it is.
            let (p, q) = (at(a), at(b));
            let mut side = DVec2::ZERO;
            for (corner, depth) in corners {
                side += (*corner - 0.5 * (p + q)) * if *depth > 0.0 { 1.0 } else { -1.0 };
            }
            out.extend(Segment::towards(p, q, side));
        }
        [_, _, _, _] => {
            let mean_is_wet = corners.iter().map(|c| c.1).sum::<f64>() > 0.0;
            // The corners that are cut off are those unlike the middle.
            for k in (0..4).filter(|&k| wet(k) != mean_is_wet) {
                let (p, q) = (at(k + 3), at(k));
                let inwards = corners[k].0 - 0.5 * (p + q);
                out.extend(Segment::towards(
                    p,
                    q,
                    if mean_is_wet { -inwards } else { inwards },
                ));
            }
        }
        _ => {}
    }
}

/// The outline of a mesh at a level: one wall for each triangle that crosses it, with the water outside.
pub(super) fn outline(mesh: &TriangleMesh, position: Vec3, rotation: Quat, level: f64) -> Vec<Segment> {
    let place = |v: u32| {
        mesh.positions
            .get(v as usize)
            .map(|&p| (position + rotation * p).as_dvec3())
    };
    let mut out = Vec::new();
    for triangle in &mesh.triangles {
        let [Some(a), Some(b), Some(c)] = triangle.map(place) else {
            continue;
        };
        let corners = [a, b, c].map(|p| (DVec2::new(p.x, p.z), level - p.y));
        let below = |k: usize| corners[k % 3].1 > 0.0;
        let cuts: Vec<DVec2> = (0..3)
            .filter(|&k| below(k) != below(k + 1))
            .map(|k| crossing(corners[k], corners[(k + 1) % 3]))
            .collect();
        if let [p, q] = cuts[..] {
            let normal: DVec3 = (b - a).cross(c - a);
            out.extend(Segment::towards(p, q, DVec2::new(normal.x, normal.z)));
        }
    }
    out
}

/// Marks the samples inside a closed outline, by the even-odd rule along rows.
pub(super) fn fill(spec: &GridSpec, outline: &[Segment], inside: &mut [bool]) {
    let (w, h) = (spec.width(), spec.height());
    let spacing = f64::from(spec.spacing);
    let origin = spec.origin.as_dvec2();
    let mut crossings: Vec<Vec<f64>> = vec![Vec::new(); h];
    for s in outline {
        let (low, high) = if s.a.y < s.b.y { (s.a, s.b) } else { (s.b, s.a) };
        let row = |z: f64| ((z - origin.y) / spacing).ceil().clamp(0.0, h as f64) as usize;
        // Half open, so that a row through a corner counts it once.
        for j in row(low.y)..row(high.y) {
            let z = origin.y + spacing * j as f64;
            crossings[j].push(low.x + (z - low.y) / (high.y - low.y) * (high.x - low.x));
        }
    }
    for (j, list) in crossings.iter_mut().enumerate() {
        list.sort_by(f64::total_cmp);
        for pair in list.chunks_exact(2) {
            let column = |x: f64| ((x - origin.x) / spacing).ceil().clamp(0.0, w as f64) as usize;
            for i in column(pair[0])..column(pair[1]) {
                inside[j * w + i] = true;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::walls::Walls;
    use super::*;
    use glam::{UVec2, Vec2};

    #[test]
    fn a_round_pond_has_a_closed_round_shore_with_the_water_inside() {
        let spec = GridSpec::new(Vec2::new(-3.0, 2.0), 0.25, UVec2::new(50, 44)).unwrap();
        let centre = Vec2::new(3.1, 7.2);
        let depth: Vec<f32> = (0..spec.len())
            .map(|k| 4.0 - (spec.position(k % 50, k / 50) - centre).length())
            .collect();
        let shore = waterline(&spec, &depth, [false; 2]);
        let mut length = 0.0;
        for s in &shore {
            length += (s.b - s.a).length();
            assert!((s.a - centre.as_dvec2()).length() - 4.0 < 1e-6);
            assert!(s.normal.dot(centre.as_dvec2() - s.a) > 3.8, "{s:?}");
            for end in [s.a, s.b] {
                let meeting = shore.iter().filter(|t| t.a == end || t.b == end).count();
                assert_eq!(meeting, 2, "the line is closed");
            }
        }
        assert!(
            (length / (8.0 * std::f64::consts::PI) - 1.0).abs() < 2e-3,
            "{length}"
        );
        let (low, high) = rectangle(&spec);
        let walls = Walls::new(shore, low, high);
        let mut told = 0;
        for k in 51..spec.len() - 51 {
            let p = spec.position(k % 50, k / 50).as_dvec2();
            for n in [k, k - 1, k + 50, k + 51, k - 49]
                .into_iter()
                .filter(|&n| depth[n] > 0.0)
            {
                let water = spec.position(n % 50, n / 50).as_dvec2();
                if (water - p).length() < 0.4 {
                    assert_eq!(
                        walls.is_open(p, water),
                        depth[k] > 0.0,
                        "{p} {water} {}",
                        depth[k]
                    );
                    told += usize::from(depth[k] <= 0.0);
                }
            }
        }
        assert!(told > 50);
    }

    #[test]
    fn a_shore_reaches_the_edge_of_the_domain() {
        let spec = GridSpec::new(Vec2::ZERO, 1.0, UVec2::new(8, 5)).unwrap();
        let depth: Vec<f32> = (0..40).map(|k| (k % 8) as f32 - 2.5).collect();
        let shore = waterline(&spec, &depth, [false; 2]);
        let reach = |f: fn(f64, f64) -> f64, s: f64| shore.iter().map(|w| f(w.a.y, w.b.y)).fold(s, f);
        assert_eq!((reach(f64::min, 9.0), reach(f64::max, -9.0)), (-0.5, 4.5));
        assert!(
            shore
                .iter()
                .all(|w| w.a.x == 2.5 && w.b.x == 2.5 && w.normal == DVec2::X)
        );
    }

    #[test]
    fn an_outline_is_where_the_mesh_crosses_the_level() {
        let mesh = TriangleMesh::cuboid(Vec3::new(4.0, 2.0, 2.0));
        let walls = outline(&mesh, Vec3::new(5.0, 0.3, 4.0), Quat::from_rotation_y(0.3), 0.0);
        let length: f64 = walls.iter().map(|s| (s.b - s.a).length()).sum();
        assert!((length - 12.0).abs() < 1e-5, "{length}");
        assert!(walls.iter().all(|s| s.front(DVec2::new(5.0, 4.0)) < -0.9));
        assert!(outline(&mesh, Vec3::new(5.0, 3.0, 4.0), Quat::IDENTITY, 0.0).is_empty());
        let spec = GridSpec::new(Vec2::ZERO, 0.05, UVec2::new(200, 160)).unwrap();
        let mut inside = vec![false; spec.len()];
        fill(&spec, &walls, &mut inside);
        let area = inside.iter().filter(|&&x| x).count() as f64 * 0.0025;
        assert!((area - 8.0).abs() < 0.1, "{area}");
    }
}
