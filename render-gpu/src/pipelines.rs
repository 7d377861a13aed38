//! Pipelines, made when a plan first needs them and kept.
//!
//! A shader says itself what it binds: its variables are found by name in the passes' resources and the frame's. The
//! layout comes from the compiled module, so that a variable that an entry point does not use is not bound at all.

use crate::device::Gpu;
use crate::shader::{Piece, Switches, assemble};
use std::collections::HashMap;
use wgpu::naga;

/// A variable that a pipeline binds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Slot {
    pub(crate) name: String,
    pub(crate) binding: u32,
    kind: wgpu::BindingType,
}

/// Why a shader cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("shader `{entry}`: {what}")]
pub(crate) struct ShaderError {
    /// Its entry point.
    pub(crate) entry: &'static str,
    /// What the compiler says.
    pub(crate) what: String,
}

/// What naga may accept: what WebGPU's core has, as no device feature is asked for. Packing two halves into a word is of the core,
/// though naga counts it as a capability, which WebGL lacks.
pub(crate) fn validator() -> naga::valid::Validator {
    naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32,
    )
}

/// The variables that any of the entry points uses, by binding.
pub(crate) fn reflect(source: &str, entries: &[&'static str]) -> Result<Vec<Slot>, ShaderError> {
    let wrong = |what: String| ShaderError {
        entry: entries.first().copied().unwrap_or(""),
        what,
    };
    let module = naga::front::wgsl::parse_str(source).map_err(|e| wrong(e.emit_to_string(source)))?;
    let info = validator()
        .validate(&module)
        .map_err(|e| wrong(e.emit_to_string(source)))?;
    let mut slots: Vec<Slot> = Vec::new();
    for (k, point) in module.entry_points.iter().enumerate() {
        if !entries.contains(&point.name.as_str()) {
            continue;
        }
        let uses = info.get_entry_point(k);
        for (handle, variable) in module.global_variables.iter() {
            let (Some(binding), false) = (&variable.binding, uses[handle].is_empty()) else {
                continue;
            };
            let name = variable.name.clone().unwrap_or_default();
            if slots.iter().any(|s| s.name == name) {
                continue;
            }
            let kind =
                binding_type(&module, variable).ok_or_else(|| wrong(format!("`{name}` cannot be bound")))?;
            slots.push(Slot {
                name,
                binding: binding.binding,
                kind,
            });
        }
    }
    for entry in entries {
        if !module.entry_points.iter().any(|p| p.name == *entry) {
            return Err(wrong(format!("there is no entry point `{entry}`")));
        }
    }
    slots.sort_by_key(|s| s.binding);
    Ok(slots)
}

fn binding_type(module: &naga::Module, variable: &naga::GlobalVariable) -> Option<wgpu::BindingType> {
    let buffer = |ty| wgpu::BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    match variable.space {
        naga::AddressSpace::Uniform => Some(buffer(wgpu::BufferBindingType::Uniform)),
        naga::AddressSpace::Storage { access } => Some(buffer(wgpu::BufferBindingType::Storage {
            read_only: !access.contains(naga::StorageAccess::STORE),
        })),
        naga::AddressSpace::Handle => match &module.types[variable.ty].inner {
            naga::TypeInner::Image {
                class: naga::ImageClass::Sampled { .. },
                ..
            } => Some(wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: false },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            }),
            naga::TypeInner::Image {
                class: naga::ImageClass::Depth { .. },
                ..
            } => Some(wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Depth,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            }),
            _ => None,
        },
        _ => None,
    }
}

/// What a pipeline is made from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Recipe {
    pub(crate) pieces: Vec<Piece>,
    pub(crate) switches: Switches,
    pub(crate) stage: StageRecipe,
}

/// Its stages.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum StageRecipe {
    Compute(&'static str),
    Draw {
        vertex: &'static str,
        fragment: &'static str,
        colors: Vec<wgpu::TextureFormat>,
        depth: bool,
        samples: u32,
    },
}

/// A pipeline with what it binds.
#[derive(Debug)]
pub(crate) struct Made {
    pub(crate) slots: Vec<Slot>,
    pub(crate) layout: wgpu::BindGroupLayout,
    pub(crate) stage: MadeStage,
}

#[derive(Debug)]
pub(crate) enum MadeStage {
    Compute(wgpu::ComputePipeline),
    Draw(wgpu::RenderPipeline),
}

/// All pipelines made so far.
#[derive(Debug, Default)]
pub(crate) struct Pipelines {
    made: HashMap<String, Made>,
}

impl Pipelines {
    pub(crate) fn count(&self) -> usize {
        self.made.len()
    }

    pub(crate) fn get(&mut self, gpu: &Gpu, recipe: &Recipe) -> Result<&Made, ShaderError> {
        let key = format!("{recipe:?}");
        if !self.made.contains_key(&key) {
            let made = make(gpu, recipe)?;
            self.made.insert(key.clone(), made);
        }
        self.made.get(&key).ok_or_else(|| ShaderError {
            entry: "",
            what: "not made".to_owned(),
        })
    }
}

fn make(gpu: &Gpu, recipe: &Recipe) -> Result<Made, ShaderError> {
    let device = &gpu.device;
    let source = assemble(&recipe.switches, &recipe.pieces, gpu.constants);
    let entries: Vec<&'static str> = match &recipe.stage {
        StageRecipe::Compute(entry) => vec![entry],
        StageRecipe::Draw { vertex, fragment, .. } => vec![vertex, fragment],
    };
    let slots = reflect(&source, &entries)?;
    let label = Some(entries[entries.len() - 1]);
    let visibility = match recipe.stage {
        StageRecipe::Compute(_) => wgpu::ShaderStages::COMPUTE,
        StageRecipe::Draw { .. } => wgpu::ShaderStages::VERTEX_FRAGMENT,
    };
    let rows: Vec<wgpu::BindGroupLayoutEntry> = slots
        .iter()
        .map(|slot| wgpu::BindGroupLayoutEntry {
            binding: slot.binding,
            visibility: match slot.kind {
                // Core devices write from fragments and compute shaders only.
                wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Storage { read_only: false },
                    ..
                } if visibility != wgpu::ShaderStages::COMPUTE => wgpu::ShaderStages::FRAGMENT,
                _ => visibility,
            },
            ty: slot.kind,
            count: None,
        })
        .collect();
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label,
        entries: &rows,
    });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label,
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label,
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let stage = match &recipe.stage {
        StageRecipe::Compute(entry) => {
            MadeStage::Compute(device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label,
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some(entry),
                compilation_options: Default::default(),
                cache: None,
            }))
        }
        StageRecipe::Draw {
            vertex,
            fragment,
            colors,
            depth,
            samples,
        } => {
            let targets: Vec<_> = colors
                .iter()
                .map(|&format| {
                    Some(wgpu::ColorTargetState {
                        format,
                        blend: None,
                        write_mask: wgpu::ColorWrites::ALL,
                    })
                })
                .collect();
            MadeStage::Draw(device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label,
                layout: Some(&pipeline_layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some(vertex),
                    compilation_options: Default::default(),
                    buffers: &[],
                },
                primitive: Default::default(),
                depth_stencil: depth.then(|| wgpu::DepthStencilState {
                    format: wgpu::TextureFormat::Depth32Float,
                    depth_write_enabled: Some(true),
                    depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
                    stencil: Default::default(),
                    bias: Default::default(),
                }),
                multisample: wgpu::MultisampleState {
                    count: *samples,
                    ..Default::default()
                },
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some(fragment),
                    compilation_options: Default::default(),
                    targets: &targets,
                }),
                multiview_mask: None,
                cache: None,
            }))
        }
    };
    Ok(Made { slots, layout, stage })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shader::{Constants, Piece};
    use crate::{Heights, Settings, Technique, Walk};

    /// Settings of every technique that choose pieces.
    fn every_choice() -> Vec<Settings> {
        let mut all = Vec::new();
        for base in Technique::ALL.map(Settings::new) {
            for walk in Walk::ALL {
                all.extend(Heights::ALL.map(|heights| Settings {
                    walk,
                    heights,
                    ..base
                }));
            }
            let mut smooth = base;
            smooth.switches.multisampled = true;
            all.push(smooth);
        }
        all
    }

    /// Every entry point with every choice of pieces that a scene can make.
    #[test]
    fn every_shader_is_valid_whatever_the_scene_has() {
        let mut seen = std::collections::HashSet::new();
        for facts in crate::facts::tests::all_kinds() {
            for settings in every_choice() {
                let passes = crate::techniques::passes(&facts, &settings);
                for pass in passes.graph.passes() {
                    let pieces = &pass.work.pieces;
                    let source = assemble(&settings.switches, pieces, Constants::Uniform);
                    let points: Vec<&'static str> = match &pass.work.action {
                        crate::work::Action::Compute { entry, .. } => vec![entry],
                        crate::work::Action::Draw { vertex, fragment, .. } => vec![vertex, fragment],
                    };
                    if !seen.insert((source.clone(), points.clone())) {
                        continue;
                    }
                    let slots = reflect(&source, &points).unwrap_or_else(|e| panic!("{}: {e}", pass.name));
                    if settings.walk == Walk::default() && settings.heights == Heights::default() {
                        let elsewhere = assemble(&settings.switches, pieces, Constants::Storage);
                        let same =
                            reflect(&elsewhere, &points).unwrap_or_else(|e| panic!("{}: {e}", pass.name));
                        assert!(slots.iter().map(|s| &s.name).eq(same.iter().map(|s| &s.name)));
                    }
                    // What a mid-range device and WebGPU's core give a stage.
                    let storage = slots.iter().filter(|s| {
                        matches!(
                            s.kind,
                            wgpu::BindingType::Buffer {
                                ty: wgpu::BufferBindingType::Storage { .. },
                                ..
                            }
                        )
                    });
                    assert!(storage.count() <= 8, "{}", pass.name);
                }
            }
        }
        assert!(seen.len() > 100, "{}", seen.len());
    }

    #[test]
    fn every_piece_is_used_by_some_pass() {
        // Tables of formulas are for their own tests.
        let mut used = std::collections::BTreeSet::from([Piece::Parity, Piece::ParityApparent]);
        for facts in crate::facts::tests::all_kinds() {
            for settings in every_choice() {
                let passes = crate::techniques::passes(&facts, &settings);
                used.extend(passes.graph.passes().iter().flat_map(|p| p.work.pieces.clone()));
            }
        }
        let idle: Vec<_> = Piece::ALL.iter().filter(|p| !used.contains(p)).collect();
        assert!(idle.is_empty(), "{idle:?}");
    }

    #[test]
    fn a_wrong_shader_is_refused_with_its_line() {
        let error = reflect("fn f() -> u32 { return 1.5; }", &["f"]).unwrap_err();
        assert!(error.to_string().contains("wgsl:1"), "{error}");
        assert!(reflect("fn f() {}", &["g"]).is_err());
    }
}
