//! A recording that is decoded by a thread of its own, ahead of where playback stands.

use super::{Moment, Wake};
use meniscus_sim::recording::{Reader, RecordingError};
use meniscus_sim::{Channels, Frame, Scene};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Instant;

/// Bytes of decoded frames that are kept.
const KEPT_BYTES: u64 = 256 << 20;

/// Most frames that are kept.
const MOST_KEPT: usize = 64;

/// A frame, or why it cannot be had.
pub type Decoded = Result<Arc<Moment>, String>;

#[derive(Debug, Default)]
struct State {
    /// The frame that is to be shown.
    wanted: usize,
    /// Whether those before it come next.
    backwards: bool,
    /// Whether the first follows the last.
    looping: bool,
    kept: BTreeMap<usize, Decoded>,
    closed: bool,
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// See the module.
#[derive(Debug)]
pub struct Replay {
    path: PathBuf,
    times: Vec<f64>,
    channels: Channels,
    scene: Arc<Scene>,
    capacity: usize,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Replay {
    /// Begins to decode.
    ///
    /// # Errors
    /// A message if the recording holds no frame, or no thread can be started.
    pub fn new(reader: Reader, wake: Wake) -> Result<Self, String> {
        if reader.is_empty() {
            return Err(format!(
                "{}: the recording holds no whole frame; record it again",
                reader.path().display()
            ));
        }
        let scene = Arc::new(reader.scene().clone());
        let times: Vec<f64> = (0..reader.len()).map(|k| reader.time(k)).collect();
        let samples = scene.grid.len() as u64;
        let bytes = samples * 4 * (1 + 2 * u64::from(reader.channels().bits().count_ones()));
        let capacity = ((KEPT_BYTES / bytes.max(1)) as usize).clamp(4, MOST_KEPT);
        let shared = Arc::new(Shared::default());
        let (path, channels) = (reader.path().to_owned(), reader.channels());
        let theirs = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("meniscus-decode".to_owned())
            .spawn(move || decode(reader, &theirs, capacity, &wake))
            .map_err(|error| format!("cannot start a thread that decodes: {error}"))?;
        Ok(Self {
            path,
            times,
            channels,
            scene,
            capacity,
            shared,
            thread: Some(thread),
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The optional channels that every frame has.
    pub fn channels(&self) -> Channels {
        self.channels
    }

    /// Time of every frame in seconds.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// First and last time.
    pub fn range(&self) -> (f64, f64) {
        let first = self.times.first().copied().unwrap_or(0.0);
        (first, self.times.last().copied().unwrap_or(first))
    }

    /// The frame nearest to `time`.
    pub fn nearest(&self, time: f64) -> usize {
        let after = self
            .times
            .partition_point(|t| *t < time)
            .min(self.times.len().saturating_sub(1));
        let before = after.saturating_sub(1);
        if time - self.times[before] < self.times[after] - time {
            before
        } else {
            after
        }
    }

    /// Asks for frame `k` and those that follow it; gives it if it is there.
    pub fn want(&self, k: usize, backwards: bool, looping: bool) -> Option<Decoded> {
        let mut state = self.shared.state();
        if (state.wanted, state.backwards, state.looping) != (k, backwards, looping) {
            (state.wanted, state.backwards, state.looping) = (k, backwards, looping);
            self.shared.changed.notify_all();
        }
        state.kept.get(&k).cloned()
    }

    /// Frames that are kept now, and most that ever are.
    pub fn kept(&self) -> (usize, usize) {
        (self.shared.state().kept.len(), self.capacity)
    }
}

impl Drop for Replay {
    fn drop(&mut self) {
        self.shared.state().closed = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// How far frame `k` is ahead of the wanted one, in the direction of play.
fn ahead(state: &State, k: usize, len: usize) -> Option<usize> {
    let off = if state.backwards {
        state.wanted.checked_sub(k)
    } else {
        k.checked_sub(state.wanted)
    };
    match off {
        Some(off) => Some(off),
        None if !state.looping => None,
        None if state.backwards => Some(state.wanted + len - k),
        None => Some(k + len - state.wanted),
    }
}

/// The frame to decode next: the wanted one, else the first that is missing ahead. A third of what is kept lies behind.
fn next(state: &State, len: usize, capacity: usize) -> Option<usize> {
    let reach = (capacity - capacity / 3).min(len);
    let at = |step: usize| match (state.backwards, state.looping) {
        (false, false) => Some(state.wanted + step).filter(|k| *k < len),
        (true, false) => state.wanted.checked_sub(step),
        (false, true) => Some((state.wanted + step) % len),
        (true, true) => Some((state.wanted + len - step % len) % len),
    };
    (0..reach).map_while(at).find(|k| !state.kept.contains_key(k))
}

fn decode(mut reader: Reader, shared: &Shared, capacity: usize, wake: &Wake) {
    let len = reader.len();
    let spec = reader.scene().grid;
    let mut spare: Option<Arc<Moment>> = None;
    loop {
        let k = {
            let mut state = shared.state();
            loop {
                if state.closed {
                    return;
                }
                if let Some(k) = next(&state, len, capacity) {
                    break k;
                }
                state = shared.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
            }
        };
        let start = Instant::now();
        // A frame that nobody holds any more is decoded into again.
        let mut moment = spare
            .take()
            .and_then(|moment| Arc::try_unwrap(moment).ok())
            .unwrap_or_else(|| Moment {
                frame: Frame::new(spec),
                report: None,
                seconds: 0.0,
            });
        let decoded = reader.read(k, &mut moment.frame);
        moment.frame.index = k as u64;
        moment.seconds = start.elapsed().as_secs_f64();
        let decoded = match decoded {
            Ok(report) => {
                moment.report = report;
                Ok(Arc::new(moment))
            }
            Err(error @ RecordingError::DamagedFrame { .. }) => Err(format!(
                "{error}; the frame is left out, the others can be played"
            )),
            Err(error) => Err(error.to_string()),
        };
        let mut state = shared.state();
        state.kept.insert(k, decoded);
        while state.kept.len() > capacity {
            let far = |k: &usize| ahead(&state, *k, len).map_or(usize::MAX, |off| off);
            let Some(worst) = state.kept.keys().copied().max_by_key(|k| far(k)) else {
                break;
            };
            if let Some(Ok(moment)) = state.kept.remove(&worst) {
                spare = Some(moment);
            }
        }
        let wanted = state.wanted == k;
        drop(state);
        if wanted {
            wake();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(wanted: usize, backwards: bool, looping: bool, kept: &[usize]) -> State {
        State {
            wanted,
            backwards,
            looping,
            kept: kept.iter().map(|k| (*k, Err(String::new()))).collect(),
            closed: false,
        }
    }

    #[test]
    fn the_wanted_frame_comes_first_and_then_what_follows_it() {
        assert_eq!(next(&state(5, false, false, &[]), 10, 6), Some(5));
        assert_eq!(next(&state(5, false, false, &[5, 6]), 10, 6), Some(7));
        assert_eq!(next(&state(5, true, false, &[5, 4]), 10, 6), Some(3));
        assert_eq!(next(&state(9, false, false, &[9]), 10, 6), None);
        assert_eq!(next(&state(9, false, true, &[9]), 10, 6), Some(0));
        assert_eq!(next(&state(0, true, true, &[0]), 10, 6), Some(9));
        // No further than two thirds of what is kept, so that what was just shown stays.
        assert_eq!(next(&state(0, false, false, &[0, 1, 2, 3]), 10, 6), None);
    }

    #[test]
    fn a_loop_of_fewer_frames_than_are_kept_ends_its_search() {
        assert_eq!(next(&state(1, true, true, &[0, 1, 2]), 3, 64), None);
        assert_eq!(ahead(&state(1, false, true, &[]), 0, 3), Some(2));
        assert_eq!(ahead(&state(1, false, false, &[]), 0, 3), None);
    }
}
