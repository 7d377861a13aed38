//! Hierarchies of boxes over triangles and droplets, as rows of four words that shaders read.
//!
//! A node is two rows, `(low, first)` and `(high, count)`: a leaf has `count` things from `first`; an inner node has none, and
//! its two children stand side by side at row `first`. Halved at the median along the widest axis, which is the same
//! for any order of work.

use crate::tessellate::Triangle;
use meniscus_sim::glam::Vec3;

/// Things a leaf holds at most.
const LEAF: usize = 4;

/// Rows of four words.
pub(crate) type Rows = Vec<[u32; 4]>;

fn row(v: Vec3, word: u32) -> [u32; 4] {
    [v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), word]
}

/// The hierarchy over boxes, its rows counted from `base`, and the order of the things in its leaves.
pub(crate) fn build(boxes: &[(Vec3, Vec3)], base: u32) -> (Rows, Vec<u32>) {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut rows = vec![[0; 4]; 2];
    split(boxes, &mut order, 0, 0, base, &mut rows);
    (rows, order)
}

fn split(boxes: &[(Vec3, Vec3)], order: &mut [u32], first: usize, node: usize, base: u32, rows: &mut Rows) {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (mut least, mut most) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for &k in order.iter() {
        let (a, b) = boxes[k as usize];
        (low, high) = (low.min(a), high.max(b));
        let middle = 0.5 * (a + b);
        (least, most) = (least.min(middle), most.max(middle));
    }
    let extent = most - least;
    if order.len() <= LEAF || extent.max_element() <= 0.0 {
        rows[node] = row(low, first as u32);
        rows[node + 1] = row(high, order.len() as u32);
        return;
    }
    let axis = if extent.x >= extent.y && extent.x >= extent.z {
        0
    } else if extent.y >= extent.z {
        1
    } else {
        2
    };
    let key = |k: &u32| {
        let (a, b) = boxes[*k as usize];
        a[axis] + b[axis]
    };
    let half = order.len() / 2;
    order.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
    let children = rows.len();
    rows.extend([[0; 4]; 4]);
    rows[node] = row(low, base + children as u32);
    rows[node + 1] = row(high, 0);
    let (left, right) = order.split_at_mut(half);
    split(boxes, left, first, children, base, rows);
    split(boxes, right, first + half, children + 2, base, rows);
}

/// Triangles as rows: their hierarchy counted from `base`, then themselves. Also the row of the first triangle and the greatest
/// distance from the origin. `None` without any.
pub(crate) fn mesh_rows(triangles: &[Triangle], base: u32, looks: bool) -> Option<(Rows, u32, f32)> {
    if triangles.is_empty() {
        return None;
    }
    let boxes: Vec<(Vec3, Vec3)> = triangles
        .iter()
        .map(
            |Triangle {
                 corners: [a, b, c], ..
             }| (a.min(*b).min(*c), a.max(*b).max(*c)),
        )
        .collect();
    let (mut rows, order) = build(&boxes, base);
    let first = base + rows.len() as u32;
    for k in order {
        triangles[k as usize].write(looks, &mut rows);
    }
    let radius = triangles
        .iter()
        .flat_map(|t| t.corners)
        .map(|p| p.length())
        .fold(0.0, f32::max);
    Some((rows, first, radius * (1.0 + 1e-6)))
}

/// Droplets as rows: their hierarchy, then one row each; and the row of the first. `None` without any.
pub(crate) fn droplet_rows(centres: &[Vec3], radii: &[f32]) -> Option<(Rows, u32)> {
    let balls: Vec<(Vec3, f32)> = centres
        .iter()
        .zip(radii)
        .filter(|(_, r)| **r > 0.0)
        .map(|(&c, &r)| (c, r))
        .collect();
    if balls.is_empty() {
        return None;
    }
    // A hair wider than the sphere, for the rounding of the traversal.
    let boxes: Vec<(Vec3, Vec3)> = balls
        .iter()
        .map(|&(c, r)| (c - r * 1.0001, c + r * 1.0001))
        .collect();
    let (mut rows, order) = build(&boxes, 0);
    let first = rows.len() as u32;
    rows.extend(order.iter().map(|&k| {
        let (c, r) = balls[k as usize];
        row(c, r.to_bits())
    }));
    Some((rows, first))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_thing_is_in_one_leaf_inside_all_boxes_above_it() {
        let boxes: Vec<(Vec3, Vec3)> = (0..500_u32)
            .map(|k| {
                let h = |s: u32| (k.wrapping_mul(s) % 1013) as f32 / 1013.0;
                let p = Vec3::new(h(2_654_435_761), h(40_503), h(69_621));
                (p, p + 0.01)
            })
            .collect();
        let (rows, order) = build(&boxes, 100);
        let mut seen = vec![0; boxes.len()];
        let vec = |r: [u32; 4]| Vec3::new(f32::from_bits(r[0]), f32::from_bits(r[1]), f32::from_bits(r[2]));
        let mut stack = vec![(0_usize, 0)];
        let mut deepest = 0;
        while let Some((node, depth)) = stack.pop() {
            deepest = deepest.max(depth);
            let (low, high) = (vec(rows[node]), vec(rows[node + 1]));
            let (first, count) = (rows[node][3] as usize, rows[node + 1][3] as usize);
            if count == 0 {
                let child = first - 100;
                stack.extend([(child, depth + 1), (child + 2, depth + 1)]);
                continue;
            }
            for &k in &order[first..first + count] {
                seen[k as usize] += 1;
                let (a, b) = boxes[k as usize];
                assert!(a.cmpge(low).all() && b.cmple(high).all());
            }
        }
        assert!(seen.iter().all(|&n| n == 1));
        // The shader's stack holds 40: depth + 1 at most are waiting.
        assert!(deepest <= 8, "{deepest}");
    }

    #[test]
    fn equal_places_end_in_a_leaf() {
        let boxes = vec![(Vec3::ONE, Vec3::ONE); 1000];
        assert_eq!(build(&boxes, 0).0.len(), 2);
        assert!(droplet_rows(&[Vec3::ZERO], &[0.0]).is_none());
    }
}
