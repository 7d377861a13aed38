//! Arguments that several commands take, and how their text is read.

use clap::Args;
use glam::UVec2;
use meniscus_sim::render::Image;
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// Arguments of every command.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Global options")]
pub struct GlobalArgs {
    /// Threads to compute with; results do not depend on it [default: one a processor]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Show no progress and no notes on standard error; warnings and errors remain
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Show details on standard error; twice shows debugging messages too
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    pub verbose: u8,
}

/// Changes to the keys of a scene.
#[derive(Clone, Debug, Default, Args)]
pub struct Overrides {
    /// Override a scene key, as in `--set solver.spacing=0.5`; may be given several times
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<String>,
}

/// A scene file with changes to its keys.
#[derive(Clone, Debug, Args)]
pub struct SceneArgs {
    /// Scene file
    #[arg(value_name = "SCENE.toml")]
    pub scene: PathBuf,
    /// Changes to its keys
    #[command(flatten)]
    pub overrides: Overrides,
}

/// Width and height of an image, `WIDTHxHEIGHT`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageSize(pub UVec2);

impl FromStr for ImageSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |text: &str| {
            text.parse::<u32>()
                .ok()
                .filter(|n| (1..=Image::MAX_SIDE).contains(n))
        };
        text.split_once(['x', 'X', '×'])
            .and_then(|(width, height)| Some(Self(UVec2::new(side(width)?, side(height)?))))
            .ok_or_else(|| {
                format!(
                    "write width and height in pixels as in 1280x720, each from 1 to {}",
                    Image::MAX_SIDE
                )
            })
    }
}

impl fmt::Display for ImageSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.0.x, self.0.y)
    }
}

/// Frames by number: `12`, `10..20` (20 left out), `10..=20`, `10..`, `..20` or `..`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRange {
    first: u64,
    /// One past the last; open where absent.
    end: Option<u64>,
}

impl FrameRange {
    /// Every frame there is.
    pub const ALL: Self = Self { first: 0, end: None };

    /// The frames of `length` that the range names: first, and one past the last.
    ///
    /// # Errors
    /// A message if it names a frame that is not there, or none.
    pub fn within(self, length: u64) -> Result<std::ops::Range<u64>, String> {
        let end = self.end.unwrap_or(length);
        if self.first >= length || end > length {
            let there = match length {
                0 => "there are none".to_owned(),
                1 => "only frame 0 is there".to_owned(),
                _ => format!("frames 0 to {} are there", length - 1),
            };
            return Err(format!("frames {self} are out of range; {there}"));
        }
        Ok(self.first..end)
    }

    /// The frames that the range names in a run that has no end of its own; an open range ends before `default_end`.
    ///
    /// # Errors
    /// A message if an open range begins at or after `default_end`.
    pub fn unbounded(self, default_end: u64) -> Result<std::ops::Range<u64>, String> {
        self.within(default_end.max(self.end.unwrap_or(0)))
    }
}

impl FromStr for FrameRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let usage = || "write frames as in 12, 10..20 (20 left out), 10..=20, 10.. or ..20".to_owned();
        let number = |text: &str| text.parse::<u64>().map_err(|_| usage());
        let bound = |text: &str| match text {
            "" => Ok(None),
            _ => number(text).map(Some),
        };
        let (first, end) = match text.split_once("..") {
            None => {
                let only = number(text)?;
                (only, Some(only.checked_add(1).ok_or_else(usage)?))
            }
            Some((first, last)) => {
                let end = match last.strip_prefix('=') {
                    Some(last) => Some(number(last)?.checked_add(1).ok_or_else(usage)?),
                    None => bound(last)?,
                };
                (bound(first)?.unwrap_or(0), end)
            }
        };
        if end.is_some_and(|end| end <= first) {
            return Err(format!(
                "no frame lies in {text}; the first must be below the end"
            ));
        }
        Ok(Self { first, end })
    }
}

impl fmt::Display for FrameRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}..", self.first)?;
        match self.end {
            Some(end) => write!(f, "{end}"),
            None => Ok(()),
        }
    }
}

/// A number that is neither NaN nor infinite.
pub(crate) fn finite(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "write a number, as in 2.5".to_owned())?;
    if value.is_finite() {
        Ok(value)
    } else {
        Err("the number must be finite".to_owned())
    }
}

/// A time in seconds, 0 or later.
pub(crate) fn time(text: &str) -> Result<f64, String> {
    match finite(text) {
        Ok(value) if value >= 0.0 => Ok(value),
        _ => Err("write a time in seconds from 0 on, as in 2.5".to_owned()),
    }
}

/// A factor above 0 and at most a million.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    match finite(text) {
        Ok(value) if value > 0.0 && value <= 1e6 => Ok(value),
        _ => Err("write a factor above 0, as in 20".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_positive() {
        assert_eq!(positive("0.25"), Ok(0.25));
        for bad in ["0", "-2", "nan", "inf", "fast"] {
            assert!(positive(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn image_sizes_are_read_and_refused() {
        assert_eq!("640x360".parse(), Ok(ImageSize(UVec2::new(640, 360))));
        for bad in [
            "640",
            "0x10",
            "10x0",
            "-1x5",
            "640x",
            "x",
            "16385x1",
            "99999999999x1",
            "4x4x4",
            "",
        ] {
            assert!(bad.parse::<ImageSize>().is_err(), "{bad}");
        }
    }

    #[test]
    fn frame_ranges_follow_the_notation_of_rust() {
        let within = |text: &str, length| text.parse::<FrameRange>().unwrap().within(length);
        assert_eq!(within("2..5", 5), Ok(2..5));
        assert_eq!(within("2..=4", 5), Ok(2..5));
        assert_eq!(within("3", 5), Ok(3..4));
        assert_eq!(within("3..", 5), Ok(3..5));
        assert_eq!(within("..2", 5), Ok(0..2));
        assert_eq!(within("..", 5), Ok(0..5));
        assert!(within("5", 5).unwrap_err().contains("frames 0 to 4 are there"));
        assert!(within("0..6", 5).is_err());
        assert!(within("..", 0).unwrap_err().contains("there are none"));
        for bad in [
            "",
            "a",
            "1..1",
            "5..2",
            "..=",
            "..0",
            "1.5",
            "-1",
            "18446744073709551615",
            "1..=x",
        ] {
            assert!(bad.parse::<FrameRange>().is_err(), "{bad}");
        }
    }

    #[test]
    fn a_live_run_goes_on_past_its_usual_end() {
        let frames = |text: &str| text.parse::<FrameRange>().unwrap().unbounded(31);
        assert_eq!(frames("40..50"), Ok(40..50));
        assert_eq!(frames("10.."), Ok(10..31));
        assert!(frames("40..").is_err());
    }

    #[test]
    fn times_are_finite_and_not_negative() {
        assert_eq!(time("2.5"), Ok(2.5));
        for bad in ["-1", "nan", "inf", "1s", ""] {
            assert!(time(bad).is_err(), "{bad}");
        }
    }
}
