//! Tests of `language`.

mod diagnostics;
mod format;
mod garbage;
mod hands;
mod kinds;
mod lints;
mod operators;
mod over_time;
mod reference;
mod shipped;
mod syntax;
mod trees;
mod witnesses;

use teachtree_base::diagnostic::render;
use teachtree_language::LoadedRules;

/// What a user sees of it, without colours.
fn report(loaded: &LoadedRules) -> String {
    render(&loaded.diagnostics, &loaded.sources, false)
}
