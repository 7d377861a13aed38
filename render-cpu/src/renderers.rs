//! The renderers of this crate, by name.

use crate::horizon::HorizonRenderer;
use crate::path::PathTracer;
use crate::photon::PhotonMapper;
use crate::whitted::Whitted;
use meniscus_sim::render::Renderer;

/// A renderer that the command line may name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RendererInfo {
    /// Name as on the command line.
    pub name: &'static str,
    /// One line on what it does.
    pub summary: &'static str,
    /// Why this machine or build cannot run it; `None` if it can.
    pub unavailable: Option<String>,
}

/// There is no renderer of that name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no renderer `{name}`; there are {known}")]
pub struct UnknownRenderer {
    /// The name asked for.
    pub name: String,
    /// The names that there are.
    pub known: String,
}

/// Every renderer of this crate.
pub fn available() -> Vec<RendererInfo> {
    vec![
        RendererInfo {
            name: Whitted::NAME,
            summary: "deterministic ray tracing on the CPU: Fresnel-weighted reflection and refraction, absorption, sun and sky",
            unavailable: None,
        },
        RendererInfo {
            name: PathTracer::NAME,
            summary: "path tracing on the CPU without bias: soft sun and sky, sunlight focused by waves, scattering; noise falls with --spp",
            unavailable: None,
        },
        RendererInfo {
            name: PhotonMapper::NAME,
            summary: "light followed from sun and sky through the water onto floor, walls and objects, then seen as by `whitted`; noise falls with --spp",
            unavailable: None,
        },
        RendererInfo {
            name: HorizonRenderer::NAME,
            summary: "waves in a room of pictures over a floor, after Stuetzle, Warner & Mayer: reflection and floor mixed, no shadows",
            unavailable: None,
        },
    ]
}

/// The renderer of that name, with its default settings.
///
/// # Errors
/// [`UnknownRenderer`] lists the names.
pub fn build(name: &str) -> Result<Box<dyn Renderer>, UnknownRenderer> {
    match name {
        Whitted::NAME => Ok(Box::new(Whitted::default())),
        PathTracer::NAME => Ok(Box::new(PathTracer::default())),
        PhotonMapper::NAME => Ok(Box::new(PhotonMapper::default())),
        HorizonRenderer::NAME => Ok(Box::new(HorizonRenderer::default())),
        _ => Err(UnknownRenderer {
            name: name.to_owned(),
            known: available()
                .iter()
                .map(|r| format!("`{}`", r.name))
                .collect::<Vec<_>>()
                .join(", "),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use meniscus_sim::knobs::Turned;

    #[test]
    fn every_knob_reads_as_it_was_turned_and_goes_back_to_its_default() {
        let mut count = 0;
        for info in available() {
            let mut renderer = build(info.name).unwrap();
            let start = renderer.knobs();
            for knob in &start {
                let other = knob.value.other();
                renderer.turn(&Turned::from([(knob.name, other)]));
                for (before, after) in start.iter().zip(renderer.knobs()) {
                    let expected = if before.name == knob.name {
                        other
                    } else {
                        before.value
                    };
                    assert_eq!(
                        after.value, expected,
                        "{} {} {}",
                        info.name, knob.name, after.name
                    );
                }
                count += 1;
            }
            renderer.turn(&Turned::new());
            assert_eq!(renderer.knobs(), start, "{}", info.name);
        }
        assert!(count >= 10, "{count} knobs");
    }

    #[test]
    fn every_listed_renderer_can_be_built_and_others_are_refused() {
        for info in available() {
            assert_eq!(build(info.name).unwrap().name(), info.name);
        }
        let error = build("mirror").err().unwrap().to_string();
        assert!(error.contains("mirror") && error.contains("`whitted`"), "{error}");
    }
}
