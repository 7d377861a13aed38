//! Log-log curves: one a method, labelled where they end.

use super::axis::Axis;
use super::canvas::{Anchor, Canvas, DrawError, Drawn, Point, Stroke, Type, draw, text_width};
use super::place::{Box2, Obstacles};
use super::theme::{FAINT, FRONT, GRID, INK, METHODS, PAPER, Tone};

/// A figure of curves.
#[derive(Clone, Debug)]
pub(crate) struct Chart {
    /// Heading.
    pub title: String,
    /// What it shows, for readers who cannot see it.
    pub description: String,
    /// Label of the horizontal axis, with unit.
    pub x_label: String,
    /// Label of the vertical axis, with unit.
    pub y_label: String,
    /// The curves.
    pub series: Vec<Series>,
    /// Orders of convergence for which slope triangles are drawn.
    pub slopes: Vec<u32>,
    /// Whether cost is on the horizontal axis, so that the Pareto front is drawn.
    pub front: bool,
    /// Whether the swept values themselves are marked on the horizontal axis.
    pub ticks_at_points: bool,
}

/// One curve.
#[derive(Clone, Debug)]
pub(crate) struct Series {
    /// Its label.
    pub label: String,
    /// Which method it belongs to: methods differ in colour, curves of one method in marker and dash.
    pub method: usize,
    /// Which curve of its method it is.
    pub variant: usize,
    /// Its points in the order of the sweep.
    pub points: Vec<Sample>,
}

/// One point of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    /// Horizontal value, positive.
    pub x: f64,
    /// Vertical value; 0 is drawn on a line of its own below the logarithmic axis.
    pub y: f64,
    /// Where the median of the repetitions lies, where `x` is the best.
    pub x_median: Option<f64>,
}

const WIDTH: i32 = 760;
const HEIGHT: i32 = 470;
/// What the line about the Pareto front takes of it.
const FOOTER: i32 = 30;
const LEFT: f64 = 76.0;
const RIGHT: f64 = 744.0;
const TOP: f64 = 46.0;
const BOTTOM: f64 = 388.0;

const LABEL: f64 = 12.5;
const TICK: f64 = 12.0;

/// A chart laid out in pixels.
struct Layout<'a> {
    chart: &'a Chart,
    x: Axis,
    y: Axis,
    /// Where zero is drawn, if any value is zero.
    zero: Option<f64>,
}

impl Chart {
    /// Draws the chart as SVG.
    pub(crate) fn to_svg(&self) -> Result<String, DrawError> {
        let layout = Layout::new(self);
        let height = if self.front { HEIGHT } else { HEIGHT - FOOTER };
        draw(WIDTH, height, &self.title, &self.description, |canvas| {
            layout.paint(canvas)
        })
    }

    fn samples(&self) -> impl Iterator<Item = &Sample> {
        self.series.iter().flat_map(|s| &s.points)
    }
}

impl<'a> Layout<'a> {
    fn new(chart: &'a Chart) -> Self {
        // Room on the right for labels behind the last points.
        let longest = chart
            .series
            .iter()
            .map(|s| text_width(&s.label, LABEL))
            .fold(0.0, f64::max);
        let right = RIGHT - (longest + 16.0).min(220.0);
        let xs = chart.samples().flat_map(|p| [Some(p.x), p.x_median]).flatten();
        let x = Axis::over(xs, LEFT, right, 0.08).stretched_to(RIGHT);
        let mut y = Axis::over(chart.samples().map(|p| p.y), BOTTOM, TOP, 0.12);
        let zero = chart
            .samples()
            .any(|p| p.y == 0.0)
            .then(|| y.make_room_for_zero());
        Self { chart, x, y, zero }
    }

    fn pixel(&self, sample: &Sample) -> Point {
        let y = match self.zero {
            Some(zero) if sample.y == 0.0 => zero,
            _ => sample.y,
        };
        (self.x.pixel(sample.x), self.y.pixel(y))
    }

    fn paint(&self, canvas: &Canvas<'_>) -> Drawn {
        canvas.rectangle((0.0, 0.0), (f64::from(WIDTH), f64::from(HEIGHT)), PAPER)?;
        self.paint_grid(canvas)?;
        let front = self.front();
        self.paint_front(canvas, &front)?;
        for series in &self.chart.series {
            self.paint_series(canvas, series, &front)?;
        }
        let mut obstacles = self.obstacles();
        self.paint_labels(canvas, &mut obstacles)?;
        self.paint_slopes(canvas, &mut obstacles)?;
        self.paint_frame(canvas)
    }

    fn paint_grid(&self, canvas: &Canvas<'_>) -> Drawn {
        let line = Stroke::solid(GRID, 1.0);
        let tick = text(INK, TICK);
        let swept: Vec<f64> = self.chart.samples().map(|p| p.x).collect();
        let ticks = if self.chart.ticks_at_points {
            self.x.ticks_at(&swept, 30.0)
        } else {
            self.x.ticks(56.0)
        };
        for (value, label) in ticks {
            let x = self.x.pixel(value);
            canvas.line(&[(x, TOP), (x, BOTTOM)], line)?;
            canvas.text(&label, (x, BOTTOM + 15.0), Anchor::Middle, tick)?;
        }
        for (value, label) in self.y.ticks(30.0) {
            let y = self.y.pixel(value);
            if self.zero.is_some_and(|zero| value < 4.0 * zero) {
                continue;
            }
            canvas.line(&[(LEFT, y), (RIGHT, y)], line)?;
            canvas.text(&label, (LEFT - 8.0, y), Anchor::End, tick)?;
        }
        if let Some(zero) = self.zero {
            let y = self.y.pixel(zero);
            let dashed = Stroke {
                dash: Some((2.0, 4.0)),
                ..Stroke::solid(FAINT, 1.0)
            };
            canvas.line(&[(LEFT, y), (RIGHT, y)], dashed)?;
            canvas.text("0", (LEFT - 8.0, y), Anchor::End, tick)?;
        }
        Ok(())
    }

    fn paint_frame(&self, canvas: &Canvas<'_>) -> Drawn {
        let axis = Stroke::solid(INK, 1.0);
        canvas.line(&[(LEFT, TOP), (LEFT, BOTTOM), (RIGHT, BOTTOM)], axis)?;
        let title = Type {
            bold: true,
            ..text(INK, 15.0)
        };
        canvas.text(&self.chart.title, (16.0, 22.0), Anchor::Start, title)?;
        let middle = 0.5 * (LEFT + RIGHT);
        canvas.text(
            &self.chart.x_label,
            (middle, BOTTOM + 38.0),
            Anchor::Middle,
            text(INK, 13.0),
        )?;
        canvas.text_upwards(&self.chart.y_label, (18.0, 0.5 * (TOP + BOTTOM)), text(INK, 13.0))?;
        if self.chart.front {
            let y = BOTTOM + 64.0;
            let faint = text(FAINT, 11.5);
            canvas.line(&[(LEFT, y), (LEFT + 30.0, y)], Stroke::solid(FRONT, 8.0))?;
            canvas.circle((LEFT + 15.0, y), 3.6, FAINT, Stroke::solid(FAINT, 1.6))?;
            let on = "on the Pareto front: nothing here is both cheaper and better";
            canvas.text(on, (LEFT + 38.0, y), Anchor::Start, faint)?;
            let x = LEFT + 50.0 + text_width(on, 11.5);
            canvas.circle((x, y), 3.6, PAPER, Stroke::solid(FAINT, 1.6))?;
            canvas.text("dominated", (x + 10.0, y), Anchor::Start, faint)?;
            let x = x + 84.0;
            canvas.line(&[(x, y), (x + 22.0, y)], Stroke::solid(FAINT, 1.2))?;
            canvas.text("best to median", (x + 28.0, y), Anchor::Start, faint)?;
        }
        Ok(())
    }

    /// The samples that no other beats in both cost and error, by cost.
    fn front(&self) -> Vec<Sample> {
        if !self.chart.front {
            return Vec::new();
        }
        pareto(self.chart.samples().copied().collect())
    }

    fn paint_front(&self, canvas: &Canvas<'_>, front: &[Sample]) -> Drawn {
        let mut stairs: Vec<Point> = Vec::new();
        for point in front.iter().map(|s| self.pixel(s)) {
            if let Some(&(_, y)) = stairs.last() {
                stairs.push((point.0, y));
            }
            stairs.push(point);
        }
        if stairs.len() > 1 {
            canvas.line(&stairs, Stroke::solid(FRONT, 8.0))?;
        }
        Ok(())
    }

    fn paint_series(&self, canvas: &Canvas<'_>, series: &Series, front: &[Sample]) -> Drawn {
        let tone = tone(series);
        let points: Vec<Point> = series.points.iter().map(|s| self.pixel(s)).collect();
        let dash = [None, Some((7.0, 4.0)), Some((2.5, 3.0)), Some((12.0, 4.0))][series.variant % 4];
        let line = Stroke {
            dash,
            ..Stroke::solid(tone, 1.6)
        };
        if points.len() > 1 {
            canvas.line(&points, line)?;
        }
        for sample in &series.points {
            let at = self.pixel(sample);
            if let Some(median) = sample.x_median {
                let x = self.x.pixel(median);
                if x - at.0 > 5.0 {
                    let thin = Stroke::solid(tone, 1.2);
                    canvas.line(&[at, (x, at.1)], thin)?;
                    canvas.line(&[(x, at.1 - 3.0), (x, at.1 + 3.0)], thin)?;
                }
            }
            let filled = !self.chart.front || front.contains(sample);
            marker(canvas, at, series.method + series.variant, tone, filled)?;
        }
        Ok(())
    }

    /// Everything that labels must keep clear of.
    fn obstacles(&self) -> Obstacles {
        let mut obstacles = Obstacles::new(Box2::new(
            (LEFT + 2.0, TOP - 2.0),
            (f64::from(WIDTH) - 4.0, BOTTOM - 4.0),
        ));
        for series in &self.chart.series {
            let points: Vec<Point> = series.points.iter().map(|s| self.pixel(s)).collect();
            obstacles.add_line(&points);
            for (sample, &at) in series.points.iter().zip(&points) {
                obstacles.add_box(Box2::around(at, 5.0, 5.0));
                if let Some(median) = sample.x_median {
                    obstacles.add_line(&[at, (self.x.pixel(median) + 2.0, at.1)]);
                }
            }
        }
        obstacles
    }

    fn paint_labels(&self, canvas: &Canvas<'_>, obstacles: &mut Obstacles) -> Drawn {
        // Labels stand behind the last point, and behind the line to its median.
        let reach = |s: &Sample| {
            let (x, y) = self.pixel(s);
            (s.x_median.map_or(x, |m| x.max(self.x.pixel(m))), y)
        };
        let end = |s: &Series| {
            let ends = s.points.iter().map(reach);
            ends.fold((f64::NEG_INFINITY, 0.0), |a, b| if b.0 > a.0 { b } else { a })
        };
        // From top to bottom, so that labels which are moved aside keep the order of their curves.
        let mut order: Vec<&Series> = self
            .chart
            .series
            .iter()
            .filter(|s| !s.points.is_empty())
            .collect();
        order.sort_by(|a, b| end(a).1.total_cmp(&end(b).1));
        for series in order {
            let kind = text(tone(series), LABEL);
            let size = (text_width(&series.label, LABEL), LABEL + 2.0);
            let ends = [end(series), self.pixel(&series.points[0])];
            let Some((at, anchor)) = obstacles.place_label(&ends, size) else {
                continue;
            };
            if (at.1 - anchor.1).abs() > 9.0 {
                let from = (at.0 - 2.0, at.1);
                canvas.line(&[anchor, from], Stroke::solid(tone(series), 0.7))?;
            }
            canvas.text(&series.label, at, Anchor::Start, kind)?;
        }
        Ok(())
    }

    fn paint_slopes(&self, canvas: &Canvas<'_>, obstacles: &mut Obstacles) -> Drawn {
        let Some(&steepest) = self.chart.slopes.iter().max() else {
            return Ok(());
        };
        // Both axes are logarithmic: an order p falls p decades a decade, whatever the scale of either.
        let ratio = (self.y.decade() / self.x.decade()).abs();
        let tallest = 0.42 * (BOTTOM - TOP);
        let base = (0.2 * (RIGHT - LEFT)).min(tallest / (ratio * f64::from(steepest)));
        let height = base * ratio * f64::from(steepest);
        let Some(corner) = obstacles.place_box((base + 26.0, height + 22.0)) else {
            return Ok(());
        };
        let (x, y) = (corner.0 + 6.0, corner.1 + 8.0);
        let line = Stroke::solid(FAINT, 1.2);
        canvas.line(&[(x, y), (x + base, y), (x + base, y + height)], line)?;
        for &order in &self.chart.slopes {
            let fall = base * ratio * f64::from(order);
            canvas.line(&[(x, y), (x + base, y + fall)], line)?;
            canvas.text(
                &order.to_string(),
                (x + base + 6.0, y + fall - 3.0),
                Anchor::Start,
                text(FAINT, 12.0),
            )?;
        }
        Ok(())
    }
}

fn text(tone: Tone, size: f64) -> Type {
    Type {
        tone,
        size,
        bold: false,
    }
}

fn tone(series: &Series) -> Tone {
    METHODS[series.method % METHODS.len()]
}

/// The samples that no other sample beats in both cost and error, by cost.
pub(crate) fn pareto(mut samples: Vec<Sample>) -> Vec<Sample> {
    samples.retain(|s| s.x.is_finite() && s.y.is_finite());
    samples.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let mut best = f64::INFINITY;
    samples.retain(|s| {
        let better = s.y < best;
        best = best.min(s.y);
        better
    });
    samples
}

/// A marker of one of six shapes.
fn marker(canvas: &Canvas<'_>, (x, y): Point, shape: usize, tone: Tone, filled: bool) -> Drawn {
    let fill = if filled { tone } else { PAPER };
    let line = Stroke::solid(tone, 1.6);
    let r = 4.0;
    let corners: Vec<Point> = match shape % 6 {
        0 => return canvas.circle((x, y), 3.6, fill, line),
        1 => vec![(-r, -r), (r, -r), (r, r), (-r, r)],
        2 => vec![(0.0, -1.25 * r), (1.2 * r, 0.9 * r), (-1.2 * r, 0.9 * r)],
        3 => vec![
            (0.0, -1.35 * r),
            (1.35 * r, 0.0),
            (0.0, 1.35 * r),
            (-1.35 * r, 0.0),
        ],
        4 => vec![(0.0, 1.25 * r), (1.2 * r, -0.9 * r), (-1.2 * r, -0.9 * r)],
        _ => vec![
            (-r, -0.6 * r),
            (0.0, -1.2 * r),
            (r, -0.6 * r),
            (r, 0.6 * r),
            (0.0, 1.2 * r),
            (-r, 0.6 * r),
        ],
    };
    let corners: Vec<Point> = corners.into_iter().map(|(dx, dy)| (x + dx, y + dy)).collect();
    canvas.polygon(&corners, fill, line)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(x: f64, y: f64) -> Sample {
        Sample { x, y, x_median: None }
    }

    #[test]
    fn the_front_is_what_nothing_beats() {
        let samples = vec![
            sample(1.0, 5.0),
            sample(2.0, 5.0),
            sample(3.0, 1.0),
            sample(2.5, 2.0),
            sample(4.0, 3.0),
        ];
        assert_eq!(
            pareto(samples),
            [sample(1.0, 5.0), sample(2.5, 2.0), sample(3.0, 1.0)]
        );
        assert_eq!(pareto(vec![sample(1.0, f64::NAN)]), []);
    }

    fn chart(points: Vec<Sample>) -> Chart {
        Chart {
            title: "T < 1 & more".to_owned(),
            description: "d".to_owned(),
            x_label: "CPU seconds".to_owned(),
            y_label: "error".to_owned(),
            series: vec![Series {
                label: "one".to_owned(),
                method: 0,
                variant: 0,
                points,
            }],
            slopes: vec![1, 2],
            front: true,
            ticks_at_points: false,
        }
    }

    #[test]
    fn figures_are_well_formed_and_hold_their_labels() {
        let many: Vec<Sample> = (1..6).map(|k| sample(f64::from(k), 0.1_f64.powi(k))).collect();
        for points in [
            many,
            vec![sample(1.0, 0.0)],
            vec![],
            vec![sample(1e-9, 1e-300), sample(1.0, 1e300)],
        ] {
            let svg = chart(points.clone()).to_svg().unwrap();
            assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
            assert!(svg.contains("T &lt; 1 &amp; more") && !svg.contains("NaN") && !svg.contains("inf"));
            assert_eq!(svg.contains(">\none\n</text>"), !points.is_empty(), "{svg}");
        }
    }
}
