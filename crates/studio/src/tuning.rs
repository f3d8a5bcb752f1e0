//! Params of the rules: what can be turned, the rules with other values, and values written back into the rule files.

use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use teachtree_analysis::fit::FitParam;
use teachtree_base::error::InputError;
use teachtree_base::units;
use teachtree_language::MAX_BYTES;
use teachtree_language::param_sites::{self, ParamSite, param_sites};
use teachtree_language::rules::Rules;
use teachtree_logs::atomic_write::Files;
use teachtree_logs::read::text;

/// The params that have a range: name, unit, value in the file, range, how many SI units one of theirs is, and where they stand.
pub fn params(rules: &Rules) -> Value {
    let all = param_sites(rules).into_iter().map(|site| {
        let si = units::compound(&site.unit).map_or(1.0, |(factor, _)| factor);
        let (low, high) = site.range;
        json!({ "name": site.name, "unit": site.unit, "value": site.value, "low": low, "high": high, "si": si,
            "place": rules.sources.place(site.span) })
    });
    all.collect()
}

/// Values as overrides, each written as in a file: `12 mm/s`.
///
/// # Errors
/// A param that has no range, or a value beyond it.
pub fn overrides(rules: &Rules, values: &BTreeMap<String, f64>) -> Result<BTreeMap<String, String>, InputError> {
    let sites = param_sites(rules);
    let own = |(name, value): (&String, &f64)| {
        let wrong = |message: String| InputError::new(format!("param {name}"), message);
        let site = sites.iter().find(|site| site.name == *name);
        let site = site.ok_or_else(|| wrong("is not a param of the rules with a range".into()))?;
        let (low, high) = site.range;
        if !(low..=high).contains(value) {
            return Err(wrong(format!("found {value} {}, expected {low} to {high}", site.unit)));
        }
        Ok((name.clone(), written(site, *value)))
    };
    // What is as in the file is not an override.
    let changed = values.iter().filter(|(name, value)| {
        !sites.iter().any(|site| site.name == **name && site.value.to_bits() == value.to_bits())
    });
    changed.map(own).collect()
}

fn written(site: &ParamSite, value: f64) -> String {
    let ParamSite { name, unit, value: before, range, .. } = site.clone();
    FitParam { name, unit, value: before, range }.show(value)
}

/// Texts by the canonical path of their file.
pub fn buffers(texts: &BTreeMap<String, String>) -> BTreeMap<PathBuf, String> {
    let path = |name: &String| std::fs::canonicalize(name).ok();
    texts.iter().filter_map(|(name, text)| Some((path(name)?, text.clone()))).collect()
}

/// Writes the texts of rules, with values of params in the place of those that stand in them, into their files; all files or none. `read` are the texts of the
/// files as they were read, `edits` those that were changed. Returns the files that were written.
///
/// # Errors
/// A file that comes with the program or was changed since it was read, or that cannot be written.
pub fn save(
    read: &BTreeMap<String, String>,
    now: &Rules,
    edits: &BTreeMap<String, String>,
    values: &BTreeMap<String, String>,
) -> Result<Vec<String>, InputError> {
    let sites = param_sites(now);
    let changes: Vec<(&ParamSite, String)> =
        sites.iter().filter_map(|site| Some((site, values.get(&site.name)?.clone()))).collect();
    if let Some(name) = values.keys().find(|name| !sites.iter().any(|site| site.name == **name)) {
        return Err(InputError::new(format!("param {name}"), "is not a param of the rules with a range"));
    }
    let rewritten: BTreeMap<usize, String> = param_sites::rewritten(now, &changes).into_iter().collect();
    let mut files = Files::default();
    let mut names = Vec::new();
    let files_of_now = now.sources.files.iter().enumerate();
    let texts = files_of_now.map(|(at, source)| {
        (&source.name, rewritten.get(&at).unwrap_or(&source.text), read.get(&source.name).unwrap_or(&source.text))
    });
    // A file that is no longer used keeps what was changed in it.
    let left = edits.iter().filter(|(name, _)| !now.sources.files.iter().any(|source| source.name == **name));
    let left = left.filter_map(|(name, text)| Some((name, text, read.get(name)?)));
    for (name, text, was) in texts.chain(left) {
        if text == was {
            continue;
        }
        let on_disk = text::read(Path::new(name), MAX_BYTES);
        if on_disk.as_ref().ok() != Some(was) {
            let error = match on_disk {
                Ok(_) => InputError::new(name, "was changed since the studio read it")
                    .help("keep a copy of your text, reload the rules and change them again"),
                Err(_) => {
                    let file = name.strip_prefix("rules/").unwrap_or(name);
                    InputError::new(name, "comes with the program and cannot be written")
                        .help(format!("`teachtree show {file} > {file}` makes a copy of your own; start the studio with --rules and that folder's files"))
                }
            };
            return Err(error);
        }
        files.add(Path::new(name), |out| out.write_all(text.as_bytes()))?;
        names.push(name.clone());
    }
    files.commit()?;
    Ok(names)
}
