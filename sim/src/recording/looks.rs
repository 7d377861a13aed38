//! What meshes look like, behind the arrays of a header: a structure with arrays of its own.
//!
//! A file whose meshes have one colour each does without, and files written before it was kept lack it: their models have
//! the means of their textures.

use super::codec::{self, MAX_HEADER_STRUCTURE, StoredLook, StoredLooks, StoredMaterial, StoredTexture};
use super::header::{HeaderError, Packer, Unpacker};
use super::plane::Layout;
use crate::mesh::{Material, Shine, Texture, TriangleMesh, Wrap};
use glam::{UVec2, Vec3};

/// Most texels along a side of a texture.
const MAX_SIDE: u32 = 1 << 14;
/// Most materials of one mesh.
const MAX_MATERIALS: usize = 1 << 16;

/// How borders are stored, by number.
const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];

/// Appends the materials of `meshes` to `out`, if any has some.
pub(super) fn encode(meshes: &[TriangleMesh], out: &mut Vec<u8>) -> Result<(), String> {
    let mut pack = Packer::default();
    let mut looks = Vec::new();
    for (number, mesh) in meshes.iter().enumerate() {
        if !mesh.materials.is_empty() {
            let look = pack
                .look(number, mesh)
                .map_err(|e| format!("mesh {number}: {e}"))?;
            looks.push(look);
        }
    }
    if looks.is_empty() {
        return Ok(());
    }
    let planes = pack.planes;
    codec::put(&StoredLooks { looks, planes }, MAX_HEADER_STRUCTURE, out)?;
    out.extend_from_slice(&pack.data);
    Ok(())
}

impl Packer {
    fn look(&mut self, number: usize, mesh: &TriangleMesh) -> Result<StoredLook, String> {
        let numbers: Vec<u32> = mesh.material_of.iter().map(|m| u32::from(*m)).collect();
        self.integers(&numbers, numbers.len())?;
        let mut materials = Vec::with_capacity(mesh.materials.len());
        for material in &mesh.materials {
            if let Some(texture) = &material.texture {
                for channel in 0..3 {
                    let values: Vec<u32> = texture.texels.iter().map(|t| u32::from(t[channel])).collect();
                    self.integers(&values, texture.size.x as usize)?;
                }
            }
            materials.push(StoredMaterial {
                color: material.color.to_array(),
                shine: material.shine.map(|s| [s.roughness, s.metallic]),
                texture: material.texture.as_ref().map(|t| StoredTexture {
                    size: t.size.to_array(),
                    wrap: t.wrap.map(number_of),
                }),
            });
        }
        Ok(StoredLook {
            mesh: u32::try_from(number).map_err(|e| e.to_string())?,
            materials,
        })
    }
}

fn number_of(wrap: Wrap) -> u8 {
    match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    }
}

/// Gives `meshes` the materials that `bytes` hold; their arrays may take `limit` bytes.
pub(super) fn decode(bytes: &[u8], meshes: &mut [TriangleMesh], limit: u64) -> Result<(), HeaderError> {
    let (stored, data): (StoredLooks, _) = codec::take::<_, MAX_HEADER_STRUCTURE>(bytes)?;
    let layouts = layouts(&stored, meshes)?;
    if layouts.len() != stored.planes.len() {
        let (found, wanted) = (stored.planes.len(), layouts.len());
        return Err(format!("its materials have {found} arrays instead of {wanted}").into());
    }
    let (mut length, mut decoded) = (0_u64, 0_u64);
    for (plane, layout) in stored.planes.iter().zip(&layouts) {
        length += plane.check(*layout)?;
        decoded += 4 * layout.count as u64;
    }
    if length != data.len() as u64 {
        let found = data.len();
        return Err(format!("its materials take {length} bytes, {found} are there").into());
    }
    if decoded > limit {
        return Err(HeaderError::TooLarge(decoded));
    }
    let mut unpack = Unpacker::new(stored.planes.iter().zip(layouts), data);
    for look in &stored.looks {
        let mesh = &mut meshes[look.mesh as usize];
        let numbers = unpack.integers()?;
        let number = |n: u32| {
            u16::try_from(n)
                .ok()
                .filter(|n| usize::from(*n) < look.materials.len())
        };
        mesh.material_of = (numbers.into_iter().map(number).collect::<Option<_>>())
            .ok_or_else(|| "a triangle names a material that is not there".to_owned())?;
        for material in &look.materials {
            mesh.materials.push(unpack.material(material)?);
        }
    }
    Ok(())
}

/// The arrays of the materials, in the order in which they are stored.
fn layouts(stored: &StoredLooks, meshes: &[TriangleMesh]) -> Result<Vec<Layout>, String> {
    let mut list = Vec::new();
    let mut next = 0;
    for look in &stored.looks {
        let number = look.mesh as usize;
        let mesh = meshes.get(number).filter(|_| number >= next);
        let mesh =
            mesh.ok_or_else(|| format!("it has materials of mesh {number}, which is not there or had some"))?;
        next = number + 1;
        if !(1..=MAX_MATERIALS).contains(&look.materials.len()) {
            return Err(format!("mesh {number} claims {} materials", look.materials.len()));
        }
        let triangles = mesh.triangles.len();
        list.push(Layout::new(triangles, triangles));
        for texture in look.materials.iter().filter_map(|m| m.texture) {
            let [width, height] = texture.size;
            if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
                return Err(format!("a texture claims {width} x {height} texels"));
            }
            if mesh.texcoords.is_empty() {
                return Err(format!("mesh {number} has a texture, but no texture coordinates"));
            }
            let texels = Layout::new(width as usize * height as usize, width as usize);
            list.extend([texels; 3]);
        }
    }
    Ok(list)
}

impl<'p, I: Iterator<Item = (&'p codec::StoredPlane, Layout)>> Unpacker<'_, I> {
    fn material(&mut self, stored: &StoredMaterial) -> Result<Material, String> {
        let shine = stored
            .shine
            .map(|[roughness, metallic]| Shine { roughness, metallic });
        let parts = stored.color.into_iter().chain(stored.shine.into_iter().flatten());
        if let Some(bad) = parts.into_iter().find(|v| !(0.0..=1.0).contains(v)) {
            return Err(format!("a material holds {bad}, which is not within 0 and 1"));
        }
        Ok(Material {
            color: Vec3::from(stored.color),
            texture: stored.texture.map(|t| self.texture(t)).transpose()?,
            shine,
        })
    }

    fn texture(&mut self, stored: StoredTexture) -> Result<Texture, String> {
        let size = UVec2::from(stored.size);
        let mut texels = vec![[0; 3]; size.as_usizevec2().element_product()];
        for channel in 0..3 {
            for (texel, value) in texels.iter_mut().zip(self.integers()?) {
                texel[channel] =
                    u8::try_from(value).map_err(|_| format!("a texture holds {value}, which is no byte"))?;
            }
        }
        let wrap = |n: u8| {
            let wrap = WRAPS.get(usize::from(n)).copied();
            wrap.ok_or_else(|| format!("a texture's border is of kind {n}, which is unknown"))
        };
        let wrap = [wrap(stored.wrap[0])?, wrap(stored.wrap[1])?];
        Ok(Texture { size, texels, wrap })
    }
}
