//! The library of the program as files in the user's cache that any editor can open: the shipped rules and the pages of the codes.

use std::env;
use std::ffi::OsString;
use std::io;
use std::path::{Path, PathBuf};
use teachtree_base::diagnostic::{Source, Sources};
use teachtree_language::{Rules, SHIPPED, codes};

/// The files; without a place to write to, none.
#[derive(Debug, Default)]
pub struct Library {
    folder: Option<PathBuf>,
}

impl Library {
    /// Writes the files unless this version of them is there already.
    pub fn open() -> Self {
        let pages = codes::ALL.iter().filter_map(|(code, _)| Some((*code, codes::page(code)?)));
        let texts = SHIPPED.iter().copied().chain(pages);
        let files = texts.map(|(name, text)| Source { name: name.into(), text: text.into() }).collect();
        let digest = Rules { sources: Sources { files }, ..Rules::default() }.digest();
        let version = format!("{}-{digest}", env!("CARGO_PKG_VERSION"));
        let folder = cache().map(|cache| cache.join("teachtree").join(version));
        let folder = folder.filter(|folder| folder.is_dir() || write(folder).is_ok());
        Self { folder: folder.map(|folder| super::uri::real(&folder)) }
    }

    /// Where the shipped file lies that the compiler calls `rules/contact.rules`.
    pub fn file(&self, shown: &str) -> Option<PathBuf> {
        let name = shown.strip_prefix("rules/")?;
        SHIPPED.iter().find(|(shipped, _)| *shipped == name)?;
        Some(self.folder.as_ref()?.join("rules").join(name))
    }

    /// Where the page of a code lies.
    pub fn page(&self, code: &str) -> Option<PathBuf> {
        codes::page(code)?;
        Some(self.folder.as_ref()?.join("codes").join(format!("{code}.md")))
    }

    /// Whether a file is one of these.
    pub fn holds(&self, path: &Path) -> bool {
        self.folder.as_ref().is_some_and(|folder| path.starts_with(folder))
    }
}

/// The user's folder for what can be made again.
fn cache() -> Option<PathBuf> {
    let set = |name: &str| env::var_os(name).filter(|value: &OsString| !value.is_empty()).map(PathBuf::from);
    let home = || env::home_dir().filter(|home| !home.as_os_str().is_empty());
    let usual = || match env::consts::OS {
        "windows" => set("LOCALAPPDATA"),
        "macos" => home().map(|home| home.join("Library/Caches")),
        _ => home().map(|home| home.join(".cache")),
    };
    set("XDG_CACHE_HOME").or_else(usual).filter(|cache| cache.is_absolute())
}

/// Writes all files, read-only, beside their place, and moves them there at once.
fn write(folder: &Path) -> io::Result<()> {
    let parent = folder.parent().ok_or(io::ErrorKind::NotFound)?;
    std::fs::create_dir_all(parent)?;
    let made = tempfile::tempdir_in(parent)?;
    let put = |name: &str, text: &str| {
        let file = made.path().join(name);
        std::fs::write(&file, text)?;
        let mut permissions = std::fs::metadata(&file)?.permissions();
        permissions.set_readonly(true);
        std::fs::set_permissions(&file, permissions)
    };
    std::fs::create_dir(made.path().join("rules"))?;
    std::fs::create_dir(made.path().join("codes"))?;
    for (name, text) in SHIPPED {
        put(&format!("rules/{name}"), text)?;
    }
    for (code, _) in codes::ALL {
        if let Some(page) = codes::page(code) {
            put(&format!("codes/{code}.md"), &format!("# {code}\n\n{page}\n"))?;
        }
    }
    match std::fs::rename(made.path(), folder) {
        // Another server was faster.
        Err(_) if folder.is_dir() => Ok(()),
        Ok(()) => {
            // It has gone where it belongs: there is nothing left to remove.
            let _gone = made.keep();
            Ok(())
        }
        error => error,
    }
}
