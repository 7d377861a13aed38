//! A scene's solver and what it is asked for.

use super::failure::{Classify as _, Failure};
use super::{format, memory};
use meniscus_render_cpu::renderers;
use meniscus_sim::render::Renderer;
use meniscus_sim::source::LiveSource;
use meniscus_sim::{Channels, Scene, Solver, SourceError, solvers};

/// The renderer that is used where none is named, and whose needs decide what is recorded by default.
pub(crate) const DEFAULT_RENDERER: &str = "whitted";

/// Fewest `f32` arrays that running a scene holds: the frame, and elevation and motion of the solver.
const FEWEST_ARRAYS: u64 = 3;

/// The solver of a scene, after a look at whether its arrays can fit into memory.
///
/// # Errors
/// [`Failure::Solver`] if it cannot be built, [`Failure::Input`] if it is too large.
pub(crate) fn solver(scene: &Scene) -> Result<Box<dyn Solver>, Failure> {
    let size = scene.grid.size;
    let fewest = FEWEST_ARRAYS * 4 * scene.grid.len() as u64;
    memory::require(
        fewest,
        &format!("the grid of {} x {} samples", size.x, size.y),
        "take fewer samples: a coarser `solver.spacing` or a smaller `domain.size`",
    )?;
    solvers::build(scene).map_err(Failure::Solver)
}

/// The renderer of that name.
///
/// # Errors
/// [`Failure::Input`] that lists the names there are.
pub(crate) fn renderer(name: &str) -> Result<Box<dyn Renderer>, Failure> {
    #[cfg(feature = "gpu")]
    if let Some(technique) = meniscus_render_gpu::Technique::from_name(name) {
        return Ok(Box::new(meniscus_render_gpu::GpuRenderer::from(technique)));
    }
    if name.starts_with("gpu:") {
        return Err(Failure::input(if cfg!(feature = "gpu") {
            format!("no renderer `{name}`; `meniscus renderers` lists those there are")
        } else {
            format!("renderer `{name}` is not in this build: it needs the Cargo feature `gpu`")
        }));
    }
    renderers::build(name).or_input()
}

/// An optional channel of the frame, whether it is extracted and recorded, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ChannelChoice {
    pub(crate) name: &'static str,
    pub(crate) channel: Channels,
    /// Whether the scene names it.
    pub(crate) named: bool,
    pub(crate) active: bool,
    pub(crate) reason: String,
}

impl ChannelChoice {
    /// Whether the scene names it and it cannot be had.
    pub(crate) fn refused(&self) -> bool {
        self.named && !self.active
    }
}

/// What becomes of each optional channel when a scene is recorded: those that `recording.channels` names, else those
/// that `renderer` needs, as far as the run offers them.
pub(crate) fn choose_channels(
    scene: &Scene,
    offers: Channels,
    renderer: &dyn Renderer,
) -> Vec<ChannelChoice> {
    let solver = solvers::name_of(&scene.description.solver);
    let needs = renderer.needs(scene);
    let named = scene.description.recording.channels.as_deref();
    let choose = |(name, channel): (&'static str, Channels)| {
        let (wanted, by) = match named {
            Some(list) => (
                list.iter().any(|listed| listed == name),
                "`recording.channels`".to_owned(),
            ),
            None => (needs.contains(channel), format!("renderer `{}`", renderer.name())),
        };
        let (active, reason) = match (wanted, offers.contains(channel)) {
            (true, true) => (true, format!("asked for by {by}")),
            (true, false) => (
                false,
                format!("asked for by {by}, but solver `{solver}` does not offer it"),
            ),
            (false, _) => (false, format!("not asked for by {by}")),
        };
        ChannelChoice {
            name,
            channel,
            named: wanted && named.is_some(),
            active,
            reason,
        }
    };
    Channels::ALL.iter().map(choose).collect()
}

/// The channels that are active.
pub(crate) fn active(choices: &[ChannelChoice]) -> Channels {
    let active = choices.iter().filter(|choice| choice.active);
    active.fold(Channels::NONE, |set, choice| set | choice.channel)
}

/// The channels that a run of this scene with this solver can hand out.
pub(crate) fn offers(scene: &Scene, solver: &dyn Solver) -> Channels {
    if scene.description.objects.is_empty() {
        solver.offers()
    } else {
        // A live source adds the poses of the scene's objects.
        solver.offers() | Channels::BODIES
    }
}

/// A live run without end.
pub(crate) fn source(scene: &Scene, solver: Box<dyn Solver>, channels: Channels) -> LiveSource {
    LiveSource::new(scene, solver, channels)
}

/// Frames of a run of `duration` seconds.
pub(crate) fn frame_count(scene: &Scene, duration: f64) -> u64 {
    (duration * scene.description.recording.rate + 1e-6).floor() as u64 + 1
}

/// A failure of a run at frame `index`: what, when, and what remains.
pub(crate) fn run_failed(error: SourceError, scene: &Scene, index: u64, kept: &str) -> Failure {
    let time = index as f64 / scene.description.recording.rate;
    Failure::Run(anyhow::Error::from(error).context(format!(
        "the run stopped on the way to frame {index} at t = {}{kept}",
        format::seconds(time)
    )))
}
