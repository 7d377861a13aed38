//! The solver of a scene.

use super::settings::{
    DEFAULT_COURANT, DEFAULT_RELAXATION, Initial, LatticeSettings, Method, Precision, Settings, SetupError,
    position,
};
use super::solver::ShallowWater;
use crate::scene::Scene;
use crate::scene::description::{self, ShallowWaterScheme};
use crate::solvers::{BuildError, name_of};

impl ShallowWater {
    /// The solver of a scene with `solver.kind = "shallow-water"`, in its initial state.
    ///
    /// # Errors
    /// [`BuildError`] if the scene asks for another solver, has no terrain or holds an impossible value.
    pub fn from_scene(scene: &Scene) -> Result<Self, BuildError> {
        let description::Solver::ShallowWater(parameters) = &scene.description.solver else {
            return Err(BuildError::WrongSolver {
                expected: "shallow-water",
                found: name_of(&scene.description.solver),
            });
        };
        let initial = initial(scene)?;
        let method = match parameters.scheme {
            ShallowWaterScheme::Auto | ShallowWaterScheme::FiniteVolume => Method::FiniteVolume,
            ShallowWaterScheme::Lattice => Method::Lattice(LatticeSettings::default()),
            ShallowWaterScheme::Bgk => Method::Bgk {
                relaxation: parameters.relaxation.map_or(DEFAULT_RELAXATION, f64::from),
            },
        };
        let settings = Settings {
            method,
            precision: Precision::Single,
            manning: f64::from(parameters.manning),
            courant: parameters.courant.map_or(DEFAULT_COURANT, f64::from),
            film_depth: parameters.film_depth.map(f64::from),
            edges: (&scene.description.boundary).into(),
            level: Some(f64::from(scene.description.water.level)),
            ..Settings::default()
        };
        Self::new(scene.grid, &initial, settings).map_err(in_scene)
    }
}

/// Ground and surface at the samples of the scene's grid.
fn initial(scene: &Scene) -> Result<Initial, BuildError> {
    let spec = scene.grid;
    let Some(ground) = scene.ground_on_grid() else {
        return Err(BuildError::impossible(
            "terrain",
            "shallow water needs ground below it, and the scene has none",
            "add a `[terrain]` table; `kind = \"flat\"` makes a level bed",
        ));
    };
    let water = &scene.description.water;
    let level = f64::from(water.level);
    let elevation = |i: usize, j: usize| -> Option<f64> {
        let [x, z] = position(&spec, i, j);
        Some(match &water.initial {
            description::Initial::Still => level,
            description::Initial::Dam {
                min,
                max,
                level: behind,
            } => {
                let inside = (f64::from(min.x)..=f64::from(max.x)).contains(&x)
                    && (f64::from(min.y)..=f64::from(max.y)).contains(&z);
                if inside { f64::from(*behind) } else { level }
            }
            description::Initial::Disturbance {
                position,
                radius,
                height,
            } => {
                let (dx, dz) = (x - f64::from(position.x), z - f64::from(position.y));
                let square = (dx * dx + dz * dz) / (f64::from(*radius) * f64::from(*radius));
                // Land stays dry: a hump is one of the water.
                let wet = level > f64::from(ground[(i, j)]);
                level
                    + if wet {
                        f64::from(*height) * (-0.5 * square).exp()
                    } else {
                        0.0
                    }
            }
            description::Initial::Array { .. } => {
                let array = scene.initial_elevation.as_ref().filter(|e| *e.spec() == spec)?;
                f64::from(array[(i, j)])
            }
        })
    };
    let mut initial = Initial::default();
    for j in 0..spec.height() {
        for i in 0..spec.width() {
            initial.ground.push(f64::from(ground[(i, j)]));
            initial.elevation.push(elevation(i, j).ok_or_else(|| {
                BuildError::impossible(
                    "water.initial",
                    "the array of elevations is not on the solver's grid",
                    "load the scene with its files, so that the array is stretched over the grid",
                )
            })?);
        }
    }
    Ok(initial)
}

/// What is wrong with a setup, in terms of the scene file.
fn in_scene(error: SetupError) -> BuildError {
    let key = match &error {
        SetupError::Grid(_) | SetupError::Narrow(..) => "solver.spacing",
        SetupError::Length { .. } => "terrain",
        SetupError::Value { what, .. } if what.starts_with("ground") => "terrain",
        SetupError::Value { .. } => "water.initial",
        SetupError::Parameter { name, .. } => {
            let remedy = "correct it in the scene file".to_owned();
            return BuildError::impossible(format!("solver.{name}"), error.to_string(), remedy);
        }
        SetupError::HalfPeriodic { .. } | SetupError::Series { .. } => "boundary",
    };
    BuildError::impossible(key, error.to_string(), "correct it in the scene file")
}
