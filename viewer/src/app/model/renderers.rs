//! The renderers of this build, as they describe themselves.

use super::drawing::Made;
use crate::cli::live;
use meniscus_render_cpu::renderers;
use meniscus_render_gpu::device::Gpu;
use meniscus_render_gpu::{GpuRenderer, Settings, Technique, adapters};
use meniscus_sim::knobs::{Knob, Turned};
use meniscus_sim::render::Renderer;
use std::sync::Arc;

/// A renderer that can be chosen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Name as on the command line.
    pub name: &'static str,
    /// One line on what it does.
    pub summary: &'static str,
    /// Whether it draws on a graphics adapter.
    pub gpu: bool,
    /// Why it cannot draw here.
    pub unavailable: Option<String>,
}

/// All of them: those on graphics adapters first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choices {
    /// The renderers.
    pub list: Vec<Choice>,
    /// The adapter that would be used.
    pub adapter: Option<String>,
}

impl Choices {
    /// What this machine has.
    pub fn of_machine() -> Self {
        Self::with_adapter(
            adapters::list()
                .into_iter()
                .next()
                .map(|a| format!("{} ({})", a.name, a.kind)),
        )
    }

    /// What a machine with such an adapter, or none, has.
    pub fn with_adapter(adapter: Option<String>) -> Self {
        let gpu = Technique::ALL.into_iter().map(|t| Choice {
            name: t.name(),
            summary: t.summary(),
            gpu: true,
            unavailable: adapter
                .is_none()
                .then(|| adapters::DeviceError::NoAdapter.to_string()),
        });
        let cpu = renderers::available().into_iter().map(|info| Choice {
            name: info.name,
            summary: info.summary,
            gpu: false,
            unavailable: info.unavailable,
        });
        let list = gpu.chain(cpu).collect();
        Self { list, adapter }
    }

    /// What is shown first: the first that can draw.
    pub fn first(&self) -> &'static str {
        let able = self.list.iter().find(|choice| choice.unavailable.is_none());
        able.map_or(live::DEFAULT_RENDERER, |choice| choice.name)
    }

    /// The first that draws without a graphics adapter: what remains when that fails.
    pub fn fallback(&self) -> &'static str {
        let able = self.list.iter().find(|c| !c.gpu && c.unavailable.is_none());
        able.map_or(live::DEFAULT_RENDERER, |choice| choice.name)
    }

    /// Whether the renderer of that name draws on a graphics adapter.
    pub fn is_gpu(&self, name: &str) -> bool {
        self.list.iter().any(|choice| choice.gpu && choice.name == name)
    }
}

/// Makes the renderer of that name.
///
/// # Errors
/// A message that says which there are.
pub fn build(name: &str) -> Result<Box<dyn Renderer>, String> {
    live::renderer(name).map_err(|failure| failure.to_string())
}

/// Makes the renderer of that name, on the device that is given if it draws on graphics adapters.
///
/// # Errors
/// As [`build`].
pub fn make(name: &str, shared: Option<&Arc<Gpu>>) -> Result<Made, String> {
    let Some(technique) = Technique::from_name(name) else {
        return build(name).map(Made::Any);
    };
    let settings = Settings::new(technique);
    let renderer = match shared {
        Some(gpu) => GpuRenderer::on(settings, Arc::clone(gpu)),
        None => GpuRenderer::new(settings),
    };
    Ok(Made::Resident(Box::new(renderer)))
}

/// What of the renderer of that name can be changed, as it says itself.
pub fn knobs(name: &str, turned: &Turned) -> Vec<Knob> {
    build(name).map_or_else(
        |_| Vec::new(),
        |mut renderer| {
            renderer.turn(turned);
            renderer.knobs()
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_choice_can_be_made_and_without_an_adapter_the_processor_draws() {
        let with = Choices::with_adapter(Some("card".into()));
        for choice in &with.list {
            assert_eq!(build(choice.name).unwrap().name(), choice.name);
        }
        assert!(with.is_gpu(with.first()));
        let without = Choices::with_adapter(None);
        assert!(!without.is_gpu(without.first()));
        assert_eq!(without.first(), without.fallback());
        assert_eq!(without.list.len(), with.list.len());
    }
}
