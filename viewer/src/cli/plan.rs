//! `meniscus plan`: what a scene would run and hold in memory, and what is left out and why.

use super::args::{ImageSize, SceneArgs};
use super::console::Console;
use super::failure::Failure;
use super::format::{self, Align, Table};
use super::{input, live};
use clap::Args;
use meniscus_sim::glam::Vec3;
use meniscus_sim::{Channels, Frame, Scene, Solver};
use serde::Serialize;

/// What `meniscus help plan` says first.
pub(super) const ABOUT: &str = "Tell what a scene would run and hold in memory: the scene's own data, the solver's arrays, the channels \
    of a frame and the passes and buffers of a renderer, each with its bytes; and what is left out, with the reason. \
    Nothing is simulated or drawn.";

/// Arguments of `meniscus plan`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Example:\n  meniscus plan data/scenes/ripple-tank.toml --renderer whitted --size 1920x1080"
)]
pub struct PlanArgs {
    /// The scene
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Renderer to plan for; `meniscus renderers` lists them
    #[arg(long, value_name = "NAME", default_value = live::DEFAULT_RENDERER)]
    pub renderer: String,
    /// Image size to plan for
    #[arg(long, value_name = "WxH", default_value = "1280x720")]
    pub size: ImageSize,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Where a planned thing belongs.
#[derive(Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Part {
    Scene,
    Solver,
    Channel,
    Renderer,
}

impl Part {
    fn name(self) -> &'static str {
        match self {
            Self::Scene => "scene",
            Self::Solver => "solver",
            Self::Channel => "channel",
            Self::Renderer => "renderer",
        }
    }
}

/// Something that runs or is held, or that is left out.
#[derive(Serialize)]
struct Item {
    part: Part,
    name: String,
    reason: String,
    /// Bytes held; 0 for what is left out.
    bytes: u64,
}

/// The plan of a scene.
#[derive(Serialize)]
struct Plan {
    scene: String,
    solver: &'static str,
    renderer: &'static str,
    /// Samples along X and Z.
    samples: [u32; 2],
    /// Image size in pixels.
    image: [u32; 2],
    /// What runs and is held.
    runs: Vec<Item>,
    /// What is left out.
    left_out: Vec<Item>,
    /// Sum over `runs`.
    total_bytes: u64,
}

pub(super) fn run(args: &PlanArgs, console: &Console) -> Result<(), Failure> {
    let renderer = live::renderer(&args.renderer)?;
    let scene = input::scene(&args.scene.scene, &args.scene.overrides.set)?;
    let solver = live::solver(&scene)
        .map_err(|failure| failure.in_scene(&args.scene.scene, &args.scene.overrides.set))?;

    let mut items = scene_items(&scene);
    items.push((
        true,
        Item {
            part: Part::Solver,
            name: "state and work arrays".into(),
            reason: format!("solver `{}` over {} samples", solver.name(), scene.grid.len()),
            bytes: solver.bytes(),
        },
    ));
    items.extend(solver.extras().into_iter().map(|extra| {
        let item = Item {
            part: Part::Solver,
            name: extra.name.into(),
            reason: extra.reason,
            bytes: extra.bytes,
        };
        (true, item)
    }));
    items.extend(channel_items(&scene, solver.as_ref(), renderer.as_ref()));
    items.extend(renderer.plan(&scene, args.size.0).into_iter().map(|item| {
        let planned = Item {
            part: Part::Renderer,
            name: item.name,
            reason: item.reason,
            bytes: item.bytes,
        };
        (item.active, planned)
    }));

    let (runs, left_out): (Vec<_>, Vec<_>) = items.into_iter().partition(|(active, _)| *active);
    let strip = |items: Vec<(bool, Item)>| items.into_iter().map(|(_, item)| item).collect::<Vec<_>>();
    let runs = strip(runs);
    let plan = Plan {
        scene: scene.description.name.clone(),
        solver: solver.name(),
        renderer: renderer.name(),
        samples: scene.grid.size.to_array(),
        image: args.size.0.to_array(),
        total_bytes: runs.iter().map(|item| item.bytes).sum(),
        runs,
        left_out: strip(left_out),
    };
    if args.json {
        console.json(&plan)
    } else {
        console.result(plan.text())
    }
}

/// What the scene itself holds.
fn scene_items(scene: &Scene) -> Vec<(bool, Item)> {
    let item = |name: &str, there: bool, present: String, absent: &str, bytes: u64| {
        let planned = Item {
            part: Part::Scene,
            name: name.into(),
            reason: if there { present } else { absent.into() },
            bytes,
        };
        (there, planned)
    };
    let meshes = &scene.meshes;
    let triangles: usize = meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    let mesh_bytes = meshes.iter().map(|mesh| {
        let values = size_of_val(mesh.positions.as_slice()) + size_of_val(mesh.normals.as_slice());
        values + size_of_val(mesh.texcoords.as_slice()) + size_of_val(mesh.triangles.as_slice())
    });
    vec![
        item(
            "terrain",
            scene.terrain.is_some(),
            scene.terrain.as_ref().map_or_else(String::new, |grid| {
                format!(
                    "ground of {} x {} samples",
                    grid.spec().size.x,
                    grid.spec().size.y
                )
            }),
            "the scene has no ground",
            scene
                .terrain
                .as_ref()
                .map_or(0, |grid| size_of_val(grid.as_slice()) as u64),
        ),
        item(
            "object meshes",
            !meshes.is_empty(),
            format!(
                "{}, {}",
                format::count(meshes.len() as u64, "object"),
                format::count(triangles as u64, "triangle")
            ),
            "the scene has no objects",
            mesh_bytes.sum::<usize>() as u64,
        ),
        item(
            "sky picture",
            scene.sky.is_some(),
            scene.sky.as_ref().map_or_else(String::new, |sky| {
                format!("{} x {} pixels", sky.size.x, sky.size.y)
            }),
            "the scene's sky is not a picture",
            scene
                .sky
                .as_ref()
                .map_or(0, |sky| size_of_val(sky.pixels.as_slice()) as u64),
        ),
        item(
            "initial elevation",
            scene.initial_elevation.is_some(),
            "read from an array".into(),
            "the initial state is not an array",
            scene
                .initial_elevation
                .as_ref()
                .map_or(0, |grid| size_of_val(grid.as_slice()) as u64),
        ),
    ]
}

/// The channels of one frame.
fn channel_items(
    scene: &Scene,
    solver: &dyn Solver,
    renderer: &dyn meniscus_sim::render::Renderer,
) -> Vec<(bool, Item)> {
    let elevation = Item {
        part: Part::Channel,
        name: "elevation".into(),
        reason: "in every frame".into(),
        bytes: channel_bytes(scene, solver, Channels::NONE),
    };
    let choices = live::choose_channels(scene, live::offers(scene, solver), renderer);
    let optional = choices.into_iter().map(|choice| {
        let planned = Item {
            part: Part::Channel,
            name: choice.name.into(),
            reason: choice.reason,
            bytes: if choice.active {
                channel_bytes(scene, solver, choice.channel)
            } else {
                0
            },
        };
        (choice.active, planned)
    });
    std::iter::once((true, elevation)).chain(optional).collect()
}

/// Bytes of a channel in the first frame; [`Channels::NONE`] stands for the elevation.
pub(super) fn channel_bytes(scene: &Scene, solver: &dyn Solver, channel: Channels) -> u64 {
    let samples = scene.grid.len() as u64;
    match channel {
        // Their number is known of a frame alone.
        Channels::DROPLETS | Channels::PARTICLES => {
            let mut frame = Frame::new(scene.grid);
            solver.extract(channel, &mut frame);
            let lists = [&frame.droplets, &frame.particles].into_iter().flatten();
            lists
                .map(|list| (list.len() * (2 * size_of::<Vec3>() + size_of::<f32>())) as u64)
                .sum()
        }
        Channels::BODIES => (scene.description.objects.len() * size_of::<meniscus_sim::BodyPose>()) as u64,
        Channels::VELOCITY | Channels::DISPLACEMENT => 8 * samples,
        _ => 4 * samples,
    }
}

impl Plan {
    fn text(&self) -> String {
        let [width, height] = self.samples;
        let [columns, rows] = self.image;
        let mut text = format!(
            "{}: solver {}, {width} x {height} samples; renderer {}, {columns} x {rows} pixels\n\n",
            self.scene, self.solver, self.renderer
        );
        let mut runs = Table::new(&[
            ("part", Align::Left),
            ("runs and holds", Align::Left),
            ("bytes", Align::Right),
            ("why", Align::Left),
        ]);
        for item in &self.runs {
            runs.row(vec![
                item.part.name().into(),
                item.name.clone(),
                format::bytes(item.bytes),
                item.reason.clone(),
            ]);
        }
        runs.row(vec![
            "total".into(),
            String::new(),
            format::bytes(self.total_bytes),
            String::new(),
        ]);
        text += &runs.render();
        let mut left_out = Table::new(&[
            ("part", Align::Left),
            ("left out", Align::Left),
            ("why", Align::Left),
        ]);
        for item in &self.left_out {
            left_out.row(vec![
                item.part.name().into(),
                item.name.clone(),
                item.reason.clone(),
            ]);
        }
        if !left_out.is_empty() {
            text += "\n";
            text += &left_out.render();
        }
        text
    }
}
