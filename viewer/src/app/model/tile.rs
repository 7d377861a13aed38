//! The reference tile: the middle of the picture, drawn by another renderer while the view rests.

use meniscus_sim::glam::{UVec2, Vec3};
use meniscus_sim::render::{Image, View};

/// Sides of the picture to sides of the tile.
const PARTS: u32 = 3;

/// The view of the middle: its pixels are those of the whole picture.
pub fn view(whole: &View) -> View {
    let part = |n: u32| {
        let least = (n / PARTS).max(1);
        // As many pixels are left over on one side as on the other.
        least + (n - least) % 2
    };
    let size = UVec2::new(part(whole.size.x), part(whole.size.y));
    let share = size.y as f32 / whole.size.y as f32;
    View {
        size,
        vertical_fov: 2.0 * ((0.5 * whole.vertical_fov).tan() * share).atan(),
        ..whole.clone()
    }
}

/// The middle of a picture.
pub fn cut(image: &Image, size: UVec2) -> Image {
    let size = size.min(image.size);
    let low = (image.size - size) / 2;
    let row = |y: u32| {
        let start = ((low.y + y) * image.size.x + low.x) as usize;
        image
            .pixels
            .get(start..start + size.x as usize)
            .unwrap_or_default()
    };
    let pixels: Vec<Vec3> = (0..size.y).flat_map(row).copied().collect();
    Image { size, pixels }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meniscus_sim::stage::Lens;

    #[test]
    fn rays_of_the_tile_are_those_of_the_middle() {
        for size in [UVec2::new(640, 361), UVec2::new(99, 50), UVec2::new(2, 1)] {
            let whole = View {
                position: Vec3::new(1.0, 2.0, 3.0),
                target: Vec3::ZERO,
                up: Vec3::Y,
                vertical_fov: 1.1,
                size,
                samples: 1,
                pass: 0,
            };
            let part = view(&whole);
            let low = (whole.size - part.size) / 2;
            assert_eq!(2 * low + part.size, whole.size);
            let ray = |view: &View, pixel: UVec2| {
                let lens = Lens::new(view).unwrap();
                let at = (pixel.as_dvec2() + 0.5) / view.size.as_dvec2();
                (lens.forward + (2.0 * at.x - 1.0) * lens.right + (1.0 - 2.0 * at.y) * lens.up).normalize()
            };
            for pixel in [UVec2::ZERO, part.size / 2, part.size - 1] {
                let apart = (ray(&part, pixel) - ray(&whole, low + pixel)).length();
                assert!(apart < 2e-7, "{size} {pixel}: {apart}");
            }
        }
    }

    #[test]
    fn the_middle_is_cut_out() {
        let mut image = Image::new(UVec2::new(5, 3));
        for (k, pixel) in image.pixels.iter_mut().enumerate() {
            pixel.x = k as f32;
        }
        let middle = cut(&image, UVec2::new(3, 1));
        let values: Vec<f32> = middle.pixels.iter().map(|p| p.x).collect();
        assert_eq!((middle.size, values), (UVec2::new(3, 1), vec![6.0, 7.0, 8.0]));
    }
}
