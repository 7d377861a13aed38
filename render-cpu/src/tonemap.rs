//! From linear radiance to display values.
//!
//! Per pixel: multiply by 2^exposure; mix the channels a little, as film layers do, so that a bright saturated colour
//! has light in all three; compress each channel with one curve; take the mixing partly back; encode as sRGB.
//! The curve is a Hill function, `f(x) = w x^p / (x^p + s^p)`: a straight toe in log space, middle grey a little darker
//! than it is (0.18 is shown as 0.15, which leaves room for highlights), white reached at [`WHITE`] and a smooth shoulder between. Because the channels are mixed before they are
//! compressed, a highlight runs to white along its own hue instead of first turning yellow, cyan or magenta.
//! No dithering: equal radiance gives equal bytes.

use glam::{Mat3, Vec3};
use meniscus_sim::render::Image;

/// Radiance, after exposure, that is shown as white.
pub const WHITE: f32 = 10.0;

/// Exponent of the curve: contrast at middle grey.
const CONTRAST: f32 = 1.45;
const GREY: f32 = 0.18;
const GREY_SHOWN: f32 = 0.15;

/// Share of each channel that is mixed into the others before the curve, and how much of it is taken back after.
const MIX: f32 = 0.08;
const UNMIX: f32 = 0.07;

/// See [`ToneMap::parts`].
#[derive(Clone, Copy, Debug)]
pub struct Parts {
    /// Factor of the radiance.
    pub gain: f32,
    /// Mixes the channels before the curve.
    pub into: Mat3,
    /// Takes part of the mixing back after it.
    pub out_of: Mat3,
    /// `p` of the curve.
    pub contrast: f32,
    /// `s^p` of the curve.
    pub half: f32,
    /// `w` of the curve.
    pub scale: f32,
}

fn mixing(share: f32) -> Mat3 {
    let (own, other) = (1.0 - share, 0.5 * share);
    Mat3::from_cols(
        Vec3::new(own, other, other),
        Vec3::new(other, own, other),
        Vec3::new(other, other, own),
    )
}

/// A tone map for one exposure.
#[derive(Clone, Copy, Debug)]
pub struct ToneMap {
    gain: f32,
    into: Mat3,
    out_of: Mat3,
    /// `s^p` and `w` of the curve.
    half: f32,
    scale: f32,
}

impl ToneMap {
    /// A tone map with `exposure` in stops (each doubles the radiance).
    pub fn new(exposure: f32) -> Self {
        // f(GREY) = g and f(WHITE) = 1 give s^p = (1 − g) / (g/G − 1/W) with G = GREY^p, W = WHITE^p.
        let (g, w) = (GREY.powf(CONTRAST), WHITE.powf(CONTRAST));
        let half = (1.0 - GREY_SHOWN) / (GREY_SHOWN / g - 1.0 / w);
        Self {
            gain: exposure.exp2(),
            into: mixing(MIX),
            out_of: mixing(UNMIX).inverse(),
            half,
            scale: (w + half) / w,
        }
    }

    /// What the map consists of, for whoever evaluates it on another device: the steps are those of [`Self::display`].
    pub fn parts(&self) -> Parts {
        Parts {
            gain: self.gain,
            into: self.into,
            out_of: self.out_of,
            contrast: CONTRAST,
            half: self.half,
            scale: self.scale,
        }
    }

    /// Display-linear colour, 0 to 1, of a radiance.
    pub fn display(&self, radiance: Vec3) -> Vec3 {
        let x = self.into * (radiance.max(Vec3::ZERO) * self.gain);
        let x = x.min(Vec3::splat(1e6)).powf(CONTRAST);
        let y = self.scale * x / (x + self.half);
        (self.out_of * y.min(Vec3::ONE)).clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// 8-bit sRGB of a radiance.
    pub fn srgb8(&self, radiance: Vec3) -> [u8; 3] {
        (srgb(self.display(radiance)) * 255.0 + 0.5)
            .to_array()
            .map(|v| v as u8)
    }

    /// 8-bit sRGB of a whole picture, three bytes a pixel from the top left.
    pub fn image(&self, image: &Image) -> Vec<u8> {
        image.pixels.iter().flat_map(|&p| self.srgb8(p)).collect()
    }
}

/// The transfer curve of IEC 61966-2-1 from display-linear values in 0 to 1.
pub fn srgb(linear: Vec3) -> Vec3 {
    let encode = |v: f32| {
        if v <= 0.003_130_8 {
            12.92 * v
        } else {
            1.055 * v.powf(1.0 / 2.4) - 0.055
        }
    };
    Vec3::new(encode(linear.x), encode(linear.y), encode(linear.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_white_and_black_are_where_they_are_said_to_be() {
        let map = ToneMap::new(0.0);
        assert!((map.display(Vec3::splat(GREY)) - GREY_SHOWN).abs().max_element() < 1e-4);
        assert!((map.display(Vec3::splat(WHITE)) - 1.0).abs().max_element() < 1e-4);
        assert_eq!(map.srgb8(Vec3::ZERO), [0, 0, 0]);
        assert_eq!(map.srgb8(Vec3::splat(f32::INFINITY)), [255, 255, 255]);
        // One stop is a factor of two.
        let brighter = ToneMap::new(1.0).display(Vec3::new(0.1, 0.2, 0.3));
        assert!(
            (brighter - map.display(Vec3::new(0.2, 0.4, 0.6)))
                .abs()
                .max_element()
                < 1e-6
        );
    }

    #[test]
    fn brightness_grows_and_the_order_of_channels_never_breaks() {
        for hue in [
            Vec3::new(1.0, 0.2, 0.05),
            Vec3::new(0.05, 0.3, 1.0),
            Vec3::new(1.0, 0.8, 0.1),
        ] {
            let mut before = Vec3::ZERO;
            for step in -40..40 {
                let c = ToneMap::new(step as f32 * 0.25).display(hue);
                assert!(
                    (c - before).min_element() > -2e-3,
                    "{hue} at step {step}: {before} then {c}"
                );
                // The channel that is between the others stays between them: no jump of hue.
                let mut order: Vec<(f32, f32)> = hue.to_array().into_iter().zip(c.to_array()).collect();
                order.sort_by(|a, b| a.0.total_cmp(&b.0));
                assert!(order[0].1 <= order[1].1 && order[1].1 <= order[2].1, "{hue}: {c}");
                before = c;
            }
            assert!(before.min_element() > 0.95, "{hue} ends white: {before}");
        }
    }
}
