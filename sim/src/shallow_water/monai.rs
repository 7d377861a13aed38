//! The Monai valley: a laboratory model of the 1993 Okushiri tsunami's runup, 1:400 (Third International Workshop on
//! Long-Wave Runup Models, 2004, benchmark problem 2; Liu, Yeh & Synolakis 2008). The data is not part of the
//! repository; [`Monai::find`] looks for it.

use super::edges::{Condition, Edges, Series};
use super::settings::{Initial, Settings, SetupError, position};
use super::solver::ShallowWater;
use crate::grid::{GridError, GridSpec};
use crate::solver::{Solver, StepError};
use glam::{UVec2, Vec2};
use std::path::{Path, PathBuf};

/// Names of the three files.
const BED: &str = "Benchmark_2_Bathymetry.asc";
const WAVE: &str = "Benchmark_2_input.txt";
const GAUGES: &str = "output_ch5-7-9.txt";

/// Length of the tank along X and Z, m.
const TANK: [f64; 2] = [5.488, 3.402];
/// Where the gauges (channels 5, 7, 9) stand, m.
const POSITIONS: [[f64; 2]; 3] = [[4.521, 1.196], [4.521, 1.696], [4.521, 2.196]];
/// End of the experiment, s: later the wave maker's own reflections arrive.
const END: f64 = 22.5;
/// Interval of the gauges, s.
const INTERVAL: f64 = 0.05;
/// Manning's roughness of the model, s/m^⅓, as in the published ANUGA run.
const MANNING: f64 = 0.0025;

/// The laboratory data.
#[derive(Clone, Debug)]
pub struct Monai {
    columns: usize,
    rows: usize,
    spacing: f64,
    /// Height of the ground above still water, m; row 0 at the smallest Z.
    ground: Vec<f64>,
    /// Incident wave: time in s and elevation in m.
    wave: Vec<[f64; 2]>,
    /// Times in s and the three gauges' elevations in m.
    gauges: Vec<(f64, [f64; 3])>,
}

/// The solver against the gauges.
#[derive(Clone, Debug, PartialEq)]
pub struct MonaiOutcome {
    /// Root mean square error of each gauge over the experiment, m.
    pub rms: [f64; 3],
    /// Computed less measured highest elevation at each gauge, m.
    pub peak_error: [f64; 3],
    /// Cells of the grid.
    pub cells: usize,
    /// Sub-steps taken.
    pub substeps: u64,
    /// Times and computed elevations at the gauges, m.
    pub series: Vec<(f64, [f64; 3])>,
}

impl MonaiOutcome {
    /// Mean of the gauges' root mean square errors, m.
    pub fn mean_rms(&self) -> f64 {
        self.rms.iter().sum::<f64>() / 3.0
    }
}

/// Why the benchmark cannot be run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MonaiError {
    /// A file cannot be read.
    #[error("{}: {source}; the Monai benchmark needs its three files in one folder", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file does not hold what it should.
    #[error("{}: {message}", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// The resolution is impossible.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// The solver could not be made.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The run failed.
    #[error(transparent)]
    Step(#[from] StepError),
}

impl Monai {
    /// The folder of the data: `monai_valley` in the folder that the environment variable `MENISCUS_SHARED_DATA` names,
    /// else in `../shared/data` beside the repository. `None` where it is absent.
    pub fn find() -> Option<PathBuf> {
        let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
        let data = std::env::var_os("MENISCUS_SHARED_DATA").map_or_else(beside, PathBuf::from);
        let folder = data.join("monai_valley");
        folder.join(BED).is_file().then_some(folder)
    }

    /// Reads the three files of a folder.
    ///
    /// # Errors
    /// [`MonaiError`] if a file is absent or malformed.
    pub fn load(folder: &Path) -> Result<Self, MonaiError> {
        let read = |name: &str| {
            let path = folder.join(name);
            match std::fs::read_to_string(&path) {
                Ok(text) => Ok((path, text)),
                Err(source) => Err(MonaiError::Read { path, source }),
            }
        };
        let (path, text) = read(BED)?;
        let format = |path: &Path, message: String| MonaiError::Format {
            path: path.to_owned(),
            message,
        };
        let mut words = text.split_ascii_whitespace();
        let mut header = [0.0; 6];
        for value in &mut header {
            let key = words.next().unwrap_or_default().to_owned();
            *value =
                number(words.next()).ok_or_else(|| format(&path, format!("header `{key}` has no number")))?;
        }
        let (columns, rows, spacing) = (header[0] as usize, header[1] as usize, header[4]);
        let heights: Vec<f64> = words.map_while(|w| number(Some(w))).collect();
        if columns < 2 || rows < 2 || heights.len() != columns * rows || !(spacing > 0.0) {
            let message = format!("{columns} x {rows} heights expected, {} found", heights.len());
            return Err(format(&path, message));
        }
        // The first row of the file is the one with the largest Z.
        let ground = heights.chunks(columns).rev().flatten().copied().collect();

        let table = |name: &str| -> Result<Vec<Vec<f64>>, MonaiError> {
            let (path, text) = read(name)?;
            let rows: Vec<Vec<f64>> = text
                .lines()
                .skip(1)
                .map(|line| {
                    line.split_ascii_whitespace()
                        .map_while(|w| number(Some(w)))
                        .collect()
                })
                .filter(|row: &Vec<f64>| !row.is_empty())
                .collect();
            if rows.is_empty() {
                return Err(format(&path, "no rows of numbers found".to_owned()));
            }
            Ok(rows)
        };
        let short = |name: &str| format(&folder.join(name), "a row has too few numbers".to_owned());
        let mut wave = Vec::new();
        for row in table(WAVE)? {
            let [time, elevation] = row[..] else {
                return Err(short(WAVE));
            };
            wave.push([time, elevation]);
        }
        let mut gauges = Vec::new();
        for row in table(GAUGES)? {
            let [time, a, b, c] = row[..] else {
                return Err(short(GAUGES));
            };
            gauges.push((time, [0.01 * a, 0.01 * b, 0.01 * c]));
        }
        Ok(Self {
            columns,
            rows,
            spacing,
            ground,
            wave,
            gauges,
        })
    }

    /// Height of the ground at a point, bilinear, m.
    fn height(&self, x: f64, z: f64) -> f64 {
        let clamp = |v: f64, count: usize| {
            let v = (v / self.spacing).clamp(0.0, (count - 1) as f64);
            let k = (v as usize).min(count - 2);
            (k, v - k as f64)
        };
        let ((i, fx), (j, fz)) = (clamp(x, self.columns), clamp(z, self.rows));
        let at = |i: usize, j: usize| self.ground[j * self.columns + i];
        (at(i, j) * (1.0 - fx) + at(i + 1, j) * fx) * (1.0 - fz)
            + (at(i, j + 1) * (1.0 - fx) + at(i + 1, j + 1) * fx) * fz
    }

    /// The tank at rest with `cells` cells along X.
    ///
    /// # Errors
    /// [`MonaiError`] if the resolution is impossible.
    pub fn setup(&self, cells: u32, settings: Settings) -> Result<ShallowWater, MonaiError> {
        let spacing = TANK[0] / f64::from(cells);
        let rows = (TANK[1] / spacing).round() as u32;
        let spec = GridSpec::new(
            Vec2::splat(0.5 * spacing as f32),
            spacing as f32,
            UVec2::new(cells, rows),
        )?;
        // A cell's bed is the mean over the cell.
        let parts = (spacing / self.spacing).ceil().max(1.0) as u32;
        let initial = Initial::still(&spec, |x, z| {
            let offset = |k: u32| ((f64::from(k) + 0.5) / f64::from(parts) - 0.5) * spacing;
            let sum: f64 = (0..parts * parts)
                .map(|k| self.height(x + offset(k % parts), z + offset(k / parts)))
                .sum();
            (sum / f64::from(parts * parts), 0.0)
        });
        let settings = Settings {
            manning: MANNING,
            edges: Edges {
                x_min: Condition::Elevation(Series::new(&self.wave)?),
                ..Edges::default()
            },
            ..settings
        };
        Ok(ShallowWater::new(spec, &initial, settings)?)
    }

    /// Runs the experiment with `cells` cells along X (196: spacing 2.8 cm) and compares with the gauges.
    ///
    /// # Errors
    /// [`MonaiError`] if the resolution is impossible or the run fails.
    pub fn run(&self, cells: u32, settings: Settings) -> Result<MonaiOutcome, MonaiError> {
        let mut solver = self.setup(cells, settings)?;
        let spec = solver.spec();
        let mut series = vec![(0.0, gauge(&solver))];
        let mut substeps = 0;
        for k in 1..=(END / INTERVAL).round() as u32 {
            let time = f64::from(k) * INTERVAL;
            substeps += u64::from(solver.advance((time - solver.time()) as f32)?.substeps);
            series.push((time, gauge(&solver)));
        }
        let mut rms = [0.0; 3];
        let mut peaks = [[f64::NEG_INFINITY; 2]; 3];
        let mut count = 0.0;
        for (time, measured) in self.gauges.iter().filter(|g| g.0 <= END + 1e-9) {
            let computed = interpolate(&series, *time);
            for g in 0..3 {
                rms[g] += (computed[g] - measured[g]).powi(2);
                peaks[g][0] = peaks[g][0].max(computed[g]);
                peaks[g][1] = peaks[g][1].max(measured[g]);
            }
            count += 1.0;
        }
        Ok(MonaiOutcome {
            rms: rms.map(|sum| (sum / f64::max(count, 1.0)).sqrt()),
            peak_error: peaks.map(|[computed, measured]| computed - measured),
            cells: spec.len(),
            substeps,
            series,
        })
    }
}

fn number(word: Option<&str>) -> Option<f64> {
    word?.parse().ok().filter(|v: &f64| v.is_finite())
}

/// Elevations at the gauges, bilinear between the cells.
fn gauge(solver: &ShallowWater) -> [f64; 3] {
    let spec = solver.spec();
    let [x0, z0] = position(&spec, 0, 0);
    let spacing = f64::from(spec.spacing);
    POSITIONS.map(|[x, z]| {
        let (gx, gz) = ((x - x0) / spacing, (z - z0) / spacing);
        let (i, j) = (
            (gx as usize).min(spec.width() - 2),
            (gz as usize).min(spec.height() - 2),
        );
        let (fx, fz) = (gx - i as f64, gz - j as f64);
        let at = |i: usize, j: usize| solver.elevation_at(i, j);
        (at(i, j) * (1.0 - fx) + at(i + 1, j) * fx) * (1.0 - fz)
            + (at(i, j + 1) * (1.0 - fx) + at(i + 1, j + 1) * fx) * fz
    })
}

/// Linear between the points of a series.
fn interpolate(series: &[(f64, [f64; 3])], time: f64) -> [f64; 3] {
    let next = series.partition_point(|s| s.0 < time).clamp(1, series.len() - 1);
    let ((t0, a), (t1, b)) = (series[next - 1], series[next]);
    let f = ((time - t0) / (t1 - t0)).clamp(0.0, 1.0);
    std::array::from_fn(|g| a[g] * (1.0 - f) + b[g] * f)
}
