//! Scenes, frames and pictures of both renderers.

use glam::{UVec2, Vec3};
use meniscus_render_cpu::metrics::{self, Summary, flip};
use meniscus_render_cpu::tonemap::{ToneMap, srgb};
use meniscus_render_cpu::{Settings as CpuSettings, Whitted, camera};
use meniscus_render_gpu::{GpuRenderer, Settings, Technique};
use meniscus_sim::render::{Image, RenderReport, Renderer as _, View};
use meniscus_sim::source::LiveSource;
use meniscus_sim::{Frame, FrameSource as _, Scene, solvers};
use std::path::Path;

/// A scene of the repository.
pub(crate) fn scene(name: &str) -> Scene {
    let file = format!("{}/../data/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    Scene::load(Path::new(&file), &[]).unwrap_or_else(|e| panic!("{e}"))
}

/// Frame number `index` of a live run, with all channels.
pub(crate) fn frame(scene: &Scene, index: u64) -> Frame {
    let solver = solvers::build(scene).unwrap();
    let channels = meniscus_sim::stage::needs(scene) & (solver.offers() | meniscus_sim::Channels::BODIES);
    let mut live = LiveSource::new(scene, solver, channels);
    let mut frame = Frame::new(scene.grid);
    for _ in 0..=index {
        live.read_into(&mut frame).unwrap();
    }
    frame
}

/// A view of the scene's camera.
pub(crate) fn view(scene: &Scene, camera: Option<&str>, size: UVec2) -> View {
    camera::view(scene, camera, size, 1).unwrap()
}

/// The ground truth: Whitted's recursion to one interface, as Baboud & Décoret have it.
pub(crate) fn truth() -> Whitted {
    Whitted::new(CpuSettings {
        interface_depth: 1,
        ..CpuSettings::default()
    })
}

pub(crate) fn truth_image(scene: &Scene, frame: &Frame, view: &View) -> Image {
    let mut image = Image::default();
    truth().render(scene, frame, view, &mut image, &|_| true).unwrap();
    image
}

pub(crate) fn gpu(technique: Technique) -> GpuRenderer {
    GpuRenderer::new(Settings::new(technique))
}

pub(crate) fn gpu_image(
    renderer: &mut GpuRenderer,
    scene: &Scene,
    frame: &Frame,
    view: &View,
) -> (Image, RenderReport) {
    let mut image = Image::default();
    let report = renderer
        .render(scene, frame, view, &mut image, &|_| true)
        .unwrap_or_else(|e| panic!("{e}"));
    (image, report)
}

/// Display values of a picture.
pub(crate) fn display(image: &Image) -> Vec<Vec3> {
    let map = ToneMap::new(0.0);
    image.pixels.iter().map(|&p| srgb(map.display(p))).collect()
}

/// FLIP of a picture against the truth over the pixels of a mask.
pub(crate) fn score(truth: &Image, test: &Image, mask: Option<&[bool]>) -> Summary {
    assert_eq!(truth.size, test.size);
    let map = flip::flip(
        truth.size,
        &display(truth),
        &display(test),
        flip::PIXELS_PER_DEGREE,
    )
    .unwrap();
    Summary::of(&map, mask).unwrap()
}

/// RMSE of linear radiance.
pub(crate) fn rmse(truth: &Image, test: &Image, mask: Option<&[bool]>) -> f64 {
    metrics::rmse(truth.size, &truth.pixels, &test.pixels, mask).unwrap()
}

/// Writes both pictures side by side where MENISCUS_GPU_PICTURES names a folder, to be looked at.
pub(crate) fn keep(name: &str, images: &[&Image]) {
    let Some(folder) = std::env::var_os("MENISCUS_GPU_PICTURES") else {
        return;
    };
    let (w, h) = (images[0].size.x, images[0].size.y);
    let map = ToneMap::new(0.0);
    let mut out = image::RgbImage::new(w * images.len() as u32, h);
    for (n, picture) in images.iter().enumerate() {
        for y in 0..h {
            for x in 0..w {
                out.put_pixel(n as u32 * w + x, y, image::Rgb(map.srgb8(picture.pixel(x, y))));
            }
        }
    }
    std::fs::create_dir_all(&folder).unwrap();
    out.save(Path::new(&folder).join(format!("{name}.png"))).unwrap();
}
