//! Pictures of the surroundings that are not panoramas yet: cubes, and landscapes hung up around the water.

use super::Panorama;
use super::description::SkyLayout;
use glam::{UVec2, Vec2, Vec3};
use rayon::prelude::*;
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Widest panorama that is made of other pictures, pixels.
const WIDEST: u32 = 8192;

/// Pixels, row-major from the top left.
pub(super) struct Picture {
    pub(super) size: UVec2,
    pub(super) pixels: Vec<Vec3>,
}

/// What a layout needs of the shape of a picture.
pub(super) fn shape(layout: SkyLayout) -> &'static str {
    match layout {
        SkyLayout::Panorama => "a whole sky is twice as wide as high",
        SkyLayout::Cube => {
            "the six faces of a cube are a cross of 4 by 3 or 3 by 4 squares, or a row or column of six"
        }
        SkyLayout::Horizon => "a landscape has any shape, and at least one pixel",
    }
}

/// The panorama that shows the picture in that layout; `None` if its shape is not one of the layout.
pub(super) fn panorama(picture: Picture, layout: SkyLayout) -> Option<Panorama> {
    if picture.size.min_element() == 0 {
        return None;
    }
    match layout {
        SkyLayout::Panorama => (picture.size.x == 2 * picture.size.y).then_some(Panorama {
            size: picture.size,
            pixels: picture.pixels,
        }),
        SkyLayout::Cube => {
            let cube = Cube::new(&picture)?;
            Some(render(4 * cube.side, |d| cube.look(d)))
        }
        // A quarter of the horizon shows the picture once.
        SkyLayout::Horizon => Some(render(4 * picture.size.x, |d| landscape(&picture, d))),
    }
}

/// A panorama about `width` pixels wide of what is seen in every direction.
fn render(width: u32, look: impl Fn(Vec3) -> Vec3 + Sync) -> Panorama {
    let height = (width.clamp(8, WIDEST) / 2).max(4);
    let size = UVec2::new(2 * height, height);
    let count = size.x as usize * size.y as usize;
    let pixels = (0..count)
        .into_par_iter()
        .map(|k| {
            let (i, j) = (k % size.x as usize, k / size.x as usize);
            let around = (i as f32 + 0.5) / size.x as f32 * TAU;
            let up = FRAC_PI_2 - (j as f32 + 0.5) / size.y as f32 * PI;
            look(Vec3::new(
                up.cos() * around.sin(),
                up.sin(),
                -up.cos() * around.cos(),
            ))
        })
        .collect();
    Panorama { size, pixels }
}

impl Picture {
    /// Bilinear between the middles of pixels; `p` in pixels from the top left corner of the picture. Kept within the
    /// rectangle of `size` pixels at `corner`, so that neighbours in the file do not bleed in.
    fn sample(&self, p: Vec2, corner: UVec2, size: UVec2) -> Vec3 {
        let last = size.as_vec2() - Vec2::ONE;
        let q = (p - corner.as_vec2() - Vec2::splat(0.5)).clamp(Vec2::ZERO, last);
        let cell = q.floor();
        let f = q - cell;
        let at = |dx: u32, dy: u32| {
            let x = (cell.x as u32 + dx).min(size.x - 1) + corner.x;
            let y = (cell.y as u32 + dy).min(size.y - 1) + corner.y;
            self.pixels[y as usize * self.size.x as usize + x as usize]
        };
        at(0, 0)
            .lerp(at(1, 0), f.x)
            .lerp(at(0, 1).lerp(at(1, 1), f.x), f.y)
    }
}

/// The inward faces of a cube.
struct Cube<'a> {
    picture: &'a Picture,
    side: u32,
    /// Corner of each face in the picture: +X, −X, +Y, −Y, +Z, −Z.
    corners: [UVec2; 6],
    /// Whether the face towards +Z stands upside down, as it does below a cross that is higher than wide.
    turned: bool,
}

impl<'a> Cube<'a> {
    fn new(picture: &'a Picture) -> Option<Self> {
        let UVec2 { x, y } = picture.size;
        // In squares from the top left. A cross has −Z in its middle, with +Y above and −Y below it.
        let (side, squares, turned) = if 3 * x == 4 * y && x % 4 == 0 {
            (x / 4, [(2, 1), (0, 1), (1, 0), (1, 2), (3, 1), (1, 1)], false)
        } else if 4 * x == 3 * y && x % 3 == 0 {
            (x / 3, [(2, 1), (0, 1), (1, 0), (1, 2), (1, 3), (1, 1)], true)
        } else if x == 6 * y {
            (y, [(0, 0), (1, 0), (2, 0), (3, 0), (4, 0), (5, 0)], false)
        } else if y == 6 * x {
            (x, [(0, 0), (0, 1), (0, 2), (0, 3), (0, 4), (0, 5)], false)
        } else {
            return None;
        };
        Some(Self {
            picture,
            side,
            corners: squares.map(|(i, j)| UVec2::new(i, j) * side),
            turned,
        })
    }

    /// What is seen from the middle of the cube.
    fn look(&self, d: Vec3) -> Vec3 {
        let a = d.abs();
        // Right and down on the face, as it is seen from inside with −Z ahead and +Y up.
        let (face, right, down, depth) = if a.x >= a.y && a.x >= a.z {
            (usize::from(d.x < 0.0), d.z * d.x.signum(), -d.y, a.x)
        } else if a.y >= a.z {
            (2 + usize::from(d.y < 0.0), d.x, -d.z * d.y.signum(), a.y)
        } else {
            (4 + usize::from(d.z < 0.0), -d.x * d.z.signum(), -d.y, a.z)
        };
        let mut at = Vec2::new(right, down) / depth;
        if self.turned && face == 4 {
            at = -at;
        }
        let corner = self.corners[face];
        let p = corner.as_vec2() + (0.5 * (at + Vec2::ONE)) * self.side as f32;
        self.picture.sample(p, corner, UVec2::splat(self.side))
    }
}

/// A landscape that stands on the horizon, once on each of four walls of a square room. Every other wall shows it
/// mirrored, so that it has no seams. Its top row goes on to the zenith, its bottom row to the nadir.
fn landscape(picture: &Picture, d: Vec3) -> Vec3 {
    let turn = d.x.atan2(-d.z).rem_euclid(TAU) / FRAC_PI_2 + 0.5;
    let wall = turn.floor();
    let off = (turn - wall - 0.5) * FRAC_PI_2;
    let mirrored = wall as u32 % 2 == 1;
    // On the wall: −1 to 1 across, and as high above the horizon as it is wide.
    let across = if mirrored { -off.tan() } else { off.tan() };
    let level = d.x.hypot(d.z).max(1e-9);
    let up = d.y / (level * off.cos());
    let width = picture.size.x as f32;
    let p = Vec2::new(
        0.5 * (across + 1.0) * width,
        picture.size.y as f32 - 0.5 * up * width,
    );
    picture.sample(p, UVec2::ZERO, picture.size)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(panorama: &Panorama, d: Vec3) -> Vec3 {
        let u = d.x.atan2(-d.z).rem_euclid(TAU) / TAU;
        let v = 0.5 - d.normalize().y.asin() / PI;
        let i = (u * panorama.size.x as f32) as usize % panorama.size.x as usize;
        let j = ((v * panorama.size.y as f32) as usize).min(panorama.size.y as usize - 1);
        panorama.pixels[j * panorama.size.x as usize + i]
    }

    /// A picture that tells the squares it is made of apart, and up from down within each.
    fn squares(columns: u32, rows: u32, side: u32) -> Picture {
        let size = UVec2::new(columns, rows) * side;
        let pixels = (0..size.x * size.y)
            .map(|k| {
                let (x, y) = (k % size.x, k / size.x);
                Vec3::new(
                    (x / side) as f32,
                    (y / side) as f32,
                    (y % side) as f32 / side as f32,
                )
            })
            .collect();
        Picture { size, pixels }
    }

    #[test]
    fn every_face_of_a_cube_is_seen_where_it_stands() {
        let faces = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
        let cross = [(2, 1), (0, 1), (1, 0), (1, 2), (3, 1), (1, 1)];
        let upright = [(2, 1), (0, 1), (1, 0), (1, 2), (1, 3), (1, 1)];
        let row: [(u32, u32); 6] = std::array::from_fn(|k| (k as u32, 0));
        let column: [(u32, u32); 6] = std::array::from_fn(|k| (0, k as u32));
        for (columns, rows, squares_of) in [(4, 3, cross), (3, 4, upright), (6, 1, row), (1, 6, column)] {
            let picture = squares(columns, rows, 16);
            let sky = panorama(picture, SkyLayout::Cube).unwrap();
            for (d, (i, j)) in faces.into_iter().zip(squares_of) {
                let found = seen(&sky, d + Vec3::splat(0.05));
                assert_eq!(
                    (found.x, found.y),
                    (i as f32, j as f32),
                    "{d} of {columns} x {rows}"
                );
            }
            // Higher is nearer to the top of a side, which in an upright cross stands on its head behind.
            for d in [Vec3::X, Vec3::NEG_X, Vec3::NEG_Z, Vec3::Z] {
                let (up, down) = (seen(&sky, d + 0.5 * Vec3::Y).z, seen(&sky, d - 0.5 * Vec3::Y).z);
                assert_eq!(
                    up < down,
                    !(columns == 3 && d == Vec3::Z),
                    "{d} of {columns} x {rows}"
                );
            }
        }
        for (columns, rows) in [(5, 3), (2, 2), (1, 1)] {
            assert!(panorama(squares(columns, rows, 8), SkyLayout::Cube).is_none());
        }
    }

    /// Pixels of a landscape of any shape are found where the closed form has them.
    #[test]
    fn a_landscape_stands_on_the_horizon_of_every_wall() {
        for size in [UVec2::new(40, 20), UVec2::new(37, 11), UVec2::new(10, 30)] {
            let pixels = (0..size.x * size.y)
                .map(|k| Vec3::new((k % size.x) as f32 + 0.5, (k / size.x) as f32 + 0.5, 1.0))
                .collect();
            let sky = panorama(Picture { size, pixels }, SkyLayout::Horizon).unwrap();
            let (w, h) = (size.x as f32, size.y as f32);
            for (across, up) in [(0.0, 0.3), (0.6, 0.2), (-0.7, 0.4)] {
                // North: column to the right, row up from the bottom.
                let found = seen(&sky, Vec3::new(across, up, -1.0));
                let truth = Vec2::new(0.5 * (across + 1.0) * w, (h - 0.5 * up * w).max(0.5));
                // A panorama of four widths has pixels of up to π/2 of the picture's.
                assert!(
                    (found.x - truth.x).abs() < 1.0 && (found.y - truth.y).abs() < 1.0,
                    "{found} {truth}"
                );
                // East: mirrored.
                let found = seen(&sky, Vec3::new(1.0, up, across));
                assert!((found.x - (w - truth.x)).abs() < 1.0, "{found} {truth}");
            }
        }
    }
}
