//! What depends on the scene alone, without a device.

use crate::continued::Continued;
use crate::hierarchy::{self, Rows};
use crate::looks;
use crate::tessellate::{self, Triangle};
use meniscus_sim::glam::{DVec3, Vec3};
use meniscus_sim::scene::description::Shape;
use meniscus_sim::stage::continuation::openness;
use meniscus_sim::stage::ground::Ground;
use meniscus_sim::stage::light::Light;
use meniscus_sim::stage::sky::Sky;
use meniscus_sim::stage::surroundings;
use meniscus_sim::stage::volume::Volume;
use meniscus_sim::{Grid, GridSpec, Scene};

/// What depends on the scene alone.
#[derive(Debug)]
pub(crate) struct Fixed {
    pub(crate) fingerprint: u64,
    pub(crate) light: Light,
    pub(crate) volume: Volume,
    pub(crate) look: Ground,
    pub(crate) ground: Option<Continued>,
    pub(crate) ground_on_grid: Option<Grid<f32>>,
    pub(crate) tables: Vec<f32>,
    pub(crate) table_irradiance: u32,
    pub(crate) table_noise: u32,
    pub(crate) table_open: u32,
    pub(crate) open: Option<GridSpec>,
    /// Materials, hierarchies and triangles of models behind the records, and root, first triangle and radius of each object.
    pub(crate) models: Rows,
    pub(crate) model_of: Vec<Option<(u32, u32, f32)>>,
    /// Triangles of every object in its own axes.
    pub(crate) triangles: Vec<Vec<Triangle>>,
    pub(crate) anchor: DVec3,
    pub(crate) scale: f64,
}

impl Fixed {
    pub(crate) fn new(scene: &Scene, fingerprint: u64) -> Self {
        let d = &scene.description;
        let light = Light::new(d, Sky::new(scene));
        let volume = Volume::new(&d.water, &light);
        let relief = scene.terrain.as_ref().is_some_and(|t| {
            let (low, high) = t.range();
            low < high
        });
        let spacing = scene
            .terrain
            .as_ref()
            .map_or(1.0, |t| f64::from(t.spec().spacing));
        let look = Ground::new(scene, spacing, relief);
        let middle = scene.grid.origin.as_dvec2() + 0.5 * scene.grid.extent().as_dvec2();
        let anchor = DVec3::new(middle.x, f64::from(d.water.level), middle.y);
        let ground = scene.terrain.as_ref().map(|terrain| {
            let how = surroundings::ground_continuation(terrain, d.water.level);
            Continued::new(terrain, how, anchor.y, None)
        });
        let parts = light.sky.parts();
        let flat = |values: &[Vec3]| values.iter().flat_map(|v| v.to_array()).collect::<Vec<f32>>();
        let mut tables = flat(parts.horizon);
        let table_irradiance = tables.len() as u32;
        tables.extend(flat(parts.irradiance));
        let mut table_noise = 0;
        if let Some(lattice) = look.lattice() {
            table_noise = tables.len() as u32;
            tables.extend(lattice);
        }
        let (mut table_open, mut open) = (0, None);
        if let Some(terrain) = scene.terrain.as_ref().filter(|_| relief) {
            table_open = tables.len() as u32;
            tables.extend(openness(terrain).as_slice());
            open = Some(*terrain.spec());
        }
        let base = 6 * d.objects.len() as u32;
        let mut models = Rows::new();
        let looks = looks::are_needed(scene);
        let mut triangles: Vec<Vec<Triangle>> = Vec::with_capacity(scene.meshes.len());
        let mut model_of = Vec::with_capacity(scene.meshes.len());
        for (object, mesh) in d.objects.iter().zip(&scene.meshes) {
            if !matches!(object.shape, Shape::Model { .. }) {
                triangles.push(tessellate::triangles_of(mesh, &[]));
                model_of.push(None);
                continue;
            }
            let (rows, materials) = looks::material_rows(mesh, base + models.len() as u32);
            models.extend(rows);
            let own = tessellate::triangles_of(mesh, &materials);
            let root = base + models.len() as u32;
            model_of.push(
                hierarchy::mesh_rows(&own, root, looks).map(|(rows, first, radius)| {
                    models.extend(rows);
                    (root, first, radius)
                }),
            );
            triangles.push(own);
        }
        Self {
            fingerprint,
            volume,
            look,
            ground,
            ground_on_grid: scene.ground_on_grid(),
            tables,
            table_irradiance,
            table_noise,
            table_open,
            open,
            models,
            model_of,
            triangles,
            anchor,
            scale: surroundings::scale(scene),
            light,
        }
    }

    /// Places are relative to it, metres.
    pub(crate) fn anchor(&self) -> DVec3 {
        self.anchor
    }
}
