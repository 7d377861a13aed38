//! Where the samples of a pixel lie.

use meniscus_sim::Scene;
use meniscus_sim::render::View;
use meniscus_sim::rng::Rng;

/// The seed of a pass: passes are as unlike as scenes of other seeds.
pub(crate) fn pass_seed(scene: &Scene, view: &View) -> u64 {
    scene.description.seed ^ u64::from(view.pass).wrapping_mul(0xd134_2543_de82_ef95)
}

/// The sample points of one pixel.
pub(crate) struct Pixel {
    samples: u32,
    shift: [f64; 4],
}

impl Pixel {
    /// Stream of the random generator that shifts draw from.
    const STREAM: u64 = 0x0070_6978_656c;

    pub(crate) fn new(seed: u64, x: u32, y: u32, samples: u32) -> Self {
        let mut rng = Rng::new(seed, Self::STREAM ^ (u64::from(y) << 32 | u64::from(x)) << 8);
        let shift = if samples == 1 {
            [0.5, 0.5, 0.0, 0.0]
        } else {
            std::array::from_fn(|_| rng.uniform())
        };
        Self { samples, shift }
    }

    /// Point `k` of the pixel and of the sun's disc, both in the unit square: a Hammersley set and another one in the
    /// other bit order, shifted by a random amount that is the pixel's own. One sample goes through the middle.
    pub(crate) fn sample(&self, k: u32) -> ([f64; 2], [f32; 2]) {
        if self.samples == 1 {
            return ([0.5, 0.5], [0.0, 0.0]);
        }
        let n = f64::from(self.samples);
        let wrap = |v: f64| v - v.floor();
        let inverse = f64::from(k.reverse_bits()) / 4_294_967_296.0;
        let golden = f64::from(k) * 0.754_877_666_246_692_8;
        let silver = f64::from(k) * 0.569_840_290_998_053_3;
        (
            [
                wrap((f64::from(k) + 0.5) / n + self.shift[0]),
                wrap(inverse + self.shift[1]),
            ],
            [
                wrap(golden + self.shift[2]) as f32,
                wrap(silver + self.shift[3]) as f32,
            ],
        )
    }
}
