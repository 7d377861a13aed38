//! Study `render`: the techniques of the renderer on wgpu against the ray tracer.

use super::case::{Against, Case, Curves, Outcome, Run, Study};
use super::tiled_pool::{self, Things, waves};
use anyhow::Context as _;
use meniscus_render_cpu::metrics::{self, Summary, flip};
use meniscus_render_cpu::tonemap::{ToneMap, srgb};
use meniscus_render_cpu::whitted::Auxiliary;
use meniscus_render_cpu::{Settings as CpuSettings, Whitted, camera};
use meniscus_render_gpu::{GpuRenderer, Heights, MetPixel, Settings, Technique, Walk};
use meniscus_sim::glam::{UVec2, Vec2, Vec3};
use meniscus_sim::render::{Image, Renderer as _, View};
use meniscus_sim::stage::Lens;
use meniscus_sim::{Frame, Scene};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// The study.
pub(crate) struct RenderStudy;

const FLIP: &str = "FLIP mean";
const FLIP_P95: &str = "FLIP 95th percentile";
const RMSE: &str = "RMSE of radiance";
const PLACE: &str = "refracted-hit error, median, px";
const PLACE_P95: &str = "refracted-hit error, 95th percentile, px";
const PLACE_P99: &str = "refracted-hit error, 99th percentile, px";
const LOST: &str = "share of water without refracted place";

impl Study for RenderStudy {
    fn name(&self) -> &'static str {
        "render"
    }

    fn title(&self) -> &'static str {
        "Water on graphics adapters against the ray tracer"
    }

    fn summary(&self) -> &'static str {
        "FLIP, radiance and refracted places of every technique on wgpu, calm and lively, above and below water"
    }

    fn about(&self) -> &'static str {
        "A tiled pool with a ball, a box and a bunny, calm and lively, seen from the edge and from under water; and the same pool \
         without the three. Every technique draws the same frame from the same place. The truth is the ray tracer `whitted` on \
         the CPU, which splits rays at one interface, as the techniques do.\n\n\
         FLIP (67 pixels a degree) and the RMSE of linear radiance are taken over the pixels that show water. The refracted-hit \
         error is the distance in pixels between where the ray tracer's refracted ray ends and where the technique takes it to \
         end, both projected into the picture; pixels in which either has no such place are counted beside it. All rasterised \
         techniques trace the mirrored ray, so that they differ in refraction alone.\n\n\
         Over ridges of the ground the walks of the heightfields are compared: the pyramid is exact; radii, one a field or one a \
         texel, times a factor, trade error for time.\n\n\
         Times are the whole frame on this machine's first adapter, upload and read-back included; resolution is the width of \
         the picture."
    }

    fn expectations(&self) -> &'static str {
        include_str!("../../../data/expectations/render.toml")
    }

    fn timed(&self) -> bool {
        false
    }

    fn cases(&self, quick: bool) -> anyhow::Result<Vec<Case>> {
        let mut cases = Vec::new();
        for (name, things, amplitude, below) in [
            ("bare pool", false, 0.02, false),
            ("calm, above", true, 0.004, false),
            ("lively, above", true, 0.025, false),
            ("calm, below", true, 0.004, true),
            ("lively, below", true, 0.025, true),
        ] {
            if quick && name != "bare pool" && name != "lively, above" {
                continue;
            }
            let things = if things { Things::Three } else { Things::None };
            let scene = tiled_pool::scene(things, 0.04)?;
            let frame = waves(&scene, amplitude);
            let about = format!(
                "waves of {amplitude} m, camera {} water",
                if below { "under" } else { "above" }
            );
            let truth = Truth::new(scene, frame, if below { "below" } else { "above" })?;
            cases.push(truth.case(name, &about, &techniques()));
        }
        let scene = tiled_pool::ridged(0.04)?;
        let frame = waves(&scene, 0.025);
        let truth = Truth::new(scene, frame, "above")?;
        cases.push(truth.case(
            "walks over ridges",
            "waves of 0.025 m over ridges of 0.4 m",
            &walks(quick),
        ));
        Ok(cases)
    }
}

/// A renderer that runs in a case.
#[derive(Clone, Copy)]
struct Tried {
    method: &'static str,
    settings: Settings,
}

/// Every technique, and two phases with more rounds of the second.
fn techniques() -> Vec<Tried> {
    let mut all: Vec<Tried> = Technique::ALL
        .map(|technique| Tried {
            method: technique.name(),
            settings: Settings::new(technique),
        })
        .to_vec();
    for (rounds, method) in [
        (0, "two-phase, broad alone"),
        (2, "two-phase, 2 rounds"),
        (3, "two-phase, 3 rounds"),
    ] {
        let mut settings = Settings::new(Technique::TwoPhase);
        settings.switches.narrow_steps = rounds;
        all.push(Tried { method, settings });
    }
    all
}

/// The ways in which rays find heightfields.
fn walks(quick: bool) -> Vec<Tried> {
    let base = Settings::new(Technique::Heightfield);
    let mut all = vec![
        Tried {
            method: base.technique.name(),
            settings: base,
        },
        Tried {
            method: "heightfield, 16 bits",
            settings: Settings {
                heights: Heights::Sixteen,
                ..base
            },
        },
    ];
    for (walk, method) in [
        (Walk::Safety, "heightfield, one radius"),
        (Walk::SafetyMap, "heightfield, radius a texel"),
    ] {
        for safety_scale in [0.25, 0.5, 1.0, 2.0, 4.0] {
            if quick && safety_scale != 1.0 {
                continue;
            }
            let settings = Settings {
                walk,
                safety_scale,
                ..base
            };
            all.push(Tried { method, settings });
        }
    }
    all
}

/// A case's frame, view and what the ray tracer makes of it.
struct Truth {
    scene: Scene,
    frame: Frame,
    view: View,
    lens: Lens,
    image: Image,
    places: Auxiliary,
    water: Vec<bool>,
}

fn display(image: &Image) -> Vec<Vec3> {
    let map = ToneMap::new(0.0);
    image.pixels.iter().map(|&p| srgb(map.display(p))).collect()
}

impl Truth {
    fn new(scene: Scene, frame: Frame, camera: &str) -> anyhow::Result<Self> {
        let view = camera::view(&scene, Some(camera), UVec2::new(240, 135), 1)?;
        let lens = Lens::new(&view)?;
        let mut whitted = Whitted::new(CpuSettings {
            interface_depth: 1,
            ..CpuSettings::default()
        });
        let mut image = Image::default();
        whitted.render(&scene, &frame, &view, &mut image, &|_| true)?;
        let places = whitted.render_aux(&scene, &frame, &view, &|_| true)?;
        let water = places.pixels.iter().map(|p| p.water).collect();
        Ok(Self {
            scene,
            frame,
            view,
            lens,
            image,
            places,
            water,
        })
    }

    /// The case in which all that is `tried` draws this frame. The first frame makes pipelines; the second is timed.
    fn case(self, name: &'static str, about: &str, tried: &[Tried]) -> Case {
        let truth = Arc::new(self);
        let width = f64::from(truth.view.size.x);
        let runs = tried.iter().map(|&Tried { method, settings }| {
            let truth = Arc::clone(&truth);
            let renderer = Mutex::new(GpuRenderer::new(settings));
            let run = Run::new(method, width, move |probe| {
                let mut renderer = renderer.lock().unwrap_or_else(PoisonError::into_inner);
                let mut image = Image::default();
                let start = Instant::now();
                renderer.render(&truth.scene, &truth.frame, &truth.view, &mut image, &|_| true)?;
                let first = start.elapsed().as_secs_f64();
                let drawn = probe
                    .time(|| renderer.render(&truth.scene, &truth.frame, &truth.view, &mut image, &|_| true));
                let report = drawn?;
                let [beyond, nothing, lost] = renderer.missing();
                let pipelines = renderer.pipelines();
                let met = renderer.met(&truth.scene, &truth.frame, &truth.view)?;
                let outcome = truth.score(&image, &met)?;
                Ok(outcome.remark(format!(
                    "on {}; first frame {first:.2} s, {pipelines} pipelines; looked up beyond the picture {beyond}, where nothing is \
                     drawn {nothing}, marched to nothing {lost}",
                    report.device.unwrap_or_default()
                )))
            });
            match settings.technique {
                Technique::TwoPhase => run.with("rounds", settings.switches.narrow_steps),
                Technique::Heightfield if settings.walk != Walk::Pyramid => {
                    run.with("safety_scale", f64::from(settings.safety_scale))
                }
                _ => run,
            }
        });
        let curves = [FLIP, PLACE_P95].map(|metric| Curves {
            metric,
            against: Against::Cpu,
            slopes: &[],
        });
        Case {
            name,
            truth: format!("`whitted` with one interface, {about}"),
            resolution: "pixels across the picture",
            curves: curves.to_vec(),
            runs: runs.collect(),
        }
    }

    fn score(&self, image: &Image, met: &[MetPixel]) -> anyhow::Result<Outcome> {
        let size = self.view.size;
        let map = flip::flip(
            size,
            &display(&self.image),
            &display(image),
            flip::PIXELS_PER_DEGREE,
        )?;
        let seen = Summary::of(&map, Some(&self.water)).context("the picture shows water")?;
        let rmse = metrics::rmse(size, &self.image.pixels, &image.pixels, Some(&self.water))?;
        let mut errors = Vec::new();
        let (mut lost, mut asked) = (0_u32, 0_u32);
        for (k, place) in self.places.pixels.iter().enumerate() {
            if !place.water || !place.refracted_length.is_finite() {
                continue;
            }
            asked += 1;
            let theirs = met[k].refracted.filter(|_| met[k].water);
            let pair = theirs.and_then(|p| Some((self.project(place.refracted)?, self.project(p)?)));
            match pair {
                Some((truth, theirs)) => errors.push((truth - theirs).length()),
                None => lost += 1,
            }
        }
        errors.sort_by(f32::total_cmp);
        let rank = |share: f64| -> f64 {
            let last = errors.len().saturating_sub(1);
            errors
                .get(((last as f64 * share).ceil() as usize).min(last))
                .map_or(f64::NAN, |e| f64::from(*e))
        };
        let outcome = Outcome::of(FLIP, seen.mean)
            .and(FLIP_P95, f64::from(seen.p95))
            .and(RMSE, rmse)
            .and(LOST, f64::from(lost) / f64::from(asked.max(1)));
        if errors.is_empty() {
            // Nothing that the technique drew lies where refracted rays end: no place, no error of one.
            return Ok(outcome);
        }
        Ok(outcome
            .and(PLACE, rank(0.5))
            .and(PLACE_P95, rank(0.95))
            .and(PLACE_P99, rank(0.99)))
    }

    /// Pixels from the top left; `None` behind the eye.
    fn project(&self, p: Vec3) -> Option<Vec2> {
        let q = p.as_dvec3() - self.lens.eye;
        let depth = q.dot(self.lens.forward);
        (depth > 1e-6).then(|| {
            let x = q.dot(self.lens.right) / self.lens.right.length_squared() / depth;
            let y = q.dot(self.lens.up) / self.lens.up.length_squared() / depth;
            Vec2::new(
                ((0.5 + 0.5 * x) * f64::from(self.view.size.x)) as f32,
                ((0.5 - 0.5 * y) * f64::from(self.view.size.y)) as f32,
            )
        })
    }
}
