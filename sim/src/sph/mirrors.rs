//! Flat walls by mirror images: water beyond a wall that does what the water before it does, backwards.
//!
//! Every sum over neighbours then sees a flat wall as a plane of symmetry of the flow. Densities, gradients and pressures
//! at the wall are those inside the water, a lattice that begins half a spacing before a wall is in balance with it, and
//! water slides along it without friction. In edges, corners and thin tanks images are mirrored again.

use super::boundary::{Boundary, Ground, Outline};
use super::cells::Cells;
use glam::{Vec2, Vec3, Vec4};

/// Reflections to either side at most, which fill the support of a kernel down to a fifth of a spacing between walls.
const MOST: i32 = 6;

/// Coordinates of a point's images along one axis, with the sign that velocities take there.
#[derive(Default)]
struct Line {
    count: usize,
    at: [(f32, f32); 4 * MOST as usize + 3],
}

impl Line {
    /// The point itself and its images beyond the walls at `low` and `high`, as far as `reach` from them.
    fn new(x: f32, low: Option<f32>, high: Option<f32>, reach: f32) -> Self {
        let mut line = Self::default();
        line.add(x, 1.0);
        match (low, high) {
            (None, None) => {}
            (Some(low), Some(high)) => {
                let width = (high - low).max(0.0);
                let inside = |at: f32| at > low - reach && at < high + reach;
                let turns = (reach / (2.0 * width).max(1e-9)).ceil().min(MOST as f32) as i32;
                for k in -turns..=turns {
                    let shift = 2.0 * width * k as f32;
                    if k != 0 && inside(x + shift) {
                        line.add(x + shift, 1.0);
                    }
                    if inside(2.0 * low - x + shift) {
                        line.add(2.0 * low - x + shift, -1.0);
                    }
                }
            }
            (Some(wall), None) | (None, Some(wall)) => {
                if (x - wall).abs() < reach {
                    line.add(2.0 * wall - x, -1.0);
                }
            }
        }
        line
    }

    fn add(&mut self, x: f32, sign: f32) {
        self.at[self.count] = (x, sign);
        self.count += 1;
    }

    fn images(&self) -> &[(f32, f32)] {
        &self.at[..self.count]
    }
}

/// Images of the particles, in the order of their own cells. Arrays that passes read neighbours from hold the values of
/// the particles first, then those of the images.
#[derive(Debug, Default)]
pub(crate) struct Mirrors {
    pub(crate) cells: Cells,
    /// Positions of the images.
    pub(crate) position: Vec<Vec4>,
    source: Vec<u32>,
    sign: Vec<Vec4>,
    spare: Vec<u32>,
    spare4: Vec<Vec4>,
}

impl Mirrors {
    /// Makes the images of `positions` that are within `reach` of the flat walls of `boundary`.
    pub(crate) fn find(&mut self, boundary: &Boundary, positions: &[Vec4], reach: f32) {
        self.position.clear();
        self.source.clear();
        self.sign.clear();
        let [x_walls, y_walls, z_walls] = boundary.mirrors();
        let near = |x: f32, walls: [Option<f32>; 2]| {
            walls.into_iter().flatten().any(|wall| (x - wall).abs() < reach)
        };
        for (k, p) in positions.iter().enumerate() {
            if !(near(p.x, x_walls) || near(p.y, y_walls) || near(p.z, z_walls)) {
                continue;
            }
            let line = |x: f32, walls: [Option<f32>; 2]| Line::new(x, walls[0], walls[1], reach);
            let (xs, ys, zs) = (line(p.x, x_walls), line(p.y, y_walls), line(p.z, z_walls));
            for (a, x) in xs.images().iter().enumerate() {
                for (b, y) in ys.images().iter().enumerate() {
                    for (c, z) in zs.images().iter().enumerate() {
                        if a + b + c > 0 {
                            self.position.push(Vec4::new(x.0, y.0, z.0, 0.0));
                            self.source.push(k as u32);
                            self.sign.push(Vec4::new(x.1, y.1, z.1, 1.0));
                        }
                    }
                }
            }
        }
        self.cells.sort(&self.position, reach);
        self.cells.reorder(&mut self.position, &mut self.spare4);
        self.cells.reorder(&mut self.sign, &mut self.spare4);
        self.cells.reorder(&mut self.source, &mut self.spare);
    }

    /// Number of images.
    pub(crate) fn len(&self) -> usize {
        self.source.len()
    }

    /// The particle behind number `j` of `n` particles and their images, and the signs of its image.
    #[inline]
    pub(crate) fn behind(&self, j: usize, n: usize) -> (usize, Vec3) {
        if j < n {
            (j, Vec3::ONE)
        } else {
            (self.source[j - n] as usize, self.sign[j - n].truncate())
        }
    }

    /// Vectors of `n` particles, then those of the images.
    pub(crate) fn extend_vectors(&self, values: &mut Vec<Vec4>, n: usize) {
        self.extend(values, n, |v, sign| v * sign);
    }

    /// Values of `n` particles, then those of the images: what `image` makes of them and of the image's signs.
    pub(crate) fn extend<T: Copy>(&self, values: &mut Vec<T>, n: usize, image: impl Fn(T, Vec4) -> T) {
        values.truncate(n);
        values.reserve(self.len());
        for (&source, sign) in self.source.iter().zip(&self.sign) {
            let value = image(values[source as usize], *sign);
            values.push(value);
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        self.cells.bytes()
            + 16 * (self.position.capacity() + self.sign.capacity() + self.spare4.capacity())
            + 4 * (self.source.capacity() + self.spare.capacity())
    }
}

/// The box in which nothing is within reach of walls or ground; it is empty where these are not flat.
pub(crate) struct Inner {
    low: Vec3,
    high: Vec3,
}

impl Inner {
    /// What is farther than `reach` from the walls and the ground of `boundary`.
    pub(crate) fn new(boundary: &Boundary, reach: f32) -> Self {
        let [x0, x1, z0, z1] = boundary.walls;
        let floor = match boundary.ground {
            _ if boundary.outline == Outline::Round => f32::INFINITY,
            Ground::None => f32::NEG_INFINITY,
            Ground::Flat(height) => height + reach,
            Ground::Heights(_) => f32::INFINITY,
        };
        let low = |present, wall: f32| if present { wall + reach } else { f32::NEG_INFINITY };
        let high = |present, wall: f32| if present { wall - reach } else { f32::INFINITY };
        Self {
            low: Vec3::new(low(x0, boundary.low.x), floor, low(z0, boundary.low.y)),
            high: Vec3::new(
                high(x1, boundary.high.x),
                f32::INFINITY,
                high(z1, boundary.high.y),
            ),
        }
    }

    #[inline(always)]
    pub(crate) fn holds(&self, p: Vec3) -> bool {
        p.cmpgt(self.low).all() && p.cmplt(self.high).all()
    }
}

/// Calls `image` with the mirror images of `p` in ground and walls nearer than `h`, and in both.
pub(super) fn mirror(boundary: &Boundary, p: Vec3, h: f32, mut image: impl FnMut(Vec3)) {
    let mut images = [p; 16];
    let mut count = 1;
    #[inline(always)]
    fn add(images: &mut [Vec3; 16], count: &mut usize, reflect: impl Fn(Vec3) -> Vec3) {
        for k in 0..*count {
            if *count + k < images.len() {
                images[*count + k] = reflect(images[k]);
            }
        }
        *count = (2 * *count).min(images.len());
    }
    if let Some((height, _)) = boundary.ground_at(p).filter(|g| p.y - g.0 < h) {
        add(&mut images, &mut count, |q| {
            Vec3::new(q.x, 2.0 * height - q.y, q.z)
        });
    }
    if boundary.outline == Outline::Round {
        let centre = 0.5 * (boundary.low + boundary.high);
        let radius = 0.5 * (boundary.high - boundary.low).min_element();
        let away = Vec2::new(p.x, p.z) - centre;
        if radius - away.length() < h && away.length() > 0.0 {
            let scale = (2.0 * radius - away.length()) / away.length();
            add(&mut images, &mut count, |q| {
                let at = centre + scale * (Vec2::new(q.x, q.z) - centre);
                Vec3::new(at.x, q.y, at.y)
            });
        }
    } else {
        let [x0, x1, z0, z1] = boundary.walls;
        for (present, wall, at) in [(x0, boundary.low.x, p.x), (x1, boundary.high.x, p.x)] {
            if present && (at - wall).abs() < h {
                add(&mut images, &mut count, |q| Vec3::new(2.0 * wall - q.x, q.y, q.z));
            }
        }
        for (present, wall, at) in [(z0, boundary.low.y, p.z), (z1, boundary.high.y, p.z)] {
            if present && (at - wall).abs() < h {
                add(&mut images, &mut count, |q| Vec3::new(q.x, q.y, 2.0 * wall - q.z));
            }
        }
    }
    for &p in &images[1..count] {
        image(p);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_corner_has_seven_images_and_a_thin_tank_is_filled() {
        let mut mirrors = Mirrors::default();
        let tank = Boundary::tank(Vec2::ZERO, Vec2::splat(2.0), 0.0);
        let p = Vec4::new(0.05, 0.05, 0.05, 0.0);
        mirrors.find(&tank, &[p], 0.2);
        assert_eq!(mirrors.len(), 7);
        let opposite = mirrors.position.iter().position(|q| *q == -p).unwrap();
        assert_eq!(mirrors.behind(1 + opposite, 1), (0, Vec3::NEG_ONE));
        let mut v = vec![Vec4::new(1.0, 2.0, 3.0, 0.0)];
        mirrors.extend_vectors(&mut v, 1);
        assert_eq!(v[1 + opposite], -v[0]);
        // One layer between walls a spacing apart: images make a lattice of it.
        let thin = Boundary::tank(Vec2::ZERO, Vec2::new(2.0, 0.1), -9.0);
        mirrors.find(&thin, &[Vec4::new(1.0, 0.0, 0.05, 0.0)], 0.25);
        let mut at: Vec<f32> = mirrors.position.iter().map(|p| p.z).collect();
        at.sort_by(f32::total_cmp);
        let expected = [-0.15, -0.05, 0.15, 0.25];
        assert!(
            at.len() == 4 && at.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6),
            "{at:?}"
        );
    }
}
