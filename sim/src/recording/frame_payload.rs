//! A frame as the payload of a chunk: structure, then its arrays one after the other.

use super::codec::{self, MAX_FRAME_STRUCTURE, StoredAction, StoredFrame, StoredPlane};
use super::plane::{self, Layout, Task};
use super::{MAX_BODIES, MAX_DROPLETS};
use crate::events::Action;
use crate::frame::{BodyPose, Channels, Droplets, Frame};
use crate::grid::{Grid, GridSpec};
use crate::solver::StepReport;
use glam::{Quat, Vec2, Vec3};
use rayon::prelude::*;
use std::borrow::Cow;

/// Numbers of one body: position, rotation, velocity, angular velocity.
const BODY: usize = 13;

/// One array of a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaneSpec {
    /// The channel that it belongs to.
    pub(super) channel: &'static str,
    /// Its numbers.
    pub(super) layout: Layout,
    /// Whether the tolerance applies; else every bit is kept.
    pub(super) tolerant: bool,
    /// Whether a frame holds its numbers between those of other arrays.
    interleaved: bool,
}

/// How many elements the lists of a frame hold; 0 without their channels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Counts {
    pub(super) droplets: usize,
    pub(super) bodies: usize,
    pub(super) particles: usize,
}

impl Counts {
    /// That of droplets or of particles.
    fn of(self, channel: Channels) -> usize {
        if channel == Channels::PARTICLES {
            self.particles
        } else {
            self.droplets
        }
    }

    fn count(frame: &Frame, channels: Channels) -> Self {
        let held = |channel, count: Option<usize>| {
            if channels.contains(channel) {
                count.unwrap_or(0)
            } else {
                0
            }
        };
        Self {
            droplets: held(Channels::DROPLETS, frame.droplets.as_ref().map(Droplets::len)),
            bodies: held(Channels::BODIES, frame.bodies.as_ref().map(Vec::len)),
            particles: held(Channels::PARTICLES, frame.particles.as_ref().map(Droplets::len)),
        }
    }
}

/// The arrays of a frame, in the order in which they are stored.
pub(super) fn planes(spec: GridSpec, channels: Channels, counts: Counts) -> Vec<PlaneSpec> {
    let grid = Layout::new(spec.len(), spec.width());
    let mut list = Vec::with_capacity(34);
    let mut add = |channel, count, layout, tolerant| {
        let spec = PlaneSpec {
            channel,
            layout,
            tolerant,
            interleaved: count > 1,
        };
        list.extend(std::iter::repeat_n(spec, count));
    };
    add("elevation", 1, grid, true);
    for (name, channel) in channels.iter() {
        match channel {
            Channels::VELOCITY | Channels::DISPLACEMENT => add(name, 2, grid, true),
            Channels::DROPLETS | Channels::PARTICLES => {
                let count = counts.of(channel);
                let layout = Layout::new(count, count);
                add(name, 6, layout, true);
                // A radius is often smaller than the tolerance of positions and would vanish.
                add(name, 1, layout, false);
            }
            // Few numbers, and a rotation must stay a unit quaternion.
            Channels::BODIES => add(name, BODY, Layout::new(counts.bodies, counts.bodies), false),
            _ => add(name, 1, grid, true),
        }
    }
    list
}

/// The numbers of every array, in the order of [`planes`].
fn values(frame: &Frame, channels: Channels) -> Vec<Cow<'_, [f32]>> {
    fn pick<const N: usize, T: Copy>(values: &[T], parts: fn(T) -> [f32; N], out: &mut Vec<Cow<'_, [f32]>>) {
        out.extend((0..N).map(|n| Cow::Owned(values.iter().map(|&v| parts(v)[n]).collect())));
    }
    fn vectors(grid: Option<&Grid<Vec2>>) -> &[Vec2] {
        grid.map_or(&[], Grid::as_slice)
    }
    fn scalars(grid: Option<&Grid<f32>>) -> Cow<'_, [f32]> {
        Cow::Borrowed(grid.map_or(&[], Grid::as_slice))
    }
    let mut list = vec![Cow::Borrowed(frame.elevation.as_slice())];
    for (_, channel) in channels.iter() {
        match channel {
            Channels::DEPTH => list.push(scalars(frame.depth.as_ref())),
            Channels::FOAM => list.push(scalars(frame.foam.as_ref())),
            Channels::VELOCITY => pick(vectors(frame.velocity.as_ref()), |v| v.to_array(), &mut list),
            Channels::DISPLACEMENT => pick(vectors(frame.displacement.as_ref()), |v| v.to_array(), &mut list),
            Channels::DROPLETS | Channels::PARTICLES => {
                if let Some(d) = frame.spheres(channel) {
                    pick(&d.position, |v| v.to_array(), &mut list);
                    pick(&d.velocity, |v| v.to_array(), &mut list);
                    list.push(Cow::Borrowed(&d.radius));
                }
            }
            _ => pick(
                frame.bodies.as_deref().unwrap_or_default(),
                body_to_array,
                &mut list,
            ),
        }
    }
    list
}

fn body_to_array(b: BodyPose) -> [f32; BODY] {
    let mut out = [0.0; BODY];
    out[..3].copy_from_slice(&b.position.to_array());
    out[3..7].copy_from_slice(&b.rotation.to_array());
    out[7..10].copy_from_slice(&b.velocity.to_array());
    out[10..].copy_from_slice(&b.angular_velocity.to_array());
    out
}

fn body_from_array(a: [f32; BODY]) -> BodyPose {
    BodyPose {
        position: Vec3::new(a[0], a[1], a[2]),
        rotation: Quat::from_xyzw(a[3], a[4], a[5], a[6]),
        velocity: Vec3::new(a[7], a[8], a[9]),
        angular_velocity: Vec3::new(a[10], a[11], a[12]),
    }
}

/// Raw and stored size and error of an encoded frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Encoded {
    /// Bytes of the arrays before packing.
    pub(super) raw_bytes: u64,
    /// Largest difference between a stored and an original value.
    pub(super) max_error: f32,
}

/// Appends the payload of `frame`, which holds `channels`, to `out`.
pub(super) fn encode(
    frame: &Frame,
    channels: Channels,
    report: Option<StepReport>,
    tolerance: f32,
    out: &mut Vec<u8>,
) -> Result<Encoded, String> {
    let counts = Counts::count(frame, channels);
    let specs = planes(*frame.spec(), channels, counts);
    let values = values(frame, channels);
    let mut encoded = Encoded {
        raw_bytes: values.iter().map(|v| 4 * v.len() as u64).sum(),
        max_error: 0.0,
    };
    let pack = |(spec, values): (&PlaneSpec, &Cow<'_, [f32]>)| {
        let mut data = Vec::new();
        let tolerance = if spec.tolerant { tolerance } else { 0.0 };
        plane::pack(values, spec.layout, tolerance, &mut data).map(|plane| (plane, data))
    };
    let packed: Vec<(StoredPlane, Vec<u8>)> = if encoded.raw_bytes >= 4 * plane::PARALLEL as u64 {
        let arrays = specs.par_iter().zip(&values);
        arrays.map(pack).collect::<Result<_, _>>()?
    } else {
        specs.iter().zip(&values).map(pack).collect::<Result<_, _>>()?
    };
    for (plane, _) in &packed {
        encoded.max_error = encoded.max_error.max(plane.max_error);
    }
    let (stored, data): (Vec<_>, Vec<_>) = packed.into_iter().unzip();
    let structure = StoredFrame {
        index: frame.index,
        report: report.map(Into::into),
        droplets: number(counts.droplets)?,
        bodies: number(counts.bodies)?,
        planes: stored,
    };
    if channels.contains(Channels::PARTICLES) {
        codec::put(&(structure, number(counts.particles)?), MAX_FRAME_STRUCTURE, out)?;
    } else {
        codec::put(&structure, MAX_FRAME_STRUCTURE, out)?;
    }
    data.iter().for_each(|data| out.extend_from_slice(data));
    Ok(encoded)
}

fn number(count: usize) -> Result<u32, String> {
    u32::try_from(count).map_err(|e| e.to_string())
}

/// Appends what was done live since the frame before to the payload of a frame; nothing if nothing was.
pub(super) fn encode_actions(acted: &[(f64, Action)], out: &mut Vec<u8>) -> Result<(), String> {
    if acted.is_empty() {
        return Ok(());
    }
    let stored: Vec<(f64, StoredAction)> = acted.iter().map(|(t, a)| (*t, a.into())).collect();
    codec::put(&stored, MAX_FRAME_STRUCTURE, out)
}

/// Reads what [`encode_actions`] wrote, checked.
fn decode_actions(bytes: &[u8]) -> Result<Vec<(f64, Action)>, String> {
    if bytes.is_empty() {
        return Ok(Vec::new());
    }
    let (stored, rest) = codec::take::<Vec<(f64, StoredAction)>, MAX_FRAME_STRUCTURE>(bytes)?;
    if !rest.is_empty() {
        return Err(format!("{} bytes stand behind its actions", rest.len()));
    }
    let mut acted: Vec<(f64, Action)> = Vec::with_capacity(stored.len());
    for (time, action) in stored {
        let action = Action::from(action);
        action.check().map_err(|e| e.to_string())?;
        if !time.is_finite() || acted.last().is_some_and(|(last, _)| time < *last) {
            return Err(format!("an action at {time} s is out of order"));
        }
        acted.push((time, action));
    }
    Ok(acted)
}

/// The structure of a frame, checked against the grid, the channels and the bytes there are.
pub(super) struct Structure<'a> {
    stored: StoredFrame,
    counts: Counts,
    specs: Vec<PlaneSpec>,
    data: &'a [u8],
    acted: Vec<(f64, Action)>,
}

impl<'a> Structure<'a> {
    /// Reads and checks the structure of a payload. Allocates no more than the structure's own size.
    pub(super) fn read(payload: &'a [u8], spec: GridSpec, channels: Channels) -> Result<Self, String> {
        let with_particles = channels.contains(Channels::PARTICLES);
        let ((stored, particles), data): ((StoredFrame, u32), _) = if with_particles {
            codec::take::<_, MAX_FRAME_STRUCTURE>(payload)?
        } else {
            let (stored, data) = codec::take::<_, MAX_FRAME_STRUCTURE>(payload)?;
            ((stored, 0), data)
        };
        let counts = Counts {
            droplets: stored.droplets as usize,
            bodies: stored.bodies as usize,
            particles: particles as usize,
        };
        for (name, count, most, channel) in [
            ("droplets", counts.droplets, MAX_DROPLETS, Channels::DROPLETS),
            ("bodies", counts.bodies, MAX_BODIES, Channels::BODIES),
            ("particles", counts.particles, MAX_DROPLETS, Channels::PARTICLES),
        ] {
            if count > most || (count > 0 && !channels.contains(channel)) {
                return Err(format!("it claims {count} {name}"));
            }
        }
        let specs = planes(spec, channels, counts);
        if stored.planes.len() != specs.len() {
            let (found, expected) = (stored.planes.len(), specs.len());
            return Err(format!("it has {found} arrays instead of {expected}"));
        }
        let mut bytes = 0;
        for (plane, spec) in stored.planes.iter().zip(&specs) {
            bytes += plane.check(spec.layout)?;
        }
        let Some((data, rest)) = usize::try_from(bytes).ok().and_then(|n| data.split_at_checked(n)) else {
            return Err(format!("its arrays take {bytes} bytes, {} are there", data.len()));
        };
        let acted = decode_actions(rest).map_err(|e| format!("behind its arrays of {bytes} bytes: {e}"))?;
        Ok(Self {
            stored,
            counts,
            specs,
            data,
            acted,
        })
    }

    /// What was done live since the frame before.
    pub(super) fn acted(self) -> Vec<(f64, Action)> {
        self.acted
    }

    /// Totals of the frame.
    pub(super) fn report(&self) -> Option<StepReport> {
        self.stored.report.map(Into::into)
    }

    /// Bytes that the decoded arrays take, with the work array for interleaved ones.
    pub(super) fn decoded_bytes(&self) -> u64 {
        // At most all of them are interleaved.
        2 * self.specs.iter().map(|s| 4 * s.layout.count as u64).sum::<u64>()
    }

    /// The arrays with what is stored of them.
    pub(super) fn planes(&self) -> impl Iterator<Item = (&PlaneSpec, &StoredPlane)> {
        self.specs.iter().zip(&self.stored.planes)
    }

    /// Decodes into `out`, reusing its allocations; its time is the caller's.
    pub(super) fn decode(
        &self,
        spec: GridSpec,
        channels: Channels,
        scratch: &mut Vec<f32>,
        out: &mut Frame,
    ) -> Result<(), String> {
        out.prepare(spec, channels);
        out.index = self.stored.index;
        for channel in [Channels::DROPLETS, Channels::PARTICLES] {
            let count = self.counts.of(channel);
            if let Some(d) = out.spheres_mut(channel) {
                d.position.resize(count, Vec3::ZERO);
                d.velocity.resize(count, Vec3::ZERO);
                d.radius.resize(count, 0.0);
            }
        }
        let mut bodies = vec![[0.0; BODY]; self.counts.bodies];
        let interleaved = self
            .specs
            .iter()
            .filter(|s| s.interleaved)
            .map(|s| s.layout.count);
        scratch.resize(interleaved.sum(), 0.0);

        plane::run(self.tasks(out, scratch)?)?;

        let mut parts = scratch.as_slice();
        for (_, channel) in channels.iter() {
            match channel {
                Channels::VELOCITY => interleave(&mut parts, grid_slice(&mut out.velocity), |v| v.as_mut()),
                Channels::DISPLACEMENT => {
                    interleave(&mut parts, grid_slice(&mut out.displacement), |v| v.as_mut())
                }
                Channels::DROPLETS | Channels::PARTICLES => {
                    if let Some(d) = out.spheres_mut(channel) {
                        interleave(&mut parts, &mut d.position, |v| v.as_mut());
                        interleave(&mut parts, &mut d.velocity, |v| v.as_mut());
                    }
                }
                Channels::BODIES => interleave(&mut parts, &mut bodies, |b| b),
                _ => {}
            }
        }
        if let Some(out) = &mut out.bodies {
            out.extend(bodies.into_iter().map(body_from_array));
        }
        out.check_finite().map_err(|e| e.to_string())
    }

    /// What is to be done to unpack all arrays.
    fn tasks<'o>(&self, out: &'o mut Frame, scratch: &'o mut [f32]) -> Result<Vec<Task<'a, 'o>>, String> {
        // Numbers that stand side by side in a frame are unpacked in place, others into the work array.
        let own = [
            Some(out.elevation.as_mut_slice()),
            out.depth.as_mut().map(Grid::as_mut_slice),
            out.foam.as_mut().map(Grid::as_mut_slice),
            out.droplets.as_mut().map(|d| d.radius.as_mut_slice()),
            out.particles.as_mut().map(|d| d.radius.as_mut_slice()),
        ];
        let mut own = own.into_iter().flatten();
        let mut free = scratch;
        let mut data = self.data;
        let mut tasks = Vec::with_capacity(self.specs.len());
        for (spec, stored) in self.planes() {
            let place = if spec.interleaved {
                let (part, rest) = std::mem::take(&mut free).split_at_mut(spec.layout.count);
                free = rest;
                part
            } else {
                own.next().unwrap_or_default()
            };
            stored
                .unpack(&mut data, spec.layout, place, &mut tasks)
                .map_err(|e| format!("channel `{}`: {e}", spec.channel))?;
        }
        Ok(tasks)
    }
}

fn grid_slice<T>(grid: &mut Option<Grid<T>>) -> &mut [T] {
    grid.as_mut().map_or(&mut [], Grid::as_mut_slice)
}

/// Fills the `N` components of each element from `N` arrays at the front of `parts`, moving it on.
fn interleave<T, const N: usize>(parts: &mut &[f32], out: &mut [T], component: fn(&mut T) -> &mut [f32; N]) {
    for n in 0..N {
        let (values, rest) = parts.split_at(out.len());
        *parts = rest;
        for (element, &value) in out.iter_mut().zip(values) {
            component(element)[n] = value;
        }
    }
}
