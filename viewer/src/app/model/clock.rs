//! Where playback stands: time runs with the wall clock whatever drawing costs, so a slow picture drops frames.

/// Speeds that can be stepped through, simulated seconds a second.
pub const SPEEDS: [f64; 9] = [
    1.0 / 16.0,
    1.0 / 8.0,
    1.0 / 4.0,
    1.0 / 2.0,
    1.0,
    2.0,
    4.0,
    8.0,
    16.0,
];

/// Longest time between two ticks that counts, seconds: after a longer one the window was away.
const LONGEST_TICK: f64 = 0.25;

/// See the module.
#[derive(Clone, Debug, PartialEq)]
pub struct Clock {
    /// Present time in seconds, within `range`.
    pub time: f64,
    /// First and last time there is.
    pub range: (f64, f64),
    /// Whether time passes.
    pub playing: bool,
    /// Whether it passes backwards.
    pub reverse: bool,
    /// Whether the end is followed by the beginning.
    pub looping: bool,
    speed: usize,
}

impl Clock {
    /// Stands at the beginning of `range`.
    pub fn new(range: (f64, f64)) -> Self {
        Self {
            time: range.0,
            range,
            playing: false,
            reverse: false,
            looping: false,
            speed: 4,
        }
    }

    /// Simulated seconds a second.
    pub fn speed(&self) -> f64 {
        SPEEDS[self.speed]
    }

    /// The nearest of [`SPEEDS`].
    pub fn set_speed(&mut self, speed: f64) {
        let off = |k: &usize| (SPEEDS[*k].ln() - speed.max(1e-3).ln()).abs();
        self.speed = (0..SPEEDS.len())
            .min_by(|a, b| off(a).total_cmp(&off(b)))
            .unwrap_or(4);
    }

    /// So many steps faster; negative: slower.
    pub fn faster(&mut self, steps: isize) {
        self.speed = self.speed.saturating_add_signed(steps).min(SPEEDS.len() - 1);
    }

    /// Lets `seconds` of the wall clock pass.
    pub fn tick(&mut self, seconds: f64) {
        if !self.playing {
            return;
        }
        let (first, last) = self.range;
        let sign = if self.reverse { -1.0 } else { 1.0 };
        self.time += sign * self.speed() * seconds.clamp(0.0, LONGEST_TICK);
        if (first..=last).contains(&self.time) {
            return;
        }
        if self.looping && last > first {
            self.time = first + (self.time - first).rem_euclid(last - first);
        } else {
            self.time = self.time.clamp(first, last);
            self.playing = false;
        }
    }

    /// Begins or stops; from the end it begins again.
    pub fn toggle(&mut self) {
        self.playing = !self.playing;
        if self.playing {
            let (first, last) = self.range;
            match self.reverse {
                false if self.time >= last => self.time = first,
                true if self.time <= first => self.time = last,
                _ => {}
            }
        }
    }

    /// Plays forwards or backwards; where it does so already, a step faster.
    pub fn shuttle(&mut self, reverse: bool) {
        if self.playing && self.reverse == reverse {
            self.faster(1);
            return;
        }
        self.reverse = reverse;
        if !self.playing {
            self.toggle();
        }
    }

    /// Goes to a time and stays as it is otherwise.
    pub fn seek(&mut self, time: f64) {
        self.time = time.clamp(self.range.0, self.range.1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_follows_the_wall_clock_and_stops_at_the_end() {
        let mut clock = Clock::new((1.0, 2.0));
        clock.tick(0.1);
        assert_eq!(clock.time, 1.0);
        clock.toggle();
        clock.set_speed(2.0);
        clock.tick(0.125);
        assert!((clock.time - 1.25).abs() < 1e-12);
        // The window was away for a minute: that is not a minute of water.
        clock.tick(60.0);
        assert!((clock.time - 1.75).abs() < 1e-12);
        clock.tick(0.2);
        assert_eq!((clock.time, clock.playing), (2.0, false));
        clock.toggle();
        assert_eq!((clock.time, clock.playing), (1.0, true));
    }

    #[test]
    fn loops_both_ways() {
        let mut clock = Clock::new((0.0, 1.0));
        clock.looping = true;
        clock.toggle();
        clock.time = 0.9;
        clock.tick(0.2);
        assert!((clock.time - 0.1).abs() < 1e-12 && clock.playing);
        clock.shuttle(true);
        clock.tick(0.2);
        assert!((clock.time - 0.9).abs() < 1e-12 && clock.playing);
        // A recording of one frame has nowhere to go.
        let mut still = Clock::new((3.0, 3.0));
        still.looping = true;
        still.toggle();
        still.tick(0.1);
        assert_eq!((still.time, still.playing), (3.0, false));
    }

    #[test]
    fn speeds_reach_from_a_sixteenth_to_sixteen() {
        let mut clock = Clock::new((0.0, 1.0));
        clock.faster(-100);
        assert_eq!(clock.speed(), 1.0 / 16.0);
        clock.faster(100);
        assert_eq!(clock.speed(), 16.0);
        clock.set_speed(0.3);
        assert_eq!(clock.speed(), 0.25);
        clock.set_speed(1.0);
        clock.shuttle(false);
        clock.shuttle(false);
        assert_eq!((clock.speed(), clock.playing), (2.0, true));
    }
}
