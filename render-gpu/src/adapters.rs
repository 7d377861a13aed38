//! The adapters that this machine offers.

use crate::AdapterDescription;
use std::sync::OnceLock;

/// Why no device could be opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// No adapter at all.
    #[error(
        "no Vulkan, Metal or Direct3D 12 adapter was found; install a driver (on Debian or Ubuntu without a GPU: \
         apt-get install mesa-vulkan-drivers libvulkan1) or use a CPU renderer"
    )]
    NoAdapter,
    /// None of that name.
    #[error(
        "no adapter's name contains `{wanted}`; there are {known} (environment variable MENISCUS_ADAPTER)"
    )]
    Unknown {
        /// What was asked for.
        wanted: String,
        /// What there is.
        known: String,
    },
    /// The driver refused.
    #[error("adapter `{name}` refused a device: {source}")]
    Refused {
        /// The adapter.
        name: String,
        /// What the driver said.
        source: wgpu::RequestDeviceError,
    },
}

/// The process's one connection to its drivers. Some drivers allow only some thirty in a process and give them back late,
/// so each renderer cannot have its own.
fn instance() -> &'static wgpu::Instance {
    static INSTANCE: OnceLock<wgpu::Instance> = OnceLock::new();
    INSTANCE.get_or_init(|| wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle()))
}

pub(crate) fn describe(info: &wgpu::AdapterInfo) -> AdapterDescription {
    AdapterDescription {
        name: info.name.clone(),
        kind: match info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete GPU",
            wgpu::DeviceType::IntegratedGpu => "integrated GPU",
            wgpu::DeviceType::VirtualGpu => "virtual GPU",
            wgpu::DeviceType::Cpu => "software",
            wgpu::DeviceType::Other => "other",
        },
        backend: info.backend.to_string(),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
    }
}

/// Fastest kind first.
fn rank(info: &wgpu::AdapterInfo) -> u8 {
    match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

fn sorted() -> Vec<wgpu::Adapter> {
    let mut adapters = pollster::block_on(instance().enumerate_adapters(wgpu::Backends::PRIMARY));
    adapters.sort_by_key(|a| rank(&a.get_info()));
    adapters
}

/// Describes every adapter, the one that would be used first. Empty without any driver.
pub fn list() -> Vec<AdapterDescription> {
    sorted().iter().map(|a| describe(&a.get_info())).collect()
}

/// The first adapter of [`list`] whose name contains `wanted`, in any case.
///
/// # Errors
/// [`DeviceError::NoAdapter`] or [`DeviceError::Unknown`].
pub(crate) fn find(wanted: Option<&str>) -> Result<wgpu::Adapter, DeviceError> {
    let adapters = sorted();
    if adapters.is_empty() {
        return Err(DeviceError::NoAdapter);
    }
    let names: Vec<String> = adapters.iter().map(|a| a.get_info().name).collect();
    let wanted = wanted.unwrap_or("");
    let fits = |name: &str| name.to_lowercase().contains(&wanted.to_lowercase());
    let found = adapters.into_iter().find(|a| fits(&a.get_info().name));
    found.ok_or_else(|| DeviceError::Unknown {
        wanted: wanted.to_owned(),
        known: names
            .iter()
            .map(|n| format!("`{n}`"))
            .collect::<Vec<_>>()
            .join(", "),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Proves that the machine's driver really moves data, not only that it answers.
    #[test]
    fn a_device_copies_a_buffer_and_hands_it_back() {
        let gpu = crate::device::Gpu::open().unwrap();
        let (device, queue) = (&gpu.device, &gpu.queue);
        assert!(!gpu.description.name.is_empty());
        assert!(list().contains(&gpu.description));
        assert!(matches!(
            find(Some("no such card")),
            Err(DeviceError::Unknown { .. })
        ));
        let bytes: Vec<u8> = (0..=255).collect();
        let buffer = |usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: 256,
                usage,
                mapped_at_creation: false,
            })
        };
        let source = buffer(wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST);
        let target = buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
        queue.write_buffer(&source, 0, &bytes);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(&source, 0, &target, 0, 256);
        queue.submit([encoder.finish()]);
        target
            .slice(..)
            .map_async(wgpu::MapMode::Read, |result| result.unwrap());
        device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let read = target.slice(..).get_mapped_range().unwrap().to_vec();
        assert_eq!(read, bytes);
    }
}
