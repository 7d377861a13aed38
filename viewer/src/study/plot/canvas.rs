//! Drawing in shown pixels on top of plotters, which draws in whole pixels of a figure [`SCALE`] times larger.

use super::theme::{SCALE, Tone, finish};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

type Error = DrawingAreaErrorKind<std::io::Error>;

/// Why a figure could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("figure `{title}` could not be drawn: {reason}")]
pub(crate) struct DrawError {
    title: String,
    reason: String,
}

/// A point of the figure in shown pixels, from the top left.
pub(crate) type Point = (f64, f64);

/// How a line looks.
#[derive(Clone, Copy)]
pub(crate) struct Stroke {
    /// Colour.
    pub tone: Tone,
    /// Width in shown pixels.
    pub width: f64,
    /// Lengths of dash and gap in shown pixels; absent: solid.
    pub dash: Option<(f64, f64)>,
}

impl Stroke {
    pub(crate) fn solid(tone: Tone, width: f64) -> Self {
        Self {
            tone,
            width,
            dash: None,
        }
    }
}

/// Where the given point of a text lies in it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// How a text looks.
#[derive(Clone, Copy)]
pub(crate) struct Type {
    pub tone: Tone,
    pub size: f64,
    pub bold: bool,
}

/// A figure being drawn.
pub(crate) struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
}

/// Draws a figure of `width` × `height` shown pixels.
pub(crate) fn draw(
    width: i32,
    height: i32,
    title: &str,
    description: &str,
    paint: impl FnOnce(&Canvas<'_>) -> Result<(), Error>,
) -> Result<String, DrawError> {
    let mut text = String::new();
    let size = ((width * SCALE).unsigned_abs(), (height * SCALE).unsigned_abs());
    let result = {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        let canvas = Canvas { area };
        paint(&canvas).and_then(|()| canvas.area.present())
    };
    result.map_err(|error| DrawError {
        title: title.to_owned(),
        reason: error.to_string(),
    })?;
    Ok(finish(&text, width, height, title, description))
}

/// What a drawing step gives.
pub(crate) type Drawn = Result<(), Error>;

fn whole((x, y): Point) -> (i32, i32) {
    let scale = f64::from(SCALE);
    ((x * scale).round() as i32, (y * scale).round() as i32)
}

fn length(pixels: f64) -> u32 {
    (pixels * f64::from(SCALE)).round().max(1.0) as u32
}

impl Canvas<'_> {
    /// A filled rectangle between two corners.
    pub(crate) fn rectangle(&self, a: Point, b: Point, tone: Tone) -> Drawn {
        self.area
            .draw(&Rectangle::new([whole(a), whole(b)], tone.color().filled()))
    }

    /// A line through points.
    pub(crate) fn line(&self, points: &[Point], stroke: Stroke) -> Drawn {
        let style = stroke.tone.color().stroke_width(length(stroke.width));
        let parts = match stroke.dash {
            None => vec![points.to_vec()],
            Some((dash, gap)) => dashes(points, dash, gap),
        };
        for part in parts {
            let part: Vec<(i32, i32)> = part.into_iter().map(whole).collect();
            self.area.draw(&PathElement::new(part, style))?;
        }
        Ok(())
    }

    /// A closed polygon, filled with one tone and outlined with another.
    pub(crate) fn polygon(&self, points: &[Point], fill: Tone, outline: Stroke) -> Drawn {
        let corners: Vec<(i32, i32)> = points.iter().copied().map(whole).collect();
        self.area.draw(&Polygon::new(corners, fill.color().filled()))?;
        let closed: Vec<Point> = points.iter().chain(points.first()).copied().collect();
        self.line(&closed, outline)
    }

    /// A circle, filled with one tone and outlined with another.
    pub(crate) fn circle(&self, centre: Point, radius: f64, fill: Tone, outline: Stroke) -> Drawn {
        let radius = length(radius);
        self.area
            .draw(&Circle::new(whole(centre), radius, fill.color().filled()))?;
        let style = outline.tone.color().stroke_width(length(outline.width));
        self.area.draw(&Circle::new(whole(centre), radius, style))
    }

    /// A text whose anchor stands at `at`, centred vertically on it.
    pub(crate) fn text(&self, text: &str, at: Point, anchor: Anchor, kind: Type) -> Drawn {
        self.area.draw(&Text::new(
            text.to_owned(),
            whole(at),
            style(anchor, kind, FontTransform::None),
        ))
    }

    /// A text that reads upwards, centred on `at`.
    pub(crate) fn text_upwards(&self, text: &str, at: Point, kind: Type) -> Drawn {
        let style = style(Anchor::Middle, kind, FontTransform::Rotate270);
        self.area.draw(&Text::new(text.to_owned(), whole(at), style))
    }
}

fn style(anchor: Anchor, kind: Type, transform: FontTransform) -> TextStyle<'static> {
    let horizontal = match anchor {
        Anchor::Start => HPos::Left,
        Anchor::Middle => HPos::Center,
        Anchor::End => HPos::Right,
    };
    // The SVG back end divides sizes by 1.24.
    let size = kind.size * f64::from(SCALE) * 1.24;
    let weight = if kind.bold {
        FontStyle::Bold
    } else {
        FontStyle::Normal
    };
    TextStyle {
        font: ("sans-serif", size, weight).into_font().transform(transform),
        color: kind.tone.color().to_backend_color(),
        pos: Pos::new(horizontal, VPos::Center),
    }
}

/// Width of a text in shown pixels, on the safe side for common sans-serif fonts.
pub(crate) fn text_width(text: &str, size: f64) -> f64 {
    let ems: f64 = text
        .chars()
        .map(|c| match c {
            'i' | 'j' | 'l' | 'I' | '.' | ',' | ':' | ';' | '\'' | '|' => 0.33,
            'f' | 't' | 'r' | ' ' | '(' | ')' | '-' | '/' => 0.42,
            'm' | 'w' | 'M' | 'W' | '×' => 0.92,
            c if c.is_uppercase() => 0.72,
            _ => 0.61,
        })
        .sum();
    ems * size
}

/// Cuts a line into dashes, continuing the pattern over corners.
fn dashes(points: &[Point], dash: f64, gap: f64) -> Vec<Vec<Point>> {
    let period = dash + gap;
    let mut parts: Vec<Vec<Point>> = Vec::new();
    let mut travelled = 0.0;
    for pair in points.windows(2) {
        let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
        let span = (x1 - x0).hypot(y1 - y0);
        if span == 0.0 {
            continue;
        }
        let at = |s: f64| (x0 + (x1 - x0) * s / span, y0 + (y1 - y0) * s / span);
        let mut s = 0.0;
        while s < span {
            let phase = (travelled + s) % period;
            let drawn = phase < dash;
            let rest = if drawn { dash - phase } else { period - phase };
            // A step of at least a hundredth of a pixel, so that rounding of the phase cannot stop the walk.
            let end = (s + rest.max(0.01)).min(span);
            if drawn {
                match parts.last_mut() {
                    Some(part) if s == 0.0 && part.last() == Some(&(x0, y0)) => part.push(at(end)),
                    _ => parts.push(vec![at(s), at(end)]),
                }
            }
            s = end;
        }
        travelled += span;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashes_cover_their_share_of_the_line() {
        let line = [(0.0, 0.0), (70.0, 0.0), (70.0, 30.0)];
        let drawn: f64 = dashes(&line, 6.0, 4.0)
            .iter()
            .flat_map(|p| {
                p.windows(2)
                    .map(|w| (w[1].0 - w[0].0).hypot(w[1].1 - w[0].1))
                    .collect::<Vec<_>>()
            })
            .sum();
        assert!((drawn - 60.0).abs() < 0.1, "{drawn}");
    }
}
