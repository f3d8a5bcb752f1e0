//! Changed numbers as a unified diff of the rule files, comments, units and columns kept.

use crate::analysis::fit::{FitParam, ParamVector};
use crate::language::Rules;
use crate::language::param_sites::ParamSite;
use crate::stream::read::text;
use similar::TextDiff;
use std::path::Path;

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
    for (source, file) in rules.sources.files.iter().zip(0_u32..) {
        let mut changes: Vec<(&ParamSite, String)> = written
            .iter()
            .zip(params)
            .zip(point)
            .filter(|((one, param), value)| one.span.file == file && param.value.to_bits() != value.to_bits())
            .map(|((one, param), value)| (one, param.show(*value)))
            .collect();
        if changes.is_empty() {
            continue;
        }
        // From the end, so that places before stay where they are.
        changes.sort_by_key(|(one, _)| std::cmp::Reverse(one.span.start));
        let mut changed = source.text.clone();
        for (one, number) in changes {
            replace(&mut changed, one.span.start as usize, one.span.end as usize, &number);
        }
        let name = below_here(&source.name);
        // A name with a blank ends at a tab.
        let named = if name.contains(char::is_whitespace) { format!("{name}\t") } else { name.clone() };
        let diff = TextDiff::from_lines(&source.text, &changed).unified_diff().header(&named, &named).to_string();
        patch.diff.push_str(&diff);
        let on_disk = text::read(Path::new(&source.name), source.text.len() as u64);
        if on_disk.ok().as_ref() != Some(&source.text) {
            patch.lacking.push(source.name.clone());
        }
    }
    patch
}

/// Puts a number in the place of another one. Where blanks follow to align what comes next, it stays aligned.
fn replace(text: &mut String, start: usize, end: usize, number: &str) {
    let (Some(old), Some(rest)) = (text.get(start..end), text.get(end..)) else { return };
    let (was, is) = (old.chars().count(), number.chars().count());
    let blanks = rest.len() - rest.trim_start_matches(' ').len();
    let wanted = (blanks + was).saturating_sub(is).max(1);
    let blanks_now = if blanks > 1 { wanted } else { blanks };
    text.replace_range(start..end + blanks, &format!("{number}{}", " ".repeat(blanks_now)));
}

/// A path as it is found from here, where it lies below.
fn below_here(name: &str) -> String {
    let here = std::env::current_dir().ok();
    let inner = here.as_ref().and_then(|here| Path::new(name).strip_prefix(here).ok());
    inner.map_or_else(|| name.to_string(), |inner| inner.display().to_string())
}
