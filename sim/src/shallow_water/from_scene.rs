//! The solver of a scene.

use super::bed::BedMotion;
use super::edges::{Edges, Series};
use super::settings::{
    DEFAULT_COURANT, DEFAULT_RELAXATION, Initial, LARGEST_SMAGORINSKY, LatticeSettings, Method, Precision,
    Settings, SetupError, position,
};
use super::solver::ShallowWater;
use super::splash::SplashSettings;
use crate::scene::Scene;
use crate::scene::description::{self, Bed, ShallowWaterScheme};
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
            // The nearest `f32` to 0.2 is a little more.
            smagorinsky: f64::from(parameters.smagorinsky).min(LARGEST_SMAGORINSKY),
            courant: parameters.courant.map_or(DEFAULT_COURANT, f64::from),
            film_depth: parameters.film_depth.map(f64::from),
            edges: Edges::of_scene(
                &scene.description.boundary,
                f64::from(scene.description.water.level),
            )
            .map_err(in_scene)?,
            level: Some(f64::from(scene.description.water.level)),
            splash: parameters.splash.as_ref().map(|s| SplashSettings {
                slope: f64::from(s.slope),
                amount: f64::from(s.amount),
                droplet_radius: s.droplet_radius.map(f64::from),
                max_droplets: if s.droplets {
                    SplashSettings::default().max_droplets
                } else {
                    0
                },
                foam_life: s.foam.then_some(f64::from(s.foam_life)),
                seed: scene.description.seed,
            }),
            bed: beds(scene)?,
            ..Settings::default()
        };
        #[allow(unused_mut, reason = "only bodies change it")]
        let mut solver = Self::new(scene.grid, &initial, settings).map_err(in_scene)?;
        #[cfg(feature = "bodies")]
        solver
            .add_bodies(scene)
            .map_err(|e| BuildError::Bodies(e.to_string()))?;
        Ok(solver)
    }
}

/// What moves the ground.
fn beds(scene: &Scene) -> Result<Vec<BedMotion>, BuildError> {
    let spec = scene.grid;
    let mut arrays = scene.uplifts.iter();
    let mut out = Vec::new();
    for (k, bed) in scene.description.beds.iter().enumerate() {
        let motion = match bed {
            Bed::Patch { min, max, height, .. } => {
                let (min, max) = (min.as_dvec2(), max.as_dvec2());
                let inside = |k: usize| {
                    let [x, z] = position(&spec, k % spec.width(), k / spec.width());
                    (min.x..=max.x).contains(&x) && (min.y..=max.y).contains(&z)
                };
                let shape = (0..spec.len())
                    .map(|k| if inside(k) { f64::from(*height) } else { 0.0 })
                    .collect();
                BedMotion::Uplift {
                    shape,
                    share: share(bed)?,
                }
            }
            Bed::Array { scale, .. } => {
                let Some(array) = arrays.next().filter(|a| *a.spec() == spec) else {
                    return Err(BuildError::impossible(
                        format!("bed.{k}.file"),
                        "the array of heights is not there",
                        "load the scene with its files; a recording of an earlier version does not hold this one",
                    ));
                };
                let scale = f64::from(*scale);
                let shape = array.as_slice().iter().map(|h| scale * f64::from(*h)).collect();
                BedMotion::Uplift {
                    shape,
                    share: share(bed)?,
                }
            }
            Bed::Slide { height, radius, path } => BedMotion::Slide {
                height: f64::from(*height),
                radius: f64::from(*radius),
                path: path
                    .iter()
                    .map(|p| (p.time, p.position.as_dvec2().to_array()))
                    .collect(),
            },
        };
        motion.check(&spec).map_err(|error| {
            BuildError::impossible(
                format!("bed.{k}"),
                error.to_string(),
                "correct it in the scene file",
            )
        })?;
        out.push(motion);
    }
    Ok(out)
}

/// The share of an uplift by time.
fn share(bed: &Bed) -> Result<Series, BuildError> {
    let points: Vec<[f64; 2]> = bed
        .shares()
        .iter()
        .map(|(time, [share])| [*time, *share])
        .collect();
    Series::new(&points).map_err(in_scene)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::description::{Drive, SeriesPoint};
    use crate::solver::Solver;
    use std::path::Path;

    const FLUME: &str = "name = 'flume'\ndomain.size = [20.0, 1.0]\n\
        terrain = { kind = 'flat', height = -0.5 }\n\
        solver = { kind = 'shallow-water', spacing = 0.1 }\n";

    fn flume(folder: &Path, drive: &str) -> Result<Scene, crate::scene::SceneError> {
        let text = format!("{FLUME}boundary = {{ x_max = 'open', drive = [{drive}] }}\n");
        Scene::from_toml(&text, Path::new("flume.toml"), folder, &[])
    }

    #[test]
    fn a_series_from_a_file_stands_in_the_scene_and_drives_the_edge() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(
            folder.path().join("gauge.csv"),
            "time_s,elevation_m\n0,0\n10,0.02\n",
        )
        .unwrap();
        let drive = "{ kind = 'series', edge = 'x_min', quantity = 'elevation', file = 'gauge.csv' }";
        let scene = flume(folder.path(), drive).unwrap();
        let Drive::Series { file, points, .. } = &scene.description.boundary.drives[0] else {
            panic!("{:?}", scene.description.boundary);
        };
        assert!(file.is_none());
        assert_eq!(
            points[1],
            SeriesPoint {
                time: 10.0,
                value: 0.02
            }
        );
        let mut solver = ShallowWater::from_scene(&scene).unwrap();
        for _ in 0..100 {
            solver.advance(0.1).unwrap();
        }
        // Long waves follow the edge: what stood there a moment ago stands in the first cell.
        let near = solver.elevation_at(0, 5);
        assert!((near - 0.02).abs() < 5e-4, "{near}");
        // The same scene from its parts, without the file.
        let again = Scene::from_parts(
            scene.description.clone(),
            scene.terrain.clone(),
            Vec::new(),
            None,
            None,
        );
        assert_eq!(again.unwrap().description, scene.description);
        // Mistakes name file and line.
        std::fs::write(
            folder.path().join("gauge.csv"),
            "time_s,elevation_m\n0,0\nten,0.02\n",
        )
        .unwrap();
        let error = flume(folder.path(), drive).unwrap_err();
        assert!(
            error.problems[0].file.ends_with("gauge.csv") && error.problems[0].line == Some(3),
            "{error}"
        );
        for bad in [
            "{ kind = 'series', edge = 'x_min', quantity = 'elevation', file = 'none.csv' }",
            "{ kind = 'series', edge = 'x_min', quantity = 'elevation' }",
            "{ kind = 'sine', edge = 'x_min', height = 0.1, period = 2 }, { kind = 'sine', edge = 'x_min', height = 0.1, period = 2 }",
        ] {
            assert!(flume(folder.path(), bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn the_wave_maker_makes_a_wave_of_its_height_and_speed() {
        let drive = "{ kind = 'solitary', edge = 'x_min', height = 0.01, depth = 0.5, time = 6 }";
        let scene = flume(Path::new(""), drive).unwrap();
        let mut solver = ShallowWater::from_scene(&scene).unwrap();
        let (mut highest, mut when) = (0.0, 0.0);
        for _ in 0..400 {
            solver.advance(0.025).unwrap();
            let here = solver.elevation_at(50, 5);
            if here > highest {
                (highest, when) = (here, solver.time());
            }
        }
        // The crest runs 5.05 m from the edge at u + c = 3√(g(d + H)) − 2√(g d).
        let crest = 3.0 * (9.81_f64 * 0.51).sqrt() - 2.0 * (9.81_f64 * 0.5).sqrt();
        assert!((highest - 0.01).abs() < 3e-4, "{highest}");
        assert!((when - (6.0 + 5.05 / crest)).abs() < 0.06, "{when}");
    }
}
