//! The newest pictures, where egui can show them.

use super::super::model::drawing::Drawn;
use eframe::egui::{self, Color32, ColorImage, TextureHandle, TextureId, TextureOptions};
use eframe::egui_wgpu::RenderState;
use eframe::wgpu;
use meniscus_sim::glam::UVec2;
use std::sync::Arc;

/// The pictures of the newest order.
#[derive(Default)]
pub(in super::super) struct Textures {
    shown: Option<Arc<Drawn>>,
    /// The window's device, where pictures can stay on it.
    state: Option<RenderState>,
    resident: Option<TextureId>,
    left: Option<TextureHandle>,
    pub(super) right: Option<TextureHandle>,
    pub(super) difference: Option<TextureHandle>,
}

impl Textures {
    /// Shows pictures that stay on the device of the window.
    pub(in super::super) fn sharing(state: Option<RenderState>) -> Self {
        Self {
            state,
            ..Self::default()
        }
    }

    /// The picture that is shown.
    pub(super) fn left(&self) -> Option<TextureId> {
        if self
            .shown
            .as_ref()
            .is_some_and(|drawn| drawn.left.texture.is_some())
        {
            self.resident
        } else {
            self.left.as_ref().map(TextureHandle::id)
        }
    }

    /// Lets egui know the texture that is on the device.
    fn put_resident(&mut self, texture: &wgpu::Texture) {
        let Some(state) = &self.state else { return };
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut renderer = state.renderer.write();
        let filter = wgpu::FilterMode::Linear;
        match self.resident {
            Some(id) => renderer.update_egui_texture_from_wgpu_texture(&state.device, &view, filter, id),
            None => self.resident = Some(renderer.register_native_texture(&state.device, &view, filter)),
        }
    }

    /// Takes over what is new.
    pub(in super::super) fn update(&mut self, ctx: &egui::Context, drawn: Option<&Arc<Drawn>>) {
        let same = match (&self.shown, drawn) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (None, None) => true,
            _ => false,
        };
        if same {
            return;
        }
        self.shown = drawn.cloned();
        let Some(drawn) = drawn else {
            (self.left, self.right, self.difference) = (None, None, None);
            return;
        };
        if let Some(texture) = &drawn.left.texture {
            self.put_resident(texture);
            return;
        }
        put(
            ctx,
            &mut self.left,
            "left",
            drawn.left.size,
            Some(&drawn.left.pixels),
        );
        let right = drawn.right.as_ref();
        put(
            ctx,
            &mut self.right,
            "right",
            right.map_or(drawn.left.size, |p| p.size),
            right.map(|p| &p.pixels),
        );
        let difference = drawn.difference.as_ref();
        put(
            ctx,
            &mut self.difference,
            "difference",
            right.map_or(drawn.left.size, |p| p.size),
            difference.map(|p| &p.pixels),
        );
    }

    /// The drawn pictures that are shown.
    pub(super) fn drawn(&self) -> Option<&Drawn> {
        self.shown.as_deref()
    }
}

fn put(
    ctx: &egui::Context,
    slot: &mut Option<TextureHandle>,
    name: &str,
    size: UVec2,
    pixels: Option<&Vec<[u8; 4]>>,
) {
    let Some(pixels) = pixels else {
        *slot = None;
        return;
    };
    let pixels = pixels
        .iter()
        .map(|&[r, g, b, _]| Color32::from_rgb(r, g, b))
        .collect();
    let image = ColorImage::new([size.x as usize, size.y as usize], pixels);
    match slot {
        Some(texture) => texture.set(image, TextureOptions::LINEAR),
        None => *slot = Some(ctx.load_texture(name, image, TextureOptions::LINEAR)),
    }
}
