//! What the solver is told: parameters, edges and the initial state, and why they may be refused.

use super::bed::BedMotion;
use super::edges::Edges;
use super::splash::SplashSettings;
use crate::grid::{GridError, GridSpec};

/// Largest Courant number that the unsplit scheme is run at.
pub const LARGEST_COURANT: f64 = 0.5;
/// Largest Smagorinsky constant: a larger one would overshoot in the strongest shear that a step allows.
pub const LARGEST_SMAGORINSKY: f64 = 0.2;
/// Default Courant number.
pub const DEFAULT_COURANT: f64 = 0.45;

/// Number type of the state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// `f32`: 28 bytes a cell.
    #[default]
    Single,
    /// `f64`: 56 bytes a cell; for truth runs.
    Double,
}

/// Default relaxation time of [`Method::Bgk`] in steps.
pub const DEFAULT_RELAXATION: f64 = 0.6;

/// How the equations are discretised.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Method {
    /// Well-balanced MUSCL-Hancock finite volumes: everywhere at home.
    #[default]
    FiniteVolume,
    /// Lattice Boltzmann with six moments in calm, deep water and finite volumes elsewhere.
    Lattice(LatticeSettings),
    /// Lattice Boltzmann with nine velocities and one relaxation time: water of moderate depth and speed.
    Bgk {
        /// Relaxation time in steps, above ½: the viscosity is `(relaxation − ½) g h Δt / 2`, for waves that are
        /// long against the grid.
        relaxation: f64,
    },
}

/// Parameters of [`Method::Lattice`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LatticeSettings {
    /// Share of the deviatoric stress that a collision takes away, in (0, 2): the viscosity is
    /// (1/`shear_rate` − ½) g h Δt / 2.
    pub shear_rate: f64,
    /// The same of the isotropic stress.
    pub bulk_rate: f64,
    /// What moving water keeps of its stress in a collision falls by 1 + `sluggish` |u|²/(g h).
    pub sluggish: f64,
    /// (|u| + √(g h)) Δt/Δx where all water is calm, in (0, 0.9]; shrinks in proportion to [`Settings::courant`].
    pub courant: f64,
    /// Share of the largest depth, rounded up to a power of two, up to which water counts as thin.
    pub thin: f64,
    /// Largest Froude number of calm water.
    pub froude: f64,
    /// Largest difference of the surface between neighbours of calm water, in depths.
    pub jump: f64,
}

impl Default for LatticeSettings {
    fn default() -> Self {
        Self {
            shear_rate: 1.95,
            bulk_rate: 1.9,
            sluggish: 17.0,
            courant: 0.65,
            thin: 0.06,
            froude: 0.3,
            jump: 0.007,
        }
    }
}

/// Parameters of [`super::ShallowWater`].
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Discretisation.
    pub method: Method,
    /// Number type of the state.
    pub precision: Precision,
    /// Manning's roughness in s/m^⅓, at least 0.
    pub manning: f64,
    /// Smagorinsky's constant C, at least 0 and at most [`LARGEST_SMAGORINSKY`]: eddies smaller than a cell mix momentum
    /// with the viscosity (C Δx)² |S|; 0 for none.
    pub smagorinsky: f64,
    /// Courant number of the sub-steps, in (0, [`LARGEST_COURANT`]].
    pub courant: f64,
    /// Depth in metres below which velocities fade to 0; default 1e-5 of the largest initial depth. In single
    /// precision it is kept above 32 quanta of depth, 8e-6 of the largest depth.
    pub film_depth: Option<f64>,
    /// What happens at the edges.
    pub edges: Edges,
    /// Elevation of still water above datum in metres, to which potential energy is relative; default: the surface
    /// over the deepest initial water.
    pub level: Option<f64>,
    /// Droplets and foam; absent: none, and nothing is spent on them.
    pub splash: Option<SplashSettings>,
    /// Motions of the ground; none: nothing is spent on them.
    pub bed: Vec<BedMotion>,
    /// Most sub-steps that one call of `advance` may take.
    pub max_substeps: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            method: Method::default(),
            precision: Precision::Single,
            manning: 0.0,
            smagorinsky: 0.0,
            courant: DEFAULT_COURANT,
            film_depth: None,
            edges: Edges::default(),
            level: None,
            splash: None,
            bed: Vec::new(),
            max_substeps: 1_000_000,
        }
    }
}

/// The state at time 0, row-major over a grid.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Initial {
    /// Height of the ground above datum, m.
    pub ground: Vec<f64>,
    /// Height of the water surface above datum, m; dry where it does not exceed the ground.
    pub elevation: Vec<f64>,
    /// Velocity along X and Z, m/s; absent: at rest.
    pub velocity: Option<Vec<[f64; 2]>>,
}

impl Initial {
    /// Evaluates ground and elevation at the samples of a grid, at rest.
    pub fn still(spec: &GridSpec, state: impl Fn(f64, f64) -> (f64, f64)) -> Self {
        let mut initial = Self::moving(spec, |x, z| {
            let (ground, elevation) = state(x, z);
            (ground, elevation, [0.0; 2])
        });
        initial.velocity = None;
        initial
    }

    /// Evaluates ground, elevation and velocity at the samples of a grid.
    pub fn moving(spec: &GridSpec, state: impl Fn(f64, f64) -> (f64, f64, [f64; 2])) -> Self {
        let mut initial = Self::default();
        let mut velocity = Vec::with_capacity(spec.len());
        for j in 0..spec.height() {
            for i in 0..spec.width() {
                let [x, z] = position(spec, i, j);
                let (ground, elevation, v) = state(x, z);
                initial.ground.push(ground);
                initial.elevation.push(elevation);
                velocity.push(v);
            }
        }
        initial.velocity = Some(velocity);
        initial
    }
}

/// Position of sample `(i, j)` in f64: `f32` positions of a long grid would round.
pub fn position(spec: &GridSpec, i: usize, j: usize) -> [f64; 2] {
    let spacing = f64::from(spec.spacing);
    [
        f64::from(spec.origin.x) + spacing * i as f64,
        f64::from(spec.origin.y) + spacing * j as f64,
    ]
}

/// Why a shallow-water solver cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SetupError {
    /// The grid is impossible.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// Too few samples.
    #[error(
        "shallow water needs at least 3 samples along each axis; the grid has {0} x {1}; use a finer spacing"
    )]
    Narrow(usize, usize),
    /// An array has the wrong length.
    #[error("{what} has {found} values; the grid has {expected} samples")]
    Length {
        /// Which array.
        what: &'static str,
        /// Samples of the grid.
        expected: usize,
        /// Values given.
        found: usize,
    },
    /// A value is not finite or too large to compute with.
    #[error(
        "{what} is {value} at sample ({i}, {j}); it must be finite and within ±{limit:e}; correct the data there"
    )]
    Value {
        /// Which quantity, with its unit.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Sample along X.
        i: usize,
        /// Sample along Z.
        j: usize,
        /// Largest magnitude allowed.
        limit: f64,
    },
    /// A parameter is out of range.
    #[error("{name} is {value}; it must be {range}")]
    Parameter {
        /// Its name in scene files.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
    /// A time series cannot be used.
    #[error("point {at} of the time series: {message}")]
    Series {
        /// Number of the point, from 0.
        at: usize,
        /// What is wrong and what would be right.
        message: &'static str,
    },
    /// Only one of two opposite edges is periodic.
    #[error("only one of the edges {low} and {high} is periodic; make both periodic or neither")]
    HalfPeriodic {
        /// The edge at the smaller coordinate.
        low: &'static str,
        /// The edge at the larger coordinate.
        high: &'static str,
    },
}

/// Largest height or depth that is computed with, m.
pub(super) const HEIGHT_LIMIT: f64 = 1e6;
/// Largest relaxation time of the lattice in steps.
const LARGEST_RELAXATION: f64 = 5.0;
/// Largest initial speed, m/s.
const SPEED_LIMIT: f64 = 1e4;

impl Settings {
    /// Checks every parameter.
    ///
    /// # Errors
    /// [`SetupError::Parameter`] or [`SetupError::HalfPeriodic`].
    pub fn check(&self) -> Result<(), SetupError> {
        let parameter = |name, value: f64, sound: bool, range| {
            if sound {
                Ok(())
            } else {
                Err(SetupError::Parameter { name, value, range })
            }
        };
        let Self { manning, courant, .. } = *self;
        parameter(
            "manning",
            manning,
            manning.is_finite() && (0.0..=10.0).contains(&manning),
            "between 0 and 10 s/m^(1/3)",
        )?;
        parameter(
            "smagorinsky",
            self.smagorinsky,
            (0.0..=LARGEST_SMAGORINSKY).contains(&self.smagorinsky),
            "between 0 and 0.2",
        )?;
        parameter(
            "courant",
            courant,
            courant > 0.0 && courant <= LARGEST_COURANT,
            "above 0 and at most 0.5",
        )?;
        if let Method::Lattice(lattice) = self.method {
            for (name, value, most, range) in [
                ("shear_rate", lattice.shear_rate, 1.9999, "above 0 and below 2"),
                ("bulk_rate", lattice.bulk_rate, 1.9999, "above 0 and below 2"),
                ("lattice courant", lattice.courant, 0.9, "above 0 and at most 0.9"),
                (
                    "sluggish",
                    lattice.sluggish + 1.0,
                    1001.0,
                    "at least 0 and at most 1000",
                ),
                ("thin", lattice.thin, 1.0, "above 0 and at most 1"),
                ("froude", lattice.froude, 1.0, "above 0 and at most 1"),
                ("jump", lattice.jump, 1.0, "above 0 and at most 1"),
            ] {
                parameter(name, value, value > 0.0 && value <= most, range)?;
            }
        }
        if let Method::Bgk { relaxation } = self.method {
            parameter(
                "relaxation",
                relaxation,
                relaxation > 0.5 && relaxation <= LARGEST_RELAXATION,
                "above 0.5 and at most 5",
            )?;
        }
        if let Some(film) = self.film_depth {
            parameter(
                "film_depth",
                film,
                film.is_finite() && film > 0.0,
                "a positive length in metres",
            )?;
        }
        if let Some(level) = self.level {
            parameter("level", level, level.abs() <= HEIGHT_LIMIT, "within ±1e6 m")?;
        }
        if let Some(splash) = &self.splash {
            splash.check()?;
        }
        self.edges.check()
    }
}

impl Initial {
    /// Checks lengths and values against a grid.
    ///
    /// # Errors
    /// [`SetupError`] names the array, the sample and the value.
    pub fn check(&self, spec: &GridSpec) -> Result<(), SetupError> {
        spec.validate()?;
        let (w, h) = (spec.width(), spec.height());
        if w < 3 || h < 3 {
            return Err(SetupError::Narrow(w, h));
        }
        let length = |what, found: usize| {
            if found == spec.len() {
                Ok(())
            } else {
                Err(SetupError::Length {
                    what,
                    expected: spec.len(),
                    found,
                })
            }
        };
        length("ground", self.ground.len())?;
        length("elevation", self.elevation.len())?;
        let bounded = |what, limit: f64, value: &dyn Fn(usize) -> f64| {
            // NaN compares as not within.
            match (0..spec.len()).find(|&k| !(value(k).abs() <= limit)) {
                None => Ok(()),
                Some(k) => Err(SetupError::Value {
                    what,
                    value: value(k),
                    i: k % w,
                    j: k / w,
                    limit,
                }),
            }
        };
        bounded("ground height in m", HEIGHT_LIMIT, &|k| self.ground[k])?;
        bounded("water elevation in m", HEIGHT_LIMIT, &|k| self.elevation[k])?;
        if let Some(velocity) = &self.velocity {
            length("velocity", velocity.len())?;
            bounded("velocity along X in m/s", SPEED_LIMIT, &|k| velocity[k][0])?;
            bounded("velocity along Z in m/s", SPEED_LIMIT, &|k| velocity[k][1])?;
        }
        Ok(())
    }
}
