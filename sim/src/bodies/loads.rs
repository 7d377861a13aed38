//! What water does to a body: pressure, drag and lift, radiated waves; panel by panel over the wet part of its hull.
//!
//! * **Buoyancy.** The pressure ρ g d of the water standing above each panel, whose wet part is cut out at the surface
//!   and integrated exactly for a depth d that is linear over it. On a closed hull in still water this is Archimedes'
//!   force at the centre of the displaced volume, to rounding.
//! * **Drag and lift.** A panel that moves into the water feels ½ ρ A vₙ² along its inward normal (vₙ: normal velocity
//!   relative to the water), whose part along the motion is drag and across it lift; panels in the lee feel nothing.
//!   That gives a sphere the drag coefficient ½ and a cube 1. Along the panel acts skin friction. This is the effective
//!   area of N. Chentanez & M. Müller, Real-time simulation of large bodies of water with small scale details, SCA
//!   2010, § 4, in a form that is a symmetric resistance and so can be taken implicitly.
//! * **Radiation.** A bobbing body makes waves and loses energy to them. Waves of its own size are too short for
//!   shallow-water equations (and a one-way coupled ocean takes nothing back), so the loss is a resistance of the
//!   panels near the surface, of the strength that potential theory gives a hemisphere near resonance (A. Hulme, J.
//!   Fluid Mech. 121, 1982); it fades where the water is shallow enough to carry the waves itself.

use super::added_mass::{AddedMass, WetShape, deepness};
use super::cut::submerged;
use super::hull::Hull;
use super::mass::outer;
use super::six::{Six, Symmetric};
use super::state::State;
use super::water::{WATER_DENSITY, Water};
use crate::solvers::GRAVITY;
use glam::{DMat3, DVec2, DVec3};

/// Pressure coefficient of a panel that meets the water head on.
const PRESSURE: f64 = 1.0;
/// Skin friction coefficient.
const FRICTION: f64 = 0.004;
/// Radiation resistance a waterplane area, in ρ √(g ℓ) with ℓ the cube root of the body's volume.
const RADIATION: f64 = 0.5;

/// What acts on a body, about its centre of mass, world axes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Loads {
    /// Pressure of the water at rest.
    pub(super) pressure: Six,
    /// Force a velocity: drag, friction, radiation.
    pub(super) resistance: Symmetric,
    /// What the resistance does to a body at rest in the moving water.
    pub(super) carried: Six,
    /// Inertia of the water that goes along.
    pub(super) added: Symmetric,
    /// Submerged volume, m³.
    pub(super) volume: f64,
}

/// Sums over the wet panels that tell the shape of the wet part.
#[derive(Clone, Copy, Debug, Default)]
struct Footprint {
    /// Area of the panels that face down and of the hole that the hull makes in the surface, m².
    down: f64,
    waterplane: f64,
    /// First and second moments of `down` about the centre of mass.
    first: DVec2,
    second: [f64; 3],
    /// Volume times the height of its parts above the centre of mass.
    lift: f64,
}

/// What else a body's loads depend on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surroundings {
    /// How fast the surface around the body rises, m/s; for water whose velocity has no vertical part.
    pub(super) rise: f64,
    /// Cube root of the body's volume, m.
    pub(super) size: f64,
}

impl Loads {
    /// On `hull` in the state `state`.
    pub(super) fn on(hull: &Hull, state: &State, water: &dyn Water, around: Surroundings) -> Self {
        let mut loads = Self::default();
        let column = water.column(state.position.x, state.position.z);
        let rotation = DMat3::from_quat(state.rotation);
        let arms: Vec<DVec3> = hull.vertices.iter().map(|&p| rotation * p).collect();
        let depths: Vec<f64> = arms
            .iter()
            .map(|&r| depth_at(water, state.position + r))
            .collect();
        if depths.iter().all(|&d| d <= 0.0) {
            return loads;
        }
        let radiation = radiation(around.size, column.depth(), water.radiates());
        let mut print = Footprint::default();
        for panel in &hull.panels {
            let corner = |k: u32| (arms[k as usize], depths[k as usize]);
            submerged(panel.map(corner), |part| {
                loads.add(part, state, water, around, radiation, &mut print);
            });
        }
        loads.take_along(&print, column.depth(), water.radiates());
        loads
    }

    /// Adds the loads of one wet triangle; arms are from the centre of mass, world axes.
    fn add(
        &mut self,
        part: [(DVec3, f64); 3],
        state: &State,
        water: &dyn Water,
        around: Surroundings,
        radiation: f64,
        print: &mut Footprint,
    ) {
        let [(a, da), (b, db), (c, dc)] = part;
        let face = 0.5 * (b - a).cross(c - a);
        let area = face.length();
        if area <= 0.0 {
            return;
        }
        let weight = -WATER_DENSITY * GRAVITY * face;
        let sum = da + db + dc;
        self.pressure.linear += weight * (sum / 3.0);
        // The centre of a pressure that is linear over the triangle.
        for (r, depth) in part {
            self.pressure.angular += r.cross(weight * ((sum + depth) / 12.0));
        }

        let (centre, depth) = ((a + b + c) / 3.0, sum / 3.0);
        let normal = face / area;
        let down = -face.y;
        self.volume += down * depth;
        print.lift += down * depth * (centre.y + 0.5 * depth);
        print.waterplane += down;
        if down > 0.0 {
            let plan = DVec2::new(centre.x, centre.z);
            print.down += down;
            print.first += down * plan;
            // Exact for any triangle: a hull of few panels has the waterplane, and so the added mass, of one of many.
            let mut second = [plan.x * plan.x, plan.x * plan.y, plan.y * plan.y].map(|m| 9.0 * m);
            for r in [a, b, c] {
                second[0] += r.x * r.x;
                second[1] += r.x * r.z;
                second[2] += r.z * r.z;
            }
            for (sum, moment) in print.second.iter_mut().zip(second) {
                *sum += down / 12.0 * moment;
            }
        }

        let flow = water.velocity(state.position + centre) + DVec3::Y * around.rise;
        let relative = state.velocity + state.spin.cross(centre) - flow;
        let inwards = relative.dot(normal);
        let along = (relative - normal * inwards).length();
        let head_on = 0.5 * WATER_DENSITY * area * PRESSURE * inwards.max(0.0);
        let skin = 0.5 * WATER_DENSITY * area * FRICTION * along;
        let waves = radiation * area * normal.y * normal.y * (-2.0 * depth / around.size).exp();
        let resistance = outer(normal) * (head_on + waves - skin) + DMat3::IDENTITY * skin;
        self.resistance.add_at(centre, resistance);
        self.carried += Six::at(centre, resistance * flow);
    }

    /// The water that goes along with the wet part.
    fn take_along(&mut self, print: &Footprint, depth: f64, radiates: bool) {
        if !(print.down > 0.0 && self.volume > 0.0) {
            return;
        }
        let middle = print.first / print.down;
        let [xx, xz, zz] = print.second.map(|m| m / print.down);
        let (xx, xz, zz) = (
            xx - middle.x * middle.x,
            xz - middle.x * middle.y,
            zz - middle.y * middle.y,
        );
        let (mean, half) = (0.5 * (xx + zz), (0.25 * (xx - zz) * (xx - zz) + xz * xz).sqrt());
        let turn = 0.5 * (2.0 * xz).atan2(xx - zz);
        // An ellipse has a quarter of its squared half-axes as second moments.
        let half_axes = [mean + half, (mean - half).max(0.0)].map(|m| 2.0 * m.sqrt());
        let added = AddedMass::of(&WetShape {
            volume: self.volume,
            half_axes,
            piercing: (print.waterplane / print.down).clamp(0.0, 1.0),
            depth,
            radiates,
        });
        let (sin, cos) = turn.sin_cos();
        let (long, broad) = (DVec3::new(cos, 0.0, sin), DVec3::new(-sin, 0.0, cos));
        let matrix = |m: [f64; 3]| outer(long) * m[0] + outer(broad) * m[1] + outer(DVec3::Y) * m[2];
        let centre = DVec3::new(middle.x, print.lift / self.volume, middle.y);
        self.added.add_at(centre, matrix(added.along));
        self.added.add_angular(matrix(added.about.map(|i| i.max(0.0))));
    }
}

/// Depth of a place below the surface, m; negative above it and where there is no water.
fn depth_at(water: &dyn Water, at: DVec3) -> f64 {
    let column = water.column(at.x, at.z);
    let depth = column.surface - at.y;
    if column.surface > column.bed {
        depth
    } else {
        -depth.abs() - 1e-6
    }
}

/// Resistance an area of horizontal panels at the surface, kg/(m² s).
fn radiation(size: f64, depth: f64, radiates: bool) -> f64 {
    deepness(size, depth, radiates) * RADIATION * WATER_DENSITY * (GRAVITY * size).sqrt()
}
