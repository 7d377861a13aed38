//! Study `render`: the techniques of the renderer on wgpu against the ray tracer.

use super::case::{Against, Case, Curves, Outcome, Run, Study};
use anyhow::Context as _;
use meniscus_render_cpu::metrics::{self, Summary, flip};
use meniscus_render_cpu::tonemap::{ToneMap, srgb};
use meniscus_render_cpu::whitted::Auxiliary;
use meniscus_render_cpu::{Settings as CpuSettings, Whitted, camera};
use meniscus_render_gpu::{GpuRenderer, Technique};
use meniscus_sim::glam::{UVec2, Vec2, Vec3};
use meniscus_sim::render::{Image, Renderer as _, View};
use meniscus_sim::stage::Lens;
use meniscus_sim::{Frame, Grid, Scene};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

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
            cases.push(case(name, things, amplitude, below)?);
        }
        Ok(cases)
    }
}

const POOL: &str = r#"
name = "study pool"
domain = { size = [6.0, 4.0] }
terrain = { kind = "flat", height = -1.5 }
ground = { albedo = [0.78, 0.80, 0.80], shore_albedo = [0.16, 0.40, 0.52], steep_albedo = [0.55, 0.53, 0.49], checker = 0.5 }
solver = { kind = "wave-equation", spacing = 0.04 }
light = { sun = { elevation = 55.0, azimuth = 150.0 } }
[[camera]]
name = "above"
position = [0.5, 1.7, 5.2]
target = [3.1, -0.9, 2.0]
fov = 52.0
[[camera]]
name = "below"
position = [0.6, -0.9, 3.4]
target = [3.2, 0.1, 1.9]
fov = 70.0
"#;

const THINGS: &str = r#"
[[object]]
name = "ball"
shape = { kind = "sphere", radius = 0.35 }
position = [2.2, -1.15, 2.4]
color = [0.80, 0.16, 0.10]
[[object]]
name = "box"
shape = { kind = "box", size = [0.6, 1.9, 0.4] }
position = [3.9, -0.55, 1.7]
rotation = { axis = [0.0, 1.0, 0.0], angle = 25.0 }
color = [0.12, 0.30, 0.70]
[[object]]
name = "bunny"
shape = { kind = "model", file = "bunny.glb", scale = 1.2 }
position = [3.0, -1.5, 1.2]
color = [0.75, 0.62, 0.30]
"#;

/// The scene of a case.
fn scene(things: bool) -> anyhow::Result<Scene> {
    let folder = tempfile::tempdir()?;
    std::fs::write(
        folder.path().join("bunny.glb"),
        include_bytes!("../../../data/models/bunny.glb"),
    )?;
    let text = if things {
        format!("{POOL}{THINGS}")
    } else {
        POOL.to_owned()
    };
    Ok(Scene::from_toml(
        &text,
        Path::new("pool.toml"),
        folder.path(),
        &[],
    )?)
}

/// Waves of a few lengths and directions; their steepness goes with the amplitude (metres).
fn waves(scene: &Scene, amplitude: f32) -> Frame {
    let mut frame = Frame::new(scene.grid);
    let spec = scene.grid;
    frame.elevation = Grid::from_fn(spec, |i, j| {
        let p = spec.position(i, j);
        [(1.6_f32, 0.3_f32, 0.5_f32), (0.9, 1.4, 0.3), (0.55, -0.8, 0.2)]
            .into_iter()
            .map(|(length, angle, share)| {
                let along = p.dot(Vec2::from_angle(angle));
                amplitude * share * (std::f32::consts::TAU * along / length + angle).sin()
            })
            .sum()
    });
    frame
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

fn case(name: &'static str, things: bool, amplitude: f32, below: bool) -> anyhow::Result<Case> {
    let size = UVec2::new(240, 135);
    let scene = scene(things)?;
    let frame = waves(&scene, amplitude);
    let view = camera::view(&scene, Some(if below { "below" } else { "above" }), size, 1)?;
    let lens = Lens::new(&view)?;
    let mut whitted = Whitted::new(CpuSettings {
        interface_depth: 1,
        ..CpuSettings::default()
    });
    let mut image = Image::default();
    whitted.render(&scene, &frame, &view, &mut image, &|_| true)?;
    let places = whitted.render_aux(&scene, &frame, &view, &|_| true)?;
    let water = places.pixels.iter().map(|p| p.water).collect();
    let truth = Arc::new(Truth {
        scene,
        frame,
        view,
        lens,
        image,
        places,
        water,
    });
    let runs = Technique::ALL.into_iter().map(|technique| {
        let truth = Arc::clone(&truth);
        let renderer = Mutex::new(GpuRenderer::from(technique));
        Run::new(technique.name(), f64::from(size.x), move |probe| {
            let mut renderer = renderer.lock().unwrap_or_else(PoisonError::into_inner);
            let mut image = Image::default();
            let drawn = probe
                .time(|| renderer.render(&truth.scene, &truth.frame, &truth.view, &mut image, &|_| true));
            let report = drawn?;
            let met = renderer
                .met(&truth.scene, &truth.frame, &truth.view)?
                .context("every technique tells its places")?;
            let outcome = truth.score(&image, &met)?;
            Ok(outcome.remark(format!("on {}", report.device.unwrap_or_default())))
        })
    });
    Ok(Case {
        name,
        truth: format!(
            "`whitted` with one interface, waves of {} m, camera {} water",
            amplitude,
            if below { "under" } else { "above" }
        ),
        resolution: "pixels across the picture",
        curves: vec![
            Curves {
                metric: FLIP,
                against: Against::Cpu,
                slopes: &[],
            },
            Curves {
                metric: PLACE_P95,
                against: Against::Cpu,
                slopes: &[],
            },
        ],
        runs: runs.collect(),
    })
}

impl Truth {
    fn score(&self, image: &Image, met: &[meniscus_render_gpu::MetPixel]) -> anyhow::Result<Outcome> {
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
