//! A map of outcomes: one row a situation, one column a step, each cell coloured and labelled.

use super::canvas::{Anchor, Canvas, DrawError, Drawn, Stroke, Type, draw, text_width};
use super::theme::{CELLS, FAINT, INK, ON_WRONG, PAPER, Tone};

/// A map drawn beside the curves of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Name of its file, without the study's.
    pub name: String,
    /// Heading.
    pub title: String,
    /// What stands along the columns, with unit.
    pub columns_label: String,
    /// Heads of the columns.
    pub columns: Vec<String>,
    /// The rows from top to bottom; each has a cell a column.
    pub rows: Vec<(String, Vec<Cell>)>,
}

/// One outcome.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cell {
    /// What happened.
    pub kind: CellKind,
    /// A few characters written into the cell.
    pub text: String,
}

/// What happened in a cell of a map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellKind {
    /// Right, in the steps asked for.
    Stable,
    /// Right, by taking smaller steps than asked for.
    SubStepped,
    /// Refused with an error that says why.
    Refused,
    /// Wrong, and returned as good.
    Wrong,
}

impl CellKind {
    const LEGEND: [(Self, &'static str); 4] = [
        (Self::Stable, "stable in one step"),
        (Self::SubStepped, "sub-stepped (how many)"),
        (Self::Refused, "refused with a reason"),
        (Self::Wrong, "wrong, returned as good"),
    ];

    fn tone(self) -> Tone {
        match self {
            Self::Stable => CELLS[0],
            Self::SubStepped => CELLS[1],
            Self::Refused => CELLS[2],
            Self::Wrong => CELLS[3],
        }
    }
}

const WIDTH: i32 = 760;
const MARGIN: f64 = 16.0;
const TOP: f64 = 66.0;
const ROW: f64 = 24.0;
const TEXT: f64 = 12.0;

impl Map {
    /// Draws the map as SVG.
    pub(crate) fn to_svg(&self) -> Result<String, DrawError> {
        let bottom = TOP + ROW * self.rows.len() as f64;
        let height = (bottom + 74.0).ceil() as i32;
        draw(WIDTH, height, &self.title, &self.description(), |canvas| {
            canvas.rectangle((0.0, 0.0), (f64::from(WIDTH), f64::from(height)), PAPER)?;
            self.paint(canvas, bottom)
        })
    }

    /// How many cells there are of each kind, for readers who cannot see the map.
    pub(crate) fn description(&self) -> String {
        let count = |kind| {
            self.rows
                .iter()
                .flat_map(|r| &r.1)
                .filter(|c| c.kind == kind)
                .count()
        };
        let list: Vec<String> = CellKind::LEGEND
            .iter()
            .map(|&(kind, label)| format!("{}: {}", label.trim_end_matches(" (how many)"), count(kind)))
            .collect();
        list.join("; ")
    }

    fn paint(&self, canvas: &Canvas<'_>, bottom: f64) -> Drawn {
        let plain = |tone| Type {
            tone,
            size: TEXT,
            bold: false,
        };
        let title = Type {
            tone: INK,
            size: 15.0,
            bold: true,
        };
        canvas.text(&self.title, (MARGIN, 22.0), Anchor::Start, title)?;
        let widest = self
            .rows
            .iter()
            .map(|r| text_width(&r.0, TEXT))
            .fold(0.0, f64::max);
        let left = MARGIN + widest.min(330.0) + 12.0;
        let width = (f64::from(WIDTH) - MARGIN - left) / self.columns.len().max(1) as f64;
        for (k, head) in self.columns.iter().enumerate() {
            let x = left + (k as f64 + 0.5) * width;
            canvas.text(head, (x, TOP - 14.0), Anchor::Middle, plain(INK))?;
        }
        for (j, (label, cells)) in self.rows.iter().enumerate() {
            let y = TOP + (j as f64 + 0.5) * ROW;
            canvas.text(label, (left - 10.0, y), Anchor::End, plain(INK))?;
            for (k, cell) in cells.iter().enumerate() {
                let x = left + k as f64 * width;
                canvas.rectangle((x, y - 0.5 * ROW), (x + width, y + 0.5 * ROW), cell.kind.tone())?;
                let kind = match cell.kind {
                    CellKind::Wrong => Type {
                        bold: true,
                        ..plain(ON_WRONG)
                    },
                    _ => plain(INK),
                };
                canvas.text(&cell.text, (x + 0.5 * width, y), Anchor::Middle, kind)?;
            }
        }
        let right = left + width * self.columns.len() as f64;
        for j in 0..=self.rows.len() {
            let y = TOP + j as f64 * ROW;
            canvas.line(&[(left, y), (right, y)], Stroke::solid(PAPER, 1.5))?;
        }
        for k in 0..=self.columns.len() {
            let x = left + k as f64 * width;
            canvas.line(&[(x, TOP), (x, bottom)], Stroke::solid(PAPER, 1.5))?;
        }
        canvas.text(
            &self.columns_label,
            (0.5 * (left + right), bottom + 16.0),
            Anchor::Middle,
            plain(INK),
        )?;
        let mut x = MARGIN;
        let y = bottom + 50.0;
        for (kind, label) in CellKind::LEGEND {
            canvas.rectangle((x, y - 7.0), (x + 14.0, y + 7.0), kind.tone())?;
            canvas.text(label, (x + 20.0, y), Anchor::Start, plain(FAINT))?;
            x += 36.0 + text_width(label, TEXT);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_is_drawn_and_counted() {
        let cell = |kind, text: &str| Cell {
            kind,
            text: text.to_owned(),
        };
        let map = Map {
            name: "m".to_owned(),
            title: "Steps".to_owned(),
            columns_label: "step".to_owned(),
            columns: vec!["0.01".to_owned(), "100".to_owned()],
            rows: vec![
                (
                    "calm".to_owned(),
                    vec![cell(CellKind::Stable, "1"), cell(CellKind::SubStepped, "142")],
                ),
                (
                    "wild".to_owned(),
                    vec![cell(CellKind::Refused, "no"), cell(CellKind::Wrong, "NEG")],
                ),
            ],
        };
        let svg = map.to_svg().unwrap();
        for text in ["calm", "wild", "142", "NEG", "0.01", "step"] {
            assert!(svg.contains(&format!(">\n{text}\n</text>")), "{text} is missing");
        }
        assert!(
            map.description()
                .starts_with("stable in one step: 1; sub-stepped: 1; refused")
        );
    }
}
