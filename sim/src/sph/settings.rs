//! What the particles are told.

use crate::optics::WATER_DENSITY;
use crate::solvers::GRAVITY;
use glam::Vec3;

/// Twice the share of a spacing that gravity moves in a sub-step what rests.
const FALL: f64 = 0.01;
/// Support of the kernels in particle spacings.
const SUPPORT: f32 = 2.22;
/// Share of a support that sound may cross in a sub-step of `mcg03`.
const SOUND: f64 = 0.4;

/// How pressure is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    /// Divergence-free SPH: incompressible to a tolerance.
    Dfsph,
    /// State equation of Müller, Charypar & Gross 2003.
    Mcg03,
}

/// Parameters of the particles, SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// How pressure is found.
    pub model: Model,
    /// Distance between particles at rest, m; each stands for its cube of water.
    pub spacing: f32,
    /// Acceleration of gravity, m/s².
    pub gravity: Vec3,
    /// Density at rest, kg/m³.
    pub density: f32,
    /// Kinematic viscosity, m²/s.
    pub viscosity: f32,
    /// Surface tension, N/m.
    pub surface_tension: f32,
    /// Whether water sticks to walls and obstacles (needs a viscosity) instead of sliding along them.
    pub sticks: bool,
    /// Square of the speed of sound of `mcg03`, m²/s².
    pub stiffness: f32,
    /// Share of a particle spacing that the fastest particle may move in a sub-step.
    pub courant: f32,
    /// Longest sub-step, s.
    pub step: f32,
    /// Mean relative compression that the density solver may leave.
    pub density_tolerance: f64,
    /// Mean relative compression in a step that the divergence solver may leave.
    pub divergence_tolerance: f64,
}

impl Settings {
    /// Water of that particle spacing.
    pub fn water(spacing: f32) -> Self {
        Self {
            model: Model::Dfsph,
            spacing,
            gravity: Vec3::new(0.0, -GRAVITY as f32, 0.0),
            density: WATER_DENSITY as f32,
            viscosity: 1e-6,
            surface_tension: 0.0,
            sticks: false,
            stiffness: 0.0,
            courant: 0.5,
            step: f32::INFINITY,
            density_tolerance: 1e-4,
            divergence_tolerance: 1e-4,
        }
    }

    /// Support of the kernels, m: some 45 neighbours. Less, and the sums depend on how the particles lie; more, and the
    /// layers next to a surface lack neighbours too.
    pub fn support(&self) -> f32 {
        SUPPORT * self.spacing
    }

    /// Longest stable sub-step in seconds when nothing is faster than `speed` m/s.
    ///
    /// Courant: nothing moves farther than `courant` spacings. Force: what starts from rest under gravity alone
    /// moves a two hundredth of a spacing at most. `mcg03` besides: sound crosses 0.4 of a support, and what its explicit
    /// viscosity can take.
    pub fn stable_step(&self, speed: f32) -> f64 {
        let d = f64::from(self.spacing);
        let gravity = f64::from(self.gravity.length());
        let courant = f64::from(self.courant) * d / f64::from(speed).max(1e-9 * d);
        let force = (FALL * d / gravity.max(1e-12)).sqrt();
        let mut step = courant.min(force).min(f64::from(self.step));
        if self.model == Model::Mcg03 {
            let h = f64::from(self.support());
            let sound = f64::from(self.stiffness).sqrt();
            step = step.min(SOUND * h / (sound + f64::from(speed)).max(1e-9 * h));
            step = step.min(0.05 * h * h / f64::from(self.viscosity).max(1e-12));
        }
        step
    }

    /// Longest sub-step in seconds of `dfsph` that is stable where the pressure over density is `head` m²/s².
    ///
    /// Particles under pressure resist being moved from their places like a lattice of springs, p/d² stiff, which steps
    /// of more than 0.8 d/√p drive to oscillate ever more.
    pub(crate) fn stable_under(&self, head: f64) -> f64 {
        match self.model {
            Model::Dfsph => 0.5 * f64::from(self.spacing) / head.max(1e-12).sqrt(),
            Model::Mcg03 => f64::INFINITY,
        }
    }

    /// Mean compression in a step of `dt` seconds that the velocities may keep: a hundredth of what gravity does to a
    /// layer on the ground, or pressures would be wrong by as much.
    pub(crate) fn velocity_tolerance(&self, dt: f32) -> f64 {
        let fall = f64::from(self.gravity.length() * dt * dt / self.spacing);
        let tolerance = self.divergence_tolerance;
        if fall > 0.0 {
            (0.01 * fall).clamp(0.01 * tolerance, tolerance)
        } else {
            tolerance
        }
    }
}

impl Settings {
    /// Sum of the poly6 kernel over a cubic lattice of particles, times the volume of one: what `mcg03` takes as the
    /// density at rest.
    pub(crate) fn lattice_density(&self) -> f32 {
        // How many places are √n spacings away: Σ counts · (1 − n/SUPPORT²)³ · 315/(64π SUPPORT³).
        const COUNTS: [(f32, f32); 5] = [(0.0, 1.0), (1.0, 6.0), (2.0, 12.0), (3.0, 8.0), (4.0, 6.0)];
        let share = |n: f32| (1.0 - n / (SUPPORT * SUPPORT)).max(0.0).powi(3);
        let sum: f32 = COUNTS.iter().map(|(n, c)| c * share(*n)).sum();
        sum * 315.0 / (64.0 * std::f32::consts::PI * SUPPORT.powi(3))
    }
}
