//! The patterns of logs in `teachtree.yaml`.

use glob::{MatchOptions, Pattern};
use std::path::Path;
use teachtree_base::error::InputError;

/// `*` stands for a part of a name.
const BY_PARTS: MatchOptions =
    MatchOptions { case_sensitive: true, require_literal_separator: true, require_literal_leading_dot: false };

/// A pattern of logs.
#[derive(Debug)]
pub struct LogPattern {
    /// As it is written.
    pub text: String,
    /// Without a `/` at the beginning.
    glob: Pattern,
}

impl LogPattern {
    /// Reads a pattern of a file in a folder.
    ///
    /// # Errors
    /// What is not a pattern, or fits no log whatever its name; the place is left to the caller.
    pub fn read(text: &str, folder: &Path) -> Result<Self, InputError> {
        if let Some((why, right)) = never_fits(text, folder) {
            let message = format!("`{text}` never matches a log: {why}");
            return Err(InputError::new("", message).help(format!("write {right}")));
        }
        let glob = Pattern::new(text.strip_prefix('/').unwrap_or(text)).map_err(|error| {
            let message = format!("`{text}` is not a pattern of paths: {}", error.msg);
            InputError::new("", message).help("write one such as `*.csv`, `jams/*.csv` or `runs/**`")
        })?;
        Ok(Self { text: text.into(), glob })
    }

    /// Whether it fits a log at this path below the folder of the file. A pattern without `/` fits names in all folders.
    pub fn fits(&self, below: &Path) -> bool {
        let name = Path::new(below.file_name().unwrap_or_default());
        self.glob.matches_path_with(if self.text.contains('/') { below } else { name }, BY_PARTS)
    }

    /// Whether it is also meant for folders that are logs: `*` alone and `**` at the end stand for all logs in a folder.
    pub fn names_folders(&self) -> bool {
        let glob = self.glob.as_str();
        glob.rsplit('/').next() != Some("**") && !glob.split('/').all(|part| ["*", "**"].contains(&part))
    }
}

/// A name as a pattern that fits no other one.
pub fn escaped(name: &str) -> String {
    Pattern::escape(name)
}

/// Why a pattern fits no log, and what to write instead.
fn never_fits(text: &str, folder: &Path) -> Option<(&'static str, String)> {
    let parts = || text.split('/');
    let without = |left_out: &[&str]| {
        let kept: Vec<&str> = parts().filter(|part| !left_out.contains(part)).collect();
        // `./a.csv` is meant beside the file.
        format!("`{}{}`", if text.starts_with("./") { "/" } else { "" }, kept.join("/"))
    };
    let is_drive = text.as_bytes().get(1) == Some(&b':') && text.starts_with(|c: char| c.is_ascii_alphabetic());
    match () {
        () if parts().any(|part| part == "..") => Some((
            "patterns do not lead out of the folder of the file",
            "a `teachtree.yaml` in the folder above".into(),
        )),
        () if text.is_empty() || text == "/" => Some(("it is empty", "`*` for all logs".into())),
        () if is_drive || text.starts_with("~/") || is_absolute(text, folder) => {
            let name = parts().next_back().unwrap_or_default();
            Some((
                "patterns are paths from the folder of the file",
                format!("`{}`", from_folder(text, folder).unwrap_or(name)),
            ))
        }
        () if text.ends_with('/') => Some(("logs in a folder end with their names", format!("`{text}**`"))),
        () if parts().any(|part| part == ".") => Some(("`.` is not a part of the path of a log", without(&["."]))),
        () if parts().skip(1).any(str::is_empty) => Some(("a part of the path is empty", without(&[""]))),
        () => None,
    }
}

/// Whether a path begins with folders of the root rather than with those of the file: `/home/me/logs/*.csv`.
fn is_absolute(text: &str, folder: &Path) -> bool {
    let Some((first, _)) = text.strip_prefix('/').and_then(|below| below.split_once('/')) else { return false };
    from_folder(text, folder).is_some() || Path::new("/").join(first).is_dir() && !folder.join(first).is_dir()
}

/// The rest of an absolute path after the folder of the file.
fn from_folder<'a>(text: &'a str, folder: &Path) -> Option<&'a str> {
    let folder = super::absolute(folder);
    let rest = text.strip_prefix(folder.to_str()?)?.strip_prefix('/')?;
    // Every absolute path begins with the root.
    Some(rest).filter(|rest| folder.parent().is_some() && !rest.is_empty())
}
