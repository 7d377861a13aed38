//! Colours that work on light and dark paper, and the finished SVG text.
//!
//! Figures are drawn in the colours of the light theme; a style sheet in the SVG exchanges them where the reader prefers
//! dark. The series colours are those of Okabe & Ito (2008) darkened to a contrast of at least 4.5 on white, with
//! lighter partners of the same hue for dark paper; markers and dashes tell the series apart without any colour.

use plotters::style::RGBColor;
use std::fmt::Write as _;

/// A colour of the light theme and its partner in the dark one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Tone {
    light: (u8, u8, u8),
    dark: (u8, u8, u8),
}

impl Tone {
    const fn new(light: (u8, u8, u8), dark: (u8, u8, u8)) -> Self {
        Self { light, dark }
    }

    /// The colour to draw with.
    pub(crate) fn color(self) -> RGBColor {
        let (r, g, b) = self.light;
        RGBColor(r, g, b)
    }
}

/// The paper.
pub(crate) const PAPER: Tone = Tone::new((255, 255, 255), (19, 23, 29));
/// Text and axes.
pub(crate) const INK: Tone = Tone::new((31, 41, 51), (226, 232, 240));
/// Text of lesser weight.
pub(crate) const FAINT: Tone = Tone::new((91, 103, 115), (154, 166, 178));
/// Grid lines.
pub(crate) const GRID: Tone = Tone::new((228, 232, 237), (44, 51, 61));
/// The band along the Pareto front.
pub(crate) const FRONT: Tone = Tone::new((255, 232, 163), (92, 77, 28));

/// One colour a method.
pub(crate) const METHODS: [Tone; 6] = [
    Tone::new((0, 107, 168), (86, 172, 230)),
    Tone::new((192, 80, 0), (243, 139, 76)),
    Tone::new((0, 122, 89), (52, 199, 155)),
    Tone::new((158, 74, 126), (228, 155, 200)),
    Tone::new((140, 97, 0), (236, 182, 60)),
    Tone::new((84, 84, 96), (176, 180, 192)),
];

/// Cells of maps: stable, sub-stepped, refused, wrong.
pub(crate) const CELLS: [Tone; 4] = [
    Tone::new((198, 228, 243), (24, 72, 99)),
    Tone::new((250, 222, 164), (102, 74, 14)),
    Tone::new((221, 224, 229), (60, 66, 76)),
    Tone::new((196, 27, 86), (224, 62, 118)),
];

/// Text on a wrong cell.
pub(crate) const ON_WRONG: Tone = Tone::new((254, 255, 255), (255, 255, 254));

/// Figures are drawn this many times larger than shown, since the drawing library knows whole pixels only.
pub(crate) const SCALE: i32 = 8;

/// The style sheet that exchanges light for dark, for figures inside `scope` (an empty scope means everywhere).
pub(crate) fn dark_rules(scope: &str) -> String {
    let mut css = String::from("@media(prefers-color-scheme:dark){");
    let all = [PAPER, INK, FAINT, GRID, FRONT, ON_WRONG];
    for tone in all.into_iter().chain(METHODS).chain(CELLS) {
        let hex = |(r, g, b): (u8, u8, u8)| format!("#{r:02X}{g:02X}{b:02X}");
        let (light, dark) = (hex(tone.light), hex(tone.dark));
        // Writing to a string cannot fail.
        let _ = write!(
            css,
            "{scope} [fill=\"{light}\"]{{fill:{dark}}}{scope} [stroke=\"{light}\"]{{stroke:{dark}}}"
        );
    }
    css.push('}');
    css
}

/// Turns what the drawing library wrote into a figure of `width` × `height` that says what it shows to readers who
/// cannot see it, and follows the theme.
pub(crate) fn finish(drawn: &str, width: i32, height: i32, title: &str, description: &str) -> String {
    let body = drawn.split_once('>').map_or(drawn, |(_, rest)| rest);
    format!(
        "<svg class=\"figure\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {} {}\" role=\"img\" \
         xmlns=\"http://www.w3.org/2000/svg\">\n<title>{}</title>\n<desc>{}</desc>\n<style>{}</style>{}",
        width * SCALE,
        height * SCALE,
        escape(title),
        escape(description),
        dark_rules(""),
        body
    )
}

/// The figure without its own style sheet, for a page that has the rules once for all its figures.
pub(crate) fn without_style(svg: &str) -> String {
    match (svg.find("<style>"), svg.find("</style>")) {
        (Some(from), Some(to)) if from < to => format!("{}{}", &svg[..from], &svg[to + "</style>".len()..]),
        _ => svg.to_owned(),
    }
}

/// Text as it may stand in XML and HTML.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Contrast ratio of WCAG 2.1.
    fn contrast(a: (u8, u8, u8), b: (u8, u8, u8)) -> f64 {
        let luminance = |(r, g, b): (u8, u8, u8)| {
            let linear = |v: u8| {
                let v = f64::from(v) / 255.0;
                if v <= 0.040_45 {
                    v / 12.92
                } else {
                    ((v + 0.055) / 1.055).powf(2.4)
                }
            };
            0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b)
        };
        let (x, y) = (luminance(a) + 0.05, luminance(b) + 0.05);
        x.max(y) / x.min(y)
    }

    #[test]
    fn every_label_is_legible_on_both_papers() {
        for tone in METHODS.into_iter().chain([INK, FAINT]) {
            assert!(contrast(tone.light, PAPER.light) >= 4.5, "{tone:?}");
            assert!(contrast(tone.dark, PAPER.dark) >= 4.5, "{tone:?}");
        }
        for cell in &CELLS[..3] {
            assert!(contrast(INK.light, cell.light) >= 4.5 && contrast(INK.dark, cell.dark) >= 4.5);
        }
        assert!(contrast(ON_WRONG.light, CELLS[3].light) >= 4.5);
    }

    #[test]
    fn no_two_tones_share_a_light_colour() {
        let mut all: Vec<_> = [PAPER, INK, FAINT, GRID, FRONT, ON_WRONG]
            .into_iter()
            .chain(METHODS)
            .chain(CELLS)
            .collect();
        all.sort_by_key(|t| t.light);
        assert!(all.windows(2).all(|w| w[0].light != w[1].light));
    }
}
