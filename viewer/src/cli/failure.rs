//! How a command ends when it does not succeed, and the exit code that says so.

use meniscus_sim::scene::SceneError;
use meniscus_sim::solvers::BuildError;
use std::fmt;
use std::path::Path;

/// Why a command did not succeed.
#[derive(Debug)]
pub enum Failure {
    /// What was asked for is wrong: an argument, or a file that was named as input. Exit code 2.
    Input(anyhow::Error),
    /// A scene file and what is wrong with it, one line a problem. Exit code 2.
    Scene(SceneError),
    /// No solver can be built for a scene. Exit code 2.
    Solver(BuildError),
    /// Expectations that do not hold, one line each. Exit code 1.
    Unmet(Vec<String>),
    /// The input was right, but the work failed: a step was refused, a disk is full, an output cannot be written.
    /// Exit code 1.
    Run(anyhow::Error),
    /// Ctrl-C; what was finished by then is kept, as the message says. Exit code 130.
    Interrupted(String),
    /// Whoever read standard output closed it: it has what it wanted, so this ends quietly. Exit code 0.
    ClosedPipe,
}

impl Failure {
    /// Wrong input, said in one line: what, where and what would be right.
    pub fn input(message: impl fmt::Display) -> Self {
        Self::Input(anyhow::anyhow!("{message}"))
    }

    /// Failed work, said in one line: what, where and what would be right.
    pub fn run(message: impl fmt::Display) -> Self {
        Self::Run(anyhow::anyhow!("{message}"))
    }

    /// A scene for which no solver can be built has a problem in its file, or in an override; every other failure stays
    /// as it is.
    #[must_use]
    pub(crate) fn in_scene(self, file: &Path, overrides: &[String]) -> Self {
        let (key, message, remedy) = match self {
            Self::Solver(BuildError::Impossible { key, message, remedy }) => (key, message, remedy),
            // These say what would be right in their messages.
            Self::Solver(BuildError::Step(error)) => {
                ("solver.step".to_owned(), error.to_string(), String::new())
            }
            Self::Solver(error) => ("solver.kind".to_owned(), error.to_string(), String::new()),
            other => return other,
        };
        Self::Scene(SceneError::of_key(file, overrides, &key, &message, &remedy))
    }

    /// The exit code that goes with this ending.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::ClosedPipe => 0,
            Self::Run(_) | Self::Unmet(_) => 1,
            Self::Input(_) | Self::Scene(_) | Self::Solver(_) => 2,
            Self::Interrupted(_) => 130,
        }
    }

    /// What standard error shows, one line each, without the word `error`.
    pub fn lines(&self) -> Vec<String> {
        match self {
            Self::Input(error) | Self::Run(error) => vec![one_line(error)],
            Self::Scene(error) => error.problems.iter().map(ToString::to_string).collect(),
            Self::Solver(error) => vec![error.to_string()],
            Self::Unmet(expectations) => expectations.clone(),
            Self::Interrupted(kept) => vec![format!("interrupted; {kept}")],
            Self::ClosedPipe => Vec::new(),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.lines().join("\n"))
    }
}

impl std::error::Error for Failure {}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

/// An error of a part that reports through `anyhow`: a [`Failure`] inside keeps its exit code, all else is a failed run.
impl From<anyhow::Error> for Failure {
    fn from(error: anyhow::Error) -> Self {
        error.downcast::<Self>().unwrap_or_else(Self::Run)
    }
}

/// Says for an error what it means to the command: wrong input or a failed run.
pub(crate) trait Classify<T> {
    /// The error means that what was asked for is wrong.
    fn or_input(self) -> Result<T, Failure>;
    /// The error means that the work failed.
    fn or_run(self) -> Result<T, Failure>;
}

impl<T, E: Into<anyhow::Error>> Classify<T> for Result<T, E> {
    fn or_input(self) -> Result<T, Failure> {
        self.map_err(|error| Failure::Input(error.into()))
    }

    fn or_run(self) -> Result<T, Failure> {
        self.map_err(|error| Failure::Run(error.into()))
    }
}

/// An error and its causes in one line. A cause that its effect already quotes is not repeated.
fn one_line(error: &anyhow::Error) -> String {
    let mut line = String::new();
    for cause in error.chain() {
        let text = cause.to_string();
        let text = text.lines().map(str::trim).filter(|part| !part.is_empty());
        let text = text.collect::<Vec<_>>().join("; ");
        if line.is_empty() {
            line = text;
        } else if !line.contains(&text) {
            line = format!("{line}: {text}");
        }
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context as _;

    #[test]
    fn causes_are_said_once_and_on_one_line() {
        let io = || std::io::Error::other("no space left\non device");
        let quoted = Err::<(), _>(io())
            .context("a.mrec: no space left; on device")
            .unwrap_err();
        assert_eq!(one_line(&quoted), "a.mrec: no space left; on device");
        let chained = Err::<(), _>(io()).context("cannot write a.mrec").unwrap_err();
        assert_eq!(
            one_line(&chained),
            "cannot write a.mrec: no space left; on device"
        );
    }

    #[test]
    fn a_failure_keeps_its_exit_code_through_anyhow() {
        let error = anyhow::Error::new(Failure::input("unknown study `x`"));
        assert_eq!(Failure::from(error).exit_code(), 2);
        assert_eq!(Failure::from(anyhow::anyhow!("diverged")).exit_code(), 1);
        assert_eq!(Failure::Interrupted(String::new()).exit_code(), 130);
        assert_eq!(Failure::ClosedPipe.exit_code(), 0);
    }
}
