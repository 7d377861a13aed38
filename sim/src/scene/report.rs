//! Collects the problems of one scene.

use super::document::{Node, Origin};
use super::problem::{Problem, SceneError};
use std::path::{Path, PathBuf};

/// Most problems that are told; who made more mistakes starts with these.
const MOST: usize = 100;

/// The problems found so far, and what was found unusable, so that nothing is complained about twice.
pub(crate) struct Report {
    file: PathBuf,
    root: Option<Node>,
    overrides: Vec<String>,
    problems: Vec<Problem>,
    untold: usize,
    unusable: Vec<String>,
    late_events: bool,
}

impl Report {
    pub(crate) fn new(file: &Path, overrides: &[String]) -> Self {
        Self {
            file: file.to_path_buf(),
            root: None,
            overrides: overrides.to_vec(),
            problems: Vec::new(),
            untold: 0,
            unusable: Vec::new(),
            late_events: false,
        }
    }

    /// Events after the end are no problem: the scene may be one that was shortened for a trial.
    pub(crate) fn allow_late_events(&mut self) {
        self.late_events = true;
    }

    /// Whether events after the end are no problem: whoever shortens a scene by `--set duration` need not take its later
    /// events out.
    pub(crate) fn allows_late_events(&self) -> bool {
        self.late_events || matches!(self.origin("duration"), Some(Origin::Override(_)))
    }

    /// From now on key paths are looked up in this tree.
    pub(crate) fn set_document(&mut self, root: Node) {
        self.root = Some(root);
    }

    /// Adds a problem whose place is known.
    pub(crate) fn add(&mut self, problem: Problem) {
        if self.problems.len() < MOST {
            self.problems.push(problem);
        } else {
            self.untold += 1;
        }
    }

    /// Adds a problem of the key at `path`, with its line or the override that it came from.
    pub(crate) fn at(&mut self, path: &str, message: impl Into<String>, remedy: impl Into<String>) {
        let mut message = message.into();
        let line = match self.origin(path) {
            Some(Origin::Line(line)) => Some(line),
            Some(Origin::Override(k)) => {
                if let Some(text) = self.overrides.get(k) {
                    message = format!("{message} (from `--set {text}`)");
                }
                None
            }
            None => None,
        };
        self.add(Problem {
            file: self.file.clone(),
            line,
            key: path.to_string(),
            message,
            remedy: remedy.into(),
        });
    }

    /// Whether there are so many problems that further ones are only counted. What was checked one by one so far ends
    /// here: checking what remains against every problem would take time that grows with the square of their number.
    pub(crate) fn is_full(&self) -> bool {
        self.problems.len() >= MOST
    }

    /// Number of values marked unusable so far.
    pub(crate) fn unusable_count(&self) -> usize {
        self.unusable.len()
    }

    /// As [`Self::at`]; message and remedy are only made if they will be told.
    pub(crate) fn at_lazily(&mut self, path: &str, text: impl FnOnce() -> (String, String)) {
        if self.is_full() {
            self.untold += 1;
        } else {
            let (message, remedy) = text();
            self.at(path, message, remedy);
        }
    }

    /// As [`Self::at`]; the value at `path` is then not used for anything else.
    pub(crate) fn unusable(&mut self, path: &str, message: impl Into<String>, remedy: impl Into<String>) {
        self.at(path, message, remedy);
        self.mark_unusable(path);
    }

    /// Nothing below `path` is used for anything else.
    pub(crate) fn mark_unusable(&mut self, path: &str) {
        self.unusable.push(path.to_string());
    }

    /// Whether nothing was wrong with the values at these paths, with what they contain or with what contains them.
    pub(crate) fn usable(&self, paths: &[&str]) -> bool {
        let inside = |inner: &str, outer: &str| {
            outer.is_empty()
                || inner
                    .strip_prefix(outer)
                    .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        paths
            .iter()
            .all(|p| !self.unusable.iter().any(|u| inside(p, u) || inside(u, p)))
    }

    /// Where the value at `path`, or what should contain it, was written.
    pub(crate) fn origin(&self, path: &str) -> Option<Origin> {
        self.root.as_ref().map(|root| root.nearest(path).origin)
    }

    /// Forgets the lines of a text that the user has never seen.
    pub(crate) fn forget_lines(&mut self) {
        self.root = None;
        self.problems.iter_mut().for_each(|p| p.line = None);
    }

    /// The result if nothing was wrong, else the problems.
    ///
    /// # Errors
    /// [`SceneError`] if there is any problem.
    pub(crate) fn finish_with<T>(mut self, result: Option<T>) -> Result<T, SceneError> {
        match result {
            Some(result) if self.problems.is_empty() => return Ok(result),
            None if self.problems.is_empty() => {
                self.at(
                    "",
                    "the scene cannot be put together",
                    "check that every table is there",
                );
            }
            _ => {}
        }
        Err(self.into_error())
    }

    /// The problems: those of the scene file first, in order of line.
    pub(crate) fn into_error(mut self) -> SceneError {
        let scene = self.file.clone();
        self.problems
            .sort_by_key(|p| (p.file != scene, p.file.clone(), p.line.unwrap_or(u32::MAX)));
        if self.untold > 0 {
            self.problems.push(Problem {
                file: self.file,
                line: None,
                key: String::new(),
                message: format!("and {} more problems", self.untold),
                remedy: "correct those above first".into(),
            });
        }
        SceneError {
            problems: self.problems,
        }
    }
}
