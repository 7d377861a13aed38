//! What the rays of a picture met: the images on which approximate renderers are scored.

use super::Whitted;
use super::trace::Tracer;
use crate::caster::Ray;
use crate::stage::tiles;
use crate::stage::world::{Medium, What};
use glam::{DVec3, UVec2, Vec3};
use meniscus_sim::render::{RenderError, RenderReport, View};
use meniscus_sim::{Frame, Scene};

/// What the ray through the middle of one pixel met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AuxiliaryPixel {
    /// Whether the first thing met is water (its surface or a glass side).
    pub water: bool,
    /// Metres from the eye to the first thing met; infinite for the sky.
    pub distance: f32,
    /// Where that is, metres.
    pub position: Vec3,
    /// Unit normal there, towards the eye; for water the smooth normal that optics use.
    pub normal: Vec3,
    /// Share of light reflected there; 0 where it is not water.
    pub fresnel: f32,
    /// Metres that the refracted ray goes until it meets something; infinite where there is none or it meets nothing.
    pub refracted_length: f32,
    /// Where it meets it, metres.
    pub refracted: Vec3,
    /// Metres that the reflected ray goes until it meets something; infinite where it meets nothing.
    pub reflected_length: f32,
    /// Where it meets it, metres.
    pub reflected: Vec3,
}

impl Default for AuxiliaryPixel {
    fn default() -> Self {
        Self {
            water: false,
            distance: f32::INFINITY,
            position: Vec3::ZERO,
            normal: Vec3::ZERO,
            fresnel: 0.0,
            refracted_length: f32::INFINITY,
            refracted: Vec3::ZERO,
            reflected_length: f32::INFINITY,
            reflected: Vec3::ZERO,
        }
    }
}

/// The auxiliary image of a view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Auxiliary {
    /// Width and height in pixels.
    pub size: UVec2,
    /// Row-major from the top left.
    pub pixels: Vec<AuxiliaryPixel>,
}

impl Auxiliary {
    /// The pixel at column `x` and row `y` from the top.
    pub fn pixel(&self, x: u32, y: u32) -> &AuxiliaryPixel {
        &self.pixels[y as usize * self.size.x as usize + x as usize]
    }

    /// Every value as a named plane, for EXR.
    pub fn planes(&self) -> Vec<(&'static str, Vec<f32>)> {
        type Get = fn(&AuxiliaryPixel) -> f32;
        let planes: [(&'static str, Get); 17] = [
            ("water.mask", |p| f32::from(u8::from(p.water))),
            ("hit.distance", |p| p.distance),
            ("hit.X", |p| p.position.x),
            ("hit.Y", |p| p.position.y),
            ("hit.Z", |p| p.position.z),
            ("normal.X", |p| p.normal.x),
            ("normal.Y", |p| p.normal.y),
            ("normal.Z", |p| p.normal.z),
            ("fresnel", |p| p.fresnel),
            ("refracted.length", |p| p.refracted_length),
            ("refracted.X", |p| p.refracted.x),
            ("refracted.Y", |p| p.refracted.y),
            ("refracted.Z", |p| p.refracted.z),
            ("reflected.length", |p| p.reflected_length),
            ("reflected.X", |p| p.reflected.x),
            ("reflected.Y", |p| p.reflected.y),
            ("reflected.Z", |p| p.reflected.z),
        ];
        planes
            .into_iter()
            .map(|(name, get)| (name, self.pixels.iter().map(get).collect()))
            .collect()
    }
}

impl Whitted {
    /// Casts one ray through the middle of each pixel (whatever `view.samples` says) and notes what it and its
    /// reflected and refracted ray meet.
    ///
    /// # Errors
    /// As [`render`](meniscus_sim::render::Renderer::render).
    pub fn render_aux(
        &mut self,
        scene: &Scene,
        frame: &Frame,
        view: &View,
        progress: &(dyn Fn(f32) -> bool + Sync),
    ) -> Result<Auxiliary, RenderError> {
        let mut report = RenderReport::default();
        self.stage.with(scene, frame, view, &mut report, |set, _| {
            let tracer = Tracer {
                world: &set.world,
                settings: &self.settings,
                caustics: None,
                photons: None,
                sun_point: [0.0; 2],
                rays: 0,
            };
            let mut out = Auxiliary {
                size: view.size,
                pixels: Vec::new(),
            };
            tiles::render(
                view.size,
                progress,
                || tracer,
                |tracer, x, y| {
                    let ray = Ray {
                        origin: set.lens.eye,
                        direction: set.lens.direction(f64::from(x) + 0.5, f64::from(y) + 0.5),
                    };
                    tracer.look(&ray, set.medium)
                },
                |_| {},
                &mut out.pixels,
            )?;
            Ok(out)
        })
    }
}

impl Tracer<'_> {
    fn look(&mut self, ray: &Ray, medium: Medium) -> AuxiliaryPixel {
        let mut out = AuxiliaryPixel::default();
        let Some(hit) = self.world.cast(ray, medium, f64::INFINITY) else {
            return out;
        };
        out.distance = hit.t as f32;
        out.position = hit.position.as_vec3();
        let towards = if hit.normal.dot(ray.direction) > 0.0 {
            -1.0
        } else {
            1.0
        };
        out.normal = (towards * hit.normal).as_vec3();
        let What::Water { glass } = hit.what else {
            return out;
        };
        let at = self.world.interface(ray.direction, &hit, glass);
        out.water = true;
        out.normal = at.shading;
        out.fresnel = at.fresnel;
        let (near, far) = if at.from_water {
            (Medium::Water, Medium::Air)
        } else {
            (Medium::Air, Medium::Water)
        };
        let follow = |direction: Vec3, medium, side: f64| -> (f32, Vec3) {
            let origin: DVec3 = hit.position + at.facing * (side * self.world.hair);
            let ray = Ray {
                origin,
                direction: direction.as_dvec3().normalize(),
            };
            match self.world.cast(&ray, medium, f64::INFINITY) {
                Some(next) => (next.t as f32, next.position.as_vec3()),
                None => (f32::INFINITY, Vec3::ZERO),
            }
        };
        (out.reflected_length, out.reflected) = follow(at.reflected, near, 1.0);
        if let Some(direction) = at.refracted {
            (out.refracted_length, out.refracted) = follow(direction, far, -1.0);
        }
        out
    }
}
