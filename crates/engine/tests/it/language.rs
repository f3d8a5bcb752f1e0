//! Rules of `language` on logs: what operators give, and that findings hold.

mod hands;
mod lints;
mod operators;
mod over_time;
mod reference;
mod witnesses;

use teachtree_base::diagnostic::render;
use teachtree_language::LoadedRules;

/// What a user sees of it, without colors.
fn report(loaded: &LoadedRules) -> String {
    render(&loaded.diagnostics, &loaded.sources, false)
}
