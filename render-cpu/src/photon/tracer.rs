//! The way of one photon.

use super::floor::FloorMap;
use super::ledger::Ledger;
use super::source::Start;
use super::spots::Spot;
use crate::caster::Ray;
use crate::stage::interface::FOAM_ALBEDO;
use crate::stage::matt::Matt;
use crate::stage::world::{Hit, Medium, What, World, in_plan};
use glam::{DVec3, Vec3};
use meniscus_sim::rng::Rng;
use std::f32::consts::TAU;

/// Interfaces and reflections after which a photon is given up. Only light that goes round inside the water comes so
/// far, and most of it ends by absorption or by chance long before.
const MOST_EVENTS: u32 = 256;

/// Follows photons, and keeps what they leave behind.
pub(super) struct Tracer<'a> {
    pub(super) world: &'a World<'a>,
    pub(super) floor: Option<&'a FloorMap>,
    pub(super) bounces: u32,
    pub(super) ledger: Ledger,
    /// Cell and flux of photons on the floor, in the order in which they fell.
    pub(super) fallen: Vec<(u32, DVec3)>,
    /// Photons on anything else.
    pub(super) spots: Vec<Spot>,
    pub(super) rays: u64,
}

struct Photon {
    ray: Ray,
    medium: Medium,
    flux: DVec3,
    /// Water surfaces met, and matt ones.
    interfaces: u32,
    bounces: u32,
}

/// The matt surface that a photon falls on.
enum On {
    Floor,
    Wall,
    Object,
    Foam,
}

impl Tracer<'_> {
    /// Sends a photon on its way.
    pub(super) fn send(&mut self, start: Start) {
        let mut rng = start.rng;
        self.ledger.emitted += start.flux;
        // Two at most: only at its first water surface is a photon split.
        let mut waiting = vec![Photon {
            ray: Ray {
                origin: start.origin,
                direction: start.direction,
            },
            medium: Medium::Air,
            flux: start.flux,
            interfaces: 0,
            bounces: 0,
        }];
        while let Some(mut photon) = waiting.pop() {
            let mut going = true;
            while going {
                going = self.step(&mut photon, &mut waiting, &mut rng);
            }
        }
    }

    /// On to the next thing; whether it goes on from there.
    fn step(&mut self, photon: &mut Photon, waiting: &mut Vec<Photon>, rng: &mut Rng) -> bool {
        self.rays += 1;
        let hit = self.world.cast(&photon.ray, photon.medium, f64::INFINITY);
        let Some(hit) = hit else {
            if photon.medium == Medium::Water {
                self.ledger.lost += photon.flux;
            }
            return false;
        };
        if photon.medium == Medium::Water {
            let left = self.world.volume.transmittance(hit.t as f32).as_dvec3();
            let arriving = photon.flux * left;
            self.ledger.absorbed += photon.flux - arriving;
            photon.flux = arriving;
        }
        if photon.interfaces + photon.bounces >= MOST_EVENTS || photon.flux.max_element() <= 0.0 {
            if photon.medium == Medium::Water {
                self.ledger.lost += photon.flux;
            }
            return false;
        }
        match hit.what {
            What::Water { glass } => self.interface(photon, &hit, glass, waiting, rng),
            What::Ground => self.land(photon, &hit, &On::Floor, Vec3::ZERO, rng),
            What::Wall => self.land(photon, &hit, &On::Wall, self.world.look.wall(), rng),
            What::Object { color, .. } => self.land(photon, &hit, &On::Object, color, rng),
            What::Droplet { centre, .. } => {
                // Drops are small beside what they are above: light goes straight through.
                let chord = 2.0 * (centre - hit.position).dot(photon.ray.direction).max(0.0);
                photon.ray.origin = hit.position + photon.ray.direction * (chord + self.world.hair);
                photon.interfaces += 1;
                true
            }
        }
    }

    fn interface(
        &mut self,
        photon: &mut Photon,
        hit: &Hit,
        glass: bool,
        waiting: &mut Vec<Photon>,
        rng: &mut Rng,
    ) -> bool {
        let world = self.world;
        if !glass {
            let foam = world.foam_cover(hit.position);
            if foam > 0.0 && rng.uniform_f32() < foam {
                return self.land(photon, hit, &On::Foam, Vec3::splat(FOAM_ALBEDO), rng);
            }
        }
        let at = world.interface(photon.ray.direction, hit, glass);
        let share = f64::from(at.fresnel);
        let from = |direction: Vec3, side: f64| Ray {
            origin: hit.position + at.facing * (side * world.hair),
            direction: direction.as_dvec3().normalize(),
        };
        let first = photon.interfaces == 0;
        photon.interfaces += 1;
        let reflected = from(at.reflected, 1.0);
        let through = match at.refracted {
            None => None,
            Some(direction) if first => {
                waiting.push(Photon {
                    ray: reflected,
                    flux: photon.flux * share,
                    ..*photon
                });
                photon.flux *= 1.0 - share;
                Some(direction)
            }
            Some(direction) => (rng.uniform() >= share).then_some(direction),
        };
        let Some(direction) = through else {
            photon.ray = reflected;
            return true;
        };
        photon.ray = from(direction, -1.0);
        if at.from_water {
            self.ledger.emerged += photon.flux;
            photon.medium = Medium::Air;
            return true;
        }
        self.ledger.transmitted += photon.flux;
        photon.medium = Medium::Water;
        // Water thinner than the offset that keeps a ray off its own surface: the ground is met at once.
        if world.ground_height(photon.ray.origin) >= photon.ray.origin.y {
            let ground = Hit {
                t: 0.0,
                normal: world.ground_normal(hit.position),
                what: What::Ground,
                ..*hit
            };
            return self.land(photon, &ground, &On::Floor, Vec3::ZERO, rng);
        }
        true
    }

    /// Falls on a matt surface; whether it is sent back from there.
    fn land(&mut self, photon: &mut Photon, hit: &Hit, on: &On, color: Vec3, rng: &mut Rng) -> bool {
        let below = photon.medium == Medium::Water;
        let away = hit.normal.dot(photon.ray.direction) > 0.0;
        let normal = if away { -hit.normal } else { hit.normal };
        if below {
            match on {
                On::Floor => self.ledger.floor += photon.flux,
                On::Wall => self.ledger.walls += photon.flux,
                On::Object | On::Foam => self.ledger.objects += photon.flux,
            }
        }
        match on {
            On::Floor if below => {
                let cell = self.floor.and_then(|f| f.cell(in_plan(hit.position)));
                self.fallen.extend(cell.map(|cell| (cell, photon.flux)));
            }
            // In air the light that comes straight from sun and sky is found from the eye.
            On::Wall | On::Object if below || photon.interfaces > 0 => self.spots.push(Spot {
                position: hit.position,
                normal: normal.as_vec3(),
                flux: photon.flux.as_vec3(),
            }),
            _ => {}
        }
        if !below || photon.bounces >= self.bounces {
            return false;
        }
        let matt = match on {
            On::Floor => {
                let found = self
                    .world
                    .ground_matt(hit, photon.ray.direction, self.floor_cell());
                let Some(matt) = found else { return false };
                matt
            }
            _ => {
                let facing = Hit { normal, ..*hit };
                Matt::flat(&facing, color, 1e3 * self.world.hair)
            }
        };
        let chance = matt.albedo.max_element().min(1.0);
        if !(chance > 0.0) || rng.uniform_f32() >= chance {
            return false;
        }
        photon.flux *= (matt.albedo / chance).as_dvec3();
        photon.bounces += 1;
        self.ledger.sent_back += photon.flux;
        let normal = matt.geometric.as_vec3();
        photon.ray = Ray {
            origin: matt.position + matt.lift * matt.geometric,
            direction: around(normal, rng).as_dvec3(),
        };
        true
    }

    fn floor_cell(&self) -> f32 {
        self.floor.map_or(0.0, |f| f.spec().spacing)
    }
}

/// A direction about `normal`, with density cosθ/π.
fn around(normal: Vec3, rng: &mut Rng) -> Vec3 {
    let (u, angle) = (rng.uniform_f32(), TAU * rng.uniform_f32());
    let (a, b) = normal.any_orthonormal_pair();
    let r = u.sqrt();
    (r * (angle.cos() * a + angle.sin() * b) + (1.0 - u).max(0.0).sqrt() * normal).normalize()
}
