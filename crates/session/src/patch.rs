//! Changed numbers as a unified diff of the rule files, comments, units and columns kept.

use similar::TextDiff;
use std::path::Path;
use teachtree_analysis::fit::{FitParam, ParamVector};
use teachtree_language::Rules;
use teachtree_language::param_sites::{self, ParamSite};
use teachtree_logs::read::text;

/// A patch.
pub struct Patch {
    /// What `patch -p0` and `git apply -p0` take.
    pub diff: String,
    /// The files in it that are not on disk as they were read: those that come with the program.
    pub lacking: Vec<String>,
}

/// The patch from the values in the files to a point; `written` and `params` are of one order.
pub fn patch(rules: &Rules, written: &[ParamSite], params: &[FitParam], point: &ParamVector) -> Patch {
    let mut patch = Patch { diff: String::new(), lacking: Vec::new() };
    let moved = written.iter().zip(params).zip(point);
    let moved = moved.filter(|((_, param), value)| param.value.to_bits() != value.to_bits());
    let changes: Vec<(&ParamSite, String)> = moved.map(|((one, param), value)| (one, param.show(*value))).collect();
    for (at, changed) in param_sites::rewritten(rules, &changes) {
        let Some(source) = rules.sources.files.get(at) else { continue };
        patch.diff.push_str(&diff(&source.name, &source.text, &changed));
        let on_disk = text::read(Path::new(&source.name), source.text.len() as u64);
        if on_disk.ok().as_ref() != Some(&source.text) {
            patch.lacking.push(source.name.clone());
        }
    }
    patch
}

/// The unified diff between two texts of a file.
pub fn diff(file: &str, before: &str, after: &str) -> String {
    let name = relative_path(file);
    // A name with a blank ends at a tab.
    let named = if name.contains(char::is_whitespace) { format!("{name}\t") } else { name };
    TextDiff::from_lines(before, after).unified_diff().header(&named, &named).to_string()
}

/// Returns a path relative to the working directory, if it is below that.
fn relative_path(name: &str) -> String {
    let here = std::env::current_dir().ok();
    let inner = here.as_ref().and_then(|here| Path::new(name).strip_prefix(here).ok());
    inner.map_or_else(|| name.to_string(), |inner| inner.display().to_string())
}
