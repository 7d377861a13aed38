//! What a recording holds and what it cost.

use super::frame_payload::Structure;
use super::{Reader, RecordingError};

/// One channel of a recording, summed over its frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChannelStatistics {
    /// The channel's name.
    pub name: &'static str,
    /// Bytes of its values before packing.
    pub raw_bytes: u64,
    /// Bytes of its values in the file.
    pub stored_bytes: u64,
    /// Largest difference between a stored and an original value, as measured when it was recorded.
    pub largest_error: f32,
}

/// Totals over the frames that carry a report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Totals {
    /// Mass of the first frame in kg.
    pub first_mass: f64,
    /// Mass of the last frame in kg.
    pub last_mass: f64,
    /// Largest difference of a frame's mass from the first one's, in kg.
    pub largest_mass_drift: f64,
    /// Energy of the first frame in J.
    pub first_energy: f64,
    /// Energy of the last frame in J.
    pub last_energy: f64,
    /// Clamps of last resort over all frames.
    pub clamps: u64,
}

/// What a recording holds, from [`Reader::statistics`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Frames, lost and damaged ones included.
    pub frames: usize,
    /// Frames that are lost or damaged.
    pub damaged: usize,
    /// Time of the first frame in seconds.
    pub first_time: f64,
    /// Time of the last frame in seconds.
    pub last_time: f64,
    /// Bytes in the file.
    pub file_bytes: u64,
    /// Bytes before the first frame: scene, terrain, geometry, sky.
    pub header_bytes: u64,
    /// The channels, `elevation` first.
    pub channels: Vec<ChannelStatistics>,
    /// Totals, where frames carry a report.
    pub totals: Option<Totals>,
}

impl Statistics {
    /// Bytes of all values before packing.
    pub fn raw_bytes(&self) -> u64 {
        self.channels.iter().map(|c| c.raw_bytes).sum()
    }

    /// Bytes of all values in the file.
    pub fn stored_bytes(&self) -> u64 {
        self.channels.iter().map(|c| c.stored_bytes).sum()
    }
}

impl Reader {
    /// Reads every frame's chunk, checks it, and sums up. Values are not decoded. Damaged frames are added to
    /// [`Self::damage`].
    ///
    /// # Errors
    /// [`RecordingError::Io`] if the file cannot be read.
    pub fn statistics(&mut self) -> Result<Statistics, RecordingError> {
        let mut sum = Statistics {
            frames: self.len(),
            first_time: if self.is_empty() { 0.0 } else { self.time(0) },
            last_time: self.len().checked_sub(1).map_or(0.0, |k| self.time(k)),
            file_bytes: self.file_bytes(),
            header_bytes: self.header_bytes(),
            ..Statistics::default()
        };
        for k in 0..self.len() {
            match self.load(k) {
                Ok(_) => {}
                Err(RecordingError::DamagedFrame { .. }) => {
                    sum.damaged += 1;
                    continue;
                }
                Err(error) => return Err(error),
            }
            let spec = self.scene().grid;
            match Structure::read(self.payload(), spec, self.channels()) {
                Ok(structure) => sum.add(&structure),
                Err(reason) => {
                    sum.damaged += 1;
                    self.damaged(k, reason);
                }
            }
        }
        Ok(sum)
    }
}

impl Statistics {
    fn add(&mut self, frame: &Structure<'_>) {
        for (spec, stored) in frame.planes() {
            let place = self.channels.iter().position(|c| c.name == spec.channel);
            let place = place.unwrap_or_else(|| {
                self.channels.push(ChannelStatistics {
                    name: spec.channel,
                    ..ChannelStatistics::default()
                });
                self.channels.len() - 1
            });
            let channel = &mut self.channels[place];
            channel.raw_bytes += 4 * spec.layout.count as u64;
            channel.stored_bytes += stored.bands.iter().map(|b| u64::from(b.length)).sum::<u64>();
            channel.largest_error = channel.largest_error.max(stored.max_error);
        }
        let Some(report) = frame.report() else { return };
        let totals = self.totals.get_or_insert(Totals {
            first_mass: report.mass,
            last_mass: report.mass,
            largest_mass_drift: 0.0,
            first_energy: report.energy,
            last_energy: report.energy,
            clamps: 0,
        });
        totals.last_mass = report.mass;
        totals.last_energy = report.energy;
        totals.largest_mass_drift = totals
            .largest_mass_drift
            .max((report.mass - totals.first_mass).abs());
        totals.clamps += report.clamps;
    }
}
