//! What makes waves: drops, presses, pushes, and fronts that a scene or a caller gives.
//!
//! Under the volume law a disturbance becomes rings of particles that all start at its centre: together they are exactly
//! the bump that fell, and they carry its volume away. Under the energy law it becomes the train of concentric fronts
//! that the wave equation makes of it far away ([`far_field`](super::far_field)).

use super::far_field::{Profile, Train};
use super::flight::{Course, circle_angle};
use super::kernel::VOLUME;
use super::particle::Particle;
use crate::events::Action;
use crate::scene::description::{AmplitudeLaw, WaveFront};
use crate::solvers::GRAVITY;
use glam::DVec2;
use serde::{Deserialize, Serialize};

/// Particles of a ring that starts at a point. They lie closer than half a radius until they have travelled about one.
const RING: usize = 12;

/// Smallest radius of a particle in samples: a smaller one is widened to it, keeping its volume, so that the grid can tell
/// where between samples it stands.
pub(super) const SMALLEST_RADIUS: f64 = 2.0;

/// The inner of the two bumps that stand for a press, in radii of the outer: puts the zero of their difference where the
/// press has it, at half the outer radius.
const PRESS_INNER: f64 = 0.845;

/// Something that will start to run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Emission {
    /// A ring of particles about a point.
    Ring(Ring),
    /// An arc or a straight line.
    Front(Front),
}

/// A ring about a point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Ring {
    centre: DVec2,
    /// Radius of the particles, metres.
    radius: f64,
    /// Amplitude of each particle, metres.
    amplitude: f64,
    /// Added to the amplitude, times the direction of the particle.
    dipole: DVec2,
    /// Radius of the ring when it starts, metres.
    ahead: f64,
    /// As in [`Particle::reference`].
    reference: f64,
}

/// An arc or a straight line of particles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Front {
    middle: DVec2,
    direction: f64,
    width: f64,
    spread: f64,
    height: f64,
    radius: f64,
    reference: f64,
}

/// A bump of height `height + dipole · direction`, as it leaves in each direction.
#[derive(Clone, Copy)]
struct Patch {
    centre: DVec2,
    radius: f64,
    height: f64,
    dipole: DVec2,
}

impl Patch {
    fn round(centre: DVec2, radius: f64, height: f64) -> Self {
        Self {
            centre,
            radius,
            height,
            dipole: DVec2::ZERO,
        }
    }
}

/// What the making of waves depends on besides the course.
#[derive(Clone, Debug)]
pub(super) struct Maker {
    pub(super) law: AmplitudeLaw,
    bump: Train,
    press: Train,
    /// Distance between samples, metres.
    spacing: f64,
}

impl Maker {
    pub(super) fn new(law: AmplitudeLaw, train: usize, spacing: f64) -> Self {
        let of = |profile| match law {
            AmplitudeLaw::Volume => Train { fronts: Vec::new() },
            AmplitudeLaw::Energy => Train::new(profile, train),
        };
        Self {
            law,
            bump: of(Profile::Bump),
            press: of(Profile::Press),
            spacing,
        }
    }

    /// A radius wide enough for the grid, and the factor that keeps the volume.
    pub(super) fn widened(&self, radius: f64) -> (f64, f64) {
        let wide = radius.max(SMALLEST_RADIUS * self.spacing);
        (wide, (radius / wide).powi(2))
    }

    /// The train of a disturbance of height `height + dipole · direction` and radius `radius` at `time`.
    fn train(&self, train: &Train, ring: Ring, time: f64, speed: f64, out: &mut Vec<(f64, Emission)>) {
        // Crest a r/(β R) √(R/R₀) = w/√R with R₀ = r: a = w β/√r; and w is height · √r · weight.
        let share = circle_angle(RING);
        for &(ahead, weight) in &train.fronts {
            let distance = ahead * ring.radius;
            out.push((
                time + (-distance).max(0.0) / speed,
                Emission::Ring(Ring {
                    amplitude: ring.amplitude * weight * share,
                    dipole: ring.dipole * weight * share,
                    ahead: distance.max(0.0),
                    reference: ring.radius,
                    ..ring
                }),
            ));
        }
    }

    /// The rings of a bump.
    fn bump(&self, patch: Patch, time: f64, speed: f64, out: &mut Vec<(f64, Emission)>) {
        let Patch {
            centre,
            radius,
            height,
            dipole,
        } = patch;
        let (radius, factor) = self.widened(radius);
        let ring = Ring {
            centre,
            radius,
            amplitude: height * factor,
            dipole: dipole * factor,
            ahead: 0.0,
            reference: 0.0,
        };
        match self.law {
            AmplitudeLaw::Volume => {
                let each = 1.0 / RING as f64;
                let ring = Ring {
                    amplitude: ring.amplitude * each,
                    // Twice, since only half of a dipole's push goes along each direction: Σ û (û·v) = v/2.
                    dipole: 2.0 * ring.dipole * each,
                    ..ring
                };
                out.push((time, Emission::Ring(ring)));
            }
            AmplitudeLaw::Energy => self.train(&self.bump, ring, time, speed, out),
        }
    }

    /// What an action at `time` starts, in waters of wave speed `speed`.
    pub(super) fn action(&self, action: &Action, time: f64, speed: f64, out: &mut Vec<(f64, Emission)>) {
        match *action {
            Action::Drop {
                position,
                radius,
                volume,
            } => {
                let radius = f64::from(radius);
                let height = f64::from(volume) / (VOLUME * radius * radius);
                let patch = Patch::round(position.as_dvec2(), radius, height);
                self.bump(patch, time, speed, out);
            }
            Action::Push {
                position,
                radius,
                velocity,
            } => {
                // Depth · velocity is the flux of a wave of this height: q = c η, depth = c²/g.
                let dipole = speed / GRAVITY * velocity.as_dvec2();
                let patch = Patch {
                    dipole,
                    ..Patch::round(position.as_dvec2(), f64::from(radius), 0.0)
                };
                self.bump(patch, time, speed, out);
            }
            Action::Press {
                position,
                radius,
                depth,
            } => self.press(
                position.as_dvec2(),
                f64::from(radius),
                f64::from(depth),
                time,
                speed,
                out,
            ),
            // Refused by the solver: they act on bodies, or on gravity.
            Action::Drag { .. } | Action::Release { .. } | Action::Shove { .. } | Action::Tilt { .. } => {}
        }
    }

    fn press(
        &self,
        centre: DVec2,
        radius: f64,
        depth: f64,
        time: f64,
        speed: f64,
        out: &mut Vec<(f64, Emission)>,
    ) {
        match self.law {
            AmplitudeLaw::Volume => {
                let (inner, factor) = self.widened(2.0 * PRESS_INNER * radius);
                let outer = inner / PRESS_INNER;
                // −A W(d/inner) + A κ² W(d/outer): no volume, and −depth at the centre.
                let square = PRESS_INNER * PRESS_INNER;
                let down = depth * factor / (1.0 - square);
                self.bump(Patch::round(centre, inner, -down), time, speed, out);
                self.bump(Patch::round(centre, outer, down * square), time, speed, out);
            }
            AmplitudeLaw::Energy => {
                let (radius, factor) = self.widened(radius);
                let ring = Ring {
                    centre,
                    radius,
                    amplitude: depth * factor,
                    dipole: DVec2::ZERO,
                    ahead: 0.0,
                    reference: 0.0,
                };
                self.train(&self.press, ring, time, speed, out);
            }
        }
    }

    /// A hump exp(−d²/2σ²) at rest, as the bump of the same volume and the same width (second moment).
    pub(super) fn disturbance(
        &self,
        centre: DVec2,
        deviation: f64,
        height: f64,
        speed: f64,
        out: &mut Vec<(f64, Emission)>,
    ) {
        const RADII: f64 = 2.930_9;
        let radius = RADII * deviation;
        let volume = std::f64::consts::TAU * deviation * deviation * height;
        let patch = Patch::round(centre, radius, volume / (VOLUME * radius * radius));
        self.bump(patch, 0.0, speed, out);
    }

    /// A front of the scene.
    pub(super) fn front(&self, front: &WaveFront) -> (f64, Emission) {
        let (radius, factor) = self.widened(f64::from(front.radius));
        let spread = f64::from(front.spread).to_radians();
        let width = f64::from(front.width);
        let focus = if spread == 0.0 {
            0.0
        } else {
            (width / spread).abs()
        };
        let front_of = Front {
            middle: front.position.as_dvec2(),
            direction: f64::from(front.direction).to_radians(),
            width,
            spread,
            // Widening keeps the volume of a particle; that of the crest goes with its thickness.
            height: f64::from(front.height) * factor.sqrt(),
            radius,
            reference: match self.law {
                AmplitudeLaw::Volume => 0.0,
                AmplitudeLaw::Energy => focus.max(radius),
            },
        };
        (front.time, Emission::Front(front_of))
    }
}

impl Emission {
    /// The particles that start at `time`; those that would start where there is no water are counted as missed volume.
    pub(super) fn particles(&self, course: &Course, time: f64, out: &mut Vec<Particle>) -> f64 {
        match self {
            Self::Ring(ring) => ring.particles(course, time, out),
            Self::Front(front) => front.particles(course, time, out),
        }
    }
}

/// A particle that starts at `base`.
pub(super) fn fresh(base: DVec2, direction: DVec2, time: f64, radius: f64, amplitude: f64) -> Particle {
    Particle {
        base,
        direction,
        since: time,
        spacing: 0.0,
        angle: 0.0,
        amplitude,
        radius,
        reference: 0.0,
        bounces: 0,
        patience: radius,
    }
}

impl Ring {
    fn particles(&self, course: &Course, time: f64, out: &mut Vec<Particle>) -> f64 {
        let angle = circle_angle(RING);
        let open = course.is_water(self.centre);
        let mut missed = 0.0;
        for k in 0..RING {
            let direction = DVec2::from_angle(angle * (k as f64 + 0.5));
            let amplitude = self.amplitude + self.dipole.dot(direction);
            let place = course.fold(self.centre, self.ahead * direction, direction);
            let Some((base, direction)) = place.filter(|_| open) else {
                missed += VOLUME * self.radius * self.radius * amplitude;
                continue;
            };
            out.push(Particle {
                angle,
                spacing: angle * self.ahead,
                reference: self.reference,
                ..fresh(base, direction, time, self.radius, amplitude)
            });
        }
        missed
    }
}

impl Front {
    fn particles(&self, course: &Course, time: f64, out: &mut Vec<Particle>) -> f64 {
        let by_length = self.width / (course.split * self.radius);
        let by_angle = self.spread.abs() / circle_angle(RING);
        // More than the limit is refused later; a cast that saturates must not allocate first.
        let most = (course.limit as f64 + 1.0).max(1.0);
        let count = by_length.max(by_angle).ceil().clamp(1.0, most) as usize;
        let spacing = self.width / count as f64;
        let angle = self.spread.abs() / count as f64;
        let amplitude = self.height * spacing / self.radius;
        let towards = DVec2::from_angle(self.direction);
        let focus_distance = if self.spread == 0.0 {
            0.0
        } else {
            self.width / self.spread
        };
        let focus = self.middle - focus_distance * towards;
        let mut missed = 0.0;
        for k in 0..count {
            let share = (k as f64 + 0.5) / count as f64 - 0.5;
            let (base, direction) = if self.spread == 0.0 {
                (self.middle + share * self.width * towards.perp(), towards)
            } else {
                let direction = DVec2::from_angle(self.direction + self.spread * share);
                (focus + focus_distance * direction, direction)
            };
            if !course.is_water(base) {
                missed += VOLUME * self.radius * self.radius * amplitude;
                continue;
            }
            out.push(Particle {
                angle,
                // Negative before the focus.
                spacing: spacing * if self.spread < 0.0 { -1.0 } else { 1.0 },
                reference: self.reference,
                ..fresh(base, direction, time, self.radius, amplitude)
            });
        }
        missed
    }
}
