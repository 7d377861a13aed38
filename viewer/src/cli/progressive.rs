//! Drawing one picture in passes until its noise is small enough or its time is over.

use meniscus_sim::glam::{DVec3, Vec3};
use meniscus_sim::render::{Image, RenderError, RenderReport, Renderer, View};
use meniscus_sim::{Frame, Scene};
use std::time::{Duration, Instant};

/// Most samples a pixel, all passes together.
const MOST_SAMPLES: u32 = 1 << 20;
/// Fewest passes from which noise is estimated.
const FEWEST_PASSES: u32 = 4;

/// When a picture is good enough: as soon as one of these holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Goal {
    /// Noise to reach, relative to the picture's mean; `None` for no such end.
    pub(crate) noise: Option<f64>,
    /// Time after which no pass is begun; `None` for no such end.
    pub(crate) limit: Option<Duration>,
    /// Passes, those of earlier runs included; `None` for no such end.
    pub(crate) passes: Option<u32>,
}

/// What came of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reached {
    /// Samples a pixel.
    pub(crate) samples: u32,
    /// Estimated noise of the picture: root mean square over pixels and colours of the standard error, over the picture's
    /// mean. `None` after too few passes to tell.
    pub(crate) noise: Option<f64>,
    /// Whether it was interrupted before the goal; the picture is that of the passes finished by then.
    pub(crate) interrupted: bool,
}

/// Running mean and squared deviation of every pixel over the passes (Welford 1962).
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Passes {
    pub(crate) count: u32,
    pub(crate) mean: Vec<DVec3>,
    pub(crate) square: Vec<DVec3>,
}

impl Passes {
    /// Passes so far.
    #[cfg(feature = "view")]
    pub(crate) fn count(&self) -> u32 {
        self.count
    }

    /// Adds one; all are of the same size.
    pub(crate) fn add(&mut self, image: &Image) {
        self.count += 1;
        let n = f64::from(self.count);
        self.mean.resize(image.pixels.len(), DVec3::ZERO);
        self.square.resize(image.pixels.len(), DVec3::ZERO);
        for ((mean, square), pixel) in self.mean.iter_mut().zip(&mut self.square).zip(&image.pixels) {
            let off = pixel.as_dvec3() - *mean;
            *mean += off / n;
            *square += off * (pixel.as_dvec3() - *mean);
        }
    }

    /// Estimated noise of the mean, relative to it; `None` after too few passes to tell.
    pub(crate) fn noise(&self) -> Option<f64> {
        if self.count < FEWEST_PASSES {
            return None;
        }
        let values = 3.0 * self.mean.len() as f64;
        let mean = self.mean.iter().map(|m| m.element_sum()).sum::<f64>() / values;
        let square = self.square.iter().map(|s| s.element_sum()).sum::<f64>() / values;
        let n = f64::from(self.count);
        Some((square / (n * (n - 1.0))).sqrt() / mean.abs().max(f64::MIN_POSITIVE))
    }

    /// Writes the mean.
    pub(crate) fn write(&self, image: &mut Image) {
        for (pixel, mean) in image.pixels.iter_mut().zip(&self.mean) {
            *pixel = Vec3::new(mean.x as f32, mean.y as f32, mean.z as f32);
        }
    }
}

impl Goal {
    fn is_reached(&self, passes: &Passes, samples: u32, start: Instant) -> bool {
        let noise = passes.noise();
        let quiet = self
            .noise
            .is_some_and(|wanted| noise.is_some_and(|noise| noise <= wanted));
        let late = self.limit.is_some_and(|limit| start.elapsed() >= limit);
        let enough = self.passes.is_some_and(|wanted| passes.count >= wanted);
        quiet || late || enough || samples >= MOST_SAMPLES
    }

    /// Share of the way to the goal, with the present pass done to `pass`.
    fn share(&self, passes: &Passes, pass: f32, start: Instant) -> f32 {
        let count = f64::from(passes.count) + f64::from(pass);
        let passed = self
            .limit
            .map(|limit| start.elapsed().as_secs_f64() / limit.as_secs_f64().max(1e-9));
        // The square of the noise falls with the number of passes.
        let quiet = self.noise.map(|wanted| match passes.noise() {
            Some(noise) => {
                let needed = f64::from(passes.count) * (noise / wanted).powi(2);
                count / needed.max(f64::from(FEWEST_PASSES))
            }
            None => 0.0,
        });
        let drawn = self.passes.map(|wanted| count / f64::from(wanted.max(1)));
        let all = passed.into_iter().chain(quiet).chain(drawn);
        all.fold(0.0, f64::max).min(0.999) as f32
    }
}

/// Draws passes of `view.samples` each until the goal is reached, after those that `passes` holds already, and puts
/// their mean into `image`. `advance` hears the share done and may interrupt a pass; what the passes before it gave is
/// kept. Pass for pass the same is drawn however often it was interrupted.
///
/// # Errors
/// As [`Renderer::render`].
pub(crate) fn draw(
    renderer: &mut dyn Renderer,
    (scene, frame, view): (&Scene, &Frame, &View),
    goal: Goal,
    passes: &mut Passes,
    image: &mut Image,
    advance: &(dyn Fn(f32) -> bool + Sync),
) -> Result<(RenderReport, Reached), RenderError> {
    let start = Instant::now();
    let mut report = RenderReport::default();
    let mut view = view.clone();
    image.size = view.size;
    image
        .pixels
        .resize(view.size.x as usize * view.size.y as usize, Vec3::ZERO);
    loop {
        let samples = passes.count.saturating_mul(view.samples);
        let mut reached = Reached {
            samples,
            noise: passes.noise(),
            interrupted: false,
        };
        if passes.count > 0 && goal.is_reached(passes, samples, start) {
            passes.write(image);
            return Ok((report, reached));
        }
        view.pass = passes.count;
        let drawn = renderer.render(scene, frame, &view, image, &|share| {
            advance(goal.share(passes, share, start))
        });
        let part = match drawn {
            Err(RenderError::Interrupted) if passes.count > 0 => {
                passes.write(image);
                reached.interrupted = true;
                return Ok((report, reached));
            }
            other => other?,
        };
        report.rays += part.rays;
        for (name, seconds) in part.stages {
            match report.stages.iter_mut().find(|(known, _)| *known == name) {
                Some((_, total)) => *total += seconds,
                None => report.stages.push((name, seconds)),
            }
        }
        passes.add(image);
    }
}
