//! The heightfield frame: the one thing that all solvers make and all renderers take.

use crate::grid::{Grid, GridSpec};
use glam::{Quat, Vec2, Vec3};
use serde::{Deserialize, Serialize};
use std::fmt;

/// A set of optional frame channels. `elevation` is always there and has no bit.
///
/// `renderer.needs(scene) & solver.offers()` decides what is extracted and recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Channels(u32);

impl Channels {
    /// No optional channel.
    pub const NONE: Self = Self(0);
    /// Water depth in metres, `Grid<f32>`.
    pub const DEPTH: Self = Self(1);
    /// Depth-averaged horizontal velocity in m/s, `Grid<Vec2>`.
    pub const VELOCITY: Self = Self(1 << 1);
    /// Horizontal displacement of the surface point that belongs to the sample, metres, `Grid<Vec2>`.
    pub const DISPLACEMENT: Self = Self(1 << 2);
    /// Foam coverage, 0 to 1, `Grid<f32>`.
    pub const FOAM: Self = Self(1 << 3);
    /// Water in flight, [`Droplets`].
    pub const DROPLETS: Self = Self(1 << 4);
    /// Poses of the scene's bodies, in the order of the scene's objects.
    pub const BODIES: Self = Self(1 << 5);
    /// What a method of particles computes with, for export: [`Droplets`] that no renderer draws.
    pub const PARTICLES: Self = Self(1 << 6);
    /// Every channel there is.
    pub const ALL: Self = Self(0x7f);

    const NAMES: [(&'static str, Self); 7] = [
        ("depth", Self::DEPTH),
        ("velocity", Self::VELOCITY),
        ("displacement", Self::DISPLACEMENT),
        ("foam", Self::FOAM),
        ("droplets", Self::DROPLETS),
        ("bodies", Self::BODIES),
        ("particles", Self::PARTICLES),
    ];

    /// The bits, for storage.
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// From stored bits; `None` if a bit has no meaning in this version.
    pub const fn from_bits(bits: u32) -> Option<Self> {
        if bits & !Self::ALL.0 == 0 {
            Some(Self(bits))
        } else {
            None
        }
    }

    /// Whether every channel of `other` is in this set.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether no optional channel is in this set.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The channels of the set, one at a time, with the names that scene files and exports use.
    pub fn iter(self) -> impl Iterator<Item = (&'static str, Self)> {
        Self::NAMES.into_iter().filter(move |(_, c)| self.contains(*c))
    }

    /// The channel of that name, as in scene files.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(n, _)| *n == name).map(|(_, c)| *c)
    }

    /// The names that [`Self::from_name`] knows.
    pub fn names() -> impl Iterator<Item = &'static str> {
        Self::NAMES.iter().map(|(n, _)| *n)
    }
}

impl std::ops::BitOr for Channels {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl std::ops::BitOrAssign for Channels {
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

impl std::ops::BitAnd for Channels {
    type Output = Self;
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl std::ops::Sub for Channels {
    type Output = Self;
    /// The channels of `self` that are not in `other`.
    fn sub(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }
}

impl fmt::Display for Channels {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_empty() {
            return f.write_str("none");
        }
        for (n, (name, _)) in self.iter().enumerate() {
            if n > 0 {
                f.write_str(", ")?;
            }
            f.write_str(name)?;
        }
        Ok(())
    }
}

/// Water in flight, as a struct of arrays; all arrays have the same length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Droplets {
    /// Centres in metres.
    pub position: Vec<Vec3>,
    /// Velocities in m/s.
    pub velocity: Vec<Vec3>,
    /// Radii in metres; a droplet is a sphere of this radius.
    pub radius: Vec<f32>,
}

impl Droplets {
    /// Number of droplets.
    pub fn len(&self) -> usize {
        self.radius.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.radius.is_empty()
    }

    /// Removes all, keeping the allocations.
    pub fn clear(&mut self) {
        self.position.clear();
        self.velocity.clear();
        self.radius.clear();
    }
}

/// Position and motion of a rigid body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyPose {
    /// World position of the body's origin in metres.
    pub position: Vec3,
    /// Rotation `world_from_body`, a unit quaternion.
    pub rotation: Quat,
    /// Velocity of the origin in m/s.
    pub velocity: Vec3,
    /// Angular velocity in rad/s, world axes.
    pub angular_velocity: Vec3,
}

impl Default for BodyPose {
    fn default() -> Self {
        Self {
            position: Vec3::ZERO,
            rotation: Quat::IDENTITY,
            velocity: Vec3::ZERO,
            angular_velocity: Vec3::ZERO,
        }
    }
}

/// The state of the water at one time, as a heightfield.
///
/// Normals and slopes are derived, never stored. Where the ground reaches above `elevation` there is no water: a sample
/// is **dry** where `elevation <= ground`. Solvers with a moving shoreline continue the surface below the ground for a
/// few samples beyond it (see [`extend_into_dry`]), so that the interpolated waterline lies where the water ends
/// rather than creeping up the shore.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Simulated time in seconds.
    pub time: f64,
    /// Number of the frame, from 0.
    pub index: u64,
    /// Height of the water surface above datum in metres (not the depth).
    pub elevation: Grid<f32>,
    /// Water depth in metres, never negative.
    pub depth: Option<Grid<f32>>,
    /// Depth-averaged horizontal velocity in m/s.
    pub velocity: Option<Grid<Vec2>>,
    /// Horizontal displacement of each sample's surface point in metres.
    pub displacement: Option<Grid<Vec2>>,
    /// Foam coverage, 0 to 1.
    pub foam: Option<Grid<f32>>,
    /// Water in flight.
    pub droplets: Option<Droplets>,
    /// Poses of the scene's objects, in the order of the scene.
    pub bodies: Option<Vec<BodyPose>>,
    /// All the particles that a method computes with, in no order; their radii are those of their volumes.
    pub particles: Option<Droplets>,
}

/// A value in a frame that no solver may hand out and no renderer may draw.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("frame {frame} holds {value} in channel `{channel}` at sample {at}; the frame is refused")]
pub struct NonFiniteFrame {
    /// The frame's number.
    pub frame: u64,
    /// Name of the channel.
    pub channel: &'static str,
    /// Number of the sample or element in its channel, row-major.
    pub at: usize,
    /// The offending value.
    pub value: f32,
}

impl Frame {
    /// A flat frame at elevation 0, time 0, with no optional channel.
    pub fn new(spec: GridSpec) -> Self {
        Self {
            time: 0.0,
            index: 0,
            elevation: Grid::filled(spec, 0.0),
            depth: None,
            velocity: None,
            displacement: None,
            foam: None,
            droplets: None,
            bodies: None,
            particles: None,
        }
    }

    /// Where the samples stand.
    pub fn spec(&self) -> &GridSpec {
        self.elevation.spec()
    }

    /// The optional channels that are present.
    pub fn channels(&self) -> Channels {
        let mut set = Channels::NONE;
        for (present, channel) in [
            (self.depth.is_some(), Channels::DEPTH),
            (self.velocity.is_some(), Channels::VELOCITY),
            (self.displacement.is_some(), Channels::DISPLACEMENT),
            (self.foam.is_some(), Channels::FOAM),
            (self.droplets.is_some(), Channels::DROPLETS),
            (self.bodies.is_some(), Channels::BODIES),
            (self.particles.is_some(), Channels::PARTICLES),
        ] {
            if present {
                set |= channel;
            }
        }
        set
    }

    /// The list that `channel` names: droplets or particles.
    pub(crate) fn spheres(&self, channel: Channels) -> Option<&Droplets> {
        match channel {
            Channels::DROPLETS => self.droplets.as_ref(),
            Channels::PARTICLES => self.particles.as_ref(),
            _ => None,
        }
    }

    /// As [`Self::spheres`], to be changed.
    pub(crate) fn spheres_mut(&mut self, channel: Channels) -> Option<&mut Droplets> {
        match channel {
            Channels::DROPLETS => self.droplets.as_mut(),
            Channels::PARTICLES => self.particles.as_mut(),
            _ => None,
        }
    }

    /// Makes the frame hold exactly `channels` over `spec`, reusing what is allocated. Values are unspecified.
    pub fn prepare(&mut self, spec: GridSpec, channels: Channels) {
        fn fit<T: Clone>(slot: &mut Option<Grid<T>>, wanted: bool, spec: GridSpec, value: T) {
            match (wanted, slot.as_mut()) {
                (false, _) => *slot = None,
                (true, Some(grid)) => grid.reshape(spec, value),
                (true, None) => *slot = Some(Grid::filled(spec, value)),
            }
        }
        self.elevation.reshape(spec, 0.0);
        fit(&mut self.depth, channels.contains(Channels::DEPTH), spec, 0.0);
        fit(
            &mut self.velocity,
            channels.contains(Channels::VELOCITY),
            spec,
            Vec2::ZERO,
        );
        fit(
            &mut self.displacement,
            channels.contains(Channels::DISPLACEMENT),
            spec,
            Vec2::ZERO,
        );
        fit(&mut self.foam, channels.contains(Channels::FOAM), spec, 0.0);
        for (list, channel) in [
            (&mut self.droplets, Channels::DROPLETS),
            (&mut self.particles, Channels::PARTICLES),
        ] {
            if channels.contains(channel) {
                list.get_or_insert_default().clear();
            } else {
                *list = None;
            }
        }
        if channels.contains(Channels::BODIES) {
            self.bodies.get_or_insert_default().clear();
        } else {
            self.bodies = None;
        }
    }

    /// Finds the first value that is not finite.
    ///
    /// # Errors
    /// [`NonFiniteFrame`] names channel, sample and value.
    pub fn check_finite(&self) -> Result<(), NonFiniteFrame> {
        fn first(values: &[f32]) -> Option<(usize, f32)> {
            values.iter().position(|v| !v.is_finite()).map(|k| (k, values[k]))
        }
        fn flat<T: bytemuck::NoUninit>(values: &[T]) -> &[f32] {
            bytemuck::cast_slice(values)
        }
        let mut lists: Vec<(&'static str, usize, &[f32])> = vec![("elevation", 1, self.elevation.as_slice())];
        if let Some(g) = &self.depth {
            lists.push(("depth", 1, g.as_slice()));
        }
        if let Some(g) = &self.velocity {
            lists.push(("velocity", 2, flat(g.as_slice())));
        }
        if let Some(g) = &self.displacement {
            lists.push(("displacement", 2, flat(g.as_slice())));
        }
        if let Some(g) = &self.foam {
            lists.push(("foam", 1, g.as_slice()));
        }
        for (name, list) in [("droplets", &self.droplets), ("particles", &self.particles)] {
            if let Some(d) = list {
                lists.push((name, 3, flat(&d.position)));
                lists.push((name, 3, flat(&d.velocity)));
                lists.push((name, 1, &d.radius));
            }
        }
        for (channel, stride, values) in lists {
            if let Some((k, value)) = first(values) {
                return Err(NonFiniteFrame {
                    frame: self.index,
                    channel,
                    at: k / stride,
                    value,
                });
            }
        }
        for (at, b) in self.bodies.iter().flatten().enumerate() {
            let values = [
                b.position.to_array(),
                b.velocity.to_array(),
                b.angular_velocity.to_array(),
            ];
            let bad = values
                .into_iter()
                .flatten()
                .chain(b.rotation.to_array())
                .find(|v| !v.is_finite());
            if let Some(value) = bad {
                return Err(NonFiniteFrame {
                    frame: self.index,
                    channel: "bodies",
                    at,
                    value,
                });
            }
        }
        Ok(())
    }
}

/// Continues the wet surface into dry samples, one ring of neighbours a pass, so that the bilinear surface meets the
/// shore where the water ends. A dry sample takes the mean of its wet neighbours, but never more than the ground
/// there (so it stays dry); samples out of reach take the ground. `depth` says what is wet (`> 0`).
pub fn extend_into_dry(elevation: &mut Grid<f32>, depth: &Grid<f32>, ground: &Grid<f32>, passes: usize) {
    let (w, h) = (elevation.spec().width(), elevation.spec().height());
    let around = |k: usize| {
        let (i, j) = (k % w, k / w);
        let rows = j.saturating_sub(1)..(j + 2).min(h);
        rows.flat_map(move |b| (i.saturating_sub(1)..(i + 2).min(w)).map(move |a| b * w + a))
    };
    let mut known: Vec<bool> = depth.as_slice().iter().map(|&d| d > 0.0).collect();
    // Dry samples of the next ring, found from the wet ones beside them.
    let mut listed = known.clone();
    let (mut ring, mut values) = (Vec::new(), Vec::new());
    let list = |k: usize, listed: &mut [bool], ring: &mut Vec<usize>| {
        for n in around(k) {
            if !std::mem::replace(&mut listed[n], true) {
                ring.push(n);
            }
        }
    };
    let surface = elevation.as_mut_slice();
    for k in 0..known.len() {
        if !known[k] {
            surface[k] = ground.as_slice()[k];
        } else if passes > 0 {
            list(k, &mut listed, &mut ring);
        }
    }
    for _ in 0..passes {
        values.clear();
        values.extend(ring.iter().map(|&k| {
            let (mut sum, mut count) = (0.0_f32, 0.0_f32);
            for n in around(k).filter(|n| known[*n]) {
                sum += surface[n];
                count += 1.0;
            }
            (sum / count).min(ground.as_slice()[k])
        }));
        for (&k, &value) in ring.iter().zip(&values) {
            (surface[k], known[k]) = (value, true);
        }
        for k in std::mem::take(&mut ring) {
            list(k, &mut listed, &mut ring);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::UVec2;

    fn spec() -> GridSpec {
        GridSpec::new(Vec2::ZERO, 1.0, UVec2::new(6, 1)).unwrap()
    }

    #[test]
    fn channel_sets_behave_as_sets() {
        let set = Channels::DEPTH | Channels::FOAM;
        assert!(set.contains(Channels::DEPTH) && !set.contains(Channels::VELOCITY));
        assert_eq!(set.to_string(), "depth, foam");
        assert_eq!(set - Channels::FOAM, Channels::DEPTH);
        assert_eq!(Channels::from_bits(1 << 20), None);
        for (name, channel) in Channels::ALL.iter() {
            assert_eq!(Channels::from_name(name), Some(channel));
        }
    }

    #[test]
    fn non_finite_values_are_found_in_every_channel() {
        let mut frame = Frame::new(spec());
        frame.prepare(spec(), Channels::ALL);
        frame.check_finite().unwrap();
        frame.velocity.as_mut().unwrap().as_mut_slice()[4].y = f32::NAN;
        let error = frame.check_finite().unwrap_err();
        assert_eq!((error.channel, error.at), ("velocity", 4));
    }

    #[test]
    fn the_surface_continues_below_the_shore() {
        let ground = Grid::from_fn(spec(), |i, _| i as f32 - 1.5);
        let depth = Grid::from_fn(spec(), |i, _| if i < 2 { 1.5 - i as f32 } else { 0.0 });
        let mut elevation = Grid::filled(spec(), 0.0);
        extend_into_dry(&mut elevation, &depth, &ground, 2);
        assert_eq!(elevation.as_slice(), &[0.0, 0.0, 0.0, 0.0, 2.5, 3.5]);
    }
}
