//! The missing `use` of a shipped file that declares an unknown name.

use super::names::Declarations;
use crate::{parse, source::SHIPPED};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::LazyLock;
use teachtree_base::diagnostic::Sources;

/// The declarations of each shipped file.
static DECLARED: LazyLock<Vec<(&str, BTreeSet<String>)>> =
    LazyLock::new(|| SHIPPED.iter().map(|(file, text)| (*file, names(text))).collect());

/// The shipped file to `use` for a name (for a channel: without the hand), when none of `sources` stands for the one that declares it.
pub fn missing_use(name: &str, sources: &Sources) -> Option<&'static str> {
    let is_read = |file: &str| sources.files.iter().any(|source| Path::new(&source.name).ends_with(file));
    let (file, _) = DECLARED.iter().find(|(file, names)| names.contains(name) && !is_read(file))?;
    // Rules that refer to the tree of one hand usually need its contact signals too.
    Some(if *file == "single_hand.rules" && !is_read("contact.rules") { "contact.rules" } else { file })
}

/// The names that a file declares: values, primitives, trees, tasks, and the first words of channels.
fn names(text: &str) -> BTreeSet<String> {
    let (file, _) = parse::parse(text, 0);
    let declared = Declarations::collect(&[&file]);
    let Declarations { channels, params, signals, latches, primitives, trees, tasks, .. } = declared;
    let mut names = BTreeSet::new();
    names.extend(params.iter().map(|param| &param.name.text));
    names.extend(signals.iter().map(|(signal, _)| &signal.name.text));
    names.extend(latches.iter().map(|(latch, _)| &latch.name.text));
    names.extend(primitives.iter().map(|primitive| &primitive.name.text));
    names.extend(trees.iter().map(|tree| &tree.name.text));
    names.extend(tasks.iter().map(|(task, _)| &task.name.text));
    names.extend(channels.iter().filter_map(|channel| channel.name.parts.first()).map(|head| &head.text));
    names.into_iter().cloned().collect()
}
