//! What meshes look like: base colours and pictures of them.

use glam::{UVec2, Vec2, Vec3};

/// The look of some triangles of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Linear-light base colour, 0 to 1; a factor on the texture where there is one.
    pub color: Vec3,
    /// A picture of the base colour, read at the mesh's texture coordinates.
    pub texture: Option<Texture>,
    /// Gloss over the base colour; `None` for a matt one.
    pub shine: Option<Shine>,
}

impl Material {
    /// Base colour at texture coordinates, linear light.
    pub fn color_at(&self, at: Vec2) -> Vec3 {
        match &self.texture {
            Some(texture) => self.color * texture.sample(at),
            None => self.color,
        }
    }

    /// Mean base colour over the texture, linear light.
    pub fn mean(&self) -> Vec3 {
        let Some(texture) = &self.texture else {
            return self.color;
        };
        let sum: Vec3 = texture.texels.iter().map(|t| linear_of(*t)).sum();
        self.color * sum / texture.texels.len().max(1) as f32
    }
}

/// A gloss, in the terms of glTF 2.0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shine {
    /// Roughness, 0 (a mirror) to 1; its square is GGX's α.
    pub roughness: f32,
    /// 0 for a clear coat, 1 for a metal, whose reflection has the base colour.
    pub metallic: f32,
}

/// What is beyond the border of a texture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The same again.
    #[default]
    Repeat,
    /// The same mirrored.
    Mirror,
    /// The texel at the border.
    Clamp,
}

/// A picture in sRGB.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Width and height in texels.
    pub size: UVec2,
    /// sRGB, row-major from the top left, where texture coordinates are 0.
    pub texels: Vec<[u8; 3]>,
    /// Beyond the borders of each axis.
    pub wrap: [Wrap; 2],
}

impl Texture {
    /// Linear light at texture coordinates, bilinear between the middles of texels.
    pub fn sample(&self, at: Vec2) -> Vec3 {
        // Coordinates that are no number are those of the corner.
        let at = if at.is_finite() { at } else { Vec2::ZERO };
        let size = self.size.as_vec2();
        let p = at * size - Vec2::splat(0.5);
        let cell = p.floor();
        let f = p - cell;
        let texel = |dx: f32, dy: f32| {
            let x = wrapped(cell.x + dx, self.size.x, self.wrap[0]);
            let y = wrapped(cell.y + dy, self.size.y, self.wrap[1]);
            let texel = self.texels.get(y * self.size.x as usize + x);
            texel.map_or(Vec3::ZERO, |t| linear_of(*t))
        };
        let top = texel(0.0, 0.0).lerp(texel(1.0, 0.0), f.x);
        top.lerp(texel(0.0, 1.0).lerp(texel(1.0, 1.0), f.x), f.y)
    }
}

/// Index of a texel that may lie beyond the border.
fn wrapped(k: f32, n: u32, wrap: Wrap) -> usize {
    let n = n.max(1) as f32;
    let inside = match wrap {
        Wrap::Repeat => k.rem_euclid(n),
        Wrap::Mirror => {
            let twice = k.rem_euclid(2.0 * n);
            if twice < n { twice } else { 2.0 * n - 1.0 - twice }
        }
        Wrap::Clamp => k,
    };
    inside.clamp(0.0, n - 1.0) as usize
}

fn linear_of(texel: [u8; 3]) -> Vec3 {
    Vec3::from(texel.map(|c| crate::optics::linear_of_srgb(f32::from(c) / 255.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_are_where_their_middles_are_and_go_on_as_their_wrap_says() {
        let grey = |c: u8| [c; 3];
        let texture = |wrap| Texture {
            size: UVec2::new(2, 1),
            texels: vec![grey(0), grey(255)],
            wrap: [wrap; 2],
        };
        let at = |wrap, x: f32| texture(wrap).sample(Vec2::new(x, 0.3)).x;
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            assert!((at(wrap, 0.25), at(wrap, 0.75)) == (0.0, 1.0));
            assert!((at(wrap, 0.5) - 0.5).abs() < 1e-6);
        }
        assert_eq!((at(Wrap::Repeat, 1.25), at(Wrap::Repeat, -0.25)), (0.0, 1.0));
        assert_eq!((at(Wrap::Mirror, 1.25), at(Wrap::Mirror, 1.75)), (1.0, 0.0));
        assert_eq!((at(Wrap::Clamp, 7.0), at(Wrap::Clamp, -7.0)), (1.0, 0.0));
        // sRGB 188 is half of the light.
        let half = Material {
            color: Vec3::new(1.0, 0.5, 0.0),
            texture: Some(Texture {
                size: UVec2::ONE,
                texels: vec![grey(188)],
                wrap: [Wrap::Repeat; 2],
            }),
            shine: None,
        };
        assert!((half.color_at(Vec2::splat(f32::NAN)) - Vec3::new(0.5, 0.25, 0.0)).length() < 5e-3);
        assert_eq!(half.mean(), half.color_at(Vec2::ZERO));
    }
}
