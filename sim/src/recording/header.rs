//! A scene as the payload of a file's first chunk: everything needed to draw the frames on another machine.

use super::codec::{self, MAX_HEADER_STRUCTURE, StoredHeader, StoredMesh, StoredPlane, StoredSky};
use super::looks;
use super::plane::{self, Layout};
use crate::frame::Channels;
use crate::grid::{Grid, GridSpec};
use crate::mesh::TriangleMesh;
use crate::scene::description::{Bed, Description};
use crate::scene::{Panorama, Scene};
use glam::{UVec2, Vec2, Vec3};
use half::f16;
use std::path::Path;

/// Most vertices or triangles of one mesh.
const MAX_MESH: u32 = 1 << 26;
/// Most meshes.
const MAX_MESHES: usize = super::MAX_BODIES;
/// Most pixels of a sky.
const MAX_SKY: u64 = 1 << 27;

/// What a header says.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub(super) producer: String,
    pub(super) scene: Scene,
    pub(super) channels: Channels,
    pub(super) tolerance: f32,
    pub(super) rate: f64,
}

/// Appends the payload for `scene` to `out`.
pub(super) fn encode(scene: &Scene, channels: Channels, out: &mut Vec<u8>) -> Result<(), String> {
    let recording = &scene.description.recording;
    if !(recording.tolerance.is_finite() && recording.tolerance >= 0.0) {
        return Err(format!(
            "recording.tolerance is {}; it must be 0 (lossless) or positive",
            recording.tolerance
        ));
    }
    scene.grid.validate().map_err(|e| e.to_string())?;
    let mut pack = Packer::default();
    if let Some(terrain) = &scene.terrain {
        terrain.spec().validate().map_err(|e| format!("terrain: {e}"))?;
        pack.grid(terrain)?;
    }
    if scene.meshes.len() > MAX_MESHES {
        return Err(format!(
            "it has {} meshes; at most {MAX_MESHES} can be stored",
            scene.meshes.len()
        ));
    }
    let mut meshes = Vec::with_capacity(scene.meshes.len());
    for (n, mesh) in scene.meshes.iter().enumerate() {
        meshes.push(pack.mesh(mesh).map_err(|e| format!("mesh {n}: {e}"))?);
    }
    let sky = scene.sky.as_ref().map(|sky| pack.sky(sky)).transpose()?;
    if let Some(initial) = &scene.initial_elevation {
        if initial.spec() != &scene.grid {
            return Err("the initial elevation stands on another grid than the scene".to_owned());
        }
        pack.grid(initial)?;
    }
    if ![0, uplifts(&scene.description)].contains(&scene.uplifts.len()) {
        return Err("an array of heights by which the ground rises is not there".to_owned());
    }
    for uplift in &scene.uplifts {
        if uplift.spec() != &scene.grid {
            return Err(
                "an array by which the ground rises stands on another grid than the scene".to_owned(),
            );
        }
        pack.grid(uplift)?;
    }
    let stored = StoredHeader {
        producer: concat!("meniscus ", env!("CARGO_PKG_VERSION")).to_owned(),
        scene: scene.description.to_toml(),
        grid: scene.grid.into(),
        channels: channels.bits(),
        rate: recording.rate,
        tolerance: recording.tolerance,
        terrain: scene.terrain.as_ref().map(|t| (*t.spec()).into()),
        meshes,
        sky,
        has_initial_elevation: scene.initial_elevation.is_some(),
        planes: pack.planes,
    };
    let start = out.len();
    codec::put(&stored, MAX_HEADER_STRUCTURE, out)?;
    out.extend_from_slice(&pack.data);
    looks::encode(&scene.meshes, out)?;
    // A scene that a reader would refuse is refused now, while there is nothing to lose.
    match decode(&out[start..], u64::MAX) {
        Ok(_) => Ok(()),
        Err(HeaderError::Damaged(reason)) => Err(reason),
        Err(HeaderError::TooLarge(bytes)) => Err(format!("its arrays take {bytes} bytes")),
    }
}

/// Arrays that are being stored.
#[derive(Default)]
pub(super) struct Packer {
    pub(super) planes: Vec<StoredPlane>,
    pub(super) data: Vec<u8>,
}

impl Packer {
    fn floats(&mut self, values: &[f32], row: usize) -> Result<(), String> {
        if let Some(bad) = values.iter().find(|v| !v.is_finite()) {
            return Err(format!("it holds {bad}; every value must be finite"));
        }
        let layout = Layout::new(values.len(), row);
        self.planes
            .push(plane::pack(values, layout, 0.0, &mut self.data)?);
        Ok(())
    }

    pub(super) fn integers(&mut self, values: &[u32], row: usize) -> Result<(), String> {
        let layout = Layout::new(values.len(), row);
        self.planes
            .push(plane::pack_integers(values, layout, &mut self.data)?);
        Ok(())
    }

    fn components<T, const N: usize>(
        &mut self,
        values: &[T],
        row: usize,
        parts: fn(&T) -> [f32; N],
    ) -> Result<(), String> {
        for n in 0..N {
            let plane: Vec<f32> = values.iter().map(|v| parts(v)[n]).collect();
            self.floats(&plane, row)?;
        }
        Ok(())
    }

    fn grid(&mut self, grid: &Grid<f32>) -> Result<(), String> {
        self.floats(grid.as_slice(), grid.spec().width())
    }

    fn mesh(&mut self, mesh: &TriangleMesh) -> Result<StoredMesh, String> {
        let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
        let limit = MAX_MESH as usize;
        if vertices > limit || triangles > limit {
            return Err(format!(
                "{vertices} vertices and {triangles} triangles; at most {limit} each"
            ));
        }
        if mesh.normals.len() != vertices || ![0, vertices].contains(&mesh.texcoords.len()) {
            return Err("normals and texture coordinates must be as many as positions".to_owned());
        }
        if mesh.triangles.iter().flatten().any(|&v| v as usize >= vertices) {
            return Err("a triangle names a vertex that is not there".to_owned());
        }
        self.components(&mesh.positions, vertices, |v| v.to_array())?;
        self.components(&mesh.normals, vertices, |v| v.to_array())?;
        if !mesh.texcoords.is_empty() {
            self.components(&mesh.texcoords, vertices, |v| v.to_array())?;
        }
        for n in 0..3 {
            let plane: Vec<u32> = mesh.triangles.iter().map(|t| t[n]).collect();
            self.integers(&plane, triangles)?;
        }
        Ok(StoredMesh {
            vertices: vertices as u32,
            has_texcoords: !mesh.texcoords.is_empty(),
            triangles: triangles as u32,
            base_color: mesh.base_color.to_array(),
        })
    }

    fn sky(&mut self, sky: &Panorama) -> Result<StoredSky, String> {
        let pixels = u64::from(sky.size.x) * u64::from(sky.size.y);
        if pixels > MAX_SKY || pixels != sky.pixels.len() as u64 {
            return Err(format!(
                "a sky of {} x {} with {} pixels; they must agree and be at most {MAX_SKY}",
                sky.size.x,
                sky.size.y,
                sky.pixels.len()
            ));
        }
        let row = sky.size.x as usize;
        // HDR pictures mostly come as half floats: then 16 bits hold the same value.
        let exact = |v: &f32| f16::from_f32(*v).to_f32().to_bits() == v.to_bits();
        let half = sky.pixels.iter().all(|p| p.to_array().iter().all(exact));
        if half {
            for n in 0..3 {
                let bits = |p: &Vec3| u32::from(f16::from_f32(p[n]).to_bits());
                let plane: Vec<u32> = sky.pixels.iter().map(bits).collect();
                self.integers(&plane, row)?;
            }
        } else {
            self.components(&sky.pixels, row, |p| p.to_array())?;
        }
        Ok(StoredSky {
            width: sky.size.x,
            height: sky.size.y,
            half,
        })
    }
}

/// Why a header cannot be decoded.
pub(super) enum HeaderError {
    /// Something does not fit.
    Damaged(String),
    /// Its arrays take more bytes than allowed.
    TooLarge(u64),
}

impl From<String> for HeaderError {
    fn from(reason: String) -> Self {
        Self::Damaged(reason)
    }
}

/// Decodes a header's payload, whose arrays may take `limit` bytes.
pub(super) fn decode(payload: &[u8], limit: u64) -> Result<Header, HeaderError> {
    let (stored, data): (StoredHeader, _) = codec::take::<_, MAX_HEADER_STRUCTURE>(payload)?;
    let grid = stored.grid.to_spec()?;
    let terrain = stored
        .terrain
        .map(|t| t.to_spec().map_err(|e| format!("terrain: {e}")))
        .transpose()?;
    let channels = Channels::from_bits(stored.channels)
        .ok_or_else(|| format!("it names channels that are unknown ({:#x})", stored.channels))?;
    if !(stored.tolerance.is_finite() && stored.tolerance >= 0.0) {
        return Err(format!("its tolerance is {}", stored.tolerance).into());
    }
    let name = Path::new("scene of the recording");
    let description = Description::of_recording(&stored.scene, name).map_err(|e| e.to_string())?;
    let mut layouts = layouts(&stored, grid, terrain)?;
    // Files without these arrays were written before they were kept.
    let kept = stored.planes.len() > layouts.len();
    let uplifts = if kept { uplifts(&description) } else { 0 };
    layouts.extend(std::iter::repeat_n(
        Layout::new(grid.len(), grid.width()),
        uplifts,
    ));
    if layouts.len() != stored.planes.len() {
        return Err(format!(
            "it has {} arrays instead of {}",
            stored.planes.len(),
            layouts.len()
        )
        .into());
    }
    let (mut bytes, mut decoded) = (0_u64, 0_u64);
    for (plane, layout) in stored.planes.iter().zip(&layouts) {
        bytes += plane.check(*layout)?;
        decoded += 4 * layout.count as u64;
    }
    let arrays = usize::try_from(bytes).ok().and_then(|n| data.split_at_checked(n));
    let (arrays, behind) =
        arrays.ok_or_else(|| format!("its arrays take {bytes} bytes, {} are there", data.len()))?;
    if decoded > limit {
        return Err(HeaderError::TooLarge(decoded));
    }
    let mut unpack = Unpacker::new(stored.planes.iter().zip(layouts), arrays);
    let terrain = terrain.map(|spec| unpack.grid(spec)).transpose()?;
    let mut meshes = Vec::with_capacity(stored.meshes.len());
    for mesh in &stored.meshes {
        meshes.push(unpack.mesh(mesh)?);
    }
    if !behind.is_empty() {
        looks::decode(behind, &mut meshes, limit - decoded)?;
    }
    let sky = stored.sky.map(|sky| unpack.sky(sky)).transpose()?;
    let initial_elevation = stored
        .has_initial_elevation
        .then(|| unpack.grid(grid))
        .transpose()?;
    let uplifts = (0..uplifts)
        .map(|_| unpack.grid(grid))
        .collect::<Result<_, _>>()?;
    let scene =
        Scene::from_parts(description, terrain, meshes, sky, initial_elevation).map_err(|e| e.to_string())?;
    let scene = Scene { uplifts, ..scene };
    if scene.grid != grid {
        return Err(format!("its grid is {grid:?}, that of its scene {:?}", scene.grid).into());
    }
    Ok(Header {
        producer: stored.producer,
        scene,
        channels,
        tolerance: stored.tolerance,
        rate: stored.rate,
    })
}

/// How many arrays raise the ground of a scene.
fn uplifts(description: &Description) -> usize {
    let beds = description.beds.iter();
    beds.filter(|bed| matches!(bed, Bed::Array { .. })).count()
}

/// The arrays of a header, in the order in which they are stored, but for those that raise the ground.
fn layouts(stored: &StoredHeader, grid: GridSpec, terrain: Option<GridSpec>) -> Result<Vec<Layout>, String> {
    let of_grid = |spec: GridSpec| Layout::new(spec.len(), spec.width());
    let mut list = Vec::new();
    list.extend(terrain.map(of_grid));
    if stored.meshes.len() > MAX_MESHES {
        return Err(format!("it claims {} meshes", stored.meshes.len()));
    }
    for mesh in &stored.meshes {
        if mesh.vertices > MAX_MESH || mesh.triangles > MAX_MESH {
            return Err(format!(
                "a mesh claims {} vertices",
                mesh.vertices.max(mesh.triangles)
            ));
        }
        let (vertices, triangles) = (mesh.vertices as usize, mesh.triangles as usize);
        let arrays = if mesh.has_texcoords { 8 } else { 6 };
        list.extend(std::iter::repeat_n(Layout::new(vertices, vertices), arrays));
        list.extend(std::iter::repeat_n(Layout::new(triangles, triangles), 3));
    }
    if let Some(sky) = stored.sky {
        let pixels = u64::from(sky.width) * u64::from(sky.height);
        if pixels > MAX_SKY {
            return Err(format!("its sky claims {pixels} pixels"));
        }
        list.extend(std::iter::repeat_n(
            Layout::new(pixels as usize, sky.width as usize),
            3,
        ));
    }
    list.extend(stored.has_initial_elevation.then(|| of_grid(grid)));
    Ok(list)
}

/// Arrays that are being read.
pub(super) struct Unpacker<'a, I> {
    planes: I,
    data: &'a [u8],
}

impl<'a, 'p, I: Iterator<Item = (&'p StoredPlane, Layout)>> Unpacker<'a, I> {
    pub(super) fn new(planes: I, data: &'a [u8]) -> Self {
        Self { planes, data }
    }

    fn next(&mut self) -> Result<(&'p StoredPlane, Layout), String> {
        self.planes
            .next()
            .ok_or_else(|| "it has too few arrays".to_owned())
    }

    fn floats(&mut self) -> Result<Vec<f32>, String> {
        let (plane, layout) = self.next()?;
        let mut values = vec![0.0; layout.count];
        let mut tasks = Vec::new();
        plane.unpack(&mut self.data, layout, &mut values, &mut tasks)?;
        plane::run(tasks)?;
        if values.iter().any(|v| !v.is_finite()) {
            return Err("an array holds a value that is not finite".to_owned());
        }
        Ok(values)
    }

    pub(super) fn integers(&mut self) -> Result<Vec<u32>, String> {
        let (plane, layout) = self.next()?;
        let mut values = vec![0; layout.count];
        let mut tasks = Vec::new();
        plane.unpack_integers(&mut self.data, layout, &mut values, &mut tasks)?;
        plane::run(tasks)?;
        Ok(values)
    }

    fn components<T: Clone + Default, const N: usize>(
        &mut self,
        count: usize,
        parts: fn(&mut T) -> &mut [f32; N],
    ) -> Result<Vec<T>, String> {
        let mut out = vec![T::default(); count];
        for n in 0..N {
            for (element, value) in out.iter_mut().zip(self.floats()?) {
                parts(element)[n] = value;
            }
        }
        Ok(out)
    }

    fn grid(&mut self, spec: GridSpec) -> Result<Grid<f32>, String> {
        Grid::from_vec(spec, self.floats()?).map_err(|e| e.to_string())
    }

    fn mesh(&mut self, stored: &StoredMesh) -> Result<TriangleMesh, String> {
        let (vertices, triangles) = (stored.vertices as usize, stored.triangles as usize);
        let positions = self.components(vertices, |v: &mut Vec3| v.as_mut())?;
        let normals = self.components(vertices, |v: &mut Vec3| v.as_mut())?;
        let texcoords = if stored.has_texcoords {
            self.components(vertices, |v: &mut Vec2| v.as_mut())?
        } else {
            Vec::new()
        };
        let mut corners = vec![[0; 3]; triangles];
        for n in 0..3 {
            for (corner, value) in corners.iter_mut().zip(self.integers()?) {
                corner[n] = value;
            }
        }
        if corners.iter().flatten().any(|&v| v >= stored.vertices) {
            return Err("a triangle names a vertex that is not there".to_owned());
        }
        Ok(TriangleMesh {
            positions,
            normals,
            texcoords,
            triangles: corners,
            base_color: Vec3::from(stored.base_color),
            ..TriangleMesh::default()
        })
    }

    fn sky(&mut self, stored: StoredSky) -> Result<Panorama, String> {
        let size = UVec2::new(stored.width, stored.height);
        let count = stored.width as usize * stored.height as usize;
        let pixels = if stored.half {
            let mut pixels = vec![Vec3::ZERO; count];
            for n in 0..3 {
                for (pixel, bits) in pixels.iter_mut().zip(self.integers()?) {
                    let bits =
                        u16::try_from(bits).map_err(|_| "its sky holds numbers that are not half floats")?;
                    pixel[n] = f16::from_bits(bits).to_f32();
                }
            }
            pixels
        } else {
            self.components(count, |v: &mut Vec3| v.as_mut())?
        };
        if pixels.iter().any(|p| !p.is_finite()) {
            return Err("its sky holds a value that is not finite".to_owned());
        }
        Ok(Panorama { size, pixels })
    }
}
