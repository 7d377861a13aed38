//! The files that were opened last, kept in a text file, one a line.

use std::path::{Path, PathBuf};

/// Most files that are remembered.
const MOST: usize = 12;

/// See the module.
#[derive(Clone, Debug, Default)]
pub struct Recent {
    /// Where they are kept; nowhere if `None`.
    file: Option<PathBuf>,
    list: Vec<PathBuf>,
}

impl Recent {
    /// Kept in `file`, where there is one. A list that cannot be read is empty.
    pub fn at(file: Option<PathBuf>) -> Self {
        let text = file.as_ref().and_then(|file| std::fs::read_to_string(file).ok());
        let list = text.map_or_else(Vec::new, |text| text.lines().map(PathBuf::from).collect());
        Self { file, list }
    }

    /// The user's own list.
    pub fn of_user() -> Self {
        let folder = |name| {
            std::env::var_os(name)
                .filter(|v| !v.is_empty())
                .map(PathBuf::from)
        };
        let config = folder("XDG_CONFIG_HOME")
            .or_else(|| folder("APPDATA"))
            .or_else(|| folder("HOME").map(|home| home.join(".config")));
        Self::at(config.map(|config| config.join("meniscus").join("recent")))
    }

    /// The files, the latest first.
    pub fn list(&self) -> &[PathBuf] {
        &self.list
    }

    /// Puts a file first. That the list cannot be kept is no reason to trouble anyone.
    pub fn add(&mut self, path: &Path) {
        let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        self.list.retain(|known| *known != path);
        self.list.insert(0, path);
        self.list.truncate(MOST);
        if let Some(file) = &self.file {
            let lines: Vec<String> = self.list.iter().map(|p| p.display().to_string()).collect();
            let folder = file.parent().map(std::fs::create_dir_all);
            if matches!(folder, Some(Ok(()))) {
                let _ = std::fs::write(file, lines.join("\n"));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_comes_first_and_the_list_survives() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("deep/recent");
        let mut recent = Recent::at(Some(file.clone()));
        for name in ["a", "b", "a"] {
            recent.add(Path::new(name));
        }
        assert_eq!(recent.list(), [Path::new("a"), Path::new("b")]);
        assert_eq!(Recent::at(Some(file)).list(), recent.list());
        for k in 0..100 {
            recent.add(Path::new(&k.to_string()));
        }
        assert_eq!(recent.list().len(), MOST);
        assert!(Recent::at(None).list().is_empty());
    }
}
