//! Runs the passes of a plan on a device.

use crate::device::Gpu;
use crate::graph::{Format, Graph, Kind, Plan, ResourceId};
use crate::pipelines::{Made, MadeStage, Pipelines, Recipe, ShaderError, StageRecipe};
use crate::shader::Switches;
use crate::work::{Action, Attachment, Cadence, Work};
use std::collections::HashMap;

/// Something that a shader's variable can be bound to.
#[derive(Clone, Debug)]
pub(crate) enum Physical {
    Buffer(wgpu::Buffer),
    Texture(wgpu::TextureView),
}

/// What is bound by name: the frame's data and the graph's imported resources.
pub(crate) type Globals = HashMap<&'static str, Physical>;

/// Why passes could not be run.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ExecuteError {
    #[error(transparent)]
    Shader(#[from] ShaderError),
    #[error("pass `{pass}` binds `{name}`, which nobody provides")]
    Unbound { pass: &'static str, name: String },
}

impl Format {
    fn texture(self) -> wgpu::TextureFormat {
        match self {
            Self::Full => wgpu::TextureFormat::Rgba32Float,
            Self::Half => wgpu::TextureFormat::Rgba16Float,
            Self::Depth => wgpu::TextureFormat::Depth32Float,
        }
    }
}

/// Pipelines, transient memory and small uniforms, kept from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct Executor {
    pub(crate) pipelines: Pipelines,
    pool: Vec<(Kind, Physical)>,
    which: HashMap<[u32; 4], wgpu::Buffer>,
}

/// Times of passes in ticks, filled by the device.
#[derive(Debug)]
pub(crate) struct Stopwatch {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readable: wgpu::Buffer,
    names: Vec<&'static str>,
}

impl Stopwatch {
    pub(crate) fn new(gpu: &Gpu, passes: usize) -> Option<Self> {
        gpu.tick?;
        let count = 2 * passes.max(1) as u32;
        let buffer = |usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: 8 * u64::from(count),
                usage,
                mapped_at_creation: false,
            })
        };
        Some(Self {
            set: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count,
            }),
            resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            readable: buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
            names: Vec::new(),
        })
    }

    fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        let count = 2 * self.names.len() as u32;
        if count > 0 {
            encoder.resolve_query_set(&self.set, 0..count, &self.resolved, 0);
            encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.readable, 0, 8 * u64::from(count));
        }
    }

    /// Adds what was measured to `times`, seconds a pass. Waits for the device.
    pub(crate) fn read(&mut self, gpu: &Gpu, times: &mut Vec<(&'static str, f64)>) {
        let Some(tick) = gpu.tick.filter(|_| !self.names.is_empty()) else {
            return;
        };
        let Some(bytes) = read_buffer(gpu, &self.readable, 16 * self.names.len() as u64) else {
            return;
        };
        let ticks: Vec<u64> = bytes.chunks_exact(8).map(bytemuck::pod_read_unaligned).collect();
        for (name, pair) in self.names.drain(..).zip(ticks.chunks_exact(2)) {
            let seconds = pair[1].saturating_sub(pair[0]) as f64 * f64::from(tick) * 1e-9;
            match times.iter_mut().find(|(n, _)| *n == name) {
                Some((_, sum)) => *sum += seconds,
                None => times.push((name, seconds)),
            }
        }
    }
}

/// The first `size` bytes of a mappable buffer, once the device is done; `None` if it was lost.
pub(crate) fn read_buffer(gpu: &Gpu, buffer: &wgpu::Buffer, size: u64) -> Option<Vec<u8>> {
    let slice = buffer.slice(..size);
    slice.map_async(wgpu::MapMode::Read, |_| {});
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).ok()?;
    let bytes = slice.get_mapped_range().ok()?.to_vec();
    buffer.unmap();
    Some(bytes)
}

impl Executor {
    /// Bytes of transient memory held.
    pub(crate) fn pool_bytes(&self) -> u64 {
        self.pool.iter().map(|(kind, _)| kind.bytes()).sum()
    }

    /// Takes memory for the plan's slots, reusing what the last plan left and freeing the rest.
    pub(crate) fn prepare(&mut self, gpu: &Gpu, plan: &Plan) -> HashMap<ResourceId, Physical> {
        let mut free = std::mem::take(&mut self.pool);
        if self.which.len() > 256 {
            self.which.clear();
        }
        let mut physical = HashMap::new();
        for slot in &plan.slots {
            let at = free.iter().position(|(kind, _)| *kind == slot.kind);
            let taken = match at {
                Some(at) => free.swap_remove(at).1,
                None => allocate(gpu, &slot.kind),
            };
            for &id in &slot.members {
                physical.insert(id, taken.clone());
            }
            self.pool.push((slot.kind.clone(), taken));
        }
        physical
    }

    /// Records the passes of `plan` whose cadence `due` says.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn record(
        &mut self,
        gpu: &Gpu,
        graph: &Graph<Work>,
        plan: &Plan,
        physical: &HashMap<ResourceId, Physical>,
        globals: &Globals,
        switches: &Switches,
        due: impl Fn(Cadence) -> bool,
        encoder: &mut wgpu::CommandEncoder,
        mut stopwatch: Option<&mut Stopwatch>,
    ) -> Result<(), ExecuteError> {
        let of = |id: ResourceId| physical.get(&id).or_else(|| globals.get(graph.name(id)));
        for &k in &plan.passes {
            let pass = &graph.passes()[k];
            let work = &pass.work;
            if !due(work.cadence) {
                continue;
            }
            let unbound = |name: &str| ExecuteError::Unbound {
                pass: pass.name,
                name: name.to_owned(),
            };
            for &id in &work.zero {
                if let Some(Physical::Buffer(buffer)) = of(id) {
                    encoder.clear_buffer(buffer, 0, None);
                }
            }
            let view = |id: ResourceId| match of(id) {
                Some(Physical::Texture(view)) => Ok(view.clone()),
                _ => Err(unbound(graph.name(id))),
            };
            let stage = match &work.action {
                Action::Compute { entry, .. } => StageRecipe::Compute(entry),
                Action::Draw {
                    vertex,
                    fragment,
                    colors,
                    depth,
                    ..
                } => StageRecipe::Draw {
                    vertex,
                    fragment,
                    colors: colors
                        .iter()
                        .map(|c| match graph.kind(c.id) {
                            Kind::Texture { format, .. } => format.texture(),
                            _ => wgpu::TextureFormat::Rgba32Float,
                        })
                        .collect(),
                    depth: depth.is_some(),
                    samples: colors.first().map_or(1, |c| match graph.kind(c.id) {
                        Kind::Texture { samples, .. } => *samples,
                        _ => 1,
                    }),
                },
            };
            let recipe = Recipe {
                pieces: work.pieces.clone(),
                switches: *switches,
                stage,
            };
            let whiches: Vec<[u32; 4]> = match &work.action {
                Action::Compute { dispatches, .. } => dispatches.iter().map(|d| d.which).collect(),
                Action::Draw { draws, .. } => draws.iter().map(|d| d.which).collect(),
            };
            for which in &whiches {
                self.which.entry(*which).or_insert_with(|| {
                    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
                        label: Some("which"),
                        size: 16,
                        usage: gpu.constants_usage() | wgpu::BufferUsages::COPY_DST,
                        mapped_at_creation: false,
                    });
                    gpu.queue.write_buffer(&buffer, 0, bytemuck::cast_slice(which));
                    buffer
                });
            }
            let made = self.pipelines.get(gpu, &recipe)?;
            let mut groups = Vec::new();
            for which in &whiches {
                groups.push(
                    bind(gpu, made, |name| {
                        if name == "which" {
                            return self.which.get(which).cloned().map(Physical::Buffer);
                        }
                        match work.bind.iter().find(|(n, _)| *n == name) {
                            Some((_, id)) => of(*id).cloned(),
                            None => globals.get(name).cloned(),
                        }
                    })
                    .map_err(|name| unbound(&name))?,
                );
            }
            let place = stopwatch.as_deref_mut().map(|s| {
                s.names.push(pass.name);
                2 * (s.names.len() as u32 - 1)
            });
            let set = stopwatch.as_deref().map(|s| &s.set);
            match (&work.action, &made.stage) {
                (Action::Compute { dispatches, .. }, MadeStage::Compute(pipeline)) => {
                    let mut run = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                        label: Some(pass.name),
                        timestamp_writes: set.zip(place).map(|(query_set, at)| {
                            wgpu::ComputePassTimestampWrites {
                                query_set,
                                beginning_of_pass_write_index: Some(at),
                                end_of_pass_write_index: Some(at + 1),
                            }
                        }),
                    });
                    run.set_pipeline(pipeline);
                    for (dispatch, group) in dispatches.iter().zip(&groups) {
                        run.set_bind_group(0, group, &[]);
                        let [x, y, z] = dispatch.groups;
                        run.dispatch_workgroups(x, y, z);
                    }
                }
                (
                    Action::Draw {
                        colors, depth, draws, ..
                    },
                    MadeStage::Draw(pipeline),
                ) => {
                    let views = colors
                        .iter()
                        .map(|c| Ok((view(c.id)?, c.resolve.map(view).transpose()?)))
                        .collect::<Result<Vec<_>, ExecuteError>>()?;
                    let depth_view = depth.map(|d| view(d.id)).transpose()?;
                    let attachments: Vec<_> = colors
                        .iter()
                        .zip(&views)
                        .map(|(attachment, (view, resolved))| {
                            Some(wgpu::RenderPassColorAttachment {
                                view,
                                depth_slice: None,
                                resolve_target: resolved.as_ref(),
                                ops: operations(attachment, wgpu::Color::TRANSPARENT),
                            })
                        })
                        .collect();
                    let mut run = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                        label: Some(pass.name),
                        color_attachments: &attachments,
                        depth_stencil_attachment: depth.zip(depth_view.as_ref()).map(|(attachment, view)| {
                            wgpu::RenderPassDepthStencilAttachment {
                                view,
                                depth_ops: Some(operations(&attachment, 0.0)),
                                stencil_ops: None,
                            }
                        }),
                        timestamp_writes: set.zip(place).map(|(query_set, at)| {
                            wgpu::RenderPassTimestampWrites {
                                query_set,
                                beginning_of_pass_write_index: Some(at),
                                end_of_pass_write_index: Some(at + 1),
                            }
                        }),
                        occlusion_query_set: None,
                        multiview_mask: None,
                    });
                    run.set_pipeline(pipeline);
                    for (draw, group) in draws.iter().zip(&groups) {
                        run.set_bind_group(0, group, &[]);
                        run.draw(0..draw.vertices, 0..draw.instances);
                    }
                }
                _ => {}
            }
        }
        if let Some(stopwatch) = stopwatch {
            stopwatch.resolve(encoder);
        }
        Ok(())
    }
}

fn operations<V>(attachment: &Attachment, zero: V) -> wgpu::Operations<V> {
    wgpu::Operations {
        load: if attachment.clear {
            wgpu::LoadOp::Clear(zero)
        } else {
            wgpu::LoadOp::Load
        },
        store: wgpu::StoreOp::Store,
    }
}

fn bind(gpu: &Gpu, made: &Made, find: impl Fn(&str) -> Option<Physical>) -> Result<wgpu::BindGroup, String> {
    let found = made
        .slots
        .iter()
        .map(|slot| {
            find(&slot.name)
                .map(|p| (slot.binding, p))
                .ok_or_else(|| slot.name.clone())
        })
        .collect::<Result<Vec<_>, _>>()?;
    let entries: Vec<_> = found
        .iter()
        .map(|(binding, physical)| wgpu::BindGroupEntry {
            binding: *binding,
            resource: match physical {
                Physical::Buffer(buffer) => buffer.as_entire_binding(),
                Physical::Texture(view) => wgpu::BindingResource::TextureView(view),
            },
        })
        .collect();
    Ok(gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &made.layout,
        entries: &entries,
    }))
}

fn allocate(gpu: &Gpu, kind: &Kind) -> Physical {
    match *kind {
        Kind::Texture {
            size,
            format,
            samples,
        } => {
            let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("transient"),
                size: wgpu::Extent3d {
                    width: size[0],
                    height: size[1],
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: samples,
                dimension: wgpu::TextureDimension::D2,
                format: format.texture(),
                usage: if samples > 1 {
                    // Nothing but drawing and resolving.
                    wgpu::TextureUsages::RENDER_ATTACHMENT
                } else {
                    wgpu::TextureUsages::RENDER_ATTACHMENT
                        | wgpu::TextureUsages::TEXTURE_BINDING
                        | wgpu::TextureUsages::COPY_SRC
                },
                view_formats: &[],
            });
            Physical::Texture(texture.create_view(&Default::default()))
        }
        Kind::Buffer { bytes } | Kind::Imported { bytes } => {
            Physical::Buffer(gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("transient"),
                size: bytes.max(16).next_multiple_of(4),
                usage: wgpu::BufferUsages::STORAGE
                    | wgpu::BufferUsages::COPY_SRC
                    | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }))
        }
    }
}
