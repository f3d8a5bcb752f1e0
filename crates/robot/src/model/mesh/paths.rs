//! Where the file of a mesh is: a path from the URDF, `file://…`, or `package://NAME/…`.

use super::BytesOf;
use super::formats::{ENDINGS, ending};
use indexmap::IndexMap;
use std::path::{Component, Path, PathBuf};
use teachtree_base::error::InputError;

/// The folders of packages, and the folder from which they are searched.
pub(in super::super) struct Packages<'a> {
    /// The folder of the URDF.
    pub(in super::super) folder: &'a Path,
    /// The folders that the robot file names, by package.
    pub(in super::super) named: IndexMap<String, PathBuf>,
}

impl Packages<'_> {
    /// The path and the bytes of a mesh. The place of an error is left to the caller.
    pub(super) fn find(&self, file: &str, bytes_of: BytesOf<'_>) -> Result<(PathBuf, Vec<u8>), InputError> {
        let refuse = |message: String| InputError::new("", message);
        if !ENDINGS.contains(&ending(Path::new(file)).as_str()) {
            let known = ENDINGS.map(|ending| format!("`.{ending}`")).join(", ");
            return Err(refuse(format!("the mesh is `{file}`, expected a file that ends in one of {known}"))
                .help("convert it, or leave meshes out by `meshes: none` in the robot file"));
        }
        let package = file.strip_prefix("package://").or_else(|| file.strip_prefix("model://"));
        let mut tried = Vec::new();
        let places = match (package, file.strip_prefix("file://")) {
            (Some(rest), _) => {
                let (package, rest) = rest.split_once('/').unwrap_or((rest, ""));
                if Path::new(rest).components().any(|part| !matches!(part, Component::Normal(_))) {
                    return Err(refuse(format!("`{file}` leaves its package")));
                }
                self.in_package(package, Path::new(rest), bytes_of)?
            }
            (_, Some(path)) => vec![PathBuf::from(path)],
            _ if file.contains("://") => {
                return Err(refuse(format!(
                    "`{file}` is of no kind that is read, expected a path, `file://…` or `package://…`"
                )));
            }
            _ => vec![self.folder.join(file)],
        };
        for path in places {
            if let Some(bytes) = bytes_of(&path)? {
                return Ok((path, bytes));
            }
            tried.push(format!("`{}`", path.display()));
        }
        let error =
            refuse(format!("`{file}` is missing: {} does not exist", tried.first().map_or("it", String::as_str)));
        Err(match package.and_then(|rest| rest.split('/').next()) {
            Some(package) => {
                error.help(format!("say where the package is in the robot file: `packages: {{{package}: FOLDER}}`"))
            }
            None => error,
        })
    }

    /// Where a file of a package may be: in the folder that the robot file names; else in a folder above the URDF that has the name of the package, beside
    /// one, or where `package.xml` has its name.
    fn in_package(&self, package: &str, rest: &Path, bytes_of: BytesOf<'_>) -> Result<Vec<PathBuf>, InputError> {
        if let Some(folder) = self.named.get(package) {
            return Ok(vec![folder.join(rest)]);
        }
        let mut places = Vec::new();
        let folder = std::path::absolute(self.folder).unwrap_or_else(|_| self.folder.into());
        for above in folder.ancestors() {
            if above.file_name().is_some_and(|name| name == package) {
                places.push(above.join(rest));
            }
            places.push(above.join(package).join(rest));
            if let Ok(Some(text)) = bytes_of(&above.join("package.xml"))
                && String::from_utf8_lossy(&text).contains(&format!("<name>{package}</name>"))
            {
                places.push(above.join(rest));
            }
        }
        Ok(places)
    }
}
