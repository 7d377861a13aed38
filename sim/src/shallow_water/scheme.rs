//! The schemes behind one solver. Each holds the water as the finite-volume scheme does, so that actions, exchanges,
//! totals and checkpoints need not know which one steps it.

use super::bgk::Bgk;
use super::finite_volume::{FiniteVolume, Refusal, Stepped};
use super::lattice::Lattice;
use super::real::Real;
use super::settings::{Method, Settings};

/// A scheme with its state.
pub(crate) enum Scheme<T> {
    FiniteVolume(FiniteVolume<T>),
    Lattice(Lattice<T>),
    Bgk(Bgk<T>),
}

impl<T: Real> Scheme<T> {
    /// The scheme that the settings ask for, around water in its initial state.
    pub(crate) fn new(water: FiniteVolume<T>, settings: &Settings) -> Self {
        match settings.method {
            Method::FiniteVolume => Self::FiniteVolume(water),
            Method::Lattice(lattice) => Self::Lattice(Lattice::new(water, lattice)),
            Method::Bgk { relaxation } => Self::Bgk(Bgk::new(water, relaxation)),
        }
    }

    /// Depth, momentum and bed.
    pub(crate) fn water(&self) -> &FiniteVolume<T> {
        match self {
            Self::FiniteVolume(water) => water,
            Self::Lattice(lattice) => lattice.water(),
            Self::Bgk(bgk) => bgk.water(),
        }
    }

    /// Depth, momentum and bed, to be changed from outside.
    pub(crate) fn water_mut(&mut self) -> &mut FiniteVolume<T> {
        match self {
            Self::FiniteVolume(water) => water,
            Self::Lattice(lattice) => lattice.water_mut(),
            Self::Bgk(bgk) => bgk.water_mut(),
        }
    }

    /// Fastest signal of the present state in m/s, weighted by what the scheme allows.
    pub(crate) fn probe(&mut self, time: f64) -> f64 {
        match self {
            Self::FiniteVolume(water) => water.probe(time),
            Self::Lattice(lattice) => lattice.water_mut().probe(time),
            Self::Bgk(bgk) => bgk.probe(),
        }
    }

    /// An estimate of [`Self::probe`] that changes nothing.
    pub(crate) fn estimated_speed(&self) -> f64 {
        match self {
            Self::FiniteVolume(water) => water.estimated_speed(),
            Self::Lattice(lattice) => lattice.water().estimated_speed(),
            Self::Bgk(bgk) => bgk.probe(),
        }
    }

    /// Takes one step of `dt` seconds from `time` unless the fastest signal would then pass `courant` times
    /// `tolerated`.
    pub(crate) fn try_step(
        &mut self,
        time: f64,
        dt: f64,
        courant: f64,
        tolerated: f64,
    ) -> Result<Stepped, Refusal> {
        match self {
            Self::FiniteVolume(water) => water.try_step(time, dt, courant * tolerated),
            Self::Lattice(lattice) => lattice.try_step(time, dt, courant * tolerated),
            Self::Bgk(bgk) => bgk.try_step(time, dt, courant * tolerated),
        }
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        let planes = match self {
            Self::FiniteVolume(_) => 0,
            Self::Lattice(lattice) => lattice.bytes(),
            Self::Bgk(_) => self.planes().map(size_of_val).sum(),
        };
        self.water().bytes() + planes
    }

    /// Length of a lattice's last step in seconds, 0 where it does not matter; `None` for a scheme without lattice.
    pub(crate) fn step(&self) -> Option<f64> {
        match self {
            Self::FiniteVolume(_) => None,
            Self::Lattice(_) => Some(0.0),
            Self::Bgk(bgk) => Some(bgk.step),
        }
    }

    /// Goes on from planes that were written from outside, of a last step of that length.
    pub(crate) fn resume(&mut self, step: f64) {
        match self {
            Self::FiniteVolume(_) => {}
            Self::Lattice(lattice) => lattice.resume(),
            Self::Bgk(bgk) => bgk.step = step,
        }
    }

    /// What a lattice holds besides the water, in padded arrays.
    pub(crate) fn planes(&self) -> impl Iterator<Item = &[T]> {
        let planes = match self {
            Self::FiniteVolume(_) => &[][..],
            Self::Lattice(lattice) => &lattice.moments[..],
            Self::Bgk(bgk) => &bgk.populations[..],
        };
        planes.iter().map(Vec::as_slice)
    }

    pub(crate) fn planes_mut(&mut self) -> impl Iterator<Item = &mut [T]> {
        let planes = match self {
            Self::FiniteVolume(_) => &mut [][..],
            Self::Lattice(lattice) => &mut lattice.moments[..],
            Self::Bgk(bgk) => &mut bgk.populations[..],
        };
        planes.iter_mut().map(Vec::as_mut_slice)
    }
}
