//! Cutting a picture into tiles and working on them in parallel.

use glam::UVec2;
use meniscus_sim::render::RenderError;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Side of a tile in pixels.
const TILE: u32 = 32;

/// Calls `draw` for every pixel of a picture and gathers what it returns, row-major. `state` makes what a tile needs;
/// its end is handed to `finish`. Pixels are drawn independently, so the result does not depend on the threads.
///
/// # Errors
/// [`RenderError::Interrupted`] if `progress` returned `false`.
pub(crate) fn render<P: Copy + Default + Send, S>(
    size: UVec2,
    progress: &(dyn Fn(f32) -> bool + Sync),
    state: impl Fn() -> S + Sync,
    draw: impl Fn(&mut S, u32, u32) -> P + Sync,
    finish: impl Fn(S) + Sync,
    out: &mut Vec<P>,
) -> Result<(), RenderError> {
    out.clear();
    out.resize(size.x as usize * size.y as usize, P::default());
    let columns = size.x.div_ceil(TILE);
    let tiles = columns as usize * size.y.div_ceil(TILE) as usize;
    let (done, stop) = (AtomicUsize::new(0), AtomicBool::new(!progress(0.0)));
    // Rows of tiles own disjoint slices of the picture; within one, tiles are drawn in parallel and copied in.
    out.par_chunks_mut(size.x as usize * TILE as usize)
        .enumerate()
        .for_each(|(row, slice)| {
            let y0 = row as u32 * TILE;
            let height = slice.len() as u32 / size.x;
            let drawn: Vec<Vec<P>> = (0..columns)
                .into_par_iter()
                .map(|column| {
                    if stop.load(Ordering::Relaxed) {
                        return Vec::new();
                    }
                    let x0 = column * TILE;
                    let width = TILE.min(size.x - x0);
                    let mut own = state();
                    let mut tile = Vec::with_capacity((width * height) as usize);
                    for y in y0..y0 + height {
                        for x in x0..x0 + width {
                            tile.push(draw(&mut own, x, y));
                        }
                    }
                    finish(own);
                    let share = (done.fetch_add(1, Ordering::Relaxed) + 1) as f32 / tiles as f32;
                    if !progress(share) {
                        stop.store(true, Ordering::Relaxed);
                    }
                    tile
                })
                .collect();
            for (column, tile) in drawn.iter().enumerate() {
                let x0 = column * TILE as usize;
                let width = tile.len() / height.max(1) as usize;
                for (y, line) in tile.chunks(width.max(1)).enumerate() {
                    slice[y * size.x as usize + x0..][..width].copy_from_slice(line);
                }
            }
        });
    if stop.into_inner() && done.into_inner() < tiles {
        return Err(RenderError::Interrupted);
    }
    Ok(())
}
