//! The events of a scene as a sequence of actions in time, the same whatever the frame rate.

use super::Action;
use super::stamp::PRESS_VOLUME;
use crate::grid::GridSpec;
use crate::rng::Rng;
use crate::scene::description::{Event, SeriesPoint};
use glam::Vec2;

/// Seconds between the moments at which continuous events (rain, sweeps, inflows) act.
///
/// Moments are whole multiples of it, whatever the frame rate, so that the same drops fall at the same times at 24
/// and at 60 frames a second. A power of two, so that every multiple is exact.
pub const TICK: f64 = 1.0 / 64.0;

/// Most presses a sweep is split into within one tick.
const MAX_SWEEP_PARTS: f64 = 64.0;

/// Poisson draws are split into parts of at most this mean, so that exp(−mean) keeps its precision.
const POISSON_PART: f64 = 16.0;

/// The actions of a scene's events, handed out in order of time.
///
/// Single events act at their own times. Rain is a Poisson process sampled tick by tick: the drops of a tick depend
/// on the scene's seed, the event's number and the tick's number alone. A sweep presses at every tick along the way
/// that it travels in the tick around it.
#[derive(Clone, Debug)]
pub struct Schedule {
    moments: Vec<(f64, Action)>,
    taken: usize,
    continuous: Vec<(usize, Event)>,
    seed: u64,
    spec: GridSpec,
    /// Everything before this time has been handed out.
    until: f64,
}

impl Schedule {
    /// The schedule of `events` over the grid `spec`, from time 0.
    pub fn new(events: &[Event], seed: u64, spec: GridSpec) -> Self {
        let mut moments = Vec::new();
        let mut continuous = Vec::new();
        for (number, event) in events.iter().enumerate() {
            match single(event) {
                Some(moment) => moments.push(moment),
                None => continuous.push((number, event.clone())),
            }
        }
        // Stable: events of the same time act in the order of the scene.
        moments.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self {
            moments,
            taken: 0,
            continuous,
            seed,
            spec,
            until: 0.0,
        }
    }

    /// Appends to `out` every action with a time before `end` that has not been taken yet, in order of time. Actions
    /// before time 0 never come.
    pub fn take_until(&mut self, end: f64, out: &mut Vec<(f64, Action)>) {
        let first = out.len();
        while let Some((time, action)) = self.moments.get(self.taken).filter(|(t, _)| *t < end) {
            if *time >= 0.0 {
                out.push((*time, action.clone()));
            }
            self.taken += 1;
        }
        if !self.continuous.is_empty() {
            let mut tick = (self.until / TICK).ceil() as u64;
            while (tick as f64) * TICK < end {
                for (number, event) in &self.continuous {
                    self.act(*number as u64, event, tick, out);
                }
                tick += 1;
            }
        }
        self.until = self.until.max(end);
        out[first..].sort_by(|a, b| a.0.total_cmp(&b.0));
    }

    /// What the continuous `event` does at `tick`.
    fn act(&self, number: u64, event: &Event, tick: u64, out: &mut Vec<(f64, Action)>) {
        let now = tick as f64 * TICK;
        match *event {
            Event::Rain {
                start,
                end,
                rate,
                radius,
                volume,
                adds_water,
            } => {
                let covered = (now + TICK).min(end.unwrap_or(f64::INFINITY)) - now.max(start);
                if covered <= 0.0 {
                    return;
                }
                let mut rng = Rng::new(self.seed, 0x5241_494e ^ (number << 40) ^ tick);
                for _ in 0..poisson(f64::from(rate) * covered, &mut rng) {
                    let position = self.place(&mut rng);
                    let action = if adds_water {
                        Action::Drop {
                            position,
                            radius,
                            volume,
                        }
                    } else {
                        let depth = f64::from(volume) / (PRESS_VOLUME * f64::from(radius).powi(2));
                        Action::Press {
                            position,
                            radius,
                            depth: depth as f32,
                        }
                    };
                    out.push((now, action));
                }
            }
            Event::Sweep {
                start,
                end,
                from,
                to,
                radius,
                rate,
            } => {
                let (first, last) = ((now - 0.5 * TICK).max(start), (now + 0.5 * TICK).min(end));
                if last <= first {
                    return;
                }
                let length = f64::from((to - from).length());
                let travelled = length * (last - first) / (end - start);
                // Closer than half a radius, the presses merge into an even track.
                let parts = (2.0 * travelled / f64::from(radius))
                    .ceil()
                    .clamp(1.0, MAX_SWEEP_PARTS);
                let depth = f64::from(rate) * (last - first) / parts;
                for part in 0..parts as u32 {
                    let time = first + (last - first) * (f64::from(part) + 0.5) / parts;
                    let share = ((time - start) / (end - start)) as f32;
                    out.push((
                        now,
                        Action::Press {
                            position: from.lerp(to, share),
                            radius,
                            depth: depth as f32,
                        },
                    ));
                }
            }
            Event::Inflow {
                start,
                end,
                position,
                radius,
                flow,
                ref points,
                ..
            } => {
                let (first, last) = (now.max(start), (now + TICK).min(end.unwrap_or(f64::INFINITY)));
                if last > first {
                    let volume = match flow {
                        Some(flow) => f64::from(flow) * (last - first),
                        None => integral(points, first, last),
                    };
                    // A series that is 0 for a while has nothing to say meanwhile.
                    if volume == 0.0 && flow.is_none() {
                        return;
                    }
                    let volume = volume as f32;
                    out.push((
                        now,
                        Action::Drop {
                            position,
                            radius,
                            volume,
                        },
                    ));
                }
            }
            Event::Drag {
                start,
                end,
                ref body,
                grip,
                from,
                to,
            } => {
                if now < start || now - TICK >= end {
                    return;
                }
                let body = body.clone();
                let action = if now < end {
                    let share = ((now - start) / (end - start)) as f32;
                    let target = from.lerp(to, share);
                    Action::Drag { body, grip, target }
                } else {
                    Action::Release { body }
                };
                out.push((now, action));
            }
            // Single events are in `moments`.
            Event::Drop { .. }
            | Event::Press { .. }
            | Event::Push { .. }
            | Event::Shove { .. }
            | Event::Tilt { .. } => {}
        }
    }

    /// A random place, every cell of the grid equally likely.
    fn place(&self, rng: &mut Rng) -> Vec2 {
        let size = self.spec.size.as_dvec2();
        let g = glam::DVec2::new(rng.uniform() * size.x, rng.uniform() * size.y) - 0.5;
        (self.spec.origin.as_dvec2() + f64::from(self.spec.spacing) * g).as_vec2()
    }
}

/// Integral from `first` to `last` of a series that is linear between its points and constant outside of them.
fn integral(points: &[SeriesPoint], first: f64, last: f64) -> f64 {
    let at = |t: f64| {
        let next = points.partition_point(|p| p.time <= t);
        match (next.checked_sub(1).and_then(|k| points.get(k)), points.get(next)) {
            (Some(a), Some(b)) => a.value + (b.value - a.value) * ((t - a.time) / (b.time - a.time)),
            (Some(p), None) | (None, Some(p)) => p.value,
            (None, None) => 0.0,
        }
    };
    let mut moments = vec![first];
    moments.extend(points.iter().map(|p| p.time).filter(|t| *t > first && *t < last));
    moments.push(last);
    let part = |pair: &[f64]| 0.5 * (at(pair[0]) + at(pair[1])) * (pair[1] - pair[0]);
    moments.windows(2).map(part).sum()
}

/// Time and action of an event that acts once.
fn single(event: &Event) -> Option<(f64, Action)> {
    match *event {
        Event::Drop {
            time,
            position,
            radius,
            volume,
        } => Some((
            time,
            Action::Drop {
                position,
                radius,
                volume,
            },
        )),
        Event::Press {
            time,
            position,
            radius,
            depth,
        } => Some((
            time,
            Action::Press {
                position,
                radius,
                depth,
            },
        )),
        Event::Push {
            time,
            position,
            radius,
            velocity,
        } => Some((
            time,
            Action::Push {
                position,
                radius,
                velocity,
            },
        )),
        Event::Shove {
            time,
            ref body,
            velocity,
            spin,
        } => Some((
            time,
            Action::Shove {
                body: body.clone(),
                velocity,
                spin,
            },
        )),
        Event::Tilt { time, gravity } => Some((time, Action::Tilt { gravity })),
        Event::Sweep { .. } | Event::Rain { .. } | Event::Inflow { .. } | Event::Drag { .. } => None,
    }
}

/// A Poisson number of the given mean (Knuth's product of uniforms, in parts).
fn poisson(mean: f64, rng: &mut Rng) -> u64 {
    let mut count = 0;
    let mut left = mean;
    while left > 0.0 {
        let part = left.min(POISSON_PART);
        left -= part;
        let floor = (-part).exp();
        let mut product = rng.uniform();
        while product > floor {
            count += 1;
            product *= rng.uniform();
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::UVec2;

    fn spec() -> GridSpec {
        GridSpec::new(Vec2::new(-3.0, 5.0), 0.25, UVec2::new(64, 48)).unwrap()
    }

    fn rain(rate: f32) -> Event {
        Event::Rain {
            start: 0.5,
            end: Some(20.5),
            rate,
            radius: 0.1,
            volume: 1e-4,
            adds_water: true,
        }
    }

    fn all(events: &[Event], seed: u64, frame: f64) -> Vec<(f64, Action)> {
        let mut schedule = Schedule::new(events, seed, spec());
        let mut out = Vec::new();
        let mut k = 0.0;
        while k * frame < 30.0 {
            schedule.take_until(k * frame, &mut out);
            k += 1.0;
        }
        schedule.take_until(30.0, &mut out);
        out
    }

    #[test]
    fn actions_do_not_depend_on_the_frame_rate() {
        let events = [
            rain(40.0),
            Event::Sweep {
                start: 1.01,
                end: 3.77,
                from: Vec2::ZERO,
                to: Vec2::new(9.0, 9.0),
                radius: 0.5,
                rate: 1.0,
            },
            Event::Drop {
                time: 2.503,
                position: Vec2::ZERO,
                radius: 1.0,
                volume: 1.0,
            },
        ];
        let reference = all(&events, 3, 1.0 / 60.0);
        assert!(reference.is_sorted_by(|a, b| a.0 <= b.0));
        for frame in [1.0 / 24.0, 0.31, 30.0] {
            assert_eq!(reference, all(&events, 3, frame));
        }
        assert_ne!(reference, all(&events, 4, 1.0 / 60.0));
    }

    #[test]
    fn rain_is_poisson_and_covers_the_grid_evenly() {
        let drops = all(&[rain(400.0)], 11, 0.1);
        let n = drops.len() as f64;
        // 8000 expected, standard deviation √8000; four of them.
        assert!((n - 8000.0).abs() < 4.0 * 8000_f64.sqrt(), "{n}");
        let mut quarter = [0.0; 4];
        for (time, action) in &drops {
            assert!((0.5..20.5).contains(time));
            let Action::Drop { position, .. } = action else {
                panic!("{action:?}");
            };
            let g = spec().to_grid(*position);
            assert!(g.cmpge(Vec2::splat(-0.5)).all() && g.cmple(spec().size.as_vec2() - 0.5).all());
            let (right, far) = (g.x > 31.5, g.y > 23.5);
            quarter[usize::from(right) + 2 * usize::from(far)] += 1.0;
        }
        for q in quarter {
            assert!((q - n / 4.0).abs() < 4.0 * (n * 3.0 / 16.0).sqrt(), "{quarter:?}");
        }
        // Counts a tick have the mean and the variance of a Poisson process.
        let mut ticks = vec![0.0_f64; 1280];
        for (time, _) in &drops {
            ticks[((time - 0.5) / TICK).round() as usize] += 1.0;
        }
        let mean = n / 1280.0;
        let variance = ticks.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / 1279.0;
        // Standard error of the ratio for large counts: √(2/1279), four of them.
        assert!(
            (variance / mean - 1.0).abs() < 4.0 * (2.0 / 1279.0_f64).sqrt(),
            "{variance} {mean}"
        );
    }

    #[test]
    fn a_sweep_presses_as_much_as_its_rate_says() {
        let sweep = Event::Sweep {
            start: 1.013,
            end: 3.777,
            from: Vec2::new(-1.0, 6.0),
            to: Vec2::new(400.0, 9.0),
            radius: 0.5,
            rate: 0.7,
        };
        let presses = all(&[sweep], 0, 0.04);
        let mut sum = 0.0;
        let mut last = -1.0_f32;
        for (time, action) in &presses {
            let Action::Press { position, depth, .. } = action else {
                panic!("{action:?}");
            };
            assert!((1.0..3.79).contains(time));
            assert!(position.x > last || last == -1.0);
            last = position.x;
            sum += f64::from(*depth);
        }
        assert!((sum - 0.7 * (3.777 - 1.013)).abs() < 1e-5);
        assert!((last - 400.0).abs() < 0.5);
    }

    #[test]
    fn an_inflow_brings_its_flow_in_its_time() {
        let inflow = Event::Inflow {
            start: 1.013,
            end: Some(3.777),
            position: Vec2::new(2.0, 9.0),
            radius: 0.5,
            flow: Some(3.0),
            series: None,
            points: Vec::new(),
        };
        let drops = all(&[inflow], 0, 0.04);
        let sum: f64 = drops
            .iter()
            .map(|(time, action)| {
                assert!((1.0..3.777).contains(time));
                let Action::Drop { volume, .. } = action else {
                    panic!("{action:?}");
                };
                f64::from(*volume)
            })
            .sum();
        assert!((sum - 3.0 * (3.777 - 1.013)).abs() < 1e-5);
    }

    #[test]
    fn an_inflow_by_a_series_brings_its_integral() {
        let point = |time, value| SeriesPoint { time, value };
        let flood = Event::Inflow {
            start: 0.0,
            end: None,
            position: Vec2::new(2.0, 9.0),
            radius: 0.5,
            flow: None,
            series: None,
            // Kinks between ticks; a triangle of 3 m³ and a drain of 0.5 m³.
            points: vec![
                point(1.01, 0.0),
                point(2.013, 3.0),
                point(3.01, 0.0),
                point(4.0, 0.0),
                point(4.5, -1.0),
                point(5.0, 0.0),
            ],
        };
        for frame in [0.04, 0.31] {
            let drops = all(std::slice::from_ref(&flood), 0, frame);
            assert!(drops.iter().all(|(t, _)| (1.0..5.0).contains(t)));
            let sum = drops.iter().fold(0.0, |sum, (_, action)| match action {
                Action::Drop { volume, .. } => sum + f64::from(*volume),
                other => panic!("{other:?}"),
            });
            assert!((sum - 2.5).abs() < 1e-5, "{sum}");
        }
    }

    #[test]
    fn poisson_means_hold_for_small_and_large() {
        let mut rng = Rng::new(5, 9);
        for mean in [0.02, 3.0, 100.0] {
            let n = 20_000;
            let sum: u64 = (0..n).map(|_| poisson(mean, &mut rng)).sum();
            let error = sum as f64 / f64::from(n) - mean;
            assert!(
                error.abs() < 4.0 * (mean / f64::from(n)).sqrt(),
                "{mean}: {error}"
            );
        }
        assert_eq!(poisson(0.0, &mut rng), 0);
    }
}
