//! One array of 32-bit numbers, packed: mapped to integers, predicted, entropy-coded by pco, in bands of rows.
//!
//! Bands are independent, so that one array is packed and unpacked by several threads with the same result for any
//! number of them.

use super::codec::{StoredBand, StoredPlane};
use super::fitted::{self, Weights};
use super::predict;
use super::quantise::Quantiser;
use pco::wrapped::{FileCompressor, FileDecompressor};
use pco::{ChunkConfig, DeltaSpec, ModeSpec, PagingSpec};
use rayon::prelude::*;

/// Numbers in a band, unless a row is longer than half of it.
const BAND: usize = 1 << 17;
/// Numbers from which on several threads are put to work: fewer take less time than waking a thread.
pub(super) const PARALLEL: usize = 1 << 15;
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

/// Maps the bits of f32 to integers of the same order, and back (it is its own inverse).
pub(super) fn ordered(bits: i32) -> i32 {
    bits ^ ((bits >> 31) as u32 >> 1) as i32
}

/// How the numbers of an array become the integers that are predicted.
#[derive(Clone, Copy, Debug)]
enum Mapping {
    /// f32 to integers of the same order.
    Ordered,
    /// f32 to multiples of a step.
    Quantised(Quantiser),
    /// u32 as they are.
    Whole,
}

impl Mapping {
    /// Maps the 32-bit patterns of a band; returns the largest error.
    fn apply(self, band: &[u32], codes: &mut Vec<i32>) -> f64 {
        codes.clear();
        match self {
            Self::Ordered => codes.extend(band.iter().map(|&b| ordered(b as i32))),
            Self::Whole => codes.extend(band.iter().map(|&b| b as i32)),
            Self::Quantised(quantiser) => {
                let values: &[f32] = bytemuck::cast_slice(band);
                quantiser.quantise(values, codes);
                return quantiser.largest_error(values, codes);
            }
        }
        0.0
    }

    /// Turns integers back into 32-bit patterns, in place.
    fn undo(self, codes: &mut [i32]) {
        match self {
            Self::Ordered => codes.iter_mut().for_each(|c| *c = ordered(*c)),
            Self::Whole => {}
            Self::Quantised(quantiser) => codes
                .iter_mut()
                .for_each(|c| *c = quantiser.value(*c).to_bits() as i32),
        }
    }

    fn fit(self, codes: &[i32], row: usize) -> Option<Weights> {
        match self {
            Self::Ordered => fitted::fit(fitted::Ordered, codes, row),
            _ => fitted::fit(fitted::Whole, codes, row),
        }
    }

    fn subtract(self, weights: &Weights, codes: &mut [i32], row: usize) {
        match self {
            Self::Ordered => fitted::subtract(fitted::Ordered, weights, codes, row),
            _ => fitted::subtract(fitted::Whole, weights, codes, row),
        }
    }

    fn restore(self, weights: &Weights, residuals: &mut [i32], row: usize) {
        match self {
            Self::Ordered => fitted::restore(fitted::Ordered, weights, residuals, row),
            _ => fitted::restore(fitted::Whole, weights, residuals, row),
        }
    }
}

/// Work arrays of one thread.
#[derive(Default)]
struct Scratch {
    codes: Vec<i32>,
    gradient: Vec<i32>,
    fitted: Vec<i32>,
    sample: Vec<i32>,
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
    let bits = bytemuck::cast_slice(values);
    let quantiser = (tolerance > 0.0)
        .then(|| values.iter().fold(0.0_f32, |m, v| m.max(v.abs())))
        .and_then(|max_abs| Quantiser::new(tolerance, max_abs));
    if let Some(quantiser) = quantiser {
        let start = data.len();
        let stored = pack_bits(bits, layout, Mapping::Quantised(quantiser), data)?;
        // The bound holds by construction; that it does is measured, not believed.
        if stored.max_error <= tolerance {
            return Ok(stored);
        }
        data.truncate(start);
    }
    pack_bits(bits, layout, Mapping::Ordered, data)
}

/// Packs u32 to the end of `data`.
pub(super) fn pack_integers(
    values: &[u32],
    layout: Layout,
    data: &mut Vec<u8>,
) -> Result<StoredPlane, String> {
    pack_bits(values, layout, Mapping::Whole, data)
}

fn pack_bits(
    bits: &[u32],
    layout: Layout,
    mapping: Mapping,
    data: &mut Vec<u8>,
) -> Result<StoredPlane, String> {
    let pack = |scratch: &mut Scratch, band: &[u32]| {
        let error = mapping.apply(band, &mut scratch.codes);
        pack_band(scratch, layout.row, mapping, error)
    };
    let bands: Vec<PackedBand> = if bits.len() >= PARALLEL {
        let bands = bits.par_chunks(layout.band).map_init(Scratch::default, pack);
        bands.collect::<Result<_, _>>()?
    } else {
        let mut scratch = Scratch::default();
        let bands = bits.chunks(layout.band).map(|band| pack(&mut scratch, band));
        bands.collect::<Result<_, _>>()?
    };
    let (encoding, step) = match mapping {
        Mapping::Ordered => (LOSSLESS, 0.0),
        Mapping::Quantised(quantiser) => (QUANTISED, quantiser.step()),
        Mapping::Whole => (INTEGER, 0.0),
    };
    let max_error = bands.iter().map(|b| b.error).fold(0.0, f64::max);
    // Rounded up, so that the stored error is a bound.
    let mut rounded = max_error as f32;
    if f64::from(rounded) < max_error {
        rounded = rounded.next_up();
    }
    for band in &bands {
        data.extend_from_slice(&band.bytes);
    }
    Ok(StoredPlane {
        encoding,
        step,
        max_error: rounded,
        bands: bands.iter().map(|b| b.stored).collect(),
    })
}

fn pack_band(scratch: &mut Scratch, row: usize, mapping: Mapping, error: f64) -> Result<PackedBand, String> {
    let Scratch {
        codes,
        gradient,
        fitted,
        sample,
    } = scratch;
    let mut bytes = Vec::new();
    let mut best = (predict::estimated_bits(codes, sample), predict::NONE, &*codes);
    predict::gradient_residuals(codes, row, gradient);
    let bits = predict::estimated_bits(gradient, sample);
    if bits < best.0 {
        best = (bits, predict::GRADIENT, gradient);
    }
    let weights = fitted::applies(codes.len(), row)
        .then(|| mapping.fit(codes, row))
        .flatten();
    if let Some(weights) = weights {
        // The first rows have too few neighbours above them.
        let head = fitted::REACH * row;
        fitted.clear();
        fitted.extend_from_slice(codes);
        mapping.subtract(&weights, fitted, row);
        fitted[..head].copy_from_slice(&gradient[..head]);
        let own = 8.0 * size_of::<Weights>() as f64 / codes.len() as f64;
        let bits = predict::estimated_bits(fitted, sample) + own;
        if bits < best.0 {
            best = (bits, predict::FITTED, fitted);
            weights
                .iter()
                .for_each(|w| bytes.extend_from_slice(&w.to_le_bytes()));
        }
    }
    let (_, predictor, numbers) = best;
    compress(numbers, &mut bytes).map_err(|e| e.to_string())?;
    let length = u32::try_from(bytes.len()).map_err(|e| e.to_string())?;
    Ok(PackedBand {
        stored: StoredBand {
            predictor,
            length,
            crc: crc32fast::hash(bytemuck::cast_slice(codes)),
        },
        bytes,
        error,
    })
}

fn compress(numbers: &[i32], bytes: &mut Vec<u8>) -> Result<(), pco::errors::PcoError> {
    // Prediction is done; pco's own searches for structure would cost time and gain nothing.
    let config = ChunkConfig::default()
        .with_compression_level(LEVEL)
        .with_mode_spec(ModeSpec::Classic)
        .with_delta_spec(DeltaSpec::NoOp)
        .with_paging_spec(PagingSpec::Exact(vec![numbers.len()]));
    let file = FileCompressor::default();
    let mut chunk = file.chunk_compressor(numbers, &config)?;
    bytes.reserve(PCO_HEADER + chunk.meta_size_hint() + chunk.page_size_hint(0));
    file.write_header(&mut *bytes)?;
    chunk.write_meta(&mut *bytes)?;
    chunk.write_page(0, &mut *bytes)?;
    Ok(())
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
        if self.encoding != QUANTISED && self.step != 0.0 {
            return Err(format!(
                "an array that is not quantised has the step {}",
                self.step
            ));
        }
        if !(self.max_error.is_finite() && self.max_error >= 0.0) {
            return Err(format!("an array has the impossible error {}", self.max_error));
        }
        Ok(self.bands.iter().map(|b| u64::from(b.length)).sum())
    }

    /// What is to be done to unpack f32 from the front of `data`, which is moved on. `out` is as long as the layout
    /// says.
    pub(super) fn unpack<'d, 'o>(
        &self,
        data: &mut &'d [u8],
        layout: Layout,
        out: &'o mut [f32],
        tasks: &mut Vec<Task<'d, 'o>>,
    ) -> Result<(), String> {
        let mapping = match self.encoding {
            LOSSLESS => Mapping::Ordered,
            QUANTISED => {
                Mapping::Quantised(Quantiser::from_step(self.step).ok_or("an array has an impossible step")?)
            }
            other => return Err(format!("an array of numbers has the unknown encoding {other}")),
        };
        self.unpack_bits(data, layout, mapping, bytemuck::cast_slice_mut(out), tasks)
    }

    /// What is to be done to unpack u32 from the front of `data`, which is moved on. `out` is as long as the layout
    /// says.
    pub(super) fn unpack_integers<'d, 'o>(
        &self,
        data: &mut &'d [u8],
        layout: Layout,
        out: &'o mut [u32],
        tasks: &mut Vec<Task<'d, 'o>>,
    ) -> Result<(), String> {
        if self.encoding != INTEGER {
            return Err(format!(
                "an array of integers has the unknown encoding {}",
                self.encoding
            ));
        }
        self.unpack_bits(data, layout, Mapping::Whole, bytemuck::cast_slice_mut(out), tasks)
    }

    fn unpack_bits<'d, 'o>(
        &self,
        data: &mut &'d [u8],
        layout: Layout,
        mapping: Mapping,
        out: &'o mut [i32],
        tasks: &mut Vec<Task<'d, 'o>>,
    ) -> Result<(), String> {
        for (&band, out) in self.bands.iter().zip(out.chunks_mut(layout.band)) {
            let (bytes, rest) = data
                .split_at_checked(band.length as usize)
                .ok_or("an array ends before its data")?;
            *data = rest;
            tasks.push(Task {
                band,
                bytes,
                row: layout.row,
                mapping,
                out,
            });
        }
        Ok(())
    }
}

/// A band that is to be unpacked.
pub(super) struct Task<'d, 'o> {
    band: StoredBand,
    bytes: &'d [u8],
    row: usize,
    mapping: Mapping,
    out: &'o mut [i32],
}

/// Unpacks bands, in parallel where that pays.
pub(super) fn run(tasks: Vec<Task<'_, '_>>) -> Result<(), String> {
    let numbers: usize = tasks.iter().map(|t| t.out.len()).sum();
    if tasks.len() > 1 && numbers >= PARALLEL {
        tasks.into_par_iter().try_for_each(unpack_band)
    } else {
        tasks.into_iter().try_for_each(unpack_band)
    }
}

fn unpack_band(task: Task<'_, '_>) -> Result<(), String> {
    let Task {
        band,
        bytes,
        row,
        mapping,
        out,
    } = task;
    match band.predictor {
        predict::NONE => decompress(bytes, out)?,
        predict::GRADIENT => {
            decompress(bytes, out)?;
            predict::restore_gradient(out, row);
        }
        predict::FITTED if fitted::applies(out.len(), row) => {
            let (stored, bytes) = bytes
                .split_at_checked(size_of::<Weights>())
                .ok_or("a band ends before its weights")?;
            let mut weights = [0.0; fitted::TAPS];
            for (weight, bytes) in weights.iter_mut().zip(stored.as_chunks::<4>().0) {
                *weight = f32::from_le_bytes(*bytes);
            }
            decompress(bytes, out)?;
            predict::restore_gradient(&mut out[..fitted::REACH * row], row);
            mapping.restore(&weights, out, row);
        }
        other => return Err(format!("a band has the unknown predictor {other}")),
    }
    if crc32fast::hash(bytemuck::cast_slice(out)) != band.crc {
        return Err("decoded values do not have the checksum stored with them".to_owned());
    }
    mapping.undo(out);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Rng;

    fn round_trip(values: &[f32], row: usize, tolerance: f32) -> Vec<f32> {
        let layout = Layout::new(values.len(), row);
        let mut data = Vec::new();
        let plane = pack(values, layout, tolerance, &mut data).unwrap();
        assert_eq!(plane.check(layout).unwrap(), data.len() as u64);
        let mut out = vec![1.0; values.len()];
        let (mut rest, mut tasks) = (data.as_slice(), Vec::new());
        plane.unpack(&mut rest, layout, &mut out, &mut tasks).unwrap();
        run(tasks).unwrap();
        assert!(rest.is_empty());
        out
    }

    #[test]
    fn arrays_of_any_shape_come_back() {
        let mut rng = Rng::new(2, 2);
        for (count, row) in [
            (0, 0),
            (0, 5),
            (1, 1),
            (1, 9),
            (2, 1),
            (300, 1),
            (300, 300),
            (2500, 50),
            (2501, 50),
            (70_000, 7),
        ] {
            let values: Vec<f32> = (0..count)
                .map(|k| (0.1 * (k % row.max(1)) as f32).sin() + 1e-3 * rng.normal() as f32)
                .collect();
            let same = round_trip(&values, row, 0.0);
            assert!(
                same.iter().zip(&values).all(|(a, b)| a.to_bits() == b.to_bits()),
                "{count} {row}"
            );
            let near = round_trip(&values, row, 1e-3);
            assert!(
                near.iter().zip(&values).all(|(a, b)| (a - b).abs() <= 1e-3),
                "{count} {row}"
            );
        }
    }

    #[test]
    fn integers_come_back() {
        let mut rng = Rng::new(2, 3);
        let values: Vec<u32> = (0..5000)
            .map(|k| if k % 7 == 0 { rng.next_u64() as u32 } else { 3 * k })
            .collect();
        let layout = Layout::new(values.len(), 100);
        let mut data = Vec::new();
        let plane = pack_integers(&values, layout, &mut data).unwrap();
        let mut out = vec![0; values.len()];
        let mut tasks = Vec::new();
        plane
            .unpack_integers(&mut data.as_slice(), layout, &mut out, &mut tasks)
            .unwrap();
        run(tasks).unwrap();
        assert_eq!(out, values);
        // Neither kind is taken for the other.
        assert!(
            plane
                .unpack(&mut data.as_slice(), layout, &mut [0.0; 5000], &mut Vec::new())
                .is_err()
        );
    }

    #[test]
    fn bands_are_whole_rows() {
        for (count, row, bands) in [
            (1 << 18, 512, 2),
            (1000 * 1000, 1000, 8),
            (1 << 20, 1 << 20, 8),
            (1, 1, 1),
            (0, 1, 0),
        ] {
            let layout = Layout::new(count, row);
            assert_eq!(layout.bands(), bands, "{count} {row}");
            assert_eq!(layout.band % layout.row, 0);
            assert!(layout.band <= BAND);
        }
    }

    #[test]
    fn order_is_kept_and_undone() {
        let values = [f32::NEG_INFINITY, -2.0, -1e-40, -0.0, 0.0, 1e-40, 1.0, f32::MAX];
        let codes = values.map(|v| ordered(v.to_bits() as i32));
        assert!(codes.is_sorted());
        assert_eq!(codes.map(|c| ordered(c) as u32), values.map(f32::to_bits));
    }
}
