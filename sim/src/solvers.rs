//! Which solvers there are, and building the one that a scene asks for.

use crate::scene::Scene;
use crate::scene::description::{Motion, Solver as Choice};
use crate::solver::{Solver, StepError};
use serde::Serialize;

/// Acceleration of gravity in m/s², the same for every solver: the rounded standard value that published benchmarks use.
pub const GRAVITY: f64 = 9.81;

/// A solver that this version knows.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SolverInfo {
    /// Name as in scene files (`solver.kind`), which is also the name of its Cargo feature.
    pub name: &'static str,
    /// What it computes, in one line.
    pub summary: &'static str,
    /// Whether this build contains it.
    pub compiled: bool,
}

/// Every solver of this version, compiled in or not.
pub fn available() -> Vec<SolverInfo> {
    vec![
        SolverInfo {
            name: "wave-equation",
            summary: "linear waves on a grid: explicit leap-frog, or implicit and stable at any step",
            compiled: cfg!(feature = "wave-equation"),
        },
        SolverInfo {
            name: "procedural",
            summary: "sums of directional sines and Gerstner waves with exact dispersion, in closed form",
            compiled: cfg!(feature = "procedural"),
        },
        SolverInfo {
            name: "shallow-water",
            summary: "shallow-water equations: floods, dam breaks, moving shorelines",
            compiled: cfg!(feature = "shallow-water"),
        },
        SolverInfo {
            name: "ocean",
            summary: "wind seas and swells of measured spectra, summed by Fourier transforms at any time",
            compiled: cfg!(feature = "ocean"),
        },
        SolverInfo {
            name: "wave-particles",
            summary: "fronts of wave particles: rings, wakes, reflection at walls and shores, no step limit",
            compiled: cfg!(feature = "wave-particles"),
        },
        SolverInfo {
            name: "sph",
            summary: "water in a tank as particles: sloshing, splashing, pouring, floating bodies; from water to honey",
            compiled: cfg!(feature = "sph"),
        },
    ]
}

/// Why a solver cannot be built for a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// The solver was left out of this build.
    #[error(
        "solver `{solver}` is not compiled in; build with the Cargo feature `{solver}`, or choose one of: {compiled}"
    )]
    NotCompiled {
        /// Name of the solver and of its feature.
        solver: &'static str,
        /// The solvers that this build contains.
        compiled: String,
    },
    /// The scene asks a builder for something that another solver does.
    #[error("the scene asks for solver `{found}`, not for `{expected}`; build it with `solvers::build`")]
    WrongSolver {
        /// The solver that was to be built.
        expected: &'static str,
        /// The one that the scene names.
        found: &'static str,
    },
    /// The scene holds a value that this solver cannot work with.
    #[error("{key}: {message}; {remedy}")]
    Impossible {
        /// The key path in the scene file, such as `solver.wave.0.steepness`.
        key: String,
        /// What is wrong, with the value.
        message: String,
        /// What would be right.
        remedy: String,
    },
    /// An object of the scene cannot be a body.
    #[error("{0}")]
    Bodies(String),
    /// The scene's step cannot be used.
    #[error("solver.step: {0}")]
    Step(#[from] StepError),
}

impl BuildError {
    /// A [`BuildError::Impossible`].
    pub(crate) fn impossible(
        key: impl Into<String>,
        message: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::Impossible {
            key: key.into(),
            message: message.into(),
            remedy: remedy.into(),
        }
    }
}

/// Name of the solver that a scene asks for.
pub fn name_of(choice: &Choice) -> &'static str {
    match choice {
        Choice::WaveEquation(_) => "wave-equation",
        Choice::Procedural(_) => "procedural",
        Choice::ShallowWater(_) => "shallow-water",
        Choice::Ocean(_) => "ocean",
        Choice::WaveParticles(_) => "wave-particles",
        Choice::Sph(_) => "sph",
    }
}

/// The solver that `scene` asks for, in its initial state, with the scene's layers and detail over it.
///
/// # Errors
/// [`BuildError`] if the solver is not compiled in or cannot work with the scene's values.
pub fn build(scene: &Scene) -> Result<Box<dyn Solver>, BuildError> {
    let mut solver = build_base(scene)?;
    if !scene.description.layers.is_empty() {
        solver = Box::new(crate::layers::Layered::new(scene, solver)?);
    }
    solver = set_afloat(scene, solver)?;
    if let Some(detail) = &scene.description.detail {
        solver = Box::new(crate::detail::Detailed::new(scene, detail, solver)?);
    }
    Ok(solver)
}

/// Sets free bodies on solvers that do not couple with them themselves.
fn set_afloat(scene: &Scene, solver: Box<dyn Solver>) -> Result<Box<dyn Solver>, BuildError> {
    let couples = matches!(scene.description.solver, Choice::ShallowWater(_) | Choice::Sph(_));
    let floating = scene
        .description
        .objects
        .iter()
        .find(|o| o.motion == Motion::Free);
    let Some(_body) = floating.filter(|_| !couples) else {
        return Ok(solver);
    };
    #[cfg(feature = "bodies")]
    return Ok(Box::new(crate::afloat::Afloat::new(scene, solver)?));
    #[cfg(not(feature = "bodies"))]
    Err(BuildError::impossible(
        format!("object `{}`: motion", _body.name),
        "floating bodies are not compiled in",
        "build with the Cargo feature `bodies`, or use motion kind \"fixed\" or \"path\"",
    ))
}

/// The solver that moves the water, with nothing over it.
fn build_base(scene: &Scene) -> Result<Box<dyn Solver>, BuildError> {
    match &scene.description.solver {
        #[cfg(feature = "wave-equation")]
        Choice::WaveEquation(_) => Ok(Box::new(crate::wave_equation::WaveEquation::from_scene(scene)?)),
        #[cfg(feature = "procedural")]
        Choice::Procedural(_) => Ok(Box::new(crate::procedural::Procedural::from_scene(scene)?)),
        #[cfg(feature = "shallow-water")]
        Choice::ShallowWater(_) => Ok(Box::new(crate::shallow_water::ShallowWater::from_scene(scene)?)),
        #[cfg(feature = "ocean")]
        Choice::Ocean(_) => Ok(Box::new(crate::ocean::Ocean::from_scene(scene)?)),
        #[cfg(feature = "wave-particles")]
        Choice::WaveParticles(_) => Ok(Box::new(crate::wave_particles::WaveParticles::from_scene(scene)?)),
        #[cfg(feature = "sph")]
        Choice::Sph(_) => Ok(Box::new(crate::sph::Sph::from_scene(scene)?)),
        #[allow(unreachable_patterns, reason = "reachable when a solver's feature is off")]
        other => Err(BuildError::NotCompiled {
            solver: name_of(other),
            compiled: available()
                .into_iter()
                .filter(|s| s.compiled)
                .map(|s| s.name)
                .collect::<Vec<_>>()
                .join(", "),
        }),
    }
}
