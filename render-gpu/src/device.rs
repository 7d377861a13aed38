//! The device that everything runs on, what it can do, and what went wrong on it.

use crate::AdapterDescription;
use crate::adapters::{self, DeviceError};
use crate::shader::Constants;
use std::sync::{Arc, Mutex, PoisonError};

/// Names the adapter to use, by a part of its name; the best one without.
pub const ADAPTER_VARIABLE: &str = "MENISCUS_ADAPTER";

/// What went wrong on a device since it was last asked.
#[derive(Debug, Default)]
struct Trouble {
    lost: Option<String>,
    errors: Vec<String>,
}

/// A device with its queue.
#[derive(Debug)]
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// The adapter.
    pub description: AdapterDescription,
    /// Nanoseconds a tick of timestamp queries, where passes can be timed.
    pub tick: Option<f32>,
    /// Where its shaders find what is the same for all threads.
    pub constants: Constants,
    trouble: Arc<Mutex<Trouble>>,
    /// Whether somebody else uses the device too.
    shared: bool,
}

impl Drop for Gpu {
    /// Frees what the device holds now, not when the last reference to one of its resources goes; a shared device stays.
    fn drop(&mut self) {
        if !self.shared {
            self.device.destroy();
        }
    }
}

impl Constants {
    fn of(adapter: &wgpu::AdapterInfo) -> Self {
        match adapter.device_type {
            wgpu::DeviceType::Cpu => Self::Storage,
            _ => Self::Uniform,
        }
    }
}

impl Gpu {
    /// Opens the adapter that [`ADAPTER_VARIABLE`] names, else the best one. Limits beyond WebGPU's defaults are asked for
    /// only where sizes depend on the scene.
    ///
    /// # Errors
    /// [`DeviceError`]: there is no (such) adapter, or its driver refuses.
    pub fn open() -> Result<Self, DeviceError> {
        let wanted = std::env::var(ADAPTER_VARIABLE)
            .ok()
            .filter(|name| !name.is_empty());
        let adapter = adapters::find(wanted.as_deref())?;
        let info = adapter.get_info();
        let (device, queue) =
            pollster::block_on(adapter.request_device(&Self::needs(&adapter))).map_err(|source| {
                DeviceError::Refused {
                    name: info.name.clone(),
                    source,
                }
            })?;
        Ok(Self::with(device, queue, &info, false))
    }

    /// What a device that renderers share with a window is to be requested with.
    pub fn needs(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
        let theirs = adapter.limits();
        let defaults = wgpu::Limits::default();
        wgpu::DeviceDescriptor {
            label: Some("meniscus"),
            required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            required_limits: wgpu::Limits {
                max_texture_dimension_2d: theirs.max_texture_dimension_2d,
                max_buffer_size: theirs.max_buffer_size,
                max_storage_buffer_binding_size: theirs.max_storage_buffer_binding_size,
                max_storage_buffers_per_shader_stage: match Constants::of(&adapter.get_info()) {
                    Constants::Uniform => defaults.max_storage_buffers_per_shader_stage,
                    Constants::Storage => theirs.max_storage_buffers_per_shader_stage,
                },
                ..defaults
            },
            ..Default::default()
        }
    }

    /// A device that somebody else opened, with what [`Self::needs`] says, and uses too. Its errors and its loss are
    /// listened to from now on.
    pub fn shared(device: wgpu::Device, queue: wgpu::Queue, info: &wgpu::AdapterInfo) -> Self {
        Self::with(device, queue, info, true)
    }

    fn with(device: wgpu::Device, queue: wgpu::Queue, info: &wgpu::AdapterInfo, shared: bool) -> Self {
        let timed = device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        let trouble = Arc::new(Mutex::new(Trouble::default()));
        let on_error = Arc::clone(&trouble);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let mut trouble = on_error.lock().unwrap_or_else(PoisonError::into_inner);
            trouble.errors.push(error.to_string());
        }));
        let on_loss = Arc::clone(&trouble);
        device.set_device_lost_callback(move |reason, message| {
            let mut trouble = on_loss.lock().unwrap_or_else(PoisonError::into_inner);
            trouble.lost = Some(format!("{reason:?}: {message}"));
        });
        Self {
            tick: timed.then(|| queue.get_timestamp_period()),
            constants: Constants::of(info),
            device,
            queue,
            description: adapters::describe(info),
            trouble,
            shared,
        }
    }

    /// The usage of buffers that hold what is the same for all threads.
    pub(crate) fn constants_usage(&self) -> wgpu::BufferUsages {
        match self.constants {
            Constants::Uniform => wgpu::BufferUsages::UNIFORM,
            Constants::Storage => wgpu::BufferUsages::STORAGE,
        }
    }

    /// Why the device is gone, if it is.
    pub fn lost(&self) -> Option<String> {
        self.trouble
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .lost
            .clone()
    }

    /// The first error since the last call, if there was one.
    pub fn take_error(&self) -> Option<String> {
        let mut trouble = self.trouble.lock().unwrap_or_else(PoisonError::into_inner);
        let first = (!trouble.errors.is_empty()).then(|| trouble.errors.swap_remove(0));
        trouble.errors.clear();
        first
    }

    /// The limits that were granted.
    pub fn limits(&self) -> wgpu::Limits {
        self.device.limits()
    }
}
