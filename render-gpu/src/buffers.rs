//! Buffers that are kept from frame to frame.

use crate::device::Gpu;
use std::collections::BTreeMap;

/// Buffers by name; each grows when it must and otherwise stays.
#[derive(Debug, Default)]
pub(crate) struct Buffers(BTreeMap<&'static str, wgpu::Buffer>);

impl Buffers {
    /// The buffer of that name with room for `bytes`; whether it is another one than before. A buffer more than four times
    /// too large is given back.
    pub(crate) fn fit(
        &mut self,
        gpu: &Gpu,
        name: &'static str,
        bytes: u64,
        usage: wgpu::BufferUsages,
    ) -> (wgpu::Buffer, bool) {
        let bytes = bytes.max(16).next_multiple_of(16);
        if let Some(buffer) = self
            .get(name)
            .filter(|b| b.size() >= bytes && b.size() <= 4 * bytes)
        {
            return (buffer.clone(), false);
        }
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(name),
            size: bytes,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.0.insert(name, buffer.clone());
        (buffer, true)
    }

    /// As [`fit`](Self::fit), with these bytes at its start.
    pub(crate) fn write(
        &mut self,
        gpu: &Gpu,
        name: &'static str,
        bytes: &[u8],
        usage: wgpu::BufferUsages,
    ) -> wgpu::Buffer {
        let (buffer, _) = self.fit(gpu, name, bytes.len() as u64, usage);
        gpu.queue.write_buffer(&buffer, 0, bytes);
        buffer
    }

    /// The buffer of that name, if it is held.
    pub(crate) fn get(&self, name: &str) -> Option<&wgpu::Buffer> {
        self.0.get(name)
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> u64 {
        self.0.values().map(wgpu::Buffer::size).sum()
    }
}
