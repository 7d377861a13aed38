//! What the waves run through: speed on every face, land, objects, edges, and the Courant limit that follows.

use super::{depth_of_speed, footprint};
use crate::events::stamp::Wrap;
use crate::grid::GridSpec;
use crate::scene::Scene;
use crate::scene::description::{Edge, WaveEquation};
use crate::solvers::{BuildError, GRAVITY};

/// The medium of a scene. Faces along X: face `i` of row `j` lies between samples `i − 1` and `i` at index
/// `j (w + 1) + i`; along Z: face row `j` lies between rows `j − 1` and `j` at index `j w + i`.
pub(super) struct Medium {
    pub(super) spec: GridSpec,
    /// Whether waves run at the sample (not land, not inside an object).
    pub(super) wet: Vec<bool>,
    /// Depth at rest in metres that gives the wave speed, 0 where not wet.
    pub(super) depth: Vec<f32>,
    /// c² over the spacing on the faces along X, m/s²; 0 where no flux passes and on the outermost faces unless
    /// they wrap.
    pub(super) pull_x: Vec<f32>,
    /// The same on the faces along Z.
    pub(super) pull_z: Vec<f32>,
    pub(super) wrap: Wrap,
    /// Edges in the order x_min, x_max, z_min, z_max.
    pub(super) edges: [Edge; 4],
    /// Rate at which motion is damped, 1/s.
    pub(super) damping: f64,
    limit: f64,
    fastest: f64,
}

impl Medium {
    pub(super) fn from_scene(scene: &Scene, parameters: &WaveEquation) -> Result<Self, BuildError> {
        let spec = scene.grid;
        let positive = |key: &str, value: f32, unit: &str| {
            if value.is_finite() && value > 0.0 {
                Ok(())
            } else {
                Err(BuildError::impossible(
                    key,
                    format!("{value} {unit} is not positive"),
                    format!("give a positive number of {unit}"),
                ))
            }
        };
        if let Some(speed) = parameters.speed {
            positive("solver.speed", speed, "m/s")?;
        }
        positive("solver.depth", parameters.depth, "m")?;
        if !(parameters.damping.is_finite() && parameters.damping >= 0.0) {
            return Err(BuildError::impossible(
                "solver.damping",
                format!("{} 1/s is not a rate", parameters.damping),
                "give 0 or a positive rate",
            ));
        }
        let level = scene.description.water.level;
        let ground = scene.ground_on_grid();
        let pierced = footprint::pierced(scene)?;
        let constant = parameters.speed.map(|c| depth_of_speed(f64::from(c)) as f32);
        let depth: Vec<f32> = (0..spec.len())
            .map(|k| {
                let below = ground
                    .as_ref()
                    .map_or(parameters.depth, |g| level - g.as_slice()[k]);
                if pierced[k] || below <= 0.0 {
                    0.0
                } else {
                    constant.unwrap_or(below)
                }
            })
            .collect();
        if let Some(k) = depth.iter().position(|d| !d.is_finite()) {
            return Err(BuildError::impossible(
                "terrain",
                format!(
                    "the depth at sample ({}, {}) is {}",
                    k % spec.width(),
                    k / spec.width(),
                    depth[k]
                ),
                "every height must be a finite number",
            ));
        }
        let boundary = &scene.description.boundary;
        Self::new(
            spec,
            depth,
            [boundary.x_min, boundary.x_max, boundary.z_min, boundary.z_max],
            f64::from(parameters.damping),
        )
    }

    /// A medium of the given depths (0 for land).
    pub(super) fn new(
        spec: GridSpec,
        depth: Vec<f32>,
        edges: [Edge; 4],
        damping: f64,
    ) -> Result<Self, BuildError> {
        let periodic = edges.map(|e| e == Edge::Periodic);
        for (pair, names) in [(0, "x_min and x_max"), (2, "z_min and z_max")] {
            if periodic[pair] != periodic[pair + 1] {
                return Err(BuildError::impossible(
                    "boundary",
                    format!("only one of {names} is periodic"),
                    "make both periodic or neither",
                ));
            }
        }
        let wrap = Wrap {
            x: periodic[0],
            z: periodic[2],
        };
        let (w, h) = (spec.width(), spec.height());
        let spacing = f64::from(spec.spacing);
        let pull = |a: usize, b: usize| -> f32 {
            let (a, b) = (depth[a], depth[b]);
            if a > 0.0 && b > 0.0 {
                (GRAVITY * 0.5 * (f64::from(a) + f64::from(b)) / spacing) as f32
            } else {
                0.0
            }
        };
        let mut pull_x = vec![0.0; (w + 1) * h];
        for j in 0..h {
            let row = &mut pull_x[j * (w + 1)..(j + 1) * (w + 1)];
            for (i, face) in row.iter_mut().enumerate().take(w).skip(1) {
                *face = pull(j * w + i - 1, j * w + i);
            }
            if wrap.x {
                row[0] = pull(j * w + w - 1, j * w);
                row[w] = row[0];
            }
        }
        let mut pull_z = vec![0.0; w * (h + 1)];
        for j in 1..h {
            for i in 0..w {
                pull_z[j * w + i] = pull((j - 1) * w + i, j * w + i);
            }
        }
        if wrap.z {
            for i in 0..w {
                pull_z[i] = pull((h - 1) * w + i, i);
                pull_z[h * w + i] = pull_z[i];
            }
        }
        let deepest = depth.iter().fold(0.0_f32, |a, &b| a.max(b));
        let mut medium = Self {
            wet: depth.iter().map(|&d| d > 0.0).collect(),
            fastest: (GRAVITY * f64::from(deepest)).sqrt(),
            limit: f64::INFINITY,
            spec,
            depth,
            pull_x,
            pull_z,
            wrap,
            edges,
            damping,
        };
        medium.limit = medium.stable_step();
        Ok(medium)
    }

    /// The largest stable step of leap-frog, 2/ω with ω² the largest eigenvalue of −∇·c²∇, bounded from above by the
    /// largest row sum (Gershgorin): ω² ≤ 2 max Σ c² over the faces of a sample / spacing². Equals spacing/(c√2)
    /// where the speed is the same everywhere.
    fn stable_step(&self) -> f64 {
        let (w, h) = (self.spec.width(), self.spec.height());
        let spacing = f64::from(self.spec.spacing);
        let mut most = 0.0_f64;
        for j in 0..h {
            for i in 0..w {
                let x = j * (w + 1) + i;
                let z = j * w + i;
                let mut sum = f64::from(self.pull_x[x])
                    + f64::from(self.pull_x[x + 1])
                    + f64::from(self.pull_z[z])
                    + f64::from(self.pull_z[z + w]);
                // The outermost face of an open edge lies half as far away, so pulls twice as hard on one sample.
                let own = GRAVITY * f64::from(self.depth[z]) / spacing;
                let at_edge = [i == 0, i + 1 == w, j == 0, j + 1 == h];
                for (edge, here) in self.edges.iter().zip(at_edge) {
                    if here && *edge == Edge::Open {
                        sum += own;
                    }
                }
                most = most.max(sum);
            }
        }
        if most > 0.0 {
            2.0 / (2.0 * most / spacing).sqrt()
        } else {
            f64::INFINITY
        }
    }

    /// Index of sample `n` along an edge.
    pub(super) fn edge_sample(&self, side: usize, n: usize) -> usize {
        let (w, h) = (self.spec.width(), self.spec.height());
        match side {
            0 => n * w,
            1 => n * w + w - 1,
            2 => n,
            _ => (h - 1) * w + n,
        }
    }

    /// The largest stable step of the explicit scheme, seconds; infinite where no water can move.
    pub(super) fn limit(&self) -> f64 {
        self.limit
    }

    /// Speed of the fastest waves, m/s.
    pub(super) fn fastest(&self) -> f64 {
        self.fastest
    }

    /// Depth of the deepest water, metres.
    pub(super) fn deepest(&self) -> f64 {
        depth_of_speed(self.fastest)
    }

    pub(super) fn bytes(&self) -> u64 {
        let floats = self.depth.len() + self.pull_x.len() + self.pull_z.len();
        (4 * floats + self.wet.len()) as u64
    }
}
