//! What happens at each edge of the domain.

use super::settings::SetupError;
use crate::scene::description::{self, Drive, Driven, Edge, EdgeName};
use crate::solvers::GRAVITY;

/// A value that changes in time: linear between points and constant before the first and after the last, or a wave.
#[derive(Clone, Debug, PartialEq)]
pub struct Series(Signal);

#[derive(Clone, Debug, PartialEq)]
enum Signal {
    Points {
        times: Vec<f64>,
        values: Vec<f64>,
    },
    /// From time 0 on.
    Sine {
        mean: f64,
        amplitude: f64,
        period: f64,
    },
    /// The crest of a solitary wave; `rate` in 1/s.
    Solitary {
        mean: f64,
        height: f64,
        rate: f64,
        time: f64,
    },
}

impl Series {
    /// A value that never changes.
    pub fn constant(value: f64) -> Self {
        Self(Signal::Points {
            times: vec![0.0],
            values: vec![value],
        })
    }

    /// Regular waves of `height` m from trough to crest about `mean`, which begin at time 0.
    pub fn sine(mean: f64, height: f64, period: f64) -> Self {
        Self(Signal::Sine {
            mean,
            amplitude: 0.5 * height,
            period,
        })
    }

    /// The surface of a solitary wave of `height` m over still water of `depth` m, whose crest passes at `time` s:
    /// η = H sech²(√(3H/4d³) c (t − t₀)), c = √(g (d + H)) (Boussinesq 1871; Goring 1978).
    pub fn solitary(mean: f64, height: f64, depth: f64, time: f64) -> Self {
        Self(Signal::Solitary {
            mean,
            height,
            rate: (0.75 * height / depth.powi(3)).sqrt() * (GRAVITY * (depth + height)).sqrt(),
            time,
        })
    }

    /// Values at increasing times in seconds.
    ///
    /// # Errors
    /// [`SetupError::Series`] if there is no point, a number is not finite or the times do not increase.
    pub fn new(points: &[[f64; 2]]) -> Result<Self, SetupError> {
        let error = |at, message| Err(SetupError::Series { at, message });
        if points.is_empty() {
            return error(0, "there is no point; give at least one");
        }
        for (at, [time, value]) in points.iter().enumerate() {
            if !(time.is_finite() && value.is_finite()) {
                return error(at, "time and value must be finite");
            }
            if at > 0 && *time <= points[at - 1][0] {
                return error(at, "times must increase");
            }
        }
        Ok(Self(Signal::Points {
            times: points.iter().map(|p| p[0]).collect(),
            values: points.iter().map(|p| p[1]).collect(),
        }))
    }

    /// The value at `time` s.
    pub fn at(&self, time: f64) -> f64 {
        let (times, values) = match &self.0 {
            Signal::Points { times, values } => (times, values),
            Signal::Sine {
                mean,
                amplitude,
                period,
            } => return mean + amplitude * (std::f64::consts::TAU * time.max(0.0) / period).sin(),
            Signal::Solitary {
                mean,
                height,
                rate,
                time: crest,
            } => return mean + height / (rate * (time - crest)).cosh().powi(2),
        };
        let next = times.partition_point(|&t| t <= time);
        if next == 0 {
            return values[0];
        }
        if next == times.len() {
            return values[next - 1];
        }
        let (t0, t1) = (times[next - 1], times[next]);
        let f = (time - t0) / (t1 - t0);
        values[next - 1] * (1.0 - f) + values[next] * f
    }

    /// Largest magnitude.
    pub(super) fn largest(&self) -> f64 {
        match &self.0 {
            Signal::Points { values, .. } => values.iter().fold(0.0, |a, v| a.max(v.abs())),
            Signal::Sine { mean, amplitude, .. } => mean.abs() + amplitude.abs(),
            Signal::Solitary { mean, height, .. } => mean.abs() + height.abs(),
        }
    }
}

/// Behaviour of one edge.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Condition {
    /// Waves are reflected half a spacing beyond the outermost samples.
    #[default]
    Wall,
    /// Waves leave; beyond the edge the water stays as it was at the start. Where it was dry, everything that arrives
    /// leaves.
    Open,
    /// What leaves enters at the opposite edge, which must be periodic too.
    Periodic,
    /// The surface stands at a given elevation above datum (m); the velocity follows from the waves that arrive.
    Elevation(Series),
    /// Water enters at a given discharge per width (m²/s, positive inwards); the depth follows from the waves that
    /// arrive, critical over dry ground.
    Discharge(Series),
}

/// The four edges.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Edges {
    /// Edge at the smallest X.
    pub x_min: Condition,
    /// Edge at the largest X.
    pub x_max: Condition,
    /// Edge at the smallest Z.
    pub z_min: Condition,
    /// Edge at the largest Z.
    pub z_max: Condition,
}

/// Largest elevation (m) or discharge (m²/s) that an edge may prescribe.
const LIMIT: f64 = 1e6;

impl Edges {
    /// The same condition at all four edges.
    pub fn all(condition: &Condition) -> Self {
        Self {
            x_min: condition.clone(),
            x_max: condition.clone(),
            z_min: condition.clone(),
            z_max: condition.clone(),
        }
    }

    /// Checks that periodic edges come in pairs and that prescribed values can be computed with.
    ///
    /// # Errors
    /// [`SetupError::HalfPeriodic`] or [`SetupError::Parameter`].
    pub(crate) fn check(&self) -> Result<(), SetupError> {
        for (low, high, names) in [
            (&self.x_min, &self.x_max, ["x_min", "x_max"]),
            (&self.z_min, &self.z_max, ["z_min", "z_max"]),
        ] {
            if (*low == Condition::Periodic) != (*high == Condition::Periodic) {
                return Err(SetupError::HalfPeriodic {
                    low: names[0],
                    high: names[1],
                });
            }
            for (condition, name) in [low, high].into_iter().zip(names) {
                if let Condition::Elevation(series) | Condition::Discharge(series) = condition
                    && series.largest() > LIMIT
                {
                    return Err(SetupError::Parameter {
                        name,
                        value: series.largest(),
                        range: "within ±1e6 m or m²/s",
                    });
                }
            }
        }
        Ok(())
    }
}

impl From<Edge> for Condition {
    fn from(edge: Edge) -> Self {
        match edge {
            Edge::Wall => Self::Wall,
            Edge::Open => Self::Open,
            Edge::Periodic => Self::Periodic,
        }
    }
}

impl From<&description::Boundary> for Edges {
    fn from(boundary: &description::Boundary) -> Self {
        Self {
            x_min: boundary.x_min.into(),
            x_max: boundary.x_max.into(),
            z_min: boundary.z_min.into(),
            z_max: boundary.z_max.into(),
        }
    }
}

impl Edges {
    /// The edges of a scene whose water stands at `level` m.
    ///
    /// # Errors
    /// [`SetupError::Series`] if a time series cannot be used.
    pub(crate) fn of_scene(boundary: &description::Boundary, level: f64) -> Result<Self, SetupError> {
        let mut edges = Self::from(boundary);
        for drive in &boundary.drives {
            let series = |points: &[description::SeriesPoint]| {
                Series::new(&points.iter().map(|p| [p.time, p.value]).collect::<Vec<_>>())
            };
            let condition = match drive {
                Drive::Series { quantity, points, .. } => match quantity {
                    Driven::Elevation => Condition::Elevation(series(points)?),
                    Driven::Discharge => Condition::Discharge(series(points)?),
                },
                Drive::Sine { height, period, .. } => {
                    Condition::Elevation(Series::sine(level, f64::from(*height), f64::from(*period)))
                }
                Drive::Solitary {
                    height, depth, time, ..
                } => Condition::Elevation(Series::solitary(
                    level,
                    f64::from(*height),
                    f64::from(*depth),
                    *time,
                )),
            };
            *match drive.edge() {
                EdgeName::XMin => &mut edges.x_min,
                EdgeName::XMax => &mut edges.x_max,
                EdgeName::ZMin => &mut edges.z_min,
                EdgeName::ZMax => &mut edges.z_max,
            } = condition;
        }
        Ok(edges)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_are_linear_and_constant_beyond_their_ends() {
        let series = Series::new(&[[0.0, 1.0], [2.0, 5.0], [3.0, 4.0]]).unwrap();
        for (time, value) in [
            (-1.0, 1.0),
            (0.0, 1.0),
            (1.0, 3.0),
            (2.0, 5.0),
            (2.5, 4.5),
            (9.0, 4.0),
        ] {
            assert_eq!(series.at(time), value);
        }
        assert!(Series::new(&[]).is_err());
        assert!(Series::new(&[[0.0, 1.0], [0.0, 2.0]]).is_err());
        assert!(Series::new(&[[0.0, f64::NAN]]).is_err());
    }

    #[test]
    fn one_periodic_edge_is_refused() {
        let mut edges = Edges::all(&Condition::Periodic);
        edges.check().unwrap();
        edges.z_max = Condition::Open;
        assert_eq!(
            edges.check(),
            Err(SetupError::HalfPeriodic {
                low: "z_min",
                high: "z_max"
            })
        );
    }
}
