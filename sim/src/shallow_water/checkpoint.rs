//! The whole state of a run as plain data, for restarts.

use super::real::Real;
use super::scheme::Scheme;
use super::settings::Precision;
use super::splash::{Ledger, Splash};
use super::storage::Quantum;
use crate::grid::GridSpec;
use serde::{Deserialize, Serialize};

/// Everything that the further run depends on, besides the settings and the initial state that the solver was made with.
/// Numbers of either precision are held as `f64`, exactly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Where the samples stand.
    pub spec: GridSpec,
    /// Whether the state is in double precision.
    pub double: bool,
    /// Simulated time, s.
    pub time: f64,
    /// Height above datum to which `bed` is relative, m.
    pub base: f64,
    /// Unit of all depths, m.
    pub quantum: f64,
    /// Fastest signal as last seen, m/s; absent: to be found anew.
    pub speed: Option<f64>,
    /// What each tile of the grid remembers of its last step.
    pub tiles: Vec<TileMemory>,
    /// Bed relative to `base`, m, row-major.
    pub bed: Vec<f64>,
    /// Depth, m, row-major.
    pub depth: Vec<f64>,
    /// Momentum per area along X, m²/s, row-major.
    pub momentum_x: Vec<f64>,
    /// Momentum per area along Z, m²/s, row-major.
    pub momentum_z: Vec<f64>,
    /// What a lattice scheme holds besides; absent for finite volumes.
    #[serde(default)]
    pub lattice: Option<LatticeMemory>,
    /// Droplets and foam; absent where the solver makes none.
    #[serde(default)]
    pub splash: Option<SplashMemory>,
    /// Bodies, if there are any that move.
    #[cfg(feature = "bodies")]
    #[serde(default)]
    pub bodies: Option<crate::bodies::BodiesCheckpoint>,
}

/// Droplets and foam of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SplashMemory {
    /// Centres of the droplets, m.
    pub position: Vec<[f64; 3]>,
    /// Their velocities, m/s.
    pub velocity: Vec<[f64; 3]>,
    /// Their volumes as depths over one cell, m.
    pub height: Vec<f64>,
    /// Their radii, m.
    pub radius: Vec<f64>,
    /// Water that landed but did not make a whole quantum, m over one cell.
    pub carry: f64,
    /// Sub-steps taken.
    pub steps: u64,
    /// The books, in the units of the run.
    pub ledger: Ledger,
    /// Time since foam was last carried along, s.
    pub foam_pending: f64,
    /// Coverage, row-major; empty without foam.
    pub foam: Vec<f32>,
}

impl SplashMemory {
    /// Whether `splash` can go on from it.
    pub(crate) fn check(&self, splash: &Splash) -> Result<(), CheckpointError> {
        let droplets = self.height.len();
        for (what, found, expected) in [
            ("droplet positions", self.position.len(), droplets),
            ("droplet velocities", self.velocity.len(), droplets),
            ("droplet radii", self.radius.len(), droplets),
            ("foam", self.foam.len(), splash.foam_len()),
        ] {
            if found != expected {
                return Err(CheckpointError::Length {
                    what,
                    expected,
                    found,
                });
            }
        }
        let sound = |values: &[f64], least: f64| values.iter().position(|v| !(v.is_finite() && *v >= least));
        for (what, values, least) in [
            (
                "droplet position",
                self.position.as_flattened(),
                f64::NEG_INFINITY,
            ),
            (
                "droplet velocity",
                self.velocity.as_flattened(),
                f64::NEG_INFINITY,
            ),
            ("droplet volume", self.height.as_slice(), 0.0),
            ("droplet radius", self.radius.as_slice(), 0.0),
            (
                "water between grid and droplets",
                std::slice::from_ref(&self.carry),
                f64::NEG_INFINITY,
            ),
            ("time of the foam", std::slice::from_ref(&self.foam_pending), 0.0),
        ] {
            if let Some(at) = sound(values, least) {
                return Err(CheckpointError::Damaged {
                    what,
                    value: values[at],
                    at,
                });
            }
        }
        // Interpolation swings a little beyond 0 and 1.
        match self.foam.iter().position(|c| !(-1.0..=2.0).contains(c)) {
            Some(at) => Err(CheckpointError::Damaged {
                what: "foam",
                value: f64::from(self.foam[at]),
                at,
            }),
            None => Ok(()),
        }
    }
}

/// What a lattice scheme holds besides depth and momentum.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LatticeMemory {
    /// Length of the last step, s; 0 before the first.
    pub step: f64,
    /// Populations or moments, each row-major.
    pub planes: Vec<Vec<f64>>,
}

/// What a tile remembers of its last step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TileMemory {
    /// Whether its next step must be computed.
    pub awake: bool,
    /// Fastest signal in it, m/s.
    pub speed: f64,
}

/// Why a checkpoint cannot be restored.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// It was taken on another grid.
    #[error("the checkpoint was taken on another grid; make the solver from the same scene")]
    Grid,
    /// It was taken in another precision.
    #[error("the checkpoint was taken in {found} precision; make the solver in the same")]
    Precision {
        /// Precision of the checkpoint.
        found: &'static str,
    },
    /// One of solver and checkpoint has droplets and foam, the other has not.
    #[error("only one of checkpoint and solver has splashes; make the solver with the same settings")]
    Splash,
    /// Its bodies cannot be restored.
    #[cfg(feature = "bodies")]
    #[error(transparent)]
    Bodies(#[from] crate::bodies::BodyError),
    /// A value cannot be part of a state.
    #[error("checkpoint: {what} is {value} at entry {at}, which no state holds; the file is damaged")]
    Damaged {
        /// Which quantity.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Number of the entry, row-major.
        at: usize,
    },
    /// An array has the wrong length.
    #[error(
        "checkpoint: {what} has {found} entries instead of {expected}; it is of another version or damaged"
    )]
    Length {
        /// Which array.
        what: &'static str,
        /// Entries that this solver has.
        expected: usize,
        /// Entries found.
        found: usize,
    },
}

impl Checkpoint {
    pub(crate) fn new<T: Real>(
        scheme: &Scheme<T>,
        spec: &GridSpec,
        precision: Precision,
        time: f64,
        speed: Option<f64>,
    ) -> Self {
        let core = scheme.water();
        let layout = core.layout();
        let gather = |values: &[T]| -> Vec<f64> {
            (0..layout.nz)
                .flat_map(|j| &values[layout.row(j)])
                .map(|v| v.to_f64())
                .collect()
        };
        let fields = core.fields();
        Self {
            spec: *spec,
            double: precision == Precision::Double,
            time,
            base: core.base(),
            quantum: core.quantum().length(),
            speed,
            tiles: core.tile_memory(),
            bed: gather(core.bed()),
            depth: gather(&fields.h),
            momentum_x: gather(&fields.qx),
            momentum_z: gather(&fields.qz),
            lattice: scheme.step().map(|step| LatticeMemory {
                step,
                planes: scheme.planes().map(gather).collect(),
            }),
            splash: None,
            #[cfg(feature = "bodies")]
            bodies: None,
        }
    }

    fn check(&self, spec: &GridSpec, precision: Precision) -> Result<(), CheckpointError> {
        if self.spec != *spec {
            return Err(CheckpointError::Grid);
        }
        if self.double != (precision == Precision::Double) {
            let found = if self.double { "double" } else { "single" };
            return Err(CheckpointError::Precision { found });
        }
        let damaged = |what, value, at| Err(CheckpointError::Damaged { what, value, at });
        for (what, value, sound) in [
            ("time", self.time, self.time.is_finite()),
            ("base", self.base, self.base.is_finite()),
            (
                "quantum",
                self.quantum,
                self.quantum.is_normal() && self.quantum > 0.0,
            ),
            (
                "speed",
                self.speed.unwrap_or(0.0),
                self.speed.is_none_or(|s| s.is_finite() && s >= 0.0),
            ),
        ] {
            if !sound {
                return damaged(what, value, 0);
            }
        }
        if let Some(at) = self
            .tiles
            .iter()
            .position(|t| !(t.speed.is_finite() && t.speed >= 0.0))
        {
            return damaged("tile speed", self.tiles[at].speed, at);
        }
        for (what, values, least) in [
            ("bed", &self.bed, f64::NEG_INFINITY),
            ("depth", &self.depth, 0.0),
            ("momentum_x", &self.momentum_x, f64::NEG_INFINITY),
            ("momentum_z", &self.momentum_z, f64::NEG_INFINITY),
        ] {
            if values.len() != spec.len() {
                return Err(CheckpointError::Length {
                    what,
                    expected: spec.len(),
                    found: values.len(),
                });
            }
            if let Some(at) = values.iter().position(|v| !(v.is_finite() && *v >= least)) {
                return damaged(what, values[at], at);
            }
        }
        Ok(())
    }

    fn check_lattice<T: Real>(&self, scheme: &Scheme<T>) -> Result<(), CheckpointError> {
        let expected = scheme.planes().count();
        let found = self.lattice.as_ref().map_or(0, |m| m.planes.len());
        if expected != found {
            return Err(CheckpointError::Length {
                what: "planes of the lattice",
                expected,
                found,
            });
        }
        let Some(memory) = &self.lattice else {
            return Ok(());
        };
        if !(memory.step.is_finite() && memory.step >= 0.0) {
            return Err(CheckpointError::Damaged {
                what: "step",
                value: memory.step,
                at: 0,
            });
        }
        for plane in &memory.planes {
            if plane.len() != self.spec.len() {
                return Err(CheckpointError::Length {
                    what: "a plane of the lattice",
                    expected: self.spec.len(),
                    found: plane.len(),
                });
            }
            if let Some(at) = plane.iter().position(|v| !v.is_finite()) {
                return Err(CheckpointError::Damaged {
                    what: "plane of the lattice",
                    value: plane[at],
                    at,
                });
            }
        }
        Ok(())
    }

    pub(crate) fn apply<T: Real>(
        &self,
        scheme: &mut Scheme<T>,
        spec: &GridSpec,
        precision: Precision,
    ) -> Result<(), CheckpointError> {
        self.check(spec, precision)?;
        self.check_lattice(scheme)?;
        let tiles = scheme.water().tile_memory().len();
        if self.tiles.len() != tiles {
            return Err(CheckpointError::Length {
                what: "tiles",
                expected: tiles,
                found: self.tiles.len(),
            });
        }
        if let Some(memory) = &self.lattice {
            let nx = spec.width();
            let layout = scheme.water().layout();
            for (plane, stored) in scheme.planes_mut().zip(&memory.planes) {
                for (j, row) in stored.chunks(nx).enumerate() {
                    for (into, from) in plane[layout.row(j)].iter_mut().zip(row) {
                        *into = T::from_f64(*from);
                    }
                }
            }
            scheme.resume(memory.step);
        }
        let core = scheme.water_mut();
        let layout = core.layout();
        let mut bed = vec![T::ZERO; layout.len()];
        let fields = core.fields_mut();
        let nx = layout.nx;
        for j in 0..layout.nz {
            let (here, stored) = (layout.row(j), j * nx..(j + 1) * nx);
            for (into, from) in [
                (&mut bed, &self.bed),
                (&mut fields.h, &self.depth),
                (&mut fields.qx, &self.momentum_x),
                (&mut fields.qz, &self.momentum_z),
            ] {
                for (into, from) in into[here.clone()].iter_mut().zip(&from[stored.clone()]) {
                    *into = T::from_f64(*from);
                }
            }
        }
        core.resume(bed, Quantum::from_length(self.quantum), self.base, &self.tiles);
        Ok(())
    }
}
