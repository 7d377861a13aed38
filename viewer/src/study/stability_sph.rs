//! The cases of study `stability` with water as particles.

use super::case::{Case, Outcome, Run};
use super::measure::Probe;
use super::plot::Map;
use super::row::Row;
use super::stability::{GROWTH, brief, cell};
use meniscus_sim::glam::{DVec3, Vec3};
use meniscus_sim::scene::description::Description;
use meniscus_sim::sph::Sph;
use meniscus_sim::{Channels, Frame, Scene, Solver};
use std::path::Path;

/// Steps asked for, in largest stable steps at the start.
const STEPS: [f64; 5] = [0.5, 1.0, 10.0, 100.0, 1000.0];

/// Growth of the energy that sub-steps and the settling of a lattice may cause, relative to that at the start.
const TOLERATED_GROWTH: f64 = 0.01;

/// Sub-steps that one run may take.
const MOST: f64 = 400.0;

const MODELS: [&str; 2] = ["dfsph", "mcg03"];

/// A tank that is stiff or extreme in one way.
struct Situation {
    name: &'static str,
    /// Lines of the scene's solver, and of the rest of it.
    solver: &'static str,
    rest: &'static str,
    /// Width of the tank, m.
    width: f32,
    models: &'static [&'static str],
    /// Whether nothing works on the water.
    alone: bool,
}

const PLAIN: Situation = Situation {
    name: "",
    solver: "",
    rest: "water = { level = -1.0, initial = { kind = 'dam', min = [0, 0], max = [0.1, 0.2], level = 0.1 } }",
    width: 0.1,
    models: &MODELS,
    alone: true,
};

const SITUATIONS: [Situation; 8] = [
    Situation {
        name: "a column of particles collapses",
        ..PLAIN
    },
    Situation {
        name: "particles a thousand times as stiff",
        solver: "stiffness = 98100.0",
        models: &["mcg03"],
        ..PLAIN
    },
    Situation {
        name: "particles ten thousand times as viscous",
        solver: "viscosity = 0.01\nwalls = 'stick'",
        ..PLAIN
    },
    Situation {
        name: "particles poured into each other",
        solver: "emitter = [{ position = [0.05, 0.05, 0.05], velocity = [0.0, -0.5, 0.0], radius = 0.03, end = 0.2 }]",
        alone: false,
        ..PLAIN
    },
    Situation {
        name: "an obstacle appears among particles",
        rest: "water = { level = 0.1 }\n[[object]]\nname = 'ball'\nshape = { kind = 'sphere', radius = 0.03 }\n\
               motion = { kind = 'path', points = [{ time = 0.02, position = [0.1, 0.5, 0.05] }, \
               { time = 0.02000001, position = [0.1, 0.05, 0.05] }] }",
        alone: false,
        ..PLAIN
    },
    Situation {
        name: "one particle",
        rest: "water = { level = -1.0, initial = { kind = 'dam', min = [0, 0], max = [0.02, 0.02], level = 0.02 } }",
        ..PLAIN
    },
    Situation {
        name: "no particle",
        rest: "water = { level = -1.0 }",
        ..PLAIN
    },
    Situation {
        name: "a tank thinner than a kernel",
        width: 0.02,
        ..PLAIN
    },
];

pub(super) fn cases() -> impl Iterator<Item = Case> {
    SITUATIONS.iter().map(|situation| {
        let steps = situation
            .models
            .iter()
            .flat_map(|model| STEPS.map(|factor| (*model, factor)));
        Case {
            name: situation.name,
            truth: "Particles stay in the tank and keep their number, and their energy does not grow unless something works on them."
                .to_owned(),
            resolution: "step over the largest stable one",
            curves: Vec::new(),
            runs: steps
                .map(|(model, factor)| {
                    Run::new(model, factor, move |probe: &mut Probe| {
                        situation.try_step(model, factor, probe)
                    })
                })
                .collect(),
        }
    })
}

pub(super) fn maps(rows: &[Row]) -> impl Iterator<Item = Map> {
    MODELS.into_iter().map(|model| {
        let mine = |situation: &Situation| -> Vec<&Row> {
            let row = |r: &&Row| r.method == model && r.case == situation.name;
            rows.iter().filter(row).collect()
        };
        let lines = SITUATIONS
            .iter()
            .map(|s| (s.name, mine(s)))
            .filter(|l| !l.1.is_empty());
        Map {
            name: model.to_owned(),
            title: format!("What becomes of a step: particles, {model}"),
            columns_label: "step asked for, in largest stable steps at the start".to_owned(),
            columns: STEPS.iter().map(ToString::to_string).collect(),
            rows: lines
                .map(|(name, rows)| (name.to_owned(), rows.into_iter().map(cell).collect()))
                .collect(),
        }
    })
}

impl Situation {
    fn scene(&self, model: &str) -> anyhow::Result<Scene> {
        let text = format!(
            "name = 'tank'\ndomain = {{ size = [0.2, {}] }}\nterrain = {{ kind = 'flat', height = 0.0 }}\n{}\n\
             [solver]\nkind = 'sph'\nspacing = 0.01\nmodel = '{model}'\n{}",
            self.width, self.rest, self.solver
        );
        // A table of objects would take the solver's place in it.
        let (objects, text) = match text.split_once("[[object]]") {
            Some((before, rest)) => {
                let (object, solver) = rest.split_once("[solver]").unwrap_or((rest, ""));
                (format!("[[object]]{object}"), format!("{before}[solver]{solver}"))
            }
            None => (String::new(), text),
        };
        let description = Description::from_toml(&format!("{text}\n{objects}"), Path::new("tank.toml"), &[])?;
        let balls = description
            .objects
            .iter()
            .map(|_| meniscus_sim::mesh::TriangleMesh::sphere(0.03));
        let meshes = balls.collect();
        Ok(Scene::from_parts(description, None, meshes, None, None)?)
    }

    fn try_step(&self, model: &str, factor: f64, probe: &mut Probe) -> anyhow::Result<Outcome> {
        let scene = self.scene(model)?;
        let mut solver = match Sph::from_scene(&scene) {
            Ok(solver) => solver,
            Err(error) => return Ok(refused(&error.to_string())),
        };
        let step = factor * solver.report().largest_stable_step.min(0.01);
        let calls = (MOST / factor.max(1.0)).clamp(1.0, 100.0) as u32;
        probe.time(|| {
            let mut frame = Frame::new(scene.grid);
            let start = solver.report();
            let mut most = 1;
            for _ in 0..calls {
                match solver.advance(step as f32) {
                    Ok(report) => most = most.max(report.substeps),
                    Err(error) => return Ok(refused(&brief(&error))),
                }
                solver.extract(Channels::ALL, &mut frame);
                if let Some(what) = self.wrong(&scene, &frame, &start) {
                    return Ok(Outcome::of(GROWTH, f64::MAX).wrong(format!("wrong: {what}")));
                }
            }
            let remark = match most {
                1 => "stable".to_owned(),
                most => format!("sub-stepped: {most} a step"),
            };
            Ok(Outcome::of(GROWTH, 0.0).remark(remark))
        })
    }

    /// Looks for anything wrong in a frame that was returned as good.
    fn wrong(&self, scene: &Scene, frame: &Frame, start: &meniscus_sim::StepReport) -> Option<String> {
        if let Err(error) = frame.check_finite() {
            return Some(error.to_string());
        }
        let particles = frame.particles.as_ref()?;
        let (low, high) = (scene.grid.origin, scene.grid.origin + scene.grid.extent());
        let escaped = |p: &&Vec3| p.x < low.x || p.x > high.x || p.z < low.y || p.z > high.y || p.y < 0.0;
        if let Some(p) = particles.position.iter().find(escaped) {
            return Some(format!("a particle leaked to {p}"));
        }
        let volume = |radius: &f32| 4.0 / 3.0 * std::f64::consts::PI * f64::from(*radius).powi(3);
        let mass: f64 = particles.radius.iter().map(|r| 1000.0 * volume(r)).sum();
        if !self.alone {
            return None;
        }
        if (mass - start.mass).abs() > 1e-4 * start.mass {
            return Some(format!("there are {mass} kg of {}", start.mass));
        }
        let up = DVec3::Y * 9.81;
        let all = particles
            .position
            .iter()
            .zip(&particles.velocity)
            .zip(&particles.radius);
        let (mut energy, mut highest) = (0.0, 0.0_f64);
        for ((p, v), r) in all {
            let (p, v) = (p.as_dvec3(), v.as_dvec3());
            energy += 1000.0 * volume(r) * (0.5 * v.length_squared() + up.dot(p));
            highest = highest.max(p.y);
        }
        // Above the floor, a column of 0.1 m or the one particle where it began.
        let bound = start.mass * 9.81 * if self.name == "one particle" { 0.01 } else { 0.05 };
        (energy > bound * (1.0 + TOLERATED_GROWTH)).then(|| {
            format!("the energy above the floor is {energy} J, and it began with {bound} J (highest particle at {highest} m)")
        })
    }
}

fn refused(why: &str) -> Outcome {
    Outcome::of(GROWTH, 0.0).remark(format!("refused: {why}"))
}
