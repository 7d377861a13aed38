//! Numbers out of a model's buffers. Types, lengths and indices are checked before anything is allocated.

use super::Kind;
use glam::Vec2;
use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Mode;

/// The bytes of every buffer.
pub(super) struct Accessors(pub(super) Vec<Vec<u8>>);

impl Accessors {
    /// The triangles of a primitive of `count` vertices, all of one sense.
    pub(super) fn triangles(
        &self,
        primitive: &gltf::Primitive<'_>,
        count: usize,
    ) -> Result<Vec<[u32; 3]>, Kind> {
        let indices = match primitive.indices() {
            Some(accessor) => self.indices(&accessor)?,
            None => (0..count as u32).collect(),
        };
        if let Some(&index) = indices.iter().find(|&&k| k as usize >= count) {
            return Err(Kind::Index { index, count });
        }
        let strip = |w: (usize, &[u32])| {
            if w.0.is_multiple_of(2) {
                [w.1[0], w.1[1], w.1[2]]
            } else {
                [w.1[1], w.1[0], w.1[2]]
            }
        };
        Ok(match primitive.mode() {
            Mode::TriangleStrip => indices.windows(3).enumerate().map(strip).collect(),
            Mode::TriangleFan => {
                let hub = indices.first().copied().unwrap_or(0);
                indices
                    .get(1..)
                    .unwrap_or(&[])
                    .windows(2)
                    .map(|w| [hub, w[0], w[1]])
                    .collect()
            }
            _ => indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        })
    }

    fn indices(&self, accessor: &gltf::Accessor<'_>) -> Result<Vec<u32>, Kind> {
        let size = match (accessor.dimensions(), accessor.data_type()) {
            (Dimensions::Scalar, DataType::U8) => 1,
            (Dimensions::Scalar, DataType::U16) => 2,
            (Dimensions::Scalar, DataType::U32) => 4,
            (_, other) => return Err(Kind::Unsupported(format!("indices of type {other:?}"))),
        };
        let value = |b: &[u8]| b.iter().rev().fold(0_u32, |v, &byte| v << 8 | u32::from(byte));
        Ok(self.elements(accessor, size)?.map(value).collect())
    }

    pub(super) fn vectors<const N: usize>(
        &self,
        accessor: &gltf::Accessor<'_>,
    ) -> Result<Vec<[f32; N]>, Kind> {
        let dimensions = [Dimensions::Scalar, Dimensions::Vec2, Dimensions::Vec3][N - 1];
        if (accessor.dimensions(), accessor.data_type()) != (dimensions, DataType::F32) {
            let what = format!(
                "vertices of type {:?} {:?}",
                accessor.dimensions(),
                accessor.data_type()
            );
            return Err(Kind::Unsupported(what));
        }
        let number =
            |b: &[u8], k: usize| f32::from_le_bytes([b[4 * k], b[4 * k + 1], b[4 * k + 2], b[4 * k + 3]]);
        Ok(self
            .elements(accessor, 4 * N)?
            .map(|b| std::array::from_fn(|k| number(b, k)))
            .collect())
    }

    pub(super) fn texcoords(&self, accessor: &gltf::Accessor<'_>) -> Result<Vec<Vec2>, Kind> {
        let share = |low: u8, high: u8| f32::from(u16::from_le_bytes([low, high])) / 65_535.0;
        Ok(match (accessor.dimensions(), accessor.data_type()) {
            (Dimensions::Vec2, DataType::F32) => {
                let finite = |uv: [f32; 2]| Vec2::from(uv.map(|v| if v.is_finite() { v } else { 0.0 }));
                self.vectors::<2>(accessor)?.into_iter().map(finite).collect()
            }
            (Dimensions::Vec2, DataType::U8) => {
                let of = |b: &[u8]| Vec2::new(f32::from(b[0]), f32::from(b[1])) / 255.0;
                self.elements(accessor, 2)?.map(of).collect()
            }
            (Dimensions::Vec2, DataType::U16) => self
                .elements(accessor, 4)?
                .map(|b| Vec2::new(share(b[0], b[1]), share(b[2], b[3])))
                .collect(),
            _ => Vec::new(),
        })
    }

    /// The bytes of a view of a buffer; `None` where it reaches beyond.
    pub(super) fn view(&self, view: &gltf::buffer::View<'_>) -> Option<&[u8]> {
        let bytes = self.0.get(view.buffer().index())?;
        bytes.get(view.offset()..view.offset().checked_add(view.length())?)
    }

    /// The bytes of each element, checked against view and buffer before anything is allocated.
    fn elements(
        &self,
        accessor: &gltf::Accessor<'_>,
        size: usize,
    ) -> Result<impl Iterator<Item = &[u8]>, Kind> {
        if accessor.sparse().is_some() {
            return Err(Kind::Unsupported("sparse accessors".into()));
        }
        let Some(view) = accessor.view() else {
            return Err(Kind::Unsupported("an accessor without data".into()));
        };
        let (count, stride) = (accessor.count(), view.stride().unwrap_or(size).max(size));
        let offset = accessor.offset();
        let end = count
            .saturating_sub(1)
            .saturating_mul(stride)
            .saturating_add(size)
            .saturating_add(offset);
        let end = if count == 0 { offset } else { end };
        let buffer = self.0.get(view.buffer().index()).map_or(&[][..], |b| b);
        let start = view.offset().min(buffer.len());
        let data = &buffer[start
            ..view
                .offset()
                .saturating_add(view.length())
                .clamp(start, buffer.len())];
        if end > data.len() {
            return Err(Kind::Truncated {
                accessor: accessor.index(),
                needed: end as u64,
                found: data.len() as u64,
            });
        }
        Ok((0..count).map(move |k| &data[offset + k * stride..offset + k * stride + size]))
    }
}
