//! What a scene and a frame ask of a picture: all that decides which passes there are and how large things become.

use crate::looks;
use crate::settings::{Heights, PhotonMap, Settings, Walk};
use meniscus_sim::glam::UVec2;
use meniscus_sim::scene::description::{Edge, Shape, Sky as SkyKind};
use meniscus_sim::stage::continuation::continued_spec;
use meniscus_sim::stage::{ground, sky, surroundings};
use meniscus_sim::{Frame, GridSpec, Scene};

/// Levels of a pyramid at most.
pub const MOST_LEVELS: usize = 16;

/// Where the parts of a heightfield stand in the buffer of heights, in words of four bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FieldShape {
    /// Samples with the continuation; zero if there is no such field.
    pub size: [u32; 2],
    /// How samples are kept.
    pub kept: Heights,
    /// First word of the heights.
    pub heights: u32,
    /// First word of the slopes.
    pub slopes: u32,
    /// First word of the safety radii, which are there if `has_radii`.
    pub radii: u32,
    /// Whether there are safety radii.
    pub has_radii: bool,
    /// First word of each level of the pyramid from level 1.
    pub pyramid: [u32; MOST_LEVELS],
    /// Levels.
    pub levels: u32,
    /// Word after the last.
    pub end: u32,
}

impl FieldShape {
    /// A field of `size` samples whose words begin at `start`; `None` if they cannot be counted in 32 bits.
    pub fn new(size: UVec2, start: u64, settings: &Settings) -> Option<Self> {
        let mut shape = Self {
            size: size.to_array(),
            kept: settings.heights,
            heights: u32::try_from(start).ok()?,
            has_radii: settings.walk == Walk::SafetyMap,
            ..Self::default()
        };
        let mut next = start + shape.height_words();
        shape.slopes = u32::try_from(next).ok()?;
        next += shape.slope_words();
        shape.radii = u32::try_from(next).ok()?;
        next += shape.radius_words();
        let cells = size - 1;
        let mut level = 1;
        while level <= MOST_LEVELS as u32 {
            let blocks = blocks_of(cells, level);
            shape.pyramid[level as usize - 1] = u32::try_from(next).ok()?;
            next += shape.pair() * u64::from(blocks.x) * u64::from(blocks.y);
            shape.levels = level;
            if blocks.max_element() == 1 {
                break;
            }
            level += 1;
        }
        shape.end = u32::try_from(next).ok()?;
        Some(shape)
    }

    /// Whether the scene has it.
    pub fn is_present(&self) -> bool {
        self.size[0] > 0
    }

    fn samples(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }

    /// Words of two values.
    fn pair(&self) -> u64 {
        match self.kept {
            Heights::Single => 2,
            Heights::Sixteen => 1,
        }
    }

    /// Words of the heights; rows are whole words.
    pub fn height_words(&self) -> u64 {
        match self.kept {
            Heights::Single => self.samples(),
            Heights::Sixteen => u64::from(self.size[0].div_ceil(2)) * u64::from(self.size[1]),
        }
    }

    /// Words of the slopes.
    pub fn slope_words(&self) -> u64 {
        self.pair() * self.samples()
    }

    /// Words of the safety radii.
    pub fn radius_words(&self) -> u64 {
        if self.has_radii {
            self.pair() * self.samples()
        } else {
            0
        }
    }

    /// Words of the pyramid.
    pub fn pyramid_words(&self) -> u64 {
        u64::from(self.end) - u64::from(self.radii) - self.radius_words()
    }
}

/// Blocks of `2^level` cells.
pub fn blocks_of(cells: UVec2, level: u32) -> UVec2 {
    let block = 1_u32 << level;
    UVec2::new(cells.x.div_ceil(block), cells.y.div_ceil(block))
}

/// Sizes of the photon map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CausticSizes {
    /// Photons along X and Z.
    pub photons: [u32; 2],
    /// Texels of the map along X and Z.
    pub map: [u32; 2],
    /// Whether it is filtered.
    pub filter: bool,
}

/// See the module.
#[derive(Clone, Debug, PartialEq)]
pub struct Facts {
    /// Picture, pixels.
    pub size: [u32; 2],
    /// Rows of the sky's picture, columns; none of a uniform sky.
    pub sky: Option<[u32; 2]>,
    /// Objects.
    pub objects: u32,
    /// Whether models have materials.
    pub looks: bool,
    /// Rows of the buffer of objects.
    pub solid_rows: u32,
    /// Whether the frame has droplets.
    pub spray: bool,
    /// Foam samples; 0 without foam.
    pub foam: u32,
    /// Whether the caller has drawn something of its own.
    pub foreign: bool,
    /// Focused sunlight, where there is any.
    pub caustics: Option<CausticSizes>,
    /// Whether the look of the ground has noise.
    pub noise: bool,
    /// Samples of the sky seen by the ground.
    pub open: u32,
    /// Water, ground.
    pub fields: [FieldShape; 2],
    /// Whether the scene has a sun.
    pub sun: bool,
    /// Sides that end the water, and whether each is seen through.
    pub sides: Vec<bool>,
    /// What rasterised techniques draw.
    pub mesh: MeshSizes,
}

/// How finely rasterised techniques cut things into triangles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeshSizes {
    /// Squares of the ground along X and Z.
    pub ground: [u32; 2],
    /// Squares along each axis of a wall or deck.
    pub wall: u32,
    /// Tiles of a periodic surface along a side; 1 if it does not repeat.
    pub tiles: u32,
    /// Object, first row of `meshes`, triangles.
    pub objects: Vec<[u32; 3]>,
    /// Rows of a triangle of `meshes`.
    pub triangle_rows: u32,
}

impl MeshSizes {
    /// Rows of the buffer of meshes.
    pub fn rows(&self) -> u32 {
        self.objects.iter().map(|[_, _, n]| self.triangle_rows * n).sum()
    }
}

/// A scene is too large for the buffers of any device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a grid of {0} x {1} samples has more values than 32 bits count; use a coarser spacing")]
pub struct TooLarge(pub u32, pub u32);

impl Facts {
    /// What can be known from the scene alone; `spec` is the grid of the frame. Foam and droplets are left out until a frame
    /// has them.
    ///
    /// # Errors
    /// [`TooLarge`].
    pub fn of_scene(
        scene: &Scene,
        spec: &GridSpec,
        size: UVec2,
        settings: &Settings,
    ) -> Result<Self, TooLarge> {
        let d = &scene.description;
        let ground = scene.terrain.as_ref();
        let relief = ground.is_some_and(|t| {
            let (low, high) = t.range();
            low < high
        });
        let too_large = |size: UVec2| TooLarge(size.x, size.y);
        // The ground first: it stays where it is when the water's grid changes.
        let ground_shape = match ground {
            Some(terrain) => {
                let how = surroundings::ground_continuation(terrain, d.water.level);
                let size = continued_spec(terrain.spec(), &how).size;
                FieldShape::new(size, 0, settings).ok_or_else(|| too_large(size))?
            }
            None => FieldShape::default(),
        };
        let how = surroundings::water_continuation(scene);
        let water_size = continued_spec(spec, &how).size;
        let water_shape = FieldShape::new(water_size, u64::from(ground_shape.end), settings)
            .ok_or_else(|| too_large(water_size))?;
        let sky = match (&d.light.sky, &scene.sky) {
            (SkyKind::Uniform { .. }, _) | (SkyKind::Picture { .. }, None) => None,
            (SkyKind::Picture { .. }, Some(picture)) => Some(picture.size.to_array()),
            (SkyKind::Daylight { .. }, _) => Some([2 * sky::DAYLIGHT_ROWS, sky::DAYLIGHT_ROWS]),
        };
        let looks = looks::are_needed(scene);
        let triangle_rows = looks::triangle_rows(looks);
        let sun = d.light.sun.is_some() || scene.sky.is_some() && sky::Sky::new(scene).sun().is_some();
        let caustics = (settings.caustics && sun && ground.is_some() && spec.size.min_element() > 1)
            .then(|| CausticSizes::new(settings.photon_map, spec));
        Ok(Self {
            size: size.to_array(),
            sky,
            objects: d.objects.len() as u32,
            looks,
            solid_rows: planned_rows(scene, looks),
            spray: false,
            foam: 0,
            foreign: false,
            caustics,
            noise: relief && d.ground.checker <= 0.0,
            open: ground.filter(|_| relief).map_or(0, |t| t.spec().len() as u32),
            fields: [water_shape, ground_shape],
            sun,
            sides: sides(scene),
            mesh: MeshSizes {
                ground: [128; 2],
                wall: 32,
                tiles: if how.periodic.any() { 13 } else { 1 },
                objects: planned_meshes(scene, triangle_rows),
                triangle_rows,
            },
        })
    }

    /// With what the frame carries.
    pub fn with_frame(mut self, frame: &Frame) -> Self {
        self.spray = frame
            .droplets
            .as_ref()
            .is_some_and(|d| d.radius.iter().any(|r| *r > 0.0));
        self.foam = frame
            .foam
            .as_ref()
            .filter(|f| f.spec().size.min_element() > 1)
            .map_or(0, |f| f.spec().len() as u32);
        self
    }

    /// Words of the buffer of heights.
    pub fn height_words(&self) -> u64 {
        u64::from(self.fields[0].end.max(self.fields[1].end))
    }

    /// Values of the tables: haze, irradiance, noise, openness.
    pub fn table_values(&self) -> u64 {
        let irradiance = if self.sky.is_some() {
            3 * sky::NORMAL_ROWS * sky::NORMAL_COLUMNS
        } else {
            0
        };
        let noise = if self.noise {
            ground::LATTICE * ground::LATTICE
        } else {
            0
        };
        (3 * sky::HORIZON_STEPS + irradiance + noise) as u64 + u64::from(self.open)
    }

    /// Bytes of the sky's texture with its halvings down to four rows.
    pub fn sky_bytes(&self) -> u64 {
        let Some([mut w, mut h]) = self.sky else { return 0 };
        let mut texels = 0;
        loop {
            texels += u64::from(w) * u64::from(h);
            if h < 8 || w < 8 {
                break;
            }
            (w, h) = (w / 2, h / 2);
        }
        8 * texels
    }
}

impl CausticSizes {
    fn new(map: PhotonMap, spec: &GridSpec) -> Self {
        match map {
            PhotonMap::Grid { filter } => Self {
                photons: (2 * (spec.size - 1)).to_array(),
                map: spec.size.to_array(),
                filter,
            },
            PhotonMap::Square { photons, map, filter } => Self {
                photons: [photons.max(1); 2],
                map: [map.max(2); 2],
                filter,
            },
        }
    }
}

/// The walls of a basin; no camera is beyond them yet.
fn sides(scene: &Scene) -> Vec<bool> {
    if !surroundings::is_basin(scene) {
        return Vec::new();
    }
    let b = &scene.description.boundary;
    let walls = [b.x_min, b.x_max, b.z_min, b.z_max].map(|e| e == Edge::Wall);
    walls.into_iter().filter(|w| *w).map(|_| false).collect()
}

/// The triangles of the objects before they are cut.
fn planned_meshes(scene: &Scene, triangle_rows: u32) -> Vec<[u32; 3]> {
    let mut first = 0;
    let mut out = Vec::new();
    for (k, mesh) in scene.meshes.iter().enumerate() {
        let n = mesh.triangles.len() as u32;
        out.push([k as u32, first, n]);
        first += triangle_rows * n;
    }
    out
}

/// Rows of the buffer of objects, from the sizes of their meshes: six a record, and at most one node of two rows for every
/// second triangle, the triangles and their materials.
fn planned_rows(scene: &Scene, looks: bool) -> u32 {
    let objects = &scene.description.objects;
    let records = 6 * objects.len();
    let each = looks::triangle_rows(looks) as usize;
    let models = objects
        .iter()
        .zip(&scene.meshes)
        .filter(|(object, _)| matches!(object.shape, Shape::Model { .. }))
        .map(|(_, mesh)| (1 + each) * mesh.triangles.len() + 2 + looks::planned_rows(mesh));
    (records + models.sum::<usize>()) as u32
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Nothing that chooses shader pieces, each alone, all but each, and everything.
    pub(crate) fn all_kinds() -> Vec<Facts> {
        let settings = Settings::new(crate::Technique::Heightfield);
        let water = FieldShape::new(UVec2::new(33, 17), 0, &settings).unwrap();
        let single = (0..6).map(|k| 1 << k);
        [0, 63]
            .into_iter()
            .chain(single.clone())
            .chain(single.map(|bit| 63 - bit))
            .map(|bits: u32| {
                let has = |k: u32| bits >> k & 1 == 1;
                Facts {
                    size: [16, 8],
                    sky: has(0).then_some([64, 32]),
                    objects: u32::from(has(1)),
                    looks: has(1) && has(5),
                    solid_rows: 6,
                    spray: has(2),
                    foam: if has(3) { 33 * 17 } else { 0 },
                    foreign: has(2),
                    caustics: has(4).then_some(CausticSizes {
                        photons: [64, 32],
                        map: [33, 17],
                        filter: has(5),
                    }),
                    noise: true,
                    open: 0,
                    fields: [
                        water,
                        FieldShape::new(UVec2::new(4, 4), u64::from(water.end), &settings).unwrap(),
                    ],
                    sun: true,
                    sides: vec![false, has(0)],
                    mesh: MeshSizes {
                        ground: [8; 2],
                        wall: 4,
                        tiles: 1,
                        objects: if has(1) { vec![[0, 0, 12]] } else { vec![] },
                        triangle_rows: looks::triangle_rows(has(1) && has(5)),
                    },
                }
            })
            .collect()
    }

    #[test]
    fn the_parts_of_a_field_follow_each_other() {
        let mut settings = Settings::new(crate::Technique::Heightfield);
        let shape = FieldShape::new(UVec2::new(9, 5), 10, &settings).unwrap();
        assert_eq!((shape.heights, shape.slopes, shape.pyramid[0]), (10, 55, 145));
        // 8 × 4 patches: 4 × 2, 2 × 1, 1 × 1 blocks.
        assert_eq!(
            (shape.levels, shape.pyramid[1], shape.pyramid[2], shape.end),
            (3, 161, 165, 167)
        );
        assert!(FieldShape::new(UVec2::splat(60_000), 0, &settings).is_none());
        // Two samples a word, rows of five words; a word for each slope, radius and block.
        settings.heights = Heights::Sixteen;
        settings.walk = Walk::SafetyMap;
        let small = FieldShape::new(UVec2::new(9, 5), 10, &settings).unwrap();
        assert_eq!(
            (small.slopes, small.radii, small.pyramid[0], small.end),
            (35, 80, 125, 136)
        );
    }
}
