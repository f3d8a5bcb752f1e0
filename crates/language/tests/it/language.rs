//! Tests of `language`.

mod diagnostics;
mod format;
mod garbage;
mod hands;
mod kinds;
mod lints;
mod reference;
mod shipped;
mod syntax;
mod trees;

use teachtree_base::diagnostic::render;
use teachtree_language::LoadedRules;

/// What a user sees of it in the folder of the project, without colors.
fn report(loaded: &LoadedRules) -> String {
    render(&loaded.diagnostics, &loaded.sources, false).replace(&format!("{}/", crate::ROOT), "")
}
