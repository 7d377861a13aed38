//! What the pointer does to the water: pushes, pours, drops, and bodies dragged.

use super::probe::{self, Held};
use meniscus_sim::events::Action;
use meniscus_sim::glam::{DVec3, Vec2, Vec3};
use meniscus_sim::rng::Rng;
use meniscus_sim::{Frame, Scene};

/// What the pointer is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    /// It turns the camera.
    #[default]
    Look,
    /// It drags the water along.
    Push,
    /// It pours water.
    Pour,
    /// It lets drops fall around it.
    Rain,
    /// It presses the surface down once.
    Press,
    /// It holds bodies.
    Drag,
    /// It places the probe.
    Probe,
}

impl Tool {
    /// All of them, with what they are called and what they do.
    pub const ALL: [(Self, &'static str, &'static str); 7] = [
        (Self::Look, "Look", "drag to turn the camera"),
        (Self::Push, "Push", "drag the water along"),
        (Self::Pour, "Pour", "hold to pour water"),
        (Self::Rain, "Rain", "hold to let drops fall"),
        (Self::Press, "Press", "click to press the surface down"),
        (Self::Drag, "Drag", "drag bodies"),
        (Self::Probe, "Probe", "click to plot the elevation there"),
    ];

    /// Whether it acts on the water, so that it needs a live run.
    pub fn acts(self) -> bool {
        !matches!(self, Self::Look | Self::Probe)
    }
}

/// Seconds between two portions of what is poured.
const PORTION: f64 = 1.0 / 20.0;

/// Drops a second of rain under the pointer.
const DROPS: f64 = 12.0;

/// Where the pointer points.
#[derive(Clone, Copy, Debug)]
pub struct Pointer {
    /// Where its ray begins, metres.
    pub eye: DVec3,
    /// Its unit direction.
    pub direction: DVec3,
    /// Whether its button was pressed just now.
    pub pressed: bool,
    /// Whether its button is down.
    pub down: bool,
    /// Time of the clock in seconds, from any moment on.
    pub now: f64,
}

/// See the module.
#[derive(Clone, Debug)]
pub struct Touch {
    /// What the pointer is for.
    pub tool: Tool,
    /// Radius of what it does, metres.
    pub radius: f32,
    /// How strongly, relative to what suits the radius.
    pub strength: f32,
    held: Option<Held>,
    before: Option<(Vec3, f64)>,
    poured: f64,
    rng: Rng,
}

impl Touch {
    /// Suits the size of the scene.
    pub fn new(scene: &Scene) -> Self {
        let extent = scene.grid.extent();
        Self {
            tool: Tool::Look,
            radius: (0.06 * extent.min_element()).max(3.0 * scene.grid.spacing),
            strength: 1.0,
            held: None,
            before: None,
            poured: f64::NEG_INFINITY,
            rng: Rng::new(scene.description.seed, 0x0074_6f75_6368),
        }
    }

    /// What the pointer does now.
    pub fn act(&mut self, scene: &Scene, frame: &Frame, pointer: &Pointer) -> Vec<Action> {
        let mut actions = Vec::new();
        let water = probe::water(frame, pointer.eye, pointer.direction);
        let at = |p: Vec3| Vec2::new(p.x, p.z);
        // A bump as high as a twelfth of its radius.
        let volume = self.strength * self.radius.powi(3) / 12.0;
        let due = pointer.down && pointer.now - self.poured >= PORTION;
        match (self.tool, water) {
            (Tool::Push, Some(p)) if pointer.down => {
                if let Some((last, then)) = self.before.filter(|_| !pointer.pressed) {
                    let seconds = pointer.now - then;
                    if seconds >= PORTION {
                        // The water is taken along in part.
                        let velocity = 0.3 * self.strength * (at(p) - at(last)) / seconds as f32;
                        let most = 4.0 * self.radius;
                        if velocity.length() > 1e-3 * self.radius {
                            actions.push(Action::Push {
                                position: at(p),
                                radius: self.radius,
                                velocity: velocity.clamp_length_max(most),
                            });
                        }
                        self.before = Some((p, pointer.now));
                    }
                } else {
                    self.before = Some((p, pointer.now));
                }
            }
            (Tool::Pour, Some(p)) if due => {
                self.poured = pointer.now;
                actions.push(Action::Drop {
                    position: at(p),
                    radius: self.radius,
                    volume: 0.5 * volume,
                });
            }
            (Tool::Rain, Some(p)) if due => {
                let passed = (pointer.now - self.poured).min(2.0 * PORTION);
                self.poured = pointer.now;
                let spec = frame.spec();
                let last = spec.origin + spec.extent();
                if self.rng.uniform() < DROPS * passed {
                    let angle = std::f32::consts::TAU * self.rng.uniform_f32();
                    let off = 2.0 * self.radius * self.rng.uniform_f32().sqrt() * Vec2::from_angle(angle);
                    actions.push(Action::Drop {
                        position: (at(p) + off).clamp(spec.origin, last),
                        radius: (0.35 * self.radius).max(2.0 * spec.spacing),
                        volume: 0.2 * volume,
                    });
                }
            }
            (Tool::Press, Some(p)) if pointer.pressed => actions.push(Action::Press {
                position: at(p),
                radius: self.radius,
                depth: 0.15 * self.strength * self.radius,
            }),
            (Tool::Drag, _) if pointer.down => {
                if pointer.pressed {
                    self.held = probe::body(scene, frame, pointer.eye, pointer.direction);
                }
                if let Some(held) = self.held.as_ref().filter(|_| due) {
                    self.poured = pointer.now;
                    actions.push(Action::Drag {
                        body: held.name.clone(),
                        grip: held.grip,
                        target: (pointer.eye + held.distance * pointer.direction).as_vec3(),
                    });
                }
            }
            _ => {}
        }
        if !pointer.down {
            self.before = None;
            if let Some(held) = self.held.take() {
                actions.push(Action::Release { body: held.name });
            }
        }
        actions
    }

    /// Name of the body that is held.
    pub fn holds(&self) -> Option<&str> {
        self.held.as_ref().map(|held| held.name.as_str())
    }
}
