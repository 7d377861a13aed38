//! One array of 32-bit numbers, packed: mapped to integers, predicted, entropy-coded by pco, in bands of rows.
//!
//! Bands are independent, so that one array is packed and unpacked by several threads with the same result for any
//! number of them.

use super::codec::{StoredBand, StoredPlane};
use super::predict::{self, Predictor};
use super::quantise::Quantiser;
use pco::wrapped::{FileCompressor, FileDecompressor};
use pco::{ChunkConfig, DeltaSpec, ModeSpec, PagingSpec};
use rayon::prelude::*;

/// Numbers in a band, unless a row is longer than half of it.
const BAND: usize = 1 << 17;
/// Fewest bytes that a band can take: bounds what a small file can make the reader allocate.
const MIN_BAND_BYTES: u32 = 4;
/// Effort of pco: 16 bins. More gains under 1 % after prediction.
const LEVEL: usize = 4;
/// The two bytes with which pco names its own format.
const PCO_HEADER: usize = 2;

/// f32, every bit kept.
const LOSSLESS: u8 = 0;
/// f32, quantised.
const QUANTISED: u8 = 1;
/// u32, every bit kept.
const INTEGER: u8 = 2;

/// Rows of an array and how they are gathered in bands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    /// Numbers in the array.
    pub(super) count: usize,
    /// Numbers in a row.
    row: usize,
    /// Numbers in a band (the last may have fewer).
    band: usize,
}

impl Layout {
    /// `count` numbers in rows of `row`; rows longer than a band are cut as if they were as long as one.
    pub(super) fn new(count: usize, row: usize) -> Self {
        let row = row.clamp(1, BAND);
        Self {
            count,
            row,
            band: BAND / row * row,
        }
    }

    /// How many bands there are.
    fn bands(self) -> usize {
        self.count.div_ceil(self.band)
    }
}

/// Maps f32 to integers of the same order, and back (it is its own inverse).
fn ordered(bits: i32) -> i32 {
    bits ^ ((bits >> 31) as u32 >> 1) as i32
}

/// Work arrays of one thread.
#[derive(Default)]
struct Scratch {
    codes: Vec<i32>,
    residuals: Vec<i32>,
}

struct PackedBand {
    stored: StoredBand,
    bytes: Vec<u8>,
    error: f64,
}

/// Packs f32 to the end of `data`; `tolerance` 0 keeps every bit.
pub(super) fn pack(
    values: &[f32],
    layout: Layout,
    tolerance: f32,
    data: &mut Vec<u8>,
) -> Result<StoredPlane, String> {
    let quantiser = (tolerance > 0.0)
        .then(|| values.iter().fold(0.0_f32, |m, v| m.max(v.abs())))
        .and_then(|max_abs| Quantiser::new(tolerance, max_abs));
    if let Some(quantiser) = quantiser {
        let codes = |band: &[u32], codes: &mut Vec<i32>| {
            let values: &[f32] = bytemuck::cast_slice(band);
            quantiser.quantise(values, codes);
            quantiser.largest_error(values, codes)
        };
        let start = data.len();
        let stored = pack_codes(bytemuck::cast_slice(values), layout, codes, data)?;
        // The bound holds by construction; that it does is measured, not believed.
        if stored.max_error <= tolerance {
            return Ok(StoredPlane {
                encoding: QUANTISED,
                step: quantiser.step(),
                ..stored
            });
        }
        data.truncate(start);
    }
    let codes = |band: &[u32], codes: &mut Vec<i32>| {
        codes.clear();
        codes.extend(band.iter().map(|&b| ordered(b as i32)));
        0.0
    };
    pack_codes(bytemuck::cast_slice(values), layout, codes, data)
}

/// Packs u32 to the end of `data`.
pub(super) fn pack_integers(
    values: &[u32],
    layout: Layout,
    data: &mut Vec<u8>,
) -> Result<StoredPlane, String> {
    let codes = |band: &[u32], codes: &mut Vec<i32>| {
        codes.clear();
        codes.extend(band.iter().map(|&v| v as i32));
        0.0
    };
    Ok(StoredPlane {
        encoding: INTEGER,
        ..pack_codes(values, layout, codes, data)?
    })
}

/// Packs the integers that `codes` makes of each band; it returns the largest error of doing so.
fn pack_codes(
    values: &[u32],
    layout: Layout,
    codes: impl Fn(&[u32], &mut Vec<i32>) -> f64 + Sync,
    data: &mut Vec<u8>,
) -> Result<StoredPlane, String> {
    let pack_band = |scratch: &mut Scratch, band: &[u32]| {
        let error = codes(band, &mut scratch.codes);
        pack_band(scratch, layout.row, error)
    };
    let bands: Vec<PackedBand> = values
        .par_chunks(layout.band)
        .map_init(Scratch::default, pack_band)
        .collect::<Result<_, _>>()?;
    let mut plane = StoredPlane {
        encoding: LOSSLESS,
        step: 0.0,
        max_error: 0.0,
        bands: Vec::with_capacity(bands.len()),
    };
    let mut max_error = 0.0_f64;
    for band in bands {
        data.extend_from_slice(&band.bytes);
        plane.bands.push(band.stored);
        max_error = max_error.max(band.error);
    }
    // Rounded up, so that the stored error is a bound.
    plane.max_error = max_error as f32;
    if f64::from(plane.max_error) < max_error {
        plane.max_error = plane.max_error.next_up();
    }
    Ok(plane)
}

fn pack_band(scratch: &mut Scratch, row: usize, error: f64) -> Result<PackedBand, String> {
    let codes = &scratch.codes;
    predict::gradient_residuals(codes, row, &mut scratch.residuals);
    let gradient = predict::estimated_bits(&scratch.residuals) <= predict::estimated_bits(codes);
    let (predictor, numbers) = if gradient {
        (Predictor::Gradient, &scratch.residuals)
    } else {
        (Predictor::None, codes)
    };
    let bytes = compress(numbers).map_err(|e| e.to_string())?;
    let length = u32::try_from(bytes.len()).map_err(|e| e.to_string())?;
    Ok(PackedBand {
        stored: StoredBand {
            predictor: predictor.code(),
            length,
            crc: crc32fast::hash(bytemuck::cast_slice(codes)),
        },
        bytes,
        error,
    })
}

fn compress(numbers: &[i32]) -> Result<Vec<u8>, pco::errors::PcoError> {
    // Prediction is done; pco's own searches for structure would cost time and gain nothing.
    let config = ChunkConfig::default()
        .with_compression_level(LEVEL)
        .with_mode_spec(ModeSpec::Classic)
        .with_delta_spec(DeltaSpec::NoOp)
        .with_paging_spec(PagingSpec::Exact(vec![numbers.len()]));
    let file = FileCompressor::default();
    let mut chunk = file.chunk_compressor(numbers, &config)?;
    let mut bytes = Vec::with_capacity(PCO_HEADER + chunk.meta_size_hint() + chunk.page_size_hint(0));
    file.write_header(&mut bytes)?;
    chunk.write_meta(&mut bytes)?;
    chunk.write_page(0, &mut bytes)?;
    Ok(bytes)
}

/// Inverse of [`compress`]; `bytes` must hold exactly `numbers.len()` numbers.
fn decompress(bytes: &[u8], numbers: &mut [i32]) -> Result<(), String> {
    let error = |e: pco::errors::PcoError| e.to_string();
    // The first byte after pco's header names its mode and its own prediction. Both are 0 in this version. The other
    // modes would let a file ask for large tables.
    if bytes.get(PCO_HEADER) != Some(&0) {
        return Err("its compression mode is unknown".to_owned());
    }
    let (file, rest) = FileDecompressor::new(bytes).map_err(error)?;
    let (mut chunk, rest) = file.chunk_decompressor::<i32, _>(rest).map_err(error)?;
    let mut page = chunk.page_decompressor(rest, numbers.len()).map_err(error)?;
    let progress = page.read(numbers).map_err(error)?;
    if !progress.finished || progress.n_processed != numbers.len() || !page.into_src().is_empty() {
        return Err("it does not hold as many numbers as it should".to_owned());
    }
    Ok(())
}

impl StoredPlane {
    /// Checks that the bands are those of `layout` before anything is allocated; returns the bytes that they take.
    pub(super) fn check(&self, layout: Layout) -> Result<u64, String> {
        if self.bands.len() != layout.bands() {
            let (found, expected) = (self.bands.len(), layout.bands());
            return Err(format!("an array has {found} bands instead of {expected}"));
        }
        if self.bands.iter().any(|b| b.length < MIN_BAND_BYTES) {
            return Err("an array has a band without data".to_owned());
        }
        Ok(self.bands.iter().map(|b| u64::from(b.length)).sum())
    }

    /// Unpacks f32 from the front of `data`, moving it on. `out` is as long as the layout says.
    pub(super) fn unpack(&self, data: &mut &[u8], layout: Layout, out: &mut [f32]) -> Result<(), String> {
        let out: &mut [i32] = bytemuck::cast_slice_mut(out);
        match self.encoding {
            LOSSLESS => self.unpack_codes(data, layout, out, |codes| {
                codes.iter_mut().for_each(|c| *c = ordered(*c));
            }),
            QUANTISED => {
                let quantiser = Quantiser::from_step(self.step).ok_or("an array has an impossible step")?;
                self.unpack_codes(data, layout, out, |codes| {
                    codes
                        .iter_mut()
                        .for_each(|c| *c = quantiser.value(*c).to_bits() as i32);
                })
            }
            other => Err(format!("an array of numbers has the unknown encoding {other}")),
        }
    }

    /// Unpacks u32 from the front of `data`, moving it on. `out` is as long as the layout says.
    pub(super) fn unpack_integers(
        &self,
        data: &mut &[u8],
        layout: Layout,
        out: &mut [u32],
    ) -> Result<(), String> {
        if self.encoding != INTEGER {
            return Err(format!(
                "an array of integers has the unknown encoding {}",
                self.encoding
            ));
        }
        self.unpack_codes(data, layout, bytemuck::cast_slice_mut(out), |_| {})
    }

    fn unpack_codes(
        &self,
        data: &mut &[u8],
        layout: Layout,
        out: &mut [i32],
        finish: impl Fn(&mut [i32]) + Sync,
    ) -> Result<(), String> {
        let mut parts = Vec::with_capacity(self.bands.len());
        for band in &self.bands {
            let (bytes, rest) = data
                .split_at_checked(band.length as usize)
                .ok_or("an array ends before its data")?;
            *data = rest;
            parts.push((band, bytes));
        }
        parts
            .into_par_iter()
            .zip(out.par_chunks_mut(layout.band))
            .try_for_each(|((band, bytes), out)| {
                unpack_band(*band, bytes, layout.row, out)?;
                finish(out);
                Ok(())
            })
    }
}

fn unpack_band(band: StoredBand, bytes: &[u8], row: usize, out: &mut [i32]) -> Result<(), String> {
    let predictor = Predictor::from_code(band.predictor)
        .ok_or_else(|| format!("it has the unknown predictor {}", band.predictor))?;
    decompress(bytes, out)?;
    match predictor {
        Predictor::None => {}
        Predictor::Gradient => predict::restore_gradient(out, row),
    }
    if crc32fast::hash(bytemuck::cast_slice(out)) != band.crc {
        return Err("its decoded values do not have the checksum stored with them".to_owned());
    }
    Ok(())
}
