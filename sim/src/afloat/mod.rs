//! Bodies afloat on any solver: on oceans, procedural waves, the wave equation and wave particles, layers included.
//!
//! `shallow-water` couples bodies with its own columns. Every other solver is watched from outside: between two frames, a
//! fraction of the smallest body's period apart, bodies move through the water that lies between them
//! ([`crate::bodies::Water`]). What they do to it is told to the solver ([`Solver::stir`]): wave particles send off the
//! waves that a hull makes; oceans and the others stay as they are.

mod view;

use crate::bodies::Bodies;
use crate::events::{Action, EventError};
use crate::frame::{BodyPose, Channels, Frame};
use crate::grid::GridSpec;
use crate::mesh::TriangleMesh;
use crate::scene::Scene;
use crate::scene::description::{Edge, Motion};
use crate::solver::{Extra, Solver, StepError, StepReport, Stirring};
use crate::solvers::BuildError;
use crate::stages::Stages;
use glam::BVec2;
use std::sync::Arc;
use std::time::Instant;
use view::{Basin, Between, View};

/// Moments of the water that bodies meet between two frames.
const MOMENTS: u32 = 4;

/// Most frames that one step is divided into.
const MOST_FRAMES: f64 = 65_536.0;

/// A solver with bodies afloat on it.
pub struct Afloat {
    base: Box<dyn Solver>,
    bodies: Bodies,
    basin: Basin,
    /// The water of the present moment.
    now: View,
    level: f64,
    /// The free bodies' hulls, if the solver can be stirred.
    stirrers: Vec<Stirrer>,
    stages: Stages,
}

/// A free body that stirs the water.
struct Stirrer {
    /// Its number among the scene's objects.
    number: usize,
    mesh: Arc<TriangleMesh>,
    /// Where it was when it last did, and since.
    since: f64,
    from: BodyPose,
    middle: Option<BodyPose>,
}

impl Afloat {
    /// Sets the scene's bodies afloat on `base`, whatever it is.
    ///
    /// # Errors
    /// [`BuildError::Bodies`] if an object cannot be a body.
    pub fn new(scene: &Scene, base: Box<dyn Solver>) -> Result<Self, BuildError> {
        let edges = &scene.description.boundary;
        let ground = scene.ground_on_grid().map(Arc::new);
        let mut basin = Basin {
            bed: f64::NEG_INFINITY,
            wrap: BVec2::new(edges.x_min == Edge::Periodic, edges.z_min == Edge::Periodic),
            radiates: base.stirred_every().is_some(),
            ground,
        };
        if basin.ground.is_none() && base.offers().contains(Channels::DEPTH) {
            let mut frame = Frame::new(base.spec());
            base.extract(Channels::DEPTH, &mut frame);
            if let Some(depth) = &frame.depth {
                basin.bed = f64::from(frame.elevation[(0, 0)]) - f64::from(depth[(0, 0)]);
            }
        }
        let now = View::of(&*base, &basin);
        let still = Between {
            before: &now,
            after: &now,
            span: 1.0,
            share: 0.0,
        };
        let mut bodies = Bodies::from_scene(scene, &still)
            .map_err(|e| BuildError::Bodies(e.to_string()))?
            .ok_or_else(|| BuildError::Bodies("no object of the scene moves".to_owned()))?;
        bodies.wet_by(&still);
        let poses = bodies.poses();
        let objects = scene.description.objects.iter().zip(&scene.meshes);
        let stirrers = objects
            .enumerate()
            .filter(|(_, (object, _))| object.motion == Motion::Free && base.stirred_every().is_some())
            .map(|(number, (_, mesh))| Stirrer {
                number,
                mesh: Arc::new(mesh.clone()),
                since: base.time(),
                from: poses[number],
                middle: None,
            });
        Ok(Self {
            stirrers: stirrers.collect(),
            level: f64::from(scene.description.water.level),
            base,
            bodies,
            basin,
            now,
            stages: Stages::default(),
        })
    }

    /// Moves the water by `h` seconds, and the bodies with it.
    fn follow(&mut self, h: f32) -> Result<StepReport, StepError> {
        let start = self.base.time();
        let mut clock = Instant::now();
        let report = self.base.advance(h)?;
        self.stages.of(&*self.base, &mut clock);
        let after = View::of(&*self.base, &self.basin);
        self.stages.lap("water that bodies meet", &mut clock);
        let span = f64::from(h);
        let moment = span / f64::from(MOMENTS);
        for k in 0..MOMENTS {
            let water = Between {
                before: &self.now,
                after: &after,
                span,
                share: (f64::from(k) + 0.5) / f64::from(MOMENTS),
            };
            self.bodies
                .advance(&water, start + f64::from(k) * moment, moment)?;
        }
        self.now = after;
        self.stages.lap("bodies", &mut clock);
        self.stir()?;
        if !self.stirrers.is_empty() {
            self.stages.lap("waves of bodies", &mut clock);
        }
        Ok(report)
    }

    /// Tells the solver what the bodies displaced, as often as it wants to know.
    fn stir(&mut self) -> Result<(), StepError> {
        let Some(interval) = self.base.stirred_every() else {
            return Ok(());
        };
        let time = self.base.time();
        let poses = self.bodies.poses();
        for s in &mut self.stirrers {
            let here = poses[s.number];
            if s.middle.is_none() && time >= s.since + 0.5 * interval {
                s.middle = Some(here);
            }
            if time < s.since + interval {
                continue;
            }
            let taken = self.base.stir(&Stirring {
                mesh: &s.mesh,
                poses: [s.from, s.middle.unwrap_or(here), here],
                since: s.since,
            })?;
            // What was too little to make a wave of counts later.
            if taken {
                s.from = here;
            }
            s.since = time;
            s.middle = None;
        }
        Ok(())
    }
}

impl Solver for Afloat {
    fn name(&self) -> &'static str {
        self.base.name()
    }

    fn spec(&self) -> GridSpec {
        self.base.spec()
    }

    fn time(&self) -> f64 {
        self.base.time()
    }

    fn offers(&self) -> Channels {
        self.base.offers() | Channels::BODIES
    }

    fn advance(&mut self, dt: f32) -> Result<StepReport, StepError> {
        StepError::check_step(dt)?;
        // A power of two divides a step without rounding, so the water is where it would be without bodies.
        let frames = (f64::from(dt) / self.bodies.exchange_step())
            .ceil()
            .max(1.0)
            .log2()
            .ceil()
            .exp2();
        if !(frames <= MOST_FRAMES) {
            return Err(StepError::TooManySubsteps {
                dt: f64::from(dt),
                needed: frames as u64,
                allowed: MOST_FRAMES as u64,
                remedy: "advance by less at a time, or leave out the smallest body".to_owned(),
            });
        }
        let h = dt / frames as f32;
        let mut total = StepReport::default();
        self.stages.clear();
        for _ in 0..frames as u32 {
            let report = self.follow(h)?;
            total = StepReport {
                substeps: total.substeps + report.substeps,
                courant: total.courant.max(report.courant),
                clamps: total.clamps + report.clamps,
                ..report
            };
        }
        total.energy += self.bodies.energy(self.level);
        Ok(total)
    }

    fn stages(&self) -> &[(&'static str, f64)] {
        self.stages.as_slice()
    }

    fn extract(&self, want: Channels, out: &mut Frame) {
        self.base.extract(want & self.base.offers(), out);
        if want.contains(Channels::BODIES) {
            out.bodies = Some(self.bodies.poses());
        }
    }

    fn apply(&mut self, action: &Action) -> Result<(), EventError> {
        if action.is_on_body() {
            action.check()?;
            self.bodies.apply(action)
        } else {
            self.base.apply(action)?;
            // A drop changes the surface at once, and bodies must not take that for a speed.
            self.now = View::of(&*self.base, &self.basin);
            Ok(())
        }
    }

    fn report(&self) -> StepReport {
        let mut report = self.base.report();
        report.energy += self.bodies.energy(self.level);
        report
    }

    fn bytes(&self) -> u64 {
        self.base.bytes()
    }

    fn extras(&self) -> Vec<Extra> {
        let frames = 2 * self.base.spec().len() as u64 * 20;
        let mut extras = self.base.extras();
        extras.push(Extra {
            name: "bodies",
            reason: "objects, at least one of which floats, and the two frames that they see".to_owned(),
            bytes: self.bodies.bytes() + frames,
        });
        extras
    }
}

#[cfg(test)]
mod tests;
